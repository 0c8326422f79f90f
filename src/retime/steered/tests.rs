use super::*;
use crate::geom::Pose2;
use crate::math::poly::{Piece, PiecewisePoly};
use crate::math::real;
use crate::retime::{MotionProfile, RetimeOptions, retime};
use crate::robot::MotionLimits;
use crate::trajectory::{Leg, Trajectory, TrajectorySource, fixtures};

/// The step from 0 to `size` in `t` seconds with three vanishing derivatives at both ends, from `start`.
fn step(start: f64, size: f64, t: f64) -> Vec<f64> {
    let mut c = vec![start, 0.0, 0.0, 0.0];
    c.extend([35.0, -84.0, 70.0, -20.0].iter().enumerate().map(|(k, a)| size * a / real::powi(t, 4 + k as i32)));
    c
}

/// One piece a row: seconds, turn, distance, change of the blade.
fn steps(rows: &[[f64; 4]]) -> Trajectory {
    let mut at = [0.3, 0.0, 0.2];
    let start = Pose2::new(1.0, 2.0, at[0]);
    let pieces = rows.iter().map(|[seconds, changes @ ..]| {
        let coefficients = (0..3).map(|d| step(at[d], changes[d], *seconds)).collect();
        (0..3).for_each(|d| at[d] += changes[d]);
        Piece { duration: *seconds, coefficients }
    });
    let leg = Leg::Steer(SteerLeg { pose: start, curve: PiecewisePoly { pieces: pieces.collect() } });
    Trajectory { legs: vec![leg], source: TrajectorySource::Optimised, optimiser: None }
}

/// A spin, a bend, a cusp, backwards, blade alone.
fn all_kinds() -> Trajectory {
    steps(&[
        [2.0, 1.2, 0.0, 0.4],
        [5.0, -0.9, 1.4, 0.0],
        [4.0, 0.5, -0.8, 0.3],
        [1.0, 0.0, 0.0, 0.5],
        [3.0, 0.0, 0.7, -0.2],
    ])
}

fn bend() -> Trajectory {
    steps(&[[5.0, 1.1, 1.4, 0.3]])
}

fn timed(trajectory: &Trajectory, law: TimeLaw) -> Result<MotionProfile, RetimeError> {
    retime(trajectory, &fixtures::scr_db(), &RetimeOptions { law, sampling_time: 0.1 })
}

fn limits_hold(profile: &MotionProfile, robot: &RobotModel) {
    for i in 0..=4000 {
        let state = profile.at(profile.time() * f64::from(i) / 4000.0);
        let keeps = |jet: &[f64; 4], limits: &MotionLimits| {
            let limits = [limits.speed, limits.acceleration, limits.jerk];
            (0..3).for_each(|k| assert!(jet[k + 1].abs() <= limits[k].unwrap() * (1.0 + 1e-7), "{jet:?} at {i}"));
        };
        state.wheels.iter().for_each(|jet| keeps(jet, &robot.wheel));
        state.joints.iter().zip(&robot.joints).for_each(|(jet, joint)| keeps(jet, &joint.limits));
    }
}

/// Wheels, joints and pose agree with each other and with differences of themselves.
fn is_one_motion(profile: &MotionProfile, track: f64) {
    let h = 1e-5;
    for i in 1..80 {
        let t = profile.time() * (f64::from(i) + 0.37) / 81.0;
        let (low, at, high) = (profile.at(t - h), profile.at(t), profile.at(t + h));
        let jets = |s: &crate::retime::MotionState| [s.wheels[0], s.wheels[1], s.joints[0]];
        for ((low, at), high) in jets(&low).iter().zip(jets(&at)).zip(jets(&high)) {
            for k in 0..3 {
                let slope = (high[k] - low[k]) / (2.0 * h);
                assert!((slope - at[k + 1]).abs() < 2e-4, "order {k} at {t}: {slope} {at:?}");
            }
        }
        let (sin, cos) = real::sin_cos(at.pose.yaw);
        let v = 0.5 * (at.wheels[0][1] + at.wheels[1][1]);
        assert!(((high.pose.x - low.pose.x) / (2.0 * h) - v * cos).abs() < 1e-7);
        assert!(((high.pose.y - low.pose.y) / (2.0 * h) - v * sin).abs() < 1e-7);
        let omega = (at.wheels[1][1] - at.wheels[0][1]) / track;
        assert!(((high.pose.yaw - low.pose.yaw) / (2.0 * h) - omega).abs() < 1e-7);
    }
}

#[test]
fn spins_cusps_and_stops_are_timed_within_every_limit() {
    let robot = fixtures::scr_db();
    let mut times = Vec::new();
    for (law, name) in [(TimeLaw::Minco, "minco"), (TimeLaw::Auto, "optimal")] {
        let profile = timed(&all_kinds(), law).unwrap();
        limits_hold(&profile, &robot);
        is_one_motion(&profile, robot.track_width);
        assert!(profile.law_name().contains(name), "{}", profile.law_name());
        times.push(profile.unrounded_time());
        for t in [0.0, profile.time()] {
            let state = profile.at(t);
            state.wheels.iter().chain(&state.joints).for_each(|jet| assert!(jet[1].abs() < 1e-12, "{jet:?}"));
        }
        let end = profile.at(profile.time());
        assert!((end.pose.yaw - 1.1).abs() < 1e-12 && (end.joints[0][0] - 1.2).abs() < 1e-12);
    }
    // The leg's own seconds, which are 15 and slowed down; the least time is less.
    assert!(times[0] >= 15.0 && times[1] < times[0], "{times:?}");
}

#[test]
fn a_leg_that_overdrives_is_slowed_down_uniformly_until_its_tightest_limit_just_holds() {
    let robot = fixtures::scr_db();
    let profile = timed(&steps(&[[0.8, 1.5, 1.4, 0.0]]), TimeLaw::Minco).unwrap();
    limits_hold(&profile, &robot);
    let mut largest = 0.0f64;
    for i in 0..=20_000 {
        let state = profile.at(profile.time() * f64::from(i) / 20_000.0);
        let stretch = profile.time() / profile.unrounded_time();
        for jet in state.wheels {
            let limits = [0.5, 0.5, 2.0];
            (0..3)
                .for_each(|k| largest = largest.max(jet[k + 1].abs() * real::powi(stretch, k as i32 + 1) / limits[k]));
        }
        let centre = |k: usize| 0.5 * (state.wheels[0][k] + state.wheels[1][k]).abs() * real::powi(stretch, k as i32);
        largest = largest.max(centre(1) / robot.base.speed).max(centre(2) / robot.base.acceleration);
    }
    assert!((0.9999..1.0 + 1e-7).contains(&largest), "{largest}");
}

#[test]
fn held_means_add_up_to_the_travel() {
    let profile = timed(&all_kinds(), TimeLaw::Minco).unwrap();
    let steps = (profile.time() / 0.01).round() as usize;
    let (means, end) = (profile.mean_speeds(steps), profile.at(profile.time()));
    let sum = |i: usize| means.iter().map(|m| m[i]).sum::<f64>() * profile.time() / steps as f64;
    assert!((sum(0) - end.wheels[0][0]).abs() < 1e-12 && (sum(1) - end.wheels[1][0]).abs() < 1e-12);
    assert!((sum(2) - (end.joints[0][0] - 0.2)).abs() < 1e-12);
}

#[test]
fn laws_of_the_distance_drive_a_leg_that_stands_nowhere_and_refuse_one_that_does() {
    let robot = fixtures::scr_db();
    let reference = timed(&bend(), TimeLaw::Minco).unwrap();
    for law in [TimeLaw::Eq5, TimeLaw::FixedPoint] {
        let profile = timed(&bend(), law).unwrap();
        limits_hold(&profile, &robot);
        is_one_motion(&profile, robot.track_width);
        let (end, wanted) = (profile.pose(profile.time()), reference.pose(reference.time()));
        assert!(end.distance(wanted) < 1e-12 && (end.yaw - wanted.yaw).abs() < 1e-12);
        let refused = timed(&all_kinds(), law).unwrap_err();
        assert!(matches!(refused, RetimeError::StandsInside { time, .. } if time == 0.0), "{refused:?}");
    }
    let times = [TimeLaw::Auto, TimeLaw::Minco, TimeLaw::Eq5, TimeLaw::FixedPoint]
        .map(|law| timed(&bend(), law).unwrap().unrounded_time());
    assert!(times[1..].iter().all(|time| times[0] <= *time), "{times:?}");
}

#[test]
fn no_law_of_the_distance_changes_the_set_of_poses() {
    let trajectory = bend();
    let [Leg::Steer(leg)] = trajectory.legs.as_slice() else { panic!("one leg") };
    let curve = SteeredCurve::new(leg).unwrap();
    let profile = timed(&trajectory, TimeLaw::FixedPoint).unwrap();
    for i in 0..=200 {
        let state = profile.at(profile.time() * f64::from(i) / 200.0);
        let place = curve.place_at_travelled(0.5 * (state.wheels[0][0] + state.wheels[1][0]));
        let wanted = curve.pose(place);
        assert!(state.pose.distance(wanted) < 1e-10 && (state.pose.yaw - wanted.yaw).abs() < 1e-8, "at {i}");
        assert!((state.joints[0][0] - curve.jet(2, place)[0]).abs() < 1e-8);
    }
}

#[test]
fn one_spin_and_one_straight_get_the_law_of_everything_that_moves_in_proportion() {
    let robot = fixtures::scr_db();
    for rows in [[3.0, 1.2, 0.0, 0.4], [6.0, 0.0, -1.5, 0.4], [2.0, 0.0, 0.0, 0.9]] {
        let trajectory = steps(&[rows]);
        let [Leg::Steer(leg)] = trajectory.legs.as_slice() else { panic!("one leg") };
        let course = Course::steer(leg, robot.track_width).unwrap();
        let Course::Proportional(p) = &course else { panic!("in proportion: {rows:?}") };
        assert!((p.turn - rows[1]).abs() < 1e-12 && (p.drive - rows[2]).abs() < 1e-12);
        assert!((p.joint_changes[0] - rows[3]).abs() < 1e-12);
        for law in [TimeLaw::Minco, TimeLaw::Eq5] {
            limits_hold(&timed(&trajectory, law).unwrap(), &robot);
        }
    }
    // An arc moves both wheels in proportion too, but its pose does not move on a line.
    let [Leg::Steer(leg)] = &bend().legs[..] else { panic!("one leg") };
    assert!(matches!(Course::steer(leg, robot.track_width).unwrap(), Course::Steered(_)));
}

#[test]
fn a_message_says_where_the_base_stands_and_what_to_use() {
    use crate::diag::Describe;
    let diagnostic = timed(&all_kinds(), TimeLaw::FixedPoint).unwrap_err().diagnostic();
    assert!(diagnostic.message.contains("fixed_point") && diagnostic.hint.is_some_and(|h| h.contains("minco")));
}

#[test]
fn what_is_held_in_each_row_is_what_is_moved_in_it() {
    for (trajectory, law) in [(all_kinds(), TimeLaw::Minco), (all_kinds(), TimeLaw::Auto), (bend(), TimeLaw::Eq5)] {
        let profile = timed(&trajectory, law).unwrap();
        let (steps, mut before) = (700, profile.at(0.0));
        let hold = profile.time() / steps as f64;
        for (k, mean) in profile.mean_speeds(steps).iter().enumerate() {
            let now = profile.at((k + 1) as f64 * hold);
            let moved = |a: &crate::retime::MotionState, b: &crate::retime::MotionState| {
                [b.wheels[0][0] - a.wheels[0][0], b.wheels[1][0] - a.wheels[1][0], b.joints[0][0] - a.joints[0][0]]
            };
            for (moved, mean) in moved(&before, &now).iter().zip(mean) {
                assert!((moved - hold * mean).abs() < 1e-9, "{law:?} row {k}");
            }
            before = now;
        }
    }
}

fn steered(trajectory: &Trajectory) -> Steered {
    let [Leg::Steer(leg)] = trajectory.legs.as_slice() else { panic!("one leg") };
    match Course::steer(leg, fixtures::scr_db().track_width).unwrap() {
        Course::Steered(steered) => steered,
        _ => panic!("not in proportion"),
    }
}

#[test]
fn a_way_that_turns_changes_its_direction_or_stands_is_no_straight_line() {
    // Seconds 0 to 2: a spin; to 7: a bend; to 11: backwards; to 12: the blade alone; to 15: straight forward.
    let all = steered(&all_kinds());
    for (from, to, expected) in [
        (0.8, 1.2, true),   // spins
        (0.05, 0.1, true),  // so slowly that it does not turn far; but it stands
        (3.0, 6.0, true),   // turns by more than a tenth
        (4.4, 4.5, false),  // by less
        (6.9, 7.1, true),   // the cusp
        (11.2, 11.8, true), // stands
        (12.5, 14.5, false),
    ] {
        assert_eq!(all.turns_or_stands([from, 0.5 * (from + to), to]), expected, "{from} to {to}");
    }
}

#[test]
fn the_fixed_point_is_the_speed_at_which_the_faster_wheel_is_at_its_limit_in_the_tightest_bend() {
    // Straight, then a bend, so that curvature is not the same all along.
    for trajectory in [bend(), steps(&[[5.0, 2.5, 1.4, 0.3]])] {
        let (steered, robot) = (steered(&trajectory), fixtures::scr_db());
        let curve = &steered.curve;
        let bends = (20..=19_980).map(|i| {
            let place = curve.place(curve.duration() * f64::from(i) / 20_000.0);
            (curve.jet(0, place)[1] / curve.jet(1, place)[1]).abs()
        });
        let tightest = bends.fold(0.0, f64::max);
        assert!((steered.largest_curvature() / tightest - 1.0).abs() < 1e-4, "{}", steered.largest_curvature());
        let profile = timed(&trajectory, TimeLaw::FixedPoint).unwrap();
        let expected = 0.5 / (1.0 + 0.5 * robot.track_width * tightest);
        assert!((profile.v_max() - expected).abs() < 1e-4, "{} {expected}", profile.v_max());
        assert!((profile.v_max() + profile.v_comp() - 0.5).abs() < 1e-12);
    }
}

#[test]
fn near_its_rests_a_leg_of_the_distance_is_as_fast_as_its_places_say() {
    let profile = timed(&bend(), TimeLaw::FixedPoint).unwrap();
    let leg = &profile.legs()[0];
    let margin = NEAR_REST * leg.duration();
    for t in [0.3, 0.6, 0.9].into_iter().flat_map(|share| [share * margin, leg.duration() - share * margin]) {
        let h = 0.02 * margin;
        let (mut low, mut high, mut rates) = (Vec::new(), Vec::new(), Vec::new());
        leg.positions(t - h, &mut low);
        leg.positions(t + h, &mut high);
        leg.rates(t, &mut rates);
        for side in 0..2 {
            let slope = (high[side] - low[side]) / (2.0 * h);
            assert!((rates[side][0] / slope - 1.0).abs() < 0.02, "{} {slope} at {t}", rates[side][0]);
        }
    }
}

/// Pieces of (seconds, rows of coefficients).
fn of_pieces(pieces: &[(f64, Vec<Vec<f64>>)]) -> SteerLeg {
    let pieces = pieces.iter().map(|(duration, rows)| Piece { duration: *duration, coefficients: rows.clone() });
    SteerLeg { pose: Pose2::new(1.0, 2.0, 0.2), curve: PiecewisePoly { pieces: pieces.collect() } }
}

#[test]
fn only_what_goes_one_way_in_proportion_all_the_time_is_proportional() {
    let proportional = |rows: &[[f64; 4]]| {
        let [Leg::Steer(leg)] = &steps(rows).legs[..] else { panic!("one leg") };
        matches!(Course::steer(leg, 0.32).unwrap(), Course::Proportional(_))
    };
    // Of several pieces: a spin, a straight, the blade alone.
    for row in [[1.0, 0.5, 0.0, 0.2], [2.0, 0.0, -0.6, 0.2], [3.0, 0.0, 0.0, 0.7]] {
        assert!(proportional(&[row, row, row]) && proportional(&[row, [5.0, 0.0, 0.0, 0.0], row]), "{row:?}");
        let back = [row[0], -0.1 * row[1], -0.1 * row[2], -0.1 * row[3]];
        assert!(!proportional(&[row, back, row]), "{row:?}");
    }
    // The same blade in the end, but first the one and then the other.
    assert!(!proportional(&[[1.0, 0.5, 0.0, 0.0], [1.0, 0.0, 0.0, 0.2]]));
    assert!(!proportional(&[[1.0, 0.0, 0.5, 0.2], [1.0, 0.0, 0.5, 0.3]]));
    // Nothing at all, and a way so short that going back by a hundredth of it cannot be told.
    assert!(proportional(&[[1.0, 0.0, 0.0, 0.0]]));
    assert!(proportional(&[[1.0, 1e-9, 0.0, 0.0], [1.0, -1e-11, 0.0, 0.0], [1.0, 1e-9, 0.0, 0.0]]));
    // In one piece, away from its ends: the blade late, or the base a little too far and back.
    let rows = |turn: Vec<f64>, blade: Vec<f64>| of_pieces(&[(2.0, vec![turn, vec![0.0], blade])]);
    let bump = |size: f64| vec![0.2, 0.0, 4.0 * size, -4.0 * size, size];
    for (leg, expected) in [
        (rows(vec![0.2, 0.5], vec![0.1, 0.2]), true),
        (rows(vec![0.2, 0.5], bump(1e-3)), false),
        (rows(bump(1e-3), vec![0.1]), false),
        (rows(vec![0.2, 0.5], bump(1e-12)), true),
    ] {
        assert_eq!(matches!(Course::steer(&leg, 0.32).unwrap(), Course::Proportional(_)), expected, "{leg:?}");
    }
}

#[test]
fn travel_begins_at_nothing_wherever_the_arc_length_does_and_every_joint_has_its_row() {
    let rows = vec![vec![0.2, 0.1, 0.05], vec![5.0, 0.4, 0.02], vec![0.5, 0.3], vec![-0.5, 0.0, 0.7]];
    let leg = of_pieces(&[(2.0, rows)]);
    let Course::Steered(steered) = Course::steer(&leg, 0.32).unwrap() else { panic!("not in proportion") };
    let curve = &steered.curve;
    assert_eq!(steered.travel(curve.start()), [0.0; 2]);
    let (turn, along) = (0.2 + 0.2, 0.8 + 0.08);
    let travel = [along - 0.16 * turn, along + 0.16 * turn];
    let mut positions = Vec::new();
    steered.positions(curve.end(), &mut positions);
    let expected = [travel[0], travel[1], 1.1, 2.3];
    assert!(positions.len() == 4 && positions.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12));
    let mut moved = Vec::new();
    steered.moved(0.0, 2.0, &mut moved);
    let expected = [travel[0], travel[1], 0.6, 2.8];
    assert!(moved.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{moved:?}");
    let mut rates = Vec::new();
    steered.rates(curve.end(), [1.0, 0.0, 0.0], &mut rates);
    let expected = [0.48 - 0.16 * 0.3, 0.48 + 0.16 * 0.3, 0.3, 2.8, 0.48];
    assert!(rates.len() == 5 && rates.iter().zip(expected).all(|(a, b)| (a[0] - b).abs() < 1e-12), "{rates:?}");
}

#[test]
fn forwards_backwards_slowly_or_from_rest_a_straight_line_is_one() {
    for distance in [1.4, -1.4, 1e-4] {
        // It bends, or it would be proportional; by 0.02 rad in all.
        let steered = steered(&steps(&[[5.0, 0.02, distance, 0.0], [5.0, 0.02, distance, 0.0]]));
        for at in [[1.0, 2.0, 3.0], [0.0, 0.5, 1.0], [2.4, 2.5, 2.6], [4.0, 4.5, 5.0]] {
            assert!(!steered.turns_or_stands(at), "{distance} {at:?}");
        }
        assert!(steered.turns_or_stands([4.9, 5.0, 5.1]), "{distance}");
    }
    // A cusp that is not in the middle.
    let cusp = steered(&steps(&[[5.0, 0.02, 1.4, 0.0], [5.0, 0.02, -1.4, 0.0]]));
    for at in [[4.0, 4.5, 5.2], [4.8, 5.5, 6.0]] {
        assert!(cusp.turns_or_stands(at), "{at:?}");
    }
}

#[test]
fn the_tightest_bend_is_found_where_it_is_short_and_near_a_rest_up_to_a_thousandth_of_the_time() {
    // Straight, a bend of 0.3 s, straight; at 0.4 m/s all the time.
    let line = |from: f64, seconds: f64, turn: Vec<f64>| (seconds, vec![turn, vec![from, 0.4], vec![0.1, 1e-3]]);
    let leg = of_pieces(&[line(0.0, 4.0, vec![0.2]), line(1.6, 0.3, step(0.2, 0.3, 0.3)), line(1.72, 4.0, vec![0.5])]);
    let Course::Steered(steered) = Course::steer(&leg, 0.32).unwrap() else { panic!("not in proportion") };
    // The step is steepest in its middle: 35/16 of its mean.
    let tightest = 35.0 / 16.0 * 0.3 / 0.3 / 0.4;
    assert!((steered.largest_curvature() / tightest - 1.0).abs() < 1e-9, "{}", steered.largest_curvature());
    // A heading that begins and ends to turn sooner than the base drives: the bend is tightest at the rests.
    let steered = unending(0.1);
    let x = 1e-3;
    let tightest = 0.1 * 6.0 / (140.0 * 1.4 * x * x * (1.0 - x) * (1.0 - x));
    assert!((steered.largest_curvature() / tightest - 1.0).abs() < 1e-6, "{} {tightest}", steered.largest_curvature());
}

/// 5 s in which the base drives 1.4 m, s' as the third power of time, and turns, phi' as the time itself.
fn unending(turn: f64) -> Steered {
    let heading = vec![0.2, 0.0, 3.0 * turn / 25.0, -2.0 * turn / 125.0];
    let leg = of_pieces(&[(5.0, vec![heading, step(0.0, 1.4, 5.0), vec![0.1]])]);
    match Course::steer(&leg, 0.32).unwrap() {
        Course::Steered(steered) => steered,
        _ => panic!("not in proportion"),
    }
}

#[test]
fn a_thousandth_of_the_speed_is_enough_for_laws_of_the_distance_and_less_is_refused() {
    // Eq. 5 on an arc: what is left is v (1 - D/2 k).
    let arc = |bend: f64| steps(&[[5.0, bend / 0.16 * 1.4, 1.4, 0.3]]);
    for bend in [0.3, 1.0 - 2e-3] {
        let profile = timed(&arc(bend), TimeLaw::Eq5).unwrap();
        assert!((profile.v_max() - 0.5 * (1.0 - bend)).abs() < 1e-9, "{} {bend}", profile.v_max());
        assert!((profile.v_comp() - 0.5 * bend).abs() < 1e-9);
    }
    for bend in [1.0 - 5e-4, 1.3] {
        let refused = timed(&arc(bend), TimeLaw::Eq5).unwrap_err();
        let RetimeError::CompensationLeavesNoSpeed { radius, left, .. } = refused else { panic!("{refused:?}") };
        assert!((radius - 0.16 / bend).abs() < 1e-6 && (left - 0.5 * (1.0 - bend)).abs() < 1e-9, "{refused:?}");
    }
    // Its fixed point, v / (1 + D/2 k), is never zero, but as good as that where a bend is tight enough.
    for (bend, expected) in [(499.0, Some(1e-3)), (1999.0, None)] {
        match (timed(&arc(bend), TimeLaw::FixedPoint), expected) {
            (Ok(profile), Some(speed)) => assert!((profile.v_max() - speed).abs() < 1e-9, "{}", profile.v_max()),
            (Err(RetimeError::CompensationLeavesNoSpeed { left, .. }), None) => assert!((left - 2.5e-4).abs() < 1e-9),
            (found, _) => panic!("{bend}: {found:?}"),
        }
    }
}
