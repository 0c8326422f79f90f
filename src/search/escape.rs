//! A way out of a posture from which no straight way leads: two trees of postures that grow towards each other, the base standing
//! (RRT-Connect, Kuffner & LaValle 2000; samples from a Halton sequence, so that it finds the same way each time).

use super::joint_space::{JointSpace, between};
use crate::robot::RobotModel;

/// Time that a step may take at the joints' planning speeds, s.
const STEP_TIME: f64 = 0.06;
/// Postures that are looked at before it gives up.
const MOST_LOOKS: usize = 6_000;

/// How often a way is straightened.
const STRAIGHTENED: usize = 3;

/// Postures, and which straight ways between them are free, but for where they begin.
pub(super) struct Escape<F: FnMut(&[f64], &[f64]) -> bool> {
    space: JointSpace,
    passes: F,
    looks: usize,
}

/// Postures, each but the first ones with the one it was reached from.
#[derive(Default)]
struct Tree {
    postures: Vec<Vec<f64>>,
    parents: Vec<Option<usize>>,
}

impl Tree {
    fn add(&mut self, posture: Vec<f64>, parent: Option<usize>) -> usize {
        self.postures.push(posture);
        self.parents.push(parent);
        self.postures.len() - 1
    }

    /// From a posture back to where its tree began.
    fn back(&self, mut at: usize) -> Vec<Vec<f64>> {
        let mut out = vec![self.postures[at].clone()];
        while let Some(parent) = self.parents[at] {
            at = parent;
            out.push(self.postures[at].clone());
        }
        out
    }
}

impl<F: FnMut(&[f64], &[f64]) -> bool> Escape<F> {
    /// `near`: values about which endless joints are sampled.
    pub fn new(robot: &RobotModel, near: &[f64], passes: F) -> Self {
        Self { space: JointSpace::new(robot, near), passes, looks: 0 }
    }

    /// Postures from `from` to one of `to`, both among them, no farther apart than a step; `None`: none found. All given ones are free.
    pub fn way(&mut self, from: &[f64], to: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
        let mut trees = [Tree::default(), Tree::default()];
        trees[0].add(from.to_vec(), None);
        to.iter().for_each(|posture| {
            trees[1].add(posture.clone(), None);
        });
        for turn in 0..2 * MOST_LOOKS {
            if self.looks > MOST_LOOKS || to.is_empty() {
                break;
            }
            // Each sample for both trees: of every other point of the sequence one joint is always high.
            let (growing, index) = (turn % 2, turn / 2 + 1);
            let sample = self.space.sample(index);
            let (end, _) = self.grow(&mut trees[growing], &sample, 1);
            if let Some(end) = end {
                let target = trees[growing].postures[end].clone();
                let (met, reached) = self.grow(&mut trees[1 - growing], &target, usize::MAX);
                if let Some(met) = met.filter(|_| reached) {
                    let ends = if growing == 0 { [end, met] } else { [met, end] };
                    let mut way = trees[0].back(ends[0]);
                    way.reverse();
                    way.extend(trees[1].back(ends[1]).into_iter().skip(1));
                    return Some((0..STRAIGHTENED).fold(way, |way, _| self.straightened(&way)));
                }
            }
        }
        None
    }

    fn passes(&mut self, from: &[f64], to: &[f64]) -> bool {
        self.looks += 1;
        (self.passes)(from, to)
    }

    /// Up to `most` steps from the nearest posture of a tree towards another; the last one made, and whether it is there.
    fn grow(&mut self, tree: &mut Tree, target: &[f64], most: usize) -> (Option<usize>, bool) {
        let distance = |k: &usize| self.space.time(&tree.postures[*k], target);
        let Some(mut at) = (0..tree.postures.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))) else {
            return (None, false);
        };
        let mut made = None;
        for _ in 0..most {
            let left = self.space.time(&tree.postures[at], target);
            if left < 1e-9 {
                return (made.or(Some(at)), true);
            }
            let share = (STEP_TIME / left).min(1.0);
            let next = between(&tree.postures[at], target, share);
            if self.looks > MOST_LOOKS || !self.passes(&tree.postures[at], &next) {
                return (made, false);
            }
            at = tree.add(next, Some(at));
            made = Some(at);
        }
        (made, made.is_some_and(|at| self.space.time(&tree.postures[at], target) < 1e-9))
    }

    /// The way with straight pieces where those are free, sampled anew.
    fn straightened(&mut self, way: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut out = vec![way[0].clone()];
        let mut at = 0;
        while at + 1 < way.len() {
            let mut ahead = way.len() - 1 - at;
            let piece = loop {
                if ahead == 1 || self.passes(&way[at], &way[at + ahead]) {
                    break self.sampled(&way[at], &way[at + ahead]);
                }
                ahead = ahead.div_ceil(2).min(ahead - 1);
            };
            out.extend(piece);
            out.push(way[at + ahead].clone());
            at += ahead;
        }
        out
    }

    /// Postures between two, without them.
    fn sampled(&self, a: &[f64], b: &[f64]) -> Vec<Vec<f64>> {
        let steps = (self.space.time(a, b) / STEP_TIME).ceil() as usize;
        (1..steps).map(|k| between(a, b, k as f64 / steps as f64)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two joints, 0 to 1 rad each at 1 rad/s.
    fn robot() -> RobotModel {
        let mut robot = super::super::tests::arm(2);
        robot.joints.iter_mut().for_each(|joint| (joint.lower, joint.upper) = (0.0, 1.0));
        robot
    }

    /// A wall at 0.45 to 0.55 of the first joint, with an opening.
    fn wall(q: &[f64], opening: std::ops::Range<f64>) -> bool {
        !(0.45..0.55).contains(&q[0]) || opening.contains(&q[1])
    }

    fn passes(a: &[f64], b: &[f64], opening: std::ops::Range<f64>) -> bool {
        (1..=50).all(|k| wall(&between(a, b, f64::from(k) / 50.0), opening.clone()))
    }

    #[test]
    fn a_way_leads_through_the_only_opening_in_steps_that_are_free() {
        let robot = robot();
        let mut escape = Escape::new(&robot, &[0.0; 2], |a, b| passes(a, b, 0.8..0.95));
        let to = [vec![0.9, 0.1], vec![0.95, 0.2]];
        let way = escape.way(&[0.1, 0.1], &to).expect("there is one");
        assert_eq!(way[0], [0.1, 0.1]);
        assert!(to.contains(&way[way.len() - 1]));
        for pair in way.windows(2) {
            assert!(passes(&pair[0], &pair[1], 0.8..0.95), "{pair:?}");
            assert!(escape.space.time(&pair[0], &pair[1]) <= STEP_TIME + 1e-9, "{pair:?}");
        }
    }

    #[test]
    fn it_gives_up_where_there_is_none() {
        let robot = robot();
        assert_eq!(
            Escape::new(&robot, &[0.0; 2], |a, b| passes(a, b, 2.0..3.0)).way(&[0.1, 0.1], &[vec![0.9, 0.1]]),
            None
        );
        assert_eq!(Escape::new(&robot, &[0.0; 2], |_, _| true).way(&[0.1, 0.1], &[]), None);
    }
}
