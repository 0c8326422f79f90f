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
    assert!(matches!(refused, RetimeError::CompensationLeavesNoSpeed { radius, .. } if radius < 0.2), "{refused:?}");
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
