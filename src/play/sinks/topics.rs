//! The topics of `commands.mcap`, live: what is common to ROS 2 (DDS or Zenoh) and Foxglove.
//!
//! Commands carry stamp 0, which controllers take as «now»; states carry the time of day. The joint trajectory goes out once, and once
//! more at the beginning of a stop: its controller plays by itself, and the new one replaces the old.

use crate::command::{CommandRow, CommandTable};
use crate::emit::mcap::{self, Frames, topic};
use crate::emit::ros::{self, MessageType, Offer};
use crate::play::clock::wall_time;
use crate::play::sink::{Command, Sink, SinkError, Upcoming};
use crate::robot::RobotModel;

/// Rows held for longer are sent again in between, s: a controller that hears nothing for half a second stops.
const SLOW: f64 = 0.25;
/// How often, s.
const REPEAT: f64 = 0.1;

/// What a topic carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Content {
    /// The URDF.
    Description,
    /// The planned poses.
    Plan,
    /// The joints' positions over time.
    Trajectory,
    /// Speed and turn rate.
    Twist,
    /// Of the wheels.
    WheelSpeeds,
    /// The planned joint states.
    JointStates,
    /// The planned pose.
    Transforms,
}

/// A topic.
pub struct Topic {
    /// What it carries.
    pub content: Content,
    /// Its name, remapped.
    pub name: String,
    /// Its type.
    message: &'static MessageType,
    /// How it is offered.
    offer: Offer,
}

impl Topic {
    /// `geometry_msgs` and `TwistStamped`, for example.
    pub fn package_and_type(&self) -> (&'static str, &'static str) {
        self.message.package_and_type()
    }

    /// `geometry_msgs/msg/TwistStamped`, for example.
    pub fn type_name(&self) -> &'static str {
        self.message.name
    }

    /// `RIHS01_…`.
    pub fn type_hash(&self) -> String {
        self.message.type_hash()
    }

    /// The type's definition and all that it uses.
    pub fn definition(&self) -> String {
        self.message.definition()
    }

    /// Whether who comes later gets the last message too.
    pub fn latched(&self) -> bool {
        matches!(self.offer, Offer::Latched)
    }

    /// Messages kept for a slow subscriber.
    pub fn depth(&self) -> u32 {
        match self.offer {
            Offer::Latched => 1,
            Offer::Volatile { depth } => depth,
        }
    }
}

/// Which topics there are, and under which names.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Names {
    /// Names as in the file; empty: all.
    pub only: Vec<String>,
    /// From, to.
    pub remapped: Vec<(String, String)>,
}

/// The topics of a table. Without joints there is no joint trajectory.
///
/// # Errors
/// A name in `names` that is no topic, or none left.
pub fn topics(table: &CommandTable, names: &Names) -> Result<Vec<Topic>, String> {
    let volatile = Offer::Volatile { depth: 10 };
    let all: [(Content, &str, &'static MessageType, Offer); 7] = [
        (Content::Description, topic::DESCRIPTION, &ros::STRING, Offer::Latched),
        (Content::Plan, topic::PLAN, &ros::PATH, Offer::Latched),
        (Content::Trajectory, topic::TRAJECTORY, &ros::JOINT_TRAJECTORY, volatile),
        (Content::Twist, topic::TWIST, &ros::TWIST_STAMPED, volatile),
        (Content::WheelSpeeds, topic::WHEELS, &ros::FLOAT64_MULTI_ARRAY, volatile),
        (Content::JointStates, topic::JOINTS, &ros::JOINT_STATE, volatile),
        (Content::Transforms, topic::TRANSFORMS, &ros::TF_MESSAGE, Offer::Volatile { depth: 100 }),
    ];
    let asked = names.only.iter().chain(names.remapped.iter().map(|(from, _)| from));
    if let Some(unknown) = asked.into_iter().find(|name| all.iter().all(|(_, known, ..)| known != name)) {
        let known: Vec<&str> = all.iter().map(|(_, name, ..)| *name).collect();
        return Err(format!("no topic `{unknown}`; there are {}", known.join(", ")));
    }
    if let Some((_, to)) = names.remapped.iter().find(|(_, to)| !to.starts_with('/') || to.ends_with('/')) {
        return Err(format!("`{to}` is no topic's full name, such as /diff_drive_controller/cmd_vel"));
    }
    let found: Vec<Topic> = all
        .into_iter()
        .filter(|(_, name, ..)| names.only.is_empty() || names.only.iter().any(|only| only == name))
        .filter(|(content, ..)| *content != Content::Trajectory || !table.joints.is_empty())
        .map(|(content, name, message, offer)| {
            let remapped = names.remapped.iter().find(|(from, _)| from == name);
            Topic { content, name: remapped.map_or(name, |(_, to)| to).to_owned(), message, offer }
        })
        .collect();
    if found.is_empty() { Err("no topic is left to play".to_owned()) } else { Ok(found) }
}

/// Carries messages to whoever listens. Topics are named by their index.
pub trait Transport {
    /// Waits until somebody listens to the first topic that carries commands. Gives up when `interrupted`.
    ///
    /// # Errors
    /// Nobody came.
    fn ready(&mut self, interrupted: &dyn Fn() -> bool) -> Result<(), SinkError>;

    /// Sends a message, CDR with its head.
    ///
    /// # Errors
    /// It cannot be sent.
    fn publish(&mut self, topic: usize, message: &[u8], stamp: u64) -> Result<(), SinkError>;

    /// Latched topics whose last message somebody who came late still needs.
    fn asked_again(&mut self) -> Vec<usize> {
        Vec::new()
    }

    /// Whether anybody listens still.
    ///
    /// # Errors
    /// Nobody does.
    fn alive(&mut self) -> Result<(), SinkError>;

    /// Sees to it that all is out.
    fn finish(&mut self) {}
}

impl Transport for Box<dyn Transport> {
    fn ready(&mut self, interrupted: &dyn Fn() -> bool) -> Result<(), SinkError> {
        self.as_mut().ready(interrupted)
    }

    fn publish(&mut self, topic: usize, message: &[u8], stamp: u64) -> Result<(), SinkError> {
        self.as_mut().publish(topic, message, stamp)
    }

    fn asked_again(&mut self) -> Vec<usize> {
        self.as_mut().asked_again()
    }

    fn alive(&mut self) -> Result<(), SinkError> {
        self.as_mut().alive()
    }

    fn finish(&mut self) {
        self.as_mut().finish();
    }
}

/// The index of the topic whose subscriber playback waits for: that of the twists, else of the wheels, else the first.
pub fn awaited(topics: &[Topic]) -> usize {
    let find = |content| topics.iter().position(|topic| topic.content == content);
    find(Content::Twist).or_else(|| find(Content::WheelSpeeds)).unwrap_or(0)
}

/// Plays on topics.
pub struct TopicSink<T: Transport> {
    transport: T,
    /// What each topic carries.
    contents: Vec<Content>,
    frames: Frames,
    urdf: String,
    /// Name of the frame that twists are in; joints' names.
    table: CommandTable,
    /// Last messages of latched topics.
    latched: Vec<Option<Vec<u8>>>,
    /// The last command, and when it was sent.
    last: Option<(CommandRow, (f64, f64), f64)>,
    begun: bool,
}

impl<T: Transport> TopicSink<T> {
    /// A sink whose topics are those that `transport` was made for, in that order.
    pub fn new(transport: T, topics: &[Topic], robot: &RobotModel, urdf: &str, table: &CommandTable) -> Self {
        Self {
            transport,
            contents: topics.iter().map(|topic| topic.content).collect(),
            frames: Frames::new(robot, urdf),
            urdf: urdf.to_owned(),
            table: CommandTable { rows: Vec::new(), ..table.clone() },
            latched: vec![None; topics.len()],
            last: None,
            begun: false,
        }
    }

    fn publish(
        &mut self,
        content: Content,
        stamp: u64,
        message: impl FnOnce(&Self) -> Vec<u8>,
    ) -> Result<(), SinkError> {
        let Some(index) = self.contents.iter().position(|c| *c == content) else { return Ok(()) };
        let message = message(self);
        self.transport.publish(index, &message, stamp)?;
        if matches!(content, Content::Description | Content::Plan) {
            self.latched[index] = Some(message);
        }
        Ok(())
    }

    fn speeds(&mut self, row: &CommandRow, twist: (f64, f64), stamp: u64) -> Result<(), SinkError> {
        self.publish(Content::Twist, stamp, |s| mcap::twist(twist, &s.frames.base))?;
        self.publish(Content::WheelSpeeds, stamp, |_| mcap::wheel_speeds(row))
    }
}

impl<T: Transport> Sink for TopicSink<T> {
    fn ready(&mut self, interrupted: &dyn Fn() -> bool) -> Result<(), SinkError> {
        self.transport.ready(interrupted)
    }

    fn announce(&mut self, plan: &CommandTable) -> Result<(), SinkError> {
        let now = wall_time();
        let stamps: Vec<u64> = (0..plan.rows.len()).map(|k| now + (plan.time(k) * 1e9).round() as u64).collect();
        if !self.begun {
            self.begun = true;
            self.publish(Content::Description, now, |s| mcap::description(&s.urdf))?;
            self.publish(Content::Plan, now, |_| mcap::plan(plan, &stamps))?;
        }
        self.publish(Content::Trajectory, now, |_| mcap::trajectory(plan, &stamps))
    }

    fn send(&mut self, command: &Command<'_>, at: f64) -> Result<(), SinkError> {
        let stamp = wall_time();
        self.speeds(command.row, command.twist, stamp)?;
        self.publish(Content::JointStates, stamp, |s| mcap::joint_state(&s.table, command.row, stamp))?;
        self.publish(Content::Transforms, stamp, |s| s.frames.transforms(command.row.pose, stamp))?;
        self.last = Some((command.row.clone(), command.twist, at));
        for topic in self.transport.asked_again() {
            if let Some(message) = self.latched[topic].clone() {
                self.transport.publish(topic, &message, stamp)?;
            }
        }
        self.transport.alive()
    }

    fn frame_time(&self) -> Option<f64> {
        (self.table.sampling_time > SLOW).then_some(REPEAT)
    }

    fn frame(&mut self, at: f64, _upcoming: Option<Upcoming>) -> Result<(), SinkError> {
        let Some((row, twist, sent)) = self.last.clone() else { return Ok(()) };
        if at - sent < 0.5 * REPEAT {
            return Ok(());
        }
        self.speeds(&row, twist, wall_time())
    }

    fn finish(&mut self) -> Result<(), SinkError> {
        self.transport.finish();
        Ok(())
    }
}

#[cfg(test)]
mod tests;
