//! The tries, one after the other: straight, along the ways that count turns, along the guide's, and over the whole lattice.

use super::astar::{self, AStar, Outcome};
use super::bits::Bits;
use super::collide::{BaseMotion, Collider, Mast, TOO_LOW};
use super::escape::Escape;
use super::guide::{self, Fits, Guide};
use super::headed::{self, Headed};
use super::heuristic::{self, Core, CostToGo};
use super::joined::with_joints;
use super::lattice::{self, Lattice};
use super::posture::{Postures, WayOut};
use super::route::{Grain, Route};
use super::shortcut::Shortcutter;
use super::upright::Upright;
use super::{Query, SearchOptions, SearchPath, region};
use crate::esdf::Esdf;
use crate::geom::Pose2;
use crate::map::VoxelMap;
use crate::math::real;
use crate::robot::RobotModel;

/// Sweeps that are cut differently may differ by this in what they find clear, m: bulges of turns and bounds of distances.
const CHECK_TOLERANCE: f64 = 1e-3;

/// A way that counts turns is taken as it is where fewer were blocked before it.
const SURE: usize = 2;
/// A turn is never worth less or more than this, m a radian: whatever a robot's limits, no way wiggles, nor goes far to save a bend.
const LEAST_TURN_COST: f64 = 0.1;
const MOST_TURN_COST: f64 = 3.0;

/// A clearance about a position, m.
type Guess<'a> = Box<dyn Fn([f64; 2]) -> f64 + 'a>;

/// What is searched.
#[derive(Clone, Copy)]
pub(super) struct Problem<'a> {
    pub map: &'a VoxelMap,
    pub esdf: &'a Esdf,
    pub robot: &'a RobotModel,
    pub query: &'a Query,
    pub options: &'a SearchOptions,
}

/// An end of the way.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    Start,
    Goal,
}

/// A path that was found without searching the lattice.
pub(super) struct Guided {
    pub path: SearchPath,
    /// It is not one that may go a long way round because others were blocked.
    pub sure: bool,
}

/// A way through the middle of the free space.
struct Middle {
    path: SearchPath,
    /// What the first one takes that was tried, with all its corners, s.
    wanted: f64,
}

/// How the lattice search ended without a path.
pub(super) enum NoPath {
    /// All that can be reached was looked at.
    Exhausted {
        /// Of the base's core at each lattice position, m.
        core_clearances: Vec<f32>,
        /// The reached pose nearest to the goal.
        closest: Pose2,
        expanded: usize,
    },
    /// What was found does not pass the last check.
    Marginal { expanded: usize },
    /// As many labels were made as may be.
    Limit { labels: usize },
}

/// A problem whose start and goal are free.
pub(super) struct Solver<'a, const W: usize> {
    pub problem: Problem<'a>,
    pub collider: Collider<'a, W>,
    pub lattice: Lattice,
    pub core: Core,
    start_postures: Bits<W>,
    goal_postures: Bits<W>,
    /// Postures left out because links of the robot touch in them.
    touching: Bits<W>,
}

impl<'a, const W: usize> Solver<'a, W> {
    /// # Errors
    /// The end that is blocked.
    pub fn new(problem: Problem<'a>, postures: Postures) -> Result<Self, End> {
        let Problem { map, esdf, robot, query, options } = problem;
        let mut collider = Collider::<W>::new(robot, esdf, map, options.clearance, postures);
        for (end, pose) in [(End::Start, query.start), (End::Goal, query.goal)] {
            if let Some(more) = with_way_out(&collider, end, pose, query) {
                collider = Collider::<W>::new(robot, esdf, map, options.clearance, more);
            }
        }
        let mut start_postures =
            free_postures(&collider, query.start, End::Start, &query.start_joints).ok_or(End::Start)?;
        let lattice = Lattice::new(map);
        let mut goal_postures = if query.goal_within > 0.0 {
            region::postures(&collider, &lattice, query)
        } else {
            goal_postures(&collider, query)
        }
        .ok_or(End::Goal)?;
        // Where an end leaves no other choice, samples in which links touch stay: the exact joint values may be apart.
        let mut touching = collider.touching();
        for postures in [&mut start_postures, &mut goal_postures] {
            match postures.minus(touching) {
                apart if apart.is_empty() => touching = touching.minus(*postures),
                apart => *postures = apart,
            }
        }
        collider.only(collider.all().minus(touching));
        let core = Core::new(robot);
        Ok(Self { problem, collider, lattice, core, start_postures, goal_postures, touching })
    }

    /// Takes the postures in which links touch back in; whether there were any. What comes of it the certificate judges, which names the
    /// links where a search could only say that there is no way.
    pub fn let_links_touch(&mut self) -> bool {
        self.collider.only(self.collider.all().or(self.touching));
        !std::mem::replace(&mut self.touching, Bits::EMPTY).is_empty()
    }

    /// The first that passes of the straight ways, those that count turns, and the guide's; of a robot that can fold up the quickest of
    /// several. None proves nothing.
    pub fn guided(&self) -> Option<Guided> {
        let Problem { robot, query, options, .. } = self.problem;
        // Its places are tried one by one, by `region`.
        if query.goal_within > 0.0 {
            return None;
        }
        for route in astar::straight_to_goal(query, options) {
            if let Ok(path) = self.finish(&route, Grain::COARSE, &self.collider, 0) {
                return Some(Guided { path, sure: true });
            }
        }
        if self.collider.postures.folded().is_some() {
            return self.quickest();
        }
        let sure = |path| Guided { path, sure: true };
        // What backing up may save is left to the others, and so are robots that must fold: it knows nothing of postures, and with
        // two blades between arches its ways were blocked so often that they took longer to find and were no faster.
        let counts_turns = !options.reverse && robot.joints.is_empty();
        match if counts_turns { self.headed(turn_cost(robot)) } else { None } {
            Some((path, attempt)) if attempt < SURE => Some(sure(path)),
            // What was blocked so often may have gone a long way round.
            Some((path, _)) => {
                let better = self.through_the_middle(true).map(|middle| middle.path);
                let better = better.filter(|other| self.estimate(other) < self.estimate(&path));
                Some(sure(better.unwrap_or(path)))
            }
            None => self.through_the_middle(true).map(|middle| sure(middle.path)),
        }
    }

    /// The quickest of the first ways that pass: the guide's, one that counts turns, and, where the guide's first was blocked and what was
    /// found takes longer than it would have, one that keeps out of narrow gaps, which may be blocked by what the robot carries.
    fn quickest(&self) -> Option<Guided> {
        let Problem { robot, options, .. } = self.problem;
        let quicker = |a: Option<SearchPath>, b: Option<SearchPath>| {
            a.into_iter().chain(b).min_by(|a, b| seconds(robot, a).total_cmp(&seconds(robot, b)))
        };
        let middle = self.through_the_middle(true);
        let wanted = middle.as_ref().map_or(f64::INFINITY, |middle| middle.wanted);
        let headed = if options.reverse { None } else { self.headed(standing_turn_cost(robot)) };
        let mut best = quicker(middle.map(|middle| middle.path), headed.map(|(path, _)| path));
        let sure = |best: &Option<SearchPath>| best.as_ref().is_some_and(|path| seconds(robot, path) <= wanted);
        if !sure(&best) {
            best = quicker(best, self.wide());
        }
        let sure = sure(&best);
        best.map(|path| Guided { path, sure })
    }

    /// The guide's first way that passes and keeps out of gaps whose middle lies between positions of the lattice.
    pub fn wide(&self) -> Option<SearchPath> {
        self.through_the_middle(false).map(|middle| middle.path)
    }

    /// What a path takes, as metres of straight driving.
    fn estimate(&self, path: &SearchPath) -> f64 {
        path.length() + turn_cost(self.problem.robot) * turned(path)
    }

    /// The clearance of the base's core about a position, and the least with which the base may pass there, m. So is that of
    /// what no joint moves.
    fn guessed_clearance(&self) -> (impl Fn([f64; 2]) -> f64 + 'a, f64) {
        let Problem { map, esdf, options, .. } = self.problem;
        let core = self.core;
        // The field may say too little by so much: nothing that fits is shut out.
        let slack = TOO_LOW * map.resolution;
        let [x, y] = core.offset;
        let least = options.clearance - real::hypot(x, y);
        let masts = self.collider.masts();
        let guess = move |[x, y]: [f64; 2]| {
            let own = core.guessed_clearance(esdf, [x, y]);
            let off = |mast: &Mast| real::hypot(mast.centre.x, mast.centre.y);
            let of_mast = |mast: &Mast| {
                slack + esdf.distance([x, y, mast.centre.z]) - mast.radius + off(mast) + least - options.clearance
            };
            masts.iter().map(of_mast).fold(own, f64::min)
        };
        (guess, least)
    }

    /// The cheapest way of metres and turns, as often as it is worth a try, and after how many that were blocked.
    fn headed(&self, turn_cost: f64) -> Option<(SearchPath, usize)> {
        let Problem { map, query, .. } = self.problem;
        let (guess, least) = self.guessed_clearance();
        let bounds = map.bounds();
        let area = [bounds.min, bounds.max].map(|corner| [corner[0], corner[1]]);
        let mut headed = Headed::new(query, guess, least, area, turn_cost);
        for attempt in 0..headed::TRIES {
            let route = headed.route(attempt)?;
            match self.finish(&route, grain_of_try(attempt), &self.collider, 0) {
                Ok(path) => return Some((path, attempt)),
                Err(places) => places.into_iter().for_each(|place| headed.avoid(place)),
            }
        }
        None
    }

    /// The way through the middle of the free space, as often as it is worth a try. Of a robot that can fold up also that of the
    /// folded one: the first leads where the base gets through, the second where most of what it carries does.
    /// `narrow`: also where that lies between positions of the lattice.
    fn through_the_middle(&self, narrow: bool) -> Option<Middle> {
        let Problem { robot, query, options, .. } = self.problem;
        let mut wanted = None;
        let (guess, least) = self.guessed_clearance();
        let fits = |posture| if narrow { self.fits(posture) } else { Box::new(|_| false) };
        let mut guides = vec![Guide::new(&self.lattice, Box::new(guess) as Guess<'a>, fits(None), least)];
        if let Some(posture) = self.collider.postures.folded() {
            guides.push(Guide::new(&self.lattice, self.clearance_folded(posture), fits(Some(posture)), least));
        }
        for attempt in 0..guide::tries(query) {
            for which in 0..guides.len() {
                let Some(routes) = guides[which].routes(query, options, attempt) else {
                    if which == 0 {
                        return None;
                    }
                    guides.truncate(which);
                    break;
                };
                let wanted = *wanted.get_or_insert(routes[0].cost(standing_turn_cost(robot), 1.0) / robot.base.speed);
                let mut blocked = Vec::new();
                for route in &routes {
                    match self.finish(route, grain_of_try(attempt), &self.collider, 0) {
                        Ok(path) => return Some(Middle { path, wanted }),
                        Err(places) => blocked = places,
                    }
                }
                blocked.into_iter().for_each(|place| guides[which].avoid(place));
            }
        }
        None
    }

    /// Whether the base's core, and an upright cylinder that holds all that moves in a posture, keep their clearance with the base at a
    /// position, exactly.
    fn fits(&self, posture: Option<usize>) -> Fits<'a> {
        let Problem { map, options, .. } = self.problem;
        let [x, y] = self.core.offset;
        let radius = self.core.radius + options.clearance - real::hypot(x, y);
        let core = Upright { radius, heights: self.core.heights };
        let column = posture.map(|posture| {
            let (radius, heights) = self.collider.column(posture);
            Upright { radius: radius + options.clearance, heights }
        });
        Box::new(move |place| core.fits(map, place) && column.as_ref().is_none_or(|column| column.fits(map, place)))
    }

    /// The clearance of an upright cylinder that holds all that moves in a posture, and of the core, about a position, m.
    fn clearance_folded(&self, posture: usize) -> Guess<'a> {
        let esdf = self.problem.esdf;
        let (own, least) = self.guessed_clearance();
        let (radius, [low, high]) = self.collider.column(posture);
        let beyond = least - self.problem.options.clearance;
        Box::new(move |[x, y]| {
            let (distance, _) = esdf.least_above([x, y, low], high - low);
            own([x, y]).min(distance - radius + beyond)
        })
    }

    /// A path by the lattice search, or the proof that there is none, or neither after so many labels.
    ///
    /// # Errors
    /// Why there is none.
    pub fn on_the_lattice(&self, most_labels: usize) -> Result<SearchPath, NoPath> {
        let Problem { map, esdf, robot, query, options } = self.problem;
        let (lattice, core, clearance) = (&self.lattice, self.core, options.clearance);
        let core_clearances = heuristic::core_clearance(lattice, map, &core);
        let of_core = (core, &core_clearances[..]);
        let cost_to_go = CostToGo::new(lattice, of_core, map.resolution, clearance, query);
        let mut expanded_before = 0;
        for strict in [false, true] {
            let astar = AStar {
                lattice,
                collider: &self.collider,
                cost_to_go: &cost_to_go,
                core_clearances: &core_clearances,
                strict,
                query,
                options,
                most_labels,
                start_postures: self.start_postures,
                goal_postures: self.goal_postures,
            };
            let (route, expanded) = match astar.search() {
                Outcome::Found { route, expanded } => (route, expanded + expanded_before),
                Outcome::Limit { labels } => return Err(NoPath::Limit { labels }),
                Outcome::Exhausted { closest, expanded } => {
                    let expanded = expanded + expanded_before;
                    return Err(NoPath::Exhausted { core_clearances, closest, expanded });
                }
            };
            expanded_before = expanded;
            if let Ok(path) = self.finish(&route, Grain::COARSE, &self.collider, expanded) {
                return Ok(path);
            }
            // At the lattice's own grain whatever the search got through passes, but for the tolerance of the checks.
            let lenient = (clearance - CHECK_TOLERANCE).max(0.0);
            let mut lenient = Collider::<W>::new(robot, esdf, map, lenient, self.collider.postures.clone());
            lenient.only(self.collider.all());
            if let Ok(path) = self.finish(&route, Grain::FINE, &lenient, expanded) {
                return Ok(path);
            }
        }
        // The fine check asks no more than the strict search did, but for the tolerance of the checks.
        Err(NoPath::Marginal { expanded: expanded_before })
    }

    /// The route checked, shortened and with its joints.
    ///
    /// # Errors
    /// About where it is blocked, all along.
    fn finish(
        &self,
        route: &Route,
        grain: Grain,
        collider: &Collider<'_, W>,
        expanded: usize,
    ) -> Result<SearchPath, Vec<[f64; 2]>> {
        let open_end = self.problem.query.goal_yaw.is_none();
        let ends = [self.start_postures, self.goal_postures];
        let shortcutter = Shortcutter::new(collider, ends, open_end, grain, turn_cost(self.problem.robot));
        let checked = shortcutter.shorten(shortcutter.check(route.clone())?);
        let pieces = checked.route.pieces(grain);
        let Problem { robot, query, .. } = self.problem;
        Ok(with_joints(collider, robot, query, &checked, &pieces, ends, expanded))
    }
}

/// Sweeps of a try: few at first, more where that failed.
fn grain_of_try(attempt: usize) -> Grain {
    if attempt == 0 { Grain::COARSE } else { Grain { drive: 0.1, turn: 0.15 } }
}

/// Metres of straight driving that take as long as a radian of turning, whatever its radius (\[SCR\] Eq. 14).
fn turn_cost(robot: &RobotModel) -> f64 {
    (robot.track_width / (2.0 * robot.base.eta)).clamp(LEAST_TURN_COST, MOST_TURN_COST)
}

/// The same at the greatest speed and turn rate, where only one of them is used at a time.
fn standing_turn_cost(robot: &RobotModel) -> f64 {
    (robot.base.speed / robot.base.angular_speed).clamp(LEAST_TURN_COST, MOST_TURN_COST)
}

/// How far the base turns along a path, rad.
fn turned(path: &SearchPath) -> f64 {
    path.states.windows(2).map(|w| (w[1].pose.yaw - w[0].pose.yaw).abs()).sum()
}

/// What a path takes as driven, to compare it with others, s: with arms of seven joints, in rooms of 20 m, the motions made of such
/// paths took 0.8 s a metre and 0.7 s a radian at 1 m/s and 1.25 rad/s, and the joints moved meanwhile.
pub fn seconds(robot: &RobotModel, path: &SearchPath) -> f64 {
    (path.length() + standing_turn_cost(robot) * turned(path)) / robot.base.speed
}

/// The postures without steps at an end that jump over obstacles, and with a way out of the one there where none leads out of it.
fn with_way_out<const W: usize>(collider: &Collider<'_, W>, end: End, pose: Pose2, query: &Query) -> Option<Postures> {
    if end == End::Goal && (query.goal_yaw.is_none() || query.goal_within > 0.0) {
        return None;
    }
    let postures = &collider.postures;
    let free = collider.free(&BaseMotion { from: pose, to: pose });
    let passes = collider.passes(pose);
    let WayOut { blocked, shut_in } = postures.way_out(&collider.neighbours, end, free, &passes)?;
    let Some((from, to)) = shut_in else { return (!blocked.is_empty()).then(|| postures.without(&blocked)) };
    let to: Vec<Vec<f64>> = to.into_iter().map(|posture| postures.joints(posture).to_vec()).collect();
    let from = postures.joints(from);
    // With none the others stay: the base may drive off meanwhile.
    let way = Escape::new(collider.robot(), from, &passes).way(from, &to)?;
    // Half of the room that is left for each end.
    let room = (64 * W - postures.count()) / if end == End::Start { 2 } else { 1 };
    Some(postures.without(&blocked).with_way(&way, room))
}

/// Postures that are free in a pose and agree with what is asked for.
fn free_postures<const W: usize>(
    collider: &Collider<'_, W>,
    pose: Pose2,
    end: End,
    joints: &[Option<f64>],
) -> Option<Bits<W>> {
    let mut wanted = collider.free(&BaseMotion { from: pose, to: pose });
    for p in wanted.iter() {
        if !collider.postures.agrees(p, end, joints) {
            wanted.remove(p);
        }
    }
    (!wanted.is_empty()).then_some(wanted)
}

/// Postures free at the goal, in any heading that will do.
fn goal_postures<const W: usize>(collider: &Collider<'_, W>, query: &Query) -> Option<Bits<W>> {
    let headings = goal_headings(query).into_iter();
    let free = |yaw| free_postures(collider, Pose2 { yaw, ..query.goal }, End::Goal, &query.goal_joints);
    headings.filter_map(free).reduce(Bits::or)
}

/// The heading that is asked for at the goal, or those of the lattice.
pub(super) fn goal_headings(query: &Query) -> Vec<f64> {
    let any = || (0..lattice::HEADINGS as i32).map(lattice::heading_angle).collect();
    query.goal_yaw.map_or_else(any, |yaw| vec![yaw])
}
