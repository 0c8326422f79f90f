//! The base's way as corners joined by straight drives, with the turn at each corner.

use super::collide::BaseMotion;
use crate::geom::{Pose2, wrap_angle};
use crate::math::real;

/// Longest drive (m) and largest turn (rad) that are checked as one sweep. Shorter ones let postures change more often.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Grain {
    pub drive: f64,
    pub turn: f64,
}

impl Grain {
    /// Few sweeps.
    pub const COARSE: Self = Self { drive: 0.25, turn: 15.0 * std::f64::consts::PI / 180.0 };
    /// Not longer than the lattice's own moves: whatever the search got through, this does.
    pub const FINE: Self = Self { drive: 0.04, turn: 4.0 * std::f64::consts::PI / 180.0 };
}

/// Corner 0 is the start; drive k leads from corner k to corner k + 1; the turn at corner k comes before drive k. The last
/// turn is at the last corner.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Route {
    pub start_yaw: f64,
    pub corners: Vec<[f64; 2]>,
    /// Signed turns (rad) in place: one a corner.
    pub turns: Vec<f64>,
    /// One a drive.
    pub reverse: Vec<bool>,
}

impl Route {
    pub fn new(start: Pose2) -> Self {
        Self { start_yaw: start.yaw, corners: vec![[start.x, start.y]], turns: vec![0.0], reverse: Vec::new() }
    }

    /// Heading after the last turn, not wrapped.
    pub fn end_yaw(&self) -> f64 {
        self.start_yaw + self.turns.iter().sum::<f64>()
    }

    /// Turns (the shorter way) and drives straight to a point; nothing where it is there already.
    pub fn drive_to(&mut self, to: [f64; 2], reverse: bool) {
        let at = self.corners[self.corners.len() - 1];
        let (dx, dy) = (to[0] - at[0], to[1] - at[1]);
        if real::hypot(dx, dy) < 1e-9 {
            return;
        }
        let yaw = real::atan2(dy, dx) + if reverse { std::f64::consts::PI } else { 0.0 };
        self.end_with(Some(yaw));
        // A corner that does not turn is none.
        let last = self.turns.len() - 1;
        if last > 0 && self.turns[last].abs() < 1e-9 && self.reverse[last - 1] == reverse {
            self.corners[last] = to;
            self.turns[last] = 0.0;
            return;
        }
        self.corners.push(to);
        self.turns.push(0.0);
        self.reverse.push(reverse);
    }

    /// Turns to a heading, the shorter way; what was turned so far stays a turn of its own where this one goes back: the
    /// joints may have moved there, where there is room.
    pub fn spin_to(&mut self, yaw: f64) {
        const SMALL: f64 = 0.05;
        let last = self.turns.len() - 1;
        let turn = wrap_angle(yaw - self.end_yaw());
        if self.turns[last].abs() > SMALL && self.turns[last] * turn < 0.0 {
            self.corners.push(self.corners[last]);
            self.turns.push(0.0);
            self.reverse.push(false);
        }
        self.end_with(Some(yaw));
    }

    /// Turns to a heading, the shorter way.
    pub fn end_with(&mut self, yaw: Option<f64>) {
        if let Some(yaw) = yaw {
            let turn = wrap_angle(yaw - self.end_yaw());
            let last = self.turns.len() - 1;
            self.turns[last] += turn;
        }
    }

    /// Length plus what turning and backing up are worth, m.
    pub fn cost(&self, turn_cost: f64, reverse_cost: f64) -> f64 {
        let drives = (0..self.reverse.len()).map(|k| self.length(k) * if self.reverse[k] { reverse_cost } else { 1.0 });
        drives.sum::<f64>() + turn_cost * self.turns.iter().map(|t| t.abs()).sum::<f64>()
    }

    /// Length of one drive, m.
    pub fn cost_of_drive(&self, drive: usize) -> f64 {
        self.length(drive)
    }

    fn length(&self, drive: usize) -> f64 {
        let (a, b) = (self.corners[drive], self.corners[drive + 1]);
        real::hypot(a[0] - b[0], a[1] - b[1])
    }

    /// All motions in order, cut into pieces. The first and the last stand still: postures may change before the base moves, and after.
    pub fn pieces(&self, grain: Grain) -> Vec<BaseMotion> {
        let start = Pose2::new(self.corners[0][0], self.corners[0][1], self.start_yaw);
        let mut out = vec![BaseMotion { from: start, to: start }];
        let mut yaw = self.start_yaw;
        for (k, corner) in self.corners.iter().enumerate() {
            spin_pieces(Pose2::new(corner[0], corner[1], yaw), self.turns[k], grain, &mut out);
            yaw += self.turns[k];
            if let Some(next) = self.corners.get(k + 1) {
                drive_pieces(Pose2::new(corner[0], corner[1], yaw), Pose2::new(next[0], next[1], yaw), grain, &mut out);
            }
        }
        out.extend(out.last().map(|last| BaseMotion { from: last.to, to: last.to }));
        out
    }
}

pub(super) fn spin_pieces(from: Pose2, turn: f64, grain: Grain, out: &mut Vec<BaseMotion>) {
    let count = (turn.abs() / grain.turn - 1e-9).ceil() as usize;
    let at = |k: usize| Pose2 { yaw: from.yaw + turn * k as f64 / count as f64, ..from };
    out.extend((0..count).map(|k| BaseMotion { from: at(k), to: at(k + 1) }));
}

pub(super) fn drive_pieces(from: Pose2, to: Pose2, grain: Grain, out: &mut Vec<BaseMotion>) {
    let count = (from.distance(to) / grain.drive - 1e-9).ceil() as usize;
    let at = |k: usize| {
        let share = k as f64 / count as f64;
        Pose2::new(from.x + share * (to.x - from.x), from.y + share * (to.y - from.y), from.yaw)
    };
    out.extend((0..count).map(|k| BaseMotion { from: at(k), to: if k + 1 == count { to } else { at(k + 1) } }));
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn pieces_join_from_start_to_goal(points in prop::collection::vec((-3.0f64..3.0, -3.0f64..3.0, any::<bool>()), 1..6), yaw in -3.0f64..3.0) {
            let start = Pose2::new(0.5, 0.25, yaw);
            let mut route = Route::new(start);
            points.iter().for_each(|p| route.drive_to([p.0, p.1], p.2));
            route.end_with(Some(1.0));
            let pieces = route.pieces(Grain::COARSE);
            let mut at = start;
            for piece in &pieces {
                prop_assert!(piece.from.distance(at) < 1e-9 && (piece.from.yaw - at.yaw).abs() < 1e-9);
                at = piece.to;
            }
            let last = points[points.len() - 1];
            prop_assert!(real::hypot(at.x - last.0, at.y - last.1) < 1e-9 && wrap_angle(at.yaw - 1.0).abs() < 1e-9);
            prop_assert_eq!(route.turns.len(), route.corners.len());
            prop_assert_eq!(route.reverse.len() + 1, route.corners.len());
        }
    }
}
