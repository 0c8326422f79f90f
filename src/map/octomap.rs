//! OctoMap: `.bt` (two bits a child) and `.ot` (a record a node). Which of the two it is, the first line says, not the ending.
//!
//! An own reader: no crate reads these. The tree is walked twice, once to check it and to find its bounds, once to mark cells, so
//! that nothing is held but the file and the grid. Cell c of the tree spans `c * resolution` to `(c + 1) * resolution`.

use super::error::{MapError, room};
use super::header::Header;
use super::points::quote;
use super::voxelize::{self, Slab};
use super::{FARTHEST, MapStatistics, VoxelMap};
use crate::mission::Unknown;

const BINARY: &str = "# Octomap OcTree binary file";
const FULL: &str = "# Octomap OcTree file";
/// Levels below the root: coordinates are 16 bits.
const DEPTH: u32 = 16;
/// Parts of a cell within which faces are one: rounding.
const TOUCH: f64 = 1e-6;

/// An octree whose header has been checked, and whose bytes have been walked through.
pub(super) struct Octree<'a> {
    /// Side of the smallest cell, m.
    pub(super) resolution: f64,
    layout: Layout,
    /// Nodes, by the header.
    nodes: u64,
    /// Where `data` begins in the file.
    begin: usize,
    data: &'a [u8],
    /// Lowest and highest cell of all leaves; the highest is the first beyond.
    bounds: [[i32; 3]; 2],
}

/// How nodes are written.
#[derive(Clone, Copy)]
enum Layout {
    /// Inner nodes only: two bits for each child.
    Bits,
    /// Every node: log-odds as f32, so many more bytes, then a bit for each child.
    Records { more: usize },
}

/// A cube of known space.
#[derive(Clone, Copy)]
struct Leaf {
    /// Lowest cell.
    low: [i32; 3],
    /// Cells along each side.
    side: i32,
    occupied: bool,
}

/// A node whose record is still to be read.
#[derive(Clone, Copy)]
struct Pending {
    low: [i32; 3],
    side: i32,
    depth: u32,
}

impl Pending {
    const ROOT: Self = Self { low: [-(1 << (DEPTH - 1)); 3], side: 1 << DEPTH, depth: 0 };

    /// Bit 0 of a child's number is along x, bit 1 along y, bit 2 along z.
    fn child(self, number: usize) -> Self {
        let side = self.side / 2;
        let low = [0, 1, 2].map(|a| self.low[a] + if number >> a & 1 == 1 { side } else { 0 });
        Self { low, side, depth: self.depth + 1 }
    }

    fn leaf(self, occupied: bool) -> Leaf {
        Leaf { low: self.low, side: self.side, occupied }
    }
}

/// Reads the header and walks through the tree.
pub(super) fn read<'a>(name: &str, bytes: &'a [u8]) -> Result<Octree<'a>, Vec<MapError>> {
    let binary = bytes.starts_with(BINARY.as_bytes());
    if !binary && !bytes.starts_with(FULL.as_bytes()) {
        let begin = "`# Octomap OcTree binary file` or `# Octomap OcTree file`";
        return Err(vec![MapError::NotThisFormat { format: "OctoMap", begin }]);
    }
    let header = Header::take(name, bytes, "data")
        .ok_or_else(|| vec![MapError::NoHeaderEnd { format: "OctoMap", last: "data" }])?;
    let (layout, nodes, resolution) = layout(&header, binary)?;
    let (begin, data) = (header.end, &bytes[header.end..]);
    let mut tree = Octree { resolution, layout, nodes, begin, data, bounds: [[i32::MAX; 3], [i32::MIN; 3]] };
    tree.check_length().map_err(|fault| vec![fault])?;
    let [mut low, mut high] = tree.bounds;
    tree.walk(|leaf| {
        for a in 0..3 {
            low[a] = low[a].min(leaf.low[a]);
            high[a] = high[a].max(leaf.low[a] + leaf.side);
        }
    })
    .map_err(|fault| vec![fault])?;
    if low[0] > high[0] {
        return Err(vec![MapError::NoLeaves]);
    }
    tree.bounds = [low, high];
    Ok(tree)
}

fn layout(header: &Header, binary: bool) -> Result<(Layout, u64, f64), Vec<MapError>> {
    let (mut id, mut size, mut resolution) = (None, None, None);
    let mut faults = Vec::new();
    for (words, at) in header.lines() {
        // Other words are other tools': OctoMap itself passes them by.
        if !["id", "size", "res"].contains(&words[0]) {
            continue;
        }
        let wrong = |expected| MapError::HeaderValue {
            word: words[0].to_owned(),
            value: quote(words[1..].join(" ").as_bytes()),
            expected,
            at: at.clone(),
        };
        let value = words.get(1).copied().unwrap_or_default();
        let seen = match words[0] {
            "id" => {
                // All kinds write the same bits; of records, those with more than occupancy are longer.
                let more = match value {
                    "OcTree" | "OcTreeStamped" | "1" => Some(0),
                    "ColorOcTree" => Some(3),
                    _ => None,
                };
                if more.is_none() {
                    faults.push(wrong("OcTree, ColorOcTree or OcTreeStamped"));
                }
                id.replace(more.unwrap_or(0)).is_some()
            }
            "size" => {
                let nodes = value.parse::<u64>().ok();
                if nodes.is_none() {
                    faults.push(wrong("a number of nodes"));
                }
                size.replace(nodes.unwrap_or(0)).is_some()
            }
            _ => {
                let cell = value.parse::<f64>().ok().filter(|r| voxelize::usable(*r));
                if cell.is_none() {
                    faults.push(wrong("the smallest cell's side in metres"));
                }
                resolution.replace(cell.unwrap_or(1.0)).is_some()
            }
        };
        if seen {
            faults.push(MapError::HeaderTwice { word: words[0].to_owned(), at });
        }
    }
    for (word, there) in [("id", id.is_some()), ("size", size.is_some()), ("res", resolution.is_some())] {
        if !there {
            faults.push(MapError::HeaderMissing { format: "OctoMap", word });
        }
    }
    match (id, size, resolution) {
        (Some(more), Some(size), Some(resolution)) if faults.is_empty() => {
            let layout = if binary { Layout::Bits } else { Layout::Records { more } };
            Ok((layout, size, resolution))
        }
        _ => Err(faults),
    }
}

impl Octree<'_> {
    /// What the number of nodes says of the number of bytes, before any of them is looked at.
    fn check_length(&self) -> Result<(), MapError> {
        let (unit, promised, have_bytes) = ("nodes", u128::from(self.nodes), self.data.len() as u128);
        match self.layout {
            // At least two bytes for each eight nodes below the root; how many exactly the walk finds out.
            Layout::Bits => {
                let promised_bytes = 2 * promised.saturating_sub(1).div_ceil(8);
                if have_bytes < promised_bytes {
                    return Err(MapError::Truncated { unit, promised, promised_bytes, have_bytes });
                }
            }
            Layout::Records { more } => {
                let promised_bytes = promised * (5 + more) as u128;
                if have_bytes < promised_bytes {
                    return Err(MapError::Truncated { unit, promised, promised_bytes, have_bytes });
                }
                if have_bytes > promised_bytes {
                    return Err(MapError::Surplus { unit, promised, promised_bytes, have_bytes });
                }
            }
        }
        Ok(())
    }

    /// Calls `f` for every leaf, in the file's order: depth first.
    fn walk(&self, f: impl FnMut(Leaf)) -> Result<(), MapError> {
        if self.nodes == 0 {
            return Err(MapError::NoLeaves);
        }
        let (end, seen) = match self.layout {
            Layout::Bits => self.walk_bits(f)?,
            Layout::Records { more } => self.walk_records(more, f)?,
        };
        if seen != self.nodes || end != self.data.len() {
            let (at, left) = (self.begin + end, self.data.len() - end);
            return Err(MapError::NodesDiffer { at, promised: self.nodes, have: seen, left });
        }
        Ok(())
    }

    /// Where the tree ends, and how many nodes it has.
    fn walk_bits(&self, mut f: impl FnMut(Leaf)) -> Result<(usize, u64), MapError> {
        let (mut at, mut seen) = (0, 1);
        let mut pending = vec![Pending::ROOT];
        while let Some(node) = pending.pop() {
            let Some([low, high]) = self.data.get(at..at + 2) else { return Err(self.cut(at, 2, seen)) };
            at += 2;
            let bits = u16::from_le_bytes([*low, *high]);
            let inner = pending.len();
            for number in 0..8 {
                let state = bits >> (2 * number) & 3;
                if state == 0 {
                    continue;
                }
                seen += 1;
                let child = node.child(number);
                match state {
                    3 if child.depth >= DEPTH => {
                        return Err(MapError::TooDeep { at: self.begin + at - 2, depth: DEPTH });
                    }
                    3 => pending.push(child),
                    _ => f(child.leaf(state == 2)),
                }
            }
            // The first child is read first.
            pending[inner..].reverse();
        }
        Ok((at, seen))
    }

    fn walk_records(&self, more: usize, mut f: impl FnMut(Leaf)) -> Result<(usize, u64), MapError> {
        let (mut at, mut seen) = (0, 0);
        let mut pending = vec![Pending::ROOT];
        while let Some(node) = pending.pop() {
            let size = 5 + more;
            let Some(record) = self.data.get(at..at + size) else { return Err(self.cut(at, size, seen)) };
            let log_odds = f32::from_le_bytes([record[0], record[1], record[2], record[3]]);
            let children = record[size - 1];
            seen += 1;
            if log_odds.is_nan() {
                return Err(MapError::NoOccupancy { at: self.begin + at });
            }
            if children == 0 {
                // OctoMap's own threshold, a probability of one half; files do not hold any other.
                f(node.leaf(log_odds >= 0.0));
            } else if node.depth >= DEPTH {
                return Err(MapError::TooDeep { at: self.begin + at, depth: DEPTH });
            }
            pending.extend((0..8).rev().filter(|number| children >> number & 1 == 1).map(|number| node.child(number)));
            at += size;
        }
        Ok((at, seen))
    }

    fn cut(&self, at: usize, needs: usize, seen: u64) -> MapError {
        let have = self.data.len().saturating_sub(at);
        MapError::TreeCut { at: self.begin + at, needs, have, seen, promised: self.nodes }
    }

    /// The tree's cells: those whose centre lies in the slab, as whole cubes; then, where other cells are asked for, all of
    /// those that any of them overlaps.
    pub(super) fn voxels(&self, asked: Option<f64>, slab: Slab, unknown: Unknown) -> Result<VoxelMap, MapError> {
        let own = self.own_cells(slab, unknown)?;
        let Some(asked) = asked.filter(|asked| (asked - self.resolution).abs() > 1e-9 * self.resolution) else {
            return Ok(own);
        };
        let mut map = cover(&own, asked)?;
        if unknown == Unknown::Occupied {
            // What is left without the unknown cells is occupied for its own sake.
            let known = cover(&self.own_cells(slab, Unknown::Free)?, asked)?;
            map.statistics.unknown = map.occupied_count() - known.occupied_count();
        }
        Ok(map)
    }

    /// Centres of the occupied cells at any height, of the tree's own size.
    pub(super) fn centres(&self, slab: Slab) -> Result<Vec<[f64; 3]>, MapError> {
        let map = self.own_cells(slab, Unknown::Free)?;
        let centre = |cell| {
            let cube = map.cube(cell);
            [0, 1, 2].map(|a| 0.5 * (cube.min[a] + cube.max[a]))
        };
        // One large leaf is a bit a cell in the grid, and two hundred times as much here.
        let count = map.occupied_count();
        room("the centres of the occupied cells", count as u128 * size_of::<[f64; 3]>() as u128)?;
        let mut centres = Vec::with_capacity(count);
        centres.extend(map.cells().map(centre));
        Ok(centres)
    }

    /// Cells of the tree's own size. The grid is the box around all leaves, cut to the slab.
    fn own_cells(&self, slab: Slab, unknown: Unknown) -> Result<VoxelMap, MapError> {
        let [low, high] = self.bounds;
        let side = |cells: i32| f64::from(cells) * self.resolution;
        for a in 0..3 {
            if let Some(value) = [low[a], high[a]].map(side).into_iter().find(|v| v.abs() > FARTHEST) {
                return Err(MapError::FarAway { value, axis: b"xyz"[a] as char, limit: FARTHEST });
            }
        }
        let kept = |k: &i32| slab.holds((f64::from(*k) + 0.5) * self.resolution);
        let first = (low[2]..high[2]).find(kept);
        let (bottom, top) = match first {
            Some(first) => (first, (first..high[2]).rev().find(kept).unwrap_or(first) + 1),
            // Nothing in the slab: no obstacles, one layer high.
            None => (low[2], low[2] + 1),
        };
        let corner = [low[0], low[1], bottom];
        let dims =
            voxelize::checked([high[0] - low[0], high[1] - low[1], top - bottom].map(i64::from), self.resolution)
                .map_err(|fault| match fault {
                    // Other cells would be made of these, so asking for larger ones is no help.
                    MapError::TooLarge { dims, resolution, .. } => {
                        MapError::TooLarge { dims, resolution, enough: None }
                    }
                    other => other,
                })?;
        let mut map = VoxelMap::new(self.resolution, corner.map(side), dims, unknown);
        let mut statistics = MapStatistics::default();
        if first.is_none() {
            self.walk(|leaf| statistics.cut += if leaf.occupied { (leaf.side as usize).pow(3) } else { 0 })?;
            map.statistics = statistics;
            return Ok(map);
        }
        let seen_matters = unknown == Unknown::Occupied;
        if seen_matters {
            map.set_box([0; 3], dims, true);
        }
        let mut occupied = 0;
        self.walk(|leaf| {
            let from = [0, 1, 2].map(|a| (leaf.low[a] - corner[a]).clamp(0, dims[a] as i32) as usize);
            let to = [0, 1, 2].map(|a| (leaf.low[a] + leaf.side - corner[a]).clamp(0, dims[a] as i32) as usize);
            if leaf.occupied {
                let within = (to[0] - from[0]) * (to[1] - from[1]) * (to[2] - from[2]);
                occupied += within;
                statistics.cut += (leaf.side as usize).pow(3) - within;
            }
            if leaf.occupied || seen_matters {
                map.set_box(from, to, leaf.occupied);
            }
        })?;
        if seen_matters {
            statistics.unknown = map.occupied_count() - occupied;
        }
        map.statistics = statistics;
        Ok(map)
    }
}

/// Cells of another size, aligned with the map frame's origin: occupied is each that overlaps an occupied one, or that reaches
/// beyond the grid sideways where that is an obstacle.
fn cover(own: &VoxelMap, resolution: f64) -> Result<VoxelMap, MapError> {
    // First cell and cells along each axis; of each the range of own cells that it overlaps, and whether it reaches beyond them.
    let axis = |a: usize| {
        let (low, high) = (own.origin[a], own.origin[a] + own.resolution * own.dims[a] as f64);
        let first = (low / resolution + TOUCH).floor() as i64;
        let last = (high / resolution - TOUCH).ceil() as i64;
        (first, last.max(first + 1) - first)
    };
    let axes = [axis(0), axis(1), axis(2)];
    let dims = voxelize::checked(axes.map(|(_, cells)| cells), resolution)?;
    let ranges = |a: usize| -> Vec<(usize, usize, bool)> {
        let range = |c: usize| {
            let low = ((axes[a].0 + c as i64) as f64 * resolution - own.origin[a]) / own.resolution;
            let high = low + resolution / own.resolution;
            let from = (low + TOUCH).floor().max(0.0) as usize;
            let to = (high - TOUCH).ceil().max(0.0) as usize;
            (from, to.min(own.dims[a]), low < -TOUCH || high > own.dims[a] as f64 + TOUCH)
        };
        (0..dims[a]).map(range).collect()
    };
    let [along_x, along_y, along_z] = [ranges(0), ranges(1), ranges(2)];
    let mut map = VoxelMap::new(resolution, axes.map(|(first, _)| first as f64 * resolution), dims, own.outside);
    map.statistics = own.statistics.clone();
    let walled = own.outside == Unknown::Occupied;
    let mut any = vec![0u64; own.dims[2].div_ceil(64)];
    for (i, (x_from, x_to, x_beyond)) in along_x.into_iter().enumerate() {
        for (j, (y_from, y_to, y_beyond)) in along_y.iter().copied().enumerate() {
            if walled && (x_beyond || y_beyond) {
                map.set_box([i, j, 0], [i + 1, j + 1, dims[2]], true);
                continue;
            }
            any.fill(0);
            for (x, y) in (x_from..x_to).flat_map(|x| (y_from..y_to).map(move |y| (x, y))) {
                any.iter_mut().zip(own.column(x, y)).for_each(|(any, bits)| *any |= bits);
            }
            for (k, (from, to, _)) in along_z.iter().copied().enumerate() {
                if (from..to).any(|z| any[z / 64] >> (z % 64) & 1 == 1) {
                    map.occupy([i, j, k]);
                }
            }
        }
    }
    Ok(map)
}
