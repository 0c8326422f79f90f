//! A leg's path in actuator space: wheel travel and joints as functions of one parameter, with three derivatives.

use std::sync::Arc;

use crate::geom::{Pose2, unwrap_near};
use crate::math::real;
use crate::trajectory::plane_curve::{CurveError, Place, PlaneCurve};
use crate::trajectory::{DriveLeg, StillLeg};

use super::steered::Steered;

/// A value and its first three derivatives.
pub type Jet = [f64; 4];

/// A drive counts as straight, and its joints as proportional to arc length, where they are so within this (m, rad).
pub(super) const STRAIGHT: f64 = 1e-10;

/// What a leg does, whenever it does it.
#[derive(Debug, Clone)]
pub enum Course {
    /// Along a curve.
    Curved(Curved),
    /// Every actuator in proportion: a spin, joints alone, or a straight drive.
    Proportional(Proportional),
    /// Heading and arc length, each as a function of the parameter.
    Steered(Steered),
}

/// Driving along a curve.
#[derive(Debug, Clone)]
pub struct Curved {
    /// The curve with its tables.
    pub curve: Arc<PlaneCurve>,
    /// +1 forward, -1 backwards.
    pub direction: f64,
    /// Heading at the start.
    pub yaw_start: f64,
    /// Half the track width, m.
    pub half_track: f64,
}

/// Linear in actuator space; the parameter runs from 0 to 1.
#[derive(Debug, Clone)]
pub struct Proportional {
    /// Where it begins.
    pub pose: Pose2,
    /// Signed distance driven, m.
    pub drive: f64,
    /// Turn, rad. Not together with a drive.
    pub turn: f64,
    /// Joint values at the start.
    pub joints: Vec<f64>,
    /// Their change.
    pub joint_changes: Vec<f64>,
    /// Half the track width, m.
    pub half_track: f64,
}

impl Course {
    /// The course of a drive.
    ///
    /// # Errors
    /// The curve has no heading somewhere, or is not finite.
    pub fn drive(leg: &DriveLeg, track_width: f64) -> Result<Self, CurveError> {
        let curve = PlaneCurve::new(leg.curve.clone())?;
        let direction = if leg.reverse { -1.0 } else { 1.0 };
        let tangent = curve.start_heading() + if leg.reverse { std::f64::consts::PI } else { 0.0 };
        let yaw_start = unwrap_near(tangent, leg.yaw_start);
        let half_track = 0.5 * track_width;
        if is_proportional(&curve) {
            let ([x, y], dimensions) = (curve.point(curve.start()), leg.curve.pieces[0].coefficients.len());
            let joints: Vec<f64> = (2..dimensions).map(|d| curve.jet(d, curve.start())[0]).collect();
            return Ok(Self::Proportional(Proportional {
                pose: Pose2::new(x, y, yaw_start),
                drive: direction * curve.length(),
                turn: 0.0,
                joint_changes: (2..dimensions).map(|d| curve.jet(d, curve.end())[0] - joints[d - 2]).collect(),
                joints,
                half_track,
            }));
        }
        Ok(Self::Curved(Curved { curve: Arc::new(curve), direction, yaw_start, half_track }))
    }

    /// The course of a spin or of joints moving alone.
    pub fn still(leg: &StillLeg, track_width: f64) -> Self {
        Self::Proportional(Proportional {
            pose: leg.pose,
            drive: 0.0,
            turn: leg.yaw_end - leg.pose.yaw,
            joints: leg.joints_from.clone(),
            joint_changes: leg.joints_to.iter().zip(&leg.joints_from).map(|(to, from)| to - from).collect(),
            half_track: 0.5 * track_width,
        })
    }

    /// Wheel travel (left, right) from start to end, m.
    pub fn travel(&self) -> [f64; 2] {
        match self {
            Self::Curved(c) => c.travel(c.curve.length(), c.curve.total_turn()),
            Self::Proportional(p) => p.wheel_changes(),
            Self::Steered(s) => s.travel(s.curve.end()),
        }
    }
}

impl Curved {
    /// Wheel travel (left, right) after an arc length and a turn since the start.
    pub fn travel(&self, arc: f64, turn: f64) -> [f64; 2] {
        [-self.half_track, self.half_track].map(|arm| self.direction * arc + arm * turn)
    }

    /// Pose at a place.
    pub fn pose(&self, place: Place) -> Pose2 {
        let [x, y] = self.curve.point(place);
        Pose2 { x, y, yaw: self.yaw_start + self.curve.turn(place) }
    }

    /// Time derivatives one to three of (left, right, joints…, centre) appended to `out` at a place, for the parameter's own
    /// derivatives `clock` (one to three).
    pub fn rates(&self, place: Place, clock: [f64; 3], out: &mut Vec<[f64; 3]>) {
        let rates = self.curve.rates(place);
        let along = rates.speed.map(|s| self.direction * s);
        for arm in [-self.half_track, self.half_track] {
            out.push(compose([0, 1, 2].map(|k| along[k] + arm * rates.turn[k]), clock));
        }
        for dimension in 2..self.curve.poly().pieces[0].coefficients.len() {
            let [_, d1, d2, d3] = self.curve.jet(dimension, place);
            out.push(compose([d1, d2, d3], clock));
        }
        out.push(compose(along, clock));
    }

    /// Derivatives of the curve's parameter where the *arc length* has these derivatives (one to three).
    pub fn parameter_rates(&self, place: Place, arc: [f64; 3]) -> [f64; 3] {
        let [g, g1, g2] = self.curve.rates(place).speed;
        let first = arc[0] / g;
        let second = (arc[1] - g1 * first * first) / g;
        [first, second, (arc[2] - 3.0 * g1 * first * second - g2 * first * first * first) / g]
    }
}

impl Proportional {
    /// Change of the wheel travel (left, right), m.
    pub fn wheel_changes(&self) -> [f64; 2] {
        [self.drive - self.half_track * self.turn, self.drive + self.half_track * self.turn]
    }

    /// Pose at a share of the way.
    pub fn pose(&self, share: f64) -> Pose2 {
        let (sin, cos) = real::sin_cos(self.pose.yaw);
        let along = self.drive * share;
        Pose2 { x: self.pose.x + along * cos, y: self.pose.y + along * sin, yaw: self.pose.yaw + self.turn * share }
    }
}

/// Derivatives of q(u(t)) from those of q(u) and of u(t), orders one to three each.
pub fn compose(q: [f64; 3], u: [f64; 3]) -> [f64; 3] {
    [q[0] * u[0], q[1] * u[0] * u[0] + q[0] * u[1], q[2] * u[0] * u[0] * u[0] + 3.0 * q[1] * u[0] * u[1] + q[0] * u[2]]
}

fn is_proportional(curve: &PlaneCurve) -> bool {
    let (start, end) = (curve.start(), curve.end());
    let dimensions = curve.poly().pieces[0].coefficients.len();
    let value = |d: usize, place: Place| curve.jet(d, place)[0];
    // A piece of degree seven that is so in nine places is so everywhere.
    curve.poly().pieces.iter().enumerate().all(|(piece, p)| {
        (0..=8).map(|part| Place { piece, u: p.duration * f64::from(part) / 8.0 }).all(|place| {
            let share = curve.arc(place) / curve.length();
            (0..dimensions).all(|d| {
                let expected = value(d, start) + share * (value(d, end) - value(d, start));
                (value(d, place) - expected).abs() <= STRAIGHT
            })
        })
    })
}
