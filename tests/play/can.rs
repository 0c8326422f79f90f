//! A TRACER base at the other end of a CAN tunnel in UDP.

use std::net::{SocketAddr, UdpSocket};
use std::time::{Duration, Instant};

use super::*;

/// A base: answers 0x211 and 0x221, and keeps what it was sent.
struct Base {
    socket: UdpSocket,
    player: SocketAddr,
    mode: u8,
    vehicle: u8,
    /// Identifier and data of each frame.
    heard: Vec<(u32, Vec<u8>)>,
}

/// A tunnel's datagram with one frame.
fn datagram(id: u32, data: &[u8]) -> Vec<u8> {
    [&[2, 0, 0, 0, 1][..], &id.to_be_bytes(), &[data.len() as u8], data].concat()
}

impl Base {
    fn new(vehicle: u8) -> (Self, String) {
        let port = |socket: &UdpSocket| socket.local_addr().expect("an address").port();
        let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
        // The player's own port: free a moment ago.
        let local = port(&UdpSocket::bind("127.0.0.1:0").expect("a port"));
        let to = format!("can:udp://127.0.0.1:{}?local={local}", port(&socket));
        socket.set_read_timeout(Some(Duration::from_millis(10))).expect("a timeout");
        let player = ([127, 0, 0, 1], local).into();
        (Self { socket, player, mode: 0, vehicle, heard: Vec::new() }, to)
    }

    /// Works until the player has ended.
    fn serve(&mut self, child: &mut Child) {
        let (mut bytes, mut due) = ([0; 512], Instant::now());
        while child.try_wait().expect("a child").is_none() {
            if Instant::now() >= due {
                due += Duration::from_millis(20);
                // The player may not be there yet, or no more.
                let _ =
                    self.socket.send_to(&datagram(0x211, &[self.vehicle, self.mode, 0, 252, 0, 0, 0, 0]), self.player);
                let _ = self.socket.send_to(&datagram(0x221, &[0; 8]), self.player);
            }
            let Ok(length) = self.socket.recv(&mut bytes) else { continue };
            assert_eq!((bytes[0], bytes[1], bytes[3], bytes[4]), (2, 0, 0, 1), "one frame a datagram");
            let id = u32::from_be_bytes([bytes[5], bytes[6], bytes[7], bytes[8]]);
            let data = bytes[10..length].to_vec();
            assert_eq!(usize::from(bytes[9]), data.len());
            if id == 0x421 {
                self.mode = data[0];
            }
            self.heard.push((id, data));
        }
    }

    /// Speeds and turn rates commanded, m/s and rad/s.
    fn motions(&self) -> Vec<[f64; 2]> {
        let value = |a: u8, b: u8| f64::from(i16::from_be_bytes([a, b])) * 1e-3;
        let motions = self.heard.iter().filter(|(id, _)| *id == 0x111);
        motions.map(|(_, d)| [value(d[0], d[1]), value(d[2], d[3])]).collect()
    }
}

#[test]
fn a_base_is_driven_and_left_at_zero() {
    let sandbox = compiled();
    let (mut base, to) = Base::new(0);
    let mut child = start(&sandbox, &["play", "out/a/commands.csv", "--to", &to, "--start-at", "9"]);
    base.serve(&mut child);
    let (code, _, stderr) = end(child);
    assert_eq!(code, 0, "{stderr}");
    assert_eq!(base.heard[0], (0x421, vec![1]));
    assert!(base.heard[1..].iter().all(|(id, data)| *id == 0x111 && data.len() == 8 && data[4..] == [0; 4]));
    let motions = base.motions();
    assert!(motions.iter().any(|[v, _]| *v > 0.05));
    assert!(motions.iter().rev().take_while(|motion| **motion == [0.0, 0.0]).count() >= 20, "zero for half a second");
}

#[test]
fn a_base_in_trouble_is_not_driven() {
    let sandbox = compiled();
    let (mut base, to) = Base::new(1);
    let mut child = start(&sandbox, &["play", "out/a/commands.csv", "--to", &to]);
    base.serve(&mut child);
    let (code, _, stderr) = end(child);
    assert_eq!(code, 2);
    assert!(stderr.contains("emergency stop"), "{stderr}");
    assert!(base.motions().is_empty());
}

#[test]
fn nobody_on_the_bus_and_joints_that_move_are_refused() {
    let sandbox = compiled();
    let nobody = UdpSocket::bind("127.0.0.1:0").expect("a port");
    let to = format!("can:udp://{}", nobody.local_addr().expect("an address"));
    let run = sandbox.run(&["play", "out/a/commands.csv", "--to", &to]).expect(2);
    assert!(run.stderr.contains("no 0x211 within 0.2 s"), "{}", run.stderr);
    sandbox.ship("maps/arch_bridges.pcd");
    sandbox.ship("missions/arch_bridges.yaml");
    sandbox.run(&["compile", "missions/arch_bridges.yaml"]).expect(0);
    let run = sandbox.run(&["play", "out/arch_bridges/commands.csv", "--to", &to]).expect(2);
    assert!(run.stderr.contains("joint `blade` moves") && run.stderr.contains("--joints"), "{}", run.stderr);
}
