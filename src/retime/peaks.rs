//! Largest speed, acceleration and jerk of every actuator over a leg, and the slow-down that restores its limits.

use crate::math::real;

/// Samples in every stretch between two breaks, besides its ends.
const SAMPLES: usize = 7;
/// How near a break its one-sided limit is taken, as a share of the stretch.
const BESIDE: f64 = 1e-9;
/// Local maxima below this share of the largest sample are not refined: samples are too dense for them to win.
const WORTH_REFINING: f64 = 0.9;
/// An acceleration that jumps by less than this share of its peak is rounding, not a jump.
const JUMP: f64 = 1e-6;
/// Share of a jump that falls between two consecutive differences of interval means, at worst: where it lies in an interval's middle.
pub const HELD_JUMP: f64 = 0.75;

/// Peaks over time, one entry an actuator.
#[derive(Debug, Clone, PartialEq)]
pub struct Peaks {
    /// Largest |speed|, |acceleration|, |jerk|.
    pub rates: Vec<[f64; 3]>,
    /// Jumps of the acceleration at breaks, a jerk impulse each, where the path's curvature has a kink: the jump and the largest
    /// |jerk| beside it.
    pub jumps: Vec<Vec<[f64; 2]>>,
}

/// Finds the peaks of `rates`, which appends each actuator's (speed, acceleration, jerk) at a time; it is smooth between `breaks`
/// (ascending; doubles are skipped). `refine`: to rounding; otherwise the largest of the samples.
pub fn peaks(breaks: &[f64], refine: bool, mut rates: impl FnMut(f64, &mut Vec<[f64; 3]>)) -> Peaks {
    let end = breaks.last().copied().unwrap_or(0.0);
    let (mut times, mut values) = (Vec::new(), Vec::new());
    let mut actuators = 0;
    let mut stretches = 0;
    for pair in breaks.windows(2) {
        let length = pair[1] - pair[0];
        if length <= 1e-12 * end {
            continue;
        }
        stretches += 1;
        for i in 0..SAMPLES + 2 {
            let share = (i as f64 / (SAMPLES + 1) as f64).clamp(BESIDE, 1.0 - BESIDE);
            times.push(pair[0] + share * length);
            rates(times[times.len() - 1], &mut values);
        }
        actuators = values.len() / times.len();
    }
    let mut found = Peaks { rates: vec![[0.0; 3]; actuators], jumps: vec![Vec::new(); actuators] };
    for (i, value) in values.iter().enumerate() {
        let peak = &mut found.rates[i % actuators];
        (0..3).for_each(|k| peak[k] = peak[k].max(value[k].abs()));
    }
    let per_stretch = SAMPLES + 2;
    for join in 1..stretches {
        for actuator in 0..actuators {
            let at = |sample: usize| values[sample * actuators + actuator];
            let (before, after) = (at(join * per_stretch - 1), at(join * per_stretch));
            let jump = (after[1] - before[1]).abs();
            if jump > JUMP * found.rates[actuator][1] {
                found.jumps[actuator].push([jump, before[2].abs().max(after[2].abs())]);
            }
        }
    }
    if refine {
        let mut scratch = Vec::with_capacity(actuators);
        for actuator in 0..actuators {
            for order in 0..3 {
                let worth = WORTH_REFINING * found.rates[actuator][order];
                let at = |sample: usize| values[sample * actuators + actuator][order].abs();
                for stretch in 0..stretches {
                    let (first, last) = (stretch * per_stretch, stretch * per_stretch + SAMPLES + 1);
                    let mut refine = |bracket: [f64; 3], middle: Option<f64>| {
                        let mut value = |t: f64| {
                            scratch.clear();
                            rates(t, &mut scratch);
                            scratch[actuator][order].abs()
                        };
                        let middle = middle.unwrap_or_else(|| value(bracket[1]));
                        let better = maximum(bracket, middle, value);
                        found.rates[actuator][order] = found.rates[actuator][order].max(better);
                    };
                    // Beside a break the sample there may be the largest and the maximum still be within: where the values rise from the
                    // break, by the parabola through the first three samples.
                    for [end, next, third] in [[first, first + 1, first + 2], [last, last - 1, last - 2]] {
                        let [v0, v1, v2] = [end, next, third].map(at);
                        if v0 >= worth && v0 >= v1 && 4.0 * v1 > 3.0 * v0 + v2 {
                            let (low, high) = (times[end.min(next)], times[end.max(next)]);
                            refine([low, 0.5 * (low + high), high], None);
                        }
                    }
                    for here in first + 1..last {
                        let value = at(here);
                        if value < worth || value <= 0.0 || value < at(here - 1) || value < at(here + 1) {
                            continue;
                        }
                        refine([times[here - 1], times[here], times[here + 1]], Some(value));
                    }
                }
            }
        }
    }
    found
}

/// The largest value of a smooth function with one maximum in `bracket`, by parabolas through the best three points.
fn maximum(bracket: [f64; 3], middle: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
    let mut t = bracket;
    let mut v = [f(t[0]), middle, f(t[2])];
    for _ in 0..12 {
        let (left, right) = ((v[1] - v[0]) * (t[2] - t[1]), (v[1] - v[2]) * (t[1] - t[0]));
        if left + right <= 0.0 {
            break; // flat
        }
        let vertex = t[1] + 0.5 * (left * (t[2] - t[1]) - right * (t[1] - t[0])) / (left + right);
        if !(vertex > t[0] && vertex < t[2]) || (vertex - t[1]).abs() <= 1e-9 * (t[2] - t[0]) {
            break;
        }
        let value = f(vertex);
        let gain = value - v[1];
        let better = gain > 0.0;
        match (vertex < t[1], better) {
            (true, true) => (t, v) = ([t[0], vertex, t[1]], [v[0], value, v[1]]),
            (false, true) => (t, v) = ([t[1], vertex, t[2]], [v[1], value, v[2]]),
            (true, false) => (t[0], v[0]) = (vertex, value),
            (false, false) => (t[2], v[2]) = (vertex, value),
        }
        if gain.abs() <= 1e-13 * v[1] {
            break;
        }
    }
    v[1]
}

/// The least factor `>= 1` by which time must be stretched for every limit (speed, acceleration, jerk; `None`: not checked) to hold.
///
/// Speeds fall with the factor, accelerations with its square, jerks with its cube. A jump of acceleration counts as a jerk of
/// 3/4 jump/`hold`, which is the most that held means make of it; it falls with the square.
pub fn slow_down(peaks: &Peaks, limits: &[[Option<f64>; 3]], hold: f64) -> f64 {
    let mut factor = 1.0f64;
    for ((rates, jumps), limit) in peaks.rates.iter().zip(&peaks.jumps).zip(limits) {
        let over = |k: usize| limit[k].map_or(0.0, |limit| rates[k] / limit);
        factor = factor.max(over(0)).max(over(1).sqrt()).max(real::cbrt(over(2)));
        let Some(limit) = limit[2] else { continue };
        for [jump, jerk] in jumps {
            factor = jump_slow_down(factor, HELD_JUMP * jump / hold, *jerk, limit);
        }
    }
    factor
}

/// The least factor, not below `factor`, with jerk/factor^3 + impulse/factor^2 <= limit.
fn jump_slow_down(factor: f64, impulse: f64, jerk: f64, limit: f64) -> f64 {
    let excess = |f: f64| jerk / (f * f * f) + impulse / (f * f) - limit;
    let (mut low, mut high) = (factor, factor);
    while excess(high) > 0.0 {
        low = high;
        high *= 2.0;
    }
    for _ in 0..50 {
        let middle = 0.5 * (low + high);
        if excess(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_peak_beside_a_break_is_found_though_the_sample_at_the_break_is_the_largest() {
        // One stretch of a second: samples 1/8 s apart, the peak less than half of that from a break.
        for offset in [0.01, 0.03, 0.05, 0.06] {
            for top in [offset, 1.0 - offset] {
                let found =
                    peaks(&[0.0, 1.0], true, |t, out| out.push([real::cos(t - top), 0.0, -3.0 * real::cos(t - top)]));
                assert!((found.rates[0][0] - 1.0).abs() < 1e-12, "{top}: {}", found.rates[0][0]);
                assert!((found.rates[0][2] - 3.0).abs() < 1e-11, "{top}: {}", found.rates[0][2]);
            }
        }
    }

    #[test]
    fn peaks_between_samples_are_found_to_rounding() {
        let wave = |t: f64, out: &mut Vec<[f64; 3]>| {
            out.push([real::sin(3.0 * t + 0.2), -2.0 * real::powi(t - 0.41, 2) + 0.3, real::exp(t - 1.3)]);
            out.push([0.0; 3]);
        };
        let found = peaks(&[0.0, 0.2, 0.2, 1.0], true, wave);
        assert!((found.rates[0][0] - 1.0).abs() < 1e-12);
        assert!((found.rates[0][1] - 0.3962).abs() < 1e-8, "{found:?}");
        assert!((found.rates[0][2] - real::exp(-0.3)).abs() < 1e-8);
        assert_eq!(found.rates[1], [0.0; 3]);
        assert!(found.jumps.iter().all(Vec::is_empty));
    }

    #[test]
    fn a_jump_of_acceleration_is_found_at_a_break() {
        let found = peaks(&[0.0, 1.0, 2.0], true, |t, out| out.push([0.0, if t < 1.0 { 0.2 } else { -0.1 }, 0.0]));
        assert!((found.jumps[0][0][0] - 0.3).abs() < 1e-12);
    }

    #[test]
    fn the_slow_down_restores_each_limit_exactly() {
        let of = |rates: [f64; 3], jump: f64| Peaks {
            rates: vec![rates],
            jumps: vec![if jump > 0.0 { vec![[jump, 0.1]] } else { vec![] }],
        };
        let limits = [[Some(0.5), Some(0.2), Some(0.2)]];
        assert_eq!(slow_down(&of([0.5, 0.1, 0.2], 0.0), &limits, 0.1), 1.0);
        assert_eq!(slow_down(&of([1.0, 0.2, 0.2], 0.0), &limits, 0.1), 2.0);
        assert!((slow_down(&of([0.5, 0.8, 0.2], 0.0), &limits, 0.1) - 2.0).abs() < 1e-15);
        assert!((slow_down(&of([0.5, 0.2, 1.6], 0.0), &limits, 0.1) - 2.0).abs() < 1e-15);
        assert_eq!(slow_down(&of([9.0, 9.0, 9.0], 0.0), &[[None; 3]], 0.1), 1.0);
        let jumping = slow_down(&of([0.0, 0.0, 0.15], 0.08), &limits, 0.1);
        assert!((0.1 / real::powi(jumping, 3) + 0.6 / real::powi(jumping, 2) - 0.2).abs() < 1e-12);
    }

    #[test]
    fn nothing_is_sought_where_the_samples_say_that_it_rises_or_falls_all_along() {
        let rates: [fn(f64) -> f64; 4] = [|t| t, |t| 1.0 - t, |t| 0.9 + 0.1 * t, |t| 1.0 - 0.1 * t];
        for rate in rates {
            let mut asked = 0;
            let found = peaks(&[0.0, 1.0], true, |t, out| {
                asked += 1;
                out.push([rate(t), 0.0, 0.0]);
            });
            assert_eq!(asked, SAMPLES + 2);
            assert!((found.rates[0][0] - 1.0).abs() < 1e-8);
        }
    }

    #[test]
    fn peaks_are_found_to_rounding_long_after_the_start() {
        let found = peaks(&[1e6, 1e6 + 1.0], true, |t, out| out.push([real::cos(t - 1e6 - 0.41), 0.0, 0.0]));
        assert!((found.rates[0][0] - 1.0).abs() < 1e-12, "{found:?}");
    }

    #[test]
    fn peaks_are_found_to_rounding_in_any_unit() {
        for (long, large) in [(1e-13, 1.0), (1e-3, 1e4), (1e3, 1e-7), (1e9, 1e-12)] {
            // The first one between samples, the second one beside a break.
            for top in [0.41, 0.03] {
                let found = peaks(&[0.0, long], true, |t, out| out.push([large * real::cos(t / long - top), 0.0, 0.0]));
                assert!((found.rates[0][0] / large - 1.0).abs() < 1e-12, "{long} {large} {top}: {:?}", found.rates);
            }
        }
    }

    #[test]
    fn a_jump_is_told_from_rounding_by_the_acceleration() {
        for (acceleration, jump, counts) in
            [(0.2, 0.01, true), (0.2, 1e-6, true), (0.2, 1e-8, false), (1e6, 2.0, true), (1e6, 0.5, false)]
        {
            let rates = |t: f64| [0.0, if t < 1.0 { acceleration - jump } else { acceleration }, 0.0];
            let found = peaks(&[0.0, 1.0, 2.0], true, |t, out| out.push(rates(t)));
            assert_eq!(!found.jumps[0].is_empty(), counts, "{acceleration} {jump}");
        }
    }

    #[test]
    fn the_search_for_a_maximum_stays_in_its_bracket_and_ends_when_it_is_there() {
        // A parabola whose top is in the middle already, one beside it, and a narrow one far from zero.
        for (low, width, top, most) in
            [(4.0, 1.0, 5.0, 0), (4.0, 1.0, 5.3, 2), (1e6, 0.5, 1e6 + 0.7, 3), (3.0, 5e-7, 3.0 + 6e-7, 3)]
        {
            let f = |t: f64| 1.0 - ((t - top) / width) * ((t - top) / width);
            let mut asked = 0;
            let bracket = [low, low + width, low + 2.0 * width];
            let found = maximum(bracket, f(bracket[1]), |t| {
                asked += 1;
                assert!((bracket[0]..=bracket[2]).contains(&t), "{t}");
                f(t)
            });
            assert!((found - 1.0).abs() < 1e-9 && asked <= 2 + most, "{top}: {found} after {asked}");
        }
        // Falling, and as a parabola highest before its bracket.
        let found = maximum([0.0, 1.0, 2.0], 0.96, |t| {
            assert!((0.0..=2.0).contains(&t), "{t}");
            if t < 0.5 { 1.0 } else { 0.9 }
        });
        assert_eq!(found, 0.96);
    }
}
