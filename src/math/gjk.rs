//! Distance between convex bodies from their support points (Gilbert, Johnson & Keerthi 1988), as a pair of bounds.

use nalgebra::Vector3;

/// Bounds on a distance: `lower` proven by a separating slab, `upper` by a pair of points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gap {
    /// Not above the distance; zero where the bodies touch or overlap.
    pub lower: f64,
    /// Not below it.
    pub upper: f64,
}

/// Iterations after which the bounds are returned as they are.
const ITERATIONS: usize = 40;

/// Distance from the origin to a convex set given by its support function (a farthest point in a direction): for two bodies
/// A and B their Minkowski difference, `support(d) = a(d) - b(-d)`. `toward` is any first guess at a point of the set.
///
/// Stops as soon as the bounds are good `enough`.
pub fn distance_from_origin(
    support: impl Fn(&Vector3<f64>) -> Vector3<f64>,
    toward: Vector3<f64>,
    enough: impl Fn(Gap) -> bool,
) -> Gap {
    with_direction(support, toward, enough).0
}

/// [`distance_from_origin`], and the direction from the origin to the nearest point found: the normal of a slab that separates
/// the bodies, where they are apart.
pub fn with_direction(
    support: impl Fn(&Vector3<f64>) -> Vector3<f64>,
    toward: Vector3<f64>,
    enough: impl Fn(Gap) -> bool,
) -> (Gap, Vector3<f64>) {
    let (gap, nearest, _) = iterate(|d| [support(d), Vector3::zeros()], toward, enough);
    (gap, nearest)
}

/// The nearest points of two bodies: the gap, a point of A, and the way from B's point to it. `support(d)` gives the difference's
/// farthest point in a direction and A's share in it. Where the bodies meet, the points mean nothing.
pub fn with_points(
    support: impl Fn(&Vector3<f64>) -> [Vector3<f64>; 2],
    toward: Vector3<f64>,
    enough: impl Fn(Gap) -> bool,
) -> (Gap, Vector3<f64>, Vector3<f64>) {
    let (gap, nearest, simplex) = iterate(support, toward, enough);
    (gap, simplex.first(&nearest), nearest)
}

fn iterate(
    support: impl Fn(&Vector3<f64>) -> [Vector3<f64>; 2],
    toward: Vector3<f64>,
    enough: impl Fn(Gap) -> bool,
) -> (Gap, Vector3<f64>, Simplex) {
    let mut simplex = Simplex::new(support(&-toward));
    let mut nearest = simplex.points[0];
    let mut lower = 0.0f64;
    for _ in 0..ITERATIONS {
        let upper = nearest.norm();
        if upper < 1e-12 {
            return (Gap { lower: 0.0, upper: 0.0 }, nearest, simplex);
        }
        let next = support(&-nearest);
        lower = lower.max(nearest.dot(&next[0]) / upper);
        let gap = Gap { lower, upper };
        if enough(gap) || simplex.has(&next[0]) {
            return (gap, nearest, simplex);
        }
        simplex.add(next);
        match simplex.reduce() {
            Some(point) => nearest = point,
            None => return (Gap { lower: 0.0, upper: 0.0 }, nearest, simplex),
        }
    }
    (Gap { lower, upper: nearest.norm() }, nearest, simplex)
}

/// One to four points; after `reduce` those whose hull holds the nearest point to the origin.
struct Simplex {
    points: [Vector3<f64>; 4],
    /// The first body's share in each.
    firsts: [Vector3<f64>; 4],
    count: usize,
}

impl Simplex {
    fn new([point, first]: [Vector3<f64>; 2]) -> Self {
        Self { points: [point; 4], firsts: [first; 4], count: 1 }
    }

    fn has(&self, p: &Vector3<f64>) -> bool {
        self.points[..self.count].iter().any(|q| (q - p).norm_squared() < 1e-24)
    }

    fn add(&mut self, [point, first]: [Vector3<f64>; 2]) {
        self.points[self.count.min(3)] = point;
        self.firsts[self.count.min(3)] = first;
        self.count = (self.count + 1).min(4);
    }

    fn keep(&mut self, indices: &[usize]) {
        let (points, firsts) = (self.points, self.firsts);
        for (to, from) in indices.iter().enumerate() {
            self.points[to] = points[*from];
            self.firsts[to] = firsts[*from];
        }
        self.count = indices.len();
    }

    /// The first body's share in the nearest point, which lies on the hull of the points.
    fn first(&self, nearest: &Vector3<f64>) -> Vector3<f64> {
        let [a, b, c] = [0, 1, 2].map(|k| self.points[k] - nearest);
        let normal = (b - a).cross(&(c - a));
        let area = normal.norm_squared();
        if self.count > 2 && area > 1e-28 * (b - a).norm_squared().max((c - a).norm_squared()) {
            let weights = [b.cross(&c), c.cross(&a), a.cross(&b)].map(|part| part.dot(&normal) / area);
            return (0..3).map(|k| self.firsts[k] * weights[k]).sum();
        }
        let edge = b - a;
        let length = edge.norm_squared();
        let share = if self.count > 1 && length > 0.0 { (-a.dot(&edge) / length).clamp(0.0, 1.0) } else { 0.0 };
        self.firsts[0] + (self.firsts[1] - self.firsts[0]) * share
    }

    /// The nearest point of the hull to the origin, dropping points that do not hold it; `None`: the origin is inside.
    fn reduce(&mut self) -> Option<Vector3<f64>> {
        match self.count {
            1 => Some(self.points[0]),
            2 => {
                let (kept, point) = nearest_on_segment(&self.points, [0, 1]);
                self.keep(kept.as_slice());
                Some(point)
            }
            3 => {
                let (kept, point) = nearest_on_triangle(&self.points, [0, 1, 2]);
                self.keep(kept.as_slice());
                Some(point)
            }
            _ => {
                let mut best: Option<(Kept, Vector3<f64>)> = None;
                let mut inside = true;
                for (face, opposite) in [([0, 1, 2], 3), ([0, 1, 3], 2), ([0, 2, 3], 1), ([1, 2, 3], 0)] {
                    let [a, b, c] = face.map(|i| self.points[i]);
                    let normal = (b - a).cross(&(c - a));
                    let (origin_side, other_side) = (-normal.dot(&a), normal.dot(&(self.points[opposite] - a)));
                    let flat = other_side.abs() <= 1e-14 * normal.norm();
                    if origin_side * other_side < 0.0 || flat {
                        inside = false;
                        let (kept, point) = nearest_on_triangle(&self.points, face);
                        if best.as_ref().is_none_or(|(_, p)| point.norm_squared() < p.norm_squared()) {
                            best = Some((kept, point));
                        }
                    }
                }
                if inside {
                    return None;
                }
                let (kept, point) = best?;
                self.keep(kept.as_slice());
                Some(point)
            }
        }
    }
}

/// Up to three indices.
struct Kept([usize; 3], usize);

impl Kept {
    fn of(indices: &[usize]) -> Self {
        let mut all = [0; 3];
        all[..indices.len()].copy_from_slice(indices);
        Self(all, indices.len())
    }

    fn as_slice(&self) -> &[usize] {
        &self.0[..self.1]
    }
}

fn nearest_on_segment(points: &[Vector3<f64>; 4], [i, j]: [usize; 2]) -> (Kept, Vector3<f64>) {
    let (a, edge) = (points[i], points[j] - points[i]);
    let length = edge.norm_squared();
    let share = if length > 0.0 { -a.dot(&edge) / length } else { 0.0 };
    if share <= 0.0 {
        (Kept::of(&[i]), a)
    } else if share >= 1.0 {
        (Kept::of(&[j]), points[j])
    } else {
        (Kept::of(&[i, j]), a + edge * share)
    }
}

/// Ericson, "Real-Time Collision Detection", section 5.1.5, for the origin.
fn nearest_on_triangle(points: &[Vector3<f64>; 4], [i, j, k]: [usize; 3]) -> (Kept, Vector3<f64>) {
    let (a, b, c) = (points[i], points[j], points[k]);
    let (ab, ac) = (b - a, c - a);
    let normal = ab.cross(&ac);
    let area = normal.norm_squared();
    if area <= 1e-28 * ab.norm_squared().max(ac.norm_squared()) {
        return [[i, j], [j, k], [i, k]]
            .map(|edge| nearest_on_segment(points, edge))
            .into_iter()
            .min_by(|p, q| p.1.norm_squared().total_cmp(&q.1.norm_squared()))
            .expect("three edges");
    }
    // The origin seen from outside each edge: then the nearest point is on that edge.
    let outside = |p: Vector3<f64>, q: Vector3<f64>| (q - p).cross(&normal).dot(&-p) > 0.0;
    let edges = [([i, j], outside(a, b)), ([j, k], outside(b, c)), ([k, i], outside(c, a))];
    if edges.iter().any(|e| e.1) {
        return edges
            .iter()
            .filter(|e| e.1)
            .map(|e| nearest_on_segment(points, e.0))
            .min_by(|p, q| p.1.norm_squared().total_cmp(&q.1.norm_squared()))
            .expect("one edge at least");
    }
    (Kept::of(&[i, j, k]), normal * (normal.dot(&a) / area))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::real;
    use nalgebra::{Isometry3, Point3, UnitQuaternion};
    use parry3d_f64::query;
    use parry3d_f64::shape::{Ball, Cuboid};
    use proptest::prelude::*;

    /// Shapes of our own, so that this module knows no robot.
    enum Convex {
        Box { half: [f64; 3] },
        Sphere { radius: f64 },
        Cylinder { radius: f64, half_length: f64 },
    }

    impl Convex {
        fn support(&self, d: &Vector3<f64>) -> Vector3<f64> {
            match self {
                Self::Box { half } => Vector3::new(half[0].copysign(d.x), half[1].copysign(d.y), half[2].copysign(d.z)),
                Self::Sphere { radius } => d.normalize() * *radius,
                Self::Cylinder { radius, half_length } => {
                    let flat = real::hypot(d.x, d.y).max(1e-300);
                    Vector3::new(d.x / flat * radius, d.y / flat * radius, half_length.copysign(d.z))
                }
            }
        }
    }

    fn between(
        a: &Convex,
        pose_a: &Isometry3<f64>,
        b: &Convex,
        pose_b: &Isometry3<f64>,
        threshold: Option<f64>,
    ) -> Gap {
        let world = |shape: &Convex, pose: &Isometry3<f64>, d: &Vector3<f64>| {
            pose.translation.vector + pose.rotation * shape.support(&pose.rotation.inverse_transform_vector(d))
        };
        let support = |d: &Vector3<f64>| world(a, pose_a, d) - world(b, pose_b, &-d);
        let enough =
            |gap: Gap| gap.upper - gap.lower <= 1e-9 || threshold.is_some_and(|t| gap.lower >= t || gap.upper < t);
        distance_from_origin(support, pose_a.translation.vector - pose_b.translation.vector, enough)
    }

    fn pose() -> impl Strategy<Value = Isometry3<f64>> {
        (prop::array::uniform3(-1.0f64..1.0), prop::array::uniform3(-3.0f64..3.0))
            .prop_map(|(t, r)| Isometry3::new(Vector3::from(t), Vector3::from(r)))
    }

    proptest! {
        #[test]
        fn agrees_with_parry_on_boxes_and_balls(
            half in prop::array::uniform3(0.01f64..0.5), radius in 0.01f64..0.4, pose_a in pose(), pose_b in pose(),
        ) {
            let gap = between(&Convex::Box { half }, &pose_a, &Convex::Box { half: [0.1, 0.2, 0.3] }, &pose_b, None);
            prop_assert!(gap.lower <= gap.upper + 1e-12);
            let convert = |p: &Isometry3<f64>| {
                let (t, q) = (p.translation.vector, p.rotation);
                let mut pose = parry3d_f64::math::Pose::identity();
                pose.translation = parry3d_f64::math::Vector::new(t.x, t.y, t.z);
                pose.rotation = parry3d_f64::math::Rotation::from_xyzw(q.i, q.j, q.k, q.w);
                pose
            };
            let vector = |h: [f64; 3]| parry3d_f64::math::Vector::new(h[0], h[1], h[2]);
            let other = Cuboid::new(vector([0.1, 0.2, 0.3]));
            let expected = query::distance(&convert(&pose_a), &Cuboid::new(vector(half)), &convert(&pose_b), &other).unwrap().distance;
            prop_assert!(gap.lower <= expected + 1e-7 && gap.upper >= expected - 1e-7, "{gap:?} vs {expected}");
            prop_assert!(gap.upper - gap.lower < 1e-6, "{gap:?}");
            let ball = between(&Convex::Sphere { radius }, &pose_a, &Convex::Box { half: [0.1, 0.2, 0.3] }, &pose_b, None);
            let expected = query::distance(&convert(&pose_a), &Ball::new(radius), &convert(&pose_b), &other).unwrap().distance;
            prop_assert!(ball.lower <= expected + 1e-7 && ball.upper >= expected - 1e-7, "{ball:?} vs {expected}");
        }

        #[test]
        fn a_threshold_only_stops_it_early(half in prop::array::uniform3(0.01f64..0.5), a in pose(), b in pose(), t in 0.0f64..1.0) {
            let (shape, other) = (Convex::Cylinder { radius: half[0], half_length: half[1] }, Convex::Box { half });
            let full = between(&shape, &a, &other, &b, None);
            let early = between(&shape, &a, &other, &b, Some(t));
            prop_assert!(early.lower <= full.upper + 1e-9 && early.upper >= full.lower - 1e-9);
            prop_assert!(early.lower >= t || early.upper < t || early.upper - early.lower <= 1e-9 || full.upper - full.lower > 1e-9);
        }
    }

    proptest! {
        #[test]
        fn nearest_points_are_points_of_both_bodies_that_far_apart(
            half in prop::array::uniform3(0.01f64..0.5), radius in 0.01f64..0.4, pose_a in pose(), pose_b in pose(),
        ) {
            let (a, b) = (Convex::Box { half }, Convex::Cylinder { radius, half_length: 0.2 });
            let world = |shape: &Convex, pose: &Isometry3<f64>, d: &Vector3<f64>| {
                pose.translation.vector + pose.rotation * shape.support(&pose.rotation.inverse_transform_vector(d))
            };
            let support = |d: &Vector3<f64>| {
                let first = world(&a, &pose_a, d);
                [first - world(&b, &pose_b, &-d), first]
            };
            let toward = pose_a.translation.vector - pose_b.translation.vector;
            let (gap, first, apart) = with_points(support, toward, |gap| gap.upper - gap.lower <= 1e-9);
            prop_assume!(gap.lower > 0.0);
            let inside = |pose: &Isometry3<f64>, p: Vector3<f64>| pose.inverse_transform_point(&p.into());
            let (on_a, on_b) = (inside(&pose_a, first), inside(&pose_b, first - apart));
            prop_assert!((0..3).all(|k| on_a[k].abs() <= half[k] + 1e-7));
            prop_assert!(real::hypot(on_b.x, on_b.y) <= radius + 1e-7 && on_b.z.abs() <= 0.2 + 1e-7);
            prop_assert!((apart.norm() - gap.upper).abs() < 1e-9);
        }
    }

    #[test]
    fn touching_and_containing_bodies_have_no_gap() {
        let small = Convex::Box { half: [0.1; 3] };
        let large = Convex::Sphere { radius: 2.0 };
        let turned =
            Isometry3::from_parts(Point3::new(0.3, 0.2, 0.1).into(), UnitQuaternion::from_euler_angles(0.4, 0.5, 0.6));
        assert_eq!(between(&small, &turned, &large, &Isometry3::identity(), None).upper, 0.0);
    }
}
