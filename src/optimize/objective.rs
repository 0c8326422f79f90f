//! Cost of one driven leg and its gradient by waypoints and virtual times: \[SCR\] Eq. 12.
//!
//! Everything is sampled at fixed *normalised* times, so a piece's duration enters only through the scale T^-order of each
//! derivative and the quadrature weight; the terms with the derivative of a constraint along the trajectory (MATH section 3)
//! are in that scale.

use super::basis::Basis;
use super::flatness::{BaseMotion, base_motion, pull_back};
use super::minco::{Minco, TERMS};
use super::options::OptimizeOptions;
use super::penalty::clearance::{ClearancePenalty, Placement};
use super::penalty::field::DistanceField;
use super::penalty::touch::ByPose;
use super::penalty::{Judge, Limits, Penalise, Worst, joint, speed, turn};
use super::time_map;
use crate::math::real;
use crate::math::smooth::smooth_switch;
use crate::robot::RobotModel;

/// Weights of one pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Weights {
    /// Of the sparse penalties other than clearance, in seconds of travel for a constraint over its limit by 100 % for 1 s.
    pub motion: f64,
    /// Of clearance; the unit is [`OptimizeOptions::clearance_scale`].
    pub clearance: f64,
    /// Of the dense penalties.
    pub dense: f64,
}

/// How far a finished curve is from keeping its constraints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Violation {
    /// Largest overstepping of a speed, turn, acceleration or joint limit, relative (squared forms: of the square).
    pub motion: f64,
    /// By how much the worst contour point misses the wanted clearance, m; negative: nothing misses it.
    pub clearance: f64,
    /// The piece with the worst of both, each against its tolerance.
    pub worst_piece: usize,
}

/// Cost of one leg; owns all scratch memory.
pub struct Objective<'a, F> {
    robot: &'a RobotModel,
    field: &'a F,
    limits: Limits,
    /// +1 forwards, -1 backwards: heading is that times the direction of motion.
    direction: f64,
    minco: Minco,
    clearance: ClearancePenalty,
    energy_weights: Vec<f64>,
    time_weight: f64,
    /// Weights of the penalties; changed between passes.
    pub weights: Weights,
    dense: Option<Dense>,
    sparse: usize,
    /// Normalised times k/(sparse * dense), every `dense_step`th is a sparse one.
    table: Vec<Basis>,
    dense_step: usize,
    durations: Vec<f64>,
    by_coefficients: Vec<f64>,
    by_durations: Vec<f64>,
    by_waypoints: Vec<f64>,
    joints: Vec<f64>,
    by_joints: Vec<f64>,
    /// So much clearance missed is as bad as a limit overstepped by 100 %, m.
    clearance_unit: f64,
}

/// The switch of \[SCR\] Eq. 10.
#[derive(Debug, Clone, Copy)]
struct Dense {
    /// v_la squared, m^2/s^2.
    below: f64,
    /// eps_a, m^2/s^2.
    blend: f64,
}

impl<'a, F: DistanceField> Objective<'a, F> {
    /// For a curve that `minco` will shape; `clearance` is the scratch of the robot's contour.
    pub fn new(
        robot: &'a RobotModel,
        field: &'a F,
        minco: Minco,
        reverse: bool,
        mut clearance: ClearancePenalty,
        options: &OptimizeOptions,
    ) -> Self {
        let limits = Limits::new(robot, options.penalty_width);
        let (pieces, m) = (minco.pieces(), minco.dimensions());
        let sparse = options.samples_per_piece.max(1);
        let dense_step = if options.dense { options.dense_samples.max(1).next_multiple_of(2) } else { 1 };
        let total = sparse * dense_step;
        clearance.remember(pieces * (sparse + 1) + 1);
        let slow = options.dense_below * limits.speed;
        Self {
            robot,
            field,
            direction: if reverse { -1.0 } else { 1.0 },
            energy_weights: energy_weights(&limits, options),
            time_weight: 1.0,
            weights: options.weights(),
            dense: options.dense.then_some(Dense { below: slow * slow, blend: 0.5 * slow * slow }),
            sparse,
            table: (0..=total).map(|k| Basis::new(k as f64 / total as f64)).collect(),
            dense_step,
            durations: vec![0.0; pieces],
            by_coefficients: vec![0.0; pieces * TERMS * m],
            by_durations: vec![0.0; pieces],
            by_waypoints: vec![0.0; (pieces - 1) * m],
            joints: vec![0.0; m - 2],
            by_joints: vec![0.0; m - 2],
            clearance_unit: options.clearance_scale,
            limits,
            minco,
            clearance,
        }
    }

    /// Number of variables: waypoints `[waypoint * m + dimension]`, then one virtual time a piece.
    pub fn dimension(&self) -> usize {
        self.by_waypoints.len() + self.durations.len()
    }

    /// The curve of the last evaluation.
    pub fn curve(&self) -> &Minco {
        &self.minco
    }

    /// Aims at `by` m more clearance than before: what a pass missed, between samples or by the penalty's softness.
    pub fn tighten(&mut self, by: f64) {
        self.clearance.tighten(by);
    }

    fn shape(&mut self, x: &[f64]) {
        let (waypoints, taus) = x.split_at(self.by_waypoints.len());
        for (duration, tau) in self.durations.iter_mut().zip(taus) {
            *duration = time_map::duration(*tau).0;
        }
        self.minco.shape(waypoints, &self.durations);
    }

    /// Cost at `x`; overwrites `gradient`.
    pub fn evaluate(&mut self, x: &[f64], gradient: &mut [f64]) -> f64 {
        self.shape(x);
        self.by_coefficients.fill(0.0);
        self.by_durations.fill(self.time_weight);
        self.by_waypoints.fill(0.0);
        let mut cost = self.time_weight * self.durations.iter().sum::<f64>();
        for piece in 0..self.minco.pieces() {
            for sample in 0..=self.sparse {
                let z = self.base_at(piece, sample * self.dense_step);
                cost += self.sparse_sample(piece, sample, &z);
                if let Some(dense) = self.dense {
                    cost += self.dense_cell(piece, sample, &z, dense);
                }
            }
        }
        cost += self.minco.energy(&self.energy_weights, &mut self.by_waypoints, &mut self.by_durations);
        self.minco.pull_back(&self.by_coefficients, &mut self.by_waypoints, &mut self.by_durations);
        let (by_waypoints, by_taus) = gradient.split_at_mut(self.by_waypoints.len());
        by_waypoints.copy_from_slice(&self.by_waypoints);
        let taus = &x[self.by_waypoints.len()..];
        for ((g, by), tau) in by_taus.iter_mut().zip(&self.by_durations).zip(taus) {
            *g = by * time_map::duration(*tau).1;
        }
        cost
    }

    /// (x, y) and its first three derivatives at a table entry.
    fn base_at(&self, piece: usize, entry: usize) -> [[f64; 2]; 4] {
        let m = self.minco.dimensions();
        let c = &self.minco.coefficients()[piece * TERMS * m..(piece + 1) * TERMS * m];
        let rate = 1.0 / self.durations[piece];
        let (x, y) = (self.table[entry].orders(c, m, 0, rate), self.table[entry].orders(c, m, 1, rate));
        std::array::from_fn(|order| [x[order], y[order]])
    }

    /// Adds `factor * by` (derivatives by the orders 0 to 3 of dimension `d`, whose values are `z`) to the gradients.
    fn push(&mut self, piece: usize, entry: usize, d: usize, z: [f64; 4], by: [f64; 4], factor: f64) {
        let m = self.minco.dimensions();
        let rate = 1.0 / self.durations[piece];
        let gradient = &mut self.by_coefficients[piece * TERMS * m..(piece + 1) * TERMS * m];
        let scales = [factor, factor * rate, factor * rate * rate, factor * rate * rate * rate];
        self.table[entry].add_gradients(gradient, m, d, std::array::from_fn(|order| by[order] * scales[order]));
        self.by_durations[piece] -= factor * rate * (by[1] * z[1] + 2.0 * by[2] * z[2] + 3.0 * by[3] * z[3]);
    }

    /// All sparse penalties at sample `j` of a piece, \[SCR\] Eq. 9.
    fn sparse_sample(&mut self, piece: usize, j: usize, z: &[[f64; 2]; 4]) -> f64 {
        let entry = j * self.dense_step;
        let half = if j == 0 || j == self.sparse { 0.5 } else { 1.0 };
        let share = half / self.sparse as f64;
        let weight = share * self.durations[piece];
        let motion = base_motion(z[1], z[2], z[3]);
        let mut by = BaseMotion::default();
        let mut judge = Penalise(self.limits.width);
        let motion_cost = speed::speed_and_acceleration(&motion, &self.limits, &mut judge, &mut by)
            + speed::rims(&motion, &self.limits, &mut judge, &mut by)
            + turn::turning(&motion, &self.limits, &mut judge, &mut by);
        let joint_cost = self.sample_joints(piece, entry, weight);
        let mut by_pose = ByPose::default();
        let near = self.sample_clearance(z, &motion, &mut judge, &mut by_pose, piece * (self.sparse + 1) + j);
        let mut cost = self.weights.motion * (motion_cost + joint_cost);
        if motion_cost != 0.0 {
            let g = pull_back(&motion, &by, z[1], z[2], z[3]);
            self.push_base(piece, entry, z, [[0.0; 2], g.0, g.1, g.2], weight * self.weights.motion);
        }
        if near != 0.0 {
            cost += self.weights.clearance * near;
            let factor = weight * self.weights.clearance;
            // d(heading)/d(d1) = B d1 / v^2: the same forwards and backwards.
            let turn = by_pose.heading / (motion.v * motion.v);
            let by_d1 = [-turn * z[1][1], turn * z[1][0]];
            self.push_base(piece, entry, z, [by_pose.position, by_d1, [0.0; 2], [0.0; 2]], factor);
            for joint in 0..self.joints.len() {
                self.push(piece, entry, joint + 2, [0.0; 4], [self.by_joints[joint], 0.0, 0.0, 0.0], factor);
            }
        }
        self.by_durations[piece] += share * cost;
        weight * cost
    }

    fn push_base(&mut self, piece: usize, entry: usize, z: &[[f64; 2]; 4], by: [[f64; 2]; 4], factor: f64) {
        for d in 0..2 {
            self.push(piece, entry, d, z.map(|z| z[d]), by.map(|b| b[d]), factor);
        }
    }

    /// Joint penalties at a sample; leaves the joint values in `joints`. Returns the cost without weights.
    fn sample_joints(&mut self, piece: usize, entry: usize, weight: f64) -> f64 {
        let m = self.minco.dimensions();
        let rate = 1.0 / self.durations[piece];
        let mut sum = 0.0;
        for index in 0..self.joints.len() {
            let c = &self.minco.coefficients()[piece * TERMS * m..(piece + 1) * TERMS * m];
            let basis = &self.table[entry];
            let d = index + 2;
            let [q, d1, d2, _] = basis.orders(c, m, d, rate);
            self.joints[index] = q;
            let (cost, by) = joint::joint(q, d1, d2, &self.limits.joints[index], &mut Penalise(self.limits.width));
            if cost != 0.0 {
                sum += cost;
                let by = [by[0], by[1], by[2], 0.0];
                self.push(piece, entry, d, [q, d1, d2, 0.0], by, weight * self.weights.motion);
            }
        }
        sum
    }

    /// Clearance penalty at a sample, with `joints` set; leaves the joints' gradients in `by_joints`.
    fn sample_clearance(
        &mut self,
        z: &[[f64; 2]; 4],
        motion: &BaseMotion,
        judge: &mut impl Judge,
        by_pose: &mut ByPose,
        sample: usize,
    ) -> f64 {
        self.by_joints.fill(0.0);
        let scale = self.direction / motion.v;
        let heading = [z[1][0] * scale, z[1][1] * scale];
        let at = Placement { position: z[0], heading, joints: &self.joints };
        self.clearance.add(self.robot, self.field, at, sample, judge, by_pose, &mut self.by_joints)
    }

    /// The dense sum around sample `j`, \[SCR\] Eq. 11: least speed, turn rate, angular acceleration; and the rims.
    fn dense_cell(&mut self, piece: usize, j: usize, z: &[[f64; 2]; 4], dense: Dense) -> f64 {
        let centre = j * self.dense_step;
        let speed_square = z[1][0] * z[1][0] + z[1][1] * z[1][1];
        let (switch, slope) = smooth_switch(dense.below - speed_square, dense.blend);
        if switch == 0.0 {
            return 0.0;
        }
        let half = self.dense_step / 2;
        let (first, last) = (centre.saturating_sub(half), (centre + half).min(self.table.len() - 1));
        let mut sum = 0.0;
        for entry in first..=last {
            let end = if entry == first || entry == last { 0.5 } else { 1.0 };
            sum += end * self.dense_sample(piece, entry, end * switch);
        }
        let share = self.weights.dense / (self.sparse * self.dense_step) as f64;
        self.by_durations[piece] += switch * share * sum;
        if slope != 0.0 && sum != 0.0 {
            let factor = -2.0 * slope * sum * share * self.durations[piece];
            self.push_base(piece, centre, z, [[0.0; 2], z[1], [0.0; 2], [0.0; 2]], factor);
        }
        switch * share * sum * self.durations[piece]
    }

    fn dense_sample(&mut self, piece: usize, entry: usize, factor: f64) -> f64 {
        let z = self.base_at(piece, entry);
        let motion = base_motion(z[1], z[2], z[3]);
        let mut by = BaseMotion::default();
        let mut judge = Penalise(self.limits.width);
        let cost = speed::least_speed(&motion, &self.limits, &mut judge, &mut by)
            + speed::rims(&motion, &self.limits, &mut judge, &mut by)
            + turn::turning(&motion, &self.limits, &mut judge, &mut by);
        if cost != 0.0 {
            let g = pull_back(&motion, &by, z[1], z[2], z[3]);
            let share = self.weights.dense * self.durations[piece] / (self.sparse * self.dense_step) as f64;
            self.push_base(piece, entry, &z, [[0.0; 2], g.0, g.1, g.2], factor * share);
        }
        cost
    }

    /// Judges the curve at `x` at `per_piece` times a piece.
    pub fn violation(&mut self, x: &[f64], per_piece: usize) -> Violation {
        self.shape(x);
        let m = self.minco.dimensions();
        let (mut motion, mut near) = (Worst(0.0), Worst(f64::NEG_INFINITY));
        // One more than the samples of the cost: a place in memory for what is looked at once.
        let scratch = self.minco.pieces() * (self.sparse + 1);
        let mut ignored = BaseMotion::default();
        let (mut worst_piece, mut worst) = (0, 0.0);
        for piece in 0..self.minco.pieces() {
            let before =
                (std::mem::replace(&mut motion, Worst(0.0)), std::mem::replace(&mut near, Worst(f64::NEG_INFINITY)));
            for k in 0..=per_piece {
                let basis = Basis::new(k as f64 / per_piece as f64);
                let rate = 1.0 / self.durations[piece];
                let scales = [1.0, rate, rate * rate, rate * rate * rate];
                let c = &self.minco.coefficients()[piece * TERMS * m..(piece + 1) * TERMS * m];
                let at = |d: usize, order: usize| basis.derivative(c, m, d, order, scales[order]);
                let z: [[f64; 2]; 4] = std::array::from_fn(|order| [at(0, order), at(1, order)]);
                for (index, limits) in self.limits.joints.iter().enumerate() {
                    let q = at(index + 2, 0);
                    self.joints[index] = q;
                    joint::joint(q, at(index + 2, 1), at(index + 2, 2), limits, &mut motion);
                }
                let base = base_motion(z[1], z[2], z[3]);
                speed::speed_and_acceleration(&base, &self.limits, &mut motion, &mut ignored);
                speed::rims(&base, &self.limits, &mut motion, &mut ignored);
                turn::turning(&base, &self.limits, &mut motion, &mut ignored);
                self.clearance.forget(scratch);
                self.sample_clearance(&z, &base, &mut near, &mut ByPose::default(), scratch);
            }
            let own = motion.0.max(self.clearance.missed(near.0) / self.clearance_unit);
            if own > worst {
                (worst_piece, worst) = (piece, own);
            }
            (motion, near) = (Worst(motion.0.max(before.0.0)), Worst(near.0.max(before.1.0)));
        }
        Violation { motion: motion.0, clearance: self.clearance.missed(near.0), worst_piece }
    }
}

/// Weights of the energy, such that it matters as much as time for a motion that speeds up within its limits: the natural
/// fourth derivative of something with limits (v, a) is a^3/v^2.
fn energy_weights(limits: &Limits, options: &OptimizeOptions) -> Vec<f64> {
    let weight = |v: f64, a: f64| options.smoothness * real::powi(v * v / (a * a * a), 2);
    let mut weights = vec![weight(limits.speed, limits.acceleration); 2];
    weights.extend(limits.joints.iter().map(|j| weight(j.speed, j.acceleration)));
    weights
}

#[cfg(test)]
#[path = "objective_tests.rs"]
mod tests;
