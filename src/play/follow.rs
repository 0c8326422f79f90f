//! Playing with feedback in real time: a step of the [`Tracker`] every `period` seconds, on the monotonic clock.

use super::clock::Clock;
use super::motion::Motion;
use super::poses::Poses;
use super::sink::{self, Sink, SinkError, Upcoming};
use super::tracking::{Phase, Tracker};
use crate::command::CommandTable;
use crate::math::real;

/// By how much the file's time may be off what joints were told before they are told anew, s.
const ANEW: f64 = 0.1;

/// How it went.
#[derive(Debug, Clone, PartialEq)]
pub struct Followed {
    /// How it ended; anything but [`Phase::Done`] and [`Phase::Stopped`]: zero at once, for the reason given.
    pub phase: Phase,
    /// Why zero was sent at once.
    pub cut: Option<SinkError>,
    /// Commands sent.
    pub sent: usize,
    /// Poses used, and refused.
    pub poses: (usize, usize),
    /// From the first pose to the end, s.
    pub time: f64,
    /// At the end, as estimated: m, rad.
    pub end: (f64, f64),
}

/// Follows a motion to its end, or to a stop. `requests` as of [`super::play`]; gives up when no pose has come within `wait` seconds.
///
/// # Errors
/// The sink did not get ready, or no pose came; nothing was sent then.
pub fn follow(
    tracker: &Tracker<'_>,
    motion: &Motion,
    sink: &mut dyn Sink,
    clock: &mut dyn Clock,
    poses: &mut dyn Poses,
    requests: &dyn Fn() -> usize,
    [period, wait]: [f64; 2],
) -> Result<Followed, SinkError> {
    sink.ready(&|| requests() > 0)?;
    let (zero, mut state) = (clock.now(), tracker.begin());
    let mut out = Followed {
        phase: Phase::Waiting,
        cut: None,
        sent: 0,
        poses: (0, 0),
        time: 0.0,
        end: (f64::INFINITY, f64::INFINITY),
    };
    let (mut first, mut told, mut ticks, mut frames, mut heeded) = (None, None, 0usize, 0usize, 0);
    loop {
        let due = ticks as f64 * period;
        while let Some(frame) = sink.frame_time().map(|step| frames as f64 * step).filter(|at| *at < due - 1e-9) {
            clock.wait(zero + frame, &|| requests() > heeded.max(1));
            if let cut @ Some(_) = lost(sink.frame(frame, None), &mut state, tracker) {
                return Ok(Followed { cut, ..out });
            }
            frames += 1;
        }
        clock.wait(zero + due, &|| requests() > heeded);
        if requests() > heeded {
            heeded = requests();
            state = tracker.asked_to_stop(&state);
            if heeded > 1 {
                out.cut = Some(SinkError::Interrupted);
            }
        }
        let now = clock.now().max(zero + due);
        let seen = poses.latest(now).map(|seen| super::tracking::Sighting { time: seen.time.min(now), ..seen });
        if seen.is_none() && first.is_none() && (now - zero > wait || heeded > 0) {
            return Err(SinkError::NotReady(format!("no pose has come within {wait} s")));
        }
        let step = tracker.step(&state, now, seen.as_ref());
        let (next, command) = match step {
            Ok(made) => {
                out.poses.0 += usize::from(seen.is_some());
                made
            }
            Err(_) => {
                out.poses.1 += 1;
                // A clock that stands still has no step: the last command goes on.
                match tracker.step(&state, now, None) {
                    Ok(made) => made,
                    Err(_) => continue,
                }
            }
        };
        state = next;
        if out.poses.0 > 0 {
            first = first.or(Some(now));
        }
        let behind = told.map_or(f64::INFINITY, |(at, path): (f64, f64)| now - at - (command.path_time - path));
        if first.is_some() && (told.is_none() || behind.abs() > ANEW && !motion.table().joints.is_empty()) {
            told = Some((now, command.path_time));
            if let cut @ Some(_) = lost(sink.announce(&rest(motion, command.path_time)), &mut state, tracker) {
                return Ok(Followed { cut, ..out });
            }
        }
        let mut row = command.row.clone();
        let mut twist = command.twist;
        if out.cut.is_some() {
            (row.wheel_left, row.wheel_right, twist) = (0.0, 0.0, (0.0, 0.0));
            row.joint_velocities.iter_mut().for_each(|speed| *speed = 0.0);
        }
        let sent = sink::Command { sequence: out.sent as u64, time: command.path_time, row: &row, twist };
        // Before the first pose the receiver has not been told what comes, and there is nothing to be done.
        let cut = if told.is_some() {
            out.sent += 1;
            lost(sink.send(&sent, due), &mut state, tracker)
        } else {
            None
        };
        ticks += 1;
        out.phase = command.phase;
        out.time = first.map_or(0.0, |first| now - first);
        out.end = (real::hypot(command.error.along, command.error.across), command.error.heading.abs());
        if out.cut.is_some() || cut.is_some() || matches!(out.phase, Phase::Done | Phase::Stopped(_)) {
            out.cut = out.cut.or(cut);
            // Receivers that need frames get their zeros.
            let end = due + sink.tail();
            while let Some(at) = sink.frame_time().map(|step| frames as f64 * step).filter(|at| *at <= end) {
                clock.wait(zero + at, &|| false);
                let _ = sink.frame(at, None::<Upcoming>);
                frames += 1;
            }
            let _ = sink.finish();
            return Ok(out);
        }
    }
}

/// A receiver that is gone for good ends it; one that may come back gets the stop.
fn lost(result: Result<(), SinkError>, state: &mut super::tracking::State, tracker: &Tracker<'_>) -> Option<SinkError> {
    match result {
        Ok(()) => None,
        Err(SinkError::Lost(_)) => {
            *state = tracker.asked_to_stop(state);
            None
        }
        Err(error) => Some(error),
    }
}

/// The rows from a time on.
fn rest(motion: &Motion, from: f64) -> CommandTable {
    let table = motion.table();
    let row = ((from / table.sampling_time) as usize).min(table.rows.len().saturating_sub(1));
    CommandTable { rows: table.rows[row..].to_vec(), ..table.clone() }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::rc::Rc;

    use super::*;
    use crate::geom::Pose2;
    use crate::play::SimulatedClock;
    use crate::play::fixtures::{Heard, Recorder, drive, tight_robot};
    use crate::play::pace::Limits;
    use crate::play::tracking::tube::Tube;
    use crate::play::tracking::{Options, Sighting, Why};

    /// A robot that does what it is told, as seen each time.
    struct Perfect {
        heard: Rc<RefCell<Heard>>,
        pose: Pose2,
        at: f64,
        gone_after: f64,
    }

    impl Poses for Perfect {
        fn latest(&mut self, now: f64) -> Option<Sighting> {
            let wheels = self.heard.borrow().commands.last().map_or([0.0; 2], |(_, _, wheels)| *wheels);
            let [left, right] = wheels.map(|rate| 0.1 * rate);
            self.pose = self.pose.after_twist(0.5 * (left + right), (right - left) / 0.4, now - self.at);
            self.at = now;
            (now < self.gone_after).then(|| Sighting { time: now, pose: self.pose, joints: Vec::new() })
        }
    }

    fn followed(gone_after: f64, requests: &dyn Fn() -> usize) -> (Result<Followed, SinkError>, Heard, f64) {
        let table = drive(600);
        let robot = tight_robot(&table);
        let motion = Motion::new(table);
        let (limits, tube) = (Limits::new(&robot, &motion), Tube::constant(0.1, 0.5, 0.3));
        let tracker = Tracker::new(&motion, &robot, &limits, &tube, Options::default());
        let heard = Rc::new(RefCell::new(Heard::default()));
        let mut sink = Recorder {
            heard: heard.clone(),
            on_command: Box::new(|_| Ok(())),
            now: Box::new(|| 0.0),
            frame_time: Some(0.05),
        };
        let mut poses = Perfect { heard: heard.clone(), pose: motion.pose(0.0), at: 0.0, gone_after };
        let mut clock = SimulatedClock::default();
        let result = follow(&tracker, &motion, &mut sink, &mut clock, &mut poses, requests, [0.02, 1.0]);
        let off = poses.pose.distance(motion.pose(1e9));
        let heard = heard.borrow().clone();
        (result, heard, off)
    }

    #[test]
    fn a_robot_that_is_seen_is_brought_to_the_end_and_stands() {
        let (result, heard, off) = followed(1e9, &|| 0);
        let followed = result.expect("it begins");
        assert_eq!((followed.phase, followed.cut.clone()), (Phase::Done, None));
        assert!(off < 0.005 && followed.end.0 < 0.005, "{off} {followed:?}");
        assert_eq!(heard.commands.last().map(|c| c.2), Some([0.0; 2]));
        assert!(heard.frames.len() as f64 > 20.0 * followed.time, "frames go on");
        assert_eq!(heard.plans.len(), 1, "without joints the plan is told once");
    }

    #[test]
    fn without_poses_nothing_begins_and_when_they_end_the_robot_stops() {
        let (result, heard, _) = followed(-1.0, &|| 0);
        assert!(matches!(result, Err(SinkError::NotReady(_))));
        assert_eq!((heard.commands.len(), heard.plans.len()), (0, 0), "no command before what it belongs to");
        let (result, heard, _) = followed(3.0, &|| 0);
        assert!(matches!(result.map(|f| f.phase), Ok(Phase::Stopped(Why::Lost(_)))));
        assert_eq!(heard.commands.last().map(|c| c.2), Some([0.0; 2]));
    }

    #[test]
    fn a_request_stops_and_a_second_one_cuts() {
        let calls = std::cell::Cell::new(0);
        let count = |after: usize, most: usize| {
            calls.set(calls.get() + 1);
            if calls.get() > after { most } else { 0 }
        };
        let (result, ..) = followed(1e9, &|| count(1000, 1));
        assert!(matches!(result.map(|f| f.phase), Ok(Phase::Stopped(Why::Asked))));
        calls.set(0);
        let (result, heard, _) = followed(1e9, &|| count(1000, 2));
        assert_eq!(result.map(|f| f.cut), Ok(Some(SinkError::Interrupted)));
        assert_eq!(heard.commands.last().map(|c| c.2), Some([0.0; 2]));
    }
}
