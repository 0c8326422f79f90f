//! A small generator of random numbers: the same on every machine, seeded per scene.

/// SplitMix64 (Steele, Lea, Flood 2014): one 64-bit counter, mixed.
#[derive(Debug, Clone)]
pub struct Rng(u64);

/// The golden ratio's fraction in 64 bits, made odd: the counter's step.
const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

impl Rng {
    /// A stream of its own for each list of seeds.
    pub fn new(seeds: &[u64]) -> Self {
        let mut rng = Self(seeds.len() as u64);
        for seed in seeds {
            rng.0 = rng.next() ^ seed.wrapping_mul(STEP);
        }
        rng
    }

    /// 64 random bits.
    pub fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(STEP);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform over `low..=high`.
    pub fn integer(&mut self, low: i32, high: i32) -> i32 {
        debug_assert!(low <= high);
        let count = u128::from(high.abs_diff(low)) + 1;
        // The bias of the multiplication is below 2^-32.
        low + ((u128::from(self.next()) * count) >> 64) as i32
    }

    /// Uniform over `[low, high)`.
    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.next() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_stream_is_splitmix64() {
        // First outputs for seed 1234567, as published with the algorithm.
        let mut rng = Rng(1_234_567);
        assert_eq!([rng.next(), rng.next()], [6_457_827_717_110_365_317, 3_203_168_211_198_807_973]);
    }

    #[test]
    fn integers_reach_both_ends_evenly() {
        let mut rng = Rng::new(&[1, 2]);
        let mut counts = [0; 5];
        (0..5000).for_each(|_| counts[(rng.integer(-2, 2) + 2) as usize] += 1);
        assert!(counts.iter().all(|n| (850..1150).contains(n)), "{counts:?}");
        assert_eq!(rng.integer(7, 7), 7);
    }

    #[test]
    fn every_seed_has_its_own_stream() {
        let first = |seeds: &[u64]| Rng::new(seeds).next();
        let all = [first(&[1, 2]), first(&[2, 1]), first(&[1, 3]), first(&[1]), first(&[0, 1, 2])];
        assert!((0..all.len()).all(|i| !all[..i].contains(&all[i])));
    }
}
