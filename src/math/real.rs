//! Functions of real numbers that have the same bits on every machine.
//!
//! Those of `std` (`f64::sin` and its like) are the system's: glibc, musl, macOS and Windows differ in the last digit, and glibc takes
//! other code where the processor has fused multiply-add. These are plain arithmetic, which IEEE 754 rounds in one way only: the
//! pure-Rust [`libm`] crate, a port of musl's. `clippy.toml` forbids the others. What IEEE 754 defines exactly (`sqrt`, `floor`,
//! `round`, `abs`, `%`) stays `std`'s.

pub use libm::{asin, asinh, atan, atan2, atanh, cbrt, cos, exp, log2, log10, sin, sinh, tan};
pub use libm::{log as ln, pow as powf, sincos as sin_cos};

/// Length of the vector (`x`, `y`), within 1.2 units in the last place.
///
/// Plain where squares neither overflow nor lose digits: three times as fast as libm's, which is for the rest.
#[inline]
pub fn hypot(x: f64, y: f64) -> f64 {
    let squared = x * x + y * y;
    if (1e-280..1e300).contains(&squared) { squared.sqrt() } else { libm::hypot(x, y) }
}

/// `x` to a whole power, by repeated squaring from the lowest bit of `power` up; a negative one is the reciprocal of the positive one.
///
/// `f64::powi` promises no particular rounding: what it becomes is the compiler's and the platform's choice.
#[inline]
pub fn powi(x: f64, power: i32) -> f64 {
    let (mut product, mut square, mut left) = (1.0, x, power.unsigned_abs());
    while left > 1 {
        if left % 2 == 1 {
            product *= square;
        }
        square *= square;
        left /= 2;
    }
    if left == 1 {
        product *= square;
    }
    if power < 0 { 1.0 / product } else { product }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::noise::Noise;

    /// Distance in units in the last place of `right`.
    fn off(value: f64, right: f64) -> f64 {
        if value == right { 0.0 } else { (value - right).abs() / (right.abs().next_up() - right.abs()) }
    }

    #[test]
    #[allow(clippy::disallowed_methods, reason = "what they are compared with")]
    fn they_are_the_systems_functions_but_for_the_last_digits() {
        type Pair = (&'static str, fn(f64) -> f64, fn(f64) -> f64, f64, f64);
        let pairs: [Pair; 13] = [
            ("sin", sin, f64::sin, -1e3, 1e3),
            ("cos", cos, f64::cos, -1e3, 1e3),
            ("tan", tan, f64::tan, -1e3, 1e3),
            ("asin", asin, f64::asin, -1.0, 1.0),
            ("atan", atan, f64::atan, -50.0, 50.0),
            ("sinh", sinh, f64::sinh, -20.0, 20.0),
            ("asinh", asinh, |x| f64::ln(x + (x * x + 1.0).sqrt()), 0.5, 50.0),
            ("atanh", atanh, |x| 0.5 * f64::ln((1.0 + x) / (1.0 - x)), 0.5, 0.999),
            ("exp", exp, f64::exp, -40.0, 40.0),
            ("ln", ln, f64::ln, 1e-9, 1e9),
            ("log10", log10, f64::log10, 1e-9, 1e9),
            ("log2", log2, f64::log2, 1e-9, 1e9),
            ("cbrt", cbrt, f64::cbrt, -1e6, 1e6),
        ];
        let mut noise = Noise::new(31);
        for (name, own, system, low, high) in pairs {
            for _ in 0..2000 {
                let x = low + (high - low) * noise.uniform();
                // Written out by hand, the last two lose a few digits to cancellation.
                let most = if matches!(name, "asinh" | "atanh") { 8.0 } else { 2.0 };
                assert!(off(own(x), system(x)) <= most, "{name}({x:e}): {:e}, {:e}", own(x), system(x));
            }
        }
        for _ in 0..2000 {
            let [x, y] = [noise.uniform() * 20.0 - 10.0, noise.uniform() * 20.0 - 10.0];
            assert!(off(atan2(y, x), f64::atan2(y, x)) <= 2.0, "atan2({y:e}, {x:e})");
            assert!(off(hypot(x, y), f64::hypot(x, y)) <= 2.0, "hypot({x:e}, {y:e})");
            assert!(off(powf(x.abs(), y), f64::powf(x.abs(), y)) <= 2.0, "powf({:e}, {y:e})", x.abs());
            assert_eq!(sin_cos(x), (sin(x), cos(x)));
        }
    }

    #[test]
    fn lengths_neither_overflow_nor_vanish() {
        assert_eq!(hypot(3.0, -4.0), 5.0);
        assert_eq!(hypot(-0.7, 0.0), 0.7);
        for scale in [1e-320, 1e-200, 1e-150, 1e-140, 1e149, 1e150, 1e200, 1e307] {
            assert!((hypot(3.0 * scale, 4.0 * scale) / scale / 5.0 - 1.0).abs() < 1e-3, "{scale:e}");
        }
        assert_eq!(hypot(0.0, -0.0), 0.0);
        assert_eq!(hypot(f64::INFINITY, f64::NAN), f64::INFINITY);
        assert!(hypot(1.0, f64::NAN).is_nan());
    }

    #[test]
    fn whole_powers_are_products() {
        for x in [-2.0, -0.3, 0.1, 1.7] {
            assert_eq!(powi(x, 0), 1.0);
            assert_eq!(powi(x, 1), x);
            assert_eq!(powi(x, 2), x * x);
            assert_eq!(powi(x, 3), x * (x * x));
            assert_eq!(powi(x, 4), (x * x) * (x * x));
            assert_eq!(powi(x, 5), x * ((x * x) * (x * x)));
            assert_eq!(powi(x, -2), 1.0 / (x * x));
        }
        for k in 0..1023 {
            assert_eq!(powi(2.0, k), f64::from_bits((1023 + k as u64) << 52));
            assert_eq!(powi(2.0, -k) * powi(2.0, k), 1.0);
        }
        assert_eq!(powi(1.0, i32::MIN), 1.0);
    }

    // Ticks of plots and digits of figures go by these.
    #[test]
    fn powers_of_ten_are_exact_and_so_are_their_logarithms() {
        for k in 0..=22 {
            let power: f64 = format!("1e{k}").parse().expect("a number");
            assert_eq!((powi(10.0, k), powf(10.0, f64::from(k)), log10(power)), (power, power, f64::from(k)));
            let part: f64 = format!("1e-{k}").parse().expect("a number");
            assert_eq!(log10(part), -f64::from(k), "1e-{k}");
        }
    }
}
