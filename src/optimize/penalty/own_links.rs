//! Clearance of the robot's own links from each other.
//!
//! Of a pair of shapes the distance and the nearest points come from [`gjk`]; the distance changes as these points, fixed to their
//! bodies, move along the line between them (the envelope theorem: that the points wander over the shapes counts nothing). Shapes that
//! overlap are driven apart by the distance of their cores, smaller shapes inside them.

use nalgebra::Vector3;

use super::touch::BodyFrame;
use crate::math::gjk;
use crate::optimize::contour::Reach;
use crate::robot::{Convex, RobotModel, Shape};

/// What is asked for between two links, m: the certificate asks for more than nothing only.
pub(super) const MARGIN: f64 = 0.01;
/// A pair counts like so many contour points: it is one place, where an obstacle is near many of them.
pub(super) const WEIGHT: f64 = 10.0;
/// Distances beyond the margin by more than this are not sought, m.
const ENOUGH: f64 = 0.05;
/// How exactly a distance is sought, m.
const TOLERANCE: f64 = 1e-7;
/// Below this shapes count as overlapping, m: the direction between nearest points is lost in rounding.
const TOUCHING: f64 = 1e-6;
/// Cores are smaller than their shapes by this share of their least half width, on every side; hulls shrink to half their size.
const CORE: f64 = 0.9;

/// Pairs of shapes that must not touch.
#[derive(Debug, Clone)]
pub(super) struct OwnLinks {
    pub pairs: Vec<Pair>,
}

/// A pair of shapes.
#[derive(Debug, Clone)]
pub(super) struct Pair {
    shapes: [usize; 2],
    /// How much nearer they come at most for every radian or metre of each joint, m.
    pub levers: Vec<f64>,
    /// Of balls that hold them, together, m.
    radius: f64,
}

/// Where the shapes of a pair are nearest.
#[derive(Debug, Clone, Copy)]
pub(super) struct Meeting {
    pub bodies: [usize; 2],
    /// Nearest points from the base's origin, map axes, m.
    pub arms: [Vector3<f64>; 2],
    /// m; negative: overlap, about.
    pub distance: f64,
    /// Unit vector from the second point to the first.
    pub normal: Vector3<f64>,
}

impl OwnLinks {
    pub fn new(robot: &RobotModel) -> Self {
        let of = |shapes: [usize; 2]| {
            let [a, b] = shapes.map(|shape| &robot.shapes[shape]);
            let common = common(robot, [a.body, b.body]);
            let reach = |shape: &Shape| {
                let radius = shape.pose.translation.vector.norm() + shape.convex.bounding_radius();
                Reach::within(robot, shape.body, common, radius).joints
            };
            let levers = reach(a).iter().zip(reach(b)).map(|(a, b)| a + b).collect();
            Pair { shapes, levers, radius: a.convex.bounding_radius() + b.convex.bounding_radius() }
        };
        Self { pairs: robot.self_pairs().into_iter().map(of).collect() }
    }

    /// Looks at every pair that may be nearer than the margin. `free`: how far each may move before that has to be done again, m.
    pub fn scan(
        &self,
        robot: &RobotModel,
        frames: &[BodyFrame],
        free: &mut [f64],
        mut look: impl FnMut(usize, &Meeting),
    ) {
        for (index, (pair, free)) in self.pairs.iter().zip(free).enumerate() {
            if *free > 0.0 {
                continue;
            }
            match pair.meeting(robot, frames, MARGIN + ENOUGH) {
                Err(farther) => *free = farther - MARGIN,
                Ok(meeting) => {
                    *free = meeting.distance - MARGIN;
                    look(index, &meeting);
                }
            }
        }
    }
}

/// The last body that carries both.
fn common(robot: &RobotModel, mut bodies: [usize; 2]) -> usize {
    // A body comes after its parent.
    while bodies[0] != bodies[1] {
        let later = usize::from(bodies[1] > bodies[0]);
        bodies[later] = robot.bodies[bodies[later]].parent;
    }
    bodies[0]
}

/// A shape in its place, from the base's origin and with the map's axes.
struct Placed<'a> {
    convex: &'a Convex,
    turn: nalgebra::Matrix3<f64>,
    centre: Vector3<f64>,
}

impl<'a> Placed<'a> {
    fn new(shape: &'a Shape, frame: &BodyFrame) -> Self {
        let turn = frame.rotation * shape.pose.rotation.to_rotation_matrix().into_inner();
        Self { convex: &shape.convex, turn, centre: frame.rotation * shape.pose.translation.vector + frame.origin }
    }

    fn support(&self, d: &Vector3<f64>) -> Vector3<f64> {
        self.centre + self.turn * self.convex.support(&self.turn.tr_mul(d))
    }

    fn core_support(&self, d: &Vector3<f64>) -> Vector3<f64> {
        let (d, by) = (self.turn.tr_mul(d), depth(self.convex));
        let at = match self.convex {
            Convex::Box { half } => Convex::Box { half: half.map(|h| h - by) }.support(&d),
            Convex::Cylinder { radius, half_length } => {
                Convex::Cylinder { radius: radius - by, half_length: half_length - by }.support(&d)
            }
            Convex::Sphere { radius } => Convex::Sphere { radius: radius - by }.support(&d),
            Convex::Hull { .. } => self.convex.support(&d) * 0.5,
        };
        self.centre + self.turn * at
    }
}

/// How deep a shape's core lies in it, m.
fn depth(convex: &Convex) -> f64 {
    let least = convex.half_extents().into_iter().fold(f64::INFINITY, f64::min);
    least * if matches!(convex, Convex::Hull { .. }) { 0.5 } else { CORE }
}

impl Pair {
    /// The nearest points, or, unless `enough` is infinite, a lower bound of a distance beyond the margin.
    pub fn meeting(&self, robot: &RobotModel, frames: &[BodyFrame], enough: f64) -> Result<Meeting, f64> {
        let shapes = self.shapes.map(|shape| &robot.shapes[shape]);
        let [a, b] = shapes.map(|shape| Placed::new(shape, &frames[shape.body]));
        let between = a.centre - b.centre;
        let farther = between.norm() - self.radius;
        if farther >= enough {
            return Err(farther);
        }
        // How far apart those are that are far enough need be known to a factor of two only.
        let apart = |gap: gjk::Gap| {
            gap.lower >= enough || (enough.is_finite() && gap.lower - MARGIN > 0.5 * (gap.upper - MARGIN).max(0.0))
        };
        let close = |gap: gjk::Gap| apart(gap) || gap.upper - gap.lower <= TOLERANCE;
        let support = |d: &Vector3<f64>| {
            let first = a.support(d);
            [first - b.support(&-d), first]
        };
        let (gap, first, way) = gjk::with_points(support, between, close);
        if apart(gap) {
            return Err(gap.lower);
        }
        let bodies = shapes.map(|shape| shape.body);
        if gap.upper > TOUCHING {
            return Ok(Meeting { bodies, arms: [first, first - way], distance: gap.upper, normal: way / gap.upper });
        }
        let support = |d: &Vector3<f64>| {
            let first = a.core_support(d);
            [first - b.core_support(&-d), first]
        };
        let exact = |gap: gjk::Gap| gap.upper - gap.lower <= TOLERANCE;
        let (gap, first, way) = gjk::with_points(support, between, exact);
        let cores = -depth(a.convex) - depth(b.convex);
        if gap.upper > TOUCHING {
            let distance = (gap.upper + cores).min(0.0);
            return Ok(Meeting { bodies, arms: [first, first - way], distance, normal: way / gap.upper });
        }
        let normal = between.try_normalize(TOUCHING).unwrap_or_else(Vector3::z);
        Ok(Meeting { bodies, arms: [a.centre, b.centre], distance: cores.min(farther), normal })
    }
}

#[cfg(test)]
mod tests {
    use super::super::clearance::{ClearancePenalty, Placement};
    use super::super::touch::{ByPose, PointOf};
    use super::super::{Limits, Penalise};
    use super::*;
    use crate::optimize::contour::Contour;
    use crate::optimize::test_robot::{Boxes, arm};

    fn penalty(robot: &RobotModel) -> ClearancePenalty {
        let mut penalty = ClearancePenalty::new(Contour::new(robot, 0.08), robot, 0.05, 0.05, 0.0);
        penalty.remember(1);
        penalty
    }

    /// Missing clearance of a pair and its derivatives.
    fn looked(penalty: &mut ClearancePenalty, robot: &RobotModel, pair: usize, joints: &[f64]) -> (f64, Vec<f64>) {
        let at = Placement { position: [0.7, -0.2], heading: [0.6, 0.8], joints };
        let mut found = None;
        penalty.look(robot, &Boxes(vec![]), at, std::iter::once(PointOf::Pair(pair)), |touch| {
            assert_eq!(touch.by_pose, ByPose::default());
            found = Some((touch.short, touch.by_joints.to_vec()));
        });
        found.expect("looked at")
    }

    /// The same postures each time, spread over the joints' ranges.
    fn postures(robot: &RobotModel) -> impl Iterator<Item = Vec<f64>> {
        let mut state = 5u64;
        let limits = Limits::new(robot, 1.0).joints;
        (0..150).map(move |_| {
            let mut draw = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1u64 << 53) as f64
            };
            limits.iter().map(|joint| joint.lower + draw() * (joint.upper - joint.lower)).collect()
        })
    }

    #[test]
    fn a_pair_comes_nearer_as_its_derivatives_say_and_no_faster_than_its_levers() {
        let robot = arm(6);
        let mut penalty = penalty(&robot);
        let own = OwnLinks::new(&robot);
        let mut looks = 0;
        for q in postures(&robot) {
            for (pair, known) in own.pairs.iter().enumerate() {
                let (short, by) = looked(&mut penalty, &robot, pair, &q);
                if short > MARGIN - 0.005 {
                    continue; // they overlap, or nearly
                }
                looks += 1;
                for joint in 0..q.len() {
                    let mut moved = |by: f64| {
                        let mut q = q.clone();
                        q[joint] += by;
                        looked(&mut penalty, &robot, pair, &q).0
                    };
                    let numeric = (moved(1e-4) - moved(-1e-4)) / 2e-4;
                    assert!((numeric - by[joint]).abs() < 5e-3, "{q:?}, pair {pair}: {numeric} {}", by[joint]);
                    assert!(by[joint].abs() <= known.levers[joint] + 1e-9);
                }
            }
        }
        assert!(looks > 1000, "{looks}");
    }

    #[test]
    fn what_was_seen_before_spares_looks_and_changes_no_cost() {
        let robot = arm(6);
        let (mut with_memory, mut costly) = (penalty(&robot), 0);
        for q in postures(&robot) {
            // A large step, then small ones.
            for step in [0.0, 0.01, 0.05, 0.04] {
                let joints: Vec<f64> = q.iter().enumerate().map(|(j, q)| q + step * (j as f64 - 2.5)).collect();
                let at = Placement { position: [0.0; 2], heading: [1.0, 0.0], joints: &joints };
                let cost = |penalty: &mut ClearancePenalty| {
                    let (mut by_pose, mut by_joints) = (ByPose::default(), vec![0.0; 6]);
                    penalty.add(&robot, &Boxes(vec![]), at, 0, &mut Penalise(0.1), &mut by_pose, &mut by_joints)
                };
                let (found, anew) = (cost(&mut with_memory), cost(&mut penalty(&robot)));
                assert!((found - anew).abs() < 1e-4 * (1.0 + anew), "{found} {anew}");
                costly += usize::from(found > 0.0);
            }
        }
        assert!(costly > 50, "{costly}");
    }

    #[test]
    fn links_that_overlap_are_driven_apart() {
        let robot = arm(6);
        let mut penalty = penalty(&robot);
        let mut driven = 0;
        for mut q in postures(&robot) {
            for pair in 0..OwnLinks::new(&robot).pairs.len() {
                let overlaps = looked(&mut penalty, &robot, pair, &q).0 > MARGIN;
                for _ in 0..if overlaps { 300 } else { 0 } {
                    let (short, by) = looked(&mut penalty, &robot, pair, &q);
                    let norm = by.iter().map(|b| b * b).sum::<f64>().sqrt();
                    if short < 0.0 || norm < 1e-6 {
                        break;
                    }
                    q.iter_mut().zip(&by).for_each(|(q, by)| *q -= 0.01 * by / norm);
                }
                if overlaps {
                    driven += 1;
                    assert!(looked(&mut penalty, &robot, pair, &q).0 < MARGIN, "pair {pair}");
                }
            }
        }
        assert!(driven > 20, "{driven}");
    }
}
