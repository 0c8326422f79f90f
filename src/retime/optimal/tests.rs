//! The kernel on curves whose least time is known.

use super::*;
use crate::math::real;
use crate::retime::convolution::Convolution;
use proptest::prelude::*;

type Rows = Vec<[f64; 3]>;

/// The least time of a curve, and by how much it must be slowed down for every limit to hold between the grid's points too.
fn solve(breaks: &[f64], limits: &[[f64; 3]], rates: impl Fn(f64, &mut Rows)) -> (f64, f64) {
    let problem = Problem { breaks, limits, jerk_of_jump: 7.5, step: step(limits[0]) };
    let pace = fastest(&problem, &rates).unwrap();
    let mut largest = 1.0f64;
    let mut rows = Vec::new();
    for i in 0..=20_000 {
        let [t, r1, r2, r3] = pace.at(pace.duration() * f64::from(i) / 20_000.0);
        rows.clear();
        rates(t, &mut rows);
        for (q, limit) in rows.iter().zip(limits) {
            let moved = crate::retime::course::compose(*q, [r1, r2, r3]);
            let [v, a, j] = [0, 1, 2].map(|k| moved[k].abs() / limit[k]);
            largest = largest.max(v).max(a.sqrt()).max(real::cbrt(j));
        }
    }
    (pace.duration(), largest)
}

/// A line driven by a profile that is slower than it need be.
fn line(distance: f64, limits: [f64; 3], shares: [f64; 3]) -> (f64, f64) {
    let slow = Convolution::fastest(distance, [0, 1, 2].map(|k| limits[k] * shares[k]));
    let mut breaks = slow.corners().to_vec();
    breaks.sort_by(f64::total_cmp);
    solve(&breaks, &[limits], |t, out| {
        let [_, v, a, j] = slow.at(t);
        out.push([v, a, j]);
    })
}

/// Two rows around a bend: speeds 1 + bend sin and 1 - bend sin of the way, from a smooth profile.
fn bend(distance: f64, bend: f64, limits: [f64; 3], backwards: bool) -> (f64, f64) {
    let slow = Convolution::fastest(distance, limits.map(|limit| 0.3 * limit));
    let mut breaks: Vec<f64> = slow.corners().to_vec();
    breaks.extend((1..16).map(|i| slow.duration() * f64::from(i) / 16.0));
    breaks.sort_by(f64::total_cmp);
    solve(&breaks, &[limits; 2], |t, out| {
        let t = if backwards { slow.duration() - t } else { t };
        let [s, v, a, j] = slow.at(t);
        let (a, s) = (if backwards { -a } else { a }, 7.0 * s / distance);
        let w = 7.0 / distance * if backwards { -1.0 } else { 1.0 };
        for side in [bend, -bend] {
            let q = [1.0 + side * real::sin(s), w * side * real::cos(s), -w * w * side * real::sin(s)];
            out.push(crate::retime::course::compose(q, [v, a, j]));
        }
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(48) })]
    #[test]
    fn a_line_takes_the_convolution_profiles_time(
        reach in prop_oneof![1e-9..1e-3f64, 1e-3..1.0f64, 1.0..10.0f64], fast in 0.3..10.0f64,
        a in 1e-3..1e3f64, j in 1e-3..1e3f64, shares in [0.3..1.0f64, 0.3..1.0f64, 0.3..1.0f64],
    ) {
        // Speeds in units of what builds up while the acceleration does; lengths in those of speeding up and braking.
        let v = fast * a * a / j;
        let distance = reach * v * (v / a + a / j);
        let (time, largest) = line(distance, [v, a, j], shares);
        let least = Convolution::fastest(distance, [v, a, j]).duration();
        let legal = time * largest;
        prop_assert!(legal > least * (1.0 - 1e-6), "{legal} s, {least} s");
        prop_assert!(legal < least * 1.02, "{legal} s, {least} s, {largest}");
    }

    #[test]
    fn time_falls_when_any_limit_rises(
        distance in 0.5..8.0f64, sway in 0.0..0.9f64, limits in [0.3..1.0f64, 0.2..1.0f64, 0.3..4.0f64], which in 0usize..3,
    ) {
        let (before, _) = bend(distance, sway, limits, false);
        let mut more = limits;
        more[which] *= 1.3;
        let (after, _) = bend(distance, sway, more, false);
        // A law's b'' is constant in each cell, so it loses in proportion to the cells' length, which the limits choose.
        prop_assert!(after < before * (1.0 + 5e-3), "{before} s, {after} s");
    }

    #[test]
    fn a_curve_takes_as_long_backwards(distance in 0.5..8.0f64, sway in 0.0..0.9f64) {
        let limits = [0.5, 0.3, 0.5];
        let [(there, _), (back, _)] = [false, true].map(|backwards| bend(distance, sway, limits, backwards));
        prop_assert!((there / back - 1.0).abs() < 2e-3, "{there} s, {back} s");
    }

    #[test]
    fn time_scales_with_lengths_and_limits(distance in 0.5..8.0f64, sway in 0.0..0.9f64, size in 1e-5..1e5f64, slower in 0.01..100.0f64) {
        let limits = [0.5, 0.3, 0.5];
        let (time, _) = bend(distance, sway, limits, false);
        let (scaled, _) = bend(distance * size, sway, limits.map(|limit| limit * size), false);
        prop_assert!((scaled / time - 1.0).abs() < 1e-6, "{time} s, {scaled} s");
        let slow = [limits[0] / slower, limits[1] / real::powi(slower, 2), limits[2] / real::powi(slower, 3)];
        let (slowed, _) = bend(distance, sway, slow, false);
        prop_assert!((slowed / (time * slower) - 1.0).abs() < 1e-6, "{time} s, {slowed} s");
    }
}

#[test]
fn a_reference_that_starts_more_gently_than_any_least_time_costs_little() {
    // q = 35 x^4 - 84 x^5 + 70 x^6 - 20 x^7: at the ends its rate would have to be infinite.
    let limits = [[0.5, 0.2, 0.2]];
    let (distance, duration) = (3.0, 20.0);
    let breaks: Vec<f64> = (0..=8).map(|i| duration * f64::from(i) / 8.0).collect();
    let (time, largest) = solve(&breaks, &limits, |t, out| {
        let x = t / duration;
        let y = 1.0 - x;
        let third = 840.0 * x * y * (1.0 - 5.0 * x * y);
        let q = [140.0 * real::powi(x * y, 3), 420.0 * real::powi(x * y, 2) * (y - x), third];
        out.push([0, 1, 2].map(|k| distance * q[k] / real::powi(duration, k as i32 + 1)));
    });
    let least = Convolution::fastest(distance, limits[0]).duration();
    assert!((0.999..1.01).contains(&(time * largest / least)), "{time} s, {least} s, {largest}");
}

#[test]
fn what_does_not_move_or_is_not_finite_has_no_least_time() {
    let problem = Problem { breaks: &[0.0, 1.0], limits: &[[1.0; 3]], jerk_of_jump: 1.0, step: 0.1 };
    assert_eq!(fastest(&problem, |_, out| out.push([0.0; 3])), None);
    assert_eq!(fastest(&problem, |_, out| out.push([f64::NAN; 3])), None);
}

#[test]
fn least_times_of_nanoseconds_and_of_years_are_found_alike() {
    let (time, _) = bend(3.0, 0.5, [0.5, 0.3, 0.5], false);
    for unit in [1e-8, 1e8] {
        let limits = [0.5 / unit, 0.3 / (unit * unit), 0.5 / (unit * unit * unit)];
        let (scaled, _) = bend(3.0, 0.5, limits, false);
        assert!((scaled / unit / time - 1.0).abs() < 1e-6, "{unit}: {time} s, {scaled} s");
    }
}
