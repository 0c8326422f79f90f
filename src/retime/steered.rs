//! Legs of heading and arc length: what their actuators do, and the laws that suit them.

use std::sync::Arc;

use crate::geom::Pose2;
use crate::math::quadrature::gauss_legendre;
use crate::mission::TimeLaw;
use crate::robot::RobotModel;
use crate::trajectory::SteerLeg;
use crate::trajectory::plane_curve::{CurveError, Place};
use crate::trajectory::steered_curve::SteeredCurve;

use super::RetimeError;
use super::convolution::Convolution;
use super::course::{Course, Proportional, STRAIGHT, compose};
use super::law::{LEAST_SPEED, Task, centre_limits, optimal, peaks_of, slowed, with_peak_speed};
use super::limits::Scope;
use super::peaks::peaks;
use super::timed_leg::{Clock, TimedLeg};

/// Within this share of a leg's time from its rests the arc length is no parameter to divide by: there rates go on as those of a
/// motion with the third power of time, which a convolution profile's are.
pub(super) const NEAR_REST: f64 = 1e-3;

/// Heading and arc length as functions of one parameter: wheel travel is linear in both, so exact.
#[derive(Debug, Clone)]
pub struct Steered {
    /// The curve with its table of positions.
    pub curve: Arc<SteeredCurve>,
    /// Half the track width, m.
    pub half_track: f64,
}

impl Course {
    /// The course of a leg of heading and arc length. Where every actuator moves in proportion (one spin, one straight, joints alone),
    /// it is that: the set of poses is the same and the best law is known.
    ///
    /// # Errors
    /// The curve is empty, not finite, or winds without end.
    pub fn steer(leg: &SteerLeg, track_width: f64) -> Result<Self, CurveError> {
        let steered = Steered { curve: Arc::new(SteeredCurve::new(leg)?), half_track: 0.5 * track_width };
        Ok(match steered.proportional() {
            Some(proportional) => Self::Proportional(proportional),
            None => Self::Steered(steered),
        })
    }
}

impl Steered {
    /// The same as a proportional course, if it is one.
    fn proportional(&self) -> Option<Proportional> {
        let curve = &self.curve;
        let dimensions = 2 + curve.joint_count();
        let start: Vec<f64> = (0..dimensions).map(|d| curve.jet(d, curve.start())[0]).collect();
        let change: Vec<f64> = (0..dimensions).map(|d| curve.jet(d, curve.end())[0] - start[d]).collect();
        if change[0].abs() > STRAIGHT && change[1].abs() > STRAIGHT {
            return None;
        }
        let largest = (0..dimensions).max_by(|a, b| change[*a].abs().total_cmp(&change[*b].abs()))?;
        let nodes: Vec<f64> = curve.nodes().map(|node| curve.parameter(node)).collect();
        let mut before = 0.0;
        for pair in nodes.windows(2) {
            for part in 0..8 {
                let place = curve.place(pair[0] + (pair[1] - pair[0]) * f64::from(part) / 8.0);
                let moved = |d: usize| curve.jet(d, place)[0] - start[d];
                let share = if change[largest] == 0.0 { 0.0 } else { moved(largest) / change[largest] };
                let back = (before - share) * change[largest].abs();
                if back > STRAIGHT || (0..dimensions).any(|d| (moved(d) - share * change[d]).abs() > STRAIGHT) {
                    return None;
                }
                before = share;
            }
        }
        Some(Proportional {
            pose: curve.pose(curve.start()),
            drive: if change[1].abs() > STRAIGHT { change[1] } else { 0.0 },
            turn: if change[0].abs() > STRAIGHT { change[0] } else { 0.0 },
            joints: start[2..].to_vec(),
            joint_changes: change[2..].to_vec(),
            half_track: self.half_track,
        })
    }

    /// Pose at a place.
    pub fn pose(&self, place: Place) -> Pose2 {
        self.curve.pose(place)
    }

    /// Wheel travel (left, right) since the start, m.
    pub fn travel(&self, place: Place) -> [f64; 2] {
        let turn = self.curve.jet(0, place)[0] - self.curve.jet(0, self.curve.start())[0];
        let along = self.curve.jet(1, place)[0] - self.curve.jet(1, self.curve.start())[0];
        [-self.half_track, self.half_track].map(|arm| along + arm * turn)
    }

    /// Wheel travel (left, right) since the start, then joint values, appended to `out`.
    pub fn positions(&self, place: Place, out: &mut Vec<f64>) {
        out.extend(self.travel(place));
        out.extend((0..self.curve.joint_count()).map(|joint| self.curve.jet(2 + joint, place)[0]));
    }

    /// What (left, right, joints…) move between two parameters, appended to `out`: from their rates, so accurate to rounding of
    /// itself, not of the whole.
    pub fn moved(&self, from: f64, to: f64, out: &mut Vec<f64>) {
        let poly = self.curve.poly();
        let mut sums = vec![0.0; 2 + self.curve.joint_count()];
        let mut start = 0.0;
        for piece in &poly.pieces {
            let [low, high] = [from, to].map(|at| (at - start).clamp(0.0, piece.duration));
            if high > low {
                for (dimension, sum) in sums.iter_mut().enumerate() {
                    *sum += gauss_legendre(low, high, |u| piece.derivative(dimension, 1, u));
                }
            }
            start += piece.duration;
        }
        out.extend([-self.half_track, self.half_track].map(|arm| sums[1] + arm * sums[0]));
        out.extend(&sums[2..]);
    }

    /// Time derivatives one to three of (left, right, joints…, centre) appended to `out` at a place, for the parameter's own
    /// derivatives `clock` (one to three).
    pub fn rates(&self, place: Place, clock: [f64; 3], out: &mut Vec<[f64; 3]>) {
        let of = |dimension: usize| {
            let [_, d1, d2, d3] = self.curve.jet(dimension, place);
            compose([d1, d2, d3], clock)
        };
        let (turn, along) = (of(0), of(1));
        out.extend([-self.half_track, self.half_track].map(|arm| [0, 1, 2].map(|k| along[k] + arm * turn[k])));
        out.extend((0..self.curve.joint_count()).map(|joint| of(2 + joint)));
        out.push(along);
    }

    /// Derivatives of the parameter where the distance driven has these derivatives (one to three). Not where the base stands.
    pub fn parameter_rates(&self, place: Place, travelled: [f64; 3]) -> [f64; 3] {
        let [_, g, g1, g2] = self.curve.jet(1, place);
        let sign = g.signum();
        let first = sign * travelled[0] / g;
        let second = (sign * travelled[1] - g1 * first * first) / g;
        [first, second, (sign * travelled[2] - 3.0 * g1 * first * second - g2 * first * first * first) / g]
    }

    /// Whether the path between the first and the last of three parameters is no smooth and nearly straight line: it turns by more than
    /// 0.1 rad, changes its direction, or stands at the one in the middle.
    pub fn turns_or_stands(&self, parameters: [f64; 3]) -> bool {
        let places = parameters.map(|u| self.curve.place(u));
        let [before, at, after] = places.map(|place| self.curve.jet(1, place)[1]);
        let turn = self.curve.jet(0, places[2])[0] - self.curve.jet(0, places[0])[0];
        turn.abs() > 0.1 || before * after < 0.0 || at.abs() <= 1e-6 * before.abs().max(after.abs())
    }

    /// Largest |curvature| between the rests, 1/m.
    fn largest_curvature(&self) -> f64 {
        let curve = &self.curve;
        let [low, high] = [NEAR_REST, 1.0 - NEAR_REST].map(|share| share * curve.duration());
        let nodes = curve.nodes().map(|node| curve.parameter(node)).filter(|u| *u > low && *u < high);
        let breaks: Vec<f64> = std::iter::once(low).chain(nodes).chain([high]).collect();
        let curvature = |u: f64| {
            let place = curve.place(u);
            curve.jet(0, place)[1] / curve.jet(1, place)[1]
        };
        peaks(&breaks, true, |u, out| out.push([curvature(u), 0.0, 0.0])).rates[0][0]
    }
}

/// Times a leg of heading and arc length under a law.
///
/// # Errors
/// The law cannot time this leg.
pub(super) fn time_steered(steered: &Steered, law: TimeLaw, task: Task<'_>) -> Result<TimedLeg, RetimeError> {
    let limits = centre_limits(task.robot);
    match law {
        TimeLaw::Auto => {
            // The least time is sought from the optimiser's own, so nothing else can be faster.
            let least = time_steered(steered, TimeLaw::Optimal, task);
            Ok(least.unwrap_or_else(|_| slowed(at_own_time(steered), task, Scope::Everything)))
        }
        TimeLaw::Minco => Ok(own(steered, task)),
        TimeLaw::FixedPoint => {
            drivable(steered, law, task)?;
            let wheel_speed = task.robot.wheel.planning()[0];
            let speed = limits[0].min(wheel_speed / (1.0 + steered.half_track * steered.largest_curvature()));
            if speed.is_nan() || speed <= LEAST_SPEED * limits[0] {
                return Err(no_speed(steered, law, task, speed));
            }
            Ok(slowed(convolved(steered, law, speed, task.robot), task, Scope::Actuators))
        }
        TimeLaw::Eq5 => {
            drivable(steered, law, task)?;
            let at_full_speed = convolved(steered, law, limits[0], task.robot);
            let mut rates = Vec::new();
            let compensation = peaks(&at_full_speed.breaks(), true, |t, out| {
                rates.clear();
                at_full_speed.rates(t, &mut rates);
                out.push([0.5 * (rates[1][0] - rates[0][0]), 0.0, 0.0]);
            })
            .rates[0][0];
            let left = task.robot.wheel.planning()[0] - compensation;
            if left.is_nan() || left <= LEAST_SPEED * limits[0] {
                return Err(no_speed(steered, law, task, left));
            }
            Ok(slowed(convolved(steered, law, left.min(limits[0]), task.robot), task, Scope::Actuators))
        }
        TimeLaw::Printed => Err(RetimeError::PrintedNeedsOneSegment),
        TimeLaw::Optimal => optimal::paced(TimedLeg { law: Some(law), ..at_own_time(steered) }, task),
        TimeLaw::Wheel => Err(RetimeError::NeedsFlat { law: super::law_key(law), leg: task.leg }),
    }
}

/// The optimiser's own timing, from rest to rest by itself, before any slow-down.
fn at_own_time(steered: &Steered) -> TimedLeg {
    TimedLeg {
        course: Course::Steered(steered.clone()),
        clock: Clock::Seconds(steered.curve.duration()),
        stretch: 1.0,
        law: Some(TimeLaw::Minco),
        speed_limit: 0.0,
        compensation: 0.0,
    }
}

/// The optimiser's own timing: only slowed down.
fn own(steered: &Steered, task: Task<'_>) -> TimedLeg {
    let leg = slowed(at_own_time(steered), task, Scope::Actuators);
    let peaks = peaks_of(&leg, task, Scope::Actuators);
    with_peak_speed(leg, &peaks, task)
}

/// A convolution profile of the distance driven.
fn convolved(steered: &Steered, law: TimeLaw, speed: f64, robot: &RobotModel) -> TimedLeg {
    let [uncompensated, acceleration, jerk] = centre_limits(robot);
    TimedLeg {
        course: Course::Steered(steered.clone()),
        clock: Clock::ArcLength(Convolution::fastest(steered.curve.length(), [speed, acceleration, jerk])),
        stretch: 1.0,
        law: Some(law),
        speed_limit: speed,
        compensation: uncompensated - speed,
    }
}

/// Laws of the centre's arc length need one that goes on wherever anything moves.
fn drivable(steered: &Steered, law: TimeLaw, task: Task<'_>) -> Result<(), RetimeError> {
    match steered.curve.first_stop_inside() {
        Some(time) => Err(RetimeError::StandsInside { law: super::law_key(law), leg: task.leg, time }),
        None => Ok(()),
    }
}

fn no_speed(steered: &Steered, law: TimeLaw, task: Task<'_>, left: f64) -> RetimeError {
    RetimeError::CompensationLeavesNoSpeed {
        law: super::law_key(law),
        leg: task.leg,
        radius: 1.0 / steered.largest_curvature(),
        half_track: steered.half_track,
        left,
    }
}

#[cfg(test)]
mod tests;
