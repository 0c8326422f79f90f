//! robot.yaml: what the URDF cannot say, as written. Read by [`parse`]; given its meaning by the rest of `robot`.

use std::path::PathBuf;

use crate::diag::{Diagnostics, Span};
use crate::mission::LimitsSpec;

/// A value and where it is written.
#[derive(Debug, Clone, PartialEq)]
pub struct Written<T> {
    /// The value.
    pub value: T,
    /// Where; `None` where it does not come from a text.
    pub span: Option<Span>,
}

/// robot.yaml. Lengths in m, angles in rad; `None` or empty: not given.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RobotSpec {
    /// Default: the URDF's robot name.
    pub name: Option<String>,
    /// Relative to robot.yaml's folder.
    pub urdf: Option<Written<PathBuf>>,
    /// Joints of the left driving wheels, one or several.
    pub drive_left: Vec<Written<String>>,
    /// Joints of the right driving wheels.
    pub drive_right: Vec<Written<String>>,
    /// `drive.wheel_radius_m`.
    pub wheel_radius: Option<Written<f64>>,
    /// `drive.track_width_m`.
    pub track_width: Option<Written<f64>>,
    /// `joints.moving`; `Some(empty)`: none moves.
    pub moving: Option<Vec<Written<String>>>,
    /// `joints.fixed`: name and value.
    pub fixed: Vec<(Written<String>, f64)>,
    /// `limits`.
    pub limits: LimitsSpec,
    /// Where each joint under `limits.joints` is named.
    pub limit_joints: Vec<Written<String>>,
    /// `collision.ignore_links`.
    pub ignore_links: Vec<Written<String>>,
    /// `collision.ignore_pairs`.
    pub ignore_pairs: Vec<[Written<String>; 2]>,
}

/// Reads robot.yaml; `name` is its path as the user knows it.
///
/// # Errors
/// All faults found: syntax, unknown keys with the nearest known one, wrong types, numbers that are not finite or not > 0.
pub fn parse(name: &str, text: &str) -> Result<RobotSpec, Diagnostics> {
    let _ = (name, text);
    todo!()
}
