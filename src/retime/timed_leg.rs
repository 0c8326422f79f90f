//! One leg with its clock: what every actuator does at every time since the leg's start.

use std::sync::Arc;

use crate::geom::Pose2;
use crate::mission::TimeLaw;
use crate::trajectory::plane_curve::Place;

use super::convolution::Convolution;
use super::course::{Course, Curved, Jet, Proportional, compose};
use super::metric::Metric;
use super::optimal::Pace;
use super::peaks::{Peaks, peaks};
use super::steered::{NEAR_REST, Steered};
use super::warp::Warp;

/// Which quantity of the course is a function of time, and which function.
#[derive(Debug, Clone, PartialEq)]
pub enum Clock {
    /// The share of a proportional course, 0 to 1; of one that does not move, 0.
    Share(Convolution),
    /// Arc length.
    ArcLength(Convolution),
    /// The curve's parameter as a share of its range, scaled to the curve's length: \[CONV\] Eq. 2 as printed.
    Printed(Convolution),
    /// The curve's parameter: its own seconds, with ramps from and to rest.
    Own(Warp),
    /// The curve's parameter: its own seconds, this many, of a curve that starts and ends at rest by itself.
    Seconds(f64),
    /// Length in a metric of the curve's.
    Metric(Arc<Metric>, Convolution),
    /// What another clock says, at that clock's time.
    Paced(Box<Clock>, Pace),
}

impl Clock {
    /// Duration, s.
    pub fn duration(&self) -> f64 {
        match self {
            Self::Share(c) | Self::ArcLength(c) | Self::Printed(c) | Self::Metric(_, c) => c.duration(),
            Self::Own(warp) => warp.duration(),
            Self::Seconds(seconds) => *seconds,
            Self::Paced(_, pace) => pace.duration(),
        }
    }

    /// Times between which it is smooth, ascending.
    fn corners(&self) -> Vec<f64> {
        match self {
            Self::Share(c) | Self::ArcLength(c) | Self::Printed(c) => c.corners().to_vec(),
            Self::Own(warp) => warp.corners().to_vec(),
            Self::Seconds(seconds) => vec![0.0, *seconds],
            Self::Metric(metric, c) => {
                c.corners().into_iter().chain(metric.nodes().map(|length| c.time_at(length))).collect()
            }
            // Its own, and its reference's: not all of them are where cells join.
            Self::Paced(reference, pace) => {
                pace.corners().chain(reference.corners().into_iter().map(|t| pace.time_at(t))).collect()
            }
        }
    }

    /// Its quantity and three derivatives at a time.
    fn at(&self, t: f64) -> [f64; 4] {
        match self {
            Self::Share(c) | Self::ArcLength(c) | Self::Printed(c) | Self::Metric(_, c) => c.at(t),
            Self::Own(warp) => warp.at(t),
            Self::Seconds(_) => [t, 1.0, 0.0, 0.0],
            Self::Paced(reference, pace) => {
                let [t, p1, p2, p3] = pace.at(t);
                let [value, d1, d2, d3] = reference.at(t);
                let [d1, d2, d3] = compose([d1, d2, d3], [p1, p2, p3]);
                [value, d1, d2, d3]
            }
        }
    }

    /// The clock that says which quantity this is.
    fn root(&self) -> &Self {
        match self {
            Self::Paced(reference, _) => reference.root(),
            root => root,
        }
    }
}

/// A leg, timed.
#[derive(Debug, Clone)]
pub struct TimedLeg {
    /// What it does.
    pub course: Course,
    /// When, before the slow-down.
    pub clock: Clock,
    /// The slow-down that restores every limit, `>= 1`.
    pub stretch: f64,
    /// The law that a choice was made for; `None` where every law does the same (spins, joints alone, straight lines).
    pub law: Option<TimeLaw>,
    /// The centre's speed limit that the profile was made with, m/s; 0 where the base does not drive.
    pub speed_limit: f64,
    /// What Eq. 5 or its fixed point took off that limit, m/s.
    pub compensation: f64,
}

/// Where a leg is, and the first three derivatives of its parameter in unstretched time.
enum At<'a> {
    Share(&'a Proportional, [f64; 4]),
    Curve { curved: &'a Curved, place: Place, arc: Option<f64>, clock: [f64; 3] },
    Steered { steered: &'a Steered, place: Place, clock: [f64; 3] },
}

impl TimedLeg {
    /// Seconds from rest to rest.
    pub fn duration(&self) -> f64 {
        self.stretch * self.clock.duration()
    }

    /// Pose at a time since the leg's start.
    pub fn pose(&self, t: f64) -> Pose2 {
        match self.locate(t / self.stretch) {
            At::Share(p, [share, ..]) => p.pose(share),
            At::Curve { curved, place, .. } => curved.pose(place),
            At::Steered { steered, place, .. } => steered.pose(place),
        }
    }

    /// Wheel travel since the leg's start (left, right, m), then joint values, appended to `out`.
    pub fn positions(&self, t: f64, out: &mut Vec<f64>) {
        match self.locate(t / self.stretch) {
            At::Share(p, [share, ..]) => {
                out.extend(p.wheel_changes().map(|change| share * change));
                let joints = p.joints.iter().zip(&p.joint_changes);
                out.extend(joints.map(|(from, change)| from + share * change));
            }
            At::Curve { curved, place, arc, .. } => {
                let arc = arc.unwrap_or_else(|| curved.curve.arc(place));
                out.extend(curved.travel(arc, curved.curve.turn(place)));
                let dimensions = curved.curve.poly().pieces[0].coefficients.len();
                out.extend((2..dimensions).map(|d| curved.curve.poly().pieces[place.piece].derivative(d, 0, place.u)));
            }
            At::Steered { steered, place, .. } => steered.positions(place, out),
        }
    }

    /// What (left, right, joints…) move between two times since the leg's start, where that is known better than by a difference of
    /// positions: on proportional courses, and in a curve's own seconds. Appended to `out`; returns whether it is.
    pub fn moved(&self, from: f64, to: f64, out: &mut Vec<f64>) -> bool {
        if let (Course::Steered(steered), Clock::Seconds(_)) = (&self.course, &self.clock) {
            steered.moved(from / self.stretch, to / self.stretch, out);
            return true;
        }
        let (Course::Proportional(p), Clock::Share(profile)) = (&self.course, &self.clock) else { return false };
        if profile.distance() <= 0.0 {
            return false;
        }
        let share = profile.between(from / self.stretch, to / self.stretch);
        out.extend(p.wheel_changes().iter().chain(&p.joint_changes).map(|change| share * change));
        true
    }

    /// Speed, acceleration and jerk of (left, right, joints…, centre) at a time since the leg's start, appended to `out`.
    pub fn rates(&self, t: f64, out: &mut Vec<[f64; 3]>) {
        let first = out.len();
        self.clock_rates(t / self.stretch, out);
        let gamma = self.stretch;
        for rates in &mut out[first..] {
            *rates = [rates[0] / gamma, rates[1] / (gamma * gamma), rates[2] / (gamma * gamma * gamma)];
        }
    }

    /// Peaks of (left, right, joints…, centre) *before* the slow-down.
    pub fn clock_peaks(&self, refine: bool) -> Peaks {
        peaks(&self.clock_breaks(), refine, |t, out| self.clock_rates(t, out))
    }

    /// Times between which the leg's motion is smooth, since the leg's start; ascending.
    pub fn breaks(&self) -> Vec<f64> {
        self.clock_breaks().iter().map(|t| t * self.stretch).collect()
    }

    /// Times between which the leg's motion is smooth, before the slow-down; ascending.
    pub fn clock_breaks(&self) -> Vec<f64> {
        let mut breaks = self.clock.corners();
        if let Course::Steered(steered) = &self.course {
            let curve = &steered.curve;
            match &self.clock {
                Clock::Share(c) | Clock::ArcLength(c) | Clock::Printed(c) => {
                    breaks.extend(curve.nodes().map(|node| c.time_at(curve.travelled(node))));
                }
                Clock::Own(warp) => breaks.extend(curve.nodes().map(|node| warp.time_at(curve.parameter(node)))),
                Clock::Seconds(_) => breaks.extend(curve.nodes().map(|node| curve.parameter(node))),
                Clock::Metric(..) | Clock::Paced(..) => (), // The curve's nodes are among their corners.
            }
        }
        if let Course::Curved(curved) = &self.course {
            let curve = &curved.curve;
            match &self.clock {
                Clock::Share(c) | Clock::ArcLength(c) => breaks.extend(curve.nodes().map(|n| c.time_at(curve.arc(n)))),
                Clock::Printed(c) => {
                    let share = |node| curve.parameter(node) / curve.duration();
                    breaks.extend(curve.nodes().map(|node| c.time_at(share(node) * c.distance())));
                }
                Clock::Own(warp) => breaks.extend(curve.nodes().map(|node| warp.time_at(curve.parameter(node)))),
                Clock::Seconds(_) => breaks.extend(curve.nodes().map(|node| curve.parameter(node))),
                Clock::Metric(..) | Clock::Paced(..) => (), // The curve's nodes are among their corners.
            }
        }
        breaks.sort_by(f64::total_cmp);
        breaks
    }

    fn locate(&self, t: f64) -> At<'_> {
        let at = self.clock.at(t);
        match (&self.course, self.clock.root()) {
            (Course::Proportional(p), Clock::Share(_)) => At::Share(p, at),
            (Course::Proportional(p), _) => {
                debug_assert!(false, "a proportional course has no timing of its own");
                At::Share(p, [0.0; 4])
            }
            (Course::Curved(curved), Clock::Share(_) | Clock::ArcLength(_)) => {
                let [s, v, a, j] = at;
                let place = curved.curve.place_at_arc(s);
                At::Curve { curved, place, arc: Some(s), clock: curved.parameter_rates(place, [v, a, j]) }
            }
            (Course::Curved(curved), Clock::Printed(c)) => {
                let scale = curved.curve.duration() / c.distance();
                let [u, d1, d2, d3] = at.map(|v| v * scale);
                At::Curve { curved, place: curved.curve.place(u), arc: None, clock: [d1, d2, d3] }
            }
            (Course::Curved(curved), Clock::Metric(metric, _)) => {
                let (place, rates) = metric.at(at[0]);
                At::Curve { curved, place, arc: None, clock: compose(rates, [at[1], at[2], at[3]]) }
            }
            (Course::Curved(curved), _) => {
                let [u, d1, d2, d3] = at;
                At::Curve { curved, place: curved.curve.place(u), arc: None, clock: [d1, d2, d3] }
            }
            (Course::Steered(steered), Clock::Share(_) | Clock::ArcLength(_) | Clock::Printed(_)) => {
                let [s, v, a, j] = at;
                let place = steered.curve.place_at_travelled(s);
                At::Steered { steered, place, clock: steered.parameter_rates(place, [v, a, j]) }
            }
            (Course::Steered(steered), _) => {
                let [u, d1, d2, d3] = at;
                At::Steered { steered, place: steered.curve.place(u), clock: [d1, d2, d3] }
            }
        }
    }

    /// Speed, acceleration and jerk of (left, right, joints…, centre) before the slow-down, appended to `out`.
    pub fn clock_rates(&self, t: f64, out: &mut Vec<[f64; 3]>) {
        if let (Course::Steered(_), Clock::ArcLength(c)) = (&self.course, &self.clock) {
            let (first, margin) = (out.len(), NEAR_REST * c.duration());
            let since_rest = t.min(c.duration() - t).clamp(0.0, margin);
            if since_rest < margin {
                self.smooth_rates(t.clamp(margin, c.duration() - margin), out);
                let share = since_rest / margin;
                for [speed, acceleration, _] in &mut out[first..] {
                    *speed *= share * share;
                    *acceleration *= share;
                }
                return;
            }
        }
        self.smooth_rates(t, out);
    }

    fn smooth_rates(&self, t: f64, out: &mut Vec<[f64; 3]>) {
        match self.locate(t) {
            At::Share(p, [_, d1, d2, d3]) => {
                let changes = p.wheel_changes().into_iter().chain(p.joint_changes.iter().copied()).chain([p.drive]);
                out.extend(changes.map(|q| compose([q, 0.0, 0.0], [d1, d2, d3])));
            }
            At::Curve { curved, place, clock, .. } => curved.rates(place, clock, out),
            At::Steered { steered, place, clock } => steered.rates(place, clock, out),
        }
    }

    /// Position and three derivatives of (left, right, joints…) at a time since the leg's start.
    pub fn jets(&self, t: f64) -> Vec<Jet> {
        let (mut positions, mut rates) = (Vec::new(), Vec::new());
        self.positions(t, &mut positions);
        self.rates(t, &mut rates);
        positions.iter().zip(rates).map(|(q, [d1, d2, d3])| [*q, d1, d2, d3]).collect()
    }
}

#[cfg(test)]
mod tests;
