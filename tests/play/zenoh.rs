//! A Zenoh router with a subscriber of `/cmd_vel`, as rmw_zenoh declares one.

use std::net::TcpListener;
use std::sync::{Arc, Mutex};

use zenoh::{Config, Wait};

use super::*;

/// Payload and attachment.
type Message = (Vec<u8>, Vec<u8>);

const TWIST: &str =
    "geometry_msgs::msg::dds_::TwistStamped_/RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64";

#[test]
fn a_router_gets_every_command_under_rmw_zenohs_key_with_its_attachment_and_tokens() {
    let sandbox = compiled();
    let port = TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a port").port();
    let endpoint = format!("tcp/127.0.0.1:{port}");
    let mut config = Config::default();
    for (key, value) in [
        ("mode", "\"router\"".to_owned()),
        ("listen/endpoints", format!("[\"{endpoint}\"]")),
        ("scouting/multicast/enabled", "false".to_owned()),
    ] {
        config.insert_json5(key, &value).expect("a setting");
    }
    let session = zenoh::open(config).wait().expect("a router");
    let heard: Arc<Mutex<Vec<Message>>> = Arc::default();
    let tokens: Arc<Mutex<Vec<String>>> = Arc::default();
    let (into, known) = (heard.clone(), tokens.clone());
    let commands = session.declare_subscriber(format!("7/cmd_vel/{TWIST}")).callback(move |sample| {
        let attachment = sample.attachment().map(|a| a.to_bytes().to_vec()).unwrap_or_default();
        into.lock().expect("no panic").push((sample.payload().to_bytes().to_vec(), attachment));
    });
    let _commands = commands.wait().expect("a subscriber");
    let alive = session.liveliness().declare_subscriber("@ros2_lv/**").history(true);
    let _alive = alive.callback(move |s| known.lock().expect("no panic").push(s.key_expr().to_string())).wait();
    let to = format!("zenoh:{endpoint}");
    let child = start(&sandbox, &["play", "out/a/commands.mcap", "--to", &to, "--domain", "7", "--wait", "60"]);
    let (code, _, stderr) = end(child);
    assert_eq!(code, 0, "{stderr}");
    let heard = heard.lock().expect("no panic");
    let mut twists: Vec<[f64; 2]> = heard.iter().map(|(payload, _)| twist(payload)).collect();
    twists.dedup();
    assert_eq!(twists, super::twists(&sandbox));
    let tokens = tokens.lock().expect("no panic");
    let publisher = tokens.iter().find(|t| t.contains("/MP/") && t.contains("%cmd_vel")).expect("a token");
    assert!(
        publisher.starts_with("@ros2_lv/7/")
            && publisher.ends_with(&format!("/%/%/trajc/%cmd_vel/{TWIST}/::,10:,:,:,,")),
        "{publisher}"
    );
    assert!(tokens.iter().any(|t| t.ends_with("/0/0/NN/%/%/trajc")), "{tokens:?}");
    let gid = xxhash_rust::xxh3::xxh3_128(publisher.as_bytes()).to_le_bytes();
    for (k, (_, attachment)) in heard.iter().enumerate() {
        assert_eq!(attachment.len(), 33);
        assert_eq!(attachment[..8], (k as i64 + 1).to_le_bytes());
        assert_eq!((attachment[16], &attachment[17..]), (16, &gid[..]));
    }
}

#[test]
fn without_a_router_nothing_is_played() {
    let sandbox = compiled();
    let port = TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a port").port();
    let to = format!("zenoh:tcp/127.0.0.1:{port}");
    let run = sandbox.run(&["play", "out/a/commands.csv", "--to", &to, "--wait", "0.5"]).expect(2);
    assert!(run.stderr.contains("no Zenoh router"), "{}", run.stderr);
}
