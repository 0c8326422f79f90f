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

    /// From rows that each stand for one or more of the slab (`level_of`) to the slab; `repeats`: whether such a row equals the one before.
    pub(super) fn transform(&mut self, levels: &[f32], level_of: &[usize], repeats: &[bool], slab: &mut [f32]) {
        let nz = self.before.len();
        let differs = |k: usize| level_of[k] != level_of[k - 1] && !repeats[level_of[k]];
        for at in (0..self.stride).step_by(LANES) {
            // The lowest row that lies above the one below it somewhere, and the highest that lies below it.
            let (mut rise, mut fall) = (nz, 0);
            self.before[0] = block(levels, level_of[0] * self.stride + at);
            for (k, level) in level_of.iter().enumerate().skip(1) {
                self.before[k] = self.before[k - 1];
                if differs(k) {
                    self.before[k] = block(levels, level * self.stride + at);
                    let (below, here) = (&self.before[k - 1], &self.before[k]);
                    if rise == nz && any_below(below, here) {
                        rise = k;
                    }
                    if any_below(here, below) {
                        fall = k;
                    }
                }
            }
            // Up to the first rise no lower row is nearer, nor can any pass by the last row of these.
            self.best[..rise].copy_from_slice(&self.before[..rise]);
            self.live.clear();
            self.keep(rise - 1);
            for k in rise..nz {
                if !differs(k) && self.live.last() == Some(&(k - 1)) {
                    self.live.pop();
                }
                self.best[k] = self.before[k];
                self.lower(k);
                self.keep(k);
            }
            // From the last fall on, likewise.
            self.live.clear();
            self.keep(fall);
            for k in (0..fall).rev() {
                if !differs(k + 1) && self.live.last() == Some(&(k + 1)) {
                    self.live.pop();
                }
                // Beaten by a row below: so it is further down.
                let beaten = !(0..LANES).any(|lane| self.before[k][lane] <= self.best[k][lane]);
                self.lower(k);
                if !beaten {
                    self.keep(k);
                }
            }
            for (row, best) in slab.chunks_exact_mut(self.stride).zip(&self.best) {
                row[at..at + LANES].copy_from_slice(best);
            }
        }
    }

    /// Row k may still be the nearest, if it has any sites.
    #[inline]
    fn keep(&mut self, k: usize) {
        if any_below(&self.before[k], &[NONE; LANES]) {
            self.live.push(k);
        }
    }

    /// Lowers row k by the live rows, from the last passed to the first, and forgets those that lower it nowhere.
    #[inline(always)]
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
