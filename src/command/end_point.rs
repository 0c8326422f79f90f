//! Closes the gap between where held commands end and where the plan ends.
//!
//! An arc misses its interval sideways by a third-order term, so the replay's end is off by O(dt^2) (\[CONV\] section 4). The
//! correction changes what both wheels travel, row by row, in proportion to the square of the row's speed: a window that vanishes with
//! its first two differences at every stop. Of all such corrections it is the least in that weight, found by Newton's iteration.

use crate::geom::{Pose2, sinc};
use crate::math::real;

use super::CommandTable;

/// The iteration ends below this distance, m.
const CLOSED: f64 = 1e-6;
/// No row's speed is changed by more than this share.
const LARGEST_SHARE: f64 = 0.25;

/// Distance (m) and angle (rad, not wrapped) from where the replay from `start` ends to `end`.
pub fn miss(table: &CommandTable, start: Pose2, end: Pose2) -> (f64, f64) {
    let replayed = table.replay(start);
    let last = replayed.last().copied().unwrap_or(start);
    (last.distance(end), end.yaw - last.yaw)
}

/// Corrects the wheel speeds so that the replay from `start` ends at `end`: first the heading (`instant` sampling only; `mean` has it
/// exact), then the position. Returns whether it came nearer than `tolerance` (m) with no row's speed changed by more than a quarter;
/// otherwise the table is left unchanged.
pub fn close(table: &mut CommandTable, start: Pose2, end: Pose2, tolerance: f64) -> bool {
    let original: Vec<[f64; 2]> = table.rows.iter().map(|row| [row.wheel_left, row.wheel_right]).collect();
    let (hold, track, radii) = (table.sampling_time, table.track_width, table.wheel_radii.sides());
    let twists: Vec<(f64, f64)> = (0..table.rows.len()).map(|k| table.twist(k)).collect();

    let (_, angle) = miss(table, start, end);
    if angle.abs() > 1e-9 {
        let total: f64 = twists.iter().map(|(_, omega)| omega * omega).sum();
        let share = angle / (hold * total);
        if total == 0.0 || !twists.iter().all(|(_, omega)| (share * omega).abs() <= LARGEST_SHARE) {
            return false;
        }
        for (row, (_, omega)) in table.rows.iter_mut().zip(&twists) {
            let rim = 0.5 * track * share * omega * omega;
            row.wheel_left -= rim / radii[0];
            row.wheel_right += rim / radii[1];
        }
    }

    // Directions in which a row's travel moves the end; headings do not change from here on.
    let poses = table.replay(start);
    let directions: Vec<[f64; 2]> = (0..table.rows.len())
        .map(|k| {
            let half_turn = 0.5 * hold * table.twist(k).1;
            let (sin, cos) = real::sin_cos(poses[k].yaw + half_turn);
            [cos * sinc(half_turn), sin * sinc(half_turn)]
        })
        .collect();
    let mut gram = [0.0; 3];
    for (d, (v, _)) in directions.iter().zip(&twists) {
        let weight = hold * v * v;
        gram[0] += weight * d[0] * d[0];
        gram[1] += weight * d[0] * d[1];
        gram[2] += weight * d[1] * d[1];
    }
    // The end is linear in the rows' travel, so this converges at once; the second round takes up rounding.
    for _ in 0..3 {
        let reached = table.replay(start).last().copied().unwrap_or(start);
        let gap = [end.x - reached.x, end.y - reached.y];
        if real::hypot(gap[0], gap[1]) <= CLOSED {
            break;
        }
        let multiplier = least_norm(gram, gap);
        for ((row, d), (v, _)) in table.rows.iter_mut().zip(&directions).zip(&twists) {
            let rim = v * v * (multiplier[0] * d[0] + multiplier[1] * d[1]);
            row.wheel_left += rim / radii[0];
            row.wheel_right += rim / radii[1];
        }
    }
    let gentle = (0..table.rows.len()).all(|k| {
        let (v, _) = table.twist(k);
        (v - twists[k].0).abs() <= LARGEST_SHARE * twists[k].0.abs()
    });
    let (distance, angle) = miss(table, start, end);
    if gentle && distance <= tolerance && angle.abs() <= 1e-6 {
        return true;
    }
    for (row, [left, right]) in table.rows.iter_mut().zip(original) {
        (row.wheel_left, row.wheel_right) = (left, right);
    }
    false
}

/// Solves the symmetric system [[g0, g1], [g1, g2]] x = b; a direction that the path hardly has is left out.
fn least_norm(g: [f64; 3], b: [f64; 2]) -> [f64; 2] {
    let (mean, half) = (0.5 * (g[0] + g[2]), 0.5 * (g[0] - g[2]));
    let radius = real::hypot(half, g[1]);
    // Eigenvectors at half the angle of (half, g1).
    let angle = 0.5 * real::atan2(g[1], half);
    let (sin, cos) = real::sin_cos(angle);
    let mut x = [0.0; 2];
    for (value, axis) in [(mean + radius, [cos, sin]), (mean - radius, [-sin, cos])] {
        if value > 1e-9 * mean {
            let along = (axis[0] * b[0] + axis[1] * b[1]) / value;
            x[0] += along * axis[0];
            x[1] += along * axis[1];
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_least_norm_solution_solves_what_can_be_solved() {
        let x = least_norm([2.0, 0.5, 1.0], [1.0, -3.0]);
        assert!((2.0 * x[0] + 0.5 * x[1] - 1.0).abs() < 1e-14 && (0.5 * x[0] + x[1] + 3.0).abs() < 1e-14);
        let flat = least_norm([4.0, 0.0, 0.0], [1.0, 1e-5]);
        assert_eq!(flat, [0.25, 0.0]);
        assert_eq!(least_norm([0.0; 3], [1.0, 1.0]), [0.0, 0.0]);
    }
}
