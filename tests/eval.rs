//! `trajc eval`, the program itself: tables, JSON, files, exit codes.

use std::path::Path;
use std::process::{Command, Output};

use serde_json::Value;

fn eval(args: &[&str], folder: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trajc"));
    command.arg("eval").args(args).current_dir(folder).output().expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).expect("UTF-8")
}

/// Two easy scenes and one whose start is in a box.
const SCENES: &str = r#"{"schema": "trajc.scenes/1", "name": "mine", "seed": 0, "bounds": [[-1, -1, 0], [3, 2, 0.4]],
  "resolution": 0.05, "clearance_m": 0.03, "limits": {"base": {"eta": 0.4}}, "scenes": [
  {"id": "ahead", "boxes": [], "start": {"x": 0, "y": 0, "yaw": 0}, "goal": {"x": 2, "y": 0.2, "yaw": 0}},
  {"id": "around", "boxes": [{"min": [0.9, -1, 0], "max": [1.1, 0.3, 0.4]}],
    "start": {"x": 0, "y": 0, "yaw": 0}, "goal": {"x": 2, "y": 0, "yaw": 0}},
  {"id": "blocked", "boxes": [{"min": [-0.2, -0.2, 0], "max": [0.2, 0.2, 0.4]}],
    "start": {"x": 0, "y": 0, "yaw": 0}, "goal": {"x": 2, "y": 0, "yaw": 0}}]}"#;

const ROBOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/robots/box_base");

#[test]
fn a_file_of_scenes_gives_the_json_of_the_contract_and_the_commands_of_what_is_certified() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("s.json"), SCENES).expect("written");
    // Left from an earlier run: must not pass for this one's.
    std::fs::create_dir_all(folder.path().join("out/blocked")).expect("made");
    std::fs::write(folder.path().join("out/blocked/commands.csv"), "old").expect("written");
    let args = ["--scenes", "s.json", "--robot", ROBOT, "--json", "--write-commands", "out"];
    let output = eval(&args, folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(output.stderr.is_empty(), "no progress where there is no terminal: {}", text(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).expect("JSON and nothing else");
    let keys = json.as_object().map(|o| o.keys().cloned().collect::<Vec<_>>());
    assert_eq!(keys, Some(vec!["scenes".to_owned(), "totals".to_owned()]));
    for (scene, id) in json["scenes"].as_array().expect("a list").iter().zip(["ahead", "around", "blocked"]) {
        assert_eq!(scene["id"], id);
        let certified = id != "blocked";
        assert_eq!(scene["status"], if certified { "certified" } else { "failed" });
        for figure in ["optimize_ms", "retime_ms", "certify_ms", "clearance_proven_m"] {
            assert_eq!(scene[figure].is_number(), certified, "{id}: {figure}");
        }
        assert!(scene["search_ms"].is_number());
        let metrics = [
            "length_m",
            "time_s",
            "mean_jerk_mps3",
            "mean_acceleration_mps2",
            "mean_angular_acceleration_rads2",
            "mean_joint_jerk_rads3",
        ];
        assert!(!certified || metrics.iter().all(|m| scene["metrics"][m].is_number()), "{scene}");
        assert_eq!(scene["metrics"].is_null(), !certified);
        assert_eq!(scene.get("failure").is_some(), !certified);
        let written = |file: &str| std::fs::read_to_string(folder.path().join("out").join(id).join(file)).ok();
        assert_eq!(written("commands.csv").is_some(), certified, "{id}");
        if let Some(commands) = written("commands.csv") {
            assert!(commands.contains(&format!("# mission: s.json#{id}\n")), "{commands}");
            let report: Value = serde_json::from_str(&written("report.json").expect("beside")).expect("JSON");
            assert_eq!(report["status"], "certified");
            assert_eq!(report["inputs"]["mission"]["path"], format!("s.json#{id}"));
            let rows = commands.lines().filter(|l| !l.starts_with('#')).count() - 1;
            assert_eq!(report["commands"]["rows"], rows);
            assert_eq!(report["commands"]["duration_s"], scene["metrics"]["time_s"], "time is that of the commands");
        }
    }
    let totals = &json["totals"];
    assert_eq!([&totals["count"], &totals["certified"], &totals["failed"]], [3, 2, 1]);
    assert_eq!(json["scenes"][2]["failure"]["stage"], "search");
}

#[test]
fn a_suite_of_three_scenes_is_written_read_back_and_judged_alike() {
    let folder = tempfile::tempdir().expect("a folder");
    let suite = ["--suite", "table3", "--boxes", "10", "--count", "3", "--seed", "7"];
    let args: Vec<&str> = suite.iter().copied().chain(["--write-scenes", "s.json", "--profile"]).collect();
    let output = eval(&args, folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let table = text(&output.stdout);
    for expected in ["Table III, 3 scenes", "10 paper, proposed", "10 paper, TEB", "10 DDR-opt", "10 trajc"] {
        assert!(table.contains(expected), "{table}");
    }
    for expected in ["of 3 certified", "search + optimise: median", "certify: median", "ms a scene by stage", "esdf"] {
        assert!(table.contains(expected), "{table}");
    }
    let first = |args: &[&str]| -> Value {
        let output = eval(args, folder.path());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        let mut json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
        json["scenes"][0].take()
    };
    let drawn: Vec<&str> = suite.iter().copied().chain(["--json"]).collect();
    let (drawn, read) = (first(&drawn), first(&["--scenes", "s.json", "--json", "--count", "1"]));
    assert_eq!(drawn["id"], "table3-10-7-000");
    assert_eq!([&drawn["id"], &drawn["status"], &drawn["metrics"]], [&read["id"], &read["status"], &read["metrics"]]);
}

#[test]
fn a_parameterisation_is_taken_for_all_scenes() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("s.json"), SCENES).expect("written");
    for parameterisation in ["flat", "arc_length"] {
        let args = ["--scenes", "s.json", "--robot", ROBOT, "--write-commands", parameterisation, "--parameterisation"];
        let args: Vec<&str> = args.into_iter().chain([parameterisation]).collect();
        let output = eval(&args, folder.path());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        for id in ["ahead", "around"] {
            let path = folder.path().join(parameterisation).join(id).join("report.json");
            let report: Value = serde_json::from_str(&std::fs::read_to_string(path).expect("beside")).expect("JSON");
            assert_eq!(report["trajectory"]["parameterisation"], parameterisation);
        }
    }
}

#[test]
fn figures_five_and_six_are_compiled_drawn_and_stand_beside_the_paper() {
    let folder = tempfile::tempdir().expect("a folder");
    let table = |suite: &str, more: &[&str]| {
        let args: Vec<&str> = ["--suite", suite].iter().chain(more).copied().collect();
        let output = eval(&args, folder.path());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    let picture =
        |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    let six = table("fig6", &[]);
    for expected in ["Fig. 6", "wheel_left", "blade", "1 of 1 certified", "picture: out/fig6.svg"] {
        assert!(six.contains(expected), "{expected} in {six}");
    }
    let first = picture("out/fig6.svg");
    table("fig6", &["--plot", "again"]);
    assert!(first == picture("again/fig6.svg"), "the same scene gives the same bytes");
    let tree = roxmltree::Document::parse(&first).expect("well-formed");
    let texts: Vec<&str> = tree.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).collect();
    for expected in
        ["overhead", "obstacle", "start", "goal", "x m", "y m", "Joint blade", "position rad", "rim speed m/s"]
    {
        assert!(texts.contains(&expected), "{expected} in {texts:?}");
    }
    let five = table("fig5", &[]);
    for expected in ["9.3", "ours, one curve, without DS", "ours, one curve, with DS", "ours, as usual"] {
        assert!(five.contains(expected), "{expected} in {five}");
    }
    for name in ["out/fig5.svg", "out/fig5-spins.svg"] {
        assert!(five.contains(&format!("picture: {name}")), "{five}");
        let file = picture(name);
        assert!(roxmltree::Document::parse(&file).is_ok() && file.contains("radius mm"));
    }
}

#[test]
fn a_scene_that_failed_is_drawn_with_its_reason() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("s.json"), SCENES).expect("written");
    let output = eval(&["--scenes", "s.json", "--robot", ROBOT, "--plot", "p"], folder.path());
    assert!(text(&output.stdout).contains("picture: p/around.svg"), "{}", text(&output.stdout));
    let blocked = std::fs::read_to_string(folder.path().join("p/blocked.svg")).expect("drawn");
    assert!(blocked.contains("failed.") && blocked.contains(">start<") && !blocked.contains("path of the base"));
}

#[test]
fn bad_input_ends_with_two_and_says_what_to_do() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).expect("written");
    write("good.json", SCENES);
    write("key.json", &SCENES.replace("\"clearance_m\"", "\"clearance\""));
    write("joint.json", &SCENES.replacen("\"yaw\": 0}", "\"yaw\": 0, \"joints\": {\"blade\": 1}}", 1));
    write("text.json", "schema: trajc.scenes/1");
    std::fs::write(folder.path().join("bytes.json"), [0xff, 0xfe, 0x00]).expect("written");
    std::fs::create_dir(folder.path().join("empty")).expect("made");
    let table: &[(&[&str], &str)] = &[
        (&[], "--suite"),
        (&["--suite", "table4"], "table3"),
        (&["--suite", "table1", "--parameterisation", "arclength"], "arc_length"),
        (&["--suite", "table1", "--scenes", "good.json"], "cannot be used with"),
        (&["--suite", "table1", "--boxes", "10"], "`--boxes` is for table3"),
        (&["--suite", "fig5", "--seed", "2"], "fig5 is one fixed scene"),
        (&["--suite", "fig6", "--count", "3"], "fig6 is one fixed scene"),
        (&["--suite", "fig6", "--plot", "good.json"], "cannot make folder `good.json`"),
        (&["--suite", "table3", "--boxes", "0"], "1..=60"),
        (&["--suite", "table3", "--count", "0"], "1..=5000"),
        (&["--scenes", "none.json"], "no such file: `none.json`"),
        (&["--scenes", "empty"], "is a folder"),
        (&["--scenes", "good.json"], "need `--robot`"),
        (&["--scenes", "good.json", "--robot", "empty"], "no robot.yaml"),
        (&["--scenes", "good.json", "--robot", "none.yaml"], "no such file: `none.yaml`"),
        (&["--scenes", "key.json", "--robot", ROBOT], "did you mean `clearance_m`?"),
        (&["--scenes", "joint.json", "--robot", ROBOT], "scenes[0].start.joints.blade"),
        (&["--scenes", "text.json", "--robot", ROBOT], "not JSON"),
        (&["--scenes", "bytes.json", "--robot", ROBOT], "not UTF-8"),
        (&["--suite", "table2", "--count", "1", "--write-scenes", "none/s.json"], "cannot write `none/s.json`"),
    ];
    for (args, expected) in table {
        let output = eval(args, folder.path());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{args:?}: {said}");
        assert!(said.contains(expected), "{args:?}: {said}");
        assert!(output.stdout.is_empty(), "{args:?}");
    }
}
