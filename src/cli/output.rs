//! The output folder of a mission, `out/<mission>/`: all files or none.
//!
//! Files are written into a temporary folder beside, flushed to the disk, and the folder is renamed into place; an older one
//! is renamed aside first and then removed. Between the two renames there is an instant without any folder; never one with
//! some files of each. Only files that this program writes are ever removed: what else lies in an output folder stays.

mod depfile;
mod leftovers;
mod single;

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Component, Path, PathBuf};
use std::thread;

use crate::diag::{Describe, Diagnostic, Diagnostics};
pub use depfile::{depfile, spelled};
pub(super) use leftovers::sweep;
use leftovers::{Passing, Way, clear_leftovers};
pub(super) use single::{make_folder, write_file};

/// Of threads that do nothing but wait for the disk.
const STACK: usize = 64 << 10;
/// How often a folder is put in place again where other runs do the same at the same time.
const TRIES: usize = 8;

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
            Self::Io { error, .. } => Diagnostic::error("output/io", self)
                .hint(room(error).unwrap_or_else(|| "choose a folder that can be written with `--out DIR`".to_owned())),
            Self::Name(_) => Diagnostic::error("output/name", self).hint("rename the mission's file"),
            Self::NotAFolder(_) => {
                Diagnostic::error("output/not-a-folder", self).hint("move it away or choose another `--out`")
            }
        }
    }
}

/// What to do where something does not fit; `None`: that is not the reason.
fn room(error: &io::Error) -> Option<String> {
    use io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
    let hint = match error.kind() {
        StorageFull | QuotaExceeded => "make room on that disk, then do the same again; or write to another one",
        FileTooLarge => "files may not be that large here: see `ulimit -f`, or write to another disk",
        _ => return None,
    };
    Some(hint.to_owned())
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
    let fresh = Passing::begin(&parent, mission, Way::New)?;
    // Told by the name that it would have had.
    fill(fresh.path(), files).map_err(|(name, error)| named("write", &out.join(mission).join(name))(error))?;
    flush_folder(fresh.path()).map_err(named("write", &out.join(mission)))?;
    // An empty folder is replaced by the rename itself, on systems that can.
    if fs::rename(fresh.path(), &target).is_err() {
        swap(fresh.path(), &target, mission)?;
    }
    // It is no longer where its destructor would remove it.
    let _lock = fresh.keep();
    // It is in place; whether that is on the disk already, not every system says.
    let _ = flush_folder(&parent);
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

/// Removes all files of ours from `out/<mission>/`, and the folder if nothing else is in it. For bad input: no older commands
/// may pass for this mission's. They go all at once where there is room to rename the folder, else one by one, commands first. No folder
/// is no error.
///
/// # Errors
/// With the path of the first file that cannot be removed; the others are removed all the same.
pub fn discard(out: &Path, mission: &str) -> Result<(), OutputError> {
    let target = target(out, mission)?;
    if !target.is_dir() {
        return Ok(());
    }
    let parent = target.parent().unwrap_or(Path::new("/"));
    if FILES.iter().any(|name| target.join(name).symlink_metadata().is_ok())
        && let Ok(aside) = Passing::begin(parent, mission, Way::Gone)
        && fs::rename(&target, aside.was()).is_ok()
    {
        let (aside, _lock) = aside.keep();
        return leftovers::finish_gone(&aside, &target);
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

/// Writes files into a new folder, to the disk: all are written before the first is flushed, and they are flushed at once, which takes a
/// journalling disk a seventh of the time that one after the other takes. The name of one that could not be, and why.
fn fill<'a>(folder: &Path, files: &[(&'a str, &[u8])]) -> Result<(), (&'a str, io::Error)> {
    let mut open = Vec::with_capacity(files.len());
    for (name, bytes) in files {
        let made = File::create_new(folder.join(name)).and_then(|mut file| {
            file.write_all(bytes)?;
            Ok(file)
        });
        open.push((*name, made.map_err(|error| (*name, error))?));
    }
    let flush = |(name, file): &(&'a str, File)| file.sync_all().map_err(|error| (*name, error));
    thread::scope(|scope| {
        let waits = |one| thread::Builder::new().stack_size(STACK).spawn_scoped(scope, move || flush(one));
        // Where there are no more threads it is done here.
        let flushed: Vec<_> = open.iter().map(|one| waits(one).map_err(|_| flush(one))).collect();
        flushed.into_iter().try_for_each(|one| match one {
            Ok(thread) => thread.join().expect("flushing does not panic"),
            Err(result) => result,
        })
    })
}

/// Flushes a folder's entries to the disk, where the system can do that.
///
/// # Errors
/// The disk's.
fn flush_folder(path: &Path) -> io::Result<()> {
    let Ok(folder) = File::open(path) else { return Ok(()) };
    match folder.sync_all() {
        Err(error) if !matches!(error.kind(), io::ErrorKind::InvalidInput | io::ErrorKind::Unsupported) => Err(error),
        _ => Ok(()),
    }
}

/// Renames the old folder aside, the new one in, and removes the old. Other runs may do the same to the same folder: then the last one's
/// stays.
fn swap(fresh: &Path, target: &Path, mission: &str) -> Result<(), OutputError> {
    let parent = target.parent().unwrap_or(Path::new("/"));
    let mut asides: Vec<(PathBuf, Option<File>)> = Vec::new();
    let mut result = Ok(());
    for _ in 0..TRIES {
        match fs::rename(fresh, target) {
            Ok(()) => {
                // The new one must be on the disk before the old one is not.
                let _ = flush_folder(parent);
                // What cannot be tidied up is left beside.
                asides.iter().for_each(|(aside, _lock)| leftovers::finish_old(aside, target));
                return Ok(());
            }
            Err(error) => result = Err(named(if target.is_dir() { "replace" } else { "create" }, target)(error)),
        }
        if !target.is_dir() {
            continue;
        }
        let aside = match Passing::begin(parent, mission, Way::Old) {
            Ok(aside) => aside,
            Err(error) => {
                result = Err(error);
                break;
            }
        };
        match fs::rename(target, aside.was()) {
            Ok(()) => asides.push(aside.keep()),
            // Somebody else has taken it away just now.
            Err(error) if error.kind() == io::ErrorKind::NotFound => {}
            Err(error) => {
                result = Err(named("replace", target)(error));
                break;
            }
        }
    }
    // Put it back. If that fails too it stays where the next run finds it; the first reason is the one to tell.
    for (aside, _lock) in &asides {
        if fs::rename(aside.join(leftovers::WAS), target).is_ok() {
            let _ = fs::remove_dir(aside);
        }
    }
    result
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

#[cfg(test)]
mod tests;
