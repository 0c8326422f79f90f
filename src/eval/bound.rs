//! A travel time that no plan can beat, obstacles and jerk left out.

use crate::geom::{Pose2, wrap_angle};
use crate::math::real;
use crate::robot::BaseLimits;

/// Step of the integral, s.
const STEP: f64 = 2e-3;
/// The bound is found to this, s.
const TOLERANCE: f64 = 1e-3;

/// Lower bound on the time from rest at `start` to rest at `goal`, s, without obstacles.
///
/// Progress along the line to the goal is at most v(t) cos(angle between heading and line). From rest, v <= min(a t, a (T - t),
/// v_max). The heading starts off the line by some angle and can have turned by no more than alpha t^2 / 2 (and omega_max t);
/// likewise, seen backwards, at the end. The least T for which that integral covers the distance. Backwards driving may
/// count the angle from the other end of the robot.
pub fn travel_time(start: Pose2, goal: Pose2, limits: &BaseLimits, reverse: bool) -> f64 {
    let distance = start.distance(goal);
    let line = real::atan2(goal.y - start.y, goal.x - start.x);
    let off = |yaw: f64| {
        let angle = wrap_angle(yaw - line).abs();
        if reverse { angle.min(std::f64::consts::PI - angle) } else { angle }
    };
    if distance == 0.0 {
        return 0.0;
    }
    let (off_start, off_goal) = (off(start.yaw), off(goal.yaw));
    let toward = |off: f64, t: f64| {
        let turned = (0.5 * limits.angular_acceleration * t * t).min(limits.angular_speed * t);
        real::cos((off - turned).max(0.0)).max(0.0)
    };
    let progress = |time: f64| -> f64 {
        let steps = (time / STEP).ceil().max(1.0);
        let width = time / steps;
        let at = |t: f64| {
            let v = (limits.acceleration * t.min(time - t)).min(limits.speed);
            v * toward(off_start, t).min(toward(off_goal, time - t))
        };
        (0..steps as usize).map(|k| width * at((k as f64 + 0.5) * width)).sum()
    };
    let ramp = limits.speed / limits.acceleration;
    let slowest_turn = |off: f64| off / limits.angular_speed + (2.0 * off / limits.angular_acceleration).sqrt();
    let mut high = distance / limits.speed + 2.0 * ramp + slowest_turn(off_start) + slowest_turn(off_goal);
    let mut low = 0.0;
    while high - low > TOLERANCE {
        let middle = 0.5 * (low + high);
        if progress(middle) < distance { low = middle } else { high = middle }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: BaseLimits = BaseLimits {
        speed: 1.0,
        acceleration: 1.0,
        angular_speed: 2.5,
        angular_acceleration: 2.5,
        eta: 0.4,
        min_speed: 0.01,
    };

    fn time(start: f64, goal: f64, distance: f64, reverse: bool) -> f64 {
        travel_time(Pose2::new(1.0, 2.0, start), Pose2::new(1.0 + distance, 2.0, goal), &LIMITS, reverse)
    }

    #[test]
    fn straight_ahead_it_is_the_trapezoid() {
        assert!((time(0.0, 0.0, 4.0, false) - 5.0).abs() < 5e-3, "1 s up, 3 m on, 1 s down");
        assert!((time(0.0, 0.0, 0.25, false) - 1.0).abs() < 5e-3, "a triangle");
        assert_eq!(time(1.0, 0.0, 0.0, false), 0.0);
    }

    #[test]
    fn facing_away_costs_time_at_either_end_alike_and_less_than_spinning_first() {
        use std::f64::consts::PI;
        let (start, goal, both) = (time(PI, 0.0, 4.0, false), time(0.0, PI, 4.0, false), time(PI, PI, 4.0, false));
        assert!((start - goal).abs() < 5e-3 && start > 5.3 && both > start + 0.3);
        // A spin of pi at alpha 2.5: the trapezoid with peak 2.5 rad/s takes pi / 2.5 + 1 s.
        assert!(start < 5.0 + PI / 2.5 + 1.0);
        assert!((time(PI, PI, 4.0, true) - 5.0).abs() < 5e-3, "backwards all the way");
    }
}
