//! map_server: a YAML sheet and a grey image, seen from above.

use std::path::PathBuf;
use std::sync::Arc;

use serde::Deserialize;
use serde_saphyr::Spanned;

use super::error::{MapError, room};
use super::points::quote;
use super::{FARTHEST, pgm, turned, voxelize};
use super::{VoxelMap, voxelize::Slab};
use crate::diag::{Source, Span};
use crate::mission::Unknown;

/// Columns need not be higher than this, m, whatever `height_m` says: no robot is.
const TALLEST: f64 = 10.0;

/// map_server's YAML as written; keys of other tools are ignored.
#[derive(Deserialize)]
struct Written {
    image: Spanned<String>,
    resolution: Spanned<f64>,
    origin: Spanned<Vec<f64>>,
    negate: Option<Flag>,
    occupied_thresh: Option<Spanned<f64>>,
    free_thresh: Option<Spanned<f64>>,
    mode: Option<Spanned<String>>,
}

/// map_server writes 0 or 1, people also false or true.
#[derive(Deserialize)]
#[serde(untagged)]
enum Flag {
    Bool(bool),
    Number(f64),
}

/// How map_server makes an occupancy of a pixel.
#[derive(Clone, Copy, PartialEq)]
enum Mode {
    /// Occupied above one threshold, free below the other, unknown between them.
    Trinary,
    /// The same, but between them it is seen and not sure.
    Scale,
    /// The pixel is the occupancy in per cent; above 100 is unknown.
    Raw,
}

/// The sheet, checked.
pub(super) struct Sheet {
    image: String,
    image_at: Span,
    pub(super) resolution: f64,
    origin: [f64; 2],
    /// How far the image is turned about that corner, from x to y, rad.
    yaw: f64,
    mode: Mode,
    negate: bool,
    occupied: f64,
    free: f64,
}

/// The image's path, joined to the sheet's folder, and where the sheet names it.
pub(super) fn image(name: &str, bytes: &[u8]) -> Result<(PathBuf, Span), Vec<MapError>> {
    let sheet = sheet(name, bytes)?;
    Ok((std::path::Path::new(name).parent().unwrap_or(std::path::Path::new("")).join(sheet.image), sheet.image_at))
}

/// Reads the YAML.
pub(super) fn sheet(name: &str, bytes: &[u8]) -> Result<Sheet, Vec<MapError>> {
    let description = |fault: String, at| vec![MapError::Description { what: "YAML", fault, at }];
    let text =
        std::str::from_utf8(bytes).map_err(|e| description(format!("no text after byte {}", e.valid_up_to()), None))?;
    let source = Arc::new(Source { name: name.to_owned(), text: text.to_owned() });
    let written: Written = serde_saphyr::from_str(text).map_err(|error| {
        let mut at = error.location().map(|l| span(&source, l));
        // The first line says what is wrong; the rest would quote the text once more.
        let words = error.without_snippet().to_string();
        let words = words.lines().next().unwrap_or("not YAML");
        let mut fault =
            words.split(" at line ").next().unwrap_or(words).replace("invalid floating point", "expected a number");
        if fault.starts_with("missing field") {
            // No line of the sheet is to blame.
            at = Some(Span::new(&source, 0..text.lines().next().map_or(0, str::len)));
        } else if let Some(at) = &at {
            fault += &format!(", found `{}`", quote(text[at.range.clone()].as_bytes()));
        }
        description(fault, at)
    })?;
    let mut faults = Vec::new();
    let resolution = written.resolution.value;
    if !voxelize::usable(resolution) {
        let at = Some(span(&source, written.resolution.referenced));
        faults.push(MapError::Resolution { value: resolution, at });
    }
    let origin = &written.origin.value;
    let origin_at = span(&source, written.origin.referenced);
    let usable = |v: &f64| v.abs() <= FARTHEST; // false for NaN
    if !(2..=3).contains(&origin.len()) || !origin.iter().all(usable) {
        faults.push(MapError::Origin { value: origin.clone(), limit: FARTHEST, at: Some(origin_at) });
    }
    for (threshold, name) in [(&written.occupied_thresh, "occupied_thresh"), (&written.free_thresh, "free_thresh")] {
        if let Some(threshold) = threshold.as_ref().filter(|t| !(0.0..=1.0).contains(&t.value)) {
            let (word, value) = (name.to_owned(), threshold.value.to_string());
            let at = span(&source, threshold.referenced);
            faults.push(MapError::HeaderValue { word, value, expected: "a number from 0 to 1", at });
        }
    }
    let mode = match written.mode.as_ref().map_or("trinary", |mode| mode.value.as_str()) {
        "scale" => Mode::Scale,
        "raw" => Mode::Raw,
        _ => Mode::Trinary,
    };
    let modes = ["trinary", "scale", "raw"];
    if let Some(mode) = written.mode.as_ref().filter(|mode| !modes.contains(&mode.value.as_str())) {
        faults.push(MapError::Mode { mode: mode.value.clone(), at: span(&source, mode.referenced) });
    }
    if !faults.is_empty() {
        return Err(faults);
    }
    Ok(Sheet {
        image_at: span(&source, written.image.referenced),
        image: written.image.value,
        resolution,
        origin: [origin[0], origin[1]],
        yaw: origin.get(2).copied().unwrap_or(0.0),
        mode,
        negate: written.negate.is_some_and(|flag| match flag {
            Flag::Bool(flag) => flag,
            Flag::Number(number) => number != 0.0,
        }),
        occupied: written.occupied_thresh.map_or(0.65, |t| t.value),
        free: written.free_thresh.map_or(0.196, |t| t.value),
    })
}

/// The place of a value in the text.
fn span(source: &Arc<Source>, location: serde_saphyr::Location) -> Span {
    let (line, column) = (location.line().saturating_sub(1) as usize, location.column().saturating_sub(1) as usize);
    let start = source.text.split_inclusive('\n').take(line).map(str::len).sum::<usize>();
    let rest = &source.text[start..];
    let begin: usize = rest.chars().take(column).map(char::len_utf8).sum();
    let length = rest[begin..].find('\n').unwrap_or(rest.len() - begin);
    let shown = rest[begin..begin + length].trim_end().len();
    Span::new(source, start + begin..start + begin + shown)
}

/// What a pixel says; the greater hides the less.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Seen {
    Free,
    Unknown,
    Occupied,
}

impl Sheet {
    /// What a pixel of this lightness, 0 (black) to 1, says.
    ///
    /// As map_server does it; of \[0, 100\], which it makes of `scale` and `raw`, all counts as an obstacle that is not free by the
    /// thresholds: it was seen, and nobody says that it can be driven on.
    fn meaning(&self, light: f64) -> Seen {
        let filled = if self.negate { light } else { 1.0 - light };
        match self.mode {
            Mode::Trinary | Mode::Scale if filled > self.occupied => Seen::Occupied,
            Mode::Trinary | Mode::Scale if filled < self.free => Seen::Free,
            Mode::Trinary => Seen::Unknown,
            Mode::Scale => Seen::Occupied,
            Mode::Raw => {
                let light = if self.negate { 1.0 - light } else { light };
                match (light * 255.0).round() {
                    percent if percent > 100.0 => Seen::Unknown,
                    percent if percent / 100.0 < self.free => Seen::Free,
                    _ => Seen::Occupied,
                }
            }
        }
    }
}

/// Makes columns of the image's occupied pixels, from the floor to the slab's upper end.
pub(super) fn voxels(sheet: &Sheet, image: Option<&[u8]>, slab: Slab, unknown: Unknown) -> Result<VoxelMap, MapError> {
    let missing = || MapError::NoImage { image: sheet.image.clone(), at: sheet.image_at.clone() };
    let image = pgm::read(image.ok_or_else(missing)?)?;
    let bottom = slab.low.min(0.0);
    let top = slab.high.min(TALLEST).max(bottom);
    // Cells that reach `top`; a hair above a whole number of cells is rounding.
    let layers = ((top - bottom) / sheet.resolution - 1e-9).ceil().max(1.0);
    let [width, height] = turned::size(image.width, image.height, sheet.yaw);
    voxelize::checked([width, height, layers as i64], sheet.resolution)?;
    // A byte a cell before and after it is turned.
    room("the turned image", 2 * width as u128 * height as u128)?;
    let meaning: Vec<Seen> =
        (0..=image.max).map(|value| sheet.meaning(f64::from(value) / f64::from(image.max))).collect();
    // The top row is the largest y.
    let rows = image.pixels.chunks_exact(image.width).rev();
    let cells = rows.flatten().map(|pixel| meaning[usize::from(*pixel)]).collect();
    let upright = turned::Sheet { width: image.width, height: image.height, cells };
    let (seen, corner) = turned::turn(upright, sheet.yaw);
    let origin = [0, 1].map(|a| sheet.origin[a] + corner[a] * sheet.resolution);
    let size = [seen.width, seen.height, layers as usize];
    let mut map = VoxelMap::new(sheet.resolution, [origin[0], origin[1], bottom], size, unknown);
    for (at, seen_here) in seen.cells.iter().enumerate() {
        let only_unknown = *seen_here == Seen::Unknown && unknown == Unknown::Occupied;
        if only_unknown {
            map.statistics.unknown += size[2];
        }
        if only_unknown || *seen_here == Seen::Occupied {
            map.occupy_column(at % seen.width, at / seen.width);
        }
    }
    Ok(map)
}
