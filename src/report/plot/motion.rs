//! What a motion looks like: the replay of its held commands from above, wheels and joints over time.

use super::{Chart, Join, Spread, TopView};
use crate::command::CommandTable;
use crate::geom::Pose2;
use crate::robot::RobotModel;

/// About so many outlines are drawn along a motion.
const OUTLINES: f64 = 30.0;
/// Every so many outlines the time is written.
const LABELLED: usize = 5;

/// A state a row: replayed pose, planned joint values.
pub fn states(table: &CommandTable) -> Vec<(Pose2, &[f64])> {
    let start = table.rows.first().map(|row| row.pose).unwrap_or_default();
    table.replay(start).into_iter().zip(&table.rows).map(|(pose, row)| (pose, row.joint_positions.as_slice())).collect()
}

/// Draws the path, and the robot's outline at regular times, some of them labelled; start and end strongly.
pub fn draw(view: &mut TopView, robot: &RobotModel, table: &CommandTable) {
    let states = states(table);
    let (Some(first), Some(last)) = (states.first(), states.last()) else { return };
    let interval = interval(table.duration());
    let every = ((interval / table.sampling_time).round() as usize).max(1);
    for (pose, q) in states.iter().step_by(every) {
        view.robot(robot, *pose, q);
    }
    view.path(states.iter().map(|(pose, _)| [pose.x, pose.y]).collect(), "path of the base");
    for (k, (pose, _)) in states.iter().enumerate().step_by(every * LABELLED).skip(1) {
        if k + 2 * every < states.len() {
            view.note([pose.x, pose.y], format!("{} s", (10.0 * table.time(k)).round() / 10.0));
        }
    }
    view.end(robot, first.0, first.1, "start");
    view.end(robot, last.0, last.1, "goal");
}

/// A round time, s, so that a motion has about [`OUTLINES`] of them.
fn interval(duration: f64) -> f64 {
    let steps = [0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0];
    steps.into_iter().find(|s| duration / s <= OUTLINES).unwrap_or(100.0)
}

/// Rim speeds of both wheels over time; with a robot, its limits.
pub fn wheel_chart(table: &CommandTable, robot: Option<&RobotModel>) -> Chart {
    let side = |of: fn((f64, f64)) -> f64| -> Vec<[f64; 2]> {
        (0..table.rows.len()).map(|k| [table.time(k), of(table.rim_speeds(k))]).collect()
    };
    let mut chart = Chart::new("Wheels", "time s", "rim speed m/s")
        .line("left", side(|(left, _)| left), Join::Held)
        .line("right", side(|(_, right)| right), Join::Held);
    if let Some(limit) = robot.and_then(|r| r.wheel.speed) {
        chart = chart.level("limit", limit).level("limit", -limit);
    }
    chart
}

/// A chart for each joint: its value over time; with a robot, the ends of its range.
pub fn joint_charts(table: &CommandTable, robot: Option<&RobotModel>) -> Vec<Chart> {
    let chart = |(j, (name, prismatic)): (usize, &(String, bool))| {
        let points = table.rows.iter().enumerate().map(|(k, row)| [table.time(k), row.joint_positions[j]]).collect();
        let unit = if *prismatic { "m" } else { "rad" };
        let mut chart =
            Chart::new(format!("Joint {name}"), "time s", format!("position {unit}")).line("", points, Join::Straight);
        if let Some(joint) = robot.and_then(|r| r.joints.iter().find(|own| own.name == *name)) {
            for (end, value) in [("upper limit", joint.upper), ("lower limit", joint.lower)] {
                if value.is_finite() {
                    chart = chart.level(end, value);
                }
            }
        }
        chart
    };
    table.joints.iter().enumerate().map(chart).collect()
}

/// The radius on which the base turns, mm, over time, on a logarithmic axis from 0.1 mm to 10 m; gaps where it does not turn, or on
/// a larger one.
pub fn radius_chart(table: &CommandTable) -> Chart {
    let radius = |k: usize| {
        let (v, omega) = table.twist(k);
        let radius = 1e3 * v.abs() / omega.abs();
        if omega.abs() < 1e-3 || radius > 1e4 { f64::NAN } else { radius.max(0.1) }
    };
    let points = (0..table.rows.len()).map(|k| [table.time(k), radius(k)]).collect();
    let chart = Chart::new("Turn radius (0.1 mm and less: on the spot)", "time s", "radius mm");
    Chart { y_spread: Spread::Logarithmic, ..chart.line("", points, Join::Held) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::CommandRow;
    use crate::math::real;
    use crate::mission::Sampling;
    use crate::report::plot::{Figure, Panel};

    /// Turns on the spot, then drives ahead.
    fn table() -> CommandTable {
        let row = |left: f64, right: f64| CommandRow {
            wheel_left: left / 0.08,
            wheel_right: right / 0.08,
            joint_positions: vec![0.5],
            joint_velocities: vec![0.0],
            pose: Pose2::new(1.0, 2.0, 0.0),
        };
        CommandTable {
            sampling_time: 0.1,
            sampling: Sampling::Mean,
            wheel_radii: 0.08.into(),
            track_width: 0.32,
            joints: vec![("lift".into(), true)],
            rows: vec![row(-0.1, 0.1), row(-0.1, 0.1), row(0.2, 0.2), row(0.0, 0.0)],
        }
    }

    #[test]
    fn a_turn_on_the_spot_has_the_least_radius_and_a_straight_none() {
        let radii: Vec<f64> = radius_chart(&table()).series[0].points.iter().map(|p| p[1]).collect();
        assert_eq!(radii[..2], [0.1, 0.1]);
        assert!(radii[2].is_nan() && radii[3].is_nan());
    }

    #[test]
    fn a_page_of_charts_is_well_formed_and_the_same_each_time() {
        let page = || {
            let mut charts = joint_charts(&table(), None);
            charts.push(wheel_chart(&table(), None));
            charts.push(radius_chart(&table()));
            let panels = charts.into_iter().map(Panel::Chart).collect();
            Figure { title: "a < b".into(), lines: vec!["one".into()], panels }.to_svg()
        };
        let text = page();
        let tree = roxmltree::Document::parse(&text).expect("well-formed");
        let said: Vec<&str> = tree.descendants().filter_map(|n| n.text()).collect();
        for expected in ["a < b", "one", "Joint lift", "position m", "Wheels", "radius mm"] {
            assert!(said.contains(&expected), "{expected}");
        }
        assert_eq!(text, page());
    }

    #[test]
    fn the_states_drawn_are_those_replayed() {
        let table = table();
        let states = states(&table);
        let end = states[3].0;
        let yaw = 2.0 * 0.1 * 0.2 / 0.32;
        assert!((end.yaw - yaw).abs() < 1e-12 && (end.x - 1.0 - 0.02 * real::cos(yaw)).abs() < 1e-12);
    }
}
