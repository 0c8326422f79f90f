//! Cubic splines with two continuous derivatives through given points.

/// What holds at an end of a spline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SplineEnd {
    /// The first derivative has this value.
    Slope(f64),
    /// The second derivative vanishes.
    Natural,
}

/// The C2 cubic spline through `values` at the parameters `knots`.
///
/// Returns one set of ascending coefficients an interval, in the local parameter `u - knots[i]`. Needs at least two knots,
/// strictly ascending, and as many values; O(n).
pub fn cubic_spline(knots: &[f64], values: &[f64], ends: [SplineEnd; 2]) -> Vec<[f64; 4]> {
    debug_assert!(knots.len() >= 2 && knots.len() == values.len());
    let n = knots.len() - 1;
    let step: Vec<f64> = knots.windows(2).map(|w| w[1] - w[0]).collect();
    let chord: Vec<f64> = (0..n).map(|i| (values[i + 1] - values[i]) / step[i]).collect();

    // Tridiagonal rows for the second derivatives m: lower, diagonal, upper, right side.
    let mut rows = vec![[0.0, 1.0, 0.0, 0.0]; n + 1];
    for i in 1..n {
        rows[i] = [step[i - 1], 2.0 * (step[i - 1] + step[i]), step[i], 6.0 * (chord[i] - chord[i - 1])];
    }
    if let SplineEnd::Slope(slope) = ends[0] {
        rows[0] = [0.0, 2.0 * step[0], step[0], 6.0 * (chord[0] - slope)];
    }
    if let SplineEnd::Slope(slope) = ends[1] {
        rows[n] = [step[n - 1], 2.0 * step[n - 1], 0.0, 6.0 * (slope - chord[n - 1])];
    }
    let m = solve_tridiagonal(&mut rows);

    (0..n)
        .map(|i| {
            let slope = chord[i] - step[i] * (2.0 * m[i] + m[i + 1]) / 6.0;
            [values[i], slope, 0.5 * m[i], (m[i + 1] - m[i]) / (6.0 * step[i])]
        })
        .collect()
}

/// Solves a diagonally dominant tridiagonal system; `rows` are (lower, diagonal, upper, right side) and are overwritten.
fn solve_tridiagonal(rows: &mut [[f64; 4]]) -> Vec<f64> {
    for i in 1..rows.len() {
        let [_, diagonal, upper, right] = rows[i - 1];
        let factor = rows[i][0] / diagonal;
        rows[i][1] -= factor * upper;
        rows[i][3] -= factor * right;
    }
    let mut solution = vec![0.0; rows.len()];
    let mut next = 0.0;
    for (i, [_, diagonal, upper, right]) in rows.iter().enumerate().rev() {
        next = (right - upper * next) / diagonal;
        solution[i] = next;
    }
    solution
}

#[cfg(test)]
mod tests {
    use super::*;

    fn derivative(c: &[f64; 4], order: usize, u: f64) -> f64 {
        match order {
            0 => c[0] + u * (c[1] + u * (c[2] + u * c[3])),
            1 => c[1] + u * (2.0 * c[2] + u * 3.0 * c[3]),
            _ => 2.0 * c[2] + u * 6.0 * c[3],
        }
    }

    #[test]
    fn a_spline_passes_its_points_with_two_continuous_derivatives() {
        let knots = [0.0, 0.7, 1.0, 2.5, 2.6, 4.0];
        let values = [1.0, -0.2, 0.4, 3.0, 2.0, 2.0];
        for ends in [[SplineEnd::Slope(0.3), SplineEnd::Slope(-1.0)], [SplineEnd::Natural; 2]] {
            let pieces = cubic_spline(&knots, &values, ends);
            for i in 0..5 {
                let h = knots[i + 1] - knots[i];
                assert!((derivative(&pieces[i], 0, 0.0) - values[i]).abs() < 1e-14);
                assert!((derivative(&pieces[i], 0, h) - values[i + 1]).abs() < 1e-13);
                for order in 1..3 {
                    if i < 4 {
                        let gap = derivative(&pieces[i], order, h) - derivative(&pieces[i + 1], order, 0.0);
                        assert!(gap.abs() < 1e-11, "order {order} at knot {}: {gap}", i + 1);
                    }
                }
            }
            let order = if ends[0] == SplineEnd::Natural { 2 } else { 1 };
            let expected = if order == 2 { [0.0, 0.0] } else { [0.3, -1.0] };
            assert!((derivative(&pieces[0], order, 0.0) - expected[0]).abs() < 1e-13);
            assert!((derivative(&pieces[4], order, 1.4) - expected[1]).abs() < 1e-12);
        }
    }

    #[test]
    fn a_clamped_spline_reproduces_a_cubic() {
        let f = |x: f64| 2.0 - x + 0.5 * x * x - 0.25 * x * x * x;
        let slope = |x: f64| -1.0 + x - 0.75 * x * x;
        let knots = [-1.0, 0.2, 0.9, 3.0];
        let pieces = cubic_spline(&knots, &knots.map(f), [SplineEnd::Slope(slope(-1.0)), SplineEnd::Slope(slope(3.0))]);
        for (i, piece) in pieces.iter().enumerate() {
            let u = 0.37 * (knots[i + 1] - knots[i]);
            assert!((derivative(piece, 0, u) - f(knots[i] + u)).abs() < 1e-13);
        }
    }

    #[test]
    fn two_points_and_natural_ends_make_a_line() {
        assert_eq!(cubic_spline(&[1.0, 3.0], &[5.0, 9.0], [SplineEnd::Natural; 2]), [[5.0, 2.0, 0.0, 0.0]]);
    }
}
