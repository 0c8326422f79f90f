//! The reference: all 8M rows of MINCO's system (MATH section 2), dense, with pivoting.

use super::*;
use crate::math::fd::{numeric_gradient, relative_error};
use crate::math::real;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

fn derivative(curve: &Minco, piece: usize, d: usize, order: usize, u: f64) -> f64 {
    let m = curve.dimensions;
    let t = curve.durations[piece];
    (order..TERMS)
        .map(|k| {
            let factor: f64 = (k + 1 - order..=k).map(|i| i as f64).product();
            factor * curve.coefficients[(piece * TERMS + k) * m + d] * real::powi(u, (k - order) as i32)
        })
        .sum::<f64>()
        / real::powi(t, order as i32)
}

/// Normalised coefficients of one dimension by the full system.
fn by_the_full_system(start: &[f64], end: &[f64], waypoints: &[f64], durations: &[f64]) -> Vec<f64> {
    let pieces = durations.len();
    let n = 8 * pieces;
    let (mut a, mut b, mut row) = (DMatrix::zeros(n, n), DVector::zeros(n), 0);
    let choose = |k: usize, d: usize| -> f64 { (0..d).map(|i| (k - i) as f64 / (i + 1) as f64).product() };
    let factorial = [1.0, 1.0, 2.0, 6.0];
    for d in 0..4 {
        a[(row, d)] = 1.0;
        b[row] = start[d] * real::powi(durations[0], d as i32) / factorial[d];
        row += 1;
    }
    for i in 0..pieces - 1 {
        let ratio = durations[i] / durations[i + 1];
        let mut continuity = |row: usize, d: usize| {
            let scale = real::powi(ratio, -(d as i32)).min(1.0);
            for k in d..8 {
                a[(row, 8 * i + k)] = scale * choose(k, d);
            }
            a[(row, 8 * i + 8 + d)] = -scale * real::powi(ratio, d as i32);
        };
        for (offset, d) in [4, 5, 6, 0, 1, 2, 3].into_iter().enumerate() {
            continuity(row + if offset < 3 { offset } else { offset + 1 }, d);
        }
        for k in 0..8 {
            a[(row + 3, 8 * i + k)] = 1.0;
        }
        b[row + 3] = waypoints[i];
        row += 8;
    }
    for d in 0..4 {
        for k in d..8 {
            a[(row, n - 8 + k)] = choose(k, d);
        }
        b[row] = end[d] * real::powi(durations[pieces - 1], d as i32) / factorial[d];
        row += 1;
    }
    a.full_piv_lu().solve(&b).expect("the system is regular").as_slice().to_vec()
}

#[derive(Debug, Clone)]
struct Case {
    dimensions: usize,
    start: Vec<f64>,
    end: Vec<f64>,
    waypoints: Vec<f64>,
    durations: Vec<f64>,
}

impl Case {
    fn curve(&self) -> Minco {
        let mut curve = Minco::new(self.durations.len(), &self.start, &self.end);
        curve.shape(&self.waypoints, &self.durations);
        curve
    }
}

fn cases(longest_ratio: f64) -> impl Strategy<Value = Case> {
    (1usize..9, 1usize..5).prop_flat_map(move |(pieces, m)| {
        let number = -1.0..1.0f64;
        (
            proptest::collection::vec(number.clone(), 4 * m),
            proptest::collection::vec(number.clone(), 4 * m),
            proptest::collection::vec(number, (pieces - 1) * m),
            proptest::collection::vec(0.0..1.0f64, pieces),
            0.05..(10.0 / longest_ratio).max(0.051),
        )
            .prop_map(move |(start, end, waypoints, spread, least)| Case {
                dimensions: m,
                start,
                end,
                waypoints,
                durations: spread.iter().map(|s| least * real::powf(longest_ratio, *s)).collect(),
            })
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn it_is_the_solution_of_the_full_system(case in cases(200.0)) {
        let curve = case.curve();
        let m = case.dimensions;
        for d in 0..m {
            let pick = |v: &[f64]| -> Vec<f64> { v.iter().skip(d).step_by(m).copied().collect() };
            let c = by_the_full_system(&pick(&case.start), &pick(&case.end), &pick(&case.waypoints), &case.durations);
            // Compare each piece's shape in normalised time: this is what every cost sees. The loss of digits grows with the
            // ratio of durations (up to 200 here).
            let scale = c.iter().fold(1.0f64, |s, v| s.max(v.abs()));
            for (k, value) in c.iter().enumerate() {
                let ours = curve.coefficients[k * m + d];
                prop_assert!((ours - value).abs() < 1e-6 * scale, "coefficient {k}: {ours} vs {value}, scale {scale}");
            }
        }
    }

    #[test]
    fn derivatives_up_to_order_six_are_continuous(case in cases(10.0)) {
        let curve = case.curve();
        for piece in 1..curve.pieces {
            for d in 0..case.dimensions {
                for order in 0..7 {
                    let before = derivative(&curve, piece - 1, d, order, 1.0);
                    let after = derivative(&curve, piece, d, order, 0.0);
                    // Scale: the size of that derivative's terms on the shorter neighbour.
                    let t = real::powi(curve.durations[piece].min(curve.durations[piece - 1]), order as i32);
                    let scale = 5040.0 * (0..TERMS * 2).map(|k| {
                        curve.coefficients[((piece - 1) * TERMS + k) * case.dimensions + d].abs()
                    }).fold(1.0, f64::max) / t;
                    prop_assert!((before - after).abs() < 1e-9 * scale, "order {order}: {before} vs {after}");
                }
            }
        }
    }

    #[test]
    fn energy_equals_its_quadrature(case in cases(5.0)) {
        let curve = case.curve();
        let weights = [1.0, 0.3, 2.0, 0.7];
        let m = case.dimensions;
        let energy = curve.energy(&weights[..m], &mut vec![0.0; case.waypoints.len()], &mut vec![0.0; curve.pieces]);
        // Gauss-Legendre with four nodes is exact for degree 7 > 6.
        let x = [0.861_136_311_594_052_6, 0.339_981_043_584_856_3];
        let w = [0.347_854_845_137_453_9, 0.652_145_154_862_546_1];
        let mut sum = 0.0;
        for piece in 0..curve.pieces {
            for (d, weight) in weights.iter().enumerate().take(m) {
                for (x, w) in x.iter().zip(w) {
                    for x in [-x, *x] {
                        let z = derivative(&curve, piece, d, 4, 0.5 * (1.0 + x));
                        sum += weight * 0.5 * curve.durations[piece] * w * z * z;
                    }
                }
            }
        }
        prop_assert!((energy / sum - 1.0).abs() < 1e-9);
    }

    #[test]
    fn no_other_derivatives_at_the_waypoints_have_less_energy(case in cases(10.0), bump in -1.0..1.0f64) {
        let curve = case.curve();
        prop_assume!(curve.pieces > 1);
        let m = case.dimensions;
        let nothing = |c: &Minco| c.energy(&vec![1.0; m], &mut vec![0.0; case.waypoints.len()], &mut vec![0.0; c.pieces]);
        let least = nothing(&curve);
        for order in 1..4 {
            let mut other = curve.clone();
            other.states[(ORDERS + order) * m] += bump;
            (0..other.pieces).for_each(|p| other.expand(p));
            prop_assert!(nothing(&other) >= least * (1.0 - 1e-9));
        }
    }

    #[test]
    fn gradients_match_finite_differences(case in cases(5.0), by in proptest::collection::vec(-1.0..1.0f64, 8 * 8 * 4)) {
        let pieces = case.durations.len();
        let m = case.dimensions;
        let weights = vec![1e-3; m];
        // K = energy + linear function of coefficients + a function of T; variables: waypoints, T, both end states.
        let (nw, width) = ((pieces - 1) * m, 4 * m);
        let value = |x: &[f64], gradient: Option<&mut Vec<f64>>| -> f64 {
            let mut curve = Minco::new(pieces, &x[nw + pieces..nw + pieces + width], &x[nw + pieces + width..]);
            curve.shape(&x[..nw], &x[nw..nw + pieces]);
            let by = &by[..pieces * TERMS * m];
            let (mut gw, mut gt) = (vec![0.0; nw], vec![0.0; pieces]);
            let energy = if gradient.is_some() { 0.0 } else { curve.energy(&weights, &mut gw, &mut gt) };
            let cost = energy + by.iter().zip(&curve.coefficients).map(|(a, b)| a * b).sum::<f64>();
            if let Some(g) = gradient {
                curve.pull_back(by, &mut gw, &mut gt);
                let (s, e) = curve.end_state_gradients();
                let (s, e) = (s.to_vec(), e.to_vec());
                curve.energy(&weights, &mut gw, &mut gt);
                *g = [gw, gt, s, e].concat();
            }
            cost
        };
        let x = [&case.waypoints[..], &case.durations, &case.start, &case.end].concat();
        let mut g = Vec::new();
        value(&x, Some(&mut g));
        let least = case.durations.iter().copied().fold(1.0, f64::min);
        let numeric = numeric_gradient(|x| value(x, None), &x, 3e-3 * least);
        // The energy's gradient by end states is not offered: compare waypoints and durations only here.
        let n = nw + pieces;
        prop_assert!(relative_error(&g[..n], &numeric[..n], 1e-3) < 1e-6, "{:?} {:?}", &g[..n], &numeric[..n]);
        let linear = numeric_gradient(|x| {
            let mut curve = Minco::new(pieces, &x[nw + pieces..nw + pieces + width], &x[nw + pieces + width..]);
            curve.shape(&x[..nw], &x[nw..nw + pieces]);
            by.iter().zip(&curve.coefficients).map(|(a, b)| a * b).sum::<f64>()
        }, &x, 3e-3 * least);
        prop_assert!(relative_error(&g[n..], &linear[n..], 1e-3) < 1e-6);
    }
}
