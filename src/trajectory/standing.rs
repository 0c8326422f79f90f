//! Where a polynomial's first derivative vanishes: Bernstein coefficients, halved until their signs are certain.

use crate::math::real;

/// Coefficients below this share of the largest are zero.
const ZERO: f64 = 1e-13;
/// Halvings.
const DEEPEST: usize = 30;

/// Intervals of `[0, duration]` in which the derivative of the polynomial (ascending powers) vanishes or cannot be told from zero,
/// ascending: `[u, u]` where it is zero at a point, wider where it is zero over a stretch or touches zero. Nothing at ends where it only
/// falls to zero.
pub(super) fn standing(coefficients: &[f64], duration: f64) -> Vec<[f64; 2]> {
    // Derivative by the share of the duration.
    let derivative: Vec<f64> =
        (1..coefficients.len()).map(|k| k as f64 * coefficients[k] * real::powi(duration, k as i32)).collect();
    let bernstein = bernstein(&derivative);
    let scale = bernstein.iter().fold(0.0f64, |scale, c| scale.max(c.abs()));
    if scale <= 0.0 {
        return vec![[0.0, duration]];
    }
    let mut found = Vec::new();
    isolate(bernstein, 0.0, 1.0, ZERO * scale, 0, &mut found);
    found.iter().map(|range| range.map(|share| share * duration)).collect()
}

/// Bernstein coefficients on [0, 1] of a polynomial in ascending powers: b_i = sum over k <= i of C(i, k) / C(n, k) a_k.
fn bernstein(powers: &[f64]) -> Vec<f64> {
    let degree = powers.len().saturating_sub(1);
    let choose = |n: usize, k: usize| (0..k).fold(1.0, |c, j| c * (n - j) as f64 / (j + 1) as f64);
    (0..powers.len()).map(|i| (0..=i).map(|k| choose(i, k) / choose(degree, k) * powers[k]).sum()).collect()
}

fn isolate(b: Vec<f64>, from: f64, to: f64, zero: f64, depth: usize, found: &mut Vec<[f64; 2]>) {
    let signs: Vec<bool> = b.iter().filter(|c| c.abs() > zero).map(|c| *c > 0.0).collect();
    let changes = signs.windows(2).filter(|pair| pair[0] != pair[1]).count();
    // The first coefficient is the value at `from`; a zero on a seam shows in no change of sign on either side.
    if changes < 2 && from > 0.0 && !signs.is_empty() && b[0].abs() <= zero {
        found.push([from, from]);
    }
    match changes {
        0 if signs.is_empty() => found.push([from, to]),
        // The coefficients' hull holds the values: none is zero inside.
        0 => {}
        // As many zeros as changes of sign, or two less, and so on: exactly one.
        1 => {
            let at = from + (to - from) * crossing(&b, signs[0]);
            found.push([at, at]);
        }
        _ if depth == DEEPEST => found.push([from, to]),
        _ => {
            let (left, right) = halves(b);
            let middle = 0.5 * (from + to);
            isolate(left, from, middle, zero, depth + 1, found);
            isolate(right, middle, to, zero, depth + 1, found);
        }
    }
}

/// The share at which the one change of sign lies.
fn crossing(b: &[f64], positive_first: bool) -> f64 {
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if (value(b, middle) > 0.0) == positive_first {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// De Casteljau: the value at a share.
fn value(b: &[f64], share: f64) -> f64 {
    let mut level = b.to_vec();
    for n in (1..b.len()).rev() {
        (0..n).for_each(|i| level[i] += share * (level[i + 1] - level[i]));
    }
    level[0]
}

/// De Casteljau at the middle: coefficients of both halves.
fn halves(mut b: Vec<f64>) -> (Vec<f64>, Vec<f64>) {
    let mut left = Vec::with_capacity(b.len());
    for n in (0..b.len()).rev() {
        left.push(b[0]);
        (0..n).for_each(|i| b[i] = 0.5 * (b[i] + b[i + 1]));
    }
    (left, b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ascending powers of the integral of the product of (u - root).
    fn with_slope_roots(roots: &[f64]) -> Vec<f64> {
        let mut slope = vec![1.0];
        for root in roots {
            let mut next = vec![0.0; slope.len() + 1];
            for (k, c) in slope.iter().enumerate() {
                next[k + 1] += c;
                next[k] -= root * c;
            }
            slope = next;
        }
        std::iter::once(0.0).chain(slope.iter().enumerate().map(|(k, c)| c / (k + 1) as f64)).collect()
    }

    #[test]
    fn simple_zeros_are_found_to_rounding_and_those_outside_are_not() {
        let roots = [-0.5, 0.3, 0.31, 1.7, 2.5];
        let found = standing(&with_slope_roots(&roots), 2.0);
        assert_eq!(found.len(), 3, "{found:?}");
        for (range, root) in found.iter().zip(&roots[1..]) {
            assert!(range[0] == range[1] && (range[0] - root).abs() < 1e-10, "{range:?} is not {root}");
        }
    }

    #[test]
    fn a_derivative_that_only_touches_zero_is_told_from_one_that_crosses_it() {
        let found = standing(&with_slope_roots(&[0.7, 0.7]), 1.5);
        assert!(!found.is_empty() && found.iter().all(|[a, b]| (a - 0.7).abs() < 1e-5 && (b - 0.7).abs() < 1e-5));
        // 35 u^4 - 84 u^5 + 70 u^6 - 20 u^7: rest at both ends only.
        assert_eq!(standing(&[0.0, 0.0, 0.0, 0.0, 35.0, -84.0, 70.0, -20.0], 1.0), Vec::<[f64; 2]>::new());
    }

    #[test]
    fn zeros_on_seams_of_the_halving_are_found() {
        let found = standing(&with_slope_roots(&[0.25, 0.5, 0.75]), 1.0);
        assert_eq!(found.len(), 3, "{found:?}");
        found.iter().zip([0.25, 0.5, 0.75]).for_each(|([a, b], root)| assert!(a == b && (a - root).abs() < 1e-12));
    }

    #[test]
    fn what_stands_stands_all_the_time() {
        assert_eq!(standing(&[3.0], 2.0), vec![[0.0, 2.0]]);
        assert_eq!(standing(&[3.0, 0.0, 0.0], 2.0), vec![[0.0, 2.0]]);
    }
}
