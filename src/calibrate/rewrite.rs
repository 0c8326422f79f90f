//! Puts a calibration into robot.yaml. All else stays as it is, byte for byte: comments, order, spacing.

use std::sync::Arc;

use super::Fit;
use crate::diag::yaml::{self, Node};
use crate::diag::{Diagnostics, Source};
use crate::math::real;

/// Why it cannot be put in.
#[derive(Debug)]
pub enum RewriteError {
    /// Not YAML.
    Yaml(Diagnostics),
    /// A key that should hold a table holds something else.
    NotATable(&'static str),
}

/// The text of robot.yaml with a calibration: `drive.wheel_radius_m`, `drive.wheel_difference`, `drive.track_width_m`, and what remains under `tolerance`.
///
/// # Errors
/// The text is no YAML, or `drive` or `tolerance` is no table.
pub fn rewrite(name: &str, text: &str, fit: &Fit) -> Result<String, RewriteError> {
    let percent = |share: f64| format!("{}%", rounded(100.0 * share, 2));
    let [radius, difference, track] = fit.deviations();
    let remaining = fit.remaining();
    // Digits that mean something: to a tenth of the standard deviation.
    let decimal = |value: f64, deviation: f64| {
        let places = (1.0 - real::log10(deviation.max(1e-9))).ceil().clamp(3.0, 9.0) as usize;
        format!("{value:.places$}")
    };
    let larger = match fit.larger_right() {
        0.0 => "0%".to_owned(),
        share => format!("{}%", decimal(100.0 * share, 100.0 * difference)),
    };
    let values = [
        // New keys go before those that are there: the last one comes first.
        ("drive", "track_width_m", decimal(fit.geometry[2], track)),
        ("drive", "wheel_difference", larger),
        ("drive", "wheel_radius_m", decimal(fit.radius(), radius)),
        ("tolerance", "track", percent(remaining.track)),
        ("tolerance", "wheel_difference", percent(remaining.wheel_difference)),
        ("tolerance", "wheel_radius", percent(remaining.wheel_radius)),
    ];
    values.into_iter().try_fold(text.to_owned(), |text, (table, key, value)| set(name, &text, table, key, &value))
}

/// A number with so many digits that count, rounded up: a tolerance is not to become smaller by being written.
fn rounded(value: f64, digits: i32) -> String {
    if value <= 0.0 {
        return "0".to_owned();
    }
    let places = (digits - 1 - real::log10(value).floor() as i32).max(0);
    let scale = real::powi(10.0, places);
    format!("{:.*}", places as usize, (value * scale - 1e-9).ceil() / scale)
}

/// The text with one value set.
fn set(name: &str, text: &str, table: &'static str, key: &str, value: &str) -> Result<String, RewriteError> {
    let source = Arc::new(Source { name: name.to_owned(), text: text.to_owned() });
    let root = yaml::load(&source).map_err(RewriteError::Yaml)?;
    let (at, put) = match root.entry(table).map(|entry| &entry.value) {
        None => {
            let gap = if text.is_empty() || text.ends_with('\n') { "" } else { "\n" };
            (text.len()..text.len(), format!("{gap}{table}: {{{key}: {value}}}\n"))
        }
        Some(node) => match (node.get(key), node.entries().first()) {
            (Some(old), _) => (old.range.clone(), value.to_owned()),
            (None, Some(first)) => {
                let begin = first.key_range.start;
                let line = text[..begin].rfind('\n').map_or(0, |at| at + 1);
                let indent = &text[line..begin];
                // A table in braces may begin its line too; a block's keys have nothing but blanks before them.
                let block = indent.chars().all(|c| c == ' ') && !opened(text, node, begin);
                let put = if block { format!("{key}: {value}\n{indent}") } else { format!("{key}: {value}, ") };
                (begin..begin, put)
            }
            (None, None) if text[node.range.clone()].starts_with('{') => {
                let begin = node.range.start + 1;
                (begin..begin, format!("{key}: {value}"))
            }
            (None, None) => return Err(RewriteError::NotATable(table)),
        },
    };
    let mut out = text.to_owned();
    out.replace_range(at, &put);
    Ok(out)
}

/// Whether a table is written in braces: one opens between its beginning and its first key.
fn opened(text: &str, node: &Node, first_key: usize) -> bool {
    text.get(node.range.start..first_key).is_some_and(|head| head.starts_with('{'))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::spec;

    fn fit() -> Fit {
        let variances = [1e-10, 1e-10, 4e-8];
        let covariance = [0, 1, 2].map(|i| [0, 1, 2].map(|j| if i == j { variances[i] } else { 0.0 }));
        Fit { geometry: [0.0801, 0.0803, 0.3215], covariance, pairs: 40, outliers: 1, residual: 1.0 }
    }

    fn written(text: &str) -> String {
        rewrite("robot.yaml", text, &fit()).expect("a robot.yaml")
    }

    #[test]
    fn values_are_replaced_or_added_and_nothing_else_changes() {
        let text = "# mine\nurdf: a.urdf   # as built\ndrive: {left: l, wheel_radius_m: 0.08,  right: r} # wheels\nlimits:\n  wheel: {speed_mps: 1}\n";
        let expected = "# mine\nurdf: a.urdf   # as built\ndrive: {wheel_difference: 0.249%, track_width_m: 0.32150, left: l, wheel_radius_m: 0.0802000,  right: r} # wheels\n\
                        limits:\n  wheel: {speed_mps: 1}\n\
                        tolerance: {wheel_radius: 0.027%, wheel_difference: 0.053%, track: 0.19%}\n";
        assert_eq!(written(text), expected);
    }

    #[test]
    fn blocks_and_files_without_the_tables_are_written_too() {
        let block = "drive:\n  # found\n  left: l\n  right: r\nurdf: a.urdf";
        let text = written(block);
        assert!(text.starts_with("drive:\n  # found\n  wheel_radius_m: 0.0802000\n  wheel_difference: 0.249%\n  track_width_m: 0.32150\n  left: l\n  right: r\nurdf: a.urdf\n"), "{text}");
        let text = written("urdf: a.urdf\n");
        assert!(
            text.contains("drive: {wheel_radius_m: 0.0802000, wheel_difference: 0.249%, track_width_m: 0.32150}\n"),
            "{text}"
        );
    }

    #[test]
    fn what_is_written_is_read_back_and_written_again_the_same() {
        let text = written("urdf: a.urdf\ndrive: {left: l, right: r}\n");
        assert_eq!(written(&text), text);
        let drive: String =
            text.lines().filter(|line| !line.starts_with("tolerance")).map(|l| format!("{l}\n")).collect();
        let spec = spec::parse("robot.yaml", &drive).expect("a robot.yaml");
        assert_eq!(spec.wheel_radius.map(|w| w.value), Some(0.0802));
        assert_eq!(spec.track_width.map(|w| w.value), Some(0.3215));
    }

    #[test]
    fn a_drive_that_is_no_table_is_refused() {
        assert!(matches!(rewrite("r", "drive: 3\n", &fit()), Err(RewriteError::NotATable("drive"))));
    }

    #[test]
    fn tolerances_are_rounded_up() {
        assert_eq!([0.1234, 0.0301, 2.0, 12.34, 0.0].map(|v| rounded(v, 2)), ["0.13", "0.031", "2.0", "13", "0"]);
    }
}
