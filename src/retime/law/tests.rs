//! The laws against an independent solver's figures: tests/vectors/time_laws.json.

use super::*;
use crate::retime::{RetimeOptions, retime};
use crate::trajectory::{Leg, Trajectory, fixtures, given};

fn vectors() -> serde_json::Value {
    serde_json::from_str(include_str!("../../../tests/vectors/time_laws.json")).unwrap()
}

fn path(name: &str) -> Trajectory {
    let segments: Vec<[[f64; 2]; 4]> =
        serde_json::from_value(vectors()["paths"][name]["control_points"].clone()).unwrap();
    given::from_bezier(&segments, &[]).unwrap()
}

fn task(robot: &RobotModel, own_timing: bool) -> Task<'_> {
    Task { robot, hold: 0.1, own_timing, one_segment: true, leg: 0, zones: Zones::new(&[], robot, 0.1) }
}

fn course(trajectory: &Trajectory) -> Curved {
    let [Leg::Drive(drive)] = trajectory.legs.as_slice() else { panic!("one drive") };
    match Course::drive(drive, 0.4).unwrap() {
        Course::Curved(curved) => curved,
        _ => panic!("a curve"),
    }
}

fn agree(leg: &TimedLeg, row: &serde_json::Value) {
    let number = |v: &serde_json::Value| v.as_f64().unwrap();
    assert!((leg.speed_limit - number(&row["v_max"])).abs() < 6e-6, "{} vs {row}", leg.speed_limit);
    assert!((leg.duration() / leg.stretch - number(&row["time"])).abs() < 6e-5, "{} vs {row}", leg.duration());
    assert!((leg.duration() - number(&row["legal_time"])).abs() < 1.5e-4, "{} vs {row}", leg.duration());
    let peaks = leg.clock_peaks(true).rates;
    for k in 0..3 {
        let peak = peaks[0][k].max(peaks[1][k]);
        assert!((peak - number(&row["peak"][k])).abs() < 6e-5, "order {k}: {peak} vs {row}");
    }
}

#[test]
fn every_law_agrees_with_an_independent_solver_on_the_papers_paths() {
    let robot = fixtures::conv();
    for name in ["c_curve", "s_curve", "arbitrary"] {
        let row = &vectors()["paths"][name];
        let (trajectory, task) = (path(name), task(&robot, false));
        let curved = course(&trajectory);
        assert!((curved.curve.length() - row["length"].as_f64().unwrap()).abs() < 6e-7);
        assert!((largest_curvature(&curved) - row["max_curvature"].as_f64().unwrap()).abs() < 6e-7);
        let centre_only = convolved(&curved, TimeLaw::Eq5, Clock::ArcLength, [0.5, 0.2, 0.2], 0.5, task);
        agree(&centre_only, &row["centre_only"]);
        let law = |law| time_leg(&Course::Curved(curved.clone()), law, task).unwrap();
        agree(&law(TimeLaw::Eq5), &row["eq5_once"]);
        agree(&law(TimeLaw::FixedPoint), &row["fixed_point"]);
        if !row["eq5_printed"].is_null() {
            agree(&law(TimeLaw::Printed), &row["eq5_printed"]);
        }
    }
}

#[test]
fn a_straight_line_takes_the_known_time_under_every_law_that_may_time_it() {
    let robot = fixtures::conv();
    for law in [TimeLaw::Auto, TimeLaw::Eq5, TimeLaw::FixedPoint, TimeLaw::Printed] {
        let profile = retime(&path("line"), &robot, &RetimeOptions { law, sampling_time: 0.1 }).unwrap();
        assert!((profile.time() - 11.5).abs() < 1e-12, "{law:?}: {}", profile.time());
        assert_eq!((profile.v_max(), profile.v_comp()), (0.5, 0.0));
    }
}

#[test]
fn optimal_takes_the_least_time_that_an_independent_solver_finds() {
    let robot = fixtures::conv();
    for name in ["c_curve", "s_curve", "arbitrary"] {
        let row = &vectors()["paths"][name];
        let [least, without_jerk] = ["optimum", "toppra"].map(|key| row[key]["time"].as_f64().unwrap());
        let leg = time_leg(&Course::Curved(course(&path(name))), TimeLaw::Optimal, task(&robot, false)).unwrap();
        let over = leg.duration() / least - 1.0;
        // The solver keeps limits at its nodes only: its own peaks are up to 1e-4 over.
        assert!((-1e-4..5e-3).contains(&over), "{name}: {} s, {least} s", leg.duration());
        assert!(leg.duration() > without_jerk);
    }
}

#[test]
fn wheel_is_the_optimum_where_curvature_keeps_its_sign() {
    let robot = fixtures::conv();
    let time = |name: &str, law| time_leg(&Course::Curved(course(&path(name))), law, task(&robot, false)).unwrap();
    for name in ["c_curve", "s_curve", "arbitrary"] {
        let metric = vectors()["paths"][name]["wheel_metric"]["time"].as_f64().unwrap();
        let leg = time(name, TimeLaw::Wheel);
        let (before, after) = (leg.duration() / leg.stretch, leg.duration());
        if name == "c_curve" {
            assert!((after / metric - 1.0).abs() < 1e-3, "{after} {metric}");
        }
        // Rounded at inflections, the metric is a little longer.
        assert!((-1e-3..0.03).contains(&(before / metric - 1.0)), "{name}: {before} {metric}");
        assert!(after > time(name, TimeLaw::Optimal).duration() * (1.0 - 1e-3));
    }
}

#[test]
fn what_a_law_takes_at_least_is_less_than_it_takes_and_not_by_much() {
    let robot = fixtures::conv();
    for name in ["c_curve", "s_curve", "arbitrary"] {
        let (curved, task) = (course(&path(name)), task(&robot, false));
        for law in [TimeLaw::Eq5, TimeLaw::FixedPoint] {
            let taken = time_leg(&Course::Curved(curved.clone()), law, task).unwrap().duration();
            let least = least_duration(&curved, law, task);
            assert!(least <= taken * (1.0 + 1e-12) && least > 0.7 * taken, "{name} {law:?}: {least} {taken}");
        }
    }
}

#[test]
fn a_law_without_its_timing_is_refused_leg_by_leg() {
    let robot = fixtures::conv();
    let course = Course::Curved(course(&path("c_curve")));
    let refused = |law, task| time_leg(&course, law, task).err();
    assert_eq!(refused(TimeLaw::Minco, task(&robot, false)), Some(RetimeError::NoOwnTiming));
    let several = Task { one_segment: false, ..task(&robot, false) };
    assert_eq!(refused(TimeLaw::Printed, several), Some(RetimeError::PrintedNeedsOneSegment));
    assert_eq!(refused(TimeLaw::Minco, task(&robot, true)), None);
}

#[test]
fn a_legs_breaks_go_from_its_start_to_its_end() {
    let robot = fixtures::conv();
    for law in [TimeLaw::Eq5, TimeLaw::FixedPoint, TimeLaw::Printed, TimeLaw::Optimal, TimeLaw::Minco] {
        let leg = time_leg(&Course::Curved(course(&path("arbitrary"))), law, task(&robot, true)).unwrap();
        let breaks = leg.breaks();
        assert!(breaks[0].abs() < 1e-12 && (breaks[breaks.len() - 1] / leg.duration() - 1.0).abs() < 1e-12, "{law:?}");
        assert!(breaks.windows(2).all(|pair| pair[0] <= pair[1]));
    }
}
