//! `commands.csv`, the command file, and `path_error.csv`.
//!
//! Lines `# key: value`, a header of column names, one row per sample:
//!
//! ```text
//! # format: trajc.commands/1
//! # sampling_time_s: 0.1
//! time_s,wheel_left_rad_s,wheel_right_rad_s,v_mps,omega_rad_s,joint.blade.pos_rad,joint.blade.vel_rad_s,x_m,y_m,yaw_rad
//! 0,1.5,1.5,0.12,0,0,0.1,0.5,0.5,0
//! ```

pub use super::csv_read::{read, read_to_judge};
use super::number;
use crate::command::{CommandRow, CommandTable};
use crate::report::{PathErrorRow, names};

/// The value of `format` in the head.
pub const FORMAT: &str = "trajc.commands/1";

/// What the head of a command file says beside the table's own figures.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CsvHeader {
    /// Path from the output folder to the mission file.
    pub mission: String,
    /// The robot file as written in the mission.
    pub robot: String,
    /// The map file as written in the mission, if it has one.
    pub map: Option<String>,
    /// BLAKE3 over all inputs' bytes, hexadecimal.
    pub inputs_blake3: String,
}

/// Key and value of every line of the head, in the order in which they are written.
pub(super) fn head(table: &CommandTable, header: &CsvHeader) -> Vec<(&'static str, String)> {
    let mut head =
        vec![("format", FORMAT.to_string()), ("mission", plain(&header.mission)), ("robot", plain(&header.robot))];
    head.extend(header.map.as_ref().map(|map| ("map", plain(map))));
    head.extend([
        ("sampling_time_s", number(table.sampling_time)),
        ("sampling", names::sampling(table.sampling).to_string()),
        ("wheel_radius_m", number(table.wheel_radii.mean)),
    ]);
    head.extend(table.wheel_radii.unlike().map(|share| ("wheel_difference", number(share))));
    head.extend([("track_width_m", number(table.track_width)), ("inputs_blake3", plain(&header.inputs_blake3))]);
    head
}

/// A value fits one line.
fn plain(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect::<String>().trim().to_string()
}

/// Names of a joint's position and velocity columns.
pub(super) fn joint_columns(name: &str, prismatic: bool) -> [String; 2] {
    let (position, velocity) = if prismatic { ("pos_m", "vel_mps") } else { ("pos_rad", "vel_rad_s") };
    [format!("joint.{name}.{position}"), format!("joint.{name}.{velocity}")]
}

/// The bytes of `commands.csv`. All numbers of the table must be finite. `v_mps` and `omega_rad_s` follow from the wheels by
/// [`CommandTable::twist`]. Reads back by [`read`] as the same table, except that control characters in the header's
/// values become spaces and surrounding spaces are lost.
pub fn write(table: &CommandTable, header: &CsvHeader) -> String {
    let mut text: String = head(table, header).iter().map(|(key, value)| format!("# {key}: {value}\n")).collect();
    text += &line(&columns(table));
    for (k, row) in table.rows.iter().enumerate() {
        let cells = cells(table.time(k), row, table.twist(k));
        text += &line(&cells.into_iter().map(number).collect::<Vec<_>>());
    }
    text
}

/// Names of the columns of `commands.csv`.
pub fn columns(table: &CommandTable) -> Vec<String> {
    let mut columns: Vec<String> =
        ["time_s", "wheel_left_rad_s", "wheel_right_rad_s", "v_mps", "omega_rad_s"].map(String::from).into();
    columns.extend(table.joints.iter().flat_map(|(name, prismatic)| joint_columns(name, *prismatic)));
    columns.extend(["x_m", "y_m", "yaw_rad"].map(String::from));
    columns
}

/// The values of a row, in the order of [`columns`]. `twist`: speed (m/s) and turn rate (rad/s).
pub fn cells(time: f64, row: &CommandRow, (v, omega): (f64, f64)) -> Vec<f64> {
    let mut cells = vec![time, row.wheel_left, row.wheel_right, v, omega];
    cells.extend(row.joint_positions.iter().zip(&row.joint_velocities).flat_map(|(p, v)| [*p, *v]));
    cells.extend([row.pose.x, row.pose.y, row.pose.yaw]);
    cells
}

/// The bytes of `path_error.csv`; a clearance that is unknown or without bound is an empty cell.
pub fn write_path_error(rows: &[PathErrorRow]) -> String {
    let columns = [
        "sampling_time_s",
        "sampling",
        "lateral_max_m",
        "lateral_rms_m",
        "end_point_m",
        "end_heading_rad",
        "clearance_min_m",
    ];
    let mut text = line(&columns);
    for row in rows {
        text += &line(&[
            number(row.sampling_time_s),
            row.sampling.clone(),
            number(row.lateral_max_m),
            number(row.lateral_rms_m),
            number(row.end_point_m),
            number(row.end_heading_rad),
            row.clearance_min_m.filter(|c| c.is_finite()).map(number).unwrap_or_default(),
        ]);
    }
    text
}

/// One record; names with commas or quotes are quoted.
pub fn line(cells: &[impl AsRef<[u8]>]) -> String {
    let mut writer = ::csv::WriterBuilder::new().from_writer(Vec::new());
    writer.write_record(cells).expect("memory takes all bytes");
    let bytes = writer.into_inner().expect("memory takes all bytes");
    String::from_utf8(bytes).expect("made of strings")
}

#[cfg(test)]
mod tests {
    use super::super::samples;
    use super::*;

    #[test]
    fn the_file_has_the_head_and_columns_of_the_contract() {
        let mut table = samples::table(3, &[("blade", false), ("lift", true)]);
        table.rows[1].wheel_left = -0.0;
        table.rows[1].pose.x = 1e-7;
        let text = write(&table, &samples::header());
        insta::assert_snapshot!(text.lines().take(10).collect::<Vec<_>>().join("\n"), @"
        # format: trajc.commands/1
        # mission: ../../missions/arch_bridges.yaml
        # robot: ../robots/scr_db/robot.yaml
        # map: ../maps/arch_bridges.pcd
        # sampling_time_s: 0.1
        # sampling: mean
        # wheel_radius_m: 0.08
        # track_width_m: 0.32
        # inputs_blake3: 00ff00ff00ff00ff00ff00ff00ff00ff00ff00ff00ff00ff00ff00ff00ff00ff
        time_s,wheel_left_rad_s,wheel_right_rad_s,v_mps,omega_rad_s,joint.blade.pos_rad,joint.blade.vel_rad_s,joint.lift.pos_m,joint.lift.vel_mps,x_m,y_m,yaw_rad
        ");
        let second = text.lines().nth(11).expect("two rows");
        assert!(second.starts_with("0.1,0,") && second.contains(",1e-7,"), "{second}");
    }

    #[test]
    fn every_number_is_the_shortest_that_reads_back() {
        for (value, text) in
            [(0.1, "0.1"), (1.0, "1"), (-0.0, "0"), (1e-7, "1e-7"), (1e22, "1e22"), (0.1 + 0.2, "0.30000000000000004")]
        {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn path_errors_have_one_row_per_sampling_time() {
        let row = PathErrorRow {
            sampling_time_s: 0.1,
            sampling: "mean".into(),
            lateral_max_m: 2.4e-4,
            lateral_rms_m: 1e-4,
            end_point_m: 5e-5,
            end_heading_rad: 0.0,
            clearance_min_m: None,
        };
        insta::assert_snapshot!(write_path_error(&[row]), @"
        sampling_time_s,sampling,lateral_max_m,lateral_rms_m,end_point_m,end_heading_rad,clearance_min_m
        0.1,mean,0.00024,0.0001,5e-5,0,
        ");
    }
}
