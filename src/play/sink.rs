//! What a receiver is to the player.

use crate::command::{CommandRow, CommandTable};

/// One command as it goes out.
#[derive(Debug, Clone, Copy)]
pub struct Command<'a> {
    /// Counts from 0, without gaps.
    pub sequence: u64,
    /// As the file counts time, s: a row of the file has its own `time_s`, rows of a stop go on from there. Real time is this by the rate.
    pub time: f64,
    /// What is held until the next command, and the planned state.
    pub row: &'a CommandRow,
    /// Speed (m/s) and turn rate (rad/s) that it makes.
    pub twist: (f64, f64),
}

/// What is held next, as far as is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Upcoming {
    /// When, s since the first command.
    pub at: f64,
    /// Speed (m/s) and turn rate (rad/s).
    pub twist: (f64, f64),
}

/// A receiver of commands. Times are seconds since the first command; they stand still while a late schedule is moved.
pub trait Sink {
    /// Gets ready: finds who listens. Gives up when `interrupted`.
    ///
    /// # Errors
    /// Nobody there, or not able to follow.
    fn ready(&mut self, interrupted: &dyn Fn() -> bool) -> Result<(), SinkError> {
        let _ = interrupted;
        Ok(())
    }

    /// All commands that will come from here on, unless a stop replaces them: before the first, and at the beginning of a stop.
    ///
    /// # Errors
    /// The receiver is gone.
    fn announce(&mut self, plan: &CommandTable) -> Result<(), SinkError> {
        let _ = plan;
        Ok(())
    }

    /// A command, to be held from now (`at`).
    ///
    /// # Errors
    /// The receiver is gone, or stopped by itself.
    fn send(&mut self, command: &Command<'_>, at: f64) -> Result<(), SinkError>;

    /// How often [`Sink::frame`] must be called, s; `None`: never.
    fn frame_time(&self) -> Option<f64> {
        None
    }

    /// What must be sent again and again whatever the commands' own time.
    ///
    /// # Errors
    /// The receiver is gone, or stopped by itself.
    fn frame(&mut self, at: f64, upcoming: Option<Upcoming>) -> Result<(), SinkError> {
        let _ = (at, upcoming);
        Ok(())
    }

    /// For how long frames go on behind the last command, s.
    fn tail(&self) -> f64 {
        0.0
    }

    /// Sees to it that all is out.
    ///
    /// # Errors
    /// The receiver is gone.
    fn finish(&mut self) -> Result<(), SinkError> {
        Ok(())
    }
}

/// What a sink cannot do, or no longer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SinkError {
    /// Nobody there before the first command.
    #[error("{0}")]
    NotReady(String),
    /// Asked to stop before the first command.
    #[error("interrupted before the first command")]
    Interrupted,
    /// The receiver is gone: the stop is sent nevertheless, it may come back.
    #[error("{0}")]
    Lost(String),
    /// The robot stopped by itself (an emergency stop, a fault): zero at once.
    #[error("{0}")]
    Halted(String),
}

/// Two sinks at once.
pub struct Both<'a>(pub Box<dyn Sink + 'a>, pub Box<dyn Sink + 'a>);

impl Both<'_> {
    /// The first fault of two that were both tried.
    fn worst(first: Result<(), SinkError>, second: Result<(), SinkError>) -> Result<(), SinkError> {
        match (first, second) {
            (Err(SinkError::Halted(why)), _) | (_, Err(SinkError::Halted(why))) => Err(SinkError::Halted(why)),
            (first, second) => first.and(second),
        }
    }
}

impl Sink for Both<'_> {
    fn ready(&mut self, interrupted: &dyn Fn() -> bool) -> Result<(), SinkError> {
        // The second first: the first may be a base that wants commands from then on.
        self.1.ready(interrupted)?;
        self.0.ready(interrupted)
    }

    fn announce(&mut self, plan: &CommandTable) -> Result<(), SinkError> {
        Self::worst(self.0.announce(plan), self.1.announce(plan))
    }

    fn send(&mut self, command: &Command<'_>, at: f64) -> Result<(), SinkError> {
        Self::worst(self.0.send(command, at), self.1.send(command, at))
    }

    fn frame_time(&self) -> Option<f64> {
        match (self.0.frame_time(), self.1.frame_time()) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        }
    }

    fn frame(&mut self, at: f64, upcoming: Option<Upcoming>) -> Result<(), SinkError> {
        Self::worst(self.0.frame(at, upcoming), self.1.frame(at, upcoming))
    }

    fn tail(&self) -> f64 {
        self.0.tail().max(self.1.tail())
    }

    fn finish(&mut self) -> Result<(), SinkError> {
        Self::worst(self.0.finish(), self.1.finish())
    }
}
