//! What the page's script draws: robot, obstacles, rows and places, as plain data.

use nalgebra::Isometry3;
use serde::Serialize;

use super::boxes::Boxes;
use super::places::{Gap, Place};
use super::solid::Solid;
use crate::certify::Instant;
use crate::command::CommandTable;
use crate::geom::Pose2;
use crate::map::VoxelMap;
use crate::mission::Unknown;
use crate::report::plot::motion;
use crate::report::schema::ClosestPart;
use crate::robot::RobotModel;

/// Boxes drawn of a map at most; of more, the map is drawn in larger cells.
pub(super) const MOST_BOXES: usize = 24_000;
/// Numbers of all rows given to the page at most; of more, every so many rows.
const MOST_NUMBERS: usize = 50_000;

/// Every how many rows one is given to the page.
pub(super) fn stride(table: &CommandTable) -> usize {
    (table.rows.len() * (5 + table.joints.len())).div_ceil(MOST_NUMBERS).max(1)
}

/// Everything that is drawn. Lengths in m, angles in rad, times in s, but where `scale` says otherwise.
#[derive(Debug, Serialize)]
pub(super) struct Scene {
    pub(super) robot: Option<Robot>,
    pub(super) map: Option<Map>,
    pub(super) rows: Option<Rows>,
    pub(super) clearance: Option<Clearance>,
    pub(super) closest: Option<ClosestPart>,
    pub(super) places: Vec<Place>,
    pub(super) gap: Option<Gap>,
    /// Where the base is to be slow.
    pub(super) zones: Vec<Zone>,
    /// The search's path, or the path given.
    pub(super) route: Vec<[f64; 2]>,
}

/// A speed zone.
#[derive(Debug, Serialize)]
pub(super) struct Zone {
    /// Its corners, m.
    pub(super) corners: Vec<[f64; 2]>,
    /// m/s.
    pub(super) speed: f64,
}

/// The robot: bodies in order, parents first, and shapes on them.
#[derive(Debug, Serialize)]
pub(super) struct Robot {
    bodies: Vec<Body>,
    shapes: Vec<Shape>,
    joints: Vec<Joint>,
}

#[derive(Debug, Serialize)]
struct Body {
    parent: usize,
    /// parent <- joint frame at value 0: translation, then quaternion x, y, z, w.
    origin: [f64; 7],
    motion: Option<Motion>,
}

#[derive(Debug, Serialize)]
struct Motion {
    joint: usize,
    multiplier: f64,
    offset: f64,
    axis: [f64; 3],
    prismatic: bool,
}

#[derive(Debug, Serialize)]
struct Shape {
    link: String,
    body: usize,
    pose: [f64; 7],
    solid: Solid,
}

#[derive(Debug, Serialize)]
struct Joint {
    name: String,
    prismatic: bool,
}

/// Obstacles.
#[derive(Debug, Serialize)]
pub(super) struct Map {
    pub(super) origin: [f64; 3],
    /// Size of a drawn cell.
    pub(super) cell: f64,
    /// Drawn cells along each axis.
    pub(super) dims: [usize; 3],
    /// The seen rectangle: upper corner.
    pub(super) end: [f64; 2],
    /// Whether unseen space counts as an obstacle.
    pub(super) walled: bool,
    /// Six 16-bit numbers a box (low corner, size, in drawn cells), low byte first, base 64.
    pub(super) boxes: String,
}

/// Rows: each list holds the first value and then the differences of neighbours, in units of 1/`scale`.
#[derive(Debug, Serialize)]
pub(super) struct Rows {
    /// Time from one to the next, s.
    pub(super) step: f64,
    /// Time of the last one, s.
    pub(super) end: f64,
    pub(super) scale: f64,
    pub(super) x: Vec<i64>,
    pub(super) y: Vec<i64>,
    pub(super) yaw: Vec<i64>,
    pub(super) left: Vec<i64>,
    pub(super) right: Vec<i64>,
    pub(super) joints: Vec<Vec<i64>>,
}

/// Distances at instants: as [`Rows`], in units of 0.1 mm; `null` before the first difference: farther than `reach`.
#[derive(Debug, Serialize)]
pub(super) struct Clearance {
    pub(super) step: f64,
    pub(super) reach: f64,
    /// 0.1 mm each, no differences; -1e9: farther than `reach`.
    pub(super) values: Vec<i64>,
}

impl Robot {
    pub(super) fn of(robot: &RobotModel) -> Self {
        let body = |b: &crate::robot::Body| Body {
            parent: b.parent,
            origin: pose(&b.origin),
            motion: b.motion.as_ref().map(|m| Motion {
                joint: m.joint,
                multiplier: m.multiplier,
                offset: m.offset,
                axis: [m.axis.x, m.axis.y, m.axis.z].map(rounded),
                prismatic: m.prismatic,
            }),
        };
        let shape = |s: &crate::robot::Shape| Shape {
            link: s.link.clone(),
            body: s.body,
            pose: pose(&s.pose),
            solid: Solid::of(&s.convex, robot.shapes.len()),
        };
        Self {
            bodies: robot.bodies.iter().map(body).collect(),
            shapes: robot.shapes.iter().map(shape).collect(),
            joints: robot.joints.iter().map(|j| Joint { name: j.name.clone(), prismatic: j.prismatic }).collect(),
        }
    }
}

impl Map {
    /// The map, and how many of its cells make the edge of a drawn one.
    pub(super) fn of(map: &VoxelMap) -> (Self, usize) {
        let Boxes { factor, boxes } = Boxes::of(map, MOST_BOXES);
        let bytes: Vec<u8> = boxes.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let [x, y, _] = map.bounds().max;
        let out = Self {
            origin: map.origin,
            cell: map.resolution * factor as f64,
            dims: map.dims.map(|n| n.div_ceil(factor)),
            end: [x, y],
            walled: map.outside == Unknown::Occupied,
            boxes: base64(&bytes),
        };
        (out, factor)
    }
}

impl Rows {
    /// Rows of a table: the replayed pose and the commanded joint values when it begins, and the rim speeds it holds.
    pub(super) fn of(table: &CommandTable) -> Self {
        let scale = 1e4;
        let states = motion::states(table);
        let every = stride(table);
        let list = |value: &dyn Fn(usize) -> f64| {
            let values = (0..states.len()).step_by(every).map(|k| (value(k) * scale).round() as i64);
            let mut before = 0;
            values.map(|v| v - std::mem::replace(&mut before, v)).collect()
        };
        let shown = states.len().saturating_sub(1) / every * every;
        Self {
            step: table.sampling_time * every as f64,
            end: table.time(shown),
            scale,
            x: list(&|k| states[k].0.x),
            y: list(&|k| states[k].0.y),
            yaw: list(&|k| states[k].0.yaw),
            left: list(&|k| table.rim_speeds(k).0),
            right: list(&|k| table.rim_speeds(k).1),
            joints: (0..table.joints.len()).map(|j| list(&|k| states[k].1[j])).collect(),
        }
    }
}

impl Clearance {
    /// Distances at even instants.
    pub(super) fn of(instants: &[Instant], step: f64, reach: f64) -> Self {
        let value =
            |i: &Instant| if i.distance.is_finite() { (i.distance * 1e4).floor() as i64 } else { -1_000_000_000 };
        Self { step, reach, values: instants.iter().map(value).collect() }
    }
}

/// A pose as seven numbers.
fn pose(pose: &Isometry3<f64>) -> [f64; 7] {
    let (t, q) = (pose.translation.vector, pose.rotation.coords);
    [t.x, t.y, t.z, q.x, q.y, q.z, q.w].map(rounded)
}

/// Seven digits after the point: below what is seen by orders.
fn rounded(value: f64) -> f64 {
    (value * 1e7).round() / 1e7 + 0.0
}

/// Pose of the base as three numbers.
pub(super) fn planar(pose: Pose2) -> [f64; 3] {
    [pose.x, pose.y, pose.yaw].map(rounded)
}

/// RFC 4648.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for three in bytes.chunks(3) {
        let word = (0..3).fold(0u32, |word, i| word << 8 | u32::from(three.get(i).copied().unwrap_or(0)));
        for i in 0..4 {
            let digit = DIGITS[(word >> (18 - 6 * i) & 63) as usize];
            out.push(if i <= three.len() { digit as char } else { '=' });
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_is_that_of_rfc_4648() {
        for (plain, coded) in [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foobar", "Zm9vYmFy")] {
            assert_eq!(base64(plain.as_bytes()), coded);
        }
    }
}
