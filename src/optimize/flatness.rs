//! From the flat output to the base's speeds and accelerations, \[SCR\] Eq. 3, forwards and backwards.

use crate::math::real;

/// Speeds below this are treated as this, m/s: the flat output has no heading at rest.
const SPEED_FLOOR: f64 = 1e-6;

/// Scalars of the base at an instant. As gradients: derivatives of a cost by each of them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BaseMotion {
    /// Speed along the path, m/s, never negative.
    pub v: f64,
    /// Acceleration along the path, m/s^2.
    pub a: f64,
    /// Turn rate, rad/s; the same forwards and backwards.
    pub omega: f64,
    /// Angular acceleration, rad/s^2.
    pub alpha: f64,
}

/// Speed, acceleration, turn rate and angular acceleration from the first three derivatives of (x, y).
///
/// # Deviation
/// The last factor of Eq. 3d and Eq. 16 is misprinted; `x'x'' + y'y''` is used, which is the derivative of Eq. 3c.
pub fn base_motion(d1: [f64; 2], d2: [f64; 2], d3: [f64; 2]) -> BaseMotion {
    let v = real::hypot(d1[0], d1[1]).max(SPEED_FLOOR);
    let v2 = v * v;
    let a = (d1[0] * d2[0] + d1[1] * d2[1]) / v;
    let omega = (d1[0] * d2[1] - d1[1] * d2[0]) / v2;
    let alpha = (d1[0] * d3[1] - d1[1] * d3[0]) / v2 - 2.0 * omega * a / v;
    BaseMotion { v, a, omega, alpha }
}

/// Chain rule back to the derivatives of (x, y): `by` holds d(cost)/d(v, a, omega, alpha) at `motion`, which
/// [`base_motion`] made from the same `d1, d2, d3`. Returns d(cost)/d(d1, d2, d3).
pub fn pull_back(
    motion: &BaseMotion,
    by: &BaseMotion,
    d1: [f64; 2],
    d2: [f64; 2],
    d3: [f64; 2],
) -> ([f64; 2], [f64; 2], [f64; 2]) {
    let BaseMotion { v, a, omega, .. } = *motion;
    let (w, w2) = (1.0 / v, 1.0 / (v * v));
    let cross3 = (d1[0] * d3[1] - d1[1] * d3[0]) * w2;
    // alpha = cross3 - 2 omega a / v: fold its share into omega and a first.
    let by_omega = by.omega - 2.0 * a * w * by.alpha;
    let by_a = by.a - 2.0 * omega * w * by.alpha;
    // Everything that multiplies d1: from v itself, and from the powers of 1/v.
    let along =
        w * by.v - w2 * (a * by_a + 2.0 * omega * by_omega) + by.alpha * w2 * (2.0 * omega * a * w - 2.0 * cross3);
    let (by_a, by_omega, by_cross3) = (by_a * w, by_omega * w2, by.alpha * w2);
    (
        [
            along * d1[0] + by_a * d2[0] + by_omega * d2[1] + by_cross3 * d3[1],
            along * d1[1] + by_a * d2[1] - by_omega * d2[0] - by_cross3 * d3[0],
        ],
        [by_a * d1[0] - by_omega * d1[1], by_a * d1[1] + by_omega * d1[0]],
        [-by_cross3 * d1[1], by_cross3 * d1[0]],
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::fd::{numeric_gradient, relative_error};
    use proptest::prelude::*;

    #[test]
    fn a_circle_has_its_turn_rate_and_no_accelerations() {
        // (cos wt, sin wt) r at t = 0.3.
        let (r, w, t) = (0.7f64, 1.3f64, 0.3f64);
        let (s, c) = real::sin_cos(w * t);
        let m = base_motion(
            [-r * w * s, r * w * c],
            [-r * w * w * c, -r * w * w * s],
            [r * real::powi(w, 3) * s, -r * real::powi(w, 3) * c],
        );
        assert!((m.v - r * w).abs() < 1e-12 && (m.omega - w).abs() < 1e-12);
        assert!(m.a.abs() < 1e-12 && m.alpha.abs() < 1e-12);
    }

    #[test]
    fn alpha_is_the_time_derivative_of_omega_and_a_that_of_v() {
        // x = t + t^3/3, y = t^2/2 - t^3/5 at t.
        let at = |t: f64| base_motion([1.0 + t * t, t - 0.6 * t * t], [2.0 * t, 1.0 - 1.2 * t], [2.0, -1.2]);
        for t in [0.1, 0.4, 0.9] {
            let numeric = |f: fn(&BaseMotion) -> f64| numeric_gradient(|t| f(&at(t[0])), &[t], 1e-2)[0];
            assert!((at(t).alpha - numeric(|m| m.omega)).abs() < 1e-8);
            assert!((at(t).a - numeric(|m| m.v)).abs() < 1e-8);
        }
    }

    proptest! {
        #[test]
        fn gradients_match_finite_differences(x in proptest::array::uniform6(-1.0..1.0f64), by in proptest::array::uniform4(-1.0..1.0f64)) {
            prop_assume!(real::hypot(x[0], x[1]) > 0.2);
            let by = BaseMotion { v: by[0], a: by[1], omega: by[2], alpha: by[3] };
            let split = |x: &[f64]| ([x[0], x[1]], [x[2], x[3]], [x[4], x[5]]);
            let f = |x: &[f64]| {
                let (d1, d2, d3) = split(x);
                let m = base_motion(d1, d2, d3);
                m.v * by.v + m.a * by.a + m.omega * by.omega + m.alpha * by.alpha
            };
            let (d1, d2, d3) = split(&x);
            let (g1, g2, g3) = pull_back(&base_motion(d1, d2, d3), &by, d1, d2, d3);
            let g = [g1[0], g1[1], g2[0], g2[1], g3[0], g3[1]];
            prop_assert!(relative_error(&g, &numeric_gradient(f, &x, 1e-3), 1e-3) < 1e-7);
        }
    }
}
