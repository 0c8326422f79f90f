//! Missions that cannot be compiled: the exit code, one clear message, and no command file left, older ones included.

use serde_json::Value;

use super::sandbox::{Run, Sandbox, golden};

/// Compiles `missions/a.yaml` after an edit that spoils it.
pub fn spoiled(name: &str, code: i32, edit: impl FnOnce(&Sandbox)) -> Run {
    spoiled_with(name, code, &[], edit)
}

pub fn spoiled_with(name: &str, code: i32, args: &[&str], edit: impl FnOnce(&Sandbox)) -> Run {
    let sandbox = Sandbox::new();
    for older in ["commands.csv", "commands.mcap", "commands.d", "report.json"] {
        sandbox.write(&format!("out/a/{older}"), "older");
    }
    edit(&sandbox);
    let started = std::time::Instant::now();
    let run = sandbox.run(&[&["compile", "missions/a.yaml"], args].concat());
    assert!(started.elapsed().as_secs() < 60, "{name}: {:?}", started.elapsed());
    assert_eq!(run.code, code, "{name}: stdout:\n{}\nstderr:\n{}", run.stdout, run.stderr);
    let left = sandbox.list("out/a");
    if code == 1 {
        assert_eq!(left, ["report.html", "report.json", "timings.json"], "{name}");
        let report: Value = serde_json::from_slice(&sandbox.read("out/a/report.json")).expect("JSON");
        assert_eq!(report["status"], "failed", "{name}");
        assert!(!report["failure"]["reason"].as_str().expect("a reason").is_empty(), "{name}");
        assert!(run.stdout.starts_with("a: FAILED"), "{name}: {}", run.stdout);
    } else {
        assert_eq!(left, [""; 0], "{name}");
        assert_eq!(run.stdout, "", "{name}");
    }
    assert_eq!(run.stderr.matches("error[").count(), 1, "{name}: {}", run.stderr);
    golden(name, &without_counts(&run.stderr));
    run
}

/// How many states a search looked at is its own affair.
fn without_counts(text: &str) -> String {
    let words = text.split(' ').collect::<Vec<_>>();
    let counted = |at: usize| words.get(at + 1) == Some(&"states") && words[at].parse::<u64>().is_ok();
    (0..words.len()).map(|at| if counted(at) { "<count>" } else { words[at] }).collect::<Vec<_>>().join(" ")
}

fn set(from: &'static str, to: &'static str) -> impl FnOnce(&Sandbox) {
    move |s| s.edit("missions/a.yaml", from, to)
}

/// A given path for the box, in place of map, start and goal.
fn path(lines: &str) -> impl FnOnce(&Sandbox) {
    let text = format!("robot: ../robots/box_base/robot.yaml\n{lines}\n");
    move |s| s.write("missions/a.yaml", text)
}

/// The robot with blades on the small map.
fn blades(joints: &'static str) -> impl FnOnce(&Sandbox) {
    move |s| {
        s.edit("missions/a.yaml", "box_base", "scr_db");
        s.edit("missions/a.yaml", "x_m: 0.6, y_m: 1.5, yaw: 0deg", joints);
    }
}

#[test]
fn files_that_are_not_there() {
    spoiled("missing_mission", 2, |s| s.remove("missions/a.yaml"));
    spoiled("missing_robot", 2, set("box_base/robot.yaml", "bos_base/robot.yaml"));
    spoiled("missing_urdf", 2, |s| s.edit("robots/box_base/robot.yaml", "box_base.urdf", "base.urdf"));
    spoiled("missing_map", 2, set("first.csv", "second.csv"));
    spoiled("missing_path_file", 2, path("path: {file: way.csv}"));
    spoiled("missing_mesh", 2, |s| {
        s.edit("robots/box_base/box_base.urdf", "<box size=\"0.40 0.40 0.30\"/>", "<mesh filename=\"hull.stl\"/>");
    });
    spoiled("missing_package", 2, |s| {
        let mesh = "<mesh filename=\"package://bot_description/hull.stl\"/>";
        s.edit("robots/box_base/box_base.urdf", "<box size=\"0.40 0.40 0.30\"/>", mesh);
    });
    spoiled("missing_image", 2, |s| {
        s.ship("maps/depot.yaml");
        s.edit("missions/a.yaml", "maps/first.csv\n  resolution_m: 0.05", "maps/depot.yaml");
    });
}

#[test]
fn files_that_are_something_else() {
    spoiled("folder_as_map", 2, set("maps/first.csv", "maps"));
    spoiled("folder_as_robot", 2, set("box_base/robot.yaml", "box_base"));
    spoiled("folder_as_mission", 2, |s| {
        s.remove("missions/a.yaml");
        s.write("missions/a.yaml/x", "");
    });
    spoiled("empty_mission", 2, |s| s.write("missions/a.yaml", ""));
    spoiled("empty_map", 2, |s| s.write("maps/first.csv", ""));
    spoiled("empty_urdf", 2, |s| s.write("robots/box_base/box_base.urdf", ""));
    spoiled("empty_robot", 2, |s| s.write("robots/box_base/robot.yaml", ""));
    spoiled("mission_not_text", 2, |s| s.write("missions/a.yaml", b"robot: \xff\xfe"));
    spoiled("urdf_not_text", 2, |s| s.write("robots/box_base/box_base.urdf", b"<robot name=\"\xff\"/>"));
    spoiled("mission_is_a_map", 2, |s| s.write("missions/a.yaml", s.read("maps/first.csv")));
    spoiled("map_of_unknown_kind", 2, |s| {
        s.write("maps/first.stl", "solid");
        s.edit("missions/a.yaml", "first.csv", "first.stl");
    });
}

#[test]
fn keys_and_values() {
    spoiled("wrong_key", 2, set("clearance_m", "clearence_m"));
    spoiled("wrong_type", 2, set("clearance_m: 0.05", "clearance_m: small"));
    spoiled("not_a_number", 2, set("x_m: 0.6", "x_m: .nan"));
    spoiled("sampling_word", 2, set("sampling_time_s: 0.1", "sampling: traced"));
    spoiled("joint_unknown", 2, blades("x_m: 0.6, y_m: 1.5, yaw: 0, joints: {blad: 0.0}"));
    spoiled("joint_outside", 2, blades("x_m: 0.6, y_m: 1.5, yaw: 0, joints: {blade: 270deg}"));
    spoiled("joint_of_a_rigid_robot", 2, set("yaw: 0deg}\ngoal", "yaw: 0deg, joints: {blade: 1}}\ngoal"));
    spoiled("limit_of_an_unknown_joint", 2, |s| {
        blades("x_m: 0.6, y_m: 1.5, yaw: 0deg")(s);
        s.write("missions/a.yaml", s.text("missions/a.yaml") + "limits: {joints: {blad: {speed: 1}}}\n");
    });
}

#[test]
fn poses_that_cannot_be() {
    spoiled("start_in_collision", 1, set("x_m: 0.6, y_m: 1.5", "x_m: 1.95, y_m: 1.4"));
    spoiled("start_too_close", 1, set("x_m: 0.6, y_m: 1.5", "x_m: 1.67, y_m: 1.5"));
    spoiled("goal_in_collision", 1, set("x_m: 3.4", "x_m: 1.95"));
    spoiled("goal_off_the_map", 1, set("x_m: 3.4", "x_m: 34"));
    spoiled("goal_at_the_edge", 1, set("x_m: 3.4", "x_m: 3.9"));
    let blocked = "via: [{x_m: 2.0, y_m: 0.6}, {x_m: 1.95, y_m: 1.5}]\ngoal:";
    spoiled("via_in_collision", 1, set("goal:", blocked));
    spoiled("via_for_days", 1, |s| {
        let day = "{x_m: 2.0, y_m: 0.6, dwell_s: 86400}";
        s.edit("missions/a.yaml", "goal:", &format!("via: [{day}, {day}, {day}]\ngoal:"));
    });
    let no_joint = "via: [{x_m: 2.0, y_m: 0.6}, {x_m: 2.0, y_m: 2.4, joints: {blade: 0}}]\ngoal:";
    spoiled("via_joint", 2, set("goal:", no_joint));
    spoiled("start_off_the_map", 1, set("x_m: 0.6", "x_m: -6"));
}

/// Points of a wall from (x, y) towards an axis, every 2 cm, 0.3 m high.
fn wall(x: f64, y: f64, dx: f64, dy: f64, length: f64) -> String {
    let count = (length / 0.02).round() as usize;
    (0..=count)
        .flat_map(|i| (0..8).map(move |k| (0.02 * i as f64, 0.03 + 0.04 * k as f64)))
        .map(|(s, z)| format!("{:.3},{:.3},{z:.3}\n", x + dx * s, y + dy * s))
        .collect()
}

#[test]
fn goals_that_cannot_be_reached() {
    spoiled("walled_off", 1, |s| s.write("maps/first.csv", s.text("maps/first.csv") + &wall(2.6, 0.0, 0.0, 1.0, 3.0)));
    spoiled("gap_too_narrow", 1, |s| {
        let walls = wall(2.6, 0.0, 0.0, 1.0, 1.3) + &wall(2.6, 1.75, 0.0, 1.0, 1.25);
        s.write("maps/first.csv", s.text("maps/first.csv") + &walls);
    });
    spoiled("blades_walled_off", 1, |s| {
        blades("x_m: 0.6, y_m: 1.5, yaw: 0deg")(s);
        let walls = wall(2.6, 0.0, 0.0, 1.0, 1.4) + &wall(2.6, 1.7, 0.0, 1.0, 1.3);
        s.write("maps/first.csv", s.text("maps/first.csv") + &walls);
    });
}

#[test]
fn given_paths() {
    spoiled("path_with_a_cusp", 2, path("path: {bezier: [[[0, 0], [1, 1], [0, 1], [1, 0]]]}"));
    spoiled(
        "path_against_start",
        2,
        path("path: {bezier: [[[0, 0], [2, 0], [4, 2], [4, 4]]]}\nstart: {x_m: 0.5, y_m: 0.0}"),
    );
    spoiled(
        "path_against_goal",
        2,
        path("path: {bezier: [[[0, 0], [2, 0], [4, 2], [4, 4]]]}\ngoal: {x_m: 4.0, y_m: 4.0, yaw: 0deg}"),
    );
    spoiled(
        "printed_law_on_two_segments",
        2,
        path("path: {bezier: [[[0, 0], [1, 0], [2, 0], [3, 0]], [[3, 0], [4, 0], [5, 0], [6, 0]]]}\ntime_law: printed"),
    );
    spoiled("minco_on_a_path", 2, path("path: {bezier: [[[0, 0], [2, 0], [4, 2], [4, 4]]]}\ntime_law: minco"));
    for (name, rows) in [
        ("path_file_columns", "x_m,y\n0,0\n1,0\n"),
        ("path_file_one_row", "x_m,y_m\n0,0\n"),
        ("path_file_word", "x_m,y_m\n0,0\n1,far\n"),
        ("path_file_twice", "x_m,y_m\n0,0\n1,0\n1,0\n2,0\n"),
        ("path_file_joint", "x_m,y_m,joint.lift.pos_m\n0,0,0\n1,0,0.1\n"),
        ("path_file_empty", ""),
    ] {
        spoiled(name, 2, |s| {
            s.write("missions/way.csv", rows);
            path("path: {file: way.csv}")(s);
        });
    }
    spoiled("path_into_an_obstacle", 1, |s| {
        s.write("maps/first.csv", s.text("maps/first.csv"));
        let map = "map: {file: ../maps/first.csv}";
        path(&format!("path: {{bezier: [[[0.6, 1.5], [1.5, 1.5], [2.5, 1.5], [3.4, 1.5]]]}}\n{map}"))(s);
    });
}

#[test]
fn the_command_line() {
    let sandbox = Sandbox::compiled();
    for (name, args) in [
        ("usage_command", &["compil", "missions/a.yaml"][..]),
        ("usage_nothing", &[]),
        ("usage_no_mission", &["compile"]),
        ("usage_option", &["compile", "missions/a.yaml", "--sampling", "0.1"]),
        ("usage_sampling_zero", &["compile", "missions/a.yaml", "--sampling-time", "0"]),
        ("usage_sampling_unit", &["compile", "missions/a.yaml", "--sampling-time", "0.1s"]),
        ("usage_format", &["compile", "missions/a.yaml", "--format", "bag"]),
        ("usage_shell", &["completions", "basch"]),
        ("usage_schema", &["schema", "map"]),
        ("usage_sampling_word", &["path-error", "missions/a.yaml", "--sampling", "midpoint"]),
        ("usage_max_error", &["path-error", "missions/a.yaml", "--max-error", "5cm"]),
        ("usage_sampling_times", &["path-error", "missions/a.yaml", "--sampling-times", "0.1,none"]),
    ] {
        let run = sandbox.run(args).expect(2);
        assert_eq!(run.stdout, "", "{name}");
        golden(name, &run.stderr);
    }
    assert!(sandbox.exists("out/a/commands.csv"), "usage that was not understood spoils nothing");
}

#[test]
fn output_folders_that_cannot_be() {
    spoiled_with("out_below_a_file", 2, &["--out", "maps/first.csv"], |s| {
        std::fs::remove_dir_all(s.path("out")).expect("remove");
    });
    let sandbox = Sandbox::new();
    sandbox.write("out/a", "a file");
    let run = sandbox.run(&["compile", "missions/a.yaml"]).expect(2);
    golden("out_is_a_file", &run.stderr);
    assert_eq!(sandbox.text("out/a"), "a file");
}

#[cfg(unix)]
#[test]
fn an_output_folder_without_permission_is_bad_input() {
    use std::os::unix::fs::PermissionsExt;
    let sandbox = Sandbox::new();
    sandbox.write("closed/note", "");
    let permit = |mode| std::fs::set_permissions(sandbox.path("closed"), std::fs::Permissions::from_mode(mode));
    permit(0o555).expect("permissions");
    if std::fs::write(sandbox.path("closed/probe"), "").is_ok() {
        return; // the superuser may write anywhere
    }
    let run = sandbox.run(&["compile", "missions/a.yaml", "--out", "closed"]).expect(2);
    permit(0o755).expect("permissions");
    golden("out_closed", &run.stderr);
}
