//! The barrier function against what it is said to be, written down once more without a thought for speed.

use super::*;

/// Speed, acceleration and jerk limits of three rows; the last one has a speed limit alone.
const LIMITS: [[f64; 3]; 3] = [[1.0, 0.8, 1.5], [1.2, 0.5, 2.0], [0.9, f64::INFINITY, f64::INFINITY]];
const BREAKS: [f64; 3] = [0.0, 1.5, 4.0];

/// The second row's second derivative jumps by 0.2 at 1.5.
fn rates(t: f64, out: &mut Vec<[f64; 3]>) {
    let (sin, cos) = real::sin_cos(t);
    out.push([1.0 + 0.3 * sin, 0.3 * cos, -0.3 * sin]);
    let bent = if t > 1.5 { 0.2 } else { 0.0 };
    out.push([0.5 + 0.1 * t + bent * (t - 1.5), 0.1 + bent, 0.0]);
    let (sin, cos) = real::sin_cos(0.4 * t);
    out.push([0.7 * cos, -0.28 * sin, -0.112 * cos]);
}

fn problem(limits: &[[f64; 3]], jerk_of_jump: f64) -> Problem<'_> {
    Problem { breaks: &BREAKS, limits, jerk_of_jump, step: 0.1 }
}

fn grid(problem: &Problem<'_>) -> Grid {
    Grid::new(problem, 8.0, &mut rates).unwrap()
}

/// One point: its quadrature weight, b, and what is left of every constraint.
struct At {
    weight: f64,
    b: f64,
    left: Vec<f64>,
    /// |jerk| and the jump's share, each as a share of the limit.
    jerks: Vec<[f64; 2]>,
}

/// What is left of every constraint, point by point, as the module's legend says.
fn points(problem: &Problem<'_>, grid: &Grid, x: &[f64]) -> Vec<At> {
    let rows = problem.limits.len();
    let mut all = Vec::new();
    for cell in 0..grid.cells() {
        let h = grid.knots[cell + 1] - grid.knots[cell];
        let p = grid.basis(cell).map(|weights| (0..3).map(|m| weights[m] * x[cell + m]).sum::<f64>());
        for (i, (share, weight)) in [(0.0, 1.0), (0.5, 4.0), (1.0, 1.0)].into_iter().enumerate() {
            let s = share * h;
            let (b, b1, b2) = (p[0] + p[1] * s + p[2] * s * s, p[1] + 2.0 * p[2] * s, 2.0 * p[2]);
            let rates = &grid.rates[(3 * cell + i) * rows..][..rows];
            let cap = rates.iter().zip(problem.limits).map(|(q, limit)| real::powi(limit[0] / q[0], 2));
            let mut at = At {
                weight: weight / 6.0 * h,
                b,
                left: vec![cap.fold(f64::INFINITY, f64::min) - b],
                jerks: Vec::new(),
            };
            for (row, ([q1, q2, q3], [_, a, j])) in rates.iter().zip(problem.limits).enumerate() {
                if a.is_finite() {
                    let l = (q2 * b + 0.5 * q1 * b1) / a;
                    at.left.extend([1.0 - l, 1.0 + l]);
                }
                if j.is_finite() {
                    let jumps: [&[f64]; 3] = [&grid.jumps[cell], &[], &grid.jumps[cell + 1]];
                    let k = problem.jerk_of_jump * jumps[i].get(row).unwrap_or(&0.0) / j;
                    let l = (q3 * b + 1.5 * q2 * b1 + 0.5 * q1 * b2) / j;
                    let room = 1.0 / b.sqrt() - k * b.sqrt();
                    at.left.extend([room - l, room + l]);
                    at.jerks.push([(l * b.sqrt()).abs(), k * b]);
                }
            }
            all.push(at);
        }
    }
    all
}

fn left(problem: &Problem<'_>, grid: &Grid, x: &[f64]) -> Vec<f64> {
    points(problem, grid, x).iter().flat_map(|at| at.left.clone()).chain(x.iter().copied()).collect()
}

fn barrier_function(problem: &Problem<'_>, grid: &Grid, x: &[f64], mu: f64) -> f64 {
    let time: f64 = points(problem, grid, x).iter().map(|at| at.weight / at.b.sqrt()).sum();
    time - mu * left(problem, grid, x).into_iter().map(real::ln).sum::<f64>()
}

/// A shape that is not the same anywhere.
fn wave(count: usize) -> Vec<f64> {
    (0..count).map(|i| 1.0 + 0.2 * real::sin(1.3 * i as f64 + 0.4)).collect()
}

fn inside(barrier: &Barrier, shape: &[f64]) -> Vec<f64> {
    let scale = 0.5 * barrier.largest_scale(shape);
    shape.iter().map(|x| scale * x).collect()
}

/// All constraints in the order of [`left`].
fn constraints(barrier: &Barrier) -> Vec<Constraint> {
    let (a, j) = (barrier.accelerations, barrier.jerks);
    assert_eq!((a, j), (2, 2));
    let mut all = Vec::new();
    for (i, cap) in barrier.caps.iter().enumerate() {
        all.push(*cap);
        for row in 0..a {
            all.extend(barrier.on_acceleration[i * a + row]);
            all.extend(barrier.on_jerk[i * j + row]);
        }
    }
    all.extend(&barrier.signs);
    all
}

#[test]
fn a_shape_is_scaled_until_a_limit_is_met_or_half_of_it_beside_a_jump() {
    // Now one kind of limit is the tightest, now another.
    for (speed, accelerations, jerk, jump) in [
        (0.1, [1.0; 3], 1.0, 0.5),
        (9.0, [0.01; 3], 1.0, 0.5),
        (9.0, [0.01, 9.0, 9.0], 1.0, 0.5),
        (9.0, [9.0; 3], 0.1, 0.0),
        (9.0, [9.0; 3], 0.05, 0.05),
        (9.0, [9.0; 3], 9.0, 1e4),
    ] {
        let limits = [0, 1, 2].map(|row| {
            let [v, a, j] = LIMITS[row];
            [v * speed, a * accelerations[row], j * jerk]
        });
        let problem = problem(&limits, jump);
        let grid = grid(&problem);
        let barrier = Barrier::new(&problem, &grid);
        let rising = (1..=grid.unknowns()).map(|i| i as f64).collect();
        for shape in [vec![1.0; grid.unknowns()], wave(grid.unknowns()), rising] {
            let fits = |scale: f64| {
                let x: Vec<f64> = shape.iter().map(|x| scale * x).collect();
                points(&problem, &grid, &x).iter().all(|at| {
                    // The cap, and both sides of the rows' accelerations.
                    at.left[..3].iter().chain(&at.left[5..7]).all(|left| *left >= 0.0)
                        && at.jerks.iter().all(
                            |[own, jump]| {
                                if *jump > 0.0 { *own <= 0.5 && *jump <= 0.5 } else { *own <= 1.0 }
                            },
                        )
                })
            };
            let found = barrier.largest_scale(&shape);
            assert!(
                fits(found * (1.0 - 1e-9)) && !fits(found * (1.0 + 1e-9)),
                "{speed} {accelerations:?} {jerk}: {found}"
            );
        }
    }
}

#[test]
fn there_are_as_many_constraints_as_there_are_slacks() {
    let problem = problem(&LIMITS, 0.5);
    let grid = grid(&problem);
    let barrier = Barrier::new(&problem, &grid);
    let x = inside(&barrier, &wave(grid.unknowns()));
    assert_eq!(barrier.constraints(), left(&problem, &grid, &x).len());
}

#[test]
fn the_gradient_and_the_hessian_are_those_of_the_barrier_function() {
    let problem = problem(&LIMITS, 0.5);
    let grid = grid(&problem);
    assert!(grid.jumps.iter().any(|jumps| !jumps.is_empty()));
    let mut barrier = Barrier::new(&problem, &grid);
    let (x, count, mu) = (inside(&barrier, &wave(grid.unknowns())), grid.unknowns(), 1e-3);
    let mut down = vec![0.0; count];
    let value = barrier.assemble(&x, mu, true, &mut down).unwrap();
    assert!((value.merit(mu) / barrier_function(&problem, &grid, &x, mu) - 1.0).abs() < 1e-12);
    let hessian = barrier.hessian.rows.clone();
    for i in 0..count {
        let h = 1e-5 * x[i];
        let beside = |sign: f64| {
            let mut beside = x.clone();
            beside[i] += sign * h;
            beside
        };
        let slope = (barrier_function(&problem, &grid, &beside(1.0), mu)
            - barrier_function(&problem, &grid, &beside(-1.0), mu))
            / (2.0 * h);
        assert!((slope + down[i]).abs() < 1e-7 * (1.0 + slope.abs()), "{i}: {slope} {}", -down[i]);
        let [mut low, mut high] = [vec![0.0; count], vec![0.0; count]];
        barrier.assemble(&beside(-1.0), mu, true, &mut low).unwrap();
        barrier.assemble(&beside(1.0), mu, true, &mut high).unwrap();
        for k in i.saturating_sub(2)..=i {
            let bend = (low[k] - high[k]) / (2.0 * h);
            let own = hessian[i][i - k];
            assert!((bend - own).abs() < 1e-5 * hessian[i][0].max(hessian[k][0]), "{i} {k}: {bend} {own}");
        }
    }
}

#[test]
fn multipliers_begin_on_the_central_path_and_stay_near_it() {
    let problem = problem(&LIMITS, 0.5);
    let grid = grid(&problem);
    let mut barrier = Barrier::new(&problem, &grid);
    let (x, mu) = (inside(&barrier, &wave(grid.unknowns())), 1e-3);
    let mut down = vec![0.0; grid.unknowns()];
    let slacks = left(&problem, &grid, &x);
    barrier.assemble(&x, mu, true, &mut down).unwrap();
    for (constraint, left) in constraints(&barrier).iter().zip(&slacks) {
        assert!((constraint.inverse * left - 1.0).abs() < 1e-9 && (constraint.on * left / mu - 1.0).abs() < 1e-9);
    }
    for (factor, kept) in [(1e-9, 1e-3), (0.1, 0.1), (10.0, 10.0), (1e9, 1e3)] {
        let mut barrier = Barrier::new(&problem, &grid);
        barrier.assemble(&x, mu * factor, true, &mut down).unwrap();
        barrier.assemble(&x, mu, false, &mut down).unwrap();
        for (constraint, left) in constraints(&barrier).iter().zip(&slacks) {
            assert!((constraint.on * left / mu / kept - 1.0).abs() < 1e-9, "{factor}");
        }
    }
}

#[test]
fn a_step_goes_as_far_as_every_constraint_keeps_a_hundredth_and_a_small_one_all_the_way() {
    let problem = problem(&LIMITS, 0.5);
    let grid = grid(&problem);
    let mut barrier = Barrier::new(&problem, &grid);
    let (x, count, mu) = (inside(&barrier, &wave(grid.unknowns())), grid.unknowns(), 1e-3);
    let mut down = vec![0.0; count];
    let slacks = left(&problem, &grid, &x);
    for seed in 0..24 {
        // In some places more, in some less, and of either sign.
        let direction: Vec<f64> =
            (0..count).map(|i| x[i] * real::sin(f64::from(seed) + (1.0 + 0.1 * f64::from(seed)) * i as f64)).collect();
        let moved = |share: f64| (0..count).map(|i| x[i] + share * direction[i]).collect::<Vec<_>>();
        let h = 1e-6;
        let (low, high) = (left(&problem, &grid, &moved(-h)), left(&problem, &grid, &moved(h)));
        let slopes: Vec<f64> = low.iter().zip(&high).map(|(low, high)| (high - low) / (2.0 * h)).collect();
        let furthest = slopes.iter().zip(&slacks).map(|(slope, left)| -slope / left).fold(0.0, f64::max);
        for size in [0.5 / furthest, 3.0 / furthest] {
            let step: Vec<f64> = direction.iter().map(|d| size * d).collect();
            barrier.assemble(&x, mu, true, &mut down).unwrap();
            let before = constraints(&barrier);
            let share = barrier.reach(&x, &step, 0.2 * mu);
            let expected = (0.99 / (size * furthest)).min(1.0);
            assert!((share - expected).abs() < 1e-6, "{seed}: {share} {expected}");
            // Newton's multipliers: slack and multiplier, both linearised, have the product that is asked for.
            for (((now, before), slope), left) in constraints(&barrier).iter().zip(&before).zip(&slopes).zip(&slacks) {
                let product = now.on * left + before.on * size * slope;
                assert!((product / mu - 0.2).abs() < 1e-5 * (1.0 + (size * slope / left).abs()), "{seed}: {product}");
            }
        }
    }
}

/// A shape, the rougher the larger, nearly at the limits: no good start.
fn rough(barrier: &Barrier, count: usize, seed: u32, large: f64) -> Vec<f64> {
    let shape: Vec<f64> =
        (0..count).map(|i| real::exp(large * real::sin((1.0 + 0.37 * f64::from(seed)) * i as f64))).collect();
    let scale = 0.99 * barrier.largest_scale(&shape);
    shape.iter().map(|x| scale * x).collect()
}

#[test]
fn from_anywhere_within_the_limits_the_same_least_time_is_found() {
    let problem = problem(&LIMITS, 0.5);
    let grid = grid(&problem);
    let found = |seed: u32, gap: f64| {
        let mut barrier = Barrier::new(&problem, &grid);
        let mut x = rough(&barrier, grid.unknowns(), seed, 1.5);
        let steps = barrier.descend(&mut x, gap);
        assert!(left(&problem, &grid, &x).iter().all(|left| *left > 0.0));
        (barrier.time(&x), steps)
    };
    let (least, _) = found(0, 1e-9);
    for seed in 0..40 {
        let (time, steps) = found(seed, 1e-6);
        assert!((least * (1.0 - 1e-8)..least * (1.0 + 1e-6)).contains(&time), "{seed}: {time} s, {least} s");
        assert!(steps < 40, "{seed}: {steps} steps");
    }
    // Its first step counts.
    assert_eq!(found(1, 1.0).1, 1);
    for gap in [1e-2, 1e-3, 1e-4, 1e-5] {
        assert!(found(0, gap).0 < least * (1.0 + gap), "{gap}");
    }
}

#[test]
fn as_many_steps_are_taken_in_any_unit_of_time() {
    for seed in 0..40 {
        let steps = [1e-4, 1.0, 1e4].map(|unit| {
            let limits = LIMITS.map(|[v, a, j]| [v * unit, a * unit * unit, j * unit * unit * unit]);
            let problem = Problem { step: 0.1 / unit, ..problem(&limits, 0.5 * unit) };
            let grid = grid(&problem);
            let mut barrier = Barrier::new(&problem, &grid);
            let mut x = rough(&barrier, grid.unknowns(), seed, 3.0);
            barrier.descend(&mut x, 1e-6)
        });
        assert!(steps[0] == steps[1] && steps[1] == steps[2], "{seed}: {steps:?}");
    }
}

#[test]
fn what_is_not_finite_is_left_at_once() {
    let problem = problem(&LIMITS, 0.5);
    let grid = grid(&problem);
    let mut barrier = Barrier::new(&problem, &grid);
    assert_eq!(barrier.descend(&mut vec![f64::NAN; grid.unknowns()], 1e-4), 0);
    // Nor does it begin outside the limits.
    assert_eq!(barrier.descend(&mut vec![-1.0; grid.unknowns()], 1e-4), 0);
    assert_eq!(barrier.descend(&mut vec![1e9; grid.unknowns()], 1e-4), 0);
}

#[test]
fn what_is_worse_than_rounding_can_make_it_is_worse() {
    let value = |time: f64| Value { time, logs: -50.0 };
    for mu in [0.0, 0.1] {
        let before = value(3.0);
        for (time, expected) in
            [(2.9, true), (3.0, true), (3.0 * (1.0 + 1e-13), true), (3.0 + 1e-9, false), (3.9, false)]
        {
            assert_eq!(value(time).is_no_worse(before, mu), expected, "{time}");
        }
    }
}
