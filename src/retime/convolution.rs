//! The convolution profile of \[CONV\] section 2: from rest to rest under speed, acceleration and jerk, in closed form.

use crate::math::quadrature::gauss_legendre;
use crate::math::real;

/// A box shorter than this share of the whole duration is left out: it cannot be told from none.
const LEAST_BOX: f64 = 1e-12;

/// A box of height v and length t0 convolved with unit-area boxes of lengths t1 and t2.
///
/// With `t0 >= t1 + t2` and `t1 >= t2` it is the fastest motion from rest to rest of a triple integrator.
///
/// # Deviation
/// The alternating sum over the eight corner times cancels for short boxes. Here the same function is evaluated corner by corner
/// over the first half and mirrored, s(T - t) = S - s(t): no term cancels and s(T) = S exactly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Convolution {
    distance: f64,
    boxes: [f64; 3],
}

impl Convolution {
    /// The fastest profile over `distance` (`>= 0`) that keeps `limits` (speed, acceleration, jerk; each `> 0`, units of the
    /// distance per s, s^2, s^3). Zero distance takes no time.
    pub fn fastest(distance: f64, limits: [f64; 3]) -> Self {
        let [v, a, j] = limits;
        debug_assert!(distance >= 0.0 && v > 0.0 && a > 0.0 && j > 0.0);
        let a_reached = a.min((v * j).sqrt());
        let boxes = if distance >= v * (v / a_reached + a_reached / j) {
            [distance / v, v / a_reached, a_reached / j]
        } else if distance >= 2.0 * real::powi(a, 3) / (j * j) {
            // Too short for full speed: the cruise shrinks to nothing.
            let ramp = a * a / j;
            let v = 0.5 * ((ramp * ramp + 4.0 * a * distance).sqrt() - ramp);
            [v / a + a / j, v / a, a / j]
        } else {
            let t = real::cbrt(distance / (2.0 * j));
            [2.0 * t, t, t]
        };
        let least = LEAST_BOX * boxes.iter().sum::<f64>();
        Self { distance, boxes: boxes.map(|t| if t > least { t } else { 0.0 }) }
    }

    /// Duration, s.
    pub fn duration(&self) -> f64 {
        self.boxes.iter().sum()
    }

    /// Distance covered.
    pub fn distance(&self) -> f64 {
        self.distance
    }

    /// Greatest speed, reached in the middle.
    pub fn peak_speed(&self) -> f64 {
        if self.boxes[0] > 0.0 { self.distance / self.boxes[0] } else { 0.0 }
    }

    /// The eight corner times at which the jerk jumps, ascending.
    pub fn corners(&self) -> [f64; 8] {
        let [t0, t1, t2] = self.boxes;
        [0.0, t2, t1, t1 + t2, t0, t0 + t2, t0 + t1, t0 + t1 + t2]
    }

    /// Distance, speed, acceleration and jerk at time `t`, clamped to the profile; the jerk is that after a corner in the first
    /// half, before it in the second.
    pub fn at(&self, t: f64) -> [f64; 4] {
        let duration = self.duration();
        if t <= 0.0 {
            return [0.0; 4];
        }
        if t >= duration {
            return [self.distance, 0.0, 0.0, 0.0];
        }
        if t <= 0.5 * duration {
            return self.first_half(t);
        }
        let [s, v, a, j] = self.first_half(duration - t);
        [self.distance - s, v, -a, j]
    }

    /// Distance covered between two times: accurate to rounding of itself, not of the whole, so that held speeds and their
    /// differences are not noise where the interval is short.
    pub fn between(&self, from: f64, to: f64) -> f64 {
        let mut sum = 0.0;
        let mut at = from.max(0.0);
        for corner in self.corners().into_iter().chain([to]) {
            let end = corner.min(to);
            if end > at {
                sum += gauss_legendre(at, end, |t| self.at(t)[1]);
                at = end;
            }
        }
        sum
    }

    /// The inverse of the distance: when `s` is reached.
    pub fn time_at(&self, s: f64) -> f64 {
        let duration = self.duration();
        if s <= 0.0 {
            return 0.0;
        }
        if s >= self.distance {
            return duration;
        }
        let mirrored = s > 0.5 * self.distance;
        let target = if mirrored { self.distance - s } else { s };
        let (mut low, mut high) = (0.0, 0.5 * duration);
        let mut t = 0.5 * high;
        for _ in 0..80 {
            let [s, v, ..] = self.first_half(t);
            if s > target {
                high = t;
            } else {
                low = t;
            }
            let stepped = t - (s - target) / v;
            let better = if stepped > low && stepped < high { stepped } else { 0.5 * (low + high) };
            if (better - t).abs() <= 1e-15 * duration {
                break;
            }
            t = better;
        }
        if mirrored { duration - t } else { t }
    }

    fn first_half(&self, t: f64) -> [f64; 4] {
        let [t0, t1, t2] = self.boxes;
        let v = self.distance / t0;
        if t >= t1 + t2 {
            // A cruise of no length is no cruise: the middle is in the midst of one stretch of jerk.
            let j = if t2 > 0.0 && t0 <= (t1 + t2) * (1.0 + 1e-12) { -v / (t1 * t2) } else { 0.0 };
            return [0.5 * self.distance - v * (0.5 * (t0 + t1 + t2) - t), v, 0.0, j];
        }
        // t < t1 + t2, so t1 > 0.
        let a = v / t1;
        if t < t2 {
            let j = a / t2;
            return [j * t * t * t / 6.0, 0.5 * j * t * t, j * t, j];
        }
        if t < t1 {
            let (s2, v2, x) = (a * t2 * t2 / 6.0, 0.5 * a * t2, t - t2);
            return [s2 + x * (v2 + 0.5 * a * x), v2 + a * x, a, 0.0];
        }
        // Back from the start of the cruise; t2 > 0 here.
        let (j, x) = (a / t2, (t1 + t2 - t).min(t2));
        [v * (0.5 * (t1 + t2) - x) + j * x * x * x / 6.0, v - 0.5 * j * x * x, j * x, -j]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const PAPER: [f64; 3] = [0.5, 0.2, 0.2];

    #[test]
    fn straight_lines_take_the_time_that_ruckig_finds() {
        // tests/vectors/time_laws.json, `straight_lines`: ruckig 0.19.4.
        let ruckig = [
            (4.0, 11.5),
            (1.0, 5.582575694955839),
            (0.5, 4.3166247903554),
            (0.3, 3.634241185664279),
            (0.1, 2.5198420997897464),
            (0.02, 1.4736125994561546),
        ];
        for (distance, time) in ruckig {
            let duration = Convolution::fastest(distance, PAPER).duration();
            assert!((duration - time).abs() < 1e-12, "{distance} m: {duration} s, ruckig {time} s");
        }
    }

    #[test]
    fn the_box_lengths_are_the_papers_on_a_straight_line() {
        assert_eq!(Convolution::fastest(4.0, PAPER).boxes, [8.0, 2.5, 1.0]);
    }

    #[test]
    fn the_closed_form_is_the_numeric_convolution() {
        for distance in [4.0, 1.3, 0.05] {
            let profile = Convolution::fastest(distance, PAPER);
            let steps = 4000;
            let dt = profile.duration() / f64::from(steps);
            let boxes = profile.boxes.map(|t| t / dt);
            // Integrals of a box are exact on the grid if its share of every cell is used.
            let fill = |length: f64| -> Vec<f64> {
                (0..=length as usize).map(|i| (length - i as f64).clamp(0.0, 1.0)).collect()
            };
            let convolve = |a: &[f64], b: &[f64]| -> Vec<f64> {
                let mut out = vec![0.0; a.len() + b.len() - 1];
                for (i, x) in a.iter().enumerate() {
                    for (k, y) in b.iter().enumerate() {
                        out[i + k] += x * y;
                    }
                }
                out
            };
            let unit = |length: f64| fill(length).into_iter().map(|x| x / length).collect::<Vec<_>>();
            let cruise: Vec<f64> = fill(boxes[0]).into_iter().map(|x| x * distance / profile.boxes[0]).collect();
            let speed = convolve(&convolve(&cruise, &unit(boxes[1])), &unit(boxes[2]));
            let mut travelled = 0.0;
            for (i, v) in speed.iter().enumerate() {
                // Each factor's cell i stands for [i, i + 1) dt: three of them shift the middle by 3/2 cells.
                let t = (i as f64 + 1.5) * dt;
                travelled += v * dt;
                assert!((profile.at(t)[1] - v).abs() < 2e-3 * profile.peak_speed(), "{distance} m at {t} s");
            }
            assert!((travelled - distance).abs() < 1e-9);
        }
    }

    #[test]
    fn the_closed_form_is_the_alternating_sum_over_the_corners() {
        let profile = Convolution::fastest(2.9, PAPER);
        let [t0, t1, t2] = profile.boxes;
        let c = 2.9 / (t0 * t1 * t2);
        for i in 0..100 {
            let t = profile.duration() * f64::from(i) / 100.0;
            let mut sum = [0.0; 3];
            for subset in 0..8u32 {
                let corner: f64 = (0..3).map(|b| if subset >> b & 1 == 1 { profile.boxes[b] } else { 0.0 }).sum();
                let (x, sign) = ((t - corner).max(0.0), if subset.count_ones() % 2 == 0 { c } else { -c });
                sum[0] += sign * x * x * x / 6.0;
                sum[1] += sign * x * x / 2.0;
                sum[2] += sign * x;
            }
            let at = profile.at(t);
            (0..3).for_each(|k| assert!((at[k] - sum[k]).abs() < 1e-12, "order {k} at {t} s: {at:?} {sum:?}"));
        }
    }

    #[test]
    fn a_box_of_a_millionth_of_the_duration_costs_no_accuracy() {
        let limits = [11.221578874131614, 29.902330493687817, 56577636439.525024];
        let profile = Convolution::fastest(0.0004444706076731346, limits);
        for corner in profile.corners() {
            assert!(profile.at(corner)[2].abs() <= limits[1] * (1.0 + 1e-12));
        }
    }

    proptest! {
        // No file of failures: each that is found becomes a test of its own.
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]
        #[test]
        fn limits_hold_and_the_distance_is_exact(
            distance in prop_oneof![1e-9..1e-3f64, 1e-3..10.0f64, 10.0..1e5f64],
            v in 1e-3..20.0f64, a in 1e-3..50.0f64, j in prop_oneof![1e-3..100.0f64, 1e4..1e12f64],
        ) {
            let profile = Convolution::fastest(distance, [v, a, j]);
            let duration = profile.duration();
            prop_assert_eq!(profile.at(duration)[0], distance);
            prop_assert_eq!(profile.at(0.0), [0.0; 4]);
            let mut before = [0.0; 4];
            let corners = profile.corners();
            let inside = (1..400).map(|i| duration * f64::from(i) / 400.0);
            let mut times: Vec<f64> = inside.chain(corners).collect();
            times.sort_by(f64::total_cmp);
            for t in times {
                let at = profile.at(t);
                let slack = 1.0 + 1e-12;
                prop_assert!(at[1] <= v * slack && at[2].abs() <= a * slack, "{at:?} at {t}");
                // Where a box was left out as too short to matter, its jerk is no figure.
                prop_assert!(at[3].abs() <= j * slack, "{at:?} at {t}");
                prop_assert!((profile.between(0.0, t) - at[0]).abs() <= 1e-14 * distance);
                prop_assert!(at[0] >= before[0] - 1e-15 * distance && at[1] >= 0.0);
                prop_assert!((profile.at(profile.time_at(at[0]))[0] - at[0]).abs() <= 1e-14 * distance);
                before = at;
            }
        }

        #[test]
        fn it_is_continuous_across_every_corner(distance in 1e-3..100.0f64, v in 0.1..3.0f64, a in 0.1..3.0f64, j in 0.1..30.0f64) {
            let profile = Convolution::fastest(distance, [v, a, j]);
            for corner in profile.corners() {
                let h = 1e-9 * profile.duration();
                let (before, after) = (profile.at(corner - h), profile.at(corner + h));
                prop_assert!((after[0] - before[0]).abs() <= 2.01 * h * v);
                prop_assert!((after[1] - before[1]).abs() <= 2.01 * h * a);
                prop_assert!((after[2] - before[2]).abs() <= 2.01 * h * j + 1e-12);
            }
        }
    }

    #[test]
    fn the_greatest_speed_is_that_in_the_middle() {
        for (distance, limits) in
            [(0.0, [1.0; 3]), (1e-3, [0.5, 0.2, 0.2]), (0.5, [0.5, 0.2, 0.2]), (9.0, [0.5, 0.2, 0.2])]
        {
            let profile = Convolution::fastest(distance, limits);
            assert!((profile.peak_speed() - profile.at(0.5 * profile.duration())[1]).abs() < 1e-15, "{distance}");
        }
    }

    #[test]
    fn in_the_midst_of_one_stretch_of_jerk_the_jerk_is_what_it_is_before() {
        // Without a cruise: short of the acceleration limit, and at it.
        for distance in [1e-3, 0.05, 0.3, 1.0] {
            let profile = Convolution::fastest(distance, [5.0, 0.2, 0.2]);
            let (middle, [_, v, a, jerk]) = (0.5 * profile.duration(), profile.at(0.5 * profile.duration()));
            let before = profile.at(middle * (1.0 - 1e-6));
            assert!((jerk + 0.2).abs() < 1e-9 && (before[3] - jerk).abs() < 1e-9, "{distance}: {jerk} {before:?}");
            assert!(a.abs() < 1e-9 && (v - before[1]).abs() < 1e-9);
        }
        assert_eq!(Convolution::fastest(9.0, [0.5, 0.2, 0.2]).at(11.0)[3], 0.0);
    }

    #[test]
    fn however_short_the_distance_it_takes_the_time_of_four_stretches_of_jerk() {
        for distance in [1e-6, 1e-18, 1e-30, 1e-60] {
            let time = 4.0 * real::cbrt(distance / 0.4);
            assert!((Convolution::fastest(distance, PAPER).duration() / time - 1.0).abs() < 1e-14, "{distance}");
        }
    }
}
