//! Links to rigid bodies: fixed and held joints are folded into transforms, driven ones begin a new body.

use std::path::PathBuf;

use nalgebra::Isometry3;
use urdf_rs::JointType;

use super::joints::{Roles, Value};
use super::spec::RobotSpec;
use super::tree::{self, Tree};
use super::urdf::Urdf;
use super::{Body, BodyMotion, Files, Shape, shapes};
use crate::diag::{Diagnostic, suggestion};

/// The bodies, and for every link its body and its pose in it.
pub(super) struct Collapsed {
    pub bodies: Vec<Body>,
    /// (body, body <- link) by link.
    pub links: Vec<(usize, Isometry3<f64>)>,
}

/// Collapses the tree. Wheels are held at angle 0, so their links belong to the body that carries them.
pub(super) fn collapse(urdf: &Urdf, tree: &Tree, roles: &Roles, base_from_root: Isometry3<f64>) -> Collapsed {
    let names = &urdf.robot.links;
    let mut bodies =
        vec![Body { link: names[tree.root].name.clone(), parent: 0, origin: base_from_root, motion: None }];
    let mut links = vec![(0, Isometry3::identity()); names.len()];
    for j in &tree.order {
        let joint = &urdf.robot.joints[*j];
        let (body, pose) = links[tree.parent[*j]];
        links[tree.child[*j]] = match roles.values[*j] {
            Value::Held(value) => (body, pose * tree::held(joint, value)),
            Value::Driven { joint: source, multiplier, offset } => {
                bodies.push(Body {
                    link: names[tree.child[*j]].name.clone(),
                    parent: body,
                    origin: pose * tree::pose(&joint.origin),
                    motion: Some(BodyMotion {
                        joint: source,
                        multiplier,
                        offset,
                        axis: tree::axis(joint),
                        prismatic: joint.joint_type == JointType::Prismatic,
                    }),
                });
                (bodies.len() - 1, Isometry3::identity())
            }
        };
    }
    Collapsed { bodies, links }
}

/// Collision shapes of all links but the ignored ones, in the order of the URDF.
pub(super) fn collision_shapes(
    spec: &RobotSpec,
    urdf: &Urdf,
    collapsed: &Collapsed,
    files: &mut dyn Files,
    faults: &mut Vec<Diagnostic>,
) -> Vec<Shape> {
    let mut out = Vec::new();
    let levels = spec.urdf.as_ref().map_or(0, |urdf| shapes::levels(&urdf.value));
    for (l, link) in urdf.robot.links.iter().enumerate() {
        if spec.ignore_links.iter().any(|name| name.value == link.name) {
            continue;
        }
        let (body, body_from_link) = collapsed.links[l];
        for (collision, at) in link.collision.iter().zip(&urdf.collision_spans[l]) {
            match shapes::convex(&collision.geometry, (&urdf.source.name, levels), files, at) {
                Ok((centre, convex)) => {
                    let pose = body_from_link * tree::pose(&collision.origin) * centre;
                    if !shapes::finite(&pose, &convex) {
                        let message = format!("collision shape of link `{}` is not of finite size", link.name);
                        let hint = "look at the numbers of its <geometry> and <origin>: metres and radians";
                        faults.push(Diagnostic::error("robot/geometry", message).at(at).hint(hint));
                    }
                    out.push(Shape { link: link.name.clone(), body, pose, convex });
                }
                Err(mut fault) => {
                    fault.message = format!("link `{}`: {}", link.name, fault.message);
                    faults.push(*fault);
                }
            }
        }
    }
    if out.is_empty() && faults.is_empty() {
        let fault = Diagnostic::error("robot/no-shapes", "the robot has no collision shape: nothing to keep clear");
        faults.push(fault.at(&urdf.whole()).hint(
            "add to a <link>, for example: <collision><geometry><box size=\"0.4 0.4 0.3\"/></geometry></collision>",
        ));
    }
    out
}

/// Links that robot.yaml's `collision` names must exist.
pub(super) fn check_links(spec: &RobotSpec, urdf: &Urdf, faults: &mut Vec<Diagnostic>) {
    let pairs = spec.ignore_pairs.iter().flatten().flatten().map(|name| ("ignore_pairs", name));
    for (key, name) in spec.ignore_links.iter().map(|name| ("ignore_links", name)).chain(pairs) {
        let known = urdf.robot.links.iter().map(|l| l.name.as_str());
        if known.clone().any(|link| link == name.value) {
            continue;
        }
        let message = format!("collision.{key} `{}`: no such link in {}", name.value, urdf.source.name);
        let hint = suggestion(&name.value, known, "its links are", "it has no link");
        faults.push(Diagnostic::error("robot/unknown-link", message).maybe_at(name.span.as_ref()).hint(hint));
    }
}

/// No files at all: for robots without meshes.
#[derive(Debug, Clone, Copy, Default)]
pub struct NoFiles;

impl Files for NoFiles {
    fn read(&mut self, path: &std::path::Path) -> std::io::Result<Vec<u8>> {
        let path = PathBuf::from(path);
        Err(std::io::Error::new(std::io::ErrorKind::NotFound, path.display().to_string()))
    }
}
