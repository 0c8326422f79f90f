use super::*;
use crate::certify::{Certificate, Closest, LimitCheck, Refusal, RefusalKind};
use crate::diag::{Diagnostic, Diagnostics};
use crate::geom::Aabb;
use crate::report::schema::{CommandsPart, InputsPart, JointPart, ProfilePart, RobotPart, TrajectoryPart};
use crate::report::{Metrics, PathErrorRow};

fn check(actuator: &str, quantity: &'static str, peak: f64, limit: Option<f64>) -> LimitCheck {
    LimitCheck { actuator: actuator.into(), quantity, peak, limit }
}

fn certificate() -> Certificate {
    Certificate {
        clearance_required: Some(0.05),
        clearance_proven: Some(0.05118),
        closest: Some(Closest {
            time: 12.3,
            link: "left_blade".into(),
            obstacle: Some(Aabb { min: [4.0, 4.05, 0.25], max: [4.05, 4.1, 0.3] }),
            distance: 0.05231,
        }),
        own_links: None,
        end_point_error: 4.2e-5,
        end_heading_error: Some(1.7e-5),
        limits: vec![
            check("wheel_left", "speed", 0.4987, Some(0.5)),
            check("wheel_left", "acceleration", 0.312, Some(0.5)),
            check("wheel_left", "jerk", 2.0, Some(2.0)),
            check("wheel_right", "speed", 0.41, Some(0.5)),
            check("wheel_right", "acceleration", 0.3, None),
            check("wheel_right", "jerk", 1.1, None),
            check("blade", "speed", 0.61, Some(1.0)),
        ],
        limits_hold: true,
        refusals: Vec::new(),
    }
}

fn report() -> Report {
    let mut report = Report::new(InputsPart::default());
    let joint = |name: &str, prismatic| JointPart {
        name: name.into(),
        prismatic,
        lower: Some(0.0),
        upper: None,
        speed: None,
        acceleration: None,
        jerk: None,
    };
    report.robot = Some(RobotPart {
        name: "scr_db".into(),
        wheel_radius_m: 0.08,
        track_width_m: 0.32,
        joints: vec![joint("blade", false)],
        shapes: 5,
        ignored_pairs: Vec::new(),
    });
    report.trajectory = Some(TrajectoryPart {
        source: "optimised".into(),
        parameterisation: Some("flat".into()),
        pieces: 14,
        iterations: Some(61),
        ending: Some("converged".into()),
        metrics: Some(Metrics { length_m: 16.81234, ..Metrics::default() }),
    });
    let (v_max_mps, v_comp_mps) = (Some(0.5), None);
    report.profile = Some(ProfilePart { time_law: "fixed_point".into(), time_s: 42.3, v_max_mps, v_comp_mps });
    report.commands = Some(CommandsPart { rows: 424, sampling_time_s: 0.1, sampling: "mean".into(), duration_s: 42.3 });
    report.path_error = vec![PathErrorRow {
        sampling_time_s: 0.1,
        sampling: "mean".into(),
        lateral_max_m: 2.4e-4,
        lateral_rms_m: 1.1e-4,
        end_point_m: 4.2e-5,
        end_heading_rad: 0.0,
        clearance_min_m: Some(0.051),
    }];
    report
}

fn text(report: &Report, files: &[&str]) -> String {
    render(&SummaryInputs { mission: "arch_bridges", report, folder: "out/arch_bridges", files })
}

#[test]
fn a_certified_mission_is_summed_up_on_one_screen() {
    let mut report = report();
    report.judge(&certificate());
    let files = ["commands.csv", "commands.mcap", "commands.d", "path_error.csv", "report.json", "timings.json"];
    let text = text(&report, &files);
    assert!(text.lines().count() <= 24 && text.lines().all(|l| l.chars().count() <= 110));
    insta::assert_snapshot!(text, @r"
    arch_bridges: CERTIFIED

      motion      16.81 m, 42.3 s in 424 rows of 0.1 s (mean)
      path        optimised, 14 pieces, 61 iterations, converged, time law fixed_point
      clearance   0.05118 m proven, 0.05 m required: 0.00118 m to spare
                  closest at 12.3 s: left_blade is 0.05231 m from the obstacle at (4.03, 4.07, 0.28) m
      goal        reached within 0.042 mm and 0.000974°; 1 mm and 0.1° are allowed
      limits      wheel_left   0.4987 of 0.5 m/s, 0% left    0.312 of 0.5 m/s², 37% left   2 of 2 m/s³, 0% left
                  wheel_right  0.41 of 0.5 m/s, 18% left     0.3 m/s², no limit            1.1 m/s³, no limit
                  blade        0.61 of 1 rad/s, 39% left
      path error  at most 0.24 mm off the path, 0.11 mm RMS, 0.042 mm at the end, at 0.1 s
      files       out/arch_bridges/: commands.csv commands.mcap commands.d path_error.csv report.json
                  timings.json

    Proven over the model of robot and map; wheel slip and tracking errors are not in it.
    Next: trajc check out/arch_bridges/commands.csv
    ");
}

#[test]
fn a_refused_certificate_says_what_was_violated_and_by_how_much() {
    let mut report = report();
    let mut refused = certificate();
    refused.clearance_proven = Some(0.0312);
    refused.limits[0].peak = 0.55;
    refused.limits_hold = false;
    refused.refusals = vec![
        Refusal {
            kind: RefusalKind::Clearance,
            message: "left_blade comes within 0.0312 m of the obstacle at (4.03, 4.08, 0.28) m at 12.3 s".into(),
            time: Some(12.3),
        },
        Refusal { kind: RefusalKind::Limit, message: "wheel_left reaches 0.55 m/s of 0.5 m/s".into(), time: None },
    ];
    report.judge(&refused);
    insta::assert_snapshot!(text(&report, &["report.json"]), @r"
    arch_bridges: FAILED in certify; no command file

      reason      left_blade comes within 0.0312 m of the obstacle at (4.03, 4.08, 0.28) m at 12.3 s
                  wheel_left reaches 0.55 m/s of 0.5 m/s
      motion      16.81 m, 42.3 s in 424 rows of 0.1 s (mean)
      path        optimised, 14 pieces, 61 iterations, converged, time law fixed_point
      clearance   0.0312 m proven, 0.05 m required: 0.0188 m short
                  closest at 12.3 s: left_blade is 0.05231 m from the obstacle at (4.03, 4.07, 0.28) m
      limits      wheel_left   0.55 of 0.5 m/s, OVER         0.312 of 0.5 m/s², 37% left   2 of 2 m/s³, 0% left
                  wheel_right  0.41 of 0.5 m/s, 18% left     0.3 m/s², no limit            1.1 m/s³, no limit
                  blade        0.61 of 1 rad/s, 39% left
      files       out/arch_bridges/: report.json
    ");
}

#[test]
fn an_unreachable_goal_is_told_with_its_numbers() {
    let mut report = Report::new(InputsPart::default());
    let diagnostic = Diagnostic::failure("search/exhausted", "no path from start to goal at this resolution")
        .number("expanded", 18_321)
        .number("closest_m", 1.25);
    report.fail(&Diagnostics(vec![diagnostic]));
    insta::assert_snapshot!(text(&report, &["report.json"]), @r"
    arch_bridges: FAILED in search; no command file

      reason      no path from start to goal at this resolution
                  expanded = 18321
                  closest_m = 1.25
      files       out/arch_bridges/: report.json
    ");
}

#[test]
fn a_mission_without_a_map_says_that_clearance_was_not_checked() {
    let mut report = report();
    let mut free = certificate();
    (free.clearance_required, free.clearance_proven, free.closest) = (None, None, None);
    report.judge(&free);
    assert!(text(&report, &[]).contains("clearance   no map: not checked"));
    free.clearance_required = Some(0.05);
    free.clearance_proven = Some(f64::INFINITY);
    report.judge(&free);
    assert!(text(&report, &[]).contains("clearance   no obstacle anywhere"));
}

#[test]
fn figures_keep_four_digits_and_no_negative_zero() {
    let cases = [(0.05118, "0.05118"), (42.3, "42.3"), (12345.6, "12346"), (-0.0012345, "-0.001234"), (1e-9, "0")];
    for (value, wanted) in cases {
        assert_eq!(figure(value), wanted, "{value}");
    }
    assert_eq!((figure(-1e-12), figure(f64::NAN), figure(0.1)), ("0".into(), "?".into(), "0.1".into()));
}

#[test]
fn the_next_command_can_be_pasted_into_a_shell() {
    assert_eq!(shell("out/a b/commands.csv"), "'out/a b/commands.csv'");
    assert_eq!(shell("out/it's/c"), "'out/it'\\''s/c'");
    assert_eq!(shell("out/a/commands.csv"), "out/a/commands.csv");
}
