//! Occupied cells as few boxes, for a page that must stay small.

use std::collections::BTreeMap;

use crate::map::VoxelMap;

/// A map's occupied cells as boxes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Boxes {
    /// Cells of the map along an edge of a drawn cell; 1: as the map has them.
    pub(super) factor: usize,
    /// Low corner and size of each along x, y, z, in drawn cells; no two share a cell, together they fill exactly the occupied ones.
    pub(super) boxes: Vec<[u16; 6]>,
}

/// What a box spans in y and z: the key by which it goes on along x.
type Span = [usize; 4];

impl Boxes {
    /// A map in at most `most` boxes: where its own cells need more, larger ones, occupied where any of theirs is.
    pub(super) fn of(map: &VoxelMap, most: usize) -> Self {
        let widest = map.dims.into_iter().max().unwrap_or(0);
        (0..)
            .map(|k| 1 << k)
            .filter(|factor| widest / factor < usize::from(u16::MAX))
            .find_map(|factor| merged(map, factor, most).map(|boxes| Self { factor, boxes }))
            .expect("a map of one drawn cell is one box")
    }
}

/// The boxes, or nothing where there are more than `most`.
fn merged(map: &VoxelMap, factor: usize, most: usize) -> Option<Vec<[u16; 6]>> {
    let dims = map.dims.map(|n| n.div_ceil(factor));
    let mut boxes: Vec<[usize; 6]> = Vec::new();
    // Boxes that reach the slice before, by what they span there.
    let mut behind: BTreeMap<Span, usize> = BTreeMap::new();
    let mut column = Vec::new();
    for i in 0..dims[0] {
        let mut slice: Vec<Span> = Vec::new();
        // Boxes of the slice that reach the column before, by height.
        let mut open: Vec<usize> = Vec::new();
        for j in 0..dims[1] {
            // Most columns are free.
            if factor == 1 && map.column(i, j).iter().all(|word| *word == 0) {
                open.clear();
                continue;
            }
            let mut now = Vec::new();
            for (low, high) in runs(map, [i, j], factor, &mut column) {
                let goes_on = open.iter().copied().find(|at| slice[*at][2..] == [low, high]);
                let at = goes_on.unwrap_or_else(|| {
                    slice.push([j, j, low, high]);
                    slice.len() - 1
                });
                slice[at][1] = j + 1;
                now.push(at);
            }
            open = now;
        }
        let mut reached = BTreeMap::new();
        for span in slice {
            let at = behind.get(&span).copied().unwrap_or_else(|| {
                let [from, to, low, high] = span;
                boxes.push([i, from, low, 0, to - from, high - low]);
                boxes.len() - 1
            });
            boxes[at][3] = i + 1 - boxes[at][0];
            reached.insert(span, at);
        }
        behind = reached;
        if boxes.len() > most && factor < map.dims.into_iter().max().unwrap_or(1) {
            return None;
        }
    }
    Some(boxes.into_iter().map(|b| b.map(|v| v as u16)).collect())
}

/// Runs of occupied cells in a drawn column, from low to high: first and one past the last.
fn runs(map: &VoxelMap, [i, j]: [usize; 2], factor: usize, column: &mut Vec<u64>) -> Vec<(usize, usize)> {
    column.clear();
    column.resize(map.dims[2].div_ceil(64), 0);
    for x in i * factor..((i + 1) * factor).min(map.dims[0]) {
        for y in j * factor..((j + 1) * factor).min(map.dims[1]) {
            column.iter_mut().zip(map.column(x, y)).for_each(|(all, own)| *all |= own);
        }
    }
    let mut out: Vec<(usize, usize)> = Vec::new();
    for (word, bits) in column.iter().enumerate() {
        let mut bits = *bits;
        while bits != 0 {
            let first = bits.trailing_zeros();
            let length = (!(bits >> first)).trailing_zeros();
            let run = (64 * word + first as usize, 64 * word + (first + length) as usize);
            let (low, high) = (run.0 / factor, run.1.div_ceil(factor));
            match out.last_mut().filter(|(_, end)| *end >= low) {
                Some(last) => last.1 = high,
                None => out.push((low, high)),
            }
            bits = if first + length == 64 { 0 } else { bits & (u64::MAX << (first + length)) };
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::mission::Unknown;

    /// How often each drawn cell is filled.
    fn filled(map: &VoxelMap, boxes: &Boxes) -> BTreeMap<[usize; 3], usize> {
        let mut out = BTreeMap::new();
        for b in &boxes.boxes {
            let [x, y, z, nx, ny, nz] = b.map(usize::from);
            for i in x..x + nx {
                for j in y..y + ny {
                    (z..z + nz).for_each(|k| *out.entry([i, j, k]).or_insert(0) += 1);
                }
            }
        }
        let dims = map.dims.map(|n| n.div_ceil(boxes.factor));
        assert!(out.keys().all(|cell| (0..3).all(|a| cell[a] < dims[a])));
        out
    }

    proptest! {
        #[test]
        fn the_boxes_fill_exactly_the_occupied_cells(
            dims in [1..12usize, 1..12usize, 1..140usize],
            seeds in prop::collection::vec(([0.0..1.0, 0.0..1.0, 0.0..1.0f64], [1..6usize, 1..6usize, 1..80usize]), 0..8),
            most in 1..200usize,
        ) {
            let mut map = VoxelMap::new(0.05, [-1.0, 0.5, 0.0], dims, Unknown::Free);
            for (at, size) in seeds {
                let low: [usize; 3] = std::array::from_fn(|a| (at[a] * dims[a] as f64) as usize);
                let high: [usize; 3] = std::array::from_fn(|a| (low[a] + size[a]).min(dims[a]));
                for i in low[0]..high[0] { for j in low[1]..high[1] { (low[2]..high[2]).for_each(|k| map.occupy([i, j, k])) } }
            }
            let boxes = Boxes::of(&map, most);
            let mut expected = BTreeMap::new();
            for cell in map.cells() {
                expected.insert(cell.map(|c| c / boxes.factor), 1);
            }
            prop_assert_eq!(filled(&map, &boxes), expected);
            prop_assert!(boxes.boxes.len() <= most);
            if most == 199 { prop_assert!(boxes.factor <= 16, "no coarser than it must be") }
        }
    }

    #[test]
    fn a_wall_is_one_box_whatever_its_height() {
        let mut map = VoxelMap::new(0.1, [0.0; 3], [30, 40, 130], Unknown::Occupied);
        (0..40).for_each(|j| (0..130).for_each(|k| map.occupy([7, j, k])));
        assert_eq!(Boxes::of(&map, 10), Boxes { factor: 1, boxes: vec![[7, 0, 0, 1, 40, 130]] });
    }
}
