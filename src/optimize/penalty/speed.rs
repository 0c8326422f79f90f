//! Speed, least speed and acceleration along the path: \[SCR\] Eq. 13, 15, 17; and the wheels' rims.

use super::{Judge, Limits};
use crate::optimize::flatness::BaseMotion;

/// `v^2 <= v_max^2` (Eq. 13) and `a_l^2 <= a_max^2` (Eq. 15).
pub(crate) fn speed_and_acceleration(
    m: &BaseMotion,
    limits: &Limits,
    judge: &mut impl Judge,
    by: &mut BaseMotion,
) -> f64 {
    let scale = 1.0 / (limits.speed * limits.speed);
    let (speed, slope) = judge.weigh(m.v * m.v * scale - 1.0);
    by.v += slope * 2.0 * m.v * scale;
    let scale = 1.0 / (limits.acceleration * limits.acceleration);
    let (acceleration, slope) = judge.weigh(m.a * m.a * scale - 1.0);
    by.a += slope * 2.0 * m.a * scale;
    speed + acceleration
}

/// `v^2 >= v_min^2` (Eq. 17).
pub(crate) fn least_speed(m: &BaseMotion, limits: &Limits, judge: &mut impl Judge, by: &mut BaseMotion) -> f64 {
    let scale = 1.0 / (limits.min_speed * limits.min_speed);
    let (cost, slope) = judge.weigh(1.0 - m.v * m.v * scale);
    by.v -= slope * 2.0 * m.v * scale;
    cost
}

/// Both rims' speed, `v + D/2 |omega| <= wheel speed`, and acceleration, `|a_l +- D/2 alpha| <= wheel acceleration`.
/// Not in \[SCR\]; this is what the time law must keep, whichever way the robot drives.
pub(crate) fn rims(m: &BaseMotion, limits: &Limits, judge: &mut impl Judge, by: &mut BaseMotion) -> f64 {
    let mut sum = 0.0;
    for half in [limits.half_track, -limits.half_track] {
        let (cost, slope) = judge.weigh((m.v + half * m.omega) / limits.rim_speed - 1.0);
        sum += cost;
        by.v += slope / limits.rim_speed;
        by.omega += slope * half / limits.rim_speed;
        let rim = m.a + half * m.alpha;
        let scale = 1.0 / (limits.rim_acceleration * limits.rim_acceleration);
        let (cost, slope) = judge.weigh(rim * rim * scale - 1.0);
        sum += cost;
        by.a += slope * 2.0 * rim * scale;
        by.alpha += slope * 2.0 * rim * scale * half;
    }
    sum
}
