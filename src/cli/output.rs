//! The output folder of a mission, `out/<mission>/`: all files or none.
//!
//! Files are written into a temporary folder beside, flushed to the disk, and the folder is renamed into place; an older one
//! is renamed aside first and then removed. Between the two renames there is an instant without any folder; never one with
//! some files of each. Only files that this program writes are ever removed: what else lies in an output folder stays.

mod depfile;

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Component, Path, PathBuf};

use crate::diag::{Describe, Diagnostic, Diagnostics};
pub use depfile::{depfile, spelled};

/// Every file that this program writes into an output folder, command files first.
pub const FILES: [&str; 10] = [
    "commands.csv",
    "commands.mcap",
    "trajectory.json",
    "commands.d",
    "path_error.csv",
    "report.json",
    "report.html",
    "report.svg",
    "timings.json",
    "build.json",
];

/// A file or folder that could not be made, moved or removed.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    /// The system says no.
    #[error("cannot {action} `{}`: {}", path.display(), reason(error))]
    Io {
        /// What was tried.
        action: &'static str,
        /// Of what.
        path: PathBuf,
        /// The system's reason.
        error: io::Error,
    },
    /// A name that would leave the output folder.
    #[error("`{0}` is no name for a folder of results")]
    Name(String),
    /// Something else has the folder's name.
    #[error("`{}` is not a folder, as results need", .0.display())]
    NotAFolder(PathBuf),
}

impl Describe for OutputError {
    fn diagnostic(&self) -> Diagnostic {
        match self {
            Self::Io { .. } => {
                Diagnostic::error("output/io", self).hint("choose a folder that can be written with `--out DIR`")
            }
            Self::Name(_) => Diagnostic::error("output/name", self).hint("rename the mission's file"),
            Self::NotAFolder(_) => {
                Diagnostic::error("output/not-a-folder", self).hint("move it away or choose another `--out`")
            }
        }
    }
}

/// The system's words, without its number for them; of what is most often wrong, ours.
fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => return "its folder is not there".into(),
        io::ErrorKind::AlreadyExists => return "a file of that name is there".into(),
        io::ErrorKind::NotADirectory => return "a file stands where a folder must be".into(),
        _ => {}
    }
    let words = error.to_string();
    words.split(" (os error").next().unwrap_or(&words).to_owned()
}

/// Adds action and path to a system's error.
fn named<'a>(action: &'static str, path: &'a Path) -> impl FnOnce(io::Error) -> OutputError + 'a {
    move |error| OutputError::Io { action, path: path.to_path_buf(), error }
}

/// Makes `out/<mission>/` hold exactly these files of ours (names from [`FILES`]), all or none; returns its path.
///
/// # Errors
/// With the path. The folder is then as it was before.
pub fn publish(out: &Path, mission: &str, files: &[(&str, &[u8])]) -> Result<PathBuf, OutputError> {
    debug_assert!(files.iter().all(|(name, _)| FILES.contains(name)), "what is written here must be removable here");
    let target = target(out, mission)?;
    let parent = target.parent().unwrap_or(Path::new("/")).to_path_buf();
    fs::create_dir_all(&parent).map_err(named("create", &parent))?;
    clear_leftovers(&parent, mission);
    let fresh = temporary(&parent, mission, "new")?;
    // Held until the rename: tells other runs that this folder is in use.
    let _lock = lock(fresh.path());
    for (name, bytes) in files {
        let path = fresh.path().join(name);
        write_through(&path, bytes).map_err(named("write", &path))?;
    }
    flush_folder(fresh.path());
    // An empty folder is replaced by the rename itself, on systems that can.
    if fs::rename(fresh.path(), &target).is_err() {
        swap(fresh.path(), &target, &parent, mission)?;
    }
    // It is no longer where its destructor would remove it.
    let _ = fresh.keep();
    flush_folder(&parent);
    Ok(out.join(mission))
}

/// The same for a mission that failed: its report alone, which takes older command files away. They go even where the report
/// cannot be written.
///
/// # Errors
/// As [`publish`], but older files of ours are then gone.
pub fn publish_failure(out: &Path, mission: &str, files: &[(&str, &[u8])]) -> Result<PathBuf, OutputError> {
    publish(out, mission, files).inspect_err(|_| {
        let _ = discard(out, mission);
    })
}

/// Removes all files of ours from `out/<mission>/`, command files first, and the folder if nothing else is in it. For bad
/// input: no older commands may pass for this mission's. No folder is no error.
///
/// # Errors
/// With the path of the first file that cannot be removed; the others are removed all the same.
pub fn discard(out: &Path, mission: &str) -> Result<(), OutputError> {
    let target = target(out, mission)?;
    if !target.is_dir() {
        return Ok(());
    }
    let removed = remove_ours(&target);
    let _ = fs::remove_dir(&target);
    removed
}

/// The absolute path of the folder: the process may stand in a folder that is about to be replaced, and a link to a folder
/// elsewhere stays a link.
fn target(out: &Path, mission: &str) -> Result<PathBuf, OutputError> {
    let mut parts = Path::new(mission).components();
    // A mission's file may be called `...yaml`.
    if !matches!((parts.next(), parts.next()), (Some(Component::Normal(_)), None)) {
        return Err(OutputError::Name(mission.to_string()));
    }
    let path = out.join(mission);
    let target = std::path::absolute(&path).map_err(named("find", &path))?;
    match fs::symlink_metadata(&target) {
        Ok(found) if found.is_symlink() && target.is_dir() => fs::canonicalize(&target).map_err(named("follow", &path)),
        Ok(found) if !found.is_dir() => Err(OutputError::NotAFolder(path)),
        // Folders above may be files; then making them says so.
        _ => Ok(target),
    }
}

fn prefix(mission: &str) -> String {
    format!(".{mission}.trajc-")
}

fn temporary(parent: &Path, mission: &str, suffix: &str) -> Result<tempfile::TempDir, OutputError> {
    tempfile::Builder::new()
        .prefix(&prefix(mission))
        .suffix(&format!(".{suffix}"))
        .tempdir_in(parent)
        .map_err(named("create a folder in", parent))
}

fn write_through(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut file = File::create_new(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

/// Flushes a folder's entries where the system can; the files themselves are flushed already.
fn flush_folder(path: &Path) {
    if let Ok(folder) = File::open(path) {
        let _ = folder.sync_all();
    }
}

/// Renames the old folder aside, the new one in, and removes the old.
fn swap(fresh: &Path, target: &Path, parent: &Path, mission: &str) -> Result<(), OutputError> {
    if !target.is_dir() {
        return fs::rename(fresh, target).map_err(named("create", target));
    }
    let aside = temporary(parent, mission, "old")?;
    let _lock = lock(aside.path());
    let old = aside.path().join("was");
    fs::rename(target, &old).map_err(named("replace", target))?;
    if let Err(error) = fs::rename(fresh, target) {
        // Put it back. If that fails too it must not go the way of a temporary folder; the first reason is the one to tell.
        if fs::rename(&old, target).is_err() {
            let _ = aside.keep();
        }
        return Err(named("replace", target)(error));
    }
    // From here on the new folder is in place; what cannot be tidied up is left beside.
    let aside = aside.keep();
    keep_foreign(&old, target);
    let _ = remove_ours(&old);
    let _ = fs::remove_dir(&old);
    let _ = fs::remove_dir(&aside);
    Ok(())
}

/// Moves what is not ours (a log, a plot) from the old folder to the new one.
fn keep_foreign(old: &Path, new: &Path) {
    for entry in fs::read_dir(old).into_iter().flatten().flatten() {
        let name = entry.file_name();
        if !FILES.iter().any(|file| name == *file) {
            let _ = fs::rename(entry.path(), new.join(&name));
        }
    }
}

/// Removes our files from a folder; the first error is returned, the rest is removed all the same.
fn remove_ours(folder: &Path) -> Result<(), OutputError> {
    let mut result = Ok(());
    for name in FILES {
        let path = folder.join(name);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound && result.is_ok() => {
                result = Err(named("remove", &path)(error));
            }
            _ => {}
        }
    }
    result
}

/// An advisory lock on a folder, where the system has such; `None`: it has not, or someone else holds it.
fn lock(folder: &Path) -> Option<File> {
    let file = File::open(folder).ok()?;
    file.try_lock().ok()?;
    Some(file)
}

/// Removes what runs of this mission left that were killed: temporary folders whose maker no longer holds their lock.
/// Where locks do not work they stay, and do no harm.
fn clear_leftovers(parent: &Path, mission: &str) {
    clear_leftovers_of(parent, &|name| name == mission);
}

/// The same of all missions.
pub(super) fn sweep(out: &Path) {
    // As `target` has it: the process may stand in a folder that is replaced.
    if let Ok(out) = std::path::absolute(out) {
        clear_leftovers_of(&out, &|_| true);
    }
}

fn clear_leftovers_of(parent: &Path, wanted: &dyn Fn(&str) -> bool) {
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let Some(mission) = name.to_str().and_then(left_by).filter(|mission| wanted(mission)) else { continue };
        if !entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            continue;
        }
        let Some(_lock) = lock(&entry.path()) else { continue };
        let (folder, was) = (entry.path(), entry.path().join("was"));
        let target = parent.join(mission);
        if was.is_dir() && !target.exists() {
            // Killed between the two renames: the old set is all there is.
            let _ = fs::rename(&was, &target);
        } else if was.is_dir() {
            keep_foreign(&was, &target);
            let _ = remove_ours(&was);
            let _ = fs::remove_dir(&was);
        }
        let _ = remove_ours(&folder);
        let _ = fs::remove_dir(&folder);
    }
}

/// The mission whose temporary folder has this name.
fn left_by(name: &str) -> Option<&str> {
    let (mission, rest) = name.strip_prefix('.')?.rsplit_once(".trajc-")?;
    (rest.ends_with(".new") || rest.ends_with(".old")).then_some(mission)
}

/// The output folders' own lock, for builds: two of them would write the same. Held until it is dropped; `None`: locks do not work here.
///
/// # Errors
/// Somebody else holds it.
pub(super) fn lock_all(out: &Path) -> Result<Option<File>, Diagnostics> {
    let Ok(file) = File::open(out) else { return Ok(None) };
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(fs::TryLockError::Error(_)) => Ok(None),
        Err(fs::TryLockError::WouldBlock) => {
            let message = format!("another build is at work in `{}`", out.display());
            Err(Diagnostic::error("build/locked", message)
                .hint("wait for it, or choose another folder with `--out DIR`")
                .into())
        }
    }
}

/// Makes a folder and those above it.
///
/// # Errors
/// It cannot be made.
pub(super) fn make_folder(path: &Path) -> Result<(), Diagnostics> {
    std::fs::create_dir_all(path).map_err(|error| {
        let message = format!("cannot make folder `{}`: {}", path.display(), reason(&error));
        Diagnostic::error("output/io", message).hint("the folder above must be writable").into()
    })
}

/// Writes one file that belongs to no mission's folder.
///
/// # Errors
/// It cannot be written.
pub(super) fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Diagnostics> {
    std::fs::write(path, bytes).map_err(|error| {
        let message = format!("cannot write `{}`: {}", path.display(), reason(&error));
        Diagnostic::error("output/io", message).hint("the folder must exist and be writable").into()
    })
}

#[cfg(test)]
mod tests;
