//! How far the robot reaches: at a posture, and over all postures as proven upper bounds.
//!
//! Bounds over postures are by branch and bound on boxes of joint values: at a box's centre the figure is computed, and no joint
//! changes it faster than the distance of the farthest point from that joint's axis. Those distances are bounded the same way, from
//! the tip of the chain to its base, so every step rests on a proven one.

use std::f64::consts::PI;

use nalgebra::{Isometry3, Rotation3, UnitQuaternion, Vector3};

use super::bound::upper_bound;
use super::{Convex, RobotModel};
use crate::geom::Aabb;
use crate::math::real;

/// Added to every bound for rounding, m.
const ROUNDING: f64 = 1e-9;
/// Sides of the polygon that stands in for a cylinder's circle (circumscribed: 0.12 % too large).
const SIDES: usize = 64;

/// How fast a shape's points can move, whatever the posture: no point is faster than
/// `|v| + radius |omega| + sum over joints of joints[i] |rate i|` for base twists `v` (m/s), `omega` (rad/s).
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeReach {
    /// Upper bound of the horizontal distance of any point from the base's vertical axis, m.
    pub radius: f64,
    /// One per moving joint, m/rad (or m/m): upper bound of the distance of any point from the axis times |multiplier|, summed over
    /// all joints that follow it (mimics); 0 where the joint does not move the shape.
    pub joints: Vec<f64>,
}

/// Points whose hull holds the shape, and a radius about each: exact but for cylinders.
struct Outer {
    points: Vec<Vector3<f64>>,
    radius: f64,
}

impl Outer {
    fn of(convex: &Convex) -> Self {
        let signs = [-1.0, 1.0];
        let (points, radius) = match convex {
            Convex::Box { half: [x, y, z] } => {
                let corner = |i: usize| Vector3::new(signs[i & 1] * x, signs[i >> 1 & 1] * y, signs[i >> 2] * z);
                ((0..8).map(corner).collect(), 0.0)
            }
            Convex::Cylinder { radius, half_length } => {
                let outer = radius / real::cos(PI / SIDES as f64);
                let rim = |i: usize| {
                    let (sin, cos) = real::sin_cos(2.0 * PI * (i / 2) as f64 / SIDES as f64);
                    Vector3::new(outer * cos, outer * sin, signs[i & 1] * half_length)
                };
                ((0..2 * SIDES).map(rim).collect(), 0.0)
            }
            Convex::Sphere { radius } => (vec![Vector3::zeros()], *radius),
            Convex::Hull { vertices } => (vertices.iter().map(|v| Vector3::from(*v)).collect(), 0.0),
        };
        Self { points, radius }
    }

    /// Largest distance from the z axis of a frame, the shape being at `pose` in it.
    fn distance_from_z(&self, pose: &Isometry3<f64>) -> f64 {
        let turn = pose.rotation.to_rotation_matrix();
        let flat = |p: &Vector3<f64>| {
            let p = turn * p + pose.translation.vector;
            p.x * p.x + p.y * p.y
        };
        self.points.iter().map(flat).fold(0.0, f64::max).sqrt() + self.radius
    }
}

/// The bodies between the base and a shape, and what is proven about them.
struct Chain<'a> {
    robot: &'a RobotModel,
    /// From the first moving body to the shape's.
    bodies: Vec<usize>,
    shape: usize,
    outer: Outer,
    ranges: Vec<[f64; 2]>,
    /// For each of `bodies`: greatest distance of the shape's points from its axis (1 if it slides), times |multiplier|.
    arms: Vec<f64>,
}

impl<'a> Chain<'a> {
    fn new(robot: &'a RobotModel, shape: usize) -> Self {
        let mut bodies = Vec::new();
        let mut body = robot.shapes[shape].body;
        while body != 0 {
            bodies.push(body);
            body = robot.bodies[body].parent;
        }
        bodies.reverse();
        let outer = Outer::of(&robot.shapes[shape].convex);
        let mut chain =
            Self { robot, shape, outer, ranges: robot.effective_ranges(), arms: vec![0.0; bodies.len()], bodies };
        chain.prove_arms();
        chain
    }

    /// frame of body `bodies[from - 1]` (or base) <- shape.
    fn pose(&self, from: usize, q: &[f64]) -> Isometry3<f64> {
        let mut pose = if from == 0 { self.robot.bodies[0].origin } else { Isometry3::identity() };
        for body in &self.bodies[from..] {
            pose *= self.robot.bodies[*body].pose_in_parent(q);
        }
        pose * self.robot.shapes[self.shape].pose
    }

    /// Slopes by joint of anything that moves no faster than the shape's points, for the bodies from `from` on.
    fn slopes(&self, from: usize) -> Vec<f64> {
        let mut slopes = vec![0.0; self.robot.joints.len()];
        for (body, arm) in self.bodies.iter().zip(&self.arms).skip(from) {
            if let Some(motion) = &self.robot.bodies[*body].motion {
                slopes[motion.joint] += arm;
            }
        }
        slopes
    }

    /// From the tip to the base.
    fn prove_arms(&mut self) {
        // Radius of a ball about the body's origin that holds the shape, however the bodies beyond are moved.
        let mut ball = self.robot.shapes[self.shape].pose.translation.vector.norm()
            + self.outer.points.iter().map(Vector3::norm).fold(0.0, f64::max)
            + self.outer.radius;
        for i in (0..self.bodies.len()).rev() {
            let body = &self.robot.bodies[self.bodies[i]];
            let Some(motion) = &body.motion else { continue };
            let factor = motion.multiplier.abs();
            self.arms[i] = if motion.prismatic {
                let [low, high] = self.ranges[motion.joint].map(|q| (motion.multiplier * q + motion.offset).abs());
                ball += low.max(high);
                factor
            } else {
                // Distance from the joint's axis is distance from the z axis once the axis is turned onto it.
                let upright = UnitQuaternion::rotation_between(&motion.axis, &Vector3::z()).unwrap_or_else(|| {
                    UnitQuaternion::from_rotation_matrix(&Rotation3::from_axis_angle(&Vector3::x_axis(), PI))
                });
                let distance = |q: &[f64]| self.outer.distance_from_z(&(upright * self.pose(i + 1, q)));
                let bound = upper_bound(&self.ranges, &self.slopes(i + 1), f64::NEG_INFINITY, distance);
                factor * (bound.min(ball) + ROUNDING)
            };
            ball += body.origin.translation.vector.norm();
        }
    }

    /// Slopes of the height (or of the horizontal distance) in the base frame: where a joint's tilt never changes, a slide lifts (or
    /// shifts) by its axis' share only, and a hinge lifts by its axis' horizontal share.
    fn base_slopes(&self, height: bool) -> Vec<f64> {
        let mut slopes = vec![0.0; self.robot.joints.len()];
        let mut pose = self.robot.bodies[0].origin;
        let mut tilt_known = true;
        let q: Vec<f64> = self.ranges.iter().map(|r| 0f64.max(r[0]).min(r[1])).collect();
        for (body, arm) in self.bodies.iter().zip(&self.arms) {
            let body = &self.robot.bodies[*body];
            pose *= body.pose_in_parent(&q);
            let Some(motion) = &body.motion else { continue };
            let axis = pose.rotation * motion.axis.into_inner();
            let (flat, upright) = (real::hypot(axis.x, axis.y), axis.z.abs());
            let share = match (motion.prismatic, height) {
                _ if !tilt_known => 1.0,
                (true, true) => upright,
                (false, false) => 1.0,
                _ => flat,
            };
            slopes[motion.joint] += arm * (share + ROUNDING).min(1.0);
            tilt_known &= motion.prismatic || flat < ROUNDING;
        }
        slopes
    }
}

/// The greatest z of a shape at a pose.
fn top(convex: &Convex, pose: &Isometry3<f64>) -> f64 {
    along(convex, pose, &Vector3::z())
}

/// How far a shape at a pose reaches along `direction`.
fn along(convex: &Convex, pose: &Isometry3<f64>, direction: &Vector3<f64>) -> f64 {
    let local = pose.rotation.inverse() * direction;
    pose.translation.vector.dot(direction) + convex.support(&local).dot(&local)
}

/// Greatest horizontal distance of a shape at a pose from the z axis.
fn horizontal(convex: &Convex, pose: &Isometry3<f64>) -> f64 {
    let Convex::Cylinder { .. } = convex else {
        return Outer::of(convex).distance_from_z(pose);
    };
    // Distance is convex, so stepping to the farthest point in the present direction only ever gains; start from the best of many.
    let step = |direction: Vector3<f64>| {
        let p = pose.translation.vector + pose.rotation * convex.support(&(pose.rotation.inverse() * direction));
        Vector3::new(p.x, p.y, 0.0)
    };
    let around = (0..SIDES).map(|i| real::sin_cos(2.0 * PI * i as f64 / SIDES as f64));
    let mut best = around
        .map(|(sin, cos)| step(Vector3::new(cos, sin, 0.0)))
        .fold(Vector3::zeros(), |a, b| if b.norm_squared() > a.norm_squared() { b } else { a });
    for _ in 0..50 {
        best = step(best);
    }
    best.norm()
}

impl RobotModel {
    /// Number of moving joints: length of a posture.
    pub fn joint_count(&self) -> usize {
        self.joints.len()
    }

    /// Brings each joint value into its limits.
    pub fn clamp(&self, q: &mut [f64]) {
        for (value, joint) in q.iter_mut().zip(&self.joints) {
            *value = value.max(joint.lower).min(joint.upper);
        }
    }

    /// The robot's bounding box in the base frame at a posture.
    pub fn extents(&self, q: &[f64]) -> Aabb {
        let mut out = Aabb { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };
        for (shape, pose) in self.shapes.iter().zip(self.shape_poses(q)) {
            for axis in 0..3 {
                let mut direction = Vector3::zeros();
                direction[axis] = 1.0;
                out.max[axis] = out.max[axis].max(along(&shape.convex, &pose, &direction));
                out.min[axis] = out.min[axis].min(-along(&shape.convex, &pose, &-direction));
            }
        }
        out
    }

    /// Largest horizontal distance of the robot's points from the base's vertical axis at a posture, m.
    pub fn radius(&self, q: &[f64]) -> f64 {
        self.shapes.iter().zip(self.shape_poses(q)).map(|(s, pose)| horizontal(&s.convex, &pose)).fold(0.0, f64::max)
    }

    /// Upper bound of the robot's height over all postures, m: within half a millimetre where each shape is moved by one or two
    /// joints, looser for long chains.
    pub fn top_over_all_postures(&self) -> f64 {
        let mut highest = f64::NEG_INFINITY;
        for shape in 0..self.shapes.len() {
            let chain = Chain::new(self, shape);
            let convex = &self.shapes[shape].convex;
            let bound =
                upper_bound(&chain.ranges, &chain.base_slopes(true), highest, |q| top(convex, &chain.pose(0, q)));
            let bound = if bound.is_finite() { bound } else { self.ball(&chain) };
            highest = highest.max(bound + ROUNDING);
        }
        highest
    }

    /// Bounds of a shape's motion over all postures; some milliseconds for long chains, so ask once a shape.
    pub fn reach(&self, shape: usize) -> ShapeReach {
        let chain = Chain::new(self, shape);
        let joints = chain.slopes(0);
        let bound = upper_bound(&chain.ranges, &chain.base_slopes(false), f64::NEG_INFINITY, |q| {
            chain.outer.distance_from_z(&chain.pose(0, q))
        });
        let radius = if bound.is_finite() { bound } else { self.ball(&chain) };
        ShapeReach { radius: radius + ROUNDING, joints }
    }

    /// A radius about the base's origin that the shape never leaves; for endless joints that no period bounds.
    fn ball(&self, chain: &Chain) -> f64 {
        let shape = &self.shapes[chain.shape];
        let mut radius = shape.pose.translation.vector.norm() + 2.0 * shape.convex.bounding_radius();
        for body in &chain.bodies {
            let body = &self.bodies[*body];
            radius += body.origin.translation.vector.norm();
            if let Some(motion) = body.motion.as_ref().filter(|m| m.prismatic) {
                let ends = chain.ranges[motion.joint].map(|q| (motion.multiplier * q + motion.offset).abs());
                radius += ends[0].max(ends[1]);
            }
        }
        radius + self.bodies[0].origin.translation.vector.norm()
    }

    /// Ranges that hold every distinct posture: one turn of an endless joint will do where all that follows it has whole multipliers.
    fn effective_ranges(&self) -> Vec<[f64; 2]> {
        let whole = |index: usize| {
            let mut followers = self.bodies.iter().filter_map(|b| b.motion.as_ref()).filter(|m| m.joint == index);
            followers.all(|m| !m.prismatic && m.multiplier.fract() == 0.0)
        };
        let range = |(index, joint): (usize, &super::MovingJoint)| {
            let turns = joint.upper - joint.lower;
            if turns > 2.0 * PI && whole(index) {
                let low = if joint.lower.is_finite() { joint.lower } else { joint.upper.min(PI) - 2.0 * PI };
                [low, low + 2.0 * PI]
            } else {
                [joint.lower, joint.upper]
            }
        };
        self.joints.iter().enumerate().map(range).collect()
    }
}
