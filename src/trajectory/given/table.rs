//! Rows of a path file.

use std::sync::Arc;

use crate::diag::shape::LARGE;
use crate::diag::{Source, Span, nearest};
use crate::math::poly::Piece;
use crate::robot::{MovingJoint, RobotModel};

use super::GivenError;

/// A path file's rows of finite numbers, no two neighbours at one point; two or more.
pub struct Table {
    /// In the order of the file.
    pub rows: Vec<Row>,
}

/// A row of numbers.
pub struct Row {
    /// From 1.
    pub line: usize,
    /// Where it is written.
    pub at: Span,
    /// x, y in metres.
    pub point: [f64; 2],
    /// One per moving joint; `None` without a column.
    pub joints: Vec<Option<f64>>,
}

/// What a column holds.
#[derive(Clone, Copy, PartialEq)]
enum Column {
    Plane(usize),
    Joint(usize),
    Unknown,
}

impl Table {
    /// Reads a file's text; `name` is the file as the user knows it.
    ///
    /// # Errors
    /// All faults found.
    pub fn read(name: &str, text: &str, robot: &RobotModel) -> Result<Self, Vec<GivenError>> {
        let source = Arc::new(Source { name: name.to_owned(), text: text.to_owned() });
        let mut lines = Lines { source: &source, at: 0, line: 0 };
        let mut errors = Vec::new();
        let Some(header) = lines.next() else {
            return Err(vec![GivenError::TooFewRows { name: name.to_owned(), rows: 0 }]);
        };
        let columns = read_header(&header, robot, &mut errors);
        for (index, column) in ["x_m", "y_m"].into_iter().enumerate() {
            // An unknown column that is near to it was told with that hint; once is enough.
            let meant = |title: &String| nearest(title, ["x_m", "y_m"]) == Some(column);
            let told = header.texts.iter().zip(&columns).any(|(title, c)| *c == Column::Unknown && meant(title));
            if !columns.contains(&Column::Plane(index)) && !told {
                let (found, at) = (header.texts.join(", "), header.at.clone());
                errors.push(GivenError::MissingColumn { column, found, at });
            }
        }
        let mut rows: Vec<Row> = Vec::new();
        for cells in lines {
            let (line, at) = (cells.line, cells.at.clone());
            if cells.texts.len() != header.texts.len() {
                let (found, expected) = (cells.texts.len(), header.texts.len());
                errors.push(GivenError::Ragged { line, found, expected, at });
                continue;
            }
            let mut row = Row { line, at: at.clone(), point: [0.0; 2], joints: vec![None; robot.joints.len()] };
            for (k, ((text, column), title)) in cells.texts.iter().zip(&columns).zip(&header.texts).enumerate() {
                match (text.parse::<f64>(), column) {
                    (_, Column::Unknown) => {}
                    (Ok(value), Column::Plane(d)) if value.abs() <= LARGE => row.point[*d] = value,
                    (Ok(value), Column::Plane(_)) if value.is_finite() => {
                        let (column, at) = (title.clone(), cells.cell(k));
                        errors.push(GivenError::FarAway { line, column, value, limit: LARGE, at });
                    }
                    (Ok(value), Column::Joint(j)) if value.is_finite() => row.joints[*j] = Some(value),
                    _ => errors.push(GivenError::NotANumber {
                        line,
                        column: title.clone(),
                        text: text.clone(),
                        at: cells.cell(k),
                    }),
                }
            }
            if errors.is_empty() && rows.last().is_some_and(|before| before.point == row.point) {
                errors.push(GivenError::RepeatedPoint { line, at });
            }
            rows.push(row);
        }
        if errors.is_empty() && rows.len() < 2 {
            errors.push(GivenError::TooFewRows { name: name.to_owned(), rows: rows.len() });
        }
        if errors.is_empty() { Ok(Self { rows }) } else { Err(errors) }
    }

    /// Whether every joint stays in its range, `pieces` being the splines through the rows: they may overshoot between rows.
    ///
    /// # Errors
    /// The first row of every joint from which its spline leaves the range.
    pub fn check_joint_ranges(&self, pieces: &[Piece], robot: &RobotModel) -> Result<(), Vec<GivenError>> {
        let mut errors = Vec::new();
        for (j, joint) in robot.joints.iter().enumerate() {
            if self.rows[0].joints[j].is_none() {
                continue; // held at a value that the mission answers for
            }
            for (row, piece) in self.rows.iter().zip(pieces) {
                let worst = extremes(&piece.coefficients[2 + j], piece.duration)
                    .into_iter()
                    .map(|value| ((joint.lower - value).max(value - joint.upper), value))
                    .max_by(|a, b| a.0.total_cmp(&b.0));
                if let Some((_, value)) = worst.filter(|(over, _)| *over > 1e-9) {
                    let (lower, upper) = (joint.lower, joint.upper);
                    let (line, at) = (row.line, row.at.clone());
                    errors.push(GivenError::JointRange { line, joint: joint.name.clone(), value, lower, upper, at });
                    break; // one a joint says it
                }
            }
        }
        if errors.is_empty() { Ok(()) } else { Err(errors) }
    }
}

/// Values of a cubic at both ends of `0 ..= duration` and at its turning points between.
fn extremes(c: &[f64], duration: f64) -> Vec<f64> {
    let value = |u: f64| c.iter().rev().fold(0.0, |sum, c| sum * u + c);
    let [b, q, k] = [c[1], 2.0 * c[2], 3.0 * c[3]];
    let root = (q * q - 4.0 * k * b).max(0.0).sqrt();
    // Both roots of k u^2 + q u + b, without cancellation.
    let half = -0.5 * (q + root.copysign(q));
    let inside = [half / k, b / half].into_iter().filter(|u| *u > 0.0 && *u < duration);
    [0.0, duration].into_iter().chain(inside).map(value).collect()
}

fn read_header(header: &Cells, robot: &RobotModel, errors: &mut Vec<GivenError>) -> Vec<Column> {
    let joint_column =
        |joint: &MovingJoint| format!("joint.{}.pos_{}", joint.name, if joint.prismatic { "m" } else { "rad" });
    let mut known = vec![("x_m".to_owned(), Column::Plane(0)), ("y_m".to_owned(), Column::Plane(1))];
    known.extend(robot.joints.iter().enumerate().map(|(i, joint)| (joint_column(joint), Column::Joint(i))));
    let mut columns = Vec::new();
    for (k, title) in header.texts.iter().enumerate() {
        let (line, at) = (header.line, header.cell(k));
        match known.iter().find(|(name, _)| name == title) {
            Some((_, column)) if columns.contains(column) => {
                errors.push(GivenError::DoubleColumn { line, column: title.clone(), at });
                columns.push(Column::Unknown);
            }
            Some((_, column)) => columns.push(*column),
            None => {
                let meant = nearest(title, known.iter().map(|(name, _)| name.as_str())).map(str::to_owned);
                errors.push(GivenError::UnknownColumn { line, column: title.clone(), meant, at });
                columns.push(Column::Unknown);
            }
        }
    }
    columns
}

/// One line that holds cells.
struct Cells {
    line: usize,
    at: Span,
    texts: Vec<String>,
}

impl Cells {
    /// The place of cell `k`; of the row, where quotation marks hide it.
    fn cell(&self, k: usize) -> Span {
        let row = &self.at.source.text[self.at.range.clone()];
        let mut at = self.at.range.start;
        let found = row.split(',').enumerate().find_map(|(i, cell)| {
            let start = at + (cell.len() - cell.trim_start_matches(['\u{feff}', ' ', '\t', '"']).len());
            at += cell.len() + 1;
            (i == k).then(|| start..start + self.texts[k].len())
        });
        let same =
            |range: &std::ops::Range<usize>| self.at.source.text.get(range.clone()) == Some(self.texts[k].as_str());
        found.filter(same).map_or_else(|| self.at.clone(), |range| Span::new(&self.at.source, range))
    }
}

/// Lines of a text that hold cells, each with its place. `csv` reads the cells; it is given one line at a time because its own
/// positions do not survive comments and empty lines.
struct Lines<'a> {
    source: &'a Arc<Source>,
    at: usize,
    line: usize,
}

impl Iterator for Lines<'_> {
    type Item = Cells;

    fn next(&mut self) -> Option<Cells> {
        let text = &self.source.text;
        while self.at < text.len() {
            let start = self.at;
            let end = text[start..].find('\n').map_or(text.len(), |n| start + n);
            (self.at, self.line) = (end + 1, self.line + 1);
            let line = text[start..end].trim_start_matches('\u{feff}').trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let mut reader =
                csv::ReaderBuilder::new().has_headers(false).trim(csv::Trim::All).from_reader(line.as_bytes());
            let record = reader.records().next().and_then(Result::ok).unwrap_or_default();
            let texts = record.iter().map(str::to_owned).collect();
            return Some(Cells { line: self.line, at: Span::new(self.source, start..end), texts });
        }
        None
    }
}
