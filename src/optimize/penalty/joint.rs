//! Joint speed, acceleration (\[SCR\] Eq. 18, 19) and position (URDF `<limit>`; the paper is silent).

use super::{JointLimits, Judge};

/// Cost of one joint at position `q`, speed `d1`, acceleration `d2`, and its derivatives by the three.
pub(crate) fn joint(q: f64, d1: f64, d2: f64, limits: &JointLimits, judge: &mut impl Judge) -> (f64, [f64; 3]) {
    let scale = 1.0 / (limits.speed * limits.speed);
    let (speed, slope) = judge.weigh(d1 * d1 * scale - 1.0);
    let by_d1 = slope * 2.0 * d1 * scale;
    let scale = 1.0 / (limits.acceleration * limits.acceleration);
    let (acceleration, slope) = judge.weigh(d2 * d2 * scale - 1.0);
    let by_d2 = slope * 2.0 * d2 * scale;
    // Positions have no natural size; half the range is it, as a limit's distance from the middle. Unbounded: none.
    let (mut position, mut by_q) = (0.0, 0.0);
    let half_range = 0.5 * (limits.upper - limits.lower);
    let size = if half_range.is_finite() && half_range > 1e-6 { half_range } else { 1.0 };
    if limits.upper.is_finite() {
        let (cost, slope) = judge.weigh((q - limits.upper) / size);
        position += cost;
        by_q += slope / size;
    }
    if limits.lower.is_finite() {
        let (cost, slope) = judge.weigh((limits.lower - q) / size);
        position += cost;
        by_q -= slope / size;
    }
    (speed + acceleration + position, [by_q, by_d1, by_d2])
}

#[cfg(test)]
mod tests {
    use super::super::{Penalise, example_limits};
    use super::*;
    use crate::math::fd::{numeric_gradient, relative_error};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn gradients_match_finite_differences(x in proptest::array::uniform3(-2.0..2.0f64)) {
            let limits = example_limits(1).joints[0];
            let (_, g) = joint(x[0], x[1], x[2], &limits, &mut Penalise(0.2));
            let numeric = numeric_gradient(|x| joint(x[0], x[1], x[2], &limits, &mut Penalise(0.2)).0, &x, 1e-5);
            prop_assert!(relative_error(&g, &numeric, 1.0) < 1e-6);
        }
    }

    #[test]
    fn a_continuous_joint_has_no_position_limit() {
        let limits = JointLimits { lower: f64::NEG_INFINITY, upper: f64::INFINITY, speed: 1.0, acceleration: 1.0 };
        assert_eq!(joint(1e6, 0.0, 0.0, &limits, &mut Penalise(0.1)), (0.0, [0.0; 3]));
    }
}
