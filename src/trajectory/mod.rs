//! The planned motion: what `optimize` and given paths make, and `retime` reads.
//!
//! A [`Trajectory`] is a list of [`Leg`]s, each from rest to rest. What may jump between legs: the direction of driving, the
//! kind of motion. What may not: position, heading (radians, not wrapped), joint values.

#[cfg(test)]
pub(crate) mod fixtures;
pub mod given;
pub mod plane_curve;
mod standing;
pub mod steered_curve;

use crate::geom::Pose2;
use crate::math::poly::PiecewisePoly;
use crate::math::real;
use crate::mission::Parameterisation;

/// Planned motion from start to goal.
#[derive(Debug, Clone, PartialEq)]
pub struct Trajectory {
    /// Never empty; a mission whose start is its goal has one [`Leg::Still`] that moves nothing.
    pub legs: Vec<Leg>,
    /// Where it comes from.
    pub source: TrajectorySource,
    /// How the optimiser ended; `None` where it did not run.
    pub optimiser: Option<OptimiserOutcome>,
}

impl Trajectory {
    /// How its curves are written; `None` where it has none.
    pub fn parameterisation(&self) -> Option<Parameterisation> {
        self.legs.iter().find_map(|leg| match leg {
            Leg::Drive(_) => Some(Parameterisation::Flat),
            Leg::Steer(_) => Some(Parameterisation::ArcLength),
            Leg::Still(_) => None,
        })
    }
}

/// Where a trajectory comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TrajectorySource {
    /// The optimiser.
    Optimised,
    /// The search's path, driven stop, spin, go.
    Search,
    /// The mission's own path.
    Given,
}

/// How the optimiser ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OptimiserOutcome {
    /// Polynomial pieces over all legs.
    pub pieces: usize,
    /// L-BFGS iterations over all legs.
    pub iterations: usize,
    /// The worst over all legs.
    pub ending: Ending,
    /// Final cost, summed over legs.
    pub cost: f64,
    /// How many times as long as in that cost all durations are, for a gentler timing; 1 where there is none of its own.
    pub slowed: f64,
}

/// How an iteration ended; worse endings compare greater.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Ending {
    /// Gradient or cost change below the tolerance.
    Converged,
    /// Out of iterations.
    IterationLimit,
    /// The line search found no descent.
    LineSearchStalled,
}

/// A stretch of motion from rest to rest.
#[derive(Debug, Clone, PartialEq)]
pub enum Leg {
    /// Driving along a plane curve.
    Drive(DriveLeg),
    /// The base turns on the spot or stands; joints move in proportion.
    Still(StillLeg),
    /// Heading and arc length as functions of time.
    Steer(SteerLeg),
}

/// Driving along a plane curve; heading is the direction of motion, plus pi when backwards.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveLeg {
    /// Dimensions x, y (m), then one per moving joint (rad or m). Parameter: seconds of the optimiser's own timing, or any
    /// parameter (given paths). The first derivative of (x, y) vanishes nowhere; curvature is continuous within a leg.
    pub curve: PiecewisePoly,
    /// Drives backwards.
    pub reverse: bool,
    /// Heading at the leg's start, radians; fixes the branch of the heading for the leg.
    pub yaw_start: f64,
}

/// On the spot: everything moves in proportion to one law.
#[derive(Debug, Clone, PartialEq)]
pub struct StillLeg {
    /// Where it begins.
    pub pose: Pose2,
    /// Heading at the end, not wrapped: turns by `yaw_end - pose.yaw`.
    pub yaw_end: f64,
    /// Joint values at the start.
    pub joints_from: Vec<f64>,
    /// Joint values at the end.
    pub joints_to: Vec<f64>,
}

/// Heading and arc length as polynomials in time (MATH section 10): spins, stops, cusps and reversing are ordinary points.
#[derive(Debug, Clone, PartialEq)]
pub struct SteerLeg {
    /// Where it begins; `pose.yaw` equals the curve's first heading.
    pub pose: Pose2,
    /// Dimensions: heading (rad, absolute, not wrapped), signed arc length driven (m, 0 at the start, falls when backwards), then one per
    /// moving joint. Parameter: seconds of the optimiser's own timing. At rest (first two derivatives zero) at both ends; second
    /// derivatives continuous inside.
    pub curve: PiecewisePoly,
}

/// Straight drives between poses with spins in between: a trajectory through the positions of a sampled motion. Joints are
/// carried along in proportion.
pub fn through_poses(states: &[(Pose2, Vec<f64>)]) -> Trajectory {
    let mut legs = Vec::new();
    let mut yaw = states.first().map_or(0.0, |(pose, _)| pose.yaw);
    for pair in states.windows(2) {
        let ((from, joints_from), (to, joints_to)) = (&pair[0], &pair[1]);
        let (dx, dy) = (to.x - from.x, to.y - from.y);
        let length = real::hypot(dx, dy);
        if length < 1e-9 {
            let still = StillLeg {
                pose: Pose2 { yaw, ..*from },
                yaw_end: to.yaw,
                joints_from: joints_from.clone(),
                joints_to: joints_to.clone(),
            };
            yaw = to.yaw;
            legs.push(Leg::Still(still));
            continue;
        }
        let middle = 0.5 * (from.yaw + to.yaw);
        let direction = real::atan2(dy, dx);
        let reverse = crate::geom::wrap_angle(direction - middle).abs() > std::f64::consts::FRAC_PI_2;
        let heading = direction + if reverse { std::f64::consts::PI } else { 0.0 };
        let heading = crate::geom::unwrap_near(heading, middle);
        if (heading - yaw).abs() > 1e-12 {
            let still = StillLeg {
                pose: Pose2 { yaw, ..*from },
                yaw_end: heading,
                joints_from: joints_from.clone(),
                joints_to: joints_from.clone(),
            };
            legs.push(Leg::Still(still));
        }
        yaw = heading;
        let linear = |a: f64, b: f64| vec![a, (b - a) / length];
        let mut coefficients = vec![linear(from.x, to.x), linear(from.y, to.y)];
        coefficients.extend(joints_from.iter().zip(joints_to).map(|(a, b)| linear(*a, *b)));
        let piece = crate::math::poly::Piece { duration: length, coefficients };
        legs.push(Leg::Drive(DriveLeg { curve: PiecewisePoly { pieces: vec![piece] }, reverse, yaw_start: heading }));
    }
    if legs.is_empty() {
        let (pose, joints) = states.first().cloned().unwrap_or_default();
        legs.push(Leg::Still(StillLeg { pose, yaw_end: pose.yaw, joints_from: joints.clone(), joints_to: joints }));
    }
    Trajectory { legs, source: TrajectorySource::Given, optimiser: None }
}
