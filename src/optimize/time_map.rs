//! Durations without a sign constraint: `T(tau)` of \[SCR\] section IV-B, twice continuously differentiable.

/// Duration (> 0) and its derivative for any real `tau`: `tau^2/2 + tau + 1` above 0, `1/(tau^2/2 - tau + 1)` below.
pub fn duration(tau: f64) -> (f64, f64) {
    if tau > 0.0 {
        ((0.5 * tau + 1.0) * tau + 1.0, tau + 1.0)
    } else {
        let t = 1.0 / ((0.5 * tau - 1.0) * tau + 1.0);
        (t, (1.0 - tau) * t * t)
    }
}

/// The `tau` of a duration `> 0`: inverse of [`duration`].
pub fn virtual_time(duration: f64) -> f64 {
    debug_assert!(duration > 0.0);
    if duration > 1.0 { (2.0 * duration - 1.0).sqrt() - 1.0 } else { 1.0 - (2.0 / duration - 1.0).sqrt() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_inverse_undoes_it_and_the_slope_matches() {
        for t in [1e-3, 0.05, 0.7, 1.0, 1.5, 12.0, 300.0] {
            let (back, slope) = duration(virtual_time(t));
            assert!((back / t - 1.0).abs() < 1e-12);
            let numeric = crate::math::fd::numeric_gradient(|x| duration(x[0]).0, &[virtual_time(t)], 1e-3)[0];
            assert!((slope / numeric - 1.0).abs() < 1e-7, "{t}: {slope} {numeric}");
        }
    }

    #[test]
    fn the_second_derivative_is_continuous_at_zero() {
        let second = |tau: f64| (duration(tau + 1e-5).1 - duration(tau - 1e-5).1) / 2e-5;
        assert!((second(-1e-4) - second(1e-4)).abs() < 1e-3);
    }
}
