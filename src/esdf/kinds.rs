//! What the nodes of a slab are, from the bits of the map.

use std::ops::Range;

use crate::map::VoxelMap;
use crate::mission::Unknown;

/// What the nodes of one slab, or of a part of it, are: free (no cell around them occupied), inside a solid (all are), or on a surface.
pub(super) struct Kinds {
    /// 32 nodes a word: bit k % 32 of word (k / 32) * ny + j.
    site: Vec<u32>,
    solid: Vec<u32>,
    /// First node along y, and how many: nodes of a part of the slab only.
    first: usize,
    length: usize,
    /// Of the cells of columns (i - 1, j) and (i, j): occupied in one of them, in both. Element 0 is the column before the first node.
    any: Vec<u64>,
    all: Vec<u64>,
}

impl Kinds {
    /// For slabs of nz nodes along z, and these along y.
    pub(super) fn new(along_y: Range<usize>, nz: usize) -> Self {
        let (words, length) = (nz.div_ceil(64), along_y.len());
        let (planes, pairs) = (vec![0; 2 * words * length], vec![0; words * (length + 1)]);
        Self { site: planes.clone(), solid: planes, first: along_y.start, length, any: pairs.clone(), all: pairs }
    }

    /// Reads slab i; whether it holds a node inside a solid. Beyond the grid is solid sideways where unknown space is an
    /// obstacle, free else and above and below.
    pub(super) fn read(&mut self, map: &VoxelMap, i: usize) -> bool {
        let ny = self.length;
        let words = self.any.len() / (ny + 1);
        // Beyond the grid no cell is a site, as the edge bounds the distance anyhow.
        let beyond = if map.outside == Unknown::Free { 0 } else { u64::MAX };
        self.any.fill(0);
        self.all.fill(beyond);
        let cells = map.dims[2].div_ceil(64);
        let columns = self.first.max(1) - 1..(self.first + ny).min(map.dims[1]);
        for j in columns {
            let at = (j + 1 - self.first) * words;
            let low = if i > 0 { map.column(i - 1, j) } else { &[] };
            let high = if i < map.dims[0] { map.column(i, j) } else { &[] };
            for w in 0..cells {
                let pair = [low.get(w), high.get(w)];
                self.any[at + w] = pair[0].unwrap_or(&0) | pair[1].unwrap_or(&0);
                self.all[at + w] = pair[0].unwrap_or(&beyond) & pair[1].unwrap_or(&beyond);
            }
        }
        let mut solids = 0;
        for w in 0..words {
            // No column has a cell at the last node's height.
            let top = if w < cells { u64::MAX } else { 0 };
            for j in 0..ny {
                let (here, next) = (j * words + w, (j + 1) * words + w);
                let any = self.any[here] | self.any[next];
                let all = self.all[here] & self.all[next] & top;
                // Node k lies between cells k - 1 and k.
                let (mut any_below, mut all_below) = (0, 0);
                if w > 0 {
                    any_below = (self.any[here - 1] | self.any[next - 1]) >> 63;
                    all_below = (self.all[here - 1] & self.all[next - 1]) >> 63;
                }
                let site = any | any << 1 | any_below;
                let solid = all & (all << 1 | all_below);
                solids |= solid;
                let at = 2 * w * ny + j;
                (self.site[at], self.site[at + ny]) = (site as u32, (site >> 32) as u32);
                (self.solid[at], self.solid[at + ny]) = (solid as u32, (solid >> 32) as u32);
            }
        }
        solids != 0
    }

    /// Row k: 1 for free, 0 for on a surface, -1 for inside.
    pub(super) fn row(&self, k: usize) -> impl Iterator<Item = f32> {
        let at = k / 32 * self.length;
        let (site, solid) = (&self.site[at..at + self.length], &self.solid[at..at + self.length]);
        let bit = k % 32;
        site.iter()
            .zip(solid)
            .map(move |(site, solid)| (1 - (site >> bit & 1) as i32 - (solid >> bit & 1) as i32) as f32)
    }
}
