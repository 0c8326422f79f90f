//! Which links are checked against each other, and which are not.
//!
//! A link and its parent are never checked: a joint's two sides overlap by design. Beyond that robot.yaml's `collision.ignore_pairs`
//! decides. Without it three more kinds are left out, and listed in every report: links that touch in every posture, of which no motion
//! could be certified; the tubes of a telescope that touch with every joint at rest, one being inside the other; and whatever else
//! touches at rest, a posture that robots are drawn in and can be in, so that shapes drawn too large are the likelier reason. `robot
//! init` writes down the first two kinds only, and asks for a look at the third.

use std::collections::BTreeSet;

use nalgebra::{Isometry3, Vector3};

use super::drive::PARALLEL;
use super::joints::{self, Roles};
use super::spec::RobotSpec;
use super::tree::Tree;
use super::urdf::Urdf;
use super::{RobotModel, Shape};
use crate::math::{gjk, halton};

/// Shapes nearer than this touch, m.
const TOUCH: f64 = 1e-6;
/// Postures that are looked at besides rest, to tell which links always touch.
pub(super) const SURVEYED: usize = 1000;

/// A pair of links that move against each other but are not checked against each other.
#[derive(Debug, Clone, PartialEq)]
pub struct IgnoredPair {
    /// In the order of the URDF.
    pub links: [String; 2],
    /// Why.
    pub reason: IgnoreReason,
}

/// Why a pair of links is not checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum IgnoreReason {
    /// A joint joins them.
    Joined,
    /// robot.yaml's `collision.ignore_pairs`.
    Named,
    /// They touch at rest and in every one of the postures looked at.
    Always,
    /// They touch at rest, and are parts of one telescope: slides along one line, each on the one before.
    Telescope,
    /// They touch with every joint at rest, and robot.yaml has no `collision.ignore_pairs`.
    AtRest,
}

/// Pairs that are not checked, in the order of their shapes.
pub(super) fn ignored(
    spec: &RobotSpec,
    urdf: &Urdf,
    tree: &Tree,
    roles: &Roles,
    robot: &RobotModel,
) -> Vec<IgnoredPair> {
    let links = &urdf.robot.links;
    let both_ways = |[a, b]: [&'_ str; 2]| [[a.to_string(), b.to_string()], [b.to_string(), a.to_string()]];
    let ends =
        (0..urdf.robot.joints.len()).map(|j| [tree.parent[j], tree.child[j]].map(|link| links[link].name.as_str()));
    let joined: BTreeSet<[String; 2]> = ends.flat_map(both_ways).collect();
    let named: Option<BTreeSet<[String; 2]>> = spec
        .ignore_pairs
        .as_ref()
        .map(|pairs| pairs.iter().flat_map(|[a, b]| both_ways([&a.value, &b.value])).collect());

    let of = |reason: IgnoreReason, found: &dyn Fn(&[String; 2]) -> bool| {
        let mut out: Vec<IgnoredPair> = Vec::new();
        for [a, b] in moving_pairs(&robot.shapes) {
            let links = [a, b].map(|shape| robot.shapes[shape].link.clone());
            if found(&links) && !out.iter().any(|known| known.links == links) {
                out.push(IgnoredPair { links, reason });
            }
        }
        out
    };
    let mut ignored = of(IgnoreReason::Joined, &|links| joined.contains(links));
    match named {
        Some(named) => {
            ignored.extend(of(IgnoreReason::Named, &|links| named.contains(links) && !joined.contains(links)))
        }
        None => {
            // Over the URDF's own ranges, whatever a mission narrows them to.
            let mut own = RobotModel { ignore_pairs: ignored.clone(), ..robot.clone() };
            for (joint, index) in own.joints.iter_mut().zip(&roles.moving) {
                [joint.lower, joint.upper] = joints::range(urdf, *index);
            }
            own.ignore_pairs.extend(by_design(&own));
            let rest: Vec<f64> = own.joints.iter().map(|j| at_rest([j.lower, j.upper])).collect();
            let poses = own.shape_poses(&rest);
            for [a, b] in own.self_pairs() {
                let links = [a, b].map(|shape| own.shapes[shape].link.clone());
                let new = !own.ignore_pairs.iter().any(|known| known.links == links);
                if new && touch(&own.shapes[a], &poses[a], &own.shapes[b], &poses[b]) {
                    own.ignore_pairs.push(IgnoredPair { links, reason: IgnoreReason::AtRest });
                }
            }
            ignored = own.ignore_pairs;
        }
    }
    ignored
}

/// Pairs of those that are checked that need not be: always touching, or in one telescope.
pub(super) fn by_design(robot: &RobotModel) -> Vec<IgnoredPair> {
    let rest: Vec<f64> = robot.joints.iter().map(|j| at_rest([j.lower, j.upper])).collect();
    let telescopes = telescopes(robot, &rest);
    let poses = robot.shape_poses(&rest);
    let meet =
        |[a, b]: [usize; 2], poses: &[Isometry3<f64>]| touch(&robot.shapes[a], &poses[a], &robot.shapes[b], &poses[b]);
    let mut left: Vec<[usize; 2]> = robot.self_pairs();
    left.retain(|pair| meet(*pair, &poses));
    let in_one = |pair: &[usize; 2]| {
        let bodies = pair.map(|shape| robot.shapes[shape].body);
        telescopes.iter().any(|group| bodies.iter().all(|body| group.contains(body)))
    };
    let nested: Vec<[usize; 2]> = left.iter().copied().filter(in_one).collect();
    left.retain(|pair| !in_one(pair));
    for posture in 1..=SURVEYED {
        if left.is_empty() {
            break;
        }
        let poses = robot.shape_poses(&spread(robot, posture));
        left.retain(|pair| meet(*pair, &poses));
    }
    let mut out: Vec<IgnoredPair> = Vec::new();
    for (reason, pairs) in [(IgnoreReason::Always, left), (IgnoreReason::Telescope, nested)] {
        for pair in pairs {
            let links = pair.map(|shape| robot.shapes[shape].link.clone());
            if !out.iter().any(|known| known.links == links) {
                out.push(IgnoredPair { links, reason });
            }
        }
    }
    out
}

/// Bodies of each telescope: two or more that slide along one line, each on the one before, and what carries the first.
fn telescopes(robot: &RobotModel, rest: &[f64]) -> Vec<Vec<usize>> {
    let mut poses = Vec::new();
    robot.body_poses(rest, &mut poses);
    let along = |body: usize| {
        let motion = robot.bodies[body].motion.as_ref().filter(|m| m.prismatic)?;
        Some(poses[body].rotation * motion.axis.into_inner())
    };
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for body in 1..robot.bodies.len() {
        let parent = robot.bodies[body].parent;
        let Some(axis) = along(body) else { continue };
        let goes_on = along(parent).is_some_and(|before| before.cross(&axis).norm() < PARALLEL);
        match groups.iter_mut().find(|group| goes_on && group.last() == Some(&parent)) {
            Some(group) => group.push(body),
            None => groups.push(vec![parent, body]),
        }
    }
    groups.retain(|group| group.len() > 2);
    groups
}

/// A joint at rest: 0, or the nearest limit.
pub(super) fn at_rest([lower, upper]: [f64; 2]) -> f64 {
    0f64.max(lower).min(upper)
}

/// Pairs of shapes on bodies that move against each other, of two links.
fn moving_pairs(shapes: &[Shape]) -> impl Iterator<Item = [usize; 2]> + '_ {
    let apart = |a: &Shape, b: &Shape| a.body != b.body && a.link != b.link;
    (0..shapes.len())
        .flat_map(move |a| (a + 1..shapes.len()).map(move |b| [a, b]))
        .filter(move |[a, b]| apart(&shapes[*a], &shapes[*b]))
}

impl RobotModel {
    /// Pairs of shapes, by index, that must not touch each other: on bodies that move against each other, of links that are not in
    /// [`RobotModel::ignore_pairs`].
    pub fn self_pairs(&self) -> Vec<[usize; 2]> {
        let ignored: BTreeSet<[&str; 2]> = self
            .ignore_pairs
            .iter()
            .flat_map(|pair| {
                let [a, b] = [pair.links[0].as_str(), pair.links[1].as_str()];
                [[a, b], [b, a]]
            })
            .collect();
        moving_pairs(&self.shapes)
            .filter(|[a, b]| !ignored.contains(&[&*self.shapes[*a].link, &*self.shapes[*b].link]))
            .collect()
    }
}

impl RobotModel {
    /// A pair of shapes of `pairs`, as from [`RobotModel::self_pairs`], that touch each other at joint values `q`.
    pub fn touching(&self, pairs: &[[usize; 2]], q: &[f64]) -> Option<[usize; 2]> {
        let poses = self.shape_poses(q);
        let meet = |[a, b]: &&[usize; 2]| touch(&self.shapes[*a], &poses[*a], &self.shapes[*b], &poses[*b]);
        pairs.iter().find(meet).copied()
    }
}

/// Two links that touch in some of the postures that were looked at.
pub(super) struct Meeting {
    /// In the order of the URDF.
    pub links: [String; 2],
    /// With all joints at rest.
    pub at_rest: bool,
    /// In how many of [`SURVEYED`] postures.
    pub count: usize,
}

/// Looks at the robot at rest and at postures spread evenly over the ranges of its joints (a Halton sequence: the same ones each time).
/// Pairs that are ignored already are left out.
pub(super) fn meetings(robot: &RobotModel) -> Vec<Meeting> {
    let pairs = robot.self_pairs();
    let rest: Vec<f64> = robot.joints.iter().map(|j| at_rest([j.lower, j.upper])).collect();
    let mut out: Vec<Meeting> = Vec::new();
    for posture in 0..=SURVEYED {
        let q = if posture == 0 { rest.clone() } else { spread(robot, posture) };
        let poses = robot.shape_poses(&q);
        let mut met: BTreeSet<[&str; 2]> = BTreeSet::new();
        for [a, b] in &pairs {
            let (one, other) = (&robot.shapes[*a], &robot.shapes[*b]);
            if touch(one, &poses[*a], other, &poses[*b]) {
                met.insert([&one.link, &other.link]);
            }
        }
        for links in met {
            let known = out.iter_mut().position(|m| m.links == links);
            let index = known.unwrap_or_else(|| {
                out.push(Meeting { links: links.map(str::to_string), at_rest: false, count: 0 });
                out.len() - 1
            });
            if posture == 0 {
                out[index].at_rest = true;
            } else {
                out[index].count += 1;
            }
        }
    }
    out
}

/// Posture `index` of a Halton sequence over the joints' ranges; endless joints turn once.
fn spread(robot: &RobotModel, index: usize) -> Vec<f64> {
    let value = |(axis, joint): (usize, &super::MovingJoint)| {
        let [low, high] = joint.range_about(0.0);
        low + halton::value(axis, index) * (high - low)
    };
    robot.joints.iter().enumerate().map(value).collect()
}

/// Whether two shapes overlap or are nearer than [`TOUCH`].
fn touch(a: &Shape, pose_a: &Isometry3<f64>, b: &Shape, pose_b: &Isometry3<f64>) -> bool {
    let between = pose_a.translation.vector - pose_b.translation.vector;
    if between.norm() > a.convex.bounding_radius() + b.convex.bounding_radius() + TOUCH {
        return false;
    }
    let farthest = |shape: &Shape, pose: &Isometry3<f64>, d: &Vector3<f64>| {
        pose.translation.vector + pose.rotation * shape.convex.support(&pose.rotation.inverse_transform_vector(d))
    };
    let support = |d: &Vector3<f64>| farthest(a, pose_a, d) - farthest(b, pose_b, &-d);
    let decided = |gap: gjk::Gap| gap.lower > TOUCH || gap.upper <= TOUCH;
    gjk::distance_from_origin(support, between, decided).lower <= TOUCH
}
