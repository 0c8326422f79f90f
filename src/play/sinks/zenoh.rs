//! A ROS 2 node as rmw_zenoh (1.x) makes one: keys, attachments and liveliness tokens of its `docs/design.md`.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use ::zenoh::liveliness::LivelinessToken;
use ::zenoh::pubsub::{Publisher, Subscriber};
use ::zenoh::qos::CongestionControl;
use ::zenoh::{Config, Session, Wait};

use super::topics::{Topic, Transport, awaited};
use crate::play::clock::{Clock, MonotonicClock};
use crate::play::sink::SinkError;

/// Between the first subscriber and the first message, s: other topics are declared at about the same time.
const SETTLE: f64 = 0.5;
/// The node's name.
const NODE: &str = "trajc";

struct Channel {
    publisher: Publisher<'static>,
    /// Of the last message; from 1.
    sequence: i64,
    /// XXH3-128 of the publisher's token.
    gid: [u8; 16],
    /// A subscriber appeared since it was looked at; latched topics only.
    asked: Arc<AtomicBool>,
    /// Kept for as long as they are to be known.
    _declared: (LivelinessToken, Option<Subscriber<()>>),
}

/// A session, and a publisher for each topic.
pub struct Zenoh {
    channels: Vec<Channel>,
    _node: LivelinessToken,
    session: Session,
    awaited: usize,
    topic: String,
    wait: f64,
}

impl Zenoh {
    /// Connects to a router, and waits for a subscriber for so many seconds.
    ///
    /// # Errors
    /// No router there.
    pub fn new(endpoint: &str, domain: u16, topics: &[Topic], wait: f64) -> Result<Self, SinkError> {
        let open = || -> ::zenoh::Result<Self> {
            let mut config = Config::default();
            config.insert_json5("mode", "\"client\"")?;
            config.insert_json5("connect/endpoints", &serde_json::json!([endpoint]).to_string())?;
            config.insert_json5("connect/timeout_ms", &format!("{}", (wait * 1e3) as u64))?;
            config.insert_json5("scouting/multicast/enabled", "false")?;
            let session = ::zenoh::open(config).wait()?;
            let zid = session.zid();
            let node = format!("@ros2_lv/{domain}/{zid}/0/0/NN/%/%/{NODE}");
            let node = session.liveliness().declare_token(node).wait()?;
            let channels = topics.iter().enumerate().map(|(index, topic)| {
                // 0 is the node itself.
                let token = format!("@ros2_lv/{domain}/{zid}/0/{}/MP/%/%/{NODE}/{}", index + 1, token_end(topic));
                channel(&session, domain, topic, token)
            });
            let channels = channels.collect::<::zenoh::Result<Vec<_>>>()?;
            let awaited = awaited(topics);
            Ok(Self { channels, _node: node, session, awaited, topic: topics[awaited].name.clone(), wait })
        };
        open().map_err(|error| SinkError::NotReady(format!("no Zenoh router at {endpoint}: {error}")))
    }

    fn matched(&self) -> bool {
        self.channels[self.awaited].publisher.matching_status().wait().is_ok_and(|status| status.matching())
    }
}

/// `geometry_msgs::msg::dds_::TwistStamped_`, for example.
fn dds_type(topic: &Topic) -> String {
    let (package, kind) = topic.package_and_type();
    format!("{package}::msg::dds_::{kind}_")
}

/// The key of a topic's messages.
pub(super) fn data_key(domain: u16, topic: &Topic) -> String {
    format!("{domain}/{}/{}/{}", topic.name.trim_matches('/'), dds_type(topic), topic.type_hash())
}

/// The end of a publisher's token: topic, type, hash, quality of service (what is rmw's default is left empty).
pub(super) fn token_end(topic: &Topic) -> String {
    let durability = if topic.latched() { "1" } else { "" };
    let qos = format!(":{durability}:,{}:,:,:,,", topic.depth());
    format!("{}/{}/{}/{qos}", topic.name.replace('/', "%"), dds_type(topic), topic.type_hash())
}

fn channel(session: &Session, domain: u16, topic: &Topic, token: String) -> ::zenoh::Result<Channel> {
    // Blocking: a link that is full for a moment must lose no command; one that is full for long makes rows late, which stops playback.
    let publisher = session.declare_publisher(data_key(domain, topic));
    let publisher = publisher.congestion_control(CongestionControl::Block).wait()?;
    let gid = xxhash_rust::xxh3::xxh3_128(token.as_bytes()).to_le_bytes();
    let asked = Arc::new(AtomicBool::new(false));
    let late = if topic.latched() {
        let (package_and_more, asked) = (token_end(topic), asked.clone());
        let name = package_and_more.split('/').next().unwrap_or_default();
        let subscribers = format!("@ros2_lv/{domain}/*/*/*/MS/*/*/*/{name}/**");
        let late = session.liveliness().declare_subscriber(subscribers);
        Some(late.callback(move |_| asked.store(true, Ordering::Relaxed)).wait()?)
    } else {
        None
    };
    let token = session.liveliness().declare_token(token).wait()?;
    Ok(Channel { publisher, sequence: 0, gid, asked, _declared: (token, late) })
}

impl Transport for Zenoh {
    fn ready(&mut self, interrupted: &dyn Fn() -> bool) -> Result<(), SinkError> {
        let mut clock = MonotonicClock::new();
        while !self.matched() {
            if clock.now() > self.wait {
                let message = format!("nobody subscribed to {} on Zenoh within {} s", self.topic, self.wait);
                return Err(SinkError::NotReady(message));
            }
            if !clock.wait(clock.now() + 0.02, interrupted) {
                return Err(SinkError::Interrupted);
            }
        }
        if clock.wait(clock.now() + SETTLE, interrupted) { Ok(()) } else { Err(SinkError::Interrupted) }
    }

    fn publish(&mut self, topic: usize, message: &[u8], stamp: u64) -> Result<(), SinkError> {
        let channel = &mut self.channels[topic];
        channel.sequence += 1;
        let mut attachment = Vec::with_capacity(33);
        attachment.extend(channel.sequence.to_le_bytes());
        attachment.extend((stamp as i64).to_le_bytes());
        attachment.push(channel.gid.len() as u8);
        attachment.extend(channel.gid);
        let put = channel.publisher.put(message).attachment(attachment).wait();
        put.map_err(|error| SinkError::Lost(format!("the Zenoh router is gone: {error}")))
    }

    fn asked_again(&mut self) -> Vec<usize> {
        let asked = |channel: &Channel| channel.asked.swap(false, Ordering::Relaxed);
        self.channels.iter().enumerate().filter(|(_, channel)| asked(channel)).map(|(index, _)| index).collect()
    }

    fn alive(&mut self) -> Result<(), SinkError> {
        if self.matched() {
            return Ok(());
        }
        Err(SinkError::Lost(format!("nobody subscribes to {} any more", self.topic)))
    }

    fn finish(&mut self) {
        // Closing waits for what is under way; a fault here changes nothing any more.
        let _ = self.session.close().wait();
    }
}
