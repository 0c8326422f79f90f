//! Command tables for the tests of this stage.

use super::csv::CsvHeader;
use crate::command::{CommandRow, CommandTable};
use crate::geom::Pose2;
use crate::math::real;
use crate::mission::Sampling;

/// A drive on a bend, with headings beyond pi, that ends at rest; joints move if there are any.
pub fn table(rows: usize, joints: &[(&str, bool)]) -> CommandTable {
    let mut table = CommandTable {
        sampling_time: 0.1,
        sampling: Sampling::Mean,
        wheel_radii: 0.08.into(),
        track_width: 0.32,
        joints: joints.iter().map(|(name, prismatic)| ((*name).to_string(), *prismatic)).collect(),
        rows: Vec::new(),
    };
    let position = |k: usize, j: usize| 0.3 + 0.01 * (j + 1) as f64 * real::sin(k.min(rows - 1) as f64 * 0.1);
    let mut pose = Pose2::new(0.5, -1.25, 3.0);
    for k in 0..rows {
        let last = k + 1 == rows;
        let speed = if last { 0.0 } else { 4.0 * real::sin(0.3 + k as f64 * 0.07).abs() };
        table.rows.push(CommandRow {
            wheel_left: 0.9 * speed,
            wheel_right: 1.1 * speed,
            joint_positions: (0..joints.len()).map(|j| position(k, j)).collect(),
            joint_velocities: (0..joints.len()).map(|j| (position(k + 1, j) - position(k, j)) / 0.1).collect(),
            pose,
        });
        let (v, omega) = table.twist(k);
        pose = pose.after_twist(v, omega, table.sampling_time);
    }
    table
}

/// A head as a compiled mission has it.
pub fn header() -> CsvHeader {
    CsvHeader {
        mission: "../../missions/arch_bridges.yaml".into(),
        robot: "../robots/scr_db/robot.yaml".into(),
        map: Some("../maps/arch_bridges.pcd".into()),
        inputs_blake3: "00ff".repeat(16),
    }
}
