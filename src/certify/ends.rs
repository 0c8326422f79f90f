//! Whether the motion ends at the goal.

use super::rollout::Rollout;
use super::{
    END_ANGLE_TOLERANCE, END_POINT_TOLERANCE, Goal, LINK_ANGLE_TOLERANCE, LinkEnd, LinkGoal, Refusal, RefusalKind,
    within,
};
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
        refuse(error, END_ANGLE_TOLERANCE, &|| turned("the goal's heading", error, END_ANGLE_TOLERANCE));
    }
    for (index, joint) in robot.joints.iter().enumerate() {
        let Some(wanted) = goal.joints[index] else { continue };
        let error = (rollout.joints(last)[index] - wanted).abs();
        if joint.prismatic {
            refuse(error, END_POINT_TOLERANCE, &|| {
                format!("`{}` ends {:.3} mm from its goal {wanted:.4} m", joint.name, 1e3 * error)
            });
        } else {
            refuse(error, END_ANGLE_TOLERANCE, &|| {
                turned(&format!("the goal of `{}`", joint.name), error, END_ANGLE_TOLERANCE)
            });
        }
    }
    Ends { point, heading, refusals }
}

/// Compares the link's frame in the last row's replayed state with its place.
pub(super) fn link_end(rollout: &Rollout<'_>, robot: &RobotModel, goal: &LinkGoal) -> (LinkEnd, Vec<Refusal>) {
    let last = rollout.rows() - 1;
    let frame = rollout.pose(last, 0.0).isometry() * robot.link_pose(goal.link, rollout.joints(last));
    let point_error = (frame.translation.vector - nalgebra::Vector3::from(goal.position)).norm();
    let angle_error = goal.rotation.map(|wanted| wanted.angle_to(&frame.rotation));
    let name = &robot.links[goal.link].name;
    let mut refusals = Vec::new();
    let mut refuse = |kept: bool, message: String| {
        if !kept {
            refusals.push(Refusal { kind: RefusalKind::End, message, time: Some(rollout.time(last, 0.0)) });
        }
    };
    let (got, allowed) = (1e3 * point_error, 1e3 * goal.within);
    let message = format!("link `{name}` ends {got:.3} mm from its place ({allowed:.0} mm allowed)");
    refuse(within(point_error, goal.within), message);
    if let Some(error) = angle_error {
        let message = turned(&format!("how link `{name}` is to be turned"), error, LINK_ANGLE_TOLERANCE);
        refuse(within(error, LINK_ANGLE_TOLERANCE), message);
    }
    (LinkEnd { link: name.clone(), point_error, allowed: goal.within, angle_error }, refusals)
}

fn turned(from: &str, error: f64, allowed: f64) -> String {
    let (got, allowed) = (error.to_degrees(), allowed.to_degrees());
    format!("ends {got:.4} degrees from {from} ({allowed:.1} allowed)")
}
