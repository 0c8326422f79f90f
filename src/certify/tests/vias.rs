use nalgebra::Isometry3;

use super::robots::*;
use crate::certify::{
    Certificate, Demands, END_ANGLE_TOLERANCE, END_POINT_TOLERANCE, Goal, RefusalKind, Task, Via, certify_through,
};
use crate::command::CommandTable;
use crate::geom::Pose2;
use crate::robot::RobotModel;

/// Drives 0.1 m along x in 1 s, stands for 0.3 s, drives as far again; a joint goes from 0 to 0.5 while it first drives.
fn judged(vias: &[Via]) -> Certificate {
    let (robot, table, task) = motion();
    certify_through(&table, &robot, None, &task, Demands { vias, zones: &[], link: None })
}

fn motion() -> (RobotModel, CommandTable, Task) {
    motion_from(Pose2::default())
}

fn motion_from(start: Pose2) -> (RobotModel, CommandTable, Task) {
    let robot = with_body(with_joint(bare_robot(), false), 0, Isometry3::identity(), [0.0, 1.0, 0.0], (0, 1.0, 0.0));
    let drive = |rate: f64| std::iter::repeat_n((0.1, 0.0, vec![rate]), 10);
    let held: Vec<_> = drive(0.5).chain(std::iter::repeat_n((0.0, 0.0, vec![0.0]), 3)).chain(drive(0.0)).collect();
    let (table, task) = commands(&robot, start, &[0.0], 0.1, &held);
    (robot, table, task)
}

fn via(x: f64, dwell: f64) -> Via {
    Via { place: Goal { x, y: 0.0, within: 0.0, yaw: None, joints: vec![None] }, dwell }
}

/// Times at which vias are reached, or what is said of the first one that is not.
fn times(vias: &[Via]) -> Result<Vec<f64>, String> {
    let certificate = judged(vias);
    match certificate.refusals.first() {
        None => Ok(certificate.vias.iter().map(|reached| reached.time).collect()),
        Some(refusal) => {
            assert_eq!(refusal.kind, RefusalKind::Via, "{refusal:?}");
            Err(refusal.message.clone())
        }
    }
}

fn near(found: Result<Vec<f64>, String>, expected: &[f64]) {
    let found = found.expect("reached");
    assert_eq!(found.len(), expected.len());
    assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
}

#[test]
fn a_stop_is_where_the_base_rests_and_not_where_it_passes() {
    near(times(&[via(0.1, 0.0)]), &[1.0]);
    near(times(&[via(0.2, 0.0)]), &[2.3]);
    let passed = times(&[via(0.05, 0.0)]).expect_err("it only passes");
    assert!(passed.contains("via[0] (0.050, 0.000)") && passed.contains("50.000 mm away"), "{passed}");
}

#[test]
fn a_stop_lasts_as_long_as_is_asked() {
    near(times(&[via(0.1, 0.3)]), &[1.0]);
    let short = times(&[via(0.1, 0.31)]).expect_err("too short");
    assert!(short.contains("stands there for 0.300 s, 0.310 s are asked for"), "{short}");
}

#[test]
fn stops_come_in_their_order_and_each_moment_counts_once() {
    near(times(&[via(0.1, 0.0), via(0.2, 0.0)]), &[1.0, 2.3]);
    let backwards = times(&[via(0.2, 0.0), via(0.1, 0.0)]).expect_err("backwards");
    assert!(backwards.contains("via[1]") && backwards.ends_with("it does not stop any more"), "{backwards}");
    near(times(&[via(0.1, 0.1), via(0.1, 0.2)]), &[1.0, 1.1]);
    assert!(times(&[via(0.1, 0.2), via(0.1, 0.2)]).expect_err("0.3 s in all").contains("via[1]"));
}

#[test]
fn headings_joints_and_distances_are_judged_like_the_goals() {
    let with = |yaw: Option<f64>, joint: Option<f64>, x: f64| {
        let place = Goal { x, y: 0.0, within: 0.0, yaw, joints: vec![joint] };
        judged(&[Via { place, dwell: 0.0 }]).holds()
    };
    assert!(with(Some(std::f64::consts::TAU), Some(0.5), 0.1));
    for (scale, good) in [(0.999, true), (1.001, false)] {
        let angle = scale * END_ANGLE_TOLERANCE;
        assert_eq!(with(Some(angle), None, 0.1), good);
        assert_eq!(with(None, Some(0.5 - angle), 0.1), good);
        assert_eq!(with(None, None, 0.1 + scale * END_POINT_TOLERANCE), good);
    }
}

#[test]
fn a_goal_or_via_with_a_radius_is_the_disc_and_nothing_more() {
    for (scale, good) in [(1.0 - 1e-9, true), (1.0 + 1e-9, false)] {
        // The motion stands at 0.1 m, and ends at 0.2 m.
        let region = |x: f64| Goal { x, y: 0.0, within: 0.05 / scale, yaw: None, joints: vec![None] };
        assert_eq!(judged(&[Via { place: region(0.15), dwell: 0.0 }]).holds(), good);
        let (robot, table, mut task) = motion();
        task.goal = Goal { y: 0.03, ..region(0.16) };
        let certificate = certify_through(&table, &robot, None, &task, Demands::default());
        assert_eq!(certificate.holds(), good, "{:?}", certificate.refusals);
        assert!((certificate.end_point_error - 0.05).abs() < 1e-12);
        assert_eq!(certificate.refusals.iter().any(|r| r.message.contains("50.000 mm from the goal")), !good);
    }
}

#[test]
fn anywhere_on_the_floor_a_stop_is_judged_by_its_distance_and_angle() {
    let start = Pose2::new(3.0, -2.0, 2.0);
    let (robot, table, task) = motion_from(start);
    let stop = start.after_twist(0.1, 0.0, 1.0);
    let judged = |off: [f64; 2], turn: f64, dwell: f64| {
        let yaw = Some(stop.yaw + turn + std::f64::consts::TAU);
        let place = Goal { x: stop.x + off[0], y: stop.y + off[1], within: 0.0, yaw, joints: vec![Some(0.5)] };
        certify_through(&table, &robot, None, &task, Demands { vias: &[Via { place, dwell }], zones: &[], link: None })
    };
    let certificate = judged([3e-4, -4e-4], 1e-3, 0.3);
    assert!(certificate.holds(), "{:?}", certificate.refusals);
    let reached = certificate.vias[0];
    assert!((reached.point_error - 5e-4).abs() < 1e-12 && (reached.time - 1.0).abs() < 1e-9, "{reached:?}");
    assert!((reached.heading_error.expect("asked for") - 1e-3).abs() < 1e-12, "{reached:?}");
    let said = |off: [f64; 2], turn: f64| judged(off, turn, 0.0).refusals[0].message.clone();
    assert!(said([0.0, 0.04], 0.0).contains("its nearest stop after that is 40.000 mm away"));
    assert!(said([0.04, 0.0], 0.0).contains("its nearest stop after that is 40.000 mm away"));
    assert!(said([0.0, 0.0], 0.1).contains("with another heading or other joints"));
}
