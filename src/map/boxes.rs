//! Maps made of boxes: the scenes of `trajc eval`.

use super::error::MapError;
use super::{FARTHEST, VoxelMap, voxelize};
use crate::diag::Diagnostics;
use crate::geom::Aabb;
use crate::mission::Unknown;

/// An overlap below this is rounding of faces that lie on the grid, m.
const TOUCH: f64 = 1e-6;

impl VoxelMap {
    /// A grid with its lower corner at `bounds.min`. A box occupies each cell that it overlaps by more than 1e-6 m on every
    /// axis; parts of boxes beyond the bounds are left out. A last row of cells that would reach beyond the bounds in x or y is
    /// left out too, so with `outside` occupied it is obstacle; in z it is kept. No floor is cut.
    ///
    /// # Errors
    /// Bounds, boxes or a resolution that are not finite or upside down; a grid that is too large.
    pub fn from_boxes(bounds: Aabb, resolution: f64, boxes: &[Aabb], outside: Unknown) -> Result<Self, Diagnostics> {
        if !voxelize::usable(resolution) {
            return Err(MapError::Resolution { value: resolution, at: None }.into());
        }
        for b in boxes.iter().chain([&bounds]) {
            let corners: Vec<f64> = b.min.into_iter().chain(b.max).collect();
            if !corners.iter().all(|v| v.abs() <= FARTHEST) || (0..3).any(|a| b.min[a] > b.max[a]) {
                return Err(MapError::Box { corners, limit: FARTHEST }.into());
            }
        }
        let cells = [0, 1, 2].map(|a| {
            let extent = bounds.max[a] - bounds.min[a];
            let cells =
                if a < 2 { ((extent + TOUCH) / resolution).floor() } else { ((extent - TOUCH) / resolution).ceil() };
            cells as i64
        });
        if cells.iter().any(|n| *n < 1) {
            return Err(
                MapError::Box { corners: bounds.min.into_iter().chain(bounds.max).collect(), limit: FARTHEST }.into()
            );
        }
        let dims = voxelize::checked(cells, resolution)?;
        let mut map = Self::new(resolution, bounds.min, dims, outside);
        for b in boxes {
            let [x, y, z] = [0, 1, 2].map(|a| {
                let from = (b.min[a] + TOUCH - bounds.min[a]) / resolution;
                let to = (b.max[a] - TOUCH - bounds.min[a]) / resolution;
                // Thinner than twice the touch: whether it overlaps a cell enough is for `overlaps` to say.
                let from = from.min(to).floor().max(0.0) as usize;
                let to = (to.floor() + 2.0).max(0.0) as usize;
                (from..to.min(dims[a])).filter(move |c| overlap(bounds.min[a], resolution, *c, b, a) > TOUCH)
            });
            for i in x {
                for j in y.clone() {
                    for k in z.clone() {
                        map.occupy([i, j, k]);
                    }
                }
            }
        }
        Ok(map)
    }
}

/// How far cell `c` and a box overlap along axis `a`, m; negative: apart.
fn overlap(origin: f64, resolution: f64, c: usize, b: &Aabb, a: usize) -> f64 {
    let (low, high) = (origin + resolution * c as f64, origin + resolution * (c + 1) as f64);
    high.min(b.max[a]) - low.max(b.min[a])
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn aabb(min: [f64; 3], max: [f64; 3]) -> Aabb {
        Aabb { min, max }
    }

    #[test]
    fn faces_on_the_grid_occupy_no_neighbours() {
        let bounds = aabb([0.0; 3], [10.0, 10.0, 1.0]);
        let map = VoxelMap::from_boxes(bounds, 0.05, &[aabb([0.15, 0.3, 0.45], [0.35, 0.6, 0.7])], Unknown::Occupied)
            .expect("good");
        assert_eq!(map.dims, [200, 200, 20]);
        assert_eq!(map.occupied_count(), 4 * 6 * 5);
        assert!(map.occupied([3, 6, 9]) && map.occupied([6, 11, 13]));
        assert!(!map.occupied([2, 6, 9]) && !map.occupied([7, 11, 13]) && !map.occupied([3, 6, 8]));
    }

    #[test]
    fn a_last_cell_beyond_the_bounds_is_outside() {
        let map = VoxelMap::from_boxes(aabb([-1.0; 3], [0.03; 3]), 0.1, &[], Unknown::Occupied).expect("good");
        assert_eq!(map.dims, [10, 10, 11]);
    }

    #[test]
    fn bad_boxes_are_refused() {
        let bounds = aabb([0.0; 3], [1.0; 3]);
        for bad in [aabb([0.0; 3], [f64::NAN; 3]), aabb([0.5; 3], [0.4; 3])] {
            assert!(VoxelMap::from_boxes(bounds, 0.1, &[bad], Unknown::Free).is_err());
            assert!(VoxelMap::from_boxes(bad, 0.1, &[], Unknown::Free).is_err());
        }
        assert!(VoxelMap::from_boxes(bounds, 0.0, &[], Unknown::Free).is_err());
    }

    proptest! {
        #[test]
        fn cells_are_those_of_the_definition(
            corners in prop::collection::vec((-1.5..1.5, -1.5..1.5, -1.5..1.5, 0.0..1.0, 0.0..1.0, 0.0..1.0), 1..4),
            resolution in 0.07..0.3,
        ) {
            let bounds = aabb([-1.0, -0.5, 0.0], [1.0, 1.0, 1.0]);
            let boxes: Vec<Aabb> = corners.iter()
                .map(|(x, y, z, w, d, h)| aabb([*x, *y, *z], [x + w, y + d, z + h])).collect();
            let map = VoxelMap::from_boxes(bounds, resolution, &boxes, Unknown::Free).expect("good");
            for i in 0..map.dims[0] {
                for j in 0..map.dims[1] {
                    for k in 0..map.dims[2] {
                        let hit = boxes.iter().any(|b| {
                            (0..3).all(|a| overlap(bounds.min[a], resolution, [i, j, k][a], b, a) > TOUCH)
                        });
                        prop_assert_eq!(map.occupied([i, j, k]), hit);
                    }
                }
            }
        }
    }
}
