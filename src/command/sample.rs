//! From functions of time to held commands.

use crate::mission::Sampling;
use crate::retime::MotionProfile;
use crate::robot::RobotModel;

use super::limits::{ROUNDING, differences, needed_slow_down};
use super::{CommandError, CommandRow, CommandTable, SampleOptions, end_point, tracked};

/// A replay that ends farther from the plan's end is corrected, m; half of what the certificate allows.
pub const CORRECT_BEYOND: f64 = 0.5e-3;
/// Likewise for the heading, rad; a quarter of what the certificate allows. Only `instant` misses it.
pub const CORRECT_ANGLE_BEYOND: f64 = 4e-4;
/// A corrected replay ends at least this near, m.
const CORRECTED_WITHIN: f64 = 0.05e-3;
/// More rows are refused.
pub const MOST_ROWS: f64 = 2e6;
/// Slow-downs before giving up.
const ATTEMPTS: usize = 60;

/// Positions off at the rows as a share of those of `mean`, per second of sampling time: what `tracked` aims at first, and then. In
/// proportion to the sampling time, so that they fall with its third power.
const CLOSENESS: [f64; 2] = [0.2, 1.0];
/// The share that is no reason to slow down.
const CLOSE: f64 = 0.1;
/// A slow-down that corrections of `tracked` are worth: the most that they can need if nothing else is wrong.
const WORTH: f64 = 1.034;

/// Samples a profile into held commands.
///
/// The profile is slowed down uniformly, in whole rows and by no more than needed, until the table *as written* keeps every limit, and
/// until its replay, corrected where it must be, ends within 0.5 mm of the profile's end; with `tracked` within 1 um. Where `tracked`
/// finds no correction, the table is that of `mean`, and says so.
///
/// # Errors
/// [`CommandError`]: a sampling time that is no such, too many rows, or no slow-down within reason helps.
pub fn sample(
    profile: &MotionProfile,
    robot: &RobotModel,
    options: &SampleOptions,
) -> Result<CommandTable, CommandError> {
    if options.sampling == Sampling::Tracked {
        let mean = SampleOptions { sampling: Sampling::Mean, ..*options };
        return match sample_tracked(profile, robot, &mean)? {
            Some(table) => Ok(table),
            None => sample(profile, robot, &mean),
        };
    }
    let hold = options.sampling_time;
    let mut rows = rows_of(profile, options)?;
    let mut slow_down = 1.0;
    let mut off = (0.0, 0.0);
    for _ in 0..ATTEMPTS {
        if rows > MOST_ROWS {
            return Err(CommandError::TooLong { time: rows * hold, sampling_time: hold, rows });
        }
        let mut table = uncorrected(profile, robot, options, rows as usize);
        slow_down = needed_slow_down(&table, robot);
        off = (0.0, 0.0);
        if slow_down <= 1.0 {
            let (start, end) = (profile.pose(0.0), profile.pose(profile.time()));
            off = end_point::miss(&table, start, end);
            if off.0 <= CORRECT_BEYOND && off.1.abs() <= CORRECT_ANGLE_BEYOND {
                return Ok(table);
            }
            if end_point::close(&mut table, start, end, CORRECTED_WITHIN) {
                slow_down = needed_slow_down(&table, robot);
                if slow_down <= 1.0 {
                    return Ok(table);
                }
            } else {
                // The miss falls with the square of the slow-down.
                slow_down = 1.05;
            }
        }
        rows = (rows + 1.0).max((rows * slow_down * (1.0 - ROUNDING)).ceil());
    }
    Err(if off.0 > CORRECT_BEYOND || off.1.abs() > CORRECT_ANGLE_BEYOND {
        let (distance, angle) = (off.0, off.1.abs());
        CommandError::EndPoint { sampling_time: hold, sampling: options.sampling, distance, angle }
    } else {
        CommandError::Limits { sampling_time: hold, excess: slow_down - 1.0, time: rows * hold }
    })
}

/// The corrected table of the least slow-down, from the options of the means; where none is close enough within what a slow-down is worth,
/// the first that ends as promised within its limits. `None`: not even that.
fn sample_tracked(
    profile: &MotionProfile,
    robot: &RobotModel,
    mean: &SampleOptions,
) -> Result<Option<CommandTable>, CommandError> {
    let mut rows = rows_of(profile, mean)?;
    let mut most = MOST_ROWS;
    let mut second_best = None;
    for _ in 0..ATTEMPTS {
        if rows > most {
            break;
        }
        let table = uncorrected(profile, robot, mean, rows as usize);
        let slow_down = needed_slow_down(&table, robot);
        if slow_down <= 1.0 {
            for closeness in CLOSENESS {
                let aim = (closeness * mean.sampling_time).min(CLOSE);
                let mut corrected = CommandTable { sampling: Sampling::Tracked, ..table.clone() };
                let Some(share) = tracked::correct(&mut corrected, robot, aim) else { continue };
                if needed_slow_down(&corrected, robot) <= 1.0 && turns_as_gently(&corrected, &table, robot) {
                    if share <= CLOSE {
                        return Ok(Some(corrected));
                    }
                    second_best.get_or_insert(corrected);
                }
            }
            most = most.min((rows * WORTH).max(rows + 2.0));
        }
        rows = (rows + 1.0).max((rows * slow_down * (1.0 - ROUNDING)).ceil());
    }
    Ok(second_best)
}

/// Whether corrections ask for no more angular acceleration than the plan's limit of it, or than was there before. Wheels keep their limits
/// with more, but no plan should promise one thing and command another.
fn turns_as_gently(corrected: &CommandTable, before: &CommandTable, robot: &RobotModel) -> bool {
    let peak =
        |table: &CommandTable| differences((0..table.rows.len()).map(|k| table.twist(k).1), table.sampling_time)[1];
    peak(corrected) <= peak(before).max(robot.base.angular_acceleration) * (1.0 + ROUNDING)
}

/// Samples a profile without slow-down and without correction: what the sampling alone does to a path.
///
/// # Errors
/// A sampling time that is no such, or too many rows.
pub fn sample_uncorrected(
    profile: &MotionProfile,
    robot: &RobotModel,
    options: &SampleOptions,
) -> Result<CommandTable, CommandError> {
    let rows = rows_of(profile, options)?;
    // What `tracked` corrects are means.
    let sampling = if options.sampling == Sampling::Tracked { Sampling::Mean } else { options.sampling };
    let options = &SampleOptions { sampling, ..*options };
    if rows > MOST_ROWS {
        let hold = options.sampling_time;
        return Err(CommandError::TooLong { time: rows * hold, sampling_time: hold, rows });
    }
    Ok(uncorrected(profile, robot, options, rows as usize))
}

/// Intervals that the profile takes, rounded up.
fn rows_of(profile: &MotionProfile, options: &SampleOptions) -> Result<f64, CommandError> {
    let hold = options.sampling_time;
    if !(hold.is_finite() && hold > 0.0) {
        return Err(CommandError::SamplingTime { sampling_time: hold });
    }
    Ok((profile.rounded_up(hold).time() / hold).round())
}

/// The table of the profile slowed down to `intervals` holds.
fn uncorrected(profile: &MotionProfile, robot: &RobotModel, options: &SampleOptions, intervals: usize) -> CommandTable {
    let hold = options.sampling_time;
    let profile = profile.slowed_to(intervals as f64 * hold);
    let joints = robot.joints.len();
    let radii = robot.wheel_radii.sides();
    let mut positions = profile.joints(0.0);
    let mut means = profile.mean_speeds(intervals);
    means.push(vec![0.0; 2 + joints]);
    let rows = means
        .into_iter()
        .enumerate()
        .map(|(k, mean)| {
            let t = k as f64 * hold;
            let rims = match options.sampling {
                Sampling::Instant if k < intervals => profile.speeds(t),
                _ => mean.clone(),
            };
            let row = CommandRow {
                wheel_left: rims[0] / radii[0],
                wheel_right: rims[1] / radii[1],
                joint_positions: positions.clone(),
                joint_velocities: mean[2..].to_vec(),
                pose: profile.pose(t),
            };
            // Positions are the running sum of what is held, so that the two columns agree to rounding.
            positions.iter_mut().zip(&mean[2..]).for_each(|(position, speed)| *position += speed * hold);
            row
        })
        .collect();
    CommandTable {
        sampling_time: hold,
        sampling: options.sampling,
        wheel_radii: robot.wheel_radii,
        track_width: robot.track_width,
        joints: robot.joints.iter().map(|joint| (joint.name.clone(), joint.prismatic)).collect(),
        rows,
    }
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod zone_tests;
