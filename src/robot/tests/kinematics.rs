//! Poses against a naive chain, mimics, limits.

use nalgebra::{Matrix4, Rotation3, Translation3, UnitQuaternion, Vector3, Vector4};
use proptest::prelude::*;

use super::*;
use crate::math::real;
use crate::robot::{Body, MotionLimits};

/// Homogeneous matrix of an `<origin>`, from the definition: yaw, then pitch, then roll.
fn origin(xyz: [f64; 3], rpy: [f64; 3]) -> Matrix4<f64> {
    let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), rpy[2])
        * Rotation3::from_axis_angle(&Vector3::y_axis(), rpy[1])
        * Rotation3::from_axis_angle(&Vector3::x_axis(), rpy[0]);
    Matrix4::new_translation(&Vector3::from(xyz)) * turn.to_homogeneous()
}

/// Rodrigues, or a shift.
fn moved(axis: [f64; 3], prismatic: bool, value: f64) -> Matrix4<f64> {
    let a = Vector3::from(axis).normalize();
    if prismatic {
        return Matrix4::new_translation(&(a * value));
    }
    let k = a.cross_matrix();
    (nalgebra::Matrix3::identity() + k * real::sin(value) + k * k * (1.0 - real::cos(value))).to_homogeneous()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn bodies_agree_with_a_naive_chain(
        links in prop::collection::vec(([-1.0..1.0, -1.0..1.0, -1.0..1.0f64], [-3.0..3.0, -3.0..3.0, -3.0..3.0f64],
            [0.1..1.0, -1.0..1.0, -1.0..1.0f64], 0usize..3, -1.0..2.0f64), 1..6),
    ) {
        // kinds: 0 revolute, 1 prismatic, 2 fixed; joint values as given
        let kinds = ["revolute", "prismatic", "fixed"];
        let mut more = String::new();
        let mut chain = Matrix4::new_translation(&Vector3::new(0.0, 0.0, 0.0));
        let mut q = Vec::new();
        for (i, (xyz, rpy, axis, kind, value)) in links.iter().enumerate() {
            let parent = if i == 0 { "base".into() } else { format!("l{}", i - 1) };
            let inside = format!(
                r#"<origin xyz="{} {} {}" rpy="{} {} {}"/><axis xyz="{} {} {}"/>{LIMIT}"#,
                xyz[0], xyz[1], xyz[2], rpy[0], rpy[1], rpy[2], axis[0], axis[1], axis[2]
            );
            more += &limb(&format!("j{i}"), kinds[*kind], &parent, &format!("l{i}"), &inside);
            chain *= origin(*xyz, *rpy);
            if *kind < 2 {
                chain *= moved(*axis, *kind == 1, *value);
                q.push(*value);
            }
        }
        let robot = read(&with_wheels(&more), &RobotSpec::default()).unwrap();
        prop_assert_eq!(robot.joint_count(), q.len());
        let last = format!("l{}", links.len() - 1);
        let index = robot.shapes.iter().position(|s| s.link == last).unwrap();
        let found = robot.shape_poses(&q)[index];
        let expected = chain * Vector4::new(0.1, 0.0, 0.0, 1.0);
        prop_assert!((found.translation.vector - expected.xyz()).norm() < 1e-9);
        let turn: nalgebra::Matrix3<f64> = chain.fixed_view::<3, 3>(0, 0).into();
        prop_assert!((found.rotation.to_rotation_matrix().matrix() - turn).norm() < 1e-9);
    }
}

#[test]
fn quaternions_of_urdf_1_1_turn_joints_and_shapes_and_are_nothing_before() {
    let half = (0.5f64).sqrt();
    // Any length; the last two look straight up and down, where roll and yaw are one.
    for [x, y, z, w] in
        [[0.1, -0.7, 0.3, 0.6], [2.0, 1.0, -3.0, -0.5], [0.0, half, 0.0, half], [0.0, -half, 1e-7, half]]
    {
        let quaternion = format!(r#"quat_xyzw="{x} {y} {z} {w}""#);
        let arm = limb("arm", "fixed", "base", "l", &format!(r#"<origin xyz="1 0 0" {quaternion}/>"#));
        let arm = arm.replace(r#"<origin xyz="0.1 0 0"/>"#, &format!(r#"<origin xyz="0.1 0 0" {quaternion}/>"#));
        let pose = |version: &str| {
            let urdf = with_wheels(&arm).replacen(r#"<robot name="r">"#, &format!(r#"<robot name="r"{version}>"#), 1);
            let robot = read(&urdf, &RobotSpec::default()).unwrap();
            robot.shape_poses(&[])[robot.shapes.iter().position(|s| s.link == "l").unwrap()]
        };
        let turn = UnitQuaternion::from_quaternion(nalgebra::Quaternion::new(w, x, y, z));
        let expected = Translation3::new(1.0, 0.0, 0.0) * turn * Translation3::new(0.1, 0.0, 0.0) * turn;
        let off = pose(r#" version="1.1""#).to_homogeneous() - expected.to_homogeneous();
        assert!(off.norm() < 1e-7, "{x} {y} {z} {w}: {off}");
        for version in ["", r#" version="1.0""#] {
            assert_eq!(pose(version).rotation, UnitQuaternion::identity());
        }
    }
}

#[test]
fn held_joints_are_folded_at_their_value_or_nearest_limit() {
    let lift = |kind, limit: &str| limb("lift", kind, "base", "l", &format!(r#"<axis xyz="0 0 1"/>{limit}"#));
    let above = r#"<limit lower="0.3" upper="0.5" effort="1"/>"#;
    let height = |urdf: &str, spec: &RobotSpec| {
        let robot = read(&with_wheels(urdf), spec).unwrap();
        assert_eq!((robot.bodies.len(), robot.joint_count()), (1, 0));
        robot.shape_poses(&[])[robot.shapes.iter().position(|s| s.link == "l").unwrap()].translation.z
    };
    // No velocity limit, not named: held at 0, brought to the nearest limit.
    assert!((height(&lift("prismatic", above), &RobotSpec::default()) - 0.3).abs() < 1e-12);
    let fixed = RobotSpec { fixed: vec![(written("lift".into()), 0.4)], ..RobotSpec::default() };
    assert!((height(&lift("prismatic", above), &fixed) - 0.4).abs() < 1e-12);
    assert!((height(&lift("prismatic", LIMIT), &fixed) - 0.4).abs() < 1e-12);
    let none = RobotSpec { moving: Some(Vec::new()), ..RobotSpec::default() };
    assert!(height(&lift("prismatic", LIMIT), &none).abs() < 1e-12);
}

fn motion_of<'a>(robot: &'a RobotModel, link: &str) -> &'a crate::robot::BodyMotion {
    let body: &Body = robot.bodies.iter().find(|b| b.link == link).unwrap();
    body.motion.as_ref().unwrap()
}

#[test]
fn chains_of_mimics_follow_their_source_and_narrow_its_range() {
    let wide = r#"<limit lower="-9" upper="9" effort="1" velocity="8"/>"#;
    // c = 3 b + 0.5, b = -2 a + 0.1: c = -6 a + 0.8; c within [-1, 2]: a within [-0.2, 0.3]
    let more =
        limb("c", "revolute", "base", "lc", &format!(r#"{LIMIT}<mimic joint="b" multiplier="3" offset="0.5"/>"#))
            + &limb(
                "b",
                "revolute",
                "base",
                "lb",
                &format!(r#"{wide}<mimic joint="a" multiplier="-2" offset="0.1"/>"#),
            )
            + &limb("a", "revolute", "base", "la", wide);
    let robot = read(&with_wheels(&more), &RobotSpec::default()).unwrap();
    assert_eq!(robot.joint_count(), 1);
    let (b, c) = (motion_of(&robot, "lb"), motion_of(&robot, "lc"));
    assert_eq!((b.multiplier, b.offset), (-2.0, 0.1));
    assert!((c.multiplier + 6.0).abs() < 1e-12 && (c.offset - 0.8).abs() < 1e-12);
    assert!((robot.joints[0].lower + 0.2).abs() < 1e-12 && (robot.joints[0].upper - 0.3).abs() < 1e-12);
    // c's 0.5 rad/s, six times as fast as a.
    assert!((robot.joints[0].limits.speed.unwrap() - 0.5 / 6.0).abs() < 1e-12);
    // An override of the source is meant for all that follow it.
    let mut spec = RobotSpec::default();
    spec.limits.joints.insert("a".into(), ActuatorLimitsSpec { speed: Some(2.0), ..Default::default() });
    assert_eq!(read(&with_wheels(&more), &spec).unwrap().joints[0].limits.speed, Some(2.0));
    // Held, all of the chain stands still.
    let none = RobotSpec { moving: Some(Vec::new()), ..RobotSpec::default() };
    assert_eq!(read(&with_wheels(&more), &none).unwrap().bodies.len(), 1);
}

#[test]
fn limits_merge_key_by_key_and_the_mission_wins() {
    let urdf = with_wheels(&limb("j", "revolute", "base", "l", LIMIT));
    let mut spec = RobotSpec::default();
    let of = |lower, upper, speed, acceleration| ActuatorLimitsSpec { lower, upper, speed, acceleration, jerk: None };
    spec.limits.joints.insert("j".into(), of(Some(-0.5), Some(1.0), None, Some(3.0)));
    spec.limits.wheel = of(None, None, Some(0.7), Some(0.6));
    let mut overrides = LimitsSpec::default();
    overrides.joints.insert("j".into(), of(None, Some(1.5), Some(4.0), None));
    overrides.wheel = of(None, None, Some(0.8), None);
    overrides.base.eta = Some(0.25);
    let inputs =
        RobotInputs { spec: &spec, urdf: ("r.urdf", &urdf), files: &mut Memory::default(), overrides: &overrides };
    let robot = parse(inputs).unwrap();
    let joint = &robot.joints[0];
    assert_eq!((joint.lower, joint.upper), (-0.5, 1.5));
    assert_eq!(joint.limits, MotionLimits { speed: Some(4.0), acceleration: Some(3.0), jerk: None });
    assert_eq!(robot.wheel, MotionLimits { speed: Some(0.8), acceleration: Some(0.6), jerk: None });
    assert!((robot.base.angular_speed - 2.0 * 0.25 * 0.8 / 0.4).abs() < 1e-12);
    assert!((robot.base.angular_acceleration - 2.0 * 0.6 / 0.4).abs() < 1e-12);
}

#[test]
fn endless_joints_have_no_range_and_clamping_leaves_them_alone() {
    let endless = r#"<axis xyz="0 0 1"/><limit effort="1" velocity="1"/>"#;
    let more = limb("pan", "continuous", "base", "l", endless) + &limb("tilt", "revolute", "l", "m", LIMIT);
    let robot = read(&with_wheels(&more), &RobotSpec::default()).unwrap();
    assert_eq!((robot.joints[0].lower, robot.joints[0].upper), (f64::NEG_INFINITY, f64::INFINITY));
    let mut q = [50.0, 50.0];
    robot.clamp(&mut q);
    assert_eq!(q, [50.0, 2.0]);
    assert_eq!(robot.posture(0.5), [0.0, 0.5]);
}

#[test]
fn joints_keep_the_order_of_the_list_of_moving_ones() {
    let more = limb("a", "revolute", "base", "la", LIMIT) + &limb("b", "prismatic", "la", "lb", LIMIT);
    let order = |spec: &RobotSpec| -> Vec<String> {
        read(&with_wheels(&more), spec).unwrap().joints.into_iter().map(|j| j.name).collect()
    };
    assert_eq!(order(&RobotSpec::default()), ["a", "b"]);
    assert_eq!(order(&RobotSpec { moving: Some(names(&["b", "a"])), ..RobotSpec::default() }), ["b", "a"]);
}
