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
        tolerance: None,
        link_end: None,
        own_links: None,
        end_point_error: 4.2e-5,
        end_point_allowed: END_POINT_TOLERANCE,
        zones: Vec::new(),
        end_heading_error: Some(1.7e-5),
        vias: Vec::new(),
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
        wheel_difference: None,
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
    render(&SummaryInputs { mission: "arch_bridges", report, folder: "out/arch_bridges", files, colour: false })
}

#[test]
fn a_certified_mission_is_summed_up_on_one_screen() {
    let mut report = report();
    report.judge(&certificate());
    let files = ["commands.csv", "commands.mcap", "commands.d", "path_error.csv", "report.json", "timings.json"];
    let text = text(&report, &files);
    assert!(text.lines().count() <= 24 && text.lines().all(|l| l.chars().count() <= WIDTH), "{text}");
    insta::assert_snapshot!(text, @"
    arch_bridges: CERTIFIED

      motion      16.81 m in 42.3 s, time law fixed_point
      commands    424 rows of 0.1 s, sampling mean
      path        optimised, 14 pieces, 61 iterations, converged
      clearance   51.18 mm proven, 50 mm required: 1.18 mm to spare
                  closest at 12.3 s: left_blade to the cell at (4.03, 4.07, 0.28)
      goal        missed by 0.042 mm and under 0.001°; allowed: 1 mm and 0.1°
      limits      peak/limit, and what is left of it:
        wheel_left   0.499/0.5 m/s  0%  0.312/0.5 m/s² 37%  2/2 m/s³   0%
        wheel_right  0.41/0.5 m/s  18%  0.3/∞ m/s²          1.1/∞ m/s³
        blade        0.61/1 rad/s  39%
      path error  0.24 mm beside the path at most, 0.042 mm from its end
      files       out/arch_bridges/: commands.csv commands.mcap commands.d
                  path_error.csv report.json timings.json

    Proven of the model; wheel slip and tracking errors are not in it.
    Next: trajc check out/arch_bridges/commands.csv
    ");
}

#[test]
fn a_refused_certificate_says_what_was_reached() {
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
    insta::assert_snapshot!(text(&report, &["report.json"]), @"
    arch_bridges: FAILED in certify; no command file

      motion      16.81 m in 42.3 s, time law fixed_point
      commands    424 rows of 0.1 s, sampling mean
      path        optimised, 14 pieces, 61 iterations, converged
      clearance   31.2 mm proven, 50 mm required: 18.8 mm short
                  closest at 12.3 s: left_blade to the cell at (4.03, 4.07, 0.28)
      limits      peak/limit, and what is left of it:
        wheel_left   0.55/0.5 m/s OVER  0.312/0.5 m/s² 37%  2/2 m/s³   0%
        wheel_right  0.41/0.5 m/s  18%  0.3/∞ m/s²          1.1/∞ m/s³
        blade        0.61/1 rad/s  39%
      files       out/arch_bridges/: report.json
    ");
}

#[test]
fn a_failure_names_its_stage_and_leaves_the_reason_to_the_diagnostic() {
    let mut report = Report::new(InputsPart::default());
    let diagnostic = Diagnostic::failure("search/exhausted", "no path from start to goal at this resolution")
        .number("expanded", 18_321)
        .number("closest_m", 1.25);
    report.fail(&Diagnostics(vec![diagnostic]));
    insta::assert_snapshot!(text(&report, &["report.json"]), @"
    arch_bridges: FAILED in search; no command file

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
fn small_lengths_and_angles_are_told_as_such() {
    let cases = [
        (0.0, "0 mm"),
        (4e-10, "under 0.001 mm"),
        (4.2e-5, "0.042 mm"),
        (0.05118, "51.18 mm"),
        (-0.0012, "-1.2 mm"),
        (1.5, "1.5 m"),
    ];
    for (metres, wanted) in cases {
        assert_eq!(length(metres), wanted);
    }
    assert_eq!([0.0, 1e-9, 1.7e-3].map(degrees), ["0°", "under 0.001°", "0.0974°"]);
}

/// A certified report of a robot with these joints, which take up `share` of their limits.
fn with_joints(names: &[&str], share: f64) -> Report {
    let mut report = report();
    let mut proven = certificate();
    proven.limits.truncate(6);
    for name in names {
        for (quantity, limit) in [("speed", 1.5), ("acceleration", 3.0), ("jerk", 15.0)] {
            proven.limits.push(check(name, quantity, share * limit, Some(limit)));
        }
    }
    report.judge(&proven);
    report
}

#[test]
fn a_screen_of_80_columns_holds_an_arm_and_a_robot_without_joints() {
    let arm = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2"];
    let files = ["commands.csv", "commands.mcap", "path_error.csv", "commands.d", "report.json", "timings.json"];
    for names in [&arm[..], &arm[..1], &[]] {
        let text = text(&with_joints(names, 0.8765432), &files);
        assert!(text.lines().count() <= 24, "{text}");
        assert!(text.lines().all(|l| l.chars().count() <= WIDTH), "{text}");
    }
    insta::assert_snapshot!(text(&with_joints(&arm, 0.8765432), &files), @"
    arch_bridges: CERTIFIED

      motion      16.81 m in 42.3 s, time law fixed_point
      commands    424 rows of 0.1 s, sampling mean
      path        optimised, 14 pieces, 61 iterations, converged
      clearance   51.18 mm proven, 50 mm required: 1.18 mm to spare
                  closest at 12.3 s: left_blade to the cell at (4.03, 4.07, 0.28)
      goal        missed by 0.042 mm and under 0.001°; allowed: 1 mm and 0.1°
      limits      peak/limit, and what is left of it:
        wheel_left     0.499/0.5 m/s   0%  0.312/0.5 m/s² 37%  2/2 m/s³        0%
        wheel_right    0.41/0.5 m/s   18%  0.3/∞ m/s²          1.1/∞ m/s³
        shoulder_pan   1.31/1.5 rad/s 12%  2.63/3 rad/s²  12%  13.1/15 rad/s³ 12%
        shoulder_lift  1.31/1.5 rad/s 12%  2.63/3 rad/s²  12%  13.1/15 rad/s³ 12%
        elbow          1.31/1.5 rad/s 12%  2.63/3 rad/s²  12%  13.1/15 rad/s³ 12%
        wrist_1        1.31/1.5 rad/s 12%  2.63/3 rad/s²  12%  13.1/15 rad/s³ 12%
        wrist_2        1.31/1.5 rad/s 12%  2.63/3 rad/s²  12%  13.1/15 rad/s³ 12%
      path error  0.24 mm beside the path at most, 0.042 mm from its end
      files       out/arch_bridges/: commands.csv commands.mcap path_error.csv
                  commands.d report.json timings.json

    Proven of the model; wheel slip and tracking errors are not in it.
    Next: trajc check out/arch_bridges/commands.csv
    ");
    let many: Vec<String> = (0..12).map(|k| format!("joint_{k}")).collect();
    let many: Vec<&str> = many.iter().map(String::as_str).collect();
    assert!(text(&with_joints(&many, 0.5), &[]).contains("    and 6 more in report.json\n"));
}

#[test]
fn colour_touches_the_verdict_alone() {
    let report = with_joints(&["blade"], 0.5);
    let inputs = SummaryInputs { mission: "a", report: &report, folder: "out/a", files: &[], colour: true };
    let coloured = render(&inputs);
    assert!(coloured.starts_with("a: \u{1b}[1;32mCERTIFIED\u{1b}[0m\n"));
    assert_eq!(
        coloured.replace("\u{1b}[1;32m", "").replace("\u{1b}[0m", ""),
        render(&SummaryInputs { colour: false, ..inputs })
    );
}

#[test]
fn the_next_command_can_be_pasted_into_a_shell() {
    assert_eq!(shell("out/a b/commands.csv"), "'out/a b/commands.csv'");
    assert_eq!(shell("out/it's/c"), "'out/it'\\''s/c'");
    assert_eq!(shell("out/a/commands.csv"), "out/a/commands.csv");
}
