//! Playback in real time: a command file's rows, one after the other, to a robot or whoever listens.
//!
//! [`play`] follows an absolute schedule on a [`Clock`] and sends to a [`Sink`]. What ends it early (a signal, a sink that is gone, a
//! deadline missed by more than a row) ends it by a stop on the planned path within all limits ([`pace::stop`]), never by a cut.
//!
//! | file | what |
//! |---|---|
//! | `motion.rs` | a command table that can be driven at another pace |
//! | `pace.rs` | slowing down and setting off along the path within limits: pure |
//! | `player.rs`, `clock.rs`, `jitter.rs` | the schedule, its clock (monotonic or simulated), how well it was kept |
//! | `tracking/`, `follow.rs`, `poses.rs` | with feedback: the law (pure), its loop in real time, where poses come from |
//! | `sink.rs`, `address.rs` | what a receiver is to the player; how one is named |
//! | `sinks/` | one file each |

pub mod address;
pub mod clock;
#[cfg(test)]
mod fixtures;
pub mod follow;
pub mod jitter;
pub mod motion;
pub mod pace;
mod player;
pub mod poses;
pub mod realtime;
pub mod sink;
pub mod sinks;
pub mod tracking;

pub use clock::{Clock, MonotonicClock, SimulatedClock};
pub use jitter::JitterReport;
pub use motion::Motion;
pub use player::{Ending, Outcome, Play, Reason, play};
pub use sink::{Command, Sink, SinkError};
