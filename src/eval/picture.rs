//! A scene and what was compiled in it, as a picture.

use super::paper::FIG5_LEAST_RADIUS;
use super::{Scene, SceneSet, Suite, Turns};
use crate::diag::Diagnostics;
use crate::pipeline::{CompileOptions, Outcome};
use crate::report::plot::{Figure, Panel, TopView, motion, place};
use crate::robot::RobotModel;

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
    let mut view = TopView::of_map(&map, place::least_top(robot));
    let mut charts = Vec::new();
    let mut lines = Vec::new();
    match &outcome.compiled {
        Some(compiled) => {
            let table = &compiled.commands;
            let proven = compiled.certificate.clearance_proven.unwrap_or(0.0);
            let length = crate::report::metrics::of_commands(table).length_m;
            lines.push(format!(
                "{}: {length:.2} m in {:.1} s, certified with {:.1} cm of clearance ({:.1} cm asked for)",
                robot.name,
                table.duration(),
                100.0 * proven,
                100.0 * set.clearance
            ));
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
        }
        None => {
            let reason = outcome.report.failure.as_ref().map_or("no reason", |f| f.reason.as_str());
            lines.push(format!("{}: failed. {reason}", robot.name));
            place::ends(&mut view, robot, [Some(&scene.start), Some(&scene.goal)]);
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
