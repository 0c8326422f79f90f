//! Heading and arc length as polynomials in time (MATH section 10): spins, stops, cusps and reversing are ordinary points, and
//! the whole mission is one motion from rest to rest.

mod guess;
mod hermite;
mod integral;
mod layout;
mod limits;
mod local;
mod near;
mod problem;
mod rows;
mod solver;
mod swing;

use super::OptimizeOptions;
use super::contour::Contour;
use super::penalty::Limits;
use super::penalty::clearance::ClearancePenalty;
use super::penalty::field::DistanceField;
use super::penalty::zone::ZonePenalty;
use super::sections::still;
use crate::math::poly::{Piece, PiecewisePoly};
use crate::math::real;
use crate::robot::RobotModel;
use crate::search::{SearchMove, SearchPath};
use crate::trajectory::steered_curve::SteeredCurve;
use crate::trajectory::{Ending, Leg, OptimiserOutcome, SteerLeg, Trajectory, TrajectorySource};

use guess::guess;
use layout::Layout;
use problem::{Problem, Weights};
use solver::{Solved, SolverOptions, Workspace, close, solve};
use swing::Swing;

/// How to optimise heading and arc length.
#[derive(Debug, Clone, PartialEq)]
pub struct SteerOptions {
    /// Weight of the jerk (squared, relative to the wheels' and joints' jerk limits) against time; larger is smoother. Default 7: little,
    /// since the way that takes the least time is sought.
    pub smoothness: f64,
    /// The same in the optimiser's own timing of the way that it has found: all durations are stretched alike, until time and
    /// jerk are least. Default 200: a mean jerk as small as \[SCR\]'s at its limits. A time law sets the pace anew.
    pub own_smoothness: f64,
    /// Weight of a limit overstepped by 100 % for 1 s, s. Default 15.
    pub motion_weight: f64,
    /// Weight of one contour point that misses the clearance by [`OptimizeOptions::clearance_scale`] for 1 s, s. Default 200.
    pub clearance_weight: f64,
    /// Limits and clearance are looked at once in this distance, m (default 0.15), that the base drives or the joints move a shape, and
    /// in this time, s (default 0.2), of the first guess.
    pub sample_distance: f64,
    /// See `sample_distance`.
    pub sample_time: f64,
    /// Steps at most. Default 120.
    pub max_iterations: usize,
    /// The iteration ends where a step lowers the cost by less than this share. Default 1e-3.
    pub tolerance: f64,
}

impl Default for SteerOptions {
    fn default() -> Self {
        Self {
            smoothness: 7.0,
            own_smoothness: 200.0,
            motion_weight: 15.0,
            clearance_weight: 200.0,
            sample_distance: 0.15,
            sample_time: 0.2,
            max_iterations: 120,
            tolerance: 1e-3,
        }
    }
}

impl SteerOptions {
    /// For a motion that was refused: looks twice as often, and pays four times as much for clearance and limits.
    pub fn closer(&self) -> Self {
        Self {
            motion_weight: 4.0 * self.motion_weight,
            clearance_weight: 4.0 * self.clearance_weight,
            sample_distance: 0.5 * self.sample_distance,
            sample_time: 0.5 * self.sample_time,
            ..self.clone()
        }
    }
}

/// Most that the own timing is stretched.
const SLOWEST: f64 = 10.0;
/// Backing up by less than this is rounding, m/s.
const BACKING: f64 = 1e-9;
/// Least speed that is asked of a motion that only drives forwards, as a share of the speed limit: what the penalty is soft by.
const FLOOR: f64 = 0.02;
/// How often a motion that backs up is made again with a higher floor under its speed.
const BACKING_ROUNDS: usize = 4;
/// Largest gap that is left between pieces, m: the end point may be off by a few of them.
const GAP_TOLERANCE: f64 = 1e-9;
/// How near to the goal the curve ends, m, and in how many rounds at most.
const END_TOLERANCE: f64 = 1e-8;
const END_ROUNDS: usize = 4;

/// Smooths a path as one motion from its first state to its last, beginning with a motion that was made of the same path and the
/// factor by which it was slowed, if there is one.
pub fn optimize_steered<F: DistanceField>(
    path: &SearchPath,
    field: &F,
    robot: &RobotModel,
    options: &OptimizeOptions,
    from: Option<(&SteerLeg, f64)>,
) -> Trajectory {
    let limits = Limits::new(robot, 1.0);
    let Some(first) = guess(path, &limits) else {
        let leg = still(&path.states[0], &path.states[0]);
        let outcome = OptimiserOutcome { pieces: 0, iterations: 0, ending: Ending::Converged, cost: 0.0, slowed: 1.0 };
        return trajectory(Leg::Still(leg), outcome);
    };
    let spacing = options.contour_spacing.unwrap_or_else(|| field.cell().clamp(0.03, 0.08));
    let contour = Contour::new(robot, spacing);
    let mut swing = Swing::new(robot, &contour);
    let clearance = ClearancePenalty::new(contour, robot, options.clearance, options.clearance_scale, field.cell());
    let own = &options.steer;
    let weights = Weights {
        smoothness: own.smoothness,
        motion: own.motion_weight,
        clearance: own.clearance_weight,
        clearance_unit: options.clearance_scale,
    };
    let layout = first.layout;
    let mut x = first.x;
    if let Some((leg, slowed)) = from {
        take_over(layout, leg, &first.fixed, &mut x);
        slow(layout, 1.0 / slowed, &mut x);
    }
    let counts: Vec<usize> = (0..layout.pieces).map(|k| samples(layout, k, &x, own, swing.of(layout, k, &x))).collect();
    let mut problem = Problem::new(robot, field, clearance, first.directions, first.fixed, &counts, weights);
    problem.zones = ZonePenalty::new(&options.zones, limits.acceleration);
    let solver =
        SolverOptions { max_iterations: own.max_iterations, tolerance: own.tolerance, gap_tolerance: GAP_TOLERANCE };
    let forwards = path.moves.iter().all(|step| *step != SearchMove::Reverse);
    if forwards {
        problem.floors.fill(FLOOR * limits.speed);
    }
    let mut work = Workspace::new(&problem);
    let mut solved = solve(&mut problem, &mut x, &solver, &mut work);
    // The penalty is soft. A path that only drives forwards must not be left to back up, be it by a millimetre.
    for _ in 0..if forwards { BACKING_ROUNDS } else { 0 } {
        let backing = problem.backing_up(&x);
        if backing.iter().all(|back| *back <= BACKING) {
            break;
        }
        for (floor, back) in problem.floors.iter_mut().zip(&backing) {
            *floor += if *back > BACKING { 2.0 * back + 1e-3 * limits.speed } else { 0.0 };
        }
        let again = solve(&mut problem, &mut x, &solver, &mut work);
        solved = Solved { iterations: solved.iterations + again.iterations, ..again };
    }
    let pose = path.states[0].pose;
    let goal = path.states[path.states.len() - 1].pose;
    // The samples' quadrature is off by a few micrometres over the whole way; the curve itself must end at the goal.
    for _ in 0..END_ROUNDS {
        let Ok(exact) = SteeredCurve::new(&SteerLeg { pose, curve: curve(layout, &x) }) else { break };
        let end = exact.end_pose();
        let off = [goal.x - end.x, goal.y - end.y];
        if real::hypot(off[0], off[1]) <= END_TOLERANCE {
            break;
        }
        let at = layout.position(layout.pieces);
        x[at] += off[0];
        x[at + 1] += off[1];
        close(&mut problem, &mut x, GAP_TOLERANCE, &mut work);
    }
    // T k + J k^-5 is least where k^6 = 5 J / T.
    let jerk = problem.jerk(&x) * own.own_smoothness / own.smoothness;
    let time: f64 = (0..layout.pieces).map(|piece| real::exp(x[layout.duration(piece)])).sum();
    let least = real::powf(5.0 * jerk / time, 1.0 / 6.0);
    let slowed = if least.is_nan() { 1.0 } else { least.clamp(1.0, SLOWEST) };
    slow(layout, slowed, &mut x);
    let leg = SteerLeg { pose, curve: curve(layout, &x) };
    let ending = if solved.converged { Ending::Converged } else { Ending::IterationLimit };
    let outcome =
        OptimiserOutcome { pieces: layout.pieces, iterations: solved.iterations, ending, cost: solved.cost, slowed };
    trajectory(Leg::Steer(leg), outcome)
}

/// Sets the unknowns that are free to those of a motion with the same pieces; leaves them where it has others.
fn take_over(layout: Layout, leg: &SteerLeg, fixed: &[bool], x: &mut [f64]) {
    let pieces = &leg.curve.pieces;
    let fits = pieces.len() == layout.pieces && pieces.iter().all(|p| p.coefficients.len() == layout.dimensions);
    let Some(exact) = SteeredCurve::new(leg).ok().filter(|_| fits) else { return };
    let mut set = |at: usize, value: f64| {
        if !fixed[at] {
            x[at] = value;
        }
    };
    let mut time = 0.0;
    for node in 0..=layout.pieces {
        let place = exact.place(time);
        for dimension in 0..layout.dimensions {
            for (order, value) in exact.jet(dimension, place).into_iter().take(hermite::ORDERS).enumerate() {
                set(layout.state(node, dimension, order), value);
            }
        }
        let pose = exact.pose(place);
        set(layout.position(node), pose.x);
        set(layout.position(node) + 1, pose.y);
        if let Some(piece) = pieces.get(node) {
            set(layout.duration(node), real::ln(piece.duration));
            time += piece.duration;
        }
    }
}

/// Makes all durations so many times as long.
fn slow(layout: Layout, factor: f64, x: &mut [f64]) {
    for node in 0..=layout.pieces {
        for dimension in 0..layout.dimensions {
            x[layout.state(node, dimension, 1)] /= factor;
            x[layout.state(node, dimension, 2)] /= factor * factor;
        }
    }
    for piece in 0..layout.pieces {
        x[layout.duration(piece)] += real::ln(factor);
    }
}

/// How often a piece is looked at: an even number. `swing`: how far the joints alone move any shape, m.
fn samples(layout: Layout, piece: usize, x: &[f64], options: &SteerOptions, swing: f64) -> usize {
    let arc = |node: usize| x[layout.state(node, layout::ARC, 0)];
    let length = (arc(piece + 1) - arc(piece)).abs();
    let time = real::exp(x[layout.duration(piece)]);
    let count = (length.max(swing) / options.sample_distance).max(time / options.sample_time);
    2 * (0.5 * count.clamp(6.0, 40.0)).ceil() as usize
}

fn trajectory(leg: Leg, outcome: OptimiserOutcome) -> Trajectory {
    Trajectory { legs: vec![leg], source: TrajectorySource::Optimised, optimiser: Some(outcome) }
}

/// The unknowns as polynomials in seconds.
fn curve(layout: Layout, x: &[f64]) -> PiecewisePoly {
    let piece = |k: usize| {
        let time = real::exp(x[layout.duration(k)]);
        let coefficients = (0..layout.dimensions).map(|dimension| {
            let unit = hermite::coefficients(&layout.data(k, dimension, x, time));
            unit.iter().enumerate().map(|(power, c)| c / real::powi(time, power as i32)).collect()
        });
        Piece { duration: time, coefficients: coefficients.collect() }
    };
    PiecewisePoly { pieces: (0..layout.pieces).map(piece).collect() }
}

#[cfg(test)]
mod tests;
