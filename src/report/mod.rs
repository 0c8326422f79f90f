//! Stage 11: what is reported about a mission: `report.json`, the text on the terminal, figures.

mod build;
pub mod metrics;
pub mod names;
pub mod page;
pub mod path_error;
pub mod plot;
pub mod schema;
pub mod summary;

pub use metrics::Metrics;
pub use schema::{Report, Status, json_schema};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Path error of the commands that one sampling time gives: a row of `path_error.csv` and of `report.json`'s `path_error`.
/// Measured on the replay of held commands against the exact path.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PathErrorRow {
    /// Seconds a command is held.
    pub sampling_time_s: f64,
    /// `mean`, `instant` or `tracked`; see [`names::sampling`].
    pub sampling: String,
    /// Greatest distance of the replay from the path, m.
    pub lateral_max_m: f64,
    /// Root mean square of that distance over the distance driven, m.
    pub lateral_rms_m: f64,
    /// Distance of the replay's end from the path's end, m.
    pub end_point_m: f64,
    /// Angle between the replay's heading at the end and the path's, rad, not negative.
    pub end_heading_rad: f64,
    /// Proven clearance of these commands, m; `None` without a map.
    pub clearance_min_m: Option<f64>,
}

impl From<&path_error::PathErrorRow> for PathErrorRow {
    fn from(row: &path_error::PathErrorRow) -> Self {
        Self {
            sampling_time_s: row.sampling_time,
            sampling: names::sampling(row.sampling).into(),
            lateral_max_m: row.lateral_max,
            lateral_rms_m: row.lateral_rms,
            end_point_m: row.end_point,
            end_heading_rad: row.end_heading,
            clearance_min_m: row.clearance_min,
        }
    }
}
