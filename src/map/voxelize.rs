//! From points and voxels to the cells of a [`VoxelMap`].

use super::error::MapError;
use super::npy::Voxels;
use super::points::Points;
use super::{FARTHEST, MapStatistics, VoxelMap};
use crate::math::real;
use crate::memory;
use crate::mission::Unknown;

/// Most cells of a grid. At one bit each that is half a gigabyte; a distance field of it would take 16.
const MOST_CELLS: u128 = 4_000_000_000;
/// Most 64-bit words of a grid, which bounds flat grids: 2 GiB.
const MOST_WORDS: u128 = 1 << 28;

/// The heights that hold obstacles, m; both ends belong to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Slab {
    pub(super) low: f64,
    pub(super) high: f64,
}

impl Slab {
    pub(super) fn holds(self, z: f64) -> bool {
        self.low <= z && z <= self.high
    }
}

/// Whether a cell size can be used: indices of cells within [`FARTHEST`] metres stay far inside i64.
pub(super) fn usable(resolution: f64) -> bool {
    (1e-6..=FARTHEST).contains(&resolution)
}

/// The cell that holds coordinate `p`: floor(p / resolution), in f64.
pub(super) fn cell(p: f64, resolution: f64) -> i64 {
    let quotient = p / resolution;
    let truncated = quotient as i64;
    truncated - i64::from(truncated as f64 > quotient)
}

/// The size of a grid, if it can be handled. All of `cells` are > 0.
pub(super) fn checked(cells: [i64; 3], resolution: f64) -> Result<[usize; 3], MapError> {
    let fits = |n: [u128; 3]| {
        let columns = n[0].saturating_mul(n[1]);
        let words = columns.saturating_mul(n[2].div_ceil(64));
        columns.saturating_mul(n[2]) <= MOST_CELLS && words <= MOST_WORDS && memory::fits(8 * words).is_ok()
    };
    let cells = cells.map(|n| n.max(1) as u64);
    if fits(cells.map(u128::from)) {
        return Ok(cells.map(|n| n as usize));
    }
    // The next coarser cell of two digits that would do: 0.05, 0.06, 0.07, 0.08, 0.09, 0.1, 0.2, ...
    let mut enough = resolution;
    for _ in 0..1000 {
        let digit = real::powf(10.0, real::log10(enough).floor());
        enough = ((enough / digit + 1e-6).floor() + 1.0) * digit;
        if fits(cells.map(|n| (n as f64 * resolution / enough).ceil() as u128 + 1)) {
            break;
        }
    }
    let enough = (enough * 1e9).round() / 1e9;
    Err(MapError::TooLarge { dims: cells, resolution, enough: Some(enough) })
}

/// Voxels of a point cloud: cell floor(p / resolution) of every point in the slab. The grid's rectangle is that of all finite
/// points, grown to whole cells.
pub(super) fn points(points: &Points<'_>, resolution: f64, slab: Slab, outside: Unknown) -> Result<VoxelMap, MapError> {
    let mut statistics = MapStatistics { points: points.len(), ..Default::default() };
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    let (mut lowest, mut highest) = (f64::INFINITY, f64::NEG_INFINITY);
    points.for_each(|p| {
        // NaN and infinities survive a multiplication by zero.
        if (p[0] + p[1] + p[2]) * 0.0 != 0.0 && !p.iter().all(|c| c.is_finite()) {
            statistics.not_finite += 1;
            return;
        }
        for a in 0..3 {
            low[a] = if p[a] < low[a] { p[a] } else { low[a] };
            high[a] = if p[a] > high[a] { p[a] } else { high[a] };
        }
        if slab.holds(p[2]) {
            lowest = if p[2] < lowest { p[2] } else { lowest };
            highest = if p[2] > highest { p[2] } else { highest };
        } else {
            statistics.cut += 1;
        }
    });
    if statistics.points == statistics.not_finite {
        return Err(MapError::NoPoints { points: statistics.points, not_finite: statistics.not_finite });
    }
    for a in 0..3 {
        if let Some(value) = [low[a], high[a]].into_iter().find(|v| v.abs() > FARTHEST) {
            return Err(MapError::FarAway { value, axis: b"xyz"[a] as char, limit: FARTHEST });
        }
    }
    if lowest > highest {
        // Nothing in the slab: a map without obstacles, one layer high.
        lowest = slab.low.clamp(low[2], high[2]);
        highest = lowest;
    }
    let first = [cell(low[0], resolution), cell(low[1], resolution), cell(lowest, resolution)];
    let last = [cell(high[0], resolution), cell(high[1], resolution), cell(highest, resolution)];
    let dims = checked([0, 1, 2].map(|a| last[a] - first[a] + 1), resolution)?;
    let mut map = VoxelMap::new(resolution, first.map(|c| c as f64 * resolution), dims, outside);
    points.for_each(|p| {
        // All finite points lie within FARTHEST: what does not is NaN or infinite.
        if slab.holds(p[2]) && p.iter().all(|c| c.abs() <= FARTHEST) {
            map.occupy([0, 1, 2].map(|a| (cell(p[a], resolution) - first[a]) as usize));
        }
    });
    map.statistics = statistics;
    Ok(map)
}

/// Voxels of a dense grid with its lower corner at `origin`: those whose centre lies in the slab, as whole cubes.
pub(super) fn voxels(
    voxels: &Voxels<'_>,
    resolution: f64,
    origin: [f64; 3],
    slab: Slab,
    outside: Unknown,
) -> Result<VoxelMap, MapError> {
    let [nx, ny, nz] = voxels.shape;
    checked(voxels.shape.map(|n| n as i64), resolution)?;
    let kept = |k: usize| slab.holds((k as f64 + 0.5) * resolution + origin[2]);
    let mut statistics = MapStatistics::default();
    let (mut first, mut last) = (usize::MAX, 0);
    for (i, j) in (0..nx).flat_map(|i| (0..ny).map(move |j| (i, j))) {
        for k in (0..nz).filter(|k| voxels.occupied(i, j, *k)) {
            if kept(k) {
                first = first.min(k);
                last = last.max(k);
            } else {
                statistics.cut += 1;
            }
        }
    }
    if first == usize::MAX {
        first = (0..nz).find(|k| kept(*k)).unwrap_or(0);
        last = first;
    }
    let corner = [origin[0], origin[1], origin[2] + first as f64 * resolution];
    let mut map = VoxelMap::new(resolution, corner, [nx, ny, last - first + 1], outside);
    for (i, j) in (0..nx).flat_map(|i| (0..ny).map(move |j| (i, j))) {
        for k in (first..=last).filter(|k| kept(*k) && voxels.occupied(i, j, *k)) {
            map.occupy([i, j, k - first]);
        }
    }
    map.statistics = statistics;
    Ok(map)
}
