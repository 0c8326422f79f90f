//! `commands.mcap`: the command table for ROS 2 (`ros2 bag play`) and Foxglove. The same inputs give the same bytes.
//!
//! Stamps: commands carry 0, which controllers take as «now»; states carry the log time. The first log time is 1 s, since ROS
//! takes time 0 for «no clock yet». The joint trajectory has positions only: controllers then interpolate linearly, which is
//! what was certified. A `Metadata` record named [`METADATA`] repeats the head of `commands.csv`.

use std::collections::BTreeMap;
use std::io::Cursor;

use ::mcap::records::{MessageHeader, Metadata};
use ::mcap::{Attachment, Compression, McapError, WriteOptions, Writer};
use nalgebra::Isometry3;

use super::csv::{self, CsvHeader};
use super::{cdr, number, ros};
use crate::command::{CommandRow, CommandTable};
use crate::diag::{Describe, Diagnostic};
use crate::geom::Pose2;
use crate::math::real;
use crate::robot::RobotModel;
use ros::{MessageType, Offer};

/// Log time of the first row, ns.
pub(super) const START: u64 = 1_000_000_000;
/// Name of the metadata record with the head of `commands.csv`.
pub const METADATA: &str = "trajc.commands";
/// Frame of all poses.
const MAP_FRAME: &str = "map";
/// Two frames that differ by less are one (m and rad).
const SAME_FRAME: f64 = 1e-9;

/// Topics, in the order of their channels.
pub(crate) mod topic {
    pub const DESCRIPTION: &str = "/robot_description";
    pub const PLAN: &str = "/plan";
    pub const TRAJECTORY: &str = "/joint_trajectory_controller/joint_trajectory";
    pub const TWIST: &str = "/cmd_vel";
    pub const WHEELS: &str = "/wheel_velocity_controller/commands";
    pub const JOINTS: &str = "/joint_states";
    pub const TRANSFORMS: &str = "/tf";
}

/// Names of the attachments.
pub mod attached {
    /// The mission.
    pub const MISSION: &str = "mission.yaml";
    /// robot.yaml; not there where the mission names a URDF alone.
    pub const ROBOT: &str = "robot.yaml";
    /// The URDF.
    pub const URDF: &str = "robot.urdf";
    /// report.json.
    pub const REPORT: &str = "report.json";
    /// The file of a given path; not there where the mission names none.
    pub const PATH: &str = "path.csv";
    /// Prefix of the command file where whose motion ends this one starts; the rest is its name. Not there where the mission names none.
    pub const START: &str = "start/";
    /// Prefix of meshes; the rest is the path to the file from the URDF's folder.
    pub const MESHES: &str = "meshes/";
}

/// All that the file is made of.
#[derive(Debug, Clone, Copy)]
pub struct McapInputs<'a> {
    /// The commands; all numbers finite, never empty.
    pub table: &'a CommandTable,
    /// As in `commands.csv`.
    pub header: &'a CsvHeader,
    /// For the frames.
    pub robot: &'a RobotModel,
    /// Text of the mission file.
    pub mission: &'a str,
    /// Text of robot.yaml; `None` where the mission names a URDF alone.
    pub robot_yaml: Option<&'a str>,
    /// Text of the URDF.
    pub urdf: &'a str,
    /// Text of report.json.
    pub report: &'a str,
    /// Text of the given path's file, where the mission names one.
    pub path_csv: Option<&'a str>,
    /// `start: {file}` of the mission: name without folders, and bytes.
    pub start_file: Option<(&'a str, &'a [u8])>,
    /// Meshes: path from the URDF's folder, and bytes. Paths differ.
    pub meshes: &'a [(String, Vec<u8>)],
}

/// Why there is no MCAP file.
#[derive(Debug, thiserror::Error)]
pub enum McapWriteError {
    /// Stamps have whole nanoseconds and 31 bits of seconds.
    #[error("{rows} rows of {sampling_time} s cannot be stamped in nanoseconds")]
    Stamps {
        /// Rows of the table.
        rows: usize,
        /// s.
        sampling_time: f64,
    },
    /// The writer refused.
    #[error("commands.mcap cannot be written: {0}")]
    Writer(#[from] McapError),
}

impl Describe for McapWriteError {
    fn diagnostic(&self) -> Diagnostic {
        match self {
            Self::Stamps { .. } => Diagnostic::error("emit/stamps", self)
                .hint("use a sampling time of 1 ns or more, and less than 68 years"),
            Self::Writer(_) => Diagnostic::error("emit/mcap", self),
        }
    }
}

/// The bytes of `commands.mcap`.
///
/// # Errors
/// A sampling time below 1 ns or a duration beyond 31 bits of seconds; the MCAP writer's own.
pub fn write(inputs: &McapInputs<'_>) -> Result<Vec<u8>, McapWriteError> {
    let table = inputs.table;
    let stamps: Vec<u64> = (0..table.rows.len()).map(|k| START + (table.time(k) * 1e9).round() as u64).collect();
    let increasing = stamps.windows(2).all(|w| w[0] < w[1]);
    if !increasing || stamps.last().is_some_and(|last| last / START > i32::MAX as u64) {
        return Err(McapWriteError::Stamps { rows: table.rows.len(), sampling_time: table.sampling_time });
    }
    let options = WriteOptions::new()
        .profile("ros2")
        .library(concat!("trajc ", env!("CARGO_PKG_VERSION")))
        .compression(Some(Compression::Zstd))
        // By default as many as the machine has cores, and the bytes then depend on whether that is one.
        .compression_threads(0);
    let mut file = File { writer: options.create(Cursor::new(Vec::new()))? };
    file.attachments(inputs)?;
    file.head(inputs)?;
    let frames = Frames::new(inputs.robot, inputs.urdf);
    file.once(topic::DESCRIPTION, &ros::STRING, Offer::Latched, &description(inputs.urdf))?;
    file.once(topic::PLAN, &ros::PATH, Offer::Latched, &plan(table, &stamps))?;
    let volatile = Offer::Volatile { depth: 10 };
    if !table.joints.is_empty() {
        file.once(topic::TRAJECTORY, &ros::JOINT_TRAJECTORY, volatile, &trajectory(table, &stamps))?;
    }
    let twists = file.channel(topic::TWIST, &ros::TWIST_STAMPED, volatile)?;
    let wheels = file.channel(topic::WHEELS, &ros::FLOAT64_MULTI_ARRAY, volatile)?;
    let joints = file.channel(topic::JOINTS, &ros::JOINT_STATE, volatile)?;
    let transforms = file.channel(topic::TRANSFORMS, &ros::TF_MESSAGE, Offer::Volatile { depth: 100 })?;
    for (k, (row, stamp)) in table.rows.iter().zip(&stamps).enumerate() {
        file.message(twists, k, *stamp, &twist(table.twist(k), &frames.base))?;
        file.message(wheels, k, *stamp, &wheel_speeds(row))?;
        file.message(joints, k, *stamp, &joint_state(table, row, *stamp))?;
        file.message(transforms, k, *stamp, &frames.transforms(row.pose, *stamp))?;
    }
    file.writer.finish()?;
    Ok(file.writer.into_inner().into_inner())
}

struct File {
    writer: Writer<Cursor<Vec<u8>>>,
}

impl File {
    fn attachments(&mut self, inputs: &McapInputs<'_>) -> Result<(), McapError> {
        let mut files = vec![(attached::MISSION.to_string(), "application/yaml", inputs.mission.as_bytes())];
        files.extend(inputs.robot_yaml.map(|text| (attached::ROBOT.to_string(), "application/yaml", text.as_bytes())));
        files.push((attached::URDF.to_string(), "application/xml", inputs.urdf.as_bytes()));
        files.push((attached::REPORT.to_string(), "application/json", inputs.report.as_bytes()));
        files.extend(inputs.path_csv.map(|text| (attached::PATH.to_string(), "text/csv", text.as_bytes())));
        if let Some((name, bytes)) = inputs.start_file {
            let kind =
                if name.to_ascii_lowercase().ends_with(".mcap") { "application/octet-stream" } else { "text/csv" };
            files.push((format!("{}{name}", attached::START), kind, bytes));
        }
        for (name, bytes) in inputs.meshes {
            let kind = if name.to_ascii_lowercase().ends_with(".obj") { "model/obj" } else { "model/stl" };
            files.push((format!("{}{name}", attached::MESHES), kind, bytes));
        }
        for (name, media_type, bytes) in files {
            let media_type = media_type.to_string();
            self.writer.attach(&Attachment {
                log_time: START,
                create_time: START,
                name,
                media_type,
                data: bytes.into(),
            })?;
        }
        Ok(())
    }

    fn head(&mut self, inputs: &McapInputs<'_>) -> Result<(), McapError> {
        let table = inputs.table;
        let mut metadata: BTreeMap<String, String> =
            csv::head(table, inputs.header).into_iter().map(|(key, value)| (key.to_string(), value)).collect();
        for (name, prismatic) in &table.joints {
            metadata.insert(format!("joint.{name}"), if *prismatic { "m" } else { "rad" }.to_string());
        }
        // A quaternion knows the heading but for whole turns.
        let yaw = table.rows.first().map_or(0.0, |row| row.pose.yaw);
        metadata.insert("start_yaw_rad".to_string(), number(yaw));
        self.writer.write_metadata(&Metadata { name: METADATA.to_string(), metadata })
    }

    fn channel(&mut self, topic: &str, message: &MessageType, offer: Offer) -> Result<u16, McapError> {
        let schema = self.writer.add_schema(message.name, "ros2msg", message.definition().as_bytes())?;
        self.writer.add_channel(schema, topic, "cdr", &ros::channel_metadata(message, offer))
    }

    fn message(&mut self, channel_id: u16, k: usize, stamp: u64, bytes: &[u8]) -> Result<(), McapError> {
        let sequence = k as u32;
        self.writer.write_to_known_channel(
            &MessageHeader { channel_id, sequence, log_time: stamp, publish_time: stamp },
            bytes,
        )
    }

    fn once(&mut self, topic: &str, message: &MessageType, offer: Offer, bytes: &[u8]) -> Result<(), McapError> {
        let channel = self.channel(topic, message, offer)?;
        self.message(channel, 0, START, bytes)
    }
}

/// Frames between the map and the URDF's root link.
pub(crate) struct Frames {
    /// The frame whose pose in the map is commanded.
    pub(crate) base: String,
    /// The root link and its pose in `base`, where it is another frame.
    root: Option<(String, Isometry3<f64>)>,
}

impl Frames {
    pub(crate) fn new(robot: &RobotModel, urdf: &str) -> Self {
        let pose = &robot.base_from_root;
        let (moved, turned) = (pose.translation.vector.norm(), pose.rotation.angle());
        if moved <= SAME_FRAME && turned <= SAME_FRAME {
            return Self { base: robot.root_link.clone(), root: None };
        }
        // A frame has one parent: a link's name is taken.
        let taken = |name: &str| {
            robot.root_link == name
                || roxmltree::Document::parse(urdf).is_ok_and(|xml| {
                    xml.descendants().any(|n| n.has_tag_name("link") && n.attribute("name") == Some(name))
                })
        };
        let free = ["base_footprint", "base_link"].into_iter().find(|name| !taken(name));
        let base = free.unwrap_or("trajc_base").to_string();
        Self { base, root: Some((robot.root_link.clone(), *pose)) }
    }

    pub(crate) fn transforms(&self, pose: Pose2, stamp: u64) -> Vec<u8> {
        let mut w = cdr::Writer::default();
        w.length(1 + usize::from(self.root.is_some()));
        header(&mut w, stamp, MAP_FRAME);
        w.string(&self.base);
        w.f64_array(&[pose.x, pose.y, 0.0]);
        heading(&mut w, pose.yaw);
        if let Some((root, pose)) = &self.root {
            header(&mut w, stamp, &self.base);
            w.string(root);
            let (t, r) = (&pose.translation, &pose.rotation);
            w.f64_array(&[t.x, t.y, t.z, r.i, r.j, r.k, r.w]);
        }
        w.finish()
    }
}

/// `std_msgs/Header`.
fn header(w: &mut cdr::Writer, stamp: u64, frame: &str) {
    time(w, stamp);
    w.string(frame);
}

/// `builtin_interfaces/Time` or `Duration`.
fn time(w: &mut cdr::Writer, nanoseconds: u64) {
    w.i32(i32::try_from(nanoseconds / 1_000_000_000).expect("`write` has checked the last stamp"));
    w.u32((nanoseconds % 1_000_000_000) as u32);
}

/// A turn about z as a quaternion x, y, z, w. Continuous in `yaw`, so that receivers interpolate the short way.
fn heading(w: &mut cdr::Writer, yaw: f64) {
    let (sin, cos) = real::sin_cos(0.5 * yaw);
    w.f64_array(&[0.0, 0.0, sin, cos]);
}

pub(crate) fn description(urdf: &str) -> Vec<u8> {
    let mut w = cdr::Writer::default();
    w.string(urdf);
    w.finish()
}

pub(crate) fn plan(table: &CommandTable, stamps: &[u64]) -> Vec<u8> {
    let mut w = cdr::Writer::default();
    header(&mut w, stamps.first().copied().unwrap_or(START), MAP_FRAME);
    w.length(table.rows.len());
    for (row, stamp) in table.rows.iter().zip(stamps) {
        header(&mut w, *stamp, MAP_FRAME);
        w.f64_array(&[row.pose.x, row.pose.y, 0.0]);
        heading(&mut w, row.pose.yaw);
    }
    w.finish()
}

fn names(w: &mut cdr::Writer, table: &CommandTable) {
    w.length(table.joints.len());
    table.joints.iter().for_each(|(name, _)| w.string(name));
}

pub(crate) fn trajectory(table: &CommandTable, stamps: &[u64]) -> Vec<u8> {
    let mut w = cdr::Writer::default();
    header(&mut w, 0, "");
    names(&mut w, table);
    w.length(table.rows.len());
    for (row, stamp) in table.rows.iter().zip(stamps) {
        w.f64s(&row.joint_positions);
        // No velocities, accelerations, effort.
        (0..3).for_each(|_| w.length(0));
        time(&mut w, stamp - stamps[0]);
    }
    w.finish()
}

pub(crate) fn twist((v, omega): (f64, f64), frame: &str) -> Vec<u8> {
    let mut w = cdr::Writer::default();
    header(&mut w, 0, frame);
    w.f64_array(&[v, 0.0, 0.0, 0.0, 0.0, omega]);
    w.finish()
}

pub(crate) fn wheel_speeds(row: &CommandRow) -> Vec<u8> {
    let mut w = cdr::Writer::default();
    // An empty layout: no dimensions, no offset.
    w.length(0);
    w.u32(0);
    w.f64s(&[row.wheel_left, row.wheel_right]);
    w.finish()
}

pub(crate) fn joint_state(table: &CommandTable, row: &CommandRow, stamp: u64) -> Vec<u8> {
    let mut w = cdr::Writer::default();
    header(&mut w, stamp, "");
    names(&mut w, table);
    w.f64s(&row.joint_positions);
    w.f64s(&row.joint_velocities);
    w.length(0);
    w.finish()
}

#[cfg(test)]
pub(super) mod tests;
