//! Whether a command table makes sense at all, before anything is judged by it.

use super::rollout::Rollout;
use super::{Refusal, RefusalKind, Task, within};
use crate::command::CommandTable;
use crate::geom::wrap_angle;
use crate::robot::RobotModel;

/// The first row is the task's start, and positions follow from speeds, up to this (m or rad).
const CONSISTENT: f64 = 1e-6;
/// The table's wheel radius and track width are the robot's, up to this, m.
const SAME_WHEELS: f64 = 1e-9;
/// Numbers beyond this (SI units) are not judged: rounding would drown the figures.
const LARGEST: f64 = 1e6;

fn refusal(message: String, time: Option<f64>) -> Refusal {
    Refusal { kind: RefusalKind::Table, message, time }
}

/// Faults that leave nothing to replay. Empty: every row has one finite position and speed per joint of the robot.
pub(super) fn unreadable(table: &CommandTable, robot: &RobotModel, task: &Task) -> Vec<Refusal> {
    let mut faults = Vec::new();
    let fine = |value: f64| value.abs() <= LARGEST;
    let mut fault = |wrong: bool, message: &dyn Fn() -> String, time: Option<f64>| {
        if wrong {
            faults.push(refusal(message(), time));
        }
        wrong
    };
    fault(table.rows.is_empty(), &|| "the command table has no rows".into(), None);
    let positive = [
        ("sampling time", table.sampling_time),
        ("left wheel's radius", table.wheel_radii.sides()[0]),
        ("right wheel's radius", table.wheel_radii.sides()[1]),
        ("track width", table.track_width),
    ];
    for (what, value) in positive {
        fault(
            !(value > 1.0 / LARGEST && fine(value)),
            &|| format!("the {what} {value} is not a length of time or space that can be judged"),
            None,
        );
    }
    let (own_radii, radii) = (table.wheel_radii.sides(), robot.wheel_radii.sides());
    for (what, own, robots) in [
        ("left wheel's radius", own_radii[0], radii[0]),
        ("right wheel's radius", own_radii[1], radii[1]),
        ("track width", table.track_width, robot.track_width),
    ] {
        fault(
            !within((own - robots).abs(), SAME_WHEELS),
            &|| format!("the table's {what} is {own} m, the robot's {robots} m"),
            None,
        );
    }
    let same =
        |(own, joint): (&(String, bool), &crate::robot::MovingJoint)| own.0 == joint.name && own.1 == joint.prismatic;
    let agree = table.joints.len() == robot.joints.len() && table.joints.iter().zip(&robot.joints).all(same);
    fault(
        !agree,
        &|| {
            let own: Vec<_> = table.joints.iter().map(|j| j.0.as_str()).collect();
            let robots: Vec<_> = robot.joints.iter().map(|j| j.name.as_str()).collect();
            format!(
                "the table moves the joints [{}], the robot has [{}] (or their kinds differ)",
                own.join(", "),
                robots.join(", ")
            )
        },
        None,
    );
    let joints = robot.joints.len();
    let task_fits = task.start_joints.len() == joints && task.goal.joints.len() == joints;
    fault(!task_fits, &|| format!("the task's start or goal does not have {joints} joint values"), None);
    let Task { start, goal, clearance, .. } = task;
    let task_numbers = [start.x, start.y, start.yaw, goal.x, goal.y, goal.within, *clearance];
    let task_fine = task_numbers.into_iter().chain(task.goal.yaw).chain(task.start_joints.iter().copied());
    let task_fine = task_fine.chain(task.goal.joints.iter().copied().flatten()).all(fine);
    fault(!task_fine, &|| format!("the task has a number that is not finite or beyond {LARGEST:e}"), None);
    for (k, row) in table.rows.iter().enumerate() {
        let time = Some(table.time(k));
        let fits = row.joint_positions.len() == joints && row.joint_velocities.len() == joints;
        let numbers = [row.wheel_left, row.wheel_right, row.pose.x, row.pose.y, row.pose.yaw];
        let numbers =
            numbers.into_iter().chain(row.joint_positions.iter().copied()).chain(row.joint_velocities.iter().copied());
        let bad = fault(!fits, &|| format!("row {k} does not have {joints} joint positions and speeds"), time)
            | fault(
                !numbers.into_iter().all(fine),
                &|| format!("row {k} has a number that is not finite or beyond {LARGEST:e}"),
                time,
            );
        if bad {
            break; // one row shows what is wrong
        }
    }
    faults
}

/// Of each row, whether nothing moves while it is held.
pub(super) fn standing(table: &CommandTable) -> Vec<bool> {
    let still = |row: &crate::command::CommandRow| {
        [row.wheel_left, row.wheel_right].iter().chain(&row.joint_velocities).all(|speed| *speed == 0.0)
    };
    table.rows.iter().map(still).collect()
}

/// Where the table contradicts the task, itself or its replay.
pub(super) fn contradictions(
    table: &CommandTable,
    rollout: &Rollout<'_>,
    robot: &RobotModel,
    task: &Task,
) -> Vec<Refusal> {
    let mut faults = Vec::new();
    let (Some(first), Some(last)) = (table.rows.first(), table.rows.last()) else { return faults };
    let off = [
        (first.pose.x - task.start.x).abs(),
        (first.pose.y - task.start.y).abs(),
        wrap_angle(first.pose.yaw - task.start.yaw).abs(),
    ];
    if off.iter().any(|e| !within(*e, CONSISTENT)) {
        let message = format!(
            "the first row's pose is off the start by ({:.2e} m, {:.2e} m, {:.2e} rad)",
            off[0], off[1], off[2]
        );
        faults.push(refusal(message, Some(0.0)));
    }
    for (index, joint) in robot.joints.iter().enumerate() {
        let error = |k: usize| (table.rows[k].joint_positions[index] - rollout.joints(k)[index]).abs();
        let worst = (0..table.rows.len()).max_by(|a, b| error(*a).total_cmp(&error(*b)));
        if let Some(k) = worst.filter(|k| !within(error(*k), CONSISTENT)) {
            let (time, error) = (table.time(k), error(k));
            let message =
                format!("`{}`: position is off its integrated speed by {error:.2e} at t = {time:.3} s", joint.name);
            faults.push(refusal(message, Some(time)));
        }
    }
    if [last.wheel_left, last.wheel_right].iter().chain(&last.joint_velocities).any(|speed| *speed != 0.0) {
        let time = table.duration();
        let message = format!("the last row (t = {time:.3} s) is not at rest");
        faults.push(Refusal { kind: RefusalKind::End, message, time: Some(time) });
    }
    faults
}
