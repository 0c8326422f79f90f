//! `parameterisation: arc_length` (MATH section 10): heading and arc length as polynomials in time.
//!
//! The search's path as one leg, from rest to rest at each of its corners: a smooth step of every actuator for each spin and each
//! straight, as fast as the limits let it be.

use super::{OptimizeOptions, penalty::clearance::DistanceField};
use crate::math::poly::{Piece, PiecewisePoly};
use crate::robot::RobotModel;
use crate::search::{SearchMove, SearchPath, SearchState};
use crate::trajectory::{Ending, Leg, OptimiserOutcome, SteerLeg, StillLeg, Trajectory, TrajectorySource};

/// The step from 0 to 1 whose first three derivatives vanish at both ends: its fourth to seventh coefficient.
const STEP: [f64; 4] = [35.0, -84.0, 70.0, -20.0];
/// Its greatest first, second and third derivative: 35/16, 84 sqrt(5)/25, 105/2.
const PEAKS: [f64; 3] = [2.1875, 7.513_188_404_399_293, 52.5];
/// A change smaller than this moves nothing, m or rad.
const NOTHING: f64 = 1e-12;

/// Heading and arc length through a path, from its first state to its last.
pub fn optimize_steered<F: DistanceField>(
    path: &SearchPath,
    _field: &F,
    robot: &RobotModel,
    _options: &OptimizeOptions,
) -> Trajectory {
    let first = &path.states[0];
    let mut at: Vec<f64> = [first.pose.yaw, 0.0].into_iter().chain(first.joints.iter().copied()).collect();
    let mut pieces = Vec::new();
    for (kind, states) in path.moves.iter().zip(path.states.windows(2)) {
        let to = after(&at, *kind, &states[0], &states[1]);
        pieces.extend(step(&at, &to, robot));
        at = to;
    }
    let leg = if pieces.is_empty() {
        let joints = first.joints.clone();
        Leg::Still(StillLeg {
            pose: first.pose,
            yaw_end: first.pose.yaw,
            joints_from: joints.clone(),
            joints_to: joints,
        })
    } else {
        Leg::Steer(SteerLeg { pose: first.pose, curve: PiecewisePoly { pieces } })
    };
    let (pieces, cost) = match &leg {
        Leg::Steer(steer) => (steer.curve.pieces.len(), steer.curve.duration()),
        _ => (0, 0.0),
    };
    let outcome = OptimiserOutcome { pieces, iterations: 0, ending: Ending::Converged, cost };
    Trajectory { legs: vec![leg], source: TrajectorySource::Optimised, optimiser: Some(outcome) }
}

/// Heading, arc length and joints after a move.
fn after(at: &[f64], kind: SearchMove, from: &SearchState, to: &SearchState) -> Vec<f64> {
    let along = match kind {
        SearchMove::Still => 0.0,
        SearchMove::Forward => from.pose.distance(to.pose),
        SearchMove::Reverse => -from.pose.distance(to.pose),
    };
    [to.pose.yaw, at[1] + along].into_iter().chain(to.joints.iter().copied()).collect()
}

/// The piece from one state to the next, at rest at both; `None` where nothing moves.
fn step(from: &[f64], to: &[f64], robot: &RobotModel) -> Option<Piece> {
    let change: Vec<f64> = from.iter().zip(to).map(|(from, to)| to - from).collect();
    let (turn, along, base) = (change[0], change[1], &robot.base);
    let mut moved = vec![
        (turn, [base.angular_speed, base.angular_acceleration, f64::INFINITY]),
        (along, [base.speed, base.acceleration, f64::INFINITY]),
    ];
    let arm = 0.5 * robot.track_width;
    moved.extend([along - arm * turn, along + arm * turn].map(|rim| (rim, robot.wheel.planning())));
    moved.extend(change[2..].iter().zip(&robot.joints).map(|(change, joint)| (*change, joint.limits.planning())));
    let seconds = |(change, limits): &(f64, [f64; 3])| {
        let over = |order: usize| PEAKS[order] * change.abs() / limits[order];
        over(0).max(over(1).sqrt()).max(over(2).cbrt())
    };
    let duration = moved.iter().map(seconds).fold(0.0, f64::max);
    if change.iter().all(|change| change.abs() <= NOTHING) {
        return None;
    }
    let coefficients = from.iter().zip(&change).map(|(from, change)| {
        let mut powers = vec![*from, 0.0, 0.0, 0.0];
        powers.extend(STEP.iter().enumerate().map(|(k, c)| change * c / duration.powi(4 + k as i32)));
        powers
    });
    Some(Piece { duration, coefficients: coefficients.collect() })
}
