//! Penalties of \[SCR\] section V at one instant. Each adds its gradient and returns its cost; every constraint is divided by its
//! limit (squared forms by the limit squared) before [`smooth_positive`], so one width and one weight suit all.

pub mod clearance;
pub mod field;
pub mod joint;
mod own_links;
pub mod speed;
pub(crate) mod touch;
pub mod turn;
pub mod zone;

use crate::math::smooth::smooth_positive;
use crate::robot::RobotModel;

/// Limits as the penalties use them; SI.
#[derive(Debug, Clone, PartialEq)]
pub struct Limits {
    /// Of the base, m/s.
    pub speed: f64,
    /// Least speed of the base (\[SCR\] section V-C), m/s.
    pub min_speed: f64,
    /// Of the base along the path, m/s^2.
    pub acceleration: f64,
    /// Of the base, rad/s.
    pub angular_speed: f64,
    /// Of the base, rad/s^2.
    pub angular_acceleration: f64,
    /// `2 eta / D` of \[SCR\] Eq. 14, rad/m: turn rate gained for every m/s below `speed`.
    pub turn_slope: f64,
    /// Half the track width, m.
    pub half_track: f64,
    /// Of the wheels' rims, m/s.
    pub rim_speed: f64,
    /// Of the wheels' rims, m/s^2.
    pub rim_acceleration: f64,
    /// One entry a joint.
    pub joints: Vec<JointLimits>,
    /// Width `a_0` of [`smooth_positive`], in relative units.
    pub width: f64,
}

/// Limits of one joint; rad or m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointLimits {
    /// Least position, may be infinite.
    pub lower: f64,
    /// Greatest position, may be infinite.
    pub upper: f64,
    /// Per second.
    pub speed: f64,
    /// Per second squared.
    pub acceleration: f64,
}

impl Limits {
    /// The robot's limits; `width` is the penalties' rounding, relative to each limit.
    pub fn new(robot: &RobotModel, width: f64) -> Self {
        let [rim_speed, rim_acceleration, _] = robot.wheel.planning();
        let base = &robot.base;
        Self {
            speed: base.speed.min(rim_speed),
            min_speed: base.min_speed,
            acceleration: base.acceleration.min(rim_acceleration),
            angular_speed: base.angular_speed,
            angular_acceleration: base.angular_acceleration,
            turn_slope: 2.0 * base.eta / robot.track_width,
            half_track: 0.5 * robot.track_width,
            rim_speed,
            rim_acceleration,
            joints: robot
                .joints
                .iter()
                .map(|joint| {
                    let [speed, acceleration, _] = joint.limits.planning();
                    JointLimits { lower: joint.lower, upper: joint.upper, speed, acceleration }
                })
                .collect(),
            width,
        }
    }

    /// Greatest turn rate at speed `v`, rad/s: Eq. 14, the cap, and the rims.
    pub fn turn_rate(&self, v: f64) -> f64 {
        let eq14 = self.turn_slope * (self.speed - v);
        eq14.min(self.angular_speed).min((self.rim_speed - v) / self.half_track).max(0.0)
    }
}

/// Where violations go: a penalty, or the largest of them when a finished curve is judged.
pub(crate) trait Judge {
    /// Takes a constraint value (violated when > 0, relative to its limit); returns its share of the cost and d(cost)/d(x).
    fn weigh(&mut self, x: f64) -> (f64, f64);
}

/// Sums penalties.
pub(crate) struct Penalise(pub f64);

impl Judge for Penalise {
    fn weigh(&mut self, x: f64) -> (f64, f64) {
        smooth_positive(x, self.0)
    }
}

/// Keeps the largest violation; costs nothing.
pub(crate) struct Worst(pub f64);

impl Judge for Worst {
    fn weigh(&mut self, x: f64) -> (f64, f64) {
        self.0 = self.0.max(x);
        (0.0, 0.0)
    }
}

#[cfg(test)]
pub(crate) fn example_limits(joints: usize) -> Limits {
    Limits {
        speed: 0.5,
        min_speed: 0.1,
        acceleration: 0.4,
        angular_speed: 1.1,
        angular_acceleration: 1.5,
        turn_slope: 2.5,
        half_track: 0.16,
        rim_speed: 0.5,
        rim_acceleration: 0.5,
        joints: vec![JointLimits { lower: -0.5, upper: 0.6, speed: 0.7, acceleration: 1.1 }; joints],
        width: 0.2,
    }
}
