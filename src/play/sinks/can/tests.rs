//! A base in memory.

use std::cell::RefCell;
use std::rc::Rc;

use super::*;
use crate::play::clock::SimulatedClock;
use crate::play::fixtures::{drive, ready, table};
use crate::play::sinks::tracer::{MODE, MOTION, STATE};
use crate::play::{Ending, Play, Reason, play};

/// What a base does and heard.
#[derive(Default)]
struct Base {
    /// Its state.
    vehicle: u8,
    mode: u8,
    /// Does not obey.
    stubborn: bool,
    /// Says nothing from this time on.
    silent_from: Option<f64>,
    /// Its emergency stop is pressed from this time on.
    stopped_from: Option<f64>,
    /// When it said its state last.
    said: f64,
    /// When and what came.
    heard: Vec<(f64, Frame)>,
}

struct Bus(Rc<RefCell<Base>>, SimulatedClock);

impl CanBus for Bus {
    fn name(&self) -> String {
        "test".into()
    }

    fn send(&mut self, frame: &Frame) -> std::io::Result<()> {
        let mut base = self.0.borrow_mut();
        if frame.id == MODE && !base.stubborn {
            base.mode = frame.data[0];
        }
        base.heard.push((self.1.now(), *frame));
        Ok(())
    }

    fn receive(&mut self) -> std::io::Result<Vec<Frame>> {
        let (mut base, now) = (self.0.borrow_mut(), self.1.now());
        if now < base.said + 0.02 || base.silent_from.is_some_and(|from| now >= from) {
            return Ok(Vec::new());
        }
        base.said = now;
        let vehicle = if base.stopped_from.is_some_and(|from| now >= from) { 1 } else { base.vehicle };
        Ok(vec![Frame { id: STATE, data: [vehicle, base.mode, 0, 252, 0, 0, 0, 0], length: 8 }])
    }
}

/// Plays a drive to a base.
fn run(base: Base) -> (Result<crate::play::Outcome, SinkError>, Vec<(f64, Frame)>) {
    let (motion, limits) = ready(drive(600));
    let clock = SimulatedClock::default();
    let base = Rc::new(RefCell::new(base));
    let mut sink = CanSink::new(Bus(base.clone(), clock.clone()), clock.clone());
    let what = Play { motion: &motion, limits: &limits, first_row: 0, file_step: 0.01 };
    let outcome = play(&what, &mut sink, &mut clock.clone(), &|| 0);
    let heard = base.borrow().heard.clone();
    (outcome, heard)
}

#[test]
fn a_base_is_asked_to_obey_then_driven_every_20_ms_and_left_at_zero() {
    let (outcome, heard) = run(Base::default());
    assert_eq!(outcome.expect("ready").ending, Ending::Complete);
    let motions: Vec<_> = heard.iter().filter(|(_, f)| f.id == MOTION).collect();
    assert_eq!(heard.iter().filter(|(_, f)| f.id == MODE).count(), 1);
    assert_eq!(heard[0].1, mode_frame());
    assert!(motions.windows(2).all(|w| (w[1].0 - w[0].0 - FRAME_TIME).abs() < 1e-9));
    let zeros = motions.iter().rev().take_while(|(_, f)| f.data == [0; 8]).count();
    assert!(zeros >= 25, "{zeros} zero frames");
    // What it drives is what was planned.
    let driven: f64 =
        motions.iter().map(|(_, f)| f64::from(i16::from_be_bytes([f.data[0], f.data[1]])) * 1e-3 * FRAME_TIME).sum();
    let table = drive(600);
    let planned: f64 = (0..table.rows.len()).map(|k| table.twist(k).0 * table.sampling_time).sum();
    assert!((driven - planned).abs() < 2.0 * UNIT_LENGTH, "{driven} of {planned} m");
}

/// What half a unit is worth in a frame, m.
const UNIT_LENGTH: f64 = 0.5e-3 * FRAME_TIME;

#[test]
fn a_base_that_cannot_be_driven_gets_no_motion_command() {
    for (base, why) in [
        (Base { silent_from: Some(0.0), ..Base::default() }, "no 0x211 within 0.2 s"),
        (Base { vehicle: 2, ..Base::default() }, "it reports a fault"),
        (Base { vehicle: 1, ..Base::default() }, "its emergency stop is pressed"),
        (Base { stubborn: true, ..Base::default() }, "SWB up"),
    ] {
        let (outcome, heard) = run(base);
        let Err(SinkError::NotReady(said)) = outcome else { panic!("{outcome:?}") };
        assert!(said.contains(why), "{said}");
        assert!(heard.iter().all(|(_, f)| f.id != MOTION));
    }
}

#[test]
fn an_emergency_stop_on_the_way_is_answered_with_zero_at_once() {
    let (outcome, heard) = run(Base { stopped_from: Some(2.0), ..Base::default() });
    let Ending::Cut(Reason::Sink(SinkError::Halted(why))) = outcome.expect("ready").ending else { panic!("no cut") };
    assert!(why.contains("emergency stop"), "{why}");
    assert!(heard.iter().filter(|(at, _)| *at > 2.05).all(|(_, f)| f.data == [0; 8]));
}

#[test]
fn a_base_that_falls_silent_is_brought_to_a_stop() {
    let (outcome, heard) = run(Base { silent_from: Some(2.0), ..Base::default() });
    let Ending::Stopped(Reason::Sink(SinkError::Lost(why))) = outcome.expect("ready").ending else { panic!("no stop") };
    assert!(why.contains("silent"), "{why}");
    let speed = |f: &Frame| f64::from(i16::from_be_bytes([f.data[0], f.data[1]])) * 1e-3;
    let speeds: Vec<f64> = heard.iter().filter(|(_, f)| f.id == MOTION).map(|(_, f)| speed(f)).collect();
    // 0.5 m/s^2 in 20 ms, and the rounding.
    assert!(speeds.windows(2).all(|w| (w[1] - w[0]).abs() <= 0.5 * FRAME_TIME + 2e-3));
    assert_eq!(speeds.last(), Some(&0.0));
}

#[test]
fn what_frames_cannot_hold_is_refused() {
    let none = BaseLimits { speed: None };
    let straight = |rim: f64| table(&[vec![rim / 0.1, 0.0], vec![rim / 0.1, 0.0], vec![0.0, 0.0]], 0.1);
    assert_eq!(refuse(&straight(32.0), none, false), Ok(()));
    assert!(matches!(refuse(&straight(33.0), none, false), Err(CanRefusal::TooFast { limit, .. }) if limit == 32.767));
    let limits = BaseLimits { speed: Some(1.5) };
    assert_eq!(refuse(&straight(1.5), limits, false), Ok(()));
    assert!(matches!(refuse(&straight(-1.6), limits, false), Err(CanRefusal::TooFast { limit, .. }) if limit == 1.5));
    let spin = table(&[vec![-70.0, 0.0], vec![70.0, 0.0]], 0.1);
    assert!(matches!(refuse(&spin, none, false), Err(CanRefusal::TooFast { unit: "rad/s", .. })));
    let moving = table(&[vec![0.0, 0.0], vec![0.0, 0.0], vec![0.1, 0.0]], 0.1);
    assert_eq!(refuse(&moving, none, false), Err(CanRefusal::Joints { joint: "joint0".into() }));
    assert_eq!(refuse(&moving, none, true), Ok(()));
}
