//! Stage 2: the robot. URDF and robot.yaml text in, [`RobotModel`] out.

mod bodies;
mod bound;
pub mod convex;
mod describe;
mod drive;
mod findings;
pub mod hull;
mod init;
mod joints;
mod limits;
pub mod mesh;
mod pairs;
mod radii;
mod reach;
mod shapes;
pub mod spec;
#[cfg(test)]
mod tests;
mod tree;
mod urdf;
mod wheels;

use std::path::Path;

use nalgebra::{Isometry3, Unit, Vector3};

use crate::diag::Diagnostics;
use crate::geom::Pose2;
use crate::math::real;
use crate::mission::{LimitsSpec, Tolerance, ToleranceSpec};
pub use bodies::NoFiles;
pub use convex::Convex;
pub use findings::Finding;
pub use init::{InitInputs, init};
pub use pairs::{IgnoreReason, IgnoredPair};
pub use radii::{LARGEST_DIFFERENCE, WheelRadii};
pub use reach::ShapeReach;

/// Where a stage gets files it must name itself (meshes). `cli` reads the disk, tests and MCAP attachments memory.
pub trait Files {
    /// The bytes of a file; `path` is relative to the folder of the file that names it, already joined.
    ///
    /// # Errors
    /// The I/O error.
    fn read(&mut self, path: &Path) -> std::io::Result<Vec<u8>>;

    /// The name of a file beside one that is not there, if it may have been meant.
    fn nearest(&self, path: &Path) -> Option<String> {
        let _ = path;
        None
    }

    /// Whether a file that is not under the robot's folder may be read.
    fn may_leave(&self, path: &Path) -> bool {
        let _ = path;
        false
    }
}

/// The robot in its base frame: origin on the floor below the driving wheels' centre, x forward, y left, z up. SI, radians.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotModel {
    /// The robot's name.
    pub name: String,
    /// Of the driving wheels.
    pub wheel_radii: WheelRadii,
    /// Distance between the driving wheels, m.
    pub track_width: f64,
    /// The URDF's root link, and its pose in the base frame.
    pub root_link: String,
    /// base <- root.
    pub base_from_root: Isometry3<f64>,
    /// The moving joints, in the order of `robot.yaml`'s `moving`, else of the URDF.
    pub joints: Vec<MovingJoint>,
    /// Rigid bodies. Body 0 is the base; a body's parent comes before it.
    pub bodies: Vec<Body>,
    /// Convex collision shapes.
    pub shapes: Vec<Shape>,
    /// Every link's frame, in the order of the URDF.
    pub links: Vec<LinkFrame>,
    /// Of each driving wheel's rim (m/s, m/s^2, m/s^3).
    pub wheel: MotionLimits,
    /// Of the base; shapes the plan.
    pub base: BaseLimits,
    /// Pairs of links that move against each other and are not checked against each other; all others are.
    pub ignore_pairs: Vec<IgnoredPair>,
    /// How far the real robot may be off this model; `None`: nobody said.
    pub tolerance: Option<Tolerance>,
}

/// A joint that the planner moves.
#[derive(Debug, Clone, PartialEq)]
pub struct MovingJoint {
    /// URDF name.
    pub name: String,
    /// Metres instead of radians.
    pub prismatic: bool,
    /// Least position; negative infinity for `continuous`. Mimics' limits are folded in.
    pub lower: f64,
    /// Greatest position.
    pub upper: f64,
    /// Speed, acceleration, jerk.
    pub limits: MotionLimits,
}

/// Limits of one actuator as given; `None`: not given anywhere, so not checked.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionLimits {
    /// Per second.
    pub speed: Option<f64>,
    /// Per second squared.
    pub acceleration: Option<f64>,
    /// Per second cubed.
    pub jerk: Option<f64>,
}

impl MovingJoint {
    /// Least and greatest position; of an endless joint those of one turn about `near`.
    pub fn range_about(&self, near: f64) -> [f64; 2] {
        let turn = std::f64::consts::PI;
        [
            if self.lower.is_finite() { self.lower } else { near - turn },
            if self.upper.is_finite() { self.upper } else { near + turn },
        ]
    }
}

impl MotionLimits {
    /// Limits to plan with: a missing acceleration is speed/1 s, a missing jerk acceleration/0.25 s; a missing speed 1.
    pub fn planning(&self) -> [f64; 3] {
        let speed = self.speed.unwrap_or(1.0);
        let acceleration = self.acceleration.unwrap_or(speed);
        [speed, acceleration, self.jerk.unwrap_or(acceleration / 0.25)]
    }
}

/// Limits of the base; all set (defaults of robot.yaml applied).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BaseLimits {
    /// m/s.
    pub speed: f64,
    /// m/s^2.
    pub acceleration: f64,
    /// rad/s.
    pub angular_speed: f64,
    /// rad/s^2.
    pub angular_acceleration: f64,
    /// \[SCR\] Eq. 14: turning speed falls with driving speed, `omega <= 2 eta (v_max - v) / D`.
    pub eta: f64,
    /// m/s; \[SCR\] section V-C.
    pub min_speed: f64,
}

/// A rigid body: links joined by fixed (or held) joints. Its frame is the child frame of the joint that moves it.
#[derive(Debug, Clone, PartialEq)]
pub struct Body {
    /// Its first link.
    pub link: String,
    /// Index of the parent body; 0 for the base itself.
    pub parent: usize,
    /// parent body <- joint frame at joint value 0.
    pub origin: Isometry3<f64>,
    /// How it moves against its parent; `None` only for body 0.
    pub motion: Option<BodyMotion>,
}

/// Value of the body's own joint = `multiplier * q[joint] + offset` (mimics included).
#[derive(Debug, Clone, PartialEq)]
pub struct BodyMotion {
    /// Index into [`RobotModel::joints`].
    pub joint: usize,
    /// Mimic factor.
    pub multiplier: f64,
    /// Mimic offset.
    pub offset: f64,
    /// In the joint frame.
    pub axis: Unit<Vector3<f64>>,
    /// Slides along the axis instead of turning about it.
    pub prismatic: bool,
}

impl Body {
    /// parent body <- this body at joint values `q`; for body 0: base <- root.
    pub fn pose_in_parent(&self, q: &[f64]) -> Isometry3<f64> {
        let Some(motion) = &self.motion else {
            return self.origin;
        };
        let value = motion.multiplier * q[motion.joint] + motion.offset;
        let moved = if motion.prismatic { tree::along(&motion.axis, value) } else { tree::about(&motion.axis, value) };
        self.origin * moved
    }
}

/// A convex collision shape fixed to a body.
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    /// The URDF link it belongs to.
    pub link: String,
    /// Index into [`RobotModel::bodies`].
    pub body: usize,
    /// body <- shape.
    pub pose: Isometry3<f64>,
    /// About its own centre.
    pub convex: Convex,
}

/// A link's frame, fixed to a body.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkFrame {
    /// URDF name.
    pub name: String,
    /// Index into [`RobotModel::bodies`].
    pub body: usize,
    /// body <- link.
    pub pose: Isometry3<f64>,
}

/// Frames that are the base, in ROS, where the URDF's root link is in no transform.
pub const BASE_FRAMES: [&str; 2] = ["base_footprint", "base_link"];

impl RobotModel {
    /// The base in the plane, of a frame's pose: the URDF's root link is placed on the base, a frame of any other name is taken for the base.
    pub fn base_of(&self, frame: &str, pose: Isometry3<f64>) -> Pose2 {
        let pose = if frame == self.root_link { pose * self.base_from_root.inverse() } else { pose };
        let forward = pose.rotation * Vector3::x();
        Pose2::new(pose.translation.x, pose.translation.y, real::atan2(forward.y, forward.x))
    }

    /// Whether any joint moves a body.
    pub fn is_moved(&self, mut body: usize) -> bool {
        while self.bodies[body].motion.is_none() {
            if body == 0 {
                return false;
            }
            body = self.bodies[body].parent;
        }
        true
    }

    /// Poses of all bodies in the base frame at joint values `q` (one per moving joint); `out` is cleared first.
    pub fn body_poses(&self, q: &[f64], out: &mut Vec<Isometry3<f64>>) {
        out.clear();
        for body in &self.bodies {
            let pose = body.pose_in_parent(q);
            out.push(if body.motion.is_none() { pose } else { out[body.parent] * pose });
        }
    }

    /// Pose of a link (its index) in the base frame at joint values `q`.
    pub fn link_pose(&self, link: usize, q: &[f64]) -> Isometry3<f64> {
        let link = &self.links[link];
        let (mut pose, mut at) = (link.pose, link.body);
        loop {
            let body = &self.bodies[at];
            pose = body.pose_in_parent(q) * pose;
            if body.motion.is_none() {
                return pose;
            }
            at = body.parent;
        }
    }

    /// No posture takes a link's frame farther from the base's origin than this, m.
    pub fn link_reach(&self, link: usize) -> f64 {
        let link = &self.links[link];
        let (mut reach, mut at) = (link.pose.translation.vector.norm(), link.body);
        loop {
            let body = &self.bodies[at];
            reach += body.origin.translation.vector.norm();
            let Some(motion) = &body.motion else { return reach };
            if motion.prismatic {
                let joint = &self.joints[motion.joint];
                let slid = [joint.lower, joint.upper].map(|q| (motion.multiplier * q + motion.offset).abs());
                reach += slid[0].max(slid[1]);
            }
            at = body.parent;
        }
    }

    /// Poses of all shapes in the base frame at joint values `q`.
    pub fn shape_poses(&self, q: &[f64]) -> Vec<Isometry3<f64>> {
        let mut bodies = Vec::with_capacity(self.bodies.len());
        self.body_poses(q, &mut bodies);
        self.shapes.iter().map(|s| bodies[s.body] * s.pose).collect()
    }
}

/// What [`parse`] reads.
pub struct RobotInputs<'a> {
    /// robot.yaml, already read by [`spec::parse`]; `RobotSpec::default()` where the mission names a bare URDF.
    pub spec: &'a spec::RobotSpec,
    /// Path and text of the URDF.
    pub urdf: (&'a str, &'a str),
    /// Reader for meshes.
    pub files: &'a mut dyn Files,
    /// The mission's overrides.
    pub overrides: &'a LimitsSpec,
}

/// Reads a robot.
///
/// # Errors
/// All faults found, with file and line. Faults of the text hide those of the tree, and these those of wheels, joints and limits.
pub fn parse(inputs: RobotInputs<'_>) -> Result<RobotModel, Diagnostics> {
    assemble(inputs).map(|made| made.robot)
}

/// Reads a robot, and finds what is easily missed about its URDF: wheels on springs, castors, telescopes, a root link off the floor.
///
/// # Errors
/// As [`parse`].
pub fn parse_with_findings(inputs: RobotInputs<'_>) -> Result<(RobotModel, Vec<Finding>), Diagnostics> {
    let made = assemble(inputs)?;
    let findings = made.facts().findings();
    Ok((made.robot, findings))
}

/// The joint of a driving wheel.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveJoint {
    /// Its name in the URDF.
    pub name: String,
    /// 1 where its angle grows as the robot drives forward, -1 where it shrinks: its axis points to the right.
    pub forward: f64,
}

/// Reads a robot, and names the joints of its left and its right driving wheels.
///
/// # Errors
/// As [`parse`].
pub fn parse_with_drive(inputs: RobotInputs<'_>) -> Result<(RobotModel, [Vec<DriveJoint>; 2]), Diagnostics> {
    let Assembled { urdf, tree, wheels, roles, robot, .. } = assemble(inputs)?;
    let poses = tree.link_poses(&urdf, |joint| roles.at_zero(joint));
    let side = |joints: &[usize]| {
        let of = |joint: &usize| {
            let axis = drive::Axle::of(&urdf, &tree, &poses, *joint).axis;
            let forward = (robot.base_from_root.rotation * axis).y.signum();
            DriveJoint { name: urdf.robot.joints[*joint].name.clone(), forward }
        };
        joints.iter().map(of).collect()
    };
    let sides = [side(&wheels.left), side(&wheels.right)];
    Ok((robot, sides))
}

/// A robot and what it was made from.
struct Assembled {
    urdf: urdf::Urdf,
    tree: tree::Tree,
    wheels: wheels::Wheels,
    roles: joints::Roles,
    drive: drive::Drive,
    robot: RobotModel,
}

impl Assembled {
    fn facts(&self) -> findings::Facts<'_> {
        let Self { urdf, tree, wheels, roles, drive, .. } = self;
        findings::Facts { urdf, tree, wheels, roles, drive }
    }
}

fn assemble(inputs: RobotInputs<'_>) -> Result<Assembled, Diagnostics> {
    let RobotInputs { spec, urdf: (name, text), files, overrides } = inputs;
    let urdf = urdf::read(name, text)?;
    let tree = tree::Tree::new(&urdf)?;
    let wheels = wheels::wheels(spec, &urdf, &tree)?;
    let roles = joints::roles(spec, &urdf, &wheels)?;
    let drive = drive::drive(spec, &urdf, &tree, &wheels, |joint| roles.at_zero(joint))?;

    let mut overrides = limits::Overrides { spec, mission: overrides, faults: Vec::new() };
    overrides.names(&urdf, &wheels);
    let wheel = overrides.wheel(&urdf, &wheels, &drive);
    let base = overrides.base(&wheel, &drive);
    let joints = overrides.joints(&urdf, &roles);
    let mut faults = overrides.faults;
    bodies::check_links(spec, &urdf, &mut faults);
    let collapsed = bodies::collapse(&urdf, &tree, &roles, drive.base_from_root);
    let shapes = bodies::collision_shapes(spec, &urdf, &collapsed, files, &mut faults);
    if !faults.is_empty() {
        return Err(Diagnostics(faults));
    }
    let names = urdf.robot.links.iter().map(|link| link.name.clone());
    let frame = |(name, (body, pose))| LinkFrame { name, body, pose };
    let links = names.zip(collapsed.links).map(frame).collect();
    let mut robot = RobotModel {
        name: spec.name.clone().unwrap_or_else(|| urdf.robot.name.clone()),
        wheel_radii: drive.wheel_radii,
        track_width: drive.track_width,
        root_link: urdf.robot.links[tree.root].name.clone(),
        base_from_root: drive.base_from_root,
        joints,
        bodies: collapsed.bodies,
        shapes,
        links,
        wheel,
        base,
        ignore_pairs: Vec::new(),
        tolerance: ToleranceSpec::resolved(None, spec.tolerance),
    };
    robot.ignore_pairs = pairs::ignored(spec, &urdf, &tree, &roles, &robot);
    Ok(Assembled { urdf, tree, wheels, roles, drive, robot })
}
