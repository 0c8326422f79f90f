//! Goals of a link: where the base may stand, and how the joints, so that a link is at its place.
//!
//! Postures are sampled over all the joints' ranges, each with a heading, and the base put where the link is above or below its place. From
//! there base and joints together are moved until the link is there: Levenberg-Marquardt steps on the geometric Jacobian (C. Wampler,
//! *Manipulator inverse kinematic solutions based on vector formulations and damped least-squares methods*, IEEE Trans. SMC 16, 1986).
//! What is found is tried in the order of the time that it takes at least; what touches anything comes last.

use nalgebra::{DMatrix, DVector, Isometry3, UnitQuaternion, Vector3};

use super::collide::Collider;
use super::joint_space::JointSpace;
use super::posture::Postures;
use super::{Query, SearchOptions};
use crate::esdf::Esdf;
use crate::geom::{Pose2, wrap_angle};
use crate::map::VoxelMap;
use crate::math::{halton, real};
use crate::robot::RobotModel;

/// Postures that are begun with.
const SAMPLES: usize = 600;
/// Steps from each at most.
const STEPS: usize = 60;
/// A link is there where it is within this, m; its turn counts as [`ARM`].
const THERE: f64 = 1e-6;
/// Metres that a radian of a link's turn is worth.
const ARM: f64 = 0.3;
/// Damping at first, after a step that came nearer, and after one that did not.
const DAMPING: f64 = 1e-2;
const NEARER: f64 = 0.3;
const FARTHER: f64 = 5.0;
/// Beyond this no step is small enough.
const MOST_DAMPING: f64 = 1e6;
/// Placements that are looked at for whether they are free, and free ones that are wanted.
const LOOKS: usize = 600;
const WANTED: usize = 6;
/// Placements nearer to one another than this are one, m; a radian counts as a metre, and so does a joint's metre.
const SAME: f64 = 0.05;
/// Share of the quicker of base and joints that counts too: of two that take as long the one with less motion is better.
const BOTH: f64 = 0.1;

/// Where a link is to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkTarget {
    /// Index into [`RobotModel::links`].
    pub link: usize,
    /// Of its frame's origin, map frame, m.
    pub position: [f64; 3],
    /// Of its frame against the map's axes; `None`: any.
    pub rotation: Option<UnitQuaternion<f64>>,
}

/// Where to stand so that a link is at its place.
#[derive(Debug, Clone, PartialEq)]
pub struct Placements {
    /// Base and joints, the best first; at most a few. Where none is free, the best of those that are not.
    pub found: Vec<(Pose2, Vec<f64>)>,
    /// How near the link comes to its place, m (a radian of its turn counts 0.3 m): 0 where `found` is not empty.
    pub nearest: f64,
    /// Least and greatest height of the link in the postures that were sampled, m.
    pub heights: [f64; 2],
}

/// Placements of base and joints that agree with what a query leaves open: its goal's heading and joints (not its position).
pub fn placements(
    map: &VoxelMap,
    esdf: &Esdf,
    robot: &RobotModel,
    target: &LinkTarget,
    query: &Query,
    options: &SearchOptions,
) -> Placements {
    let start: Vec<f64> = robot
        .joints
        .iter()
        .zip(&query.start_joints)
        .map(|(joint, asked)| asked.unwrap_or(0f64.clamp(joint.lower, joint.upper)))
        .collect();
    let space = JointSpace::new(robot, &start);
    let solver = Solver { robot, target, yaw: query.goal_yaw, joints: &query.goal_joints, ranges: &space.ranges };
    let (mut found, mut nearest, mut heights) = (Vec::new(), f64::INFINITY, [f64::INFINITY, f64::NEG_INFINITY]);
    for index in 0..SAMPLES {
        let first = solver.begin(if index == 0 { start.clone() } else { space.sample(index) }, index);
        let height = solver.frame(&first).translation.z;
        heights = [heights[0].min(height), heights[1].max(height)];
        let (end, off) = solver.approach(first);
        nearest = nearest.min(off);
        if off <= THERE && inside(map, end.pose) && !found.iter().any(|other| end.is_like(other)) {
            found.push(end);
        }
    }
    let time = |at: &State| {
        let joints = query.start_joints.iter().zip(&start).zip(&at.joints);
        // A start that is left open costs nothing.
        let from: Vec<f64> = joints.map(|((asked, start), own)| if asked.is_some() { *start } else { *own }).collect();
        let (base, joints) = (drive(robot, query.start, at.pose), space.time(&from, &at.joints));
        base.max(joints) + BOTH * base.min(joints)
    };
    found.sort_by(|a, b| time(a).total_cmp(&time(b)));
    let pairs = robot.self_pairs();
    let is_free = |at: &&State| {
        let only = Postures::over(at.joints.iter().map(|value| vec![*value]).collect());
        let collider = Collider::<1>::new(robot, esdf, map, options.clearance, only);
        robot.touching(&pairs, &at.joints).is_none()
            && collider.contact(at.pose, &at.joints).clearance >= options.clearance
    };
    let free: Vec<&State> = found.iter().take(LOOKS).filter(is_free).take(WANTED).collect();
    let best = if free.is_empty() { found.first().into_iter().collect() } else { free };
    let found: Vec<(Pose2, Vec<f64>)> = best.into_iter().map(|at| (at.pose, at.joints.clone())).collect();
    Placements { nearest: if found.is_empty() { nearest } else { 0.0 }, found, heights }
}

fn inside(map: &VoxelMap, pose: Pose2) -> bool {
    let bounds = map.bounds();
    [pose.x, pose.y].into_iter().enumerate().all(|(axis, at)| (bounds.min[axis]..=bounds.max[axis]).contains(&at))
}

/// Time to turn, drive straight and turn at full speed, s.
fn drive(robot: &RobotModel, from: Pose2, to: Pose2) -> f64 {
    let (dx, dy) = (to.x - from.x, to.y - from.y);
    let length = real::hypot(dx, dy);
    let turn = |a: f64, b: f64| wrap_angle(a - b).abs();
    let turned = match real::atan2(dy, dx) {
        _ if length < SAME => turn(from.yaw, to.yaw),
        way => turn(from.yaw, way) + turn(way, to.yaw),
    };
    length / robot.base.speed + turned / robot.base.angular_speed
}

#[derive(Debug, Clone, PartialEq)]
struct State {
    pose: Pose2,
    joints: Vec<f64>,
}

impl State {
    fn is_like(&self, other: &Self) -> bool {
        let base = [self.pose.x - other.pose.x, self.pose.y - other.pose.y, wrap_angle(self.pose.yaw - other.pose.yaw)];
        let joints = self.joints.iter().zip(&other.joints).map(|(a, b)| a - b);
        base.into_iter().chain(joints).all(|by| by.abs() < SAME)
    }
}

struct Solver<'a> {
    robot: &'a RobotModel,
    target: &'a LinkTarget,
    yaw: Option<f64>,
    joints: &'a [Option<f64>],
    ranges: &'a [[f64; 2]],
}

impl Solver<'_> {
    /// With what is asked for, and the link above or below its place.
    fn begin(&self, mut joints: Vec<f64>, index: usize) -> State {
        for (own, asked) in joints.iter_mut().zip(self.joints) {
            *own = asked.unwrap_or(*own);
        }
        let any = std::f64::consts::TAU * halton::value(joints.len(), index + 1);
        let mut at = State { pose: Pose2::new(0.0, 0.0, wrap_angle(self.yaw.unwrap_or(any))), joints };
        let link = self.frame(&at).translation;
        (at.pose.x, at.pose.y) = (self.target.position[0] - link.x, self.target.position[1] - link.y);
        at
    }

    /// map <- link.
    fn frame(&self, at: &State) -> Isometry3<f64> {
        at.pose.isometry() * self.robot.link_pose(self.target.link, &at.joints)
    }

    /// What is missing: three metres, and where it must be turned some way three turns about the map's axes, as metres.
    fn missing(&self, frame: &Isometry3<f64>) -> DVector<f64> {
        let shift = Vector3::from(self.target.position) - frame.translation.vector;
        let Some(wanted) = self.target.rotation else { return DVector::from_column_slice(shift.as_slice()) };
        let turn = (wanted * frame.rotation.inverse()).scaled_axis() * ARM;
        DVector::from_iterator(6, shift.iter().chain(turn.iter()).copied())
    }

    /// Columns: how x, y, the heading and each joint move what is [missing](Self::missing) away; zero for what may not change.
    fn jacobian(&self, at: &State, frame: &Isometry3<f64>) -> DMatrix<f64> {
        let rows = if self.target.rotation.is_some() { 6 } else { 3 };
        let mut out = DMatrix::zeros(rows, 3 + at.joints.len());
        let mut add = |column: usize, shift: Vector3<f64>, turn: Vector3<f64>| {
            let all = shift.iter().copied().chain(turn.iter().map(|part| ARM * part));
            for (row, value) in all.take(rows).enumerate() {
                out[(row, column)] += value;
            }
        };
        add(0, Vector3::x(), Vector3::zeros());
        add(1, Vector3::y(), Vector3::zeros());
        let about = |axis: Vector3<f64>, through: Vector3<f64>| axis.cross(&(frame.translation.vector - through));
        if self.yaw.is_none() {
            add(2, about(Vector3::z(), Vector3::new(at.pose.x, at.pose.y, 0.0)), Vector3::z());
        }
        let mut poses = Vec::new();
        self.robot.body_poses(&at.joints, &mut poses);
        let mut body = self.robot.links[self.target.link].body;
        while let Some(motion) = &self.robot.bodies[body].motion {
            if self.joints[motion.joint].is_none() {
                let pose = at.pose.isometry() * poses[body];
                let axis = pose.rotation * motion.axis.into_inner() * motion.multiplier;
                match motion.prismatic {
                    true => add(3 + motion.joint, axis, Vector3::zeros()),
                    false => add(3 + motion.joint, about(axis, pose.translation.vector), axis),
                }
            }
            body = self.robot.bodies[body].parent;
        }
        out
    }

    fn moved(&self, at: &State, step: &DVector<f64>) -> State {
        let joints = at.joints.iter().zip(self.ranges).enumerate();
        State {
            pose: Pose2::new(at.pose.x + step[0], at.pose.y + step[1], wrap_angle(at.pose.yaw + step[2])),
            joints: joints.map(|(k, (own, [low, high]))| (own + step[3 + k]).clamp(*low, *high)).collect(),
        }
    }

    /// As near as steps from a state come, and how much is missing there, m.
    fn approach(&self, mut at: State) -> (State, f64) {
        let mut missing = self.missing(&self.frame(&at));
        let mut damping = DAMPING;
        let mut jacobian = self.jacobian(&at, &self.frame(&at));
        for _ in 0..STEPS {
            if missing.norm() <= 1e-3 * THERE || damping > MOST_DAMPING {
                break;
            }
            let mut normal = jacobian.tr_mul(&jacobian);
            (0..normal.nrows()).for_each(|k| normal[(k, k)] += damping);
            let Some(factor) = normal.cholesky() else { break };
            let next = self.moved(&at, &factor.solve(&jacobian.tr_mul(&missing)));
            let frame = self.frame(&next);
            let left = self.missing(&frame);
            if left.norm() < missing.norm() {
                (at, missing, damping) = (next, left, damping * NEARER);
                jacobian = self.jacobian(&at, &frame);
            } else {
                damping *= FARTHER;
            }
        }
        (at, missing.norm())
    }
}

#[cfg(test)]
mod tests;
