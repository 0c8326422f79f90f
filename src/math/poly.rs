//! Piecewise polynomials in several dimensions, of any degree.

/// One polynomial piece: `value[d](u) = sum_k coefficients[d][k] u^k` for `u` in `[0, duration]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// Length of the parameter's range.
    pub duration: f64,
    /// Per dimension, ascending powers.
    pub coefficients: Vec<Vec<f64>>,
}

impl Piece {
    /// Derivative of the given order of dimension `d` at `u`; order 0 is the value.
    pub fn derivative(&self, d: usize, order: usize, u: f64) -> f64 {
        let c = &self.coefficients[d];
        let mut sum = 0.0;
        for k in (order..c.len()).rev() {
            let factor: f64 = (k + 1 - order..=k).map(|m| m as f64).product();
            sum = sum * u + factor * c[k];
        }
        sum
    }
}

/// Pieces one after the other; the parameter runs from 0 to the sum of durations.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PiecewisePoly {
    /// In order. Never empty once built.
    pub pieces: Vec<Piece>,
}

impl PiecewisePoly {
    /// The whole parameter range.
    pub fn duration(&self) -> f64 {
        self.pieces.iter().map(|p| p.duration).sum()
    }

    /// Piece and local parameter of a global parameter, clamped to the ends.
    pub fn locate(&self, t: f64) -> (usize, f64) {
        let mut rest = t.max(0.0);
        for (i, piece) in self.pieces.iter().enumerate() {
            if rest < piece.duration || i + 1 == self.pieces.len() {
                return (i, rest.min(piece.duration));
            }
            rest -= piece.duration;
        }
        (0, 0.0)
    }

    /// Derivative of dimension `d` at the global parameter `t`.
    pub fn derivative(&self, d: usize, order: usize, t: f64) -> f64 {
        let (i, u) = self.locate(t);
        self.pieces[i].derivative(d, order, u)
    }
}
