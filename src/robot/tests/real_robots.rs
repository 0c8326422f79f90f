//! Robots as they are: ours, and two in the manner of published ones.

use std::f64::consts::PI;

use super::*;
use crate::robot::{Convex, MotionLimits};

/// Tables are rounded to the millimetre, a width on both sides.
const ROUNDED: f64 = 1.01e-3;

/// x from, x to, width, height, radius.
fn dimensions(robot: &RobotModel, q: &[f64]) -> [f64; 5] {
    let e = robot.extents(q);
    [e.min[0], e.max[0], e.max[1] - e.min[1], e.max[2], robot.radius(q)]
}

fn assert_near(found: [f64; 5], expected: [f64; 5], tolerance: f64) {
    for (f, e) in found.iter().zip(expected) {
        assert!((f - e).abs() <= tolerance, "{found:?}, expected {expected:?}");
    }
}

#[test]
fn scr_db_has_the_measured_dimensions() {
    let robot = scr_db();
    assert_near(dimensions(&robot, &[0.0]), [-0.3, 0.12, 0.36, 0.63, 0.350], ROUNDED);
    assert_near(dimensions(&robot, &[PI / 2.0]), [-0.3, 0.12, 0.64, 0.49, 0.406], ROUNDED);
    assert_near(dimensions(&robot, &[PI]), [-0.3, 0.12, 0.92, 0.28, 0.463], ROUNDED);
    assert_eq!(robot.extents(&[0.3]).min[2].abs(), 0.0);

    let mut swept = dimensions(&robot, &[0.0]);
    for i in 0..=720 {
        let d = dimensions(&robot, &[PI * f64::from(i) / 720.0]);
        swept[0] = swept[0].min(d[0]);
        for k in 1..5 {
            swept[k] = swept[k].max(d[k]);
        }
    }
    assert_near(swept, [-0.3, 0.12, 0.928, 0.634, 0.464], ROUNDED);
}

#[test]
fn scr_db_has_one_joint_that_both_blades_follow() {
    let robot = scr_db();
    assert_eq!((robot.joint_count(), robot.bodies.len(), robot.shapes.len()), (1, 3, 6));
    let joint = &robot.joints[0];
    assert_eq!((joint.name.as_str(), joint.lower, joint.upper, joint.prismatic), ("blade", 0.0, PI, false));
    assert_eq!(joint.limits, MotionLimits { speed: Some(1.0), acceleration: Some(2.0), jerk: Some(10.0) });
    let factors: Vec<_> = robot.bodies.iter().filter_map(|b| b.motion.as_ref()).map(|m| m.multiplier).collect();
    assert_eq!(factors, [1.0, -1.0]);
    // The root frame is the base frame.
    assert!(robot.base_from_root.translation.vector.norm() < 1e-15 && robot.base_from_root.rotation.angle() < 1e-15);
    // 2 eta v / D
    assert!((robot.base.angular_speed - 2.0 * 0.1 * 0.5 / 0.32).abs() < 1e-15);
    assert_eq!((robot.base.speed, robot.base.acceleration, robot.base.min_speed), (0.5, 0.5, 0.01));
    assert_eq!(robot.base.angular_acceleration, 1.5);
}

#[test]
fn the_top_over_all_postures_is_a_tight_upper_bound() {
    let robot = scr_db();
    let top = (0..=10_000).map(|i| robot.extents(&[PI * f64::from(i) / 10_000.0]).max[2]).fold(0.0, f64::max);
    let bound = robot.top_over_all_postures();
    assert!(bound >= top && bound <= top + 1e-3, "{bound} for {top}");
}

#[test]
fn box_base_has_the_measured_dimensions_and_no_joint() {
    let spec = RobotSpec { wheel_radius: Some(written(0.08)), ..RobotSpec::default() };
    let robot = read(include_str!("../../../robots/box_base/box_base.urdf"), &spec).unwrap();
    assert_near(dimensions(&robot, &[]), [-0.2, 0.2, 0.4, 0.3, 0.283], ROUNDED);
    assert_eq!((robot.joint_count(), robot.bodies.len()), (0, 1));
    assert!((robot.track_width - 0.32).abs() < 1e-15);
    // Wheel speed by default: the URDF's rate times the radius.
    assert_eq!(robot.wheel, MotionLimits { speed: Some(0.5), acceleration: None, jerk: None });
    assert_eq!((robot.base.speed, robot.base.acceleration, robot.base.eta), (0.5, 0.5, 1.0));
    assert!((robot.base.angular_speed - 2.0 * 0.5 / 0.32).abs() < 1e-12);
    assert!((robot.base.angular_acceleration - 2.0 * 0.5 / 0.32).abs() < 1e-12);
    assert!((robot.top_over_all_postures() - 0.3).abs() < 1e-6);
}

#[test]
fn wheels_that_differ_have_a_radius_each_and_the_smaller_one_is_the_slower() {
    let yaml = "urdf: a.urdf\ndrive: {wheel_radius_m: 0.08, wheel_difference: -1%}\n";
    let robot =
        read(include_str!("../../../robots/box_base/box_base.urdf"), &spec::parse("a.yaml", yaml).unwrap()).unwrap();
    let [left, right] = robot.wheel_radii.sides();
    assert!((left - 0.0804).abs() < 1e-15 && (right - 0.0796).abs() < 1e-15, "{left} {right}");
    let speed = robot.wheel.speed.unwrap();
    assert!((speed - 0.5 * 0.995).abs() < 1e-12, "{speed}");
    assert!(robot.describe().contains("the right wheel -1.000 % larger"), "{}", robot.describe());
}

#[test]
fn conv_finds_its_wheels_by_itself() {
    let robot = read(include_str!("../../../robots/conv/conv.urdf"), &RobotSpec::default()).unwrap();
    assert_eq!((robot.name.as_str(), robot.wheel_radii.mean, robot.track_width), ("conv", 0.1, 0.4));
    assert_near(dimensions(&robot, &[]), [-0.2, 0.2, 0.43, 0.3, 0.2 * 2f64.sqrt()], 1e-9);
}

/// Wheel frames turned by a rounded right angle about x, axis z, a base link above the floor, fixed castors.
const TURNED_WHEELS: &str = r#"<robot name="burger">
  <link name="footprint"/>
  <joint name="base_joint" type="fixed"><parent link="footprint"/><child link="base"/><origin xyz="0 0 0.01"/></joint>
  <link name="base">
    <visual><geometry><mesh filename="package://x/y.dae"/></geometry></visual>
    <collision><origin xyz="-0.032 0 0.07"/><geometry><box size="0.14 0.14 0.143"/></geometry></collision>
  </link>
  <joint name="wl" type="continuous"><parent link="base"/><child link="wl_link"/><origin rpy="-1.57 0 0" xyz="0 0.08 0.023"/><axis xyz="0 0 1"/></joint>
  <link name="wl_link"><collision><geometry><cylinder length="0.018" radius="0.033"/></geometry></collision></link>
  <joint name="wr" type="continuous"><parent link="base"/><child link="wr_link"/><origin rpy="-1.57 0 0" xyz="0 -0.08 0.023"/><axis xyz="0 0 1"/></joint>
  <link name="wr_link"><collision><geometry><cylinder length="0.018" radius="0.033"/></geometry></collision></link>
  <joint name="castor_swivel" type="continuous"><parent link="base"/><child link="fork"/><origin xyz="-0.08 0 0.01"/><axis xyz="0 0 1"/><limit effort="1"/></joint>
  <link name="fork"/>
  <joint name="castor" type="continuous"><parent link="fork"/><child link="castor_link"/><axis xyz="0 1 0"/></joint>
  <link name="castor_link"/>
  <joint name="scan_joint" type="fixed"><parent link="base"/><child link="scan"/><origin xyz="-0.032 0 0.172"/></joint>
  <link name="scan"><collision><origin xyz="0.015 0 -0.0065"/><geometry><cylinder length="0.0315" radius="0.055"/></geometry></collision></link>
</robot>"#;

#[test]
fn rounded_wheel_frames_castors_and_a_raised_root_are_understood() {
    let robot = read(TURNED_WHEELS, &RobotSpec::default()).unwrap();
    assert_eq!((robot.wheel_radii.mean, robot.joint_count()), (0.033, 0));
    assert!((robot.track_width - 0.16).abs() < 1e-12);
    let e = robot.extents(&[]);
    for (found, expected) in e.min.iter().chain(&e.max).zip([-0.102, -0.089, 0.0, 0.038, 0.089, 0.19125]) {
        assert!((found - expected).abs() < 2e-4, "{e:?}");
    }
    assert!((robot.radius(&[]) - 0.124).abs() < 5e-4);
    let pose = robot.base_from_root;
    assert!(pose.translation.vector.norm() < 1e-12 && pose.rotation.angle() < 1e-12, "{pose}");
}

#[test]
fn wheels_behind_suspension_belong_to_its_body_and_the_base_frame_is_at_zero() {
    let spring = r#"<axis xyz="0 0 1"/><limit lower="-0.005" upper="0.005" effort="1" velocity="1"/>"#;
    let hung = |side: &str, y: f64| {
        format!(
            r#"<link name="{side}_arm"/><joint name="{side}_spring" type="prismatic"><parent link="base"/><child link="{side}_arm"/><origin xyz="0.1 {y} 0"/>{spring}</joint>
            <link name="{side}_link"><collision><origin rpy="1.5707963267948966 0 0"/><geometry><cylinder radius="0.1" length="0.03"/></geometry></collision></link>
            <joint name="{side}" type="continuous"><parent link="{side}_arm"/><child link="{side}_link"/><axis xyz="0 1 0"/></joint>"#
        )
    };
    let urdf = format!(
        r#"<robot name="sprung"><link name="base"><collision><geometry><box size="0.5 0.4 0.1"/></geometry></collision></link>{}{}</robot>"#,
        hung("left", 0.2),
        hung("right", -0.2)
    );
    let robot = read(&urdf, &RobotSpec::default()).unwrap();
    let moving: Vec<_> = robot.joints.iter().map(|j| (j.name.as_str(), j.prismatic)).collect();
    assert_eq!(moving, [("left_spring", true), ("right_spring", true)]);
    let wheel = robot.shapes.iter().find(|s| s.link == "left_link").unwrap();
    assert_eq!(robot.bodies[wheel.body].link, "left_arm");
    assert!((robot.base_from_root.translation.vector - nalgebra::Vector3::new(-0.1, 0.0, 0.1)).norm() < 1e-12);
    assert!((robot.extents(&[-0.005, 0.0]).min[2] + 0.005).abs() < 1e-12);

    let held = RobotSpec { moving: Some(Vec::new()), ..RobotSpec::default() };
    assert_eq!(read(&urdf, &held).unwrap().bodies.len(), 1);
}

#[test]
fn several_wheels_a_side_put_the_base_at_their_mean() {
    let urdf = with_wheels(&(wheel("rear_left", "-0.4 0.2 0.1", 0.1) + &wheel("rear_right", "-0.4 -0.2 0.1", 0.1)));
    let error = read(&urdf, &RobotSpec::default()).unwrap_err();
    assert!(error.0[0].message.contains("`rear_left` at (-0.400, 0.200, 0.100)"), "{error:?}");
    let spec = RobotSpec {
        drive_left: names(&["left", "rear_left"]),
        drive_right: names(&["right", "rear_right"]),
        ..RobotSpec::default()
    };
    let robot = read(&urdf, &spec).unwrap();
    assert!((robot.base_from_root.translation.vector.x - 0.2).abs() < 1e-12);
    assert!((robot.track_width - 0.4).abs() < 1e-12);
}

#[test]
fn a_base_turned_against_the_root_faces_forward() {
    // Wheels named the other way round: y runs from right to left wheel, so the robot drives the other way.
    let spec = RobotSpec { drive_left: names(&["right"]), drive_right: names(&["left"]), ..RobotSpec::default() };
    let turned = read(&with_wheels(""), &spec).unwrap();
    assert!((turned.base_from_root.rotation.euler_angles().2.abs() - PI).abs() < 1e-12);
}

#[test]
fn meshes_are_found_and_scaled() {
    let urdf = |name: &str| {
        with_wheels(&format!(
            r#"<link name="m"><collision><origin xyz="0 0 1"/><geometry><mesh filename="{name}" scale="0.001 0.001 0.002"/></geometry></collision></link>
           <joint name="j" type="fixed"><parent link="base"/><child link="m"/></joint>"#
        ))
    };
    let cube: String =
        (0..8).map(|i| format!("v {} {} {}\n", 100 * (i & 1), 100 * (i >> 1 & 1), 100 * (i >> 2))).collect();
    for (name, place) in [
        ("meshes/c.obj", "a/b/meshes/c.obj"),
        ("file:///opt/c.OBJ", "/opt/c.OBJ"),
        ("package://pkg/meshes/c.obj", "a/pkg/meshes/c.obj"),
        ("package://pkg/meshes/c.obj", "a/b/meshes/c.obj"),
        ("package://pkg/meshes/c.obj", "../pkg/meshes/c.obj"),
    ] {
        let mut files = Memory(BTreeMap::from([(PathBuf::from(place), cube.clone().into_bytes())]));
        let robot = read_with(&urdf(name), &RobotSpec::default(), &mut files).unwrap();
        let shape = robot.shapes.iter().find(|s| s.link == "m").unwrap();
        let half = shape.convex.half_extents();
        assert!((half[0] - 0.05).abs() < 1e-12 && (half[2] - 0.1).abs() < 1e-12, "{half:?}");
        assert!(matches!(&shape.convex, Convex::Hull { vertices } if vertices.len() == 8));
        assert!((robot.extents(&[]).max[2] - 1.2).abs() < 1e-12);
    }
    let missing = fault(&urdf("c.obj"), &RobotSpec::default());
    assert!(missing.message.contains("`m`: mesh c.obj: not found") && missing.at.is_some(), "{missing:?}");
    let dae = fault(&urdf("c.dae"), &RobotSpec::default());
    assert!(dae.message.contains(".dae") && dae.hint.unwrap().contains("STL"), "{}", dae.message);
    let ignored = RobotSpec { ignore_links: names(&["m"]), ..RobotSpec::default() };
    assert!(read(&urdf("c.dae"), &ignored).is_ok());
}

#[test]
fn the_description_names_joints_shapes_and_dimensions() {
    let text = scr_db().describe();
    for part in ["wheel radius 0.0800 m, track width 0.3200 m", "blade", "0.0000 to 3.1416 rad", "left_blade", "swept"]
    {
        assert!(text.contains(part), "{part} in\n{text}");
    }
}
