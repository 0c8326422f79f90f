//! Contour points near obstacles: what they cost, and what a step does to those that it would push in.

use std::rc::Rc;

use super::hermite::{Basis, DATA};
use super::integral::Integral;
use super::layout::Layout;
use super::problem::Problem;
use crate::math::banded::Banded;
use crate::optimize::penalty::clearance::{DistanceField, Placement, PointOf, Touch};

/// Contour points of a sample that are remembered: the deepest.
const DEEPEST: usize = 3;

/// A contour point that misses the clearance at a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Contact {
    pub piece: usize,
    pub sample: usize,
    pub of: PointOf,
    pub short: f64,
}

/// Of each sample the deepest contacts, in the order of samples and then of depth.
#[derive(Debug, Clone, Default)]
pub(super) struct Contacts {
    found: Vec<Contact>,
    /// Where those of the present sample begin.
    first: usize,
}

impl Contacts {
    /// Room for as many as `samples` samples can have.
    pub fn of_samples(samples: usize) -> Self {
        Self { found: Vec::with_capacity(DEEPEST * samples), first: 0 }
    }

    pub fn clear(&mut self) {
        self.found.clear();
    }

    pub fn as_slice(&self) -> &[Contact] {
        &self.found
    }

    fn next_sample(&mut self) {
        self.first = self.found.len();
    }

    fn add(&mut self, contact: Contact) {
        if self.found.len() < self.first + DEEPEST {
            self.found.push(contact);
        } else if let Some(last) = self.found.last_mut().filter(|last| last.short < contact.short) {
            *last = contact;
        } else {
            return;
        }
        let mut at = self.found.len() - 1;
        while at > self.first && self.found[at - 1].short < contact.short {
            self.found.swap(at - 1, at);
            at -= 1;
        }
    }
}

/// A linearised limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    pub piece: usize,
    pub weight: f64,
    /// Less than 0 where it is kept.
    pub value: f64,
}

/// Linearised limits with their derivatives by the unknowns of their pieces.
#[derive(Debug, Clone, Default)]
pub(super) struct Rows {
    pub rows: Vec<Row>,
    by: Vec<f64>,
    size: usize,
}

impl Rows {
    /// Room for two contacts' worth of each sample.
    pub fn of_samples(samples: usize, layout: Layout) -> Self {
        let (count, size) = (2 * DEEPEST * samples, layout.local_size());
        Self { rows: Vec::with_capacity(count), by: Vec::with_capacity(count * size), size }
    }

    pub fn clear(&mut self) {
        self.rows.clear();
        self.by.clear();
    }

    /// Derivatives of a row.
    pub fn by(&self, row: usize) -> &[f64] {
        &self.by[row * self.size..(row + 1) * self.size]
    }
}

impl<F: DistanceField> Problem<'_, F> {
    /// What the contour misses of the clearance at a sample (piece, its sample, sample of all); joints are set.
    pub(super) fn clearance_at(
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
        contacts.next_sample();
        let mut sum = 0.0;
        self.clearance.visit(self.robot, self.field, at, index, |touch| {
            if sum == 0.0 {
                near.fill(0.0);
                hessian.fill(0.0);
            }
            let value = touch.short / unit;
            sum += touch.weight * value * value;
            contacts.add(Contact { piece, sample, of: touch.of, short: touch.short });
            for i in 0..n {
                let own = touch.weight * by_pose(&touch, i, n, unit);
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

    /// Adds the contacts of the last evaluation, linearised at `x`: what the motion would do to those points.
    pub fn linearise_contacts(&mut self, x: &[f64], rows: &mut Rows) {
        let contacts = std::mem::take(&mut self.contacts);
        for of_piece in contacts.as_slice().chunk_by(|a, b| a.piece == b.piece) {
            self.linearise(of_piece, x, rows);
        }
        self.contacts = contacts;
    }

    /// Adds contacts of one piece.
    fn linearise(&mut self, contacts: &[Contact], x: &[f64], rows: &mut Rows) {
        let piece = contacts[0].piece;
        let (layout, size, n) = (self.layout, self.local.size, self.joints.len() + 4);
        let time = self.load(piece, x);
        let table = Rc::clone(&self.tables[self.samples[piece].0]);
        let mut path = Integral::new(1.0 / table.count() as f64);
        let at = layout.position(piece);
        let mut of_samples = contacts.chunk_by(|a, b| a.sample == b.sample).peekable();
        for (sample, basis) in table.bases.iter().enumerate() {
            path.advance(
                basis,
                &basis.at(&self.data[super::layout::HEADING]),
                &basis.at(&self.data[super::layout::ARC]),
            );
            let Some(here) = of_samples.next_if(|here| here[0].sample == sample) else { continue };
            for (joint, data) in self.joints.iter_mut().zip(&self.data[2..]) {
                *joint = basis.at(data)[0];
            }
            let moved = path.position();
            let position = [x[at] + moved[0], x[at + 1] + moved[1]];
            let placement = Placement { position, heading: path.direction(), joints: &self.joints };
            sample_jacobian(layout, &path, basis, &mut self.jacobian[..n * size]);
            let unit = self.weights.clearance_unit;
            let weight = self.weights.clearance * table.share(sample) * time;
            let (jacobian, first) = (&self.jacobian, rows.rows.len());
            self.clearance.look(self.robot, self.field, placement, here.iter().map(|c| c.of), |touch| {
                let from = rows.by.len();
                rows.by.resize(from + size, 0.0);
                for i in 0..n {
                    let own = by_pose(&touch, i, n, unit);
                    for (value, entry) in rows.by[from..].iter_mut().zip(&jacobian[i * size..(i + 1) * size]) {
                        *value += own * entry;
                    }
                }
                rows.rows.push(Row { piece, weight: weight * touch.weight, value: touch.short / unit });
            });
            for row in first..rows.rows.len() {
                self.by_unknowns(piece, time, &mut rows.by[row * size..(row + 1) * size]);
            }
        }
    }

    /// Adds half the weighted square of a row to a model.
    pub fn add_row(&self, row: Row, by: &[f64], gradient: &mut [f64], hessian: &mut Banded) {
        let base = row.piece * self.layout.block();
        for (i, own) in by.iter().enumerate() {
            if *own == 0.0 {
                continue;
            }
            let at = base + self.offsets[i];
            gradient[at] += row.weight * row.value * own;
            for (j, other) in by[..=i].iter().enumerate() {
                let column = base + self.offsets[j];
                *hessian.entry(at.max(column), at.min(column)) += row.weight * own * other;
            }
        }
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
