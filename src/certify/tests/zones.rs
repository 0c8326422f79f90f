use proptest::prelude::*;

use super::robots::*;
use crate::certify::{Certificate, Demands, RefusalKind, certify_through};
use crate::geom::{Pose2, distance_to_area};
use crate::mission::SpeedZone;

fn judged(held: &[(f64, f64)], polygon: &[[f64; 2]], speed: f64) -> Certificate {
    let robot = bare_robot();
    let held: Vec<_> = held.iter().map(|(v, turn)| (*v, *turn, Vec::new())).collect();
    let (table, task) = commands(&robot, Pose2::default(), &[], 0.1, &held);
    let zones = [SpeedZone { polygon: polygon.to_vec(), speed }];
    certify_through(&table, &robot, None, &task, Demands { vias: &[], zones: &zones, link: None })
}

#[test]
fn a_zone_between_two_rows_is_seen() {
    // One row leads from x = 0.1 to 0.2 m at 1 m/s, over a zone 1 mm wide; before and after it is slow.
    let held = [(0.5, 0.0), (0.5, 0.0), (1.0, 0.0), (0.5, 0.0)];
    let strip = |x: f64| [[x, -1.0], [x + 1e-3, -1.0], [x + 1e-3, 1.0], [x, 1.0]];
    for (x, peak) in [(0.05, 0.5), (0.149, 1.0), (0.1005, 1.0), (0.0985, 0.5), (0.1985, 1.0), (0.2005, 0.5)] {
        let certificate = judged(&held, &strip(x), 0.9);
        assert_eq!(certificate.zones[0].peak, Some(peak), "{x}");
        assert_eq!(certificate.holds(), peak < 0.9);
        if let Some(refusal) = certificate.refusals.first() {
            assert_eq!((refusal.kind, refusal.time), (RefusalKind::Zone, Some(0.2)));
            assert!(refusal.message.contains("1.000000 m/s at t = 0.200 s in or at speed_zones[0]"), "{refusal:?}");
        }
    }
    assert_eq!(judged(&held, &strip(0.3), 0.9).zones[0].peak, None, "it ends before that");
    // Nearer than a tenth of a millimetre counts as in it.
    for (x, peak) in [(0.20005, 1.0), (0.20015, 0.5), (0.1 - 1.05e-3, 1.0), (0.1 - 1.15e-3, 0.5)] {
        assert_eq!(judged(&held, &strip(x), 0.9).zones[0].peak, Some(peak), "{x}");
    }
    // So far from the origin a coordinate is known to some 1e-8 m only, so as much counts as in it besides.
    let far = |x: f64| [[x, -9e5], [x + 1e-3, -9e5], [x + 1e-3, 9e5], [x, 9e5]];
    assert_eq!(judged(&held, &far(0.2 + 1e-4 + 1.5e-8), 0.9).zones[0].peak, Some(1.0));
}

#[test]
fn a_zone_that_is_passed_closely_is_not_entered() {
    // 2 cm beside the middle of a row that is 10 cm long.
    let beside = [[0.14, 0.02], [0.16, 0.02], [0.16, 0.1], [0.14, 0.1]];
    assert_eq!(judged(&[(0.5, 0.0), (0.5, 0.0), (1.0, 0.0)], &beside, 0.1).zones[0].peak, None);
}

#[test]
fn the_speed_of_a_zone_is_allowed_in_it_and_a_millionth_more_is_not() {
    let square = [[0.05, -0.1], [0.3, -0.1], [0.3, 0.1], [0.05, 0.1]];
    for (over, holds) in [(0.0, true), (1e-6, false)] {
        assert_eq!(
            judged(&[(0.5, 0.0), (-0.5, 0.0), (0.5, 0.0), (0.5, 0.0)], &square, 0.5 / (1.0 + over)).holds(),
            holds
        );
    }
    // Turning on the spot is no driving.
    let certificate = judged(&[(0.0, 3.0), (0.0, -3.0)], &[[-1.0, -1.0], [1.0, -1.0], [0.0, 1.0]], 0.01);
    assert!(certificate.holds() && certificate.zones[0].peak == Some(0.0));
}

proptest! {
    #[test]
    fn no_instant_in_a_zone_is_faster_than_what_is_proven(
        held in prop::collection::vec((0.0..1.0f64, -3.0..3.0f64), 1..12),
        corners in prop::collection::vec([-0.2..0.6f64, -0.3..0.3], 3..6),
    ) {
        let peak = judged(&held, &corners, 1.0).zones[0].peak.unwrap_or(f64::NEG_INFINITY);
        let mut pose = Pose2::default();
        for (speed, turn) in held {
            for k in 0..=20 {
                let at = pose.after_twist(speed, turn, 0.005 * f64::from(k));
                prop_assert!(distance_to_area([at.x, at.y], &corners) > 0.0 || speed <= peak + 1e-12);
            }
            pose = pose.after_twist(speed, turn, 0.1);
        }
    }
}
