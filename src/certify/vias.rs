//! Whether the motion stands at each of the places on its way.

use super::rollout::Rollout;
use super::{END_ANGLE_TOLERANCE, END_POINT_TOLERANCE, Goal, Reached, Refusal, RefusalKind, Via, within};
use crate::geom::wrap_angle;
use crate::math::real;
use crate::robot::RobotModel;

/// Rounding of a dwell that is a whole number of rows, s.
const ROUNDING: f64 = 1e-9;

/// Finds, in their order, rows at which the base stands where the vias say for as long as they say. A stand counts for one via: the
/// next is looked for behind it.
pub(super) fn vias(
    rollout: &Rollout<'_>,
    standing: &[bool],
    robot: &RobotModel,
    vias: &[Via],
) -> (Vec<Reached>, Vec<Refusal>) {
    let (mut reached, mut refusals, mut row) = (Vec::new(), Vec::new(), 0);
    for (index, via) in vias.iter().enumerate() {
        match stand(rollout, standing, robot, via, row) {
            Ok((first, next)) => {
                let pose = rollout.pose(first, 0.0);
                reached.push(Reached {
                    time: rollout.time(first, 0.0),
                    point_error: real::hypot(pose.x - via.place.x, pose.y - via.place.y),
                    heading_error: via.place.yaw.map(|yaw| wrap_angle(pose.yaw - yaw).abs()),
                });
                row = next;
            }
            Err(why) => {
                let (x, y) = (via.place.x, via.place.y);
                let message = format!("does not stop at via[{index}] ({x:.3}, {y:.3}): {why}");
                refusals.push(Refusal { kind: RefusalKind::Via, message, time: None });
            }
        }
    }
    (reached, refusals)
}

/// The first row from `from` on at which the robot stands as the via says, and the first row behind that stand.
fn stand(
    rollout: &Rollout<'_>,
    standing: &[bool],
    robot: &RobotModel,
    via: &Via,
    from: usize,
) -> Result<(usize, usize), String> {
    let last = rollout.rows() - 1;
    let (mut row, mut nearest, mut longest) = (from, f64::INFINITY, None);
    while row <= last {
        if !standing[row] {
            row += 1;
            continue;
        }
        let end = (row..=last).find(|k| !standing[*k]).unwrap_or(last + 1);
        let pose = rollout.pose(row, 0.0);
        let off = real::hypot(pose.x - via.place.x, pose.y - via.place.y);
        if as_said(rollout, row, robot, &via.place) {
            let stood = rollout.time(end.min(last), 0.0) - rollout.time(row, 0.0);
            if stood >= via.dwell - ROUNDING {
                let rows = (via.dwell / rollout.step() - ROUNDING).ceil().max(1.0) as usize;
                return Ok((row, row + rows));
            }
            longest = Some(f64::max(stood, longest.unwrap_or(0.0)));
        }
        nearest = f64::min(nearest, off);
        row = end;
    }
    Err(match longest {
        Some(stood) => format!("it stands there for {stood:.3} s, {:.3} s are asked for", via.dwell),
        None if within(nearest, via.place.allowed()) => "it stands there with another heading or other joints".into(),
        None if nearest.is_finite() => format!("its nearest stop after that is {:.3} mm away", 1e3 * nearest),
        None => "it does not stop any more".into(),
    })
}

/// Whether the robot is in a place as the certificate understands a goal, when a row begins.
fn as_said(rollout: &Rollout<'_>, row: usize, robot: &RobotModel, place: &Goal) -> bool {
    let pose = rollout.pose(row, 0.0);
    let point = within(real::hypot(pose.x - place.x, pose.y - place.y), place.allowed());
    let heading = place.yaw.is_none_or(|yaw| within(wrap_angle(pose.yaw - yaw).abs(), END_ANGLE_TOLERANCE));
    let joints = robot.joints.iter().zip(&place.joints).zip(rollout.joints(row)).all(|((joint, wanted), value)| {
        let tolerance = if joint.prismatic { END_POINT_TOLERANCE } else { END_ANGLE_TOLERANCE };
        wanted.is_none_or(|wanted| within((value - wanted).abs(), tolerance))
    });
    point && heading && joints
}
