//! A clock for a clock: reference time as a function of time, given by its squared rate.

use crate::math::real;

/// Reference time `t` as a function of time tau: twice continuously differentiable, the third derivative bounded.
///
/// `b(t) = (dt/dtau)^2` is a continuously differentiable piecewise quadratic. In one cell, `t'' = b'/2` is then linear in `t`, so `t` is a
/// sum of hyperbolic (or trigonometric) functions of tau: exact, and nothing has to be inverted numerically.
#[derive(Debug, Clone, PartialEq)]
pub struct Pace {
    cells: Vec<Cell>,
    reference: f64,
    duration: f64,
}

/// b = p0 + p1 s + p2 s^2, with s the reference time since `from`.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cell {
    /// Reference time at the start.
    from: f64,
    /// Time at the start.
    at: f64,
    /// sqrt(p0).
    rate: f64,
    p1: f64,
    p2: f64,
}

impl Pace {
    /// From the cells' limits in reference time (ascending, one more than cells) and each cell's p0, p1, p2; b must be positive.
    pub(super) fn new(knots: &[f64], cells: impl Iterator<Item = [f64; 3]>) -> Self {
        let mut duration = 0.0;
        let cells = knots.windows(2).zip(cells).map(|(ends, [p0, p1, p2])| {
            let cell = Cell { from: ends[0], at: duration, rate: p0.sqrt(), p1, p2 };
            duration += cell.time_to(ends[1] - ends[0]);
            cell
        });
        let cells = cells.collect();
        Self { cells, reference: knots[knots.len() - 1], duration }
    }

    /// Duration, s.
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// Times between which it is smooth, ascending.
    pub fn corners(&self) -> impl Iterator<Item = f64> + '_ {
        self.cells.iter().map(|cell| cell.at).chain([self.duration])
    }

    /// Reference time and its first three derivatives at a time, clamped.
    pub fn at(&self, time: f64) -> [f64; 4] {
        let time = time.clamp(0.0, self.duration);
        let index = self.cells.partition_point(|cell| cell.at <= time).max(1) - 1;
        let cell = &self.cells[index];
        let mut jet = cell.after(time - cell.at);
        let end = self.cells.get(index + 1).map_or(self.reference, |next| next.from);
        jet[0] = jet[0].clamp(cell.from, end);
        jet
    }

    /// When a reference time is reached.
    pub fn time_at(&self, reference: f64) -> f64 {
        let index = self.cells.partition_point(|cell| cell.from <= reference).max(1) - 1;
        let cell = &self.cells[index];
        let end = self.cells.get(index + 1).map_or(self.duration, |next| next.at);
        (cell.at + cell.time_to((reference - cell.from).max(0.0))).min(end)
    }
}

impl Cell {
    /// Reference time and derivatives when `x` seconds have passed in the cell.
    fn after(&self, x: f64) -> [f64; 4] {
        let square = self.p2 * x * x;
        let sine = x * sine_ratio(square);
        let half = x * sine_ratio(0.25 * square);
        let versine = 0.5 * half * half;
        let s = self.rate * sine + 0.5 * self.p1 * versine;
        let rate = self.rate * (1.0 + self.p2 * versine) + 0.5 * self.p1 * sine;
        [self.from + s, rate, 0.5 * self.p1 + self.p2 * s, self.p2 * rate]
    }

    /// Seconds from the cell's start until `s` of reference time have passed.
    fn time_to(&self, s: f64) -> f64 {
        let rates = self.rate + (self.rate * self.rate + s * (self.p1 + s * self.p2)).max(0.0).sqrt();
        2.0 * s / rates * arc_ratio(self.p2 * (s / rates) * (s / rates))
    }
}

/// sinh(sqrt(x))/sqrt(x), for negative x sin(sqrt(-x))/sqrt(-x).
fn sine_ratio(x: f64) -> f64 {
    if x.abs() < 1.0 {
        // 1 + x/3! + x^2/5! + …
        return (1..=8).rev().fold(1.0, |sum, k| 1.0 + sum * x / f64::from((2 * k) * (2 * k + 1)));
    }
    let root = x.abs().sqrt();
    if x > 0.0 { real::sinh(root) / root } else { real::sin(root) / root }
}

/// atanh(sqrt(x))/sqrt(x), for negative x atan(sqrt(-x))/sqrt(-x); x < 1.
fn arc_ratio(x: f64) -> f64 {
    if x.abs() < 0.01 {
        return (0..=7).rev().fold(0.0, |sum, k| sum * x + 1.0 / f64::from(2 * k + 1));
    }
    let root = x.abs().sqrt();
    if x > 0.0 { real::atanh(root) / root } else { real::atan(root) / root }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uneven() -> Pace {
        // b = 1 + t^2, then the parabola that goes on with its slope and bends down.
        Pace::new(&[0.0, 2.0, 3.5], [[1.0, 0.0, 1.0], [5.0, 4.0, -2.5]].into_iter())
    }

    #[test]
    fn the_squared_rate_is_the_given_one_and_derivatives_match() {
        let pace = uneven();
        let b = |t: f64| if t < 2.0 { 1.0 + t * t } else { 5.0 + (t - 2.0) * (4.0 - 2.5 * (t - 2.0)) };
        let h = 1e-5;
        for i in 1..50 {
            let time = pace.duration() * f64::from(i) / 50.0;
            let (low, at, high) = (pace.at(time - h), pace.at(time), pace.at(time + h));
            assert!((at[1] * at[1] - b(at[0])).abs() < 1e-13);
            for k in 0..2 {
                assert!(((high[k] - low[k]) / (2.0 * h) - at[k + 1]).abs() < 1e-6, "order {k} at {time}");
            }
            assert!((pace.time_at(at[0]) - time).abs() < 1e-14);
        }
        // dtau = dt/sqrt(1 + t^2).
        assert!((pace.time_at(2.0) - real::asinh(2.0)).abs() < 1e-15);
        assert_eq!(pace.at(pace.duration())[0], 3.5);
        assert_eq!(pace.at(-1.0), [0.0, 1.0, 0.0, 1.0]);
    }

    #[test]
    fn it_joins_in_two_derivatives() {
        let pace = uneven();
        let join = pace.corners().nth(1).unwrap();
        let (before, after) = (pace.at(join - 1e-9), pace.at(join + 1e-9));
        (0..3).for_each(|k| assert!((before[k] - after[k]).abs() < 1e-7, "{before:?} {after:?}"));
        assert!((before[3] - after[3]).abs() > 1.0);
    }

    #[test]
    fn ratios_are_those_of_the_functions_far_from_zero_too() {
        assert!((sine_ratio(-4.0) - real::sin(2.0) / 2.0).abs() < 1e-15);
        assert!((sine_ratio(9.0) - real::sinh(3.0) / 3.0).abs() < 1e-14);
        assert!((arc_ratio(-4.0) - real::atan(2.0) / 2.0).abs() < 1e-15);
        assert!((arc_ratio(0.25) - real::atanh(0.5) / 0.5).abs() < 1e-15);
    }

    #[test]
    fn series_and_functions_agree_where_they_meet() {
        for x in [1.0f64, -1.0] {
            assert!((sine_ratio(x) - sine_ratio(x * (1.0 - 1e-16))).abs() < 1e-15);
        }
        for x in [0.01f64, -0.01] {
            assert!((arc_ratio(x) - arc_ratio(x * (1.0 - 1e-15))).abs() < 1e-15);
        }
    }
}
