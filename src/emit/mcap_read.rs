//! Reads `commands.mcap` back: what was written by [`super::mcap::write`], or the same re-indexed or re-compressed. Every
//! checksum there is must hold, and what the topics say must agree: a robot follows one topic, the proof another.

mod container;
mod message;

use std::collections::BTreeMap;

use ::mcap::McapError;

use super::cdr::CdrError;
use super::csv::{CsvHeader, FORMAT};
use super::mcap::{METADATA, topic};
use crate::command::{CommandRow, CommandTable};
use crate::diag::{Describe, Diagnostic, Diagnostics};
use crate::geom::{Pose2, unwrap_near};
use crate::memory;
use crate::report::names;
use crate::robot::{LARGEST_DIFFERENCE, WheelRadii};
use container::Contents;
use message::{MessageError, joint_names, joint_state, pose, skip_header, twist, wheel_speeds};

/// Values that two topics both carry may differ by this, relative to the larger of one of them and 1: rounding only.
const AGREE: f64 = 1e-9;
/// Stamps may be off the schedule by this, ns.
const STAMP: u64 = 1;

/// A command file read from MCAP.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandFile {
    /// The commands. Equal to those of `commands.csv` but for rounding (1e-12) of the headings.
    pub table: CommandTable,
    /// As in `commands.csv`.
    pub header: CsvHeader,
    /// In the file's order.
    pub attachments: Vec<Attached>,
    /// In the order of their channels.
    pub topics: Vec<Topic>,
}

/// A topic and how much of it there is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topic {
    /// Its name.
    pub name: String,
    /// The type of its messages: `package/msg/Type`.
    pub kind: String,
    /// How many there are.
    pub messages: usize,
}

/// A file attached to an MCAP file; for the names see [`super::mcap::attached`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Attached {
    /// Its name.
    pub name: String,
    /// Its media type.
    pub media_type: String,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

impl CommandFile {
    /// The bytes of an attachment.
    pub fn attachment(&self, name: &str) -> Option<&[u8]> {
        self.attachments.iter().find(|a| a.name == name).map(|a| a.bytes.as_slice())
    }
}

/// Why bytes are no command file.
#[derive(Debug, thiserror::Error)]
pub enum McapReadError {
    /// Other bytes.
    #[error("this is no MCAP file: it does not begin with `\\x89MCAP0`")]
    NotMcap,
    /// It ends too early.
    #[error("the MCAP file is cut short: it does not end as MCAP files end")]
    CutShort,
    /// A checksum or a record is wrong.
    #[error("the MCAP file is damaged: {0}")]
    Damaged(McapError),
    /// A record whose lengths contradict each other.
    #[error("the MCAP file is damaged: a record is longer than what holds it")]
    Overrun,
    /// It holds more than its length says.
    #[error("what the MCAP file holds would take {0}")]
    Memory(#[from] memory::TooMuch),
    /// Compressed in another way.
    #[error("chunk compression `{0}` is not read here")]
    Compression(String),
    /// An MCAP file of something else.
    #[error("this MCAP file is no command file: it has no metadata record `{METADATA}`")]
    Foreign,
    /// Of another format.
    #[error("format is `{0}`, this program reads `{FORMAT}`")]
    Format(String),
    /// A key of the head is missing or has no meaning.
    #[error("metadata `{METADATA}`: `{key}` is `{}`", value.as_deref().unwrap_or("missing"))]
    Head {
        /// Which key.
        key: String,
        /// Its value, if there is one.
        value: Option<String>,
    },
    /// Messages missing or too many.
    #[error("{topic} has {found} messages, must have {wanted}")]
    Count {
        /// Which topic.
        topic: &'static str,
        /// Messages that it has.
        found: usize,
        /// Messages that it must have.
        wanted: usize,
    },
    /// A message that is not of the topic's type.
    #[error("{topic}, message {row}: {error}")]
    Message {
        /// Which topic.
        topic: &'static str,
        /// Which message, from 0.
        row: usize,
        /// What is wrong.
        error: CdrError,
    },
    /// A message that does not have what a command file has there.
    #[error("{topic}, message {row}: {what}")]
    Content {
        /// Which topic.
        topic: &'static str,
        /// Which message, from 0.
        row: usize,
        /// What is wrong.
        what: &'static str,
    },
    /// Two places say different things.
    #[error("{topic}, message {row}: {quantity} is {said}, but must be {wanted}")]
    Contradiction {
        /// Which topic.
        topic: &'static str,
        /// Which message, from 0.
        row: usize,
        /// Of what.
        quantity: &'static str,
        /// As this topic has it.
        said: f64,
        /// As the rest of the file has it.
        wanted: f64,
    },
}

impl Describe for McapReadError {
    fn diagnostic(&self) -> Diagnostic {
        match self {
            Self::NotMcap => {
                Diagnostic::error("commands/not-mcap", self).hint("commands.mcap is written by `trajc compile`")
            }
            Self::CutShort => Diagnostic::error("commands/cut-short", self).hint("copy or compile it again"),
            Self::Damaged(_) | Self::Overrun => {
                Diagnostic::error("commands/damaged", self).hint("copy or compile it again")
            }
            Self::Memory(_) => Diagnostic::error("commands/too-large", self).hint(memory::HINT),
            Self::Compression(_) => Diagnostic::error("commands/compression", self).hint("use zstd or none"),
            Self::Foreign => {
                Diagnostic::error("commands/foreign", self).hint("commands.mcap is written by `trajc compile`")
            }
            Self::Format(_) => {
                Diagnostic::error("commands/format", self).hint("compile it again with this version of trajc")
            }
            Self::Head { .. } => Diagnostic::error("commands/head", self).hint("compile it again"),
            Self::Count { .. } | Self::Message { .. } | Self::Content { .. } => {
                Diagnostic::error("commands/message", self)
                    .hint("the file was changed after it was written: compile it again")
            }
            Self::Contradiction { .. } => Diagnostic::error("commands/contradiction", self)
                .hint("topics of one file must say the same: compile it again"),
        }
    }
}

impl From<McapError> for McapReadError {
    fn from(error: McapError) -> Self {
        match error {
            McapError::BadMagic => Self::NotMcap,
            McapError::UnexpectedEof => Self::CutShort,
            McapError::UnsupportedCompression(name) => Self::Compression(name),
            other => Self::Damaged(other),
        }
    }
}

/// An MCAP file of any content, such as a ROS 2 bag.
pub struct Recording(Contents);

impl Recording {
    /// Reads all records and checks every checksum.
    ///
    /// # Errors
    /// No MCAP, cut short, damaged, or larger than memory.
    pub fn read(bytes: &[u8]) -> Result<Self, McapReadError> {
        Contents::read(bytes).map(Self)
    }

    /// What is in it, in the order of its channels.
    pub fn topics(&self) -> Vec<Topic> {
        self.0.topics()
    }

    /// Log time (ns) and bytes of a topic's messages, in file order; of each of its channels if there are several.
    pub fn messages<'a>(&'a self, topic: &'a str) -> impl Iterator<Item = (u64, &'a [u8])> {
        self.0.all_messages(topic).map(|(stamp, bytes)| (*stamp, bytes.as_slice()))
    }
}

/// Reads a command file. `name` is its path as the user knows it.
///
/// # Errors
/// The first fault found; see [`McapReadError`].
pub fn read(name: &str, bytes: &[u8]) -> Result<CommandFile, Diagnostics> {
    parse(bytes).map_err(|error| error.diagnostic().file(name).into())
}

fn parse(bytes: &[u8]) -> Result<CommandFile, McapReadError> {
    let contents = Contents::read(bytes)?;
    let head = contents.head.as_ref().ok_or(McapReadError::Foreign)?;
    let head = Head { values: head };
    match head.text("format")? {
        FORMAT => {}
        other => return Err(McapReadError::Format(other.to_string())),
    }
    let header = CsvHeader {
        mission: head.text("mission")?.to_string(),
        robot: head.text("robot")?.to_string(),
        map: head.values.get("map").cloned(),
        inputs_blake3: head.text("inputs_blake3")?.to_string(),
    };
    let mut table = head.empty_table()?;
    let rows = contents.messages(topic::TWIST).len();
    if rows == 0 {
        return Err(McapReadError::Count { topic: topic::TWIST, found: 0, wanted: 1 });
    }
    let wheels = contents.each(topic::WHEELS, rows, wheel_speeds)?;
    let states = contents.each(topic::JOINTS, rows, joint_state)?;
    let poses = contents.each(topic::TRANSFORMS, rows, pose)?;
    for (k, [wheel_left, wheel_right]) in wheels.into_iter().enumerate() {
        let state = &states[k];
        head.joints(&state.names, k, &mut table)?;
        let [x, y, yaw] = poses[k];
        // Whole turns: those of the row before and what this row's turn rate adds; for the first row the head's.
        let near = match table.rows.last() {
            Some(before) => before.pose.yaw + table.twist(k - 1).1 * table.sampling_time,
            None => head.number("start_yaw_rad")?,
        };
        table.rows.push(CommandRow {
            wheel_left,
            wheel_right,
            joint_positions: state.positions.clone(),
            joint_velocities: state.velocities.clone(),
            pose: Pose2::new(x, y, unwrap_near(yaw, near)),
        });
    }
    check_schedule(&contents, &table)?;
    check_twists(&contents, &table)?;
    check_trajectory(&contents, &table)?;
    let topics = contents.topics();
    Ok(CommandFile { table, header, attachments: contents.attachments, topics })
}

// ---- the head

struct Head<'a> {
    values: &'a BTreeMap<String, String>,
}

impl Head<'_> {
    fn fault(&self, key: &str) -> McapReadError {
        McapReadError::Head { key: key.to_string(), value: self.values.get(key).cloned() }
    }

    fn text(&self, key: &str) -> Result<&str, McapReadError> {
        self.values.get(key).map(String::as_str).ok_or_else(|| self.fault(key))
    }

    fn number(&self, key: &str) -> Result<f64, McapReadError> {
        self.text(key)?.parse::<f64>().ok().filter(|v| v.is_finite()).ok_or_else(|| self.fault(key))
    }

    fn positive(&self, key: &str) -> Result<f64, McapReadError> {
        Some(self.number(key)?).filter(|v| *v > 0.0).ok_or_else(|| self.fault(key))
    }

    fn empty_table(&self) -> Result<CommandTable, McapReadError> {
        Ok(CommandTable {
            sampling_time: self.positive("sampling_time_s")?,
            sampling: names::parse_sampling(self.text("sampling")?).ok_or_else(|| self.fault("sampling"))?,
            wheel_radii: WheelRadii {
                mean: self.positive("wheel_radius_m")?,
                difference: if self.values.contains_key("wheel_difference") {
                    let share = Some(self.number("wheel_difference")?);
                    share.filter(|s| s.abs() <= LARGEST_DIFFERENCE).ok_or_else(|| self.fault("wheel_difference"))?
                } else {
                    0.0
                },
            },
            track_width: self.positive("track_width_m")?,
            joints: Vec::new(),
            rows: Vec::new(),
        })
    }

    /// The joints of row `k`: those of the first row, with the unit that the head gives them.
    fn joints(&self, names: &[String], k: usize, table: &mut CommandTable) -> Result<(), McapReadError> {
        if k == 0 {
            for name in names {
                let key = format!("joint.{name}");
                let prismatic = match self.text(&key)? {
                    "rad" => false,
                    "m" => true,
                    _ => return Err(self.fault(&key)),
                };
                table.joints.push((name.clone(), prismatic));
            }
        } else if !names.iter().eq(table.joints.iter().map(|(name, _)| name)) {
            let what = "other joints than in the first message";
            return Err(McapReadError::Content { topic: topic::JOINTS, row: k, what });
        }
        Ok(())
    }
}

// ---- what must agree

fn agree(topic: &'static str, row: usize, quantity: &'static str, said: f64, wanted: f64) -> Result<(), McapReadError> {
    if (said - wanted).abs() <= AGREE * wanted.abs().max(1.0) {
        return Ok(());
    }
    Err(McapReadError::Contradiction { topic, row, quantity, said, wanted })
}

/// Row k of every topic comes k sampling times after the first.
fn check_schedule(contents: &Contents, table: &CommandTable) -> Result<(), McapReadError> {
    let start = contents.messages(topic::TWIST)[0].0;
    for topic in [topic::TWIST, topic::WHEELS, topic::JOINTS, topic::TRANSFORMS] {
        for (row, (stamp, _)) in contents.messages(topic).iter().enumerate() {
            let wanted = start.saturating_add((table.time(row) * 1e9).round() as u64);
            if stamp.abs_diff(wanted) > STAMP {
                let (said, wanted) = (*stamp as f64 * 1e-9, wanted as f64 * 1e-9);
                return Err(McapReadError::Contradiction { topic, row, quantity: "log time (s)", said, wanted });
            }
        }
    }
    Ok(())
}

/// `/cmd_vel` asks for what the wheels do.
fn check_twists(contents: &Contents, table: &CommandTable) -> Result<(), McapReadError> {
    let twists = contents.each(topic::TWIST, table.rows.len(), twist)?;
    for (row, [v, y, z, roll, pitch, omega]) in twists.into_iter().enumerate() {
        let (held_v, held_omega) = table.twist(row);
        agree(topic::TWIST, row, "the speed (m/s)", v, held_v)?;
        agree(topic::TWIST, row, "the turn rate (rad/s)", omega, held_omega)?;
        for other in [y, z, roll, pitch] {
            agree(topic::TWIST, row, "what no differential drive can do", other, 0.0)?;
        }
    }
    Ok(())
}

/// The joint trajectory has the positions of the joint states, and nothing that would bend the line between them.
fn check_trajectory(contents: &Contents, table: &CommandTable) -> Result<(), McapReadError> {
    const TOPIC: &str = topic::TRAJECTORY;
    let wanted = usize::from(!table.joints.is_empty());
    let trajectories = contents.each(TOPIC, wanted, |r| {
        skip_header(r)?;
        let names = joint_names(r)?;
        let points = r.sequence(|r| {
            let (positions, others) = (r.f64s()?, [r.f64s()?, r.f64s()?, r.f64s()?]);
            let time = f64::from(r.i32()?) + 1e-9 * f64::from(r.u32()?);
            Ok((positions, others, time))
        })?;
        if points.iter().any(|(_, others, _)| others.iter().any(|o| !o.is_empty())) {
            return Err(MessageError::Content(
                "has more than positions: controllers would not go straight from point to point",
            ));
        }
        Ok((names, points))
    })?;
    let fault = |what| Err(McapReadError::Content { topic: TOPIC, row: 0, what });
    for (names, points) in trajectories {
        if !names.iter().eq(table.joints.iter().map(|(name, _)| name)) {
            return fault("other joints than in the joint states");
        }
        if points.len() != table.rows.len() || points.iter().any(|(p, ..)| p.len() != names.len()) {
            return fault("must have one position per joint and row");
        }
        for (row, (positions, _, time)) in points.into_iter().enumerate() {
            agree(TOPIC, 0, "a point's time (s)", time, table.time(row))?;
            for (said, wanted) in positions.into_iter().zip(&table.rows[row].joint_positions) {
                agree(TOPIC, 0, "a point's position", said, *wanted)?;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
