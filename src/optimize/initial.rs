//! The first guess of a driven leg: waypoints along the search's polyline, durations from a trapezoid of speed.

use super::options::OptimizeOptions;
use super::penalty::Limits;
use super::sections::{CORNER_SHARE, DriveSection};
use super::{minco::ORDERS, time_map};
use crate::math::real;
use crate::search::SearchPath;

/// Bends smaller than this are straight, rad.
const STRAIGHT: f64 = 0.08;
/// Bends larger than this get a waypoint in their middle, rad.
const SHARP: f64 = 0.6;
/// Share of the limits that the first guess uses; the rest is for the curve to round its corners.
const USED: f64 = 0.7;
/// A joint jump while standing is spread over this on either side, m.
const JOINT_SPREAD: f64 = 0.2;
/// Arcs shorter than this get no waypoint of their own, m.
const SHORTEST_ARC: f64 = 0.06;
/// A piece moves no joint further than this share of the way it can go in a second.
const JOINT_STEP: f64 = 0.8;

/// Where a leg's optimisation begins.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Guess {
    /// Start state, `[order * m + dimension]`.
    pub start: Vec<f64>,
    /// End state.
    pub end: Vec<f64>,
    /// Pieces.
    pub pieces: usize,
    /// Waypoints, then virtual times.
    pub variables: Vec<f64>,
    /// Arc length on the section's polyline where each piece begins, and the end's, m.
    pub breaks: Vec<f64>,
}

/// The polyline of a section, by arc length.
struct Line<'a> {
    path: &'a SearchPath,
    section: &'a DriveSection,
    /// Arc length at each state of the section.
    arc: Vec<f64>,
    /// Whether joints jump somewhere while the base stands.
    jumps: bool,
}

impl Line<'_> {
    fn length(&self) -> f64 {
        self.arc.last().copied().unwrap_or(0.0)
    }

    /// The state before the place at arc length `s`, and the share of the one after.
    fn locate(&self, s: f64) -> (usize, f64) {
        let last = self.arc.len() - 1;
        let upper = self.arc.partition_point(|a| *a <= s).clamp(1, last);
        let (from, to) = (self.arc[upper - 1], self.arc[upper]);
        let share = if to > from { ((s - from) / (to - from)).clamp(0.0, 1.0) } else { 1.0 };
        (self.section.first + upper - 1, share)
    }

    fn position(&self, s: f64) -> [f64; 2] {
        let (i, f) = self.locate(s);
        let (a, b) = (self.path.states[i].pose, self.path.states[i + 1].pose);
        [a.x + f * (b.x - a.x), a.y + f * (b.y - a.y)]
    }

    /// Where an arc of length `arc` that turns by `angle` ends that begins at the start; or begins that ends at the end.
    fn turned(&self, at_end: bool, arc: f64, angle: f64) -> [f64; 2] {
        let side = if self.section.reverse { -1.0 } else { 1.0 };
        let pose = if at_end {
            self.path.states[self.section.last].pose.after_twist(-side * arc, -angle, 1.0)
        } else {
            self.path.states[self.section.first].pose.after_twist(side * arc, angle, 1.0)
        };
        [pose.x, pose.y]
    }

    fn joint(&self, s: f64, j: usize) -> f64 {
        let value = |s: f64| {
            let (i, f) = self.locate(s.clamp(0.0, self.length()));
            let (a, b) = (self.path.states[i].joints[j], self.path.states[i + 1].joints[j]);
            a + f * (b - a)
        };
        if !self.jumps {
            return value(s);
        }
        (-4..=4).map(|k| value(s + JOINT_SPREAD * k as f64 / 4.0)).sum::<f64>() / 9.0
    }
}

/// A bend: arc length and angle, both ends of the leg included.
struct Bend {
    at: f64,
    angle: f64,
    /// Half the arc that rounds it.
    reach: f64,
}

/// A place where two pieces meet, or an end.
struct Break {
    at: f64,
    position: [f64; 2],
    /// Of the piece that begins here: by how much it turns.
    turn: f64,
}

/// The first guess for a section.
pub(crate) fn guess(path: &SearchPath, section: &DriveSection, limits: &Limits, options: &OptimizeOptions) -> Guess {
    let states = &path.states[section.first..=section.last];
    let mut arc = vec![0.0];
    for w in states.windows(2) {
        arc.push(arc[arc.len() - 1] + w[0].pose.distance(w[1].pose));
    }
    let jumps = arc.windows(2).zip(states.windows(2)).any(|(a, w)| a[1] == a[0] && w[0].joints != w[1].joints);
    let line = Line { path, section, arc, jumps };
    let breaks = breaks(&line, limits, options);
    let pieces = breaks.len() - 1;
    let joints = limits.joints.len();
    let m = 2 + joints;
    let mut variables = Vec::with_capacity((pieces - 1) * m + pieces);
    for node in &breaks[1..pieces] {
        variables.extend(node.position);
        variables.extend((0..joints).map(|j| line.joint(node.at, j)));
    }
    variables.extend(durations(&line, &breaks, limits).into_iter().map(time_map::virtual_time));
    let side = if section.reverse { -1.0 } else { 1.0 };
    let state = |index: usize| {
        let state = &path.states[index];
        let mut z = vec![0.0; ORDERS * m];
        z[0] = state.pose.x;
        z[1] = state.pose.y;
        z[2..m].copy_from_slice(&state.joints);
        // [SCR] section V-C: the least speed along the heading, no higher derivative.
        let (sin, cos) = real::sin_cos(state.pose.yaw);
        z[m] = side * limits.min_speed * cos;
        z[m + 1] = side * limits.min_speed * sin;
        z
    };
    Guess {
        start: state(section.first),
        end: state(section.last),
        pieces,
        variables,
        breaks: breaks.iter().map(|b| b.at).collect(),
    }
}

fn bends(line: &Line<'_>, options: &OptimizeOptions) -> Vec<Bend> {
    let states = &line.path.states[line.section.first..=line.section.last];
    let mut bends: Vec<Bend> = vec![Bend { at: 0.0, angle: 0.0, reach: 0.0 }];
    for (i, w) in states.windows(2).enumerate() {
        let turn = w[1].pose.yaw - w[0].pose.yaw;
        // A straight drive turns nothing; its two headings are equal.
        let at = line.arc[i];
        let last = bends.len() - 1;
        if (bends[last].at - at).abs() < 1e-9 {
            bends[last].angle += turn;
        } else if turn.abs() > STRAIGHT {
            bends.push(Bend { at, angle: turn, reach: 0.0 });
        }
    }
    let length = line.length();
    if bends[bends.len() - 1].at < length - 1e-9 || bends.len() == 1 {
        bends.push(Bend { at: length, angle: 0.0, reach: 0.0 });
    }
    for i in 0..bends.len() {
        if bends[i].angle.abs() <= STRAIGHT {
            continue;
        }
        let before = if i > 0 { bends[i].at - bends[i - 1].at } else { f64::INFINITY };
        let after = if i + 1 < bends.len() { bends[i + 1].at - bends[i].at } else { f64::INFINITY };
        bends[i].reach = options.corner_distance.min(CORNER_SHARE * before.min(after));
    }
    bends
}

/// Length of the arc over which a leg turns out of its start, or into its end: at a tenth of the speed limit, where nearly all
/// of the turn rate is left. Without it a robot that turns slowly would change direction, in the first guess, while all but
/// standing. `None` where it turns quickly: a piece so short would only be stiff.
fn turning_length(angle: f64, reach: f64, limits: &Limits) -> Option<f64> {
    let v = (0.1 * limits.speed).max(limits.min_speed);
    let arc = (v * angle / (USED * limits.turn_rate(v)).max(1e-3)).min(0.75 * reach);
    (arc > SHORTEST_ARC).then_some(arc)
}

fn breaks(line: &Line<'_>, limits: &Limits, options: &OptimizeOptions) -> Vec<Break> {
    let bends = bends(line, options);
    let length = line.length();
    let mut breaks = vec![Break { at: 0.0, position: line.position(0.0), turn: 0.0 }];
    let on_line = |at: f64, turn: f64| Break { at, position: line.position(at), turn };
    for (i, bend) in bends.iter().enumerate() {
        // The straight up to this bend's rounding.
        let from = breaks[breaks.len() - 1].at;
        let to = (bend.at - bend.reach).max(from);
        let (head, tail) = ramps(from, to, length, limits, options);
        if head > from {
            breaks.push(on_line(head, 0.0));
        }
        let n = straight_pieces(line, head, tail, limits, options);
        for k in 1..n {
            breaks.push(on_line(head + (tail - head) * k as f64 / n as f64, 0.0));
        }
        if tail < to {
            breaks.push(on_line(tail, 0.0));
        }
        let angle = bend.angle.abs();
        if bend.reach > 0.0 && i == 0 {
            breaks[0].turn = angle;
            let arc = turning_length(angle, bend.reach, limits);
            breaks.push(match arc {
                Some(arc) => Break { at: arc, position: line.turned(false, arc, bend.angle), turn: 0.0 },
                None => on_line(bend.reach, 0.0),
            });
        } else if bend.reach > 0.0 && i + 1 == bends.len() {
            let arc = turning_length(angle, bend.reach, limits);
            breaks.push(match arc {
                Some(arc) => Break { at: length - arc, position: line.turned(true, arc, bend.angle), turn: angle },
                None => on_line(to, angle),
            });
        } else if bend.reach > 0.0 {
            let (a, b, c) = (line.position(to), line.position(bend.at), line.position(bend.at + bend.reach));
            if angle > SHARP {
                breaks.push(on_line(to, 0.5 * angle));
                let middle = std::array::from_fn(|d| 0.25 * (a[d] + 2.0 * b[d] + c[d]));
                breaks.push(Break { at: bend.at, position: middle, turn: 0.5 * angle });
            } else {
                breaks.push(on_line(to, angle));
            }
            breaks.push(on_line(bend.at + bend.reach, 0.0));
        } else if i > 0 && i + 1 < bends.len() {
            breaks.push(on_line(bend.at, 0.0));
        }
    }
    breaks.push(on_line(length, 0.0));
    // Two breaks on one spot make a piece of no length.
    let mut kept: Vec<Break> = Vec::with_capacity(breaks.len());
    for node in breaks {
        match kept.last_mut() {
            Some(last) if node.at - last.at < 1e-6 => last.turn = last.turn.max(node.turn),
            _ => kept.push(node),
        }
    }
    if kept.len() == 1 {
        kept.push(on_line(length, 0.0));
    }
    kept
}

/// Where the straight from `from` to `to` has left its ramp from rest, and where it comes to the ramp to rest: a piece of its
/// own each, where there is room, so that what speeds up is not the same polynomial as what cruises.
fn ramps(from: f64, to: f64, length: f64, limits: &Limits, options: &OptimizeOptions) -> (f64, f64) {
    let ramp = limits.speed * limits.speed / limits.acceleration;
    let head = if from <= 0.0 { ramp } else { 0.0 };
    let tail = if to >= length { ramp } else { 0.0 };
    if to - from > head + tail + 0.5 * options.piece_length { (from + head, to - tail) } else { (from, to) }
}

/// Number of pieces on a straight: by length, and more where joints move.
fn straight_pieces(line: &Line<'_>, from: f64, to: f64, limits: &Limits, options: &OptimizeOptions) -> usize {
    let by_length = ((to - from) / options.piece_length).ceil();
    let by_joints = (0..limits.joints.len())
        .map(|j| {
            let change: f64 = (0..8)
                .map(|k| {
                    let at = |k: usize| line.joint(from + (to - from) * k as f64 / 8.0, j);
                    (at(k + 1) - at(k)).abs()
                })
                .sum();
            (change / (JOINT_STEP * limits.joints[j].speed)).ceil()
        })
        .fold(0.0, f64::max);
    // No piece shorter than a quarter of a piece's length: short ones are stiff.
    by_length.max(by_joints.min((4.0 * (to - from) / options.piece_length).floor())).max(1.0) as usize
}

fn durations(line: &Line<'_>, breaks: &[Break], limits: &Limits) -> Vec<f64> {
    let pieces = breaks.len() - 1;
    let gap = |i: usize| {
        let (a, b) = (breaks[i].position, breaks[i + 1].position);
        real::hypot(a[0] - b[0], a[1] - b[1]).max(1e-3)
    };
    let cap: Vec<f64> = (0..pieces)
        .map(|i| {
            let bend = breaks[i].turn / gap(i);
            let slope = USED * limits.turn_slope;
            let eq14 = slope * limits.speed / (bend + slope);
            let rims = USED * limits.rim_speed / (1.0 + bend * limits.half_track);
            let turning = if bend > 0.0 { USED * limits.angular_speed / bend } else { f64::INFINITY };
            eq14.min(rims).min(turning).min(0.9 * limits.speed).max(limits.min_speed)
        })
        .collect();
    let acceleration = USED * limits.acceleration;
    let mut speed = vec![limits.min_speed; pieces + 1];
    for i in 1..pieces {
        let reach = (speed[i - 1] * speed[i - 1] + 2.0 * acceleration * gap(i - 1)).sqrt();
        speed[i] = reach.min(cap[i - 1]).min(cap[i]);
    }
    for i in (1..pieces).rev() {
        speed[i] = speed[i].min((speed[i + 1] * speed[i + 1] + 2.0 * acceleration * gap(i)).sqrt());
    }
    (0..pieces)
        .map(|i| {
            let mut time = trapezoid(speed[i], speed[i + 1], cap[i], gap(i), acceleration);
            for j in 0..limits.joints.len() {
                let change = (line.joint(breaks[i + 1].at, j) - line.joint(breaks[i].at, j)).abs();
                time = time.max(change / (0.6 * limits.joints[j].speed));
            }
            time.max(0.05)
        })
        .collect()
}

/// Time over `length` from speed `a` to speed `b`, never above `cap`, at most with `acceleration`.
pub(crate) fn trapezoid(a: f64, b: f64, cap: f64, length: f64, acceleration: f64) -> f64 {
    let peak = (acceleration * length + 0.5 * (a * a + b * b)).sqrt().min(cap.max(a).max(b));
    let ramps = (2.0 * peak * peak - a * a - b * b).max(0.0) / (2.0 * acceleration);
    ((peak - a) + (peak - b)) / acceleration + (length - ramps).max(0.0) / peak
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_trapezoid_covers_its_length() {
        // From rest to rest, 1 m, v 0.5, a 0.5: 1 s up, 1 s down over 0.5 m, the rest in 1 s.
        assert!((trapezoid(0.0, 0.0, 0.5, 1.0, 0.5) - 3.0).abs() < 1e-12);
        // Never reaching the cap: a triangle.
        assert!((trapezoid(0.0, 0.0, 5.0, 1.0, 1.0) - 2.0).abs() < 1e-12);
        assert!((trapezoid(0.5, 0.5, 0.5, 1.0, 0.5) - 2.0).abs() < 1e-12);
    }
}
