//! Stage 1: what the user asks for. YAML text in, [`Mission`] out; all defaults applied, all numbers SI and finite.

mod fields;
pub(crate) mod limits;
mod read;
mod solids;
pub(crate) mod tolerance;
mod zones;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use crate::diag::{Diagnostics, Source, Span, json_schema};
use crate::geom::Aabb;
pub use solids::KeepOut;
pub use tolerance::Tolerance;
pub use zones::SpeedZone;

/// A mission, as written plus defaults. File names are as written, relative to the mission's folder.
#[derive(Debug, Clone, PartialEq)]
pub struct Mission {
    /// The file's stem.
    pub name: String,
    /// robot.yaml, or a .urdf alone.
    pub robot: PathBuf,
    /// Where the obstacles are. Absent only with a given path.
    pub map: Option<MapSpec>,
    /// Start; with a given path, what of it the mission overrides.
    pub start: Option<PoseSpec>,
    /// A command file where whose motion ends this one starts, as written. What is in it becomes the start once it is read.
    pub start_file: Option<PathBuf>,
    /// Goal; likewise.
    pub goal: Option<PoseSpec>,
    /// Where to stop on the way, in order.
    pub via: Vec<ViaSpec>,
    /// A given path instead of a search.
    pub path: Option<PathSpec>,
    /// What the certificate must prove, metres.
    pub clearance: f64,
    /// Seconds a command is held.
    pub sampling_time: f64,
    /// How wheel speeds are sampled.
    pub sampling: Sampling,
    /// How the path is timed.
    pub time_law: TimeLaw,
    /// Whether the search may drive backwards.
    pub reverse: bool,
    /// What the optimiser's polynomials are of.
    pub parameterisation: Parameterisation,
    /// Sampling times of the path-error report, seconds, ascending.
    pub path_error_times: Vec<f64>,
    /// Samplings that it is reported for: the mission's own, unless somebody asks for others.
    pub path_error_samplings: Vec<Sampling>,
    /// Overrides of the robot's limits.
    pub limits: LimitsSpec,
    /// How far the robot may be off its model, as far as the mission says; wins over the robot's, key by key.
    pub tolerance: Option<ToleranceSpec>,
    /// The text it was read from.
    pub source: Arc<Source>,
    /// Where in the text things are written.
    pub spans: MissionSpans,
}

/// Where in a mission's text things are written, for faults that only later stages can see. `None`: not written.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MissionSpans {
    /// The value of `robot`.
    pub robot: Option<Span>,
    /// `map` with its value.
    pub map: Option<Span>,
    /// The value of `map.file`.
    pub map_file: Option<Span>,
    /// The value of `map.resolution_m`.
    pub map_resolution: Option<Span>,
    /// The value of `map.height_m`.
    pub map_height: Option<Span>,
    /// The value of `map.origin_m`.
    pub map_origin: Option<Span>,
    /// `start` with its value.
    pub start: Option<Span>,
    /// The value of `start.file`.
    pub start_file: Option<Span>,
    /// `goal` with its value.
    pub goal: Option<Span>,
    /// The value of `goal.link.name`.
    pub goal_link: Option<Span>,
    /// Each item of `via`.
    pub via: Vec<Span>,
    /// `path` with its value.
    pub path: Option<Span>,
    /// The value of `path.file`.
    pub path_file: Option<Span>,
    /// The value of `time_law`.
    pub time_law: Option<Span>,
    /// Every joint that is named, in the order start, goal, via, limits.
    pub joints: Vec<NamedJoint>,
}

/// A joint that a mission names.
#[derive(Debug, Clone, PartialEq)]
pub struct NamedJoint {
    /// As written.
    pub name: String,
    /// `start`, `goal`, `via[0]`, … or `limits.joints`.
    pub under: String,
    /// The name's place.
    pub at: Span,
}

/// `map:` of a mission.
#[derive(Debug, Clone, PartialEq)]
pub struct MapSpec {
    /// The map file, as written.
    pub file: PathBuf,
    /// Cell size of point clouds; of grids only to be compared with their own.
    pub resolution: Option<f64>,
    /// Slab that holds obstacles. Without it: from 0.02 m to the top of the robot over all postures.
    pub height: Option<[f64; 2]>,
    /// What unseen space counts as.
    pub unknown: Unknown,
    /// Lower corner of a `.npy` grid.
    pub origin: Option<[f64; 3]>,
    /// Areas that count as obstacles.
    pub keep_out: Vec<KeepOut>,
    /// Boxes that count as obstacles, m.
    pub boxes: Vec<Aabb>,
    /// Areas in which the base is slower.
    pub speed_zones: Vec<SpeedZone>,
}

impl Mission {
    /// Where the base must be slow.
    pub fn speed_zones(&self) -> &[SpeedZone] {
        self.map.as_ref().map_or(&[], |map| &map.speed_zones)
    }
}

impl MapSpec {
    /// Whether the robot's height decides which cells are occupied.
    pub fn ends_at_the_robot(&self) -> bool {
        self.height.is_none() || self.keep_out.iter().any(|area| area.height.is_none())
    }
}

/// What unseen space counts as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Unknown {
    /// An obstacle.
    Occupied,
    /// Free.
    Free,
}

/// A start or goal. What is `None` or missing the compiler chooses (or takes from the given path).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PoseSpec {
    /// Metres. Always there in missions without a given path.
    pub x: Option<f64>,
    /// Metres.
    pub y: Option<f64>,
    /// How far from there will do, metres; 0: there, but for what a certificate allows every end. Of goals and vias.
    pub within: f64,
    /// Radians.
    pub yaw: Option<f64>,
    /// Joint values by name: radians or metres.
    pub joints: BTreeMap<String, f64>,
    /// Where a link must be, instead of the base: `x` and `y` are its position's then. Of goals.
    pub link: Option<LinkSpec>,
}

/// Where the frame of a link must be at the goal; base and joints are the compiler's choice as far as nothing else says.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkSpec {
    /// URDF name.
    pub name: String,
    /// Of the frame's origin, map frame, metres; z over the ground that the base stands on.
    pub position: [f64; 3],
    /// Roll, pitch and yaw of the frame against the map's axes, radians; `None`: any.
    pub rpy: Option<[f64; 3]>,
    /// How far from the position will do, metres.
    pub within: f64,
}

/// A stop on the way.
#[derive(Debug, Clone, PartialEq)]
pub struct ViaSpec {
    /// Where. The position is always there.
    pub place: PoseSpec,
    /// How long the robot stands there at least, s.
    pub dwell: f64,
}

/// `path:` of a mission.
#[derive(Debug, Clone, PartialEq)]
pub enum PathSpec {
    /// Cubic Bezier segments, each of four control points (metres).
    Bezier(Vec<[[f64; 2]; 4]>),
    /// A CSV file, as written.
    File(PathBuf),
}

/// How wheel speeds become held commands; `MATH` section 8.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sampling {
    /// Travel over the interval divided by its length: wheels, joints and heading are where they should be at every row.
    Mean,
    /// The speed at the interval's start, as in \[CONV\].
    Instant,
    /// `Mean`, corrected on the replay: positions are where they should be at every row, heading and joints at the end.
    Tracked,
}

impl Sampling {
    /// Where nobody asks for another.
    pub const DEFAULT: Self = Self::Tracked;
}

/// How a path is timed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeLaw {
    /// The fastest that keeps every limit.
    Auto,
    /// Least time under all limits.
    Optimal,
    /// Convolution profile in the wheel metric.
    Wheel,
    /// `v' = v_max / (1 + D/2 max|curvature|)`.
    FixedPoint,
    /// \[CONV\] Eq. 5, true arc length.
    Eq5,
    /// \[CONV\] Eq. 2 and 5 as printed.
    Printed,
    /// The optimiser's own timing.
    Minco,
}

/// What the optimiser's polynomials in time are of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
#[value(rename_all = "snake_case")]
pub enum Parameterisation {
    /// Positions (x, y), \[SCR\] section III: the flat output of the base. Stops where it must turn on the spot.
    Flat,
    /// Heading and arc length, `MATH` section 10: turns on the spot and changes of direction are part of the motion.
    ArcLength,
}

impl Parameterisation {
    /// What a mission gets that names none.
    pub const DEFAULT: Self = Self::ArcLength;

    /// What a mission gets that names a law, but no parameterisation: laws of the distance driven have nothing to say where the base
    /// stands, as it may within the legs of [`Self::ArcLength`].
    pub fn suiting(law: TimeLaw) -> Self {
        match law {
            TimeLaw::Eq5 | TimeLaw::FixedPoint | TimeLaw::Printed | TimeLaw::Wheel => Self::Flat,
            TimeLaw::Auto | TimeLaw::Optimal | TimeLaw::Minco => Self::DEFAULT,
        }
    }

    /// Its word in missions, reports and options.
    pub fn key(self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::ArcLength => "arc_length",
        }
    }
}

impl Default for Parameterisation {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// Limits by part, each key optional; the mission's win over robot.yaml's, key by key. SI units.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct LimitsSpec {
    /// Of each driving wheel's rim.
    pub wheel: ActuatorLimitsSpec,
    /// By joint name.
    pub joints: BTreeMap<String, ActuatorLimitsSpec>,
    /// Of the base.
    pub base: BaseLimitsSpec,
    /// Where the joints are named, in their order.
    pub places: Vec<(String, Span)>,
}

/// Limits of one actuator. `lower`, `upper` only for joints.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ActuatorLimitsSpec {
    /// rad or m.
    pub lower: Option<f64>,
    /// rad or m.
    pub upper: Option<f64>,
    /// Per second.
    pub speed: Option<f64>,
    /// Per second squared.
    pub acceleration: Option<f64>,
    /// Per second cubed.
    pub jerk: Option<f64>,
}

/// `limits.base`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BaseLimitsSpec {
    /// m/s.
    pub speed: Option<f64>,
    /// m/s^2.
    pub acceleration: Option<f64>,
    /// rad/s.
    pub angular_speed: Option<f64>,
    /// rad/s^2.
    pub angular_acceleration: Option<f64>,
    /// \[SCR\] Eq. 14.
    pub eta: Option<f64>,
    /// m/s.
    pub min_speed: Option<f64>,
}

/// `tolerance:` as written; each key optional. What it means: [`Tolerance`].
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ToleranceSpec {
    /// A share.
    pub wheel_radius: Option<f64>,
    /// A share.
    pub wheel_difference: Option<f64>,
    /// A share.
    pub track: Option<f64>,
    /// s.
    pub latency: Option<f64>,
    /// m.
    pub start_distance: Option<f64>,
    /// rad.
    pub start_angle: Option<f64>,
}

/// Reads a mission. `name` is the file's path as the user knows it (its stem becomes the mission's name).
///
/// # Errors
/// All faults found: YAML syntax, unknown keys (with the nearest known one), missing keys, values out of range.
pub fn parse(name: &str, text: &str) -> Result<Mission, Diagnostics> {
    read::parse(name, text)
}

/// JSON Schema (draft 2020-12) of a mission file, from the table of keys that [`parse`] checks against.
pub fn json_schema() -> serde_json::Value {
    let planned = serde_json::json!({"required": ["map", "start", "goal"]});
    let given = serde_json::json!({"required": ["path"]});
    json_schema::document(
        "trajc mission",
        "What trajc compiles: a robot, a map, a start and a goal, or a given path.",
        &fields::MISSION,
        &[("anyOf", serde_json::json!([planned, given]))],
    )
}

#[cfg(test)]
mod tests;
