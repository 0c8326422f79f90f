//! A small batch, and what its output folder must look like whatever happened.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::sandbox::Sandbox;

/// Names and bytes of a folder's files, but of the one that tells times.
pub type Files = BTreeMap<String, Vec<u8>>;

/// `a` to `d` can be driven, `e` ends in the post; `x` is bad input where `broken`. Those of one `version` have another goal than those of
/// another.
pub fn write_missions(sandbox: &Sandbox, version: u32, broken: bool) {
    let text = sandbox.text("first.yaml");
    for (k, name) in ["a", "b", "c", "d", "x"].iter().enumerate() {
        let y = 1.0 + 0.1 * k as f64 + 0.02 * f64::from(version);
        let text = text.replace("goal: {x_m: 3.4, y_m: 1.5", &format!("goal: {{x_m: 3.4, y_m: {y:.2}"));
        let text = if broken && *name == "x" { text.replace("clearance_m", "clearence_m") } else { text };
        sandbox.write(&format!("missions/{name}.yaml"), text);
    }
    sandbox.write("missions/e.yaml", text.replace("goal: {x_m: 3.4", &format!("goal: {{x_m: 2.0{version}")));
}

/// A sandbox with the batch in it, and nothing built.
pub fn batch() -> Sandbox {
    let sandbox = Sandbox::empty();
    sandbox.ship("robots/box_base");
    sandbox.ship("maps/first.csv");
    sandbox.ship("missions/first.yaml");
    fs::rename(sandbox.path("missions/first.yaml"), sandbox.path("first.yaml")).expect("rename");
    write_missions(&sandbox, 0, false);
    sandbox
}

/// The program, to be run in the sandbox.
pub fn trajc(sandbox: &Sandbox, args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trajc"));
    command.args(args).current_dir(sandbox.path(".")).env("COLUMNS", "100").stdin(std::process::Stdio::null());
    command
}

/// Builds on; what became of each mission, by status.
pub fn build(sandbox: &Sandbox, code: i32) -> BTreeMap<String, BTreeSet<String>> {
    let run = sandbox.run(&["build", "-k", "-j", "2", "--json"]).expect(code);
    statuses(&run.stdout)
}

/// Missions by status, of the document that a build prints.
pub fn statuses(document: &str) -> BTreeMap<String, BTreeSet<String>> {
    let document: Value = serde_json::from_str(document).expect("JSON");
    let mut by_status: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for row in document["missions"].as_array().expect("missions") {
        let [status, name] = ["status", "mission"].map(|key| row[key].as_str().expect("text").to_owned());
        by_status.entry(status).or_default().insert(name);
    }
    by_status
}

/// The files of each mission's folder.
pub fn folders(out: &Path) -> BTreeMap<String, Files> {
    let mut folders = BTreeMap::new();
    for entry in fs::read_dir(out).into_iter().flatten() {
        let entry = entry.expect("an entry");
        let name = entry.file_name().into_string().expect("text");
        if !name.starts_with('.') {
            folders.insert(name, files(&entry.path()));
        }
    }
    folders
}

/// The files of one folder.
pub fn files(folder: &Path) -> Files {
    let mut files = Files::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let entry = entry.expect("an entry");
        let name = entry.file_name().into_string().expect("text");
        let bytes = fs::read(entry.path()).expect("a file");
        if name == "timings.json" {
            serde_json::from_slice::<Value>(&bytes).expect("whole, though never the same");
            files.insert(name, Vec::new());
        } else {
            files.insert(name, bytes);
        }
    }
    files
}

/// What lies in an output folder that is no mission's and not the builds' own note.
pub fn leftovers(out: &Path) -> Vec<String> {
    let names = fs::read_dir(out).into_iter().flatten().map(|entry| entry.expect("an entry").file_name());
    let hidden = names.map(|name| name.into_string().expect("text")).filter(|name| name.starts_with('.'));
    hidden.filter(|name| name != ".trajc-build").collect()
}

/// Proves what commands there are; which missions have any.
pub fn check(sandbox: &Sandbox, out: &str) -> BTreeSet<String> {
    let mut checked = BTreeSet::new();
    for (name, files) in folders(&sandbox.path(out)) {
        for file in ["commands.csv", "commands.mcap"].into_iter().filter(|file| files.contains_key(*file)) {
            sandbox.run(&["check", &format!("{out}/{name}/{file}")]).expect(0);
            checked.insert(name.clone());
        }
    }
    checked
}

/// Names, as a set.
pub fn set(names: &[&str]) -> BTreeSet<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}
