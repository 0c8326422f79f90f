//! Stage 7: MINCO (s = 4) over (x, y, joints): smooths the search's path under [SCR]'s penalties.

use crate::esdf::Esdf;
use crate::robot::RobotModel;
use crate::search::SearchPath;
use crate::trajectory::Trajectory;

/// How to optimise.
#[derive(Debug, Clone, PartialEq)]
pub struct OptimizeOptions {
    /// Clearance to aim at, m: what must be certified plus a margin for what sampling misses.
    pub clearance: f64,
    /// Dense sampling on ([SCR] section IV-C).
    pub dense: bool,
}

/// Smooths a path.
pub fn optimize(path: &SearchPath, esdf: &Esdf, robot: &RobotModel, options: &OptimizeOptions) -> Trajectory {
    let _ = (path, esdf, robot, options);
    todo!()
}
