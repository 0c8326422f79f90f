//! Stage 10: the proof. Replays the commands as the robot will (zero-order hold) from commands, robot and voxels alone.
//! Never imports `esdf`, `search`, `optimize` or `retime`: a bug there cannot certify itself.

mod clearance;
mod distance;
mod ends;
mod limits;
mod motion;
mod obstacles;
mod own_links;
mod rollout;
mod series;
mod simplex;
mod table;
#[cfg(test)]
mod tests;
mod trust;
mod tube;
mod vias;
mod zones;

use rollout::Rollout;
pub use series::{Instant, distances};
pub use trust::{Trust, TubePoint, trust, tube_along};
pub use tube::{Shares, Width};

use nalgebra::UnitQuaternion;

use crate::command::CommandTable;
use crate::geom::{Aabb, Pose2};
use crate::map::VoxelMap;
use crate::mission::{SpeedZone, Tolerance};
use crate::robot::RobotModel;

/// Ends within this distance of the goal, m.
pub const END_POINT_TOLERANCE: f64 = 1e-3;
/// Ends within this angle of the goal's heading (joints: of their values), rad. 0.1 degrees.
pub const END_ANGLE_TOLERANCE: f64 = 0.1 * std::f64::consts::PI / 180.0;
/// A link that must be turned some way at the goal is turned so to this, rad. 1 degree.
pub const LINK_ANGLE_TOLERANCE: f64 = std::f64::consts::PI / 180.0;

/// What the commands must do.
#[derive(Debug, Clone, PartialEq)]
pub struct Task {
    /// Where the base starts.
    pub start: Pose2,
    /// Joint values at the start.
    pub start_joints: Vec<f64>,
    /// Where it must end.
    pub goal: Goal,
    /// Clearance to prove, m; has no meaning without a map.
    pub clearance: f64,
    /// Whether the base may drive backwards.
    pub reverse: bool,
}

/// Where a motion must end; `None`: anywhere will do.
#[derive(Debug, Clone, PartialEq)]
pub struct Goal {
    /// m.
    pub x: f64,
    /// m.
    pub y: f64,
    /// How far from there will do, m; [`END_POINT_TOLERANCE`] where that is more.
    pub within: f64,
    /// rad.
    pub yaw: Option<f64>,
    /// One per moving joint.
    pub joints: Vec<Option<f64>>,
}

impl Goal {
    /// How far from its point a motion may end, m.
    pub fn allowed(&self) -> f64 {
        self.within.max(END_POINT_TOLERANCE)
    }
}

/// A place on the way at which the robot must stand.
#[derive(Debug, Clone, PartialEq)]
pub struct Via {
    /// Where; within the goal's tolerances.
    pub place: Goal,
    /// For how long at least, s; 0: at one row, at rest.
    pub dwell: f64,
}

/// Where the frame of a link must be at the end.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkGoal {
    /// Index into [`RobotModel::links`].
    pub link: usize,
    /// Of the frame's origin, map frame, m; z over the ground that the base stands on.
    pub position: [f64; 3],
    /// How far from there will do, m.
    pub within: f64,
    /// Of the frame against the map's axes, to [`LINK_ANGLE_TOLERANCE`]; `None`: any.
    pub rotation: Option<UnitQuaternion<f64>>,
}

/// Where the link of a [`LinkGoal`] ends.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkEnd {
    /// URDF name.
    pub link: String,
    /// From its place, m.
    pub point_error: f64,
    /// What that may be, m.
    pub allowed: f64,
    /// rad; `None` where the goal leaves open how the link is turned.
    pub angle_error: Option<f64>,
}

/// What a mission asks of a motion besides its task.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Demands<'a> {
    /// Where the robot must stand, in this order.
    pub vias: &'a [Via],
    /// Where the base must be slow.
    pub zones: &'a [SpeedZone],
    /// Where a link must be at the end.
    pub link: Option<&'a LinkGoal>,
}

/// How fast the base is in a speed zone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ZoneSpeed {
    /// The zone's, m/s.
    pub limit: f64,
    /// Greatest speed of all rows that are not proven to keep out of it, m/s; `None`: all keep out.
    pub peak: Option<f64>,
}

/// How a via was reached.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reached {
    /// When the robot first stands there, s.
    pub time: f64,
    /// m.
    pub point_error: f64,
    /// rad; `None` where the via leaves the heading open.
    pub heading_error: Option<f64>,
}

/// The verdict, with the figures it rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct Certificate {
    /// Asked for, m; `None` without a map.
    pub clearance_required: Option<f64>,
    /// Proven lower bound over all instants, shapes and obstacles, m; `None` without a map. Never above the true distance;
    /// within 1 mm of it up to 1.6 m (beyond, 1.6 m or a little above the requirement is reported). Zero: nothing is proven.
    pub clearance_proven: Option<f64>,
    /// Where the least clearance was met.
    pub closest: Option<Closest>,
    /// What was proven of every robot within [`RobotModel::tolerance`]; `None`: the robot has none.
    pub tolerance: Option<InTube>,
    /// The robot's links against each other; `None` where none that are checked move against each other.
    pub own_links: Option<OwnLinks>,
    /// From the goal's point, m.
    pub end_point_error: f64,
    /// What that may be, m: [`END_POINT_TOLERANCE`], or the radius of the goal's region.
    pub end_point_allowed: f64,
    /// rad; `None` where the goal leaves the heading open.
    pub end_heading_error: Option<f64>,
    /// Where the link ends that the goal names; `None`: it names none.
    pub link_end: Option<LinkEnd>,
    /// Each via in order, as far as they were reached.
    pub vias: Vec<Reached>,
    /// Each speed zone of the mission, in its order.
    pub zones: Vec<ZoneSpeed>,
    /// Peaks of every actuator, as written.
    pub limits: Vec<LimitCheck>,
    /// Whether no limit (speed, acceleration, jerk, joint position) is exceeded.
    pub limits_hold: bool,
    /// Why it is refused: one sentence with numbers each. Empty: certified.
    pub refusals: Vec<Refusal>,
}

impl Certificate {
    /// Certified.
    pub fn holds(&self) -> bool {
        self.refusals.is_empty()
    }
}

/// What was proven of every robot within a tolerance.
#[derive(Debug, Clone, PartialEq)]
pub struct InTube {
    /// How far robots may be off.
    pub tolerance: Tolerance,
    /// How far they may be off at the end.
    pub end: Width,
    /// Proven lower bound of their distance from obstacles, m; `None` without a map. Zero: nothing is proven.
    pub clearance_proven: Option<f64>,
    /// Where it is least; `distance`: of the robot that comes nearest, by the bounds that the proof rests on.
    pub closest: Option<Closest>,
    /// How wide the tube is there, and how much nearer each tolerance may bring the robot.
    pub there: Option<(Width, Shares)>,
}

/// What was proven of the robot's links against each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OwnLinks {
    /// Pairs of links that were checked: those that move against each other, but for [`RobotModel::ignore_pairs`].
    pub pairs: usize,
    /// Whether none of them touch at any instant.
    pub apart: bool,
}

/// A reason to refuse.
#[derive(Debug, Clone, PartialEq)]
pub struct Refusal {
    /// What was violated.
    pub kind: RefusalKind,
    /// One sentence with the numbers, the time and the actuator or link.
    pub message: String,
    /// When, s.
    pub time: Option<f64>,
}

/// What was violated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RefusalKind {
    /// Clearance not proven.
    Clearance,
    /// Clearance not proven of every robot within the tolerance.
    Tolerance,
    /// The robot's links touch each other.
    OwnLinks,
    /// Speed, acceleration or jerk.
    Limit,
    /// Joint position.
    Position,
    /// Drives backwards where it may not.
    Reverse,
    /// Does not end at the goal, or not at rest.
    End,
    /// Does not stop at a via.
    Via,
    /// Too fast in a speed zone.
    Zone,
    /// The table contradicts itself or is not finite.
    Table,
}

/// The closest approach found.
#[derive(Debug, Clone, PartialEq)]
pub struct Closest {
    /// s.
    pub time: f64,
    /// URDF link.
    pub link: String,
    /// The obstacle's box; `None`: unseen space beyond the map.
    pub obstacle: Option<Aabb>,
    /// True distance at that instant (an upper bound of the least clearance), m; not positive: overlap.
    pub distance: f64,
}

/// One actuator's peak against its limit. Wheels in m/s at the rim.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitCheck {
    /// `wheel_left`, `wheel_right`, or the joint's name.
    pub actuator: String,
    /// `speed`, `acceleration` or `jerk`.
    pub quantity: &'static str,
    /// Largest magnitude.
    pub peak: f64,
    /// `None`: given nowhere, not checked.
    pub limit: Option<f64>,
}

/// Whether a figure is within its bound. Figures that are not numbers are not.
fn within(figure: f64, bound: f64) -> bool {
    figure <= bound
}

/// The clearance alone that [`certify`] proves, m; zero for a table that cannot be replayed.
pub fn clearance_proven(table: &CommandTable, robot: &RobotModel, map: &VoxelMap, task: &Task) -> f64 {
    if !table::unreadable(table, robot, task).is_empty() {
        return 0.0;
    }
    let rollout = Rollout::new(table, task.start, &task.start_joints);
    clearance::clearance(&rollout, robot, map, task.clearance, None).proven
}

/// Judges a command table: replays it from the task's start and checks table, limits, ends, the robot's
/// links against each other and, with a map, clearance.
///
/// A table that cannot be replayed (no rows, numbers that are not finite, joints that are not the robot's) is refused with
/// [`RefusalKind::Table`] and without figures: errors infinite, no peaks, clearance zero.
pub fn certify(table: &CommandTable, robot: &RobotModel, map: Option<&VoxelMap>, task: &Task) -> Certificate {
    certify_through(table, robot, map, task, Demands::default())
}

/// The same, and that the robot stands at each of the demanded places, in their order, and drives slowly wherever it is to.
pub fn certify_through(
    table: &CommandTable,
    robot: &RobotModel,
    map: Option<&VoxelMap>,
    task: &Task,
    demands: Demands<'_>,
) -> Certificate {
    let mut certificate = Certificate {
        clearance_required: map.map(|_| task.clearance),
        clearance_proven: map.map(|_| 0.0),
        closest: None,
        tolerance: None,
        own_links: None,
        end_point_error: f64::INFINITY,
        end_point_allowed: task.goal.allowed(),
        end_heading_error: task.goal.yaw.map(|_| f64::INFINITY),
        link_end: None,
        vias: Vec::new(),
        zones: Vec::new(),
        limits: Vec::new(),
        limits_hold: false,
        refusals: table::unreadable(table, robot, task),
    };
    if !certificate.refusals.is_empty() {
        return certificate;
    }
    let rollout = Rollout::new(table, task.start, &task.start_joints);
    certificate.refusals = table::contradictions(table, &rollout, robot, task);

    let (limits, over) = limits::limits(table, robot);
    let outside = limits::positions(&rollout, robot);
    certificate.limits = limits;
    certificate.limits_hold = over.is_empty() && outside.is_empty();
    certificate.refusals.extend(over.into_iter().chain(outside));

    if !task.reverse {
        certificate.refusals.extend(limits::backwards(table, &rollout));
    }

    let ends = ends::ends(&rollout, robot, &task.goal);
    certificate.end_point_error = ends.point;
    certificate.end_heading_error = ends.heading;
    certificate.refusals.extend(ends.refusals);
    if let Some(goal) = demands.link {
        let (end, refusals) = ends::link_end(&rollout, robot, goal);
        certificate.link_end = Some(end);
        certificate.refusals.extend(refusals);
    }
    let (reached, missed) = vias::vias(&rollout, &table::standing(table), robot, demands.vias);
    certificate.vias = reached;
    certificate.refusals.extend(missed);
    let (speeds, too_fast) = zones::zones(&rollout, demands.zones);
    certificate.zones = speeds;
    certificate.refusals.extend(too_fast);

    if let Some((links, refusal)) = own_links::own_links(&rollout, robot) {
        certificate.own_links = Some(links);
        certificate.refusals.extend(refusal);
    }

    if let Some(map) = map {
        let clearance = clearance::clearance(&rollout, robot, map, task.clearance, None);
        certificate.clearance_proven = Some(clearance.proven);
        certificate.closest = clearance.closest;
        certificate.refusals.extend(clearance.refusal);
    }
    if let Some(tolerance) = robot.tolerance {
        let tube = tube::Tube::new(&rollout, robot, tolerance);
        let nominal = certificate.refusals.iter().any(|refusal| refusal.kind == RefusalKind::Clearance);
        // What the model's own robot does not keep, no tube does.
        let inside = map.map(|map| {
            let required = if nominal { 0.0 } else { task.clearance };
            clearance::clearance(&rollout, robot, map, required, Some(&tube))
        });
        let end = tube.width(rollout.rows() - 1, 0.0);
        let mut proof = InTube { tolerance, end, clearance_proven: None, closest: None, there: None };
        if let Some(inside) = inside {
            proof.clearance_proven = Some(inside.proven);
            (proof.closest, proof.there) = (inside.closest, inside.there);
            certificate.refusals.extend(inside.refusal.filter(|_| !nominal));
        }
        certificate.tolerance = Some(proof);
    }
    certificate
}
