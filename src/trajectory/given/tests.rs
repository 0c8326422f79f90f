use super::*;
use crate::diag::{Describe, Diagnostics};
use crate::math::real;
use crate::trajectory::fixtures;

const C_CURVE: [[f64; 2]; 4] = [[0.0, 0.0], [3.0, 0.0], [4.0, 1.0], [4.0, 4.0]];

fn csv(text: &str) -> Result<Trajectory, Vec<GivenError>> {
    from_csv("path.csv", text, &fixtures::scr_db(), &[0.25])
}

fn curve(trajectory: &Trajectory) -> &PiecewisePoly {
    let [Leg::Drive(drive)] = trajectory.legs.as_slice() else { panic!("one drive") };
    &drive.curve
}

#[test]
fn a_segment_is_its_bernstein_sum_and_holds_the_joints() {
    let trajectory = from_bezier(&[C_CURVE], &[0.7]).unwrap();
    assert_eq!(trajectory.source, TrajectorySource::Given);
    for u in [0.0, 0.25, 0.6, 1.0] {
        let bernstein =
            [(1.0 - u) * (1.0 - u) * (1.0 - u), 3.0 * u * (1.0 - u) * (1.0 - u), 3.0 * u * u * (1.0 - u), u * u * u];
        let point = |d: usize| bernstein.iter().zip(C_CURVE).map(|(b, p)| b * p[d]).sum::<f64>();
        assert!((curve(&trajectory).derivative(0, 0, u) - point(0)).abs() < 1e-14);
        assert!((curve(&trajectory).derivative(1, 0, u) - point(1)).abs() < 1e-14);
        assert_eq!(curve(&trajectory).derivative(2, 0, u), 0.7);
    }
}

#[test]
fn segments_with_continuous_curvature_are_one_leg() {
    // De Casteljau's halves of one cubic.
    let mid = |a: [f64; 2], b: [f64; 2]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
    let [a, b, c, d] = C_CURVE;
    let (ab, bc, cd) = (mid(a, b), mid(b, c), mid(c, d));
    let (abc, bcd) = (mid(ab, bc), mid(bc, cd));
    let middle = mid(abc, bcd);
    let trajectory = from_bezier(&[[a, ab, abc, middle], [middle, bcd, cd, d]], &[]).unwrap();
    assert_eq!(curve(&trajectory).pieces.len(), 2);
}

#[test]
fn a_jump_of_curvature_is_a_stop_and_a_jump_of_the_tangent_a_spin() {
    let line = [[0.0, 0.0], [0.3, 0.0], [0.6, 0.0], [1.0, 0.0]];
    let bend = [[1.0, 0.0], [1.4, 0.0], [1.8, 0.3], [2.0, 1.0]];
    let back = [[2.0, 1.0], [1.5, 1.0], [1.0, 1.0], [0.0, 1.0]];
    let trajectory = from_bezier(&[line, bend, back], &[0.1]).unwrap();
    let [Leg::Drive(first), Leg::Drive(second), Leg::Still(spin), Leg::Drive(third)] = trajectory.legs.as_slice()
    else {
        panic!("{:?}", trajectory.legs)
    };
    assert_eq!((first.yaw_start, second.yaw_start), (0.0, 0.0));
    let arrived = real::atan2(0.7, 0.2);
    assert!((spin.pose.yaw - arrived).abs() < 1e-12 && (spin.yaw_end - std::f64::consts::PI).abs() < 1e-12);
    assert_eq!(third.yaw_start, spin.yaw_end);
    assert_eq!((spin.joints_from.as_slice(), spin.joints_to.as_slice()), (&[0.1][..], &[0.1][..]));
}

#[test]
fn degenerate_segments_are_named() {
    let point = [1.0, 1.0];
    let cusp = [[0.0, 0.0], [1.0, 1.0], [0.0, 1.0], [1.0, 0.0]];
    let no_handle = [[0.0, 0.0], [0.0, 0.0], [1.0, 0.0], [1.0, 1.0]];
    let backwards = [[0.0, 0.0], [2.0, 0.0], [-1.0, 0.0], [1.0, 0.0]];
    let apart = [C_CURVE, [[4.0, 4.1], [4.0, 5.0], [5.0, 6.0], [6.0, 6.0]]];
    assert_eq!(from_bezier(&[], &[]), Err(GivenError::NoSegments));
    assert_eq!(from_bezier(&[[point; 4]], &[]), Err(GivenError::NoLength { segment: 1 }));
    assert!(
        matches!(from_bezier(&[cusp], &[]), Err(GivenError::Cusp { segment: 1, parameter }) if (parameter - 0.5).abs() < 1e-6)
    );
    assert!(matches!(from_bezier(&[no_handle], &[]), Err(GivenError::Cusp { parameter, .. }) if parameter < 1e-6));
    assert!(matches!(from_bezier(&[backwards], &[]), Err(GivenError::Cusp { .. })));
    assert!(matches!(from_bezier(&apart, &[]), Err(GivenError::Gap { segment: 2, gap }) if (gap - 0.1).abs() < 1e-12));
    let nan = [[0.0, 0.0], [1.0, f64::NAN], [2.0, 0.0], [3.0, 0.0]];
    assert_eq!(from_bezier(&[C_CURVE, nan], &[]), Err(GivenError::NotFinite { segment: 2 }));
}

#[test]
fn a_csv_path_is_the_spline_that_scipy_makes() {
    let text = "# a path\n\nx_m, y_m, joint.blade.pos_rad\n0,0,0\n1,0.2,0.2\n1.8,1.0,0.9\n# half\n2.0,2.2,1.1\r\n3.1,2.9,1.0\n4.5,2.5,1.4\n";
    let trajectory = csv(text).unwrap();
    // scipy 1.17.1: CubicSpline over chord length, clamped to unit tangents along the end chords; joints natural.
    let expected = [
        (0.05, [0.30295946547921704, 0.048167605820997425, 0.02334482239563899]),
        (0.3, [1.6558351453327311, 0.7188592632696289, 0.71623179816129]),
        (0.5, [1.917326133815728, 1.9137296229293561, 1.1094626138336128]),
        (0.77, [3.147170556209025, 2.901775185144282, 1.0034144496836763]),
        (0.99, [4.4412111185535545, 2.5176583788869653, 1.3766935582750786]),
    ];
    let duration = curve(&trajectory).duration();
    for (share, values) in expected {
        for (d, value) in values.into_iter().enumerate() {
            let ours = curve(&trajectory).derivative(d, 0, share * duration);
            assert!((ours - value).abs() < 1e-13, "{share} of dimension {d}: {ours} vs {value}");
        }
    }
}

#[test]
fn a_linear_joint_column_stays_linear_and_a_missing_one_is_held() {
    let trajectory = csv("x_m,y_m\n0,0\n1,0\n2,1\n").unwrap();
    assert_eq!(curve(&trajectory).derivative(2, 0, 1.3), 0.25);
    let trajectory = csv("joint.blade.pos_rad,x_m,y_m\n0,0,0\n1,1,0\n2,2,0\n3,3,0\n").unwrap();
    assert!((curve(&trajectory).derivative(2, 0, 2.3) - 2.3).abs() < 1e-14);
}

#[test]
fn faults_of_a_csv_file_are_all_named_with_their_lines() {
    let codes = |text: &str| -> Vec<(&'static str, Option<String>)> {
        let errors = csv(text).unwrap_err();
        let quote = |d: crate::diag::Diagnostic| (d.code, d.at.map(|at| at.source.text[at.range].to_owned()));
        Diagnostics::from(errors).0.into_iter().map(quote).collect()
    };
    let at = |text: &str| Some(text.to_owned());
    assert_eq!(codes(""), [("path/too-few-rows", None)]);
    assert_eq!(codes("x_m,y_m\n0,0\n"), [("path/too-few-rows", None)]);
    assert_eq!(codes("x_m,yy\n0,0\n1,1\n"), [("path/unknown-column", at("yy")), ("path/missing-column", at("x_m,yy"))]);
    assert_eq!(codes("x_m,y_m,joint.blad.pos_rad\n0,0,0\n1,1,0"), [("path/unknown-column", at("joint.blad.pos_rad"))]);
    assert_eq!(codes("x_m,y_m,x_m\n0,0,0\n1,1,0"), [("path/double-column", at("x_m"))]);
    assert_eq!(
        codes("x_m,y_m\n0,0\n1,nan\n2\n3,inf\n4,east\n"),
        [
            ("path/not-a-number", at("nan")),
            ("path/ragged", at("2")),
            ("path/not-a-number", at("inf")),
            ("path/not-a-number", at("east"))
        ]
    );
    // Found by fuzzing: its length took seconds to find.
    assert_eq!(codes("x_m,y_m\n0,0\n1e12,0.5\n2,0.4"), [("path/far-away", at("1e12"))]);
    assert_eq!(codes("x_m,y_m\n0,0\n1,1\n# same\n1,1\n2,2\n"), [("path/repeated-point", at("1,1"))]);
    assert_eq!(codes("x_m,y_m\n0,0\n1,0\n0,0\n"), [("path/turns-back", at("1,0"))]);
    assert_eq!(
        codes("x_m,y_m,joint.blade.pos_rad\n0,0,0\n1,0,0\n2,0,3\n3,0,3\n"),
        [("path/joint-range", at("0,0,0"))],
        "a natural spline undershoots before a steep rise"
    );
    let meant = csv("x_m,y_n\n0,0\n1,1\n").unwrap_err()[0].diagnostic();
    assert_eq!(meant.hint.as_deref(), Some("did you mean `y_m`?"));
}
