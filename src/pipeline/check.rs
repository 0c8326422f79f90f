//! Command files that are there already: judged, measured.

use super::ends::{end_of, given_path, goal, link_goal, start_of, vias};
use super::{Inputs, World};
use crate::certify::{self, Certificate, Demands, Task, Trust};
use crate::command::CommandTable;
use crate::diag::{Diagnostic, Diagnostics};
use crate::geom::Pose2;
use crate::mission::Tolerance;
use crate::report::path_error;
use crate::report::schema::TrustPart;
use crate::retime::{self, RetimeOptions};
use crate::robot::RobotModel;
use crate::trajectory::Trajectory;

/// Judges commands that this program did not plan, against a mission's robot, map, limits, start and goal.
///
/// `world` is what [`super::world`] made of `inputs`.
///
/// # Errors
/// Joints of the table that are not the robot's; no rows; a given path that is none.
pub fn check(inputs: &Inputs, world: &World, table: &CommandTable) -> Result<Certificate, Diagnostics> {
    let World { robot, map } = world;
    let mission = &inputs.mission;
    let task = task(inputs, robot, table)?;
    let link = link_goal(mission, robot);
    let demands = Demands { vias: &vias(mission, robot), zones: mission.speed_zones(), link: link.as_ref() };
    Ok(certify::certify_through(table, robot, map.as_deref(), &task, demands))
}

/// How far such commands can be trusted without feedback, within the robot's tolerance or, without one, the one assumed.
///
/// # Errors
/// As [`check`].
pub fn trust(inputs: &Inputs, world: &World, table: &CommandTable) -> Result<Option<TrustPart>, Diagnostics> {
    let task = task(inputs, &world.robot, table)?;
    Ok(trust_in(world, table, &task).map(|(_, part)| part))
}

/// The same of commands that are to do a task, with the tube.
pub(super) fn trust_in(world: &World, table: &CommandTable, task: &Task) -> Option<(Trust, TrustPart)> {
    let World { robot, map } = world;
    let tolerance = robot.tolerance.unwrap_or(Tolerance::ASSUMED);
    let trust = certify::trust(table, robot, map.as_deref(), task, tolerance)?;
    let part = TrustPart::new(&trust, robot.tolerance.is_some(), map.is_some());
    Some((trust, part))
}

/// What the mission asks of a table; what it leaves open is as the table has it.
fn task(inputs: &Inputs, robot: &RobotModel, table: &CommandTable) -> Result<Task, Diagnostics> {
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
    let given = match &mission.path {
        Some(path) => Some(given_path(mission, path, inputs.path_csv.as_ref(), robot)?),
        None => None,
    };
    let asked = mission.start.as_ref();
    let start = match &given {
        Some(trajectory) => start_of(trajectory).0,
        None => Pose2::new(
            asked.and_then(|p| p.x).unwrap_or(first.pose.x),
            asked.and_then(|p| p.y).unwrap_or(first.pose.y),
            asked.and_then(|p| p.yaw).unwrap_or(first.pose.yaw),
        ),
    };
    let start_joints = robot.joints.iter().zip(&first.joint_positions);
    let start_joints =
        start_joints.map(|(j, own)| asked.and_then(|p| p.joints.get(&j.name).copied()).unwrap_or(*own)).collect();
    let goal = goal(mission, robot, given.as_ref().map(end_of));
    Ok(Task { start, start_joints, goal, clearance: mission.clearance, reverse: mission.reverse })
}

/// The path error of commands as they are written: their replay against the mission's given path, or, where the path was
/// planned, against the table's own planned poses.
///
/// # Errors
/// No rows; a given path that is none.
pub fn path_error_of_commands(
    inputs: &Inputs,
    world: &World,
    table: &CommandTable,
) -> Result<crate::report::PathErrorRow, Diagnostics> {
    let robot = &world.robot;
    let mission = &inputs.mission;
    let Some(first) = table.rows.first() else {
        return Err(Diagnostic::error("check/empty", "the command file has no row").into());
    };
    let trajectory = match &mission.path {
        Some(path) => given_path(mission, path, inputs.path_csv.as_ref(), robot)?,
        None => planned_poses(table),
    };
    let options = RetimeOptions { law: crate::mission::TimeLaw::Auto, sampling_time: table.sampling_time };
    let reference = path_error::PathReference::new(&retime::retime(&trajectory, robot, &options)?);
    let (start, _) = start_of(&trajectory);
    let start = if mission.path.is_some() { start } else { first.pose };
    Ok((&path_error::path_error_of_table(table, start, &reference)).into())
}

/// The planned poses of a table as straight drives and spins: what is left of a plan in a command file.
fn planned_poses(table: &CommandTable) -> Trajectory {
    let states = table.rows.iter().map(|row| (row.pose, row.joint_positions.clone())).collect::<Vec<_>>();
    crate::trajectory::through_poses(&states)
}
