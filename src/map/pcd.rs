//! PCD 0.7: `ascii`, `binary` and `binary_compressed`, fields in any order.
//!
//! An own reader: sizes are checked against the file before anything is allocated, binary points stay where they are in the
//! file, and every fault in the header has its line.

use std::borrow::Cow;
use std::collections::BTreeMap;

use super::error::{MapError, room};
use super::header::Header;
use super::points::{Column, Points, Scalar, lines, list, number, quote, words};
use super::{lzf, text};
use crate::diag::{Span, nearest};

const KEYS: [&str; 10] =
    ["VERSION", "FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA"];

/// One field of a point.
struct Field<'a> {
    name: &'a str,
    scalar: Scalar,
    /// Numbers in it.
    count: usize,
}

/// What the header says, checked for itself.
struct Layout<'a> {
    fields: Vec<Field<'a>>,
    points: u64,
    data: &'a str,
    /// Indices of the fields x, y, z.
    xyz: [usize; 3],
}

/// Reads a PCD file.
pub(super) fn read<'a>(name: &str, bytes: &'a [u8]) -> Result<Points<'a>, Vec<MapError>> {
    let header =
        Header::take(name, bytes, "DATA").ok_or_else(|| vec![MapError::NoHeaderEnd { format: "PCD", last: "DATA" }])?;
    let layout = layout(&header)?;
    let body = &bytes[header.end..];
    match layout.data {
        "ascii" => {
            let before = bytes[..header.end].iter().filter(|b| **b == b'\n').count() as u64;
            ascii(body, before, &layout)
        }
        "binary" => binary(body, &layout),
        _ => compressed(body, &layout),
    }
    .map_err(|error| vec![error])
}

fn layout(header: &Header) -> Result<Layout<'_>, Vec<MapError>> {
    let mut entries: BTreeMap<&str, (Vec<&str>, Span)> = BTreeMap::new();
    let mut faults = Vec::new();
    for (mut words, at) in header.lines() {
        if words[0].starts_with('#') {
            continue;
        }
        // The name of FIELDS before version 0.7.
        let key = if words[0] == "COLUMNS" { "FIELDS" } else { words[0] };
        if !KEYS.contains(&key) {
            let near = nearest(key, KEYS).map(str::to_owned);
            let fault = MapError::UnknownHeaderLine { format: "PCD", word: quote(key.as_bytes()), nearest: near, at };
            if entries.is_empty() {
                return Err(vec![fault]);
            }
            faults.push(fault);
        } else if entries.contains_key(key) {
            faults.push(MapError::HeaderTwice { word: key.to_owned(), at });
        } else {
            words.remove(0);
            entries.insert(key, (words, at));
        }
    }
    let missing = |word| MapError::HeaderMissing { format: "PCD", word };
    let fields = entries.get("FIELDS");
    faults.extend(["FIELDS", "SIZE", "TYPE"].into_iter().filter(|k| !entries.contains_key(k)).map(missing));
    let points = points(&entries, &mut faults);
    let fields = fields.map(|(names, at)| (self::fields(names, at, &entries, &mut faults), at));
    let (data, data_at) =
        entries.get("DATA").map(|(v, at)| (v.first().copied().unwrap_or(""), at)).expect("taken up to DATA");
    if !["ascii", "binary", "binary_compressed"].contains(&data) {
        let expected = "ascii, binary or binary_compressed";
        faults.push(MapError::HeaderValue {
            word: "DATA".into(),
            value: quote(data.as_bytes()),
            expected,
            at: data_at.clone(),
        });
    }
    let xyz = fields.as_ref().and_then(|(fields, at)| xyz(fields, at, &mut faults));
    match (fields, points, xyz) {
        (Some((fields, _)), Some(points), Some(xyz)) if faults.is_empty() => Ok(Layout { fields, points, data, xyz }),
        _ => Err(faults),
    }
}

/// How many points; `None` after a fault.
fn points(entries: &BTreeMap<&str, (Vec<&str>, Span)>, faults: &mut Vec<MapError>) -> Option<u64> {
    let mut whole = |word: &str| {
        let (values, at) = entries.get(word)?;
        let value = values.first().and_then(|v| v.parse::<u64>().ok()).filter(|_| values.len() == 1);
        if value.is_none() {
            let expected = "one whole number";
            faults.push(MapError::HeaderValue {
                word: word.to_owned(),
                value: quote(values.join(" ").as_bytes()),
                expected,
                at: at.clone(),
            });
        }
        value
    };
    let (width, height, points) = (whole("WIDTH"), whole("HEIGHT"), whole("POINTS"));
    if let (Some(width), Some(points), Some((_, at))) = (width, points, entries.get("POINTS")) {
        let height = height.unwrap_or(1);
        if width.checked_mul(height) != Some(points) {
            faults.push(MapError::PointsDiffer { width, height, points, at: at.clone() });
        }
    }
    let product = width.and_then(|w| w.checked_mul(height.unwrap_or(1)));
    if points.is_none() && product.is_none() && faults.is_empty() {
        faults.push(MapError::HeaderMissing { format: "PCD", word: "POINTS" });
    }
    points.or(product)
}

/// The fields; those that cannot be understood are reported and left out.
fn fields<'a>(
    names: &[&'a str],
    at: &Span,
    entries: &BTreeMap<&str, (Vec<&'a str>, Span)>,
    faults: &mut Vec<MapError>,
) -> Vec<Field<'a>> {
    let mut column = |word: &str| {
        let (values, at) = entries.get(word)?;
        if values.len() != names.len() {
            let (got, fields) = (values.len(), names.len());
            faults.push(MapError::HeaderLength { word: word.to_owned(), got, fields, at: at.clone() });
            return None;
        }
        Some((values, at))
    };
    let (sizes, types, counts) = (column("SIZE"), column("TYPE"), column("COUNT"));
    let (Some((sizes, size_at)), Some((types, _))) = (sizes, types) else { return Vec::new() };
    let mut fields = Vec::new();
    for (k, name) in names.iter().enumerate() {
        let scalar = match (types[k], sizes[k]) {
            ("F", "4") => Scalar::F32,
            ("F", "8") => Scalar::F64,
            ("I", "1") => Scalar::I8,
            ("I", "2") => Scalar::I16,
            ("I", "4") => Scalar::I32,
            ("I", "8") => Scalar::I64,
            ("U", "1") => Scalar::U8,
            ("U", "2") => Scalar::U16,
            ("U", "4") => Scalar::U32,
            ("U", "8") => Scalar::U64,
            (kind, size) => {
                faults.push(MapError::HeaderValue {
                    word: format!("SIZE and TYPE of {name}"),
                    value: quote(format!("{size} {kind}").as_bytes()),
                    expected: "SIZE 1, 2, 4 or 8 with TYPE I or U, 4 or 8 with TYPE F",
                    at: size_at.clone(),
                });
                continue;
            }
        };
        let count = counts.map_or(Some(1), |(values, _)| values[k].parse().ok().filter(|c: &usize| *c > 0));
        let Some(count) = count else {
            faults.push(MapError::HeaderValue {
                word: format!("COUNT of {name}"),
                value: quote(counts.map_or("", |(values, _)| values[k]).as_bytes()),
                expected: "a whole number above 0",
                at: counts.map_or(at, |(_, at)| at).clone(),
            });
            continue;
        };
        fields.push(Field { name, scalar, count });
    }
    fields
}

/// Where x, y and z are among the fields.
fn xyz(fields: &[Field<'_>], at: &Span, faults: &mut Vec<MapError>) -> Option<[usize; 3]> {
    if !faults.is_empty() {
        return None;
    }
    let mut found = [0; 3];
    for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
        match fields.iter().position(|f| f.name == axis) {
            Some(index) => found[k] = index,
            None => {
                let names: Vec<&str> = fields.iter().map(|f| f.name).collect();
                let (missing, found) = (b"xyz"[k] as char, quote(names.join(", ").as_bytes()));
                faults.push(MapError::NoCoordinate { missing, found, at: Some(at.clone()) });
            }
        }
    }
    faults.is_empty().then_some(found)
}

impl Layout<'_> {
    /// Bytes of one point, and of the fields before each field; in u128, where no header can overflow them.
    fn sizes(&self) -> (u128, Vec<u128>) {
        let mut total = 0u128;
        let starts = self.fields.iter().map(|field| {
            let start = total;
            total += field.scalar.size() as u128 * field.count as u128;
            start
        });
        let starts = starts.collect();
        (total, starts)
    }

    /// Checks the number of bytes that are there against those promised.
    fn check_length(&self, have: u128) -> Result<usize, MapError> {
        let (point, _) = self.sizes();
        let (unit, promised, have_bytes) = ("points", u128::from(self.points), have);
        // A point has at least three bytes, and u64 x u64-sized counts stay below 2^128.
        let promised_bytes = promised.saturating_mul(point);
        if have < promised_bytes {
            return Err(MapError::Truncated { unit, promised, promised_bytes, have_bytes });
        }
        if have >= promised_bytes + point {
            return Err(MapError::Surplus { unit, promised, promised_bytes, have_bytes });
        }
        Ok(promised_bytes as usize)
    }
}

fn binary<'a>(body: &'a [u8], layout: &Layout<'_>) -> Result<Points<'a>, MapError> {
    let length = layout.check_length(body.len() as u128)?;
    let (point, starts) = layout.sizes();
    let column = |k: usize| Column {
        offset: starts[layout.xyz[k]] as usize,
        stride: point as usize,
        scalar: layout.fields[layout.xyz[k]].scalar,
        big_endian: false,
    };
    let columns = [column(0), column(1), column(2)];
    Ok(Points::Packed { bytes: Cow::Borrowed(&body[..length]), count: layout.points as usize, columns })
}

/// Two sizes, then all values of the first field, all of the second, and so on, packed by LZF.
fn compressed(body: &[u8], layout: &Layout<'_>) -> Result<Points<'static>, MapError> {
    let (point, starts) = layout.sizes();
    let expected = u128::from(layout.points).saturating_mul(point);
    let have = body.len() as u128;
    let truncated =
        |promised: u128| MapError::Truncated { unit: "bytes", promised, promised_bytes: promised, have_bytes: have };
    let size = |at: usize| {
        let raw = body.get(at..at + 4).ok_or_else(|| truncated(8))?;
        Ok(u32::from_le_bytes(raw.try_into().expect("four bytes")))
    };
    let (packed, unpacked) = (size(0)?, size(4)?);
    if u128::from(unpacked) != expected {
        return Err(MapError::UnpackedSize { said: unpacked.into(), expected });
    }
    let packed_bytes = body.get(8..8 + packed as usize).ok_or_else(|| truncated(8 + u128::from(packed)))?;
    let expected = unpacked as usize;
    room("the unpacked points", unpacked.into())?;
    let bytes =
        lzf::unpack(packed_bytes, expected).map_err(|(at, unpacked)| MapError::Damaged { at, unpacked, expected })?;
    let count = layout.points as usize;
    let column = |k: usize| {
        let field = &layout.fields[layout.xyz[k]];
        let scalar = field.scalar;
        let offset = starts[layout.xyz[k]] as usize * count;
        Column { offset, stride: scalar.size() * field.count, scalar, big_endian: false }
    };
    let columns = [column(0), column(1), column(2)];
    Ok(Points::Packed { bytes: Cow::Owned(bytes), count, columns })
}

fn ascii(body: &[u8], lines_before: u64, layout: &Layout<'_>) -> Result<Points<'static>, MapError> {
    let mut first = Vec::with_capacity(layout.fields.len());
    let mut width = 0usize;
    for field in &layout.fields {
        first.push(width);
        width = width.saturating_add(field.count);
    }
    let columns = layout.xyz.map(|k| first[k]);
    let mut list = list(body)?;
    for (line, row) in lines(body) {
        let line = line + lines_before;
        let got = words(row).count();
        if got != width {
            return Err(MapError::Columns { line, got, expected: width.to_string(), text: quote(row) });
        }
        list.push(text::pick(line, words(row), columns, number)?);
    }
    if list.len() as u64 != layout.points {
        let (promised, have) = (layout.points, list.len() as u64);
        return Err(MapError::RowsDiffer { unit: "points", promised, have });
    }
    Ok(Points::List(list))
}
