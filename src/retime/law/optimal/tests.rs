use super::*;
use crate::geom::Pose2;
use crate::math::poly::{Piece, PiecewisePoly};
use crate::mission::SpeedZone;
use crate::retime::course::Proportional;
use crate::retime::zones::Zones;
use crate::robot::RobotModel;
use crate::trajectory::{DriveLeg, fixtures};

fn task<'a>(robot: &'a RobotModel, zones: &'a [SpeedZone]) -> Task<'a> {
    Task { robot, hold: 0.1, own_timing: false, one_segment: false, leg: 0, zones: Zones::new(zones, robot, 0.1) }
}

/// A curve of pieces: seconds, coefficients of x and y.
fn curved(pieces: &[(f64, [&[f64]; 2])]) -> Curved {
    let pieces = pieces.iter().map(|(duration, rows)| Piece {
        duration: *duration,
        coefficients: rows.iter().map(|row| row.to_vec()).collect(),
    });
    let drive = DriveLeg { curve: PiecewisePoly { pieces: pieces.collect() }, reverse: false, yaw_start: 0.0 };
    match Course::drive(&drive, 0.4).unwrap() {
        Course::Curved(curved) => curved,
        _ => panic!("a curve"),
    }
}

#[test]
fn the_clock_to_start_from_is_the_mean_of_both_wheels_at_their_limits() {
    let robot = fixtures::conv();
    // A parabola: the mean is the root of the mean of the squares.
    let curve = curved(&[(2.0, [&[0.0, 1.0], &[0.0, 0.0, 0.4]])]);
    let Clock::Metric(metric, profile) = reference(&curve, task(&robot, &[])) else { panic!("a metric") };
    let steps = 20_000;
    let sum: f64 = (0..steps)
        .map(|i| {
            let u = 2.0 * (f64::from(i) + 0.5) / f64::from(steps);
            let speed = (1.0 + 0.64 * u * u).sqrt();
            let turn = 0.8 / (1.0 + 0.64 * u * u);
            (0.5 * ((speed - 0.2 * turn) * (speed - 0.2 * turn) + (speed + 0.2 * turn) * (speed + 0.2 * turn))).sqrt()
        })
        .sum();
    let time = sum * 2.0 / f64::from(steps) / 0.5;
    assert!((metric.length() / time - 1.0).abs() < 1e-6, "{} {time}", metric.length());
    // At the wheels' speed 0.5 m/s, acceleration and jerk.
    let wheels = Convolution::fastest(0.5 * time, [0.5, 0.2, 0.2]).duration();
    assert!((profile.duration() / wheels - 1.0).abs() < 1e-6, "{} {wheels}", profile.duration());
}

#[test]
fn a_kink_of_the_curvature_is_planned_for_and_needs_no_slow_down() {
    let robot = fixtures::conv();
    // Straight into a bend that begins at once to grow: the wheels' accelerations jump.
    let curve = curved(&[(1.0, [&[0.0, 1.0], &[0.0]]), (1.0, [&[1.0, 1.0], &[0.0, 0.0, 0.0, 0.5]])]);
    for hold in [0.02, 0.1, 0.5] {
        let leg = time(&curve, Task { hold, ..task(&robot, &[]) }).unwrap();
        assert!(leg.stretch < 1.005, "{hold}: {}", leg.stretch);
    }
    // The longer a command is held, the less a jump is felt.
    let times = [0.02, 0.1, 0.5].map(|hold| time(&curve, Task { hold, ..task(&robot, &[]) }).unwrap().duration());
    assert!(times[0] > 1.02 * times[1] && times[1] > 1.005 * times[2], "{times:?}");
}

#[test]
fn a_leg_that_is_too_fast_at_a_zones_edge_is_made_again_until_it_is_not_and_the_fastest_is_taken() {
    let robot = fixtures::conv();
    let strip = |from: f64, to: f64, speed: f64| SpeedZone {
        polygon: vec![[from, -9.0], [to, -9.0], [to, 9.0], [from, 9.0]],
        speed,
    };
    let mut again = 0;
    for (length, zones) in [
        (6.0, vec![strip(2.5, 3.0, 0.2), strip(3.4, 3.5, 0.1)]),
        (4.0, vec![strip(1.9, 1.91, 0.02)]),
        (4.0, vec![strip(1.9, 2.5, 0.01)]),
        (0.5, vec![strip(0.2, 0.21, 0.05)]),
    ] {
        let task = task(&robot, &zones);
        let leg = TimedLeg {
            course: Course::Proportional(Proportional {
                pose: Pose2::default(),
                drive: length,
                turn: 0.0,
                joints: vec![],
                joint_changes: vec![],
                half_track: 0.2,
            }),
            clock: Clock::Share(Convolution::fastest(1.0, [0.5, 0.2, 0.2].map(|limit| limit / length))),
            stretch: 1.0,
            law: None,
            speed_limit: 0.5,
            compensation: 0.0,
        };
        let mut made = Vec::new();
        let mut tighter = 1.0;
        while made.len() < 3 {
            let (leg, peaks) = paced_once(leg.clone(), task, tighter).unwrap();
            made.push(leg.duration());
            let beyond = peaks.rates.last().unwrap()[0];
            if beyond <= 1.002 {
                break;
            }
            tighter *= beyond;
        }
        let found = paced(leg, task).unwrap().duration();
        let least = made.iter().copied().fold(f64::INFINITY, f64::min);
        assert_eq!(found, least, "{made:?}");
        again += usize::from(least < made[0] * (1.0 - 1e-3));
    }
    assert!(again > 0, "in none of them it is worth it");
}
