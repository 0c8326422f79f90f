//! The schedule on a simulated clock.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use super::*;
use crate::play::clock::SimulatedClock;
use crate::play::fixtures::{Heard, Recorder, drive, ready};
use crate::play::motion::speed;

struct Run {
    outcome: Outcome,
    heard: Heard,
    motion: Motion,
}

/// Plays a drive of so many rows; `during` is called with each command's sequence, the clock, and the counter of requests.
fn run(
    rows: usize,
    frame_time: Option<f64>,
    mut during: impl FnMut(u64, &SimulatedClock, &Cell<usize>) -> Result<(), SinkError>,
) -> Run {
    let (motion, limits) = ready(drive(rows));
    let clock = SimulatedClock::default();
    let requests = Cell::new(0);
    let heard = Rc::new(RefCell::new(Heard::default()));
    let now = clock.clone();
    let mut recorder = Recorder {
        heard: heard.clone(),
        on_command: Box::new(|sequence| during(sequence, &clock, &requests)),
        now: Box::new(move || now.now()),
        frame_time,
    };
    let what = Play { motion: &motion, limits: &limits, first_row: 0, file_step: 0.01 };
    let outcome = play(&what, &mut recorder, &mut clock.clone(), &|| requests.get()).expect("ready");
    drop(recorder);
    let heard = heard.borrow().clone();
    Run { outcome, heard, motion }
}

/// Commands in a row, at rest at the end, with no step beyond what the motion itself makes.
fn assert_smooth(run: &Run) {
    let wheels: Vec<[f64; 2]> = run.heard.commands.iter().map(|(_, _, wheels)| *wheels).collect();
    assert_eq!(wheels.last(), Some(&[0.0, 0.0]));
    for side in 0..2 {
        let own = run.motion.table().rows.windows(2).map(|w| (speed(&w[1], side) - speed(&w[0], side)).abs());
        let own = own.fold(0.0, f64::max);
        let step = wheels.windows(2).map(|w| (w[1][side] - w[0][side]).abs()).fold(0.0, f64::max);
        assert!(step <= own * (1.0 + 1e-6), "{step}, the motion's own {own}");
    }
}

#[test]
fn ten_minutes_at_100_hz_do_not_drift() {
    // Each command takes a while to send, sometimes nearly a whole row: that must not add up.
    let run = run(60_000, None, |sequence, clock, _| {
        clock.advance(if sequence % 10 == 3 { 0.009 } else { 0.0004 });
        Ok(())
    });
    assert_eq!(run.outcome.ending, Ending::Complete);
    let rows = run.motion.table().rows.len();
    assert!(rows >= 60_000 && run.outcome.sent == rows && run.outcome.missed == 0);
    for (k, ((sequence, time, _), arrival)) in run.heard.commands.iter().zip(&run.heard.arrivals).enumerate() {
        assert_eq!((*sequence, *time), (k as u64, k as f64 * 0.01));
        assert!((arrival - k as f64 * 0.01).abs() < 1e-9, "row {k} at {arrival}");
    }
    assert!(run.outcome.jitter.max < 1e-9);
}

#[test]
fn rows_are_those_of_the_file() {
    let run = run(600, None, |_, _, _| Ok(()));
    let planned = run.motion.table().rows.iter().map(|row| [row.wheel_left, row.wheel_right]);
    assert!(run.heard.commands.iter().map(|(_, _, wheels)| *wheels).eq(planned));
    assert_eq!(run.heard.plans, [run.motion.table().rows.len()]);
}

#[test]
fn one_request_ends_in_a_stop_on_the_path() {
    let run = run(900, None, |sequence, _, requests| {
        requests.set(usize::from(sequence >= 300));
        Ok(())
    });
    assert_eq!(run.outcome.ending, Ending::Stopped(Reason::Asked));
    assert_smooth(&run);
    assert!((320..500).contains(&run.outcome.sent), "{}", run.outcome.sent);
    assert_eq!(run.heard.plans.len(), 2, "the stop is announced");
    assert_eq!(run.heard.plans[1], run.outcome.sent - 301);
    let took = run.outcome.stop_time.expect("stopped");
    assert!((took - 0.01 * (run.outcome.sent - 301) as f64).abs() < 0.011, "{took}");
}

#[test]
fn a_second_request_is_zero_at_once() {
    let run = run(900, None, |sequence, _, requests| {
        requests.set(usize::from(sequence >= 300) + usize::from(sequence >= 320));
        Ok(())
    });
    assert_eq!(run.outcome.ending, Ending::Cut(Reason::Asked));
    assert_eq!(run.outcome.sent, 322, "rows 0 to 320, and zero");
    assert_eq!(run.heard.commands.last().map(|(_, _, wheels)| *wheels), Some([0.0, 0.0]));
    let [.., before, last] = run.heard.arrivals[..] else { panic!("rows") };
    assert_eq!(before, last, "not when the next row is due");
}

#[test]
fn a_row_that_is_late_by_more_than_a_row_ends_in_a_stop_that_keeps_its_own_time() {
    let run = run(900, None, |sequence, clock, _| {
        clock.advance(if sequence == 400 { 0.035 } else { 0.0 });
        Ok(())
    });
    let Ending::Stopped(Reason::Late(late)) = run.outcome.ending else { panic!("{:?}", run.outcome.ending) };
    assert!((late - 0.025).abs() < 1e-9);
    assert_eq!(run.outcome.missed, 1);
    assert_smooth(&run);
    let times = &run.heard.arrivals[401..];
    assert!(times.windows(2).all(|w| (w[1] - w[0] - 0.01).abs() < 1e-9), "no burst to catch up");
}

#[test]
fn a_receiver_that_is_gone_is_still_told_to_stop() {
    let gone = || SinkError::Lost("gone".into());
    let run = run(900, None, |sequence, _, _| if sequence >= 250 { Err(gone()) } else { Ok(()) });
    assert_eq!(run.outcome.ending, Ending::Stopped(Reason::Sink(gone())));
    assert_smooth(&run);
}

#[test]
fn a_robot_that_halted_gets_zero_at_once() {
    let halted = || SinkError::Halted("emergency stop".into());
    let run = run(900, None, |sequence, _, _| if sequence == 250 { Err(halted()) } else { Ok(()) });
    assert_eq!(run.outcome.ending, Ending::Cut(Reason::Sink(halted())));
    assert_eq!(run.heard.commands.len(), 252);
    assert_eq!(run.heard.commands[251].2, [0.0, 0.0]);
}

#[test]
fn frames_have_a_time_of_their_own_and_go_on_behind_the_end() {
    let run = run(600, Some(0.016), |_, _, _| Ok(()));
    let end = run.motion.table().duration();
    let wanted = (0..).map(|k| 0.016 * f64::from(k)).take_while(|t| *t <= end + 0.5);
    assert!(run.heard.frames.iter().copied().eq(wanted), "{:?}", run.heard.frames.len());
}

#[test]
fn nothing_is_sent_when_asked_to_end_before_the_beginning() {
    let (motion, limits) = ready(drive(600));
    let clock = SimulatedClock::default();
    let heard = Rc::new(RefCell::new(Heard::default()));
    let mut recorder =
        Recorder { heard: heard.clone(), on_command: Box::new(|_| Ok(())), now: Box::new(|| 0.0), frame_time: None };
    let what = Play { motion: &motion, limits: &limits, first_row: 0, file_step: 0.01 };
    assert_eq!(play(&what, &mut recorder, &mut clock.clone(), &|| 1), Err(SinkError::Interrupted));
    assert!(heard.borrow().commands.is_empty());
}
