use super::*;
use crate::math::poly::{Piece, PiecewisePoly};
use crate::math::real;
use crate::mission::TimeLaw;
use crate::retime::{RetimeOptions, retime};
use crate::trajectory::{Leg, SteerLeg, Trajectory, TrajectorySource, fixtures, given};

/// The C-curve of \[CONV\] section 3.
const C_CURVE: [[f64; 2]; 4] = [[0.0, 0.0], [3.0, 0.0], [4.0, 1.0], [4.0, 4.0]];
const S_CURVE: [[f64; 2]; 4] = [[0.0, 0.0], [3.0, 0.0], [1.0, 4.0], [4.0, 4.0]];

fn profile(segments: &[[[f64; 2]; 4]]) -> (MotionProfile, RobotModel) {
    let robot = fixtures::conv();
    let options = RetimeOptions { law: TimeLaw::Eq5, sampling_time: 0.1 };
    let trajectory = given::from_bezier(segments, &[]).unwrap();
    (retime(&trajectory, &robot, &options).unwrap(), robot)
}

fn plain(segments: &[[[f64; 2]; 4]], sampling: Sampling, sampling_time: f64) -> PathErrorRow {
    let (profile, robot) = profile(segments);
    let table = sample_uncorrected(&profile, &robot, &SampleOptions { sampling_time, sampling }).unwrap();
    path_error_of_table(&table, profile.pose(0.0), &PathReference::new(&profile))
}

#[test]
fn lateral_and_end_point_error_fall_with_the_square_of_the_sampling_time() {
    for curve in [C_CURVE, S_CURVE] {
        for sampling in [Sampling::Mean, Sampling::Instant] {
            let [coarse, fine] = [0.2, 0.05].map(|time| plain(&[curve], sampling, time));
            let order = |coarse: f64, fine: f64| real::log2(coarse / fine) / 2.0;
            assert!((order(coarse.lateral_max, fine.lateral_max) - 2.0).abs() < 0.15, "{coarse:?} {fine:?}");
            assert!((order(coarse.end_point, fine.end_point) - 2.0).abs() < 0.15, "{coarse:?} {fine:?}");
        }
    }
}

#[test]
fn the_c_curve_misses_its_end_by_what_the_expansion_says() {
    // dt^2/12 |integral of v^3 k'(s) n dt|: 0.06 mm at 0.1 s with `mean`, half of it with `instant`.
    let [mean, instant] = [Sampling::Mean, Sampling::Instant].map(|s| plain(&[C_CURVE], s, 0.1));
    assert!((0.03e-3..0.08e-3).contains(&mean.end_point), "{mean:?}");
    assert!((0.4..0.6).contains(&(instant.end_point / mean.end_point)), "{instant:?}");
    assert!(mean.end_heading < 1e-12);
}

#[test]
fn distances_to_a_given_curve_are_those_to_its_positions() {
    let (profile, _) = profile(&[C_CURVE]);
    let reference = PathReference::new(&profile);
    let dense = positions(&profile);
    for i in 0..400 {
        let (a, b) = (f64::from(i % 20), f64::from(i / 20));
        let point = [-1.0 + a * 0.3, -0.7 + b * 0.31];
        let brute = nearest(&dense, point);
        let found = reference.distance(point);
        // The search for the foot ends within 1e-9 of the distance; positions are up to half of 0.1 mm beside it.
        assert!(found <= brute * (1.0 + 1e-9) && found > brute - 2e-9 / brute, "{point:?}: {found} vs {brute}");
    }
}

/// Positions at 100 001 times.
fn positions(profile: &MotionProfile) -> Vec<[f64; 2]> {
    let poses = (0..=100_000).map(|i| profile.pose(profile.time() * f64::from(i) / 100_000.0));
    poses.map(|pose| [pose.x, pose.y]).collect()
}

fn nearest(positions: &[[f64; 2]], point: [f64; 2]) -> f64 {
    positions.iter().map(|p| real::hypot(p[0] - point[0], p[1] - point[1])).fold(f64::INFINITY, f64::min)
}

#[test]
fn rows_come_in_order_and_carry_the_clearance_of_their_table() {
    let (profile, robot) = profile(&[C_CURVE]);
    let clearance = |table: &CommandTable| Some(table.sampling_time * 2.0);
    let rows = path_errors(&profile, &robot, &[0.05, 0.1, 0.5], &[Sampling::Mean], clearance).unwrap();
    assert_eq!(
        rows.iter().map(|r| (r.sampling_time, r.clearance_min)).collect::<Vec<_>>(),
        [(0.05, Some(0.1)), (0.1, Some(0.2)), (0.5, Some(1.0))]
    );
    assert!(rows.iter().all(|row| row.end_point <= 0.5e-3), "{rows:?}");
    assert!(rows[0].lateral_max < rows[2].lateral_max);
}

#[test]
fn a_corner_between_straight_legs_is_no_error() {
    // Straight drives and a spin are replayed exactly, so what is left is rounding, also in the first millimetre behind the corner.
    let straight = |a: [f64; 2], b: [f64; 2]| {
        let at = |share: f64| [a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1])];
        [a, at(1.0 / 3.0), at(2.0 / 3.0), b]
    };
    let row = plain(&[straight([0.0, 0.0], [1.0, 0.0]), straight([1.0, 0.0], [1.3, 0.9])], Sampling::Mean, 0.01);
    assert!(row.lateral_max < 1e-8, "{row:?}");
}

/// A leg of heading and arc length, at rest at each join: (seconds, turn, distance) a piece.
fn steered(rows: &[[f64; 3]]) -> (MotionProfile, RobotModel) {
    let mut at = [0.4, 0.0];
    let pieces = rows.iter().map(|[seconds, changes @ ..]| {
        let step = |d: usize| {
            let mut c = vec![at[d], 0.0, 0.0, 0.0];
            let powers = [35.0, -84.0, 70.0, -20.0].iter().enumerate();
            c.extend(powers.map(|(k, a)| changes[d] * a / real::powi(*seconds, 4 + k as i32)));
            c
        };
        let coefficients = vec![step(0), step(1)];
        (0..2).for_each(|d| at[d] += changes[d]);
        Piece { duration: *seconds, coefficients }
    });
    let curve = PiecewisePoly { pieces: pieces.collect() };
    let leg = Leg::Steer(SteerLeg { pose: Pose2::new(0.1, -0.2, 0.4), curve });
    let trajectory = Trajectory { legs: vec![leg], source: TrajectorySource::Optimised, optimiser: None };
    let robot = fixtures::conv();
    let options = RetimeOptions { law: TimeLaw::Minco, sampling_time: 0.1 };
    (retime(&trajectory, &robot, &options).unwrap(), robot)
}

#[test]
fn corners_and_cusps_within_one_leg_are_no_error() {
    let (profile, robot) =
        steered(&[[4.0, 0.0, 0.8], [3.0, 1.1, 0.0], [4.0, 0.0, 0.7], [4.0, 0.0, -0.3], [3.0, -2.0, 0.0]]);
    let reference = PathReference::new(&profile);
    for sampling_time in [0.01, 0.1] {
        let options = SampleOptions { sampling_time, sampling: Sampling::Mean };
        let table = sample_uncorrected(&profile, &robot, &options).unwrap();
        let row = path_error_of_table(&table, profile.pose(0.0), &reference);
        assert!(row.lateral_max < 1e-8 && row.end_point < 1e-8, "{row:?}");
    }
}

#[test]
fn distances_to_a_leg_of_heading_and_arc_length_are_those_to_its_positions() {
    let (profile, _) = steered(&[[5.0, 1.4, 1.2], [3.0, 0.8, 0.0], [4.0, -0.9, -0.7]]);
    let reference = PathReference::new(&profile);
    let dense = positions(&profile);
    for i in 0..100 {
        let point = [-0.3 + 0.15 * f64::from(i % 10), -0.5 + 0.17 * f64::from(i / 10)];
        let (brute, found) = (nearest(&dense, point), reference.distance(point));
        // The search for the foot ends within 1e-9 of the distance.
        assert!(found <= brute * (1.0 + 1e-9) && found > brute - 1e-6, "{point:?}: {found} vs {brute}");
    }
}

#[test]
fn looking_along_the_path_finds_its_own_stretch_or_what_is_nearer() {
    // Curves, corners and cusps; near the path, and too far off for a look beside it.
    let given = profile(&[C_CURVE]).0;
    let stepped = steered(&[[5.0, 1.4, 1.2], [3.0, 0.8, 0.0], [4.0, -0.9, -0.7], [4.0, 0.7, 0.9]]).0;
    for profile in [given, stepped] {
        let reference = PathReference::new(&profile);
        for aside in [0.0, 1e-9, 1e-6, 2e-4, 3e-3] {
            let (mut cursor, mut travelled, mut before, mut same) = (0, 0.0, profile.pose(0.0), 0);
            for i in 0..2000 {
                let pose = profile.pose(profile.time() * f64::from(i) / 2000.0);
                // As a replay knows it: from speeds, so only nearly.
                for part in 1..=20 {
                    let next = profile.pose(profile.time() * (f64::from(i) - 1.0 + f64::from(part) / 20.0) / 2000.0);
                    travelled += next.distance(before);
                    before = next;
                }
                let (sin, cos) = real::sin_cos(1.1 * f64::from(i));
                let point = [pose.x + aside * cos, pose.y + aside * sin];
                let along = reference.distance_along(point, travelled, &mut cursor);
                let everywhere = reference.distance(point);
                assert!(along >= everywhere - 1e-4 * everywhere - 2e-9, "{i} {aside}: {along} {everywhere}");
                assert!(along <= aside + 2e-9, "{i} {aside}: {along}");
                same += usize::from((along - everywhere).abs() <= 1e-4 * everywhere + 2e-9);
            }
            // But where another stretch of the path passes nearer: many points are close to a corner, since the base rests there.
            assert!(same > 1800, "{same} of 2000 at {aside}");
        }
    }
}

#[test]
fn an_arc_at_constant_curvature_is_no_error_and_a_clothoid_leaves_what_one_arc_must() {
    // Heading and distance in proportion: a circle. Twice the distance in the second half of the turn, smoothly: curvature falls.
    let (circle, robot) = steered(&[[8.0, 2.0, 1.5]]);
    let table = sample(&circle, &robot, &SampleOptions { sampling_time: 0.1, sampling: Sampling::Tracked }).unwrap();
    let row = path_error_of_table(&table, circle.pose(0.0), &PathReference::new(&circle));
    assert!(row.lateral_max < 1e-9 && row.end_point < 1e-9, "{row:?}");

    let (profile, robot) = profile(&[C_CURVE]);
    let reference = PathReference::new(&profile);
    let table = sample(&profile, &robot, &SampleOptions { sampling_time: 0.1, sampling: Sampling::Tracked }).unwrap();
    let row = path_error_of_table(&table, profile.pose(0.0), &reference);
    // k' s^3/(72 sqrt 3) of the row that has most of it; k' from the planned headings.
    let least = table.rows.windows(3).map(|rows| {
        let [a, b] = [[0, 1], [1, 2]].map(|[i, j]| {
            let length = rows[i].pose.distance(rows[j].pose);
            ((rows[j].pose.yaw - rows[i].pose.yaw) / length, length)
        });
        if a.1.min(b.1) < 1e-4 { 0.0 } else { ((b.0 - a.0) / (0.5 * (a.1 + b.1))).abs() * real::powi(a.1.max(b.1), 3) }
    });
    let least = least.fold(0.0, f64::max) / (72.0 * 3f64.sqrt());
    assert!((0.97..1.03).contains(&(row.lateral_max / least)), "{} {least}", row.lateral_max);
}

#[test]
fn tracked_commands_leave_the_path_by_less_than_a_third_of_the_others_and_with_the_third_power() {
    for curve in [C_CURVE, S_CURVE] {
        let (profile, robot) = profile(&[curve]);
        let all = [Sampling::Tracked, Sampling::Instant, Sampling::Mean];
        let rows = path_errors(&profile, &robot, &[0.05, 0.2], &all, |_| None).unwrap();
        let order = real::log2(rows[1].lateral_max / rows[0].lateral_max) / 2.0;
        assert!((order - 3.0).abs() < 0.1, "{order}");
        for (k, row) in rows.iter().enumerate().skip(2) {
            assert!(3.0 * rows[k % 2].lateral_max < row.lateral_max && rows[k % 2].end_point < 1e-6);
        }
    }
}

#[test]
fn the_largest_sampling_time_within_a_bound_is_the_last_one_before_it_is_passed() {
    let (profile, robot) = profile(&[S_CURVE]);
    for sampling in [Sampling::Mean, Sampling::Instant, Sampling::Tracked] {
        let answer = within(&profile, &robot, sampling, 0.1e-3, |table| Some(table.sampling_time)).unwrap();
        let (row, beyond) = (answer.row.unwrap(), answer.beyond.unwrap());
        assert!(row.largest() <= 0.1e-3 && beyond.largest() > 0.1e-3, "{answer:?}");
        assert!(row.sampling_time < beyond.sampling_time && beyond.sampling_time < 1.4 * row.sampling_time);
        assert_eq!(row.clearance_min, Some(row.sampling_time));
        let again = path_errors(&profile, &robot, &[row.sampling_time], &[sampling], |_| None).unwrap();
        assert_eq!(again[0].lateral_max, row.lateral_max);
    }
    let never = within(&profile, &robot, Sampling::Mean, 1e-12, |_| None).unwrap();
    assert_eq!((never.row, never.beyond.map(|row| row.sampling_time)), (None, Some(1e-3)));
    let always = within(&profile, &robot, Sampling::Tracked, 1.0, |_| None).unwrap();
    assert_eq!((always.row.map(|row| row.sampling_time), always.beyond), (Some(0.8), None));
}
