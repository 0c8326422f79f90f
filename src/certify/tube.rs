//! The tube: where a robot can be that carries out the commands exactly, but is not the model's robot. Derived in `docs/tolerance.md`.
//!
//! With the wheels' radii r (1 + rho -+ delta/2), the track D / (1 + sigma) and the start turned by psi, the heading is off by
//! `dtheta = psi + ((1 + rho)(1 + sigma) - 1) turned + delta (1 + sigma) driven / D`, exactly: `turned` and `driven` are the model's own
//! change of heading and its signed distance, and nothing else counts. The base is off by a sum of four vectors, one for each of rho,
//! sigma, delta and psi, that are integrals along the model's motion and known in closed form for held twists, and by a remainder of second
//! order, bounded in the same pass. Signs are kept, so that what a spin does wrong its opposite mends.

use nalgebra::Vector2;

use super::distance::Spread;
use super::motion::MovingShape;
use super::rollout::Rollout;
use crate::geom::sinc;
use crate::math::real;
use crate::mission::Tolerance;
use crate::robot::RobotModel;

/// Added to the tube for the rounding of its own integrals, m.
const ROUNDING: f64 = 1e-9;

/// How far the robot can be off, at an instant.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Width {
    /// The base's origin, m.
    pub distance: f64,
    /// The heading, rad.
    pub angle: f64,
}

/// How much nearer to an obstacle each tolerance may bring a robot, to first order, m.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Shares {
    /// Of `wheel_radius`.
    pub wheel_radius: f64,
    /// Of `wheel_difference`.
    pub wheel_difference: f64,
    /// Of `track`.
    pub track: f64,
    /// Of `latency`.
    pub latency: f64,
    /// Of `start_distance`.
    pub start_distance: f64,
    /// Of `start_angle`.
    pub start_angle: f64,
}

impl Shares {
    /// Each with its key in a mission.
    pub fn named(&self) -> [(&'static str, f64); 6] {
        [
            ("wheel_radius", self.wheel_radius),
            ("wheel_difference", self.wheel_difference),
            ("track", self.track),
            ("latency_s", self.latency),
            ("start_m", self.start_distance),
            ("start_rad", self.start_angle),
        ]
    }

    /// The greatest, with its key.
    pub fn most(&self) -> (&'static str, f64) {
        let named = self.named();
        named.into_iter().fold(named[0], |most, next| if next.1 > most.1 { next } else { most })
    }
}

/// The largest magnitudes of the deviations: rho, sigma, delta, psi.
pub(super) type Box4 = [f64; 4];

/// The tube around a replay.
#[derive(Debug)]
pub(super) struct Tube<'a> {
    rollout: &'a Rollout<'a>,
    tolerance: Tolerance,
    track: f64,
    deviations: Box4,
    /// When each row begins.
    nodes: Vec<Node>,
    /// Row after row, of each joint: the fastest that it moves within the latency of that row, per second.
    rates: Vec<f64>,
    /// Of each shape and joint: how far a point moves per rad (or m).
    levers: Vec<Vec<f64>>,
}

/// The motion so far, and what it makes of deviations.
#[derive(Debug, Clone, Copy)]
struct Node {
    /// Change of heading since the start, rad.
    turned: f64,
    /// Signed distance since the start, m.
    driven: f64,
    /// The base's displacement since the start, m.
    moved: Vector2<f64>,
    /// Integral of v n turned dt, m: n is the unit vector to the left.
    swung: Vector2<f64>,
    /// Integral of v n driven dt, m^2.
    bent: Vector2<f64>,
    /// What the first order leaves out, m.
    rest: f64,
}

/// Deviations of the position per deviation: along rho, sigma, delta, psi.
pub(super) type Drift = [Vector2<f64>; 4];

fn unit(yaw: f64) -> Vector2<f64> {
    Vector2::new(real::cos(yaw), real::sin(yaw))
}

/// A quarter turn to the left.
fn left(v: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-v.y, v.x)
}

/// `(cos x - sin(x)/x) / x`.
fn lag(x: f64) -> f64 {
    if x.abs() < 1e-2 {
        let x2 = x * x;
        -x / 3.0 * (1.0 - x2 / 10.0 * (1.0 - x2 / 28.0))
    } else {
        (real::cos(x) - real::sin(x) / x) / x
    }
}

impl<'a> Tube<'a> {
    /// Around a replay of a robot's.
    pub(super) fn new(rollout: &'a Rollout<'a>, robot: &RobotModel, tolerance: Tolerance) -> Self {
        let narrow = 1.0 / (1.0 - tolerance.track) - 1.0;
        let deviations = [tolerance.wheel_radius, narrow, tolerance.wheel_difference, tolerance.start_angle];
        let zero = Vector2::zeros();
        let start = Node { turned: 0.0, driven: 0.0, moved: zero, swung: zero, bent: zero, rest: ROUNDING };
        let mut tube = Self {
            rollout,
            tolerance,
            track: robot.track_width,
            deviations,
            nodes: vec![start],
            rates: Vec::new(),
            levers: Vec::new(),
        };
        for row in 0..rollout.rows() - 1 {
            tube.nodes.push(tube.node(row, rollout.step()));
        }
        if tolerance.latency > 0.0 && !robot.joints.is_empty() {
            tube.rates = tube.rates_within(tolerance.latency, robot.joints.len());
            tube.levers = (0..robot.shapes.len()).map(|shape| robot.reach(shape).joints).collect();
        }
        tube
    }

    /// Of each row and joint the greatest magnitude of its rate from `latency` before the row begins to as much after it ends.
    fn rates_within(&self, latency: f64, joints: usize) -> Vec<f64> {
        let (rows, near) = (self.rollout.rows(), (latency / self.rollout.step() + 1e-9).ceil() as usize);
        let mut out = Vec::with_capacity(rows * joints);
        for row in 0..rows {
            let window = row.saturating_sub(near)..(row + near + 1).min(rows);
            for joint in 0..joints {
                out.push(window.clone().map(|k| self.rollout.held(k).rates[joint].abs()).fold(0.0, f64::max));
            }
        }
        out
    }

    /// The greatest deviation of the heading, and the greatest part of it that is not linear in the deviations, rad.
    fn heading(&self, node: &Node) -> (f64, f64) {
        let [rho, sigma, delta, psi] = self.deviations;
        let (turned, driven) = (node.turned.abs(), node.driven.abs() / self.track);
        let scale = rho + sigma + rho * sigma;
        let most = psi + scale * turned + delta * (1.0 + sigma) * driven;
        (most, rho * sigma * turned + delta * sigma * driven)
    }

    /// How fast the first order fails, m/s, where the motion is `node` and the row holds (speed, turn rate).
    fn failing(&self, node: &Node, (speed, turn_rate): (f64, f64)) -> f64 {
        let [rho, _, delta, _] = self.deviations;
        let (most, bilinear) = self.heading(node);
        let off = rho * speed.abs() + delta * self.track * turn_rate.abs() / 4.0;
        off * most + speed.abs() * (0.5 * most * most + bilinear)
    }

    /// The motion up to `tau` seconds into a row: the row's part of each integral in closed form.
    fn node(&self, row: usize, tau: f64) -> Node {
        let from = self.nodes[row];
        let held = self.rollout.held(row);
        let (speed, turn_rate) = (held.speed, held.turn_rate);
        let (half, arc) = (0.5 * turn_rate * tau, speed * tau);
        let forward = unit(self.rollout.pose(row, 0.0).yaw + half);
        let side = left(forward);
        let moved = from.moved + forward * (arc * sinc(half));
        let (turned, driven) = (from.turned + turn_rate * tau, from.driven + arc);
        // The integral of the displacement since the row began, per unit of v tau: half of the arc, seen from its middle.
        let own = (side * lag(half) + forward * sinc(half)) * (0.5 * arc * tau);
        // By parts: the integral of a d(left moved) is [a left moved] less that of (left moved) da.
        let parts =
            |from_a: f64, a: f64, rate: f64| left(moved * a - from.moved * from_a - (from.moved * tau + own) * rate);
        let mut node = Node {
            turned,
            driven,
            moved,
            swung: from.swung + parts(from.turned, turned, turn_rate),
            bent: from.bent + parts(from.driven, driven, speed),
            rest: 0.0,
        };
        // Convex in time while a row is held, so the trapezoid is not less than the integral.
        let failing = [&from, &node].map(|node| self.failing(node, (speed, turn_rate)));
        node.rest = from.rest + 0.5 * tau * (failing[0] + failing[1]);
        node
    }

    /// Of the base's origin, per deviation.
    fn drift(&self, node: &Node) -> Drift {
        let yaw = self.rollout.pose(0, 0.0).yaw;
        let tilted = (left(unit(yaw)) - left(unit(yaw + node.turned))) * (0.25 * self.track);
        [node.moved + node.swung, node.swung, tilted + node.bent / self.track, left(node.moved)]
    }

    /// How the heading turns, per deviation.
    fn turning(&self, node: &Node) -> Box4 {
        [node.turned, node.turned, node.driven / self.track, 1.0]
    }

    /// How far the base can be off `tau` seconds into a row.
    pub(super) fn width(&self, row: usize, tau: f64) -> Width {
        let node = self.node(row, tau);
        let drift = self.drift(&node);
        let scaled: Drift = std::array::from_fn(|i| drift[i] * self.deviations[i]);
        Width { distance: farthest(&scaled) + node.rest + self.tolerance.start_distance, angle: self.heading(&node).0 }
    }

    /// What the deviations do when a row begins, at their largest: to the base's origin and to the heading.
    pub(super) fn parts(&self, row: usize) -> (Drift, Box4) {
        let node = &self.nodes[row];
        let (drift, turning) = (self.drift(node), self.turning(node));
        (
            std::array::from_fn(|i| drift[i] * self.deviations[i]),
            std::array::from_fn(|i| turning[i] * self.deviations[i]),
        )
    }

    /// How far the base can be off in any direction beside, m.
    pub(super) fn anywhere(&self, row: usize) -> f64 {
        self.tolerance.start_distance + self.nodes[row].rest
    }

    /// How far joints that are late, or early, move any point of the robot while a row is held, m.
    pub(super) fn late(&self, row: usize) -> f64 {
        (0..self.levers.len()).map(|shape| self.lateness(row, shape)).fold(0.0, f64::max)
    }

    /// How much farther each tolerance alone lets a point at `place` of a shape be along `toward`, `tau` seconds into a row: a direction in the
    /// plane, unit length or less.
    pub(super) fn shares(
        &self,
        (row, tau): (usize, f64),
        shape: usize,
        place: Vector2<f64>,
        toward: Vector2<f64>,
    ) -> Shares {
        let node = self.node(row, tau);
        let pose = self.rollout.pose(row, tau);
        let arm = left(place - Vector2::new(pose.x, pose.y));
        let (drift, turning) = (self.drift(&node), self.turning(&node));
        let of = |i: usize| self.deviations[i] * (drift[i] + arm * turning[i]).dot(&toward).abs();
        Shares {
            wheel_radius: of(0),
            track: of(1),
            wheel_difference: of(2),
            start_angle: of(3),
            latency: self.lateness(row, shape),
            start_distance: self.tolerance.start_distance * toward.norm(),
        }
    }

    /// How far joints that are late (or early, where the wheels are late) by the latency move a shape's points, m.
    fn lateness(&self, row: usize, shape: usize) -> f64 {
        let Some(levers) = self.levers.get(shape) else { return 0.0 };
        let rates = &self.rates[row * levers.len()..(row + 1) * levers.len()];
        self.tolerance.latency * levers.iter().zip(rates).map(|(lever, rate)| lever * rate).sum::<f64>()
    }

    /// Loosens a shape as it is `tau` seconds into a row: where its points can be then, and how much farther up to `half` seconds before
    /// and after.
    pub(super) fn loosen(&self, shape: usize, moving: &mut MovingShape<'_>, (row, tau): (usize, f64), half: f64) {
        let node = self.node(row, tau);
        let pose = self.rollout.pose(row, tau);
        let held = self.rollout.held(row);
        let [rho, sigma, delta, _] = self.deviations;
        let offset = moving.posed.centre.xy() - Vector2::new(pose.x, pose.y);
        let arm = left(offset);
        let (drift, turning) = (self.drift(&node), self.turning(&node));
        let along = std::array::from_fn(|i| (drift[i] + arm * turning[i]) * self.deviations[i]);

        // The greatest of everything while the row is held.
        let ends = [&self.nodes[row], self.nodes.get(row + 1).unwrap_or(&node), &node];
        let most =
            ends.map(|node| self.heading(node)).into_iter().fold((0.0f64, 0.0f64), |m, h| (m.0.max(h.0), m.1.max(h.1)));
        let failing = ends.map(|node| self.failing(node, (held.speed, held.turn_rate))).into_iter().fold(0.0, f64::max);
        let (speed, turn_rate) = (held.speed.abs(), held.turn_rate.abs());
        let [centre_speed, own_speed] = moving.fastest(half);
        let radius = moving.radius;
        let lever = offset.norm() + half * (centre_speed + speed);
        let (turn, bilinear) = most;
        let disc = self.tolerance.start_distance + node.rest + (0.5 * turn * turn + bilinear) * (lever + radius);
        let turn_growth = (rho + sigma + rho * sigma) * turn_rate + delta * (1.0 + sigma) * speed / self.track;
        let drift_growth = rho * (speed + turn_rate * lever)
            + sigma * turn_rate * lever
            + delta * (0.25 * self.track * turn_rate + speed * lever / self.track);
        let growth = drift_growth + turn * (centre_speed + own_speed) + turn_growth * radius + failing;
        let spread = Spread { along, turn: self.heading(&node).0, disc, ball: self.lateness(row, shape) };
        moving.loosen(spread, growth);
    }
}

/// The longest sum of the vectors, each with either sign.
fn farthest(along: &Drift) -> f64 {
    let sum = |signs: usize| {
        let signed = along[1..].iter().enumerate().map(|(i, v)| if signs >> i & 1 == 1 { *v } else { -v });
        (along[0] + signed.sum::<Vector2<f64>>()).norm()
    };
    (0..8).map(sum).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_farthest_sum_is_that_of_the_best_of_all_signs() {
        let drifts = [[3.0, 1.0], [-2.0, 0.5], [0.1, 0.7], [-0.3, 1.9]].map(Vector2::from);
        for turn in 0..24 {
            let mut along = drifts;
            // Each vector turned by another angle, so that every choice of signs is the best one somewhere.
            along
                .iter_mut()
                .enumerate()
                .for_each(|(i, v)| *v = nalgebra::Rotation2::new(f64::from(turn) * (i as f64 + 0.3)) * *v);
            let choices = (0..16).map(|bits| {
                let signed = along.iter().enumerate().map(|(i, v)| if bits & (1 << i) == 0 { *v } else { -v });
                signed.sum::<Vector2<f64>>().norm()
            });
            let best = choices.fold(0.0, f64::max);
            assert!((farthest(&along) - best).abs() < 1e-12, "{turn}");
        }
    }

    #[test]
    fn the_lag_of_an_arc_is_its_integral_near_zero_too() {
        for x in [1e-4, 3e-3, 0.009, 0.0099, 0.0101, 0.3, 1.0, 3.0, 7.5] {
            // (cos x - sin(x)/x) / x = -integral of s sin(s x) over s from 0 to 1, here by Simpson's rule.
            let steps = 20_000;
            let weighed = (0..=steps).map(|k| {
                let s = f64::from(k) / f64::from(steps);
                let weight = if k == 0 || k == steps { 1.0 } else { 2.0 + 2.0 * f64::from(k % 2) };
                weight * s * real::sin(s * x)
            });
            let integral = -weighed.sum::<f64>() / (3.0 * f64::from(steps));
            // The closed form loses digits where it is a difference of nearly equal numbers.
            let rounding = if x < 1e-2 { 1e-13 * x } else { 1e-13 };
            assert!((lag(x) - integral).abs() < rounding, "{x}: {} {integral}", lag(x));
            assert_eq!(lag(-x), -lag(x));
        }
    }
}
