//! `trajc path-error COMMANDS or MISSION`.

use std::path::{Path, PathBuf};

use super::check::{mission_of, read_commands};
use super::compile::seconds;
use super::inputs;
use super::terminal::Terminal;
use crate::diag::{Diagnostic, Diagnostics};
use crate::emit::csv;
use crate::pipeline::{self, CompileOptions};
use crate::report::PathErrorRow;

/// Measure how far held commands leave the path, against the sampling time.
///
/// Of a mission: compiles it and samples its motion at each time; writes no file. Of a command file: measures the file as it is
/// written against its mission's given path, or its own planned poses where the path was planned; with --sampling-times it also
/// compiles the mission.
///
/// Exit 0: measured. 1: the mission has no certified motion. 2: bad input or usage.
#[derive(Debug, clap::Args)]
pub struct PathErrorArgs {
    /// A mission (.yaml) or a command file (.csv, .mcap).
    file: PathBuf,
    /// Sampling times in seconds, separated by commas [default: the mission's].
    #[arg(long, value_name = "S", value_delimiter = ',', value_parser = seconds)]
    sampling_times: Vec<f64>,
    /// Print CSV, as in path_error.csv.
    #[arg(long)]
    csv: bool,
    /// Print JSON, as in report.json.
    #[arg(long, conflicts_with = "csv")]
    json: bool,
}

/// Measures.
///
/// # Errors
/// Bad input, or a mission that has no trajectory.
pub fn path_error(args: &PathErrorArgs, terminal: &mut Terminal) -> Result<u8, Diagnostics> {
    let rows = if is_mission(&args.file) {
        let (mut inputs, _) = inputs::read(&args.file)?;
        of_mission(args, &mut inputs, terminal)?
    } else {
        let file = read_commands(&args.file)?;
        let (mut inputs, _) = mission_of(&args.file, &file.header, None)?;
        let mut rows = vec![pipeline::path_error_of_commands(&mut inputs, &file.table)?];
        if !args.sampling_times.is_empty() {
            rows.extend(of_mission(args, &mut inputs, terminal)?);
        }
        rows
    };
    let text = if args.csv {
        csv::write_path_error(&rows)
    } else if args.json {
        format!("{:#}\n", serde_json::json!({ "path_error": rows }))
    } else {
        table(&rows)
    };
    terminal.print(&text);
    Ok(0)
}

fn is_mission(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("yaml") || e.eq_ignore_ascii_case("yml"))
}

fn of_mission(
    args: &PathErrorArgs,
    inputs: &mut pipeline::Inputs,
    terminal: &Terminal,
) -> Result<Vec<PathErrorRow>, Diagnostics> {
    if !args.sampling_times.is_empty() {
        inputs.mission.path_error_times.clone_from(&args.sampling_times);
    }
    let progress = terminal.progress(&inputs.mission.name.clone());
    let outcome = pipeline::compile(inputs, &CompileOptions::default(), &mut |stage| progress.stage(stage));
    match outcome.diagnostics {
        Some(diagnostics) => Err(diagnostics),
        None if outcome.report.path_error.is_empty() => {
            Err(Diagnostic::error("path-error/empty", "the mission asks for no sampling time").into())
        }
        None => Ok(outcome.report.path_error),
    }
}

fn table(rows: &[PathErrorRow]) -> String {
    let mut out =
        "sampling time  sampling   lateral max   lateral rms     end point   end heading    clearance\n".to_owned();
    let mm = |v: f64| format!("{:.4} mm", v * 1e3);
    for row in rows {
        let clearance = row.clearance_min_m.map_or("-".to_owned(), |c| format!("{:.1} mm", c * 1e3));
        out += &format!(
            "{:>11} s  {:<8} {:>13} {:>13} {:>13} {:>9.4} deg {:>12}\n",
            row.sampling_time_s,
            row.sampling,
            mm(row.lateral_max_m),
            mm(row.lateral_rms_m),
            mm(row.end_point_m),
            row.end_heading_rad.to_degrees(),
            clearance
        );
    }
    out
}
