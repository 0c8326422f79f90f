//! Time as the player sees it.

use std::cell::Cell;
use std::rc::Rc;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Slept in one go at most, s: how long a signal may go unseen.
const SLICE: f64 = 0.01;
/// The end of a wait that is not slept but spun through, s: a sleep ends late by about a third of this on an idle machine.
const SPIN: f64 = 150e-6;

/// A clock that never goes back.
pub trait Clock {
    /// Seconds since an instant that stays the same.
    fn now(&self) -> f64;
    /// Waits until then; false, and early, as soon as `interrupted` says so.
    fn wait(&mut self, until: f64, interrupted: &dyn Fn() -> bool) -> bool;
}

/// Nanoseconds since 1970, for the stamps of what is sent. Never for the schedule: this clock may be set.
pub fn wall_time() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_nanos() as u64)
}

/// The machine's monotonic clock.
#[derive(Debug)]
pub struct MonotonicClock(Instant);

impl MonotonicClock {
    /// Zero is now.
    pub fn new() -> Self {
        Self(Instant::now())
    }
}

impl Default for MonotonicClock {
    fn default() -> Self {
        Self::new()
    }
}

impl Clock for MonotonicClock {
    fn now(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }

    fn wait(&mut self, until: f64, interrupted: &dyn Fn() -> bool) -> bool {
        loop {
            if interrupted() {
                return false;
            }
            let left = until - self.now();
            if left <= 0.0 {
                return true;
            }
            if left > SPIN {
                std::thread::sleep(Duration::from_secs_f64((left - SPIN).min(SLICE)));
            } else {
                std::hint::spin_loop();
            }
        }
    }
}

/// A clock that is wherever it is set to; waiting takes no time. Clones show the same time.
#[derive(Debug, Clone, Default)]
pub struct SimulatedClock(Rc<Cell<f64>>);

impl SimulatedClock {
    /// Lets time pass.
    pub fn advance(&self, seconds: f64) {
        self.0.set(self.0.get() + seconds);
    }
}

impl Clock for SimulatedClock {
    fn now(&self) -> f64 {
        self.0.get()
    }

    fn wait(&mut self, until: f64, interrupted: &dyn Fn() -> bool) -> bool {
        if interrupted() {
            return false;
        }
        self.0.set(self.0.get().max(until));
        true
    }
}
