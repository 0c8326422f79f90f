//! Why the certificate refuses, and what to do about it.

use crate::certify::{Certificate, RefusalKind};
use crate::diag::Diagnostic;
use crate::trajectory::TrajectorySource;

pub(super) fn refused(certificate: &Certificate, source: TrajectorySource) -> Diagnostic {
    let reasons: Vec<&str> = certificate.refusals.iter().map(|r| r.message.as_str()).collect();
    let too_close = certificate.refusals.iter().all(|r| r.kind == RefusalKind::Clearance);
    let too_wide = certificate.refusals.iter().any(|r| r.kind == RefusalKind::Tolerance);
    let own_links = certificate.refusals.iter().any(|r| r.kind == RefusalKind::OwnLinks);
    let hint = match source {
        _ if too_wide => return refused_for_tolerance(certificate, &reasons.join("; ")),
        _ if own_links => {
            "other joint values at start and goal may keep them apart; where shapes are drawn too large, name the pair in robot.yaml's \
             `collision: {ignore_pairs}`: `trajc robot init URDF` lists such pairs"
        }
        TrajectorySource::Given if too_close => {
            "a given path is driven as it is: lead it around the obstacle, or lower `clearance_m`"
        }
        _ if too_close => "lower `clearance_m`, or shorten `sampling_time_s`: held commands cut curves",
        _ => "lower `clearance_m` or the speed limits, or shorten `sampling_time_s`",
    };
    Diagnostic::failure("certify/refused", format!("the certificate is refused: {}", reasons.join("; "))).hint(hint)
}

/// The message of a motion that the model's robot can drive, but not every robot within the tolerance.
fn refused_for_tolerance(certificate: &Certificate, reasons: &str) -> Diagnostic {
    let inside = certificate.tolerance.as_ref();
    let shares = inside.and_then(|inside| inside.there).map(|(_, shares)| shares).unwrap_or_default();
    let remedy = match shares.most().0 {
        "latency_s" => "a controller that is less late, or slower joints (`limits`)",
        "start_m" | "start_rad" => "a start that is set more exactly",
        _ => "wheels and track that are calibrated, for a smaller `tolerance`",
    };
    let hint = format!(
        "{remedy}; a shorter way between places where feedback sets the robot right; or a smaller `clearance_m`, which every robot \
         within the tolerance keeps"
    );
    let mut fault =
        Diagnostic::failure("certify/tolerance", format!("the certificate is refused: {reasons}")).hint(hint);
    for (key, share) in shares.named() {
        fault = fault.number(share_key(key), share);
    }
    fault
}

/// The name of a tolerance's share among a report's numbers.
fn share_key(key: &str) -> &'static str {
    match key {
        "wheel_radius" => "share_wheel_radius_m",
        "wheel_difference" => "share_wheel_difference_m",
        "track" => "share_track_m",
        "latency_s" => "share_latency_m",
        "start_m" => "share_start_m",
        _ => "share_start_heading_m",
    }
}
