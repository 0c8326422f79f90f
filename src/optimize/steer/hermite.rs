//! The quintic piece in unit time, from values and two derivatives at both ends.

use crate::math::real;

/// Data of a piece and dimension: value, first and second derivative in unit time at the start, then at the end.
pub(super) const DATA: usize = 6;
/// Derivatives kept at a node, the value included.
pub(super) const ORDERS: usize = 3;

/// Coefficients (rows, ascending powers) from the data (columns).
const COEFFICIENTS: [[f64; DATA]; 6] = [
    [1.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0, 0.0, 0.0],
    [0.0, 0.0, 0.5, 0.0, 0.0, 0.0],
    [-10.0, -6.0, -1.5, 10.0, -4.0, 0.5],
    [15.0, 8.0, 1.5, -15.0, 7.0, -1.0],
    [-6.0, -3.0, -0.5, 6.0, -3.0, 0.5],
];

/// Influence of each datum on the value and its first three derivatives at one place of the piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Basis {
    /// `rows[order][datum]`, derivatives in unit time.
    pub rows: [[f64; DATA]; 4],
}

impl Basis {
    /// At `u` in [0, 1].
    pub fn new(u: f64) -> Self {
        let mut rows = [[0.0; DATA]; 4];
        for (order, row) in rows.iter_mut().enumerate() {
            for (power, coefficients) in COEFFICIENTS.iter().enumerate().skip(order) {
                let factor: f64 = (power + 1 - order..=power).map(|k| k as f64).product();
                let monomial = factor * real::powi(u, (power - order) as i32);
                for (value, c) in row.iter_mut().zip(coefficients) {
                    *value += monomial * c;
                }
            }
        }
        Self { rows }
    }

    /// Value and three derivatives in unit time.
    pub fn at(&self, data: &[f64; DATA]) -> [f64; 4] {
        let mut values = [0.0; 4];
        for (value, row) in values.iter_mut().zip(&self.rows) {
            for (a, b) in row.iter().zip(data) {
                *value += a * b;
            }
        }
        values
    }
}

/// Integral over unit time of the product of two data's third derivatives.
pub(super) fn jerk_energy() -> [[f64; DATA]; DATA] {
    // Three points are exact up to degree 5; the product has degree 4.
    let offset = 0.5 * 0.6f64.sqrt();
    let points = [(0.5 - offset, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.5 + offset, 5.0 / 18.0)];
    let mut energy = [[0.0; DATA]; DATA];
    for (u, weight) in points {
        let jerk = Basis::new(u).rows[3];
        for (row, a) in energy.iter_mut().zip(&jerk) {
            for (value, b) in row.iter_mut().zip(&jerk) {
                *value += weight * a * b;
            }
        }
    }
    energy
}

/// Ascending powers of unit time.
pub(super) fn coefficients(data: &[f64; DATA]) -> [f64; 6] {
    COEFFICIENTS.map(|row| row.iter().zip(data).map(|(a, b)| a * b).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_piece_takes_its_data_at_both_ends() {
        let data = [0.3, -1.0, 2.0, 0.7, 1.5, -0.4];
        let (start, end) = (Basis::new(0.0).at(&data), Basis::new(1.0).at(&data));
        for k in 0..3 {
            assert!((start[k] - data[k]).abs() < 1e-12 && (end[k] - data[3 + k]).abs() < 1e-12);
        }
    }

    #[test]
    fn each_order_is_the_derivative_of_the_one_before() {
        let data = [0.3, -1.0, 2.0, 0.7, 1.5, -0.4];
        for order in 1..4 {
            let numeric =
                crate::math::fd::numeric_gradient(|u| Basis::new(u[0]).at(&data)[order - 1], &[0.37], 1e-3)[0];
            assert!((Basis::new(0.37).at(&data)[order] - numeric).abs() < 1e-7);
        }
        let c = coefficients(&data);
        let value: f64 = (0..6).map(|k| c[k] * real::powi(0.37, k as i32)).sum();
        assert!((Basis::new(0.37).at(&data)[0] - value).abs() < 1e-12);
    }

    #[test]
    fn the_energy_is_the_integral_of_the_squared_jerk() {
        let data = [0.3, -1.0, 2.0, 0.7, 1.5, -0.4];
        let energy = jerk_energy();
        let form: f64 = (0..DATA).map(|i| (0..DATA).map(|j| data[i] * energy[i][j] * data[j]).sum::<f64>()).sum();
        let n = 20000;
        let direct: f64 =
            (0..n).map(|k| real::powi(Basis::new((k as f64 + 0.5) / n as f64).at(&data)[3], 2) / n as f64).sum();
        assert!((form / direct - 1.0).abs() < 1e-6);
    }
}
