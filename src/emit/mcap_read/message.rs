//! What is read of a message of each type.

use crate::emit::cdr::{CdrError, Reader};
use crate::math::real;

/// Values of a rotation may be off a unit quaternion about z by this.
const ROTATION: f64 = 1e-9;

/// Why a message is not what it must be.
pub enum MessageError {
    /// Not of its type.
    Cdr(CdrError),
    /// Of its type, but not what a command file has.
    Content(&'static str),
}

impl From<CdrError> for MessageError {
    fn from(error: CdrError) -> Self {
        Self::Cdr(error)
    }
}

/// Names, positions and velocities, as many of each.
pub struct JointState {
    pub names: Vec<String>,
    pub positions: Vec<f64>,
    pub velocities: Vec<f64>,
}

/// Skips a `std_msgs/Header`.
pub fn skip_header(r: &mut Reader<'_>) -> Result<(), CdrError> {
    r.i32()?;
    r.u32()?;
    r.string().map(|_| ())
}

fn f64_array<const N: usize>(r: &mut Reader<'_>) -> Result<[f64; N], CdrError> {
    let mut values = [0.0; N];
    for value in &mut values {
        *value = r.f64()?;
    }
    Ok(values)
}

fn all_finite(values: &[f64]) -> Result<(), MessageError> {
    if values.iter().all(|v| v.is_finite()) { Ok(()) } else { Err(MessageError::Content("a number is not finite")) }
}

pub fn joint_names(r: &mut Reader<'_>) -> Result<Vec<String>, CdrError> {
    r.sequence(|r| r.string().map(str::to_string))
}

/// Speeds along x, y, z and turn rates about them.
pub fn twist(r: &mut Reader<'_>) -> Result<[f64; 6], MessageError> {
    skip_header(r)?;
    let values = f64_array(r)?;
    all_finite(&values)?;
    Ok(values)
}

/// Left, right.
pub fn wheel_speeds(r: &mut Reader<'_>) -> Result<[f64; 2], MessageError> {
    let dimensions = r.u32()?;
    let offset = r.u32()?;
    if dimensions != 0 || offset != 0 {
        return Err(MessageError::Content("the layout is not empty"));
    }
    let data = r.f64s()?;
    all_finite(&data)?;
    data.try_into().map_err(|_| MessageError::Content("must have two wheel speeds: left, right"))
}

pub fn joint_state(r: &mut Reader<'_>) -> Result<JointState, MessageError> {
    skip_header(r)?;
    let state = JointState { names: joint_names(r)?, positions: r.f64s()?, velocities: r.f64s()? };
    r.f64s()?;
    all_finite(&state.positions)?;
    all_finite(&state.velocities)?;
    if state.positions.len() != state.names.len() || state.velocities.len() != state.names.len() {
        return Err(MessageError::Content("names, positions and velocities differ in number"));
    }
    Ok(state)
}

/// x, y and heading of the first transform.
pub fn pose(r: &mut Reader<'_>) -> Result<[f64; 3], MessageError> {
    let transforms = r.sequence(|r| {
        skip_header(r)?;
        r.string()?;
        f64_array::<7>(r)
    })?;
    let [x, y, _, i, j, k, w] = *transforms.first().ok_or(MessageError::Content("no transform"))?;
    all_finite(&[x, y, i, j, k, w])?;
    if real::hypot(i, j) > ROTATION || (real::hypot(k, w) - 1.0).abs() > ROTATION {
        return Err(MessageError::Content("the rotation is no unit quaternion about z"));
    }
    Ok([x, y, 2.0 * real::atan2(k, w)])
}
