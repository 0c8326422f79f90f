//! Small bags by hand: frames, kinds, stamps, axes.

use std::io::Cursor;

use super::*;
use crate::emit::cdr::Writer;
use crate::mission::LimitsSpec;
use crate::robot::{self, NoFiles, RobotInputs, spec};

const YAML: &str = include_str!("../../../robots/box_base/robot.yaml");
const URDF: &str = include_str!("../../../robots/box_base/box_base.urdf");

type Robot = (RobotModel, [Vec<DriveJoint>; 2]);

fn robot(urdf: &str) -> Robot {
    let spec = spec::parse("robot.yaml", YAML).expect("shipped");
    let overrides = &LimitsSpec::default();
    let inputs = RobotInputs { spec: &spec, urdf: ("a.urdf", urdf), files: &mut NoFiles, overrides };
    robot::parse_with_drive(inputs).expect("shipped")
}

fn head(w: &mut Writer, seconds: i32, frame: &str) {
    w.i32(seconds);
    w.u32(0);
    w.string(frame);
}

fn state(seconds: i32, angles: [f64; 2]) -> Vec<u8> {
    let mut w = Writer::default();
    head(&mut w, seconds, "");
    w.length(2);
    w.string("left_wheel_joint");
    w.string("right_wheel_joint");
    w.f64s(&angles);
    w.f64s(&[]);
    w.f64s(&[]);
    w.finish()
}

/// At (x, 0), turned a quarter to the left.
fn place(w: &mut Writer, x: f64) {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    w.f64_array(&[x, 0.0, 0.0, 0.0, 0.0, half, half]);
}

fn stamped(seconds: i32, x: f64, behind: usize) -> Vec<u8> {
    let mut w = Writer::default();
    head(&mut w, seconds, "map");
    place(&mut w, x);
    w.f64_array(&vec![0.0; behind]);
    w.finish()
}

fn transforms(seconds: i32, edges: &[(&str, &str, f64)]) -> Vec<u8> {
    let mut w = Writer::default();
    w.length(edges.len());
    for (parent, child, x) in edges {
        head(&mut w, seconds, parent);
        w.string(child);
        place(&mut w, *x);
    }
    w.finish()
}

/// A bag of joint states at 10 s and 11 s and of messages beside: topic, type, log time (s) and bytes.
fn bag(messages: &[(&str, &str, u64, Vec<u8>)]) -> Vec<u8> {
    let mut writer = ::mcap::Writer::new(Cursor::new(Vec::new())).expect("memory");
    let states = [10, 11].map(|at| ("/joint_states", "sensor_msgs/msg/JointState", at, state(at as i32, [1.0, 2.0])));
    for (topic, kind, at, bytes) in states.iter().chain(messages) {
        let schema = writer.add_schema(kind, "ros2msg", b"").expect("memory");
        let channel_id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).expect("memory");
        let log_time = at * 1_000_000_000;
        let header = ::mcap::records::MessageHeader { channel_id, sequence: 0, log_time, publish_time: log_time };
        writer.write_to_known_channel(&header, bytes).expect("memory");
    }
    writer.finish().expect("memory");
    writer.into_inner().into_inner()
}

fn read(messages: &[(&str, &str, u64, Vec<u8>)], (model, drive): &Robot, poses: Option<&str>) -> Result<Log, BagError> {
    read_mcap(&bag(messages), model, drive, Topics { wheels: "/joint_states", poses, base_frame: None })
}

const TF: &str = "tf2_msgs/msg/TFMessage";

#[test]
fn every_kind_of_pose_is_read_on_the_wheels_clock() {
    for (kind, behind) in [("geometry_msgs/msg/PoseStamped", 0), ("geometry_msgs/msg/PoseWithCovarianceStamped", 36)] {
        let message = ("/seen", kind, 99, stamped(12, 3.0, behind));
        let log = read(&[message], &robot(URDF), Some("/seen")).expect("a log");
        assert_eq!(log.wheels, [(0.0, [1.0, 2.0]), (1.0, [1.0, 2.0])]);
        let [(time, pose)] = log.poses[..] else { panic!("one pose") };
        assert!(time == 2.0 && pose.x == 3.0 && (pose.yaw - std::f64::consts::FRAC_PI_2).abs() < 1e-12, "{pose:?}");
    }
    // Without a stamp of its own: when it was recorded.
    let message = ("/seen", "geometry_msgs/msg/PoseStamped", 13, stamped(0, 3.0, 0));
    assert_eq!(read(&[message], &robot(URDF), Some("/seen")).expect("a log").poses[0].0, 3.0);
}

#[test]
fn wheels_whose_axes_point_to_the_right_count_the_other_way() {
    let turned = URDF.replace("<axis xyz=\"0 1 0\"/>", "<axis xyz=\"0 -1 0\"/>");
    assert_ne!(turned, URDF);
    let message = ("/seen", "geometry_msgs/msg/PoseStamped", 12, stamped(12, 3.0, 0));
    let log = read(&[message], &robot(&turned), Some("/seen")).expect("a log");
    assert_eq!(log.wheels[0].1, [-1.0, -2.0]);
}

#[test]
fn poses_of_a_root_link_off_the_axle_become_those_of_the_base() {
    let (mut model, drive) = robot(URDF);
    // The root link is 0.2 m ahead of the axle: turned a quarter to the left, the axle is 0.2 m behind in y.
    model.base_from_root = Isometry3::translation(0.2, 0.0, 0.1);
    let root = model.root_link.clone();
    let message = ("/tf", TF, 12, transforms(12, &[("map", &root, 3.0)]));
    let log = read(&[message], &(model, drive), None).expect("a log");
    let pose = log.poses[0].1;
    assert!((pose.x - 3.0).abs() < 1e-12 && (pose.y + 0.2).abs() < 1e-12, "{pose:?}");
}

#[test]
fn transforms_are_joined_from_the_base_up_and_static_ones_count() {
    let messages = [
        ("/tf_static", TF, 10, transforms(10, &[("base_footprint", "base_link", 0.5)])),
        ("/tf", TF, 11, transforms(11, &[("odom", "base_footprint", 9.0)])), // map -> odom is not known yet
        ("/tf", TF, 12, transforms(12, &[("map", "odom", 1.0), ("base_link", "camera", 7.0)])),
        ("/tf", TF, 13, transforms(13, &[("odom", "base_footprint", 2.0)])),
    ];
    let (mut model, drive) = robot(URDF);
    model.root_link = "base_link".into();
    model.base_from_root = Isometry3::identity();
    let log = read(&messages, &(model, drive), None).expect("a log");
    let [(time, pose)] = log.poses[..] else { panic!("one pose: {:?}", log.poses) };
    // (1, 0), a quarter turn, 2 m on, a quarter turn, 0.5 m on, a quarter turn.
    let yaw = -std::f64::consts::FRAC_PI_2;
    assert!(time == 3.0 && (pose.x - 0.5).abs() < 1e-12 && (pose.y - 2.0).abs() < 1e-12, "{pose:?}");
    assert!((pose.yaw - yaw).abs() < 1e-12);
}

#[test]
fn transforms_that_go_round_and_messages_that_lie_come_to_an_end() {
    let round = ("/tf", TF, 12, transforms(12, &[("a", "base_link", 1.0), ("base_link", "a", 1.0)]));
    assert!(read(&[round], &robot(URDF), None).is_ok());
    let short = ("/odom", "nav_msgs/msg/Odometry", 12, stamped(12, 1.0, 0));
    assert!(matches!(read(&[short], &robot(URDF), None), Err(BagError::Message { index: 0, .. })));
    let long = ("/seen", "geometry_msgs/msg/PoseStamped", 12, stamped(12, 1.0, 2));
    assert!(matches!(read(&[long], &robot(URDF), Some("/seen")), Err(BagError::Message { .. })));
}
