//! The time laws: which clock a leg gets, and by how much it is slowed down.

pub(super) mod optimal;
mod wheel;

use crate::mission::TimeLaw;
use crate::robot::RobotModel;

use super::RetimeError;
use super::convolution::Convolution;
use super::course::{Course, Curved, Proportional};
use super::limits::{RowLimits, Scope, append_turn, limits};
use super::peaks::{Peaks, peaks, slow_down};
use super::steered::time_steered;
use super::timed_leg::{Clock, TimedLeg};
use super::warp::Warp;
use super::zones::Zones;

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
    /// Where the base must be slow.
    pub zones: Zones<'a>,
}

impl Task<'_> {
    /// The limits of the rows that [`peaks_of`] finds.
    pub(super) fn limits(&self, scope: Scope) -> Vec<RowLimits> {
        let mut rows = limits(self.robot, scope);
        self.zones.limit(&mut rows);
        rows
    }
}

/// Times one leg under a law.
///
/// # Errors
/// The law cannot time this leg.
pub fn time_leg(course: &Course, law: TimeLaw, task: Task<'_>) -> Result<TimedLeg, RetimeError> {
    let curved = match course {
        Course::Proportional(p) => return Ok(in_zones(proportional(p, task.robot), law, task)),
        Course::Steered(steered) => return time_steered(steered, law, task),
        Course::Curved(curved) => curved,
    };
    match law {
        TimeLaw::Auto => Ok(fastest(curved, task)),
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
        TimeLaw::Optimal => optimal::time(curved, task),
        TimeLaw::Wheel => Ok(wheel::time(curved, task)),
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
    // [SCR] Eq. 14 without a drive.
    keep(course.turn, [2.0 * robot.base.eta * robot.base.speed / robot.track_width, f64::INFINITY, f64::INFINITY]);
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

/// A leg that is at its best where nothing depends on the place, slowed down where it is to be slow; by the laws that are not the least
/// time as a whole.
fn in_zones(leg: TimedLeg, law: TimeLaw, task: Task<'_>) -> TimedLeg {
    if task.zones.is_empty() {
        return leg;
    }
    let slow = slowed(leg.clone(), task, Scope::Everything);
    if slow.stretch <= leg.stretch || !matches!(law, TimeLaw::Auto | TimeLaw::Optimal) {
        return slow;
    }
    match optimal::paced(leg, task) {
        Ok(paced) if paced.duration() < slow.duration() => paced,
        _ => slow,
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
    slowed(unslowed(curved, law, clock, limits, uncompensated), task, Scope::Actuators)
}

/// A convolution profile along a curve as it is, whatever the wheels are asked for.
pub(super) fn unslowed(
    curved: &Curved,
    law: TimeLaw,
    clock: fn(Convolution) -> Clock,
    limits: [f64; 3],
    uncompensated: f64,
) -> TimedLeg {
    TimedLeg {
        course: Course::Curved(curved.clone()),
        clock: clock(Convolution::fastest(curved.curve.length(), limits)),
        stretch: 1.0,
        law: Some(law),
        speed_limit: limits[0],
        compensation: uncompensated - limits[0],
    }
}

/// The fastest law that keeps every limit, the base's included.
///
/// `optimal` is the fastest but for the size of its cells, so another law is tried only where it cannot be told to be slower beforehand.
fn fastest(curved: &Curved, task: Task<'_>) -> TimedLeg {
    let mut best = optimal::time(curved, task).ok();
    let unlimited =
        limits(task.robot, Scope::Actuators).iter().take(2 + task.robot.joints.len()).flatten().any(Option::is_none);
    for law in [TimeLaw::Minco, TimeLaw::Eq5, TimeLaw::FixedPoint] {
        let known = best.as_ref().map_or(f64::INFINITY, TimedLeg::duration);
        // The optimiser's timing keeps a jerk limit only by being slowed down; without one it may be the fastest.
        let hopeless = match law {
            TimeLaw::Minco => best.is_some() && !unlimited,
            _ => best.is_some() && least_duration(curved, law, task) >= known,
        };
        if hopeless {
            continue;
        }
        let Ok(leg) = time_leg(&Course::Curved(curved.clone()), law, task) else { continue };
        let leg = slowed(leg, task, Scope::Everything);
        if leg.duration() < known {
            best = Some(leg);
        }
    }
    best.expect("fixed_point times every curve")
}

/// What `eq5` and `fixed_point` take at least: their profiles before any slow-down, for Eq. 5 compensated only for what the wheels differ
/// by at the nodes of the curve.
fn least_duration(curved: &Curved, law: TimeLaw, task: Task<'_>) -> f64 {
    let [v, a, j] = centre_limits(task.robot);
    let curve = &curved.curve;
    let uncorrected = Convolution::fastest(curve.length(), [v, a, j]);
    let bends = curve.nodes().map(|node| (curve.arc(node), curve.curvature(node)[0].abs()));
    let wheel_speed = task.robot.wheel.planning()[0];
    let speed = match law {
        TimeLaw::Eq5 => {
            let turns = bends.map(|(arc, bend)| bend * uncorrected.at(uncorrected.time_at(arc))[1]);
            wheel_speed - curved.half_track * turns.fold(0.0, f64::max)
        }
        _ => wheel_speed / (1.0 + curved.half_track * bends.map(|(_, bend)| bend).fold(0.0, f64::max)),
    };
    if speed > 0.0 { Convolution::fastest(curve.length(), [v.min(speed), a, j]).duration() } else { f64::INFINITY }
}

/// Slowed down (from its clock's own speed) until every limit in the scope holds.
pub(super) fn slowed(leg: TimedLeg, task: Task<'_>, scope: Scope) -> TimedLeg {
    TimedLeg { stretch: slow_down(&peaks_of(&leg, task, scope), &task.limits(scope), task.hold), ..leg }
}

/// Peaks before the slow-down of the rows that the scope limits.
pub(super) fn peaks_of(leg: &TimedLeg, task: Task<'_>, scope: Scope) -> Peaks {
    peaks(&leg.clock_breaks(), true, |t, out| {
        let first = out.len();
        leg.clock_rates(t, out);
        if scope == Scope::Everything {
            append_turn(task.robot, first, out);
        }
        task.zones.append(leg, t, first, out);
    })
}

/// The largest speed of the centre, m/s, where the profile was not made with one.
pub(super) fn with_peak_speed(leg: TimedLeg, peaks: &Peaks, task: Task<'_>) -> TimedLeg {
    let centre = peaks.rates[2 + task.robot.joints.len()][0];
    TimedLeg { speed_limit: centre / leg.stretch, ..leg }
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
    let left = left_by_eq5(curved, law, clock, task)?;
    Ok(convolved(curved, law, clock, [left, a, j], v, task))
}

/// v' of \[CONV\] Eq. 5, applied once, m/s.
///
/// # Errors
/// Nothing is left.
pub(super) fn left_by_eq5(
    curved: &Curved,
    law: TimeLaw,
    clock: fn(Convolution) -> Clock,
    task: Task<'_>,
) -> Result<f64, RetimeError> {
    let limits = centre_limits(task.robot);
    let uncorrected = unslowed(curved, law, clock, limits, limits[0]);
    let mut rates = Vec::new();
    let compensation = peaks(&uncorrected.breaks(), true, |t, out| {
        rates.clear();
        uncorrected.rates(t, &mut rates);
        out.push([0.5 * (rates[1][0] - rates[0][0]), 0.0, 0.0]);
    })
    .rates[0][0];
    let wheel_speed = task.robot.wheel.planning()[0];
    let left = limits[0].min(wheel_speed - compensation);
    if left <= LEAST_SPEED * limits[0] {
        return Err(RetimeError::CompensationLeavesNoSpeed {
            law: super::law_key(law),
            leg: task.leg,
            radius: 1.0 / largest_curvature(curved),
            half_track: curved.half_track,
            left: wheel_speed - compensation,
        });
    }
    Ok(left)
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
    let limits = task.limits(Scope::Actuators);
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
    let nodes: Vec<f64> = curved.curve.nodes().map(|node| curved.curve.parameter(node)).collect();
    let own_speed = |u: f64, out: &mut Vec<[f64; 3]>| curved.rates(curved.curve.place(u), [1.0, 0.0, 0.0], out);
    let asks: Vec<f64> =
        nodes.windows(2).map(|pair| slow_down(&peaks(pair, false, own_speed), &limits, task.hold)).collect();
    let between = |from: f64, to: f64| {
        let within = nodes.windows(2).zip(&asks).filter(|(pair, _)| pair[1] > from && pair[0] < to);
        within.map(|(_, ask)| *ask).fold(1.0, f64::max)
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
            let middle = between(0.5 * start, seconds - 0.5 * end);
            let time = middle.max(*ask_start).max(*ask_end) * (seconds + 0.5 * (start + end));
            if time < best.0 {
                best = (time, [*start, *end]);
            }
        }
    }
    let leg = leg(best.1);
    let peaks = peaks_of(&leg, task, Scope::Actuators);
    let stretch = slow_down(&peaks, &limits, task.hold);
    with_peak_speed(TimedLeg { stretch, ..leg }, &peaks, task)
}

#[cfg(test)]
mod tests;
