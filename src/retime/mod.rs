//! Stage 8: when to be where on the path: time laws under wheel and joint limits.
//!
//! Every leg is a curve q = (left wheel, right wheel, joints) of one parameter ([`course`]). A law makes that parameter a function
//! of time ([`convolution`], [`warp`], [`optimal`]); joints are carried along, so no law changes the set of poses and postures. Then each
//! leg is slowed down uniformly until every limit holds ([`limits`], [`peaks`]).

pub mod convolution;
pub mod course;
pub mod law;
pub mod limits;
pub mod metric;
pub mod optimal;
pub mod peaks;
pub mod printed;
pub mod profile;
pub mod steered;
pub mod timed_leg;
pub mod warp;
pub mod zones;

use crate::diag::{Describe, Diagnostic};
use crate::mission::{SpeedZone, TimeLaw};
use crate::robot::RobotModel;
use crate::trajectory::plane_curve::CurveError;
use crate::trajectory::{Leg, Trajectory, TrajectorySource};

pub use profile::{MotionProfile, MotionState};

use course::Course;
use law::{Task, time_leg};
use zones::Zones;

/// How to time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RetimeOptions {
    /// Which law.
    pub law: TimeLaw,
    /// The profile's duration is a multiple of this, s.
    pub sampling_time: f64,
}

/// Why a trajectory has no profile under a law.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RetimeError {
    /// Eq. 2 as printed is no arc-length inverse, and on several segments not even a parameter.
    #[error(
        "time law `printed` needs a given path of one cubic Bezier segment: u = s/B_d has no meaning on anything else"
    )]
    PrintedNeedsOneSegment,
    /// The curve's parameter is no time.
    #[error("time law `minco` is the optimiser's own timing, and a given path has none")]
    NoOwnTiming,
    /// Eq. 5 takes off more than there is.
    #[error(
        "time law `{law}` leaves {left:.3} m/s on leg {leg}: its tightest turn has a radius of {radius:.4} m, near or below half the track \
         ({half_track:.4} m)"
    )]
    CompensationLeavesNoSpeed {
        /// Its key in the mission.
        law: &'static str,
        /// Index of the leg.
        leg: usize,
        /// Least radius on it, m.
        radius: f64,
        /// m.
        half_track: f64,
        /// v' of Eq. 5, m/s; not above zero, or as good as zero.
        left: f64,
    },
    /// A law of plane curves, on a leg of heading and arc length.
    #[error("time law `{law}` times plane curves, and leg {leg} is planned by heading and arc length")]
    NeedsFlat {
        /// Its key in the mission.
        law: &'static str,
        /// Index of the leg.
        leg: usize,
    },
    /// A law of the arc length, on a leg that goes on moving while the arc length stands.
    #[error(
        "time law `{law}` is a profile of the distance driven, and leg {leg} stands at its own {time:.2} s: it turns on the spot, changes \
         its direction, or moves joints alone"
    )]
    StandsInside {
        /// Its key in the mission.
        law: &'static str,
        /// Index of the leg.
        leg: usize,
        /// Seconds of the optimiser's own timing since the leg's start.
        time: f64,
    },
    /// The least time of a leg was not found.
    #[error("leg {leg}: no least time was found along its curve")]
    NoOptimum {
        /// Index of the leg.
        leg: usize,
    },
    /// A leg's curve has no heading somewhere.
    #[error("leg {leg}: {error}")]
    Curve {
        /// Index of the leg.
        leg: usize,
        /// What is wrong with it.
        error: CurveError,
    },
    /// The sampling time is not a positive number.
    #[error("sampling time {sampling_time} s is not a positive number")]
    SamplingTime {
        /// s.
        sampling_time: f64,
    },
    /// A leg whose joints are not the robot's.
    #[error("leg {leg} moves {found} joints, the robot has {expected}")]
    Joints {
        /// Index of the leg.
        leg: usize,
        /// In the leg.
        found: usize,
        /// In the robot.
        expected: usize,
    },
    /// There is no leg.
    #[error("the trajectory is empty")]
    Empty,
}

impl Describe for RetimeError {
    fn diagnostic(&self) -> Diagnostic {
        match self {
            Self::PrintedNeedsOneSegment => Diagnostic::error("retime/printed-needs-one-segment", self)
                .hint("use eq5: the same law with the true inverse of the arc length"),
            Self::NoOwnTiming => Diagnostic::error("retime/no-own-timing", self).hint("use auto, fixed_point or eq5"),
            Self::CompensationLeavesNoSpeed { radius, half_track, left, .. } => {
                Diagnostic::failure("retime/no-speed-left", self)
                    .hint("use auto or fixed_point")
                    .number("radius_m", *radius)
                    .number("half_track_m", *half_track)
                    .number("v_max_mps", *left)
            }
            Self::NeedsFlat { .. } => {
                Diagnostic::failure("retime/needs-flat", self).hint("use auto or optimal, or `parameterisation: flat`")
            }
            Self::StandsInside { time, .. } => Diagnostic::failure("retime/stands-inside", self)
                .hint("use auto or minco, or `parameterisation: flat`, which stops there")
                .number("time_s", *time),
            Self::NoOptimum { .. } => Diagnostic::failure("retime/no-optimum", self).hint("use auto or fixed_point"),
            Self::Curve { .. } => Diagnostic::failure("retime/curve", self),
            Self::SamplingTime { .. } => Diagnostic::error("retime/sampling-time", self),
            Self::Joints { .. } => Diagnostic::error("retime/joints", self),
            Self::Empty => Diagnostic::failure("retime/empty", self),
        }
    }
}

/// The law's key in a mission.
pub fn law_key(law: TimeLaw) -> &'static str {
    match law {
        TimeLaw::Auto => "auto",
        TimeLaw::Optimal => "optimal",
        TimeLaw::Wheel => "wheel",
        TimeLaw::FixedPoint => "fixed_point",
        TimeLaw::Eq5 => "eq5",
        TimeLaw::Printed => "printed",
        TimeLaw::Minco => "minco",
    }
}

/// Times a trajectory.
///
/// Each leg goes from rest to rest, so laws are chosen (`auto`) and slowed down leg by leg. Spins, joints alone and straight drives
/// are linear in actuator space and get the same, optimal, profile under every law. The whole lasts a multiple of the sampling time:
/// it is slowed down uniformly to the next one, never shortened.
///
/// # Errors
/// The law cannot time this path; the reason says why and which law can.
pub fn retime(
    trajectory: &Trajectory,
    robot: &RobotModel,
    options: &RetimeOptions,
) -> Result<MotionProfile, RetimeError> {
    retime_in(trajectory, robot, options, &[])
}

/// The same where the base must be slow in some places. `auto` and `optimal` slow down where it must be; other laws make the whole leg
/// slower.
///
/// # Errors
/// As [`retime`].
pub fn retime_in(
    trajectory: &Trajectory,
    robot: &RobotModel,
    options: &RetimeOptions,
    zones: &[SpeedZone],
) -> Result<MotionProfile, RetimeError> {
    let hold = options.sampling_time;
    if !(hold.is_finite() && hold > 0.0) {
        return Err(RetimeError::SamplingTime { sampling_time: hold });
    }
    let given = trajectory.source == TrajectorySource::Given;
    if options.law == TimeLaw::Minco && given {
        return Err(RetimeError::NoOwnTiming);
    }
    let one_segment = given && is_one_cubic(&trajectory.legs);
    if options.law == TimeLaw::Printed && !one_segment {
        return Err(RetimeError::PrintedNeedsOneSegment);
    }
    let own_timing = trajectory.source == TrajectorySource::Optimised;
    let legs = trajectory.legs.iter().enumerate().map(|(leg, what)| {
        let course = course(what, leg, robot)?;
        time_leg(
            &course,
            options.law,
            Task { robot, hold, own_timing, one_segment, leg, zones: Zones::new(zones, robot, hold) },
        )
    });
    let legs = legs.collect::<Result<Vec<_>, _>>()?;
    if legs.is_empty() {
        return Err(RetimeError::Empty);
    }
    Ok(MotionProfile::new(legs, options.law, hold))
}

/// What a leg (the one of this index) does.
fn course(what: &Leg, leg: usize, robot: &RobotModel) -> Result<Course, RetimeError> {
    let joints = match what {
        Leg::Drive(d) => d.curve.pieces.first().map_or(2, |p| p.coefficients.len()).saturating_sub(2),
        Leg::Still(s) => s.joints_from.len().max(s.joints_to.len()),
        Leg::Steer(s) => s.curve.pieces.first().map_or(2, |p| p.coefficients.len()).saturating_sub(2),
    };
    if joints != robot.joints.len() {
        return Err(RetimeError::Joints { leg, found: joints, expected: robot.joints.len() });
    }
    match what {
        Leg::Drive(drive) => Course::drive(drive, robot.track_width).map_err(|error| RetimeError::Curve { leg, error }),
        Leg::Still(still) => Ok(Course::still(still, robot.track_width)),
        Leg::Steer(steer) => Course::steer(steer, robot.track_width).map_err(|error| RetimeError::Curve { leg, error }),
    }
}

fn is_one_cubic(legs: &[Leg]) -> bool {
    let [Leg::Drive(drive)] = legs else { return false };
    let [piece] = drive.curve.pieces.as_slice() else { return false };
    piece.coefficients.iter().all(|c| c.len() <= 4)
}

#[cfg(test)]
mod tests;
