//! A scene and what was compiled in it, as a picture.

use super::paper::FIG5_LEAST_RADIUS;
use super::{Scene, SceneSet, Suite, Turns};
use crate::diag::Diagnostics;
use crate::geom::Pose2;
use crate::mission::PoseSpec;
use crate::pipeline::{CompileOptions, Outcome};
use crate::report::plot::{Figure, Panel, TopView, motion, top};
use crate::robot::RobotModel;

/// Values tried of each joint for the robot's least height.
const POSTURES: usize = 17;

/// File name of a scene's picture; `None`: this variant of it is not drawn. Fig. 5 shows the smooth curve of the paper's way, and
/// what is compiled as usual beside it.
pub fn picture_name(scene: &Scene, suite: Option<Suite>, options: &CompileOptions) -> Option<String> {
    let suffix = match (suite, options.dense, options.spins) {
        (Some(Suite::Fig5), true, true) => "-spins",
        (Some(Suite::Fig5), true, false) | (_, true, true) => "",
        _ => return None,
    };
    Some(format!("{}{suffix}.svg", scene.id))
}

/// The picture of a scene: from above, obstacles, path and the robot on its way; below, wheels and joints over time (of Fig. 5's
/// scene the radius on which it turns). A scene that failed shows its start and goal.
///
/// # Errors
/// A grid too large; sets that were read have none.
pub fn picture(
    set: &SceneSet,
    scene: &Scene,
    suite: Option<Suite>,
    robot: &RobotModel,
    outcome: &Outcome,
) -> Result<String, Diagnostics> {
    let map = set.voxels(scene)?;
    let mut view = TopView::of_map(&map, least_top(robot));
    let mut charts = Vec::new();
    let mut lines = Vec::new();
    match &outcome.compiled {
        Some(compiled) => {
            let table = &compiled.commands;
            motion::draw(&mut view, robot, table);
            charts.extend(motion::joint_charts(table, Some(robot)));
            charts.push(motion::wheel_chart(table, Some(robot)));
            if suite == Some(Suite::Fig5) {
                charts.push(motion::radius_chart(table).level("the paper's least, 9.3 mm", 1e3 * FIG5_LEAST_RADIUS));
                let turns = Turns::of(table);
                if let Some((radius, (at, _))) = turns.least_driven_m.zip(turns.tightest) {
                    view.mark(at, format!("tightest while driving: {:.1} mm", 1e3 * radius));
                    lines.push(format!(
                        "turns on the spot: {}; least radius while driving {:.1} mm (the paper: 9.3 mm)",
                        turns.on_the_spot,
                        1e3 * radius
                    ));
                }
            }
            let proven = compiled.certificate.clearance_proven.unwrap_or(0.0);
            let length = crate::report::metrics::of_commands(table).length_m;
            lines.push(format!(
                "{}: {length:.2} m in {:.1} s, certified with {:.1} cm of clearance ({:.1} cm asked for)",
                robot.name,
                table.duration(),
                100.0 * proven,
                100.0 * set.clearance
            ));
        }
        None => {
            let reason = outcome.report.failure.as_ref().map_or("no reason", |f| f.reason.as_str());
            lines.push(format!("{}: failed. {reason}", robot.name));
            for (pose, name) in [(&scene.start, "start"), (&scene.goal, "goal")] {
                view.end(robot, placed(pose), &posture(pose, robot), name);
            }
        }
    }
    let title = match suite {
        Some(Suite::Fig5) => "Turns in a dense room, as in [SCR] Fig. 5".into(),
        Some(Suite::Fig6) => "Two arch bridges, as in [SCR] Fig. 6".into(),
        _ => format!("Scene {}", scene.id),
    };
    let panels = std::iter::once(Panel::Top(view)).chain(charts.into_iter().map(Panel::Chart)).collect();
    Ok(Figure { title, lines, panels }.to_svg())
}

fn placed(pose: &PoseSpec) -> Pose2 {
    let part = |value: Option<f64>| value.unwrap_or(0.0);
    Pose2::new(part(pose.x), part(pose.y), part(pose.yaw))
}

/// The joints given; others at the middle of what they can hold.
fn posture(pose: &PoseSpec, robot: &RobotModel) -> Vec<f64> {
    let rest = |low: f64, high: f64| if low.is_finite() && high.is_finite() { 0.5 * (low + high) } else { 0.0 };
    robot.joints.iter().map(|j| pose.joints.get(&j.name).copied().unwrap_or(rest(j.lower, j.upper))).collect()
}

/// Height of the robot at its lowest, m, all joints moved alike through their ranges: what hangs higher can be passed under.
fn least_top(robot: &RobotModel) -> f64 {
    let at = |k: usize| {
        let share = k as f64 / (POSTURES - 1) as f64;
        let value = |low: f64, high: f64| if (high - low).is_finite() { low + share * (high - low) } else { 0.0 };
        top(robot, &robot.joints.iter().map(|j| value(j.lower, j.upper)).collect::<Vec<_>>())
    };
    (0..POSTURES).map(at).fold(f64::INFINITY, f64::min)
}
