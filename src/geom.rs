//! Poses and boxes in SI units. Transforms read so that neighbours cancel: `map_from_base * base_from_link`.

use crate::math::real;
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
        let (sin, cos) = real::sin_cos(self.yaw + half_turn);
        Self { x: self.x + chord * cos, y: self.y + chord * sin, yaw: self.yaw + 2.0 * half_turn }
    }

    /// Distance between two positions, in metres.
    pub fn distance(self, other: Self) -> f64 {
        real::hypot(self.x - other.x, self.y - other.y)
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
        real::sin(x) / x
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

/// Distance from a point to the area that a closed polygon winds around, zero within it and on its edge; same unit as the corners.
pub fn distance_to_area(p: [f64; 2], polygon: &[[f64; 2]]) -> f64 {
    let foot = nearest_in_area(p, polygon);
    real::hypot(p[0] - foot[0], p[1] - foot[1])
}

/// The point of the area that a closed polygon winds around that is nearest to a point: itself, within it.
pub fn nearest_in_area(p: [f64; 2], polygon: &[[f64; 2]]) -> [f64; 2] {
    let (mut nearest, mut turns) = ((f64::INFINITY, p), 0);
    for (a, b) in polygon.iter().zip(polygon.iter().cycle().skip(1)) {
        let (side, off) = ([b[0] - a[0], b[1] - a[1]], [p[0] - a[0], p[1] - a[1]]);
        let length = side[0] * side[0] + side[1] * side[1];
        let along = if length > 0.0 { (off[0] * side[0] + off[1] * side[1]) / length } else { 0.0 }.clamp(0.0, 1.0);
        let square = real::powi(off[0] - along * side[0], 2) + real::powi(off[1] - along * side[1], 2);
        if square < nearest.0 {
            nearest = (square, [a[0] + along * side[0], a[1] + along * side[1]]);
        }
        // Crossings of the ray from the point along x, upwards counted up (Sunday's winding number).
        let left = side[0] * off[1] - off[0] * side[1];
        if a[1] <= p[1] && b[1] > p[1] && left > 0.0 {
            turns += 1;
        } else if a[1] > p[1] && b[1] <= p[1] && left < 0.0 {
            turns -= 1;
        }
    }
    if turns == 0 { nearest.1 } else { p }
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
        (0..3).map(|i| real::powi((self.min[i] - p[i]).max(p[i] - self.max[i]).max(0.0), 2)).sum::<f64>().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn an_area_is_what_a_polygon_winds_around() {
        // A square that is entered by a notch from above, written clockwise.
        let notched = [[0.0, 0.0], [0.0, 2.0], [0.8, 2.0], [1.0, 0.5], [1.2, 2.0], [2.0, 2.0], [2.0, 0.0]];
        for (p, distance) in [
            ([1.0, 0.4], 0.0),
            ([1.0, 0.5], 0.0),
            ([0.1, 1.9], 0.0),
            ([2.0, 1.0], 0.0),
            ([3.0, 1.0], 1.0),
            ([-3.0, -4.0], 5.0),
            // In the notch: 0.15 m from both of its sides, which rise 1.5 m in 0.2 m.
            ([1.0, 1.625], 0.15 / real::hypot(1.5, 0.2) * 1.5),
        ] {
            assert!(
                (distance_to_area(p, &notched) - distance).abs() < 1e-12,
                "{p:?}: {}",
                distance_to_area(p, &notched)
            );
        }
    }

    proptest! {
        #[test]
        fn the_distance_to_a_box_as_a_polygon_is_that_to_the_box(
            low in [-2.0..0.0f64, -2.0..0.0], size in [0.01..2.0f64, 0.01..2.0], p in [-4.0..4.0f64, -4.0..4.0], first in 0usize..4, back in any::<bool>(),
        ) {
            let high = [low[0] + size[0], low[1] + size[1]];
            let mut corners = vec![low, [high[0], low[1]], high, [low[0], high[1]]];
            corners.rotate_left(first);
            if back {
                corners.reverse();
            }
            let aabb = Aabb { min: [low[0], low[1], 0.0], max: [high[0], high[1], 0.0] };
            let expected = aabb.distance(&Point3::new(p[0], p[1], 0.0));
            prop_assert!((distance_to_area(p, &corners) - expected).abs() < 1e-12);
        }
    }
}
