use super::*;
use crate::math::poly::{Piece, PiecewisePoly};
use crate::mission::{SpeedZone, TimeLaw};
use crate::retime::{RetimeOptions, retime, retime_in};
use crate::trajectory::{DriveLeg, Leg, Trajectory, TrajectorySource, fixtures};

/// 4 m along x, straight or along a bend.
fn drive(bend: f64) -> Trajectory {
    let curve = PiecewisePoly {
        pieces: vec![Piece { duration: 1.0, coefficients: vec![vec![0.0, 4.0], vec![0.0, 0.0, bend, -bend]] }],
    };
    let leg = Leg::Drive(DriveLeg { curve, reverse: false, yaw_start: 0.0 });
    Trajectory { legs: vec![leg], source: TrajectorySource::Given, optimiser: None }
}

fn zone(low: f64, high: f64, speed: f64) -> SpeedZone {
    SpeedZone { polygon: vec![[low, -1.0], [high, -1.0], [high, 1.0], [low, 1.0]], speed }
}

#[test]
fn every_law_keeps_a_zone_and_the_fastest_is_slow_only_there() {
    let robot = fixtures::conv();
    let zones = [zone(1.8, 2.2, 0.1)];
    for bend in [0.0, 0.3] {
        for law in [TimeLaw::Auto, TimeLaw::Optimal, TimeLaw::Wheel, TimeLaw::Eq5, TimeLaw::FixedPoint] {
            let options = RetimeOptions { law, sampling_time: 0.1 };
            let profile = retime_in(&drive(bend), &robot, &options, &zones).expect("timed");
            let free = retime(&drive(bend), &robot, &options).expect("timed").time();
            for sampling in [Sampling::Tracked, Sampling::Mean, Sampling::Instant] {
                let table = sample(&profile, &robot, &SampleOptions { sampling_time: 0.1, sampling }).expect("rows");
                let poses = table.replay(table.rows[0].pose);
                for (k, pose) in poses.iter().enumerate() {
                    let (v, turn) = table.twist(k);
                    let next = pose.after_twist(v, turn, 0.1);
                    let touches = next.x > 1.8 && pose.x < 2.2;
                    assert!(!touches || v <= 0.1, "{law:?} {sampling:?} {bend}: {v} at {}", pose.x);
                }
            }
            let time = profile.time();
            if matches!(law, TimeLaw::Auto | TimeLaw::Optimal) {
                // 0.4 m at 0.1 m/s take 4 s; braking and the margins some more. The rest goes on as before.
                assert!(time > free + 3.0 && time < free + 7.0, "{law:?} {bend}: {time} {free}");
            } else {
                assert!(time > 3.0 * free, "{law:?} {bend}: {time} {free}");
            }
            let far = [zone(1.0, 2.0, 0.01)]
                .map(|z| SpeedZone { polygon: z.polygon.iter().map(|p| [p[0], p[1] + 30.0]).collect(), ..z });
            let same = retime_in(&drive(bend), &robot, &options, &far).expect("timed").time();
            assert!((same - free).abs() < 0.11, "{law:?} {bend}: {same} {free}");
        }
    }
}
