//! `report.html`: a mission as one page that opens offline, on a phone, in the dark and on paper.
//!
//! Everything is in the file: a template with its style and script (`page.html`, `page.css`, `*.js`), text and tables as HTML, plots as
//! SVG, and what the script draws in three dimensions as JSON. Nothing in it depends on a clock: the same run gives the same bytes. What a
//! user wrote (names of missions, robots, joints, links, files) is escaped wherever it is put.

mod actuators;
mod background;
mod boxes;
mod failure;
mod header;
mod html;
mod places;
mod plots;
mod proof;
mod scene;
mod solid;
mod still;
#[cfg(test)]
mod tests;
mod trust;

use super::Report;
use crate::certify::{self, Instant, Trust};
use crate::command::CommandTable;
use crate::map::VoxelMap;
use crate::math::real;
use crate::mission::{PoseSpec, SpeedZone};
use crate::robot::{Convex, RobotModel};

use html::{escape, fill, in_script};
pub use still::svg;

/// Distances from obstacles are drawn up to this, m (or four times what is required, if that is more).
const REACH: f64 = 0.5;
/// Instants at which the clearance is measured, at most about.
const INSTANTS: usize = 600;
/// Corners of shapes looked at over all instants, about: robots of many fine meshes are measured more seldom, but never less than a
/// sixth as often.
const CORNERS: usize = 600 * 600;

/// The script, in the order in which its parts rest on each other. One function around all of them keeps the page's names to itself.
const SCRIPT: [&str; 7] = [
    include_str!("algebra.js"),
    include_str!("motion.js"),
    include_str!("solids.js"),
    include_str!("camera.js"),
    include_str!("painter.js"),
    include_str!("plan.js"),
    include_str!("main.js"),
];

/// What a page is made of: as much as a run got to.
#[derive(Clone, Copy)]
pub struct PageInputs<'a> {
    /// The mission's name.
    pub mission: &'a str,
    /// Its report.
    pub report: &'a Report,
    /// The robot.
    pub robot: Option<&'a RobotModel>,
    /// The map.
    pub map: Option<&'a VoxelMap>,
    /// The commands, certified or refused.
    pub commands: Option<&'a CommandTable>,
    /// Start and goal as the mission asks for them.
    pub ends: [Option<&'a PoseSpec>; 2],
    /// Where the base is to be slow.
    pub zones: &'a [SpeedZone],
    /// Places of the base on the search's path, m.
    pub route: &'a [[f64; 2]],
    /// How far the commands can be trusted.
    pub trust: Option<&'a Trust>,
}

impl PageInputs<'_> {
    /// Commands with the robot they are for.
    fn motion(&self) -> Option<(&CommandTable, &RobotModel)> {
        self.commands.zip(self.robot).filter(|(table, robot)| {
            let count = robot.joints.len();
            let fits = |row: &crate::command::CommandRow| {
                row.joint_positions.len() == count && row.joint_velocities.len() == count
            };
            table.joints.len() == count && !table.rows.is_empty() && table.rows.iter().all(fits)
        })
    }

    /// Distances from obstacles at even instants; the time between them; and how far was looked. None without a map or a motion.
    fn distances(&self) -> Option<Distances> {
        let ((table, robot), map) = self.motion().zip(self.map)?;
        let first = &table.rows[0];
        let required = self.report.certificate.as_ref().and_then(|c| c.clearance_required_m).unwrap_or(0.0);
        let reach = REACH.max(4.0 * required);
        let corners = |shape: &crate::robot::Shape| match &shape.convex {
            Convex::Hull { vertices } => vertices.len(),
            _ => 8,
        };
        let corners: usize = robot.shapes.iter().map(corners).sum();
        let every = table.rows.len().div_ceil((CORNERS / corners.max(1)).clamp(INSTANTS / 6, INSTANTS));
        let start = (first.pose, first.joint_positions.as_slice());
        let instants = certify::distances(table, robot, map, start, every, reach);
        Some(Distances { instants, step: table.sampling_time * every as f64, reach })
    }
}

/// Distances from obstacles.
struct Distances {
    instants: Vec<Instant>,
    /// s.
    step: f64,
    /// m.
    reach: f64,
}

/// The page.
pub fn html(inputs: &PageInputs<'_>) -> String {
    let distances = inputs.distances();
    let actuators = inputs.motion().map(|(table, robot)| actuators::all(table, robot)).unwrap_or_default();
    let (scene, factor) = scene(inputs, distances.as_ref());
    let data = serde_json::to_string(&scene).expect("names, finite numbers and lists only");
    let title = format!("{} – {} – trajc", inputs.mission, header::verdict(inputs.report));
    let sections = [
        failure::section(inputs),
        header::view(inputs, distances.as_ref(), factor),
        failure::details(inputs),
        proof::limits(inputs, &actuators),
        plots::path_error(inputs.report),
        proof::certificate(inputs),
        trust::section_of(inputs),
        background::comparison(inputs),
        background::run(inputs),
    ];
    let script = format!("(() => {{\n'use strict';\n{}}})();\n", SCRIPT.concat());
    fill(
        include_str!("page.html"),
        &[
            ("title", &escape(&title)),
            ("style", include_str!("page.css")),
            ("header", &header::header(inputs)),
            ("sections", &sections.concat()),
            ("data", &in_script(&data)),
            ("script", &script),
        ],
    )
}

/// What is drawn, and how many cells of the map make the edge of a drawn one.
fn scene(inputs: &PageInputs<'_>, distances: Option<&Distances>) -> (scene::Scene, usize) {
    let motion = inputs.motion();
    let (map, factor) = inputs.map.map(scene::Map::of).unzip();
    let mut places = match (motion, inputs.robot) {
        (Some((table, _)), _) => places::of_commands(table),
        (None, Some(robot)) => places::of_mission(robot, inputs.ends),
        (None, None) => Vec::new(),
    };
    let failure = inputs.report.failure.as_ref().zip(inputs.robot);
    let gap = failure.and_then(|(f, robot)| places::of_failure(robot, &f.code, &f.numbers, &mut places));
    let out = scene::Scene {
        robot: inputs.robot.map(scene::Robot::of),
        map,
        rows: motion.map(|(table, _)| scene::Rows::of(table)),
        clearance: distances.map(|d| scene::Clearance::of(&d.instants, d.step, d.reach)),
        closest: inputs.report.certificate.as_ref().and_then(|c| c.closest.clone()),
        places,
        gap,
        zones: inputs.zones.iter().map(|z| scene::Zone { corners: z.polygon.clone(), speed: z.speed }).collect(),
        route: inputs.route.iter().map(|p| p.map(|v| (v * 1e4).round() / 1e4)).collect(),
    };
    (out, factor.unwrap_or(1))
}

/// Four significant digits, no trailing zeros, no exponent.
fn figure(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return if value == 0.0 { "0".into() } else { "–".into() };
    }
    let digits = (3 - real::log10(value.abs()).floor() as i32).clamp(0, 6) as usize;
    let text = format!("{value:.digits$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    let text = if text.trim_start_matches('-') == "0" { "0" } else { text };
    text.replace('-', "−")
}

/// A length in millimetres with its unit, rounded down: what is proven is never said to be more. To 0.01 mm.
fn at_least_mm(metres: f64) -> String {
    format!("{} mm", figure((1e5 * metres + 1e-7).floor() / 100.0))
}

/// A length in millimetres with its unit, to a micrometre.
fn mm(metres: f64) -> String {
    let value = 1e3 * metres;
    if value != 0.0 && value.abs() < 0.001 {
        "< 0.001 mm".into()
    } else {
        format!("{} mm", figure((1e3 * value).round() / 1e3))
    }
}

/// A share in percent, rounded up: what is used of a limit is never said to be less. To a tenth.
fn percent(share: f64) -> String {
    format!("{:.1} %", (1e3 * share - 1e-6).ceil() / 10.0)
}

/// An angle in degrees with its sign.
fn degrees(angle: f64) -> String {
    let value = angle.to_degrees();
    if value != 0.0 && value.abs() < 0.001 { "< 0.001°".into() } else { format!("{}°", figure(value)) }
}

/// A word in the plural but for one.
fn counted(count: usize, what: &str) -> String {
    format!("{} {what}{}", grouped(count), if count == 1 { "" } else { "s" })
}

/// A count with its thousands apart.
fn grouped(count: usize) -> String {
    let digits = count.to_string();
    let mut out = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            out.push('\u{202f}');
        }
        out.push(c);
    }
    out
}
