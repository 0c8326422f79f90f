//! The same bodies in another library, parry.

use std::sync::Arc;

use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use parry3d_f64::math::{Pose, Vector};
use parry3d_f64::shape::{Ball, ConvexPolyhedron, Cuboid, Cylinder, SharedShape};

use crate::robot::Convex;

/// The same bodies in another library (its cylinders have their axis along y).
pub(crate) fn peer(convex: &Convex) -> Option<(SharedShape, UnitQuaternion<f64>)> {
    let straight = UnitQuaternion::identity();
    Some(match convex {
        Convex::Box { half } => (SharedShape(Arc::new(Cuboid::new(Vector::new(half[0], half[1], half[2])))), straight),
        Convex::Cylinder { radius, half_length } => (
            SharedShape(Arc::new(Cylinder::new(*half_length, *radius))),
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2),
        ),
        Convex::Sphere { radius } => (SharedShape(Arc::new(Ball::new(*radius))), straight),
        Convex::Hull { vertices } => {
            let points: Vec<_> = vertices.iter().map(|v| Vector::new(v[0], v[1], v[2])).collect();
            (SharedShape(Arc::new(ConvexPolyhedron::from_convex_hull(&points)?)), straight)
        }
    })
}

pub(crate) fn peer_pose(pose: &Isometry3<f64>) -> Pose {
    let (t, r) = (pose.translation.vector, pose.rotation.scaled_axis());
    Pose::new(Vector::new(t.x, t.y, t.z), Vector::new(r.x, r.y, r.z))
}
