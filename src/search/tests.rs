//! The search against brute force, and on maps that ask for one posture or another.

mod between;

use super::lattice::{HEADINGS, Lattice, LatticeState};
use super::*;
use crate::math::real;
use crate::mission::Unknown;
use crate::robot::{BaseLimits, Body, BodyMotion, Convex, MotionLimits, MovingJoint, Shape};
use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use parry3d_f64::math::{Pose, Rotation, Vector};
use parry3d_f64::query;
use parry3d_f64::shape::{Ball, Cuboid, Cylinder, SharedShape};
use proptest::prelude::*;

/// The reference robot SCR-DB, built by hand.
pub(super) fn scr_db() -> RobotModel {
    let some = |v| MotionLimits { speed: Some(v), acceleration: Some(2.0 * v), jerk: Some(10.0 * v) };
    let at = |x, y, z| Isometry3::translation(x, y, z);
    let blade = |side: f64| Body {
        link: format!("blade {side}"),
        parent: 0,
        origin: at(0.0, 0.10 * side, 0.27),
        motion: Some(BodyMotion {
            joint: 0,
            multiplier: side,
            offset: 0.0,
            axis: Unit::new_normalize(Vector3::new(0.0, -side, -1.0)),
            prismatic: false,
        }),
    };
    let shape = |link: &str, body, pose, convex| Shape { link: link.into(), body, pose, convex };
    let lying = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    let wheel = |y| Isometry3::from_parts(Translation3::new(0.0, y, 0.08), lying);
    let cylinder = || Convex::Cylinder { radius: 0.08, half_length: 0.015 };
    RobotModel {
        name: "scr_db".into(),
        wheel_radii: 0.08.into(),
        track_width: 0.32,
        root_link: "base_link".into(),
        base_from_root: Isometry3::identity(),
        joints: vec![MovingJoint {
            name: "blade".into(),
            prismatic: false,
            lower: 0.0,
            upper: std::f64::consts::PI,
            limits: some(1.0),
        }],
        bodies: vec![
            Body { link: "base_link".into(), parent: 0, origin: Isometry3::identity(), motion: None },
            blade(1.0),
            blade(-1.0),
        ],
        shapes: vec![
            shape("base_link", 0, at(-0.09, 0.0, 0.14), Convex::Box { half: [0.21, 0.18, 0.11] }),
            shape("base_link", 0, at(-0.25, 0.0, 0.015), Convex::Sphere { radius: 0.015 }),
            shape("left_wheel", 0, wheel(0.16), cylinder()),
            shape("right_wheel", 0, wheel(-0.16), cylinder()),
            shape("left_blade", 1, at(0.0, 0.0, 0.18), Convex::Box { half: [0.05, 0.01, 0.18] }),
            shape("right_blade", 2, at(0.0, 0.0, 0.18), Convex::Box { half: [0.05, 0.01, 0.18] }),
        ],
        wheel: MotionLimits { speed: Some(0.5), acceleration: Some(0.5), jerk: Some(2.0) },
        base: BaseLimits {
            speed: 0.5,
            acceleration: 0.5,
            angular_speed: 0.3125,
            angular_acceleration: 1.5,
            eta: 0.1,
            min_speed: 0.01,
        },
        ignore_pairs: vec![],
        tolerance: None,
        links: Vec::new(),
    }
}

/// A box of 0.16 x 0.12 m, 0.2 m tall, its axis off its centre.
fn small_box() -> RobotModel {
    let mut robot = scr_db();
    robot.joints.clear();
    robot.bodies.truncate(1);
    robot.shapes = vec![Shape {
        link: "base_link".into(),
        body: 0,
        pose: Isometry3::translation(-0.02, 0.0, 0.1),
        convex: Convex::Box { half: [0.08, 0.06, 0.1] },
    }];
    robot
}

fn fill(map: &mut VoxelMap, low: [f64; 3], high: [f64; 3]) {
    let cell = |a: usize, v: f64| ((v - map.origin[a]) / map.resolution).round() as usize;
    let [lo, hi] = [low, high].map(|p| [cell(0, p[0]), cell(1, p[1]), cell(2, p[2])]);
    for i in lo[0]..hi[0] {
        for j in lo[1]..hi[1] {
            for k in lo[2]..hi[2] {
                map.occupy([i, j, k]);
            }
        }
    }
}

/// A room of 3 x 2 x 1 m with a wall at x = 1.4..1.6 that has an opening of the given width and height in its middle.
fn room_with_opening(width: f64, height: f64) -> VoxelMap {
    let mut map = VoxelMap::new(0.05, [0.0; 3], [60, 40, 20], Unknown::Occupied);
    fill(&mut map, [1.4, 0.0, 0.0], [1.6, 1.0 - width / 2.0, 1.0]);
    fill(&mut map, [1.4, 1.0 + width / 2.0, 0.0], [1.6, 2.0, 1.0]);
    fill(&mut map, [1.4, 0.0, height], [1.6, 2.0, 1.0]);
    map
}

fn across(joint: Option<f64>) -> Query {
    Query {
        start: Pose2::new(0.7, 1.0, 0.3),
        start_joints: vec![joint],
        goal: Pose2::new(2.4, 1.05, 0.0),
        goal_within: 0.0,
        goal_yaw: None,
        goal_joints: vec![None],
    }
}

fn find(map: &VoxelMap, robot: &RobotModel, query: &Query, clearance: f64) -> Result<SearchPath, SearchError> {
    search(map, &crate::esdf::build(map), robot, query, &SearchOptions { clearance, reverse: false })
}

/// Least distance of the robot from all occupied cubes at one state, by another library.
fn distance(map: &VoxelMap, robot: &RobotModel, pose: Pose2, joints: &[f64]) -> f64 {
    let mut least = f64::INFINITY;
    let half = 0.5 * map.resolution;
    let cube = Cuboid::new(Vector::new(half, half, half));
    for (shape, place) in robot.shapes.iter().zip(robot.shape_poses(joints)) {
        let lying = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
        // The library's cylinders stand along y.
        let (other, turn) = match &shape.convex {
            Convex::Box { half } => {
                (SharedShape::new(Cuboid::new(Vector::new(half[0], half[1], half[2]))), UnitQuaternion::identity())
            }
            Convex::Sphere { radius } => (SharedShape::new(Ball::new(*radius)), UnitQuaternion::identity()),
            Convex::Cylinder { radius, half_length } => (SharedShape::new(Cylinder::new(*half_length, *radius)), lying),
            Convex::Hull { .. } => unreachable!("no hull in these tests"),
        };
        let at = pose.isometry() * place * Isometry3::from_parts(Translation3::identity(), turn);
        let mut body = Pose::identity();
        body.translation = Vector::new(at.translation.x, at.translation.y, at.translation.z);
        body.rotation = Rotation::from_xyzw(at.rotation.i, at.rotation.j, at.rotation.k, at.rotation.w);
        let reach = shape.convex.bounding_radius() + 0.3;
        for cell in map.cells() {
            let centre: [f64; 3] = std::array::from_fn(|a| map.origin[a] + map.resolution * (cell[a] as f64 + 0.5));
            if (0..3).any(|a| (centre[a] - at.translation.vector[a]).abs() > reach) {
                continue;
            }
            let mut place = Pose::identity();
            place.translation = Vector::new(centre[0], centre[1], centre[2]);
            let found = query::distance(&body, other.as_ref(), &place, &cube).expect("supported shapes");
            least = least.min(found.distance);
        }
    }
    least
}

/// Least distance along a path, sampled.
fn distance_along(map: &VoxelMap, robot: &RobotModel, path: &SearchPath, parts: usize) -> f64 {
    let mut least = f64::INFINITY;
    for pair in path.states.windows(2) {
        for k in 0..=parts {
            let share = k as f64 / parts as f64;
            let mix = |a: f64, b: f64| a + share * (b - a);
            let [a, b] = [&pair[0], &pair[1]];
            let pose = Pose2::new(mix(a.pose.x, b.pose.x), mix(a.pose.y, b.pose.y), mix(a.pose.yaw, b.pose.yaw));
            let joints: Vec<f64> = a.joints.iter().zip(&b.joints).map(|(p, q)| mix(*p, *q)).collect();
            least = least.min(distance(map, robot, pose, &joints));
        }
    }
    least
}

#[test]
fn a_low_opening_is_crossed_lying_and_a_narrow_one_upright() {
    let robot = scr_db();
    for (map, upright) in [(room_with_opening(1.0, 0.45), false), (room_with_opening(0.6, 0.9), true)] {
        let path = find(&map, &robot, &across(None), 0.03).expect("there is a way");
        let inside = path.states.iter().filter(|s| (1.3..1.7).contains(&s.pose.x));
        for state in inside {
            assert_eq!(state.joints[0] < 1.3, upright, "{state:?}");
        }
        let least = distance_along(&map, &robot, &path, 12);
        assert!(least > 0.03 - 1e-3, "{least}");
        let end = &path.states[path.states.len() - 1];
        assert_eq!([end.pose.x, end.pose.y], [2.4, 1.05]);
        assert_eq!(path.moves.len() + 1, path.states.len());
    }
}

#[test]
fn what_does_not_fit_is_proven_absent_with_the_gap_that_is_there() {
    let robot = scr_db();
    // 0.40 m for a base of 0.36 m and 0.03 m on both sides.
    match find(&room_with_opening(0.4, 0.9), &robot, &across(None), 0.03) {
        Err(SearchError::Exhausted(absence)) => {
            let (radius, [x, _]) = absence.narrowest.expect("start and goal are on the map");
            assert!((radius - 0.2).abs() < 1e-3 && radius < absence.core, "{absence:?}");
            assert!((1.35..1.65).contains(&x), "{x}");
            // 2 cm on each side where 3 are asked for, wherever the base is in the opening.
            let tight = absence.tightest.as_ref().expect("a robot a little thinner gets through");
            assert!((1.2..2.0).contains(&tight.pose.x), "{tight:?}");
            assert!((tight.missing() - 0.01).abs() < 3e-3, "{tight:?}");
            assert!(absence.to_goal > 0.8 && absence.at_fault.is_none(), "{absence:?}");
        }
        other => panic!("{other:?}"),
    }
    // The same width is enough with less clearance.
    assert!(find(&room_with_opening(0.4, 0.9), &robot, &across(None), 0.015).is_ok());
    // Wide but lower than the robot in any posture (0.28 m).
    assert!(matches!(find(&room_with_opening(1.2, 0.25), &robot, &across(None), 0.03), Err(SearchError::Exhausted(_))));
}

#[test]
fn a_robot_too_wide_for_any_clearance_is_told_the_posture_and_how_much_is_missing() {
    let robot = scr_db();
    // 0.30 m for a base of 0.36 m: 3 cm too little on each side, and 3 cm of clearance.
    match find(&room_with_opening(0.3, 0.9), &robot, &across(None), 0.03) {
        Err(error @ SearchError::Exhausted(_)) => {
            let text = error.to_string();
            assert!(text.contains("link `base_link` is 0.0") && text.contains(", `blade` "), "{text}");
            let SearchError::Exhausted(absence) = &error else { unreachable!("matched above") };
            let tight = absence.tightest.as_ref().expect("a much thinner robot gets through");
            assert!((tight.missing() - 0.06).abs() < 4e-3, "{tight:?}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn the_end_that_is_shut_in_is_named() {
    let robot = small_box();
    let mut map = VoxelMap::new(0.05, [0.0; 3], [60, 40, 20], Unknown::Occupied);
    // A pen around the start, 0.5 m wide.
    for (low, high) in
        [([0.3, 0.3], [1.0, 0.4]), ([0.3, 0.9], [1.0, 1.0]), ([0.3, 0.3], [0.4, 1.0]), ([0.9, 0.3], [1.0, 1.0])]
    {
        fill(&mut map, [low[0], low[1], 0.0], [high[0], high[1], 0.5]);
    }
    let (pen, outside) = (Pose2::new(0.65, 0.65, 0.0), Pose2::new(2.4, 1.5, 0.0));
    let ask = |start: Pose2, goal: Pose2| Query {
        start,
        start_joints: vec![],
        goal,
        goal_within: 0.0,
        goal_yaw: Some(goal.yaw),
        goal_joints: vec![],
    };
    for (query, end) in [(ask(pen, outside), "start"), (ask(outside, pen), "goal")] {
        match find(&map, &robot, &query, 0.02) {
            Err(error @ SearchError::Exhausted(_)) => {
                assert_eq!(error.is_about_start(), end == "start");
                let text = error.to_string();
                assert!(text.contains(&format!("it is the {end} that is shut in")), "{text}");
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn a_blocked_goal_is_told_in_its_best_posture_with_the_nearest_free_pose() {
    let robot = scr_db();
    let mut map = VoxelMap::new(0.05, [0.0; 3], [60, 40, 20], Unknown::Occupied);
    fill(&mut map, [2.5, 0.9, 0.0], [2.6, 1.15, 0.2]);
    match find(&map, &robot, &across(None), 0.03) {
        Err(SearchError::GoalBlocked(blocked)) => {
            assert_eq!(blocked.posture.len(), 1, "{blocked:?}");
            let free = blocked.nearest.expect("the room is large");
            let goal = Pose2::new(2.4, 1.05, 0.0);
            assert!(free.distance(goal) < 0.5, "{blocked:?}");
            let query = Query { goal: free, goal_yaw: Some(free.yaw), ..across(None) };
            assert!(find(&map, &robot, &query, 0.03).is_ok(), "{blocked:?}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_blocked_start_is_told_with_the_link_the_obstacle_and_the_depth() {
    let robot = scr_db();
    let mut map = VoxelMap::new(0.05, [0.0; 3], [60, 40, 20], Unknown::Occupied);
    fill(&mut map, [0.7, 0.9, 0.0], [0.8, 1.1, 0.2]);
    match find(&map, &robot, &across(Some(0.0)), 0.03) {
        Err(error @ SearchError::StartBlocked(_)) => {
            let text = error.to_string();
            assert!(text.contains("in collision: link `base_link`") && text.contains("m deep"), "{text}");
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn the_start_and_goal_postures_asked_for_are_kept_exactly() {
    let robot = scr_db();
    let map = VoxelMap::new(0.05, [0.0; 3], [60, 40, 20], Unknown::Occupied);
    let query = Query { goal_joints: vec![Some(0.123)], ..across(Some(1.7)) };
    let path = find(&map, &robot, &query, 0.03).expect("an empty room");
    assert_eq!(path.states[0].joints, [1.7]);
    assert_eq!(path.states[path.states.len() - 1].joints, [0.123]);
    assert_eq!(path.states[0].pose, query.start);
}

/// A bar slides out sideways into a slot that it fits at the goal alone: it does so where the robot stands, and not before.
#[test]
fn a_posture_that_is_free_at_the_goal_alone_is_taken_up_there() {
    let mut robot = small_box();
    let limits = MotionLimits { speed: Some(0.5), acceleration: Some(1.0), jerk: Some(5.0) };
    robot.joints = vec![MovingJoint { name: "bar".into(), prismatic: true, lower: 0.0, upper: 0.4, limits }];
    let slides = BodyMotion { joint: 0, multiplier: 1.0, offset: 0.0, axis: Vector3::y_axis(), prismatic: true };
    let origin = Isometry3::translation(0.0, 0.0, 0.4);
    robot.bodies.push(Body { link: "bar".into(), parent: 0, origin, motion: Some(slides) });
    let convex = Convex::Box { half: [0.03, 0.1, 0.03] };
    robot.shapes.push(Shape { link: "bar".into(), body: 1, pose: Isometry3::identity(), convex });
    let mut map = VoxelMap::new(0.05, [0.0; 3], [60, 40, 20], Unknown::Occupied);
    for x in [[1.5, 1.9], [2.1, 2.5]] {
        fill(&mut map, [x[0], 1.3, 0.3], [x[1], 1.5, 0.5]);
    }
    let query = Query {
        goal: Pose2::new(2.0, 1.0, 0.0),
        goal_yaw: Some(0.0),
        goal_joints: vec![Some(0.4)],
        ..across(Some(0.0))
    };
    let there = find(&map, &robot, &query, 0.03).expect("there is a way");
    assert_eq!(there.expanded, 0, "the straight way will do");
    let (start, goal) = (query.goal, Pose2::new(2.7, 1.0, 0.0));
    let on = Query { start, start_joints: vec![Some(0.4)], goal, goal_joints: vec![Some(0.0)], ..query };
    assert_eq!(find(&map, &robot, &on, 0.03).expect("out of it again").expanded, 0);
}

#[test]
fn a_goal_straight_behind_is_backed_up_to_where_that_is_allowed() {
    let robot = scr_db();
    let map = VoxelMap::new(0.05, [0.0; 3], [60, 40, 20], Unknown::Occupied);
    let esdf = crate::esdf::build(&map);
    let goal = Pose2::new(0.9, 1.0, 0.0);
    let query = Query { start: Pose2::new(1.7, 1.0, 0.0), goal, goal_yaw: Some(0.0), ..across(None) };
    let moves = |reverse| {
        let path =
            search(&map, &esdf, &robot, &query, &SearchOptions { clearance: 0.03, reverse }).expect("an empty room");
        path.moves
    };
    assert!(moves(true).iter().all(|m| *m == SearchMove::Reverse), "{:?}", moves(true));
    assert!(moves(false).iter().all(|m| *m != SearchMove::Reverse));
}

/// Where a path ends, from the query's goal, m.
fn off_goal(path: &SearchPath, query: &Query) -> f64 {
    path.states[path.states.len() - 1].pose.distance(query.goal)
}

#[test]
fn a_goal_of_any_place_within_a_radius_is_reached_at_its_near_rim() {
    let robot = scr_db();
    let map = room_with_opening(1.0, 0.45);
    let exact = find(&map, &robot, &across(None), 0.03).expect("there is a way");
    let query = Query { goal_within: 0.4, ..across(None) };
    let path = find(&map, &robot, &query, 0.03).expect("there is a way");
    let off = off_goal(&path, &query);
    assert!(off < 0.4 && off > 0.39, "{off}");
    assert!((exact.length() - path.length() - 0.4).abs() < 0.05, "{} {}", exact.length(), path.length());
    // A heading that is asked for is kept there.
    let query = Query { goal_yaw: Some(1.0), goal_joints: vec![Some(0.5)], ..query };
    let path = find(&map, &robot, &query, 0.03).expect("there is a way");
    let end = &path.states[path.states.len() - 1];
    assert!(off_goal(&path, &query) < 0.4 && crate::geom::wrap_angle(end.pose.yaw - 1.0).abs() < 1e-9);
    assert_eq!(end.joints, [0.5]);
    // Who is there already stays.
    let query = Query { goal_within: 2.0, ..across(None) };
    assert_eq!(find(&map, &robot, &query, 0.03).expect("there").length(), 0.0);
}

#[test]
fn a_region_whose_middle_is_blocked_is_reached_where_it_is_free() {
    let robot = small_box();
    let mut map = VoxelMap::new(0.05, [0.0; 3], [60, 40, 20], Unknown::Occupied);
    fill(&mut map, [2.0, 0.8, 0.0], [2.6, 1.4, 0.5]);
    // The near side is blocked too: what is free lies behind the block.
    fill(&mut map, [1.7, 0.3, 0.0], [2.0, 1.9, 0.5]);
    for goal_yaw in [None, Some(0.5)] {
        let query = Query {
            start: Pose2::new(0.7, 1.0, 0.3),
            start_joints: vec![],
            goal: Pose2::new(2.3, 1.1, goal_yaw.unwrap_or(0.0)),
            goal_within: 0.52,
            goal_yaw,
            goal_joints: vec![],
        };
        assert!(matches!(
            find(&map, &robot, &Query { goal_within: 0.0, ..query.clone() }, 0.02),
            Err(SearchError::GoalBlocked(_))
        ));
        let path = find(&map, &robot, &query, 0.02).expect("there is room behind the block");
        assert!(off_goal(&path, &query) <= 0.52);
        assert!(distance_along(&map, &robot, &path, 12) > 0.02 - 1e-3);
        // A radius within which the robot fits nowhere.
        match find(&map, &robot, &Query { goal_within: 0.3, ..query }, 0.02) {
            Err(error @ SearchError::OfRegion { .. }) => {
                let text = crate::diag::Describe::diagnostic(&error);
                assert_eq!(text.code, "search/goal-blocked");
                assert!(text.message.ends_with("the goal is any place within 0.3 m of (2.300, 1.100)"), "{text:?}");
            }
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn that_no_place_of_a_region_can_be_reached_is_proven() {
    let robot = small_box();
    let mut map = VoxelMap::new(0.05, [0.0; 3], [60, 40, 20], Unknown::Occupied);
    fill(&mut map, [1.4, 0.0, 0.0], [1.6, 2.0, 0.5]);
    let query = Query { start_joints: vec![], goal_joints: vec![], goal_within: 0.3, ..across(None) };
    match find(&map, &robot, &query, 0.02) {
        Err(error @ SearchError::OfRegion { .. }) => {
            let fault = crate::diag::Describe::diagnostic(&error);
            assert_eq!(fault.code, "search/no-way");
            assert!(fault.message.contains("closed off even for a point"), "{fault:?}");
        }
        other => panic!("{other:?}"),
    }
    // One that reaches through the wall is reached on this side of it.
    let query = Query { goal_within: 1.4, ..query };
    let path = find(&map, &robot, &query, 0.02).expect("part of it is here");
    assert!(off_goal(&path, &query) <= 1.4 && path.states.iter().all(|s| s.pose.x < 1.4));
}

/// Whether a lattice state is reached by plain breadth-first search with every move sampled.
fn reachable(map: &VoxelMap, robot: &RobotModel, from: LatticeState, to: LatticeState, clearance: f64) -> bool {
    let lattice = Lattice::new(map);
    let bounds = map.bounds();
    let mut known = std::collections::HashMap::new();
    let mut free = |pose: Pose2| {
        let key = [
            (pose.x * 1e6).round() as i64,
            (pose.y * 1e6).round() as i64,
            (pose.yaw.rem_euclid(std::f64::consts::TAU) * 1e6).round() as i64,
        ];
        *known.entry(key).or_insert_with(|| {
            let (sin, cos) = real::sin_cos(pose.yaw);
            let inside = [(-0.1, -0.06), (-0.1, 0.06), (0.06, -0.06), (0.06, 0.06)].iter().all(|(x, y)| {
                let p = [pose.x + cos * x - sin * y, pose.y + sin * x + cos * y];
                (0..2).all(|a| p[a] >= bounds.min[a] + clearance && p[a] <= bounds.max[a] - clearance)
            });
            inside && distance(map, robot, pose, &[]) >= clearance
        })
    };
    let mut along = |from: Pose2, to: Pose2| {
        (0..=2).all(|k| {
            let share = f64::from(k) / 2.0;
            let mix = |a: f64, b: f64| a + share * (b - a);
            free(Pose2::new(mix(from.x, to.x), mix(from.y, to.y), mix(from.yaw, to.yaw)))
        })
    };
    let mut seen = std::collections::HashSet::from([from]);
    let mut queue = vec![from];
    while let Some(state) = queue.pop() {
        if state == to {
            return true;
        }
        let pose = lattice.pose(state);
        let turn = std::f64::consts::TAU / HEADINGS as f64;
        for sign in [1, -1] {
            let next = LatticeState { heading: (state.heading + sign).rem_euclid(HEADINGS as i32), ..state };
            if !seen.contains(&next) && along(pose, Pose2 { yaw: pose.yaw + f64::from(sign) * turn, ..pose }) {
                seen.insert(next);
                queue.push(next);
            }
        }
        for drive in lattice.drives(state.heading) {
            let next = LatticeState { i: state.i + drive.di, j: state.j + drive.dj, ..state };
            if seen.contains(&next) || !lattice.contains(next.i, next.j) {
                continue;
            }
            let out = Pose2 { yaw: crate::geom::unwrap_near(drive.direction, pose.yaw), ..pose };
            let [x, y] = lattice.position(next.i, next.j);
            let there = Pose2::new(x, y, out.yaw);
            if along(pose, out) && along(out, there) && along(there, Pose2 { yaw: pose.yaw, ..there }) {
                seen.insert(next);
                queue.push(next);
            }
        }
    }
    false
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(10))]
    #[test]
    fn it_finds_whatever_plain_breadth_first_search_reaches_and_nothing_that_collides(
        cells in prop::collection::vec((0usize..8, 0usize..8), 2..14), ends in (3i32..13, 3i32..13, 0i32..72, 3i32..13, 3i32..13, 0i32..72),
    ) {
        let mut map = VoxelMap::new(0.1, [0.0; 3], [8, 8, 2], Unknown::Occupied);
        cells.iter().for_each(|(i, j)| map.occupy([*i, *j, 0]));
        let robot = small_box();
        let lattice = Lattice::new(&map);
        let from = LatticeState { i: ends.0, j: ends.1, heading: ends.2 };
        let to = LatticeState { i: ends.3, j: ends.4, heading: ends.5 };
        let (start, goal) = (lattice.pose(from), lattice.pose(to));
        let query = Query { start, start_joints: vec![], goal, goal_within: 0.0, goal_yaw: Some(goal.yaw), goal_joints: vec![] };
        let clearance = 0.012;
        prop_assume!(distance(&map, &robot, start, &[]) > clearance + 0.003 && distance(&map, &robot, goal, &[]) > clearance + 0.003);
        match find(&map, &robot, &query, clearance) {
            Ok(path) => {
                let least = distance_along(&map, &robot, &path, 8);
                prop_assert!(least > clearance - 1.5e-3, "{}", least);
            }
            Err(SearchError::Exhausted(_)) => {
                prop_assert!(!reachable(&map, &robot, from, to, clearance + 0.002), "a way exists");
            }
            // The start or goal box reaches beyond the map.
            Err(SearchError::StartBlocked(_) | SearchError::GoalBlocked(_)) => {}
            Err(other) => prop_assert!(false, "{}", other),
        }
    }
}

/// A round base with a serial arm of so many joints, z and y by turns, each link a rod of 0.2 m.
pub(super) fn arm(joints: usize) -> RobotModel {
    let mut robot = small_box();
    let limits = MotionLimits { speed: Some(1.0), acceleration: Some(2.0), jerk: Some(10.0) };
    let joint = |k: usize| MovingJoint { name: format!("j{k}"), prismatic: false, lower: -2.4, upper: 2.4, limits };
    robot.joints = (0..joints).map(joint).collect();
    for k in 0..joints {
        let axis = if k % 2 == 0 { Vector3::z_axis() } else { Vector3::y_axis() };
        let link = format!("link {k}");
        robot.bodies.push(Body {
            link: link.clone(),
            parent: k,
            origin: Isometry3::translation(0.0, 0.0, 0.2),
            motion: Some(BodyMotion { joint: k, multiplier: 1.0, offset: 0.0, axis, prismatic: false }),
        });
        robot.shapes.push(Shape {
            link,
            body: k + 1,
            pose: Isometry3::translation(0.0, 0.0, 0.11),
            convex: Convex::Cylinder { radius: 0.02, half_length: 0.08 },
        });
    }
    robot
}

#[test]
fn an_arm_folds_to_pass_a_low_opening_and_ends_in_the_posture_asked_for() {
    let robot = arm(4);
    let map = room_with_opening(0.6, 0.75);
    let upright = vec![Some(0.0); 4];
    let bent = vec![Some(0.5), Some(0.8), Some(0.0), Some(0.3)];
    let query = Query { start_joints: upright, goal_joints: bent.clone(), ..across(None) };
    // Upright it is 1 m tall.
    let path = find(&map, &robot, &query, 0.02).expect("it can fold");
    assert_eq!(path.states[0].joints, [0.0; 4]);
    let last = &path.states[path.states.len() - 1];
    assert_eq!(last.joints.iter().copied().map(Some).collect::<Vec<_>>(), bent);
    let folded = path.states.iter().filter(|state| (1.4..1.6).contains(&state.pose.x));
    for state in folded {
        assert!(robot.extents(&state.joints).max[2] <= 0.75 - 0.02 + 1e-9, "{state:?}");
    }
}
