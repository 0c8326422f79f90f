//! Stage 3: the map. Points, voxels or an occupancy image in, [`VoxelMap`] out.

mod boxes;
mod describe;
mod error;
mod header;
mod las;
mod lzf;
mod npy;
mod occupancy;
mod octomap;
mod pcd;
mod pgm;
mod ply;
mod points;
mod solids;
mod survey;
#[cfg(test)]
mod tests;
mod text;
mod turned;
mod voxelize;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use crate::diag::{Describe, Diagnostics, Source, Span};
use crate::geom::Aabb;
use crate::mission::{MapSpec, Unknown};

use error::MapError;
pub use survey::{Floor, Survey, survey};
use voxelize::Slab;

/// Cell size of point clouds where the mission gives none, m.
pub const DEFAULT_RESOLUTION: f64 = 0.05;
/// What lies lower is floor where the mission gives no `height_m`, m.
pub const FLOOR: f64 = 0.02;
/// Coordinates beyond this are not metres on a floor, m.
const FARTHEST: f64 = 1e6;

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
    /// Cells that are occupied only because the mission says so: keep-out areas and boxes.
    pub added: usize,
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

    /// Marks all cells of column (i, j).
    fn occupy_column(&mut self, i: usize, j: usize) {
        let at = (i * self.dims[1] + j) * self.words_per_column;
        let column = &mut self.bits[at..at + self.words_per_column];
        column.fill(u64::MAX);
        // Bits beyond the grid stay zero, or they would be counted.
        if let (Some(last), rest @ 1..) = (column.last_mut(), self.dims[2] % 64) {
            *last = (1 << rest) - 1;
        }
    }

    /// Marks, or clears, all cells from `low` to before `high`.
    fn set_box(&mut self, low: [usize; 3], high: [usize; 3], occupied: bool) {
        for word in low[2] / 64..high[2].div_ceil(64) {
            let from = low[2].saturating_sub(word * 64).min(64);
            let to = (high[2] - word * 64).min(64);
            if from >= to {
                continue;
            }
            let mask = (u64::MAX << from) & (u64::MAX >> (64 - to));
            for i in low[0]..high[0] {
                for j in low[1]..high[1] {
                    let bits = &mut self.bits[(i * self.dims[1] + j) * self.words_per_column + word];
                    *bits = if occupied { *bits | mask } else { *bits & !mask };
                }
            }
        }
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

    /// The occupied cells, in order of i, j, k.
    pub fn cells(&self) -> impl Iterator<Item = [usize; 3]> + '_ {
        let [_, ny, _] = self.dims;
        let words = self.words_per_column;
        self.bits.iter().enumerate().filter(|(_, bits)| **bits != 0).flat_map(move |(at, bits)| {
            let (column, word) = (at / words, at % words);
            (0..64).filter(move |b| bits >> b & 1 == 1).map(move |b| [column / ny, column % ny, word * 64 + b])
        })
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

/// Ending of a file's name in lower case, with its dot; empty without one.
fn ending(name: &str) -> String {
    Path::new(name).extension().map_or(String::new(), |e| format!(".{}", e.to_string_lossy().to_ascii_lowercase()))
}

/// The file that must (map_server image) or may (`.json` of voxels in `.npy`) lie beside a map file, as a path joined to the
/// map's folder; of one that must, where the map's file names it.
///
/// # Errors
/// Unreadable map_server YAML.
pub fn beside(name: &str, bytes: &[u8]) -> Result<Option<(PathBuf, Option<Span>)>, Diagnostics> {
    match ending(name).as_str() {
        ".yaml" | ".yml" => {
            let (image, named) = occupancy::image(name, bytes)
                .map_err(|faults| in_file(&MapInputs { name, bytes, beside: None }, faults))?;
            Ok(Some((image, Some(named))))
        }
        ".npy" if npy::axes(bytes) == Some(3) => Ok(Some((Path::new(name).with_extension("json"), None))),
        _ => Ok(None),
    }
}

/// Reads a map. `robot_height`: top of the robot over all postures, the default of `height_m`'s upper end.
///
/// The mission's keep-out areas and boxes are occupied cells of it like all others.
/// A map without any obstacle in the slab is legal; one without any finite point is not.
///
/// # Errors
/// All faults found: unknown format, lies in headers, truncated data, resolution that differs from the grid's own, no points.
/// All are bad input (exit 2); what is wrong in a header or in YAML has its place there, all others name the file.
pub fn parse(inputs: &MapInputs<'_>, spec: &MapSpec, robot_height: f64) -> Result<VoxelMap, Diagnostics> {
    read(inputs, spec, robot_height).map_err(|faults| in_file(inputs, faults))
}

/// The place of a word in a row of text, else of the row. Of a map of a million rows only that row is kept.
fn row(inputs: &MapInputs<'_>, line: u64, quoted: &str) -> Span {
    let before = usize::try_from(line).unwrap_or(usize::MAX).saturating_sub(1);
    let bytes = inputs.bytes.split(|b| *b == b'\n').nth(before).unwrap_or_default();
    let bytes = if before == 0 { bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes) } else { bytes };
    let row = String::from_utf8_lossy(bytes).trim_end().to_owned();
    let separates = |c: Option<char>| c.is_none_or(|c| c.is_whitespace() || matches!(c, ',' | ';' | '"'));
    let alone =
        |at: usize| separates(row[..at].chars().next_back()) && separates(row[at + quoted.len()..].chars().next());
    let word = row.match_indices(quoted).map(|(at, _)| at).find(|at| !quoted.is_empty() && alone(*at));
    let start = word.unwrap_or_else(|| row.len() - row.trim_start().len());
    let end = word.map_or(row.len(), |at| at + quoted.len());
    let source = Arc::new(Source { name: inputs.name.to_owned(), text: "\n".repeat(before) + &row });
    Span::new(&source, before + start..before + end)
}

/// Diagnostics of a file's faults: where no text can be quoted, the file is named, or the image that the file names.
fn in_file(inputs: &MapInputs<'_>, faults: Vec<MapError>) -> Diagnostics {
    let beside = inputs.beside.map(|(name, _)| name);
    let image = beside.filter(|_| [".yaml", ".yml"].contains(&ending(inputs.name).as_str()));
    let named = |fault: &MapError| {
        let diagnostic = fault.diagnostic();
        if let Some((line, quoted)) = fault.row() {
            return diagnostic.at(&row(inputs, line, quoted));
        }
        let about = if fault.is_of_pixels() { image } else { None };
        if diagnostic.at.is_some() { diagnostic } else { diagnostic.file(about.unwrap_or(inputs.name)) }
    };
    Diagnostics(faults.iter().map(named).collect())
}

fn read(inputs: &MapInputs<'_>, spec: &MapSpec, robot_height: f64) -> Result<VoxelMap, Vec<MapError>> {
    let [low, high] = spec.height.unwrap_or([FLOOR, robot_height.max(FLOOR)]);
    if low.is_nan() || high.is_nan() || low > high {
        return Err(vec![MapError::Slab { low, high }]);
    }
    let slab = Slab { low, high };
    let map = of_file(inputs, spec, slab)?;
    solids::added(map, spec, slab, robot_height).map_err(|fault| vec![fault])
}

/// The map as its file has it.
fn of_file(inputs: &MapInputs<'_>, spec: &MapSpec, slab: Slab) -> Result<VoxelMap, Vec<MapError>> {
    let MapInputs { name, bytes, beside } = *inputs;
    if let Some(value) = spec.resolution.filter(|r| !voxelize::usable(*r)) {
        return Err(vec![MapError::Resolution { value, at: None }]);
    }
    let points = match ending(name).as_str() {
        ".pcd" => pcd::read(name, bytes)?,
        ".ply" => ply::read(name, bytes)?,
        ".las" | ".laz" => las::read(bytes).map_err(|fault| vec![fault])?,
        ".xyz" | ".txt" | ".csv" => text::read(bytes).map_err(|fault| vec![fault])?,
        ".npy" => match npy::read(bytes).map_err(|fault| vec![fault])? {
            npy::Array::Points(points) => points,
            npy::Array::Voxels(voxels) => {
                let (resolution, origin) = grid(beside, spec)?;
                return voxelize::voxels(&voxels, resolution, origin, slab, spec.unknown).map_err(|fault| vec![fault]);
            }
        },
        ".yaml" | ".yml" => {
            let sheet = occupancy::sheet(name, bytes)?;
            let mut faults = origin_unused(spec);
            faults.extend(resolution_differs(spec, sheet.resolution));
            return match occupancy::voxels(&sheet, beside.map(|(_, image)| image), slab, spec.unknown) {
                Ok(map) if faults.is_empty() => Ok(map),
                Ok(_) => Err(faults),
                Err(fault) => Err(faults.into_iter().chain([fault]).collect()),
            };
        }
        ".bt" | ".ot" => {
            let tree = octomap::read(name, bytes)?;
            let faults = origin_unused(spec);
            if !faults.is_empty() {
                return Err(faults);
            }
            return tree.voxels(spec.resolution, slab, spec.unknown).map_err(|fault| vec![fault]);
        }
        ".pgm" | ".png" => {
            let sheet = Path::new(name).with_extension("yaml").display().to_string();
            return Err(vec![MapError::ImageAlone { sheet }]);
        }
        other => return Err(vec![MapError::Format { ending: other.to_owned() }]),
    };
    let faults = origin_unused(spec);
    if !faults.is_empty() {
        return Err(faults);
    }
    let resolution = spec.resolution.unwrap_or(DEFAULT_RESOLUTION);
    voxelize::points(&points, resolution, slab, spec.unknown).map_err(|fault| vec![fault])
}

fn origin_unused(spec: &MapSpec) -> Vec<MapError> {
    spec.origin.map(|_| MapError::OriginUnused).into_iter().collect()
}

fn resolution_differs(spec: &MapSpec, own: f64) -> Option<MapError> {
    let asked = spec.resolution.filter(|asked| (asked - own).abs() > 1e-9 * own)?;
    Some(MapError::ResolutionDiffers { asked, own })
}

/// What the `.json` beside a `.npy` may say; other keys are notes.
#[derive(serde::Deserialize, Default)]
struct Beside {
    resolution: Option<f64>,
    origin: Option<[f64; 3]>,
}

/// Cell size and lower corner of a `.npy` grid: the mission's origin wins; its resolution must agree.
/// What the JSON parser says of the file beside a map, and where.
fn description(name: &str, bytes: &[u8], error: &serde_json::Error) -> MapError {
    let words = error.to_string();
    let fault = words.split(" at line ").next().unwrap_or_default().to_owned();
    let source = Arc::new(Source { name: name.to_owned(), text: String::from_utf8_lossy(bytes).into_owned() });
    let text = source.text.as_str();
    let line: usize = text.split_inclusive('\n').take(error.line().saturating_sub(1)).map(str::len).sum();
    let mut at = (line + error.column().saturating_sub(1)).min(text.len());
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    let found = text[at..].chars().next().map_or("the end of the file".into(), |c| format!("`{c}`"));
    let place = Span::new(&source, at..at + text[at..].chars().next().map_or(0, char::len_utf8));
    MapError::Description { what: ".json beside it", fault: format!("{fault}, found {found}"), at: Some(place) }
}

fn grid(beside: Option<(&str, &[u8])>, spec: &MapSpec) -> Result<(f64, [f64; 3]), Vec<MapError>> {
    let written = match beside {
        None => Beside::default(),
        Some((name, bytes)) => serde_json::from_slice(bytes).map_err(|error| vec![description(name, bytes, &error)])?,
    };
    if let Some(value) = written.resolution.filter(|r| !voxelize::usable(*r)) {
        return Err(vec![MapError::Resolution { value, at: None }]);
    }
    if let Some(fault) = written.resolution.and_then(|own| resolution_differs(spec, own)) {
        return Err(vec![fault]);
    }
    let resolution = written.resolution.or(spec.resolution).ok_or_else(|| vec![MapError::NoResolution])?;
    let origin = spec.origin.or(written.origin).unwrap_or_default();
    if !origin.iter().all(|v| v.abs() <= FARTHEST) {
        return Err(vec![MapError::Origin { value: origin.to_vec(), limit: FARTHEST, at: None }]);
    }
    Ok((resolution, origin))
}
