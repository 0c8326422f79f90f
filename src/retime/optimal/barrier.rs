//! The least time over a grid by a feasible primal-dual interior-point method: every iterate keeps every limit.
//!
//! Legend: `x` unknowns (B-spline weights of b), `b, b1, b2` value and derivatives of b at a point, `r = b^(-1/2)`, `w` quadrature
//! weights. Least: sum w r. Constraints, all `> 0`:
//! cap - b (speed);  1 -+ (q'' b + q' b1 / 2) / a (acceleration);  r - k sqrt(b) -+ (q''' b + 3/2 q'' b1 + q' b2 / 2) / j (jerk, divided by
//! sqrt(b); k: share of the limit that a jump of q'' takes, see `peaks`);  x (which makes b positive everywhere).
//! Only the jerk is not linear, and only in b: its curvature is subtracted from the objective's, which is in b alone too, and the
//! sum is kept positive. So the Hessian is positive definite, with two diagonals beside the main one: O(n) a step.

use crate::math::pentadiagonal::Pentadiagonal;
use crate::math::real;

use super::grid::Grid;
use super::guess::guess;
use super::{Problem, STILL};

/// Points of a cell: start, middle, end, and their weights (Simpson).
const POINTS: [(f64, f64); 3] = [(0.0, 1.0 / 6.0), (0.5, 4.0 / 6.0), (1.0, 1.0 / 6.0)];
/// Steps at most.
const STEPS: usize = 80;
/// How often a step is made shorter at most.
const SHORTER: usize = 16;
/// No constraint shrinks by more in a step.
const TO_BOUNDARY: f64 = 0.01;
/// A multiplier stays within this factor of what the constraint's value asks for.
const CENTRED: f64 = 1e3;
/// Least share of the objective's curvature that is kept.
const LEAST_CURVATURE: f64 = 0.05;
/// The start is below the fastest scaling of its shape by this factor in b.
const START_INSIDE: f64 = 0.6;

/// The least time's b: p0, p1, p2 of each cell, in powers of the reference time since the cell's start.
///
/// `near`: a b to start near; without one a guess is made.
pub(super) fn solve(
    problem: &Problem<'_>,
    grid: &Grid,
    gap: f64,
    near: Option<&dyn Fn(f64) -> f64>,
) -> Option<Vec<[f64; 3]>> {
    let mut barrier = Barrier::new(problem, grid);
    let shape = match near {
        Some(b) => (0..grid.unknowns()).map(|i| b(grid.place(i))).collect(),
        None => guess(problem, grid),
    };
    let mut x = barrier.start(shape)?;
    barrier.descend(&mut x, gap);
    let cells = (0..grid.cells()).map(|cell| {
        let basis = grid.basis(cell);
        [0, 1, 2].map(|k| (0..3).map(|i| basis[k][i] * x[cell + i]).sum::<f64>())
    });
    Some(cells.collect())
}

struct Barrier {
    points: Vec<Point>,
    /// Of each point, one an acceleration-limited row: weights of b and b1.
    acceleration: Vec<[f64; 2]>,
    /// Of each point, one a jerk-limited row: weights of b, b1, b2, and k.
    jerk: Vec<[f64; 4]>,
    accelerations: usize,
    jerks: usize,
    caps: Vec<Constraint>,
    signs: Vec<Constraint>,
    /// Both sides of each.
    on_acceleration: Vec<[Constraint; 2]>,
    on_jerk: Vec<[Constraint; 2]>,
    hessian: Pentadiagonal,
}

/// One point of a cell.
struct Point {
    /// Weights of the cell's three unknowns for b, b1, b2.
    basis: [[f64; 3]; 3],
    /// Quadrature weight.
    weight: f64,
    cap: f64,
}

impl Point {
    fn values(&self, x: &[f64], cell: usize) -> [f64; 3] {
        self.basis.map(|row| row[0] * x[cell] + row[1] * x[cell + 1] + row[2] * x[cell + 2])
    }
}

impl Barrier {
    fn new(problem: &Problem<'_>, grid: &Grid) -> Self {
        let rows = problem.limits.len();
        let limited = |k: usize| (0..rows).filter(|row| problem.limits[*row][k].is_finite()).collect::<Vec<_>>();
        let (accelerated, jerked) = (limited(1), limited(2));
        let count = POINTS.len() * grid.cells();
        let mut points = Vec::with_capacity(count);
        let mut acceleration = Vec::with_capacity(count * accelerated.len());
        let mut jerk = Vec::with_capacity(count * jerked.len());
        for cell in 0..grid.cells() {
            let [p0, p1, p2] = grid.basis(cell);
            let h = grid.knots[cell + 1] - grid.knots[cell];
            for (i, (share, weight)) in POINTS.into_iter().enumerate() {
                let s = share * h;
                let basis = [
                    [0, 1, 2].map(|m| p0[m] + s * (p1[m] + s * p2[m])),
                    [0, 1, 2].map(|m| p1[m] + 2.0 * s * p2[m]),
                    p2.map(|p| 2.0 * p),
                ];
                let rates = &grid.rates[(POINTS.len() * cell + i) * rows..][..rows];
                let speed = (0..rows).map(|row| rates[row][0].abs() / problem.limits[row][0]).fold(0.0, f64::max);
                points.push(Point { basis, weight: weight * h, cap: real::powi(speed.max(STILL), -2) });
                acceleration.extend(accelerated.iter().map(|row| {
                    let limit = problem.limits[*row][1];
                    [rates[*row][1] / limit, 0.5 * rates[*row][0] / limit]
                }));
                let jumps = match i {
                    0 => &grid.jumps[cell],
                    1 => &grid.jumps[0],
                    _ => &grid.jumps[cell + 1],
                };
                jerk.extend(jerked.iter().map(|row| {
                    let limit = problem.limits[*row][2];
                    let [d1, d2, d3] = rates[*row];
                    let jump = if i == 1 { 0.0 } else { jumps.get(*row).copied().unwrap_or(0.0) };
                    [d3 / limit, 1.5 * d2 / limit, 0.5 * d1 / limit, problem.jerk_of_jump * jump / limit]
                }));
            }
        }
        Self {
            caps: vec![Constraint::default(); points.len()],
            signs: vec![Constraint::default(); grid.unknowns()],
            on_acceleration: vec![Default::default(); acceleration.len()],
            on_jerk: vec![Default::default(); jerk.len()],
            points,
            acceleration,
            jerk,
            accelerations: accelerated.len(),
            jerks: jerked.len(),
            hessian: Pentadiagonal::default(),
        }
    }

    fn cell(point: usize) -> usize {
        point / POINTS.len()
    }

    /// Unknowns strictly inside all limits: of two shapes, each scaled to the limits, the faster one.
    fn start(&self, guess: Vec<f64>) -> Option<Vec<f64>> {
        let scaled = [vec![1.0; guess.len()], guess].into_iter().filter_map(|shape| {
            let scale = START_INSIDE * self.largest_scale(&shape);
            let x: Vec<f64> = shape.iter().map(|x| x * scale).collect();
            let time = self.time(&x);
            time.is_finite().then_some((time, x))
        });
        scaled.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, x)| x)
    }

    /// By how much a shape can be scaled until a limit is met.
    fn largest_scale(&self, x: &[f64]) -> f64 {
        let mut inverse = 0.0f64;
        for (i, point) in self.points.iter().enumerate() {
            let [b, b1, b2] = point.values(x, Self::cell(i));
            inverse = inverse.max(b / point.cap);
            for [a0, a1] in &self.acceleration[i * self.accelerations..(i + 1) * self.accelerations] {
                inverse = inverse.max((a0 * b + a1 * b1).abs());
            }
            let root = b.sqrt();
            for [j0, j1, j2, k] in &self.jerk[i * self.jerks..(i + 1) * self.jerks] {
                // Each of the two parts within half the limit where a jump takes one.
                let own = (root * (j0 * b + j1 * b1 + j2 * b2)).abs();
                let half = if *k > 0.0 { 2.0 } else { 1.0 };
                inverse = inverse.max(real::powi(real::cbrt(half * own), 2)).max(half * k * b);
            }
        }
        1.0 / inverse
    }

    fn time(&self, x: &[f64]) -> f64 {
        self.points.iter().enumerate().map(|(i, p)| p.weight / p.values(x, Self::cell(i))[0].sqrt()).sum()
    }

    fn constraints(&self) -> usize {
        self.caps.len() + self.signs.len() + 2 * (self.acceleration.len() + self.jerk.len())
    }

    /// Newton steps until the time is known to be within a share `gap` of the least (on the grid, as far as it is convex), or none helps.
    /// Returns how many.
    fn descend(&mut self, x: &mut Vec<f64>, gap: f64) -> usize {
        let mut mu = 0.1 * self.time(x) / self.constraints() as f64;
        let mut step = vec![0.0; x.len()];
        let mut next = x.clone();
        let Some(mut value) = self.assemble(x, mu, true, &mut step) else { return 0 };
        for taken in 0..STEPS {
            self.hessian.factor();
            self.hessian.solve(&mut step);
            let mut share = self.reach(x, &step, mu);
            let after = mu
                * if share > 0.9 {
                    0.2
                } else if share > 0.5 {
                    0.4
                } else {
                    1.0
                };
            let direction = step.clone();
            // Within reach all limits hold; the barrier function falls for a part of it at least.
            let falls = (0..SHORTER).find_map(|_| {
                for i in 0..x.len() {
                    next[i] = x[i] + share * direction[i];
                }
                let found = self.assemble(&next, after, false, &mut step);
                let found = found.filter(|found| found.is_no_worse(value, mu));
                if found.is_none() {
                    share *= 0.4;
                }
                found
            });
            let Some(found) = falls else { return taken };
            std::mem::swap(x, &mut next);
            value = found;
            if share > 0.5 && self.constraints() as f64 * mu <= gap * value.time {
                return taken + 1;
            }
            mu = after;
        }
        STEPS
    }

    /// Newton's system at some unknowns: fills the Hessian and the downhill gradient of the barrier function with weight `mu`, and the
    /// slacks. `fresh`: multipliers are put on the central path; otherwise they are kept near it. `None`: a limit is broken.
    fn assemble(&mut self, x: &[f64], mu: f64, fresh: bool, gradient: &mut [f64]) -> Option<Value> {
        // Returns the multiplier over the slack: what the constraint adds to the Hessian.
        let keep = |constraint: &mut Constraint, inverse: f64| {
            let central = mu * inverse;
            let on = if fresh { central } else { constraint.on.max(central / CENTRED).min(central * CENTRED) };
            *constraint = Constraint { inverse, on };
            on * inverse
        };
        let mut value = Value::default();
        self.hessian.reset(x.len());
        for (i, sign) in self.signs.iter_mut().enumerate() {
            if x[i] <= 0.0 {
                return None;
            }
            let inverse = 1.0 / x[i];
            self.hessian.rows[i][0] = keep(sign, inverse);
            gradient[i] = mu * inverse;
            value.logs += real::ln(x[i]);
        }
        for (i, point) in self.points.iter().enumerate() {
            let cell = Self::cell(i);
            let [b, b1, b2] = point.values(x, cell);
            let root = b.sqrt();
            let r = 1.0 / root;
            let r3 = r * r * r;
            let (r1, r2) = (-0.5 * r3, 0.75 * r3 * r * r);
            let cap = point.cap - b;
            let mut least = cap;
            let mut product = cap;
            value.time += point.weight * r;
            // Gradient of the barrier function and Hessian in (b, b1, b2).
            let inverse = 1.0 / cap;
            let mut g = [point.weight * r1 + mu * inverse, 0.0, 0.0];
            let mut h = [keep(&mut self.caps[i], inverse), 0.0, 0.0, 0.0, 0.0, 0.0];
            let rows = i * self.accelerations..(i + 1) * self.accelerations;
            for ([a0, a1], on) in self.acceleration[rows.clone()].iter().zip(&mut self.on_acceleration[rows]) {
                let l = a0 * b + a1 * b1;
                let slack = [1.0 - l, 1.0 + l];
                least = least.min(slack[0]).min(slack[1]);
                product *= slack[0] * slack[1];
                let c = slack.map(f64::recip);
                let (force, stiff) = (mu * (c[0] - c[1]), keep(&mut on[0], c[0]) + keep(&mut on[1], c[1]));
                g[0] += force * a0;
                g[1] += force * a1;
                h[0] += stiff * a0 * a0;
                h[1] += stiff * a0 * a1;
                h[2] += stiff * a1 * a1;
            }
            let mut curvature = point.weight * r2;
            let rows = i * self.jerks..(i + 1) * self.jerks;
            for ([j0, j1, j2, k], on) in self.jerk[rows.clone()].iter().zip(&mut self.on_jerk[rows]) {
                let l = j0 * b + j1 * b1 + j2 * b2;
                let room = r - k * root;
                let slack = [room - l, room + l];
                least = least.min(slack[0]).min(slack[1]);
                product *= slack[0] * slack[1];
                let c = slack.map(f64::recip);
                let (low, high) = (keep(&mut on[0], c[0]), keep(&mut on[1], c[1]));
                let d = r1 - 0.5 * k * r;
                curvature -= (on[0].on + on[1].on) * (r2 + 0.25 * k * r3);
                let (sum, difference) = (mu * (c[0] + c[1]), mu * (c[0] - c[1]));
                g[0] += difference * j0 - sum * d;
                g[1] += difference * j1;
                g[2] += difference * j2;
                let (sum, difference) = (low + high, low - high);
                h[0] += sum * (d * d + j0 * j0) - 2.0 * difference * d * j0;
                h[1] += (sum * j0 - difference * d) * j1;
                h[2] += sum * j1 * j1;
                h[3] += (sum * j0 - difference * d) * j2;
                h[4] += sum * j1 * j2;
                h[5] += sum * j2 * j2;
            }
            if least <= 0.0 {
                return None;
            }
            value.logs += real::ln(product);
            h[0] += curvature.max(LEAST_CURVATURE * point.weight * r2);
            let [e0, e1, e2] = &point.basis;
            let mut block = [0.0; 6];
            let mut entry = 0;
            for m in 0..3 {
                let image = [
                    h[0] * e0[m] + h[1] * e1[m] + h[3] * e2[m],
                    h[1] * e0[m] + h[2] * e1[m] + h[4] * e2[m],
                    h[3] * e0[m] + h[4] * e1[m] + h[5] * e2[m],
                ];
                gradient[cell + m] -= g[0] * e0[m] + g[1] * e1[m] + g[2] * e2[m];
                for n in 0..=m {
                    block[entry] = image[0] * e0[n] + image[1] * e1[n] + image[2] * e2[n];
                    entry += 1;
                }
            }
            self.hessian.add(cell, block);
        }
        Some(value)
    }

    /// How far along a step every constraint keeps a share of its slack, at most 1; and Newton's multipliers.
    ///
    /// The slacks of the jerk are convex in b, so where their tangents are positive, they are.
    fn reach(&mut self, x: &[f64], step: &[f64], mu: f64) -> f64 {
        let mut fastest = 1.0 - TO_BOUNDARY;
        let mut follow = |on: &mut Constraint, change: f64| {
            fastest = fastest.max(-change * on.inverse);
            on.on = (mu - on.on * change) * on.inverse;
        };
        for (sign, step) in self.signs.iter_mut().zip(step) {
            follow(sign, *step);
        }
        for (i, point) in self.points.iter().enumerate() {
            let cell = Self::cell(i);
            let by = point.values(step, cell);
            let b = point.values(x, cell)[0];
            follow(&mut self.caps[i], -by[0]);
            let rows = i * self.accelerations..(i + 1) * self.accelerations;
            for ([a0, a1], [low, high]) in self.acceleration[rows.clone()].iter().zip(&mut self.on_acceleration[rows]) {
                let change = a0 * by[0] + a1 * by[1];
                follow(low, -change);
                follow(high, change);
            }
            let r = 1.0 / b.sqrt();
            let rows = i * self.jerks..(i + 1) * self.jerks;
            for ([j0, j1, j2, k], [low, high]) in self.jerk[rows.clone()].iter().zip(&mut self.on_jerk[rows]) {
                let change = j0 * by[0] + j1 * by[1] + j2 * by[2];
                let room = -0.5 * (r * r * r + k * r) * by[0];
                follow(low, room - change);
                follow(high, room + change);
            }
        }
        (1.0 - TO_BOUNDARY) / fastest
    }
}

/// A constraint at the current unknowns: what is left of it, inverted, and its multiplier.
#[derive(Debug, Clone, Copy, Default)]
struct Constraint {
    inverse: f64,
    on: f64,
}

/// The barrier function's two parts.
#[derive(Debug, Clone, Copy, Default)]
struct Value {
    time: f64,
    logs: f64,
}

impl Value {
    fn merit(self, mu: f64) -> f64 {
        self.time - mu * self.logs
    }

    /// But for rounding.
    fn is_no_worse(self, than: Self, mu: f64) -> bool {
        self.merit(mu) <= than.merit(mu) * (1.0 + 1e-12)
    }
}

#[cfg(test)]
mod tests;
