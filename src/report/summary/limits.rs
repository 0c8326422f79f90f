//! The table of peaks against limits.

use super::significant;
use crate::report::schema::LimitPart;

/// Actuators listed; more are counted.
const ACTUATORS: usize = 8;
/// What is limited, and its unit after the position's.
const QUANTITIES: [(&str, &str); 3] = [("speed", "/s"), ("acceleration", "/s²"), ("jerk", "/s³")];

/// Lines of a table: an actuator each; peak, limit and what is left of it for speed, acceleration and jerk. `prismatic` says
/// which joints are measured in metres; wheels are, at the rim. No limits, no lines.
pub fn table(limits: &[LimitPart], prismatic: &dyn Fn(&str) -> bool) -> Vec<String> {
    let mut actuators: Vec<&str> = Vec::new();
    for row in limits {
        if !actuators.contains(&row.actuator.as_str()) {
            actuators.push(&row.actuator);
        }
    }
    let rows: Vec<Vec<String>> = actuators
        .iter()
        .take(ACTUATORS)
        .map(|actuator| {
            let metres = ["wheel_left", "wheel_right"].contains(actuator) || prismatic(actuator);
            let of = |(quantity, per): (&str, &str)| {
                let row = limits.iter().find(|r| r.actuator == *actuator && r.quantity == quantity);
                row.map_or_else(Default::default, |row| {
                    cells(row, &format!("{}{per}", if metres { "m" } else { "rad" }))
                })
            };
            std::iter::once((*actuator).to_owned()).chain(QUANTITIES.into_iter().flat_map(of)).collect()
        })
        .collect();
    let mut lines = aligned(&rows);
    if actuators.len() > ACTUATORS {
        lines.push(format!("and {} more in report.json", actuators.len() - ACTUATORS));
    }
    lines
}

/// Columns as wide as their widest cell: the first one, then pairs of which the second is flush right and close to the first.
fn aligned(rows: &[Vec<String>]) -> Vec<String> {
    let width = |column: usize| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
    let line = |row: &Vec<String>| {
        let padded = row.iter().enumerate().map(|(column, cell)| match (column, width(column)) {
            (0, width) => format!("{cell:<width$}"),
            (column, width) if column % 2 == 1 => format!("  {cell:<width$}"),
            (_, width) => format!(" {cell:>width$}"),
        });
        padded.collect::<String>().trim_end().to_owned()
    };
    rows.iter().map(line).collect()
}

/// Three digits: the table is to fit a narrow screen.
fn figure(value: f64) -> String {
    significant(value, 3)
}

/// Peak and limit; how much of the limit is left.
fn cells(row: &LimitPart, unit: &str) -> [String; 2] {
    let peak = row.peak.map_or("?".to_string(), figure);
    match (row.peak, row.limit) {
        (Some(value), Some(limit)) if limit > 0.0 && value <= limit * (1.0 + 1e-9) => {
            // Rounded down, so that no more is promised than there is.
            let left = (100.0 * (1.0 - value / limit)).max(0.0).floor();
            [format!("{peak}/{} {unit}", figure(limit)), format!("{left}%")]
        }
        (_, Some(limit)) => [format!("{peak}/{} {unit}", figure(limit)), "OVER".to_owned()],
        (_, None) => [format!("{peak}/∞ {unit}"), String::new()],
    }
}
