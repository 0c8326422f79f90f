//! Convex shapes about their own centre.

use crate::math::real;
use nalgebra::Vector3;

/// A convex body about its own centre.
#[derive(Debug, Clone, PartialEq)]
pub enum Convex {
    /// Half extents along x, y, z.
    Box {
        /// Metres.
        half: [f64; 3],
    },
    /// Axis along z.
    Cylinder {
        /// Metres.
        radius: f64,
        /// Half the length, metres.
        half_length: f64,
    },
    /// A ball.
    Sphere {
        /// Metres.
        radius: f64,
    },
    /// The hull of these points; the centre of their bounding box is the origin.
    Hull {
        /// Extreme points only, metres, in a stable order.
        vertices: Vec<[f64; 3]>,
    },
}

impl Convex {
    /// A farthest point in direction `d` (any length; zero allowed).
    pub fn support(&self, d: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Self::Box { half } => Vector3::new(half[0].copysign(d.x), half[1].copysign(d.y), half[2].copysign(d.z)),
            Self::Cylinder { radius, half_length } => {
                let flat = real::hypot(d.x, d.y);
                let scale = if flat > 0.0 { radius / flat } else { 0.0 };
                Vector3::new(d.x * scale, d.y * scale, half_length.copysign(d.z))
            }
            Self::Sphere { radius } => {
                let norm = d.norm();
                if norm > 0.0 { d * (radius / norm) } else { Vector3::zeros() }
            }
            Self::Hull { vertices } => {
                let mut best = (f64::NEG_INFINITY, Vector3::zeros());
                for v in vertices {
                    let height = v[0] * d.x + v[1] * d.y + v[2] * d.z;
                    if height > best.0 {
                        best = (height, Vector3::new(v[0], v[1], v[2]));
                    }
                }
                best.1
            }
        }
    }

    /// Radius of the smallest ball about the centre that holds the shape.
    pub fn bounding_radius(&self) -> f64 {
        match self {
            Self::Box { half } => half.iter().map(|h| h * h).sum::<f64>().sqrt(),
            Self::Cylinder { radius, half_length } => real::hypot(*radius, *half_length),
            Self::Sphere { radius } => *radius,
            Self::Hull { vertices } => {
                vertices.iter().map(|v| v.iter().map(|c| c * c).sum::<f64>()).fold(0.0, f64::max).sqrt()
            }
        }
    }

    /// Half extents of the shape's own bounding box about its centre.
    pub fn half_extents(&self) -> [f64; 3] {
        match self {
            Self::Box { half } => *half,
            Self::Cylinder { radius, half_length } => [*radius, *radius, *half_length],
            Self::Sphere { radius } => [*radius; 3],
            Self::Hull { vertices } => {
                let mut half = [0.0f64; 3];
                for v in vertices {
                    for i in 0..3 {
                        half[i] = half[i].max(v[i].abs());
                    }
                }
                half
            }
        }
    }
}
