//! PLY: ascii and binary of both byte orders. Vertices with x, y, z; everything else is skipped.
//!
//! An own reader for the same reasons as PCD's: lengths are checked before memory is taken, and vertices without lists stay
//! where they are in the file.

use std::borrow::Cow;

use super::error::{MapError, room};
use super::header::Header;
use super::points::{Column, Points, Scalar, lines, list, number, quote, words};
use crate::diag::Span;

/// A kind of record.
struct Element {
    name: String,
    count: u64,
    properties: Vec<Property>,
    at: Span,
}

/// One value of a record, or a list of them.
struct Property {
    name: String,
    /// Type of a list's length.
    length: Option<Scalar>,
    scalar: Scalar,
}

impl Element {
    /// Bytes of one record, if all are equal.
    fn size(&self) -> Option<usize> {
        self.properties.iter().map(|p| p.length.is_none().then(|| p.scalar.size())).sum()
    }

    /// Properties x, y, z.
    fn xyz(&self) -> Result<[usize; 3], MapError> {
        let mut found = [0; 3];
        for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let at = self.properties.iter().position(|p| p.name == axis && p.length.is_none());
            found[k] = at.ok_or_else(|| {
                let names: Vec<&str> = self.properties.iter().map(|p| p.name.as_str()).collect();
                let (missing, found) = (b"xyz"[k] as char, quote(names.join(", ").as_bytes()));
                MapError::NoCoordinate { missing, found, at: Some(self.at.clone()) }
            })?;
        }
        Ok(found)
    }
}

/// Reads a PLY file.
pub(super) fn read<'a>(name: &str, bytes: &'a [u8]) -> Result<Points<'a>, Vec<MapError>> {
    if words(&bytes[..bytes.len().min(8)]).next() != Some(b"ply") {
        return Err(vec![MapError::NotThisFormat { format: "PLY", begin: "a line `ply`" }]);
    }
    let header = Header::take(name, bytes, "end_header")
        .ok_or_else(|| vec![MapError::NoHeaderEnd { format: "PLY", last: "end_header" }])?;
    let (format, elements) = layout(&header)?;
    let body = &bytes[header.end..];
    let points = match format {
        Format::Ascii => {
            let before = bytes[..header.end].iter().filter(|b| **b == b'\n').count() as u64;
            ascii(body, before, &elements)
        }
        Format::Binary { big_endian } => binary(body, &elements, big_endian),
    };
    points.map_err(|error| vec![error])
}

#[derive(Clone, Copy)]
enum Format {
    Ascii,
    Binary { big_endian: bool },
}

fn layout(header: &Header) -> Result<(Format, Vec<Element>), Vec<MapError>> {
    let mut format = None;
    let mut elements: Vec<Element> = Vec::new();
    let mut faults = Vec::new();
    for (words, at) in header.lines() {
        let wrong = |word: &str, expected| MapError::HeaderValue {
            word: word.to_owned(),
            value: quote(words[1..].join(" ").as_bytes()),
            expected,
            at: at.clone(),
        };
        match words[..] {
            ["ply"] | ["end_header"] | ["comment" | "obj_info", ..] => {}
            ["format", "ascii", _] => format = Some(Format::Ascii),
            ["format", "binary_little_endian", _] => format = Some(Format::Binary { big_endian: false }),
            ["format", "binary_big_endian", _] => format = Some(Format::Binary { big_endian: true }),
            ["format", ..] => {
                faults.push(wrong("format", "ascii, binary_little_endian or binary_big_endian, then 1.0"));
                format = Some(Format::Ascii);
            }
            ["element", name, count] => match count.parse() {
                Ok(count) => elements.push(Element { name: name.to_owned(), count, properties: Vec::new(), at }),
                Err(_) => faults.push(wrong("element", "a name and a whole number")),
            },
            ["element", ..] => faults.push(wrong("element", "a name and a whole number")),
            ["property", ref rest @ ..] => match (property(rest), elements.last_mut()) {
                (Some(property), Some(element)) => element.properties.push(property),
                (None, _) => faults.push(wrong("property", "a type and a name, or `list`, two types and a name")),
                (_, None) if faults.is_empty() => faults.push(wrong("property", "an element before it")),
                (_, None) => {}
            },
            [word, ..] => {
                let known = ["format", "element", "property", "comment", "obj_info", "end_header"];
                let nearest = crate::diag::nearest(word, known).map(str::to_owned);
                let word = quote(word.as_bytes());
                faults.push(MapError::UnknownHeaderLine { format: "PLY", word, nearest, at });
            }
            [] => {}
        }
    }
    if format.is_none() {
        faults.push(MapError::HeaderMissing { format: "PLY", word: "format" });
    }
    match elements.iter().find(|e| e.name == "vertex") {
        None if faults.is_empty() => faults.push(MapError::HeaderMissing { format: "PLY", word: "element vertex" }),
        Some(vertex) if faults.is_empty() => faults.extend(vertex.xyz().err()),
        _ => {}
    }
    match format {
        Some(format) if faults.is_empty() => Ok((format, elements)),
        _ => Err(faults),
    }
}

fn property(words: &[&str]) -> Option<Property> {
    match *words {
        ["list", length, scalar, name] => {
            let length = self::scalar(length).filter(|s| !matches!(s, Scalar::F32 | Scalar::F64))?;
            Some(Property { name: name.to_owned(), length: Some(length), scalar: self::scalar(scalar)? })
        }
        [scalar, name] => Some(Property { name: name.to_owned(), length: None, scalar: self::scalar(scalar)? }),
        _ => None,
    }
}

fn scalar(word: &str) -> Option<Scalar> {
    Some(match word {
        "char" | "int8" => Scalar::I8,
        "uchar" | "uint8" => Scalar::U8,
        "short" | "int16" => Scalar::I16,
        "ushort" | "uint16" => Scalar::U16,
        "int" | "int32" => Scalar::I32,
        "uint" | "uint32" => Scalar::U32,
        "float" | "float32" => Scalar::F32,
        "double" | "float64" => Scalar::F64,
        _ => return None,
    })
}

fn binary<'a>(body: &'a [u8], elements: &[Element], big_endian: bool) -> Result<Points<'a>, MapError> {
    let mut at = 0usize;
    for (index, element) in elements.iter().enumerate() {
        let is_vertex = element.name == "vertex";
        let Some(size) = element.size() else {
            let list = walk(body, &mut at, element, big_endian, is_vertex)?;
            if is_vertex {
                return Ok(Points::List(list));
            }
            continue;
        };
        let (promised, have_bytes) = (u128::from(element.count), (body.len() - at) as u128);
        let promised_bytes = promised * size as u128;
        let unit = if is_vertex { "vertices" } else { "elements" };
        if have_bytes < promised_bytes {
            return Err(MapError::Truncated { unit, promised, promised_bytes, have_bytes });
        }
        let length = promised_bytes as usize;
        if !is_vertex {
            at += length;
            continue;
        }
        if index + 1 == elements.len() && have_bytes >= promised_bytes + size as u128 {
            return Err(MapError::Surplus { unit, promised, promised_bytes, have_bytes });
        }
        let columns = element.xyz()?.map(|k| {
            let before = element.properties[..k].iter().map(|p| p.scalar.size()).sum();
            Column { offset: before, stride: size, scalar: element.properties[k].scalar, big_endian }
        });
        return Ok(Points::Packed {
            bytes: Cow::Borrowed(&body[at..at + length]),
            count: element.count as usize,
            columns,
        });
    }
    unreachable_without_vertex()
}

/// Records with lists have to be walked through one by one. Returns the vertices if it is they that have lists.
fn walk(
    body: &[u8],
    at: &mut usize,
    element: &Element,
    big_endian: bool,
    keep: bool,
) -> Result<Vec<[f64; 3]>, MapError> {
    let xyz = if keep { element.xyz()? } else { [usize::MAX; 3] };
    if keep {
        // A vertex takes three bytes at least, and a list grows by doubling.
        let most = u128::from(element.count).min((body.len() / 3) as u128);
        room("the vertices", 2 * most * size_of::<[f64; 3]>() as u128)?;
    }
    let mut list = Vec::new();
    let begin = *at;
    for done in 0..element.count {
        let truncated = |needed: usize| MapError::Truncated {
            unit: "elements with lists",
            promised: element.count.into(),
            // What is known of it: the records so far, and what the one at hand needs.
            promised_bytes: (*at - begin + needed).max(done as usize) as u128,
            have_bytes: (body.len() - begin) as u128,
        };
        let mut point = [0.0; 3];
        let mut cursor = *at;
        for (k, property) in element.properties.iter().enumerate() {
            let mut take = |size: usize| {
                let end = cursor.checked_add(size).filter(|end| *end <= body.len());
                let bytes =
                    end.map(|end| &body[cursor..end]).ok_or_else(|| truncated((cursor - *at).saturating_add(size)));
                cursor = end.unwrap_or(cursor);
                bytes
            };
            match property.length {
                None => {
                    let bytes = take(property.scalar.size())?;
                    if let Some(axis) = xyz.iter().position(|x| *x == k) {
                        point[axis] = property.scalar.read(bytes, big_endian);
                    }
                }
                Some(length) => {
                    let length = length.read(take(length.size())?, big_endian);
                    take((length.max(0.0) as usize).saturating_mul(property.scalar.size()))?;
                }
            }
        }
        *at = cursor;
        if keep {
            list.push(point);
        }
    }
    Ok(list)
}

fn ascii(body: &[u8], lines_before: u64, elements: &[Element]) -> Result<Points<'static>, MapError> {
    let mut rows = lines(body);
    for (index, element) in elements.iter().enumerate() {
        let is_vertex = element.name == "vertex";
        let mut list = if is_vertex { list(body)? } else { Vec::new() };
        for have in 0..element.count {
            let Some((line, row)) = rows.next() else {
                let unit = if is_vertex { "vertices" } else { "elements" };
                return Err(MapError::RowsDiffer { unit, promised: element.count, have });
            };
            if is_vertex {
                list.push(vertex(line + lines_before, row, element)?);
            }
        }
        if is_vertex {
            if index + 1 == elements.len() {
                let more = rows.count() as u64;
                if more > 0 {
                    let (promised, have) = (element.count, element.count + more);
                    return Err(MapError::RowsDiffer { unit: "vertices", promised, have });
                }
            }
            return Ok(Points::List(list));
        }
    }
    unreachable_without_vertex()
}

/// One vertex of an ascii file.
fn vertex(line: u64, row: &[u8], element: &Element) -> Result<[f64; 3], MapError> {
    let xyz = element.xyz()?;
    let mut point = [0.0; 3];
    let mut cells = words(row);
    for (k, property) in element.properties.iter().enumerate() {
        let mut next = || {
            let word = cells.next().ok_or_else(|| MapError::Columns {
                line,
                got: words(row).count(),
                expected: element.properties.len().to_string(),
                text: quote(row),
            })?;
            number(word).ok_or_else(|| MapError::NotANumber { line, word: quote(word) })
        };
        match property.length {
            Some(_) => {
                let length = next()?;
                // As many words as the row has at most, whatever the length says.
                for _ in 0..length.max(0.0) as usize {
                    next()?;
                }
            }
            None => {
                let value = next()?;
                if let Some(axis) = xyz.iter().position(|x| *x == k) {
                    point[axis] = value;
                }
            }
        }
    }
    Ok(point)
}

/// `layout` has made sure that there is a vertex element, and both readers return at it.
fn unreachable_without_vertex<T>() -> Result<T, MapError> {
    Err(MapError::HeaderMissing { format: "PLY", word: "element vertex" })
}
