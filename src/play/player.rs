//! The schedule: row k goes out at t0 + k times a row's time, whatever happened before.

use super::clock::Clock;
use super::jitter::{Jitter, JitterReport};
use super::motion::Motion;
use super::pace::{Limits, stop};
use super::sink::{Command, Sink, SinkError, Upcoming};
use crate::command::{CommandRow, CommandTable};

/// What is played.
#[derive(Debug, Clone, Copy)]
pub struct Play<'a> {
    /// All rows, held for as long as they are to be held.
    pub motion: &'a Motion,
    /// Within which a stop must stay.
    pub limits: &'a Limits,
    /// The row of the file that the first row stands for, as far as time is concerned: row k has the time of the file's row `first_row + k`.
    pub first_row: i64,
    /// The file's time that passes from row to row, s.
    pub file_step: f64,
}

/// How it went.
#[derive(Debug, Clone, PartialEq)]
pub struct Outcome {
    /// How it ended.
    pub ending: Ending,
    /// Commands sent.
    pub sent: usize,
    /// How well the schedule was kept.
    pub jitter: JitterReport,
    /// Rows later than a row's time.
    pub missed: usize,
    /// Time from what asked for a stop to rest, s.
    pub stop_time: Option<f64>,
}

/// How playback ended. At rest in any case.
#[derive(Debug, Clone, PartialEq)]
pub enum Ending {
    /// All rows were sent.
    Complete,
    /// By a stop on the planned path.
    Stopped(Reason),
    /// By a zero command at once.
    Cut(Reason),
}

/// Why playback ended early.
#[derive(Debug, Clone, PartialEq)]
pub enum Reason {
    /// A signal.
    Asked,
    /// The receiver.
    Sink(SinkError),
    /// A row was late by so much, s.
    Late(f64),
}

/// Plays to the end, or to a stop. `requests` counts how often somebody asked for an end so far: once for a stop on the path, twice for
/// zero at once.
///
/// A row that is late by more than a row's time moves the schedule: a robot holds its last command meanwhile, and has left the
/// path by then.
///
/// # Errors
/// The sink did not get ready; nothing was sent then.
pub fn play(
    what: &Play<'_>,
    sink: &mut dyn Sink,
    clock: &mut dyn Clock,
    requests: &dyn Fn() -> usize,
) -> Result<Outcome, SinkError> {
    sink.ready(&|| requests() > 0)?;
    if requests() > 0 {
        return Err(SinkError::Interrupted);
    }
    let announced = sink.announce(what.motion.table());
    let mut player = Player {
        what,
        sink,
        clock,
        requests,
        table: what.motion.table().clone(),
        zero: 0.0,
        frames: 0,
        next: 0,
        heeded: 0,
        stopping: None,
        rested: 0.0,
        jitter: Jitter::default(),
        missed: 0,
    };
    player.zero = player.clock.now();
    player.heed(announced);
    let cut = player.run();
    Ok(player.end(cut))
}

struct Player<'a> {
    what: &'a Play<'a>,
    sink: &'a mut dyn Sink,
    clock: &'a mut dyn Clock,
    requests: &'a dyn Fn() -> usize,
    /// What is being played: the motion, or what of it was sent and then a stop.
    table: CommandTable,
    /// When row 0 was due.
    zero: f64,
    /// Frames sent.
    frames: usize,
    /// The row that is next.
    next: usize,
    /// Requests for an end that were heeded.
    heeded: usize,
    /// Why, and since when.
    stopping: Option<(Reason, f64)>,
    /// When the robot came to rest.
    rested: f64,
    jitter: Jitter,
    missed: usize,
}

/// Whether to go on, or to cut.
type Cut = Option<Reason>;

impl Player<'_> {
    /// Rows and frames in order of time. Says why if it must end at once.
    fn run(&mut self) -> Cut {
        while self.next < self.table.rows.len() {
            let (due, frame) = self.due();
            if !self.wait(self.zero + due) {
                if let cut @ Some(_) = self.asked() {
                    return cut;
                }
                continue;
            }
            let result = if frame { self.frame(due) } else { self.row(due) };
            if let cut @ Some(_) = self.heed(result) {
                return cut;
            }
        }
        self.tail();
        None
    }

    /// When the next row or frame is due, s since row 0, and whether that is a frame.
    fn due(&self) -> (f64, bool) {
        let row = self.table.time(self.next);
        match self.sink.frame_time().map(|step| self.frames as f64 * step) {
            // A row at the same time goes first: the frame is to have it.
            Some(frame) if frame < row - 1e-9 => (frame, true),
            _ => (row, false),
        }
    }

    fn wait(&mut self, until: f64) -> bool {
        let (requests, heeded) = (self.requests, self.heeded);
        self.clock.wait(until, &|| requests() > heeded)
    }

    fn row(&mut self, due: f64) -> Result<(), SinkError> {
        let late = self.clock.now() - self.zero - due;
        self.jitter.add(late);
        if late > self.table.sampling_time {
            self.missed += 1;
            self.zero += late;
            self.begin_stop(Reason::Late(late));
        }
        let k = self.next;
        self.next += 1;
        self.send(k, due)
    }

    fn send(&mut self, k: usize, at: f64) -> Result<(), SinkError> {
        let command = Command {
            sequence: k as u64,
            time: (self.what.first_row + k as i64) as f64 * self.what.file_step,
            row: &self.table.rows[k],
            twist: self.table.twist(k),
        };
        self.sink.send(&command, at)
    }

    /// Frames that are overdue follow each other at once: a receiver that counts them counts right, one that holds the last has that.
    fn frame(&mut self, at: f64) -> Result<(), SinkError> {
        self.frames += 1;
        let next = self.next;
        let upcoming = (next < self.table.rows.len())
            .then(|| Upcoming { at: self.table.time(next), twist: self.table.twist(next) });
        self.sink.frame(at, upcoming)
    }

    /// Somebody asked for an end: the first time for a stop, then for a cut.
    fn asked(&mut self) -> Cut {
        self.heeded += 1;
        if self.heeded > 1 {
            return Some(Reason::Asked);
        }
        self.begin_stop(Reason::Asked);
        None
    }

    /// A receiver that is gone begins a stop; one that halted, or stays gone, changes no more.
    fn heed(&mut self, result: Result<(), SinkError>) -> Cut {
        match result {
            Ok(()) => None,
            Err(error @ SinkError::Halted(_)) => Some(Reason::Sink(error)),
            Err(error) => {
                self.begin_stop(Reason::Sink(error));
                None
            }
        }
    }

    /// Replaces all rows not yet sent by a stop, once.
    fn begin_stop(&mut self, reason: Reason) {
        if self.stopping.is_some() || self.next + 1 >= self.table.rows.len() {
            return;
        }
        self.stopping = Some((reason, self.clock.now()));
        let stop = stop(self.what.motion, self.next, self.what.limits);
        self.table.rows.truncate(self.next);
        self.table.rows.extend(stop.rows);
        let rest = CommandTable { rows: self.table.rows[self.next..].to_vec(), ..self.table.clone() };
        // A fault shows again with the next command.
        let _ = self.sink.announce(&rest);
    }

    /// Frames behind the last command. Another request ends them.
    fn tail(&mut self) {
        self.rested = self.clock.now();
        let Some(step) = self.sink.frame_time() else { return };
        let end = self.table.time(self.next.saturating_sub(1)) + self.sink.tail();
        while self.frames as f64 * step <= end {
            let at = self.frames as f64 * step;
            let _ = self.clock.wait(self.zero + at, &|| false);
            let _ = self.frame(at);
        }
    }

    /// Zero at once, if so asked, and the figures.
    fn end(mut self, cut: Cut) -> Outcome {
        if cut.is_some() && self.next > 0 {
            let held = &self.table.rows[self.next - 1];
            let rest = CommandRow {
                wheel_left: 0.0,
                wheel_right: 0.0,
                joint_velocities: vec![0.0; held.joint_velocities.len()],
                ..self.table.rows.get(self.next).unwrap_or(held).clone()
            };
            self.table.rows.truncate(self.next);
            self.table.rows.push(rest.clone());
            let _ = self.sink.announce(&CommandTable { rows: vec![rest], ..self.table.clone() });
            // The schedule is moved so that this row, and the frames behind it, are due now.
            let (now, due) = (self.clock.now(), self.table.time(self.next));
            self.zero = now - due;
            if let Some(step) = self.sink.frame_time() {
                self.frames = (due / step).ceil() as usize;
            }
            let _ = self.send(self.next, due);
            self.next += 1;
            self.tail();
        }
        let _ = self.sink.finish();
        let since = self.stopping.as_ref().map(|(_, since)| self.rested - since);
        let ending = match (cut, self.stopping) {
            (Some(reason), _) => Ending::Cut(reason),
            (None, Some((reason, _))) => Ending::Stopped(reason),
            (None, None) => Ending::Complete,
        };
        Outcome { ending, sent: self.next, jitter: self.jitter.report(), missed: self.missed, stop_time: since }
    }
}

#[cfg(test)]
mod tests;
