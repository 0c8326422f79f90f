//! Whether the motion ends at the goal.

use super::rollout::Rollout;
use super::{END_ANGLE_TOLERANCE, END_POINT_TOLERANCE, Goal, Refusal, RefusalKind, within};
use crate::geom::wrap_angle;
use crate::math::real;
use crate::robot::RobotModel;

/// How far from the goal the replay ends.
pub(super) struct Ends {
    /// m.
    pub(super) point: f64,
    /// rad; `None` where the goal leaves the heading open.
    pub(super) heading: Option<f64>,
    /// One for each tolerance that is not kept.
    pub(super) refusals: Vec<Refusal>,
}

/// Compares the last row's replayed state with the goal. A joint's value counts as it is: whole turns are not the same.
pub(super) fn ends(rollout: &Rollout<'_>, robot: &RobotModel, goal: &Goal) -> Ends {
    let last = rollout.rows() - 1;
    let pose = rollout.pose(last, 0.0);
    let point = real::hypot(pose.x - goal.x, pose.y - goal.y);
    let heading = goal.yaw.map(|yaw| wrap_angle(pose.yaw - yaw).abs());
    let mut refusals = Vec::new();
    let mut refuse = |error: f64, tolerance: f64, message: &dyn Fn() -> String| {
        if !within(error, tolerance) {
            refusals.push(Refusal { kind: RefusalKind::End, message: message(), time: Some(rollout.time(last, 0.0)) });
        }
    };
    refuse(point, goal.allowed(), &|| {
        let (got, allowed) = (1e3 * point, 1e3 * goal.allowed());
        format!("ends {got:.3} mm from the goal ({allowed:.0} mm allowed)")
    });
    if let Some(error) = heading {
        refuse(error, END_ANGLE_TOLERANCE, &|| turned("the goal's heading", error));
    }
    for (index, joint) in robot.joints.iter().enumerate() {
        let Some(wanted) = goal.joints[index] else { continue };
        let error = (rollout.joints(last)[index] - wanted).abs();
        if joint.prismatic {
            refuse(error, END_POINT_TOLERANCE, &|| {
                format!("`{}` ends {:.3} mm from its goal {wanted:.4} m", joint.name, 1e3 * error)
            });
        } else {
            refuse(error, END_ANGLE_TOLERANCE, &|| turned(&format!("the goal of `{}`", joint.name), error));
        }
    }
    Ends { point, heading, refusals }
}

fn turned(from: &str, error: f64) -> String {
    let (got, allowed) = (error.to_degrees(), END_ANGLE_TOLERANCE.to_degrees());
    format!("ends {got:.4} degrees from {from} ({allowed:.1} allowed)")
}
