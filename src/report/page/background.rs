//! How the motion came about: initial against optimised, and the figures of the run.

use super::html::{self, Cell, definitions, escape, section};
use super::{PageInputs, counted, figure, grouped};
use crate::report::schema::InputFile;
use crate::report::{Metrics, metrics};

/// Of a metric: what it is, its unit, its value.
type Row = (&'static str, &'static str, fn(&Metrics) -> f64);

const ROWS: [Row; 6] = [
    ("Length", "m", |m| m.length_m),
    ("Time", "s", |m| m.time_s),
    ("Mean jerk", "m/s³", |m| m.mean_jerk_mps3),
    ("Mean acceleration", "m/s²", |m| m.mean_acceleration_mps2),
    ("Mean angular acceleration", "rad/s²", |m| m.mean_angular_acceleration_rads2),
    ("Mean joint jerk", "rad/s³", |m| m.mean_joint_jerk_rads3),
];

/// The search's first path, the trajectory, and the commands, side by side.
pub(super) fn comparison(inputs: &PageInputs<'_>) -> String {
    let report = inputs.report;
    let initial = report.initial.as_ref().map(|i| i.metrics);
    let trajectory = report.trajectory.as_ref();
    let own = trajectory.and_then(|t| t.metrics);
    let commanded = inputs.motion().map(|(table, _)| metrics::of_commands(table));
    if own.is_none() && initial.is_none() {
        return String::new();
    }
    let optimised = trajectory.is_some_and(|t| t.source == "optimised");
    let columns: Vec<(&str, Metrics)> =
        [("Initial", initial), ("Optimised", own.filter(|_| optimised)), ("As commanded", commanded)]
            .into_iter()
            .filter_map(|(name, metrics)| Some((name, metrics?)))
            .collect();
    let joints = columns.iter().any(|(_, m)| m.mean_joint_jerk_rads3 != 0.0);
    let mut head = vec![("Figure", false)];
    head.extend(columns.iter().map(|(name, _)| (*name, true)));
    let change = initial.zip(commanded).is_some();
    if change {
        head.push(("Change", true));
    }
    let cells = |(name, unit, value): &Row| {
        let mut row = vec![Cell { html: format!("{name} <small>{unit}</small>"), number: false }];
        row.extend(columns.iter().map(|(_, m)| html::number(figure(value(m)))));
        if let Some((a, b)) = initial.zip(commanded) {
            let (a, b) = (value(&a), value(&b));
            let text =
                if a > 1e-9 { format!("{:+.0} %", 100.0 * (b / a - 1.0)).replace('-', "−") } else { "–".into() };
            row.push(html::number(text));
        }
        row
    };
    let rows: Vec<Vec<Cell>> = ROWS.iter().take(if joints { 6 } else { 5 }).map(cells).collect();
    let mut text = Vec::new();
    if initial.is_some() {
        text.push("Initial: the search's path on its lattice, timed by trapezoids of speed.");
    }
    if optimised {
        text.push("Optimised: the smooth trajectory in its own timing, which says how smooth the path is.");
    }
    if commanded.is_some() {
        text.push("As commanded: what the robot does, the time law's timing included.");
    }
    if change {
        text.push("Change: from initial to as commanded.");
    }
    if trajectory.is_some_and(|t| t.source == "search") {
        text.push("No smooth trajectory could be certified: the robot drives the search's own path, with stops.");
    }
    let heading = if initial.is_some() { "Initial against optimised" } else { "How smooth" };
    let body = format!("<p>{}</p>\n{}", text.join(" "), html::table("Length, time and smoothness", &head, &rows));
    section("comparison", heading, &body)
}

/// Figures of every stage, and the inputs.
pub(super) fn run(inputs: &PageInputs<'_>) -> String {
    let report = inputs.report;
    let mut rows: Vec<(String, String)> = Vec::new();
    let mut row = |name: &str, parts: Vec<String>| {
        if !parts.is_empty() {
            rows.push((name.to_owned(), escape(&parts.join(", "))));
        }
    };
    if let Some(robot) = &report.robot {
        row(
            "Robot",
            vec![
                robot.name.clone(),
                counted(robot.shapes, "collision shape"),
                counted(robot.joints.len(), "moving joint"),
                format!("wheels of {} m radius, {} m apart", figure(robot.wheel_radius_m), figure(robot.track_width_m)),
            ],
        );
    }
    if let Some(map) = &report.map {
        let [x, y, z] = map.dims;
        let mut parts = vec![
            format!("{x} × {y} × {z} cells of {} m", figure(map.resolution_m)),
            format!("{} occupied", grouped(map.occupied)),
        ];
        for (count, what) in [
            (map.points, "points read"),
            (map.cut, "cut by height"),
            (map.unknown, "occupied as unknown"),
            (map.not_finite, "not finite"),
        ] {
            if count > 0 {
                parts.push(format!("{} {what}", grouped(count)));
            }
        }
        row("Map", parts);
    }
    if let Some(search) = &report.search {
        row(
            "Search",
            vec![
                format!("{} expanded", counted(search.expanded, "state")),
                format!("path of {} m", figure(search.length_m)),
            ],
        );
    }
    if let Some(t) = &report.trajectory {
        let source = match t.source.as_str() {
            "optimised" => "optimised".to_owned(),
            "search" => "the search's own path".to_owned(),
            other => other.to_owned(),
        };
        let mut parts = vec![source, counted(t.pieces, "piece")];
        parts.extend(
            t.parameterisation.as_ref().map(|p| {
                format!("polynomials of {}", if p == "flat" { "positions" } else { "heading and arc length" })
            }),
        );
        parts.extend(t.iterations.map(|n| counted(n, "iteration")));
        parts.extend(t.ending.as_ref().map(|e| e.replace('_', " ")));
        row("Trajectory", parts);
    }
    if let Some(p) = &report.profile {
        let mut parts = vec![format!("law {}", p.time_law), format!("{} s", figure(p.time_s))];
        parts.extend(p.v_max_mps.map(|v| format!("{} m/s at most", figure(v))));
        row("Timing", parts);
    }
    if let Some(c) = &report.commands {
        row(
            "Commands",
            vec![
                counted(c.rows, "row"),
                format!("held {} s each", c.sampling_time_s),
                format!("sampling {}", c.sampling),
            ],
        );
    }
    let inputs = &report.inputs;
    let files: Vec<&InputFile> = std::iter::once(&inputs.mission)
        .chain(&inputs.robot)
        .chain(&inputs.map)
        .chain(&inputs.other)
        .filter(|f| !f.path.is_empty())
        .collect();
    let cells: Vec<Vec<Cell>> = files
        .iter()
        .map(|f| vec![html::text(&f.path), Cell { html: format!("<code>{}</code>", escape(&f.blake3)), number: false }])
        .collect();
    let files = match cells.is_empty() {
        true => String::new(),
        false => format!(
            "<details><summary>Files read, with their hashes</summary>\n{}</details>\n",
            html::table("Files read", &[("File", false), ("BLAKE3", false)], &cells)
        ),
    };
    section("run", "How it came about", &(definitions("proof", &rows) + &files))
}
