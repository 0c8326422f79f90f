//! Whether the base is slow wherever the mission wants it slow: over every instant, not only when rows begin.

use super::rollout::Rollout;
use super::{Refusal, RefusalKind, ZoneSpeed, within};
use crate::geom::distance_to_area;
use crate::mission::SpeedZone;

/// A row that comes nearer to a zone than this counts as in it, m: nothing nearer is told apart.
const NEAR: f64 = 1e-4;
/// Speeds hold up to this factor above 1: rounding only.
const RELATIVE: f64 = 1e-9;

/// The greatest speed in each zone, and a refusal for each in which it is above the zone's.
///
/// A row's speed is held while its arc is driven. That an arc keeps out of a zone is proven as clearance is: from the distance at an
/// instant, the base gets no farther in a time than its speed lets it; halves are looked at where that is not enough.
pub(super) fn zones(rollout: &Rollout<'_>, zones: &[SpeedZone]) -> (Vec<ZoneSpeed>, Vec<Refusal>) {
    let rounding = rollout.rounding(0.0, extent(zones));
    let mut refusals = Vec::new();
    let speeds = zones.iter().enumerate().map(|(index, zone)| {
        let mut found = ZoneSpeed { limit: zone.speed, peak: None };
        let mut fastest = 0;
        for row in 0..rollout.rows() {
            let speed = rollout.held(row).speed.abs();
            if found.peak.is_some_and(|peak| speed <= peak) {
                continue;
            }
            if !keeps_out(rollout, row, [0.0, rollout.step()], zone, NEAR + rounding) {
                found.peak = Some(speed);
                fastest = row;
            }
        }
        if let Some(peak) = found.peak.filter(|peak| !within(*peak, zone.speed * (1.0 + RELATIVE))) {
            let (time, limit) = (rollout.time(fastest, 0.0), zone.speed);
            let message =
                format!("drives at {peak:.6} m/s at t = {time:.3} s in or at speed_zones[{index}], where {limit} m/s are allowed");
            refusals.push(Refusal { kind: RefusalKind::Zone, message, time: Some(time) });
        }
        found
    });
    (speeds.collect(), refusals)
}

/// Largest coordinate of any corner, m.
fn extent(zones: &[SpeedZone]) -> f64 {
    zones.iter().flat_map(|zone| &zone.polygon).flatten().fold(0.0, |most, v| most.max(v.abs()))
}

/// Whether the base is proven to stay farther than `near` from a zone between two instants of a row.
fn keeps_out(rollout: &Rollout<'_>, row: usize, [from, to]: [f64; 2], zone: &SpeedZone, near: f64) -> bool {
    let middle = 0.5 * (from + to);
    let pose = rollout.pose(row, middle);
    let distance = distance_to_area([pose.x, pose.y], &zone.polygon);
    let reach = 0.5 * (to - from) * rollout.held(row).speed.abs();
    if distance > reach + near {
        return true;
    }
    // Halves of it would not show more than this.
    if !(distance > near && reach > 0.1 * near) {
        return false;
    }
    keeps_out(rollout, row, [from, middle], zone, near) && keeps_out(rollout, row, [middle, to], zone, near)
}
