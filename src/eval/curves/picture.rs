//! A curve from above, and the wheels under every law.

use super::table::name;
use super::{Figures, How, Judged, clip};
use crate::command::CommandTable;
use crate::geom::Pose2;
use crate::mission::TimeLaw;
use crate::report::plot::{Figure, Panel, TopView, motion};
use crate::retime::printed::Printed;
use crate::robot::RobotModel;

/// Around the path, m.
const MARGIN: f64 = 0.5;

/// The picture of a judged curve: the path with where a robot goes that clips its wheels' speeds, without Eq. 5 and with it; below, the
/// held wheel speeds of every row, on one axis of time.
pub fn picture(judged: &Judged, robot: &RobotModel) -> String {
    let drawn: Vec<(String, How, &Figures)> =
        judged.rows.iter().filter_map(|row| Some((name(row), row.how, row.outcome.as_ref().ok()?))).collect();
    let curve = &judged.curve;
    let mut lines = vec![format!(
        "{:.3} m, least radius {:.3} m; optimum of an independent solver {:.3} s, without a jerk limit {:.3} s",
        curve.length, curve.least_radius, curve.optimum, curve.lower_bound
    )];
    lines.extend(judged.rows.iter().filter_map(|row| Some(format!("{}: {}", name(row), row.outcome.as_ref().err()?))));
    let longest = drawn.iter().map(|(_, _, figures)| figures.table.duration()).fold(0.0, f64::max);
    let charts = drawn.iter().map(|(name, _, figures)| {
        let mut chart = motion::wheel_chart(&figures.table, Some(robot));
        chart.title = format!("{name}: {:.2} s", figures.time);
        chart.series.iter_mut().for_each(|series| series.points.push([longest, f64::NAN]));
        Panel::Chart(chart)
    });
    let mut panels: Vec<Panel> = from_above(&drawn, robot).map(Panel::Top).into_iter().collect();
    panels.extend(charts);
    Figure { title: format!("{} ([CONV] section 3)", curve.title), lines, panels }.to_svg()
}

fn from_above(drawn: &[(String, How, &Figures)], robot: &RobotModel) -> Option<TopView> {
    let limit = robot.wheel.speed.unwrap_or(f64::INFINITY);
    let of = |how: How| drawn.iter().find(|(_, known, _)| *known == how).map(|(_, _, figures)| &figures.table);
    let path = of(How::Compiled(TimeLaw::Auto))?;
    let start = path.rows.first().map(|row| row.pose).unwrap_or_default();
    let goal = path.rows.last().map(|row| row.pose).unwrap_or_default();
    let points = |table: &CommandTable| -> Vec<[f64; 2]> {
        let poses = table.replay(start);
        poses.iter().map(|pose: &Pose2| [pose.x, pose.y]).collect()
    };
    let clipped = [
        ("without Eq. 5, wheels clipped", How::Paper(Printed { eq2: false, eq5: false })),
        ("with Eq. 5, wheels clipped", How::Paper(Printed { eq2: false, eq5: true })),
    ];
    let clipped: Vec<(&'static str, Vec<[f64; 2]>)> =
        clipped.into_iter().filter_map(|(name, how)| Some((name, points(&clip::clipped(of(how)?, limit))))).collect();
    let planned: Vec<[f64; 2]> = path.rows.iter().map(|row| [row.pose.x, row.pose.y]).collect();
    let all = planned.iter().chain(clipped.iter().flat_map(|(_, points)| points));
    let mut view = TopView::around(all.copied(), MARGIN);
    view.path(planned, "path");
    for (i, (name, points)) in clipped.into_iter().enumerate() {
        view.trace(points, i + 1, name);
    }
    view.end(robot, start, &[], "start");
    view.end(robot, goal, &[], "goal");
    Some(view)
}
