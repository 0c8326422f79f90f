//! Files that belong to no mission's folder: a drawing, a robot.yaml. Whole or as they were before, too.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::Path;

use super::{flush_folder, reason, room};
use crate::diag::{Diagnostic, Diagnostics};

/// Makes a folder and those above it.
///
/// # Errors
/// It cannot be made.
pub fn make_folder(path: &Path) -> Result<(), Diagnostics> {
    fs::create_dir_all(path).map_err(|error| {
        let message = format!("cannot make folder `{}`: {}", path.display(), reason(&error));
        let hint = room(&error).unwrap_or_else(|| "the folder above must be writable".to_owned());
        Diagnostic::error("output/io", message).hint(hint).into()
    })
}

/// Writes a file, all of it or nothing: beside it first, then renamed. Links are followed; pipes and devices are written to.
///
/// # Errors
/// It cannot be written; an older one is then as it was.
pub fn write_file(path: &Path, bytes: &[u8]) -> Result<(), Diagnostics> {
    replace(path, bytes).map_err(|error| {
        let message = format!("cannot write `{}`: {}", path.display(), reason(&error));
        let hint = room(&error).unwrap_or_else(|| "the folder must exist and be writable".to_owned());
        Diagnostic::error("output/io", message).hint(hint).into()
    })
}

fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let Ok(found) = fs::metadata(path) else {
        // A link to what is not there yet makes it.
        return if path.is_symlink() { fs::write(path, bytes) } else { put(path, None, bytes) };
    };
    if !found.is_file() {
        return fs::write(path, bytes);
    }
    // Who may not write to a file may not replace it either, though the system would let them.
    File::options().write(true).open(path)?;
    let target = fs::canonicalize(path)?;
    match put(&target, Some(&found), bytes) {
        // A file may be writable in a folder that is not: then there is no other way.
        Err(error) if error.kind() == io::ErrorKind::PermissionDenied => fs::write(&target, bytes),
        result => result,
    }
}

/// Puts a file in the place of this one, if there is one.
fn put(path: &Path, older: Option<&fs::Metadata>, bytes: &[u8]) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = tempfile::Builder::new();
    builder.prefix(".trajc-").suffix(".new");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder)?;
    file.write_all(bytes)?;
    if let Some(older) = older {
        // Whose it is only root can pass on.
        #[cfg(unix)]
        let _ = {
            use std::os::unix::fs::{MetadataExt, fchown};
            fchown(file.as_file(), Some(older.uid()), Some(older.gid()))
        };
        file.as_file().set_permissions(older.permissions())?;
    }
    file.as_file().sync_all()?;
    file.persist(path).map_err(|error| error.error)?;
    let _ = flush_folder(folder);
    Ok(())
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::PermissionsExt;

    #[test]
    fn a_file_is_replaced_with_its_permissions_through_a_link_and_nothing_is_left_beside() {
        let scratch = tempfile::tempdir().expect("a scratch folder");
        let (file, link) = (scratch.path().join("robot.yaml"), scratch.path().join("link"));
        write_file(&file, b"one").expect("room");
        fs::set_permissions(&file, fs::Permissions::from_mode(0o640)).expect("scratch");
        std::os::unix::fs::symlink("robot.yaml", &link).expect("scratch");
        write_file(&link, b"two").expect("room");
        assert_eq!(fs::read(&file).expect("there"), b"two");
        assert!(link.is_symlink());
        assert_eq!(fs::metadata(&file).expect("there").permissions().mode() & 0o777, 0o640);
        assert_eq!(fs::read_dir(scratch.path()).expect("there").count(), 2);
        write_file(Path::new("/dev/null"), b"three").expect("a device is written to");
        assert!(!Path::new("/dev/null").metadata().expect("there").is_file());
    }

    #[test]
    fn a_new_file_has_the_permissions_that_the_umask_gives() {
        let scratch = tempfile::tempdir().expect("a scratch folder");
        let (ours, plain) = (scratch.path().join("a"), scratch.path().join("b"));
        write_file(&ours, b"").expect("room");
        fs::write(&plain, b"").expect("room");
        let mode = |path: &Path| fs::metadata(path).expect("there").permissions().mode() & 0o777;
        assert_eq!(mode(&ours), mode(&plain));
    }
}
