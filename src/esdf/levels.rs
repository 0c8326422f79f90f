//! Which rows of nodes are alike in the whole map.

use crate::map::VoxelMap;

/// Rows of nodes that are alike in every slab, and so are all that comes of them along x and y: done once. Nothing reaches as
/// high as most maps do, and above it all is free.
pub(super) struct Levels {
    /// The lowest row of each level.
    pub(super) rows: Vec<usize>,
    /// The level of each row.
    pub(super) of: Vec<usize>,
}

impl Levels {
    pub(super) fn of(map: &VoxelMap) -> Self {
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
