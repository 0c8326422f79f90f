//! `trajc eval`, the program itself: tables, JSON, files, exit codes.

use std::path::Path;
use std::process::{Command, Output};
use trajc::math::real;

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
fn rooms_for_arms_stand_beside_topay_and_take_any_robot_as_table_one_does() {
    let folder = tempfile::tempdir().expect("a folder");
    let suite = ["--suite", "arm", "--robot", ROBOT, "--count", "1", "--seed", "3"];
    let args: Vec<&str> = suite.iter().copied().chain(["--write-scenes", "s.json"]).collect();
    let output = eval(&args, folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let table = text(&output.stdout);
    for expected in ["Rooms for arms, 2 scenes", "cuboids TopAY, measured", "tables trajc, certified", "of 2 certified"]
    {
        assert!(table.contains(expected), "{expected} in {table}");
    }
    let output = eval(&["--scenes", "s.json", "--robot", ROBOT, "--json", "--write-commands", "out"], folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let rows = json["totals"]["by_kind"].as_array().expect("a list");
    for ((row, scene), kind) in rows.iter().zip(json["scenes"].as_array().expect("a list")).zip(["cuboids", "tables"]) {
        assert_eq!([&row["kind"], &scene["kind"]], [kind; 2]);
        assert_eq!(scene["id"], format!("arm-{kind}-3-000"));
        let certified = scene["status"] == "certified";
        assert_eq!((&row["count"], &row["certified"]), (&Value::from(1), &Value::from(i32::from(certified))));
        assert_eq!(row["time_s"], scene["metrics"]["time_s"], "of one scene the mean is its own");
        assert_eq!(row["failures"].as_object().map(serde_json::Map::len), Some(usize::from(!certified)));
        let written = folder.path().join("out").join(format!("arm-{kind}-3-000")).join("commands.csv");
        assert_eq!(written.exists(), certified);
    }
    assert_eq!(rows.len(), 2);
    // The limits that the suite has for another robot's blades are no fault of this one.
    let output = eval(&["--suite", "table1", "--robot", ROBOT, "--count", "1"], folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("Table I, 1 scenes"));
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

/// Held rim speeds (left, right) of a command file of the robot of [CONV], m/s.
fn rims(csv: &str) -> Vec<[f64; 2]> {
    let rows = csv.lines().filter(|l| !l.starts_with('#')).skip(1);
    let rim = |cell: Option<&str>| 0.1 * cell.and_then(|c| c.parse::<f64>().ok()).expect("a number");
    rows.map(|row| row.split(',').skip(1)).map(|mut cells| [rim(cells.next()), rim(cells.next())]).collect()
}

/// Largest speed, acceleration and jerk of either wheel: differences over 0.1 s, at rest before and after.
fn peaks(rims: &[[f64; 2]]) -> [f64; 3] {
    let mut peaks = [0.0f64; 3];
    for side in 0..2 {
        let mut held: Vec<f64> = [0.0; 3].into_iter().chain(rims.iter().map(|r| r[side])).chain([0.0; 3]).collect();
        for peak in &mut peaks {
            *peak = held.iter().fold(*peak, |most, value| most.max(value.abs()));
            held = held.windows(2).map(|pair| (pair[1] - pair[0]) / 0.1).collect();
        }
    }
    peaks
}

/// Where a robot ends that clips its rim speeds, by small steps.
fn driven(rims: &[[f64; 2]], [mut x, mut y, mut yaw]: [f64; 3], clip: f64) -> [f64; 2] {
    const STEPS: usize = 400;
    for [left, right] in rims.iter().map(|rims| rims.map(|v| v.clamp(-clip, clip))) {
        let (step, turn) = (0.5 * (left + right) * 0.1 / STEPS as f64, (right - left) / 0.4 * 0.1 / STEPS as f64);
        for _ in 0..STEPS {
            let (sin, cos) = real::sin_cos(yaw + 0.5 * turn);
            (x, y, yaw) = (x + step * cos, y + step * sin, yaw + turn);
        }
    }
    [x, y]
}

#[test]
fn curves_stand_beside_the_optimum_and_what_the_paper_found_takes_the_clip_and_nothing_else() {
    let folder = tempfile::tempdir().expect("a folder");
    // Left from an earlier run of a law that refuses: must not pass for this one's.
    std::fs::create_dir_all(folder.path().join("c/hairpin_20mm")).expect("made");
    std::fs::write(folder.path().join("c/hairpin_20mm/eq5.csv"), "old").expect("written");
    let output = eval(&["--suite", "curves", "--json", "--write-commands", "c"], folder.path());
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let json: Value = serde_json::from_slice(&output.stdout).expect("JSON and nothing else");
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("a number, not {value}"));
    let ids: Vec<&Value> = json["curves"].as_array().expect("a list").iter().map(|c| &c["id"]).collect();
    assert_eq!(ids, ["c_curve", "s_curve", "arbitrary", "hairpin_100mm", "hairpin_20mm"]);
    for curve in json["curves"].as_array().expect("a list") {
        let id = curve["id"].as_str().expect("text");
        let segments: Vec<[[f64; 2]; 4]> =
            serde_json::from_value(curve["control_points_m"].clone()).expect("control points");
        let ([from, handle, ..], [.., to]) = (segments[0], segments[segments.len() - 1]);
        let start = [from[0], from[1], real::atan2(handle[1] - from[1], handle[0] - from[0])];
        let rows = curve["rows"].as_array().expect("a list");
        for row in rows {
            let name = format!("{id}/{}.csv", row["name"].as_str().expect("text"));
            let file = std::fs::read_to_string(folder.path().join("c").join(&name));
            if row.get("refused").is_some() {
                assert!(file.is_err() && row.get("peaks").is_none(), "{name}");
                continue;
            }
            let rims = rims(&file.unwrap_or_else(|e| panic!("{name}: {e}")));
            let found = peaks(&rims);
            for (found, key) in found.iter().zip(["speed_mps", "acceleration_mps2", "jerk_mps3"]) {
                assert!((number(&row["peaks"][key]) / found - 1.0).abs() < 1e-9, "{name}: {found} {key} in {row}");
            }
            for (clip, key) in [(f64::INFINITY, "end_point"), (0.5, "end_point_clipped")] {
                let end = driven(&rims, start, clip);
                let miss = real::hypot(end[0] - to[0], end[1] - to[1]);
                assert!((number(&row[key]["distance_m"]) - miss).abs() < 1e-6, "{name}: {miss} in {row}");
            }
            let keeps = found.iter().zip([0.5, 0.2, 0.2]).all(|(peak, limit)| *peak <= limit * (1.0 + 1e-9));
            assert_eq!(row["limits_hold"], keeps, "{name}");
            if row["compiled"] == true {
                assert!(keeps && number(&row["end_point_clipped"]["distance_m"]) < 1e-3, "{name}: {row}");
                assert!(number(&row["time_s"]) > number(&curve["toppra_s"]), "{name}");
                assert!(number(&row["over_optimum_percent"]) > -0.02, "{name}: no faster than the optimum");
            }
        }
        let row = |name: &str| rows.iter().find(|r| r["name"] == name).expect("a row");
        for law in ["optimal", "auto"] {
            assert!(number(&row(law)["over_optimum_percent"]) <= 0.5, "{id}: {}", row(law));
        }
        let missed = |name: &str| ["end_point", "end_point_clipped"].map(|key| row(name)[key]["missed"] == true);
        if curve["paper"].is_null() {
            for law in ["eq5", "eq5_to_the_letter"] {
                let reason = row(law)["refused"].as_str().expect("a reason");
                assert!(reason.contains("half the track (0.2000 m)"), "{reason}");
            }
            continue;
        }
        assert_eq!(missed("uncompensated"), [false, true], "{id}");
        assert_eq!(missed("eq5_to_the_letter"), [false, false], "{id}");
        assert_eq!(row("eq5_to_the_letter")["limits_hold"], false, "{id}: Eq. 5 guards speed alone");
    }
}

#[test]
fn curves_are_printed_with_the_reasons_of_laws_that_refuse_and_drawn() {
    let folder = tempfile::tempdir().expect("a folder");
    let run = |plots: &str| {
        let output = eval(&["--suite", "curves", "--plot", plots], folder.path());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        text(&output.stdout)
    };
    let table = run("p");
    for expected in [
        "paper, without Eq. 5 (Fig. 2, 4)",
        "compiled, auto (optimal)",
        "refused: time law `printed` needs a given path of one cubic",
        "refused: time law `eq5` leaves",
        "picture: p/hairpin_20mm.svg",
    ] {
        assert!(table.contains(expected), "{expected} in {table}");
    }
    assert!(!table.contains("NaN"), "{table}");
    // Each table says how its curve is driven without and with compensation, in rows as wide as its head.
    let rows = |start: &str| table.lines().filter(|l| l.trim_start().starts_with(start)).count();
    assert_eq!([rows("uncompensated  "), rows("compiled, optimal"), rows("limit  ")], [5, 5, 5]);
    let read = |name: &str| std::fs::read_to_string(folder.path().join(name)).unwrap_or_else(|e| panic!("{name}: {e}"));
    for (curve, traces) in [("c_curve", 2), ("hairpin_100mm", 1)] {
        let file = read(&format!("p/{curve}.svg"));
        let tree = roxmltree::Document::parse(&file).expect("well-formed");
        let texts: Vec<&str> = tree.descendants().filter(|n| n.has_tag_name("text")).filter_map(|n| n.text()).collect();
        assert_eq!(texts.iter().filter(|t| t.ends_with("Eq. 5, wheels clipped")).count(), traces, "{curve}");
        let laws = texts.iter().filter(|t| t.starts_with("compiled, ") && t.ends_with(" s")).count();
        assert_eq!(laws, if traces == 2 { 6 } else { 5 }, "{curve}: a chart for each law that does not refuse");
    }
    let first = read("p/s_curve.svg");
    run("again");
    assert!(first == read("again/s_curve.svg"), "the same bytes");
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
        (&["--suite", "curves", "--count", "3"], "`--count` has no meaning there"),
        (&["--suite", "curves", "--robot", ROBOT, "--profile"], "leave `--profile` out"),
        (&["--suite", "curves", "--plot", "good.json"], "cannot make folder `good.json`"),
        (&["--suite", "fig6", "--plot", "good.json"], "cannot make folder `good.json`"),
        (&["--suite", "table3", "--boxes", "0"], "from 1 to 60"),
        (&["--suite", "table3", "--count", "0"], "from 1 to 10000000"),
        (&["--suite", "table3", "--count", "5001"], "`--count` is above 5000"),
        (&["--suite", "table3", "--scene", "1"], "`--scene` is for the suite `trust`"),
        (&["--suite", "trust", "--boxes", "10"], "`--boxes` has no meaning there"),
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
