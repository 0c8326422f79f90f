//! The least time over a grid by a feasible primal-dual interior-point method: every iterate keeps every limit.
//!
//! Legend: `x` unknowns (B-spline weights of b), `b, b1, b2` value and derivatives of b at a point, `r = b^(-1/2)`, `w` quadrature
//! weights. Least: sum w r. Constraints, all `> 0`:
//! cap - b (speed);  1 -+ (q'' b + q' b1 / 2) / a (acceleration);  r - k sqrt(b) -+ (q''' b + 3/2 q'' b1 + q' b2 / 2) / j (jerk, divided by
//! sqrt(b); k: share of the limit that a jump of q'' takes, see `peaks`);  x (which makes b positive everywhere).
//! Only the jerk is not linear, and only in b: its curvature is subtracted from the objective's, which is in b alone too, and the
//! sum is kept positive. So the Hessian is positive definite, with two diagonals beside the main one: O(n) a step.

use crate::math::pentadiagonal::Pentadiagonal;

use super::Problem;
use super::grid::Grid;

/// Points of a cell: start, middle, end, and their weights (Simpson).
const POINTS: [(f64, f64); 3] = [(0.0, 1.0 / 6.0), (0.5, 4.0 / 6.0), (1.0, 1.0 / 6.0)];
/// Steps at most.
const STEPS: usize = 80;
/// It ends where the time is known to be within this share of the least (on the grid, as far as it is convex).
const GAP: f64 = 3e-5;
/// No constraint shrinks by more in a step.
const TO_BOUNDARY: f64 = 0.01;
/// A multiplier stays within this factor of what the constraint's value asks for.
const CENTRED: f64 = 1e3;
/// Least share of the objective's curvature that is kept.
const LEAST_CURVATURE: f64 = 0.05;
/// A row's speed over its limit that counts as none, so that the cap stays finite.
const STILL: f64 = 1e-100;
/// The start is below the fastest scaling of its shape by this factor in b.
const START_INSIDE: f64 = 0.6;

/// The cells' polynomials (p0, p1, p2 of b) of the least time.
pub(super) fn solve(problem: &Problem<'_>, grid: &Grid) -> Option<Solution> {
    let mut barrier = Barrier::new(problem, grid);
    let mut x = barrier.start(grid)?;
    let steps = barrier.descend(&mut x);
    let cells = (0..grid.cells()).map(|cell| {
        let basis = grid.basis(cell);
        [0, 1, 2].map(|k| (0..3).map(|i| basis[k][i] * x[cell + i]).sum::<f64>())
    });
    Some(Solution { cells: cells.collect(), steps })
}

/// What was found.
pub(super) struct Solution {
    /// p0, p1, p2 of each cell.
    pub cells: Vec<[f64; 3]>,
    /// Newton steps taken.
    pub steps: usize,
}

struct Barrier {
    points: Vec<Point>,
    /// Of each point, one an acceleration-limited row: weights of b and b1.
    acceleration: Vec<[f64; 2]>,
    /// Of each point, one a jerk-limited row: weights of b, b1, b2, and k.
    jerk: Vec<[f64; 4]>,
    accelerations: usize,
    jerks: usize,
    /// Multipliers of the caps, the unknowns' signs, both sides of accelerations and jerks.
    on_cap: Vec<f64>,
    on_sign: Vec<f64>,
    on_acceleration: Vec<[f64; 2]>,
    on_jerk: Vec<[f64; 2]>,
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
                points.push(Point { basis, weight: weight * h, cap: speed.max(STILL).powi(-2) });
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
            on_cap: vec![0.0; points.len()],
            on_sign: vec![0.0; grid.cells() + 2],
            on_acceleration: vec![[0.0; 2]; acceleration.len()],
            on_jerk: vec![[0.0; 2]; jerk.len()],
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
    fn start(&self, grid: &Grid) -> Option<Vec<f64>> {
        let unknowns = grid.cells() + 2;
        let pointwise = |i: usize| {
            let at = |knot: usize| grid.slowness[knot].powi(-2);
            0.5 * (at(i.saturating_sub(1).min(grid.cells())) + at(i.min(grid.cells())))
        };
        let mut smooth: Vec<f64> = (0..unknowns).map(pointwise).collect();
        for _ in 0..4 {
            let before = smooth.clone();
            for i in 1..unknowns - 1 {
                smooth[i] = 0.25 * before[i - 1] + 0.5 * before[i] + 0.25 * before[i + 1];
            }
        }
        let shapes = [vec![1.0; unknowns], smooth];
        let scaled = shapes.into_iter().filter_map(|shape| {
            let scale = START_INSIDE * self.largest_scale(&shape);
            let x: Vec<f64> = shape.iter().map(|x| x * scale).collect();
            let time = self.time(&x);
            (time.is_finite() && scale > 0.0).then_some((time, x))
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
            for [j0, j1, j2, k] in &self.jerk[i * self.jerks..(i + 1) * self.jerks] {
                // Each of the two parts within half the limit where a jump takes one.
                let own = (b.sqrt() * (j0 * b + j1 * b1 + j2 * b2)).abs();
                let half = if *k > 0.0 { 2.0 } else { 1.0 };
                inverse = inverse.max((half * own).powf(2.0 / 3.0)).max(half * k * b);
            }
        }
        1.0 / inverse
    }

    fn time(&self, x: &[f64]) -> f64 {
        self.points.iter().enumerate().map(|(i, p)| p.weight / p.values(x, Self::cell(i))[0].sqrt()).sum()
    }

    fn constraints(&self) -> usize {
        self.on_cap.len() + self.on_sign.len() + 2 * (self.on_acceleration.len() + self.on_jerk.len())
    }

    /// Newton steps until the gap is closed. Returns their number.
    fn descend(&mut self, x: &mut Vec<f64>) -> usize {
        let mut mu = 0.1 * self.time(x) / self.constraints() as f64;
        self.centre(x, mu);
        let mut step = vec![0.0; x.len()];
        let mut trial = x.clone();
        for taken in 0..STEPS {
            self.direction(x, mu, &mut step);
            let share = self.advance(x, &step, mu, &mut trial);
            if share <= 0.0 {
                return taken;
            }
            self.follow(x, &step, &trial, mu);
            std::mem::swap(x, &mut trial);
            if share > 0.5 && self.constraints() as f64 * mu <= GAP * self.time(x) {
                return taken + 1;
            }
            mu *= if share > 0.9 {
                0.15
            } else if share > 0.5 {
                0.4
            } else {
                1.0
            };
        }
        STEPS
    }

    /// Multipliers on the central path.
    fn centre(&mut self, x: &[f64], mu: f64) {
        for (on, x) in self.on_sign.iter_mut().zip(x) {
            *on = mu / x;
        }
        for (i, point) in self.points.iter().enumerate() {
            let [b, b1, b2] = point.values(x, Self::cell(i));
            self.on_cap[i] = mu / (point.cap - b);
            for row in i * self.accelerations..(i + 1) * self.accelerations {
                self.on_acceleration[row] = sides(&self.acceleration[row], b, b1).map(|c| mu / c);
            }
            for row in i * self.jerks..(i + 1) * self.jerks {
                self.on_jerk[row] = jerk_sides(&self.jerk[row], [b, b1, b2]).map(|c| mu / c);
            }
        }
    }

    /// Newton's direction for a barrier weight.
    fn direction(&mut self, x: &[f64], mu: f64, step: &mut [f64]) {
        self.hessian.reset(x.len());
        for i in 0..x.len() {
            self.hessian.rows[i][0] = self.on_sign[i] / x[i];
            step[i] = mu / x[i];
        }
        for (i, point) in self.points.iter().enumerate() {
            let cell = Self::cell(i);
            let [b, b1, b2] = point.values(x, cell);
            let r = 1.0 / b.sqrt();
            let (r1, r2) = (-0.5 * r / b, 0.75 * r / (b * b));
            let cap = point.cap - b;
            // Gradient of the barrier function and Hessian in (b, b1, b2).
            let mut g = [point.weight * r1 + mu / cap, 0.0, 0.0];
            let mut h = [self.on_cap[i] / cap, 0.0, 0.0, 0.0, 0.0, 0.0];
            for row in i * self.accelerations..(i + 1) * self.accelerations {
                let [a0, a1] = self.acceleration[row];
                let c = sides(&self.acceleration[row], b, b1).map(f64::recip);
                let [low, high] = self.on_acceleration[row];
                let (force, stiff) = (mu * (c[0] - c[1]), low * c[0] + high * c[1]);
                g[0] += force * a0;
                g[1] += force * a1;
                h[0] += stiff * a0 * a0;
                h[1] += stiff * a0 * a1;
                h[2] += stiff * a1 * a1;
            }
            let mut curvature = point.weight * r2;
            for row in i * self.jerks..(i + 1) * self.jerks {
                let [j0, j1, j2, k] = self.jerk[row];
                let c = jerk_sides(&self.jerk[row], [b, b1, b2]).map(f64::recip);
                let [low, high] = self.on_jerk[row];
                let d = r1 - 0.5 * k * r;
                curvature -= (low + high) * (r2 + 0.25 * k * r / b);
                let (sum, difference) = (mu * (c[0] + c[1]), mu * (c[0] - c[1]));
                g[0] += difference * j0 - sum * d;
                g[1] += difference * j1;
                g[2] += difference * j2;
                let (low, high) = (low * c[0], high * c[1]);
                let (sum, difference) = (low + high, low - high);
                h[0] += sum * (d * d + j0 * j0) - 2.0 * difference * d * j0;
                h[1] += (sum * j0 - difference * d) * j1;
                h[2] += sum * j1 * j1;
                h[3] += (sum * j0 - difference * d) * j2;
                h[4] += sum * j1 * j2;
                h[5] += sum * j2 * j2;
            }
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
                step[cell + m] -= g[0] * e0[m] + g[1] * e1[m] + g[2] * e2[m];
                for n in 0..=m {
                    block[entry] = image[0] * e0[n] + image[1] * e1[n] + image[2] * e2[n];
                    entry += 1;
                }
            }
            self.hessian.add(cell, block);
        }
        self.hessian.factor();
        self.hessian.solve(step);
    }

    /// Goes along a step as far as every constraint keeps a share of its value and the barrier function falls. Returns the share of
    /// the step taken, 0 where none helps.
    fn advance(&self, x: &[f64], step: &[f64], mu: f64, trial: &mut [f64]) -> f64 {
        let before = self.merit(x, mu, None);
        let mut share = 1.0;
        for _ in 0..40 {
            for i in 0..x.len() {
                trial[i] = x[i] + share * step[i];
            }
            let after = self.merit(trial, mu, Some(x));
            if after <= before + 1e-12 * before.abs() {
                return share;
            }
            share *= 0.6;
        }
        0.0
    }

    /// Time less `mu` times the logarithms of all constraints; infinite where one is below a share of its value at `from`.
    fn merit(&self, x: &[f64], mu: f64, from: Option<&[f64]>) -> f64 {
        let mut time = 0.0;
        let mut logs = 0.0;
        for (i, value) in x.iter().enumerate() {
            if *value <= from.map_or(0.0, |from| TO_BOUNDARY * from[i]) {
                return f64::INFINITY;
            }
            logs += value.ln();
        }
        for (i, point) in self.points.iter().enumerate() {
            let at = point.values(x, Self::cell(i));
            let least = from.map(|from| point.values(from, Self::cell(i)));
            let c = point.cap - at[0];
            if c <= least.map_or(0.0, |least| TO_BOUNDARY * (point.cap - least[0])) {
                return f64::INFINITY;
            }
            let mut product = c;
            for row in i * self.accelerations..(i + 1) * self.accelerations {
                let c = sides(&self.acceleration[row], at[0], at[1]);
                let least = least.map_or([0.0; 2], |l| sides(&self.acceleration[row], l[0], l[1]));
                if c[0] <= TO_BOUNDARY * least[0] || c[1] <= TO_BOUNDARY * least[1] {
                    return f64::INFINITY;
                }
                product *= c[0] * c[1];
            }
            for row in i * self.jerks..(i + 1) * self.jerks {
                let c = jerk_sides(&self.jerk[row], at);
                let least = least.map_or([0.0; 2], |least| jerk_sides(&self.jerk[row], least));
                if c[0] <= TO_BOUNDARY * least[0] || c[1] <= TO_BOUNDARY * least[1] {
                    return f64::INFINITY;
                }
                logs += (c[0] * c[1]).ln();
            }
            logs += product.ln();
            time += point.weight / at[0].sqrt();
        }
        time - mu * logs
    }

    /// Newton's multipliers, kept near what the constraints at the new unknowns ask for.
    fn follow(&mut self, x: &[f64], step: &[f64], to: &[f64], mu: f64) {
        let update = |on: &mut f64, c: f64, change: f64, after: f64| {
            *on = (mu - *on * change) / c;
            *on = on.clamp(mu / (CENTRED * after), CENTRED * mu / after);
        };
        for i in 0..x.len() {
            update(&mut self.on_sign[i], x[i], step[i], to[i]);
        }
        for (i, point) in self.points.iter().enumerate() {
            let cell = Self::cell(i);
            let (at, by, end) = (point.values(x, cell), point.values(step, cell), point.values(to, cell));
            update(&mut self.on_cap[i], point.cap - at[0], -by[0], point.cap - end[0]);
            for row in i * self.accelerations..(i + 1) * self.accelerations {
                let weights = &self.acceleration[row];
                let (c, after) = (sides(weights, at[0], at[1]), sides(weights, end[0], end[1]));
                let change = weights[0] * by[0] + weights[1] * by[1];
                let [low, high] = &mut self.on_acceleration[row];
                update(low, c[0], -change, after[0]);
                update(high, c[1], change, after[1]);
            }
            let r = 1.0 / at[0].sqrt();
            for row in i * self.jerks..(i + 1) * self.jerks {
                let [j0, j1, j2, k] = self.jerk[row];
                let (c, after) = (jerk_sides(&self.jerk[row], at), jerk_sides(&self.jerk[row], end));
                let change = j0 * by[0] + j1 * by[1] + j2 * by[2];
                let room = -0.5 * (r / at[0] + k * r) * by[0];
                let [low, high] = &mut self.on_jerk[row];
                update(low, c[0], room - change, after[0]);
                update(high, c[1], room + change, after[1]);
            }
        }
    }
}

/// What is left of an acceleration limit on either side.
fn sides([a0, a1]: &[f64; 2], b: f64, b1: f64) -> [f64; 2] {
    let l = a0 * b + a1 * b1;
    [1.0 - l, 1.0 + l]
}

/// What is left of a jerk limit on either side, divided by sqrt(b).
fn jerk_sides([j0, j1, j2, k]: &[f64; 4], [b, b1, b2]: [f64; 3]) -> [f64; 2] {
    let root = b.max(0.0).sqrt();
    let (l, room) = (j0 * b + j1 * b1 + j2 * b2, 1.0 / root - k * root);
    [room - l, room + l]
}
