//! Cost of a steered motion with its gradient and Gauss-Newton Hessian.
//!
//! Heading, arc length and joints are quintics in time between nodes ([`hermite`](super::hermite)). The unknowns are the nodes'
//! values, speeds and accelerations, the nodes' positions, and the logarithm of each piece's duration. A piece's position follows
//! from its node's by integration (MATH section 10); that it meets the next node is an equation (multiple shooting), kept by an
//! augmented Lagrangian. So everything couples neighbours only, and the Hessian is a band.
//!
//! All costs but time are squares: of the jerk, and of what exceeds a limit. In heading and arc length every limit of the base is
//! linear in one derivative, so the Gauss-Newton Hessian leaves out hardly anything.

use super::hermite::{Basis, DATA, ORDERS, jerk_energy};
use crate::math::banded::Banded;
use crate::optimize::penalty::Limits;
use crate::optimize::penalty::clearance::{ClearancePenalty, DistanceField, Placement};
use crate::robot::RobotModel;

/// Weights of the cost; time counts 1 a second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Weights {
    /// Of the squared jerk, relative to [`Scales`]; s per second of jerk as large as its scale.
    pub smoothness: f64,
    /// Of a limit overstepped by 100 % for 1 s.
    pub motion: f64,
    /// Of one contour point that misses the clearance by `clearance_unit` for 1 s.
    pub clearance: f64,
    /// m.
    pub clearance_unit: f64,
}

/// Where each unknown lives in a node's block: `dimension * 3 + order`, then x, y, then the logarithm of the duration of the
/// piece that begins there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Layout {
    /// Heading, arc length, joints.
    pub dimensions: usize,
    /// At least 1.
    pub pieces: usize,
}

impl Layout {
    /// Unknowns of a node.
    pub fn block(self) -> usize {
        ORDERS * self.dimensions + 3
    }

    /// Unknowns in all.
    pub fn size(self) -> usize {
        (self.pieces + 1) * self.block()
    }

    /// Index of a node's value or derivative.
    pub fn state(self, node: usize, dimension: usize, order: usize) -> usize {
        node * self.block() + ORDERS * dimension + order
    }

    /// Index of a node's x; y follows.
    pub fn position(self, node: usize) -> usize {
        node * self.block() + ORDERS * self.dimensions
    }

    /// Index of the logarithm of a piece's duration.
    pub fn duration(self, piece: usize) -> usize {
        piece * self.block() + ORDERS * self.dimensions + 2
    }

    /// A piece's data in unit time, for its duration.
    pub fn data(self, piece: usize, dimension: usize, x: &[f64], time: f64) -> [f64; DATA] {
        let mut data = [0.0; DATA];
        for side in 0..2 {
            let at = self.state(piece + side, dimension, 0);
            data[3 * side] = x[at];
            data[3 * side + 1] = x[at + 1] * time;
            data[3 * side + 2] = x[at + 2] * time * time;
        }
        data
    }
}

const HEADING: usize = 0;
const ARC: usize = 1;

/// Samples of a piece with what they need.
struct Sample {
    basis: Basis,
    /// Of the piece's duration.
    share: f64,
}

/// Gradient and Hessian of one piece in its own coordinates: six data in unit time a dimension, logarithm of the duration, both
/// ends' positions.
struct Local {
    size: usize,
    gradient: Vec<f64>,
    /// Lower triangle, row by row.
    hessian: Vec<f64>,
    /// What the gaps add to the Hessian's diagonal.
    stiff: Vec<f64>,
}

/// How stiffly a step of the model closes the gaps: all but exactly, s/m^2.
pub(super) const STIFFNESS: f64 = 1e6;

/// The problem; owns all scratch memory.
pub(super) struct Problem<'a, F> {
    robot: &'a RobotModel,
    field: &'a F,
    limits: Limits,
    rim_jerk: f64,
    joint_jerks: Vec<f64>,
    clearance: ClearancePenalty,
    pub layout: Layout,
    /// +1 or -1 a piece: which way its base drives.
    directions: Vec<f64>,
    fixed: Vec<bool>,
    pub weights: Weights,
    /// What a jerk of each dimension is measured in.
    jerk_scales: Vec<f64>,
    energy: [[f64; DATA]; DATA],
    samples: Vec<Sample>,
    /// Multipliers of the gaps, one pair a piece.
    pub multipliers: Vec<[f64; 2]>,
    gaps: Vec<[f64; 2]>,
    local: Local,
    data: Vec<[f64; DATA]>,
    joints: Vec<f64>,
    /// Clearance terms of a sample: gradient and lower triangle by x, y, heading, joints, logarithm of the duration.
    near: Vec<f64>,
    near_hessian: Vec<f64>,
    jacobian: Vec<f64>,
    product: Vec<f64>,
}

/// What an evaluation fills.
pub(super) struct Derivatives {
    pub gradient: Vec<f64>,
    pub hessian: Banded,
    /// What the gaps add to the Hessian's diagonal.
    pub stiff: Vec<f64>,
    /// Gaps between pieces, m.
    pub gaps: Vec<[f64; 2]>,
}

impl Derivatives {
    pub fn new(layout: Layout) -> Self {
        let width = 2 * layout.block() - 2;
        Self {
            gradient: vec![0.0; layout.size()],
            hessian: Banded::new(layout.size(), width),
            stiff: vec![0.0; layout.size()],
            gaps: vec![[0.0; 2]; layout.pieces],
        }
    }
}

/// Shortest piece, s.
const SHORTEST: f64 = 0.04;

impl<'a, F: DistanceField> Problem<'a, F> {
    pub fn new(
        robot: &'a RobotModel,
        field: &'a F,
        mut clearance: ClearancePenalty,
        directions: Vec<f64>,
        fixed: Vec<bool>,
        samples_per_piece: usize,
        weights: Weights,
    ) -> Self {
        let limits = Limits::new(robot, 1.0);
        let joints = robot.joints.len();
        let layout = Layout { dimensions: 2 + joints, pieces: directions.len() };
        let count = samples_per_piece.max(2);
        clearance.remember(layout.pieces * (count + 1));
        let samples = (0..=count)
            .map(|j| Sample {
                basis: Basis::new(j as f64 / count as f64),
                share: if j == 0 || j == count { 0.5 } else { 1.0 } / count as f64,
            })
            .collect();
        let size = DATA * layout.dimensions + 5;
        let rim_jerk = robot.wheel.planning()[2];
        let joint_jerks: Vec<f64> = robot.joints.iter().map(|j| j.limits.planning()[2]).collect();
        let mut jerk_scales = vec![rim_jerk / limits.half_track, rim_jerk];
        jerk_scales.extend(&joint_jerks);
        Self {
            robot,
            field,
            rim_jerk,
            joint_jerks,
            limits,
            clearance,
            layout,
            multipliers: vec![[0.0; 2]; directions.len()],
            gaps: vec![[0.0; 2]; directions.len()],
            directions,
            fixed,
            weights,
            jerk_scales,
            energy: jerk_energy(),
            samples,
            local: Local { size, gradient: vec![0.0; size], hessian: vec![0.0; size * size], stiff: vec![0.0; size] },
            data: vec![[0.0; DATA]; layout.dimensions],
            joints: vec![0.0; joints],
            near: vec![0.0; joints + 4],
            near_hessian: vec![0.0; (joints + 4) * (joints + 4)],
            jacobian: vec![0.0; (joints + 4) * size],
            product: vec![0.0; size],
        }
    }

    /// Inverse squares of what is a natural step of each unknown.
    pub fn natural(&self) -> Vec<f64> {
        let (layout, limits) = (self.layout, &self.limits);
        let mut natural = vec![0.0; layout.size()];
        let turn = limits.turn_rate(0.0).min(limits.angular_speed);
        for node in 0..=layout.pieces {
            for dimension in 0..layout.dimensions {
                let steps = match dimension {
                    HEADING => [0.5, turn, limits.angular_acceleration],
                    ARC => [0.5, limits.speed, limits.acceleration],
                    j => [0.5 * limits.joints[j - 2].speed, limits.joints[j - 2].speed, limits.joints[j - 2].acceleration],
                };
                for (order, step) in steps.into_iter().enumerate() {
                    natural[layout.state(node, dimension, order)] = 1.0 / (step * step);
                }
            }
            let at = layout.position(node);
            natural[at] = 4.0;
            natural[at + 1] = 4.0;
            natural[at + 2] = 4.0;
        }
        natural
    }

    /// [`Self::evaluate`] with other multipliers.
    pub fn evaluate_with(&mut self, x: &[f64], out: &mut Derivatives, multipliers: &[[f64; 2]]) -> f64 {
        let own = std::mem::replace(&mut self.multipliers, multipliers.to_vec());
        let cost = self.evaluate(x, out);
        self.multipliers = own;
        cost
    }

    /// What `step` does to the gaps, to first order.
    pub fn linear_gaps(&mut self, x: &[f64], step: &[f64]) -> Vec<[f64; 2]> {
        let layout = self.layout;
        (0..layout.pieces)
            .map(|piece| {
                let jacobians = self.gap_jacobians(piece, x);
                let time = x[layout.duration(piece)].exp();
                let stretch = step[layout.duration(piece)];
                std::array::from_fn(|axis| {
                    let at = layout.position(piece) + axis;
                    let mut change = step[at] - step[at + layout.block()];
                    for dimension in 0..2 {
                        for datum in 0..DATA {
                            let index = layout.state(piece + datum / 3, dimension, datum % 3);
                            let power = [1.0, time, time * time][datum % 3];
                            let moved = power * (step[index] + (datum % 3) as f64 * x[index] * stretch);
                            change += jacobians[axis][DATA * dimension + datum] * moved;
                        }
                    }
                    change
                })
            })
            .collect()
    }

    fn gap_jacobians(&mut self, piece: usize, x: &[f64]) -> [[f64; 2 * DATA]; 2] {
        self.load(piece, x);
        let mut path = Integral::new(1.0 / (self.samples.len() - 1) as f64);
        for sample in &self.samples {
            path.advance(&sample.basis, &sample.basis.at(&self.data[HEADING]), &sample.basis.at(&self.data[ARC]));
        }
        [path.jacobian(0), path.jacobian(1)]
    }

    /// Gradient of half the stiff square of the gaps.
    pub fn gap_gradient(&mut self, x: &[f64], gaps: &[[f64; 2]], out: &mut [f64]) {
        let layout = self.layout;
        out.fill(0.0);
        for (piece, gap) in gaps.iter().enumerate() {
            let jacobians = self.gap_jacobians(piece, x);
            let time = x[layout.duration(piece)].exp();
            for axis in 0..2 {
                let force = STIFFNESS * gap[axis];
                let at = layout.position(piece) + axis;
                out[at] += force;
                out[at + layout.block()] -= force;
                for dimension in 0..2 {
                    for datum in 0..DATA {
                        let index = layout.state(piece + datum / 3, dimension, datum % 3);
                        let by = jacobians[axis][DATA * dimension + datum] * [1.0, time, time * time][datum % 3];
                        out[index] += force * by;
                        out[layout.duration(piece)] += force * by * (datum % 3) as f64 * x[index];
                    }
                }
            }
        }
        for (value, fixed) in out.iter_mut().zip(&self.fixed) {
            if *fixed {
                *value = 0.0;
            }
        }
    }

    /// Cost at `x` without the gaps; fills `out` with them.
    pub fn evaluate(&mut self, x: &[f64], out: &mut Derivatives) -> f64 {
        out.gradient.fill(0.0);
        out.stiff.fill(0.0);
        out.hessian.clear();
        let mut cost = 0.0;
        for piece in 0..self.layout.pieces {
            cost += self.piece(piece, x);
            self.scatter(piece, x, out);
        }
        for (index, fixed) in self.fixed.iter().enumerate() {
            if *fixed {
                out.gradient[index] = 0.0;
                *out.hessian.entry(index, index) = 1.0;
            }
        }
        out.gaps.copy_from_slice(&self.gaps);
        cost
    }

    /// Data of a piece in unit time.
    fn load(&mut self, piece: usize, x: &[f64]) -> f64 {
        let layout = self.layout;
        let time = x[layout.duration(piece)].exp();
        for (dimension, data) in self.data.iter_mut().enumerate() {
            *data = layout.data(piece, dimension, x, time);
        }
        time
    }

    /// Cost of a piece; its derivatives are in `local`.
    fn piece(&mut self, piece: usize, x: &[f64]) -> f64 {
        let time = self.load(piece, x);
        let layout = self.layout;
        let at = layout.position(piece);
        let start = [x[at], x[at + 1]];
        self.local.gradient.fill(0.0);
        self.local.hessian.fill(0.0);
        self.local.stiff.fill(0.0);
        let by_time = DATA * layout.dimensions;
        let mut cost = time + self.jerks(time);
        self.local.gradient[by_time] += time;
        self.local.hessian[by_time * self.local.size + by_time] += time;
        let short = SHORTEST.ln() - x[layout.duration(piece)];
        if short > 0.0 {
            cost += 0.5 * self.weights.motion * short * short;
            self.local.gradient[by_time] -= self.weights.motion * short;
            self.local.hessian[by_time * self.local.size + by_time] += self.weights.motion;
        }
        let rates = [1.0, 1.0 / time, 1.0 / (time * time), 1.0 / (time * time * time)];
        let step = 1.0 / (self.samples.len() - 1) as f64;
        let mut path = Integral::new(step);
        for j in 0..self.samples.len() {
            let basis = self.samples[j].basis;
            let heading = basis.at(&self.data[HEADING]);
            let arc = basis.at(&self.data[ARC]);
            let weight = self.samples[j].share * time;
            path.advance(&basis, &heading, &arc);
            cost += self.base_limits(piece, &basis, &heading, &arc, &rates, weight * self.weights.motion);
            cost += self.joint_limits(&basis, &rates, weight * self.weights.motion);
            cost += self.near(piece, j, &path, start, weight * self.weights.clearance);
        }
        let end = layout.position(piece + 1);
        let reached = path.position();
        let gap = [start[0] + reached[0] - x[end], start[1] + reached[1] - x[end + 1]];
        self.gaps[piece] = gap;
        let multiplier = self.multipliers[piece];
        for axis in 0..2 {
            let jacobian = &mut self.jacobian[..self.local.size];
            jacobian.fill(0.0);
            jacobian[..2 * DATA].copy_from_slice(&path.jacobian(axis));
            jacobian[by_time + 1 + axis] = 1.0;
            jacobian[by_time + 3 + axis] = -1.0;
            self.local.add(jacobian, multiplier[axis] + STIFFNESS * gap[axis], STIFFNESS);
            self.local.stiff.iter_mut().zip(jacobian).for_each(|(d, j)| *d += STIFFNESS * *j * *j);
        }
        cost
    }

    /// Squared jerk of every dimension.
    fn jerks(&mut self, time: f64) -> f64 {
        let by_time = DATA * self.layout.dimensions;
        let local = &mut self.local;
        let mut cost = 0.0;
        for (dimension, data) in self.data.iter().enumerate() {
            let scale = self.jerk_scales[dimension];
            let weight = self.weights.smoothness / (scale * scale * time.powi(5));
            let first = DATA * dimension;
            let mut form = 0.0;
            for (i, energy) in self.energy.iter().enumerate() {
                let force: f64 = energy.iter().zip(data).map(|(e, d)| e * d).sum();
                form += data[i] * force;
                local.gradient[first + i] += 2.0 * weight * force;
                local.hessian[by_time * local.size + first + i] -= 5.0 * weight * force;
                for (j, e) in energy[..=i].iter().enumerate() {
                    local.hessian[(first + i) * local.size + first + j] += 2.0 * weight * e;
                }
            }
            cost += weight * form;
            local.gradient[by_time] -= 5.0 * weight * form;
            local.hessian[by_time * local.size + by_time] += 12.5 * weight * form;
        }
        cost
    }

    /// Limits of base and wheels: each is linear in one derivative of heading and arc length.
    fn base_limits(
        &mut self,
        piece: usize,
        basis: &Basis,
        heading: &[f64; 4],
        arc: &[f64; 4],
        rates: &[f64; 4],
        weight: f64,
    ) -> f64 {
        let limits = &self.limits;
        let direction = self.directions[piece];
        let arm = limits.half_track;
        let mut rows = Rows { cost: 0.0, weight, local: &mut self.local, by_time: DATA * self.layout.dimensions };
        let at = |order: usize| [heading[order] * rates[order], arc[order] * rates[order]];
        {
            let z = at(1);
            let (turn, along) = (z[0], direction * z[1]);
            let mut row = |by: [f64; 2], bound: f64| rows.add(&basis.rows[1], rates[1], 1, by, z, bound);
            if along > limits.speed {
                row([0.0, direction / limits.speed], 1.0);
            }
            if along < 0.0 {
                row([0.0, -direction / limits.speed], 0.0);
            }
            let side = turn.signum();
            let at_rest = limits.turn_slope * limits.speed;
            if side * turn > limits.turn_slope * (limits.speed - along) {
                row([side / at_rest, direction * limits.turn_slope / at_rest], 1.0);
            }
            if side * turn > limits.angular_speed {
                row([side / limits.angular_speed, 0.0], 1.0);
            }
            if along + arm * side * turn > limits.rim_speed {
                row([side * arm / limits.rim_speed, direction / limits.rim_speed], 1.0);
            }
        }
        for (order, base, turning, rim) in [
            (2, limits.acceleration, limits.angular_acceleration, limits.rim_acceleration),
            (3, f64::INFINITY, f64::INFINITY, self.rim_jerk),
        ] {
            let z = at(order);
            let mut row = |by: [f64; 2]| rows.add(&basis.rows[order], rates[order], order as f64, by, z, 1.0);
            if z[1].abs() > base {
                row([0.0, z[1].signum() / base]);
            }
            if z[0].abs() > turning {
                row([z[0].signum() / turning, 0.0]);
            }
            for arm in [arm, -arm] {
                let wheel = z[1] + arm * z[0];
                if wheel.abs() > rim {
                    row([wheel.signum() * arm / rim, wheel.signum() / rim]);
                }
            }
        }
        rows.cost
    }

    /// Limits of the joints: speed, acceleration, jerk, position. Leaves the joints' values in `joints`.
    fn joint_limits(&mut self, basis: &Basis, rates: &[f64; 4], weight: f64) -> f64 {
        let by_time = DATA * self.layout.dimensions;
        let mut cost = 0.0;
        for (index, limits) in self.limits.joints.iter().enumerate() {
            let first = DATA * (2 + index);
            let unit = basis.at(&self.data[2 + index]);
            self.joints[index] = unit[0];
            let local = &mut self.local;
            let bounds = [limits.speed, limits.acceleration, self.joint_jerks[index]];
            for (order, bound) in bounds.into_iter().enumerate().map(|(k, bound)| (k + 1, bound)) {
                let value = unit[order] * rates[order];
                if value.abs() > bound {
                    let factor = value.signum() / bound;
                    cost += local.add_row(&basis.rows[order], first, by_time, [factor * rates[order], order as f64], value.abs() / bound, 1.0, weight);
                }
            }
            let half_range = 0.5 * (limits.upper - limits.lower);
            let size = if half_range.is_finite() && half_range > 1e-6 { half_range } else { 1.0 };
            if unit[0] > limits.upper {
                cost += local.add_row(&basis.rows[0], first, by_time, [1.0 / size, 0.0], unit[0] / size, limits.upper / size, weight);
            } else if unit[0] < limits.lower {
                cost += local.add_row(&basis.rows[0], first, by_time, [-1.0 / size, 0.0], -unit[0] / size, -limits.lower / size, weight);
            }
        }
        cost
    }

    /// What the contour misses of the clearance at a sample; joints are set.
    fn near(&mut self, piece: usize, sample: usize, path: &Integral, start: [f64; 2], weight: f64) -> f64 {
        let n = self.joints.len() + 4;
        let by_time = n - 1;
        let (sin, cos) = path.direction;
        let moved = path.position();
        let position = [start[0] + moved[0], start[1] + moved[1]];
        let at = Placement { position, heading: [cos, sin], joints: &self.joints };
        let unit = self.weights.clearance_unit;
        let (near, hessian) = (&mut self.near, &mut self.near_hessian);
        let mut sum = 0.0;
        let index = piece * self.samples.len() + sample;
        self.clearance.visit(self.robot, self.field, at, index, |short, by_pose, by_joints| {
            if sum == 0.0 {
                near.fill(0.0);
                hessian.fill(0.0);
            }
            let value = short / unit;
            sum += value * value;
            let mut by = |k: usize| match k {
                0 | 1 => by_pose.position[k] / unit,
                2 => by_pose.heading / unit,
                // The weight grows with the duration: half of it in the root.
                k if k == by_time => 0.5 * value,
                k => by_joints[k - 3] / unit,
            };
            for i in 0..n {
                let own = by(i);
                near[i] += value * own;
                for j in 0..=i {
                    hessian[i * n + j] += own * by(j);
                }
            }
        });
        if sum == 0.0 {
            return 0.0;
        }
        let size = self.local.size;
        let basis = &self.samples[sample].basis;
        let jacobian = &mut self.jacobian[..n * size];
        jacobian.fill(0.0);
        for axis in 0..2 {
            let row = &mut jacobian[axis * size..(axis + 1) * size];
            row[..2 * DATA].copy_from_slice(&path.jacobian(axis));
            row[DATA * self.layout.dimensions + 1 + axis] = 1.0;
        }
        jacobian[2 * size..2 * size + DATA].copy_from_slice(&basis.rows[0]);
        for joint in 0..self.joints.len() {
            let first = (3 + joint) * size + DATA * (2 + joint);
            jacobian[first..first + DATA].copy_from_slice(&basis.rows[0]);
        }
        jacobian[by_time * size + DATA * self.layout.dimensions] = 1.0;
        // J^T K J row by row of K's lower triangle made whole.
        for i in 0..n {
            self.product.fill(0.0);
            for j in 0..n {
                let k = if j <= i { hessian[i * n + j] } else { hessian[j * n + i] };
                let row = &jacobian[j * size..(j + 1) * size];
                for (value, entry) in self.product.iter_mut().zip(row) {
                    *value += k * entry;
                }
            }
            let row = &jacobian[i * size..(i + 1) * size];
            for (a, entry) in row.iter().enumerate() {
                if *entry == 0.0 {
                    continue;
                }
                let scaled = weight * entry;
                self.local.gradient[a] += scaled * near[i];
                let target = &mut self.local.hessian[a * size..a * size + a + 1];
                for (value, product) in target.iter_mut().zip(&self.product) {
                    *value += scaled * product;
                }
            }
        }
        0.5 * weight * sum
    }

    /// Adds the piece's derivatives to the whole: from unit time to seconds, and what the duration does to the data.
    fn scatter(&mut self, piece: usize, x: &[f64], out: &mut Derivatives) {
        let layout = self.layout;
        let time = x[layout.duration(piece)].exp();
        let size = self.local.size;
        let by_time = DATA * layout.dimensions;
        // d(data)/d(log T): the order times the datum.
        let stretch = |i: usize| (i % 3) as f64 * self.data[i / DATA][i % DATA];
        let (gradient, hessian) = (&mut self.local.gradient, &mut self.local.hessian);
        self.product.fill(0.0);
        for i in 0..by_time {
            for j in 0..=i {
                let entry = hessian[i * size + j];
                self.product[i] += entry * stretch(j);
                if i != j {
                    self.product[j] += entry * stretch(i);
                }
            }
        }
        let mut own = hessian[by_time * size + by_time];
        for i in 0..by_time {
            own += stretch(i) * (2.0 * hessian[by_time * size + i] + self.product[i]);
            gradient[by_time] += stretch(i) * gradient[i];
        }
        hessian[by_time * size + by_time] = own;
        for i in 0..by_time {
            hessian[by_time * size + i] += self.product[i];
        }
        for row in by_time + 1..size {
            let extra: f64 = (0..by_time).map(|i| stretch(i) * hessian[row * size + i]).sum();
            hessian[row * size + by_time] += extra;
        }
        let powers = [1.0, time, time * time];
        let place = |i: usize| -> (usize, f64) {
            if i < by_time {
                let (dimension, datum) = (i / DATA, i % DATA);
                (layout.state(piece + datum / 3, dimension, datum % 3), powers[datum % 3])
            } else if i == by_time {
                (layout.duration(piece), 1.0)
            } else {
                let k = i - by_time - 1;
                (layout.position(piece + k / 2) + k % 2, 1.0)
            }
        };
        for i in 0..size {
            let (row, scale) = place(i);
            if self.fixed[row] {
                continue;
            }
            out.gradient[row] += scale * gradient[i];
            out.stiff[row] += scale * scale * self.local.stiff[i];
            for j in 0..=i {
                let entry = hessian[i * size + j];
                if entry == 0.0 {
                    continue;
                }
                let (column, other) = place(j);
                if !self.fixed[column] {
                    *out.hessian.entry(row.max(column), row.min(column)) += scale * other * entry;
                }
            }
        }
    }
}

impl Local {
    /// Adds a square with this Jacobian: `slope` times it to the gradient, `curvature` times its outer product to the Hessian.
    fn add(&mut self, jacobian: &[f64], slope: f64, curvature: f64) {
        for (i, own) in jacobian.iter().enumerate() {
            if *own == 0.0 {
                continue;
            }
            self.gradient[i] += slope * own;
            let scaled = curvature * own;
            let row = &mut self.hessian[i * self.size..i * self.size + i + 1];
            for (value, other) in row.iter_mut().zip(jacobian) {
                *value += scaled * other;
            }
        }
    }

    /// A limit on one dimension: `linear - bound > 0`, whose linear part is `factor[0]` times a row of the basis and falls with
    /// the duration to the power `factor[1]`. Returns its cost.
    #[allow(clippy::too_many_arguments)]
    fn add_row(
        &mut self,
        basis: &[f64; DATA],
        first: usize,
        by_time: usize,
        [factor, order]: [f64; 2],
        linear: f64,
        bound: f64,
        weight: f64,
    ) -> f64 {
        let value = linear - bound;
        let time = 0.5 * value - order * linear;
        let row = by_time * self.size;
        for (i, a) in basis.iter().enumerate() {
            let own = factor * a;
            self.gradient[first + i] += weight * value * own;
            self.hessian[row + first + i] += weight * time * own;
            for (j, b) in basis[..=i].iter().enumerate() {
                self.hessian[(first + i) * self.size + first + j] += weight * own * factor * b;
            }
        }
        self.gradient[by_time] += weight * value * time;
        self.hessian[row + by_time] += weight * time * time;
        0.5 * weight * value * value
    }
}

/// Limits of the base at a sample.
struct Rows<'a> {
    cost: f64,
    weight: f64,
    local: &'a mut Local,
    by_time: usize,
}

impl Rows<'_> {
    /// A limit `by . z - bound > 0`, where z is a derivative of heading and arc length.
    fn add(&mut self, basis: &[f64; DATA], rate: f64, order: impl Into<f64>, by: [f64; 2], z: [f64; 2], bound: f64) {
        let linear = by[0] * z[0] + by[1] * z[1];
        let value = linear - bound;
        if value <= 0.0 {
            return;
        }
        let mut jacobian = [0.0; 2 * DATA];
        for (i, a) in basis.iter().enumerate() {
            jacobian[i] = by[0] * rate * a;
            jacobian[DATA + i] = by[1] * rate * a;
        }
        let time = 0.5 * value - order.into() * linear;
        let size = self.local.size;
        let row = self.by_time * size;
        for (i, own) in jacobian.iter().enumerate() {
            self.local.gradient[i] += self.weight * value * own;
            self.local.hessian[row + i] += self.weight * time * own;
            let scaled = self.weight * own;
            let target = &mut self.local.hessian[i * size..i * size + i + 1];
            for (entry, other) in target.iter_mut().zip(&jacobian) {
                *entry += scaled * other;
            }
        }
        self.local.gradient[self.by_time] += self.weight * value * time;
        self.local.hessian[row + self.by_time] += self.weight * time * time;
        self.cost += 0.5 * self.weight * value * value;
    }
}

/// Position along a piece: corrected trapezoids of the unit-time integral of ds (cos, sin), and its derivatives by the data of
/// heading and arc length.
struct Integral {
    step: f64,
    /// Half the first integrand and all before the last one.
    sum: [f64; 2],
    sum_jacobian: [[f64; 2 * DATA]; 2],
    first: Integrand,
    last: Integrand,
    /// Sine and cosine of the heading at the last sample.
    direction: (f64, f64),
    count: usize,
}

/// The integrand and its slope, with their derivatives.
#[derive(Clone, Copy)]
struct Integrand {
    value: [f64; 2],
    slope: [f64; 2],
    by: [[f64; 2 * DATA]; 2],
    slope_by: [[f64; 2 * DATA]; 2],
}

impl Integrand {
    const ZERO: Self =
        Self { value: [0.0; 2], slope: [0.0; 2], by: [[0.0; 2 * DATA]; 2], slope_by: [[0.0; 2 * DATA]; 2] };

    fn new(basis: &Basis, heading: &[f64; 4], arc: &[f64; 4], (sin, cos): (f64, f64)) -> Self {
        let [_, turn, ..] = *heading;
        let [_, speed, acceleration, _] = *arc;
        let mut out = Self::ZERO;
        let along = [cos, sin];
        let across = [-sin, cos];
        for axis in 0..2 {
            let (u, n) = (along[axis], across[axis]);
            out.value[axis] = speed * u;
            out.slope[axis] = acceleration * u + speed * turn * n;
            for k in 0..DATA {
                let [h0, h1, h2] = [basis.rows[0][k], basis.rows[1][k], basis.rows[2][k]];
                out.by[axis][k] = speed * n * h0;
                out.by[axis][DATA + k] = u * h1;
                out.slope_by[axis][k] = (acceleration * n - speed * turn * u) * h0 + speed * n * h1;
                out.slope_by[axis][DATA + k] = u * h2 + turn * n * h1;
            }
        }
        out
    }
}

impl Integral {
    fn new(step: f64) -> Self {
        Self {
            step,
            sum: [0.0; 2],
            sum_jacobian: [[0.0; 2 * DATA]; 2],
            first: Integrand::ZERO,
            last: Integrand::ZERO,
            direction: (0.0, 1.0),
            count: 0,
        }
    }

    /// Goes on to the next sample.
    fn advance(&mut self, basis: &Basis, heading: &[f64; 4], arc: &[f64; 4]) {
        let share = match self.count {
            0 => 0.0,
            1 => 0.5,
            _ => 1.0,
        };
        for axis in 0..2 {
            self.sum[axis] += share * self.last.value[axis];
            for (sum, by) in self.sum_jacobian[axis].iter_mut().zip(&self.last.by[axis]) {
                *sum += share * by;
            }
        }
        self.direction = heading[0].sin_cos();
        self.last = Integrand::new(basis, heading, arc, self.direction);
        if self.count == 0 {
            self.first = self.last;
        }
        self.count += 1;
    }

    /// From the piece's start to the last sample, m.
    fn position(&self) -> [f64; 2] {
        if self.count < 2 {
            return [0.0; 2];
        }
        std::array::from_fn(|axis| {
            self.step * (self.sum[axis] + 0.5 * self.last.value[axis])
                + self.step * self.step / 12.0 * (self.first.slope[axis] - self.last.slope[axis])
        })
    }

    /// Derivatives of [`Self::position`] by the data of heading and arc length.
    fn jacobian(&self, axis: usize) -> [f64; 2 * DATA] {
        if self.count < 2 {
            return [0.0; 2 * DATA];
        }
        let correction = self.step * self.step / 12.0;
        std::array::from_fn(|k| {
            self.step * (self.sum_jacobian[axis][k] + 0.5 * self.last.by[axis][k])
                + correction * (self.first.slope_by[axis][k] - self.last.slope_by[axis][k])
        })
    }
}
