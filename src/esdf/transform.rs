//! The exact distance transform: squared distance to the nearest site is separable, one pass per axis.
//!
//! Along x a site is a bit, so the first pass counts steps from slab to slab (a slab: all nodes of one i), forwards into the
//! result itself and backwards in one slab of memory. What is left is a matter of each slab alone, held in the cache. Within a
//! slab y is fastest: row k holds the nodes (k, 0..ny), padded to whole blocks of `LANES`, so that loops over rows are loops
//! over blocks. Those loops are functions that are never inlined: only so does the compiler know that their rows do not
//! overlap, and takes four nodes at once.
//!
//! With several threads each has a part of every slab, by y, for the pass forwards, which goes through all slabs; and then some
//! of the slabs, all of each. What the pass backwards has counted where a thread's slabs begin is found out in between, as that
//! is again a matter of lines along x. Every node is computed as by one thread: the bytes are the same.
//!
//! Squared distances are whole numbers in f32: exact up to 4096 cells, within rounding beyond.

use std::ops::Range;

use super::FAR;
use super::kinds::Kinds;
use super::line::{LANES, Lines, NONE};
use crate::map::VoxelMap;
use crate::mission::Unknown;

/// Steps of a node with no site on its line; one more is lost in rounding. (2^24; its square is above `NONE`.)
const NEVER: f32 = 16_777_216.0;

/// Signed distances (m) at all nodes, by so many threads (at least 1).
pub(super) fn signed_distance(map: &VoxelMap, nodes: [usize; 3], threads: usize) -> Vec<f32> {
    let [nx, ny, nz] = nodes;
    let size = ny * nz;
    let mut values = vec![0.0f32; nx * size];
    let levels = Levels::of(map);
    let parts = Parts::new(ny, levels.rows.len(), threads);
    let known = ny * levels.rows.len();
    let shares = shares(nx, threads, 1);
    let forwards = sweep_forwards(map, &levels, &parts, &shares, &mut values);
    let solids: Vec<bool> = (0..nx).map(|i| forwards.iter().any(|part| part.solids[i])).collect();
    // The slabs of each share, from the last one on, and what the pass backwards brings into it.
    let work = |share: &Range<usize>, slabs: &mut [f32], after: Option<Vec<f32>>| {
        let mut inner = Slabs::new(map, &levels, parts.clone());
        let mut after =
            after.unwrap_or_else(|| slabs[slabs.len() - size..][..known].iter().map(|steps| steps * NEVER).collect());
        for (i, slab) in share.clone().zip(slabs.chunks_exact_mut(size)).rev() {
            if i + 1 < nx {
                step_back(&slab[..known], &mut after);
            }
            let edge = if map.outside == Unknown::Occupied { i.min(nx - 1 - i) as f32 } else { f32::INFINITY };
            inner.outside(slab, &after, edge);
            if solids[i] {
                inner.inside(slab, &after);
            }
            inner.write(slab);
        }
    };
    let after = |share: usize| {
        (share + 1 < shares.len()).then(|| forwards.iter().flat_map(|part| part.after[share].iter().copied()).collect())
    };
    let mut rest = &mut values[..];
    let tasks = shares.iter().enumerate().map(|(at, share)| {
        let (own, others) = std::mem::take(&mut rest).split_at_mut(share.len() * size);
        rest = others;
        let (work, after) = (&work, after(at));
        move || work(share, own, after)
    });
    each_in_a_thread(tasks.collect());
    values
}

/// Rows of nodes that are alike in every slab, and so are all that comes of them along x and y: done once. Nothing reaches as
/// high as most maps do, and above it all is free.
struct Levels {
    /// The lowest row of each level.
    rows: Vec<usize>,
    /// The level of each row.
    of: Vec<usize>,
}

impl Levels {
    fn of(map: &VoxelMap) -> Self {
        // Bit k: cells k differ from cells k - 1 somewhere. All are free below and above the grid.
        let words = map.dims[2].div_ceil(64);
        let mut differ = vec![0u64; words + 1];
        for i in 0..map.dims[0] {
            for j in 0..map.dims[1] {
                let mut below = 0;
                for (differ, bits) in differ.iter_mut().zip(map.column(i, j)) {
                    *differ |= bits ^ (bits << 1 | below);
                    below = bits >> 63;
                }
                differ[words] |= below;
            }
        }
        let differs = |k: usize| differ[k / 64] >> (k % 64) & 1 != 0;
        let (mut rows, mut of) = (vec![0], vec![0]);
        for k in 1..=map.dims[2] {
            // Node k lies between cells k - 1 and k.
            if differs(k) || differs(k - 1) {
                rows.push(k);
            }
            of.push(rows.len() - 1);
        }
        Self { rows, of }
    }
}

/// Parts of slabs along y: part p holds nodes `along_y[p]`, level by level, where a slab of one part would hold them.
#[derive(Clone)]
struct Parts {
    along_y: Vec<Range<usize>>,
    levels: usize,
}

impl Parts {
    fn new(ny: usize, levels: usize, threads: usize) -> Self {
        Self { along_y: shares(ny, threads, LANES), levels }
    }

    /// Where in a slab part p lies.
    fn range(&self, p: usize) -> Range<usize> {
        self.along_y[p].start * self.levels..self.along_y[p].end * self.levels
    }
}

/// Splits `0..n` evenly into at most `threads` ranges, which begin at whole multiples of `grain`; none is empty.
fn shares(n: usize, threads: usize, grain: usize) -> Vec<Range<usize>> {
    let threads = threads.clamp(1, n.div_ceil(grain).max(1));
    let end = |t: usize| if t == threads { n } else { n * t / threads / grain * grain };
    (0..threads).map(|t| end(t)..end(t + 1)).filter(|share| !share.is_empty()).collect()
}

/// What the pass forwards found in one part of all slabs.
struct Forwards {
    /// Whether a slab holds a node inside a solid there.
    solids: Vec<bool>,
    /// Of each share of slabs but the last: the steps backwards at the first slab behind it.
    after: Vec<Vec<f32>>,
}

/// Steps forwards, into `values`.
fn sweep_forwards(
    map: &VoxelMap,
    levels: &Levels,
    parts: &Parts,
    shares: &[Range<usize>],
    values: &mut [f32],
) -> Vec<Forwards> {
    let nz = map.dims[2] + 1;
    let size = (map.dims[1] + 1) * nz;
    let mut columns: Vec<Vec<&mut [f32]>> =
        parts.along_y.iter().map(|_| Vec::with_capacity(values.len() / size)).collect();
    for slab in values.chunks_exact_mut(size) {
        let mut rest = slab;
        for (p, column) in columns.iter_mut().enumerate() {
            let (own, others) = rest.split_at_mut(parts.range(p).len());
            column.push(own);
            rest = others;
        }
    }
    let sweep = |p: usize, mut slabs: Vec<&mut [f32]>| {
        let along_y = parts.along_y[p].clone();
        let (ny, mut kinds) = (along_y.len(), Kinds::new(along_y, nz));
        let mut solids = vec![false; slabs.len()];
        for (i, solid) in solids.iter_mut().enumerate() {
            *solid = kinds.read(map, i);
            let (done, slab) = slabs.split_at_mut(i);
            for (level, k) in levels.rows.iter().enumerate() {
                let row = level * ny..(level + 1) * ny;
                step(&mut slab[0][row.clone()], kinds.row(*k), done.last().map(|before| &before[row]));
            }
        }
        let mut after = vec![Vec::new(); shares.len() - 1];
        let first = shares.iter().map(|share| share.end).find(|end| *end < slabs.len());
        if let Some(first) = first {
            let mut steps: Vec<f32> = slabs[slabs.len() - 1].iter().map(|steps| steps * NEVER).collect();
            for i in (first..slabs.len()).rev() {
                if i + 1 < slabs.len() {
                    step_back(slabs[i], &mut steps);
                }
                if let Some(share) = shares.iter().position(|share| share.end == i) {
                    after[share].clone_from(&steps);
                }
            }
        }
        Forwards { solids, after }
    };
    let tasks = columns.into_iter().enumerate().map(|(p, slabs)| move || sweep(p, slabs));
    each_in_a_thread(tasks.collect())
}

/// Runs all, the first one here; their results in order.
fn each_in_a_thread<T: Send>(tasks: Vec<impl FnOnce() -> T + Send>) -> Vec<T> {
    std::thread::scope(|scope| {
        let mut tasks = tasks.into_iter();
        let here = tasks.next();
        let others: Vec<_> = tasks.map(|task| scope.spawn(task)).collect();
        let first = here.map(|task| task());
        let join = |other: std::thread::ScopedJoinHandle<'_, T>| match other.join() {
            Ok(result) => result,
            Err(panic) => std::panic::resume_unwind(panic),
        };
        first.into_iter().chain(others.into_iter().map(join)).collect()
    })
}

/// Steps since the last node of another kind, signed: > 0 for free nodes, < 0 for nodes inside, 0 on surfaces.
#[inline(never)]
fn step(row: &mut [f32], kinds: impl Iterator<Item = f32>, before: Option<&[f32]>) {
    match before {
        None => row.iter_mut().zip(kinds).for_each(|(steps, kind)| *steps = kind * NEVER),
        Some(before) => {
            for ((steps, kind), before) in row.iter_mut().zip(kinds).zip(before) {
                let same = kind * before;
                *steps = kind * (if same > 0.0 { same } else { 0.0 } + 1.0);
            }
        }
    }
}

/// The same from the other side. The kinds are the signs of the steps forwards.
#[inline(never)]
fn step_back(forwards: &[f32], after: &mut [f32]) {
    for (after, forwards) in after.iter_mut().zip(forwards) {
        let kind = forwards.clamp(-1.0, 1.0);
        let same = kind * *after;
        *after = kind * (if same > 0.0 { same } else { 0.0 } + 1.0);
    }
}

/// The passes along y and z, and their memory.
struct Slabs {
    lines: Lines,
    parts: Parts,
    size: [usize; 2],
    stride: usize,
    resolution: f32,
    /// Squared distances of the levels, then of all rows.
    along_x: Vec<f32>,
    squares: Vec<f32>,
    metres: Vec<f32>,
    /// Distance to the grid's edges along y, cells.
    edges: Vec<f32>,
    /// Distance to the grid's edges in this slab, m.
    bounds: Vec<f32>,
}

impl Slabs {
    fn new(map: &VoxelMap, levels: &Levels, parts: Parts) -> Self {
        let [ny, nz] = [map.dims[1] + 1, map.dims[2] + 1];
        let stride = ny.next_multiple_of(LANES);
        // Infinite where the edge is no wall.
        let walled = map.outside == Unknown::Occupied;
        let edge = |j: usize| if walled { j.min(ny - 1 - j) as f32 } else { f32::INFINITY };
        let edges: Vec<f32> = (0..ny).map(edge).collect();
        let squares = vec![0.0; stride * nz];
        Self {
            lines: Lines::new(ny, &levels.of),
            parts,
            size: [ny, nz],
            stride,
            resolution: map.resolution as f32,
            along_x: vec![0.0; stride * levels.rows.len()],
            metres: squares.clone(),
            squares,
            bounds: edges.clone(),
            edges,
        }
    }

    /// Distance to the nearest site and, where `edge` is finite, to the grid's edge; `edge` is that along x, cells.
    fn outside(&mut self, forwards: &[f32], after: &[f32], edge: f32) {
        self.squares(forwards, after, 1.0);
        self.lines.transform(&mut self.along_x, &mut self.squares);
        for (bound, along) in self.bounds.iter_mut().zip(&self.edges) {
            *bound = if *along < edge { *along } else { edge } * self.resolution;
        }
        let rows = self.metres.chunks_exact_mut(self.stride).zip(self.squares.chunks_exact(self.stride));
        rows.for_each(|(metres, squares)| to_metres(metres, squares, &self.bounds, self.resolution));
    }

    /// Subtracts the depth of the nodes inside: the distance to the nearest node that is not.
    fn inside(&mut self, forwards: &[f32], after: &[f32]) {
        self.squares(forwards, after, -1.0);
        self.lines.transform(&mut self.along_x, &mut self.squares);
        subtract_depth(&mut self.metres, &self.squares, self.resolution);
    }

    /// Squared distance along x for the nodes whose steps have this sign, 0 for all others.
    fn squares(&mut self, forwards: &[f32], after: &[f32], sign: f32) {
        for (p, along_y) in self.parts.along_y.iter().enumerate() {
            let (part, length) = (self.parts.range(p), along_y.len());
            let steps = forwards[part.clone()].chunks_exact(length).zip(after[part].chunks_exact(length));
            for (row, (forwards, after)) in self.along_x.chunks_exact_mut(self.stride).zip(steps) {
                nearest(&mut row[along_y.clone()], forwards, after, sign);
            }
        }
    }

    /// To the layout of the field: z fastest.
    fn write(&self, slab: &mut [f32]) {
        for (j, column) in slab.chunks_exact_mut(self.size[1]).enumerate() {
            for (value, metres) in column.iter_mut().zip(self.metres[j..].iter().step_by(self.stride)) {
                *value = *metres;
            }
        }
    }
}

#[inline(never)]
fn nearest(squares: &mut [f32], forwards: &[f32], after: &[f32], sign: f32) {
    for ((square, forwards), after) in squares.iter_mut().zip(forwards).zip(after) {
        let (forwards, after) = (sign * forwards, sign * after);
        let steps = if forwards < after { forwards } else { after };
        let steps = if steps > 0.0 { steps } else { 0.0 };
        *square = steps * steps;
    }
}

#[inline(never)]
fn to_metres(metres: &mut [f32], squares: &[f32], bounds: &[f32], resolution: f32) {
    for ((metres, square), bound) in metres.iter_mut().zip(squares).zip(bounds) {
        let distance = if *square >= NONE { FAR } else { square.sqrt() * resolution };
        *metres = if distance < *bound { distance } else { *bound };
    }
}

#[inline(never)]
fn subtract_depth(metres: &mut [f32], squares: &[f32], resolution: f32) {
    for (metres, square) in metres.iter_mut().zip(squares) {
        *metres -= if *square >= NONE { FAR } else { square.sqrt() * resolution };
    }
}
