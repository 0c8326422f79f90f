//! Where the shapes are, how fast they move, and how far they can get from there: the bounds that turn an instant's distance
//! into a distance over an interval.
//!
//! While a row is held, the base has a constant twist and every joint a constant rate. A point p of the robot then obeys
//! `n . p(t + tau) <= n . p + tau n . p' + A tau^2 / 2` for any unit n, with A a bound on |p''| over the row. The first-order
//! term is linear in p, so its greatest value over a whole shape is that of a support function, not an estimate.

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::distance::{Posed, Spread};
use crate::geom::Pose2;
use crate::math::real;
use crate::robot::{Convex, RobotModel, Shape};

/// What the commands hold during a row.
#[derive(Debug, Clone, Copy)]
pub(super) struct Held<'a> {
    /// Of the base, m/s.
    pub(super) speed: f64,
    /// Of the base, rad/s.
    pub(super) turn_rate: f64,
    /// Of the moving joints, rad/s or m/s.
    pub(super) rates: &'a [f64],
}

/// A rigid body at an instant: its pose and velocity in the base frame (the base's own motion included).
#[derive(Debug, Clone, Copy)]
pub(super) struct Moving {
    turn: Matrix3<f64>,
    at: Vector3<f64>,
    /// rad/s.
    spin: Vector3<f64>,
    /// Of the body's point that is at the base frame's origin, m/s.
    drift: Vector3<f64>,
}

/// A shape at an instant, in the map frame.
#[derive(Debug, Clone, Copy)]
pub(super) struct MovingShape<'a> {
    /// Where it is.
    pub(super) posed: Posed<'a>,
    /// Velocity of its centre, m/s.
    velocity: Vector3<f64>,
    /// rad/s.
    spin: Vector3<f64>,
    /// A bound on the acceleration of its points while the row is held, m/s^2.
    acceleration: f64,
    /// Radius of the ball about the centre that holds the shape, m.
    pub(super) radius: f64,
    /// How fast the shape's spread changes at most, m/s.
    growth: f64,
}

impl MovingShape<'_> {
    /// No point gets farther than this from where it is within `half` seconds before or after, m.
    pub(super) fn motion(&self, half: f64) -> f64 {
        let fastest = self.velocity.norm() + self.spin.norm() * self.radius;
        half * (fastest + self.growth + 0.5 * half * self.acceleration)
    }

    /// How far the shape reaches along the unit vector `normal` from where its centre is now, at any instant up to `half`
    /// seconds before (first) and after (second); at least, in m.
    pub(super) fn reach(&self, normal: &Vector3<f64>, half: f64) -> [f64; 2] {
        let now = self.posed.reach(normal);
        [-half, half].map(|tau| self.reach_after(normal, tau).max(now))
    }

    /// A bound on how far the shape reaches along `normal`, from where its centre is now, `tau` seconds from now (before, if negative).
    /// Convex in `tau`.
    fn reach_after(&self, normal: &Vector3<f64>, tau: f64) -> f64 {
        let turned = normal + normal.cross(&self.spin) * tau;
        let reach = match &self.posed.spread {
            None => self.posed.own_reach(&turned),
            Some(spread) => {
                let [one, other] = spread.turned(normal).map(|d| self.posed.own_reach(&(d + turned - normal)));
                one.max(other) + spread.along(normal) + tau.abs() * self.growth
            }
        };
        tau * normal.dot(&self.velocity) + reach + 0.5 * tau * tau * self.acceleration
    }

    /// How fast the shape's centre moves, and how fast any point moves against the centre, within `half` seconds before or after, at most, m/s.
    pub(super) fn fastest(&self, half: f64) -> [f64; 2] {
        let gained = half * self.acceleration;
        [self.velocity.norm() + gained, self.spin.norm() * self.radius + 2.0 * gained]
    }

    /// Lets the shape's points be off: as far as `spread` says now, farther by `growth` (m/s) before and after.
    pub(super) fn loosen(&mut self, spread: Spread, growth: f64) {
        self.posed.spread = Some(spread);
        self.growth = growth;
    }

    /// How far this shape along the unit vector `normal`, and `other` against it, reach together from where their centres are now, at any
    /// instant up to `half` seconds before and after; at least, in m. What they move alike cancels.
    pub(super) fn reach_towards(&self, other: &MovingShape<'_>, normal: &Vector3<f64>, half: f64) -> f64 {
        let both = |tau: f64| self.reach_after(normal, tau) + other.reach_after(&-normal, tau);
        // A convex function is greatest at an end.
        both(-half).max(both(half))
    }
}

/// The robot's geometry prepared for evaluation.
#[derive(Debug)]
pub(super) struct Kinematics<'a> {
    robot: &'a RobotModel,
    bodies: Vec<(Matrix3<f64>, Vector3<f64>)>,
    shapes: Vec<ShapeFacts>,
}

#[derive(Debug)]
struct ShapeFacts {
    turn: Matrix3<f64>,
    at: Vector3<f64>,
    radius: f64,
    /// Greatest distance of a point from the axis of the body's own joint (body 0: from the base's vertical axis).
    lever: f64,
    /// Greatest distance of a point from the body's origin.
    reach: f64,
}

impl<'a> Kinematics<'a> {
    /// Prepares a robot.
    pub(super) fn new(robot: &'a RobotModel) -> Self {
        let matrix = |pose: &nalgebra::Isometry3<f64>| {
            (pose.rotation.to_rotation_matrix().into_inner(), pose.translation.vector)
        };
        let bodies: Vec<_> = robot.bodies.iter().map(|b| matrix(&b.origin)).collect();
        let shapes = robot.shapes.iter().map(|shape| {
            let (turn, at) = matrix(&shape.pose);
            let radius = shape.convex.bounding_radius();
            let (lever, reach) = match &robot.bodies[shape.body].motion {
                Some(motion) => (
                    greatest(shape, &turn, &at, |p| p.cross(&motion.axis).norm()),
                    greatest(shape, &turn, &at, |p| p.norm()),
                ),
                None => {
                    let (body_turn, body_at) = bodies[shape.body];
                    let planar = |p: Vector3<f64>| (body_turn * p + body_at).xy().norm();
                    (greatest(shape, &turn, &at, planar), greatest(shape, &turn, &at, |p| p.norm()))
                }
            };
            ShapeFacts { turn, at, radius, lever, reach }
        });
        let shapes = shapes.collect();
        Self { robot, bodies, shapes }
    }

    /// Poses and velocities of all bodies at joint values `joints`; `out` is cleared first.
    pub(super) fn bodies(&self, joints: &[f64], held: Held<'_>, out: &mut Vec<Moving>) {
        out.clear();
        for (body, (turn, at)) in self.robot.bodies.iter().zip(&self.bodies) {
            let Some(motion) = &body.motion else {
                let (spin, drift) = (Vector3::new(0.0, 0.0, held.turn_rate), Vector3::new(held.speed, 0.0, 0.0));
                out.push(Moving { turn: *turn, at: *at, spin, drift });
                continue;
            };
            let parent = out[body.parent];
            let value = motion.multiplier * joints[motion.joint] + motion.offset;
            let rate = motion.multiplier * held.rates[motion.joint];
            let mut moved = Moving {
                turn: parent.turn * turn,
                at: parent.turn * at + parent.at,
                spin: parent.spin,
                drift: parent.drift,
            };
            let axis = moved.turn * motion.axis.into_inner();
            if motion.prismatic {
                moved.at += axis * value;
                moved.drift += axis * rate;
            } else {
                moved.turn *= Rotation3::from_axis_angle(&motion.axis, value).into_inner();
                moved.spin += axis * rate;
                moved.drift -= axis.cross(&moved.at) * rate;
            }
            out.push(moved);
        }
    }

    /// A shape at the instant of `bodies`, with the base at `pose`.
    pub(super) fn shape(&self, shape: usize, bodies: &[Moving], pose: Pose2, acceleration: f64) -> MovingShape<'a> {
        let facts = &self.shapes[shape];
        let body = &bodies[self.robot.shapes[shape].body];
        let (sin, cos) = real::sin_cos(pose.yaw);
        let map = Matrix3::new(cos, -sin, 0.0, sin, cos, 0.0, 0.0, 0.0, 1.0);
        let centre = body.turn * facts.at + body.at;
        MovingShape {
            posed: Posed {
                convex: &self.robot.shapes[shape].convex,
                turn: map * body.turn * facts.turn,
                centre: map * centre + Vector3::new(pose.x, pose.y, 0.0),
                spread: None,
            },
            velocity: map * (body.drift + body.spin.cross(&centre)),
            spin: map * body.spin,
            acceleration,
            radius: facts.radius,
            growth: 0.0,
        }
    }

    /// A bound on |p''| of the points of a shape while a row is held, m/s^2. `extreme`: per joint, the greatest magnitude of
    /// its value during the row.
    ///
    /// From the leaf to the base: a frame that turns at a constant rate w about an axis at distance r adds
    /// `w^2 r` and `2 |w|` times the speed that the point already has in it.
    pub(super) fn acceleration(&self, shape: usize, held: Held<'_>, extreme: &[f64]) -> f64 {
        let facts = &self.shapes[shape];
        let (mut lever, mut reach) = (facts.lever, facts.reach);
        let (mut speed, mut acceleration) = (0.0, 0.0);
        let mut index = self.robot.shapes[shape].body;
        while let Some(motion) = &self.robot.bodies[index].motion {
            let rate = (motion.multiplier * held.rates[motion.joint]).abs();
            if motion.prismatic {
                speed += rate;
                reach += (motion.multiplier * extreme[motion.joint]).abs() + motion.offset.abs();
            } else {
                acceleration += rate * (2.0 * speed + rate * lever);
                speed += rate * lever;
            }
            reach += self.bodies[index].1.norm();
            lever = reach;
            index = self.robot.bodies[index].parent;
        }
        if index != self.robot.shapes[shape].body {
            lever = reach + self.bodies[index].1.norm();
        }
        let turn_rate = held.turn_rate.abs();
        acceleration + turn_rate * (held.speed.abs() + turn_rate * lever + 2.0 * speed)
    }

    /// A bound on the distance of any point of the robot from the base frame's origin, m. `extreme`: as in `acceleration`, over
    /// the whole motion.
    pub(super) fn size(&self, extreme: &[f64]) -> f64 {
        let bodies = self.robot.bodies.iter().map(|body| {
            let slide = body.motion.as_ref().filter(|m| m.prismatic);
            let slide = slide.map_or(0.0, |m| (m.multiplier * extreme[m.joint]).abs() + m.offset.abs());
            body.origin.translation.vector.norm() + slide
        });
        let shapes = self.shapes.iter().map(|shape| shape.at.norm() + shape.radius);
        bodies.sum::<f64>() + shapes.fold(0.0, f64::max)
    }

    /// Number of shapes.
    pub(super) fn shape_count(&self) -> usize {
        self.shapes.len()
    }
}

/// The greatest value of a convex function over a shape posed in its body, or a bound on it: a convex function is greatest at
/// a corner, so round shapes are replaced by boxes around them.
fn greatest(shape: &Shape, turn: &Matrix3<f64>, at: &Vector3<f64>, of: impl Fn(Vector3<f64>) -> f64) -> f64 {
    let corners: Vec<Vector3<f64>> = match &shape.convex {
        Convex::Hull { vertices } => vertices.iter().map(|v| Vector3::from(*v)).collect(),
        other => {
            let half = other.half_extents();
            let side = |bit: usize, axis: usize| if bit >> axis & 1 == 1 { half[axis] } else { -half[axis] };
            (0..8).map(|bit| Vector3::new(side(bit, 0), side(bit, 1), side(bit, 2))).collect()
        }
    };
    corners.into_iter().map(|corner| of(turn * corner + at)).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;
    use proptest::prelude::*;

    use super::*;
    use crate::certify::rollout::Rollout;
    use crate::certify::tests::robots::*;

    #[test]
    fn the_acceleration_of_coaxial_joints_is_that_of_one_turning_at_the_sum_of_their_rates() {
        let mut robot = with_joint(with_joint(bare_robot(), false), false);
        for joint in [0, 1] {
            robot = with_body(robot, joint, Isometry3::identity(), [0.0, 0.0, 1.0], (joint, 1.0, 0.0));
        }
        let point = Convex::Hull { vertices: vec![[0.0; 3]] };
        robot = with_shape(robot, 2, Isometry3::translation(0.5, 0.0, 0.0), point);
        let kinematics = Kinematics::new(&robot);
        let held = Held { speed: 0.0, turn_rate: 0.7, rates: &[1.1, 1.3] };
        let bound = kinematics.acceleration(0, held, &[0.0, 0.0]);
        assert!((bound - 3.1 * 3.1 * 0.5).abs() < 1e-12, "{bound}");
        // A slide away from the base's turning axis: Coriolis and centripetal.
        let mut slide =
            with_body(with_joint(bare_robot(), true), 0, Isometry3::identity(), [1.0, 0.0, 0.0], (0, -2.0, 0.1));
        slide = with_shape(slide, 1, Isometry3::identity(), Convex::Hull { vertices: vec![[0.0; 3]] });
        let held = Held { speed: 0.3, turn_rate: 0.7, rates: &[1.1] };
        let bound = Kinematics::new(&slide).acceleration(0, held, &[0.4]);
        assert!((bound - 0.7 * (0.3 + 0.7 * 0.9 + 2.0 * 2.2)).abs() < 1e-12, "{bound}");
    }

    #[test]
    fn the_acceleration_of_a_stretched_arm_that_turns_in_all_its_joints_is_its_bound() {
        let mut robot = with_joint(with_joint(bare_robot(), false), false);
        robot.bodies[0].origin = Isometry3::translation(0.2, 0.0, 0.0);
        for (parent, joint, far) in [(0, 0, 0.3), (1, 1, 0.4)] {
            robot = with_body(robot, parent, Isometry3::translation(far, 0.0, 0.0), [0.0, 0.0, 1.0], (joint, 1.0, 0.0));
        }
        let point = Convex::Hull { vertices: vec![[0.0; 3]] };
        robot = with_shape(robot, 2, Isometry3::translation(0.5, 0.0, 0.0), point);
        let held = Held { speed: 0.0, turn_rate: 0.7, rates: &[1.1, 1.3] };
        let bound = Kinematics::new(&robot).acceleration(0, held, &[0.0, 0.0]);
        // Towards each axis, at the rate at which what is behind it turns in all.
        let expected = real::powi(0.7, 2) * (0.2 + 0.3) + real::powi(1.8, 2) * 0.4 + real::powi(3.1, 2) * 0.5;
        assert!((bound - expected).abs() < 1e-12, "{bound} {expected}");
    }

    #[test]
    fn levers_reach_to_the_farthest_corner_on_whichever_side_it_is() {
        let brick = || Convex::Box { half: [0.2, 0.1, 0.05] };
        let turning =
            |rate| Held { speed: 0.0, turn_rate: 1.0 - rate, rates: if rate == 1.0 { &[1.0] } else { &[0.0] } };
        for (x, y, z) in [(0.5, 0.3, 0.4), (-0.5, 0.3, 0.4), (0.5, -0.3, -0.4), (-0.5, -0.3, -0.4)] {
            // About the base's vertical axis, and about an arm's own axis along x.
            let base = with_shape(bare_robot(), 0, Isometry3::translation(x, y, z), brick());
            let arm =
                with_body(with_joint(bare_robot(), false), 0, Isometry3::identity(), [1.0, 0.0, 0.0], (0, 1.0, 0.0));
            let arm = with_shape(arm, 1, Isometry3::translation(x, y, z), brick());
            for (robot, rate, lever) in [(base, 0.0, real::hypot(0.7, 0.4)), (arm, 1.0, real::hypot(0.4, 0.45))] {
                let bound = Kinematics::new(&robot).acceleration(0, turning(rate), &[0.0]);
                assert!((bound - lever).abs() < 1e-12, "({x}, {y}, {z}): {bound} {lever}");
            }
        }
        let hull = Convex::Hull { vertices: vec![[0.1, 0.0, 0.0], [-0.05, 0.0, 0.0]] };
        let robot = with_shape(bare_robot(), 0, Isometry3::translation(0.5, 0.0, 0.2), hull);
        let bound = Kinematics::new(&robot).acceleration(0, turning(0.0), &[]);
        assert!((bound - 0.6).abs() < 1e-12, "{bound}");
    }

    #[test]
    fn a_robot_is_as_large_as_its_links_in_a_row_with_what_slides_all_out() {
        let arm = with_body(
            with_joint(bare_robot(), true),
            0,
            Isometry3::translation(0.3, 0.4, 0.0),
            [1.0, 0.0, 0.0],
            (0, -2.0, 0.1),
        );
        let mut robot = with_shape(arm, 1, Isometry3::translation(0.0, 0.0, 0.6), Convex::Sphere { radius: 0.1 });
        robot = with_shape(robot, 1, Isometry3::translation(0.0, 0.2, 0.0), Convex::Sphere { radius: 0.3 });
        // 0.5 m to the slide, 2 x 0.4 + 0.1 m along it, 0.7 m to the end of the farther ball.
        let size = Kinematics::new(&robot).size(&[0.4]);
        assert!((size - 2.1).abs() < 1e-12, "{size}");
    }

    /// A ball whose middle is half a metre before the base, after a time so short that only speeds count.
    #[test]
    fn bounds_of_a_motion_are_hardly_more_than_what_moves_farthest() {
        let ball = Convex::Sphere { radius: 0.1 };
        let robot = with_shape(bare_robot(), 0, Isometry3::translation(0.5, 0.0, 0.2), ball);
        let kinematics = Kinematics::new(&robot);
        let shape = |speed: f64, turn_rate: f64| {
            let held = Held { speed, turn_rate, rates: &[] };
            let mut bodies = Vec::new();
            kinematics.bodies(&[], held, &mut bodies);
            kinematics.shape(0, &bodies, Pose2::default(), kinematics.acceleration(0, held, &[]))
        };
        let near =
            |bound: f64, expected: f64| assert!((bound - expected).abs() < 1e-6 * expected, "{bound} {expected}");
        let half = 1e-8;
        for (speed, turn_rate, expected) in [(2.0, 0.0, 2.0), (0.0, 3.0, 3.0 * 0.6)] {
            near(shape(speed, turn_rate).motion(half), half * expected);
        }
        let [backwards, forward] = shape(2.0, 0.0).reach(&Vector3::x(), half);
        assert!((backwards, forward) == (0.1, 0.1 + 2.0 * half), "{backwards} {forward}");
        let [before, after] = shape(0.0, 3.0).reach(&Vector3::y(), half);
        near(before, 0.1);
        near(after - 0.1, 3.0 * 0.5 * half);
        assert_eq!(shape(2.0, 0.0).fastest(half), [2.0, 0.0]);
        let [centre, against] = shape(0.0, 3.0).fastest(half);
        near(centre, 1.5);
        near(against, 0.3);
        // Over a longer time, as much more as the corners of the box around the ball are accelerated.
        let gained = 0.1 * real::powi(3.0, 2) * real::hypot(0.6, 0.1);
        let [centre, against] = shape(0.0, 3.0).fastest(0.1);
        near(centre, 1.5 + gained);
        near(against, 0.3 + 2.0 * gained);
        near(shape(0.0, 3.0).motion(0.1), 0.1 * (1.8 + 0.5 * gained));
        // Points that may be off, and farther by 0.5 m/s.
        let mut loose = shape(2.0, 0.0);
        let nowhere = Spread { along: [nalgebra::Vector2::zeros(); 4], turn: 0.0, disc: 0.0, ball: 0.0 };
        loose.loosen(nowhere, 0.5);
        near(loose.motion(half), half * 2.5);
        let [before, after] = loose.reach(&-Vector3::x(), half);
        near(before - 0.1, half * 2.5);
        assert_eq!(after, 0.1);
    }

    proptest! {
        #[test]
        fn no_shape_reaches_farther_than_its_bound(
            robot in any_robot(), (start, values, step, held) in any_motion(), part in 0.01..1.0f64,
            normal in [-1.0..1.0, -1.0..1.0, 0.1..1.0f64],
        ) {
            let (values, held) = cut(&robot, &values, &held);
            let (table, _) = commands(&robot, start, &values, step, &held);
            let rollout = Rollout::new(&table, start, &values);
            let kinematics = Kinematics::new(&robot);
            let normal = Vector3::from(normal).normalize();
            let (mut joints, mut bodies) = (Vec::new(), Vec::new());
            for row in 0..held.len() {
                let half = 0.5 * step * part;
                let mut at = |shape: usize, tau: f64| {
                    rollout.extreme_joints(row, &mut joints);
                    let acceleration = kinematics.acceleration(shape, rollout.held(row), &joints);
                    rollout.joints_at(row, tau, &mut joints);
                    kinematics.bodies(&joints, rollout.held(row), &mut bodies);
                    let moving = kinematics.shape(shape, &bodies, rollout.pose(row, tau), acceleration);
                    let pose = rollout.pose(row, tau).isometry() * robot.shape_poses(&joints)[shape];
                    assert!((pose.translation.vector - moving.posed.centre).norm() < 1e-12);
                    assert!((pose.rotation.to_rotation_matrix().into_inner() - moving.posed.turn).norm() < 1e-12);
                    moving
                };
                for shape in 0..robot.shapes.len() {
                    let middle = at(shape, 0.5 * step);
                    let bounds = middle.reach(&normal, half);
                    for sample in -8..=8 {
                        let moved = at(shape, 0.5 * step + half * f64::from(sample) / 8.0).posed;
                        let shift = moved.centre - middle.posed.centre;
                        let reach = normal.dot(&shift) + moved.reach(&normal);
                        let bound = bounds[usize::from(sample > 0)];
                        prop_assert!(reach <= bound + 1e-12, "{reach} > {bound}");
                        prop_assert!((moved.turn - middle.posed.turn).norm() < 1e-12 || shift.norm() <= middle.motion(half) + 1e-12);
                        prop_assert!(shift.norm() <= middle.motion(half) + 1e-12);
                    }
                }
            }
        }

        #[test]
        fn velocities_are_the_derivatives_of_poses(robot in any_robot(), (start, values, _, held) in any_motion()) {
            let (values, held) = cut(&robot, &values, &held[..1]);
            let (table, _) = commands(&robot, start, &values, 1.0, &held);
            let rollout = Rollout::new(&table, start, &values);
            let kinematics = Kinematics::new(&robot);
            let at = |shape: usize, tau: f64| {
                let (mut joints, mut bodies) = (Vec::new(), Vec::new());
                rollout.joints_at(0, tau, &mut joints);
                kinematics.bodies(&joints, rollout.held(0), &mut bodies);
                kinematics.shape(shape, &bodies, rollout.pose(0, tau), 0.0)
            };
            for shape in 0..robot.shapes.len() {
                let (before, now, after) = (at(shape, 0.5 - 1e-5), at(shape, 0.5), at(shape, 0.5 + 1e-5));
                let velocity = (after.posed.centre - before.posed.centre) / 2e-5;
                prop_assert!((velocity - now.velocity).norm() < 1e-7);
                let turning = (after.posed.turn - before.posed.turn) / 2e-5;
                prop_assert!((turning - now.spin.cross_matrix() * now.posed.turn).norm() < 1e-7);
            }
        }
    }
}
