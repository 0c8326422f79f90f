//! Many missions: what is said, in what order, what is left behind.

use std::fs;
use std::process::Command;

use super::sandbox::{Sandbox, golden};
use super::{built, mission, of_status, to_do};

/// A table whose times and widths are the same every time.
fn steady(text: &str) -> String {
    let cells = |line: &str| {
        let mut cells: Vec<&str> = line.split("  ").map(str::trim).filter(|cell| !cell.is_empty()).collect();
        if cells.len() > 3 && cells[2].ends_with(" s") {
            cells[2] = "…";
        }
        cells.join(" | ")
    };
    text.lines().map(|line| cells(line) + "\n").collect()
}

/// `a` and `c` can be driven, `b` ends in the post, `d` is no mission at all.
fn mixed() -> Sandbox {
    let sandbox = Sandbox::new();
    mission(&sandbox, "c", 1.0);
    sandbox.write("missions/b.yaml", sandbox.text("missions/a.yaml").replace("x_m: 3.4", "x_m: 2.0"));
    sandbox.write("missions/d.yaml", "robot: nobody.yaml\nmap: 3\n");
    sandbox
}

#[test]
fn with_k_all_are_tried_and_the_worst_decides() {
    let sandbox = mixed();
    let run = sandbox.run(&["build", "-k", "-j", "1"]).expect(2);
    golden("build_keep_going", &steady(&run.stdout));
    golden("build_faults", &run.stderr);
    assert_eq!(sandbox.list("out"), [".trajc-build", "a", "b", "c"], "bad input leaves no folder");
    assert_eq!(sandbox.list("out/b"), ["build.json", "report.html", "report.json", "timings.json"]);
    // What failed before is told again, and not compiled; bad input is read again.
    let run = sandbox.run(&["build", "-nk"]).expect(1);
    golden("build_dry_run", &steady(&run.stdout));
    let document = built(&sandbox, &["-k"], 2);
    assert_eq!(of_status(&document, "failed_before"), ["b"]);
    assert_eq!(of_status(&document, "failed"), ["d"]);
    assert_eq!(of_status(&document, "up_to_date"), ["a", "c"]);
    sandbox.remove("missions/d.yaml");
    let run = sandbox.run(&["build"]).expect(1);
    golden("build_failed_before", &steady(&run.stdout));
    // A change, or --force, and it is tried again.
    let document = built(&sandbox, &["--force", "-k"], 1);
    assert_eq!(of_status(&document, "failed"), ["b"]);
    sandbox.edit("missions/b.yaml", "x_m: 2.0", "x_m: 3.3");
    let document = built(&sandbox, &[], 0);
    assert_eq!([of_status(&document, "certified"), of_status(&document, "up_to_date")], [vec!["b"], vec!["a", "c"]]);
    assert!(sandbox.exists("out/b/commands.csv"));
}

#[test]
fn without_k_nothing_begins_after_a_failure_old_or_new() {
    let sandbox = mixed();
    let run = sandbox.run(&["build", "-j", "1"]).expect(1);
    golden("build_stopped", &steady(&run.stdout));
    assert_eq!(sandbox.list("out"), [".trajc-build", "a", "b"]);
    sandbox.edit("missions/a.yaml", "y_m: 1.5, yaw: 0deg}\nclear", "y_m: 1.6, yaw: 0deg}\nclear");
    let document = built(&sandbox, &[], 1);
    assert_eq!(of_status(&document, "certified"), ["a"], "it comes before the failure");
    assert_eq!(of_status(&document, "failed_before"), ["b"]);
    assert_eq!(of_status(&document, "not_tried"), ["c", "d"]);
}

#[test]
fn commands_of_missions_that_no_longer_compile_are_gone() {
    let sandbox = Sandbox::new();
    built(&sandbox, &[], 0);
    sandbox.write("out/a/notes.txt", "mine");
    sandbox.edit("missions/a.yaml", "clearance_m", "clearence_m");
    built(&sandbox, &[], 2);
    assert_eq!(sandbox.list("out/a"), ["notes.txt"]);
}

#[test]
fn faults_of_the_list_of_missions_are_told_before_anything_is_compiled() {
    let sandbox = Sandbox::new();
    sandbox.write("more/a.yaml", "robot: r.yaml\n");
    sandbox.write("none/robot.yaml", "urdf: r.urdf\n");
    golden("build_same_name", &sandbox.run(&["build", "missions", "more"]).expect(2).stderr);
    golden("build_not_there", &sandbox.run(&["build", "nowhere", "missions"]).expect(2).stderr);
    golden("build_no_mission", &sandbox.run(&["build", "none"]).expect(2).stderr);
    golden("build_jobs", &sandbox.run(&["build", "-j", "0"]).expect(2).stderr);
    fs::create_dir_all(sandbox.path("out")).expect("a folder");
    let held = fs::File::open(sandbox.path("out")).expect("a folder");
    held.try_lock().expect("nobody else");
    golden("build_locked", &sandbox.run(&["build"]).expect(2).stderr);
    assert_eq!(sandbox.list("out"), [""; 0]);
    assert_eq!(to_do(&sandbox).len(), 1, "who only asks does not wait");
}

/// All files of an output folder but the one that tells times.
fn files(sandbox: &Sandbox, folder: &str) -> Vec<(String, Vec<u8>)> {
    let names = sandbox.list(folder).into_iter().filter(|name| name != "timings.json");
    names.map(|name| (name.clone(), sandbox.read(&format!("{folder}/{name}")))).collect()
}

#[test]
fn however_many_workers_and_whoever_shares_a_map_the_bytes_are_those_of_compile() {
    let sandbox = Sandbox::new();
    // On one map; of one map with another slab; of the robot's own height; two of a map_server sheet.
    let slab =
        sandbox.text("missions/a.yaml").replace("resolution_m: 0.05", "resolution_m: 0.05\n  height_m: [0.02, 0.2]");
    sandbox.write("missions/slab.yaml", &slab);
    sandbox.write("missions/slab_again.yaml", &slab);
    mission(&sandbox, "b", 1.0);
    mission(&sandbox, "c", 2.0);
    sandbox.ship("maps/tb3_sandbox.yaml");
    sandbox.ship("maps/tb3_sandbox.pgm");
    for name in ["turtlebot3_burger", "turtlebot3_waffle_pi"] {
        sandbox.ship(&format!("missions/{name}.yaml"));
    }
    let sheet = sandbox.text("missions/turtlebot3_burger.yaml");
    sandbox.write("missions/burger.yaml", sheet);
    let names = ["a", "b", "burger", "c", "slab", "slab_again", "turtlebot3_burger", "turtlebot3_waffle_pi"];
    let document = built(&sandbox, &["-j", "1"], 0);
    assert_eq!(of_status(&document, "certified"), names);
    let first: Vec<_> = names.iter().map(|name| files(&sandbox, &format!("out/{name}"))).collect();
    built(&sandbox, &["-j", "5", "--force"], 0);
    let second: Vec<_> = names.iter().map(|name| files(&sandbox, &format!("out/{name}"))).collect();
    assert!(first == second, "-j changes bytes");
    for (name, built) in names.iter().zip(&first) {
        sandbox.run(&["compile", &format!("missions/{name}.yaml")]).expect(0);
        let own = files(&sandbox, &format!("out/{name}"));
        let built: Vec<_> = built.iter().filter(|(name, _)| name != "build.json").cloned().collect();
        assert_eq!(own.len(), built.len());
        let differ = own.iter().zip(&built).filter(|(a, b)| a != b).map(|(a, _)| &a.0);
        assert_eq!(differ.collect::<Vec<_>>(), [""; 0], "{name}");
    }
    assert!(!sandbox.exists("out/a/build.json"), "`compile` leaves no account of another's work");
}

#[test]
fn a_build_that_is_killed_leaves_whole_folders_and_the_next_one_sweeps_up() {
    let sandbox = Sandbox::new();
    for k in 0..12 {
        mission(&sandbox, &format!("m{k:02}"), 1.0 + 0.05 * f64::from(k));
    }
    let mut running = Command::new(env!("CARGO_BIN_EXE_trajc"))
        .args(["build", "-j", "2"])
        .current_dir(sandbox.path("."))
        .stdout(std::process::Stdio::null())
        .spawn()
        .expect("the program starts");
    // In the midst: some folders are there.
    while sandbox.list("out").len() < 3 && running.try_wait().expect("a child").is_none() {
        std::thread::yield_now();
    }
    let _ = running.kill();
    running.wait().expect("a child");
    let whole = |name: &String| {
        let files = sandbox.list(&format!("out/{name}"));
        assert_eq!(files.len(), 8, "{name}: {files:?}");
    };
    sandbox.list("out").iter().filter(|name| !name.starts_with('.')).for_each(whole);
    // As if killed between two renames, and while a folder was written.
    sandbox.write("out/.m00.trajc-xyz.old/was/commands.csv", "old");
    sandbox.write("out/.gone.trajc-xyz.new/commands.csv", "half");
    built(&sandbox, &["-j", "2"], 0);
    assert_eq!(to_do(&sandbox), []);
    let left: Vec<String> = sandbox.list("out").into_iter().filter(|name| name.contains(".trajc-")).collect();
    assert_eq!(left, [".trajc-build"]);
}

#[test]
fn a_mission_that_starts_where_another_ends_is_built_after_it() {
    let sandbox = Sandbox::new();
    let text = sandbox.text("missions/a.yaml");
    let from = |file: &str, goal: &str| {
        text.replace("start: {x_m: 0.6, y_m: 1.5, yaw: 0deg}", &format!("start: {{file: ../out/{file}/commands.csv}}"))
            .replace("goal: {x_m: 3.4, y_m: 1.5, yaw: 0deg}", &format!("goal: {{{goal}}}"))
    };
    // By name they come the other way round.
    sandbox.remove("missions/a.yaml");
    sandbox.write("missions/c.yaml", &text);
    sandbox.write("missions/b.yaml", from("c", "x_m: 3.4, y_m: 2.4"));
    sandbox.write("missions/a.yaml", from("b", "x_m: 0.6, y_m: 1.5"));
    let document = built(&sandbox, &["-j", "2"], 0);
    assert_eq!(of_status(&document, "certified"), ["c", "b", "a"]);
    assert!(to_do(&sandbox).is_empty());
    let made = |name: &str| sandbox.text(&format!("out/{name}/commands.csv"));
    let before = ["a", "b", "c"].map(made);
    sandbox.remove("out/c/report.html");
    let names = ["c", "b", "a"].map(str::to_owned);
    let why = ["missing out/c/report.html", "out/c/commands.csv is made first", "out/b/commands.csv is made first"];
    assert_eq!(to_do(&sandbox), names.into_iter().zip(why.map(str::to_owned)).collect::<Vec<_>>());
    built(&sandbox, &["-j", "2"], 0);
    assert_eq!(["a", "b", "c"].map(made), before, "the same input, the same bytes");
    // Where only the last one is built, a change of what it starts from is a change of it.
    let alone = |code| built(&sandbox, &["missions/b.yaml", "-n"], code);
    assert_eq!(of_status(&alone(0), "up_to_date"), ["b"]);
    sandbox.edit("missions/c.yaml", "y_m: 1.5, yaw: 0deg}\nclearance", "y_m: 1.4, yaw: 0deg}\nclearance");
    sandbox.run(&["compile", "missions/c.yaml"]).expect(0);
    let document = alone(0);
    assert_eq!(document["missions"][0]["why"][0], "changed out/c/commands.csv");
    // What has no end leaves no start.
    sandbox.edit("missions/c.yaml", "goal: {x_m: 3.4", "goal: {x_m: 2.0");
    let run = sandbox.run(&["build", "-k"]).expect(1);
    assert!(run.stderr.contains("it starts where `out/c/commands.csv` ends, which"), "{}", run.stderr);
    assert!(!sandbox.exists("out/a/commands.csv"));
    sandbox.write("missions/c.yaml", from("a", "x_m: 3.4, y_m: 1.5"));
    let run = sandbox.run(&["build", "-k"]).expect(2);
    golden("build_cycle", &run.stderr);
}
