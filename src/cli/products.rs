//! What is written of a compiled mission: which files, and what is in them.

use std::path::{Path, PathBuf};

use super::inputs::{self, Disk, Named};
use super::output::{self, depfile, spelled};
use crate::diag::Diagnostics;
use crate::emit::csv::{self, CsvHeader};
use crate::emit::json;
use crate::emit::mcap::{self, McapInputs};
use crate::pipeline::{CompileOptions, Compiled, Inputs, Outcome};
use crate::report::page::{self, PageInputs};

/// What to write, and where.
#[derive(Debug, Clone, clap::Args)]
pub struct ProductArgs {
    /// Folder that gets a folder for each mission.
    #[arg(long, value_name = "DIR", default_value = "out")]
    pub out: PathBuf,
    /// Seconds each command is held, instead of the mission's sampling_time_s.
    #[arg(long, value_name = "S", value_parser = seconds)]
    pub sampling_time: Option<f64>,
    /// Command files to write, separated by commas.
    #[arg(long, value_name = "FORMAT", value_delimiter = ',', default_value = "csv,mcap")]
    pub format: Vec<Format>,
    /// The report for people to write beside report.json, also of a mission that fails.
    #[arg(long, value_name = "KIND", default_value = "html")]
    pub report: ReportKind,
}

impl ProductArgs {
    /// What the pipeline has to know of them.
    pub fn options(&self) -> CompileOptions {
        CompileOptions { sampling_time: self.sampling_time, ..Default::default() }
    }
}

/// A kind of command file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Format {
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
    pub fn file(self) -> &'static str {
        match self {
            Self::Csv => "commands.csv",
            Self::Mcap => "commands.mcap",
            Self::Trajectory => "trajectory.json",
        }
    }
}

/// A report to look at.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum ReportKind {
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

/// A file of an output folder: its name and bytes.
pub type Product = (&'static str, Vec<u8>);

/// A mission that was compiled, or has failed.
pub struct Products<'a> {
    /// What to write.
    pub args: &'a ProductArgs,
    /// The mission's file, as the user knows it.
    pub path: &'a Path,
    /// The mission's name.
    pub name: &'a str,
    /// What was read.
    pub inputs: &'a Inputs,
    /// Who read it.
    pub disk: &'a Disk,
    /// What came of it.
    pub outcome: &'a Outcome,
}

/// Writes the output folder, all files or none; their names.
///
/// # Errors
/// It cannot be written. Of a mission that failed, older files are removed all the same.
pub fn publish(out: &Path, name: &str, files: &[Product], certified: bool) -> Result<Vec<&'static str>, Diagnostics> {
    let borrowed: Vec<(&str, &[u8])> = files.iter().map(|(name, bytes)| (*name, bytes.as_slice())).collect();
    if certified {
        output::publish(out, name, &borrowed)?;
    } else {
        output::publish_failure(out, name, &borrowed)?;
    }
    Ok(files.iter().map(|(name, _)| *name).collect())
}

impl Products<'_> {
    /// Its files: command files first, then reports. `before`: stages and milliseconds that the outcome does not know of.
    ///
    /// # Errors
    /// MCAP cannot be written.
    pub fn files(&self, before: &[(&'static str, f64)]) -> Result<Vec<Product>, Diagnostics> {
        let outcome = self.outcome;
        let report = outcome.report.to_json();
        let started = std::time::Instant::now();
        let page = self.page();
        let drawn = ("page", started.elapsed().as_secs_f64() * 1e3);
        let timings: Vec<_> = before.iter().chain(&outcome.timings).copied().chain([drawn]).collect();
        let mut files: Vec<Product> = Vec::new();
        if let Some(compiled) = &outcome.compiled {
            files.extend(self.command_files(compiled, &report)?);
        }
        files.push(("report.json", report.into_bytes()));
        files.extend(page);
        files.push(("timings.json", timings_json(&timings).into_bytes()));
        Ok(files)
    }

    /// The report for people.
    fn page(&self) -> Option<Product> {
        let Self { args, name, inputs, outcome, .. } = self;
        let (world, mission) = (outcome.traces.world.as_ref(), &inputs.mission);
        let page = PageInputs {
            mission: name,
            report: &outcome.report,
            robot: world.map(|w| &w.robot),
            map: world.and_then(|w| w.map.as_deref()),
            commands: outcome.compiled.as_ref().map(|c| &c.commands).or(outcome.traces.refused.as_ref()),
            ends: [mission.start.as_ref(), mission.goal.as_ref()],
            zones: mission.speed_zones(),
            route: &outcome.traces.route,
            trust: outcome.traces.trust.as_ref(),
        };
        match args.report {
            ReportKind::Html => Some(("report.html", page::html(&page).into_bytes())),
            ReportKind::Svg => Some(("report.svg", page::svg(&page).into_bytes())),
            ReportKind::None => None,
        }
    }

    fn command_files(&self, compiled: &Compiled, report: &str) -> Result<Vec<Product>, Diagnostics> {
        let Self { args, path, name, inputs, disk, outcome } = self;
        let start = std::env::current_dir().unwrap_or_else(|_| PathBuf::from("."));
        let folder = args.out.join(name);
        let header = CsvHeader {
            mission: from_folder(&start.join(&folder), &start.join(path)),
            robot: inputs.mission.robot.display().to_string(),
            map: inputs.mission.map.as_ref().map(|m| m.file.display().to_string()),
            inputs_blake3: disk.hash(),
        };
        let mut files: Vec<Product> = Vec::new();
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
                start_file: inputs.start_file.as_ref().map(|f| (file_name(&f.name), f.bytes.as_slice())),
                path_csv: inputs.path_csv.as_ref().map(|f| f.text.as_str()),
                meshes: &self.meshes(&start),
            })?;
            files.push((Format::Mcap.file(), bytes));
        }
        if args.format.contains(&Format::Trajectory) {
            files.push((Format::Trajectory.file(), json::write(&compiled.commands).into_bytes()));
        }
        let target = files.first().map_or(Format::Csv.file(), |(name, _)| name);
        files.push(("path_error.csv", csv::write_path_error(&outcome.report.path_error).into_bytes()));
        let read: Vec<PathBuf> = disk.paths().iter().map(|p| spelled(p, &start)).collect();
        files.push((DEPFILE, dependencies(&folder, target, &read, &start).into_bytes()));
        Ok(files)
    }

    /// Meshes by their paths from the URDF's folder.
    fn meshes(&self, start: &Path) -> Vec<Named> {
        let folder = start.join(inputs::folder_of(Path::new(&self.inputs.urdf.name)));
        let name = |path: &str| from_folder(&folder, &start.join(path));
        self.disk.meshes().into_iter().map(|(path, bytes)| (name(&path), bytes)).collect()
    }
}

/// The file that tells build systems what the commands depend on.
pub const DEPFILE: &str = "commands.d";

/// Its text: one target, the first command file, since build systems want no outputs named that they were not told of; and the files
/// that were read, as spelled from the folder in which the program was started.
pub fn dependencies(folder: &Path, target: &str, read: &[PathBuf], start: &Path) -> String {
    depfile(&spelled(&folder.join(target), start), read)
}

/// The part behind the last folder.
fn file_name(path: &str) -> &str {
    Path::new(path).file_name().and_then(|name| name.to_str()).unwrap_or(path)
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

fn timings_json(timings: &[(&'static str, f64)]) -> String {
    let mut map = serde_json::Map::new();
    let rounded = |ms: f64| serde_json::Value::from((ms * 1e3).round() / 1e3);
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
