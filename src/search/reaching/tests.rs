use super::*;
use crate::esdf;
use crate::map::VoxelMap;
use crate::math::fd::{numeric_gradient, relative_error};
use crate::mission::Unknown;
use crate::robot::{Body, BodyMotion, LinkFrame};
use crate::search::tests::scr_db;
use nalgebra::Unit;

/// A lift with a shoulder and an elbow on it, each link `tool` half a metre on.
fn arm() -> RobotModel {
    let mut robot = scr_db();
    robot.bodies.truncate(1);
    robot.shapes.retain(|shape| shape.body == 0);
    let mut joint = robot.joints[0].clone();
    robot.joints.clear();
    let mut add = |name: &str, axis: Vector3<f64>, origin: Vector3<f64>, range: [f64; 2], prismatic: bool| {
        (joint.name, joint.prismatic) = (name.into(), prismatic);
        [joint.lower, joint.upper] = range;
        robot.joints.push(joint.clone());
        let motion = BodyMotion {
            joint: robot.joints.len() - 1,
            multiplier: 1.0,
            offset: 0.0,
            axis: Unit::new_normalize(axis),
            prismatic,
        };
        let origin = Isometry3::translation(origin.x, origin.y, origin.z);
        let parent = robot.bodies.len() - 1;
        robot.bodies.push(Body { link: name.into(), parent, origin, motion: Some(motion) });
    };
    add("lift", Vector3::z(), Vector3::new(0.1, 0.0, 0.3), [0.0, 0.6], true);
    add("shoulder", Vector3::y(), Vector3::new(0.05, 0.1, 0.0), [-1.5, 1.5], false);
    add("elbow", Vector3::new(1.0, 0.0, 1.0), Vector3::new(0.5, 0.0, 0.0), [-2.0, 2.0], false);
    let pose = Isometry3::translation(0.5, 0.0, 0.1);
    robot.links = vec![LinkFrame { name: "tool".into(), body: 3, pose }];
    robot
}

fn free_map() -> VoxelMap {
    VoxelMap::new(0.1, [-4.0, -4.0, 0.0], [80, 80, 30], Unknown::Free)
}

fn query(joints: usize) -> Query {
    Query {
        start: Pose2::new(0.0, 0.0, 0.3),
        start_joints: vec![Some(0.0); joints],
        goal: Pose2::default(),
        goal_within: 0.0,
        goal_yaw: None,
        goal_joints: vec![None; joints],
    }
}

const OPTIONS: SearchOptions = SearchOptions { clearance: 0.0, reverse: false };

/// How far the link is from its place, m, and from being turned as it is to be, rad.
fn off(robot: &RobotModel, target: &LinkTarget, pose: Pose2, joints: &[f64]) -> [f64; 2] {
    let mut bodies = Vec::new();
    robot.body_poses(joints, &mut bodies);
    let link = &robot.links[target.link];
    let frame = pose.isometry() * bodies[link.body] * link.pose;
    let turned = target.rotation.map_or(0.0, |wanted| frame.rotation.angle_to(&wanted));
    [(frame.translation.vector - Vector3::from(target.position)).norm(), turned]
}

#[test]
fn the_jacobian_matches_finite_differences() {
    let robot = arm();
    let rotation = Some(UnitQuaternion::from_euler_angles(0.3, -0.2, 1.0));
    let target = LinkTarget { link: 0, position: [1.0, 2.0, 0.7], rotation };
    let open = vec![None; 3];
    let solver = Solver { robot: &robot, target: &target, yaw: None, joints: &open, ranges: &[[-9.0, 9.0]; 3] };
    let state = |x: &[f64]| State { pose: Pose2::new(x[0], x[1], x[2]), joints: x[3..].to_vec() };
    let at = [0.4, -0.3, 0.8, 0.2, 0.5, -0.7];
    let jacobian = solver.jacobian(&state(&at), &solver.frame(&state(&at)));
    let frame = |x: &[f64]| solver.frame(&state(x));
    for row in 0..6 {
        let value = |x: &[f64]| match row {
            0..3 => frame(x).translation.vector[row],
            // Of the turn since then, about the map's axes.
            _ => ARM * (frame(x).rotation * frame(&at).rotation.inverse()).scaled_axis()[row - 3],
        };
        let numeric = numeric_gradient(value, &at, 1e-4);
        let own: Vec<f64> = jacobian.row(row).iter().copied().collect();
        assert!(relative_error(&own, &numeric, 1e-3) < 1e-6, "{row}: {own:?} {numeric:?}");
    }
}

#[test]
fn the_link_is_at_its_place_in_all_that_is_found_and_what_is_asked_for_stays() {
    let (robot, map) = (arm(), free_map());
    let esdf = esdf::build(&map);
    let turned = UnitQuaternion::from_euler_angles(0.0, 0.4, 0.9);
    for (rotation, yaw, lift) in [(None, None, None), (None, Some(0.7), Some(0.25)), (Some(turned), None, None)] {
        let target = LinkTarget { link: 0, position: [1.5, -1.0, 0.6], rotation };
        let mut query = query(3);
        (query.goal_yaw, query.goal_joints[0]) = (yaw, lift);
        let all = placements(&map, &esdf, &robot, &target, &query, &OPTIONS);
        assert!(!all.found.is_empty() && all.nearest == 0.0, "{all:?}");
        for (pose, joints) in &all.found {
            let [distance, angle] = off(&robot, &target, *pose, joints);
            assert!(distance < 1e-5 && angle < 1e-5, "{distance} {angle}");
            assert!(yaw.is_none_or(|yaw| wrap_angle(pose.yaw - yaw).abs() < 1e-12));
            assert!(lift.is_none_or(|lift| joints[0] == lift));
            let in_range =
                |(joint, value): (&crate::robot::MovingJoint, &f64)| (joint.lower..=joint.upper).contains(value);
            assert!(robot.joints.iter().zip(joints).all(in_range), "{joints:?}");
        }
        assert_eq!(all, placements(&map, &esdf, &robot, &target, &query, &OPTIONS), "the same each time");
    }
}

#[test]
fn a_place_out_of_reach_is_as_far_off_as_the_stretched_arm_says() {
    let (mut robot, map) = (arm(), free_map());
    let esdf = esdf::build(&map);
    // Only the lift moves: the tool is at 0.4 to 1.0 m.
    for joint in &mut robot.joints[1..] {
        (joint.lower, joint.upper) = (0.0, 0.0);
    }
    let target = LinkTarget { link: 0, position: [0.5, 0.5, 1.3], rotation: None };
    let none = placements(&map, &esdf, &robot, &target, &query(3), &OPTIONS);
    assert!(none.found.is_empty() && (none.nearest - 0.3).abs() < 1e-3, "{none:?}");
    assert!(none.heights[0] >= 0.4 - 1e-9 && none.heights[1] <= 1.0 + 1e-9, "{none:?}");
    let target = LinkTarget { position: [0.5, 0.5, 0.9], ..target };
    let some = placements(&map, &esdf, &robot, &target, &query(3), &OPTIONS);
    assert!(some.found.iter().all(|(_, joints)| (joints[0] - 0.5).abs() < 1e-6), "{some:?}");
}

#[test]
fn placements_that_touch_are_taken_only_where_there_are_no_others() {
    let robot = arm();
    let mut map = free_map();
    let target = LinkTarget { link: 0, position: [0.0, 0.0, 0.8], rotation: None };
    // A wall on one side of the place.
    for y in 0..80 {
        for z in 0..30 {
            map.occupy([43, y, z]);
        }
    }
    let clear = |map: &VoxelMap| {
        let esdf = esdf::build(map);
        let all = placements(map, &esdf, &robot, &target, &query(3), &OPTIONS);
        let gap = |(pose, joints): &(Pose2, Vec<f64>)| {
            let only = Postures::over(joints.iter().map(|value| vec![*value]).collect());
            Collider::<1>::new(&robot, &esdf, map, 0.0, only).contact(*pose, joints).clearance
        };
        (all.found.iter().map(gap).fold(f64::INFINITY, f64::min), all.found.len())
    };
    let (gap, count) = clear(&map);
    assert!(gap >= 0.0 && count > 1, "{gap} {count}");
    // Walls everywhere.
    for x in 0..80 {
        for y in 0..80 {
            map.occupy([x, y, 2]);
        }
    }
    let (gap, count) = clear(&map);
    assert!(gap < 0.0 && count == 1, "{gap} {count}");
}
