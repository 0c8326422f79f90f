//! The site of [SCR] VI-C, with its tapes one cell thick: certified by what folds on the way, refused to what does not.

use nalgebra::{Point3, Vector3};
use trajc::certify::{Certificate, Goal, RefusalKind, Task, certify};
use trajc::command::{CommandRow, CommandTable};
use trajc::geom::Pose2;
use trajc::inputs;
use trajc::mission::Sampling;
use trajc::pipeline::{self, CompileOptions, World};
use trajc::robot::RobotModel;

/// Lower faces of the tapes above the floor, m; and the line along y on which the first hangs.
const TAPES: [f64; 2] = [0.45, 0.40];
const FIRST_TAPE: [f64; 2] = [2.60, 2.65];
/// The line along x on which the second hangs, above y = 4.6 m.
const SECOND_TAPE: [f64; 2] = [3.0, 3.05];
/// Clearance that is asked for, m.
const CLEARANCE: f64 = 0.03;

fn site() -> (trajc::pipeline::Inputs, World) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/site.yaml");
    let (mut inputs, _) = inputs::read(&path).expect("shipped");
    let world = pipeline::world(&mut inputs).expect("shipped");
    (inputs, world)
}

/// Straight ahead along y below the first tape, where nothing else is near, the blades held.
fn under_the_tape(robot: &RobotModel, blade: f64) -> (CommandTable, Task) {
    let start = Pose2::new(3.55, 2.2, std::f64::consts::FRAC_PI_2);
    // Up to 0.18 m/s and down again, acceleration 0.18 m/s^2 and jerk 1.8 m/s^3 as differences.
    let ramp = |k: usize| 0.018 * k as f64;
    let speeds: Vec<f64> = (0..10).map(ramp).chain([0.18; 24]).chain((0..10).rev().map(ramp)).collect();
    let mut pose = start;
    let mut rows = Vec::new();
    for v in speeds {
        let wheel = v / robot.wheel_radii.mean;
        rows.push(CommandRow {
            wheel_left: wheel,
            wheel_right: wheel,
            joint_positions: vec![blade],
            joint_velocities: vec![0.0],
            pose,
        });
        pose = pose.after_twist(v, 0.0, 0.1);
    }
    let table = CommandTable {
        sampling_time: 0.1,
        sampling: Sampling::Mean,
        wheel_radii: robot.wheel_radii,
        track_width: robot.track_width,
        joints: vec![("blade".into(), false)],
        rows,
    };
    let goal = Goal { x: pose.x, y: pose.y, within: 0.0, yaw: Some(pose.yaw), joints: vec![Some(blade)] };
    (table, Task { start, start_joints: vec![blade], goal, clearance: CLEARANCE, reverse: false })
}

fn judged(world: &World, blade: f64) -> Certificate {
    let (table, task) = under_the_tape(&world.robot, blade);
    certify(&table, &world.robot, world.map.as_deref(), &task)
}

/// Least distance of any corner of any box of the robot from any obstacle, by brute force at every row and ten times between.
fn corners_keep(world: &World, blade: f64) -> f64 {
    let (table, _) = under_the_tape(&world.robot, blade);
    let map = world.map.as_ref().expect("has a map");
    let cubes: Vec<_> = map.cells().map(|c| map.cube(c)).collect();
    let shapes = world.robot.shape_poses(&[blade]);
    let mut least = f64::INFINITY;
    for (k, row) in table.rows.iter().enumerate() {
        let (v, omega) = table.twist(k);
        for part in 0..10 {
            let pose = row.pose.after_twist(v, omega, 0.01 * f64::from(part)).isometry();
            for (shape, base_from_shape) in world.robot.shapes.iter().zip(&shapes) {
                let trajc::robot::Convex::Box { half } = shape.convex else { continue };
                for corner in 0..8 {
                    let sign = |axis: usize| if corner >> axis & 1 == 0 { -half[axis] } else { half[axis] };
                    let p: Point3<f64> = pose * base_from_shape * Point3::from(Vector3::new(sign(0), sign(1), sign(2)));
                    let near = cubes.iter().filter(|c| (c.min[0] - p.x).abs() < 0.5 && (c.min[1] - p.y).abs() < 0.5);
                    least = near.map(|c| c.distance(&p)).fold(least, f64::min);
                }
            }
        }
    }
    least
}

#[test]
fn a_tape_between_the_corners_of_the_upright_blades_is_seen() {
    let (_, world) = site();
    let upright = judged(&world, 0.0);
    assert!(!upright.holds());
    assert!(upright.refusals.iter().all(|r| r.kind == RefusalKind::Clearance), "{:?}", upright.refusals);
    let hit = upright.closest.as_ref().and_then(|c| c.obstacle).expect("an obstacle is met");
    assert!((hit.min[2] - TAPES[0]).abs() < 1e-9 && (hit.min[1] - FIRST_TAPE[0]).abs() < 1e-9, "{hit:?}");
    // The corners alone never see it: they pass above and below, farther off than is asked for.
    let corners = corners_keep(&world, 0.0);
    assert!(corners > 2.0 * CLEARANCE, "{corners}");
    // The same drive with the blades down passes.
    let down = judged(&world, 2.2);
    assert!(down.holds(), "{:?}", down.refusals);
}

#[test]
fn the_site_is_crossed_with_the_blades_in_between_the_boxes_and_down_below_the_tapes() {
    let (mut inputs, world) = site();
    let outcome = pipeline::compile(&mut inputs, &CompileOptions::default(), &mut |_| {});
    let compiled = outcome.compiled.expect("certified");
    assert!(compiled.certificate.holds() && compiled.certificate.clearance_proven >= Some(CLEARANCE));
    let table = &compiled.commands;
    let poses = table.replay(table.rows[0].pose);
    // Extent of the robot across its way and upwards, at the rows for which `here` holds.
    let extent = |here: &dyn Fn(&Pose2) -> bool| {
        let mut found = [0.0f64; 2];
        for (_, row) in poses.iter().zip(&table.rows).filter(|(pose, _)| here(pose)) {
            for (shape, at) in world.robot.shapes.iter().zip(world.robot.shape_poses(&row.joint_positions)) {
                for (axis, direction) in [Vector3::y(), Vector3::z()].into_iter().enumerate() {
                    let p = at * Point3::from(shape.convex.support(&(at.rotation.inverse() * direction)));
                    found[axis] = found[axis].max(p[1 + axis]);
                }
            }
        }
        found
    };
    let narrow = extent(&|p| (1.25..1.75).contains(&p.y));
    assert!(narrow[0] > 0.0 && 2.0 * narrow[0] < 0.5, "between boxes 0.5 m apart: {narrow:?}");
    // The highest point of the robot's boxes, of a fine grid in each, that is below a tape.
    let below = |axis: usize, tape: [f64; 2], here: &dyn Fn(&Point3<f64>) -> bool| {
        let mut highest = 0.0f64;
        for (pose, row) in poses.iter().zip(&table.rows) {
            for (shape, at) in world.robot.shapes.iter().zip(world.robot.shape_poses(&row.joint_positions)) {
                let trajc::robot::Convex::Box { half } = shape.convex else { continue };
                let steps = |k: usize, n: usize| 2.0 * k as f64 / n as f64 - 1.0;
                for (i, j, k) in (0..3 * 9 * 41).map(|n| (n % 3, n / 3 % 9, n / 27)) {
                    let local = Vector3::new(half[0] * steps(j, 8), half[1] * steps(i, 2), half[2] * steps(k, 40));
                    let p = pose.isometry() * at * Point3::from(local);
                    if (tape[0]..tape[1]).contains(&p[axis]) && here(&p) {
                        highest = highest.max(p.z);
                    }
                }
            }
        }
        highest
    };
    let first = below(1, FIRST_TAPE, &|_| true);
    assert!(first > 0.0 && first < TAPES[0] - CLEARANCE, "below the first tape: {first}");
    let second = below(0, SECOND_TAPE, &|p| p.y > 4.6);
    assert!(second > 0.0 && second < TAPES[1] - CLEARANCE, "below the second tape: {second}");
}
