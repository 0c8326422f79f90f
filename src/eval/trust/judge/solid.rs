//! Solids in the judge's own terms, and the distance of two of them: Wolfe's nearest point of a polytope, with a bound from either side.

use nalgebra::{Matrix3, Vector3};

use crate::robot::{Convex, Shape};

type Vector = Vector3<f64>;

/// Most corners that one distance asks for.
const CORNERS: usize = 120;
/// Bounds this near to each other are near enough, m.
const CLOSE: f64 = 1e-11;
/// What rounding may do to a distance, m: taken off each lower bound.
const ROUNDING: f64 = 1e-11;

/// A convex solid about its own centre: a core, and all that is nearer to it than `round`.
#[derive(Debug, Clone)]
pub(super) struct Solid {
    core: Core,
    round: f64,
    /// Of a ball about the centre that holds it, m.
    pub(super) radius: f64,
}

#[derive(Debug, Clone)]
enum Core {
    /// The hull of these.
    Points(Vec<Vector>),
    /// Along z.
    Cylinder { radius: f64, half: f64 },
}

impl Solid {
    pub(super) fn of(shape: &Shape) -> Self {
        let (core, round) = match &shape.convex {
            Convex::Sphere { radius } => (Core::Points(vec![Vector::zeros()]), *radius),
            Convex::Cylinder { radius, half_length } => (Core::Cylinder { radius: *radius, half: *half_length }, 0.0),
            Convex::Hull { vertices } => (Core::Points(vertices.iter().map(|v| Vector::from(*v)).collect()), 0.0),
            Convex::Box { half: [x, y, z] } => {
                let side = |bit: usize, half: &f64| if bit == 0 { -half } else { *half };
                let corner = |n: usize| Vector::new(side(n & 1, x), side(n & 2, y), side(n & 4, z));
                (Core::Points((0..8).map(corner).collect()), 0.0)
            }
        };
        let radius = match &core {
            Core::Points(points) => points.iter().map(Vector::norm).fold(0.0, f64::max) + round,
            Core::Cylinder { radius, half } => (radius * radius + half * half).sqrt(),
        };
        Self { core, round, radius }
    }

    /// The core's point that is farthest along `d`.
    fn farthest(&self, d: &Vector) -> Vector {
        match &self.core {
            Core::Points(points) => {
                let mut best = points[0];
                let mut height = best.dot(d);
                for point in &points[1..] {
                    let other = point.dot(d);
                    if other > height {
                        (best, height) = (*point, other);
                    }
                }
                best
            }
            Core::Cylinder { radius, half } => {
                let flat = (d.x * d.x + d.y * d.y).sqrt();
                let rim = if flat > 0.0 { radius / flat } else { 0.0 };
                Vector::new(d.x * rim, d.y * rim, if d.z < 0.0 { -half } else { *half })
            }
        }
    }
}

/// A solid somewhere.
#[derive(Debug, Clone)]
pub(super) struct Placed<'a> {
    pub(super) solid: &'a Solid,
    pub(super) turn: Matrix3<f64>,
    pub(super) at: Vector,
}

/// The truth about a distance lies between these, m; zero: they meet, or may.
pub(super) type Bounds = [f64; 2];

impl Placed<'_> {
    fn farthest(&self, d: &Vector) -> Vector {
        self.turn * self.solid.farthest(&self.turn.tr_mul(d)) + self.at
    }

    /// To a box between two corners.
    pub(super) fn to_box(&self, low: &[f64; 3], high: &[f64; 3]) -> Bounds {
        let difference = |d: &Vector| {
            let mut point = self.farthest(d);
            for axis in 0..3 {
                point[axis] -= if d[axis] > 0.0 { low[axis] } else { high[axis] };
            }
            point
        };
        rounded(nearest(difference), self.solid.round)
    }

    /// To another solid.
    pub(super) fn to(&self, other: &Placed<'_>) -> Bounds {
        let difference = |d: &Vector| self.farthest(d) - other.farthest(&-d);
        rounded(nearest(difference), self.solid.round + other.solid.round)
    }

    /// Greatest coordinate along an axis (`sign` 1), or least (-1, its negative), m.
    pub(super) fn extent(&self, axis: usize, sign: f64) -> f64 {
        let mut d = Vector::zeros();
        d[axis] = sign;
        self.farthest(&d)[axis] * sign + self.solid.round
    }

    /// No nearer to a box than this, by the ball that holds it, m.
    pub(super) fn at_least(&self, low: &[f64; 3], high: &[f64; 3]) -> f64 {
        let mut square = 0.0;
        for axis in 0..3 {
            let off = (low[axis] - self.at[axis]).max(self.at[axis] - high[axis]).max(0.0);
            square += off * off;
        }
        square.sqrt() - self.solid.radius
    }
}

fn rounded([lower, upper]: Bounds, round: f64) -> Bounds {
    [(lower - round - ROUNDING).max(0.0), (upper - round).max(0.0)]
}

/// Bounds on the distance from the origin to a convex body of which `farthest` is the point farthest along a direction.
///
/// Wolfe, "Finding the nearest point in a polytope" (1976): a corral of affinely independent corners whose nearest point is inside them;
/// the plane through the next corner bounds the distance from below, the nearest point so far from above, however well the
/// corral's equations were solved.
fn nearest(farthest: impl Fn(&Vector) -> Vector) -> Bounds {
    let mut corral = vec![farthest(&Vector::new(0.3, 0.5, 0.8))];
    let mut weights = vec![1.0];
    let (mut lower, mut upper) = (0.0f64, f64::INFINITY);
    for _ in 0..CORNERS {
        let x: Vector = corral.iter().zip(&weights).map(|(corner, weight)| corner * *weight).sum();
        let distance = x.norm();
        upper = upper.min(distance);
        if upper < CLOSE {
            return [0.0, upper];
        }
        let next = farthest(&-x);
        lower = lower.max(x.dot(&next) / distance);
        if upper - lower <= CLOSE || corral.iter().any(|corner| (corner - next).norm_squared() < 1e-28) {
            break;
        }
        corral.push(next);
        weights.push(0.0);
        if !settle(&mut corral, &mut weights) {
            break;
        }
    }
    [lower, upper]
}

/// Moves the weights to the nearest point of the corral's affine hull, and leaves out corners on the way there that are in the way.
/// False: the corral was too flat to go on with.
fn settle(corral: &mut Vec<Vector>, weights: &mut Vec<f64>) -> bool {
    loop {
        let Some(wanted) = affine(corral) else { return false };
        if wanted.iter().all(|w| *w > 0.0) {
            *weights = wanted;
            return true;
        }
        let mut step = 1.0f64;
        for (now, then) in weights.iter().zip(&wanted) {
            if *then <= 0.0 {
                step = step.min(now / (now - then).max(f64::MIN_POSITIVE));
            }
        }
        for (now, then) in weights.iter_mut().zip(&wanted) {
            *now += step * (then - *now);
        }
        // The one that has come to zero, and others with it.
        let least = (0..weights.len()).filter(|i| wanted[*i] <= 0.0).min_by(|a, b| weights[*a].total_cmp(&weights[*b]));
        let Some(least) = least else { return false };
        weights[least] = 0.0;
        let kept: Vec<bool> = weights.iter().map(|w| *w > 0.0).collect();
        let mut keep = kept.iter();
        corral.retain(|_| *keep.next().unwrap_or(&true));
        weights.retain(|w| *w > 0.0);
        let sum: f64 = weights.iter().sum();
        weights.iter_mut().for_each(|w| *w /= sum);
        if corral.is_empty() {
            return false;
        }
    }
}

/// Weights, one in sum, of the point nearest to the origin in the affine hull of up to four corners; `None` where they are too flat.
fn affine(corral: &[Vector]) -> Option<Vec<f64>> {
    let first = corral[0];
    let count = corral.len() - 1;
    if count > 3 {
        return None;
    }
    // Gram-Schmidt on the edges from the first corner: then the triangular system backwards.
    let mut base = [Vector::zeros(); 3];
    let mut upper = [[0.0; 3]; 3];
    for column in 0..count {
        let edge = corral[column + 1] - first;
        let mut rest = edge;
        for _ in 0..2 {
            for row in 0..column {
                let along = base[row].dot(&rest);
                upper[row][column] += along;
                rest -= base[row] * along;
            }
        }
        let length = rest.norm();
        if length <= 1e-13 * edge.norm() || length == 0.0 {
            return None;
        }
        upper[column][column] = length;
        base[column] = rest / length;
    }
    let mut weights = vec![0.0; count + 1];
    for row in (0..count).rev() {
        let known: f64 = (row + 1..count).map(|column| upper[row][column] * weights[column + 1]).sum();
        weights[row + 1] = (-base[row].dot(&first) - known) / upper[row][row];
    }
    weights[0] = 1.0 - weights[1..].iter().sum::<f64>();
    Some(weights)
}
