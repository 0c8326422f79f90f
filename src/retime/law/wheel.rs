//! `wheel`: a convolution profile in what the fastest actuator travels.

use std::sync::Arc;

use crate::mission::TimeLaw;
use crate::retime::convolution::Convolution;
use crate::retime::course::{Course, Curved};
use crate::retime::limits::Scope;
use crate::retime::metric::Metric;
use crate::retime::peaks::slow_down;
use crate::retime::timed_leg::{Clock, TimedLeg};
use crate::robot::RobotModel;
use crate::trajectory::plane_curve::Place;

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
    let metric = Metric::new(&curved.curve, |place| fastest(curved, task.robot, inflected, place));
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

/// The speed of the fastest actuator as a share of its limit at a place, with its derivative, both by the curve's parameter.
fn fastest(curved: &Curved, robot: &RobotModel, inflected: f64, place: Place) -> Dual {
    let mut rows = Vec::with_capacity(8);
    curved.rates(place, [1.0, 0.0, 0.0], &mut rows);
    let row = |i: usize, limit: f64| [rows[i][0] / limit, rows[i][1] / limit];
    let speed = robot.wheel.planning()[0];
    let (left, right) = (row(0, speed), row(1, speed));
    let drive = [0.5 * (left[0] + right[0]), 0.5 * (left[1] + right[1])];
    let turn = [0.5 * (right[0] - left[0]), 0.5 * (right[1] - left[1])];
    // The curve's derivative vanishes nowhere, so the driving keeps its sign.
    let drive = drive.map(|d| d * curved.direction);
    let mut rate = plus(drive, magnitude(turn, drive.map(|d| inflected * d)));
    for (i, joint) in robot.joints.iter().enumerate() {
        let joint = magnitude(row(2 + i, joint.limits.planning()[0]), rate.map(|r| ROUNDED * r));
        let difference = [rate[0] - joint[0], rate[1] - joint[1]];
        let sum = plus(rate, joint);
        rate = plus(sum, magnitude(difference, sum.map(|s| ROUNDED * s))).map(|twice| 0.5 * twice);
    }
    rate
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
    use crate::math::poly::{Piece, PiecewisePoly};
    use crate::retime::zones::Zones;
    use crate::trajectory::{DriveLeg, fixtures};

    fn curved(reverse: bool, rows: &[&[f64]]) -> Curved {
        let coefficients = rows.iter().map(|row| row.to_vec()).collect();
        let curve = PiecewisePoly { pieces: vec![Piece { duration: 1.5, coefficients }] };
        match Course::drive(&DriveLeg { curve, reverse, yaw_start: 0.0 }, 0.32).unwrap() {
            Course::Curved(curved) => curved,
            _ => panic!("a curve"),
        }
    }

    #[test]
    fn where_curvature_keeps_its_sign_it_is_the_travel_of_the_faster_wheel() {
        let robot = fixtures::conv();
        let task = Task {
            robot: &robot,
            hold: 0.1,
            own_timing: false,
            one_segment: false,
            leg: 0,
            zones: Zones::new(&[], &robot, 0.1),
        };
        for (reverse, side) in [(false, 0.1), (false, -0.1), (true, 0.1), (true, -0.1)] {
            // Straight at its start, then bent more and more.
            let curved = curved(reverse, &[&[0.0, 1.0], &[0.0, 0.0, 0.0, side]]);
            let Clock::Metric(metric, profile) = time(&curved, task).clock else { panic!("a metric") };
            let travel = curved.curve.length() + 0.16 * curved.curve.total_turn().abs();
            assert!((0.5 * metric.length() / travel - 1.0).abs() < 1e-9, "{} {travel}", metric.length());
            assert_eq!(profile.distance(), metric.length());
        }
    }

    #[test]
    fn the_fastest_of_wheels_and_joints_counts_and_is_rounded_where_two_are_nearly_as_fast() {
        let mut robot = fixtures::scr_db();
        robot.joints.push(robot.joints[0].clone());
        robot.joints[1].limits.speed = Some(0.7);
        let rows: [&[f64]; 4] = [&[0.0, 0.3, 0.1], &[0.0, 0.0, 0.12], &[0.1, 2.5, -0.9, -0.1], &[0.4, -0.1, 0.0, 0.8]];
        for reverse in [false, true] {
            let curved = curved(reverse, &rows);
            let mut alone = [0; 3];
            for i in 1..300 {
                let place = |i: f64| Place { piece: 0, u: 0.005 * i };
                let mut rates = Vec::new();
                curved.rates(place(f64::from(i)), [1.0, 0.0, 0.0], &mut rates);
                let share = |row: usize, limit: f64| rates[row][0].abs() / limit;
                let shares = [share(0, 0.5).max(share(1, 0.5)), share(2, 1.0), share(3, 0.7)];
                let [value, slope] = fastest(&curved, &robot, 0.0, place(f64::from(i)));
                let most = shares.iter().copied().fold(0.0, f64::max);
                assert!(value >= most * (1.0 - 1e-12) && value <= 1.5 * most, "{value} {shares:?}");
                for (which, count) in alone.iter_mut().enumerate() {
                    if (0..3).all(|other| other == which || shares[other] < 0.5 * shares[which]) {
                        *count += 1;
                        // Rounded only by how small the others are.
                        assert!((value / shares[which] - 1.0).abs() < 0.3, "{which}: {value} {shares:?}");
                    }
                }
                let h = 1e-3;
                let [low, high] = [-h, h].map(|h| fastest(&curved, &robot, 0.0, place(f64::from(i) + h))[0]);
                assert!(((high - low) / (0.01 * h) - slope).abs() < 1e-5 * (1.0 + slope.abs()), "{i}: {slope}");
            }
            assert!(alone[1] > 20 && alone[2] > 20, "{alone:?}");
            // Of wheels and one joint, far apart: exactly.
            robot.joints.truncate(1);
            let place = Place { piece: 0, u: 0.0 };
            assert!((fastest(&curved, &robot, 0.0, place)[0] - 2.5).abs() < 1e-12);
            robot.joints.push(robot.joints[0].clone());
            robot.joints[1].limits.speed = Some(0.7);
        }
    }

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
