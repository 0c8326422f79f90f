//! Motions and receivers for the tests of this stage.

use std::cell::RefCell;
use std::rc::Rc;

use crate::command::limits::differences;
use crate::command::{CommandRow, CommandTable};
use crate::geom::Pose2;
use crate::mission::Sampling;
use crate::play::motion::{Motion, speed};
use crate::play::sink::{Command, Sink, SinkError, Upcoming};
use crate::robot::{MotionLimits, MovingJoint, RobotModel};
use crate::trajectory::fixtures;

/// Held speeds of each actuator (wheels in rad/s, joints in rad/s) as a table whose poses are its replay.
pub fn table(speeds: &[Vec<f64>], hold: f64) -> CommandTable {
    let joints = speeds.len() - 2;
    let mut table = CommandTable {
        sampling_time: hold,
        sampling: Sampling::Mean,
        wheel_radii: 0.1.into(),
        track_width: 0.4,
        joints: (0..joints).map(|j| (format!("joint{j}"), false)).collect(),
        rows: Vec::new(),
    };
    let (mut pose, mut positions) = (Pose2::new(1.0, -2.0, 0.5), vec![0.0; joints]);
    for k in 0..speeds[0].len() {
        table.rows.push(CommandRow {
            wheel_left: speeds[0][k],
            wheel_right: speeds[1][k],
            joint_positions: positions.clone(),
            joint_velocities: speeds[2..].iter().map(|s| s[k]).collect(),
            pose,
        });
        let (v, omega) = table.twist(k);
        pose = pose.after_twist(v, omega, hold);
        positions.iter_mut().zip(&speeds[2..]).for_each(|(q, s)| *q += hold * s[k]);
    }
    table
}

/// Speeds that go from level to level, each level `rows` long, with limited acceleration and jerk: means over `first` and then over
/// `second` rows. Begins and ends at rest.
pub fn smooth(levels: &[f64], rows: usize, [first, second]: [usize; 2]) -> Vec<f64> {
    let mut speeds: Vec<f64> = levels.iter().flat_map(|level| vec![*level; rows]).collect();
    for width in [first, second] {
        let at = |k: usize| speeds.get(k).copied().unwrap_or(0.0);
        let length = speeds.len() + width;
        speeds = (0..length)
            .map(|k| (0..width).map(|i| if k >= i { at(k - i) } else { 0.0 }).sum::<f64>() / width as f64)
            .collect();
    }
    *speeds.last_mut().expect("not empty") = 0.0;
    speeds
}

/// Half a minute's drive at 100 Hz: ahead, a bend, ahead.
pub fn drive(rows: usize) -> CommandTable {
    let left = smooth(&[3.0, 2.0, 3.0], rows / 3, [60, 25]);
    let right = smooth(&[3.0, 4.0, 3.0], rows / 3, [60, 25]);
    table(&[left, right], 0.01)
}

/// A robot whose limits are the peaks of a table, so that there is no room.
pub fn tight_robot(table: &CommandTable) -> RobotModel {
    let peaks = |actuator: usize| differences(table.rows.iter().map(|row| speed(row, actuator)), table.sampling_time);
    let limits = |[speed, acceleration, jerk]: [f64; 3]| MotionLimits {
        speed: Some(speed),
        acceleration: Some(acceleration),
        jerk: Some(jerk),
    };
    let (left, right) = (peaks(0), peaks(1));
    let wheel = [0, 1, 2].map(|k| table.wheel_radii.mean * left[k].max(right[k]).max(1e-6));
    let joints = table.joints.iter().enumerate().map(|(j, (name, prismatic))| MovingJoint {
        name: name.clone(),
        prismatic: *prismatic,
        lower: f64::NEG_INFINITY,
        upper: f64::INFINITY,
        limits: limits(peaks(2 + j).map(|peak| peak.max(1e-6))),
    });
    fixtures::robot(table.track_width, wheel, joints.collect())
}

/// What a receiver got, and when.
#[derive(Debug, Clone, Default)]
pub struct Heard {
    /// Sequence, time as the file counts it, wheels.
    pub commands: Vec<(u64, f64, [f64; 2])>,
    /// When each arrived, s.
    pub arrivals: Vec<f64>,
    /// Rows of each plan announced.
    pub plans: Vec<usize>,
    /// Times of frames.
    pub frames: Vec<f64>,
}

/// A receiver that keeps all, and does something with each command.
pub struct Recorder<'a> {
    /// What came.
    pub heard: Rc<RefCell<Heard>>,
    /// Called with the sequence of each command.
    pub on_command: Box<dyn FnMut(u64) -> Result<(), SinkError> + 'a>,
    /// The time now.
    pub now: Box<dyn Fn() -> f64 + 'a>,
    /// As of the sink.
    pub frame_time: Option<f64>,
}

impl Sink for Recorder<'_> {
    fn announce(&mut self, plan: &CommandTable) -> Result<(), SinkError> {
        self.heard.borrow_mut().plans.push(plan.rows.len());
        Ok(())
    }

    fn send(&mut self, command: &Command<'_>, _at: f64) -> Result<(), SinkError> {
        let mut heard = self.heard.borrow_mut();
        heard.commands.push((command.sequence, command.time, [command.row.wheel_left, command.row.wheel_right]));
        heard.arrivals.push((self.now)());
        (self.on_command)(command.sequence)
    }

    fn frame_time(&self) -> Option<f64> {
        self.frame_time
    }

    fn frame(&mut self, at: f64, _upcoming: Option<Upcoming>) -> Result<(), SinkError> {
        self.heard.borrow_mut().frames.push(at);
        Ok(())
    }

    fn tail(&self) -> f64 {
        if self.frame_time.is_some() { 0.5 } else { 0.0 }
    }
}

/// A motion and its robot's limits.
pub fn ready(table: CommandTable) -> (Motion, crate::play::pace::Limits) {
    let robot = tight_robot(&table);
    let motion = Motion::new(table);
    let limits = crate::play::pace::Limits::new(&robot, &motion);
    (motion, limits)
}
