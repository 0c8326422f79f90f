use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;

use super::robots::*;
use crate::certify::{Certificate, RefusalKind, Task, certify, distances};
use crate::command::CommandTable;
use crate::geom::Pose2;
use crate::map::VoxelMap;
use crate::mission::Unknown;
use crate::robot::{Convex, RobotModel};

fn refuses_clearance(certificate: &Certificate) -> bool {
    certificate.refusals.iter().any(|r| r.kind == RefusalKind::Clearance)
}

/// The distance of the closest approach that a certificate names, measured anew.
fn measured(table: &CommandTable, robot: &RobotModel, map: &VoxelMap, certificate: &Certificate) -> f64 {
    let closest = certificate.closest.as_ref().unwrap();
    let row = ((closest.time / table.sampling_time) as usize).min(table.rows.len() - 1);
    let shape = robot.shapes.iter().position(|s| s.link == closest.link).unwrap();
    distance_at(table, robot, map, (row, closest.time - table.time(row)), shape)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn distances_at_instants_are_the_true_ones(
        robot in any_robot(), map in any_map(), (start, values, step, held) in any_motion(), reach in 0.05..1.5f64, every in 1..3usize,
    ) {
        let (values, held) = cut(&robot, &values, &held);
        let (table, _) = commands(&robot, start, &values, step, &held);
        let found = distances(&table, &robot, &map, (start, &values), every, reach);
        let last = table.rows.len() - 1;
        let rows: Vec<usize> = (0..last).step_by(every).chain([last]).collect();
        prop_assert_eq!(found.len(), rows.len());
        for (instant, row) in found.iter().zip(rows) {
            let each = (0..robot.shapes.len()).map(|shape| distance_at(&table, &robot, &map, (row, 0.0), shape));
            let truth = each.fold(f64::INFINITY, f64::min);
            prop_assert_eq!(instant.time, table.time(row));
            match instant.distance {
                far if far == f64::INFINITY => prop_assert!(truth > reach - 1e-6, "{truth}"),
                near if near > 1e-6 => prop_assert!((near - truth).abs() < 1e-6 && near <= reach, "{near} {truth}"),
                overlap => prop_assert!(truth < 2e-6, "{overlap} {truth}"),
            }
        }
    }

    #[test]
    fn the_clearance_proven_is_the_true_one(
        robot in any_robot(), map in any_map(), (start, values, step, held) in any_motion(), required in 0.0..0.2f64,
    ) {
        let (values, held) = cut(&robot, &values, &held);
        let (table, mut task) = commands(&robot, start, &values, step, &held);
        task.clearance = required;
        let certificate = certify(&table, &robot, Some(&map), &task);
        let proven = certificate.clearance_proven.unwrap();
        let truth = sampled(&table, &robot, &map, 12);
        prop_assert!(proven <= truth + 1e-9, "proven {proven}, sampled {truth}");
        prop_assert_eq!(certificate.holds(), !refuses_clearance(&certificate), "{:?}", certificate.refusals);
        if certificate.holds() {
            prop_assert!(proven >= required && proven > 0.0);
        }
        match &certificate.closest {
            Some(closest) if closest.distance > 0.0 => {
                let real = measured(&table, &robot, &map, &certificate);
                prop_assert!((real - closest.distance).abs() < 1e-6, "{real} {closest:?}");
                prop_assert!(proven >= closest.distance.min(1.6) - 1e-3, "{proven} {closest:?}");
                prop_assert_eq!(certificate.holds(), closest.distance >= required);
            }
            Some(closest) => {
                let real = measured(&table, &robot, &map, &certificate);
                prop_assert!(real < 1e-8, "{real} {closest:?}");
                prop_assert!(!certificate.holds() && proven == 0.0);
            }
            None => prop_assert!(proven >= 1.6),
        }
    }

    #[test]
    fn near_the_requirement_only_what_keeps_it_passes(
        robot in any_robot(), map in any_map(), (start, values, step, held) in any_motion(), off in -1e-3..1e-3f64,
    ) {
        let (values, held) = cut(&robot, &values, &held);
        let (table, mut task) = commands(&robot, start, &values, step, &held);
        task.clearance = 0.0;
        let Some(closest) = certify(&table, &robot, Some(&map), &task).closest else { return Ok(()) };
        if closest.distance < 2e-3 {
            return Ok(());
        }
        for off in [off, 0.1 * off, 0.01 * off] {
            task.clearance = closest.distance + off;
            let certificate = certify(&table, &robot, Some(&map), &task);
            let least = certificate.closest.as_ref().unwrap().distance;
            if certificate.holds() {
                prop_assert!(task.clearance <= closest.distance && certificate.clearance_proven.unwrap() >= task.clearance);
                prop_assert!(sampled(&table, &robot, &map, 12) >= task.clearance);
            } else if least >= task.clearance {
                prop_assert!(least - task.clearance < 1e-5, "{least} {}", task.clearance);
            } else {
                prop_assert!(measured(&table, &robot, &map, &certificate) < task.clearance);
            }
        }
    }
}

/// A base of one box, 0.4 x 0.4 x 0.2 m, its middle 0.2 m up.
fn box_robot() -> RobotModel {
    with_shape(bare_robot(), 0, Isometry3::translation(0.0, 0.0, 0.2), Convex::Box { half: [0.2, 0.2, 0.1] })
}

/// 10 x 10 x 0.5 m in cells of 5 cm, x and y from -5.
fn wide_map(outside: Unknown) -> VoxelMap {
    VoxelMap::new(0.05, [-5.0, -5.0, 0.0], [200, 200, 10], outside)
}

fn post(map: &mut VoxelMap, cell: [usize; 2]) {
    (0..map.dims[2]).for_each(|k| map.occupy([cell[0], cell[1], k]));
}

fn judge(robot: &RobotModel, map: &VoxelMap, commands: &(CommandTable, Task), required: f64) -> Certificate {
    certify(&commands.0, robot, Some(map), &Task { clearance: required, ..commands.1.clone() })
}

#[test]
fn a_straight_drive_past_a_post_has_the_clearance_of_the_closed_form() {
    let robot = box_robot();
    let mut map = wide_map(Unknown::Free);
    post(&mut map, [120, 106]); // y from 0.30 to 0.35
    let drive = commands(&robot, Pose2::default(), &[], 0.1, &vec![(0.5, 0.0, vec![]); 50]);
    for (required, holds) in [(0.0999, true), (0.09999, true), (0.10001, false), (0.1001, false), (0.05, true)] {
        let certificate = judge(&robot, &map, &drive, required);
        assert_eq!(certificate.holds(), holds, "{required}: {:?}", certificate.refusals);
        let proven = certificate.clearance_proven.unwrap();
        assert!((0.099..=0.1).contains(&proven), "{proven}");
    }
    let obstacle = judge(&robot, &map, &drive, 0.05).closest.unwrap().obstacle.unwrap();
    assert!(
        (obstacle.min[0] - 1.0).abs() < 1e-9 && (obstacle.max[2] - obstacle.min[2] - 0.05).abs() < 1e-9,
        "{obstacle:?}"
    );
}

#[test]
fn a_post_between_two_samples_of_a_fast_arc_is_found() {
    // One row: a half circle of radius 1 m in 1 s about (0, 1). The post is on the arc's middle, far from start and end.
    let robot = with_shape(bare_robot(), 0, Isometry3::translation(0.0, 0.0, 0.2), Convex::Sphere { radius: 0.1 });
    let mut map = wide_map(Unknown::Free);
    let pi = std::f64::consts::PI;
    let drive = commands(&robot, Pose2::default(), &[], 1.0, &[(pi, pi, vec![])]);
    assert!(judge(&robot, &map, &drive, 0.5).holds());
    post(&mut map, [119, 119]); // from (0.95, 0.95) to (1.00, 1.00)
    let certificate = judge(&robot, &map, &drive, 0.0);
    let closest = certificate.closest.clone().unwrap();
    assert!(refuses_clearance(&certificate) && closest.distance <= 0.0);
    assert!((closest.time - 0.5).abs() < 0.05, "{closest:?}");
    assert!(certificate.refusals[0].message.contains("deep"), "{}", certificate.refusals[0].message);
}

#[test]
fn a_blade_that_sweeps_over_a_post_while_the_base_stands_is_found() {
    // A blade of 1 m turns a quarter during one row; before and after it is clear of the post at 45 degrees.
    let mut robot = with_joint(box_robot(), false);
    robot = with_body(robot, 0, Isometry3::translation(0.0, 0.0, 0.4), [0.0, 0.0, 1.0], (0, 1.0, 0.0));
    robot = with_shape(robot, 1, Isometry3::translation(0.5, 0.0, 0.0), Convex::Box { half: [0.5, 0.02, 0.02] });
    let mut map = wide_map(Unknown::Free);
    let sweep = commands(&robot, Pose2::default(), &[0.0], 0.5, &[(0.0, 0.0, vec![std::f64::consts::PI])]);
    assert!(judge(&robot, &map, &sweep, 0.05).holds());
    map.occupy([112, 112, 8]); // near (0.6, 0.6), z from 0.40 to 0.45
    let certificate = judge(&robot, &map, &sweep, 0.0);
    assert!(refuses_clearance(&certificate));
    let closest = certificate.closest.unwrap();
    assert_eq!(closest.link, "link_1");
    assert!((closest.time - 0.25).abs() < 0.05 && closest.obstacle == Some(map.cube([112, 112, 8])));
}

#[test]
fn a_blade_passes_over_and_under_by_the_closed_form() {
    let mut robot = with_joint(bare_robot(), true);
    robot = with_body(robot, 0, Isometry3::identity(), [0.0, 0.0, 1.0], (0, -1.0, 1.0)); // mimic: height 1 - q
    robot = with_shape(robot, 1, Isometry3::identity(), Convex::Cylinder { radius: 0.2, half_length: 0.05 });
    let mut map = wide_map(Unknown::Free);
    map.occupy([100, 100, 4]); // z from 0.20 to 0.25
    let lower = commands(&robot, Pose2::default(), &[0.0], 0.1, &vec![(0.0, 0.0, vec![0.5]); 12]); // to 0.4 m: gap 0.1 m
    assert!(judge(&robot, &map, &lower, 0.0999).holds());
    assert!(!judge(&robot, &map, &lower, 0.1001).holds());
}

#[test]
fn the_edge_of_the_map_is_an_obstacle_where_unseen_space_is() {
    let robot = box_robot();
    let drive = commands(&robot, Pose2::new(4.0, 0.0, 0.0), &[], 0.1, &vec![(0.5, 0.0, vec![]); 15]); // front to 4.95
    let certificate = judge(&robot, &wide_map(Unknown::Occupied), &drive, 0.0501);
    assert!(refuses_clearance(&certificate));
    let closest = certificate.closest.unwrap();
    assert_eq!(closest.obstacle, None);
    assert!((closest.distance - 0.05).abs() < 1e-9 && (closest.time - 1.5).abs() < 1e-9, "{closest:?}");
    assert!(judge(&robot, &wide_map(Unknown::Occupied), &drive, 0.0499).holds());
    assert!(judge(&robot, &wide_map(Unknown::Free), &drive, 0.5).holds());
    let beyond = commands(&robot, Pose2::new(40.0, 0.0, 0.0), &[], 0.1, &[(0.5, 0.0, vec![])]);
    assert!(refuses_clearance(&judge(&robot, &wide_map(Unknown::Occupied), &beyond, 0.0)));
    assert!(judge(&robot, &wide_map(Unknown::Free), &beyond, 0.0).holds());
}

#[test]
fn above_and_below_the_map_is_free() {
    let robot = with_shape(bare_robot(), 0, Isometry3::translation(0.0, 0.0, 2.0), Convex::Sphere { radius: 0.3 });
    let stand = commands(&robot, Pose2::default(), &[], 0.1, &[]);
    assert!(judge(&robot, &wide_map(Unknown::Occupied), &stand, 0.5).holds());
}

#[test]
fn an_obstacle_inside_a_shape_and_a_shape_inside_an_obstacle_are_collisions() {
    let robot = with_shape(bare_robot(), 0, Isometry3::translation(0.0, 0.0, 0.25), Convex::Sphere { radius: 0.8 });
    let stand = commands(&robot, Pose2::default(), &[], 0.1, &[(0.0, 0.0, vec![])]);
    let mut map = wide_map(Unknown::Free);
    map.occupy([102, 101, 5]);
    let certificate = judge(&robot, &map, &stand, 0.0);
    assert!(refuses_clearance(&certificate) && certificate.clearance_proven == Some(0.0));

    let small = with_shape(bare_robot(), 0, Isometry3::translation(0.0, 0.0, 0.25), Convex::Box { half: [0.01; 3] });
    for i in 90..110 {
        (90..110).for_each(|j| post(&mut map, [i, j]));
    }
    let drive = commands(&small, Pose2::default(), &[], 0.1, &[(0.1, 0.0, vec![])]);
    let closest = judge(&small, &map, &drive, 0.0).closest.unwrap();
    assert!(closest.distance < -0.1, "{closest:?}");
}

#[test]
fn touching_is_not_clearance_even_where_none_is_required() {
    let robot = box_robot();
    let mut map = wide_map(Unknown::Free);
    post(&mut map, [104, 100]); // x from 0.20: the box's front
    let stand = commands(&robot, Pose2::default(), &[], 0.1, &[]);
    assert!(refuses_clearance(&judge(&robot, &map, &stand, 0.0)));
}

#[test]
fn far_from_everything_the_reach_is_reported() {
    let robot = box_robot();
    let drive = commands(&robot, Pose2::default(), &[], 0.1, &[(0.5, 0.3, vec![])]);
    let certificate = judge(&robot, &wide_map(Unknown::Free), &drive, 0.05);
    assert!(certificate.holds() && certificate.closest.is_none());
    assert_eq!(certificate.clearance_proven, Some(1.6));
    assert!(judge(&robot, &wide_map(Unknown::Free), &drive, 3.0).holds());
}

#[test]
fn a_spin_in_a_tight_ring_of_posts_keeps_the_clearance_of_its_radius() {
    // Corners of the base run on a circle of 0.2 sqrt 2 = 0.28284 m; the nearest posts begin at 0.35 m on the axes.
    let robot = box_robot();
    let mut map = wide_map(Unknown::Free);
    for cell in [[107, 100], [92, 100], [100, 107], [100, 92]] {
        post(&mut map, cell);
    }
    let spin = commands(&robot, Pose2::default(), &[], 0.1, &vec![(0.0, 2.0, vec![]); 40]);
    let gap = 0.35 - 0.2 * 2f64.sqrt();
    assert!(judge(&robot, &map, &spin, gap - 2e-6).holds());
    assert!(!judge(&robot, &map, &spin, gap + 2e-6).holds());
}

#[test]
fn absurd_speeds_are_judged_without_endless_work() {
    let robot = box_robot();
    let mut map = wide_map(Unknown::Occupied);
    post(&mut map, [150, 150]);
    let fast = commands(&robot, Pose2::default(), &[], 1.0, &[(9e4, 30.0, vec![]), (-9e4, 0.0, vec![])]);
    assert!(!judge(&robot, &map, &fast, 0.05).holds());
    let spin = commands(&robot, Pose2::default(), &[], 1.0, &[(0.0, 4e3, vec![])]);
    assert!(judge(&robot, &map, &spin, 0.05).holds());
}

#[test]
fn a_hull_whose_centre_lies_outside_it_is_measured_from_its_surface() {
    let vertices = vec![[-0.5, -0.5, -0.5], [0.5, -0.5, -0.5], [-0.5, 0.5, -0.5], [-0.5, -0.5, 0.5]];
    let at = Isometry3::new(Vector3::new(0.0, 0.0, 0.6), Vector3::zeros());
    let robot = with_shape(bare_robot(), 0, at, Convex::Hull { vertices });
    let mut map = VoxelMap::new(0.05, [-1.0; 3], [40, 40, 60], Unknown::Free);
    map.occupy([20, 20, 32]); // (0.00, 0.00, 0.60) to (0.05, 0.05, 0.65): in front of the slanted face x + y + z = 0.1
    let stand = commands(&robot, Pose2::default(), &[], 0.1, &[]);
    let closest = judge(&robot, &map, &stand, 0.0).closest.unwrap();
    assert!((closest.distance - 0.5 / 3f64.sqrt()).abs() < 1e-6, "{closest:?}");
}

/// 524 km from the origin a coordinate is known to some 1e-8 m: what that could hide is not proven, for cells and for edges. All lengths here
/// are sums of powers of two, so the distance of half a metre is exact.
#[test]
fn what_rounding_could_hide_is_not_proven() {
    let far = 524_288.0;
    let robot = with_shape(bare_robot(), 0, Isometry3::translation(0.0, 0.0, 0.5), Convex::Box { half: [0.25; 3] });
    let mut cells = VoxelMap::new(0.125, [far, far, 0.0], [64, 64, 8], Unknown::Free);
    cells.occupy([38, 32, 4]);
    let edges = VoxelMap::new(0.125, [far, far, 0.0], [64, 64, 8], Unknown::Occupied);
    for (map, x) in [(&cells, 4.0), (&edges, 0.75)] {
        for (required, holds) in [(0.5 - 1e-7, true), (0.5 - 4e-9, false)] {
            let (table, mut task) = commands(&robot, Pose2::new(far + x, far + 4.0, 0.0), &[], 0.1, &[]);
            task.clearance = required;
            let certificate = certify(&table, &robot, Some(map), &task);
            assert_eq!(certificate.holds(), holds, "{required}: {:?}", certificate.refusals);
            assert!((certificate.closest.expect("near").distance - 0.5).abs() < 1e-7);
        }
    }
}
