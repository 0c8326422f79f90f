//! Fewer corners: straight drives that skip corners of a route, where the postures still get through.

use std::cell::RefCell;
use std::collections::BTreeMap;

use super::bits::Bits;
use super::collide::{BaseMotion, Collider};
use super::route::{Grain, Route, drive_pieces, spin_pieces};
use crate::geom::{Pose2, wrap_angle};
use crate::math::real;

/// A route with the free postures of each of its motions.
pub(super) struct CheckedRoute<const W: usize> {
    pub route: Route,
    /// Per corner: free postures of the pieces of its turn.
    turns: Vec<Vec<Bits<W>>>,
    /// Per drive.
    drives: Vec<Vec<Bits<W>>>,
}

pub(super) struct Shortcutter<'a, const W: usize> {
    pub collider: &'a Collider<'a, W>,
    pub start_postures: Bits<W>,
    pub goal_postures: Bits<W>,
    /// Whether the last turn may change: the goal leaves the heading open.
    pub open_end: bool,
    pub grain: Grain,
    /// Metres that a radian of turning is worth.
    pub turn_cost: f64,
    /// Free postures of the drives that were asked for.
    drives: RefCell<BTreeMap<DriveKey, Masks<W>>>,
}

/// Ends of a drive, and the heading's sense, bit by bit.
type DriveKey = ([u64; 4], bool);
/// Free postures of pieces in order; `None`: one is blocked.
type Masks<const W: usize> = Option<Vec<Bits<W>>>;

impl<const W: usize> CheckedRoute<W> {
    /// Free postures of all pieces, in the order of [`Route::pieces`].
    pub fn masks(&self) -> Vec<Bits<W>> {
        let mut out = Vec::new();
        for k in 0..self.turns.len() {
            out.extend(&self.turns[k]);
            if let Some(drive) = self.drives.get(k) {
                out.extend(drive);
            }
        }
        out
    }
}

impl<'a, const W: usize> Shortcutter<'a, W> {
    pub fn new(
        collider: &'a Collider<'a, W>,
        ends: [Bits<W>; 2],
        open_end: bool,
        grain: Grain,
        turn_cost: f64,
    ) -> Self {
        let [start_postures, goal_postures] = ends;
        Self { collider, start_postures, goal_postures, open_end, grain, turn_cost, drives: RefCell::default() }
    }

    /// Checks all pieces of a route.
    ///
    /// # Errors
    /// About where it is blocked, or the postures do not get through: all such places, each as if the ones before were free.
    pub fn check(&self, route: Route) -> Result<CheckedRoute<W>, Vec<[f64; 2]>> {
        let headings = headings_at_corners(&route);
        let mut checked = CheckedRoute { turns: Vec::new(), drives: Vec::new(), route };
        let mut blocked = Vec::new();
        let mut set = self.start_postures;
        let mut pass = |mask: Bits<W>, place: [f64; 2]| {
            set = self.collider.neighbours.flood(set, mask);
            if set.is_empty() {
                blocked.push(place);
                set = self.collider.all();
            }
            mask
        };
        for (k, heading) in headings.iter().enumerate() {
            let (at, turn) = (checked.route.corners[k], checked.route.turns[k]);
            let pieces = self.turn_pieces(k, k + 1 == headings.len(), at, *heading, turn);
            checked.turns.push(pieces.iter().map(|piece| pass(self.collider.free(piece), at)).collect());
            let Some(next) = checked.route.corners.get(k + 1).copied() else { continue };
            let mut pieces = Vec::new();
            let yaw = heading + turn;
            drive_pieces(Pose2::new(at[0], at[1], yaw), Pose2::new(next[0], next[1], yaw), self.grain, &mut pieces);
            let middle = |piece: &BaseMotion| [0.5 * (piece.from.x + piece.to.x), 0.5 * (piece.from.y + piece.to.y)];
            checked.drives.push(pieces.iter().map(|piece| pass(self.collider.free(piece), middle(piece))).collect());
        }
        let end = checked.route.corners[checked.route.corners.len() - 1];
        pass(self.goal_postures, end);
        if blocked.is_empty() { Ok(checked) } else { Err(blocked) }
    }

    /// Free postures of the pieces of a corner's turn.
    fn turn(&self, corner: usize, last: bool, at: [f64; 2], yaw: f64, turn: f64) -> Masks<W> {
        let pieces = self.turn_pieces(corner, last, at, yaw, turn);
        pieces.iter().map(|p| Some(self.collider.free(p)).filter(|m| !m.is_empty())).collect()
    }

    /// Those of the first corner begin with standing still, those of the last one end with it: what holds only there may be left, or
    /// taken up, before the base turns, or after.
    fn turn_pieces(&self, corner: usize, last: bool, at: [f64; 2], yaw: f64, turn: f64) -> Vec<BaseMotion> {
        let still = |yaw: f64| {
            let pose = Pose2::new(at[0], at[1], yaw);
            BaseMotion { from: pose, to: pose }
        };
        let mut pieces = Vec::new();
        if corner == 0 {
            pieces.push(still(yaw));
        }
        spin_pieces(Pose2::new(at[0], at[1], yaw), turn, self.grain, &mut pieces);
        if last {
            pieces.push(still(yaw + turn));
        }
        pieces
    }

    fn drive(&self, from: [f64; 2], to: [f64; 2], yaw: f64, reverse: bool) -> Masks<W> {
        let key = ([from[0], from[1], to[0], to[1]].map(f64::to_bits), reverse);
        self.drives.borrow_mut().entry(key).or_insert_with(|| self.find_drive(from, to, yaw)).clone()
    }

    fn find_drive(&self, from: [f64; 2], to: [f64; 2], yaw: f64) -> Masks<W> {
        let [from, to] = [from, to].map(|[x, y]| Pose2::new(x, y, yaw));
        let tightest = self.collider.tightest(from, to)?;
        let mut pieces = Vec::new();
        drive_pieces(from, to, self.grain, &mut pieces);
        // What blocks a drive most often is where it is tightest.
        let worst = (tightest / from.distance(to) * pieces.len() as f64) as usize;
        let worst = worst.min(pieces.len().checked_sub(1)?);
        let there = self.collider.free(&pieces[worst]);
        if there.is_empty() {
            return None;
        }
        let free = |(k, piece)| if k == worst { there } else { self.collider.free(piece) };
        pieces.iter().enumerate().map(|piece| Some(free(piece)).filter(|m| !m.is_empty())).collect()
    }

    fn flow(&self, set: Bits<W>, masks: &[Bits<W>]) -> Bits<W> {
        masks.iter().fold(set, |set, mask| self.collider.neighbours.flood(set, *mask))
    }

    /// Postures that reach each corner (before its turn); last: after the last turn.
    fn reached(&self, checked: &CheckedRoute<W>) -> Vec<Bits<W>> {
        let mut set = self.start_postures;
        let mut out = Vec::with_capacity(checked.turns.len() + 1);
        for k in 0..checked.turns.len() {
            out.push(set);
            set = self.flow(set, &checked.turns[k]);
            if let Some(drive) = checked.drives.get(k) {
                set = self.flow(set, drive);
            }
        }
        out.push(set);
        out
    }

    /// Postures that get from each corner (after its turn) to the goal. Motions within a piece's free postures can be
    /// undone, so this is the same flow backwards.
    fn needed(&self, checked: &CheckedRoute<W>) -> Vec<Bits<W>> {
        let mut set = self.goal_postures;
        let mut out = vec![set; checked.turns.len()];
        for k in (0..checked.turns.len()).rev() {
            if let Some(drive) = checked.drives.get(k) {
                set = drive.iter().rev().fold(set, |set, mask| self.collider.neighbours.flood(set, *mask));
            }
            out[k] = set;
            set = checked.turns[k].iter().rev().fold(set, |set, mask| self.collider.neighbours.flood(set, *mask));
        }
        out
    }

    /// Replaces parts by straight drives while that makes the route cheaper.
    pub fn shorten(&self, mut checked: CheckedRoute<W>) -> CheckedRoute<W> {
        let mut from = 0;
        while from + 2 < checked.route.corners.len() {
            let (forward, backward) = (self.reached(&checked), self.needed(&checked));
            let headings = headings_at_corners(&checked.route);
            let last = checked.route.corners.len() - 1;
            let found =
                (from + 2..=last).rev().find_map(|to| self.skip(&checked, &headings, &forward, &backward, from, to));
            match found {
                Some(better) => {
                    checked = better;
                    // The corner before may now see farther.
                    from = from.saturating_sub(1);
                }
                None => from += 1,
            }
        }
        checked
    }

    /// The route with a straight drive from corner `a` to corner `b`, if it is cheaper and passable.
    fn skip(
        &self,
        checked: &CheckedRoute<W>,
        headings: &[f64],
        forward: &[Bits<W>],
        backward: &[Bits<W>],
        a: usize,
        b: usize,
    ) -> Option<CheckedRoute<W>> {
        let route = &checked.route;
        if route.reverse[a..b].iter().any(|r| *r != route.reverse[a]) {
            return None;
        }
        let (from, to) = (route.corners[a], route.corners[b]);
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let length = real::hypot(dx, dy);
        if length < 1e-6 {
            return None;
        }
        let yaw = real::atan2(dy, dx) + if route.reverse[a] { std::f64::consts::PI } else { 0.0 };
        let turn_a = wrap_angle(yaw - headings[a]);
        let at_end = b + 1 == route.corners.len();
        let turn_b =
            if at_end && self.open_end { 0.0 } else { wrap_angle(headings[b] + route.turns[b] - headings[a] - turn_a) };
        let old: f64 = (a..b).map(|k| route.cost_of_drive(k)).sum::<f64>()
            + self.turn_cost * route.turns[a..=b].iter().map(|t| t.abs()).sum::<f64>();
        if length + self.turn_cost * (turn_a.abs() + turn_b.abs()) >= old - 1e-9 {
            return None;
        }
        let drive = self.drive(from, to, headings[a] + turn_a, route.reverse[a])?;
        let first = self.turn(a, false, from, headings[a], turn_a)?;
        let second = self.turn(b, at_end, to, headings[a] + turn_a, turn_b)?;
        let set = self.flow(self.flow(self.flow(forward[a], &first), &drive), &second);
        if set.and(backward[b]).is_empty() {
            return None;
        }
        let splice = |list: &Vec<Vec<Bits<W>>>, at: std::ops::Range<usize>, new: Vec<Vec<Bits<W>>>| {
            let mut out = list.clone();
            out.splice(at, new);
            out
        };
        let mut shorter = route.clone();
        shorter.corners.drain(a + 1..b);
        shorter.turns.splice(a..=b, [turn_a, turn_b]);
        shorter.reverse.drain(a + 1..b);
        Some(CheckedRoute {
            route: shorter,
            turns: splice(&checked.turns, a..b + 1, vec![first, second]),
            drives: splice(&checked.drives, a..b, vec![drive]),
        })
    }
}

/// Heading on arrival at each corner, before its turn; not wrapped.
fn headings_at_corners(route: &Route) -> Vec<f64> {
    let mut yaw = route.start_yaw;
    route
        .turns
        .iter()
        .map(|turn| {
            let arrival = yaw;
            yaw += turn;
            arrival
        })
        .collect()
}
