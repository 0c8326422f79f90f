//! NPY: points N x 3 of floats, or voxels [ix, iy, iz] of booleans or integers, in C or Fortran order.
//!
//! An own reader: both uses need the bytes with strides where they lie, and the header's length and nesting must be bounded
//! before anybody follows them.

use std::borrow::Cow;

use super::error::MapError;
use super::points::{Column, Points, Scalar, quote};

/// Most columns of a table of points; more look like a table lying on its side.
const MOST_COLUMNS: u64 = 16;

/// What an array is.
pub(super) enum Array<'a> {
    Points(Points<'a>),
    Voxels(Voxels<'a>),
}

/// A dense grid of voxels; zero is free.
pub(super) struct Voxels<'a> {
    /// Voxels along x, y, z; all > 0.
    pub(super) shape: [usize; 3],
    /// Bytes from one voxel to the next along each axis.
    strides: [usize; 3],
    /// Bytes of a voxel.
    size: usize,
    bytes: &'a [u8],
}

impl Voxels<'_> {
    /// Whether a voxel of the shape is occupied.
    pub(super) fn occupied(&self, i: usize, j: usize, k: usize) -> bool {
        let at = i * self.strides[0] + j * self.strides[1] + k * self.strides[2];
        self.bytes[at..at + self.size].iter().any(|b| *b != 0)
    }
}

/// The number of axes that the header gives; `None` if it cannot be read.
pub(super) fn axes(bytes: &[u8]) -> Option<usize> {
    header(bytes).ok().map(|(header, _)| header.shape.len())
}

/// Reads an array.
pub(super) fn read(bytes: &[u8]) -> Result<Array<'_>, MapError> {
    let (header, data) = header(bytes)?;
    let is_table = header.shape.len() == 2 && (3..=MOST_COLUMNS).contains(&header.shape[1]);
    if !is_table && header.shape.len() != 3 {
        return Err(MapError::NpyShape { shape: header.shape });
    }
    let expected = if is_table { "numbers such as `<f4` or `<f8`" } else { "booleans or integers" };
    let (scalar, big_endian) = scalar(&header.descr)
        .filter(|(scalar, _)| is_table || !matches!(scalar, Scalar::F32 | Scalar::F64))
        .filter(|_| !(is_table && header.descr.ends_with("b1")))
        .ok_or_else(|| MapError::NpyType { descr: quote(header.descr.as_bytes()), expected })?;
    let (unit, size) = (if is_table { "points" } else { "voxels" }, scalar.size());
    let item = if is_table { size * header.shape[1] as usize } else { size };
    let counted = if is_table { &header.shape[..1] } else { &header.shape[..] };
    let promised = counted.iter().fold(1u128, |product, n| product.saturating_mul(u128::from(*n)));
    let promised_bytes = promised.saturating_mul(item as u128);
    let have_bytes = data.len() as u128;
    if have_bytes < promised_bytes {
        return Err(MapError::Truncated { unit, promised, promised_bytes, have_bytes });
    }
    if have_bytes >= promised_bytes + item as u128 {
        return Err(MapError::Surplus { unit, promised, promised_bytes, have_bytes });
    }
    if is_table {
        let count = header.shape[0] as usize;
        let (step, stride) = if header.fortran { (size * count, size) } else { (size, item) };
        let columns = [0, 1, 2].map(|k| Column { offset: k * step, stride, scalar, big_endian });
        return Ok(Array::Points(Points::Packed { bytes: Cow::Borrowed(data), count, columns }));
    }
    if promised == 0 {
        return Err(MapError::NpyShape { shape: header.shape });
    }
    // Their product is at most the file's length, so each fits.
    let shape = [0, 1, 2].map(|k| header.shape[k] as usize);
    let strides = if header.fortran {
        [size, size * shape[0], size * shape[0] * shape[1]]
    } else {
        [size * shape[1] * shape[2], size * shape[2], size]
    };
    Ok(Array::Voxels(Voxels { shape, strides, size, bytes: data }))
}

/// Type and byte order of a `descr` such as `<f4`.
fn scalar(descr: &str) -> Option<(Scalar, bool)> {
    let big_endian = descr.starts_with('>');
    let scalar = match descr.strip_prefix(['<', '>', '|', '='])? {
        "b1" | "u1" => Scalar::U8,
        "i1" => Scalar::I8,
        "i2" => Scalar::I16,
        "u2" => Scalar::U16,
        "i4" => Scalar::I32,
        "u4" => Scalar::U32,
        "i8" => Scalar::I64,
        "u8" => Scalar::U64,
        "f4" => Scalar::F32,
        "f8" => Scalar::F64,
        _ => return None,
    };
    Some((scalar, big_endian))
}

struct Header {
    descr: String,
    fortran: bool,
    shape: Vec<u64>,
}

/// The header and the data after it.
fn header(bytes: &[u8]) -> Result<(Header, &[u8]), MapError> {
    let fault = |fault: &str| MapError::NpyHeader { fault: fault.to_owned() };
    let rest =
        bytes.strip_prefix(b"\x93NUMPY").ok_or(MapError::NotThisFormat { format: "NPY", begin: "`\\x93NUMPY`" })?;
    let (length, rest) = match *rest {
        [1, _, a, b, ref rest @ ..] => (u16::from_le_bytes([a, b]) as usize, rest),
        [2 | 3, _, a, b, c, d, ref rest @ ..] => (u32::from_le_bytes([a, b, c, d]) as usize, rest),
        [1..=3, ..] => return Err(fault("it is cut off")),
        _ => return Err(fault("its version is none of 1, 2, 3")),
    };
    let (promised, have) = (length as u128, rest.len() as u128);
    let text = rest.get(..length).ok_or(MapError::Truncated {
        unit: "header bytes",
        promised,
        promised_bytes: promised,
        have_bytes: have,
    })?;
    let text = std::str::from_utf8(text).map_err(|_| fault("it is not text"))?;
    let header = dictionary(text).map_err(|why| fault(&format!("{why}: `{}`", quote(text.as_bytes()))))?;
    Ok((header, &rest[length..]))
}

/// The three entries of the header's Python dictionary. Its grammar is fixed by the format: no nesting to follow.
fn dictionary(text: &str) -> Result<Header, &'static str> {
    let mut rest = text.trim().strip_prefix('{').and_then(|t| t.strip_suffix('}')).ok_or("it is not in braces")?.trim();
    let (mut descr, mut fortran, mut shape) = (None, None, None);
    while !rest.is_empty() {
        let (key, after) = string(rest).ok_or("a key is not in quotes")?;
        let after = after.trim_start().strip_prefix(':').ok_or("a key has no value")?.trim_start();
        rest = match key {
            "descr" => {
                let (value, after) = string(after).ok_or("records of several fields are not read")?;
                descr = Some(value.to_owned());
                after
            }
            "fortran_order" => {
                let (value, after) = match (after.strip_prefix("True"), after.strip_prefix("False")) {
                    (Some(after), _) => (true, after),
                    (_, Some(after)) => (false, after),
                    _ => return Err("fortran_order is neither True nor False"),
                };
                fortran = Some(value);
                after
            }
            "shape" => {
                let (inner, after) =
                    after.strip_prefix('(').and_then(|t| t.split_once(')')).ok_or("shape is not in parentheses")?;
                let sizes = inner.split(',').map(str::trim).filter(|s| !s.is_empty());
                let sizes: Result<Vec<u64>, _> = sizes.map(|s| s.trim_end_matches('L').parse()).collect();
                shape = Some(sizes.map_err(|_| "shape is not of whole numbers")?);
                after
            }
            _ => return Err("it has an unknown key"),
        };
        rest = rest.trim_start();
        rest = rest.strip_prefix(',').unwrap_or(rest).trim_start();
    }
    Ok(Header {
        descr: descr.ok_or("descr is missing")?,
        fortran: fortran.ok_or("fortran_order is missing")?,
        shape: shape.ok_or("shape is missing")?,
    })
}

/// A quoted string without escapes, and what comes after it.
fn string(text: &str) -> Option<(&str, &str)> {
    let quote = text.chars().next().filter(|c| ['\'', '"'].contains(c))?;
    text[1..].split_once(quote)
}
