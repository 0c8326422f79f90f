//! `inspect` says what it understood of every kind of file.

use serde_json::Value;

use super::sandbox::{Sandbox, golden};

#[test]
fn every_kind_of_file_can_be_inspected() {
    let sandbox = Sandbox::compiled();
    for file in ["maps/depot.yaml", "maps/depot.pgm", "maps/levine_voxels.npy", "maps/levine_voxels.json"] {
        sandbox.ship(file);
    }
    sandbox.ship("maps/barn_29.pcd");
    sandbox.ship("maps/site.ply");
    for (name, file) in [
        ("urdf", "robots/conv/conv.urdf"),
        ("robot", "robots/scr_db/robot.yaml"),
        ("mission", "missions/a.yaml"),
        ("csv_points", "maps/first.csv"),
        ("pcd", "maps/barn_29.pcd"),
        ("ply", "maps/site.ply"),
        ("map_server", "maps/depot.yaml"),
        ("npy", "maps/levine_voxels.npy"),
        ("commands_csv", "out/a/commands.csv"),
        ("commands_mcap", "out/a/commands.mcap"),
    ] {
        let run = sandbox.run(&["inspect", file]).expect(0);
        assert_eq!(run.stderr, "", "{file}");
        if name.starts_with("commands") {
            // The motion's figures are the planner's; not golden.
            assert!(run.stdout.contains("rows") && run.stdout.contains("../../missions/a.yaml"), "{}", run.stdout);
        } else {
            golden(&format!("inspect_{name}"), &run.stdout);
        }
    }
}

/// The text with every number replaced, and without alignment: figures of the motion are the planner's.
fn without_figures(text: &str) -> String {
    let mut out = String::new();
    for c in text.chars() {
        match c {
            '0'..='9' if out.ends_with('#') => {}
            '0'..='9' => out.push('#'),
            ' ' if out.ends_with(' ') => {}
            c => out.push(c),
        }
    }
    out
}

#[test]
fn a_command_file_is_described_with_what_it_brings() {
    let sandbox = Sandbox::compiled();
    let said = |file: &str| sandbox.run(&["inspect", file]).expect(0).stdout;
    let (csv, mcap) = (said("out/a/commands.csv"), said("out/a/commands.mcap"));
    let rows = sandbox.text("out/a/commands.csv").lines().filter(|l| !l.starts_with('#')).count() - 1;
    for topic in ["/cmd_vel", "/wheel_velocity_controller/commands", "/joint_states", "/tf"] {
        let line = mcap.lines().find(|l| l.contains(topic)).unwrap_or_else(|| panic!("{topic}: {mcap}"));
        assert!(line.ends_with(&format!(" {rows}")), "{line}");
    }
    for (name, file) in [("mission.yaml", "missions/a.yaml"), ("robot.urdf", "robots/box_base/box_base.urdf")] {
        let line = mcap.lines().find(|l| l.contains(name)).unwrap_or_else(|| panic!("{name}: {mcap}"));
        assert!(line.ends_with(&format!(" {} bytes", sandbox.read(file).len())), "{line}");
    }
    let shared =
        |text: &str| text.lines().skip(1).filter(|l| !l.contains("a.yaml")).map(str::to_owned).collect::<Vec<_>>();
    assert!(
        shared(&csv).iter().filter(|l| !l.contains("robot")).all(|line| mcap.contains(line.as_str())),
        "{csv}{mcap}"
    );
    let hash = mcap.split_once("blake3 ").expect("a hash").1.lines().next().expect("a hash").to_owned();
    golden("inspect_commands_mcap", &without_figures(&mcap.replace(&hash, "…")));

    let json = |file: &str| -> Value {
        serde_json::from_str(&sandbox.run(&["inspect", file, "--json"]).expect(0).stdout).expect("JSON")
    };
    let [csv, mcap] = ["out/a/commands.csv", "out/a/commands.mcap"].map(json);
    for key in ["commands", "metrics", "limits", "first", "inputs_blake3", "mission", "joints"] {
        assert_eq!(csv[key], mcap[key], "{key}");
    }
    assert_eq!(mcap["commands"]["rows"], rows);
    assert_eq!(mcap["recorded"]["status"], "certified");
    assert!(mcap["recorded"]["certificate"]["clearance_proven_m"].as_f64() >= Some(0.05));
    assert_eq!((mcap["attachments"][0]["name"].as_str(), csv["recorded"].is_null()), (Some("mission.yaml"), true));
    assert!(mcap["limits"].as_array().is_some_and(|rows| rows.len() == 6));

    // Without its mission a CSV file is described all the same; an MCAP file misses nothing.
    sandbox.remove("missions/a.yaml");
    let text = said("out/a/commands.csv");
    assert!(text.contains("limits     not known: ") && text.contains("which is not there"), "{text}");
    sandbox.remove("maps/first.csv");
    assert!(said("out/a/commands.mcap").contains("    wheel_left   "));
}

#[test]
fn robots_maps_and_missions_are_described_for_programs_too() {
    let sandbox = Sandbox::new();
    let json = |file: &str| -> Value {
        serde_json::from_str(&sandbox.run(&["inspect", file, "--json"]).expect(0).stdout).expect("JSON")
    };
    assert_eq!(json("robots/scr_db/robot.yaml")["joints"][0]["name"], "blade");
    assert!(json("maps/first.csv")["occupied"].as_u64() > Some(0));
    let mission = json("missions/a.yaml");
    assert_eq!((&mission["mission"], &mission["robot"]["name"]), (&Value::from("a"), &Value::from("box_base")));
    assert_eq!(mission["reads"][0], "missions/a.yaml");
}

#[test]
fn every_kind_of_file_can_be_drawn_and_the_same_file_draws_the_same() {
    let sandbox = Sandbox::compiled();
    for (file, expected) in [
        ("robots/scr_db/robot.yaml", &["Robot scr_db", "joints at 50 % of their range", "moved by joints"][..]),
        ("missions/a.yaml", &["Mission a", "obstacle", "start", "goal"]),
        ("maps/first.csv", &["Map maps/first.csv", "up to z 0.40 m", "slice at z 0.23 m", "x m"]),
        ("out/a/commands.csv", &["Commands out/a/commands.csv", "obstacle", "path of the base", "rim speed m/s"]),
        ("out/a/commands.mcap", &["Commands out/a/commands.mcap", "rim speed m/s"]),
    ] {
        let drawn = |name: &str| {
            sandbox.run(&["inspect", file, "--plot", name]).expect(0);
            sandbox.text(name)
        };
        let picture = drawn("a.svg");
        let tree = roxmltree::Document::parse(&picture).expect("well-formed");
        let texts: Vec<&str> = tree.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).collect();
        for text in expected {
            assert!(texts.contains(text), "{file}: {text} in {texts:?}");
        }
        assert_eq!(picture, drawn("b.svg"), "{file}");
    }
    // A command file whose mission is gone is drawn without obstacles.
    sandbox.remove("missions/a.yaml");
    sandbox.run(&["inspect", "out/a/commands.csv", "--plot", "c.svg"]).expect(0);
    assert!(!sandbox.text("c.svg").contains("obstacle") && sandbox.text("c.svg").contains("path of the base"));
    let run = sandbox.run(&["inspect", "maps/first.csv", "--plot", "none/d.svg"]).expect(2);
    assert!(run.stderr.contains("cannot write `none/d.svg`"), "{}", run.stderr);
}

#[test]
fn the_slab_of_a_map_is_two_numbers() {
    let sandbox = Sandbox::new();
    let run = sandbox.run(&["inspect", "--height", "0.1,0.2", "maps/first.csv"]).expect(0);
    assert!(run.stdout.contains("obstacles z 0.100 to 0.200 m"), "{}", run.stdout);
    sandbox.run(&["inspect", "--height", "-0.1,0.2", "maps/first.csv"]).expect(0);
    for wrong in [["--height", "1"], ["--height", "1,0"], ["--height", "nan,1"], ["--height", "0,1,2"]] {
        let run = sandbox.run(&["inspect", wrong[0], wrong[1], "maps/first.csv"]).expect(2);
        assert!(run.stderr.contains("is no slab"), "{}", run.stderr);
    }
    sandbox.run(&["inspect", "--resolution", "nan", "maps/first.csv"]).expect(2);
}

#[test]
fn what_is_no_such_file_is_said_to_be_none() {
    let sandbox = Sandbox::new();
    sandbox.write("odd.bin", [0u8, 159, 146, 150]);
    sandbox.write("empty.yaml", "");
    for (name, file) in
        [("missing", "maps/none.pcd"), ("ending", "odd.bin"), ("folder", "maps"), ("empty", "empty.yaml")]
    {
        let run = sandbox.run(&["inspect", file]).expect(2);
        assert_eq!(run.stdout, "");
        golden(&format!("inspect_{name}"), &run.stderr);
    }
}
