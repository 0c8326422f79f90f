//! One case: a robot, a map, commands and what is asked of them.

use super::Family;
use crate::certify::{Certificate, Demands, Goal, Task, Via, certify_through};
use crate::command::{CommandRow, CommandTable};
use crate::geom::Pose2;
use crate::map::VoxelMap;
use crate::mission::{Sampling, SpeedZone};
use crate::robot::RobotModel;

/// Everything that the certificate sees.
#[derive(Debug, Clone)]
pub struct Case {
    /// What it tries.
    pub family: Family,
    /// The robot.
    pub robot: RobotModel,
    /// Its obstacles.
    pub map: Option<VoxelMap>,
    /// What it is told.
    pub table: CommandTable,
    /// What that must do.
    pub task: Task,
    /// Where it must stand.
    pub vias: Vec<Via>,
    /// Where it must be slow.
    pub zones: Vec<SpeedZone>,
}

/// What a row holds: m/s, rad/s, joint rates.
pub(super) type Twist = (f64, f64, Vec<f64>);

impl Case {
    /// The program's own verdict.
    pub fn certify(&self) -> Certificate {
        let demands = Demands { vias: &self.vias, zones: &self.zones, link: None };
        certify_through(&self.table, &self.robot, self.map.as_ref(), &self.task, demands)
    }

    /// A robot that holds these twists one after the other and then rests, with the goal where that ends and nothing else asked.
    pub(super) fn new(
        family: Family,
        robot: RobotModel,
        start: Pose2,
        joints: &[f64],
        step: f64,
        held: &[Twist],
    ) -> Self {
        let rest = (0.0, 0.0, vec![0.0; joints.len()]);
        let mut table = CommandTable {
            sampling_time: step,
            sampling: Sampling::Mean,
            wheel_radii: robot.wheel_radii,
            track_width: robot.track_width,
            joints: robot.joints.iter().map(|j| (j.name.clone(), j.prismatic)).collect(),
            rows: Vec::with_capacity(held.len() + 1),
        };
        let (mut pose, mut values) = (start, joints.to_vec());
        let radii = robot.wheel_radii.sides();
        for (k, (speed, turn, rates)) in held.iter().chain([&rest]).enumerate() {
            let difference = 0.5 * turn * robot.track_width;
            table.rows.push(CommandRow {
                wheel_left: (speed - difference) / radii[0],
                wheel_right: (speed + difference) / radii[1],
                joint_positions: values.clone(),
                joint_velocities: rates.clone(),
                pose,
            });
            let (speed, turn) = table.twist(k);
            if k < held.len() {
                pose = pose.after_twist(speed, turn, step);
                values.iter_mut().zip(rates).for_each(|(q, rate)| *q += rate * step);
            }
        }
        let goal = Goal {
            x: pose.x,
            y: pose.y,
            within: 0.0,
            yaw: Some(pose.yaw),
            joints: values.iter().map(|q| Some(*q)).collect(),
        };
        let task = Task { start, start_joints: joints.to_vec(), goal, clearance: 0.0, reverse: true };
        Self { family, robot, map: None, table, task, vias: Vec::new(), zones: Vec::new() }
    }
}
