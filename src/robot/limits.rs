//! Limits: the URDF's, then robot.yaml's, then the mission's, key by key.

use super::drive::Drive;
use super::joints::{Roles, Value, range, velocity};
use super::spec::RobotSpec;
use super::urdf::Urdf;
use super::wheels::Wheels;
use super::{BaseLimits, MotionLimits, MovingJoint};
use crate::diag::{Diagnostic, Span, suggestion};
use crate::mission::{ActuatorLimitsSpec, LimitsSpec};
use urdf_rs::JointType;

/// Slack when an override is compared with the URDF: `180deg` against 3.14159265359.
const SLACK: f64 = 1e-9;

/// Both layers of overrides.
pub(super) struct Overrides<'a> {
    pub spec: &'a RobotSpec,
    pub mission: &'a LimitsSpec,
    pub faults: Vec<Diagnostic>,
}

impl Overrides<'_> {
    /// The mission's value, else robot.yaml's; must be finite and, if `positive`, above 0.
    fn pick(
        &mut self,
        part: &str,
        key: &str,
        values: [Option<f64>; 2],
        positive: bool,
        at: Option<&Span>,
    ) -> Option<f64> {
        let [robot, mission] = values;
        let value = mission.or(robot)?;
        if value.is_finite() && (value > 0.0 || !positive) {
            return Some(value);
        }
        let whose = if mission.is_some() { "the mission's" } else { "robot.yaml's" };
        let what = if value.is_finite() { "not above 0" } else { "not finite" };
        let message = format!("{whose} limits.{part}.{key} is {value}: {what}");
        let hint = "write a number above 0, or leave it out";
        self.faults.push(Diagnostic::error("robot/limit-not-positive", message).maybe_at(at).hint(hint));
        None
    }

    /// Speed, acceleration, jerk as overridden.
    fn motion(
        &mut self,
        part: &str,
        keys: [&str; 3],
        layers: [&ActuatorLimitsSpec; 2],
        at: Option<&Span>,
    ) -> MotionLimits {
        let mut pick =
            |key, get: fn(&ActuatorLimitsSpec) -> Option<f64>| self.pick(part, key, layers.map(get), true, at);
        MotionLimits {
            speed: pick(keys[0], |l| l.speed),
            acceleration: pick(keys[1], |l| l.acceleration),
            jerk: pick(keys[2], |l| l.jerk),
        }
    }

    /// Of each wheel's rim. Default speed: the slowest wheel's.
    pub fn wheel(&mut self, urdf: &Urdf, wheels: &Wheels, drive: &Drive) -> MotionLimits {
        let layers = [&self.spec.limits.wheel, &self.mission.wheel];
        let mut limits = self.motion("wheel", ["speed_mps", "acceleration_mps2", "jerk_mps3"], layers, None);
        let of = |side: &[usize], radius: f64| {
            side.iter().filter_map(|j| velocity(&urdf.robot.joints[*j])).map(|rate| rate * radius).reduce(f64::min)
        };
        let [left, right] = drive.wheel_radii.sides();
        let slowest = of(&wheels.left, left).into_iter().chain(of(&wheels.right, right)).reduce(f64::min);
        limits.speed = limits.speed.or(slowest);
        limits
    }

    /// Of the base, all defaults applied.
    pub fn base(&mut self, wheel: &MotionLimits, drive: &Drive) -> BaseLimits {
        let layers = [&self.spec.limits.base, &self.mission.base];
        let mut pick = |key, values| self.pick("base", key, values, true, None);
        let [wheel_speed, wheel_acceleration, _] = wheel.planning();
        let speed = pick("speed_mps", layers.map(|l| l.speed)).unwrap_or(wheel_speed);
        let eta = pick("eta", layers.map(|l| l.eta)).unwrap_or(1.0);
        let track = drive.track_width;
        BaseLimits {
            speed,
            acceleration: pick("acceleration_mps2", layers.map(|l| l.acceleration)).unwrap_or(wheel_acceleration),
            angular_speed: pick("angular_speed_radps", layers.map(|l| l.angular_speed))
                .unwrap_or(2.0 * eta * speed / track),
            angular_acceleration: pick("angular_acceleration_radps2", layers.map(|l| l.angular_acceleration))
                .unwrap_or(2.0 * wheel_acceleration / track),
            eta,
            min_speed: pick("min_speed_mps", layers.map(|l| l.min_speed)).unwrap_or(0.01),
        }
    }

    /// Names under `limits.joints` must be joints, and not wheels.
    pub fn names(&mut self, urdf: &Urdf, wheels: &Wheels) {
        let layers = [("robot.yaml's", &self.spec.limits.joints), ("the mission's", &self.mission.joints)];
        for (layer, (whose, joints)) in layers.into_iter().enumerate() {
            for name in joints.keys() {
                let at = if layer == 0 { self.span(name) } else { self.mission_span(name) }.cloned();
                let found = urdf.robot.joints.iter().position(|j| j.name == *name);
                let Some(j) = found else {
                    let message = format!("{whose} limits.joints: no joint `{name}` in {}", urdf.source.name);
                    let known = urdf.robot.joints.iter().map(|j| j.name.as_str());
                    let hint = suggestion(name, known, "its joints are", "it has no joint");
                    self.faults
                        .push(Diagnostic::error("robot/unknown-joint", message).maybe_at(at.as_ref()).hint(hint));
                    continue;
                };
                if wheels.all().any(|w| w == j) {
                    let message = format!(
                        "{whose} limits.joints: `{name}` is a drive wheel, whose limits are under `limits.wheel`"
                    );
                    let fault = Diagnostic::error("robot/limits-of-wheel", message).maybe_at(at.as_ref());
                    self.faults.push(
                        fault.hint("write `limits: {wheel: {speed_mps: …}}` for it: limits of the rim, of both wheels"),
                    );
                }
            }
        }
    }

    fn span(&self, joint: &str) -> Option<&'_ Span> {
        self.spec.limit_joints.iter().find(|w| w.value == joint).and_then(|w| w.span.as_ref())
    }

    fn mission_span(&self, joint: &str) -> Option<&'_ Span> {
        self.mission.places.iter().find(|(name, _)| name == joint).map(|(_, at)| at)
    }

    /// Range and limits of one URDF joint as overridden: its own, mimics not folded in.
    fn own(&mut self, urdf: &Urdf, joint: usize) -> ([f64; 2], MotionLimits) {
        let name = &urdf.robot.joints[joint].name;
        let [lower, upper] = range(urdf, joint);
        let none = ActuatorLimitsSpec::default();
        let layers = [&self.spec.limits.joints, &self.mission.joints].map(|l| l.get(name).unwrap_or(&none));
        // Where both name the joint, the mission's word is the last.
        let at = self.mission_span(name).or(self.span(name)).cloned();
        let part = format!("joints.{name}");
        let tight_lower = self.pick(&part, "lower", layers.map(|l| l.lower), false, at.as_ref()).unwrap_or(lower);
        let tight_upper = self.pick(&part, "upper", layers.map(|l| l.upper), false, at.as_ref()).unwrap_or(upper);
        if tight_lower < lower - SLACK || tight_upper > upper + SLACK {
            let message = format!(
                "limits of joint `{name}` may only be tightened: {tight_lower} to {tight_upper} goes beyond the URDF's {lower} to {upper}"
            );
            let hint =
                "stay within the URDF's range, or change its <limit>; angles are radians, or degrees such as `90deg`";
            self.faults.push(Diagnostic::error("robot/limit-loosened", message).maybe_at(at.as_ref()).hint(hint));
        } else if tight_lower > tight_upper {
            let message = format!("joint `{name}`: lower limit {tight_lower} is above the upper one, {tight_upper}");
            let hint = "widen them; a joint that must not move is listed in robot.yaml's `joints.fixed`";
            self.faults.push(Diagnostic::error("robot/joint-limits", message).maybe_at(at.as_ref()).hint(hint));
        }
        let motion = self.motion(&part, ["speed", "acceleration", "jerk"], layers, at.as_ref());
        ([tight_lower.max(lower), tight_upper.min(upper)], motion)
    }

    /// The moving joints. A mimic's range, overridden limits and default speed are mapped back to its source.
    pub fn joints(&mut self, urdf: &Urdf, roles: &Roles) -> Vec<MovingJoint> {
        let joints = &urdf.robot.joints;
        let mut moving = Vec::with_capacity(roles.moving.len());
        for (index, source) in roles.moving.iter().enumerate() {
            let name = &joints[*source].name;
            let ([mut lower, mut upper], mut limits) = self.own(urdf, *source);
            let mut default_speed = velocity(&joints[*source]);
            if limits.speed.or(default_speed).is_none() {
                let message = format!("moving joint `{name}` has no velocity limit");
                let fault = Diagnostic::error("robot/no-velocity-limit", message).at(&urdf.joint_spans[*source]);
                self.faults.push(
                    fault.hint(format!(
                        "add velocity=\"…\" (rad/s, or m/s where it slides) to its <limit>, or limits.joints.{name}.speed to robot.yaml"
                    )),
                );
            }
            for (j, value) in roles.values.iter().enumerate() {
                let Value::Driven { joint, multiplier, offset } = *value else { continue };
                if joint != index || j == *source {
                    continue;
                }
                let ([low, high], own) = self.own(urdf, j);
                let ends = [(low - offset) / multiplier, (high - offset) / multiplier];
                lower = lower.max(ends[0].min(ends[1]));
                upper = upper.min(ends[0].max(ends[1]));
                let factor = multiplier.abs();
                let least =
                    |a: Option<f64>, b: Option<f64>| a.into_iter().chain(b.map(|v| v / factor)).reduce(f64::min);
                // The mimic's URDF speed bounds the default only: an override of the source's speed is meant for both.
                default_speed = least(default_speed, velocity(&joints[j]));
                limits.speed = limits.speed.map(|v| least(Some(v), own.speed).unwrap_or(v));
                default_speed = least(default_speed, own.speed);
                limits.acceleration = least(limits.acceleration, own.acceleration);
                limits.jerk = least(limits.jerk, own.jerk);
            }
            limits.speed = limits.speed.or(default_speed);
            if lower > upper && self.faults.is_empty() {
                let message = format!("no value of joint `{name}` keeps its own limits and those of its mimics");
                let hint =
                    "widen its <limit>, or those of the joints that mimic it, or correct their multiplier and offset";
                let fault = Diagnostic::error("robot/mimic-limits", message).at(&urdf.joint_spans[*source]);
                self.faults.push(fault.hint(hint));
            }
            let slides = |j: usize| joints[j].joint_type == JointType::Prismatic;
            let mut moved =
                (0..joints.len()).filter(|j| matches!(roles.values[*j], Value::Driven { joint, .. } if joint == index));
            if !(lower.is_finite() && upper.is_finite()) && moved.any(slides) {
                let message = format!("moving joint `{name}` slides, but has no position limits");
                let fault = Diagnostic::error("robot/no-position-limits", message).at(&urdf.joint_spans[*source]);
                self.faults.push(fault.hint("add lower=\"…\" upper=\"…\" to its <limit>"));
            }
            let prismatic = slides(*source);
            moving.push(MovingJoint { name: name.clone(), prismatic, lower, upper, limits });
        }
        moving
    }
}
