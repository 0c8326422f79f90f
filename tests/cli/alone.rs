//! `commands.mcap` verifies with nothing beside it but the map.

use trajc::emit::mcap::{self, McapInputs, attached};
use trajc::emit::mcap_read;
use trajc::robot::{self, NoFiles, RobotInputs, spec};

use super::sandbox::{Sandbox, golden};

/// A sandbox with nothing in it but `here/commands.mcap` of another, and its folder of maps as `here/`.
fn only_the_file(from: &Sandbox, map: Option<&str>) -> Sandbox {
    let alone = Sandbox::empty();
    alone.write("here/commands.mcap", from.read("out/a/commands.mcap"));
    if let Some(map) = map {
        alone.write("here/first.csv", from.read(map));
    }
    alone
}

/// A bad file's message.
fn complaint(sandbox: &Sandbox, args: &[&str]) -> String {
    let run = sandbox.run(args).expect(2);
    assert_eq!(run.stdout, "");
    run.stderr
}

#[test]
fn a_copy_with_the_map_beside_it_is_all_that_check_needs() {
    let alone = only_the_file(&Sandbox::compiled(), Some("maps/first.csv"));
    let run = alone.run(&["check", "here/commands.mcap"]).expect(0);
    assert!(run.stdout.contains("all checks hold") && !run.stdout.contains("note"), "{}", run.stdout);
    assert!(
        run.stdout.contains("against     the mission and robot that it brings, map here/first.csv\n"),
        "{}",
        run.stdout
    );
    alone.run_in("here", &["check", "commands.mcap"]).expect(0);
    alone.run(&["path-error", "here/commands.mcap", "--sampling-times", "0.1"]).expect(0);
}

#[test]
fn a_map_elsewhere_is_found_when_it_is_said_where() {
    let alone = only_the_file(&Sandbox::compiled(), Some("maps/first.csv"));
    std::fs::rename(alone.path("here/first.csv"), alone.path("floor.csv")).expect("rename");
    golden("alone_map_missing", &complaint(&alone, &["check", "here/commands.mcap"]));
    alone.run(&["check", "here/commands.mcap", "--map", "floor.csv"]).expect(0);
    golden("alone_map_not_there", &complaint(&alone, &["check", "here/commands.mcap", "--map", "flor.csv"]));
}

#[test]
fn a_csv_file_and_a_mission_of_ones_own_take_another_map_as_it_is() {
    let sandbox = Sandbox::compiled();
    std::fs::rename(sandbox.path("maps/first.csv"), sandbox.path("floor.csv")).expect("rename");
    let args = |file: &'static str| ["check", file, "--mission", "missions/a.yaml", "--map", "floor.csv"];
    for file in ["out/a/commands.csv", "out/a/commands.mcap"] {
        sandbox.run(&["check", file]).expect(2);
        let run = sandbox.run(&args(file)).expect(0);
        assert!(!run.stdout.contains("note"), "the same bytes: {}", run.stdout);
    }
    sandbox.write("floor.csv", sandbox.text("floor.csv") + "0.125,0.125,0.000\n");
    for file in ["out/a/commands.csv", "out/a/commands.mcap"] {
        assert!(sandbox.run(&args(file)).expect(0).stdout.contains("  note  "));
    }
    sandbox.run(&["check", "out/a/commands.csv", "--map", "floor.csv"]).expect(0);
}

#[test]
fn another_map_is_not_taken_for_the_one_planned_on() {
    let alone = only_the_file(&Sandbox::compiled(), Some("maps/first.csv"));
    alone.write("here/first.csv", alone.text("here/first.csv") + "0.125,0.125,0.000\n");
    golden("alone_map_differs", &complaint(&alone, &["check", "here/commands.mcap"]));
    complaint(&alone, &["check", "here/commands.mcap", "--map", "here/first.csv"]);
}

#[test]
fn the_attached_mission_counts_and_not_the_one_on_the_disk() {
    let sandbox = Sandbox::compiled();
    sandbox.edit("missions/a.yaml", "clearance_m: 0.05", "clearance_m: 0.2");
    sandbox.run(&["check", "out/a/commands.mcap"]).expect(0);
    sandbox.run(&["check", "out/a/commands.csv"]).expect(1);
    sandbox.run(&["check", "out/a/commands.mcap", "--mission", "missions/a.yaml"]).expect(1);
}

#[test]
fn meshes_urdf_alone_and_a_given_path_come_along() {
    let sandbox = Sandbox::new();
    let tetrahedron = "v 0.2 0.2 0\nv -0.2 0.2 0\nv 0 -0.2 0\nv 0 0 0.2\nf 1 2 3\nf 1 2 4\nf 2 3 4\nf 1 3 4\n";
    for folder in ["robots/own/meshes", "robots/own/urdf/left"] {
        sandbox.write(&format!("{folder}/hull.obj"), tetrahedron);
    }
    let meshes = ["../meshes/hull.obj", "package://own/urdf/left/hull.obj"].map(|name| {
        format!(r#"<collision><origin xyz="0 0 0.1"/><geometry><mesh filename="{name}"/></geometry></collision>"#)
    });
    let urdf =
        sandbox.text("robots/box_base/box_base.urdf").replacen("<collision>", &(meshes.concat() + "<collision>"), 1);
    let wheel = r#"<collision><geometry><sphere radius="0.08"/></geometry></collision>"#;
    let urdf = ["left", "right"].iter().fold(urdf, |urdf, side| {
        urdf.replace(
            &format!(r#"<link name="{side}_wheel"/>"#),
            &format!(r#"<link name="{side}_wheel">{wheel}</link>"#),
        )
    });
    sandbox.write("robots/own/urdf/own.urdf", urdf);
    sandbox.write("missions/way.csv", "x_m,y_m\n1,1\n2,1.1\n3,1\n");
    sandbox.write("missions/a.yaml", "robot: ../robots/own/urdf/own.urdf\npath: {file: way.csv}\n");
    sandbox.run(&["compile", "missions/a.yaml"]).expect(0);
    let alone = only_the_file(&sandbox, None);
    let run = alone.run(&["check", "here/commands.mcap"]).expect(0);
    assert!(run.stdout.contains("no map: not checked"), "{}", run.stdout);
    let text = alone.run(&["inspect", "here/commands.mcap"]).expect(0).stdout;
    for name in ["path.csv", "meshes/left/hull.obj", "meshes/../meshes/hull.obj"] {
        assert!(text.contains(name), "{name}: {text}");
    }
}

/// The texts that are attached.
struct Texts {
    mission: String,
    robot_yaml: Option<String>,
    urdf: String,
    report: String,
}

/// The file with other attachments, everything else as it was.
fn rewritten(bytes: &[u8], change: impl Fn(&mut Texts)) -> Vec<u8> {
    let file = mcap_read::read("a.mcap", bytes).expect("a command file");
    let text = |name: &str| String::from_utf8(file.attachment(name).expect(name).to_vec()).expect("text");
    let [mission, robot_yaml, urdf, report] =
        [attached::MISSION, attached::ROBOT, attached::URDF, attached::REPORT].map(text);
    let spec = spec::parse("robot.yaml", &robot_yaml).expect("a robot.yaml");
    let urdf_file = ("robot.urdf", urdf.as_str());
    let parts = RobotInputs { spec: &spec, urdf: urdf_file, files: &mut NoFiles, overrides: &Default::default() };
    let robot = robot::parse(parts).expect("a robot");
    let mut texts = Texts { mission, robot_yaml: Some(robot_yaml), urdf, report };
    change(&mut texts);
    let inputs = McapInputs {
        table: &file.table,
        header: &file.header,
        robot: &robot,
        mission: &texts.mission,
        robot_yaml: texts.robot_yaml.as_deref(),
        urdf: &texts.urdf,
        report: &texts.report,
        path_csv: None,
        start_file: None,
        meshes: &[],
    };
    mcap::write(&inputs).expect("a command file")
}

#[test]
fn attachments_that_the_commands_were_not_made_from_are_refused() {
    let sandbox = Sandbox::compiled();
    let bytes = sandbox.read("out/a/commands.mcap");
    let changed = |change: &dyn Fn(&mut Texts)| {
        sandbox.write("out/a/commands.mcap", rewritten(&bytes, change));
        complaint(&sandbox, &["check", "out/a/commands.mcap"])
    };
    sandbox.write("out/a/commands.mcap", rewritten(&bytes, |_| {}));
    sandbox.run(&["check", "out/a/commands.mcap"]).expect(0);

    let faster = |texts: &mut Texts| {
        texts.robot_yaml = texts.robot_yaml.as_ref().map(|text| text.replace("speed_mps: 0.5", "speed_mps: 0.9"));
    };
    golden("alone_robot_differs", &changed(&faster));
    let text = changed(&|texts| texts.mission = texts.mission.replace("clearance_m: 0.05", "clearance_m: 0.01"));
    assert!(text.contains("the attached `mission.yaml` is not what the commands were made from"), "{text}");
    let text = changed(&|texts| texts.urdf = texts.urdf.replace("0.40 0.40", "0.10 0.10"));
    assert!(text.contains("the attached `robot.urdf` is not"), "{text}");
    golden("alone_report_garbage", &changed(&|texts| texts.report = "{}".into()));
    golden("alone_robot_not_attached", &changed(&|texts| texts.robot_yaml = None));
    // With a mission of one's own what is attached does not count.
    sandbox.run(&["check", "out/a/commands.mcap", "--mission", "missions/a.yaml"]).expect(0);
}
