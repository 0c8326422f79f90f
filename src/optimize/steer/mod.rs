//! Heading and arc length as polynomials in time (MATH section 10): spins, stops, cusps and reversing are ordinary points, and
//! the whole mission is one motion from rest to rest.

mod guess;
mod hermite;
mod problem;
mod solver;

use crate::geom::Pose2;
use crate::math::poly::{Piece, PiecewisePoly};
use crate::optimize::OptimizeOptions;
use crate::optimize::contour::Contour;
use crate::optimize::penalty::Limits;
use crate::optimize::penalty::clearance::{ClearancePenalty, DistanceField};
use crate::robot::RobotModel;
use crate::search::SearchPath;

use guess::guess;
use problem::{Problem, Weights};
use solver::{SolverOptions, solve};

/// Raw result, for trials.
pub struct Steered {
    pub pose: Pose2,
    pub curve: PiecewisePoly,
    pub iterations: usize,
    pub evaluations: usize,
    pub converged: bool,
    pub gap: f64,
    pub cost: f64,
}

pub fn env(name: &str, default: f64) -> f64 {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

pub fn steer_raw<F: DistanceField>(
    path: &SearchPath,
    field: &F,
    robot: &RobotModel,
    options: &OptimizeOptions,
) -> Option<Steered> {
    let limits = Limits::new(robot, 1.0);
    let first = guess(path, &limits)?;
    let spacing = options.contour_spacing.unwrap_or_else(|| field.cell().clamp(0.03, 0.08));
    let contour = Contour::new(robot, spacing);
    let clearance = ClearancePenalty::new(contour, robot, options.clearance, 0.05, field.cell());
    let weights = Weights {
        smoothness: env("SM", 0.05),
        motion: env("MO", 100.0),
        clearance: env("CL", 200.0),
        clearance_unit: 0.05,
    };
    let layout = first.layout;
    let mut problem =
        Problem::new(robot, field, clearance, first.directions, first.fixed, env("SAMPLES", 10.0) as usize, weights);
    let mut x = first.x;
    let options = SolverOptions {
        max_iterations: env("ITER", 100.0) as usize,
        tolerance: env("TOL", 1e-3),
        gap_tolerance: 1e-6,
    };
    let solved = solve(&mut problem, &mut x, &options);
    let pieces = (0..layout.pieces)
        .map(|k| {
            let time = x[layout.duration(k)].exp();
            let coefficients = (0..layout.dimensions)
                .map(|d| {
                    let mut data = [0.0; 6];
                    for side in 0..2 {
                        let at = layout.state(k + side, d, 0);
                        data[3 * side] = x[at];
                        data[3 * side + 1] = x[at + 1] * time;
                        data[3 * side + 2] = x[at + 2] * time * time;
                    }
                    let unit = hermite::coefficients(&data);
                    (0..6).map(|p| unit[p] / time.powi(p as i32)).collect()
                })
                .collect();
            Piece { duration: time, coefficients }
        })
        .collect();
    Some(Steered {
        pose: path.states[0].pose,
        curve: PiecewisePoly { pieces },
        iterations: solved.iterations,
        evaluations: solved.evaluations,
        converged: solved.converged,
        gap: solved.gap,
        cost: solved.cost,
    })
}
