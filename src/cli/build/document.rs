//! What `build` says: one document, printed as a table or as JSON.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::Serialize;

use super::state::{Ended, Reason};
use crate::report::summary::figure;

/// The value of `schema`.
const SCHEMA: &str = "trajc.build/1";

/// What a build did, or with `--dry-run` would do.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Document {
    /// Always `trajc.build/1`.
    pub schema: String,
    /// The folder of output folders.
    pub out: PathBuf,
    /// Nothing was written.
    pub dry_run: bool,
    /// Of the program: the worst of all missions.
    pub exit_code: u8,
    /// How many missions there are of each status; those that there are.
    pub totals: Totals,
    /// All missions, in their order.
    pub missions: Vec<Row>,
}

/// How many missions there are of each status.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, JsonSchema)]
pub struct Totals {
    /// Compiled now, and certified.
    pub certified: usize,
    /// Nothing to do.
    pub up_to_date: usize,
    /// Would be compiled; with `--dry-run` only.
    pub to_compile: usize,
    /// Compiled now, without a certificate.
    pub failed: usize,
    /// Not compiled: they failed before, and nothing has changed since.
    pub failed_before: usize,
    /// Not begun, since another mission failed.
    pub not_tried: usize,
}

/// What became of a mission.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RowStatus {
    /// Compiled now, and certified.
    Certified,
    /// Certified before, and nothing has changed since.
    UpToDate,
    /// Would be compiled; with `--dry-run` only.
    ToCompile,
    /// Compiled now, without a certificate.
    Failed,
    /// Failed before, and nothing has changed since.
    FailedBefore,
    /// Not begun, since another mission failed.
    NotTried,
}

impl RowStatus {
    fn word(self) -> &'static str {
        match self {
            Self::Certified => "certified",
            Self::UpToDate => "up to date",
            Self::ToCompile => "to compile",
            Self::Failed => "FAILED",
            Self::FailedBefore => "failed before",
            Self::NotTried => "not tried",
        }
    }
}

/// A mission.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Row {
    /// Its name.
    pub mission: String,
    /// Its file.
    pub path: PathBuf,
    /// Its output folder.
    pub folder: PathBuf,
    /// What became of it.
    pub status: RowStatus,
    /// What `compile` would end with; 0 also where it was not begun.
    pub exit_code: u8,
    /// Why it was compiled, or would be; empty where it was not.
    pub why: Vec<String>,
    /// Seconds that it took to compile it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time_s: Option<f64>,
    /// Proven clearance, m; absent without commands, or without a map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clearance_m: Option<f64>,
    /// How long the commands are, s; absent without commands.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    /// Why there are no commands.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<Reason>,
}

impl Row {
    /// Puts in how the mission ended, now or before.
    pub fn end(&mut self, status: RowStatus, ended: Ended) {
        let Ended { clearance_m, duration_s, failure, .. } = ended;
        self.status = status;
        self.clearance_m = clearance_m;
        self.duration_s = duration_s;
        self.failure = failure;
    }
}

impl Document {
    /// Counts.
    pub fn new(out: PathBuf, dry_run: bool, exit_code: u8, missions: Vec<Row>) -> Self {
        let mut totals = Totals::default();
        for row in &missions {
            let count = match row.status {
                RowStatus::Certified => &mut totals.certified,
                RowStatus::UpToDate => &mut totals.up_to_date,
                RowStatus::ToCompile => &mut totals.to_compile,
                RowStatus::Failed => &mut totals.failed,
                RowStatus::FailedBefore => &mut totals.failed_before,
                RowStatus::NotTried => &mut totals.not_tried,
            };
            *count += 1;
        }
        Self { schema: SCHEMA.to_owned(), out, dry_run, exit_code, totals, missions }
    }

    /// As JSON, with a line break at its end.
    pub fn to_json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self).expect("names and numbers");
        text.push('\n');
        text
    }

    /// As a table, and a line that counts. `keep_going` was asked for.
    pub fn to_text(&self, keep_going: bool) -> String {
        let mut lines = vec![["mission", "status", "time", "clearance", "duration", "why"].map(str::to_owned)];
        lines.extend(self.missions.iter().map(cells));
        // Times below 100 s leave the columns where they are.
        let mut widths = [0, 0, "99.99 s".len(), 0, 0];
        for line in &lines {
            for (width, cell) in widths.iter_mut().zip(line) {
                *width = cell.chars().count().max(*width);
            }
        }
        let mut out = String::new();
        for line in &lines {
            let mut text = String::new();
            for (column, (cell, width)) in line.iter().zip(&widths).enumerate() {
                let pad = " ".repeat(width - cell.chars().count());
                // Words to the left, figures to the right.
                text += &if column < 2 { format!("{cell}{pad}  ") } else { format!("{pad}{cell}  ") };
            }
            text += &line[5];
            out += text.trim_end();
            out.push('\n');
        }
        out.push('\n');
        out + &self.counted(keep_going)
    }

    fn counted(&self, keep_going: bool) -> String {
        let Totals { certified, up_to_date, to_compile, failed, failed_before, not_tried } = self.totals;
        let parts = [
            (certified, "certified"),
            (up_to_date, "up to date"),
            (to_compile, "to compile"),
            (failed, "failed"),
            (failed_before, "failed before, inputs unchanged"),
            (not_tried, "not tried"),
        ];
        let shown: Vec<String> =
            parts.iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")).collect();
        let mut out = shown.join(", ");
        if self.dry_run {
            out += "; nothing was written";
        }
        out.push('\n');
        if not_tried > 0 && !keep_going {
            out += "-k goes on where a mission fails\n";
        }
        if failed_before > 0 {
            out += "--force compiles again what failed before; why it failed: report.html in its folder\n";
        }
        out
    }
}

fn cells(row: &Row) -> [String; 6] {
    let none = || "-".to_owned();
    let why = match (&row.failure, row.status) {
        (Some(failure), RowStatus::Failed | RowStatus::FailedBefore) => failure.reason.clone(),
        (_, RowStatus::ToCompile | RowStatus::NotTried) => row.why.join("; "),
        _ => String::new(),
    };
    [
        row.mission.clone(),
        row.status.word().to_owned(),
        row.time_s.map_or_else(none, |time| format!("{time:.2} s")),
        row.clearance_m.map_or_else(none, |clearance| format!("{} mm", figure(1e3 * clearance))),
        row.duration_s.map_or_else(none, |duration| format!("{} s", figure(duration))),
        why,
    ]
}

/// The JSON Schema of the document.
pub fn json_schema() -> String {
    let mut text = serde_json::to_string_pretty(&schemars::schema_for!(Document)).expect("a schema is plain JSON");
    text.push('\n');
    text
}
