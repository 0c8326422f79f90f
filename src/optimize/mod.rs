//! Stage 7: MINCO (s = 4) over (x, y, joints): smooths the search's path under [SCR]'s penalties.

mod basis;
pub mod contour;
pub mod flatness;
pub mod minco;
pub mod objective;
mod options;
pub mod penalty;
#[cfg(test)]
pub(crate) mod test_robot;
pub mod time_map;

use crate::esdf::Esdf;
use crate::robot::RobotModel;
use crate::search::SearchPath;
use crate::trajectory::Trajectory;

pub use options::OptimizeOptions;

/// Smooths a path.
pub fn optimize(path: &SearchPath, esdf: &Esdf, robot: &RobotModel, options: &OptimizeOptions) -> Trajectory {
    let _ = (path, esdf, robot, options);
    todo!()
}
