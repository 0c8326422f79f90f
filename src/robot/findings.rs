//! What is easily missed about a URDF: found, and said with its place and what to do.

use std::fmt;

use nalgebra::{Isometry3, Vector3};
use urdf_rs::{Geometry, JointType};

use super::drive::{Axle, Drive, PARALLEL};
use super::joints::{Roles, range, velocity};
use super::tree::{self, Tree};
use super::urdf::Urdf;
use super::wheels::Wheels;
use crate::diag::Span;

/// Lengths that differ by less are the same, m.
const SAME: f64 = 1e-3;

/// Something about a URDF that is easily missed. Displayed as `FILE:LINE: what, and what to do`.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Stable identifier, such as `telescope`.
    pub code: &'static str,
    /// Where in the URDF.
    pub at: Span,
    /// What was found, and what follows from it.
    pub message: String,
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line = self.at.source.text[..self.at.range.start].bytes().filter(|b| *b == b'\n').count() + 1;
        write!(f, "{}:{line}: {}", self.at.source.name, self.message)
    }
}

/// A URDF and what its joints do.
pub(super) struct Facts<'a> {
    pub urdf: &'a Urdf,
    pub tree: &'a Tree,
    pub wheels: &'a Wheels,
    pub roles: &'a Roles,
    pub drive: &'a Drive,
}

impl Facts<'_> {
    fn name(&self, joint: usize) -> &str {
        &self.urdf.robot.joints[joint].name
    }

    fn names(&self, joints: &[usize]) -> String {
        joints.iter().map(|j| format!("`{}`", self.name(*j))).collect::<Vec<_>>().join(", ")
    }

    /// root <- link, all joints as at the zero posture.
    fn poses(&self) -> Vec<Isometry3<f64>> {
        self.tree.link_poses(self.urdf, |joint| self.roles.at_zero(joint))
    }

    /// The joint that carries a link.
    fn carrier(&self, link: usize) -> Option<usize> {
        self.tree.child.iter().position(|child| *child == link)
    }

    /// All that was found, in the order of this file.
    pub fn findings(&self) -> Vec<Finding> {
        let parts = [
            self.skid_steer(),
            self.turned_wheels(),
            self.wheels_off_their_joints(),
            self.castors(),
            self.telescopes(),
            self.root_off_the_floor(),
        ];
        self.suspensions_found().into_iter().chain(parts.into_iter().flatten()).collect()
    }

    fn finding(&self, code: &'static str, joint: usize, message: String) -> Finding {
        Finding { code, at: self.urdf.joint_spans[joint].clone(), message }
    }

    /// Joints that move and carry a driving wheel.
    pub fn suspensions(&self) -> Vec<usize> {
        let mut out = Vec::new();
        for wheel in self.wheels.all() {
            let mut link = self.tree.parent[wheel];
            while let Some(joint) = self.carrier(link) {
                if self.urdf.robot.joints[joint].joint_type != JointType::Fixed && !out.contains(&joint) {
                    out.push(joint);
                }
                link = self.tree.parent[joint];
            }
        }
        out.sort_unstable();
        out
    }

    fn suspensions_found(&self) -> Vec<Finding> {
        let said = |joint: &usize| {
            let name = self.name(*joint);
            let moving = if self.roles.moving.contains(joint) {
                format!(
                    "as it is, the planner moves it and takes the base frame at 0: hold it, `joints: {{fixed: {{{name}: 0}}}}` in robot.yaml"
                )
            } else {
                "it is held".into()
            };
            self.finding(
                "suspension",
                *joint,
                format!("`{name}` moves and carries a driving wheel, as a suspension does; {moving}"),
            )
        };
        self.suspensions().iter().map(said).collect()
    }

    fn skid_steer(&self) -> Vec<Finding> {
        let count = self.wheels.left.len() + self.wheels.right.len();
        if count == 2 {
            return Vec::new();
        }
        let message = format!(
            "{count} driving wheels on several axles: they skid in turns, and the robot turns less than `track_width_m` says; \
             cannot be known from the URDF: measure a turn on the spot"
        );
        vec![self.finding("skid-steer", self.wheels.left[0], message)]
    }

    fn turned_wheels(&self) -> Vec<Finding> {
        let poses = self.poses();
        let axis = |joint: &usize| Axle::of(self.urdf, self.tree, &poses, *joint).axis;
        let first = axis(&self.wheels.left[0]);
        let turned: Vec<usize> = self.wheels.all().filter(|j| axis(j).dot(&first) < 0.0).collect();
        let Some(one) = turned.first() else { return Vec::new() };
        let message = format!(
            "the axis of {} points the other way than that of `{}`: in command files a positive wheel speed always drives forward",
            self.names(&turned),
            self.name(self.wheels.left[0])
        );
        vec![self.finding("turned-wheel", *one, message)]
    }

    /// Distance between the middles of the wheels' shapes, where these are not at their joints' origins, m.
    pub fn track_of_shapes(&self) -> Option<f64> {
        let poses = self.poses();
        let middle = |joint: &usize| -> Option<Vector3<f64>> {
            let link = self.tree.child[*joint];
            let shapes = &self.urdf.robot.links[link].collision;
            let round =
                shapes.iter().find(|c| matches!(c.geometry, Geometry::Cylinder { .. } | Geometry::Sphere { .. }))?;
            Some((poses[link] * tree::pose(&round.origin)).translation.vector)
        };
        let mean = |side: &[usize]| -> Option<Vector3<f64>> {
            let middles: Option<Vec<_>> = side.iter().map(middle).collect();
            Some(middles?.iter().sum::<Vector3<f64>>() / side.len() as f64)
        };
        let track = (mean(&self.wheels.left)? - mean(&self.wheels.right)?).xy().norm();
        ((track - self.joint_distance()).abs() > SAME).then_some(track)
    }

    /// Distance between the driving wheels' joints, m.
    pub fn joint_distance(&self) -> f64 {
        let poses = self.poses();
        let mean = |side: &[usize]| {
            let at = |j: &usize| poses[self.tree.child[*j]].translation.vector;
            side.iter().map(at).sum::<Vector3<f64>>() / side.len() as f64
        };
        (mean(&self.wheels.left) - mean(&self.wheels.right)).norm()
    }

    fn wheels_off_their_joints(&self) -> Vec<Finding> {
        let Some(track) = self.track_of_shapes() else { return Vec::new() };
        let message = format!(
            "the wheels' joints are {:.4} m apart, the middles of their cylinders {track:.4} m: wheels touch the floor there, so give \
             drive.track_width_m in robot.yaml",
            self.joint_distance()
        );
        vec![self.finding("wheel-off-joint", self.wheels.left[0], message)]
    }

    /// Continuous joints that neither drive nor are moved.
    fn castors(&self) -> Vec<Finding> {
        let joints = &self.urdf.robot.joints;
        let wheels: Vec<usize> = self.wheels.all().collect();
        let idle = |j: &usize| {
            joints[*j].joint_type == JointType::Continuous
                && joints[*j].mimic.is_none()
                && !wheels.contains(j)
                && !self.roles.moving.contains(j)
        };
        let castors: Vec<usize> = (0..joints.len()).filter(idle).collect();
        let Some(first) = castors.first() else { return Vec::new() };
        let message = format!("castors, or other joints that nothing drives, held at 0: {}", self.names(&castors));
        vec![self.finding("castors", *first, message)]
    }

    /// Slides along one line, one carried by the other, with equal ranges and speeds: segments of a telescope.
    pub fn telescope_groups(&self) -> Vec<Vec<usize>> {
        let joints = &self.urdf.robot.joints;
        let poses = self.poses();
        let slides = |j: usize| joints[j].joint_type == JointType::Prismatic && self.roles.moving.contains(&j);
        let along = |j: usize| poses[self.tree.child[j]].rotation * tree::axis(&joints[j]).into_inner();
        let alike = |a: usize, b: usize| {
            let ([l, u], [m, v]) = (range(self.urdf, a), range(self.urdf, b));
            let lengths = ((u - l) - (v - m)).abs() < SAME;
            lengths && velocity(&joints[a]) == velocity(&joints[b]) && (along(a) - along(b)).norm() < PARALLEL
        };
        // The next moved joint below a link, through fixed ones.
        let above = |j: usize| {
            let mut link = self.tree.parent[j];
            loop {
                let carrier = self.carrier(link)?;
                if joints[carrier].joint_type != JointType::Fixed {
                    return Some(carrier);
                }
                link = self.tree.parent[carrier];
            }
        };
        let mut groups: Vec<Vec<usize>> = Vec::new();
        for j in self.tree.order.iter().copied().filter(|j| slides(*j)) {
            let group = above(j).filter(|a| slides(*a) && alike(*a, j));
            let group = group.and_then(|a| groups.iter_mut().find(|g| g.last() == Some(&a)));
            match group {
                Some(group) => group.push(j),
                None => groups.push(vec![j]),
            }
        }
        groups.retain(|group| group.len() > 1);
        groups
    }

    fn telescopes(&self) -> Vec<Finding> {
        let said = |group: &Vec<usize>| {
            let (first, rest) = (self.name(group[0]), self.names(&group[1..]));
            let message = format!(
                "`{first}` and {rest} slide along one line, each on the one before, with equal ranges, and none mimics another: \
                 segments of a telescope? Here each moves by itself. If one motor drives them, add <mimic joint=\"{first}\"/> to {rest} \
                 in the URDF"
            );
            self.finding("telescope", group[0], message)
        };
        self.telescope_groups().iter().map(said).collect()
    }

    fn root_off_the_floor(&self) -> Vec<Finding> {
        let pose = &self.drive.base_from_root;
        let (at, turned) = (pose.translation.vector, pose.rotation.angle());
        if at.norm() <= SAME && turned <= PARALLEL {
            return Vec::new();
        }
        let message = format!(
            "root link `{}` is at ({:.4}, {:.4}, {:.4}) m in the base frame, turned by {:.1} degrees: poses of missions and commands are \
             the base frame's, on the floor below the middle of the driving wheels",
            self.urdf.robot.links[self.tree.root].name,
            at.x + 0.0,
            at.y + 0.0,
            at.z + 0.0,
            turned.to_degrees()
        );
        vec![Finding { code: "root-off-floor", at: self.urdf.link_spans[self.tree.root].clone(), message }]
    }
}
