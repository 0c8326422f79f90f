//! The whole motion as functions of time.

use std::sync::Arc;

use crate::geom::Pose2;
use crate::math::real;
use crate::mission::TimeLaw;

use super::course::{Course, Jet};
use super::law_key;
use super::timed_leg::TimedLeg;

/// The motion as functions of time, from rest to rest, in closed form at any time. Cheap to clone.
#[derive(Debug, Clone)]
pub struct MotionProfile {
    legs: Arc<[TimedLeg]>,
    /// When each leg starts and the last one ends, before the uniform slow-down to [`Self::time`].
    starts: Arc<[f64]>,
    /// Wheel travel (left, right) at each leg's start and the end, m.
    travel: Arc<[[f64; 2]]>,
    law: TimeLaw,
    time: f64,
}

/// Everything that moves, at one instant.
#[derive(Debug, Clone, PartialEq)]
pub struct MotionState {
    /// Planned pose; yaw not wrapped.
    pub pose: Pose2,
    /// Travel of the left and right wheel's rim since the start with three time derivatives: m, m/s, m/s^2, m/s^3.
    pub wheels: [Jet; 2],
    /// Each joint's value with three time derivatives.
    pub joints: Vec<Jet>,
}

/// A time by the leg that it falls into, with wheel travel since *its* start: differences of small numbers lose least.
struct Local {
    leg: usize,
    since: f64,
    positions: Vec<f64>,
}

impl MotionProfile {
    /// Joins timed legs; the duration is rounded up to a multiple of `hold`, at least one.
    pub(super) fn new(legs: Vec<TimedLeg>, law: TimeLaw, hold: f64) -> Self {
        Self::unrounded(legs, law).rounded_up(hold)
    }

    /// Joins timed legs; lasts as long as they do.
    pub(super) fn unrounded(legs: Vec<TimedLeg>, law: TimeLaw) -> Self {
        let (mut starts, mut travel) = (vec![0.0], vec![[0.0; 2]]);
        for (i, leg) in legs.iter().enumerate() {
            starts.push(starts[i] + leg.duration());
            let of_leg = leg.course.travel();
            travel.push([travel[i][0] + of_leg[0], travel[i][1] + of_leg[1]]);
        }
        let time = starts[legs.len()];
        Self { legs: legs.into(), starts: starts.into(), travel: travel.into(), law, time }
    }

    /// Duration, s.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// The sum of the legs' own durations, each slowed down as its limits ask, before rounding up to [`Self::time`], s.
    pub fn unrounded_time(&self) -> f64 {
        self.starts[self.legs.len()]
    }

    /// The law as the report names it: its key; for `auto` with the laws that were chosen.
    pub fn law_name(&self) -> String {
        let name = law_key(self.law).to_owned();
        if self.law != TimeLaw::Auto {
            return name;
        }
        let candidates = [TimeLaw::Optimal, TimeLaw::Minco, TimeLaw::Eq5, TimeLaw::FixedPoint];
        let chosen: Vec<&str> = candidates
            .into_iter()
            .filter(|law| self.legs.iter().any(|leg| leg.law == Some(*law)))
            .map(law_key)
            .collect();
        if chosen.is_empty() { name } else { format!("{name} ({})", chosen.join(", ")) }
    }

    /// The centre's speed limit that the profile was made with, m/s: v' on the leg where compensation takes most; the peak speed
    /// where the timing is the optimiser's own; 0 where the base does not drive.
    pub fn v_max(&self) -> f64 {
        match self.most_compensated() {
            Some(leg) => leg.speed_limit,
            None => self.legs.iter().map(|leg| leg.speed_limit).fold(0.0, f64::max),
        }
    }

    /// What Eq. 5 (or its fixed point) took off the speed limit on that leg, m/s.
    pub fn v_comp(&self) -> f64 {
        self.most_compensated().map_or(0.0, |leg| leg.compensation)
    }

    fn most_compensated(&self) -> Option<&TimedLeg> {
        let compensated = self.legs.iter().filter(|leg| leg.compensation > 0.0);
        compensated.max_by(|a, b| a.compensation.total_cmp(&b.compensation))
    }

    /// The same motion, slowed down uniformly to last `time` seconds (at least as long as now).
    pub fn slowed_to(&self, time: f64) -> Self {
        Self { time: time.max(self.time), ..self.clone() }
    }

    /// The same motion, slowed down uniformly to the next multiple of `hold` seconds.
    pub fn rounded_up(&self, hold: f64) -> Self {
        // A duration that is a multiple but for rounding stays: the limits' own tolerance is a thousand times that.
        let steps = (self.time / hold * (1.0 - 1e-12)).ceil().max(1.0);
        Self { time: steps * hold, ..self.clone() }
    }

    /// The legs, timed, in order.
    pub fn legs(&self) -> &[TimedLeg] {
        &self.legs
    }

    /// Number of joints.
    pub fn joint_count(&self) -> usize {
        match &self.legs[0].course {
            Course::Curved(c) => c.curve.poly().pieces[0].coefficients.len() - 2,
            Course::Proportional(p) => p.joints.len(),
            Course::Steered(s) => s.curve.joint_count(),
        }
    }

    /// By how much time is stretched uniformly, `>= 1`. Of a motion that takes no time by itself: 1.
    fn stretch(&self) -> f64 {
        let own = self.unrounded_time();
        if own > 0.0 { self.time / own } else { 1.0 }
    }

    /// The leg at a time and the time since its start, both before the uniform slow-down.
    fn leg_at(&self, t: f64) -> (usize, f64) {
        let own = (t / self.stretch()).clamp(0.0, self.unrounded_time());
        if t >= self.time {
            let last = self.legs.len() - 1;
            return (last, self.legs[last].duration());
        }
        let leg = self.starts.partition_point(|start| *start <= own).clamp(1, self.legs.len()) - 1;
        (leg, own - self.starts[leg])
    }

    /// Planned pose at a time, clamped to the profile.
    pub fn pose(&self, t: f64) -> Pose2 {
        let (leg, since) = self.leg_at(t);
        self.legs[leg].pose(since)
    }

    /// Joint values at a time, clamped to the profile.
    pub fn joints(&self, t: f64) -> Vec<f64> {
        let (leg, since) = self.leg_at(t);
        let mut out = Vec::with_capacity(2 + self.joint_count());
        self.legs[leg].positions(since, &mut out);
        out.split_off(2)
    }

    /// Speeds of (left, right, joints…) at a time, clamped to the profile: m/s at the rim, rad/s or m/s.
    pub fn speeds(&self, t: f64) -> Vec<f64> {
        if t <= 0.0 || t >= self.time {
            return vec![0.0; 2 + self.joint_count()];
        }
        let (leg, since) = self.leg_at(t);
        let mut rates = Vec::new();
        self.legs[leg].rates(since, &mut rates);
        rates.pop(); // the centre
        rates.iter().map(|r| r[0] / self.stretch()).collect()
    }

    /// Mean speeds of (left, right, joints…) over each of `steps` equal intervals of the profile.
    pub fn mean_speeds(&self, steps: usize) -> Vec<Vec<f64>> {
        let hold = self.time / steps as f64;
        let mut before = self.local_positions(0.0);
        (1..=steps)
            .map(|k| {
                let after = self.local_positions(k as f64 * hold);
                let mut means = Vec::with_capacity(after.positions.len());
                let mut length = hold;
                if before.leg == after.leg && self.legs[after.leg].moved(before.since, after.since, &mut means) {
                    // Of the interval as it came out after rounding: a last-bit error of its length would be a step in speed.
                    length = (after.since - before.since) * self.stretch();
                } else {
                    means.clear();
                    means.extend((0..after.positions.len()).map(|i| self.difference(i, &before, &after)));
                }
                means.iter_mut().for_each(|mean| *mean /= length);
                before = after;
                means
            })
            .collect()
    }

    fn local_positions(&self, t: f64) -> Local {
        let (leg, since) = self.leg_at(t);
        let mut positions = Vec::with_capacity(2 + self.joint_count());
        self.legs[leg].positions(since, &mut positions);
        Local { leg, since, positions }
    }

    fn difference(&self, i: usize, before: &Local, after: &Local) -> f64 {
        let within = after.positions[i] - before.positions[i];
        // Joint values are absolute; wheel travel starts anew with every leg.
        if i >= 2 || before.leg == after.leg {
            within
        } else {
            within + (self.travel[after.leg][i] - self.travel[before.leg][i])
        }
    }

    /// Everything at a time, clamped to the profile.
    pub fn at(&self, t: f64) -> MotionState {
        let (leg, since) = self.leg_at(t);
        let gamma = self.stretch();
        let mut jets = self.legs[leg].jets(since);
        for jet in &mut jets {
            (1..4).for_each(|k| jet[k] /= real::powi(gamma, k as i32));
        }
        let joints = jets.split_off(2);
        let wheels = [0, 1].map(|side| {
            let mut jet = jets[side];
            jet[0] += self.travel[leg][side];
            jet
        });
        MotionState { pose: self.legs[leg].pose(since), wheels, joints }
    }
}
