//! `trajectory.json`: the rows of `commands.csv` as a plain array of objects, for programs without an MCAP reader. No head: it
//! cannot be checked.

use super::{csv, number};
use crate::command::CommandTable;

/// The bytes of `trajectory.json`: one object a row, one row a line, keys as the columns of `commands.csv` in their order. All
/// numbers of the table must be finite; they read back as the same numbers.
pub fn write(table: &CommandTable) -> String {
    let keys: Vec<String> =
        csv::columns(table).iter().map(|c| serde_json::to_string(c).expect("text is plain JSON")).collect();
    let object = |k: usize| {
        let cells = csv::cells(table.time(k), &table.rows[k], table.twist(k));
        let pairs: Vec<String> =
            keys.iter().zip(cells).map(|(key, value)| format!("{key}: {}", number(value))).collect();
        format!("  {{{}}}", pairs.join(", "))
    };
    let rows: Vec<String> = (0..table.rows.len()).map(object).collect();
    format!("[\n{}\n]\n", rows.join(",\n"))
}

#[cfg(test)]
mod tests {
    use super::super::samples;
    use super::*;

    #[test]
    fn every_row_has_the_columns_of_the_csv_file_and_the_same_numbers() {
        let mut table = samples::table(20, &[("blade \"a\"", false), ("lift", true)]);
        table.rows[3].pose.x = 1e-7;
        table.rows[4].pose.x = 0.1 + 0.2;
        let rows: Vec<serde_json::Map<String, serde_json::Value>> =
            serde_json::from_str(&write(&table)).expect("an array of objects");
        assert!(rows.iter().all(|row| row.keys().eq(csv::columns(&table).iter())), "{:?}", rows[0].keys());
        // Rust's own parser is exact, that of serde_json to one digit.
        let text = write(&table);
        for (k, line) in text.lines().skip(1).take(20).enumerate() {
            let values = line.split(": ").skip(1).map(|rest| rest.split([',', '}']).next().unwrap_or_default());
            let cells = csv::cells(table.time(k), &table.rows[k], table.twist(k));
            assert_eq!(values.map(|v| v.parse().expect("a number")).collect::<Vec<f64>>(), cells);
        }
    }

    #[test]
    fn a_row_is_a_line() {
        let table = samples::table(2, &[]);
        insta::assert_snapshot!(write(&table), @r#"
        [
          {"time_s": 0, "wheel_left_rad_s": 1.0638727439808224, "wheel_right_rad_s": 1.3002889093098942, "v_mps": 0.09456646613162867, "omega_rad_s": 0.05910404133226792, "x_m": 0.5, "y_m": -1.25, "yaw_rad": 3},
          {"time_s": 0.1, "wheel_left_rad_s": 0, "wheel_right_rad_s": 0, "v_mps": 0, "omega_rad_s": 0, "x_m": 0.49063410154602904, "y_m": -1.2486931522718665, "yaw_rad": 3.005910404133227}
        ]
        "#);
    }
}
