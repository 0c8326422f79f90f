//! `robot init`: what it writes is read back as the robot that it describes.

use super::*;
use crate::robot::{Convex, InitInputs, init, spec};

/// Reads from the repository.
struct Repository;

impl Files for Repository {
    fn read(&mut self, path: &Path) -> std::io::Result<Vec<u8>> {
        std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join(path))
    }
}

fn begun(name: &str, text: &str, left: &[&str], right: &[&str]) -> Result<String, Diagnostics> {
    let [left, right] = [left, right].map(|side| side.iter().map(|j| j.to_string()).collect::<Vec<_>>());
    init(InitInputs { urdf: (name, text), named: "robot.urdf", left: &left, right: &right, files: &mut Repository })
}

fn read_back(name: &str, urdf: &str, yaml: &str) -> RobotModel {
    let spec = spec::parse("robot.yaml", yaml).unwrap_or_else(|f| panic!("{}\n{yaml}", crate::diag::render(&f, false)));
    let inputs =
        RobotInputs { spec: &spec, urdf: (name, urdf), files: &mut Repository, overrides: &LimitsSpec::default() };
    parse(inputs).unwrap_or_else(|f| panic!("{}\n{yaml}", crate::diag::render(&f, false)))
}

#[test]
fn every_shipped_robot_is_begun_and_read_back_as_its_robot_yaml_has_it() {
    for name in [
        "box_base",
        "conv",
        "scr_db",
        "tracer",
        "limo",
        "turtlebot3_burger",
        "turtlebot3_waffle_pi",
        "tiago",
        "stretch",
    ] {
        let path = format!("robots/{name}/{name}.urdf");
        let file = |path: &str| String::from_utf8(Repository.read(Path::new(path)).expect(path)).expect("text");
        let urdf = file(&path);
        let yaml = begun(&path, &urdf, &[], &[]).unwrap_or_else(|f| panic!("{}", crate::diag::render(&f, false)));
        assert!(yaml.lines().all(|line| line.chars().count() <= 130), "{yaml}");
        assert!(
            yaml.contains("cannot be known from the URDF: measure and fill in"),
            "no URDF says how fast wheels accelerate"
        );
        let begun = read_back(&path, &urdf, &yaml);
        let shipped = read_back(&path, &urdf, &file(&format!("robots/{name}/robot.yaml")));
        assert!((begun.wheel_radii.mean - shipped.wheel_radii.mean).abs() < 1e-4, "{name}: {}", begun.wheel_radii.mean);
        assert!((begun.base_from_root.inverse() * shipped.base_from_root).translation.vector.norm() < 1e-4, "{name}");
        for joint in &shipped.joints {
            let same =
                begun.joints.iter().find(|j| j.name == joint.name).unwrap_or_else(|| panic!("{name}: {}", joint.name));
            assert_eq!((same.lower, same.upper, same.prismatic), (joint.lower, joint.upper, joint.prismatic), "{name}");
        }
    }
}

#[test]
fn a_telescope_on_a_lift_and_springs_under_wheels_are_told_of_and_held() {
    let file = |path: &str| String::from_utf8(Repository.read(Path::new(path)).expect(path)).expect("text");
    let tiago = begun("robots/tiago/tiago.urdf", &file("robots/tiago/tiago.urdf"), &[], &[]).expect("TIAGo");
    assert!(
        tiago.contains("    suspension_left_joint: 0\n") && !tiago.contains("    - suspension_left_joint\n"),
        "{tiago}"
    );
    assert!(tiago.contains("caster_back_left_2_joint"), "{tiago}");
    let limo = begun("robots/limo/limo.urdf", &file("robots/limo/limo.urdf"), &[], &[]).expect("LIMO");
    assert!(
        limo.contains("  left: [front_left_wheel, rear_left_wheel]\n") && limo.contains("track_width_m: 0.175"),
        "{limo}"
    );
    let alone = file("robots/stretch/stretch.urdf").replace(r#"<mimic joint="joint_arm_l3" />"#, "");
    let stretch = begun("robots/stretch/stretch.urdf", &alone, &[], &[]).expect("Stretch");
    assert!(
        stretch.contains("segments of a telescope?")
            && stretch.contains("[link_arm_l4, link_arm_l2]     # in one telescope"),
        "{stretch}"
    );
    assert!(stretch.contains("wheel_radius_m: 0.0508     # a guess"), "{stretch}");
}

#[test]
fn wheels_that_cannot_be_found_can_be_named() {
    let urdf = with_wheels(&wheel("third", "0 0 0.1", 0.1));
    assert_eq!(begun("r.urdf", &urdf, &[], &[]).expect_err("three wheels").0[0].code, "robot/wheels-not-found");
    let yaml = begun("r.urdf", &urdf, &["left"], &["right"]).expect("named");
    assert!((read_back("r.urdf", &urdf, &yaml).track_width - 0.4).abs() < 1e-12);
}

#[test]
fn names_that_yaml_would_take_for_something_else_are_quoted() {
    for odd in ["true", "1.5", "a: b", "# x", "[arm]", "\\\"quote\\\"", "line&#10;break", "é"] {
        let odd = odd.replace("\\\"", "&quot;");
        let arm = limb(&odd, "revolute", "base", "hand", LIMIT);
        let urdf = with_wheels(&arm);
        let yaml = begun("r.urdf", &urdf, &[], &[]).expect("a robot.yaml");
        assert_eq!(read_back("r.urdf", &urdf, &yaml).joints.len(), 1, "{yaml}");
    }
}

#[test]
fn wheels_without_a_shape_are_guessed_from_the_height_of_the_axle() {
    let bare = wheel("left", "0 0.2 0.1", 0.1);
    let bare = &bare[bare.find("<collision>").unwrap()..bare.find("</collision>").unwrap() + "</collision>".len()];
    let urdf = with_wheels("").replace(bare, "");
    let yaml = begun("r.urdf", &urdf, &[], &[]).expect("a robot.yaml");
    let robot = read_back("r.urdf", &urdf, &yaml);
    assert!(yaml.contains("a guess") && (robot.wheel_radii.mean - 0.1).abs() < 1e-12, "{yaml}");
    assert!(robot.shapes.iter().all(|s| matches!(s.convex, Convex::Box { .. })));
}
