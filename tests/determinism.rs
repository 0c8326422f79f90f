//! The same input gives the same bytes: with however many threads, however often, wherever and for whomever the program runs.
//!
//! `TRAJC_REPEATS=50` builds that often. `TRAJC_OTHER=target/release/trajc` compares with another build of the program, on all
//! shipped missions. What may differ, and why: `docs/trust.md`.

#[allow(dead_code, reason = "what the tests of the command line need")]
#[path = "cli/sandbox.rs"]
mod sandbox;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use sandbox::{Sandbox, repository};

/// Files by `<mission>/<name>`, but those that tell times.
type Files = BTreeMap<String, Vec<u8>>;

/// What is driven, by whom, and what stops: joints, points and images as maps, a given path; `post` fails, and says why.
fn missions() -> Sandbox {
    let sandbox = Sandbox::new();
    for file in
        ["missions/c_curve.yaml", "missions/turtlebot3_burger.yaml", "maps/tb3_sandbox.yaml", "maps/tb3_sandbox.pgm"]
    {
        sandbox.ship(file);
    }
    let text = sandbox.text("missions/a.yaml");
    sandbox.write("missions/post.yaml", text.replace("x_m: 3.4", "x_m: 2.0"));
    sandbox.write(
        "missions/blades.yaml",
        text.replace("box_base", "scr_db").replace("yaw: 0deg}\nclear", "yaw: 90deg}\nclear"),
    );
    sandbox
}

fn outputs(sandbox: &Sandbox, out: &str) -> Files {
    let mut files = Files::new();
    for mission in sandbox.list(out).into_iter().filter(|name| !name.starts_with('.')) {
        for name in sandbox.list(&format!("{out}/{mission}")).into_iter().filter(|name| name != "timings.json") {
            files.insert(format!("{mission}/{name}"), sandbox.read(&format!("{out}/{mission}/{name}")));
        }
    }
    files
}

/// Those that say nothing of where they lie, or who made them.
fn contents(mut files: Files) -> Files {
    files.retain(|path, _| !path.ends_with("/commands.d") && !path.ends_with("/build.json"));
    files
}

#[track_caller]
fn same(one: &Files, other: &Files, what: &str) {
    assert!(one.keys().eq(other.keys()), "{what}: {:?} and {:?}", one.keys(), other.keys());
    let differ: Vec<&String> = one.keys().filter(|path| one[*path] != other[*path]).collect();
    assert!(differ.is_empty(), "{what}: other bytes in {differ:?}");
}

fn built() -> (Sandbox, Files) {
    let sandbox = missions();
    // `post` fails.
    sandbox.run(&["build", "-k", "-j", "1"]).expect(1);
    let files = outputs(&sandbox, "out");
    for mission in ["a", "blades", "c_curve", "turtlebot3_burger"] {
        for name in ["commands.csv", "commands.mcap", "report.json", "report.html", "path_error.csv"] {
            assert!(files.contains_key(&format!("{mission}/{name}")), "{mission} has no {name}");
        }
    }
    assert!(files.contains_key("post/report.html") && !files.contains_key("post/commands.csv"));
    (sandbox, files)
}

#[test]
fn however_many_threads_and_however_often() {
    let repeats: usize =
        std::env::var("TRAJC_REPEATS").map_or(1, |text| text.parse().expect("TRAJC_REPEATS: a number"));
    let (sandbox, first) = built();
    for (repeat, jobs) in (0..repeats).flat_map(|repeat| ["1", "2", "4"].map(|jobs| (repeat, jobs))).skip(1) {
        sandbox.run(&["build", "-k", "--force", "-j", jobs]).expect(1);
        same(&first, &outputs(&sandbox, "out"), &format!("repeat {repeat}, -j {jobs}"));
    }
}

#[test]
fn wherever_and_for_whomever() {
    let (sandbox, first) = built();
    // The same tree elsewhere.
    let (_elsewhere, files) = built();
    same(&first, &files, "in another folder");
    // The same tree, but started elsewhere in it: what engines and `build` go by is spelled from there.
    sandbox.run_in("missions", &["build", "-k", "--force", ".", "--out", "../out"]).expect(1);
    let started_there = contents(outputs(&sandbox, "out"));
    let files = contents(first.clone());
    let tables = |files: &Files| {
        files.iter().filter(|(path, _)| path.ends_with(".csv")).map(|(p, b)| (p.clone(), b.clone())).collect()
    };
    same(&tables(&files), &tables(&started_there), "started in missions/");
    // Reports call the mission, and files beside those that it names, as they were called.
    for (path, bytes) in files.iter().filter(|(path, _)| path.ends_with("/report.json")) {
        let [one, other] = [bytes, &started_there[path]].map(|bytes| {
            let mut report: serde_json::Value = serde_json::from_slice(bytes).expect("JSON");
            let inputs = &mut report["inputs"];
            inputs["mission"]["path"].take();
            inputs["other"].as_array_mut().expect("files").iter_mut().for_each(|file| drop(file["path"].take()));
            report
        });
        assert!(one == other, "{path} differs by more than paths");
    }
    let surroundings: &[&[(&str, &str)]] = &[
        // Installed or not: the program asks for none.
        &[("LC_ALL", "de_DE.UTF-8"), ("LANG", "de_DE.UTF-8"), ("TZ", "Asia/Kathmandu")],
        &[("LC_ALL", "tr_TR.UTF-8"), ("LC_NUMERIC", "tr_TR.UTF-8"), ("TZ", ":/nowhere"), ("COLUMNS", "20")],
        &[("LC_ALL", "C"), ("HOME", "/nowhere"), ("USER", "nobody"), ("TMPDIR", "/nowhere"), ("NO_COLOR", "1")],
        // Nothing at all.
        &[],
    ];
    for variables in surroundings {
        let mut command = Command::new(env!("CARGO_BIN_EXE_trajc"));
        command
            .args(["build", "-k", "--force"])
            .current_dir(sandbox.path("."))
            .env_clear()
            .envs(variables.iter().copied());
        let output = command.stdin(Stdio::null()).output().expect("the program starts");
        assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
        same(&first, &outputs(&sandbox, "out"), &format!("{variables:?}"));
    }
    #[cfg(unix)]
    {
        let script = "umask 077; exec \"$0\" build -k --force";
        let mut command = Command::new("sh");
        command.args(["-c", script, env!("CARGO_BIN_EXE_trajc")]).current_dir(sandbox.path("."));
        assert_eq!(command.output().expect("a shell").status.code(), Some(1));
        same(&first, &outputs(&sandbox, "out"), "umask 077");
    }
}

/// glibc has functions of its own for processors with fused multiply-add, which round otherwise: none of them may be in use.
#[test]
fn on_a_processor_without_fused_multiply_add() {
    let (sandbox, first) = built();
    let output = Command::new(env!("CARGO_BIN_EXE_trajc"))
        .args(["build", "-k", "--force"])
        .current_dir(sandbox.path("."))
        .env("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-FMA,-FMA4,-AVX2,-AVX2_Usable,-FMA_Usable")
        .output()
        .expect("the program starts");
    assert_eq!(output.status.code(), Some(1), "{}", String::from_utf8_lossy(&output.stderr));
    same(&first, &outputs(&sandbox, "out"), "without fused multiply-add");
}

#[test]
fn another_build_of_the_program_writes_the_same() {
    let Some(other) = std::env::var_os("TRAJC_OTHER").map(PathBuf::from) else {
        eprintln!(
            "SKIPPED: TRAJC_OTHER names no other build of trajc (target/release/trajc): it is not compared with this one"
        );
        return;
    };
    let other = repository().join(other);
    let sandbox = Sandbox::empty();
    for folder in ["robots", "maps", "missions"] {
        sandbox.ship(folder);
    }
    for (program, out) in [(PathBuf::from(env!("CARGO_BIN_EXE_trajc")), "own"), (other, "other")] {
        let mut command = Command::new(&program);
        command.args(["build", "-k", "--out", out]).current_dir(sandbox.path("."));
        let output = command.output().unwrap_or_else(|error| panic!("{}: {error}", program.display()));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    same(&contents(outputs(&sandbox, "own")), &contents(outputs(&sandbox, "other")), "another build");
}
