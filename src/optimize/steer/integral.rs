//! Position along a piece: the unit-time integral of ds (cos, sin) of the heading, and its derivatives by the data of heading and
//! arc length.
//!
//! Trapezoids with the end correction of Euler and Maclaurin: of fourth order in the step, from values that the limits need
//! anyway.

use super::hermite::{Basis, DATA};
use crate::math::real;

/// Derivatives by the data of heading, then of arc length.
pub(super) type ByData = [f64; 2 * DATA];

/// What the integrand is made of at one sample.
#[derive(Clone, Copy)]
struct Place<'t> {
    basis: &'t Basis,
    /// First and second derivative of the arc length in unit time.
    speed: f64,
    acceleration: f64,
    /// First derivative of the heading in unit time.
    turn: f64,
    sin: f64,
    cos: f64,
}

impl Place<'_> {
    fn along(&self) -> [f64; 2] {
        [self.cos, self.sin]
    }

    fn across(&self) -> [f64; 2] {
        [-self.sin, self.cos]
    }

    fn slope(&self, axis: usize) -> f64 {
        self.acceleration * self.along()[axis] + self.speed * self.turn * self.across()[axis]
    }

    fn by(&self, axis: usize) -> ByData {
        let (along, across) = (self.along()[axis], self.speed * self.across()[axis]);
        let [values, slopes, ..] = &self.basis.rows;
        let mut by = [0.0; 2 * DATA];
        for k in 0..DATA {
            by[k] = across * values[k];
            by[DATA + k] = along * slopes[k];
        }
        by
    }

    fn slope_by(&self, axis: usize) -> ByData {
        let (along, across) = (self.along()[axis], self.across()[axis]);
        let [values, slopes, bends, _] = &self.basis.rows;
        let own = self.acceleration * across - self.speed * self.turn * along;
        let mut by = [0.0; 2 * DATA];
        for k in 0..DATA {
            by[k] = own * values[k] + self.speed * across * slopes[k];
            by[DATA + k] = along * bends[k] + self.turn * across * slopes[k];
        }
        by
    }
}

/// The integral up to the last sample that was handed in.
pub(super) struct Integral<'t> {
    step: f64,
    /// Half the first integrand and all after it, the last one left out.
    sum: [f64; 2],
    sum_by: [ByData; 2],
    ends: Option<(Place<'t>, Place<'t>)>,
    /// Half at the first sample, then 1.
    share: f64,
}

impl<'t> Integral<'t> {
    /// Of samples `step` apart in unit time.
    pub fn new(step: f64) -> Self {
        Self { step, sum: [0.0; 2], sum_by: [[0.0; 2 * DATA]; 2], ends: None, share: 0.5 }
    }

    /// Goes on to the next sample, with the heading's and the arc length's value and derivatives in unit time.
    pub fn advance(&mut self, basis: &'t Basis, heading: &[f64; 4], arc: &[f64; 4]) {
        let (sin, cos) = real::sin_cos(heading[0]);
        let next = Place { basis, speed: arc[1], acceleration: arc[2], turn: heading[1], sin, cos };
        let Some((first, last)) = self.ends else {
            self.ends = Some((next, next));
            return;
        };
        let (along, share) = (last.along(), self.share);
        for (axis, along) in along.into_iter().enumerate() {
            self.sum[axis] += share * last.speed * along;
            for (sum, by) in self.sum_by[axis].iter_mut().zip(&last.by(axis)) {
                *sum += share * by;
            }
        }
        self.share = 1.0;
        self.ends = Some((first, next));
    }

    /// Cosine and sine of the heading at the last sample.
    pub fn direction(&self) -> [f64; 2] {
        self.ends.as_ref().map_or([1.0, 0.0], |(_, last)| last.along())
    }

    /// From the piece's start to the last sample, m.
    pub fn position(&self) -> [f64; 2] {
        let (Some((first, last)), 1.0) = (&self.ends, self.share) else { return [0.0; 2] };
        let correction = self.step * self.step / 12.0;
        std::array::from_fn(|axis| {
            self.step * (self.sum[axis] + 0.5 * last.speed * last.along()[axis])
                + correction * (first.slope(axis) - last.slope(axis))
        })
    }

    /// Derivatives of [`Self::position`].
    pub fn by_data(&self, axis: usize) -> ByData {
        let (Some((first, last)), 1.0) = (&self.ends, self.share) else { return [0.0; 2 * DATA] };
        let correction = self.step * self.step / 12.0;
        let (own, from, to) = (last.by(axis), first.slope_by(axis), last.slope_by(axis));
        let mut by = [0.0; 2 * DATA];
        for k in 0..2 * DATA {
            by[k] = self.step * (self.sum_by[axis][k] + 0.5 * own[k]) + correction * (from[k] - to[k]);
        }
        by
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::fd::{numeric_gradient, relative_error};

    const HEADING: [f64; DATA] = [0.3, 0.4, -1.0, 1.5, 0.2, 0.7];
    const ARC: [f64; DATA] = [0.0, 0.5, 0.3, 0.9, 1.1, -0.4];

    fn bases(samples: usize) -> Vec<Basis> {
        (0..=samples).map(|j| Basis::new(j as f64 / samples as f64)).collect()
    }

    fn run<'t>(data: &[f64], bases: &'t [Basis]) -> Integral<'t> {
        let split = |from: usize| std::array::from_fn(|k| data[from + k]);
        let (heading, arc): ([f64; DATA], [f64; DATA]) = (split(0), split(DATA));
        let mut integral = Integral::new(1.0 / (bases.len() - 1) as f64);
        for basis in bases {
            integral.advance(basis, &basis.at(&heading), &basis.at(&arc));
        }
        integral
    }

    fn data() -> Vec<f64> {
        HEADING.into_iter().chain(ARC).collect()
    }

    #[test]
    fn the_error_falls_with_the_fourth_power_of_the_step() {
        let exact = run(&data(), &bases(4000)).position();
        let error = |samples: usize| {
            let found = run(&data(), &bases(samples)).position();
            real::hypot(found[0] - exact[0], found[1] - exact[1])
        };
        assert!(error(10) < 1e-5, "{}", error(10));
        let order = real::log2(error(10) / error(20));
        assert!((order - 4.0).abs() < 0.3, "{order}");
    }

    #[test]
    fn its_derivatives_match_finite_differences() {
        let bases = bases(9);
        for axis in 0..2 {
            let numeric = numeric_gradient(|x| run(x, &bases).position()[axis], &data(), 1e-3);
            assert!(relative_error(&run(&data(), &bases).by_data(axis), &numeric, 1e-3) < 1e-8);
        }
    }

    #[test]
    fn nothing_is_passed_at_the_first_sample() {
        let mut integral = Integral::new(0.1);
        let basis = Basis::new(0.0);
        integral.advance(&basis, &basis.at(&HEADING), &basis.at(&ARC));
        assert_eq!((integral.position(), integral.by_data(1)), ([0.0; 2], [0.0; 2 * DATA]));
    }
}
