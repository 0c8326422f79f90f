//! The postures that are searched: a grid over the moving joints, and sets of postures as bit masks.
//!
//! One joint has 64 values, so a set is one word; no joint is one posture; more joints share at most 1024 postures. All
//! code runs on `Bits<W>` and the grid's strides and knows no number of joints.

use crate::robot::RobotModel;

/// Postures are a grid over the joints' ranges.
#[derive(Debug, Clone)]
pub(super) struct PostureGrid {
    /// Sampled values of each joint, ascending.
    values: Vec<Vec<f64>>,
    /// Index distance of neighbours along each joint.
    strides: Vec<usize>,
    count: usize,
}

/// Most postures there can be: bits of the widest mask.
pub(super) const MOST_POSTURES: usize = 1024;

impl PostureGrid {
    /// The grid for a robot. A joint without limits is sampled one turn about `near`.
    pub fn new(robot: &RobotModel, near: &[f64]) -> Self {
        let per_joint = match robot.joints.len() {
            0 | 1 => 64,
            n => (2..=64usize).rev().find(|k| k.pow(n as u32) <= MOST_POSTURES).unwrap_or(1),
        };
        let mut strides = Vec::new();
        let mut count = 1;
        let mut values = Vec::new();
        for (joint, near) in robot.joints.iter().zip(near) {
            let lower = if joint.lower.is_finite() { joint.lower } else { near - std::f64::consts::PI };
            let upper = if joint.upper.is_finite() { joint.upper } else { near + std::f64::consts::PI };
            let samples = if upper > lower { per_joint } else { 1 };
            let step = (upper - lower) / (samples.max(2) - 1) as f64;
            values.push((0..samples).map(|k| if k + 1 == samples { upper } else { lower + step * k as f64 }).collect());
            strides.push(count);
            count *= samples;
        }
        Self { values, strides, count }
    }

    pub fn count(&self) -> usize {
        self.count
    }

    /// Joint values of a posture.
    pub fn joints(&self, posture: usize) -> Vec<f64> {
        self.values.iter().zip(&self.strides).map(|(v, stride)| v[posture / stride % v.len()]).collect()
    }

    /// The posture nearest to given joint values.
    pub fn nearest(&self, joints: &[f64]) -> usize {
        let mut posture = 0;
        for ((values, stride), wanted) in self.values.iter().zip(&self.strides).zip(joints) {
            let distance = |k: &usize| (values[*k] - wanted).abs();
            let best = (0..values.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
            posture += best * stride;
        }
        posture
    }

    /// Number of sampled values and index distance of neighbours, per joint.
    pub fn axes(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.values.iter().zip(&self.strides).map(|(v, s)| (v.len(), *s))
    }

    /// Postures with one of these joints at an end of its range.
    pub fn brinks<const W: usize>(&self, joints: impl Iterator<Item = usize>) -> Bits<W> {
        let mut out = Bits::EMPTY;
        for joint in joints {
            let (count, stride) = (self.values[joint].len(), self.strides[joint]);
            let at_end = |p: &usize| [0, count - 1].contains(&(p / stride % count));
            // A joint with one value has nowhere to go.
            (0..self.count).filter(|p| count > 1 && at_end(p)).for_each(|p| out.insert(p));
        }
        out
    }

    /// Distance between neighbouring values of a joint.
    pub fn step(&self, joint: usize) -> f64 {
        let v = &self.values[joint];
        if v.len() > 1 { v[1] - v[0] } else { 0.0 }
    }
}

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
    fn up(self, by: usize) -> Self {
        let (words, bits) = (by / 64, by % 64);
        Self(std::array::from_fn(|w| {
            let low = |k: usize| if w >= k { self.0[w - k] } else { 0 };
            if bits == 0 { low(words) } else { low(words) << bits | low(words + 1) >> (64 - bits) }
        }))
    }

    /// Every member moved `by` places down.
    fn down(self, by: usize) -> Self {
        let (words, bits) = (by / 64, by % 64);
        Self(std::array::from_fn(|w| {
            let high = |k: usize| self.0.get(w + k).copied().unwrap_or(0);
            if bits == 0 { high(words) } else { high(words) >> bits | high(words + 1) << (64 - bits) }
        }))
    }
}

/// Neighbourhoods of sets of postures.
#[derive(Debug, Clone)]
pub(super) struct Neighbours<const W: usize> {
    /// Per joint: index distance, postures with a lower neighbour, postures with an upper one.
    axes: Vec<(usize, Bits<W>, Bits<W>)>,
}

impl<const W: usize> Neighbours<W> {
    pub fn new(grid: &PostureGrid) -> Self {
        let axes = grid.axes().map(|(count, stride)| {
            let mut ends = (Bits::EMPTY, Bits::EMPTY);
            for p in 0..grid.count() {
                let at = p / stride % count;
                if at > 0 {
                    ends.0.insert(p);
                }
                if at + 1 < count {
                    ends.1.insert(p);
                }
            }
            (stride, ends.0, ends.1)
        });
        Self { axes: axes.collect() }
    }

    /// The set and all postures one step away, within `free`.
    pub fn dilate(&self, set: Bits<W>, free: Bits<W>) -> Bits<W> {
        let mut out = set;
        for (stride, has_lower, has_upper) in &self.axes {
            out = out.or(set.and(*has_upper).up(*stride)).or(set.and(*has_lower).down(*stride));
        }
        out.and(free)
    }

    /// All postures that can be reached from the set by steps within `free`.
    pub fn flood(&self, set: Bits<W>, free: Bits<W>) -> Bits<W> {
        let mut reached = set.and(free);
        if reached == free {
            return reached;
        }
        loop {
            let next = self.dilate(reached, free);
            if next == reached {
                return reached;
            }
            reached = next;
        }
    }

    /// The neighbours of one posture.
    pub fn of(&self, posture: usize) -> impl Iterator<Item = usize> + '_ {
        self.axes.iter().flat_map(move |(stride, has_lower, has_upper)| {
            let lower = has_lower.contains(posture).then(|| posture - stride);
            let upper = has_upper.contains(posture).then(|| posture + stride);
            lower.into_iter().chain(upper)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn grid(counts: &[usize]) -> PostureGrid {
        let mut strides = Vec::new();
        let mut count = 1;
        for c in counts {
            strides.push(count);
            count *= c;
        }
        PostureGrid { values: counts.iter().map(|c| (0..*c).map(|k| k as f64).collect()).collect(), strides, count }
    }

    proptest! {
        #[test]
        fn flood_equals_a_plain_breadth_first_search(
            free in prop::collection::vec(any::<bool>(), 180), seeds in prop::collection::vec(0usize..180, 1..4),
        ) {
            let grid = grid(&[9, 5, 4]);
            let neighbours = Neighbours::<16>::new(&grid);
            let mut mask = Bits::EMPTY;
            (0..180).filter(|p| free[*p]).for_each(|p| mask.insert(p));
            let mut set = Bits::EMPTY;
            seeds.iter().for_each(|p| set.insert(*p));
            let mut expected: Vec<bool> = (0..180).map(|p| set.contains(p) && free[p]).collect();
            let mut queue: Vec<usize> = (0..180).filter(|p| expected[*p]).collect();
            while let Some(p) = queue.pop() {
                let at = [p % 9, p / 9 % 5, p / 45];
                for axis in 0..3 {
                    for step in [-1i32, 1] {
                        let mut next = at.map(|v| v as i32);
                        next[axis] += step;
                        if next[axis] < 0 || next[axis] >= [9, 5, 4][axis] {
                            continue;
                        }
                        let q = (next[0] + 9 * next[1] + 45 * next[2]) as usize;
                        if free[q] && !expected[q] {
                            expected[q] = true;
                            queue.push(q);
                        }
                    }
                }
            }
            let found = neighbours.flood(set, mask);
            prop_assert!((0..180).all(|p| found.contains(p) == expected[p]));
            prop_assert_eq!(found.iter().collect::<Vec<_>>(), (0..180).filter(|p| expected[*p]).collect::<Vec<_>>());
        }
    }

    #[test]
    fn the_nearest_posture_of_a_posture_is_itself() {
        let grid = grid(&[9, 5, 4]);
        for p in 0..180 {
            assert_eq!(grid.nearest(&grid.joints(p)), p);
        }
    }
}
