use super::*;
use crate::command::CommandRow;
use crate::geom::Pose2;
use crate::math::poly::PiecewisePoly;
use crate::math::real;
use crate::mission::Sampling;
use crate::robot::{BaseLimits, MotionLimits, MovingJoint};
use crate::trajectory::steered_curve::SteeredCurve;
use crate::trajectory::{DriveLeg, SteerLeg, TrajectorySource};

fn robot() -> RobotModel {
    let limits =
        |speed, acceleration| MotionLimits { speed: Some(speed), acceleration: Some(acceleration), jerk: None };
    RobotModel {
        name: "r".into(),
        wheel_radii: 0.1.into(),
        track_width: 0.4,
        root_link: "base".into(),
        base_from_root: nalgebra::Isometry3::identity(),
        joints: vec![MovingJoint {
            name: "blade".into(),
            prismatic: false,
            lower: 0.0,
            upper: 3.0,
            limits: limits(1.0, 2.0),
        }],
        bodies: Vec::new(),
        shapes: Vec::new(),
        wheel: limits(0.5, 0.5),
        base: BaseLimits {
            speed: 0.5,
            acceleration: 0.25,
            angular_speed: 1.0,
            angular_acceleration: 0.5,
            eta: 1.0,
            min_speed: 0.01,
        },
        ignore_pairs: Vec::new(),
        tolerance: None,
        links: Vec::new(),
    }
}

fn near(found: f64, wanted: f64, tolerance: f64) {
    assert!((found - wanted).abs() <= tolerance * wanted.abs().max(1e-9), "{found} is not {wanted}");
}

fn trajectory(leg: Leg) -> Trajectory {
    Trajectory { legs: vec![leg], source: TrajectorySource::Optimised, optimiser: None }
}

#[test]
fn a_parabola_driven_once_has_its_closed_forms() {
    // x = t, y = t^2/2 over 2 s: sigma'' = (0, 1), sigma''' = 0; joint t^3/6 has jerk 1.
    let coefficients = vec![vec![0.0, 1.0], vec![0.0, 0.0, 0.5], vec![0.0, 0.0, 0.0, 1.0 / 6.0]];
    let curve = PiecewisePoly { pieces: vec![Piece { duration: 2.0, coefficients }] };
    let leg = Leg::Drive(DriveLeg { curve, reverse: false, yaw_start: 0.0 });
    let m = of_trajectory(&trajectory(leg), &robot());
    near(m.time_s, 2.0, 1e-15);
    near(m.length_m, 0.5 * (2.0 * 5f64.sqrt() + real::asinh(2.0)), 1e-9);
    assert_eq!(m.mean_jerk_mps3, 0.0);
    // The speed rises from 1 to sqrt 5; omega = 1/(1 + t^2) falls from 1 to 1/5.
    near(m.mean_acceleration_mps2, (5f64.sqrt() - 1.0) / 2.0, 1e-9);
    near(m.mean_angular_acceleration_rads2, 0.4, 1e-9);
    near(m.mean_joint_jerk_rads3, 1.0, 1e-12);
}

fn steer(pieces: Vec<(f64, Vec<Vec<f64>>)>) -> SteerLeg {
    let pieces = pieces.into_iter().map(|(duration, coefficients)| Piece { duration, coefficients });
    SteerLeg { pose: Pose2::default(), curve: PiecewisePoly { pieces: pieces.collect() } }
}

#[test]
fn a_circle_of_heading_and_arc_length_has_the_jerk_of_its_constant_twist() {
    // v = 0.4 backwards, omega = 0.7: ||jerk|| = v omega^2; the blade's jerk is 6 * 0.2.
    let leg = steer(vec![(3.0, vec![vec![0.0, 0.7], vec![0.0, -0.4], vec![0.0, 0.0, 0.0, 0.2]])]);
    let m = of_trajectory(&trajectory(Leg::Steer(leg)), &robot());
    near(m.time_s, 3.0, 1e-15);
    near(m.length_m, 1.2, 1e-12);
    near(m.mean_jerk_mps3, 0.4 * 0.49, 1e-12);
    near(m.mean_joint_jerk_rads3, 1.2, 1e-12);
    assert_eq!((m.mean_acceleration_mps2, m.mean_angular_acceleration_rads2), (0.0, 0.0));
}

#[test]
fn a_leg_of_heading_and_arc_length_has_the_figures_of_its_positions_differences() {
    // A spin that becomes a drive with a change of direction.
    let leg = steer(vec![
        (1.5, vec![vec![0.0, 0.3, 0.5, -0.2], vec![0.0, 0.0, 0.0, 0.0], vec![0.3]]),
        (2.0, vec![vec![0.9, 1.0, -0.4, 0.1], vec![0.0, 0.6, 0.2, -0.25], vec![0.3]]),
    ]);
    let curve = SteeredCurve::new(&leg).unwrap();
    let (steps, h) = (3500, 1e-3);
    let (mut jerk, mut along, mut turning) = (0.0, 0.0, 0.0);
    for i in 0..steps {
        let t = (f64::from(i) + 0.5) * h;
        if (t - 1.5).abs() < 3.0 * h || !(3.0 * h..3.5 - 3.0 * h).contains(&t) {
            continue; // where derivatives jump, nothing to difference
        }
        let [x, y] = [0, 1].map(|axis| {
            let at = |k: f64| curve.point_jet(curve.place(t + k * h))[axis][0];
            (at(2.0) - 2.0 * at(1.0) + 2.0 * at(-1.0) - at(-2.0)) / (2.0 * h * h * h)
        });
        let second = |d: usize| {
            let at = |k: f64| curve.jet(d, curve.place(t + k * h))[0];
            (at(1.0) - 2.0 * at(0.0) + at(-1.0)) / (h * h)
        };
        jerk += real::hypot(x, y) * h;
        along += second(1).abs() * h;
        turning += second(0).abs() * h;
    }
    let m = of_trajectory(&trajectory(Leg::Steer(leg)), &robot());
    near(m.mean_jerk_mps3, jerk / 3.5, 1e-2);
    near(m.mean_acceleration_mps2, along / 3.5, 1e-2);
    near(m.mean_angular_acceleration_rads2, turning / 3.5, 1e-2);
    near(m.length_m, curve.length(), 1e-6);
}

#[test]
fn a_spin_contributes_its_trapezoid() {
    // pi rad at 1 rad/s, 0.5 rad/s^2: ramps of 2 s, 3.14 + 2 s; the blade's 1 rad in that time asks for less.
    let pose = Pose2::new(0.0, 0.0, 0.0);
    let yaw_end = std::f64::consts::PI;
    let leg = Leg::Still(StillLeg { pose, yaw_end, joints_from: vec![0.0], joints_to: vec![1.0] });
    let m = of_trajectory(&trajectory(leg), &robot());
    let time = yaw_end + 2.0;
    near(m.time_s, time, 1e-12);
    near(m.mean_angular_acceleration_rads2, 2.0 * 1.0 / time, 1e-12);
    near(m.mean_joint_jerk_rads3, 4.0 * (0.5 / yaw_end) / time, 1e-12);
    assert_eq!((m.length_m, m.mean_jerk_mps3), (0.0, 0.0));
}

#[test]
fn a_mission_that_moves_nothing_has_no_figures_and_no_nan() {
    let pose = Pose2::default();
    let leg = Leg::Still(StillLeg { pose, yaw_end: 0.0, joints_from: vec![0.3], joints_to: vec![0.3] });
    assert_eq!(of_trajectory(&trajectory(leg), &robot()), Metrics::default());
    let states = vec![SearchState { pose, joints: vec![0.3] }];
    let path = SearchPath { states, moves: Vec::new(), expanded: 0 };
    assert_eq!(of_search(&path, &robot()), Metrics::default());
}

#[test]
fn held_commands_are_differenced_with_rest_on_both_sides() {
    let row = |speed: f64, vel: f64| CommandRow {
        wheel_left: speed / 0.1,
        wheel_right: speed / 0.1,
        joint_positions: vec![0.0],
        joint_velocities: vec![vel],
        pose: Pose2::default(),
    };
    let table = CommandTable {
        sampling_time: 0.5,
        sampling: Sampling::Mean,
        wheel_radii: 0.1.into(),
        track_width: 0.4,
        joints: vec![("blade".into(), false)],
        rows: vec![row(0.1, 0.2), row(0.3, 0.0), row(0.0, 0.0)],
    };
    let m = of_commands(&table);
    near(m.length_m, 0.2, 1e-12);
    near(m.time_s, 1.0, 1e-12);
    // Differences of v: 0.1, 0.2, -0.3, 0; of those, over 0.5 s each: 0.2, 0.2, -1, 0.6.
    near(m.mean_acceleration_mps2, 0.6, 1e-12);
    near(m.mean_jerk_mps3, 0.2 + 0.2 + 1.0 + 0.6, 1e-12);
    near(m.mean_joint_jerk_rads3, (0.2 + 0.4 + 0.2) / 0.5, 1e-12);
}

#[test]
fn the_lattice_path_stops_where_it_changes_from_driving_to_turning() {
    let state = |x: f64, yaw: f64, blade: f64| SearchState { pose: Pose2::new(x, 0.0, yaw), joints: vec![blade] };
    let states = vec![state(0.0, 0.0, 0.0), state(1.0, 0.0, 0.0), state(2.0, 0.0, 0.0), state(2.0, 2.0, 0.0)];
    let moves = vec![SearchMove::Forward, SearchMove::Forward, SearchMove::Still];
    let m = of_search(&SearchPath { states, moves, expanded: 9 }, &robot());
    // 2 m at 0.5 m/s and 0.25 m/s^2: 4 + 2 s, no stop between; 2 rad at 1 rad/s and 0.5 rad/s^2: 2 + 2 s.
    near(m.time_s, 10.0, 1e-12);
    near(m.length_m, 2.0, 1e-12);
    near(m.mean_acceleration_mps2, 2.0 * 0.5 / 10.0, 1e-9);
    // The turn has no plateau: a difference over 0.05 s cuts the tip of its triangle.
    near(m.mean_angular_acceleration_rads2, 2.0 * 1.0 / 10.0, 2e-2);
    near(m.mean_jerk_mps3, 4.0 * 0.25 / 10.0, 1e-6);
    assert_eq!(m.mean_joint_jerk_rads3, 0.0);
}

#[test]
fn a_slow_joint_slows_the_drive_it_accompanies() {
    let state = |x: f64, blade: f64| SearchState { pose: Pose2::new(x, 0.0, 0.0), joints: vec![blade] };
    let states = vec![state(0.0, 0.0), state(0.5, 3.0)];
    let path = SearchPath { states, moves: vec![SearchMove::Reverse], expanded: 1 };
    let m = of_search(&path, &robot());
    // The parameter runs over 3 (3 rad at 1 rad/s) with speed 1 and acceleration min(2, 0.25 * 3 / 0.5) = 1.5.
    near(m.time_s, 3.0 + 1.0 / 1.5, 1e-12);
    near(m.length_m, 0.5, 1e-12);
}
