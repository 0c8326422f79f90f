//! Occupied cells near a place, as few boxes.

use crate::geom::Aabb;
use crate::map::VoxelMap;

/// Appends boxes that cover exactly the occupied cells that meet `region`: runs of cells along z, equal runs joined along y.
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
    let mut open: Vec<OpenRun> = Vec::new();
    let mut next: Vec<OpenRun> = Vec::new();
    for i in xs {
        open.clear();
        for j in ys.clone() {
            let column = map.column(i, j);
            if open.is_empty() && column.iter().all(|word| *word == 0) {
                continue;
            }
            next.clear();
            for_each_run(column, zs.clone(), |low, high| {
                let since = open.iter().find(|r| r.low == low && r.high == high).map_or(j, |r| r.since);
                next.push(OpenRun { low, high, since });
            });
            for run in open.iter().filter(|r| !next.iter().any(|n| n.low == r.low && n.high == r.high)) {
                out.push(run.cells(map, i, j));
            }
            std::mem::swap(&mut open, &mut next);
        }
        out.extend(open.iter().map(|run| run.cells(map, i, ys.end)));
    }
}

/// Cells `low..high` along z, occupied since row `since`.
struct OpenRun {
    low: usize,
    high: usize,
    since: usize,
}

impl OpenRun {
    fn cells(&self, map: &VoxelMap, i: usize, end: usize) -> Aabb {
        Aabb { min: map.cube([i, self.since, self.low]).min, max: map.cube([i, end - 1, self.high - 1]).max }
    }
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
