//! `optimal`: the least time under all limits of wheels, joints and base.

use std::sync::Arc;

use crate::mission::TimeLaw;
use crate::retime::RetimeError;
use crate::retime::convolution::Convolution;
use crate::retime::course::{Course, Curved};
use crate::retime::limits::{Scope, append_turn, planning};
use crate::retime::metric::Metric;
use crate::retime::optimal::{self, Problem};
use crate::retime::peaks::{HELD_JUMP, Peaks, slow_down};
use crate::retime::timed_leg::{Clock, TimedLeg};

use super::{Task, peaks_of, with_peak_speed};

/// How often a leg is made again where it is too fast in a zone.
const ROUNDS: usize = 3;
/// Too fast by less than this share is left to the slow-down.
const BEYOND: f64 = 1.002;

/// The fastest leg that keeps every limit.
///
/// # Errors
/// It was not found.
pub(super) fn time(curved: &Curved, task: Task<'_>) -> Result<TimedLeg, RetimeError> {
    let leg = TimedLeg {
        course: Course::Curved(curved.clone()),
        clock: reference(curved, task),
        stretch: 1.0,
        law: Some(TimeLaw::Optimal),
        speed_limit: 0.0,
        compensation: 0.0,
    };
    paced(leg, task)
}

/// A leg at the pace that keeps every limit and is the fastest, sought from the clock that it has.
///
/// # Errors
/// It was not found.
pub(in crate::retime) fn paced(leg: TimedLeg, task: Task<'_>) -> Result<TimedLeg, RetimeError> {
    let mut tighter = 1.0;
    let mut best: Option<TimedLeg> = None;
    for _ in 0..if task.zones.is_empty() { 1 } else { ROUNDS } {
        let (paced, peaks) = paced_once(leg.clone(), task, tighter)?;
        if best.as_ref().is_none_or(|best| paced.duration() < best.duration()) {
            best = Some(paced);
        }
        // What is allowed by place is steep at a zone's edge, where the law goes furthest beyond its points: better slower there
        // than all along.
        let beyond = peaks.rates[peaks.rates.len() - 1][0];
        if beyond <= BEYOND {
            break;
        }
        tighter *= beyond;
    }
    best.ok_or(RetimeError::NoOptimum { leg: task.leg })
}

/// The same, made for speeds in zones that are less by a factor; and the peaks before the slow-down.
fn paced_once(leg: TimedLeg, task: Task<'_>, tighter: f64) -> Result<(TimedLeg, Peaks), RetimeError> {
    let mut limits_of_rows = planning(task.robot);
    task.zones.planning(tighter, &mut limits_of_rows);
    let problem = Problem {
        breaks: &leg.clock_breaks(),
        limits: &limits_of_rows,
        jerk_of_jump: HELD_JUMP / task.hold,
        step: optimal::step(limits_of_rows[0]),
    };
    let pace = optimal::fastest(&problem, |t, out| {
        let first = out.len();
        leg.clock_rates(t, out);
        append_turn(task.robot, first, out);
        task.zones.append(&leg, t, first, out);
    });
    let pace = pace.ok_or(RetimeError::NoOptimum { leg: task.leg })?;
    let leg = TimedLeg { clock: Clock::Paced(Box::new(leg.clock), pace), ..leg };
    // Between the points at which the law was made, limits are exceeded by a little.
    let peaks = peaks_of(&leg, task, Scope::Everything);
    let stretch = slow_down(&peaks, &task.limits(Scope::Everything), task.hold);
    Ok((with_peak_speed(TimedLeg { stretch, ..leg }, &peaks, task), peaks))
}

/// The clock that the least time is sought from: a convolution profile in a metric that grows with every actuator's motion, so that
/// nothing about it is fast where little moves.
fn reference(curved: &Curved, task: Task<'_>) -> Clock {
    let limits = planning(task.robot);
    let metric = Metric::new(&curved.curve, |place| {
        // Root of the sum of squares of speeds as shares of their limits, 1 where both wheels are at theirs.
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
    Clock::Metric(Arc::new(metric), profile)
}

#[cfg(test)]
mod tests;
