//! An AgileX TRACER (MINI) on a CAN bus.
//!
//! The base wants speed and turn rate every 20 ms, in whole mm/s and mrad/s; its own firmware makes wheel speeds of them, with its own
//! track width and wheel radius. The certificate is about the file; what this sink sends differs from it by the rounding, whose sum
//! is carried from frame to frame ([`super::tracer::Diffuser`]) and so never grows.

use super::tracer::{BY_CAN, Diffuser, FRAME_TIME, Frame, State, mode_frame, motion_frame};
use crate::command::CommandTable;
use crate::play::clock::Clock;
use crate::play::sink::{Command, Sink, SinkError, Upcoming};

/// A CAN bus.
pub trait CanBus {
    /// As users name it.
    fn name(&self) -> String;
    /// Sends a frame.
    ///
    /// # Errors
    /// The bus is gone or full.
    fn send(&mut self, frame: &Frame) -> std::io::Result<()>;
    /// Frames that came in; empty when there are none. Never waits.
    ///
    /// # Errors
    /// The bus is gone.
    fn receive(&mut self) -> std::io::Result<Vec<Frame>>;
}

/// How long a base may be silent, s: it says its state every 20 ms.
const SILENCE: f64 = 0.2;
/// How long it may take to obey CAN, s.
const OBEY: f64 = 1.0;
/// Zero commands behind the last, s.
const TAIL: f64 = 0.5;
/// Frames refused by the bus before it counts as gone.
const REFUSALS: usize = 3;

/// What a base can take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseLimits {
    /// m/s, from the robot's wheels; `None`: not given.
    pub speed: Option<f64>,
}

/// Why a table cannot be sent.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CanRefusal {
    /// The protocol has no frame for joints.
    #[error("joint `{joint}` moves, and a TRACER's CAN protocol has no frame for joints")]
    Joints {
        /// The first that moves.
        joint: String,
    },
    /// A frame holds 16 bits, and a robot its limit.
    #[error("{what} is {value:.3} {unit} at t = {time:.3} s, more than {limit:.3} {unit}: {why}")]
    TooFast {
        /// Speed or turn rate.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Of it.
        unit: &'static str,
        /// s.
        time: f64,
        /// What it may be.
        limit: f64,
        /// Whose limit that is.
        why: &'static str,
    },
}

/// Whether a base can be sent this. `joints_elsewhere`: another sink moves them.
///
/// # Errors
/// The first row that it cannot follow.
pub fn refuse(table: &CommandTable, limits: BaseLimits, joints_elsewhere: bool) -> Result<(), CanRefusal> {
    if !joints_elsewhere {
        for (index, (joint, _)) in table.joints.iter().enumerate() {
            if table.rows.iter().any(|row| row.joint_velocities[index] != 0.0) {
                return Err(CanRefusal::Joints { joint: joint.clone() });
            }
        }
    }
    let most = f64::from(i16::MAX) * super::tracer::UNIT;
    for k in 0..table.rows.len() {
        let (v, omega) = table.twist(k);
        let frame = "a CAN frame holds no more";
        let robot = limits.speed.filter(|limit| *limit < most).map(|limit| (limit, "the robot's own limit"));
        for (what, value, unit, (limit, why)) in
            [("the speed", v, "m/s", robot.unwrap_or((most, frame))), ("the turn rate", omega, "rad/s", (most, frame))]
        {
            if value.abs() > limit * (1.0 + 1e-9) {
                return Err(CanRefusal::TooFast { what, value, unit, time: table.time(k), limit, why });
            }
        }
    }
    Ok(())
}

/// Plays to a base.
pub struct CanSink<B: CanBus, C: Clock> {
    bus: B,
    clock: C,
    diffuser: Diffuser,
    /// When the base was last heard.
    heard: f64,
    refused: usize,
}

impl<B: CanBus, C: Clock> CanSink<B, C> {
    /// A sink on a bus; the clock tells how long the base has been silent.
    pub fn new(bus: B, clock: C) -> Self {
        Self { bus, clock, diffuser: Diffuser::default(), heard: 0.0, refused: 0 }
    }

    /// The last state that came in, if one did.
    fn state(&mut self) -> Result<Option<State>, SinkError> {
        let mut last = None;
        // A tunnel holds one datagram a call; a base sends a few dozen a frame at most.
        for _ in 0..64 {
            match self.bus.receive() {
                Ok(frames) if frames.is_empty() => break,
                Ok(frames) => last = frames.iter().filter_map(State::of).next_back().or(last),
                Err(error) => return Err(self.lost(&error)),
            }
        }
        if last.is_some() {
            self.heard = self.clock.now();
        }
        Ok(last)
    }

    fn lost(&self, error: &std::io::Error) -> SinkError {
        SinkError::Lost(format!("CAN bus {} is gone: {error}", self.bus.name()))
    }

    /// Waits for a state; `None` when none came in time.
    fn next_state(&mut self, until: f64, interrupted: &dyn Fn() -> bool) -> Result<Option<State>, SinkError> {
        loop {
            let found = self.state().or_else(|error| match error {
                // A tunnel's other end may not be there yet: that is silence.
                SinkError::Lost(_) => Ok(None),
                other => Err(other),
            })?;
            if found.is_some() {
                return Ok(found);
            }
            let now = self.clock.now();
            if now >= until {
                return Ok(None);
            }
            if !self.clock.wait((now + 0.002).min(until), interrupted) {
                return Err(SinkError::Interrupted);
            }
        }
    }
}

impl<B: CanBus, C: Clock> Sink for CanSink<B, C> {
    fn ready(&mut self, interrupted: &dyn Fn() -> bool) -> Result<(), SinkError> {
        let not_ready = |what: String| Err(SinkError::NotReady(what));
        let name = self.bus.name();
        let begun = self.clock.now();
        let mut asked = false;
        loop {
            let until = self.clock.now() + SILENCE;
            let Some(state) = self.next_state(until, interrupted)? else {
                return not_ready(format!("no base on CAN bus {name}: no 0x211 within {SILENCE} s"));
            };
            if let Some(trouble) = state.trouble() {
                return not_ready(format!("the base on CAN bus {name} will not drive: {trouble}"));
            }
            if asked && state.mode == BY_CAN {
                return Ok(());
            }
            if !asked {
                asked = true;
                if let Err(error) = self.bus.send(&mode_frame()) {
                    return not_ready(format!("CAN bus {name} takes no frame: {error}"));
                }
            } else if self.clock.now() - begun > OBEY {
                return not_ready(format!(
                    "the base on CAN bus {name} does not go into CAN mode (it is in mode {}); a remote control that is switched on \
                     must have its SWB up",
                    state.mode
                ));
            }
        }
    }

    fn send(&mut self, command: &Command<'_>, at: f64) -> Result<(), SinkError> {
        self.diffuser.hold(at, command.twist.into());
        Ok(())
    }

    fn frame_time(&self) -> Option<f64> {
        Some(FRAME_TIME)
    }

    fn frame(&mut self, at: f64, upcoming: Option<Upcoming>) -> Result<(), SinkError> {
        let units = self.diffuser.frame(at, upcoming.map(|next| (next.at, next.twist.into())));
        let sent = self.bus.send(&motion_frame(units));
        let state = self.state();
        match sent {
            Ok(()) => self.refused = 0,
            Err(error) => {
                self.refused += 1;
                if self.refused >= REFUSALS {
                    return Err(self.lost(&error));
                }
            }
        }
        match state? {
            Some(state) if state.trouble().is_some() => {
                let trouble = state.trouble().unwrap_or_default();
                Err(SinkError::Halted(format!("the base stopped: {trouble}")))
            }
            Some(state) if state.mode != BY_CAN => {
                Err(SinkError::Halted(format!("the base no longer obeys CAN: it is in mode {}", state.mode)))
            }
            None if self.clock.now() - self.heard > SILENCE => {
                Err(SinkError::Lost(format!("the base on CAN bus {} is silent", self.bus.name())))
            }
            _ => Ok(()),
        }
    }

    fn tail(&self) -> f64 {
        TAIL
    }
}

#[cfg(test)]
mod tests;
