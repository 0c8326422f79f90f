//! Smooth versions of `max(x, 0)` and of the unit step. Each returns the value and its derivative.

/// One-sided penalty `L_1` of \[SCR\] section IV-B: 0 for `x <= 0`, `x - a0/2` for `x >= a0`, a quartic between; `a0 > 0`.
/// Twice continuously differentiable and convex.
///
/// # Deviation
/// The paper prints no formula; this is `x^3/a0^2 - x^4/(2 a0^3)` between.
pub fn smooth_positive(x: f64, a0: f64) -> (f64, f64) {
    debug_assert!(a0 > 0.0);
    if x <= 0.0 {
        (0.0, 0.0)
    } else if x < a0 {
        let r = x / a0;
        let r2 = r * r;
        (a0 * r2 * r * (1.0 - 0.5 * r), r2 * (3.0 - 2.0 * r))
    } else {
        (x - 0.5 * a0, 1.0)
    }
}

/// Switch from 0 to 1 that turns dense sampling on, `L_a` of \[SCR\] Eq. 10; blends over `[-eps, eps]`, `eps > 0`.
/// Twice continuously differentiable.
pub fn smooth_switch(x: f64, eps: f64) -> (f64, f64) {
    debug_assert!(eps > 0.0);
    if x.abs() >= eps {
        return (if x > 0.0 { 1.0 } else { 0.0 }, 0.0);
    }
    // Eq. 10 is odd about (0, 1/2), so one tail serves both branches.
    let r = x.abs() / eps;
    let rest = 1.0 - r;
    let tail = 0.5 * rest * rest * rest * (1.0 + r);
    let slope = rest * rest * (1.0 + 2.0 * r) / eps;
    (if x > 0.0 { 1.0 - tail } else { tail }, slope)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::real;

    fn check(f: impl Fn(f64) -> (f64, f64), at: &[f64]) {
        for &x in at {
            let numeric = crate::math::fd::numeric_gradient(|x| f(x[0]).0, &[x], 1e-3)[0];
            assert!((f(x).1 - numeric).abs() < 2e-5, "x = {x}: {} vs {numeric}", f(x).1);
        }
    }

    #[test]
    fn slopes_match_values() {
        check(|x| smooth_positive(x, 0.3), &[-0.5, -1e-3, 0.0, 0.05, 0.15, 0.29, 0.3, 0.31, 2.0]);
        check(|x| smooth_switch(x, 0.8), &[-0.9, -0.8, -0.31, -1e-3, 0.0, 0.2, 0.77, 0.8, 1.2]);
    }

    #[test]
    fn slope_and_second_derivative_are_continuous_at_the_joints() {
        let curvature = |f: &dyn Fn(f64) -> (f64, f64), x: f64| (f(x + 1e-6).1 - f(x - 1e-6).1) / 2e-6;
        for (f, joints) in [
            (&(|x| smooth_positive(x, 0.3)) as &dyn Fn(f64) -> (f64, f64), [0.0, 0.3, 0.3]),
            (&|x| smooth_switch(x, 0.8), [-0.8, 0.0, 0.8]),
        ] {
            for joint in joints {
                assert!((curvature(f, joint - 1e-4) - curvature(f, joint + 1e-4)).abs() < 2e-2);
                assert!((f(joint - 1e-9).0 - f(joint + 1e-9).0).abs() < 1e-8);
            }
        }
    }

    #[test]
    fn values_are_those_of_the_paper() {
        assert_eq!(smooth_switch(-2.0, 1.0).0, 0.0);
        assert_eq!(smooth_switch(2.0, 1.0).0, 1.0);
        assert_eq!(smooth_switch(0.0, 1.0).0, 0.5);
        let (x, e) = (-0.4f64, 0.7f64);
        assert!((smooth_switch(x, e).0 - real::powi(x + e, 3) * (e - x) / (2.0 * real::powi(e, 4))).abs() < 1e-15);
        assert!((smooth_positive(0.5, 0.1).0 - 0.45).abs() < 1e-15);
    }
}
