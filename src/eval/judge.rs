//! One scene through the pipeline.

use std::time::Instant;

use super::bound::travel_time;
use super::excess::AlphaExcess;
use super::scenes::{Scene, SceneSet};
use super::turns::{Turns, least_radius};
use crate::command::CommandTable;
use crate::diag::Diagnostics;
use crate::geom::Pose2;
use crate::pipeline::{self, CompileOptions, Outcome, World};
use crate::report::metrics;
use crate::report::schema::{Failure, LimitPart};
use crate::report::{Metrics, Status};
use crate::robot::RobotModel;
use crate::trajectory::{Leg, Trajectory, steered_curve::SteeredCurve};

/// What became of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// The scene.
    pub id: String,
    /// What sort of room it is.
    pub kind: Option<String>,
    /// Its boxes.
    pub boxes: usize,
    /// Proven; else [`Judged::failure`] says why not.
    pub certified: bool,
    /// Why it failed.
    pub failure: Option<Failure>,
    /// What was certified, or tried last: `optimised`, or `search` where that failed.
    pub source: Option<String>,
    /// Drives and turns on the spot that it has.
    pub legs: Option<[usize; 2]>,
    /// States that the search took up.
    pub expanded: Option<usize>,
    /// Iterations of the optimiser's last try.
    pub iterations: Option<usize>,
    /// How that ended.
    pub ending: Option<String>,
    /// Of the search's path before anything smoothed it.
    pub initial: Option<Metrics>,
    /// Of the optimised trajectory in its own timing; of the driven path where the search's path was driven.
    pub planned: Option<Metrics>,
    /// Of the held commands.
    pub driven: Option<Metrics>,
    /// Angular acceleration of the optimised trajectory against its limit; `None` where the search's path was driven.
    pub alpha_planned: Option<AlphaExcess>,
    /// Of the held commands.
    pub alpha_driven: Option<AlphaExcess>,
    /// How tightly the held commands turn.
    pub turns: Option<Turns>,
    /// Least radius that the robot's limits allow a smooth curve, m.
    pub least_radius: f64,
    /// Moving joints, and their least and greatest position on the way.
    pub joint_ranges: Vec<(String, [f64; 2])>,
    /// Lowest point of the shapes that joints move, at any row, m: below 0 is below the floor, which no scene has as an obstacle.
    pub lowest: Option<f64>,
    /// Peaks of every actuator as commanded, against its limits; empty where nothing was judged.
    pub limits: Vec<LimitPart>,
    /// Proven, m.
    pub clearance_proven: Option<f64>,
    /// From start to goal as the crow flies, m, and a time that no plan can beat on it, s.
    pub bound: (f64, f64),
    /// Stage and milliseconds.
    pub timings: Vec<(&'static str, f64)>,
}

impl Judged {
    /// Milliseconds of a stage; `None` where it did not run.
    pub fn ms(&self, stage: &str) -> Option<f64> {
        self.timings.iter().find(|(name, _)| *name == stage).map(|(_, ms)| *ms)
    }

    /// Search and optimisation together, ms: the papers' CT.
    pub fn computation_ms(&self) -> Option<f64> {
        self.ms("search").map(|ms| ms + self.ms("optimize").unwrap_or(0.0))
    }

    /// Whether the optimiser's trajectories were refused and the search's own path is driven.
    pub fn fell_back(&self) -> bool {
        self.source.as_deref() == Some("search") && self.initial.is_some_and(|m| m.length_m > 0.0)
    }
}

/// Compiles a scene of a set for a robot that has the set's limits already. Returns what became of it, and the outcome with
/// report and commands.
///
/// # Errors
/// A grid too large; sets that were read have none.
pub fn judge(
    set: &SceneSet,
    scene: &Scene,
    robot: &RobotModel,
    options: &CompileOptions,
) -> Result<(Judged, Outcome), Diagnostics> {
    let started = Instant::now();
    let map = set.voxels(scene)?;
    let voxelised = started.elapsed().as_secs_f64() * 1e3;
    let world = World { robot: robot.clone(), map: Some(map.into()) };
    // Nobody reads it here.
    let options = CompileOptions { trust: false, ..*options };
    let outcome = pipeline::compile_in(&set.mission(scene), &world, &options);
    let report = &outcome.report;
    let trajectory = report.trajectory.as_ref();
    let planned = trajectory.and_then(|t| t.metrics);
    let source = trajectory.map(|t| t.source.clone());
    let limit = robot.base.angular_acceleration;
    let compiled = outcome.compiled.as_ref();
    let alpha_planned = compiled
        .zip(planned)
        .filter(|_| source.as_deref() == Some("optimised"))
        .map(|(c, m)| AlphaExcess::of_trajectory(&c.trajectory, limit, m.time_s));
    let mut timings = vec![("voxels", voxelised)];
    timings.extend(&outcome.timings);
    let judged = Judged {
        id: scene.id.clone(),
        kind: scene.kind.clone(),
        boxes: scene.boxes.len(),
        certified: report.status == Status::Certified,
        failure: report.failure.clone(),
        source,
        legs: compiled.map(|c| legs(&c.trajectory)),
        expanded: report.search.as_ref().map(|s| s.expanded),
        iterations: trajectory.and_then(|t| t.iterations),
        ending: trajectory.and_then(|t| t.ending.clone()),
        initial: report.initial.as_ref().map(|i| i.metrics),
        planned,
        driven: compiled.map(|c| metrics::of_commands(&c.commands)),
        alpha_planned,
        alpha_driven: compiled.map(|c| AlphaExcess::of_commands(&c.commands, limit)),
        turns: compiled.map(|c| Turns::of(&c.commands)),
        least_radius: least_radius(&robot.base, robot.track_width),
        joint_ranges: compiled.map(|c| joint_ranges(&c.commands)).unwrap_or_default(),
        lowest: compiled.and_then(|c| lowest(robot, &c.commands)),
        limits: report.limits.clone(),
        clearance_proven: report.certificate.as_ref().and_then(|c| c.clearance_proven_m),
        bound: bound(set, scene, robot),
        timings,
    };
    Ok((judged, outcome))
}

/// Least and greatest position of each joint.
fn joint_ranges(table: &CommandTable) -> Vec<(String, [f64; 2])> {
    let range = |(j, (name, _)): (usize, &(String, bool))| {
        let positions = table.rows.iter().map(|row| row.joint_positions[j]);
        let wider = |[low, high]: [f64; 2], q: f64| [low.min(q), high.max(q)];
        (name.clone(), positions.fold([f64::INFINITY, f64::NEG_INFINITY], wider))
    };
    table.joints.iter().enumerate().map(range).collect()
}

/// Lowest point of the shapes that joints move, m; `None` where there is none.
fn lowest(robot: &RobotModel, table: &CommandTable) -> Option<f64> {
    let mut arm = robot.clone();
    arm.shapes.retain(|shape| shape.body != 0);
    if arm.shapes.is_empty() {
        return None;
    }
    table.rows.iter().map(|row| arm.extents(&row.joint_positions).min[2]).reduce(f64::min)
}

/// Drives and turns on the spot. A leg of heading and arc length counts as one drive, whatever turns on the spot are in it.
fn legs(trajectory: &Trajectory) -> [usize; 2] {
    let drives = |leg: &&Leg| match leg {
        Leg::Drive(_) => true,
        Leg::Steer(steer) => SteeredCurve::new(steer).is_ok_and(|curve| curve.length() > 0.0),
        Leg::Still(_) => false,
    };
    let drives = trajectory.legs.iter().filter(drives).count();
    [drives, trajectory.legs.len() - drives]
}

fn bound(set: &SceneSet, scene: &Scene, robot: &RobotModel) -> (f64, f64) {
    let [start, goal] = [&scene.start, &scene.goal].map(|p| {
        let part = |value: Option<f64>| value.unwrap_or(0.0);
        Pose2::new(part(p.x), part(p.y), part(p.yaw))
    });
    (start.distance(goal), travel_time(start, goal, &robot.base, set.reverse))
}
