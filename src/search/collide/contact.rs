//! The nearest obstacle of one pose, exactly.

use nalgebra::{Matrix3, Vector3};

use super::super::obstacles;
use super::super::placed::Posed;
use super::{Collider, edge_distance};
use crate::geom::{Aabb, Pose2};
use crate::math::gjk;
use crate::math::real;
use crate::mission::Unknown;

/// The nearest obstacle of a pose, for people.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// URDF link.
    pub link: String,
    /// The obstacle; `None`: unseen space beyond the map.
    pub obstacle: Option<Aabb>,
    /// Clearance, m; negative: least overlap found over many directions.
    pub clearance: f64,
}

impl<const W: usize> Collider<'_, W> {
    /// The nearest obstacle of a pose in one posture, exactly.
    pub fn contact(&self, pose: Pose2, joints: &[f64]) -> Contact {
        let reach = self.reach + 1.0;
        let region = Aabb {
            min: [pose.x - reach, pose.y - reach, self.heights[0] - 1.0],
            max: [pose.x + reach, pose.y + reach, self.heights[1] + 1.0],
        };
        let mut boxes = Vec::new();
        obstacles::collect(self.map, &region, &mut boxes);
        let mut best = Contact { link: self.robot.name.clone(), obstacle: None, clearance: f64::INFINITY };
        for (shape, place) in self.robot.shapes.iter().zip(self.robot.shape_poses(joints)) {
            let posed = Posed::new(&place).under(&pose.into());
            let mut take = |clearance: f64, obstacle: Option<Aabb>| {
                if clearance < best.clearance {
                    best = Contact { link: shape.link.clone(), obstacle, clearance };
                }
            };
            if self.map.outside == Unknown::Occupied {
                take(edge_distance(&self.map.bounds(), &posed.bounds(&shape.convex)), None);
            }
            for obstacle in &boxes {
                let apart = |d: &Vector3<f64>| {
                    posed.support(&shape.convex, d)
                        - Vector3::from_fn(|i, _| if d[i] > 0.0 { obstacle.min[i] } else { obstacle.max[i] })
                };
                let middle = Vector3::from_fn(|i, _| 0.5 * (obstacle.min[i] + obstacle.max[i]));
                let precise = |gap: gjk::Gap| gap.upper - gap.lower <= 1e-6;
                let gap = gjk::distance_from_origin(apart, posed.centre - middle, precise);
                let clearance = if gap.upper > 0.0 { gap.upper } else { -overlap(apart, &posed.rotation) };
                take(clearance, Some(*obstacle));
            }
        }
        best
    }
}

/// Least overlap of two bodies over many directions: how far one must move to leave the other (an upper bound), m.
fn overlap(apart: impl Fn(&Vector3<f64>) -> Vector3<f64>, rotation: &Matrix3<f64>) -> f64 {
    let spread = (0..200).map(|k| {
        // Fibonacci's spiral spreads directions evenly over the sphere.
        let z = 1.0 - (2.0 * f64::from(k) + 1.0) / 200.0;
        let angle = f64::from(k) * std::f64::consts::PI * (1.0 + 5f64.sqrt());
        let flat = (1.0 - z * z).sqrt();
        Vector3::new(flat * real::cos(angle), flat * real::sin(angle), z)
    });
    let axes = (0..3).flat_map(|i| {
        let own: Vector3<f64> = rotation.column(i).into();
        let world = Vector3::ith(i, 1.0);
        [own, -own, world, -world]
    });
    spread.chain(axes).map(|d| apart(&d).dot(&d)).fold(f64::INFINITY, f64::min)
}
