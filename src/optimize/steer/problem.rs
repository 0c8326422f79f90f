//! Cost of a steered motion with its gradient and Gauss-Newton Hessian.
//!
//! Heading, arc length and joints are quintics in time between nodes ([`hermite`](super::hermite)). The unknowns are the nodes'
//! values, speeds and accelerations, the nodes' positions, and the logarithm of each piece's duration. A piece's position follows
//! from its node's by integration (MATH section 10); that it meets the next node is an equation (multiple shooting). So everything
//! couples neighbours only, and the Hessian is a band.
//!
//! All costs but time are squares: of the jerk, and of what exceeds a limit. In heading and arc length every limit of the base is
//! linear in one derivative, so the Gauss-Newton Hessian leaves out hardly anything.

use std::rc::Rc;

use super::hermite::{Basis, DATA, jerk_energy};
use super::integral::{ByData, Integral};
use super::layout::{ARC, HEADING, Layout};
use super::local::Local;
use crate::math::banded::Banded;
use crate::optimize::penalty::Limits;
use crate::optimize::penalty::clearance::{ClearancePenalty, DistanceField, Placement, PointOf, Touch};
use crate::robot::RobotModel;

/// Weights of the cost; time counts 1 a second.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Weights {
    /// Of the squared jerk, relative to the jerk limit.
    pub smoothness: f64,
    /// Of a limit overstepped by 100 % for 1 s.
    pub motion: f64,
    /// Of one contour point that misses the clearance by `clearance_unit` for 1 s.
    pub clearance: f64,
    /// m.
    pub clearance_unit: f64,
}

/// How stiffly a step of the model closes the gaps: all but exactly, s/m^2.
pub(super) const STIFFNESS: f64 = 1e6;
/// Backing up weighs as much as exceeding the speed limit by so many times as much.
const BACKWARDS: f64 = 10.0;
/// Shortest piece, s.
const SHORTEST: f64 = 0.04;

/// How often a finished piece is looked at.
const LOOKS: usize = 64;

/// Samples of a piece.
struct Table {
    bases: Vec<Basis>,
}

impl Table {
    fn new(count: usize) -> Self {
        Self { bases: (0..=count).map(|j| Basis::new(j as f64 / count as f64)).collect() }
    }

    fn count(&self) -> usize {
        self.bases.len() - 1
    }

    /// Share of the duration that a sample stands for.
    fn share(&self, sample: usize) -> f64 {
        if sample == 0 || sample == self.count() { 0.5 / self.count() as f64 } else { 1.0 / self.count() as f64 }
    }
}

/// A contour point that misses the clearance at a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Contact {
    pub piece: usize,
    pub sample: usize,
    pub of: PointOf,
    pub short: f64,
}

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
    pub fixed: Vec<bool>,
    /// Least speed along its direction that is asked of each piece, m/s.
    pub floors: Vec<f64>,
    pub weights: Weights,
    /// What a jerk of each dimension is measured in.
    jerk_scales: Vec<f64>,
    energy: [[f64; DATA]; DATA],
    tables: Vec<Rc<Table>>,
    /// Of each piece, its table and the number of its first sample.
    samples: Vec<(usize, usize)>,
    local: Local,
    offsets: Vec<usize>,
    data: Vec<[f64; DATA]>,
    joints: Vec<f64>,
    /// Clearance terms of a sample: gradient and lower triangle by x, y, heading, joints, logarithm of the duration.
    near: Vec<f64>,
    near_hessian: Vec<f64>,
    jacobian: Vec<f64>,
    product: Vec<f64>,
    stretch: Vec<f64>,
    /// Of the last evaluation.
    pub contacts: Vec<Contact>,
}

/// What an evaluation fills.
#[derive(Clone)]
pub(super) struct Derivatives {
    pub gradient: Vec<f64>,
    pub hessian: Banded,
    /// What the gaps add to the Hessian's diagonal.
    pub stiff: Vec<f64>,
    /// Gaps between pieces, m.
    pub gaps: Vec<[f64; 2]>,
    /// Their derivatives by the unknowns of their pieces, `[(piece * 2 + axis) * local size + local]`.
    by_gaps: Vec<f64>,
}

impl Derivatives {
    pub fn new(layout: Layout) -> Self {
        Self {
            gradient: vec![0.0; layout.size()],
            hessian: Banded::new(layout.size(), layout.width()),
            stiff: vec![0.0; layout.size()],
            gaps: vec![[0.0; 2]; layout.pieces],
            by_gaps: vec![0.0; layout.pieces * 2 * layout.local_size()],
        }
    }

    /// Derivatives of a piece's gap by its unknowns.
    pub fn by_gap(&self, piece: usize, axis: usize) -> &[f64] {
        let size = self.by_gaps.len() / (2 * self.gaps.len());
        &self.by_gaps[(piece * 2 + axis) * size..(piece * 2 + axis + 1) * size]
    }
}

impl<'a, F: DistanceField> Problem<'a, F> {
    /// `counts`: samples of each piece.
    pub fn new(
        robot: &'a RobotModel,
        field: &'a F,
        mut clearance: ClearancePenalty,
        directions: Vec<f64>,
        fixed: Vec<bool>,
        counts: &[usize],
        weights: Weights,
    ) -> Self {
        let limits = Limits::new(robot, 1.0);
        let joints = robot.joints.len();
        let layout = Layout { dimensions: 2 + joints, pieces: directions.len() };
        let mut sizes: Vec<usize> = counts.to_vec();
        sizes.sort_unstable();
        sizes.dedup();
        let mut first = 0;
        let samples = counts
            .iter()
            .map(|count| {
                let table = sizes.binary_search(count).unwrap_or_default();
                first += count + 1;
                (table, first - count - 1)
            })
            .collect();
        clearance.remember(first);
        let size = layout.local_size();
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
            floors: vec![0.0; directions.len()],
            directions,
            fixed,
            weights,
            jerk_scales,
            energy: jerk_energy(),
            tables: sizes.into_iter().map(|count| Rc::new(Table::new(count))).collect(),
            samples,
            local: Local::new(layout),
            offsets: layout.offsets(),
            data: vec![[0.0; DATA]; layout.dimensions],
            joints: vec![0.0; joints],
            near: vec![0.0; joints + 4],
            near_hessian: vec![0.0; (joints + 4) * (joints + 4)],
            jacobian: vec![0.0; (joints + 4) * size],
            product: vec![0.0; size],
            stretch: vec![0.0; layout.local_time()],
            contacts: Vec::new(),
        }
    }

    /// Inverse squares of what is a natural step of each unknown.
    pub fn natural(&self) -> Vec<f64> {
        let (layout, limits) = (self.layout, &self.limits);
        let mut natural = vec![4.0; layout.size()];
        let turn = limits.turn_rate(0.0).min(limits.angular_speed);
        for node in 0..=layout.pieces {
            for dimension in 0..layout.dimensions {
                let steps = match dimension {
                    HEADING => [0.5, turn, limits.angular_acceleration],
                    ARC => [0.5, limits.speed, limits.acceleration],
                    j => {
                        let joint = &limits.joints[j - 2];
                        [0.5 * joint.speed, joint.speed, joint.acceleration]
                    }
                };
                for (order, step) in steps.into_iter().enumerate() {
                    natural[layout.state(node, dimension, order)] = 1.0 / (step * step);
                }
            }
        }
        natural
    }

    /// By how much a motion backs up at worst in each piece, m/s; 0 where it does not.
    pub fn backing_up(&self, x: &[f64]) -> Vec<f64> {
        let layout = self.layout;
        let dense = Table::new(LOOKS);
        (0..layout.pieces)
            .map(|piece| {
                let time = x[layout.duration(piece)].exp();
                let data = layout.data(piece, ARC, x, time);
                let speeds = dense.bases.iter().map(|basis| self.directions[piece] * basis.at(&data)[1] / time);
                -speeds.fold(0.0, f64::min)
            })
            .collect()
    }

    /// Cost at `x` without the gaps, which have these multipliers; fills `out`.
    pub fn evaluate(&mut self, x: &[f64], multipliers: &[[f64; 2]], out: &mut Derivatives) -> f64 {
        out.gradient.fill(0.0);
        out.stiff.fill(0.0);
        out.hessian.clear();
        self.contacts.clear();
        let mut cost = 0.0;
        for (piece, multiplier) in multipliers.iter().enumerate() {
            let time = self.load(piece, x);
            let size = self.local.size;
            let by_gap = &mut out.by_gaps[piece * 2 * size..(piece + 1) * 2 * size];
            let (own, gap) = self.piece(piece, x, time, *multiplier, by_gap);
            cost += own;
            out.gaps[piece] = gap;
            self.scatter(piece, time, out);
        }
        for (index, fixed) in self.fixed.iter().enumerate() {
            if *fixed {
                out.gradient[index] = 0.0;
                *out.hessian.entry(index, index) = 1.0;
            }
        }
        cost
    }

    /// Data of a piece in unit time; returns its duration.
    fn load(&mut self, piece: usize, x: &[f64]) -> f64 {
        let layout = self.layout;
        let time = x[layout.duration(piece)].exp();
        for (dimension, data) in self.data.iter_mut().enumerate() {
            *data = layout.data(piece, dimension, x, time);
        }
        time
    }

    /// Cost and gap of a piece; its derivatives are in `local`.
    fn piece(
        &mut self,
        piece: usize,
        x: &[f64],
        time: f64,
        multiplier: [f64; 2],
        by_gap: &mut [f64],
    ) -> (f64, [f64; 2]) {
        let layout = self.layout;
        let at = layout.position(piece);
        let start = [x[at], x[at + 1]];
        self.local.clear();
        self.local.add_time(time, time);
        let mut cost = time + self.jerks(time);
        let short = SHORTEST.ln() - x[layout.duration(piece)];
        if short > 0.0 {
            cost += 0.5 * self.weights.motion * short * short;
            self.local.add_time(-self.weights.motion * short, self.weights.motion);
        }
        let rate = 1.0 / time;
        let rates = [1.0, rate, rate * rate, rate * rate * rate];
        let (table, first) = self.samples[piece];
        let table = Rc::clone(&self.tables[table]);
        let count = table.count();
        let mut path = Integral::new(1.0 / count as f64);
        for sample in 0..=count {
            let basis = &table.bases[sample];
            let share = table.share(sample);
            let weight = share * time;
            let heading = basis.at(&self.data[HEADING]);
            let arc = basis.at(&self.data[ARC]);
            path.advance(basis, &heading, &arc);
            let [cos, sin] = path.direction();
            let pull = multiplier[0] * cos + multiplier[1] * sin;
            self.local.bend(&basis.rows[0], -share * arc[1] * pull);
            let rest = (piece == 0 && sample == 0) || (piece + 1 == layout.pieces && sample == count);
            cost += self.base_limits(piece, rest, basis, &heading, &arc, &rates, weight * self.weights.motion);
            cost += self.joint_limits(basis, &rates, weight * self.weights.motion);
            cost += self.clearance_at([piece, sample, first + sample], basis, &path, start, weight);
        }
        let reached = path.position();
        let end = layout.position(piece + 1);
        let gap = [start[0] + reached[0] - x[end], start[1] + reached[1] - x[end + 1]];
        for (axis, jacobian) in by_gap.chunks_exact_mut(self.local.size).enumerate() {
            gap_jacobian(layout, &path, axis, jacobian);
            self.local.add(jacobian, multiplier[axis] + STIFFNESS * gap[axis], STIFFNESS);
            for (stiff, by) in self.local.stiff.iter_mut().zip(jacobian.iter()) {
                *stiff += STIFFNESS * *by * *by;
            }
            self.by_unknowns(piece, time, jacobian);
        }
        (cost, gap)
    }

    /// Squared jerk of every dimension.
    fn jerks(&mut self, time: f64) -> f64 {
        let local = &mut self.local;
        let rate = 1.0 / time;
        let mut cost = 0.0;
        for (dimension, data) in self.data.iter().enumerate() {
            let scale = rate * rate / self.jerk_scales[dimension];
            let weight = self.weights.smoothness * scale * scale * rate;
            let first = DATA * dimension;
            let mut form = 0.0;
            for (i, energy) in self.energy.iter().enumerate() {
                let force: f64 = energy.iter().zip(data).map(|(e, d)| e * d).sum();
                form += data[i] * force;
                local.gradient[first + i] += 2.0 * weight * force;
                local.hessian[local.time * local.size + first + i] -= 5.0 * weight * force;
                let row = (first + i) * local.size + first;
                for (entry, e) in local.hessian[row..row + i + 1].iter_mut().zip(energy) {
                    *entry += 2.0 * weight * e;
                }
            }
            cost += weight * form;
            // T^-5: the root's derivative by log T is -5/2 of it.
            local.add_time(-5.0 * weight * form, 12.5 * weight * form);
        }
        cost
    }

    /// Limits of base and wheels: each is linear in one derivative of heading and arc length. At rest the speed is what it is, and
    /// the jerk must not point backwards.
    #[allow(clippy::too_many_arguments)]
    fn base_limits(
        &mut self,
        piece: usize,
        rest: bool,
        basis: &Basis,
        heading: &[f64; 4],
        arc: &[f64; 4],
        rates: &[f64; 4],
        weight: f64,
    ) -> f64 {
        let limits = &self.limits;
        let direction = self.directions[piece];
        let arm = limits.half_track;
        let local = &mut self.local;
        let mut cost = 0.0;
        // `by . (heading, arc length)` of an order exceeds its bound by `value`; the sum is homogeneous in time of minus the order.
        let mut row = |order: usize, by: [f64; 2], value: f64, bound: f64| {
            let scaled = by.map(|b| b * rates[order]);
            let jacobian: ByData = std::array::from_fn(|k| scaled[k / DATA] * basis.rows[order][k % DATA]);
            let by_time = 0.5 * value - order as f64 * (value + bound);
            cost += local.square_of_base(&jacobian, by_time, value, weight);
        };
        let (turn, along) = (heading[1] * rates[1], direction * arc[1] * rates[1]);
        let side = turn.signum();
        let over = |value: f64, limit: f64| value / limit - 1.0;
        let speed = over(along, limits.speed);
        if speed > 0.0 {
            row(1, [0.0, direction / limits.speed], speed, 1.0);
        }
        let floor = self.floors[piece];
        if along < floor && !rest {
            // As if it were by so many limits: there is nothing to gain from it.
            let unit = limits.speed / BACKWARDS;
            row(1, [0.0, -direction / unit], (floor - along) / unit, -floor / unit);
        }
        let push = direction * arc[3] * rates[3] / self.rim_jerk;
        if push < 0.0 && rest {
            row(3, [0.0, -direction / self.rim_jerk], -push, 0.0);
        }
        let at_rest = limits.turn_slope * limits.speed;
        let eq14 = over(side * turn + limits.turn_slope * along, at_rest);
        if eq14 > 0.0 {
            row(1, [side / at_rest, direction * limits.turn_slope / at_rest], eq14, 1.0);
        }
        let cap = over(side * turn, limits.angular_speed);
        if cap > 0.0 {
            row(1, [side / limits.angular_speed, 0.0], cap, 1.0);
        }
        let rim = over(along + arm * side * turn, limits.rim_speed);
        if rim > 0.0 {
            row(1, [side * arm / limits.rim_speed, direction / limits.rim_speed], rim, 1.0);
        }
        let orders = [
            (2, limits.acceleration, limits.angular_acceleration, limits.rim_acceleration),
            (3, f64::INFINITY, f64::INFINITY, self.rim_jerk),
        ];
        for (order, base, turning, rim) in orders {
            let (turn, along) = (heading[order] * rates[order], arc[order] * rates[order]);
            if over(along.abs(), base) > 0.0 {
                row(order, [0.0, along.signum() / base], over(along.abs(), base), 1.0);
            }
            if over(turn.abs(), turning) > 0.0 {
                row(order, [turn.signum() / turning, 0.0], over(turn.abs(), turning), 1.0);
            }
            for arm in [arm, -arm] {
                let wheel = along + arm * turn;
                if over(wheel.abs(), rim) > 0.0 {
                    row(order, [wheel.signum() * arm / rim, wheel.signum() / rim], over(wheel.abs(), rim), 1.0);
                }
            }
        }
        cost
    }

    /// Limits of the joints: speed, acceleration, jerk, position. Leaves the joints' values in `joints`.
    fn joint_limits(&mut self, basis: &Basis, rates: &[f64; 4], weight: f64) -> f64 {
        let mut cost = 0.0;
        for (index, limits) in self.limits.joints.iter().enumerate() {
            let first = DATA * (2 + index);
            let unit = basis.at(&self.data[2 + index]);
            self.joints[index] = unit[0];
            let local = &mut self.local;
            let mut row = |order: usize, factor: f64, value: f64, bound: f64| {
                let jacobian = basis.rows[order].map(|b| factor * rates[order] * b);
                let by_time = 0.5 * value - order as f64 * (value + bound);
                cost += local.square_of_joint(first, &jacobian, by_time, value, weight);
            };
            let bounds = [limits.speed, limits.acceleration, self.joint_jerks[index]];
            for (order, bound) in (1..).zip(bounds) {
                let value = unit[order] * rates[order];
                if value.abs() > bound {
                    row(order, value.signum() / bound, value.abs() / bound - 1.0, 1.0);
                }
            }
            // Positions have no natural size; half the range is it, as a limit's distance from the middle. Unbounded: none.
            let half_range = 0.5 * (limits.upper - limits.lower);
            let size = if half_range.is_finite() && half_range > 1e-6 { half_range } else { 1.0 };
            if unit[0] > limits.upper {
                row(0, 1.0 / size, (unit[0] - limits.upper) / size, 0.0);
            } else if unit[0] < limits.lower {
                row(0, -1.0 / size, (limits.lower - unit[0]) / size, 0.0);
            }
        }
        cost
    }

    /// What the contour misses of the clearance at a sample (piece, its sample, sample of all); joints are set.
    fn clearance_at(
        &mut self,
        [piece, sample, index]: [usize; 3],
        basis: &Basis,
        path: &Integral<'_>,
        start: [f64; 2],
        duration: f64,
    ) -> f64 {
        let n = self.joints.len() + 4;
        let moved = path.position();
        let position = [start[0] + moved[0], start[1] + moved[1]];
        let at = Placement { position, heading: path.direction(), joints: &self.joints };
        let unit = self.weights.clearance_unit;
        let (near, hessian, contacts) = (&mut self.near, &mut self.near_hessian, &mut self.contacts);
        let mut sum = 0.0;
        self.clearance.visit(self.robot, self.field, at, index, |touch| {
            if sum == 0.0 {
                near.fill(0.0);
                hessian.fill(0.0);
            }
            let value = touch.short / unit;
            sum += touch.weight * value * value;
            contacts.push(Contact { piece, sample, of: touch.of, short: touch.short });
            for i in 0..n {
                let own = by_pose(&touch, i, n, unit);
                let own = touch.weight * own;
                near[i] += value * own;
                for j in 0..=i {
                    hessian[i * n + j] += own * by_pose(&touch, j, n, unit);
                }
            }
        });
        if sum == 0.0 {
            return 0.0;
        }
        let weight = self.weights.clearance * duration;
        let size = self.local.size;
        let jacobian = &mut self.jacobian[..n * size];
        sample_jacobian(self.layout, path, basis, jacobian);
        // J^T K J row by row of K, whose lower triangle is there.
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
    fn scatter(&mut self, piece: usize, time: f64, out: &mut Derivatives) {
        self.load_stretch();
        self.local.stretch(&self.stretch, &mut self.product);
        let base = piece * self.layout.block();
        for i in 0..self.local.size {
            let row = base + self.offsets[i];
            if self.fixed[row] {
                continue;
            }
            let scale = power(i, self.local.time, time);
            out.gradient[row] += scale * self.local.gradient[i];
            out.stiff[row] += scale * scale * self.local.stiff[i];
            for j in 0..=i {
                let column = base + self.offsets[j];
                if !self.fixed[column] {
                    let entry = self.local.hessian[i * self.local.size + j];
                    *out.hessian.entry(row.max(column), row.min(column)) +=
                        scale * power(j, self.local.time, time) * entry;
                }
            }
        }
    }

    /// d(data)/d(log T): the order times the datum.
    fn load_stretch(&mut self) {
        for (i, stretch) in self.stretch.iter_mut().enumerate() {
            *stretch = (i % 3) as f64 * self.data[i / DATA][i % DATA];
        }
    }

    /// Turns a Jacobian by a piece's own coordinates into one by its unknowns; those that are fixed count nothing.
    fn by_unknowns(&mut self, piece: usize, time: f64, jacobian: &mut [f64]) {
        self.load_stretch();
        let by_time = self.local.time;
        jacobian[by_time] += self.stretch.iter().zip(jacobian.iter()).map(|(s, j)| s * j).sum::<f64>();
        let base = piece * self.layout.block();
        for (i, entry) in jacobian.iter_mut().enumerate() {
            *entry = if self.fixed[base + self.offsets[i]] { 0.0 } else { *entry * power(i, by_time, time) };
        }
    }

    /// Contour points at `x`, linearised: what the motion would do to those that a step has pushed into an obstacle.
    pub fn rows(&mut self, x: &[f64], contacts: &[Contact]) -> Vec<Row> {
        let layout = self.layout;
        let (size, n) = (self.local.size, self.joints.len() + 4);
        let mut rows = Vec::new();
        let mut first = 0;
        while let Some(Contact { piece, .. }) = contacts.get(first).copied() {
            let last = first + contacts[first..].iter().take_while(|c| c.piece == piece).count();
            let time = self.load(piece, x);
            let table = Rc::clone(&self.tables[self.samples[piece].0]);
            let count = table.count();
            let mut path = Integral::new(1.0 / count as f64);
            let at = layout.position(piece);
            let mut next = first;
            for sample in 0..=count {
                let basis = &table.bases[sample];
                path.advance(basis, &basis.at(&self.data[HEADING]), &basis.at(&self.data[ARC]));
                let here = contacts[next..last].iter().take_while(|c| c.sample == sample).count();
                if here == 0 {
                    continue;
                }
                for (joint, data) in self.joints.iter_mut().zip(&self.data[2..]) {
                    *joint = basis.at(data)[0];
                }
                let moved = path.position();
                let position = [x[at] + moved[0], x[at + 1] + moved[1]];
                let placement = Placement { position, heading: path.direction(), joints: &self.joints };
                let points: Vec<PointOf> = contacts[next..next + here].iter().map(|c| c.of).collect();
                next += here;
                sample_jacobian(layout, &path, basis, &mut self.jacobian[..n * size]);
                let unit = self.weights.clearance_unit;
                let weight = self.weights.clearance * table.share(sample) * time;
                let jacobian = &self.jacobian;
                self.clearance.look(self.robot, self.field, placement, &points, |touch| {
                    let mut by = vec![0.0; size];
                    for i in 0..n {
                        let own = by_pose(&touch, i, n, unit);
                        for (value, entry) in by.iter_mut().zip(&jacobian[i * size..(i + 1) * size]) {
                            *value += own * entry;
                        }
                    }
                    rows.push(Row { piece, weight: weight * touch.weight, value: touch.short / unit, by });
                });
            }
            let from = rows.iter().rposition(|r: &Row| r.piece != piece).map_or(0, |k| k + 1);
            for row in &mut rows[from..] {
                let mut by = std::mem::take(&mut row.by);
                self.by_unknowns(piece, time, &mut by);
                row.by = by;
            }
            first = last;
        }
        rows
    }

    /// Adds half the weighted square of a row to a model.
    pub fn add_row(&self, row: &Row, gradient: &mut [f64], hessian: &mut Banded) {
        let base = row.piece * self.layout.block();
        for (i, own) in row.by.iter().enumerate() {
            if *own == 0.0 {
                continue;
            }
            let at = base + self.offsets[i];
            gradient[at] += row.weight * row.value * own;
            for (j, other) in row.by[..=i].iter().enumerate() {
                let column = base + self.offsets[j];
                *hessian.entry(at.max(column), at.min(column)) += row.weight * own * other;
            }
        }
    }

    /// Takes a force along a Jacobian by a piece's unknowns off a vector of all.
    pub fn pull(&self, piece: usize, force: f64, by: &[f64], out: &mut [f64]) {
        let base = piece * self.layout.block();
        for (by, offset) in by.iter().zip(&self.offsets) {
            out[base + offset] -= force * by;
        }
    }

    /// A row's value after a step, to first order.
    pub fn after(&self, row: &Row, step: &[f64]) -> f64 {
        row.value + self.along(row.piece, &row.by, step)
    }

    /// A Jacobian by a piece's unknowns times a step.
    pub fn along(&self, piece: usize, by: &[f64], step: &[f64]) -> f64 {
        let base = piece * self.layout.block();
        by.iter().zip(&self.offsets).map(|(by, offset)| by * step[base + offset]).sum()
    }
}

/// A linearised limit: `value`, less than 0 where it is kept, and its derivatives by the piece's unknowns.
pub(super) struct Row {
    pub piece: usize,
    pub weight: f64,
    pub value: f64,
    pub by: Vec<f64>,
}

/// Seconds a local coordinate's unit time derivative is worth.
fn power(local: usize, time_index: usize, time: f64) -> f64 {
    match local % 3 {
        1 if local < time_index => time,
        2 if local < time_index => time * time,
        _ => 1.0,
    }
}

/// Derivative of a contour point's missing clearance, in units, by (x, y, heading, joints, logarithm of the duration).
fn by_pose(touch: &Touch<'_>, index: usize, count: usize, unit: f64) -> f64 {
    match index {
        0 | 1 => touch.by_pose.position[index] / unit,
        2 => touch.by_pose.heading / unit,
        // The weight grows with the duration: half of that is in the root.
        i if i + 1 == count => 0.5 * touch.short / unit,
        i => touch.by_joints[i - 3] / unit,
    }
}

/// Rows (x, y, heading, joints, logarithm of the duration) by the local coordinates.
fn sample_jacobian(layout: Layout, path: &Integral<'_>, basis: &Basis, jacobian: &mut [f64]) {
    let (size, time) = (layout.local_size(), layout.local_time());
    jacobian.fill(0.0);
    for axis in 0..2 {
        let row = &mut jacobian[axis * size..(axis + 1) * size];
        row[..2 * DATA].copy_from_slice(&path.by_data(axis));
        row[time + 1 + axis] = 1.0;
    }
    jacobian[2 * size..2 * size + DATA].copy_from_slice(&basis.rows[0]);
    for dimension in 2..layout.dimensions {
        let first = (1 + dimension) * size + DATA * dimension;
        jacobian[first..first + DATA].copy_from_slice(&basis.rows[0]);
    }
    jacobian[(1 + layout.dimensions) * size + time] = 1.0;
}

/// A gap by the local coordinates.
fn gap_jacobian(layout: Layout, path: &Integral<'_>, axis: usize, jacobian: &mut [f64]) {
    jacobian.fill(0.0);
    jacobian[..2 * DATA].copy_from_slice(&path.by_data(axis));
    jacobian[layout.local_time() + 1 + axis] = 1.0;
    jacobian[layout.local_time() + 3 + axis] = -1.0;
}
