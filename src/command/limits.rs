//! The limits of the table as written: first and second differences of what is held, at rest before and after.

use crate::math::real;
use crate::robot::{MotionLimits, RobotModel};

use super::CommandTable;

/// What counts as rounding, as a share of a limit.
pub const ROUNDING: f64 = 1e-9;

/// By how much the table must be slowed down for every limit to hold: the largest of speed ratio, root of the acceleration ratio
/// and cube root of the jerk ratio. At most 1: nothing is exceeded.
pub fn needed_slow_down(table: &CommandTable, robot: &RobotModel) -> f64 {
    let mut needed = 0.0f64;
    for side in 0..2 {
        let speeds = (0..table.rows.len()).map(|k| {
            let (left, right) = table.rim_speeds(k);
            [left, right][side]
        });
        needed = needed.max(of_actuator(speeds, &robot.wheel, table.sampling_time));
    }
    for (joint, model) in robot.joints.iter().enumerate() {
        let speeds = table.rows.iter().map(|row| row.joint_velocities[joint]);
        needed = needed.max(of_actuator(speeds, &model.limits, table.sampling_time));
    }
    needed
}

/// The largest ratio of peak to limit, no root taken; 1 + [`ROUNDING`] still holds.
pub fn largest_ratio(peaks: [f64; 3], limits: &MotionLimits) -> [f64; 3] {
    let limits = [limits.speed, limits.acceleration, limits.jerk];
    [0, 1, 2].map(|k| limits[k].map_or(0.0, |limit| peaks[k] / limit))
}

fn of_actuator(speeds: impl Iterator<Item = f64>, limits: &MotionLimits, hold: f64) -> f64 {
    let [speed, acceleration, jerk] = largest_ratio(differences(speeds, hold), limits).map(|ratio| {
        // What is rounding is no excess; a true one is corrected whole.
        if ratio <= 1.0 + ROUNDING { ratio.min(1.0) } else { ratio }
    });
    speed.max(acceleration.sqrt()).max(real::cbrt(jerk))
}

/// Largest |speed|, |first difference|/hold and |second difference|/hold^2 of held speeds, at rest before and after.
pub fn differences(speeds: impl Iterator<Item = f64>, hold: f64) -> [f64; 3] {
    let (mut before, mut last) = (0.0, 0.0);
    let mut peaks = [0.0f64; 3];
    for speed in speeds.chain([0.0, 0.0]) {
        peaks[0] = peaks[0].max(f64::abs(speed));
        peaks[1] = peaks[1].max(f64::abs(speed - last));
        peaks[2] = peaks[2].max(f64::abs(speed - 2.0 * last + before));
        (before, last) = (last, speed);
    }
    [peaks[0], peaks[1] / hold, peaks[2] / (hold * hold)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_count_the_rest_before_and_after() {
        assert_eq!(differences([1.0].into_iter(), 0.5), [1.0, 2.0, 8.0]);
        assert_eq!(differences([1.0, 2.0, 2.0].into_iter(), 1.0), [2.0, 2.0, 2.0]);
        assert_eq!(differences(std::iter::empty(), 1.0), [0.0; 3]);
    }
}
