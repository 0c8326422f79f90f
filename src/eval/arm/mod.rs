//! The suite `arm`: random rooms for a robot with an arm, like those of TopAY's benchmark (arXiv 2507.02761), as `trajc.scenes/1`.
//!
//! What that states: 20 x 20 m, 80 walls and 80 floating boxes, or 40 tables and 80 walls; start and goal 3 to 8 m apart with random
//! postures of the arm; a robot of 1.0 m/s, 0.8 m/s^2, 1.25 rad/s, 1.0 rad/s^2; tables of 0.75 to 1.25 by 0.75 to 1.5 m, 0.75 to 1.5 m
//! high, one to four together, legs and top 5 cm thick. What is chosen here: the sizes of walls and floating boxes, faces on the voxel
//! grid and along x and y, poses and postures that are free, and a way for the base alone.

mod body;
mod obstacles;
mod plan;

use serde_json::{Map, Value, json};

use super::Suite;
use super::generate::{CELL, CellBox, metres, written};
use super::rng::Rng;
use crate::geom::{Aabb, Pose2};
use crate::robot::RobotModel;
use body::Body;
use plan::Plan;

/// Side of the room, cells.
const SIDE: i32 = 400;
/// Height of the room, cells.
const HEIGHT: i32 = 32;
/// What is certified, m.
const CLEARANCE: f64 = 0.02;
/// What the base's way has to spare on each side beyond that, m: half a cell's diagonal. So wide a way holds positions of any lattice of
/// such cells; a narrower one is a matter of how the lattice lies.
const TO_SPARE: f64 = 0.5 * std::f64::consts::SQRT_2 * CELL;
/// What start and goal keep clear of obstacles, m: more than is certified, so that no pair is lost to rounding.
const FREE: f64 = 0.03;
/// Start and goal are this far apart, m.
const DISTANCE: [f64; 2] = [3.0, 8.0];
/// Tries for a pair of poses, and for a posture at each, before the room is drawn anew.
const POSE_TRIES: usize = 200;
const POSTURE_TRIES: usize = 30;
/// Rooms that may be drawn anew for one scene.
const ROOMS: usize = 200;

/// The kinds of rooms.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// 80 walls and 80 floating boxes.
    Cuboids,
    /// 40 tables and 80 walls.
    Tables,
}

impl Kind {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Cuboids, Self::Tables];

    /// As `kind` of a scene.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cuboids => "cuboids",
            Self::Tables => "tables",
        }
    }
}

/// `count` scenes of each kind for a robot, as a `trajc.scenes/1` document; every moving joint has a value at start and goal. Scene k of
/// a kind depends on the robot, the seed and k alone.
///
/// The base alone gets from start to goal: a disc as wide as the robot's rigid shapes and the clearance, under whatever begins above
/// them. Whether the arm can be kept out of the way is not looked at, so a pair may still have no solution. The floor is no obstacle of
/// the scene (the base would be near one everywhere), but moving links are above it at start and goal.
///
/// # Errors
/// The kind of room that left no room for the robot.
pub fn document(robot: &RobotModel, count: usize, seed: u64) -> Result<String, Kind> {
    let body = Body::new(robot);
    let mut lines = Vec::new();
    for kind in Kind::ALL {
        for k in 0..count {
            let id = format!("arm-{}-{seed}-{k:03}", kind.name());
            let mut rng = Rng::new(&[seed, Suite::Arm as u64, kind as u64, k as u64]);
            let scene = (0..ROOMS).find_map(|_| scene(&mut rng, kind, &body, &id)).ok_or(kind)?;
            lines.push(scene.to_string());
        }
    }
    Ok(written(&head(robot, seed), &lines))
}

/// Everything but the scenes. Rims get what the base's limits ask of them at most.
fn head(robot: &RobotModel, seed: u64) -> Value {
    let (speed, acceleration, turn, turn_acceleration) = (1.0, 0.8, 1.25, 1.0);
    let rim = |base: f64, turn: f64| ((base + 0.5 * robot.track_width * turn) * 1e6).round() / 1e6;
    let side = metres(SIDE);
    json!({
        "schema": super::scenes::SCHEMA, "name": Suite::Arm.name(), "seed": seed,
        "bounds": [[0.0, 0.0, 0.0], [side, side, metres(HEIGHT)]], "resolution": CELL, "clearance_m": CLEARANCE,
        "limits": {
            "wheel": {
                "speed_mps": rim(speed, turn), "acceleration_mps2": rim(acceleration, turn_acceleration), "jerk_mps3": 4.0,
            },
            "base": {
                "speed_mps": speed, "acceleration_mps2": acceleration, "angular_speed_radps": turn,
                "angular_acceleration_radps2": turn_acceleration, "eta": 1.0,
            },
        },
    })
}

/// A room with start and goal; `None`: another must be drawn.
fn scene(rng: &mut Rng, kind: Kind, body: &Body<'_>, id: &str) -> Option<Value> {
    let placed = obstacles::draw(rng, kind)?;
    let corners = |b: &CellBox| Aabb { min: b.min.map(metres), max: b.max.map(metres) };
    let boxes: Vec<Aabb> = placed.iter().map(corners).collect();
    let [start, goal] = poses(rng, body, &placed, &boxes)?;
    let boxes: Vec<Value> = boxes.iter().map(|b| json!({"min": b.min, "max": b.max})).collect();
    let pose = |(at, q): (Pose2, Vec<f64>)| {
        let joints: Map<String, Value> = body.joints().map(str::to_owned).zip(q.into_iter().map(Value::from)).collect();
        json!({"x": at.x, "y": at.y, "yaw": at.yaw, "joints": joints})
    };
    Some(json!({"id": id, "kind": kind.name(), "boxes": boxes, "start": pose(start), "goal": pose(goal)}))
}

/// Start and goal: far enough apart and not too far, joined by a way for the base, and each free with a random posture.
fn poses(rng: &mut Rng, body: &Body<'_>, placed: &[CellBox], boxes: &[Aabb]) -> Option<[(Pose2, Vec<f64>); 2]> {
    let plan = Plan::new(placed, body.top() + CLEARANCE, body.radius() + CLEARANCE + TO_SPARE);
    (0..POSE_TRIES).find_map(|_| {
        let mut pose = || {
            let [x, y] = [0, 1].map(|_| rounded(rng.uniform(0.0, metres(SIDE))));
            Pose2::new(x, y, rounded(rng.uniform(-std::f64::consts::PI, std::f64::consts::PI)))
        };
        let ends = [pose(), pose()];
        let far = (DISTANCE[0]..=DISTANCE[1]).contains(&ends[0].distance(ends[1]));
        if !far || !plan.connected(ends.map(|p| [p.x, p.y])) {
            return None;
        }
        let mut posture = |at: Pose2| {
            let mut draws = (0..POSTURE_TRIES).map(|_| body.posture(rng).into_iter().map(rounded).collect::<Vec<_>>());
            draws.find(|q| body.free(at, q, boxes, metres(SIDE), FREE)).map(|q| (at, q))
        };
        Some([posture(ends[0])?, posture(ends[1])?])
    })
}

/// To a tenth of a millimetre, or of a milliradian.
fn rounded(value: f64) -> f64 {
    (value * 1e4).round() / 1e4
}

#[cfg(test)]
mod tests;
