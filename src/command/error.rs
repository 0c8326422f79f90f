//! Why a profile cannot be sampled.

use crate::diag::{Describe, Diagnostic};
use crate::mission::Sampling;

/// Why a profile cannot be sampled.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CommandError {
    /// Not a positive number.
    #[error("sampling time {sampling_time} s is not a positive number")]
    SamplingTime {
        /// s.
        sampling_time: f64,
    },
    /// The motion has more rows than anybody can want.
    #[error("the motion lasts {time:.0} s: {rows:.0} rows of {sampling_time} s are too many")]
    TooLong {
        /// s.
        time: f64,
        /// s.
        sampling_time: f64,
        /// Rows.
        rows: f64,
    },
    /// No slow-down within reason makes the held commands keep a limit.
    #[error(
        "held for {sampling_time} s, the commands break a limit by {excess:.3e} even when slowed down to {time:.1} s"
    )]
    Limits {
        /// s.
        sampling_time: f64,
        /// Share of the limit.
        excess: f64,
        /// s.
        time: f64,
    },
    /// The replay misses the end, and no correction within the limits closes the gap.
    #[error(
        "held for {sampling_time} s ({sampling:?}), the commands end {distance:.4} m and {angle:.4} rad off, and no correction closes that"
    )]
    EndPoint {
        /// s.
        sampling_time: f64,
        /// How speeds were sampled.
        sampling: Sampling,
        /// m.
        distance: f64,
        /// rad.
        angle: f64,
    },
}

impl Describe for CommandError {
    fn diagnostic(&self) -> Diagnostic {
        let shorter = "take a shorter sampling time";
        match self {
            Self::SamplingTime { .. } => Diagnostic::error("command/sampling-time", self),
            Self::TooLong { .. } => Diagnostic::failure("command/too-long", self)
                .hint("another time law may be much faster: `auto` takes the fastest"),
            Self::Limits { excess, .. } => {
                Diagnostic::failure("command/limits", self).hint(shorter).number("excess", *excess)
            }
            Self::EndPoint { distance, angle, .. } => Diagnostic::failure("command/end-point", self)
                .hint(shorter)
                .number("end_point_error_m", *distance)
                .number("end_heading_error_rad", *angle),
        }
    }
}
