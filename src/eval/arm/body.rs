//! The robot at start and goal: random postures, and whether it is clear of everything there. Distances are exact.

use nalgebra::{Isometry3, Vector3};

use super::super::rng::Rng;
use crate::geom::{Aabb, Pose2};
use crate::math::gjk;
use crate::robot::{Convex, MovingJoint, RobotModel, Shape};

/// Links that move against each other are apart by this, m.
const OWN_LINKS: f64 = 0.005;
/// Of a joint's range, kept off each of its ends, as planned motions do.
const OFF_ENDS: f64 = 0.01;

/// A robot, with what is asked of it often.
pub(super) struct Body<'a> {
    robot: &'a RobotModel,
    pairs: Vec<[usize; 2]>,
    /// Bounds of the shapes that no joint moves, base frame.
    rigid: Aabb,
    /// No point of those is farther from the base's axis, m.
    radius: f64,
}

impl<'a> Body<'a> {
    pub fn new(robot: &'a RobotModel) -> Self {
        let mut alone = robot.clone();
        alone.shapes.retain(|shape| shape.body == 0);
        let any: Vec<f64> = robot.joints.iter().map(|j| 0f64.clamp(j.lower, j.upper)).collect();
        Self { robot, pairs: robot.self_pairs(), rigid: alone.extents(&any), radius: alone.radius(&any) }
    }

    /// The moving joints.
    pub fn joints(&self) -> impl Iterator<Item = &str> {
        self.robot.joints.iter().map(|j| j.name.as_str())
    }

    /// Radius of the rigid shapes about the base's axis, m.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// Height of the rigid shapes' top, m.
    pub fn top(&self) -> f64 {
        self.rigid.max[2].max(0.0)
    }

    /// Joint values, each uniform over its range (endless: one turn), but for a little at the ends.
    pub fn posture(&self, rng: &mut Rng) -> Vec<f64> {
        let turn = std::f64::consts::PI;
        let value = |joint: &MovingJoint| {
            let low = if joint.lower.is_finite() { joint.lower } else { -turn };
            let high = if joint.upper.is_finite() { joint.upper } else { turn };
            let off = OFF_ENDS * (high - low);
            rng.uniform(low + off, high - off)
        };
        self.robot.joints.iter().map(value).collect()
    }

    /// Whether every shape keeps `clear` metres from the boxes and from the outside of a square room, those that joints move from the floor
    /// too, and the links are apart.
    pub fn free(&self, at: Pose2, q: &[f64], boxes: &[Aabb], side: f64, clear: f64) -> bool {
        let base = at.isometry();
        let poses: Vec<Isometry3<f64>> = self.robot.shape_poses(q).iter().map(|pose| base * pose).collect();
        let shapes = || self.robot.shapes.iter().map(|shape| &shape.convex).zip(&poses);
        let inside = |(shape, pose): (&Shape, &Isometry3<f64>)| {
            let of = extent(&shape.convex, pose);
            let walls = (0..2).all(|axis| of.min[axis] >= clear && of.max[axis] <= side - clear);
            walls && (shape.body == 0 || of.min[2] >= clear)
        };
        let off_boxes = |(convex, pose): (&Convex, &Isometry3<f64>)| {
            boxes.iter().all(|b| {
                let half: [f64; 3] = std::array::from_fn(|axis| 0.5 * (b.max[axis] - b.min[axis]));
                let middle: [f64; 3] = std::array::from_fn(|axis| 0.5 * (b.max[axis] + b.min[axis]));
                apart(
                    (convex, pose),
                    (&Convex::Box { half }, &Isometry3::translation(middle[0], middle[1], middle[2])),
                    clear,
                )
            })
        };
        let shape = |s: usize| (&self.robot.shapes[s].convex, &poses[s]);
        self.robot.shapes.iter().zip(&poses).all(inside)
            && self.pairs.iter().all(|[a, b]| apart(shape(*a), shape(*b), OWN_LINKS))
            && shapes().all(off_boxes)
    }
}

/// A shape's bounding box.
fn extent(convex: &Convex, pose: &Isometry3<f64>) -> Aabb {
    let end = |axis: usize, sign: f64| {
        let local = pose.rotation.inverse_transform_vector(&Vector3::ith(axis, sign));
        (pose * nalgebra::Point3::from(convex.support(&local)))[axis]
    };
    Aabb { min: std::array::from_fn(|axis| end(axis, -1.0)), max: std::array::from_fn(|axis| end(axis, 1.0)) }
}

/// Whether two shapes are at least this far apart.
fn apart(a: (&Convex, &Isometry3<f64>), b: (&Convex, &Isometry3<f64>), clear: f64) -> bool {
    let between = a.1.translation.vector - b.1.translation.vector;
    if between.norm() >= a.0.bounding_radius() + b.0.bounding_radius() + clear {
        return true;
    }
    let farthest = |(convex, pose): (&Convex, &Isometry3<f64>), d: &Vector3<f64>| {
        pose.translation.vector + pose.rotation * convex.support(&pose.rotation.inverse_transform_vector(d))
    };
    let support = |d: &Vector3<f64>| farthest(a, d) - farthest(b, &-d);
    gjk::distance_from_origin(support, between, |gap| gap.lower >= clear || gap.upper < clear).lower >= clear
}
