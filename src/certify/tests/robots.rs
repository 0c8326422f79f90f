//! Robots, maps and tables for the tests, and a clearance by brute force that shares no code with the proof but the distance
//! of two bodies.

use nalgebra::{Isometry3, Matrix3, Unit, Vector3};
use proptest::prelude::*;

use crate::certify::distance::Posed;
use crate::certify::{Goal, Task};
use crate::command::{CommandRow, CommandTable};
use crate::geom::{Aabb, Pose2};
use crate::map::VoxelMap;
use crate::mission::{Sampling, Unknown};
use crate::robot::{
    BaseLimits, Body, BodyMotion, Convex, IgnoreReason, IgnoredPair, MotionLimits, MovingJoint, RobotModel, Shape,
};

pub(crate) const FREE: MotionLimits = MotionLimits { speed: None, acceleration: None, jerk: None };

/// A base without shapes or joints.
pub(crate) fn bare_robot() -> RobotModel {
    RobotModel {
        name: "test".into(),
        wheel_radii: 0.1.into(),
        track_width: 0.4,
        root_link: "base".into(),
        base_from_root: Isometry3::identity(),
        joints: Vec::new(),
        bodies: vec![Body { link: "base".into(), parent: 0, origin: Isometry3::identity(), motion: None }],
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

/// Adds a shape to the robot's body `body`.
pub(crate) fn with_shape(mut robot: RobotModel, body: usize, pose: Isometry3<f64>, convex: Convex) -> RobotModel {
    let link = format!("link_{}", robot.shapes.len());
    robot.shapes.push(Shape { link, body, pose, convex });
    robot
}

/// Lets all links touch each other.
pub(crate) fn ignoring_itself(mut robot: RobotModel) -> RobotModel {
    let names: Vec<String> = robot.shapes.iter().map(|s| s.link.clone()).collect();
    for (i, a) in names.iter().enumerate() {
        let pair = |b: &String| IgnoredPair { links: [a.clone(), b.clone()], reason: IgnoreReason::Named };
        robot.ignore_pairs.extend(names[i + 1..].iter().map(pair));
    }
    robot
}

/// Adds a moving joint.
pub(crate) fn with_joint(mut robot: RobotModel, prismatic: bool) -> RobotModel {
    let name = format!("joint_{}", robot.joints.len());
    robot.joints.push(MovingJoint { name, prismatic, lower: f64::NEG_INFINITY, upper: f64::INFINITY, limits: FREE });
    robot
}

/// Adds a body that joint `joint` moves, `factor` times as far, from `offset`.
pub(crate) fn with_body(
    mut robot: RobotModel,
    parent: usize,
    origin: Isometry3<f64>,
    axis: [f64; 3],
    (joint, factor, offset): (usize, f64, f64),
) -> RobotModel {
    let prismatic = robot.joints[joint].prismatic;
    let axis = Unit::new_normalize(Vector3::from(axis));
    let motion = Some(BodyMotion { joint, multiplier: factor, offset, axis, prismatic });
    robot.bodies.push(Body { link: format!("body_{}", robot.bodies.len()), parent, origin, motion });
    robot
}

/// What a row holds: m/s, rad/s, joint rates.
pub(crate) type Twist = (f64, f64, Vec<f64>);

/// The table that holds these twists from `start`, and the task that it fulfils.
pub(crate) fn commands(
    robot: &RobotModel,
    start: Pose2,
    joints: &[f64],
    step: f64,
    held: &[Twist],
) -> (CommandTable, Task) {
    let rest = (0.0, 0.0, vec![0.0; joints.len()]);
    let mut table = CommandTable {
        sampling_time: step,
        sampling: Sampling::Mean,
        wheel_radii: robot.wheel_radii,
        track_width: robot.track_width,
        joints: robot.joints.iter().map(|j| (j.name.clone(), j.prismatic)).collect(),
        rows: Vec::new(),
    };
    let (mut pose, mut values) = (start, joints.to_vec());
    for (k, (speed, turn, rates)) in held.iter().chain([&rest]).enumerate() {
        let difference = 0.5 * turn * robot.track_width;
        table.rows.push(CommandRow {
            wheel_left: (speed - difference) / robot.wheel_radii.mean,
            wheel_right: (speed + difference) / robot.wheel_radii.mean,
            joint_positions: values.clone(),
            joint_velocities: rates.clone(),
            pose,
        });
        let (speed, turn) = table.twist(k);
        pose = pose.after_twist(speed, turn, step);
        values.iter_mut().zip(rates).for_each(|(q, rate)| *q += rate * step);
    }
    let last = table.rows.last().expect("there is always the row at rest");
    let goal = Goal {
        x: last.pose.x,
        y: last.pose.y,
        within: 0.0,
        yaw: Some(last.pose.yaw),
        joints: last.joint_positions.iter().map(|q| Some(*q)).collect(),
    };
    let task = Task { start, start_joints: joints.to_vec(), goal, clearance: 0.05, reverse: true };
    (table, task)
}

/// Distance of shape `index` from the nearest cube or edge `tau` seconds into row `row`, from the table's written state.
pub(crate) fn distance_at(
    table: &CommandTable,
    robot: &RobotModel,
    map: &VoxelMap,
    (row, tau): (usize, f64),
    index: usize,
) -> f64 {
    let (speed, turn) = table.twist(row);
    let row = &table.rows[row];
    let values: Vec<f64> =
        row.joint_positions.iter().zip(&row.joint_velocities).map(|(q, rate)| q + rate * tau).collect();
    let pose = row.pose.after_twist(speed, turn, tau).isometry() * robot.shape_poses(&values)[index];
    let turn: Matrix3<f64> = pose.rotation.to_rotation_matrix().into_inner();
    let posed = Posed { convex: &robot.shapes[index].convex, turn, centre: pose.translation.vector, spread: None };
    let cubes = cubes(map).into_iter().map(|cube| posed.separation(&cube).upper).fold(f64::INFINITY, f64::min);
    if map.outside == Unknown::Free {
        return cubes;
    }
    let (own, whole) = (posed.bounds(), map.bounds());
    let room = (0..2).map(|a| (own.min[a] - whole.min[a]).min(whole.max[a] - own.max[a])).fold(cubes, f64::min);
    room.max(0.0)
}

/// The least distance over `samples` instants a row and all shapes: never less than the truth.
pub(crate) fn sampled(table: &CommandTable, robot: &RobotModel, map: &VoxelMap, samples: usize) -> f64 {
    let mut least = f64::INFINITY;
    for row in 0..table.rows.len() {
        for sample in 0..samples {
            let tau = table.sampling_time * sample as f64 / samples as f64;
            for index in 0..robot.shapes.len() {
                least = least.min(distance_at(table, robot, map, (row, tau), index));
            }
        }
    }
    least
}

fn cubes(map: &VoxelMap) -> Vec<Aabb> {
    let mut cubes = Vec::new();
    for i in 0..map.dims[0] {
        for j in 0..map.dims[1] {
            for k in (0..map.dims[2]).filter(|k| map.occupied([i, j, *k])) {
                cubes.push(map.cube([i, j, k]));
            }
        }
    }
    cubes
}

fn any_pose(reach: f64) -> impl Strategy<Value = Isometry3<f64>> {
    let at = || -reach..reach;
    ([at(), at(), at()], [-3.0..3.0, -3.0..3.0, -3.0..3.0f64])
        .prop_map(|(t, r)| Isometry3::new(Vector3::from(t), Vector3::from(r)))
}

fn any_convex() -> impl Strategy<Value = Convex> {
    let size = || 0.01..0.15f64;
    let corner = || -0.15..0.15f64;
    prop_oneof![
        [size(), size(), size()].prop_map(|half| Convex::Box { half }),
        (size(), size()).prop_map(|(radius, half_length)| Convex::Cylinder { radius, half_length }),
        size().prop_map(|radius| Convex::Sphere { radius }),
        prop::collection::vec([corner(), corner(), corner()], 4..12).prop_map(|vertices| Convex::Hull { vertices }),
    ]
}

/// Up to three joints, one of them with a mimic, in any tree; one to four shapes, which may touch each other.
pub(crate) fn any_robot() -> impl Strategy<Value = RobotModel> {
    any_tangle().prop_map(ignoring_itself)
}

/// As [`any_robot`], but its links may not touch each other.
pub(crate) fn any_tangle() -> impl Strategy<Value = RobotModel> {
    let axis = [-1.0..1.0, -1.0..1.0, 0.1..1.0f64];
    let body = (any_pose(0.15), axis, any::<prop::sample::Index>(), -2.0..2.0f64, -0.5..0.5f64);
    let bodies = prop::collection::vec((body, any::<prop::sample::Index>()), 0..4);
    let shapes = prop::collection::vec((any_pose(0.1), any_convex(), any::<prop::sample::Index>()), 1..4);
    (prop::collection::vec(any::<bool>(), 0..4), bodies, shapes).prop_map(|(joints, bodies, shapes)| {
        let mut robot = bare_robot();
        robot.bodies[0].origin = Isometry3::translation(0.0, 0.0, 0.3);
        for prismatic in &joints {
            robot = with_joint(robot, *prismatic);
        }
        for ((origin, axis, joint, factor, offset), parent) in bodies {
            if !joints.is_empty() {
                let parent = parent.index(robot.bodies.len());
                robot = with_body(robot, parent, origin, axis, (joint.index(joints.len()), factor, offset));
            }
        }
        for (pose, convex, body) in shapes {
            let body = body.index(robot.bodies.len());
            robot = with_shape(robot, body, pose, convex);
        }
        robot
    })
}

/// 1.2 x 1.2 x 0.6 m in cells of 0.1 m, a few of them occupied.
pub(crate) fn any_map() -> impl Strategy<Value = VoxelMap> {
    (prop::collection::vec([0..12usize, 0..12usize, 0..6usize], 0..8), any::<bool>()).prop_map(|(cells, closed)| {
        let outside = if closed { Unknown::Occupied } else { Unknown::Free };
        let mut map = VoxelMap::new(0.1, [-0.6, -0.6, 0.0], [12, 12, 6], outside);
        cells.into_iter().for_each(|cell| map.occupy(cell));
        map
    })
}

/// Starts and held twists: up to four rows; each number is used for what the robot has.
pub(crate) fn any_motion() -> impl Strategy<Value = (Pose2, Vec<f64>, f64, Vec<Twist>)> {
    let pose = [-0.6..0.6, -0.6..0.6, -4.0..4.0f64].prop_map(|[x, y, yaw]| Pose2::new(x, y, yaw));
    let values = prop::collection::vec(-1.0..1.0f64, 3);
    let twist = (-1.0..1.0f64, -3.0..3.0f64, prop::collection::vec(-2.0..2.0f64, 3));
    (pose, values, 0.02..0.3f64, prop::collection::vec(twist, 1..5))
}

/// Cuts starts and twists to the robot's joints.
pub(crate) fn cut(robot: &RobotModel, values: &[f64], held: &[Twist]) -> (Vec<f64>, Vec<Twist>) {
    let count = robot.joints.len();
    let held = held.iter().map(|(v, w, rates)| (*v, *w, rates[..count].to_vec())).collect();
    (values[..count].to_vec(), held)
}
