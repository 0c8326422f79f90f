//! The least of a distance over time: looked at ever more often where it is small, with what can happen between two looks (nothing is
//! faster than a known speed) as the remainder.

use super::solid::Bounds;

/// What is known of a least distance, m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bracket {
    /// Not less than this.
    pub lower: f64,
    /// Met at an instant: not more than this.
    pub upper: f64,
}

/// What a hunt is after.
#[derive(Debug, Clone, Copy)]
pub(super) enum Wanted {
    /// The least distance, up to this, m.
    Value(f64),
    /// Whether it is at least this, m.
    AtLeast(f64),
}

/// A hunt for a least distance.
pub(super) struct Hunt {
    wanted: Wanted,
    upper: f64,
    /// Least bound of what was settled.
    settled: f64,
    looks: u64,
    most: u64,
}

/// An interval: its middle, half of it, and what may come near in it.
struct Part<T> {
    middle: f64,
    half: f64,
    things: Vec<T>,
    bound: f64,
}

impl Hunt {
    /// With at most so many distances.
    pub(super) fn new(wanted: Wanted, most: u64) -> Self {
        Self { wanted, upper: f64::INFINITY, settled: f64::INFINITY, looks: 0, most }
    }

    /// A distance at an instant.
    pub(super) fn met(&mut self, upper: f64) {
        self.upper = self.upper.min(upper);
    }

    /// What is known now.
    pub(super) fn bracket(&self) -> Bracket {
        let lower = self.settled.min(self.upper).max(0.0);
        Bracket { lower, upper: self.upper }
    }

    /// Whether nothing more needs to be known.
    pub(super) fn over(&self) -> bool {
        match self.wanted {
            Wanted::Value(_) => self.upper <= 0.0,
            Wanted::AtLeast(wanted) => self.upper < wanted,
        }
    }

    /// What an interval must keep for no more to be asked of it, m.
    pub(super) fn needed(&self) -> f64 {
        match self.wanted {
            Wanted::Value(width) => self.upper - width,
            Wanted::AtLeast(wanted) => wanted,
        }
    }

    /// Looks at `span` seconds in which no distance changes faster than `fastest` m/s. `place`: what moves, at an instant; `measure`: its
    /// distance from a thing, or only a lower bound where that is above the last argument.
    pub(super) fn over_time<P, T: Copy>(
        &mut self,
        span: f64,
        fastest: f64,
        things: Vec<T>,
        place: impl Fn(f64) -> P,
        measure: impl Fn(&P, T, f64) -> Bounds,
    ) {
        let mut left = vec![Part { middle: 0.5 * span, half: 0.5 * span, things, bound: 0.0 }];
        while let Some(part) = left.pop() {
            if self.over() {
                self.settled = 0.0;
                return;
            }
            let may = fastest * part.half;
            if part.bound >= self.needed() {
                self.settled = self.settled.min(part.bound);
                continue;
            }
            if self.looks > self.most {
                self.settled = self.settled.min(part.bound);
                continue;
            }
            let placed = place(part.middle);
            let (mut open, mut bound) = (Vec::new(), f64::INFINITY);
            for thing in &part.things {
                self.looks += 1;
                let [lower, upper] = measure(&placed, *thing, self.needed() + may);
                self.met(upper);
                let kept = (lower - may).max(0.0);
                if kept >= self.needed() {
                    self.settled = self.settled.min(kept);
                } else {
                    bound = bound.min(kept);
                    open.push(*thing);
                }
            }
            if open.is_empty() {
                continue;
            }
            if may < 1e-10 {
                self.settled = self.settled.min(bound);
                continue;
            }
            let half = 0.5 * part.half;
            let halves = |sign: f64, things| Part { middle: part.middle + sign * half, half, things, bound };
            left.push(halves(1.0, open.clone()));
            left.push(halves(-1.0, open));
        }
    }
}
