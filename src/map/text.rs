//! Tables of points: .xyz, .txt, .csv. Separated by blanks, commas or semicolons, with or without a header.

use super::error::MapError;
use super::points::{Points, lines, list, number, quote};

/// Reads a table of points. Lines that begin with `#` or `//` are comments. Without a header the first three columns are
/// x, y, z; more columns are ignored.
pub(super) fn read(bytes: &[u8]) -> Result<Points<'static>, MapError> {
    let bytes = bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes); // byte-order mark of spreadsheets
    let mut columns = [0, 1, 2];
    let mut needed = 3;
    let mut list = list(bytes)?;
    let mut first = true;
    for (line, row) in lines(bytes) {
        if row.starts_with(b"#") || row.starts_with(b"//") {
            continue;
        }
        let separator = separator(line, row)?;
        if std::mem::take(&mut first) && cells(row, separator).any(is_name) {
            columns = header(line, row, separator)?;
            needed = columns.iter().max().map_or(3, |last| last + 1);
            continue;
        }
        let got = cells(row, separator).count();
        if got < needed {
            let expected = if columns == [0, 1, 2] { "x, y and z".to_owned() } else { format!("at least {needed}") };
            return Err(MapError::Columns { line, got, expected, text: quote(row) });
        }
        list.push(pick(line, cells(row, separator), columns, number)?);
    }
    Ok(Points::List(list))
}

/// What separates columns.
#[derive(Clone, Copy, PartialEq)]
enum Separator {
    Blanks,
    Byte(u8),
}

fn separator(line: u64, row: &[u8]) -> Result<Separator, MapError> {
    match (row.contains(&b','), row.contains(&b';')) {
        // `1,5;2,0;0,1` would be read as other numbers than were meant.
        (true, true) => Err(MapError::MixedSeparators { line, text: quote(row) }),
        (true, false) => Ok(Separator::Byte(b',')),
        (false, true) => Ok(Separator::Byte(b';')),
        (false, false) => Ok(Separator::Blanks),
    }
}

/// The cells of a row, without blanks and quotation marks around them.
fn cells(row: &[u8], separator: Separator) -> impl Iterator<Item = &[u8]> {
    let separates = move |b: &u8| match separator {
        Separator::Blanks => b.is_ascii_whitespace(),
        Separator::Byte(s) => *b == s,
    };
    row.split(separates)
        .map(|cell| cell.trim_ascii())
        .filter(move |cell| separator != Separator::Blanks || !cell.is_empty())
        .map(|cell| match cell {
            [b'"', inner @ .., b'"'] => inner.trim_ascii(),
            _ => cell,
        })
}

/// Whether a cell of the first row is a column's name: it has a letter and is no number.
fn is_name(cell: &[u8]) -> bool {
    cell.iter().any(u8::is_ascii_alphabetic) && number(cell).is_none()
}

fn header(line: u64, row: &[u8], separator: Separator) -> Result<[usize; 3], MapError> {
    let names: Vec<String> = cells(row, separator).map(|c| quote(c).to_ascii_lowercase()).collect();
    let mut columns = [0; 3];
    for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
        let at = names.iter().position(|n| n.strip_suffix("_m").unwrap_or(n) == axis);
        let missing = b"xyz"[k] as char;
        columns[k] =
            at.ok_or_else(|| MapError::NoColumn { missing, found: quote(names.join(", ").as_bytes()), line })?;
    }
    Ok(columns)
}

/// The three coordinates of a row of words.
pub(super) fn pick<'a>(
    line: u64,
    row: impl Iterator<Item = &'a [u8]>,
    columns: [usize; 3],
    number: impl Fn(&[u8]) -> Option<f64>,
) -> Result<[f64; 3], MapError> {
    let mut point = [f64::NAN; 3];
    let last = columns[0].max(columns[1]).max(columns[2]);
    for (k, word) in row.enumerate().take(last.saturating_add(1)) {
        for (axis, column) in columns.iter().enumerate() {
            if k == *column {
                point[axis] = number(word).ok_or_else(|| MapError::NotANumber { line, word: quote(word) })?;
            }
        }
    }
    Ok(point)
}
