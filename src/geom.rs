//! Poses and boxes in SI units. Transforms read so that neighbours cancel: `map_from_base * base_from_link`.

use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3};

/// A pose of the base frame on the floor: metres and radians, map frame. `yaw` is not wrapped; it may run past pi.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Pose2 {
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
    /// Radians, counter-clockwise from the map's x axis.
    pub yaw: f64,
}

impl Pose2 {
    /// A pose from its parts.
    pub fn new(x: f64, y: f64, yaw: f64) -> Self {
        Self { x, y, yaw }
    }

    /// The pose after a constant twist (`v` m/s along x, `omega` rad/s) held for `dt` seconds: an exact arc.
    pub fn after_twist(self, v: f64, omega: f64, dt: f64) -> Self {
        let half_turn = 0.5 * omega * dt;
        let chord = v * dt * sinc(half_turn);
        let (sin, cos) = (self.yaw + half_turn).sin_cos();
        Self { x: self.x + chord * cos, y: self.y + chord * sin, yaw: self.yaw + 2.0 * half_turn }
    }

    /// Distance between two positions, in metres.
    pub fn distance(self, other: Self) -> f64 {
        (self.x - other.x).hypot(self.y - other.y)
    }

    /// The transform map <- base.
    pub fn isometry(self) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::new(self.x, self.y, 0.0),
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.yaw),
        )
    }
}

/// `sin(x)/x`, exact at and near zero.
pub fn sinc(x: f64) -> f64 {
    if x.abs() < 1e-4 {
        let x2 = x * x;
        1.0 - x2 / 6.0 * (1.0 - x2 / 20.0)
    } else {
        x.sin() / x
    }
}

/// The angle brought into (-pi, pi].
pub fn wrap_angle(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    let wrapped = (angle + PI).rem_euclid(TAU) - PI;
    if wrapped == -PI { PI } else { wrapped }
}

/// The value congruent to `angle` (mod 2 pi) that is nearest to `reference`.
pub fn unwrap_near(angle: f64, reference: f64) -> f64 {
    reference + wrap_angle(angle - reference)
}

/// An axis-aligned box, `min <= max` on every axis, in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Aabb {
    /// Lower corner.
    pub min: [f64; 3],
    /// Upper corner.
    pub max: [f64; 3],
}

impl Aabb {
    /// The box grown by `margin` metres on every side.
    pub fn grown(self, margin: f64) -> Self {
        Self { min: self.min.map(|v| v - margin), max: self.max.map(|v| v + margin) }
    }

    /// Distance from a point to the box, zero inside, in metres.
    pub fn distance(&self, p: &Point3<f64>) -> f64 {
        (0..3).map(|i| (self.min[i] - p[i]).max(p[i] - self.max[i]).max(0.0).powi(2)).sum::<f64>().sqrt()
    }
}
