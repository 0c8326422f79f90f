//! A contour point near an obstacle, or two links near each other, and what moves them.

use nalgebra::{Matrix3, Vector3};

use super::own_links::{self, Meeting};
use crate::robot::RobotModel;

#[derive(Debug, Clone, Copy)]
pub(super) struct BodyFrame {
    pub rotation: Matrix3<f64>,
    /// Relative to the base's origin, map axes.
    pub origin: Vector3<f64>,
}

/// Derivatives of the clearance penalty by the pose of the base.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ByPose {
    /// By x and y.
    pub position: [f64; 2],
    /// By the heading.
    pub heading: f64,
}

/// What is near something.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum PointOf {
    /// A contour point, near an obstacle, and the body that it is on.
    Contour { body: usize, point: usize },
    /// A pair of the robot's own links.
    Pair(usize),
}

/// A contour point near an obstacle, or two links near each other.
pub(crate) struct Touch<'a> {
    pub of: PointOf,
    /// By how much it misses the wanted clearance, m.
    pub short: f64,
    /// How many points it stands for.
    pub weight: f64,
    /// Derivatives of `short` by the pose, and by the joints.
    pub by_pose: ByPose,
    pub by_joints: &'a [f64],
}

/// Adds what the joints below a body do to a push on a point of it.
fn feel(
    robot: &RobotModel,
    frames: &[BodyFrame],
    mut link: usize,
    arm: Vector3<f64>,
    push: Vector3<f64>,
    by_joints: &mut [f64],
) {
    while link != 0 {
        let (frame, body) = (&frames[link], &robot.bodies[link]);
        if let Some(motion) = &body.motion {
            let axis = frame.rotation * motion.axis.into_inner();
            let felt = if motion.prismatic { axis.dot(&push) } else { axis.dot(&(arm - frame.origin).cross(&push)) };
            by_joints[motion.joint] += motion.multiplier * felt;
        }
        link = body.parent;
    }
}

/// A point whose missing clearance grows along `push`.
pub(super) struct Pushed {
    pub of: PointOf,
    pub body: usize,
    /// From the base's origin, map axes, m.
    pub arm: Vector3<f64>,
    pub short: f64,
    pub weight: f64,
    pub push: Vector3<f64>,
}

impl Pushed {
    pub fn touch<'a>(self, robot: &RobotModel, frames: &[BodyFrame], by_joints: &'a mut [f64]) -> Touch<'a> {
        let Self { of, body, arm, short, weight, push } = self;
        by_joints.fill(0.0);
        feel(robot, frames, body, arm, push, by_joints);
        let by_pose = ByPose { position: [push.x, push.y], heading: arm.x * push.y - arm.y * push.x };
        Touch { of, short, weight, by_pose, by_joints }
    }
}

/// A pair of own links; the base moves both alike.
pub(super) fn met<'a>(
    robot: &RobotModel,
    frames: &[BodyFrame],
    pair: usize,
    meeting: &Meeting,
    by_joints: &'a mut [f64],
) -> Touch<'a> {
    by_joints.fill(0.0);
    let pushes = [-meeting.normal, meeting.normal];
    for ((body, arm), push) in meeting.bodies.into_iter().zip(meeting.arms).zip(pushes) {
        feel(robot, frames, body, arm, push, by_joints);
    }
    let (short, weight) = (own_links::MARGIN - meeting.distance, own_links::WEIGHT);
    Touch { of: PointOf::Pair(pair), short, weight, by_pose: ByPose::default(), by_joints }
}
