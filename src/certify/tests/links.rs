//! Goals of a link: where its frame ends, against closed forms.

use nalgebra::{Isometry3, UnitQuaternion, Vector3};

use super::robots::*;
use crate::certify::{Certificate, Demands, LINK_ANGLE_TOLERANCE, LinkGoal, RefusalKind, certify_through};
use crate::geom::Pose2;
use crate::math::real;
use crate::robot::LinkFrame;

/// Drives 0.2 m along its heading while a joint turns about the base's y axis from 0 to 0.5 rad; a link is fixed to what it turns.
fn judged(goal: &LinkGoal) -> Certificate {
    let mut robot = with_body(
        with_joint(bare_robot(), false),
        0,
        Isometry3::translation(0.0, 0.0, 0.4),
        [0.0, 1.0, 0.0],
        (0, 1.0, 0.0),
    );
    robot.links = vec![
        LinkFrame { name: "base".into(), body: 0, pose: Isometry3::identity() },
        LinkFrame { name: "tool".into(), body: 1, pose: Isometry3::translation(0.3, 0.0, 0.2) },
    ];
    let held = vec![(0.2, 0.0, vec![0.5]); 10];
    let (table, task) = commands(&robot, Pose2::new(1.0, 2.0, HEADING), &[0.0], 0.1, &held);
    let certificate = certify_through(&table, &robot, None, &task, Demands { link: Some(goal), ..Demands::default() });
    assert!(certificate.refusals.iter().all(|refusal| refusal.kind == RefusalKind::End));
    certificate
}

const HEADING: f64 = std::f64::consts::FRAC_PI_2;

/// Where the tool ends: half a radian nose down, 0.2 m on along y.
fn place() -> [f64; 3] {
    let (sin, cos) = real::sin_cos(0.5);
    [1.0, 2.2 + 0.3 * cos + 0.2 * sin, 0.4 - 0.3 * sin + 0.2 * cos]
}

fn turned() -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), HEADING)
        * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.5)
}

fn goal(position: [f64; 3], rotation: Option<UnitQuaternion<f64>>) -> LinkGoal {
    LinkGoal { link: 1, position, within: 0.01, rotation }
}

#[test]
fn a_link_at_its_place_is_certified_with_what_it_is_off() {
    let certificate = judged(&goal(place(), Some(turned())));
    assert!(certificate.holds(), "{:?}", certificate.refusals);
    let end = certificate.link_end.expect("asked for");
    assert!(end.link == "tool" && end.allowed == 0.01);
    assert!(end.point_error < 1e-9 && end.angle_error.is_some_and(|angle| angle < 1e-7), "{end:?}");
    let [x, y, z] = place();
    let end = judged(&goal([x + 0.002, y - 0.003, z + 0.006], None)).link_end.expect("asked for");
    assert!((end.point_error - 0.007).abs() < 1e-9 && end.angle_error.is_none(), "{end:?}");
}

#[test]
fn a_link_off_by_a_micrometre_or_a_millionth_of_a_radian_too_much_is_refused() {
    for (off, kept) in [(0.01 - 1e-6, true), (0.01 + 1e-6, false)] {
        for axis in 0..3 {
            let mut position = place();
            position[axis] -= off;
            let certificate = judged(&goal(position, Some(turned())));
            assert_eq!(certificate.holds(), kept, "{:?}", certificate.refusals);
        }
    }
    for (off, kept) in [(LINK_ANGLE_TOLERANCE - 1e-6, true), (LINK_ANGLE_TOLERANCE + 1e-6, false), (3.0, false)] {
        for axis in [Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis()] {
            let rotation = turned() * UnitQuaternion::from_axis_angle(&axis, off);
            let certificate = judged(&goal(place(), Some(rotation)));
            assert_eq!(certificate.holds(), kept, "{:?}", certificate.refusals);
        }
    }
    let certificate = judged(&goal([0.0; 3], Some(turned())));
    let [refusal] = &certificate.refusals[..] else { panic!("{:?}", certificate.refusals) };
    assert!(
        refusal.message.contains("link `tool`") && refusal.message.contains("10 mm allowed"),
        "{}",
        refusal.message
    );
}
