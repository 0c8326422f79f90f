//! Searching and optimising until something is certified.

use super::{CompileOptions, Finish, Made, Place, Run, stops};
use crate::certify::Task;
use crate::diag::{Describe, Diagnostics};
use crate::geom::Pose2;
use crate::mission::{Mission, Parameterisation, PoseSpec};
use crate::optimize::{self, OptimizeOptions};
use crate::report::metrics;
use crate::report::schema::{InitialPart, SearchPart};
use crate::robot::RobotModel;
use crate::search::{self, Query, SearchError, SearchOptions, SearchPath};
use crate::trajectory::Trajectory;

/// Clearance beyond what must be certified that the search asks for first, m: what held commands may leave of a path.
pub const SEARCH_MARGIN: f64 = 2e-3;
/// Clearance beyond what must be certified that the optimiser aims at, m, one try after the other.
pub const OPTIMISER_MARGINS: [f64; 3] = [0.01, 0.02, 0.04];
/// The same at first where the optimiser looks at a motion only now and then.
const FIRST_MARGIN: f64 = 0.013;

/// What a motion has missed of its clearance is asked for so many times over by the next tries: between its nodes the distance field
/// says up to a quarter of a cell too much.
const MISSED_TIMES: f64 = 1.5;
/// What counts of it at most, m.
const MISSED_MOST: f64 = 0.015;

/// How a try of the optimiser goes about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Look {
    /// From the path.
    First,
    /// More closely, from the motion of the try before.
    Again,
    /// More closely, from the path.
    Closer,
}

/// Searches and optimises until something is certified; the search's own path is the last try. With vias: from stop to stop.
pub(super) fn plan(
    run: &mut Run<'_>,
    finish: &Finish<'_>,
    map: &Place,
    compile: &CompileOptions,
) -> Result<Made, Diagnostics> {
    if !finish.mission.via.is_empty() {
        return stops::plan(run, finish, map, compile);
    }
    let query = query(finish.mission, finish.robot);
    let path = route(run, finish, map, compile, &query).map_err(|error| place_search_error(finish.mission, &error))?;
    note(run, &path, finish.robot);
    let task = |trajectory: &Trajectory| finish.task(trajectory);
    let made = optimise(run, finish, map, compile, &path, &task);
    if made.as_ref().is_ok_and(|made| made.certificate.holds()) {
        return made;
    }
    // Between the postures that were sampled something may have been in the way: another path leads by others.
    let field = map.field(compile.threads);
    let options = search_options(finish.mission, SEARCH_MARGIN);
    let other = run.stage("search", || search::with_more_postures(map, field, finish.robot, &query, &options));
    let Some(other) = other else { return made };
    match optimise(run, finish, map, compile, &other, &task) {
        Ok(better) if better.certificate.holds() => {
            note(run, &other, finish.robot);
            Ok(better)
        }
        _ => made,
    }
}

fn search_options(mission: &Mission, margin: f64) -> SearchOptions {
    SearchOptions { clearance: mission.clearance + margin, reverse: mission.reverse }
}

/// The search's path.
pub(super) fn route(
    run: &mut Run<'_>,
    finish: &Finish<'_>,
    map: &Place,
    compile: &CompileOptions,
    query: &Query,
) -> Result<SearchPath, SearchError> {
    let (mission, robot) = (finish.mission, finish.robot);
    let field = run.stage("esdf", || map.field(compile.threads));
    run.stage("search", || {
        let options = |margin: f64| search_options(mission, margin);
        // What fits only without the margin is found too, and what is absent is absent without it.
        search::search(map, field, robot, query, &options(SEARCH_MARGIN)).or_else(|error| match error {
            SearchError::OffMap { .. } | SearchError::Limit { .. } | SearchError::Sampled { .. } => Err(error),
            _ => search::search(map, field, robot, query, &options(0.0)),
        })
    })
}

/// Reports what the search found.
pub(super) fn note(run: &mut Run<'_>, path: &SearchPath, robot: &RobotModel) {
    run.report.search = Some(SearchPart::from(path));
    run.traces.route = path.states.iter().map(|state| [state.pose.x, state.pose.y]).collect();
    run.report.initial = Some(InitialPart { metrics: metrics::of_search(path, robot) });
}

/// The motion along a path that is certified to do its task; if none is, the path's own, and why it is refused.
pub(super) fn optimise(
    run: &mut Run<'_>,
    finish: &Finish<'_>,
    map: &Place,
    compile: &CompileOptions,
    path: &SearchPath,
    task: &dyn Fn(&Trajectory) -> Task,
) -> Result<Made, Diagnostics> {
    let (mission, robot) = (finish.mission, finish.robot);
    let asked = compile.parameterisation.unwrap_or(mission.parameterisation);
    let field = map.field(compile.threads);
    let certify = |run: &mut Run<'_>, trajectory: Trajectory| {
        let task = task(&trajectory);
        finish.certify_task(run, trajectory, &task)
    };
    if path.length() == 0.0 {
        return certify(run, path.trajectory());
    }
    // Where one parameterisation fails at every margin, the other may not.
    let other = (asked == Parameterisation::ArcLength).then_some(Parameterisation::Flat);
    // A motion that misses its clearance by little is looked at more closely, then from the beginning, then asked for more.
    let of = |p: Parameterisation| match p {
        Parameterisation::Flat => OPTIMISER_MARGINS.map(|margin| (p, margin, Look::First)).to_vec(),
        Parameterisation::ArcLength => {
            let closer = OPTIMISER_MARGINS.map(|margin| (p, margin, Look::Closer));
            [(p, FIRST_MARGIN, Look::First), (p, FIRST_MARGIN, Look::Again)].into_iter().chain(closer).collect()
        }
    };
    let mut refused: Option<Trajectory> = None;
    let mut missed = 0.0f64;
    let tries = [asked].into_iter().chain(other).flat_map(of);
    for (parameterisation, margin, look) in tries {
        let usual = if compile.spins { OptimizeOptions::default() } else { OptimizeOptions::without_spins() };
        let clearance = mission.clearance + margin;
        let mut options = OptimizeOptions { parameterisation, clearance, dense: compile.dense, ..usual };
        options.zones = mission.speed_zones().to_vec();
        if look != Look::First {
            options.steer = options.steer.closer();
            options.clearance += MISSED_TIMES * missed;
        }
        let trajectory = run.stage("optimize", || match refused.take().filter(|_| look == Look::Again) {
            Some(refused) => optimize::resume(path, field, robot, &options, &refused),
            None => optimize::optimize(path, field, robot, &options),
        });
        refused = Some(trajectory.clone());
        // A trajectory that no law can time is one more reason to go on to the next try.
        let Ok(made) = certify(run, trajectory) else { continue };
        if made.certificate.holds() {
            return Ok(made);
        }
        if let Some(closest) = &made.certificate.closest {
            missed = missed.max((mission.clearance - closest.distance).clamp(0.0, MISSED_MOST));
        }
    }
    certify(run, path.trajectory())
}

/// What the search is asked.
fn query(mission: &Mission, robot: &RobotModel) -> Query {
    let [start, goal] = [&mission.start, &mission.goal].map(|p| p.clone().unwrap_or_default());
    let pose = |p: &PoseSpec| Pose2::new(p.x.unwrap_or(0.0), p.y.unwrap_or(0.0), p.yaw.unwrap_or(0.0));
    let joints = |p: &PoseSpec| robot.joints.iter().map(|j| p.joints.get(&j.name).copied()).collect();
    Query {
        start: pose(&start),
        start_joints: joints(&start),
        goal: pose(&goal),
        goal_within: goal.within,
        goal_yaw: goal.yaw,
        goal_joints: joints(&goal),
    }
}

/// Points a search error at the pose it is about.
fn place_search_error(mission: &Mission, error: &SearchError) -> Diagnostics {
    let spans = &mission.spans;
    let span = if error.is_about_start() { spans.start.as_ref() } else { spans.goal.as_ref() };
    error.diagnostic().maybe_at(span).into()
}
