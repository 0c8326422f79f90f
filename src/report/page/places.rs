//! Poses worth looking at: start and goal, and of a failed mission where it got stuck.

use serde::Serialize;
use serde_json::{Map, Value};

use super::scene::planar;
use crate::command::CommandTable;
use crate::geom::Pose2;
use crate::mission::PoseSpec;
use crate::report::plot::{motion, place};
use crate::robot::RobotModel;

/// The robot somewhere.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Place {
    /// What is written beside it.
    pub(super) name: String,
    /// `start`, `goal`, `reached`, `stuck` or `free`.
    pub(super) kind: &'static str,
    /// x, y, yaw of the base.
    pub(super) pose: [f64; 3],
    /// One value a joint; absent: not known, so the base alone is drawn.
    pub(super) joints: Option<Vec<f64>>,
    /// The link that is too close.
    pub(super) link: Option<String>,
}

/// The narrowest place of the widest way.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Gap {
    /// Its middle, m.
    pub(super) at: [f64; 2],
    /// Width that there is, m.
    pub(super) width: f64,
    /// Width that would do for the base, m.
    pub(super) needed: f64,
}

/// Start and end of a motion.
pub(super) fn of_commands(table: &CommandTable) -> Vec<Place> {
    let states = motion::states(table);
    let of = |state: Option<&(Pose2, &[f64])>, kind: &'static str| {
        let (pose, joints) = state?;
        Some(Place { name: kind.into(), kind, pose: planar(*pose), joints: Some(joints.to_vec()), link: None })
    };
    [of(states.first(), "start"), of(states.last(), "goal")].into_iter().flatten().collect()
}

/// Start and goal as a mission asks for them: a heading left open as 0, joints left open in the middle of their range.
pub(super) fn of_mission(robot: &RobotModel, [start, goal]: [Option<&PoseSpec>; 2]) -> Vec<Place> {
    let of = |spec: Option<&PoseSpec>, kind: &'static str| {
        let spec = spec?;
        let middle = place::posture(robot, 0.5);
        let joints =
            robot.joints.iter().zip(middle).map(|(j, middle)| spec.joints.get(&j.name).copied().unwrap_or(middle));
        let pose = planar(Pose2::new(spec.x?, spec.y?, spec.yaw.unwrap_or(0.0)));
        Some(Place { name: kind.into(), kind, pose, joints: Some(joints.collect()), link: None })
    };
    [of(start, "start"), of(goal, "goal")].into_iter().flatten().collect()
}

/// Where a failure's figures say that the robot got to and got stuck.
pub(super) fn of_failure(
    robot: &RobotModel,
    code: &str,
    numbers: &Map<String, Value>,
    places: &mut Vec<Place>,
) -> Option<Gap> {
    let value = |key: &str| numbers.get(key).and_then(Value::as_f64);
    let pose = |prefix: &str| {
        let [x, y] = ["x_m", "y_m"].map(|key| value(&format!("{prefix}_{key}")));
        let yaw = value(&format!("{prefix}_yaw_rad")).unwrap_or(0.0);
        Some(planar(Pose2::new(x?, y?, yaw)))
    };
    let posture = |key: &str| {
        let values = numbers.get(key)?.as_object()?;
        robot.joints.iter().map(|j| values.get(&j.name)?.as_f64()).collect::<Option<Vec<f64>>>()
    };
    let text = |key: &str| numbers.get(key).and_then(Value::as_str).map(str::to_owned);
    let all = |joints: Option<Vec<f64>>| joints.or_else(|| robot.joints.is_empty().then(Vec::new));
    let blocked = match code {
        "search/start-blocked" => Some("start"),
        "search/goal-blocked" => Some("goal"),
        _ => None,
    };
    // A blocked end is drawn in the posture that is blocked least.
    if let Some(end) = blocked.and_then(|kind| places.iter_mut().find(|p| p.kind == kind)) {
        end.link = text("link");
        if let (Some(joints), Some(posture)) = (&mut end.joints, numbers.get("posture").and_then(Value::as_object)) {
            for (value, joint) in joints.iter_mut().zip(&robot.joints) {
                *value = posture.get(&joint.name).and_then(Value::as_f64).unwrap_or(*value);
            }
        }
    }
    if let Some(pose) = pose("closest") {
        let joints = all(None);
        places.push(Place { name: "closest pose reached".into(), kind: "reached", pose, joints, link: None });
    }
    if let Some(pose) = pose("tightest") {
        let joints = all(posture("tightest_posture"));
        let link = text("tightest_link");
        places.push(Place { name: "too tight".into(), kind: "stuck", pose, joints, link });
    }
    if let Some(pose) = pose("nearest_free") {
        let joints = blocked.and_then(|kind| places.iter().find(|p| p.kind == kind)).and_then(|p| p.joints.clone());
        places.push(Place { name: "nearest free pose".into(), kind: "free", pose, joints, link: None });
    }
    let at = [value("narrowest_gap_x_m")?, value("narrowest_gap_y_m")?];
    Some(Gap { at, width: value("narrowest_gap_m")?, needed: value("least_gap_needed_m")? })
}
