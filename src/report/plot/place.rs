//! The robot where a mission wants it, and in its postures.

use super::{TopView, top};
use crate::geom::Pose2;
use crate::math::real;
use crate::mission::{PoseSpec, SpeedZone};
use crate::robot::RobotModel;

/// Corners of a circle as it is drawn.
const CORNERS: usize = 48;
/// Values tried of each joint for the robot's least height.
const POSTURES: usize = 17;

/// Draws start and goal where they are given: a heading left open as 0, joints left open in the middle of their range.
pub fn ends(view: &mut TopView, robot: &RobotModel, [start, goal]: [Option<&PoseSpec>; 2]) {
    for (pose, name) in [(start, "start"), (goal, "goal")] {
        if let Some(pose) = pose {
            stand(view, robot, pose, name);
        }
    }
}

/// Draws the robot in a place that a mission names, if its position is known; joints left open in the middle of their ranges.
pub fn stand(view: &mut TopView, robot: &RobotModel, pose: &PoseSpec, name: &str) {
    let Some((x, y)) = pose.x.zip(pose.y) else { return };
    if pose.within > 0.0 {
        region(view, [x, y], pose.within);
    }
    let joints = robot.joints.iter().zip(posture(robot, 0.5));
    let q: Vec<f64> = joints.map(|(joint, middle)| pose.joints.get(&joint.name).copied().unwrap_or(middle)).collect();
    view.end(robot, Pose2::new(x, y, pose.yaw.unwrap_or(0.0)), &q, name);
}

/// Draws the areas in which the base is to be slow, with their speeds.
pub fn zones(view: &mut TopView, zones: &[SpeedZone]) {
    for zone in zones {
        view.area(zone.polygon.clone(), 4, "speed zone");
        let count = zone.polygon.len() as f64;
        let middle = [0, 1].map(|a| zone.polygon.iter().map(|p| p[a]).sum::<f64>() / count);
        view.note(middle, format!("{} m/s", zone.speed));
    }
}

/// Draws the places that a goal or via with `within_m` allows.
fn region(view: &mut TopView, [x, y]: [f64; 2], within: f64) {
    let corner = |k: usize| {
        let (sin, cos) = real::sin_cos(std::f64::consts::TAU * k as f64 / CORNERS as f64);
        [x + within * cos, y + within * sin]
    };
    view.area((0..CORNERS).map(corner).collect(), 2, "any place will do");
}

/// Every joint at the same share (0 to 1) of its range; joints without ends at 0.
pub fn posture(robot: &RobotModel, share: f64) -> Vec<f64> {
    let value = |low: f64, high: f64| if (high - low).is_finite() { low + share * (high - low) } else { 0.0 };
    robot.joints.iter().map(|j| value(j.lower, j.upper)).collect()
}

/// Height of the robot at its lowest, m, all joints moved alike through their ranges: what hangs higher can be passed under.
pub fn least_top(robot: &RobotModel) -> f64 {
    let share = |k: usize| k as f64 / (POSTURES - 1) as f64;
    (0..POSTURES).map(|k| top(robot, &posture(robot, share(k)))).fold(f64::INFINITY, f64::min)
}
