//! A temporary folder with a small mission in it, and the real program run there.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// What a run printed, and its exit code.
#[derive(Debug)]
pub struct Run {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

/// A folder with `robots/` and `maps/first.csv` as shipped, and `missions/a.yaml`: once around a post.
pub struct Sandbox {
    folder: tempfile::TempDir,
}

pub fn repository() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

impl Sandbox {
    /// Nothing in it.
    pub fn empty() -> Self {
        Self { folder: tempfile::tempdir().expect("a temporary folder") }
    }

    pub fn new() -> Self {
        let sandbox = Self::empty();
        sandbox.ship("robots");
        sandbox.ship("maps/first.csv");
        sandbox.ship("missions/first.yaml");
        fs::rename(sandbox.path("missions/first.yaml"), sandbox.path("missions/a.yaml")).expect("rename");
        sandbox
    }

    /// Copies a file or folder of the repository here.
    pub fn ship(&self, path: &str) {
        copy(&repository().join(path), &self.path(path));
    }

    pub fn path(&self, path: &str) -> PathBuf {
        self.folder.path().join(path)
    }

    pub fn write(&self, path: &str, bytes: impl AsRef<[u8]>) {
        let path = self.path(path);
        fs::create_dir_all(path.parent().expect("below the folder")).expect("folders");
        fs::write(path, bytes).expect("write");
    }

    pub fn read(&self, path: &str) -> Vec<u8> {
        fs::read(self.path(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
    }

    pub fn text(&self, path: &str) -> String {
        String::from_utf8(self.read(path)).expect("text")
    }

    /// Replaces every `from` in a file; there must be one.
    pub fn edit(&self, path: &str, from: &str, to: &str) {
        let text = self.text(path);
        assert!(text.contains(from), "{path} has no `{from}`:\n{text}");
        self.write(path, text.replace(from, to));
    }

    pub fn exists(&self, path: &str) -> bool {
        self.path(path).exists()
    }

    pub fn remove(&self, path: &str) {
        fs::remove_file(self.path(path)).expect("remove");
    }

    /// Runs the program in this folder.
    pub fn run(&self, args: &[&str]) -> Run {
        self.run_in(".", args)
    }

    /// Runs the program in a folder below this one; the folder's name in what it prints becomes `<here>`.
    pub fn run_in(&self, folder: &str, args: &[&str]) -> Run {
        let output = Command::new(env!("CARGO_BIN_EXE_trajc"))
            .args(args)
            .current_dir(self.path(folder))
            .env("COLUMNS", "100")
            .env_remove("NO_COLOR")
            .output()
            .expect("the program starts");
        let here = self.folder.path().display().to_string();
        let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("prints text").replace(&here, "<here>");
        Run { code: output.status.code().expect("no signal"), stdout: text(output.stdout), stderr: text(output.stderr) }
    }

    /// Compiles `missions/a.yaml` into `out/a`, which must work.
    pub fn compiled() -> Self {
        let sandbox = Self::new();
        sandbox.run(&["compile", "missions/a.yaml"]).expect(0);
        sandbox
    }

    /// Names of a folder's files, sorted.
    pub fn list(&self, folder: &str) -> Vec<String> {
        let Ok(entries) = fs::read_dir(self.path(folder)) else { return Vec::new() };
        let mut names: Vec<String> =
            entries.map(|e| e.expect("entry").file_name().into_string().expect("text")).collect();
        names.sort();
        names
    }
}

impl Run {
    /// The run itself, if it ended with this code.
    #[track_caller]
    pub fn expect(self, code: i32) -> Self {
        assert_eq!(self.code, code, "stdout:\n{}\nstderr:\n{}", self.stdout, self.stderr);
        self
    }
}

fn copy(from: &Path, to: &Path) {
    if from.is_dir() {
        fs::create_dir_all(to).expect("folder");
        for entry in fs::read_dir(from).expect("folder") {
            let entry = entry.expect("entry");
            copy(&entry.path(), &to.join(entry.file_name()));
        }
    } else {
        fs::create_dir_all(to.parent().expect("below a folder")).expect("folders");
        fs::copy(from, to).expect("copy");
    }
}

/// The message as it is in `tests/golden/cli_<name>.snap`.
pub fn golden(name: &str, text: &str) {
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path("../golden");
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.bind(|| insta::assert_snapshot!(format!("cli_{name}"), text));
}
