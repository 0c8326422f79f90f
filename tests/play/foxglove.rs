//! A Foxglove client: as much of a WebSocket (RFC 6455) as it takes.

use std::collections::BTreeMap;
use std::io::{Read, Write};
use std::net::{TcpListener, TcpStream};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::*;

struct Client(TcpStream);

impl Client {
    /// Connects, as soon as somebody listens.
    fn connect(port: u16) -> Self {
        let begun = Instant::now();
        let mut stream = loop {
            match TcpStream::connect(("127.0.0.1", port)) {
                Ok(stream) => break stream,
                Err(error) => assert!(begun.elapsed() < Duration::from_secs(60), "nobody listens: {error}"),
            }
            std::thread::sleep(Duration::from_millis(20));
        };
        stream.set_read_timeout(Some(Duration::from_secs(60))).expect("a timeout");
        let request = format!(
            "GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Key: \
             dGhlIHNhbXBsZSBub25jZQ==\r\nSec-WebSocket-Version: 13\r\nSec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n"
        );
        stream.write_all(request.as_bytes()).expect("written");
        let mut head = Vec::new();
        while !head.ends_with(b"\r\n\r\n") {
            let mut byte = [0];
            stream.read_exact(&mut byte).expect("an answer");
            head.push(byte[0]);
        }
        let head = String::from_utf8(head).expect("text");
        assert!(head.starts_with("HTTP/1.1 101") && head.to_lowercase().contains("foxglove.sdk.v1"), "{head}");
        Self(stream)
    }

    /// The next frame: its kind (1: text, 2: binary) and bytes; `None` at the end.
    fn next(&mut self) -> Option<(u8, Vec<u8>)> {
        let mut head = [0; 2];
        self.0.read_exact(&mut head).ok()?;
        assert_eq!(head[1] & 0x80, 0, "a server does not mask");
        let length = match head[1] {
            126 => {
                let mut bytes = [0; 2];
                self.0.read_exact(&mut bytes).ok()?;
                usize::from(u16::from_be_bytes(bytes))
            }
            127 => {
                let mut bytes = [0; 8];
                self.0.read_exact(&mut bytes).ok()?;
                u64::from_be_bytes(bytes) as usize
            }
            short => usize::from(short),
        };
        let mut data = vec![0; length];
        self.0.read_exact(&mut data).ok()?;
        (head[0] & 0x0f != 8).then_some((head[0] & 0x0f, data))
    }

    fn say(&mut self, message: &Value) {
        let text = message.to_string().into_bytes();
        // Masked with zeros: clients must mask, with whatever.
        let mut frame = vec![0x81, 0x80 | 126];
        frame.extend((text.len() as u16).to_be_bytes());
        frame.extend([0; 4]);
        frame.extend(text);
        self.0.write_all(&frame).expect("written");
    }
}

#[test]
fn a_foxglove_client_gets_every_command_and_what_it_was_too_late_for() {
    let sandbox = compiled();
    let port = TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a port").port();
    let to = format!("foxglove://127.0.0.1:{port}");
    let child = start(&sandbox, &["play", "out/a/commands.csv", "--to", &to, "--wait", "60"]);
    let mut client = Client::connect(port);
    let mut channels: BTreeMap<u64, Value> = BTreeMap::new();
    let mut heard: BTreeMap<String, Vec<Vec<u8>>> = BTreeMap::new();
    let mut late = false;
    while let Some((kind, data)) = client.next() {
        if kind == 1 {
            let message: Value = serde_json::from_slice(&data).expect("JSON");
            for channel in message["channels"].as_array().into_iter().flatten() {
                assert_eq!((&channel["encoding"], &channel["schemaEncoding"]), (&"cdr".into(), &"ros2msg".into()));
                let id = channel["id"].as_u64().expect("a number");
                channels.insert(id, channel.clone());
                if channel["topic"] != "/robot_description" {
                    client.say(&json!({"op": "subscribe", "subscriptions": [{"id": id, "channelId": id}]}));
                }
            }
        } else if kind == 2 && data[0] == 1 {
            let id = u64::from(u32::from_le_bytes([data[1], data[2], data[3], data[4]]));
            let topic = channels[&id]["topic"].as_str().expect("text").to_owned();
            heard.entry(topic).or_default().push(data[13..].to_vec());
            if !late {
                late = true;
                let mut ids = channels.iter().filter(|(_, c)| c["topic"] == "/robot_description");
                let id = ids.next().expect("a channel").0;
                client.say(&json!({"op": "subscribe", "subscriptions": [{"id": id, "channelId": id}]}));
            }
        }
    }
    let (code, _, stderr) = end(child);
    assert_eq!(code, 0, "{stderr}");
    let mut twists: Vec<[f64; 2]> = heard["/cmd_vel"].iter().map(|message| twist(message)).collect();
    twists.dedup();
    assert_eq!(twists, super::twists(&sandbox));
    for topic in ["/robot_description", "/plan", "/wheel_velocity_controller/commands", "/joint_states", "/tf"] {
        assert!(heard.contains_key(topic), "nothing on {topic}");
    }
}
