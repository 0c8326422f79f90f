//! `limits:` of a mission and of a robot.yaml: one table of keys for both.

use std::sync::Arc;

use super::{ActuatorLimitsSpec, BaseLimitsSpec, LimitsSpec};
use crate::diag::shape::{Bounds, Field, Shape};
use crate::diag::yaml::Node;
use crate::diag::{Diagnostic, Source, Span};

/// The keys of `limits:`.
pub(crate) static FIELDS: [Field; 3] = [
    Field::optional("wheel", Shape::Table(&WHEEL), "{speed_mps: 0.5}", "limits of each driving wheel's rim"),
    Field::optional(
        "joints",
        Shape::Named(&Shape::Table(&JOINT)),
        "{blade: {speed: 1.0}}",
        "limits by joint name, in rad or m by the joint's type",
    ),
    Field::optional("base", Shape::Table(&BASE), "{eta: 0.1}", "limits of the base; they shape the plan"),
];

static WHEEL: [Field; 3] = [
    Field::optional(
        "speed_mps",
        Shape::Number(Bounds::positive("m/s")),
        "0.5",
        "greatest speed of the rim, m/s; default: the URDF joint's velocity times the wheel radius",
    ),
    Field::optional(
        "acceleration_mps2",
        Shape::Number(Bounds::positive("m/s^2")),
        "0.5",
        "greatest acceleration of the rim, m/s^2; not checked where not given",
    ),
    Field::optional(
        "jerk_mps3",
        Shape::Number(Bounds::positive("m/s^3")),
        "2.0",
        "greatest jerk of the rim, m/s^3; not checked where not given",
    ),
];

static JOINT: [Field; 5] = [
    Field::optional(
        "lower",
        Shape::Angle(Bounds::any("rad or m")),
        "0deg",
        "least position, rad, m or degrees; may only tighten the URDF's",
    ),
    Field::optional(
        "upper",
        Shape::Angle(Bounds::any("rad or m")),
        "180deg",
        "greatest position, rad, m or degrees; may only tighten the URDF's",
    ),
    Field::optional(
        "speed",
        Shape::Number(Bounds::positive("rad/s or m/s")),
        "1.0",
        "greatest speed, rad/s or m/s; default: the URDF joint's velocity",
    ),
    Field::optional(
        "acceleration",
        Shape::Number(Bounds::positive("rad/s^2 or m/s^2")),
        "2.0",
        "greatest acceleration, rad/s^2 or m/s^2; not checked where not given",
    ),
    Field::optional(
        "jerk",
        Shape::Number(Bounds::positive("rad/s^3 or m/s^3")),
        "10.0",
        "greatest jerk, rad/s^3 or m/s^3; not checked where not given",
    ),
];

static BASE: [Field; 6] = [
    Field::optional(
        "speed_mps",
        Shape::Number(Bounds::positive("m/s")),
        "0.5",
        "greatest driving speed, m/s; default: the wheel's",
    ),
    Field::optional(
        "acceleration_mps2",
        Shape::Number(Bounds::positive("m/s^2")),
        "0.5",
        "greatest driving acceleration, m/s^2; default: the wheel's",
    ),
    Field::optional(
        "angular_speed_radps",
        Shape::Number(Bounds::positive("rad/s")),
        "2.0",
        "greatest turn rate, rad/s; default 2 eta speed / track width",
    ),
    Field::optional(
        "angular_acceleration_radps2",
        Shape::Number(Bounds::positive("rad/s^2")),
        "1.5",
        "greatest angular acceleration, rad/s^2; default 2 wheel acceleration / track width",
    ),
    Field::optional(
        "eta",
        Shape::Number(Bounds { least: 0.0, most: 1.0, open: true, unit: "" }),
        "0.1",
        "share of the wheels' speed that turning may use ([SCR] Eq. 14), 0 to 1; default 1",
    ),
    Field::optional(
        "min_speed_mps",
        Shape::Number(Bounds::positive("m/s")),
        "0.01",
        "least speed of the optimised path, m/s ([SCR] section V-C); default 0.01",
    ),
];

/// `limits:`, as far as it is well formed.
pub(crate) fn read(source: &Arc<Source>, limits: Option<&Node>) -> LimitsSpec {
    let Some(limits) = limits else { return LimitsSpec::default() };
    let table = |node: &Node| ActuatorLimitsSpec {
        lower: node.get("lower").and_then(Node::angle),
        upper: node.get("upper").and_then(Node::angle),
        speed: node.get("speed").and_then(Node::number),
        acceleration: node.get("acceleration").and_then(Node::number),
        jerk: node.get("jerk").and_then(Node::number),
    };
    let number = |part: &str, key: &str| limits.get(part)?.get(key)?.number();
    LimitsSpec {
        wheel: ActuatorLimitsSpec {
            lower: None,
            upper: None,
            speed: number("wheel", "speed_mps"),
            acceleration: number("wheel", "acceleration_mps2"),
            jerk: number("wheel", "jerk_mps3"),
        },
        joints: limits
            .get("joints")
            .map(|joints| joints.entries().iter().map(|e| (e.key.clone(), table(&e.value))).collect())
            .unwrap_or_default(),
        places: joint_names(source, Some(limits)),
        base: BaseLimitsSpec {
            speed: number("base", "speed_mps"),
            acceleration: number("base", "acceleration_mps2"),
            angular_speed: number("base", "angular_speed_radps"),
            angular_acceleration: number("base", "angular_acceleration_radps2"),
            eta: number("base", "eta"),
            min_speed: number("base", "min_speed_mps"),
        },
    }
}

/// Faults between keys: a joint whose `lower` is not below its `upper`.
pub(crate) fn check(source: &Arc<Source>, limits: Option<&Node>) -> Vec<Diagnostic> {
    let joints = limits.and_then(|l| l.get("joints")).map_or(&[][..], Node::entries);
    let crossed = joints.iter().filter_map(|joint| {
        let (lower, upper) = (joint.value.get("lower")?, joint.value.get("upper")?);
        let (low, high) = (lower.angle()?, upper.angle()?);
        (low >= high).then(|| {
            let written = |node: &Node| source.text[node.range.clone()].trim().to_string();
            let (low, high) = (written(lower), written(upper));
            let message = format!("`limits.joints.{}`: lower ({low}) is not below upper ({high})", joint.key);
            Diagnostic::error("yaml/limits-crossed", message)
                .at(&Span::new(source, lower.range.clone()))
                .hint("swap or widen them; a joint that must not move is listed in robot.yaml's `joints.fixed`")
        })
    });
    crossed.collect()
}

/// The joints named in `limits.joints`, and where.
pub(crate) fn joint_names(source: &Arc<Source>, limits: Option<&Node>) -> Vec<(String, Span)> {
    let joints = limits.and_then(|l| l.get("joints")).map_or(&[][..], Node::entries);
    joints.iter().map(|e| (e.key.clone(), Span::new(source, e.key_range.clone()))).collect()
}
