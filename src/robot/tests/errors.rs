//! Every fault of the contract, each found with its own code and a place.

use proptest::prelude::*;

use super::*;

fn code(urdf: &str, spec: &RobotSpec) -> &'static str {
    let fault = fault(urdf, spec);
    assert!(!fault.message.is_empty());
    fault.code
}

#[test]
fn faults_of_the_text_are_found_with_their_place() {
    let good = with_wheels(&limb("j", "revolute", "base", "l", LIMIT));
    assert!(read(&good, &RobotSpec::default()).is_ok());
    assert!(read(&format!("\u{feff}{good}"), &RobotSpec::default()).is_ok());
    let deep = "<a>".repeat(100) + &"</a>".repeat(100);
    for (from, to, code) in [
        ("</robot>", "", "robot/xml"),
        (r#"<?xml version="1.0"?>"#, "<!DOCTYPE robot [<!ENTITY a \"b\">]>", "robot/xml"),
        ("</robot>", &(deep.clone() + "</robot>"), "robot/xml-depth"),
        ("<link name=\"l\">", "<link>", "robot/no-name"),
        ("<link name=\"l\">", "<link name=\"base\"/><link name=\"l\">", "robot/doubled-name"),
        ("<joint name=\"j\"", "<joint name=\"left\"", "robot/doubled-name"),
        ("<child link=\"l\"/>", "<child link=\"ll\"/>", "robot/unknown-name"),
        ("<child link=\"l\"/>", "", "robot/missing-element"),
        ("<parent link=\"base\"/><child link=\"l\"/>", "<parent link=\"l\"/><child link=\"l\"/>", "robot/cycle"),
        ("<child link=\"l\"/>", "<child link=\"left_link\"/>", "robot/two-parents"),
        ("lower=\"-1\"", "lower=\"NaN\"", "robot/not-a-number"),
        ("lower=\"-1\"", "lower=\"3\"", "robot/joint-limits"),
        ("velocity=\"0.5\"", "velocity=\"-0.5\"", "robot/limit-not-positive"),
        ("size=\"0.2 0.02 0.02\"", "size=\"0.2 inf 0.02\"", "robot/not-a-number"),
        ("size=\"0.2 0.02 0.02\"", "size=\"0.2 0.02\"", "robot/not-a-number"),
        ("size=\"0.2 0.02 0.02\"", "size=\"0.2 -0.02 0.02\"", "robot/geometry"),
        ("<box size=\"0.2 0.02 0.02\"/>", "<capsule radius=\"1\" length=\"1\"/>", "robot/geometry"),
        ("<box size=\"0.2 0.02 0.02\"/>", "", "robot/geometry"),
        ("<child link=\"l\"/>", "<child link=\"l\"/><axis xyz=\"0 0 0\"/>", "robot/axis"),
        ("<child link=\"l\"/>", "<child link=\"l\"/><origin xyz=\"0 0 x\"/>", "robot/not-a-number"),
        ("<child link=\"l\"/>", "<child link=\"l\"/><mimic joint=\"left_wheel\"/>", "robot/unknown-name"),
        ("type=\"revolute\"", "type=\"planar\"", "robot/joint-type"),
        ("type=\"revolute\"", "type=\"floating\"", "robot/joint-type"),
        ("<robot name=\"r\">", "<robot name=\"r\"><link name=\"alone\"/>", "robot/several-roots"),
    ] {
        assert!(good.contains(from), "{from}");
        let found = read(&good.replacen(from, to, 1), &RobotSpec::default()).unwrap_err().0.remove(0);
        assert_eq!(found.code, code, "{from} -> {to}: {}", found.message);
        assert!(found.at.is_some(), "{code}");
    }
    assert_eq!(code("<sdf/>", &RobotSpec::default()), "robot/not-urdf");
    assert_eq!(code("", &RobotSpec::default()), "robot/xml");
    let xacro = fault("<robot><xacro:macro/></robot>", &RobotSpec::default());
    assert!(xacro.hint.unwrap().contains("`xacro a/b/r.urdf > a/b/r.expanded.urdf`"));
}

#[test]
fn what_exporters_write_without_meaning_is_no_fault() {
    for inside in [
        r#"<axis xyz="0 0 0"/><limit lower="0" upper="0" effort="0" velocity="0"/>"#,
        r#"<limit lower="1" upper="-1" effort="x"/><safety_controller/><dynamics damping="x"/>"#,
    ] {
        let more = limb("j", "fixed", "base", "l", inside) + "<gazebo><plugin/></gazebo><transmission/><material/>";
        assert!(read(&with_wheels(&more), &RobotSpec::default()).is_ok(), "{inside}");
    }
    let inertia = with_wheels("").replacen("<collision>", "<inertial/><visual/><collision>", 1);
    assert!(read(&inertia, &RobotSpec::default()).is_ok());
}

#[test]
fn all_faults_of_the_text_are_found_at_once() {
    let urdf = with_wheels(&limb("j", "planar", "nowhere", "l", r#"<axis xyz="0 0 0"/>"#));
    let codes: Vec<_> = read(&urdf, &RobotSpec::default()).unwrap_err().0.iter().map(|d| d.code).collect();
    assert_eq!(codes, ["robot/joint-type", "robot/unknown-name", "robot/axis"]);
}

#[test]
fn faults_point_at_the_right_bytes() {
    let urdf = with_wheels(&limb("j", "revolute", "bass", "l", ""));
    let found = fault(&urdf, &RobotSpec::default());
    let at = found.at.unwrap();
    assert_eq!(&urdf[at.range.clone()], "link=\"bass\"");
    assert_eq!(found.hint.unwrap(), "did you mean `base`?");
}

#[test]
fn a_circle_of_links_beside_the_root_is_found() {
    let more = limb("a", "fixed", "y", "x", "") + &limb("b", "fixed", "x", "y", "");
    assert_eq!(code(&with_wheels(&more), &RobotSpec::default()), "robot/cycle");
}

#[test]
fn wheels_that_do_not_make_a_differential_drive_are_refused_with_numbers() {
    let both = RobotSpec { drive_left: names(&["left"]), drive_right: names(&["right"]), ..RobotSpec::default() };
    let good = with_wheels("");
    let right = r#"<origin xyz="0 -0.2 0.1"/><axis xyz="0 1 0"/>"#;
    assert!(good.contains(right));
    for (to, code, part) in [
        (r#"<origin xyz="0.01 -0.2 0.1"/><axis xyz="0 1 0"/>"#, "robot/wheels-not-coaxial", "0.0100 m off"),
        (r#"<origin xyz="0 -0.2 0.13"/><axis xyz="0 1 0"/>"#, "robot/wheels-not-coaxial", "0.0300 m off"),
        (r#"<origin xyz="0 -0.2 0.1"/><axis xyz="0.1 1 0"/>"#, "robot/wheels-not-parallel", "5.71 degrees"),
        (r#"<origin xyz="0 -0.2 0.1"/><axis xyz="0 1 0.1"/>"#, "robot/wheel-not-horizontal", "5.71 degrees"),
        (r#"<origin xyz="0 0.2 0.1"/><axis xyz="0 1 0"/>"#, "robot/zero-track", "one place"),
    ] {
        let found = fault(&good.replace(right, to), &both);
        assert_eq!(found.code, code, "{}", found.message);
        assert!(found.message.contains(part) && found.at.is_some(), "{}", found.message);
    }
    // The other sense of rotation is fine.
    assert!(read(&good.replace(right, r#"<origin xyz="0 -0.2 0.1"/><axis xyz="0 -2 0.01"/>"#), &both).is_ok());

    let unequal = good.replacen("radius=\"0.1\"", "radius=\"0.1002\"", 1);
    let found = fault(&unequal, &both);
    assert_eq!(found.code, "robot/unequal-wheels");
    assert!(found.message.contains("0.1002 m (`left`), 0.1000 m (`right`)"), "{}", found.message);
    assert!(read(&good.replacen("radius=\"0.1\"", "radius=\"0.10009\"", 1), &both).is_ok());

    let bare = good.replace(r#"<cylinder radius="0.1" length="0.03"/>"#, r#"<box size="1 1 1"/>"#);
    assert_eq!(code(&bare, &both), "robot/wheel-radius");
    assert!(read(&bare, &RobotSpec { wheel_radius: Some(written(0.1)), ..both.clone() }).is_ok());
    for bad in [0.0, -0.1, f64::NAN] {
        let given = RobotSpec { wheel_radius: Some(written(bad)), ..both.clone() };
        assert_eq!(code(&good, &given), "robot/wheel-radius");
        let given = RobotSpec { track_width: Some(written(bad)), ..both.clone() };
        assert_eq!(code(&good, &given), "robot/zero-track");
    }
}

#[test]
fn wheels_that_are_not_found_are_listed() {
    let none = with_wheels("").replace("continuous", "fixed");
    let found = fault(&none, &RobotSpec::default());
    assert_eq!(found.code, "robot/wheels-not-found");
    assert!(found.message.ends_with("none"), "{}", found.message);
    assert!(found.hint.unwrap().contains("drive.left"));
    let upright = with_wheels("").replace("xyz=\"0 1 0\"", "xyz=\"0 0 1\"");
    assert!(
        fault(&upright, &RobotSpec::default()).message.contains("`left` at (0.000, 0.200, 0.100), axis not horizontal")
    );
}

#[test]
fn names_in_robot_yaml_must_fit_the_urdf() {
    let urdf = with_wheels(
        &(limb("lift", "prismatic", "base", "l", LIMIT)
            + &limb("slow", "revolute", "base", "m", "")
            + &limb("copy", "prismatic", "base", "n", r#"<mimic joint="lift"/>"#)
            + &limb("bolt", "fixed", "base", "o", "")),
    );
    assert!(read(&urdf, &RobotSpec::default()).is_ok());
    let moving = |list: &[&str]| RobotSpec { moving: Some(names(list)), ..RobotSpec::default() };
    let fixed = |name: &str, value| RobotSpec { fixed: vec![(written(name.into()), value)], ..RobotSpec::default() };
    let drive = |left: &[&str], right: &[&str]| RobotSpec {
        drive_left: names(left),
        drive_right: names(right),
        ..RobotSpec::default()
    };
    for (spec, code, part) in [
        (moving(&["lifd"]), "robot/unknown-joint", "`lifd`"),
        (moving(&["copy"]), "robot/moving-joint", "is a mimic of `lift`"),
        (moving(&["left"]), "robot/moving-joint", "is a drive wheel"),
        (moving(&["bolt"]), "robot/moving-joint", "of type fixed"),
        (moving(&["lift", "lift"]), "robot/moving-joint", "twice"),
        (RobotSpec { moving: Some(names(&["lift"])), ..fixed("lift", 0.1) }, "robot/moving-joint", "joints.fixed"),
        (moving(&["slow"]), "robot/no-velocity-limit", "`slow`"),
        (fixed("nothing", 0.0), "robot/unknown-joint", "`nothing`"),
        (fixed("copy", 0.0), "robot/fixed-joint", "mimic"),
        (fixed("right", 0.0), "robot/fixed-joint", "wheel"),
        (fixed("lift", 2.5), "robot/fixed-outside", "-1 to 2"),
        (fixed("lift", f64::NAN), "robot/fixed-outside", "NaN"),
        (drive(&["left"], &[]), "robot/wheels-half-named", "drive.right is not"),
        (drive(&["left"], &["rihgt"]), "robot/unknown-joint", "`rihgt`"),
        (drive(&["left"], &["left"]), "robot/wheel-twice", "twice"),
        (drive(&["left"], &["lift"]), "robot/wheel-type", "prismatic"),
        (RobotSpec { ignore_links: names(&["bass"]), ..RobotSpec::default() }, "robot/unknown-link", "`bass`"),
        (
            RobotSpec { ignore_pairs: Some(vec![["base", "x"].map(|n| written(n.into()))]), ..RobotSpec::default() },
            "robot/unknown-link",
            "`x`",
        ),
    ] {
        let found = fault(&urdf, &spec);
        assert_eq!(found.code, code, "{}", found.message);
        assert!(found.message.contains(part), "{}", found.message);
    }
    assert!(fault(&urdf, &moving(&["slow"])).hint.unwrap().contains("limits.joints.slow.speed"));
}

#[test]
fn overrides_must_be_positive_tighter_and_of_joints() {
    let urdf = with_wheels(&limb("j", "revolute", "base", "l", LIMIT));
    let with = |name: &str, limits: ActuatorLimitsSpec| {
        let mut spec = RobotSpec { limit_joints: names(&[name]), ..RobotSpec::default() };
        spec.limits.joints.insert(name.into(), limits);
        spec
    };
    let none = ActuatorLimitsSpec::default();
    for (name, limits, code) in [
        ("j", ActuatorLimitsSpec { upper: Some(2.1), ..none }, "robot/limit-loosened"),
        ("j", ActuatorLimitsSpec { lower: Some(-1.1), ..none }, "robot/limit-loosened"),
        ("j", ActuatorLimitsSpec { lower: Some(1.0), upper: Some(0.5), ..none }, "robot/joint-limits"),
        ("j", ActuatorLimitsSpec { speed: Some(0.0), ..none }, "robot/limit-not-positive"),
        ("j", ActuatorLimitsSpec { jerk: Some(f64::NAN), ..none }, "robot/limit-not-positive"),
        ("k", none, "robot/unknown-joint"),
        ("left", none, "robot/limits-of-wheel"),
    ] {
        assert_eq!(self::code(&urdf, &with(name, limits)), code);
    }
    assert!(read(&urdf, &with("j", ActuatorLimitsSpec { upper: Some(2.0 + 1e-12), ..none })).is_ok());
    let mut spec = RobotSpec::default();
    spec.limits.wheel.acceleration = Some(-1.0);
    spec.limits.base.eta = Some(0.0);
    spec.limits.base.min_speed = Some(f64::INFINITY);
    let faults = read(&urdf, &spec).unwrap_err().0;
    assert!(faults.len() == 3 && faults.iter().all(|f| f.code == "robot/limit-not-positive"), "{faults:?}");
}

#[test]
fn mimics_in_a_circle_or_without_common_values_are_refused() {
    let circle = limb("a", "revolute", "base", "la", r#"<mimic joint="b"/>"#)
        + &limb("b", "revolute", "base", "lb", r#"<mimic joint="a"/>"#);
    let faults = read(&with_wheels(&circle), &RobotSpec::default()).unwrap_err().0;
    assert!(faults.iter().all(|f| f.code == "robot/mimic-cycle") && faults.len() == 2, "{faults:?}");
    let apart = limb("a", "revolute", "base", "la", LIMIT)
        + &limb("b", "revolute", "base", "lb", &format!(r#"{LIMIT}<mimic joint="a" offset="9"/>"#));
    assert_eq!(code(&with_wheels(&apart), &RobotSpec::default()), "robot/mimic-limits");
    let endless = limb("a", "prismatic", "base", "la", r#"<mimic joint="b"/>"#)
        + &limb("b", "continuous", "base", "lb", r#"<limit effort="1" velocity="1"/>"#);
    assert_eq!(code(&with_wheels(&endless), &RobotSpec::default()), "robot/no-position-limits");
}

#[test]
fn a_robot_without_shapes_is_refused() {
    let spec = RobotSpec { ignore_links: names(&["base", "left_link", "right_link"]), ..RobotSpec::default() };
    assert_eq!(code(&with_wheels(""), &spec), "robot/no-shapes");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn mutated_text_never_panics(
        edits in prop::collection::vec((0usize..4000, 0usize..40, prop::sample::select(vec![
            "", "<", ">", "\"", "/", "&", "é", "-1e308", "1e-300", "nan", "0", "<limit/>", "<link name=\"x\"/>", "</joint>",
            "<mimic joint=\"blade\" multiplier=\"0\"/>", "<![CDATA[", "<!--", "fixed", "prismatic", "continuous", "base_link",
            "xmlns=\"a\" ", "<limit velocity=\"1\"/>", "\u{0}",
        ])), 1..4),
    ) {
        let mut text = include_str!("../../../robots/scr_db/scr_db.urdf").to_string();
        for (at, length, insert) in edits {
            let place = |i: usize| (i.min(text.len())..=text.len()).find(|i| text.is_char_boundary(*i)).unwrap();
            let (from, to) = (place(at), place(at + length));
            text.replace_range(from..to, insert);
        }
        if let Ok(robot) = read(&text, &RobotSpec::default()) {
            let q = robot.posture(0.3);
            prop_assert!(robot.extents(&q).max[2].is_finite());
            prop_assert!(robot.top_over_all_postures().is_finite());
            robot.describe();
        }
        for fault in read(&text, &RobotSpec::default()).err().into_iter().flat_map(|d| d.0) {
            if let Some(at) = fault.at {
                prop_assert!(text.get(at.range.clone()).is_some(), "{}: {:?}", fault.message, at.range);
            }
        }
    }
}
