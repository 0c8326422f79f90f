//! Why a mission failed: the reason, and its figures in words.

use serde_json::{Map, Value};

use super::html::{self, definitions, escape};
use super::{PageInputs, degrees, figure, grouped, mm};
use crate::report::schema::Failure;

/// Figures that words exist for: name, label, how it is said. The others follow with their names.
const KNOWN: [(&str, &str, fn(f64) -> String); 9] = [
    ("missing_m", "Missing", missing),
    ("closest_to_goal_m", "From there to the goal", metres),
    ("narrowest_gap_m", "Narrowest place of the widest way", metres),
    ("least_gap_needed_m", "The base needs at least", metres),
    ("tightest_clearance_m", "Clearance there", mm),
    ("clearance_m", "Clearance there", mm),
    ("clearance_required_m", "Clearance required", mm),
    ("expanded", "States searched", |v| grouped(v as usize)),
    ("labels", "Partial paths made", |v| grouped(v as usize)),
];

/// Poses by the beginning of their figures' names, and their labels.
const POSES: [(&str, &str); 4] = [
    ("closest", "Closest pose reached"),
    ("narrowest_gap", "Narrowest place at"),
    ("tightest", "Too tight at"),
    ("nearest_free", "Nearest free pose"),
];

fn metres(value: f64) -> String {
    format!("{} m", figure(value))
}

/// A gap or room that is too small: in cm, as people say it.
fn missing(value: f64) -> String {
    format!("{} cm", figure((1e3 * value).ceil() / 10.0))
}

/// The stage, the reason and its figures; nothing for a mission that is certified.
pub(super) fn section(inputs: &PageInputs<'_>) -> String {
    let Some(failure) = &inputs.report.failure else { return String::new() };
    let mut body = format!(
        "<div class=\"alert\"><p><b>{}</b> There is no command file.</p>\n<p class=\"reason\">{}</p></div>\n",
        escape(stage(failure)),
        escape(&failure.reason)
    );
    let figures = figures(&failure.numbers);
    if !figures.is_empty() {
        body += &definitions("proof", &figures);
    }
    if let Some(list) = failure.numbers.get("refusals").and_then(Value::as_array) {
        let items = list.iter().filter_map(|entry| {
            let at = entry
                .get("time_s")
                .and_then(Value::as_f64)
                .map_or(String::new(), |t| format!(" ({})", html::instant(t)));
            Some(format!("<li>{}{at}</li>\n", escape(entry.get("message")?.as_str()?)))
        });
        body += &format!("<ul>\n{}</ul>\n", items.collect::<String>());
    }
    body += &format!("<p class=\"note\">Code <code>{}</code></p>\n", escape(&failure.code));
    html::section("failure", "Why it failed", &body)
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
    let value = |key: &str| numbers.get(key).and_then(Value::as_f64);
    let mut out = Vec::new();
    let mut said: Vec<String> = ["refusals", "places"].map(str::to_owned).to_vec();
    for (prefix, label) in POSES {
        let keys = ["x_m", "y_m", "yaw_rad"].map(|end| format!("{prefix}_{end}"));
        if let (Some(x), Some(y)) = (value(&keys[0]), value(&keys[1])) {
            let heading = value(&keys[2]).map_or(String::new(), |a| format!(", heading {}", degrees(a)));
            out.push((label.to_owned(), escape(&format!("({x:.2}, {y:.2}) m{heading}").replace('-', "−"))));
            said.extend(keys);
        }
        for key in [format!("{prefix}_posture")].into_iter().chain((prefix == "tightest").then(|| "posture".to_owned()))
        {
            if let Some(posture) = numbers.get(&key).and_then(Value::as_object).filter(|p| !p.is_empty()) {
                let joints =
                    posture.iter().map(|(name, v)| format!("{name} {}", v.as_f64().map_or("–".into(), figure)));
                out.push(("with joints at".into(), escape(&joints.collect::<Vec<_>>().join(", "))));
            }
            said.push(key);
        }
    }
    for key in ["tightest_link", "link"] {
        if let Some(link) = numbers.get(key).and_then(Value::as_str) {
            out.push(("Link in the way".into(), escape(link)));
            said.push(key.to_owned());
        }
    }
    if let Some(end) = numbers.get("at_fault").and_then(Value::as_str) {
        out.push(("Shut in".into(), escape(&format!("the {end}"))));
        said.push("at_fault".into());
    }
    for (key, label, say) in KNOWN {
        if let Some(v) = value(key) {
            out.push((label.to_owned(), escape(&say(v))));
            said.push(key.to_owned());
        }
    }
    for (key, v) in numbers.iter().filter(|(key, _)| !said.contains(key)) {
        let text = match v {
            Value::String(text) => text.clone(),
            Value::Number(n) => n.as_f64().map_or_else(|| n.to_string(), figure),
            _ => continue,
        };
        out.push((key.replace('_', " "), escape(&text)));
    }
    out
}
