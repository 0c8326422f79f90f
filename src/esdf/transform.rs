//! The exact distance transform: squared distance to the nearest site is separable, one pass per axis.
//!
//! Along x a site is a bit, so the first pass counts steps from slab to slab (a slab: all nodes of one i), forwards into the
//! result itself and backwards in one slab of memory. What is left is a matter of each slab alone, held in the cache. Within a
//! slab y is fastest: row k holds the nodes (k, 0..ny), padded to whole blocks of `LANES`, so that loops over rows are loops
//! over blocks. Those loops are functions that are never inlined: only so does the compiler know that their rows do not
//! overlap, and takes four nodes at once.
//!
//! Squared distances are whole numbers in f32: exact up to 4096 cells, within rounding beyond.

use super::FAR;
use super::kinds::Kinds;
use super::line::{LANES, Lines, NONE};
use crate::map::VoxelMap;
use crate::mission::Unknown;

/// Steps of a node with no site on its line; one more is lost in rounding. (2^24; its square is above `NONE`.)
const NEVER: f32 = 16_777_216.0;

/// Signed distances (m) at all nodes.
pub(super) fn signed_distance(map: &VoxelMap, nodes: [usize; 3]) -> Vec<f32> {
    let [nx, ny, nz] = nodes;
    let size = ny * nz;
    let mut values = vec![0.0f32; nx * size];
    let mut kinds = Kinds::new(nodes);
    let mut solids = vec![false; nx];
    for i in 0..nx {
        solids[i] = kinds.read(map, i);
        let (done, slab) = values.split_at_mut(i * size);
        for k in 0..nz {
            let row = &mut slab[k * ny..][..ny];
            let before = if i == 0 { None } else { Some(&done[(i - 1) * size + k * ny..][..ny]) };
            step(row, kinds.row(k), before);
        }
    }
    let mut slabs = Slabs::new(map, [ny, nz]);
    let mut after = vec![0.0; size];
    for i in (0..nx).rev() {
        let slab = &mut values[i * size..][..size];
        if i + 1 == nx {
            after.iter_mut().zip(&*slab).for_each(|(after, forwards)| *after = forwards * NEVER);
        } else {
            step_back(slab, &mut after);
        }
        let edge = if map.outside == Unknown::Occupied { i.min(nx - 1 - i) as f32 } else { f32::INFINITY };
        slabs.outside(slab, &after, edge);
        if solids[i] {
            slabs.inside(slab, &after);
        }
        slabs.write(slab);
    }
    values
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
    size: [usize; 2],
    stride: usize,
    resolution: f32,
    squares: Vec<f32>,
    metres: Vec<f32>,
    /// Distance to the grid's edges along y, cells.
    edges: Vec<f32>,
    /// Distance to the grid's edges in this slab, m.
    bounds: Vec<f32>,
}

impl Slabs {
    fn new(map: &VoxelMap, [ny, nz]: [usize; 2]) -> Self {
        let stride = ny.next_multiple_of(LANES);
        // Infinite where the edge is no wall.
        let walled = map.outside == Unknown::Occupied;
        let edge = |j: usize| if walled { j.min(ny - 1 - j) as f32 } else { f32::INFINITY };
        let edges: Vec<f32> = (0..ny).map(edge).collect();
        let squares = vec![0.0; stride * nz];
        let metres = squares.clone();
        Self {
            lines: Lines::new([ny, nz]),
            size: [ny, nz],
            stride,
            resolution: map.resolution as f32,
            squares,
            metres,
            bounds: edges.clone(),
            edges,
        }
    }

    /// Distance to the nearest site and, where `edge` is finite, to the grid's edge; `edge` is that along x, cells.
    fn outside(&mut self, forwards: &[f32], after: &[f32], edge: f32) {
        self.squares(forwards, after, 1.0);
        self.lines.transform(&mut self.squares);
        for (bound, along) in self.bounds.iter_mut().zip(&self.edges) {
            *bound = if *along < edge { *along } else { edge } * self.resolution;
        }
        let rows = self.metres.chunks_exact_mut(self.stride).zip(self.squares.chunks_exact(self.stride));
        rows.for_each(|(metres, squares)| to_metres(metres, squares, &self.bounds, self.resolution));
    }

    /// Subtracts the depth of the nodes inside: the distance to the nearest node that is not.
    fn inside(&mut self, forwards: &[f32], after: &[f32]) {
        self.squares(forwards, after, -1.0);
        self.lines.transform(&mut self.squares);
        subtract_depth(&mut self.metres, &self.squares, self.resolution);
    }

    /// Squared distance along x for the nodes whose steps have this sign, 0 for all others.
    fn squares(&mut self, forwards: &[f32], after: &[f32], sign: f32) {
        let ny = self.size[0];
        let steps = forwards.chunks_exact(ny).zip(after.chunks_exact(ny));
        for (row, (forwards, after)) in self.squares.chunks_exact_mut(self.stride).zip(steps) {
            nearest(&mut row[..ny], forwards, after, sign);
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
