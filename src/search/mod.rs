//! Stage 6: a drivable path on a lattice over (x, y, yaw, posture).
//!
//! Resolution-complete: [`search`] returns a path, or the proof that none exists on the lattice (`lattice`: positions 5 cm
//! apart, 72 headings; `posture`: 64 values of a joint), every move checked exactly against the occupied cells' cubes as a
//! sweep. (\[SCR\] takes a hybrid A* for its initial path; see `astar` for what replaces its fourth dimension.)

mod astar;
mod collide;
mod drive;
mod error;
mod guide;
mod heuristic;
mod joints;
mod lattice;
mod obstacles;
mod placed;
mod posture;
mod queue;
mod route;
mod shortcut;

use crate::esdf::Esdf;
use crate::geom::{Pose2, wrap_angle};
use crate::map::VoxelMap;
use crate::robot::RobotModel;

pub use collide::Contact;
use collide::{BaseMotion, Collider};
pub use error::SearchError;
use lattice::Lattice;
use posture::{Bits, PostureGrid};
use route::Grain;
use shortcut::Shortcutter;

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

/// Sweeps that are cut differently may differ by this in what they find clear, m: bulges of turns and bounds of distances.
const CHECK_TOLERANCE: f64 = 1e-3;

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
    let near: Vec<f64> =
        query.start_joints.iter().zip(&robot.joints).map(|(q, j)| q.unwrap_or(0f64.clamp(j.lower, j.upper))).collect();
    let grid = PostureGrid::new(robot, &near);
    if grid.count() <= 64 {
        search_postures::<1>(map, esdf, robot, query, options, grid)
    } else {
        search_postures::<{ posture::MOST_POSTURES / 64 }>(map, esdf, robot, query, options, grid)
    }
}

fn search_postures<const W: usize>(
    map: &VoxelMap,
    esdf: &Esdf,
    robot: &RobotModel,
    query: &Query,
    options: &SearchOptions,
    grid: PostureGrid,
) -> Result<SearchPath, SearchError> {
    let collider = Collider::<W>::new(robot, esdf, map, options.clearance, grid);
    let bounds = map.bounds();
    for (which, pose) in [("start", query.start), ("goal", query.goal)] {
        let inside =
            (bounds.min[0]..=bounds.max[0]).contains(&pose.x) && (bounds.min[1]..=bounds.max[1]).contains(&pose.y);
        if !inside {
            let [min, max] = [bounds.min, bounds.max];
            return Err(SearchError::OffMap { which, x: pose.x, y: pose.y, bounds: [min[0], max[0], min[1], max[1]] });
        }
    }
    let clearance = options.clearance;
    let start_postures = free_postures(&collider, query.start, &query.start_joints)
        .map_err(|contact| SearchError::StartBlocked { contact, clearance })?;
    let goal_postures =
        goal_postures(&collider, query).map_err(|contact| SearchError::GoalBlocked { contact, clearance })?;

    let finish = |route: &route::Route, grain, collider: &Collider<'_, W>, expanded| {
        let open_end = query.goal_yaw.is_none();
        let shortcutter = Shortcutter::new(collider, [start_postures, goal_postures], open_end, grain);
        let checked = shortcutter.shorten(shortcutter.check(route.clone())?);
        let pieces = checked.route.pieces(grain);
        Ok(with_joints(collider, robot, query, &checked, &pieces, [start_postures, goal_postures], expanded))
    };
    for route in astar::straight_to_goal(query, options) {
        if let Ok(path) = finish(&route, Grain::COARSE, &collider, 0) {
            return Ok(path);
        }
    }
    let lattice = Lattice::new(map);
    let core = heuristic::Core::new(robot);
    let slack = core.offset[0].hypot(core.offset[1]);
    let guess = |place| core.guessed_clearance(esdf, place);
    let mut guide = guide::Guide::new(lattice.clone(), guess, clearance - slack);
    for attempt in 0..guide::TRIES {
        let Some(route) = guide.route(query, options, attempt) else { break };
        let grain = if attempt == 0 { Grain::COARSE } else { Grain { drive: 0.1, turn: 0.15 } };
        match finish(&route, grain, &collider, 0) {
            Ok(path) => return Ok(path),
            Err(place) => guide.avoid(place),
        }
    }
    let core_clearances = heuristic::core_clearance(&lattice, map, &core);
    let goal = query.goal;
    let cost_to_go =
        heuristic::CostToGo::new(&lattice, (core, &core_clearances), map.resolution, clearance, goal, query.goal_yaw);
    let mut expanded_before = 0;
    for strict in [false, true] {
        let astar = astar::AStar {
            lattice: &lattice,
            collider: &collider,
            cost_to_go: &cost_to_go,
            core_clearances: &core_clearances,
            strict,
            query,
            options,
            start_postures,
            goal_postures,
        };
        let (route, expanded) = match astar.search() {
            astar::Outcome::Found { route, expanded } => (route, expanded + expanded_before),
            astar::Outcome::Limit { labels } => return Err(SearchError::Limit { labels }),
            astar::Outcome::Exhausted { closest, expanded } => {
                let ends =
                    [query.start, Pose2 { yaw: query.goal_yaw.unwrap_or(0.0), ..goal }].map(|pose| core.centre(pose));
                let narrowest = heuristic::bottleneck(&lattice, &core_clearances, core.radius, ends[0], ends[1]);
                let expanded = expanded + expanded_before;
                return Err(SearchError::Exhausted { expanded, closest, narrowest, core: core.radius + clearance });
            }
        };
        expanded_before = expanded;
        if let Ok(path) = finish(&route, Grain::COARSE, &collider, expanded) {
            return Ok(path);
        }
        // At the lattice's own grain whatever the search got through passes, but for the tolerance of the checks.
        let lenient =
            Collider::<W>::new(robot, esdf, map, (clearance - CHECK_TOLERANCE).max(0.0), collider.grid.clone());
        if let Ok(path) = finish(&route, Grain::FINE, &lenient, expanded) {
            return Ok(path);
        }
    }
    // The fine check asks no more than the strict search did, but for the tolerance of the checks.
    Err(SearchError::Marginal { expanded: expanded_before })
}

/// Postures that are free in a pose and agree with what is asked for; else what is in the way of the posture asked for.
fn free_postures<const W: usize>(
    collider: &Collider<'_, W>,
    pose: Pose2,
    joints: &[Option<f64>],
) -> Result<Bits<W>, Contact> {
    let mut wanted = collider.free(&BaseMotion { from: pose, to: pose });
    let asked = asked_posture(&collider.grid, joints);
    let free = wanted;
    for p in free.iter() {
        if !agrees(&collider.grid, p, joints) {
            wanted.remove(p);
        }
    }
    if wanted.is_empty() { Err(collider.contact(pose, &asked)) } else { Ok(wanted) }
}

/// The posture with the values asked for; where none is asked for, the middle of the range.
fn asked_posture(grid: &PostureGrid, joints: &[Option<f64>]) -> Vec<f64> {
    let middle = grid.joints(grid.count() / 2);
    joints.iter().zip(middle).map(|(asked, middle)| asked.unwrap_or(middle)).collect()
}

/// Whether a sampled posture is the nearest one to what is asked for.
fn agrees(grid: &PostureGrid, posture: usize, joints: &[Option<f64>]) -> bool {
    let own = grid.joints(posture);
    let wanted: Vec<f64> = joints.iter().zip(&own).map(|(asked, own)| asked.unwrap_or(*own)).collect();
    grid.nearest(&wanted) == posture
}

/// Postures free at the goal, in any heading that will do.
fn goal_postures<const W: usize>(collider: &Collider<'_, W>, query: &Query) -> Result<Bits<W>, Contact> {
    if let Some(yaw) = query.goal_yaw {
        return free_postures(collider, Pose2 { yaw, ..query.goal }, &query.goal_joints);
    }
    let mut all = Bits::EMPTY;
    let mut blocked = None;
    for heading in 0..lattice::HEADINGS as i32 {
        match free_postures(collider, Pose2 { yaw: lattice::heading_angle(heading), ..query.goal }, &query.goal_joints)
        {
            Ok(postures) => all = all.or(postures),
            Err(contact) => blocked = Some(contact),
        }
    }
    match blocked {
        Some(contact) if all.is_empty() => Err(contact),
        _ => Ok(all),
    }
}

/// The route with the joints' path: states after each piece, those that only continue the one before left out.
fn with_joints<const W: usize>(
    collider: &Collider<'_, W>,
    robot: &RobotModel,
    query: &Query,
    checked: &shortcut::CheckedRoute<W>,
    pieces: &[BaseMotion],
    [start_postures, goal_postures]: [Bits<W>; 2],
    expanded: usize,
) -> SearchPath {
    let masks = checked.masks();
    let rates: Vec<usize> = pieces.iter().map(|piece| steps_in_time(robot, &collider.grid, piece)).collect();
    let postures =
        joints::choose(&collider.neighbours, collider.grid.count(), &masks, &rates, start_postures, goal_postures)
            .expect("the checked route passes postures from start to goal");
    let exact = |asked: &[Option<f64>], posture: usize| -> Vec<f64> {
        asked.iter().zip(collider.grid.joints(posture)).map(|(a, own)| a.unwrap_or(own)).collect()
    };
    let first = postures[0];
    let mut path = SearchPath {
        states: vec![SearchState { pose: query.start, joints: exact(&query.start_joints, first) }],
        moves: Vec::new(),
        expanded,
    };
    path.then_to(SearchState { pose: query.start, joints: collider.grid.joints(first) }, SearchMove::Still);
    let drive_reverse = reverse_of_pieces(&checked.route, pieces);
    for (k, piece) in pieces.iter().enumerate() {
        let kind = match drive_reverse[k] {
            None => SearchMove::Still,
            Some(false) => SearchMove::Forward,
            Some(true) => SearchMove::Reverse,
        };
        path.then_to(SearchState { pose: piece.to, joints: collider.grid.joints(postures[k + 1]) }, kind);
    }
    let last = postures[postures.len() - 1];
    let end = path.states[path.states.len() - 1].pose;
    let yaw = query.goal_yaw.map_or(end.yaw, |yaw| end.yaw + wrap_angle(yaw - end.yaw));
    let end = Pose2 { yaw, x: query.goal.x, y: query.goal.y };
    path.states.last_mut().expect("never empty").pose = end;
    path.then_to(SearchState { pose: end, joints: exact(&query.goal_joints, last) }, SearchMove::Still);
    if path.moves.is_empty() {
        let only = path.states[0].clone();
        path.states.push(only);
        path.moves.push(SearchMove::Still);
    }
    path
}

/// Per piece: `None` for a turn, else whether it backs up.
fn reverse_of_pieces(route: &route::Route, pieces: &[BaseMotion]) -> Vec<Option<bool>> {
    let mut drive = 0;
    let mut out = Vec::with_capacity(pieces.len());
    for piece in pieces {
        let driving = piece.from.distance(piece.to) > 0.0;
        // A drive of no length only keeps two turns apart.
        while driving && route.corners[drive] == route.corners[drive + 1] {
            drive += 1;
        }
        out.push(driving.then(|| route.reverse[drive]));
        if driving && route.corners[drive + 1] == [piece.to.x, piece.to.y] {
            drive += 1;
        }
    }
    out
}

/// Posture steps that there is time for while the base goes through a piece.
fn steps_in_time(robot: &RobotModel, grid: &PostureGrid, piece: &BaseMotion) -> usize {
    let time = piece.from.distance(piece.to) / robot.base.speed
        + (piece.to.yaw - piece.from.yaw).abs() / robot.base.angular_speed.max(1e-6);
    let steps = robot.joints.iter().enumerate().map(|(m, joint)| {
        let step = grid.step(m);
        if step > 0.0 { 0.7 * joint.limits.planning()[0] * time / step } else { f64::INFINITY }
    });
    steps.fold(f64::INFINITY, f64::min).min(1024.0) as usize
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
