//! `trajc eval`: many scenes through the whole pipeline, and the papers' tables beside.
//!
//! [`document`] makes the suites of \[SCR\] section VI, [`arm`] rooms for robots with arms, [`read()`] reads `trajc.scenes/1`, [`judge`]
//! compiles one scene, [`tables`] prints what came out beside others' rows, [`figures`] says it in JSON. [`curves`]: the paths of \[CONV\]
//! section 3.

pub mod arm;
mod arm_table;
mod bound;
pub mod curves;
mod excess;
mod fault;
mod figure_tables;
pub mod figures;
mod fixed;
mod generate;
mod json;
mod judge;
pub mod paper;
mod picture;
mod place;
mod read;
mod rng;
mod room;
mod scenes;
mod statistics;
pub mod tables;
mod text_table;
pub mod trust;
mod turns;

pub use arm_table::ArmRow;
pub use bound::travel_time;
pub use excess::AlphaExcess;
pub use fault::ScenesError;
pub use generate::{default_boxes, default_count, document};
pub use judge::{Judged, judge};
pub use picture::{picture, picture_name};
pub use read::{LONGEST, read};
pub use scenes::{SCHEMA, Scene, SceneSet};
pub use statistics::Summary;
pub use turns::{Turns, least_radius};

use crate::mission::Parameterisation;
use crate::pipeline::CompileOptions;

/// The suites of \[SCR\] section VI, the scenes of two of its figures, and rooms for arms.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Suite {
    /// Cubes and arch bridges, 10 x 10 x 1 m: before and after optimisation.
    Table1,
    /// 20 boxes, 10 x 10 x 0.4 m: with and without dense sampling.
    Table2,
    /// 10, 20 and 35 boxes, start and goal more than 5 m apart: against other planners.
    Table3,
    /// One dense room with turns on the spot or nearly so: with and without dense sampling.
    Fig5,
    /// One way under two arch bridges, with the blades down and up.
    Fig6,
    /// 20 x 20 m with walls, floating boxes and tables, for a robot with an arm: random postures at start and goal.
    Arm,
}

impl Suite {
    /// All of them.
    pub const ALL: [Self; 6] = [Self::Table1, Self::Table2, Self::Table3, Self::Fig5, Self::Fig6, Self::Arm];

    /// As on the command line: `table1`, `fig5`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Table1 => "table1",
            Self::Table2 => "table2",
            Self::Table3 => "table3",
            Self::Fig5 => "fig5",
            Self::Fig6 => "fig6",
            Self::Arm => "arm",
        }
    }

    /// Whether it is one fixed scene with a picture, not scenes drawn from a seed.
    pub fn is_figure(self) -> bool {
        matches!(self, Self::Fig5 | Self::Fig6)
    }

    /// Whether it runs with the robot whose blades move; else with the rigid box.
    pub fn has_blades(self) -> bool {
        matches!(self, Self::Table1 | Self::Fig6)
    }

    /// How each scene is compiled besides as usual: in the paper's own parameterisation without dense sampling and with it; for
    /// Fig. 5 with every turn part of one smooth curve, as in the paper.
    pub fn variants(self) -> Vec<CompileOptions> {
        let flat = CompileOptions { parameterisation: Some(Parameterisation::Flat), ..Default::default() };
        match self {
            Self::Table2 => [false, true].map(|dense| CompileOptions { dense, ..flat }).to_vec(),
            Self::Fig5 => [false, true].map(|dense| CompileOptions { dense, spins: false, ..flat }).to_vec(),
            Self::Table1 | Self::Table3 | Self::Fig6 | Self::Arm => Vec::new(),
        }
    }

    /// The suite that a set of scenes belongs to by its name, such as `table3-35`.
    pub fn of(set: &SceneSet) -> Option<Self> {
        let of = |suite: &Self| {
            let rest = set.name.strip_prefix(suite.name());
            rest.is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
        };
        Self::ALL.into_iter().find(of)
    }
}
