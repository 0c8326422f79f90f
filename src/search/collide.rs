//! Which postures are free along a motion of the base: exact, from the occupied cells' cubes; the distance field only says
//! early that everything near is free, or that something is not.

mod contact;
mod still;

use std::cell::{Cell, OnceCell, RefCell};
use std::collections::BTreeMap;

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use super::bits::Bits;
use super::obstacles;
use super::placed::{Base, Placed, Posed};
use super::posture::{Neighbours, Postures};
use crate::esdf::Esdf;
use crate::geom::{Aabb, Pose2};
use crate::map::VoxelMap;
use crate::math::gjk;
use crate::math::real;
use crate::mission::Unknown;
use crate::robot::RobotModel;
pub use contact::Contact;

/// A motion of the base: a straight drive (equal headings) or a spin (equal positions) of at most a right angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BaseMotion {
    pub from: Pose2,
    pub to: Pose2,
}

impl BaseMotion {
    fn middle(&self) -> Pose2 {
        let mean = |a: f64, b: f64| 0.5 * (a + b);
        Pose2::new(mean(self.from.x, self.to.x), mean(self.from.y, self.to.y), mean(self.from.yaw, self.to.yaw))
    }

    /// The pose so far along.
    pub fn at(&self, share: f64) -> Pose2 {
        let mix = |a: f64, b: f64| a + share * (b - a);
        Pose2::new(mix(self.from.x, self.to.x), mix(self.from.y, self.to.y), mix(self.from.yaw, self.to.yaw))
    }

    /// The poses at the middles of equal parts.
    fn parts(&self) -> [Base; PARTS] {
        let middle: Base = self.middle().into();
        std::array::from_fn(|k| {
            let pose = self.at((k as f64 + 0.5) / PARTS as f64);
            if self.from.yaw == self.to.yaw { middle.moved_to(pose.x, pose.y) } else { pose.into() }
        })
    }
}

/// Parts of a motion that are looked at in the distance field, where one look at its middle says too little.
const PARTS: usize = 4;
/// Side of the tiles whose obstacles are collected once, m; longest half of a motion that they are enough for.
const TILE: f64 = 0.4;
const TILE_MARGIN: f64 = 0.13;

/// Interpolated distances are too high by at most this share of a cell (`MATH` section 4) ...
const TOO_HIGH: f64 = 0.26;
/// ... and too low by at most this.
pub(super) const TOO_LOW: f64 = 0.8661;
/// Distances are found to this, m.
const TOLERANCE: f64 = 2e-4;
/// ... but where the clearance is kept anyway, to this.
const LOOSE: f64 = 5e-3;

/// Two poses of a shape whose hull, grown by `bulge`, holds the shape at every instant between.
struct Sweep {
    ends: [Posed; 2],
    bulge: f64,
}

/// A motion with what is asked of it for every shape and posture.
struct Course {
    motion: BaseMotion,
    middle: Base,
    half_drive: f64,
    half_turn: f64,
    parts: OnceCell<[Base; PARTS]>,
    ends: OnceCell<[Base; 2]>,
    near: OnceCell<Near>,
}

impl Course {
    fn new(motion: &BaseMotion) -> Self {
        Self {
            motion: *motion,
            middle: motion.middle().into(),
            half_drive: 0.5 * motion.from.distance(motion.to),
            half_turn: 0.5 * (motion.to.yaw - motion.from.yaw).abs(),
            parts: OnceCell::new(),
            ends: OnceCell::new(),
            near: OnceCell::new(),
        }
    }
}

/// A ball in the robot that no joint moves.
#[derive(Debug, Clone, Copy)]
pub(super) struct Mast {
    /// Base frame, m.
    pub centre: Vector3<f64>,
    /// m.
    pub radius: f64,
}

/// Obstacles near a motion.
struct Near {
    boxes: Vec<Aabb>,
    /// Unit normal of the slab that separated the last pair of bodies that were looked at closely.
    hint: Cell<Vector3<f64>>,
}

/// Exact collision queries for one robot in one map.
pub(super) struct Collider<'a, const W: usize> {
    robot: &'a RobotModel,
    esdf: &'a Esdf,
    map: &'a VoxelMap,
    clearance: f64,
    pub postures: Postures,
    pub neighbours: Neighbours<W>,
    rigid: Vec<Placed>,
    moving: Vec<Placed>,
    /// Height of the centre, and radius, of a ball about the base's axis that holds the robot in every posture.
    ball: (f64, f64),
    /// Largest horizontal distance of any point of the robot from the base's axis, over all postures, m.
    pub reach: f64,
    /// z range of the robot over all postures.
    heights: [f64; 2],
    /// Order in which postures are looked at: coarse first.
    order: Vec<usize>,
    all: Bits<W>,
    /// A point (base frame) inside a rigid shape and how deep it lies there, m: the deepest known.
    deepest: Option<(Vector3<f64>, f64)>,
    /// Obstacles that a motion with its middle in a tile of the plane may come near, of the tiles that were asked for.
    tiles: RefCell<BTreeMap<[i32; 2], Vec<Aabb>>>,
}

impl<'a, const W: usize> Collider<'a, W> {
    pub fn new(robot: &'a RobotModel, esdf: &'a Esdf, map: &'a VoxelMap, clearance: f64, postures: Postures) -> Self {
        let mut rigid = Vec::new();
        let mut moving = Vec::new();
        let places: Vec<_> = (0..postures.count()).map(|p| robot.shape_poses(postures.joints(p))).collect();
        let neighbours = Neighbours::new(&postures);
        for (s, shape) in robot.shapes.iter().enumerate() {
            let place = |p: &Vec<Isometry3<f64>>| Posed::new(&p[s]);
            if robot.is_moved(shape.body) {
                let poses: Vec<Posed> = places.iter().map(place).collect();
                moving.push(Placed::new(s, &shape.convex, poses, &postures));
            } else {
                rigid.push(Placed::new(s, &shape.convex, vec![place(&places[0])], &postures));
            }
        }
        let mut heights = [f64::INFINITY, f64::NEG_INFINITY];
        for placed in rigid.iter().chain(&moving) {
            for pose in &placed.poses {
                let up = pose.support(&placed.convex, &Vector3::z()).z;
                let down = pose.support(&placed.convex, &-Vector3::z()).z;
                heights = [heights[0].min(down), heights[1].max(up)];
            }
        }
        if heights[0] > heights[1] {
            heights = [0.0, 0.0]; // a robot without shapes
        }
        let slack = moving.iter().flat_map(|m| &m.step_moves).fold(0.0f64, |a, b| a.max(*b)) / 2.0;
        heights = [heights[0] - slack, heights[1] + slack];
        let reach = rigid.iter().chain(&moving).map(|p| p.reach).fold(0.0, f64::max);
        let ball = (0.5 * (heights[0] + heights[1]), real::hypot(reach, 0.5 * (heights[1] - heights[0])));
        let mut order = Vec::with_capacity(postures.count());
        let mut seen = vec![false; postures.count()];
        for step in (0..=10).rev().map(|k| 1usize << k) {
            for p in (0..postures.count()).step_by(step) {
                if !std::mem::replace(&mut seen[p], true) {
                    order.push(p);
                }
            }
        }
        let all = Bits::all(postures.count());
        let balls = rigid.iter().flat_map(|placed| &placed.balls);
        let deepest = balls.filter_map(|ball| Some((ball.centres[0], ball.inner?))).max_by(|a, b| a.1.total_cmp(&b.1));
        let tiles = RefCell::default();
        Self {
            robot,
            esdf,
            map,
            clearance,
            postures,
            neighbours,
            rigid,
            moving,
            ball,
            reach,
            heights,
            order,
            all,
            deepest,
            tiles,
        }
    }

    /// All postures that are searched.
    pub fn all(&self) -> Bits<W> {
        self.all
    }

    /// Searches these postures only.
    pub fn only(&mut self, postures: Bits<W>) {
        self.all = postures;
    }

    /// Postures in which links of the robot touch each other.
    pub fn touching(&self) -> Bits<W> {
        let mut out = Bits::EMPTY;
        if !self.postures.is_exhaustive() {
            return out; // a roadmap holds none
        }
        let pairs = self.robot.self_pairs();
        let touch = |p: &usize| self.robot.touching(&pairs, self.postures.joints(*p)).is_some();
        (0..self.postures.count()).filter(|_| !pairs.is_empty()).filter(touch).for_each(|p| out.insert(p));
        out
    }

    pub fn robot(&self) -> &'a RobotModel {
        self.robot
    }

    /// Side of the map's cells, m.
    pub fn resolution(&self) -> f64 {
        self.map.resolution
    }

    /// The postures that keep the clearance all along a motion.
    pub fn free(&self, motion: &BaseMotion) -> Bits<W> {
        let middle = motion.middle();
        let around = self.esdf.distance([middle.x, middle.y, self.ball.0]) - TOO_HIGH * self.map.resolution;
        let course = Course::new(motion);
        if around >= self.ball.1 + course.half_drive + self.clearance {
            return self.all;
        }
        if self.rigid.iter().any(|placed| self.gap(placed, 0, &course, 0.0).lower < self.clearance) {
            return Bits::EMPTY;
        }
        let mut free = self.all;
        for placed in &self.moving {
            free = self.free_postures(placed, &course, free);
            if free.is_empty() {
                break;
            }
        }
        free
    }

    /// What moving shapes take up in every posture that is searched: balls in them that no joint moves.
    pub fn masts(&self) -> Vec<Mast> {
        let stays = |placed: &&Placed| {
            let first = placed.poses[0].centre;
            placed.poses.iter().all(|pose| (pose.centre - first).norm() < 1e-6)
        };
        let of = |placed: &Placed| {
            let ball = placed.balls.iter().find(|ball| (ball.centres[0] - placed.poses[0].centre).norm() < 1e-6);
            let radius = placed.half.iter().copied().fold(f64::INFINITY, f64::min);
            ball.and_then(|ball| ball.inner)
                .map(|inner| Mast { centre: placed.poses[0].centre, radius: inner.min(radius) })
        };
        self.moving.iter().filter(stays).filter_map(of).collect()
    }

    /// An upright cylinder about the base's axis that holds all moving shapes in a posture: radius and heights, m.
    pub fn column(&self, posture: usize) -> (f64, [f64; 2]) {
        let (mut radius, mut heights) = (0.0f64, [f64::INFINITY, f64::NEG_INFINITY]);
        for placed in &self.moving {
            let pose = &placed.poses[posture];
            let bounds = pose.bounds(&placed.convex);
            radius = radius.max(pose.farthest_from_axis(&placed.convex));
            heights = [heights[0].min(bounds.min[2]), heights[1].max(bounds.max[2])];
        }
        (radius, heights)
    }

    /// Where a straight drive is tightest for the deepest point of the rigid shapes, m of it; `None`: it does not get through.
    pub fn tightest(&self, from: Pose2, to: Pose2) -> Option<f64> {
        let length = from.distance(to);
        let Some((centre, inner)) = self.deepest else { return Some(0.0) };
        let base: Base = from.into();
        let (mut along, mut tightest) = (0.0, (f64::INFINITY, 0.0));
        while along <= length {
            let share = along / length.max(1e-9);
            let at = base.moved_to(from.x + share * (to.x - from.x), from.y + share * (to.y - from.y));
            let room = self.esdf.distance(at.map(&centre)) + TOO_LOW * self.map.resolution - inner - self.clearance;
            if room < 0.0 {
                return None;
            }
            if room < tightest.0 {
                tightest = (room, along);
            }
            // Room is not lost faster than it is driven through.
            along += room.max(self.map.resolution);
        }
        Some(tightest.1)
    }

    /// Those of `alive` in which one moving shape is clear.
    fn free_postures(&self, placed: &Placed, course: &Course, alive: Bits<W>) -> Bits<W> {
        let mut open = alive;
        let mut free = Bits::EMPTY;
        let useful = 6.0 * placed.step_moves.iter().fold(0.0f64, |a, b| a.max(*b));
        for &posture in &self.order {
            if !open.contains(posture) {
                continue;
            }
            let gap = self.gap(placed, posture, course, useful);
            let (is_free, margin) = if gap.lower >= self.clearance {
                (true, gap.lower - self.clearance)
            } else {
                (false, self.clearance - gap.upper)
            };
            // Whoever is within the margin shares the verdict: no point of the shape moves farther than the steps say.
            let mut mark = |p: usize| {
                open.remove(p);
                if is_free && alive.contains(p) {
                    free.insert(p);
                }
            };
            mark(posture);
            for (joint, &(count, stride)) in self.postures.axes().iter().enumerate() {
                let steps =
                    if placed.step_moves[joint] > 0.0 { (margin / placed.step_moves[joint]) as usize } else { count };
                let at = posture / stride % count;
                for k in 1..=steps.min(count) {
                    if k <= at {
                        mark(posture - k * stride);
                    }
                    if at + k < count {
                        mark(posture + k * stride);
                    }
                }
            }
        }
        free
    }

    /// Bounds on the clearance of one shape along a motion; not refined beyond `clearance + useful`.
    fn gap(&self, placed: &Placed, posture: usize, course: &Course, useful: f64) -> gjk::Gap {
        let moves = course.half_drive + placed.reach * course.half_turn;
        let slack = TOO_HIGH * self.map.resolution;
        let pose = &placed.poses[posture];
        let clear = |lower: f64| gjk::Gap { lower, upper: f64::INFINITY };
        let whole = |base: &Base| self.esdf.distance(base.map(&pose.centre)) - slack - placed.radius;
        let lower = whole(&course.middle) - moves;
        if lower >= self.clearance {
            return clear(lower);
        }
        let lower = match self.ball_gap(placed, posture, &course.middle) {
            Err(upper) => return gjk::Gap { lower: upper.min(0.0), upper },
            Ok(gap) => gap - slack - moves,
        };
        if lower >= self.clearance {
            return clear(lower);
        }
        // In parts the balls' bound gains what they move, at best.
        if lower + moves >= self.clearance {
            let own = moves / PARTS as f64;
            let mut least = f64::INFINITY;
            for base in course.parts.get_or_init(|| course.motion.parts()) {
                let lower = whole(base) - own;
                if lower >= self.clearance {
                    least = least.min(lower);
                    continue;
                }
                match self.ball_gap(placed, posture, base) {
                    Err(upper) => return gjk::Gap { lower: upper.min(0.0), upper },
                    Ok(gap) => least = least.min(gap - slack - own),
                }
                if least < self.clearance {
                    break;
                }
            }
            if least >= self.clearance {
                return clear(least);
            }
        }
        let ends = course.ends.get_or_init(|| [course.motion.from.into(), course.motion.to.into()]);
        let ends = [pose.under(&ends[0]), pose.under(&ends[1])];
        let sweep = Sweep { ends, bulge: placed.reach * (1.0 - real::cos(course.half_turn)) };
        let near = course.near.get_or_init(|| self.near(course));
        self.exact_gap(placed, &sweep, near, self.clearance + useful)
    }

    /// Distance of the balls that cover a shape, by the field.
    ///
    /// # Errors
    /// An upper bound of the shape's clearance where it is too low.
    fn ball_gap(&self, placed: &Placed, posture: usize, base: &Base) -> Result<f64, f64> {
        let mut least = f64::INFINITY;
        for ball in &placed.balls {
            let distance = self.esdf.distance(base.map(&ball.centres[posture]));
            if let Some(inner) = ball.inner {
                let upper = distance + TOO_LOW * self.map.resolution - inner;
                if upper < self.clearance {
                    return Err(upper);
                }
            }
            least = least.min(distance);
        }
        Ok(least - placed.ball_radius)
    }

    /// Obstacles that any part of the robot could come near.
    fn near(&self, course: &Course) -> Near {
        let BaseMotion { from: a, to: b } = course.motion;
        let reach = self.reach + self.clearance + 0.1;
        let region = self.region([a.x.min(b.x), a.y.min(b.y)], [a.x.max(b.x), a.y.max(b.y)], reach);
        let hint = Cell::new(Vector3::x());
        if course.half_drive > TILE_MARGIN {
            let mut boxes = Vec::new();
            obstacles::collect(self.map, &region, &mut boxes);
            return Near { boxes, hint };
        }
        let Pose2 { x, y, .. } = course.motion.middle();
        let tile = [x, y].map(|v| (v / TILE).floor() as i32);
        let mut tiles = self.tiles.borrow_mut();
        let around = tiles.entry(tile).or_insert_with(|| {
            let low = tile.map(|t| f64::from(t) * TILE);
            let mut boxes = Vec::new();
            let region = self.region(low, low.map(|v| v + TILE), reach + TILE_MARGIN);
            obstacles::collect(self.map, &region, &mut boxes);
            boxes
        });
        Near { boxes: around.iter().filter(|b| box_gap(b, &region) == 0.0).copied().collect(), hint }
    }

    /// A rectangle grown by a margin, over the robot's heights.
    fn region(&self, low: [f64; 2], high: [f64; 2], margin: f64) -> Aabb {
        let z = self.clearance + 0.1;
        Aabb {
            min: [low[0] - margin, low[1] - margin, self.heights[0] - z],
            max: [high[0] + margin, high[1] + margin, self.heights[1] + z],
        }
    }

    /// Bounds on the distance of a swept shape to the boxes and the map's edge, as far as `cap`.
    fn exact_gap(&self, placed: &Placed, sweep: &Sweep, near: &Near, cap: f64) -> gjk::Gap {
        let Near { boxes, hint } = near;
        let bounds = sweep_bounds(placed, sweep);
        let mut gap = gjk::Gap { lower: cap, upper: f64::INFINITY };
        if self.map.outside == Unknown::Occupied {
            let inside = edge_distance(&self.map.bounds(), &bounds) - sweep.bulge;
            gap = gjk::Gap { lower: gap.lower.min(inside), upper: inside };
        }
        let [a, b] = &sweep.ends;
        let drive = (a.rotation == b.rotation)
            .then(|| (a.rotation, 0.5 * (a.centre + b.centre), a.rotation.tr_mul(&(b.centre - a.centre))));
        for obstacle in boxes.iter() {
            let reached = gap.lower + sweep.bulge;
            if box_gap(&bounds, obstacle) >= reached {
                continue;
            }
            if let Some((rotation, centre, travel)) = &drive {
                let half: [f64; 3] = std::array::from_fn(|i| placed.half[i] + 0.5 * travel[i].abs());
                if gap_in_frame(rotation, centre, half, obstacle) >= reached {
                    continue;
                }
            }
            let support = |d: &Vector3<f64>| {
                let (p, q) = (a.support(&placed.convex, d), b.support(&placed.convex, d));
                let far = if p.dot(d) >= q.dot(d) { p } else { q };
                far - Vector3::from_fn(|i, _| if d[i] > 0.0 { obstacle.min[i] } else { obstacle.max[i] })
            };
            // What separated the last pair often separates this one.
            let normal = hint.get();
            if normal.dot(&support(&-normal)) >= reached {
                continue;
            }
            let middle = Vector3::from_fn(|i, _| 0.5 * (obstacle.min[i] + obstacle.max[i]));
            let least = self.clearance;
            let enough = |found: gjk::Gap| {
                found.lower >= reached
                    || found.upper < least
                    || found.upper - found.lower <= if found.lower - sweep.bulge >= least { LOOSE } else { TOLERANCE }
            };
            let (found, direction) = gjk::with_direction(support, a.centre - middle, enough);
            if found.upper > 0.0 {
                hint.set(direction / found.upper);
            }
            gap.lower = gap.lower.min(found.lower - sweep.bulge);
            gap.upper = gap.upper.min(found.upper);
            if gap.upper < self.clearance {
                break;
            }
        }
        gap
    }
}

fn sweep_bounds(placed: &Placed, sweep: &Sweep) -> Aabb {
    let [a, b] = [0, 1].map(|e| sweep.ends[e].bounds(&placed.convex));
    Aabb { min: std::array::from_fn(|i| a.min[i].min(b.min[i])), max: std::array::from_fn(|i| a.max[i].max(b.max[i])) }
}

/// How far a body's bounds stay inside the map's rectangle.
fn edge_distance(map: &Aabb, body: &Aabb) -> f64 {
    (0..2).map(|a| (body.min[a] - map.min[a]).min(map.max[a] - body.max[a])).fold(f64::INFINITY, f64::min)
}

fn box_gap(a: &Aabb, b: &Aabb) -> f64 {
    (0..3).map(|i| real::powi((a.min[i] - b.max[i]).max(b.min[i] - a.max[i]).max(0.0), 2)).sum::<f64>().sqrt()
}

/// Distance of an oriented box to the bounds, along its own axes, of an axis-aligned one: not above their distance.
fn gap_in_frame(rotation: &Matrix3<f64>, centre: &Vector3<f64>, half: [f64; 3], obstacle: &Aabb) -> f64 {
    let middle = Point3::from([0, 1, 2].map(|i| 0.5 * (obstacle.min[i] + obstacle.max[i])));
    let size = Vector3::from_fn(|i, _| 0.5 * (obstacle.max[i] - obstacle.min[i]));
    let offset = rotation.tr_mul(&(middle.coords - centre));
    (0..3)
        .map(|i| {
            let column = rotation.column(i);
            let extent = column[0].abs() * size[0] + column[1].abs() * size[1] + column[2].abs() * size[2];
            real::powi((offset[i].abs() - half[i] - extent).max(0.0), 2)
        })
        .sum::<f64>()
        .sqrt()
}
