//! How far held commands leave the planned path, against the sampling time (\[CONV\] section 4).

mod foot;
mod reference;

use crate::command::{CommandError, CommandTable, SampleOptions, sample, sample_uncorrected};
use crate::geom::{Pose2, wrap_angle};
use crate::mission::Sampling;
use crate::retime::MotionProfile;
use crate::robot::RobotModel;

pub use reference::PathReference;

/// Distance between points of the replay that are measured, m, and their number in a row, at least and at most: between rows the
/// replay leaves the path in one bend or two.
const STEP: f64 = 2e-3;
const PARTS: (f64, f64) = (4.0, 12.0);
/// Points between two neighbours among which the largest distance is looked for more closely, and how often.
const FINER: (usize, usize) = (4, 2);
/// Sampling times that [`within`] tries, s: two digits, about a fifth apart, in each power of ten from the first to the last.
const DIGITS: [f64; 12] = [1.0, 1.2, 1.5, 1.8, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0];
const POWERS: [f64; 3] = [1e3, 1e2, 1e1];
/// Rows beyond which a sampling time is too short to be tried.
const TRIED_ROWS: f64 = 2e5;

/// One row of `path_error.csv`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathErrorRow {
    /// s.
    pub sampling_time: f64,
    /// How wheel speeds were sampled.
    pub sampling: Sampling,
    /// Largest distance of the replay from the planned path, between samples included, m.
    pub lateral_max: f64,
    /// Root mean square of it over the distance driven, m.
    pub lateral_rms: f64,
    /// Distance from the replay's end to the path's, m.
    pub end_point: f64,
    /// Absolute difference of the headings there, rad.
    pub end_heading: f64,
    /// Proven clearance of these commands, m, where there is a map and it was asked for. Set by the caller.
    pub clearance_min: Option<f64>,
}

impl PathErrorRow {
    /// The larger of the largest distance from the path and the distance at the end, m.
    pub fn largest(&self) -> f64 {
        self.lateral_max.max(self.end_point)
    }
}

/// The path error for each of `samplings` at each of `times`, by the machinery that writes commands: rounded up, within limits, end point
/// corrected where that is needed. Where no correction closes the end, the row tells what the plain samples do; where `tracked` is
/// not to be had, it is one of `mean`.
///
/// `clearance` judges each table; return `None` where there is nothing to judge.
///
/// # Errors
/// A sampling time that is none, or too many rows.
pub fn path_errors(
    profile: &MotionProfile,
    robot: &RobotModel,
    times: &[f64],
    samplings: &[Sampling],
    mut clearance: impl FnMut(&CommandTable) -> Option<f64>,
) -> Result<Vec<PathErrorRow>, CommandError> {
    let reference = PathReference::new(profile);
    let mut rows = Vec::with_capacity(samplings.len() * times.len());
    for sampling in samplings {
        for time in times {
            let (row, table) = path_error(profile, robot, (*time, *sampling), &reference)?;
            rows.push(PathErrorRow { clearance_min: clearance(&table), ..row });
        }
    }
    Ok(rows)
}

/// The answer of [`within`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Within {
    /// What was asked, m.
    pub bound: f64,
    /// Asked for.
    pub sampling: Sampling,
    /// At the largest sampling time with which, and with all shorter ones that were tried, the larger of distance from the path and
    /// distance at the end is within the bound; `None`: not even at the shortest.
    pub row: Option<PathErrorRow>,
    /// At the next longer one, which is not; `None`: there is none longer.
    pub beyond: Option<PathErrorRow>,
}

/// The largest sampling time, out of some per power of ten between 1 ms and 0.8 s, with which commands leave the path by no more than
/// `bound` (m).
///
/// # Errors
/// As [`path_errors`].
pub fn within(
    profile: &MotionProfile,
    robot: &RobotModel,
    sampling: Sampling,
    bound: f64,
    mut clearance: impl FnMut(&CommandTable) -> Option<f64>,
) -> Result<Within, CommandError> {
    let reference = PathReference::new(profile);
    let times = POWERS.iter().flat_map(|power| DIGITS.map(|digit| digit / power));
    let mut found: Option<(PathErrorRow, CommandTable)> = None;
    let mut beyond = None;
    for time in times.filter(|time| profile.time() / time <= TRIED_ROWS) {
        let (row, table) = path_error(profile, robot, (time, sampling), &reference)?;
        if row.largest() > bound {
            beyond = Some(row);
            break;
        }
        found = Some((row, table));
    }
    let row = found.map(|(row, table)| PathErrorRow { clearance_min: clearance(&table), ..row });
    Ok(Within { bound, sampling, row, beyond })
}

fn path_error(
    profile: &MotionProfile,
    robot: &RobotModel,
    (sampling_time, sampling): (f64, Sampling),
    reference: &PathReference,
) -> Result<(PathErrorRow, CommandTable), CommandError> {
    let options = SampleOptions { sampling_time, sampling };
    let table = match sample(profile, robot, &options) {
        Err(CommandError::EndPoint { .. } | CommandError::Limits { .. }) => {
            sample_uncorrected(profile, robot, &options)?
        }
        other => other?,
    };
    Ok((path_error_of_table(&table, profile.pose(0.0), reference), table))
}

/// The path error of a table: its replay from `start` against the planned path.
pub fn path_error_of_table(table: &CommandTable, start: Pose2, reference: &PathReference) -> PathErrorRow {
    let poses = table.replay(start);
    let (mut largest, mut squares, mut driven) = (0.0f64, 0.0, 0.0);
    // Of the point that is farthest off: its row, how far into it, the cursor there, and the time between points.
    let mut farthest = (0, 0.0, 0, 0.0);
    let mut cursor = 0;
    for (k, pose) in poses.iter().enumerate() {
        let (v, omega) = table.twist(k);
        let length = if k + 1 < poses.len() { v.abs() * table.sampling_time } else { 0.0 };
        let parts = if length > 0.0 { (length / STEP).ceil().clamp(PARTS.0, PARTS.1) } else { 1.0 };
        let step = table.sampling_time / parts;
        for part in 0..parts as usize {
            let at = pose.after_twist(v, omega, step * part as f64);
            let before = cursor;
            let off = reference.distance_along([at.x, at.y], driven, &mut cursor);
            if off > largest {
                (largest, farthest) = (off, (k, step * part as f64, before, step));
            }
            squares += off * off * length / parts;
            driven += length / parts;
        }
    }
    let (row, mut middle, cursor, mut step) = farthest;
    for _ in 0..FINER.1 {
        step /= FINER.0 as f64;
        let (v, omega) = table.twist(row);
        let points = (0..2 * FINER.0).map(|i| middle + step * (i as f64 - FINER.0 as f64));
        let inside = points.filter(|t| (0.0..table.sampling_time).contains(t) && poses.len() > row + 1);
        for t in inside.collect::<Vec<_>>() {
            let at = poses[row].after_twist(v, omega, t);
            let mut near = cursor;
            let off = reference.distance_along([at.x, at.y], 0.0, &mut near);
            if off > largest {
                (largest, middle) = (off, t);
            }
        }
    }
    let last = poses.last().copied().unwrap_or(start);
    PathErrorRow {
        sampling_time: table.sampling_time,
        sampling: table.sampling,
        lateral_max: largest,
        lateral_rms: if driven > 0.0 { (squares / driven).sqrt() } else { 0.0 },
        end_point: last.distance(reference.end()),
        end_heading: wrap_angle(last.yaw - reference.end().yaw).abs(),
        clearance_min: None,
    }
}

#[cfg(test)]
mod tests;
