//! Clearance over time and path error against the sampling time.

use super::html::{self, escape};
use super::{Distances, PageInputs, figure, mm};
use crate::report::PathErrorRow;
use crate::report::plot::{Chart, Join, Level, Small, Spread};
use crate::report::schema::{FAR, Report};

/// The same chart for wide screens and for narrow ones, as letters must not shrink with it: widths and height, px.
const STRIP: [f64; 3] = [1120.0, 390.0, 165.0];

/// Smaller errors are drawn as this, mm: rounding.
const LEAST: f64 = 1e-6;

/// Distance from obstacles over time, mm, with what is required and what is proven.
pub(super) fn clearance(inputs: &PageInputs<'_>, distances: &Distances) -> String {
    let reach = 1e3 * distances.reach;
    let points: Vec<[f64; 2]> = distances.instants.iter().map(|i| [i.time, (1e3 * i.distance).min(reach)]).collect();
    let far = points.iter().any(|p| p[1] >= reach);
    let mut chart = Chart::new("Distance from the nearest obstacle", "time s", "mm").line("", points, Join::Straight);
    let certificate = inputs.report.certificate.as_ref();
    let required = certificate.and_then(|c| c.clearance_required_m);
    chart.levels.extend(required.map(|v| Level { name: format!("required {}", mm(v)), value: 1e3 * v }));
    chart.levels.push(Level { name: String::new(), value: 0.0 });
    if let Some(closest) = certificate.and_then(|c| c.closest.as_ref()) {
        chart = chart.mark([closest.time_s, 1e3 * closest.distance_m.min(distances.reach)], 1);
    }
    let drawn = |width: f64, class: &str| {
        let id = format!("clear{class}");
        format!(
            "<div class=\"{class}\">{}</div>",
            Small { width, height: STRIP[2], id: &id, over_time: true }.draw(&chart)
        )
    };
    let proven = certificate.and_then(|c| c.clearance_proven_m).filter(|v| *v < FAR);
    let mut text = format!("Measured exactly at instants {} s apart", figure(distances.step));
    if far {
        text += &format!(", up to {}", mm(distances.reach));
    }
    match proven {
        Some(proven) => {
            text += &format!(
                "; between them the certificate proves {} at least. Ring: the closest approach.",
                super::at_least_mm(proven)
            )
        }
        None => text += "; nothing is proven between them.",
    }
    format!(
        "<figure class=\"strip\">{}{}<figcaption>{}</figcaption></figure>\n",
        drawn(STRIP[0], "wide"),
        drawn(STRIP[1], "narrow"),
        escape(&text)
    )
}

/// The path error of the commands as they are written.
pub(super) fn own_row(report: &Report) -> Option<&PathErrorRow> {
    let commands = report.commands.as_ref()?;
    let same_time = |row: &&PathErrorRow| (row.sampling_time_s - commands.sampling_time_s).abs() < 1e-9;
    let rows = || report.path_error.iter().filter(same_time);
    rows().find(|row| row.sampling == commands.sampling).or_else(|| rows().next())
}

/// Clearance proven of the commands of each sampling time; nothing where none is near.
fn clearances(report: &Report, samplings: &[&str]) -> Option<Chart> {
    let proven = |row: &PathErrorRow| row.clearance_min_m.filter(|v| *v < FAR);
    if !report.path_error.iter().any(|row| proven(row).is_some()) {
        return None;
    }
    let mut chart = Chart { x_spread: Spread::Logarithmic, ..Chart::new("Clearance proven", "sampling time s", "mm") };
    for sampling in samplings {
        let own = report.path_error.iter().filter(|row| row.sampling == *sampling);
        let mut points: Vec<[f64; 2]> = own.filter_map(|row| Some([row.sampling_time_s, 1e3 * proven(row)?])).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        chart = chart.line(*sampling, points, Join::Dots);
    }
    let required = report.certificate.as_ref().and_then(|c| c.clearance_required_m);
    let chart = required.map_or_else(|| chart.clone(), |v| chart.clone().level("required", 1e3 * v));
    Some(chart.level("", 0.0))
}

/// Path error against sampling time: charts and a table.
pub(super) fn path_error(report: &Report) -> String {
    let rows = &report.path_error;
    if rows.is_empty() {
        return String::new();
    }
    let mut samplings: Vec<&str> = Vec::new();
    for row in rows {
        if !samplings.contains(&row.sampling.as_str()) {
            samplings.push(&row.sampling);
        }
    }
    let drawn = |chart: &Chart, id: &str| {
        format!("<figure>{}</figure>\n", Small { width: 400.0, height: 230.0, id, over_time: false }.draw(chart))
    };
    let chart = |title: &str, error: fn(&PathErrorRow) -> f64, id: &str| {
        let empty = Chart::new(title, "sampling time s", "mm");
        let mut chart = Chart { x_spread: Spread::Logarithmic, y_spread: Spread::Logarithmic, ..empty };
        for sampling in &samplings {
            let own = rows.iter().filter(|row| row.sampling == *sampling);
            let mut points: Vec<[f64; 2]> =
                own.map(|row| [row.sampling_time_s, (error(row) * 1e3).max(LEAST)]).collect();
            points.sort_by(|a, b| a[0].total_cmp(&b[0]));
            chart = chart.line(*sampling, points, Join::Dots);
        }
        drawn(&chart, id)
    };
    let own = own_row(report);
    let head = [
        ("Held for", true),
        ("Sampling", false),
        ("Largest distance", true),
        ("RMS", true),
        ("At the end", true),
        ("Heading there", true),
        ("Clearance proven", true),
    ];
    let cells = |row: &PathErrorRow| {
        let mut sampling = html::text(&row.sampling);
        if own.is_some_and(|own| std::ptr::eq(own, row)) {
            sampling.html += " <small>as written</small>";
        }
        let clearance = match row.clearance_min_m {
            Some(value) if value >= FAR || !value.is_finite() => "no obstacle".to_owned(),
            Some(value) => super::at_least_mm(value),
            None => "–".to_owned(),
        };
        vec![
            html::number(format!("{} s", row.sampling_time_s)),
            sampling,
            html::number(mm(row.lateral_max_m)),
            html::number(mm(row.lateral_rms_m)),
            html::number(mm(row.end_point_m)),
            html::number(super::degrees(row.end_heading_rad)),
            html::number(clearance),
        ]
    };
    let body = format!(
        "<p>How far a robot that holds each command leaves the planned path, by how long it holds them. Axes are \
         logarithmic; errors below a nanometre are drawn there.</p>\n\
         <div class=\"charts\">\n{}{}{}</div>\n<details><summary>All figures</summary>\n{}</details>\n",
        chart("Largest path error", |row| row.lateral_max_m, "errormax"),
        chart("Error at the end", |row| row.end_point_m, "errorend"),
        clearances(report, &samplings).map_or(String::new(), |chart| drawn(&chart, "errorclear")),
        html::table("Path error against the sampling time", &head, &rows.iter().map(cells).collect::<Vec<_>>()),
    );
    html::section("path-error", "Path error", &body)
}
