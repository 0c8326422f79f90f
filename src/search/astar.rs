//! Weighted A* over the lattice. A label carries a set of postures: all that can be reached by then. So one joint (or three)
//! is searched at the cost of none: postures spread within the free ones of each move, and the joint path is chosen at the
//! end (`joints`). A label is expanded only with postures that no earlier label had at its state, so the search ends, and
//! says «none» only when every state that can be reached was looked at.

use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap};
use std::hash::{BuildHasherDefault, Hasher};

use super::collide::{BaseMotion, Collider};
use super::heuristic::CostToGo;
use super::lattice::{HEADINGS, Lattice, LatticeState, heading_angle, nearest_heading};
use super::posture::Bits;
use super::route::{Grain, Route};
use super::{Query, SearchOptions};
use crate::geom::{Pose2, wrap_angle};

/// How much the estimate weighs: paths are at most this much longer than the lattice's best.
const WEIGHT: f64 = 1.4;
/// Metres of driving that a radian of turning is worth.
pub(super) const TURN_COST: f64 = 0.3;
/// What backing up costs over driving forward.
const REVERSE_COST: f64 = 1.5;
/// Labels after which the search gives up, so that memory stays bounded.
const MOST_LABELS: usize = 20_000_000;

/// What the search found.
pub(super) enum Outcome {
    Found {
        route: Route,
        expanded: usize,
    },
    /// Every state that can be reached was expanded. The reached pose nearest to the goal.
    Exhausted {
        closest: Pose2,
        expanded: usize,
    },
    /// [`MOST_LABELS`] were made.
    Limit {
        labels: usize,
    },
}

/// Keys are well spread by one multiplication; the map is never iterated.
#[derive(Default)]
struct KeyHasher(u64);

impl Hasher for KeyHasher {
    fn finish(&self) -> u64 {
        self.0
    }
    fn write(&mut self, bytes: &[u8]) {
        for b in bytes {
            self.write_u64(u64::from(*b));
        }
    }
    fn write_u64(&mut self, key: u64) {
        let mixed = (self.0 ^ key).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        self.0 = mixed ^ (mixed >> 32);
    }
}

type KeyMap<V> = HashMap<u64, V, BuildHasherDefault<KeyHasher>>;

struct Label<const W: usize> {
    state: LatticeState,
    parent: u32,
    cost: f64,
    postures: Bits<W>,
    /// How it was reached.
    step: Step,
}

#[derive(Clone, Copy)]
enum Step {
    /// Straight from the start: spin, drive, spin.
    Start,
    Spin,
    /// Straight from the parent's position.
    Drive {
        reverse: bool,
    },
    /// From the parent to the exact goal: spin, drive, spin.
    Goal {
        reverse: bool,
    },
}

struct Open {
    estimate: f64,
    label: u32,
}

impl Ord for Open {
    fn cmp(&self, other: &Self) -> Ordering {
        // A max-heap: least estimate first; the newer label among equals, which goes deep.
        other.estimate.total_cmp(&self.estimate).then(self.label.cmp(&other.label))
    }
}

impl PartialOrd for Open {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Open {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Open {}

pub(super) struct AStar<'a, const W: usize> {
    pub lattice: &'a Lattice,
    pub collider: &'a Collider<'a, W>,
    pub cost_to_go: &'a CostToGo,
    /// Clearance of the robot's core at each position, m; for a quick look along a line.
    pub core: &'a [f32],
    pub query: &'a Query,
    pub options: &'a SearchOptions,
    pub start_postures: Bits<W>,
    pub goal_postures: Bits<W>,
}

/// What changes while it runs.
struct Run<const W: usize> {
    labels: Vec<Label<W>>,
    open: BinaryHeap<Open>,
    closed: KeyMap<Bits<W>>,
    moves: KeyMap<Bits<W>>,
}

const NO_PARENT: u32 = u32::MAX;

impl<const W: usize> AStar<'_, W> {
    pub fn search(&self) -> Outcome {
        let mut run =
            Run { labels: Vec::new(), open: BinaryHeap::new(), closed: KeyMap::default(), moves: KeyMap::default() };
        if let Some(route) = self.straight_to_goal() {
            return Outcome::Found { route, expanded: 0 };
        }
        self.leave_start(&mut run);
        let mut expanded = 0;
        let mut since_shot = usize::MAX / 2;
        let mut closest = (f64::INFINITY, self.query.start);
        while let Some(Open { label, .. }) = run.open.pop() {
            let at = label as usize;
            if let Step::Goal { .. } = run.labels[at].step {
                return Outcome::Found { route: self.route(&run, label), expanded };
            }
            let state = run.labels[at].state;
            let closed = run.closed.entry(self.key(state)).or_insert(Bits::EMPTY);
            let fresh = run.labels[at].postures.minus(*closed);
            if fresh.is_empty() {
                continue;
            }
            *closed = closed.or(fresh);
            expanded += 1;
            let to_go = self.estimate(state);
            if to_go < closest.0 {
                closest = (to_go, self.lattice.pose(state));
            }
            since_shot = since_shot.saturating_add(1);
            if since_shot as f64 >= to_go / 0.3 || to_go < 0.4 {
                since_shot = 0;
                self.try_goal(&mut run, label);
            }
            self.expand(&mut run, label, fresh);
            if run.labels.len() > MOST_LABELS {
                return Outcome::Limit { labels: run.labels.len() };
            }
        }
        Outcome::Exhausted { closest: closest.1, expanded }
    }

    fn key(&self, state: LatticeState) -> u64 {
        (self.lattice.index(state.i, state.j) * HEADINGS) as u64 + state.heading as u64
    }

    /// Cost to go; far where the plane says it is shut off (then the search still looks, last).
    fn estimate(&self, state: LatticeState) -> f64 {
        self.cost_to_go.at(self.lattice, state.i, state.j).unwrap_or(1e6)
    }

    fn push(&self, run: &mut Run<W>, label: Label<W>) {
        let to_go = if let Step::Goal { .. } = label.step { 0.0 } else { self.estimate(label.state) };
        run.open.push(Open { estimate: label.cost + WEIGHT * to_go, label: run.labels.len() as u32 });
        run.labels.push(label);
    }

    /// Postures that get through all pieces of a motion.
    fn pass(&self, postures: Bits<W>, pieces: impl IntoIterator<Item = BaseMotion>) -> Bits<W> {
        let mut reached = postures;
        for piece in pieces {
            reached = self.collider.neighbours.flood(reached, self.collider.free(&piece));
            if reached.is_empty() {
                break;
            }
        }
        reached
    }

    fn straight_to_goal(&self) -> Option<Route> {
        let start = self.query.start;
        self.shots(start).find_map(|(route, pieces, _)| {
            (!self.pass(self.start_postures, pieces).and(self.goal_postures).is_empty()).then_some(route)
        })
    }

    /// Ways straight to the goal from a pose: forward, and backwards where allowed.
    fn shots(&self, from: Pose2) -> impl Iterator<Item = (Route, Vec<BaseMotion>, bool)> + '_ {
        let goal = self.query.goal;
        [false, true].into_iter().filter(|reverse| !reverse || self.options.reverse).map(move |reverse| {
            let mut route = Route::new(from);
            route.drive_to([goal.x, goal.y], reverse);
            route.end_with(self.query.goal_yaw);
            let pieces = route.pieces(Grain::COARSE);
            (route, pieces, reverse)
        })
    }

    fn try_goal(&self, run: &mut Run<W>, parent: u32) {
        let Label { state, postures, cost, .. } = run.labels[parent as usize];
        let from = self.lattice.pose(state);
        if !self.line_of_sight([from.x, from.y], [self.query.goal.x, self.query.goal.y]) {
            return;
        }
        let found: Vec<(f64, bool)> = self
            .shots(from)
            .filter_map(|(route, pieces, reverse)| {
                let reached = self.pass(postures, pieces).and(self.goal_postures);
                (!reached.is_empty()).then(|| (route.cost(TURN_COST, REVERSE_COST), reverse))
            })
            .collect();
        for (more, reverse) in found {
            let step = Step::Goal { reverse };
            self.push(run, Label { state, parent, cost: cost + more, postures, step });
        }
    }

    /// Whether the core could pass along a line: a quick look that only ever says no where nothing could pass.
    fn line_of_sight(&self, from: [f64; 2], to: [f64; 2]) -> bool {
        let [a, b] = [from, to].map(|p| self.lattice.coordinates(p[0], p[1]));
        let steps = (a[0] - b[0]).hypot(a[1] - b[1]).ceil().max(1.0);
        let least = self.options.clearance - 0.75 * self.lattice.step - 0.87 * self.collider.resolution();
        (0..=steps as usize).all(|k| {
            let share = k as f64 / steps;
            let [i, j] = [0, 1].map(|d| (a[d] + share * (b[d] - a[d])).round() as i32);
            self.lattice.contains(i, j) && f64::from(self.core[self.lattice.index(i, j)]) >= least
        })
    }

    /// Labels for lattice states near the start, each reached by spin, drive, spin.
    fn leave_start(&self, run: &mut Run<W>) {
        let start = self.query.start;
        let at = self.lattice.coordinates(start.x, start.y);
        let centre = at.map(|v| v.round() as i32);
        for di in -10..=10 {
            for dj in -10..=10 {
                let (i, j) = (centre[0] + di, centre[1] + dj);
                if !self.lattice.contains(i, j) {
                    continue;
                }
                let offset = [f64::from(i) - at[0], f64::from(j) - at[1]];
                let steps = offset[0].hypot(offset[1]);
                for reverse in [false, true] {
                    if reverse && !self.options.reverse {
                        continue;
                    }
                    let mut route = Route::new(start);
                    if steps > 1e-6 {
                        route.drive_to(self.lattice.position(i, j), reverse);
                        // All near positions, and those farther off that lie ahead: a start in a slot cannot spin.
                        let off = wrap_angle(route.end_yaw() - start.yaw).abs();
                        if steps > 2.3 && (off > 0.12 || !(4.0..10.0).contains(&steps)) {
                            continue;
                        }
                    } else if reverse {
                        continue;
                    }
                    let heading = nearest_heading(route.end_yaw());
                    route.end_with(Some(heading_angle(heading)));
                    let postures = self.pass(self.start_postures, route.pieces(Grain::COARSE));
                    if !postures.is_empty() {
                        let state = LatticeState { i, j, heading };
                        let cost = route.cost(TURN_COST, REVERSE_COST);
                        let reverse_drive = if reverse { Step::Drive { reverse } } else { Step::Start };
                        self.push(run, Label { state, parent: NO_PARENT, cost, postures, step: reverse_drive });
                    }
                }
            }
        }
    }

    fn expand(&self, run: &mut Run<W>, parent: u32, fresh: Bits<W>) {
        let Label { state, cost, .. } = run.labels[parent as usize];
        let pose = self.lattice.pose(state);
        let turn = std::f64::consts::TAU / HEADINGS as f64;
        for sign in [1, -1] {
            let heading = (state.heading + sign).rem_euclid(HEADINGS as i32);
            let target = LatticeState { heading, ..state };
            // One key for a spin and its way back: the lower heading, counted around.
            let lower = if sign > 0 { state } else { target };
            let motion = BaseMotion { from: pose, to: Pose2 { yaw: pose.yaw + f64::from(sign) * turn, ..pose } };
            let edge = self.key(lower) * 8;
            self.step_to(run, parent, fresh, target, cost + TURN_COST * turn, Step::Spin, edge, || vec![motion]);
        }
        for reverse in [false, true] {
            if reverse && !self.options.reverse {
                continue;
            }
            let along =
                if reverse { (state.heading + HEADINGS as i32 / 2).rem_euclid(HEADINGS as i32) } else { state.heading };
            for (index, drive) in self.lattice.drives(along).iter().enumerate() {
                let (i, j) = (state.i + drive.di, state.j + drive.dj);
                if !self.lattice.contains(i, j) {
                    continue;
                }
                let target = LatticeState { i, j, heading: state.heading };
                let pieces = || {
                    let mut route = Route::new(pose);
                    route.drive_to(self.lattice.position(i, j), reverse);
                    route.end_with(Some(pose.yaw));
                    route.pieces(Grain::COARSE)
                };
                let more = drive.length * if reverse { REVERSE_COST } else { 1.0 };
                let edge = self.key(state) * 8 + 1 + 2 * index as u64 + u64::from(reverse);
                self.step_to(run, parent, fresh, target, cost + more, Step::Drive { reverse }, edge, pieces);
            }
        }
    }

    #[allow(clippy::too_many_arguments)] // one private call shape for both kinds of move
    fn step_to(
        &self,
        run: &mut Run<W>,
        parent: u32,
        from: Bits<W>,
        target: LatticeState,
        cost: f64,
        step: Step,
        edge: u64,
        pieces: impl FnOnce() -> Vec<BaseMotion>,
    ) {
        let closed = run.closed.get(&self.key(target)).copied().unwrap_or(Bits::EMPTY);
        if closed == self.collider.all() {
            return;
        }
        let free = *run.moves.entry(edge).or_insert_with(|| {
            let mut free = self.collider.all();
            for piece in pieces() {
                free = free.and(self.collider.free(&piece));
                if free.is_empty() {
                    break;
                }
            }
            free
        });
        let postures = self.collider.neighbours.flood(from, free);
        if !postures.minus(closed).is_empty() {
            self.push(run, Label { state: target, parent, cost, postures, step });
        }
    }

    /// The base's route behind a goal label.
    fn route(&self, run: &Run<W>, goal: u32) -> Route {
        let mut chain = Vec::new();
        let mut at = goal;
        while at != NO_PARENT {
            chain.push(&run.labels[at as usize]);
            at = run.labels[at as usize].parent;
        }
        chain.reverse();
        let mut route = Route::new(self.query.start);
        for label in chain {
            let place = self.lattice.position(label.state.i, label.state.j);
            let heading = heading_angle(label.state.heading);
            match label.step {
                Step::Start => {
                    route.drive_to(place, false);
                    route.end_with(Some(heading));
                }
                Step::Spin => route.end_with(Some(heading)),
                Step::Drive { reverse } => {
                    route.drive_to(place, reverse);
                    route.end_with(Some(heading));
                }
                Step::Goal { reverse } => {
                    route.drive_to([self.query.goal.x, self.query.goal.y], reverse);
                    route.end_with(self.query.goal_yaw);
                }
            }
        }
        route
    }
}
