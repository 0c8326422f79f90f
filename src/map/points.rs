//! Points as the readers hand them on: a view into packed records, or a list where the format is text.

use std::borrow::Cow;

use super::error::{MapError, room};

/// A number's type in a binary file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Scalar {
    /// Bytes it takes.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// The number at the start of `bytes`, which must hold at least `size()` bytes.
    pub(super) fn read(self, bytes: &[u8], big_endian: bool) -> f64 {
        /// The first N bytes, least significant first.
        fn little<const N: usize>(bytes: &[u8], big_endian: bool) -> [u8; N] {
            let mut raw: [u8; N] = bytes[..N].try_into().expect("a slice of N bytes");
            if big_endian {
                raw.reverse();
            }
            raw
        }
        match self {
            Self::I8 => f64::from(bytes[0] as i8),
            Self::U8 => f64::from(bytes[0]),
            Self::I16 => f64::from(i16::from_le_bytes(little(bytes, big_endian))),
            Self::U16 => f64::from(u16::from_le_bytes(little(bytes, big_endian))),
            Self::I32 => f64::from(i32::from_le_bytes(little(bytes, big_endian))),
            Self::U32 => f64::from(u32::from_le_bytes(little(bytes, big_endian))),
            Self::I64 => i64::from_le_bytes(little(bytes, big_endian)) as f64,
            Self::U64 => u64::from_le_bytes(little(bytes, big_endian)) as f64,
            Self::F32 => f64::from(f32::from_le_bytes(little(bytes, big_endian))),
            Self::F64 => f64::from_le_bytes(little(bytes, big_endian)),
        }
    }
}

/// Where one coordinate of all points lies: point `n` at byte `offset + n * stride`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Column {
    pub(super) offset: usize,
    pub(super) stride: usize,
    pub(super) scalar: Scalar,
    pub(super) big_endian: bool,
}

/// Points in metres, in the map frame, as in the file (not yet checked for NaN).
#[derive(Debug)]
pub(super) enum Points<'a> {
    /// Binary records. The reader has checked that all of `count` lie within `bytes`.
    Packed { bytes: Cow<'a, [u8]>, count: usize, columns: [Column; 3] },
    /// Records that begin with three i32, low byte first, each to be scaled and moved. The reader has checked that all of `count`
    /// lie within `records`.
    Scaled { records: Cow<'a, [u8]>, stride: usize, count: usize, scale: [f64; 3], offset: [f64; 3] },
    /// From text, or from records of varying length.
    List(Vec<[f64; 3]>),
}

impl Points<'_> {
    /// How many there are.
    pub(super) fn len(&self) -> usize {
        match self {
            Self::Packed { count, .. } | Self::Scaled { count, .. } => *count,
            Self::List(list) => list.len(),
        }
    }

    /// Calls `f` for each point in order. Nothing is allocated; the two usual types have a loop without a branch on the type.
    pub(super) fn for_each(&self, mut f: impl FnMut([f64; 3])) {
        match self {
            Self::List(list) => list.iter().for_each(|p| f(*p)),
            Self::Scaled { records, stride, count, scale, offset } => {
                for record in records.chunks_exact(*stride).take(*count) {
                    let steps = |a: usize| {
                        f64::from(i32::from_le_bytes(record[4 * a..4 * a + 4].try_into().expect("four bytes")))
                    };
                    f([0, 1, 2].map(|a| steps(a) * scale[a] + offset[a]));
                }
            }
            Self::Packed { bytes, count, columns } => {
                let is = |scalar| columns.iter().all(|c| c.scalar == scalar && !c.big_endian);
                if is(Scalar::F32) {
                    each(bytes, *count, columns, f, |_, b| f64::from(f32::from_le_bytes([b[0], b[1], b[2], b[3]])));
                } else if is(Scalar::F64) {
                    each(bytes, *count, columns, f, |_, b| {
                        f64::from_le_bytes([b[0], b[1], b[2], b[3], b[4], b[5], b[6], b[7]])
                    });
                } else {
                    each(bytes, *count, columns, f, |c, b| c.scalar.read(b, c.big_endian));
                }
            }
        }
    }
}

fn each(
    bytes: &[u8],
    count: usize,
    columns: &[Column; 3],
    mut f: impl FnMut([f64; 3]),
    read: impl Fn(Column, &[u8]) -> f64,
) {
    let [x, y, z] = *columns;
    let (mut at_x, mut at_y, mut at_z) = (x.offset, y.offset, z.offset);
    for _ in 0..count {
        f([read(x, &bytes[at_x..]), read(y, &bytes[at_y..]), read(z, &bytes[at_z..])]);
        at_x += x.stride;
        at_y += y.stride;
        at_z += z.stride;
    }
}

/// A word of a text file as a number: decimal or exponent notation, `nan` and `inf` in any case.
pub(super) fn number(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// The non-blank lines of a text, each with its number (from 1) and without blanks at its ends.
pub(super) fn lines(text: &[u8]) -> impl Iterator<Item = (u64, &[u8])> {
    (1..).zip(text.split(|b| *b == b'\n')).map(|(n, line)| (n, line.trim_ascii())).filter(|(_, line)| !line.is_empty())
}

/// A list with room for a point in every line of a text; lines that are none are rare.
pub(super) fn list(text: &[u8]) -> Result<Vec<[f64; 3]>, MapError> {
    let rows = text.iter().filter(|b| **b == b'\n').count() + 1;
    room("the points", rows as u128 * size_of::<[f64; 3]>() as u128)?;
    Ok(Vec::with_capacity(rows))
}

/// The words between blanks.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// Bytes for a message: readable, and not long.
pub(super) fn quote(bytes: &[u8]) -> String {
    const LONGEST: usize = 60;
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(LONGEST)]);
    let text: String = text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    if bytes.len() > LONGEST { text + "…" } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::real;

    #[test]
    fn every_scalar_reads_what_was_written_in_both_byte_orders() {
        let cases: [(Scalar, Vec<u8>, f64); 10] = [
            (Scalar::I8, (-5i8).to_le_bytes().into(), -5.0),
            (Scalar::U8, 250u8.to_le_bytes().into(), 250.0),
            (Scalar::I16, (-3000i16).to_le_bytes().into(), -3000.0),
            (Scalar::U16, 65000u16.to_le_bytes().into(), 65000.0),
            (Scalar::I32, (-70000i32).to_le_bytes().into(), -70000.0),
            (Scalar::U32, 4_000_000_000u32.to_le_bytes().into(), 4e9),
            (Scalar::I64, (-1i64 << 40).to_le_bytes().into(), -(real::powi(2.0, 40))),
            (Scalar::U64, (1u64 << 63).to_le_bytes().into(), real::powi(2.0, 63)),
            (Scalar::F32, 1.5f32.to_le_bytes().into(), 1.5),
            (Scalar::F64, (-0.1f64).to_le_bytes().into(), -0.1),
        ];
        for (scalar, mut raw, value) in cases {
            assert_eq!(raw.len(), scalar.size());
            assert_eq!(scalar.read(&raw, false), value);
            raw.reverse();
            assert_eq!(scalar.read(&raw, true), value);
        }
    }

    #[test]
    fn packed_points_come_in_order_whatever_the_layout() {
        let mut bytes = vec![0u8; 3];
        for n in 0..4u8 {
            bytes.extend([n, 10 + n, 20 + n]);
        }
        let column = |offset| Column { offset, stride: 3, scalar: Scalar::U8, big_endian: false };
        let points = Points::Packed { bytes: bytes.into(), count: 4, columns: [column(5), column(3), column(4)] };
        let mut seen = Vec::new();
        points.for_each(|p| seen.push(p));
        assert_eq!(seen[3], [23.0, 3.0, 13.0]);
        assert_eq!(seen.len(), points.len());
    }
}
