//! Stage 6: a drivable path on a lattice over (x, y, yaw, posture).

use crate::geom::Pose2;

/// A path on the lattice, joined to the exact start and goal. Between consecutive states the motion is linear in joint
/// space: a spin or a straight drive, joints in proportion.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchPath {
    /// States, start first. Headings are not wrapped: consecutive ones differ by the turn between them.
    pub states: Vec<SearchState>,
    /// `moves[i]` leads from `states[i]` to `states[i + 1]`.
    pub moves: Vec<SearchMove>,
    /// States expanded.
    pub expanded: usize,
}

/// A state on the path.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchState {
    /// Map frame.
    pub pose: Pose2,
    /// One value per moving joint.
    pub joints: Vec<f64>,
}

/// How one state leads to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SearchMove {
    /// The base turns on the spot, or stands while joints move.
    Still,
    /// Straight along the heading.
    Forward,
    /// Straight against the heading.
    Reverse,
}

impl SearchPath {
    /// Distance driven, m.
    pub fn length(&self) -> f64 {
        self.states.windows(2).map(|w| w[0].pose.distance(w[1].pose)).sum()
    }
}
