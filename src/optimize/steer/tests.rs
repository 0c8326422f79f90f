use super::guess::{Guess, guess};
use super::problem::{Derivatives, Problem, STIFFNESS, Weights};
use super::rows::{self, Contact, Missed, Rows};
use super::*;
use crate::geom::Pose2;
use crate::math::fd::{numeric_gradient, relative_error};
use crate::math::real;
use crate::mission::SpeedZone;
use crate::optimize::penalty::touch::PointOf;
use crate::optimize::test_robot::{Boxes, arm, robot};
use crate::optimize::tests::{Broken, gap, path};
use crate::trajectory::steered_curve::SteeredCurve;

const WEIGHTS: Weights = Weights { smoothness: 20.0, motion: 30.0, clearance: 200.0, clearance_unit: 0.05 };

fn problem<'a>(robot: &'a RobotModel, field: &'a Boxes, first: &Guess) -> Problem<'a, Boxes> {
    let clearance = ClearancePenalty::new(Contour::new(robot, 0.08), robot, 0.3, 0.05, 0.0);
    let counts: Vec<usize> = (0..first.layout.pieces).map(|k| 6 + 2 * (k % 2)).collect();
    Problem::new(robot, field, clearance, first.directions.clone(), first.fixed.clone(), &counts, WEIGHTS)
}

/// The guess for a path, disturbed so that no term is at rest and many limits are overstepped.
fn disturbed(first: &Guess) -> Vec<f64> {
    let mut x = first.x.clone();
    for (i, (value, fixed)) in x.iter_mut().zip(&first.fixed).enumerate() {
        if !fixed {
            *value += 0.15 * ((i * 37 % 19) as f64 / 9.0 - 1.0);
        }
    }
    x
}

/// Joints, distances and turns of all kinds, past boxes.
fn mixed(joints: usize) -> (SearchPath, Boxes) {
    let steps = [
        (0.7, 0.0, 0.2),
        (0.0, 1.4, 0.9),
        (0.8, 0.0, 0.9),
        (0.0, 1.2, 0.4),
        (2.4, 0.0, 0.4),
        (0.0, -0.9, 1.0),
        (0.4, 0.0, 0.6),
    ];
    let field = Boxes(vec![([0.9, -0.4, 0.0], [1.4, 0.5, 0.6]), ([-0.3, 1.6, 0.0], [0.3, 2.2, 0.4])]);
    let mut path = path(joints.min(1), &steps);
    if joints > 1 {
        path.states.iter_mut().enumerate().for_each(|(i, state)| state.joints.push(0.05 * i as f64));
    }
    (path, field)
}

#[test]
fn the_gradient_matches_finite_differences() {
    for joints in [0, 1, 2] {
        let (path, field) = mixed(joints);
        let robot = robot(joints);
        let first = guess(&path, &Limits::new(&robot, 1.0)).expect("it moves");
        let mut problem = problem(&robot, &field, &first);
        let zone = SpeedZone { polygon: vec![[0.4, -0.3], [1.5, -0.2], [0.9, 1.1]], speed: 0.1 };
        problem.zones = ZonePenalty::new(&[zone], 0.2);
        let x = disturbed(&first);
        let multipliers: Vec<[f64; 2]> = (0..first.layout.pieces).map(|k| [0.3 * k as f64, -0.2]).collect();
        let mut at = Derivatives::new(first.layout);
        assert!(problem.evaluate(&x, &multipliers, &mut at) > 20.0);
        assert!(problem.contacts.points().len() > 5, "{} contour points are near", problem.contacts.points().len());
        assert_gradient(&mut problem, &first, &x, &multipliers, &mut at, [2e-6, 1e-6], |_| true);
    }
}

fn assert_gradient(
    problem: &mut Problem<'_, Boxes>,
    first: &Guess,
    x: &[f64],
    multipliers: &[[f64; 2]],
    at: &mut Derivatives,
    [step, tolerance]: [f64; 2],
    looked_at: impl Fn(usize) -> bool,
) {
    let gradient = at.gradient.clone();
    // The gaps' share is that of the multipliers and of their stiff square.
    let mut whole = |x: &[f64]| {
        let cost = problem.evaluate(x, multipliers, at);
        let gaps = at.gaps.iter().zip(multipliers).flat_map(|(gap, multiplier)| gap.iter().zip(multiplier));
        cost + gaps.map(|(gap, multiplier)| gap * (multiplier + 0.5 * STIFFNESS * gap)).sum::<f64>()
    };
    let numeric = numeric_gradient(|x| whole(x), x, step);
    let those: Vec<usize> = (0..x.len()).filter(|i| looked_at(*i)).collect();
    let size = those.iter().fold(0.0f64, |most, i| most.max(numeric[*i].abs()));
    for i in those {
        let numeric = if first.fixed[i] { 0.0 } else { numeric[i] };
        let off = (gradient[i] - numeric).abs();
        assert!(off < tolerance * (size + 10.0 * numeric.abs()), "{i}: {} {numeric} of {size}", gradient[i]);
    }
}

#[test]
fn the_guess_goes_round_bends_of_the_joints_way_and_across_straight_stretches() {
    let robot = arm(3);
    let limits = Limits::new(&robot, 1.0);
    let steps = [(0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 1.5, 0.0), (0.0, 0.9, 0.0)];
    let mut path = path(0, &steps);
    // Every joint goes one way all along; standing it bends at the second state, driving at the fifth.
    let postures =
        [[0.0, 0.0, 0.0], [0.5, 0.1, 0.0], [0.6, 0.6, 0.2], [0.7, 0.7, 0.3], [0.8, 0.8, 0.4], [0.8, 1.4, 0.4]];
    for (state, posture) in path.states.iter_mut().zip(postures) {
        state.joints = posture.to_vec();
    }
    path.moves[..2].fill(SearchMove::Still);
    let first = guess(&path, &limits).expect("it moves");
    let at_node = |posture: [f64; 3]| {
        let joint = |node: usize, j: usize| first.x[first.layout.state(node, 2 + j, 0)];
        (0..=first.layout.pieces).any(|node| (0..3).all(|j| (joint(node, j) - posture[j]).abs() < 1e-9))
    };
    assert!(at_node(postures[1]) && at_node(postures[4]));
    // Straight on: no node there but by chance.
    assert!(!at_node(postures[3]));
}

/// An arm that is folded down to 6 mm above its own base while the base drives about.
fn folded() -> (RobotModel, SearchPath) {
    let robot = arm(4);
    let pairs = robot.self_pairs();
    let posture = |fold: f64| vec![0.3, 2.0, 0.2, fold];
    // The last link comes down on the base as it folds.
    let (mut apart, mut touching) = (0.0, 1.6);
    assert!(robot.touching(&pairs, &posture(apart)).is_none() && robot.touching(&pairs, &posture(touching)).is_some());
    while touching - apart > 1e-6 {
        let middle = 0.5 * (apart + touching);
        match robot.touching(&pairs, &posture(middle)) {
            Some(_) => touching = middle,
            None => apart = middle,
        }
    }
    let (mut path, _) = mixed(0);
    for state in &mut path.states {
        state.joints = posture(apart - 0.03);
    }
    (robot, path)
}

#[test]
fn the_gradient_where_own_links_are_near_each_other_matches_finite_differences() {
    let (robot, path) = folded();
    let first = guess(&path, &Limits::new(&robot, 1.0)).expect("it moves");
    let field = Boxes(vec![]);
    let mut problem = problem(&robot, &field, &first);
    let mut x = disturbed(&first);
    for node in 0..=first.layout.pieces {
        for joint in 0..4 {
            // Near, not overlapping.
            let at = first.layout.state(node, 2 + joint, 0);
            x[at] = first.x[at] + 1e-3 * (((node * 7 + joint * 3) % 5) as f64 - 2.0) * f64::from(node > 0);
            (1..3).for_each(|order| x[at + order] = 0.0);
        }
    }
    let multipliers = vec![[0.1, -0.2]; first.layout.pieces];
    let mut at = Derivatives::new(first.layout);
    problem.evaluate(&x, &multipliers, &mut at);
    let near = problem
        .contacts
        .points()
        .iter()
        .filter(|contact| matches!(contact.of, Missed::Clearance(PointOf::Pair(_))))
        .count();
    assert!(near > 20, "{near}");
    // Distances are found to 0.1 um, so the way between nearest points to some thousandths. Only joints feel it.
    let block = first.layout.block();
    let joint = |i: usize| i % block >= 6 && i % block < 18 && i.is_multiple_of(3);
    assert_gradient(&mut problem, &first, &x, &multipliers, &mut at, [1e-4, 1e-2], joint);
}

#[test]
fn the_hessian_is_that_of_the_squares_where_all_limits_are_kept() {
    // No limit is active: time, jerk and gaps. For waypoints at fixed durations the jerk's square is quadratic, so Gauss-Newton
    // is exact in every unknown but the durations (and the headings, by which the gaps are curved: left out by no gap).
    let robot = robot(0);
    let path = path(0, &[(0.0, 4.0, 0.0)]);
    let field = Boxes(vec![]);
    let first = guess(&path, &Limits::new(&robot, 1.0)).expect("it moves");
    let mut problem = problem(&robot, &field, &first);
    let mut x = first.x.clone();
    // Long pieces: nothing is fast.
    (0..first.layout.pieces).for_each(|k| x[first.layout.duration(k)] = real::ln(20.0));
    for node in 1..first.layout.pieces {
        x[first.layout.state(node, 1, 1)] = 0.07 - 0.01 * node as f64;
        x[first.layout.state(node, 0, 2)] = 1e-4;
    }
    let zero = vec![[0.0; 2]; first.layout.pieces];
    let mut at = Derivatives::new(first.layout);
    problem.evaluate(&x, &zero, &mut at);
    let hessian = at.hessian.clone();
    for node in 1..first.layout.pieces {
        for order in 0..3 {
            let index = first.layout.state(node, 1, order);
            let mut column = vec![0.0; x.len()];
            let mut unit = vec![0.0; x.len()];
            unit[index] = 1.0;
            hessian.multiply(&unit, &mut column);
            let step = 1e-4;
            let mut gradient = |offset: f64| {
                let mut moved = x.clone();
                moved[index] += offset;
                problem.evaluate(&moved, &zero, &mut at);
                at.gradient.clone()
            };
            let (up, down) = (gradient(step), gradient(-step));
            let numeric: Vec<f64> = up.iter().zip(&down).map(|(u, d)| (u - d) / (2.0 * step)).collect();
            for other in 1..first.layout.pieces {
                let rows: Vec<usize> = (0..3).map(|o| first.layout.state(other, 1, o)).collect();
                let own: Vec<f64> = rows.iter().map(|r| column[*r]).collect();
                let theirs: Vec<f64> = rows.iter().map(|r| numeric[*r]).collect();
                assert!(relative_error(&own, &theirs, 1.0) < 1e-5, "{own:?} {theirs:?}");
            }
        }
    }
}

#[test]
fn iterating_allocates_nothing() {
    for joints in [0, 1, 2] {
        let (path, field) = mixed(joints);
        let robot = robot(joints);
        let first = guess(&path, &Limits::new(&robot, 1.0)).expect("it moves");
        let mut problem = problem(&robot, &field, &first);
        let mut x = disturbed(&first);
        let mut work = Workspace::new(&problem);
        let options = SolverOptions { max_iterations: 40, tolerance: 0.0, gap_tolerance: 1e-9 };
        let mut solved = None;
        let asked = allocation_counter::measure(|| solved = Some(solve(&mut problem, &mut x, &options, &mut work)));
        assert!(solved.is_some_and(|solved| solved.iterations >= 40));
        assert_eq!(asked.count_total, 0, "{joints} joints");
    }
}

#[test]
fn where_the_iteration_ends_little_is_left_to_gain() {
    for joints in [0, 1, 2] {
        let (path, field) = mixed(joints);
        let robot = robot(joints);
        let first = guess(&path, &Limits::new(&robot, 1.0)).expect("it moves");
        let mut problem = problem(&robot, &field, &first);
        let mut work = Workspace::new(&problem);
        let mut x = first.x.clone();
        let usual = SolverOptions { max_iterations: 120, tolerance: 5e-4, gap_tolerance: 1e-9 };
        let ended = solve(&mut problem, &mut x, &usual, &mut work);
        assert!(ended.converged, "{joints} joints: {ended:?}");
        let patient = SolverOptions { max_iterations: 2000, tolerance: 1e-9, gap_tolerance: 1e-9 };
        let best = solve(&mut problem, &mut x, &patient, &mut work);
        assert!(ended.cost < 1.01 * best.cost, "{joints} joints: {ended:?} {best:?}");
    }
}

#[test]
fn the_own_timing_is_the_one_of_least_cost_on_the_same_way() {
    let (path, field) = mixed(1);
    let robot = robot(1);
    let made = |own_smoothness: f64| {
        let mut options = OptimizeOptions { clearance: 0.03, ..Default::default() };
        options.steer.own_smoothness = own_smoothness;
        let trajectory = optimize_steered(&path, &field, &robot, &options, None);
        let [Leg::Steer(leg)] = &trajectory.legs[..] else { panic!("one leg") };
        (leg.clone(), trajectory.optimiser.expect("optimised").slowed)
    };
    let ((quick, one), (gentle, slowed)) = (made(0.0), made(200.0));
    assert!(one == 1.0 && slowed > 1.1, "{one} {slowed}");
    let scales = [robot.wheel.planning()[2] / Limits::new(&robot, 1.0).half_track, robot.wheel.planning()[2]];
    let scales = [scales[0], scales[1], robot.joints[0].limits.planning()[2]];
    let cost = |factor: f64| {
        let mut cost = 0.0;
        for piece in &quick.curve.pieces {
            let n = 2000;
            for sample in 0..n {
                let t = (f64::from(sample) + 0.5) / f64::from(n) * piece.duration;
                let jerks = piece.coefficients.iter().zip(scales).map(|(c, scale)| {
                    let jerk = 6.0 * c[3] + 24.0 * c[4] * t + 60.0 * c[5] * t * t;
                    real::powi(jerk / scale / real::powi(factor, 3), 2)
                });
                cost += factor * piece.duration / f64::from(n) * (1.0 + 200.0 * jerks.sum::<f64>());
            }
        }
        cost
    };
    assert!(cost(slowed) < cost(0.98 * slowed) && cost(slowed) < cost(1.02 * slowed));
    for (quick, gentle) in quick.curve.pieces.iter().zip(&gentle.curve.pieces) {
        assert!((gentle.duration / quick.duration / slowed - 1.0).abs() < 1e-9);
        for (quick, gentle) in quick.coefficients.iter().zip(&gentle.coefficients) {
            let ends = [(quick, 1.0), (gentle, slowed)].map(|(c, factor)| {
                c.iter().enumerate().map(|(power, c)| c * real::powi(0.7 * factor, power as i32)).sum::<f64>()
            });
            assert!((ends[0] - ends[1]).abs() < 1e-9, "{ends:?}");
        }
    }
}

#[test]
fn tension_along_the_way_resists_turning_as_the_hessian_says() {
    let robot = robot(0);
    let path = path(0, &[(0.0, 3.0, 0.0)]);
    let first = guess(&path, &Limits::new(&robot, 1.0)).expect("it moves");
    let field = Boxes(vec![]);
    let mut problem = problem(&robot, &field, &first);
    // Nothing but time and the gaps counts.
    problem.weights.smoothness = 0.0;
    problem.weights.motion = 0.0;
    let (layout, x) = (first.layout, first.x);
    let pull = 0.7;
    let heading = layout.state(1, layout::HEADING, 0);
    let mut gradient = |x: &[f64], pull: f64| {
        let mut at = Derivatives::new(layout);
        problem.evaluate(x, &vec![[-pull, 0.0]; layout.pieces], &mut at);
        (at.gradient[heading], at.hessian.diagonal(heading))
    };
    // What the stiff gaps do is there without tension too.
    let mut slope = |pull: f64| {
        let moved =
            |by: f64| x.iter().enumerate().map(|(i, x)| if i == heading { x + by } else { *x }).collect::<Vec<_>>();
        (gradient(&moved(1e-5), pull).0 - gradient(&moved(-1e-5), pull).0) / 2e-5
    };
    let numeric = slope(pull) - slope(0.0);
    let by_hessian = gradient(&x, pull).1 - gradient(&x, 0.0).1;
    assert!(numeric > 0.1, "{numeric}");
    assert!((by_hessian / numeric - 1.0).abs() < 0.02, "{by_hessian} {numeric}");
}

#[test]
fn points_and_limits_linearised_at_a_place_move_as_they_say() {
    let (path, field) = mixed(1);
    let robot = robot(1);
    let first = guess(&path, &Limits::new(&robot, 1.0)).expect("it moves");
    let mut problem = problem(&robot, &field, &first);
    let x = disturbed(&first);
    let mut at = Derivatives::new(first.layout);
    let zero = vec![[0.0; 2]; first.layout.pieces];
    problem.evaluate(&x, &zero, &mut at);
    let mut contacts: Vec<Contact> = problem.contacts.all().collect();
    rows::sort(&mut contacts);
    let rows = |problem: &mut Problem<'_, Boxes>, x: &[f64]| {
        let mut rows = Rows::of_samples(0, first.layout);
        problem.linearise(&contacts, x, &mut rows);
        rows
    };
    let here = rows(&mut problem, &x);
    assert_eq!(here.rows.len(), contacts.len());
    for row in &here.rows {
        let unit = match row.contact.of {
            Missed::Clearance(_) => WEIGHTS.clearance_unit,
            Missed::Limit(_) => 1.0,
        };
        assert!((row.value - row.contact.short / unit).abs() < 1e-9, "{row:?}");
    }
    let limits = here.rows.iter().filter(|row| matches!(row.contact.of, Missed::Limit(_))).count();
    assert!(limits > 5 && here.rows.len() - limits > 5, "{limits} of {} are limits", here.rows.len());
    // A small step changes each value as its row says; durations too, by what they do to the data.
    let step: Vec<f64> =
        (0..x.len()).map(|i| if first.fixed[i] { 0.0 } else { ((i * 29) % 13) as f64 / 13.0 - 0.5 }).collect();
    let moved = |share: f64| -> Vec<f64> { x.iter().zip(&step).map(|(x, s)| x + share * s).collect() };
    let (up, down) = (rows(&mut problem, &moved(1e-6)), rows(&mut problem, &moved(-1e-6)));
    for (k, ((row, up), down)) in here.rows.iter().zip(&up.rows).zip(&down.rows).enumerate() {
        let slope = problem.along(row.contact.piece, here.by(k), &step);
        let numeric = (up.value - down.value) / 2e-6;
        assert!((slope - numeric).abs() < 1e-4 * (1.0 + numeric.abs()), "{slope} {numeric}");
    }
}

fn steer(path: &SearchPath, field: &Boxes, robot: &RobotModel) -> (SteerLeg, OptimiserOutcome) {
    let options = OptimizeOptions { clearance: 0.03, ..Default::default() };
    let trajectory = optimize_steered(path, field, robot, &options, None);
    let [Leg::Steer(leg)] = &trajectory.legs[..] else { panic!("one leg") };
    (leg.clone(), trajectory.optimiser.expect("optimised"))
}

/// From the path's first state to its last, at rest at both, near every limit where it is fast.
fn assert_motion(path: &SearchPath, leg: &SteerLeg, robot: &RobotModel) {
    let (from, to) = (&path.states[0], &path.states[path.states.len() - 1]);
    let curve = SteeredCurve::new(leg).expect("sound");
    let (start, end) = (curve.pose(curve.start()), curve.end_pose());
    for (pose, wanted) in [(start, from.pose), (end, to.pose)] {
        assert!(pose.distance(wanted) < 1e-7, "{pose:?} {wanted:?}");
        assert!((pose.yaw - wanted.yaw).abs() < 1e-9);
    }
    let (poly, duration) = (&leg.curve, leg.curve.duration());
    for dimension in 0..2 + robot.joints.len() {
        for order in 1..3 {
            for t in [0.0, duration] {
                assert!(poly.derivative(dimension, order, t).abs() < 1e-9);
            }
        }
    }
    for j in 0..robot.joints.len() {
        assert!((poly.derivative(2 + j, 0, 0.0) - from.joints[j]).abs() < 1e-9);
        assert!((poly.derivative(2 + j, 0, duration) - to.joints[j]).abs() < 1e-9);
    }
    // The penalties are soft: a few per cent. The time law keeps the limits.
    let within = |value: f64, limit: f64| assert!(value.abs() < 1.1 * limit, "{value} of {limit}");
    for k in 0..=2000 {
        let t = duration * k as f64 / 2000.0;
        let at = |dimension: usize, order: usize| poly.derivative(dimension, order, t);
        within(at(1, 1), robot.base.speed);
        within(at(1, 2), robot.base.acceleration);
        within(at(0, 2), robot.base.angular_acceleration);
        within(at(0, 1).abs() * 0.16 / robot.base.eta + at(1, 1).abs(), robot.base.speed); // Eq. 14
        for (j, joint) in robot.joints.iter().enumerate() {
            within(at(2 + j, 1), joint.limits.planning()[0]);
        }
    }
}

#[test]
fn a_robot_that_changes_shape_passes_a_gap() {
    let (path, field) = gap();
    let robot = robot(1);
    let (leg, outcome) = steer(&path, &field, &robot);
    assert_eq!(outcome.ending, Ending::Converged);
    assert_motion(&path, &leg, &robot);
    // Every contour point keeps nearly all of the wanted clearance at every instant looked at.
    let contour = Contour::new(&robot, 0.03);
    let curve = SteeredCurve::new(&leg).expect("sound");
    let mut poses = Vec::new();
    for k in 0..=400 {
        let place = curve.place(curve.duration() * k as f64 / 400.0);
        robot.body_poses(&[curve.jet(2, place)[0]], &mut poses);
        let base = curve.pose(place).isometry();
        for shape in &contour.shapes {
            let own = shape.patches.first().map_or(0..0, |whole| whole.first..whole.last);
            for point in &contour.points[own] {
                let at = (base * poses[shape.body] * point.at).coords.into();
                let distance = field.least_above(at, point.rise).0 - point.radius;
                assert!(distance > 0.02, "{distance} at {k}");
            }
        }
    }
}

#[test]
fn a_motion_that_is_taken_over_is_the_same_and_hardly_changes() {
    let (path, field) = mixed(1);
    let robot = robot(1);
    let (leg, outcome) = steer(&path, &field, &robot);
    let first = guess(&path, &Limits::new(&robot, 1.0)).expect("it moves");
    let mut x = first.x.clone();
    take_over(first.layout, &leg, &first.fixed, &mut x);
    let same = curve(first.layout, &x);
    for (a, b) in same.pieces.iter().zip(&leg.curve.pieces) {
        assert!((a.duration - b.duration).abs() < 1e-9);
        let values = |p: &Piece| p.coefficients.concat();
        assert!(values(a).iter().zip(values(b)).all(|(a, b)| (a - b).abs() < 1e-6 * (1.0 + b.abs())));
    }
    let options = OptimizeOptions { clearance: 0.03, ..Default::default() };
    let again = optimize_steered(&path, &field, &robot, &options, Some((&leg, outcome.slowed)));
    let after = again.optimiser.expect("optimised");
    assert!(after.iterations < outcome.iterations / 2, "{} of {}", after.iterations, outcome.iterations);
    assert!((after.cost / outcome.cost - 1.0).abs() < 0.01, "{} {}", after.cost, outcome.cost);
    // One of other pieces is left alone.
    let mut other = first.x.clone();
    let short = SteerLeg { curve: PiecewisePoly { pieces: leg.curve.pieces[1..].to_vec() }, ..leg };
    take_over(first.layout, &short, &first.fixed, &mut other);
    assert_eq!(other, first.x);
}

#[test]
fn spins_cusps_and_joints_alone_are_part_of_one_motion() {
    let (path, _) = mixed(1);
    let robot = robot(1);
    let (leg, _) = steer(&path, &Boxes(vec![]), &robot);
    assert_motion(&path, &leg, &robot);
    let curve = SteeredCurve::new(&leg).expect("sound");
    let last = curve.jet(1, curve.end())[0];
    assert!(last < curve.length() - 0.5, "it drives backwards for a while");
    // On the spot: a quintic from rest to rest would take longer.
    let spin = super::super::tests::path(1, &[(2.0, 0.0, 1.0)]);
    let (leg, _) = steer(&spin, &Boxes(vec![]), &robot);
    assert_motion(&spin, &leg, &robot);
}

#[test]
fn a_straight_line_in_the_open_takes_little_more_than_the_trapezoid() {
    let path = path(0, &[(0.0, 6.0, 0.0)]);
    let robot = robot(0);
    let mut options = OptimizeOptions::default();
    (options.steer.smoothness, options.steer.own_smoothness) = (0.05, 0.05);
    let trajectory = optimize_steered(&path, &Boxes(vec![]), &robot, &options, None);
    let [Leg::Steer(leg)] = &trajectory.legs[..] else { panic!("one leg") };
    // 6 m at 0.5 m/s with ramps of 1 s, and 0.05 s for the jerk of 10 m/s^3.
    let time = leg.curve.duration();
    assert!(time > 12.9 && time < 13.5, "{time}");
}

#[test]
fn a_path_that_goes_nowhere_and_a_field_of_nans_are_survived() {
    let state = crate::search::SearchState { pose: Pose2::new(1.0, 2.0, 3.0), joints: vec![0.5] };
    let nowhere = SearchPath { states: vec![state], moves: Vec::new(), expanded: 0 };
    let trajectory = optimize_steered(&nowhere, &Boxes(vec![]), &robot(1), &OptimizeOptions::default(), None);
    assert!(matches!(&trajectory.legs[..], [Leg::Still(_)]));
    let path = path(0, &[(0.0, 2.0, 0.0), (0.5, 0.0, 0.0), (0.0, 2.0, 0.0)]);
    let trajectory = optimize_steered(&path, &Broken, &robot(0), &OptimizeOptions::default(), None);
    let [Leg::Steer(leg)] = &trajectory.legs[..] else { panic!("one leg") };
    assert!(leg.curve.pieces.iter().flat_map(|p| p.coefficients.iter().flatten()).all(|c| c.is_finite()));
}
