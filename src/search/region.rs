//! Goals that are a region: any place within a distance of a point.
//!
//! First one place after another is tried as an exact goal, and what is found is cut where it enters the region; then the lattice is
//! searched for any of its places, which is as complete as for an exact goal.

use std::ops::Range;

use super::bits::Bits;
use super::collide::{BaseMotion, Collider};
use super::heuristic::Core;
use super::lattice::Lattice;
use super::posture::{self, Postures};
use super::solve::{self, End, Problem};
use super::{Query, SearchMove, SearchPath, SearchState, quick};
use crate::geom::Pose2;
use crate::math::real;

/// Planned ends keep off the rim by so much, m, or by half the radius: commands may miss a plan by that.
const RIM: f64 = 1e-3;
/// Poses that are looked at for a free one; where a region has more and none of these is, the search itself has to say.
const MOST_LOOKS: usize = 20_000;

/// How far from the goal's point the plan may end, m; 0: there.
pub(super) fn reach(query: &Query) -> f64 {
    (query.goal_within - RIM).max(0.5 * query.goal_within)
}

/// The place of the goal that is nearest to a place.
pub(super) fn nearest(query: &Query, from: [f64; 2]) -> [f64; 2] {
    let goal = [query.goal.x, query.goal.y];
    let off = [from[0] - goal[0], from[1] - goal[1]];
    let (distance, reach) = (real::hypot(off[0], off[1]), reach(query));
    if reach == 0.0 {
        goal
    } else if distance <= reach {
        from
    } else {
        [0, 1].map(|a| goal[a] + off[a] * (reach / distance))
    }
}

/// The goal's point, and the lattice positions that will do too, the nearest to it first.
pub(super) fn places<'a>(query: &Query, lattice: &'a Lattice) -> impl Iterator<Item = [f64; 2]> + 'a {
    let goal = [query.goal.x, query.goal.y];
    let at = lattice.coordinates(goal[0], goal[1]);
    let reach = reach(query) / lattice.step;
    let range = |d: usize| (at[d] - reach).ceil() as i32..=(at[d] + reach).floor() as i32;
    let off = |(i, j): &(i32, i32)| real::hypot(f64::from(*i) - at[0], f64::from(*j) - at[1]);
    let around = range(0).flat_map(|i| range(1).map(move |j| (i, j)));
    let mut around: Vec<(i32, i32)> =
        around.filter(|p| reach > 0.0 && lattice.contains(p.0, p.1) && off(p) <= reach).collect();
    around.sort_by(|a, b| off(a).total_cmp(&off(b)));
    std::iter::once(goal).chain(around.into_iter().map(|(i, j)| lattice.position(i, j)))
}

/// Postures that will do at the goal; `None`: they are free nowhere in it.
pub(super) fn postures<const W: usize>(
    collider: &Collider<'_, W>,
    lattice: &Lattice,
    query: &Query,
) -> Option<Bits<W>> {
    let mut wanted = collider.all();
    for posture in wanted.iter() {
        if !collider.postures.agrees(posture, End::Goal, &query.goal_joints) {
            wanted.remove(posture);
        }
    }
    let headings = solve::goal_headings(query);
    let mut poses = places(query, lattice).flat_map(|[x, y]| headings.iter().map(move |yaw| Pose2::new(x, y, *yaw)));
    let is_free = |pose: Pose2| !collider.free(&BaseMotion { from: pose, to: pose }).and(wanted).is_empty();
    let any = poses.by_ref().take(MOST_LOOKS).any(is_free) || poses.next().is_some();
    any.then_some(wanted)
}

/// A path to one of a few places of the region, tried as exact goals with these levels of postures. None proves nothing.
pub(super) fn path(problem: Problem<'_>, levels: Range<usize>) -> Option<SearchPath> {
    let Problem { map, esdf, robot, query, .. } = problem;
    let bounds = map.bounds();
    let (lattice, core) = (Lattice::new(map), Core::new(robot));
    let room = |place: &[f64; 2]| core.guessed_clearance(esdf, *place);
    let roomiest = places(query, &lattice).max_by(|a, b| room(a).total_cmp(&room(b)));
    let tries = [Some(nearest(query, [query.start.x, query.start.y])), Some([query.goal.x, query.goal.y]), roomiest];
    let inside = |place: &[f64; 2]| (0..2).all(|a| (bounds.min[a]..=bounds.max[a]).contains(&place[a]));
    for [x, y] in tries.into_iter().flatten().filter(inside) {
        let exact = Query { goal: Pose2 { x, y, ..query.goal }, goal_within: 0.0, ..query.clone() };
        let problem = Problem { query: &exact, ..problem };
        for level in levels.clone() {
            let postures = Postures::new(robot, &exact, level);
            let found = if postures.count() <= 64 {
                quick::<1>(problem, postures)
            } else if level + 1 < Postures::levels(robot) {
                quick::<{ posture::FEW_POSTURES / 64 }>(problem, postures)
            } else {
                quick::<{ posture::MOST_POSTURES / 64 }>(problem, postures)
            };
            if let Some(guided) = found {
                return Some(cut(guided.path, query));
            }
        }
    }
    None
}

/// The path as far as where it first enters the region, if neither heading nor joints matter there.
fn cut(mut path: SearchPath, query: &Query) -> SearchPath {
    if query.goal_yaw.is_some() || query.goal_joints.iter().any(Option::is_some) {
        return path;
    }
    let reach = reach(query);
    let entry = path.states.windows(2).enumerate().find_map(|(k, pair)| {
        let off = [pair[0].pose.x - query.goal.x, pair[0].pose.y - query.goal.y];
        let by = [pair[1].pose.x - pair[0].pose.x, pair[1].pose.y - pair[0].pose.y];
        Some((k, entry(off, by, reach)?))
    });
    let Some((k, share)) = entry else { return path };
    let (a, b) = (&path.states[k], &path.states[k + 1]);
    let mix = |a: f64, b: f64| a + share * (b - a);
    let end = SearchState {
        pose: Pose2::new(mix(a.pose.x, b.pose.x), mix(a.pose.y, b.pose.y), mix(a.pose.yaw, b.pose.yaw)),
        joints: a.joints.iter().zip(&b.joints).map(|(a, b)| mix(*a, *b)).collect(),
    };
    path.states.truncate(k + 1);
    path.moves.truncate(k + 1);
    if share > 0.0 {
        path.states.push(end);
    } else {
        path.moves.truncate(k);
    }
    if path.moves.is_empty() {
        let only = path.states[0].clone();
        path.states.push(only);
        path.moves.push(SearchMove::Still);
    }
    path
}

/// The share of the way `by` from `off` at which it is first within `reach` of the origin.
fn entry(off: [f64; 2], by: [f64; 2], reach: f64) -> Option<f64> {
    let [a, b, c] = [
        by[0] * by[0] + by[1] * by[1],
        off[0] * by[0] + off[1] * by[1],
        off[0] * off[0] + off[1] * off[1] - reach * reach,
    ];
    if c <= 0.0 {
        return Some(0.0);
    }
    let under = b * b - a * c;
    let share = (-b - under.max(0.0).sqrt()) / a;
    (a > 0.0 && under >= 0.0 && (0.0..=1.0).contains(&share)).then_some(share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_way_enters_a_disc_where_it_is_first_within_it(
            off in [-2.0..2.0f64, -2.0..2.0], by in [-3.0..3.0f64, -3.0..3.0], reach in 0.05..1.0f64,
        ) {
            let distance = |share: f64| real::hypot(off[0] + share * by[0], off[1] + share * by[1]);
            let first = (0..=2000).map(|k| f64::from(k) / 2000.0).find(|share| distance(*share) <= reach);
            match (entry(off, by, reach), first) {
                (Some(found), Some(first)) => {
                    prop_assert!(found <= first + 1e-12 && first - found < 6e-4 || distance(found) < reach + 1e-9);
                    prop_assert!(found == 0.0 || (distance(found) - reach).abs() < 1e-9);
                }
                // Between two samples it may touch the rim.
                (Some(found), None) => prop_assert!((distance(found) - reach).abs() < 1e-9),
                (None, first) => prop_assert!(first.is_none()),
            }
        }
    }
}
