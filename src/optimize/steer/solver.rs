//! Sequential quadratic steps: Levenberg-Marquardt on the costs, the gaps between pieces closed to first order by every step.
//!
//! A step minimises the Gauss-Newton model of the costs plus a stiff square of the linearised gaps, so it is that of sequential
//! quadratic programming with multipliers (J. Nocedal, S. Wright, *Numerical Optimization*, 2nd ed., sections 17.3, 18.3). It is
//! judged by the augmented Lagrangian with the multipliers that the step itself gives.
//!
//! Costs are squares of what exceeds a limit, so the model must know which limits the step will exceed: those that are exceeded
//! here, and of those that are kept the ones that the last step met, gave up, or broke. Which of them the step exceeds is found by
//! a primal-dual active set (M. Hintermueller, K. Ito, K. Kunisch, *The primal-dual active set strategy as a semismooth Newton
//! method*, SIAM J. Optim. 13, 2002). A step that breaks others is made again with them in the model.

use super::problem::{Derivatives, Problem, STIFFNESS};
use super::rows::{self, Contact, Rows};
use crate::math::banded::Banded;
use crate::optimize::penalty::field::DistanceField;

/// How to iterate.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct SolverOptions {
    pub max_iterations: usize,
    /// Relative decrease of the merit at which the iteration is over.
    pub tolerance: f64,
    /// Largest gap between pieces at the end, m.
    pub gap_tolerance: f64,
}

/// How it ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Solved {
    pub cost: f64,
    pub iterations: usize,
    pub converged: bool,
}

/// Price of a squared gap in the merit, s/m^2.
const GAP_PRICE: f64 = 200.0;
/// Damping at first; it follows how well the model predicts.
const FIRST_DAMPING: f64 = 4.0;
/// The iteration ends where a step lowers the merit little and leaves gaps below this, m.
const SMALL_GAP: f64 = 1e-4;

/// How often a step is made before it is damped more.
const ATTEMPTS: usize = 2;
/// Damping after a step that was as good as the model says, one that was much worse, and one that was refused.
const TRUSTED: f64 = 0.5;
const DOUBTED: f64 = 3.0;
const REFUSED: f64 = 5.0;
/// Rounds in which a step finds out which limits it exceeds; from which round on it lets go of none.
const ROUNDS: usize = 8;
const LAST_DROPS: usize = 4;

/// Scratch memory; once there, iterating allocates nothing.
pub(super) struct Workspace {
    here: Derivatives,
    there: Derivatives,
    factor: Banded,
    step: Vec<f64>,
    gradient: Vec<f64>,
    product: Vec<f64>,
    trial: Vec<f64>,
    natural: Vec<f64>,
    multipliers: Vec<[f64; 2]>,
    next_multipliers: Vec<[f64; 2]>,
    /// What is missed here.
    missed: Vec<Contact>,
    /// What else a step may miss; linearised, and what of it the step does miss.
    watched: Vec<Contact>,
    rows: Rows,
    taken: Vec<bool>,
}

/// A step's merit: here, as the model predicts, as it is.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Merit {
    here: f64,
    predicted: f64,
    there: f64,
    /// Cost there.
    cost: f64,
}

/// Improves `x`.
pub(super) fn solve<F: DistanceField>(
    problem: &mut Problem<'_, F>,
    x: &mut [f64],
    options: &SolverOptions,
    work: &mut Workspace,
) -> Solved {
    work.multipliers.fill([0.0; 2]);
    let mut damping = FIRST_DAMPING;
    let mut cost = problem.evaluate(x, &work.multipliers, &mut work.here);
    let mut solved = Solved { cost, iterations: 0, converged: false };
    work.watched.clear();
    work.missed.clear();
    work.missed.extend(problem.contacts.all());
    while solved.iterations < options.max_iterations {
        let mut merit = None;
        for _ in 0..ATTEMPTS {
            work.linearise(problem, x);
            solved.iterations += 1;
            merit = work.attempt(problem, x, cost, damping);
            let Some(found) = &merit else { break };
            if found.accepted() {
                break;
            }
            let before = work.watched.len();
            work.watched.extend(problem.contacts.all());
            rows::sort(&mut work.watched);
            if work.watched.len() == before {
                break;
            }
        }
        match merit.filter(Merit::accepted) {
            Some(merit) => {
                let ratio = (merit.here - merit.there) / (merit.here - merit.predicted);
                damping *= match ratio {
                    r if r > 0.75 => TRUSTED,
                    r if r < 0.25 => DOUBTED,
                    _ => 1.0,
                };
                damping = damping.max(1e-9);
                x.copy_from_slice(&work.trial);
                work.watch(problem.contacts.all());
                std::mem::swap(&mut work.here, &mut work.there);
                std::mem::swap(&mut work.multipliers, &mut work.next_multipliers);
                cost = merit.cost;
                if merit.here - merit.there <= options.tolerance * cost.abs() && largest(&work.here.gaps) <= SMALL_GAP {
                    solved.converged = true;
                    break;
                }
            }
            None => {
                damping *= REFUSED;
                let hopeless = merit.is_some_and(|m| (m.here - m.predicted).abs() <= 1e-9 * cost.abs());
                if damping > 1e8 || hopeless {
                    solved.converged = hopeless;
                    break;
                }
            }
        }
    }
    solved.cost = work.close_gaps(problem, x, cost, options.gap_tolerance);
    solved
}

impl Merit {
    fn accepted(&self) -> bool {
        let predicted = self.here - self.predicted;
        self.there.is_finite() && predicted > 0.0 && self.here - self.there > 1e-4 * predicted
    }
}

/// Closes the gaps of `x` by steps that look at nothing else.
pub(super) fn close<F: DistanceField>(
    problem: &mut Problem<'_, F>,
    x: &mut [f64],
    tolerance: f64,
    work: &mut Workspace,
) {
    work.multipliers.fill([0.0; 2]);
    let cost = problem.evaluate(x, &work.multipliers, &mut work.here);
    work.close_gaps(problem, x, cost, tolerance);
}

impl Workspace {
    pub fn new<F: DistanceField>(problem: &Problem<'_, F>) -> Self {
        let layout = problem.layout;
        let here = Derivatives::new(layout);
        let zeros = vec![0.0; layout.size()];
        let rows = Rows::of_samples(problem.sample_count(), layout);
        Self {
            factor: here.hessian.clone(),
            there: here.clone(),
            here,
            step: zeros.clone(),
            gradient: zeros.clone(),
            product: zeros.clone(),
            trial: zeros,
            natural: problem.natural(),
            multipliers: vec![[0.0; 2]; layout.pieces],
            next_multipliers: vec![[0.0; 2]; layout.pieces],
            missed: Vec::with_capacity(rows.rows.capacity()),
            watched: Vec::with_capacity(3 * rows.rows.capacity()),
            taken: Vec::with_capacity(rows.rows.capacity()),
            rows,
        }
    }

    /// Linearises what is watched.
    fn linearise<F: DistanceField>(&mut self, problem: &mut Problem<'_, F>, x: &[f64]) {
        self.rows.clear();
        problem.linearise(&self.watched, x, &mut self.rows);
    }

    /// After a step: watches what it has met, and what it may have got rid of; notes what is missed now.
    fn watch(&mut self, missed: impl Iterator<Item = Contact>) {
        let met = self.rows.rows.iter().zip(&self.taken).filter(|(_, taken)| **taken).map(|(row, _)| row.contact);
        self.watched.clear();
        self.watched.extend(met.chain(self.missed.drain(..)));
        rows::sort(&mut self.watched);
        self.missed.extend(missed);
    }

    /// What the value of a limit that is kept becomes by the step; of others, which the model has already, nothing.
    fn after<F: DistanceField>(&self, problem: &Problem<'_, F>, row: usize) -> f64 {
        let of = &self.rows.rows[row];
        if of.value >= 0.0 {
            return 0.0;
        }
        of.value + problem.along(of.contact.piece, self.rows.by(row), &self.step)
    }

    /// A step from `x` to `trial`; `None` where the model has no minimum.
    fn attempt<F: DistanceField>(
        &mut self,
        problem: &mut Problem<'_, F>,
        x: &[f64],
        cost: f64,
        damping: f64,
    ) -> Option<Merit> {
        self.taken.clear();
        self.taken.resize(self.rows.rows.len(), false);
        for round in 0..ROUNDS {
            self.factor.copy_from(&self.here.hessian);
            self.gradient.copy_from_slice(&self.here.gradient);
            for (i, natural) in self.natural.iter().enumerate() {
                *self.factor.entry(i, i) += damping * natural;
            }
            for (k, row) in self.rows.rows.iter().enumerate().filter(|(k, _)| self.taken[*k]) {
                problem.add_row(*row, self.rows.by(k), &mut self.gradient, &mut self.factor);
            }
            if !self.factor.factor() {
                return None;
            }
            for (step, gradient) in self.step.iter_mut().zip(&self.gradient) {
                *step = -gradient;
            }
            self.factor.solve(&mut self.step);
            let mut changed = false;
            for row in 0..self.taken.len() {
                let taken = self.after(problem, row) > 0.0 || (round >= LAST_DROPS && self.taken[row]);
                changed |= taken != self.taken[row];
                self.taken[row] = taken;
            }
            if !changed {
                break;
            }
        }
        for ((trial, x), step) in self.trial.iter_mut().zip(x).zip(&self.step) {
            *trial = x + step;
        }
        // The model without damping and gaps.
        self.here.hessian.multiply(&self.step, &mut self.product);
        let mut merit = Merit { here: cost, predicted: cost, there: 0.0, cost: 0.0 };
        for ((step, gradient), product) in self.step.iter().zip(&self.here.gradient).zip(&self.product) {
            merit.predicted += step * (gradient + 0.5 * product);
        }
        for row in 0..self.taken.len() {
            let after = self.after(problem, row).max(0.0);
            merit.predicted += 0.5 * self.rows.rows[row].weight * after * after;
        }
        for piece in 0..self.multipliers.len() {
            for axis in 0..2 {
                let gap = self.here.gaps[piece][axis];
                let change = problem.along(piece, self.here.by_gap(piece, axis), &self.step);
                let old = self.multipliers[piece][axis];
                merit.predicted -= change * (old + STIFFNESS * gap) + 0.5 * STIFFNESS * change * change;
                let new = old + STIFFNESS * (gap + change);
                self.next_multipliers[piece][axis] = new;
                merit.here += price(new, gap);
                merit.predicted += price(new, gap + change);
            }
        }
        merit.cost = problem.evaluate(&self.trial, &self.next_multipliers, &mut self.there);
        merit.there = merit.cost;
        for (gap, multiplier) in self.there.gaps.iter().zip(&self.next_multipliers) {
            merit.there += price(multiplier[0], gap[0]) + price(multiplier[1], gap[1]);
        }
        Some(merit)
    }

    /// Closes what is left of the gaps by steps that look at nothing else. Returns the cost.
    fn close_gaps<F: DistanceField>(
        &mut self,
        problem: &mut Problem<'_, F>,
        x: &mut [f64],
        mut cost: f64,
        tolerance: f64,
    ) -> f64 {
        self.next_multipliers.fill([0.0; 2]);
        for _ in 0..6 {
            if largest(&self.here.gaps) <= tolerance {
                break;
            }
            self.factor.copy_from(&self.here.hessian);
            for (i, natural) in self.natural.iter().enumerate() {
                *self.factor.entry(i, i) += 1e-3 * natural;
            }
            if !self.factor.factor() {
                break;
            }
            self.step.fill(0.0);
            for piece in 0..self.next_multipliers.len() {
                for axis in 0..2 {
                    let force = STIFFNESS * self.here.gaps[piece][axis];
                    problem.pull(piece, force, self.here.by_gap(piece, axis), &mut self.step);
                }
            }
            self.factor.solve(&mut self.step);
            x.iter_mut().zip(&self.step).for_each(|(x, step)| *x += step);
            cost = problem.evaluate(x, &self.next_multipliers, &mut self.here);
        }
        cost
    }
}

fn price(multiplier: f64, gap: f64) -> f64 {
    gap * (multiplier + 0.5 * GAP_PRICE * gap)
}

fn largest(gaps: &[[f64; 2]]) -> f64 {
    gaps.iter().flatten().fold(0.0f64, |most, gap| most.max(gap.abs()))
}
