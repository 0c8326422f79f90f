//! Reads `commands.mcap` back: what was written by [`super::mcap::write`], or the same re-indexed or re-compressed. Every
//! checksum there is must hold, and what the topics say must agree: a robot follows one topic, the proof another.

use std::collections::BTreeMap;

use ::mcap::McapError;
use ::mcap::records::{Metadata, Record, op};
use ::mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::cdr::{CdrError, Reader};
use super::csv::{CsvHeader, FORMAT};
use super::mcap::{METADATA, topic};
use crate::command::{CommandRow, CommandTable};
use crate::diag::{Describe, Diagnostic, Diagnostics};
use crate::geom::{Pose2, unwrap_near};
use crate::report::names;

/// No record is longer than this, so that a length that lies does not take all memory.
const LONGEST_RECORD: usize = 1 << 30;
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
    #[error("this is no MCAP file")]
    NotMcap,
    /// It ends too early.
    #[error("the MCAP file is cut short")]
    CutShort,
    /// A checksum or a record is wrong.
    #[error("the MCAP file is damaged: {0}")]
    Damaged(McapError),
    /// A record whose lengths contradict each other.
    #[error("the MCAP file is damaged: a record is longer than what holds it")]
    Overrun,
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
            Self::NotMcap => Diagnostic::error("commands/not-mcap", self),
            Self::CutShort => Diagnostic::error("commands/cut-short", self).hint("copy or compile it again"),
            Self::Damaged(_) | Self::Overrun => {
                Diagnostic::error("commands/damaged", self).hint("copy or compile it again")
            }
            Self::Compression(_) => Diagnostic::error("commands/compression", self).hint("use zstd or none"),
            Self::Foreign => {
                Diagnostic::error("commands/foreign", self).hint("commands.mcap is written by `trajc compile`")
            }
            Self::Format(_) => Diagnostic::error("commands/format", self),
            Self::Head { .. } => Diagnostic::error("commands/head", self),
            Self::Count { .. } | Self::Message { .. } | Self::Content { .. } => {
                Diagnostic::error("commands/message", self)
            }
            Self::Contradiction { .. } => Diagnostic::error("commands/contradiction", self),
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
    Ok(CommandFile { table, header, attachments: contents.attachments })
}

// ---- the container

type Messages = Vec<(u64, Vec<u8>)>;

/// What of a file matters here.
#[derive(Default)]
struct Contents {
    head: Option<BTreeMap<String, String>>,
    attachments: Vec<Attached>,
    topics: BTreeMap<u16, String>,
    /// Log time and bytes of each message, in file order, by channel.
    messages: BTreeMap<u16, Messages>,
}

impl Contents {
    fn read(bytes: &[u8]) -> Result<Self, McapReadError> {
        if !bytes.starts_with(::mcap::MAGIC) {
            return Err(McapReadError::NotMcap);
        }
        let mut contents = Self::default();
        let options = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_record_length_limit(LONGEST_RECORD)
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true);
        each_record(bytes, options, &mut |opcode, body| match opcode {
            op::CHUNK => contents.chunk(body),
            _ => contents.record(opcode, body),
        })?;
        Ok(contents)
    }

    fn chunk(&mut self, body: &[u8]) -> Result<(), McapReadError> {
        let Record::Chunk { header, data } = ::mcap::parse_record(op::CHUNK, body)? else { return Ok(()) };
        if header.compression.is_empty() {
            check_lengths(&data)?;
        }
        // A file of nothing but this chunk.
        let mut alone = vec![op::CHUNK];
        alone.extend((body.len() as u64).to_le_bytes());
        alone.extend(body);
        let options = LinearReaderOptions::default()
            .with_skip_start_magic(true)
            .with_skip_end_magic(true)
            .with_record_length_limit(LONGEST_RECORD)
            .with_prevalidate_chunk_crcs(true);
        each_record(&alone, options, &mut |opcode, body| self.record(opcode, body))
    }

    fn record(&mut self, opcode: u8, body: &[u8]) -> Result<(), McapReadError> {
        if opcode == op::ATTACHMENT && !attachment_fits(body) {
            return Err(McapReadError::Overrun);
        }
        match ::mcap::parse_record(opcode, body)? {
            Record::Channel(channel) => {
                self.topics.insert(channel.id, channel.topic);
            }
            Record::Message { header, data } => {
                self.messages.entry(header.channel_id).or_default().push((header.log_time, data.into_owned()));
            }
            Record::Attachment { header, data, .. } => self.attachments.push(Attached {
                name: header.name,
                media_type: header.media_type,
                bytes: data.into_owned(),
            }),
            Record::Metadata(Metadata { name, metadata }) if name == METADATA => self.head = Some(metadata),
            _ => {}
        }
        Ok(())
    }

    fn messages(&self, topic: &str) -> &[(u64, Vec<u8>)] {
        let channel = self.topics.iter().find(|(_, name)| *name == topic).map(|(id, _)| id);
        channel.and_then(|id| self.messages.get(id)).map_or(&[], Vec::as_slice)
    }

    /// Decodes all messages of a topic.
    fn each<T>(
        &self,
        topic: &'static str,
        wanted: usize,
        decode: impl Fn(&mut Reader<'_>) -> Result<T, MessageError>,
    ) -> Result<Vec<T>, McapReadError> {
        let messages = self.messages(topic);
        if messages.len() != wanted {
            return Err(McapReadError::Count { topic, found: messages.len(), wanted });
        }
        let decode_one = |bytes: &[u8]| -> Result<T, MessageError> {
            let mut reader = Reader::new(bytes)?;
            let value = decode(&mut reader)?;
            reader.finish()?;
            Ok(value)
        };
        let placed = |row: usize, error| match error {
            MessageError::Cdr(error) => McapReadError::Message { topic, row, error },
            MessageError::Content(what) => McapReadError::Content { topic, row, what },
        };
        messages.iter().enumerate().map(|(row, (_, bytes))| decode_one(bytes).map_err(|e| placed(row, e))).collect()
    }
}

fn each_record(
    mut bytes: &[u8],
    options: LinearReaderOptions,
    visit: &mut dyn FnMut(u8, &[u8]) -> Result<(), McapReadError>,
) -> Result<(), McapReadError> {
    let mut reader = LinearReader::new_with_options(options);
    while let Some(event) = reader.next_event() {
        match event? {
            LinearReadEvent::ReadRequest(_) => {
                // All at once: it is in memory anyway, and a request is not to be trusted.
                reader.insert(bytes.len()).copy_from_slice(bytes);
                reader.notify_read(bytes.len());
                bytes = &[];
            }
            LinearReadEvent::Record { data, opcode } => visit(opcode, data)?,
        }
    }
    Ok(())
}

/// The records of an uncompressed chunk fill it exactly. (The MCAP reader takes that for granted.)
fn check_lengths(mut chunk: &[u8]) -> Result<(), McapReadError> {
    while !chunk.is_empty() {
        let length = chunk.get(1..9).and_then(|b| b.try_into().ok()).map(u64::from_le_bytes);
        let end = length.and_then(|l| usize::try_from(l).ok()).and_then(|l| l.checked_add(9));
        chunk = end.and_then(|end| chunk.get(end..)).ok_or(McapReadError::Overrun)?;
    }
    Ok(())
}

/// Whether the parts of an attachment record lie within it. (The MCAP reader takes its last four bytes for granted.)
fn attachment_fits(body: &[u8]) -> bool {
    let skip = |body: &mut &[u8], count: usize| match body.split_at_checked(count) {
        Some((taken, rest)) => {
            *body = rest;
            Some(taken.to_vec())
        }
        None => None,
    };
    let mut rest = body;
    let mut string = |rest: &mut &[u8]| {
        let length = skip(rest, 4)?;
        skip(rest, u32::from_le_bytes(length.try_into().ok()?) as usize)
    };
    // Log time, create time; name, media type; length of the data; checksum.
    skip(&mut rest, 16).is_some()
        && string(&mut rest).is_some()
        && string(&mut rest).is_some()
        && skip(&mut rest, 8).is_some()
        && rest.len() >= 4
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
            wheel_radius: self.positive("wheel_radius_m")?,
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

// ---- the messages

/// Why a message is not what it must be.
enum MessageError {
    Cdr(CdrError),
    Content(&'static str),
}

impl From<CdrError> for MessageError {
    fn from(error: CdrError) -> Self {
        Self::Cdr(error)
    }
}

struct JointState {
    names: Vec<String>,
    positions: Vec<f64>,
    velocities: Vec<f64>,
}

/// Skips a `std_msgs/Header`.
fn skip_header(r: &mut Reader<'_>) -> Result<(), CdrError> {
    r.i32()?;
    r.u32()?;
    r.string().map(|_| ())
}

fn finite<const N: usize>(r: &mut Reader<'_>) -> Result<[f64; N], MessageError> {
    let mut values = [0.0; N];
    for value in &mut values {
        *value = r.f64()?;
    }
    all_finite(&values)?;
    Ok(values)
}

fn all_finite(values: &[f64]) -> Result<(), MessageError> {
    if values.iter().all(|v| v.is_finite()) { Ok(()) } else { Err(MessageError::Content("a number is not finite")) }
}

fn joint_names(r: &mut Reader<'_>) -> Result<Vec<String>, CdrError> {
    r.sequence(|r| r.string().map(str::to_string))
}

fn wheel_speeds(r: &mut Reader<'_>) -> Result<[f64; 2], MessageError> {
    let dimensions = r.u32()?;
    let offset = r.u32()?;
    if dimensions != 0 || offset != 0 {
        return Err(MessageError::Content("the layout is not empty"));
    }
    let data = r.f64s()?;
    all_finite(&data)?;
    data.try_into().map_err(|_| MessageError::Content("must have two wheel speeds: left, right"))
}

fn joint_state(r: &mut Reader<'_>) -> Result<JointState, MessageError> {
    skip_header(r)?;
    let state = JointState { names: joint_names(r)?, positions: r.f64s()?, velocities: r.f64s()? };
    r.f64s()?;
    all_finite(&state.positions)?;
    all_finite(&state.velocities)?;
    if state.positions.len() != state.names.len() || state.velocities.len() != state.names.len() {
        return Err(MessageError::Content("names, positions and velocities differ in number"));
    }
    Ok(state)
}

/// x, y and heading of the first transform.
fn pose(r: &mut Reader<'_>) -> Result<[f64; 3], MessageError> {
    let transforms = r.sequence(|r| {
        skip_header(r)?;
        r.string()?;
        let mut values = [0.0; 7];
        for value in &mut values {
            *value = r.f64()?;
        }
        Ok(values)
    })?;
    let [x, y, _, i, j, k, w] = *transforms.first().ok_or(MessageError::Content("no transform"))?;
    all_finite(&[x, y, i, j, k, w])?;
    if i.hypot(j) > AGREE || (k.hypot(w) - 1.0).abs() > AGREE {
        return Err(MessageError::Content("the rotation is no unit quaternion about z"));
    }
    Ok([x, y, 2.0 * k.atan2(w)])
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
    let twists = contents.each(topic::TWIST, table.rows.len(), |r| {
        skip_header(r)?;
        finite::<6>(r)
    })?;
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
