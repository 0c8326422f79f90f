//! Weighted A* over the lattice. A label carries a set of postures: all that can be reached by then. So one joint (or three)
//! is searched at the cost of none: postures spread within the free ones of each move, and the joint path is chosen at the
//! end (`joints`). A label is expanded only with postures that no earlier label had at its state, so the search ends, and
//! says «none» only when every state that can be reached was looked at.

use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap};
use std::hash::{BuildHasherDefault, Hasher};

use super::bits::Bits;
use super::collide::{BaseMotion, Collider};
use super::heuristic::CostToGo;
use super::lattice::{HEADINGS, Lattice, LatticeState, heading_angle, nearest_heading};
use super::route::{Grain, Route};
use super::{Query, SearchOptions, region};
use crate::geom::{Pose2, wrap_angle};
use crate::math::real;

/// How much the estimate weighs: paths are at most this much longer than the lattice's best.
const WEIGHT: f64 = 1.4;
/// Metres of driving that a radian of turning is worth.
pub(super) const TURN_COST: f64 = 0.3;
/// What backing up costs over driving forward.
const REVERSE_COST: f64 = 1.5;
/// Labels after which the search gives up, so that memory stays bounded.
pub(super) const MOST_LABELS: usize = 20_000_000;

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
    /// As many were made as may be.
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
    pub core_clearances: &'a [f32],
    /// Whether the small turns into and out of a drive's exact direction are checked on the way, not only at the end.
    pub strict: bool,
    pub query: &'a Query,
    pub options: &'a SearchOptions,
    /// Labels after which it gives up.
    pub most_labels: usize,
    pub start_postures: Bits<W>,
    pub goal_postures: Bits<W>,
}

/// Routes straight from start to goal, not yet checked, the cheapest first.
pub(super) fn straight_to_goal(query: &Query, options: &SearchOptions) -> Vec<Route> {
    let mut routes: Vec<Route> = shots(query.start, query, options).map(|(route, _)| route).collect();
    routes.sort_by(|a, b| worth(a).total_cmp(&worth(b)));
    routes
}

/// What a route is worth, m.
pub(super) fn worth(route: &Route) -> f64 {
    route.cost(TURN_COST, REVERSE_COST)
}

/// Spin, drive, spin to the goal: forward, and backwards where allowed.
fn shots<'a>(from: Pose2, query: &'a Query, options: &SearchOptions) -> impl Iterator<Item = (Route, bool)> + 'a {
    let senses: &[bool] = if options.reverse { &[false, true] } else { &[false] };
    senses.iter().copied().map(move |reverse| {
        let mut route = Route::new(from);
        route.drive_to(region::nearest(query, [from.x, from.y]), reverse);
        route.end_with(query.goal_yaw);
        (route, reverse)
    })
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
            let key = self.key(state);
            let closed = run.closed.get(&key).copied().unwrap_or(Bits::EMPTY);
            if closed == self.collider.all() {
                continue;
            }
            // Moves are checked only now: most labels are never looked at again.
            let free = self.free_along(&mut run, label);
            let reached = self.collider.neighbours.flood(run.labels[at].postures, free);
            let fresh = reached.minus(closed);
            if fresh.is_empty() {
                continue;
            }
            run.labels[at].postures = reached;
            run.closed.insert(key, closed.or(fresh));
            expanded += 1;
            let to_go = self.cost_to_go.at(self.lattice, self.lattice.pose(state)).unwrap_or(f64::INFINITY);
            if to_go < closest.0 {
                closest = (to_go, self.lattice.pose(state));
            }
            since_shot = since_shot.saturating_add(1);
            if since_shot as f64 >= to_go / 0.3 || to_go < 0.4 {
                since_shot = 0;
                self.try_goal(&mut run, label);
            }
            self.expand(&mut run, label, fresh);
            if run.labels.len() > self.most_labels {
                return Outcome::Limit { labels: run.labels.len() };
            }
        }
        Outcome::Exhausted { closest: closest.1, expanded }
    }

    fn key(&self, state: LatticeState) -> u64 {
        (self.lattice.index(state.i, state.j) * HEADINGS) as u64 + state.heading as u64
    }

    fn push(&self, run: &mut Run<W>, label: Label<W>) {
        let to_go = match label.step {
            Step::Goal { .. } => 0.0,
            _ => match self.cost_to_go.at(self.lattice, self.lattice.pose(label.state)) {
                Some(to_go) => to_go,
                // Shut off: no motion leads from there to the goal.
                None => return,
            },
        };
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

    /// Ways straight to the goal from a pose, with their pieces.
    fn shots(&self, from: Pose2) -> impl Iterator<Item = (Route, Vec<BaseMotion>, bool)> + '_ {
        shots(from, self.query, self.options).map(|(route, reverse)| {
            let pieces = route.pieces(Grain::COARSE);
            (route, pieces, reverse)
        })
    }

    fn try_goal(&self, run: &mut Run<W>, parent: u32) {
        let Label { state, postures, cost, .. } = run.labels[parent as usize];
        let from = self.lattice.pose(state);
        let found: Vec<(f64, bool)> = self
            .shots(from)
            .filter_map(|(route, pieces, reverse)| {
                if !self.in_sight(&pieces) {
                    return None;
                }
                let reached = self.pass(postures, pieces).and(self.goal_postures);
                (!reached.is_empty()).then(|| (worth(&route), reverse))
            })
            .collect();
        for (more, reverse) in found {
            let step = Step::Goal { reverse };
            self.push(run, Label { state, parent, cost: cost + more, postures, step });
        }
    }

    /// A quick look along the drives of a shot.
    fn in_sight(&self, pieces: &[BaseMotion]) -> bool {
        let mut drives = pieces.iter().filter(|p| p.from.distance(p.to) > 0.0);
        let Some(first) = drives.next() else { return true };
        let last = drives.next_back().unwrap_or(first);
        let clearance = self.options.clearance;
        let resolution = self.collider.resolution();
        self.cost_to_go.line_of_sight(self.lattice, self.core_clearances, resolution, clearance, [first.from, last.to])
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
                let steps = real::hypot(offset[0], offset[1]);
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
                        let cost = worth(&route);
                        let reverse_drive = if reverse { Step::Drive { reverse } } else { Step::Start };
                        self.push(run, Label { state, parent: NO_PARENT, cost, postures, step: reverse_drive });
                    }
                }
            }
        }
    }

    /// Labels for all moves from a state, not yet checked: they carry the postures of their parent.
    fn expand(&self, run: &mut Run<W>, parent: u32, fresh: Bits<W>) {
        let Label { state, cost, .. } = run.labels[parent as usize];
        let turn = std::f64::consts::TAU / HEADINGS as f64;
        for sign in [1, -1] {
            let heading = (state.heading + sign).rem_euclid(HEADINGS as i32);
            let target = LatticeState { heading, ..state };
            self.offer(
                run,
                Label { state: target, parent, cost: cost + TURN_COST * turn, postures: fresh, step: Step::Spin },
            );
        }
        for reverse in [false, true] {
            if reverse && !self.options.reverse {
                continue;
            }
            let along =
                if reverse { (state.heading + HEADINGS as i32 / 2).rem_euclid(HEADINGS as i32) } else { state.heading };
            for drive in self.lattice.drives(along) {
                let target = LatticeState { i: state.i + drive.di, j: state.j + drive.dj, ..state };
                if self.lattice.contains(target.i, target.j) {
                    let cost = cost + drive.length * if reverse { REVERSE_COST } else { 1.0 };
                    self.offer(
                        run,
                        Label { state: target, parent, cost, postures: fresh, step: Step::Drive { reverse } },
                    );
                }
            }
        }
    }

    /// Pushes a label unless its state is done with.
    fn offer(&self, run: &mut Run<W>, label: Label<W>) {
        let closed = run.closed.get(&self.key(label.state)).copied().unwrap_or(Bits::EMPTY);
        if closed != self.collider.all() {
            self.push(run, label);
        }
    }

    /// Postures that are free all along the move to a label from its parent.
    fn free_along(&self, run: &mut Run<W>, label: u32) -> Bits<W> {
        let Label { state, parent, step, .. } = run.labels[label as usize];
        if parent == NO_PARENT {
            return self.collider.all();
        }
        let from = run.labels[parent as usize].state;
        let (edge, pieces) = match step {
            Step::Spin => {
                // One key for a spin and its way back: the lower heading, counted around.
                let up = (from.heading + 1).rem_euclid(HEADINGS as i32) == state.heading;
                let pose = self.lattice.pose(from);
                let turn = std::f64::consts::TAU / HEADINGS as f64 * if up { 1.0 } else { -1.0 };
                let motion = BaseMotion { from: pose, to: Pose2 { yaw: pose.yaw + turn, ..pose } };
                (self.key(if up { from } else { state }) * 8, vec![motion])
            }
            Step::Drive { reverse } => {
                let pose = self.lattice.pose(from);
                let mut route = Route::new(pose);
                route.drive_to(self.lattice.position(state.i, state.j), reverse);
                let mut pieces = route.pieces(Grain::COARSE);
                if self.strict {
                    route.end_with(Some(pose.yaw));
                    pieces = route.pieces(Grain::COARSE);
                } else {
                    pieces.retain(|p| p.from.distance(p.to) > 0.0);
                }
                let half = if reverse { HEADINGS as i32 / 2 } else { 0 };
                let drives = self.lattice.drives((from.heading + half).rem_euclid(HEADINGS as i32));
                let second = drives[0].di != state.i - from.i || drives[0].dj != state.j - from.j;
                let code = 1 + 2 * u64::from(second) + u64::from(reverse);
                (self.key(from) * 8 + code, pieces)
            }
            Step::Start | Step::Goal { .. } => return self.collider.all(),
        };
        if let Some(known) = run.moves.get(&edge) {
            return *known;
        }
        let mut free = self.collider.all();
        for piece in pieces {
            free = free.and(self.collider.free(&piece));
            if free.is_empty() {
                break;
            }
        }
        run.moves.insert(edge, free);
        free
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
                Step::Spin => route.spin_to(heading),
                Step::Drive { reverse } => {
                    route.drive_to(place, reverse);
                    route.end_with(Some(heading));
                }
                Step::Goal { reverse } => {
                    route.drive_to(region::nearest(self.query, place), reverse);
                    route.end_with(self.query.goal_yaw);
                }
            }
        }
        route
    }
}
