//! Stage 9: sampled commands, as they are written.

pub mod end_point;
pub mod error;
pub mod limits;
mod replay;
pub mod sample;
mod tracked;

use crate::geom::Pose2;
use crate::mission::Sampling;
use crate::robot::WheelRadii;

pub use error::CommandError;
pub use sample::{MOST_ROWS, sample, sample_uncorrected};

/// The command table: what is written to `commands.csv`, no more and no less. Row k is held from `time(k)` to `time(k + 1)`;
/// the last row is at rest.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandTable {
    /// Seconds a row is held. Row k's time is `k * sampling_time`.
    pub sampling_time: f64,
    /// How wheel speeds were sampled.
    pub sampling: Sampling,
    /// Of the driving wheels.
    pub wheel_radii: WheelRadii,
    /// m.
    pub track_width: f64,
    /// Names of the moving joints with a column, and whether prismatic.
    pub joints: Vec<(String, bool)>,
    /// In order of time.
    pub rows: Vec<CommandRow>,
}

/// One row.
#[derive(Debug, Clone, PartialEq)]
pub struct CommandRow {
    /// rad/s of the wheel itself.
    pub wheel_left: f64,
    /// rad/s.
    pub wheel_right: f64,
    /// Planned joint values at the row's time (rad or m).
    pub joint_positions: Vec<f64>,
    /// Held joint speeds: (next position - this one) / sampling time.
    pub joint_velocities: Vec<f64>,
    /// Planned pose at the row's time.
    pub pose: Pose2,
}

impl CommandTable {
    /// Time of row k, s. The same expression wherever a time is written or replayed.
    pub fn time(&self, k: usize) -> f64 {
        k as f64 * self.sampling_time
    }

    /// Time of the last row, s.
    pub fn duration(&self) -> f64 {
        self.time(self.rows.len().saturating_sub(1))
    }

    /// Speed (m/s) and turn rate (rad/s) held in row k.
    pub fn twist(&self, k: usize) -> (f64, f64) {
        let (left, right) = self.rim_speeds(k);
        (0.5 * (left + right), (right - left) / self.track_width)
    }

    /// Rim speeds (left, right) held in row k, m/s.
    pub fn rim_speeds(&self, k: usize) -> (f64, f64) {
        let ([left, right], row) = (self.wheel_radii.sides(), &self.rows[k]);
        (left * row.wheel_left, right * row.wheel_right)
    }
}

/// How to sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleOptions {
    /// s.
    pub sampling_time: f64,
    /// How wheel speeds follow from the profile.
    pub sampling: Sampling,
}
