//! Powers of normalised time and their derivatives at fixed sample times: the same table serves every piece.

use super::minco::TERMS;

/// Monomials at one normalised time: `rows[order][power]` is d^order/du^order of u^power.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Basis {
    /// Normalised time in [0, 1].
    pub at: f64,
    /// Orders 0 to 3.
    pub rows: [[f64; TERMS]; 4],
}

impl Basis {
    /// The table at `u`.
    pub fn new(u: f64) -> Self {
        let mut rows = [[0.0; TERMS]; 4];
        for (order, row) in rows.iter_mut().enumerate() {
            for (power, value) in row.iter_mut().enumerate().skip(order) {
                let factor: f64 = (power + 1 - order..=power).map(|k| k as f64).product();
                *value = factor * u.powi((power - order) as i32);
            }
        }
        Self { at: u, rows }
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

    /// Chain rule: adds `by * d(derivative)/dc` to `gradient` (same layout as `c`).
    pub fn add_gradient(&self, gradient: &mut [f64], m: usize, d: usize, order: usize, by: f64) {
        let row = &self.rows[order];
        for power in order..TERMS {
            gradient[power * m + d] += row[power] * by;
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
        }
    }
}
