//! Finite differences, for tests only.

/// Gradient by the sixth-order central difference with step `step` in every coordinate.
pub fn numeric_gradient(mut f: impl FnMut(&[f64]) -> f64, x: &[f64], step: f64) -> Vec<f64> {
    let mut probe = x.to_vec();
    (0..x.len())
        .map(|i| {
            let mut at = |offset: f64| {
                probe[i] = x[i] + offset * step;
                let value = f(&probe);
                probe[i] = x[i];
                value
            };
            let one = at(1.0) - at(-1.0);
            let two = at(2.0) - at(-2.0);
            let three = at(3.0) - at(-3.0);
            (45.0 * one - 9.0 * two + three) / (60.0 * step)
        })
        .collect()
}

/// Largest difference of two vectors, relative to the largest entry of the second (at least `floor`).
pub fn relative_error(a: &[f64], b: &[f64], floor: f64) -> f64 {
    let scale = b.iter().fold(floor, |m, v| m.max(v.abs()));
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max) / scale
}
