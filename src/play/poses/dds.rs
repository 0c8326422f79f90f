//! Poses from a ROS 2 robot, by DDS.

use ros2_client::qos::{Durability, History, Reliability};
use ros2_client::{
    Context, ContextOptions, MessageTypeName, Name, Node, NodeName, NodeOptions, QosProfile, Subscription,
};
use serde::Deserialize;

use super::ros::{Frames, Odometry, Transforms};
use super::{Poses, Stamps};
use crate::geom::Pose2;
use crate::play::sink::SinkError;
use crate::play::tracking::Sighting;

/// Messages that wait for us, at most. Only the latest counts.
const DEPTH: usize = 100;

enum Topic {
    Odometry(Subscription<Odometry>),
    Transforms { moving: Subscription<Transforms>, fixed: Subscription<Transforms> },
}

/// A node that listens to `nav_msgs/msg/Odometry`, or to `tf2_msgs/msg/TFMessage` where the topic is `/tf`.
pub struct DdsPoses {
    topic: Topic,
    // Subscriptions live as long as their node.
    _node: Node,
    frames: Frames,
    joints: usize,
    stamps: Stamps,
}

impl DdsPoses {
    /// Joins a domain. `joints`: how many move; where they are is not heard.
    ///
    /// # Errors
    /// DDS cannot start; a name that is no topic's.
    pub fn new(domain: u16, topic: &str, frames: Frames, joints: usize) -> Result<Self, SinkError> {
        let not_ready = |error: String| SinkError::NotReady(format!("no poses from ROS 2 on domain {domain}: {error}"));
        let context =
            Context::with_options(ContextOptions::new().domain_id(domain)).map_err(|e| not_ready(e.to_string()))?;
        let name = NodeName::new("/", "trajc_feedback").map_err(|e| not_ready(e.to_string()))?;
        let options = NodeOptions::new().enable_rosout(false).start_parameter_services(false);
        let mut node = context.new_node(name, options).map_err(|e| not_ready(e.to_string()))?;
        let transforms = ["tf2_msgs", "TFMessage"];
        let made = if topic == "/tf" {
            subscribe(&mut node, topic, transforms, false).and_then(|moving| {
                let fixed = subscribe(&mut node, "/tf_static", transforms, true)?;
                Ok(Topic::Transforms { moving, fixed })
            })
        } else {
            subscribe(&mut node, topic, ["nav_msgs", "Odometry"], false).map(Topic::Odometry)
        };
        let topic = made.map_err(|error| not_ready(format!("topic {topic}: {error}")))?;
        Ok(Self { topic, _node: node, frames, joints, stamps: Stamps::default() })
    }
}

/// `latched`: what was said before is heard too. Otherwise best effort, which hears publishers of both kinds.
fn subscribe<T: for<'a> Deserialize<'a> + 'static>(
    node: &mut Node,
    topic: &str,
    [package, kind]: [&str; 2],
    latched: bool,
) -> Result<Subscription<T>, String> {
    let qos = QosProfile::subscription_default().history(History::KeepLast { depth: DEPTH });
    let qos =
        if latched { qos.durability(Durability::TransientLocal) } else { qos.reliability(Reliability::BestEffort) };
    let name = Name::parse(topic).map_err(|e| e.to_string())?;
    let topic = node.create_topic(&name, MessageTypeName::new(package, kind), &qos).map_err(|e| e.to_string())?;
    node.create_subscription(&topic, Some(qos)).map_err(|e| e.to_string())
}

/// All messages that have come; those that are not of their type are as none.
fn taken<T: for<'a> Deserialize<'a> + 'static>(subscription: &Subscription<T>) -> impl Iterator<Item = T> {
    std::iter::from_fn(|| match subscription.take() {
        Ok(Some((message, _))) => Some(Some(message)),
        Ok(None) => None,
        Err(_) => Some(None),
    })
    .take(DEPTH)
    .flatten()
}

impl Poses for DdsPoses {
    fn latest(&mut self, now: f64) -> Option<Sighting> {
        let (frames, mut latest): (_, Option<(f64, Pose2)>) = (&mut self.frames, None);
        match &self.topic {
            Topic::Odometry(subscription) => {
                latest = taken(subscription).filter_map(|message| frames.odometry(&message)).last();
            }
            Topic::Transforms { moving, fixed } => {
                for message in taken(fixed) {
                    let _ = frames.transforms(&message, true);
                }
                for message in taken(moving) {
                    latest = frames.transforms(&message, false).or(latest);
                }
            }
        }
        let (stamp, pose) = latest?;
        Some(Sighting { time: self.stamps.here(stamp, now), pose, joints: vec![None; self.joints] })
    }
}
