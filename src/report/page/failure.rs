//! Why a mission failed: the reason, and its figures in words.

use serde_json::{Map, Value};

use super::html::{self, definitions, escape};
use super::{PageInputs, degrees, figure, grouped, mm};
use crate::report::schema::Failure;

/// What is said of a figure.
enum Say {
    /// Of a number.
    Number(fn(f64) -> String),
    /// A text as it is.
    Text,
    /// A place on the floor, its figures' names begin so: `_x_m`, `_y_m` and, if there, `_yaw_rad` follow.
    Pose,
    /// Joints with their values.
    Joints,
}

/// Figures that words exist for, in the order in which they are told; others follow with their names.
const KNOWN: [(&str, &str, Say); 18] = [
    ("missing_m", "Missing", Say::Number(missing)),
    ("closest", "Closest pose reached", Say::Pose),
    ("closest_to_goal_m", "From there to the goal", Say::Number(metres)),
    ("tightest", "Tightest place of the best way", Say::Pose),
    ("tightest_posture", "Joints there", Say::Joints),
    ("tightest_link", "Link that is too close", Say::Text),
    ("tightest_clearance_m", "Its clearance", Say::Number(room)),
    ("narrowest_gap", "Narrowest place of the widest way", Say::Pose),
    ("narrowest_gap_m", "Its width", Say::Number(metres)),
    ("least_gap_needed_m", "Width that the base needs", Say::Number(metres)),
    ("link", "Link in the way", Say::Text),
    ("posture", "Joints there", Say::Joints),
    ("clearance_m", "Its clearance", Say::Number(room)),
    ("clearance_required_m", "Clearance required", Say::Number(mm)),
    ("nearest_free", "Nearest free pose", Say::Pose),
    ("at_fault", "Shut in is the", Say::Text),
    ("expanded", "States searched", Say::Number(|v| grouped(v as usize))),
    ("labels", "Partial paths made", Say::Number(|v| grouped(v as usize))),
];

fn metres(value: f64) -> String {
    format!("{} m", figure(value))
}

/// A gap or room that is too small: in cm, as people say it.
fn missing(value: f64) -> String {
    format!("{} cm", figure((1e3 * value).ceil() / 10.0))
}

/// A distance from an obstacle, or how deep it is in.
fn room(value: f64) -> String {
    if value < 0.0 { format!("none: {} deep in the obstacle", mm(-value)) } else { mm(value) }
}

/// The figures to say first, for the page's top: name, value, what is below it.
pub(super) fn key_figures(failure: &Failure) -> Vec<(&'static str, String, String)> {
    let value = |key: &str| failure.numbers.get(key).and_then(Value::as_f64);
    let mut out = Vec::new();
    if let Some(v) = value("missing_m") {
        let link = ["tightest_link", "link"].into_iter().find_map(|key| failure.numbers.get(key)?.as_str());
        out.push(("Missing", missing(v), link.map_or("of room".into(), |link| format!("of room for {link}"))));
    }
    if let Some(v) = value("closest_to_goal_m") {
        out.push(("Got as close as", metres(v), "to the goal".into()));
    }
    let gap = value("narrowest_gap_m").zip(value("least_gap_needed_m"));
    if let Some((width, needed)) = gap.filter(|(width, needed)| width < needed) {
        out.push(("Narrowest gap", metres(width), format!("the base needs {}", metres(needed))));
    }
    if let Some(v) = value("expanded") {
        out.push(("Searched", grouped(v as usize), "states".into()));
    }
    out
}

/// The stage, the reason and its figures; nothing for a mission that is certified.
pub(super) fn section(inputs: &PageInputs<'_>) -> String {
    let Some(failure) = &inputs.report.failure else { return String::new() };
    let mut body = format!(
        "<div class=\"alert\"><p><b>{}</b> There is no command file.</p>\n<p class=\"reason\">{}</p></div>\n",
        escape(stage(failure)),
        escape(&failure.reason)
    );
    body += &format!("<p class=\"note\">Code <code>{}</code></p>\n", escape(&failure.code));
    html::section("failure", "Why it failed", &body)
}

/// All figures of a failure; nothing for a mission that is certified.
pub(super) fn details(inputs: &PageInputs<'_>) -> String {
    let Some(failure) = &inputs.report.failure else { return String::new() };
    let mut body = String::new();
    let figures = figures(&failure.numbers);
    if !figures.is_empty() {
        body += &definitions("proof", &figures);
    }
    if let Some(list) = failure.numbers.get("refusals").and_then(Value::as_array) {
        let items = list.iter().filter_map(|entry| {
            let at = entry.get("time_s").and_then(Value::as_f64);
            let at = at.map_or(String::new(), |t| format!(" ({})", html::instant(t)));
            Some(format!("<li>{}{at}</li>\n", escape(entry.get("message")?.as_str()?)))
        });
        body += &format!("<ul>\n{}</ul>\n", items.collect::<String>());
    }
    if body.is_empty() { body } else { html::section("figures", "What was found", &body) }
}

/// What the stage did not find.
fn stage(failure: &Failure) -> &str {
    match failure.stage.as_str() {
        "search" => "Failed in the search: no way was found.",
        "certify" => "Failed in the certificate: a motion was found, but it is not proven.",
        "retime" | "command" => "Failed in the timing: the path cannot be driven within the limits.",
        _ => "Failed before a motion was planned.",
    }
}

fn figures(numbers: &Map<String, Value>) -> Vec<(String, String)> {
    let mut out = Vec::new();
    let mut told = vec!["refusals".to_owned(), "places".to_owned()];
    for (key, label, say) in KNOWN {
        let value = |end: &str| numbers.get(&format!("{key}{end}"));
        let number = |end: &str| value(end).and_then(Value::as_f64);
        let text = match say {
            Say::Number(say) => number("").map(say),
            Say::Text => value("").and_then(Value::as_str).map(str::to_owned),
            Say::Joints => value("").and_then(Value::as_object).filter(|posture| !posture.is_empty()).map(joints),
            Say::Pose => number("_x_m").zip(number("_y_m")).map(|(x, y)| {
                let heading = number("_yaw_rad").map_or(String::new(), |a| format!(", heading {}", degrees(a)));
                format!("({x:.2}, {y:.2}) m").replace('-', "−") + &heading
            }),
        };
        match say {
            Say::Pose => told.extend(["_x_m", "_y_m", "_yaw_rad"].map(|end| format!("{key}{end}"))),
            _ => told.push(key.to_owned()),
        }
        out.extend(text.map(|text| (label.to_owned(), escape(&text))));
    }
    for (key, v) in numbers.iter().filter(|(key, _)| !told.contains(key)) {
        let text = match v {
            Value::String(text) => text.clone(),
            Value::Number(n) => n.as_f64().map_or_else(|| n.to_string(), figure),
            _ => continue,
        };
        out.push((key.replace('_', " "), escape(&text)));
    }
    out
}

fn joints(posture: &Map<String, Value>) -> String {
    let of = |(name, value): (&String, &Value)| format!("{name} {}", value.as_f64().map_or("–".into(), figure));
    posture.iter().map(of).collect::<Vec<_>>().join(", ")
}
