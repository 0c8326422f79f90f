//! Reads `commands.csv` back. Columns may come in any order; nothing else is tolerated, since a robot will drive this.

use std::ops::Range;
use std::sync::Arc;

use super::csv::{CsvHeader, FORMAT, joint_columns};
use crate::command::{CommandRow, CommandTable};
use crate::diag::{Diagnostic, Diagnostics, Source, Span, nearest, suggestion};
use crate::geom::Pose2;
use crate::report::names;
use crate::robot::{LARGEST_DIFFERENCE, WheelRadii};

/// Rows may be off `k * sampling_time` by this, s: rounding of other writers.
const TIME_TOLERANCE: f64 = 1e-9;
/// `v_mps` and `omega_rad_s` may be off what the wheels give by this, relative to the larger of it and 1.
const TWIST_TOLERANCE: f64 = 1e-9;
/// Faults reported at most: a file of another kind has one in each line.
const FAULTS: usize = 12;

/// The columns that are no joint's.
const FIXED: [&str; 8] =
    ["time_s", "wheel_left_rad_s", "wheel_right_rad_s", "v_mps", "omega_rad_s", "x_m", "y_m", "yaw_rad"];
/// The keys of the head, and those of them that may be missing.
const KEYS: [&str; 10] = [
    "format",
    "mission",
    "robot",
    "map",
    "sampling_time_s",
    "sampling",
    "wheel_radius_m",
    "wheel_difference",
    "track_width_m",
    "inputs_blake3",
];
const OPTIONAL: [&str; 2] = ["map", "wheel_difference"];

/// What to do with a file that is none of ours.
const WRITTEN: &str = "commands.csv is written by `trajc compile`";
/// What to do with a file that ends too early.
const CUT: &str =
    "was the file cut off? behind its head it has a line of column names, time_s,wheel_left_rad_s,…, and rows";

/// The columns that every file has.
fn needed() -> String {
    format!("needed are {}; joints have joint.NAME.pos_rad and .vel_rad_s, or .pos_m and .vel_mps", FIXED.join(", "))
}

/// A command file's table and head. `name` is the file's path as the user knows it.
///
/// # Errors
/// With the line each: a head that is not `trajc.commands/1` or lacks a key; missing, unknown or doubled columns; rows with
/// too few or too many cells; cells that are no finite number; times that do not increase or are not multiples of the
/// sampling time; `v_mps` or `omega_rad_s` that contradict the wheels.
pub fn read(name: &str, text: &str) -> Result<(CommandTable, CsvHeader), Diagnostics> {
    let (table, header, contradictions) = read_to_judge(name, text)?;
    if contradictions.is_empty() { Ok((table, header)) } else { Err(Diagnostics(contradictions)) }
}

/// As [`read`], but rows whose `v_mps` or `omega_rad_s` contradict their wheels are told beside, for who judges the wheels.
///
/// # Errors
/// All others of [`read`].
pub fn read_to_judge(name: &str, text: &str) -> Result<(CommandTable, CsvHeader, Vec<Diagnostic>), Diagnostics> {
    let source = Arc::new(Source { name: name.to_string(), text: text.to_string() });
    let lines = lines(&source.text);
    let mut reader = Reader { lines, source: &source, faults: Vec::new(), contradictions: Vec::new() };
    match reader.read() {
        Some((table, header)) if reader.faults.is_empty() => Ok((table, header, reader.contradictions)),
        _ => {
            reader.faults.extend(reader.contradictions);
            reader.faults.truncate(FAULTS);
            Err(Diagnostics(reader.faults))
        }
    }
}

/// Byte ranges of the lines that are not blank, without their ends.
fn lines(text: &str) -> Vec<Range<usize>> {
    let mut at = 0;
    let mut lines = Vec::new();
    for line in text.split_inclusive('\n') {
        let kept = line.trim_end_matches(['\n', '\r']);
        if !kept.trim().is_empty() {
            lines.push(at..at + kept.len());
        }
        at += line.len();
    }
    lines
}

struct Reader<'a> {
    source: &'a Arc<Source>,
    lines: Vec<Range<usize>>,
    faults: Vec<Diagnostic>,
    contradictions: Vec<Diagnostic>,
}

/// Values of the head.
struct Head {
    header: CsvHeader,
    sampling_time: f64,
    sampling: crate::mission::Sampling,
    wheel_radii: WheelRadii,
    track_width: f64,
}

/// Where the columns are.
struct Columns {
    names: Vec<String>,
    fixed: [usize; FIXED.len()],
    joints: Vec<JointColumns>,
}

struct JointColumns {
    name: String,
    prismatic: bool,
    position: usize,
    velocity: usize,
}

impl Reader<'_> {
    fn text(&self, range: &Range<usize>) -> &str {
        &self.source.text[range.clone()]
    }

    fn fault(&mut self, code: &'static str, message: String, range: Range<usize>, hint: impl Into<String>) {
        if self.faults.len() < FAULTS {
            let fault = Diagnostic::error(code, message).at(&Span::new(self.source, range));
            self.faults.push(fault.hint(hint));
        }
    }

    /// The range of cell `k` of a line.
    fn cell(&self, line: &Range<usize>, k: usize) -> Range<usize> {
        let mut at = line.start;
        let cells = self.text(line).split(',').map(|cell| {
            let start = at + (cell.len() - cell.trim_start().len());
            at += cell.len() + 1;
            start..start + cell.trim().len()
        });
        cells.into_iter().nth(k).unwrap_or_else(|| line.clone())
    }

    fn read(&mut self) -> Option<(CommandTable, CsvHeader)> {
        if self.lines.is_empty() {
            self.fault("commands/format", "this is no command file: it is empty".into(), 0..0, WRITTEN);
            return None;
        }
        let notes = self.lines.iter().take_while(|l| self.text(l).starts_with('#')).count();
        let head = self.head(notes);
        if self.faults.iter().any(|fault| fault.code == "commands/format") {
            return None;
        }
        let Some(names) = self.lines.get(notes).cloned() else {
            let end = self.source.text.len();
            self.fault("commands/no-columns", "the file ends before the column names".into(), end..end, CUT);
            return None;
        };
        let columns = self.columns(names)?;
        let head = head?;
        let mut table = CommandTable {
            sampling_time: head.sampling_time,
            sampling: head.sampling,
            wheel_radii: head.wheel_radii,
            track_width: head.track_width,
            joints: columns.joints.iter().map(|j| (j.name.clone(), j.prismatic)).collect(),
            rows: Vec::with_capacity(self.lines.len() - notes - 1),
        };
        let mut last = f64::NEG_INFINITY;
        let before = self.faults.len();
        for i in notes + 1..self.lines.len() {
            let cells = self.cells(i, &columns.names);
            if self.faults.len() >= FAULTS {
                break;
            }
            // Behind a row that cannot be read, all times would seem to be wrong.
            if let Some(cells) = cells.filter(|_| self.faults.len() == before) {
                self.row(i, &cells, &columns, &mut table, &mut last);
            }
        }
        if table.rows.is_empty() && self.faults.len() == before {
            let end = self.source.text.len();
            self.fault("commands/no-rows", "the file has no row below the column names".into(), end..end, CUT);
        }
        Some((table, head.header))
    }

    fn head(&mut self, notes: usize) -> Option<Head> {
        let mut found: Vec<(&'static str, String, Range<usize>)> = Vec::new();
        // Keys whose lines are told to be wrong: that they are missing is no news.
        let mut told: Vec<&str> = Vec::new();
        for i in 0..notes {
            let range = self.lines[i].clone();
            let line = self.text(&range)[1..].to_string();
            let Some((key, value)) = line.split_once(':') else {
                let word = line.split_whitespace().next().unwrap_or_default();
                told.extend(KEYS.iter().find(|key| **key == word));
                let message =
                    format!("a line of the head must be `# key: value`, found `{}`", self.text(&range).trim_end());
                self.fault(
                    "commands/head",
                    message,
                    range,
                    "a colon separates key and value; a command file has no other comments",
                );
                continue;
            };
            let (key, value) = (key.trim(), value.trim().to_string());
            match KEYS.iter().find(|known| **known == key) {
                None => {
                    let hint = suggestion(key, KEYS, "known keys are", "");
                    told.extend(nearest(key, KEYS));
                    self.fault("commands/head", format!("unknown key `{key}` in the head"), range, hint);
                }
                Some(known) if found.iter().any(|(k, ..)| k == known) => {
                    let message = format!("`{key}` is given twice in the head");
                    self.fault("commands/head", message, range, "keep one of the two lines");
                }
                Some(known) => found.push((known, value, range)),
            }
        }
        let top = self.lines.first().cloned().unwrap_or(0..0);
        let is_ours = |value: &String| value == FORMAT;
        match found.iter().find(|(key, ..)| *key == "format").cloned() {
            None => {
                let message = format!("this is no command file: no line `# format: {FORMAT}` at its top");
                // What follows from that is no news.
                self.faults.clear();
                self.fault("commands/format", message, top, WRITTEN);
                return None;
            }
            Some((_, value, range)) if !is_ours(&value) => {
                self.faults.clear();
                let message = format!("format is `{value}`, this program reads `{FORMAT}`");
                self.fault("commands/format", message, range, "compile it again with this version of trajc");
                return None;
            }
            Some(_) => {}
        }
        for key in KEYS.into_iter().filter(|key| !OPTIONAL.contains(key) && !told.contains(key)) {
            if !found.iter().any(|(k, ..)| *k == key) {
                let hint = "add it as the file had it when `trajc compile` wrote it, or compile again";
                self.fault("commands/head", format!("the head has no `# {key}: …`"), top.clone(), hint);
            }
        }
        let get =
            |key: &str| found.iter().find(|(k, ..)| *k == key).map(|(_, value, range)| (value.clone(), range.clone()));
        let text = |key: &str| get(key).map(|(value, _)| value);
        let sampling_time = get("sampling_time_s").and_then(|found| self.positive("sampling_time_s", found));
        let wheel_radius = get("wheel_radius_m").and_then(|found| self.positive("wheel_radius_m", found));
        let wheel_difference = match get("wheel_difference") {
            Some((value, range)) => {
                let share = value.parse::<f64>().ok().filter(|share| share.abs() <= LARGEST_DIFFERENCE);
                if share.is_none() {
                    let message = format!("wheel_difference is `{value}`, must be a share from -0.1 to 0.1");
                    self.fault("commands/head", message, range, "write the share as the file had it, such as 0.002");
                }
                share
            }
            None => Some(0.0),
        };
        let track_width = get("track_width_m").and_then(|found| self.positive("track_width_m", found));
        let sampling = get("sampling").and_then(|(value, range)| {
            let sampling = names::parse_sampling(&value);
            if sampling.is_none() {
                let known = names::SAMPLINGS.map(|(_, name)| name).join(", ");
                let hint = suggestion(&value, names::SAMPLINGS.map(|(_, name)| name), "samplings are", "");
                self.fault("commands/head", format!("sampling is `{value}`, must be one of {known}"), range, hint);
            }
            sampling
        });
        Some(Head {
            header: CsvHeader {
                mission: text("mission")?,
                robot: text("robot")?,
                map: text("map"),
                inputs_blake3: text("inputs_blake3")?,
            },
            sampling_time: sampling_time?,
            sampling: sampling?,
            wheel_radii: WheelRadii { mean: wheel_radius?, difference: wheel_difference? },
            track_width: track_width?,
        })
    }

    fn positive(&mut self, key: &str, (value, range): (String, Range<usize>)) -> Option<f64> {
        let number = value.parse::<f64>().ok().filter(|v| v.is_finite() && *v > 0.0);
        if number.is_none() {
            let unit = if key.ends_with("_s") { "seconds" } else { "metres" };
            let message = format!("{key} is `{value}`, must be a number above 0");
            self.fault("commands/head", message, range, format!("write it in {unit}, such as `# {key}: 0.1`"));
        }
        number
    }

    fn columns(&mut self, range: Range<usize>) -> Option<Columns> {
        let line = self.text(&range).to_string();
        let mut reader = ::csv::ReaderBuilder::new().has_headers(false).from_reader(line.as_bytes());
        let names: Vec<String> = match reader.records().next() {
            Some(Ok(record)) => record.iter().map(|name| name.trim().to_string()).collect(),
            _ => Vec::new(),
        };
        let before = self.faults.len();
        let mut joints: Vec<JointColumns> = Vec::new();
        for (at, name) in names.iter().enumerate() {
            let place = self.cell(&range, at);
            if names[..at].contains(name) {
                let message = format!("column `{name}` is there twice");
                self.fault("commands/column", message, place, "remove one of the two columns");
            } else if let Some((joint, prismatic)) = position_column(name) {
                let [_, velocity] = joint_columns(joint, prismatic);
                let found = names.iter().position(|n| *n == velocity);
                match found {
                    None => {
                        let message = format!("column `{name}` is there without `{velocity}`");
                        self.fault(
                            "commands/column",
                            message,
                            place,
                            "a joint has two columns, its position and speed: add the other",
                        );
                    }
                    Some(_) if joints.iter().any(|j| j.name == joint) => {
                        self.fault(
                            "commands/column",
                            format!("joint `{joint}` has columns in rad and in m"),
                            place,
                            "a joint turns (rad) or slides (m): remove the others",
                        );
                    }
                    Some(velocity) => {
                        joints.push(JointColumns { name: joint.to_string(), prismatic, position: at, velocity })
                    }
                }
            } else if !FIXED.contains(&name.as_str()) && !self.known_velocity(name, &names, &place) {
                let hint = nearest(name, FIXED).map_or_else(needed, |known| format!("did you mean `{known}`?"));
                self.fault("commands/column", format!("unknown column `{name}`"), place, hint);
            }
        }
        let fixed = FIXED.map(|name| {
            names.iter().position(|n| n == name).unwrap_or_else(|| {
                // An unknown column that is near to it was told with that hint; once is enough.
                if !names.iter().any(|n| !FIXED.contains(&n.as_str()) && nearest(n, FIXED) == Some(name)) {
                    self.fault("commands/column", format!("no column `{name}`"), range.clone(), needed());
                }
                0
            })
        });
        (self.faults.len() == before).then_some(Columns { names, fixed, joints })
    }

    /// Whether this is a joint's velocity; without its position column that is a fault of its own.
    fn known_velocity(&mut self, name: &str, names: &[String], range: &Range<usize>) -> bool {
        let Some(rest) = name.strip_prefix("joint.") else { return false };
        for (suffix, prismatic) in [(".vel_rad_s", false), (".vel_mps", true)] {
            if let Some(joint) = rest.strip_suffix(suffix).filter(|joint| !joint.is_empty()) {
                let [position, _] = joint_columns(joint, prismatic);
                if !names.contains(&position) {
                    let message = format!("column `{name}` is there without `{position}`");
                    let hint = "a joint has two columns, its position and speed: add the other";
                    self.fault("commands/column", message, range.clone(), hint);
                }
                return true;
            }
        }
        false
    }

    /// The finite numbers of line `i`.
    fn cells(&mut self, i: usize, names: &[String]) -> Option<Vec<f64>> {
        let count = names.len();
        let range = self.lines[i].clone();
        let mut at = range.start;
        let mut ranges = Vec::with_capacity(count);
        for cell in self.text(&range).split(',') {
            ranges.push(at..at + cell.len());
            at += cell.len() + 1;
        }
        if ranges.len() != count {
            let message = format!("the row has {} cells, the header {count}", ranges.len());
            let hint = "a row has one cell for each column; was the file cut off or edited?";
            self.fault("commands/row", message, range, hint);
            return None;
        }
        let mut values = Vec::with_capacity(count);
        for (k, range) in ranges.into_iter().enumerate() {
            let cell = self.text(&range).trim();
            match cell.parse::<f64>() {
                Ok(value) if value.is_finite() => values.push(value),
                _ => {
                    let message = format!("`{cell}` is no finite number");
                    let hint = format!("column `{}` needs one in every row", names[k]);
                    self.fault("commands/number", message, range, hint);
                    return None;
                }
            }
        }
        Some(values)
    }

    fn row(&mut self, i: usize, cells: &[f64], columns: &Columns, table: &mut CommandTable, last: &mut f64) {
        let range = self.lines[i].clone();
        let [time, left, right, v, omega, x, y, yaw] = columns.fixed.map(|at| cells[at]);
        let k = table.rows.len();
        table.rows.push(CommandRow {
            wheel_left: left,
            wheel_right: right,
            joint_positions: columns.joints.iter().map(|j| cells[j.position]).collect(),
            joint_velocities: columns.joints.iter().map(|j| cells[j.velocity]).collect(),
            pose: Pose2::new(x, y, yaw),
        });
        let wanted = table.time(k);
        if time <= *last {
            let message = format!("time_s does not increase: {time} s after {last} s");
            self.fault(
                "commands/time",
                message,
                self.cell(&range, columns.fixed[0]),
                "rows follow each other in time, `sampling_time_s` apart",
            );
        } else if (time - wanted).abs() > TIME_TOLERANCE {
            let message = format!(
                "time_s is {time} s, row {k} of a file sampled each {} s is at {wanted} s",
                table.sampling_time
            );
            let hint = "rows are `sampling_time_s` of the head apart, from 0 on: none may be missing";
            self.fault("commands/time", message, self.cell(&range, columns.fixed[0]), hint);
        }
        *last = time;
        let (held_v, held_omega) = table.twist(k);
        for (name, said, held) in [("v_mps", v, held_v), ("omega_rad_s", omega, held_omega)] {
            let agree = (said - held).abs() <= TWIST_TOLERANCE * held.abs().max(1.0);
            if !agree && self.contradictions.len() < FAULTS {
                let message = format!(
                    "{name} is {said}, but the wheels of this row (wheel_left_rad_s {left}, wheel_right_rad_s {right}) give {held}"
                );
                let at = columns.names.iter().position(|n| n == name).map_or(range.clone(), |k| self.cell(&range, k));
                let fault = Diagnostic::error("commands/contradiction", message).at(&Span::new(self.source, at));
                self.contradictions.push(fault.hint("the wheels are what is driven; twists must follow from them"));
            }
        }
    }
}

/// The joint of a position column, and whether it is prismatic.
fn position_column(name: &str) -> Option<(&str, bool)> {
    let rest = name.strip_prefix("joint.")?;
    let found = rest.strip_suffix(".pos_rad").map(|j| (j, false)).or(rest.strip_suffix(".pos_m").map(|j| (j, true)));
    found.filter(|(joint, _)| !joint.is_empty())
}

#[cfg(test)]
mod tests;
