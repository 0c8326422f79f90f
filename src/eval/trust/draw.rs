//! Robots, motions and maps drawn at random.

use nalgebra::{Isometry3, Unit, Vector3};

use super::Family;
use super::case::{Case, Twist};
use crate::eval::rng::Rng;
use crate::geom::Pose2;
use crate::map::VoxelMap;
use crate::math::real;
use crate::mission::Unknown;
use crate::robot::{
    BaseLimits, Body, BodyMotion, Convex, IgnoreReason, IgnoredPair, MotionLimits, MovingJoint, RobotModel, Shape,
    WheelRadii,
};

pub(super) const FREE: MotionLimits = MotionLimits { speed: None, acceleration: None, jerk: None };

/// Between two numbers, as many in each decade.
pub(super) fn decades(rng: &mut Rng, low: f64, high: f64) -> f64 {
    real::powf(10.0, rng.uniform(real::log10(low), real::log10(high)))
}

pub(super) fn chance(rng: &mut Rng, share: f64) -> bool {
    rng.uniform(0.0, 1.0) < share
}

pub(super) fn one_of(rng: &mut Rng, count: usize) -> usize {
    rng.integer(0, count as i32 - 1) as usize
}

fn vector(rng: &mut Rng, reach: f64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| rng.uniform(-reach, reach))
}

fn pose(rng: &mut Rng, reach: f64) -> Isometry3<f64> {
    let turn = if chance(rng, 0.3) { Vector3::zeros() } else { vector(rng, 3.0) };
    Isometry3::new(vector(rng, reach), turn)
}

/// A box, a cylinder, a ball, or the hull of a few points; its sizes up to `size` m.
pub(super) fn convex(rng: &mut Rng, size: f64) -> Convex {
    let mut length = || decades(rng, 0.1 * size, size);
    let lengths = [length(), length(), length()];
    match one_of(rng, 4) {
        0 => Convex::Box { half: lengths },
        1 => Convex::Cylinder { radius: lengths[0], half_length: lengths[1] },
        2 => Convex::Sphere { radius: lengths[0] },
        _ => hull(rng, size),
    }
}

/// The hull of 4 to 14 points, about the centre of its box.
pub(super) fn hull(rng: &mut Rng, size: f64) -> Convex {
    let count = rng.integer(4, 14);
    let mut vertices: Vec<[f64; 3]> = (0..count).map(|_| vector(rng, size).into()).collect();
    for axis in 0..3 {
        let (low, high) = vertices
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v[axis]), high.max(v[axis])));
        vertices.iter_mut().for_each(|v| v[axis] -= 0.5 * (low + high));
    }
    Convex::Hull { vertices }
}

/// A base without shapes or joints, its origin's body 0.3 m up.
pub(super) fn bare(rng: &mut Rng) -> RobotModel {
    RobotModel {
        name: "trust".into(),
        wheel_radii: WheelRadii { mean: rng.uniform(0.04, 0.15), difference: rng.uniform(-0.05, 0.05) },
        track_width: rng.uniform(0.2, 0.6),
        root_link: "base".into(),
        base_from_root: Isometry3::identity(),
        joints: Vec::new(),
        bodies: vec![Body {
            link: "base".into(),
            parent: 0,
            origin: Isometry3::translation(0.0, 0.0, 0.3),
            motion: None,
        }],
        shapes: Vec::new(),
        wheel: FREE,
        base: BaseLimits {
            speed: 1.0,
            acceleration: 1.0,
            angular_speed: 1.0,
            angular_acceleration: 1.0,
            eta: 0.1,
            min_speed: 0.01,
        },
        ignore_pairs: Vec::new(),
        tolerance: None,
        links: Vec::new(),
    }
}

pub(super) fn add_shape(robot: &mut RobotModel, body: usize, pose: Isometry3<f64>, convex: Convex) {
    let link = format!("link_{}", robot.shapes.len());
    robot.shapes.push(Shape { link, body, pose, convex });
}

/// Joints, each with a body on an earlier one, sometimes a second body that follows it.
pub(super) fn add_joints(rng: &mut Rng, robot: &mut RobotModel, count: usize) {
    for joint in 0..count {
        let prismatic = chance(rng, 0.4);
        robot.joints.push(MovingJoint {
            name: format!("joint_{joint}"),
            prismatic,
            lower: f64::NEG_INFINITY,
            upper: f64::INFINITY,
            limits: FREE,
        });
        for copy in 0..if chance(rng, 0.2) { 2 } else { 1 } {
            let axis =
                if chance(rng, 0.5) { Vector3::ith(one_of(rng, 3), 1.0) } else { vector(rng, 1.0) + Vector3::z() };
            let (multiplier, offset) =
                if copy > 0 { (rng.uniform(-2.0, 2.0), rng.uniform(-0.5, 0.5)) } else { (1.0, 0.0) };
            robot.bodies.push(Body {
                link: format!("body_{}", robot.bodies.len()),
                parent: one_of(rng, robot.bodies.len()),
                origin: pose(rng, 0.2),
                motion: Some(BodyMotion { joint, multiplier, offset, axis: Unit::new_normalize(axis), prismatic }),
            });
        }
    }
}

/// Lets all links touch each other.
pub(super) fn ignore_itself(robot: &mut RobotModel) {
    let names: Vec<String> = robot.shapes.iter().map(|s| s.link.clone()).collect();
    for (i, a) in names.iter().enumerate() {
        let pair = |b: &String| IgnoredPair { links: [a.clone(), b.clone()], reason: IgnoreReason::Named };
        robot.ignore_pairs.extend(names[i + 1..].iter().map(pair));
    }
}

/// 0 to 3 joints and 1 to 4 shapes, which may touch each other.
pub(super) fn robot(rng: &mut Rng) -> RobotModel {
    let mut robot = bare(rng);
    let joints = one_of(rng, 4);
    add_joints(rng, &mut robot, joints);
    for _ in 0..rng.integer(1, 4) {
        let (body, at) = (one_of(rng, robot.bodies.len()), pose(rng, 0.1));
        let shape = convex(rng, 0.15);
        add_shape(&mut robot, body, at, shape);
    }
    ignore_itself(&mut robot);
    robot
}

/// Joint values, the seconds of a row, and 1 to 6 rows, at times 20 to 60.
pub(super) fn motion(rng: &mut Rng, joints: usize) -> (Vec<f64>, f64, Vec<Twist>) {
    let values = (0..joints).map(|_| rng.uniform(-1.0, 1.0)).collect();
    let step = decades(rng, 0.02, 0.3);
    // Some only drive, turn, or move joints.
    let (drives, turns, moves) = (!chance(rng, 0.15), !chance(rng, 0.2), !chance(rng, 0.2));
    let on = |on: bool, value: f64| if on { value } else { 0.0 };
    let count = if chance(rng, 0.05) { rng.integer(20, 60) } else { rng.integer(1, 6) };
    let step = if count > 6 { 0.02 } else { step };
    let rows = (0..count).map(|_| {
        let rates = (0..joints).map(|_| on(moves, rng.uniform(-2.0, 2.0))).collect();
        (on(drives, rng.uniform(-1.0, 1.0)), on(turns, rng.uniform(-3.0, 3.0)), rates)
    });
    let rows = rows.collect();
    (values, step, rows)
}

/// A pose near the middle of a map.
pub(super) fn start(rng: &mut Rng) -> Pose2 {
    Pose2::new(rng.uniform(-0.2, 0.2), rng.uniform(-0.2, 0.2), rng.uniform(-4.0, 4.0))
}

/// An empty map about the origin, 1.6 to 2.4 m wide, from the floor up to 0.9 m.
pub(super) fn room(rng: &mut Rng) -> VoxelMap {
    let resolution = [0.02, 0.05, 0.1, 0.037][one_of(rng, 4)];
    let half = rng.uniform(0.8, 1.2);
    let cells = |length: f64| ((length / resolution).ceil() as usize).max(1);
    let outside = if chance(rng, 0.3) { Unknown::Occupied } else { Unknown::Free };
    VoxelMap::new(resolution, [-half, -half, 0.0], [cells(2.0 * half), cells(2.0 * half), cells(0.9)], outside)
}

/// Cells and bars of one cell's width: lists of cells that come together.
pub(super) fn obstacles(rng: &mut Rng, map: &VoxelMap) -> Vec<Vec<[usize; 3]>> {
    let one = |rng: &mut Rng| {
        let cell: [usize; 3] = std::array::from_fn(|axis| one_of(rng, map.dims[axis]));
        if chance(rng, 0.6) {
            return vec![cell];
        }
        let axis = one_of(rng, 3);
        let end = (cell[axis] + rng.integer(2, 12) as usize).min(map.dims[axis]);
        (cell[axis]..end)
            .map(|at| {
                let mut next = cell;
                next[axis] = at;
                next
            })
            .collect()
    };
    (0..rng.integer(1, 10)).map(|_| one(rng)).collect()
}

/// A robot on its way through a room, most of whose obstacles are kept out of its way as far as samples tell.
pub(super) fn scene(rng: &mut Rng, family: Family) -> Case {
    let robot = robot(rng);
    let (values, step, held) = motion(rng, robot.joints.len());
    let (mut start, mut map) = (start(rng), room(rng));
    if chance(rng, 0.1) {
        // Far from the map's origin, where coordinates have fewer digits to spare.
        let away = [rng.uniform(-2000.0, 2000.0), rng.uniform(-2000.0, 2000.0)];
        (start.x, start.y) = (start.x + away[0], start.y + away[1]);
        (map.origin[0], map.origin[1]) = (map.origin[0] + away[0], map.origin[1] + away[1]);
    }
    let mut case = Case::new(family, robot, start, &values, step, &held);
    furnish(rng, &mut case, map);
    case
}

/// Puts obstacles into a room and gives it to the case: each at least a random way off, as far as samples tell, but for a few.
pub(super) fn furnish(rng: &mut Rng, case: &mut Case, mut map: VoxelMap) {
    let reach = Reach::of(case);
    for cells in obstacles(rng, &map) {
        let off = decades(rng, 1e-3, 0.3);
        let anyway = chance(rng, 0.03);
        if anyway || cells.iter().all(|cell| reach.keeps(&map, *cell, off)) {
            cells.into_iter().for_each(|cell| map.occupy(cell));
        }
    }
    case.map = Some(map);
}

/// Balls around the shapes at samples: a rough idea of where the robot gets.
struct Reach(Vec<(Vector3<f64>, Convex, Isometry3<f64>)>);

impl Reach {
    fn of(case: &Case) -> Self {
        let mut out = Vec::new();
        for (k, row) in case.table.rows.iter().enumerate() {
            let (speed, turn) = case.table.twist(k);
            for part in [0.0, 0.5] {
                let tau = part * case.table.sampling_time;
                let joints: Vec<f64> =
                    row.joint_positions.iter().zip(&row.joint_velocities).map(|(q, rate)| q + rate * tau).collect();
                let base = row.pose.after_twist(speed, turn, tau).isometry();
                for (pose, shape) in case.robot.shape_poses(&joints).iter().zip(&case.robot.shapes) {
                    let pose = base * pose;
                    out.push((pose.translation.vector, shape.convex.clone(), pose));
                }
            }
        }
        Self(out)
    }

    /// Whether a plane square to the line between the centres keeps a cell `off` m from the shapes; good enough to place obstacles.
    fn keeps(&self, map: &VoxelMap, cell: [usize; 3], off: f64) -> bool {
        let cube = map.cube(cell);
        let middle = Vector3::from_fn(|axis, _| 0.5 * (cube.min[axis] + cube.max[axis]));
        self.0.iter().all(|(centre, convex, pose)| {
            let Some(toward) = (middle - centre).try_normalize(1e-9) else { return false };
            let reach = pose.transform_vector(&convex.support(&pose.inverse_transform_vector(&toward))).dot(&toward);
            let half: f64 = (0..3).map(|axis| 0.5 * map.resolution * toward[axis].abs()).sum();
            (middle - centre).dot(&toward) - reach - half >= off
        })
    }
}
