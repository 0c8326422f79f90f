//! Clearance of every contour point, \[SCR\] Eq. 20 to 23, for any tree of joints.
//!
//! The gradient goes back as forces do: each body gathers force and torque of its points, hands them to its parent, and a joint
//! feels the part along its axis. The base feels a force (by position) and a torque about z (by heading).

use nalgebra::{Isometry3, Matrix3, Point3, Vector3};

use super::Judge;
use super::field::{DistanceField, look_up};
use super::own_links::{self, Meeting, OwnLinks};
use super::touch::{BodyFrame, ByPose, PointOf, Pushed, Touch, met};
use crate::math::real;
use crate::optimize::contour::{Contour, Reach};
use crate::robot::RobotModel;

/// Interpolated values lie at most 0.26 cells above and sqrt(3)/2 cells below the true distance (MATH section 4), so a ball's
/// centre bounds its points up to the sum.
const INTERPOLATION_SLACK: f64 = 1.13;

/// What pushes on a body.
#[derive(Debug, Clone, Copy)]
struct Load {
    force: Vector3<f64>,
    /// About the base's origin.
    torque: Vector3<f64>,
}

impl Load {
    fn none() -> Self {
        Self { force: Vector3::zeros(), torque: Vector3::zeros() }
    }
}

/// Where the robot is: position (m), heading as (cos, sin), joint values.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Placement<'a> {
    pub position: [f64; 2],
    pub heading: [f64; 2],
    pub joints: &'a [f64],
}

/// Values trilinearly interpolated from a 1-Lipschitz lattice change by at most this much a metre.
const INTERPOLATION_SLOPE: f64 = 1.733;
/// A patch that is clear by less than this (m) is looked at more closely, to learn how far its points may really move.
const WORTH_A_LOOK: f64 = 0.02;

/// Scratch memory and constants of the penalty.
///
/// Every sample of a curve remembers where it was last seen, and how far each shape may move from there before any of its points
/// costs anything. A step of the optimiser is shorter than that nearly everywhere, so nearly all look-ups are spared.
#[derive(Debug, Clone)]
pub struct ClearancePenalty {
    contour: Contour,
    /// How fast each shape's points move.
    reaches: Vec<Reach>,
    own: OwnLinks,
    /// Per sample: x, y, cos, sin, joints; then per shape how far it may move, and per pair of own links how much nearer they may come, m.
    memory: Vec<f64>,
    joints: usize,
    clearance: f64,
    /// How much of `clearance` was not asked for at first, m.
    tightened: f64,
    /// Violations are divided by this, m.
    scale: f64,
    slack: f64,
    poses: Vec<Isometry3<f64>>,
    frames: Vec<BodyFrame>,
    loads: Vec<Load>,
    /// Scratch of [`ClearancePenalty::visit`]: one entry a joint.
    by_joints: Vec<f64>,
}

impl ClearancePenalty {
    /// For `contour` of `robot`, wanting `clearance` m in a field with cells of `cell` m; violations count in units of `scale` m.
    pub fn new(contour: Contour, robot: &RobotModel, clearance: f64, scale: f64, cell: f64) -> Self {
        let bodies = robot.bodies.len();
        let frame = BodyFrame { rotation: Matrix3::identity(), origin: Vector3::zeros() };
        Self {
            reaches: contour.shapes.iter().map(|shape| Reach::of(robot, shape)).collect(),
            own: OwnLinks::new(robot),
            memory: Vec::new(),
            joints: robot.joints.len(),
            contour,
            clearance,
            tightened: 0.0,
            scale,
            slack: INTERPOLATION_SLACK * cell,
            poses: Vec::with_capacity(bodies),
            frames: vec![frame; bodies],
            loads: vec![Load::none(); bodies],
            by_joints: vec![0.0; robot.joints.len()],
        }
    }

    /// Memory for samples `0..count`; nothing is known about them.
    pub(crate) fn remember(&mut self, count: usize) {
        self.memory = vec![f64::NEG_INFINITY; count * self.stride()];
    }

    /// Nothing is known about `sample` any more.
    pub(crate) fn forget(&mut self, sample: usize) {
        let stride = self.stride();
        self.memory[sample * stride..(sample + 1) * stride].fill(f64::NEG_INFINITY);
    }

    fn stride(&self) -> usize {
        4 + self.joints + self.reaches.len() + self.own.pairs.len()
    }

    fn place(&mut self, robot: &RobotModel, heading: [f64; 2], q: &[f64]) {
        robot.body_poses(q, &mut self.poses);
        let [c, s] = heading;
        let turn = Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0);
        for (frame, pose) in self.frames.iter_mut().zip(&self.poses) {
            frame.rotation = turn * pose.rotation.to_rotation_matrix().into_inner();
            frame.origin = turn * pose.translation.vector;
        }
    }

    /// Takes the way from where `sample` was last off what its shapes may move; whether one may have reached something.
    fn moved(&mut self, at: Placement<'_>, sample: usize) -> bool {
        let stride = self.stride();
        let (pose, free) = self.memory[sample * stride..(sample + 1) * stride].split_at_mut(4 + self.joints);
        if pose[0] == f64::NEG_INFINITY {
            pose[..2].copy_from_slice(&at.position);
            pose[2..4].copy_from_slice(&at.heading);
            pose[4..].copy_from_slice(at.joints);
            return true;
        }
        let way = real::hypot(at.position[0] - pose[0], at.position[1] - pose[1]);
        // An angle is less than pi/2 of its chord.
        let turn = std::f64::consts::FRAC_PI_2 * real::hypot(at.heading[0] - pose[2], at.heading[1] - pose[3]);
        let mut near = false;
        for (free, reach) in free.iter_mut().zip(&self.reaches) {
            let mut far = way + reach.radius * turn;
            for ((lever, to), from) in reach.joints.iter().zip(at.joints).zip(&pose[4..]) {
                far += lever * (to - from).abs();
            }
            *free -= far;
            // Not `<`: NaN is looked at.
            near |= free.is_nan() || *free <= 0.0;
        }
        for (free, pair) in free[self.reaches.len()..].iter_mut().zip(&self.own.pairs) {
            for ((lever, to), from) in pair.levers.iter().zip(at.joints).zip(&pose[4..]) {
                *free -= lever * (to - from).abs();
            }
            near |= free.is_nan() || *free <= 0.0;
        }
        pose[..2].copy_from_slice(&at.position);
        pose[2..4].copy_from_slice(&at.heading);
        pose[4..].copy_from_slice(at.joints);
        near
    }

    /// Cost at a place that is a step of `sample` away from where it was last. Adds to `by_pose` and to `by_joints`.
    #[allow(clippy::too_many_arguments)]
    pub(crate) fn add(
        &mut self,
        robot: &RobotModel,
        field: &impl DistanceField,
        at: Placement<'_>,
        sample: usize,
        judge: &mut impl Judge,
        by_pose: &mut ByPose,
        by_joints: &mut [f64],
    ) -> f64 {
        if !self.moved(at, sample) {
            return 0.0;
        }
        self.place(robot, at.heading, at.joints);
        self.loads.fill(Load::none());
        let (scale, mut sum, mut touched) = (self.scale, 0.0, false);
        let mut loads = std::mem::take(&mut self.loads);
        self.scan(field, at.position, sample, |(body, _), arm, [short, weight], gradient| {
            let (cost, slope) = judge.weigh(short / scale);
            sum += weight * cost;
            if slope != 0.0 {
                let push = gradient * (-weight * slope / scale);
                loads[body].force += push;
                loads[body].torque += arm.cross(&push);
                touched = true;
            }
        });
        let frames = std::mem::take(&mut self.frames);
        self.scan_own(robot, &frames, sample, |_, meeting| {
            let (cost, slope) = judge.weigh((own_links::MARGIN - meeting.distance) / scale);
            sum += own_links::WEIGHT * cost;
            if slope != 0.0 {
                let push = meeting.normal * (own_links::WEIGHT * slope / scale);
                for ((body, arm), push) in meeting.bodies.into_iter().zip(meeting.arms).zip([-push, push]) {
                    loads[body].force += push;
                    loads[body].torque += arm.cross(&push);
                }
                touched = true;
            }
        });
        self.frames = frames;
        self.loads = loads;
        if touched {
            self.gather(robot, by_pose, by_joints);
        }
        sum
    }

    /// Tells `touch` of every contour point that misses the wanted clearance at a place that is a step of `sample` away from where
    /// it was last.
    pub(crate) fn visit(
        &mut self,
        robot: &RobotModel,
        field: &impl DistanceField,
        at: Placement<'_>,
        sample: usize,
        mut touch: impl FnMut(Touch<'_>),
    ) {
        if !self.moved(at, sample) {
            return;
        }
        self.place(robot, at.heading, at.joints);
        let mut by_joints = std::mem::take(&mut self.by_joints);
        let frames = std::mem::take(&mut self.frames);
        self.scan_in(&frames, field, at.position, sample, |(body, point), arm, [short, weight], gradient| {
            if short > 0.0 {
                let of = PointOf::Contour { body, point };
                let pushed = Pushed { of, body, arm, short, weight, push: -gradient };
                touch(pushed.touch(robot, &frames, &mut by_joints));
            }
        });
        self.scan_own(robot, &frames, sample, |pair, meeting| {
            if meeting.distance < own_links::MARGIN {
                touch(met(robot, &frames, pair, meeting, &mut by_joints));
            }
        });
        self.frames = frames;
        self.by_joints = by_joints;
    }

    /// Tells `touch` of some points, whether or not they miss the clearance.
    pub(crate) fn look(
        &mut self,
        robot: &RobotModel,
        field: &impl DistanceField,
        at: Placement<'_>,
        points: impl Iterator<Item = PointOf>,
        mut touch: impl FnMut(Touch<'_>),
    ) {
        self.place(robot, at.heading, at.joints);
        let mut by_joints = std::mem::take(&mut self.by_joints);
        let base = Vector3::new(at.position[0], at.position[1], 0.0);
        for of in points {
            match of {
                PointOf::Contour { body, point: index } => {
                    let (frame, point) = (&self.frames[body], &self.contour.points[index]);
                    let arm = frame.rotation * point.at.coords + frame.origin;
                    let (distance, gradient) = look_up(field, arm + base, point.rise);
                    let short = self.clearance + point.radius - distance;
                    let push = -Vector3::from(gradient);
                    let pushed = Pushed { of, body, arm, short, weight: point.weight, push };
                    touch(pushed.touch(robot, &self.frames, &mut by_joints));
                }
                PointOf::Pair(pair) => {
                    if let Ok(meeting) = self.own.pairs[pair].meeting(robot, &self.frames, f64::INFINITY) {
                        touch(met(robot, &self.frames, pair, &meeting, &mut by_joints));
                    }
                }
            }
        }
        self.by_joints = by_joints;
    }

    fn scan(
        &mut self,
        field: &impl DistanceField,
        position: [f64; 2],
        sample: usize,
        point: impl FnMut((usize, usize), Vector3<f64>, [f64; 2], Vector3<f64>),
    ) {
        let frames = std::mem::take(&mut self.frames);
        self.scan_in(&frames, field, position, sample, point);
        self.frames = frames;
    }

    /// Looks at every pair of own links that may be too near; notes how much nearer each may come before that has to be done again.
    fn scan_own(&mut self, robot: &RobotModel, frames: &[BodyFrame], sample: usize, look: impl FnMut(usize, &Meeting)) {
        let stride = self.stride();
        let free = &mut self.memory[sample * stride + 4 + self.joints + self.reaches.len()..(sample + 1) * stride];
        self.own.scan(robot, frames, free, look);
    }

    /// Looks at every point that may miss the clearance: body and index, where it is from the base's origin (map axes), by how much it
    /// misses (m) and what it counts, and the field's gradient there. Notes how far each shape may move before that has to be done again.
    fn scan_in(
        &mut self,
        frames: &[BodyFrame],
        field: &impl DistanceField,
        position: [f64; 2],
        sample: usize,
        mut look: impl FnMut((usize, usize), Vector3<f64>, [f64; 2], Vector3<f64>),
    ) {
        let stride = self.stride();
        let free = &mut self.memory[sample * stride + 4 + self.joints..(sample + 1) * stride];
        let base = Vector3::new(position[0], position[1], 0.0);
        for (shape, free) in self.contour.shapes.iter().zip(free) {
            if *free > 0.0 {
                continue;
            }
            let frame = &frames[shape.body];
            let placed = |p: &Point3<f64>| frame.rotation * p.coords + frame.origin;
            let mut node = 0;
            *free = f64::INFINITY;
            while let Some(patch) = shape.patches.get(node) {
                let centre = placed(&patch.centre) + base;
                let distance = match patch.rise {
                    rise if rise > 0.0 => field.least_above(centre.into(), rise).0,
                    _ => field.distance(centre.into()),
                };
                let spare = distance - self.clearance;
                let spare = (spare - patch.radius - self.slack).max(spare / INTERPOLATION_SLOPE - patch.radius);
                if spare > if patch.leaf { 0.0 } else { WORTH_A_LOOK } {
                    *free = free.min(spare);
                    node = patch.skip_to;
                    continue;
                }
                node += 1;
                if !patch.leaf {
                    continue;
                }
                for index in patch.first..patch.last {
                    let point = &self.contour.points[index];
                    let arm = placed(&point.at);
                    let (distance, gradient) = look_up(field, arm + base, point.rise);
                    let short = self.clearance + point.radius - distance;
                    *free = free.min(-short / INTERPOLATION_SLOPE);
                    look((shape.body, index), arm, [short, point.weight], Vector3::from(gradient));
                }
            }
        }
    }

    /// Hands forces down to the base; a body comes after its parent.
    fn gather(&mut self, robot: &RobotModel, by_pose: &mut ByPose, by_joints: &mut [f64]) {
        for (index, body) in robot.bodies.iter().enumerate().skip(1).rev() {
            let (frame, load) = (self.frames[index], self.loads[index]);
            if let Some(motion) = &body.motion {
                let axis = frame.rotation * motion.axis.into_inner();
                let felt = if motion.prismatic {
                    axis.dot(&load.force)
                } else {
                    axis.dot(&(load.torque - frame.origin.cross(&load.force)))
                };
                by_joints[motion.joint] += motion.multiplier * felt;
            }
            let parent = &mut self.loads[body.parent];
            parent.force += load.force;
            parent.torque += load.torque;
        }
        let base = &self.loads[0];
        by_pose.position[0] += base.force.x;
        by_pose.position[1] += base.force.y;
        by_pose.heading += base.torque.z;
    }
}

impl ClearancePenalty {
    /// Wants `by` m more than before.
    pub(crate) fn tighten(&mut self, by: f64) {
        self.clearance += by;
        self.tightened += by;
        self.memory.fill(f64::NEG_INFINITY);
    }

    /// The worst constraint value as metres missed of the clearance first asked for.
    pub(crate) fn missed(&self, worst: f64) -> f64 {
        worst * self.scale - self.tightened
    }
}

#[cfg(test)]
mod tests {
    use super::super::Penalise;
    use super::*;
    use crate::optimize::test_robot::{Boxes, robot};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn dismissing_patches_changes_no_cost(x in -1.0..1.0f64, y in -1.0..1.0f64, yaw in -3.0..3.0f64, q in 0.0..3.0f64, step in proptest::array::uniform3(-0.3..0.3f64)) {
            let robot = robot(2);
            let field = Boxes(vec![([0.5, 0.4, 0.0], [0.7, 1.5, 1.0]), ([-0.9, -0.8, 0.3], [0.0, -0.5, 0.5])]);
            let contour = Contour::new(&robot, 0.06);
            let mut penalty = ClearancePenalty::new(contour.clone(), &robot, 0.15, 0.05, 0.0);
            penalty.remember(1);
            let joints = [q, 0.1];
            let (mut by_pose, mut by_joints) = (ByPose::default(), [0.0; 2]);
            let heading = [real::cos(yaw), real::sin(yaw)];
            let judge = &mut Penalise(0.1);
            // Comes from some other place, which it remembers.
            let from = Placement { position: [x + step[0], y + step[1]], heading: [0.6, 0.8], joints: &[q + step[2], 0.0] };
            penalty.add(&robot, &field, from, 0, judge, &mut by_pose, &mut by_joints);
            let at = Placement { position: [x, y], heading, joints: &joints };
            let cost = penalty.add(&robot, &field, at, 0, judge, &mut by_pose, &mut by_joints);
            let mut poses = Vec::new();
            robot.body_poses(&joints, &mut poses);
            let base = crate::geom::Pose2::new(x, y, yaw).isometry();
            let mut sum = 0.0;
            for shape in &contour.shapes {
                let own = shape.patches.first().map_or(0..0, |whole| whole.first..whole.last);
                for point in &contour.points[own] {
                    let p = base * poses[shape.body] * point.at;
                    let (distance, _) = look_up(&field, p.coords, point.rise);
                    sum += point.weight * judge.weigh((0.15 + point.radius - distance) / 0.05).0;
                }
            }
            prop_assert!((cost - sum).abs() < 1e-9 * (1.0 + sum), "{cost} vs {sum}");
        }
    }
}
