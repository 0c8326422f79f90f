//! Slowing down and setting off along a planned path: the pace at which path time goes falls from 1 to 0, or rises.
//!
//! What is looked for is the soonest stop whose commands keep every limit. Limits are what they are in a command file: of the held
//! speeds, their first differences over a row's time and their second over its square, at rest before and after. A motion that already
//! brakes or turns in as hard as it may has no room for a change of pace; then the file is played on until there is. Its end is
//! always a stop, so there is always an answer.

use super::motion::Motion;
use crate::command::CommandRow;
use crate::command::limits::{ROUNDING, differences};
use crate::math::real;
use crate::robot::{MotionLimits, RobotModel};

/// Shapes of a change of pace that are tried: shares of its time in which its rate grows and falls off.
const SHAPES: [[f64; 2]; 5] = [[0.2, 0.2], [0.35, 0.35], [0.5, 0.5], [0.6, 0.2], [0.2, 0.6]];
/// Each length that is tried is longer by this factor.
const LONGER: f64 = 1.08;
/// Rows of the shortest change of pace tried.
const SHORTEST: f64 = 2.0;
/// Delays that are tried are this far apart at least: in s, and as a share of the delay.
const DELAY: (f64, f64) = (0.02, 0.1);

/// Limits of each actuator in the units of commands: of the speed, and of its first and second difference from row to row.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits(Vec<[f64; 3]>);

impl Limits {
    /// Of a robot that plays a motion. What the motion itself needs is within limits (an uncertified file may exceed the robot's, and
    /// its stop cannot do better); where the robot gives none, planning's default holds.
    pub fn new(robot: &RobotModel, motion: &Motion) -> Self {
        let hold = motion.table().sampling_time;
        let rows = motion.table().rows.len() as isize;
        let of = |actuator: usize, limits: &MotionLimits, radius: f64| {
            let peaks = differences((0..rows).map(|k| motion.speed(actuator, k)), hold);
            let given = limits.planning();
            [0, 1, 2].map(|order| {
                (given[order] / radius).max(peaks[order]) * real::powi(hold, order as i32) * (1.0 + 0.5 * ROUNDING)
            })
        };
        let wheels = [0, 1].map(|side| of(side, &robot.wheel, motion.table().wheel_radii.sides()[side]));
        let joints = robot.joints.iter().enumerate().map(|(j, joint)| of(2 + j, &joint.limits, 1.0));
        Self(wheels.into_iter().chain(joints).collect())
    }

    /// Of each actuator per second: speed, acceleration, jerk, where a row is held for `hold` seconds.
    pub fn per_second(&self, hold: f64) -> Vec<[f64; 3]> {
        self.0.iter().map(|[speed, first, second]| [*speed, first / hold, second / (hold * hold)]).collect()
    }
}

/// A change of pace from 1 to 0: its rate is a trapezoid in time.
#[derive(Debug, Clone, Copy)]
struct Slowing {
    /// Rows.
    length: f64,
    /// Rows in which its rate grows, and falls off.
    ramps: [f64; 2],
}

impl Slowing {
    fn new(length: f64, shape: [f64; 2]) -> Self {
        Self { length, ramps: shape.map(|share| share * length) }
    }

    /// Path time driven in all.
    fn total(&self) -> f64 {
        self.driven(self.length)
    }

    /// Path time driven after a time, both in rows.
    fn driven(&self, time: f64) -> f64 {
        let [up, down] = self.ramps;
        // The greatest rate: its integral is 1.
        let rate = 1.0 / (self.length - 0.5 * (up + down));
        let time = time.min(self.length);
        let first = time.min(up);
        let mut driven = first - rate / up * real::powi(first, 3) / 6.0;
        let pace = 1.0 - 0.5 * rate * up;
        if time > up {
            let t = time.min(self.length - down) - up;
            driven += pace * t - 0.5 * rate * t * t;
        }
        if time > self.length - down {
            // Seen from the end: the pace is rate/(2 down) (end - t)^2.
            let left = self.length - time;
            driven += rate / down * (real::powi(down, 3) - real::powi(left, 3)) / 6.0;
        }
        driven
    }
}

/// The commands of a stop, in order. The last is zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop {
    /// Each is held as long as a row of the table.
    pub rows: Vec<CommandRow>,
    /// Path time at which each row begins.
    pub path_times: Vec<f64>,
}

/// The soonest stop found from the beginning of row `from`, that is, with row `from - 1` held until now.
pub fn stop(motion: &Motion, from: usize, limits: &Limits) -> Stop {
    let rows = motion.table().rows.len();
    let to_the_end = rows.saturating_sub(from);
    let mut best = (to_the_end as f64, None);
    let mut delay = 0;
    while (delay as f64) < best.0 {
        let begin = from + delay;
        if keep(motion, [Some(begin), None], 0, &|_| begin as f64, limits) {
            best = (delay as f64, Some((begin, None)));
            break;
        }
        let mut length = SHORTEST;
        'lengths: while (delay as f64 + length) < best.0 {
            for shape in SHAPES {
                let slowing = Slowing::new(length, shape);
                let count = length.ceil() as usize;
                let path_time = |j: usize| begin as f64 + slowing.driven(j as f64);
                if keep(motion, [Some(begin), None], count, &path_time, limits) {
                    best = (delay as f64 + length, Some((begin, Some(slowing))));
                    break 'lengths;
                }
            }
            length *= LONGER;
        }
        let step = (DELAY.0 / motion.table().sampling_time).max(DELAY.1 * delay as f64);
        delay += (step as usize).max(1);
    }
    let play_on = best.1.map_or(rows, |(begin, _)| begin);
    let mut path_times: Vec<f64> = (from..play_on).map(|k| k as f64).collect();
    let mut commands: Vec<CommandRow> = motion.table().rows[from.min(rows)..play_on].to_vec();
    if let Some((begin, slowing)) = best.1 {
        let driven = |j: usize| begin as f64 + slowing.map_or(0.0, |s: Slowing| s.driven(j as f64));
        let last = slowing.map_or(0, |s| s.length.ceil() as usize);
        let times: Vec<f64> = (0..=last).map(driven).collect();
        commands.extend(times.windows(2).map(|w| motion.command(w[0], w[1])));
        commands.push(motion.command(times[last], times[last]));
        path_times.extend(times);
    }
    Stop { rows: commands, path_times }
}

/// Commands that set off from rest.
#[derive(Debug, Clone, PartialEq)]
pub struct SetOff {
    /// Each is held as long as a row of the table.
    pub rows: Vec<CommandRow>,
    /// The row of the table that comes next.
    pub joins: usize,
}

/// The soonest way found from rest at the beginning of row `from` to the full pace of the table; `None`: not within limits from there.
pub fn set_off(motion: &Motion, from: usize, limits: &Limits) -> Option<SetOff> {
    let left = motion.table().rows.len().checked_sub(from)?;
    // At half the pace in the mean: an even number of rows joins the table at one of its rows.
    let mut half = 0;
    while half <= left {
        for shape in SHAPES.into_iter().filter(|[up, down]| up == down) {
            let count = 2 * half;
            let slowing = Slowing::new(count.max(1) as f64, shape);
            // A stop seen backwards in time.
            let rising = |j: usize| from as f64 + slowing.total() - slowing.driven((count - j) as f64);
            // To the row itself: sums of cubic pieces are rounded.
            let path_time = |j: usize| if j == count { (from + half) as f64 } else { rising(j) };
            if keep(motion, [None, Some(from + half)], count, &path_time, limits) {
                let rows = (0..count).map(|j| motion.command(path_time(j), path_time(j + 1))).collect();
                return Some(SetOff { rows, joins: from + half });
            }
        }
        half = (half as f64 * LONGER) as usize + 1;
    }
    None
}

/// Whether all actuators keep their limits with `count` commands between path times. Before them the rows before a row are held, behind
/// them the rows from a row on; `None`: at rest.
fn keep(
    motion: &Motion,
    [before, behind]: [Option<usize>; 2],
    count: usize,
    path_time: &dyn Fn(usize) -> f64,
    limits: &Limits,
) -> bool {
    limits.0.iter().enumerate().all(|(actuator, limits)| {
        let row = |at: Option<usize>, offset: isize| at.map_or(0.0, |at| motion.speed(actuator, at as isize + offset));
        let (mut last, mut held) = (row(before, -2), row(before, -1));
        let mut travelled = motion.travel(actuator, path_time(0));
        (1..=count + 2).all(|j| {
            let next = if j <= count {
                let travel = motion.travel(actuator, path_time(j));
                let next = travel - travelled;
                travelled = travel;
                next
            } else {
                row(behind, (j - count - 1) as isize)
            };
            let kept = next.abs() <= limits[0]
                && (next - held).abs() <= limits[1]
                && (next - 2.0 * held + last).abs() <= limits[2];
            (last, held) = (held, next);
            kept
        })
    })
}

#[cfg(test)]
mod tests;
