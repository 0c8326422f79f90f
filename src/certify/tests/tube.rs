use nalgebra::{Isometry3, Vector3};
use proptest::prelude::*;

use super::robots::*;
use crate::certify::motion::{Kinematics, MovingShape};
use crate::certify::rollout::Rollout;
use crate::certify::tube::Tube;
use crate::certify::{RefusalKind, Task, certify, trust, tube_along};
use crate::command::CommandTable;
use crate::geom::Pose2;
use crate::map::VoxelMap;
use crate::math::real;
use crate::mission::{Tolerance, Unknown};
use crate::robot::{Convex, RobotModel};

/// A robot that is not the model's: shares, -1 to 1, of each tolerance.
#[derive(Debug, Clone, Copy)]
struct Off {
    wheel_radius: f64,
    wheel_difference: f64,
    track: f64,
    /// Of the latency: the wheels' less the joints'.
    apart: f64,
    /// Where it starts: how far, in which direction, and its heading.
    start: [f64; 3],
}

impl Off {
    fn from(shares: [f64; 7]) -> Self {
        let [wheel_radius, wheel_difference, track, apart, far, direction, heading] = shares;
        Self { wheel_radius, wheel_difference, track, apart, start: [far, 4.0 * direction, heading] }
    }

    /// The same commands with its own wheels, and where it starts.
    fn table(&self, table: &CommandTable, start: Pose2, tolerance: &Tolerance) -> (CommandTable, Pose2) {
        let mut own = table.clone();
        let both = 1.0 + self.wheel_radius * tolerance.wheel_radius;
        let half = 0.5 * self.wheel_difference * tolerance.wheel_difference;
        own.track_width *= 1.0 + self.track * tolerance.track;
        for row in &mut own.rows {
            row.wheel_left *= both - half;
            row.wheel_right *= both + half;
        }
        let [far, direction, heading] = self.start;
        let far = far.abs() * tolerance.start_distance;
        let yaw = start.yaw + heading * tolerance.start_angle;
        (own, Pose2::new(start.x + far * real::cos(direction), start.y + far * real::sin(direction), yaw))
    }
}

fn corners() -> impl Iterator<Item = Off> {
    (0..64usize).map(|bits| {
        let side = |i: usize| if bits >> i & 1 == 1 { 1.0 } else { -1.0 };
        Off { wheel_radius: side(0), wheel_difference: side(1), track: side(2), apart: 0.0, start: [1.0, 0.0, side(3)] }
    })
}

fn any_off() -> impl Strategy<Value = Off> {
    let share = || prop_oneof![-1.0..1.0f64, Just(1.0), Just(-1.0)];
    [share(), share(), share(), share(), share(), share(), share()].prop_map(Off::from)
}

fn any_tolerance() -> impl Strategy<Value = Tolerance> {
    let most = [0.1, 0.1, 0.4, 0.2, 0.05, 0.4];
    [0.0..1.0, 0.0..1.0, 0.0..1.0, 0.0..1.0, 0.0..1.0, 0.0..1.0f64].prop_map(move |shares| Tolerance {
        wheel_radius: shares[0] * most[0],
        wheel_difference: shares[1] * most[1],
        track: shares[2] * most[2],
        latency: shares[3] * most[3],
        start_distance: shares[4] * most[4],
        start_angle: shares[5] * most[5],
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn no_point_of_a_robot_within_the_tolerance_is_outside_the_tube_at_any_instant(
        robot in any_robot(), (start, values, step, held) in any_motion(), tolerance in any_tolerance(), off in any_off(),
        part in 0.0..1.0f64, normal in [-1.0..1.0, -1.0..1.0, -1.0..1.0f64],
    ) {
        let (values, held) = cut(&robot, &values, &held);
        let (table, _) = commands(&robot, start, &values, step, &held);
        let rollout = Rollout::new(&table, start, &values);
        let tube = Tube::new(&rollout, &robot, tolerance);
        let (own, from) = off.table(&table, start, &tolerance);
        let own_poses = own.replay(from);
        let kinematics = Kinematics::new(&robot);
        let Some(normal) = Vector3::from(normal).try_normalize(0.1) else { return Ok(()) };
        let (mut joints, mut bodies, mut late) = (Vec::new(), Vec::new(), Vec::new());
        for (row, own_pose) in own_poses.iter().enumerate().take(held.len()) {
            let (middle, half) = (0.5 * step, 0.5 * step * part);
            for shape in 0..robot.shapes.len() {
                let mut loose = |tau: f64, half: f64| {
                    rollout.extreme_joints(row, &mut joints);
                    let acceleration = kinematics.acceleration(shape, rollout.held(row), &joints);
                    rollout.joints_at(row, tau, &mut joints);
                    kinematics.bodies(&joints, rollout.held(row), &mut bodies);
                    let mut moving = kinematics.shape(shape, &bodies, rollout.pose(row, tau), acceleration);
                    tube.loosen(shape, &mut moving, (row, tau), half);
                    moving
                };
                let whole = loose(middle, half);
                let bounds = whole.reach(&normal, half);
                for sample in -4..=4 {
                    let tau = middle + half * f64::from(sample) / 4.0;
                    let now = loose(tau, 0.0);
                    // The joints are where they are meant to be at another time.
                    let time = table.time(row) + tau + off.apart * tolerance.latency;
                    let time = time.clamp(0.0, table.duration());
                    let other = ((time / step) as usize).min(held.len());
                    rollout.joints_at(other, time - table.time(other), &mut late);
                    let (speed, turn_rate) = own.twist(row);
                    let pose = own_pose.after_twist(speed, turn_rate, tau);
                    let real = pose.isometry() * robot.shape_poses(&late)[shape];
                    let local = real.rotation.inverse() * normal;
                    let point = real * nalgebra::Point3::from(robot.shapes[shape].convex.support(&local));
                    let at = normal.dot(&point.coords);
                    let (bound, reach) = (normal.dot(&now.posed.centre) + now.posed.reach(&normal), at);
                    prop_assert!(reach <= bound + 1e-9, "at an instant: {reach} > {bound}");
                    let bound = normal.dot(&whole.posed.centre) + bounds[usize::from(sample > 0)];
                    prop_assert!(reach <= bound + 1e-9, "over an interval: {reach} > {bound}");
                    prop_assert!((point.coords - whole.posed.centre).norm() < 1e3);
                    let base = rollout.pose(row, tau);
                    let width = tube.width(row, tau);
                    prop_assert!(base.distance(pose) <= width.distance + 1e-12);
                    prop_assert!((pose.yaw - base.yaw).abs() <= width.angle + 1e-12);
                }
            }
        }
    }
}

proptest! {
    /// Each direction of the tube is the derivative of where the robot is by one deviation: by differences of replays, which know nothing
    /// of the closed forms.
    #[test]
    fn the_directions_of_the_tube_are_derivatives_of_the_replay(
        (start, _, step, held) in any_motion(), longer in 1.0..10.0f64,
    ) {
        let (robot, step) = (bare_robot(), step * longer);
        let held: Vec<Twist> = held.into_iter().map(|(v, w, _)| (v, w, Vec::new())).collect();
        let (table, _) = commands(&robot, start, &[], step, &held);
        let rollout = Rollout::new(&table, start, &[]);
        const SMALL: f64 = 1e-6;
        let tolerance = Tolerance {
            wheel_radius: SMALL, wheel_difference: SMALL, track: SMALL / (1.0 + SMALL), start_angle: SMALL, ..Tolerance::default()
        };
        let tube = Tube::new(&rollout, &robot, tolerance);
        let replay = |deviation: usize, sign: f64| {
            let mut own = table.clone();
            let mut from = start;
            match deviation {
                0 => own.wheel_radii.mean *= 1.0 + sign * SMALL,
                // The track is this much narrower: its inverse is what counts.
                1 => own.track_width /= 1.0 + sign * SMALL,
                2 => own.rows.iter_mut().for_each(|row| {
                    row.wheel_left *= 1.0 - 0.5 * sign * SMALL;
                    row.wheel_right *= 1.0 + 0.5 * sign * SMALL;
                }),
                _ => from.yaw += sign * SMALL,
            }
            own.replay(from)
        };
        for deviation in 0..4 {
            let (less, more) = (replay(deviation, -1.0), replay(deviation, 1.0));
            for row in 0..table.rows.len() {
                let (drift, turning) = tube.parts(row);
                let half = nalgebra::Vector2::new(more[row].x - less[row].x, more[row].y - less[row].y) * 0.5;
                let turned = 0.5 * (more[row].yaw - less[row].yaw);
                // Of third order in what is small, and rounding.
                prop_assert!((drift[deviation] - half).norm() < 2e-12, "{deviation}: {} {half}", drift[deviation]);
                prop_assert!((turning[deviation] - turned).abs() < 2e-12, "{deviation}: {} {turned}", turning[deviation]);
            }
        }
    }
}

/// What is left of the deviations after the first order is what two of them make together, or one squared: cases in which one such term is
/// nearly all of it.
#[test]
fn what_the_first_order_leaves_out_is_bounded_and_not_by_much_more_than_it_is() {
    let robot = bare_robot();
    let none = Tolerance::default();
    let cases = [
        ((1.0, 0.0), Tolerance { start_angle: 0.02, ..none }),
        ((1.0, 0.0), Tolerance { start_angle: 0.01, wheel_radius: 0.1, ..none }),
        ((0.0, 1.0), Tolerance { start_angle: 0.05, wheel_difference: 0.05, ..none }),
        ((1.0, 0.0), Tolerance { wheel_difference: 1e-3, track: 0.4, ..none }),
        ((1.0, 0.05), Tolerance { wheel_radius: 0.1, track: 0.2, ..none }),
    ];
    for ((speed, turn_rate), tolerance) in cases {
        let (table, task) =
            commands(&robot, Pose2::new(1.0, 2.0, 0.3), &[], 0.02, &vec![(speed, turn_rate, vec![]); 10]);
        let rollout = Rollout::new(&table, task.start, &[]);
        let tube = Tube::new(&rollout, &robot, tolerance);
        // The farthest of all: every deviation at its end, the track narrow.
        let off = Off { wheel_radius: 1.0, wheel_difference: 1.0, track: -1.0, apart: 0.0, start: [0.0, 0.0, 1.0] };
        let (own, from) = off.table(&table, task.start, &tolerance);
        let (last, model) = (own.replay(from)[10], table.replay(task.start)[10]);
        let first_order: nalgebra::Vector2<f64> = tube.parts(10).0.iter().sum();
        let left_out = (nalgebra::Vector2::new(last.x - model.x, last.y - model.y) - first_order).norm();
        let bound = tube.anywhere(10);
        assert!(left_out <= bound && bound <= 1.1 * left_out + 2e-9, "{tolerance:?}: {left_out} {bound}");
        // The heading's bound is what such a robot does.
        assert!((tube.width(10, 0.0).angle - (last.yaw - model.yaw)).abs() < 1e-12, "{tolerance:?}");
    }
}

/// In so short a time that speeds count and nothing else does, what one tolerance alone adds to where a box before the base reaches.
#[test]
fn the_tube_over_an_interval_holds_that_of_its_ends_and_is_not_much_wider() {
    let shape = Convex::Box { half: [0.2, 0.1, 0.1] };
    let robot = with_shape(bare_robot(), 0, Isometry3::translation(0.5, 0.0, 0.2), shape);
    let (none, forward, aside) = (Tolerance::default(), Vector3::x(), Vector3::y());
    let (straight, spin, half) = ((1.0, 0.0), (0.0, 1.0), 1e-3);
    // What is told beside: how much wider it may be at most, as its parts are bounded by circles.
    let cases = [
        (straight, Tolerance { wheel_radius: 0.1, ..none }, forward, 1.001),
        (spin, Tolerance { wheel_radius: 0.1, ..none }, aside, 1.1),
        (spin, Tolerance { track: 0.1, ..none }, aside, 1.1),
        (straight, Tolerance { wheel_difference: 0.1, ..none }, aside, 1.1),
        (straight, Tolerance { wheel_difference: 0.1, track: 0.4, ..none }, aside, 1.1),
        (spin, Tolerance { wheel_difference: 0.1, ..none }, forward, 1.01),
        (straight, Tolerance { start_angle: 0.4, ..none }, aside, 1.4),
        (straight, Tolerance { start_angle: 0.4, wheel_radius: 0.2, ..none }, aside, 1.7),
        (spin, Tolerance { start_angle: 0.01, ..none }, -forward, 2.6),
    ];
    for ((speed, turn_rate), tolerance, normal, most) in cases {
        let (table, task) = commands(&robot, Pose2::default(), &[], 2.0 * half, &[(speed, turn_rate, vec![])]);
        let rollout = Rollout::new(&table, task.start, &[]);
        let tube = Tube::new(&rollout, &robot, tolerance);
        let kinematics = Kinematics::new(&robot);
        let held = rollout.held(0);
        let acceleration = kinematics.acceleration(0, held, &[]);
        // How far it reaches now, and how far at most up to `half` seconds later; in the tube, or the model's own.
        let reaches = |tau: f64, half: f64, in_tube: bool| {
            let mut bodies = Vec::new();
            kinematics.bodies(&[], held, &mut bodies);
            let mut moving = kinematics.shape(0, &bodies, rollout.pose(0, tau), acceleration);
            if in_tube {
                tube.loosen(0, &mut moving, (0, tau), half);
            }
            let at = normal.dot(&moving.posed.centre);
            [at + moving.posed.reach(&normal), at + moving.reach(&normal, half)[1]]
        };
        let [[now, _], [_, bound], [then, _]] =
            [(half, 0.0), (half, half), (2.0 * half, 0.0)].map(|(tau, half)| reaches(tau, half, true));
        assert!(then <= bound + 1e-13, "{tolerance:?}: {then} above {bound}");
        let ([own_now, own_bound], [own_then, _]) = (reaches(half, half, false), reaches(2.0 * half, 0.0, false));
        let (added, bounded) = ((then - now) - (own_then - own_now), (bound - now) - (own_bound - own_now));
        assert!(added > 1e-6 && bounded <= most * added + 1e-9, "{tolerance:?}: {bounded} for {added}");
    }
}

/// Rates 0, 0, 1, 0, 0, 0 rad/s of an arm of half a metre; late by at most a row and a half.
#[test]
fn joints_are_late_where_they_move_within_the_latency() {
    let mut robot = with_joint(bare_robot(), false);
    robot = with_body(robot, 0, Isometry3::identity(), [0.0, 0.0, 1.0], (0, 2.0, 0.0));
    robot = with_shape(robot, 1, Isometry3::translation(0.4, 0.0, 0.2), Convex::Sphere { radius: 0.1 });
    let held: Vec<Twist> = [0.0, 0.0, 1.0, 0.0, 0.0, 0.0].map(|rate| (0.0, 0.0, vec![rate])).into();
    let (table, task) = commands(&robot, Pose2::default(), &[0.0], 0.1, &held);
    let rollout = Rollout::new(&table, task.start, &[0.0]);
    let tube = Tube::new(&rollout, &robot, Tolerance { latency: 0.15, ..Tolerance::default() });
    // The point that is farthest from the axis moves 0.5 m/rad, the body 2 rad for each of the joint's.
    let late: Vec<f64> = (0..table.rows.len()).map(|row| tube.late(row)).collect();
    assert!(late[..5].iter().all(|late| (late - 0.15 * 2.0 * 0.5).abs() < 1e-8), "{late:?}");
    assert_eq!(late[5..], [0.0, 0.0]);
    let at = |row: usize| {
        tube.shares((row, 0.05), 0, nalgebra::Vector2::new(0.5, 0.0), nalgebra::Vector2::new(0.0, 1.0)).latency
    };
    assert_eq!([at(0), at(5)], [late[0], 0.0]);
}

#[test]
fn of_several_joints_each_is_late_by_its_own_rate() {
    // Two slides one on the other: every point of the shape moves as far as both of them.
    let mut robot = with_joint(with_joint(bare_robot(), true), true);
    robot = with_body(robot, 0, Isometry3::identity(), [1.0, 0.0, 0.0], (0, 1.0, 0.0));
    robot = with_body(robot, 1, Isometry3::identity(), [0.0, 0.0, 1.0], (1, -1.0, 0.0));
    robot = with_shape(robot, 2, Isometry3::identity(), Convex::Sphere { radius: 0.1 });
    let rates = [[1.0, 0.0], [0.0, 0.0], [0.0, 0.0], [0.0, 2.0], [0.0, 0.0]];
    let held: Vec<Twist> = rates.iter().map(|rates| (0.0, 0.0, rates.to_vec())).collect();
    let (table, task) = commands(&robot, Pose2::default(), &[0.0; 2], 0.1, &held);
    let rollout = Rollout::new(&table, task.start, &[0.0; 2]);
    let tube = Tube::new(&rollout, &robot, Tolerance { latency: 0.05, ..Tolerance::default() });
    let late: Vec<f64> = (0..table.rows.len()).map(|row| tube.late(row)).collect();
    for (late, expected) in late.iter().zip([0.05, 0.05, 0.1, 0.1, 0.1, 0.0]) {
        assert!((late - expected).abs() < 1e-9, "{late} {expected}");
    }
}

proptest! {
    /// What one tolerance alone brings a point of the base nearer, by differences of replays.
    #[test]
    fn shares_are_how_far_points_of_robots_are_off_by_one_tolerance_alone(
        (start, _, step, held) in any_motion(), place in [-1.0..1.0, -1.0..1.0f64], toward in [-0.7..0.7, -0.7..0.7f64],
    ) {
        let robot = bare_robot();
        let held: Vec<Twist> = held.into_iter().map(|(v, w, _)| (v, w, Vec::new())).collect();
        let (table, _) = commands(&robot, start, &[], step, &held);
        let rollout = Rollout::new(&table, start, &[]);
        const SMALL: f64 = 1e-6;
        let tolerance = Tolerance {
            wheel_radius: SMALL, wheel_difference: SMALL, track: SMALL / (1.0 + SMALL), start_angle: SMALL, start_distance: SMALL,
            latency: 0.0,
        };
        let (row, tau) = (held.len() - 1, 0.4 * step);
        let toward = nalgebra::Vector2::from(toward);
        let model = rollout.pose(row, tau);
        let at = |own: &CommandTable, from: Pose2| {
            let (speed, turn_rate) = own.twist(row);
            let pose = own.replay(from)[row].after_twist(speed, turn_rate, tau);
            // The point that the model has at `place`.
            let local = nalgebra::Rotation2::new(-model.yaw) * nalgebra::Vector2::new(place[0] - model.x, place[1] - model.y);
            nalgebra::Vector2::new(pose.x, pose.y) + nalgebra::Rotation2::new(pose.yaw) * local
        };
        let off = |change: &dyn Fn(&mut CommandTable, &mut Pose2, f64)| {
            let points = [1.0, -1.0].map(|sign| {
                let (mut own, mut from) = (table.clone(), start);
                change(&mut own, &mut from, sign * SMALL);
                at(&own, from)
            });
            (0.5 * (points[0] - points[1])).dot(&toward).abs()
        };
        let shares = Tube::new(&rollout, &robot, tolerance).shares((row, tau), 0, place.into(), toward);
        let turned = |_: &mut CommandTable, from: &mut Pose2, small: f64| from.yaw += small;
        let uneven = |own: &mut CommandTable, _: &mut Pose2, small: f64| own.rows.iter_mut().for_each(|row| {
            row.wheel_left *= 1.0 - 0.5 * small;
            row.wheel_right *= 1.0 + 0.5 * small;
        });
        for (share, expected) in [
            (shares.wheel_radius, off(&|own, _, small| own.wheel_radii.mean *= 1.0 + small)),
            (shares.track, off(&|own, _, small| own.track_width /= 1.0 + small)),
            (shares.wheel_difference, off(&uneven)),
            (shares.start_angle, off(&turned)),
            (shares.start_distance, SMALL * toward.norm()),
        ] {
            prop_assert!((share - expected).abs() < 5e-12, "{share} {expected}: {shares:?}");
        }
    }
}

/// A shape of the robot's in the tube, and as the model has it, `tau` seconds into the first row; bounds hold for `half` seconds around.
fn in_tube<'a>(
    robot: &'a RobotModel,
    (rollout, tube): (&Rollout<'_>, &Tube<'_>),
    (tau, half): (f64, f64),
) -> [MovingShape<'a>; 2] {
    let kinematics = Kinematics::new(robot);
    let (mut joints, mut bodies) = (Vec::new(), Vec::new());
    rollout.extreme_joints(0, &mut joints);
    let acceleration = kinematics.acceleration(0, rollout.held(0), &joints);
    rollout.joints_at(0, tau, &mut joints);
    kinematics.bodies(&joints, rollout.held(0), &mut bodies);
    let own = kinematics.shape(0, &bodies, rollout.pose(0, tau), acceleration);
    let mut loose = own;
    tube.loosen(0, &mut loose, (0, tau), half);
    [loose, own]
}

/// How fast the tube around a shape is taken to grow within `half` seconds, m/s.
fn growth([loose, own]: &[MovingShape<'_>; 2], half: f64) -> f64 {
    (loose.motion(half) - own.motion(half)) / half
}

/// One point on a slide along the base's x axis: by how much farther the tube lets it be grows no faster than is said. In the cases without
/// a name the parts of that growth add up along one direction, so that nothing is to spare.
#[test]
fn the_tube_around_a_point_grows_no_faster_than_is_said() {
    let mut robot = with_joint(bare_robot(), true);
    robot = with_body(robot, 0, Isometry3::identity(), [1.0, 0.0, 0.0], (0, 1.0, 0.0));
    robot = with_shape(robot, 1, Isometry3::identity(), Convex::Hull { vertices: vec![[0.0; 3]] });
    let none = Tolerance::default();
    let all = Tolerance { wheel_radius: 0.1, wheel_difference: 0.1, track: 0.3, start_angle: 0.3, ..none };
    let turned = Tolerance { start_angle: 0.4, ..none };
    let half = 0.1;
    for (speed, turn_rate, slide, tolerance) in [
        (0.0, 0.0, 2.0, turned),
        (-2.0, 0.0, 2.0, turned),
        (2.0, 0.0, 0.0, turned),
        (2.0, 0.0, 0.0, Tolerance { wheel_radius: 0.2, ..turned }),
        (0.0, 2.0, 0.0, all),
        (1.0, -1.0, 2.0, all),
        (-1.0, 3.0, 0.5, all),
    ] {
        // Half the way through the row the slide is in.
        let start = [-slide * half];
        let held = [(speed, turn_rate, vec![slide])];
        let (table, task) = commands(&robot, Pose2::new(0.3, 0.2, 0.4), &start, 2.0 * half, &held);
        let rollout = Rollout::new(&table, task.start, &start);
        let tube = Tube::new(&rollout, &robot, tolerance);
        let middle = in_tube(&robot, (&rollout, &tube), (half, half));
        let rate = growth(&middle, half);
        for direction in 0..32 {
            let angle = 0.4 + std::f64::consts::TAU * f64::from(direction) / 32.0;
            let normal = Vector3::new(real::cos(angle), real::sin(angle), 0.0);
            // A point has no reach of its own.
            let now = middle[0].posed.reach(&normal);
            for part in [-1.0, -0.5, 0.0, 0.5, 1.0] {
                let [then, _] = in_tube(&robot, (&rollout, &tube), (half + part * half, 0.0));
                let (far, said) = (then.posed.reach(&normal), now + rate * half * f64::abs(part));
                assert!(far <= said + 1e-12, "{speed} {turn_rate} {slide}: {far} above {said} along {angle}");
            }
        }
    }
}

/// In a spin a point a metre from its shape's middle is off by a metre times what the heading is.
#[test]
fn the_tube_of_a_spin_grows_with_the_radius_of_a_shape() {
    let robot = with_shape(bare_robot(), 0, Isometry3::identity(), Convex::Hull { vertices: vec![[1.0, 0.0, 0.0]] });
    let half = 1e-5;
    let (table, task) = commands(&robot, Pose2::default(), &[], 2.0 * half, &[(0.0, 1.0, vec![])]);
    let rollout = Rollout::new(&table, task.start, &[]);
    let tube = Tube::new(&rollout, &robot, Tolerance { wheel_radius: 0.1, track: 0.2, ..Tolerance::default() });
    let rate = growth(&in_tube(&robot, (&rollout, &tube), (half, half)), half);
    let turning = (tube.width(0, 2.0 * half).angle - tube.width(0, half).angle) / half;
    assert!(rate >= turning - 1e-9 && rate < 1.001 * turning, "{rate} {turning}");
}

/// The turn of a shape is taken as a shift along tangents; where its points come nearer to the middle than that is in the disc.
#[test]
fn a_corner_that_starts_at_another_angle_is_in_the_tube_inwards_too() {
    for (place, corner) in [(0.0, 0.3), (0.5, 0.3), (0.5, 0.0)] {
        let shape = Convex::Hull { vertices: vec![[corner, 0.0, 0.0]] };
        let robot = with_shape(bare_robot(), 0, Isometry3::translation(place, 0.0, 0.0), shape);
        let (table, task) = commands(&robot, Pose2::default(), &[], 0.1, &[(0.0, 0.0, vec![])]);
        let rollout = Rollout::new(&table, task.start, &[]);
        let angle: f64 = 0.4;
        let tube = Tube::new(&rollout, &robot, Tolerance { start_angle: angle, ..Tolerance::default() });
        let [loose, _] = in_tube(&robot, (&rollout, &tube), (0.05, 0.05));
        let far = (place + corner) * real::cos(angle);
        let bound = place - loose.posed.reach(&-Vector3::x());
        assert!(bound <= far && bound > far - 0.03 * (place + corner), "{place} {corner}: {bound} {far}");
        assert_eq!(growth(&in_tube(&robot, (&rollout, &tube), (0.05, 0.05)), 0.05), 0.0, "it stands");
    }
}

/// After a small spin of a robot whose wheels are larger and nearer to each other, what two deviations make together is most of what the
/// first order leaves out.
#[test]
fn a_point_before_a_base_that_spins_is_in_the_tube_with_two_deviations_together() {
    let shape = Convex::Hull { vertices: vec![[0.0; 3]] };
    let robot = with_shape(bare_robot(), 0, Isometry3::translation(1.0, 0.0, 0.0), shape);
    let (turned, step) = (0.05, 0.1);
    let (table, task) = commands(&robot, Pose2::default(), &[], step, &[(0.0, turned / step, vec![])]);
    let rollout = Rollout::new(&table, task.start, &[]);
    let tolerance = Tolerance { wheel_radius: 0.1, track: 0.4, ..Tolerance::default() };
    let tube = Tube::new(&rollout, &robot, tolerance);
    let [loose, _] = in_tube(&robot, (&rollout, &tube), (step, 0.0));
    let aside = Vector3::new(-real::sin(turned), real::cos(turned), 0.0);
    // Such a robot turns (1 + 0.1) / (1 - 0.4) times as far.
    let more = turned * (1.1 / 0.6 - 1.0);
    let bound = loose.posed.reach(&aside);
    assert!(bound >= real::sin(more) && bound < more + more * more, "{bound} {more}");
}

#[test]
fn the_shares_of_a_near_miss_are_those_of_the_point_that_is_nearest() {
    // The box's corner is at (0.7, 0.1), the cell's at (0.8, 0.2): on the diagonal.
    let shape = Convex::Box { half: [0.2, 0.1, 0.1] };
    let mut robot = with_shape(bare_robot(), 0, Isometry3::translation(0.5, 0.0, 0.2), shape);
    robot.tolerance = Some(Tolerance { start_angle: 0.01, ..Tolerance::default() });
    let mut map = VoxelMap::new(0.1, [-1.0, -1.0, 0.0], [30, 30, 5], Unknown::Free);
    map.occupy([18, 12, 2]);
    let (table, task) = commands(&robot, Pose2::default(), &[], 0.1, &[(0.0, 0.0, vec![])]);
    let certificate = certify(&table, &robot, Some(&map), &task);
    assert!(certificate.holds(), "{:?}", certificate.refusals);
    let (_, shares) = certificate.tolerance.and_then(|t| t.there).expect("near");
    // A small turn moves the corner along (-0.1, 0.7).
    assert!((shares.start_angle - 0.01 * 0.6 / 2f64.sqrt()).abs() < 1e-7, "{shares:?}");
}

/// 524 km from the origin a distance of 7.5 nm is less than rounding: what cannot be told from touching counts as it.
#[test]
fn trust_ends_where_rounding_could_hide_a_contact() {
    let far = 524_288.0;
    let robot = with_shape(bare_robot(), 0, Isometry3::translation(0.0, 0.0, 0.5), Convex::Box { half: [0.25; 3] });
    let mut map = VoxelMap::new(0.125, [far, far, 0.0], [64, 64, 8], Unknown::Free);
    map.occupy([38, 32, 4]);
    for (gap, contact) in [(real::powi(2.0, -27), Some(0)), (real::powi(2.0, -20), None)] {
        let (table, task) = commands(&robot, Pose2::new(far + 4.5 - gap, far + 4.0, 0.0), &[], 0.1, &[]);
        assert_eq!(trust(&table, &robot, Some(&map), &task, Tolerance::default()).expect("a row").contact, contact);
    }
}

/// 9 m of all kinds: straight, a spin there and a spin back, bends both ways, backwards; and where it starts.
fn nine_metres(robot: &RobotModel) -> (CommandTable, Task) {
    let stretches = [
        (20, 0.4, 0.0),
        (20, 0.0, 0.7),
        (40, 0.45, -0.3),
        (30, 0.4, 0.5),
        (20, -0.3, 0.1),
        (20, 0.0, -0.6),
        (90, 0.5, 0.06),
        (20, 0.4, 0.0),
    ];
    let held = stretches.into_iter().flat_map(|(rows, v, w)| std::iter::repeat_n((v, w, Vec::new()), rows));
    commands(robot, Pose2::new(1.0, 2.0, 0.3), &[], 0.1, &held.collect::<Vec<_>>())
}

/// The greatest distance from the model's pose at a row's time over all rows, and that at the end.
fn deviations(own: &CommandTable, from: Pose2, table: &CommandTable, start: Pose2) -> (f64, f64) {
    let each: Vec<f64> = own.replay(from).iter().zip(table.replay(start)).map(|(a, b)| a.distance(b)).collect();
    (each.iter().copied().fold(0.0, f64::max), each[each.len() - 1])
}

#[test]
fn wheels_one_percent_off_and_a_right_wheel_a_fifth_of_a_percent_larger_are_inside_and_nearly_at_the_edge() {
    let robot = RobotModel { wheel_radii: 0.08.into(), track_width: 0.32, ..bare_robot() };
    let (table, task) = nine_metres(&robot);
    let cases = [
        (Tolerance { wheel_radius: 0.01, ..Tolerance::default() }, [1.01, 1.01, 1.0]),
        // Right alone: both are larger by half of it.
        (Tolerance { wheel_radius: 0.001, wheel_difference: 0.002, ..Tolerance::default() }, [1.0, 1.002, 1.0]),
        (Tolerance { track: 0.01, ..Tolerance::default() }, [1.0, 1.0, 0.99]),
    ];
    for (tolerance, [left, right, track]) in cases {
        let mut own = table.clone();
        own.track_width *= track;
        own.rows
            .iter_mut()
            .for_each(|row| (row.wheel_left, row.wheel_right) = (row.wheel_left * left, row.wheel_right * right));
        let (_, end) = deviations(&own, task.start, &table, task.start);
        let tube = tube_along(&table, &robot, &task, tolerance);
        let last = tube.last().expect("rows");
        assert!((last.length - 10.0).abs() < 1.5, "{}", last.length);
        assert!(end > 0.02 && last.width.distance >= end, "{} below {end}", last.width.distance);
        assert!(last.width.distance <= 1.2 * end, "{} far above {end}", last.width.distance);
    }
}

#[test]
fn the_tube_is_not_much_wider_than_the_farthest_corner_of_the_tolerance() {
    let robot = RobotModel { wheel_radii: 0.08.into(), track_width: 0.32, ..bare_robot() };
    let (table, task) = nine_metres(&robot);
    let tolerance = Tolerance { latency: 0.0, ..Tolerance::ASSUMED };
    let tube = tube_along(&table, &robot, &task, tolerance);
    let nominal = table.replay(task.start);
    let mut farthest = vec![(0.0f64, 0.0f64); nominal.len()];
    for mut off in corners() {
        for direction in 0..16 {
            off.start[1] = f64::from(direction) / 16.0 * std::f64::consts::TAU;
            let (own, from) = off.table(&table, task.start, &tolerance);
            for ((most, pose), model) in farthest.iter_mut().zip(own.replay(from)).zip(&nominal) {
                *most = (most.0.max(pose.distance(*model)), most.1.max((pose.yaw - model.yaw).abs()));
            }
        }
    }
    for (point, (distance, angle)) in tube.iter().zip(farthest) {
        assert!(distance <= point.width.distance && angle <= point.width.angle + 1e-12);
        assert!(point.width.distance <= 1.05 * distance + 1e-6, "{} against {distance}", point.width.distance);
        assert!(point.width.angle <= 1.001 * angle + 1e-9, "{} against {angle}", point.width.angle);
    }
}

#[test]
fn a_spin_there_and_back_leaves_no_deviation_of_the_track() {
    let robot = bare_robot();
    let spin = |rate: f64| (0.0, rate, Vec::new());
    let held: Vec<Twist> = [vec![spin(1.0); 30], vec![spin(-1.0); 30]].concat();
    let (table, task) = commands(&robot, Pose2::default(), &[], 0.1, &held);
    let tube = tube_along(&table, &robot, &task, Tolerance { track: 0.01, wheel_radius: 0.01, ..Tolerance::default() });
    assert!(tube[30].width.angle > 0.05 && tube[60].width.angle < 1e-12);
    assert!(tube.iter().all(|point| point.width.distance < 1e-8));
}

/// A corridor of 1 m along x, 8 m long; the robot is a box of 0.4 m.
fn corridor() -> (RobotModel, VoxelMap, CommandTable, Task) {
    let robot =
        with_shape(bare_robot(), 0, Isometry3::translation(0.0, 0.0, 0.2), Convex::Box { half: [0.2, 0.2, 0.15] });
    let mut map = VoxelMap::new(0.1, [-1.0, -0.6, 0.0], [100, 12, 5], Unknown::Free);
    for i in 0..100 {
        for k in 0..5 {
            map.occupy([i, 0, k]);
            map.occupy([i, 11, k]);
        }
    }
    let (table, task) = commands(&robot, Pose2::default(), &[], 0.1, &vec![(0.5, 0.0, Vec::new()); 160]);
    (robot, map, table, task)
}

#[test]
fn along_a_corridor_only_what_leads_to_its_sides_counts_and_trust_ends_where_the_tube_meets_them() {
    let (robot, map, table, task) = corridor();
    let with = |tolerance: Tolerance| {
        let robot = RobotModel { tolerance: Some(tolerance), ..robot.clone() };
        certify(&table, &robot, Some(&map), &task)
    };
    // 0.3 m to each side. Wheels alike do not lead there, and the start does by what it is.
    let alike = with(Tolerance { wheel_radius: 0.1, start_distance: 0.02, ..Tolerance::default() });
    assert!(alike.holds(), "{:?}", alike.refusals);
    let inside = alike.tolerance.expect("in force");
    assert!((inside.clearance_proven.expect("a map") - 0.28).abs() < 1e-3);
    assert!((inside.end.distance - 0.82).abs() < 1e-6);

    // A circle of radius D/delta = 80 m: 0.4 m to the side after 8 m, and the corners turn 0.2 x 0.1 m nearer.
    let uneven = Tolerance { wheel_difference: 0.005, ..Tolerance::default() };
    let refused = with(uneven);
    assert!(refused.refusals.iter().all(|r| r.kind == RefusalKind::Tolerance) && refused.refusals.len() == 1);
    assert!(refused.refusals[0].message.contains("wheel_difference"), "{}", refused.refusals[0].message);
    assert!((refused.clearance_proven.expect("a map") - 0.3).abs() < 1e-3, "of the model itself");
    let trusted = trust(&table, &robot, Some(&map), &task, uneven).expect("rows");
    let until = trusted.until();
    assert_eq!(trusted.end(), *trusted.tube.last().expect("rows"));
    let to_the_side = |x: f64| x * x / 160.0 + 0.2 * x / 80.0 - 0.3;
    assert!(to_the_side(until.length) < 0.0 && to_the_side(until.length + 0.2) > 0.0, "{}", until.length);
    let everywhere = trust(&table, &robot, Some(&map), &task, Tolerance::default()).expect("rows");
    assert_eq!((everywhere.contact, everywhere.until()), (None, everywhere.end()));
}

#[test]
fn a_tolerance_of_nothing_proves_what_is_proven_without_one() {
    let (mut robot, map, table, task) = corridor();
    let without = certify(&table, &robot, Some(&map), &task);
    robot.tolerance = Some(Tolerance::default());
    let with = certify(&table, &robot, Some(&map), &task);
    let inside = with.tolerance.clone().expect("in force");
    assert!((inside.clearance_proven.expect("a map") - without.clearance_proven.expect("a map")).abs() < 1e-6);
    assert!(inside.end.distance < 1e-8 && inside.end.angle == 0.0);
}

#[test]
fn of_many_random_robots_within_a_certified_tolerance_none_comes_nearer_than_proven() {
    let (robot, map, table, task) = corridor();
    let tolerance = Tolerance { wheel_difference: 0.002, start_angle: 0.005, ..Tolerance::ASSUMED };
    let robot = RobotModel { tolerance: Some(tolerance), ..robot };
    let certificate = certify(&table, &robot, Some(&map), &task);
    assert!(certificate.holds(), "{:?}", certificate.refusals);
    let proven = certificate.tolerance.and_then(|t| t.clearance_proven).expect("a map");
    let mut least = f64::INFINITY;
    for index in 1..400 {
        // Halton's points, the corners first.
        let share = |base: usize| {
            let (mut at, mut scale, mut rest) = (0.0, 1.0, index);
            while rest > 0 {
                scale /= base as f64;
                at += scale * (rest % base) as f64;
                rest /= base;
            }
            2.0 * at - 1.0
        };
        let mut off = Off::from([2, 3, 5, 7, 11, 13, 17].map(share));
        if let Some(corner) = corners().nth(index) {
            off = Off { start: [1.0, std::f64::consts::FRAC_PI_2, corner.start[2]], ..corner };
        }
        let (own, from) = off.table(&table, task.start, &tolerance);
        for pose in own.replay(from) {
            let side = |x: f64, y: f64| (pose.y + x * real::sin(pose.yaw) + y * real::cos(pose.yaw)).abs();
            let reach = [(0.2, 0.2), (0.2, -0.2), (-0.2, 0.2), (-0.2, -0.2)].map(|(x, y)| side(x, y));
            least = least.min(0.5 - reach.into_iter().fold(0.0, f64::max));
        }
    }
    assert!(proven <= least && proven > least - 0.01, "{proven} against {least}");
}
