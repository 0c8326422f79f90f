//! A roadmap of postures for many joints: those asked for at the ends, some in which the robot is folded up, some spread over all
//! that there are, and the straight ways between them, sampled closely.
//!
//! (After Kavraki et al. 1996; obstacles are not looked at here but for each pose of the base, by `collide`. A robot that drives is
//! best folded up, and most ways lead from the posture at the start by way of a folded one to that at the goal.)

use std::collections::BTreeSet;

use super::joint_space::{JointSpace, between};
use super::posture::{FEW_POSTURES, MOST_POSTURES, Roadmap};
use crate::math::real;
use crate::robot::RobotModel;

/// Time that a step may take at the joints' planning speeds, s, if there is room for as many postures.
const STEP_TIME: f64 = 0.12;

/// Most steps of a way that are looked at.
const MOST_STEPS: usize = 200;

/// How large a roadmap is.
struct Size {
    /// Postures that are looked at for those in which the robot is folded up.
    surveyed: usize,
    /// Narrow and low postures each, and others.
    folded: usize,
    spread: usize,
    /// Postures for an end that leaves joints open.
    open: usize,
    /// Ways from an end to the nearest others, and from each of the others.
    ways: [usize; 2],
    /// Most postures, so that there is room for ways out of narrow places.
    most: usize,
}

/// Enough for most, and enough for nearly all.
const SIZES: [Size; 2] = [
    Size { surveyed: 64, folded: 3, spread: 3, open: 4, ways: [2, 1], most: FEW_POSTURES - 40 },
    Size { surveyed: 192, folded: 5, spread: 16, open: 6, ways: [6, 2], most: MOST_POSTURES - 64 },
];
/// What a metre of height is worth in metres of width, of a folded robot: some are narrow, to pass between things, some low, to pass
/// under them.
const HEIGHTS: [f64; 2] = [0.3, 3.0];
/// Steps of the descent towards a folded posture, shares of the joints' ranges.
const DESCENT: [f64; 4] = [0.12, 0.06, 0.03, 0.015];

/// What is known of a robot that is built a roadmap for.
struct Builder<'a> {
    robot: &'a RobotModel,
    pairs: Vec<[usize; 2]>,
    space: JointSpace,
    /// Shapes that joints move.
    moved: Vec<usize>,
    size: &'static Size,
}

/// Postures and the ways between them, for joint values asked for at start and goal. `near`: values about which endless joints are
/// sampled. Level 0 is a small roadmap, level 1 a large one.
pub(super) fn build(
    robot: &RobotModel,
    near: &[f64],
    asked: [&[Option<f64>]; 2],
    level: usize,
) -> (Vec<Vec<f64>>, Roadmap) {
    let moved = (0..robot.shapes.len()).filter(|s| robot.is_moved(robot.shapes[*s].body)).collect();
    let builder =
        Builder { robot, pairs: robot.self_pairs(), space: JointSpace::new(robot, near), moved, size: &SIZES[level] };
    builder.roadmap(asked)
}

impl Builder<'_> {
    fn roadmap(&self, asked: [&[Option<f64>]; 2]) -> (Vec<Vec<f64>>, Roadmap) {
        let (folded, mut keys) = self.folded_and_spread();
        let own = keys.len();
        let mut ends: [Vec<u32>; 2] = Default::default();
        for (own, asked) in ends.iter_mut().zip(asked) {
            for posture in self.of_end(asked, &keys[..folded]) {
                let known = keys.iter().position(|key| *key == posture);
                own.push(known.unwrap_or(keys.len()) as u32);
                if known.is_none() {
                    keys.push(posture);
                }
            }
        }
        let ways = self.ways(&keys, folded, &ends);
        self.sampled(keys, own, ends, &ways)
    }

    fn touches(&self, q: &[f64]) -> bool {
        !self.pairs.is_empty() && self.robot.touching(&self.pairs, q).is_some()
    }

    /// Whether no links touch on the straight way between two postures, looked at as closely as it will be sampled.
    fn is_open(&self, a: &[f64], b: &[f64]) -> bool {
        // No closer than that for joints that are very slow.
        let steps = ((self.space.time(a, b) / STEP_TIME).ceil() as usize).min(MOST_STEPS);
        (1..steps).all(|k| !self.touches(&between(a, b, k as f64 / steps as f64)))
    }

    /// How wide and tall the robot's moving parts are, m.
    fn extent(&self, q: &[f64], height: f64) -> f64 {
        let poses = self.robot.shape_poses(q);
        let of = |s: &usize| {
            let (pose, convex) = (&poses[*s], &self.robot.shapes[*s].convex);
            let (mut wide, mut top) = (0.0f64, f64::NEG_INFINITY);
            let [x, y, z] = convex.half_extents();
            for k in 0..8 {
                let sign = |bit: usize, half: f64| if k >> bit & 1 == 0 { -half } else { half };
                let corner = pose * nalgebra::Point3::new(sign(0, x), sign(1, y), sign(2, z));
                wide = wide.max(real::hypot(corner.x, corner.y));
                top = top.max(corner.z);
            }
            (wide, top)
        };
        let (wide, top) = self.moved.iter().map(of).fold((0.0f64, 0.0f64), |a, b| (a.0.max(b.0), a.1.max(b.1)));
        wide + height * top
    }

    /// Postures in which the robot is folded up, and how many, the narrowest first; behind them such as lie far apart.
    fn folded_and_spread(&self) -> (usize, Vec<Vec<f64>>) {
        let Size { surveyed: count, folded, spread, .. } = *self.size;
        let surveyed: Vec<Vec<f64>> = (1..=count).map(|index| self.space.sample(index)).collect();
        let mut rest: Vec<f64> = vec![0.0; self.space.ranges.len()];
        rest.iter_mut().zip(&self.space.ranges).for_each(|(v, [low, high])| *v = v.clamp(*low, *high));
        let mut keys: Vec<Vec<f64>> = Vec::new();
        for (kind, height) in HEIGHTS.into_iter().enumerate() {
            for seed in std::iter::once(&rest).chain(self.by_extent(&surveyed, height)) {
                if keys.len() == (kind + 1) * folded {
                    break;
                }
                if self.touches(seed) {
                    continue;
                }
                let folded = self.fold(seed.clone(), height);
                if keys.iter().all(|key| self.space.time(key, &folded) > 4.0 * STEP_TIME) {
                    keys.push(folded);
                }
            }
        }
        keys.sort_by(|a, b| self.extent(a, HEIGHTS[0]).total_cmp(&self.extent(b, HEIGHTS[0])));
        let folded = keys.len();
        // The smaller half, each time the one farthest from all there are.
        let mut left = self.by_extent(&surveyed, HEIGHTS[0]);
        left.truncate(count / 2);
        while keys.len() < folded + spread && !left.is_empty() {
            let apart = |q: &[f64]| keys.iter().map(|key| self.space.time(key, q)).fold(f64::INFINITY, f64::min);
            let farthest = (0..left.len()).max_by(|a, b| apart(left[*a]).total_cmp(&apart(left[*b]))).unwrap_or(0);
            let q = left.swap_remove(farthest);
            if !self.touches(q) {
                keys.push(q.clone());
            }
        }
        (folded, keys)
    }

    /// The smallest first.
    fn by_extent<'b>(&self, postures: &'b [Vec<f64>], height: f64) -> Vec<&'b Vec<f64>> {
        let mut sized: Vec<(f64, &Vec<f64>)> = postures.iter().map(|q| (self.extent(q, height), q)).collect();
        sized.sort_by(|a, b| a.0.total_cmp(&b.0));
        sized.into_iter().map(|(_, q)| q).collect()
    }

    /// A posture nearby, no part of which reaches as far.
    fn fold(&self, mut q: Vec<f64>, height: f64) -> Vec<f64> {
        let mut size = self.extent(&q, height);
        for share in DESCENT {
            let mut gained = true;
            while gained {
                gained = false;
                for joint in 0..q.len() {
                    let [low, high] = self.space.ranges[joint];
                    for step in [share, -share] {
                        let before = q[joint];
                        q[joint] = (before + step * (high - low)).clamp(low, high);
                        let found = self.extent(&q, height);
                        if found < size - 1e-3 && !self.touches(&q) {
                            (size, gained) = (found, true);
                            break;
                        }
                        q[joint] = before;
                    }
                }
            }
        }
        q
    }

    /// Postures for an end: the one asked for; where joints are open, those as in some folded postures. None where all are open.
    fn of_end(&self, asked: &[Option<f64>], folded: &[Vec<f64>]) -> Vec<Vec<f64>> {
        if asked.iter().all(Option::is_none) {
            return Vec::new();
        }
        let with = |own: &Vec<f64>| -> Vec<f64> { asked.iter().zip(own).map(|(a, own)| a.unwrap_or(*own)).collect() };
        if asked.iter().all(Option::is_some) {
            return vec![with(&vec![0.0; asked.len()])];
        }
        let more = (1..=self.size.open).map(|index| self.space.sample(index));
        folded.iter().cloned().chain(more).map(|own| with(&own)).take(self.size.open + folded.len() / 2).collect()
    }

    /// Pairs of keys that are joined.
    fn ways(&self, keys: &[Vec<f64>], folded: usize, ends: &[Vec<u32>; 2]) -> Vec<[usize; 2]> {
        let mut ways = BTreeSet::new();
        let is_end = |key: usize| ends.iter().flatten().any(|end| *end as usize == key);
        let mut known = std::collections::BTreeMap::new();
        let mut join = |a: usize, b: usize| {
            let way = [a.min(b), a.max(b)];
            let open = a != b && *known.entry(way).or_insert_with(|| self.is_open(&keys[way[0]], &keys[way[1]]));
            if open {
                ways.insert(way);
            }
            open
        };
        for a in 0..keys.len() {
            let mut others: Vec<usize> = (0..keys.len()).filter(|b| *b != a).collect();
            others
                .sort_by(|b, c| self.space.time(&keys[a], &keys[*b]).total_cmp(&self.space.time(&keys[a], &keys[*c])));
            let wanted = self.size.ways[usize::from(!is_end(a))];
            others.iter().filter(|b| **b >= folded).filter(|b| join(a, **b)).take(wanted).count();
            if is_end(a) || a < folded {
                // The folded ones, and the other end.
                others.iter().filter(|b| **b < folded || is_end(a) && is_end(**b)).for_each(|b| {
                    join(a, *b);
                });
            } else {
                others.iter().filter(|b| **b < folded).find(|b| join(a, **b));
            }
        }
        ways.into_iter().collect()
    }

    /// All ways as postures close together, as close as their greatest number allows.
    fn sampled(
        &self,
        keys: Vec<Vec<f64>>,
        own: usize,
        ends: [Vec<u32>; 2],
        ways: &[[usize; 2]],
    ) -> (Vec<Vec<f64>>, Roadmap) {
        let times: Vec<f64> = ways.iter().map(|[a, b]| self.space.time(&keys[*a], &keys[*b])).collect();
        let inner = |step: f64| times.iter().map(|time| (time / step).ceil().max(1.0) as usize - 1).sum::<usize>();
        let mut step = STEP_TIME;
        while keys.len() + inner(step) > self.size.most {
            step *= 1.05;
        }
        let mut values = keys;
        let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); values.len()];
        let mut longest = 0.0f64;
        for ([a, b], time) in ways.iter().zip(&times) {
            let steps = (time / step).ceil().max(1.0) as usize;
            longest = longest.max(time / steps as f64);
            let mut last = *a;
            for k in 1..=steps {
                let next = if k == steps { *b } else { values.len() };
                if k < steps {
                    values.push(between(&values[*a], &values[*b], k as f64 / steps as f64));
                    neighbours.push(Vec::new());
                }
                neighbours[last].push(next as u32);
                neighbours[next].push(last as u32);
                last = next;
            }
        }
        neighbours.iter_mut().for_each(|own| own.sort_unstable());
        (values, Roadmap { neighbours, step_time: longest.max(1e-6), ends, keys: own })
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::arm;
    use super::*;
    use crate::math::halton;

    const NEAR: [f64; 5] = [0.0; 5];

    fn asked(values: [f64; 5]) -> Vec<Option<f64>> {
        values.map(Some).to_vec()
    }

    #[test]
    fn steps_are_short_go_both_ways_and_lead_from_start_to_goal_without_links_that_touch() {
        let robot = arm(5);
        let pairs = robot.self_pairs();
        assert!(!pairs.is_empty());
        let ends = [asked([0.3, 0.4, -0.2, 0.5, 0.1]), asked([-1.0, 0.2, 0.7, -0.6, 0.3])];
        for (level, size) in SIZES.iter().enumerate() {
            let (values, roadmap) = build(&robot, &NEAR, [&ends[0], &ends[1]], level);
            assert!(values.len() <= size.most, "{}", values.len());
            for (p, own) in roadmap.neighbours.iter().enumerate() {
                for q in own {
                    assert!(roadmap.neighbours[*q as usize].contains(&(p as u32)));
                    let time = (values[p].iter().zip(&values[*q as usize]).zip(&robot.joints))
                        .map(|((a, b), joint)| (a - b).abs() / joint.limits.planning()[0]);
                    assert!(time.fold(0.0, f64::max) <= roadmap.step_time + 1e-9);
                }
            }
            assert!(values.iter().all(|q| robot.touching(&pairs, q).is_none()));
            for (own, asked) in roadmap.ends.iter().zip(&ends) {
                let exact: Vec<f64> = asked.iter().flatten().copied().collect();
                assert_eq!(own.iter().map(|p| &values[*p as usize]).collect::<Vec<_>>(), [&exact]);
            }
            let mut seen = vec![false; values.len()];
            let mut open = vec![roadmap.ends[0][0]];
            while let Some(p) = open.pop() {
                if !std::mem::replace(&mut seen[p as usize], true) {
                    open.extend(&roadmap.neighbours[p as usize]);
                }
            }
            assert!(seen[roadmap.ends[1][0] as usize]);
        }
    }

    #[test]
    fn joints_that_an_end_leaves_open_have_several_values_there_and_the_others_the_one_asked_for() {
        let robot = arm(5);
        let mut open = asked([0.3; 5]);
        (open[1], open[3]) = (None, None);
        let none = vec![None; 5];
        let (values, roadmap) = build(&robot, &NEAR, [&open, &none], 0);
        assert!(roadmap.ends[0].len() > 2 && roadmap.ends[1].is_empty());
        for p in &roadmap.ends[0] {
            let q = &values[*p as usize];
            assert_eq!([q[0], q[2], q[4]], [0.3; 3]);
        }
    }

    #[test]
    fn the_first_posture_is_narrower_than_nearly_all_there_are() {
        let robot = arm(5);
        let none = vec![None; 5];
        let (values, _) = build(&robot, &NEAR, [&none, &none], 1);
        let width = |q: &[f64]| robot.radius(q);
        let narrower = (1..=500).filter(|index| {
            let q: Vec<f64> = robot
                .joints
                .iter()
                .enumerate()
                .map(|(axis, joint)| joint.lower + halton::value(axis, *index) * (joint.upper - joint.lower))
                .collect();
            width(&q) < width(&values[0]) - 1e-3
        });
        assert!(narrower.count() < 15);
    }
}
