use super::leg::heading_at_end;
use super::test_robot::{Boxes, robot};
use super::*;
use crate::geom::Pose2;
use crate::math::real;
use crate::search::{SearchMove, SearchState};

/// A path from (turn, distance, joint) steps from the origin; negative distance: reverse.
pub(super) fn path(joints: usize, steps: &[(f64, f64, f64)]) -> SearchPath {
    let posture = |q: f64| if joints > 0 { vec![q] } else { vec![] };
    let mut states = vec![SearchState { pose: Pose2::default(), joints: posture(steps[0].2) }];
    let mut moves = Vec::new();
    for &(turn, distance, joint) in steps {
        let from = states.last().unwrap().clone();
        let yaw = from.pose.yaw + turn;
        let pose = Pose2::new(from.pose.x + distance * real::cos(yaw), from.pose.y + distance * real::sin(yaw), yaw);
        states.push(SearchState { pose, joints: posture(joint) });
        moves.push(match distance {
            0.0 => SearchMove::Still,
            d if d > 0.0 => SearchMove::Forward,
            _ => SearchMove::Reverse,
        });
    }
    SearchPath { states, moves, expanded: 0 }
}

fn flat() -> OptimizeOptions {
    OptimizeOptions { parameterisation: Parameterisation::Flat, ..Default::default() }
}

fn run(path: &SearchPath, field: &Boxes, robot: &RobotModel) -> Trajectory {
    let trajectory = optimize_in(path, field, robot, &flat());
    assert_joined(path, &trajectory);
    trajectory
}

/// Legs join in position, heading and joints, from the path's first state to its last.
fn assert_joined(path: &SearchPath, trajectory: &Trajectory) {
    let mut state = path.states[0].clone();
    let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} is not {b}");
    for leg in &trajectory.legs {
        match leg {
            Leg::Still(still) => {
                near(still.pose.x, state.pose.x);
                near(still.pose.y, state.pose.y);
                near(still.pose.yaw, state.pose.yaw);
                still.joints_from.iter().zip(&state.joints).for_each(|(a, b)| near(*a, *b));
                state.pose.yaw = still.yaw_end;
                state.joints = still.joints_to.clone();
            }
            Leg::Steer(_) => panic!("not in the flat parameterisation"),
            Leg::Drive(drive) => {
                let (curve, end) = (&drive.curve, drive.curve.duration());
                near(curve.derivative(0, 0, 0.0), state.pose.x);
                near(curve.derivative(1, 0, 0.0), state.pose.y);
                near(drive.yaw_start, state.pose.yaw);
                state.joints.iter().enumerate().for_each(|(j, q)| near(curve.derivative(2 + j, 0, 0.0), *q));
                state.joints = (0..state.joints.len()).map(|j| curve.derivative(2 + j, 0, end)).collect();
                let yaw = heading_at_end(drive, 48).expect("the heading never jumps");
                state.pose = Pose2::new(curve.derivative(0, 0, end), curve.derivative(1, 0, end), yaw);
            }
        }
    }
    let goal = path.states.last().unwrap();
    near(state.pose.x, goal.pose.x);
    near(state.pose.y, goal.pose.y);
    near(state.pose.yaw, goal.pose.yaw);
    state.joints.iter().zip(&goal.joints).for_each(|(a, b)| near(*a, *b));
}

/// Every driven leg, solved once more, with its figures.
fn solved(path: &SearchPath, field: &Boxes, robot: &RobotModel) -> Vec<SolvedLeg> {
    let options = flat();
    let context = Context::new(robot, field, &options);
    sections(path, 0, path.moves.len(), &context.limits, Thresholds::of(&options))
        .into_iter()
        .filter_map(|section| match section {
            Section::Drive(drive) => Some(solve(path, &drive, &context)),
            Section::Still(_) => None,
        })
        .collect()
}

/// A wall with a gap that only the raised blades fit, and posts before and after.
pub(super) fn gap() -> (SearchPath, Boxes) {
    let steps = [(0.0, 1.0, 2.0), (0.0, 0.7, 0.2), (0.0, 0.6, 0.2), (0.0, 1.0, 2.5), (0.3, 0.0, 2.5), (0.0, 1.0, 2.5)];
    let field = Boxes(vec![
        ([1.9, 0.32, 0.0], [2.1, 3.0, 1.0]),
        ([1.9, -3.0, 0.0], [2.1, -0.30, 1.0]),
        ([1.0, -0.7, 0.0], [1.2, -0.4, 0.2]),
        ([3.0, 0.5, 0.0], [3.3, 0.8, 1.0]),
    ]);
    (path(1, &steps), field)
}

#[test]
fn a_robot_that_changes_shape_passes_a_gap_with_clearance_and_within_limits() {
    let (path, field) = gap();
    for eta in [0.1, 0.4] {
        let mut robot = robot(1);
        robot.base.eta = eta;
        robot.base.angular_speed = 2.0 * eta * 0.5 / 0.32;
        run(&path, &field, &robot);
        for leg in solved(&path, &field, &robot) {
            assert!(leg.sound);
            assert!(leg.violation.motion < 0.02, "eta {eta}: {:?}", leg.violation);
            // A tolerance of the passes, in metres below the wanted clearance at any contour point.
            assert!(leg.violation.clearance < 0.003, "eta {eta}: {:?}", leg.violation);
        }
    }
}

#[test]
fn in_the_open_it_drives_near_its_limits() {
    let (path, field) = (path(0, &[(0.0, 6.0, 0.0)]), Boxes(vec![]));
    let leg = &solved(&path, &field, &robot(0))[0];
    let time = leg.leg.curve.duration();
    // The trapezoid takes 13 s; 1.3 / v_max a metre is 15.6 s.
    assert!(time > 13.0 && time < 15.6, "{time}");
    assert!(leg.violation.motion < 0.02 && leg.ending == Ending::Converged);
}

#[test]
fn corners_are_rounded_in_one_leg_and_kept_within_limits() {
    use std::f64::consts::FRAC_PI_2;
    let field = Boxes(vec![]);
    let path = path(0, &[(0.0, 2.0, 0.0), (FRAC_PI_2, 0.0, 0.0), (0.0, 2.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.5, 0.0)]);
    let robot = robot(0);
    assert_eq!(run(&path, &field, &robot).legs.len(), 1);
    for leg in solved(&path, &field, &robot) {
        assert!(leg.sound && leg.violation.motion < 0.02, "{:?}", leg.violation);
    }
}

#[test]
fn reverse_driving_and_spins_keep_heading_and_position() {
    let field = Boxes(vec![]);
    let steps = [
        (0.3, 0.0, 0.0),
        (0.0, -1.5, 0.4),
        (0.5, 0.0, 0.4),
        (0.0, -1.0, 0.9),
        (2.5, 0.0, 1.2),
        (0.0, 1.0, 0.2),
        (0.0, 0.0, 2.9),
        (0.0, 0.8, 2.9),
        (1.2, 0.0, 1.0),
    ];
    let trajectory = run(&path(1, &steps), &field, &robot(1));
    let kinds: String = trajectory
        .legs
        .iter()
        .map(|leg| match leg {
            Leg::Still(_) => 's',
            Leg::Drive(drive) if drive.reverse => 'r',
            Leg::Drive(_) => 'f',
            Leg::Steer(_) => '?',
        })
        .collect();
    assert_eq!(kinds, "rsfsfs");
}

#[test]
fn a_path_that_goes_nowhere_stands_still() {
    let state = SearchState { pose: Pose2::new(1.0, 2.0, 3.0), joints: vec![0.5] };
    let path = SearchPath { states: vec![state], moves: Vec::new(), expanded: 0 };
    let trajectory = run(&path, &Boxes(vec![]), &robot(1));
    assert!(matches!(&trajectory.legs[..], [Leg::Still(_)]));
}

/// A field that knows nothing.
pub(super) struct Broken;

impl DistanceField for Broken {
    fn distance(&self, _: [f64; 3]) -> f64 {
        f64::NAN
    }
    fn distance_gradient(&self, _: [f64; 3]) -> (f64, [f64; 3]) {
        (f64::NAN, [f64::NAN; 3])
    }
    fn cell(&self) -> f64 {
        0.05
    }
}

#[test]
fn a_field_of_nans_gives_the_first_guess_back() {
    let path = path(0, &[(0.0, 2.0, 0.0), (0.5, 0.0, 0.0), (0.0, 2.0, 0.0)]);
    let trajectory = optimize_in(&path, &Broken, &robot(0), &flat());
    assert_eq!(trajectory.optimiser.unwrap().ending, Ending::LineSearchStalled);
    assert_joined(&path, &trajectory);
    for leg in &trajectory.legs {
        if let Leg::Drive(drive) = leg {
            assert!(drive.curve.pieces.iter().flat_map(|p| p.coefficients.iter().flatten()).all(|c| c.is_finite()));
        }
    }
}

#[test]
#[ignore = "prints figures for tuning"]
fn figures() {
    let none = Boxes(vec![]);
    let zigzag = [
        (0.6, 0.0, 0.0),
        (0.0, 2.0, 0.0),
        (-1.2, 0.0, 0.0),
        (0.0, 3.0, 0.0),
        (1.2, 0.0, 0.0),
        (0.0, 2.5, 0.0),
        (-0.6, 0.0, 0.0),
    ];
    let corner = [(0.0, 2.0, 0.0), (1.57, 0.0, 0.0), (0.0, 2.0, 0.0)];
    for eta in [0.1, 0.4, 1.0] {
        for (name, path, field, joints) in [
            ("straight", path(0, &[(0.0, 4.0, 0.0)]), &none, 0),
            ("corner", path(0, &corner), &none, 0),
            ("zigzag", path(0, &zigzag), &none, 0),
            ("gap", gap().0, &gap().1, 1),
        ] {
            let mut robot = robot(joints);
            robot.base.eta = eta;
            robot.base.angular_speed = 2.0 * eta * 0.5 / 0.32;
            let begin = std::time::Instant::now();
            let legs = solved(&path, field, &robot);
            let elapsed = begin.elapsed().as_secs_f64() * 1e3;
            for s in legs {
                eprintln!(
                    "{name} eta {eta}: {elapsed:.1} ms, {} pieces, {} iterations, cost {:.3} {:?} sound {} {:?}, {:.2} s, {:.2} m",
                    s.pieces,
                    s.iterations,
                    s.cost,
                    s.ending,
                    s.sound,
                    s.violation,
                    s.leg.curve.duration(),
                    path.length()
                );
            }
        }
    }
}
