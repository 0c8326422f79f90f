//! Where the interior-point method starts.

use crate::math::pentadiagonal::Pentadiagonal;
use crate::math::real;

use super::grid::Grid;
use super::{Problem, STILL};

/// A shape of b to start from: at most what a constant rate may be at each place, rising and falling as accelerations allow, its kinks
/// rounded as jerks allow. Weights of the B-splines; positive, but not scaled to the limits.
pub(super) fn guess(problem: &Problem<'_>, grid: &Grid) -> Vec<f64> {
    let (rows, count) = (problem.limits.len(), grid.unknowns());
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
        let volume = 0.5 * (place(i + 1) - place(i.saturating_sub(1)));
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

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn it_is_the_greatest_b_that_rises_as_accelerations_allow_and_its_mean_over_the_widths_that_jerks_ask_for() {
        let problem = Problem {
            breaks: &[0.0, 2.0, 3.0, 7.0],
            limits: &[[1.0, 0.05, 0.4], [0.3, 0.07, 0.9], [0.8, f64::INFINITY, f64::INFINITY]],
            jerk_of_jump: 1.0,
            step: 0.2,
        };
        let rates = |t: f64| {
            let wave = |amplitude: f64, w: f64| {
                let (sin, cos) = real::sin_cos(w * t);
                [amplitude * (1.2 + sin), amplitude * w * cos, -amplitude * w * w * sin]
            };
            [wave(0.5, 1.3), wave(0.2, 2.1), wave(0.9, 0.4)]
        };
        let grid = Grid::new(&problem, 5.0, &mut |t, out: &mut Vec<[f64; 3]>| out.extend(rates(t))).unwrap();
        let (cells, count) = (grid.cells(), grid.cells() + 2);
        let place = |i: usize| grid.place(i);
        // The cell that an unknown is the middle of; the ends have that of the first and the last one.
        let cell = |i: usize| if i == 0 { 0 } else { (i - 1).min(cells - 1) };
        let middle = |i: usize| 0.5 * (grid.knots[cell(i)] + grid.knots[cell(i) + 1]);
        // Half the slope of b that accelerations allow, `b' q'/2 <= a`; what jerks allow likewise.
        let least = |i: usize, order: usize| {
            let shares = rates(middle(i)).into_iter().zip(problem.limits);
            shares.map(|(q, limit)| limit[order] / q[0].abs()).fold(f64::INFINITY, f64::min)
        };
        let rise = |low: usize, high: usize| {
            (low..high).map(|i| 0.5 * (least(i, 1) + least(i + 1, 1)) * (place(i + 1) - place(i))).sum::<f64>()
        };
        // From every place that caps it, up or down the way to any other.
        let own = |i: usize| 1.0 / (grid.slowness[cell(i)] * grid.slowness[cell(i)]);
        let greatest = |i: usize| (0..count).map(|k| own(k) + rise(i.min(k), i.max(k))).fold(f64::INFINITY, f64::min);
        let b: Vec<f64> = (0..count).map(greatest).collect();
        assert!((0..count).any(|i| b[i] < 0.9 * own(i)) && (0..count).any(|i| b[i] == own(i)));
        let width: Vec<f64> = (0..count).map(|i| 0.5 * least(i, 1) / least(i, 2) * b[i].sqrt()).collect();
        // Finite volumes: what flows between two neighbours, and what each of them has.
        let (mut matrix, mut right) = (DMatrix::zeros(count, count), DVector::zeros(count));
        for i in 0..count {
            let low = if i == 0 { place(0) } else { 0.5 * (place(i - 1) + place(i)) };
            let high = if i + 1 == count { place(i) } else { 0.5 * (place(i) + place(i + 1)) };
            matrix[(i, i)] += high - low;
            right[i] = (high - low) * b[i];
        }
        for i in 1..count {
            let flow = width[i - 1] * width[i] / (place(i) - place(i - 1));
            for (row, column, sign) in [(i, i, 1.0), (i - 1, i - 1, 1.0), (i, i - 1, -1.0), (i - 1, i, -1.0)] {
                matrix[(row, column)] += sign * flow;
            }
        }
        let expected = matrix.lu().solve(&right).unwrap();
        let found = guess(&problem, &grid);
        assert_eq!(found.len(), count);
        for (i, (found, expected)) in found.iter().zip(expected.iter()).enumerate() {
            assert!((found / expected - 1.0).abs() < 1e-9, "{i}: {found} {expected}");
        }
    }
}
