//! How long and how smooth a motion is: the figures of the papers' tables.
//!
//! Every mean is a time average over the whole motion, standing included. A step in acceleration (trapezoids of speed,
//! held commands) has an impulse of jerk, which counts by its size: the integral of |jerk| is the total variation of
//! acceleration. Jerk of several joints is the Euclidean norm over them (rad/s^3; prismatic joints in m/s^3).

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::command::CommandTable;
use crate::math::poly::Piece;
use crate::math::real;
use crate::robot::RobotModel;
use crate::search::{SearchMove, SearchPath, SearchState};
use crate::trajectory::{Leg, StillLeg, Trajectory};

/// Length, duration and smoothness of a motion.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
pub struct Metrics {
    /// Distance driven, m.
    pub length_m: f64,
    /// Duration, s.
    pub time_s: f64,
    /// Mean jerk of the base, m/s^3.
    pub mean_jerk_mps3: f64,
    /// Mean magnitude of the acceleration along the path, m/s^2.
    pub mean_acceleration_mps2: f64,
    /// Mean magnitude of the heading's acceleration, rad/s^2.
    pub mean_angular_acceleration_rads2: f64,
    /// Mean jerk of the joints, rad/s^3; 0 without joints.
    pub mean_joint_jerk_rads3: f64,
}

/// Time integrals of the magnitudes; divided by the duration at the end.
#[derive(Default)]
struct Integrals {
    length: f64,
    time: f64,
    jerk: f64,
    acceleration: f64,
    angular_acceleration: f64,
    joint_jerk: f64,
}

impl Integrals {
    fn metrics(&self) -> Metrics {
        let mean = |integral: f64| if self.time > 0.0 { integral / self.time } else { 0.0 };
        Metrics {
            length_m: self.length,
            time_s: self.time,
            mean_jerk_mps3: mean(self.jerk),
            mean_acceleration_mps2: mean(self.acceleration),
            mean_angular_acceleration_rads2: mean(self.angular_acceleration),
            mean_joint_jerk_rads3: mean(self.joint_jerk),
        }
    }
}

// ---- the optimiser's own timing

/// Nodes and weights of Gauss-Legendre quadrature with three points on [0, 1]: exact to degree 5.
const GAUSS: [(f64, f64); 3] =
    [(0.112_701_665_379_258_3, 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// Cells of a piece. The magnitudes have kinks where their argument changes sign; 64 cells keep their error below 1e-3.
const CELLS: usize = 64;

/// Below this speed (m/s) curvature is rounding noise; the sample counts by its limit, zero.
const STANDING: f64 = 1e-9;

/// Metrics of a trajectory in its own timing: the parameter of its curves must be seconds, so not for given paths.
/// Derivatives are the polynomials' own. The base jerk is the norm of sigma's third derivative, the angular acceleration
/// \[SCR\] Eq. 3d (corrected). A [`StillLeg`] has no timing: it contributes a trapezoid of speed within the robot's limits.
pub fn of_trajectory(trajectory: &Trajectory, robot: &RobotModel) -> Metrics {
    let mut sum = Integrals::default();
    for leg in &trajectory.legs {
        match leg {
            Leg::Drive(drive) => over_pieces(&mut sum, &drive.curve.pieces, add_instant),
            Leg::Still(still) => add_still(&mut sum, still, robot),
            Leg::Steer(steer) => over_pieces(&mut sum, &steer.curve.pieces, add_steered_instant),
        }
    }
    sum.metrics()
}

/// Integrates over pieces: `add` adds an instant of one, at its parameter, with a weight.
fn over_pieces(sum: &mut Integrals, pieces: &[Piece], add: fn(&mut Integrals, &Piece, f64, f64)) {
    for piece in pieces {
        let cell = piece.duration / CELLS as f64;
        sum.time += piece.duration;
        for i in 0..CELLS {
            for (node, weight) in GAUSS {
                add(sum, piece, (i as f64 + node) * cell, weight * cell);
            }
        }
    }
}

fn add_instant(sum: &mut Integrals, piece: &Piece, u: f64, weight: f64) {
    let of = |order| [piece.derivative(0, order, u), piece.derivative(1, order, u)];
    let (d1, d2, d3) = (of(1), of(2), of(3));
    let dot = |a: [f64; 2], b: [f64; 2]| a[0] * b[0] + a[1] * b[1];
    // a^T B b with B = [[0, -1], [1, 0]], as [SCR] writes its cross products.
    let cross = |a: [f64; 2], b: [f64; 2]| a[1] * b[0] - a[0] * b[1];
    let speed2 = dot(d1, d1);
    let speed = speed2.sqrt();
    sum.length += weight * speed;
    sum.jerk += weight * dot(d3, d3).sqrt();
    if speed > STANDING {
        sum.acceleration += weight * (dot(d1, d2) / speed).abs();
        let angular = cross(d3, d1) / speed2 - 2.0 * cross(d2, d1) * dot(d2, d1) / (speed2 * speed2);
        sum.angular_acceleration += weight * angular.abs();
    }
    let joints = 2..piece.coefficients.len();
    sum.joint_jerk += weight * norm(joints.map(|d| piece.derivative(d, 3, u)));
}

/// An instant of a leg of heading and arc length: nothing is divided by the speed.
fn add_steered_instant(sum: &mut Integrals, piece: &Piece, u: f64, weight: f64) {
    let [turn, turn_rise] = [1, 2].map(|order| piece.derivative(0, order, u));
    let [speed, rise, jerk] = [1, 2, 3].map(|order| piece.derivative(1, order, u));
    sum.length += weight * speed.abs();
    // The third derivative of the position, along the heading and across it.
    sum.jerk += weight * real::hypot(jerk - speed * turn * turn, 2.0 * rise * turn + speed * turn_rise);
    sum.acceleration += weight * rise.abs();
    sum.angular_acceleration += weight * turn_rise.abs();
    sum.joint_jerk += weight * norm((2..piece.coefficients.len()).map(|d| piece.derivative(d, 3, u)));
}

fn norm(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|v| v * v).sum::<f64>().sqrt()
}

fn add_still(sum: &mut Integrals, still: &StillLeg, robot: &RobotModel) {
    let turn = still.yaw_end - still.pose.yaw;
    let moved: Vec<f64> = still.joints_to.iter().zip(&still.joints_from).map(|(to, from)| to - from).collect();
    let law = Trapezoid::along(&slopes(0.0, turn, &moved, robot));
    sum.time += law.time();
    // Everything moves in proportion: |alpha| = |turn| * |acceleration of the law|, over two ramps of one height each.
    sum.angular_acceleration += 2.0 * turn.abs() * law.peak_speed();
    sum.joint_jerk += norm(moved.into_iter()) * law.acceleration_variation();
}

// ---- trapezoids of speed

/// Rest to rest over a path parameter of length `span`, with speed and acceleration of the parameter bounded.
#[derive(Debug, Clone, Copy)]
struct Trapezoid {
    span: f64,
    speed: f64,
    acceleration: f64,
}

/// What one unit of a parameter asks of one actuator: (amount moved, speed limit, acceleration limit).
type Slope = (f64, f64, f64);

/// Amounts that base and joints move, with their limits.
fn slopes(travel: f64, turn: f64, joints: &[f64], robot: &RobotModel) -> Vec<Slope> {
    let base = &robot.base;
    let mut all = vec![(travel, base.speed, base.acceleration), (turn, base.angular_speed, base.angular_acceleration)];
    for (moved, joint) in joints.iter().zip(&robot.joints) {
        let [speed, acceleration, _] = joint.limits.planning();
        all.push((*moved, speed, acceleration));
    }
    all.retain(|(moved, ..)| *moved != 0.0);
    all
}

impl Trapezoid {
    /// The parameter runs from 0 to 1 while the actuators move by their amounts, in proportion.
    fn along(slopes: &[Slope]) -> Self {
        let least = |of: fn(&Slope) -> f64| slopes.iter().map(of).fold(f64::INFINITY, f64::min);
        Self {
            span: if slopes.is_empty() { 0.0 } else { 1.0 },
            speed: least(|(moved, speed, _)| speed / moved.abs()),
            acceleration: least(|(moved, _, acceleration)| acceleration / moved.abs()),
        }
    }

    fn peak_speed(&self) -> f64 {
        if self.span > 0.0 { self.speed.min((self.acceleration * self.span).sqrt()) } else { 0.0 }
    }

    fn ramp(&self) -> f64 {
        if self.span > 0.0 { self.peak_speed() / self.acceleration } else { 0.0 }
    }

    fn time(&self) -> f64 {
        if self.span > 0.0 { self.span / self.peak_speed() + self.ramp() } else { 0.0 }
    }

    /// Total variation of the acceleration: up, down, down, up (at a peak without a plateau the middle two join).
    fn acceleration_variation(&self) -> f64 {
        if self.span > 0.0 { 4.0 * self.acceleration } else { 0.0 }
    }

    /// The parameter at a time, clamped to the ends.
    fn at(&self, t: f64) -> f64 {
        let (time, ramp, peak) = (self.time(), self.ramp(), self.peak_speed());
        if t <= 0.0 || self.span == 0.0 {
            0.0
        } else if t >= time {
            self.span
        } else if t < ramp {
            0.5 * self.acceleration * t * t
        } else if t <= time - ramp {
            peak * (t - 0.5 * ramp)
        } else {
            self.span - 0.5 * self.acceleration * (time - t) * (time - t)
        }
    }
}

// ---- sampled motions

/// Time integral of |d^n x / dt^n| (norm over columns) for `n = order >= 1`, from rates held for `step` seconds each: sums
/// of differences of order n - 1, with rest before the first and after the last rate.
fn variation(rates: &[Vec<f64>], order: usize, step: f64) -> f64 {
    let width = rates.first().map_or(0, Vec::len);
    let mut rows = rates.to_vec();
    for _ in 1..order {
        let rest = vec![0.0; width];
        let before = std::iter::once(&rest).chain(&rows);
        let after = rows.iter().chain(std::iter::once(&rest));
        rows = before.zip(after).map(|(a, b)| a.iter().zip(b).map(|(a, b)| (b - a) / step).collect()).collect();
    }
    rows.iter().map(|row| step * norm(row.iter().copied())).sum()
}

/// Metrics of held speeds: `v` (m/s), `omega` (rad/s) and joint speeds, one entry a step of `step` seconds.
fn of_held(v: Vec<f64>, omega: Vec<f64>, joints: &[Vec<f64>], step: f64, time: f64) -> Metrics {
    let column = |values: Vec<f64>| values.into_iter().map(|x| vec![x]).collect::<Vec<_>>();
    let (v, omega) = (column(v), column(omega));
    Integrals {
        length: variation(&v, 1, step),
        time,
        jerk: variation(&v, 3, step),
        acceleration: variation(&v, 2, step),
        angular_acceleration: variation(&omega, 2, step),
        joint_jerk: variation(joints, 3, step),
    }
    .metrics()
}

/// Metrics of commands as they are held: length as replayed; acceleration, angular acceleration and jerk from differences
/// of the held speed, turn rate and joint speeds over the sampling time, at rest before and after. The base's jerk is that
/// along the path.
pub fn of_commands(table: &CommandTable) -> Metrics {
    let (v, omega) = (0..table.rows.len()).map(|k| table.twist(k)).unzip();
    let joints: Vec<Vec<f64>> = table.rows.iter().map(|row| row.joint_velocities.clone()).collect();
    of_held(v, omega, &joints, table.sampling_time, table.duration())
}

/// Step of the differences in [`of_search`], s.
const SEARCH_STEP: f64 = 0.05;

/// A run of moves of one kind, driven from rest to rest.
struct Run<'a> {
    states: &'a [SearchState],
    /// Parameter at each state. One unit is what the slowest actuator does in 1 s at its speed limit.
    knots: Vec<f64>,
    /// Signed distance driven up to each state, from the path's start, m.
    travel: Vec<f64>,
    law: Trapezoid,
}

/// Metrics of the search's lattice path: each run of moves of one kind (forward, reverse, turning one way) driven from rest
/// to rest with a trapezoid of speed within the speed and acceleration limits of base and joints, derivatives by
/// differences over 0.05 s.
pub fn of_search(path: &SearchPath, robot: &RobotModel) -> Metrics {
    let runs = runs(path, robot);
    let time: f64 = runs.iter().map(|r| r.law.time()).sum();
    let (mut samples, mut run, mut began) = (Vec::new(), 0, 0.0);
    for k in 0..=(time / SEARCH_STEP).ceil() as usize {
        let t = k as f64 * SEARCH_STEP;
        while run + 1 < runs.len() && t >= began + runs[run].law.time() {
            began += runs[run].law.time();
            run += 1;
        }
        let Some(current) = runs.get(run) else { break };
        samples.push(current.sample(t - began));
    }
    let rate = |at: fn(&Sample) -> f64| {
        samples.windows(2).map(|w| (at(&w[1]) - at(&w[0])) / SEARCH_STEP).collect::<Vec<f64>>()
    };
    let joint = |w: &[Sample]| -> Vec<f64> {
        w[1].joints.iter().zip(&w[0].joints).map(|(b, a)| (b - a) / SEARCH_STEP).collect()
    };
    let joints: Vec<_> = samples.windows(2).map(joint).collect();
    let metrics = of_held(rate(|s| s.travel), rate(|s| s.yaw), &joints, SEARCH_STEP, time);
    Metrics { length_m: path.length(), ..metrics }
}

struct Sample {
    travel: f64,
    yaw: f64,
    joints: Vec<f64>,
}

fn runs<'a>(path: &'a SearchPath, robot: &RobotModel) -> Vec<Run<'a>> {
    let turn_sign = |i: usize| {
        let turn = path.states[i + 1].pose.yaw - path.states[i].pose.yaw;
        if turn == 0.0 { 0.0 } else { turn.signum() }
    };
    let same = |i: usize, j: usize| {
        path.moves[i] == path.moves[j] && (path.moves[i] != SearchMove::Still || turn_sign(i) == turn_sign(j))
    };
    let moves = path.moves.len().min(path.states.len().saturating_sub(1));
    let (mut all, mut first, mut travelled) = (Vec::new(), 0, 0.0);
    for i in 0..moves {
        if i + 1 == moves || !same(i, i + 1) {
            let run = Run::new(&path.states[first..=i + 1], path.moves[i], travelled, robot);
            travelled = run.travel[run.travel.len() - 1];
            all.push(run);
            first = i + 1;
        }
    }
    all
}

impl<'a> Run<'a> {
    fn new(states: &'a [SearchState], kind: SearchMove, travelled: f64, robot: &RobotModel) -> Self {
        let sign = if kind == SearchMove::Reverse { -1.0 } else { 1.0 };
        let (mut knots, mut travel, mut acceleration) = (vec![0.0], vec![travelled], f64::INFINITY);
        for pair in states.windows(2) {
            let joints: Vec<f64> = pair[1].joints.iter().zip(&pair[0].joints).map(|(b, a)| b - a).collect();
            let driven = pair[0].pose.distance(pair[1].pose);
            let slopes = slopes(driven, pair[1].pose.yaw - pair[0].pose.yaw, &joints, robot);
            let cost = slopes.iter().map(|(moved, speed, _)| moved.abs() / speed).fold(0.0, f64::max);
            for (moved, _, limit) in slopes {
                acceleration = acceleration.min(limit * cost / moved.abs());
            }
            knots.push(knots[knots.len() - 1] + cost);
            travel.push(travel[travel.len() - 1] + sign * driven);
        }
        let span = knots[knots.len() - 1];
        Self { states, knots, travel, law: Trapezoid { span, speed: 1.0, acceleration } }
    }

    fn sample(&self, t: f64) -> Sample {
        let at = self.law.at(t);
        let i = self.knots.partition_point(|k| *k <= at).clamp(1, self.knots.len() - 1) - 1;
        let width = self.knots[i + 1] - self.knots[i];
        let share = if width > 0.0 { (at - self.knots[i]) / width } else { 1.0 };
        let (from, to) = (&self.states[i], &self.states[i + 1]);
        let mix = |a: f64, b: f64| a + share * (b - a);
        Sample {
            travel: mix(self.travel[i], self.travel[i + 1]),
            yaw: mix(from.pose.yaw, to.pose.yaw),
            joints: from.joints.iter().zip(&to.joints).map(|(a, b)| mix(*a, *b)).collect(),
        }
    }
}

#[cfg(test)]
mod tests;
