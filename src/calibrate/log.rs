//! A log of wheel angles and poses, and its CSV form.

use std::ops::Range;
use std::sync::Arc;

use crate::diag::{Describe, Diagnostic, Source, Span, nearest};
use crate::geom::Pose2;

/// The columns, in any order; more are ignored.
const COLUMNS: [&str; 6] = ["time_s", "wheel_left_rad", "wheel_right_rad", "x_m", "y_m", "yaw_rad"];

/// Wheel angles and poses over one clock.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Log {
    /// Time (s) and angles (rad) of the left and the right wheel, not wrapped, in order of time.
    pub wheels: Vec<(f64, [f64; 2])>,
    /// Time (s) and pose, in order of time.
    pub poses: Vec<(f64, Pose2)>,
}

/// What is wrong with a log's text, and where.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum LogError {
    /// There is no row of names.
    #[error("the log is empty, expected a row of column names")]
    NoHeader {
        /// The end of the text.
        at: Span,
    },
    /// A column is missing.
    #[error("no column `{name}`: the header has {found}")]
    Column {
        /// Its name.
        name: &'static str,
        /// The names that are there.
        found: String,
        /// The nearest of them, if it may have been meant.
        near: Option<String>,
        /// It, else the header.
        at: Span,
    },
    /// A row of another length.
    #[error("the row has {found} cells, the header {expected}")]
    Ragged {
        /// Cells of the row.
        found: usize,
        /// Cells of the header.
        expected: usize,
        /// The row.
        at: Span,
    },
    /// A cell that is no number; an empty one is none.
    #[error("`{text}` in column `{column}` is no finite number")]
    Number {
        /// The column.
        column: &'static str,
        /// What stands there.
        text: String,
        /// The cell.
        at: Span,
    },
    /// A row without time.
    #[error("the row has no time in column `time_s`")]
    NoTime {
        /// The row.
        at: Span,
    },
    /// Time goes back.
    #[error("time does not increase: {time} s after {before} s")]
    Time {
        /// Of the row, s.
        time: f64,
        /// Of the row before, s.
        before: f64,
        /// The cell.
        at: Span,
    },
    /// The row has neither both wheels nor a whole pose.
    #[error("the row has neither both wheel angles nor x, y and yaw")]
    Empty {
        /// The row.
        at: Span,
    },
}

impl Describe for LogError {
    fn diagnostic(&self) -> Diagnostic {
        let header = format!("the header is {}, in any order; more columns are ignored", COLUMNS.join(","));
        let (at, hint) = match self {
            Self::NoHeader { at } => (at, header),
            Self::Column { near: Some(near), name, at, .. } => {
                (at, format!("did you mean `{name}` by `{near}`? {header}"))
            }
            Self::Column { at, .. } => (at, header),
            Self::Ragged { at, .. } => (at, "a cell may be empty, but its comma must be there".into()),
            Self::Number { column, at, .. } => {
                let unit = if column.ends_with("_m") {
                    "metres"
                } else if column.ends_with("_s") {
                    "seconds"
                } else {
                    "radians"
                };
                (at, format!("write {unit} in `{column}`, decimals with a point, or leave the cell empty"))
            }
            Self::NoTime { at } => (at, "every row needs its time, in seconds".into()),
            Self::Time { at, .. } => (at, "sort the rows by time, and keep one of those with the same".into()),
            Self::Empty { at } => (
                at,
                "fill `wheel_left_rad` and `wheel_right_rad`, or `x_m`, `y_m` and `yaw_rad`, or remove the row".into(),
            ),
        };
        Diagnostic::error("calibrate/log", self).at(at).hint(hint)
    }
}

/// A line that holds cells.
struct Row {
    source: Arc<Source>,
    range: Range<usize>,
    cells: Vec<String>,
}

impl Row {
    fn at(&self) -> Span {
        Span::new(&self.source, self.range.clone())
    }

    /// The place of a cell; of the row, where quotation marks hide it.
    fn cell(&self, k: usize) -> Span {
        let row = &self.source.text[self.range.clone()];
        let mut at = self.range.start;
        let found = row.split(',').enumerate().find_map(|(i, cell)| {
            let start = at + (cell.len() - cell.trim_start().len());
            at += cell.len() + 1;
            (i == k).then(|| start..start + cell.trim().len())
        });
        let same = |range: &Range<usize>| self.source.text.get(range.clone()) == self.cells.get(k).map(String::as_str);
        found.filter(same).map_or_else(|| self.at(), |range| Span::new(&self.source, range))
    }
}

/// Lines that hold cells. `csv` reads them one at a time: its own positions do not survive comments.
fn rows(source: &Arc<Source>) -> impl Iterator<Item = Row> + '_ {
    let mut at = 0;
    source.text.split_inclusive('\n').filter_map(move |line| {
        let start = at + (line.len() - line.trim_start_matches('\u{feff}').len());
        at += line.len();
        let kept = source.text[start..at].trim_end();
        if kept.trim_start().is_empty() || kept.trim_start().starts_with('#') {
            return None;
        }
        let mut reader =
            ::csv::ReaderBuilder::new().has_headers(false).trim(::csv::Trim::All).from_reader(kept.as_bytes());
        let record = reader.records().next().and_then(Result::ok).unwrap_or_default();
        let cells = record.iter().map(str::to_owned).collect();
        Some(Row { source: source.clone(), range: start..start + kept.len(), cells })
    })
}

/// A log from CSV with the columns `time_s`, `wheel_left_rad`, `wheel_right_rad`, `x_m`, `y_m`, `yaw_rad`. A row may leave its pose or its wheels
/// empty; lines that begin with `#` are comments. `name` is the file's path as the user knows it.
///
/// # Errors
/// A missing column, rows of another length, cells that are no numbers, time that goes back.
pub fn read_csv(name: &str, text: &str) -> Result<Log, LogError> {
    let source = Arc::new(Source { name: name.to_owned(), text: text.to_owned() });
    let mut rows = rows(&source);
    let end = text.len();
    let header = rows.next().ok_or_else(|| LogError::NoHeader { at: Span::new(&source, end..end) })?;
    let mut places = [0; COLUMNS.len()];
    for (place, name) in places.iter_mut().zip(COLUMNS) {
        *place = header.cells.iter().position(|head| head == name).ok_or_else(|| {
            let strange = header.cells.iter().map(String::as_str).filter(|head| !COLUMNS.contains(head));
            let near = nearest(name, strange).map(str::to_owned);
            let at = header.cells.iter().position(|head| Some(head) == near.as_ref());
            let at = at.map_or_else(|| header.at(), |k| header.cell(k));
            LogError::Column { name, found: header.cells.join(", "), near, at }
        })?;
    }
    let mut log = Log::default();
    let mut before = f64::NEG_INFINITY;
    for row in rows {
        let (found, expected) = (row.cells.len(), header.cells.len());
        if found != expected {
            return Err(LogError::Ragged { found, expected, at: row.at() });
        }
        let mut cells = [None; COLUMNS.len()];
        for ((cell, place), column) in cells.iter_mut().zip(places).zip(COLUMNS) {
            let text = row.cells[place].as_str();
            if !text.is_empty() {
                let value = text.parse().ok().filter(|v: &f64| v.is_finite());
                let wrong = || LogError::Number { column, text: text.to_owned(), at: row.cell(place) };
                *cell = Some(value.ok_or_else(wrong)?);
            }
        }
        let [time, left, right, x, y, yaw] = cells;
        let time = time.ok_or_else(|| LogError::NoTime { at: row.at() })?;
        if time <= before {
            return Err(LogError::Time { time, before, at: row.cell(places[0]) });
        }
        before = time;
        let wheels = left.zip(right);
        let pose = x.zip(y).zip(yaw);
        if wheels.is_none() && pose.is_none() {
            return Err(LogError::Empty { at: row.at() });
        }
        log.wheels.extend(wheels.map(|(left, right)| (time, [left, right])));
        log.poses.extend(pose.map(|((x, y), yaw)| (time, Pose2::new(x, y, yaw))));
    }
    Ok(log)
}

impl Log {
    /// Whether wheel angles are known then.
    pub(super) fn covers(&self, time: f64) -> bool {
        let ends = self.wheels.first().zip(self.wheels.last());
        ends.is_some_and(|(first, last)| first.0 <= time && time <= last.0)
    }

    /// Angles at a time that is covered: linear between two rows.
    fn angles(&self, time: f64) -> [f64; 2] {
        let next = self.wheels.partition_point(|(at, _)| *at < time).clamp(1, self.wheels.len().max(2) - 1);
        let ((from, a), (to, b)) = (self.wheels[next - 1], self.wheels[next]);
        let share = ((time - from) / (to - from)).clamp(0.0, 1.0);
        [0, 1].map(|k| a[k] + share * (b[k] - a[k]))
    }

    /// Increments of the angles between two times that are covered.
    pub(super) fn turns(&self, from: f64, to: f64) -> Vec<[f64; 2]> {
        if self.wheels.len() < 2 {
            return Vec::new();
        }
        let inside = self.wheels.iter().skip_while(|(at, _)| *at <= from).take_while(|(at, _)| *at < to);
        let angles: Vec<[f64; 2]> = std::iter::once(self.angles(from))
            .chain(inside.map(|(_, angles)| *angles))
            .chain([self.angles(to)])
            .collect();
        angles.windows(2).map(|w| [w[1][0] - w[0][0], w[1][1] - w[0][1]]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_may_have_wheels_or_a_pose_or_both() {
        let text = "# robot 7\nyaw_rad,time_s,wheel_left_rad,wheel_right_rad,x_m,y_m,note\n\
                    ,0,1,2,,,a\n0.5,0.1,,,3,4,b\n0.6,0.2,2,4,5,6,c\n";
        let log = read_csv("a.csv", text).expect("a log");
        assert_eq!(log.wheels, [(0.0, [1.0, 2.0]), (0.2, [2.0, 4.0])]);
        assert_eq!(log.poses, [(0.1, Pose2::new(3.0, 4.0, 0.5)), (0.2, Pose2::new(5.0, 6.0, 0.6))]);
        assert_eq!(log.turns(0.05, 0.15), [[0.5, 1.0]]);
        assert!(log.covers(0.2) && !log.covers(0.21));
    }

    #[test]
    fn faults_are_told_with_their_line_and_column() {
        let head = "# robot 7\ntime_s,wheel_left_rad,wheel_right_rad,x_m,y_m,yaw_rad\n";
        let told = |text: &str| {
            let fault = read_csv("a.csv", text).expect_err("a fault").diagnostic();
            let at = fault.at.expect("a place");
            (at.source.text[at.range].to_owned(), fault.message)
        };
        let row = |rows: &str| told(&format!("{head}{rows}")).0;
        assert_eq!(told("").0, "");
        assert_eq!(told("time_s,wheel_left,x_m\n").0, "wheel_left");
        assert_eq!(row("0,1,NaN,0,0,0\n"), "NaN");
        assert_eq!(row("0,1,1,0,0,0\n# again\n0.0,1,1,0,0,0\n"), "0.0");
        assert_eq!(row("0,1,,0,,0\n"), "0,1,,0,,0");
        assert_eq!(row(",1,1,0,0,0\n"), ",1,1,0,0,0");
        assert_eq!(row("0,1,1\n"), "0,1,1");
        assert!(told(&format!("{head}0,1,1,0,0,0\n0,1,1,0,0,0\n")).1.contains("0 s after 0 s"));
    }
}
