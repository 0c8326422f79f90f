//! Missions that stop on the way, and obstacles that only a mission has.

use serde_json::Value;

use super::sandbox::Sandbox;
use trajc::math::real;

/// The sandbox's mission with this before its goal.
fn sandbox_with(line: &str) -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.edit("missions/a.yaml", "goal:", &format!("{line}\ngoal:"));
    sandbox
}

/// Columns of the commands, row by row.
fn rows(sandbox: &Sandbox, columns: &[&str]) -> Vec<Vec<f64>> {
    let text = sandbox.text("out/a/commands.csv");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().expect("a header").split(',').collect();
    let at: Vec<usize> = columns.iter().map(|c| header.iter().position(|h| h == c).expect("a column")).collect();
    let row = |line: &str| {
        let words: Vec<&str> = line.split(',').collect();
        at.iter().map(|i| words[*i].parse().expect("a number")).collect()
    };
    lines.map(row).collect()
}

#[test]
fn a_round_is_one_command_file_that_stands_at_every_via() {
    let sandbox = sandbox_with(
        "via:\n  - {x_m: 2.0, y_m: 0.6, dwell_s: 1.25}\n  - {x_m: 3.3, y_m: 2.3, yaw: 90deg}\n  - {x_m: 3.3, y_m: 2.3}\n  \
         - {x_m: 0.6, y_m: 1.5, yaw: 0deg}",
    );
    let run = sandbox.run(&["compile", "missions/a.yaml"]).expect(0);
    assert!(run.stdout.contains("\n  stops       at "), "{}", run.stdout);
    let report: Value = serde_json::from_slice(&sandbox.read("out/a/report.json")).expect("JSON");
    let vias = report["certificate"]["vias"].as_array().expect("a list");
    let rows = rows(&sandbox, &["time_s", "wheel_left_rad_s", "wheel_right_rad_s", "x_m", "y_m", "yaw_rad"]);
    let places = [(2.0, 0.6, None), (3.3, 2.3, Some(90f64)), (3.3, 2.3, None), (0.6, 1.5, Some(0.0))];
    assert_eq!(vias.len(), places.len());
    let mut before = 0.0;
    for (via, (x, y, yaw)) in vias.iter().zip(places) {
        let time = via["time_s"].as_f64().expect("a number");
        assert!(time > before);
        before = time;
        let row = rows.iter().find(|row| (row[0] - time).abs() < 1e-9).expect("a row");
        assert_eq!([row[1], row[2]], [0.0, 0.0]);
        assert!(real::hypot(row[3] - x, row[4] - y) < 1e-3, "{row:?}");
        let turned = |yaw: f64| real::sin(row[5] - yaw.to_radians()).abs();
        assert!(yaw.is_none_or(|yaw| turned(yaw) < 2e-3), "{row:?}");
    }
    let dwelt =
        rows.iter().filter(|row| row[1] == 0.0 && row[2] == 0.0 && real::hypot(row[3] - 2.0, row[4] - 0.6) < 1e-3);
    assert_eq!(dwelt.count(), 13, "1.25 s are 13 rows of 0.1 s");
    for file in ["commands.csv", "commands.mcap"] {
        let run = sandbox.run(&["check", &format!("out/a/{file}")]).expect(0);
        assert!(run.stdout.contains("all checks hold"), "{}", run.stdout);
    }
    for (from, to) in [("x_m: 2.0, y_m: 0.6", "x_m: 2.0, y_m: 0.602"), ("dwell_s: 1.25", "dwell_s: 1.35")] {
        sandbox.edit("missions/a.yaml", from, to);
        let run = sandbox.run(&["check", "out/a/commands.csv", "--mission", "missions/a.yaml"]).expect(1);
        assert!((run.stdout + &run.stderr).contains("does not stop at via[0]"));
        sandbox.edit("missions/a.yaml", to, from);
    }
}

#[test]
fn a_stretch_without_a_way_is_named() {
    let sandbox = sandbox_with("via: [{x_m: 2.0, y_m: 0.6}, {x_m: 1.95, y_m: 1.5}]");
    let run = sandbox.run(&["compile", "missions/a.yaml"]).expect(1);
    assert!(
        run.stderr.contains("on the stretch from `via[0]` to `via[1]`: the goal is in collision"),
        "{}",
        run.stderr
    );
    assert!(run.stderr.contains(" --> missions/a.yaml:8:29\n"), "{}", run.stderr);
    assert!(!sandbox.exists("out/a/commands.csv"));
}

#[test]
fn a_zone_is_driven_slowly_and_that_is_proven() {
    let sandbox = Sandbox::new();
    sandbox.run(&["compile", "missions/a.yaml"]).expect(0);
    let free = rows(&sandbox, &["time_s"]).len();
    let zones = "speed_zones:\n    - {polygon_m: [[1.6, 0.0], [2.4, 0.0], [2.4, 3.0], [1.6, 3.0]], speed_mps: 0.15}\n    \
                 - {polygon_m: [[0.0, 2.9], [0.1, 2.9], [0.1, 3.0]], speed_mps: 0.05}";
    sandbox.edit("missions/a.yaml", "resolution_m: 0.05", &format!("resolution_m: 0.05\n  {zones}"));
    // The commands from before are too fast there.
    let run = sandbox.run(&["check", "out/a/commands.csv", "--mission", "missions/a.yaml"]).expect(1);
    let words = run.stdout.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("in or at speed_zones[0], where 0.15 m/s are allowed"), "{words}");
    for law in ["auto", "minco", "fixed_point"] {
        sandbox.edit("missions/a.yaml", "clearance_m: 0.05", &format!("clearance_m: 0.05\ntime_law: {law}"));
        let run = sandbox.run(&["compile", "missions/a.yaml"]).expect(0);
        assert!(
            run.stdout.contains("\n  slow zones  0.") && run.stdout.contains("/0.15 m/s, not entered\n"),
            "{}",
            run.stdout
        );
        let report: Value = serde_json::from_slice(&sandbox.read("out/a/report.json")).expect("JSON");
        let proven = &report["certificate"]["speed_zones"];
        let peak = proven[0]["peak_mps"].as_f64().expect("a number");
        // Laws that cannot slow down locally slow the whole leg, and some more than they need.
        assert!(peak <= 0.15 && peak > if law == "auto" { 0.1 } else { 0.02 }, "{law}: {peak}");
        assert!(proven[1].get("peak_mps").is_none());
        let rows = rows(&sandbox, &["x_m", "v_mps"]);
        let inside = rows.iter().filter(|row| (1.6..=2.4).contains(&row[0])).map(|row| row[1]);
        assert!(inside.fold(0.0, f64::max) <= peak);
        if law == "auto" {
            assert!(rows.iter().any(|row| row[1] > 0.25), "fast elsewhere");
            // The zone is 0.8 m wide; a row lasts 0.1 s.
            let inside = rows.iter().filter(|row| (1.6..=2.4).contains(&row[0])).count();
            assert!(inside >= 52 && rows.len() > free, "{inside} of {} rows, without it {free}", rows.len());
        }
        sandbox.run(&["check", "out/a/commands.mcap"]).expect(0);
        sandbox.edit("missions/a.yaml", &format!("\ntime_law: {law}"), "");
    }
    sandbox.run(&["inspect", "missions/a.yaml", "--plot", "a.svg"]).expect(0);
    assert!(sandbox.text("a.svg").contains("0.15 m/s"));
    sandbox.run(&["compile", "missions/a.yaml", "--report", "svg"]).expect(0);
    assert!(sandbox.text("out/a/report.svg").contains("speed zone"));
}

#[test]
fn a_goal_with_a_radius_is_proven_as_that_region() {
    let sandbox = sandbox_with("via: [{x_m: 2.0, y_m: 0.6, within_m: 0.2, yaw: any}]");
    let goal = "goal: {x_m: 3.4, y_m: 1.5, yaw: 0deg}";
    sandbox.edit("missions/a.yaml", goal, "goal: {x_m: 3.4, y_m: 1.5, within_m: 0.4, yaw: any}");
    let run = sandbox.run(&["compile", "missions/a.yaml"]).expect(0);
    assert!(run.stdout.contains(" from its middle; allowed: 400 mm\n"), "{}", run.stdout);
    let report: Value = serde_json::from_slice(&sandbox.read("out/a/report.json")).expect("JSON");
    let proof = &report["certificate"];
    let off = proof["end_point_error_m"].as_f64().expect("a number");
    let last = rows(&sandbox, &["x_m", "y_m"]).pop().expect("rows");
    assert!(off < 0.4 && off > 0.3 && (real::hypot(last[0] - 3.4, last[1] - 1.5) - off).abs() < 1e-6, "{off} {last:?}");
    assert_eq!(proof["goal_within_m"], 0.4);
    let via = proof["vias"][0]["point_error_m"].as_f64().expect("a number");
    assert!(via < 0.2 && via > 0.1, "{via}");
    sandbox.run(&["check", "out/a/commands.mcap"]).expect(0);
    // What was asked is what is proven: a smaller region is another one.
    sandbox.edit("missions/a.yaml", "within_m: 0.4", "within_m: 0.39");
    let run = sandbox.run(&["check", "out/a/commands.csv", "--mission", "missions/a.yaml"]).expect(1);
    assert!(run.stdout.contains("from the goal (390 mm allowed)"), "{}", run.stdout);
    sandbox.run(&["inspect", "missions/a.yaml", "--plot", "a.svg"]).expect(0);
    assert!(sandbox.text("a.svg").contains("any place will do"));
    // The post's own place, and nothing that is free around it.
    sandbox.edit("missions/a.yaml", "{x_m: 3.4, y_m: 1.5, within_m: 0.39", "{x_m: 1.95, y_m: 1.5, within_m: 0.1");
    let run = sandbox.run(&["compile", "missions/a.yaml"]).expect(1);
    assert!(run.stderr.contains("the goal is any place within 0.1 m of (1.950, 1.500)"), "{}", run.stderr);
}

#[test]
fn areas_and_boxes_of_the_mission_are_driven_around_and_are_in_the_proof() {
    let south = "keep_out: [{polygon_m: [[1.6, 0.0], [2.4, 0.0], [2.0, 1.4]]}]";
    let north = "boxes: [{min_m: [1.8, 1.6, 0.0], max_m: [2.2, 3.0, 0.2]}]";
    let with = |added: &str| {
        let sandbox = Sandbox::new();
        sandbox.edit("missions/a.yaml", "resolution_m: 0.05", &format!("resolution_m: 0.05\n  {added}"));
        sandbox
    };
    for (added, side) in [(south, 1.0), (north, -1.0)] {
        let sandbox = with(added);
        sandbox.run(&["compile", "missions/a.yaml"]).expect(0);
        let middle = rows(&sandbox, &["x_m", "y_m"]).into_iter().filter(|row| (row[0] - 2.0).abs() < 0.3);
        assert!(middle.map(|row| side * (row[1] - 1.5)).fold(f64::INFINITY, f64::min) > 0.2, "{added}");
        // The way of the one leads through the obstacle of the other.
        let other = if added == south { north } else { south };
        sandbox.edit("missions/a.yaml", added, other);
        let run = sandbox.run(&["check", "out/a/commands.csv", "--mission", "missions/a.yaml"]).expect(1);
        assert!((run.stdout + &run.stderr).contains("clearance"));
    }
    let both = with(&format!("{south}\n  {north}"));
    assert!(both.run(&["compile", "missions/a.yaml"]).expect(1).stderr.contains("no way to the goal"));
    both.edit("missions/a.yaml", "goal:", "via: [{x_m: 0.8, y_m: 2.4}]\ngoal:");
    let after_a_stop = both.run(&["compile", "missions/a.yaml"]).expect(1).stderr;
    assert!(after_a_stop.contains("on the stretch from `via[0]` to the goal: no way"), "{after_a_stop}");
    assert!(after_a_stop.contains("or say which heading and joints `via[0]` shall have"), "{after_a_stop}");
}
