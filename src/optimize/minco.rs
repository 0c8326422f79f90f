//! MINCO with s = 4 (\[SCR\] section IV-A): the curve of least integral of the squared fourth derivative through given waypoints
//! at given durations, in any number of dimensions.
//!
//! # Deviation
//! \[SCR\] and its source solve one banded system for all 8M coefficients. Eliminating the rows of order 0 to 3 by Hermite's form
//! leaves the first three derivatives at the M - 1 waypoints as unknowns and the rows of order 4 to 6 as equations. Those are
//! the optimality conditions of the energy, so the system is symmetric, positive definite and block tridiagonal (3 x 3): about
//! a tenth of the arithmetic, orders 0 to 3 exact by construction. The same curve; the tests compare with the full system.

use crate::math::block_tridiagonal::BlockTridiagonal;

/// Coefficients of a piece: degree 7.
pub const TERMS: usize = 8;
/// Derivatives fixed at the ends: value to third derivative.
pub const ORDERS: usize = 4;

/// Fourth to seventh coefficient of the unit-time piece from its Hermite data
/// (p1 - p0, v0, a0, j0, v1, a1, j1), derivatives in unit time.
const HERMITE: [[f64; 7]; 4] = [
    [35.0, -20.0, -5.0, -2.0 / 3.0, -15.0, 2.5, -1.0 / 6.0],
    [-84.0, 45.0, 10.0, 1.0, 39.0, -7.0, 0.5],
    [70.0, -36.0, -7.5, -2.0 / 3.0, -34.0, 6.5, -0.5],
    [-20.0, 10.0, 2.0, 1.0 / 6.0, 10.0, -2.0, 1.0 / 6.0],
];

/// Energy of the unit-time piece as a quadratic form in (v0, a0, j0, v1, a1, j1); the energy is the integral itself.
const STIFFNESS: [[f64; 6]; 6] = [
    [25920.0, 5400.0, 480.0, 24480.0, -4680.0, 360.0],
    [5400.0, 1200.0, 120.0, 4680.0, -840.0, 60.0],
    [480.0, 120.0, 16.0, 360.0, -60.0, 4.0],
    [24480.0, 4680.0, 360.0, 25920.0, -5400.0, 480.0],
    [-4680.0, -840.0, -60.0, -5400.0, 1200.0, -120.0],
    [360.0, 60.0, 4.0, 480.0, -120.0, 16.0],
];

/// How p1 - p0 pulls on (v0, a0, j0, v1, a1, j1).
const PULL: [f64; 6] = [-50400.0, -10080.0, -840.0, -50400.0, 10080.0, -840.0];

/// Integral over unit time of the squared fourth derivative, from the fourth to seventh coefficient.
fn unit_energy(c: &[f64; 4]) -> f64 {
    let [c4, c5, c6, c7] = *c;
    576.0 * c4 * c4
        + 2880.0 * c4 * c5
        + 4800.0 * c5 * c5
        + 5760.0 * c4 * c6
        + 21600.0 * c5 * c6
        + 25920.0 * c6 * c6
        + 10080.0 * c4 * c7
        + 40320.0 * c5 * c7
        + 100800.0 * c6 * c7
        + 100800.0 * c7 * c7
}

/// Half the derivative of the unit energy by (p0, v0, a0, j0, p1, v1, a1, j1): by partial integration these are the fourth to
/// seventh derivatives at both ends.
fn unit_forces(c: &[f64; 4]) -> [f64; 8] {
    let [c4, c5, c6, c7] = *c;
    let z7 = 5040.0 * c7;
    let (z4, z5, z6) = (24.0 * c4, 120.0 * c5, 720.0 * c6);
    let e6 = z6 + z7;
    let e5 = z5 + z6 + 0.5 * z7;
    let e4 = z4 + z5 + 0.5 * z6 + z7 / 6.0;
    [z7, -z6, z5, -z4, -z7, e6, -e5, e4]
}

fn hermite(rise: f64, start: &[f64; 3], end: &[f64; 3]) -> [f64; 4] {
    let mut c = [0.0; 4];
    for (value, row) in c.iter_mut().zip(&HERMITE) {
        *value = row[0] * rise
            + row[1] * start[0]
            + row[2] * start[1]
            + row[3] * start[2]
            + row[4] * end[0]
            + row[5] * end[1]
            + row[6] * end[2];
    }
    c
}

/// A MINCO curve of M pieces in m dimensions, and memory for its gradients. Nothing is allocated after [`Minco::new`].
///
/// Arrays are flat: states `[(node * 4 + order) * m + dimension]`, coefficients `[(piece * 8 + power) * m + dimension]`.
#[derive(Debug, Clone)]
pub struct Minco {
    pieces: usize,
    dimensions: usize,
    durations: Vec<f64>,
    states: Vec<f64>,
    coefficients: Vec<f64>,
    system: BlockTridiagonal,
    unknowns: Vec<f64>,
    state_gradient: Vec<f64>,
}

impl Minco {
    /// A curve of `pieces >= 1` between two end states, `[order * m + dimension]`, orders 0 to 3. No shape until
    /// [`Self::shape`].
    pub fn new(pieces: usize, start: &[f64], end: &[f64]) -> Self {
        debug_assert!(pieces >= 1 && start.len() == end.len() && start.len().is_multiple_of(ORDERS));
        let dimensions = start.len() / ORDERS;
        let mut states = vec![0.0; (pieces + 1) * ORDERS * dimensions];
        states[..start.len()].copy_from_slice(start);
        states[pieces * ORDERS * dimensions..].copy_from_slice(end);
        Self {
            pieces,
            dimensions,
            durations: vec![1.0; pieces],
            coefficients: vec![0.0; pieces * TERMS * dimensions],
            system: BlockTridiagonal::new(pieces - 1),
            unknowns: vec![0.0; (pieces - 1) * 3 * dimensions],
            state_gradient: vec![0.0; states.len()],
            states,
        }
    }

    /// Number of pieces.
    pub fn pieces(&self) -> usize {
        self.pieces
    }

    /// Number of dimensions.
    pub fn dimensions(&self) -> usize {
        self.dimensions
    }

    /// Seconds of each piece.
    pub fn durations(&self) -> &[f64] {
        &self.durations
    }

    /// Coefficients in normalised time `t / T_i`.
    pub fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    /// Finds the curve through `waypoints` (`[waypoint * m + dimension]`, M - 1 of them) with `durations` (all > 0).
    pub fn shape(&mut self, waypoints: &[f64], durations: &[f64]) {
        let m = self.dimensions;
        debug_assert!(waypoints.len() == (self.pieces - 1) * m && durations.len() == self.pieces);
        self.durations.copy_from_slice(durations);
        for (node, point) in waypoints.chunks_exact(m).enumerate() {
            let at = (node + 1) * ORDERS * m;
            self.states[at..at + m].copy_from_slice(point);
        }
        self.assemble();
        self.system.factor();
        self.system.solve(&mut self.unknowns, m);
        for node in 1..self.pieces {
            let (from, to) = ((node - 1) * 3 * m, (node * ORDERS + 1) * m);
            self.states[to..to + 3 * m].copy_from_slice(&self.unknowns[from..from + 3 * m]);
        }
        for piece in 0..self.pieces {
            self.expand(piece);
        }
    }

    fn assemble(&mut self) {
        let m = self.dimensions;
        let inner = self.pieces - 1;
        self.unknowns.fill(0.0);
        for block in &mut self.system.diagonal {
            *block = [[0.0; 3]; 3];
        }
        for piece in 0..self.pieces {
            let t = self.durations[piece];
            // Row or column of derivative order d carries T^d, the energy T^-7.
            let powers = scale_powers(t);
            let [left, right] = [piece.checked_sub(1), (piece < inner).then_some(piece)];
            for a in 0..3 {
                for b in 0..3 {
                    let scale = powers[a + b];
                    if let Some(node) = left {
                        self.system.diagonal[node][a][b] += scale * STIFFNESS[a][b];
                    }
                    if let Some(node) = right {
                        self.system.diagonal[node][a][b] += scale * STIFFNESS[3 + a][3 + b];
                    }
                    if let (Some(node), Some(_)) = (left, right) {
                        self.system.below[node][a][b] = scale * STIFFNESS[3 + a][b];
                    }
                }
            }
            let unit = [t, t * t, t * t * t];
            let weight = inverse_seventh(t);
            for d in 0..m {
                let state = |node: usize, order: usize| self.states[(node * ORDERS + order) * m + d];
                let rise = state(piece + 1, 0) - state(piece, 0);
                let mut right_side = [0.0; 6];
                for (value, pull) in right_side.iter_mut().zip(&PULL) {
                    *value = -pull * rise;
                }
                for b in 0..3 {
                    // Known end derivatives move to the right-hand side.
                    if left.is_none() {
                        let known = state(0, b + 1) * unit[b];
                        (3..6).for_each(|a| right_side[a] -= STIFFNESS[a][b] * known);
                    }
                    if right.is_none() {
                        let known = state(self.pieces, b + 1) * unit[b];
                        (0..3).for_each(|a| right_side[a] -= STIFFNESS[a][3 + b] * known);
                    }
                }
                for a in 0..3 {
                    let scale = weight * unit[a];
                    if let Some(node) = left {
                        self.unknowns[(node * 3 + a) * m + d] += scale * right_side[a];
                    }
                    if let Some(node) = right {
                        self.unknowns[(node * 3 + a) * m + d] += scale * right_side[3 + a];
                    }
                }
            }
        }
    }

    /// Hermite data of a piece in unit time: rise, start derivatives, end derivatives.
    fn unit_data(&self, piece: usize, d: usize) -> (f64, [f64; 3], [f64; 3]) {
        let m = self.dimensions;
        let t = self.durations[piece];
        let unit = [t, t * t, t * t * t];
        let state = |node: usize, order: usize| self.states[(node * ORDERS + order) * m + d];
        (
            state(piece + 1, 0) - state(piece, 0),
            std::array::from_fn(|k| state(piece, k + 1) * unit[k]),
            std::array::from_fn(|k| state(piece + 1, k + 1) * unit[k]),
        )
    }

    fn expand(&mut self, piece: usize) {
        let m = self.dimensions;
        for d in 0..m {
            let (rise, start, end) = self.unit_data(piece, d);
            let c = hermite(rise, &start, &end);
            let first = self.states[piece * ORDERS * m + d];
            let all = [first, start[0], 0.5 * start[1], start[2] / 6.0, c[0], c[1], c[2], c[3]];
            for (power, value) in all.into_iter().enumerate() {
                self.coefficients[(piece * TERMS + power) * m + d] = value;
            }
        }
    }

    fn high_coefficients(&self, piece: usize, d: usize) -> [f64; 4] {
        let m = self.dimensions;
        std::array::from_fn(|k| self.coefficients[(piece * TERMS + 4 + k) * m + d])
    }

    /// Integral of the squared fourth derivative, `sum over dimensions of weight * integral`. Adds its gradient by waypoints
    /// (`[waypoint * m + dimension]`) and durations.
    pub fn energy(&self, weights: &[f64], by_waypoints: &mut [f64], by_durations: &mut [f64]) -> f64 {
        let m = self.dimensions;
        let mut sum = 0.0;
        for piece in 0..self.pieces {
            let t = self.durations[piece];
            let scale = inverse_seventh(t);
            for d in 0..m {
                let c = self.high_coefficients(piece, d);
                let energy = unit_energy(&c);
                let forces = unit_forces(&c);
                let (_, start, end) = self.unit_data(piece, d);
                let weight = weights[d] * scale;
                sum += weight * energy;
                if piece > 0 {
                    by_waypoints[(piece - 1) * m + d] += 2.0 * weight * forces[0];
                }
                if piece + 1 < self.pieces {
                    by_waypoints[piece * m + d] += 2.0 * weight * forces[4];
                }
                let stretch: f64 =
                    (0..3).map(|k| (k + 1) as f64 * (start[k] * forces[k + 1] + end[k] * forces[k + 5])).sum();
                by_durations[piece] += weight / t * (2.0 * stretch - 7.0 * energy);
            }
        }
        sum
    }

    /// Chain rule for any cost K(c, T): `by_coefficients` is its derivative by the normalised coefficients at fixed T.
    /// Adds dK/dwaypoints to `by_waypoints`, and to `by_durations`, which must hold the derivative at fixed coefficients
    /// already, what the coefficients do when T changes. One solve with the factored (symmetric) system.
    pub fn pull_back(&mut self, by_coefficients: &[f64], by_waypoints: &mut [f64], by_durations: &mut [f64]) {
        let m = self.dimensions;
        self.state_gradient.fill(0.0);
        for piece in 0..self.pieces {
            let t = self.durations[piece];
            let unit = [t, t * t, t * t * t];
            let node = piece * ORDERS * m;
            for d in 0..m {
                let g = |k: usize| by_coefficients[(piece * TERMS + k) * m + d];
                let high = [g(4), g(5), g(6), g(7)];
                let column = |k: usize| -> f64 { (0..4).map(|row| HERMITE[row][k] * high[row]).sum() };
                let rise = column(0);
                let start = [g(1) + column(1), 0.5 * g(2) + column(2), g(3) / 6.0 + column(3)];
                let end = [column(4), column(5), column(6)];
                self.state_gradient[node + d] += g(0) - rise;
                self.state_gradient[node + ORDERS * m + d] += rise;
                for k in 0..3 {
                    let (i, j) = (node + (k + 1) * m + d, node + (ORDERS + k + 1) * m + d);
                    self.state_gradient[i] += unit[k] * start[k];
                    self.state_gradient[j] += unit[k] * end[k];
                    by_durations[piece] +=
                        (k + 1) as f64 * unit[k] / t * (start[k] * self.states[i] + end[k] * self.states[j]);
                }
            }
        }
        for node in 1..self.pieces {
            let (from, to) = ((node * ORDERS + 1) * m, (node - 1) * 3 * m);
            self.unknowns[to..to + 3 * m].copy_from_slice(&self.state_gradient[from..from + 3 * m]);
        }
        self.system.solve(&mut self.unknowns, m);
        self.subtract_adjoint(by_durations);
        for node in 1..self.pieces {
            for d in 0..m {
                by_waypoints[(node - 1) * m + d] += self.state_gradient[node * ORDERS * m + d];
            }
        }
    }

    /// With lambda in `unknowns`: takes d/dx of `lambda . (stationarity of the energy)` off every gradient. That product is
    /// the energy's bilinear form of the curve and of the curve with Hermite data lambda.
    fn subtract_adjoint(&mut self, by_durations: &mut [f64]) {
        let m = self.dimensions;
        for (piece, by_duration) in by_durations.iter_mut().enumerate() {
            let t = self.durations[piece];
            let unit = [t, t * t, t * t * t];
            let scale = inverse_seventh(t);
            let node = piece * ORDERS * m;
            for d in 0..m {
                let lambda = |at: Option<usize>| -> [f64; 3] {
                    std::array::from_fn(|k| at.map_or(0.0, |n| self.unknowns[(n * 3 + k) * m + d] * unit[k]))
                };
                let from = lambda(piece.checked_sub(1));
                let to = lambda((piece + 1 < self.pieces).then_some(piece));
                let back = unit_forces(&hermite(0.0, &from, &to));
                let forces = unit_forces(&self.high_coefficients(piece, d));
                let (rise, start, end) = self.unit_data(piece, d);
                let mut form = back[4] * rise;
                let mut stretch = 0.0;
                for k in 0..3 {
                    let own = start[k] * back[k + 1] + end[k] * back[k + 5];
                    form += own;
                    stretch += (k + 1) as f64 * (own + from[k] * forces[k + 1] + to[k] * forces[k + 5]);
                }
                *by_duration -= scale / t * (stretch - 7.0 * form);
                self.state_gradient[node + d] -= scale * back[0];
                self.state_gradient[node + ORDERS * m + d] -= scale * back[4];
                // Inner derivatives are unknowns, not inputs: only the two ends' are wanted.
                for k in 0..3 {
                    if piece == 0 {
                        self.state_gradient[node + (k + 1) * m + d] -= scale * unit[k] * back[k + 1];
                    }
                    if piece + 1 == self.pieces {
                        self.state_gradient[node + (ORDERS + k + 1) * m + d] -= scale * unit[k] * back[k + 5];
                    }
                }
            }
        }
    }

    /// Gradients by the start and end state, `[order * m + dimension]`, left by the last [`Self::pull_back`].
    pub fn end_state_gradients(&self) -> (&[f64], &[f64]) {
        let width = ORDERS * self.dimensions;
        (&self.state_gradient[..width], &self.state_gradient[self.pieces * width..])
    }
}

fn inverse_seventh(t: f64) -> f64 {
    let t2 = t * t;
    1.0 / (t2 * t2 * t2 * t)
}

/// T^(2-7), T^(3-7), ... T^(6-7): scales of entries whose derivative orders (1-based) sum to 2 ... 6.
fn scale_powers(t: f64) -> [f64; 5] {
    let r = 1.0 / t;
    let (r2, r3) = (r * r, r * r * r);
    [r3 * r2, r2 * r2, r3, r2, r]
}

#[cfg(test)]
#[path = "minco_tests.rs"]
mod tests;
