//! A robot whose wheels turn no faster than they can: the simulator of \[CONV\] section 3.

use crate::command::CommandTable;
use crate::geom::Pose2;

/// The commands as a robot carries them out that clips each wheel's rim speed at `speed` (m/s), by itself, and follows them exactly
/// otherwise.
pub fn clipped(table: &CommandTable, speed: f64) -> CommandTable {
    let rate = speed / table.wheel_radii.mean;
    let mut table = table.clone();
    for row in &mut table.rows {
        row.wheel_left = row.wheel_left.clamp(-rate, rate);
        row.wheel_right = row.wheel_right.clamp(-rate, rate);
    }
    table
}

/// Where the replay from `start` ends; the last row is at rest.
pub fn end(table: &CommandTable, start: Pose2) -> Pose2 {
    table.replay(start).last().copied().unwrap_or(start)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::CommandRow;
    use crate::math::real;
    use crate::mission::Sampling;

    fn circle(rims: [f64; 2], rows: usize) -> CommandTable {
        let row = |k: usize| CommandRow {
            wheel_left: if k < rows { rims[0] / 0.1 } else { 0.0 },
            wheel_right: if k < rows { rims[1] / 0.1 } else { 0.0 },
            joint_positions: Vec::new(),
            joint_velocities: Vec::new(),
            pose: Pose2::default(),
        };
        CommandTable {
            sampling_time: 0.1,
            sampling: Sampling::Instant,
            wheel_radii: 0.1.into(),
            track_width: 0.4,
            joints: Vec::new(),
            rows: (0..=rows).map(row).collect(),
        }
    }

    #[test]
    fn a_circle_whose_outer_wheel_is_clipped_is_a_wider_circle() {
        // 7 s at 0.6 and 0.3 m/s: a circle of 0.6 m. At 0.5 and 0.3 m/s: one of D/2 (0.5 + 0.3)/(0.5 - 0.3) = 0.8 m.
        let start = Pose2::new(1.0, -2.0, 0.4);
        for (rims, turn) in [([0.3, 0.6], 1.0), ([0.6, 0.3], -1.0), ([-0.3, -0.6], -1.0)] {
            let reached = end(&clipped(&circle(rims, 70), 0.5), start);
            let radius = 0.8 * rims[0].signum() * turn;
            let (from, to) = (start.yaw, start.yaw + turn * 0.2 / 0.4 * 7.0);
            let expected = Pose2::new(
                start.x + radius * (real::sin(to) - real::sin(from)),
                start.y - radius * (real::cos(to) - real::cos(from)),
                to,
            );
            assert!(reached.distance(expected) < 1e-12 && (reached.yaw - to).abs() < 1e-12, "{reached:?} {expected:?}");
        }
    }

    #[test]
    fn clipped_alike_a_straight_drive_is_short_by_what_was_clipped_and_within_the_limit_nothing_changes() {
        let reached = end(&clipped(&circle([0.6, 0.6], 50), 0.5), Pose2::default());
        assert!((reached.x - 2.5).abs() < 1e-12 && reached.y == 0.0);
        let gentle = circle([0.5, -0.5], 50);
        assert_eq!(clipped(&gentle, 0.5), gentle);
    }
}
