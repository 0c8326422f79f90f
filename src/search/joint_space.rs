//! What postures of many joints are measured and sampled by.

use crate::math::halton;
use crate::robot::RobotModel;

/// The joints' ranges and planning speeds.
pub(super) struct JointSpace {
    pub ranges: Vec<[f64; 2]>,
    speeds: Vec<f64>,
}

impl JointSpace {
    /// `near`: values about which endless joints are sampled.
    pub fn new(robot: &RobotModel, near: &[f64]) -> Self {
        Self {
            ranges: robot.joints.iter().zip(near).map(|(joint, near)| joint.range_about(*near)).collect(),
            speeds: robot.joints.iter().map(|joint| joint.limits.planning()[0]).collect(),
        }
    }

    /// Time between two postures, each joint at its planning speed, s.
    pub fn time(&self, a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).zip(&self.speeds).map(|((a, b), speed)| (a - b).abs() / speed).fold(0.0, f64::max)
    }

    /// Posture `index`, from 1, of a Halton sequence over the ranges.
    pub fn sample(&self, index: usize) -> Vec<f64> {
        let value = |(joint, [low, high]): (usize, &[f64; 2])| low + halton::value(joint, index) * (high - low);
        self.ranges.iter().enumerate().map(value).collect()
    }
}

/// The posture so far on the straight way from one to another.
pub(super) fn between(a: &[f64], b: &[f64], share: f64) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + share * (b - a)).collect()
}
