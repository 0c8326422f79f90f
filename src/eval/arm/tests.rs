use std::f64::consts::FRAC_PI_2;

use super::*;
use crate::eval::scenes::{Scene, SceneSet};
use crate::math::real;
use crate::mission::PoseSpec;
use crate::robot::{self, NoFiles, RobotInputs, spec};

fn robot(yaml: &str, urdf: &str) -> RobotModel {
    let spec = spec::parse("robot.yaml", yaml).expect("a robot.yaml");
    let inputs =
        RobotInputs { spec: &spec, urdf: ("robot.urdf", urdf), files: &mut NoFiles, overrides: &Default::default() };
    robot::parse(inputs).expect("a robot")
}

fn arm7() -> RobotModel {
    robot(include_str!("../../../robots/arm7/robot.yaml"), include_str!("../../../robots/arm7/arm7.urdf"))
}

fn arm4() -> RobotModel {
    robot(include_str!("../../../robots/arm4/robot.yaml"), include_str!("../../../robots/arm4/arm4.urdf"))
}

fn box_base() -> RobotModel {
    robot(include_str!("../../../robots/box_base/robot.yaml"), include_str!("../../../robots/box_base/box_base.urdf"))
}

fn set(robot: &RobotModel, count: usize, seed: u64) -> SceneSet {
    let text = document(robot, count, seed).expect("room enough");
    crate::eval::read("arm.json", &text).unwrap_or_else(|e| panic!("{e:?}"))
}

/// The occupied cubes and the outside of the room, by brute force over points of the robot's surface: no nearer than `clear`.
fn surface_is_clear(robot: &RobotModel, set: &SceneSet, scene: &Scene, end: &PoseSpec, clear: f64) -> bool {
    let value = |v: Option<f64>| v.expect("given");
    let at = Pose2::new(value(end.x), value(end.y), value(end.yaw)).isometry();
    let q: Vec<f64> = robot.joints.iter().map(|j| end.joints[&j.name]).collect();
    let directions = (0..14).flat_map(|i| (0..14).map(move |j| (i, j))).map(|(i, j)| {
        let (turn, tilt) = (f64::from(i) * 0.449, (f64::from(j) / 6.5 - 1.0) * FRAC_PI_2);
        nalgebra::Vector3::new(real::cos(turn) * real::cos(tilt), real::sin(turn) * real::cos(tilt), real::sin(tilt))
    });
    let directions: Vec<_> = directions.collect();
    robot.shapes.iter().zip(robot.shape_poses(&q)).all(|(shape, pose)| {
        directions.iter().all(|d| {
            let p = at * pose * nalgebra::Point3::from(shape.convex.support(d));
            let gap = |b: &Aabb, axis: usize| (b.min[axis] - p[axis]).max(p[axis] - b.max[axis]).max(0.0);
            let wall =
                (0..2).map(|a| (p[a] - set.bounds.min[a]).min(set.bounds.max[a] - p[a])).fold(f64::INFINITY, f64::min);
            let gaps =
                scene.boxes.iter().map(|b| [0, 1, 2].map(|a| gap(b, a)).iter().map(|g| g * g).sum::<f64>().sqrt());
            gaps.fold(wall, f64::min) >= clear - 1e-9
        })
    })
}

#[test]
fn the_same_arguments_give_the_same_bytes_and_scene_k_does_not_depend_on_the_count() {
    let robot = arm7();
    assert_eq!(document(&robot, 1, 5), document(&robot, 1, 5));
    let (one, two) = (set(&robot, 1, 5), set(&robot, 2, 5));
    assert_eq!(one.scenes[..], [two.scenes[0].clone(), two.scenes[2].clone()]);
    assert_ne!(two.scenes[0].boxes, two.scenes[1].boxes);
    assert_ne!(set(&robot, 1, 6).scenes[0].boxes, one.scenes[0].boxes);
}

#[test]
fn start_and_goal_are_three_to_eight_metres_apart_and_the_whole_robot_is_clear_there() {
    let robot = arm7();
    let set = set(&robot, 2, 11);
    assert_eq!((set.clearance, set.resolution), (0.02, 0.05));
    for scene in &set.scenes {
        let ends = [&scene.start, &scene.goal].map(|p| [p.x, p.y].map(|v| v.expect("given")));
        assert!((3.0..=8.0).contains(&real::hypot(ends[0][0] - ends[1][0], ends[0][1] - ends[1][1])), "{}", scene.id);
        for end in [&scene.start, &scene.goal] {
            assert!(surface_is_clear(&robot, &set, scene, end, FREE), "{}", scene.id);
            let mut arm = robot.clone();
            arm.shapes.retain(|shape| shape.body != 0);
            let q: Vec<f64> = robot.joints.iter().map(|j| end.joints[&j.name]).collect();
            assert!(arm.extents(&q).min[2] >= FREE, "{}", scene.id);
            assert_eq!(robot.touching(&robot.self_pairs(), &q), None, "{}", scene.id);
            assert!(robot.joints.iter().zip(&q).all(|(j, q)| (j.lower..=j.upper).contains(q)));
        }
        assert_ne!(scene.start.joints, scene.goal.joints);
    }
    set.fits(&robot, "").expect("joints of the robot, within their ranges");
}

#[test]
fn rooms_have_their_kinds_obstacles_which_do_not_overlap_and_lie_on_the_grid() {
    let set = set(&arm7(), 2, 3);
    for (scene, kind) in set.scenes.iter().zip(["cuboids", "cuboids", "tables", "tables"]) {
        assert_eq!(scene.kind.as_deref(), Some(kind));
        let cells = |b: &Aabb| CellBox {
            min: b.min.map(|v| (v / CELL).round() as i32),
            max: b.max.map(|v| (v / CELL).round() as i32),
        };
        let boxes: Vec<CellBox> = scene.boxes.iter().map(cells).collect();
        assert!(boxes.iter().zip(&scene.boxes).all(|(c, b)| c.min.map(metres) == b.min && c.max.map(metres) == b.max));
        for (i, a) in boxes.iter().enumerate() {
            assert!(boxes[..i].iter().all(|b| !obstacles::overlap(a, b)), "{}", scene.id);
            assert!((0..2).all(|axis| 0 <= a.min[axis] && a.max[axis] <= SIDE) && a.max[2] <= HEIGHT);
        }
        let count = |test: &dyn Fn(&CellBox) -> bool| boxes.iter().filter(|b| test(b)).count();
        let leg = |b: &CellBox| b.min[2] == 0 && (0..2).all(|a| b.max[a] - b.min[a] == 1);
        let walls = count(&|b| b.min[2] == 0 && !leg(b));
        assert_eq!(walls, 80);
        if kind == "cuboids" {
            assert_eq!(count(&|b| b.min[2] > 0), 80);
        } else {
            let tops = count(&|b| b.min[2] > 0 && b.max[2] - b.min[2] == 1);
            assert!((40..=160).contains(&tops) && count(&leg) == 4 * tops);
        }
    }
}

#[test]
fn the_base_gets_from_start_to_goal_under_what_hangs_and_between_what_stands() {
    let wall = |from: i32, to: i32, bottom: i32| CellBox { min: [from, 200, bottom], max: [to, 204, 20] };
    let ends = [[5.0, 5.0], [5.0, 15.0]];
    let passes = |boxes: &[CellBox], radius: f64| Plan::new(boxes, 0.42, radius).connected(ends);
    let door = [wall(0, 94, 0), wall(112, 400, 0)];
    assert!(passes(&door, 0.42) && !passes(&door, 0.47), "0.9 m wide");
    assert!(!passes(&[wall(0, 400, 8)], 0.42) && passes(&[wall(0, 400, 9)], 0.42), "0.40 and 0.45 m high");
    assert!(!Plan::new(&[], 0.4, 0.42).connected([[0.3, 5.0], [5.0, 5.0]]), "too near to the room's wall");
}

#[test]
fn a_robot_without_joints_has_scenes_too() {
    let robot = box_base();
    let set = set(&robot, 1, 1);
    for scene in &set.scenes {
        assert!(scene.start.joints.is_empty() && scene.goal.joints.is_empty());
        assert!([&scene.start, &scene.goal].iter().all(|end| surface_is_clear(&robot, &set, scene, end, FREE)));
    }
}

#[test]
fn the_arm_of_arm7_is_as_long_as_stated_and_folds_to_within_the_base() {
    let robot = arm7();
    assert!((robot.extents(&[0.0; 7]).max[2] - (0.30 + 1.20)).abs() < 1e-12, "stretched, on a deck at 0.30 m");
    let folded = [0.0, -0.7, 0.0, 2.2, 0.0, -1.5, 0.0];
    assert_eq!(robot.touching(&robot.self_pairs(), &folded), None);
    assert!(robot.radius(&folded) <= 0.4 * (1.0 + 2e-3), "{}", robot.radius(&folded));
}

#[test]
fn the_arm_of_arm4_folds_flat_as_its_urdf_says() {
    let robot = arm4();
    let folded = [0.0, -90.0, 170.0, 10.0].map(f64::to_radians);
    assert_eq!(robot.touching(&robot.self_pairs(), &folded), None);
    assert!(robot.radius(&folded) <= 0.195 && robot.extents(&folded).max[2] < 0.35);
    assert!((robot.extents(&[0.0; 4]).max[2] - 0.73).abs() < 1e-12);
}
