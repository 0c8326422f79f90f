//! A ROS 2 node that subscribes by DDS. Discovery is multicast, which not every machine lets through: where two nodes of this process do not
//! find each other, the test says so and ends.

use std::time::{Duration, Instant};

use ros2_client::qos::{Durability, History, Reliability, WhenFull};
use ros2_client::{
    Context, ContextOptions, MessageTypeName, Name, Node, NodeName, NodeOptions, QosProfile, Subscription,
};
use serde::Deserialize;

use super::*;

/// Another domain than a robot's.
const DOMAIN: u16 = 113;

#[derive(Deserialize)]
struct Time {
    sec: i32,
    nanosec: u32,
}

#[derive(Deserialize)]
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
