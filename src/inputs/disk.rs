//! Files as they lie on the disk, or as they are attached to a command file.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use super::tidy;
use crate::diag::{Diagnostic, Diagnostics, Source, Span, nearest};
use crate::memory;
use crate::pipeline::TextFile;
use crate::robot::Files;

/// A file's name and bytes.
pub type Named = (String, Vec<u8>);

/// Reads a file's bytes and their hash.
pub type ReadFile = dyn Fn(&Path) -> io::Result<(Vec<u8>, blake3::Hash)>;

/// Reads files and remembers which.
#[derive(Clone, Default)]
pub struct Disk {
    /// Who reads instead of the disk itself.
    reader: Option<Rc<ReadFile>>,
    /// Files that may lie beside others and were not there.
    absent: Rc<RefCell<Vec<PathBuf>>>,
    /// Path and hash of each file read, in order.
    read: Rc<RefCell<Vec<(PathBuf, blake3::Hash)>>>,
    /// What the robot stage read.
    meshes: Rc<RefCell<Vec<Named>>>,
    /// Texts and meshes, where they are not to come from the disk. Keys are tidy paths.
    attached: Option<Rc<BTreeMap<PathBuf, Vec<u8>>>>,
}

impl Disk {
    /// Texts and meshes come from these files alone, found by their paths (tidied); meshes also by a file name that only one of
    /// them has. Maps still come from the disk.
    pub(super) fn attached(files: BTreeMap<PathBuf, Vec<u8>>) -> Self {
        Self { attached: Some(Rc::new(files)), ..Self::default() }
    }

    /// Files are read by somebody else, who may know their hashes.
    pub fn through(reader: Rc<ReadFile>) -> Self {
        Self { reader: Some(reader), ..Self::default() }
    }

    /// Files read so far with their hashes, in order, each once.
    pub fn files(&self) -> Vec<(PathBuf, blake3::Hash)> {
        self.read.borrow().clone()
    }

    /// Files that would have been read too, had they been there.
    pub fn absent(&self) -> Vec<PathBuf> {
        self.absent.borrow().clone()
    }

    /// Counts a file as read whose bytes somebody else has read.
    pub fn know(&self, path: &Path, hash: blake3::Hash) {
        let mut read = self.read.borrow_mut();
        if !read.iter().any(|(known, _)| known == path) {
            read.push((path.to_path_buf(), hash));
        }
    }

    /// Counts a file as missed.
    pub fn miss(&self, path: &Path) {
        self.absent.borrow_mut().push(path.to_path_buf());
    }

    /// Paths of all files read so far, in order, each once.
    pub fn paths(&self) -> Vec<PathBuf> {
        self.read.borrow().iter().map(|(path, _)| path.clone()).collect()
    }

    /// Meshes read so far: the path by which the robot stage asked for each, and bytes.
    pub fn meshes(&self) -> Vec<Named> {
        self.meshes.borrow().clone()
    }

    /// One hash over the bytes of all files read: of their hashes, in order.
    pub fn hash(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for (_, hash) in self.read.borrow().iter() {
            hasher.update(hash.as_bytes());
        }
        hasher.finalize().to_hex().to_string()
    }

    fn remember(&self, path: &Path, bytes: Vec<u8>) -> Vec<u8> {
        if !self.read.borrow().iter().any(|(known, _)| known == path) {
            self.know(path, blake3::hash(&bytes));
        }
        bytes
    }

    fn on_disk(&self, path: &Path) -> io::Result<Vec<u8>> {
        regular(path)?;
        let Some(reader) = &self.reader else { return Ok(self.remember(path, std::fs::read(path)?)) };
        let (bytes, hash) = reader(path)?;
        self.know(path, hash);
        Ok(bytes)
    }

    /// A text or mesh.
    fn bytes(&self, path: &Path) -> io::Result<Vec<u8>> {
        let Some(attached) = &self.attached else { return self.on_disk(path) };
        let found = attached.get(&tidy(path)).or_else(|| {
            let mut alike = attached.iter().filter(|(known, _)| known.file_name() == path.file_name());
            let (_, first) = alike.next()?;
            alike.next().is_none().then_some(first)
        });
        let bytes = found.cloned().ok_or_else(|| io::Error::new(io::ErrorKind::NotFound, "is not attached"))?;
        Ok(self.remember(path, bytes))
    }

    /// Reads bytes from the disk, or says which file could not be read and who names it.
    ///
    /// # Errors
    /// The file is missing or unreadable.
    pub fn binary(&self, path: &Path, named_by: Option<&Span>) -> Result<Vec<u8>, Diagnostics> {
        self.on_disk(path).map_err(|error| unreadable(path, &error, named_by).into())
    }

    /// Reads bytes that may be attached.
    ///
    /// # Errors
    /// The file is missing or unreadable.
    pub fn file(&self, path: &Path, named_by: Option<&Span>) -> Result<Vec<u8>, Diagnostics> {
        self.bytes(path).map_err(|error| unreadable(path, &error, named_by).into())
    }

    /// Whether files come from the disk, not from attachments.
    pub(super) fn is_real(&self) -> bool {
        self.attached.is_none()
    }

    /// Reads a text.
    ///
    /// # Errors
    /// The file is missing, unreadable or not UTF-8.
    pub fn text(&self, path: &Path, named_by: Option<&Span>) -> Result<TextFile, Diagnostics> {
        let bytes = self.bytes(path).map_err(|error| unreadable(path, &error, named_by))?;
        let name = path.display().to_string();
        match String::from_utf8(bytes) {
            Ok(text) => Ok(TextFile { name, text }),
            Err(error) => {
                let at = error.utf8_error().valid_up_to();
                let message = format!("`{name}` is not UTF-8 text: byte {at} begins no character");
                // Up to there it is text, so the place is the same in what can be shown of it.
                let text = String::from_utf8_lossy(error.as_bytes()).into_owned();
                let end = at + text[at..].chars().next().map_or(0, char::len_utf8);
                let span = Span::new(&Arc::new(Source { name, text }), at..end);
                Err(Diagnostic::error("input/not-text", message).at(&span).hint("save the file as UTF-8").into())
            }
        }
    }
}

impl Files for Disk {
    fn nearest(&self, path: &Path) -> Option<String> {
        // Of a folder that is not there others beside it tell nothing: meshes are looked for in many places.
        let (lost, near) = near(path);
        near.filter(|_| self.is_real() && lost == path)
    }

    fn may_leave(&self, path: &Path) -> bool {
        // What is attached is not on the disk.
        self.attached.is_some() || super::allowed(path)
    }

    fn read(&mut self, path: &Path) -> io::Result<Vec<u8>> {
        let bytes = self.bytes(path).inspect_err(|error| {
            // Were it there, it would be read instead of a later candidate.
            if error.kind() == io::ErrorKind::NotFound {
                self.miss(path);
            }
        })?;
        let name = path.display().to_string();
        let mut meshes = self.meshes.borrow_mut();
        if !meshes.iter().any(|(known, _)| *known == name) {
            meshes.push((name, bytes.clone()));
        }
        Ok(bytes)
    }
}

/// Whether a file can be read at all: pipes and devices may never end, and what is too large is not begun.
///
/// # Errors
/// It is not there, no file, or takes more memory than there may be used.
pub fn regular(path: &Path) -> io::Result<()> {
    let found = std::fs::metadata(path)?;
    if found.is_dir() {
        return Err(io::Error::new(io::ErrorKind::IsADirectory, "is a folder"));
    }
    if !found.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "is a pipe or a device"));
    }
    memory::fits(found.len().into()).map_err(|fault| io::Error::new(io::ErrorKind::FileTooLarge, fault))
}

fn unreadable(path: &Path, error: &io::Error, named_by: Option<&Span>) -> Diagnostic {
    let name = path.display().to_string();
    let (what, hint) = match error.kind() {
        io::ErrorKind::NotFound => {
            let (why, near) = missing(path);
            // The file that names it was not meant.
            let own = named_by.and_then(|span| Path::new(&span.source.name).file_name()?.to_str());
            let near = near.filter(|near| own.is_none_or(|own| !near.contains(&format!("`{own}`"))));
            let relative = if named_by.is_some() {
                "paths are relative to the file that names them"
            } else {
                "paths are relative to the folder where the program runs"
            };
            let hint = near.map_or(relative.to_owned(), |near| format!("{near} {relative}"));
            (format!("no such file: `{name}`{why}"), hint)
        }
        io::ErrorKind::IsADirectory => {
            let mut inside = names(path, |kind| kind.is_file());
            // What is about the files comes last.
            inside.sort_by_key(|name| name.ends_with(".md"));
            let shown: Vec<String> = inside.iter().take(4).map(|name| format!("`{name}`")).collect();
            let such = if shown.is_empty() { String::new() } else { format!(", such as {}", shown.join(", ")) };
            (format!("`{name}` is a folder, expected a file"), format!("name the file in it{such}"))
        }
        io::ErrorKind::InvalidInput => {
            (format!("`{name}` {error}: only files are read"), "write what comes out of it to a file first".into())
        }
        io::ErrorKind::FileTooLarge => (format!("`{name}` would take {error}"), memory::HINT.into()),
        // A path below a file.
        io::ErrorKind::NotADirectory => {
            let file = path.ancestors().find(|above| above.is_file()).unwrap_or(path).display().to_string();
            (format!("no such file: `{name}`: `{file}` is a file, no folder"), "check the path".into())
        }
        _ if path.is_symlink() => (format!("cannot read `{name}`: {error}"), "check where the link leads".into()),
        _ => (format!("cannot read `{name}`: {error}"), "check its permissions".into()),
    };
    let diagnostic = Diagnostic::error("input/unreadable", what).hint(hint);
    match named_by {
        Some(span) => diagnostic.at(span),
        None => diagnostic.file(name),
    }
}

/// What a folder holds of a kind, sorted; hidden files are nobody's input.
fn names(folder: &Path, kind: impl Fn(&std::fs::FileType) -> bool) -> Vec<String> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut names: Vec<String> = entries
        .filter_map(|entry| {
            let entry = entry.ok().filter(|entry| entry.file_type().is_ok_and(|found| kind(&found)))?;
            entry.file_name().into_string().ok().filter(|name| !name.starts_with('.'))
        })
        .collect();
    names.sort();
    names
}

/// The first folder on the way to a file that is not there, else the file; and the name beside it that may have been meant.
fn near(path: &Path) -> (&Path, Option<String>) {
    let mut lost = path;
    while let Some(parent) = lost.parent().filter(|parent| !parent.as_os_str().is_empty() && !parent.is_dir()) {
        lost = parent;
    }
    let wrong = lost.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let of_kind = |folders: bool| {
        let known = names(&super::folder_of(lost), |kind| kind.is_symlink() || kind.is_dir() == folders);
        nearest(&wrong, known.iter().map(String::as_str)).map(str::to_owned)
    };
    // Some names may be a folder's or a file's.
    (lost, of_kind(lost != path).or_else(|| of_kind(true)))
}

/// Why a file may not be there (its folder is not), and what was meant, as far as can be told; for messages.
pub fn missing(path: &Path) -> (String, Option<String>) {
    let (lost, near) = near(path);
    let why = if lost == path { String::new() } else { format!(": there is no folder `{}`", lost.display()) };
    (why, near.map(|near| format!("did you mean `{near}`?")))
}
