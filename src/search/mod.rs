//! Stage 6: a drivable path on a lattice over (x, y, yaw, posture).
//!
//! Resolution-complete with one joint or two (with more it moves on a roadmap of sampled postures, `roadmap`, and what it does not find may
//! exist): [`search`] returns a path, or the proof that none exists on the lattice (`lattice`: positions 5 cm
//! apart, 72 headings; `posture`: 64 values of a joint), every move checked exactly against the occupied cells' cubes as a
//! sweep. (\[SCR\] takes a hybrid A* for its initial path; see `astar` for what replaces its fourth dimension.)

mod astar;
mod bits;
mod collide;
mod drive;
mod error;
mod escape;
mod explain;
mod guide;
mod headed;
mod heuristic;
mod joined;
mod joint_space;
mod joints;
mod lattice;
mod obstacles;
mod placed;
mod posture;
mod queue;
mod reaching;
mod region;
mod roadmap;
mod route;
mod shortcut;
mod solve;
mod upright;

use crate::esdf::Esdf;
use crate::geom::Pose2;
use crate::map::VoxelMap;
use crate::math::real;
use crate::robot::RobotModel;

pub use collide::Contact;
pub use error::{Absence, Blocked, SearchError, Tightest};
use posture::Postures;
pub use reaching::{LinkTarget, Placements, placements};
pub use solve::seconds;
use solve::{Guided, NoPath, Problem, Solver};

/// A path on the lattice, joined to the exact start and goal. Between consecutive states the motion is linear in joint
/// space: a spin or a straight drive, joints in proportion.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchPath {
    /// States, start first. Headings are not wrapped: consecutive ones differ by the turn between them.
    pub states: Vec<SearchState>,
    /// `moves[i]` leads from `states[i]` to `states[i + 1]`.
    pub moves: Vec<SearchMove>,
    /// States expanded.
    pub expanded: usize,
}

/// A state on the path.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchState {
    /// Map frame.
    pub pose: Pose2,
    /// One value per moving joint.
    pub joints: Vec<f64>,
}

/// How one state leads to the next.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SearchMove {
    /// The base turns on the spot, or stands while joints move.
    Still,
    /// Straight along the heading.
    Forward,
    /// Straight against the heading.
    Reverse,
}

impl SearchPath {
    /// Distance driven, m.
    pub fn length(&self) -> f64 {
        self.states.windows(2).map(|w| w[0].pose.distance(w[1].pose)).sum()
    }
}

/// Where from and where to.
#[derive(Debug, Clone, PartialEq)]
pub struct Query {
    /// Exact start pose, map frame.
    pub start: Pose2,
    /// Joint values at the start; `None`: any.
    pub start_joints: Vec<Option<f64>>,
    /// Exact goal position; its yaw only where `goal_yaw` says so.
    pub goal: Pose2,
    /// Anywhere so near to that position will do, m; 0: there.
    pub goal_within: f64,
    /// Heading at the goal; `None`: any.
    pub goal_yaw: Option<f64>,
    /// Joint values at the goal; `None`: any.
    pub goal_joints: Vec<Option<f64>>,
}

/// How to search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SearchOptions {
    /// Clearance that every state and move keeps, m.
    pub clearance: f64,
    /// Whether backing up is allowed.
    pub reverse: bool,
}

/// A drivable path from start to goal, each move with at least `options.clearance` metres of clearance. Deterministic.
///
/// # Errors
/// [`SearchError`] says which pose is blocked and by what, or that there is no way at this resolution.
pub fn search(
    map: &VoxelMap,
    esdf: &Esdf,
    robot: &RobotModel,
    query: &Query,
    options: &SearchOptions,
) -> Result<SearchPath, SearchError> {
    let bounds = map.bounds();
    for (which, pose) in [("start", query.start), ("goal", query.goal)] {
        let beyond = |axis: usize, at: f64| (bounds.min[axis] - at).max(at - bounds.max[axis]).max(0.0);
        let beyond = real::hypot(beyond(0, pose.x), beyond(1, pose.y));
        if beyond > if which == "goal" { query.goal_within } else { 0.0 } {
            let [min, max] = [bounds.min, bounds.max];
            return Err(SearchError::OffMap { which, x: pose.x, y: pose.y, bounds: [min[0], max[0], min[1], max[1]] });
        }
    }
    let problem = Problem { map, esdf, robot, query, options };
    if query.goal_within > 0.0
        && let Some(path) = region::path(problem, 0..Postures::levels(robot))
    {
        return Ok(path);
    }
    let levels = Postures::levels(robot);
    for level in 1..levels {
        match quick::<{ posture::FEW_POSTURES / 64 }>(problem, Postures::new(robot, query, level - 1)) {
            Some(Guided { path, sure: true }) => return Ok(path),
            Some(Guided { path, sure: false }) => {
                // With more postures it may get through where it was blocked.
                let more = quick::<{ posture::MOST_POSTURES / 64 }>(problem, Postures::new(robot, query, levels - 1));
                let quicker = more.map(|more| more.path).filter(|more| seconds(robot, more) < seconds(robot, &path));
                return Ok(quicker.unwrap_or(path));
            }
            None => {}
        }
    }
    let postures = Postures::new(robot, query, levels - 1);
    if postures.count() <= 64 {
        solve::<1>(problem, postures)
    } else {
        solve::<{ posture::MOST_POSTURES / 64 }>(problem, postures)
    }
    .map_err(|error| error.of_goal(query))
}

/// Another path than [`search`] finds, by more postures of many joints than it looks at first; `None`: there are no more, or none was found
/// soon.
pub fn with_more_postures(
    map: &VoxelMap,
    esdf: &Esdf,
    robot: &RobotModel,
    query: &Query,
    options: &SearchOptions,
) -> Option<SearchPath> {
    let levels = Postures::levels(robot);
    let problem = Problem { map, esdf, robot, query, options };
    let postures = (levels > 1).then(|| Postures::new(robot, query, levels - 1))?;
    if query.goal_within > 0.0 {
        return region::path(problem, levels - 1..levels);
    }
    quick::<{ posture::MOST_POSTURES / 64 }>(problem, postures).map(|guided| guided.path)
}

/// Another path than [`search`] finds, for a robot with many joints, that keeps out of gaps hardly wider than the robot; `None`: none was
/// found soon.
pub fn with_more_room(
    map: &VoxelMap,
    esdf: &Esdf,
    robot: &RobotModel,
    query: &Query,
    options: &SearchOptions,
) -> Option<SearchPath> {
    if query.goal_within > 0.0 || !has_more_postures(robot) {
        return None;
    }
    let problem = Problem { map, esdf, robot, query, options };
    Solver::<{ posture::FEW_POSTURES / 64 }>::new(problem, Postures::new(robot, query, 0)).ok()?.wide()
}

/// Whether [`with_more_postures`] knows more of a robot than [`search`] looks at first.
pub fn has_more_postures(robot: &RobotModel) -> bool {
    Postures::levels(robot) > 1
}

/// A path with these postures, where one is found soon.
fn quick<const W: usize>(problem: Problem<'_>, postures: Postures) -> Option<Guided> {
    Solver::<W>::new(problem, postures).ok()?.guided()
}

/// Labels that the lattice search may make with a roadmap of postures: it proves nothing, and each takes long.
const MOST_LABELS_OF_A_ROADMAP: usize = 10_000;

fn solve<const W: usize>(problem: Problem<'_>, postures: Postures) -> Result<SearchPath, SearchError> {
    let mut solver = match Solver::<W>::new(problem, postures.clone()) {
        Ok(solver) => solver,
        Err(end) => return Err(explain::blocked::<W>(&problem, postures, end)),
    };
    loop {
        if let Some(guided) = solver.guided() {
            return Ok(guided.path);
        }
        let exhaustive = solver.collider.postures.is_exhaustive();
        let labels = if exhaustive { astar::MOST_LABELS } else { MOST_LABELS_OF_A_ROADMAP };
        let none = match solver.on_the_lattice(labels) {
            Ok(path) => return Ok(path),
            Err(none) => none,
        };
        if !exhaustive {
            return Err(explain::not_found(&solver));
        }
        if !matches!(none, NoPath::Limit { .. }) && solver.let_links_touch() {
            continue;
        }
        return Err(match none {
            NoPath::Exhausted { core_clearances, closest, expanded } => {
                explain::absent(&solver, &core_clearances, closest, expanded)
            }
            NoPath::Marginal { expanded } => SearchError::Marginal { expanded },
            NoPath::Limit { labels } => SearchError::Limit { labels },
        });
    }
}

impl SearchPath {
    /// Appends a state; nothing where it is the last one, and only a longer last move where it goes on in a straight line.
    fn then_to(&mut self, state: SearchState, kind: SearchMove) {
        let last = &self.states[self.states.len() - 1];
        if *last == state {
            return;
        }
        if self.moves.last() == Some(&kind) && self.continues(&state) {
            let end = self.states.len() - 1;
            self.states[end] = state;
            return;
        }
        self.states.push(state);
        self.moves.push(kind);
    }

    /// Whether the last move and the one to `state` are one straight line in joint space.
    fn continues(&self, state: &SearchState) -> bool {
        let [a, b] = [&self.states[self.states.len() - 2], &self.states[self.states.len() - 1]];
        let vector = |p: &SearchState, q: &SearchState| {
            let mut v = vec![q.pose.x - p.pose.x, q.pose.y - p.pose.y, q.pose.yaw - p.pose.yaw];
            v.extend(q.joints.iter().zip(&p.joints).map(|(q, p)| q - p));
            v
        };
        let (u, v) = (vector(a, b), vector(b, state));
        let norm = |v: &[f64]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let (nu, nv) = (norm(&u), norm(&v));
        u.iter().zip(&v).all(|(u, v)| (u / nu - v / nv).abs() < 1e-9)
    }
}

#[cfg(test)]
mod tests;
