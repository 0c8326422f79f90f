//! How tightly a motion turns.

use crate::command::CommandTable;
use crate::robot::BaseLimits;

/// A turn on a smaller radius is one on the spot, m.
const ON_THE_SPOT: f64 = 1e-3;
/// A stretch counts once the heading has turned so far in it, rad: 10 degrees. What one held command does where a turn on the spot
/// goes over into a drive is no turn.
const TURNED: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// Turns of a motion, from the replay of its held commands.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Turns {
    /// Turns on the spot of 10 degrees and more.
    pub on_the_spot: usize,
    /// Least radius of a turn while driving, m: distance driven by angle turned over any stretch that turns through 10 degrees to
    /// one side and holds no turn on the spot. `None`: there is no such turn.
    pub least_driven_m: Option<f64>,
    /// Where that is, m, map frame, and when, s.
    #[serde(skip)]
    pub tightest: Option<([f64; 2], f64)>,
}

impl Turns {
    /// Of these commands.
    pub fn of(table: &CommandTable) -> Self {
        let dt = table.sampling_time;
        let held: Vec<(f64, f64)> =
            (0..table.rows.len()).map(|k| table.twist(k)).map(|(v, w)| (v * dt, w * dt)).collect();
        let spins = |(travel, turn): (f64, f64)| turn.abs() > 1e-6 && travel.abs() < ON_THE_SPOT * turn.abs();
        let mut on_the_spot = 0;
        for run in held.split(|row| !spins(*row)) {
            on_the_spot += usize::from(run.iter().map(|r| r.1).sum::<f64>().abs() >= TURNED);
        }
        let poses = table.replay(table.rows.first().map(|r| r.pose).unwrap_or_default());
        let mut least: Option<(f64, usize)> = None;
        for first in 0..held.len() {
            let (mut travel, mut turned) = (0.0, 0.0f64);
            for (k, row) in held.iter().enumerate().skip(first) {
                if spins(*row) || row.1 * turned < 0.0 {
                    break;
                }
                travel += row.0.abs();
                turned += row.1;
                if turned.abs() >= TURNED {
                    let radius = travel / turned.abs();
                    if least.is_none_or(|(known, _)| radius < known) {
                        least = Some((radius, (first + k) / 2));
                    }
                    break;
                }
            }
        }
        Self {
            on_the_spot,
            least_driven_m: least.map(|(radius, _)| radius),
            tightest: least.map(|(_, k)| ([poses[k].x, poses[k].y], table.time(k))),
        }
    }
}

/// The least radius that \[SCR\] Eq. 14 and 17 leave a smooth curve, m: `v_min` at the turn rate allowed there.
pub fn least_radius(base: &BaseLimits, track_width: f64) -> f64 {
    base.min_speed * track_width / (2.0 * base.eta * (base.speed - base.min_speed))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::CommandRow;
    use crate::geom::Pose2;
    use crate::mission::Sampling;

    fn table(twists: &[(f64, f64)]) -> CommandTable {
        let row = |(v, w): &(f64, f64)| CommandRow {
            wheel_left: (v - 0.16 * w) / 0.08,
            wheel_right: (v + 0.16 * w) / 0.08,
            joint_positions: vec![],
            joint_velocities: vec![],
            pose: Pose2::default(),
        };
        CommandTable {
            sampling_time: 0.1,
            sampling: Sampling::Mean,
            wheel_radii: 0.08.into(),
            track_width: 0.32,
            joints: vec![],
            rows: twists.iter().map(row).collect(),
        }
    }

    #[test]
    fn a_turn_on_the_spot_is_none_while_driving() {
        let mut twists = vec![(0.0, 1.0); 5];
        twists.extend([(0.2, 0.0), (0.2, 0.0), (0.3, 1.5), (0.3, 1.5), (0.3, 1.5), (0.2, 0.0), (0.0, 0.0)]);
        let turns = Turns::of(&table(&twists));
        assert_eq!(turns.on_the_spot, 1);
        assert!((turns.least_driven_m.expect("a turn") - 0.2).abs() < 1e-9, "{turns:?}");
        let (_, time) = turns.tightest.expect("a turn");
        assert!((0.7..=0.9).contains(&time));
    }

    #[test]
    fn wiggles_and_turns_of_less_than_ten_degrees_do_not_count() {
        let turns = Turns::of(&table(&[(0.01, 1.0), (0.01, -1.0), (0.01, 1.0), (0.01, -1.0), (0.0, 1.0), (0.3, 0.0)]));
        assert_eq!((turns.on_the_spot, turns.least_driven_m), (0, None));
    }

    #[test]
    fn the_papers_least_radius_needs_its_eta() {
        let base = |speed: f64, eta: f64| BaseLimits {
            speed,
            acceleration: 1.0,
            angular_speed: 3.0,
            angular_acceleration: 2.5,
            eta,
            min_speed: 0.01,
        };
        assert!(least_radius(&base(0.5, 0.1), 0.32) > 0.0326 && least_radius(&base(0.5, 0.4), 0.32) < 9.3e-3);
        assert!((least_radius(&base(1.0, 0.4), 0.32) - 4.04e-3).abs() < 1e-5);
    }
}
