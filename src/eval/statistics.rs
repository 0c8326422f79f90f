//! Means, medians, percentiles.

use serde::Serialize;

use crate::report::Metrics;

/// A summary of a list of figures; all `NaN` (JSON: null) for an empty one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Summary {
    /// Arithmetic mean.
    pub mean: f64,
    /// 50th percentile.
    pub median: f64,
    /// 90th percentile.
    pub p90: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Greatest.
    pub max: f64,
}

impl Summary {
    /// Of finite values, in any order. Percentiles interpolate linearly between the values at ranks 0 to n - 1.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = values.into_iter().collect();
        sorted.sort_by(f64::total_cmp);
        let at = |share: f64| match sorted.len() {
            0 => f64::NAN,
            n => {
                let rank = share * (n - 1) as f64;
                let (below, rest) = (rank.floor() as usize, rank.fract());
                sorted[below] + rest * (sorted[(below + 1).min(n - 1)] - sorted[below])
            }
        };
        Self { mean: mean(sorted.iter().copied()), median: at(0.5), p90: at(0.9), p99: at(0.99), max: at(1.0) }
    }
}

/// Arithmetic mean; `NaN` for nothing.
pub(super) fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = values.into_iter().fold((0.0, 0usize), |(sum, n), v| (sum + v, n + 1));
    if count > 0 { sum / count as f64 } else { f64::NAN }
}

/// Means over scenes; `NaN` where there is none.
pub(super) fn mean_metrics(metrics: impl Iterator<Item = Metrics>) -> Metrics {
    let all: Vec<Metrics> = metrics.collect();
    let of = |figure: fn(&Metrics) -> f64| mean(all.iter().map(figure));
    Metrics {
        length_m: of(|m| m.length_m),
        time_s: of(|m| m.time_s),
        mean_jerk_mps3: of(|m| m.mean_jerk_mps3),
        mean_acceleration_mps2: of(|m| m.mean_acceleration_mps2),
        mean_angular_acceleration_rads2: of(|m| m.mean_angular_acceleration_rads2),
        mean_joint_jerk_rads3: of(|m| m.mean_joint_jerk_rads3),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_lie_between_their_neighbours() {
        let s = Summary::of((0..=100).rev().map(f64::from));
        assert_eq!((s.mean, s.median, s.p90, s.p99, s.max), (50.0, 50.0, 90.0, 99.0, 100.0));
        assert_eq!(Summary::of([1.0, 2.0]).median, 1.5);
        assert_eq!(Summary::of([7.0]).p99, 7.0);
        assert!(Summary::of([]).median.is_nan());
    }
}
