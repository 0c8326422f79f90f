//! Which missions a build is about.

use std::fs;
use std::path::{Path, PathBuf};

use crate::cli::compile::mission_name;
use crate::cli::output::spelled;
use crate::diag::{Diagnostic, Diagnostics};
use crate::inputs::missing;

/// A mission's file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Found {
    /// Its stem.
    pub name: String,
    /// Relative to where the program was started, where it lies within; as build systems spell it.
    pub path: PathBuf,
}

/// Keys at the top that only missions have. (robot.yaml has `urdf` and `drive`, map_server's sheets have `image`.)
const KEYS: [&str; 4] = ["robot", "start", "goal", "path"];

/// The missions: files that are named, whatever is in them; of folders, in order of their paths, every `.yaml` and `.yml` below that
/// has one of a mission's own keys at its top. Hidden files and folders, links to folders and `out` are passed over. A file that is
/// named twice counts once.
///
/// # Errors
/// A path that is not there; no mission at all; two missions of one name.
pub fn find(paths: &[PathBuf], start: &Path, out: &Path) -> Result<Vec<Found>, Diagnostics> {
    let mut files = Vec::new();
    let mut faults = Vec::new();
    let out = fs::canonicalize(out).ok();
    for path in paths {
        match fs::metadata(path) {
            Ok(found) if found.is_dir() => below(path, out.as_deref(), &mut files, &mut faults),
            Ok(_) => files.push(path.clone()),
            Err(error) => faults.push(unreadable(path, &error)),
        }
    }
    let mut missions: Vec<Found> = Vec::new();
    for file in &files {
        match mission_name(file) {
            Ok(name) => {
                let found = Found { name, path: spelled(file, start) };
                if !missions.contains(&found) {
                    missions.push(found);
                }
            }
            Err(more) => faults.extend(more.0),
        }
    }
    faults.extend(same_names(&missions));
    if !faults.is_empty() {
        return Err(Diagnostics(faults));
    }
    if missions.is_empty() {
        let shown: Vec<String> = paths.iter().map(|path| format!("`{}`", path.display())).collect();
        let fault = Diagnostic::error("build/no-mission", format!("no mission in {}", shown.join(", ")));
        let hint =
            "a mission is a .yaml with the key `robot`, `start`, `goal` or `path` at its top; other files can be named";
        return Err(fault.hint(hint).into());
    }
    Ok(missions)
}

fn unreadable(path: &Path, error: &std::io::Error) -> Diagnostic {
    let name = path.display();
    match error.kind() {
        std::io::ErrorKind::NotFound => {
            let fault = Diagnostic::error("build/not-there", format!("no such file or folder: `{name}`"));
            let near = missing(path).1.map_or(String::new(), |near| format!("{near} "));
            fault.hint(format!("{near}name missions, or folders that hold missions; without any, `missions` is built"))
        }
        _ => Diagnostic::error("build/unreadable", format!("cannot read `{name}`: {error}"))
            .hint("check its permissions"),
    }
}

fn below(folder: &Path, out: Option<&Path>, files: &mut Vec<PathBuf>, faults: &mut Vec<Diagnostic>) {
    let entries = match fs::read_dir(folder).and_then(Iterator::collect::<Result<Vec<_>, _>>) {
        Ok(entries) => entries,
        Err(error) => return faults.push(unreadable(folder, &error)),
    };
    let mut entries: Vec<_> = entries.iter().map(|entry| (entry.path(), entry.file_type())).collect();
    entries.sort_by(|(a, _), (b, _)| a.cmp(b));
    for (path, kind) in entries {
        let hidden = path.file_name().is_some_and(|name| name.to_string_lossy().starts_with('.'));
        if hidden {
            continue;
        }
        if kind.is_ok_and(|kind| kind.is_dir()) {
            if out.is_none_or(|out| fs::canonicalize(&path).is_ok_and(|path| path != out)) {
                below(&path, out, files, faults);
            }
        } else if path.extension().is_some_and(|e| e == "yaml" || e == "yml") && path.is_file() {
            match fs::read(&path) {
                Ok(bytes) if is_mission(&bytes) => files.push(path),
                Ok(_) => {}
                Err(error) => faults.push(unreadable(&path, &error)),
            }
        }
    }
}

/// Whether a YAML text has a key of a mission at its top.
fn is_mission(bytes: &[u8]) -> bool {
    let has = |line: &[u8], key: &str| {
        line.strip_prefix(key.as_bytes()).is_some_and(|rest| rest.trim_ascii_start().starts_with(b":"))
    };
    bytes.split(|byte| *byte == b'\n').any(|line| KEYS.iter().any(|key| has(line, key)))
}

/// A fault for each name that several missions have.
fn same_names(missions: &[Found]) -> Vec<Diagnostic> {
    let mut sorted: Vec<&Found> = missions.iter().collect();
    sorted.sort_by(|a, b| a.name.cmp(&b.name));
    let twins = sorted.chunk_by(|a, b| a.name == b.name).filter(|same| same.len() > 1);
    let fault = |same: &[&Found]| {
        let files: Vec<String> = same.iter().map(|found| format!("`{}`", found.path.display())).collect();
        let message =
            format!("{} are missions of one name: both would be written to `{}`", files.join(" and "), same[0].name);
        Diagnostic::error("build/same-name", message)
            .hint("rename one of them, or build them with another `--out` each")
    };
    twins.map(fault).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scratch(files: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().expect("a scratch folder");
        for (path, text) in files {
            let path = folder.path().join(path);
            fs::create_dir_all(path.parent().expect("below")).expect("scratch");
            fs::write(path, text).expect("scratch");
        }
        folder
    }

    fn names(folder: &tempfile::TempDir, paths: &[&str]) -> Result<Vec<String>, Vec<String>> {
        let paths: Vec<PathBuf> = paths.iter().map(|path| folder.path().join(path)).collect();
        let found = find(&paths, folder.path(), &folder.path().join("out"));
        found.map(|found| found.iter().map(|f| f.path.display().to_string()).collect()).map_err(|faults| {
            faults.0.iter().map(|d| d.message.replace(&folder.path().display().to_string(), "")).collect()
        })
    }

    #[test]
    fn missions_of_folders_are_found_by_their_keys_and_come_in_order() {
        let folder = scratch(&[
            ("m/b.yaml", "# why\nrobot : r.yaml\n"),
            ("m/a.yml", "map: {file: x}\ngoal: {x_m: 1}\n"),
            ("m/deep/er/c.yaml", "path: {bezier: []}\nrobto: r\n"),
            ("m/robot.yaml", "urdf: r.urdf\ndrive: {}\n"),
            ("m/map.yaml", "image: m.pgm\nresolution: 0.05\n"),
            ("m/notes.txt", "robot: x\n"),
            ("m/.hidden/d.yaml", "robot: r\n"),
            ("m/.e.yaml", "robot: r\n"),
            ("out/f/f.yaml", "robot: r\n"),
            ("odd", "{robot: r}"),
        ]);
        assert_eq!(names(&folder, &["m"]), Ok(vec!["m/a.yml".into(), "m/b.yaml".into(), "m/deep/er/c.yaml".into()]));
        let all = names(&folder, &["odd", "m/b.yaml", "."]).expect("found");
        assert_eq!(all, ["odd", "m/b.yaml", "m/a.yml", "m/deep/er/c.yaml"], "named first, each once, nothing of out/");
    }

    #[test]
    fn two_missions_of_one_name_and_paths_that_are_not_there_are_faults() {
        let folder = scratch(&[("m/a.yaml", "robot: r"), ("n/a.yaml", "robot: r"), ("n/b.yaml", "x: 1")]);
        assert_eq!(
            names(&folder, &["m", "n"]),
            Err(vec!["`m/a.yaml` and `n/a.yaml` are missions of one name: both would be written to `a`".into()])
        );
        assert_eq!(names(&folder, &["none"]), Err(vec!["no such file or folder: `/none`".into()]));
        assert_eq!(names(&folder, &["n/b.yaml"]), Ok(vec!["n/b.yaml".into()]), "named, so taken");
        fs::remove_file(folder.path().join("n/a.yaml")).expect("scratch");
        assert_eq!(names(&folder, &["n"]), Err(vec!["no mission in `/n`".into()]));
    }
}
