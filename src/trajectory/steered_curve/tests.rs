use super::*;
use crate::math::real;

fn leg(pose: Pose2, pieces: &[(f64, Vec<f64>, Vec<f64>)]) -> SteerLeg {
    let pieces = pieces.iter().map(|(t, phi, s)| Piece { duration: *t, coefficients: vec![phi.clone(), s.clone()] });
    SteerLeg { pose, curve: PiecewisePoly { pieces: pieces.collect() } }
}

fn curve(pieces: &[(f64, Vec<f64>, Vec<f64>)]) -> SteeredCurve {
    SteeredCurve::new(&leg(Pose2::new(0.0, 0.0, pieces[0].1[0]), pieces)).unwrap()
}

/// The step from 0 to `size` in `t` seconds with three vanishing derivatives at both ends, from `start`.
fn step(start: f64, size: f64, t: f64) -> Vec<f64> {
    let mut c = vec![start, 0.0, 0.0, 0.0];
    c.extend([35.0, -84.0, 70.0, -20.0].iter().enumerate().map(|(k, a)| size * a / real::powi(t, 4 + k as i32)));
    c
}

/// Composite Simpson over one piece: an independent quadrature.
fn simpson(piece: &Piece, to: f64, panels: usize) -> [f64; 2] {
    let h = to / panels as f64;
    let mut sum = [0.0; 2];
    for i in 0..=2 * panels {
        let u = 0.5 * h * i as f64;
        let weight = if i == 0 || i == 2 * panels {
            1.0
        } else if i % 2 == 1 {
            4.0
        } else {
            2.0
        };
        let (sin, cos) = real::sin_cos(piece.derivative(0, 0, u));
        let speed = piece.derivative(1, 1, u);
        sum = [sum[0] + weight * speed * cos, sum[1] + weight * speed * sin];
    }
    sum.map(|s| s * h / 6.0)
}

/// A wild curve: several turns, forth and back, in pieces of degree 7.
fn wild() -> Vec<(f64, Vec<f64>, Vec<f64>)> {
    vec![
        (2.0, vec![0.3, 2.0, -3.0, 1.0, 0.5, -0.2, 0.1, -0.05], vec![0.0, 0.0, 0.0, 1.2, -0.9, 0.3, 0.1, -0.06]),
        (1.5, vec![-0.7, 9.0, 0.0, -2.0, 0.1], vec![0.4, -0.8, 0.0, 1.0, -0.3]),
    ]
}

#[test]
fn a_constant_twist_drives_a_circle() {
    let circle = SteeredCurve::new(&leg(Pose2::new(1.0, -2.0, 0.4), &[(9.0, vec![0.4, 0.7], vec![0.0, 1.3])])).unwrap();
    for t in [0.0, 1e-6, 0.9, 4.4, 8.97, 9.0] {
        let (pose, wanted) = (circle.pose(circle.place(t)), Pose2::new(1.0, -2.0, 0.4).after_twist(1.3, 0.7, t));
        assert!(pose.distance(wanted) < 1e-12 && (pose.yaw - wanted.yaw).abs() < 1e-14, "{pose:?} {wanted:?}");
    }
    assert!((circle.length() - 11.7).abs() < 1e-14 && circle.first_stop_inside().is_none());
    assert!(circle.end_pose().distance(circle.pose(circle.end())) < 1e-12);
}

#[test]
fn a_clothoid_ends_where_fresnels_series_says() {
    // Heading t^2/2: x = sum (-1)^k t^(4k+1) / (2^(2k) (2k)! (4k+1)), y with 2k+1.
    let clothoid = curve(&[(2.5, vec![0.0, 0.0, 0.5], vec![0.0, 1.0])]);
    let series = |t: f64, odd: i32| {
        (0..24).fold((0.0, 1.0f64), |(sum, sign), k| {
            let n = 2 * k + odd;
            let factorial: f64 = (1..=n).map(f64::from).product();
            (sum + sign * real::powi(t, 2 * n + 1) / (real::powi(2.0, n) * factorial * f64::from(2 * n + 1)), -sign)
        })
    };
    for t in [0.1, 1.0, 1.77, 2.5] {
        let pose = clothoid.pose(clothoid.place(t));
        let (x, y) = (series(t, 0).0, series(t, 1).0);
        assert!((pose.x - x).abs() < 1e-12 && (pose.y - y).abs() < 1e-12, "{pose:?} is not ({x}, {y})");
    }
}

#[test]
fn a_spin_keeps_its_place_and_drives_nothing() {
    let spin = curve(&[(2.0, step(0.2, 3.0, 2.0), vec![0.0])]);
    for t in [0.0, 0.3, 1.1, 2.0] {
        let pose = spin.pose(spin.place(t));
        assert_eq!((pose.x, pose.y), (0.0, 0.0));
    }
    assert!((spin.end_pose().yaw - 3.2).abs() < 1e-12);
    assert_eq!((spin.length(), spin.first_stop_inside()), (0.0, Some(0.0)));
}

#[test]
fn a_cusp_drives_forth_and_back() {
    // s = t - t^2/2 with the heading fixed: half a metre forth until t = 1, then back.
    let cusp = curve(&[(2.0, vec![0.5], vec![0.0, 1.0, -0.5])]);
    assert!((cusp.length() - 1.0).abs() < 1e-14 && cusp.end_pose().distance(Pose2::default()) < 1e-15);
    let tip = cusp.pose(cusp.place(1.0));
    assert!(tip.distance(Pose2::new(0.5 * real::cos(0.5), 0.5 * real::sin(0.5), 0.0)) < 1e-15);
    assert!((cusp.first_stop_inside().unwrap() - 1.0).abs() < 1e-12);
    assert!((cusp.travelled(cusp.place(1.5)) - 0.625).abs() < 1e-14);
    assert!((cusp.parameter(cusp.place_at_travelled(0.625)) - 1.5).abs() < 1e-12);
}

#[test]
fn positions_agree_with_a_fine_independent_quadrature() {
    let pieces = wild();
    let wild = curve(&pieces);
    let mut start = [0.0; 2];
    for (index, (duration, ..)) in pieces.iter().enumerate() {
        let piece = &wild.poly().pieces[index];
        for share in [0.13, 0.5, 0.77, 1.0] {
            let u = share * duration;
            let pose = wild.pose(Place { piece: index, u });
            let by_simpson = simpson(piece, u, 20_000);
            let off = real::hypot(pose.x - start[0] - by_simpson[0], pose.y - start[1] - by_simpson[1]);
            assert!(off < 1e-11, "piece {index} at {u}: off by {off}");
        }
        let end = wild.pose(Place { piece: index, u: *duration });
        start = [end.x, end.y];
    }
}

#[test]
fn derivatives_of_the_position_are_its_differences() {
    let wild = curve(&wild());
    let h = 1e-5;
    for t in [0.2, 0.9, 1.6, 2.4, 3.3] {
        let at = |t: f64| wild.point_jet(wild.place(t));
        let (low, here, high) = (at(t - h), at(t), at(t + h));
        for axis in 0..2 {
            for order in 0..2 {
                let slope = (high[axis][order] - low[axis][order]) / (2.0 * h);
                assert!((slope - here[axis][order + 1]).abs() < 1e-5, "axis {axis}, order {order} at {t}");
            }
        }
    }
}

#[test]
fn a_position_from_one_nearby_is_that_from_the_start() {
    let wild = curve(&wild());
    for t in [0.2, 0.9, 1.6, 1.998, 2.4, 3.3] {
        let known = wild.place(t);
        let [x, y] = wild.point_jet(known).map(|axis| axis[0]);
        for step in [-4e-3, -1e-3, 0.0, 3e-3] {
            let place = wild.place(t + step);
            let (near, far) = (wild.point_jet_from(known, [x, y], place), wild.point_jet(place));
            for (near, far) in near.iter().flatten().zip(far.iter().flatten()) {
                assert!((near - far).abs() < 1e-13, "{near} is not {far} at {t} + {step}");
            }
        }
    }
}

#[test]
fn the_distance_driven_is_inverted_and_counts_both_directions() {
    let wild = curve(&wild());
    // Steps of 1/60000 s: the join at 2 s lies between two of them.
    let speeds = (0..210_000).map(|i| wild.jet(1, wild.place((f64::from(i) + 0.5) / 60_000.0))[1].abs());
    let total = speeds.sum::<f64>() / 60_000.0;
    assert!((wild.length() - total).abs() < 1e-7, "{} is not {total}", wild.length());
    for i in 0..=100 {
        let distance = wild.length() * f64::from(i) / 100.0;
        assert!((wild.travelled(wild.place_at_travelled(distance)) - distance).abs() < 1e-13);
    }
}

#[test]
fn rest_at_both_ends_is_no_stop_and_rest_at_a_join_is_one() {
    let drive = curve(&[(3.0, step(0.0, 0.4, 3.0), step(0.0, 1.5, 3.0))]);
    assert_eq!(drive.first_stop_inside(), None);
    let twice = curve(&[(3.0, vec![0.0], step(0.0, 1.5, 3.0)), (2.0, vec![0.0], step(1.5, 1.0, 2.0))]);
    assert_eq!(twice.first_stop_inside(), Some(3.0));
}

#[test]
fn what_cannot_be_driven_is_refused() {
    let refused = |pieces: &[(f64, Vec<f64>, Vec<f64>)]| SteeredCurve::new(&leg(Pose2::default(), pieces)).unwrap_err();
    assert_eq!(refused(&[]), CurveError::Empty);
    assert_eq!(refused(&[(1.0, vec![0.0, f64::NAN], vec![1.0])]), CurveError::NotFinite { piece: 0 });
    assert_eq!(refused(&[(0.0, vec![0.0], vec![1.0])]), CurveError::NotFinite { piece: 0 });
    assert_eq!(refused(&[(1.0, vec![0.0, 1e7], vec![0.0, 1.0])]), CurveError::Winds { piece: 0 });
    assert_eq!(refused(&[(1.0, vec![0.0, 1e300, 1e308], vec![0.0, 1e308])]), CurveError::NotFinite { piece: 0 });
}
