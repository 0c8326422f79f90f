//! A checked route with the joints' path along it.

use std::ops::Range;

use super::bits::Bits;
use super::collide::{BaseMotion, Collider};
use super::joints;
use super::posture::straight;
use super::route::Route;
use super::shortcut::CheckedRoute;
use super::{Query, SearchMove, SearchPath, SearchState};
use crate::geom::{Pose2, wrap_angle};
use crate::robot::RobotModel;

/// Joint paths that are looked for without the steps that jump over obstacles, and how far about such a place they are not made, m.
const JUMPS: usize = 12;
const SAME_PLACE: f64 = 0.3;

/// The route with the joints' path: states after each piece, those that only continue the one before left out.
pub(super) fn with_joints<const W: usize>(
    collider: &Collider<'_, W>,
    robot: &RobotModel,
    query: &Query,
    checked: &CheckedRoute<W>,
    pieces: &[BaseMotion],
    ends: [Bits<W>; 2],
    expanded: usize,
) -> SearchPath {
    let passed = joint_path(collider, robot, query, checked, pieces, ends);
    let exact = |asked: &[Option<f64>], posture: usize| -> Vec<f64> {
        asked.iter().zip(collider.postures.joints(posture)).map(|(a, own)| a.unwrap_or(*own)).collect()
    };
    let first = passed[0][0];
    let mut path = SearchPath {
        states: vec![SearchState { pose: query.start, joints: exact(&query.start_joints, first) }],
        moves: Vec::new(),
        expanded,
    };
    path.then_to(
        SearchState { pose: query.start, joints: collider.postures.joints(first).to_vec() },
        SearchMove::Still,
    );
    let drive_reverse = reverse_of_pieces(&checked.route, pieces);
    let mut last = first;
    for (k, piece) in pieces.iter().enumerate() {
        let kind = match drive_reverse[k] {
            None => SearchMove::Still,
            Some(false) => SearchMove::Forward,
            Some(true) => SearchMove::Reverse,
        };
        let steps = &passed[k];
        for at in bends(collider, piece, steps) {
            let pose = piece.at(at as f64 / (steps.len() - 1) as f64);
            path.then_to(SearchState { pose, joints: collider.postures.joints(steps[at]).to_vec() }, kind);
        }
        last = steps[steps.len() - 1];
        path.then_to(SearchState { pose: piece.to, joints: collider.postures.joints(last).to_vec() }, kind);
    }
    let end = path.states[path.states.len() - 1].pose;
    let yaw = query.goal_yaw.map_or(end.yaw, |yaw| end.yaw + wrap_angle(yaw - end.yaw));
    let [x, y] = if query.goal_within > 0.0 { [end.x, end.y] } else { [query.goal.x, query.goal.y] };
    let end = Pose2 { x, y, yaw };
    path.states.last_mut().expect("never empty").pose = end;
    path.then_to(SearchState { pose: end, joints: exact(&query.goal_joints, last) }, SearchMove::Still);
    if path.moves.is_empty() {
        let only = path.states[0].clone();
        path.states.push(only);
        path.moves.push(SearchMove::Still);
    }
    path
}

/// The postures that each piece passes, without steps that jump over obstacles where there are others.
fn joint_path<const W: usize>(
    collider: &Collider<'_, W>,
    robot: &RobotModel,
    query: &Query,
    checked: &CheckedRoute<W>,
    pieces: &[BaseMotion],
    ends: [Bits<W>; 2],
) -> Vec<Vec<usize>> {
    let masks = checked.masks();
    let rates: Vec<usize> =
        pieces.iter().map(|piece| collider.postures.steps_within(robot, time_of(robot, piece))).collect();
    // The optimiser's curves need some room to swing within the ranges, too.
    let open = (0..robot.joints.len()).filter(|m| query.start_joints[*m].or(query.goal_joints[*m]).is_none());
    let brinks = collider.postures.brinks(open);
    let count = collider.postures.count();
    let choose = |shut: &[Jump]| {
        let shut = |piece: usize, p: usize, q: usize| {
            let step = [p.min(q), p.max(q)];
            shut.iter().any(|jump| jump.step == step && jump.pieces.contains(&piece))
        };
        joints::choose(&collider.neighbours, count, &masks, &rates, shut, ends, brinks)
    };
    let mut passed = choose(&[]).expect("the checked route passes postures from start to goal");
    let mut shut = Vec::new();
    for _ in 0..JUMPS {
        let jumps = jumps(collider, pieces, &passed);
        if jumps.is_empty() {
            break;
        }
        shut.extend(jumps);
        // Where there is no other way the certificate judges.
        let Some(other) = choose(&shut) else { break };
        passed = other;
    }
    passed
}

/// A step between postures that is not taken in some pieces, since something is in the way between the two.
struct Jump {
    /// The lower posture first.
    step: [usize; 2],
    pieces: Range<usize>,
}

/// Steps of a joint path that meet an obstacle between two postures, each at the pose where it is made.
fn jumps<const W: usize>(collider: &Collider<'_, W>, pieces: &[BaseMotion], passed: &[Vec<usize>]) -> Vec<Jump> {
    let mut out = Vec::new();
    // A grid's postures are neighbours closely enough.
    if collider.postures.is_exhaustive() {
        return out;
    }
    for (k, (piece, steps)) in pieces.iter().zip(passed).enumerate() {
        for (j, step) in steps.windows(2).enumerate() {
            let [p, q] = [step[0], step[1]];
            let pose = piece.at((j as f64 + 0.5) / (steps.len() - 1) as f64);
            if !collider.clears(pose)(collider.postures.joints(p), collider.postures.joints(q)) {
                let near = |other: &BaseMotion| other.at(0.5).distance(pose) <= SAME_PLACE;
                let before = pieces[..k].iter().rev().take_while(|other| near(other)).count();
                let after = pieces[k + 1..].iter().take_while(|other| near(other)).count();
                out.push(Jump { step: [p.min(q), p.max(q)], pieces: k - before..k + after + 1 });
            }
        }
    }
    out
}

/// Where the steps between postures that a piece passes must bend (indices, without first and last): straight ways are taken where those
/// are free at the piece's ends and in its middle.
fn bends<const W: usize>(collider: &Collider<'_, W>, piece: &BaseMotion, steps: &[usize]) -> Vec<usize> {
    let joints = |at: usize| collider.postures.joints(steps[at]);
    let mut out = Vec::new();
    if (1..steps.len().max(1) - 1).all(|k| straight(joints(k - 1), joints(k), joints(k + 1))) {
        return out;
    }
    let looks = [0.0, 0.5, 1.0].map(|share| collider.passes(piece.at(share)));
    let mut open = vec![(0, steps.len() - 1)];
    while let Some((a, b)) = open.pop() {
        if b > a + 1 && !looks.iter().all(|passes| passes(joints(a), joints(b))) {
            let middle = a.midpoint(b);
            out.push(middle);
            open.extend([(a, middle), (middle, b)]);
        }
    }
    out.sort_unstable();
    out
}

/// Per piece: `None` for a turn, else whether it backs up.
fn reverse_of_pieces(route: &Route, pieces: &[BaseMotion]) -> Vec<Option<bool>> {
    let mut drive = 0;
    let mut out = Vec::with_capacity(pieces.len());
    for piece in pieces {
        let driving = piece.from.distance(piece.to) > 0.0;
        // A drive of no length only keeps two turns apart.
        while driving && route.corners[drive] == route.corners[drive + 1] {
            drive += 1;
        }
        out.push(driving.then(|| route.reverse[drive]));
        if driving && route.corners[drive + 1] == [piece.to.x, piece.to.y] {
            drive += 1;
        }
    }
    out
}

/// Time that the base takes through a piece at least, s.
fn time_of(robot: &RobotModel, piece: &BaseMotion) -> f64 {
    piece.from.distance(piece.to) / robot.base.speed
        + (piece.to.yaw - piece.from.yaw).abs() / robot.base.angular_speed.max(1e-6)
}
