//! Tables of scenes made up.

use super::*;

fn scene(id: &str, boxes: usize, time: f64, alpha: f64) -> Judged {
    let metrics = Metrics { length_m: 5.0, time_s: time, mean_jerk_mps3: 0.5, ..Metrics::default() };
    let excess = Some(AlphaExcess { peak: alpha, share: 0.1 });
    Judged {
        id: id.into(),
        kind: None,
        boxes,
        certified: true,
        failure: None,
        source: Some("optimised".into()),
        legs: Some([1, 0]),
        expanded: Some(3),
        iterations: Some(9),
        ending: Some("converged".into()),
        initial: Some(Metrics { mean_jerk_mps3: 1.0, ..metrics }),
        planned: Some(metrics),
        driven: Some(metrics),
        alpha_planned: excess,
        alpha_driven: excess,
        turns: None,
        least_radius: 4e-3,
        joint_ranges: vec![],
        lowest: None,
        limits: vec![],
        clearance_proven: Some(0.03),
        bound: (4.0, 5.0),
        timings: vec![("search", 2.0), ("optimize", 3.0), ("certify", 1.0)],
    }
}

#[test]
fn table_one_has_the_papers_rows_and_the_change() {
    let text = render(Some(Suite::Table1), &[scene("a", 15, 6.0, 1.0)], &[]);
    let row = |name: &str| text.lines().find(|l| l.trim().starts_with(name)).unwrap_or_default().to_owned();
    assert!(row("paper, initial").contains("0.614") && row("paper, optimised").ends_with("93.0  104.2"), "{text}");
    assert!(row("paper, change").contains("-69 %") && row("paper, change").contains("-85 %"), "{text}");
    assert!(row("ours, change").contains("-50 %") && row("ours, optimised").ends_with("100.0    5.0"), "{text}");
}

#[test]
fn table_two_counts_thresholds_cumulatively_as_the_paper_does() {
    let peaks = [0.9, 1.05, 1.2, 1.3].map(|peak| AlphaExcess { peak, share: 0.02 });
    let row = ExcessRow::of(&peaks);
    assert_eq!((row.above_1, row.below_10, row.below_25, row.above_25), (75.0, 50.0, 75.0, 25.0));
    assert!((row.time_above - 2.0).abs() < 1e-12);
    let of = |peak: f64| vec![scene("a", 20, 6.0, peak)];
    let text = render(Some(Suite::Table2), &of(1.0), &[of(1.3), of(1.05)]);
    let above_25 = |name: &str| {
        let row = text.lines().find(|line| line.contains(name)).unwrap_or_else(|| panic!("{name} in {text}"));
        row.split_whitespace().rev().nth(2).map(str::to_owned)
    };
    assert!(text.contains("76.0") && text.contains("64.0"), "{text}");
    assert_eq!(above_25("ours, as commanded, flat, without DS").as_deref(), Some("100.0"));
    assert_eq!(above_25("ours, as commanded, flat, with DS").as_deref(), Some("0.0"));
    assert_eq!(above_25("ours, as commanded, arc length").as_deref(), Some("0.0"));
}

#[test]
fn table_three_groups_by_boxes_beside_the_papers_rows() {
    let judged = [scene("a", 10, 6.0, 1.0), scene("b", 35, 7.0, 1.0), scene("c", 10, 8.0, 1.0)];
    let text = render(Some(Suite::Table3), &judged, &[]);
    let ours: Vec<&str> = text.lines().filter(|l| l.contains("trajc")).collect();
    assert_eq!(ours.len(), 2, "{text}");
    assert!(ours[0].contains("1.400") && ours[0].contains("1.250") && ours[0].ends_with("2/2"), "{text}");
    assert!(text.contains("DDR-opt") && text.contains("20208.0") && !text.contains("20 paper"), "{text}");
    assert!(!render(None, &judged, &[]).contains("paper"));
}

#[test]
fn failures_and_fall_backs_are_named() {
    let mut failed = scene("bad", 10, 6.0, 1.0);
    failed.certified = false;
    failed.failure = Some(crate::report::schema::Failure {
        stage: "search".into(),
        reason: "start is blocked".into(),
        code: "search/start-blocked".into(),
        numbers: Default::default(),
    });
    let mut fallen = scene("fallen", 10, 6.0, 1.0);
    fallen.source = Some("search".into());
    let text = render_totals(&[failed, fallen, scene("good", 10, 6.0, 1.0)]);
    assert!(text.starts_with("2 of 3 certified (66.7 %), 1 of them by the search's own path\n"), "{text}");
    assert!(text.contains("search + optimise: median 5.0 ms") && text.contains("certify: median 1.0 ms"), "{text}");
    assert!(text.ends_with("by the search's own path: fallen\nfailed: bad (search): start is blocked\n"), "{text}");
}

#[test]
fn nothing_certified_is_a_table_of_dashes() {
    let mut failed = scene("bad", 10, 6.0, 1.0);
    failed.certified = false;
    for suite in [Some(Suite::Table1), Some(Suite::Table2), Some(Suite::Table3), None] {
        assert!(!render(suite, &[failed.clone()], &[vec![failed.clone()]]).contains("NaN"));
    }
    assert!(render_profile(&[failed]).contains("optimize"));
}

#[test]
fn fig_five_stands_beside_the_papers_radius_and_a_failure_has_no_figures() {
    let turns = super::super::Turns { on_the_spot: 2, least_driven_m: Some(0.0123), tightest: None };
    let usual = Judged { turns: Some(turns), ..scene("fig5", 30, 6.0, 1.1) };
    let failed = Judged { certified: false, ..usual.clone() };
    let text = render(Some(Suite::Fig5), std::slice::from_ref(&usual), &[vec![failed], vec![usual.clone()]]);
    let row = |name: &str| text.lines().find(|l| l.trim().starts_with(name)).unwrap_or_default().to_owned();
    assert!(row("paper").ends_with("9.3") && row("limits allow").ends_with("4.0"), "{text}");
    assert!(row("ours, one curve, without DS").ends_with("failed"), "{text}");
    for name in ["ours, one curve, with DS", "ours, as usual"] {
        assert!(row(name).contains("12.3") && row(name).contains("110.0"), "{text}");
    }
}

#[test]
fn fig_six_has_each_actuator_against_its_limits() {
    let limit = |actuator: &str, quantity: &str| crate::report::schema::LimitPart {
        actuator: actuator.into(),
        quantity: quantity.into(),
        peak: Some(0.75),
        limit: Some(1.5),
    };
    let limits = ["speed", "acceleration", "jerk"].map(|q| limit("blade", q)).to_vec();
    let judged = Judged { limits, joint_ranges: vec![("blade".into(), [0.25, 2.125])], ..scene("fig6", 14, 6.0, 1.0) };
    let text = render(Some(Suite::Fig6), &[judged], &[]);
    let row = text.lines().find(|l| l.trim().starts_with("blade")).expect("a row");
    let cells: Vec<&str> = row.split_whitespace().collect();
    assert_eq!(cells, ["blade", "0.250", "2.125", "0.750", "1.500", "0.750", "1.500", "0.750", "1.500"]);
}

#[test]
fn rooms_for_arms_have_a_row_a_kind_beside_topay_and_failures_by_their_code() {
    let of = |id: &str, kind: &str, time: f64, lowest: f64| Judged {
        kind: Some(kind.into()),
        lowest: Some(lowest),
        ..scene(id, 160, time, 1.0)
    };
    let mut failed = of("c", "cuboids", 9.0, -1.0);
    let failure = crate::report::schema::Failure {
        stage: "search".into(),
        reason: "none".into(),
        code: "search/no-way".into(),
        numbers: Default::default(),
    };
    (failed.certified, failed.failure) = (false, Some(failure));
    let judged = [of("a", "cuboids", 10.0, 0.1), of("b", "cuboids", 12.0, -0.25), failed, of("d", "tables", 8.0, 0.2)];
    let text = render(Some(Suite::Arm), &judged, &[]);
    let line =
        |start: &str| text.lines().find(|l| l.trim_start().starts_with(start)).unwrap_or_else(|| panic!("{text}"));
    assert!(line("cuboids TopAY, measured").contains(" 309 ") && line("tables TopAY, measured").contains(" 12.2 "));
    assert!(
        line("cuboids trajc, certified 2/3").contains(" 66.7 ") && line("cuboids trajc").contains(" 11.0 "),
        "{text}"
    );
    assert!(line("tables trajc, certified 1/1").contains(" 8.0 "));
    assert!(text.contains("cuboids: 1 failed with search/no-way\n"));
    assert!(text.contains("cuboids: 1 of the certified reaches below the floor, the lowest 0.25 m"), "{text}");
    assert!(!text.contains("tables: 1 of"));
}
