//! Whether the robot's own links keep apart, over all instants, by branch and bound over time.
//!
//! As in [`super::clearance`], an interval is looked at from its middle, and a plane that separates two shapes there is a proof for the
//! whole interval if neither can reach it, by the bounds of [`super::motion`]. What no plane settles is halved. The base's own motion
//! carries all links alike, so everything happens in the base frame, and a row in which no joint moves was judged with the one before.

use nalgebra::Vector3;

use super::motion::{Held, Kinematics, Moving, MovingShape};
use super::rollout::Rollout;
use super::{OwnLinks, Refusal, RefusalKind};
use crate::geom::Pose2;
use crate::robot::RobotModel;

/// Apart means farther than this, m: a bound for rounding in the distance itself.
const TOUCHING: f64 = 1e-9;
/// An interval in which no point moves farther than this is not halved, m: what is not proven there is refused.
const RESOLUTION: f64 = 1e-7;
/// Looks at a pair, in all, after which what is not proven is refused: some seconds.
const WORK: u64 = 20_000_000;

/// Proves that no two links touch which move against each other, but for those that the robot ignores. `None`: there are no such links.
pub(super) fn own_links(rollout: &Rollout<'_>, robot: &RobotModel) -> Option<(OwnLinks, Option<Refusal>)> {
    let pairs = robot.self_pairs();
    if pairs.is_empty() {
        return None;
    }
    let mut links: Vec<[&str; 2]> = pairs.iter().map(|pair| pair.map(|s| robot.shapes[s].link.as_str())).collect();
    links.sort_unstable();
    links.dedup();
    let refusal = Check::new(rollout, robot, pairs).run();
    Some((OwnLinks { pairs: links.len(), apart: refusal.is_none() }, refusal))
}

/// Part of a row: its middle and half its length, s.
#[derive(Debug, Clone, Copy)]
struct Interval {
    tau: f64,
    half: f64,
}

/// What a look at an interval has found.
enum Found {
    /// Apart throughout.
    Apart,
    /// They touch at the middle.
    Touch,
    /// Neither; this far apart at the middle, m.
    Open(f64),
}

struct Check<'a> {
    rollout: &'a Rollout<'a>,
    robot: &'a RobotModel,
    kinematics: Kinematics<'a>,
    pairs: Vec<[usize; 2]>,
    /// The plane that last served each pair: its normal, from the first shape to the second.
    hints: Vec<Vector3<f64>>,
    /// What must be between two shapes, m.
    margin: f64,
    work: u64,
    /// Work after which it gives up.
    patience: u64,
    // Scratch.
    joints: Vec<f64>,
    bodies: Vec<Moving>,
}

impl<'a> Check<'a> {
    fn new(rollout: &'a Rollout<'a>, robot: &'a RobotModel, pairs: Vec<[usize; 2]>) -> Self {
        let kinematics = Kinematics::new(robot);
        let mut extreme = vec![0.0f64; robot.joints.len()];
        for row in 0..rollout.rows() {
            for (most, value) in extreme.iter_mut().zip(rollout.joints(row)) {
                *most = most.max(value.abs());
            }
        }
        let margin = TOUCHING + 2.0 * rollout.rounding(kinematics.size(&extreme), 0.0);
        let hints = vec![Vector3::z(); pairs.len()];
        let (joints, bodies) = (Vec::new(), Vec::new());
        Self { rollout, robot, kinematics, pairs, hints, margin, work: 0, patience: WORK, joints, bodies }
    }

    /// Row after row; the first that is not proven ends it.
    fn run(&mut self) -> Option<Refusal> {
        for row in 0..self.rollout.rows() {
            let moves = self.rollout.held(row).rates.iter().any(|rate| *rate != 0.0);
            if !moves && row > 0 {
                continue; // stands as the row before has ended
            }
            let last = row + 1 == self.rollout.rows();
            let half = if moves && !last { 0.5 * self.rollout.step() } else { 0.0 };
            let whole = Interval { tau: half, half };
            let accelerations = self.accelerations(row);
            let shapes = self.shapes(row, whole, &accelerations);
            let mut left = Vec::new();
            for pair in 0..self.pairs.len() {
                match self.look(pair, &shapes, half) {
                    Found::Apart => {}
                    Found::Touch => return Some(self.touch(pair, row, whole.tau)),
                    Found::Open(_) => left.push(pair),
                }
            }
            if !left.is_empty()
                && let Some(refusal) = self.halve(row, whole, &accelerations, left)
            {
                return Some(refusal);
            }
        }
        None
    }

    /// Looks at the halves of an interval in which these pairs are open, and at their halves, earliest first.
    fn halve(&mut self, row: usize, whole: Interval, accelerations: &[f64], left: Vec<usize>) -> Option<Refusal> {
        let halves =
            |at: Interval| [1.0, -1.0].map(|sign| Interval { tau: at.tau + sign * 0.5 * at.half, half: 0.5 * at.half });
        let mut stack: Vec<(Interval, Vec<usize>)> = halves(whole).map(|part| (part, left.clone())).into();
        while let Some((part, pairs)) = stack.pop() {
            let shapes = self.shapes(row, part, accelerations);
            let mut open = Vec::new();
            for pair in pairs {
                match self.look(pair, &shapes, part.half) {
                    Found::Apart => {}
                    Found::Touch => return Some(self.touch(pair, row, part.tau)),
                    Found::Open(distance) => {
                        let still = self.pairs[pair].iter().all(|shape| shapes[*shape].motion(part.half) < RESOLUTION);
                        if still || self.work > self.patience {
                            return Some(self.unproven(pair, row, part.tau, distance));
                        }
                        open.push(pair);
                    }
                }
            }
            if !open.is_empty() {
                stack.extend(halves(part).map(|half| (half, open.clone())));
            }
        }
        None
    }

    /// Tries to prove a pair of shapes, as at the middle of an interval, apart for `half` seconds before and after.
    fn look(&mut self, pair: usize, shapes: &[MovingShape<'_>], half: f64) -> Found {
        self.work += 1;
        let [a, b] = self.pairs[pair].map(|shape| &shapes[shape]);
        let between = b.posed.centre - a.posed.centre;
        let apart = |normal: &Vector3<f64>| normal.dot(&between) - a.reach_towards(b, normal, half) > self.margin;
        let straight = between.norm();
        if straight - a.radius - b.radius - a.motion(half) - b.motion(half) > self.margin || apart(&self.hints[pair]) {
            return Found::Apart;
        }
        let found = a.posed.separation_from(&b.posed);
        let Some(normal) = found.normal.filter(|_| found.upper > TOUCHING) else { return Found::Touch };
        if apart(&normal) {
            self.hints[pair] = normal;
            return Found::Apart;
        }
        Found::Open(found.upper)
    }

    /// Bounds on the accelerations of all shapes' points in the base frame while a row is held.
    fn accelerations(&mut self, row: usize) -> Vec<f64> {
        self.rollout.extreme_joints(row, &mut self.joints);
        let held = within_the_base(self.rollout.held(row));
        let of = |shape| self.kinematics.acceleration(shape, held, &self.joints);
        (0..self.kinematics.shape_count()).map(of).collect()
    }

    /// All shapes in the base frame at the middle of an interval.
    fn shapes(&mut self, row: usize, at: Interval, accelerations: &[f64]) -> Vec<MovingShape<'a>> {
        self.rollout.joints_at(row, at.tau, &mut self.joints);
        self.kinematics.bodies(&self.joints, within_the_base(self.rollout.held(row)), &mut self.bodies);
        let of = |(shape, acceleration): (usize, &f64)| {
            self.kinematics.shape(shape, &self.bodies, Pose2::default(), *acceleration)
        };
        accelerations.iter().enumerate().map(of).collect()
    }

    fn touch(&self, pair: usize, row: usize, tau: f64) -> Refusal {
        let [a, b] = self.links(pair);
        self.refusal(row, tau, |when| format!("`{a}` and `{b}` touch each other {when}"))
    }

    fn unproven(&self, pair: usize, row: usize, tau: f64, distance: f64) -> Refusal {
        let [a, b] = self.links(pair);
        let close = format!("could not be proven apart: within {distance:.1e} m of each other");
        self.refusal(row, tau, |when| format!("`{a}` and `{b}` {close} {when}"))
    }

    fn links(&self, pair: usize) -> [&'a str; 2] {
        self.pairs[pair].map(|shape| self.robot.shapes[shape].link.as_str())
    }

    fn refusal(&self, row: usize, tau: f64, message: impl FnOnce(&str) -> String) -> Refusal {
        let (time, mut values) = (self.rollout.time(row, tau), Vec::new());
        self.rollout.joints_at(row, tau, &mut values);
        let posture = self.robot.joints.iter().zip(&values).map(|(joint, value)| {
            let unit = if joint.prismatic { "m" } else { "rad" };
            format!("`{}` {:.4} {unit}", joint.name, value + 0.0)
        });
        let when = format!("at t = {time:.3} s, with {}", posture.collect::<Vec<_>>().join(", "));
        Refusal { kind: RefusalKind::OwnLinks, message: message(&when), time: Some(time) }
    }
}

/// What a row holds, seen from the base.
fn within_the_base(held: Held<'_>) -> Held<'_> {
    Held { speed: 0.0, turn_rate: 0.0, ..held }
}

#[cfg(test)]
mod tests;
