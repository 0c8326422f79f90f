//! What `trajc inspect` says of a command file.

use std::path::Path;

use serde::Serialize;

use super::super::inputs::commands::{self, CommandFile, LoadedCommands, Places};
use super::super::plot;
use super::Understood;
use crate::command::CommandRow;
use crate::diag::Diagnostics;
use crate::report::schema::{CertificatePart, CommandsPart, LimitPart, Status};
use crate::report::summary::{clearance_text, goal_text, limits_table};
use crate::report::{Metrics, metrics};

/// All that is told, as `--json` has it.
#[derive(Serialize)]
struct Description {
    file: String,
    mission: String,
    robot: String,
    map: Option<String>,
    inputs_blake3: String,
    wheel_radius_m: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    wheel_difference: Option<f64>,
    track_width_m: f64,
    joints: Vec<Joint>,
    commands: CommandsPart,
    metrics: Metrics,
    first: State,
    last: State,
    /// Peaks against the limits of its mission; empty where that is not at hand.
    limits: Vec<LimitPart>,
    /// Rows whose twists contradict their wheels.
    contradictions: Vec<String>,
    /// As recorded when it was compiled.
    recorded: Option<Recorded>,
    topics: Vec<Topic>,
    attachments: Vec<Attachment>,
}

#[derive(Serialize)]
struct Joint {
    name: String,
    prismatic: bool,
}

#[derive(Serialize)]
struct State {
    x_m: f64,
    y_m: f64,
    yaw_rad: f64,
    joints: Vec<f64>,
}

#[derive(Serialize)]
struct Recorded {
    status: Status,
    certificate: Option<CertificatePart>,
}

#[derive(Serialize)]
struct Topic {
    name: String,
    #[serde(rename = "type")]
    kind: String,
    messages: usize,
}

#[derive(Serialize)]
struct Attachment {
    name: String,
    media_type: String,
    bytes: usize,
    blake3: String,
}

/// Reads and describes.
///
/// # Errors
/// It is no command file.
pub fn describe(path: &Path) -> Result<Understood, Diagnostics> {
    let file = commands::read(path)?;
    // Drawn with its map and measured against its robot's limits, where these are at hand.
    let whole = file.clone().load(Places::default());
    let loaded = match whole {
        Ok(loaded) => Ok(loaded),
        Err(_) => file.clone().load_without_map(Places::default()),
    };
    let described = Description::new(&file, loaded.as_ref().ok());
    let figure = plot::commands(&described.file, &file.table, loaded.as_ref().ok().map(|l| &l.world));
    let text = described.text(loaded.as_ref().err());
    Ok(Understood { text, json: serde_json::json!(described), figure })
}

impl Description {
    fn new(file: &CommandFile, loaded: Option<&LoadedCommands>) -> Self {
        let (table, header) = (&file.table, &file.header);
        let certificate = loaded.and_then(|loaded| loaded.certify().ok());
        let state = |row: Option<&CommandRow>| {
            let row = row.expect("a command file has rows");
            State { x_m: row.pose.x, y_m: row.pose.y, yaw_rad: row.pose.yaw, joints: row.joint_positions.clone() }
        };
        let joint = |(name, prismatic): &(String, bool)| Joint { name: name.clone(), prismatic: *prismatic };
        Self {
            file: file.path.display().to_string(),
            mission: header.mission.clone(),
            robot: header.robot.clone(),
            map: header.map.clone(),
            inputs_blake3: header.inputs_blake3.clone(),
            wheel_radius_m: table.wheel_radii.mean,
            wheel_difference: table.wheel_radii.unlike(),
            track_width_m: table.track_width,
            joints: table.joints.iter().map(joint).collect(),
            commands: table.into(),
            metrics: metrics::of_commands(table),
            first: state(table.rows.first()),
            last: state(table.rows.last()),
            limits: certificate.iter().flat_map(|c| &c.limits).map(LimitPart::from).collect(),
            contradictions: file.contradictions.iter().map(|fault| fault.message.clone()).collect(),
            recorded: file
                .report
                .as_ref()
                .map(|report| Recorded { status: report.status, certificate: report.certificate.clone() }),
            topics: file
                .topics
                .iter()
                .map(|t| Topic { name: t.name.clone(), kind: t.kind.clone(), messages: t.messages })
                .collect(),
            attachments: file
                .attachments
                .iter()
                .map(|a| Attachment {
                    name: a.name.clone(),
                    media_type: a.media_type.clone(),
                    bytes: a.bytes.len(),
                    blake3: blake3::hash(&a.bytes).to_hex().to_string(),
                })
                .collect(),
        }
    }

    /// For a person; `missing` says why there are no limits to compare with.
    fn text(&self, missing: Option<&Diagnostics>) -> String {
        let mut out = format!("commands {}\n", self.file);
        let attached = if self.attachments.is_empty() { "" } else { " (attached)" };
        line(&mut out, "mission", &format!("{}{attached}", self.mission));
        line(&mut out, "robot", &format!("{}{attached}", self.robot));
        if let Some(map) = &self.map {
            line(&mut out, "map", map);
        }
        line(&mut out, "inputs", &format!("blake3 {}", self.inputs_blake3));
        let CommandsPart { rows, sampling_time_s, sampling, duration_s } = &self.commands;
        line(&mut out, "rows", &format!("{rows} of {sampling_time_s} s, {duration_s} s in all, sampling {sampling}"));
        let larger = self.wheel_difference.map(|share| format!("the right one {:+} % larger, ", 100.0 * share));
        let larger = larger.unwrap_or_default();
        line(&mut out, "wheels", &format!("radius {} m, {larger}track {} m", self.wheel_radius_m, self.track_width_m));
        let joints: Vec<&str> = self.joints.iter().map(|j| j.name.as_str()).collect();
        line(&mut out, "joints", &if joints.is_empty() { "none".to_owned() } else { joints.join(", ") });
        line(&mut out, "drives", &format!("{:.3} m", self.metrics.length_m));
        line(&mut out, "from", &self.state(&self.first));
        line(&mut out, "to", &self.state(&self.last));
        self.against_limits(&mut out, missing);
        if let Some(recorded) = &self.recorded {
            self.certificate(&mut out, recorded);
        }
        list(&mut out, "topics", &self.topics.iter().map(Topic::cells).collect::<Vec<_>>());
        list(&mut out, "attached", &self.attachments.iter().map(Attachment::cells).collect::<Vec<_>>());
        out
    }

    fn state(&self, state: &State) -> String {
        // Not `-0.0000`.
        let [x, y, yaw] = [state.x_m, state.y_m, state.yaw_rad].map(|value| (1e4 * value).round() / 1e4 + 0.0);
        let mut out = format!("x {x:.4} m, y {y:.4} m, yaw {yaw:.4} rad");
        for (joint, value) in self.joints.iter().zip(&state.joints) {
            out += &format!(", {} {value:.4}", joint.name);
        }
        out
    }

    fn against_limits(&self, out: &mut String, missing: Option<&Diagnostics>) {
        let prismatic = |name: &str| self.joints.iter().any(|j| j.name == name && j.prismatic);
        let table = limits_table(&self.limits, &prismatic);
        if table.is_empty() {
            let why = missing.and_then(|d| d.0.first()).map_or("its mission's robot is another", |d| &d.message);
            line(out, "limits", &format!("not known: {why}"));
        } else {
            line(out, "limits", "peak/limit, and what is left of it:");
            table.iter().for_each(|row| *out += &format!("    {row}\n"));
        }
        for fault in &self.contradictions {
            line(out, "contradicts", fault);
        }
    }

    fn certificate(&self, out: &mut String, recorded: &Recorded) {
        let words = if recorded.status == Status::Certified { "certified" } else { "not certified" };
        line(out, "recorded", &format!("{words} when it was compiled; `trajc check` proves it again"));
        if let Some(certificate) = &recorded.certificate {
            line(out, "", &format!("clearance {}", clearance_text(certificate)));
            if let Some(goal) = goal_text(certificate) {
                line(out, "", &format!("goal {goal}"));
            }
        }
    }
}

impl Topic {
    fn cells(&self) -> [String; 3] {
        [self.name.clone(), self.kind.clone(), self.messages.to_string()]
    }
}

impl Attachment {
    fn cells(&self) -> [String; 3] {
        [self.name.clone(), self.media_type.clone(), format!("{} bytes", self.bytes)]
    }
}

/// A labelled line.
fn line(out: &mut String, label: &str, text: &str) {
    *out += &format!("  {label:<11}{text}\n");
}

/// A labelled table, its last column flush right.
fn list(out: &mut String, label: &str, rows: &[[String; 3]]) {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let [first, second, third] = [0, 1, 2].map(width);
    for (k, [a, b, c]) in rows.iter().enumerate() {
        let label = if k == 0 { label } else { "" };
        line(out, label, &format!("{a:<first$}  {b:<second$}  {c:>third$}"));
    }
}
