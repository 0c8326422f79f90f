//! Which joints drive: named in robot.yaml, or found.

use urdf_rs::JointType;

use super::drive::Axle;
use super::joints::named;
use super::spec::{RobotSpec, Written};
use super::tree::Tree;
use super::urdf::Urdf;
use crate::diag::{Diagnostic, Diagnostics};

/// Joints of the driving wheels.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Wheels {
    pub left: Vec<usize>,
    pub right: Vec<usize>,
}

impl Wheels {
    /// All of them, left ones first.
    pub fn all(&self) -> impl Iterator<Item = usize> {
        self.left.iter().chain(&self.right).copied()
    }

    /// As robot.yaml writes them: `{left: a, right: [b, c]}`.
    fn written(&self, urdf: &Urdf) -> String {
        let side = |wheels: &[usize]| {
            let names: Vec<&str> = wheels.iter().map(|j| urdf.robot.joints[*j].name.as_str()).collect();
            if let [one] = names[..] { one.to_string() } else { format!("[{}]", names.join(", ")) }
        };
        format!("{{left: {}, right: {}}}", side(&self.left), side(&self.right))
    }
}

/// The driving wheels, named in robot.yaml or found.
pub(super) fn wheels(spec: &RobotSpec, urdf: &Urdf, tree: &Tree) -> Result<Wheels, Diagnostics> {
    match (&spec.drive_left[..], &spec.drive_right[..]) {
        ([], []) => {
            let seen = Candidates::of(urdf, tree);
            seen.only_pair().ok_or_else(|| seen.not_found(urdf).into())
        }
        ([], [one, ..]) | ([one, ..], []) => {
            let (given, missing) = if spec.drive_left.is_empty() { ("right", "left") } else { ("left", "right") };
            let message = format!("drive.{given} is named, drive.{missing} is not");
            let fault = Diagnostic::error("robot/wheels-half-named", message).maybe_at(one.span.as_ref());
            Err(fault.hint("name both, or neither to have them found").into())
        }
        (left, right) => {
            let mut faults = Vec::new();
            let mut seen = Vec::new();
            let mut side = |names: &[Written<String>]| -> Vec<usize> {
                let mut found = Vec::new();
                for name in names {
                    let Some(j) = named(urdf, name, "drive wheel", &mut faults) else { continue };
                    let joint = &urdf.robot.joints[j];
                    if !matches!(joint.joint_type, JointType::Continuous | JointType::Revolute) {
                        let kind = format!("{:?}", joint.joint_type).to_lowercase();
                        let message = format!("drive wheel `{}` is a {kind} joint, which does not turn", joint.name);
                        let hint =
                            "name joints of type continuous (or revolute), or change the joint's type in the URDF";
                        let fault = Diagnostic::error("robot/wheel-type", message).maybe_at(name.span.as_ref());
                        faults.push(fault.hint(hint));
                    } else if seen.contains(&j) {
                        let message = format!("drive wheel `{}` is named twice", joint.name);
                        let fault = Diagnostic::error("robot/wheel-twice", message).maybe_at(name.span.as_ref());
                        faults.push(fault.hint("a wheel has one joint and one side: remove one of the two"));
                    } else {
                        seen.push(j);
                        found.push(j);
                    }
                }
                found
            };
            let wheels = Wheels { left: side(left), right: side(right) };
            if faults.is_empty() { Ok(wheels) } else { Err(Diagnostics(faults)) }
        }
    }
}

/// Joints that could be driving wheels: continuous, no mimic, and hanging on no other continuous joint, as castors do.
pub(super) struct Candidates {
    joints: Vec<usize>,
    axles: Vec<Axle>,
    /// Coaxial, horizontal ones: (left, right), indices into `joints`.
    pairs: Vec<(usize, usize)>,
}

impl Candidates {
    /// Looks for them, with all joints at 0.
    pub fn of(urdf: &Urdf, tree: &Tree) -> Self {
        let joints = &urdf.robot.joints;
        let turns = |j: usize| joints[j].joint_type == JointType::Continuous;
        let mut swivels = vec![false; urdf.robot.links.len()];
        for j in &tree.order {
            swivels[tree.child[*j]] = swivels[tree.parent[*j]] || turns(*j);
        }
        let own = |j: &usize| turns(*j) && joints[*j].mimic.is_none() && !swivels[tree.parent[*j]];
        let found: Vec<usize> = (0..joints.len()).filter(own).collect();
        let poses = tree.link_poses(urdf, |_| 0.0);
        let axles: Vec<Axle> = found.iter().map(|j| Axle::of(urdf, tree, &poses, *j)).collect();
        let mut pairs = Vec::new();
        for (l, left) in axles.iter().enumerate() {
            for (r, right) in axles.iter().enumerate() {
                let apart = left.origin - right.origin;
                if apart.y > 1e-6 && left.horizontal() && left.parallel(&right.axis) && left.parallel(&apart) {
                    pairs.push((l, r));
                }
            }
        }
        Self { joints: found, axles, pairs }
    }

    /// The wheels, where there is exactly one coaxial pair.
    pub fn only_pair(&self) -> Option<Wheels> {
        let [(l, r)] = self.pairs[..] else { return None };
        Some(Wheels { left: vec![self.joints[l]], right: vec![self.joints[r]] })
    }

    /// All wheels of several axles, where every horizontal joint is in exactly one pair and all axles are parallel: a robot that steers
    /// by skidding, if all of them drive.
    pub fn every_axle(&self) -> Option<Wheels> {
        let level = (0..self.axles.len()).filter(|i| self.axles[*i].horizontal());
        let in_one_pair = |i: usize| self.pairs.iter().filter(|(l, r)| *l == i || *r == i).count() == 1;
        let first = &self.axles[self.pairs.first()?.0];
        let all = level.clone().all(in_one_pair) && level.clone().all(|i| first.parallel(&self.axles[i].axis));
        (all && self.pairs.len() > 1).then(|| Wheels {
            left: self.pairs.iter().map(|(l, _)| self.joints[*l]).collect(),
            right: self.pairs.iter().map(|(_, r)| self.joints[*r]).collect(),
        })
    }

    /// What was seen, and what to write.
    pub fn not_found(&self, urdf: &Urdf) -> Diagnostic {
        let name = |j: usize| urdf.robot.joints[j].name.as_str();
        let list: Vec<String> = self
            .joints
            .iter()
            .zip(&self.axles)
            .map(|(j, axle)| {
                let (o, level) = (axle.origin, if axle.horizontal() { "" } else { ", axis not horizontal" });
                format!("`{}` at ({:.3}, {:.3}, {:.3}){level}", name(*j), o.x, o.y, o.z)
            })
            .collect();
        let list = if list.is_empty() { "none".into() } else { list.join("; ") };
        let message = format!(
            "drive wheels not found: {} coaxial pairs, not one; continuous joints that could be wheels: {list}",
            self.pairs.len()
        );
        let at = self.joints.first().map_or_else(|| urdf.whole(), |j| urdf.joint_spans[*j].clone());
        let hint = match (self.every_axle(), &self.pairs[..]) {
            (Some(all), _) => format!(
                "if all of these wheels drive (skid steer), add to robot.yaml `drive: {}`; if one axle does, name its two; \
                 `trajc robot init` writes a robot.yaml",
                all.written(urdf)
            ),
            (None, [(l, r), ..]) => {
                let one = Wheels { left: vec![self.joints[*l]], right: vec![self.joints[*r]] };
                format!("name the two that drive in robot.yaml, such as `drive: {}`", one.written(urdf))
            }
            (None, []) => "name drive.left and drive.right in robot.yaml: joints of type continuous or revolute".into(),
        };
        Diagnostic::error("robot/wheels-not-found", message).at(&at).hint(hint)
    }
}
