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
use super::integral::Integral;
use super::layout::{ARC, HEADING, Layout};
use super::local::Local;
use super::rows::Contacts;
use crate::math::banded::Banded;
use crate::math::real;
use crate::optimize::penalty::Limits;
use crate::optimize::penalty::clearance::ClearancePenalty;
use crate::optimize::penalty::field::DistanceField;
use crate::optimize::penalty::zone::ZonePenalty;
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
/// Shortest piece, s.
const SHORTEST: f64 = 0.04;

/// How often a finished piece is looked at.
const LOOKS: usize = 64;

/// Samples of a piece.
pub(super) struct Table {
    pub bases: Vec<Basis>,
}

impl Table {
    fn new(count: usize) -> Self {
        Self { bases: (0..=count).map(|j| Basis::new(j as f64 / count as f64)).collect() }
    }

    pub fn count(&self) -> usize {
        self.bases.len() - 1
    }

    /// Share of the duration that a sample stands for.
    pub fn share(&self, sample: usize) -> f64 {
        if sample == 0 || sample == self.count() { 0.5 / self.count() as f64 } else { 1.0 / self.count() as f64 }
    }
}

/// The problem; owns all scratch memory.
pub(super) struct Problem<'a, F> {
    pub(super) robot: &'a RobotModel,
    pub(super) field: &'a F,
    pub(super) limits: Limits,
    pub(super) rim_jerk: f64,
    pub(super) joint_jerks: Vec<f64>,
    pub(super) clearance: ClearancePenalty,
    pub(super) layout: Layout,
    /// +1 or -1 a piece: which way its base drives.
    pub(super) directions: Vec<f64>,
    pub(super) fixed: Vec<bool>,
    /// Where the base is to be slow.
    pub(super) zones: ZonePenalty,
    /// Least speed along its direction that is asked of each piece, m/s.
    pub(super) floors: Vec<f64>,
    pub(super) weights: Weights,
    /// What a jerk of each dimension is measured in.
    pub(super) jerk_scales: Vec<f64>,
    pub(super) energy: [[f64; DATA]; DATA],
    pub(super) tables: Vec<Rc<Table>>,
    /// Of each piece, its table and the number of its first sample.
    pub(super) samples: Vec<(usize, usize)>,
    pub(super) local: Local,
    pub(super) offsets: Vec<usize>,
    pub(super) data: Vec<[f64; DATA]>,
    pub(super) joints: Vec<f64>,
    /// Clearance terms of a sample: gradient and lower triangle by x, y, heading, joints, logarithm of the duration.
    pub(super) near: Vec<f64>,
    pub(super) near_hessian: Vec<f64>,
    pub(super) jacobian: Vec<f64>,
    pub(super) product: Vec<f64>,
    pub(super) stretch: Vec<f64>,
    /// Of the last evaluation.
    pub(super) contacts: Contacts,
}

/// What an evaluation fills.
#[derive(Clone)]
pub(super) struct Derivatives {
    pub gradient: Vec<f64>,
    pub hessian: Banded,
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
            zones: ZonePenalty::new(&[], 0.0),
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
            contacts: Contacts::of_samples(first),
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
                let time = real::exp(x[layout.duration(piece)]);
                let data = layout.data(piece, ARC, x, time);
                let speeds = dense.bases.iter().map(|basis| self.directions[piece] * basis.at(&data)[1] / time);
                -speeds.fold(0.0, f64::min)
            })
            .collect()
    }

    /// Cost at `x` without the gaps, which have these multipliers; fills `out`.
    pub fn evaluate(&mut self, x: &[f64], multipliers: &[[f64; 2]], out: &mut Derivatives) -> f64 {
        out.gradient.fill(0.0);
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
    pub(super) fn load(&mut self, piece: usize, x: &[f64]) -> f64 {
        let layout = self.layout;
        let time = real::exp(x[layout.duration(piece)]);
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
        let short = real::ln(SHORTEST) - x[layout.duration(piece)];
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
            self.contacts.next_sample();
            let rest = (piece == 0 && sample == 0) || (piece + 1 == layout.pieces && sample == count);
            cost +=
                self.base_limits([piece, sample], rest, basis, &heading, &arc, &rates, weight * self.weights.motion);
            cost += self.zone_limit(piece, basis, &arc, &rates, &path, start, weight * self.weights.motion);
            cost += self.joint_limits([piece, sample], basis, &rates, weight * self.weights.motion);
            cost += self.clearance_at([piece, sample, first + sample], basis, &path, start, weight);
        }
        let reached = path.position();
        let end = layout.position(piece + 1);
        let gap = [start[0] + reached[0] - x[end], start[1] + reached[1] - x[end + 1]];
        for (axis, jacobian) in by_gap.chunks_exact_mut(self.local.size).enumerate() {
            gap_jacobian(layout, &path, axis, jacobian);
            self.local.add(jacobian, multiplier[axis] + STIFFNESS * gap[axis], STIFFNESS);
            self.by_unknowns(piece, time, jacobian);
        }
        (cost, gap)
    }

    /// What the jerk costs.
    pub fn jerk(&mut self, x: &[f64]) -> f64 {
        let pieces = 0..self.layout.pieces;
        let of = |piece: usize| {
            let time = self.load(piece, x);
            self.jerks(time)
        };
        pieces.map(of).sum()
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
    pub(super) fn by_unknowns(&mut self, piece: usize, time: f64, jacobian: &mut [f64]) {
        self.load_stretch();
        let by_time = self.local.time;
        jacobian[by_time] += self.stretch.iter().zip(jacobian.iter()).map(|(s, j)| s * j).sum::<f64>();
        let base = piece * self.layout.block();
        for (i, entry) in jacobian.iter_mut().enumerate() {
            *entry = if self.fixed[base + self.offsets[i]] { 0.0 } else { *entry * power(i, by_time, time) };
        }
    }

    /// Takes a force along a Jacobian by a piece's unknowns off a vector of all.
    pub fn pull(&self, piece: usize, force: f64, by: &[f64], out: &mut [f64]) {
        let base = piece * self.layout.block();
        for (by, offset) in by.iter().zip(&self.offsets) {
            out[base + offset] -= force * by;
        }
    }

    /// Samples of all pieces.
    pub fn sample_count(&self) -> usize {
        self.samples.last().map_or(0, |(table, first)| first + self.tables[*table].count() + 1)
    }

    /// A Jacobian by a piece's unknowns times a step.
    pub fn along(&self, piece: usize, by: &[f64], step: &[f64]) -> f64 {
        let base = piece * self.layout.block();
        by.iter().zip(&self.offsets).map(|(by, offset)| by * step[base + offset]).sum()
    }
}

/// Seconds a local coordinate's unit time derivative is worth.
fn power(local: usize, time_index: usize, time: f64) -> f64 {
    match local % 3 {
        1 if local < time_index => time,
        2 if local < time_index => time * time,
        _ => 1.0,
    }
}

/// A gap by the local coordinates.
fn gap_jacobian(layout: Layout, path: &Integral<'_>, axis: usize, jacobian: &mut [f64]) {
    jacobian.fill(0.0);
    jacobian[..2 * DATA].copy_from_slice(&path.by_data(axis));
    jacobian[layout.local_time() + 1 + axis] = 1.0;
    jacobian[layout.local_time() + 3 + axis] = -1.0;
}
