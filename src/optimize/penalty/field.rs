//! What the optimiser asks of a distance field.

use nalgebra::Vector3;

use crate::esdf::least_of_points;

/// A signed distance to obstacles, m.
pub trait DistanceField {
    /// Distance at a point in the map frame.
    fn distance(&self, p: [f64; 3]) -> f64;
    /// Distance and its gradient.
    fn distance_gradient(&self, p: [f64; 3]) -> (f64, [f64; 3]);
    /// Size of a cell that values are interpolated over, m; 0 for an exact field.
    fn cell(&self) -> f64;
    /// Least distance on an upright line of `rise` m from `foot` up, and its gradient by x and y (its third part is 0). Here: at
    /// places a cell apart, both ends among them.
    fn least_above(&self, foot: [f64; 3], rise: f64) -> (f64, [f64; 3]) {
        let steps = if self.cell() > 0.0 { (rise / self.cell()).ceil().max(1.0) } else { 16.0 };
        least_of_points(foot, rise, steps as usize, |p| self.distance_gradient(p))
    }
}

impl DistanceField for crate::esdf::Esdf {
    fn distance(&self, p: [f64; 3]) -> f64 {
        self.distance(p)
    }
    fn distance_gradient(&self, p: [f64; 3]) -> (f64, [f64; 3]) {
        self.distance_gradient(p)
    }
    fn cell(&self) -> f64 {
        self.resolution
    }
    fn least_above(&self, foot: [f64; 3], rise: f64) -> (f64, [f64; 3]) {
        self.least_above(foot, rise)
    }
}

/// Distance and gradient at a contour point that is at `at` in the map.
pub(super) fn look_up(field: &impl DistanceField, at: Vector3<f64>, rise: f64) -> (f64, [f64; 3]) {
    if rise > 0.0 { field.least_above(at.into(), rise) } else { field.distance_gradient(at.into()) }
}
