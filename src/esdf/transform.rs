//! The exact distance transform: squared distance to the nearest site is separable, one pass per axis.
//!
//! Along x a site is a bit, so the first pass counts steps from slab to slab (a slab: all nodes of one i), forwards into the
//! result itself and backwards in one slab of memory. What is left is a matter of each slab alone, held in the cache. Within a
//! slab y is fastest: row k holds the nodes (k, 0..ny), padded to whole blocks of `LANES`, so that loops over rows are loops
//! over blocks. Those loops are functions that are never inlined: only so does the compiler know that their rows do not
//! overlap, and takes four nodes at once. Rows that are alike in the whole map are one up to there (`levels`); the passes along z
//! are the first to tell them apart.
//!
//! With several threads each has a part of every slab, by y, for the pass forwards, which goes through all slabs; and then some
//! of the slabs, all of each. What the pass backwards has counted where a thread's slabs begin is found out in between, as that
//! is again a matter of lines along x. Every node is computed as by one thread: the bytes are the same.
//!
//! Squared distances are whole numbers in f32: exact up to 4096 cells, within rounding beyond.

use std::ops::Range;

use super::FAR;
use super::kinds::Kinds;
use super::levels::Levels;
use super::line::{LANES, Lines, NONE};
use crate::map::VoxelMap;
use crate::mission::Unknown;

/// Steps of a node with no site on its line; one more is lost in rounding. (2^24; its square is above `NONE`.)
const NEVER: f32 = 16_777_216.0;

/// Nodes along y and rows that are turned to the layout of the field together.
const TILE: usize = 4;
type Tile = [f32; TILE];

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
            inner.outside(&slab[..known], &after);
            let depths = if solids[i] { inner.inside(&slab[..known], &after) } else { 0..0 };
            inner.write(slab, edge, depths);
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
    depths: Vec<f32>,
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
        let edges: Vec<f32> = (0..stride).map(|j| edge(j.min(ny - 1))).collect();
        let squares = vec![0.0; stride * nz];
        Self {
            lines: Lines::new(ny, &levels.of),
            parts,
            size: [ny, nz],
            stride,
            resolution: map.resolution as f32,
            along_x: vec![0.0; stride * levels.rows.len()],
            depths: squares.clone(),
            squares,
            bounds: edges.clone(),
            edges,
        }
    }

    /// Squared distance to the nearest site.
    fn outside(&mut self, forwards: &[f32], after: &[f32]) {
        self.along_x(forwards, after, 1.0);
        self.lines.transform(&mut self.along_x, &mut self.squares);
    }

    /// Squared depth of the nodes inside: to the nearest node that is not. All of them are in these rows.
    fn inside(&mut self, forwards: &[f32], after: &[f32]) -> Range<usize> {
        self.along_x(forwards, after, -1.0);
        let mut levels = self.along_x.chunks_exact(self.stride).map(any_above_zero);
        let first = levels.position(|deep| deep).unwrap_or(0);
        let last = levels.rposition(|deep| deep).map_or(first, |more| first + 1 + more);
        self.lines.transform(&mut self.along_x, &mut self.depths);
        let levels = self.lines.level_of();
        levels.partition_point(|level| *level < first)..levels.partition_point(|level| *level <= last)
    }

    /// Squared distance along x for the nodes whose steps have this sign, 0 for all others.
    fn along_x(&mut self, forwards: &[f32], after: &[f32], sign: f32) {
        for (p, along_y) in self.parts.along_y.iter().enumerate() {
            let (part, length) = (self.parts.range(p), along_y.len());
            let steps = forwards[part.clone()].chunks_exact(length).zip(after[part].chunks_exact(length));
            for (row, (forwards, after)) in self.along_x.chunks_exact_mut(self.stride).zip(steps) {
                nearest(&mut row[along_y.clone()], forwards, after, sign);
            }
        }
    }

    /// Metres, in the layout of the field: z fastest. `edge`: distance to the grid's edge along x, cells, or infinite.
    fn write(&mut self, slab: &mut [f32], edge: f32, depths: Range<usize>) {
        let [ny, nz] = self.size;
        for (bound, along) in self.bounds.iter_mut().zip(&self.edges) {
            *bound = if *along < edge { *along } else { edge } * self.resolution;
        }
        for (k, row) in self.squares.chunks_exact_mut(self.stride).enumerate() {
            to_metres(row, &self.bounds, self.resolution);
            if depths.contains(&k) {
                subtract_depth(row, &self.depths[k * self.stride..][..self.stride], self.resolution);
            }
        }
        let metres = |k: usize, at: usize| -> Tile {
            self.squares[k * self.stride + at..][..TILE].try_into().expect("as long as a tile")
        };
        for (columns, at) in slab.chunks_mut(TILE * nz).zip((0..).step_by(TILE)) {
            let whole = if at + TILE <= ny { nz / TILE * TILE } else { 0 };
            for k in (0..whole).step_by(TILE) {
                let [a, b, c, d] = [metres(k, at), metres(k + 1, at), metres(k + 2, at), metres(k + 3, at)];
                columns[k..][..TILE].copy_from_slice(&[a[0], b[0], c[0], d[0]]);
                columns[nz + k..][..TILE].copy_from_slice(&[a[1], b[1], c[1], d[1]]);
                columns[2 * nz + k..][..TILE].copy_from_slice(&[a[2], b[2], c[2], d[2]]);
                columns[3 * nz + k..][..TILE].copy_from_slice(&[a[3], b[3], c[3], d[3]]);
            }
            for k in whole..nz {
                let metres = metres(k, at);
                columns.chunks_exact_mut(nz).zip(metres).for_each(|(column, metres)| column[k] = metres);
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
fn to_metres(squares: &mut [f32], bounds: &[f32], resolution: f32) {
    for (value, bound) in squares.iter_mut().zip(bounds) {
        let distance = if *value >= NONE { FAR } else { value.sqrt() * resolution };
        *value = if distance < *bound { distance } else { *bound };
    }
}

#[inline(never)]
fn subtract_depth(metres: &mut [f32], squares: &[f32], resolution: f32) {
    for (metres, square) in metres.iter_mut().zip(squares) {
        *metres -= if *square >= NONE { FAR } else { square.sqrt() * resolution };
    }
}

/// Whether a square is not 0; without an early end, so that it runs in blocks.
#[inline(never)]
fn any_above_zero(squares: &[f32]) -> bool {
    squares.iter().fold(0, |any, square| any | square.to_bits()) != 0
}
