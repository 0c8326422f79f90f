//! The laws against an independent solver's figures: tests/vectors/time_laws.json.

use super::*;
use crate::math::poly::{Piece, PiecewisePoly};
use crate::retime::{RetimeOptions, retime};
use crate::trajectory::{DriveLeg, Leg, Trajectory, fixtures, given};

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

/// A curve of one piece, timed by itself, with as many joints as there are more rows.
fn own_course(seconds: f64, coefficients: &[&[f64]], track_width: f64) -> Curved {
    let coefficients = coefficients.iter().map(|row| row.to_vec()).collect();
    let curve = PiecewisePoly { pieces: vec![Piece { duration: seconds, coefficients }] };
    let drive = DriveLeg { curve, reverse: false, yaw_start: 0.0 };
    match Course::drive(&drive, track_width).unwrap() {
        Course::Curved(curved) => curved,
        _ => panic!("a curve"),
    }
}

#[test]
fn auto_takes_a_law_of_the_distance_where_it_beats_the_cells_of_the_least_time() {
    let robot = fixtures::conv();
    // As good as straight, where a convolution profile is the least time and all else loses a little.
    let curved = own_course(1.0, &[&[0.0, 3.0], &[0.0, 0.0, 3e-6, -2e-6]], 0.4);
    let auto = time_leg(&Course::Curved(curved.clone()), TimeLaw::Auto, task(&robot, false)).unwrap();
    let optimal = time_leg(&Course::Curved(curved.clone()), TimeLaw::Optimal, task(&robot, false)).unwrap();
    let least = Convolution::fastest(curved.curve.length(), [0.5, 0.2, 0.2]).duration();
    assert!((auto.duration() / least - 1.0).abs() < 1e-5, "{} {least}", auto.duration());
    assert!(optimal.duration() > auto.duration() * (1.0 + 2e-5), "{} {}", optimal.duration(), auto.duration());
}

#[test]
fn without_a_jerk_limit_of_every_wheel_and_joint_auto_tries_the_curves_own_timing() {
    // The blade at its limit all the way, at the curve's own speed; wheels that could do much more.
    let mut robot = fixtures::scr_db();
    let free = crate::robot::MotionLimits { speed: Some(5.0), acceleration: Some(1e3), jerk: Some(1e6) };
    (robot.wheel, robot.base.speed, robot.base.acceleration) = (free, 5.0, 1e3);
    (robot.base.angular_speed, robot.base.angular_acceleration) = (30.0, 6e3);
    let curved = own_course(3.0, &[&[0.0, 0.5], &[0.0, 0.0, 0.01], &[0.0, 1.0]], robot.track_width);
    let auto =
        |robot: &RobotModel| time_leg(&Course::Curved(curved.clone()), TimeLaw::Auto, task(robot, true)).unwrap();
    assert_eq!(auto(&robot).law, Some(TimeLaw::Optimal));
    robot.joints[0].limits = crate::robot::MotionLimits { speed: Some(1.0), acceleration: None, jerk: None };
    // Ramps as short as there are: half of each is added.
    let leg = auto(&robot);
    assert_eq!(leg.law, Some(TimeLaw::Minco));
    assert!((leg.duration() - 3.05).abs() < 1e-3, "{}", leg.duration());
    // Of the wheels alone, the same; also where laws of the distance are as slow all along as in a hairpin.
    let mut wheels = fixtures::conv();
    (wheels.wheel.acceleration, wheels.wheel.jerk, wheels.base.acceleration) = (None, None, 1e3);
    wheels.base.angular_acceleration = 1e4;
    let arc = own_course(6.0, &[&[0.0, 0.4], &[0.0, 0.0, 0.005]], 0.4);
    let hairpin = own_course(1.0, &[&[0.0, 0.3, -0.3], &[0.0, 0.05]], 0.06);
    for (curved, track_width) in [(arc, 0.4), (hairpin, 0.06)] {
        (wheels.track_width, wheels.base.angular_speed) = (track_width, 1.0 / track_width);
        let leg = time_leg(&Course::Curved(curved), TimeLaw::Auto, task(&wheels, true)).unwrap();
        assert_eq!(leg.law, Some(TimeLaw::Minco));
    }
}

#[test]
fn what_a_law_takes_at_least_is_its_profile_at_the_speed_that_is_left() {
    let robot = fixtures::conv();
    for name in ["c_curve", "s_curve", "arbitrary"] {
        let (curved, task) = (course(&path(name)), task(&robot, false));
        let lefts = [
            (TimeLaw::Eq5, left_by_eq5(&curved, TimeLaw::Eq5, Clock::ArcLength, task).unwrap()),
            (TimeLaw::FixedPoint, fixed_point_speed(&curved, &robot)),
        ];
        for (law, left) in lefts {
            let profile = Convolution::fastest(curved.curve.length(), [left, 0.2, 0.2]).duration();
            // Curvature is looked at in nodes alone, so a little less is taken off.
            let least = least_duration(&curved, law, task);
            assert!(least <= profile * (1.0 + 1e-9) && least > 0.98 * profile, "{name} {law:?}: {least} {profile}");
        }
    }
}

#[test]
fn eq5_drives_with_a_thousandth_of_the_speed_and_says_what_it_would_leave_of_less() {
    let robot = fixtures::conv();
    let at = |half_track: f64| Curved { half_track, ..course(&path("c_curve")) };
    let left = |half_track: f64| left_by_eq5(&at(half_track), TimeLaw::Eq5, Clock::ArcLength, task(&robot, false));
    // What Eq. 5 takes off is in proportion to the track.
    let of_a_metre = (0.5 - left(0.1).unwrap()) / 0.1;
    for wanted in [6e-4, 1.9e-3, 0.1] {
        assert!((left((0.5 - wanted) / of_a_metre).unwrap() - wanted).abs() < 1e-12, "{wanted}");
    }
    for wanted in [4e-4, -0.3] {
        let refused = left((0.5 - wanted) / of_a_metre).unwrap_err();
        let RetimeError::CompensationLeavesNoSpeed { left, half_track, .. } = refused else { panic!("{refused:?}") };
        assert!((left - wanted).abs() < 1e-12 && half_track == (0.5 - wanted) / of_a_metre, "{refused:?}");
    }
}

#[test]
fn no_other_pair_of_ramps_ends_sooner_and_limits_are_restored_after_them() {
    let robot = fixtures::conv();
    for (seconds, x, y) in [
        (6.0, [0.0, 0.45, -0.03], [0.0, 0.0, 0.006]),    // fast at its start
        (6.0, [0.0, 0.09, 0.03], [0.0, 0.0, -0.006]),    // fast at its end
        (6.0, [0.0, 0.02, 0.03], [0.0, 0.0, 0.001]),     // nearly at rest at its start
        (6.0, [0.0, 0.38, -0.03], [0.0, 0.012, -0.001]), // the same backwards
        (10.0, [0.0, 0.4, -0.04], [0.0, 0.05, 0.0]),     // a hairpin in the middle
        (40.0, [0.0, 0.45, 0.0], [0.0, 0.0, 0.0005]),    // long
        (1.0, [0.0, 0.9, -0.3], [0.0, 0.0, 0.1]),        // too fast
    ] {
        let curved = own_course(seconds, &[&x, &y], 0.4);
        let task = task(&robot, true);
        let found = own(&curved, task);
        let lengths: Vec<f64> = (0..14)
            .map(|k| 0.05 * crate::math::real::powi(1.5, k))
            .filter(|length| *length < seconds.min(10.0))
            .chain([seconds.min(10.0)])
            .collect();
        let pairs = lengths.iter().flat_map(|start| lengths.iter().map(|end| [*start, *end]));
        let times = pairs.map(|ramps| {
            let leg = TimedLeg { clock: Clock::Own(Warp::new(seconds, ramps)), stretch: 1.0, ..found.clone() };
            slowed(leg, task, Scope::Actuators).duration()
        });
        let least = times.fold(f64::INFINITY, f64::min);
        // What ramps ask for is taken from samples.
        assert!(found.duration() <= 1.02 * least, "{seconds} {x:?}: {} {least}", found.duration());
        let stretch = slowed(found.clone(), task, Scope::Actuators).stretch;
        assert_eq!(found.stretch, stretch);
        assert!(seconds > 1.0 || stretch > 1.5, "{stretch}");
    }
}

#[test]
fn a_zone_that_hardly_slows_a_leg_down_costs_no_more_than_slowing_it_down() {
    let robot = fixtures::conv();
    // Its greatest speed is a ten thousandth more than is allowed all the way.
    let straight = Course::Proportional(Proportional {
        pose: crate::geom::Pose2::default(),
        drive: 1.0,
        turn: 0.0,
        joints: vec![],
        joint_changes: vec![],
        half_track: 0.2,
    });
    let peak = Convolution::fastest(1.0, [0.5, 0.2, 0.2]).peak_speed();
    let everywhere = vec![[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]];
    let zones = [crate::mission::SpeedZone { polygon: everywhere, speed: peak / 1.0001 / 0.995 }];
    let slow = Task { zones: Zones::new(&zones, &robot, 0.1), ..task(&robot, false) };
    for law in [TimeLaw::Auto, TimeLaw::Optimal] {
        let [free, leg] = [task(&robot, false), slow].map(|task| time_leg(&straight, law, task).unwrap().duration());
        assert!((leg / free - 1.0001).abs() < 1e-6, "{law:?}: {leg} {free}");
    }
}
