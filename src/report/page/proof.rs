//! What was proven: limits of actuators, and the certificate with what it does not say.

use super::actuators::{self, Actuator, PER, QUANTITIES};
use super::html::{self, Cell, definitions, escape, instant, section};
use super::{PageInputs, at_least_mm, counted, degrees, figure, mm};
use crate::certify::{END_ANGLE_TOLERANCE, END_POINT_TOLERANCE, LINK_ANGLE_TOLERANCE};
use crate::report::plot::motion;
use crate::report::schema::{CertificatePart, FAR, InTubePart, LimitPart};

/// Peaks against limits: a table, and charts over time.
pub(super) fn limits(inputs: &PageInputs<'_>, actuators: &[Actuator]) -> String {
    let Some((table, _)) = inputs.motion().filter(|_| !inputs.report.limits.is_empty()) else { return String::new() };
    let states = motion::states(table);
    let rows: Vec<Vec<Cell>> = inputs
        .report
        .limits
        .iter()
        .map(|row| {
            let own = actuators.iter().find(|a| a.name == row.actuator);
            let quantity = QUANTITIES.iter().position(|q| *q == row.quantity).unwrap_or(0);
            let unit = own.map_or(String::new(), |a| format!(" {}{}", a.unit, PER[quantity]));
            let peak = own.map(|a| a.courses[quantity].peak);
            let place =
                peak.map(|[time, _]| states[((time / table.sampling_time).round() as usize).min(states.len() - 1)].0);
            vec![
                html::text(&row.actuator.replace('_', " ")),
                html::text(&row.quantity),
                used(row),
                html::number(row.peak.map_or("–".into(), figure)),
                html::number(row.limit.map_or("none given".into(), |limit| format!("{}{unit}", figure(limit)))),
                Cell { html: peak.map_or("–".into(), |[time, _]| instant(time.min(table.duration()))), number: true },
                html::number(place.map_or("–".into(), |p| format!("{:.2}, {:.2}", p.x, p.y).replace('-', "−"))),
            ]
        })
        .collect();
    let head = [
        ("Actuator", false),
        ("Quantity", false),
        ("Used", false),
        ("Peak", true),
        ("Limit", true),
        ("At", true),
        ("Place x, y m", true),
    ];
    let (charts, more) = actuators::charts(actuators, table);
    let more = match more {
        0 => String::new(),
        more => format!("<p class=\"note\">{} more in the table alone.</p>\n", counted(more, "joint")),
    };
    let body = format!(
        "<p>Of the commands as written: acceleration and jerk are first and second differences of the held speeds, at rest before and after.</p>\n\
         {}{charts}{more}",
        html::table("Peak of every actuator against its limit", &head, &rows)
    );
    section("limits", "Limits", &body)
}

/// How much of a limit is used, as a bar and a number rounded up.
fn used(row: &LimitPart) -> Cell {
    let html = match (row.peak, row.limit.filter(|limit| *limit > 0.0)) {
        (Some(peak), Some(limit)) => {
            let share = peak / limit;
            let percent = super::percent(share);
            let class = if share > 1.0 + 1e-9 { " over" } else { "" };
            format!(
                "<span class=\"share{class}\" style=\"--share:{:.3}\"><span></span></span> <span class=\"percent\">{percent}</span>",
                share.min(1.0)
            )
        }
        _ => "–".into(),
    };
    Cell { html, number: false }
}

/// The certificate: what is proven, what is not.
pub(super) fn certificate(inputs: &PageInputs<'_>) -> String {
    let Some(certificate) = &inputs.report.certificate else { return String::new() };
    let refused = inputs.report.failure.is_some();
    let body = format!(
        "<div class=\"two\">\n<div>\n<h3>{}</h3>\n{}</div>\n<div>\n<h3>What it does not promise</h3>\n<ul>\n{}</ul>\n</div>\n</div>\n",
        if refused { "Refused; measured" } else { "Proven of the commands as written" },
        definitions("proof", &proven(inputs, certificate)),
        unpromised(inputs).iter().map(|line| format!("<li>{line}</li>\n")).collect::<String>(),
    );
    section("certificate", "Certificate", &body)
}

fn proven(inputs: &PageInputs<'_>, certificate: &CertificatePart) -> Vec<(String, String)> {
    let mut out = Vec::new();
    let clearance = match (certificate.clearance_required_m, certificate.clearance_proven_m) {
        (Some(required), Some(proven)) if proven < FAR => format!(
            "{} at least between any collision shape and any occupied cell{}, at every instant; {} required",
            at_least_mm(proven),
            if walled(inputs) { " or unseen space" } else { "" },
            mm(required)
        ),
        (Some(_), Some(_)) => "no obstacle anywhere near".into(),
        (Some(required), None) => format!("nothing proven; {} required", mm(required)),
        (None, _) => "not checked: the mission has no map".into(),
    };
    out.push(("Clearance".into(), escape(&clearance)));
    if let Some(closest) = &certificate.closest {
        let of = match &closest.obstacle {
            Some(b) => {
                let [x, y, z] = [0, 1, 2].map(|i| format!("{:.2}", 0.5 * (b.min[i] + b.max[i])).replace('-', "−"));
                format!("the obstacle at ({x}, {y}, {z}) m")
            }
            None => "unseen space".into(),
        };
        let text =
            format!("{}: {} is {} from {of}", instant(closest.time_s), escape(&closest.link), mm(closest.distance_m));
        out.push(("Closest approach".into(), text));
    }
    if let Some(inside) = &certificate.tolerance {
        out.push(("Tolerance".into(), escape(&within_the_tolerance(inside))));
    }
    if let Some(own) = certificate.own_links {
        let pairs = counted(own.pairs_checked, "pair");
        let verdict = if own.keep_apart { "never touch" } else { "are not shown to keep apart" };
        out.push(("Own links".into(), format!("{pairs} that move against each other {verdict}")));
    }
    let unlimited: Vec<&LimitPart> = inputs.report.limits.iter().filter(|row| row.limit.is_none()).collect();
    let limits = match (certificate.limits_hold, unlimited.len()) {
        (true, 0) => "no wheel and no joint passes its speed, acceleration, jerk or range".to_owned(),
        (true, open) => format!(
            "no wheel and no joint passes a limit that is given; {} not given and not checked",
            counted(open, "limit")
        ),
        (false, _) => "a limit is passed".to_owned(),
    };
    out.push(("Limits".into(), escape(&limits)));
    if !certificate.speed_zones.is_empty() {
        let zones = crate::report::summary::zones_text(certificate).join(", ").replace('\u{a0}', " ");
        out.push((
            "Speed zones".into(),
            escape(&format!("greatest speed at any instant in each, of what is allowed: {zones}")),
        ));
    }
    if !certificate.vias.is_empty() {
        let times: Vec<String> = certificate.vias.iter().map(|via| format!("{:.1} s", via.time_s)).collect();
        out.push(("Stops".into(), escape(&format!("at rest at each via: at {}", times.join(", ")))));
    }
    if let Some(link) = &certificate.link {
        let turned = link.angle_error_rad.map_or(String::new(), |a| format!(" and {}", degrees(a)));
        let allowed = match link.angle_error_rad {
            Some(_) => format!("{} and {}", mm(link.within_m), degrees(LINK_ANGLE_TOLERANCE)),
            None => mm(link.within_m),
        };
        let (name, error) = (&link.name, mm(link.point_error_m));
        out.push((
            "End".into(),
            escape(&format!("at rest, {name} within {error}{turned} of its place; {allowed} are allowed")),
        ));
    } else if let Some(error) = certificate.end_point_error_m {
        let heading = certificate.end_heading_error_rad.map_or(String::new(), |a| format!(" and {}", degrees(a)));
        let region = certificate.goal_within_m;
        let allowed = format!("{} and {}", mm(region.unwrap_or(END_POINT_TOLERANCE)), degrees(END_ANGLE_TOLERANCE));
        let what = if region.is_some() { "the middle of the goal" } else { "the goal" };
        let text = format!("at rest within {}{heading} of {what}; {allowed} are allowed", mm(error));
        out.push(("End".into(), escape(&text)));
    }
    if let Some(commands) = &inputs.report.commands {
        let text =
            format!("{} of {} s, each held until the next", counted(commands.rows, "row"), commands.sampling_time_s);
        out.push(("Commands".into(), escape(&text)));
    }
    out
}

/// What is proven of every robot within the tolerance.
fn within_the_tolerance(inside: &InTubePart) -> String {
    let clearance = match inside.clearance_proven_m {
        Some(proven) if proven < FAR => format!("every robot within it keeps {}", at_least_mm(proven)),
        Some(_) => "no obstacle anywhere near".into(),
        None => "clearance is not checked: the mission has no map".into(),
    };
    let there = match (&inside.closest, inside.closest_off_m, inside.closest_off_rad) {
        (Some(closest), Some(m), Some(rad)) => {
            format!(", least at {:.1} s, where the base may be off by {} and {}", closest.time_s, mm(m), degrees(rad))
        }
        _ => String::new(),
    };
    clearance + &there
}

/// Whether unseen space counts as an obstacle.
fn walled(inputs: &PageInputs<'_>) -> bool {
    inputs.map.is_some_and(|map| map.outside == crate::mission::Unknown::Occupied)
}

/// What nobody may take from the certificate; HTML.
fn unpromised(inputs: &PageInputs<'_>) -> Vec<String> {
    let toleranced = inputs.report.certificate.as_ref().is_some_and(|c| c.tolerance.is_some());
    let mut out = vec![
        "<b>Slip and tracking.</b> Wheels that slip, and controllers that follow late or not exactly, are not in it: put what you expect of them into <code>clearance_m</code>.".to_owned(),
        if toleranced {
            "<b>The model.</b> Wheel radii, track width, latency and start may be off by the tolerance, and no more; it speaks of the URDF as given, and of what the map shows.".to_owned()
        } else {
            "<b>The model.</b> It speaks of the URDF, wheel radius and track width as given, and of what the map shows; what the map leaves out is not there.".to_owned()
        },
        "<b>Moving things.</b> Nothing moves but the robot.".to_owned(),
    ];
    let ignored = inputs.report.robot.as_ref().map_or(0, |robot| robot.ignored_pairs.len());
    if ignored > 0 {
        let pairs = counted(ignored, "pair");
        out.push(format!(
            "<b>Links that touch by design.</b> {pairs} of its own links are not checked against each other."
        ));
    }
    if inputs.map.is_none() {
        out.push("<b>Obstacles.</b> Without a map nothing is known of any.".into());
    } else if !walled(inputs) {
        out.push("<b>Unseen space.</b> The mission takes it as free.".into());
    }
    out
}
