use nalgebra::Isometry3;

use super::*;
use crate::certify::Task;
use crate::certify::tests::robots::{bare_robot, commands, with_shape};
use crate::command::CommandTable;
use crate::mission::Unknown;
use crate::robot::Convex;

/// A box of 0.4 m along x and y.
fn robot() -> RobotModel {
    with_shape(bare_robot(), 0, Isometry3::translation(0.0, 0.0, 0.2), Convex::Box { half: [0.2, 0.2, 0.1] })
}

/// A wall whose face is at x = 1, 2 m wide; the map ends at x = 2.
fn wall() -> VoxelMap {
    let mut map = VoxelMap::new(0.1, [-2.0, -2.0, 0.0], [40, 40, 5], Unknown::Free);
    (10..30).for_each(|j| (0..5).for_each(|k| map.occupy([30, j, k])));
    map
}

/// Rows of half a second at 0.4 m/s, forward or backwards, from x.
fn drive(robot: &RobotModel, x: f64, forward: &[bool]) -> (CommandTable, Task) {
    let held: Vec<_> = forward.iter().map(|forward| (if *forward { 0.4 } else { -0.4 }, 0.0, vec![])).collect();
    commands(robot, Pose2::new(x, 0.0, 0.0), &[], 0.5, &held)
}

/// Looks once at the first row.
fn first_look<T>(x: f64, forward: bool, map: &VoxelMap, see: impl Fn(&Search<'_>, usize) -> T) -> T {
    let robot = robot();
    let (table, task) = drive(&robot, x, &[forward]);
    let rollout = Rollout::new(&table, task.start, &[]);
    let mut search = Search::new(&rollout, &robot, map, 0.05, None);
    search.reach = 1.6;
    let (mut left, mut boxes) = (Vec::new(), Vec::new());
    search.whole_row(0, &mut left, &mut boxes);
    see(&search, left.len())
}

#[test]
fn the_first_look_at_a_row_finds_the_distance_at_its_end_or_where_it_comes_from() {
    let edge = VoxelMap::new(0.1, [-9.0, -9.0, 0.0], [100, 180, 5], Unknown::Occupied); // beyond x = 1
    for map in [&wall(), &edge] {
        // The row leads 0.2 m forward, to a distance of 0.1 m, or comes from there.
        for (x, forward, time) in [(0.5, true, 0.5), (0.7, false, 0.0)] {
            let (least, at, left) = first_look(x, forward, map, |s, left| (s.least, s.witness.unwrap().tau, left));
            assert!((least - 0.1).abs() < 1e-6 && at == time && left == 0, "{least} at {at}, {left} intervals left");
        }
        // 5 cm into it at the end, and free until 0.375 s.
        let least = first_look(0.65, true, map, |s, _| s.least);
        assert!((least + 0.05).abs() < 1e-9, "{least}");
    }
}

#[test]
fn the_deepest_point_of_a_drive_into_a_wall_and_back_is_found_between_two_rows() {
    let robot = robot();
    let (table, task) = drive(&robot, 0.65, &[true, false]);
    let rollout = Rollout::new(&table, task.start, &[]);
    let found = clearance(&rollout, &robot, &wall(), 0.05, None);
    let closest = found.closest.unwrap();
    assert!((closest.distance + 0.05).abs() < 1e-9 && closest.time == 0.5, "{closest:?}");
    assert_eq!(found.proven, 0.0);
}

#[test]
fn the_last_row_counts_when_it_begins_and_not_after() {
    let robot = robot();
    let (mut table, task) = drive(&robot, 0.2, &[true, true]);
    table.rows.pop(); // at rest
    let rollout = Rollout::new(&table, task.start, &[]);
    let found = clearance(&rollout, &robot, &wall(), 0.05, None);
    assert!((found.closest.unwrap().distance - 0.4).abs() < 1e-6);
}

#[test]
fn a_search_that_has_done_its_work_refuses_what_is_not_proven() {
    let robot = robot();
    // Two metres in one row, past a post 10 cm beside the way: no plane at the row's middle shows that.
    let (table, task) = commands(&robot, Pose2::new(-0.8, 0.0, 0.0), &[], 1.0, &[(2.0, 0.0, vec![])]);
    let rollout = Rollout::new(&table, task.start, &[]);
    let mut map = VoxelMap::new(0.1, [-2.0, -2.0, 0.0], [40, 40, 5], Unknown::Free);
    map.occupy([30, 23, 2]);
    let judged = |patience: u64| {
        let mut search = Search::new(&rollout, &robot, &map, 0.05, None);
        (search.patience, search.reach) = (patience, 0.4);
        search.run();
        (search.verdict(0.05), search.least)
    };
    let (patient, least) = judged(WORK);
    assert!(patient.refusal.is_none() && (least - 0.1).abs() < 1e-3, "{:?} {least}", patient.refusal);
    let (hasty, _) = judged(0);
    let message = hasty.refusal.expect("not all is proven").message;
    assert!(hasty.proven < 0.05 && message.contains("could not be proven"), "{message}");
}

/// Coordinates of 20 000 rows so far away are known to some 1e-5 m.
#[test]
fn an_obstacle_that_only_rounding_keeps_away_is_not_overlooked() {
    let far = 524_288.0;
    let robot = with_shape(bare_robot(), 0, Isometry3::translation(0.0, 0.0, 0.5), Convex::Box { half: [0.25; 3] });
    let mut map = VoxelMap::new(0.125, [far, far, 0.0], [64, 64, 8], Unknown::Free);
    map.occupy([38, 32, 4]); // half a metre before the box
    let (mut table, task) = commands(&robot, Pose2::new(far + 4.0, far + 4.0, 0.0), &[], 0.1, &[]);
    table.rows = vec![table.rows[0].clone(); 20_000];
    let rollout = Rollout::new(&table, task.start, &[]);
    let rounding = Search::new(&rollout, &robot, &map, 0.5, None).rounding;
    assert!(rounding > 1e-5 && rounding < 1e-4, "{rounding}");
    for (required, holds) in [(0.5 - 1.5 * rounding, true), (0.5 - 0.5 * rounding, false)] {
        let mut search = Search::new(&rollout, &robot, &map, required, None);
        search.reach = required;
        search.halve(Vec::new(), Vec::new());
        let (mut left, mut boxes) = (Vec::new(), Vec::new());
        search.whole_row(0, &mut left, &mut boxes);
        assert_eq!(search.unproven == f64::INFINITY && left.is_empty(), holds, "{}", search.unproven);
    }
}

#[test]
fn boxes_are_as_far_apart_as_their_nearest_faces_edges_or_corners() {
    let unit = Aabb { min: [0.0; 3], max: [1.0; 3] };
    let at = |min: [f64; 3]| Aabb { min, max: min.map(|x| x + 2.0) };
    for (min, expected) in [
        ([1.5, 0.0, 0.0], 0.5),
        ([-2.5, 0.0, 0.0], 0.5),
        ([4.0, 0.2, 5.0], 5.0),
        ([3.0, -4.0, 2.0], 3.0),
        ([1.0, 1.0, 1.0], 0.0),
        ([-0.5, -0.5, -0.5], 0.0),
    ] {
        assert!((gap(&unit, &at(min)) - expected).abs() < 1e-15, "{min:?}");
        assert!((gap(&at(min), &unit) - expected).abs() < 1e-15, "{min:?}");
    }
}

#[test]
fn of_several_cells_that_a_shape_meets_the_one_nearest_to_its_middle_is_named() {
    let robot = robot();
    let map = wall();
    let (table, task) = commands(&robot, Pose2::new(1.0, 0.13, 0.0), &[], 0.1, &[]);
    let rollout = Rollout::new(&table, task.start, &[]);
    let closest = clearance(&rollout, &robot, &map, 0.05, None).closest.unwrap();
    // y from 0.1 to 0.2 and z from 0.1 or 0.2: the shape's middle is at y = 0.13, z = 0.2.
    let cell = closest.obstacle.unwrap();
    assert!((cell.min[1] - 0.1).abs() < 1e-9 && cell.min[2] < 0.201 && cell.max[2] > 0.199, "{cell:?}");
}

#[test]
fn a_refusal_says_what_is_near_how_near_and_how_much_is_asked_for() {
    let robot = robot();
    let says = |map: &VoxelMap, x: f64, required: f64| {
        let (table, task) = drive(&robot, x, &[true]);
        let rollout = Rollout::new(&table, task.start, &[]);
        clearance(&rollout, &robot, map, required, None).refusal.expect("too near").message
    };
    let near = says(&wall(), 0.5, 0.15);
    assert!(near.starts_with("`link_0` comes within 0.1000 m of the occupied cell [1.000, 1.100] x ["), "{near}");
    assert!(near.ends_with("at t = 0.500 s; 0.1500 m required"), "{near}");
    let edge = VoxelMap::new(0.1, [-1.0, -2.0, 0.0], [20, 40, 5], Unknown::Occupied);
    let beyond = says(&edge, 0.5, 0.15);
    assert!(beyond.contains("comes within 0.1000 m of unseen space beyond the map at t = "), "{beyond}");
    assert!(says(&edge, 0.65, 0.15).contains("is about 0.050 m deep in unseen space beyond the map"));
}
