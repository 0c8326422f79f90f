//! What must hold along a leg, row by row.

use crate::robot::{MotionLimits, RobotModel};

/// Speed, acceleration and jerk that a row must keep; `None`: not limited.
pub type RowLimits = [Option<f64>; 3];

/// Which limits a law answers for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// Those of wheels and joints, and the centre's speed and acceleration: what \[CONV\] speaks of.
    Actuators,
    /// The base's turn rate and turn acceleration too, and \[SCR\] Eq. 14.
    Everything,
}

/// The limits of (left, right, joints…, centre) and, in the scope of everything, of the rows that [`append_turn`] adds.
pub fn limits(robot: &RobotModel, scope: Scope) -> Vec<RowLimits> {
    let of = |limits: &MotionLimits| [limits.speed, limits.acceleration, limits.jerk];
    let mut all = vec![of(&robot.wheel); 2];
    all.extend(robot.joints.iter().map(|joint| of(&joint.limits)));
    let base = &robot.base;
    all.push([Some(base.speed), Some(base.acceleration), None]);
    if scope == Scope::Everything {
        all.push([Some(base.angular_speed), Some(base.angular_acceleration), None]);
        all.push([Some(base.speed), None, None]);
    }
    all
}

/// The same, everything, for planning: defaults where wheels or joints have no limit; infinite where there is none, or where the
/// wheels' acceleration limit implies it.
pub fn planning(robot: &RobotModel) -> Vec<[f64; 3]> {
    let mut all = vec![robot.wheel.planning(); 2];
    all.extend(robot.joints.iter().map(|joint| joint.limits.planning()));
    let base = &robot.base;
    let [_, wheel, _] = robot.wheel.planning();
    let unless_implied = |limit: f64, implied: f64| if limit < implied * (1.0 - 1e-12) { limit } else { f64::INFINITY };
    let turn = unless_implied(base.angular_acceleration, 2.0 * wheel / robot.track_width);
    all.push([base.speed, unless_implied(base.acceleration, wheel), f64::INFINITY]);
    all.push([base.angular_speed, turn, f64::INFINITY]);
    all.push([base.speed, f64::INFINITY, f64::INFINITY]);
    all
}

/// Appends to the rates of (left, right, joints…, centre), which begin at `first`, those of the heading and, as a speed, what \[SCR\]
/// Eq. 14 limits: `|v| + D/(2 eta) |omega| <= v_max`.
pub fn append_turn(robot: &RobotModel, first: usize, rates: &mut Vec<[f64; 3]>) {
    let (left, right, centre) = (rates[first], rates[first + 1], rates[rates.len() - 1]);
    let turn = [0, 1, 2].map(|k| (right[k] - left[k]) / robot.track_width);
    rates.push(turn);
    rates.push([centre[0].abs() + 0.5 * robot.track_width / robot.base.eta * turn[0].abs(), 0.0, 0.0]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory::fixtures;

    #[test]
    fn with_default_limits_the_wheels_imply_the_bases() {
        let robot = fixtures::conv();
        let rows = planning(&robot);
        assert_eq!(rows[2], [0.5, f64::INFINITY, f64::INFINITY]);
        assert_eq!(rows[3], [2.5, f64::INFINITY, f64::INFINITY]);
        // The wheels at their limit, forward and against each other: no row beyond its own.
        for [left, right] in [[0.5, 0.5], [0.5, 0.2], [0.5, -0.5]] {
            let centre: f64 = 0.5 * (left + right);
            let mut rates = vec![[left, 0.0, 0.0], [right, 0.0, 0.0], [centre, 0.0, 0.0]];
            append_turn(&robot, 0, &mut rates);
            assert!(rates.iter().zip(&rows).all(|(rates, limits)| rates[0].abs() <= limits[0] * (1.0 + 1e-15)));
        }
    }

    #[test]
    fn equation_fourteen_is_tighter_for_a_smaller_eta() {
        let mut robot = fixtures::conv();
        robot.base.eta = 0.4;
        let mut rates = vec![[0.3, 0.0, 0.0], [0.4, 0.0, 0.0], [0.35, 0.0, 0.0]];
        append_turn(&robot, 0, &mut rates);
        let (v, omega) = (0.35, 0.25);
        // omega <= 2 eta (v_max - v) / D  is the same as  row <= v_max.
        assert_eq!(omega <= 2.0 * 0.4 * (0.5 - v) / 0.4, rates[4][0] <= 0.5);
        assert!((rates[4][0] - (0.35 + 0.4 / 0.8 * 0.25)).abs() < 1e-15);
    }

    #[test]
    fn what_the_wheels_do_not_imply_of_the_bases_limits_is_planned_with() {
        let mut robot = fixtures::conv();
        // Wheels of 0.2 m/s^2, 0.4 m apart, turn the base at up to 1 rad/s^2.
        for (angular, planned) in [(0.99, 0.99), (0.5, 0.5), (1.01, f64::INFINITY)] {
            robot.base.angular_acceleration = angular;
            assert_eq!(planning(&robot)[3][1], planned);
        }
        for (along, planned) in [(0.19, 0.19), (0.21, f64::INFINITY)] {
            robot.base.acceleration = along;
            assert_eq!(planning(&robot)[2][1], planned);
        }
    }
}
