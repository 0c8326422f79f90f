//! The linear-quadratic problem behind the correction: one elimination backwards through the rows, one pass forwards. O(rows).

/// What a row's correction is made of, in the order in which it is eliminated: the corrections of its wheels (left, right), then the
/// state before it: position off (x, y), heading off, the wheels' corrections one row and two rows before.
const SIZE: usize = 9;
/// The state alone.
const STATE: usize = 7;

/// A row as the problem sees it: what its corrections do, and what they cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    /// Where the position goes, m, by a heading that is off by 1 rad.
    pub by_heading: [f64; 2],
    /// Where the position goes by 1 m/s more of each wheel (left, right).
    pub by_wheel: [[f64; 2]; 2],
    /// What else the position goes off by, m: what the correction is against.
    pub drift: [f64; 2],
    /// Weights of each wheel's correction: of itself, of its first and of its second difference.
    pub wheels: [[f64; 3]; 2],
    /// Weight of the mean of both corrections, and of half their difference.
    pub twist: [f64; 2],
}

/// The problem: least sum of all weighted squares.
#[derive(Debug)]
pub(super) struct Problem<'a> {
    /// In order of time.
    pub rows: &'a [Row],
    /// The heading that one row of 1 m/s more of the right wheel and as much less of the left one turns by, halved, rad.
    pub turn: f64,
    /// Weight of the position off, 1/m^2, at every row.
    pub position: f64,
    /// Weights of position and heading off at the end, and what is added to them there (a linear cost, of x, y, heading).
    pub end: ([f64; 2], [f64; 3]),
    /// Weights of first and second difference of each wheel's correction as it goes back to zero behind the last row.
    pub rest: [[f64; 2]; 2],
}

/// What of an elimination is needed on the way forwards.
#[derive(Debug, Clone, Copy)]
struct Gain {
    /// For each wheel, the rest of its row of the matrix over the pivot, and the linear part.
    rows: [[f64; SIZE]; 2],
    linear: [f64; 2],
}

type Square = [[f64; STATE]; STATE];

impl Problem<'_> {
    /// The best correction of each row's wheels (left, right), m/s. `None`: the weights leave it open.
    pub fn solve(&self) -> Option<Vec<[f64; 2]>> {
        let mut gains = Vec::with_capacity(self.rows.len());
        let (mut square, mut linear) = self.at_the_end();
        for row in self.rows.iter().rev() {
            let (matrix, vector) = self.before(row, &square, &linear);
            let gain;
            (gain, square, linear) = eliminate(matrix, vector)?;
            (0..2).for_each(|d| square[d][d] += self.position);
            gains.push(gain);
        }
        let mut state = [0.0; STATE];
        let corrections = self.rows.iter().zip(gains.iter().rev()).map(|(row, gain)| {
            let of_state = |wheel: usize| -> f64 { (0..STATE).map(|i| gain.rows[wheel][2 + i] * state[i]).sum() };
            let right = -(gain.linear[1] + of_state(1));
            let left = -(gain.linear[0] + gain.rows[0][1] * right + of_state(0));
            let [x, y, heading, before_left, before_right, ..] = state;
            let moved = |d: usize| {
                row.by_heading[d] * heading + row.by_wheel[0][d] * left + row.by_wheel[1][d] * right + row.drift[d]
            };
            state = [
                x + moved(0),
                y + moved(1),
                heading + self.turn * (right - left),
                left,
                right,
                before_left,
                before_right,
            ];
            [left, right]
        });
        Some(corrections.collect())
    }

    /// The cost of the state behind the last row.
    fn at_the_end(&self) -> (Square, [f64; STATE]) {
        let mut square = [[0.0; STATE]; STATE];
        let ([position, heading], [x, y, yaw]) = self.end;
        (square[0][0], square[1][1], square[2][2]) = (position, position, heading);
        for (wheel, [first, second]) in self.rest.iter().enumerate() {
            let (last, before) = (3 + wheel, 5 + wheel);
            // Two rows of rest follow: differences (-p), (q - 2 p), then (p).
            square[last][last] += first + 5.0 * second;
            square[last][before] -= 2.0 * second;
            square[before][last] -= 2.0 * second;
            square[before][before] += second;
        }
        (square, [x, y, yaw, 0.0, 0.0, 0.0, 0.0])
    }

    /// The cost of a row's corrections and the state before it, from the cost of the state behind it.
    fn before(&self, row: &Row, square: &Square, linear: &[f64; STATE]) -> ([[f64; SIZE]; SIZE], [f64; SIZE]) {
        // The state behind, as sums over (corrections, state before).
        let position =
            |d: usize| [(0, row.by_wheel[0][d]), (1, row.by_wheel[1][d]), (2 + d, 1.0), (4, row.by_heading[d])];
        let nothing = (0, 0.0);
        let behind: [[(usize, f64); 4]; 3] =
            [position(0), position(1), [(0, -self.turn), (1, self.turn), (4, 1.0), nothing]];
        // The others are copies: corrections become those of one row before, those of one row before of two.
        const COPIES: [usize; 4] = [0, 1, 5, 6];
        let mut half = [[0.0; SIZE]; STATE];
        for i in 0..STATE {
            for (k, sum) in behind.iter().enumerate() {
                sum.iter().for_each(|(j, factor)| half[i][*j] += square[i][k] * factor);
            }
            COPIES.iter().enumerate().for_each(|(k, j)| half[i][*j] += square[i][3 + k]);
        }
        let mut matrix = [[0.0; SIZE]; SIZE];
        let mut vector = [0.0; SIZE];
        let pushed: [f64; STATE] =
            std::array::from_fn(|i| linear[i] + square[i][0] * row.drift[0] + square[i][1] * row.drift[1]);
        for (k, sum) in behind.iter().enumerate() {
            for (j, factor) in sum {
                (0..SIZE).for_each(|m| matrix[*j][m] += factor * half[k][m]);
                vector[*j] += factor * pushed[k];
            }
        }
        for (k, j) in COPIES.iter().enumerate() {
            (0..SIZE).for_each(|m| matrix[*j][m] += half[3 + k][m]);
            vector[*j] += pushed[3 + k];
        }
        for (wheel, [own, first, second]) in row.wheels.iter().enumerate() {
            let at = [wheel, 5 + wheel, 7 + wheel];
            let mut add = |weights: f64, shape: [f64; 3]| {
                for a in 0..3 {
                    (0..3).for_each(|b| matrix[at[a]][at[b]] += weights * shape[a] * shape[b]);
                }
            };
            add(*own, [1.0, 0.0, 0.0]);
            add(*first, [1.0, -1.0, 0.0]);
            add(*second, [1.0, -2.0, 1.0]);
        }
        let [mean, difference] = row.twist.map(|weight| 0.25 * weight);
        (matrix[0][0], matrix[1][1]) = (matrix[0][0] + mean + difference, matrix[1][1] + mean + difference);
        (matrix[0][1], matrix[1][0]) = (matrix[0][1] + mean - difference, matrix[1][0] + mean - difference);
        (matrix, vector)
    }
}

/// Minimises over the first two variables: how, and the cost of the others.
fn eliminate(mut matrix: [[f64; SIZE]; SIZE], mut vector: [f64; SIZE]) -> Option<(Gain, Square, [f64; STATE])> {
    let mut gain = Gain { rows: [[0.0; SIZE]; 2], linear: [0.0; 2] };
    for wheel in 0..2 {
        let pivot = matrix[wheel][wheel];
        if !(pivot > 0.0 && pivot.is_finite()) {
            return None;
        }
        let row = matrix[wheel].map(|v| v / pivot);
        let constant = vector[wheel] / pivot;
        for i in wheel + 1..SIZE {
            let factor = matrix[i][wheel];
            (wheel + 1..SIZE).for_each(|j| matrix[i][j] -= factor * row[j]);
            vector[i] -= factor * constant;
        }
        (gain.rows[wheel], gain.linear[wheel]) = (row, constant);
    }
    let square = std::array::from_fn(|i| std::array::from_fn(|j| matrix[2 + i][2 + j]));
    Some((gain, square, std::array::from_fn(|i| vector[2 + i])))
}

#[cfg(test)]
mod tests {
    use crate::math::real;
    use nalgebra::{DMatrix, DVector};

    use super::*;

    /// A few rows of a turning drive, unevenly weighed.
    fn rows() -> Vec<Row> {
        let row = |k: usize| {
            let (sin, cos) = real::sin_cos(0.3 * k as f64);
            let by_heading = [-0.05 * sin, 0.05 * cos];
            let aside = 0.5 * 0.1 / 0.4;
            let along = |arm: f64| [0.05 * cos + arm * by_heading[0], 0.05 * sin + arm * by_heading[1]];
            Row {
                by_heading,
                by_wheel: [along(-aside), along(aside)],
                drift: [1e-3 * cos, 2e-3 * sin],
                wheels: [[1.0 + k as f64, 3.0, 2.0], [2.0, 1.0, 4.0 - 0.3 * k as f64]],
                twist: [0.5, 1.5],
            }
        };
        (0..7).map(row).collect()
    }

    #[test]
    fn corrections_are_the_least_squares_of_everything_at_once() {
        let rows = rows();
        let (turn, position, end) = (0.25, 1e3, ([1e5, 1e4], [0.3, -0.2, 0.1]));
        let rest = [[2.0, 3.0], [1.0, 5.0]];
        let found = Problem { rows: &rows, turn, position, end, rest }.solve().expect("weights on everything");

        // The same cost from the definition, as a function of all corrections.
        let cost = |c: &[f64]| -> f64 {
            let correction = |k: isize, wheel: usize| {
                let at = usize::try_from(k).ok().filter(|k| *k < rows.len());
                at.map_or(0.0, |k| c[2 * k + wheel])
            };
            let (mut off, mut heading, mut sum) = ([0.0; 2], 0.0, 0.0);
            for (k, row) in rows.iter().enumerate() {
                let k = k as isize;
                off = [0, 1].map(|d| {
                    let wheels: f64 = (0..2).map(|wheel| row.by_wheel[wheel][d] * correction(k, wheel)).sum();
                    off[d] + row.by_heading[d] * heading + wheels + row.drift[d]
                });
                heading += turn * (correction(k, 1) - correction(k, 0));
                let weight = if k as usize + 1 < rows.len() { position } else { end.0[0] };
                sum += weight * (off[0] * off[0] + off[1] * off[1]);
                let [left, right] = [0, 1].map(|wheel| correction(k, wheel));
                sum += row.twist[0] * real::powi(0.5 * (left + right), 2)
                    + row.twist[1] * real::powi(0.5 * (right - left), 2);
                sum += (0..2).map(|wheel| row.wheels[wheel][0] * real::powi(correction(k, wheel), 2)).sum::<f64>();
            }
            for k in 0..rows.len() as isize + 2 {
                for (wheel, at_rest) in rest.iter().enumerate() {
                    let weights =
                        rows.get(k as usize).map_or(*at_rest, |row| [row.wheels[wheel][1], row.wheels[wheel][2]]);
                    let [now, last, before] = [0, 1, 2].map(|back| correction(k - back, wheel));
                    let first = if k as usize > rows.len() { 0.0 } else { weights[0] * real::powi(now - last, 2) };
                    sum += first + weights[1] * real::powi(now - 2.0 * last + before, 2);
                }
            }
            let linear = end.1[0] * off[0] + end.1[1] * off[1] + end.1[2] * heading;
            sum + end.0[1] * heading * heading + 2.0 * linear
        };
        // A quadratic function: its matrix from values, exactly but for rounding.
        let size = 2 * rows.len();
        let unit = |i: usize, j: usize| {
            let mut c = vec![0.0; size];
            c[i] += 1.0;
            c[j] += 1.0;
            c
        };
        let (nothing, mut single) = (cost(&vec![0.0; size]), vec![0.0; size]);
        let alone: Vec<f64> = (0..size)
            .map(|i| {
                single.fill(0.0);
                single[i] = 1.0;
                cost(&single)
            })
            .collect();
        let matrix = DMatrix::from_fn(size, size, |i, j| 0.5 * (cost(&unit(i, j)) - alone[i] - alone[j] + nothing));
        let half = DVector::from_fn(size, |i, _| 0.5 * (alone[i] - nothing - matrix[(i, i)]));
        let expected = matrix.lu().solve(&-half).expect("regular");
        for (k, pair) in found.iter().enumerate() {
            for (wheel, one) in pair.iter().enumerate() {
                assert!((one - expected[2 * k + wheel]).abs() < 1e-7, "{k}: {pair:?} {expected}");
            }
        }
    }

    #[test]
    fn without_weights_there_is_no_answer() {
        let free = Row { wheels: [[0.0; 3]; 2], twist: [0.0; 2], by_wheel: [[0.0; 2]; 2], ..rows()[0] };
        let problem =
            Problem { rows: &[free], turn: 0.0, position: 1.0, end: ([1.0; 2], [0.0; 3]), rest: [[0.0; 2]; 2] };
        assert_eq!(problem.solve(), None);
    }
}
