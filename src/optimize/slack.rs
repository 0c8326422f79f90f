//! Room for robots that are not the model's: obstacles count as nearer by what a robot within the tolerance may be off there.
//!
//! How far it may be off depends on how it came there, so it is known for a motion that was made before: the search's path at first, then
//! the last motion that was refused. Here it is looked up by place: of the parts of that motion that come near a place, the last one
//! counts. That is approximate; the certificate has the proof.

use super::DistanceField;
use crate::math::real;

/// How far robots may be off when the base is at a place of a motion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slack {
    /// Of the base, m.
    pub place: [f64; 2],
    /// By -1 to 1 times each of these, m,
    pub drift: [[f64; 2]; 4],
    /// with turns of the same sign about the base, rad,
    pub turning: [f64; 4],
    /// and by this in any direction, m.
    pub anywhere: f64,
}

impl Slack {
    /// How far a point at `p` may be off along `direction`, times its length in the plane, m.
    fn along(&self, p: [f64; 2], direction: [f64; 2]) -> f64 {
        let shifts = self.at(p).map(|s| (s[0] * direction[0] + s[1] * direction[1]).abs());
        shifts.iter().sum::<f64>() + self.anywhere
    }

    /// How far it may be off in any direction, or more, m.
    fn most(&self, p: [f64; 2]) -> f64 {
        self.at(p).map(|s| real::hypot(s[0], s[1])).iter().sum::<f64>() + self.anywhere
    }

    fn at(&self, p: [f64; 2]) -> [[f64; 2]; 4] {
        let arm = [p[0] - self.place[0], p[1] - self.place[1]];
        std::array::from_fn(|i| {
            let turn = self.turning[i];
            [self.drift[i][0] - turn * arm[1], self.drift[i][1] + turn * arm[0]]
        })
    }
}

/// Slacks by place.
#[derive(Debug, Clone)]
pub struct Slacks {
    slacks: Vec<Slack>,
    low: [f64; 2],
    cell: f64,
    counts: [usize; 2],
    /// Of each cell the slack that counts there.
    nearest: Vec<u32>,
}

/// Side of a cell at least, m, and cells along a side at most.
const CELL: f64 = 0.1;
const MOST_CELLS: f64 = 300.0;
/// Parts of the motion that come as near as the nearest one, but for this, are all near, m.
const ALIKE: f64 = 0.15;
/// Consecutive places nearer than this are one, m.
const SAME: f64 = 0.02;
/// Looked up so far beyond the motion's own rectangle, m; farther off what holds at this rectangle's edge does.
const BEYOND: f64 = 1.0;

impl Slacks {
    /// Of a motion, in order of time; `None`: there is none.
    pub fn along(all: impl IntoIterator<Item = Slack>) -> Option<Self> {
        let mut slacks: Vec<Slack> = Vec::new();
        for slack in all {
            let apart = |last: &Slack| real::hypot(last.place[0] - slack.place[0], last.place[1] - slack.place[1]);
            match slacks.last_mut().filter(|last| apart(last) < SAME) {
                // The base turns there, or stands: the end of that counts, or what was more before.
                Some(last) if last.most(last.place) > slack.most(last.place) => {}
                Some(last) => *last = Slack { place: last.place, ..slack },
                None => slacks.push(slack),
            }
        }
        let first = slacks.first()?.place;
        let wider = |(low, high): ([f64; 2], [f64; 2]), slack: &Slack| {
            ([0, 1].map(|a| low[a].min(slack.place[a])), [0, 1].map(|a| high[a].max(slack.place[a])))
        };
        let (low, high) = slacks.iter().fold((first, first), wider);
        let low = low.map(|v| v - BEYOND);
        let size = [0, 1].map(|a| high[a] + BEYOND - low[a]);
        let cell = CELL.max(size[0].max(size[1]) / MOST_CELLS);
        let counts = size.map(|s| (s / cell).ceil() as usize);
        let mut distances = vec![0.0; slacks.len()];
        let mut nearest = Vec::with_capacity(counts[0] * counts[1]);
        for i in 0..counts[0] {
            for j in 0..counts[1] {
                let at = [low[0] + (i as f64 + 0.5) * cell, low[1] + (j as f64 + 0.5) * cell];
                let mut least = f64::INFINITY;
                for (distance, slack) in distances.iter_mut().zip(&slacks) {
                    *distance = real::hypot(at[0] - slack.place[0], at[1] - slack.place[1]);
                    least = least.min(*distance);
                }
                nearest.push(distances.iter().rposition(|d| *d <= least + ALIKE).unwrap_or(0) as u32);
            }
        }
        Some(Self { slacks, low, cell, counts, nearest })
    }

    fn near(&self, p: [f64; 2]) -> &Slack {
        // `as` saturates: what is below the grid is at its edge.
        let [i, j] = [0, 1].map(|a| (((p[a] - self.low[a]) / self.cell) as usize).min(self.counts[a] - 1));
        &self.slacks[self.nearest[i * self.counts[1] + j] as usize]
    }

    /// How far a robot may be off at `p`, m: towards the side of the motion that comes nearest there. `p` on the motion: towards both.
    pub fn aside(&self, p: [f64; 2]) -> f64 {
        let slack = self.near(p);
        let away = [p[0] - slack.place[0], p[1] - slack.place[1]];
        let distance = real::hypot(away[0], away[1]);
        if distance < self.cell {
            slack.along(slack.place, [0.0; 2])
        } else {
            slack.along(p, away.map(|v| v / distance))
        }
    }
}

/// A distance field in which obstacles are nearer by what a robot may be off towards them.
#[derive(Debug)]
pub struct Slackened<'a, F> {
    /// To the obstacles as they are.
    pub field: &'a F,
    /// What comes off.
    pub slacks: &'a Slacks,
}

impl<F: DistanceField> DistanceField for Slackened<'_, F> {
    /// A lower bound, whatever the direction of the obstacle.
    fn distance(&self, p: [f64; 3]) -> f64 {
        self.field.distance(p) - self.slacks.near([p[0], p[1]]).most([p[0], p[1]])
    }

    fn distance_gradient(&self, p: [f64; 3]) -> (f64, [f64; 3]) {
        let (distance, gradient) = self.field.distance_gradient(p);
        (distance - self.slacks.near([p[0], p[1]]).along([p[0], p[1]], [gradient[0], gradient[1]]), gradient)
    }

    fn cell(&self) -> f64 {
        self.field.cell()
    }

    fn least_above(&self, foot: [f64; 3], rise: f64) -> (f64, [f64; 3]) {
        let (distance, gradient) = self.field.least_above(foot, rise);
        let p = [foot[0], foot[1]];
        (distance - self.slacks.near(p).along(p, [gradient[0], gradient[1]]), gradient)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::optimize::test_robot::Boxes;

    fn slack(place: [f64; 2], side: f64) -> Slack {
        let zero = [0.0; 2];
        Slack { place, drift: [[0.0, side], [0.01, 0.0], zero, zero], turning: [0.1, 0.0, 0.0, 0.0], anywhere: 0.02 }
    }

    /// Along x and back.
    fn there_and_back() -> Slacks {
        let way = (0..=60).chain((0..60).rev()).map(|i| 0.05 * f64::from(i));
        Slacks::along(way.enumerate().map(|(i, x)| slack([x, 0.0], 0.001 * i as f64))).expect("a motion")
    }

    #[test]
    fn obstacles_are_nearer_by_what_the_robot_may_be_off_towards_them_when_it_is_there_last() {
        let field = Boxes(vec![([-1.0, 0.5, 0.0], [4.0, 0.6, 1.0])]);
        let slacks = there_and_back();
        let field = Slackened { field: &field, slacks: &slacks };
        for (x, last) in [(0.5, 110.0), (2.0, 80.0)] {
            let (distance, gradient) = field.distance_gradient([x, 0.2, 0.5]);
            assert!((gradient[1] + 1.0).abs() < 1e-6);
            // Sideways drift, more or less what points before and behind the base turn, and what is in all directions.
            let off = 0.3 - distance;
            assert!((off - 0.02 - 0.001 * last).abs() < 0.005 + 0.1 * 0.2, "{off} at {x}");
            assert!(field.distance([x, 0.2, 0.5]) <= distance);
        }
    }

    #[test]
    fn beside_a_motion_what_leads_there_counts_and_far_off_what_holds_at_its_nearest_place() {
        let slacks = there_and_back();
        assert!(slacks.aside([1.0, 0.4]) > 0.08 && slacks.aside([1.0, 0.0]) < 0.03);
        assert!(slacks.aside([1e6, -1e6]).is_finite() && Slacks::along([]).is_none());
    }
}
