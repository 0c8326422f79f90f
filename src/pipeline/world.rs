//! What a mission's text and files mean, before anything is planned.

use super::{Inputs, StartFile, World};
use crate::diag::{Diagnostic, Diagnostics, Span, suggestion};
use crate::geom::wrap_angle;
use crate::map::{self, MapInputs};
use crate::mission::{Mission, PoseSpec, ToleranceSpec};
use crate::robot::{self, MovingJoint, RobotInputs, RobotModel};

/// Wheels are the same up to this, m.
const SAME_WHEELS: f64 = 1e-9;

/// The robot and the map, checked against what the mission says of them.
///
/// # Errors
/// All faults found.
pub fn world(inputs: &mut Inputs) -> Result<World, Diagnostics> {
    let mut robot = robot::parse(RobotInputs {
        spec: &inputs.robot_spec,
        urdf: (&inputs.urdf.name, &inputs.urdf.text),
        files: inputs.files.as_mut(),
        overrides: &inputs.mission.limits,
    })?;
    robot.tolerance = ToleranceSpec::resolved(inputs.mission.tolerance, inputs.robot_spec.tolerance);
    if let Some(file) = &inputs.start_file {
        inputs.mission.start = Some(end_of(file, &robot, &inputs.mission)?);
    }
    let mission = &inputs.mission;
    let mut faults = unknown_joints(mission, &robot);
    faults.extend(unknown_link(mission, &robot));
    if !faults.is_empty() {
        return Err(Diagnostics(faults));
    }
    let map = match (&mission.map, &inputs.map) {
        (Some(spec), Some(file)) => {
            let beside = file.beside.as_ref().map(|(name, bytes)| (name.as_str(), bytes.as_slice()));
            let inputs = MapInputs { name: &file.name, bytes: &file.bytes, beside };
            let parsed = map::parse(&inputs, spec, robot.top_over_all_postures());
            Some(parsed.map_err(|faults| asked_by(mission, faults))?.into())
        }
        _ => None,
    };
    Ok(World { robot, map })
}

/// Points faults between a map's file and the mission to what the mission asks for.
fn asked_by(mission: &Mission, Diagnostics(mut faults): Diagnostics) -> Diagnostics {
    let spans = &mission.spans;
    for fault in &mut faults {
        let asked = match fault.code {
            "map/resolution-differs" => &spans.map_resolution,
            "map/origin" if fault.at.is_none() => &spans.map_origin,
            "map/height" => &spans.map_height,
            _ => continue,
        };
        if let (Some(at), Some(file)) = (asked, &fault.file) {
            fault.message = format!("{}, in `{file}`", fault.message);
            fault.at = Some(at.clone());
        }
    }
    Diagnostics(faults)
}

/// Where the motion of a command file ends: pose and joints, as replayed.
fn end_of(file: &StartFile, robot: &RobotModel, mission: &Mission) -> Result<PoseSpec, Diagnostics> {
    let StartFile { name, table, .. } = file;
    let fault = |code, message: String, hint: &str| {
        Diagnostics::from(Diagnostic::error(code, message).maybe_at(mission.spans.start_file.as_ref()).hint(hint))
    };
    let same = "a motion goes on only with the same robot";
    let [theirs, own] = [
        table.joints.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(),
        robot.joints.iter().map(|joint| joint.name.as_str()).collect(),
    ];
    let kinds = table.joints.iter().zip(&robot.joints).all(|((_, prismatic), joint)| *prismatic == joint.prismatic);
    if theirs != own || !kinds {
        let message = format!("`{name}` moves the joints [{}], the robot has [{}]", theirs.join(", "), own.join(", "));
        return Err(fault("mission/start-robot", message, same));
    }
    let ([left, right], [own_left, own_right]) = (table.wheel_radii.sides(), robot.wheel_radii.sides());
    let wheels = [
        ("left wheel radius", left, own_left),
        ("right wheel radius", right, own_right),
        ("track width", table.track_width, robot.track_width),
    ];
    if let Some((what, theirs, own)) = wheels.into_iter().find(|(_, theirs, own)| (theirs - own).abs() > SAME_WHEELS) {
        let message = format!("`{name}` is for a robot with a {what} of {theirs} m, this one has {own} m");
        return Err(fault("mission/start-robot", message, same));
    }
    let (Some(first), Some(last)) = (table.rows.first(), table.rows.last()) else {
        return Err(fault("mission/start-file", format!("`{name}` has no row"), "name a complete command file"));
    };
    if [last.wheel_left, last.wheel_right].iter().chain(&last.joint_velocities).any(|speed| *speed != 0.0) {
        let message = format!("`{name}` does not end at rest, so nothing can start there");
        return Err(fault("mission/start-file", message, "its last row must have all speeds zero"));
    }
    let end = table.replay(first.pose).last().copied().unwrap_or(first.pose);
    // Rounding may leave a joint a little outside its range.
    let value = |(joint, value): (&MovingJoint, &f64)| (joint.name.clone(), value.clamp(joint.lower, joint.upper));
    let joints = robot.joints.iter().zip(&last.joint_positions).map(value).collect();
    let yaw = Some(wrap_angle(end.yaw));
    Ok(PoseSpec { x: Some(end.x), y: Some(end.y), yaw, joints, ..PoseSpec::default() })
}

/// The link that the goal names, where the robot has none of that name.
fn unknown_link(mission: &Mission, robot: &RobotModel) -> Option<Diagnostic> {
    let link = mission.goal.as_ref()?.link.as_ref()?;
    let names = || robot.links.iter().map(|link| link.name.as_str());
    if names().any(|name| name == link.name) {
        return None;
    }
    let message = format!("`goal.link` names `{}`, which is no link of `{}`", link.name, robot.name);
    let hint = suggestion(&link.name, names(), "its links are", "it has no link");
    Some(Diagnostic::error("mission/unknown-link", message).maybe_at(mission.spans.goal_link.as_ref()).hint(hint))
}

/// Joints that the mission names and the robot does not move, or cannot hold at that value.
fn unknown_joints(mission: &Mission, robot: &RobotModel) -> Vec<Diagnostic> {
    let names: Vec<&str> = robot.joints.iter().map(|j| j.name.as_str()).collect();
    let span = |under: &str, name: &str| -> Option<&Span> {
        mission.spans.joints.iter().find(|j| j.under == under && j.name == name).map(|j| &j.at)
    };
    let mut faults = Vec::new();
    let ends = [("start", &mission.start), ("goal", &mission.goal)].map(|(key, pose)| (key.to_owned(), pose.as_ref()));
    let vias = mission.via.iter().enumerate().map(|(i, via)| (format!("via[{i}]"), Some(&via.place)));
    for (under, pose) in ends.into_iter().chain(vias) {
        let under = under.as_str();
        for (name, value) in pose.iter().flat_map(|p| &p.joints) {
            let Some(joint) = robot.joints.iter().find(|j| j.name == *name) else {
                let hint =
                    suggestion(name, names.iter().copied(), "its moving joints are", "this robot has no moving joint");
                let message = format!("`{under}.joints` names `{name}`, which is no moving joint of `{}`", robot.name);
                faults.push(Diagnostic::error("mission/unknown-joint", message).maybe_at(span(under, name)).hint(hint));
                continue;
            };
            if *value < joint.lower - 1e-9 || *value > joint.upper + 1e-9 {
                let message = format!(
                    "`{under}.joints.{name}` is {value}, outside its limits {} to {}",
                    joint.lower, joint.upper
                );
                let degrees = |value: f64| (value.to_degrees() * 1e6).round() / 1e6;
                let hint = if joint.prismatic {
                    "write a value within them, in metres".to_owned()
                } else {
                    let [lower, upper] = [joint.lower, joint.upper].map(degrees);
                    format!("write radians within them, or degrees from `{lower}deg` to `{upper}deg`")
                };
                let fault = Diagnostic::error("mission/joint-out-of-limits", message);
                faults.push(fault.maybe_at(span(under, name)).hint(hint));
            }
        }
    }
    faults
}
