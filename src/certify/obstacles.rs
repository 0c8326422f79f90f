//! Occupied cells near a shape, merged into few boxes.

use crate::geom::Aabb;
use crate::map::VoxelMap;
use crate::mission::Unknown;

/// Columns along x and y that share a summary.
const BLOCK: usize = 8;

/// A side of the map's rectangle; what lies beyond is an obstacle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Edge {
    /// 0: x, 1: y.
    pub(super) axis: usize,
    /// 1: the obstacle is where the coordinate is greater; -1: where it is less.
    pub(super) sign: f64,
    /// Coordinate of the side, m.
    pub(super) at: f64,
}

/// The map, with a summary that lets empty regions be skipped.
#[derive(Debug)]
pub(super) struct Obstacles<'a> {
    map: &'a VoxelMap,
    /// Union of the columns of each block of columns, `words` each, in order `(i / BLOCK) * across + j / BLOCK`.
    blocks: Vec<u64>,
    /// Blocks that are summarised: of a large map only those that something came near.
    summarised: Vec<bool>,
    across: usize,
    words: usize,
    /// The sides of the rectangle where the outside is an obstacle.
    pub(super) edges: Vec<Edge>,
    scratch: Scratch,
}

/// A box of cells, `low` inclusive, `high` exclusive.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cells {
    low: [usize; 3],
    high: [usize; 3],
}

#[derive(Debug, Default)]
struct Scratch {
    merged: Vec<Cells>,
    /// Boxes of the slice at hand, by (low[1], low[2]); and those that reach the column before, by low[2].
    slice: Vec<Cells>,
    open: Vec<usize>,
    still_open: Vec<usize>,
    /// Boxes in `merged` that reach the slice before, by (low[1], low[2]).
    behind: Vec<usize>,
    still_behind: Vec<usize>,
}

impl<'a> Obstacles<'a> {
    /// Of a map, which is looked at where it is asked for.
    pub(super) fn new(map: &'a VoxelMap) -> Self {
        let (along, across) = (map.dims[0].div_ceil(BLOCK), map.dims[1].div_ceil(BLOCK));
        let words = map.column(0, 0).len();
        let blocks = vec![0; along * across * words];
        let summarised = vec![false; along * across];
        let bounds = map.bounds();
        let sides =
            [(0, -1.0, bounds.min[0]), (0, 1.0, bounds.max[0]), (1, -1.0, bounds.min[1]), (1, 1.0, bounds.max[1])];
        let edges = match map.outside {
            Unknown::Occupied => sides.map(|(axis, sign, at)| Edge { axis, sign, at }).to_vec(),
            Unknown::Free => Vec::new(),
        };
        Self { map, blocks, summarised, across, words, edges, scratch: Scratch::default() }
    }

    /// Boxes that together fill exactly the occupied cells whose cubes meet `window`; appended to `out`. Returns the number of
    /// columns looked at.
    pub(super) fn near(&mut self, window: &Aabb, out: &mut Vec<Aabb>) -> usize {
        let map = self.map;
        let mut low = [0; 3];
        let mut high = [0; 3];
        for axis in 0..3 {
            // A cell more than needed does no harm; one less would. `as` saturates.
            let cell = |x: f64| (x - map.origin[axis]) / map.resolution;
            low[axis] = ((cell(window.min[axis]) - 1e-6).floor().max(0.0) as usize).min(map.dims[axis]);
            high[axis] = ((cell(window.max[axis]) + 1e-6).floor() + 1.0).max(0.0) as usize;
            high[axis] = high[axis].min(map.dims[axis]);
            if low[axis] >= high[axis] {
                return 0;
            }
        }
        self.summarise(low, high);
        let mut columns = 0;
        let mut scratch = std::mem::take(&mut self.scratch);
        scratch.merged.clear();
        scratch.behind.clear();
        for block_i in low[0] / BLOCK..=(high[0] - 1) / BLOCK {
            let mut any = false;
            for block_j in low[1] / BLOCK..=(high[1] - 1) / BLOCK {
                any |= self.block_has(block_i, block_j, low[2], high[2]);
            }
            columns += 1;
            if !any {
                continue;
            }
            for i in low[0].max(block_i * BLOCK)..high[0].min((block_i + 1) * BLOCK) {
                columns += high[1] - low[1];
                self.slice(i, low, high, &mut scratch);
                scratch.merge_slice(i);
            }
        }
        let corner = |cell: [usize; 3]| std::array::from_fn(|a| map.origin[a] + map.resolution * cell[a] as f64);
        out.extend(scratch.merged.iter().map(|cells| Aabb { min: corner(cells.low), max: corner(cells.high) }));
        self.scratch = scratch;
        columns
    }

    /// Summarises the blocks that hold cells `low` to `high` (exclusive) in x and y, as far as they are not yet.
    fn summarise(&mut self, low: [usize; 3], high: [usize; 3]) {
        let [nx, ny, _] = self.map.dims;
        for block_i in low[0] / BLOCK..=(high[0] - 1) / BLOCK {
            for block_j in low[1] / BLOCK..=(high[1] - 1) / BLOCK {
                let block = block_i * self.across + block_j;
                if std::mem::replace(&mut self.summarised[block], true) {
                    continue;
                }
                let summary = &mut self.blocks[block * self.words..(block + 1) * self.words];
                for i in block_i * BLOCK..((block_i + 1) * BLOCK).min(nx) {
                    for j in block_j * BLOCK..((block_j + 1) * BLOCK).min(ny) {
                        summary.iter_mut().zip(self.map.column(i, j)).for_each(|(summary, word)| *summary |= word);
                    }
                }
            }
        }
    }

    /// Cubes of the occupied cells that fill a box made by [`Obstacles::near`].
    pub(super) fn cubes(&self, merged: &Aabb) -> impl Iterator<Item = Aabb> {
        let cell = |axis: usize, x: f64| ((x - self.map.origin[axis]) / self.map.resolution).round() as usize;
        let [x, y, z] = [0, 1, 2].map(|axis| cell(axis, merged.min[axis])..cell(axis, merged.max[axis]));
        let map = self.map;
        x.flat_map(move |i| {
            let z = z.clone();
            y.clone().flat_map(move |j| z.clone().map(move |k| map.cube([i, j, k])))
        })
    }

    fn block_has(&self, block_i: usize, block_j: usize, low: usize, high: usize) -> bool {
        let at = (block_i * self.across + block_j) * self.words;
        (low / 64..=(high - 1) / 64).any(|word| self.blocks[at + word] & mask(word, low, high) != 0)
    }

    /// Runs of one slice of columns (constant i), merged along y.
    fn slice(&self, i: usize, low: [usize; 3], high: [usize; 3], scratch: &mut Scratch) {
        scratch.slice.clear();
        scratch.open.clear();
        let mut j = low[1];
        while j < high[1] {
            if !self.block_has(i / BLOCK, j / BLOCK, low[2], high[2]) {
                j = (j / BLOCK + 1) * BLOCK;
                scratch.open.clear();
                continue;
            }
            let column = self.map.column(i, j);
            let mut next_open = 0;
            scratch.still_open.clear();
            let mut k = low[2];
            while let Some((begin, end)) = next_run(column, k, high[2]) {
                k = end;
                while scratch.open.get(next_open).is_some_and(|&at| scratch.slice[at].low[2] < begin) {
                    next_open += 1;
                }
                let before = scratch.open.get(next_open).copied();
                let before = before.filter(|&at| scratch.slice[at].low[2] == begin && scratch.slice[at].high[2] == end);
                let at = before.unwrap_or_else(|| {
                    scratch.slice.push(Cells { low: [i, j, begin], high: [i, j, end] }); // grows below and in `merge_slice`
                    scratch.slice.len() - 1
                });
                scratch.slice[at].high[1] = j + 1;
                scratch.still_open.push(at);
            }
            std::mem::swap(&mut scratch.open, &mut scratch.still_open);
            j += 1;
        }
    }
}

impl Scratch {
    /// Joins the boxes of slice `i` to equal ones of the slice before.
    fn merge_slice(&mut self, i: usize) {
        let mut next = 0;
        self.still_behind.clear();
        for cells in &self.slice {
            let key = (cells.low[1], cells.low[2]);
            while self.behind.get(next).is_some_and(|&at| (self.merged[at].low[1], self.merged[at].low[2]) < key) {
                next += 1;
            }
            let before = self.behind.get(next).copied().filter(|&at| {
                let other = &self.merged[at];
                other.high == [i, cells.high[1], cells.high[2]] && other.low[1..] == cells.low[1..]
            });
            let at = before.unwrap_or_else(|| {
                self.merged.push(*cells);
                self.merged.len() - 1
            });
            self.merged[at].high[0] = i + 1;
            self.still_behind.push(at);
        }
        std::mem::swap(&mut self.behind, &mut self.still_behind);
    }
}

/// The bits of word `word` that stand for cells `low..high`; at least one must.
fn mask(word: usize, low: usize, high: usize) -> u64 {
    let begin = low.saturating_sub(64 * word).min(63);
    let end = (high - 64 * word).min(64);
    (u64::MAX << begin) & (u64::MAX >> (64 - end))
}

/// The first run of occupied cells in `from..limit` of a column: (begin, end).
fn next_run(column: &[u64], from: usize, limit: usize) -> Option<(usize, usize)> {
    let begin = first_bit(column, from, limit, 0)?;
    Some((begin, first_bit(column, begin, limit, u64::MAX).unwrap_or(limit)))
}

/// The first bit in `from..limit` that is set after flipping the words by `flip`.
fn first_bit(column: &[u64], from: usize, limit: usize, flip: u64) -> Option<usize> {
    if from >= limit {
        return None;
    }
    (from / 64..=(limit - 1) / 64).find_map(|word| {
        let bits = (column[word] ^ flip) & mask(word, from, limit);
        (bits != 0).then(|| 64 * word + bits.trailing_zeros() as usize)
    })
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn the_boxes_fill_exactly_the_occupied_cells_of_the_window(
            dims in [1..20usize, 1..20usize, 1..150usize],
            seeds in prop::collection::vec(([0.0..1.0, 0.0..1.0, 0.0..1.0f64], [1..9usize, 1..9usize, 1..90usize]), 0..8),
            corner in [-0.5..1.0, -0.5..1.0, -0.5..1.0f64],
            size in [0.0..1.5, 0.0..1.5, 0.0..1.5f64],
        ) {
            let mut map = VoxelMap::new(0.05, [-1.0, 0.5, 0.0], dims, Unknown::Free);
            for (at, size) in seeds {
                let low: [usize; 3] = std::array::from_fn(|a| (at[a] * dims[a] as f64) as usize);
                let high: [usize; 3] = std::array::from_fn(|a| (low[a] + size[a]).min(dims[a]));
                for i in low[0]..high[0] { for j in low[1]..high[1] { for k in low[2]..high[2] { map.occupy([i, j, k]) } } }
            }
            let extent: [f64; 3] = std::array::from_fn(|a| dims[a] as f64 * 0.05);
            let window = Aabb {
                min: std::array::from_fn(|a| map.origin[a] + corner[a] * extent[a]),
                max: std::array::from_fn(|a| map.origin[a] + (corner[a] + size[a]) * extent[a]),
            };
            let mut boxes = Vec::new();
            let mut obstacles = Obstacles::new(&map);
            obstacles.near(&window, &mut boxes);
            let mut filled = vec![0; dims[0] * dims[1] * dims[2]];
            for found in &boxes {
                for cube in obstacles.cubes(found) {
                    let cell: [usize; 3] = std::array::from_fn(|a| ((cube.min[a] - map.origin[a]) / 0.05).round() as usize);
                    filled[(cell[0] * dims[1] + cell[1]) * dims[2] + cell[2]] += 1;
                }
            }
            for i in 0..dims[0] { for j in 0..dims[1] { for k in 0..dims[2] {
                let count = filled[(i * dims[1] + j) * dims[2] + k];
                let cube = map.cube([i, j, k]);
                let meets = (0..3).all(|a| cube.min[a] <= window.max[a] && window.min[a] <= cube.max[a]);
                prop_assert!(count <= u8::from(map.occupied([i, j, k])));
                prop_assert!(!meets || count == u8::from(map.occupied([i, j, k])), "{:?}", [i, j, k]);
            } } }
        }
    }

    #[test]
    fn a_cell_that_a_window_only_touches_is_found() {
        let mut map = VoxelMap::new(0.1, [0.0; 3], [10, 10, 10], Unknown::Free);
        map.occupy([5, 5, 5]);
        for axis in 0..3 {
            for [from, to] in [[0.2, 0.5], [0.6, 0.9]] {
                let mut window = Aabb { min: [0.52; 3], max: [0.58; 3] };
                (window.min[axis], window.max[axis]) = (from, to);
                let mut boxes = Vec::new();
                Obstacles::new(&map).near(&window, &mut boxes);
                assert_eq!(boxes, [map.cube([5, 5, 5])], "{window:?}");
            }
        }
    }

    #[test]
    fn a_mask_has_the_bits_of_its_cells_and_no_others() {
        for (low, high) in [(0, 1), (0, 64), (3, 70), (63, 65), (64, 128), (70, 71), (5, 200), (130, 190)] {
            for word in low / 64..=(high - 1) / 64 {
                let expected = (0..64).filter(|bit| (low..high).contains(&(64 * word + bit)));
                assert_eq!(
                    mask(word, low, high),
                    expected.fold(0, |bits, bit| bits | 1 << bit),
                    "{low}..{high}, {word}"
                );
            }
        }
    }

    proptest! {
        #[test]
        fn a_block_has_something_where_one_of_its_cells_is_occupied(
            cells in prop::collection::vec([0..20usize, 0..20usize, 0..150usize], 1..6), low in 0..150usize, size in 1..150usize,
        ) {
            let mut map = VoxelMap::new(0.05, [0.0; 3], [20, 20, 150], Unknown::Free);
            cells.iter().for_each(|cell| map.occupy(*cell));
            let high = (low + size).min(150);
            let mut obstacles = Obstacles::new(&map);
            obstacles.summarise([0; 3], [20, 20, 150]);
            for i in 0..3 {
                for j in 0..3 {
                    let own = |c: &[usize; 3]| c[0] / BLOCK == i && c[1] / BLOCK == j && (low..high).contains(&c[2]);
                    prop_assert_eq!(obstacles.block_has(i, j, low, high), cells.iter().any(own));
                }
            }
        }
    }

    #[test]
    fn a_shelf_over_a_wall_that_ends_before_it_becomes_two_boxes() {
        // Along x and along y: cells 1 and 2 of the height up to the middle, cells 5 and 6 all the way.
        for axis in 0..2 {
            let mut map = VoxelMap::new(0.1, [0.0; 3], [16, 16, 10], Unknown::Free);
            for along in 0..16 {
                for k in [1, 2, 5, 6] {
                    let mut cell = [3, 3, k];
                    cell[axis] = along;
                    if along < 8 || k > 4 {
                        map.occupy(cell);
                    }
                }
            }
            let mut boxes = Vec::new();
            Obstacles::new(&map).near(&Aabb { min: [0.0; 3], max: [1.6, 1.6, 1.0] }, &mut boxes);
            assert_eq!(boxes.len(), 2, "{boxes:?}");
        }
    }

    #[test]
    fn a_wall_becomes_one_box() {
        let mut map = VoxelMap::new(0.1, [0.0; 3], [40, 40, 10], Unknown::Free);
        for i in 10..12 {
            for j in 0..40 {
                for k in 0..10 {
                    map.occupy([i, j, k]);
                }
            }
        }
        let mut boxes = Vec::new();
        Obstacles::new(&map).near(&Aabb { min: [0.0; 3], max: [4.0, 4.0, 1.0] }, &mut boxes);
        assert_eq!(boxes.len(), 1);
    }
}
