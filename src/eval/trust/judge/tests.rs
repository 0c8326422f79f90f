use nalgebra::Isometry3;
use parry3d_f64::math::{Pose, Rotation, Vector};
use parry3d_f64::query;
use parry3d_f64::shape::{Ball, ConvexPolyhedron, Cuboid, Cylinder, Shape as PeerShape};

use super::solid::{Placed, Solid};
use super::*;
use crate::eval::rng::Rng;
use crate::eval::trust::{self, Family, Outcome, draw};
use crate::robot::{Convex, Shape};

fn peer(convex: &Convex) -> (Box<dyn PeerShape>, Rotation) {
    let upright = Rotation::from_rotation_x(std::f64::consts::FRAC_PI_2);
    match convex {
        Convex::Box { half } => (Box::new(Cuboid::new(Vector::new(half[0], half[1], half[2]))), Rotation::IDENTITY),
        Convex::Sphere { radius } => (Box::new(Ball::new(*radius)), Rotation::IDENTITY),
        Convex::Cylinder { radius, half_length } => (Box::new(Cylinder::new(*half_length, *radius)), upright),
        Convex::Hull { vertices } => {
            let points: Vec<_> = vertices.iter().map(|v| Vector::new(v[0], v[1], v[2])).collect();
            (Box::new(ConvexPolyhedron::from_convex_hull(&points).expect("a hull")), Rotation::IDENTITY)
        }
    }
}

#[test]
fn distances_are_those_of_parry_and_their_bounds_meet() {
    let mut rng = Rng::new(&[11]);
    for _ in 0..400 {
        let convex = draw::convex(&mut rng, 0.4);
        let mut number = |reach: f64| rng.uniform(-reach, reach);
        let turn = nalgebra::Vector3::from_fn(|_, _| number(3.0));
        let at = nalgebra::Vector3::from_fn(|_, _| number(1.0));
        let low = [number(1.0), number(1.0), number(1.0)];
        let size = [0.02 + number(0.5).abs(), 0.02 + number(0.5).abs(), 0.02 + number(0.5).abs()];
        let high = std::array::from_fn(|axis| low[axis] + size[axis]);
        let shape = Shape { link: String::new(), body: 0, pose: Isometry3::identity(), convex: convex.clone() };
        let solid = Solid::of(&shape);
        let about = nalgebra::Rotation3::new(turn);
        let placed = Placed { solid: &solid, turn: about.into_inner(), at };
        let [lower, upper] = placed.to_box(&low, &high);
        assert!(upper - lower < 1e-7, "{convex:?}: {lower} to {upper}");
        let (other, upright) = peer(&convex);
        let turned = Rotation::from_scaled_axis(Vector::new(turn.x, turn.y, turn.z)) * upright;
        let pose = Pose::from_parts(Vector::new(at.x, at.y, at.z), turned);
        let half = Cuboid::new(Vector::new(0.5 * size[0], 0.5 * size[1], 0.5 * size[2]));
        let middle: [f64; 3] = std::array::from_fn(|axis| low[axis] + 0.5 * size[axis]);
        let place = Pose::from_parts(Vector::new(middle[0], middle[1], middle[2]), Rotation::IDENTITY);
        let truth = query::distance(&pose, &*other, &place, &half).expect("supported").distance;
        // Both of our bounds are of real points and planes; parry's own iteration on cylinders ends some micrometres early.
        let early = if matches!(convex, Convex::Cylinder { .. }) { 2e-5 } else { 1e-6 };
        assert!((truth - upper).abs() < early, "{convex:?}: {upper}, parry {truth}");
    }
}

#[test]
fn a_ball_that_is_driven_past_a_cell_comes_as_near_as_geometry_says() {
    // A ball of 0.1 m drives along y = 0 past a cell whose nearest face is at y = 0.35: 0.25 m, between two rows.
    let mut rng = Rng::new(&[3]);
    let mut robot = draw::bare(&mut rng);
    draw::add_shape(&mut robot, 0, Isometry3::identity(), Convex::Sphere { radius: 0.1 });
    let mut case =
        trust::Case::new(Family::Between, robot, crate::geom::Pose2::default(), &[], 0.5, &[(1.0, 0.0, vec![])]);
    let mut map = VoxelMap::new(0.01, [0.24, 0.35, 0.295], [1, 1, 1], Unknown::Free);
    map.occupy([0, 0, 0]);
    case.map = Some(map);
    // Along the face the distance stays the same for 10 ms, where every look is needed.
    let found = least_clearance(&case, 1e-5);
    assert!(found.lower <= 0.25 && 0.25 <= found.upper + 1e-12 && found.upper - found.lower <= 1e-5, "{found:?}");
    let ends = (0.24f64.powi(2) + 0.35f64.powi(2)).sqrt() - 0.1;
    assert!((clearance_at_rows(&case) - ends).abs() < 1e-9);
    for (clearance, holds) in [(0.2499, true), (0.2501, false)] {
        case.task.clearance = clearance;
        assert_eq!(matches!(judge(&case).truth, Truth::Holds { .. }), holds);
    }
}

#[test]
fn nothing_is_faster_than_its_bound() {
    for index in 0..40 {
        let case = draw::scene(&mut Rng::new(&[7, index]), Family::Above);
        let motion = motion(&case);
        for row in 0..motion.rows() - 1 {
            for shape in 0..case.robot.shapes.len() {
                for base_fixed in [false, true] {
                    let fastest = motion.fastest(shape, row, base_fixed);
                    let parts = 16;
                    let step = case.table.sampling_time / f64::from(parts);
                    for part in 0..parts {
                        let at = |part: i32| motion.place(shape, row, step * f64::from(part), base_fixed);
                        let (one, other) = (at(part), at(part + 1));
                        for d in [[1.0, 0.0, 0.0], [0.3, -0.5, 0.8]] {
                            // Where a point of the shape's own ball gets to.
                            let point = nalgebra::Vector3::from(d).normalize() * one.solid.radius;
                            let moved = (other.turn * point + other.at - one.turn * point - one.at).norm();
                            assert!(moved <= fastest * step + 1e-12, "{moved} in {step} s at {fastest}");
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn a_broken_verdict_is_caught() {
    let mut caught = [0; 3];
    for index in 0..56 {
        let tried = trust::attempt(5, index, &trust::Case::certify);
        assert!(!tried.outcome.is_wrong(), "scene {index}: {:?}", tried.finding);
        // More clearance than there is.
        let mut overstated = tried.certificate.clone();
        overstated.clearance_proven = Some(tried.finding.met + 1e-6);
        if tried.finding.met.is_finite() {
            assert_eq!(trust::compare(&tried.finding, &overstated), Outcome::Overstated);
            caught[0] += 1;
        }
        // Certified whatever is broken.
        let mut blind = tried.certificate.clone();
        blind.refusals.clear();
        if matches!(tried.finding.truth, Truth::Broken(_)) {
            assert_eq!(trust::compare(&tried.finding, &blind), Outcome::WronglyCertified);
            caught[1] += 1;
        }
        // Refused without a reason.
        if matches!(tried.finding.truth, Truth::Holds { spare } if spare >= trust::TO_SPARE) {
            let mut refused = tried.certificate.clone();
            refused.refusals.push(crate::certify::Refusal {
                kind: crate::certify::RefusalKind::Clearance,
                message: String::new(),
                time: None,
            });
            assert_eq!(trust::compare(&tried.finding, &refused), Outcome::WronglyRefused);
            caught[2] += 1;
        }
    }
    assert!(caught.iter().all(|n| *n > 5), "{caught:?}");
}
