//! Distance of a posed convex shape from an axis-aligned box or another shape, with a proof: a plane that separates them by at least as
//! much.

use nalgebra::{Matrix3, Vector2, Vector3};

use super::simplex::Simplex;
use crate::geom::Aabb;
use crate::robot::Convex;

/// Distances up to this count as touching, m.
const TOUCHING: f64 = 1e-9;
/// The search for the distance ends when its upper and lower bound are this near, m.
const GAP: f64 = 1e-7;
/// Corners tried before the bounds are returned as they are. Polytopes need about ten, cylinders up to thirty.
const CORNERS: usize = 64;

/// A convex shape somewhere.
#[derive(Debug, Clone, Copy)]
pub(super) struct Posed<'a> {
    /// About its own centre.
    pub(super) convex: &'a Convex,
    /// map <- shape.
    pub(super) turn: Matrix3<f64>,
    /// The shape's centre in the map frame, m.
    pub(super) centre: Vector3<f64>,
    /// Where its points can be besides; `None`: they are where they are.
    pub(super) spread: Option<Spread>,
}

/// How far the points of a shape can be off: the shape turned a little about the vertical through its centre, then shifted by any sum of
/// what follows. Hulls of all this are what distances are of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Spread {
    /// By -1 to 1 times each of these, m, in the plane.
    pub(super) along: [Vector2<f64>; 4],
    /// The turn, rad, both ways; to first order, its points move along tangents.
    pub(super) turn: f64,
    /// By as much in any direction of the plane, m.
    pub(super) disc: f64,
    /// By as much in any direction, m.
    pub(super) ball: f64,
}

impl Spread {
    /// The greatest `d . shift`, times |d|.
    pub(super) fn along(&self, d: &Vector3<f64>) -> f64 {
        let flat = d.xy();
        let shifts: f64 = self.along.iter().map(|v| v.dot(&flat).abs()).sum();
        shifts + self.disc * flat.norm() + self.ball * d.norm()
    }

    /// The shift that is farthest along `d`.
    fn farthest(&self, d: &Vector3<f64>) -> Vector3<f64> {
        let flat = d.xy();
        let signed = self.along.iter().map(|v| if v.dot(&flat) < 0.0 { -v } else { *v });
        let disc = flat.try_normalize(1e-12).map_or_else(Vector2::zeros, |unit| unit * self.disc);
        let planar = signed.sum::<Vector2<f64>>() + disc;
        let ball = d.try_normalize(1e-300).map_or_else(Vector3::zeros, |unit| unit * self.ball);
        Vector3::new(planar.x, planar.y, 0.0) + ball
    }

    /// `d` as the points see it that have turned one way and the other: `d . (p + m z x p) = turned . p`.
    pub(super) fn turned(&self, d: &Vector3<f64>) -> [Vector3<f64>; 2] {
        let across = Vector3::new(d.y, -d.x, 0.0) * self.turn;
        [d + across, d - across]
    }
}

/// What is known of a distance, in metres.
#[derive(Debug, Clone, Copy)]
pub(super) struct Separation {
    /// Distance of two points, one in each body. Zero: they meet.
    pub(super) upper: f64,
    /// Unit vector from the shape to the other body across which they are farthest apart; `None` where they meet.
    pub(super) normal: Option<Vector3<f64>>,
}

impl Posed<'_> {
    /// How far the shape reaches from its centre along `d`: the greatest `d . (p - centre)` over its points p, times |d|.
    /// With a spread, that of all places where they can be.
    pub(super) fn reach(&self, d: &Vector3<f64>) -> f64 {
        let Some(spread) = &self.spread else { return self.own_reach(d) };
        let [one, other] = spread.turned(d);
        self.own_reach(&one).max(self.own_reach(&other)) + spread.along(d)
    }

    /// The same of the shape as it is.
    pub(super) fn own_reach(&self, d: &Vector3<f64>) -> f64 {
        let local = self.turn.tr_mul(d);
        match self.convex {
            Convex::Box { half } => half[0] * local.x.abs() + half[1] * local.y.abs() + half[2] * local.z.abs(),
            Convex::Cylinder { radius, half_length } => {
                radius * (local.x * local.x + local.y * local.y).sqrt() + half_length * local.z.abs()
            }
            Convex::Sphere { radius } => radius * local.norm(),
            Convex::Hull { vertices } => {
                let heights = vertices.iter().map(|v| v[0] * local.x + v[1] * local.y + v[2] * local.z);
                heights.fold(f64::NEG_INFINITY, f64::max)
            }
        }
    }

    /// The shape's bounding box in the map frame.
    pub(super) fn bounds(&self) -> Aabb {
        let (mut min, mut max) = ([0.0; 3], [0.0; 3]);
        for axis in 0..3 {
            let unit = Vector3::ith(axis, 1.0);
            max[axis] = self.centre[axis] + self.reach(&unit);
            min[axis] = match self.convex {
                Convex::Hull { .. } => self.centre[axis] - self.reach(&-unit),
                _ => 2.0 * self.centre[axis] - max[axis], // symmetric about the centre
            };
        }
        Aabb { min, max }
    }

    /// How far apart the shape and the box are across planes with unit normal `normal` (from the shape to the box), m.
    /// Negative where such a plane does not separate them. Never more than the distance but by rounding.
    pub(super) fn slab(&self, normal: &Vector3<f64>, obstacle: &Aabb) -> f64 {
        nearest_along(normal, obstacle, &self.centre) - self.reach(normal)
    }

    /// The point that is farthest along `d`, from the centre.
    pub(super) fn support(&self, d: &Vector3<f64>) -> Vector3<f64> {
        let own = |d: &Vector3<f64>| self.turn * self.convex.support(&self.turn.tr_mul(d));
        let Some(spread) = &self.spread else { return own(d) };
        let [one, other] = spread.turned(d);
        let (p, q) = (own(&one), own(&other));
        let (p, turn) = if p.dot(&one) >= q.dot(&other) { (p, spread.turn) } else { (q, -spread.turn) };
        p + Vector3::new(-p.y, p.x, 0.0) * turn + spread.farthest(d)
    }

    /// The distance to a box, by Gilbert, Johnson and Keerthi's descent over the difference of the two bodies.
    pub(super) fn separation(&self, obstacle: &Aabb) -> Separation {
        // Points of the difference, seen from the box: shape minus box, in axes of the map, about the shape's centre.
        let corner = |away: &Vector3<f64>| {
            let mut corner = self.support(away) + self.centre;
            for axis in 0..3 {
                corner[axis] -= if away[axis] < 0.0 { obstacle.max[axis] } else { obstacle.min[axis] };
            }
            corner
        };
        let mut toward = Vector3::zeros();
        for axis in 0..3 {
            toward[axis] = self.centre[axis].clamp(obstacle.min[axis], obstacle.max[axis]) - self.centre[axis];
        }
        if toward.norm_squared() == 0.0 {
            toward = Vector3::z();
        }
        descend(corner, toward)
    }

    /// The distance to another shape, found alike; the normal points to it.
    pub(super) fn separation_from(&self, other: &Posed<'_>) -> Separation {
        let between = self.centre - other.centre;
        let corner = |away: &Vector3<f64>| self.support(away) - other.support(&-away) + between;
        descend(corner, if between.norm_squared() == 0.0 { Vector3::z() } else { -between })
    }

    /// How far the shape must move, at most, to leave a box that it overlaps, m: the least overlap across the faces of both
    /// and across their edges.
    pub(super) fn depth(&self, obstacle: &Aabb) -> f64 {
        let own =
            [self.turn.column(0).into_owned(), self.turn.column(1).into_owned(), self.turn.column(2).into_owned()];
        let map = [Vector3::x(), Vector3::y(), Vector3::z()];
        let edges = own.iter().flat_map(|a| map.iter().filter_map(move |b| a.cross(b).try_normalize(1e-6)));
        let normals: Vec<_> = own.iter().chain(&map).copied().chain(edges).collect();
        let both_sides = normals.iter().flat_map(|n| [*n, -n]);
        both_sides.map(|n| -self.slab(&n, obstacle)).fold(f64::INFINITY, f64::min).max(0.0)
    }
}

/// The distance from the origin to the difference of two bodies, by its corners (the farthest point in a direction) and a first guess
/// `toward` of the direction from the first body to the second.
fn descend(corner: impl Fn(&Vector3<f64>) -> Vector3<f64>, toward: Vector3<f64>) -> Separation {
    let mut simplex = Simplex::new(corner(&toward));
    let mut best = Separation { upper: f64::INFINITY, normal: None };
    let mut lower = f64::NEG_INFINITY;
    for _ in 0..CORNERS {
        let Some(nearest) = simplex.reduce() else {
            return Separation { upper: 0.0, normal: None };
        };
        let distance = nearest.norm();
        if distance <= TOUCHING {
            return Separation { upper: 0.0, normal: None };
        }
        let stalled = distance >= best.upper;
        best.upper = best.upper.min(distance);
        let normal = nearest / -distance;
        let next = corner(&normal);
        let slab = -normal.dot(&next);
        if slab > lower {
            (lower, best.normal) = (slab, Some(normal));
        }
        if best.upper - lower <= GAP || stalled || simplex.has(&next) {
            break;
        }
        simplex.push(next);
    }
    best
}

/// The least `normal . (b - from)` over the points b of a box.
pub(super) fn nearest_along(normal: &Vector3<f64>, obstacle: &Aabb, from: &Vector3<f64>) -> f64 {
    (0..3)
        .map(|axis| {
            let corner = if normal[axis] < 0.0 { obstacle.max[axis] } else { obstacle.min[axis] };
            normal[axis] * (corner - from[axis])
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use crate::math::real;
    use nalgebra::Isometry3;
    use parry3d_f64::math::Vector;
    use parry3d_f64::query;
    use parry3d_f64::shape::Cuboid;
    use proptest::prelude::*;

    use super::*;
    use crate::certify::tests::peer::{peer, peer_pose};

    fn posed<'a>(convex: &'a Convex, pose: &Isometry3<f64>) -> Posed<'a> {
        let turn = pose.rotation.to_rotation_matrix().into_inner();
        Posed { convex, turn, centre: pose.translation.vector, spread: None }
    }

    fn any_pose() -> impl Strategy<Value = Isometry3<f64>> {
        ([-1.5..1.5, -1.5..1.5, -1.5..1.5f64], [-3.0..3.0, -3.0..3.0, -3.0..3.0f64])
            .prop_map(|(t, r)| Isometry3::new(Vector3::from(t), Vector3::from(r)))
    }

    fn any_convex() -> impl Strategy<Value = Convex> {
        let size = || 0.02..0.6f64;
        prop_oneof![
            [size(), size(), size()].prop_map(|half| Convex::Box { half }),
            (size(), size()).prop_map(|(radius, half_length)| Convex::Cylinder { radius, half_length }),
            size().prop_map(|radius| Convex::Sphere { radius }),
            prop::collection::vec([-0.6..0.6, -0.6..0.6, -0.6..0.6f64], 5..20)
                .prop_map(|vertices| Convex::Hull { vertices }),
        ]
    }

    fn any_box() -> impl Strategy<Value = Aabb> {
        ([-1.0..1.0, -1.0..1.0, -1.0..1.0f64], [0.01..0.8, 0.01..0.8, 0.01..0.8f64])
            .prop_map(|(min, size)| Aabb { min, max: std::array::from_fn(|i| min[i] + size[i]) })
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(2000))]

        #[test]
        fn both_bounds_of_the_distance_meet(convex in any_convex(), pose in any_pose(), obstacle in any_box()) {
            let shape = posed(&convex, &pose);
            let found = shape.separation(&obstacle);
            match found.normal {
                Some(normal) => {
                    prop_assert!((normal.norm() - 1.0).abs() < 1e-14);
                    let lower = shape.slab(&normal, &obstacle);
                    prop_assert!(lower <= found.upper + 1e-13);
                    prop_assert!(found.upper - lower <= 1.01e-7, "{} {lower}", found.upper);
                }
                None => prop_assert_eq!(found.upper, 0.0),
            }
        }

        #[test]
        fn the_distance_is_that_of_another_library(convex in any_convex(), pose in any_pose(), obstacle in any_box()) {
            let Some((other, turned)) = peer(&convex) else { return Ok(()) };
            let half: [f64; 3] = std::array::from_fn(|i| 0.5 * (obstacle.max[i] - obstacle.min[i]));
            let cuboid = Cuboid::new(Vector::new(half[0], half[1], half[2]));
            let middle = Isometry3::translation(
                obstacle.min[0] + half[0], obstacle.min[1] + half[1], obstacle.min[2] + half[2]);
            let expected = query::distance(&peer_pose(&(pose * turned)), &*other.0, &peer_pose(&middle), &cuboid);
            let found = posed(&convex, &pose).separation(&obstacle).upper;
            prop_assert!((found - expected.unwrap().distance).abs() < 1e-5, "{found} {expected:?}");
        }

        #[test]
        fn the_distance_of_two_shapes_is_that_of_another_library_with_a_plane_between_them(
            first in any_convex(), pose in any_pose(), second in any_convex(), other in any_pose(),
        ) {
            let found = posed(&first, &pose).separation_from(&posed(&second, &other));
            if let Some(normal) = found.normal {
                let (a, b) = (posed(&first, &pose), posed(&second, &other));
                let lower = normal.dot(&(b.centre - a.centre)) - a.reach(&normal) - b.reach(&-normal);
                prop_assert!(lower <= found.upper + 1e-13 && found.upper - lower <= 1.01e-7, "{} {lower}", found.upper);
            } else {
                prop_assert_eq!(found.upper, 0.0);
            }
            let (Some((a, turned_a)), Some((b, turned_b))) = (peer(&first), peer(&second)) else { return Ok(()) };
            let expected = query::distance(&peer_pose(&(pose * turned_a)), &*a.0, &peer_pose(&(other * turned_b)), &*b.0);
            prop_assert!((found.upper - expected.unwrap().distance).abs() < 1e-5, "{} {expected:?}", found.upper);
        }
    }

    proptest! {
        #[test]
        fn with_a_spread_a_shape_reaches_as_far_as_any_of_its_points_can_be(
            vertices in prop::collection::vec([-0.6..0.6, -0.6..0.6, -0.6..0.6f64], 5..20), pose in any_pose(),
            along in [[-0.1..0.1, -0.1..0.1f64], [-0.1..0.1, -0.1..0.1f64], [-0.1..0.1, -0.1..0.1f64], [-0.1..0.1, -0.1..0.1f64]],
            (turn, disc, ball) in (0.0..0.3f64, 0.0..0.1f64, 0.0..0.1f64), d in [-2.0..2.0, -2.0..2.0, -2.0..2.0f64],
        ) {
            let convex = Convex::Hull { vertices: vertices.clone() };
            let spread = Spread { along: along.map(Vector2::from), turn, disc, ball };
            let shape = Posed { spread: Some(spread), ..posed(&convex, &pose) };
            let d = Vector3::from(d);
            let farthest = vertices.iter().flat_map(|v| {
                let p = shape.turn * Vector3::from(*v);
                [-turn, turn].map(|angle| d.dot(&(p + Vector3::z().cross(&p) * angle)))
            });
            let shifts: f64 = along.iter().map(|v| (v[0] * d.x + v[1] * d.y).abs()).sum();
            let expected = farthest.fold(f64::NEG_INFINITY, f64::max) + shifts + disc * real::hypot(d.x, d.y) + ball * d.norm();
            prop_assert!((shape.reach(&d) - expected).abs() < 1e-12);
            prop_assert!((d.dot(&shape.support(&d)) - expected).abs() < 1e-12, "the point there");
        }

        #[test]
        fn how_far_a_shape_reaches_grows_with_the_vector(convex in any_convex(), pose in any_pose(), scale in 0.1..10.0f64) {
            let (shape, d) = (posed(&convex, &pose), Vector3::new(0.3, -0.4, 0.5));
            prop_assert!((shape.reach(&(d * scale)) - scale * shape.reach(&d)).abs() < 1e-12);
            prop_assert!((d.dot(&shape.support(&d)) - shape.reach(&d)).abs() < 1e-12);
        }
    }

    #[test]
    fn the_depth_is_the_shortest_way_out() {
        let obstacle = Aabb { min: [0.0; 3], max: [1.0; 3] };
        for (convex, depth) in [
            (Convex::Box { half: [0.2, 0.3, 0.3] }, 0.3),
            (Convex::Sphere { radius: 0.3 }, 0.4),
            (Convex::Cylinder { radius: 0.2, half_length: 0.4 }, 0.3),
        ] {
            let shape = posed(&convex, &Isometry3::translation(0.1, 0.5, 0.5));
            assert!((shape.depth(&obstacle) - depth).abs() < 1e-12, "{convex:?} {}", shape.depth(&obstacle));
        }
    }

    #[test]
    fn a_shape_inside_a_box_and_a_box_inside_a_shape_meet() {
        let large = Aabb { min: [-5.0; 3], max: [5.0; 3] };
        let small = Aabb { min: [0.01; 3], max: [0.02; 3] };
        for convex in [
            Convex::Box { half: [0.3; 3] },
            Convex::Sphere { radius: 0.3 },
            Convex::Cylinder { radius: 0.3, half_length: 0.2 },
        ] {
            let shape = posed(&convex, &Isometry3::rotation(Vector3::new(0.3, 0.2, 0.1)));
            assert_eq!(shape.separation(&large).upper, 0.0);
            assert_eq!(shape.separation(&small).upper, 0.0);
        }
    }

    #[test]
    fn parallel_faces_and_corners_have_the_distance_of_the_closed_form() {
        let obstacle = Aabb { min: [1.0, -1.0, -1.0], max: [2.0, 1.0, 1.0] };
        let cases = [
            (Convex::Box { half: [0.5; 3] }, [0.0, 0.0, 0.0], 0.5),
            (Convex::Box { half: [0.5; 3] }, [0.0, 2.0, 2.0], (0.25 + 0.25 + 0.25f64).sqrt()),
            (Convex::Cylinder { radius: 0.5, half_length: 0.1 }, [0.0, 0.0, 0.0], 0.5),
            (Convex::Cylinder { radius: 0.5, half_length: 0.1 }, [1.5, 0.0, 1.4], 0.3),
            (Convex::Sphere { radius: 0.2 }, [0.0, 2.0, 2.0], 3.0f64.sqrt() - 0.2),
        ];
        for (convex, centre, expected) in cases {
            let shape = posed(&convex, &Isometry3::translation(centre[0], centre[1], centre[2]));
            let found = shape.separation(&obstacle);
            let lower = shape.slab(&found.normal.unwrap(), &obstacle);
            assert!((found.upper - expected).abs() < 1e-7 && (lower - expected).abs() < 1e-7, "{convex:?} {found:?}");
        }
    }

    #[test]
    fn the_bounding_box_holds_the_shape_tightly() {
        let convex =
            Convex::Hull { vertices: vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 3.0]] };
        let bounds = posed(&convex, &Isometry3::translation(10.0, 0.0, 0.0)).bounds();
        assert_eq!((bounds.min, bounds.max), ([10.0, 0.0, 0.0], [11.0, 2.0, 3.0]));
    }
}
