//! A short campaign against the certificate, and campaigns against certificates that are broken on purpose, each of which it must catch.

use trajc::certify::{Certificate, RefusalKind, distances};
use trajc::eval::trust::{self, Case, Family, Tally, run};

/// Of this seed all cases here are.
const SEED: u64 = 2;

#[test]
fn nothing_false_is_certified_and_little_that_is_true_is_refused() {
    let tally = run(SEED, 0, 420, &Case::certify, &mut || {});
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

/// The first cases of a family, tried with a certificate that need not be the program's.
fn campaign(family: Family, count: u64, certify: &dyn Fn(&Case) -> Certificate) -> Tally {
    let families = Family::ALL.len() as u64;
    let place = Family::ALL.iter().position(|other| *other == family).expect("one of all") as u64;
    let mut tally = Tally::default();
    for round in 0..count {
        let index = round * families + place;
        tally.add(SEED, index, &trust::attempt(SEED, index, certify));
    }
    tally
}

#[test]
fn a_certificate_that_never_refuses_for_a_reason_is_caught() {
    for (kind, family) in [
        (RefusalKind::Clearance, Family::Below),
        (RefusalKind::Clearance, Family::Interior),
        (RefusalKind::Clearance, Family::ThinWall),
        (RefusalKind::OwnLinks, Family::OwnLinks),
        (RefusalKind::Limit, Family::Limits),
        (RefusalKind::End, Family::Goal),
        (RefusalKind::End, Family::Rest),
        (RefusalKind::Via, Family::Stands),
        (RefusalKind::Zone, Family::Zones),
        (RefusalKind::Table, Family::Table),
        (RefusalKind::Position, Family::Table),
        (RefusalKind::Reverse, Family::Table),
    ] {
        let without = |case: &Case| {
            let mut certificate = case.certify();
            certificate.refusals.retain(|refusal| refusal.kind != kind);
            certificate
        };
        assert!(campaign(family, 60, &without).wrong_count() > 0, "{kind:?}, {family:?}");
    }
}

#[test]
fn a_certificate_that_only_looks_when_rows_begin_is_caught_between_them() {
    let sampled = |case: &Case| {
        let mut certificate = case.certify();
        certificate.clearance_proven = None;
        let start = (case.task.start, &case.task.start_joints[..]);
        let map = case.map.as_ref().expect("these families have one");
        let least = distances(&case.table, &case.robot, map, start, 1, 1.0);
        if least.iter().all(|instant| instant.distance >= case.task.clearance.max(1e-9)) {
            certificate.refusals.retain(|refusal| refusal.kind != RefusalKind::Clearance);
        }
        certificate
    };
    for family in [Family::Between, Family::Joints, Family::ThinWall] {
        assert!(campaign(family, 8, &sampled).wrong_count() > 0, "{family:?}");
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
    assert!(campaign(Family::Below, 20, &easier).wrong_count() > 0, "clearance 0.1 mm less");
    let looser = instead(|case| {
        let looser = |limit: &mut Option<f64>| *limit = limit.map(|limit| limit * (1.0 + 2e-6));
        let wheel = &mut case.robot.wheel;
        [&mut wheel.speed, &mut wheel.acceleration, &mut wheel.jerk].into_iter().for_each(looser);
    });
    assert!(campaign(Family::Limits, 40, &looser).wrong_count() > 0, "limits 2e-6 higher");
    let further = instead(|case| case.task.goal.within = case.task.goal.within.max(1e-3) * 1.01);
    assert!(campaign(Family::Goal, 40, &further).wrong_count() > 0, "goal 1 % wider");
    let blind = instead(|case| {
        let map = case.map.as_mut().expect("these families have one");
        map.outside = trajc::mission::Unknown::Free;
    });
    assert!(campaign(Family::Edges, 8, &blind).wrong_count() > 0, "edges of the map are no obstacles");
}
