//! From where to where: what the search is asked for a start and a goal.

use super::ends::joints;
use super::plan::{SEARCH_MARGIN, search_options};
use super::{CompileOptions, Finish, Place, Run};
use crate::diag::{Diagnostic, Diagnostics};
use crate::geom::Pose2;
use crate::mission::PoseSpec;
use crate::robot::RobotModel;
use crate::search::{self, LinkTarget, Placements, Query};

/// Where a stretch begins.
pub(super) struct From {
    pub(super) pose: Pose2,
    pub(super) joints: Vec<Option<f64>>,
}

impl From {
    pub(super) fn of(place: &PoseSpec, robot: &RobotModel) -> Self {
        Self { pose: pose(place), joints: joints(place, robot) }
    }
}

fn pose(place: &PoseSpec) -> Pose2 {
    Pose2::new(place.x.unwrap_or(0.0), place.y.unwrap_or(0.0), place.yaw.unwrap_or(0.0))
}

/// What the search is asked, one after the other until something is certified: more than one where a link must be somewhere.
pub(super) struct Goals {
    queries: Vec<Query>,
    /// The link.
    link: Option<String>,
}

/// How to get to a place.
pub(super) fn goals(
    run: &mut Run<'_>,
    finish: &Finish<'_>,
    map: &Place,
    compile: &CompileOptions,
    from: From,
    place: &PoseSpec,
) -> Result<Goals, Diagnostics> {
    let robot = finish.robot;
    let query = Query {
        start: from.pose,
        start_joints: from.joints,
        goal: pose(place),
        goal_within: place.within,
        goal_yaw: place.yaw,
        goal_joints: joints(place, robot),
    };
    let Some(goal) = finish.link.as_ref().filter(|_| place.link.is_some()) else {
        return Ok(Goals { queries: vec![query], link: None });
    };
    let target = LinkTarget { link: goal.link, position: goal.position, rotation: goal.rotation };
    let field = run.stage("esdf", || map.field(compile.threads));
    let options = search_options(finish.mission, SEARCH_MARGIN);
    let placements = run.stage("search", || search::placements(map, field, robot, &target, &query, &options));
    if placements.found.is_empty() {
        return Err(out_of_reach(finish, &target, &placements).into());
    }
    let to = |(goal, joints): (Pose2, Vec<f64>)| Query {
        goal,
        goal_yaw: Some(goal.yaw),
        goal_joints: joints.into_iter().map(Some).collect(),
        ..query.clone()
    };
    let link = Some(robot.links[goal.link].name.clone());
    Ok(Goals { queries: placements.found.into_iter().map(to).collect(), link })
}

fn out_of_reach(finish: &Finish<'_>, target: &LinkTarget, placements: &Placements) -> Diagnostic {
    let name = &finish.robot.links[target.link].name;
    let ([x, y, z], [low, high]) = (target.position, placements.heights);
    let turned = if target.rotation.is_some() { ", turned as it is to be" } else { "" };
    let (nearest, off) = (placements.nearest, if target.rotation.is_some() { " (a radian counts 0.3 m)" } else { "" });
    let message = format!(
        "link `{name}` cannot come to ({x:.3}, {y:.3}, {z:.3}){turned}, with the base inside the map: the nearest is {nearest:.3} m off{off}"
    );
    let hint = format!(
        "in the postures looked at it is {low:.2} to {high:.2} m high: change `position_m`, or leave `rpy`, `yaw` or joints open"
    );
    Diagnostic::failure("search/out-of-reach", message)
        .maybe_at(finish.mission.spans.goal.as_ref())
        .hint(hint)
        .number("link", name.clone())
        .number("missing_m", nearest)
}

impl Goals {
    /// The first result that is good; where none is, the first, with where the base was to stand for a link.
    pub(super) fn first_certified<T>(
        &self,
        good: impl Fn(&T) -> bool,
        mut plan: impl FnMut(&Query) -> Result<T, Diagnostics>,
    ) -> Result<T, Diagnostics> {
        let mut first = None;
        for query in &self.queries {
            let result = plan(query);
            if result.as_ref().is_ok_and(&good) {
                return result;
            }
            first.get_or_insert((query.goal, result));
        }
        let (goal, result) = first.expect("there is a goal");
        result.map_err(|Diagnostics(mut faults)| {
            if let Some(name) = &self.link {
                let (x, y, heading) = (goal.x, goal.y, goal.yaw.to_degrees());
                let stand = format!(
                    "; for link `{name}` the base at ({x:.3}, {y:.3}), heading {heading:.0} degrees, was tried first"
                );
                // What is wrong with the start is so for all of them.
                let of_goal = faults.iter_mut().filter(|fault| fault.code != "search/start-blocked");
                of_goal.for_each(|fault| fault.message += &stand);
            }
            Diagnostics(faults)
        })
    }
}
