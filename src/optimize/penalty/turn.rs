//! Turn rate and angular acceleration of the base, \[SCR\] Eq. 14 and 16, both sides each for itself.

use super::{Judge, Limits};
use crate::optimize::flatness::BaseMotion;

/// `|omega| <= 2 eta (v_max - v) / D` (Eq. 14), `|omega| <= angular_speed` where that is the tighter one at rest, and
/// `|alpha| <= alpha_max` (Eq. 16).
pub(crate) fn turning(m: &BaseMotion, limits: &Limits, judge: &mut impl Judge, by: &mut BaseMotion) -> f64 {
    let mut sum = 0.0;
    let at_rest = limits.turn_slope * limits.speed;
    let capped = limits.angular_speed < at_rest;
    for side in [1.0, -1.0] {
        let bound = limits.turn_slope * (limits.speed - m.v);
        let (cost, slope) = judge.weigh((side * m.omega - bound) / at_rest);
        sum += cost;
        by.omega += slope * side / at_rest;
        by.v += slope * limits.turn_slope / at_rest;
        if capped {
            let (cost, slope) = judge.weigh(side * m.omega / limits.angular_speed - 1.0);
            sum += cost;
            by.omega += slope * side / limits.angular_speed;
        }
        let (cost, slope) = judge.weigh(side * m.alpha / limits.angular_acceleration - 1.0);
        sum += cost;
        by.alpha += slope * side / limits.angular_acceleration;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::super::{Penalise, example_limits, speed};
    use super::*;
    use crate::math::fd::{numeric_gradient, relative_error};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn gradients_of_all_base_penalties_match_finite_differences(
            v in 0.01..0.9f64, a in -1.0..1.0f64, omega in -2.0..2.0f64, alpha in -4.0..4.0f64,
        ) {
            let limits = example_limits(0);
            let cost = |m: &BaseMotion, by: &mut BaseMotion| {
                let mut judge = Penalise(limits.width);
                turning(m, &limits, &mut judge, by)
                    + speed::speed_and_acceleration(m, &limits, &mut judge, by)
                    + speed::least_speed(m, &limits, &mut judge, by)
                    + speed::rims(m, &limits, &mut judge, by)
            };
            let unpack = |x: &[f64]| BaseMotion { v: x[0], a: x[1], omega: x[2], alpha: x[3] };
            let x = [v, a, omega, alpha];
            let mut by = BaseMotion::default();
            cost(&unpack(&x), &mut by);
            let numeric = numeric_gradient(|x| cost(&unpack(x), &mut BaseMotion::default()), &x, 1e-5);
            prop_assert!(relative_error(&[by.v, by.a, by.omega, by.alpha], &numeric, 1.0) < 1e-6);
        }
    }

    #[test]
    fn nothing_is_paid_within_the_limits() {
        let limits = example_limits(0);
        let m = BaseMotion { v: 0.2, a: 0.1, omega: 0.5, alpha: -0.7 };
        let mut by = BaseMotion::default();
        let judge = &mut Penalise(limits.width);
        assert_eq!(turning(&m, &limits, judge, &mut by) + speed::rims(&m, &limits, judge, &mut by), 0.0);
        assert_eq!(by, BaseMotion::default());
    }
}
