//! Symmetric positive definite band matrices: Cholesky without pivoting, O(n w^2), no allocation after construction.

/// Lower triangle of a symmetric matrix whose entries vanish more than `width` below the diagonal.
#[derive(Debug, Clone, PartialEq)]
pub struct Banded {
    size: usize,
    width: usize,
    /// Row by row, `width + 1` entries each, the diagonal last.
    rows: Vec<f64>,
}

impl Banded {
    /// A zero matrix.
    pub fn new(size: usize, width: usize) -> Self {
        Self { size, width, rows: vec![0.0; size * (width + 1)] }
    }

    /// Rows.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Sets every entry to zero.
    pub fn clear(&mut self) {
        self.rows.fill(0.0);
    }

    /// Copies another matrix of the same shape.
    pub fn copy_from(&mut self, other: &Self) {
        self.rows.copy_from_slice(&other.rows);
    }

    /// Entry of the lower triangle, `column <= row <= column + width`.
    pub fn entry(&mut self, row: usize, column: usize) -> &mut f64 {
        debug_assert!(column <= row && row <= column + self.width);
        &mut self.rows[row * (self.width + 1) + self.width - (row - column)]
    }

    /// A diagonal entry.
    pub fn diagonal(&self, row: usize) -> f64 {
        self.rows[row * (self.width + 1) + self.width]
    }

    /// The matrix times a vector, appended to nothing: overwrites `out`.
    pub fn multiply(&self, x: &[f64], out: &mut [f64]) {
        out.fill(0.0);
        let stride = self.width + 1;
        for row in 0..self.size {
            let reach = self.width.min(row);
            let entries = &self.rows[row * stride + self.width - reach..row * stride + self.width];
            let columns = row - reach..row;
            let mut sum = self.diagonal(row) * x[row];
            for (entry, column) in entries.iter().zip(columns) {
                sum += entry * x[column];
                out[column] += entry * x[row];
            }
            out[row] += sum;
        }
    }

    /// Replaces the matrix by its Cholesky factor with inverted diagonal. False where it is not positive definite (or not
    /// finite); the contents are lost then.
    #[must_use]
    pub fn factor(&mut self) -> bool {
        let (width, stride) = (self.width, self.width + 1);
        for row in 0..self.size {
            let reach = width.min(row);
            let (done, rest) = self.rows.split_at_mut(row * stride);
            let own = &mut rest[..stride];
            // What is left of the first entry that is not zero stays zero. Whole fours are left out, so every sum adds up as it would.
            let zeros = own[width - reach..width].iter().position(|entry| *entry != 0.0).unwrap_or(reach);
            let from = row - reach + zeros / 4 * 4;
            let blocks = (row - from) / 4;
            for column in (0..blocks).map(|block| from + 4 * block) {
                four_columns(own, done, [width, row, from, column]);
            }
            for column in from + 4 * blocks..row {
                let other = &done[column * stride..(column + 1) * stride];
                let a = &own[width - (row - from)..width - (row - column)];
                let b = &other[width - (column - from)..width];
                let at = width - (row - column);
                own[at] = (own[at] - dot(a, b)) * other[width];
            }
            let above = &own[width - reach..width];
            let pivot = own[width] - dot(above, above);
            if pivot.is_nan() || pivot <= 0.0 || pivot.is_infinite() {
                return false;
            }
            own[width] = 1.0 / pivot.sqrt();
        }
        true
    }

    /// Solves with the factored matrix, in place.
    pub fn solve(&self, values: &mut [f64]) {
        let (width, stride) = (self.width, self.width + 1);
        for row in 0..self.size {
            let reach = width.min(row);
            let own = &self.rows[row * stride..(row + 1) * stride];
            let sum = dot(&own[width - reach..width], &values[row - reach..row]);
            values[row] = (values[row] - sum) * own[width];
        }
        for row in (0..self.size).rev() {
            let reach = width.min(row);
            let own = &self.rows[row * stride..(row + 1) * stride];
            let value = values[row] * own[width];
            values[row] = value;
            for (entry, target) in own[width - reach..width].iter().zip(&mut values[row - reach..row]) {
                *target -= entry * value;
            }
        }
    }
}

/// Entries of a row in four neighbouring columns of the factor: the row is read once for all four.
fn four_columns(own: &mut [f64], done: &[f64], [width, row, from, column]: [usize; 4]) {
    let stride = width + 1;
    let length = column - from;
    let others: [&[f64]; 4] = std::array::from_fn(|k| {
        let last = (column + k) * stride + width;
        &done[last - (length + k)..=last]
    });
    let first = width - (row - from);
    let mut sums = [[0.0; 4]; 4];
    let (a, [b, c, d, e]) = (fours(&own[first..first + length]), others.map(|other| fours(&other[..length])));
    for ((((a, b), c), d), e) in a.iter().zip(b).zip(c).zip(d).zip(e) {
        for (sums, other) in sums.iter_mut().zip([b, c, d, e]) {
            for k in 0..4 {
                sums[k] += a[k] * other[k];
            }
        }
    }
    for (k, (sums, other)) in sums.iter().zip(others).enumerate() {
        let rest: f64 = (0..k).map(|j| own[first + length + j] * other[length + j]).sum();
        let at = first + length + k;
        own[at] = (own[at] - (together(sums) + rest)) * other[length + k];
    }
}

fn fours(values: &[f64]) -> &[[f64; 4]] {
    values.as_chunks().0
}

/// Four sums at a time, which the processor can run side by side.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut sums = [0.0; 4];
    let (one, other) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let rest: f64 = one.1.iter().zip(other.1).map(|(x, y)| x * y).sum();
    for (x, y) in one.0.iter().zip(other.0) {
        for k in 0..4 {
            sums[k] += x[k] * y[k];
        }
    }
    together(&sums) + rest
}

fn together(sums: &[f64; 4]) -> f64 {
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_solution_put_back_gives_the_right_hand_side(
            entries in proptest::collection::vec(-1.0..1.0f64, 300), size in 1usize..30, width in 0usize..14, block in 1usize..9,
        ) {
            // L L^T with a band L and a diagonal away from zero; rows of one block begin at the same column.
            let lower = |i: usize, j: usize| match i.checked_sub(j) {
                Some(0) => 2.0 + entries[i].abs(),
                Some(d) if d <= width && j / block + 1 >= i / block => entries[(i * 11 + j * 5) % 300] / (1.0 + width as f64).sqrt(),
                _ => 0.0,
            };
            let full = |i: usize, j: usize| (0..size).map(|k| lower(i, k) * lower(j, k)).sum::<f64>();
            let mut matrix = Banded::new(size, width);
            for i in 0..size {
                for j in i.saturating_sub(width)..=i {
                    *matrix.entry(i, j) = full(i, j);
                }
            }
            let wanted = &entries[100..100 + size];
            let mut product = vec![0.0; size];
            matrix.multiply(wanted, &mut product);
            for (i, value) in product.iter().enumerate() {
                let direct: f64 = (0..size).map(|j| full(i, j) * wanted[j]).sum();
                prop_assert!((value - direct).abs() < 1e-12);
            }
            prop_assert!(matrix.factor());
            matrix.solve(&mut product);
            for (found, wanted) in product.iter().zip(wanted) {
                prop_assert!((found - wanted).abs() < 1e-6, "{found} {wanted}");
            }
        }
    }

    #[test]
    fn what_is_not_positive_definite_is_said() {
        let mut matrix = Banded::new(2, 1);
        *matrix.entry(0, 0) = 1.0;
        *matrix.entry(1, 0) = 2.0;
        *matrix.entry(1, 1) = 1.0;
        assert!(!matrix.factor());
    }
}
