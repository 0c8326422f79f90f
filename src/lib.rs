//! `trajc`: an offline trajectory compiler for differential-drive robots that change shape.
//!
//! Reads a robot (URDF), a map and a mission, and writes a motion file with a certificate: proven clearance, limits and end point
//! of the commands as they are written. The program is in [`cli`]; [`pipeline::compile`] runs every stage in order. One module a
//! stage; each imports only those above it:
//!
//! | stage | makes | from |
//! |---|---|---|
//! | [`mission`] | [`mission::Mission`] | YAML text |
//! | [`robot`] | [`robot::RobotModel`] | URDF and robot.yaml text |
//! | [`map`] | [`map::VoxelMap`] | point, voxel or image bytes |
//! | [`esdf`] | [`esdf::Esdf`] | `VoxelMap` |
//! | [`trajectory`] | [`trajectory::Trajectory`] | a given path (Bezier, CSV); of planned ones only the type |
//! | [`search`] | [`search::SearchPath`] | `VoxelMap`, `Esdf`, `RobotModel` |
//! | [`optimize`] | `Trajectory` | `SearchPath`, `Esdf`, `RobotModel` |
//! | [`retime`] | [`retime::MotionProfile`] | `Trajectory`, `RobotModel` |
//! | [`command`] | [`command::CommandTable`] | `MotionProfile`, `RobotModel` |
//! | [`certify`] | [`certify::Certificate`] | `CommandTable`, `RobotModel`, `VoxelMap` |
//! | [`report`] | [`report::Report`] | the nouns above |
//! | [`emit`] | bytes | `CommandTable`, `Report` |
//! | [`play`] | commands in real time | `CommandTable`, `RobotModel` |
//! | [`calibrate`] | wheel radii and track, robot.yaml text | a log, robot.yaml text |
//!
//! Above all stages are [`memory`], [`math`], [`geom`] and [`diag`]; below them [`pipeline`], [`inputs`] (reads missions and command files with
//! all that they name), [`eval`] (suites of scenes) and [`cli`]. Only `inputs` and `cli` open files: stages take text and bytes, so
//! a mission can be compiled from memory.
//!
//! # Example
//! A box of 0.4 m drives 2 m across a floor, around a post of 0.2 m in its way.
//!
//! ```
//! use trajc::pipeline::{self, CompileOptions, Inputs, MapFile, TextFile};
//! use trajc::robot::{self, NoFiles};
//! use trajc::{diag, emit, mission};
//!
//! let urdf = r#"<robot name="box">
//!   <link name="base">
//!     <collision><origin xyz="0 0 0.15"/><geometry><box size="0.4 0.4 0.3"/></geometry></collision>
//!   </link>
//!   <link name="left"/> <link name="right"/>
//!   <joint name="left_wheel" type="continuous">
//!     <parent link="base"/> <child link="left"/> <origin xyz="0 0.16 0.08"/> <axis xyz="0 1 0"/>
//!     <limit effort="5" velocity="6.25"/>
//!   </joint>
//!   <joint name="right_wheel" type="continuous">
//!     <parent link="base"/> <child link="right"/> <origin xyz="0 -0.16 0.08"/> <axis xyz="0 1 0"/>
//!     <limit effort="5" velocity="6.25"/>
//!   </joint>
//! </robot>"#;
//! // The wheels are found by themselves; their radius is not, since their links have no shape.
//! let drive = "urdf: box.urdf\ndrive: {wheel_radius_m: 0.08}\nlimits: {wheel: {acceleration_mps2: 0.5, jerk_mps3: 2.0}}\n";
//!
//! // Points in the middle of 5 cm cells: the floor of 3 x 2 m (it says what was seen), and a post.
//! let mut points = String::from("x_m,y_m,z_m\n");
//! for i in 0..60 {
//!     for j in 0..40 {
//!         let [x, y] = [i, j].map(|cell| 0.05 * f64::from(cell) + 0.025);
//!         points += &format!("{x},{y},0\n");
//!         if (1.4..1.6).contains(&x) && (0.7..0.9).contains(&y) {
//!             points += &format!("{x},{y},0.1\n");
//!         }
//!     }
//! }
//!
//! let text = "
//! robot: box.yaml
//! map: {file: floor.csv}
//! start: {x_m: 0.5, y_m: 1.0, yaw: 0deg}
//! goal: {x_m: 2.5, y_m: 1.0}     # heading: the compiler's choice
//! clearance_m: 0.05
//! ";
//! let file = |name: &str, text: &str| TextFile { name: name.into(), text: text.into() };
//! let mut inputs = Inputs {
//!     mission: mission::parse("around.yaml", text).expect("a mission"),
//!     mission_text: file("around.yaml", text),
//!     robot_spec: robot::spec::parse("box.yaml", drive).expect("a robot.yaml"),
//!     robot_yaml: Some(file("box.yaml", drive)),
//!     urdf: file("box.urdf", urdf),
//!     map: Some(MapFile { name: "floor.csv".into(), bytes: points.into_bytes(), beside: None }),
//!     path_csv: None,
//!     start_file: None,
//!     files: Box::new(NoFiles),
//! };
//!
//! let outcome = pipeline::compile(&mut inputs, &CompileOptions::default(), &mut |_stage| {});
//! let compiled = match (outcome.compiled, outcome.diagnostics) {
//!     (Some(compiled), _) => compiled,
//!     (None, faults) => panic!("{}", diag::render(&faults.expect("a reason"), false)),
//! };
//! assert!(compiled.certificate.clearance_proven >= Some(0.05));
//! assert!(compiled.certificate.limits_hold && compiled.certificate.end_point_error < 1e-3);
//!
//! let header = emit::csv::CsvHeader { mission: "around.yaml".into(), robot: "box.yaml".into(), ..Default::default() };
//! let csv = emit::csv::write(&compiled.commands, &header);
//! assert!(csv.starts_with("# format: trajc.commands/1\n"));
//! ```
//!
//! # Papers
//! *\[SCR\]*: Zhang, Xu, Gao, Cao, "Trajectory Optimization for 3D Shape-Changing Robots with Differential Mobile Base".
//! *\[CONV\]*: Yang, Choi, "Joint Space Trajectory Planning Considering Physical Limits with Convolution Operator for Mobile
//! Robots".
//! `MATH`: the project's own page of their equations, corrected; not part of the crate. What it says is repeated where it is used.
//!
//! # Glossary
//! *clearance*: distance from the robot's surface to the nearest obstacle's surface, negative inside. *track width*: distance
//! between the driving wheels (\[SCR\]: wheelbase `d_wb`, \[CONV\]: `D`). *joints*: the moving joints that change the shape
//! (\[SCR\]: SC-DOF). *posture*: one value for every joint. *piece*: one polynomial; *waypoint*: joins two pieces. *leg*: a
//! stretch of motion from rest to rest. *travel*: path length of a wheel's rim, signed. *rim speed*: wheel rate times wheel
//! radius. *spin*: a turn on the spot. *time law*: what makes a path a motion. *row*: one held command; *sampling time*: how
//! long it is held. *replay*: what a robot does that follows the rows exactly. *slab*: the heights between which a map's points
//! are obstacles. *unknown*: space that the map's maker never saw.

pub mod calibrate;
pub mod certify;
pub mod cli;
pub mod command;
pub mod diag;
pub mod emit;
pub mod esdf;
pub mod eval;
pub mod geom;
pub mod inputs;
pub mod map;
pub mod math;
pub mod memory;
pub mod mission;
pub mod optimize;
pub mod pipeline;
pub mod play;
pub mod report;
pub mod retime;
pub mod robot;
pub mod search;
pub mod trajectory;

/// The README's Rust blocks, run as tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
pub struct Readme;
