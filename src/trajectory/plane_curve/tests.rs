use super::*;
use crate::math::real;

fn curve(pieces: &[(f64, Vec<f64>, Vec<f64>)]) -> PiecewisePoly {
    let pieces = pieces.iter().map(|(t, x, y)| Piece { duration: *t, coefficients: vec![x.clone(), y.clone()] });
    PiecewisePoly { pieces: pieces.collect() }
}

/// A parabola y = x^2, whose arc length has a closed form.
fn parabola() -> PlaneCurve {
    PlaneCurve::new(curve(&[(3.0, vec![0.0, 1.0], vec![0.0, 0.0, 1.0])])).unwrap()
}

#[test]
fn the_length_of_a_parabola_is_its_closed_form() {
    let length = |x: f64| 0.25 * (2.0 * x * (1.0 + 4.0 * x * x).sqrt() + real::asinh(2.0 * x));
    let parabola = parabola();
    for x in [1e-9, 0.1, 0.77, 1.5, 2.999, 3.0] {
        assert!((parabola.arc(parabola.place(x)) - length(x)).abs() < 1e-12, "x = {x}");
        assert!((parabola.turn(parabola.place(x)) - real::atan(2.0 * x)).abs() < 1e-14);
    }
}

#[test]
fn arc_length_is_inverted_to_rounding() {
    // A near-cusp: the speed falls to 1e-3 in the middle of the second piece.
    let wild = PlaneCurve::new(curve(&[
        (1.0, vec![0.0, 1.0, 2.0, -1.0], vec![0.0, 0.5, -1.0]),
        (2.0, vec![2.0, -1.0, 0.5], vec![-0.5, 1e-3]),
    ]))
    .unwrap();
    for curve in [parabola(), wild] {
        for i in 0..=200 {
            let arc = curve.length() * f64::from(i) / 200.0;
            assert!((curve.arc(curve.place_at_arc(arc)) - arc).abs() < 1e-13, "at {arc} m");
        }
    }
}

#[test]
fn heading_is_not_wrapped_on_a_curve_that_winds_twice() {
    // Degree-7 pieces of a circle by Taylor expansion, 32 of them over two turns.
    let step = 4.0 * std::f64::consts::PI / 32.0;
    let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
    let pieces: Vec<_> = (0..32)
        .map(|i| {
            let a = step * f64::from(i);
            let term =
                |k: i32, shift: f64| real::cos(a + shift + f64::from(k) * std::f64::consts::FRAC_PI_2) / factorial(k);
            let quarter = -std::f64::consts::FRAC_PI_2;
            (step, (0..8).map(|k| term(k, 0.0)).collect(), (0..8).map(|k| term(k, quarter)).collect())
        })
        .collect();
    let circle = PlaneCurve::new(curve(&pieces)).unwrap();
    assert!((circle.length() - 32.0 * step).abs() < 1e-5);
    assert!((circle.total_turn() - 32.0 * step).abs() < 1e-4);
    assert!((circle.curvature(circle.place(3.0))[0] - 1.0).abs() < 1e-4);
}

#[test]
fn rates_are_the_derivatives_of_arc_and_turn() {
    let c =
        PlaneCurve::new(curve(&[(1.0, vec![0.0, 1.0, 2.0, -1.0, 0.3], vec![0.0, 0.5, -1.0, 0.2, 0.0, 1.0])])).unwrap();
    let h = 1e-5;
    for u in [0.2, 0.5, 0.83] {
        let at = |u: f64| Place { piece: 0, u };
        let (low, high, rates) = (c.rates(at(u - h)), c.rates(at(u + h)), c.rates(at(u)));
        assert!(((c.arc(at(u + h)) - c.arc(at(u - h))) / (2.0 * h) - rates.speed[0]).abs() < 1e-6);
        assert!(((c.turn(at(u + h)) - c.turn(at(u - h))) / (2.0 * h) - rates.turn[0]).abs() < 1e-6);
        for k in 0..2 {
            assert!(((high.speed[k] - low.speed[k]) / (2.0 * h) - rates.speed[k + 1]).abs() < 1e-5);
            let slope = (high.turn[k] - low.turn[k]) / (2.0 * h);
            assert!((slope - rates.turn[k + 1]).abs() < 1e-6 * slope.abs().max(1.0), "{slope} {rates:?}");
        }
    }
}

#[test]
fn a_cusp_or_a_bad_number_is_refused() {
    let cusp = PlaneCurve::new(curve(&[(1.0, vec![0.0, -1.0, 1.0], vec![0.0, 0.0])]));
    assert!(matches!(cusp, Err(CurveError::Vanishes { parameter }) if (parameter - 0.5).abs() < 1e-6));
    assert!(PlaneCurve::new(curve(&[(1.0, vec![0.0], vec![1.0])])).is_err());
    let bad = PlaneCurve::new(curve(&[(1.0, vec![0.0, f64::NAN], vec![1.0])]));
    assert_eq!(bad.unwrap_err(), CurveError::NotFinite { piece: 0 });
    assert_eq!(PlaneCurve::new(PiecewisePoly::default()).unwrap_err(), CurveError::Empty);
}
