//! Stage 7: MINCO (s = 4) over (x, y, joints): smooths the search's path under \[SCR\]'s penalties.
//!
//! `sections` cuts the path at cusps and large spins; each driven section becomes one curve (`leg`): first guess (`initial`),
//! cost and gradient ([`objective`] over [`minco`], [`flatness`], [`penalty`], [`contour`]), L-BFGS. A section whose curve is
//! not sound is cut at the spin nearest to its worst piece, where the robot then stops, and both parts are tried again.
//!
//! With `parameterisation: arc_length` the polynomials are those of heading and arc length instead ([`steer`]).

mod basis;
pub mod contour;
pub mod flatness;
mod initial;
mod leg;
pub mod minco;
pub mod objective;
mod options;
pub mod penalty;
mod sections;
pub mod slack;
pub mod steer;
#[cfg(test)]
pub(crate) mod test_robot;
pub mod time_map;

use crate::esdf::Esdf;
use crate::mission::Parameterisation;
use crate::robot::RobotModel;
use crate::search::SearchPath;
use crate::trajectory::{Ending, Leg, OptimiserOutcome, Trajectory, TrajectorySource};

use leg::{Context, SolvedLeg, solve};
pub use options::OptimizeOptions;
pub use penalty::field::DistanceField;
use sections::{DriveSection, Section, Thresholds, sections, still};

/// Smooths a path. Legs begin and end exactly at the path's states; headings keep the path's branch, so the last one is the
/// path's own. Always returns a trajectory without NaN; how well it went is in [`Trajectory::optimiser`].
pub fn optimize(path: &SearchPath, esdf: &Esdf, robot: &RobotModel, options: &OptimizeOptions) -> Trajectory {
    optimize_in(path, esdf, robot, options)
}

/// Smooths a path, going on from a trajectory that [`optimize`] made of it and that was refused: with other options, but not from the
/// beginning. Takes the polynomials of heading and arc length alone; from another trajectory it is [`optimize`].
pub fn resume<F: DistanceField>(
    path: &SearchPath,
    field: &F,
    robot: &RobotModel,
    options: &OptimizeOptions,
    refused: &Trajectory,
) -> Trajectory {
    let from = match &refused.legs[..] {
        [Leg::Steer(leg)] => Some((leg, refused.optimiser.map_or(1.0, |outcome| outcome.slowed))),
        _ => None,
    };
    match options.parameterisation {
        Parameterisation::Flat => optimize_flat(path, field, robot, options),
        Parameterisation::ArcLength => steer::optimize_steered(path, field, robot, options, from),
    }
}

/// [`optimize`] in any distance field.
pub fn optimize_in<F: DistanceField>(
    path: &SearchPath,
    field: &F,
    robot: &RobotModel,
    options: &OptimizeOptions,
) -> Trajectory {
    match options.parameterisation {
        Parameterisation::Flat => optimize_flat(path, field, robot, options),
        Parameterisation::ArcLength => steer::optimize_steered(path, field, robot, options, None),
    }
}

/// Positions as polynomials.
fn optimize_flat<F: DistanceField>(
    path: &SearchPath,
    field: &F,
    robot: &RobotModel,
    options: &OptimizeOptions,
) -> Trajectory {
    let context = Context::new(robot, field, options);
    let mut legs = Vec::new();
    let mut outcome = OptimiserOutcome { pieces: 0, iterations: 0, ending: Ending::Converged, cost: 0.0, slowed: 1.0 };
    for section in sections(path, 0, path.moves.len(), &context.limits, context.thresholds) {
        match section {
            Section::Still(leg) => legs.push(Leg::Still(leg)),
            Section::Drive(drive) => solve_or_split(path, drive, &context, &mut legs, &mut outcome),
        }
    }
    if legs.is_empty() {
        legs.extend(path.states.first().zip(path.states.last()).map(|(a, b)| Leg::Still(still(a, b))));
    }
    Trajectory { legs, source: TrajectorySource::Optimised, optimiser: Some(outcome) }
}

/// Solves a section; one that no sound curve follows is cut where it is worst, and both parts are tried again.
fn solve_or_split<F: DistanceField>(
    path: &SearchPath,
    drive: DriveSection,
    context: &Context<'_, F>,
    legs: &mut Vec<Leg>,
    outcome: &mut OptimiserOutcome,
) {
    let solved = solve(path, &drive, context);
    outcome.iterations += solved.iterations;
    let Some(cut) = solved.cut.filter(|_| !solved.sound) else {
        // Where there is nothing to cut, this is as good as it gets. The certificate judges.
        return keep(solved, legs, outcome);
    };
    let thresholds = Thresholds { cut: Some(cut), ..context.thresholds };
    let parts = sections(path, drive.first, drive.last, &context.limits, thresholds);
    if parts.len() < 2 {
        return keep(solved, legs, outcome);
    }
    for part in parts {
        match part {
            Section::Still(leg) => legs.push(Leg::Still(leg)),
            Section::Drive(drive) => solve_or_split(path, drive, context, legs, outcome),
        }
    }
}

fn keep(solved: SolvedLeg, legs: &mut Vec<Leg>, outcome: &mut OptimiserOutcome) {
    outcome.pieces += solved.pieces;
    outcome.cost += solved.cost;
    outcome.ending = outcome.ending.max(solved.ending);
    legs.push(Leg::Drive(solved.leg));
}

#[cfg(test)]
#[path = "optimize_tests.rs"]
mod tests;
