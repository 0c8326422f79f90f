//! The time laws: which clock a leg gets, and by how much it is slowed down.

use std::sync::Arc;

use crate::mission::TimeLaw;
use crate::robot::RobotModel;

use super::RetimeError;
use super::convolution::Convolution;
use super::course::{Course, Curved, Proportional};
use super::limits::{Scope, append_turn, limits, planning};
use super::metric::Metric;
use super::optimal::{self, Problem};
use super::peaks::{HELD_JUMP, peaks, slow_down};
use super::steered::time_steered;
use super::timed_leg::{Clock, TimedLeg};
use super::warp::Warp;

/// Shortest ramp of `minco` that is tried, s, and the factor to the next one.
const RAMPS: (f64, f64) = (0.05, 1.5);
/// Below this share of the limit, what Eq. 5 leaves is no speed to drive with.
pub(super) const LEAST_SPEED: f64 = 1e-3;

/// What the laws need to know besides the leg.
#[derive(Debug, Clone, Copy)]
pub struct Task<'a> {
    /// Its limits.
    pub robot: &'a RobotModel,
    /// For how long a command is held, s.
    pub hold: f64,
    /// The curve's parameter is the optimiser's own time.
    pub own_timing: bool,
    /// The whole trajectory is one given cubic segment.
    pub one_segment: bool,
    /// Index of the leg, for messages.
    pub leg: usize,
}

/// Times one leg under a law.
///
/// # Errors
/// The law cannot time this leg.
pub fn time_leg(course: &Course, law: TimeLaw, task: Task<'_>) -> Result<TimedLeg, RetimeError> {
    let curved = match course {
        Course::Proportional(p) => return Ok(proportional(p, task.robot)),
        Course::Steered(steered) => return time_steered(steered, law, task),
        Course::Curved(curved) => curved,
    };
    match law {
        TimeLaw::Auto => {
            let mut best: Option<TimedLeg> = None;
            for law in [TimeLaw::Optimal, TimeLaw::Minco, TimeLaw::Eq5, TimeLaw::FixedPoint] {
                let Ok(leg) = time_leg(course, law, task) else { continue };
                if std::env::var("DBG").is_ok() {
                    eprint!("{law:?} {:.4}; ", leg.duration());
                }
                let leg = if law == TimeLaw::Optimal { leg } else { guarded(TimedLeg { stretch: 1.0, ..leg }, task) };
                if std::env::var("DBG").is_ok() {
                    eprint!("guarded {:.4}; ", leg.duration());
                }
                if best.as_ref().is_none_or(|best| leg.duration() < best.duration()) {
                    best = Some(leg);
                }
            }
            if std::env::var("DBG").is_ok() {
                eprintln!();
            }
            Ok(best.expect("fixed_point times every curve"))
        }
        TimeLaw::FixedPoint => {
            let limits = centre_limits(task.robot);
            let speed = fixed_point_speed(curved, task.robot);
            Ok(convolved(curved, TimeLaw::FixedPoint, Clock::ArcLength, [speed, limits[1], limits[2]], limits[0], task))
        }
        TimeLaw::Eq5 => corrected(curved, TimeLaw::Eq5, Clock::ArcLength, task),
        TimeLaw::Printed if task.one_segment => corrected(curved, TimeLaw::Printed, Clock::Printed, task),
        TimeLaw::Printed => Err(RetimeError::PrintedNeedsOneSegment),
        TimeLaw::Minco if task.own_timing => Ok(own(curved, task)),
        TimeLaw::Minco => Err(RetimeError::NoOwnTiming),
        TimeLaw::Optimal => optimal(curved, task),
        TimeLaw::Wheel => Err(RetimeError::NotYet { law: super::law_key(law) }),
    }
}

/// Speed, acceleration and jerk that the centre's profile is made with, m/s, m/s^2, m/s^3.
pub(super) fn centre_limits(robot: &RobotModel) -> [f64; 3] {
    let [v, a, j] = robot.wheel.planning();
    [v.min(robot.base.speed), a.min(robot.base.acceleration), j]
}

/// The one law of everything that is linear in actuator space: the fastest profile of the share of the way under the limits of all
/// actuators that move, and of the base.
fn proportional(course: &Proportional, robot: &RobotModel) -> TimedLeg {
    let mut limits = [f64::INFINITY; 3];
    let mut keep = |change: f64, of: [f64; 3]| {
        if change.abs() > 0.0 {
            (0..3).for_each(|k| limits[k] = limits[k].min(of[k] / change.abs()));
        }
    };
    course.wheel_changes().iter().for_each(|change| keep(*change, robot.wheel.planning()));
    course.joint_changes.iter().zip(&robot.joints).for_each(|(change, joint)| keep(*change, joint.limits.planning()));
    keep(course.drive, [robot.base.speed, robot.base.acceleration, f64::INFINITY]);
    keep(course.turn, [robot.base.angular_speed, robot.base.angular_acceleration, f64::INFINITY]);
    let moves = limits[0].is_finite();
    TimedLeg {
        course: Course::Proportional(course.clone()),
        clock: Clock::Share(if moves {
            Convolution::fastest(1.0, limits)
        } else {
            Convolution::fastest(0.0, [1.0; 3])
        }),
        stretch: 1.0,
        law: None,
        speed_limit: if course.drive != 0.0 { centre_limits(robot)[0] } else { 0.0 },
        compensation: 0.0,
    }
}

/// A convolution profile along a curve, slowed down until every limit holds.
fn convolved(
    curved: &Curved,
    law: TimeLaw,
    clock: fn(Convolution) -> Clock,
    limits: [f64; 3],
    uncompensated: f64,
    task: Task<'_>,
) -> TimedLeg {
    let leg = TimedLeg {
        course: Course::Curved(curved.clone()),
        clock: clock(Convolution::fastest(curved.curve.length(), limits)),
        stretch: 1.0,
        law: Some(law),
        speed_limit: limits[0],
        compensation: uncompensated - limits[0],
    };
    slowed(leg, task)
}

/// A leg slowed down until every limit holds.
pub(super) fn slowed(leg: TimedLeg, task: Task<'_>) -> TimedLeg {
    TimedLeg { stretch: slow_down(&leg.clock_peaks(true), &limits(task.robot, Scope::Actuators), task.hold), ..leg }
}

/// \[CONV\] Eq. 5, applied once: the speed limit less what the wheels differ by under the uncorrected profile.
///
/// # Errors
/// Nothing is left.
fn corrected(
    curved: &Curved,
    law: TimeLaw,
    clock: fn(Convolution) -> Clock,
    task: Task<'_>,
) -> Result<TimedLeg, RetimeError> {
    let [v, a, j] = centre_limits(task.robot);
    let uncorrected = convolved(curved, law, clock, [v, a, j], v, task);
    let breaks: Vec<f64> = uncorrected.breaks().iter().map(|t| t / uncorrected.stretch).collect();
    let at_full_speed = TimedLeg { stretch: 1.0, ..uncorrected };
    let mut rates = Vec::new();
    let compensation = peaks(&breaks, true, |t, out| {
        rates.clear();
        at_full_speed.rates(t, &mut rates);
        out.push([0.5 * (rates[1][0] - rates[0][0]), 0.0, 0.0]);
    })
    .rates[0][0];
    let wheel_speed = task.robot.wheel.planning()[0];
    let left = v.min(wheel_speed - compensation);
    if left <= LEAST_SPEED * v {
        return Err(RetimeError::CompensationLeavesNoSpeed {
            law: super::law_key(law),
            leg: task.leg,
            radius: 1.0 / largest_curvature(curved),
            half_track: curved.half_track,
            left: wheel_speed - compensation,
        });
    }
    Ok(convolved(curved, law, clock, [left, a, j], v, task))
}

/// The centre's cruise at which the faster wheel just keeps its limit where the curve bends most,
/// `v_max / (1 + D/2 max|curvature|)`: the fixed point of Eq. 5 at constant speed. Joints are left to the slow-down: where they are
/// fastest per metre the base is often slow anyway.
fn fixed_point_speed(curved: &Curved, robot: &RobotModel) -> f64 {
    let wheels = robot.wheel.planning()[0] / (1.0 + curved.half_track * largest_curvature(curved));
    wheels.min(centre_limits(robot)[0])
}

/// Largest |curvature| of a curve, 1/m.
fn largest_curvature(curved: &Curved) -> f64 {
    let curve = &curved.curve;
    let breaks: Vec<f64> = curve.nodes().map(|node| curve.parameter(node)).collect();
    let found = peaks(&breaks, true, |u, out| out.push([curve.curvature(curve.place(u))[0], 0.0, 0.0]));
    found.rates[0][0]
}

/// The optimiser's own timing, with the pair of ramps by which the leg ends soonest after its slow-down.
fn own(curved: &Curved, task: Task<'_>) -> TimedLeg {
    let seconds = curved.curve.duration();
    let limits = limits(task.robot, Scope::Actuators);
    let leg = |ramps: [f64; 2]| TimedLeg {
        course: Course::Curved(curved.clone()),
        clock: Clock::Own(Warp::new(seconds, ramps)),
        stretch: 1.0,
        law: Some(TimeLaw::Minco),
        speed_limit: 0.0,
        compensation: 0.0,
    };
    let lengths: Vec<f64> = std::iter::successors(Some(RAMPS.0), |r| Some(r * RAMPS.1))
        .take_while(|r| *r < seconds.min(10.0))
        .chain([seconds.min(10.0)])
        .collect();
    // What each ramp asks for, and what the stretch between asks for at the curve's own speed.
    let within = |ramps: [f64; 2], from: f64, to: f64| {
        let leg = leg(ramps);
        let breaks: Vec<f64> = leg.breaks().into_iter().filter(|t| (from..=to).contains(t)).collect();
        slow_down(&peaks(&breaks, false, |t, out| leg.rates(t, out)), &limits, task.hold)
    };
    let middle = {
        let curve = &curved.curve;
        let breaks: Vec<f64> = curve.nodes().map(|node| curve.parameter(node)).collect();
        let own_speed = |u: f64, out: &mut Vec<[f64; 3]>| curved.rates(curve.place(u), [1.0, 0.0, 0.0], out);
        slow_down(&peaks(&breaks, false, own_speed), &limits, task.hold)
    };
    let first: Vec<f64> = lengths.iter().map(|r| within([*r, lengths[0]], 0.0, *r)).collect();
    let last: Vec<f64> = lengths
        .iter()
        .map(|r| {
            let duration = seconds + 0.5 * (lengths[0] + r);
            within([lengths[0], *r], duration - r, duration)
        })
        .collect();
    let mut best = (f64::INFINITY, [lengths[0]; 2]);
    for (start, ask_start) in lengths.iter().zip(&first) {
        for (end, ask_end) in lengths.iter().zip(&last) {
            let time = middle.max(*ask_start).max(*ask_end) * (seconds + 0.5 * (start + end));
            if time < best.0 {
                best = (time, [*start, *end]);
            }
        }
    }
    let leg = leg(best.1);
    let peaks = leg.clock_peaks(true);
    let stretch = slow_down(&peaks, &limits, task.hold);
    let centre = peaks.rates.last().map_or(0.0, |rates| rates[0]);
    TimedLeg { stretch, speed_limit: centre / stretch, ..leg }
}

/// The least time under all limits.
///
/// # Errors
/// It was not found.
fn optimal(curved: &Curved, task: Task<'_>) -> Result<TimedLeg, RetimeError> {
    let limits = planning(task.robot);
    let metric = Metric::new(&curved.curve, |place| {
        // The mean square of what the rows are of their limits.
        let mut rows = Vec::with_capacity(limits.len());
        curved.rates(place, [1.0, 0.0, 0.0], &mut rows);
        let mut square = [0.0; 2];
        for ([d1, d2, _], [limit, ..]) in rows[..rows.len() - 1].iter().zip(&limits) {
            let weight = 0.5 / (limit * limit);
            square[0] += weight * d1 * d1;
            square[1] += weight * d1 * d2;
        }
        let rate = square[0].sqrt();
        [rate, square[1] / rate]
    });
    let [speed, acceleration, jerk] = limits[0];
    let profile = Convolution::fastest(metric.length(), [1.0, acceleration / speed, jerk / speed]);
    let clock = Clock::Metric(Arc::new(metric), profile);
    let leg = TimedLeg {
        course: Course::Curved(curved.clone()),
        clock,
        stretch: 1.0,
        law: Some(TimeLaw::Optimal),
        speed_limit: 0.0,
        compensation: 0.0,
    };
    paced(leg, task)
}

/// A leg at the pace of the least time under all limits; its clock is the reference.
///
/// # Errors
/// The least time was not found.
pub(super) fn paced(leg: TimedLeg, task: Task<'_>) -> Result<TimedLeg, RetimeError> {
    let limits = planning(task.robot);
    let [_, acceleration, jerk] = limits[0];
    let pace = {
        let rates = |t: f64, out: &mut Vec<[f64; 3]>| {
            let first = out.len();
            leg.clock_rates(t, out);
            append_turn(task.robot, first, out);
        };
        let problem = Problem {
            breaks: &leg.clock_breaks(),
            limits: &limits,
            jerk_of_jump: HELD_JUMP / task.hold,
            step: 0.125 * acceleration / jerk,
        };
        optimal::fastest(&problem, rates).ok_or(RetimeError::NoOptimum { leg: task.leg })?
    };
    let leg = TimedLeg { clock: Clock::Paced(Box::new(leg.clock), pace), ..leg };
    Ok(guarded(leg, task))
}

/// Slowed down until every limit holds, the base's included.
pub(super) fn guarded(leg: TimedLeg, task: Task<'_>) -> TimedLeg {
    let found = peaks(&leg.clock_breaks(), true, |t, out| {
        let first = out.len();
        leg.clock_rates(t, out);
        append_turn(task.robot, first, out);
    });
    let stretch = slow_down(&found, &limits(task.robot, Scope::Everything), task.hold);
    if std::env::var("DBG").is_ok() && leg.law == Some(TimeLaw::Optimal) {
        let l = limits(task.robot, Scope::Everything);
        eprintln!(
            "stretch {stretch:.5} {:?}",
            found
                .rates
                .iter()
                .zip(&l)
                .map(|(r, l)| [0, 1, 2].map(|k| (1e4 * r[k] / l[k].unwrap_or(1e9)).round() / 1e4))
                .collect::<Vec<_>>()
        );
    }
    let centre = found.rates[found.rates.len() - 3][0];
    TimedLeg { stretch, speed_limit: centre / stretch, ..leg }
}

#[cfg(test)]
mod tests;
