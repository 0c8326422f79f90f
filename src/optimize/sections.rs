//! Cuts the search's path into stretches: what is driven as one curve, and what stays a spin on the spot.

use super::options::OptimizeOptions;
use super::penalty::Limits;
use crate::math::real;
use crate::search::{SearchMove, SearchPath, SearchState};
use crate::trajectory::StillLeg;

/// A turn or joint change smaller than this is none.
const NOTHING: f64 = 1e-9;

/// A stretch of the path.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Section {
    /// On the spot.
    Still(StillLeg),
    /// One curve.
    Drive(DriveSection),
}

/// States `first..=last` of the path, driven in one go in one direction, spins between straights absorbed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DriveSection {
    /// First state.
    pub first: usize,
    /// Last state.
    pub last: usize,
    /// Backwards.
    pub reverse: bool,
}

/// Which spins become part of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Thresholds {
    /// Largest in the interior, rad.
    pub interior: f64,
    /// Largest at start and goal, rad.
    pub ends: f64,
    /// Spins are left where a curve could round them at no more than this share of the speed limit: it would all but stop too,
    /// and be hard to find.
    pub slowest: f64,
    /// At most this distance from a corner is rounded, m.
    pub reach: f64,
    /// A state where the robot stands, whatever else holds.
    pub cut: Option<usize>,
}

impl Thresholds {
    /// As the options say.
    pub fn of(options: &OptimizeOptions) -> Self {
        Self {
            interior: options.spin_threshold,
            ends: options.end_spin_threshold,
            slowest: options.slowest_corner,
            reach: options.corner_distance,
            cut: None,
        }
    }

    /// No spin: stop, spin, go.
    #[cfg(test)]
    pub const NONE: Self = Self { interior: 0.0, ends: 0.0, slowest: 1.0, reach: 0.0, cut: None };

    /// Whether a corner of `angle` between straights of these lengths is better rounded than spun on the spot.
    fn rounds(&self, angle: f64, before: f64, after: f64, limits: &Limits) -> bool {
        if angle > self.interior {
            return false;
        }
        let reach = self.reach.min(CORNER_SHARE * before.min(after));
        let radius = reach / real::tan(0.5 * angle).max(1e-6);
        // omega = v / R meets Eq. 14: v = R slope (v_max - v).
        let speed = radius * limits.turn_slope / (1.0 + radius * limits.turn_slope);
        speed > self.slowest
    }
}

/// A corner takes this share of the straights beside it.
pub(crate) const CORNER_SHARE: f64 = 0.4;

/// Sections of the moves `first..last` in order; together they cover them all.
pub(crate) fn sections(
    path: &SearchPath,
    first: usize,
    last: usize,
    limits: &Limits,
    thresholds: Thresholds,
) -> Vec<Section> {
    let mut sections: Vec<Section> = Vec::new();
    // Where the drive that is being gathered begins, and which way it goes.
    let mut open: Option<DriveSection> = None;
    let mut at = first;
    while at < last {
        if path.moves[at] != SearchMove::Still {
            let reverse = path.moves[at] == SearchMove::Reverse;
            match &mut open {
                Some(drive) if drive.reverse == reverse => drive.last = at + 1,
                _ => {
                    sections.extend(open.take().map(Section::Drive));
                    open = Some(DriveSection { first: at, last: at + 1, reverse });
                }
            }
            at += 1;
            continue;
        }
        let end = (at..last).find(|&i| path.moves[i] != SearchMove::Still).unwrap_or(last);
        let next = (end < last).then(|| path.moves[end] == SearchMove::Reverse);
        let moved = Stand::of(path, at, end);
        let absorbed = match (&open, next) {
            (Some(drive), Some(reverse)) if drive.reverse == reverse => {
                let (before, after) = (run(path, (first..at).rev()), run(path, end..last));
                thresholds.cut.is_none_or(|cut| !(at..=end).contains(&cut))
                    && thresholds.rounds(moved.turn, before, after, limits)
                    && joints_fit(path, at, end, &moved, limits, first, last)
            }
            (Some(_), None) | (None, Some(_)) => moved.turn <= thresholds.ends && moved.joints <= NOTHING,
            _ => false,
        };
        match (absorbed || moved.is_nothing(), &mut open, next) {
            (true, Some(drive), _) => drive.last = end,
            (true, None, Some(reverse)) => open = Some(DriveSection { first: at, last: end, reverse }),
            (true, None, None) => {}
            (false, ..) => {
                sections.extend(open.take().map(Section::Drive));
                sections.extend((at..end).map(|i| Section::Still(still(&path.states[i], &path.states[i + 1]))));
            }
        }
        at = end;
    }
    sections.extend(open.map(Section::Drive));
    sections
}

/// Length of the straight that goes on from here, up to the next stand, m.
fn run(path: &SearchPath, moves: impl Iterator<Item = usize>) -> f64 {
    moves
        .take_while(|&i| path.moves[i] != SearchMove::Still)
        .map(|i| path.states[i].pose.distance(path.states[i + 1].pose))
        .sum()
}

/// The leg from one state to the next, on the spot.
pub(crate) fn still(from: &SearchState, to: &SearchState) -> StillLeg {
    StillLeg { pose: from.pose, yaw_end: to.pose.yaw, joints_from: from.joints.clone(), joints_to: to.joints.clone() }
}

/// What moves while the base stands.
struct Stand {
    /// Sum of turns, rad.
    turn: f64,
    /// Largest sum of one joint's changes, rad or m.
    joints: f64,
}

impl Stand {
    fn of(path: &SearchPath, from: usize, to: usize) -> Self {
        let states = &path.states[from..=to];
        let turn = states.windows(2).map(|w| (w[1].pose.yaw - w[0].pose.yaw).abs()).sum();
        let joints = (0..states[0].joints.len())
            .map(|j| states.windows(2).map(|w| (w[1].joints[j] - w[0].joints[j]).abs()).sum())
            .fold(0.0, f64::max);
        Self { turn, joints }
    }

    fn is_nothing(&self) -> bool {
        self.turn <= NOTHING && self.joints <= NOTHING
    }
}

/// Whether the joints can do at speed, over a quarter of a metre on either side, what the path does standing.
fn joints_fit(
    path: &SearchPath,
    from: usize,
    to: usize,
    stand: &Stand,
    limits: &Limits,
    first: usize,
    last: usize,
) -> bool {
    if stand.joints <= NOTHING {
        return true;
    }
    let length = |i: usize| path.states[i].pose.distance(path.states[i + 1].pose);
    let mut room = 0.0;
    if from > first {
        room += length(from - 1).min(0.5) * 0.5;
    }
    if to < last {
        room += length(to).min(0.5) * 0.5;
    }
    let available = room / (0.7 * limits.speed) + stand.turn / limits.turn_rate(0.0).max(1e-3);
    (0..limits.joints.len()).all(|j| {
        let change: f64 = (from..to).map(|i| (path.states[i + 1].joints[j] - path.states[i].joints[j]).abs()).sum();
        change <= 0.6 * limits.joints[j].speed * available
    })
}

#[cfg(test)]
mod tests {
    use super::super::penalty::example_limits;
    use super::*;
    use crate::geom::Pose2;

    /// A path from (turn, distance, joint) steps; negative distance: reverse.
    fn path(steps: &[(f64, f64, f64)]) -> SearchPath {
        let mut states = vec![SearchState { pose: Pose2::default(), joints: vec![0.0] }];
        let mut moves = Vec::new();
        for &(turn, distance, joint) in steps {
            let from = states.last().unwrap().clone();
            let yaw = from.pose.yaw + turn;
            let pose =
                Pose2::new(from.pose.x + distance * real::cos(yaw), from.pose.y + distance * real::sin(yaw), yaw);
            states.push(SearchState { pose, joints: vec![joint] });
            moves.push(match distance {
                0.0 => SearchMove::Still,
                d if d > 0.0 => SearchMove::Forward,
                _ => SearchMove::Reverse,
            });
        }
        SearchPath { states, moves, expanded: 0 }
    }

    fn kinds(path: &SearchPath, thresholds: Thresholds) -> String {
        sections(path, 0, path.moves.len(), &example_limits(1), thresholds)
            .iter()
            .map(|s| match s {
                Section::Still(_) => 's',
                Section::Drive(DriveSection { reverse: false, .. }) => 'f',
                Section::Drive(_) => 'r',
            })
            .collect()
    }

    const SOME: Thresholds = Thresholds { interior: 1.75, ends: 0.8, slowest: 0.05, reach: 0.3, cut: None };

    #[test]
    fn small_spins_are_driven_and_large_ones_are_spins() {
        let p = path(&[(0.7, 0.0, 0.0), (0.0, 1.0, 0.0), (1.5, 0.0, 0.0), (0.0, 1.0, 0.0), (0.7, 0.0, 0.0)]);
        assert_eq!(kinds(&p, SOME), "f");
        assert_eq!(kinds(&p, Thresholds::NONE), "sfsfs");
        let p = path(&[(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (2.5, 0.0, 0.0), (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)]);
        assert_eq!(kinds(&p, SOME), "sfsfs");
    }

    #[test]
    fn a_change_of_direction_is_a_stop() {
        assert_eq!(kinds(&path(&[(0.0, 1.0, 0.0), (0.0, -0.5, 0.0), (0.2, 0.0, 0.0), (0.0, 1.0, 0.0)]), SOME), "frsf");
    }

    #[test]
    fn a_joint_moves_while_driving_only_where_there_is_time() {
        assert_eq!(kinds(&path(&[(0.0, 1.0, 0.0), (0.0, 0.0, 0.2), (0.0, 1.0, 0.2)]), SOME), "f");
        assert_eq!(kinds(&path(&[(0.0, 1.0, 0.0), (0.0, 0.0, 3.0), (0.0, 1.0, 3.0)]), SOME), "fsf");
        assert_eq!(kinds(&path(&[(0.0, 0.0, 0.5), (0.0, 1.0, 0.5)]), SOME), "sf");
    }

    #[test]
    fn a_path_that_only_stands_has_no_drive() {
        assert_eq!(kinds(&path(&[(1.0, 0.0, 0.0), (0.0, 0.0, 1.0)]), SOME), "ss");
        assert_eq!(kinds(&path(&[(0.0, 0.0, 0.0)]), SOME), "");
    }
}
