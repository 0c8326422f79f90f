use proptest::prelude::*;

use super::*;
use crate::geom::Aabb;
use crate::mission::KeepOut;
use std::path::PathBuf;

fn spec(keep_out: Vec<KeepOut>, boxes: Vec<Aabb>) -> MapSpec {
    let file = PathBuf::from("map");
    let (resolution, origin, height, unknown) = (None, None, Some([0.0, 1.0]), Unknown::Occupied);
    MapSpec { file, resolution, height, unknown, origin, keep_out, boxes, speed_zones: vec![] }
}

/// A room of 4 x 3 m in cells of 10 cm with its corner at (-1, 2), one layer high from z 0.
fn room(outside: Unknown) -> VoxelMap {
    VoxelMap::new(0.1, [-1.0, 2.0, 0.0], [40, 30, 1], outside)
}

fn with(map: VoxelMap, keep_out: Vec<KeepOut>, boxes: Vec<Aabb>) -> VoxelMap {
    added(map, &spec(keep_out, boxes), Slab { low: 0.02, high: 1.0 }, 0.55).expect("not large")
}

fn area(polygon: &[[f64; 2]]) -> KeepOut {
    KeepOut { polygon: polygon.to_vec(), height: None }
}

#[test]
fn a_rectangle_on_the_grid_occupies_its_own_cells_and_no_neighbours() {
    let map = with(room(Unknown::Occupied), vec![area(&[[0.0, 2.5], [0.3, 2.5], [0.3, 2.7], [0.0, 2.7]])], vec![]);
    assert_eq!((map.dims, map.occupied_count(), map.statistics.added), ([40, 30, 6], 3 * 2 * 6, 36));
    assert!(map.occupied([10, 5, 0]) && map.occupied([12, 6, 5]));
    assert!(!map.occupied([9, 5, 0]) && !map.occupied([13, 5, 0]) && !map.occupied([10, 7, 0]));
}

#[test]
fn a_wall_thinner_than_a_cell_is_a_wall() {
    let slanted = area(&[[-0.93, 2.07], [2.81, 4.63], [2.81, 4.632]]);
    let map = with(room(Unknown::Occupied), vec![slanted], vec![]);
    for k in 0..=1000 {
        let share = f64::from(k) / 1000.0;
        let (x, y) = (-0.93 + share * 3.74, 2.07 + share * 2.56);
        let cell = [((x + 1.0) / 0.1) as usize, ((y - 2.0) / 0.1) as usize, 3];
        assert!(map.occupied(cell), "({x}, {y})");
    }
}

#[test]
fn the_grid_grows_to_what_lies_above_it_and_beyond_it_where_beyond_is_free() {
    let high = Aabb { min: [0.0, 2.5, 0.75], max: [0.1, 2.6, 0.85] };
    let far = Aabb { min: [4.0, 2.5, 0.0], max: [4.1, 2.6, 0.1] };
    let closed = with(room(Unknown::Occupied), vec![], vec![high, far]);
    assert_eq!((closed.dims, closed.occupied_count()), ([40, 30, 9], 2));
    assert!(closed.occupied([10, 5, 7]) && closed.occupied([10, 5, 8]));
    let open = with(room(Unknown::Free), vec![], vec![high, far]);
    assert_eq!((open.dims, open.occupied_count()), ([51, 30, 9], 3));
    assert!(open.occupied([50, 5, 0]));
    let below = Aabb { min: [-2.0, 1.0, -0.3], max: [-1.9, 1.1, -0.2] };
    let open = with(open, vec![], vec![below]);
    assert_eq!((open.dims, open.occupied_count()), ([61, 40, 12], 4));
    assert!(open.occupied([20, 15, 10]), "cells of before keep their place");
}

#[test]
fn what_a_polygon_winds_around_belongs_to_it_however_its_sides_cross() {
    // A figure of eight, and a square that is run around twice.
    let eight = area(&[[-0.5, 2.5], [0.5, 3.5], [0.5, 2.5], [-0.5, 3.5]]);
    let twice: Vec<[f64; 2]> = [[1.0, 3.0], [2.0, 3.0], [2.0, 4.0], [1.0, 4.0]].repeat(2);
    let map = with(room(Unknown::Occupied), vec![eight, area(&twice)], vec![]);
    assert!(map.occupied([6, 10, 0]) && map.occupied([14, 10, 0]), "both lobes");
    assert!(!map.occupied([10, 6, 0]) && !map.occupied([10, 13, 0]), "not above and below the crossing");
    assert!(map.occupied([25, 15, 0]));
}

#[test]
fn a_grid_that_would_be_too_large_is_refused() {
    let far = Aabb { min: [9e5, 9e5, 0.0], max: [9.1e5, 9.1e5, 1.0] };
    let slab = Slab { low: 0.02, high: 1.0 };
    assert!(added(room(Unknown::Free), &spec(vec![], vec![far]), slab, 0.5).is_err());
    assert_eq!(with(room(Unknown::Occupied), vec![], vec![far]), room(Unknown::Occupied), "an obstacle already");
}

/// Area of a convex polygon within a square, m^2: clipped side by side (Sutherland and Hodgman).
fn overlap(polygon: &[[f64; 2]], low: [f64; 2], high: [f64; 2]) -> f64 {
    let mut clipped = polygon.to_vec();
    for (axis, bound, sign) in [(0, low[0], 1.0), (0, high[0], -1.0), (1, low[1], 1.0), (1, high[1], -1.0)] {
        let depth = |p: &[f64; 2]| sign * (p[axis] - bound);
        let mut out = Vec::new();
        for (i, p) in clipped.iter().enumerate() {
            let q = &clipped[(i + 1) % clipped.len()];
            if depth(p) >= 0.0 {
                out.push(*p);
            }
            if (depth(p) > 0.0 && depth(q) < 0.0) || (depth(p) < 0.0 && depth(q) > 0.0) {
                let share = depth(p) / (depth(p) - depth(q));
                out.push([0, 1].map(|a| p[a] + share * (q[a] - p[a])));
            }
        }
        clipped = out;
    }
    let next = clipped.iter().cycle().skip(1);
    0.5 * clipped.iter().zip(next).map(|(p, q)| p[0] * q[1] - q[0] * p[1]).sum::<f64>().abs()
}

proptest! {
    #[test]
    fn cells_are_those_that_share_area_with_a_triangle(
        corners in prop::array::uniform3((-1.5..3.5, 1.5..5.5)), z in (-0.5..0.5, 0.05..0.6),
    ) {
        let polygon = corners.map(|(x, y): (f64, f64)| [x, y]);
        let height = Some([z.0, z.0 + z.1]);
        let map = with(room(Unknown::Occupied), vec![KeepOut { polygon: polygon.to_vec(), height }], vec![]);
        for i in 0..40 {
            for j in 0..30 {
                let cube = map.cube([i, j, 0]);
                let area = overlap(&polygon, [cube.min[0], cube.min[1]], [cube.max[0], cube.max[1]]);
                let occupied: Vec<usize> = (0..map.dims[2]).filter(|k| map.occupied([i, j, *k])).collect();
                // Between the two lie overlaps that are thinner than 1e-6 m somewhere.
                prop_assert!(area < 5e-7 || !occupied.is_empty(), "{i} {j}: {area}");
                prop_assert!(area > 0.0 || occupied.is_empty(), "{i} {j}");
                if let (Some(first), Some(last)) = (occupied.first(), occupied.last()) {
                    prop_assert_eq!(occupied.len(), last - first + 1);
                    let (low, high) = (map.cube([i, j, *first]), map.cube([i, j, *last]));
                    prop_assert!(low.min[2] < z.0 + 1e-5 && low.max[2] > z.0 - 1e-9);
                    prop_assert!(high.min[2] < z.0 + z.1 + 1e-9 && high.max[2] > z.0 + z.1 - 1e-5);
                }
            }
        }
    }
}
