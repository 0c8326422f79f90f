//! A WebSocket server for Foxglove (subprotocol `foxglove.sdk.v1`): the same encodings and schemas as in `commands.mcap`.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use ::foxglove::websocket::{ChannelView, Client, ServerListener};
use ::foxglove::{
    ChannelBuilder, Context, PartialMetadata, RawChannel, Schema, WebSocketServer, WebSocketServerHandle,
};

use super::topics::{Topic, Transport, awaited};
use crate::play::clock::{Clock, MonotonicClock};
use crate::play::sink::SinkError;

/// Between the first subscription and the first message, s: clients subscribe to several topics one after the other.
const SETTLE: f64 = 0.2;

/// Topics that somebody subscribed to since they were looked at.
#[derive(Default)]
struct Subscribed(Mutex<BTreeSet<String>>);

impl ServerListener for Subscribed {
    fn on_subscribe(&self, _client: Client, channel: ChannelView) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).insert(channel.topic().to_owned());
    }
}

/// A server and its channels.
pub struct Foxglove {
    server: Option<WebSocketServerHandle>,
    /// What server and channels meet in; neither keeps it.
    _context: Arc<Context>,
    channels: Vec<Arc<RawChannel>>,
    /// Indices of latched topics.
    latched: Vec<usize>,
    awaited: usize,
    subscribed: Arc<Subscribed>,
    address: String,
    wait: f64,
}

impl Foxglove {
    /// Listens, and waits for a client for so many seconds.
    ///
    /// # Errors
    /// The port is taken.
    pub fn new(host: &str, port: u16, topics: &[Topic], wait: f64) -> Result<Self, SinkError> {
        let address = format!("ws://{host}:{port}");
        let not_ready = |error: String| SinkError::NotReady(format!("cannot serve on {address}: {error}"));
        let context = Context::new();
        let channels = topics.iter().map(|topic| {
            ChannelBuilder::new(&topic.name)
                .context(&context)
                .message_encoding("cdr")
                .schema(Schema::new(topic.type_name(), "ros2msg", topic.definition().into_bytes()))
                .build_raw()
        });
        let channels = channels.collect::<Result<Vec<_>, _>>().map_err(|error| not_ready(error.to_string()))?;
        let subscribed = Arc::new(Subscribed::default());
        let server =
            WebSocketServer::new().name("trajc").bind(host, port).context(&context).listener(subscribed.clone());
        let server = server.start_blocking().map_err(|error| not_ready(error.to_string()))?;
        Ok(Self {
            server: Some(server),
            _context: context,
            channels,
            latched: topics.iter().enumerate().filter(|(_, topic)| topic.latched()).map(|(index, _)| index).collect(),
            awaited: awaited(topics),
            subscribed,
            address,
            wait,
        })
    }
}

impl Transport for Foxglove {
    fn ready(&mut self, interrupted: &dyn Fn() -> bool) -> Result<(), SinkError> {
        let mut clock = MonotonicClock::new();
        while !self.channels[self.awaited].has_sinks() {
            if clock.now() > self.wait {
                let topic = self.channels[self.awaited].topic();
                let message = format!("nobody subscribed to {topic} at {} within {} s", self.address, self.wait);
                return Err(SinkError::NotReady(message));
            }
            if !clock.wait(clock.now() + 0.02, interrupted) {
                return Err(SinkError::Interrupted);
            }
        }
        if !clock.wait(clock.now() + SETTLE, interrupted) {
            return Err(SinkError::Interrupted);
        }
        // They will get what is latched with the first command.
        self.subscribed.0.lock().unwrap_or_else(PoisonError::into_inner).clear();
        Ok(())
    }

    fn publish(&mut self, topic: usize, message: &[u8], stamp: u64) -> Result<(), SinkError> {
        self.channels[topic].log_with_meta(message, PartialMetadata { log_time: Some(stamp) });
        Ok(())
    }

    fn asked_again(&mut self) -> Vec<usize> {
        let mut subscribed = self.subscribed.0.lock().unwrap_or_else(PoisonError::into_inner);
        let asked = std::mem::take(&mut *subscribed);
        self.latched.iter().copied().filter(|index| asked.contains(self.channels[*index].topic())).collect()
    }

    fn alive(&mut self) -> Result<(), SinkError> {
        match &self.server {
            Some(server) if server.client_count() > 0 => Ok(()),
            _ => Err(SinkError::Lost(format!("nobody is connected to {} any more", self.address))),
        }
    }

    fn finish(&mut self) {
        // Messages wait in the server for its clients' own tasks.
        std::thread::sleep(Duration::from_millis(200));
        if let Some(server) = self.server.take() {
            server.stop().wait_blocking();
        }
    }
}
