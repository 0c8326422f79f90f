//! Where motions start and end: of trajectories, and as missions ask for it.

use nalgebra::UnitQuaternion;

use super::TextFile;
use crate::certify::{Goal, LinkGoal, Via};
use crate::diag::{Describe, Diagnostic, Diagnostics};
use crate::geom::{Pose2, wrap_angle};
use crate::math::real;
use crate::mission::{Mission, PathSpec, PoseSpec};
use crate::robot::RobotModel;
use crate::trajectory::{Leg, Trajectory, given, steered_curve::SteeredCurve};

/// Where a trajectory starts: pose and joint values.
pub(super) fn start_of(trajectory: &Trajectory) -> (Pose2, Vec<f64>) {
    match &trajectory.legs[0] {
        Leg::Still(still) => (still.pose, still.joints_from.clone()),
        Leg::Drive(drive) => {
            let value = |d| drive.curve.derivative(d, 0, 0.0);
            let dims = drive.curve.pieces[0].coefficients.len();
            (Pose2::new(value(0), value(1), drive.yaw_start), (2..dims).map(value).collect())
        }
        Leg::Steer(steer) => {
            let dims = steer.curve.pieces[0].coefficients.len();
            (steer.pose, (2..dims).map(|d| steer.curve.derivative(d, 0, 0.0)).collect())
        }
    }
}

/// Where a trajectory ends.
pub(super) fn end_of(trajectory: &Trajectory) -> Pose2 {
    match &trajectory.legs[trajectory.legs.len() - 1] {
        Leg::Still(still) => Pose2 { yaw: still.yaw_end, ..still.pose },
        Leg::Drive(drive) => {
            let end = drive.curve.duration();
            let [x, y, dx, dy] =
                [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(d, order)| drive.curve.derivative(d, order, end));
            let yaw = real::atan2(dy, dx) + if drive.reverse { std::f64::consts::PI } else { 0.0 };
            Pose2::new(x, y, wrap_angle(yaw))
        }
        // Only planned motions have such legs, and those that cannot be tabulated have been refused.
        Leg::Steer(steer) => SteeredCurve::new(steer).map_or(steer.pose, |curve| curve.end_pose()),
    }
}

/// Where the commands must end: as the mission says, else where its given path does; what neither says is open. (A mission
/// without a path has a goal position; its reader sees to that.)
pub(super) fn goal(mission: &Mission, robot: &RobotModel, given_end: Option<Pose2>) -> Goal {
    let mut place = mission.goal.clone().unwrap_or_default();
    if let Some(end) = given_end {
        place.x.get_or_insert(end.x);
        place.y.get_or_insert(end.y);
        place.yaw.get_or_insert(end.yaw);
    }
    place_of(&place, robot)
}

/// A place as the certificate is asked for it; its position is there.
pub(super) fn place_of(place: &PoseSpec, robot: &RobotModel) -> Goal {
    Goal {
        x: place.x.unwrap_or_default(),
        y: place.y.unwrap_or_default(),
        within: within(place, robot),
        yaw: place.yaw,
        joints: joints(place, robot),
    }
}

/// What a place asks of each moving joint.
pub(super) fn joints(place: &PoseSpec, robot: &RobotModel) -> Vec<Option<f64>> {
    robot.joints.iter().map(|joint| place.joints.get(&joint.name).copied()).collect()
}

/// How far from its point the base may end: as a place says, or as far as the link reaches that must be there.
fn within(place: &PoseSpec, robot: &RobotModel) -> f64 {
    link_index(place, robot).map_or(place.within, |link| robot.link_reach(link))
}

fn link_index(place: &PoseSpec, robot: &RobotModel) -> Option<usize> {
    let asked = place.link.as_ref()?;
    robot.links.iter().position(|link| link.name == asked.name)
}

/// Where a link must be at the end, if the goal says so.
pub(super) fn link_goal(mission: &Mission, robot: &RobotModel) -> Option<LinkGoal> {
    let goal = mission.goal.as_ref()?;
    let (link, asked) = (link_index(goal, robot)?, goal.link.as_ref()?);
    let rotation = asked.rpy.map(|[roll, pitch, yaw]| UnitQuaternion::from_euler_angles(roll, pitch, yaw));
    Some(LinkGoal { link, position: asked.position, within: asked.within, rotation })
}

/// Where the commands must stop on the way.
pub(super) fn vias(mission: &Mission, robot: &RobotModel) -> Vec<Via> {
    mission.via.iter().map(|via| Via { place: place_of(&via.place, robot), dwell: via.dwell }).collect()
}

/// The mission's own path as a trajectory.
pub(super) fn given_path(
    mission: &Mission,
    path: &PathSpec,
    csv: Option<&TextFile>,
    robot: &RobotModel,
) -> Result<Trajectory, Diagnostics> {
    let start = mission.start.clone().unwrap_or_default();
    let held: Vec<f64> = robot
        .joints
        .iter()
        .map(|j| start.joints.get(&j.name).copied().unwrap_or(0f64.clamp(j.lower, j.upper)))
        .collect();
    let trajectory = match (path, csv) {
        (PathSpec::Bezier(segments), _) => given::from_bezier(segments, &held)
            .map_err(|error| Diagnostics::from(error.diagnostic().maybe_at(mission.spans.path.as_ref())))?,
        (PathSpec::File(_), Some(csv)) => given::from_csv(&csv.name, &csv.text, robot, &held)?,
        (PathSpec::File(file), None) => {
            let message = format!("path file `{}` was not read", file.display());
            return Err(Diagnostic::error("mission/path-not-read", message)
                .maybe_at(mission.spans.path_file.as_ref())
                .hint("give its text along with the mission's")
                .into());
        }
    };
    let (first, _) = start_of(&trajectory);
    let last = end_of(&trajectory);
    let ends =
        [("start", &mission.start, first, &mission.spans.start), ("goal", &mission.goal, last, &mission.spans.goal)];
    for (which, spec, own, span) in ends {
        let Some(spec) = spec else { continue };
        let off = |a: Option<f64>, b: f64| a.is_some_and(|a| (a - b).abs() > 1e-6);
        let elsewhere = match spec.x.zip(spec.y) {
            Some((x, y)) if spec.within > 0.0 => real::hypot(x - own.x, y - own.y) > spec.within,
            _ => off(spec.x, own.x) || off(spec.y, own.y),
        };
        if elsewhere || spec.yaw.is_some_and(|yaw| wrap_angle(yaw - own.yaw).abs() > 1e-6) {
            let message = format!(
                "`{which}` contradicts the given path, which has x {:.6}, y {:.6}, heading {:.6} rad there",
                own.x, own.y, own.yaw
            );
            let fault = Diagnostic::error("mission/path-end", message).maybe_at(span.as_ref());
            return Err(fault.hint(format!("leave `{which}` out, or keep only its joints")).into());
        }
    }
    Ok(trajectory)
}
