//! What a person needs to know of a search that failed: what is in the way, where, in which posture, and how much is missing.

use super::bits::Bits;
use super::collide::{BaseMotion, Collider};
use super::error::{Absence, Blocked, SearchError, Tightest};
use super::heuristic::{self, NEIGHBOURS};
use super::lattice::Lattice;
use super::posture::Postures;
use super::solve::{self, End, NoPath, Problem, Solver};
use super::{Contact, Query, SearchPath, SearchState, region};
use crate::geom::Pose2;
use crate::math::real;
use crate::robot::{Convex, RobotModel};

/// Poses and postures that are looked at for the one that is least blocked.
const MOST_LOOKS: usize = 256;
/// How far from a blocked pose a free one is looked for, m.
const NEARBY: f64 = 1.0;
/// How much thinner the robot is made, beyond having no clearance left, to find where a way would be; m.
const THINNER: f64 = 0.3;
/// Halvings of what is missing: to about a millimetre; with a roadmap, which takes longer, to a centimetre.
const HALVINGS: [usize; 2] = [8, 5];
/// Labels that the lattice search may make for a thinner robot.
const QUICK: usize = 60_000;
/// Labels that it may make for the base alone of a robot with many joints.
const MOST_LABELS_ALONE: usize = 300_000;
/// A path is looked along in steps of this, m and rad.
const STEP: f64 = 0.05;
/// An end is at fault whose space is smaller than this share of the other's.
const SMALL: f64 = 0.25;

/// What blocks an end, in the heading and posture that are blocked least among those that would do.
pub(super) fn blocked<const W: usize>(problem: &Problem<'_>, postures: Postures, end: End) -> SearchError {
    let Problem { map, esdf, robot, query, options } = *problem;
    let collider = Collider::<W>::new(robot, esdf, map, options.clearance, postures);
    let lattice = Lattice::new(map);
    let (pose, joints, headings, places) = match end {
        End::Start => (query.start, &query.start_joints, vec![query.start.yaw], vec![[query.start.x, query.start.y]]),
        End::Goal => {
            (query.goal, &query.goal_joints, solve::goal_headings(query), region::places(query, &lattice).collect())
        }
    };
    let postures: Vec<usize> =
        (0..collider.postures.count()).filter(|p| collider.postures.agrees(*p, end, joints)).collect();
    let stride = (places.len() * headings.len() * postures.len()).div_ceil(MOST_LOOKS).max(1);
    let looks = places.iter().flat_map(|place| {
        let postures = &postures;
        headings.iter().flat_map(move |yaw| postures.iter().map(|p| (Pose2::new(place[0], place[1], *yaw), *p)))
    });
    let seen = looks.step_by(stride).map(|(pose, posture)| {
        let exact: Vec<f64> =
            joints.iter().zip(collider.postures.joints(posture)).map(|(asked, own)| asked.unwrap_or(*own)).collect();
        (collider.contact(pose, &exact), exact)
    });
    let best = seen.max_by(|a, b| a.0.clearance.total_cmp(&b.0.clearance));
    let (contact, exact) = best.unwrap_or_else(|| (collider.contact(pose, &[]), Vec::new()));
    // Only joints that the compiler may choose are news.
    let chosen = named(robot, &exact).into_iter().zip(joints).filter(|(_, asked)| asked.is_none()).map(|(own, _)| own);
    let nearest = nearest_free(&collider, &lattice, pose, &headings, &postures);
    let blocked = Box::new(Blocked { contact, clearance: options.clearance, posture: chosen.collect(), nearest });
    match end {
        End::Start => SearchError::StartBlocked(blocked),
        End::Goal => SearchError::GoalBlocked(blocked),
    }
}

/// Why no way was found with a roadmap of postures: that there is none even for the base alone, or just that none was found.
pub(super) fn not_found<const W: usize>(solver: &Solver<'_, W>) -> SearchError {
    let Problem { robot, query, .. } = solver.problem;
    let mut base = robot.clone();
    base.shapes.retain(|shape| !robot.is_moved(shape.body));
    base.joints.clear();
    base.bodies.iter_mut().for_each(|body| body.motion = None);
    let query = Query { start_joints: Vec::new(), goal_joints: Vec::new(), ..query.clone() };
    let problem = Problem { robot: &base, query: &query, ..solver.problem };
    let sampled = || SearchError::Sampled {
        postures: solver.collider.postures.count(),
        tightest: tightest(solver).map(Box::new),
    };
    let Ok(alone) = Solver::<1>::new(problem, Postures::new(&base, &query, 0)) else { return sampled() };
    match alone.guided().map_or_else(|| alone.on_the_lattice(MOST_LABELS_ALONE), |guided| Ok(guided.path)) {
        Err(NoPath::Exhausted { core_clearances, closest, expanded }) => {
            absent(&alone, &core_clearances, closest, expanded)
        }
        _ => sampled(),
    }
}

/// The nearest lattice position where one of the postures is free, in the first heading that is.
fn nearest_free<const W: usize>(
    collider: &Collider<'_, W>,
    lattice: &Lattice,
    pose: Pose2,
    headings: &[f64],
    postures: &[usize],
) -> Option<Pose2> {
    let at = lattice.coordinates(pose.x, pose.y);
    let reach = NEARBY / lattice.step;
    let range = |d: usize| (at[d] - reach).ceil() as i32..=(at[d] + reach).floor() as i32;
    let around = range(0).flat_map(|i| range(1).map(move |j| (i, j))).filter(|(i, j)| lattice.contains(*i, *j));
    let mut around: Vec<(f64, [f64; 2])> = around
        .map(|(i, j)| {
            let place = lattice.position(i, j);
            (real::hypot(place[0] - pose.x, place[1] - pose.y), place)
        })
        .collect();
    around.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut wanted = Bits::EMPTY;
    postures.iter().for_each(|p| wanted.insert(*p));
    let poses = around.iter().flat_map(|(_, [x, y])| headings.iter().map(|yaw| Pose2::new(*x, *y, *yaw)));
    poses.into_iter().find(|pose| !collider.free(&BaseMotion { from: *pose, to: *pose }).and(wanted).is_empty())
}

/// The proof that there is no way, and how near it is to one. `closest`: the reached pose nearest to the goal.
pub(super) fn absent<const W: usize>(
    solver: &Solver<'_, W>,
    core_clearances: &[f32],
    closest: Pose2,
    expanded: usize,
) -> SearchError {
    let Problem { map, query, options, .. } = solver.problem;
    let (lattice, core) = (&solver.lattice, solver.core);
    // Of a region the place with the most room.
    let room = |at: &[f64; 2]| {
        let [i, j] = lattice.coordinates(at[0], at[1]).map(|v| v.round() as i32);
        if lattice.contains(i, j) { core_clearances[lattice.index(i, j)] } else { f32::NEG_INFINITY }
    };
    let roomiest = region::places(query, lattice).max_by(|a, b| room(a).total_cmp(&room(b)));
    let [x, y] = roomiest.filter(|_| query.goal_within > 0.0).unwrap_or([query.goal.x, query.goal.y]);
    let goal = Pose2::new(x, y, query.goal_yaw.unwrap_or(0.0));
    let ends = [query.start, goal].map(|pose| core.centre(pose));
    let narrowest = heuristic::bottleneck(lattice, core_clearances, core.radius, ends[0], ends[1]);
    let least = heuristic::least_clearance(lattice, map.resolution, options.clearance);
    let spaces = ends.map(|from| Space::around(lattice, core_clearances, least, from, ends[1]));
    let apart = !spaces[0].holds_target;
    let closest = if expanded == 0 && apart {
        let [x, y] = spaces[0].nearest;
        Pose2::new(x, y, query.start.yaw)
    } else {
        closest
    };
    let tightest = tightest(solver);
    let near = |pose: Pose2| tightest.as_ref().is_some_and(|t| t.pose.distance(pose) < solver.collider.reach);
    let small = |a: usize, b: usize| apart && spaces[a].area < SMALL * spaces[b].area;
    let at_fault = if small(0, 1) || !apart && (expanded == 0 || near(query.start)) {
        Some("start")
    } else if small(1, 0) || !apart && near(query.goal) {
        Some("goal")
    } else {
        None
    };
    let core = core.radius + options.clearance;
    let to_goal = (closest.distance(query.goal) - query.goal_within).max(0.0);
    SearchError::Exhausted(Box::new(Absence { expanded, closest, to_goal, at_fault, narrowest, core, tightest }))
}

/// Where the base's disc gets to from a point.
struct Space {
    /// m^2.
    area: f64,
    /// Its position nearest to the target.
    nearest: [f64; 2],
    holds_target: bool,
}

impl Space {
    fn around(lattice: &Lattice, clearances: &[f32], least: f32, from: [f64; 2], target: [f64; 2]) -> Self {
        let cell = |p: [f64; 2]| lattice.coordinates(p[0], p[1]).map(|v| v.round() as i32);
        let (first, last) = (cell(from), cell(target));
        let mut seen = vec![false; clearances.len()];
        let mut open = vec![(first[0], first[1])];
        open.retain(|(i, j)| lattice.contains(*i, *j));
        open.iter().for_each(|(i, j)| seen[lattice.index(*i, *j)] = true);
        let (mut count, mut nearest, mut holds_target) = (0usize, (f64::INFINITY, from), false);
        while let Some((i, j)) = open.pop() {
            count += 1;
            let [x, y] = lattice.position(i, j);
            let distance = real::hypot(x - target[0], y - target[1]);
            if distance < nearest.0 {
                nearest = (distance, [x, y]);
            }
            holds_target |= [i, j] == last;
            for (di, dj, _) in NEIGHBOURS {
                let (i, j) = (i + di, j + dj);
                if lattice.contains(i, j) && clearances[lattice.index(i, j)] >= least && !seen[lattice.index(i, j)] {
                    seen[lattice.index(i, j)] = true;
                    open.push((i, j));
                }
            }
        }
        Self { area: count as f64 * lattice.step * lattice.step, nearest: nearest.1, holds_target }
    }
}

/// Where the robot gets stuck on the way that a slightly thinner one takes: the clearance is lowered, then the shapes are made
/// smaller, as little as lets a quick search find a way. `None`: even a much thinner one finds none.
fn tightest<const W: usize>(solver: &Solver<'_, W>) -> Option<Tightest> {
    let clearance = solver.problem.options.clearance;
    let (mut too_little, mut enough) = (0.0, clearance + THINNER);
    let mut path = way_with_less(solver, enough)?;
    for _ in 0..HALVINGS[usize::from(!solver.collider.postures.is_exhaustive())] {
        let less = 0.5 * (too_little + enough);
        match way_with_less(solver, less) {
            Some(better) => (path, enough) = (better, less),
            None => too_little = less,
        }
    }
    let mut worst: Option<(Contact, SearchState)> = None;
    for state in states_along(&path) {
        let contact = solver.collider.contact(state.pose, &state.joints);
        if worst.as_ref().is_none_or(|(least, _)| contact.clearance < least.clearance) {
            worst = Some((contact, state));
        }
    }
    let (contact, state) = worst.filter(|(contact, _)| contact.clearance < clearance)?;
    let posture = named(solver.problem.robot, &state.joints);
    Some(Tightest { pose: state.pose, posture, contact, clearance })
}

/// A way for a robot that needs so much less room on every side, m.
fn way_with_less<const W: usize>(solver: &Solver<'_, W>, less: f64) -> Option<SearchPath> {
    let problem = solver.problem;
    let mut options = *problem.options;
    options.clearance = (options.clearance - less).max(0.0);
    let robot = thinner(problem.robot, less - problem.options.clearance);
    let problem = Problem { robot: &robot, options: &options, ..problem };
    let exhaustive = solver.collider.postures.is_exhaustive();
    let solver = Solver::<W>::new(problem, solver.collider.postures.clone()).ok()?;
    let guided = solver.guided().map(|guided| guided.path);
    // With a roadmap that takes seconds.
    let lattice = || if exhaustive { solver.on_the_lattice(QUICK).ok() } else { None };
    guided.or_else(lattice)
}

/// The robot with every shape's surface so much farther in, m; for hulls about so much.
fn thinner(robot: &RobotModel, by: f64) -> RobotModel {
    const LEAST: f64 = 1e-3;
    let mut robot = robot.clone();
    if by <= 0.0 {
        return robot;
    }
    let less = |v: &mut f64| *v = (*v - by).max(LEAST.min(*v));
    for shape in &mut robot.shapes {
        let half = shape.convex.half_extents();
        match &mut shape.convex {
            Convex::Box { half } => half.iter_mut().for_each(less),
            Convex::Sphere { radius } => less(radius),
            Convex::Cylinder { radius, half_length } => [radius, half_length].into_iter().for_each(less),
            Convex::Hull { vertices } => {
                let inner = half.iter().copied().fold(f64::INFINITY, f64::min);
                let scale = (1.0 - by / inner).max(LEAST);
                vertices.iter_mut().flatten().for_each(|v| *v *= scale);
            }
        }
    }
    robot
}

/// A path's states and those between, close together.
fn states_along(path: &SearchPath) -> impl Iterator<Item = SearchState> + '_ {
    path.states.windows(2).flat_map(|pair| {
        let [a, b] = [&pair[0], &pair[1]];
        let joints = a.joints.iter().zip(&b.joints).map(|(p, q)| (p - q).abs()).fold(0.0, f64::max);
        let far = a.pose.distance(b.pose).max((a.pose.yaw - b.pose.yaw).abs()).max(joints);
        let parts = (far / STEP).ceil().max(1.0) as usize;
        (0..=parts).map(move |k| {
            let share = k as f64 / parts as f64;
            let mix = |p: f64, q: f64| p + share * (q - p);
            SearchState {
                pose: Pose2::new(mix(a.pose.x, b.pose.x), mix(a.pose.y, b.pose.y), mix(a.pose.yaw, b.pose.yaw)),
                joints: a.joints.iter().zip(&b.joints).map(|(p, q)| mix(*p, *q)).collect(),
            }
        })
    })
}

fn named(robot: &RobotModel, joints: &[f64]) -> Vec<(String, f64)> {
    robot.joints.iter().map(|j| j.name.clone()).zip(joints.iter().copied()).collect()
}
