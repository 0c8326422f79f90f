//! The commands replayed by the judge: wheels held from row to row, joints at their held speeds.

use nalgebra::{Isometry3, Matrix3, Vector3};

use super::solid::{Placed, Solid};
use crate::command::CommandTable;
use crate::robot::RobotModel;

type Vector = Vector3<f64>;

/// Base and joints at an instant.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct State {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) yaw: f64,
    pub(super) joints: Vec<f64>,
}

/// A robot driven by a table.
pub(super) struct Motion<'a> {
    robot: &'a RobotModel,
    table: &'a CommandTable,
    solids: Vec<Solid>,
    /// When each row begins.
    pub(super) states: Vec<State>,
    /// Greatest magnitude of each joint over the motion.
    widest: Vec<f64>,
}

impl<'a> Motion<'a> {
    /// From a first state.
    pub(super) fn new(robot: &'a RobotModel, table: &'a CommandTable, start: State) -> Self {
        let mut states = vec![start];
        for row in 1..table.rows.len() {
            let next = driven(table, row - 1, &states[row - 1], table.sampling_time);
            states.push(next);
        }
        let widest = (0..robot.joints.len())
            .map(|joint| states.iter().map(|state| state.joints[joint].abs()).fold(0.0, f64::max))
            .collect();
        Self { robot, table, solids: robot.shapes.iter().map(Solid::of).collect(), states, widest }
    }

    /// Rows, the last of which stands for an instant only.
    pub(super) fn rows(&self) -> usize {
        self.states.len()
    }

    /// How long a row is looked at, s.
    pub(super) fn span(&self, row: usize) -> f64 {
        if row + 1 == self.rows() { 0.0 } else { self.table.sampling_time }
    }

    /// The state within a row.
    pub(super) fn state(&self, row: usize, tau: f64) -> State {
        driven(self.table, row, &self.states[row], tau)
    }

    /// A shape in the map; with `base_fixed`, in the base's frame.
    pub(super) fn place(&self, shape: usize, row: usize, tau: f64, base_fixed: bool) -> Placed<'_> {
        let state = self.state(row, tau);
        // From the shape to the base, joint by joint.
        let own = &self.robot.shapes[shape];
        let (mut turn, mut at) = parts(&own.pose);
        let mut body = own.body;
        loop {
            let this = &self.robot.bodies[body];
            if let Some(motion) = &this.motion {
                let value = motion.multiplier * state.joints[motion.joint] + motion.offset;
                let axis = motion.axis.into_inner();
                if motion.prismatic {
                    at += axis * value;
                } else {
                    let about = about(&axis, value);
                    (turn, at) = (about * turn, about * at);
                }
            }
            let (joint_turn, joint_at) = parts(&this.origin);
            (turn, at) = (joint_turn * turn, joint_turn * at + joint_at);
            if this.motion.is_none() {
                break;
            }
            body = this.parent;
        }
        if !base_fixed {
            let base = about(&Vector::z(), state.yaw);
            (turn, at) = (base * turn, base * at + Vector::new(state.x, state.y, 0.0));
        }
        Placed { solid: &self.solids[shape], turn, at }
    }

    /// No point of a shape is faster than this during a row, m/s; with `base_fixed`, against the base.
    pub(super) fn fastest(&self, shape: usize, row: usize, base_fixed: bool) -> f64 {
        let own = &self.robot.shapes[shape];
        let mut reach = own.pose.translation.vector.norm() + self.solids[shape].radius;
        let mut speed = 0.0;
        let mut body = own.body;
        loop {
            let this = &self.robot.bodies[body];
            if let Some(motion) = &this.motion {
                let rate = (motion.multiplier * self.table.rows[row].joint_velocities[motion.joint]).abs();
                if motion.prismatic {
                    reach += (motion.multiplier * self.widest[motion.joint]).abs() + motion.offset.abs();
                    speed += rate;
                } else {
                    speed += rate * reach;
                }
            }
            reach += this.origin.translation.vector.norm();
            if this.motion.is_none() {
                break;
            }
            body = this.parent;
        }
        let [along, turn] = held(self.table, row);
        if base_fixed { speed } else { speed + along.abs() + turn.abs() * reach }
    }
}

/// Of one wheel, m.
pub(super) fn radius(table: &CommandTable, left: bool) -> f64 {
    let half = table.wheel_radii.difference / 2.0;
    table.wheel_radii.mean * if left { 1.0 - half } else { 1.0 + half }
}

/// Speed along (m/s) and turn rate (rad/s) of a row: \[SCR\] Eq. 1 with its halves.
pub(super) fn held(table: &CommandTable, row: usize) -> [f64; 2] {
    let row = &table.rows[row];
    let (left, right) = (row.wheel_left * radius(table, true), row.wheel_right * radius(table, false));
    [(right + left) / 2.0, (right - left) / table.track_width]
}

/// The state after `tau` seconds of a row's commands: x' = v cos yaw, y' = v sin yaw, yaw' = w, integrated in the frame that the row
/// begins in.
fn driven(table: &CommandTable, row: usize, from: &State, tau: f64) -> State {
    let [speed, rate] = held(table, row);
    let turn = rate * tau;
    let (ahead, aside) = if turn.abs() < 0.02 {
        // Series of sin(t)/t and (1 - cos(t))/t; the next terms are below 1e-17.
        let t2 = turn * turn;
        (1.0 - t2 / 6.0 + t2 * t2 / 120.0 - t2 * t2 * t2 / 5040.0, turn * (0.5 - t2 / 24.0 + t2 * t2 / 720.0))
    } else {
        (turn.sin() / turn, (1.0 - turn.cos()) / turn)
    };
    let (sin, cos) = (from.yaw.sin(), from.yaw.cos());
    let way = speed * tau;
    State {
        x: from.x + way * (ahead * cos - aside * sin),
        y: from.y + way * (ahead * sin + aside * cos),
        yaw: from.yaw + turn,
        joints: from.joints.iter().zip(&table.rows[row].joint_velocities).map(|(q, rate)| q + rate * tau).collect(),
    }
}

/// A turn about a unit axis (Rodrigues).
fn about(axis: &Vector, angle: f64) -> Matrix3<f64> {
    let cross = Matrix3::new(0.0, -axis.z, axis.y, axis.z, 0.0, -axis.x, -axis.y, axis.x, 0.0);
    Matrix3::identity() + cross * angle.sin() + cross * cross * (1.0 - angle.cos())
}

/// A pose as a matrix and a shift.
fn parts(pose: &Isometry3<f64>) -> (Matrix3<f64>, Vector) {
    let (w, [x, y, z]) = (pose.rotation.w, [pose.rotation.i, pose.rotation.j, pose.rotation.k]);
    let turn = Matrix3::new(
        1.0 - 2.0 * (y * y + z * z),
        2.0 * (x * y - z * w),
        2.0 * (x * z + y * w),
        2.0 * (x * y + z * w),
        1.0 - 2.0 * (x * x + z * z),
        2.0 * (y * z - x * w),
        2.0 * (x * z - y * w),
        2.0 * (y * z + x * w),
        1.0 - 2.0 * (x * x + y * y),
    );
    (turn, pose.translation.vector)
}
