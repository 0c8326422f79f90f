//! Folders and files that may not be written to.

use std::fs::{self, Permissions};
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Stdio};

use super::batch::{batch, build, folders, leftovers, write_missions};
use super::possible;
use super::sandbox::Sandbox;

/// Runs the program as one whom permissions bind; `None`: that is not possible here.
struct Nobody {
    /// What comes before the program.
    before: Vec<&'static str>,
}

impl Nobody {
    fn new(sandbox: &Sandbox) -> Option<Self> {
        // Temporary folders are their maker's alone.
        fs::set_permissions(sandbox.path("."), Permissions::from_mode(0o755)).expect("scratch");
        // So is, maybe, the folder that the program lies in.
        fs::copy(env!("CARGO_BIN_EXE_trajc"), sandbox.path("trajc")).expect("scratch");
        let probe = sandbox.path("probe");
        fs::create_dir(&probe).expect("scratch");
        fs::set_permissions(&probe, Permissions::from_mode(0o555)).expect("scratch");
        let bound = |before: &[&str]| {
            let touch = [before, &["sh", "-c", "./trajc --version && ! touch probe/a"]].concat();
            Command::new(touch[0])
                .args(&touch[1..])
                .current_dir(sandbox.path("."))
                .output()
                .is_ok_and(|output| output.status.success())
        };
        let ways = [&["env"][..], &["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups"]];
        let way = ways.into_iter().find(|way| bound(way));
        fs::remove_dir_all(&probe).expect("scratch");
        if way.is_none() {
            eprintln!("SKIPPED: permissions bind nobody here: folders that may not be written to are not tried");
        }
        way.map(|way| Self { before: way.to_vec() })
    }

    /// Exit code and messages.
    fn run(&self, sandbox: &Sandbox, args: &[&str]) -> (Option<i32>, String) {
        let mut command = Command::new(self.before[0]);
        command.args(&self.before[1..]).arg("./trajc").args(args).current_dir(sandbox.path("."));
        let output = command.env("COLUMNS", "400").stdin(Stdio::null()).output().expect("the program starts");
        (output.status.code(), String::from_utf8(output.stderr).expect("text"))
    }
}

/// Gives everything below a folder to whoever runs the program.
fn give(folder: &Path) {
    fs::set_permissions(folder, Permissions::from_mode(0o777)).expect("scratch");
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            give(&path);
        } else {
            fs::set_permissions(&path, Permissions::from_mode(0o666)).expect("scratch");
        }
    }
}

fn forbid(path: &Path) {
    fs::set_permissions(path, Permissions::from_mode(if path.is_dir() { 0o555 } else { 0o444 })).expect("scratch");
}

#[test]
fn folders_that_may_not_be_written_to_are_named_and_stay_as_they_are() {
    let sandbox = batch();
    let Some(nobody) = Nobody::new(&sandbox) else { return };
    build(&sandbox, 1);
    let before = folders(&sandbox.path("out"));
    write_missions(&sandbox, 1, true);
    let out = sandbox.path("out");
    // All of it.
    forbid(&out);
    for name in sandbox.list("out").iter().filter(|name| !name.starts_with('.')) {
        forbid(&sandbox.path(&format!("out/{name}")));
    }
    let (code, stderr) = nobody.run(&sandbox, &["build", "-k", "-j", "2"]);
    assert_eq!(code, Some(2), "{stderr}");
    assert_eq!(stderr.matches("cannot create a folder in").count(), 5, "{stderr}");
    assert!(stderr.contains("choose a folder that can be written with `--out DIR`"), "{stderr}");
    // Who reads on must know that these are commands of before.
    assert!(stderr.contains("cannot remove") && stderr.contains("out/x/commands.csv`: Permission denied"), "{stderr}");
    assert!(folders(&out) == before);
    assert_eq!(leftovers(&out), [""; 0]);
    // One mission's alone.
    write_missions(&sandbox, 1, false);
    give(&out);
    forbid(&sandbox.path("out/b"));
    let (code, stderr) = nobody.run(&sandbox, &["build", "-k", "-j", "2"]);
    let root = fs::metadata(&out).is_ok_and(|found| std::os::unix::fs::MetadataExt::uid(&found) == 0);
    if code == Some(2) {
        assert!(stderr.contains("cannot replace") && stderr.contains("out/b`: Permission denied"), "{stderr}");
        assert!(folders(&out)["b"] == before["b"], "as it was");
    } else {
        assert!(!root, "another one's folder cannot be moved by somebody else: {stderr}");
    }
    assert_eq!(leftovers(&out), [""; 0]);
    give(&out);
    let done = build(&sandbox, 1);
    assert_eq!(done["up_to_date"].iter().filter(|name| *name != "b").count(), 4, "{done:?}");
}

#[test]
fn files_that_may_not_be_written_to_are_replaced_in_output_folders_and_kept_elsewhere() {
    let sandbox = batch();
    let Some(nobody) = Nobody::new(&sandbox) else { return };
    build(&sandbox, 1);
    write_missions(&sandbox, 1, false);
    give(&sandbox.path("out"));
    for file in sandbox.list("out/a") {
        forbid(&sandbox.path(&format!("out/a/{file}")));
    }
    let (code, stderr) = nobody.run(&sandbox, &["build", "missions/a.yaml"]);
    assert_eq!((code, stderr.as_str()), (Some(0), ""), "the folder decides");
    assert_eq!(leftovers(&sandbox.path("out")), [""; 0]);
    sandbox.write("drawing.svg", "mine");
    forbid(&sandbox.path("drawing.svg"));
    // Others could be put in its place.
    fs::set_permissions(sandbox.path("."), Permissions::from_mode(0o777)).expect("scratch");
    let (code, stderr) = nobody.run(&sandbox, &["inspect", "missions/a.yaml", "--plot", "drawing.svg"]);
    assert_eq!(code, Some(2), "{stderr}");
    assert!(stderr.contains("cannot write `drawing.svg`: Permission denied"), "{stderr}");
    assert_eq!(sandbox.text("drawing.svg"), "mine");
}

#[test]
fn a_file_system_that_is_read_only_is_named_and_stays_as_it_is() {
    let script = r#"
        mount --bind out out && mount -o remount,ro,bind out || exit 9
        "$TRAJC" build -k 2>read_only.err >/dev/null </dev/null; echo $? >read_only.code
    "#;
    let ways = [&["unshare", "--mount"][..], &["unshare", "--map-root-user", "--mount"]];
    let sandbox = batch();
    build(&sandbox, 1);
    let before = folders(&sandbox.path("out"));
    write_missions(&sandbox, 1, false);
    let run = |way: &&[&str]| {
        let mut command = Command::new(way[0]);
        command.args(&way[1..]).args(["sh", "-c", script]).current_dir(sandbox.path("."));
        command.env("TRAJC", env!("CARGO_BIN_EXE_trajc")).env("COLUMNS", "400");
        possible(&mut command, &format!("{}: a read-only file system is not tried so", way.join(" ")))
    };
    if !ways.iter().any(run) {
        return;
    }
    let stderr = sandbox.text("read_only.err");
    assert_eq!(sandbox.text("read_only.code").trim(), "2", "{stderr}");
    assert!(stderr.contains("Read-only file system") && stderr.contains("--out DIR"), "{stderr}");
    assert!(folders(&sandbox.path("out")) == before && leftovers(&sandbox.path("out")).is_empty());
}
