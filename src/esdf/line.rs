//! Distance transforms of lines: `f(k)` becomes `min over m of f(m) + (k - m)^2`.
//!
//! Two ways, both exact. Where values are low everywhere, they bound how far a site can help: a window, in whole blocks of
//! nodes. Else the lower envelope of parabolas (Felzenszwalb & Huttenlocher 2012, cited by \[SCR\] as [22]), O(nodes) whatever
//! the values; a run of equal values, as beside a wall, is one piece of it.

use super::columns::Columns;

/// Squares from here on mean: no site.
pub(super) const NONE: f32 = 1.0e14;
/// Nodes handled together.
pub(super) const LANES: usize = 16;
/// A row goes through the window if each block has a value up to this in itself or beside itself; the window then ends
/// within `PAD`.
const LOW: f32 = 64.0;
const PAD: usize = 48;
/// Columns of no more rows than this go through windows, higher ones through two sweeps.
const LOW_RISE: usize = 32;

pub(super) type Block = [f32; LANES];

/// A run of equal values as a piece of the lower envelope: level between its ends, a parabola beyond each. Two such pieces cross once,
/// as parabolas do: the right one less the left one never grows.
#[derive(Clone, Copy, Default)]
struct Piece {
    /// Ends of the run; both counted from 1, so that all abscissae are positive and cutting is rounding down.
    first: f32,
    last: f32,
    height: f32,
    /// It rules beyond this abscissa.
    from: f64,
}

/// Transforms slabs; holds their memory.
pub(super) struct Lines {
    size: [usize; 2],
    stride: usize,
    pieces: Vec<Piece>,
    /// 1 / (2 d).
    halves: Vec<f64>,
    /// A line as it was, with `PAD` of nothing before it and behind it.
    line: Vec<f32>,
    /// Lowest value of each column.
    low: Vec<f32>,
    slab: Vec<f32>,
    level_of: Vec<usize>,
    /// Whether a row given equals the one before.
    repeats: Vec<bool>,
    high: Columns,
}

impl Lines {
    /// For slabs of rows of ny nodes, padded to whole blocks; `level_of`: which of the rows given is each row of the slab.
    pub(super) fn new(ny: usize, level_of: &[usize]) -> Self {
        let nz = level_of.len();
        let stride = ny.next_multiple_of(LANES);
        let longest = ny.max(nz);
        Self {
            size: [ny, nz],
            stride,
            pieces: vec![Piece::default(); longest + 1],
            halves: (0..longest + 1).map(|d| 0.5 / d as f64).collect(),
            line: vec![f32::MAX; longest.next_multiple_of(LANES) + 2 * PAD],
            low: vec![0.0; stride],
            slab: vec![0.0; stride * nz],
            level_of: level_of.to_vec(),
            repeats: vec![false; nz],
            high: Columns::new(stride, if nz > LOW_RISE { nz } else { 0 }),
        }
    }

    pub(super) fn level_of(&self) -> &[usize] {
        &self.level_of
    }

    /// Transforms the rows given, each standing for one row or more of the slab; then the slab along its columns.
    pub(super) fn transform(&mut self, levels: &mut [f32], slab: &mut [f32]) {
        let [ny, nz] = self.size;
        // Solids are upright as a rule, so a row often equals the row below.
        for k in 0..levels.len() / self.stride {
            let (below, row) = levels.split_at_mut(k * self.stride);
            let row = &mut row[..ny];
            self.repeats[k] = k > 0 && equal(row, &self.line[PAD..PAD + ny]);
            if self.repeats[k] {
                row.copy_from_slice(&below[(k - 1) * self.stride..][..ny]);
                continue;
            }
            self.line[PAD..PAD + ny].copy_from_slice(row);
            if low_everywhere(row) {
                self.window(row);
            } else {
                self.envelope(row);
            }
        }
        if nz > LOW_RISE {
            self.high.transform(levels, &self.level_of, &self.repeats, slab);
            return;
        }
        for (row, level) in slab.chunks_exact_mut(self.stride).zip(&self.level_of) {
            row.copy_from_slice(&levels[level * self.stride..][..self.stride]);
        }
        self.columns(slab);
    }

    /// The row whose copy is in `line`.
    fn window(&self, row: &mut [f32]) {
        for (b, out) in row.chunks_mut(LANES).enumerate() {
            let at = PAD + b * LANES;
            let mut best = block(&self.line, at);
            let mut d = 1;
            while d < PAD && highest(&best) > (d * d) as f32 {
                lower(&mut best, &block(&self.line, at - d), (d * d) as f32);
                lower(&mut best, &block(&self.line, at + d), (d * d) as f32);
                d += 1;
            }
            out.copy_from_slice(&best[..out.len()]);
        }
    }

    /// Zeros are never improved and hide what lies behind them, so the runs between them are solved alone.
    fn envelope(&mut self, line: &mut [f32]) {
        let length = line.len();
        let mut next = 0;
        while let Some(start) = line[next..].iter().position(|f| *f > 0.0) {
            let start = next + start;
            let end = line[start..].iter().position(|f| *f == 0.0).map_or(line.len(), |n| start + n);
            self.run(&mut line[start.saturating_sub(1)..(end + 1).min(length)]);
            next = end;
        }
    }

    fn run(&mut self, line: &mut [f32]) {
        let nodes = line.len();
        let mut top = 0;
        let mut next = 0;
        while next < nodes {
            let (start, height) = (next, line[next]);
            next += 1;
            while next < nodes && line[next] == height {
                next += 1;
            }
            if height >= NONE {
                continue;
            }
            let mut piece = Piece { first: (start + 1) as f32, last: next as f32, height, from: 0.0 };
            while top > 0 {
                let rival = &self.pieces[top - 1];
                piece.from = self.crossing(rival, &piece);
                if piece.from > rival.from {
                    break;
                }
                top -= 1;
                piece.from = 0.0;
            }
            if piece.from < nodes as f64 {
                self.pieces[top] = piece;
                top += 1;
            }
        }
        let mut end = nodes;
        for piece in self.pieces[..top].iter().rev() {
            let from = piece.from as usize;
            let (first, last) = ((piece.first as usize - 1).clamp(from, end), (piece.last as usize).clamp(from, end));
            parabola(&mut line[from..first], (from + 1) as f32 - piece.first, piece.height);
            line[first..last].fill(piece.height);
            parabola(&mut line[last..end], (last + 1) as f32 - piece.last, piece.height);
            end = from;
        }
    }

    /// The left one is the lower up to here.
    #[inline]
    fn crossing(&self, left: &Piece, right: &Piece) -> f64 {
        // Of the parabola of one end with that of another; `rise` is the right height less the left one.
        let between = |left: f32, right: f32, rise: f64| {
            0.5 * (f64::from(left) + f64::from(right)) + rise * self.halves[(right - left) as usize]
        };
        let rise = f64::from(right.height) - f64::from(left.height);
        let at = between(left.last, right.first, rise);
        if at > f64::from(right.first) {
            // In the right run or beyond it.
            let at = f64::from(left.last) + rise.sqrt();
            return if at <= f64::from(right.last) { at } else { between(left.last, right.last, rise) };
        }
        if at < f64::from(left.last) {
            let at = f64::from(right.first) - (-rise).sqrt();
            return if at >= f64::from(left.first) { at } else { between(left.first, right.first, rise) };
        }
        at
    }

    /// A column's value gains at most what it differs from the column's lowest: no site further than the root of that helps.
    #[inline(never)]
    fn columns(&mut self, slab: &mut [f32]) {
        let nz = self.size[1];
        self.low.copy_from_slice(&slab[..self.stride]);
        for row in slab.chunks_exact(self.stride) {
            self.low.iter_mut().zip(row).for_each(|(low, value)| *low = if value < low { *value } else { *low });
        }
        self.slab.copy_from_slice(slab);
        for (k, row) in slab.chunks_exact_mut(self.stride).enumerate() {
            for (b, out) in row.chunks_exact_mut(LANES).enumerate() {
                let mut best = block(out, 0);
                let low = block(&self.low, b * LANES);
                let mut gain = most_above(&best, &low);
                if gain <= 0.0 {
                    continue;
                }
                let mut d = 1;
                while d < nz && gain > (d * d) as f32 {
                    if k >= d {
                        lower(&mut best, &block(&self.slab, (k - d) * self.stride + b * LANES), (d * d) as f32);
                    }
                    if k + d < nz {
                        lower(&mut best, &block(&self.slab, (k + d) * self.stride + b * LANES), (d * d) as f32);
                    }
                    if d % 4 == 0 {
                        gain = most_above(&best, &low);
                    }
                    d += 1;
                }
                out.copy_from_slice(&best);
            }
        }
    }
}

/// `height + d^2`, d from `first` on.
#[inline]
fn parabola(line: &mut [f32], first: f32, height: f32) {
    for (k, value) in line.iter_mut().enumerate() {
        let d = first + k as i32 as f32;
        *value = height + d * d;
    }
}

/// Without an early end, so that it runs in blocks.
#[inline(never)]
fn equal(a: &[f32], b: &[f32]) -> bool {
    a.iter().zip(b).fold(0, |differ, (a, b)| differ | (a.to_bits() ^ b.to_bits())) == 0
}

/// Whether each block has a low value in itself or beside itself.
#[inline(never)]
fn low_everywhere(row: &[f32]) -> bool {
    let mut blocks = row.chunks(LANES).map(|b| b.iter().fold(NONE, |low, f| if *f < low { *f } else { low }) <= LOW);
    let mut before = false;
    let mut here = blocks.next().unwrap_or(true);
    for next in blocks {
        if !(before || here || next) {
            return false;
        }
        (before, here) = (here, next);
    }
    before || here
}

#[inline]
pub(super) fn block(line: &[f32], at: usize) -> Block {
    line[at..at + LANES].try_into().expect("as long as a block")
}

#[inline]
fn lower(best: &mut Block, site: &Block, square: f32) {
    for (best, site) in best.iter_mut().zip(site) {
        let through = site + square;
        *best = if through < *best { through } else { *best };
    }
}

/// The most that a value lies above its column's lowest.
#[inline]
fn most_above(values: &Block, low: &Block) -> f32 {
    let mut above = *values;
    above.iter_mut().zip(low).for_each(|(above, low)| *above -= low);
    highest(&above)
}

/// Highest value, by halves.
#[inline]
fn highest(block: &Block) -> f32 {
    let mut top = *block;
    let mut width = LANES / 2;
    while width > 0 {
        for lane in 0..width {
            top[lane] = if top[lane + width] > top[lane] { top[lane + width] } else { top[lane] };
        }
        width /= 2;
    }
    top[0]
}
