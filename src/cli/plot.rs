//! What `trajc inspect --plot` draws.

use crate::command::CommandTable;
use crate::map::VoxelMap;
use crate::math::real;
use crate::mission::{Mission, PathSpec};
use crate::pipeline::World;
use crate::report::PathErrorRow;
use crate::report::plot::{Chart, Figure, Join, Panel, Spread, TopView, motion, place};
use crate::robot::RobotModel;

/// Points drawn of each segment of a given path.
const POINTS: usize = 40;
/// Around what has no bounds of its own, m.
const AROUND: f64 = 0.5;

/// A robot from above, its joints at the beginning, the middle and the end of their ranges.
pub(super) fn robot(robot: &RobotModel) -> Figure {
    let shares: &[f64] = if robot.joints.is_empty() { &[0.0] } else { &[0.0, 0.5, 1.0] };
    let reach = robot.shapes.iter().map(|s| s.convex.bounding_radius() + s.pose.translation.vector.norm()).sum::<f64>();
    let spacing = 2.0 * reach.clamp(0.3, 0.8);
    let places: Vec<f64> = (0..shares.len()).map(|k| k as f64 * spacing).collect();
    let mut view = TopView::around(places.iter().map(|x| [*x, 0.0]), 0.5 * spacing);
    for (x, share) in places.iter().zip(shares) {
        let pose = crate::geom::Pose2::new(*x, 0.0, 0.0);
        view.robot(robot, pose, &place::posture(robot, *share));
        if !robot.joints.is_empty() {
            view.note([*x, -0.42 * spacing], format!("joints at {:.0} % of their range", 100.0 * share));
        }
    }
    figure(format!("Robot {}", robot.name), view)
}

/// A map from above, by height, and slices at a sixth, half and five sixths of its obstacles' heights.
pub(super) fn map(name: &str, map: &VoxelMap) -> Figure {
    let mut figure = figure(format!("Map {name}"), TopView::by_height(map));
    let layers = map.dims[2];
    let mut shown: Vec<usize> = [1, 3, 5].map(|sixth| layers * sixth / 6).to_vec();
    shown.dedup();
    if layers > 1 {
        figure.panels.extend(shown.into_iter().map(|layer| Panel::Top(TopView::slice(map, layer))));
    }
    figure
}

/// Path error against sampling time, as \[CONV\] Fig. 16: a line for each sampling, with the bound if there is one (m).
pub(super) fn path_error(name: &str, rows: &[PathErrorRow], bound: Option<f64>) -> Figure {
    let mut samplings: Vec<&str> = Vec::new();
    for row in rows {
        if !samplings.contains(&row.sampling.as_str()) {
            samplings.push(&row.sampling);
        }
    }
    let chart = |title: &str, error: fn(&PathErrorRow) -> f64| {
        let empty = Chart::new(title, "sampling time s", "error mm");
        let mut chart = Chart { x_spread: Spread::Logarithmic, y_spread: Spread::Logarithmic, ..empty };
        for sampling in &samplings {
            let own = rows.iter().filter(|row| row.sampling == *sampling);
            let mut points: Vec<[f64; 2]> = own.map(|row| [row.sampling_time_s, error(row) * 1e3]).collect();
            points.sort_by(|a, b| a[0].total_cmp(&b[0]));
            chart = chart.line(*sampling, points, Join::Dots);
        }
        let chart = bound.map_or_else(|| chart.clone(), |bound| chart.clone().level("asked for", bound * 1e3));
        Panel::Chart(chart)
    };
    Figure {
        title: format!("Path error of {name}"),
        lines: vec!["Replay of held commands against the planned path.".to_owned()],
        panels: vec![
            chart("Largest distance from the path", |row| row.lateral_max_m),
            chart("Distance at the end", |row| row.end_point_m),
        ],
    }
}

/// A mission: map or given path, start and goal.
pub(super) fn mission(mission: &Mission, world: &World) -> Figure {
    let path = match &mission.path {
        Some(PathSpec::Bezier(segments)) => segments.iter().flat_map(|s| (0..=POINTS).map(|k| bezier(s, k))).collect(),
        _ => Vec::new(),
    };
    let ends = [mission.start.as_ref(), mission.goal.as_ref()];
    let mut view = match &world.map {
        Some(map) => TopView::of_map(map, place::least_top(&world.robot)),
        None => {
            let given = ends.iter().flatten().filter_map(|p| Some([p.x?, p.y?]));
            TopView::around(path.iter().copied().chain(given), AROUND)
        }
    };
    place::zones(&mut view, mission.speed_zones());
    if !path.is_empty() {
        view.path(path, "given path");
    }
    place::ends(&mut view, &world.robot, ends);
    for (index, via) in mission.via.iter().enumerate() {
        place::stand(&mut view, &world.robot, &via.place, &format!("via[{index}]"));
    }
    figure(format!("Mission {}", mission.name), view)
}

fn bezier(points: &[[f64; 2]; 4], k: usize) -> [f64; 2] {
    let u = k as f64 / POINTS as f64;
    let weights = [real::powi(1.0 - u, 3), 3.0 * u * real::powi(1.0 - u, 2), 3.0 * u * u * (1.0 - u), real::powi(u, 3)];
    [0, 1].map(|a| points.iter().zip(weights).map(|(p, w)| w * p[a]).sum())
}

/// A command file: the replay of its commands, wheels and joints over time; with the mission's robot and map where it is at hand.
pub(super) fn commands(name: &str, table: &CommandTable, world: Option<&World>) -> Figure {
    let robot = world.map(|w| &w.robot);
    let places: Vec<[f64; 2]> = motion::states(table).iter().map(|(pose, _)| [pose.x, pose.y]).collect();
    let mut view = match world.and_then(|w| w.map.as_deref().zip(robot)) {
        Some((map, robot)) => TopView::of_map(map, place::least_top(robot)),
        None => TopView::around(places.iter().copied(), AROUND),
    };
    match robot.filter(|r| r.joints.len() == table.joints.len()) {
        Some(robot) => motion::draw(&mut view, robot, table),
        None => view.path(places, "path of the base"),
    }
    let mut figure = figure(format!("Commands {name}"), view);
    figure.lines.push(format!(
        "{} rows of {} s, {:.1} s in all",
        table.rows.len(),
        table.sampling_time,
        table.duration()
    ));
    let charts = motion::joint_charts(table, robot).into_iter().chain([motion::wheel_chart(table, robot)]);
    figure.panels.extend(charts.map(Panel::Chart));
    figure
}

fn figure(title: String, view: TopView) -> Figure {
    Figure { title, lines: Vec::new(), panels: vec![Panel::Top(view)] }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_segment_begins_and_ends_at_its_outer_points() {
        let segment = [[0.0, 1.0], [5.0, 5.0], [-5.0, 5.0], [2.0, 3.0]];
        assert_eq!(bezier(&segment, 0), [0.0, 1.0]);
        assert_eq!(bezier(&segment, POINTS), [2.0, 3.0]);
        assert_eq!(bezier(&segment, POINTS / 2), [0.25, 4.25]);
    }
}
