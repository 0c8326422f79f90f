//! A robot and distance fields in closed form, for tests.

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};

use super::penalty::field::DistanceField;
use crate::math::real;
use crate::robot::{
    BaseLimits, Body, BodyMotion, Convex, IgnoreReason, IgnoredPair, MotionLimits, MovingJoint, RobotModel, Shape,
};

/// Balls: centre and radius. Distance to the nearest, its kinks rounded off by a log-sum: smooth and 1-Lipschitz.
pub struct Balls(pub Vec<([f64; 3], f64)>);

/// Sharpness of the rounding, 1/m.
const SHARPNESS: f64 = 8.0;

impl DistanceField for Balls {
    fn distance(&self, p: [f64; 3]) -> f64 {
        self.distance_gradient(p).0
    }
    fn distance_gradient(&self, p: [f64; 3]) -> (f64, [f64; 3]) {
        let (sum, gradient) = self.shares(p);
        (-real::ln(sum) / SHARPNESS, gradient.map(|g| g / sum))
    }
    fn cell(&self) -> f64 {
        0.0
    }
    /// As smooth as the distance: the heights are rounded off like the balls.
    fn least_above(&self, foot: [f64; 3], rise: f64) -> (f64, [f64; 3]) {
        let (mut sum, mut gradient) = (0.0, [0.0; 3]);
        for k in 0..=8 {
            let (own, [x, y, _]) = self.shares([foot[0], foot[1], foot[2] + rise * k as f64 / 8.0]);
            sum += own;
            gradient[0] += x;
            gradient[1] += y;
        }
        (-real::ln(sum) / SHARPNESS, gradient.map(|g| g / sum))
    }
}

impl Balls {
    /// What the balls add up to at a point, and each one's share times its direction.
    fn shares(&self, p: [f64; 3]) -> (f64, [f64; 3]) {
        let (mut sum, mut gradient) = (0.0, [0.0; 3]);
        for (centre, radius) in &self.0 {
            let d: [f64; 3] = std::array::from_fn(|k| p[k] - centre[k]);
            let norm = d.iter().map(|v| v * v).sum::<f64>().sqrt().max(1e-9);
            let share = real::exp(-SHARPNESS * (norm - radius));
            sum += share;
            (0..3).for_each(|k| gradient[k] += share * d[k] / norm);
        }
        (sum, gradient)
    }
}

/// Axis-aligned boxes: lower and upper corner. Exact distance outside, largest face distance inside.
pub struct Boxes(pub Vec<([f64; 3], [f64; 3])>);

impl DistanceField for Boxes {
    fn distance(&self, p: [f64; 3]) -> f64 {
        self.distance_gradient(p).0
    }
    fn distance_gradient(&self, p: [f64; 3]) -> (f64, [f64; 3]) {
        let mut best = (1e3, [0.0; 3]);
        for (low, high) in &self.0 {
            let over: [f64; 3] = std::array::from_fn(|k| (low[k] - p[k]).max(p[k] - high[k]));
            let sign: [f64; 3] = std::array::from_fn(|k| if low[k] - p[k] > p[k] - high[k] { -1.0 } else { 1.0 });
            let outside = over.map(|o| o.max(0.0));
            let norm = outside.iter().map(|o| o * o).sum::<f64>().sqrt();
            let found = if norm > 0.0 {
                (norm, std::array::from_fn(|k| sign[k] * outside[k] / norm))
            } else {
                let axis = (0..3).max_by(|a, b| over[*a].total_cmp(&over[*b])).unwrap_or(0);
                (over[axis], std::array::from_fn(|k| if k == axis { sign[k] } else { 0.0 }))
            };
            if found.0 < best.0 {
                best = found;
            }
        }
        best
    }
    fn cell(&self) -> f64 {
        0.0
    }
}

/// Like scr_db: a base box, two wheels, and for joint 0 two blades (one a mimic) on tilted axes at its top; joint 1 is a
/// mast that slides up, with a ball on it. Its links are not checked against each other.
pub fn robot(joints: usize) -> RobotModel {
    let mut bodies = vec![Body { link: "base_link".into(), parent: 0, origin: Isometry3::identity(), motion: None }];
    let place = |x: f64, y: f64, z: f64| Isometry3::translation(x, y, z);
    let mut shapes = vec![Shape {
        link: "base_link".into(),
        body: 0,
        pose: place(-0.09, 0.0, 0.14),
        convex: Convex::Box { half: [0.21, 0.18, 0.11] },
    }];
    for y in [0.16, -0.16] {
        shapes.push(Shape {
            link: "wheel".into(),
            body: 0,
            pose: Isometry3::from_parts(
                Translation3::new(0.0, y, 0.08),
                UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2),
            ),
            convex: Convex::Cylinder { radius: 0.08, half_length: 0.02 },
        });
    }
    let limits = |speed: f64, acceleration: f64| MotionLimits {
        speed: Some(speed),
        acceleration: Some(acceleration),
        jerk: Some(10.0),
    };
    let mut moving = Vec::new();
    if joints > 0 {
        let joint = |name: &str, prismatic, lower, upper| MovingJoint {
            name: name.into(),
            prismatic,
            lower,
            upper,
            limits: limits(1.0, 2.0),
        };
        moving.push(joint("blade", false, 0.0, std::f64::consts::PI));
        for side in [1.0, -1.0] {
            let axis = Unit::new_normalize(Vector3::new(0.0, side, 1.0));
            bodies.push(Body {
                link: "blade".into(),
                parent: 0,
                origin: place(0.0, 0.1 * side, 0.27),
                motion: Some(BodyMotion { joint: 0, multiplier: -side, offset: 0.0, axis, prismatic: false }),
            });
            shapes.push(Shape {
                link: "blade".into(),
                body: bodies.len() - 1,
                pose: place(0.0, 0.0, 0.18),
                convex: Convex::Box { half: [0.05, 0.01, 0.18] },
            });
        }
        if joints > 1 {
            moving.push(joint("mast", true, -0.5, 0.5));
            bodies.push(Body {
                link: "mast".into(),
                parent: 1,
                origin: place(0.0, 0.0, 0.36),
                motion: Some(BodyMotion {
                    joint: 1,
                    multiplier: 0.5,
                    offset: 0.1,
                    axis: Vector3::z_axis(),
                    prismatic: true,
                }),
            });
            shapes.push(Shape {
                link: "mast".into(),
                body: bodies.len() - 1,
                pose: place(0.0, 0.02, 0.0),
                convex: Convex::Sphere { radius: 0.05 },
            });
        }
    }
    RobotModel {
        name: "test".into(),
        wheel_radii: 0.08.into(),
        track_width: 0.32,
        root_link: "base_link".into(),
        base_from_root: Isometry3::identity(),
        joints: moving,
        bodies,
        shapes,
        wheel: limits(0.5, 0.5),
        base: BaseLimits {
            speed: 0.5,
            acceleration: 0.5,
            angular_speed: 2.0 * 0.4 * 0.5 / 0.32,
            angular_acceleration: 1.5,
            eta: 0.4,
            min_speed: 0.01,
        },
        ignore_pairs: ignored(&[
            ["base_link", "blade"],
            ["wheel", "blade"],
            ["base_link", "mast"],
            ["wheel", "mast"],
            ["blade", "mast"],
        ]),
        tolerance: None,
        links: Vec::new(),
    }
}

fn ignored(pairs: &[[&str; 2]]) -> Vec<IgnoredPair> {
    let of = |links: &[&str; 2]| IgnoredPair { links: links.map(str::to_string), reason: IgnoreReason::Joined };
    pairs.iter().map(of).collect()
}

/// A round base with an arm of so many links, which turn about z and y by turns: rods, beams and balls. All but neighbours must keep
/// apart.
pub fn arm(joints: usize) -> RobotModel {
    let mut arm = robot(0);
    let convex = Convex::Cylinder { radius: 0.3, half_length: 0.1 };
    arm.shapes =
        vec![Shape { link: "base_link".into(), body: 0, pose: Isometry3::translation(0.0, 0.0, 0.15), convex }];
    arm.ignore_pairs = ignored(&[["base_link", "link0"]]);
    for joint in 0..joints {
        let limits = MotionLimits { speed: Some(1.0), acceleration: Some(2.0), jerk: Some(10.0) };
        let name = format!("link{joint}");
        arm.joints.push(MovingJoint { name: name.clone(), prismatic: false, lower: -2.6, upper: 2.6, limits });
        let axis = if joint % 2 == 0 { Vector3::z_axis() } else { Vector3::y_axis() };
        let origin = Isometry3::translation(0.0, 0.0, if joint == 0 { 0.3 } else { 0.2 });
        let motion = BodyMotion { joint, multiplier: 1.0, offset: 0.0, axis, prismatic: false };
        arm.bodies.push(Body { link: name.clone(), parent: joint, origin, motion: Some(motion) });
        let convex = match joint % 3 {
            0 => Convex::Cylinder { radius: 0.04, half_length: 0.09 },
            1 => Convex::Box { half: [0.04, 0.03, 0.09] },
            _ => Convex::Sphere { radius: 0.06 },
        };
        arm.shapes.push(Shape { link: name, body: joint + 1, pose: Isometry3::translation(0.0, 0.0, 0.1), convex });
        arm.ignore_pairs.extend(ignored(&[[&format!("link{joint}"), &format!("link{}", joint + 1)]]));
    }
    arm
}
