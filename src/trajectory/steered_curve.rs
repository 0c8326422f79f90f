//! Position along a curve of heading and arc length: the integral of s' (cos phi, sin phi), tabulated.

use crate::geom::Pose2;
use crate::math::poly::{Piece, PiecewisePoly};
use crate::math::quadrature::gauss_legendre_2;
use crate::math::real;

use super::plane_curve::{CurveError, Place, jet};
use super::{SteerLeg, standing};

/// Cells are halved until one quadrature over the cell and two over its halves differ by less, m: the curve's error stays far
/// below 1e-11 m.
const CELL_TOLERANCE: f64 = 1e-13;
/// A curve that would need more cells winds beyond any use.
const MOST_CELLS: usize = 100_000;
/// Cells of a piece at least: extremes of a polynomial of degree 7 are then apart.
const LEAST_CELLS: usize = 2;
/// Within this share of the whole range from its ends the curve may stand and still count as one drive.
const AT_REST: f64 = 1e-3;
/// Below this share of the greatest |s'| the base stands.
const STANDS: f64 = 1e-9;

/// Nodes and weights of Gauss-Legendre quadrature with three points on [-1, 1].
const GAUSS: [(f64, f64); 3] =
    [(-0.774_596_669_241_483_4, 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.774_596_669_241_483_4, 5.0 / 9.0)];

/// Dimension of the heading.
const HEADING: usize = 0;
/// Dimension of the arc length.
const ADVANCE: usize = 1;

/// A curve of (heading, arc length, joints…) from a pose, with the position tabulated. It is exact at any parameter (to 1e-11 m):
/// the table holds where quadrature starts, not values to interpolate.
#[derive(Debug, Clone)]
pub struct SteeredCurve {
    poly: PiecewisePoly,
    /// Global parameter at the start of every piece, and at the end.
    breaks: Vec<f64>,
    cells: Vec<Cell>,
    end: [f64; 2],
    travelled: f64,
    /// Whether s' vanishes anywhere but at the very ends.
    stops: Option<f64>,
}

/// A stretch of one piece in which s' keeps its sign, short enough for one quadrature.
#[derive(Debug, Clone, Copy)]
struct Cell {
    piece: usize,
    from: f64,
    to: f64,
    /// Position at `from`.
    position: [f64; 2],
    /// Integral of |s'| up to `from`.
    travelled: f64,
}

impl SteeredCurve {
    /// Tabulates a leg.
    ///
    /// # Errors
    /// [`CurveError`]: no pieces, fewer than two dimensions, a number that is not finite, or a heading that winds without end.
    pub fn new(leg: &SteerLeg) -> Result<Self, CurveError> {
        let poly = leg.curve.clone();
        let dimensions = poly.pieces.first().map_or(0, |p| p.coefficients.len());
        if dimensions < 2 || poly.pieces.iter().any(|p| p.coefficients.len() != dimensions) {
            return Err(CurveError::Empty);
        }
        let mut breaks = vec![0.0];
        for (piece, p) in poly.pieces.iter().enumerate() {
            let finite = p.coefficients.iter().flatten().all(|c| c.is_finite());
            if !(p.duration.is_finite() && p.duration > 0.0 && finite) {
                return Err(CurveError::NotFinite { piece });
            }
            breaks.push(breaks[piece] + p.duration);
        }
        let start = [leg.pose.x, leg.pose.y];
        let mut curve = Self { poly, breaks, cells: Vec::new(), end: start, travelled: 0.0, stops: None };
        let mut standing = Vec::new();
        for piece in 0..curve.poly.pieces.len() {
            curve.tabulate(piece, &mut standing)?;
        }
        curve.stops = curve.first_stop(standing);
        Ok(curve)
    }

    /// Appends the cells of a piece, cut where s' changes its sign; notes where it vanishes.
    fn tabulate(&mut self, piece: usize, standing: &mut Vec<[f64; 2]>) -> Result<(), CurveError> {
        let p = &self.poly.pieces[piece];
        let duration = p.duration;
        let stands = standing::standing(&p.coefficients[ADVANCE], duration);
        let mut cuts: Vec<f64> = (0..=LEAST_CELLS).map(|k| k as f64 / LEAST_CELLS as f64 * duration).collect();
        let inside = STANDS * duration..(1.0 - STANDS) * duration;
        cuts.extend(stands.iter().filter(|[from, to]| from == to && inside.contains(from)).map(|[at, _]| *at));
        cuts.sort_by(f64::total_cmp);
        cuts.dedup();
        standing.extend(stands.iter().map(|[from, to]| [self.breaks[piece] + from, self.breaks[piece] + to]));
        for pair in cuts.windows(2) {
            self.halve(piece, pair[0], pair[1])?;
        }
        Ok(())
    }

    fn halve(&mut self, piece: usize, from: f64, to: f64) -> Result<(), CurveError> {
        let p = &self.poly.pieces[piece];
        let middle = 0.5 * (from + to);
        let whole = moved(p, from, to);
        let (first, second) = (moved(p, from, middle), moved(p, middle, to));
        let halves = [first[0] + second[0], first[1] + second[1]];
        let off = (whole[0] - halves[0]).abs().max((whole[1] - halves[1]).abs());
        if !off.is_finite() {
            return Err(CurveError::NotFinite { piece });
        }
        let rounding = 1e-14 * self.end[0].abs().max(self.end[1].abs()).max(halves[0].abs() + halves[1].abs());
        if off <= CELL_TOLERANCE.max(rounding) || !(from < middle && middle < to) {
            self.cells.push(Cell { piece, from, to, position: self.end, travelled: self.travelled });
            self.end = [self.end[0] + halves[0], self.end[1] + halves[1]];
            self.travelled += (p.derivative(ADVANCE, 0, to) - p.derivative(ADVANCE, 0, from)).abs();
            return Ok(());
        }
        if self.cells.len() >= MOST_CELLS {
            return Err(CurveError::Winds { piece });
        }
        self.halve(piece, from, middle)?;
        self.halve(piece, middle, to)
    }

    /// The first parameter away from the ends at which s' vanishes.
    fn first_stop(&self, mut standing: Vec<[f64; 2]>) -> Option<f64> {
        let speed = |place: Place| self.jet(ADVANCE, place)[1].abs();
        let fastest = self.nodes().map(speed).fold(0.0, f64::max);
        for (piece, at) in self.breaks.iter().enumerate().skip(1).take(self.poly.pieces.len() - 1) {
            if speed(Place { piece, u: 0.0 }) <= STANDS * fastest {
                standing.push([*at, *at]);
            }
        }
        let margin = AT_REST * self.duration();
        let inside = standing.iter().filter(|[from, to]| *to > margin && *from < self.duration() - margin);
        inside.map(|[from, _]| *from).min_by(f64::total_cmp)
    }

    /// The curve itself.
    pub fn poly(&self) -> &PiecewisePoly {
        &self.poly
    }

    /// Number of joints.
    pub fn joint_count(&self) -> usize {
        self.poly.pieces[0].coefficients.len() - 2
    }

    /// Length in metres, back and forth counted both: the integral of |s'|.
    pub fn length(&self) -> f64 {
        self.travelled
    }

    /// The whole range of the global parameter.
    pub fn duration(&self) -> f64 {
        *self.breaks.last().expect("made with one break more than pieces")
    }

    /// Where, away from the ends, the base first stands while the parameter goes on (a spin, a stop, a change of direction); `None`:
    /// nowhere, so that the arc length is as good a parameter.
    pub fn first_stop_inside(&self) -> Option<f64> {
        self.stops
    }

    /// Where the first piece starts.
    pub fn start(&self) -> Place {
        Place { piece: 0, u: 0.0 }
    }

    /// Where the last piece ends.
    pub fn end(&self) -> Place {
        let piece = self.poly.pieces.len() - 1;
        Place { piece, u: self.poly.pieces[piece].duration }
    }

    /// Pose where it ends; heading not wrapped.
    pub fn end_pose(&self) -> Pose2 {
        Pose2::new(self.end[0], self.end[1], self.jet(HEADING, self.end())[0])
    }

    /// The place at a global parameter, clamped to the curve; at a join the later piece.
    pub fn place(&self, parameter: f64) -> Place {
        let piece = self.breaks.partition_point(|b| *b <= parameter).clamp(1, self.poly.pieces.len()) - 1;
        Place { piece, u: (parameter - self.breaks[piece]).clamp(0.0, self.poly.pieces[piece].duration) }
    }

    /// The global parameter of a place.
    pub fn parameter(&self, place: Place) -> f64 {
        self.breaks[place.piece] + place.u
    }

    /// Places between which everything is tame and s' keeps its sign: the table's cells, start and end included.
    pub fn nodes(&self) -> impl Iterator<Item = Place> + '_ {
        self.cells.iter().map(|c| Place { piece: c.piece, u: c.from }).chain(std::iter::once(self.end()))
    }

    /// Value and first three derivatives of one dimension (0 heading, 1 arc length, then joints) by the parameter.
    pub fn jet(&self, dimension: usize, place: Place) -> [f64; 4] {
        let [v, d1, d2, d3, _] = jet(&self.poly.pieces[place.piece].coefficients[dimension], place.u);
        [v, d1, d2, d3]
    }

    /// Pose at a place; heading not wrapped.
    pub fn pose(&self, place: Place) -> Pose2 {
        let cell = self.cells[self.cell_of(place)];
        let [dx, dy] = moved(&self.poly.pieces[place.piece], cell.from, place.u);
        Pose2::new(cell.position[0] + dx, cell.position[1] + dy, self.jet(HEADING, place)[0])
    }

    /// Position with its first two derivatives by the parameter, x and y.
    pub fn point_jet(&self, place: Place) -> [[f64; 3]; 2] {
        let pose = self.pose(place);
        self.with_derivatives([pose.x, pose.y], place)
    }

    /// [`Self::point_jet`] from a place nearby whose position is known: with a third of the work, where the heading turns by no more
    /// than a tenth of a radian in between.
    pub fn point_jet_from(&self, known: Place, point: [f64; 2], place: Place) -> [[f64; 3]; 2] {
        if known.piece != place.piece {
            return self.point_jet(place);
        }
        let coefficients = &self.poly.pieces[place.piece].coefficients;
        let (middle, half) = (0.5 * (known.u + place.u), 0.5 * (place.u - known.u));
        let mut at = point;
        for (node, weight) in GAUSS {
            let velocity = velocity(&coefficients[HEADING], &coefficients[ADVANCE], middle + half * node);
            at = [at[0] + half * weight * velocity[0], at[1] + half * weight * velocity[1]];
        }
        self.with_derivatives(at, place)
    }

    fn with_derivatives(&self, [x, y]: [f64; 2], place: Place) -> [[f64; 3]; 2] {
        let ([yaw, turn, ..], [_, speed, rise, _]) = (self.jet(HEADING, place), self.jet(ADVANCE, place));
        let (sin, cos) = real::sin_cos(yaw);
        [[x, speed * cos, rise * cos - speed * turn * sin], [y, speed * sin, rise * sin + speed * turn * cos]]
    }

    /// Distance driven up to a place, back and forth counted both, m.
    pub fn travelled(&self, place: Place) -> f64 {
        let cell = self.cells[self.cell_of(place)];
        cell.travelled + self.travelled_in(cell, place.u)
    }

    /// The place at a distance driven (clamped to the curve): the inverse of [`Self::travelled`]. Where the base stands, some place of
    /// the stand.
    pub fn place_at_travelled(&self, distance: f64) -> Place {
        if distance >= self.travelled {
            return self.end();
        }
        let cell = self.cells[self.cells.partition_point(|c| c.travelled <= distance).max(1) - 1];
        let target = (distance - cell.travelled).max(0.0);
        // Newton's steps; one that leaves the bracket, as it must where s' vanishes at an end, is replaced by halving it.
        let (mut low, mut high) = (cell.from, cell.to);
        let mut u = 0.5 * (low + high);
        for _ in 0..100 {
            let miss = self.travelled_in(cell, u) - target;
            if miss > 0.0 {
                high = u;
            } else {
                low = u;
            }
            let stepped = u - miss / self.jet(ADVANCE, Place { piece: cell.piece, u })[1].abs();
            let better = if (low..=high).contains(&stepped) { stepped } else { 0.5 * (low + high) };
            let step = (better - u).abs();
            u = better;
            if step <= 1e-16 * cell.to {
                break;
            }
        }
        Place { piece: cell.piece, u }
    }

    fn cell_of(&self, place: Place) -> usize {
        self.cells.partition_point(|c| (c.piece, c.from) <= (place.piece, place.u)).max(1) - 1
    }

    fn travelled_in(&self, cell: Cell, u: f64) -> f64 {
        let p = &self.poly.pieces[cell.piece];
        (p.derivative(ADVANCE, 0, u) - p.derivative(ADVANCE, 0, cell.from)).abs()
    }
}

/// The integral of s' (cos phi, sin phi) over a part of a piece.
fn moved(piece: &Piece, from: f64, to: f64) -> [f64; 2] {
    let (heading, advance) = (&piece.coefficients[HEADING], &piece.coefficients[ADVANCE]);
    gauss_legendre_2(from, to, |u| velocity(heading, advance, u))
}

fn velocity(heading: &[f64], advance: &[f64], u: f64) -> [f64; 2] {
    let phi = heading.iter().rev().fold(0.0, |sum, c| sum * u + c);
    let speed = (1..advance.len()).rev().fold(0.0, |sum, k| sum * u + k as f64 * advance[k]);
    let (sin, cos) = real::sin_cos(phi);
    [speed * cos, speed * sin]
}

#[cfg(test)]
mod tests;
