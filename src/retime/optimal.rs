//! The least time along a curve in actuator space under speed, acceleration and jerk limits of every row.
//!
//! The curve comes with a *reference clock*: rows q(t) from rest to rest, t in `[0, duration]`, every derivative bounded. The law is
//! sought as b(t) = (dt/dtau)^2 > 0, tau the new time: then
//!
//! `dq/dtau = q' sqrt(b)`, `d2q/dtau2 = q'' b + q' b'/2`, `d3q/dtau3 = sqrt(b) (q''' b + 3/2 q'' b' + q' b''/2)`,
//!
//! so speed is a cap on b, acceleration is linear in b, and only the jerk is not convex. With b a quadratic B-spline (`grid`) the
//! acceleration is continuous and the jerk bounded. The time, the integral of dt/sqrt(b), falls from a feasible start by an
//! interior-point method (`barrier`) that never leaves the limits: O(cells) a step. [`Pace`] is tau as a function, exactly.
//!
//! Knows nothing of wheels, courses or robots: rows, limits and breaks.

use crate::math::real;
mod barrier;
mod grid;
mod guess;
mod pace;

pub use pace::Pace;

use grid::Grid;

/// How much coarser the first law's cells are, and how near it comes to the least time.
const COARSE: (f64, f64) = (4.0, 1e-2);
/// How near the law comes to the least time on its cells, as a share.
const GAP: f64 = 2e-4;
/// Cells are this short compared with a build-up of acceleration.
const STEP: f64 = 0.15;
/// A row's speed over its limit that counts as none, so that what the limit allows stays finite.
const STILL: f64 = 1e-100;

/// A curve in actuator space with its reference clock, and what must hold along it.
#[derive(Debug, Clone, Copy)]
pub struct Problem<'a> {
    /// Reference times between which the rows are smooth, ascending, both ends included. Fewer derivatives are continuous across
    /// them, or it is where samples are well placed.
    pub breaks: &'a [f64],
    /// Speed, acceleration and jerk limit of every row; infinite where there is none.
    pub limits: &'a [[f64; 3]],
    /// Jerk that a jump of acceleration by 1 counts as, 1/s: such a jump is a jerk impulse, and what it does depends on for how long
    /// commands are held.
    pub jerk_of_jump: f64,
    /// About how long a cell should take, s.
    pub step: f64,
}

/// A good [`Problem::step`] for a row: a share of the time in which it builds up its acceleration, or as much of it as it needs for its
/// speed. A tenth of a percent or two of the least time are lost to it.
pub fn step([speed, acceleration, jerk]: [f64; 3]) -> f64 {
    STEP * (acceleration / jerk).min((speed / jerk).sqrt())
}

/// The fastest clock for the curve that `rates` gives (appends every row's first three derivatives at a reference time), limits kept at
/// the grid's points: between them they may be exceeded by a little. `None`: the curve does not move, or is not finite.
pub fn fastest(problem: &Problem<'_>, mut rates: impl FnMut(f64, &mut Vec<[f64; 3]>)) -> Option<Pace> {
    // A coarse law first: most steps are taken where they cost little.
    let coarse = Grid::new(problem, COARSE.0, &mut rates)?;
    let first = Pace::new(&coarse.knots, barrier::solve(problem, &coarse, COARSE.1, None)?.into_iter());
    let grid = Grid::new(problem, 1.0, &mut rates)?;
    let near = |t: f64| real::powi(first.at(first.time_at(t))[1], 2);
    let cells = barrier::solve(problem, &grid, GAP, Some(&near))?;
    Some(Pace::new(&grid.knots, cells.into_iter()))
}

#[cfg(test)]
mod tests;
