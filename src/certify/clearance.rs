//! The least clearance over all instants, shapes and obstacles, by branch and bound over time.
//!
//! An interval is looked at from its middle. A plane that separates the shape from an obstacle there, with the bound of
//! [`super::motion`] on how far the shape can come towards it, is a proof for the whole interval. What the planes do not settle
//! is halved. The *target* is what must be proven: the requirement, or less when a nearer point has been found, but always
//! nearly the least distance found, so that the figure reported is the true one.

use nalgebra::Vector3;

use super::distance::{Posed, nearest_along};
use super::motion::{Kinematics, Moving, MovingShape};
use super::obstacles::{Edge, Obstacles};
use super::rollout::Rollout;
use super::tube::{Shares, Tube, Width};
use super::{Closest, Refusal, RefusalKind};
use crate::geom::{Aabb, Pose2};
use crate::map::VoxelMap;
use crate::math::real;
use crate::robot::RobotModel;

/// The clearance proven is within this of the least distance found, m (except close to the requirement, where it is nearer).
const TOLERANCE: f64 = 5e-4;
/// An interval in which no point moves farther than this is not halved, m: what is not proven there is refused.
const RESOLUTION: f64 = 1e-6;
/// Clearances up to these are measured, m: the next only where nothing is nearer than the one before.
const REACHES: [f64; 3] = [0.1, 0.4, 1.6];
/// Rows between those looked at first, for an early idea of the least distance.
const STRIDE: usize = 16;
/// Evaluations (a column or a box counts for a part of one) after which what is not proven is refused: some seconds.
const WORK: u64 = 5_000_000;

/// What was proven and found.
pub(super) struct Clearance {
    /// Lower bound of the distance, m; zero where bodies meet.
    pub(super) proven: f64,
    /// The least distance found.
    pub(super) closest: Option<Closest>,
    /// How wide the tube is where that is, and what each tolerance has to do with it; `None` without a tube.
    pub(super) there: Option<(Width, Shares)>,
    /// Why it does not suffice.
    pub(super) refusal: Option<Refusal>,
}

/// More than nothing, m: touching is never enough.
const LEAST: f64 = 1e-9;

/// Measures the clearance of a replay against a map, or of all robots in a tube around it. `required`: what is asked for, m; touching is
/// never enough.
pub(super) fn clearance<'a>(
    rollout: &'a Rollout<'a>,
    robot: &'a RobotModel,
    map: &'a VoxelMap,
    required: f64,
    tube: Option<&'a Tube<'a>>,
) -> Clearance {
    let mut search = Search::new(rollout, robot, map, required.max(LEAST), tube);
    for reach in REACHES {
        let reach = reach.max(search.required + 0.05);
        if reach > search.reach {
            search.reach = reach;
            search.run();
        }
        if search.least - TOLERANCE <= reach || search.unproven < reach {
            break;
        }
    }
    search.verdict(required)
}

/// The first row in which a robot in the tube may touch an obstacle; `None`: in none.
pub(super) fn first_contact<'a>(
    rollout: &'a Rollout<'a>,
    robot: &'a RobotModel,
    map: &'a VoxelMap,
    tube: &'a Tube<'a>,
) -> Option<usize> {
    let mut search = Search::new(rollout, robot, map, LEAST, Some(tube));
    search.reach = LEAST;
    (0..rollout.rows()).find(|row| {
        let (mut left, mut boxes) = (Vec::new(), Vec::new());
        search.whole_row(*row, &mut left, &mut boxes);
        search.halve(left, boxes);
        search.least < LEAST || search.unproven < LEAST
    })
}

/// A shape during a part of a row.
#[derive(Debug, Clone, Copy)]
struct Interval {
    shape: usize,
    row: usize,
    /// Its middle, s into the row.
    tau: f64,
    /// Half its length, s.
    half: f64,
    /// See [`Kinematics::acceleration`].
    acceleration: f64,
    /// Proven so far, m.
    lower: f64,
    /// Where its obstacles are: begin and end in the list of boxes left.
    boxes: (usize, usize),
}

#[derive(Debug, Clone, Copy)]
struct Witness {
    shape: usize,
    row: usize,
    tau: f64,
    /// A box, or the unseen space beyond the map.
    obstacle: Option<Aabb>,
}

struct Search<'a> {
    rollout: &'a Rollout<'a>,
    robot: &'a RobotModel,
    kinematics: Kinematics<'a>,
    obstacles: Obstacles<'a>,
    tube: Option<&'a Tube<'a>>,
    required: f64,
    /// Taken off every bound, m.
    rounding: f64,
    /// Distances beyond this are not looked for, m.
    reach: f64,
    /// Least distance found, m; negative: overlap.
    least: f64,
    witness: Option<Witness>,
    /// Least bound of the intervals that were given up, m.
    unproven: f64,
    work: u64,
    /// Work after which it gives up.
    patience: u64,
    /// The plane that last served each shape.
    hints: Vec<Option<Vector3<f64>>>,
    boxes: Vec<(f64, Aabb)>,
    found: Vec<Aabb>,
}

impl<'a> Search<'a> {
    fn new(
        rollout: &'a Rollout<'a>,
        robot: &'a RobotModel,
        map: &'a VoxelMap,
        required: f64,
        tube: Option<&'a Tube<'a>>,
    ) -> Self {
        let kinematics = Kinematics::new(robot);
        let mut extreme = vec![0.0f64; robot.joints.len()];
        for row in 0..rollout.rows() {
            for (most, value) in extreme.iter_mut().zip(rollout.joints(row)) {
                *most = most.max(value.abs());
            }
        }
        let bounds = map.bounds();
        let coordinates = bounds.min.iter().chain(&bounds.max).fold(0.0f64, |m, x| m.max(x.abs()));
        let rounding = rollout.rounding(kinematics.size(&extreme), coordinates);
        let hints = vec![None; kinematics.shape_count()];
        Self {
            rollout,
            robot,
            kinematics,
            obstacles: Obstacles::new(map),
            tube,
            required,
            rounding,
            reach: 0.0,
            least: f64::INFINITY,
            witness: None,
            unproven: f64::INFINITY,
            work: 0,
            patience: WORK,
            hints,
            boxes: Vec::new(),
            found: Vec::new(),
        }
    }

    /// The distance that every interval must be proven to keep, m.
    fn target(&self) -> f64 {
        let near_least = self.least - TOLERANCE;
        let wanted = if self.least < self.required { near_least } else { near_least.max(self.required) };
        wanted.min(self.reach)
    }

    /// Looks at all rows, then at the halves of what is left, and so on.
    fn run(&mut self) {
        let mut left = Vec::new();
        let mut boxes = Vec::new();
        for row in (0..self.rollout.rows()).step_by(STRIDE) {
            self.whole_row(row, &mut left, &mut boxes);
        }
        left.clear();
        boxes.clear();
        for row in 0..self.rollout.rows() {
            self.whole_row(row, &mut left, &mut boxes);
        }
        self.halve(left, boxes);
    }

    /// Looks at the halves of intervals that are not proven, and so on.
    fn halve(&mut self, mut left: Vec<Interval>, mut boxes: Vec<Aabb>) {
        let mut joints = Vec::new();
        let mut bodies = Vec::new();
        while !left.is_empty() {
            let (mut next, mut next_boxes) = (Vec::new(), Vec::new());
            for interval in left {
                if self.settled(&interval) {
                    continue;
                }
                let half = 0.5 * interval.half;
                for tau in [interval.tau - half, interval.tau + half] {
                    let part = Interval { tau, half, ..interval };
                    let shape = self.shape_at(part, &mut joints, &mut bodies);
                    self.boxes.clear();
                    self.boxes.extend(boxes[part.boxes.0..part.boxes.1].iter().map(|b| (f64::NEG_INFINITY, *b)));
                    self.look(part, &shape, &mut next, &mut next_boxes);
                }
            }
            (left, boxes) = (next, next_boxes);
        }
    }

    /// Whether nothing more needs to be done for an interval that was not proven when it was looked at.
    fn settled(&mut self, interval: &Interval) -> bool {
        if interval.lower >= self.target() || self.least <= 0.0 {
            return true; // the target has come down since
        }
        let gave_up = self.work > self.patience;
        if gave_up {
            self.unproven = self.unproven.min(interval.lower);
        }
        gave_up
    }

    /// Looks at all shapes over the whole of a row (the last: at its time only).
    fn whole_row(&mut self, row: usize, left: &mut Vec<Interval>, left_boxes: &mut Vec<Aabb>) {
        let last = row + 1 == self.rollout.rows();
        let half = if last { 0.0 } else { 0.5 * self.rollout.step() };
        let (mut joints, mut bodies) = (Vec::new(), Vec::new());
        let held = self.rollout.held(row);
        self.rollout.joints_at(row, half, &mut joints);
        self.kinematics.bodies(&joints, held, &mut bodies);
        self.rollout.extreme_joints(row, &mut joints);
        let pose = self.rollout.pose(row, half);
        for shape in 0..self.kinematics.shape_count() {
            let acceleration = self.kinematics.acceleration(shape, held, &joints);
            let mut moving = self.kinematics.shape(shape, &bodies, pose, acceleration);
            if let Some(tube) = self.tube {
                tube.loosen(shape, &mut moving, (row, half), half);
            }
            let interval =
                Interval { shape, row, tau: half, half, acceleration, lower: f64::NEG_INFINITY, boxes: (0, 0) };
            let margin = self.target().max(0.0) + self.rounding + moving.motion(half);
            self.found.clear();
            let columns = self.obstacles.near(&moving.posed.bounds().grown(margin), &mut self.found);
            self.work += columns as u64 / 64;
            self.boxes.clear();
            self.boxes.extend(self.found.iter().map(|b| (f64::NEG_INFINITY, *b)));
            self.look(interval, &moving, left, left_boxes);
        }
    }

    fn shape_at(&self, at: Interval, joints: &mut Vec<f64>, bodies: &mut Vec<Moving>) -> MovingShape<'a> {
        self.rollout.joints_at(at.row, at.tau, joints);
        self.kinematics.bodies(joints, self.rollout.held(at.row), bodies);
        let mut shape = self.kinematics.shape(at.shape, bodies, self.rollout.pose(at.row, at.tau), at.acceleration);
        if let Some(tube) = self.tube {
            tube.loosen(at.shape, &mut shape, (at.row, at.tau), at.half);
        }
        shape
    }

    /// Notes a distance of two real points at a real instant.
    fn witness(&mut self, at: Interval, tau: f64, obstacle: Option<Aabb>, distance: f64) {
        if distance < self.least {
            self.least = distance;
            self.witness = Some(Witness { shape: at.shape, row: at.row, tau, obstacle });
        }
    }

    /// Tries to prove that `shape`, the interval's at its middle, keeps the target from `self.boxes` and from the map's edges
    /// throughout. If not, the interval goes on the list `left` with the boxes that are not settled.
    fn look(
        &mut self,
        mut at: Interval,
        shape: &MovingShape<'a>,
        left: &mut Vec<Interval>,
        left_boxes: &mut Vec<Aabb>,
    ) {
        self.work += 1 + self.boxes.len() as u64 / 16;
        let motion = shape.motion(at.half) + self.rounding;
        let bounds = shape.posed.bounds();
        let mut lower = self.edges(at, shape, &bounds, motion);

        let target = self.target();
        self.boxes.retain_mut(|(bound, obstacle)| {
            *bound = gap(&bounds, obstacle) - motion;
            *bound < target
        });
        if let Some(normal) = self.hints[at.shape].filter(|_| !self.boxes.is_empty()) {
            let [before, after] = shape.reach(&normal, at.half);
            self.separate(&normal, shape, before.max(after));
        }
        while let Some(nearest) = self.nearest() {
            let separation = shape.posed.separation(&nearest);
            let Some(normal) = separation.normal else {
                let depth = shape.posed.depth(&nearest);
                self.witness(at, at.tau, Some(nearest), 0.0 - depth);
                self.boxes.clear();
                break;
            };
            self.witness(at, at.tau, Some(nearest), separation.upper);
            let [before, after] = shape.reach(&normal, at.half);
            let bound = nearest_along(&normal, &nearest, &shape.posed.centre) - (before.max(after) + self.rounding);
            if bound < self.target() && at.half > 0.0 {
                let tau = if before > after { at.tau - at.half } else { at.tau + at.half };
                self.look_at_end(at, tau, Some(&nearest));
            }
            self.separate(&normal, shape, before.max(after));
            self.hints[at.shape] = Some(normal);
            if bound < self.target() {
                break; // to be halved, so the other boxes can wait
            }
        }
        if self.least <= 0.0 {
            return; // refused; only how deep is still of interest
        }
        lower = self.boxes.iter().fold(lower, |least, (bound, _)| least.min(*bound));
        if lower >= self.target() {
            return;
        }
        at.lower = at.lower.max(lower);
        if shape.motion(at.half) < RESOLUTION {
            self.unproven = self.unproven.min(at.lower);
            return;
        }
        at.boxes.0 = left_boxes.len();
        left_boxes.extend(self.boxes.iter().map(|(_, obstacle)| *obstacle));
        at.boxes.1 = left_boxes.len();
        left.push(at);
    }

    /// Drops the boxes that planes with this normal separate by the target from the shape, which reaches no farther than
    /// `reach` along it throughout the interval.
    fn separate(&mut self, normal: &Vector3<f64>, shape: &MovingShape<'_>, reach: f64) {
        let (reach, target) = (reach + self.rounding, self.target());
        self.boxes.retain_mut(|(bound, obstacle)| {
            *bound = bound.max(nearest_along(normal, obstacle, &shape.posed.centre) - reach);
            *bound < target
        });
    }

    /// The box with the least bound.
    fn nearest(&self) -> Option<Aabb> {
        self.boxes.iter().min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, obstacle)| *obstacle)
    }

    /// The least distance from the map's edges that is proven for the interval; infinite where it is beyond the target.
    fn edges(&mut self, at: Interval, shape: &MovingShape<'a>, bounds: &Aabb, motion: f64) -> f64 {
        let mut lower = f64::INFINITY;
        for index in 0..self.obstacles.edges.len() {
            let edge = self.obstacles.edges[index];
            let distance = beyond(&edge, bounds);
            if distance - motion >= self.target() {
                continue;
            }
            self.witness(at, at.tau, None, distance);
            let normal = Vector3::ith(edge.axis, edge.sign);
            let [before, after] = shape.reach(&normal, at.half);
            let room = edge.sign * (edge.at - shape.posed.centre[edge.axis]);
            let bound = room - before.max(after) - self.rounding;
            if bound < self.target() && at.half > 0.0 {
                let tau = if before > after { at.tau - at.half } else { at.tau + at.half };
                self.look_at_end(at, tau, None);
            }
            if bound < self.target() {
                lower = lower.min(bound);
            }
        }
        lower
    }

    /// Notes the distance of the interval's shape at its begin or end: where a shape moves towards an obstacle, it is nearest
    /// there. `obstacle`: a box, or the map's edges.
    fn look_at_end(&mut self, at: Interval, tau: f64, obstacle: Option<&Aabb>) {
        self.work += 1;
        let (mut joints, mut bodies) = (Vec::new(), Vec::new());
        let posed = self.shape_at(Interval { tau, ..at }, &mut joints, &mut bodies).posed;
        let distance = match obstacle {
            Some(obstacle) => {
                let found = posed.separation(obstacle);
                if found.normal.is_some() { found.upper } else { 0.0 - posed.depth(obstacle) }
            }
            None => {
                let bounds = posed.bounds();
                self.obstacles.edges.iter().map(|edge| beyond(edge, &bounds)).fold(f64::INFINITY, f64::min)
            }
        };
        self.witness(at, tau, obstacle.copied(), distance);
    }

    fn verdict(&self, required: f64) -> Clearance {
        let proven = self.target().min(self.unproven).max(0.0);
        let closest = self.witness.map(|witness| self.closest(witness));
        let there = self.witness.zip(self.tube).map(|(at, tube)| self.width_and_shares(at, tube));
        let holds = self.least >= self.required && proven >= self.required;
        let kind = if self.tube.is_some() { RefusalKind::Tolerance } else { RefusalKind::Clearance };
        let refusal = (!holds).then(|| {
            let Some(closest) = &closest else {
                let message = format!("clearance of {required:.4} m could not be proven, only {proven:.4} m");
                return Refusal { kind, message, time: None };
            };
            let message = match &there {
                None => too_near(closest, required, proven),
                Some(there) => {
                    let at = self.witness.map_or_else(Pose2::default, |at| self.rollout.pose(at.row, at.tau));
                    too_wide(closest, at, required, there)
                }
            };
            Refusal { kind, message, time: Some(closest.time) }
        });
        Clearance { proven, closest, there, refusal }
    }

    /// The tube at a witness: its width, and what brings the shape's point nearer there that is nearest to the obstacle.
    fn width_and_shares(&self, at: Witness, tube: &Tube<'_>) -> (Width, Shares) {
        let mut joints = Vec::new();
        let mut bodies = Vec::new();
        self.rollout.joints_at(at.row, at.tau, &mut joints);
        self.kinematics.bodies(&joints, self.rollout.held(at.row), &mut bodies);
        let posed = self.kinematics.shape(at.shape, &bodies, self.rollout.pose(at.row, at.tau), 0.0).posed;
        let bounds = posed.bounds();
        let sides = self.obstacles.edges.iter();
        let side = sides.min_by(|a, b| beyond(a, &bounds).total_cmp(&beyond(b, &bounds)));
        let toward = match &at.obstacle {
            Some(obstacle) => posed.separation(obstacle).normal,
            None => side.map(|edge| Vector3::ith(edge.axis, edge.sign)),
        };
        let toward = toward.unwrap_or_else(Vector3::zeros);
        let point = posed.centre + posed.support(&toward);
        (tube.width(at.row, at.tau), tube.shares((at.row, at.tau), at.shape, point.xy(), toward.xy()))
    }

    fn closest(&self, witness: Witness) -> Closest {
        let (mut joints, mut bodies) = (Vec::new(), Vec::new());
        self.rollout.joints_at(witness.row, witness.tau, &mut joints);
        self.kinematics.bodies(&joints, self.rollout.held(witness.row), &mut bodies);
        let pose = self.rollout.pose(witness.row, witness.tau);
        let mut shape = self.kinematics.shape(witness.shape, &bodies, pose, 0.0);
        if let Some(tube) = self.tube {
            tube.loosen(witness.shape, &mut shape, (witness.row, witness.tau), 0.0);
        }
        Closest {
            time: self.rollout.time(witness.row, witness.tau),
            link: self.robot.shapes[witness.shape].link.clone(),
            obstacle: witness.obstacle.map(|merged| self.nearest_cube(&shape.posed, &merged)),
            distance: self.least,
        }
    }

    /// The cell of a merged box that is nearest to a shape; where several meet it, the one nearest to its centre.
    fn nearest_cube(&self, shape: &Posed<'_>, merged: &Aabb) -> Aabb {
        let bounds = shape.bounds();
        let mut best = (f64::INFINITY, f64::INFINITY, *merged);
        for cube in self.obstacles.cubes(merged) {
            if gap(&bounds, &cube) > best.0 {
                continue;
            }
            let found = (shape.separation(&cube).upper, cube.distance(&shape.centre.into()));
            if found < (best.0, best.1) {
                best = (found.0, found.1, cube);
            }
        }
        best.2
    }
}

/// Why a motion's clearance does not suffice.
fn too_near(closest: &Closest, required: f64, proven: f64) -> String {
    let Closest { time, link, obstacle, distance } = closest;
    let what = named(obstacle);
    if *distance <= 0.0 {
        format!("`{link}` is about {:.3} m deep in {what} at t = {time:.3} s", -distance)
    } else if *distance < required {
        format!("`{link}` comes within {distance:.4} m of {what} at t = {time:.3} s; {required:.4} m required")
    } else {
        format!(
            "clearance of {required:.6} m could not be proven, only {proven:.6} m: \
             `{link}` comes within {distance:.6} m of {what} at t = {time:.3} s"
        )
    }
}

/// Why a tube's clearance does not suffice: where, by how much, and which tolerance has most to do with it.
fn too_wide(closest: &Closest, at: Pose2, required: f64, (width, shares): &(Width, Shares)) -> String {
    let Closest { time, link, obstacle, distance } = closest;
    let (key, most) = shares.most();
    format!(
        "too narrow for the tolerance by {:.4} m at t = {time:.3} s, the base at ({:.2}, {:.2}): {required:.4} m from {what} are required, and `{link}` may come {near}; \
         the robot may be off by {:.4} m and {:.2} degrees there, and `{key}` brings it nearer most, by {most:.4} m",
        required - distance,
        at.x,
        at.y,
        width.distance,
        width.angle.to_degrees(),
        what = named(obstacle),
        near = if *distance > 0.0 { format!("within {distance:.4} m") } else { "into it".to_owned() },
    )
}

fn named(obstacle: &Option<Aabb>) -> String {
    match obstacle {
        None => "unseen space beyond the map".to_owned(),
        Some(Aabb { min: a, max: b }) => format!(
            "the occupied cell [{:.3}, {:.3}] x [{:.3}, {:.3}] x [{:.3}, {:.3}]",
            a[0], b[0], a[1], b[1], a[2], b[2]
        ),
    }
}

/// How far a bounding box is from what lies beyond an edge, m; negative: how far it is in.
pub(super) fn beyond(edge: &Edge, bounds: &Aabb) -> f64 {
    if edge.sign > 0.0 { edge.at - bounds.max[edge.axis] } else { bounds.min[edge.axis] - edge.at }
}

/// Distance of two axis-aligned boxes, m.
pub(super) fn gap(a: &Aabb, b: &Aabb) -> f64 {
    (0..3).map(|i| real::powi((a.min[i] - b.max[i]).max(b.min[i] - a.max[i]).max(0.0), 2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests;
