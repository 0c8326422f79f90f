//! An upright cylinder among the occupied cells, exactly.

use crate::map::VoxelMap;
use crate::math::real;
use crate::mission::Unknown;

/// Obstacles may touch it from above and below, and must keep off its side.
pub(super) struct Upright {
    /// With the clearance, m.
    pub radius: f64,
    /// Lowest and highest, m.
    pub heights: [f64; 2],
}

impl Upright {
    /// Whether no occupied cell beside it is nearer to its axis than its radius.
    pub fn fits(&self, map: &VoxelMap, place: [f64; 2]) -> bool {
        let at = [0, 1].map(|a| (place[a] - map.origin[a]) / map.resolution);
        let radius = self.radius / map.resolution;
        if map.outside == Unknown::Occupied
            && (0..2).any(|a| at[a] < radius - 1e-9 || at[a] > map.dims[a] as f64 - radius + 1e-9)
        {
            return false;
        }
        let heights = self.heights.map(|z| (z - map.origin[2]) / map.resolution);
        let layers = cells(heights[0] + 1e-6, heights[1] - 1e-6, map.dims[2]);
        let beside = |axis: usize| cells(at[axis] - radius, at[axis] + radius, map.dims[axis]);
        let gap = |axis: usize, cell: usize| (cell as f64 - at[axis]).max(at[axis] - cell as f64 - 1.0).max(0.0);
        let least = real::powi((radius - 1e-9).max(0.0), 2);
        !beside(0).any(|i| {
            let across = real::powi(gap(0, i), 2);
            beside(1)
                .any(|j| across + real::powi(gap(1, j), 2) < least && layers.clone().any(|k| map.occupied([i, j, k])))
        })
    }
}

/// Cells that meet a range.
fn cells(low: f64, high: f64, count: usize) -> std::ops::Range<usize> {
    low.floor().max(0.0) as usize..(high.ceil().max(0.0) as usize).min(count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_fits_where_no_cell_at_its_height_is_nearer_than_its_radius(
            cells in prop::collection::vec((0usize..8, 0usize..9, 0usize..6), 0..20),
            x in -0.5f64..4.5, y in 0.5f64..6.0, radius in 0.0f64..2.0, low in -0.5f64..3.0, tall in 0.0f64..2.0,
            shut in any::<bool>(),
        ) {
            let outside = if shut { Unknown::Occupied } else { Unknown::Free };
            let mut map = VoxelMap::new(0.5, [0.0, 1.0, -0.25], [8, 9, 6], outside);
            cells.iter().for_each(|c| map.occupy([c.0, c.1, c.2]));
            let off = |v: f64, low: f64, high: f64| (low - v).max(v - high).max(0.0);
            let mut nearest = f64::INFINITY;
            for cube in map.cells().map(|cell| map.cube(cell)) {
                if cube.min[2] < low + tall - 1e-6 && cube.max[2] > low + 1e-6 {
                    let gap = real::hypot(off(x, cube.min[0], cube.max[0]), off(y, cube.min[1], cube.max[1]));
                    nearest = nearest.min(gap);
                }
            }
            if shut {
                nearest = [x, 4.0 - x, y - 1.0, 5.5 - y].into_iter().fold(nearest, f64::min);
            }
            prop_assume!((nearest - radius).abs() > 1e-6);
            let upright = Upright { radius, heights: [low, low + tall] };
            prop_assert_eq!(upright.fits(&map, [x, y]), nearest > radius);
        }
    }
}
