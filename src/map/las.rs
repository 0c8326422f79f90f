//! LAS 1.0 to 1.4, point formats 0 to 10; compressed (LAZ) with the feature `laz`.
//!
//! An own reader: of a record only three integers at its beginning are wanted, and they can be read where they lie in the file. The
//! crate `las` makes a structure of every point, and brings dates, UUIDs and logging; `laz` alone unpacks.

use std::borrow::Cow;

use super::error::MapError;
use super::points::Points;

/// Least bytes of a record of each point format.
const RECORDS: [usize; 11] = [20, 28, 26, 34, 57, 63, 30, 36, 38, 59, 67];
/// Bytes of the oldest header.
const HEADER: usize = 227;
/// Where the 64-bit number of points is since 1.4.
const COUNT: usize = 247;

/// What the header says of the points, checked against the file.
struct Header {
    /// Where the records begin.
    start: usize,
    /// Bytes of a record.
    record: usize,
    points: u64,
    packed: bool,
    scale: [f64; 3],
    offset: [f64; 3],
}

/// Reads a LAS or LAZ file.
pub(super) fn read(bytes: &[u8]) -> Result<Points<'_>, MapError> {
    let header = header(bytes)?;
    let (scale, offset) = (header.scale, header.offset);
    if header.packed {
        let (records, count) = unpack(bytes, &header)?;
        return Ok(Points::Scaled { records: Cow::Owned(records), stride: 12, count, scale, offset });
    }
    let data = &bytes[header.start..];
    let promised = u128::from(header.points);
    let (promised_bytes, have_bytes) = (promised * header.record as u128, data.len() as u128);
    if have_bytes < promised_bytes {
        return Err(MapError::Truncated { unit: "points", promised, promised_bytes, have_bytes });
    }
    // What follows may be records of another kind (since 1.3).
    let records = Cow::Borrowed(&data[..promised_bytes as usize]);
    Ok(Points::Scaled { records, stride: header.record, count: header.points as usize, scale, offset })
}

fn header(bytes: &[u8]) -> Result<Header, MapError> {
    if !bytes.starts_with(b"LASF") {
        return Err(MapError::NotThisFormat { format: "LAS", begin: "`LASF`" });
    }
    if bytes.len() < HEADER {
        let promised = HEADER as u128;
        let have_bytes = bytes.len() as u128;
        return Err(MapError::Truncated { unit: "header bytes", promised, promised_bytes: promised, have_bytes });
    }
    let wrong = |at, what, found: String, expected: String| MapError::LasHeader { at, what, found, expected };
    let u16_at = |at: usize| u16::from_le_bytes([bytes[at], bytes[at + 1]]);
    let u32_at = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
    let f64_at = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes"));
    let (major, minor) = (bytes[24], bytes[25]);
    if major != 1 || minor > 4 {
        return Err(wrong(24, "the version", format!("{major}.{minor}"), "1.0 to 1.4".into()));
    }
    let (size, start) = (u16_at(94) as usize, u32_at(96) as usize);
    let least = if minor >= 4 { COUNT + 8 } else { HEADER };
    if size < least || size > bytes.len() {
        return Err(wrong(94, "the header's size", size.to_string(), format!("{least} to {}", bytes.len())));
    }
    if start < size || start > bytes.len() {
        return Err(wrong(96, "the first point's place", start.to_string(), format!("{size} to {}", bytes.len())));
    }
    // Compressed files set one of the two highest bits.
    let (format, packed) = ((bytes[104] & 0x3f) as usize, bytes[104] & 0xc0 != 0);
    let Some(least) = RECORDS.get(format) else {
        return Err(wrong(104, "the point format", format.to_string(), "0 to 10".into()));
    };
    let record = u16_at(105) as usize;
    if record < *least {
        let expected = format!("at least {least} in point format {format}");
        return Err(wrong(105, "a point's number of bytes", record.to_string(), expected));
    }
    let points = match u64::from(u32_at(107)) {
        old if minor >= 4 => {
            let new = u64::from_le_bytes(bytes[COUNT..COUNT + 8].try_into().expect("eight bytes"));
            if new == 0 { old } else { new }
        }
        old => old,
    };
    let (mut scale, mut offset) = ([0.0; 3], [0.0; 3]);
    for a in 0..3 {
        (scale[a], offset[a]) = (f64_at(131 + 8 * a), f64_at(155 + 8 * a));
        if !(scale[a].is_finite() && scale[a] != 0.0) {
            return Err(wrong(131 + 8 * a, "a scale factor", scale[a].to_string(), "a number of metres, not 0".into()));
        }
        if !offset[a].is_finite() {
            return Err(wrong(155 + 8 * a, "an offset", offset[a].to_string(), "a number of metres".into()));
        }
    }
    Ok(Header { start, record, points, packed, scale, offset })
}

/// The first twelve bytes of each record.
#[cfg(not(feature = "laz"))]
fn unpack(_: &[u8], _: &Header) -> Result<(Vec<u8>, usize), MapError> {
    Err(MapError::LazNotBuilt)
}

#[cfg(feature = "laz")]
use packed::unpack;

#[cfg(feature = "laz")]
mod packed {
    use std::io::{Cursor, Seek, SeekFrom};
    use std::panic::{AssertUnwindSafe, catch_unwind};

    use laz::{LasZipDecompressor, LazVlr};

    use super::{Header, MapError};
    use crate::memory;

    /// Points unpacked at a time.
    const BATCH: u64 = 4096;
    /// Bytes before the data of a record about the file: among them its author (16 bytes at 2), number and length.
    const BEFORE: usize = 54;

    /// The first twelve bytes of each record, which are its coordinates; and how many points there are.
    pub(super) fn unpack(bytes: &[u8], header: &Header) -> Result<(Vec<u8>, usize), MapError> {
        let layout = layout(bytes, header)?;
        check_chunks(bytes, header)?;
        // The crate indexes by what a damaged file says.
        let damaged = |at: u64, fault: String| MapError::LazDamaged { at, points: header.points, fault };
        let mut done = 0;
        let run = AssertUnwindSafe(|| -> Result<Vec<u8>, String> {
            let mut source = Cursor::new(bytes);
            source.seek(SeekFrom::Start(header.start as u64)).map_err(|e| e.to_string())?;
            let mut unpacker = LasZipDecompressor::new(source, layout).map_err(|e| e.to_string())?;
            let mut batch = vec![0; header.record * BATCH as usize];
            let mut out: Vec<u8> = Vec::new();
            while done < header.points {
                let points = BATCH.min(header.points - done) as usize;
                let batch = &mut batch[..points * header.record];
                // Points that are alike take next to nothing when packed: how many there are is known when they are there.
                memory::fits(2 * out.len() as u128).map_err(|fault| format!("they take {fault}"))?;
                unpacker.decompress_many(batch).map_err(|e| e.to_string())?;
                batch.chunks_exact(header.record).for_each(|record| out.extend_from_slice(&record[..12]));
                done += points as u64;
            }
            Ok(out)
        });
        let out = catch_unwind(run).unwrap_or_else(|_| Err("it contradicts itself".into()));
        let out = out.map_err(|fault| damaged(done, fault))?;
        let count = out.len() / 12;
        Ok((out, count))
    }

    /// How the points are packed, from the record that says so.
    fn layout(bytes: &[u8], header: &Header) -> Result<LazVlr, MapError> {
        let size = u16::from_le_bytes([bytes[94], bytes[95]]) as usize;
        let mut at = size;
        while let Some(head) = bytes[..header.start].get(at..at + BEFORE) {
            let length = u16::from_le_bytes([head[20], head[21]]) as usize;
            let number = u16::from_le_bytes([head[18], head[19]]);
            let data = bytes[..header.start].get(at + BEFORE..at + BEFORE + length);
            if let Some(data) = data.filter(|_| head[2..18].starts_with(b"laszip encoded") && number == 22204) {
                let fault = |fault: String| MapError::LazDamaged { at: 0, points: header.points, fault };
                let layout = LazVlr::from_buffer(data).map_err(|e| fault(e.to_string()))?;
                let unpacked = layout.items_size();
                // Items of the right length only: the crate believes what they say of themselves.
                let own = layout.items().iter().all(|item| item.size() == of(item.item_type()));
                if unpacked != header.record as u64 || !own {
                    let fault = fault(format!("its points have {unpacked} bytes, but the header's {}", header.record));
                    return Err(fault);
                }
                return Ok(layout);
            }
            at += BEFORE + length;
        }
        Err(MapError::LasHeader {
            at: size,
            what: "what follows the header",
            found: "without the record `laszip encoded` 22204".into(),
            expected: "how the points are packed".into(),
        })
    }

    /// Bytes of an item, by its kind.
    fn of(kind: laz::LazItemType) -> u16 {
        use laz::LazItemType::*;
        match kind {
            Byte(size) | Byte14(size) => size,
            Point10 => 20,
            GpsTime => 8,
            RGB12 | RGB14 => 6,
            WavePacket13 | WavePacket14 => 29,
            Point14 => 30,
            RGBNIR14 => 8,
        }
    }

    /// The table of chunks, where there is one, has no more entries than the file has bytes: memory is taken for as many as it says.
    fn check_chunks(bytes: &[u8], header: &Header) -> Result<(), MapError> {
        let long =
            |at: usize| bytes.get(at..at.checked_add(8)?).map(|b| u64::from_le_bytes(b.try_into().expect("eight")));
        let ends = [long(header.start), long(bytes.len().saturating_sub(8))];
        for table in ends.into_iter().flatten().filter_map(|at| usize::try_from(at).ok()) {
            let count = bytes.get(table.saturating_add(4)..table.saturating_add(8));
            let count = count.map_or(0, |b| u32::from_le_bytes(b.try_into().expect("four bytes")));
            if u64::from(count) > bytes.len() as u64 {
                let fault = format!("its table at byte {table} has {count} chunks, more than the file has bytes");
                return Err(MapError::LazDamaged { at: 0, points: header.points, fault });
            }
        }
        Ok(())
    }
}
