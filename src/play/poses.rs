//! Where poses come from, and how they are written: a JSON object each, `{"t": 1.25, "x": 0.5, "y": 1.5, "yaw": 0.1}`, metres and radians in the
//! map's frame, and where joints are measured `"joints": {"arm": 0.3}`.

#[cfg(feature = "ros2")]
pub mod dds;
pub mod ros;

use std::net::UdpSocket;

use serde_json::Value;

use super::sink::SinkError;
use super::tracking::Sighting;
use crate::geom::Pose2;

/// Longest datagram that is read, bytes.
const LONGEST: usize = 64 * 1024;

/// A source of poses that is asked again and again.
pub trait Poses {
    /// The latest pose that has come since the last call, on the clock that shows `now`.
    fn latest(&mut self, now: f64) -> Option<Sighting>;
}

/// What a line that is no pose lacks.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoPose {
    /// Not JSON, or no object.
    #[error("not a JSON object: {0}")]
    Syntax(String),
    /// A key without a number.
    #[error("`{0}` is not a number")]
    Number(&'static str),
}

/// A pose from its JSON, joints in the order of `names`. Stamps are on the sender's clock.
///
/// # Errors
/// No JSON object, or `t`, `x`, `y` or `yaw` is missing or no number.
pub fn parse(text: &str, names: &[(String, bool)]) -> Result<Sighting, NoPose> {
    let value: Value = serde_json::from_str(text).map_err(|error| NoPose::Syntax(error.to_string()))?;
    if !value.is_object() {
        return Err(NoPose::Syntax("another value".to_owned()));
    }
    let number = |key: &'static str| value.get(key).and_then(Value::as_f64).ok_or(NoPose::Number(key));
    let joint = |name: &String| value.get("joints").and_then(|joints| joints.get(name)).and_then(Value::as_f64);
    Ok(Sighting {
        time: number("t")?,
        pose: Pose2::new(number("x")?, number("y")?, number("yaw")?),
        joints: names.iter().map(|(name, _)| joint(name)).collect(),
    })
}

/// Turns stamps of another clock into ours: the least delay seen so far is taken for none, so that delays that vary do no harm.
#[derive(Debug, Clone, Default)]
pub struct Stamps {
    offset: Option<f64>,
}

impl Stamps {
    /// The time here at which a stamp was taken that has come `now`. Never later than now.
    pub fn here(&mut self, stamp: f64, now: f64) -> f64 {
        let offset = self.offset.map_or(now - stamp, |offset| offset.min(now - stamp));
        self.offset = Some(offset);
        stamp + offset
    }
}

/// Poses in UDP datagrams, a JSON object each.
#[derive(Debug)]
pub struct UdpPoses {
    socket: UdpSocket,
    names: Vec<(String, bool)>,
    stamps: Stamps,
}

impl UdpPoses {
    /// Listens at `HOST:PORT`; `names`: the moving joints.
    ///
    /// # Errors
    /// The port cannot be had.
    pub fn new(at: &str, names: &[(String, bool)]) -> Result<Self, SinkError> {
        let not_ready = |error| SinkError::NotReady(format!("cannot listen for poses at udp://{at}: {error}"));
        let socket = UdpSocket::bind(at).map_err(not_ready)?;
        socket.set_nonblocking(true).map_err(not_ready)?;
        Ok(Self { socket, names: names.to_vec(), stamps: Stamps::default() })
    }
}

impl Poses for UdpPoses {
    fn latest(&mut self, now: f64) -> Option<Sighting> {
        let (mut bytes, mut latest) = (vec![0; LONGEST], None);
        while let Ok(length) = self.socket.recv(&mut bytes) {
            // What is no pose is as none: poses that stop coming stop the robot.
            let text = std::str::from_utf8(&bytes[..length]).unwrap_or_default();
            if let Ok(seen) = parse(text, &self.names)
                && seen.time.is_finite()
            {
                latest = Some(Sighting { time: self.stamps.here(seen.time, now), ..seen });
            }
        }
        latest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_is_read_with_the_joints_it_has() {
        let names = [("arm".to_owned(), false), ("lift".to_owned(), true)];
        let seen = parse(r#"{"t": 1.5, "x": 1, "y": -2.5, "yaw": 0.25, "joints": {"lift": 0.1, "other": 7}}"#, &names);
        let expected = Sighting { time: 1.5, pose: Pose2::new(1.0, -2.5, 0.25), joints: vec![None, Some(0.1)] };
        assert_eq!(seen, Ok(expected));
    }

    #[test]
    fn what_is_no_pose_is_refused_with_the_key_that_is_wrong() {
        let refused = |text: &str| parse(text, &[]).expect_err("no pose").to_string();
        assert_eq!(refused(r#"{"t": 1, "x": 1, "y": null, "yaw": 0}"#), "`y` is not a number");
        assert_eq!(refused(r#"{"x": 1, "y": 2, "yaw": 0}"#), "`t` is not a number");
        assert!(refused(r#"{"t": NaN}"#).starts_with("not a JSON object"));
        assert!(refused("[1, 2]").starts_with("not a JSON object"));
    }

    #[test]
    fn stamps_are_held_to_the_least_delay() {
        let mut stamps = Stamps::default();
        // Their clock is 100 s behind; delays of 30, 10 and 50 ms.
        assert!((stamps.here(0.0, 100.03) - 100.03).abs() < 1e-9);
        assert!((stamps.here(0.1, 100.11) - 100.11).abs() < 1e-9);
        assert!((stamps.here(0.2, 100.25) - 100.21).abs() < 1e-9);
    }

    #[test]
    fn datagrams_come_as_the_latest_pose() {
        let mut poses = UdpPoses::new("127.0.0.1:0", &[]).expect("a port");
        let to = poses.socket.local_addr().expect("an address");
        let sender = UdpSocket::bind("127.0.0.1:0").expect("a port");
        assert_eq!(poses.latest(0.0), None);
        for text in [r#"{"t": 1, "x": 1, "y": 2, "yaw": 3}"#, r#"{"t": 2, "x": 4, "y": 5, "yaw": 6}"#, "noise"] {
            sender.send_to(text.as_bytes(), to).expect("sent");
        }
        poses.socket.set_nonblocking(false).expect("set");
        let limit = Some(std::time::Duration::from_millis(200));
        poses.socket.set_read_timeout(limit).expect("set");
        assert_eq!(poses.latest(5.0).map(|seen| seen.pose), Some(Pose2::new(4.0, 5.0, 6.0)));
    }
}
