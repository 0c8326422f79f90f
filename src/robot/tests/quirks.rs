//! What published URDFs are like: each quirk in the smallest URDF that shows it.

use super::*;
use crate::robot::{Finding, parse_with_findings};

fn findings_with(urdf: &str, spec: &RobotSpec) -> Vec<Finding> {
    let inputs = RobotInputs {
        spec,
        urdf: ("a/b/r.urdf", urdf),
        files: &mut Memory::default(),
        overrides: &LimitsSpec::default(),
    };
    parse_with_findings(inputs).expect("a robot").1
}

fn findings(urdf: &str) -> Vec<Finding> {
    findings_with(urdf, &RobotSpec::default())
}

fn codes(found: &[Finding]) -> Vec<&str> {
    found.iter().map(|f| f.code).collect()
}

/// A joint of a kind between two links, the child without shape.
fn joint(name: &str, kind: &str, parent: &str, child: &str, more: &str) -> String {
    format!(
        r#"<link name="{child}"/><joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{more}</joint>"#
    )
}

#[test]
fn a_plain_robot_has_nothing_that_is_easily_missed() {
    assert_eq!(findings(&with_wheels("")), []);
}

#[test]
fn a_wheel_turned_by_half_a_turn_drives_forward_like_the_other() {
    let turned =
        with_wheels("").replacen(r#"<origin xyz="0 -0.2 0.1"/>"#, r#"<origin rpy="3.14159 0 0" xyz="0 -0.2 0.1"/>"#, 1);
    let robot = read(&turned, &RobotSpec::default()).unwrap();
    let plain = read(&with_wheels(""), &RobotSpec::default()).unwrap();
    assert_eq!((robot.track_width, robot.base_from_root), (plain.track_width, plain.base_from_root));
    let found = findings(&turned);
    assert_eq!(codes(&found), ["turned-wheel"]);
    assert!(found[0].message.contains("`right`") && found[0].message.contains("drives forward"), "{}", found[0]);
}

#[test]
fn a_spring_that_carries_a_wheel_is_found_and_how_to_hold_it_is_said() {
    let spring = r#"<axis xyz="0 0 1"/><limit lower="-0.005" upper="0.005" effort="1" velocity="1"/>"#;
    let urdf = with_wheels(&joint("spring", "prismatic", "base", "arm", spring)).replacen(
        r#"<parent link="base"/><child link="left_link"/>"#,
        r#"<parent link="arm"/><child link="left_link"/>"#,
        1,
    );
    let found = findings(&urdf);
    assert_eq!(codes(&found), ["suspension"]);
    assert!(found[0].message.contains("`joints: {fixed: {spring: 0}}`"), "{}", found[0]);
    assert!(found[0].to_string().starts_with("a/b/r.urdf:8: "), "{}", found[0]);
    let held = RobotSpec { moving: Some(Vec::new()), ..RobotSpec::default() };
    assert!(findings_with(&urdf, &held)[0].message.ends_with("it is held"));
}

#[test]
fn castors_are_no_driving_wheels_however_their_names_read() {
    let level = r#"<origin xyz="-0.1 0.2 0.05"/><axis xyz="0 1 0"/>"#;
    let castor = joint("rear_wheel_drive", "continuous", "base", "fork", r#"<axis xyz="0 0 1"/>"#)
        + &joint("rear_wheel", "continuous", "fork", "roll", level);
    let urdf = with_wheels(&castor);
    assert_eq!(read(&urdf, &RobotSpec::default()).unwrap().joint_count(), 0);
    let found = findings(&urdf);
    assert_eq!(codes(&found), ["castors"]);
    assert!(found[0].message.contains("`rear_wheel_drive`, `rear_wheel`"), "{}", found[0]);
}

#[test]
fn four_driven_wheels_are_asked_for_with_the_line_to_write() {
    let rear = wheel("rear_left", "-0.4 0.2 0.1", 0.1) + &wheel("rear_right", "-0.4 -0.2 0.1", 0.1);
    let urdf = with_wheels(&rear);
    let asked = fault(&urdf, &RobotSpec::default());
    let line = "{left: [left, rear_left], right: [right, rear_right]}";
    assert!(asked.hint.as_ref().unwrap().contains(&format!("`drive: {line}`")), "{asked:?}");
    assert!(
        asked.message.contains("2 coaxial pairs") && asked.message.contains("`rear_left` at (-0.400, 0.200, 0.100)")
    );
    let at = asked.at.unwrap();
    assert_eq!(&at.source.text[at.range], r#"name="left""#);

    let spec =
        crate::robot::spec::parse("r.yaml", &format!("urdf: r.urdf\ndrive: {line}\n")).expect("the line as told");
    let found = findings_with(&urdf, &spec);
    assert!(codes(&found).contains(&"skid-steer") && found[0].message.contains("measure"), "{found:?}");
}

#[test]
fn wheels_beside_a_castor_axle_are_asked_for_by_a_pair() {
    // Three on one line: no axle for each, so no guess at four driven wheels.
    let urdf = with_wheels(&wheel("third", "0 0 0.1", 0.1));
    let asked = fault(&urdf, &RobotSpec::default());
    assert!(asked.hint.as_ref().unwrap().contains("`drive: {left: left, right: right}`"), "{asked:?}");
}

#[test]
fn a_wheel_that_is_not_at_its_joint_is_told_with_the_track_between_the_wheels() {
    let urdf = with_wheels("").replace(
        r#"<origin rpy="1.5707963267948966 0 0"/>"#,
        r#"<origin rpy="1.5707963267948966 0 0" xyz="0 0.02 0"/>"#,
    );
    assert_eq!(codes(&findings(&urdf)), [""; 0], "both shifted alike: the track is the same");
    let out = with_wheels("").replacen(
        r#"<origin rpy="1.5707963267948966 0 0"/>"#,
        r#"<origin rpy="1.5707963267948966 0 0" xyz="0 0.02 0"/>"#,
        1,
    );
    let found = findings(&out);
    assert_eq!(codes(&found), ["wheel-off-joint"]);
    assert!(found[0].message.contains("0.4000 m apart") && found[0].message.contains("0.4200 m"), "{}", found[0]);
}

#[test]
fn a_root_link_above_the_floor_is_told_with_its_place_in_the_base_frame() {
    let urdf = with_wheels("").replace("0.2 0.1\"", "0.2 -0.05\"");
    let found = findings(&urdf);
    assert_eq!(codes(&found), ["root-off-floor"]);
    assert!(found[0].message.contains("(0.0000, 0.0000, 0.1500) m"), "{}", found[0]);
}

const SLIDE: &str = r#"<axis xyz="0 0 1"/><limit lower="0" upper="0.1" effort="1" velocity="0.2"/>"#;

#[test]
fn segments_of_a_telescope_without_mimic_are_found_and_how_to_join_them_is_said() {
    let turned = format!(r#"<origin rpy="1.5707963267948966 0 0"/>{SLIDE}"#);
    let arm = joint("lift", "prismatic", "base", "carriage", SLIDE)
        + &joint("arm", "fixed", "carriage", "outer", "")
        + &joint("arm_1", "prismatic", "outer", "middle", &turned)
        + &joint("flange", "fixed", "middle", "middle_end", "")
        + &joint("arm_2", "prismatic", "middle_end", "inner", SLIDE);
    let found = findings(&with_wheels(&arm));
    assert_eq!(codes(&found), ["telescope"], "the lift slides along another line");
    assert!(found[0].message.contains(r#"add <mimic joint="arm_1"/> to `arm_2`"#), "{}", found[0]);

    let joined = arm.replace(r#"<child link="inner"/>"#, r#"<child link="inner"/><mimic joint="arm_1"/>"#);
    assert_eq!(findings(&with_wheels(&joined)), []);
}

#[test]
fn a_xacro_file_is_told_from_a_urdf_with_the_command_that_expands_it() {
    let text = r#"<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:include filename="$(find pkg)/wheel.xacro"/>
  <xacro:wheel side="left"/>
</robot>"#;
    for (name, command) in [
        ("d/robot.urdf.xacro", "`xacro d/robot.urdf.xacro > d/robot.urdf`"),
        ("robot.xacro", "`xacro robot.xacro > robot.urdf`"),
        ("robot.urdf", "`xacro robot.urdf > robot.expanded.urdf`"),
    ] {
        let inputs = RobotInputs {
            spec: &RobotSpec::default(),
            urdf: (name, text),
            files: &mut Memory::default(),
            overrides: &LimitsSpec::default(),
        };
        let fault = parse(inputs).expect_err("xacro").0.remove(0);
        assert_eq!(fault.code, "robot/xacro");
        assert!(fault.message.contains("2 elements") && fault.message.contains("<xacro:include>"), "{}", fault.message);
        assert!(fault.hint.unwrap().contains(command));
        let at = fault.at.unwrap();
        assert_eq!(&text[at.range], "<xacro:include");
    }
    // What xacro leaves behind is no fault.
    let expanded = with_wheels("")
        .replace(r#"<robot name="r">"#, r#"<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">"#);
    assert!(read(&expanded, &RobotSpec::default()).is_ok());
}
