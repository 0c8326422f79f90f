//! Reads everything that a mission names. The only reader of input files; stages get text and bytes.

use std::cell::RefCell;
use std::io;
use std::path::{Path, PathBuf};
use std::rc::Rc;

use crate::diag::{Diagnostic, Diagnostics};
use crate::map;
use crate::mission::{self, Mission, PathSpec};
use crate::pipeline::{Inputs, MapFile, TextFile};
use crate::robot::Files;
use crate::robot::spec;

/// A file's name and bytes.
type Named = (String, Vec<u8>);

/// Reads files from the disk and remembers which.
#[derive(Clone, Default)]
pub struct Disk {
    /// Path and hash of each file read, in order.
    read: Rc<RefCell<Vec<(PathBuf, blake3::Hash)>>>,
    /// What the robot stage read.
    meshes: Rc<RefCell<Vec<Named>>>,
}

impl Disk {
    /// Paths of all files read so far, in order, each once.
    pub fn paths(&self) -> Vec<PathBuf> {
        self.read.borrow().iter().map(|(path, _)| path.clone()).collect()
    }

    /// Meshes read so far: name by which the robot stage asked for each, and bytes.
    pub fn meshes(&self) -> Vec<Named> {
        self.meshes.borrow().clone()
    }

    fn bytes(&self, path: &Path) -> io::Result<Vec<u8>> {
        if path.is_dir() {
            return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a folder"));
        }
        let bytes = std::fs::read(path)?;
        let mut read = self.read.borrow_mut();
        if !read.iter().any(|(known, _)| known == path) {
            read.push((path.to_path_buf(), blake3::hash(&bytes)));
        }
        Ok(bytes)
    }

    /// One hash over the bytes of all files read: of their hashes, in order.
    pub fn hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for (_, hash) in self.read.borrow().iter() {
            hasher.update(hash.as_bytes());
        }
        hasher.finalize().to_hex().to_string()
    }

    /// Reads bytes, or says which file could not be read and who names it.
    ///
    /// # Errors
    /// The file is missing or unreadable.
    pub fn binary(&self, path: &Path, named_by: Option<&crate::diag::Span>) -> Result<Vec<u8>, Diagnostics> {
        self.bytes(path).map_err(|error| unreadable(path, &error, named_by).into())
    }

    /// Reads a text.
    ///
    /// # Errors
    /// The file is missing, unreadable or not UTF-8.
    pub fn text(&self, path: &Path, named_by: Option<&crate::diag::Span>) -> Result<TextFile, Diagnostics> {
        let bytes = self.binary(path, named_by)?;
        let name = path.display().to_string();
        match String::from_utf8(bytes) {
            Ok(text) => Ok(TextFile { name, text }),
            Err(error) => {
                let at = error.utf8_error().valid_up_to();
                let message = format!("`{name}` is not UTF-8 text: byte {at} begins no character");
                Err(Diagnostic::error("input/not-text", message).file(name).hint("save the file as UTF-8").into())
            }
        }
    }
}

impl Files for Disk {
    fn read(&mut self, path: &Path) -> io::Result<Vec<u8>> {
        let bytes = self.bytes(path)?;
        let name = path.display().to_string();
        let mut meshes = self.meshes.borrow_mut();
        if !meshes.iter().any(|(known, _)| *known == name) {
            meshes.push((name, bytes.clone()));
        }
        Ok(bytes)
    }
}

fn unreadable(path: &Path, error: &io::Error, named_by: Option<&crate::diag::Span>) -> Diagnostic {
    let name = path.display().to_string();
    let (what, hint) = match error.kind() {
        io::ErrorKind::NotFound => (
            format!("no such file: `{name}`"),
            if named_by.is_some() { "paths are relative to the file that names them" } else { "check the path" },
        ),
        io::ErrorKind::IsADirectory => (format!("`{name}` is a folder, expected a file"), "name the file in it"),
        _ => (format!("cannot read `{name}`: {error}"), "check its permissions"),
    };
    let diagnostic = Diagnostic::error("input/unreadable", what).hint(hint);
    match named_by {
        Some(span) => diagnostic.at(span),
        None => diagnostic.file(name),
    }
}

/// Everything a mission names, read from disk.
///
/// # Errors
/// All that a reader finds wrong: missing files, bad YAML.
pub fn read(mission_path: &Path) -> Result<(Inputs, Disk), Diagnostics> {
    let disk = Disk::default();
    let text = disk.text(mission_path, None)?;
    let mission = mission::parse(&text.name, &text.text)?;
    let inputs = read_named(mission, text, &folder_of(mission_path), &disk)?;
    Ok((inputs, disk))
}

fn read_named(mission: Mission, text: TextFile, folder: &Path, disk: &Disk) -> Result<Inputs, Diagnostics> {
    let mut faults = Vec::new();
    let robot_path = tidy(&folder.join(&mission.robot));
    let robot = read_robot(&robot_path, &mission, disk).map_err(|d| faults.extend(d.0)).ok();
    let map = match &mission.map {
        None => None,
        Some(spec) => {
            let path = tidy(&folder.join(&spec.file));
            read_map(&path, &mission, disk).map_err(|d| faults.extend(d.0)).ok()
        }
    };
    let path_csv = match &mission.path {
        Some(PathSpec::File(file)) => {
            let path = tidy(&folder.join(file));
            disk.text(&path, mission.spans.path_file.as_ref()).map_err(|d| faults.extend(d.0)).ok()
        }
        _ => None,
    };
    match robot {
        Some((spec, yaml, urdf)) if faults.is_empty() => {
            let files = Box::new(disk.clone());
            Ok(Inputs { mission, mission_text: text, robot_spec: spec, robot_yaml: yaml, urdf, map, path_csv, files })
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
        Some((other, required)) => {
            let other = tidy(&other);
            if required || other.is_file() {
                let bytes = disk.binary(&other, None).map_err(|Diagnostics(faults)| {
                    let named_by = format!("`{name}` names it; paths are relative to that file");
                    Diagnostics(faults.into_iter().map(|fault| fault.hint(&named_by)).collect())
                })?;
                Some((other.display().to_string(), bytes))
            } else {
                None
            }
        }
    };
    Ok(MapFile { name, bytes, beside })
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
