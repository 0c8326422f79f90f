use nalgebra::Isometry3;
use parry3d_f64::query;
use proptest::prelude::*;

use super::peer::{peer, peer_pose};
use super::robots::*;
use crate::certify::{Certificate, RefusalKind, certify};
use crate::command::CommandTable;
use crate::geom::Pose2;
use crate::math::real;
use crate::robot::{Convex, RobotModel};

fn refusal(certificate: &Certificate) -> Option<&str> {
    let found = certificate.refusals.iter().find(|r| r.kind == RefusalKind::OwnLinks);
    found.map(|r| r.message.as_str())
}

fn judge(robot: &RobotModel, start: &[f64], step: f64, held: &[Twist]) -> Certificate {
    let (table, task) = commands(robot, Pose2::new(3.0, -2.0, 0.7), start, step, held);
    certify(&table, robot, None, &task)
}

/// Distance of two shapes `tau` seconds into a row, from the written state, by another library; `None` where it cannot hold a shape.
fn distance_of_pair(table: &CommandTable, robot: &RobotModel, [a, b]: [usize; 2], row: usize, tau: f64) -> Option<f64> {
    let row = &table.rows[row];
    let values: Vec<f64> =
        row.joint_positions.iter().zip(&row.joint_velocities).map(|(q, rate)| q + rate * tau).collect();
    let poses = robot.shape_poses(&values);
    let [(one, turned_one), (other, turned_other)] = [peer(&robot.shapes[a].convex)?, peer(&robot.shapes[b].convex)?];
    let [at_one, at_other] = [peer_pose(&(poses[a] * turned_one)), peer_pose(&(poses[b] * turned_other))];
    Some(query::distance(&at_one, &*one.0, &at_other, &*other.0).ok()?.distance)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(600))]

    #[test]
    fn links_proven_apart_are_apart_at_every_sampled_instant_and_touching_ones_touch(
        robot in any_tangle(), (_, values, step, held) in any_motion(),
    ) {
        let (values, held) = cut(&robot, &values, &held);
        let (table, task) = commands(&robot, Pose2::default(), &values, step, &held);
        let certificate = certify(&table, &robot, None, &task);
        let pairs = robot.self_pairs();
        prop_assert_eq!(certificate.own_links.is_some(), !pairs.is_empty());
        let least = |row: usize, tau: f64| {
            pairs.iter().filter_map(|pair| distance_of_pair(&table, &robot, *pair, row, tau)).fold(f64::INFINITY, f64::min)
        };
        if let Some(message) = refusal(&certificate) {
            prop_assert!(!certificate.own_links.unwrap().apart);
            let time = certificate.refusals.iter().find(|r| r.kind == RefusalKind::OwnLinks).unwrap().time.unwrap();
            let row = ((time / step) as usize).min(table.rows.len() - 1);
            let distance = least(row, time - table.time(row));
            // Parry's own tolerance; and a pair that it cannot hold has no distance here.
            prop_assert!(distance < 1e-5 || distance.is_infinite(), "{message}: {distance} m");
            prop_assert!(message.contains("touch each other at t = "), "{message}");
        } else {
            for row in 0..table.rows.len() {
                for sample in 0..=16 {
                    let distance = least(row, step * f64::from(sample) / 16.0);
                    // The last row is held for no time.
                    prop_assert!(distance > 0.0 || row + 1 == table.rows.len() && sample > 0, "row {row}: {distance}");
                }
            }
        }
    }
}

/// A post at x = 0.5 on the base, and an arm of 0.6 m that turns about the z axis above the origin; the arm's tip passes the post.
fn windmill(post: f64) -> RobotModel {
    let mut robot = with_joint(bare_robot(), false);
    robot = with_body(robot, 0, Isometry3::identity(), [0.0, 0.0, 1.0], (0, 1.0, 0.0));
    robot = with_shape(
        robot,
        0,
        Isometry3::translation(post, 0.0, 0.0),
        Convex::Cylinder { radius: 0.01, half_length: 0.1 },
    );
    with_shape(robot, 1, Isometry3::translation(0.3, 0.0, 0.0), Convex::Box { half: [0.3, 0.005, 0.01] })
}

#[test]
fn an_arm_that_sweeps_over_a_post_between_two_samples_is_found() {
    // From -90 to 90 degrees within one row: far from the post at its begin and end.
    let quarter = std::f64::consts::FRAC_PI_2;
    let sweep = [(0.4, 0.3, vec![2.0 * quarter / 0.5])];
    let certificate = judge(&windmill(0.5), &[-quarter], 0.5, &sweep);
    let message = refusal(&certificate).expect("a collision");
    assert!(message.starts_with("`link_0` and `link_1` touch each other at t = 0.25"), "{message}");
    assert!(message.ends_with("with `joint_0` 0.0000 rad"), "{message}");
    assert!(!certificate.holds() && !certificate.own_links.unwrap().apart);

    let beyond = judge(&windmill(0.611), &[-quarter], 0.5, &sweep);
    assert!(beyond.own_links.unwrap().apart && beyond.own_links.unwrap().pairs == 1, "{:?}", beyond.refusals);
    assert!(refusal(&judge(&windmill(0.609), &[-quarter], 0.5, &sweep)).is_some());
}

#[test]
fn a_gap_of_a_micrometre_is_proven_and_an_overlap_of_one_is_refused() {
    // The arm's end is flat: turning, its corners come to hypot(0.6, 0.005) of the axis; the post's edge is there, give or take.
    let corner = real::hypot(0.6, 0.005);
    let swing = [(0.0, 0.0, vec![2.0])];
    assert!(judge(&windmill(corner + 0.01 + 1e-6), &[-0.1], 0.1, &swing).own_links.unwrap().apart);
    assert!(!judge(&windmill(corner + 0.01 - 1e-6), &[-0.1], 0.1, &swing).own_links.unwrap().apart);
}

#[test]
fn slides_that_cross_between_samples_are_found_and_those_that_pass_beside_are_not() {
    // Two blocks on slides along x and y, both through the origin's column at t = 0.5.
    let block = || Convex::Box { half: [0.02, 0.02, 0.02] };
    let crossing = |height: f64| {
        let mut robot = with_joint(with_joint(bare_robot(), true), true);
        robot = with_body(robot, 0, Isometry3::identity(), [1.0, 0.0, 0.0], (0, 1.0, 0.0));
        robot = with_body(robot, 0, Isometry3::translation(0.0, 0.0, height), [0.0, 1.0, 0.0], (1, 1.0, 0.0));
        with_shape(with_shape(robot, 1, Isometry3::identity(), block()), 2, Isometry3::identity(), block())
    };
    let held = [(0.0, 0.0, vec![2.0, 2.0])];
    let met = judge(&crossing(0.0), &[-1.0, -1.0], 1.0, &held);
    let time = met.refusals.iter().find(|r| r.kind == RefusalKind::OwnLinks).unwrap().time.unwrap();
    assert!((time - 0.5).abs() <= 0.02, "{time}");
    assert!(judge(&crossing(0.041), &[-1.0, -1.0], 1.0, &held).own_links.unwrap().apart);
    assert!(!judge(&crossing(0.039), &[-1.0, -1.0], 1.0, &held).own_links.unwrap().apart);
    // Later by more than a block's length: never at the crossing together.
    assert!(judge(&crossing(0.0), &[-1.0, -1.09], 1.0, &held).own_links.unwrap().apart);
}

#[test]
fn joints_that_move_alike_do_not_come_nearer_to_each_other() {
    // An arm with two rods side by side, 2 um apart, swung fast; only the second rod's slide is a moving body of its own.
    let mut robot = with_joint(with_joint(bare_robot(), false), true);
    robot = with_body(robot, 0, Isometry3::identity(), [0.0, 0.0, 1.0], (0, 1.0, 0.0));
    robot = with_body(robot, 1, Isometry3::translation(0.0, 0.020002, 0.0), [1.0, 0.0, 0.0], (1, 1.0, 0.0));
    let rod = || Convex::Box { half: [0.2, 0.01, 0.01] };
    robot =
        with_shape(with_shape(robot, 1, Isometry3::translation(0.3, 0.0, 0.0), rod()), 2, Isometry3::identity(), rod());
    let swing = vec![(0.5, 1.0, vec![3.0, 0.0]); 10];
    assert!(judge(&robot, &[0.0, 0.1], 0.1, &swing).own_links.unwrap().apart);
}

#[test]
fn a_posture_that_is_only_held_is_judged_once_and_links_inside_each_other_touch() {
    let mut robot = with_joint(bare_robot(), true);
    robot = with_body(robot, 0, Isometry3::identity(), [0.0, 0.0, 1.0], (0, 1.0, 0.0));
    robot = with_shape(robot, 0, Isometry3::identity(), Convex::Sphere { radius: 0.5 });
    robot = with_shape(robot, 1, Isometry3::identity(), Convex::Sphere { radius: 0.1 });
    let stand = vec![(0.5, 0.1, vec![0.0]); 5];
    let inside = judge(&robot, &[0.2], 0.1, &stand);
    assert!(refusal(&inside).expect("inside").contains("t = 0.000 s, with `joint_0` 0.2000 m"));
    assert!(judge(&robot, &[0.7], 0.1, &stand).own_links.unwrap().apart);

    // The end of the last moving row is what the rows at rest hold.
    let lower = [vec![(0.0, 0.0, vec![-1.0])], stand.clone()].concat();
    assert!(judge(&robot, &[0.7001], 0.1, &lower).own_links.unwrap().apart);
    assert!(!judge(&robot, &[0.6999], 0.1, &lower).own_links.unwrap().apart);
    assert_eq!(judge(&ignoring_itself(robot), &[0.2], 0.1, &stand).own_links, None);
}

#[test]
fn absurd_rates_are_judged_without_endless_work() {
    let fast = judge(&windmill(0.7), &[0.0], 1.0, &[(0.0, 0.0, vec![1e4])]);
    assert!(fast.own_links.unwrap().apart);
    assert!(!judge(&windmill(0.5), &[0.0], 1.0, &[(0.0, 0.0, vec![1e4])]).own_links.unwrap().apart);
}
