//! A ROS 2 node on DDS.

use std::time::Duration;

use ros2_client::qos::{Durability, History, Reliability, WhenFull};
use ros2_client::{Context, ContextOptions, MessageTypeName, Name, Node, NodeName, NodeOptions, Publisher, QosProfile};
use serde::ser::{Serialize, SerializeTuple, Serializer};

use super::topics::{Topic, Transport, awaited};
use crate::play::clock::{Clock, MonotonicClock};
use crate::play::sink::SinkError;

/// Between the first subscriber's discovery and the first message, s: other topics are discovered at about the same time, each on its own,
/// and both sides must know of each other.
const SETTLE: f64 = 1.0;
/// How long a write may wait for a subscriber that does not keep up.
const FULL: Duration = Duration::from_millis(1);
/// Behind the last message, for subscribers to get what they missed.
const LINGER: Duration = Duration::from_millis(500);

/// A message that is CDR already, without its head: written as it is.
struct Cdr(Vec<u8>);

impl Serialize for Cdr {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        // A tuple of bytes has neither length nor padding in CDR.
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        self.0.iter().try_for_each(|byte| tuple.serialize_element(byte))?;
        tuple.end()
    }
}

/// A node and its publishers.
pub struct Ros2 {
    publishers: Vec<Publisher<Cdr>>,
    node: Node,
    awaited: String,
    wait: f64,
}

impl Ros2 {
    /// Joins a domain, and waits for a subscriber for so many seconds.
    ///
    /// # Errors
    /// DDS cannot start.
    pub fn new(domain: u16, topics: &[Topic], wait: f64) -> Result<Self, SinkError> {
        let not_ready = |error: String| SinkError::NotReady(format!("no ROS 2 node on domain {domain}: {error}"));
        let context =
            Context::with_options(ContextOptions::new().domain_id(domain)).map_err(|e| not_ready(e.to_string()))?;
        let name = NodeName::new("/", "trajc").map_err(|e| not_ready(e.to_string()))?;
        let options = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
        let mut node = context.new_node(name, options).map_err(|e| not_ready(e.to_string()))?;
        let mut publishers = Vec::new();
        for topic in topics {
            let name = Name::parse(&topic.name).map_err(|e| not_ready(format!("topic {}: {e}", topic.name)))?;
            let (package, kind) = topic.package_and_type();
            let durability = if topic.latched() { Durability::TransientLocal } else { Durability::Volatile };
            let qos = QosProfile::publisher_default()
                .reliability(Reliability::Reliable { when_full: WhenFull::Wait(FULL) })
                .durability(durability)
                .history(History::KeepLast { depth: topic.depth() as usize });
            let made = node.create_topic(&name, MessageTypeName::new(package, kind), &qos);
            let publisher = made.and_then(|topic| node.create_publisher(&topic, Some(qos)));
            publishers.push(publisher.map_err(|e| not_ready(format!("topic {}: {e}", topic.name)))?);
        }
        Ok(Self { publishers, node, awaited: topics[awaited(topics)].name.clone(), wait })
    }

    fn subscribers(&self) -> usize {
        self.node.subscription_count(&self.awaited)
    }
}

impl Transport for Ros2 {
    fn ready(&mut self, interrupted: &dyn Fn() -> bool) -> Result<(), SinkError> {
        let mut clock = MonotonicClock::new();
        while self.subscribers() == 0 {
            if clock.now() > self.wait {
                let message = format!("nobody subscribed to {} on DDS within {} s", self.awaited, self.wait);
                return Err(SinkError::NotReady(message));
            }
            if !clock.wait(clock.now() + 0.05, interrupted) {
                return Err(SinkError::Interrupted);
            }
        }
        if clock.wait(clock.now() + SETTLE, interrupted) { Ok(()) } else { Err(SinkError::Interrupted) }
    }

    fn publish(&mut self, topic: usize, message: &[u8], _stamp: u64) -> Result<(), SinkError> {
        // The middleware writes the head itself: plain little-endian CDR, as ours.
        let body = message.get(4..).unwrap_or_default().to_vec();
        // A message that a slow subscriber has no room for is dropped: the next one is newer.
        let _ = self.publishers[topic].publish(Cdr(body));
        Ok(())
    }

    fn alive(&mut self) -> Result<(), SinkError> {
        if self.subscribers() > 0 {
            return Ok(());
        }
        Err(SinkError::Lost(format!("nobody subscribes to {} any more", self.awaited)))
    }

    fn finish(&mut self) {
        std::thread::sleep(LINGER);
    }
}
