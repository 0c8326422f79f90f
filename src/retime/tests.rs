use super::*;
use crate::geom::Pose2;
use crate::math::poly::{Piece, PiecewisePoly};
use crate::math::real;
use crate::trajectory::{DriveLeg, StillLeg, fixtures, given};

const LAWS: [TimeLaw; 6] =
    [TimeLaw::Auto, TimeLaw::Optimal, TimeLaw::Minco, TimeLaw::Eq5, TimeLaw::FixedPoint, TimeLaw::Wheel];
/// The arbitrary path of \[CONV\], its second half alone.
const BEND: [[f64; 2]; 4] = [[1.0, 1.0], [1.64, 1.0], [2.4, 0.4], [3.0, 1.0]];

fn options(law: TimeLaw) -> RetimeOptions {
    RetimeOptions { law, sampling_time: 0.1 }
}

/// A curve such as the optimiser makes: two pieces of degree 7 in x, y, blade; it starts and ends at 1 cm/s and is C3 between.
fn optimised() -> Trajectory {
    // Each piece from its ends' value and first three derivatives.
    let piece = |t: f64, from: [[f64; 4]; 3], to: [[f64; 4]; 3]| Piece {
        duration: t,
        coefficients: (0..3).map(|d| septic(t, from[d], to[d]).to_vec()).collect(),
    };
    let start = [[0.0, 0.01, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0], [0.2, 0.0, 0.0, 0.0]];
    let middle = [[0.8, 0.35, 0.0, 0.0], [0.3, 0.2, 0.05, 0.0], [1.0, 0.3, 0.0, 0.0]];
    let end = [[1.5, 0.0, 0.0, 0.0], [1.2, 0.01, 0.0, 0.0], [1.5, 0.0, 0.0, 0.0]];
    let curve = PiecewisePoly { pieces: vec![piece(4.0, start, middle), piece(4.5, middle, end)] };
    let drive = DriveLeg { curve, reverse: false, yaw_start: 0.0 };
    Trajectory { legs: vec![Leg::Drive(drive)], source: TrajectorySource::Optimised, optimiser: None }
}

fn septic(t: f64, a: [f64; 4], b: [f64; 4]) -> [f64; 8] {
    let low = [a[0], a[1], a[2] / 2.0, a[3] / 6.0];
    let factor = |k: usize, order: usize| (k + 1 - order..=k).map(|m| m as f64).product::<f64>();
    let matrix = nalgebra::Matrix4::from_fn(|order, j| factor(4 + j, order) * real::powi(t, (4 + j - order) as i32));
    let right = nalgebra::Vector4::from_fn(|order, _| {
        b[order] - (order..4).map(|k| factor(k, order) * low[k] * real::powi(t, (k - order) as i32)).sum::<f64>()
    });
    let high = matrix.lu().solve(&right).unwrap();
    [low[0], low[1], low[2], low[3], high[0], high[1], high[2], high[3]]
}

/// Same motion, run from its end to its start.
fn reversed(trajectory: &Trajectory) -> Trajectory {
    let legs = trajectory.legs.iter().rev().map(|leg| match leg {
        Leg::Drive(drive) => {
            let pieces = drive.curve.pieces.iter().rev().map(|p| Piece {
                duration: p.duration,
                coefficients: p.coefficients.iter().enumerate().map(|(d, c)| shifted(c, p, d)).collect(),
            });
            let curve = PiecewisePoly { pieces: pieces.collect() };
            Leg::Drive(DriveLeg { curve, reverse: !drive.reverse, yaw_start: 0.0 })
        }
        Leg::Still(still) => Leg::Still(StillLeg {
            pose: Pose2 { yaw: still.yaw_end, ..still.pose },
            yaw_end: still.pose.yaw,
            joints_from: still.joints_to.clone(),
            joints_to: still.joints_from.clone(),
        }),
        Leg::Steer(_) => panic!("not in these tests"),
    });
    Trajectory { legs: legs.collect(), ..trajectory.clone() }
}

/// Coefficients of p(duration - u).
fn shifted(c: &[f64], piece: &Piece, dimension: usize) -> Vec<f64> {
    let factorial = |n: usize| (1..=n).map(|m| m as f64).product::<f64>();
    (0..c.len())
        .map(|k| {
            let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
            sign * piece.derivative(dimension, k, piece.duration) / factorial(k)
        })
        .collect()
}

fn limits_hold(profile: &MotionProfile, robot: &RobotModel) {
    for i in 0..=4000 {
        let state = profile.at(profile.time() * f64::from(i) / 4000.0);
        let keeps = |jet: &[f64; 4], limits: &crate::robot::MotionLimits| {
            let limits = [limits.speed, limits.acceleration, limits.jerk];
            (0..3)
                .for_each(|k| assert!(jet[k + 1].abs() <= limits[k].unwrap() * (1.0 + 1e-7), "{jet:?} of {limits:?}"));
        };
        state.wheels.iter().for_each(|jet| keeps(jet, &robot.wheel));
        state.joints.iter().zip(&robot.joints).for_each(|(jet, joint)| keeps(jet, &joint.limits));
    }
}

#[test]
fn every_law_keeps_every_limit_starts_and_ends_at_rest_and_ends_exactly() {
    let robot = fixtures::scr_db();
    for law in LAWS {
        let profile = retime(&optimised(), &robot, &options(law)).unwrap();
        limits_hold(&profile, &robot);
        for t in [0.0, profile.time()] {
            let state = profile.at(t);
            for jet in state.wheels.iter().chain(&state.joints) {
                assert!(jet[1].abs() < 1e-12 && jet[2].abs() < 1e-9, "{law:?} at {t}: {jet:?}");
            }
        }
        let end = profile.at(profile.time());
        assert!(end.pose.distance(Pose2::new(1.5, 1.2, 0.0)) < 1e-12 && (end.joints[0][0] - 1.5).abs() < 1e-12);
        assert!((end.pose.yaw - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        assert!((profile.time() / 0.1 - (profile.time() / 0.1).round()).abs() < 1e-9);
        assert!(profile.time() >= profile.unrounded_time());
    }
}

#[test]
fn auto_is_as_fast_as_the_fastest_law_and_names_it() {
    let robot = fixtures::scr_db();
    let times = LAWS.map(|law| retime(&optimised(), &robot, &options(law)).unwrap().unrounded_time());
    assert_eq!(times[0], times[1..].iter().copied().fold(f64::INFINITY, f64::min), "{times:?}");
    let auto = retime(&optimised(), &robot, &options(TimeLaw::Auto)).unwrap();
    let index = times[1..].iter().position(|t| *t == times[0]).unwrap();
    assert_eq!(auto.law_name(), format!("auto ({})", ["optimal", "minco", "eq5", "fixed_point", "wheel"][index]));
    assert_eq!(retime(&optimised(), &robot, &options(TimeLaw::Eq5)).unwrap().law_name(), "eq5");
}

#[test]
fn no_law_changes_the_set_of_poses_and_postures() {
    let robot = fixtures::scr_db();
    let reference = retime(&optimised(), &robot, &options(TimeLaw::FixedPoint)).unwrap();
    let dense: Vec<MotionState> =
        (0..=20000).map(|i| reference.at(reference.time() * f64::from(i) / 20000.0)).collect();
    for law in LAWS {
        let profile = retime(&optimised(), &robot, &options(law)).unwrap();
        for i in 0..=100 {
            let state = profile.at(profile.time() * f64::from(i) / 100.0);
            let travel = |s: &MotionState| s.wheels[0][0] + s.wheels[1][0];
            let after = dense.partition_point(|s| travel(s) < travel(&state)).clamp(1, dense.len() - 1);
            let (a, b) = (&dense[after - 1], &dense[after]);
            let share = (travel(&state) - travel(a)) / (travel(b) - travel(a)).max(1e-300);
            let between = |f: fn(&MotionState) -> f64| f(a) + share.clamp(0.0, 1.0) * (f(b) - f(a));
            let figures: [fn(&MotionState) -> f64; 4] =
                [|s| s.pose.x, |s| s.pose.y, |s| s.pose.yaw, |s| s.joints[0][0]];
            for figure in figures {
                assert!((between(figure) - figure(&state)).abs() < 1e-5, "{law:?}: {a:?} {state:?}");
            }
        }
    }
}

#[test]
fn derivatives_are_those_of_the_values() {
    let robot = fixtures::scr_db();
    for law in LAWS {
        let profile = retime(&optimised(), &robot, &options(law)).unwrap();
        let h = 1e-5;
        for i in 1..60 {
            let t = profile.time() * (f64::from(i) + 0.37) / 61.0;
            let (low, at, high) = (profile.at(t - h), profile.at(t), profile.at(t + h));
            let jets = |s: &MotionState| [s.wheels[0], s.wheels[1], s.joints[0]];
            for ((low, at), high) in jets(&low).iter().zip(jets(&at)).zip(jets(&high)) {
                for k in 0..3 {
                    assert!(((high[k] - low[k]) / (2.0 * h) - at[k + 1]).abs() < 1e-4, "{law:?} order {k} at {t}");
                }
            }
            let v = real::hypot(high.pose.x - low.pose.x, high.pose.y - low.pose.y) / (2.0 * h);
            assert!((v - 0.5 * (at.wheels[0][1] + at.wheels[1][1])).abs() < 1e-6);
            let omega = (high.pose.yaw - low.pose.yaw) / (2.0 * h);
            assert!((omega - (at.wheels[1][1] - at.wheels[0][1]) / robot.track_width).abs() < 1e-6);
        }
    }
}

#[test]
fn a_path_takes_as_long_in_the_other_direction() {
    let robot = fixtures::scr_db();
    for law in &LAWS[1..] {
        let law = *law;
        let (forth, back) = (optimised(), reversed(&optimised()));
        let [forth, back] = [forth, back].map(|t| retime(&t, &robot, &options(law)).unwrap());
        let (there, back_again) = (forth.unrounded_time(), back.unrounded_time());
        // The cells of `optimal` are not the same in both directions.
        let tolerance = if law == TimeLaw::Optimal { 5e-4 } else { 1e-7 };
        assert!((there - back_again).abs() < tolerance * there, "{law:?}: {there} {back_again}");
        // Backwards along the same poses: heading is the one that the forward drive had.
        assert!((back.pose(0.0).yaw - std::f64::consts::FRAC_PI_2).abs() < 1e-9);
        assert!(back.at(0.5 * back.time()).wheels.iter().all(|jet| jet[1] < 0.0));
    }
}

#[test]
fn legs_join_in_pose_and_travel() {
    let robot = fixtures::conv();
    // A corner of 90 degrees: drive, spin, drive.
    let first = [[0.0, 0.0], [0.4, 0.0], [0.7, 0.1], [1.0, 0.1]];
    let second = [[1.0, 0.1], [1.0, 0.4], [1.0, 0.8], [1.3, 1.2]];
    let trajectory = given::from_bezier(&[first, second], &[]).unwrap();
    assert_eq!(trajectory.legs.len(), 3);
    let profile = retime(&trajectory, &robot, &options(TimeLaw::Auto)).unwrap();
    limits_hold(&profile, &robot);
    assert_eq!((profile.joint_count(), profile.speeds(0.0)), (0, vec![0.0; 2]));
    let steps = 20000;
    let mut before = profile.at(0.0);
    for i in 1..=steps {
        let state = profile.at(profile.time() * f64::from(i) / f64::from(steps));
        let moved = before.pose.distance(state.pose);
        let turned = state.pose.yaw - before.pose.yaw;
        let [left, right] = [0, 1].map(|side: usize| state.wheels[side][0] - before.wheels[side][0]);
        assert!((0.5 * (left + right) - moved).abs() < 1e-8 && ((right - left) / 0.4 - turned).abs() < 1e-8);
        before = state;
    }
}

#[test]
fn a_curve_tighter_than_half_the_track_is_refused_by_eq5_and_driven_by_auto() {
    let robot = fixtures::conv();
    let hairpin = [[0.0, 0.0], [1.0, 0.0], [1.0, 0.05], [0.0, 0.05]];
    let trajectory = given::from_bezier(&[hairpin], &[]).unwrap();
    let refused = retime(&trajectory, &robot, &options(TimeLaw::Eq5)).unwrap_err();
    let RetimeError::CompensationLeavesNoSpeed { radius, left, .. } = refused else { panic!("{refused:?}") };
    assert!(radius < 0.2 && left <= 5e-4, "{refused:?}");
    assert!(refused.diagnostic().hint.is_some());
    let profile = retime(&trajectory, &robot, &options(TimeLaw::Auto)).unwrap();
    assert_eq!(profile.law_name(), "auto (optimal)");
    limits_hold(&profile, &robot);
}

#[test]
fn laws_that_cannot_time_a_path_say_so() {
    let robot = fixtures::conv();
    let given = given::from_bezier(&[BEND], &[]).unwrap();
    assert_eq!(retime(&given, &robot, &options(TimeLaw::Minco)).unwrap_err(), RetimeError::NoOwnTiming);
    assert!(retime(&given, &robot, &options(TimeLaw::Printed)).is_ok());
    let two = given::from_bezier(&[[[0.0, 1.0], [0.3, 1.0], [0.6, 1.0], [1.0, 1.0]], BEND], &[]).unwrap();
    assert_eq!(retime(&two, &robot, &options(TimeLaw::Printed)).unwrap_err(), RetimeError::PrintedNeedsOneSegment);
    let blade = fixtures::scr_db();
    assert!(matches!(
        retime(&given, &blade, &options(TimeLaw::Auto)).unwrap_err(),
        RetimeError::Joints { leg: 0, found: 0, expected: 1 }
    ));
    let never = RetimeOptions { law: TimeLaw::Auto, sampling_time: 0.0 };
    assert!(matches!(retime(&given, &robot, &never).unwrap_err(), RetimeError::SamplingTime { .. }));
}

#[test]
fn spins_obey_the_base_and_joints_their_own_limits() {
    let mut robot = fixtures::scr_db();
    (robot.base.angular_speed, robot.base.angular_acceleration) = (0.8, 0.7);
    let still =
        StillLeg { pose: Pose2::new(0.0, 0.0, 0.0), yaw_end: 3.0, joints_from: vec![0.0], joints_to: vec![1.5] };
    let legs = vec![Leg::Still(still)];
    let trajectory = Trajectory { legs, source: TrajectorySource::Search, optimiser: None };
    let profile = retime(&trajectory, &robot, &options(TimeLaw::Auto)).unwrap();
    limits_hold(&profile, &robot);
    let turns = (0..=1000).map(|i| {
        let [left, right] = profile.at(profile.unrounded_time() * f64::from(i) / 1000.0).wheels;
        [1, 2].map(|k| (right[k] - left[k]) / robot.track_width)
    });
    let peaks = turns.fold([0.0f64; 2], |peak, turn| [peak[0].max(turn[0].abs()), peak[1].max(turn[1].abs())]);
    assert!((0.75..=0.8 + 1e-12).contains(&peaks[0]) && (0.65..=0.7 + 1e-12).contains(&peaks[1]), "{peaks:?}");
}

#[test]
fn optimal_keeps_what_the_base_may_do_on_a_curve() {
    let mut robot = fixtures::conv();
    let bend = given::from_bezier(&[BEND], &[]).unwrap();
    let free = retime(&bend, &robot, &options(TimeLaw::Auto)).unwrap();
    robot.base = crate::robot::BaseLimits { eta: 0.4, angular_speed: 0.4, angular_acceleration: 0.15, ..robot.base };
    for law in [TimeLaw::Auto, TimeLaw::Optimal] {
        let profile = retime(&bend, &robot, &options(law)).unwrap();
        limits_hold(&profile, &robot);
        assert!(profile.time() > free.time());
        let mut peaks = [0.0f64; 3];
        for i in 0..=4000 {
            let [left, right] = profile.at(profile.time() * f64::from(i) / 4000.0).wheels;
            let [v, omega, alpha] =
                [0.5 * (left[1] + right[1]), (right[1] - left[1]) / 0.4, (right[2] - left[2]) / 0.4];
            peaks[0] = peaks[0].max(omega.abs() / 0.4);
            peaks[1] = peaks[1].max(alpha.abs() / 0.15);
            peaks[2] = peaks[2].max(omega.abs() / (2.0 * 0.4 * (0.5 - v) / 0.4));
        }
        assert!(peaks.iter().all(|peak| *peak <= 1.0 + 1e-6), "{peaks:?}");
        // Rounding up to whole rows has slowed it down since.
        assert!(peaks[1] > 0.95 && peaks[2] > 0.95, "{peaks:?}");
    }
}

#[test]
fn no_bend_is_too_tight_and_no_path_too_short_or_too_long() {
    let robot = fixtures::conv();
    // A quarter of a circle, nearly: of radius 1 um, 0.1 mm (curvature 1e4), 1 m, 600 m (a path of 1 km).
    for radius in [1e-6, 1e-4, 1.0, 600.0] {
        let k = 0.5522847498 * radius;
        let quarter = [[0.0, 0.0], [k, 0.0], [radius, radius - k], [radius, radius]];
        let profile = retime(&given::from_bezier(&[quarter], &[]).unwrap(), &robot, &options(TimeLaw::Auto)).unwrap();
        limits_hold(&profile, &robot);
        // The faster wheel's travel, from rest to rest.
        let travel = profile.at(profile.time()).wheels[1][0];
        let least = convolution::Convolution::fastest(travel, [0.5, 0.2, 0.2]).duration();
        let over = profile.unrounded_time() / least - 1.0;
        assert!((-1e-6..0.02).contains(&over), "radius {radius}: {} s, {least} s", profile.unrounded_time());
    }
    // A hairpin with a curvature of 1e4 at its end: nearly a turn on the spot.
    let hairpin = [[0.0, 0.0], [1.0, 0.0], [1.0, 2e-3], [0.0, 2e-3]];
    let trajectory = given::from_bezier(&[hairpin], &[]).unwrap();
    let profile = retime(&trajectory, &robot, &options(TimeLaw::Auto)).unwrap();
    limits_hold(&profile, &robot);
    let stop_spin_go = [1.0, std::f64::consts::PI * 0.2, 1.0]
        .map(|travel| convolution::Convolution::fastest(travel, [0.5, 0.2, 0.2]).duration());
    assert!(profile.time() < stop_spin_go.iter().sum(), "{} s", profile.time());
}

/// A straight drive of one piece, whose joints move as the way does.
fn straight(from: Pose2, length: f64, reverse: bool, blade: [f64; 2]) -> Leg {
    let direction = if reverse { -1.0 } else { 1.0 };
    let (sin, cos) = real::sin_cos(from.yaw);
    let line = |from: f64, change: f64| vec![from, 0.5 * change];
    let coefficients = vec![
        line(from.x, direction * length * cos),
        line(from.y, direction * length * sin),
        line(blade[0], blade[1] - blade[0]),
    ];
    let curve = PiecewisePoly { pieces: vec![Piece { duration: 2.0, coefficients }] };
    Leg::Drive(DriveLeg { curve, reverse, yaw_start: from.yaw })
}

/// A straight drive backwards, a spin with the blade, and a curve; in each the blade moves.
fn three_legs() -> Trajectory {
    let start = Pose2::new(1.0, 2.0, 0.5);
    let (sin, cos) = real::sin_cos(start.yaw);
    let corner = Pose2::new(1.0 - 0.9 * cos, 2.0 - 0.9 * sin, 0.5);
    let spin = StillLeg { pose: corner, yaw_end: 1.7, joints_from: vec![0.9], joints_to: vec![0.2] };
    let mut legs = vec![straight(start, 0.9, true, [0.3, 0.9]), Leg::Still(spin)];
    // The optimiser's curve begins at the origin, along x.
    let turned = |c: &[Vec<f64>], k: usize| {
        let (sin, cos) = real::sin_cos(1.7);
        [c[0][k] * cos - c[1][k] * sin, c[0][k] * sin + c[1][k] * cos]
    };
    let Leg::Drive(drive) = optimised().legs.remove(0) else { panic!("a drive") };
    let pieces = drive.curve.pieces.into_iter().map(|piece| {
        let c = &piece.coefficients;
        let mut xy: [Vec<f64>; 2] = [0, 1].map(|axis| (0..c[0].len()).map(|k| turned(c, k)[axis]).collect());
        (xy[0][0], xy[1][0]) = (xy[0][0] + corner.x, xy[1][0] + corner.y);
        let [x, y] = xy;
        Piece { duration: piece.duration, coefficients: vec![x, y, c[2].clone()] }
    });
    let curve = PiecewisePoly { pieces: pieces.collect() };
    legs.push(Leg::Drive(DriveLeg { curve, reverse: false, yaw_start: 1.7 }));
    Trajectory { legs, source: TrajectorySource::Optimised, optimiser: None }
}

#[test]
fn over_three_legs_poses_postures_and_speeds_are_those_of_one_motion() {
    let robot = fixtures::scr_db();
    for law in [TimeLaw::Auto, TimeLaw::Minco, TimeLaw::FixedPoint] {
        let profile = retime(&three_legs(), &robot, &options(law)).unwrap();
        limits_hold(&profile, &robot);
        assert_eq!((profile.joint_count(), profile.legs().len()), (1, 3));
        let start = profile.at(0.0);
        assert!(start.pose.distance(Pose2::new(1.0, 2.0, 0.5)) < 1e-12 && (start.pose.yaw - 0.5).abs() < 1e-12);
        assert!((start.joints[0][0] - 0.3).abs() < 1e-12);
        let end = profile.at(profile.time());
        assert!(
            (end.pose.yaw - 1.7 - std::f64::consts::FRAC_PI_2).abs() < 1e-9 && (end.joints[0][0] - 1.5).abs() < 1e-9
        );
        // Small steps, each from the one before: the motion is what its speeds add up to.
        let (steps, track) = (8000, robot.track_width);
        let hold = profile.time() / f64::from(steps);
        let means = profile.mean_speeds(steps as usize);
        let mut before = start;
        for (k, mean) in means.iter().enumerate() {
            let t = (k + 1) as f64 * hold;
            let now = profile.at(t);
            for ((now, before), mean) in now.wheels.iter().zip(&before.wheels).zip(mean) {
                assert!((now[0] - before[0] - hold * mean).abs() < 1e-10, "{law:?} at {t}");
            }
            assert!((now.joints[0][0] - before.joints[0][0] - hold * mean[2]).abs() < 1e-10, "{law:?} at {t}");
            let middle = before.pose.yaw + 0.25 * hold * (mean[1] - mean[0]) / track * 2.0;
            let along = 0.5 * hold * (mean[0] + mean[1]);
            let moved =
                Pose2::new(before.pose.x + along * real::cos(middle), before.pose.y + along * real::sin(middle), 0.0);
            assert!(now.pose.distance(moved) < 1e-7, "{law:?} at {t}");
            assert!((now.pose.yaw - before.pose.yaw - hold * (mean[1] - mean[0]) / track).abs() < 1e-9);
            if k % 50 == 0 {
                let speeds = profile.speeds(t);
                let each = now.wheels.iter().chain(&now.joints).map(|jet| jet[1]);
                assert!(
                    speeds.iter().zip(each).all(|(a, b)| (a - b).abs() < 1e-12) && speeds.len() == 3,
                    "{law:?} at {t}"
                );
                assert!((profile.joints(t)[0] - now.joints[0][0]).abs() < 1e-12 && profile.joints(t).len() == 1);
            }
            before = now;
        }
        for t in [-1.0, 0.0, profile.time(), profile.time() + 1.0] {
            assert_eq!(profile.speeds(t), [0.0; 3]);
        }
    }
}

#[test]
fn a_straight_drive_is_in_proportion_and_is_halfway_with_its_joints_at_half_time() {
    let robot = fixtures::scr_db();
    for (reverse, sign) in [(false, 1.0), (true, -1.0)] {
        let start = Pose2::new(1.0, 2.0, 0.5);
        let leg = straight(start, 1.2, reverse, [0.3, 0.9]);
        let course = course(&leg, 0, &robot).unwrap();
        let Course::Proportional(p) = &course else { panic!("in proportion") };
        assert!((p.drive - sign * 1.2).abs() < 1e-12 && p.turn == 0.0 && (p.joint_changes[0] - 0.6).abs() < 1e-12);
        let trajectory = Trajectory { legs: vec![leg], source: TrajectorySource::Search, optimiser: None };
        let profile = retime(&trajectory, &robot, &options(TimeLaw::Auto)).unwrap();
        let middle = profile.at(0.5 * profile.time());
        let place = start.after_twist(sign * 0.6, 0.0, 1.0);
        assert!(middle.pose.distance(place) < 1e-9 && (middle.joints[0][0] - 0.6).abs() < 1e-9);
        assert_eq!(profile.law_name(), "auto");
        // Nor does it matter how fast the curve's parameter is, or that it would turn back beyond its end.
        let Leg::Drive(mut uneven) = straight(start, 1.2, reverse, [0.3, 0.9]) else { panic!("a drive") };
        for row in &mut uneven.curve.pieces[0].coefficients {
            // Of the change: 0.9 u - 0.2 u^2, which is 1 at 2 s.
            *row = vec![row[0], 1.8 * row[1], -0.4 * row[1]];
        }
        let uneven = super::course(&Leg::Drive(uneven), 0, &robot).unwrap();
        assert!(matches!(uneven, Course::Proportional(_)));
        // The same curve, but its blade is late by a thousandth, or its end off by as much.
        let Leg::Drive(mut bent) = straight(start, 1.2, reverse, [0.3, 0.9]) else { panic!("a drive") };
        for dimension in [0, 1, 2] {
            let coefficients = &mut bent.curve.pieces[0].coefficients[dimension];
            let straight = coefficients.clone();
            // 1e-3 u (2 - u): nothing at both ends.
            *coefficients = vec![straight[0], straight[1] + 2e-3, -1e-3];
            let other = super::course(&Leg::Drive(bent.clone()), 0, &robot).unwrap();
            assert!(matches!(other, Course::Curved(_)), "{dimension}");
            bent.curve.pieces[0].coefficients[dimension] = straight;
        }
    }
}

#[test]
fn a_still_leg_goes_from_its_heading_and_posture_to_the_others() {
    let robot = fixtures::scr_db();
    let still =
        StillLeg { pose: Pose2::new(3.0, -1.0, 0.7), yaw_end: -0.4, joints_from: vec![0.5], joints_to: vec![1.4] };
    let trajectory =
        Trajectory { legs: vec![Leg::Still(still.clone())], source: TrajectorySource::Search, optimiser: None };
    let profile = retime(&trajectory, &robot, &options(TimeLaw::Auto)).unwrap();
    for (t, yaw, blade) in [(0.0, 0.7, 0.5), (0.5, 0.15, 0.95), (1.0, -0.4, 1.4)] {
        let state = profile.at(t * profile.time());
        assert!((state.pose.yaw - yaw).abs() < 1e-12 && (state.joints[0][0] - blade).abs() < 1e-12, "{state:?}");
        assert_eq!((state.pose.x, state.pose.y), (3.0, -1.0));
    }
    let travel = profile.at(profile.time()).wheels.map(|jet| jet[0]);
    assert!((travel[0] - 0.16 * 1.1).abs() < 1e-12 && (travel[1] + 0.16 * 1.1).abs() < 1e-12, "{travel:?}");
    // What does not move takes one row.
    let rest = StillLeg { yaw_end: 0.7, joints_to: vec![0.5], ..still.clone() };
    let nothing = Trajectory { legs: vec![Leg::Still(rest)], ..trajectory.clone() };
    let nothing = retime(&nothing, &robot, &options(TimeLaw::Auto)).unwrap();
    assert_eq!((nothing.time(), nothing.unrounded_time()), (0.1, 0.0));
    assert!((nothing.at(0.05).pose.yaw - 0.7).abs() < 1e-12 && (nothing.at(0.05).joints[0][0] - 0.5).abs() < 1e-12);
    assert_eq!(nothing.mean_speeds(2), [[0.0; 3], [0.0; 3]]);
    // Postures of different sizes are no leg of this robot.
    for (from, to) in [(vec![0.0], vec![0.0; 2]), (vec![0.0; 2], vec![0.0])] {
        let odd = Leg::Still(StillLeg { joints_from: from, joints_to: to, ..still.clone() });
        assert!(matches!(super::course(&odd, 4, &robot), Err(RetimeError::Joints { leg: 4, found: 2, expected: 1 })));
    }
}

#[test]
fn a_spin_keeps_equation_fourteen() {
    let mut robot = fixtures::conv();
    robot.base.eta = 0.3;
    let spin = StillLeg { pose: Pose2::default(), yaw_end: 6.0, joints_from: vec![], joints_to: vec![] };
    let trajectory = Trajectory { legs: vec![Leg::Still(spin)], source: TrajectorySource::Search, optimiser: None };
    let profile = retime(&trajectory, &robot, &options(TimeLaw::Auto)).unwrap();
    let fastest = (0..=1000).map(|i| profile.at(profile.unrounded_time() * f64::from(i) / 1000.0).wheels[1][1]);
    let fastest = fastest.fold(0.0, f64::max) / 0.2 * profile.time() / profile.unrounded_time();
    // 2 eta v / D: 2 x 0.3 x 0.5 / 0.4 rad/s.
    assert!((fastest - 0.75).abs() < 1e-9, "{fastest}");
}

#[test]
fn the_speed_that_a_profile_reports_is_the_centres_greatest_or_what_compensation_left() {
    let robot = fixtures::scr_db();
    for law in [TimeLaw::Optimal, TimeLaw::Minco, TimeLaw::Wheel] {
        let profile = retime(&optimised(), &robot, &options(law)).unwrap();
        let speeds = (0..=20_000).map(|i| {
            let [left, right] = profile.at(profile.time() * f64::from(i) / 20_000.0).wheels;
            0.5 * (left[1] + right[1])
        });
        let fastest = speeds.fold(0.0, f64::max) * profile.time() / profile.unrounded_time();
        assert!((profile.v_max() - fastest).abs() < 1e-5, "{law:?}: {} {fastest}", profile.v_max());
        assert_eq!(profile.v_comp(), 0.0);
    }
    for law in [TimeLaw::Eq5, TimeLaw::FixedPoint] {
        let profile = retime(&optimised(), &robot, &options(law)).unwrap();
        assert!(profile.v_comp() > 0.01 && (profile.v_max() + profile.v_comp() - 0.5).abs() < 1e-12, "{law:?}");
        // A straight drive before it is not compensated.
        let three = retime(&three_legs(), &robot, &options(law)).unwrap();
        assert!((three.v_comp() - profile.v_comp()).abs() < 1e-6 && (three.v_max() - profile.v_max()).abs() < 1e-6);
    }
}

#[test]
fn a_profile_slowed_down_passes_the_same_places_later_and_is_never_made_faster() {
    let robot = fixtures::scr_db();
    let profile = retime(&optimised(), &robot, &options(TimeLaw::FixedPoint)).unwrap();
    let slow = profile.slowed_to(2.0 * profile.time());
    assert_eq!(slow.time(), 2.0 * profile.time());
    let (at, later) = (profile.at(0.4 * profile.time()), slow.at(0.8 * profile.time()));
    assert!(at.pose.distance(later.pose) < 1e-12 && (at.wheels[0][1] - 2.0 * later.wheels[0][1]).abs() < 1e-12);
    assert_eq!(profile.slowed_to(0.5 * profile.time()).time(), profile.time());
}

/// The greatest speed of the base in each of the zones and anywhere, m/s.
fn zone_speeds(profile: &MotionProfile, zones: &[SpeedZone]) -> (Vec<f64>, f64) {
    let (mut within, mut fastest) = (vec![0.0f64; zones.len()], 0.0f64);
    for i in 0..=4000 {
        let state = profile.at(profile.time() * f64::from(i) / 4000.0);
        let speed = 0.5 * (state.wheels[0][1] + state.wheels[1][1]).abs();
        fastest = fastest.max(speed);
        for (zone, most) in zones.iter().zip(&mut within) {
            if crate::geom::distance_to_area([state.pose.x, state.pose.y], &zone.polygon) == 0.0 {
                *most = most.max(speed);
            }
        }
    }
    (within, fastest)
}

#[test]
fn zones_are_driven_slowly_and_the_rest_of_the_way_fast() {
    let robot = fixtures::conv();
    let strip = |from: f64, to: f64, speed: f64| SpeedZone {
        polygon: vec![[from, -9.0], [to, -9.0], [to, 9.0], [from, 9.0]],
        speed,
    };
    let line = given::from_bezier(&[[[0.0, 1.0], [2.0, 1.0], [4.0, 1.0], [6.0, 1.0]]], &[]).unwrap();
    let bend = given::from_bezier(&[BEND], &[]).unwrap();
    let zones_of_line = vec![strip(2.5, 3.0, 0.2), strip(3.4, 3.5, 0.1)];
    let zones_of_bend = vec![strip(1.9, 2.1, 0.15)];
    for (trajectory, zones, cruise) in [(&line, &zones_of_line, 0.48), (&bend, &zones_of_bend, 0.2)] {
        let free = retime(trajectory, &robot, &options(TimeLaw::Auto)).unwrap();
        for law in [TimeLaw::Auto, TimeLaw::Optimal, TimeLaw::FixedPoint] {
            let profile = retime_in(trajectory, &robot, &options(law), zones).unwrap();
            limits_hold(&profile, &robot);
            let (within, fastest) = zone_speeds(&profile, zones);
            for (zone, speed) in zones.iter().zip(&within) {
                assert!(*speed <= zone.speed, "{law:?}: {speed} where {} is allowed", zone.speed);
            }
            if law == TimeLaw::FixedPoint {
                // The whole leg is slower, until the tightest zone just is what it should be.
                let tightest = zones.iter().zip(&within).map(|(zone, speed)| speed / zone.speed).fold(0.0, f64::max);
                assert!(tightest > 0.95 && fastest < 0.3, "{tightest} {fastest}");
            } else {
                assert!(within.iter().zip(zones).all(|(speed, zone)| *speed > 0.9 * zone.speed), "{law:?} {within:?}");
                assert!(fastest > cruise && profile.time() > free.time(), "{law:?} {fastest}");
                let slow = retime_in(trajectory, &robot, &options(TimeLaw::FixedPoint), zones).unwrap();
                assert!(profile.time() < 0.8 * slow.time());
            }
        }
        // A zone beside the way, or one that allows more than is driven, changes nothing.
        for beside in [strip(90.0, 91.0, 0.1), strip(-9.0, 9.0, 3.0)] {
            let same = retime_in(trajectory, &robot, &options(TimeLaw::FixedPoint), &[beside]).unwrap();
            let without = retime(trajectory, &robot, &options(TimeLaw::FixedPoint)).unwrap();
            assert_eq!(same.unrounded_time(), without.unrounded_time());
        }
    }
}
