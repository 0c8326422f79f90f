//! Robots for tests.

use crate::robot::{BaseLimits, MotionLimits, MovingJoint, RobotModel};

/// A robot without bodies: enough to plan with.
pub fn robot(track_width: f64, wheel: [f64; 3], joints: Vec<MovingJoint>) -> RobotModel {
    let [speed, acceleration, _] = wheel;
    RobotModel {
        name: "test".into(),
        wheel_radii: 0.1.into(),
        track_width,
        root_link: "base".into(),
        base_from_root: Default::default(),
        joints,
        bodies: Vec::new(),
        shapes: Vec::new(),
        wheel: limits(wheel),
        base: BaseLimits {
            speed,
            acceleration,
            angular_speed: 2.0 * speed / track_width,
            angular_acceleration: 2.0 * acceleration / track_width,
            eta: 1.0,
            min_speed: 0.01,
        },
        ignore_pairs: Vec::new(),
        tolerance: None,
        links: Vec::new(),
    }
}

/// The robot of \[CONV\] section 3.
pub fn conv() -> RobotModel {
    robot(0.4, [0.5, 0.2, 0.2], Vec::new())
}

/// Like SCR-DB: one blade.
pub fn scr_db() -> RobotModel {
    let blade = MovingJoint {
        name: "blade".into(),
        prismatic: false,
        lower: 0.0,
        upper: std::f64::consts::PI,
        limits: limits([1.0, 2.0, 10.0]),
    };
    RobotModel { wheel_radii: 0.08.into(), ..robot(0.32, [0.5, 0.5, 2.0], vec![blade]) }
}

fn limits([speed, acceleration, jerk]: [f64; 3]) -> MotionLimits {
    MotionLimits { speed: Some(speed), acceleration: Some(acceleration), jerk: Some(jerk) }
}
