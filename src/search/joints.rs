//! The joint path along a route, by dynamic programming over its pieces: least change, changes where there is time for
//! them, and away from postures that are not free.

use super::bits::Bits;
use super::posture::Neighbours;

/// A posture change within the time that the base's piece takes anyway costs this per step ...
const STEP: u32 = 2;
/// ... and beyond it this: the base must wait.
const WAIT: u32 = 20;
/// Being one, two, three steps from a posture that is not free, or from beyond a joint's range, costs this a piece: room for the
/// optimiser.
const CLOSE: [u32; 3] = [12, 6, 3];

const UNREACHED: u32 = u32::MAX / 2;

/// The postures that each piece passes, step by step, from the last one of the piece before; `None` where none gets through.
///
/// `masks`: free postures of each piece; a change during a piece passes only through its free postures. `rates`: steps that
/// there is time for in each piece. `shut`: steps that are not taken in a piece. `brinks`: postures at the ends of the ranges of joints that need not be there.
pub(super) fn choose<const W: usize>(
    neighbours: &Neighbours<W>,
    count: usize,
    masks: &[Bits<W>],
    rates: &[usize],
    shut: impl Fn(usize, usize, usize) -> bool,
    [start, goal]: [Bits<W>; 2],
    brinks: Bits<W>,
) -> Option<Vec<Vec<usize>>> {
    let mut cost: Vec<u32> = (0..count).map(|p| if start.contains(p) { 0 } else { UNREACHED }).collect();
    let mut came_from: Vec<Vec<u32>> = Vec::with_capacity(masks.len());
    for (piece, (mask, rate)) in masks.iter().zip(rates).enumerate() {
        let shut = |p, q| shut(piece, p, q);
        let mut from: Vec<u32> = (0..count as u32).collect();
        for (p, cost) in cost.iter_mut().enumerate() {
            if !mask.contains(p) {
                *cost = UNREACHED;
            }
        }
        for _ in 0..*rate {
            if !relax(neighbours, *mask, shut, STEP, &mut cost, &mut from) {
                break;
            }
        }
        while relax(neighbours, *mask, shut, WAIT, &mut cost, &mut from) {}
        let mut near = *mask;
        for (k, close) in CLOSE.into_iter().enumerate() {
            // Postures that have a neighbour outside: not in the mask's interior.
            let outside = Bits::all(count).minus(near);
            let edge = neighbours.dilate(outside, near).or(if k == 0 { brinks.and(near) } else { Bits::EMPTY });
            edge.iter().for_each(|p| cost[p] = cost[p].saturating_add(close));
            near = near.minus(edge);
        }
        came_from.push(from);
    }
    let last = goal.iter().filter(|p| cost[*p] < UNREACHED).min_by_key(|p| cost[*p])?;
    let mut at = last;
    let mut passed = Vec::with_capacity(masks.len());
    for from in came_from.iter().rev() {
        let mut steps = vec![at];
        // Each step led to where it is cheaper to be, so none leads back.
        while from[at] as usize != at {
            at = from[at] as usize;
            steps.push(at);
        }
        steps.reverse();
        passed.push(steps);
    }
    passed.reverse();
    Some(passed)
}

/// One step in every direction at once, and where it came from; whether anything got cheaper.
fn relax<const W: usize>(
    neighbours: &Neighbours<W>,
    mask: Bits<W>,
    shut: impl Fn(usize, usize) -> bool,
    step: u32,
    cost: &mut [u32],
    from: &mut [u32],
) -> bool {
    let before = cost.to_vec();
    let mut changed = false;
    for p in mask.iter() {
        neighbours.each(p, |q| {
            if before[q] < UNREACHED && before[q] + step < cost[p] && !shut(p, q) {
                cost[p] = before[q] + step;
                from[p] = q as u32;
                changed = true;
            }
        });
    }
    changed
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(range: std::ops::Range<usize>) -> Bits<1> {
        let mut bits = Bits::EMPTY;
        range.for_each(|p| bits.insert(p));
        bits
    }

    fn one_joint() -> Neighbours<1> {
        use crate::robot::{MotionLimits, MovingJoint, RobotModel};
        let joint = MovingJoint {
            name: "j".into(),
            prismatic: false,
            lower: 0.0,
            upper: 1.0,
            limits: MotionLimits { speed: Some(1.0), acceleration: None, jerk: None },
        };
        let base = crate::robot::BaseLimits {
            speed: 1.0,
            acceleration: 1.0,
            angular_speed: 1.0,
            angular_acceleration: 1.0,
            eta: 1.0,
            min_speed: 0.01,
        };
        let robot = RobotModel {
            name: "r".into(),
            wheel_radii: 0.1.into(),
            track_width: 0.3,
            root_link: "base".into(),
            base_from_root: nalgebra::Isometry3::identity(),
            joints: vec![joint],
            bodies: vec![],
            shapes: vec![],
            wheel: MotionLimits { speed: None, acceleration: None, jerk: None },
            base,
            ignore_pairs: vec![],
            tolerance: None,
            links: Vec::new(),
        };
        let pose = crate::geom::Pose2::default();
        let [start_joints, goal_joints] = [vec![None], vec![None]];
        let query = super::super::Query {
            start: pose,
            start_joints,
            goal: pose,
            goal_within: 0.0,
            goal_yaw: None,
            goal_joints,
        };
        Neighbours::new(&super::super::posture::Postures::new(&robot, &query, 0))
    }

    /// Where each piece begins, and the last one ends.
    fn between(passed: &[Vec<usize>]) -> Vec<usize> {
        let first = passed[0][0];
        std::iter::once(first).chain(passed.iter().map(|steps| steps[steps.len() - 1])).collect()
    }

    #[test]
    fn a_change_is_spread_over_the_pieces_that_have_time_for_it() {
        let masks = [line(0..64), line(0..64), line(0..64), line(30..64)];
        let path = choose(&one_joint(), 64, &masks, &[12; 4], |_, _, _| false, [line(0..1), line(0..64)], Bits::EMPTY)
            .expect("a way");
        for pair in path.windows(2) {
            assert_eq!(pair[0].last(), pair[1].first());
        }
        for (steps, mask) in path.iter().zip(&masks) {
            assert!(steps.windows(2).all(|pair| pair[0].abs_diff(pair[1]) == 1), "{path:?}");
            assert!(steps.iter().all(|p| mask.contains(*p)), "{path:?}");
        }
        let path = between(&path);
        assert_eq!(path.len(), 5);
        for (k, pair) in path.windows(2).enumerate() {
            assert!(pair[0].abs_diff(pair[1]) <= 12, "piece {k}: {path:?}");
        }
        assert!(path[3] >= 30 && path[4] >= 30, "{path:?}");
    }

    #[test]
    fn a_joint_that_may_start_anywhere_keeps_off_the_ends_of_its_range() {
        let brinks = line(0..1).or(line(63..64));
        let free = |start, brinks| {
            let path =
                choose(&one_joint(), 64, &[line(0..64); 5], &[64; 5], |_, _, _| false, [start, line(0..64)], brinks);
            between(&path.expect("a way"))
        };
        let path = free(line(0..64), brinks);
        assert!(path.iter().all(|p| (3..61).contains(p) && *p == path[0]), "{path:?}");
        // What is asked for is kept, and nothing moves for its own sake.
        assert_eq!(free(line(0..1), Bits::EMPTY), [0; 6]);
    }

    #[test]
    fn a_gap_in_the_free_postures_is_not_jumped() {
        let mut split = line(0..20);
        split = split.or(line(30..64));
        assert!(
            choose(&one_joint(), 64, &[split], &[64], |_, _, _| false, [line(0..1), line(40..41)], Bits::EMPTY)
                .is_none()
        );
        assert!(
            choose(
                &one_joint(),
                64,
                &[split, line(0..64)],
                &[64, 64],
                |_, _, _| false,
                [line(0..1), line(40..41)],
                Bits::EMPTY
            )
            .is_some()
        );
    }

    #[test]
    fn a_step_that_is_shut_in_a_piece_is_taken_in_another_or_not_at_all() {
        let masks = [line(0..64); 3];
        let path = |shut: &dyn Fn(usize) -> bool| {
            let shut = |piece, p: usize, q: usize| shut(piece) && p.min(q) == 20;
            choose(&one_joint(), 64, &masks, &[64; 3], shut, [line(10..11), line(30..31)], Bits::EMPTY)
        };
        let passed = path(&|piece| piece != 1).expect("in the second");
        assert_eq!(passed[1].windows(2).filter(|pair| pair[0].min(pair[1]) == 20).count(), 1, "{passed:?}");
        assert!(path(&|_| true).is_none());
    }
}
