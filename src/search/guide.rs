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
/// ... or, where such a route is blocked, by more than this share of the room there is, but not by less than this, m: finer ways turn at
/// every other position, and robots are blocked where they turn.
const OF_ROOM: f64 = 0.7;
const LEAST_BEND: f64 = 0.01;
/// In the middle of a gap between two positions: as much, m.
const BESIDE: f64 = 0.002;
/// Share of a step by which the clearance rises at most beside a position in the middle of a gap.
const RISING: f64 = 0.6;
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

/// Whether there is room at a position, exactly.
pub(super) type Fits<'a> = Box<dyn Fn([f64; 2]) -> bool + 'a>;

/// `clearance` is that of the base's core at a position, m; it is asked only where a way may come by, and `fits` where that is between
/// lattice positions.
pub(super) struct Guide<'a, C: Fn([f64; 2]) -> f64> {
    lattice: &'a Lattice,
    clearance: C,
    fits: Fits<'a>,
    /// Where the clearance is below this nothing passes, m.
    least: f64,
    places: Vec<Place>,
    /// Those that were reached on this try.
    reached: Vec<u32>,
    open: RadixHeap,
}

impl<'a, C: Fn([f64; 2]) -> f64> Guide<'a, C> {
    pub fn new(lattice: &'a Lattice, clearance: C, fits: Fits<'a>, least: f64) -> Self {
        // All zero, so memory that no way comes by is never touched.
        let places = vec![Place::default(); lattice.size[0] as usize * lattice.size[1] as usize];
        Self { lattice, clearance, fits, least, places, reached: Vec::new(), open: RadixHeap::new() }
    }

    /// Routes along the cheapest way, with few corners and, if that is another one, with as many as the room along it asks for. `None`:
    /// there is no way in the plane.
    pub fn routes(&mut self, query: &Query, options: &SearchOptions, attempt: usize) -> Option<Vec<Route>> {
        if options.reverse && attempt > 2 {
            return None; // backing up may be what it takes: leave that to the search
        }
        let ends = [[query.start.x, query.start.y], [query.goal.x, query.goal.y]];
        let way = self.way(ends, TIGHT[attempt.min(TIGHT.len() - 1)])?;
        let mut points = vec![([query.start.x, query.start.y], 0.0)];
        points.extend(way);
        points.push(([query.goal.x, query.goal.y], 0.0));
        let few = corners(&points, BEND[attempt.min(1)], f64::INFINITY);
        let many = corners(&points, BEND[attempt.min(1)], OF_ROOM);
        let many = Some(many).filter(|many| *many != few);
        Some([Some(few), many].into_iter().flatten().map(|corners| driven(query, options, &corners)).collect())
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

    /// How much clearance a lattice position has beyond the least, m.
    fn room(&self, i: i32, j: i32) -> f64 {
        (self.clearance)(self.lattice.position(i, j)) - self.least
    }

    /// How tight a position is; `CLOSED`: not passable.
    fn tight(&self, i: i32, j: i32) -> u8 {
        let room = self.room(i, j);
        let tight = ((ROOM - room) / ROOM).clamp(0.0, 1.0);
        let span = f64::from(TIGHTEST - ROOMY);
        if room >= 0.0 {
            ROOMY + (span * tight * tight) as u8
        } else if self.beside(i, j, room).is_some() {
            TIGHTEST
        } else {
            CLOSED
        }
    }

    /// A place half a step beside a position without room where there is room all the same: the middle of a gap that is hardly wider
    /// than the robot may lie between two positions, and the field rounds it off.
    fn beside(&self, i: i32, j: i32, room: f64) -> Option<[f64; 2]> {
        let step = self.lattice.step;
        if room < -0.5 * std::f64::consts::SQRT_2 * step {
            return None;
        }
        // Before a wall the field rises by a whole step, and the next position will do.
        let rises = |(di, dj, tenths): &(i32, i32, u32)| {
            self.room(i + di, j + dj) > room + RISING * step * f64::from(*tenths) / 10.0
        };
        if NEIGHBOURS.iter().any(rises) {
            return None;
        }
        let [x, y] = self.lattice.position(i, j);
        let half = |d: i32| 0.5 * step * f64::from(d);
        NEIGHBOURS.iter().map(|(di, dj, _)| [x + half(*di), y + half(*dj)]).find(|place| (self.fits)(*place))
    }

    /// Where a way passes a lattice position, and the room there, m.
    fn passed(&self, i: i32, j: i32) -> ([f64; 2], f64) {
        let room = self.room(i, j);
        let beside = if room < 0.0 { self.beside(i, j, room) } else { None };
        (beside.unwrap_or(self.lattice.position(i, j)), room.max(0.0))
    }

    /// Places, with the room there (m), of the cheapest way between the lattice positions nearest to two points (A*; the estimate is
    /// that of an empty plane, weighed).
    fn way(&mut self, [from, to]: [[f64; 2]; 2], touching: u32) -> Option<Vec<([f64; 2], f64)>> {
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
            way.push(self.passed(at.0, at.1));
            let (di, dj, _) = NEIGHBOURS[usize::from(self.places[self.lattice.index(at.0, at.1)].came & !DONE)];
            at = (at.0 - di, at.1 - dj);
        }
        // The ends are not the exact start and goal: the first and last steps would only wiggle.
        way.reverse();
        way.pop();
        Some(way.into_iter().skip(1).collect())
    }
}

/// Through these corners, forwards or backwards.
fn driven(query: &Query, options: &SearchOptions, corners: &[[f64; 2]]) -> Route {
    let driven = |reverse: bool| {
        let mut route = Route::new(query.start);
        corners.iter().for_each(|point| route.drive_to(*point, reverse));
        route.end_with(query.goal_yaw);
        route
    };
    let forward = driven(false);
    let backward = options.reverse.then(|| driven(true)).filter(|b| worth(b) < worth(&forward));
    backward.unwrap_or(forward)
}

/// The points but the first that are needed to stay near all of them (Ramer 1972; Douglas & Peucker 1973): within `bend`, and within a
/// share of the room there is.
fn corners(points: &[([f64; 2], f64)], bend: f64, of_room: f64) -> Vec<[f64; 2]> {
    let mut keep = vec![false; points.len()];
    let mut open = vec![(0, points.len() - 1)];
    while let Some((a, b)) = open.pop() {
        keep[b] = true;
        let (p, q) = (points[a].0, points[b].0);
        let (dx, dy) = (q[0] - p[0], q[1] - p[1]);
        let length = real::hypot(dx, dy);
        let off = |(r, room): ([f64; 2], f64)| {
            let (ex, ey) = (r[0] - p[0], r[1] - p[1]);
            let distance = if length > 0.0 { (dx * ey - dy * ex).abs() / length } else { real::hypot(ex, ey) };
            // A place beside a position has no room to lose.
            distance / if room > 0.0 { (of_room * room).clamp(LEAST_BEND, bend) } else { BESIDE }
        };
        let farthest = (a + 1..b).map(|k| (off(points[k]), k)).max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, k)) = farthest.filter(|(share, _)| *share > 1.0) {
            open.push((a, k));
            open.push((k, b));
        }
    }
    points.iter().zip(keep).filter(|(_, keep)| *keep).map(|(p, _)| p.0).collect()
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
        let mut guide = Guide::new(&lattice, clearance, Box::new(|_| false), 0.02);
        let middle = guide.way([[0.3, 1.0], [2.7, 1.0]], 80).expect("free");
        assert!(middle.iter().all(|(p, _)| (p[1] - 1.0).abs() < 0.06), "{middle:?}");
        guide.avoid([1.5, 1.0]);
        let around = guide.way([[0.3, 1.0], [2.7, 1.0]], 80).expect("free");
        assert!(around.iter().all(|(p, _)| real::hypot(p[0] - 1.5, p[1] - 1.0) > 0.19), "{around:?}");
    }

    #[test]
    fn a_gap_whose_middle_lies_between_two_positions_is_passed_in_its_middle_and_a_narrower_one_is_not() {
        // Two walls of cells of 5 cm with an opening between y = 0.5 and the one before `end`.
        let room = |end: usize| {
            let mut map = VoxelMap::new(0.05, [0.0; 3], [60, 40, 1], Unknown::Occupied);
            for j in (0..10).chain(end..40) {
                (28..31).for_each(|i| map.occupy([i, j, 0]));
            }
            map
        };
        let way = |end: usize| {
            let map = room(end);
            let field = crate::esdf::build(&map);
            let lattice = Lattice::new(&map);
            let upright = crate::search::upright::Upright { radius: 0.22, heights: [0.0, 0.05] };
            let clearance = |[x, y]: [f64; 2]| field.distance([x, y, 0.025]);
            let fits: Fits = Box::new(|place| upright.fits(&map, place));
            Guide::new(&lattice, clearance, fits, 0.22).way([[0.5, 1.0], [2.5, 1.0]], 10)
        };
        assert!(way(18).is_none(), "0.40 m");
        let gap = way(19).expect("0.45 m: 5 mm to spare on each side");
        let inside: Vec<_> = gap.iter().filter(|(place, _)| (1.4..=1.55).contains(&place[0])).collect();
        assert!(!inside.is_empty() && inside.iter().all(|(place, _)| (place[1] - 0.725).abs() < 1e-9), "{gap:?}");
    }

    #[test]
    fn corners_stay_within_the_bend() {
        let points: Vec<[f64; 2]> = (0..100).map(|k| [0.05 * f64::from(k), real::sin(0.05 * f64::from(k))]).collect();
        let roomy: Vec<([f64; 2], f64)> = points.iter().map(|p| (*p, 1.0)).collect();
        let kept = corners(&roomy, 0.03, 0.5);
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
