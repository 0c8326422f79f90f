//! Symmetric positive definite systems with two diagonals below the main one: Cholesky, O(n), no allocation.

/// Least pivot accepted, as a share of the diagonal entry it comes from; a smaller one means that the matrix is singular to working
/// precision, and the unknown is held where it is.
const PIVOT_FLOOR: f64 = 1e-14;

/// A system; filled by the caller, factored in place, solved for any number of right-hand sides.
#[derive(Debug, Clone, Default)]
pub struct Pentadiagonal {
    /// Row i: the entries of columns i, i - 1, i - 2. After [`Self::factor`] those of L (A = L L^T), the first one inverted. What lies
    /// left of the first column is not read.
    pub rows: Vec<[f64; 3]>,
}

impl Pentadiagonal {
    /// Makes it a zero system of `size` unknowns.
    pub fn reset(&mut self, size: usize) {
        self.rows.clear();
        self.rows.resize(size, [0.0; 3]);
    }

    /// Adds a symmetric 3 x 3 block to the unknowns from `first` on; `block` is its lower triangle, row by row.
    pub fn add(&mut self, first: usize, block: [f64; 6]) {
        let [a, b, c, d, e, f] = block;
        self.rows[first][0] += a;
        self.rows[first + 1][1] += b;
        self.rows[first + 1][0] += c;
        self.rows[first + 2][2] += d;
        self.rows[first + 2][1] += e;
        self.rows[first + 2][0] += f;
    }

    /// Replaces the matrix by its Cholesky factor.
    pub fn factor(&mut self) {
        let (mut above, mut above2) = ([0.0f64; 3], [0.0f64; 3]);
        for (i, row) in self.rows.iter_mut().enumerate() {
            let second = if i > 1 { row[2] * above2[0] } else { 0.0 };
            let first = if i > 0 { (row[1] - second * above[1]) * above[0] } else { 0.0 };
            let pivot = row[0] - first * first - second * second;
            let inverse = if pivot > PIVOT_FLOOR * row[0] { 1.0 / pivot.sqrt() } else { 0.0 };
            *row = [inverse, first, second];
            (above2, above) = (above, *row);
        }
    }

    /// Solves in place.
    pub fn solve(&self, x: &mut [f64]) {
        debug_assert_eq!(x.len(), self.rows.len());
        for i in 0..x.len() {
            let mut value = x[i];
            if i > 0 {
                value -= self.rows[i][1] * x[i - 1];
            }
            if i > 1 {
                value -= self.rows[i][2] * x[i - 2];
            }
            x[i] = value * self.rows[i][0];
        }
        for i in (0..x.len()).rev() {
            let mut value = x[i];
            if i + 1 < x.len() {
                value -= self.rows[i + 1][1] * x[i + 1];
            }
            if i + 2 < x.len() {
                value -= self.rows[i + 2][2] * x[i + 2];
            }
            x[i] = value * self.rows[i][0];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(64) })]
        #[test]
        fn the_solution_put_back_gives_the_right_hand_side(
            entries in proptest::collection::vec(-1.0..1.0f64, 90), size in 3usize..20,
        ) {
            // A sum of 3 x 3 blocks v v^T and the identity is positive definite and pentadiagonal.
            let mut dense = vec![vec![0.0; size]; size];
            let mut system = Pentadiagonal::default();
            system.reset(size);
            for (i, row) in dense.iter_mut().enumerate() {
                row[i] += 1.0;
                system.rows[i][0] += 1.0;
            }
            for first in 0..size - 2 {
                let v = [entries[3 * first], entries[3 * first + 1], entries[3 * first + 2]];
                for a in 0..3 {
                    for b in 0..3 {
                        dense[first + a][first + b] += v[a] * v[b];
                    }
                }
                system.add(first, [v[0] * v[0], v[1] * v[0], v[1] * v[1], v[2] * v[0], v[2] * v[1], v[2] * v[2]]);
            }
            let right = &entries[60..60 + size];
            let mut x = right.to_vec();
            system.factor();
            system.solve(&mut x);
            for i in 0..size {
                let product: f64 = (0..size).map(|j| dense[i][j] * x[j]).sum();
                prop_assert!((product - right[i]).abs() < 1e-12);
            }
        }
    }
}
