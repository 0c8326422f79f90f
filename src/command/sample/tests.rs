use super::*;
use crate::command::limits::{differences, largest_ratio};
use crate::geom::Pose2;
use crate::math::real;
use crate::mission::TimeLaw;
use crate::retime::{RetimeOptions, retime};
use crate::robot::{MotionLimits, WheelRadii};
use crate::trajectory::{Leg, StillLeg, Trajectory, TrajectorySource, fixtures, given};
use proptest::prelude::*;

fn compile(
    trajectory: &Trajectory,
    robot: &RobotModel,
    law: TimeLaw,
    options: SampleOptions,
) -> (MotionProfile, CommandTable) {
    let profile = retime(trajectory, robot, &RetimeOptions { law, sampling_time: options.sampling_time }).unwrap();
    let table = sample(&profile, robot, &options).unwrap();
    (profile, table)
}

/// Everything that a table promises.
fn check(table: &CommandTable, profile: &MotionProfile, robot: &RobotModel) {
    let hold = table.sampling_time;
    let rims = |side: usize| (0..table.rows.len()).map(move |k| [table.rim_speeds(k).0, table.rim_speeds(k).1][side]);
    let holds = |peaks: [f64; 3], limits: &MotionLimits| {
        largest_ratio(peaks, limits).iter().for_each(|ratio| assert!(*ratio <= 1.0 + 1e-9, "{peaks:?} of {limits:?}"));
    };
    (0..2).for_each(|side| holds(differences(rims(side), hold), &robot.wheel));
    for (j, joint) in robot.joints.iter().enumerate() {
        holds(differences(table.rows.iter().map(|row| row.joint_velocities[j]), hold), &joint.limits);
        for pair in table.rows.windows(2) {
            let moved = pair[0].joint_positions[j] + pair[0].joint_velocities[j] * hold;
            assert!((moved - pair[1].joint_positions[j]).abs() < 1e-9);
        }
        let goal = profile.joints(profile.time())[j];
        assert!((table.rows[table.rows.len() - 1].joint_positions[j] - goal).abs() < 1e-9);
    }
    let last = &table.rows[table.rows.len() - 1];
    assert_eq!((last.wheel_left, last.wheel_right), (0.0, 0.0));
    assert!(last.joint_velocities.iter().all(|v| *v == 0.0));
    assert!(table.duration() >= profile.unrounded_time() * (1.0 - 1e-9));
    let (start, end) = (profile.pose(0.0), profile.pose(profile.time()));
    assert_eq!(table.rows[0].pose, start);
    assert!(last.pose.distance(end) < 1e-12 && (last.pose.yaw - end.yaw).abs() < 1e-12);
    let (distance, angle) = end_point::miss(table, start, end);
    let promised = if table.sampling == Sampling::Tracked { (1e-6, 1e-9) } else { (0.5e-3, CORRECT_ANGLE_BEYOND) };
    assert!(distance <= promised.0 && angle.abs() <= promised.1, "{distance} m, {angle} rad");
}

fn fast() -> RobotModel {
    fixtures::robot(0.32, [1.0, 1.0, 4.0], Vec::new())
}

fn options(sampling_time: f64, sampling: Sampling) -> SampleOptions {
    SampleOptions { sampling_time, sampling }
}

#[test]
fn wheels_that_differ_are_turned_each_by_its_own_radius() {
    let bend = given::from_bezier(&[[[0.0, 0.0], [1.0, 0.0], [2.0, 0.5], [2.0, 1.5]]], &[]).unwrap();
    for sampling in [Sampling::Mean, Sampling::Tracked] {
        let [alike, different] = [0.0, 0.04].map(|difference| {
            let robot = RobotModel { wheel_radii: WheelRadii { mean: 0.1, difference }, ..fast() };
            compile(&bend, &robot, TimeLaw::Wheel, options(0.05, sampling)).1
        });
        assert_eq!(alike.rows.len(), different.rows.len());
        for (k, (a, b)) in alike.rows.iter().zip(&different.rows).enumerate() {
            let ((l, r), (left, right)) = (alike.rim_speeds(k), different.rim_speeds(k));
            assert!((l - left).abs() < 1e-9 && (r - right).abs() < 1e-9, "row {k}: {l} {r} against {left} {right}");
            assert!((b.wheel_left - a.wheel_left / 0.98).abs() < 1e-7, "row {k}");
            assert!((b.wheel_right - a.wheel_right / 1.02).abs() < 1e-7, "row {k}");
        }
    }
}

#[test]
fn a_straight_line_is_sampled_in_its_optimal_time() {
    let line = given::from_bezier(&[[[0.0, 0.0], [4.0 / 3.0, 0.0], [8.0 / 3.0, 0.0], [4.0, 0.0]]], &[]).unwrap();
    let robot = fixtures::conv();
    for sampling in [Sampling::Tracked, Sampling::Mean, Sampling::Instant] {
        let (profile, table) = compile(&line, &robot, TimeLaw::Auto, options(0.1, sampling));
        check(&table, &profile, &robot);
        assert_eq!(table.rows.len(), 116);
    }
}

#[test]
fn the_end_correction_closes_what_plain_means_leave_open() {
    let robot = fast();
    let mut corrected = 0;
    for i in 0..12 {
        let bend = 0.4 + 0.15 * f64::from(i);
        let curve = [[0.0, 0.0], [1.0 + bend, 0.0], [2.0 - bend, 0.8 + bend], [1.5, 2.0]];
        let Ok(trajectory) = given::from_bezier(&[curve], &[]) else { continue };
        let options = options(0.1, Sampling::Mean);
        let (profile, table) = compile(&trajectory, &robot, TimeLaw::Auto, options);
        check(&table, &profile, &robot);
        let plain = sample_uncorrected(&profile, &robot, &options).unwrap();
        let end = profile.pose(profile.time());
        if end_point::miss(&plain, profile.pose(0.0), end).0 > 0.5e-3 {
            corrected += 1;
            assert!(end_point::miss(&table, profile.pose(0.0), end).0 < 0.05e-3);
        }
    }
    assert!(corrected >= 3, "only {corrected} paths needed it");
}

#[test]
fn a_mission_whose_start_is_its_goal_is_one_interval_of_rest() {
    let robot = fixtures::scr_db();
    let still =
        StillLeg { pose: Pose2::new(1.0, 2.0, 0.5), yaw_end: 0.5, joints_from: vec![0.3], joints_to: vec![0.3] };
    let nothing = Trajectory { legs: vec![Leg::Still(still)], source: TrajectorySource::Search, optimiser: None };
    let (profile, table) = compile(&nothing, &robot, TimeLaw::Auto, options(0.1, Sampling::Tracked));
    check(&table, &profile, &robot);
    assert_eq!(table.rows.len(), 2);
    assert_eq!(table.rows[1].joint_positions, [0.3]);
}

#[test]
fn spins_and_joints_keep_their_limits_and_reach_their_values() {
    let robot = fixtures::scr_db();
    let pose = Pose2::new(1.0, 2.0, 0.5);
    let spin = StillLeg { pose, yaw_end: 0.5 - 2.5, joints_from: vec![0.0], joints_to: vec![0.4] };
    let fold = StillLeg {
        pose: Pose2 { yaw: -2.0, ..pose },
        yaw_end: -2.0,
        joints_from: vec![0.4],
        joints_to: vec![std::f64::consts::PI],
    };
    let legs = vec![Leg::Still(spin), Leg::Still(fold)];
    let trajectory = Trajectory { legs, source: TrajectorySource::Search, optimiser: None };
    for sampling in [Sampling::Tracked, Sampling::Mean, Sampling::Instant] {
        for hold in [0.02, 0.1, 0.5] {
            let (profile, table) = compile(&trajectory, &robot, TimeLaw::Minco, options(hold, sampling));
            check(&table, &profile, &robot);
        }
    }
}

#[test]
fn a_sampling_time_that_is_none_is_refused() {
    let line = given::from_bezier(&[[[0.0, 0.0], [1.0, 0.0], [2.0, 0.5], [4.0, 0.0]]], &[]).unwrap();
    let robot = fixtures::conv();
    let profile = retime(&line, &robot, &RetimeOptions { law: TimeLaw::Auto, sampling_time: 0.1 }).unwrap();
    for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = sample(&profile, &robot, &options(bad, Sampling::Mean));
        assert!(matches!(refused, Err(CommandError::SamplingTime { .. })));
    }
    for sampling in [Sampling::Tracked, Sampling::Mean] {
        let endless = sample(&profile, &robot, &options(1e-9, sampling));
        assert!(matches!(endless, Err(CommandError::TooLong { .. })));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(48) })]
    #[test]
    fn limits_and_end_point_hold_on_random_curves(
        points in prop::array::uniform14(-2.0..2.0f64), corner in any::<bool>(), hold in 0.02..0.5f64, sampling in 0..4usize, quick in any::<bool>(),
        blade in 0.0..3.0f64,
    ) {
        let p = |i: usize| [points[2 * i], points[2 * i + 1]];
        let robot = if quick { fast() } else { fixtures::scr_db() };
        let joints = if quick { vec![] } else { vec![blade] };
        let segments = [[p(0), p(1), p(2), p(3)], [p(3), p(4), p(5), p(6)]];
        if let Ok(trajectory) = given::from_bezier(&segments[..if corner { 2 } else { 1 }], &joints) {
            let sampling = [Sampling::Tracked, Sampling::Tracked, Sampling::Mean, Sampling::Instant][sampling];
            let profile = retime(&trajectory, &robot, &RetimeOptions { law: TimeLaw::Auto, sampling_time: hold }).unwrap();
            // A near-cusp (radius of micrometres) makes one uniform slow-down take days: no table to look at.
            if profile.time() < 2000.0 {
                let table = sample(&profile, &robot, &options(hold, sampling)).unwrap();
                check(&table, &profile, &robot);
            }
        }
    }
}

#[test]
fn short_holds_are_not_slowed_down_by_rounding() {
    let line = given::from_bezier(&[[[0.0, 0.0], [4.0 / 3.0, 0.0], [8.0 / 3.0, 0.0], [4.0, 0.0]]], &[]).unwrap();
    let robot = fixtures::conv();
    for hold in [0.01, 0.02, 0.05] {
        let (profile, table) = compile(&line, &robot, TimeLaw::Auto, options(hold, Sampling::Mean));
        check(&table, &profile, &robot);
        assert!((table.duration() - 11.5).abs() < 1e-9, "{hold}: {}", table.duration());
    }
}

/// Replayed positions off the planned ones at the rows, at most, m; and what the end is off.
fn off(table: &CommandTable, profile: &MotionProfile) -> [f64; 2] {
    let replayed = table.replay(profile.pose(0.0));
    let off: Vec<f64> = replayed.iter().zip(&table.rows).map(|(pose, row)| pose.distance(row.pose)).collect();
    [off.iter().copied().fold(0.0, f64::max), off[off.len() - 1]]
}

/// The three curves of \[CONV\] section 3.
fn curves() -> [Trajectory; 3] {
    let arbitrary = [
        [[0.0, 0.0], [0.318198051534, 0.318198051534], [0.321154168974, 1.0], [1.0, 1.0]],
        [[1.0, 1.0], [1.637373495963, 1.0], [2.398959235991, 0.398959235991], [3.0, 1.0]],
    ];
    [
        given::from_bezier(&[[[0.0, 0.0], [3.0, 0.0], [4.0, 1.0], [4.0, 4.0]]], &[]).unwrap(),
        given::from_bezier(&[[[0.0, 0.0], [3.0, 0.0], [1.0, 4.0], [4.0, 4.0]]], &[]).unwrap(),
        given::from_bezier(&arbitrary, &[]).unwrap(),
    ]
}

#[test]
fn tracked_rows_are_a_tenth_as_far_off_as_means_in_the_same_time() {
    let conv = RobotModel { track_width: 0.4, ..fast() };
    for robot in [fixtures::conv(), conv] {
        for trajectory in curves() {
            let (profile, mean) = compile(&trajectory, &robot, TimeLaw::Eq5, options(0.1, Sampling::Mean));
            let table = sample(&profile, &robot, &options(0.1, Sampling::Tracked)).unwrap();
            check(&table, &profile, &robot);
            let (tracked, plain) = (off(&table, &profile), off(&mean, &profile));
            assert_eq!(table.sampling, Sampling::Tracked);
            assert!(tracked[0] <= 0.1 * plain[0] && tracked[1] < 1e-6, "{tracked:?} {plain:?}");
            assert!(table.rows.len() <= mean.rows.len() + 1);
        }
    }
}

#[test]
fn tracked_rows_come_nearer_with_the_third_power_of_the_sampling_time() {
    let robot = fixtures::conv();
    for trajectory in curves() {
        let holds = [0.05, 0.1, 0.2, 0.5];
        let logs = holds.map(|hold| {
            let (profile, table) = compile(&trajectory, &robot, TimeLaw::Eq5, options(hold, Sampling::Tracked));
            [real::ln(hold), real::ln(off(&table, &profile)[0])]
        });
        // Slope of the straight line that fits best.
        let mean = [0, 1].map(|i| logs.iter().map(|row| row[i]).sum::<f64>() / logs.len() as f64);
        let sum =
            |f: fn([f64; 2]) -> f64| -> f64 { logs.iter().map(|row| f([row[0] - mean[0], row[1] - mean[1]])).sum() };
        let order = sum(|[x, y]| x * y) / sum(|[x, _]| x * x);
        assert!(order > 3.0, "{order}");
    }
}

#[test]
fn what_arcs_replay_exactly_is_left_as_it_is() {
    // A spin, and a straight line: means are exact already, to the bit.
    let robot = fixtures::scr_db();
    let spin =
        StillLeg { pose: Pose2::new(1.0, 2.0, 0.5), yaw_end: -2.0, joints_from: vec![0.0], joints_to: vec![0.4] };
    let spin = Trajectory { legs: vec![Leg::Still(spin)], source: TrajectorySource::Search, optimiser: None };
    let line = given::from_bezier(&[[[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0]]], &[0.3]).unwrap();
    for trajectory in [spin, line] {
        let (_, mean) = compile(&trajectory, &robot, TimeLaw::Auto, options(0.1, Sampling::Mean));
        let (_, tracked) = compile(&trajectory, &robot, TimeLaw::Auto, options(0.1, Sampling::Tracked));
        assert_eq!(tracked, CommandTable { sampling: Sampling::Tracked, ..mean });
    }
}
