//! Sets of postures as bit masks.

/// A set of postures: bit p is posture p.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Bits<const W: usize>([u64; W]);

impl<const W: usize> Bits<W> {
    pub const EMPTY: Self = Self([0; W]);

    /// The first `count` postures.
    pub fn all(count: usize) -> Self {
        Self(std::array::from_fn(|w| match count.saturating_sub(64 * w) {
            0 => 0,
            rest @ 1..64 => (1 << rest) - 1,
            _ => u64::MAX,
        }))
    }

    pub fn insert(&mut self, posture: usize) {
        self.0[posture / 64] |= 1 << (posture % 64);
    }

    pub fn remove(&mut self, posture: usize) {
        self.0[posture / 64] &= !(1 << (posture % 64));
    }

    pub fn contains(&self, posture: usize) -> bool {
        self.0[posture / 64] >> (posture % 64) & 1 == 1
    }

    pub fn is_empty(&self) -> bool {
        self.0.iter().all(|w| *w == 0)
    }

    pub fn and(self, other: Self) -> Self {
        Self(std::array::from_fn(|w| self.0[w] & other.0[w]))
    }

    pub fn or(self, other: Self) -> Self {
        Self(std::array::from_fn(|w| self.0[w] | other.0[w]))
    }

    pub fn minus(self, other: Self) -> Self {
        Self(std::array::from_fn(|w| self.0[w] & !other.0[w]))
    }

    /// Members in ascending order.
    pub fn iter(self) -> impl Iterator<Item = usize> {
        (0..W).flat_map(move |w| {
            let mut word = self.0[w];
            std::iter::from_fn(move || {
                (word != 0).then(|| {
                    let bit = word.trailing_zeros() as usize;
                    word &= word - 1;
                    w * 64 + bit
                })
            })
        })
    }

    /// Every member moved `by` places up.
    pub fn up(self, by: usize) -> Self {
        let (words, bits) = (by / 64, by % 64);
        Self(std::array::from_fn(|w| {
            let low = |k: usize| if w >= k { self.0[w - k] } else { 0 };
            if bits == 0 { low(words) } else { low(words) << bits | low(words + 1) >> (64 - bits) }
        }))
    }

    /// Every member moved `by` places down.
    pub fn down(self, by: usize) -> Self {
        let (words, bits) = (by / 64, by % 64);
        Self(std::array::from_fn(|w| {
            let high = |k: usize| self.0.get(w + k).copied().unwrap_or(0);
            if bits == 0 { high(words) } else { high(words) >> bits | high(words + 1) << (64 - bits) }
        }))
    }
}
