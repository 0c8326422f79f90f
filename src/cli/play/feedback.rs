//! `trajc play --feedback SOURCE` and `--to stdio`: poses in, commands out.

use std::io::{BufRead, Write};

use serde_json::json;

use super::sinks::{self, SinkArgs};

use crate::command::CommandTable;
use crate::diag::{Diagnostic, Diagnostics};
use crate::play::follow::{Followed, follow};
use crate::play::pace::Limits;
use crate::play::poses::{self, Poses, UdpPoses};
use crate::play::sink::Sink;
use crate::play::tracking::tube::Tube;
use crate::play::tracking::{Command, Options, Phase, State, Tracker, Why, law};
use crate::play::{MonotonicClock, Motion, SinkError};
use crate::robot::RobotModel;

/// Room without a map or clearance, m.
const NO_MAP: f64 = 0.1;
/// Default of `--leave-rad`.
const TURN: f64 = 0.5;

/// Where poses come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Source {
    /// `udp://HOST:PORT`: JSON in datagrams.
    Udp(String),
    /// `ros2[:/TOPIC]`: odometry, or transforms where the topic is `/tf`.
    Ros2(String),
}

fn source(text: &str) -> Result<Source, String> {
    let named = |topic: &str| topic.strip_prefix('/').is_some_and(|name| !name.is_empty() && !name.contains(' '));
    match text.strip_prefix("udp://") {
        None if text == "ros2" => Ok(Source::Ros2("/odom".to_owned())),
        None if text.strip_prefix("ros2:").is_some_and(named) => Ok(Source::Ros2(text[5..].to_owned())),
        Some(at) if at.rsplit_once(':').is_some_and(|(host, port)| !host.is_empty() && port.parse::<u16>().is_ok()) => {
            Ok(Source::Udp(at.to_owned()))
        }
        _ => Err(format!("no source `{text}`; there are udp://HOST:PORT, where poses are sent to, and ros2[:/TOPIC]")),
    }
}

/// How to play with feedback.
#[derive(Debug, clap::Args)]
pub(super) struct FeedbackArgs {
    /// Follow the path by measured poses: JSON objects {"t", "x", "y", "yaw"} in datagrams to udp://HOST:PORT here, or ros2[:/TOPIC],
    /// Odometry [default: /odom] or, of /tf, transforms.
    #[arg(long, value_name = "SOURCE", value_parser = source)]
    pub feedback: Option<Source>,
    /// Feedback from /tf: the frame in which the mission's poses are.
    #[arg(long, value_name = "FRAME", default_value = "map")]
    #[cfg_attr(not(feature = "ros2"), allow(dead_code))]
    map_frame: String,
    /// Feedback: stop when a point of the robot may be this far from where it is planned, in metres [default: the proven clearance].
    #[arg(long, value_name = "M", value_parser = positive)]
    leave_m: Option<f64>,
    /// Feedback: stop when the heading is off by so much, in radians.
    #[arg(long, value_name = "RAD", default_value_t = TURN, value_parser = positive)]
    leave_rad: f64,
    /// Feedback: seconds from a command to its execution, as far as known; what is beyond is found.
    #[arg(long, value_name = "S", default_value = "0", value_parser = seconds)]
    latency: f64,
    /// Feedback: stop when no pose has come for so many seconds.
    #[arg(long, value_name = "S", default_value = "0.5", value_parser = positive)]
    lost_after: f64,
    /// Feedback: standard deviation of the poses' coordinates, in metres.
    #[arg(long, value_name = "M", default_value = "0.005", value_parser = positive)]
    noise_m: f64,
    /// Feedback: standard deviation of the poses' headings, in radians.
    #[arg(long, value_name = "RAD", default_value = "0.0087", value_parser = positive)]
    noise_rad: f64,
}

fn positive(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|v| (1e-6..=1e6).contains(v)).ok_or_else(|| "expected a number above 0".to_owned())
}

fn seconds(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|v| (0.0..=10.0).contains(v)).ok_or_else(|| "expected seconds, such as 0.1".to_owned())
}

impl FeedbackArgs {
    fn options(&self, reverse: bool) -> Options {
        Options {
            latency: self.latency,
            lost_after: self.lost_after,
            reverse,
            noise: self.noise_m,
            turn_noise: self.noise_rad,
        }
    }

    /// The room: the proven clearance for every point of the robot, unless it is given.
    fn tube(&self, robot: &RobotModel, table: &CommandTable, clearance: Option<f64>) -> Tube {
        let reach = table.rows.iter().map(|row| robot.radius(&row.joint_positions)).fold(0.0, f64::max);
        let metres = self.leave_m.or(clearance.filter(|c| *c > 0.0)).unwrap_or(NO_MAP);
        Tube::constant(metres, self.leave_rad, reach)
    }
}

/// What is followed.
pub(super) struct Following<'a> {
    pub args: &'a FeedbackArgs,
    pub robot: &'a RobotModel,
    pub motion: &'a Motion,
    pub limits: &'a Limits,
    pub reverse: bool,
    /// Proven, m.
    pub clearance: Option<f64>,
}

impl Following<'_> {
    /// A source of poses, opened.
    ///
    /// # Errors
    /// It cannot be had; it was not built in.
    pub fn poses(&self, source: &Source, sinks: &SinkArgs) -> Result<Box<dyn Poses>, Diagnostics> {
        let joints = &self.motion.table().joints;
        // Unused where ROS 2 was not built in.
        let _ = sinks;
        match source {
            Source::Udp(at) => Ok(Box::new(UdpPoses::new(at, joints).map_err(sinks::fault)?)),
            #[cfg(feature = "ros2")]
            Source::Ros2(topic) => {
                let frames = poses::ros::Frames::new(self.robot, &self.args.map_frame);
                let poses = poses::dds::DdsPoses::new(sinks::domain(sinks)?, topic, frames, joints.len());
                Ok(Box::new(poses.map_err(sinks::fault)?))
            }
            #[cfg(not(feature = "ros2"))]
            Source::Ros2(_) => Err(sinks::not_built("ros2")),
        }
    }

    /// In real time, by the poses of a source.
    pub fn live(
        &self,
        mut poses: Box<dyn Poses>,
        wait: f64,
        sink: &mut dyn Sink,
        requests: &dyn Fn() -> usize,
    ) -> Result<Followed, SinkError> {
        let table = self.motion.table();
        let tube = self.args.tube(self.robot, table, self.clearance);
        let tracker = Tracker::new(self.motion, self.robot, self.limits, &tube, self.args.options(self.reverse));
        let period = table.sampling_time.min(0.5 * law::longest_hold(0.0)).min(0.1);
        let mut clock = MonotonicClock::new();
        follow(&tracker, self.motion, sink, &mut clock, poses.as_mut(), requests, [period, wait])
    }

    /// A line out for each line in, time by the poses' stamps, until the motion is over or the input ends. How it ended.
    ///
    /// # Errors
    /// Streams that are broken.
    pub fn lines(&self, input: &mut dyn BufRead, output: &mut dyn Write) -> Result<Phase, Diagnostics> {
        let broken = |error: std::io::Error| Diagnostic::error("play/stdio", error.to_string());
        let table = self.motion.table();
        let tube = self.args.tube(self.robot, table, self.clearance);
        let tracker = Tracker::new(self.motion, self.robot, self.limits, &tube, self.args.options(self.reverse));
        let (mut state, mut last, mut text) = (tracker.begin(), None, String::new());
        loop {
            text.clear();
            if input.read_line(&mut text).map_err(broken)? == 0 {
                return Ok(state.phase());
            }
            if text.trim().is_empty() {
                continue;
            }
            let answer = match step(&tracker, &state, &text, &table.joints) {
                Ok((next, command, time)) => {
                    state = next;
                    let answer = line(table, &command, time);
                    last = Some((command, time));
                    answer
                }
                Err(refused) => {
                    // What was held goes on; a simulator that counts answers gets one.
                    let mut answer = match &last {
                        Some((command, time)) => line(table, command, *time),
                        None => json!({"state": "waiting", "wheel_left_rad_s": 0.0, "wheel_right_rad_s": 0.0}),
                    };
                    answer["refused"] = refused.into();
                    answer
                }
            };
            writeln!(output, "{answer}").and_then(|()| output.flush()).map_err(broken)?;
            if matches!(state.phase(), Phase::Done | Phase::Stopped(_)) {
                return Ok(state.phase());
            }
        }
    }
}

/// A step by a line.
fn step(
    tracker: &Tracker<'_>,
    state: &State,
    text: &str,
    joints: &[(String, bool)],
) -> Result<(State, Command, f64), String> {
    let seen = poses::parse(text, joints).map_err(|error| error.to_string())?;
    let (next, command) = tracker.step(state, seen.time, Some(&seen)).map_err(|error| error.to_string())?;
    Ok((next, command, seen.time))
}

/// A command as it is written.
fn line(table: &CommandTable, command: &Command, time: f64) -> serde_json::Value {
    let Command { row, error, .. } = command;
    let joints: serde_json::Map<String, serde_json::Value> = table
        .joints
        .iter()
        .zip(row.joint_positions.iter().zip(&row.joint_velocities))
        .map(|((name, _), (position, velocity))| (name.clone(), json!({"position": position, "velocity": velocity})))
        .collect();
    let (state, reason) = words(command.phase);
    json!({
        "t": time,
        "state": state,
        "reason": reason,
        "wheel_left_rad_s": row.wheel_left,
        "wheel_right_rad_s": row.wheel_right,
        "v_mps": command.twist.0,
        "omega_rad_s": command.twist.1,
        "joints": joints,
        "path_time_s": command.path_time,
        "pace": command.pace,
        "error": {"along_m": error.along, "across_m": error.across, "heading_rad": error.heading},
    })
}

/// The state's word, and why a motion was given up.
pub(super) fn words(phase: Phase) -> (&'static str, Option<String>) {
    let why = |why: Why| match why {
        Why::Left(time) => format!("the robot left the room around its path at {time:.2} s of the file"),
        Why::Lost(time) => format!("no pose for {time:.2} s"),
        Why::Asked => "asked to stop".to_owned(),
    };
    match phase {
        Phase::Tracking => ("tracking", None),
        Phase::Waiting => ("waiting", None),
        Phase::Stopping(reason) => ("stopping", Some(why(reason))),
        Phase::Stopped(reason) => ("stopped", Some(why(reason))),
        Phase::Done => ("done", None),
    }
}

/// How it went, for people.
pub(super) fn readable(followed: &Followed) -> String {
    let (state, why) = words(followed.phase);
    let ending = match (&followed.cut, why) {
        (Some(cut), _) => format!("zero at once: {cut}"),
        (None, Some(why)) => format!("stopped: {why}"),
        (None, None) if followed.phase == Phase::Done => "followed to the end".to_owned(),
        (None, None) => state.to_owned(),
    };
    format!(
        "{ending}\n  {} commands sent in {:.1} s, {} poses used, {} refused\n  off the path's place by {:.1} mm and {:.2} degrees, as \
         estimated\n",
        followed.sent,
        followed.time,
        followed.poses.0,
        followed.poses.1,
        followed.end.0 * 1e3,
        followed.end.1.to_degrees(),
    )
}

/// The same for programs.
pub(super) fn for_programs(followed: &Followed) -> String {
    let (state, why) = words(followed.phase);
    let value = json!({
        "ending": if followed.cut.is_some() { "cut" } else { state },
        "reason": followed.cut.as_ref().map(ToString::to_string).or(why),
        "commands": followed.sent,
        "poses": {"used": followed.poses.0, "refused": followed.poses.1},
        "time_s": followed.time,
        "end": {"off_m": followed.end.0, "off_rad": followed.end.1},
    });
    format!("{value:#}\n")
}
