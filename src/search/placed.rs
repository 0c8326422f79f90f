//! The robot's shapes in their places, for one posture or for each: what `collide` asks of them.

use nalgebra::{Matrix3, Vector3};

use super::posture::Postures;
use crate::geom::{Aabb, Pose2};
use crate::math::real;
use crate::robot::Convex;

/// A pose of the base, its sine and cosine known.
#[derive(Debug, Clone, Copy)]
pub(super) struct Base {
    sin: f64,
    cos: f64,
    x: f64,
    y: f64,
}

impl From<Pose2> for Base {
    fn from(pose: Pose2) -> Self {
        let (sin, cos) = real::sin_cos(pose.yaw);
        Self { sin, cos, x: pose.x, y: pose.y }
    }
}

impl Base {
    /// With the same heading elsewhere.
    pub fn moved_to(self, x: f64, y: f64) -> Self {
        Self { x, y, ..self }
    }

    /// A point of the base frame in the map frame.
    #[inline]
    pub fn map(&self, p: &Vector3<f64>) -> [f64; 3] {
        [self.cos * p.x - self.sin * p.y + self.x, self.sin * p.x + self.cos * p.y + self.y, p.z]
    }
}

/// A shape's rotation and centre in some frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct Posed {
    pub rotation: Matrix3<f64>,
    pub centre: Vector3<f64>,
}

impl Posed {
    pub fn new(pose: &nalgebra::Isometry3<f64>) -> Self {
        Self { rotation: pose.rotation.to_rotation_matrix().into_inner(), centre: pose.translation.vector }
    }

    /// From the base frame to the map's.
    pub fn under(&self, base: &Base) -> Self {
        let turn = Matrix3::new(base.cos, -base.sin, 0.0, base.sin, base.cos, 0.0, 0.0, 0.0, 1.0);
        Self { rotation: turn * self.rotation, centre: turn * self.centre + Vector3::new(base.x, base.y, 0.0) }
    }

    pub fn support(&self, convex: &Convex, direction: &Vector3<f64>) -> Vector3<f64> {
        self.centre + self.rotation * convex.support(&self.rotation.tr_mul(direction))
    }

    /// Bounds of a shape.
    pub fn bounds(&self, convex: &Convex) -> Aabb {
        let reach: [f64; 3] = match convex {
            Convex::Box { half } => {
                std::array::from_fn(|a| (0..3).map(|k| self.rotation[(a, k)].abs() * half[k]).sum())
            }
            Convex::Sphere { radius } => [*radius; 3],
            _ => {
                let end = |a: usize, sign: f64| self.support(convex, &Vector3::ith(a, sign))[a];
                return Aabb { min: std::array::from_fn(|a| end(a, -1.0)), max: std::array::from_fn(|a| end(a, 1.0)) };
            }
        };
        Aabb {
            min: std::array::from_fn(|a| self.centre[a] - reach[a]),
            max: std::array::from_fn(|a| self.centre[a] + reach[a]),
        }
    }

    /// No point of a shape is farther from the z axis than this, m; exact for boxes, hulls and balls.
    pub fn farthest_from_axis(&self, convex: &Convex) -> f64 {
        let flat = |p: Vector3<f64>| real::hypot(p.x, p.y);
        let of = |points: &mut dyn Iterator<Item = Vector3<f64>>| {
            points.map(|p| flat(self.centre + self.rotation * p)).fold(0.0, f64::max)
        };
        match convex {
            Convex::Hull { vertices } => of(&mut vertices.iter().map(|v| Vector3::from(*v))),
            Convex::Sphere { radius } => flat(self.centre) + radius,
            Convex::Cylinder { radius, half_length } => {
                let ends =
                    [-1.0, 1.0].map(|s| flat(self.centre + self.rotation * Vector3::new(0.0, 0.0, s * half_length)));
                of(&mut corners(convex.half_extents())).min(ends[0].max(ends[1]) + radius)
            }
            Convex::Box { half } => of(&mut corners(*half)),
        }
    }
}

/// A ball that helps to cover a shape.
pub(super) struct Ball {
    /// base <- shape, one a posture as in [`Placed::poses`].
    pub centres: Vec<Vector3<f64>>,
    /// A ball about the centre with this radius is inside the shape, m; `None`: the centre is not known to be.
    pub inner: Option<f64>,
}

/// A shape with its places.
pub(super) struct Placed {
    pub convex: Convex,
    /// Index of the shape in the robot.
    pub shape: usize,
    /// Half extents of the shape's own bounding box, m.
    pub half: [f64; 3],
    /// Radius of the ball about the centre that holds the shape, m.
    pub radius: f64,
    /// Balls that cover the shape, and their radius.
    pub balls: Vec<Ball>,
    pub ball_radius: f64,
    /// base <- shape; one for a rigid shape, else one a posture.
    pub poses: Vec<Posed>,
    /// No point of the shape is farther from the base's vertical axis, m.
    pub reach: f64,
    /// Per joint: no point moves farther when the joint moves by one step, m.
    pub step_moves: Vec<f64>,
}

impl Placed {
    pub fn new(shape: usize, convex: &Convex, poses: Vec<Posed>, postures: &Postures) -> Self {
        let half = convex.half_extents();
        let radius = convex.bounding_radius();
        let step_moves: Vec<f64> = postures
            .axes()
            .iter()
            .map(|&(count, stride)| {
                let pairs = (0..poses.len()).filter(|p| poses.len() > 1 && p / stride % count + 1 < count);
                pairs.map(|p| farthest_move(&poses[p], &poses[p + stride], half)).fold(0.0, f64::max)
            })
            .collect();
        // Between sampled postures half a step may be added.
        let reach = poses.iter().map(|pose| pose.farthest_from_axis(convex)).fold(0.0, f64::max)
            + step_moves.iter().sum::<f64>() / 2.0;
        let (balls, ball_radius) = cover(convex, half, radius);
        let balls = balls.into_iter().map(|(centre, inner)| {
            let centres = poses.iter().map(|pose| pose.centre + pose.rotation * centre).collect();
            Ball { centres, inner }
        });
        Self {
            convex: convex.clone(),
            shape,
            half,
            radius,
            balls: balls.collect(),
            ball_radius,
            poses,
            reach,
            step_moves,
        }
    }
}

/// No point of a box is farther apart in two poses, m: that distance is convex, so it is largest at a corner.
fn farthest_move(a: &Posed, b: &Posed, half: [f64; 3]) -> f64 {
    let (shift, turn) = (a.centre - b.centre, a.rotation - b.rotation);
    corners(half).map(|corner| (shift + turn * corner).norm()).fold(0.0, f64::max)
}

fn corners(half: [f64; 3]) -> impl Iterator<Item = Vector3<f64>> {
    (0..8).map(move |k| Vector3::from_fn(|a, _| if k >> a & 1 == 0 { -half[a] } else { half[a] }))
}

/// A ball's centre in the shape's frame, and how deep that is known to be inside the shape, m.
type Covering = (Vector3<f64>, Option<f64>);

/// Balls that cover a box: as many along each axis as make them about as wide as the box's least side; and their radius, m.
fn cover(convex: &Convex, half: [f64; 3], bounding: f64) -> (Vec<Covering>, f64) {
    let least = half.iter().copied().fold(f64::INFINITY, f64::min).max(0.03);
    let counts = half.map(|h| ((h / least / 1.5).ceil() as usize).clamp(1, 6));
    let part: [f64; 3] = std::array::from_fn(|a| half[a] / counts[a] as f64);
    let radius = part.iter().map(|h| h * h).sum::<f64>().sqrt();
    let centre = |a: usize, k: usize| -half[a] + part[a] * (2 * k + 1) as f64;
    let mut balls = Vec::new();
    for i in 0..counts[0] {
        for j in 0..counts[1] {
            for k in 0..counts[2] {
                let c = Vector3::new(centre(0, i), centre(1, j), centre(2, k));
                balls.push((c, depth(convex, &c)));
            }
        }
    }
    (balls, if counts == [1; 3] { bounding.min(radius) } else { radius })
}

/// How deep a point lies inside a shape, m; `None`: outside, or not known.
fn depth(convex: &Convex, p: &Vector3<f64>) -> Option<f64> {
    let depth = match convex {
        Convex::Box { half } => (0..3).map(|a| half[a] - p[a].abs()).fold(f64::INFINITY, f64::min),
        Convex::Cylinder { radius, half_length } => (radius - real::hypot(p.x, p.y)).min(half_length - p.z.abs()),
        Convex::Sphere { radius } => radius - p.norm(),
        Convex::Hull { .. } => return None,
    };
    (depth >= 0.0).then_some(depth)
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Isometry3, Translation3, UnitQuaternion};
    use proptest::prelude::*;

    fn shape() -> impl Strategy<Value = Convex> {
        prop_oneof![
            prop::array::uniform3(0.01f64..0.5).prop_map(|half| Convex::Box { half }),
            (0.01f64..0.5, 0.01f64..0.5).prop_map(|(radius, half_length)| Convex::Cylinder { radius, half_length }),
            (0.01f64..0.5).prop_map(|radius| Convex::Sphere { radius }),
        ]
    }

    fn pose() -> impl Strategy<Value = Posed> {
        (prop::array::uniform3(-0.4f64..0.4), prop::array::uniform3(-3.0f64..3.0)).prop_map(|(t, r)| {
            let turn = UnitQuaternion::from_euler_angles(r[0], r[1], r[2]);
            Posed::new(&Isometry3::from_parts(Translation3::new(t[0], t[1], t[2]), turn))
        })
    }

    fn directions() -> impl Iterator<Item = Vector3<f64>> {
        (0..400).map(|k| {
            let z = 1.0 - (2.0 * f64::from(k) + 1.0) / 400.0;
            let angle = f64::from(k) * 2.399_963;
            let flat = (1.0 - z * z).sqrt();
            Vector3::new(flat * real::cos(angle), flat * real::sin(angle), z)
        })
    }

    proptest! {
        #[test]
        fn bounds_and_reach_hold_every_point_of_a_shape_and_little_more(convex in shape(), pose in pose()) {
            let bounds = pose.bounds(&convex);
            let reach = pose.farthest_from_axis(&convex);
            let (mut farthest, mut top) = (0.0f64, f64::NEG_INFINITY);
            for d in directions() {
                let p = pose.support(&convex, &d);
                for a in 0..3 {
                    prop_assert!(bounds.min[a] <= p[a] + 1e-9 && p[a] <= bounds.max[a] + 1e-9);
                }
                farthest = farthest.max(real::hypot(p.x, p.y));
                top = top.max(p.z);
            }
            prop_assert!(farthest <= reach + 1e-9, "{farthest} {reach}");
            prop_assert!(bounds.max[2] - top < 0.05 && reach - farthest < 0.25, "{top} {bounds:?} {farthest} {reach}");
        }

        #[test]
        fn a_ball_that_is_said_to_lie_inside_a_shape_does(convex in shape()) {
            let (balls, radius) = cover(&convex, convex.half_extents(), convex.bounding_radius());
            let whole = Posed::new(&Isometry3::identity());
            for d in directions() {
                let support = whole.support(&convex, &d);
                for (centre, inner) in &balls {
                    if let Some(inner) = inner {
                        prop_assert!((centre + d * *inner).dot(&d) <= support.dot(&d) + 1e-9);
                    }
                }
                let nearest = balls.iter().map(|(c, _)| (c - support).norm()).fold(f64::INFINITY, f64::min);
                prop_assert!(nearest <= radius + 1e-9, "{nearest} {radius}");
            }
        }
    }
}
