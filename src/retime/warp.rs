//! Ramps from and to rest for a curve that brings its own timing.

/// The curve's own seconds `u` as a function of time: the rate du/dt rises smoothly from 0 to 1 over the first ramp, stays 1, and falls
/// to 0 over the last. Twice continuously differentiable; the third derivative is bounded by 6/ramp^2 and jumps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Warp {
    own: f64,
    ramps: [f64; 2],
}

impl Warp {
    /// For a curve of `own` seconds, with ramps of the given lengths, s; their sum is at most twice `own`, which both must leave for the
    /// curve to be covered.
    pub fn new(own: f64, ramps: [f64; 2]) -> Self {
        debug_assert!(ramps.iter().all(|r| *r > 0.0) && ramps[0] + ramps[1] <= 2.0 * own * (1.0 + 1e-12));
        Self { own, ramps }
    }

    /// Duration, s: half of each ramp longer than the curve's own.
    pub fn duration(&self) -> f64 {
        self.own + 0.5 * (self.ramps[0] + self.ramps[1])
    }

    /// Times between which it is smooth, ascending.
    pub fn corners(&self) -> [f64; 4] {
        let duration = self.duration();
        [0.0, self.ramps[0], duration - self.ramps[1], duration]
    }

    /// `u` and its first three derivatives, time clamped to the profile.
    pub fn at(&self, t: f64) -> [f64; 4] {
        let rest = self.duration() - t;
        if t < self.ramps[0] {
            ramp(t, self.ramps[0])
        } else if rest < self.ramps[1] {
            let [u, rate, second, third] = ramp(rest, self.ramps[1]);
            [self.own - u, rate, -second, third]
        } else {
            [t - 0.5 * self.ramps[0], 1.0, 0.0, 0.0]
        }
    }

    /// When the curve's own time `u` is reached.
    pub fn time_at(&self, u: f64) -> f64 {
        let left = self.own - u;
        if u < 0.5 * self.ramps[0] {
            inverse_ramp(u, self.ramps[0])
        } else if left < 0.5 * self.ramps[1] {
            self.duration() - inverse_ramp(left, self.ramps[1])
        } else {
            u + 0.5 * self.ramps[0]
        }
    }
}

/// Rate 3x^2 - 2x^3 at x = t/length: the cubic step.
fn ramp(t: f64, length: f64) -> [f64; 4] {
    let x = (t / length).clamp(0.0, 1.0);
    [
        length * x * x * x * (1.0 - 0.5 * x),
        x * x * (3.0 - 2.0 * x),
        6.0 * x * (1.0 - x) / length,
        (6.0 - 12.0 * x) / (length * length),
    ]
}

fn inverse_ramp(u: f64, length: f64) -> f64 {
    let (mut low, mut high) = (0.0, length);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if ramp(middle, length)[0] < u {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warp_covers_the_curve_from_rest_to_rest() {
        let warp = Warp::new(5.0, [0.8, 1.4]);
        assert_eq!(warp.at(0.0)[..3], [0.0; 3]);
        assert_eq!(warp.at(warp.duration())[..2], [5.0, 0.0]);
        assert!((warp.duration() - 6.1).abs() < 1e-15);
        assert_eq!(warp.at(3.0), [2.6, 1.0, 0.0, 0.0]);
    }

    #[test]
    fn its_derivatives_match_its_values_and_its_inverse_inverts() {
        let warp = Warp::new(1.1, [0.8, 1.4]);
        let h = 1e-6;
        for i in 1..40 {
            let t = warp.duration() * f64::from(i) / 40.0;
            let (low, at, high) = (warp.at(t - h), warp.at(t), warp.at(t + h));
            for k in 0..3 {
                assert!(((high[k] - low[k]) / (2.0 * h) - at[k + 1]).abs() < 1e-4, "order {k} at {t}");
            }
            assert!((warp.time_at(at[0]) - t).abs() < 1e-9);
        }
    }

    #[test]
    fn between_the_ramps_the_curves_own_seconds_pass_and_the_corners_are_where_ramps_end() {
        let warp = Warp::new(5.0, [0.8, 1.4]);
        for (found, expected) in warp.corners().iter().zip([0.0, 0.8, 4.7, 6.1]) {
            assert!((found - expected).abs() < 1e-14, "{found}");
        }
        for i in 0..=61 {
            let t = 0.1 * f64::from(i);
            assert!((warp.time_at(warp.at(t)[0]) - t).abs() < 1e-6, "{t}");
        }
        assert!((warp.time_at(2.6) - 3.0).abs() < 1e-14);
    }
}
