//! Which postures are free along a motion of the base: exact, from the occupied cells' cubes; the distance field only says
//! early that everything near is free, or that something is not.

use nalgebra::{Matrix3, Point3, Vector3};

use super::obstacles;
use super::posture::{Bits, Neighbours, PostureGrid};
use crate::esdf::Esdf;
use crate::geom::{Aabb, Pose2};
use crate::map::VoxelMap;
use crate::math::gjk;
use crate::mission::Unknown;
use crate::robot::{Convex, RobotModel};

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

    fn turn(&self) -> f64 {
        (self.to.yaw - self.from.yaw).abs()
    }
}

/// Interpolated distances are too high by at most this share of a cell (`MATH` section 4) ...
const TOO_HIGH: f64 = 0.26;
/// ... and too low by at most this.
const TOO_LOW: f64 = 0.8661;
/// Distances are found to this, m.
const TOLERANCE: f64 = 2e-4;
/// ... but where the clearance is kept anyway, to this.
const LOOSE: f64 = 5e-3;

/// A shape with its place, and balls that cover it.
struct Placed {
    convex: Convex,
    /// Largest ball about the centre inside the shape, m.
    inner: f64,
    /// Half extents of the shape's own bounding box, m.
    half: [f64; 3],
    /// Radius of the ball about the centre that holds the shape, m.
    radius: f64,
    /// Centres (shape frame) and one radius of balls that cover the shape.
    balls: Vec<Vector3<f64>>,
    ball_radius: f64,
    /// base <- shape; one for a rigid shape, else one a posture.
    poses: Vec<Posed>,
    /// No point of the shape is farther from the base's vertical axis, m.
    reach: f64,
    /// Per joint: no point moves farther when the joint moves by one step, m.
    step_moves: Vec<f64>,
}

#[derive(Debug, Clone, Copy)]
struct Posed {
    rotation: Matrix3<f64>,
    centre: Vector3<f64>,
}

impl Posed {
    fn under(&self, base: Pose2) -> Self {
        let (sin, cos) = base.yaw.sin_cos();
        let turn = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        Self { rotation: turn * self.rotation, centre: turn * self.centre + Vector3::new(base.x, base.y, 0.0) }
    }

    fn support(&self, convex: &Convex, direction: &Vector3<f64>) -> Vector3<f64> {
        self.centre + self.rotation * convex.support(&self.rotation.tr_mul(direction))
    }
}

/// Two poses of a shape whose hull, grown by `bulge`, holds the shape at every instant between.
struct Sweep {
    ends: [Posed; 2],
    bulge: f64,
}

/// Obstacles near a motion.
struct Near {
    boxes: Vec<Aabb>,
    /// Unit normal of the slab that separated the last pair of bodies that were looked at closely.
    hint: Vector3<f64>,
}

/// The nearest obstacle of a pose, for people.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// URDF link.
    pub link: String,
    /// The obstacle; `None`: unseen space beyond the map.
    pub obstacle: Option<Aabb>,
    /// Clearance, m; negative: least overlap found over many directions.
    pub clearance: f64,
}

/// Exact collision queries for one robot in one map.
pub(super) struct Collider<'a, const W: usize> {
    robot: &'a RobotModel,
    esdf: &'a Esdf,
    map: &'a VoxelMap,
    clearance: f64,
    pub grid: PostureGrid,
    pub neighbours: Neighbours<W>,
    rigid: Vec<Placed>,
    moving: Vec<Placed>,
    /// Height of the centre, and radius, of a ball about the base's axis that holds the robot in every posture.
    ball: (f64, f64),
    /// z range of the robot over all postures.
    heights: [f64; 2],
    /// Order in which postures are looked at: coarse first.
    order: Vec<usize>,
}

impl<'a, const W: usize> Collider<'a, W> {
    pub fn new(robot: &'a RobotModel, esdf: &'a Esdf, map: &'a VoxelMap, clearance: f64, grid: PostureGrid) -> Self {
        let mut rigid = Vec::new();
        let mut moving = Vec::new();
        let postures: Vec<_> = (0..grid.count()).map(|p| robot.shape_poses(&grid.joints(p))).collect();
        let neighbours = Neighbours::new(&grid);
        for (s, shape) in robot.shapes.iter().enumerate() {
            let place = |p: &Vec<nalgebra::Isometry3<f64>>| Posed {
                rotation: p[s].rotation.to_rotation_matrix().into_inner(),
                centre: p[s].translation.vector,
            };
            if is_moved(robot, shape.body) {
                let poses: Vec<Posed> = postures.iter().map(place).collect();
                moving.push(Placed::new(&shape.convex, poses, &grid));
            } else {
                rigid.push(Placed::new(&shape.convex, vec![place(&postures[0])], &grid));
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
        let ball = (0.5 * (heights[0] + heights[1]), reach.hypot(0.5 * (heights[1] - heights[0])));
        let mut order = Vec::with_capacity(grid.count());
        let mut seen = vec![false; grid.count()];
        for step in (0..=10).rev().map(|k| 1usize << k) {
            for p in (0..grid.count()).step_by(step) {
                if !std::mem::replace(&mut seen[p], true) {
                    order.push(p);
                }
            }
        }
        Self { robot, esdf, map, clearance, grid, neighbours, rigid, moving, ball, heights, order }
    }

    /// All postures.
    pub fn all(&self) -> Bits<W> {
        Bits::all(self.grid.count())
    }

    /// Side of the map's cells, m.
    pub fn resolution(&self) -> f64 {
        self.map.resolution
    }

    /// Largest horizontal distance of any point of the robot from the base's axis, over all postures, m.
    pub fn reach(&self) -> f64 {
        self.rigid.iter().chain(&self.moving).map(|p| p.reach).fold(0.0, f64::max)
    }

    /// The postures that keep the clearance all along a motion.
    pub fn free(&self, motion: &BaseMotion) -> Bits<W> {
        let middle = motion.middle();
        let half_drive = 0.5 * motion.from.distance(motion.to);
        let far = self.clearance + TOO_HIGH * self.map.resolution;
        if self.esdf.distance([middle.x, middle.y, self.ball.0]) >= self.ball.1 + half_drive + far {
            return self.all();
        }
        let mut near = None;
        for placed in &self.rigid {
            if self.gap(placed, 0, motion, 0.0, &mut near).lower < self.clearance {
                return Bits::EMPTY;
            }
        }
        let mut free = self.all();
        for placed in &self.moving {
            free = self.free_postures(placed, motion, free, &mut near);
            if free.is_empty() {
                break;
            }
        }
        free
    }

    /// Those of `alive` in which one moving shape is clear.
    fn free_postures(&self, placed: &Placed, motion: &BaseMotion, alive: Bits<W>, near: &mut Option<Near>) -> Bits<W> {
        let mut open = alive;
        let mut free = Bits::EMPTY;
        let useful = 6.0 * placed.step_moves.iter().fold(0.0f64, |a, b| a.max(*b));
        for &posture in &self.order {
            if !open.contains(posture) {
                continue;
            }
            let gap = self.gap(placed, posture, motion, useful, near);
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
            for (joint, (count, stride)) in self.grid.axes().enumerate() {
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
    fn gap(
        &self,
        placed: &Placed,
        posture: usize,
        motion: &BaseMotion,
        useful: f64,
        near: &mut Option<Near>,
    ) -> gjk::Gap {
        let pose = &placed.poses[posture];
        let half_turn = 0.5 * motion.turn();
        let moves = 0.5 * motion.from.distance(motion.to) + placed.reach * half_turn;
        let middle = pose.under(motion.middle());
        let c = middle.centre;
        let slack = TOO_HIGH * self.map.resolution + moves;
        let whole = self.esdf.distance([c.x, c.y, c.z]) - slack - placed.radius;
        if whole >= self.clearance {
            return gjk::Gap { lower: whole, upper: f64::INFINITY };
        }
        let mut lower = f64::INFINITY;
        for ball in &placed.balls {
            let c = middle.centre + middle.rotation * ball;
            let distance = self.esdf.distance([c.x, c.y, c.z]);
            let upper =
                distance + TOO_LOW * self.map.resolution - if placed.balls.len() == 1 { placed.inner } else { 0.0 };
            if upper < self.clearance {
                return gjk::Gap { lower: upper.min(0.0), upper };
            }
            lower = lower.min(distance - slack - placed.ball_radius);
        }
        if lower >= self.clearance {
            return gjk::Gap { lower, upper: f64::INFINITY };
        }
        let ends = [pose.under(motion.from), pose.under(motion.to)];
        let sweep = Sweep { ends, bulge: placed.reach * (1.0 - half_turn.cos()) };
        let near = near.get_or_insert_with(|| self.near(motion));
        self.exact_gap(placed, &sweep, near, self.clearance + useful)
    }

    /// Obstacles that any part of the robot could come near.
    fn near(&self, motion: &BaseMotion) -> Near {
        let reach = self.reach() + self.clearance + 0.1;
        let (a, b) = (motion.from, motion.to);
        let region = Aabb {
            min: [a.x.min(b.x) - reach, a.y.min(b.y) - reach, self.heights[0] - self.clearance - 0.1],
            max: [a.x.max(b.x) + reach, a.y.max(b.y) + reach, self.heights[1] + self.clearance + 0.1],
        };
        let mut boxes = Vec::new();
        obstacles::collect(self.map, &region, &mut boxes);
        Near { boxes, hint: Vector3::x() }
    }

    /// Bounds on the distance of a swept shape to the boxes and the map's edge, as far as `cap`.
    fn exact_gap(&self, placed: &Placed, sweep: &Sweep, near: &mut Near, cap: f64) -> gjk::Gap {
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
            if hint.dot(&support(&-*hint)) >= reached {
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
                *hint = direction / found.upper;
            }
            gap.lower = gap.lower.min(found.lower - sweep.bulge);
            gap.upper = gap.upper.min(found.upper);
            if gap.upper < self.clearance {
                break;
            }
        }
        gap
    }

    /// The nearest obstacle of a pose in one posture, exactly.
    pub fn contact(&self, pose: Pose2, joints: &[f64]) -> Contact {
        let reach = self.reach() + 1.0;
        let region = Aabb {
            min: [pose.x - reach, pose.y - reach, self.heights[0] - 1.0],
            max: [pose.x + reach, pose.y + reach, self.heights[1] + 1.0],
        };
        let mut boxes = Vec::new();
        obstacles::collect(self.map, &region, &mut boxes);
        let mut best = Contact { link: self.robot.name.clone(), obstacle: None, clearance: f64::INFINITY };
        for (shape, place) in self.robot.shapes.iter().zip(self.robot.shape_poses(joints)) {
            let posed =
                Posed { rotation: place.rotation.to_rotation_matrix().into_inner(), centre: place.translation.vector };
            let posed = posed.under(pose);
            let mut take = |clearance: f64, obstacle: Option<Aabb>| {
                if clearance < best.clearance {
                    best = Contact { link: shape.link.clone(), obstacle, clearance };
                }
            };
            if self.map.outside == Unknown::Occupied {
                take(edge_distance(&self.map.bounds(), &posed_bounds(&shape.convex, &posed)), None);
            }
            for obstacle in &boxes {
                let apart = |d: &Vector3<f64>| {
                    posed.support(&shape.convex, d)
                        - Vector3::from_fn(|i, _| if d[i] > 0.0 { obstacle.min[i] } else { obstacle.max[i] })
                };
                let middle = Vector3::from_fn(|i, _| 0.5 * (obstacle.min[i] + obstacle.max[i]));
                let precise = |gap: gjk::Gap| gap.upper - gap.lower <= 1e-6;
                let gap = gjk::distance_from_origin(apart, posed.centre - middle, precise);
                let clearance = if gap.upper > 0.0 { gap.upper } else { -overlap(apart, &posed.rotation) };
                take(clearance, Some(*obstacle));
            }
        }
        best
    }
}

/// Least overlap of two bodies over many directions: how far one must move to leave the other (an upper bound), m.
fn overlap(apart: impl Fn(&Vector3<f64>) -> Vector3<f64>, rotation: &Matrix3<f64>) -> f64 {
    let spread = (0..200).map(|k| {
        // Fibonacci's spiral spreads directions evenly over the sphere.
        let z = 1.0 - (2.0 * f64::from(k) + 1.0) / 200.0;
        let angle = f64::from(k) * std::f64::consts::PI * (1.0 + 5f64.sqrt());
        let flat = (1.0 - z * z).sqrt();
        Vector3::new(flat * angle.cos(), flat * angle.sin(), z)
    });
    let axes = (0..3).flat_map(|i| {
        let own: Vector3<f64> = rotation.column(i).into();
        let world = Vector3::ith(i, 1.0);
        [own, -own, world, -world]
    });
    spread.chain(axes).map(|d| apart(&d).dot(&d)).fold(f64::INFINITY, f64::min)
}

/// Whether any joint moves a body.
fn is_moved(robot: &RobotModel, mut body: usize) -> bool {
    loop {
        if robot.bodies[body].motion.is_some() {
            return true;
        }
        if body == 0 {
            return false;
        }
        body = robot.bodies[body].parent;
    }
}

impl Placed {
    fn new(convex: &Convex, poses: Vec<Posed>, grid: &PostureGrid) -> Self {
        let half = convex.half_extents();
        let inner = match convex {
            Convex::Hull { .. } => 0.0,
            _ => half.iter().copied().fold(f64::INFINITY, f64::min),
        };
        let (balls, ball_radius) = cover(half, convex.bounding_radius());
        let radius = convex.bounding_radius();
        let step_moves = grid
            .axes()
            .map(|(count, stride)| {
                let pairs = (0..poses.len()).filter(|p| poses.len() > 1 && p / stride % count + 1 < count);
                let between = |p: usize| {
                    let (a, b) = (&poses[p], &poses[p + stride]);
                    (a.centre - b.centre).norm() + (a.rotation - b.rotation).norm() * radius
                };
                pairs.map(between).fold(0.0, f64::max)
            })
            .collect::<Vec<f64>>();
        // Farthest from the axis over all directions; between sampled postures half a step may be added.
        let mut reach = 0.0f64;
        for pose in &poses {
            for k in 0..64 {
                let angle = std::f64::consts::TAU * f64::from(k) / 64.0;
                let d = Vector3::new(angle.cos(), angle.sin(), 0.0);
                reach = reach.max(pose.support(convex, &d).dot(&d));
            }
        }
        // A point at distance R shows at least R cos(pi/64) in one of 64 directions.
        reach = reach / (std::f64::consts::PI / 64.0).cos() + step_moves.iter().sum::<f64>() / 2.0;
        Self { convex: convex.clone(), inner, half, radius, balls, ball_radius, poses, reach, step_moves }
    }
}

/// Balls that cover a box: as many along each axis as make them about as wide as the box's least side.
fn cover(half: [f64; 3], bounding: f64) -> (Vec<Vector3<f64>>, f64) {
    let least = half.iter().copied().fold(f64::INFINITY, f64::min).max(0.03);
    let counts = half.map(|h| ((h / least / 1.5).ceil() as usize).clamp(1, 6));
    let part: [f64; 3] = std::array::from_fn(|a| half[a] / counts[a] as f64);
    let radius = part.iter().map(|h| h * h).sum::<f64>().sqrt();
    if counts == [1; 3] {
        return (vec![Vector3::zeros()], bounding.min(radius));
    }
    let centre = |a: usize, k: usize| -half[a] + part[a] * (2 * k + 1) as f64;
    let mut balls = Vec::new();
    for i in 0..counts[0] {
        for j in 0..counts[1] {
            balls.extend((0..counts[2]).map(|k| Vector3::new(centre(0, i), centre(1, j), centre(2, k))));
        }
    }
    (balls, radius)
}

fn posed_bounds(convex: &Convex, posed: &Posed) -> Aabb {
    let end = |a: usize, sign: f64| posed.support(convex, &Vector3::ith(a, sign))[a];
    Aabb { min: std::array::from_fn(|a| end(a, -1.0)), max: std::array::from_fn(|a| end(a, 1.0)) }
}

fn sweep_bounds(placed: &Placed, sweep: &Sweep) -> Aabb {
    let [a, b] = [0, 1].map(|e| posed_bounds(&placed.convex, &sweep.ends[e]));
    Aabb { min: std::array::from_fn(|i| a.min[i].min(b.min[i])), max: std::array::from_fn(|i| a.max[i].max(b.max[i])) }
}

/// How far a body's bounds stay inside the map's rectangle.
fn edge_distance(map: &Aabb, body: &Aabb) -> f64 {
    (0..2).map(|a| (body.min[a] - map.min[a]).min(map.max[a] - body.max[a])).fold(f64::INFINITY, f64::min)
}

fn box_gap(a: &Aabb, b: &Aabb) -> f64 {
    (0..3).map(|i| (a.min[i] - b.max[i]).max(b.min[i] - a.max[i]).max(0.0).powi(2)).sum::<f64>().sqrt()
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
            (offset[i].abs() - half[i] - extent).max(0.0).powi(2)
        })
        .sum::<f64>()
        .sqrt()
}
