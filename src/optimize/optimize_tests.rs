use super::leg::heading_at_end;
use super::test_robot::{Boxes, robot};
use super::*;
use crate::geom::Pose2;
use crate::search::{SearchMove, SearchState};

/// A path from (turn, distance, joint) steps from the origin; negative distance: reverse.
fn path(joints: usize, steps: &[(f64, f64, f64)]) -> SearchPath {
    let posture = |q: f64| if joints > 0 { vec![q] } else { vec![] };
    let mut states = vec![SearchState { pose: Pose2::default(), joints: posture(steps[0].2) }];
    let mut moves = Vec::new();
    for &(turn, distance, joint) in steps {
        let from = states.last().unwrap().clone();
        let yaw = from.pose.yaw + turn;
        let pose = Pose2::new(from.pose.x + distance * yaw.cos(), from.pose.y + distance * yaw.sin(), yaw);
        states.push(SearchState { pose, joints: posture(joint) });
        moves.push(match distance {
            0.0 => SearchMove::Still,
            d if d > 0.0 => SearchMove::Forward,
            _ => SearchMove::Reverse,
        });
    }
    SearchPath { states, moves, expanded: 0 }
}

fn report(name: &str, path: &SearchPath, field: &Boxes, joints: usize, eta: f64) -> Trajectory {
    let mut robot = robot(joints);
    robot.base.eta = eta;
    robot.base.angular_speed = 2.0 * eta * 0.5 / 0.32;
    let options = OptimizeOptions::default();
    let context = Context::new(&robot, field, &options);
    let begin = std::time::Instant::now();
    let trajectory = optimize_in(path, field, &robot, &options);
    eprintln!("{name}: {:?} {:.1} ms", trajectory.optimiser, begin.elapsed().as_secs_f64() * 1e3);
    for section in sections(path, 0, path.moves.len(), &context.limits, Thresholds::of(&options)) {
        if let Section::Drive(drive) = section {
            let s = solve(path, &drive, &context);
            eprintln!(
                "   pieces {} iterations {} cost {:.2} {:?} sound {} {:?} time {:.2} s length {:.2}",
                s.pieces,
                s.iterations,
                s.cost,
                s.ending,
                s.sound,
                s.violation,
                s.leg.curve.duration(),
                path.length()
            );
            eprintln!(
                "   T {:.2?} heading {:?}",
                s.leg.curve.pieces.iter().map(|p| p.duration).collect::<Vec<_>>(),
                heading_at_end(&s.leg, 48)
            );
        }
    }
    trajectory
}

#[test]
fn experiment() {
    let none = Boxes(vec![]);
    for eta in [0.1, 0.4, 1.0] {
        report("straight", &path(0, &[(0.0, 4.0, 0.0)]), &none, 0, eta);
        report("corner", &path(0, &[(0.0, 2.0, 0.0), (1.57, 0.0, 0.0), (0.0, 2.0, 0.0)]), &none, 0, eta);
        report(
            "zigzag",
            &path(
                0,
                &[
                    (0.6, 0.0, 0.0),
                    (0.0, 2.0, 0.0),
                    (-1.2, 0.0, 0.0),
                    (0.0, 3.0, 0.0),
                    (1.2, 0.0, 0.0),
                    (0.0, 2.5, 0.0),
                    (-0.6, 0.0, 0.0),
                ],
            ),
            &none,
            0,
            eta,
        );
        let gap = Boxes(vec![
            ([1.9, 0.32, 0.0], [2.1, 3.0, 1.0]),
            ([1.9, -3.0, 0.0], [2.1, -0.30, 1.0]),
            ([1.0, -0.6, 0.0], [1.2, -0.3, 1.0]),
            ([3.0, 0.3, 0.0], [3.3, 0.6, 1.0]),
        ]);
        report(
            "gap",
            &path(
                1,
                &[(0.0, 1.0, 2.0), (0.0, 0.7, 0.2), (0.0, 0.6, 0.2), (0.0, 1.0, 2.5), (0.3, 0.0, 2.5), (0.0, 1.0, 2.5)],
            ),
            &gap,
            1,
            eta,
        );
    }
}
