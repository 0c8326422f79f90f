//! `report.svg`: a mission as one static picture, for READMEs, papers and printers.

use super::{PageInputs, at_least_mm, figure, mm};
use crate::report::plot::{Chart, Figure, Join, Panel, TopView, motion, place};
use crate::report::schema::FAR;

/// Around a path without a map, m.
const AROUND: f64 = 0.6;

/// The picture: from above, obstacles, path and the robot's outline on its way; below, clearance, joints and wheels over time. A mission that
/// failed shows its start and goal, and where the robot got stuck.
pub fn svg(inputs: &PageInputs<'_>) -> String {
    let report = inputs.report;
    let mut lines = Vec::new();
    let mut charts: Vec<Chart> = Vec::new();
    let mut view = match (inputs.map, inputs.robot) {
        (Some(map), Some(robot)) => TopView::of_map(map, place::least_top(robot)),
        _ => {
            let states = inputs.commands.map(motion::states).unwrap_or_default();
            TopView::around(states.iter().map(|(pose, _)| [pose.x, pose.y]), AROUND)
        }
    };
    if let Some(failure) = &report.failure {
        lines.extend(failure.reason.split("; ").map(str::to_owned));
    } else if let (Some(commands), Some(certificate)) = (&report.commands, &report.certificate) {
        let length = report.trajectory.as_ref().and_then(|t| t.metrics).map_or(0.0, |m| m.length_m);
        let mut line = format!("{} m in {} s", figure(length), figure(commands.duration_s));
        if let (Some(required), Some(proven)) =
            (certificate.clearance_required_m, certificate.clearance_proven_m.filter(|p| *p < FAR))
        {
            line += &format!(", clearance {} proven, {} required", at_least_mm(proven), mm(required));
        }
        lines.push(line + "; every wheel and joint within its limits");
    }
    place::zones(&mut view, inputs.zones);
    if let Some((table, robot)) = inputs.motion() {
        motion::draw(&mut view, robot, table);
        if let Some(distances) = inputs.distances() {
            let points =
                distances.instants.iter().map(|i| [i.time, (1e3 * i.distance).min(1e3 * distances.reach)]).collect();
            let mut chart = Chart::new("Distance from the nearest obstacle", "time s", "distance mm").line(
                "",
                points,
                Join::Straight,
            );
            if let Some(required) = report.certificate.as_ref().and_then(|c| c.clearance_required_m) {
                chart = chart.level("required", 1e3 * required);
            }
            if let Some(closest) = report.certificate.as_ref().and_then(|c| c.closest.as_ref()) {
                chart = chart.mark([closest.time_s, 1e3 * closest.distance_m], 1);
            }
            charts.push(chart);
        }
        charts.extend(motion::joint_charts(table, Some(robot)));
        charts.push(motion::wheel_chart(table, Some(robot)));
    } else if let Some(robot) = inputs.robot {
        place::ends(&mut view, robot, inputs.ends);
        if let Some(failure) = &report.failure {
            let mut places = Vec::new();
            let gap = super::places::of_failure(robot, &failure.code, &failure.numbers, &mut places);
            places.iter().for_each(|p| view.mark([p.pose[0], p.pose[1]], p.name.clone()));
            if let Some(gap) = gap {
                view.mark(gap.at, format!("{:.2} m wide, {:.2} m needed", gap.width, gap.needed));
            }
        }
    }
    let title = format!("{}: {}", inputs.mission, super::header::verdict(report));
    let panels = std::iter::once(Panel::Top(view)).chain(charts.into_iter().map(Panel::Chart)).collect();
    Figure { title, lines, panels }.to_svg()
}
