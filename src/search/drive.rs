//! The search's path as a motion of its own: stop, spin, go. Slow, but it goes exactly where the search looked.

use super::{SearchMove, SearchPath, SearchState};
use crate::math::poly::{Piece, PiecewisePoly};
use crate::math::real;
use crate::trajectory::{DriveLeg, Leg, StillLeg, Trajectory, TrajectorySource};

impl SearchPath {
    /// The path from rest to rest at every corner. Joints move within each move by a smooth step with three derivatives
    /// that vanish at its ends, so a straight drive needs no stop where only the joints' motion changes.
    pub fn trajectory(&self) -> Trajectory {
        let mut legs: Vec<Leg> = Vec::new();
        let mut drive: Option<DriveLeg> = None;
        for (k, kind) in self.moves.iter().enumerate() {
            let (from, to) = (&self.states[k], &self.states[k + 1]);
            let reverse = match kind {
                SearchMove::Still => {
                    legs.extend(drive.take().map(Leg::Drive));
                    legs.push(Leg::Still(StillLeg {
                        pose: from.pose,
                        yaw_end: to.pose.yaw,
                        joints_from: from.joints.clone(),
                        joints_to: to.joints.clone(),
                    }));
                    continue;
                }
                SearchMove::Forward => false,
                SearchMove::Reverse => true,
            };
            match &mut drive {
                Some(leg) if leg.reverse == reverse && leg.yaw_start == from.pose.yaw => {
                    leg.curve.pieces.push(straight(from, to))
                }
                _ => {
                    legs.extend(drive.take().map(Leg::Drive));
                    let curve = PiecewisePoly { pieces: vec![straight(from, to)] };
                    drive = Some(DriveLeg { curve, reverse, yaw_start: from.pose.yaw });
                }
            }
        }
        legs.extend(drive.map(Leg::Drive));
        Trajectory { legs, source: TrajectorySource::Search, optimiser: None }
    }
}

/// A straight piece; the parameter is the distance driven.
fn straight(from: &SearchState, to: &SearchState) -> Piece {
    let length = from.pose.distance(to.pose);
    let linear = |a: f64, b: f64| vec![a, (b - a) / length];
    let mut coefficients = vec![linear(from.pose.x, to.pose.x), linear(from.pose.y, to.pose.y)];
    for (a, b) in from.joints.iter().zip(&to.joints) {
        // a + (b - a)(35 u^4 - 84 u^5 + 70 u^6 - 20 u^7), u = s / length.
        let mut joint = vec![*a];
        if a != b {
            joint.extend([0.0; 3]);
            joint.extend(
                [(35.0, 4), (-84.0, 5), (70.0, 6), (-20.0, 7)].map(|(c, k)| (b - a) * c / real::powi(length, k)),
            );
        }
        coefficients.push(joint);
    }
    Piece { duration: length, coefficients }
}
