//! Gauss-Legendre quadrature with ten nodes.

/// Positive nodes on [-1, 1] and their weights (Abramowitz & Stegun, table 25.4).
const NODES: [(f64, f64); 5] = [
    (0.148_874_338_981_631_2, 0.295_524_224_714_752_9),
    (0.433_395_394_129_247_2, 0.269_266_719_309_996_35),
    (0.679_409_568_299_024_4, 0.219_086_362_515_982_04),
    (0.865_063_366_688_984_5, 0.149_451_349_150_580_6),
    (0.973_906_528_517_171_7, 0.066_671_344_308_688_14),
];

/// The integral of `f` from `from` to `to`: exact for polynomials up to degree 19.
pub fn gauss_legendre(from: f64, to: f64, mut f: impl FnMut(f64) -> f64) -> f64 {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    // The outermost nodes come first: their terms are the smallest.
    half * NODES.iter().rev().map(|(x, w)| w * (f(middle - half * x) + f(middle + half * x))).sum::<f64>()
}

/// [`gauss_legendre`] of two functions that are evaluated together.
pub fn gauss_legendre_2(from: f64, to: f64, mut f: impl FnMut(f64) -> [f64; 2]) -> [f64; 2] {
    let (middle, half) = (0.5 * (from + to), 0.5 * (to - from));
    let mut sum = [0.0; 2];
    for (x, w) in NODES.iter().rev() {
        let (low, high) = (f(middle - half * x), f(middle + half * x));
        (0..2).for_each(|k| sum[k] += w * (low[k] + high[k]));
    }
    sum.map(|sum| half * sum)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::real;

    #[test]
    fn polynomials_up_to_degree_nineteen_are_exact() {
        for degree in 0..20 {
            let numeric = gauss_legendre(-0.3, 1.2, |x| real::powi(x, degree));
            let n = f64::from(degree + 1);
            let exact = (real::powf(1.2, n) - real::powi(-0.3, degree + 1)) / n;
            assert!((numeric - exact).abs() < 2e-14 * exact.abs().max(1.0), "degree {degree}: {numeric} vs {exact}");
        }
    }

    #[test]
    fn an_interval_run_backwards_changes_the_sign() {
        let forth = gauss_legendre(0.0, 2.0, real::exp);
        assert!((forth - (real::exp(2.0) - 1.0)).abs() < 1e-14);
        assert_eq!(forth, -gauss_legendre(2.0, 0.0, real::exp));
    }

    #[test]
    fn two_functions_together_are_those_functions() {
        let both = gauss_legendre_2(0.3, 1.9, |x| [real::cos(x), real::exp(x)]);
        assert_eq!(both, [gauss_legendre(0.3, 1.9, real::cos), gauss_legendre(0.3, 1.9, real::exp)]);
    }
}
