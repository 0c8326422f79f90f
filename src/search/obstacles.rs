//! Occupied cells near a place, as few boxes.

use crate::geom::Aabb;
use crate::map::VoxelMap;

/// Appends boxes that cover exactly the occupied cells that meet `region`: runs of cells along z, equal runs joined along y,
/// equal rectangles joined along x.
pub(super) fn collect(map: &VoxelMap, region: &Aabb, out: &mut Vec<Aabb>) {
    let range = |axis: usize| {
        let cell = |v: f64| ((v - map.origin[axis]) / map.resolution).floor();
        let first = cell(region.min[axis]).max(0.0) as usize;
        let last = cell(region.max[axis]).min(map.dims[axis] as f64 - 1.0);
        if last < 0.0 { 0..0 } else { first..(last as usize + 1).max(first) }
    };
    let (xs, ys, zs) = (range(0), range(1), range(2));
    if zs.is_empty() {
        return;
    }
    let (mut open, mut next) = (Vec::new(), Vec::new());
    // Rectangles of this layer and of the one before, the latter with the layer that they began in.
    let mut layer: Vec<Rectangle> = Vec::new();
    let mut before: Vec<(Rectangle, usize)> = Vec::new();
    for i in xs.clone() {
        layer.clear();
        rectangles(map, i, ys.clone(), zs.clone(), [&mut open, &mut next], &mut layer);
        before.retain(|(rectangle, since)| {
            let goes_on = layer.iter().position(|r| r == rectangle);
            match goes_on {
                Some(at) => {
                    layer.swap_remove(at);
                }
                None => out.push(rectangle.cells(map, *since, i)),
            }
            goes_on.is_some()
        });
        before.extend(layer.drain(..).map(|rectangle| (rectangle, i)));
    }
    out.extend(before.iter().map(|(rectangle, since)| rectangle.cells(map, *since, xs.end)));
}

/// Cells `y..y_end` by `low..high` of one layer along x.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Rectangle {
    y: usize,
    y_end: usize,
    low: usize,
    high: usize,
}

impl Rectangle {
    fn cells(&self, map: &VoxelMap, x: usize, x_end: usize) -> Aabb {
        Aabb { min: map.cube([x, self.y, self.low]).min, max: map.cube([x_end - 1, self.y_end - 1, self.high - 1]).max }
    }
}

/// The occupied rectangles of one layer: runs along z, equal ones joined along y. The vectors are scratch memory.
fn rectangles(
    map: &VoxelMap,
    i: usize,
    ys: std::ops::Range<usize>,
    zs: std::ops::Range<usize>,
    [open, next]: [&mut Vec<Rectangle>; 2],
    out: &mut Vec<Rectangle>,
) {
    open.clear();
    for j in ys {
        let column = map.column(i, j);
        if open.is_empty() && column.iter().all(|word| *word == 0) {
            continue;
        }
        next.clear();
        for_each_run(column, zs.clone(), |low, high| {
            let since = open.iter().find(|r| r.low == low && r.high == high).map_or(j, |r| r.y);
            next.push(Rectangle { y: since, y_end: j + 1, low, high });
        });
        out.extend(open.iter().filter(|r| !next.iter().any(|n| n.low == r.low && n.high == r.high)));
        std::mem::swap(open, next);
    }
    out.extend(open.iter());
}

/// Runs of set bits within a range, ascending.
fn for_each_run(words: &[u64], range: std::ops::Range<usize>, mut each: impl FnMut(usize, usize)) {
    let mut start = None;
    let mut k = range.start;
    while k < range.end {
        let rest = words[k / 64] >> (k % 64);
        let left = (64 - k % 64).min(range.end - k);
        let same = if start.is_none() { rest.trailing_zeros() } else { rest.trailing_ones() } as usize;
        k += same.min(left);
        if same < left {
            match start.take() {
                None => start = Some(k),
                Some(from) => each(from, k),
            }
        }
    }
    if let Some(from) = start {
        each(from, range.end);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mission::Unknown;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn boxes_cover_exactly_the_occupied_cells(
            cells in prop::collection::vec((0usize..5, 0usize..6, 0usize..70), 0..200), low in 0.0f64..4.0, high in 0.0f64..70.0,
        ) {
            let mut map = VoxelMap::new(1.0, [0.0; 3], [5, 6, 70], Unknown::Free);
            cells.iter().for_each(|c| map.occupy([c.0, c.1, c.2]));
            let region = Aabb { min: [low, 0.5, low], max: [4.5, 5.5, low.max(high)] };
            let mut boxes = Vec::new();
            collect(&map, &region, &mut boxes);
            for i in 0..5 { for j in 0..6 { for k in 0..70 {
                let centre = [i as f64 + 0.5, j as f64 + 0.5, k as f64 + 0.5];
                let covered = boxes.iter().filter(|b| (0..3).all(|a| b.min[a] < centre[a] && centre[a] < b.max[a])).count();
                let cell = map.cube([i, j, k]);
                let meets = (0..3).all(|a| cell.max[a] > region.min[a] && cell.min[a] <= region.max[a]);
                prop_assert!(covered <= 1);
                prop_assert_eq!(covered == 1, map.occupied([i, j, k]) && meets);
            }}}
        }
    }
}
