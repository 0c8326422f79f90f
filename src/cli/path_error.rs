//! `trajc path-error COMMANDS or MISSION`.

use std::path::{Path, PathBuf};

use super::inputs::{
    self,
    commands::{self, Places},
};
use super::output::write_file;
use super::plot;
use super::products::seconds;
use super::terminal::Terminal;
use crate::diag::{Diagnostic, Diagnostics, nearest};
use crate::emit::csv;
use crate::mission::Sampling;
use crate::pipeline::{self, CompileOptions};
use crate::report::path_error::Within;
use crate::report::{PathErrorRow, names};

/// Measure how far held commands leave the path, against the sampling time.
///
/// Of a mission: compiles it and samples its motion at each time; writes no command file. Of a command file: measures the file as it is
/// written against its mission's given path, or its own planned poses where the path was planned; with --sampling-times, --sampling or
/// --max-error it also compiles the mission.
///
/// Exit 0: measured. 1: the mission has no certified motion. 2: bad input or usage.
#[derive(Debug, clap::Args)]
pub struct PathErrorArgs {
    /// A mission (.yaml) or a command file (.csv, .mcap).
    file: PathBuf,
    /// Sampling times in seconds, separated by commas [default: the mission's].
    #[arg(long, value_name = "S", value_delimiter = ',', value_parser = seconds)]
    sampling_times: Vec<f64>,
    /// How wheel speeds are sampled, separated by commas: tracked, mean, instant [default: the mission's].
    #[arg(long, value_name = "HOW", value_delimiter = ',', value_parser = sampling)]
    sampling: Vec<Sampling>,
    /// Find the largest sampling time up to 0.8 s with which the commands stay within this of the path, and end within this of its end: 5mm.
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    max_error: Option<f64>,
    /// The map's file of a command file, where it is not where its mission says.
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
    /// Draw the errors against the sampling time.
    #[arg(long, value_name = "FILE.svg")]
    plot: Option<PathBuf>,
    /// Print CSV, as in path_error.csv.
    #[arg(long)]
    csv: bool,
    /// Print JSON, as in report.json.
    #[arg(long, conflicts_with = "csv")]
    json: bool,
}

/// What was measured.
#[derive(Default)]
struct Measured {
    rows: Vec<PathErrorRow>,
    within: Vec<Within>,
}

/// Measures.
///
/// # Errors
/// Bad input, or a mission that has no trajectory.
pub fn path_error(args: &PathErrorArgs, terminal: &mut Terminal) -> Result<u8, Diagnostics> {
    let measured = if is_mission(&args.file) {
        let (mut inputs, _) = inputs::read(&args.file)?;
        of_mission(args, &mut inputs, terminal)?
    } else {
        let asked = !args.sampling_times.is_empty() || !args.sampling.is_empty() || args.max_error.is_some();
        let file = commands::read(&args.file)?;
        if !file.contradictions.is_empty() {
            return Err(Diagnostics(file.contradictions));
        }
        let places = Places { mission: None, map: args.map.as_deref() };
        let loaded = if asked { file.load(places)? } else { file.load_without_map(places)? };
        let own = pipeline::path_error_of_commands(&loaded.inputs, &loaded.world, &loaded.file.table)?;
        let mut inputs = loaded.inputs;
        let mut measured = if asked { of_mission(args, &mut inputs, terminal)? } else { Measured::default() };
        measured.rows.insert(0, own);
        measured
    };
    if let Some(path) = &args.plot {
        let figure = plot::path_error(&args.file.display().to_string(), &measured.rows, args.max_error);
        write_file(path, figure.to_svg().as_bytes())?;
    }
    let text = if args.csv {
        csv::write_path_error(&measured.rows)
    } else if args.json {
        let within: Vec<_> = measured.within.iter().map(json).collect();
        let mut value = serde_json::json!({ "path_error": measured.rows });
        if args.max_error.is_some() {
            value["max_error"] = within.into();
        }
        format!("{value:#}\n")
    } else {
        table(&measured.rows)
    };
    terminal.print(&text);
    if !args.json {
        // Beside CSV the answers are no rows of it.
        let lines: String = measured.within.iter().map(|answer| sentence(answer, args.csv)).collect();
        terminal.print(&lines);
    }
    Ok(0)
}

/// A sampling on the command line.
fn sampling(text: &str) -> Result<Sampling, String> {
    let known = [Sampling::Tracked, Sampling::Mean, Sampling::Instant];
    let found = known.into_iter().find(|known| names::sampling(*known) == text);
    found.ok_or_else(|| {
        let near = nearest(text, known.map(names::sampling)).unwrap_or("tracked");
        format!("expected tracked, mean or instant, such as {near}")
    })
}

/// A length on the command line, m.
fn length(text: &str) -> Result<f64, String> {
    let (number, unit) = [("mm", 1e-3), ("um", 1e-6), ("m", 1.0)]
        .into_iter()
        .find_map(|(unit, metres)| text.strip_suffix(unit).map(|number| (number, metres)))
        .unwrap_or((text, 1.0));
    match number.trim_end().parse::<f64>() {
        Ok(value) if value.is_finite() && value > 0.0 => Ok(value * unit),
        _ => Err("expected a length above zero, such as 5mm or 0.005 (m)".to_owned()),
    }
}

/// A small length with its unit: mm, below 0.1 mm um.
fn small(length: f64) -> String {
    if length < 1e-4 { format!("{:.3} um", length * 1e6) } else { format!("{:.4} mm", length * 1e3) }
}

/// The answer to `--max-error` in words.
fn sentence(answer: &Within, comment: bool) -> String {
    let error = |row: &crate::report::path_error::PathErrorRow| {
        let what = if row.lateral_max >= row.end_point { "beside the path" } else { "from its end" };
        format!("{} {what}", small(row.largest()))
    };
    let mut out = format!(
        "{}within {} ({}): ",
        if comment { "# " } else { "" },
        small(answer.bound),
        names::sampling(answer.sampling)
    );
    match &answer.row {
        Some(row) => {
            out += &format!("up to {} s ({}", row.sampling_time, error(row));
            if let Some(clearance) = row.clearance_min {
                out += &format!(", clearance {:.1} mm", clearance * 1e3);
            }
            out.push(')');
        }
        None => out += "at no sampling time",
    }
    if let Some(row) = &answer.beyond {
        out += &format!("; at {} s {}", row.sampling_time, error(row));
    }
    out.push('\n');
    out
}

fn json(answer: &Within) -> serde_json::Value {
    let row = |row: &crate::report::path_error::PathErrorRow| serde_json::json!(PathErrorRow::from(row));
    serde_json::json!({
        "max_error_m": answer.bound,
        "sampling": names::sampling(answer.sampling),
        "sampling_time_s": answer.row.as_ref().map(|row| row.sampling_time),
        "at": answer.row.as_ref().map(row),
        "beyond": answer.beyond.as_ref().map(row),
    })
}

fn is_mission(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("yaml") || e.eq_ignore_ascii_case("yml"))
}

fn of_mission(
    args: &PathErrorArgs,
    inputs: &mut pipeline::Inputs,
    terminal: &Terminal,
) -> Result<Measured, Diagnostics> {
    if !args.sampling.is_empty() {
        inputs.mission.path_error_samplings.clone_from(&args.sampling);
    }
    if !args.sampling_times.is_empty() {
        inputs.mission.path_error_times.clone_from(&args.sampling_times);
    }
    let options = CompileOptions { max_error: args.max_error, trust: false, ..CompileOptions::default() };
    let progress = terminal.progress(&inputs.mission.name.clone());
    let outcome = pipeline::compile(inputs, &options, &mut |stage| progress.stage(stage));
    match outcome.diagnostics {
        Some(diagnostics) => Err(diagnostics),
        None if outcome.report.path_error.is_empty() => {
            Err(Diagnostic::error("path-error/empty", "the mission asks for no sampling time").into())
        }
        None => Ok(Measured {
            rows: outcome.report.path_error,
            within: outcome.compiled.map_or(Vec::new(), |compiled| compiled.within),
        }),
    }
}

fn table(rows: &[PathErrorRow]) -> String {
    let mut out =
        "sampling time  sampling   lateral max   lateral rms     end point   end heading    clearance\n".to_owned();
    for row in rows {
        let clearance = row.clearance_min_m.map_or("-".to_owned(), |c| format!("{:.1} mm", c * 1e3));
        out += &format!(
            "{:>11} s  {:<8} {:>13} {:>13} {:>13} {:>9.4} deg {:>12}\n",
            row.sampling_time_s,
            row.sampling,
            small(row.lateral_max_m),
            small(row.lateral_rms_m),
            small(row.end_point_m),
            row.end_heading_rad.to_degrees(),
            clearance
        );
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_metres_or_have_their_unit() {
        for (text, metres) in [("5mm", 5e-3), ("0.005", 5e-3), ("0.5 m", 0.5), ("20um", 20e-6)] {
            assert!((length(text).unwrap() - metres).abs() < 1e-15, "{text}");
        }
        for wrong in ["0", "-1mm", "mm", "5cm", "nan", "inf"] {
            assert!(length(wrong).is_err(), "{wrong}");
        }
    }
}
