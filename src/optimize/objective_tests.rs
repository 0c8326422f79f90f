use super::super::contour::Contour;
use super::super::test_robot::{Balls, robot};
use super::*;
use crate::math::fd::{numeric_gradient, relative_error};

/// Deterministic numbers in [-1, 1].
fn noise(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// A wild curve that oversteps everything: 4 pieces, about 0.5 m each, amid balls.
fn check(joints: usize, reverse: bool, seed: u64) {
    let mut robot = robot(joints);
    // Limits so tight that every penalty acts, and a least speed that the curve falls short of.
    robot.base.min_speed = 0.2;
    let field = Balls(vec![([0.9, 0.5, 0.3], 0.25), ([0.3, -0.6, 0.2], 0.2), ([1.6, -0.3, 0.4], 0.3)]);
    let options = OptimizeOptions {
        clearance: 0.3,
        penalty_width: 0.3,
        motion_weight: 3.0,
        clearance_weight: 5.0,
        ..Default::default()
    };
    let mut next = noise(seed);
    let (pieces, m) = (4, 2 + joints);
    let mut ends = [vec![0.0; 4 * m], vec![0.0; 4 * m]];
    ends[1][0] = 2.0;
    ends[0][m] = 0.25;
    ends[1][m] = 0.25;
    let contour = Contour::new(&robot, 0.1);
    let scratch = ClearancePenalty::new(contour, &robot, options.clearance, options.clearance_scale, 0.0);
    let mut objective =
        Objective::new(&robot, &field, Minco::new(pieces, &ends[0], &ends[1]), reverse, scratch, &options);
    let mut x = Vec::new();
    for i in 1..pieces {
        x.extend([0.5 * i as f64 + 0.05 * next(), 0.15 * next()]);
        x.extend((0..joints).map(|_| 1.2 * next()));
    }
    x.extend((0..pieces).map(|_| time_map::virtual_time(1.1 + 0.3 * next())));
    let mut gradient = vec![0.0; x.len()];
    let cost = objective.evaluate(&x, &mut gradient);
    assert!(cost.is_finite() && cost > 10.0, "penalties act: {cost}");
    let mut ignored = vec![0.0; x.len()];
    let numeric = numeric_gradient(|x| objective.evaluate(x, &mut ignored), &x, 2e-5);
    let error = relative_error(&gradient, &numeric, 1e-3);
    assert!(error < 1e-6, "{joints} joints, reverse {reverse}, seed {seed}: {error:.2e}\n{gradient:?}\n{numeric:?}");
}

#[test]
fn the_gradient_of_the_whole_cost_matches_finite_differences() {
    for seed in 1..6 {
        for joints in 0..3 {
            check(joints, false, seed);
            check(joints, true, seed + 100);
        }
    }
}
