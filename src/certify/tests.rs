//! The certificate as a whole: against dense sampling on random robots, maps and commands, and on cases made to slip through.

mod clearance;
mod faults;
mod links;
mod own_links;
pub(crate) mod peer;
pub(crate) mod robots;
mod tube;
mod vias;
mod zones;
