//! A command file, and all that its proof rests on.
//!
//! `commands.csv` names its mission, and the mission's files are read from the disk. `commands.mcap` brings mission, robot, URDF,
//! meshes and report with it; only the map is elsewhere, and is taken only if it is byte for byte the one that was planned on.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::{Disk, folder_of, missing, read_with, tidy};
use crate::certify::{Certificate, Refusal, RefusalKind};
use crate::command::CommandTable;
use crate::diag::{Diagnostic, Diagnostics, Source, Span};
use crate::emit::csv::{self, CsvHeader};
use crate::emit::mcap::attached;
use crate::emit::mcap_read::{self, Attached, Topic};
use crate::mission;
use crate::pipeline::{self, Inputs, World};
use crate::report::Report;
use crate::report::schema::TrustPart;
use crate::robot::spec;

/// What to do with a file that cannot be checked by itself.
const FROM_DISK: &str = "check it against files on the disk with --mission MISSION.yaml";

/// A command file that was read.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandFile {
    /// As the user knows it.
    pub path: PathBuf,
    /// The rows.
    pub table: CommandTable,
    /// The head.
    pub header: CsvHeader,
    /// Rows of a CSV file whose twists contradict their wheels.
    pub contradictions: Vec<Diagnostic>,
    /// What is attached; empty: a CSV file.
    pub attachments: Vec<Attached>,
    /// The topics of an MCAP file.
    pub topics: Vec<Topic>,
    /// The report that is attached.
    pub report: Option<Report>,
}

/// Where to look for what a command file rests on.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Places<'a> {
    /// A mission on the disk, instead of the one that the file names or brings.
    pub mission: Option<&'a Path>,
    /// The map's file, instead of where the mission says.
    pub map: Option<&'a Path>,
}

/// A command file with the mission, robot and map that it is to be judged against.
pub struct LoadedCommands {
    /// The file.
    pub file: CommandFile,
    /// The mission and the files that it names.
    pub inputs: Inputs,
    /// The robot and the map.
    pub world: World,
    /// Where mission and robot come from.
    pub origin: Origin,
    /// Mission, robot and map are byte for byte those that the file was made from. False where the map was left out.
    pub as_made: bool,
}

/// Where mission and robot come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// From the command file itself.
    Attached,
    /// From this mission file.
    Mission(PathBuf),
}

/// Reads a command file (by its ending: `.mcap`, else CSV) and everything that its proof rests on.
///
/// # Errors
/// The file, its mission, robot or map is missing or bad. Of MCAP: what is attached, or the map, is not what the file was made
/// from (unless `places.mission` says that it is to be judged against something else).
pub fn load(path: &Path, places: Places<'_>) -> Result<LoadedCommands, Diagnostics> {
    read(path)?.load(places)
}

/// Reads a command file alone.
///
/// # Errors
/// It is missing, or no command file. Rows that contradict themselves are no error here; see [`CommandFile::contradictions`].
pub fn read(path: &Path) -> Result<CommandFile, Diagnostics> {
    let disk = Disk::default();
    let name = path.display().to_string();
    if !path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap")) {
        let text = disk.text(path, None)?;
        let (table, header, contradictions) = csv::read_to_judge(&name, &text.text)?;
        let path = path.to_path_buf();
        let (attachments, topics) = (Vec::new(), Vec::new());
        return Ok(CommandFile { path, table, header, contradictions, attachments, topics, report: None });
    }
    let file = mcap_read::read(&name, &disk.binary(path, None)?)?;
    let report = match file.attachment(attached::REPORT) {
        None => None,
        Some(bytes) => Some(serde_json::from_slice(bytes).map_err(|error| {
            let message = format!("attachment `{}` is no report: {error}", attached::REPORT);
            Diagnostics::from(Diagnostic::error("commands/report", message).file(&name).hint("compile it again"))
        })?),
    };
    Ok(CommandFile {
        path: path.to_path_buf(),
        table: file.table,
        header: file.header,
        contradictions: Vec::new(),
        attachments: file.attachments,
        topics: file.topics,
        report,
    })
}

impl CommandFile {
    /// Everything that the file's proof rests on.
    ///
    /// # Errors
    /// As [`load`].
    pub fn load(self, places: Places<'_>) -> Result<LoadedCommands, Diagnostics> {
        self.load_from(places, true)
    }

    /// The same without the map, for who needs the robot and its limits only.
    ///
    /// # Errors
    /// As [`load`].
    pub fn load_without_map(self, places: Places<'_>) -> Result<LoadedCommands, Diagnostics> {
        self.load_from(places, false)
    }

    fn load_from(self, places: Places<'_>, with_map: bool) -> Result<LoadedCommands, Diagnostics> {
        let named = tidy(&folder_of(&self.path).join(&self.header.mission));
        let origin = match places.mission {
            Some(path) => Origin::Mission(path.to_path_buf()),
            None if self.attachments.is_empty() => Origin::Mission(named.clone()),
            None => Origin::Attached,
        };
        let map = |_: &mission::Mission, meant: PathBuf| match (with_map, places.map) {
            (false, _) => Ok(None),
            (true, asked) if origin == Origin::Attached => self.recorded_map(meant, asked).map(Some),
            (true, asked) => Ok(Some(asked.map_or(meant, Path::to_path_buf))),
        };
        let (mut inputs, disk) = match &origin {
            Origin::Attached => {
                let disk = self.attached_files(&named)?;
                (read_with(&named, &disk, &map)?, disk)
            }
            Origin::Mission(path) => {
                if places.mission.is_none() && !path.is_file() {
                    return Err(self.mission_is_missing(path).into());
                }
                let disk = Disk::default();
                (read_with(path, &disk, &map)?, disk)
            }
        };
        let world = pipeline::world(&mut inputs)?;
        let as_made = disk.hash() == self.header.inputs_blake3;
        if with_map && !as_made && origin == Origin::Attached {
            return Err(self.differs(&inputs).into());
        }
        Ok(LoadedCommands { file: self, inputs, world, origin, as_made })
    }

    fn mission_is_missing(&self, path: &Path) -> Diagnostic {
        let message = format!("`{}` names the mission `{}`, which is not there", self.path.display(), path.display());
        let near = missing(path).1.map_or(String::new(), |near| format!("{near} "));
        let fault = Diagnostic::error("check/mission-missing", message)
            .hint(format!("{near}say which one with --mission MISSION.yaml; paths are relative to the command file"));
        let name = self.path.display().to_string();
        match std::fs::read_to_string(&self.path).ok().and_then(|text| Some((text.find("# mission:")?, text))) {
            Some((start, text)) => {
                let end = text[start..].find('\n').map_or(text.len(), |i| start + i);
                fault.at(&Span::new(&Arc::new(Source { name, text }), start..end))
            }
            None => fault.file(name),
        }
    }

    fn attachment(&self, name: &str) -> Option<&[u8]> {
        self.attachments.iter().find(|a| a.name == name).map(|a| a.bytes.as_slice())
    }

    /// The attachments at the paths where the mission's reader looks for them; the mission itself at `mission_path`.
    fn attached_files(&self, mission_path: &Path) -> Result<Disk, Diagnostics> {
        let text = |name: &str| match self.attachment(name) {
            Some(bytes) => Ok(bytes.to_vec()),
            None => {
                let fault = Diagnostic::error("commands/not-attached", format!("no attachment `{name}`"));
                Err(Diagnostics::from(fault.file(self.path.display().to_string()).hint(FROM_DISK)))
            }
        };
        let mut files = BTreeMap::new();
        let mission_bytes = text(attached::MISSION)?;
        let mission = mission::parse(&mission_path.display().to_string(), &String::from_utf8_lossy(&mission_bytes))?;
        let folder = folder_of(mission_path);
        let robot = tidy(&folder.join(&mission.robot));
        let mut urdf = robot.clone();
        if !robot.extension().is_some_and(|e| e.eq_ignore_ascii_case("urdf")) {
            let bytes = text(attached::ROBOT)?;
            let spec = spec::parse(&robot.display().to_string(), &String::from_utf8_lossy(&bytes))?;
            urdf = spec.urdf.map_or(urdf, |named| tidy(&folder_of(&robot).join(named.value)));
            files.insert(robot, bytes);
        }
        if let Some(mission::PathSpec::File(file)) = &mission.path {
            files.insert(tidy(&folder.join(file)), text(attached::PATH)?);
        }
        if let Some(file) = &mission.start_file
            && let Some(own) = self.attachments.iter().find(|a| a.name.starts_with(attached::START))
        {
            files.insert(tidy(&folder.join(file)), own.bytes.clone());
        }
        let meshes = self.attachments.iter().filter_map(|a| Some((a.name.strip_prefix(attached::MESHES)?, &a.bytes)));
        for (name, bytes) in meshes {
            files.insert(tidy(&folder_of(&urdf).join(name)), bytes.clone());
        }
        files.insert(urdf, text(attached::URDF)?);
        files.insert(mission_path.to_path_buf(), mission_bytes);
        Ok(Disk::attached(files))
    }

    /// Where the map lies that the commands were planned on: as asked; else as the mission says, or beside the command file.
    fn recorded_map(&self, meant: PathBuf, asked: Option<&Path>) -> Result<PathBuf, Diagnostics> {
        let Some(recorded) = self.report.as_ref().and_then(|r| r.inputs.map.as_ref()) else {
            let message =
                format!("attachment `{}` does not name the map that the commands were made on", attached::REPORT);
            let fault = Diagnostic::error("commands/map-not-recorded", message);
            return Err(fault.file(self.path.display().to_string()).hint(FROM_DISK).into());
        };
        let beside = meant.file_name().map(|name| folder_of(&self.path).join(name));
        let candidates = match asked {
            Some(path) => vec![path.to_path_buf()],
            None => std::iter::once(meant).chain(beside).map(|path| tidy(&path)).collect(),
        };
        let mut other = None;
        for path in &candidates {
            if !path.is_file() {
                continue;
            }
            let found = blake3::hash(&Disk::default().binary(path, None)?).to_hex().to_string();
            if found == recorded.blake3 {
                return Ok(path.clone());
            }
            other = other.or(Some((path, found)));
        }
        let file = self.path.display().to_string();
        Err(match other {
            Some((path, found)) => {
                let message = format!(
                    "`{}` is not the map that the commands were made on: its BLAKE3 is {}, recorded is {}",
                    path.display(),
                    short(&found),
                    short(&recorded.blake3)
                );
                let hint = "say where the same map lies with --map FILE, or check against this one with --mission MISSION.yaml";
                Diagnostic::error("commands/map-differs", message).file(file).hint(hint)
            }
            None => {
                let looked: Vec<String> = candidates.iter().map(|path| format!("`{}`", path.display())).collect();
                let message = format!(
                    "the map that the commands were made on is not there: looked for {} with BLAKE3 {}",
                    looked.join(" and "),
                    short(&recorded.blake3)
                );
                Diagnostic::error("commands/map-missing", message).file(file).hint("say where it lies with --map FILE")
            }
        }
        .into())
    }

    /// Which of the files read is not the one recorded.
    fn differs(&self, inputs: &Inputs) -> Diagnostic {
        let known: Vec<&str> = self.report.iter().flat_map(|r| r.inputs.files()).map(|f| f.blake3.as_str()).collect();
        let strange = |bytes: &[u8]| !known.contains(&blake3::hash(bytes).to_hex().as_str());
        let attached = [attached::MISSION, attached::ROBOT, attached::URDF, attached::PATH];
        let mut names: Vec<String> = attached
            .iter()
            .filter(|name| self.attachment(name).is_some_and(strange))
            .map(|name| format!("the attached `{name}`"))
            .collect();
        let beside = inputs.map.as_ref().and_then(|map| map.beside.as_ref());
        names.extend(beside.filter(|(_, bytes)| strange(bytes)).map(|(name, _)| format!("`{name}`")));
        let which = if names.is_empty() { "one of the files".to_owned() } else { names.join(" and ") };
        let message = format!("{which} is not what the commands were made from: its BLAKE3 is not the one recorded");
        let hint = "use the file as it was compiled, or check against files on the disk with --mission MISSION.yaml";
        Diagnostic::error("commands/inputs-differ", message).file(self.path.display().to_string()).hint(hint)
    }
}

impl LoadedCommands {
    /// Judges the commands as written; rows that contradict themselves are reasons to refuse.
    ///
    /// # Errors
    /// Joints of the table that are not the robot's; a given path that is none.
    pub fn certify(&self) -> Result<Certificate, Diagnostics> {
        let mut certificate = pipeline::check(&self.inputs, &self.world, &self.file.table)?;
        certificate.refusals.extend(self.file.contradictions.iter().map(contradiction));
        Ok(certificate)
    }

    /// How far they can be trusted without feedback.
    ///
    /// # Errors
    /// As [`Self::certify`].
    pub fn trust(&self) -> Result<Option<TrustPart>, Diagnostics> {
        pipeline::trust(&self.inputs, &self.world, &self.file.table)
    }
}

/// Enough of a hash to compare by eye.
fn short(hash: &str) -> String {
    format!("{}…", hash.chars().take(16).collect::<String>())
}

/// A row's own contradiction as a reason to refuse.
fn contradiction(fault: &Diagnostic) -> Refusal {
    let line = fault.at.as_ref().map(|at| at.source.text[..at.range.start].matches('\n').count() + 1);
    let message = line.map_or(fault.message.clone(), |line| format!("line {line}: {}", fault.message));
    Refusal { kind: RefusalKind::Table, message, time: None }
}
