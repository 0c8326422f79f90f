//! Which pairs of links are checked against each other.

use super::*;
use crate::robot::{IgnoreReason, IgnoredPair};

/// A slide along y with a tube of a length about its frame.
fn tube(joint: &str, parent: &str, child: &str, length: f64, at: f64) -> String {
    format!(
        r#"<link name="{child}"><collision><geometry><box size="0.04 {length} 0.04"/></geometry></collision></link>
  <joint name="{joint}" type="prismatic"><parent link="{parent}"/><child link="{child}"/><origin xyz="0 {at} 0"/><axis xyz="0 1 0"/>
  <limit lower="0" upper="0.3" effort="1" velocity="0.2"/></joint>"#
    )
}

fn ignored(robot: &RobotModel) -> Vec<(&str, &str, IgnoreReason)> {
    robot.ignore_pairs.iter().map(|p| (p.links[0].as_str(), p.links[1].as_str(), p.reason)).collect()
}

/// Pairs of links that are checked.
fn checked(robot: &RobotModel) -> Vec<[&str; 2]> {
    robot.self_pairs().iter().map(|pair| pair.map(|s| robot.shapes[s].link.as_str())).collect()
}

#[test]
fn a_link_and_its_parent_are_never_checked_and_others_are() {
    // Two hinges, the second's link far from the base.
    let far = r#"<origin xyz="1 0 1"/><axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/>"#;
    let urdf =
        with_wheels(&(limb("a", "revolute", "base", "upper", far) + &limb("b", "revolute", "upper", "fore", far)));
    let robot = read(&urdf, &RobotSpec::default()).unwrap();
    assert_eq!(ignored(&robot), [("base", "upper", IgnoreReason::Joined), ("upper", "fore", IgnoreReason::Joined)]);
    assert_eq!(
        checked(&robot),
        [
            ["base", "fore"],
            ["left_link", "upper"],
            ["left_link", "fore"],
            ["right_link", "upper"],
            ["right_link", "fore"]
        ]
    );
}

#[test]
fn wheels_and_links_on_one_body_do_not_move_against_each_other() {
    assert_eq!(read(&with_wheels(""), &RobotSpec::default()).unwrap().self_pairs(), [[0; 2]; 0]);
}

#[test]
fn tubes_of_a_telescope_are_left_out_even_where_they_come_apart() {
    let out = 0.5; // clear of the base
    let arm = tube("first", "base", "outer", 0.3, out)
        + &tube("second", "outer", "middle", 0.3, 0.0)
        + &tube("third", "middle", "inner", 0.3, 0.0);
    let robot = read(&with_wheels(&arm), &RobotSpec::default()).unwrap();
    assert!(
        robot
            .ignore_pairs
            .contains(&IgnoredPair { links: ["outer", "inner"].map(String::from), reason: IgnoreReason::Telescope })
    );
    assert!(checked(&robot).contains(&["base", "inner"]), "the base is drawn clear of the tubes");
}

#[test]
fn what_touches_always_or_at_rest_is_left_out_until_robot_yaml_names_pairs() {
    // A carriage inside the base for every value, by way of a link without shape; and a hand that starts inside the base and leaves it.
    let slide = r#"<axis xyz="1 0 0"/><limit lower="0" upper="0.02" effort="1" velocity="0.2"/>"#;
    let swing =
        r#"<origin xyz="0.05 0 0.2"/><axis xyz="0 0 1"/><limit lower="0" upper="0.8" effort="1" velocity="0.2"/>"#;
    let leave = r#"<origin xyz="0 0 0.2"/><axis xyz="0 0 1"/><limit lower="0" upper="1" effort="1" velocity="0.2"/>"#;
    let none = |joint: &str, kind: &str, child: &str, more: &str| {
        format!(
            r#"<link name="{child}"/><joint name="{joint}" type="{kind}"><parent link="base"/><child link="{child}"/>{more}</joint>"#
        )
    };
    let arm = none("s", "fixed", "rail", swing)
        + &limb("c", "prismatic", "rail", "carriage", slide)
        + &none("t", "fixed", "post", "")
        + &limb("h", "prismatic", "post", "hand", leave);
    let robot = read(&with_wheels(&arm), &RobotSpec::default()).unwrap();
    let expected = [
        ("base", "carriage", IgnoreReason::Always),
        ("base", "hand", IgnoreReason::AtRest),
        ("carriage", "hand", IgnoreReason::AtRest),
    ];
    assert_eq!(ignored(&robot), expected);
    assert!(checked(&robot).contains(&["left_link", "hand"]));

    // A mission that keeps the hand outside, or inside, does not change that.
    let narrow = ActuatorLimitsSpec { lower: Some(0.9), ..Default::default() };
    let overrides = LimitsSpec { joints: BTreeMap::from([("h".to_string(), narrow)]), ..Default::default() };
    let urdf = with_wheels(&arm);
    let inputs = RobotInputs {
        spec: &RobotSpec::default(),
        urdf: ("r.urdf", &urdf),
        files: &mut Memory::default(),
        overrides: &overrides,
    };
    assert_eq!(parse(inputs).unwrap().ignore_pairs, robot.ignore_pairs);

    // Named pairs are all that is left out, besides those that a joint joins.
    let pair = [["hand", "base"].map(|name| written(name.to_string()))];
    let spec = RobotSpec { ignore_pairs: Some(pair.to_vec()), ..RobotSpec::default() };
    let named = read(&with_wheels(&arm), &spec).unwrap();
    assert_eq!(ignored(&named), [("base", "hand", IgnoreReason::Named)]);
    let spec = RobotSpec { ignore_pairs: Some(Vec::new()), ..RobotSpec::default() };
    assert_eq!(ignored(&read(&with_wheels(&arm), &spec).unwrap()), []);
}

#[test]
fn links_touch_where_their_shapes_overlap_and_not_a_tenth_of_a_millimetre_beside() {
    // A hand on a slide along x; its box ends 0.2 m beyond the joint, the base's at 0.2 m on the other side.
    let slide =
        r#"<origin xyz="-0.6 0 0.2"/><axis xyz="1 0 0"/><limit lower="0" upper="0.5" effort="1" velocity="0.2"/>"#;
    let post = r#"<link name="post"/><joint name="p" type="fixed"><parent link="base"/><child link="post"/></joint>"#;
    let urdf = with_wheels(&(post.to_string() + &limb("h", "prismatic", "post", "hand", slide)));
    let robot = read(&urdf, &RobotSpec::default()).unwrap();
    let pairs = robot.self_pairs();
    assert_eq!(robot.touching(&pairs, &[0.1999]), None);
    let met = robot.touching(&pairs, &[0.2001]).expect("they overlap");
    assert_eq!(met.map(|shape| robot.shapes[shape].link.as_str()), ["base", "hand"]);
}
