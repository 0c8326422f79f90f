use super::*;
use crate::math::poly::{Piece, PiecewisePoly};
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
            let order = |coarse: f64, fine: f64| (coarse / fine).log2() / 2.0;
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
fn the_grid_finds_what_brute_force_finds() {
    let (profile, _) = profile(&[C_CURVE]);
    let reference = PathReference::new(&profile);
    for i in 0..400 {
        let (a, b) = (f64::from(i % 20), f64::from(i / 20));
        let point = [-1.0 + a * 0.3, -0.7 + b * 0.31];
        let brute = reference.vertices.iter().map(|v| square(v.point, point)).fold(f64::INFINITY, f64::min).sqrt();
        let found = reference.distance(point);
        assert!(
            found <= brute + 1e-15 && found > brute - 2e-6_f64.max(1.3e-7 / brute),
            "{point:?}: {found} vs {brute}"
        );
    }
}

#[test]
fn rows_come_in_order_and_carry_the_clearance_of_their_table() {
    let (profile, robot) = profile(&[C_CURVE]);
    let clearance = |table: &CommandTable| Some(table.sampling_time * 2.0);
    let rows = path_errors(&profile, &robot, &[0.05, 0.1, 0.5], Sampling::Mean, clearance).unwrap();
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
            c.extend(powers.map(|(k, a)| changes[d] * a / seconds.powi(4 + k as i32)));
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
    let dense: Vec<[f64; 2]> = (0..=100_000)
        .map(|i| profile.pose(profile.time() * f64::from(i) / 100_000.0))
        .map(|pose| [pose.x, pose.y])
        .collect();
    for i in 0..100 {
        let point = [-0.3 + 0.15 * f64::from(i % 10), -0.5 + 0.17 * f64::from(i / 10)];
        let brute = dense.iter().map(|p| square(*p, point)).fold(f64::INFINITY, f64::min).sqrt();
        let found = reference.distance(point);
        // The search for the foot ends within 1e-9 of the distance.
        assert!(found <= brute * (1.0 + 1e-9) && found > brute - 1e-6, "{point:?}: {found} vs {brute}");
    }
}
