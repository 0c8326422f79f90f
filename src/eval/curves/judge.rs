//! One curve under every law.

use super::{Curve, clip};
use crate::certify::{self, Goal, Task};
use crate::command::{self, CommandRow, CommandTable, SampleOptions, limits};
use crate::geom::{Pose2, wrap_angle};
use crate::mission::{Sampling, TimeLaw};
use crate::retime::printed::{Printed, as_printed};
use crate::retime::{self, MotionProfile, RetimeOptions, law_key};
use crate::robot::RobotModel;
use crate::trajectory::{Trajectory, given};

/// How wheel speeds become commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Held {
    /// s.
    pub sampling_time: f64,
    /// Of compiled commands; those that are as the paper has them are `instant`, as its are.
    pub sampling: Sampling,
}

/// How a row's commands are made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum How {
    /// To the letter of \[CONV\]: limits broken where its are, speeds taken at the sampling times.
    Paper(Printed),
    /// As a mission with this law is compiled: slowed down until every limit holds, certified.
    Compiled(TimeLaw),
}

impl How {
    /// Every row of a curve: the paper's four ways, then the laws.
    pub fn all() -> Vec<Self> {
        let paper = [(false, false), (true, false), (false, true), (true, true)];
        let laws =
            [TimeLaw::Printed, TimeLaw::Eq5, TimeLaw::FixedPoint, TimeLaw::Wheel, TimeLaw::Optimal, TimeLaw::Auto];
        let paper = paper.map(|(eq2, eq5)| Self::Paper(Printed { eq2, eq5 }));
        paper.into_iter().chain(laws.map(Self::Compiled)).collect()
    }

    /// As files and JSON name it.
    pub fn key(self) -> &'static str {
        match self {
            Self::Paper(Printed { eq2: false, eq5: false }) => "uncompensated",
            Self::Paper(Printed { eq2: true, eq5: false }) => "uncompensated_eq2",
            Self::Paper(Printed { eq2: false, eq5: true }) => "eq5_to_the_letter",
            Self::Paper(Printed { eq2: true, eq5: true }) => "printed_to_the_letter",
            Self::Compiled(law) => law_key(law),
        }
    }
}

/// A curve, judged.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// Which.
    pub curve: Curve,
    /// In the order of [`How::all`].
    pub rows: Vec<Row>,
}

/// One way to drive a curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Which.
    pub how: How,
    /// What came out, or why nothing did.
    pub outcome: Result<Figures, String>,
}

/// Of one table of commands.
#[derive(Debug, Clone, PartialEq)]
pub struct Figures {
    /// The law's own duration, before it is rounded up to whole rows, s.
    pub time: f64,
    /// The law that `auto` took; else empty.
    pub taken: String,
    /// As written.
    pub table: CommandTable,
    /// The greater of both wheels' peaks of speed, acceleration and jerk as written: first and second differences of what is held, m/s,
    /// m/s^2, m/s^3.
    pub peaks: [f64; 3],
    /// Where a robot ends that follows the commands exactly.
    pub followed: Miss,
    /// Where one ends that clips its wheels' speeds at their limit.
    pub clipped: Miss,
}

/// How far from the path's end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Miss {
    /// m.
    pub distance: f64,
    /// rad, not negative.
    pub angle: f64,
}

impl Figures {
    /// Which of speed, acceleration and jerk are over the robot's limits, as a certificate counts.
    pub fn over(&self, robot: &RobotModel) -> [bool; 3] {
        limits::largest_ratio(self.peaks, &robot.wheel).map(|ratio| ratio > 1.0 + limits::ROUNDING)
    }

    fn of(profile: &MotionProfile, table: CommandTable, robot: &RobotModel) -> Self {
        let rows = || 0..table.rows.len();
        let left = limits::differences(rows().map(|k| table.rim_speeds(k).0), table.sampling_time);
        let right = limits::differences(rows().map(|k| table.rim_speeds(k).1), table.sampling_time);
        let (start, end) = (profile.pose(0.0), profile.pose(profile.time()));
        let miss = |table: &CommandTable| {
            let reached = clip::end(table, start);
            Miss { distance: reached.distance(end), angle: wrap_angle(reached.yaw - end.yaw).abs() }
        };
        let name = profile.law_name();
        Self {
            time: profile.unrounded_time(),
            taken: name.split_once(" (").map_or("", |(_, law)| law.trim_end_matches(')')).to_owned(),
            peaks: [0, 1, 2].map(|k| left[k].max(right[k])),
            followed: miss(&table),
            clipped: miss(&clip::clipped(&table, robot.wheel.speed.unwrap_or(f64::INFINITY))),
            table,
        }
    }
}

/// Drives a curve in every way.
pub fn judge(curve: &Curve, robot: &RobotModel, held: Held) -> Judged {
    let rows = How::all().into_iter().map(|how| Row { how, outcome: row(curve, robot, held, how) });
    Judged { curve: curve.clone(), rows: rows.collect() }
}

fn row(curve: &Curve, robot: &RobotModel, held: Held, how: How) -> Result<Figures, String> {
    let joints = vec![0.0; robot.joints.len()];
    let trajectory = given::from_bezier(&curve.segments, &joints).map_err(|e| e.to_string())?;
    match how {
        How::Paper(printed) => {
            let profile = as_printed(&trajectory, robot, printed).map_err(|e| e.to_string())?;
            let table = as_sampled_by_the_paper(&profile, robot, held.sampling_time);
            Ok(Figures::of(&profile, table, robot))
        }
        How::Compiled(law) => compiled(&trajectory, robot, held, law),
    }
}

fn compiled(trajectory: &Trajectory, robot: &RobotModel, held: Held, law: TimeLaw) -> Result<Figures, String> {
    let Held { sampling_time, sampling } = held;
    let profile =
        retime::retime(trajectory, robot, &RetimeOptions { law, sampling_time }).map_err(|e| e.to_string())?;
    let table =
        command::sample(&profile, robot, &SampleOptions { sampling_time, sampling }).map_err(|e| e.to_string())?;
    let end: Pose2 = profile.pose(profile.time());
    let task = Task {
        start: profile.pose(0.0),
        start_joints: profile.joints(0.0),
        goal: Goal { x: end.x, y: end.y, within: 0.0, yaw: Some(end.yaw), joints: vec![None; robot.joints.len()] },
        clearance: 0.0,
        reverse: false,
    };
    match &certify::certify(&table, robot, None, &task).refusals[..] {
        [] => Ok(Figures::of(&profile, table, robot)),
        [first, ..] => Err(format!("not certified: {}", first.message)),
    }
}

/// Wheel speeds at the sampling times, held; at rest from the first sampling time after the profile's end.
fn as_sampled_by_the_paper(profile: &MotionProfile, robot: &RobotModel, hold: f64) -> CommandTable {
    let intervals = (profile.time() / hold).ceil() as usize;
    let row = |k: usize| {
        let time = k as f64 * hold;
        let speeds = profile.speeds(time);
        CommandRow {
            wheel_left: speeds[0] / robot.wheel_radii.mean,
            wheel_right: speeds[1] / robot.wheel_radii.mean,
            joint_positions: profile.joints(time),
            joint_velocities: speeds[2..].to_vec(),
            pose: profile.pose(time),
        }
    };
    CommandTable {
        sampling_time: hold,
        sampling: Sampling::Instant,
        wheel_radii: robot.wheel_radii,
        track_width: robot.track_width,
        joints: robot.joints.iter().map(|joint| (joint.name.clone(), joint.prismatic)).collect(),
        rows: (0..=intervals).map(row).collect(),
    }
}
