//! How far a motion's angular acceleration exceeds its limit: Table II.

use crate::command::CommandTable;
use crate::optimize::flatness::base_motion;
use crate::trajectory::{Leg, Trajectory};

/// Against the limit of angular acceleration.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct AlphaExcess {
    /// Greatest |alpha| over the limit; 1 is at the limit.
    pub peak: f64,
    /// Share of the time for which |alpha| is above the limit, 0 to 1.
    pub share: f64,
}

/// Rounding may lift a value that stands at its limit.
const ROUNDING: f64 = 1.0 + 1e-9;

/// Samples a piece, at the middles of equal intervals and at its ends.
const SAMPLES: usize = 200;

impl AlphaExcess {
    /// Of the held commands: differences of the turn rate over the sampling time, at rest before and after.
    pub fn of_commands(table: &CommandTable, limit: f64) -> Self {
        let rates: Vec<f64> = (0..table.rows.len()).map(|k| table.twist(k).1).collect();
        let before = std::iter::once(&0.0).chain(&rates);
        let after = rates.iter().chain(std::iter::once(&0.0));
        let ratios: Vec<f64> = before.zip(after).map(|(a, b)| (b - a).abs() / (table.sampling_time * limit)).collect();
        let above = ratios.iter().filter(|r| **r > ROUNDING).count();
        Self { peak: ratios.iter().copied().fold(0.0, f64::max), share: above as f64 / ratios.len().max(1) as f64 }
    }

    /// Of a trajectory in the optimiser's own timing, which lasts `time` seconds, spins included; spins are timed within the
    /// limit.
    pub fn of_trajectory(trajectory: &Trajectory, limit: f64, time: f64) -> Self {
        let (mut peak, mut above) = (0.0f64, 0.0);
        for leg in &trajectory.legs {
            let pieces = match leg {
                Leg::Drive(drive) => &drive.curve.pieces,
                Leg::Steer(steer) => &steer.curve.pieces,
                Leg::Still(_) => continue,
            };
            for piece in pieces {
                let ratio = |u: f64| {
                    if let Leg::Steer(_) = leg {
                        return piece.derivative(0, 2, u).abs() / limit;
                    }
                    let of = |order| [piece.derivative(0, order, u), piece.derivative(1, order, u)];
                    base_motion(of(1), of(2), of(3)).alpha.abs() / limit
                };
                let width = piece.duration / SAMPLES as f64;
                for k in 0..SAMPLES {
                    let at = ratio((k as f64 + 0.5) * width);
                    peak = peak.max(at);
                    above += if at > ROUNDING { width } else { 0.0 };
                }
                peak = peak.max(ratio(0.0)).max(ratio(piece.duration));
            }
        }
        Self { peak, share: if time > 0.0 { above / time } else { 0.0 } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::CommandRow;
    use crate::geom::Pose2;
    use crate::math::poly::{Piece, PiecewisePoly};
    use crate::mission::Sampling;
    use crate::trajectory::{DriveLeg, SteerLeg, TrajectorySource};

    #[test]
    fn held_turn_rates_count_their_steps_from_and_to_rest() {
        // Turn rates 0.1, 0.3, 0 at 0.1 s: steps of 1, 2, -3 and 0 rad/s^2.
        let row = |omega: f64| CommandRow {
            wheel_left: -omega * 0.16 / 0.08,
            wheel_right: omega * 0.16 / 0.08,
            joint_positions: vec![],
            joint_velocities: vec![],
            pose: Pose2::default(),
        };
        let table = CommandTable {
            sampling_time: 0.1,
            sampling: Sampling::Mean,
            wheel_radii: 0.08.into(),
            track_width: 0.32,
            joints: vec![],
            rows: [0.1, 0.3, 0.0].map(row).into(),
        };
        let excess = AlphaExcess::of_commands(&table, 2.0);
        assert!((excess.peak - 1.5).abs() < 1e-9);
        assert_eq!(excess.share, 0.25, "only the step of 3; the one of 2 stands at the limit");
    }

    #[test]
    fn a_curve_counts_the_time_above_the_limit() {
        // x = t, y = k t^3 / 6 for small k: omega = y'' = k t, alpha about k (exact where t = 0).
        let piece = |k: f64| Piece { duration: 1.0, coefficients: vec![vec![0.0, 1.0], vec![0.0, 0.0, 0.0, k / 6.0]] };
        let curve = PiecewisePoly { pieces: vec![piece(1e-3), piece(3e-3)] };
        let leg = Leg::Drive(DriveLeg { curve, reverse: false, yaw_start: 0.0 });
        let trajectory = Trajectory { legs: vec![leg], source: TrajectorySource::Optimised, optimiser: None };
        let excess = AlphaExcess::of_trajectory(&trajectory, 2e-3, 4.0);
        assert!((excess.peak - 1.5).abs() < 1e-4 && (excess.share - 0.25).abs() < 1e-9, "{excess:?}");
    }

    #[test]
    fn a_leg_of_heading_and_arc_length_counts_the_second_derivative_of_its_heading() {
        // Heading t^3/6 a second long: alpha = t, in a spin as in a drive.
        let piece = |s: f64| Piece { duration: 1.0, coefficients: vec![vec![0.0, 0.0, 0.0, 1.0 / 6.0], vec![0.0, s]] };
        let curve = PiecewisePoly { pieces: vec![piece(0.0), piece(-0.5)] };
        let leg = Leg::Steer(SteerLeg { pose: Pose2::default(), curve });
        let trajectory = Trajectory { legs: vec![leg], source: TrajectorySource::Optimised, optimiser: None };
        let excess = AlphaExcess::of_trajectory(&trajectory, 0.8, 2.0);
        assert!((excess.peak - 1.25).abs() < 1e-12 && (excess.share - 0.2).abs() < 1e-9, "{excess:?}");
    }
}
