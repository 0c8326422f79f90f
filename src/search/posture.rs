//! The postures that are searched, and which of them are neighbours.
//!
//! One or two joints are sampled as a grid over their ranges: 64 values of one joint, 32 of each of two. Of more joints no grid is
//! fine enough: theirs is a roadmap (`roadmap`), some postures and the straight ways between them, sampled as finely. No joint is one
//! posture. All other code asks for neighbours and sets of postures (`Bits<W>`) and knows no number of joints.

use std::collections::{BTreeMap, VecDeque};

use super::Query;
use super::bits::Bits;
use super::roadmap;
use super::solve::End;
use crate::robot::RobotModel;

/// Postures with the steps between them.
#[derive(Debug, Clone)]
pub(super) struct Postures {
    /// Joint values, one a posture.
    values: Vec<Vec<f64>>,
    steps: Steps,
}

#[derive(Debug, Clone)]
enum Steps {
    Grid {
        /// Number of sampled values of each joint, and index distance of neighbours along it.
        axes: Vec<(usize, usize)>,
        /// Distance between neighbouring values of each joint.
        spacing: Vec<f64>,
    },
    Roadmap(Roadmap),
}

/// Neighbours one by one.
#[derive(Debug, Clone, Default)]
pub(super) struct Roadmap {
    /// Of each posture, ascending.
    pub neighbours: Vec<Vec<u32>>,
    /// Longest time that a step takes at the joints' planning speeds, s.
    pub step_time: f64,
    /// Postures that are meant for the start and for the goal.
    pub ends: [Vec<u32>; 2],
    /// How many of the postures are folded or spread ones; the first.
    pub keys: usize,
}

/// Most postures there can be: bits of the widest mask.
pub(super) const MOST_POSTURES: usize = 1024;
/// Most postures of a roadmap that is tried first.
pub(super) const FEW_POSTURES: usize = 256;
/// Most joints that are sampled as a grid.
const GRID_JOINTS: usize = 2;

impl Postures {
    /// How many sets of postures there are to try, small ones first.
    pub fn levels(robot: &RobotModel) -> usize {
        if robot.joints.len() <= GRID_JOINTS { 1 } else { 2 }
    }

    /// Those for a robot and a question. A joint without limits is sampled one turn about its value at the start.
    pub fn new(robot: &RobotModel, query: &Query, level: usize) -> Self {
        let near = |(asked, joint): (&Option<f64>, &crate::robot::MovingJoint)| {
            asked.unwrap_or(0f64.clamp(joint.lower, joint.upper))
        };
        let near: Vec<f64> = query.start_joints.iter().zip(&robot.joints).map(near).collect();
        if robot.joints.len() <= GRID_JOINTS {
            return Self::grid(robot, &near);
        }
        let (values, roadmap) = roadmap::build(robot, &near, [&query.start_joints, &query.goal_joints], level);
        Self { values, steps: Steps::Roadmap(roadmap) }
    }

    fn grid(robot: &RobotModel, near: &[f64]) -> Self {
        let per_joint = match robot.joints.len() {
            0 | 1 => 64,
            n => (2..=64usize).rev().find(|k| k.pow(n as u32) <= MOST_POSTURES).unwrap_or(1),
        };
        let samples = robot.joints.iter().zip(near).map(|(joint, near)| {
            let [lower, upper] = joint.range_about(*near);
            let samples = if upper > lower { per_joint } else { 1 };
            let step = (upper - lower) / (samples.max(2) - 1) as f64;
            (0..samples).map(|k| if k + 1 == samples { upper } else { lower + step * k as f64 }).collect()
        });
        Self::over(samples.collect())
    }

    /// All combinations of the joints' values.
    pub fn over(samples: Vec<Vec<f64>>) -> Self {
        let mut count = 1;
        let mut axes = Vec::new();
        for own in &samples {
            axes.push((own.len(), count));
            count *= own.len();
        }
        let of = |p: usize| samples.iter().zip(&axes).map(|(v, (len, stride))| v[p / stride % len]).collect();
        let values = (0..count).map(of).collect();
        let spacing = samples.iter().map(|v| if v.len() > 1 { v[1] - v[0] } else { 0.0 }).collect();
        Self { values, steps: Steps::Grid { axes, spacing } }
    }

    pub fn count(&self) -> usize {
        self.values.len()
    }

    /// Joint values of a posture.
    pub fn joints(&self, posture: usize) -> &[f64] {
        &self.values[posture]
    }

    /// Whether every posture there is has one of these near it: then what is not found does not exist.
    pub fn is_exhaustive(&self) -> bool {
        matches!(self.steps, Steps::Grid { .. })
    }

    /// How an end's postures lead to a folded or spread one by steps within `free` that pass, in few steps. `None`: of a grid, and where
    /// no posture of that end is free, there is nothing to tell.
    pub fn way_out<const W: usize>(
        &self,
        neighbours: &Neighbours<W>,
        end: End,
        free: Bits<W>,
        passes: impl Fn(&[f64], &[f64]) -> bool,
    ) -> Option<WayOut> {
        let Steps::Roadmap(roadmap) = &self.steps else { return None };
        let keys: Vec<usize> = (0..roadmap.keys).filter(|key| free.contains(*key)).collect();
        let ends = roadmap.ends[end as usize].iter().map(|p| *p as usize);
        let ends: Vec<usize> = ends.filter(|p| free.contains(*p)).collect();
        let from = *ends.first()?;
        let mut open = BTreeMap::new();
        loop {
            // In breadth, so that few steps are looked at closely.
            let mut came = vec![usize::MAX; self.count()];
            let mut queue: VecDeque<usize> = ends.iter().copied().collect();
            ends.iter().for_each(|p| came[*p] = *p);
            while let Some(p) = queue.pop_front() {
                neighbours.each(p, |q| {
                    if came[q] == usize::MAX && free.contains(q) && open.get(&[p.min(q), p.max(q)]) != Some(&false) {
                        came[q] = p;
                        queue.push_back(q);
                    }
                });
            }
            let Some(mut at) = keys.iter().copied().find(|key| came[*key] != usize::MAX) else {
                return Some(WayOut { blocked: blocked(&open), shut_in: Some((from, keys)) });
            };
            let mut passed = true;
            while came[at] != at {
                let last = came[at];
                let step = [last.min(at), last.max(at)];
                passed &= *open.entry(step).or_insert_with(|| passes(&self.values[step[0]], &self.values[step[1]]));
                at = last;
            }
            if passed {
                return Some(WayOut { blocked: blocked(&open), shut_in: None });
            }
        }
    }

    /// Without these steps.
    pub fn without(&self, steps: &[[usize; 2]]) -> Self {
        let mut fewer = self.clone();
        if let Steps::Roadmap(roadmap) = &mut fewer.steps {
            for [a, b] in steps {
                roadmap.neighbours[*a].retain(|p| *p as usize != *b);
                roadmap.neighbours[*b].retain(|p| *p as usize != *a);
            }
        }
        fewer
    }

    /// With a way of postures, the first and last of which are in it already; of the others so many at most.
    pub fn with_way(&self, way: &[Vec<f64>], room: usize) -> Self {
        let mut more = self.clone();
        let known = |posture: &Vec<f64>| self.values.iter().position(|own| own == posture);
        let Steps::Roadmap(roadmap) = &mut more.steps else { return more };
        let (Some(from), Some(to)) = (known(&way[0]), known(&way[way.len() - 1])) else { return more };
        let mut last = from as u32;
        for posture in thinned(way, room) {
            let next = more.values.len() as u32;
            more.values.push(posture);
            roadmap.neighbours.push(vec![last]);
            roadmap.neighbours[last as usize].push(next);
            last = next;
        }
        roadmap.neighbours[last as usize].push(to as u32);
        roadmap.neighbours[to].push(last);
        more
    }

    /// The posture in which the robot is folded up most, where that is known.
    pub fn folded(&self) -> Option<usize> {
        match self.steps {
            Steps::Grid { .. } => None,
            Steps::Roadmap(_) => Some(0),
        }
    }

    /// Whether a posture will do at an end where these joint values are asked for: it is the nearest one.
    pub fn agrees(&self, posture: usize, end: End, asked: &[Option<f64>]) -> bool {
        match &self.steps {
            Steps::Grid { axes, .. } => asked.iter().enumerate().all(|(joint, asked)| {
                let Some(wanted) = asked else { return true };
                let (count, stride) = axes[joint];
                let at = posture / stride % count;
                let first = posture - at * stride;
                let distance = |k: &usize| (self.values[first + k * stride][joint] - wanted).abs();
                (0..count).min_by(|a, b| distance(a).total_cmp(&distance(b))) == Some(at)
            }),
            Steps::Roadmap(roadmap) => {
                asked.iter().all(Option::is_none) || roadmap.ends[end as usize].contains(&(posture as u32))
            }
        }
    }

    /// Postures with one of these joints at an end of its range.
    pub fn brinks<const W: usize>(&self, joints: impl Iterator<Item = usize>) -> Bits<W> {
        let mut out = Bits::EMPTY;
        let Steps::Grid { axes, .. } = &self.steps else { return out };
        for joint in joints {
            let (count, stride) = axes[joint];
            let at_end = |p: &usize| [0, count - 1].contains(&(p / stride % count));
            // A joint with one value has nowhere to go.
            (0..self.count()).filter(|p| count > 1 && at_end(p)).for_each(|p| out.insert(p));
        }
        out
    }

    /// Steps of every joint that there is time for, at 70 % of the planning speeds.
    pub fn steps_within(&self, robot: &RobotModel, time: f64) -> usize {
        const SHARE: f64 = 0.7;
        let steps = match &self.steps {
            Steps::Grid { spacing, .. } => {
                robot.joints.iter().zip(spacing).fold(f64::INFINITY, |least, (joint, step)| {
                    let own = SHARE * joint.limits.planning()[0] * time / step;
                    if *step > 0.0 { least.min(own) } else { least }
                })
            }
            Steps::Roadmap(roadmap) => SHARE * time / roadmap.step_time,
        };
        steps.min(1024.0) as usize
    }

    /// Number of sampled values of each joint, and index distance of neighbours along it; none where postures are not a grid.
    pub fn axes(&self) -> &[(usize, usize)] {
        match &self.steps {
            Steps::Grid { axes, .. } => axes,
            Steps::Roadmap(_) => &[],
        }
    }
}

/// Neighbourhoods of sets of postures.
#[derive(Debug, Clone)]
pub(super) enum Neighbours<const W: usize> {
    /// Per joint: index distance, postures with a lower neighbour, postures with an upper one.
    Grid(Vec<(usize, Bits<W>, Bits<W>)>),
    /// Of each posture, one by one and as a set.
    Roadmap(Vec<(Vec<u32>, Bits<W>)>),
}

impl<const W: usize> Neighbours<W> {
    pub fn new(postures: &Postures) -> Self {
        match &postures.steps {
            Steps::Grid { axes, .. } => {
                let axis = |(count, stride): &(usize, usize)| {
                    let mut ends = (Bits::EMPTY, Bits::EMPTY);
                    for p in 0..postures.count() {
                        let at = p / stride % count;
                        if at > 0 {
                            ends.0.insert(p);
                        }
                        if at + 1 < *count {
                            ends.1.insert(p);
                        }
                    }
                    (*stride, ends.0, ends.1)
                };
                Self::Grid(axes.iter().map(axis).collect())
            }
            Steps::Roadmap(roadmap) => {
                let of = |own: &Vec<u32>| {
                    let mut set = Bits::EMPTY;
                    own.iter().for_each(|p| set.insert(*p as usize));
                    (own.clone(), set)
                };
                Self::Roadmap(roadmap.neighbours.iter().map(of).collect())
            }
        }
    }

    /// The set and all postures one step away, within `free`.
    pub fn dilate(&self, set: Bits<W>, free: Bits<W>) -> Bits<W> {
        let mut out = set;
        match self {
            Self::Grid(axes) => {
                for (stride, has_lower, has_upper) in axes {
                    out = out.or(set.and(*has_upper).up(*stride)).or(set.and(*has_lower).down(*stride));
                }
            }
            Self::Roadmap(neighbours) => set.iter().for_each(|p| out = out.or(neighbours[p].1)),
        }
        out.and(free)
    }

    /// All postures that can be reached from the set by steps within `free`.
    pub fn flood(&self, set: Bits<W>, free: Bits<W>) -> Bits<W> {
        let mut reached = set.and(free);
        let mut front = reached;
        while reached != free && !front.is_empty() {
            front = self.dilate(front, free).minus(reached);
            reached = reached.or(front);
        }
        reached
    }

    /// Tells the neighbours of one posture.
    pub fn each(&self, posture: usize, mut tell: impl FnMut(usize)) {
        match self {
            Self::Grid(axes) => {
                for (stride, has_lower, has_upper) in axes {
                    if has_lower.contains(posture) {
                        tell(posture - stride);
                    }
                    if has_upper.contains(posture) {
                        tell(posture + stride);
                    }
                }
            }
            Self::Roadmap(neighbours) => neighbours[posture].0.iter().for_each(|q| tell(*q as usize)),
        }
    }
}

/// How an end's postures lead out.
pub(super) struct WayOut {
    /// Steps of the roadmap that do not pass.
    pub blocked: Vec<[usize; 2]>,
    /// A posture of the end from which no way leads out, and those that it should lead to.
    pub shut_in: Option<(usize, Vec<usize>)>,
}

fn blocked(open: &BTreeMap<[usize; 2], bool>) -> Vec<[usize; 2]> {
    open.iter().filter(|(_, open)| !**open).map(|(step, _)| *step).collect()
}

/// Postures of a way without its ends: its corners, and between them every other one or fewer, so that there are no more than `most`. Where
/// there are more corners than that, so many of all.
fn thinned(way: &[Vec<f64>], most: usize) -> Vec<Vec<f64>> {
    let inner = way.len() - 2;
    let mut corners = vec![0];
    corners.extend((1..=inner).filter(|k| !straight(&way[k - 1], &way[*k], &way[k + 1])));
    corners.push(way.len() - 1);
    for every in 2..=inner.max(2) {
        let mut kept = Vec::new();
        for pair in corners.windows(2) {
            let (from, steps) = (pair[0], pair[1] - pair[0]);
            let parts = steps.div_ceil(every);
            kept.extend((1..=parts).map(|part| from + steps * part / parts));
        }
        kept.pop();
        if kept.len() <= most {
            return kept.into_iter().map(|k| way[k].clone()).collect();
        }
    }
    let every = inner.div_ceil(most.max(1)).max(2);
    (1..=inner).skip(every - 1).step_by(every).map(|k| way[k].clone()).collect()
}

/// Whether the steps from `a` by `b` to `c` go the same way.
pub(super) fn straight(a: &[f64], b: &[f64], c: &[f64]) -> bool {
    let norm = |p: &[f64], q: &[f64]| p.iter().zip(q).map(|(p, q)| (q - p) * (q - p)).sum::<f64>().sqrt();
    // The detour by b.
    norm(a, b) + norm(b, c) - norm(a, c) < 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn grid(counts: &[usize]) -> Postures {
        Postures::over(counts.iter().map(|c| (0..*c).map(|k| k as f64).collect()).collect())
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
    fn of_a_grid_the_nearest_posture_alone_agrees_with_what_is_asked_for() {
        let grid = grid(&[9, 5, 4]);
        for p in 0..180 {
            let asked: Vec<Option<f64>> = grid.joints(p).iter().map(|v| Some(v + 0.3)).collect();
            for q in 0..180 {
                assert_eq!(grid.agrees(q, End::Goal, &asked), p == q);
            }
            assert!(grid.agrees(p, End::Start, &[None; 3]));
        }
    }

    /// Postures in a row, of one joint that is its number, with a key at the far end and a short cut there from the second one.
    fn row(count: usize) -> Postures {
        let last = count - 1;
        // Keys come first: the far end is posture 0.
        let number = |p: usize| if p == 0 { last } else { p - 1 };
        let posture = |number: usize| if number == last { 0 } else { number + 1 };
        let of = |p: usize| {
            let at = number(p);
            let beside = [at.checked_sub(1), Some(at + 1)].into_iter().flatten().filter(|n| *n <= last);
            let short_cut = [(1, last), (last, 1)].into_iter().filter(|(from, _)| *from == at).map(|(_, to)| to);
            let mut own: Vec<u32> = beside.chain(short_cut).map(|n| posture(n) as u32).collect();
            own.sort_unstable();
            own
        };
        let neighbours = (0..count).map(of).collect();
        let ends = [vec![posture(0) as u32], vec![]];
        let roadmap = Roadmap { neighbours, step_time: 1.0, ends, keys: 1 };
        Postures { values: (0..count).map(|p| vec![number(p) as f64]).collect(), steps: Steps::Roadmap(roadmap) }
    }

    #[test]
    fn a_way_out_leads_round_steps_that_do_not_pass_and_tells_where_none_is_left() {
        let row = row(8);
        let neighbours = Neighbours::<1>::new(&row);
        let out = |free: Bits<1>, passes: &dyn Fn(f64, f64) -> bool| {
            row.way_out(&neighbours, End::Start, free, |a, b| passes(a[0].min(b[0]), a[0].max(b[0])))
                .expect("an end that is free")
        };
        let all = Bits::all(8);
        let way = out(all, &|_, _| true);
        assert!(way.blocked.is_empty() && way.shut_in.is_none());
        // The short cut is shut: on along the row.
        let way = out(all, &|a, b| b - a < 2.0);
        assert_eq!(way.blocked, [[0, 2]]);
        assert!(way.shut_in.is_none());
        let fewer = row.without(&way.blocked);
        let mut left = Bits::<1>::EMPTY;
        Neighbours::<1>::new(&fewer).each(0, |p| left.insert(p));
        assert_eq!(left.iter().collect::<Vec<_>>(), [7]);
        let way = out(all, &|a, b| b - a < 2.0 && a != 4.0);
        assert_eq!(way.blocked, [[0, 2], [5, 6]]);
        assert_eq!(way.shut_in, Some((1, vec![0])));
        let mut none = all;
        none.remove(1);
        assert!(row.way_out(&neighbours, End::Start, none, |_, _| true).is_none());
    }

    proptest! {
        #[test]
        fn of_a_way_its_corners_stay_and_no_more_postures_than_there_is_room_for(
            turns in prop::collection::vec((1usize..9, -3i32..4), 1..8), room in 1usize..60,
        ) {
            let mut way = vec![vec![0.0, 0.0]];
            for (steps, slope) in &turns {
                for _ in 0..*steps {
                    let last = way[way.len() - 1].clone();
                    way.push(vec![last[0] + 1.0, last[1] + f64::from(*slope)]);
                }
            }
            prop_assume!(way.len() > 2);
            let kept = thinned(&way, room);
            prop_assert!(kept.len() <= room);
            prop_assert!(kept.windows(2).all(|pair| pair[0][0] < pair[1][0]));
            let corners: Vec<&Vec<f64>> =
                way.windows(3).filter(|w| w[1][1] - w[0][1] != w[2][1] - w[1][1]).map(|w| &w[1]).collect();
            if corners.len() <= room {
                prop_assert!(corners.iter().all(|corner| kept.contains(corner)), "{:?} {:?}", corners, kept);
            }
        }
    }
}
