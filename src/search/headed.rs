//! The first try where no straight way passes: the route of least estimated time in the plane.
//!
//! By \[SCR\] Eq. 14 a curve of curvature k is driven at no more than v_max / (1 + k D / (2 eta)): a radian of turning costs what
//! D / (2 eta) metres of straight driving do, whatever its radius. So the route is searched over positions *and* sixteen
//! headings, metres and turns in one currency, the turns at start and goal included; being close to obstacles costs a little.
//! Positions lie on a grid through the start; the last drive goes straight to the goal from wherever the way there looks free.
//! What comes out is checked like any other route; where it is blocked the place is made expensive, and the next route tried.

use std::f32::consts::{PI, TAU};

use super::Query;
use super::queue::RadixHeap;
use super::route::Route;
use crate::math::real;

/// Routes that are tried.
pub(super) const TRIES: usize = 4;
/// Distance of the grid's positions along its axes, m.
const STEP: f64 = 0.15;
/// Headings of the moves, by their steps on the grid.
const HEADINGS: usize = 16;
const QUARTER: [[i32; 2]; HEADINGS / 4] = [[1, 0], [2, 1], [1, 1], [1, 2]];
/// Headings by which a way may turn at once.
const TURNS: [i32; 5] = [0, 1, -1, 2, -2];
/// Clearance over the least beyond which more is no better, m.
const ROOM: f32 = 0.3;
/// Share by which driving costs more where there is no room at all, try by try.
const TIGHT: [f32; 3] = [0.5, 1.0, 2.0];
/// Share by which it costs more where a route was blocked, each time, and how far about it (m).
const BLOCKED: (f32, f64) = (2.0, 0.12);
/// What the estimate weighs: ways are at most that much dearer than the cheapest.
const WEIGHT: f32 = 1.1;
/// States after which it gives up.
const MOST_STATES: usize = 6_000;
/// Costs are counted in these, m.
const UNIT: f32 = 1e-3;
/// Shortest and longest step of a look along a line, m.
const LOOK: [f64; 2] = [0.05, 0.15];

/// In place of the heading before: there is none, at the start.
const FIRST: u8 = 0x7f;
/// With the heading before: its cost is final.
const DONE: u8 = 0x80;

/// A position that was looked at.
#[derive(Clone, Copy)]
struct Spot {
    at: [i32; 2],
    /// Clearance over the least, m.
    room: f32,
    /// Distance and direction of the goal, m, rad.
    to_goal: f32,
    bearing: f32,
    /// What driving here costs more, by share.
    dear: f32,
    /// Whether the goal is in sight, if known.
    sight: Option<bool>,
}

#[derive(Clone, Copy, Default)]
struct State {
    /// Cost to it plus one; zero where it was not reached.
    best: u32,
    /// Heading before, and [`DONE`].
    came: u8,
}

/// `clearance` is that of the base's core at a position, m; it is asked only where a way may come by.
pub(super) struct Headed<'a, C: Fn([f64; 2]) -> f64> {
    query: &'a Query,
    clearance: C,
    /// Where the clearance is below this nothing passes, m.
    least: f64,
    /// Metres that a radian of turning is worth.
    turn_cost: f32,
    moves: [Move; HEADINGS],
    /// Steps from the start to the lowest position in the map, and positions along x and y.
    low: [i32; 2],
    size: [i32; 2],
    /// Number of the spot at each position of the grid plus one; zero: not looked at.
    numbers: Vec<u32>,
    spots: Vec<Spot>,
    states: Vec<[State; HEADINGS]>,
    open: RadixHeap,
}

/// Straight to the next position.
#[derive(Clone, Copy)]
struct Move {
    /// Steps on the grid.
    by: [i32; 2],
    /// Heading, rad.
    angle: f32,
    /// m.
    length: f32,
}

/// Angle between two headings, rad.
fn between(a: f32, b: f32) -> f32 {
    let turn = (a - b).abs() % TAU;
    if turn > PI { TAU - turn } else { turn }
}

fn units(cost: f32) -> u32 {
    (cost / UNIT) as u32
}

impl<'a, C: Fn([f64; 2]) -> f64> Headed<'a, C> {
    /// Over the rectangle from `low` to `high`, m.
    pub fn new(query: &'a Query, clearance: C, least: f64, [low, high]: [[f64; 2]; 2], turn_cost: f64) -> Self {
        let start = [query.start.x, query.start.y];
        let first = [0, 1].map(|a| ((low[a] - start[a]) / STEP).ceil() as i32);
        let last = [0, 1].map(|a| ((high[a] - start[a]) / STEP).floor() as i32);
        let size = [0, 1].map(|a| (last[a] - first[a] + 1).max(1));
        let moves = std::array::from_fn(|k| {
            let [x, y] = QUARTER[k % QUARTER.len()];
            let by = [[x, y], [-y, x], [-x, -y], [y, -x]][k / QUARTER.len()];
            let [x, y] = by.map(f64::from);
            Move { by, angle: real::atan2(y, x) as f32, length: (real::hypot(x, y) * STEP) as f32 }
        });
        Self {
            query,
            clearance,
            least,
            turn_cost: turn_cost as f32,
            moves,
            low: first,
            size,
            // All zero, so memory that no way comes by is never touched.
            numbers: vec![0; size[0] as usize * size[1] as usize],
            spots: Vec::new(),
            states: Vec::new(),
            open: RadixHeap::new(),
        }
    }

    fn place(&self, at: [i32; 2]) -> [f64; 2] {
        let start = [self.query.start.x, self.query.start.y];
        [0, 1].map(|a| start[a] + STEP * f64::from(at[a]))
    }

    fn room(&self, place: [f64; 2]) -> f32 {
        ((self.clearance)(place) - self.least) as f32
    }

    /// Index of a position of the grid; `None`: beyond the map.
    fn cell(&self, at: [i32; 2]) -> Option<usize> {
        let [i, j] = [0, 1].map(|a| at[a] - self.low[a]);
        let inside = (0..self.size[0]).contains(&i) && (0..self.size[1]).contains(&j);
        inside.then(|| i as usize * self.size[1] as usize + j as usize)
    }

    /// Number of the spot at a position of the grid; `None`: beyond the map.
    fn spot(&mut self, at: [i32; 2]) -> Option<usize> {
        let cell = self.cell(at)?;
        if self.numbers[cell] == 0 {
            let place = self.place(at);
            let [dx, dy] = [self.query.goal.x - place[0], self.query.goal.y - place[1]];
            self.spots.push(Spot {
                at,
                room: self.room(place),
                to_goal: real::hypot(dx, dy) as f32,
                bearing: real::atan2(dy, dx) as f32,
                dear: 1.0,
                sight: None,
            });
            self.states.push([State::default(); HEADINGS]);
            self.numbers[cell] = self.spots.len() as u32;
        }
        Some(self.numbers[cell] as usize - 1)
    }

    /// Whether the core gets straight from a spot to the goal, past nothing that is to be avoided.
    fn sees_goal(&mut self, spot: usize) -> bool {
        if let Some(known) = self.spots[spot].sight {
            return known;
        }
        let own = self.spots[spot];
        let (from, to) = (self.place(own.at), [self.query.goal.x, self.query.goal.y]);
        let length = f64::from(own.to_goal);
        let mut along = f64::from(own.room).clamp(LOOK[0], LOOK[1]);
        let mut free = true;
        while along < length && free {
            let place = [0, 1].map(|a| from[a] + (to[a] - from[a]) * along / length);
            let room = f64::from(self.room(place));
            free = room >= 0.0 && !self.is_avoided(place);
            along += room.clamp(LOOK[0], LOOK[1]);
        }
        self.spots[spot].sight = Some(free);
        free
    }

    fn is_avoided(&self, place: [f64; 2]) -> bool {
        let start = [self.query.start.x, self.query.start.y];
        let Some(cell) = self.cell([0, 1].map(|a| ((place[a] - start[a]) / STEP).round() as i32)) else { return false };
        let number = self.numbers[cell] as usize;
        number > 0 && self.spots[number - 1].dear > 1.0
    }

    /// Straight to the goal: turn, drive, turn, m. No way in the plane costs less.
    fn to_go(&self, spot: &Spot, angle: f32) -> f32 {
        let wanted = self.query.goal_yaw.map(|yaw| yaw as f32);
        if spot.to_goal < 1e-6 {
            return self.turn_cost * wanted.map_or(0.0, |yaw| between(angle, yaw));
        }
        let last = wanted.map_or(0.0, |yaw| between(spot.bearing, yaw));
        spot.to_goal + self.turn_cost * (between(angle, spot.bearing) + last)
    }

    /// Makes the surroundings of a place expensive.
    pub fn avoid(&mut self, place: [f64; 2]) {
        let (share, radius) = BLOCKED;
        let start = [self.query.start.x, self.query.start.y];
        let at = [0, 1].map(|a| (place[a] - start[a]) / STEP);
        let reach = radius / STEP;
        let range = |d: usize| (at[d] - reach).ceil() as i32..=(at[d] + reach).floor() as i32;
        for i in range(0) {
            for j in range(1) {
                let near = real::hypot(f64::from(i) - at[0], f64::from(j) - at[1]) <= reach;
                if let Some(spot) = near.then(|| self.spot([i, j])).flatten() {
                    self.spots[spot].dear += share;
                }
            }
        }
        self.spots.iter_mut().for_each(|spot| spot.sight = None);
    }

    /// The cheapest route; `None`: there is none in the plane, or it takes too long to find.
    pub fn route(&mut self, attempt: usize) -> Option<Route> {
        let (_, last) = self.cheapest(TIGHT[attempt.min(TIGHT.len() - 1)])?;
        Some(self.trace(last))
    }

    /// The cost in units, and the state from which the cheapest way goes straight to the goal. `tight`: share by which driving
    /// costs more where there is no room.
    fn cheapest(&mut self, tight: f32) -> Option<(u32, usize)> {
        /// In place of a state in the queue.
        const GOAL: u32 = u32::MAX;
        self.states.iter_mut().for_each(|states| *states = [State::default(); HEADINGS]);
        self.open.clear();
        let first = self.spot([0, 0])?;
        for (k, Move { angle, .. }) in self.moves.into_iter().enumerate() {
            let cost = 1 + units(self.turn_cost * between(angle, self.query.start.yaw as f32));
            self.states[first][k] = State { best: cost, came: FIRST };
            let to_go = WEIGHT * self.to_go(&self.spots[first], angle);
            self.open.push(cost + units(to_go), (first * HEADINGS + k) as u32);
        }
        let mut expanded = 0;
        let mut best = (u32::MAX, 0);
        while let Some((estimate, index)) = self.open.pop() {
            if index == GOAL {
                return Some(best);
            }
            let (spot, heading) = (index as usize / HEADINGS, index as usize % HEADINGS);
            let own = self.states[spot][heading];
            if own.came & DONE != 0 {
                continue;
            }
            self.states[spot][heading].came |= DONE;
            expanded += 1;
            if expanded > MOST_STATES {
                return None;
            }
            if self.sees_goal(spot) {
                let cost = own.best + units(self.to_go(&self.spots[spot], self.moves[heading].angle));
                if cost < best.0 {
                    best = (cost, index as usize);
                    self.open.push(estimate.max(cost), GOAL);
                }
            }
            self.expand(spot, heading, estimate, tight);
        }
        None
    }

    /// Offers the moves from a state.
    fn expand(&mut self, spot: usize, heading: usize, estimate: u32, tight: f32) {
        let here = self.spots[spot];
        let own = self.states[spot][heading];
        let angle = self.moves[heading].angle;
        for turn in TURNS {
            // At the start all headings are open as it is.
            if own.came & !DONE == FIRST && turn != 0 {
                break;
            }
            let next = (heading as i32 + turn).rem_euclid(HEADINGS as i32) as usize;
            let Move { by, angle: out, length } = self.moves[next];
            let Some(there) = self.spot([0, 1].map(|a| here.at[a] + by[a])) else { continue };
            let known = self.states[there][next];
            let other = self.spots[there];
            if known.came & DONE != 0 || other.room < 0.0 {
                continue;
            }
            let mut room = here.room.min(other.room);
            // Room is not lost faster than it is driven through: only short of it the middle needs a look.
            if here.room.max(0.0) + other.room < length {
                let [a, b] = [self.place(here.at), self.place(other.at)];
                let middle = self.room([0, 1].map(|d| 0.5 * (a[d] + b[d])));
                if middle < 0.0 {
                    continue;
                }
                room = room.min(middle);
            }
            let close = ((ROOM - room) / ROOM).clamp(0.0, 1.0);
            let drive = length * other.dear * (1.0 + tight * close * close);
            let cost = own.best + units(drive + self.turn_cost * between(angle, out));
            if known.best == 0 || cost < known.best {
                self.states[there][next] = State { best: cost, came: heading as u8 };
                let to_go = WEIGHT * self.to_go(&other, out);
                // A weighed estimate may fall: the queue wants one that does not.
                let index = there * HEADINGS + next;
                self.open.push(estimate.max(cost + units(to_go)), index as u32);
            }
        }
    }

    /// The route by way of a state.
    fn trace(&mut self, last: usize) -> Route {
        let (mut spot, mut heading) = (last / HEADINGS, last % HEADINGS);
        let mut points = vec![[self.query.goal.x, self.query.goal.y]];
        loop {
            let came = self.states[spot][heading].came & !DONE;
            let at = self.spots[spot].at;
            if came == FIRST {
                break;
            }
            points.push(self.place(at));
            let by = self.moves[heading].by;
            spot = self.spot([0, 1].map(|a| at[a] - by[a])).expect("it was reached from there");
            heading = usize::from(came);
        }
        let mut route = Route::new(self.query.start);
        points.iter().rev().for_each(|point| route.drive_to(*point, false));
        route.end_with(self.query.goal_yaw);
        route
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Pose2;
    use proptest::prelude::*;

    const SIDE: f64 = 2.4;
    const TURN_COST: f64 = 0.4;

    fn query(start: [f64; 3], goal: [f64; 3]) -> Query {
        let [start, goal] = [start, goal].map(|[x, y, yaw]| Pose2::new(x, y, yaw));
        Query { start, start_joints: vec![], goal, goal_within: 0.0, goal_yaw: Some(goal.yaw), goal_joints: vec![] }
    }

    /// From round obstacles, with the map's edge as one more.
    fn clearance(obstacles: &[[f64; 3]], [x, y]: [f64; 2]) -> f64 {
        let edge = x.min(y).min(SIDE - x).min(SIDE - y);
        obstacles.iter().map(|o| real::hypot(x - o[0], y - o[1]) - o[2]).fold(edge, f64::min)
    }

    fn headed<'a>(
        query: &'a Query,
        obstacles: &'a [[f64; 3]],
        turn_cost: f64,
    ) -> Headed<'a, impl Fn([f64; 2]) -> f64 + 'a> {
        Headed::new(query, move |p| clearance(obstacles, p), 0.1, [[0.0; 2], [SIDE; 2]], turn_cost)
    }

    /// The cheapest way by relaxing all moves until nothing changes, m.
    fn by_relaxation<C: Fn([f64; 2]) -> f64>(headed: &mut Headed<'_, C>, tight: f32) -> Option<f32> {
        let at = |cell: usize| {
            let row = headed.size[1] as usize;
            [headed.low[0] + (cell / row) as i32, headed.low[1] + (cell % row) as i32]
        };
        let cells: Vec<[i32; 2]> = (0..headed.numbers.len()).map(at).collect();
        let angles = headed.moves.map(|m| m.angle);
        let mut cost = vec![[f32::INFINITY; HEADINGS]; cells.len()];
        let first = headed.cell([0, 0])?;
        let start_yaw = headed.query.start.yaw as f32;
        cost[first] = angles.map(|angle| headed.turn_cost * between(angle, start_yaw));
        let room = |at: [i32; 2]| headed.room(headed.place(at));
        let mut changed = true;
        while std::mem::take(&mut changed) {
            for (cell, from) in cells.iter().enumerate() {
                for (k, step) in headed.moves.iter().enumerate() {
                    let to = [from[0] + step.by[0], from[1] + step.by[1]];
                    let Some(there) = headed.cell(to) else { continue };
                    let middle = [0, 1].map(|a| 0.5 * (headed.place(*from)[a] + headed.place(to)[a]));
                    let sampled = [room(*from), room(to), headed.room(middle)];
                    if room(to) < 0.0 || sampled[2] < 0.0 {
                        continue;
                    }
                    // Where there is much room about both ends the middle is not looked at.
                    let ends = sampled[0].min(sampled[1]);
                    let seen = if sampled[0].max(0.0) + sampled[1] < step.length { ends.min(sampled[2]) } else { ends };
                    let close = ((ROOM - seen) / ROOM).clamp(0.0, 1.0);
                    let drive = step.length * (1.0 + tight * close * close);
                    for turn in TURNS {
                        let before = (k as i32 - turn).rem_euclid(HEADINGS as i32) as usize;
                        let own = cost[cell][before] + drive + headed.turn_cost * between(angles[before], step.angle);
                        if own < cost[there][k] - 1e-6 {
                            cost[there][k] = own;
                            changed = true;
                        }
                    }
                }
            }
        }
        let mut best = f32::INFINITY;
        for (cell, at) in cells.into_iter().enumerate() {
            let spot = headed.spot(at).expect("all cells are in the map");
            if headed.spots[spot].room >= 0.0 && headed.sees_goal(spot) {
                for (angle, own) in angles.into_iter().zip(cost[cell]) {
                    best = best.min(own + headed.to_go(&headed.spots[spot], angle));
                }
            }
        }
        best.is_finite().then_some(best)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(40))]
        #[test]
        fn it_finds_the_cheapest_way_but_for_its_weight_and_no_dearer_one_than_the_shortest(
            obstacles in prop::collection::vec((0.0..SIDE, 0.0..SIDE, 0.05f64..0.4).prop_map(|(x, y, r)| [x, y, r]), 0..9),
            (start_yaw, goal_yaw) in (-3.1f64..3.1, -3.1f64..3.1),
        ) {
            let query = query([0.3, 0.4, start_yaw], [2.0, 1.9, goal_yaw]);
            prop_assume!([[0.3, 0.4], [2.0, 1.9]].iter().all(|p| clearance(&obstacles, *p) > 0.1));
            let found = headed(&query, &obstacles, TURN_COST).cheapest(0.5).map(|(cost, _)| cost as f32 * UNIT);
            let least = by_relaxation(&mut headed(&query, &obstacles, TURN_COST), 0.5);
            prop_assert_eq!(found.is_some(), least.is_some());
            // Each move's cost is rounded down to a unit.
            let rounding = 0.1;
            if let (Some(found), Some(least)) = (found, least) {
                prop_assert!(found <= WEIGHT * least + rounding && found >= least - rounding, "{found} against {least}");
            }
            let route = |turn_cost: f64| {
                let mut headed = headed(&query, &obstacles, turn_cost);
                headed.cheapest(0.0).map(|(_, last)| headed.trace(last).cost(TURN_COST, 1.0))
            };
            if let (Some(chosen), Some(shortest)) = (route(TURN_COST), route(0.0)) {
                prop_assert!(chosen <= f64::from(WEIGHT) * shortest + f64::from(rounding), "{chosen} against {shortest}");
            }
        }
    }

    #[test]
    fn it_passes_an_obstacle_on_the_side_that_start_and_goal_look_to() {
        let obstacles = [[1.2, 1.2, 0.35]];
        for side in [1.0, -1.0] {
            let query = query([0.3, 1.2, side * 0.7], [2.1, 1.2, -side * 0.7]);
            let route = headed(&query, &obstacles, TURN_COST).route(0).expect("both sides are open");
            let middle = &route.corners[1..route.corners.len() - 1];
            assert!(!middle.is_empty() && middle.iter().all(|c| (c[1] - 1.2) * side > 0.0), "{route:?}");
            assert_eq!(headed(&query, &obstacles, TURN_COST).route(0), Some(route), "the same each time");
        }
    }

    #[test]
    fn mirrored_scenes_cost_the_same() {
        let obstacles = [[1.1, 1.0, 0.3], [1.6, 1.7, 0.2]];
        let mirrored = obstacles.map(|[x, y, r]| [x, SIDE - y, r]);
        let cost = |query: Query, obstacles: &[[f64; 3]]| {
            let (cost, _) = headed(&query, obstacles, TURN_COST).cheapest(0.5).expect("open");
            f64::from(cost) * f64::from(UNIT)
        };
        let one = cost(query([0.3, 1.0, 0.4], [2.1, 1.3, 1.1]), &obstacles);
        let other = cost(query([0.3, SIDE - 1.0, -0.4], [2.1, SIDE - 1.3, -1.1]), &mirrored);
        // Either may be dearer than the cheapest by what the estimate weighs.
        assert!((one / other - 1.0).abs() < f64::from(WEIGHT) - 1.0 + 0.01, "{one} against {other}");
    }

    #[test]
    fn what_is_avoided_again_and_again_is_driven_around_and_no_longer_looked_past() {
        let query = query([0.3, 1.2, 0.0], [2.1, 1.2, 0.0]);
        let mut headed = headed(&query, &[], TURN_COST);
        let straight = headed.route(0).expect("nothing there");
        assert_eq!(straight.corners, [[0.3, 1.2], [2.1, 1.2]]);
        // The first time a bend still costs more.
        (0..5).for_each(|_| headed.avoid([1.2, 1.2]));
        let around = headed.route(0).expect("room on both sides");
        assert!(around.corners.len() > 2 && around.cost(0.0, 1.0) < 1.1 * 1.8, "{around:?}");
    }
}
