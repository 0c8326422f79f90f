//! `report.json`, schema `trajc.report/1`: names and nesting as other programs read them. A part that a run did not reach is
//! absent; no number is ever NaN or infinite.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Metrics, PathErrorRow};

/// The value of `schema`.
pub const SCHEMA: &str = "trajc.report/1";

/// Everything known about one run of a mission. Starts as `failed` and is `certified` only by [`Report::judge`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Report {
    /// Always `trajc.report/1`.
    pub schema: String,
    /// The verdict.
    pub status: Status,
    /// Why there are no commands; absent when certified.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<Failure>,
    /// The files that were read.
    pub inputs: InputsPart,
    /// The robot as understood.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub robot: Option<RobotPart>,
    /// The map as understood.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub map: Option<MapPart>,
    /// The search.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub search: Option<SearchPart>,
    /// The trajectory that the commands follow.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trajectory: Option<TrajectoryPart>,
    /// The search's lattice path, before anything smoothed it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub initial: Option<InitialPart>,
    /// The time law.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub profile: Option<ProfilePart>,
    /// Peaks of every actuator as written, against its limits.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub limits: Vec<LimitPart>,
    /// The command table.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub commands: Option<CommandsPart>,
    /// What was proven.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub certificate: Option<CertificatePart>,
    /// How far the commands can be trusted without feedback.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trust: Option<TrustPart>,
    /// Path error by sampling time.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub path_error: Vec<PathErrorRow>,
}

/// The verdict on a mission.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    /// Command files are written and proven.
    Certified,
    /// No command file exists.
    Failed,
}

/// Why a run failed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Failure {
    /// The stage that failed: `mission`, `robot`, `map`, `search`, `retime`, `certify`, …
    pub stage: String,
    /// One sentence, or several, for a person.
    pub reason: String,
    /// Stable identifier, such as `search/exhausted`.
    pub code: String,
    /// Figures that explain it, by name.
    #[serde(flatten)]
    pub numbers: serde_json::Map<String, serde_json::Value>,
}

/// The files that were read.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct InputsPart {
    /// The mission.
    pub mission: InputFile,
    /// robot.yaml, or the URDF where the mission names one alone.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub robot: Option<InputFile>,
    /// The map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub map: Option<InputFile>,
    /// Files that those name: URDF, meshes, images, a path.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub other: Vec<InputFile>,
}

impl InputsPart {
    /// All of them.
    pub fn files(&self) -> impl Iterator<Item = &InputFile> {
        std::iter::once(&self.mission).chain(&self.robot).chain(&self.map).chain(&self.other)
    }
}

/// A file that was read.
#[derive(Debug, Clone, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
pub struct InputFile {
    /// As the mission spells it.
    pub path: String,
    /// Of its bytes, hexadecimal.
    pub blake3: String,
}

/// The robot as understood.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotPart {
    /// Its name.
    pub name: String,
    /// Mean of both sides, m.
    pub wheel_radius_m: f64,
    /// By how much the right wheel is larger than the left one, as a share of the mean; absent: not at all.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub wheel_difference: Option<f64>,
    /// Distance between the driving wheels, m.
    pub track_width_m: f64,
    /// The moving joints.
    pub joints: Vec<JointPart>,
    /// Number of collision shapes.
    pub shapes: usize,
    /// Pairs of links that move against each other and are not checked against each other.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub ignored_pairs: Vec<IgnoredPairPart>,
}

/// A pair of links that is not checked.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct IgnoredPairPart {
    /// URDF links.
    pub links: [String; 2],
    /// `joined`: by a joint; `named`: in robot.yaml; `always_touch`: in every posture; `telescope`: tubes of one; `touch_at_rest`:
    /// with all joints at rest, where robot.yaml names none.
    pub reason: String,
}

/// A moving joint; `null`: given nowhere. Units: rad or, when prismatic, m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JointPart {
    /// URDF name.
    pub name: String,
    /// Slides instead of turning.
    pub prismatic: bool,
    /// Least position.
    pub lower: Option<f64>,
    /// Greatest position.
    pub upper: Option<f64>,
    /// Per second.
    pub speed: Option<f64>,
    /// Per second squared.
    pub acceleration: Option<f64>,
    /// Per second cubed.
    pub jerk: Option<f64>,
}

/// The map as understood.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct MapPart {
    /// Cells along x, y, z.
    pub dims: [usize; 3],
    /// Size of a cell, m.
    pub resolution_m: f64,
    /// Occupied cells.
    pub occupied: usize,
    /// Lower corner of the grid, m.
    pub origin_m: [f64; 3],
    /// Points in the file.
    pub points: usize,
    /// Points skipped because a coordinate is not finite.
    pub not_finite: usize,
    /// Points or voxels outside `height_m`.
    pub cut: usize,
    /// Cells occupied only because they are unknown.
    pub unknown: usize,
}

/// The search.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SearchPart {
    /// States expanded.
    pub expanded: usize,
    /// Length of the path found, m.
    pub length_m: f64,
}

/// The trajectory that the commands follow.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrajectoryPart {
    /// `optimised`, `search` (the fall-back) or `given`.
    pub source: String,
    /// What the optimiser's polynomials are of: `flat` (positions) or `arc_length` (heading and arc length).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parameterisation: Option<String>,
    /// Polynomial pieces.
    pub pieces: usize,
    /// Iterations of the optimiser.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub iterations: Option<usize>,
    /// How the optimiser ended: `converged`, `iteration_limit`, `line_search_stalled`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ending: Option<String>,
    /// Of the optimiser's own timing; with `search` and `given` of the driven path.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub metrics: Option<Metrics>,
}

/// The search's lattice path.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct InitialPart {
    /// Timed by trapezoids of speed.
    pub metrics: Metrics,
}

/// The time law.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ProfilePart {
    /// Which law timed the path (`auto` says which it took).
    pub time_law: String,
    /// After slow-down and rounding up to the sampling time, s.
    pub time_s: f64,
    /// Speed limit of the law, m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub v_max_mps: Option<f64>,
    /// Speed limit after compensation for curvature, m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub v_comp_mps: Option<f64>,
}

/// One actuator's peak against its limit; wheels in m/s at the rim, joints in rad or m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LimitPart {
    /// `wheel_left`, `wheel_right`, or the joint's name.
    pub actuator: String,
    /// `speed`, `acceleration` or `jerk`.
    pub quantity: String,
    /// Largest magnitude; `null`: not a number.
    pub peak: Option<f64>,
    /// `null`: given nowhere, not checked.
    pub limit: Option<f64>,
}

/// The command table.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CommandsPart {
    /// Rows, the last one at rest.
    pub rows: usize,
    /// Seconds a row is held.
    pub sampling_time_s: f64,
    /// `mean`, `instant` or `tracked`.
    pub sampling: String,
    /// Time of the last row, s.
    pub duration_s: f64,
}

/// What was proven.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CertificatePart {
    /// m; absent without a map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clearance_required_m: Option<f64>,
    /// A lower bound of the true clearance, m; absent without a map. Where nothing is near, [`FAR`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clearance_proven_m: Option<f64>,
    /// From the goal's point, m; `null`: not a number.
    pub end_point_error_m: Option<f64>,
    /// How far from its point a goal with `within_m` allows, m; absent where it allows what every end may miss.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub goal_within_m: Option<f64>,
    /// rad; absent where the goal leaves the heading open.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub end_heading_error_rad: Option<f64>,
    /// Where the link ends that the goal names; absent where it names none. `goal_within_m` is how far the link reaches then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link: Option<LinkPart>,
    /// The mission's `via`, in order: each with the time at which the robot first stands there.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub vias: Vec<ViaPart>,
    /// The mission's `map.speed_zones`, in order: each with the greatest speed in it.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub speed_zones: Vec<ZonePart>,
    /// Whether no limit is exceeded.
    pub limits_hold: bool,
    /// The closest approach found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closest: Option<ClosestPart>,
    /// What was proven of every robot within the tolerance; absent where neither mission nor robot.yaml has a `tolerance`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<InTubePart>,
    /// The robot's links against each other; absent where none that are checked move against each other.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub own_links: Option<OwnLinksPart>,
}

/// Where a link ends that must be somewhere.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LinkPart {
    /// URDF name.
    pub name: String,
    /// From its place, m.
    pub point_error_m: f64,
    /// What that may be, m.
    pub within_m: f64,
    /// How far it is from being turned as it is to be, rad; absent where that is open.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle_error_rad: Option<f64>,
}

/// What was proven of every robot within the tolerance (`trust.tolerance`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct InTubePart {
    /// A lower bound of their clearance, m; absent without a map. Where nothing is near, [`FAR`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clearance_proven_m: Option<f64>,
    /// The closest approach of any of them, as far as it is bounded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closest: Option<ClosestPart>,
    /// How far the base may be off there, m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closest_off_m: Option<f64>,
    /// How far the heading may be off there, rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub closest_off_rad: Option<f64>,
    /// How much nearer each tolerance may bring the link there, m, by its key in a mission.
    #[serde(default, skip_serializing_if = "std::collections::BTreeMap::is_empty")]
    pub closest_shares_m: std::collections::BTreeMap<String, f64>,
    /// How far the base may be off at the end, m.
    pub end_m: Option<f64>,
    /// How far the heading may be off at the end, rad.
    pub end_rad: Option<f64>,
}

/// How far the commands can be trusted without feedback.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TrustPart {
    /// Whether the mission or robot.yaml says the tolerance, so that it is certified; else it is assumed for this figure alone.
    pub in_force: bool,
    /// How far the robot may be off.
    pub tolerance: TolerancePart,
    /// Length of the base's path, m.
    pub length_m: f64,
    /// s.
    pub duration_s: f64,
    /// How far the base may be off at the end, m.
    pub end_m: Option<f64>,
    /// How far the heading may be off at the end, rad.
    pub end_rad: Option<f64>,
    /// Length of the path on which no robot within the tolerance touches anything, m; absent without a map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trusted_m: Option<f64>,
    /// The same in s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trusted_s: Option<f64>,
    /// Whether that is the whole path.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub whole: Option<bool>,
}

/// How far a robot may be off; see docs/tolerance.md.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TolerancePart {
    /// Both wheels' radii alike, as a share.
    pub wheel_radius: f64,
    /// The right wheel's radius less the left one's, as a share.
    pub wheel_difference: f64,
    /// The track width, as a share.
    pub track: f64,
    /// s.
    pub latency_s: f64,
    /// m.
    pub start_m: f64,
    /// rad.
    pub start_rad: f64,
}

/// A via that was reached.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ViaPart {
    /// s.
    pub time_s: f64,
    /// m.
    pub point_error_m: f64,
    /// rad; absent where the via leaves the heading open.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heading_error_rad: Option<f64>,
}

/// A speed zone.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ZonePart {
    /// Allowed there, m/s.
    pub limit_mps: f64,
    /// Greatest speed of the base at any instant there, m/s; absent: it is proven to keep out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub peak_mps: Option<f64>,
}

/// What was proven of the robot's links against each other.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct OwnLinksPart {
    /// Pairs of links that were checked; those that were not: `robot.ignored_pairs`.
    pub pairs_checked: usize,
    /// Whether none of them touch at any instant.
    pub keep_apart: bool,
}

/// What is written for a clearance without bound, m: JSON has no infinity, and a lower bound may be any smaller number.
pub const FAR: f64 = 1e6;

/// The closest approach found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ClosestPart {
    /// s.
    pub time_s: f64,
    /// URDF link.
    pub link: String,
    /// The obstacle's box; absent: unseen space beyond the map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub obstacle: Option<BoxPart>,
    /// Distance at that instant, m; not positive: overlap.
    pub distance_m: f64,
}

/// An axis-aligned box, m.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BoxPart {
    /// Lower corner.
    pub min: [f64; 3],
    /// Upper corner.
    pub max: [f64; 3],
}

impl Report {
    /// The bytes of `report.json`: indented, ends in a newline, keys in the order of this struct.
    pub fn to_json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self).expect("string keys and finite or null numbers only");
        text.push('\n');
        text
    }
}

/// JSON Schema of `report.json` for editors and validators, as indented text.
pub fn json_schema() -> String {
    let schema = schemars::schema_for!(Report);
    let mut text = serde_json::to_string_pretty(&schema).expect("a schema is plain JSON");
    text.push('\n');
    text
}
