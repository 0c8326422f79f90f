//! A ROS 2 node that subscribes by DDS. Discovery is multicast, which not every machine lets through: where two nodes of this process do not
//! find each other, the test says so and ends.

use std::net::UdpSocket;
use std::time::{Duration, Instant};

use ros2_client::qos::{Durability, History, Reliability, WhenFull};
use ros2_client::{
    Context, ContextOptions, MessageTypeName, Name, Node, NodeName, NodeOptions, Publisher, QosProfile, Subscription,
};
use serde::{Deserialize, Serialize};

use super::*;
use trajc::geom::Pose2;
use trajc::math::real;

/// Another domain than a robot's.
const DOMAIN: u16 = 113;

#[derive(Debug, Serialize, Deserialize)]
struct Time {
    sec: i32,
    nanosec: u32,
}

#[derive(Debug, Serialize, Deserialize)]
struct Header {
    stamp: Time,
    #[allow(dead_code)]
    frame_id: String,
}

#[derive(Deserialize)]
struct TwistStamped {
    header: Header,
    /// Linear x, y, z, angular x, y, z.
    twist: [f64; 6],
}

fn node(name: &str) -> Node {
    let context = Context::with_options(ContextOptions::new().domain_id(DOMAIN)).expect("a participant");
    let options = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
    context.new_node(NodeName::new("/", name).expect("a name"), options).expect("a node")
}

fn qos(durability: Durability) -> QosProfile {
    QosProfile::subscription_default()
        .reliability(Reliability::Reliable { when_full: WhenFull::Fail })
        .durability(durability)
        .history(History::KeepLast { depth: 1000 })
}

fn subscribe<T: for<'a> Deserialize<'a> + 'static>(
    node: &mut Node,
    topic: &str,
    [package, kind]: [&str; 2],
    durability: Durability,
) -> Subscription<T> {
    let qos = qos(durability);
    let name = Name::parse(topic).expect("a name");
    let topic = node.create_topic(&name, MessageTypeName::new(package, kind), &qos).expect("a topic");
    node.create_subscription(&topic, Some(qos)).expect("a subscription")
}

/// Whether nodes find each other here.
fn nodes_meet() -> bool {
    let (mut one, other) = (node("one"), node("other"));
    let _listening: Subscription<String> =
        subscribe(&mut one, "/trajc_canary", ["std_msgs", "String"], Durability::Volatile);
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(10) {
        if other.subscription_count("/trajc_canary") > 0 {
            return true;
        }
        std::thread::sleep(Duration::from_millis(50));
    }
    false
}

#[test]
fn a_ros_2_node_gets_every_command_and_the_latched_description() {
    if !nodes_meet() {
        println!(
            "SKIPPED: no multicast here, so DDS discovers nobody (try it in a network namespace, docs/playback.md)"
        );
        return;
    }
    let sandbox = compiled();
    let mut listener = node("listener");
    let twists: Subscription<TwistStamped> =
        subscribe(&mut listener, "/base/cmd_vel", ["geometry_msgs", "TwistStamped"], Durability::Volatile);
    let domain = DOMAIN.to_string();
    let child = start(
        &sandbox,
        &[
            "play",
            "out/a/commands.csv",
            "--to",
            "ros2",
            "--domain",
            &domain,
            "--wait",
            "60",
            "--remap",
            "/cmd_vel:=/base/cmd_vel",
        ],
    );
    let (mut heard, mut described): (Vec<[f64; 2]>, Option<Subscription<String>>) = (Vec::new(), None);
    let mut description = None;
    let begun = Instant::now();
    let wanted = super::twists(&sandbox);
    while heard.len() < wanted.len() && begun.elapsed() < Duration::from_secs(120) {
        while let Ok(Some((message, _))) = twists.take() {
            assert_eq!((message.header.stamp.sec, message.header.stamp.nanosec), (0, 0));
            heard.push([message.twist[0], message.twist[5]]);
            heard.dedup();
        }
        if heard.len() == 3 && described.is_none() {
            // It comes late on purpose.
            described = Some(subscribe(
                &mut listener,
                "/robot_description",
                ["std_msgs", "String"],
                Durability::TransientLocal,
            ));
        }
        if let Some(Ok(Some((text, _)))) = described.as_ref().map(Subscription::take) {
            description = Some(text);
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let (code, _, stderr) = end(child);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(heard, wanted);
    assert!(description.is_some_and(|text| text.contains("<robot")), "no description for who came late");
}

#[derive(Debug, Serialize)]
struct Odometry {
    header: Header,
    child_frame_id: String,
    pose: [f64; 7],
    pose_covariance: [[f64; 6]; 6],
    twist: [f64; 6],
    twist_covariance: [[f64; 6]; 6],
}

/// Odometry of a base in the plane, on a clock of its own.
fn odometry(pose: Pose2, time: f64) -> Odometry {
    let stamp = Time { sec: 1000 + time as i32, nanosec: (time.fract() * 1e9) as u32 };
    let (sin, cos) = real::sin_cos(0.5 * pose.yaw);
    Odometry {
        header: Header { stamp, frame_id: "map".to_owned() },
        child_frame_id: "base_footprint".to_owned(),
        pose: [pose.x, pose.y, 0.0, 0.0, 0.0, sin, cos],
        pose_covariance: [[0.0; 6]; 6],
        twist: [0.0; 6],
        twist_covariance: [[0.0; 6]; 6],
    }
}

#[test]
fn odometry_from_dds_keeps_a_base_on_its_path() {
    if !nodes_meet() {
        println!("SKIPPED: no multicast here, so DDS discovers nobody");
        return;
    }
    let sandbox = compiled();
    let mut base = node("base");
    let name = Name::parse("/base/odom").expect("a name");
    let topic = base
        .create_topic(&name, MessageTypeName::new("nav_msgs", "Odometry"), &qos(Durability::Volatile))
        .expect("a topic");
    let publisher: Publisher<Odometry> =
        base.create_publisher(&topic, Some(qos(Durability::Volatile))).expect("a publisher");
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
    socket.set_read_timeout(Some(Duration::from_millis(5))).expect("set");
    let to = format!("udp://{}", socket.local_addr().expect("an address"));
    let domain = DOMAIN.to_string();
    let args = [
        "play",
        "out/a/commands.csv",
        "--to",
        &to,
        "--feedback",
        "ros2:/base/odom",
        "--domain",
        &domain,
        "--wait",
        "60",
    ];
    let mut child = start(&sandbox, &[&args[..], &["--json", "--lost-after", "5"]].concat());

    // The right wheel is a little larger than the file has it: without poses the base ends elsewhere.
    let text = sandbox.text("out/a/commands.csv");
    let (table, _) = trajc::emit::csv::read("commands.csv", &text).expect("a command file");
    let (mut pose, mut twist, mut bytes) = (table.rows[0].pose, [0.0; 2], [0; 4096]);
    let (begun, mut last, mut said) = (Instant::now(), 0.0, -1.0);
    loop {
        if let Ok(length) = socket.recv(&mut bytes) {
            let command: serde_json::Value = serde_json::from_slice(&bytes[..length]).expect("JSON");
            twist = ["v_mps", "omega_rad_s"].map(|key| command[key].as_f64().expect("a number"));
        }
        let now = begun.elapsed().as_secs_f64();
        pose = pose.after_twist(twist[0], twist[1] + 0.01 * twist[0], now - last);
        last = now;
        if now - said >= 0.05 {
            publisher.publish(odometry(pose, now)).expect("published");
            said = now;
        }
        if now > 120.0 || child.try_wait().expect("a child").is_some() {
            break;
        }
    }
    let (code, stdout, stderr) = end(child);
    assert_eq!(code, 0, "{stdout}{stderr}");
    let goal = table.rows[table.rows.len() - 1].pose;
    assert!(pose.distance(goal) < 0.05, "{pose:?} instead of {goal:?}");
}
