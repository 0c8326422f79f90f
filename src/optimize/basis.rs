//! Powers of normalised time and their derivatives at fixed sample times: the same table serves every piece.

use super::minco::TERMS;
use crate::math::real;

/// Monomials at one normalised time: `rows[order][power]` is d^order/du^order of u^power.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Basis {
    /// Normalised time in [0, 1].
    pub at: f64,
    /// Orders 0 to 3.
    pub rows: [[f64; TERMS]; 4],
    /// The same by power: `columns[power][order]`.
    pub columns: [[f64; 4]; TERMS],
}

impl Basis {
    /// The table at `u`.
    pub fn new(u: f64) -> Self {
        let mut rows = [[0.0; TERMS]; 4];
        for (order, row) in rows.iter_mut().enumerate() {
            for (power, value) in row.iter_mut().enumerate().skip(order) {
                let factor: f64 = (power + 1 - order..=power).map(|k| k as f64).product();
                *value = factor * real::powi(u, (power - order) as i32);
            }
        }
        let columns = std::array::from_fn(|power| std::array::from_fn(|order| rows[order][power]));
        Self { at: u, rows, columns }
    }

    /// Derivative of one order and dimension in real time; `c` is the piece's `[power * m + dimension]`, `scale` is
    /// `T^-order`.
    pub fn derivative(&self, c: &[f64], m: usize, d: usize, order: usize, scale: f64) -> f64 {
        let row = &self.rows[order];
        let mut sum = 0.0;
        for power in order..TERMS {
            sum += row[power] * c[power * m + d];
        }
        sum * scale
    }

    /// Orders 0 to 3 of one dimension in one go; `rate` is `1 / T`.
    #[inline]
    pub fn orders(&self, c: &[f64], m: usize, d: usize, rate: f64) -> [f64; 4] {
        let mut sums = [0.0; 4];
        for (value, factors) in c[d..].iter().step_by(m).zip(&self.columns) {
            for (sum, factor) in sums.iter_mut().zip(factors) {
                *sum += factor * value;
            }
        }
        let rate2 = rate * rate;
        [sums[0], sums[1] * rate, sums[2] * rate2, sums[3] * rate2 * rate]
    }

    /// Chain rule of [`Self::orders`], all orders in one go: `by` is already scaled by `rate^order`.
    #[inline]
    pub fn add_gradients(&self, gradient: &mut [f64], m: usize, d: usize, by: [f64; 4]) {
        for (value, f) in gradient[d..].iter_mut().step_by(m).zip(&self.columns) {
            *value += (f[0] * by[0] + f[1] * by[1]) + (f[2] * by[2] + f[3] * by[3]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_order_is_the_derivative_of_the_one_before() {
        let c = [0.3, -1.0, 2.0, 0.5, -0.7, 1.1, 0.2, -0.4];
        for order in 1..4 {
            let at = |u: &[f64]| Basis::new(u[0]).derivative(&c, 1, 0, order - 1, 1.0);
            let numeric = crate::math::fd::numeric_gradient(at, &[0.37], 1e-3)[0];
            assert!((Basis::new(0.37).derivative(&c, 1, 0, order, 1.0) - numeric).abs() < 1e-9);
            let scaled = Basis::new(0.37).derivative(&c, 1, 0, order, real::powi(0.7, order as i32));
            assert!((Basis::new(0.37).orders(&c, 1, 0, 0.7)[order] - scaled).abs() < 1e-12);
        }
    }
}
