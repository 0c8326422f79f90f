//! A short campaign against the certificate, and campaigns against certificates that are broken on purpose, each of which it must catch.

use trajc::certify::{Certificate, RefusalKind, distances};
use trajc::eval::trust::{Case, Family, Tally, run};

fn campaign(count: u64, certify: &dyn Fn(&Case) -> Certificate) -> Tally {
    run(2, 0, count, certify, &mut || {})
}

#[test]
fn nothing_false_is_certified_and_little_that_is_true_is_refused() {
    let tally = campaign(420, &Case::certify);
    assert_eq!(tally.cases(), 420);
    assert_eq!(tally.wrong_count(), 0, "{:#?}", tally.wrong);
    let [needless, ample] = tally.needless();
    assert!(ample > 80 && 100 * needless <= ample, "{needless} of {ample} refused: {:#?}", tally.wrong);
    assert!(100 * tally.undecided() <= tally.cases(), "{:#?}", tally.wrong);
    for family in Family::ALL {
        let [cases, refused, certified] = tally.of(family);
        assert!(cases == 30 && refused + certified > 0, "{family:?}");
        let one_sided = matches!(family, Family::Above | Family::Below | Family::Between);
        assert!(one_sided || (refused > 2 && certified > 2), "{family:?}: {refused} refused, {certified} certified");
    }
}

/// Certifies as the program does but for refusals of one kind.
fn without(kind: RefusalKind) -> impl Fn(&Case) -> Certificate {
    move |case| {
        let mut certificate = case.certify();
        certificate.refusals.retain(|refusal| refusal.kind != kind);
        certificate
    }
}

#[test]
fn a_certificate_that_never_refuses_for_a_reason_is_caught() {
    for kind in [
        RefusalKind::Clearance,
        RefusalKind::OwnLinks,
        RefusalKind::Limit,
        RefusalKind::Position,
        RefusalKind::Reverse,
        RefusalKind::End,
        RefusalKind::Via,
        RefusalKind::Zone,
        RefusalKind::Table,
    ] {
        assert!(campaign(14 * 12, &without(kind)).wrong_count() > 0, "{kind:?}");
    }
}

#[test]
fn a_certificate_that_only_looks_when_rows_begin_is_caught_between_them() {
    let sampled = |case: &Case| {
        let mut certificate = case.certify();
        certificate.refusals.retain(|refusal| refusal.kind != RefusalKind::Clearance);
        certificate.clearance_proven = None;
        if let Some(map) = &case.map {
            let start = (case.task.start, &case.task.start_joints[..]);
            let least = distances(&case.table, &case.robot, map, start, 1, 1.0);
            if least.iter().any(|instant| instant.distance < case.task.clearance.max(1e-9)) {
                certificate.refusals.extend(case.certify().refusals);
            }
        }
        certificate
    };
    let tally = campaign(14 * 10, &sampled);
    let caught = |family| tally.wrong.iter().filter(|wrong| wrong.family == family).count();
    for family in [Family::Between, Family::Joints, Family::ThinWall] {
        assert!(caught(family) > 0, "{family:?}");
    }
}

/// Certifies another case in a case's place.
fn instead(change: impl Fn(&mut Case)) -> impl Fn(&Case) -> Certificate {
    move |case| {
        let mut other = case.clone();
        change(&mut other);
        other.certify()
    }
}

#[test]
fn a_certificate_that_is_off_by_little_is_caught() {
    let easier = instead(|case| case.task.clearance = (case.task.clearance - 1e-4).max(0.0));
    assert!(campaign(14 * 20, &easier).wrong_count() > 0, "clearance 0.1 mm less");
    let looser = instead(|case| {
        let looser = |limit: &mut Option<f64>| *limit = limit.map(|limit| limit * (1.0 + 2e-6));
        let wheel = &mut case.robot.wheel;
        [&mut wheel.speed, &mut wheel.acceleration, &mut wheel.jerk].into_iter().for_each(looser);
    });
    assert!(campaign(14 * 20, &looser).wrong_count() > 0, "limits 2e-6 higher");
    let further = instead(|case| case.task.goal.within = case.task.goal.within.max(1e-3) * 1.01);
    assert!(campaign(14 * 20, &further).wrong_count() > 0, "goal 1 % wider");
    let blind = instead(|case| {
        if let Some(map) = &mut case.map {
            map.outside = trajc::mission::Unknown::Free;
        }
    });
    assert!(campaign(14 * 10, &blind).wrong_count() > 0, "edges of the map are no obstacles");
}
