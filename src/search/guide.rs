//! A try before the search: a route through the middle of the free space, which often passes as it is.
//!
//! The lattice positions between start and goal are joined by the cheapest way in the plane, where being close to obstacles
//! costs; its corners make a route, checked like any other. Where it is blocked the place is made expensive, and the next
//! route tried. No route found this way proves nothing: then the search runs.

use super::astar::worth;
use super::heuristic::NEIGHBOURS;
use super::lattice::Lattice;
use super::queue::RadixHeap;
use super::route::Route;
use super::{Query, SearchOptions};
use crate::math::real;

/// Routes that are tried at least, and one more for so many metres from start to goal: a long way has more places to be blocked.
const TRIES: usize = 6;
const METRES_A_TRY: f64 = 3.0;
/// Clearance of the base's core beyond which more is no better, m.
const ROOM: f64 = 0.5;
/// What touching costs over having that room, in tenths of a straight step, try by try: first the short way, then the middle.
const TIGHT: [u32; 3] = [10, 30, 80];
/// Corners are kept where the way bends by more than this, m: coarse on the first try, fine later.
const BEND: [f64; 2] = [0.04, 0.02];
/// Tenths that the estimate weighs; more than 10 finds ways sooner that are up to that much dearer than the cheapest. It was no
/// faster on Table I, and missed the way through the arches.
const WEIGHT: u32 = 10;
/// What a place that blocked a route costs more, and how far about it (m).
const BLOCKED: (u16, f64) = (6, 0.2);

/// Routes that are worth a try.
pub(super) fn tries(query: &Query) -> usize {
    TRIES + (query.start.distance(query.goal) / METRES_A_TRY) as usize
}

/// How tight a position is: not known yet, or not passable, or else more than these, up to `TIGHTEST`.
const UNKNOWN: u8 = 0;
const CLOSED: u8 = 1;
const ROOMY: u8 = 2;
const TIGHTEST: u8 = 255;
/// In place of a step: reached, and its cost final.
const DONE: u8 = 0x80;

/// What is known of a position. All zero: nothing.
#[derive(Clone, Copy, Default)]
struct Place {
    /// Cost to it plus one; zero where it was not reached.
    best: u32,
    /// What blocked places cost more, less one.
    extra: u16,
    tight: u8,
    /// Number of the step that led here, and [`DONE`].
    came: u8,
}

/// `clearance` is that of the base's core at a position, m; it is asked only where a way may come by.
pub(super) struct Guide<'a, C: Fn([f64; 2]) -> f64> {
    lattice: &'a Lattice,
    clearance: C,
    /// Where the clearance is below this nothing passes, m.
    least: f64,
    places: Vec<Place>,
    /// Those that were reached on this try.
    reached: Vec<u32>,
    open: RadixHeap,
}

impl<'a, C: Fn([f64; 2]) -> f64> Guide<'a, C> {
    pub fn new(lattice: &'a Lattice, clearance: C, least: f64) -> Self {
        // All zero, so memory that no way comes by is never touched.
        let places = vec![Place::default(); lattice.size[0] as usize * lattice.size[1] as usize];
        Self { lattice, clearance, least, places, reached: Vec::new(), open: RadixHeap::new() }
    }

    /// The route along the cheapest way. `None`: there is none in the plane.
    pub fn route(&mut self, query: &Query, options: &SearchOptions, attempt: usize) -> Option<Route> {
        if options.reverse && attempt > 2 {
            return None; // backing up may be what it takes: leave that to the search
        }
        let ends = [[query.start.x, query.start.y], [query.goal.x, query.goal.y]];
        let way = self.way(ends, TIGHT[attempt.min(TIGHT.len() - 1)])?;
        let mut points = vec![[query.start.x, query.start.y]];
        points.extend(way);
        points.push([query.goal.x, query.goal.y]);
        let corners = corners(&points, BEND[attempt.min(1)]);
        let driven = |reverse: bool| {
            let mut route = Route::new(query.start);
            corners.iter().for_each(|point| route.drive_to(*point, reverse));
            route.end_with(query.goal_yaw);
            route
        };
        let forward = driven(false);
        let backward = options.reverse.then(|| driven(true)).filter(|b| worth(b) < worth(&forward));
        Some(backward.unwrap_or(forward))
    }

    /// Makes the surroundings of a place expensive.
    pub fn avoid(&mut self, place: [f64; 2]) {
        let (factor, radius) = BLOCKED;
        let at = self.lattice.coordinates(place[0], place[1]);
        let reach = radius / self.lattice.step;
        let range = |d: usize| (at[d] - reach).ceil() as i32..=(at[d] + reach).floor() as i32;
        for i in range(0) {
            for j in range(1) {
                let near = real::hypot(f64::from(i) - at[0], f64::from(j) - at[1]) <= reach;
                if near && self.lattice.contains(i, j) {
                    let own = &mut self.places[self.lattice.index(i, j)].extra;
                    *own = ((*own + 1) * factor).min(1_000) - 1;
                }
            }
        }
    }

    /// How tight a position is; `CLOSED`: not passable.
    fn tight(&self, i: i32, j: i32) -> u8 {
        let room = (self.clearance)(self.lattice.position(i, j)) - self.least;
        let tight = ((ROOM - room) / ROOM).clamp(0.0, 1.0);
        let span = f64::from(TIGHTEST - ROOMY);
        if room >= 0.0 { ROOMY + (span * tight * tight) as u8 } else { CLOSED }
    }

    /// Positions of the cheapest way between the lattice positions nearest to two points (A*; the estimate is that of an
    /// empty plane, weighed).
    fn way(&mut self, [from, to]: [[f64; 2]; 2], touching: u32) -> Option<Vec<[f64; 2]>> {
        let nearest = |p: [f64; 2]| {
            let [i, j] = self.lattice.coordinates(p[0], p[1]).map(|v| v.round() as i32);
            self.lattice.contains(i, j).then_some((i, j))
        };
        let (from, to) = (nearest(from)?, nearest(to)?);
        let to_go = |(i, j): (i32, i32)| {
            let (di, dj) = ((i - to.0).unsigned_abs(), (j - to.1).unsigned_abs());
            (10 * di.max(dj) + 4 * di.min(dj)) * WEIGHT / 10
        };
        let row = self.lattice.size[1];
        let (first, goal) = (self.lattice.index(from.0, from.1), self.lattice.index(to.0, to.1));
        for index in self.reached.drain(..) {
            let place = &mut self.places[index as usize];
            (place.best, place.came) = (0, 0);
        }
        self.open.clear();
        self.places[first].best = 1;
        self.reached.push(first as u32);
        self.open.push(to_go(from), first as u32);
        while let Some((estimate, index)) = self.open.pop() {
            let here = &mut self.places[index as usize];
            if here.came & DONE != 0 {
                continue;
            }
            here.came |= DONE;
            let own = here.best;
            if index as usize == goal {
                break;
            }
            let at = (index as i32 / row, index as i32 % row);
            for (k, (di, dj, length)) in NEIGHBOURS.iter().enumerate() {
                let next = (at.0 + di, at.1 + dj);
                if !self.lattice.contains(next.0, next.1) {
                    continue;
                }
                let there = self.lattice.index(next.0, next.1);
                let place = self.places[there];
                // Most were reached no dearer, however roomy they are.
                if place.came & DONE != 0 || place.tight == CLOSED || place.best != 0 && place.best <= own + length {
                    continue;
                }
                let mut tight = place.tight;
                if tight == UNKNOWN {
                    tight = self.tight(next.0, next.1);
                    // The goal itself was found free; how its surroundings look is only a guess.
                    if tight == CLOSED && there == goal {
                        tight = TIGHTEST;
                    }
                    self.places[there].tight = tight;
                    if tight == CLOSED {
                        continue;
                    }
                }
                let dear = 10 + touching * u32::from(tight - ROOMY) / u32::from(TIGHTEST - ROOMY);
                let cost = own + dear * (1 + u32::from(place.extra)) * length / 10;
                if place.best == 0 || cost < place.best {
                    if place.best == 0 {
                        self.reached.push(there as u32);
                    }
                    let place = &mut self.places[there];
                    (place.best, place.came) = (cost, k as u8);
                    // A weighed estimate may fall: the queue wants one that does not.
                    self.open.push(estimate.max(cost + to_go(next)), there as u32);
                }
            }
        }
        if self.places[goal].best == 0 {
            return None;
        }
        let mut at = to;
        let mut way = Vec::new();
        while at != from {
            way.push(self.lattice.position(at.0, at.1));
            let (di, dj, _) = NEIGHBOURS[usize::from(self.places[self.lattice.index(at.0, at.1)].came & !DONE)];
            at = (at.0 - di, at.1 - dj);
        }
        // The ends are not the exact start and goal: the first and last steps would only wiggle.
        way.reverse();
        way.pop();
        Some(way.into_iter().skip(1).collect())
    }
}

/// The points but the first that are needed to stay within `bend` of all of them (Ramer 1972; Douglas & Peucker 1973).
fn corners(points: &[[f64; 2]], bend: f64) -> Vec<[f64; 2]> {
    let mut keep = vec![false; points.len()];
    let mut open = vec![(0, points.len() - 1)];
    while let Some((a, b)) = open.pop() {
        keep[b] = true;
        let (p, q) = (points[a], points[b]);
        let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
        let length = real::hypot(dx, dy);
        let off = |r: [f64; 2]| {
            let (ex, ey) = (r[0] - p[0], r[1] - p[1]);
            if length > 0.0 { (dx * ey - dy * ex).abs() / length } else { real::hypot(ex, ey) }
        };
        let farthest = (a + 1..b).map(|k| (off(points[k]), k)).max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, k)) = farthest.filter(|(distance, _)| *distance > bend) {
            open.push((a, k));
            open.push((k, b));
        }
    }
    points.iter().zip(keep).filter(|(_, keep)| *keep).map(|(p, _)| *p).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::VoxelMap;
    use crate::mission::Unknown;

    #[test]
    fn the_way_keeps_to_the_middle_of_a_corridor_and_goes_round_what_is_avoided() {
        let lattice = Lattice::new(&VoxelMap::new(0.05, [0.0; 3], [60, 40, 1], Unknown::Occupied));
        let edge = |v: f64, length: f64| v.min(length - v);
        let clearance = |[x, y]: [f64; 2]| edge(x, 3.0).min(edge(y, 2.0));
        let mut guide = Guide::new(&lattice, clearance, 0.02);
        let middle = guide.way([[0.3, 1.0], [2.7, 1.0]], 80).expect("free");
        assert!(middle.iter().all(|p| (p[1] - 1.0).abs() < 0.06), "{middle:?}");
        guide.avoid([1.5, 1.0]);
        let around = guide.way([[0.3, 1.0], [2.7, 1.0]], 80).expect("free");
        assert!(around.iter().all(|p| real::hypot(p[0] - 1.5, p[1] - 1.0) > 0.19), "{around:?}");
    }

    #[test]
    fn corners_stay_within_the_bend() {
        let points: Vec<[f64; 2]> = (0..100).map(|k| [0.05 * f64::from(k), real::sin(0.05 * f64::from(k))]).collect();
        let kept = corners(&points, 0.03);
        assert!(kept.len() < 20 && kept.last() == points.last());
        let mut all = vec![points[0]];
        all.extend(&kept);
        for p in &points {
            let off = all.windows(2).map(|w| {
                let (dx, dy) = (w[1][0] - w[0][0], w[1][1] - w[0][1]);
                let share = (((p[0] - w[0][0]) * dx + (p[1] - w[0][1]) * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
                real::hypot(p[0] - w[0][0] - share * dx, p[1] - w[0][1] - share * dy)
            });
            assert!(off.fold(f64::INFINITY, f64::min) <= 0.03 + 1e-9);
        }
    }
}
