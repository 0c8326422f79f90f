//! What a sample misses, and what a step would do to it: limits and contour points linearised, each active or not as the step says.

use super::layout::Layout;
use crate::optimize::penalty::touch::PointOf;

/// Contour points of a sample that are remembered: the deepest.
const DEEPEST: usize = 3;
/// Limits of a sample that are remembered: the first.
const OVERSTEPPED: usize = 6;

/// A limit on one derivative of heading and arc length, or of a joint: `by` times it, less `bound`, must not exceed 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Limit {
    /// Of the derivative by time.
    pub order: usize,
    /// The dimension that `by` begins with.
    pub first: usize,
    pub by: [f64; 2],
    pub bound: f64,
}

/// What can be missed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Missed {
    Clearance(PointOf),
    Limit(Limit),
}

/// What is missed at a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Contact {
    pub piece: usize,
    pub sample: usize,
    pub of: Missed,
    /// By how much: of the clearance m, of a limit in units of itself.
    pub short: f64,
}

impl Contact {
    /// Orders contacts by piece, then by sample; equal for the same point or limit.
    fn key(&self) -> [u64; 5] {
        let [kind, a, b] = match self.of {
            Missed::Clearance(PointOf::Contour { body, point }) => [0, body as u64, point as u64],
            Missed::Clearance(PointOf::Pair(pair)) => [1, pair as u64, 0],
            Missed::Limit(limit) => {
                let [a, b] = limit.by.map(f64::to_bits);
                [2 + 4 * limit.first as u64 + limit.order as u64, a, b]
            }
        };
        [self.piece as u64, self.sample as u64, kind, a, b]
    }
}

/// Sorts, and leaves each out but once.
pub(super) fn sort(contacts: &mut Vec<Contact>) {
    contacts.sort_unstable_by_key(Contact::key);
    contacts.dedup_by_key(|contact| contact.key());
}

/// Of each sample the deepest contour points, in the order of samples and then of depth, and what it oversteps of limits.
#[derive(Debug, Clone, Default)]
pub(super) struct Contacts {
    points: Vec<Contact>,
    limits: Vec<Contact>,
    /// Where those of the present sample begin.
    first: [usize; 2],
}

impl Contacts {
    /// Room for as many as `samples` samples can have.
    pub fn of_samples(samples: usize) -> Self {
        let (points, limits) = (Vec::with_capacity(DEEPEST * samples), Vec::with_capacity(OVERSTEPPED * samples));
        Self { points, limits, first: [0; 2] }
    }

    pub fn clear(&mut self) {
        self.points.clear();
        self.limits.clear();
    }

    /// Those that miss the clearance.
    #[cfg(test)]
    pub fn points(&self) -> &[Contact] {
        &self.points
    }

    pub fn all(&self) -> impl Iterator<Item = Contact> {
        self.points.iter().chain(&self.limits).copied()
    }

    pub fn next_sample(&mut self) {
        self.first = [self.points.len(), self.limits.len()];
    }

    pub fn add_limit(&mut self, contact: Contact) {
        if self.limits.len() < self.first[1] + OVERSTEPPED {
            self.limits.push(contact);
        }
    }

    pub fn add_point(&mut self, contact: Contact) {
        let (points, first) = (&mut self.points, self.first[0]);
        if points.len() < first + DEEPEST {
            points.push(contact);
        } else if let Some(last) = points.last_mut().filter(|last| last.short < contact.short) {
            *last = contact;
        } else {
            return;
        }
        let mut at = points.len() - 1;
        while at > first && points[at - 1].short < contact.short {
            points.swap(at - 1, at);
            at -= 1;
        }
    }
}

/// A contact linearised: half the weighted square of its value is the cost, where that is positive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    pub contact: Contact,
    pub weight: f64,
    /// Less than 0 where it is kept.
    pub value: f64,
}

/// Rows with their derivatives by the unknowns of their pieces.
#[derive(Debug, Clone, Default)]
pub(super) struct Rows {
    pub rows: Vec<Row>,
    by: Vec<f64>,
    size: usize,
}

impl Rows {
    /// Room for all contacts of two motions.
    pub fn of_samples(samples: usize, layout: Layout) -> Self {
        let (count, size) = (2 * (DEEPEST + OVERSTEPPED) * samples, layout.local_size());
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

    /// The same, to change.
    pub fn by_mut(&mut self, row: usize) -> &mut [f64] {
        &mut self.by[row * self.size..(row + 1) * self.size]
    }

    /// Adds a row; its derivatives are 0.
    pub fn push(&mut self, row: Row) -> &mut [f64] {
        self.rows.push(row);
        let from = self.by.len();
        self.by.resize(from + self.size, 0.0);
        &mut self.by[from..]
    }
}
