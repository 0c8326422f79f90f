//! Heading and arc length as polynomials in time (MATH section 10): spins, stops, cusps and reversing are ordinary points, and
//! the whole mission is one motion from rest to rest.

mod guess;
mod hermite;
mod integral;
mod layout;
mod local;
mod problem;
mod solver;

use super::OptimizeOptions;
use super::contour::Contour;
use super::penalty::Limits;
use super::penalty::clearance::{ClearancePenalty, DistanceField};
use crate::math::poly::{Piece, PiecewisePoly};
use crate::robot::RobotModel;
use crate::search::SearchPath;
use crate::trajectory::{Ending, Leg, OptimiserOutcome, SteerLeg, StillLeg, Trajectory, TrajectorySource};

use guess::guess;
use layout::Layout;
use problem::{Problem, Weights};
use solver::{SolverOptions, solve};

pub fn env(name: &str, default: f64) -> f64 {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

/// Smooths a path as one motion from its first state to its last.
pub fn optimize_steered<F: DistanceField>(
    path: &SearchPath,
    field: &F,
    robot: &RobotModel,
    options: &OptimizeOptions,
) -> Trajectory {
    let limits = Limits::new(robot, 1.0);
    let Some(first) = guess(path, &limits) else {
        let state = &path.states[0];
        let leg = StillLeg {
            pose: state.pose,
            yaw_end: state.pose.yaw,
            joints_from: state.joints.clone(),
            joints_to: state.joints.clone(),
        };
        let outcome = OptimiserOutcome { pieces: 0, iterations: 0, ending: Ending::Converged, cost: 0.0 };
        return trajectory(Leg::Still(leg), outcome);
    };
    let spacing = options.contour_spacing.unwrap_or_else(|| field.cell().clamp(0.03, 0.08));
    let contour = Contour::new(robot, spacing);
    let clearance = ClearancePenalty::new(contour, robot, options.clearance, options.clearance_scale, field.cell());
    let weights = Weights {
        smoothness: env("SM", 0.5),
        motion: env("MO", 30.0),
        clearance: env("CL", 200.0),
        clearance_unit: 0.05,
    };
    let layout = first.layout;
    let counts: Vec<usize> = (0..layout.pieces)
        .map(|k| {
            let length = (first.x[layout.state(k + 1, 1, 0)] - first.x[layout.state(k, 1, 0)]).abs();
            let time = first.x[layout.duration(k)].exp();
            let count = (length / env("DL", 0.1)).max(time / env("DT", 0.15));
            2 * (0.5 * count.clamp(4.0, 20.0)).ceil() as usize
        })
        .collect();
    let mut problem =
        Problem::new(robot, field, clearance, first.directions, first.fixed, &counts, weights);
    let mut x = first.x;
    let options = SolverOptions {
        max_iterations: env("ITER", 100.0) as usize,
        tolerance: env("TOL", 1e-3),
        gap_tolerance: 1e-6,
    };
    let solved = solve(&mut problem, &mut x, &options);
    let leg = SteerLeg { pose: path.states[0].pose, curve: curve(layout, &x) };
    let ending = if solved.converged { Ending::Converged } else { Ending::IterationLimit };
    let outcome = OptimiserOutcome { pieces: layout.pieces, iterations: solved.iterations, ending, cost: solved.cost };
    trajectory(Leg::Steer(leg), outcome)
}

fn trajectory(leg: Leg, outcome: OptimiserOutcome) -> Trajectory {
    Trajectory { legs: vec![leg], source: TrajectorySource::Optimised, optimiser: Some(outcome) }
}

/// The unknowns as polynomials in seconds.
fn curve(layout: Layout, x: &[f64]) -> PiecewisePoly {
    let piece = |k: usize| {
        let time = x[layout.duration(k)].exp();
        let coefficients = (0..layout.dimensions).map(|dimension| {
            let unit = hermite::coefficients(&layout.data(k, dimension, x, time));
            unit.iter().enumerate().map(|(power, c)| c / time.powi(power as i32)).collect()
        });
        Piece { duration: time, coefficients: coefficients.collect() }
    };
    PiecewisePoly { pieces: (0..layout.pieces).map(piece).collect() }
}
