//! `robot init`, and robots whose links meet.

use serde_json::Value;

use super::sandbox::Sandbox;

#[test]
fn a_robot_yaml_that_was_begun_is_inspected_and_driven_without_an_edit() {
    let sandbox = Sandbox::new();
    let printed = sandbox.run(&["robot", "init", "robots/tracer/tracer.urdf"]).expect(0).stdout;
    assert!(printed.contains("urdf: tracer.urdf\n") && printed.contains("castors"), "{printed}");

    let run = sandbox.run(&["robot", "init", "robots/tracer/tracer.urdf", "--out", "missions/mine.yaml"]).expect(0);
    assert!(run.stdout.starts_with("missions/mine.yaml: written."), "{}", run.stdout);
    let written = sandbox.text("missions/mine.yaml");
    assert_eq!(written, printed.replace("urdf: tracer.urdf", "urdf: ../robots/tracer/tracer.urdf"));
    let inspected = sandbox.run(&["inspect", "missions/mine.yaml"]).expect(0).stdout;
    assert!(inspected.contains("easily missed\n") && inspected.contains("tracer.urdf:68: castors"), "{inspected}");
    sandbox.edit("missions/a.yaml", "../robots/box_base/robot.yaml", "mine.yaml");
    sandbox.run(&["compile", "missions/a.yaml"]).expect(0);
    sandbox.run(&["check", "out/a/commands.csv"]).expect(0);

    // What is there may have been edited.
    sandbox.edit("missions/mine.yaml", "wheel_radius_m: 0.0604", "wheel_radius_m: 0.06");
    let again = ["robot", "init", "robots/tracer/tracer.urdf", "--out", "missions/mine.yaml"];
    let refused = sandbox.run(&again).expect(2);
    assert!(refused.stderr.contains("`missions/mine.yaml` exists already") && refused.stderr.contains("--force"));
    assert!(sandbox.text("missions/mine.yaml").contains("wheel_radius_m: 0.06 "));
    sandbox.run(&[&again[..], &["--force"]].concat()).expect(0);
    assert_eq!(sandbox.text("missions/mine.yaml"), written);
}

#[test]
fn a_robot_without_wheels_that_are_found_is_begun_by_their_names() {
    let sandbox = Sandbox::new();
    let limo = sandbox.text("robots/limo/limo.urdf");
    sandbox.write(
        "one.urdf",
        limo.replacen(
            r#"<joint name="rear_left_wheel" type="continuous">"#,
            r#"<joint name="rear_left_wheel" type="fixed">"#,
            1,
        ),
    );
    sandbox.write(
        "odd.urdf",
        limo.replace(r#"xyz="-0.1 0.065 -0.1""#, r#"xyz="-0.11 0.065 -0.1""#)
            .replace(r#"xyz="0.1 0.065 -0.1""#, r#"xyz="0.12 0.065 -0.1""#),
    );
    assert!(sandbox.run(&["robot", "init", "one.urdf"]).expect(0).stdout.contains("left: front_left_wheel\n"));
    let asked = sandbox.run(&["robot", "init", "odd.urdf"]).expect(2);
    assert!(
        asked.stderr.contains("0 coaxial pairs") && asked.stderr.contains("`rear_left_wheel` at (-0.110"),
        "{}",
        asked.stderr
    );
    let unknown =
        sandbox.run(&["robot", "init", "one.urdf", "--left", "front_left", "--right", "front_right_wheel"]).expect(2);
    assert!(unknown.stderr.contains("did you mean `front_left_wheel`?"), "{}", unknown.stderr);
}

#[test]
fn a_xacro_file_is_told_how_to_be_expanded_wherever_it_is_named() {
    let sandbox = Sandbox::new();
    let text = r#"<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro"><xacro:include filename="wheel.xacro"/></robot>"#;
    sandbox.write("robots/r.urdf.xacro", text);
    sandbox.edit("missions/a.yaml", "../robots/box_base/robot.yaml", "../robots/r.urdf.xacro");
    for args in [["inspect", "robots/r.urdf.xacro"], ["compile", "missions/a.yaml"]] {
        let run = sandbox.run(&args).expect(2);
        assert!(run.stderr.contains("robot/xacro") && run.stderr.contains("> robots/r.urdf`"), "{}", run.stderr);
    }
    let run = sandbox.run(&["robot", "init", "robots/r.urdf.xacro"]).expect(2);
    assert!(run.stderr.contains("`xacro robots/r.urdf.xacro > robots/r.urdf`"), "{}", run.stderr);
}

/// Stretch on a given path, its lift at a height.
fn drive(lift: f64) -> String {
    format!(
        "robot: ../robots/stretch/robot.yaml\npath: {{bezier: [[[0, 0], [0.5, 0], [1, 0.2], [1.5, 0.2]]]}}\n\
         start: {{joints: {{joint_lift: {lift}}}}}\n"
    )
}

#[test]
fn links_that_touch_each_other_are_refused_by_name_time_and_posture() {
    let sandbox = Sandbox::new();
    sandbox.write("missions/low.yaml", drive(0.0));
    let run = sandbox.run(&["compile", "missions/low.yaml"]).expect(1);
    for part in [
        "touch each other at t = 0.000 s, with `joint_lift` 0.0000 m",
        "`base_link`",
        "ignore_pairs",
        "trajc robot init",
    ] {
        assert!(run.stderr.replace('\n', " ").contains(part), "{part} in {}", run.stderr);
    }
    assert!(!sandbox.exists("out/low/commands.csv"));
    let report: Value = serde_json::from_slice(&sandbox.read("out/low/report.json")).expect("JSON");
    assert_eq!(report["failure"]["code"], "certify/refused");
    assert_eq!(report["certificate"]["own_links"]["keep_apart"], false);

    sandbox.write("missions/high.yaml", drive(0.5));
    let run = sandbox.run(&["compile", "missions/high.yaml"]).expect(0);
    assert!(run.stdout.contains("kept apart"), "{}", run.stdout);
    let report: Value = serde_json::from_slice(&sandbox.read("out/high/report.json")).expect("JSON");
    assert_eq!(report["certificate"]["own_links"]["keep_apart"], true);
    let ignored = report["robot"]["ignored_pairs"].as_array().expect("a list");
    for (links, reason) in [(["link_arm_l4", "link_arm_l2"], "named"), (["link_arm_l4", "link_arm_l3"], "joined")] {
        assert!(ignored.contains(&serde_json::json!({"links": links, "reason": reason})), "{ignored:?}");
    }
    let checked = sandbox.run(&["check", "out/high/commands.csv"]).expect(0);
    assert!(checked.stdout.contains("pairs kept apart"), "{}", checked.stdout);

    // The same commands, but two of the arm's tubes must not touch.
    sandbox.edit("robots/stretch/robot.yaml", "    - [link_arm_l4, link_arm_l2]\n", "");
    let refused = sandbox.run(&["check", "out/high/commands.csv"]).expect(1);
    assert!(
        refused.stdout.contains("not kept apart") && refused.stdout.contains("`link_arm_l4` and `link_arm_l2`"),
        "{}",
        refused.stdout
    );
}
