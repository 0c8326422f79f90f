//! Contour points near obstacles: what they cost, and what a step would do to them.

use std::rc::Rc;

use super::hermite::{Basis, DATA};
use super::integral::Integral;
use super::layout::{ARC, HEADING, Layout};
use super::problem::Problem;
use super::rows::{Contact, Missed, Row, Rows};
use crate::math::banded::Banded;
use crate::optimize::penalty::clearance::Placement;
use crate::optimize::penalty::field::DistanceField;
use crate::optimize::penalty::touch::Touch;

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
        let mut sum = 0.0;
        self.clearance.visit(self.robot, self.field, at, index, |touch| {
            if sum == 0.0 {
                near.fill(0.0);
                hessian.fill(0.0);
            }
            let value = touch.short / unit;
            sum += touch.weight * value * value;
            contacts.add_point(Contact { piece, sample, of: Missed::Clearance(touch.of), short: touch.short });
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

    /// Adds a row for each of these contacts at `x`; they are sorted.
    pub fn linearise(&mut self, contacts: &[Contact], x: &[f64], rows: &mut Rows) {
        for of_piece in contacts.chunk_by(|a, b| a.piece == b.piece) {
            let piece = of_piece[0].piece;
            let (time, first) = (self.load(piece, x), rows.rows.len());
            let table = Rc::clone(&self.tables[self.samples[piece].0]);
            let share = |sample: usize| table.share(sample) * time;
            for contact in of_piece {
                let Missed::Limit(limit) = contact.of else { continue };
                self.linearise_limit(*contact, limit, &table.bases[contact.sample], share(contact.sample), time, rows);
            }
            let mut path = Integral::new(1.0 / table.count() as f64);
            let at = self.layout.position(piece);
            let start = [x[at], x[at + 1]];
            let mut bases = table.bases.iter();
            let mut done = 0;
            for of_sample in of_piece.chunk_by(|a, b| a.sample == b.sample) {
                let sample = of_sample[0].sample;
                let points = of_sample.partition_point(|contact| matches!(contact.of, Missed::Clearance(_)));
                if points == 0 {
                    continue;
                }
                for basis in bases.by_ref().take(sample + 1 - done) {
                    path.advance(basis, &basis.at(&self.data[HEADING]), &basis.at(&self.data[ARC]));
                }
                done = sample + 1;
                self.linearise_points(&of_sample[..points], &table.bases[sample], &path, start, share(sample), rows);
            }
            for row in first..rows.rows.len() {
                self.by_unknowns(piece, time, rows.by_mut(row));
            }
        }
    }

    /// Adds rows of a sample's contour points by its piece's own coordinates.
    fn linearise_points(
        &mut self,
        contacts: &[Contact],
        basis: &Basis,
        path: &Integral<'_>,
        start: [f64; 2],
        duration: f64,
        rows: &mut Rows,
    ) {
        let (size, n) = (self.local.size, self.joints.len() + 4);
        for (joint, data) in self.joints.iter_mut().zip(&self.data[2..]) {
            *joint = basis.at(data)[0];
        }
        let moved = path.position();
        let position = [start[0] + moved[0], start[1] + moved[1]];
        let placement = Placement { position, heading: path.direction(), joints: &self.joints };
        let jacobian = &mut self.jacobian[..n * size];
        sample_jacobian(self.layout, path, basis, jacobian);
        let unit = self.weights.clearance_unit;
        let weight = self.weights.clearance * duration;
        let points = contacts.iter().filter_map(|contact| match contact.of {
            Missed::Clearance(point) => Some(point),
            Missed::Limit(_) => None,
        });
        let mut told = contacts.iter();
        self.clearance.look(self.robot, self.field, placement, points, |touch| {
            let Some(contact) = told.find(|contact| contact.of == Missed::Clearance(touch.of)) else { return };
            let value = touch.short / unit;
            let by = rows.push(Row { contact: *contact, weight: weight * touch.weight, value });
            for i in 0..n - 1 {
                let own = by_pose(&touch, i, n, unit);
                for (value, entry) in by.iter_mut().zip(&jacobian[i * size..(i + 1) * size]) {
                    *value += own * entry;
                }
            }
        });
    }

    /// Adds half the weighted square of a row to a model.
    pub fn add_row(&self, row: Row, by: &[f64], gradient: &mut [f64], hessian: &mut Banded) {
        let base = row.contact.piece * self.layout.block();
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
