//! Distance transforms of columns of many rows: `f(k)` becomes `min over m of f(m) + (k - m)^2`, block by block of columns.
//!
//! Two sweeps. Going up, the rows passed that may still be the nearest are kept: of two rows, `f(m) + (k - m)^2` of the lower one
//! rises faster with k, so a row that is beaten by higher ones in all columns of the block has been beaten for good. Going down
//! likewise. Of equal rows next to each other, the nearest stands for all: solids are upright as a rule.

use super::line::{Block, LANES, NONE, block};

/// The sweeps' memory.
pub(super) struct Columns {
    stride: usize,
    /// A block of columns as it was, and as found so far.
    before: Vec<Block>,
    best: Vec<Block>,
    /// Rows that may still be the nearest, in the order in which they were passed.
    live: Vec<usize>,
}

impl Columns {
    /// For slabs of nz rows of `stride` nodes.
    pub(super) fn new(stride: usize, nz: usize) -> Self {
        let rows = vec![[0.0; LANES]; nz];
        Self { stride, before: rows.clone(), best: rows, live: Vec::with_capacity(nz) }
    }

    /// `repeats`: whether a row equals the row below.
    pub(super) fn transform(&mut self, slab: &mut [f32], repeats: &[bool]) {
        let nz = self.before.len();
        for at in (0..self.stride).step_by(LANES) {
            for (k, row) in self.before.iter_mut().enumerate() {
                *row = block(slab, k * self.stride + at);
            }
            self.live.clear();
            for (k, repeats) in repeats.iter().enumerate() {
                if *repeats && self.live.last() == Some(&(k - 1)) {
                    self.live.pop();
                }
                let own = self.before[k];
                self.best[k] = own;
                self.lower(k);
                if any_below(&own, &[NONE; LANES]) {
                    self.live.push(k);
                }
            }
            self.live.clear();
            for k in (0..nz).rev() {
                if repeats.get(k + 1) == Some(&true) && self.live.last() == Some(&(k + 1)) {
                    self.live.pop();
                }
                // Beaten by a row below: so it is further down.
                let beaten = !(0..LANES).any(|lane| self.before[k][lane] <= self.best[k][lane]);
                self.lower(k);
                if !beaten && any_below(&self.before[k], &[NONE; LANES]) {
                    self.live.push(k);
                }
                slab[k * self.stride + at..][..LANES].copy_from_slice(&self.best[k]);
            }
        }
    }

    /// Lowers row k by the live rows, from the last passed to the first, and forgets those that lower it nowhere.
    #[inline]
    fn lower(&mut self, k: usize) {
        let mut best = self.best[k];
        let mut kept = self.live.len();
        for at in (0..self.live.len()).rev() {
            let m = self.live[at];
            let d = k.abs_diff(m);
            let through = self.before[m].map(|f| f + (d * d) as f32);
            if any_below(&through, &best) {
                best.iter_mut().zip(&through).for_each(|(best, f)| *best = if *f < *best { *f } else { *best });
                kept -= 1;
                self.live[kept] = m;
            }
        }
        self.live.drain(..kept);
        self.best[k] = best;
    }
}

/// Whether a value is below the other one of its column; without an early end, so that it runs in blocks.
#[inline]
fn any_below(a: &Block, b: &Block) -> bool {
    a.iter().zip(b).fold(0u32, |any, (a, b)| any | u32::from(a < b)) != 0
}
