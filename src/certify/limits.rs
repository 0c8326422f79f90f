//! Limits: speed, and first and second differences of the held speeds over the sampling time, at rest before and after.

use super::rollout::Rollout;
use super::{LimitCheck, Refusal, RefusalKind, within};
use crate::command::CommandTable;
use crate::robot::{MotionLimits, RobotModel};

/// Slower than this is not driving backwards, m/s.
const BACKWARDS: f64 = 1e-6;
/// Limits hold up to this factor above 1: rounding only.
const RELATIVE: f64 = 1e-9;
/// Joint positions hold up to this, rad or m: rounding only.
const POSITION: f64 = 1e-9;

/// Peaks of every actuator (wheels, then joints) and a refusal for each that is above its limit.
pub(super) fn limits(table: &CommandTable, robot: &RobotModel) -> (Vec<LimitCheck>, Vec<Refusal>) {
    let rims: Vec<_> = (0..table.rows.len()).map(|k| table.rim_speeds(k)).collect();
    let mut actuators = vec![
        ("wheel_left", true, robot.wheel, rims.iter().map(|r| r.0).collect::<Vec<_>>()),
        ("wheel_right", true, robot.wheel, rims.iter().map(|r| r.1).collect()),
    ];
    for (index, joint) in robot.joints.iter().enumerate() {
        let rates = table.rows.iter().map(|row| row.joint_velocities[index]).collect();
        actuators.push((&joint.name, joint.prismatic, joint.limits, rates));
    }
    let (mut checks, mut refusals) = (Vec::new(), Vec::new());
    for (name, in_metres, limit, speeds) in actuators {
        for (peak, (quantity, bound, power)) in peaks(&speeds, table.sampling_time).into_iter().zip(quantities(limit)) {
            if let Some(bound) = bound.filter(|bound| !within(peak.magnitude, bound * (1.0 + RELATIVE))) {
                let unit = format!("{}/s{power}", if in_metres { "m" } else { "rad" });
                let time = table.time(peak.row);
                let over = 100.0 * (peak.magnitude / bound - 1.0);
                let message = format!(
                    "`{name}`: {quantity} {:.6} {unit} at t = {time:.3} s, limit {bound:.6} {unit} ({over:.3} % over)",
                    peak.magnitude
                );
                refusals.push(Refusal { kind: RefusalKind::Limit, message, time: Some(time) });
            }
            checks.push(LimitCheck { actuator: name.to_owned(), quantity, peak: peak.magnitude, limit: bound });
        }
    }
    (checks, refusals)
}

fn quantities(limits: MotionLimits) -> [(&'static str, Option<f64>, &'static str); 3] {
    [("speed", limits.speed, ""), ("acceleration", limits.acceleration, "^2"), ("jerk", limits.jerk, "^3")]
}

struct Peak {
    magnitude: f64,
    row: usize,
}

/// Largest magnitudes of the held speeds, of their first difference over `step`, and of their second over `step` squared.
fn peaks(speeds: &[f64], step: f64) -> [Peak; 3] {
    let at = |k: usize, back: usize| if k >= back { speeds.get(k - back).copied().unwrap_or(0.0) } else { 0.0 };
    let largest = |value: &dyn Fn(usize) -> f64| {
        let mut peak = Peak { magnitude: 0.0, row: 0 };
        for k in 0..=speeds.len() + 1 {
            let magnitude = value(k).abs();
            if magnitude > peak.magnitude {
                peak = Peak { magnitude, row: k.min(speeds.len().saturating_sub(1)) };
            }
        }
        peak
    };
    [
        largest(&|k| at(k, 0)),
        largest(&|k| (at(k, 0) - at(k, 1)) / step),
        largest(&|k| (at(k, 0) - 2.0 * at(k, 1) + at(k, 2)) / (step * step)),
    ]
}

/// A refusal where the base drives backwards, by more than rounding in written digits (1 um/s).
pub(super) fn backwards(table: &CommandTable, rollout: &Rollout<'_>) -> Option<Refusal> {
    let speeds = (0..table.rows.len()).map(|row| (row, table.twist(row).0));
    let (row, speed) = speeds.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|(_, speed)| *speed < -BACKWARDS)?;
    let time = rollout.time(row, 0.0);
    let message = format!("drives backwards at {:.6} m/s at t = {time:.3} s, which the mission does not allow", -speed);
    Some(Refusal { kind: RefusalKind::Reverse, message, time: Some(time) })
}

/// A refusal for each joint that leaves its range. Joints move straight from row to row, so rows suffice.
pub(super) fn positions(rollout: &Rollout<'_>, robot: &RobotModel) -> Vec<Refusal> {
    let mut refusals = Vec::new();
    for (index, joint) in robot.joints.iter().enumerate() {
        let beyond = |q: f64| (joint.lower - q).max(q - joint.upper);
        let values = (0..rollout.rows()).map(|row| (row, rollout.joints(row)[index]));
        let worst = values.max_by(|a, b| beyond(a.1).total_cmp(&beyond(b.1)));
        let Some((row, value)) = worst.filter(|(_, q)| !within(beyond(*q), POSITION)) else { continue };
        let (time, unit) = (rollout.time(row, 0.0), if joint.prismatic { "m" } else { "rad" });
        let message = format!(
            "`{}`: position {value:.6} {unit} at t = {time:.3} s is outside its range {:.6} to {:.6} {unit}",
            joint.name, joint.lower, joint.upper
        );
        refusals.push(Refusal { kind: RefusalKind::Position, message, time: Some(time) });
    }
    refusals
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn peaks_are_those_of_the_differences_with_rest_before_and_after(
            speeds in prop::collection::vec(-1.0..1.0f64, 1..9), step in 0.05..0.5f64,
        ) {
            let padded = [vec![0.0; 3], speeds.clone(), vec![0.0; 3]].concat();
            let difference = |values: &[f64]| values.windows(2).map(|w| (w[1] - w[0]) / step).collect::<Vec<f64>>();
            let (first, second) = (difference(&padded), difference(&difference(&padded)));
            for (peak, values) in peaks(&speeds, step).iter().zip([&padded, &first, &second]) {
                let expected = values.iter().fold(0.0f64, |most, v| most.max(v.abs()));
                prop_assert!((peak.magnitude - expected).abs() < 1e-9 * (1.0 + expected), "{} {expected}", peak.magnitude);
                prop_assert!(peak.row < speeds.len());
            }
        }
    }

    #[test]
    fn a_ramp_that_ends_at_rest_jerks_after_its_last_row() {
        // Slower by less and less more, up to a slope of 1 that the stop cuts off two rows after the last.
        let speeds = [
            0.1, 0.3, 0.6, 1.0, 1.5, 2.1, 2.8, 3.4, 3.9, 4.3, 4.6, 4.8, 4.9, 4.9, 4.8, 4.6, 4.3, 3.9, 3.4, 2.8, 2.0,
            1.0,
        ];
        let [_, _, jerk] = peaks(&speeds, 1.0);
        assert!(
            (jerk.magnitude - 1.0).abs() < 1e-12 && jerk.row == speeds.len() - 1,
            "{} {}",
            jerk.magnitude,
            jerk.row
        );
    }
}
