//! `calibrate` end to end: a log as CSV and as a ROS 2 bag, robot.yaml before and after.

use std::collections::BTreeMap;
use std::io::Cursor;

use mcap::Writer;
use mcap::records::MessageHeader;
use serde_json::Value;
use trajc::emit::cdr;
use trajc::geom::Pose2;
use trajc::math::real;

use super::sandbox::{Sandbox, golden};

/// Radii of the left and the right wheel and the track of the robot that is driven; its robot.yaml says 0.08, 0.08 and 0.32.
const TRUE: [f64; 3] = [0.0806, 0.0805, 0.3232];
const ROBOT: &str = "robots/box_base/robot.yaml";
const JOINTS: [&str; 2] = ["left_wheel_joint", "right_wheel_joint"];
/// Between rows, s: no whole number of them is the time between poses that are compared, where rounding would decide.
const STEP: f64 = 0.052;
/// Time of the first row of the bags, ns.
const EPOCH: u64 = 1_700_000_000_000_000_000;

/// Time (s), wheel angles and pose, every [`STEP`]: straight, spins and bends to both sides, twice. Positions are off by up to a millimetre.
fn drive() -> Vec<(f64, [f64; 2], Pose2)> {
    let motions = [[4.0, 4.0], [-2.0, 2.0], [2.0, -2.0], [3.0, 4.5], [4.5, 3.0], [-3.0, 3.0], [3.0, -3.0]];
    let (mut pose, mut angles, mut rows) = (Pose2::new(1.0, 2.0, 0.3), [0.0; 2], Vec::new());
    for k in 0..40 * 2 * motions.len() {
        let rate: [f64; 2] = motions[k / 40 % motions.len()];
        let off = |n: usize| 1e-3 * ((k * n % 17) as f64 / 8.0 - 1.0);
        rows.push((STEP * k as f64, angles, Pose2::new(pose.x + off(5), pose.y + off(7), pose.yaw)));
        let [left, right] = [0, 1].map(|side| TRUE[side] * rate[side]);
        pose = pose.after_twist(0.5 * (left + right), (right - left) / TRUE[2], STEP);
        (0..2).for_each(|side| angles[side] += STEP * rate[side]);
    }
    rows
}

fn csv() -> String {
    let mut text = "time_s,wheel_left_rad,wheel_right_rad,x_m,y_m,yaw_rad\n".to_owned();
    for (time, [left, right], pose) in drive() {
        text += &format!("{time},{left},{right},{},{},{}\n", pose.x, pose.y, pose.yaw);
    }
    text
}

fn header(w: &mut cdr::Writer, time: f64, frame: &str) {
    let stamp = EPOCH + (time * 1e9).round() as u64;
    w.i32((stamp / 1_000_000_000) as i32);
    w.u32((stamp % 1_000_000_000) as u32);
    w.string(frame);
}

fn place(w: &mut cdr::Writer, pose: Pose2) {
    let (sin, cos) = real::sin_cos(0.5 * pose.yaw);
    w.f64_array(&[pose.x, pose.y, 0.0, 0.0, 0.0, sin, cos]);
}

fn joint_state(time: f64, names: &[&str], positions: &[f64]) -> Vec<u8> {
    let mut w = cdr::Writer::default();
    header(&mut w, time, "");
    w.length(names.len());
    names.iter().for_each(|name| w.string(name));
    w.f64s(positions);
    w.f64s(&[]);
    w.f64s(&[]);
    w.finish()
}

fn odometry(time: f64, pose: Pose2) -> Vec<u8> {
    let mut w = cdr::Writer::default();
    header(&mut w, time, "odom");
    w.string("base_footprint");
    place(&mut w, pose);
    w.f64_array(&[0.0; 36 + 6 + 36]);
    w.finish()
}

fn transform(time: f64, [parent, child]: [&str; 2], pose: Pose2) -> Vec<u8> {
    let mut w = cdr::Writer::default();
    w.length(1);
    header(&mut w, time, parent);
    w.string(child);
    place(&mut w, pose);
    w.finish()
}

/// A bag of the drive; `others(time, pose)`: topic, type and bytes of messages beside the joint states.
fn bag(others: impl Fn(f64, Pose2) -> Vec<(&'static str, &'static str, Vec<u8>)>) -> Vec<u8> {
    let mut writer = Writer::new(Cursor::new(Vec::new())).expect("memory");
    for (time, angles, pose) in drive() {
        let mut messages = others(time, pose);
        // Another node's joints come in messages of their own.
        messages.push(("/joint_states", "sensor_msgs/msg/JointState", joint_state(time, &["lamp"], &[0.1])));
        let names = [JOINTS[1], "lamp", JOINTS[0]];
        let state = joint_state(time, &names, &[angles[1], 0.1, angles[0]]);
        messages.push(("/joint_states", "sensor_msgs/msg/JointState", state));
        for (topic, kind, bytes) in messages {
            let schema = writer.add_schema(kind, "ros2msg", b"").expect("memory");
            let channel_id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).expect("memory");
            let log_time = EPOCH + (time * 1e9) as u64 + 3_000_000;
            let head = MessageHeader { channel_id, sequence: 0, log_time, publish_time: log_time };
            writer.write_to_known_channel(&head, &bytes).expect("memory");
        }
    }
    writer.finish().expect("memory");
    writer.into_inner().into_inner()
}

fn odom_bag() -> Vec<u8> {
    bag(|time, pose| vec![("/odom", "nav_msgs/msg/Odometry", odometry(time, pose))])
}

/// The same poses by way of `map` -> `odom` -> `base_link`, the first of which comes now and then.
fn tf_bag() -> Vec<u8> {
    let origin = Pose2::new(0.4, -0.2, 0.7);
    bag(move |time, pose| {
        let seen = origin.isometry().inverse() * pose.isometry();
        let own = Pose2::new(seen.translation.x, seen.translation.y, pose.yaw - origin.yaw);
        let mut out = Vec::new();
        if ((time / STEP).round() as u64).is_multiple_of(10) {
            out.push(("/tf", "tf2_msgs/msg/TFMessage", transform(time, ["map", "odom"], origin)));
        }
        out.push(("/tf", "tf2_msgs/msg/TFMessage", transform(time, ["odom", "base_footprint"], own)));
        out
    })
}

/// What is left of robot.yaml without what a calibration writes.
fn rest(text: &str) -> String {
    let cut = |text: &str, key: &str| match text.split_once(key) {
        Some((head, tail)) => {
            format!("{head}{key}{}", tail.trim_start_matches(|c: char| c.is_ascii_digit() || c == '.'))
        }
        None => text.to_owned(),
    };
    let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with("tolerance:")).collect();
    let text = cut(&cut(&lines.join("\n"), "wheel_radius_m: "), "track_width_m: ");
    // A new key.
    match text.split_once("wheel_difference: ") {
        Some((head, tail)) => head.to_owned() + tail.split_once(", ").map_or("", |(_, rest)| rest),
        None => text,
    }
}

#[test]
fn csv_and_bags_give_the_same_calibration_and_only_its_keys_change() {
    let mut written = Vec::new();
    for (name, bytes) in [("log.csv", csv().into_bytes()), ("odom.mcap", odom_bag()), ("tf.mcap", tf_bag())] {
        let sandbox = Sandbox::new();
        sandbox.write(name, bytes);
        let before = sandbox.text(ROBOT);
        let dry = sandbox.run(&["calibrate", name, "--robot", ROBOT, "--dry-run"]).expect(0);
        assert_eq!(sandbox.text(ROBOT), before, "{name}: a dry run writes nothing");
        let told = sandbox.run(&["calibrate", name, "--robot", ROBOT, "--json", "--dry-run"]).expect(0).stdout;
        let told: Value = serde_json::from_str(&told).expect("JSON");
        let found =
            [&told["wheel_radius_m"]["left"], &told["wheel_radius_m"]["right"], &told["track_width_m"]["value"]];
        for ((found, wanted), share) in found.into_iter().zip(TRUE).zip([1e-3, 1e-3, 2e-3]) {
            let found = found.as_f64().expect("a number");
            assert!((found / wanted - 1.0).abs() < share, "{name}: {found} instead of {wanted}");
        }
        sandbox.run(&["calibrate", name, "--robot", ROBOT]).expect(0);
        let after = sandbox.text(ROBOT);
        assert_ne!(after, before);
        assert_eq!(rest(&after), rest(&before), "{name}");
        for line in after.lines().filter(|line| !before.contains(*line)) {
            assert!(dry.stdout.contains(line), "{name}: a dry run tells `{line}`:\n{}", dry.stdout);
        }
        sandbox.run(&["inspect", ROBOT]).expect(0);
        written.push(after);
    }
    assert_eq!(written[1], written[0]);
    assert_eq!(written[2], written[0]);
}

#[test]
fn what_a_log_lacks_is_said_with_what_to_do() {
    let sandbox = Sandbox::new();
    let both = |time, pose| {
        vec![
            ("/odom", "nav_msgs/msg/Odometry", odometry(time, pose)),
            ("/tf", "tf2_msgs/msg/TFMessage", transform(time, ["map", "camera"], pose)),
        ]
    };
    sandbox.write("both.mcap", bag(both));
    sandbox.write("none.mcap", bag(|_, _| Vec::new()));
    sandbox.write("cut.mcap", &odom_bag()[..5000]);
    let mut said = String::new();
    for words in [
        &["both.mcap"][..],
        &["both.mcap", "--poses", "/tf"],
        &["both.mcap", "--poses", "/tf", "--base-frame", "torso"],
        &["both.mcap", "--poses", "/joint_states"],
        &["both.mcap", "--poses", "/pose"],
        &["both.mcap", "--poses", "/odom", "--wheels", "/wheels"],
        &["none.mcap"],
        &["cut.mcap"],
    ] {
        let run = sandbox.run(&[&["calibrate", "--robot", ROBOT], words].concat()).expect(2);
        assert_eq!(run.stdout, "");
        said += &run.stderr;
    }
    golden("calibrate_bags", &said);
    sandbox.run(&["calibrate", "--robot", ROBOT, "both.mcap", "--poses", "/odom", "--dry-run"]).expect(0);
    sandbox
        .run(&["calibrate", "--robot", ROBOT, "both.mcap", "--poses", "/tf", "--base-frame", "camera", "--dry-run"])
        .expect(0);
}

#[test]
fn poses_made_of_the_wheels_angles_are_suspected() {
    let sandbox = Sandbox::new();
    let mut text = "time_s,wheel_left_rad,wheel_right_rad,x_m,y_m,yaw_rad\n".to_owned();
    let mut pose = Pose2::default();
    let mut before = [0.0; 2];
    for (time, angles, _) in drive() {
        let rims = [0, 1].map(|side| 0.08 * (angles[side] - before[side]));
        pose = pose.after_twist(0.5 * (rims[0] + rims[1]), (rims[1] - rims[0]) / 0.32, 1.0);
        before = angles;
        text += &format!("{time},{},{},{},{},{}\n", angles[0], angles[1], pose.x, pose.y, pose.yaw);
    }
    sandbox.write("log.csv", text);
    let run = sandbox.run(&["calibrate", "log.csv", "--robot", ROBOT, "--dry-run"]).expect(0);
    assert!(run.stderr.contains("are its poses made of the wheels' angles?"), "{}", run.stderr);
    sandbox.write("true.csv", csv());
    let run = sandbox.run(&["calibrate", "true.csv", "--robot", ROBOT, "--dry-run"]).expect(0);
    assert_eq!(run.stderr, "");
}
