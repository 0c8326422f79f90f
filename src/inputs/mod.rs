//! Reads everything that a mission or a command file names. The only reader of input files; stages get text and bytes.
//!
//! [`read`] reads a mission; [`commands::load`] a command file with all that its proof rests on.

pub mod commands;
mod disk;
pub mod machine;
mod start;

use std::path::{Path, PathBuf};
use std::sync::{PoisonError, RwLock};

use crate::diag::{Diagnostic, Diagnostics};
use crate::map;
use crate::mission::{self, Mission, PathSpec};
use crate::pipeline::{Inputs, MapFile, TextFile};
use crate::robot::spec;
pub use disk::{Disk, Named, ReadFile, missing, regular};

/// Everything a mission names, read from disk.
///
/// # Errors
/// All that a reader finds wrong: missing files, bad YAML.
pub fn read(mission_path: &Path) -> Result<(Inputs, Disk), Diagnostics> {
    let disk = Disk::default();
    let inputs = read_with(mission_path, &disk, &|_, named| Ok(Some(named)))?;
    Ok((inputs, disk))
}

/// Which map file to read, if any, where this mission means that one.
pub type ChooseMap<'a> = &'a dyn Fn(&Mission, PathBuf) -> Result<Option<PathBuf>, Diagnostics>;

/// The same through a disk of the caller's, with another map or none.
///
/// # Errors
/// As [`read`], and those of `choose_map`.
pub fn read_with(mission_path: &Path, disk: &Disk, choose_map: ChooseMap<'_>) -> Result<Inputs, Diagnostics> {
    let text = disk.text(mission_path, None)?;
    let mission = mission::parse(&text.name, &text.text)?;
    let folder = folder_of(mission_path);
    let mut faults = Vec::new();
    let robot_path = tidy(&folder.join(&mission.robot));
    let robot = read_robot(&robot_path, &mission, disk).map_err(|d| faults.extend(d.0)).ok();
    let map = match &mission.map {
        None => None,
        Some(spec) => {
            let chosen = choose_map(&mission, tidy(&folder.join(&spec.file)));
            let map = chosen.and_then(|path| path.map(|path| read_map(&path, &mission, disk)).transpose());
            map.map_err(|d| faults.extend(d.0)).ok().flatten()
        }
    };
    let path_csv = match &mission.path {
        Some(PathSpec::File(file)) => {
            let path = tidy(&folder.join(file));
            disk.text(&path, mission.spans.path_file.as_ref()).map_err(|d| faults.extend(d.0)).ok()
        }
        _ => None,
    };
    let start_file = mission.start_file.as_ref().and_then(|file| {
        let read = start::read(&tidy(&folder.join(file)), &robot_path, &mission, disk);
        read.map_err(|d| faults.extend(d.0)).ok()
    });
    match robot {
        Some((spec, yaml, urdf)) if faults.is_empty() => {
            let files = Box::new(disk.clone());
            let (mission_text, robot_spec, robot_yaml) = (text, spec, yaml);
            Ok(Inputs { mission, mission_text, robot_spec, robot_yaml, urdf, map, path_csv, start_file, files })
        }
        _ => Err(Diagnostics(faults)),
    }
}

/// robot.yaml as read and as text, and the URDF's text.
pub type RobotFiles = (spec::RobotSpec, Option<TextFile>, TextFile);

fn read_robot(path: &Path, mission: &Mission, disk: &Disk) -> Result<RobotFiles, Diagnostics> {
    read_robot_files(path, disk, mission.spans.robot.as_ref())
}

/// Reads robot.yaml and the URDF it names, or a bare URDF.
///
/// # Errors
/// Missing files, bad YAML, no `urdf` key.
pub fn read_robot_files(
    path: &Path,
    disk: &Disk,
    named_by: Option<&crate::diag::Span>,
) -> Result<RobotFiles, Diagnostics> {
    // A xacro file is read as the URDF it is not yet: the reader says how to expand it.
    if path.extension().is_some_and(|e| ["urdf", "xacro"].iter().any(|own| e.eq_ignore_ascii_case(own))) {
        return Ok((spec::RobotSpec::default(), None, disk.text(path, named_by)?));
    }
    let yaml = disk.text(path, named_by)?;
    let parsed = spec::parse(&yaml.name, &yaml.text)?;
    let Some(urdf) = &parsed.urdf else {
        let message = format!("`{}` names no URDF", yaml.name);
        return Err(Diagnostic::error("robot/no-urdf", message).file(yaml.name).hint("add `urdf: FILE.urdf`").into());
    };
    let urdf = disk.text(&tidy(&folder_of(path).join(&urdf.value)), urdf.span.as_ref())?;
    Ok((parsed, Some(yaml), urdf))
}

fn read_map(path: &Path, mission: &Mission, disk: &Disk) -> Result<MapFile, Diagnostics> {
    read_map_file(path, disk, mission.spans.map_file.as_ref())
}

/// Reads a map file and the one beside it.
///
/// # Errors
/// Missing files.
pub fn read_map_file(path: &Path, disk: &Disk, named_by: Option<&crate::diag::Span>) -> Result<MapFile, Diagnostics> {
    let bytes = disk.binary(path, named_by)?;
    let name = path.display().to_string();
    let beside = match map::beside(&name, &bytes)? {
        None => None,
        Some((other, named_by)) => {
            let other = tidy(&other);
            if named_by.is_some() || other.is_file() {
                let bytes = disk.binary(&other, named_by.as_ref())?;
                Some((other.display().to_string(), bytes))
            } else {
                disk.miss(&other);
                None
            }
        }
    };
    Ok(MapFile { name, bytes, beside })
}

static ALLOWED: RwLock<Vec<PathBuf>> = RwLock::new(Vec::new());

/// Lets robots name meshes under these folders too, in the whole process.
pub fn allow(folders: &[PathBuf]) {
    let mut allowed = ALLOWED.write().unwrap_or_else(PoisonError::into_inner);
    *allowed = folders.iter().map(|folder| absolute(folder)).collect();
}

/// Whether a path lies under a folder that was allowed.
fn allowed(path: &Path) -> bool {
    let path = absolute(path);
    ALLOWED.read().unwrap_or_else(PoisonError::into_inner).iter().any(|folder| path.starts_with(folder))
}

fn absolute(path: &Path) -> PathBuf {
    tidy(&std::path::absolute(path).unwrap_or_else(|_| path.to_path_buf()))
}

/// The folder a file lies in; `.` for a bare name.
pub fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

/// The path without `.` and without `x/..`, as build tools spell it. (A symbolic link before `..` is followed by name.)
pub fn tidy(path: &Path) -> PathBuf {
    use std::path::Component;
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if matches!(out.components().next_back(), Some(Component::Normal(_))) => {
                out.pop();
            }
            other => out.push(other),
        }
    }
    if out.as_os_str().is_empty() { PathBuf::from(".") } else { out }
}
