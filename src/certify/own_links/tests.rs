use nalgebra::Isometry3;

use super::*;
use crate::certify::tests::robots::{Twist, bare_robot, commands, with_body, with_joint, with_shape};
use crate::command::CommandTable;
use crate::robot::Convex;

/// A ball of 0.5 m on the base, and one of 5 cm on a slide along x.
fn balls() -> RobotModel {
    let mut robot = with_joint(bare_robot(), true);
    robot = with_body(robot, 0, Isometry3::identity(), [1.0, 0.0, 0.0], (0, 1.0, 0.0));
    robot = with_shape(robot, 1, Isometry3::identity(), Convex::Sphere { radius: 0.05 });
    with_shape(robot, 0, Isometry3::identity(), Convex::Sphere { radius: 0.5 })
}

fn table(robot: &RobotModel, from: f64, held: &[Twist]) -> CommandTable {
    commands(robot, Pose2::default(), &[from], 0.5, held).0
}

/// The refusal, if any, and how much was looked at.
fn judged(robot: &RobotModel, table: &CommandTable, from: f64) -> (Option<Refusal>, u64) {
    let rollout = Rollout::new(table, Pose2::default(), &[from]);
    let mut check = Check::new(&rollout, robot, robot.self_pairs());
    (check.run(), check.work)
}

#[test]
fn balls_touch_where_their_middles_are_as_near_as_their_radii_add_up_to() {
    let robot = balls();
    for (from, apart) in [(0.3, false), (0.5, false), (0.549, false), (0.551, true), (2.0, true)] {
        assert_eq!(judged(&robot, &table(&robot, from, &[]), from).0.is_none(), apart, "{from}");
        // Alike where the slide is the first shape's and where it is the second's.
        let mut swapped = robot.clone();
        swapped.shapes.reverse();
        assert_eq!(judged(&swapped, &table(&swapped, from, &[]), from).0.is_none(), apart, "{from}");
    }
}

#[test]
fn links_that_touch_when_the_motion_begins_and_part_at_once_are_found() {
    let robot = balls();
    for (from, apart) in [(0.5499, false), (0.5501, true)] {
        let table = table(&robot, from, &[(0.0, 0.0, vec![1.0])]);
        assert_eq!(judged(&robot, &table, from).0.is_none(), apart, "{from}");
    }
}

#[test]
fn the_last_row_counts_when_it_begins_and_not_after() {
    let robot = balls();
    let mut table = table(&robot, 1.0, &[(0.0, 0.0, vec![-0.5]), (0.0, 0.0, vec![-0.5])]);
    table.rows.pop(); // at rest, 0.5 m from the middle
    assert!(judged(&robot, &table, 1.0).0.is_none());
}

#[test]
fn of_two_touches_in_a_row_the_first_is_named() {
    // A ball on a slide passes through two others, early and late, and neither in the row's middle.
    let mut robot = with_joint(bare_robot(), true);
    robot = with_body(robot, 0, Isometry3::identity(), [1.0, 0.0, 0.0], (0, 1.0, 0.0));
    robot = with_shape(robot, 1, Isometry3::identity(), Convex::Sphere { radius: 0.05 });
    for x in [0.3, 0.8] {
        robot = with_shape(robot, 0, Isometry3::translation(x, 0.0, 0.0), Convex::Sphere { radius: 0.05 });
    }
    let table = table(&robot, 0.0, &[(0.0, 0.0, vec![2.0])]);
    let time = judged(&robot, &table, 0.0).0.expect("a touch").time.unwrap();
    assert!((0.1..=0.2).contains(&time), "{time}");
}

/// A rod that turns past a ball: its corners come near it.
fn rod() -> RobotModel {
    let mut robot = with_joint(bare_robot(), false);
    robot = with_body(robot, 0, Isometry3::identity(), [0.0, 0.0, 1.0], (0, 1.0, 0.0));
    robot = with_shape(robot, 1, Isometry3::identity(), Convex::Box { half: [0.3, 0.1, 0.1] });
    with_shape(robot, 0, Isometry3::translation(0.43, 0.0, 0.0), Convex::Sphere { radius: 0.1 })
}

#[test]
fn how_the_base_drives_makes_no_difference() {
    let of = |speed: f64, turn_rate: f64| {
        let robot = rod();
        judged(&robot, &table(&robot, -1.0, &[(speed, turn_rate, vec![4.0])]), -1.0)
    };
    let (found, work) = of(0.0, 0.0);
    assert!(found.is_none() && work > 3, "{work}");
    assert_eq!(of(30.0, 0.0), (None, work));
    assert_eq!(of(0.0, 40.0), (None, work));
}

/// A slide that is 100 km out: rounding could hide 0.3 mm there.
#[test]
fn links_nearer_than_rounding_are_not_proven_apart_and_that_is_said() {
    let out = 1e5;
    let mut robot = balls();
    robot.shapes[1].pose = Isometry3::translation(out, 0.0, 0.0);
    let stand = |from: f64| judged(&robot, &table(&robot, from, &[]), from).0;
    let message = stand(out + 0.55 + 1e-4).expect("too near").message;
    assert!(message.contains("could not be proven apart: within 1.0e-4 m of each other at t = 0.000 s"), "{message}");
    assert!(stand(out + 0.56).is_none());
}

#[test]
fn a_check_that_has_done_its_work_refuses_what_is_not_proven() {
    let robot = rod();
    let table = table(&robot, -1.0, &[(0.0, 0.0, vec![4.0])]);
    let rollout = Rollout::new(&table, Pose2::default(), &[-1.0]);
    let mut check = Check::new(&rollout, &robot, robot.self_pairs());
    assert!(check.run().is_none() && check.work > 3, "{}", check.work);
    let mut hasty = Check::new(&rollout, &robot, robot.self_pairs());
    hasty.patience = 0;
    assert!(hasty.run().expect("not proven").message.contains("could not be proven apart"));
}
