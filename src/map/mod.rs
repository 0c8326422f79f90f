//! Stage 3: the map. Points, voxels or an occupancy image in, [`VoxelMap`] out.

use crate::diag::Diagnostics;
use crate::geom::Aabb;
use crate::mission::{MapSpec, Unknown};

/// Occupied cells of a grid, cut to the slab that holds obstacles. Cell (i, j, k) spans
/// `origin + resolution * (i, j, k)` to `origin + resolution * (i+1, j+1, k+1)`.
#[derive(Debug, Clone, PartialEq)]
pub struct VoxelMap {
    /// Cell size, m.
    pub resolution: f64,
    /// Lower corner of cell (0, 0, 0), m.
    pub origin: [f64; 3],
    /// Cells along x, y, z; all > 0. In x and y exactly the seen rectangle; in z at least all occupied cells.
    pub dims: [usize; 3],
    /// Whether space beyond the grid in x and y is an obstacle (`unknown: occupied`). Above and below is free.
    pub outside: Unknown,
    /// What the reader saw.
    pub statistics: MapStatistics,
    words_per_column: usize,
    /// Bit k of column (i, j), 64 cells a word, columns in order `i * dims[1] + j`.
    bits: Vec<u64>,
}

/// What the reader saw.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MapStatistics {
    /// Points in the file (point clouds).
    pub points: usize,
    /// Points with a coordinate that is not finite: skipped.
    pub not_finite: usize,
    /// Points or voxels outside `height_m`: cut.
    pub cut: usize,
    /// Cells that are occupied only because they are unknown.
    pub unknown: usize,
}

impl VoxelMap {
    /// An empty grid.
    pub fn new(resolution: f64, origin: [f64; 3], dims: [usize; 3], outside: Unknown) -> Self {
        let words_per_column = dims[2].div_ceil(64);
        let bits = vec![0; dims[0] * dims[1] * words_per_column];
        Self { resolution, origin, dims, outside, statistics: MapStatistics::default(), words_per_column, bits }
    }

    /// Marks a cell.
    pub fn occupy(&mut self, cell: [usize; 3]) {
        let at = (cell[0] * self.dims[1] + cell[1]) * self.words_per_column + cell[2] / 64;
        self.bits[at] |= 1 << (cell[2] % 64);
    }

    /// Whether a cell is occupied. The cell must be in the grid.
    pub fn occupied(&self, cell: [usize; 3]) -> bool {
        self.column(cell[0], cell[1])[cell[2] / 64] >> (cell[2] % 64) & 1 == 1
    }

    /// The bits of column (i, j): bit k of word k/64 is cell k.
    pub fn column(&self, i: usize, j: usize) -> &[u64] {
        let at = (i * self.dims[1] + j) * self.words_per_column;
        &self.bits[at..at + self.words_per_column]
    }

    /// Number of occupied cells.
    pub fn occupied_count(&self) -> usize {
        self.bits.iter().map(|w| w.count_ones() as usize).sum()
    }

    /// The cube of a cell.
    pub fn cube(&self, cell: [usize; 3]) -> Aabb {
        let low = |a: usize, c: usize| self.origin[a] + self.resolution * c as f64;
        Aabb {
            min: [low(0, cell[0]), low(1, cell[1]), low(2, cell[2])],
            max: [low(0, cell[0] + 1), low(1, cell[1] + 1), low(2, cell[2] + 1)],
        }
    }

    /// The whole grid.
    pub fn bounds(&self) -> Aabb {
        let top = |a: usize| self.origin[a] + self.resolution * self.dims[a] as f64;
        Aabb { min: self.origin, max: [top(0), top(1), top(2)] }
    }
}

/// A map file and those beside it.
pub struct MapInputs<'a> {
    /// Path as the user knows it; its ending says the format.
    pub name: &'a str,
    /// The file.
    pub bytes: &'a [u8],
    /// The file beside it, if the format has one: path and bytes of map_server's image, or of `.npy`'s `.json`.
    pub beside: Option<(&'a str, &'a [u8])>,
}

/// The file that must (map_server image) or may (`.json` of `.npy`) lie beside a map file, as a path joined to the map's
/// folder, and whether it must.
///
/// # Errors
/// Unreadable map_server YAML.
pub fn beside(name: &str, bytes: &[u8]) -> Result<Option<(std::path::PathBuf, bool)>, Diagnostics> {
    let _ = (name, bytes);
    todo!()
}

/// Reads a map. `robot_height`: top of the robot over all postures, the default of `height_m`'s upper end.
///
/// # Errors
/// All faults found: unknown format, lies in headers, truncated data, resolution that differs from the grid's own, no points.
pub fn parse(inputs: &MapInputs<'_>, spec: &MapSpec, robot_height: f64) -> Result<VoxelMap, Diagnostics> {
    let _ = (inputs.name, spec, robot_height);
    todo!()
}
