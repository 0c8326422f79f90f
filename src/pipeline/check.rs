//! Command files that are there already: judged, measured.

use super::{Inputs, World, end_of, given_path, start_of, world};
use crate::certify::{self, Certificate, Goal, Task};
use crate::command::CommandTable;
use crate::diag::{Diagnostic, Diagnostics};
use crate::geom::Pose2;
use crate::mission::PoseSpec;
use crate::report::{Metrics, metrics, path_error};
use crate::retime::{self, RetimeOptions};
use crate::trajectory::Trajectory;

/// Judges commands that this program did not plan, against a mission's robot, map, limits, start and goal.
///
/// # Errors
/// Bad inputs; joints of the table that are not the robot's.
pub fn check(inputs: &mut Inputs, table: &CommandTable) -> Result<Certificate, Diagnostics> {
    let World { robot, map } = world(inputs)?;
    let mission = &inputs.mission;
    let expected: Vec<&str> = robot.joints.iter().map(|j| j.name.as_str()).collect();
    let found: Vec<&str> = table.joints.iter().map(|(name, _)| name.as_str()).collect();
    if expected != found {
        let message =
            format!("the commands move joints [{}], the robot has [{}]", found.join(", "), expected.join(", "));
        return Err(Diagnostic::error("check/joints", message).into());
    }
    let Some(first) = table.rows.first() else {
        return Err(Diagnostic::error("check/empty", "the command file has no row").into());
    };
    let (start, goal) = match &mission.path {
        Some(path) => {
            let trajectory = given_path(mission, path, inputs.path_csv.as_ref(), &robot)?;
            (Some(start_of(&trajectory)), Some(end_of(&trajectory)))
        }
        None => (None, None),
    };
    let asked = |pose: &Option<PoseSpec>, f: fn(&PoseSpec) -> Option<f64>| pose.as_ref().and_then(f);
    let start_pose = match &start {
        Some((pose, _)) => *pose,
        None => Pose2::new(
            asked(&mission.start, |p| p.x).unwrap_or(first.pose.x),
            asked(&mission.start, |p| p.y).unwrap_or(first.pose.y),
            asked(&mission.start, |p| p.yaw).unwrap_or(first.pose.yaw),
        ),
    };
    let joint = |pose: &Option<PoseSpec>, name: &str| pose.as_ref().and_then(|p| p.joints.get(name).copied());
    let start_joints = robot
        .joints
        .iter()
        .zip(&first.joint_positions)
        .map(|(j, own)| joint(&mission.start, &j.name).unwrap_or(*own))
        .collect();
    let task = Task {
        start: start_pose,
        start_joints,
        goal: Goal {
            x: asked(&mission.goal, |p| p.x).or(goal.map(|g| g.x)).unwrap_or(first.pose.x),
            y: asked(&mission.goal, |p| p.y).or(goal.map(|g| g.y)).unwrap_or(first.pose.y),
            yaw: asked(&mission.goal, |p| p.yaw).or(goal.map(|g| g.yaw)),
            joints: robot.joints.iter().map(|j| joint(&mission.goal, &j.name)).collect(),
        },
        clearance: mission.clearance,
    };
    Ok(certify::certify(table, &robot, map.as_ref(), &task))
}

/// The path error of commands as they are written: their replay against the mission's given path, or, where the path was
/// planned, against the table's own planned poses.
///
/// # Errors
/// Bad inputs.
pub fn path_error_of_commands(
    inputs: &mut Inputs,
    table: &CommandTable,
) -> Result<crate::report::PathErrorRow, Diagnostics> {
    let World { robot, .. } = world(inputs)?;
    let mission = &inputs.mission;
    let Some(first) = table.rows.first() else {
        return Err(Diagnostic::error("check/empty", "the command file has no row").into());
    };
    let trajectory = match &mission.path {
        Some(path) => given_path(mission, path, inputs.path_csv.as_ref(), &robot)?,
        None => planned_poses(table),
    };
    let options = RetimeOptions { law: crate::mission::TimeLaw::Auto, sampling_time: table.sampling_time };
    let reference = path_error::PathReference::new(&retime::retime(&trajectory, &robot, &options)?);
    let (start, _) = start_of(&trajectory);
    let start = if mission.path.is_some() { start } else { first.pose };
    Ok((&path_error::path_error_of_table(table, start, &reference)).into())
}

/// The planned poses of a table as straight drives and spins: what is left of a plan in a command file.
fn planned_poses(table: &CommandTable) -> Trajectory {
    let states = table.rows.iter().map(|row| (row.pose, row.joint_positions.clone())).collect::<Vec<_>>();
    crate::trajectory::through_poses(&states)
}

/// Length and time of the mission's held commands; for tools.
pub fn driven(commands: &CommandTable) -> Metrics {
    metrics::of_commands(commands)
}
