//! What a map's maker measured, floor included: at which heights, and where the floor seems to be.

use std::fmt::Write;

use super::error::MapError;
use super::points::Points;
use super::voxelize::Slab;
use super::{FARTHEST, MapInputs, ending, in_file, las, npy, octomap, pcd, ply, text};
use crate::diag::Diagnostics;
use crate::math::real;

/// Rows of the table of heights.
const BINS: usize = 12;
/// Columns of floor are at least so wide, m, and at most so many along each axis.
const COLUMN: f64 = 0.5;
const MOST_COLUMNS: usize = 400;
/// A column belongs to the floor whose lowest point is as near to the plane as this, m.
const NEAR: f64 = 0.05;
/// What is steeper is no floor that anybody drives on, rad: 20 degrees.
const STEEPEST: f64 = 0.35;
/// Tolerances of the fits, one after the other, m: the first is to leave out what is no floor at all.
const TOLERANCES: [f64; 8] = [0.4, 0.4, 0.2, 0.2, 0.1, 0.1, NEAR, NEAR];

const EVERYWHERE: Slab = Slab { low: f64::NEG_INFINITY, high: f64::INFINITY };

/// Heights and floor of a cloud or of an octree's occupied leaves.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// Lowest and highest coordinate of all that is finite, m.
    pub bounds: [[f64; 3]; 2],
    /// Points in equal parts of the range of heights, from the lowest up.
    pub heights: [usize; BINS],
    /// `None`: fewer than three columns, or no plane near any of them.
    pub floor: Option<Floor>,
}

/// The plane that most of the lowest points lie on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Floor {
    /// Height at the middle of the bounds, m.
    pub level: f64,
    /// Rise along x and y.
    pub slope: [f64; 2],
    /// Share of the columns of half a metre whose lowest point is within 5 cm of it.
    pub share: f64,
}

impl Floor {
    /// Angle between the plane and the horizontal, rad.
    pub fn tilt(&self) -> f64 {
        real::atan(real::hypot(self.slope[0], self.slope[1]))
    }
}

/// Looks at a point cloud or an octree; `None` for images and dense grids, whose heights are the grid's.
///
/// # Errors
/// As [`super::parse`].
pub fn survey(inputs: &MapInputs<'_>) -> Result<Option<Survey>, Diagnostics> {
    let faults = |faults: Vec<MapError>| in_file(inputs, faults);
    let one = |fault: MapError| faults(vec![fault]);
    let (name, bytes) = (inputs.name, inputs.bytes);
    let points = match ending(name).as_str() {
        ".pcd" => pcd::read(name, bytes).map_err(faults)?,
        ".ply" => ply::read(name, bytes).map_err(faults)?,
        ".las" | ".laz" => las::read(bytes).map_err(one)?,
        ".xyz" | ".txt" | ".csv" => text::read(bytes).map_err(one)?,
        ".npy" => match npy::read(bytes).map_err(one)? {
            npy::Array::Points(points) => points,
            npy::Array::Voxels(_) => return Ok(None),
        },
        ".bt" | ".ot" => {
            let tree = octomap::read(name, bytes).map_err(faults)?;
            Points::List(tree.centres(EVERYWHERE).map_err(one)?)
        }
        _ => return Ok(None),
    };
    Ok(of(&points))
}

fn of(points: &Points<'_>) -> Option<Survey> {
    let usable = |p: &[f64; 3]| p.iter().all(|c| c.abs() <= FARTHEST);
    let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
    points.for_each(|p| {
        if usable(&p) {
            (0..3).for_each(|a| (bounds[0][a], bounds[1][a]) = (bounds[0][a].min(p[a]), bounds[1][a].max(p[a])));
        }
    });
    let [low, high] = bounds;
    if low[0] > high[0] {
        return None;
    }
    let extent = [0, 1].map(|a| high[a] - low[a]);
    let side = COLUMN.max(extent[0].max(extent[1]) / MOST_COLUMNS as f64);
    let size = extent.map(|e| (e / side) as usize + 1);
    let (mut lowest, mut heights) = (vec![f64::INFINITY; size[0] * size[1]], [0; BINS]);
    let scale = BINS as f64 / (high[2] - low[2]).max(f64::MIN_POSITIVE);
    points.for_each(|p| {
        if usable(&p) {
            heights[(((p[2] - low[2]) * scale) as usize).min(BINS - 1)] += 1;
            let [i, j] = [0, 1].map(|a| (((p[a] - low[a]) / side) as usize).min(size[a] - 1));
            let column = &mut lowest[i * size[1] + j];
            *column = column.min(p[2]);
        }
    });
    let middle = [0, 1].map(|a| 0.5 * (low[a] + high[a]));
    let place = |at: usize| [0, 1].map(|a| low[a] + side * ([at / size[1], at % size[1]][a] as f64 + 0.5) - middle[a]);
    let columns: Vec<[f64; 3]> = lowest
        .iter()
        .enumerate()
        .filter(|(_, z)| z.is_finite())
        .map(|(at, z)| [place(at)[0], place(at)[1], *z])
        .collect();
    Some(Survey { bounds, heights, floor: floor(&columns) })
}

/// Least squares over the columns near the plane so far, which begins level at their median.
fn floor(columns: &[[f64; 3]]) -> Option<Floor> {
    if columns.len() < 3 {
        return None;
    }
    let mut sorted: Vec<f64> = columns.iter().map(|c| c[2]).collect();
    sorted.sort_by(f64::total_cmp);
    let mut plane = [sorted[sorted.len() / 2], 0.0, 0.0];
    let near = |plane: &[f64; 3], c: &[f64; 3], within: f64| {
        (plane[0] + plane[1] * c[0] + plane[2] * c[1] - c[2]).abs() <= within
    };
    for within in TOLERANCES {
        let (mut normal, mut right) = (nalgebra::Matrix3::zeros(), nalgebra::Vector3::zeros());
        for c in columns.iter().filter(|c| near(&plane, c, within)) {
            let row = nalgebra::Vector3::new(1.0, c[0], c[1]);
            normal += row * row.transpose();
            right += row * c[2];
        }
        // Columns in one line say nothing of the slope across it.
        let solved = normal.try_inverse().map(|inverse| inverse * right).filter(|s| s.iter().all(|v| v.is_finite()));
        plane = solved.map_or(plane, |s| [s[0], s[1], s[2]]);
    }
    let share = columns.iter().filter(|c| near(&plane, c, NEAR)).count() as f64 / columns.len() as f64;
    let floor = Floor { level: plane[0], slope: [plane[1], plane[2]], share };
    (share > 0.0 && floor.tilt() <= STEEPEST).then_some(floor)
}

impl Survey {
    /// Extent, floor and heights in words.
    pub fn describe(&self) -> String {
        let [low, high] = self.bounds;
        let range = |a: usize| format!("{:.3} to {:.3}", low[a], high[a]);
        let mut out = format!("{:<12}x {} m, y {} m, z {} m\n", "measured", range(0), range(1), range(2));
        let floor = match &self.floor {
            Some(f) if f.share >= 0.3 => format!(
                "about z {:.3} m in the middle, tilted by {:.2} deg; {:.0} % of the ground within {NEAR} m of that",
                (f.level * 1e3).round() / 1e3 + 0.0,
                f.tilt().to_degrees(),
                100.0 * f.share
            ),
            _ => "none that most of the ground lies on: give `height_m` with care".to_owned(),
        };
        writeln!(out, "{:<12}{floor}", "floor").expect("a string takes all");
        let most = self.heights.iter().copied().max().unwrap_or(1).max(1);
        let step = (high[2] - low[2]) / BINS as f64;
        for (bin, count) in self.heights.iter().enumerate().rev() {
            let bar = "*".repeat((40 * count).div_ceil(most));
            let from = low[2] + step * bin as f64;
            writeln!(out, "  z {from:>8.3} m {count:>9} {bar}").expect("a string takes all");
            if step == 0.0 {
                break;
            }
        }
        let trimmed: Vec<&str> = out.lines().map(str::trim_end).collect();
        trimmed.join("\n") + "\n"
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ground(z: impl Fn(f64, f64) -> f64) -> Vec<[f64; 3]> {
        let at = |k: usize| [(k / 100) as f64 * 0.1, (k % 100) as f64 * 0.1];
        (0..10_000).map(|k| [at(k)[0], at(k)[1], z(at(k)[0], at(k)[1])]).collect()
    }

    #[test]
    fn a_tilted_floor_is_found_below_what_stands_on_it() {
        // 1.35 degrees along x; a wall across, whose foot is on the floor, and a pit.
        let slope = real::tan(1.35f64.to_radians());
        let mut points = ground(|x, y| if x < 2.0 && y < 3.0 { -1.0 } else { slope * x - 0.3 });
        points.extend((0..1000).map(|k| [5.0, (k % 100) as f64 * 0.1, f64::from(k / 100) * 0.2 + 0.1]));
        let survey = of(&Points::List(points)).expect("points");
        let floor = survey.floor.expect("a floor");
        assert!((floor.tilt().to_degrees() - 1.35).abs() < 0.05, "{floor:?}");
        assert!((floor.level - (slope * 4.95 - 0.3)).abs() < 0.01 && floor.share > 0.85, "{floor:?}");
        assert_eq!(survey.heights.iter().sum::<usize>(), 11_000);
        assert!(survey.describe().contains("tilted by 1.3"), "{}", survey.describe());
    }

    #[test]
    fn a_cloud_without_a_floor_says_so_and_one_without_points_nothing() {
        let steps =
            of(&Points::List(ground(|x, y| (x * 3.0).floor() * 0.37 + (y * 2.0).floor() * 0.29))).expect("points");
        assert!(steps.describe().contains("none that most"), "{}", steps.describe());
        assert_eq!(of(&Points::List(vec![[f64::NAN; 3]])), None);
        let one = of(&Points::List(vec![[1.0, 2.0, 3.0]])).expect("a point");
        assert_eq!((one.floor, one.heights[0]), (None, 1));
    }
}
