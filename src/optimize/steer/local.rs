//! Gradient and Gauss-Newton Hessian of one piece in its own coordinates.

use super::hermite::DATA;
use super::integral::ByData;
use super::layout::Layout;

/// Sums of squares; see [`Layout::local_size`] for the coordinates.
pub(super) struct Local {
    pub size: usize,
    /// Index of the logarithm of the duration.
    pub time: usize,
    pub gradient: Vec<f64>,
    /// Lower triangle, row by row.
    pub hessian: Vec<f64>,
}

impl Local {
    pub fn new(layout: Layout) -> Self {
        let size = layout.local_size();
        Self { size, time: layout.local_time(), gradient: vec![0.0; size], hessian: vec![0.0; size * size] }
    }

    pub fn clear(&mut self) {
        self.gradient.fill(0.0);
        self.hessian.fill(0.0);
    }

    /// Adds a term by the logarithm of the duration alone.
    pub fn add_time(&mut self, slope: f64, curvature: f64) {
        self.gradient[self.time] += slope;
        self.hessian[self.time * self.size + self.time] += curvature;
    }

    /// Adds a term of this Jacobian: `slope` and `curvature` by its value.
    pub fn add(&mut self, jacobian: &[f64], slope: f64, curvature: f64) {
        for (i, own) in jacobian.iter().enumerate() {
            if *own == 0.0 {
                continue;
            }
            self.gradient[i] += slope * own;
            let scaled = curvature * own;
            let row = &mut self.hessian[i * self.size..i * self.size + i + 1];
            for (value, other) in row.iter_mut().zip(jacobian) {
                *value += scaled * other;
            }
        }
    }

    /// Adds half the weighted square of `value`, which heading and arc length move by `by`, and the logarithm of the duration by
    /// `by_time` (its share in the weight included). Returns the cost.
    pub fn square_of_base(&mut self, by: &ByData, by_time: f64, value: f64, weight: f64) -> f64 {
        let time = self.time * self.size;
        let force = weight * value;
        for (i, own) in by.iter().enumerate() {
            self.gradient[i] += force * own;
            self.hessian[time + i] += weight * by_time * own;
            let scaled = weight * own;
            let row = &mut self.hessian[i * self.size..i * self.size + i + 1];
            for (entry, other) in row.iter_mut().zip(by) {
                *entry += scaled * other;
            }
        }
        self.add_time(force * by_time, weight * by_time * by_time);
        0.5 * force * value
    }

    /// Adds a curvature by the heading alone, where it is positive.
    pub fn bend(&mut self, by: &[f64; DATA], curvature: f64) {
        if curvature <= 0.0 {
            return;
        }
        for (i, own) in by.iter().enumerate() {
            let scaled = curvature * own;
            for (entry, other) in self.hessian[i * self.size..i * self.size + i + 1].iter_mut().zip(by) {
                *entry += scaled * other;
            }
        }
    }

    /// The same for one dimension, whose data begin at `first`.
    pub fn square_of_joint(&mut self, first: usize, by: &[f64; DATA], by_time: f64, value: f64, weight: f64) -> f64 {
        let time = self.time * self.size;
        let force = weight * value;
        for (i, own) in by.iter().enumerate() {
            self.gradient[first + i] += force * own;
            self.hessian[time + first + i] += weight * by_time * own;
            let scaled = weight * own;
            let at = (first + i) * self.size + first;
            for (entry, other) in self.hessian[at..at + i + 1].iter_mut().zip(by) {
                *entry += scaled * other;
            }
        }
        self.add_time(force * by_time, weight * by_time * by_time);
        0.5 * force * value
    }

    /// Takes in what the duration does to the data: their derivative by its logarithm is `stretch`.
    pub fn stretch(&mut self, stretch: &[f64], product: &mut [f64]) {
        let (size, time) = (self.size, self.time);
        product[..time].fill(0.0);
        for i in 0..time {
            let row = &self.hessian[i * size..i * size + i];
            let mut sum = self.hessian[i * size + i] * stretch[i];
            for ((entry, s), target) in row.iter().zip(stretch).zip(product.iter_mut()) {
                sum += entry * s;
                *target += entry * stretch[i];
            }
            product[i] += sum;
        }
        let row = &mut self.hessian[time * size..time * size + time + 1];
        let mut own = 0.0;
        for ((entry, s), product) in row.iter_mut().zip(stretch).zip(product.iter()) {
            own += s * (2.0 * *entry + product);
            *entry += product;
        }
        row[time] += own;
        self.gradient[time] += stretch.iter().zip(&self.gradient).map(|(s, g)| s * g).sum::<f64>();
        for below in time + 1..size {
            let row = &mut self.hessian[below * size..below * size + time + 1];
            row[time] += stretch.iter().zip(row.iter()).map(|(s, h)| s * h).sum::<f64>();
        }
    }
}
