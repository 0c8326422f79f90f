//! Sequential quadratic steps: Levenberg-Marquardt on the costs, the gaps between pieces closed to first order by every step.
//!
//! A step minimises the Gauss-Newton model of the costs plus a stiff square of the linearised gaps, so it is that of sequential
//! quadratic programming with multipliers (J. Nocedal, S. Wright, *Numerical Optimization*, 2nd ed., sections 17.3, 18.3). It is
//! judged by the augmented Lagrangian with the multipliers that the step itself gives.

use super::problem::{Derivatives, Problem, STIFFNESS};
use crate::math::banded::Banded;
use crate::optimize::penalty::clearance::DistanceField;

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
    pub evaluations: usize,
    pub converged: bool,
    /// Largest gap between pieces, m.
    pub gap: f64,
}

/// Price of a squared gap in the merit, s/m^2.
const GAP_PRICE: f64 = 200.0;

/// Improves `x`.
pub(super) fn solve<F: DistanceField>(problem: &mut Problem<'_, F>, x: &mut [f64], options: &SolverOptions) -> Solved {
    let layout = problem.layout;
    let (mut here, mut there) = (Derivatives::new(layout), Derivatives::new(layout));
    let mut factor = here.hessian.clone();
    let (mut step, mut trial, mut product) = (x.to_vec(), x.to_vec(), x.to_vec());
    let mut damping = crate::optimize::steer::env("DAMP", 0.3);
    let price = crate::optimize::steer::env("PRICE", GAP_PRICE);
    let mut cost = problem.evaluate(x, &mut here);
    let mut solved = Solved { cost, iterations: 0, evaluations: 1, converged: false, gap: f64::INFINITY };
    let natural = problem.natural();
    let mut flat = 0;
    let mut multipliers = problem.multipliers.clone();
    while solved.iterations < options.max_iterations {
        solved.iterations += 1;
        let mut found = false;
        let mut hopeless = false;
        if damped(&here, &natural, damping, &mut factor) {
            for (s, g) in step.iter_mut().zip(&here.gradient) {
                *s = -g;
            }
            factor.solve(&mut step);
            here.hessian.multiply(&step, &mut product);
            for ((t, x), s) in trial.iter_mut().zip(x.iter()).zip(&step) {
                *t = x + s;
            }
            let closed = problem.linear_gaps(x, &step);
            // Model and merit before and after, gaps apart.
            let (mut model, mut merit_here, mut merit_model) = (0.0, cost, cost);
            for ((s, g), h) in step.iter().zip(&here.gradient).zip(&product) {
                model += s * (g + 0.5 * h);
            }
            for (piece, (gap, change)) in here.gaps.iter().zip(&closed).enumerate() {
                for axis in 0..2 {
                    let (c, d) = (gap[axis], change[axis]);
                    let old = problem.multipliers[piece][axis];
                    model -= d * (old + STIFFNESS * c) + 0.5 * STIFFNESS * d * d;
                    let new = old + STIFFNESS * (c + d);
                    multipliers[piece][axis] = new;
                    merit_here += new * c + 0.5 * price * c * c;
                    merit_model += new * (c + d) + 0.5 * price * (c + d) * (c + d);
                }
            }
            merit_model += model;
            let predicted = merit_here - merit_model;
            let reached = problem.evaluate_with(&trial, &mut there, &multipliers);
            solved.evaluations += 1;
            let mut merit_there = reached;
            for (gap, new) in there.gaps.iter().zip(&multipliers) {
                for axis in 0..2 {
                    merit_there += new[axis] * gap[axis] + 0.5 * price * gap[axis] * gap[axis];
                }
            }
            let decrease = merit_here - merit_there;
            hopeless = predicted <= 1e-9 * cost;
            found = merit_there.is_finite() && decrease > 1e-4 * predicted && predicted > 0.0;
            if found {
                let ratio = decrease / predicted;
                damping *= if ratio > 0.75 { 0.2 } else if ratio < 0.25 { 3.0 } else { 0.6 };
                damping = damping.max(1e-9);
                x.copy_from_slice(&trial);
                std::mem::swap(&mut here, &mut there);
                problem.multipliers.copy_from_slice(&multipliers);
                let gap = largest(&here.gaps);
                flat = if decrease <= options.tolerance * reached.abs() && gap <= options.gap_tolerance.max(1e-4) { flat + 1 } else { 0 };
                cost = reached;
                if std::env::var("TRACE").is_ok() {
                    eprintln!("  it {} cost {:.4} merit {:.5}->{:.5} pred {:.2e} ratio {:.2} gap {:.1e} damp {:.1e}", solved.iterations, cost, merit_here, merit_there, predicted, ratio, gap, damping);
                }
            } else if std::env::var("TRACE").is_ok() {
                eprintln!("  it {} REJECT merit {:.5}->{:.5} pred {:.2e} damp {:.1e}", solved.iterations, merit_here, merit_there, predicted, damping);
            }
        }
        if !found {
            damping *= 8.0;
            if damping > 1e8 || hopeless {
                solved.converged = hopeless;
                break;
            }
        }
        if flat >= 1 {
            solved.converged = true;
            break;
        }
    }
    // What is left of the gaps is closed by steps that look at nothing else.
    for _ in 0..4 {
        solved.gap = largest(&here.gaps);
        if solved.gap <= options.gap_tolerance {
            break;
        }
        if !damped(&here, &natural, 1e-3, &mut factor) {
            break;
        }
        let multipliers = vec![[0.0; 2]; here.gaps.len()];
        problem.gap_gradient(x, &here.gaps, &mut step);
        step.iter_mut().for_each(|s| *s = -*s);
        factor.solve(&mut step);
        x.iter_mut().zip(&step).for_each(|(x, s)| *x += s);
        cost = problem.evaluate_with(x, &mut here, &multipliers);
        solved.evaluations += 1;
    }
    solved.gap = largest(&here.gaps);
    solved.cost = cost;
    solved
}

fn largest(gaps: &[[f64; 2]]) -> f64 {
    gaps.iter().flatten().fold(0.0f64, |m, g| m.max(g.abs()))
}

/// The Hessian with its diagonal grown: by what a natural step of each unknown is, and by the costs' share of it; factored.
fn damped(at: &Derivatives, natural: &[f64], damping: f64, factor: &mut Banded) -> bool {
    factor.copy_from(&at.hessian);
    let share = crate::optimize::steer::env("SHARE", 0.1);
    for (i, natural) in natural.iter().enumerate() {
        let diagonal = (at.hessian.diagonal(i) - at.stiff[i]).max(0.0);
        *factor.entry(i, i) += damping * (share * diagonal + natural);
    }
    factor.factor()
}
