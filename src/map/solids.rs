//! What a mission adds to its map, as occupied cells: keep-out areas and boxes.

use super::VoxelMap;
use super::error::MapError;
use super::voxelize::{Slab, checked};
use crate::mission::{MapSpec, Unknown};

/// An overlap below this is rounding of faces that lie on the grid, m.
const TOUCH: f64 = 1e-6;
/// No robot reaches deeper below its floor, m, whatever `height_m` says.
const DEEPEST: f64 = 10.0;

/// A solid over a polygon.
struct Prism {
    /// Corners, m.
    polygon: Vec<[f64; 2]>,
    /// From and to, m.
    z: [f64; 2],
}

/// The map with the solids of its mission: a cell is occupied that one of them overlaps by more than 1e-6 m.
///
/// They are not cut to the slab, so the grid grows to hold them: in z always, in x and y only where beyond it is free (else it is an
/// obstacle already). A keep-out area without heights reaches from the floor, or the slab's lower end where that is lower, to the
/// top of the robot.
///
/// # Errors
/// The grid would be too large.
pub(super) fn added(map: VoxelMap, spec: &MapSpec, slab: Slab, robot_height: f64) -> Result<VoxelMap, MapError> {
    let whole = [slab.low.clamp(-DEEPEST, 0.0), robot_height.max(TOUCH)];
    let areas = spec.keep_out.iter().map(|k| Prism { polygon: k.polygon.clone(), z: k.height.unwrap_or(whole) });
    let boxes = spec.boxes.iter().map(|b| {
        let ([x, y, low], [x2, y2, high]) = (b.min, b.max);
        Prism { polygon: vec![[x, y], [x2, y], [x2, y2], [x, y2]], z: [low, high] }
    });
    let prisms: Vec<Prism> = areas.chain(boxes).collect();
    if prisms.is_empty() {
        return Ok(map);
    }
    let mut map = grown(map, &prisms)?;
    let before = map.occupied_count();
    for prism in &prisms {
        occupy(&mut map, prism);
    }
    map.statistics.added = map.occupied_count() - before;
    Ok(map)
}

/// A length in cells from the grid's corner.
fn in_cells(map: &VoxelMap, axis: usize, value: f64) -> f64 {
    (value - map.origin[axis]) / map.resolution
}

/// [`TOUCH`] in cells.
fn touch(map: &VoxelMap) -> f64 {
    (TOUCH / map.resolution).min(0.01)
}

/// First and last cell that overlap `low` to `high` (in cells) by `touch` or more.
fn cells(low: f64, high: f64, touch: f64) -> (i64, i64) {
    ((low - 1.0 + touch).ceil() as i64, (high - touch).floor() as i64)
}

/// The cells along an axis that overlap a prism.
fn range(map: &VoxelMap, prism: &Prism, axis: usize) -> (i64, i64) {
    let (low, high) = match axis {
        2 => (prism.z[0], prism.z[1]),
        _ => {
            let along = prism.polygon.iter().map(|p| p[axis]);
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
        }
    };
    cells(in_cells(map, axis, low), in_cells(map, axis, high), touch(map))
}

/// The same map on a grid that holds the prisms.
fn grown(map: VoxelMap, prisms: &[Prism]) -> Result<VoxelMap, MapError> {
    let size = map.dims.map(|n| n as i64);
    let (mut first, mut last) = ([0; 3], size.map(|n| n - 1));
    for prism in prisms {
        let ranges = [0, 1, 2].map(|axis| range(&map, prism, axis));
        let beyond = (0..2).any(|a| ranges[a].1 < 0 || ranges[a].0 >= size[a]);
        if map.outside == Unknown::Occupied && beyond {
            continue;
        }
        let axes = if map.outside == Unknown::Occupied { 2..3 } else { 0..3 };
        for a in axes {
            first[a] = first[a].min(ranges[a].0);
            last[a] = last[a].max(ranges[a].1);
        }
    }
    let wanted = [0, 1, 2].map(|a| last[a] - first[a] + 1);
    if wanted == size {
        return Ok(map);
    }
    let dims = checked(wanted, map.resolution)?;
    let origin = [0, 1, 2].map(|a| map.origin[a] + map.resolution * first[a] as f64);
    let mut out = VoxelMap::new(map.resolution, origin, dims, map.outside);
    for cell in map.cells() {
        out.occupy([0, 1, 2].map(|a| (cell[a] as i64 - first[a]) as usize));
    }
    out.statistics = map.statistics;
    Ok(out)
}

/// Marks the cells that a prism overlaps, as far as they are in the grid.
///
/// Seen from above, a cell overlaps the polygon if a side passes through it, or else if the polygon winds around its centre.
fn occupy(map: &mut VoxelMap, prism: &Prism) {
    let touch = touch(map);
    let size = map.dims.map(|n| n as i64);
    let within = |(first, last): (i64, i64), a: usize| first.max(0)..=last.min(size[a] - 1);
    let corners: Vec<[f64; 2]> = prism.polygon.iter().map(|p| [0, 1].map(|a| in_cells(map, a, p[a]))).collect();
    let sides: Vec<([f64; 2], [f64; 2])> =
        corners.iter().copied().zip(corners.iter().copied().cycle().skip(1)).collect();
    let layers = within(range(map, prism, 2), 2);
    if layers.is_empty() {
        return;
    }
    let (bottom, top) = (*layers.start() as usize, *layers.end() as usize + 1);
    let mut fill = |columns: std::ops::RangeInclusive<i64>, j: i64| {
        if !columns.is_empty() {
            let (from, to, j) = (*columns.start() as usize, *columns.end() as usize + 1, j as usize);
            map.set_box([from, j, bottom], [to, j + 1, top], true);
        }
    };
    for (a, b) in &sides {
        for j in within(cells(a[1].min(b[1]), a[1].max(b[1]), touch), 1) {
            let (low, high) = inside_the_row(*a, *b, j as f64 + touch, (j + 1) as f64 - touch);
            fill(within(cells(low, high, touch), 0), j);
        }
    }
    let (low, high) = corners.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p[1]), h.max(p[1])));
    for j in within(cells(low, high, touch), 1) {
        let middle = j as f64 + 0.5;
        let mut crossings: Vec<(f64, i32)> = sides
            .iter()
            .filter(|(a, b)| (a[1] <= middle) != (b[1] <= middle))
            .map(|(a, b)| {
                let share = (middle - a[1]) / (b[1] - a[1]);
                (a[0] + share * (b[0] - a[0]), if b[1] > a[1] { 1 } else { -1 })
            })
            .collect();
        crossings.sort_by(|p, q| p.0.total_cmp(&q.0));
        let mut winding = 0;
        for pair in crossings.windows(2) {
            winding += pair[0].1;
            if winding != 0 {
                // Columns with their centres between the two crossings.
                let between = ((pair[0].0 - 0.5).ceil() as i64, (pair[1].0 - 0.5).floor() as i64);
                fill(within(between, 0), j);
            }
        }
    }
}

/// From where to where in x a side goes between two heights of y; some part of it lies between them.
fn inside_the_row(a: [f64; 2], b: [f64; 2], low: f64, high: f64) -> (f64, f64) {
    let at = |y: f64| {
        let share = if b[1] == a[1] { 0.0 } else { ((y - a[1]) / (b[1] - a[1])).clamp(0.0, 1.0) };
        a[0] + share * (b[0] - a[0])
    };
    if a[1] == b[1] { (a[0].min(b[0]), a[0].max(b[0])) } else { (at(low).min(at(high)), at(low).max(at(high))) }
}

#[cfg(test)]
#[path = "tests/solids.rs"]
mod tests;
