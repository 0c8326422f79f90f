//! What a person reads after a mistake: a table of mistakes, each with the program's whole answer as a golden file in
//! `tests/messages/golden/AREA/NAME.snap`.
//!
//! Every case says what its message must hold (`messages/case.rs`): the file, line and column, which the test finds in the spoiled
//! file by itself; what was found there; what was expected; a hint. A case that goes without one of them says why. After an intended
//! change run with `INSTA_UPDATE=always` and read every text that moved.

#[path = "messages/arguments.rs"]
mod arguments;
#[path = "messages/case.rs"]
mod case;
#[path = "messages/commands.rs"]
mod commands;
#[path = "messages/distinct.rs"]
mod distinct;
#[path = "messages/logs.rs"]
mod logs;
#[path = "messages/maps.rs"]
mod maps;
#[path = "messages/missions.rs"]
mod missions;
#[path = "messages/paths.rs"]
mod paths;
#[path = "messages/plans.rs"]
mod plans;
#[path = "messages/robots.rs"]
mod robots;
#[allow(dead_code, reason = "what the tests of the command line need")]
#[path = "cli/sandbox.rs"]
mod sandbox;
#[path = "messages/scenes.rs"]
mod scenes;
#[path = "messages/urdfs.rs"]
mod urdfs;

use case::judge;

#[test]
fn mistakes_in_missions() {
    judge("mission", &missions::cases());
}

#[test]
fn mistakes_in_robot_yamls() {
    judge("robot", &robots::cases());
}

#[test]
fn mistakes_in_urdfs_and_meshes() {
    judge("urdf", &urdfs::cases());
}

#[test]
fn mistakes_in_maps() {
    judge("map", &maps::cases());
}

#[test]
fn mistakes_in_path_files() {
    judge("path", &paths::cases());
}

#[test]
fn plans_that_cannot_be() {
    judge("plan", &plans::cases());
}

#[test]
fn mistakes_in_command_files() {
    judge("commands", &commands::cases());
}

#[test]
fn mistakes_in_logs_for_calibration() {
    judge("log", &logs::cases());
}

#[test]
fn mistakes_in_scenes() {
    judge("scenes", &scenes::cases());
}

#[test]
fn mistakes_in_arguments() {
    judge("arguments", &arguments::cases());
}
