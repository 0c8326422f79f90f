//! First guess of a steered motion: nodes along the search's path, corners rounded where the base can drive through them.

use super::hermite::ORDERS;
use super::layout::Layout;
use crate::math::real;
use crate::optimize::initial::trapezoid;
use crate::optimize::penalty::Limits;
use crate::search::{SearchMove, SearchPath};

/// Turns at start and goal up to this are driven, rad; what is more is turned on the spot first.
const DRIVEN_TURN: f64 = 1.0;
/// Larger turns on the way are made standing, rad.
const LARGEST_CORNER: f64 = 1.9;
/// A corner takes at most this share of the straights beside it.
const SHARE: f64 = 0.4;
/// Share of the limits that the guess uses.
const USED: f64 = 0.8;
/// Longest piece on a straight, m; with joints that move; with joints, seconds of a joint's full speed a piece.
const LONGEST: f64 = 2.5;
const LONGEST_MOVING: f64 = 0.6;
/// Shorter straights between corners are shared among them, m: a short piece makes the cost steep.
const SHORTEST_STRAIGHT: f64 = 0.3;
/// Parts between bends of the joints' way are at least this long, m.
const SHORTEST_PART: f64 = 0.1;
/// Quintics from rest to rest: peak speed and acceleration over distance / T and distance / T^2.
const PEAK_SPEED: f64 = 1.875;
const PEAK_ACCELERATION: f64 = 5.774;

/// Where to begin, and what may not change.
pub(super) struct Guess {
    pub layout: Layout,
    pub x: Vec<f64>,
    /// Which way the base drives, one a piece.
    pub directions: Vec<f64>,
    pub fixed: Vec<bool>,
}

/// A corner of the path: turns and joints moved there, from standing to standing.
struct Corner {
    position: [f64; 2],
    /// (heading, joints) at each stand, first to last.
    stands: Vec<(f64, Vec<f64>)>,
}

impl Corner {
    fn turn(&self) -> f64 {
        self.stands[self.stands.len() - 1].0 - self.stands[0].0
    }

    /// Whether it only turns, one way.
    fn is_plain(&self) -> bool {
        let still = self.stands.windows(2).all(|w| w[0].1.iter().zip(&w[1].1).all(|(a, b)| (a - b).abs() < 1e-9));
        let total: f64 = self.stands.windows(2).map(|w| (w[1].0 - w[0].0).abs()).sum();
        still && total <= self.turn().abs() + 1e-9
    }
}

/// A straight drive between two corners.
struct Straight {
    direction: f64,
    length: f64,
    /// Joints by distance from its start.
    joints: Vec<(f64, Vec<f64>)>,
}

impl Straight {
    /// Parts between two distances from its start (first, length), cut where the joints' way bends.
    fn parts(&self, from: f64, length: f64) -> Vec<(f64, f64)> {
        let bent = self.joints.windows(3).filter(|w| bends(&w[0].1, &w[1].1, &w[2].1)).map(|w| w[1].0);
        let mut parts = vec![(from, length)];
        for at in bent {
            let last = parts.len() - 1;
            let (start, rest) = parts[last];
            let before = at - start;
            if before.min(rest - before) >= SHORTEST_PART {
                parts[last].1 = before;
                parts.push((at, rest - before));
            }
        }
        parts
    }

    fn joints_at(&self, at: f64) -> Vec<f64> {
        let after = self.joints.iter().position(|(d, _)| *d >= at).unwrap_or(self.joints.len() - 1);
        if after == 0 {
            return self.joints[0].1.clone();
        }
        let ((d0, a), (d1, b)) = (&self.joints[after - 1], &self.joints[after]);
        let share = if d1 > d0 { (at - d0) / (d1 - d0) } else { 1.0 };
        a.iter().zip(b).map(|(a, b)| a + share.clamp(0.0, 1.0) * (b - a)).collect()
    }
}

fn take_apart(path: &SearchPath) -> (Vec<Corner>, Vec<Straight>) {
    let corner = |at: usize| {
        let state = &path.states[at];
        Corner { position: [state.pose.x, state.pose.y], stands: vec![(state.pose.yaw, state.joints.clone())] }
    };
    let mut corners = vec![corner(0)];
    let mut straights: Vec<Straight> = Vec::new();
    let mut driving = false;
    for (i, step) in path.moves.iter().enumerate() {
        let (from, to) = (&path.states[i], &path.states[i + 1]);
        match step {
            SearchMove::Still => {
                driving = false;
                let last = corners.len() - 1;
                corners[last].stands.push((to.pose.yaw, to.joints.clone()));
            }
            SearchMove::Forward | SearchMove::Reverse => {
                let direction = if *step == SearchMove::Reverse { -1.0 } else { 1.0 };
                let length = from.pose.distance(to.pose);
                let goes_on = driving && straights.last().is_some_and(|s| s.direction == direction);
                if goes_on {
                    let last = straights.len() - 1;
                    let straight = &mut straights[last];
                    straight.length += length;
                    straight.joints.push((straight.length, to.joints.clone()));
                    let end = corners.len() - 1;
                    corners[end] = corner(i + 1);
                } else {
                    straights.push(Straight {
                        direction,
                        length,
                        joints: vec![(0.0, from.joints.clone()), (length, to.joints.clone())],
                    });
                    corners.push(corner(i + 1));
                }
                driving = true;
            }
        }
    }
    (corners, straights)
}

struct Node {
    position: [f64; 2],
    yaw: f64,
    joints: Vec<f64>,
    /// Greatest speed, m/s.
    cap: f64,
}

struct Link {
    direction: f64,
    length: f64,
    turn: f64,
}

/// Cosine of an angle between motions of the joints beyond which the guess goes round the corner, not across it.
const BENT: f64 = 0.99;

/// Whether the joints' way bends between three postures: neither straight on nor straight back.
fn bends(a: &[f64], b: &[f64], c: &[f64]) -> bool {
    let product = |p: [&[f64]; 2], q: [&[f64]; 2]| {
        let steps = p[0].iter().zip(p[1]).zip(q[0].iter().zip(q[1]));
        steps.map(|((p0, p1), (q0, q1))| (p1 - p0) * (q1 - q0)).sum::<f64>()
    };
    let (own, next, both) = (product([a, b], [a, b]), product([b, c], [b, c]), product([a, b], [b, c]));
    own > 1e-12 && next > 1e-12 && both * both < BENT * BENT * own * next
}

/// Stands at a corner that the guess keeps: where a joint turns back or the joints' way bends, and first and last.
fn kept(corner: &Corner) -> Vec<usize> {
    let n = corner.stands.len();
    let mut kept = vec![0];
    for i in 1..n.saturating_sub(1) {
        let (a, b, c) = (&corner.stands[i - 1], &corner.stands[i], &corner.stands[i + 1]);
        let back = |a: f64, b: f64, c: f64| (b - a) * (c - b) < -1e-12;
        let kink = |a: f64, b: f64, c: f64| ((b - a).abs() < 1e-9) != ((c - b).abs() < 1e-9);
        let joints = a.1.iter().zip(&b.1).zip(&c.1).any(|((a, b), c)| back(*a, *b, *c) || kink(*a, *b, *c));
        if back(a.0, b.0, c.0) || joints || bends(&a.1, &b.1, &c.1) {
            kept.push(i);
        }
    }
    if n > 1 {
        kept.push(n - 1);
    }
    kept
}

/// The guess for a path; `None` where nothing moves.
pub(super) fn guess(path: &SearchPath, limits: &Limits) -> Option<Guess> {
    let (corners, straights) = take_apart(path);
    let ramp = 0.5 * limits.speed * limits.speed / limits.acceleration;
    let mut nodes: Vec<Node> = Vec::new();
    let mut links: Vec<Link> = Vec::new();
    let last = corners.len() - 1;
    // How far from each corner its rounding begins and ends, and at which speed.
    let rounding: Vec<Option<(f64, f64)>> = (0..=last)
        .map(|k| {
            let corner = &corners[k];
            if k == 0 || k == last || !corner.is_plain() || corner.turn().abs() > LARGEST_CORNER {
                return None;
            }
            let (before, after) = (&straights[k - 1], &straights[k]);
            if before.direction != after.direction {
                return None;
            }
            let half = real::tan(0.5 * corner.turn().abs());
            let reach = (0.15 + 0.5 * half).min(SHARE * before.length.min(after.length));
            let radius = reach / half.max(1e-6);
            let speed = radius * limits.turn_slope * limits.speed / (1.0 + radius * limits.turn_slope) / 1.5;
            Some((reach, speed.min(USED * limits.speed).max(0.05 * limits.speed)))
        })
        .collect();
    let push = |nodes: &mut Vec<Node>, links: &mut Vec<Link>, node: Node, link: Link| {
        nodes.push(node);
        links.push(link);
    };
    let mut tail_before = 0.0;
    for k in 0..=last {
        let corner = &corners[k];
        let at = |i: usize| corner.stands[i].clone();
        let node = |yaw: f64, joints: Vec<f64>| Node { position: corner.position, yaw, joints, cap: 0.0 };
        if k == 0 {
            let (yaw, joints) = at(0);
            nodes.push(node(yaw, joints));
        }
        let direction = if k < last { straights[k].direction } else { straights.last().map_or(1.0, |s| s.direction) };
        if rounding[k].is_none() {
            let stands = kept(corner);
            let driven = corner.turn().clamp(-DRIVEN_TURN, DRIVEN_TURN);
            let drives_turns = last > 0 && corner.is_plain();
            let leaves =
                [(last, driven), (0, driven)].map(|(end, turn)| if drives_turns && k == end { turn } else { 0.0 });
            if k > 0 && leaves[0] != 0.0 {
                // Already there, turned by what was driven.
                let n = nodes.len() - 1;
                nodes[n].yaw += leaves[0];
                let m = links.len() - 1;
                links[m].turn = leaves[0].abs();
            }
            for pair in stands.windows(2) {
                let (mut yaw, joints) = at(pair[1]);
                if pair[1] + 1 == corner.stands.len() {
                    yaw -= leaves[1];
                }
                let before = nodes[nodes.len() - 1].yaw;
                let moved = nodes[nodes.len() - 1].joints.iter().zip(&joints).any(|(a, b)| (a - b).abs() > 1e-9);
                if (yaw - before).abs() > 1e-9 || moved {
                    let turn = (yaw - before).abs();
                    push(&mut nodes, &mut links, node(yaw, joints), Link { direction, length: 0.0, turn });
                }
            }
        }
        if k == last {
            break;
        }
        let straight = &straights[k];
        let (from, to) = (corner.position, corners[k + 1].position);
        let heading = corner.stands[corner.stands.len() - 1].0;
        let point = |d: f64| {
            let share = if straight.length > 0.0 { d / straight.length } else { 0.0 };
            [from[0] + share * (to[0] - from[0]), from[1] + share * (to[1] - from[1])]
        };
        let on = |d: f64, cap: f64| Node { position: point(d), yaw: heading, joints: straight.joints_at(d), cap };
        let cruise = USED * limits.speed;
        // Out of the corner or the stand.
        let (mut head, mut turn_in) = (ramp.min(SHARE * straight.length), 0.0);
        let mut cap = cruise;
        if let Some((reach, speed)) = rounding[k] {
            head = reach;
            cap = speed;
            turn_in = corner.turn().abs();
        }
        let (mut tail, tail_cap) = match rounding[k + 1] {
            Some((reach, speed)) => (reach, speed),
            None => (ramp.min(SHARE * straight.length), cruise),
        };
        let mut middle = straight.length - head - tail;
        let shared = middle < SHORTEST_STRAIGHT && straight.parts(head, middle).len() == 1;
        if shared {
            (head, tail, middle) = (head + 0.5 * middle, tail + 0.5 * middle, 0.0);
            cap = cap.min(tail_cap);
        }
        let leaving = (heading - nodes[nodes.len() - 1].yaw).abs();
        let bent = if rounding[k].is_some() { tail_before + head } else { head };
        tail_before = tail;
        push(
            &mut nodes,
            &mut links,
            on(head, cap),
            Link { direction: straight.direction, length: bent, turn: turn_in.max(leaving) },
        );
        let moving =
            (0..limits.joints.len()).any(|j| straight.joints.windows(2).any(|w| (w[1].1[j] - w[0].1[j]).abs() > 1e-9));
        let parts = if shared { Vec::new() } else { straight.parts(head, middle) };
        for (part, (start, length)) in parts.iter().enumerate() {
            let count = (length / if moving { LONGEST_MOVING } else { LONGEST }).ceil().max(1.0) as usize;
            for i in 1..=count {
                let d = start + length * i as f64 / count as f64;
                let cap = if i == count && part + 1 == parts.len() { tail_cap } else { cruise };
                push(
                    &mut nodes,
                    &mut links,
                    on(d, cap),
                    Link { direction: straight.direction, length: length / count as f64, turn: 0.0 },
                );
            }
        }
        if rounding[k + 1].is_none() {
            push(
                &mut nodes,
                &mut links,
                on(straight.length, 0.0),
                Link { direction: straight.direction, length: tail, turn: 0.0 },
            );
        }
    }
    if links.is_empty() {
        return None;
    }
    Some(assemble(&nodes, &links, limits))
}

/// Speeds and durations, and the vector of unknowns.
fn assemble(nodes: &[Node], links: &[Link], limits: &Limits) -> Guess {
    let pieces = links.len();
    let joints = limits.joints.len();
    let layout = Layout { dimensions: 2 + joints, pieces };
    let acceleration = USED * limits.acceleration;
    let mut speed: Vec<f64> = nodes.iter().map(|n| n.cap).collect();
    (speed[0], speed[pieces]) = (0.0, 0.0);
    for i in 1..=pieces {
        speed[i] = speed[i].min((real::powi(speed[i - 1], 2) + 2.0 * acceleration * links[i - 1].length).sqrt());
    }
    for i in (0..pieces).rev() {
        speed[i] = speed[i].min((real::powi(speed[i + 1], 2) + 2.0 * acceleration * links[i].length).sqrt());
    }
    let mut x = vec![0.0; layout.size()];
    let mut arc = 0.0;
    for (k, node) in nodes.iter().enumerate() {
        if k > 0 {
            arc += links[k - 1].direction * links[k - 1].length;
        }
        let direction = links[k.min(pieces - 1)].direction;
        x[layout.state(k, 0, 0)] = node.yaw;
        x[layout.state(k, 1, 0)] = arc;
        x[layout.state(k, 1, 1)] = direction * speed[k];
        for (j, q) in node.joints.iter().enumerate() {
            x[layout.state(k, 2 + j, 0)] = *q;
        }
        x[layout.position(k)..layout.position(k) + 2].copy_from_slice(&node.position);
    }
    for (k, link) in links.iter().enumerate() {
        let cap = speed[k].max(speed[k + 1]).max(USED * limits.speed);
        let mut time =
            if link.length > 0.0 { trapezoid(speed[k], speed[k + 1], cap, link.length, acceleration) } else { 0.0 };
        let rest_to_rest = |change: f64, speed: f64, acceleration: f64| {
            (PEAK_SPEED * change / speed).max((PEAK_ACCELERATION * change / acceleration).sqrt())
        };
        if link.turn > 0.0 {
            let driven = 0.5 * (speed[k] + speed[k + 1]);
            let rate = limits.turn_rate(driven.min(0.7 * limits.speed)).max(1e-3);
            time = time.max(rest_to_rest(link.turn, rate, limits.angular_acceleration) / 1.2);
        }
        for (j, joint) in limits.joints.iter().enumerate() {
            let change = (nodes[k + 1].joints[j] - nodes[k].joints[j]).abs();
            time = time.max(rest_to_rest(change, joint.speed, joint.acceleration));
        }
        x[layout.duration(k)] = real::ln(time.max(0.1));
    }
    let mut fixed = vec![false; layout.size()];
    for node in [0, pieces] {
        for dimension in 0..layout.dimensions {
            for order in 0..ORDERS {
                fixed[layout.state(node, dimension, order)] = true;
            }
        }
        fixed[layout.position(node)] = true;
        fixed[layout.position(node) + 1] = true;
    }
    // The last node has no piece of its own; how far was driven is free.
    fixed[layout.duration(pieces)] = true;
    fixed[layout.state(pieces, 1, 0)] = false;
    Guess { layout, x, directions: links.iter().map(|l| l.direction).collect(), fixed }
}
