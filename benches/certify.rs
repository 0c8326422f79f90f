//! The proof, on a mission of 10 m: 250 rows of 0.1 s, six shapes with a mimic joint, 10 x 10 x 1 m in cells of 5 cm.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Isometry3, Unit, Vector3};
use trajc::certify::{Goal, Task, certify};
use trajc::command::{CommandRow, CommandTable};
use trajc::geom::Pose2;
use trajc::map::VoxelMap;
use trajc::math::real;
use trajc::mission::{Sampling, Unknown};
use trajc::robot::{
    BaseLimits, Body, BodyMotion, Convex, IgnoreReason, IgnoredPair, MotionLimits, MovingJoint, RobotModel, Shape,
};

/// Base, two wheels, a castor and two blades on tilted hinges, as in robots/scr_db.
fn robot() -> RobotModel {
    // Commands are held from rest at once here: only speeds are limited.
    let limits = MotionLimits { speed: Some(1.5), acceleration: None, jerk: None };
    let body = |link: &str, origin, motion| Body { link: link.into(), parent: 0, origin, motion };
    let hinge = |side: f64| {
        let axis = Unit::new_normalize(Vector3::new(0.0, side, 1.0));
        let motion = BodyMotion { joint: 0, multiplier: side, offset: 0.0, axis, prismatic: false };
        body(
            if side > 0.0 { "left_blade" } else { "right_blade" },
            Isometry3::translation(0.0, 0.1 * side, 0.27),
            Some(motion),
        )
    };
    let shape = |link: &str, body, pose, convex| Shape { link: link.into(), body, pose, convex };
    let wheel = |side: f64| {
        let pose = Isometry3::new(Vector3::new(0.0, 0.16 * side, 0.08), Vector3::x() * std::f64::consts::FRAC_PI_2);
        shape("wheel", 0, pose, Convex::Cylinder { radius: 0.08, half_length: 0.02 })
    };
    let blade = |link, body| {
        shape(link, body, Isometry3::translation(0.0, 0.0, 0.19), Convex::Box { half: [0.05, 0.01, 0.18] })
    };
    RobotModel {
        name: "bench".into(),
        wheel_radii: 0.08.into(),
        track_width: 0.32,
        root_link: "base".into(),
        base_from_root: Isometry3::identity(),
        joints: vec![MovingJoint {
            name: "blade".into(),
            prismatic: false,
            lower: -0.1,
            upper: std::f64::consts::PI,
            limits,
        }],
        bodies: vec![body("base", Isometry3::identity(), None), hinge(1.0), hinge(-1.0)],
        shapes: vec![
            shape("base", 0, Isometry3::translation(-0.09, 0.0, 0.14), Convex::Box { half: [0.21, 0.18, 0.11] }),
            wheel(1.0),
            wheel(-1.0),
            shape("castor", 0, Isometry3::translation(-0.25, 0.0, 0.04), Convex::Sphere { radius: 0.04 }),
            blade("left_blade", 1),
            blade("right_blade", 2),
        ],
        wheel: MotionLimits { speed: Some(1.0), ..limits },
        base: BaseLimits {
            speed: 1.0,
            acceleration: 1.0,
            angular_speed: 2.0,
            angular_acceleration: 2.5,
            eta: 0.4,
            min_speed: 0.01,
        },
        ignore_pairs: ["left_blade", "right_blade"]
            .map(|blade| IgnoredPair { links: ["base".into(), blade.into()], reason: IgnoreReason::Joined })
            .into(),
        tolerance: None,
        links: Vec::new(),
    }
}

/// A winding drive of 10 m, the blades swinging out and back; and the poses on the way.
fn commands(robot: &RobotModel) -> (CommandTable, Task) {
    let start = Pose2::new(0.6, 2.0, 0.0);
    let mut table = CommandTable {
        sampling_time: 0.1,
        sampling: Sampling::Mean,
        wheel_radii: robot.wheel_radii,
        track_width: robot.track_width,
        joints: vec![("blade".into(), false)],
        rows: Vec::new(),
    };
    let (mut pose, mut angle) = (start, 0.0);
    for k in 0..=250 {
        let (speed, turn, rate) = match k {
            250 => (0.0, 0.0, 0.0),
            _ => (0.4, 0.5 * real::cos(0.05 * f64::from(k)), 0.5 * real::sin(0.06 * f64::from(k))),
        };
        let difference = 0.5 * turn * robot.track_width;
        table.rows.push(CommandRow {
            wheel_left: (speed - difference) / robot.wheel_radii.mean,
            wheel_right: (speed + difference) / robot.wheel_radii.mean,
            joint_positions: vec![angle],
            joint_velocities: vec![rate],
            pose,
        });
        let (speed, turn) = table.twist(k as usize);
        pose = pose.after_twist(speed, turn, table.sampling_time);
        angle += rate * table.sampling_time;
    }
    let goal = Goal { x: pose.x, y: pose.y, within: 0.0, yaw: Some(pose.yaw), joints: vec![None] };
    (table, Task { start, start_joints: vec![0.0], goal, clearance: 0.05, reverse: false })
}

/// Obstacles wherever the drive leaves room: `density` of the cells that are at least `room` metres from the base's path.
fn map(table: &CommandTable, room: f64, density: f64) -> VoxelMap {
    let mut map = VoxelMap::new(0.05, [0.0, -1.0, 0.0], [220, 200, 20], Unknown::Occupied);
    let mut seed = 1u64;
    for i in 0..map.dims[0] {
        for j in 0..map.dims[1] {
            let cube = map.cube([i, j, 0]);
            let path = table.rows.iter().map(|row| real::hypot(row.pose.x - cube.min[0], row.pose.y - cube.min[1]));
            if path.fold(f64::INFINITY, f64::min) < room {
                continue;
            }
            // Columns of any height: a fixed congruential sequence.
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            let random = (seed >> 33) as f64 / f64::from(u32::MAX >> 1);
            if random < density {
                let height = 1 + (20.0 * random / density) as usize;
                (0..height.min(20)).for_each(|k| map.occupy([i, j, k]));
            }
        }
    }
    map
}

fn bench(criterion: &mut Criterion) {
    let robot = robot();
    let (table, task) = commands(&robot);
    let mut careless = robot.clone();
    for a in &robot.shapes {
        let pair = |b: &Shape| IgnoredPair { links: [a.link.clone(), b.link.clone()], reason: IgnoreReason::Named };
        careless.ignore_pairs.extend(robot.shapes.iter().map(pair));
    }
    for (name, room, density) in
        [("canyon", 0.56, 1.1), ("scattered", 0.56, 0.05), ("rubble", 0.56, 0.5), ("open", 1.2, 0.02)]
    {
        let map = map(&table, room, density);
        let certificate = certify(&table, &robot, Some(&map), &task);
        println!(
            "{name}: proven {:?}, closest {:?}, {:?}",
            certificate.clearance_proven, certificate.closest, certificate.refusals
        );
        criterion.bench_function(&format!("certify/{name}"), |b| {
            b.iter(|| certify(black_box(&table), &robot, Some(&map), &task))
        });
        // What the robot's own links cost: the same without them.
        criterion.bench_function(&format!("certify/{name} without own links"), |b| {
            b.iter(|| certify(black_box(&table), &careless, Some(&map), &task))
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(20).measurement_time(std::time::Duration::from_secs(1));
    targets = bench
}
criterion_main!(benches);
