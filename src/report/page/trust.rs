//! How far the commands can be trusted without feedback: the tube around the path, from above and against the way driven.

use std::f64::consts::TAU;

use super::html::{escape, section};
use super::{PageInputs, figure};
use crate::certify::{Trust, TubePoint};
use crate::math::real;
use crate::report::plot::svg::{Area, Svg};
use crate::report::plot::{Chart, Join, Small, TopView, place};
use crate::report::schema::TrustPart;
use crate::report::summary;

/// Outlines of the tube along a path, about.
const OUTLINES: usize = 90;
/// Corners of an outline.
const CORNERS: usize = 40;
/// A map whose outlines have more points than this is not drawn: the page would take long to load.
const MOST_POINTS: usize = 30_000;
/// Around a path without a map, m.
const AROUND: f64 = 0.6;
/// Width of the picture, px.
const WIDTH: f64 = 760.0;

/// Where the base can be when the model's is at a point of its path: the outline, m.
pub(in crate::report) fn outline(point: &TubePoint) -> Vec<[f64; 2]> {
    let corner = |k: usize| {
        let (sin, cos) = real::sin_cos(TAU * k as f64 / CORNERS as f64);
        let mut at = [point.place[0] + point.anywhere * cos, point.place[1] + point.anywhere * sin];
        for [x, y] in point.drift {
            let side = if x * cos + y * sin < 0.0 { -1.0 } else { 1.0 };
            at = [at[0] + side * x, at[1] + side * y];
        }
        at
    };
    (0..CORNERS).map(corner).collect()
}

/// Draws path and tube from above; where a robot in it may touch something, in the colour of obstacles' contacts.
pub(in crate::report) fn draw(view: &mut TopView, trust: &Trust) {
    let every = trust.tube.len().div_ceil(OUTLINES).max(1);
    let until = trust.contact.unwrap_or(usize::MAX);
    let last = trust.tube.len() - 1;
    let rows: Vec<usize> = (0..last).step_by(every).chain([last]).collect();
    let (safe, unsafe_): (Vec<usize>, Vec<usize>) = rows.into_iter().partition(|row| *row < until);
    let loops = |rows: Vec<usize>| rows.into_iter().map(|row| outline(&trust.tube[row])).collect::<Vec<_>>();
    view.region(loops(safe), 0, "where the base can be");
    if !unsafe_.is_empty() {
        view.region(loops(unsafe_), 1, "no longer to be trusted");
    }
    view.path(trust.tube.iter().map(|point| point.place).collect(), "planned");
    if trust.contact.is_some() {
        let until = trust.until();
        view.mark(until.place, format!("{} m", figure(until.length)));
    }
}

/// The figure of the header: name, value, and a line below.
pub(super) fn key(trust: &TrustPart) -> Option<(&'static str, String, String)> {
    let value = format!("{} m", figure(trust.trusted_m?));
    let whole = if trust.whole == Some(true) {
        "the whole path".to_owned()
    } else {
        format!("of {} m", figure(trust.length_m))
    };
    let of = if trust.in_force { "within the tolerance" } else { "of usual accuracy" };
    Some(("Trusted without feedback", value, format!("{whole}, by a robot {of}")))
}

/// The section; empty where nothing is known.
pub(super) fn section_of(inputs: &PageInputs<'_>) -> String {
    let (Some(trust), Some(part)) = (inputs.trust.filter(|trust| !trust.tube.is_empty()), &inputs.report.trust) else {
        return String::new();
    };
    let why = if part.in_force {
        "The mission or robot.yaml says how far the robot may be off, and the certificate holds for every such robot."
    } else {
        "Nobody said how far the robot may be off, so the usual is assumed here; the certificate speaks of the model alone. \
         A <code>tolerance</code> in the mission or robot.yaml brings it into the proof."
    };
    let until = trust.until();
    let verdict = match (inputs.map.is_some(), trust.contact) {
        (false, _) => "Without a map it is not known what it may touch.".to_owned(),
        (true, None) => "No such robot touches anything on the whole way.".to_owned(),
        (true, Some(_)) => format!(
            "From <b>{} m</b> ({} s) on, such a robot may touch something: by then it needs feedback that sets it right.",
            figure(until.length),
            figure(until.time)
        ),
    };
    let mut view = match (inputs.map, inputs.robot) {
        (Some(map), Some(robot)) => TopView::of_map(map, place::least_top(robot)),
        _ => TopView::around(trust.tube.iter().flat_map(outline), AROUND),
    };
    let mut note = String::new();
    if view.size() > MOST_POINTS {
        view = TopView::around(trust.tube.iter().flat_map(outline), AROUND);
        note = " The obstacles are left out: they are too many to draw.".into();
    }
    draw(&mut view, trust);
    let height = view.height(WIDTH);
    let mut svg = Svg::inline(WIDTH, height, "The tube from above", "tube");
    view.draw(&mut svg, Area { x: 0.0, y: 0.0, width: WIDTH, height });
    let body = format!(
        "<p>{}</p>\n<p>{why} {verdict} Slip is not in it.</p>\n<figure>{}<figcaption>Where the base can be, every few rows. Below: against the metres driven.{note}</figcaption></figure>\n\
         <div class=\"charts\">\n{}{}</div>\n",
        escape(&sentence(&summary::trust_text(part).replace('\u{a0}', " "))),
        svg.finish(),
        chart(trust, "How far the base can be off", "mm", "tubeoff", |point| 1e3 * point.width.distance),
        chart(trust, "How far the heading can be off", "degrees", "tubeturn", |point| point.width.angle.to_degrees()),
    );
    section("trust", "Without feedback", &body)
}

fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect::<String>() + ".")
}

fn chart(trust: &Trust, title: &str, unit: &str, id: &str, of: impl Fn(&TubePoint) -> f64) -> String {
    let points: Vec<[f64; 2]> = trust.tube.iter().map(|point| [point.length, of(point)]).collect();
    let every = points.len().div_ceil(400).max(1);
    let last = points.last().copied();
    let points: Vec<[f64; 2]> = points.into_iter().step_by(every).chain(last).collect();
    let mut chart = Chart::new(title, "path m", unit).line("", points, Join::Straight).level("", 0.0);
    if trust.contact.is_some() {
        let until = trust.until();
        chart = chart.mark([until.length, of(&until)], 1);
    }
    format!("<figure>{}</figure>\n", Small { width: 400.0, height: 230.0, id, over_time: false }.draw(&chart))
}
