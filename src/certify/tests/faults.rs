use nalgebra::Isometry3;

use super::robots::*;
use crate::certify::{Certificate, END_ANGLE_TOLERANCE, END_POINT_TOLERANCE, RefusalKind, Task, certify};
use crate::command::CommandTable;
use crate::geom::Pose2;
use crate::map::VoxelMap;
use crate::math::real;
use crate::mission::Unknown;
use crate::robot::{Convex, MotionLimits, RobotModel};

/// One arm; a ramp up and down again, so that every difference is known: speeds 0.1, 0.2, 0.1 m/s and rad/s each 0.1 s.
fn case() -> (RobotModel, CommandTable, Task) {
    let mut robot = with_joint(bare_robot(), false);
    robot = with_body(robot, 0, Isometry3::identity(), [0.0, 1.0, 0.0], (0, 1.0, 0.0));
    robot = with_shape(robot, 1, Isometry3::translation(0.0, 0.0, 0.2), Convex::Sphere { radius: 0.1 });
    let held = [0.1, 0.2, 0.1].map(|v| (v, 0.0, vec![v]));
    let (table, task) = commands(&robot, Pose2::new(1.0, 2.0, 0.5), &[0.3], 0.1, &held);
    (robot, table, task)
}

fn kinds(certificate: &Certificate) -> Vec<RefusalKind> {
    certificate.refusals.iter().map(|r| r.kind).collect()
}

#[test]
fn sound_commands_without_a_map_are_certified() {
    let (robot, table, task) = case();
    let certificate = certify(&table, &robot, None, &task);
    assert!(certificate.holds() && certificate.limits_hold, "{:?}", certificate.refusals);
    assert_eq!((certificate.clearance_required, certificate.clearance_proven), (None, None));
    assert!(certificate.end_point_error < 1e-12 && certificate.end_heading_error.unwrap() < 1e-12);
}

#[test]
fn peaks_are_differences_with_rest_before_and_after() {
    let (robot, table, task) = case();
    let certificate = certify(&table, &robot, None, &task);
    let names: Vec<_> = certificate.limits.iter().map(|c| (c.actuator.as_str(), c.quantity)).collect();
    let quantities = ["speed", "acceleration", "jerk"];
    let expected: Vec<_> =
        ["wheel_left", "wheel_right", "joint_0"].into_iter().flat_map(|a| quantities.map(|q| (a, q))).collect();
    assert_eq!(names, expected);
    for check in &certificate.limits {
        // 0 .1 .2 .1 0: first differences .1 .1 -.1 -.1, second .1 0 -.2 0 .1
        let peak = match check.quantity {
            "speed" => 0.2,
            "acceleration" => 1.0,
            _ => 20.0,
        };
        assert!((check.peak - peak).abs() < 1e-12 && check.limit.is_none(), "{check:?}");
    }
}

#[test]
fn a_peak_at_its_limit_passes_and_one_a_millionth_over_does_not() {
    let (mut robot, table, task) = case();
    let peaks = [0.2, 1.0, 20.0];
    for exceeded in 0..3 {
        for joint in [false, true] {
            let limits = |scale: f64| MotionLimits {
                speed: Some(peaks[0] * if exceeded == 0 { scale } else { 1.0 }),
                acceleration: Some(peaks[1] * if exceeded == 1 { scale } else { 1.0 }),
                jerk: Some(peaks[2] * if exceeded == 2 { scale } else { 1.0 }),
            };
            for (scale, expected) in [(1.0, vec![]), (1.0 - 1e-6, vec![RefusalKind::Limit; if joint { 1 } else { 2 }])]
            {
                (robot.wheel, robot.joints[0].limits) =
                    if joint { (FREE, limits(scale)) } else { (limits(scale), FREE) };
                let certificate = certify(&table, &robot, None, &task);
                assert_eq!(kinds(&certificate), expected, "{:?}", certificate.refusals);
                assert_eq!(certificate.limits_hold, expected.is_empty());
            }
        }
    }
}

#[test]
fn the_last_difference_to_rest_counts() {
    let (mut robot, mut table, mut task) = case();
    table.rows.remove(2); // now from 0.2 m/s to rest at once
    table.rows[2].joint_positions[0] = 0.33;
    task.goal = crate::certify::Goal {
        x: 1.0 + 0.03 * real::cos(0.5),
        y: 2.0 + 0.03 * real::sin(0.5),
        within: 0.0,
        yaw: None,
        joints: vec![None],
    };
    robot.wheel.acceleration = Some(1.9);
    assert_eq!(kinds(&certify(&table, &robot, None, &task)), [RefusalKind::Limit; 2]);
    robot.wheel.acceleration = Some(2.0);
    assert!(certify(&table, &robot, None, &task).holds());
}

#[test]
fn a_joint_outside_its_range_is_refused() {
    let (mut robot, table, task) = case();
    (robot.joints[0].lower, robot.joints[0].upper) = (0.3, 0.34);
    assert!(certify(&table, &robot, None, &task).holds());
    robot.joints[0].upper = 0.339999;
    let certificate = certify(&table, &robot, None, &task);
    assert_eq!(kinds(&certificate), [RefusalKind::Position]);
    assert!(!certificate.limits_hold);
    (robot.joints[0].lower, robot.joints[0].upper) = (0.300001, 1.0);
    assert_eq!(kinds(&certify(&table, &robot, None, &task)), [RefusalKind::Position]);
}

#[test]
fn driving_backwards_is_refused_unless_it_is_allowed() {
    let (robot, mut table, mut task) = case();
    let backwards =
        |table: &CommandTable, task: &Task| kinds(&certify(table, &robot, None, task)).contains(&RefusalKind::Reverse);
    task.reverse = false;
    assert!(!backwards(&table, &task));
    for row in &mut table.rows {
        (row.wheel_left, row.wheel_right) = (-row.wheel_left, -row.wheel_right);
    }
    assert!(backwards(&table, &task));
    task.reverse = true;
    assert!(!backwards(&table, &task));
}

#[test]
fn ends_beyond_the_tolerance_are_refused() {
    let (robot, table, task) = case();
    for (scale, expected) in [(0.999, vec![]), (1.001, vec![RefusalKind::End])] {
        let mut off = task.clone();
        off.goal.x += scale * END_POINT_TOLERANCE;
        assert_eq!(kinds(&certify(&table, &robot, None, &off)), expected);
        let mut off = task.clone();
        off.goal.yaw = Some(0.5 + scale * END_ANGLE_TOLERANCE + std::f64::consts::TAU);
        assert_eq!(kinds(&certify(&table, &robot, None, &off)), expected);
        let mut off = task.clone();
        off.goal.joints = vec![Some(0.34 - scale * END_ANGLE_TOLERANCE)];
        assert_eq!(kinds(&certify(&table, &robot, None, &off)), expected);
    }
    let mut open = task;
    (open.goal.yaw, open.goal.joints) = (None, vec![None]);
    assert_eq!(certify(&table, &robot, None, &open).end_heading_error, None);
}

#[test]
fn every_fault_of_a_table_is_refused() {
    let (robot, table, task) = case();
    let map = VoxelMap::new(0.1, [0.0; 3], [40, 40, 10], Unknown::Occupied);
    type Change = fn(&mut CommandTable, &mut Task);
    let faults: [(&str, Change); 24] = [
        ("no rows", |t, _| t.rows.clear()),
        ("wheel not a number", |t, _| t.rows[1].wheel_left = f64::NAN),
        ("wheel infinite", |t, _| t.rows[1].wheel_right = f64::INFINITY),
        ("wheel too large", |t, _| t.rows[1].wheel_right = 1e300),
        ("pose not a number", |t, _| t.rows[2].pose.yaw = f64::NAN),
        ("position not a number", |t, _| t.rows[2].joint_positions[0] = f64::NAN),
        ("speed not a number", |t, _| t.rows[2].joint_velocities[0] = f64::NAN),
        ("sampling time zero", |t, _| t.sampling_time = 0.0),
        ("sampling time too short", |t, _| t.sampling_time = 1e-6),
        ("sampling time too long", |t, _| t.sampling_time = 1.1e6),
        ("row without speeds", |t, _| t.rows[1].joint_velocities.clear()),
        ("sampling time not a number", |t, _| t.sampling_time = f64::NAN),
        ("other wheels", |t, _| t.wheel_radii = 0.11.into()),
        ("a larger right wheel", |t, _| t.wheel_radii.difference = 1e-3),
        ("other track", |t, _| t.track_width = 0.41),
        ("joint missing", |t, _| t.joints.clear()),
        ("joint of another name", |t, _| t.joints[0].0 = "other".into()),
        ("joint of another kind", |t, _| t.joints[0].1 = true),
        ("row without joints", |t, _| t.rows[1].joint_positions.clear()),
        ("start elsewhere", |t, _| t.rows[0].pose.x += 2e-6),
        ("start turned", |t, _| t.rows[0].pose.yaw += 2e-6),
        ("position off its speed", |t, _| t.rows[2].joint_positions[0] += 2e-6),
        ("task not a number", |_, task| task.clearance = f64::NAN),
        ("task of another robot", |_, task| task.start_joints.clear()),
    ];
    for (what, change) in faults {
        let (mut table, mut task) = (table.clone(), task.clone());
        change(&mut table, &mut task);
        for map in [None, Some(&map)] {
            let certificate = certify(&table, &robot, map, &task);
            assert!(kinds(&certificate).contains(&RefusalKind::Table), "{what}: {:?}", certificate.refusals);
        }
    }
}

#[test]
fn a_table_that_does_not_end_at_rest_is_refused() {
    let (robot, table, task) = case();
    for change in [
        |t: &mut CommandTable| t.rows[3].wheel_left = 1e-9,
        |t: &mut CommandTable| t.rows[3].joint_velocities[0] = 1e-9,
    ] {
        let mut moving = table.clone();
        change(&mut moving);
        assert_eq!(kinds(&certify(&moving, &robot, None, &task)), [RefusalKind::End]);
    }
}

#[test]
fn what_is_written_is_judged_not_what_is_planned() {
    // The planned poses may lie anywhere (sampling leaves the path); only the replay counts.
    let (robot, mut table, task) = case();
    table.rows[2].pose.x += 0.5;
    assert!(certify(&table, &robot, None, &task).holds());
}

#[test]
fn lengths_beyond_what_can_be_judged_are_told() {
    for length in [1e-6, 1.1e6] {
        let (mut robot, mut table, task) = case();
        (robot.track_width, table.track_width) = (length, length);
        let certificate = certify(&table, &robot, None, &task);
        let expected = format!("the track width {length} is not a length of time or space that can be judged");
        assert_eq!(certificate.refusals[0].message, expected);
        table.sampling_time = length;
        assert!(certify(&table, &robot, None, &task).refusals[0].message.starts_with("the sampling time"));
    }
}

#[test]
fn one_row_shows_what_is_wrong_with_all() {
    let (robot, table, task) = case();
    type Change = fn(&mut crate::command::CommandRow);
    let faults: [(Change, usize); 3] = [
        (|row| row.joint_positions.clear(), 1),
        (|row| row.wheel_left = f64::NAN, 1),
        (
            |row| {
                row.joint_positions.clear();
                row.wheel_left = f64::NAN;
            },
            2,
        ),
    ];
    for (change, messages) in faults {
        let mut table = table.clone();
        table.rows[1..].iter_mut().for_each(change);
        let certificate = certify(&table, &robot, None, &task);
        assert_eq!(certificate.refusals.len(), messages, "{:?}", certificate.refusals);
        assert!(certificate.refusals.iter().all(|refusal| refusal.time == Some(0.1)));
    }
}

#[test]
fn refusals_say_by_how_much_and_when_first() {
    let (mut robot, table, mut task) = case();
    // Speeds of 0.1, 0.2 and 0.1: the change is as large in the first row as in the last.
    robot.wheel.speed = Some(0.16);
    robot.joints[0].limits.acceleration = Some(0.5);
    let certificate = certify(&table, &robot, None, &task);
    let said: Vec<_> = certificate.refusals.iter().map(|r| r.message.as_str()).collect();
    assert_eq!(
        said,
        [
            "`wheel_left`: speed 0.200000 m/s at t = 0.100 s, limit 0.160000 m/s (25.000 % over)",
            "`wheel_right`: speed 0.200000 m/s at t = 0.100 s, limit 0.160000 m/s (25.000 % over)",
            "`joint_0`: acceleration 1.000000 rad/s^2 at t = 0.000 s, limit 0.500000 rad/s^2 (100.000 % over)",
        ]
    );
    robot.wheel.speed = None;
    robot.joints[0].limits.acceleration = None;
    task.goal.x += 0.5 * real::cos(0.5);
    task.goal.y += 0.5 * real::sin(0.5);
    task.goal.yaw = Some(0.5 - 2.0f64.to_radians());
    task.goal.joints = vec![Some(0.34 + 3.0f64.to_radians())];
    let certificate = certify(&table, &robot, None, &task);
    let said: Vec<_> = certificate.refusals.iter().map(|r| r.message.as_str()).collect();
    assert_eq!(
        said,
        [
            "ends 500.000 mm from the goal (1 mm allowed)",
            "ends 2.0000 degrees from the goal's heading (0.1 allowed)",
            "ends 3.0000 degrees from the goal of `joint_0` (0.1 allowed)",
        ]
    );
    robot.joints[0].prismatic = true;
    let (mut table, task) = (table, task);
    table.joints[0].1 = true;
    let certificate = certify(&table, &robot, None, &task);
    let wanted = 0.34 + 3.0f64.to_radians();
    assert!(
        certificate
            .refusals
            .iter()
            .any(|r| r.message == format!("`joint_0` ends 52.360 mm from its goal {wanted:.4} m")),
        "{:?}",
        certificate.refusals
    );
}

#[test]
fn a_tolerance_is_not_blamed_for_what_the_model_itself_does_not_keep() {
    let (mut robot, table, task) = case();
    let mut map = VoxelMap::new(0.1, [0.0; 3], [40, 40, 10], Unknown::Free);
    map.occupy([11, 20, 2]);
    robot.tolerance = Some(crate::mission::Tolerance::ASSUMED);
    let certificate = certify(&table, &robot, Some(&map), &task);
    assert_eq!(kinds(&certificate), [RefusalKind::Clearance]);
    robot.tolerance = None;
    let alone = certify(&table, &robot, Some(&map), &task);
    assert_eq!(certificate.clearance_proven, alone.clearance_proven);
}

#[test]
fn the_clearance_alone_is_that_of_the_certificate() {
    let (robot, mut table, task) = case();
    let mut map = VoxelMap::new(0.1, [0.0; 3], [40, 40, 10], Unknown::Free);
    map.occupy([15, 20, 2]);
    let proven = crate::certify::clearance_proven(&table, &robot, &map, &task);
    assert!(proven > 0.2, "{proven}");
    assert_eq!(Some(proven), certify(&table, &robot, Some(&map), &task).clearance_proven);
    table.rows.clear();
    assert_eq!(crate::certify::clearance_proven(&table, &robot, &map, &task), 0.0);
}
