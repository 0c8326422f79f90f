//! \[CONV\] to the letter: profiles whose wheels break limits where the paper's do.

use crate::mission::TimeLaw;
use crate::robot::RobotModel;
use crate::trajectory::{Trajectory, TrajectorySource};

use super::course::Course;
use super::law::{Task, centre_limits, left_by_eq5, time_leg, unslowed};
use super::timed_leg::Clock;
use super::zones::Zones;
use super::{MotionProfile, RetimeError, course, is_one_cubic};

/// Which of the paper's equations make a profile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Printed {
    /// Eq. 2, `u = s / B_d`; otherwise the true inverse of the arc length.
    pub eq2: bool,
    /// Eq. 5; otherwise the centre cruises at the wheels' limit.
    pub eq5: bool,
}

/// Times a given path as the paper does: no slow-down makes wheels keep what Eq. 5 leaves broken, and the duration is not rounded up
/// to whole samples. Straight drives and spins are as under every law.
///
/// # Errors
/// The path is none that the equations can time.
pub fn as_printed(trajectory: &Trajectory, robot: &RobotModel, how: Printed) -> Result<MotionProfile, RetimeError> {
    let one_segment = trajectory.source == TrajectorySource::Given && is_one_cubic(&trajectory.legs);
    if how.eq2 && !one_segment {
        return Err(RetimeError::PrintedNeedsOneSegment);
    }
    let (law, clock): (_, fn(_) -> _) =
        if how.eq2 { (TimeLaw::Printed, Clock::Printed) } else { (TimeLaw::Eq5, Clock::ArcLength) };
    let legs = trajectory.legs.iter().enumerate().map(|(leg, what)| {
        let task = Task { robot, hold: 0.0, own_timing: false, one_segment, leg, zones: Zones::new(&[], robot, 0.0) };
        let course = course(what, leg, robot)?;
        let Course::Curved(curved) = &course else { return time_leg(&course, law, task) };
        let [v, a, j] = centre_limits(robot);
        let speed = if how.eq5 { left_by_eq5(curved, law, clock, task)? } else { v };
        Ok(unslowed(curved, law, clock, [speed, a, j], v))
    });
    let legs = legs.collect::<Result<Vec<_>, _>>()?;
    if legs.is_empty() {
        return Err(RetimeError::Empty);
    }
    Ok(MotionProfile::unrounded(legs, law))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory::{fixtures, given};
    use serde_json::Value;

    #[test]
    fn what_the_paper_prints_agrees_with_an_independent_solver_peaks_over_the_limits_included() {
        let vectors: Value = serde_json::from_str(include_str!("../../tests/vectors/time_laws.json")).unwrap();
        let rows = [(false, false, "centre_only"), (false, true, "eq5_once"), (true, true, "eq5_printed")];
        let mut over = 0;
        for name in ["c_curve", "s_curve", "arbitrary"] {
            let path = &vectors["paths"][name];
            let segments: Vec<[[f64; 2]; 4]> = serde_json::from_value(path["control_points"].clone()).unwrap();
            let trajectory = given::from_bezier(&segments, &[]).unwrap();
            for (eq2, eq5, row) in rows {
                let Some(time) = path[row]["time"].as_f64() else {
                    let refused = as_printed(&trajectory, &fixtures::conv(), Printed { eq2, eq5 }).unwrap_err();
                    assert_eq!((name, refused), ("arbitrary", RetimeError::PrintedNeedsOneSegment));
                    continue;
                };
                let profile = as_printed(&trajectory, &fixtures::conv(), Printed { eq2, eq5 }).unwrap();
                assert!((profile.time() - time).abs() < 6e-5, "{name} {row}: {} s", profile.time());
                let steps = 40000;
                let mut peaks = [0.0f64; 3];
                for i in 0..=steps {
                    let state = profile.at(profile.time() * f64::from(i) / f64::from(steps));
                    state.wheels.iter().for_each(|jet| (0..3).for_each(|k| peaks[k] = peaks[k].max(jet[k + 1].abs())));
                }
                for (k, peak) in peaks.into_iter().enumerate() {
                    let expected = path[row]["peak"][k].as_f64().unwrap();
                    assert!((peak - expected).abs() < 1e-4, "{name} {row}, order {k}: {peak} vs {expected}");
                }
                over += usize::from(peaks[2] > 0.2001);
            }
        }
        assert_eq!(over, 8, "every one of them breaks the jerk limit");
    }

    #[test]
    fn a_turn_tighter_than_half_the_track_is_refused_with_eq5_alone() {
        let hairpin = given::from_bezier(&[[[0.0, 0.0], [1.0, 0.0], [1.0, 0.3], [0.0, 0.3]]], &[]).unwrap();
        let timed = |eq2, eq5| as_printed(&hairpin, &fixtures::conv(), Printed { eq2, eq5 });
        assert!(matches!(timed(false, true), Err(RetimeError::CompensationLeavesNoSpeed { .. })));
        assert!(timed(false, false).is_ok() && timed(true, false).is_ok());
    }
}
