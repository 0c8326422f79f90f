//! The tracking law of a differential drive around a reference motion.
//!
//! With the error of the pose in the robot's frame (`along`, `across`: reference minus robot; `heading`: likewise) and the
//! reference's speed `v` and turn rate `w`,
//!
//! ```text
//! speed     = v cos(heading) + k along
//! turn rate = w + b v sinc(heading) across + k heading
//! k         = 2 zeta sqrt(w^2 + b v^2 + floor^2)
//! ```
//!
//! This is the nonlinear design of De Luca, Oriolo, Vendittelli, "Control of wheeled mobile robots: an experimental overview" (RAMSETE,
//! LNCIS 270, 2001, section 5.2; after Samson 1993), with their gains `k1 = k3`, `k2 = b`, and a floor that keeps `k` from vanishing
//! where the reference slows down. Kanayama et al. (ICRA 1990) is its forerunner.
//!
//! **Why it is stable.** Put into the error's own motion, `V = (along^2 + across^2)/2 + heading^2/(2 b)` falls as
//! `-k along^2 - k/b heading^2`, whatever the (positive) `k` and however large the error: the terms with `across` cancel. `across` goes to
//! zero as well while the reference drives (`v`) or spins (`w`); where it does neither, a differential drive has no way to the side.
//!
//! **How much delay it bears.** About a straight line the loop of `across` and `heading` is `(2 zeta n s + n^2)/s^2` with `n^2 = b v^2`. Its gain
//! is one at `n sqrt(2 zeta^2 + sqrt(4 zeta^4 + 1))` = 1.88 n for zeta = 0.9, where its phase has 73 degrees left: 0.68/n seconds of delay.
//! The loops of `along`, and of `heading` in a spin, are `2 zeta n/s`: 0.87/n seconds. `n` is kept at or below `FASTEST`, so every loop
//! bears 0.37 s; what delays it is half of the time that a command is held, and latency while it is not known yet. [`longest_hold`] says for
//! how long a command may be held.
//!
//! **How much it asks for.** Taking back an error `e` with a gain `k` asks for an acceleration of about `k^2 e` and a jerk of about `k^3 e`. The law is
//! no faster than what the actuators keep in reserve for [`USUAL`] errors ([`Gains::within`]): one that asks for more saturates,
//! and a saturated loop overshoots whatever its margins say.

use crate::geom::{Pose2, sinc, wrap_angle};
use crate::math::real;

/// Damping, `zeta`.
const DAMPING: f64 = 0.9;
/// Errors that must not saturate the actuators, m (of a wheel's rim).
pub const USUAL: f64 = 0.02;
/// `b`, 1/m^2: errors to the side vanish over about 1/sqrt(b) = 0.3 m of way.
const STIFFNESS: f64 = 12.0;
/// The floor under the natural frequency, 1/s: what is left at the end of a motion is taken away with k = 1.1/s.
const FLOOR: f64 = 0.6;
/// The greatest natural frequency, 1/s.
const FASTEST: f64 = 1.8;
/// Seconds of delay times natural frequency at which the loop that bears least is no longer stable.
const MARGIN: f64 = 0.68;

/// A twist: speed in m/s, turn rate in rad/s.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Twist {
    /// m/s, ahead.
    pub speed: f64,
    /// rad/s, to the left.
    pub turn_rate: f64,
}

/// Where the reference is, seen from the robot.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Error {
    /// m, ahead.
    pub along: f64,
    /// m, to the left.
    pub across: f64,
    /// rad, in (-pi, pi].
    pub heading: f64,
}

/// The reference as the robot sees it.
pub fn error(reference: Pose2, robot: Pose2) -> Error {
    let (sin, cos) = real::sin_cos(robot.yaw);
    let (dx, dy) = (reference.x - robot.x, reference.y - robot.y);
    Error { along: cos * dx + sin * dy, across: cos * dy - sin * dx, heading: wrap_angle(reference.yaw - robot.yaw) }
}

/// How fast the law is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gains {
    /// Greatest natural frequency, 1/s.
    fastest: f64,
}

impl Default for Gains {
    /// As fast as delays allow.
    fn default() -> Self {
        Self { fastest: FASTEST }
    }
}

impl Gains {
    /// For wheels that have so much acceleration (m/s^2) and jerk (m/s^3) of the rim left for corrections.
    pub fn within(acceleration: f64, jerk: f64) -> Self {
        let gain = (acceleration / USUAL).sqrt().min(real::cbrt(jerk / USUAL));
        Self { fastest: (gain / (2.0 * DAMPING)).min(FASTEST) }
    }
}

/// The twist that leads back to the reference.
pub fn twist(gains: Gains, error: Error, reference: Twist) -> Twist {
    let Twist { speed, turn_rate } = reference;
    let Gains { fastest } = gains;
    // Fast references: as stiff as the fastest loop allows.
    let stiffness = STIFFNESS.min(real::powi(fastest / speed.abs().max(1e-9), 2));
    let natural = (turn_rate * turn_rate + stiffness * speed * speed + FLOOR * FLOOR).sqrt().min(fastest);
    let gain = 2.0 * DAMPING * natural;
    Twist {
        speed: speed * real::cos(error.heading) + gain * error.along,
        turn_rate: turn_rate + stiffness * speed * sinc(error.heading) * error.across + gain * error.heading,
    }
}

/// For how long a command may be held so that the loops keep half of what they bear, s, where `latency` seconds are not predicted.
pub fn longest_hold(latency: f64) -> f64 {
    // A held command is late by half of its time in the mean.
    2.0 * (0.5 * MARGIN / FASTEST - latency).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The error after driving a law for so long from an error, each command held for `hold` and late by `late` holds.
    fn driven(start: Error, reference: Twist, hold: f64, late: usize, time: f64) -> Error {
        let (sin, cos) = real::sin_cos(-start.heading);
        let (x, y) = (cos * start.along - sin * start.across, sin * start.along + cos * start.across);
        let (mut robot, mut there) = (Pose2::new(-x, -y, -start.heading), Pose2::default());
        let mut waiting = std::collections::VecDeque::from(vec![reference; late]);
        for _ in 0..(time / hold) as usize {
            waiting.push_back(twist(Gains::default(), error(there, robot), reference));
            let now = waiting.pop_front().expect("one was put in");
            robot = robot.after_twist(now.speed, now.turn_rate, hold);
            there = there.after_twist(reference.speed, reference.turn_rate, hold);
        }
        error(there, robot)
    }

    fn size(e: Error) -> f64 {
        real::hypot(real::hypot(e.along, e.across), e.heading)
    }

    const STARTS: [Error; 3] = [
        Error { along: 0.1, across: -0.1, heading: 0.3 },
        Error { along: -0.2, across: 0.15, heading: -1.0 },
        Error { along: 0.0, across: 0.3, heading: 2.8 },
    ];
    const REFERENCES: [Twist; 5] = [
        Twist { speed: 0.5, turn_rate: 0.0 },
        Twist { speed: 1.5, turn_rate: 0.4 },
        Twist { speed: -0.3, turn_rate: 0.2 },
        Twist { speed: 0.0, turn_rate: 1.0 },
        Twist { speed: 0.05, turn_rate: -0.6 },
    ];

    #[test]
    fn the_potential_falls_by_what_the_proof_says() {
        // Below the fastest loop, where the stiffness is constant.
        let potential = |e: Error| {
            0.5 * (real::powi(e.along, 2) + real::powi(e.across, 2)) + 0.5 * real::powi(e.heading, 2) / STIFFNESS
        };
        for reference in REFERENCES.into_iter().filter(|r| r.speed.abs() < 0.5) {
            for start in STARTS {
                let step = 1e-6;
                let after = driven(start, reference, step, 0, 1.5 * step);
                let n2 = real::powi(reference.turn_rate, 2)
                    + STIFFNESS * real::powi(reference.speed, 2)
                    + real::powi(FLOOR, 2);
                let gain = 2.0 * DAMPING * n2.sqrt().min(FASTEST);
                let falls = gain * (real::powi(start.along, 2) + real::powi(start.heading, 2) / STIFFNESS);
                let found = (potential(start) - potential(after)) / step;
                assert!((found - falls).abs() < 1e-4 * (1.0 + falls), "{reference:?} {start:?}: {found} {falls}");
            }
        }
    }

    #[test]
    fn errors_vanish_on_lines_arcs_and_spins() {
        for reference in REFERENCES {
            for start in STARTS {
                let left = driven(start, reference, 0.01, 0, 60.0);
                assert!(size(left) < 1e-6, "{reference:?} {start:?}: {left:?}");
            }
        }
    }

    #[test]
    fn the_margin_is_that_of_the_loops_as_computed() {
        // Gain one where u = (w/n)^2 solves 4 zeta^2 u + 1 = u^2; the phase left there, over the frequency.
        let z2 = DAMPING * DAMPING;
        let frequency = (2.0 * z2 + (4.0 * z2 * z2 + 1.0).sqrt()).sqrt();
        let lateral = real::atan(2.0 * DAMPING * frequency) / frequency;
        let along = std::f64::consts::FRAC_PI_2 / (2.0 * DAMPING);
        assert!((MARGIN - lateral.min(along)).abs() < 0.01, "{lateral} {along}");
    }

    #[test]
    fn half_of_the_margin_in_latency_is_borne_and_more_than_it_is_not() {
        let start = Error { along: 0.05, across: 0.05, heading: 0.1 };
        let fastest = Twist { speed: 1.0, turn_rate: 0.0 };
        let hold = 0.02;
        for latency in [0.02, 0.1, 0.5 * MARGIN / FASTEST] {
            let left = driven(start, fastest, hold, (latency / hold) as usize, 30.0);
            assert!(size(left) < 1e-6, "{latency} s: {left:?}");
        }
        let late = (1.3 * MARGIN / FASTEST / hold) as usize;
        assert!(size(driven(start, fastest, hold, late, 30.0)) > size(start), "the bound is not idle");
        // A command that is held as long as it may be.
        assert!(size(driven(start, fastest, longest_hold(0.0), 0, 30.0)) < 1e-4);
    }
}
