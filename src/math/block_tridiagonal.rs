//! Symmetric positive definite systems with 3 x 3 blocks on the diagonal and beside it: block Cholesky, no allocation.

type Block = [[f64; 3]; 3];

/// Least pivot accepted; a smaller one means that the matrix is singular to working precision.
const PIVOT_FLOOR: f64 = 1e-280;

/// A system of `size` block rows; filled by the caller, factored in place, solved for many right-hand sides.
#[derive(Debug, Clone)]
pub struct BlockTridiagonal {
    /// Diagonal blocks (lower triangle used); after [`Self::factor`] their Cholesky factors with inverted diagonals.
    pub diagonal: Vec<Block>,
    /// `below[k]`: block row `k + 1`, block column `k`. One fewer than `diagonal`.
    pub below: Vec<Block>,
}

impl BlockTridiagonal {
    /// A zero system.
    pub fn new(size: usize) -> Self {
        Self { diagonal: vec![[[0.0; 3]; 3]; size], below: vec![[[0.0; 3]; 3]; size.saturating_sub(1)] }
    }

    /// Replaces the blocks by the Cholesky factor `L` (`A = L L^T`).
    pub fn factor(&mut self) {
        for k in 0..self.diagonal.len() {
            factor_block(&mut self.diagonal[k]);
            if k + 1 == self.diagonal.len() {
                break;
            }
            // W = A_below L^-T, row by row; then the next diagonal block loses W W^T.
            let l = self.diagonal[k];
            let w = &mut self.below[k];
            for row in w.iter_mut() {
                row[0] *= l[0][0];
                row[1] = (row[1] - l[1][0] * row[0]) * l[1][1];
                row[2] = (row[2] - l[2][0] * row[0] - l[2][1] * row[1]) * l[2][2];
            }
            let next = &mut self.diagonal[k + 1];
            for a in 0..3 {
                for b in 0..=a {
                    next[a][b] -= w[a][0] * w[b][0] + w[a][1] * w[b][1] + w[a][2] * w[b][2];
                }
            }
        }
    }

    /// Solves in place for `columns` right-hand sides at once: `values[(3 k + row) * columns + column]`.
    pub fn solve(&self, values: &mut [f64], columns: usize) {
        let size = self.diagonal.len();
        debug_assert_eq!(values.len(), 3 * size * columns);
        for c in 0..columns {
            let at = |k: usize, row: usize| (3 * k + row) * columns + c;
            let mut previous = [0.0; 3];
            for k in 0..size {
                let l = &self.diagonal[k];
                let mut r = [values[at(k, 0)], values[at(k, 1)], values[at(k, 2)]];
                if k > 0 {
                    let w = &self.below[k - 1];
                    for (value, row) in r.iter_mut().zip(w) {
                        *value -= row[0] * previous[0] + row[1] * previous[1] + row[2] * previous[2];
                    }
                }
                r[0] *= l[0][0];
                r[1] = (r[1] - l[1][0] * r[0]) * l[1][1];
                r[2] = (r[2] - l[2][0] * r[0] - l[2][1] * r[1]) * l[2][2];
                for row in 0..3 {
                    values[at(k, row)] = r[row];
                }
                previous = r;
            }
            for k in (0..size).rev() {
                let l = &self.diagonal[k];
                let mut r = [values[at(k, 0)], values[at(k, 1)], values[at(k, 2)]];
                if k + 1 < size {
                    let w = &self.below[k];
                    for (row, value) in r.iter_mut().enumerate() {
                        *value -= w[0][row] * previous[0] + w[1][row] * previous[1] + w[2][row] * previous[2];
                    }
                }
                r[2] *= l[2][2];
                r[1] = (r[1] - l[2][1] * r[2]) * l[1][1];
                r[0] = (r[0] - l[1][0] * r[1] - l[2][0] * r[2]) * l[0][0];
                for row in 0..3 {
                    values[at(k, row)] = r[row];
                }
                previous = r;
            }
        }
    }
}

/// Cholesky of one block; the diagonal holds reciprocals, so that solving only multiplies.
fn factor_block(a: &mut Block) {
    a[0][0] = 1.0 / a[0][0].max(PIVOT_FLOOR).sqrt();
    a[1][0] *= a[0][0];
    a[2][0] *= a[0][0];
    a[1][1] = 1.0 / (a[1][1] - a[1][0] * a[1][0]).max(PIVOT_FLOOR).sqrt();
    a[2][1] = (a[2][1] - a[2][0] * a[1][0]) * a[1][1];
    a[2][2] = 1.0 / (a[2][2] - a[2][0] * a[2][0] - a[2][1] * a[2][1]).max(PIVOT_FLOOR).sqrt();
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_solution_put_back_gives_the_right_hand_side(
            entries in proptest::collection::vec(-1.0..1.0f64, 200), size in 1usize..6, columns in 1usize..4,
        ) {
            // A = B B^T + I with B block lower bidiagonal is positive definite and block tridiagonal.
            let n = 3 * size;
            let mut b = vec![vec![0.0; n]; n];
            for i in 0..n {
                for j in 0..n {
                    if j / 3 == i / 3 || j / 3 + 1 == i / 3 {
                        b[i][j] = entries[(i * 7 + j * 3) % 200];
                    }
                }
            }
            let a = |i: usize, j: usize| -> f64 {
                (0..n).map(|k| b[i][k] * b[j][k]).sum::<f64>() + if i == j { 1.0 } else { 0.0 }
            };
            let mut system = BlockTridiagonal::new(size);
            for k in 0..size {
                for r in 0..3 {
                    for c in 0..3 {
                        system.diagonal[k][r][c] = a(3 * k + r, 3 * k + c);
                        if k + 1 < size {
                            system.below[k][r][c] = a(3 * k + 3 + r, 3 * k + c);
                        }
                    }
                }
            }
            let right: Vec<f64> = entries.iter().copied().take(n * columns).collect();
            let mut x = right.clone();
            system.factor();
            system.solve(&mut x, columns);
            for i in 0..n {
                for c in 0..columns {
                    let product: f64 = (0..n).map(|j| a(i, j) * x[j * columns + c]).sum();
                    prop_assert!((product - right[i * columns + c]).abs() < 1e-11);
                }
            }
        }
    }
}
