//! Normal numbers from a fixed seed, for tests of what must bear noise.

use super::real;

/// A stream of normal numbers.
pub struct Noise(u64);

impl Noise {
    /// A stream of its own for each seed.
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }

    /// Uniform in (0, 1]: SplitMix64 (Steele, Lea, Flood 2014).
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11).wrapping_add(1) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Of mean 0 and variance 1: Box and Muller 1958.
    pub fn normal(&mut self) -> f64 {
        (-2.0 * real::ln(self.uniform())).sqrt() * real::cos(std::f64::consts::TAU * self.uniform())
    }

    /// Three of them.
    pub fn normals(&mut self) -> [f64; 3] {
        [self.normal(), self.normal(), self.normal()]
    }
}

#[test]
fn mean_variance_and_kurtosis_are_those_of_normal_numbers() {
    let mut noise = Noise::new(1);
    let all: Vec<f64> = (0..20_000).map(|_| noise.normal()).collect();
    let moment = |power: i32| all.iter().map(|v| real::powi(*v, power)).sum::<f64>() / all.len() as f64;
    // Four standard errors: roots of 1, 2 and 96 over the count.
    let error = |variance: f64| 4.0 * (variance / all.len() as f64).sqrt();
    assert!(
        moment(1).abs() < error(1.0) && (moment(2) - 1.0).abs() < error(2.0) && (moment(4) - 3.0).abs() < error(96.0)
    );
}
