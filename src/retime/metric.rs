//! A curve's parameter as a function of a length of one's own choice.

use crate::math::quadrature::gauss_legendre;
use crate::math::real;
use crate::trajectory::plane_curve::{Place, PlaneCurve};

/// A cell is halved until its polynomial's rate is right within this share in its middle.
const RATE: f64 = 1e-3;
/// Halvings at most.
const DEEPEST: usize = 12;

/// The parameter u of a curve by a metric lambda, the integral of a positive function h(u): polynomials of degree five through the
/// exact u, du/dlambda, d2u/dlambda2 at the nodes of the curve's table. So lambda is the metric only nearly (exactly at the nodes), but
/// exactly the parameter of a curve that is twice continuously differentiable wherever h makes it so, at joins of pieces too.
#[derive(Debug, Clone, PartialEq)]
pub struct Metric {
    cells: Vec<Cell>,
    length: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Cell {
    /// lambda at the start.
    from: f64,
    piece: usize,
    /// Local parameters at start and end.
    ends: [f64; 2],
    coefficients: [f64; 6],
}

impl Metric {
    /// `rate`: h and its derivative with respect to the parameter at a place.
    pub fn new(curve: &PlaneCurve, rate: impl Fn(Place) -> [f64; 2]) -> Self {
        let mut metric = Self { cells: Vec::new(), length: 0.0 };
        let nodes: Vec<Place> = curve.nodes().collect();
        for pair in nodes.windows(2) {
            let piece = pair[0].piece;
            let to = if pair[1].piece == piece { pair[1].u } else { curve.poly().pieces[piece].duration };
            metric.tabulate(piece, [pair[0].u, to], &rate, 0);
        }
        metric
    }

    fn tabulate(&mut self, piece: usize, ends: [f64; 2], rate: &impl Fn(Place) -> [f64; 2], depth: usize) {
        let [from, to] = ends;
        let length = gauss_legendre(from, to, |u| rate(Place { piece, u })[0]);
        let [start, end] = ends.map(|u| {
            let [h, h1] = rate(Place { piece, u });
            [1.0 / h, -h1 / (h * h * h)]
        });
        let missing = to - from - length * (start[0] + 0.5 * length * start[1]);
        let slope = length * (end[0] - start[0] - length * start[1]);
        let bend = length * length * (end[1] - start[1]);
        let cell = Cell {
            from: self.length,
            piece,
            ends,
            coefficients: [
                from,
                start[0],
                0.5 * start[1],
                (10.0 * missing - 4.0 * slope + 0.5 * bend) / real::powi(length, 3),
                (-15.0 * missing + 7.0 * slope - bend) / real::powi(length, 4),
                (6.0 * missing - 3.0 * slope + 0.5 * bend) / real::powi(length, 5),
            ],
        };
        let [u, middle, ..] = cell.at(0.5 * length);
        let [h, _] = rate(Place { piece, u: u.clamp(from, to) });
        if depth < DEEPEST && (middle * h - 1.0).abs() > RATE {
            let half = 0.5 * (from + to);
            self.tabulate(piece, [from, half], rate, depth + 1);
            self.tabulate(piece, [half, to], rate, depth + 1);
            return;
        }
        self.cells.push(cell);
        self.length += length;
    }

    /// The whole length.
    pub fn length(&self) -> f64 {
        self.length
    }

    /// The place at a length from the start, clamped to the curve, and the parameter's first three derivatives.
    pub fn at(&self, lambda: f64) -> (Place, [f64; 3]) {
        let index = self.cells.partition_point(|c| c.from <= lambda).max(1) - 1;
        let cell = &self.cells[index];
        let end = self.cells.get(index + 1).map_or(self.length, |next| next.from);
        let [u, d1, d2, d3] = cell.at((lambda - cell.from).clamp(0.0, end - cell.from));
        (Place { piece: cell.piece, u: u.clamp(cell.ends[0], cell.ends[1]) }, [d1, d2, d3])
    }

    /// Lengths between which it is smooth, ascending.
    pub fn nodes(&self) -> impl Iterator<Item = f64> + '_ {
        self.cells.iter().map(|cell| cell.from).chain([self.length])
    }
}

impl Cell {
    fn at(&self, x: f64) -> [f64; 4] {
        let mut d = [0.0; 4];
        for c in self.coefficients.iter().rev() {
            for k in (1..4).rev() {
                d[k] = d[k] * x + d[k - 1];
            }
            d[0] = d[0] * x + c;
        }
        [d[0], d[1], 2.0 * d[2], 6.0 * d[3]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::poly::{Piece, PiecewisePoly};

    #[test]
    fn with_the_curves_speed_it_is_the_arc_length() {
        // A parabola cut in two, the second half run through twice as fast.
        let first = Piece { duration: 1.0, coefficients: vec![vec![0.0, 1.0], vec![0.0, 0.0, 0.5]] };
        let second = Piece { duration: 0.5, coefficients: vec![vec![1.0, 2.0], vec![0.5, 2.0, 2.0]] };
        let curve = PlaneCurve::new(PiecewisePoly { pieces: vec![first, second] }).unwrap();
        let metric = Metric::new(&curve, |place| {
            let [g, g1, _] = curve.rates(place).speed;
            [g, g1]
        });
        assert!((metric.length() - curve.length()).abs() < 1e-12);
        for lambda in metric.nodes() {
            assert!((curve.arc(metric.at(lambda).0) - lambda).abs() < 1e-12);
        }
        for i in 0..200 {
            let lambda = metric.length() * f64::from(i) / 199.0;
            let (place, [d1, ..]) = metric.at(lambda);
            assert!((curve.arc(place) - lambda).abs() < 1e-3 * metric.length());
            assert!((d1 * curve.rates(place).speed[0] - 1.0).abs() < 2.0 * RATE);
        }
        // Across the join the point moves on with the same velocity and acceleration, though the parameter does not.
        let join = curve.arc(Place { piece: 1, u: 0.0 });
        let motion = |lambda: f64| {
            let (place, d) = metric.at(lambda);
            [0, 1].map(|k| {
                let [_, p1, p2, _] = curve.jet(k, place);
                [p1 * d[0], p2 * d[0] * d[0] + p1 * d[1]]
            })
        };
        let (before, after) = (motion(join - 1e-9), motion(join + 1e-9));
        for k in 0..2 {
            (0..2).for_each(|o| assert!((before[k][o] - after[k][o]).abs() < 1e-7, "{before:?} {after:?}"));
        }
        assert!(metric.at(join + 1e-9).1[0] < 0.6 * metric.at(join - 1e-9).1[0]);
    }

    #[test]
    fn where_the_rate_jumps_cells_are_halved_no_more_than_twelve_times() {
        let line = Piece { duration: 1.0, coefficients: vec![vec![0.0, 1.0], vec![0.0]] };
        let curve = PlaneCurve::new(PiecewisePoly { pieces: vec![line] }).unwrap();
        for jump in [0.3, 0.1, 0.9] {
            let metric = Metric::new(&curve, |place| [if place.u < jump { 1.0 } else { 2.0 }, 0.0]);
            let shortest = metric.cells.iter().map(|cell| cell.ends[1] - cell.ends[0]).fold(f64::INFINITY, f64::min);
            // A node is a quarter of the piece.
            assert_eq!(shortest, 0.25 / 4096.0);
        }
    }

    #[test]
    fn beyond_its_end_it_stays_there() {
        let parabola = Piece { duration: 1.0, coefficients: vec![vec![0.0, 1.0], vec![0.0, 0.0, 0.5]] };
        let curve = PlaneCurve::new(PiecewisePoly { pieces: vec![parabola] }).unwrap();
        let metric = Metric::new(&curve, |place| {
            let [g, g1, _] = curve.rates(place).speed;
            [g, g1]
        });
        assert_eq!(metric.at(1.5 * metric.length()), metric.at(metric.length()));
        assert_eq!(metric.at(-1.0), metric.at(0.0));
    }
}
