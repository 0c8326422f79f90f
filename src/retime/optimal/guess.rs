//! Where the interior-point method starts.

use crate::math::pentadiagonal::Pentadiagonal;
use crate::math::real;

use super::grid::Grid;
use super::{Problem, STILL};

/// A shape of b to start from: at most what a constant rate may be at each place, rising and falling as accelerations allow, its kinks
/// rounded as jerks allow. Weights of the B-splines; positive, but not scaled to the limits.
pub(super) fn guess(problem: &Problem<'_>, grid: &Grid) -> Vec<f64> {
    let (rows, count) = (problem.limits.len(), grid.cells() + 2);
    let place = |i: usize| grid.place(i);
    let cell = |i: usize| i.clamp(1, grid.cells()) - 1;
    // The rows' speeds as shares of a limit (of accelerations, of jerks) in the cell's middle.
    let share = |i: usize, order: usize| {
        let rates = &grid.rates[(3 * cell(i) + 1) * rows..][..rows];
        rates.iter().zip(problem.limits).map(|(rates, limits)| rates[0].abs() / limits[order]).fold(0.0, f64::max)
    };
    let mut b: Vec<f64> = (0..count).map(|i| real::powi(grid.slowness[cell(i)], -2)).collect();
    let slope: Vec<f64> = (0..count).map(|i| 1.0 / share(i, 1).max(STILL)).collect();
    let rise = |i: usize| 0.5 * (slope[i] + slope[i - 1]) * (place(i) - place(i - 1));
    for i in 1..count {
        b[i] = b[i].min(b[i - 1] + rise(i));
    }
    for i in (1..count).rev() {
        b[i - 1] = b[i - 1].min(b[i] + rise(i));
    }
    // x - (width^2 x')' = b in finite volumes: a mean over about a width, in which the slope may turn round.
    let width: Vec<f64> = (0..count).map(|i| 0.5 * slope[i] * share(i, 2) * b[i].sqrt()).collect();
    let mut smooth = Pentadiagonal::default();
    smooth.reset(count);
    let mut x = vec![0.0; count];
    for i in 0..count {
        let volume = 0.5 * (place((i + 1).min(count - 1)) - place(i.saturating_sub(1)));
        smooth.rows[i][0] += volume;
        x[i] = volume * b[i];
        if i > 0 {
            let pull = width[i] * width[i - 1] / (place(i) - place(i - 1));
            smooth.rows[i - 1][0] += pull;
            smooth.rows[i][0] += pull;
            smooth.rows[i][1] -= pull;
        }
    }
    smooth.factor();
    smooth.solve(&mut x);
    x
}
