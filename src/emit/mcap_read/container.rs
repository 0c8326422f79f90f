//! The container: attachments, the head and raw messages by topic, from bytes that are not trusted.

use std::collections::BTreeMap;

use ::mcap::records::{Metadata, Record, op};
use ::mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};

use super::message::MessageError;
use super::{Attached, McapReadError, Topic};
use crate::emit::cdr::Reader;
use crate::emit::mcap::METADATA;
use crate::memory;

/// No record is longer than this, so that a length that lies does not take all memory.
const LONGEST_RECORD: usize = 1 << 30;

type Messages = Vec<(u64, Vec<u8>)>;

/// What of a file matters here.
#[derive(Default)]
pub struct Contents {
    /// The metadata record with the head.
    pub head: Option<BTreeMap<String, String>>,
    /// In file order.
    pub attachments: Vec<Attached>,
    /// Name and schema of each channel.
    channels: BTreeMap<u16, (String, u16)>,
    /// Names of the message types.
    schemas: BTreeMap<u16, String>,
    /// Log time and bytes of each message, in file order, by channel.
    messages: BTreeMap<u16, Messages>,
    /// Bytes of all records so far: a chunk of a few kilobytes may unpack to gigabytes.
    unpacked: u128,
}

impl Contents {
    /// Reads all records and checks every checksum.
    pub fn read(bytes: &[u8]) -> Result<Self, McapReadError> {
        if !bytes.starts_with(::mcap::MAGIC) {
            return Err(McapReadError::NotMcap);
        }
        let mut contents = Self::default();
        let options = LinearReaderOptions::default()
            .with_emit_chunks(true)
            .with_record_length_limit(longest_record())
            .with_validate_data_section_crc(true)
            .with_validate_summary_section_crc(true);
        each_record(bytes, options, &mut |opcode, body| match opcode {
            op::CHUNK => contents.chunk(body),
            _ => contents.record(opcode, body),
        })?;
        Ok(contents)
    }

    fn chunk(&mut self, body: &[u8]) -> Result<(), McapReadError> {
        if !fits(op::CHUNK, body) {
            return Err(McapReadError::Overrun);
        }
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
            .with_record_length_limit(longest_record())
            .with_prevalidate_chunk_crcs(true);
        each_record(&alone, options, &mut |opcode, body| self.record(opcode, body))
    }

    fn record(&mut self, opcode: u8, body: &[u8]) -> Result<(), McapReadError> {
        if ![op::SCHEMA, op::CHANNEL, op::MESSAGE, op::ATTACHMENT, op::METADATA].contains(&opcode) {
            return Ok(());
        }
        if !fits(opcode, body) {
            return Err(McapReadError::Overrun);
        }
        // What keeps a message or a name, beside its bytes.
        const KEPT: usize = 64;
        self.unpacked += (body.len() + KEPT) as u128;
        memory::fits(self.unpacked)?;
        match ::mcap::parse_record(opcode, body)? {
            Record::Channel(channel) => {
                self.channels.insert(channel.id, (channel.topic, channel.schema_id));
            }
            Record::Schema { header, .. } => {
                self.schemas.insert(header.id, header.name);
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

    /// Log time and bytes of a topic's messages, in file order; none where there is no such topic.
    pub fn messages(&self, topic: &str) -> &[(u64, Vec<u8>)] {
        let channel = self.channels.iter().find(|(_, (name, _))| *name == topic).map(|(id, _)| id);
        channel.and_then(|id| self.messages.get(id)).map_or(&[], Vec::as_slice)
    }

    /// The same of all channels with that topic, one after the other: a bag has one for each kind of publisher.
    pub fn all_messages<'a>(&'a self, topic: &'a str) -> impl Iterator<Item = &'a (u64, Vec<u8>)> {
        let channels = self.channels.iter().filter(move |(_, (name, _))| name == topic);
        channels.filter_map(|(id, _)| self.messages.get(id)).flatten()
    }

    /// What is in the file, in the order of its channels.
    pub fn topics(&self) -> Vec<Topic> {
        let of = |(id, (name, schema)): (&u16, &(String, u16))| Topic {
            name: name.clone(),
            kind: self.schemas.get(schema).cloned().unwrap_or_default(),
            messages: self.messages.get(id).map_or(0, Vec::len),
        };
        self.channels.iter().map(of).collect()
    }

    /// Decodes all messages of a topic.
    pub fn each<T>(
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

fn longest_record() -> usize {
    usize::try_from(memory::cap()).unwrap_or(LONGEST_RECORD).min(LONGEST_RECORD)
}

/// Takes a record's opcode and body.
type Visit<'a> = dyn FnMut(u8, &[u8]) -> Result<(), McapReadError> + 'a;

fn each_record(mut bytes: &[u8], options: LinearReaderOptions, visit: &mut Visit<'_>) -> Result<(), McapReadError> {
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

/// Whether the texts of a record lie within it. (The MCAP reader takes memory for as many bytes as a length says, and the last four
/// bytes of an attachment for granted.)
fn fits(opcode: u8, body: &[u8]) -> bool {
    let end = match opcode {
        op::SCHEMA => strings(body, 2, 3),
        op::CHANNEL => strings(body, 4, 2).and_then(|at| behind_map(body, at)),
        op::METADATA => strings(body, 0, 1).and_then(|at| behind_map(body, at)),
        // Behind three whole numbers and a checksum.
        op::CHUNK => strings(body, 28, 1),
        // Behind two times; before the length of the data, the data and a checksum.
        op::ATTACHMENT => strings(body, 16, 2).filter(|at| body.len() >= at + 8 + 4),
        _ => Some(0),
    };
    end.is_some()
}

/// Where so many strings from `at` on end; `None`: beyond the record.
fn strings(body: &[u8], at: usize, count: usize) -> Option<usize> {
    (0..count).try_fold(at, |at, _| {
        let length = u32::from_le_bytes(body.get(at..at + 4)?.try_into().ok()?) as usize;
        Some(at + 4 + length).filter(|end| *end <= body.len())
    })
}

/// Where a map of strings at `at` ends: its length in bytes, then pairs until there are as many.
fn behind_map(body: &[u8], at: usize) -> Option<usize> {
    let length = u32::from_le_bytes(body.get(at..at + 4)?.try_into().ok()?) as usize;
    let begin = at + 4;
    let mut at = begin;
    while at - begin < length {
        at = strings(body, at, 2)?;
    }
    Some(at)
}
