//! The tree of links and joints, and poses along it.

use nalgebra::{Isometry3, Translation3, Unit, UnitQuaternion, Vector3};
use urdf_rs::JointType;

use super::urdf::Urdf;
use crate::diag::{Diagnostic, Diagnostics};

/// Who hangs on whom, by index into the URDF's links and joints.
pub(super) struct Tree {
    /// The link that hangs on no joint.
    pub root: usize,
    /// Joints, every one after the joint that carries its parent link; siblings as written.
    pub order: Vec<usize>,
    /// Parent link of each joint.
    pub parent: Vec<usize>,
    /// Child link of each joint.
    pub child: Vec<usize>,
}

impl Tree {
    /// The tree of a checked URDF.
    ///
    /// # Errors
    /// A link with two parents, several roots, a cycle.
    pub fn new(urdf: &Urdf) -> Result<Self, Diagnostics> {
        let (links, joints) = (&urdf.robot.links, &urdf.robot.joints);
        let index: std::collections::BTreeMap<&str, usize> =
            links.iter().enumerate().map(|(i, link)| (link.name.as_str(), i)).collect();
        let of = |name: &str| *index.get(name).expect("urdf::read checked all names of links");
        let parent: Vec<usize> = joints.iter().map(|j| of(&j.parent.link)).collect();
        let child: Vec<usize> = joints.iter().map(|j| of(&j.child.link)).collect();

        let mut faults = Vec::new();
        let mut carrier: Vec<Option<usize>> = vec![None; links.len()];
        let mut below: Vec<Vec<usize>> = vec![Vec::new(); links.len()];
        for (j, joint) in joints.iter().enumerate() {
            below[parent[j]].push(j);
            if let Some(first) = carrier[child[j]].replace(j) {
                let message = format!(
                    "link `{}` is the child of two joints, `{}` and `{}`",
                    links[child[j]].name, joints[first].name, joint.name
                );
                let hint = "a link hangs on one joint: remove one of the two, or give one another child";
                faults.push(Diagnostic::error("robot/two-parents", message).at(&urdf.joint_spans[j]).hint(hint));
            }
        }
        if !faults.is_empty() {
            return Err(Diagnostics(faults));
        }
        let roots: Vec<usize> = (0..links.len()).filter(|l| carrier[*l].is_none()).collect();
        if roots.len() > 1 {
            let names: Vec<_> = roots.iter().map(|l| format!("`{}`", links[*l].name)).collect();
            let message = format!("{} links hang on no joint: {}", roots.len(), names.join(", "));
            let fault = Diagnostic::error("robot/several-roots", message).at(&urdf.link_spans[roots[1]]);
            return Err(fault.hint("a URDF is one tree: join them with fixed joints").into());
        }
        let mut order: Vec<usize> = Vec::with_capacity(joints.len());
        let mut links_done: Vec<usize> = roots.clone();
        let mut next = 0;
        while next < links_done.len() {
            for j in &below[links_done[next]] {
                order.push(*j);
                links_done.push(child[*j]);
            }
            next += 1;
        }
        if links_done.len() < links.len() {
            let lost: Vec<usize> = (0..links.len()).filter(|l| !links_done.contains(l)).collect();
            let names: Vec<_> = lost.iter().take(6).map(|l| format!("`{}`", links[*l].name)).collect();
            let message = format!("links hang on each other in a circle: {}", names.join(", "));
            let at = &urdf.joint_spans[carrier[lost[0]].unwrap_or(0)];
            let hint = "a URDF is one tree: remove one of the joints between them";
            return Err(Diagnostic::error("robot/cycle", message).at(at).hint(hint).into());
        }
        Ok(Self { root: roots[0], order, parent, child })
    }

    /// root <- link for every link, each joint at the given value.
    pub fn link_poses(&self, urdf: &Urdf, value: impl Fn(usize) -> f64) -> Vec<Isometry3<f64>> {
        let mut poses = vec![Isometry3::identity(); urdf.robot.links.len()];
        for j in &self.order {
            let joint = &urdf.robot.joints[*j];
            poses[self.child[*j]] = poses[self.parent[*j]] * pose(&joint.origin) * motion(joint, value(*j));
        }
        poses
    }
}

/// An `<origin>`: fixed-axis roll, pitch, yaw.
pub(super) fn pose(origin: &urdf_rs::Pose) -> Isometry3<f64> {
    let ([x, y, z], [roll, pitch, yaw]) = (origin.xyz.0, origin.rpy.0);
    Isometry3::from_parts(Translation3::new(x, y, z), UnitQuaternion::from_euler_angles(roll, pitch, yaw))
}

/// A joint's axis, in the joint frame.
pub(super) fn axis(joint: &urdf_rs::Joint) -> Unit<Vector3<f64>> {
    Unit::new_normalize(Vector3::from(joint.axis.xyz.0))
}

/// What a joint does to its child at a value.
fn motion(joint: &urdf_rs::Joint, value: f64) -> Isometry3<f64> {
    match joint.joint_type {
        JointType::Prismatic => along(&axis(joint), value),
        JointType::Revolute | JointType::Continuous => about(&axis(joint), value),
        _ => Isometry3::identity(),
    }
}

/// child <- parent of a held joint: its origin and motion together.
pub(super) fn held(joint: &urdf_rs::Joint, value: f64) -> Isometry3<f64> {
    pose(&joint.origin) * motion(joint, value)
}

/// A shift along an axis, m.
pub(super) fn along(axis: &Unit<Vector3<f64>>, value: f64) -> Isometry3<f64> {
    Isometry3::translation(axis.x * value, axis.y * value, axis.z * value)
}

/// A turn about an axis through the origin, rad.
pub(super) fn about(axis: &Unit<Vector3<f64>>, value: f64) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_axis_angle(axis, value))
}
