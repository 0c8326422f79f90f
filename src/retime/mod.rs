//! Stage 8: when to be where on the path: time laws under wheel and joint limits.

use crate::mission::TimeLaw;
use crate::robot::RobotModel;
use crate::trajectory::Trajectory;

/// How to time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RetimeOptions {
    /// Which law.
    pub law: TimeLaw,
    /// The profile's duration is a multiple of this, s.
    pub sampling_time: f64,
}

/// The motion as functions of time. (Fields are `retime`'s own.)
#[derive(Debug, Clone)]
pub struct MotionProfile {}

/// Why a trajectory has no profile under a law.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RetimeError {}

/// Times a trajectory.
///
/// # Errors
/// The law cannot time this path; the reason says why and which law can.
pub fn retime(
    trajectory: &Trajectory,
    robot: &RobotModel,
    options: &RetimeOptions,
) -> Result<MotionProfile, RetimeError> {
    let _ = (trajectory, robot, options);
    todo!()
}
