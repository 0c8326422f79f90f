//! Hashes of files, each file looked at once a build, and read only where it may have changed.
//!
//! What decides is a file's BLAKE3. A file whose size, times and inode are as they were when it was hashed is not read again; so that
//! this holds across builds, `out/.trajc-build` keeps them. It is a cache: without it everything is hashed once. What a build writes
//! is noted there at once and not held, so that memory does not grow with the number of missions.

use std::collections::BTreeMap;
use std::fs::{self, Metadata};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, UNIX_EPOCH};

use blake3::Hash;

use crate::cli::inputs::{regular, tidy};

/// The cache's file in the output folder.
pub const CACHE: &str = ".trajc-build";
/// What it is called until it is whole.
const UNFINISHED: &str = ".trajc-build.new";
/// First line of that file.
const HEAD: &str = "trajc.hashes/1";
/// Two changes within this time may leave a file with the same times: clocks of file systems tick that slowly.
const TICK: Duration = Duration::from_millis(20);

/// What tells that a file was written to, without reading it. On Unix the time of change (ctime) cannot be set by anybody.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Stamp {
    size: u64,
    modified_ns: i128,
    changed_ns: i128,
    inode: u64,
}

impl Stamp {
    fn of(found: &Metadata) -> Option<Self> {
        let modified = found.modified().ok()?;
        let modified_ns = match modified.duration_since(UNIX_EPOCH) {
            Ok(after) => i128::try_from(after.as_nanos()).ok()?,
            Err(before) => -i128::try_from(before.duration().as_nanos()).ok()?,
        };
        let (changed_ns, inode) = changed(found);
        Some(Self { size: found.len(), modified_ns, changed_ns, inode })
    }
}

#[cfg(unix)]
fn changed(found: &Metadata) -> (i128, u64) {
    use std::os::unix::fs::MetadataExt;
    (i128::from(found.ctime()) * 1_000_000_000 + i128::from(found.ctime_nsec()), found.ino())
}

#[cfg(not(unix))]
fn changed(_: &Metadata) -> (i128, u64) {
    (0, 0)
}

#[derive(Debug, Clone, Copy)]
struct Known {
    stamp: Stamp,
    hash: Hash,
    /// Found to hold in this build.
    looked: bool,
}

#[derive(Default)]
struct Inner {
    known: BTreeMap<PathBuf, Known>,
    /// Something to be kept for the next build.
    dirty: bool,
    /// The next build's cache, as far as it is written: what this one has made.
    notes: Option<Notes>,
}

/// The cache while it is being written. Of two lines of one file the later one counts.
struct Notes(io::Result<BufWriter<fs::File>>);

impl Notes {
    fn begin(out: &Path) -> Self {
        // One build at a time has the folder, so the name is nobody else's.
        let mut notes = Self(fs::File::create(out.join(UNFINISHED)).map(BufWriter::new));
        notes.line(HEAD);
        notes
    }

    /// What cannot be written is found at the end.
    fn line(&mut self, line: &str) {
        if let Ok(file) = &mut self.0
            && let Err(error) = writeln!(file, "{line}")
        {
            self.0 = Err(error);
        }
    }

    fn add(&mut self, path: &Path, stamp: &Stamp, hash: &Hash) {
        let Some(name) = path.to_str().filter(|name| !name.contains('\n')) else { return };
        let Stamp { size, modified_ns, changed_ns, inode } = stamp;
        self.line(&format!("{} {size} {modified_ns} {changed_ns} {inode} {name}", hash.to_hex()));
    }
}

/// Hashes of files by their absolute paths. Shared by all workers.
pub struct Hashes {
    /// What relative paths are relative to.
    start: PathBuf,
    /// Where they are kept.
    out: PathBuf,
    inner: Mutex<Inner>,
}

impl Hashes {
    /// With what the builds before left in the output folder.
    pub fn load(start: &Path, out: &Path) -> Self {
        let known = fs::read_to_string(out.join(CACHE)).map(|text| parse(&text)).unwrap_or_default();
        let inner = Mutex::new(Inner { known, dirty: false, notes: None });
        Self { start: start.to_path_buf(), out: start.join(out), inner }
    }

    fn inner(&self) -> MutexGuard<'_, Inner> {
        // A worker that panics leaves the map whole.
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn key(&self, path: &Path) -> PathBuf {
        tidy(&self.start.join(path))
    }

    /// The hash of a file as it was when this build first looked.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn hash(&self, path: &Path) -> io::Result<Hash> {
        let key = self.key(path);
        if let Some(known) = self.inner().known.get(&key).filter(|known| known.looked) {
            return Ok(known.hash);
        }
        let stamp = settled(&key)?;
        if let Some(hash) = self.unchanged(&key, stamp) {
            return Ok(hash);
        }
        let mut hasher = blake3::Hasher::new();
        io::copy(&mut fs::File::open(&key)?, &mut hasher)?;
        let hash = hasher.finalize();
        self.remember(key, stamp, hash);
        Ok(hash)
    }

    /// A file's bytes as they are now, and their hash.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn read(&self, path: &Path) -> io::Result<(Vec<u8>, Hash)> {
        let key = self.key(path);
        let stamp = settled(&key)?;
        let bytes = fs::read(&key)?;
        let hash = self.unchanged(&key, stamp).unwrap_or_else(|| {
            let hash = blake3::hash(&bytes);
            self.remember(key, stamp, hash);
            hash
        });
        Ok((bytes, hash))
    }

    /// Notes the hash of a file that this build has written.
    pub fn wrote(&self, path: &Path, hash: Hash) {
        let Some(stamp) = fs::metadata(path).ok().and_then(|found| Stamp::of(&found)) else { return };
        let key = self.key(path);
        let mut inner = self.inner();
        // As it was before.
        inner.known.remove(&key);
        inner.notes.get_or_insert_with(|| Notes::begin(&self.out)).add(&key, &stamp, &hash);
    }

    /// The known hash, if the stamp is as it was.
    fn unchanged(&self, key: &Path, stamp: Option<Stamp>) -> Option<Hash> {
        let mut inner = self.inner();
        let known = inner.known.get_mut(key).filter(|known| Some(known.stamp) == stamp)?;
        known.looked = true;
        Some(known.hash)
    }

    fn remember(&self, key: PathBuf, stamp: Option<Stamp>, hash: Hash) {
        if let Some(stamp) = stamp {
            let mut inner = self.inner();
            inner.known.insert(key, Known { stamp, hash, looked: true });
            inner.dirty = true;
        }
    }

    /// Keeps what is known for the next build, but for files that are gone. That it cannot be kept is no error: it is a cache.
    pub fn save(&self) {
        let mut inner = self.inner();
        let dirty = std::mem::take(&mut inner.dirty) || inner.notes.is_some();
        if !dirty {
            return;
        }
        let mut notes = inner.notes.take().unwrap_or_else(|| Notes::begin(&self.out));
        for (path, Known { stamp, hash, looked }) in &inner.known {
            if *looked || path.exists() {
                notes.add(path, stamp, hash);
            }
        }
        let unfinished = self.out.join(UNFINISHED);
        let written = notes.0.and_then(|mut file| file.flush());
        if written.and_then(|()| fs::rename(&unfinished, self.out.join(CACHE))).is_err() {
            // Half of it may be there, and take the last room on a disk.
            let _ = fs::remove_file(&unfinished);
        }
    }
}

/// Removes what a build left that was killed while it kept its hashes.
pub fn sweep(out: &Path) {
    let _ = fs::remove_file(out.join(UNFINISHED));
}

/// How long ago a file was written to. What decides is the time that nobody can set: files copied with their dates look old. `None`:
/// in a time yet to come.
#[cfg(unix)]
fn age(found: &Metadata) -> Option<Duration> {
    let written = Duration::from_nanos(u64::try_from(changed(found).0).ok()?);
    UNIX_EPOCH.elapsed().ok()?.checked_sub(written)
}

#[cfg(not(unix))]
fn age(found: &Metadata) -> Option<Duration> {
    found.modified().ok()?.elapsed().ok()
}

/// The stamp of a file that was not written to within the last tick of the clock; waits where it was. A time yet to come (the clock was
/// set back) is none that a change made now could have.
fn settled(path: &Path) -> io::Result<Option<Stamp>> {
    regular(path)?;
    let found = fs::metadata(path)?;
    match age(&found).and_then(|age| TICK.checked_sub(age)) {
        // It may have been written to while we waited; then the next build sees another stamp and reads it.
        Some(rest) => {
            std::thread::sleep(rest);
            Ok(Stamp::of(&fs::metadata(path)?))
        }
        None => Ok(Stamp::of(&found)),
    }
}

fn parse(text: &str) -> BTreeMap<PathBuf, Known> {
    let Some(lines) = text.strip_prefix(HEAD) else { return BTreeMap::new() };
    let line = |line: &str| {
        let mut parts = line.splitn(6, ' ');
        let hash = Hash::from_hex(parts.next()?).ok()?;
        let size = parts.next()?.parse().ok()?;
        let [modified_ns, changed_ns] = [parts.next()?.parse().ok()?, parts.next()?.parse().ok()?];
        let inode = parts.next()?.parse().ok()?;
        let stamp = Stamp { size, modified_ns, changed_ns, inode };
        Some((PathBuf::from(parts.next()?), Known { stamp, hash, looked: false }))
    };
    lines.lines().filter_map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scratch() -> tempfile::TempDir {
        tempfile::tempdir().expect("a scratch folder")
    }

    #[test]
    fn a_file_is_hashed_again_in_the_next_build_only_where_it_changed() {
        let folder = scratch();
        let (file, other) = (folder.path().join("a b.txt"), folder.path().join("other"));
        fs::write(&file, "one").expect("scratch");
        fs::write(&other, "gone soon").expect("scratch");
        let first = Hashes::load(folder.path(), folder.path());
        assert_eq!(first.hash(Path::new("a b.txt")).expect("there"), blake3::hash(b"one"));
        first.hash(&other).expect("there");
        first.save();
        fs::remove_file(&other).expect("scratch");

        let second = Hashes::load(folder.path(), folder.path());
        let stamp = Stamp::of(&fs::metadata(&file).expect("there"));
        assert_eq!(second.unchanged(&file, stamp), Some(blake3::hash(b"one")), "known without being read");
        assert!(second.hash(&other).is_err());
        fs::write(&file, "two").expect("scratch");
        let third = Hashes::load(folder.path(), folder.path());
        assert_eq!(third.hash(&file).expect("there"), blake3::hash(b"two"), "same size, other time");
        third.save();
        let kept = fs::read_to_string(folder.path().join(CACHE)).expect("kept");
        assert!(kept.contains("a b.txt") && !kept.contains("other"), "{kept}");
    }

    #[test]
    fn files_of_one_build_are_looked_at_once_but_read_as_they_are() {
        let folder = scratch();
        let file = folder.path().join("a");
        fs::write(&file, "one").expect("scratch");
        let hashes = Hashes::load(folder.path(), folder.path());
        assert_eq!(hashes.hash(&file).expect("there"), blake3::hash(b"one"));
        fs::write(&file, "two").expect("scratch");
        assert_eq!(hashes.hash(&file).expect("there"), blake3::hash(b"one"));
        assert_eq!(hashes.read(&file).expect("there"), (b"two".to_vec(), blake3::hash(b"two")));
    }

    #[test]
    fn a_change_within_a_tick_of_the_clock_is_seen_whatever_date_the_file_is_given() {
        let folder = scratch();
        let file = folder.path().join("a");
        for date in [UNIX_EPOCH + 300 * TICK, std::time::SystemTime::now() + Duration::from_secs(1 << 30)] {
            for _ in 0..5 {
                let put = |text: &str| {
                    fs::write(&file, text).expect("scratch");
                    fs::File::options().write(true).open(&file).and_then(|f| f.set_modified(date)).expect("a date");
                };
                put("one");
                let first = Hashes::load(folder.path(), folder.path());
                assert_eq!(first.hash(&file).expect("there"), blake3::hash(b"one"));
                put("two");
                first.save();
                let second = Hashes::load(folder.path(), folder.path());
                assert_eq!(second.hash(&file).expect("there"), blake3::hash(b"two"));
            }
        }
    }

    #[test]
    fn a_broken_cache_is_an_empty_one() {
        let folder = scratch();
        for text in ["", "trajc.hashes/1\nnonsense\n", "something else\n", "trajc.hashes/1\nzz 1 2 3 4 a\n"] {
            fs::write(folder.path().join(CACHE), text).expect("scratch");
            assert!(Hashes::load(folder.path(), folder.path()).inner().known.is_empty());
        }
    }
}
