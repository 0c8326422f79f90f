//! What `trajc compile` prints for a person: one screen with the verdict, the figures it rests on and what to do next.

use std::f64::consts::PI;
use std::fmt::Write;

use super::schema::{CertificatePart, LimitPart, Report, Status};
use crate::certify::{END_ANGLE_TOLERANCE, END_POINT_TOLERANCE};

/// What a summary says beside the report.
#[derive(Debug, Clone, Copy)]
pub struct SummaryInputs<'a> {
    /// The mission's name.
    pub mission: &'a str,
    /// The report.
    pub report: &'a Report,
    /// The output folder as the user knows it.
    pub folder: &'a str,
    /// Names of the files written there, in the order to list them.
    pub files: &'a [&'a str],
}

/// Actuators listed; more are counted.
const ACTUATORS: usize = 8;
/// Lines are broken before this column.
const WIDTH: usize = 100;

/// The text, ends in a newline. Values are rounded for reading; report.json has all digits.
pub fn render(inputs: &SummaryInputs<'_>) -> String {
    match inputs.report.status {
        Status::Certified => certified(inputs),
        Status::Failed => failed(inputs),
    }
}

fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

fn certified(inputs: &SummaryInputs<'_>) -> String {
    let report = inputs.report;
    let mut out = format!("{}: CERTIFIED\n\n", inputs.mission);
    motion(&mut out, report);
    if let Some(certificate) = &report.certificate {
        clearance(&mut out, certificate);
        own_links(&mut out, report);
        goal(&mut out, certificate);
    }
    limits(&mut out, report);
    path_error(&mut out, report);
    files(&mut out, inputs);
    out += "\nProven over the model of robot and map; wheel slip and tracking errors are not in it.\n";
    if let Some(file) = inputs.files.iter().find(|f| f.starts_with("commands.") && !f.ends_with(".d")) {
        let _ = writeln!(out, "Next: trajc check {}", shell(&join(inputs.folder, file)));
    }
    out
}

fn failed(inputs: &SummaryInputs<'_>) -> String {
    let report = inputs.report;
    let stage = report.failure.as_ref().map_or("unknown", |f| f.stage.as_str());
    let mut out = format!("{}: FAILED in {stage}; no command file\n\n", inputs.mission);
    if let Some(failure) = &report.failure {
        for (i, reason) in failure.reason.split("; ").enumerate() {
            line(&mut out, if i == 0 { "reason" } else { "" }, reason);
        }
        for (key, value) in &failure.numbers {
            if let serde_json::Value::Number(number) = value {
                line(&mut out, "", &format!("{key} = {number}"));
            }
        }
    }
    motion(&mut out, report);
    if let Some(certificate) = &report.certificate {
        clearance(&mut out, certificate);
        own_links(&mut out, report);
        limits(&mut out, report);
    }
    files(&mut out, inputs);
    out
}

/// One labelled line, broken at spaces.
fn line(out: &mut String, label: &str, text: &str) {
    let mut current = format!("  {label:<12}");
    let indent = current.len();
    for word in text.split(' ') {
        if current.len() > indent && current.chars().count() + 1 + word.chars().count() > WIDTH {
            let _ = writeln!(out, "{}", current.trim_end());
            current = " ".repeat(indent);
        }
        if current.len() > indent {
            current.push(' ');
        }
        current += word;
    }
    let _ = writeln!(out, "{}", current.trim_end());
}

fn motion(out: &mut String, report: &Report) {
    let mut parts = Vec::new();
    if let Some(commands) = &report.commands {
        parts.push(format!(
            "{} s in {} rows of {} s ({})",
            figure(commands.duration_s),
            commands.rows,
            commands.sampling_time_s,
            commands.sampling
        ));
    }
    if let Some(metrics) = report.trajectory.as_ref().and_then(|t| t.metrics) {
        parts.insert(0, format!("{} m", figure(metrics.length_m)));
    }
    if !parts.is_empty() {
        line(out, "motion", &parts.join(", "));
    }
    let mut parts = Vec::new();
    if let Some(trajectory) = &report.trajectory {
        parts.push(match trajectory.source.as_str() {
            "optimised" => format!("optimised, {}", counted(trajectory.pieces, "piece")),
            "search" if report.search.as_ref().is_some_and(|s| s.length_m == 0.0) => "on the spot".to_string(),
            "search" => "the search's own (stop, turn, go): no smooth one could be certified".to_string(),
            _ => format!("given, {}", counted(trajectory.pieces, "piece")),
        });
        if let (Some(iterations), Some(ending)) = (trajectory.iterations, &trajectory.ending) {
            parts.push(format!("{iterations} iterations, {}", ending.replace('_', " ")));
        }
    }
    if let Some(profile) = &report.profile {
        parts.push(format!("time law {}", profile.time_law));
    }
    if !parts.is_empty() {
        line(out, "path", &parts.join(", "));
    }
}

fn clearance(out: &mut String, certificate: &CertificatePart) {
    let Some(required) = certificate.clearance_required_m else {
        line(out, "clearance", "no map: not checked");
        return;
    };
    let proven = match certificate.clearance_proven_m {
        Some(proven) if proven >= super::schema::FAR => "no obstacle anywhere".to_string(),
        Some(proven) => {
            let margin = match proven - required {
                short if short < 0.0 => format!("{} m short", figure(-short)),
                margin => format!("{} m to spare", figure(margin)),
            };
            format!("{} m proven, {required} m required: {margin}", figure(proven))
        }
        None => format!("nothing proven, {required} m required"),
    };
    line(out, "clearance", &proven);
    if let Some(closest) = &certificate.closest {
        let what = match &closest.obstacle {
            Some(b) => {
                let at = [0, 1, 2].map(|i| format!("{:.2}", 0.5 * (b.min[i] + b.max[i])));
                format!("the obstacle at ({}) m", at.join(", "))
            }
            None => "unseen space".to_string(),
        };
        let (distance, link) = (figure(closest.distance_m), &closest.link);
        line(out, "", &format!("closest at {} s: {link} is {distance} m from {what}", figure(closest.time_s)));
    }
}

/// The robot's links against each other; nothing where none move.
fn own_links(out: &mut String, report: &Report) {
    let ignored = report.robot.as_ref().map_or(&[][..], |robot| &robot.ignored_pairs);
    let count = |reason: &str| ignored.iter().filter(|pair| pair.reason == reason).count();
    let left_out = [
        ("named", "named in robot.yaml"),
        ("always_touch", "touch always"),
        ("telescope", "telescope"),
        ("touch_at_rest", "touch at rest"),
    ]
    .iter()
    .filter_map(|(reason, words)| Some(count(reason)).filter(|n| *n > 0).map(|n| format!("{n} {words}")))
    .collect::<Vec<_>>();
    let left_out = if left_out.is_empty() { String::new() } else { format!("; not checked: {}", left_out.join(", ")) };
    let said = match report.certificate.as_ref().and_then(|c| c.own_links) {
        Some(own) if own.keep_apart => format!("{} kept apart{left_out}", counted(own.pairs_checked, "pair")),
        Some(own) => format!("not kept apart; {} checked{left_out}", counted(own.pairs_checked, "pair")),
        None if left_out.is_empty() => return,
        None => left_out.trim_start_matches("; ").to_string(),
    };
    line(out, "own links", &said);
}

fn goal(out: &mut String, certificate: &CertificatePart) {
    let Some(point) = certificate.end_point_error_m else { return };
    let degrees = |rad: f64| figure(rad * 180.0 / PI);
    let (mut missed, mut allowed) = (figure(1e3 * point) + " mm", figure(1e3 * END_POINT_TOLERANCE) + " mm");
    if let Some(heading) = certificate.end_heading_error_rad {
        missed += &format!(" and {}°", degrees(heading));
        allowed += &format!(" and {}°", degrees(END_ANGLE_TOLERANCE));
    }
    line(out, "goal", &format!("reached within {missed}; {allowed} are allowed"));
}

fn limits(out: &mut String, report: &Report) {
    let mut actuators: Vec<&str> = Vec::new();
    for row in &report.limits {
        if !actuators.contains(&row.actuator.as_str()) {
            actuators.push(&row.actuator);
        }
    }
    let prismatic = |name: &str| {
        let joints = report.robot.as_ref().map_or(&[][..], |r| &r.joints);
        name == "wheel_left" || name == "wheel_right" || joints.iter().any(|j| j.name == name && j.prismatic)
    };
    let width = actuators.iter().take(ACTUATORS).map(|a| a.chars().count()).max().unwrap_or(0);
    for (i, actuator) in actuators.iter().take(ACTUATORS).enumerate() {
        let unit = if prismatic(actuator) { "m" } else { "rad" };
        let cells: Vec<String> = ["speed", "acceleration", "jerk"]
            .iter()
            .zip(["/s", "/s²", "/s³"])
            .filter_map(|(quantity, per)| {
                let row = report.limits.iter().find(|r| r.actuator == *actuator && r.quantity == *quantity)?;
                Some(limit(row, &format!("{unit}{per}")))
            })
            .collect();
        let label = if i == 0 { "limits" } else { "" };
        let cells: Vec<String> = cells.iter().map(|c| format!("{c:<30}")).collect();
        let _ = writeln!(out, "{}", format!("  {label:<12}{actuator:<width$}  {}", cells.join("")).trim_end());
    }
    if actuators.len() > ACTUATORS {
        line(out, "", &format!("and {} more in report.json", actuators.len() - ACTUATORS));
    }
}

/// Peak, limit, and what is left of the limit.
fn limit(row: &LimitPart, unit: &str) -> String {
    let peak = row.peak.map_or("?".to_string(), figure);
    match (row.peak, row.limit) {
        (Some(value), Some(limit)) if limit > 0.0 && value <= limit * (1.0 + 1e-9) => {
            // Rounded down, so that «0 % left» is never shown as more.
            let left = (100.0 * (1.0 - value / limit)).max(0.0).floor();
            format!("{peak} of {} {unit}, {left}% left", figure(limit))
        }
        (_, Some(limit)) => format!("{peak} of {} {unit}, OVER", figure(limit)),
        (_, None) => format!("{peak} {unit}, no limit"),
    }
}

fn path_error(out: &mut String, report: &Report) {
    let Some(commands) = &report.commands else { return };
    let row = report
        .path_error
        .iter()
        .find(|r| (r.sampling_time_s - commands.sampling_time_s).abs() < 1e-9 && r.sampling == commands.sampling)
        .or_else(|| report.path_error.iter().find(|r| (r.sampling_time_s - commands.sampling_time_s).abs() < 1e-9));
    if let Some(row) = row {
        let text = format!(
            "at most {} mm off the path, {} mm RMS, {} mm at the end, at {} s",
            figure(1e3 * row.lateral_max_m),
            figure(1e3 * row.lateral_rms_m),
            figure(1e3 * row.end_point_m),
            row.sampling_time_s
        );
        line(out, "path error", &text);
    }
}

fn files(out: &mut String, inputs: &SummaryInputs<'_>) {
    if !inputs.files.is_empty() {
        line(out, "files", &format!("{}: {}", join(inputs.folder, ""), inputs.files.join(" ")));
    }
}

fn join(folder: &str, file: &str) -> String {
    format!("{}/{file}", folder.trim_end_matches('/'))
}

/// A path as a POSIX shell takes it.
fn shell(path: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "/._-+=:,@%".contains(c);
    if path.chars().all(plain) { path.to_string() } else { format!("'{}'", path.replace('\'', "'\\''")) }
}

/// Four significant digits, no trailing zeros, no exponent.
fn figure(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".into() } else { "?".into() };
    }
    let digits = (3 - value.abs().log10().floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text.trim_start_matches('-') == "0" { "0".into() } else { text.to_string() }
}

#[cfg(test)]
mod tests;
