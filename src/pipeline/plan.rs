//! Searching and optimising until something is certified.

use super::attempts::{Attempts, Tries};
use super::goals::{From, goals};
use super::{CompileOptions, Finish, Made, Place, Run, stops};
use crate::certify::RefusalKind;
use crate::diag::{Describe, Diagnostics};
use crate::mission::Mission;
use crate::report::metrics;
use crate::report::schema::{InitialPart, SearchPart};
use crate::robot::RobotModel;
use crate::search::{self, Query, SearchError, SearchOptions, SearchPath};
use crate::trajectory::Trajectory;

/// Clearance beyond what must be certified that the search asks for first, m: what held commands may leave of a path.
pub const SEARCH_MARGIN: f64 = 2e-3;
/// A motion that takes so many times as long as its path was expected to is compared with one along another path.
const SLOW: f64 = 1.25;

/// Searches and optimises until something is certified; the search's own path is the last try. With vias: from stop to stop.
pub(super) fn plan(
    run: &mut Run<'_>,
    finish: &Finish<'_>,
    map: &Place,
    compile: &CompileOptions,
) -> Result<Made, Diagnostics> {
    map.has_room()?;
    if !finish.mission.via.is_empty() {
        return stops::plan(run, finish, map, compile);
    }
    let start = finish.mission.start.clone().unwrap_or_default();
    let from = From::of(&start, finish.robot);
    let goal = finish.mission.goal.clone().unwrap_or_default();
    // A goal of a link can be reached in several ways; the first that is certified is taken.
    let goals = goals(run, finish, map, compile, from, &goal)?;
    goals.first_certified(Made::holds, |query| to_goal(run, finish, map, compile, query))
}

fn to_goal(
    run: &mut Run<'_>,
    finish: &Finish<'_>,
    map: &Place,
    compile: &CompileOptions,
    query: &Query,
) -> Result<Made, Diagnostics> {
    let path = route(run, finish, map, compile, query).map_err(|error| place_search_error(finish.mission, &error))?;
    note(run, &path, finish.robot);
    let task = |trajectory: &Trajectory| finish.task(trajectory);
    let attempts = Attempts { finish, map, compile, task: &task, since: None };
    let (made, other) = motion(run, &attempts, &path, query)?;
    if let Some(other) = other {
        note(run, &other, finish.robot);
    }
    if !made.certificate.holds()
        && let Some(wider) = wider_route(run, &attempts, query, &made)
        && let Ok(again) = attempts.optimise(run, &wider)
        && again.certificate.holds()
    {
        note(run, &wider, finish.robot);
        return Ok(again);
    }
    Ok(made)
}

/// The motion along a path. Where the first tries are refused it may be along another one, with more room or by more postures, which then
/// is told: between those that were sampled something may have been in the way. The same where it takes much longer than expected.
pub(super) fn motion(
    run: &mut Run<'_>,
    attempts: &Attempts<'_>,
    path: &SearchPath,
    query: &Query,
) -> Result<(Made, Option<SearchPath>), Diagnostics> {
    let Attempts { finish, map, compile, .. } = attempts;
    if !search::has_more_postures(finish.robot) {
        return attempts.optimise(run, path).map(|made| (made, None));
    }
    let field = map.field(compile.threads);
    let options = search_options(finish.mission, SEARCH_MARGIN);
    let first = attempts.run(run, path, Tries::Soon);
    let expected = search::seconds(finish.robot, path);
    let mut best = match first {
        Ok(made) if made.commands.duration() <= SLOW * expected => return Ok((made, None)),
        first => first.map(|made| (made, None)),
    };
    for another in [search::with_more_room, search::with_more_postures] {
        // Either will do where there is none; a slow one is only compared with one that has more room.
        let other = run.stage("search", || another(map, field, finish.robot, query, &options));
        if let Some(other) = other.filter(|other| other.states != path.states)
            && let Ok(made) = attempts.run(run, &other, Tries::Soon)
            && best.as_ref().map_or(true, |(best, _)| made.commands.duration() < best.commands.duration())
        {
            best = Ok((made, Some(other)));
        }
        if best.is_ok() {
            break;
        }
    }
    let first = match best {
        Ok(best) => return Ok(best),
        Err(nearest) => nearest,
    };
    let made = match attempts.run(run, path, Tries::Late) {
        Ok(made) => made,
        Err(nearest) => attempts.as_searched(run, path, nearest.or(first))?,
    };
    Ok((made, None))
}

/// Another path, where that of a refused motion was too narrow for the tolerance alone: what the robot may be off there comes off every
/// distance beside it. `None`: there is none, or the tolerance was not the reason.
fn wider_route(run: &mut Run<'_>, attempts: &Attempts<'_>, query: &Query, refused: &Made) -> Option<SearchPath> {
    let Attempts { finish, map, compile, .. } = attempts;
    let tolerance = finish.robot.tolerance.filter(|_| refused.only_the_tolerance_refuses())?;
    let task = finish.task(&refused.trajectory);
    let slacks = attempts.slacks(&refused.commands, &task, tolerance)?;
    let field = map.field(compile.threads);
    run.stage("search", || {
        let lowered = field.lowered(|place| slacks.aside(place));
        search::search(map, &lowered, finish.robot, query, &search_options(finish.mission, SEARCH_MARGIN)).ok()
    })
}

impl Made {
    pub(super) fn holds(&self) -> bool {
        self.certificate.holds()
    }

    /// Whether the certificate refuses nothing but that every robot within the tolerance fits.
    pub(super) fn only_the_tolerance_refuses(&self) -> bool {
        let refusals = &self.certificate.refusals;
        !refusals.is_empty() && refusals.iter().all(|refusal| refusal.kind == RefusalKind::Tolerance)
    }
}

pub(super) fn search_options(mission: &Mission, margin: f64) -> SearchOptions {
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

/// Points a search error at the pose it is about.
fn place_search_error(mission: &Mission, error: &SearchError) -> Diagnostics {
    let spans = &mission.spans;
    let span = if error.is_about_start() { spans.start.as_ref() } else { spans.goal.as_ref() };
    error.diagnostic().maybe_at(span).into()
}
