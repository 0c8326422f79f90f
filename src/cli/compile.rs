//! `trajc compile MISSION.yaml`.

use std::path::{Path, PathBuf};

use super::inputs::{self, Disk, Named};
use super::output::{self, depfile, spelled};
use super::terminal::Terminal;
use crate::diag::{Diagnostic, Diagnostics, Severity};
use crate::emit::csv::{self, CsvHeader};
use crate::emit::json;
use crate::emit::mcap::{self, McapInputs};
use crate::pipeline::{self, CompileOptions, Compiled, Inputs, Outcome};
use crate::report::page::{self, PageInputs};
use crate::report::{PathErrorRow, summary};

/// Compile one mission into certified command files.
///
/// Writes commands.csv, commands.mcap, path_error.csv, report.json, report.html, commands.d and timings.json into DIR/<mission's
/// name>/ (--format chooses the command files), all or none, and prints a summary.
///
/// Exit 0: certified. 1: no trajectory or no certificate; report.json and report.html say why. 2: bad input or usage. After 1 and 2 no command file
/// of this mission is left, not even an older one.
#[derive(Debug, clap::Args)]
pub struct CompileArgs {
    /// The mission file. Its stem is the mission's name.
    #[arg(value_name = "MISSION.yaml")]
    mission: PathBuf,
    /// Folder that gets a folder for each mission.
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Seconds each command is held, instead of the mission's sampling_time_s.
    #[arg(long, value_name = "S", value_parser = seconds)]
    sampling_time: Option<f64>,
    /// Command files to write, separated by commas.
    #[arg(long, value_name = "FORMAT", value_delimiter = ',', default_value = "csv,mcap")]
    format: Vec<Format>,
    /// The report for people to write beside report.json, also of a mission that fails.
    #[arg(long, value_name = "KIND", default_value = "html")]
    report: ReportKind,
    /// Print report.json on stdout instead of the summary.
    #[arg(long)]
    json: bool,
}

/// A kind of command file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Format {
    /// commands.csv
    Csv,
    /// commands.mcap, for ROS 2 and Foxglove
    Mcap,
    /// trajectory.json, an array with an object for each row of commands.csv; names no mission, so it cannot be checked
    #[value(name = "trajectory.json")]
    Trajectory,
}

impl Format {
    /// The file that it is.
    fn file(self) -> &'static str {
        match self {
            Self::Csv => "commands.csv",
            Self::Mcap => "commands.mcap",
            Self::Trajectory => "trajectory.json",
        }
    }
}

/// A report to look at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum ReportKind {
    /// report.html: one page that opens offline, with a 3-D view
    Html,
    /// report.svg: one static picture
    Svg,
    /// report.json alone
    None,
}

/// A sampling time on the command line.
pub(super) fn seconds(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (1e-4..=10.0).contains(&value) => Ok(value),
        _ => Err("expected seconds between 0.0001 and 10, such as 0.1".to_owned()),
    }
}

/// Compiles and writes.
///
/// # Errors
/// Bad input; older command files of the mission are removed.
pub fn compile(args: &CompileArgs, terminal: &mut Terminal) -> Result<u8, Diagnostics> {
    let name = mission_name(&args.mission)?;
    match run(args, &name, terminal) {
        Ok(code) => Ok(code),
        Err(mut diagnostics) => {
            if let Err(error) = output::discard(&args.out, &name) {
                // The reason why nothing could be written may be told already.
                let more = Diagnostics::from(error).0.into_iter().filter(|d| !diagnostics.0.contains(d));
                diagnostics.0.extend(more.collect::<Vec<_>>());
            }
            Err(diagnostics)
        }
    }
}

/// The mission's name: its file's stem.
pub(super) fn mission_name(path: &Path) -> Result<String, Diagnostics> {
    match path.file_stem().and_then(|s| s.to_str()) {
        Some(stem) if !stem.is_empty() => Ok(stem.to_owned()),
        _ => {
            let message = format!("`{}` has no file name to name the mission by", path.display());
            Err(Diagnostic::error("cli/mission-name", message).hint("name a file such as missions/dock.yaml").into())
        }
    }
}

fn run(args: &CompileArgs, name: &str, terminal: &mut Terminal) -> Result<u8, Diagnostics> {
    let started = std::time::Instant::now();
    let (mut inputs, disk) = inputs::read(&args.mission)?;
    let read = started.elapsed().as_secs_f64() * 1e3;
    let progress = terminal.progress(name);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let options = CompileOptions { sampling_time: args.sampling_time, threads, ..Default::default() };
    let outcome = pipeline::compile(&mut inputs, &options, &mut |stage| progress.stage(stage));
    drop(progress);
    if let Some(diagnostics) = outcome.diagnostics.as_ref().filter(|d| d.severity() == Severity::BadInput) {
        return Err(diagnostics.clone());
    }
    let written = write(args, name, &inputs, &disk, &outcome, read)?;
    let text = if args.json {
        outcome.report.to_json()
    } else {
        let folder = args.out.join(name).display().to_string();
        let files: Vec<&str> = written.iter().map(String::as_str).collect();
        summary::render(&summary::SummaryInputs {
            mission: name,
            report: &outcome.report,
            folder: &folder,
            files: &files,
            colour: terminal.colour_results,
        })
    };
    terminal.print(&text);
    if let Some(diagnostics) = &outcome.diagnostics {
        terminal.complain(diagnostics);
        return Ok(1);
    }
    Ok(0)
}

/// Writes the output folder; names of its files.
fn write(
    args: &CompileArgs,
    name: &str,
    inputs: &Inputs,
    disk: &Disk,
    outcome: &Outcome,
    read: f64,
) -> Result<Vec<String>, Diagnostics> {
    let report = outcome.report.to_json();
    let started = std::time::Instant::now();
    let page = page(args.report, name, inputs, outcome);
    let drawn = ("page", started.elapsed().as_secs_f64() * 1e3);
    let timings: Vec<_> = outcome.timings.iter().copied().chain([drawn]).collect();
    let timings = timings_json(&timings, read);
    let mut files: Vec<(&str, Vec<u8>)> = Vec::new();
    if let Some(compiled) = &outcome.compiled {
        files.extend(command_files(args, name, inputs, disk, compiled, &outcome.report.path_error, &report)?);
    }
    files.push(("report.json", report.into_bytes()));
    files.extend(page);
    files.push(("timings.json", timings.into_bytes()));
    let borrowed: Vec<(&str, &[u8])> = files.iter().map(|(name, bytes)| (*name, bytes.as_slice())).collect();
    if outcome.compiled.is_some() {
        output::publish(&args.out, name, &borrowed)?;
    } else {
        output::publish_failure(&args.out, name, &borrowed)?;
    }
    Ok(files.iter().map(|(name, _)| (*name).to_owned()).collect())
}

/// The report for people.
fn page(kind: ReportKind, name: &str, inputs: &Inputs, outcome: &Outcome) -> Option<(&'static str, Vec<u8>)> {
    let (world, mission) = (outcome.traces.world.as_ref(), &inputs.mission);
    let page = PageInputs {
        mission: name,
        report: &outcome.report,
        robot: world.map(|w| &w.robot),
        map: world.and_then(|w| w.map.as_ref()),
        commands: outcome.compiled.as_ref().map(|c| &c.commands).or(outcome.traces.refused.as_ref()),
        ends: [mission.start.as_ref(), mission.goal.as_ref()],
        route: &outcome.traces.route,
    };
    match kind {
        ReportKind::Html => Some(("report.html", page::html(&page).into_bytes())),
        ReportKind::Svg => Some(("report.svg", page::svg(&page).into_bytes())),
        ReportKind::None => None,
    }
}

fn command_files(
    args: &CompileArgs,
    name: &str,
    inputs: &Inputs,
    disk: &Disk,
    compiled: &Compiled,
    path_error: &[PathErrorRow],
    report: &str,
) -> Result<Vec<(&'static str, Vec<u8>)>, Diagnostics> {
    let start = std::env::current_dir().unwrap_or_else(|_| PathBuf::from("."));
    let folder = args.out.join(name);
    let header = CsvHeader {
        mission: from_folder(&start.join(&folder), &start.join(&args.mission)),
        robot: inputs.mission.robot.display().to_string(),
        map: inputs.mission.map.as_ref().map(|m| m.file.display().to_string()),
        inputs_blake3: disk.hash(),
    };
    let mut files: Vec<(&'static str, Vec<u8>)> = Vec::new();
    if args.format.contains(&Format::Csv) {
        files.push((Format::Csv.file(), csv::write(&compiled.commands, &header).into_bytes()));
    }
    if args.format.contains(&Format::Mcap) {
        let bytes = mcap::write(&McapInputs {
            table: &compiled.commands,
            header: &header,
            robot: &compiled.robot,
            mission: &inputs.mission_text.text,
            robot_yaml: inputs.robot_yaml.as_ref().map(|f| f.text.as_str()),
            urdf: &inputs.urdf.text,
            report,
            path_csv: inputs.path_csv.as_ref().map(|f| f.text.as_str()),
            meshes: &meshes(inputs, disk, &start),
        })?;
        files.push((Format::Mcap.file(), bytes));
    }
    if args.format.contains(&Format::Trajectory) {
        files.push((Format::Trajectory.file(), json::write(&compiled.commands).into_bytes()));
    }
    // One target, the first: build systems want no outputs named that they were not told of.
    let target = files.first().map_or(Format::Csv.file(), |(name, _)| name);
    files.push(("path_error.csv", csv::write_path_error(path_error).into_bytes()));
    let read: Vec<PathBuf> = disk.paths().iter().map(|p| spelled(p, &start)).collect();
    files.push(("commands.d", depfile(&spelled(&folder.join(target), &start), &read).into_bytes()));
    Ok(files)
}

/// Meshes by their paths from the URDF's folder.
fn meshes(inputs: &Inputs, disk: &Disk, start: &Path) -> Vec<Named> {
    let folder = start.join(inputs::folder_of(Path::new(&inputs.urdf.name)));
    let name = |path: &str| from_folder(&folder, &start.join(path));
    disk.meshes().into_iter().map(|(path, bytes)| (name(&path), bytes)).collect()
}

/// The path that leads from a folder to a file, both absolute; with `..` where needed.
pub(super) fn from_folder(folder: &Path, file: &Path) -> String {
    let [folder, file] = [folder, file].map(inputs::tidy);
    let shared = folder.components().zip(file.components()).take_while(|(a, b)| a == b).count();
    let mut out = PathBuf::new();
    folder.components().skip(shared).for_each(|_| out.push(".."));
    out.extend(file.components().skip(shared));
    out.display().to_string()
}

fn timings_json(timings: &[(&'static str, f64)], read: f64) -> String {
    let mut map = serde_json::Map::new();
    let rounded = |ms: f64| serde_json::Value::from((ms * 1e3).round() / 1e3);
    map.insert("read_files_ms".into(), rounded(read));
    for (stage, ms) in timings {
        map.insert(format!("{stage}_ms"), rounded(*ms));
    }
    format!("{:#}\n", serde_json::Value::Object(map))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_from_the_output_folder_to_the_mission_goes_up_and_down() {
        let way = |folder: &str, file: &str| from_folder(Path::new(folder), Path::new(file));
        assert_eq!(way("/a/out/m", "/a/missions/m.yaml"), "../../missions/m.yaml");
        assert_eq!(way("/a/./out/../out/m", "/a/out/m/m.yaml"), "m.yaml");
        assert_eq!(way("/b/m", "/home/x.yaml"), "../../home/x.yaml");
    }

    #[test]
    fn a_sampling_time_must_be_a_positive_number_of_seconds() {
        assert_eq!(seconds("0.05"), Ok(0.05));
        for wrong in ["0", "-1", "nan", "inf", "0.1s", "100"] {
            assert!(seconds(wrong).is_err(), "{wrong}");
        }
    }
}
