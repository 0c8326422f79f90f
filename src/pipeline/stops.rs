//! Missions with stops on the way: stretch by stretch from rest to rest, joined, and proven as one.

use super::attempts::{Attempts, Since};
use super::ends::{place_of, start_of, vias};
use super::goals::{From, goals};
use super::plan::{motion, note, route};
use super::refusal::refused;
use super::{CompileOptions, Finish, Made, Place, Run};
use crate::certify::{self, Demands, Task};
use crate::command::{CommandError, CommandTable, MOST_ROWS};
use crate::diag::{Describe, Diagnostics};
use crate::geom::Pose2;
use crate::mission::{Mission, Sampling, ViaSpec};
use crate::retime::{self, RetimeOptions};
use crate::robot::RobotModel;
use crate::search::SearchPath;
use crate::trajectory::{OptimiserOutcome, Trajectory, TrajectorySource};

/// Rows of rest at a stop at least: after two of them neither differences nor second differences of commands know what was before.
const LEAST_REST: usize = 2;

/// Plans each stretch as a mission of its own, from where the commands of the one before really end; then joins the commands with rows of
/// rest between them, as many as the stop lasts, and has the whole certified, stops included. A stretch leaves what a via leaves open
/// as it comes: no other is sought if the next one fails.
pub(super) fn plan(
    run: &mut Run<'_>,
    finish: &Finish<'_>,
    map: &Place,
    compile: &CompileOptions,
) -> Result<Made, Diagnostics> {
    let (mission, robot) = (finish.mission, finish.robot);
    let places = mission.via.iter().map(|via| &via.place).chain(&mission.goal);
    let start = mission.start.clone().unwrap_or_default();
    let mut from = From::of(&start, robot);
    let mut route_so_far: Option<SearchPath> = None;
    let mut stretches = Vec::new();
    for (index, place) in places.enumerate() {
        let before = route_so_far.take();
        let since = since(mission, &stretches);
        let task = |trajectory: &Trajectory| {
            let (start, start_joints) = start_of(trajectory);
            let goal = place_of(place, robot);
            Task { start, start_joints, goal, clearance: mission.clearance, reverse: mission.reverse }
        };
        let attempts = Attempts { finish, map, compile, task: &task, since: since.as_ref() };
        let goals = goals(run, finish, map, compile, from, place)
            .map_err(|faults| of_stretch(finish, index, index + 1, faults))?;
        let (made, path) = goals.first_certified(
            |_| true,
            |query| {
                let path = route(run, finish, map, compile, query).map_err(|error| {
                    let about = if error.is_about_start() { index } else { index + 1 };
                    of_stretch(finish, index, about, error.diagnostic().into())
                })?;
                note(run, &joined_paths(before.as_ref(), &path), robot);
                let of_goal = |faults| of_stretch(finish, index, index + 1, faults);
                let (made, other) = motion(run, &attempts, &path, query).map_err(of_goal)?;
                if let Some(other) = &other {
                    note(run, &joined_paths(before.as_ref(), other), robot);
                }
                if !made.certificate.holds() {
                    let why = refused(&made.certificate, made.trajectory.source);
                    run.traces.refused = Some(made.commands);
                    return Err(of_goal(why.into()));
                }
                Ok((made, other.unwrap_or(path)))
            },
        )?;
        route_so_far = Some(joined_paths(before.as_ref(), &path));
        from = end_of(&made.commands, robot);
        stretches.push((made, path.length() > 0.0));
    }
    let commands = joined_commands(mission, stretches.iter().map(|(made, _)| &made.commands)).map_err(|error| {
        let hint = "a shorter `dwell_s`, or a longer `sampling_time_s`";
        error.diagnostic().maybe_at(mission.spans.via.first()).hint(hint)
    })?;
    let trajectory = joined_trajectories(&stretches);
    // For its figures and the path error; the commands are those of the stretches, so that rests begin and end with a row.
    let options = RetimeOptions { law: finish.law(&trajectory), sampling_time: finish.sampling_time };
    let profile = run.stage("retime", || retime::retime_in(&trajectory, robot, &options, mission.speed_zones()))?;
    let task = finish.task(&trajectory);
    let stops = vias(mission, robot);
    let demands = Demands { vias: &stops, zones: mission.speed_zones(), link: finish.link.as_ref() };
    let certificate = run.stage("certify", || certify::certify_through(&commands, robot, finish.map, &task, demands));
    Ok(Made { trajectory, profile, commands, certificate })
}

/// What the next stretch has behind it.
fn since(mission: &Mission, stretches: &[(Made, bool)]) -> Option<Since> {
    let (first, _) = stretches.first()?;
    let commands = joined_commands(mission, stretches.iter().map(|(made, _)| &made.commands)).ok()?;
    Some(Since { start: start_of(&first.trajectory), commands })
}

/// Where commands lead, as replayed.
fn end_of(table: &CommandTable, robot: &RobotModel) -> From {
    let start = table.rows.first().map_or(Pose2::default(), |row| row.pose);
    let last = table.rows.last();
    let joints = last.map_or(&[][..], |row| &row.joint_positions[..]);
    let joints = robot.joints.iter().zip(joints).map(|(joint, value)| Some(value.clamp(joint.lower, joint.upper)));
    From { pose: table.replay(start).last().copied().unwrap_or(start), joints: joints.collect() }
}

/// Says of a fault which stretch it is about, and points at one of the places: 0 is the start, 1 the first via.
fn of_stretch(finish: &Finish<'_>, stretch: usize, about: usize, faults: Diagnostics) -> Diagnostics {
    let (mission, joints) = (finish.mission, finish.robot.joints.len());
    let name = |place: usize| match place {
        0 => "the start".to_owned(),
        via if via <= mission.via.len() => format!("`via[{}]`", via - 1),
        _ => "the goal".to_owned(),
    };
    let spans = &mission.spans;
    let span = match about {
        0 => spans.start.as_ref(),
        via => spans.via.get(via - 1).or(spans.goal.as_ref()),
    };
    // What the stretch before settled may be what blocks this one.
    let open = |via: &&ViaSpec| via.place.yaw.is_none() || via.place.joints.len() < joints;
    let left_open = stretch.checked_sub(1).and_then(|via| mission.via.get(via)).filter(open).is_some();
    let on = format!("from {} to {}", name(stretch), name(stretch + 1));
    let said = faults.0.into_iter().map(|mut fault| {
        fault.message = format!("on the stretch {on}: {}", fault.message);
        if let Some(hint) = fault.hint.as_mut().filter(|_| left_open && fault.code == "search/no-way") {
            *hint += &format!("; or say which heading and joints {} shall have", name(stretch));
        }
        fault.maybe_at(span).number("stretch", stretch as u64)
    });
    Diagnostics(said.collect())
}

fn joined_paths(before: Option<&SearchPath>, path: &SearchPath) -> SearchPath {
    let Some(mut whole) = before.cloned() else { return path.clone() };
    // The last state of the one is the first of the other, but for what the commands missed it by.
    whole.states.extend_from_slice(&path.states[1..]);
    whole.moves.extend_from_slice(&path.moves);
    whole.expanded += path.expanded;
    whole
}

fn joined_commands<'a>(
    mission: &Mission,
    tables: impl Iterator<Item = &'a CommandTable>,
) -> Result<CommandTable, CommandError> {
    let mut tables = tables.cloned();
    let mut whole = tables.next().expect("a mission has a goal, so there is a stretch");
    for (table, via) in tables.zip(&mission.via) {
        let hold = whole.sampling_time;
        let rests = ((via.dwell / hold - 1e-9).ceil() as usize).max(LEAST_REST);
        let rows = (whole.rows.len() + rests + table.rows.len()) as f64;
        if rows > MOST_ROWS {
            return Err(CommandError::TooLong { time: rows * hold, sampling_time: hold, rows });
        }
        let rest = whole.rows[whole.rows.len() - 1].clone();
        // The last row of a table is one of them.
        whole.rows.extend(std::iter::repeat_n(rest, rests - 1));
        whole.rows.extend(table.rows);
        if table.sampling != whole.sampling {
            // `tracked` is promised of all rows or of none.
            whole.sampling = Sampling::Mean;
        }
    }
    Ok(whole)
}

/// `driven`: whether a stretch goes anywhere; of one that does not nothing could be optimised.
fn joined_trajectories(stretches: &[(Made, bool)]) -> Trajectory {
    let optimised = |made: &Made| made.trajectory.source == TrajectorySource::Optimised;
    let all = stretches.iter().all(|(made, driven)| optimised(made) || !driven);
    let any = stretches.iter().any(|(made, _)| optimised(made));
    let outcomes = stretches.iter().filter_map(|(made, _)| made.trajectory.optimiser);
    let optimiser = outcomes.reduce(|a, b| OptimiserOutcome {
        pieces: a.pieces + b.pieces,
        iterations: a.iterations + b.iterations,
        ending: a.ending.max(b.ending),
        cost: a.cost + b.cost,
        slowed: a.slowed.max(b.slowed),
    });
    Trajectory {
        legs: stretches.iter().flat_map(|(made, _)| made.trajectory.legs.clone()).collect(),
        source: if all && any { TrajectorySource::Optimised } else { TrajectorySource::Search },
        optimiser,
    }
}
