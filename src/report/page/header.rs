//! The top of the page: verdict, key figures, and the frame of the view.

use std::fmt::Write;

use super::html::{definitions, escape, instant, section};
use super::{Distances, PageInputs, at_least_mm, counted, degrees, figure, grouped, mm, plots};
use crate::report::schema::{FAR, LimitPart, Report, Status};

/// The verdict in a word.
pub(super) fn verdict(report: &Report) -> &'static str {
    match report.status {
        Status::Certified => "certified",
        Status::Failed => "failed",
    }
}

/// Mission, verdict, a sentence, key figures.
pub(super) fn header(inputs: &PageInputs<'_>) -> String {
    let report = inputs.report;
    let verdict = verdict(report);
    let robot = report.robot.as_ref().map(|r| format!("robot {}", r.name));
    let map = report.inputs.map.as_ref().map(|m| format!("map {}", m.path));
    let about: Vec<String> = robot.into_iter().chain(map).map(|part| escape(&part)).collect();
    let mut out = format!(
        "<header>\n<p class=\"eyebrow\">trajc mission report</p>\n<div class=\"title\"><h1>{}</h1>\
         <p class=\"verdict {verdict}\">{verdict}</p></div>\n<p class=\"about\">{}</p>\n",
        escape(inputs.mission),
        about.join(" · "),
    );
    let figures = key_figures(report);
    if !figures.is_empty() {
        out += &definitions("key", &figures);
    }
    out + "</header>\n"
}

/// A large figure and a small line below it.
fn key(name: &str, value: &str, below: &str) -> (String, String) {
    (name.to_owned(), format!("{} <small>{}</small>", escape(value), escape(below)))
}

fn key_figures(report: &Report) -> Vec<(String, String)> {
    let mut out = Vec::new();
    for (name, value, below) in report.failure.iter().flat_map(super::failure::key_figures) {
        out.push(key(name, &value, &below));
    }
    if let Some(commands) = &report.commands {
        let length =
            report.trajectory.as_ref().and_then(|t| t.metrics).map(|m| format!("{} m driven", figure(m.length_m)));
        let below = length.unwrap_or_else(|| counted(commands.rows, "row"));
        out.push(key("Duration", &format!("{} s", figure(commands.duration_s)), &below));
    }
    if let Some(certificate) = &report.certificate {
        match (certificate.clearance_required_m, certificate.clearance_proven_m) {
            (Some(required), Some(proven)) if proven < FAR => {
                out.push(key("Clearance proven", &at_least_mm(proven), &format!("{} required", mm(required))));
            }
            (Some(required), Some(_)) => {
                out.push(key("Clearance", "no obstacle", &format!("{} required", mm(required))))
            }
            (Some(required), None) => out.push(key("Clearance", "not proven", &format!("{} required", mm(required)))),
            (None, _) => out.push(key("Clearance", "not checked", "the mission has no map")),
        }
    }
    if let Some((name, value, below)) = report.trust.as_ref().and_then(super::trust::key) {
        out.push(key(name, &value, &below));
    }
    if let Some((row, share)) = tightest(&report.limits) {
        let name = format!("{} {}", row.actuator.replace('_', " "), row.quantity);
        out.push(key("Closest to a limit", &super::percent(share), &format!("of {name}")));
    }
    if let Some(row) = plots::own_row(report) {
        out.push(key("Path error", &mm(row.lateral_max_m), &format!("at most, at {} s a row", row.sampling_time_s)));
    }
    let link = report.certificate.as_ref().and_then(|certificate| certificate.link.as_ref());
    if let Some(link) = link {
        let turned = link.angle_error_rad.map_or(String::new(), |a| format!(", and {} of its turn", degrees(a)));
        out.push(key("Off the goal", &mm(link.point_error_m), &format!("of link {}{turned}", link.name)));
    } else if let Some(certificate) = &report.certificate
        && let Some(error) = certificate.end_point_error_m
    {
        let heading = certificate
            .end_heading_error_rad
            .map_or("heading left open".into(), |a| format!("and {} of heading", degrees(a)));
        let name = if certificate.goal_within_m.is_some() { "From the goal's middle" } else { "Off the goal" };
        out.push(key(name, &mm(error), &heading));
    }
    out
}

/// The limit of which most is used, and how much.
pub(super) fn tightest(limits: &[LimitPart]) -> Option<(&LimitPart, f64)> {
    let share = |row: &LimitPart| Some(row.peak? / row.limit.filter(|limit| *limit > 0.0)?);
    limits.iter().filter_map(|row| Some((row, share(row)?))).max_by(|a, b| a.1.total_cmp(&b.1))
}

/// The view: a canvas that the script draws on, its controls, what it shows at an instant, and the clearance over time.
pub(super) fn view(inputs: &PageInputs<'_>, distances: Option<&Distances>, factor: usize) -> String {
    if inputs.robot.is_none() {
        return String::new();
    }
    let motion = inputs.motion();
    let mut out = String::from(include_str!("view.html"));
    if let Some((table, _)) = motion {
        let joints: String = table
            .joints
            .iter()
            .enumerate()
            .map(|(j, (name, _))| format!("<div><dt>{}</dt><dd data-show=\"joint{j}\">–</dd></div>\n", escape(name)))
            .collect();
        let clearance = if distances.is_some() {
            "<div><dt>clearance</dt><dd data-show=\"clearance\">–</dd></div>\n"
        } else {
            ""
        };
        out += &super::fill(
            include_str!("player.html"),
            &[("end", &format!("{}", table.duration())), ("joints", &joints), ("clearance", clearance)],
        );
    } else {
        out += "<div id=\"places\" class=\"controls\" role=\"group\" aria-label=\"Look at\"></div>\n";
    }
    out += "</figure>\n";
    if let Some(distances) = distances {
        out += &plots::clearance(inputs, distances);
    }
    let mut notes = Vec::new();
    if factor > 1
        && let Some(map) = inputs.map
    {
        notes.push(format!(
            "The map is large: it is drawn in cells of {} m, solid where any cell of {} m in them is. Nothing was proven with these.",
            figure(map.resolution * factor as f64),
            figure(map.resolution)
        ));
    }
    if inputs.map.is_none() {
        notes.push("The mission has no map: nothing is drawn around the path, and clearance was not checked.".into());
    }
    let every = motion.map_or(1, |(table, _)| super::scene::stride(table));
    if let Some((table, _)) = motion.filter(|_| every > 1) {
        let rows = grouped(table.rows.len());
        notes.push(format!("Of {rows} rows one of every {every} is shown here; the command file has all."));
    }
    if motion.is_some() {
        notes.push(
            "The robot is drawn with all its collision shapes where the commands, held row by row, put it.".into(),
        );
    }
    for note in notes {
        let _ = writeln!(out, "<p class=\"note\">{}</p>", escape(&note));
    }
    if let Some(closest) = inputs.report.certificate.as_ref().and_then(|c| c.closest.as_ref()) {
        let what = if closest.obstacle.is_some() { "the marked obstacle" } else { "unseen space beyond the map" };
        let _ = writeln!(
            out,
            "<p class=\"note\">Closest at {}: <b>{}</b> is {} from {what}.</p>",
            instant(closest.time_s),
            escape(&closest.link),
            mm(closest.distance_m)
        );
    }
    section("view", if motion.is_some() { "The motion" } else { "Where it failed" }, &out)
}
