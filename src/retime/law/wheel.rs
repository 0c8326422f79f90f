//! `wheel`: a convolution profile in what the fastest actuator travels.

use std::sync::Arc;

use crate::mission::TimeLaw;
use crate::retime::convolution::Convolution;
use crate::retime::course::{Course, Curved};
use crate::retime::limits::Scope;
use crate::retime::metric::Metric;
use crate::retime::peaks::slow_down;
use crate::retime::timed_leg::{Clock, TimedLeg};

use super::{Task, peaks_of, with_peak_speed};

/// A kink of the metric is rounded where two actuators differ in speed by less than this share of their sum, and, on a curve with
/// inflections, where it bends by less than this share of its sharpest bend.
const ROUNDED: f64 = 0.3;

/// The profile in `|ds| + D/2 |dphi|`, the travel of the faster wheel, or in a joint's where that is nearer its limit; then slowed down.
///
/// Where curvature keeps its sign and the slower wheel its limits, nothing can be faster. At inflections |dphi| has a kink, which would
/// be a jerk impulse: the metric is rounded there, and a little larger than the travel.
pub(super) fn time(curved: &Curved, task: Task<'_>) -> TimedLeg {
    let [speed, acceleration, jerk] = task.robot.wheel.planning();
    let bends = curved.curve.nodes().map(|node| curved.half_track * curved.curve.curvature(node)[0]);
    let (lowest, highest) = bends.fold((0.0f64, 0.0f64), |(low, high), bend| (low.min(bend), high.max(bend)));
    let inflected = if lowest < 0.0 && highest > 0.0 { ROUNDED * highest.max(-lowest) } else { 0.0 };
    let metric = Metric::new(&curved.curve, |place| {
        let mut rows = Vec::with_capacity(8);
        curved.rates(place, [1.0, 0.0, 0.0], &mut rows);
        let row = |i: usize, limit: f64| [rows[i][0] / limit, rows[i][1] / limit];
        let (left, right) = (row(0, speed), row(1, speed));
        let drive = [0.5 * (left[0] + right[0]), 0.5 * (left[1] + right[1])];
        let turn = [0.5 * (right[0] - left[0]), 0.5 * (right[1] - left[1])];
        // The curve's derivative vanishes nowhere, so the driving keeps its sign.
        let drive = drive.map(|d| d * curved.direction);
        let mut rate = plus(drive, magnitude(turn, drive.map(|d| inflected * d)));
        for (i, joint) in task.robot.joints.iter().enumerate() {
            let joint = magnitude(row(2 + i, joint.limits.planning()[0]), rate.map(|r| ROUNDED * r));
            let difference = [rate[0] - joint[0], rate[1] - joint[1]];
            let sum = plus(rate, joint);
            rate = plus(sum, magnitude(difference, sum.map(|s| ROUNDED * s))).map(|twice| 0.5 * twice);
        }
        rate
    });
    // The centre's own limit of speed and acceleration; never faster than the faster wheel.
    let base = &task.robot.base;
    let shares = [speed.min(base.speed), acceleration.min(base.acceleration), jerk].map(|limit| limit / speed);
    let profile = Convolution::fastest(metric.length(), shares);
    let leg = TimedLeg {
        course: Course::Curved(curved.clone()),
        clock: Clock::Metric(Arc::new(metric), profile),
        stretch: 1.0,
        law: Some(TimeLaw::Wheel),
        speed_limit: 0.0,
        compensation: 0.0,
    };
    let peaks = peaks_of(&leg, task, Scope::Actuators);
    let stretch = slow_down(&peaks, &task.limits(Scope::Actuators), task.hold);
    with_peak_speed(TimedLeg { stretch, ..leg }, &peaks, task)
}

/// A value with its derivative.
type Dual = [f64; 2];

fn plus(a: Dual, b: Dual) -> Dual {
    [a[0] + b[0], a[1] + b[1]]
}

/// |x|, but for |x| below `width` an even polynomial that joins it in two derivatives: never below |x|.
fn magnitude(x: Dual, width: Dual) -> Dual {
    if x[0].abs() >= width[0] {
        return [x[0].abs(), x[1] * x[0].signum()];
    }
    let y = x[0] / width[0];
    let square = y * y;
    let value = 0.375 + square * (0.75 - 0.125 * square);
    let slope = y * (1.5 - 0.5 * square);
    [width[0] * value, slope * x[1] + (value - y * slope) * width[1]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rounded_magnitude_is_smooth_and_never_too_small() {
        let at = |t: f64| magnitude([t * t * t - 0.2, 3.0 * t * t], [0.3 + 0.1 * t, 0.1]);
        let h = 1e-6;
        for i in -100..=100 {
            let t = f64::from(i) * 0.01;
            let [value, slope] = at(t);
            assert!(value >= (t * t * t - 0.2).abs() - 1e-15);
            assert!(((at(t + h)[0] - at(t - h)[0]) / (2.0 * h) - slope).abs() < 1e-8, "at {t}");
            // The slope's own slope is bounded: no kink.
            assert!((at(t + h)[1] - slope).abs() < 40.0 * h, "at {t}");
        }
    }
}
