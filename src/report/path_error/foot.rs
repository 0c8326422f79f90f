//! The foot of a point on a curve.

use crate::math::real;

/// A step along the path that changes no distance that anyone reads, m.
const NO_STEP: f64 = 1e-11;

/// Distance from a point to the part of a curve between two parameters, from a first guess between them: Newton's steps on the
/// foot's condition, halving the bracket where a step leaves it (at rest and near it the parameter is far from arc length).
/// `jets`: x and y with two derivatives by the parameter.
pub(super) fn distance_to_curve(
    jets: impl Fn(f64) -> [[f64; 3]; 2],
    [mut low, mut u, mut high]: [f64; 3],
    point: [f64; 2],
) -> f64 {
    let mut best = f64::INFINITY;
    let mut seen = [false; 2];
    for _ in 0..40 {
        let [x, y] = jets(u);
        let offset = [x[0] - point[0], y[0] - point[1]];
        best = best.min(real::hypot(offset[0], offset[1]));
        let slope = offset[0] * x[1] + offset[1] * y[1];
        let bend = x[1] * x[1] + y[1] * y[1] + offset[0] * x[2] + offset[1] * y[2];
        if slope > 0.0 {
            (high, seen[1]) = (u, true);
        } else {
            (low, seen[0]) = (u, true);
        }
        let newton = u - slope / bend;
        // Beyond an end where nobody was yet, the foot may be that end.
        let next = match bend > 0.0 {
            true if newton > low && newton < high => newton,
            true if newton <= low && !seen[0] => low,
            true if newton >= high && !seen[1] => high,
            _ => 0.5 * (low + high),
        };
        let step = next - u;
        u = next;
        // What is left changes the distance by the square of the step, over the distance, and by no more than the step.
        let speed = x[1] * x[1] + y[1] * y[1];
        if step * step * speed <= (1e-9 * best * best).max(NO_STEP * NO_STEP) || step == 0.0 {
            break;
        }
    }
    best
}
