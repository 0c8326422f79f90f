//! Upper bounds of a function over a box of joint values, by branch and bound.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

/// How far a bound over all postures may lie above the true figure, m, where few joints move a shape.
const TOLERANCE: f64 = 5e-4;
/// Postures that a bound may look at.
const BUDGET: usize = 1500;
/// A box of joint values and the greatest value possible in it.
struct Node {
    bound: f64,
    centre: Vec<f64>,
    half: Vec<f64>,
}

impl PartialEq for Node {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Node {}

impl PartialOrd for Node {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Node {
    fn cmp(&self, other: &Self) -> Ordering {
        self.bound.total_cmp(&other.bound)
    }
}

/// An upper bound of `value` over the box `ranges`; `slopes`: largest rate of change by each coordinate. Stops looking once the bound
/// is at most `enough`.
pub(super) fn upper_bound(
    ranges: &[[f64; 2]],
    slopes: &[f64],
    enough: f64,
    mut value: impl FnMut(&[f64]) -> f64,
) -> f64 {
    let free = |i: usize| slopes[i] > 0.0 && ranges[i][1] > ranges[i][0];
    if (0..ranges.len()).any(|i| free(i) && !(ranges[i][1] - ranges[i][0]).is_finite()) {
        return f64::INFINITY;
    }
    let slack = |half: &[f64]| slopes.iter().zip(half).map(|(s, h)| if *h > 0.0 { s * h } else { 0.0 }).sum::<f64>();
    let rest = |[low, high]: &[f64; 2]| if low.is_finite() && high.is_finite() { 0.5 * (low + high) } else { 0.0 };
    let centre: Vec<f64> = ranges.iter().map(rest).collect();
    let half: Vec<f64> =
        (0..ranges.len()).map(|i| if free(i) { 0.5 * (ranges[i][1] - ranges[i][0]) } else { 0.0 }).collect();
    let mut best = value(&centre);
    let mut heap = BinaryHeap::from([Node { bound: best + slack(&half), centre, half }]);
    let mut looked = 1;
    while let Some(node) = heap.pop() {
        if node.bound <= (best + TOLERANCE).max(enough) || looked >= BUDGET {
            return node.bound;
        }
        let weight = |i: usize| slopes[i] * node.half[i];
        let widest = (0..slopes.len()).max_by(|a, b| weight(*a).total_cmp(&weight(*b)).then(b.cmp(a)));
        let Some(widest) = widest.filter(|i| weight(*i) > 0.0) else {
            return node.bound;
        };
        for sign in [-1.0, 1.0] {
            let (mut centre, mut half) = (node.centre.clone(), node.half.clone());
            half[widest] *= 0.5;
            centre[widest] += sign * half[widest];
            let here = value(&centre);
            looked += 1;
            best = best.max(here);
            heap.push(Node { bound: (here + slack(&half)).min(node.bound), centre, half });
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::real;

    #[test]
    fn a_bound_lies_above_the_maximum_by_less_than_the_tolerance() {
        // sin(3x) + y on [0, 2] x [-1, 0.5]: 1.5
        let found =
            upper_bound(&[[0.0, 2.0], [-1.0, 0.5]], &[3.0, 1.0], f64::NEG_INFINITY, |q| real::sin(3.0 * q[0]) + q[1]);
        assert!((1.5..=1.5 + TOLERANCE).contains(&found), "{found}");
    }

    #[test]
    fn endless_coordinates_matter_only_where_the_function_depends_on_them() {
        let endless = [[f64::NEG_INFINITY, f64::INFINITY], [0.0, 1.0]];
        assert_eq!(upper_bound(&endless, &[1.0, 0.0], 0.0, |q| real::sin(q[0])), f64::INFINITY);
        let found = upper_bound(&endless, &[0.0, 1.0], f64::NEG_INFINITY, |q| q[1]);
        assert!((1.0..=1.0 + TOLERANCE).contains(&found), "{found}");
    }

    #[test]
    fn a_bound_holds_when_the_budget_runs_out() {
        let value = |q: &[f64]| q.iter().copied().map(real::sin).sum::<f64>();
        let found = upper_bound(&[[0.0, 3.0]; 6], &[1.0; 6], f64::NEG_INFINITY, value);
        assert!((6.0..9.0).contains(&found), "{found}");
    }
}
