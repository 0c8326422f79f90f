//! From the stages' nouns to the parts of [`Report`].

use serde_json::{Map, Value, json};

use super::schema::*;
use super::{Metrics, Report, Status, names};
use crate::certify::{
    Certificate, Closest, END_POINT_TOLERANCE, InTube, LimitCheck, LinkEnd, Reached, Refusal, RefusalKind, Trust,
    ZoneSpeed,
};
use crate::command::CommandTable;
use crate::diag::{Diagnostics, Severity};
use crate::map::VoxelMap;
use crate::robot::{IgnoreReason, IgnoredPair, MovingJoint, RobotModel};
use crate::search::SearchPath;
use crate::trajectory::{Leg, Trajectory, TrajectorySource};

/// JSON knows neither NaN nor infinity.
fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

impl Report {
    /// A report of a run that has read these files and nothing more. It has failed until [`Report::judge`] says otherwise.
    pub fn new(inputs: InputsPart) -> Self {
        Self {
            schema: SCHEMA.to_string(),
            status: Status::Failed,
            failure: None,
            inputs,
            robot: None,
            map: None,
            search: None,
            trajectory: None,
            initial: None,
            profile: None,
            limits: Vec::new(),
            commands: None,
            certificate: None,
            trust: None,
            path_error: Vec::new(),
        }
    }

    /// Takes over the certificate: its figures, its limits, and the verdict.
    pub fn judge(&mut self, certificate: &Certificate) {
        self.certificate = Some(certificate.into());
        self.limits = certificate.limits.iter().map(LimitPart::from).collect();
        self.failure = refusal(&certificate.refusals);
        self.status = if self.failure.is_none() { Status::Certified } else { Status::Failed };
    }

    /// Records why the run failed.
    pub fn fail(&mut self, diagnostics: &Diagnostics) {
        self.status = Status::Failed;
        self.failure = Some(diagnostics.into());
    }
}

fn refusal(refusals: &[Refusal]) -> Option<Failure> {
    let first = refusals.first()?;
    let listed = refusals.iter().map(|r| {
        let mut entry = Map::new();
        entry.insert("kind".into(), refusal_kind(r.kind).into());
        entry.insert("message".into(), r.message.as_str().into());
        if let Some(time) = r.time.and_then(finite) {
            entry.insert("time_s".into(), time.into());
        }
        Value::Object(entry)
    });
    let mut numbers = Map::new();
    numbers.insert("refusals".into(), listed.collect());
    let reason = refusals.iter().map(|r| r.message.as_str()).collect::<Vec<_>>().join("; ");
    let code = format!("certify/{}", refusal_kind(first.kind));
    Some(Failure { stage: "certify".into(), reason, code, numbers })
}

fn refusal_kind(kind: RefusalKind) -> &'static str {
    match kind {
        RefusalKind::Clearance => "clearance",
        RefusalKind::Tolerance => "tolerance",
        RefusalKind::OwnLinks => "own_links",
        RefusalKind::Limit => "limit",
        RefusalKind::Position => "position",
        RefusalKind::Reverse => "reverse",
        RefusalKind::End => "end",
        RefusalKind::Via => "via",
        RefusalKind::Zone => "speed_zone",
        RefusalKind::Table => "table",
    }
}

/// The first fault of the worst kind names the stage and the code; all messages make the reason.
impl From<&Diagnostics> for Failure {
    fn from(diagnostics: &Diagnostics) -> Self {
        let worst = diagnostics.severity();
        let code = diagnostics.0.iter().find(|d| d.severity == worst).map_or("trajc/unknown", |d| d.code);
        let mut numbers = Map::new();
        for (key, value) in diagnostics.0.iter().flat_map(|d| &d.numbers) {
            // `stage`, `reason` and `code` are this struct's own keys.
            if !matches!(*key, "stage" | "reason" | "code") && !numbers.contains_key(*key) {
                numbers.insert((*key).to_string(), value.clone());
            }
        }
        if worst == Severity::BadInput {
            let places: Vec<Value> = diagnostics.0.iter().filter_map(place).collect();
            if !places.is_empty() {
                numbers.entry("places").or_insert(places.into());
            }
        }
        Self {
            stage: code.split('/').next().unwrap_or_default().to_string(),
            reason: diagnostics.0.iter().map(|d| d.message.as_str()).collect::<Vec<_>>().join("; "),
            code: code.to_string(),
            numbers,
        }
    }
}

fn place(diagnostic: &crate::diag::Diagnostic) -> Option<Value> {
    if let Some(span) = &diagnostic.at {
        let before = &span.source.text.as_bytes()[..span.range.start];
        let line = 1 + before.iter().filter(|b| **b == b'\n').count();
        return Some(json!({ "file": span.source.name, "line": line }));
    }
    diagnostic.file.as_ref().map(|file| json!({ "file": file }))
}

impl InputFile {
    /// A file by its path as the mission spells it, and its bytes.
    pub fn new(path: impl Into<String>, bytes: &[u8]) -> Self {
        Self { path: path.into(), blake3: blake3::hash(bytes).to_hex().to_string() }
    }
}

impl From<&RobotModel> for RobotPart {
    fn from(robot: &RobotModel) -> Self {
        Self {
            name: robot.name.clone(),
            wheel_radius_m: robot.wheel_radii.mean,
            wheel_difference: robot.wheel_radii.unlike(),
            track_width_m: robot.track_width,
            joints: robot.joints.iter().map(JointPart::from).collect(),
            shapes: robot.shapes.len(),
            ignored_pairs: robot.ignore_pairs.iter().map(IgnoredPairPart::from).collect(),
        }
    }
}

impl From<&IgnoredPair> for IgnoredPairPart {
    fn from(pair: &IgnoredPair) -> Self {
        let reason = match pair.reason {
            IgnoreReason::Joined => "joined",
            IgnoreReason::Named => "named",
            IgnoreReason::Always => "always_touch",
            IgnoreReason::Telescope => "telescope",
            IgnoreReason::AtRest => "touch_at_rest",
        };
        Self { links: pair.links.clone(), reason: reason.into() }
    }
}

impl From<&MovingJoint> for JointPart {
    fn from(joint: &MovingJoint) -> Self {
        Self {
            name: joint.name.clone(),
            prismatic: joint.prismatic,
            lower: finite(joint.lower),
            upper: finite(joint.upper),
            speed: joint.limits.speed,
            acceleration: joint.limits.acceleration,
            jerk: joint.limits.jerk,
        }
    }
}

impl From<&VoxelMap> for MapPart {
    fn from(map: &VoxelMap) -> Self {
        Self {
            dims: map.dims,
            resolution_m: map.resolution,
            occupied: map.occupied_count(),
            origin_m: map.origin,
            points: map.statistics.points,
            not_finite: map.statistics.not_finite,
            cut: map.statistics.cut,
            unknown: map.statistics.unknown,
        }
    }
}

impl From<&SearchPath> for SearchPart {
    fn from(path: &SearchPath) -> Self {
        Self { expanded: path.expanded, length_m: path.length() }
    }
}

impl TrajectoryPart {
    /// `metrics`: of the optimiser's own timing where it made the trajectory, else of the driven path; see
    /// [`super::metrics`].
    pub fn new(trajectory: &Trajectory, metrics: Option<Metrics>) -> Self {
        let pieces = |leg: &Leg| match leg {
            Leg::Drive(drive) => drive.curve.pieces.len(),
            Leg::Steer(steer) => steer.curve.pieces.len(),
            Leg::Still(_) => 0,
        };
        let optimised = trajectory.source == TrajectorySource::Optimised;
        Self {
            source: names::source(trajectory.source).into(),
            parameterisation: trajectory.parameterisation().filter(|_| optimised).map(|p| p.key().into()),
            pieces: trajectory.legs.iter().map(pieces).sum(),
            iterations: trajectory.optimiser.map(|o| o.iterations),
            ending: trajectory.optimiser.map(|o| names::ending(o.ending).into()),
            metrics,
        }
    }
}

impl From<&CommandTable> for CommandsPart {
    fn from(table: &CommandTable) -> Self {
        Self {
            rows: table.rows.len(),
            sampling_time_s: table.sampling_time,
            sampling: names::sampling(table.sampling).into(),
            // To the nanosecond: sums of a tenth have a tail.
            duration_s: (table.duration() * 1e9).round() / 1e9,
        }
    }
}

impl From<&Certificate> for CertificatePart {
    fn from(certificate: &Certificate) -> Self {
        let proven = certificate.clearance_proven.map(|c| c.min(FAR));
        Self {
            clearance_required_m: certificate.clearance_required.and_then(finite),
            clearance_proven_m: proven.and_then(finite),
            end_point_error_m: finite(certificate.end_point_error),
            goal_within_m: Some(certificate.end_point_allowed).filter(|m| *m > END_POINT_TOLERANCE).and_then(finite),
            end_heading_error_rad: certificate.end_heading_error.and_then(finite),
            link: certificate.link_end.as_ref().and_then(link),
            vias: certificate.vias.iter().filter_map(via).collect(),
            speed_zones: certificate.zones.iter().filter_map(zone).collect(),
            limits_hold: certificate.limits_hold,
            closest: certificate.closest.as_ref().and_then(closest),
            tolerance: certificate.tolerance.as_ref().map(in_tube),
            own_links: certificate
                .own_links
                .map(|own| OwnLinksPart { pairs_checked: own.pairs, keep_apart: own.apart }),
        }
    }
}

fn link(end: &LinkEnd) -> Option<LinkPart> {
    Some(LinkPart {
        name: end.link.clone(),
        point_error_m: finite(end.point_error)?,
        within_m: finite(end.allowed)?,
        angle_error_rad: end.angle_error.and_then(finite),
    })
}

fn in_tube(proof: &InTube) -> InTubePart {
    let (there, shares) = proof.there.unzip();
    let shares = shares.map_or_else(Default::default, |shares| {
        let named = shares.named().into_iter();
        named.filter(|(_, share)| *share > 0.0).filter_map(|(key, m)| Some((key.to_owned(), finite(m)?))).collect()
    });
    InTubePart {
        clearance_proven_m: proof.clearance_proven.map(|c| c.min(FAR)).and_then(finite),
        closest: proof.closest.as_ref().and_then(closest),
        closest_off_m: there.and_then(|width| finite(width.distance)),
        closest_off_rad: there.and_then(|width| finite(width.angle)),
        closest_shares_m: shares,
        end_m: finite(proof.end.distance),
        end_rad: finite(proof.end.angle),
    }
}

impl From<&crate::mission::Tolerance> for TolerancePart {
    fn from(tolerance: &crate::mission::Tolerance) -> Self {
        Self {
            wheel_radius: tolerance.wheel_radius,
            wheel_difference: tolerance.wheel_difference,
            track: tolerance.track,
            latency_s: tolerance.latency,
            start_m: tolerance.start_distance,
            start_rad: tolerance.start_angle,
        }
    }
}

impl TrustPart {
    /// `in_force`: the tolerance is the robot's, not assumed. `on_a_map`: whether there was anything to touch.
    pub fn new(trust: &Trust, in_force: bool, on_a_map: bool) -> Self {
        let (end, until) = (trust.end(), trust.until());
        Self {
            in_force,
            tolerance: (&trust.tolerance).into(),
            length_m: end.length,
            duration_s: end.time,
            end_m: finite(end.width.distance),
            end_rad: finite(end.width.angle),
            trusted_m: on_a_map.then_some(until.length),
            trusted_s: on_a_map.then_some(until.time),
            whole: on_a_map.then_some(trust.contact.is_none()),
        }
    }
}

fn via(reached: &Reached) -> Option<ViaPart> {
    Some(ViaPart {
        time_s: finite(reached.time)?,
        point_error_m: finite(reached.point_error)?,
        heading_error_rad: reached.heading_error.and_then(finite),
    })
}

fn zone(zone: &ZoneSpeed) -> Option<ZonePart> {
    Some(ZonePart { limit_mps: finite(zone.limit)?, peak_mps: zone.peak.and_then(finite) })
}

fn closest(closest: &Closest) -> Option<ClosestPart> {
    Some(ClosestPart {
        time_s: finite(closest.time)?,
        link: closest.link.clone(),
        obstacle: closest.obstacle.map(|b| BoxPart { min: b.min, max: b.max }),
        distance_m: finite(closest.distance)?,
    })
}

impl From<&LimitCheck> for LimitPart {
    fn from(check: &LimitCheck) -> Self {
        Self {
            actuator: check.actuator.clone(),
            quantity: check.quantity.into(),
            peak: finite(check.peak),
            limit: check.limit.and_then(finite),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::{Diagnostic, Source, Span};
    use crate::geom::Aabb;
    use std::sync::Arc;

    fn certificate() -> Certificate {
        Certificate {
            clearance_required: Some(0.05),
            clearance_proven: Some(0.0512),
            link_end: None,
            closest: Some(Closest {
                time: 12.3,
                link: "left_blade".into(),
                obstacle: Some(Aabb { min: [4.0, 4.05, 0.25], max: [4.05, 4.1, 0.3] }),
                distance: 0.0523,
            }),
            tolerance: None,
            own_links: None,
            end_point_error: 4e-5,
            end_point_allowed: END_POINT_TOLERANCE,
            zones: Vec::new(),
            end_heading_error: None,
            vias: Vec::new(),
            limits: vec![LimitCheck { actuator: "wheel_left".into(), quantity: "jerk", peak: 0.1, limit: None }],
            limits_hold: true,
            refusals: Vec::new(),
        }
    }

    #[test]
    fn a_report_has_failed_until_a_certificate_without_refusals_says_otherwise() {
        let mut report = Report::new(InputsPart::default());
        assert_eq!(report.status, Status::Failed);
        report.judge(&certificate());
        assert_eq!((report.status, report.failure.is_none()), (Status::Certified, true));
        let message = "wheel_left passes 0.5 m/s".to_string();
        let refusals = vec![Refusal { kind: RefusalKind::Limit, message, time: Some(1.5) }];
        report.judge(&Certificate { refusals, ..certificate() });
        assert_eq!(report.status, Status::Failed);
        let failure = report.failure.expect("refused");
        assert_eq!((failure.stage.as_str(), failure.code.as_str()), ("certify", "certify/limit"));
        assert_eq!(failure.numbers["refusals"][0]["time_s"], 1.5);
    }

    #[test]
    fn numbers_of_a_failure_lie_beside_its_reason_and_cannot_replace_it() {
        let source = Arc::new(Source { name: "m.yaml".into(), text: "a\nb: 1\n".into() });
        let diagnostics = Diagnostics(vec![
            Diagnostic::failure("search/exhausted", "no path").number("gap_m", 0.4).number("stage", "x"),
            Diagnostic::error("mission/key", "unknown key").at(&Span::new(&source, 2..3)),
        ]);
        let value = serde_json::to_value(Failure::from(&diagnostics)).expect("plain");
        assert_eq!(value["stage"], "mission");
        assert_eq!(value["code"], "mission/key");
        assert_eq!(value["reason"], "no path; unknown key");
        assert_eq!(value["gap_m"], 0.4);
        assert_eq!(value["places"], json!([{ "file": "m.yaml", "line": 2 }]));
    }

    #[test]
    fn no_number_in_the_json_is_nan_or_infinite() {
        let mut broken = certificate();
        broken.clearance_proven = Some(f64::INFINITY);
        broken.end_point_error = f64::NAN;
        broken.limits[0].peak = f64::NAN;
        let part = CertificatePart::from(&broken);
        assert_eq!(part.clearance_proven_m, Some(FAR), "no obstacle at all is still a lower bound");
        assert_eq!(part.end_point_error_m, None);
        assert_eq!(LimitPart::from(&broken.limits[0]).peak, None);
        broken.clearance_proven = Some(f64::NEG_INFINITY);
        assert_eq!(CertificatePart::from(&broken).clearance_proven_m, None);
    }

    #[test]
    fn the_json_has_the_names_of_the_contract() {
        let mut report = Report::new(InputsPart { mission: InputFile::new("m.yaml", b"x"), ..InputsPart::default() });
        report.judge(&certificate());
        let json: Value = serde_json::from_str(&report.to_json()).expect("our own JSON");
        assert_eq!(json["schema"], "trajc.report/1");
        assert_eq!(json["status"], "certified");
        assert_eq!(json["certificate"]["clearance_proven_m"], 0.0512);
        assert_eq!(json["certificate"]["closest"]["link"], "left_blade");
        assert_eq!(
            json["limits"][0],
            json!({"actuator": "wheel_left", "quantity": "jerk", "peak": 0.1, "limit": null})
        );
        assert!(json.get("failure").is_none() && json.get("search").is_none());
        assert_eq!(json["inputs"]["mission"]["blake3"].as_str().map(str::len), Some(64));
    }

    #[test]
    fn the_schema_describes_every_part_of_the_report() {
        let schema: Value = serde_json::from_str(&json_schema()).expect("our own JSON");
        for key in
            ["status", "failure", "inputs", "robot", "map", "search", "trajectory", "initial", "profile", "limits"]
        {
            assert!(schema["properties"].get(key).is_some(), "{key}");
        }
    }
}
