//! What `trajc compile` prints for a person: one screen with the verdict, the figures it rests on and what to do next.

mod limits;

use std::fmt::Write;

use super::schema::{CertificatePart, LimitPart, Report, RobotPart, Status, TolerancePart, TrustPart, ZonePart};
use crate::certify::{END_ANGLE_TOLERANCE, END_POINT_TOLERANCE, LINK_ANGLE_TOLERANCE};
use crate::math::real;
pub use limits::table as limits_table;

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
    /// The verdict is coloured.
    pub colour: bool,
}

/// Lines are broken before this column: what every terminal has.
const WIDTH: usize = 80;
/// Lengths and angles below this, in the unit that they are shown in, are told as below it.
const LEAST: f64 = 1e-3;

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
    let mut out = format!("{}: {}\n\n", inputs.mission, paint("CERTIFIED", 32, inputs.colour));
    motion(&mut out, report);
    if let Some(certificate) = &report.certificate {
        proof(&mut out, certificate, &report.limits, report.robot.as_ref());
    }
    if let Some(trust) = &report.trust {
        line(&mut out, "trust", &trust_text(trust));
    }
    path_error(&mut out, report);
    files(&mut out, inputs);
    out += match report.certificate.as_ref().and_then(|c| c.tolerance.as_ref()) {
        Some(_) => "\nProven of every robot within the tolerance; wheel slip is not in it.\n",
        None => "\nProven of the model; wheel slip and tracking errors are not in it.\n",
    };
    if let Some(file) = inputs.files.iter().find(|f| f.starts_with("commands.") && !f.ends_with(".d")) {
        let _ = writeln!(out, "Next: trajc check {}", shell(&join(inputs.folder, file)));
    }
    out
}

/// What was reached. Why it failed is the diagnostic's to say, which follows on stderr, and report.json's.
fn failed(inputs: &SummaryInputs<'_>) -> String {
    let report = inputs.report;
    let stage = report.failure.as_ref().map_or("unknown", |f| f.stage.as_str());
    let verdict = paint("FAILED", 31, inputs.colour);
    let mut out = format!("{}: {verdict} in {stage}; no command file\n\n", inputs.mission);
    motion(&mut out, report);
    if let Some(certificate) = &report.certificate {
        clearance(&mut out, certificate);
        tolerance(&mut out, certificate);
        own_links(&mut out, certificate, report.robot.as_ref());
        limits(&mut out, &report.limits, report.robot.as_ref());
    }
    files(&mut out, inputs);
    // The diagnostic follows.
    out.push('\n');
    out
}

/// Lines that tell what a certificate says. `robot` knows which joints are measured in metres.
pub fn proof(out: &mut String, certificate: &CertificatePart, peaks: &[LimitPart], robot: Option<&RobotPart>) {
    clearance(out, certificate);
    tolerance(out, certificate);
    own_links(out, certificate, robot);
    zones(out, certificate);
    goal(out, certificate);
    limits(out, peaks, robot);
}

/// Bold and in one of the terminal's eight colours.
fn paint(word: &str, colour: u8, wanted: bool) -> String {
    if wanted { format!("\x1b[1;{colour}m{word}\x1b[0m") } else { word.to_owned() }
}

/// Holds words together where a line is broken.
const TIE: &str = "\u{a0}";

/// One labelled line, broken at spaces.
pub fn line(out: &mut String, label: &str, text: &str) {
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
        current += &word.replace(TIE, " ");
    }
    let _ = writeln!(out, "{}", current.trim_end());
}

fn motion(out: &mut String, report: &Report) {
    let length = report.trajectory.as_ref().and_then(|t| t.metrics).map(|m| figure(m.length_m));
    let law = report.profile.as_ref().map(|profile| profile.time_law.as_str());
    if let Some(commands) = &report.commands {
        let length = length.map_or(String::new(), |length| format!("{length} m in "));
        let law = law.map_or(String::new(), |law| format!(", time law {law}"));
        line(out, "motion", &format!("{length}{} s{law}", figure(commands.duration_s)));
        let (rows, held) = (counted(commands.rows, "row"), commands.sampling_time_s);
        line(out, "commands", &format!("{rows} of {held} s, sampling {}", commands.sampling));
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
    if !parts.is_empty() {
        line(out, "path", &parts.join(", "));
    }
}

fn clearance(out: &mut String, certificate: &CertificatePart) {
    line(out, "clearance", &clearance_text(certificate));
    if let Some(closest) = &certificate.closest {
        let what = match &closest.obstacle {
            Some(b) => {
                let at = [0, 1, 2].map(|i| format!("{:.2}", 0.5 * (b.min[i] + b.max[i])));
                format!("the cell at ({})", at.join(&format!(",{TIE}")))
            }
            None => "unseen space".to_string(),
        };
        line(out, "", &format!("closest at {} s: {} to {what}", figure(closest.time_s), closest.link));
    }
}

/// What is proven of every robot within the tolerance; nothing where there is none.
fn tolerance(out: &mut String, certificate: &CertificatePart) {
    let Some(inside) = &certificate.tolerance else { return };
    let mut text = match inside.clearance_proven_m {
        Some(proven) if proven >= super::schema::FAR => "no obstacle anywhere".to_owned(),
        Some(proven) => format!("{} proven of every robot within it", length(proven)),
        None => "no map: clearance not checked".to_owned(),
    };
    if let Some(closest) = &inside.closest {
        let what = match &closest.obstacle {
            Some(b) => {
                let at = [0, 1, 2].map(|i| format!("{:.2}", 0.5 * (b.min[i] + b.max[i])));
                format!("the cell at ({})", at.join(&format!(",{TIE}")))
            }
            None => "unseen space".to_string(),
        };
        text += &format!(", at {} s from {what}", figure(closest.time_s));
    }
    line(out, "tolerance", &text);
}

/// How far the commands can be trusted without feedback, in words.
pub fn trust_text(trust: &TrustPart) -> String {
    let off = match (trust.end_m, trust.end_rad) {
        (Some(m), Some(rad)) => format!("off by {} and {} at the end, at most", length(m), degrees(rad)),
        _ => "off by anything at the end".to_owned(),
    };
    let whole = format!("{} m", figure(trust.length_m));
    let part = match (trust.whole, trust.trusted_m, trust.trusted_s) {
        (Some(true), ..) => format!("all {whole} without feedback, "),
        (_, Some(m), Some(s)) => format!("{} of {whole} ({} s) without feedback, ", figure(m), figure(s)),
        _ => String::new(),
    };
    let of = if trust.in_force { "within the tolerance" } else { "of usual accuracy (assumed)" };
    format!("{part}by a robot {of}: {off}; {}", tolerance_text(&trust.tolerance))
}

/// A tolerance, in words; what is zero is left out.
pub fn tolerance_text(tolerance: &TolerancePart) -> String {
    let percent = |share: f64| format!("{}{TIE}%", figure(100.0 * share));
    let parts = [
        (tolerance.wheel_radius, "wheels", percent(tolerance.wheel_radius)),
        (tolerance.wheel_difference, "difference", percent(tolerance.wheel_difference)),
        (tolerance.track, "track", percent(tolerance.track)),
        (tolerance.latency_s, "latency", format!("{}{TIE}s", figure(tolerance.latency_s))),
        (tolerance.start_m, "start", length(tolerance.start_m).replace(' ', TIE)),
        (tolerance.start_rad, "start", degrees(tolerance.start_rad)),
    ];
    let given = parts.into_iter().filter(|(value, ..)| *value > 0.0);
    let text = given.map(|(_, name, value)| format!("{name}{TIE}{value}")).collect::<Vec<_>>().join(", ");
    if text.is_empty() { "nothing is off".to_owned() } else { text }
}

/// What of the clearance is proven, in words.
pub fn clearance_text(certificate: &CertificatePart) -> String {
    let Some(required) = certificate.clearance_required_m else { return "no map: not checked".to_owned() };
    match certificate.clearance_proven_m {
        Some(proven) if proven >= super::schema::FAR => "no obstacle anywhere".to_string(),
        Some(proven) => {
            let margin = match proven - required {
                short if short < 0.0 => format!("{} short", length(-short)),
                margin => format!("{} to spare", length(margin)),
            };
            format!("{} proven, {} required: {margin}", length(proven), length(required))
        }
        None => format!("nothing proven, {} required", length(required)),
    }
}

/// The robot's links against each other; nothing where none move.
fn own_links(out: &mut String, certificate: &CertificatePart, robot: Option<&RobotPart>) {
    let ignored = robot.map_or(&[][..], |robot| &robot.ignored_pairs);
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
    let said = match certificate.own_links {
        Some(own) if own.keep_apart => format!("{} kept apart{left_out}", counted(own.pairs_checked, "pair")),
        Some(own) => format!("not kept apart; {} checked{left_out}", counted(own.pairs_checked, "pair")),
        None if left_out.is_empty() => return,
        None => left_out.trim_start_matches("; ").to_string(),
    };
    line(out, "own links", &said);
}

fn zones(out: &mut String, certificate: &CertificatePart) {
    let said = zones_text(certificate);
    if !said.is_empty() {
        line(out, "slow zones", &said.join(", "));
    }
}

/// How fast the base is in each speed zone, in words.
pub fn zones_text(certificate: &CertificatePart) -> Vec<String> {
    let zone = |zone: &ZonePart| match zone.peak_mps {
        Some(peak) => format!("{}/{}{TIE}m/s", figure(peak), figure(zone.limit_mps)),
        None => "not entered".replace(' ', TIE),
    };
    certificate.speed_zones.iter().map(zone).collect()
}

fn goal(out: &mut String, certificate: &CertificatePart) {
    let stops: Vec<String> = certificate.vias.iter().map(|via| format!("{:.1} s", via.time_s)).collect();
    if !stops.is_empty() {
        line(out, "stops", &format!("at {}", stops.join(", ")));
    }
    if let Some(text) = goal_text(certificate) {
        line(out, "goal", &text);
    }
}

/// How far from the goal the motion ends, in words.
pub fn goal_text(certificate: &CertificatePart) -> Option<String> {
    if let Some(link) = &certificate.link {
        let (mut missed, mut allowed) = (length(link.point_error_m), length(link.within_m));
        if let Some(angle) = link.angle_error_rad {
            missed += &format!(" and {}", degrees(angle));
            allowed += &format!(" and {}", degrees(LINK_ANGLE_TOLERANCE));
        }
        return Some(format!("missed by {missed} by link {}; allowed: {allowed}", link.name));
    }
    let (error, region) = (certificate.end_point_error_m?, certificate.goal_within_m);
    let (mut missed, mut allowed) = (length(error), length(region.unwrap_or(END_POINT_TOLERANCE)));
    if region.is_some() {
        missed += " from its middle";
    }
    if let Some(heading) = certificate.end_heading_error_rad {
        missed += &format!(" and {}", degrees(heading));
        allowed += &format!(" and {}", degrees(END_ANGLE_TOLERANCE));
    }
    let missed = if region.is_some() { missed } else { format!("missed by {missed}") };
    Some(format!("{missed}; allowed: {allowed}"))
}

fn limits(out: &mut String, peaks: &[LimitPart], robot: Option<&RobotPart>) {
    let joints = robot.map_or(&[][..], |robot| &robot.joints);
    let table = limits_table(peaks, &|name| joints.iter().any(|j| j.name == name && j.prismatic));
    if table.is_empty() {
        return;
    }
    line(out, "limits", "peak/limit, and what is left of it:");
    for row in table {
        let _ = writeln!(out, "    {row}");
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
        let text =
            format!("{} beside the path at most, {} from its end", length(row.lateral_max_m), length(row.end_point_m));
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

/// A length from metres, with the unit that suits it.
fn length(metres: f64) -> String {
    match 1e3 * metres.abs() {
        mm if mm >= 1e3 => format!("{} m", figure(metres)),
        mm if mm > 0.0 && mm < LEAST => format!("under {LEAST} mm"),
        _ => format!("{} mm", figure(1e3 * metres)),
    }
}

/// An angle from radians.
fn degrees(radians: f64) -> String {
    match radians.to_degrees().abs() {
        angle if angle > 0.0 && angle < LEAST => format!("under {LEAST}°"),
        angle => format!("{}°", figure(angle)),
    }
}

/// Four significant digits, no trailing zeros, no exponent.
pub fn figure(value: f64) -> String {
    significant(value, 4)
}

/// So many significant digits, all of those before the point, no trailing zeros, no exponent.
fn significant(value: f64, digits: i32) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".into() } else { "?".into() };
    }
    let places = (digits - 1 - real::log10(value.abs()).floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.places$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    if text.trim_start_matches('-') == "0" { "0".into() } else { text.to_string() }
}

#[cfg(test)]
mod tests;
