//! What each joint of the URDF does: moved by the planner, held, or following another by `<mimic>`.

use std::collections::BTreeMap;

use urdf_rs::JointType;

use super::spec::{RobotSpec, Written};
use super::urdf::Urdf;
use super::wheels::Wheels;
use crate::diag::{Diagnostic, Diagnostics, suggestion};

/// Value of a joint of the URDF.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Value {
    /// Constant.
    Held(f64),
    /// `multiplier * q[joint] + offset`; the multiplier is not zero.
    Driven {
        /// Index among the moving joints.
        joint: usize,
        multiplier: f64,
        offset: f64,
    },
}

/// Roles of all joints.
pub(super) struct Roles {
    /// URDF indices of the moving joints.
    pub moving: Vec<usize>,
    /// By URDF index.
    pub values: Vec<Value>,
}

impl Roles {
    /// Value of a joint with all moving joints at 0.
    pub fn at_zero(&self, joint: usize) -> f64 {
        match self.values[joint] {
            Value::Held(value) => value,
            Value::Driven { offset, .. } => offset,
        }
    }
}

/// Index of a joint that robot.yaml names; unknown ones are faults.
pub(super) fn named(urdf: &Urdf, name: &Written<String>, what: &str, faults: &mut Vec<Diagnostic>) -> Option<usize> {
    let found = urdf.robot.joints.iter().position(|j| j.name == name.value);
    if found.is_none() {
        let message = format!("{what} `{}`: no such joint in {}", name.value, urdf.source.name);
        let known = urdf.robot.joints.iter().map(|j| j.name.as_str());
        let hint = suggestion(&name.value, known, "its joints are", "it has no joint");
        faults.push(Diagnostic::error("robot/unknown-joint", message).maybe_at(name.span.as_ref()).hint(hint));
    }
    found
}

/// A joint's URDF speed limit; zero and infinity mean none.
pub(super) fn velocity(joint: &urdf_rs::Joint) -> Option<f64> {
    Some(joint.limit.velocity).filter(|v| *v > 0.0 && v.is_finite())
}

/// Positions that the URDF allows; infinite where it says nothing.
pub(super) fn range(urdf: &Urdf, joint: usize) -> [f64; 2] {
    match urdf.robot.joints[joint].joint_type {
        JointType::Revolute | JointType::Prismatic if urdf.has_limit[joint] => {
            let limit = &urdf.robot.joints[joint].limit;
            [limit.lower, limit.upper]
        }
        _ => [f64::NEG_INFINITY, f64::INFINITY],
    }
}

/// Decides what every joint does.
///
/// # Errors
/// Names that do not exist; moving or fixed joints that are wheels, mimics, rigid or named twice; held values beyond the joint's
/// limits; mimics of each other.
pub(super) fn roles(spec: &RobotSpec, urdf: &Urdf, wheels: &Wheels) -> Result<Roles, Diagnostics> {
    let mut faults = Vec::new();
    let joints = &urdf.robot.joints;
    let is_wheel = |j: usize| wheels.all().any(|w| w == j);
    let free = |j: usize| joints[j].joint_type != JointType::Fixed && joints[j].mimic.is_none() && !is_wheel(j);
    let why_not = |j: usize| {
        if is_wheel(j) {
            "is a drive wheel".into()
        } else if let Some(mimic) = &joints[j].mimic {
            format!("is a mimic of `{}`, and moves with it", mimic.joint)
        } else {
            "is of type fixed".into()
        }
    };

    // Names of joints that may move or be held.
    let able: Vec<&str> = (0..joints.len()).filter(|j| free(*j)).map(|j| joints[j].name.as_str()).collect();
    let others = |verb: &str| match &able[..] {
        [] => format!("this robot has no joint that can {verb}: remove it"),
        names => {
            let names: Vec<String> = names.iter().take(12).map(|name| format!("`{name}`")).collect();
            format!("remove it; joints that can {verb} are {}", names.join(", "))
        }
    };
    let mut held: Vec<Option<f64>> = vec![None; joints.len()];
    for (name, value) in &spec.fixed {
        let Some(j) = named(urdf, name, "joints.fixed", &mut faults) else { continue };
        let [lower, upper] = range(urdf, j);
        let fault = if !free(j) {
            let message = format!("joints.fixed: `{}` {}", name.value, why_not(j));
            Some(("robot/fixed-joint", message, others("be held")))
        } else if held[j].is_some() {
            let message = format!("joints.fixed: `{}` is named twice", name.value);
            Some(("robot/fixed-joint", message, "keep one of the two".to_owned()))
        } else if !value.is_finite() || *value < lower - 1e-9 || *value > upper + 1e-9 {
            let message = format!("joints.fixed: `{}` at {value} is outside its limits {lower} to {upper}", name.value);
            let hint = "write a value within them: radians, metres, or degrees such as `90deg`";
            Some(("robot/fixed-outside", message, hint.to_owned()))
        } else {
            held[j] = Some(*value);
            None
        };
        let told = |(code, message, hint): (&'static str, String, String)| {
            Diagnostic::error(code, message).maybe_at(name.span.as_ref()).hint(hint)
        };
        faults.extend(fault.map(told));
    }

    let mut moving = Vec::new();
    if let Some(names) = &spec.moving {
        for name in names {
            let Some(j) = named(urdf, name, "joints.moving", &mut faults) else { continue };
            let (why, hint) = if !free(j) {
                (why_not(j), others("move"))
            } else if spec.fixed.iter().any(|(fixed, _)| fixed.value == name.value) {
                ("is in joints.fixed too".into(), "a joint either moves or is fixed: remove one of the two".to_owned())
            } else if moving.contains(&j) {
                ("is named twice".into(), "keep one of the two".to_owned())
            } else {
                moving.push(j);
                continue;
            };
            let message = format!("joints.moving: `{}` {why}", name.value);
            faults.push(Diagnostic::error("robot/moving-joint", message).maybe_at(name.span.as_ref()).hint(hint));
        }
    } else {
        moving =
            (0..joints.len()).filter(|j| free(*j) && held[*j].is_none() && velocity(&joints[*j]).is_some()).collect();
    }

    let index: BTreeMap<&str, usize> = joints.iter().enumerate().map(|(j, joint)| (joint.name.as_str(), j)).collect();
    let followed = |j: usize| {
        joints[j].mimic.as_ref().filter(|_| !is_wheel(j)).map(|mimic| Followed {
            joint: *index.get(mimic.joint.as_str()).expect("urdf::read checked all names of joints"),
            multiplier: mimic.multiplier.unwrap_or(1.0),
            offset: mimic.offset.unwrap_or(0.0),
        })
    };
    let sources: Vec<Option<Followed>> = (0..joints.len()).map(followed).collect();
    let mut values = Vec::with_capacity(joints.len());
    for (j, joint) in joints.iter().enumerate() {
        let (source, multiplier, offset) = match resolve(urdf, &sources, j) {
            Ok(resolved) => resolved,
            Err(fault) => {
                faults.push(*fault);
                continue;
            }
        };
        values.push(match moving.iter().position(|m| *m == source) {
            Some(index) if multiplier != 0.0 && joint.joint_type != JointType::Fixed => {
                Value::Driven { joint: index, multiplier, offset }
            }
            Some(_) => Value::Held(offset),
            None => {
                let [lower, upper] = range(urdf, source);
                let rest = if is_wheel(source) { 0.0 } else { 0f64.max(lower).min(upper) };
                Value::Held(multiplier * held[source].unwrap_or(rest) + offset)
            }
        });
    }
    if faults.is_empty() { Ok(Roles { moving, values }) } else { Err(Diagnostics(faults)) }
}

/// A `<mimic>`: this much of another joint.
struct Followed {
    joint: usize,
    multiplier: f64,
    offset: f64,
}

/// Follows mimics to their source: (source, multiplier, offset).
fn resolve(urdf: &Urdf, sources: &[Option<Followed>], joint: usize) -> Result<(usize, f64, f64), Box<Diagnostic>> {
    let (mut source, mut multiplier, mut offset) = (joint, 1.0, 0.0);
    let name = &urdf.robot.joints[joint].name;
    let mut steps = 0;
    while let Some(followed) = &sources[source] {
        offset += multiplier * followed.offset;
        multiplier *= followed.multiplier;
        source = followed.joint;
        steps += 1;
        let message = if steps > sources.len() {
            format!("joint `{name}` follows joints that mimic each other in a circle")
        } else if !(multiplier.is_finite() && offset.is_finite()) {
            format!("the factors of the joints that `{name}` mimics overflow")
        } else {
            continue;
        };
        let hint = "one of them must move by itself: remove its <mimic>, or correct its multiplier";
        return Err(Box::new(Diagnostic::error("robot/mimic-cycle", message).at(&urdf.joint_spans[joint]).hint(hint)));
    }
    Ok((source, multiplier, offset))
}
