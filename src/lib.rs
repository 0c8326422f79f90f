//! `trajc`: the motion compiler for robots that change shape.
//!
//! Reads a robot (URDF), a map and a mission, and writes an executable motion file with a certificate. One module a stage,
//! in this order; imports only go up the list:
//!
//! | stage | makes | from |
//! |---|---|---|
//! | [`mission`] | [`mission::Mission`] | YAML text |
//! | [`robot`] | [`robot::RobotModel`] | URDF and robot.yaml text |
//! | [`map`] | [`map::VoxelMap`] | point, voxel or image bytes |
//! | [`esdf`] | [`esdf::Esdf`] | `VoxelMap` |
//! | [`trajectory`] | [`trajectory::Trajectory`] | a given path (Bezier, CSV), or `optimize` |
//! | [`search`] | [`search::SearchPath`] | `Esdf`, `RobotModel` |
//! | [`optimize`] | `Trajectory` | `SearchPath`, `Esdf`, `RobotModel` |
//! | [`retime`] | [`retime::MotionProfile`] | `Trajectory`, `RobotModel` |
//! | [`command`] | [`command::CommandTable`] | `MotionProfile` |
//! | [`certify`] | [`certify::Certificate`] | `CommandTable`, `RobotModel`, `VoxelMap` |
//! | [`report`] | [`report::Report`] | the nouns above |
//! | [`emit`] | bytes | `CommandTable`, `Report` |
//!
//! [`pipeline`] runs them; [`eval`] runs it over suites of scenes; [`cli`] is the program.
//!
//! # Papers
//! *\[SCR\]*: Zhang, Xu, Gao, Cao, "Trajectory Optimization for 3D Shape-Changing Robots with Differential Mobile Base".
//! *\[CONV\]*: Yang, Choi, "Joint Space Trajectory Planning Considering Physical Limits with Convolution Operator for Mobile
//! Robots".
//!
//! # Glossary
//! *clearance*: distance from the robot's surface to the nearest obstacle's surface, negative inside. *track width*: distance
//! between the driving wheels (\[SCR\]: wheelbase `d_wb`, \[CONV\]: `D`). *joints*: the moving joints that change the shape
//! (\[SCR\]: SC-DOF). *posture*: one value for every joint. *piece*: one polynomial; *waypoint*: joins two pieces. *leg*: a
//! stretch of motion from rest to rest. *travel*: path length of a wheel's rim, signed.

pub mod certify;
pub mod cli;
pub mod command;
pub mod diag;
pub mod emit;
pub mod esdf;
pub mod eval;
pub mod geom;
pub mod map;
pub mod math;
pub mod mission;
pub mod optimize;
pub mod pipeline;
pub mod report;
pub mod retime;
pub mod robot;
pub mod search;
pub mod trajectory;
