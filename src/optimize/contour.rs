//! Contour points of every collision shape, in a tree that dismisses whole patches by one look-up of the distance field.
//!
//! The field is 1-Lipschitz: where it exceeds `clearance + r + slack` at the centre of a ball of radius r, every point in
//! that ball is clear. `slack` covers what interpolation may do to the bound.
//!
//! Upright boxes and cylinders of the base never change their height, so upright lines cover them: the least distance along a line
//! is 1-Lipschitz in x and y. What such a shape has drawn in over its rim, a table leg say, is far from all points of the rim again:
//! balls inside the shape see it as deep as they are wide, and never ask for more than the rim does.

mod surface;
mod upright;

use nalgebra::Point3;

use crate::robot::{Convex, RobotModel};
use surface::surface_points;
use upright::Upright;

/// Points in a leaf of the tree.
const LEAF: usize = 4;

/// A contour point, or for `radius > 0` a ball, or for `rise > 0` an upright line; fixed to a body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContourPoint {
    /// In the body's frame, m; of a line the lower end.
    pub at: Point3<f64>,
    /// To take off the distance, m.
    pub radius: f64,
    /// How far a line reaches up, m. Only on the base.
    pub rise: f64,
    /// How many points it stands for.
    pub weight: f64,
}

impl ContourPoint {
    fn plain(at: Point3<f64>) -> Self {
        Self { at, radius: 0.0, rise: 0.0, weight: 1.0 }
    }
}

/// A node of the tree: a ball that holds a range of points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch {
    /// Of the ball, in the body's frame, m.
    pub centre: Point3<f64>,
    /// Of the ball, with the points' own radii, m.
    pub radius: f64,
    /// Of its lines, m: all begin and end at the same heights.
    pub rise: f64,
    /// Its points are `points[first..last]`.
    pub first: usize,
    /// See `first`.
    pub last: usize,
    /// The node to go on with where this one is dismissed; children follow their parent.
    pub skip_to: usize,
    /// Has no children: look at its points.
    pub leaf: bool,
}

/// All patches of one shape.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeContour {
    /// Index into the robot's bodies.
    pub body: usize,
    /// In depth-first order; the first holds the whole shape.
    pub patches: Vec<Patch>,
}

/// How far a shape's points move at most, whatever the posture, for every radian that the base or a joint turns.
#[derive(Debug, Clone, PartialEq)]
pub struct Reach {
    /// m per radian of heading.
    pub radius: f64,
    /// Per joint, m per radian or metre.
    pub joints: Vec<f64>,
}

impl Reach {
    /// From the chain of bodies: no point is further from a joint than all links between them laid end to end.
    pub fn of(robot: &RobotModel, shape: &ShapeContour) -> Self {
        let radius = shape.patches.first().map_or(0.0, |p| p.centre.coords.norm() + p.radius);
        let mut reach = Self::within(robot, shape.body, 0, radius);
        reach.radius += robot.bodies[0].origin.translation.vector.norm();
        reach
    }

    /// The same against the frame of a body further down the chain, of what is within `radius` (m) of its own body's origin.
    pub(crate) fn within(robot: &RobotModel, body: usize, base: usize, mut radius: f64) -> Self {
        let mut joints = vec![0.0; robot.joints.len()];
        let mut at = body;
        while at != base {
            let body = &robot.bodies[at];
            if let Some(motion) = &body.motion {
                let joint = &robot.joints[motion.joint];
                joints[motion.joint] += motion.multiplier.abs() * if motion.prismatic { 1.0 } else { radius };
                if motion.prismatic {
                    let slide = |q: f64| (motion.multiplier * q + motion.offset).abs();
                    // A joint may overstep its limits a little on the way.
                    radius += 1.1 * slide(joint.lower).max(slide(joint.upper)) + 0.1;
                }
            }
            radius += body.origin.translation.vector.norm();
            at = body.parent;
        }
        Self { radius, joints }
    }
}

/// Contour points of the robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Contour {
    /// One entry a collision shape, and after them the insides of some.
    pub shapes: Vec<ShapeContour>,
    /// All points; patches name ranges.
    pub points: Vec<ContourPoint>,
}

impl Contour {
    /// Samples every shape: edges and rims at `spacing` (m), the inside of faces at twice that. What lies in a box of the same
    /// body is left out: the box is hit first.
    pub fn new(robot: &RobotModel, spacing: f64) -> Self {
        let mut contour = Self { shapes: Vec::new(), points: Vec::new() };
        let mut inside = Vec::new();
        for (index, shape) in robot.shapes.iter().enumerate() {
            let upright = if shape.body == 0 { Upright::new(robot, shape) } else { None };
            let Some(upright) = upright else {
                let mut points = surface_points(&shape.convex, &shape.pose, spacing);
                points.retain(|p| !covered(robot, index, p));
                contour.add(shape.body, points);
                continue;
            };
            contour.add(shape.body, upright.lines(spacing));
            inside.push(upright.inside(spacing));
        }
        inside.into_iter().filter(|balls| !balls.is_empty()).for_each(|balls| contour.add(0, balls));
        contour
    }

    fn add(&mut self, body: usize, mut points: Vec<ContourPoint>) {
        let mut patches = Vec::new();
        if !points.is_empty() {
            split(&mut points, self.points.len(), &mut patches);
        }
        self.points.extend(points);
        self.shapes.push(ShapeContour { body, patches });
    }
}

/// Whether a point of a shape lies in a box of the same body, or on it.
fn covered(robot: &RobotModel, own: usize, point: &ContourPoint) -> bool {
    robot.shapes.iter().enumerate().any(|(index, shape)| {
        let Convex::Box { half } = &shape.convex else { return false };
        let inside = || {
            let at = shape.pose.inverse_transform_point(&point.at);
            // A point that two boxes share belongs to the first.
            let slack = if index < own { 1e-9 } else { -1e-9 };
            (0..3).all(|k| at[k].abs() + point.radius <= half[k] + slack)
        };
        index != own && shape.body == robot.shapes[own].body && inside()
    })
}

/// Builds the tree over `points`, which it reorders; `offset` is where they will lie among all points.
fn split(points: &mut [ContourPoint], offset: usize, patches: &mut Vec<Patch>) {
    let (mut low, mut high) = (Point3::from([f64::INFINITY; 3]), Point3::from([f64::NEG_INFINITY; 3]));
    for p in points.iter() {
        low = low.inf(&p.at);
        high = high.sup(&p.at);
    }
    let centre = nalgebra::center(&low, &high);
    let radius = points.iter().map(|p| (p.at - centre).norm() + p.radius).fold(0.0, f64::max);
    let leaf = points.len() <= LEAF;
    let rise = points[0].rise;
    let own = patches.len();
    patches.push(Patch { centre, radius, rise, first: offset, last: offset + points.len(), skip_to: 0, leaf });
    if !leaf {
        let axis = (high - low).imax();
        points.sort_by(|a, b| a.at[axis].total_cmp(&b.at[axis]));
        let (one, two) = points.split_at_mut(points.len() / 2);
        split(one, offset, patches);
        split(two, offset + one.len(), patches);
    }
    patches[own].skip_to = patches.len();
}

#[cfg(test)]
mod tests {
    use super::surface::{box_points, cylinder_points, directions, hull_points};
    use super::*;
    use crate::math::real;
    use crate::robot::Shape;
    use nalgebra::Isometry3;

    fn nearest(points: &[[f64; 3]], p: [f64; 3]) -> f64 {
        points
            .iter()
            .map(|q| (0..3).map(|k| real::powi(p[k] - q[k], 2)).sum::<f64>().sqrt())
            .fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn every_point_of_a_box_edge_is_within_half_a_spacing_of_a_contour_point() {
        let half = [0.21, 0.18, 0.11];
        let points = box_points(&half, 0.05);
        for i in 0..=400 {
            let f = i as f64 / 200.0 - 1.0;
            for (y, z) in [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0)] {
                assert!(nearest(&points, [f * half[0], y * half[1], z * half[2]]) <= 0.025 + 1e-12);
                assert!(nearest(&points, [y * half[0], f * half[1], z * half[2]]) <= 0.025 + 1e-12);
                assert!(nearest(&points, [y * half[0], z * half[1], f * half[2]]) <= 0.025 + 1e-12);
            }
        }
        assert!(nearest(&points, [0.01, 0.02, half[2]]) < 0.09);
        assert!(points.iter().all(|p| (0..3).any(|a| (p[a].abs() - half[a]).abs() < 1e-12)));
    }

    #[test]
    fn every_point_of_a_cylinder_rim_is_near_a_contour_point() {
        let points = cylinder_points(0.08, 0.02, 0.05);
        for i in 0..360 {
            let (s, c) = real::sin_cos((i as f64).to_radians());
            for z in [-0.02, 0.02] {
                assert!(nearest(&points, [0.08 * c, 0.08 * s, z]) < 0.026);
            }
        }
    }

    #[test]
    fn a_cube_given_as_a_hull_has_its_edges_sampled_and_its_inside_not() {
        let corner = |i: usize| [0, 1, 2].map(|a| if i >> a & 1 == 1 { 0.2 } else { -0.2 });
        let vertices: Vec<_> = (0..8).map(corner).collect();
        let points = hull_points(&Convex::Hull { vertices: vertices.clone() }, &vertices, 0.05);
        for i in 0..=100 {
            let f = i as f64 / 250.0 - 0.2;
            assert!(nearest(&points, [f, 0.2, -0.2]) < 0.03, "{f}");
        }
        assert!(points.iter().all(|p| p.iter().any(|v| v.abs() > 0.15)));
    }

    #[test]
    fn every_patch_holds_its_points_and_leaves_hold_all() {
        let mut points: Vec<_> = box_points(&[0.3, 0.2, 0.1], 0.05)
            .into_iter()
            .map(|p| ContourPoint { radius: 0.01, ..ContourPoint::plain(p.into()) })
            .collect();
        let mut patches = Vec::new();
        split(&mut points, 0, &mut patches);
        let mut seen = 0;
        for patch in &patches {
            for p in &points[patch.first..patch.last] {
                assert!((p.at - patch.centre).norm() + p.radius <= patch.radius + 1e-12);
            }
            if patch.leaf {
                assert_eq!(patch.first, seen);
                seen = patch.last;
            }
        }
        assert_eq!(seen, points.len());
        assert_eq!(patches[0].skip_to, patches.len());
    }

    fn upright(half: [f64; 3]) -> Shape {
        let pose = Isometry3::translation(0.1, 0.2, 0.4);
        Shape { link: "base_link".into(), body: 0, pose, convex: Convex::Box { half } }
    }

    #[test]
    fn an_upright_box_or_cylinder_of_the_base_is_covered_by_lines_of_its_height() {
        let mut robot = crate::optimize::test_robot::robot(0);
        robot.bodies[0].origin = Isometry3::translation(0.0, 0.0, 0.05);
        let cylinder = Shape { convex: Convex::Cylinder { radius: 0.2, half_length: 0.3 }, ..upright([0.1; 3]) };
        for (shape, half_height) in [(upright([0.21, 0.17, 0.3]), 0.3), (cylinder, 0.3)] {
            let lines = Upright::new(&robot, &shape).expect("it stands upright").lines(0.05);
            let mut feet: Vec<[f64; 3]> = lines.iter().map(|p| p.at.into()).collect();
            for line in &lines {
                assert!((line.rise - 2.0 * half_height).abs() < 1e-12 && (line.at.z - 0.1).abs() < 1e-12);
            }
            // The rim is within half a spacing, the inside within twice that of a corner of a square.
            for k in 0..720 {
                let (s, c) = real::sin_cos((k as f64).to_radians());
                let (rim, within) = match shape.convex {
                    Convex::Cylinder { radius, .. } => ([radius * c, radius * s], [0.4 * radius * c, 0.4 * radius * s]),
                    _ => ([0.21, 0.17 * s], [0.15 * c, 0.12 * s]),
                };
                assert!(nearest(&feet, [0.1 + rim[0], 0.2 + rim[1], 0.1]) < 0.0251);
                assert!(nearest(&feet, [0.1 + within[0], 0.2 + within[1], 0.1]) < 0.0751);
            }
            let count = feet.len();
            feet.sort_by(|a, b| a.partial_cmp(b).expect("finite"));
            feet.dedup();
            assert_eq!(count, feet.len(), "each place once");
        }
        let mut tilted = upright([0.1; 3]);
        tilted.pose.rotation = nalgebra::UnitQuaternion::from_euler_angles(0.1, 0.0, 0.0);
        assert!(Upright::new(&robot, &tilted).is_none());
    }

    #[test]
    fn balls_fill_an_upright_shape_and_stay_inside_it() {
        let robot = crate::optimize::test_robot::robot(0);
        let cylinder = Shape { convex: Convex::Cylinder { radius: 0.4, half_length: 0.1 }, ..upright([0.1; 3]) };
        for shape in [upright([0.21, 0.17, 0.3]), upright([0.5, 0.3, 0.1]), cylinder] {
            let balls = Upright::new(&robot, &shape).expect("it stands upright").inside(0.05);
            let radius = balls[0].radius;
            let spine = |ball: &ContourPoint, p: Point3<f64>| {
                let up = (p.z - ball.at.z).clamp(0.0, ball.rise);
                (p - ball.at - nalgebra::Vector3::z() * up).norm()
            };
            let place = |u: f64, v: f64| {
                let at = match &shape.convex {
                    Convex::Cylinder { radius, .. } => [
                        radius * u * real::cos(std::f64::consts::PI * v),
                        radius * u * real::sin(std::f64::consts::PI * v),
                    ],
                    Convex::Box { half } => [u * half[0], v * half[1]],
                    other => panic!("{other:?}"),
                };
                shape.pose * Point3::new(at[0], at[1], 0.0)
            };
            for i in -20..=20 {
                for j in -20..=20 {
                    // On the middle of its height, but for what the rim's lines see.
                    let p = place(0.85 * f64::from(i) / 20.0, 0.85 * f64::from(j) / 20.0);
                    let nearest = balls.iter().map(|b| spine(b, p)).fold(f64::INFINITY, f64::min);
                    assert!(nearest <= radius + 0.01, "{p:?} is {nearest} m from all, {radius} m wide, of {shape:?}");
                }
            }
            for ball in &balls {
                for way in directions(50) {
                    for end in [0.0, ball.rise] {
                        let p = ball.at + nalgebra::Vector3::z() * end + way * radius;
                        let q = shape.pose.inverse_transform_point(&p);
                        let inside = match &shape.convex {
                            Convex::Cylinder { radius, half_length } => {
                                real::hypot(q.x, q.y).max(q.z.abs() + radius - half_length) <= radius + 1e-9
                            }
                            Convex::Box { half } => (0..3).all(|k| q[k].abs() <= half[k] + 1e-9),
                            other => panic!("{other:?}"),
                        };
                        assert!(inside, "{q:?}");
                    }
                }
            }
        }
        let flat = upright([0.3, 0.2, 0.02]);
        assert!(Upright::new(&robot, &flat).expect("upright").inside(0.05).is_empty());
    }

    #[test]
    fn what_a_box_of_the_same_body_covers_needs_no_points_of_its_own() {
        let mut robot = crate::optimize::test_robot::robot(0);
        let wheels =
            |robot: &RobotModel| Contour::new(robot, 0.05).shapes[1].patches.first().map_or(0, |p| p.last - p.first);
        let all = wheels(&robot);
        // The base's box hides the upper part of the wheels, which reach down to the floor.
        let whole = surface_points(&robot.shapes[1].convex, &robot.shapes[1].pose, 0.05).len();
        assert!(all > 0 && all < whole, "{all} of {whole}");
        robot.shapes[0].convex = Convex::Box { half: [0.5, 0.5, 0.5] };
        assert_eq!(wheels(&robot), 0);
        // Two boxes in the same place do not hide one another.
        robot.shapes = vec![upright([0.1; 3]), upright([0.1; 3])];
        robot.shapes[0].pose.rotation = nalgebra::UnitQuaternion::from_euler_angles(0.1, 0.0, 0.0);
        robot.shapes[1].pose = robot.shapes[0].pose;
        let contour = Contour::new(&robot, 0.05);
        assert!(contour.shapes.iter().any(|shape| !shape.patches.is_empty()));
    }
}
