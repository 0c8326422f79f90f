//! Corrects held mean speeds, row by row, so that their replay passes through the planned positions.
//!
//! An arc of the mean speeds misses its interval sideways by h^3/12 v^3 k'(s) (h: the sampling time, k: curvature), because it has one
//! curvature where the path has a range of them. What remedies it is a heading that is off the plan by d = -h^2/12 v^2 k'(s) at each
//! row: the arcs then join planned positions, and what is left of the path error is what a single arc leaves of it within its interval,
//! about v^3 k'(s) h^3/125. Such a heading asks for sharper turns where the path's jerk jumps, which limits have no room for. So it is
//! sought by least squares: positions off at the rows, against changes of wheel speed, acceleration and jerk, each weighed by the room
//! that its limit leaves there. Heading and position at the end are exact.

mod regulator;

use crate::geom::{Pose2, sinc};
use crate::math::real;
use crate::robot::{MotionLimits, RobotModel};

use super::CommandTable;
use regulator::{Problem, Row};

/// Ends this near need no further round, m and rad.
const EXACT: [f64; 2] = [1e-10, 1e-11];
/// What is promised of the end, m and rad.
const PROMISED: [f64; 2] = [1e-6, 1e-9];
/// A replay that leaves the planned positions by less needs no correction, m.
const NOTHING: f64 = 1e-10;
/// Rounds of linearisation at most. The first does nearly all.
const ROUNDS: usize = 5;
/// Room that is as good as none, as a share of the limit: weights stay finite.
const LEAST_ROOM: f64 = 1e-4;
/// Speeds are changed by about this share at most; where nothing moves, nothing is changed.
const SHARE: f64 = 0.1;
/// Weight of the end's position against that of one row; what is left is taken up by multipliers.
const END: f64 = 1e4;

/// Corrects the wheel speeds of `mean` so that the replay passes the planned positions of its rows and ends in the planned pose; limits
/// are respected by weights, so look at them afterwards. `closeness`: positions off at the rows against those of `mean`, where limits
/// leave room. Returns what that share came to be; `None` where the end is not as near as promised.
pub(super) fn correct(table: &mut CommandTable, robot: &RobotModel, closeness: f64) -> Option<f64> {
    let last = table.rows.len().checked_sub(1)?;
    let start = table.rows[0].pose;
    let radii = table.wheel_radii.sides();
    let base: Vec<[f64; 2]> = (0..last).map(|k| rims(table, k)).collect();
    let mut off = replayed(table, start);
    let before = farthest(&off);
    if before <= NOTHING {
        return Some(0.0);
    }
    let mut rows = weights(table, robot, &base);
    let rest = rest_weights(table, robot, &base);
    let position = real::powi(closeness * before, -2);
    let end = [END * position, END * END * position];
    let mut multipliers = [0.0; 3];
    let mut corrections = vec![[0.0; 2]; last];
    for _ in 0..ROUNDS {
        linearise(table, &off, &corrections, &mut rows);
        let turn = table.sampling_time / table.track_width;
        corrections = Problem { rows: &rows, turn, position, end: (end, multipliers), rest }.solve()?;
        for (row, (base, more)) in table.rows.iter_mut().zip(base.iter().zip(&corrections)) {
            row.wheel_left = (base[0] + more[0]) / radii[0];
            row.wheel_right = (base[1] + more[1]) / radii[1];
        }
        off = replayed(table, start);
        let miss = off[last];
        if real::hypot(miss[0], miss[1]) <= EXACT[0] && miss[2].abs() <= EXACT[1] {
            break;
        }
        (0..3).for_each(|i| multipliers[i] += end[usize::from(i == 2)] * miss[i]);
    }
    let [x, y, heading] = off[last];
    let promised = real::hypot(x, y) <= PROMISED[0] && heading.abs() <= PROMISED[1];
    promised.then(|| farthest(&off) / before)
}

/// The largest distance of positions that are off, m.
fn farthest(off: &[[f64; 3]]) -> f64 {
    off.iter().map(|[x, y, _]| real::hypot(*x, *y)).fold(0.0, f64::max)
}

/// Rim speeds of a row, m/s.
fn rims(table: &CommandTable, k: usize) -> [f64; 2] {
    let (left, right) = table.rim_speeds(k);
    [left, right]
}

/// By how much the replay is off at each row: x, y (m), heading (rad).
fn replayed(table: &CommandTable, start: Pose2) -> Vec<[f64; 3]> {
    let poses = table.replay(start);
    let off =
        poses.iter().zip(&table.rows).map(|(is, row)| [is.x - row.pose.x, is.y - row.pose.y, is.yaw - row.pose.yaw]);
    off.collect()
}

/// What corrections do to positions, about the commands as they are now.
fn linearise(table: &CommandTable, off: &[[f64; 3]], corrections: &[[f64; 2]], rows: &mut [Row]) {
    let hold = table.sampling_time;
    for (k, row) in rows.iter_mut().enumerate() {
        let (v, omega) = table.twist(k);
        let half_turn = 0.5 * omega * hold;
        let (sin, cos) = real::sin_cos(table.rows[k].pose.yaw + off[k][2] + half_turn);
        let chord = v * hold * sinc(half_turn);
        row.by_heading = [-chord * sin, chord * cos];
        let along = 0.5 * hold * sinc(half_turn);
        let aside = 0.5 * hold / table.track_width;
        row.by_wheel =
            [-aside, aside].map(|arm| [along * cos + arm * row.by_heading[0], along * sin + arm * row.by_heading[1]]);
        row.drift = [0, 1].map(|d| {
            let known = row.by_heading[d] * off[k][2]
                + row.by_wheel[0][d] * corrections[k][0]
                + row.by_wheel[1][d] * corrections[k][1];
            off[k + 1][d] - off[k][d] - known
        });
    }
}

/// Rows with their weights: one over the square of the room that is left.
fn weights(table: &CommandTable, robot: &RobotModel, base: &[[f64; 2]]) -> Vec<Row> {
    let nothing =
        Row { by_heading: [0.0; 2], by_wheel: [[0.0; 2]; 2], drift: [0.0; 2], wheels: [[0.0; 3]; 2], twist: [0.0; 2] };
    let mut rows = vec![nothing; base.len()];
    let limits = bounds(&robot.wheel, table, base);
    let (mut last, mut before) = ([0.0; 2], [0.0; 2]);
    for (row, now) in rows.iter_mut().zip(base) {
        row.wheels = [0, 1].map(|side| {
            let differences = [now[side], now[side] - last[side], now[side] - 2.0 * last[side] + before[side]];
            [0, 1, 2].map(|order| weight(differences[order], limits[order]))
        });
        (before, last) = (last, *now);
    }
    for (row, [left, right]) in rows.iter_mut().zip(base) {
        let least = LEAST_ROOM * LEAST_ROOM * limits[0];
        let of = |speed: f64| real::powi(SHARE * speed.abs() + least, -2);
        row.twist = [of(0.5 * (left + right)), of(left.abs().max(right.abs()))];
    }
    rows
}

/// Likewise for first and second differences behind the last row.
fn rest_weights(table: &CommandTable, robot: &RobotModel, base: &[[f64; 2]]) -> [[f64; 2]; 2] {
    let limits = bounds(&robot.wheel, table, base);
    [0, 1].map(|side| {
        let back = |k: usize| base.len().checked_sub(k).map_or(0.0, |k| base[k][side]);
        let (last, before) = (back(1), back(2));
        [weight(last, limits[1]), weight(before - 2.0 * last, limits[2]).max(weight(last, limits[2]))]
    })
}

/// Limits of a wheel's speed and its differences; where there is none, twice what the commands need.
fn bounds(limits: &MotionLimits, table: &CommandTable, base: &[[f64; 2]]) -> [f64; 3] {
    let hold = table.sampling_time;
    let peaks = [0, 1].map(|side| super::limits::differences(base.iter().map(|rims| rims[side]), hold));
    let own = [limits.speed, limits.acceleration, limits.jerk];
    [0, 1, 2].map(|order| {
        let limit = own[order].unwrap_or(2.0 * peaks[0][order].max(peaks[1][order]));
        limit.max(f64::MIN_POSITIVE) * real::powi(hold, order as i32)
    })
}

/// One over the square of the room between a value and its limit on both sides.
fn weight(value: f64, limit: f64) -> f64 {
    let room = |side: f64| (limit - side * value).max(LEAST_ROOM * limit);
    0.5 * (real::powi(room(1.0), -2) + real::powi(room(-1.0), -2))
}
