//! The reference's clock. It goes at the file's pace where the robot keeps up, slower where it lags, and never back.
//!
//! A wheel's lag is the way of its rim from where it is to where the reference has it, as far as that is ahead of it. Up to a small one
//! the law alone takes it away; from there on the pace falls, linearly, to zero at a large one. It falls and rises no faster than
//! actuators can follow, so that the reference stays one that could be driven.

use super::law::Error;
use super::limiter::{Bounds, Held};
use super::{Phase, Sighting, State, Tracker};

/// Lag of a wheel's rim from which time is held back, and at which it stands: m, and s of the rim's speed.
const WHEEL_LAG: [(f64, f64); 2] = [(0.005, 0.02), (0.03, 0.12)];
/// Likewise of joints: rad or m, and s of their speed.
const JOINT_LAG: [(f64, f64); 2] = [(0.02, 0.1), (0.1, 0.4)];
/// Share of the actuators' acceleration and jerk that a change of pace may take.
const SHARE: f64 = 0.5;
/// Greatest change of pace, 1/s, and of that, 1/s^2.
const CHANGE: [f64; 2] = [5.0, 50.0];
/// Below this pace the robot is said to wait.
const WAITING: f64 = 0.9;

/// The pace at a lag.
fn pace(lag: f64, speed: f64, limits: [(f64, f64); 2]) -> f64 {
    let [free, held] = limits.map(|(fixed, time)| fixed + time * speed);
    1.0 - ((lag - free) / (held - free)).clamp(0.0, 1.0)
}

impl Tracker<'_> {
    /// Sets how fast the reference's time goes from here on.
    pub(super) fn set_pace(&self, next: &mut State, error: Error, seen: Option<&Sighting>, time: f64) {
        let hold = self.motion.table().sampling_time;
        let at = next.path_time / hold;
        let speeds: Vec<f64> = (0..self.motion.actuators())
            .map(|k| (self.motion.travel(k, at + time / hold) - self.motion.travel(k, at)) * hold / time)
            .collect();
        let mut wanted = if next.observer.is_some() && next.moves() { 1.0f64 } else { 0.0 };
        for (wheel, side) in [-0.5, 0.5].into_iter().enumerate() {
            let speed = speeds[wheel];
            let behind = (error.along + side * self.drive.track_width * error.heading) * speed.signum();
            wanted = wanted.min(pace(behind, self.drive.wheel_radii[wheel] * speed.abs(), WHEEL_LAG));
        }
        for (joint, value) in seen.iter().flat_map(|seen| seen.joints.iter().enumerate()).take(next.joints.len()) {
            if let Some(value) = value {
                let lag = (self.motion.joint(joint, at) - value).abs();
                wanted = wanted.min(pace(lag, speeds[2 + joint].abs(), JOINT_LAG));
            }
        }
        let most = |order: usize| {
            let of = |k: usize| SHARE * [self.bounds[k].acceleration, self.bounds[k].jerk][order] / speeds[k].abs();
            (0..speeds.len()).map(of).fold(CHANGE[order], f64::min)
        };
        // The pace is between 0 and its greatest as a speed is between its limits, about the middle.
        let middle = 0.5 * self.fastest;
        let bounds = Bounds { speed: middle, acceleration: most(0), jerk: most(1) };
        let about = Held { speed: next.pace - middle, acceleration: next.pace_rate };
        let [low, high] = bounds.admissible(about, time);
        let pace = middle + bounds.approach(about, self.fastest * wanted - middle, 0.0, 1.0, time).clamp(low, high);
        next.pace_rate = (pace - next.pace) / time;
        next.pace = pace.clamp(0.0, self.fastest);
        if next.moves() {
            let waits = next.pace < WAITING * self.fastest && next.path_time < self.duration();
            next.phase = if waits { Phase::Waiting } else { Phase::Tracking };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_lags_cost_no_time_and_large_ones_hold_it() {
        let [free, held] = WHEEL_LAG.map(|(fixed, time)| fixed + 0.5 * time);
        assert_eq!(pace(-1.0, 0.5, WHEEL_LAG), 1.0, "ahead");
        assert_eq!((pace(free, 0.5, WHEEL_LAG), pace(held, 0.5, WHEEL_LAG)), (1.0, 0.0));
        assert!((pace(0.5 * (free + held), 0.5, WHEEL_LAG) - 0.5).abs() < 1e-12);
        assert_eq!(pace(9.0, 0.5, WHEEL_LAG), 0.0);
    }
}
