//! What a mission's text and files mean, before anything is planned.

use super::{Inputs, World};
use crate::diag::{Diagnostic, Diagnostics, Span, nearest};
use crate::map::{self, MapInputs};
use crate::mission::{Mission, ToleranceSpec};
use crate::robot::{self, RobotInputs, RobotModel};

/// The robot and the map, checked against what the mission says of them.
///
/// # Errors
/// All faults found.
pub fn world(inputs: &mut Inputs) -> Result<World, Diagnostics> {
    let mission = &inputs.mission;
    let mut robot = robot::parse(RobotInputs {
        spec: &inputs.robot_spec,
        urdf: (&inputs.urdf.name, &inputs.urdf.text),
        files: inputs.files.as_mut(),
        overrides: &mission.limits,
    })?;
    robot.tolerance = ToleranceSpec::resolved(mission.tolerance, inputs.robot_spec.tolerance);
    let faults = unknown_joints(mission, &robot);
    if !faults.is_empty() {
        return Err(Diagnostics(faults));
    }
    let map = match (&mission.map, &inputs.map) {
        (Some(spec), Some(file)) => {
            let beside = file.beside.as_ref().map(|(name, bytes)| (name.as_str(), bytes.as_slice()));
            let inputs = MapInputs { name: &file.name, bytes: &file.bytes, beside };
            Some(map::parse(&inputs, spec, robot.top_over_all_postures())?.into())
        }
        _ => None,
    };
    Ok(World { robot, map })
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
                let hint = match nearest(name, names.iter().copied()) {
                    Some(known) => format!("did you mean `{known}`?"),
                    None if names.is_empty() => "this robot has no moving joint".to_owned(),
                    None => format!("moving joints: {}", names.join(", ")),
                };
                let message = format!("`{under}.joints` names `{name}`, which is no moving joint of `{}`", robot.name);
                faults.push(Diagnostic::error("mission/unknown-joint", message).maybe_at(span(under, name)).hint(hint));
                continue;
            };
            if *value < joint.lower - 1e-9 || *value > joint.upper + 1e-9 {
                let message = format!(
                    "`{under}.joints.{name}` is {value}, outside its limits {} to {}",
                    joint.lower, joint.upper
                );
                faults.push(
                    Diagnostic::error("mission/joint-out-of-limits", message)
                        .maybe_at(span(under, name))
                        .hint("angles are radians, or with `deg`"),
                );
            }
        }
    }
    faults
}
