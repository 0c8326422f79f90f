//! Not at random times but at each step: strace ends the program before its first change of the disk, its second, …, or lets that
//! one fail. One mission, an older set of whose files is there.

use std::collections::BTreeMap;
use std::fs;
use std::process::{Command, Stdio};

use super::batch::{Files, batch, files, folders, leftovers, write_missions};
use super::possible;
use super::sandbox::Sandbox;

/// Calls that change what names there are, or make sure that it is on the disk.
const CHANGES: [&str; 10] =
    ["mkdir", "mkdirat", "rename", "renameat", "renameat2", "unlink", "unlinkat", "rmdir", "fsync", "fdatasync"];
/// Calls that take room.
const TAKES: [&str; 8] = ["mkdir", "mkdirat", "rename", "renameat", "renameat2", "fsync", "fdatasync", "write"];

/// Where the older set is kept to start from.
const OLDER: &str = "older";

struct Bench {
    sandbox: Sandbox,
    /// The files of mission `a` as they are there, and as they are to be.
    older: Files,
    newer: Files,
}

impl Bench {
    fn new() -> Option<Self> {
        let sandbox = batch();
        let probe = ["-f", "-qq", "-o", "/dev/null", "-e", "inject=?fsync:error=ENOSPC:when=1", "true"];
        if !possible(Command::new("strace").args(probe), "strace: faults at each step are not tried") {
            return None;
        }
        let build = |version| {
            write_missions(&sandbox, version, false);
            sandbox.run(&["build", "missions/a.yaml"]).expect(0);
            files(&sandbox.path("out/a"))
        };
        let (newer, older) = (build(1), build(0));
        fs::rename(sandbox.path("out"), sandbox.path(OLDER)).expect("rename");
        write_missions(&sandbox, 1, false);
        Some(Self { sandbox, older, newer })
    }

    /// Puts the older set in place, with what is not ours among it.
    fn reset(&self) {
        let _ = fs::remove_dir_all(self.sandbox.path("out"));
        for name in self.sandbox.list(&format!("{OLDER}/a")) {
            self.sandbox.write(&format!("out/a/{name}"), self.sandbox.read(&format!("{OLDER}/a/{name}")));
        }
        self.sandbox.write("out/a/notes.txt", "mine");
        // Spares the program reading itself.
        self.sandbox.write("out/.trajc-build", self.sandbox.read(&format!("{OLDER}/.trajc-build")));
    }

    /// Builds with a fault at one call, of those of this name the one of that number (in any thread); its exit code and messages.
    /// `None`: there are not so many.
    fn build(&self, call: &str, number: usize, fault: &str) -> Option<(Option<i32>, String)> {
        let mut command = Command::new("strace");
        let log = self.sandbox.path("strace.log").display().to_string();
        let inject = format!("inject=?{call}:{fault}:when={number}");
        command.args(["-f", "-qq", "-o", &log, "-e", &format!("trace=?{call}"), "-e", &inject]);
        command.arg(env!("CARGO_BIN_EXE_trajc")).args(["build", "-j", "1", "missions/a.yaml"]);
        command.current_dir(self.sandbox.path(".")).env("COLUMNS", "400").stdin(Stdio::null());
        let output = command.output().expect("strace starts");
        let log = self.sandbox.text("strace.log");
        let struck = log.contains("INJECTED") || log.contains("killed by SIGKILL");
        struck.then(|| (output.status.code(), String::from_utf8(output.stderr).expect("text")))
    }

    /// All such faults, one after the other, each with the older set in place. `prepare` before, `judge` after each one; their number.
    fn each(
        &self,
        calls: &[&str],
        fault: &str,
        prepare: &dyn Fn(),
        judge: &mut dyn FnMut(&str, Option<i32>, &str),
    ) -> usize {
        let mut faults = 0;
        for call in calls {
            for number in 1.. {
                self.reset();
                prepare();
                let Some((code, stderr)) = self.build(call, number, fault) else { break };
                judge(&format!("{fault} at {call} {number}"), code, &stderr);
                faults += 1;
            }
        }
        faults
    }

    /// The mission's folder without what is not ours.
    fn found(&self) -> BTreeMap<String, Files> {
        let mut folders = folders(&self.sandbox.path("out"));
        for files in folders.values_mut() {
            files.remove("notes.txt");
        }
        folders.retain(|_, files| !files.is_empty());
        folders
    }

    /// The next build makes what is missing, and nothing of anybody's is lost.
    fn repair(&self, what: &str) {
        self.sandbox.run(&["build", "missions/a.yaml"]).expect(0);
        assert!(self.found()["a"] == self.newer, "{what}: not repaired");
        assert_eq!(leftovers(&self.sandbox.path("out")), [""; 0], "{what}");
        assert_eq!(self.sandbox.text("out/a/notes.txt"), "mine", "{what}");
    }
}

#[test]
fn killed_before_any_change_of_the_disk_a_folder_is_whole_or_absent() {
    let Some(bench) = Bench::new() else { return };
    let faults = bench.each(&CHANGES, "signal=KILL", &|| (), &mut |what, code, stderr| {
        assert_eq!(code, None, "{what}: {stderr}");
        for (name, files) in bench.found() {
            let whole = name == "a" && (files == bench.newer || files == bench.older);
            assert!(whole, "{what}: {name} has {:?}", files.keys());
        }
        bench.repair(what);
    });
    // Each file is flushed and each older one removed.
    assert!(faults > bench.older.len() + bench.newer.len(), "{faults} steps: were they seen?");
}

#[test]
fn bad_input_killed_before_any_change_leaves_the_whole_set_or_nothing_of_it() {
    let Some(bench) = Bench::new() else { return };
    let good = bench.sandbox.text("missions/a.yaml");
    let spoil = || bench.sandbox.write("missions/a.yaml", good.replace("clearance_m", "clearence_m"));
    let faults = bench.each(&CHANGES, "signal=KILL", &spoil, &mut |what, _, _| {
        let found = bench.found();
        assert!(found.values().all(|files| *files == bench.older), "{what}: {:?}", found["a"].keys());
        bench.sandbox.run(&["build", "missions/a.yaml"]).expect(2);
        assert!(bench.found().is_empty(), "{what}: commands of before are left");
        bench.sandbox.write("missions/a.yaml", &good);
        bench.repair(what);
    });
    assert!(faults > bench.older.len(), "{faults} steps: were they seen?");
}

#[test]
fn without_room_for_any_one_step_nothing_is_half_written() {
    let Some(bench) = Bench::new() else { return };
    let mut failed = 0;
    bench.each(&TAKES, "error=ENOSPC", &|| (), &mut |what, code, stderr| {
        let what = format!("{what}: {stderr}");
        let found = bench.found();
        match code {
            // It was not needed: another way was taken, or a cache is not kept.
            Some(0) => assert!(found["a"] == bench.newer, "{what}"),
            Some(2) => {
                failed += 1;
                let told = ["cannot", "No space left on device", "make room"].iter().all(|part| stderr.contains(part));
                // The write that failed may have been the message.
                assert!(told || what.contains("at write"), "{what}");
                // Of a build that cannot begin nothing is changed.
                let kept = if stderr.contains("cannot make folder") { &bench.older } else { &bench.newer };
                assert!(found.values().all(|files| files == kept), "{what}: {:?}", found["a"].keys());
            }
            code => panic!("{what}: {code:?}"),
        }
        for left in leftovers(&bench.sandbox.path("out")) {
            // What is not ours and could not be put back waits for the next build.
            assert!(bench.sandbox.list(&format!("out/{left}/was")) == ["notes.txt"], "{what}: {left}");
        }
        bench.repair(&what);
    });
    assert!(failed > bench.newer.len(), "{failed} faults: were they seen?");
}
