use super::*;
use crate::math::poly::{Piece, PiecewisePoly};
use crate::mission::SpeedZone;
use crate::retime::law::{Task, time_leg};
use crate::retime::zones::Zones;
use crate::robot::RobotModel;
use crate::trajectory::{DriveLeg, SteerLeg, fixtures};

fn task<'a>(robot: &'a RobotModel, zones: &'a [SpeedZone]) -> Task<'a> {
    Task { robot, hold: 0.1, own_timing: true, one_segment: true, leg: 0, zones: Zones::new(zones, robot, 0.1) }
}

/// Heading and arc length in one piece of 5 s, from rest to rest.
fn steered() -> Course {
    let step = |from: f64, size: f64| {
        let high = [35.0, -84.0, 70.0, -20.0].iter().enumerate();
        let high = high.map(|(k, a)| size * a / crate::math::real::powi(5.0, 4 + k as i32));
        [from, 0.0, 0.0, 0.0].into_iter().chain(high).collect::<Vec<_>>()
    };
    let curve =
        PiecewisePoly { pieces: vec![Piece { duration: 5.0, coefficients: vec![step(0.3, 1.1), step(0.0, 1.4)] }] };
    Course::steer(&SteerLeg { pose: Pose2::new(0.0, 0.0, 0.3), curve }, 0.4).unwrap()
}

fn spin_and_straight() -> [Course; 2] {
    let proportional = |drive: f64, turn: f64| {
        Course::Proportional(Proportional {
            pose: Pose2::default(),
            drive,
            turn,
            joints: vec![],
            joint_changes: vec![],
            half_track: 0.2,
        })
    };
    [proportional(0.0, 2.0), proportional(3.0, 0.0)]
}

#[test]
fn what_is_moved_in_a_moment_is_right_to_rounding_of_itself() {
    let robot = fixtures::conv();
    let slow = [SpeedZone { polygon: vec![[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]], speed: 0.2 }];
    let [spin, straight] = spin_and_straight();
    for (course, law) in [(&steered(), TimeLaw::Minco), (&spin, TimeLaw::Minco), (&straight, TimeLaw::Minco)] {
        // Slowed down by the zone, which makes its stretch.
        let leg = time_leg(course, law, task(&robot, &slow)).unwrap();
        let moved = |from: f64, to: f64| {
            let mut out = Vec::new();
            assert!(leg.moved(from, to, &mut out));
            out
        };
        for share in [0.2, 0.4, 0.7] {
            let (t, short) = (share * leg.duration(), 1e-9);
            let mut rates = Vec::new();
            leg.rates(t + 0.5 * short, &mut rates);
            for (moved, rates) in moved(t, t + short).iter().zip(&rates) {
                assert!((moved - short * rates[0]).abs() < 1e-6 * short, "{law:?} {share}: {moved} {rates:?}");
            }
        }
        let (mut from, mut to) = (Vec::new(), Vec::new());
        leg.positions(0.0, &mut from);
        leg.positions(leg.duration(), &mut to);
        for (moved, (to, from)) in moved(0.0, leg.duration()).iter().zip(to.iter().zip(&from)) {
            assert!((moved - (to - from)).abs() < 1e-12);
        }
    }
    let straight = time_leg(&straight, TimeLaw::Auto, task(&robot, &[])).unwrap();
    assert_eq!(straight.stretch, 1.0);
}

#[test]
fn a_leg_of_the_distance_starts_and_ends_at_rest_as_the_third_power_of_time_does() {
    let robot = fixtures::conv();
    for law in [TimeLaw::FixedPoint, TimeLaw::Eq5] {
        let leg = time_leg(&steered(), law, task(&robot, &[])).unwrap();
        let rates = |t: f64| {
            let mut out = Vec::new();
            leg.rates(t, &mut out);
            out
        };
        let (end, margin) = (leg.duration(), NEAR_REST * leg.duration());
        for t in [0.0, end] {
            assert!(rates(t).iter().all(|rates| rates[0] == 0.0 && rates[1] == 0.0), "{:?}", rates(t));
        }
        for share in [0.01, 0.1, 0.5] {
            for (near, far) in [(share * margin, margin), (end - share * margin, end - margin)] {
                for (near, far) in rates(near).iter().zip(&rates(far)) {
                    assert!((near[0] / (share * share * far[0]) - 1.0).abs() < 1e-6, "{share}: {near:?} {far:?}");
                    assert!((near[1] / (share * far[1]) - 1.0).abs() < 1e-6, "{share}: {near:?} {far:?}");
                }
            }
        }
    }
}

#[test]
fn a_printed_leg_passes_the_curves_nodes_at_its_breaks() {
    let robot = fixtures::conv();
    let coefficients = vec![vec![0.0, 1.0, -0.1], vec![0.0, 0.0, 0.12]];
    let curve = PiecewisePoly { pieces: vec![Piece { duration: 2.0, coefficients }] };
    let course = Course::drive(&DriveLeg { curve, reverse: false, yaw_start: 0.0 }, 0.4).unwrap();
    let Course::Curved(curved) = &course else { panic!("a curve") };
    let leg = time_leg(&course, TimeLaw::Printed, task(&robot, &[])).unwrap();
    let breaks = leg.breaks();
    for node in curved.curve.nodes() {
        let [x, y] = curved.curve.point(node);
        let nearest = breaks.iter().map(|t| leg.pose(*t).distance(Pose2::new(x, y, 0.0)));
        assert!(nearest.fold(f64::INFINITY, f64::min) < 1e-9, "{node:?}");
    }
}
