//! How far commands can be trusted without feedback: until a robot within a tolerance may touch something.

use super::rollout::Rollout;
use super::tube::{Tube, Width};
use super::{Task, clearance, table};
use crate::command::CommandTable;
use crate::map::VoxelMap;
use crate::mission::Tolerance;
use crate::robot::RobotModel;

/// The tube when a row begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TubePoint {
    /// s.
    pub time: f64,
    /// Length of the base's path so far, m.
    pub length: f64,
    /// How far the robot can be off.
    pub width: Width,
    /// Where the base is, m.
    pub place: [f64; 2],
    /// How: the base's origin by -1 to 1 times each of these, m (wheels alike, track, wheels apart, heading at the start),
    pub drift: [[f64; 2]; 4],
    /// the heading with each by this, rad,
    pub turning: [f64; 4],
    /// and by this in any direction, m.
    pub anywhere: f64,
    /// How far joints that are late move any point besides, m.
    pub late: f64,
}

/// How far commands can be trusted by a robot within a tolerance and without feedback.
#[derive(Debug, Clone, PartialEq)]
pub struct Trust {
    /// The tolerance.
    pub tolerance: Tolerance,
    /// The tube when each row begins; the last is the end.
    pub tube: Vec<TubePoint>,
    /// The first row in which a robot in the tube may touch an obstacle; `None`: in none, or there is no map.
    pub contact: Option<usize>,
}

impl Trust {
    /// The end of the motion.
    pub fn end(&self) -> TubePoint {
        self.tube[self.tube.len() - 1]
    }

    /// The end of what can be trusted; of the whole motion where there is no contact.
    pub fn until(&self) -> TubePoint {
        self.tube[self.contact.unwrap_or(self.tube.len() - 1)]
    }
}

/// The tube when each row of a table begins; empty for a table that cannot be replayed.
pub fn tube_along(table: &CommandTable, robot: &RobotModel, task: &Task, tolerance: Tolerance) -> Vec<TubePoint> {
    if !table::unreadable(table, robot, task).is_empty() {
        return Vec::new();
    }
    let rollout = Rollout::new(table, task.start, &task.start_joints);
    along(&rollout, &Tube::new(&rollout, robot, tolerance))
}

/// How far a table can be trusted; `None` where it cannot be replayed.
pub fn trust(
    table: &CommandTable,
    robot: &RobotModel,
    map: Option<&VoxelMap>,
    task: &Task,
    tolerance: Tolerance,
) -> Option<Trust> {
    if !table::unreadable(table, robot, task).is_empty() {
        return None;
    }
    let rollout = Rollout::new(table, task.start, &task.start_joints);
    let tube = Tube::new(&rollout, robot, tolerance);
    let contact = map.and_then(|map| clearance::first_contact(&rollout, robot, map, &tube));
    Some(Trust { tolerance, tube: along(&rollout, &tube), contact })
}

fn along(rollout: &Rollout<'_>, tube: &Tube<'_>) -> Vec<TubePoint> {
    let mut length = 0.0;
    let point = |row: usize| {
        let (drift, turning) = tube.parts(row);
        let pose = rollout.pose(row, 0.0);
        let point = TubePoint {
            time: rollout.time(row, 0.0),
            length,
            width: tube.width(row, 0.0),
            place: [pose.x, pose.y],
            drift: drift.map(|v| [v.x, v.y]),
            turning,
            anywhere: tube.anywhere(row),
            late: tube.late(row),
        };
        length += rollout.held(row).speed.abs() * rollout.step();
        point
    };
    (0..rollout.rows()).map(point).collect()
}
