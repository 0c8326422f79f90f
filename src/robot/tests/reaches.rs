//! Bounds over all postures against brute force.

use nalgebra::{Isometry3, Point3, Vector3};
use proptest::prelude::*;

use super::*;
use crate::math::real;
use crate::robot::{Convex, ShapeReach};

/// Points of a shape, in its own frame, that its hull needs, or many of its surface.
fn surface(convex: &Convex) -> Vec<Point3<f64>> {
    let directions = (0..60).map(|i| {
        let z = 1.0 - (2.0 * f64::from(i) + 1.0) / 60.0;
        let (sin, cos) = real::sin_cos(2.4 * f64::from(i));
        Vector3::new((1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z)
    });
    directions.map(|d| Point3::from(convex.support(&d))).collect()
}

/// Checks the claim of [`ShapeReach`] itself: finite differences of every point's position by every joint.
fn assert_bounds(robot: &RobotModel, reaches: &[ShapeReach], top: f64, q: &[f64]) {
    let poses = robot.shape_poses(q);
    assert!(robot.extents(q).max[2] <= top + 1e-12, "top {top} at {q:?}");
    for (index, (shape, reach)) in robot.shapes.iter().zip(reaches).enumerate() {
        let points = surface(&shape.convex);
        for p in &points {
            let p = poses[index] * p;
            assert!(real::hypot(p.x, p.y) <= reach.radius + 1e-12, "{} at {q:?}", shape.link);
        }
        for joint in 0..robot.joint_count() {
            let step = 1e-6;
            let shifted = |sign: f64| -> Isometry3<f64> {
                let mut q = q.to_vec();
                q[joint] += sign * step;
                robot.shape_poses(&q)[index]
            };
            let (ahead, behind) = (shifted(1.0), shifted(-1.0));
            for p in &points {
                let speed = (ahead * p - behind * p).norm() / (2.0 * step);
                assert!(speed <= reach.joints[joint] + 1e-6, "{}: {speed} of {}", shape.link, reach.joints[joint]);
            }
        }
    }
}

fn all_reaches(robot: &RobotModel) -> Vec<ShapeReach> {
    (0..robot.shapes.len()).map(|s| robot.reach(s)).collect()
}

#[test]
fn the_blades_reach_is_their_own_and_tight() {
    let robot = scr_db();
    let reaches = all_reaches(&robot);
    for (shape, reach) in robot.shapes.iter().zip(&reaches) {
        let brute = (0..=2000)
            .map(|i| robot.radius_of(&shape.link, &[std::f64::consts::PI * f64::from(i) / 2000.0]))
            .fold(0.0, f64::max);
        if shape.body == 0 {
            assert_eq!(reach.joints, [0.0], "{}", shape.link);
        } else {
            // The far end of a blade: 0.36 m from the hinge along an axis at 45 degrees, 0.05 and 0.01 m aside.
            let arm = (real::powi(0.36 + 0.01, 2) / 2.0 + real::powi(0.05, 2)).sqrt();
            assert!((reach.joints[0] - arm).abs() < 1e-6, "{} is not {arm}", reach.joints[0]);
            assert!(reach.radius >= brute && reach.radius < brute + 1e-3, "{} for {brute}", reach.radius);
        }
    }
    for i in 0..=20 {
        assert_bounds(&robot, &reaches, robot.top_over_all_postures(), &robot.posture(f64::from(i) / 20.0));
    }
}

impl RobotModel {
    fn radius_of(&self, link: &str, q: &[f64]) -> f64 {
        let only =
            RobotModel { shapes: self.shapes.iter().filter(|s| s.link == link).cloned().collect(), ..self.clone() };
        only.radius(q)
    }
}

#[test]
fn endless_joints_are_bounded_by_one_turn_or_by_a_ball() {
    let turn = |factor: f64| {
        limb("pan", "continuous", "base", "l", r#"<axis xyz="0 0 1"/><limit effort="1" velocity="1"/>"#)
            + &limb(
                "tilt",
                "continuous",
                "l",
                "m",
                &format!(r#"<origin xyz="0.2 0 0"/><axis xyz="0 1 0"/><mimic joint="pan" multiplier="{factor}"/>"#),
            )
    };
    for factor in [1.0, -3.0, 0.37] {
        let robot = read(&with_wheels(&turn(factor)), &RobotSpec::default()).unwrap();
        let (reaches, top) = (all_reaches(&robot), robot.top_over_all_postures());
        assert!(top.is_finite() && reaches.iter().all(|r| r.radius.is_finite() && r.joints[0].is_finite()));
        for i in 0..60 {
            assert_bounds(&robot, &reaches, top, &[f64::from(i) * 1.7 - 50.0]);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn no_point_is_faster_or_farther_than_its_bound(
        links in prop::collection::vec(([-0.4..0.4, -0.4..0.4, -0.4..0.4f64], [-3.0..3.0, -3.0..3.0, -3.0..3.0f64],
            0usize..4, any::<bool>(), -1.5..1.5f64), 1..5),
        postures in prop::collection::vec([-1.0..2.0, -1.0..2.0, -1.0..2.0, -1.0..2.0f64], 12),
    ) {
        let axes = ["1 0 0", "0 1 0", "0 0 1", "0.6 0 -0.8"];
        let mut more = String::new();
        let mut count = 0;
        for (i, (xyz, rpy, axis, slides, factor)) in links.iter().enumerate() {
            let parent = if i == 0 { "base".into() } else { format!("l{}", i - 1) };
            // Every third joint copies the first one.
            let mimic = if i % 3 == 2 {
                format!(r#"<limit lower="-9" upper="9" effort="1" velocity="1"/><mimic joint="j0" multiplier="{factor}" offset="0.2"/>"#)
            } else {
                count += 1;
                LIMIT.into()
            };
            let inside = format!(
                r#"<origin xyz="{} {} {}" rpy="{} {} {}"/><axis xyz="{}"/>{mimic}"#,
                xyz[0], xyz[1], xyz[2], rpy[0], rpy[1], rpy[2], axes[*axis]
            );
            more += &limb(&format!("j{i}"), if *slides { "prismatic" } else { "revolute" }, &parent, &format!("l{i}"), &inside);
        }
        let robot = read(&with_wheels(&more), &RobotSpec::default()).unwrap();
        prop_assert_eq!(robot.joint_count(), count);
        let (reaches, top) = (all_reaches(&robot), robot.top_over_all_postures());
        for posture in &postures {
            let mut q = posture[..count].to_vec();
            robot.clamp(&mut q);
            assert_bounds(&robot, &reaches, top, &q);
        }
    }
}
