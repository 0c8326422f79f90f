//! Arc length and heading along a leg's curve, and their exact inverses.

use crate::math::poly::{Piece, PiecewisePoly};
use crate::math::quadrature::gauss_legendre;
use crate::math::real;

/// A length is summed to this, metres per cell: far below the 1e-10 m that users of the table may rely on.
const ARC_TOLERANCE: f64 = 1e-13;
/// No cell of the table turns by more, radians; so the angle between two tangents in it is never ambiguous.
const TURN_IN_CELL: f64 = 0.4;
/// Halvings of a piece before its derivative counts as vanishing.
const DEEPEST: usize = 44;

/// A place on a curve: a piece and its local parameter. Finer than the global parameter on long curves, and one-sided at joins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Index of the piece.
    pub piece: usize,
    /// Local parameter, `0 ..= duration`.
    pub u: f64,
}

/// A curve of (x, y, joints…) with its arc length and the heading of its tangent tabulated. Both are exact at any parameter
/// (to 1e-12 m and rounding): the table holds where quadrature starts, not values to interpolate.
#[derive(Debug, Clone)]
pub struct PlaneCurve {
    poly: PiecewisePoly,
    /// Global parameter at the start of every piece, and at the end.
    breaks: Vec<f64>,
    cells: Vec<Cell>,
    length: f64,
    turn: f64,
}

/// A stretch of one piece that is short enough for one quadrature.
#[derive(Debug, Clone, Copy)]
struct Cell {
    piece: usize,
    from: f64,
    to: f64,
    /// Arc length at `from`, from the curve's start.
    arc: f64,
    /// Turn of the tangent at `from` since the curve's start, not wrapped.
    turn: f64,
    /// Derivative of (x, y) at `from`.
    tangent: [f64; 2],
}

/// Why a curve cannot be driven.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CurveError {
    /// The derivative of (x, y) is zero (or so near that the heading cannot be told), at this global parameter.
    #[error("the curve has no direction at parameter {parameter:.6}: its derivative vanishes there")]
    Vanishes {
        /// Global parameter.
        parameter: f64,
    },
    /// A coefficient or duration is not finite, or a duration is not positive.
    #[error("piece {piece} of the curve is not finite")]
    NotFinite {
        /// Index of the piece.
        piece: usize,
    },
    /// There is no piece, or a piece without its first two dimensions.
    #[error("the curve has no pieces")]
    Empty,
    /// The heading changes so fast that no table of positions is fine enough.
    #[error("piece {piece} of the curve turns too often to be driven")]
    Winds {
        /// Index of the piece.
        piece: usize,
    },
}

/// Speed |d(x, y)/du| with its first two derivatives, and d(heading)/du with its first two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaneRates {
    /// g, g', g''.
    pub speed: [f64; 3],
    /// phi', phi'', phi'''.
    pub turn: [f64; 3],
}

impl PlaneCurve {
    /// Tabulates a curve. Every piece needs the same dimensions, the first two x and y.
    ///
    /// # Errors
    /// [`CurveError`]: the curve is empty, not finite, or its derivative vanishes somewhere.
    pub fn new(poly: PiecewisePoly) -> Result<Self, CurveError> {
        if poly.pieces.iter().any(|p| p.coefficients.len() < 2) || poly.pieces.is_empty() {
            return Err(CurveError::Empty);
        }
        let mut breaks = vec![0.0];
        for (piece, p) in poly.pieces.iter().enumerate() {
            if !(p.duration.is_finite() && p.duration > 0.0) || p.coefficients.iter().flatten().any(|c| !c.is_finite())
            {
                return Err(CurveError::NotFinite { piece });
            }
            breaks.push(breaks[piece] + p.duration);
        }
        let mut curve = Self { poly, breaks, cells: Vec::new(), length: 0.0, turn: 0.0 };
        for piece in 0..curve.poly.pieces.len() {
            let duration = curve.poly.pieces[piece].duration;
            for quarter in 0..4 {
                let (from, to) = (f64::from(quarter) / 4.0 * duration, f64::from(quarter + 1) / 4.0 * duration);
                curve.tabulate(piece, from, to, 0)?;
            }
        }
        Ok(curve)
    }

    /// Appends cells for a stretch of a piece, halving it until quadrature and turn are certain.
    fn tabulate(&mut self, piece: usize, from: f64, to: f64, depth: usize) -> Result<(), CurveError> {
        let p = &self.poly.pieces[piece];
        let middle = 0.5 * (from + to);
        let speed = |u: f64| norm(tangent(p, u));
        let whole = gauss_legendre(from, to, speed);
        let halves = gauss_legendre(from, middle, speed) + gauss_legendre(middle, to, speed);
        let start = tangent(p, from);
        let turned = angle(start, tangent(p, to));
        let integrated = gauss_legendre(from, to, |u| turn_rate(p, u));
        let certain = (whole - halves).abs() <= ARC_TOLERANCE.max(1e-14 * halves)
            && turned.abs() <= TURN_IN_CELL
            && (turned - integrated).abs() <= 1e-6;
        if certain && norm(start) > 0.0 {
            self.cells.push(Cell { piece, from, to, arc: self.length, turn: self.turn, tangent: start });
            self.length += halves;
            self.turn += turned;
            return Ok(());
        }
        if depth == DEEPEST {
            return Err(CurveError::Vanishes { parameter: self.breaks[piece] + middle });
        }
        self.tabulate(piece, from, middle, depth + 1)?;
        self.tabulate(piece, middle, to, depth + 1)
    }

    /// The curve itself.
    pub fn poly(&self) -> &PiecewisePoly {
        &self.poly
    }

    /// Length in metres.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The whole range of the global parameter.
    pub fn duration(&self) -> f64 {
        *self.breaks.last().expect("made with one break more than pieces")
    }

    /// Turn of the tangent from start to end in radians, not wrapped.
    pub fn total_turn(&self) -> f64 {
        self.turn
    }

    /// Heading of the tangent at the start, in (-pi, pi].
    pub fn start_heading(&self) -> f64 {
        let [x, y] = self.cells[0].tangent;
        real::atan2(y, x)
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

    /// The place at a global parameter, clamped to the curve; at a join the later piece.
    pub fn place(&self, parameter: f64) -> Place {
        let piece = self.breaks.partition_point(|b| *b <= parameter).clamp(1, self.poly.pieces.len()) - 1;
        Place { piece, u: (parameter - self.breaks[piece]).clamp(0.0, self.poly.pieces[piece].duration) }
    }

    /// The global parameter of a place.
    pub fn parameter(&self, place: Place) -> f64 {
        self.breaks[place.piece] + place.u
    }

    /// Places where a smooth function of the curve may be taken as tame between: the table's cells, start and end included.
    pub fn nodes(&self) -> impl Iterator<Item = Place> + '_ {
        self.cells.iter().map(|c| Place { piece: c.piece, u: c.from }).chain(std::iter::once(self.end()))
    }

    /// Arc length from the start, metres.
    pub fn arc(&self, place: Place) -> f64 {
        let cell = self.cell_of(place);
        cell.arc + self.arc_in(cell, place.u)
    }

    /// Turn of the tangent since the start, radians, not wrapped.
    pub fn turn(&self, place: Place) -> f64 {
        let cell = self.cell_of(place);
        cell.turn + angle(cell.tangent, tangent(&self.poly.pieces[place.piece], place.u))
    }

    /// The place at an arc length from the start (clamped to the curve): the inverse of [`Self::arc`].
    pub fn place_at_arc(&self, arc: f64) -> Place {
        if arc >= self.length {
            return self.end();
        }
        let index = self.cells.partition_point(|c| c.arc <= arc).max(1) - 1;
        let cell = self.cells[index];
        let target = (arc - cell.arc).max(0.0);
        let next = self.cells.get(index + 1).map_or(self.length, |c| c.arc);
        let p = &self.poly.pieces[cell.piece];

        // Newton from the chord's guess; a step that leaves the bracket is replaced by halving it.
        let (mut low, mut high) = (cell.from, cell.to);
        let mut u = cell.from + (cell.to - cell.from) * (target / (next - cell.arc)).min(1.0);
        for _ in 0..60 {
            let miss = self.arc_in(cell, u) - target;
            if miss > 0.0 {
                high = u;
            } else {
                low = u;
            }
            let stepped = u - miss / norm(tangent(p, u));
            let better = if (low..=high).contains(&stepped) { stepped } else { 0.5 * (low + high) };
            let moved = (better - u).abs();
            u = better;
            if moved <= 1e-9 * (cell.to - cell.from) {
                // One more Newton step would square this: below rounding.
                u -= (self.arc_in(cell, u) - target) / norm(tangent(p, u));
                break;
            }
        }
        Place { piece: cell.piece, u: u.clamp(cell.from, cell.to) }
    }

    /// Value and first three derivatives of one dimension with respect to the parameter.
    pub fn jet(&self, dimension: usize, place: Place) -> [f64; 4] {
        let [v, d1, d2, d3, _] = jet(&self.poly.pieces[place.piece].coefficients[dimension], place.u);
        [v, d1, d2, d3]
    }

    /// Position, metres.
    pub fn point(&self, place: Place) -> [f64; 2] {
        let p = &self.poly.pieces[place.piece];
        [p.derivative(0, 0, place.u), p.derivative(1, 0, place.u)]
    }

    /// First derivative of (x, y).
    pub fn tangent(&self, place: Place) -> [f64; 2] {
        tangent(&self.poly.pieces[place.piece], place.u)
    }

    /// Speed and turn rate with respect to the parameter, each with two derivatives.
    pub fn rates(&self, place: Place) -> PlaneRates {
        let p = &self.poly.pieces[place.piece];
        let (x, y) = (jet(&p.coefficients[0], place.u), jet(&p.coefficients[1], place.u));
        let d = |k: usize| [x[k], y[k]];
        let square = dot(d(1), d(1));
        let g = square.sqrt();
        let g1 = dot(d(1), d(2)) / g;
        let g2 = (dot(d(2), d(2)) + dot(d(1), d(3)) - g1 * g1) / g;
        // phi' = n/g^2 with n = d1 x d2, and its derivatives by the quotient rule.
        let n = cross(d(1), d(2));
        let n1 = cross(d(1), d(3));
        let n2 = cross(d(2), d(3)) + cross(d(1), d(4));
        let s1 = 2.0 * g * g1;
        let s2 = 2.0 * (g1 * g1 + g * g2);
        let turn = n / square;
        let turn1 = (n1 - turn * s1) / square;
        let turn2 = (n2 - 2.0 * turn1 * s1 - turn * s2) / square;
        PlaneRates { speed: [g, g1, g2], turn: [turn, turn1, turn2] }
    }

    /// Curvature and its derivative with respect to arc length (1/m, 1/m^2).
    pub fn curvature(&self, place: Place) -> [f64; 2] {
        let PlaneRates { speed: [g, g1, _], turn: [turn, turn1, _] } = self.rates(place);
        [turn / g, (turn1 - turn * g1 / g) / (g * g)]
    }

    fn cell_of(&self, place: Place) -> Cell {
        let after = self.cells.partition_point(|c| (c.piece, c.from) <= (place.piece, place.u));
        self.cells[after.max(1) - 1]
    }

    fn arc_in(&self, cell: Cell, u: f64) -> f64 {
        let p = &self.poly.pieces[cell.piece];
        gauss_legendre(cell.from, u, |u| norm(tangent(p, u)))
    }
}

/// Value and first four derivatives of a polynomial, by one Horner pass.
pub(super) fn jet(coefficients: &[f64], u: f64) -> [f64; 5] {
    let mut d = [0.0; 5];
    for c in coefficients.iter().rev() {
        for k in (1..5).rev() {
            d[k] = d[k] * u + d[k - 1];
        }
        d[0] = d[0] * u + c;
    }
    [d[0], d[1], 2.0 * d[2], 6.0 * d[3], 24.0 * d[4]]
}

fn tangent(piece: &Piece, u: f64) -> [f64; 2] {
    [0, 1].map(|dimension| {
        let c = &piece.coefficients[dimension];
        (1..c.len()).rev().fold(0.0, |sum, k| sum * u + k as f64 * c[k])
    })
}

fn turn_rate(piece: &Piece, u: f64) -> f64 {
    let (x, y) = (jet(&piece.coefficients[0], u), jet(&piece.coefficients[1], u));
    (x[1] * y[2] - y[1] * x[2]) / (x[1] * x[1] + y[1] * y[1])
}

/// The angle from `a` to `b`, radians.
fn angle(a: [f64; 2], b: [f64; 2]) -> f64 {
    real::atan2(cross(a, b), dot(a, b))
}

fn norm(a: [f64; 2]) -> f64 {
    dot(a, a).sqrt()
}

fn dot(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[0] + a[1] * b[1]
}

fn cross(a: [f64; 2], b: [f64; 2]) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

#[cfg(test)]
mod tests;
