//! Temporary folders beside the output folders, and what killed runs leave of them.
//!
//! `.<mission>.trajc-<random>.<way>` lies beside `<mission>` while a run is at it, which holds a lock on it. Locks end with their
//! process, so a folder without one is left over, and its ending tells what to do with it.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use super::{FILES, OutputError, TRIES, named, remove_ours};

/// A mission's folder within a temporary one that it was renamed into.
pub const WAS: &str = "was";

/// Where files in a temporary folder are on their way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// In: they are being written.
    New,
    /// Out, in favour of new ones; without those they are the mission's still.
    Old,
    /// Out for good.
    Gone,
}

impl Way {
    const ALL: [Self; 3] = [Self::New, Self::Old, Self::Gone];

    fn suffix(self) -> &'static str {
        match self {
            Self::New => ".new",
            Self::Old => ".old",
            Self::Gone => ".gone",
        }
    }
}

/// A temporary folder of this run: removed when it is dropped, with all that is in it.
pub struct Passing {
    folder: tempfile::TempDir,
    lock: Option<File>,
}

impl Passing {
    /// Makes one, and locks it.
    ///
    /// # Errors
    /// It cannot be made.
    pub fn begin(parent: &Path, mission: &str, way: Way) -> Result<Self, OutputError> {
        let name = format!(".{mission}.trajc-");
        let new = || tempfile::Builder::new().prefix(&name).suffix(way.suffix()).tempdir_in(parent);
        let mut folder = new().map_err(named("create a folder in", parent))?;
        for _ in 0..TRIES {
            // Waits for who has just taken it for a leftover; they remove it.
            let lock = File::open(folder.path()).ok().filter(|file| file.lock().is_ok());
            if folder.path().is_dir() {
                return Ok(Self { folder, lock });
            }
            folder = new().map_err(named("create a folder in", parent))?;
        }
        Ok(Self { folder, lock: None })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Where in it a mission's folder is put.
    pub fn was(&self) -> PathBuf {
        self.path().join(WAS)
    }

    /// It is no longer removed when it is dropped: it has become something else, or holds what must not be lost. The lock goes on.
    pub fn keep(self) -> (PathBuf, Option<File>) {
        (self.folder.keep(), self.lock)
    }
}

/// An advisory lock on a folder, where the system has such; `None`: it has not, or someone else holds it.
pub fn lock(folder: &Path) -> Option<File> {
    let file = File::open(folder).ok()?;
    file.try_lock().ok()?;
    Some(file)
}

/// Removes what runs of this mission left that were killed: temporary folders whose maker no longer holds their lock.
/// Where locks do not work they stay, and do no harm.
pub fn clear_leftovers(parent: &Path, mission: &str) {
    clear(parent, &|name| name == mission);
}

/// The same of all missions.
pub fn sweep(out: &Path) {
    // As `target` has it: the process may stand in a folder that is replaced.
    if let Ok(out) = std::path::absolute(out) {
        clear(&out, &|_| true);
    }
}

fn clear(parent: &Path, wanted: &dyn Fn(&str) -> bool) {
    for entry in fs::read_dir(parent).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let Some((mission, way)) = name.to_str().and_then(left_by).filter(|(mission, _)| wanted(mission)) else {
            continue;
        };
        if !entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            continue;
        }
        let Some(_lock) = lock(&entry.path()) else { continue };
        let (folder, target) = (entry.path(), parent.join(mission));
        match way {
            Way::New => {
                let _ = remove_ours(&folder);
            }
            Way::Old => {
                // Killed between the two renames: the old set is all there is.
                if !target.exists() {
                    let _ = fs::rename(folder.join(WAS), &target);
                }
                finish_old(&folder, &target);
            }
            Way::Gone => {
                let _ = finish_gone(&folder, &target);
            }
        }
        let _ = fs::remove_dir(&folder);
    }
}

/// Removes an older set of files now that there is a newer one.
pub fn finish_old(aside: &Path, target: &Path) {
    let was = aside.join(WAS);
    keep_foreign(&was, target);
    let _ = remove_ours(&was);
    let _ = fs::remove_dir(&was);
    let _ = fs::remove_dir(aside);
}

/// Removes a set of files for good; what is not ours goes back to where it was.
///
/// # Errors
/// As [`remove_ours`].
pub fn finish_gone(aside: &Path, target: &Path) -> Result<(), OutputError> {
    let was = aside.join(WAS);
    let removed = remove_ours(&was);
    if fs::remove_dir(&was).is_err() && fs::rename(&was, target).is_err() {
        // Somebody has made a new one meanwhile.
        keep_foreign(&was, target);
        let _ = fs::remove_dir(&was);
    }
    let _ = fs::remove_dir(aside);
    removed
}

/// Moves what is not ours (a log, a plot) from one folder to another, but over nothing.
pub fn keep_foreign(from: &Path, to: &Path) {
    for entry in fs::read_dir(from).into_iter().flatten().flatten() {
        let (name, place) = (entry.file_name(), to.join(entry.file_name()));
        if !FILES.iter().any(|file| name == *file) && place.symlink_metadata().is_err() {
            let _ = fs::rename(entry.path(), place);
        }
    }
}

/// The mission whose temporary folder has this name, and what it is for.
fn left_by(name: &str) -> Option<(&str, Way)> {
    let (mission, rest) = name.strip_prefix('.')?.rsplit_once(".trajc-")?;
    let way = Way::ALL.into_iter().find(|way| rest.ends_with(way.suffix()))?;
    Some((mission, way))
}
