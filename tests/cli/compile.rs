//! `compile` on the missions that are shipped, and what it leaves.

use serde_json::Value;

use super::sandbox::{Sandbox, golden, repository};

const MISSIONS: [&str; 7] = ["first", "c_curve", "s_curve", "arbitrary", "barn_29", "depot", "levine"];
const FILES: [&str; 7] =
    ["commands.csv", "commands.d", "commands.mcap", "path_error.csv", "report.html", "report.json", "timings.json"];

fn mission(name: &str) -> String {
    repository().join(format!("missions/{name}.yaml")).display().to_string()
}

/// Compiles a shipped mission into the sandbox and checks every promise about the folder.
fn compiles(name: &str) {
    let sandbox = Sandbox::new();
    let run = sandbox.run(&["compile", &mission(name)]).expect(0);
    assert_eq!(run.stderr, "");
    assert!(run.stdout.starts_with(&format!("{name}: CERTIFIED\n")), "{}", run.stdout);
    assert!(run.stdout.contains(&format!("Next: trajc check out/{name}/commands.csv")), "{}", run.stdout);
    let folder = format!("out/{name}");
    for file in FILES {
        assert!(sandbox.exists(&format!("{folder}/{file}")), "{file}");
    }
    for name in sandbox.list(&folder) {
        assert!(FILES.contains(&name.as_str()), "{name}");
    }
    assert_eq!(sandbox.list("out"), [name], "nothing is left beside");
    let report: Value = serde_json::from_slice(&sandbox.read(&format!("{folder}/report.json"))).expect("JSON");
    assert_eq!(report["status"], "certified");

    for file in ["commands.csv", "commands.mcap"] {
        let run = sandbox.run(&["check", &format!("{folder}/{file}")]).expect(0);
        assert!(run.stdout.contains("all checks hold") && !run.stdout.contains("note"), "{}", run.stdout);
        assert_eq!(run.stderr, "");
    }
    let first = snapshot(&sandbox, &folder);
    sandbox.run(&["compile", &mission(name)]).expect(0);
    assert!(first == snapshot(&sandbox, &folder), "{name}: the second run wrote other bytes");
}

/// All files but the one that tells times.
fn snapshot(sandbox: &Sandbox, folder: &str) -> Vec<(String, Vec<u8>)> {
    let names = sandbox.list(folder).into_iter().filter(|n| n != "timings.json");
    names.map(|name| (name.clone(), sandbox.read(&format!("{folder}/{name}")))).collect()
}

#[test]
fn the_missions_that_are_shipped_compile_twice_to_the_same_bytes_and_pass_their_own_check() {
    MISSIONS.iter().for_each(|name| compiles(name));
}

#[test]
fn real_robots_compile_their_missions() {
    ["tracer", "limo", "turtlebot3_burger", "turtlebot3_waffle_pi", "tiago"].iter().for_each(|name| compiles(name));
}

#[test]
fn a_lift_an_arm_and_a_wrist_pass_a_gap_and_reach_into_a_shelf() {
    compiles("stretch");
}

#[test]
fn a_robot_that_changes_shape_crosses_the_arch_bridges() {
    compiles("arch_bridges");
}

#[test]
fn motions_of_heading_and_arc_length_are_certified_and_say_so() {
    for name in ["first", "arch_bridges"] {
        let sandbox = Sandbox::new();
        sandbox.ship("maps");
        sandbox.ship(&format!("missions/{name}.yaml"));
        let mission = sandbox.text(&format!("missions/{name}.yaml"));
        sandbox.write("missions/b.yaml", mission + "parameterisation: arc_length\n");
        sandbox.run(&["compile", "missions/b.yaml"]).expect(0);
        let report: Value = serde_json::from_slice(&sandbox.read("out/b/report.json")).expect("JSON");
        assert_eq!([&report["status"], &report["trajectory"]["source"]], ["certified", "optimised"], "{name}");
        assert_eq!(report["trajectory"]["parameterisation"], "arc_length");
        for file in ["commands.csv", "commands.mcap"] {
            sandbox.run(&["check", &format!("out/b/{file}")]).expect(0);
        }
        let first = snapshot(&sandbox, "out/b");
        sandbox.run(&["compile", "missions/b.yaml"]).expect(0);
        assert!(first == snapshot(&sandbox, "out/b"), "{name}: the second run wrote other bytes");
    }
}

#[test]
fn where_the_program_stands_and_where_it_writes_change_no_motion() {
    let sandbox = Sandbox::compiled();
    let body = |path: &str| {
        let text = sandbox.text(path);
        text.lines().filter(|l| !l.starts_with("# mission:")).map(|l| format!("{l}\n")).collect::<String>()
    };
    sandbox.run_in("robots", &["compile", "../missions/a.yaml", "--out", "deep/er/out"]).expect(0);
    assert_eq!(body("out/a/commands.csv"), body("robots/deep/er/out/a/commands.csv"));
    let own = sandbox.text("robots/deep/er/out/a/commands.csv");
    assert!(own.contains("# mission: ../../../../../missions/a.yaml\n"), "{own}");
    let absolute = sandbox.path("missions/a.yaml").display().to_string();
    let out = sandbox.path("else where/ö").display().to_string();
    let run = sandbox.run(&["compile", &absolute, "--out", &out]).expect(0);
    assert!(run.stdout.contains("<here>/else where/ö/a/"), "{}", run.stdout);
    assert_eq!(body("out/a/commands.csv"), body("else where/ö/a/commands.csv"));
    for out in ["robots/deep/er/out", "else where/ö"] {
        for file in ["commands.csv", "commands.mcap"] {
            sandbox.run_in("maps", &["check", &format!("../{out}/a/{file}")]).expect(0);
        }
    }
}

#[test]
fn options_of_the_command_line_win_over_the_mission() {
    let sandbox = Sandbox::new();
    sandbox.run(&["compile", "missions/a.yaml", "--sampling-time", "0.05", "--format", "csv"]).expect(0);
    let csv = sandbox.text("out/a/commands.csv");
    assert!(csv.contains("# sampling_time_s: 0.05\n"), "{csv}");
    assert!(!sandbox.exists("out/a/commands.mcap"));
    sandbox.run(&["check", "out/a/commands.csv"]).expect(0);

    sandbox.run(&["compile", "missions/a.yaml", "--format", "mcap"]).expect(0);
    assert!(sandbox.exists("out/a/commands.mcap") && !sandbox.exists("out/a/commands.csv"), "older files go");
    let depfile = sandbox.text("out/a/commands.d");
    assert!(depfile.starts_with("out/a/commands.mcap:"), "{depfile}");
    sandbox.run(&["check", "out/a/commands.mcap"]).expect(0);
}

#[test]
fn trajectory_json_holds_the_rows_of_the_csv_file_and_nothing_else() {
    let sandbox = Sandbox::new();
    let run = sandbox.run(&["compile", "missions/a.yaml", "--format", "csv,mcap,trajectory.json"]).expect(0);
    assert!(run.stdout.contains("commands.csv commands.mcap trajectory.json"), "{}", run.stdout);
    let rows: Vec<serde_json::Map<String, Value>> =
        serde_json::from_slice(&sandbox.read("out/a/trajectory.json")).expect("an array of objects");
    let csv = sandbox.text("out/a/commands.csv");
    let mut lines = csv.lines().filter(|line| !line.starts_with('#'));
    let columns: Vec<&str> = lines.next().expect("columns").split(',').collect();
    let lines: Vec<&str> = lines.collect();
    assert_eq!(rows.len(), lines.len());
    for (row, line) in rows.iter().zip(lines) {
        assert!(row.keys().eq(&columns));
        // Equal but for the last digit, which serde_json does not always read as it is written.
        let same = |(a, b): (&Value, &str)| {
            let [a, b] = [a.as_f64().expect("a number"), b.parse().expect("a number")];
            (a - b).abs() <= 4.0 * f64::EPSILON * b.abs()
        };
        assert!(row.values().zip(line.split(',')).all(same), "{line}");
    }
    // Gone with the next run that does not ask for it.
    sandbox.run(&["compile", "missions/a.yaml"]).expect(0);
    assert!(!sandbox.exists("out/a/trajectory.json"));
    sandbox.run(&["compile", "missions/a.yaml", "--format", "trajectory.json"]).expect(0);
    assert!(sandbox.text("out/a/commands.d").starts_with("out/a/trajectory.json: missions/a.yaml "));
    assert!(!sandbox.exists("out/a/commands.csv"));
    sandbox.edit("missions/a.yaml", "x_m: 3.4", "x_m: 2.0");
    sandbox.run(&["compile", "missions/a.yaml", "--format", "trajectory.json"]).expect(1);
    assert_eq!(sandbox.list("out/a"), ["report.html", "report.json", "timings.json"]);
}

#[test]
fn json_on_stdout_is_the_report_and_nothing_else() {
    let sandbox = Sandbox::new();
    let run = sandbox.run(&["compile", "missions/a.yaml", "--json"]).expect(0);
    assert_eq!(run.stdout, sandbox.text("out/a/report.json"));
    let report: Value = serde_json::from_str(&run.stdout).expect("JSON");
    assert_eq!(report["schema"], "trajc.report/1");
    assert_eq!(report["certificate"]["limits_hold"], true);

    let check = sandbox.run(&["check", "out/a/commands.csv", "--json"]).expect(0);
    let verdict: Value = serde_json::from_str(&check.stdout).expect("JSON");
    assert_eq!(verdict["holds"], true);
    assert_eq!(verdict["certificate"], report["certificate"], "check proves what compile proved");
    assert_eq!(verdict["limits"], report["limits"]);
}

#[test]
fn the_depfile_names_every_input() {
    let sandbox = Sandbox::compiled();
    let depfile = sandbox.text("out/a/commands.d");
    for input in ["missions/a.yaml", "robots/box_base/robot.yaml", "robots/box_base/box_base.urdf", "maps/first.csv"] {
        assert!(depfile.contains(input), "{input}:\n{depfile}");
    }
}

#[test]
fn files_of_others_in_the_output_folder_stay() {
    let sandbox = Sandbox::compiled();
    sandbox.write("out/a/notes.txt", "mine");
    sandbox.run(&["compile", "missions/a.yaml"]).expect(0);
    assert_eq!(sandbox.text("out/a/notes.txt"), "mine");
    sandbox.edit("missions/a.yaml", "x_m: 3.4", "x_m: 34");
    sandbox.run(&["compile", "missions/a.yaml"]).expect(1);
    assert_eq!(sandbox.list("out/a"), ["notes.txt", "report.html", "report.json", "timings.json"]);
}

#[test]
fn the_report_to_look_at_is_a_page_a_picture_or_none() {
    let sandbox = Sandbox::new();
    for (kind, written, gone) in [("svg", "report.svg", "report.html"), ("html", "report.html", "report.svg")] {
        for (goal, code) in [("x_m: 3.4", 0), ("x_m: 2.0", 1)] {
            sandbox.edit("missions/a.yaml", "goal: {x_m: 3.4", &format!("goal: {{{goal}"));
            sandbox.run(&["compile", "missions/a.yaml", "--report", kind]).expect(code);
            assert!(sandbox.exists(&format!("out/a/{written}")) && !sandbox.exists(&format!("out/a/{gone}")), "{kind}");
            sandbox.edit("missions/a.yaml", &format!("goal: {{{goal}"), "goal: {x_m: 3.4");
        }
    }
    sandbox.run(&["compile", "missions/a.yaml", "--report", "none"]).expect(0);
    assert!(sandbox.exists("out/a/report.json"));
    assert!(!sandbox.exists("out/a/report.html") && !sandbox.exists("out/a/report.svg"), "the older ones go");
}

#[test]
fn a_mission_need_not_name_what_has_a_default() {
    let sandbox = Sandbox::new();
    let text = "robot: ../robots/box_base/robot.yaml\nmap: {file: ../maps/first.csv}\n\
                start: {x_m: 0.6, y_m: 1.5, yaw: 0}\ngoal: {x_m: 3.4, y_m: 1.5}\n";
    sandbox.write("missions/short.yaml", text);
    sandbox.run(&["compile", "missions/short.yaml"]).expect(0);
    sandbox.run(&["check", "out/short/commands.csv"]).expect(0);
}

#[test]
fn path_error_of_a_mission_and_of_its_command_file_agree() {
    let sandbox = Sandbox::new();
    let times = ["--sampling-times", "0.01,0.1,0.5"];
    let run = sandbox.run(&[&["path-error", &mission("c_curve"), "--json"], &times[..]].concat()).expect(0);
    let rows: Value = serde_json::from_str(&run.stdout).expect("JSON");
    let rows = rows["path_error"].as_array().expect("rows").clone();
    let lateral = |row: &Value| row["lateral_max_m"].as_f64().expect("number");
    assert_eq!(rows.len(), 3);
    assert!(lateral(&rows[0]) < lateral(&rows[1]) && lateral(&rows[1]) < lateral(&rows[2]), "{rows:?}");

    sandbox.run(&["compile", &mission("c_curve")]).expect(0);
    for file in ["commands.csv", "commands.mcap"] {
        let run = sandbox.run(&["path-error", &format!("out/c_curve/{file}"), "--json"]).expect(0);
        let own: Value = serde_json::from_str(&run.stdout).expect("JSON");
        let own = lateral(&own["path_error"][0]);
        assert!((own - lateral(&rows[1])).abs() < 1e-6, "{own} {rows:?}");
    }
    let csv = sandbox.run(&["path-error", "out/c_curve/commands.csv", "--csv"]).expect(0).stdout;
    assert!(csv.starts_with("sampling_time_s,sampling,lateral_max_m"), "{csv}");
    let table = sandbox.run(&["path-error", "missions/a.yaml", "--sampling-times", "0.1,0.2"]).expect(0).stdout;
    assert_eq!(table.lines().count(), 3, "{table}");
}

#[test]
fn path_errors_of_all_samplings_are_told_drawn_and_turned_around() {
    let sandbox = Sandbox::new();
    let asked = ["--sampling-times", "0.1,0.2", "--sampling", "instant,mean,tracked", "--plot", "error.svg"];
    let run = |more: &[&str]| {
        let mission = mission("c_curve");
        sandbox.run(&[&["path-error", mission.as_str()], &asked[..], more].concat()).expect(0).stdout
    };
    golden("path_error_of_all_samplings", &run(&[]));
    let svg = String::from_utf8(sandbox.read("error.svg")).expect("text");
    for text in ["instant", "mean", "tracked", "sampling time s", "error mm"] {
        assert!(svg.contains(text), "{text}");
    }
    let answers = run(&["--max-error", "5mm"]);
    let answers: Vec<&str> = answers.lines().skip(7).collect();
    assert_eq!(answers.len(), 3, "{answers:?}");
    let answers = run(&["--max-error", "0.02mm", "--csv"]);
    assert_eq!(answers.lines().filter(|line| line.starts_with("# within 20.000 um")).count(), 3, "{answers}");
    let json: Value = serde_json::from_str(&run(&["--max-error", "0.02mm", "--json"])).expect("JSON");
    let largest: Vec<f64> = (0..3).map(|k| json["max_error"][k]["sampling_time_s"].as_f64().expect("a time")).collect();
    assert!(largest[1] < largest[0] && largest[0] < largest[2], "{largest:?}");
    for answer in json["max_error"].as_array().expect("answers") {
        assert!(answer["at"]["lateral_max_m"].as_f64() <= Some(2e-5), "{answer}");
    }
}

#[test]
fn schemas_and_completions_are_printed() {
    let sandbox = Sandbox::new();
    for file in ["mission", "robot", "report"] {
        let schema: Value = serde_json::from_str(&sandbox.run(&["schema", file]).expect(0).stdout).expect("JSON");
        assert!(schema["properties"].is_object(), "{file}");
    }
    let script = sandbox.run(&["completions", "bash"]).expect(0).stdout;
    assert!(script.contains("trajc") && script.contains("path-error"), "{script}");
    let help = sandbox.run(&["--help"]).expect(0).stdout;
    for command in ["compile", "check", "path-error", "inspect", "schema", "completions"] {
        assert!(help.contains(command), "{help}");
    }
}
