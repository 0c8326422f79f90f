//! From values to places on an axis, and the round numbers beside it.

use crate::math::real;

/// How values are spread over an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Spread {
    /// Evenly.
    Linear,
    /// Each factor of ten alike; values at or below zero have no place.
    Logarithmic,
}

/// An axis' values and how they are spread.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// At the beginning.
    pub low: f64,
    /// At the end, above `low`.
    pub high: f64,
    /// Between.
    pub spread: Spread,
}

impl Scale {
    /// An axis that shows all finite `values`, with room around them; never empty. Logarithmic ones show the positive values, at
    /// most six powers of ten of them.
    pub fn around(values: impl Iterator<Item = f64>, spread: Spread) -> Self {
        let logarithmic = spread == Spread::Logarithmic;
        let seen = values.filter(|v| v.is_finite() && (!logarithmic || *v > 0.0));
        let (low, high) = seen.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if logarithmic {
            let (low, high) = if low > high { (1.0, 10.0) } else { (low.max(1e-6 * high), high) };
            let [low, high] = [real::log10(low).floor(), (real::log10(high) + 1e-9).ceil()];
            return Self { low: real::powf(10.0, low), high: real::powf(10.0, high.max(low + 1.0)), spread };
        }
        let (low, high) = if low > high { (0.0, 1.0) } else { (low, high) };
        let room = if high > low { 0.06 * (high - low) } else { 0.5 * high.abs().max(1.0) };
        Self { low: low - room, high: high + room, spread }
    }

    /// An axis from exactly `low` to `high`, evenly.
    pub fn exactly(low: f64, high: f64) -> Self {
        Self { low, high: if high > low { high } else { low + 1.0 }, spread: Spread::Linear }
    }

    /// Where a value stands: 0 at the beginning, 1 at the end; NaN where it has no place.
    pub fn share(&self, value: f64) -> f64 {
        match self.spread {
            Spread::Linear => (value - self.low) / (self.high - self.low),
            Spread::Logarithmic => real::log10(value / self.low) / real::log10(self.high / self.low),
        }
    }

    /// Round values on the axis, about `count` of them (logarithmic: powers of ten), and their texts.
    pub fn ticks(&self, count: usize) -> Vec<(f64, String)> {
        match self.spread {
            Spread::Linear => {
                let step = round_step((self.high - self.low) / count.max(1) as f64);
                let decimals = (-(real::log10(step) + 1e-9).floor()).max(0.0) as usize;
                let slack = 1e-9 * (self.high - self.low);
                let (first, last) = (((self.low - slack) / step).ceil(), ((self.high + slack) / step).floor());
                let steps = (0..).map(|k| first + f64::from(k)).take_while(|k| *k <= last);
                // + 0.0: no negative zero.
                steps.map(|k| k * step + 0.0).map(|v| (v, format!("{v:.decimals$}"))).collect()
            }
            Spread::Logarithmic => {
                let powers = |v: f64, round: fn(f64) -> f64| round(real::log10(v)) as i32;
                let (first, last) =
                    (powers(self.low * (1.0 - 1e-9), f64::ceil), powers(self.high * (1.0 + 1e-9), f64::floor));
                let text = |k: i32| match k {
                    -3..0 => format!("{:.*}", k.unsigned_abs() as usize, real::powi(10.0, k)),
                    0..5 => format!("{:.0}", real::powi(10.0, k)),
                    _ => format!("10{}", raised(k)),
                };
                (first..=last).map(|k| (real::powi(10.0, k), text(k))).collect()
            }
        }
    }
}

/// A whole number in raised digits.
fn raised(number: i32) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let digit = |c: char| c.to_digit(10).map_or('⁻', |d| DIGITS[d as usize]);
    number.to_string().chars().map(digit).collect()
}

/// The least of 1, 2, 5, 10, … that is not below `step`.
fn round_step(step: f64) -> f64 {
    let power = real::powf(10.0, real::log10(step).floor());
    [1.0, 2.0, 5.0].into_iter().map(|m| m * power).find(|s| *s >= step * (1.0 - 1e-9)).unwrap_or(10.0 * power)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(scale: Scale, count: usize) -> Vec<String> {
        scale.ticks(count).into_iter().map(|(_, text)| text).collect()
    }

    #[test]
    fn ticks_are_round_and_within() {
        assert_eq!(texts(Scale::exactly(0.0, 10.0), 5), ["0", "2", "4", "6", "8", "10"]);
        assert_eq!(texts(Scale::exactly(-0.13, 0.32), 5), ["-0.1", "0.0", "0.1", "0.2", "0.3"]);
        assert_eq!(
            texts(Scale { low: 0.01, high: 100.0, spread: Spread::Logarithmic }, 5),
            ["0.01", "0.1", "1", "10", "100"]
        );
        assert_eq!(
            texts(Scale { low: 1e-12, high: 1e-3, spread: Spread::Logarithmic }, 5),
            ["10⁻¹²", "10⁻¹¹", "10⁻¹⁰", "10⁻⁹", "10⁻⁸", "10⁻⁷", "10⁻⁶", "10⁻⁵", "10⁻⁴", "0.001"]
        );
    }

    #[test]
    fn every_value_shown_stands_between_the_ends() {
        for spread in [Spread::Linear, Spread::Logarithmic] {
            let values = [0.3, 7.0, f64::NAN, 0.004, f64::INFINITY];
            let scale = Scale::around(values.into_iter(), spread);
            for v in values.into_iter().filter(|v| v.is_finite()) {
                assert!((0.0..=1.0).contains(&scale.share(v)), "{v} at {}", scale.share(v));
            }
            assert!((scale.share(scale.low)).abs() < 1e-12 && (scale.share(scale.high) - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn nothing_and_a_single_value_have_an_axis_too() {
        for spread in [Spread::Linear, Spread::Logarithmic] {
            for values in [vec![], vec![2.0], vec![0.0, 0.0]] {
                let scale = Scale::around(values.into_iter(), spread);
                assert!(scale.high > scale.low && !scale.ticks(5).is_empty(), "{scale:?}");
            }
        }
    }
}
