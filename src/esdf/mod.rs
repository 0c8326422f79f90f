//! Stage 4: signed distance to the obstacles' *surface* (the cubes of the occupied cells), on the lattice of cell corners.
//!
//! `MATH` section 4: the corners of occupied cubes are the sites of an exact Euclidean distance transform over the lattice of
//! cell corners. The nearest point of a cube to a lattice node is always a lattice node, so the values are the exact distance
//! to the union of the cubes, not to the cells' centres. Inside, the corners of free cubes are the sites.

mod columns;
mod interpolate;
mod kinds;
mod levels;
mod line;
#[cfg(test)]
mod reference;
mod transform;

use crate::map::VoxelMap;
use crate::mission::Unknown;

pub use interpolate::least_of_points;

/// Signed Euclidean distance at the corners of the map's cells, m. Node (i, j, k) lies at
/// `origin + resolution * (i, j, k)`; there are `dims + 1` nodes along each axis of the map.
#[derive(Clone)]
pub struct Esdf {
    pub(crate) resolution: f64,
    inverse_resolution: f64,
    /// Index of the last node along each axis.
    last: [f64; 3],
    pub(crate) origin: [f64; 3],
    pub(crate) nodes: [usize; 3],
    /// Whether space beyond the grid in x and y is an obstacle.
    pub(crate) outside: Unknown,
    /// Node (i, j, k) at `(i * nodes[1] + j) * nodes[2] + k`.
    pub(crate) values: Vec<f32>,
}

/// A distance that no obstacle is near enough to bound, m: what an empty map returns.
pub const FAR: f32 = 1.0e4;

/// Builds the field of a map: exact at every node, O(number of nodes).
pub fn build(map: &VoxelMap) -> Esdf {
    build_in_threads(map, 1)
}

/// Builds the field of a map with so many threads, the caller's among them (0 counts as 1). The result is the same, byte for byte,
/// for any number; below some ten million nodes one thread is nearly as fast.
pub fn build_in_threads(map: &VoxelMap, threads: usize) -> Esdf {
    let nodes = map.dims.map(|d| d + 1);
    let values = transform::signed_distance(map, nodes, threads);
    let inverse_resolution = 1.0 / map.resolution;
    let last = map.dims.map(|d| d as f64);
    Esdf {
        resolution: map.resolution,
        inverse_resolution,
        last,
        origin: map.origin,
        nodes,
        outside: map.outside,
        values,
    }
}

impl Esdf {
    /// Side of a cell, m.
    pub fn resolution(&self) -> f64 {
        self.resolution
    }

    /// The same field with every distance less by what `by` says of its place in x and y, m: obstacles that count as nearer there.
    #[must_use]
    pub fn lowered(&self, by: impl Fn([f64; 2]) -> f64) -> Self {
        let mut out = self.clone();
        let along_z = self.nodes[2].max(1);
        for (column, values) in out.values.chunks_exact_mut(along_z).enumerate() {
            let [i, j] = [column / self.nodes[1], column % self.nodes[1]];
            let place = [(0, i), (1, j)].map(|(axis, k)| self.origin[axis] + self.resolution * k as f64);
            let less = by(place) as f32;
            values.iter_mut().for_each(|value| *value -= less);
        }
        out
    }

    /// Value at a node: exact distance, m.
    pub fn at_node(&self, node: [usize; 3]) -> f64 {
        f64::from(self.values[(node[0] * self.nodes[1] + node[1]) * self.nodes[2] + node[2]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;
    use proptest::prelude::*;

    fn random_map(dims: [usize; 3], cells: &[usize], outside: Unknown) -> VoxelMap {
        let mut map = VoxelMap::new(0.25, [-1.0, 2.0, 0.5], dims, outside);
        let total = dims[0] * dims[1] * dims[2];
        for cell in cells.iter().map(|c| c % total) {
            map.occupy([cell / (dims[1] * dims[2]), cell / dims[2] % dims[1], cell % dims[2]]);
        }
        map
    }

    fn cubes(map: &VoxelMap, occupied: bool) -> Vec<crate::geom::Aabb> {
        let [nx, ny, nz] = map.dims;
        let cells = (0..nx).flat_map(|i| (0..ny).flat_map(move |j| (0..nz).map(move |k| [i, j, k])));
        cells.filter(|c| map.occupied(*c) == occupied).map(|c| map.cube(c)).collect()
    }

    /// Signed distance from a point of the grid by looking at every cube. Space above and below the grid is free.
    fn brute_force(map: &VoxelMap, p: [f64; 3]) -> f64 {
        let p3 = Point3::from(p);
        let out = cubes(map, true).iter().map(|c| c.distance(&p3)).fold(f64::INFINITY, f64::min);
        let bounds = map.bounds();
        let edge = (0..2).map(|a| (p[a] - bounds.min[a]).min(bounds.max[a] - p[a])).fold(f64::INFINITY, f64::min);
        let mut inside = cubes(map, false).iter().map(|c| c.distance(&p3)).fold(f64::INFINITY, f64::min);
        inside = inside.min(p[2] - bounds.min[2]).min(bounds.max[2] - p[2]);
        if map.outside == Unknown::Occupied {
            out.min(edge) - if out > 0.0 { 0.0 } else { inside }
        } else {
            out - if out > 0.0 { 0.0 } else { inside.min(edge) }
        }
    }

    proptest! {
        #[test]
        fn every_node_equals_brute_force(
            dims in (1usize..7, 1usize..7, 1usize..7), cells in prop::collection::vec(any::<usize>(), 1..150),
            occupied in any::<bool>(),
        ) {
            let outside = if occupied { Unknown::Occupied } else { Unknown::Free };
            let map = random_map([dims.0, dims.1, dims.2], &cells, outside);
            let field = build(&map);
            for i in 0..=dims.0 { for j in 0..=dims.1 { for k in 0..=dims.2 {
                let p = [0, 1, 2].map(|a| map.origin[a] + map.resolution * [i, j, k][a] as f64);
                let expected = brute_force(&map, p);
                let found = field.at_node([i, j, k]);
                prop_assert!((found - expected).abs() < 1e-5, "node {i} {j} {k}: {found} vs {expected}");
                prop_assert!((field.distance(p) - expected).abs() < 1e-5);
            }}}
        }

        #[test]
        fn interpolation_stays_within_its_stated_loss_and_its_gradient_matches(
            cells in prop::collection::vec(any::<usize>(), 1..20), u in prop::array::uniform3(-0.4f64..1.4),
        ) {
            let map = random_map([6, 5, 4], &cells, Unknown::Free);
            let field = build(&map);
            let bounds = map.bounds();
            let p = [0, 1, 2].map(|a| bounds.min[a] + u[a] * (bounds.max[a] - bounds.min[a]));
            let inside = u.iter().all(|v| (0.0..=1.0).contains(v));
            let out = cubes(&map, true).iter().map(|c| c.distance(&Point3::from(p))).fold(f64::INFINITY, f64::min);
            let (value, gradient) = field.distance_gradient(p);
            prop_assert_eq!(value, field.distance(p));
            prop_assert!(value <= out + 0.87 * map.resolution, "{} of {}", value, out);
            if inside && out > 0.0 {
                prop_assert!(value >= out - 0.87 * map.resolution);
            }
            for (p, origin) in p.iter().zip(map.origin) {
                // away from the cell faces, where the gradient jumps
                let fraction = ((p - origin) / map.resolution).fract().abs();
                prop_assume!(fraction > 1e-4 && fraction < 1.0 - 1e-4);
            }
            let h = 1e-6;
            for a in 0..3 {
                let (mut low, mut high) = (p, p);
                low[a] -= h;
                high[a] += h;
                let numeric = (field.distance(high) - field.distance(low)) / (2.0 * h);
                prop_assert!((numeric - gradient[a]).abs() < 1e-4, "axis {a}: {} vs {numeric}", gradient[a]);
            }
        }
    }

    /// A map of upright boxes, single cells and holes; wide enough for long envelopes, and any height.
    fn assert_like_reference(dims: [usize; 3], seed: u64, boxes: usize, cells: usize, outside: Unknown) {
        let mut map = VoxelMap::new(0.25, [0.0; 3], dims, outside);
        let mut state = seed | 1;
        let mut below = |limit: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize % limit
        };
        for _ in 0..boxes {
            let low = dims.map(&mut below);
            let high = [0, 1, 2].map(|a| low[a] + 1 + below(dims[a] / 3 + 1));
            for i in low[0]..high[0].min(dims[0]) {
                for j in low[1]..high[1].min(dims[1]) {
                    (low[2]..high[2].min(dims[2])).for_each(|k| map.occupy([i, j, k]));
                }
            }
        }
        (0..cells).for_each(|_| map.occupy(dims.map(&mut below)));
        let nodes = dims.map(|d| d + 1);
        let expected = reference::signed_distance(&map, nodes);
        let found = transform::signed_distance(&map, nodes, 1);
        for threads in [2, 3] {
            let same = transform::signed_distance(&map, nodes, threads);
            let bits = |values: &[f32]| values.iter().map(|v| v.to_bits()).collect::<Vec<u32>>();
            assert!(bits(&same) == bits(&found), "{dims:?} by {threads} threads");
        }
        for (at, (found, expected)) in found.iter().zip(&expected).enumerate() {
            // Metres from squares in f32 here, in f64 there: roots and product round once each.
            assert!((found - expected).abs() <= 2.5e-7 * expected.abs(), "{dims:?} node {at}: {found} vs {expected}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn the_transform_equals_the_plain_one(
            dims in (1usize..90, 1usize..90, 1usize..40), seed in any::<u64>(), boxes in 0usize..12, cells in 0usize..40,
            occupied in any::<bool>(),
        ) {
            let outside = if occupied { Unknown::Occupied } else { Unknown::Free };
            assert_like_reference([dims.0, dims.1, dims.2], seed, boxes, cells, outside);
        }
    }

    #[test]
    fn heights_around_a_word_and_beyond_the_window_equal_the_plain_transform() {
        for (seed, nz) in [31, 32, 63, 64, 65, 127, 128, 129, 200].into_iter().enumerate() {
            for outside in [Unknown::Free, Unknown::Occupied] {
                assert_like_reference([9, 20, nz], seed as u64, 4, 3, outside);
                assert_like_reference([5, 17, nz], seed as u64, 40, 0, outside);
            }
        }
    }

    #[test]
    fn wide_halls_with_few_and_with_many_boxes_equal_the_plain_transform() {
        for (seed, boxes) in [1, 3, 9, 27].into_iter().enumerate() {
            assert_like_reference([40, 300, 12], seed as u64, boxes, 2, Unknown::Free);
            assert_like_reference([300, 40, 70], seed as u64, boxes, 0, Unknown::Occupied);
        }
    }

    #[test]
    fn full_and_dense_maps_equal_the_plain_transform() {
        for outside in [Unknown::Free, Unknown::Occupied] {
            assert_like_reference([40, 50, 20], 3, 0, 40_000, outside);
            assert_like_reference([40, 50, 20], 4, 0, 400_000, outside);
            assert_like_reference([70, 40, 10], 5, 400, 0, outside);
        }
    }

    #[test]
    fn an_empty_map_is_far_from_everything_but_its_edge() {
        let free = build(&VoxelMap::new(0.1, [0.0; 3], [4, 4, 4], Unknown::Free));
        assert_eq!(free.distance([0.2, 0.2, 0.2]), f64::from(FAR));
        let walled = build(&VoxelMap::new(0.1, [0.0; 3], [40, 40, 4], Unknown::Occupied));
        assert!((walled.distance([0.5, 2.0, 0.2]) - 0.5).abs() < 1e-6);
        assert!((walled.distance([-0.3, 2.0, 0.2]) + 0.3).abs() < 1e-6);
    }

    proptest! {
        #[test]
        fn the_least_of_a_line_is_that_of_its_points_but_for_interpolation(
            cells in proptest::collection::vec(0..2000usize, 1..30),
            at in proptest::array::uniform2(0.02..0.98f64),
            foot in -0.5..1.3f64,
            rise in 0.01..1.5f64,
        ) {
            let map = random_map([9, 8, 7], &cells, Unknown::Free);
            let field = build(&map);
            let bounds = map.bounds();
            let place = |a: usize| bounds.min[a] + at[a] * (bounds.max[a] - bounds.min[a]);
            let foot = [place(0), place(1), bounds.min[2] + foot];
            let (least, gradient) = field.least_above(foot, rise);
            let along = |k: usize| field.distance([foot[0], foot[1], foot[2] + rise * k as f64 / 400.0]);
            let points = (0..=400).map(along).fold(f64::INFINITY, f64::min);
            // Never above; below by what bilinear values of minima may differ from minima of trilinear values, and rounding to f32.
            prop_assert!(least < points + 1e-6, "{least} {points}");
            prop_assert!(least > points - 0.71 * field.resolution, "{least} {points}");
            let step = 1e-6;
            for axis in 0..2 {
                // Within a cell: the gradient jumps between cells.
                let mut moved = foot;
                moved[axis] += step;
                let cell = |p: [f64; 3]| ((p[axis] - field.origin[axis]) / field.resolution).floor();
                let on = foot[2] + rise > field.origin[2] && foot[2] < field.origin[2] + field.last[2] * field.resolution;
                if cell(moved) == cell(foot) && on {
                    let numeric = (field.least_above(moved, rise).0 - least) / step;
                    prop_assert!((numeric - gradient[axis]).abs() < 1e-3, "{numeric} {gradient:?}");
                }
            }
        }
    }
}
