//! Speed of `optimize`: one MINCO solve with its gradient, and a whole path of about 10 m with four corners between boxes, in both
//! parameterisations; and the same driven by a robot with an arm of seven joints that folds on the way.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{Isometry3, Vector3};
use trajc::geom::Pose2;
use trajc::math::real;
use trajc::mission::Parameterisation;
use trajc::optimize::minco::Minco;
use trajc::optimize::{DistanceField, OptimizeOptions, optimize_in};
use trajc::robot::{
    BaseLimits, Body, BodyMotion, Convex, IgnoreReason, IgnoredPair, MotionLimits, MovingJoint, RobotModel, Shape,
};
use trajc::search::{SearchMove, SearchPath, SearchState};

/// Distance to boxes `[x, y, half side]`, 0.4 m high; as slow as a look-up in a grid would be fast.
struct Boxes(Vec<[f64; 3]>);

impl DistanceField for Boxes {
    fn distance(&self, p: [f64; 3]) -> f64 {
        self.distance_gradient(p).0
    }
    fn distance_gradient(&self, p: [f64; 3]) -> (f64, [f64; 3]) {
        let mut best = (1e3, [0.0; 3]);
        for [x, y, half] in &self.0 {
            let d = [p[0] - x, p[1] - y, p[2] - 0.2];
            let out = [d[0].abs() - half, d[1].abs() - half, d[2].abs() - 0.2].map(|v| v.max(0.0));
            let norm = (out[0] * out[0] + out[1] * out[1] + out[2] * out[2]).sqrt();
            if norm < best.0 {
                let unit = 1.0 / norm.max(1e-9);
                best = (norm, [0, 1, 2].map(|k| out[k] * unit * d[k].signum()));
            }
        }
        best
    }
    fn cell(&self) -> f64 {
        0.05
    }
}

fn robot() -> RobotModel {
    let limits = MotionLimits { speed: Some(1.0), acceleration: Some(1.0), jerk: Some(4.0) };
    RobotModel {
        name: "box".into(),
        wheel_radii: 0.08.into(),
        track_width: 0.32,
        root_link: "base_link".into(),
        base_from_root: Isometry3::identity(),
        joints: Vec::new(),
        bodies: vec![Body { link: "base_link".into(), parent: 0, origin: Isometry3::identity(), motion: None }],
        shapes: vec![Shape {
            link: "base_link".into(),
            body: 0,
            pose: Isometry3::translation(0.0, 0.0, 0.15),
            convex: Convex::Box { half: [0.2, 0.2, 0.15] },
        }],
        wheel: limits,
        base: BaseLimits {
            speed: 1.0,
            acceleration: 1.0,
            angular_speed: 2.5,
            angular_acceleration: 2.5,
            eta: 0.4,
            min_speed: 0.01,
        },
        ignore_pairs: Vec::new(),
        tolerance: None,
        links: Vec::new(),
    }
}

/// [`robot`] with an arm of seven links, which turn about z and y by turns.
fn armed() -> RobotModel {
    let mut armed = robot();
    for joint in 0..7 {
        let limits = MotionLimits { speed: Some(2.0), acceleration: Some(6.0), jerk: Some(25.0) };
        let name = format!("link{joint}");
        let links = [armed.bodies[joint].link.clone(), name.clone()];
        armed.ignore_pairs.push(IgnoredPair { links, reason: IgnoreReason::Joined });
        armed.joints.push(MovingJoint { name: name.clone(), prismatic: false, lower: -2.6, upper: 2.6, limits });
        let axis = if joint % 2 == 0 { Vector3::z_axis() } else { Vector3::y_axis() };
        let origin = Isometry3::translation(0.0, 0.0, if joint == 0 { 0.3 } else { 0.16 });
        let motion = BodyMotion { joint, multiplier: 1.0, offset: 0.0, axis, prismatic: false };
        armed.bodies.push(Body { link: name.clone(), parent: joint, origin, motion: Some(motion) });
        let convex = Convex::Cylinder { radius: 0.04, half_length: 0.06 };
        armed.shapes.push(Shape { link: name, body: joint + 1, pose: Isometry3::translation(0.0, 0.0, 0.08), convex });
    }
    armed
}

fn path(steps: &[(f64, f64)]) -> SearchPath {
    let mut states = vec![SearchState { pose: Pose2::default(), joints: Vec::new() }];
    let mut moves = Vec::new();
    for &(turn, length) in steps {
        let from = states[states.len() - 1].pose;
        let yaw = from.yaw + turn;
        let pose = Pose2::new(from.x + length * real::cos(yaw), from.y + length * real::sin(yaw), yaw);
        states.push(SearchState { pose, joints: Vec::new() });
        moves.push(if length == 0.0 { SearchMove::Still } else { SearchMove::Forward });
    }
    SearchPath { states, moves, expanded: 0 }
}

fn benches(criterion: &mut Criterion) {
    let (pieces, m) = (8, 3);
    let mut end = vec![0.0; 4 * m];
    end[0] = 4.0;
    let mut curve = Minco::new(pieces, &vec![0.0; 4 * m], &end);
    let waypoints: Vec<f64> = (0..(pieces - 1) * m).map(|i| real::sin(i as f64 * 0.7)).collect();
    let durations: Vec<f64> = (0..pieces).map(|i| 0.8 + 0.1 * i as f64).collect();
    let by = vec![0.5; pieces * 8 * m];
    let (mut by_waypoints, mut by_durations) = (vec![0.0; waypoints.len()], vec![0.0; pieces]);
    criterion.bench_function("minco: curve, energy and gradient, 8 pieces, 3 dimensions", |b| {
        b.iter(|| {
            by_waypoints.fill(0.0);
            by_durations.fill(0.0);
            curve.shape(&waypoints, &durations);
            let energy = curve.energy(&[1.0; 3], &mut by_waypoints, &mut by_durations);
            curve.pull_back(&by, &mut by_waypoints, &mut by_durations);
            energy
        });
    });

    let robot = robot();
    let path = path(&[
        (0.5, 0.0),
        (0.0, 1.8),
        (-0.9, 0.0),
        (0.0, 2.0),
        (0.8, 0.0),
        (0.0, 2.0),
        (-0.7, 0.0),
        (0.0, 2.2),
        (0.6, 0.0),
        (0.0, 1.8),
    ]);
    // Boxes inside each corner, just clear of the path.
    let field = Boxes(
        path.states
            .windows(3)
            .filter(|w| w[0].pose.yaw == w[1].pose.yaw && w[1].pose.yaw != w[2].pose.yaw)
            .map(|w| {
                let side = (w[2].pose.yaw - w[1].pose.yaw).signum();
                let out = 0.5 * (w[1].pose.yaw + w[2].pose.yaw) + side * std::f64::consts::FRAC_PI_2;
                [w[1].pose.x + 0.62 * real::cos(out), w[1].pose.y + 0.62 * real::sin(out), 0.2]
            })
            .collect(),
    );
    for parameterisation in [Parameterisation::Flat, Parameterisation::ArcLength] {
        let options = OptimizeOptions { parameterisation, ..Default::default() };
        let name = format!("optimize: 10 m, four corners between boxes, {}", parameterisation.key());
        criterion.bench_function(&name, |b| b.iter(|| optimize_in(&path, &field, &robot, &options)));
    }
    let (armed, mut path) = (armed(), path);
    for (k, state) in path.states.iter_mut().enumerate() {
        let fold = (k as f64 / 5.0).min(1.0);
        state.joints = [0.9, 0.3, -0.6, 0.9, 0.5, 0.7, -0.8].map(|q| q * fold).to_vec();
    }
    criterion.bench_function("optimize: the same with an arm of seven joints", |b| {
        b.iter(|| optimize_in(&path, &field, &armed, &OptimizeOptions::default()));
    });
}

criterion_group!(optimize, benches);
criterion_main!(optimize);
