//! The real program, from its arguments to its files: what a user types, what comes back.
//!
//! Messages are golden (`tests/golden/cli_*.snap`). After an intended change run with `INSTA_UPDATE=always` and read every
//! text that moved.

#[path = "cli/alone.rs"]
mod alone;
#[path = "cli/bad_input.rs"]
mod bad_input;
#[path = "cli/bad_maps_and_robots.rs"]
mod bad_maps_and_robots;
#[path = "cli/calibrate.rs"]
mod calibrate;
#[path = "cli/chain.rs"]
mod chain;
#[path = "cli/check.rs"]
mod check;
#[path = "cli/compile.rs"]
mod compile;
#[path = "cli/hazards.rs"]
mod hazards;
#[path = "cli/inspect.rs"]
mod inspect;
#[path = "cli/robot.rs"]
mod robot;
#[path = "cli/sandbox.rs"]
mod sandbox;
#[path = "cli/stops.rs"]
mod stops;
