//! L-BFGS with the weak-Wolfe bisection of Lewis and Overton, for smooth and piecewise smooth functions.
//!
//! *\[LO\]*: Lewis, Overton, "Nonsmooth optimization via quasi-Newton methods", Math. Program. 141 (2013). *\[LN\]*: Liu, Nocedal,
//! "On the limited memory BFGS method for large scale optimization" (\[SCR\]'s reference 21).

/// Decrease that a step must give, as a share of what the slope promises (\[LO\] section 2: `c1`).
const SUFFICIENT_DECREASE: f64 = 1e-4;
/// Share of the slope that may be left after a step (\[LO\]: `c2`).
const CURVATURE: f64 = 0.9;

/// How to iterate.
#[derive(Debug, Clone, PartialEq)]
pub struct LbfgsOptions {
    /// Pairs remembered, 8 to 16.
    pub memory: usize,
    /// At most this many steps.
    pub max_iterations: usize,
    /// At most this many evaluations in one line search.
    pub max_line_search: usize,
    /// Converged when the largest gradient entry is at most this times max(1, largest entry of x).
    pub gradient_tolerance: f64,
    /// Converged when the cost fell by less than `decrease_tolerance * max(1, |cost|)` over the last `past` steps; 0: off.
    pub past: usize,
    /// See `past`.
    pub decrease_tolerance: f64,
    /// Longest first step, in the unit of x: bounds the step taken before any curvature is known.
    pub first_step: f64,
}

impl Default for LbfgsOptions {
    fn default() -> Self {
        Self {
            memory: 12,
            max_iterations: 200,
            max_line_search: 40,
            gradient_tolerance: 1e-7,
            past: 4,
            decrease_tolerance: 1e-5,
            first_step: 0.05,
        }
    }
}

/// How it ended; worse endings compare greater.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Stop {
    /// Gradient or decrease below the tolerance.
    Converged,
    /// Out of iterations.
    IterationLimit,
    /// No step gave enough decrease. Normal at a kink, where the cost is no longer differentiable.
    LineSearchStalled,
}

/// Result of [`Lbfgs::minimise`]; the minimiser is left in `x`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Minimum {
    /// Cost at `x`.
    pub cost: f64,
    /// Steps taken.
    pub iterations: usize,
    /// Evaluations of cost and gradient.
    pub evaluations: usize,
    /// How it ended.
    pub stop: Stop,
}

/// Scratch memory for one problem size; made once, used for many runs.
#[derive(Debug, Clone)]
pub struct Lbfgs {
    options: LbfgsOptions,
    dimension: usize,
    steps: Vec<f64>,
    changes: Vec<f64>,
    curvatures: Vec<f64>,
    shares: Vec<f64>,
    gradient: Vec<f64>,
    direction: Vec<f64>,
    trial: Vec<f64>,
    trial_gradient: Vec<f64>,
    history: Vec<f64>,
}

impl Lbfgs {
    /// Memory for `dimension` variables.
    pub fn new(dimension: usize, options: LbfgsOptions) -> Self {
        let memory = options.memory.max(1);
        Self {
            dimension,
            steps: vec![0.0; memory * dimension],
            changes: vec![0.0; memory * dimension],
            curvatures: vec![0.0; memory],
            shares: vec![0.0; memory],
            gradient: vec![0.0; dimension],
            direction: vec![0.0; dimension],
            trial: vec![0.0; dimension],
            trial_gradient: vec![0.0; dimension],
            history: vec![0.0; options.past],
            options: LbfgsOptions { memory, ..options },
        }
    }

    /// Minimises `evaluate(x, gradient) -> cost` (which overwrites `gradient`) from `x`, in place. A cost or gradient that
    /// is not finite counts as infinitely high; `x` never moves to one. Does not allocate.
    pub fn minimise(&mut self, x: &mut [f64], mut evaluate: impl FnMut(&[f64], &mut [f64]) -> f64) -> Minimum {
        debug_assert_eq!(x.len(), self.dimension);
        let mut cost = evaluate(x, &mut self.gradient);
        let (mut iterations, mut evaluations) = (0, 1);
        let (mut stored, mut newest) = (0, 0);
        let end = |cost, iterations, evaluations, stop| Minimum { cost, iterations, evaluations, stop };
        if !cost.is_finite() || self.gradient.iter().any(|g| !g.is_finite()) {
            return end(cost, 0, evaluations, Stop::LineSearchStalled);
        }
        loop {
            let largest = |v: &[f64]| v.iter().fold(0.0f64, |m, e| m.max(e.abs()));
            if largest(&self.gradient) <= self.options.gradient_tolerance * largest(x).max(1.0) {
                return end(cost, iterations, evaluations, Stop::Converged);
            }
            let past = self.options.past;
            if past > 0 {
                let decrease = self.history[iterations % past] - cost;
                if iterations >= past && decrease <= self.options.decrease_tolerance * cost.abs().max(1.0) {
                    return end(cost, iterations, evaluations, Stop::Converged);
                }
                self.history[iterations % past] = cost;
            }
            if iterations == self.options.max_iterations {
                return end(cost, iterations, evaluations, Stop::IterationLimit);
            }
            let mut slope = self.find_direction(stored, newest);
            if slope.is_nan() || slope >= 0.0 {
                // The memory has gone bad; steepest descent always falls.
                stored = 0;
                slope = self.find_direction(0, 0);
            }
            let first = if stored == 0 { (self.options.first_step / largest(&self.direction)).min(1.0) } else { 1.0 };
            let searched = self.line_search(x, cost, slope, first, &mut evaluate, &mut evaluations);
            let Some(found) = searched else {
                if stored > 0 {
                    stored = 0;
                    continue;
                }
                return end(cost, iterations, evaluations, Stop::LineSearchStalled);
            };
            iterations += 1;
            newest = if stored == 0 { 0 } else { (newest + 1) % self.options.memory };
            if self.remember(newest, x) {
                stored = (stored + 1).min(self.options.memory);
            } else if stored > 0 {
                newest = (newest + self.options.memory - 1) % self.options.memory;
            }
            cost = found;
            x.copy_from_slice(&self.trial);
            self.gradient.copy_from_slice(&self.trial_gradient);
        }
    }

    /// Two-loop recursion (\[LN\] algorithm 2.1); returns the slope along the direction.
    fn find_direction(&mut self, stored: usize, newest: usize) -> f64 {
        let (n, memory) = (self.dimension, self.options.memory);
        for (d, g) in self.direction.iter_mut().zip(&self.gradient) {
            *d = -g;
        }
        if stored > 0 {
            for age in 0..stored {
                let slot = (newest + memory - age) % memory;
                let range = slot * n..(slot + 1) * n;
                self.shares[slot] = dot(&self.steps[range.clone()], &self.direction) / self.curvatures[slot];
                add_scaled(&mut self.direction, -self.shares[slot], &self.changes[range]);
            }
            let y = &self.changes[newest * n..(newest + 1) * n];
            let scale = self.curvatures[newest] / dot(y, y);
            self.direction.iter_mut().for_each(|d| *d *= scale);
            for age in (0..stored).rev() {
                let slot = (newest + memory - age) % memory;
                let range = slot * n..(slot + 1) * n;
                let beta = dot(&self.changes[range.clone()], &self.direction) / self.curvatures[slot];
                add_scaled(&mut self.direction, self.shares[slot] - beta, &self.steps[range]);
            }
        }
        dot(&self.gradient, &self.direction)
    }

    /// Bisection for the weak Wolfe conditions (\[LO\] algorithm 2.6); leaves the point in `trial`. Where the conditions are
    /// never met but some step lowered the cost enough, the last such step is taken.
    fn line_search(
        &mut self,
        x: &[f64],
        cost: f64,
        slope: f64,
        first: f64,
        evaluate: &mut impl FnMut(&[f64], &mut [f64]) -> f64,
        evaluations: &mut usize,
    ) -> Option<f64> {
        let (mut low, mut high, mut step) = (0.0f64, f64::INFINITY, first);
        for _ in 0..self.options.max_line_search {
            let found = self.try_step(x, step, evaluate);
            *evaluations += 1;
            if found.is_nan() || found > cost + SUFFICIENT_DECREASE * step * slope {
                high = step;
            } else if dot(&self.trial_gradient, &self.direction) < CURVATURE * slope {
                low = step;
            } else {
                return Some(found);
            }
            step = if high.is_finite() { 0.5 * (low + high) } else { 2.0 * step };
            if high - low <= 1e-14 * high || step > 1e20 {
                break;
            }
        }
        if low == 0.0 {
            return None;
        }
        let found = self.try_step(x, low, evaluate);
        *evaluations += 1;
        (found < cost).then_some(found)
    }

    fn try_step(&mut self, x: &[f64], step: f64, evaluate: &mut impl FnMut(&[f64], &mut [f64]) -> f64) -> f64 {
        for ((t, x), d) in self.trial.iter_mut().zip(x).zip(&self.direction) {
            *t = x + step * d;
        }
        let cost = evaluate(&self.trial, &mut self.trial_gradient);
        let finite = cost.is_finite() && self.trial_gradient.iter().all(|g| g.is_finite());
        if finite { cost } else { f64::INFINITY }
    }

    /// Stores the step to `trial`, unless its curvature is too small to keep the inverse Hessian positive.
    fn remember(&mut self, slot: usize, x: &[f64]) -> bool {
        let n = self.dimension;
        let (mut curvature, mut step_square, mut change_square) = (0.0, 0.0, 0.0);
        let gradients = self.trial_gradient.iter().zip(&self.gradient);
        for ((to, from), (after, before)) in self.trial.iter().zip(x).zip(gradients) {
            let (s, y) = (to - from, after - before);
            curvature += s * y;
            step_square += s * s;
            change_square += y * y;
        }
        if curvature <= 1e-12 * (step_square * change_square).sqrt() {
            return false;
        }
        for (step, (to, from)) in self.steps[slot * n..].iter_mut().zip(self.trial.iter().zip(x)) {
            *step = to - from;
        }
        let gradients = self.trial_gradient.iter().zip(&self.gradient);
        for (change, (after, before)) in self.changes[slot * n..].iter_mut().zip(gradients) {
            *change = after - before;
        }
        self.curvatures[slot] = curvature;
        true
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

fn add_scaled(a: &mut [f64], factor: f64, b: &[f64]) {
    for (x, y) in a.iter_mut().zip(b) {
        *x += factor * y;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::real;

    fn tight() -> LbfgsOptions {
        LbfgsOptions { max_iterations: 2000, decrease_tolerance: 1e-15, gradient_tolerance: 1e-9, ..Default::default() }
    }

    #[test]
    fn rosenbrock_in_ten_dimensions_ends_at_ones() {
        let mut x = vec![-1.2; 10];
        let end = Lbfgs::new(10, tight()).minimise(&mut x, |x, g| {
            g.fill(0.0);
            let mut cost = 0.0;
            for i in 0..9 {
                let (a, b) = (1.0 - x[i], x[i + 1] - x[i] * x[i]);
                cost += a * a + 100.0 * b * b;
                g[i] += -2.0 * a - 400.0 * b * x[i];
                g[i + 1] += 200.0 * b;
            }
            cost
        });
        // The chained function has a second minimum near (-1, 1, ...) with cost about 4.
        assert_eq!(end.stop, Stop::Converged);
        assert!(end.cost < 1e-10 || (end.cost - 3.98).abs() < 0.1, "{end:?}");
    }

    #[test]
    fn a_quadratic_ends_at_its_closed_form() {
        // 1/2 sum d_i (x_i - i)^2, condition 1e4.
        let mut x = vec![0.0; 8];
        let end = Lbfgs::new(8, tight()).minimise(&mut x, |x, g| {
            (0..8)
                .map(|i| {
                    let (d, r) = (real::powf(10.0, i as f64 * 4.0 / 7.0), x[i] - i as f64);
                    g[i] = d * r;
                    0.5 * d * r * r
                })
                .sum()
        });
        assert_eq!(end.stop, Stop::Converged);
        for (i, x) in x.iter().enumerate() {
            assert!((x - i as f64).abs() < 1e-6, "{end:?}");
        }
    }

    #[test]
    fn a_convex_function_with_a_kink_ends_at_the_kink() {
        // |x| + 2 |y - 1| + small quadratic.
        let mut x = vec![3.3, -2.7];
        let end = Lbfgs::new(2, tight()).minimise(&mut x, |x, g| {
            g[0] = x[0].signum() + 0.02 * x[0];
            g[1] = 2.0 * (x[1] - 1.0).signum() + 0.02 * x[1];
            x[0].abs() + 2.0 * (x[1] - 1.0).abs() + 0.01 * (x[0] * x[0] + x[1] * x[1])
        });
        assert!(end.cost < 0.0101 + 1e-3, "{end:?}");
    }

    #[test]
    fn it_backs_away_from_where_the_cost_is_not_finite() {
        // -ln(1 - x) + x^2 - 3x: only x < 1 is allowed.
        let mut x = vec![0.0];
        let end = Lbfgs::new(1, LbfgsOptions { first_step: 10.0, ..tight() }).minimise(&mut x, |x, g| {
            g[0] = 1.0 / (1.0 - x[0]) + 2.0 * x[0] - 3.0;
            -real::ln(1.0 - x[0]) + x[0] * x[0] - 3.0 * x[0]
        });
        assert!(end.cost.is_finite() && x[0] < 1.0);
        assert!((1.0 / (1.0 - x[0]) + 2.0 * x[0] - 3.0).abs() < 1e-5);
    }

    #[test]
    fn a_start_that_is_not_finite_is_left_alone() {
        let mut x = vec![1.0];
        let end = Lbfgs::new(1, tight()).minimise(&mut x, |_, g| {
            g[0] = f64::NAN;
            f64::NAN
        });
        assert_eq!((end.stop, x[0]), (Stop::LineSearchStalled, 1.0));
    }

    #[test]
    fn out_of_iterations_is_said() {
        let options = LbfgsOptions { max_iterations: 2, ..tight() };
        let mut x = vec![5.0, -3.0];
        let end = Lbfgs::new(2, options).minimise(&mut x, |x, g| {
            g[0] = 4.0 * real::powi(x[0], 3);
            g[1] = 200.0 * x[1];
            real::powi(x[0], 4) + 100.0 * x[1] * x[1]
        });
        assert_eq!((end.stop, end.iterations), (Stop::IterationLimit, 2));
    }
}
