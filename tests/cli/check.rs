//! `check` judges what it is given, not what the planner meant.

use super::sandbox::{Sandbox, golden};

/// Replaces one number of a row (counted from the first) of a command file.
fn tamper(sandbox: &Sandbox, path: &str, row: usize, column: &str, change: impl Fn(f64) -> f64) {
    let text = sandbox.text(path);
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let head = lines.iter().position(|l| !l.starts_with('#')).expect("a header");
    let place = lines[head].split(',').position(|c| c == column).unwrap_or_else(|| panic!("{column}: {}", lines[head]));
    let mut cells: Vec<String> = lines[head + 1 + row].split(',').map(str::to_owned).collect();
    cells[place] = change(cells[place].parse().expect("a number")).to_string();
    lines[head + 1 + row] = cells.join(",");
    sandbox.write(path, lines.join("\n") + "\n");
}

/// All that a check says, on one line, and that it refuses.
fn refused(sandbox: &Sandbox, path: &str) -> String {
    let run = sandbox.run(&["check", path]).expect(1);
    assert!(run.stdout.contains("CHECKS FAIL"), "{}", run.stdout);
    run.stdout.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[test]
fn a_wheel_that_is_made_to_jump_is_named() {
    let sandbox = Sandbox::compiled();
    tamper(&sandbox, "out/a/commands.csv", 40, "wheel_left_rad_s", |w| w + 4.0);
    let text = refused(&sandbox, "out/a/commands.csv");
    let refusals: Vec<&str> = text.split(" refused ").skip(1).collect();
    assert!(refusals.iter().any(|r| r.contains("`wheel_left`")), "{text}");
    assert!(refusals.iter().any(|r| r.contains("line 51: v_mps is")), "{text}");
    let run = sandbox.run(&["check", "out/a/commands.csv", "--json"]).expect(1);
    assert!(run.stdout.contains("\"holds\": false") && run.stderr.is_empty(), "{}", run.stdout);
    sandbox.run(&["path-error", "out/a/commands.csv"]).expect(2);
}

#[test]
fn wheels_that_drive_into_the_post_are_told_which_link_and_when() {
    // Both wheels as in a straight drive: the twist columns follow, so only the replay can tell.
    let sandbox = Sandbox::compiled();
    let rows = sandbox.text("out/a/commands.csv").lines().filter(|l| !l.starts_with('#')).count() - 1;
    let mut last = 0.0;
    for row in 0..rows {
        let text = sandbox.text("out/a/commands.csv");
        let line = text.lines().filter(|l| !l.starts_with('#')).nth(row + 1).expect("row").to_owned();
        let cells: Vec<f64> = line.split(',').map(|c| c.parse().expect("number")).collect();
        let v = cells[3];
        last = v;
        for column in ["wheel_left_rad_s", "wheel_right_rad_s"] {
            tamper(&sandbox, "out/a/commands.csv", row, column, |_| v / 0.08);
        }
        tamper(&sandbox, "out/a/commands.csv", row, "omega_rad_s", |_| 0.0);
    }
    assert_eq!(last, 0.0);
    let text = refused(&sandbox, "out/a/commands.csv");
    assert!(text.contains("base_link") && text.contains("deep in the occupied cell"), "{text}");
    assert!(!text.contains("line "), "the rows agree with themselves: {text}");
}

#[test]
fn every_kind_of_tampering_is_refused() {
    for (row, column, by) in [(3, "wheel_right_rad_s", 0.5), (50, "v_mps", 0.1), (50, "omega_rad_s", 0.1)] {
        let sandbox = Sandbox::compiled();
        tamper(&sandbox, "out/a/commands.csv", row, column, |v| v + by);
        let text = refused(&sandbox, "out/a/commands.csv");
        assert!(text.contains(" refused "), "{column}: {text}");
    }
}

#[test]
fn commands_that_stop_short_of_the_goal_are_refused() {
    let sandbox = Sandbox::compiled();
    let text = sandbox.text("out/a/commands.csv");
    let kept: Vec<&str> = text.lines().collect();
    sandbox.write("out/a/commands.csv", kept[..kept.len() - 20].join("\n") + "\n");
    let text = refused(&sandbox, "out/a/commands.csv");
    assert!(text.contains("goal") && text.contains("rest"), "{text}");
}

#[test]
fn another_map_than_the_one_planned_on_is_noted_and_decides() {
    let sandbox = Sandbox::compiled();
    sandbox.write("maps/first.csv", sandbox.text("maps/first.csv") + "3.025,1.525,0.100\n");
    let text = refused(&sandbox, "out/a/commands.csv");
    assert!(text.contains("base_link") && text.contains(" note the mission, robot or map are not the ones"), "{text}");

    let sandbox = Sandbox::compiled();
    sandbox.write("maps/first.csv", sandbox.text("maps/first.csv") + "0.125,0.125,0.000\n");
    let run = sandbox.run(&["check", "out/a/commands.csv"]).expect(0);
    assert!(run.stdout.contains("all checks hold") && run.stdout.contains("  note "), "{}", run.stdout);
}

#[test]
fn a_stricter_mission_can_be_named() {
    let sandbox = Sandbox::compiled();
    sandbox.write(
        "missions/strict.yaml",
        sandbox.text("missions/a.yaml").replace("clearance_m: 0.05", "clearance_m: 0.2"),
    );
    let run = sandbox.run(&["check", "out/a/commands.csv", "--mission", "missions/strict.yaml"]).expect(1);
    assert!(run.stdout.contains("200 mm required"), "{}", run.stdout);
    sandbox.write("missions/slow.yaml", sandbox.text("missions/a.yaml") + "limits: {wheel: {speed_mps: 0.1}}\n");
    let run = sandbox.run(&["check", "out/a/commands.mcap", "--mission", "missions/slow.yaml"]).expect(1);
    assert!(run.stdout.contains("wheel_left"), "{}", run.stdout);
}

#[test]
fn a_file_that_cannot_be_read_is_bad_input() {
    let sandbox = Sandbox::compiled();
    let csv = sandbox.text("out/a/commands.csv");
    let mcap = sandbox.read("out/a/commands.mcap");
    let line = |at: usize, new: &str| {
        let mut lines: Vec<&str> = csv.lines().collect();
        lines[at] = new;
        lines.join("\n") + "\n"
    };
    let head = csv.lines().position(|l| !l.starts_with('#')).expect("header");
    let cases: [(&str, &str, Vec<u8>); 13] = [
        ("column", "c.csv", csv.replace(",omega_rad_s,", ",omega,").into_bytes()),
        ("no_column", "c.csv", csv.replace("wheel_left_rad_s,", "").into_bytes()),
        ("short_row", "c.csv", line(head + 3, "0.2,0.1").into_bytes()),
        ("nan", "c.csv", line(head + 1, "0,NaN,0,0,0,0,0,0").into_bytes()),
        ("word", "c.csv", line(head + 1, "0,fast,0,0,0,0,0,0").into_bytes()),
        ("no_rows", "c.csv", csv.lines().take(head + 1).map(|l| format!("{l}\n")).collect::<String>().into_bytes()),
        ("no_header", "c.csv", csv.lines().skip(head).map(|l| format!("{l}\n")).collect::<String>().into_bytes()),
        ("empty", "c.csv", Vec::new()),
        ("not_text", "c.csv", vec![0xff, 0xfe, 0, 1]),
        ("truncated", "c.mcap", mcap[..mcap.len() / 2].to_vec()),
        ("flipped", "c.mcap", mcap.iter().enumerate().map(|(i, b)| if i == 900 { b ^ 0x55 } else { *b }).collect()),
        ("garbage", "c.mcap", b"not an mcap file at all".to_vec()),
        ("empty_mcap", "c.mcap", Vec::new()),
    ];
    for (name, file, bytes) in cases {
        let path = format!("out/a/{file}");
        sandbox.write(&path, bytes);
        let run = sandbox.run(&["check", &path]);
        assert_eq!(run.code, 2, "{name}: {}{}", run.stdout, run.stderr);
        assert_eq!(run.stdout, "", "{name}");
        if name == "flipped" {
            assert!(run.stderr.contains("error[commands/damaged]"), "{}", run.stderr); // checksums are the motion's
        } else {
            golden(&format!("check_{name}"), &run.stderr);
        }
        for command in ["inspect", "path-error"] {
            sandbox.run(&[command, &path]).expect(2);
        }
    }
}

#[test]
fn a_mission_that_is_gone_can_be_named() {
    let sandbox = Sandbox::compiled();
    std::fs::rename(sandbox.path("missions/a.yaml"), sandbox.path("missions/b.yaml")).expect("rename");
    let run = sandbox.run(&["check", "out/a/commands.csv"]).expect(2);
    golden("check_mission_gone", &run.stderr);
    sandbox.run(&["check", "out/a/commands.csv", "--mission", "missions/b.yaml"]).expect(0);
}
