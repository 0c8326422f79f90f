//! Diagnostics: what is wrong, where, and what to do. `render` is the only code that formats one.

pub mod json_schema;
mod render;
pub mod shape;
mod words;
pub mod yaml;

use std::ops::Range;
use std::sync::Arc;

pub use render::render;

/// A text that a person wrote, kept for quoting.
#[derive(Debug, Default, PartialEq)]
pub struct Source {
    /// Path as the user knows it.
    pub name: String,
    /// The whole text.
    pub text: String,
}

/// A place in a [`Source`]: byte range.
#[derive(Debug, Clone, PartialEq)]
pub struct Span {
    /// The text it points into.
    pub source: Arc<Source>,
    /// Byte range, within the text.
    pub range: Range<usize>,
}

impl Span {
    /// A place; the range is cut to the text.
    pub fn new(source: &Arc<Source>, range: Range<usize>) -> Self {
        let end = source.text.len();
        Self { source: source.clone(), range: range.start.min(end)..range.end.clamp(range.start.min(end), end) }
    }
}

/// How a run that failed must end; see `DESIGN` section 2 of the project's contract (`--help` says the same).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Exit 1: inputs are good, but there is no trajectory, or the certificate is refused.
    NoTrajectory,
    /// Exit 2: input unreadable, inconsistent or missing.
    BadInput,
}

/// One fault.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostic {
    /// Stable identifier, such as `robot/unequal-wheels`.
    pub code: &'static str,
    /// What is wrong, with the numbers.
    pub message: String,
    /// Where in a text.
    pub at: Option<Span>,
    /// A file that has no text to quote (missing, binary).
    pub file: Option<String>,
    /// What to do.
    pub hint: Option<String>,
    /// Which exit code it asks for.
    pub severity: Severity,
    /// Numbers for `report.json`'s `failure`, in order.
    pub numbers: Vec<(&'static str, serde_json::Value)>,
}

impl Diagnostic {
    /// Bad input (exit 2).
    pub fn error(code: &'static str, message: impl ToString) -> Self {
        Self {
            code,
            message: message.to_string(),
            at: None,
            file: None,
            hint: None,
            severity: Severity::BadInput,
            numbers: Vec::new(),
        }
    }

    /// Good input, but no trajectory or no certificate (exit 1).
    pub fn failure(code: &'static str, message: impl ToString) -> Self {
        Self { severity: Severity::NoTrajectory, ..Self::error(code, message) }
    }

    /// Adds the place.
    pub fn at(mut self, span: &Span) -> Self {
        self.at = Some(span.clone());
        self
    }

    /// Adds the place, if known.
    pub fn maybe_at(mut self, span: Option<&Span>) -> Self {
        self.at = span.cloned();
        self
    }

    /// Adds the file, where there is no text to quote.
    pub fn file(mut self, name: impl Into<String>) -> Self {
        self.file = Some(name.into());
        self
    }

    /// Adds what to do.
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// Adds a number for `report.json`.
    pub fn number(mut self, key: &'static str, value: impl Into<serde_json::Value>) -> Self {
        self.numbers.push((key, value.into()));
        self
    }
}

/// One or more faults; what a run that fails returns. Never empty.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostics(pub Vec<Diagnostic>);

impl Diagnostics {
    /// The worst severity: decides the exit code.
    pub fn severity(&self) -> Severity {
        self.0.iter().map(|d| d.severity).max().unwrap_or(Severity::BadInput)
    }
}

/// The bridge from a stage's error type to what the user sees.
pub trait Describe {
    /// The diagnostic for this error.
    fn diagnostic(&self) -> Diagnostic;
}

impl From<Diagnostic> for Diagnostics {
    fn from(d: Diagnostic) -> Self {
        Self(vec![d])
    }
}

impl<E: Describe> From<E> for Diagnostics {
    fn from(error: E) -> Self {
        Self(vec![error.diagnostic()])
    }
}

impl<E: Describe> From<Vec<E>> for Diagnostics {
    fn from(errors: Vec<E>) -> Self {
        Self(errors.iter().map(Describe::diagnostic).collect())
    }
}

/// The known name nearest to a wrong one, if it is near enough to be meant: few letters differ (case apart), or one is the
/// other with a unit (`yaw_deg`, `clearance`).
pub fn nearest<'a>(wrong: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    if wrong.is_empty() || wrong.len() > 100 {
        return None;
    }
    let lower = wrong.to_lowercase();
    let unit_apart = |long: &str, short: &str| long.strip_prefix(short).is_some_and(|rest| rest.starts_with('_'));
    known
        .into_iter()
        .map(|name| {
            let (short, long) = (name.len().min(wrong.len()), name.len().max(wrong.len()));
            let far = long - short > long.div_ceil(3);
            let distance = if far { long } else { edit_distance(&lower, &name.to_lowercase()) };
            let meant = (distance <= long.div_ceil(3) && distance < short)
                || unit_apart(&lower, name)
                || unit_apart(name, &lower);
            (meant, distance, name)
        })
        .filter(|(meant, _, _)| *meant)
        .min_by_key(|(_, distance, _)| *distance)
        .map(|(_, _, name)| name)
}

/// What to do about a name that is not known: the nearest that is, or else those that are. `are`: how the list of them begins,
/// such as `known keys are`; `none`: what to say where there are none.
pub fn suggestion<'a>(wrong: &str, known: impl IntoIterator<Item = &'a str>, are: &str, none: &str) -> String {
    const MOST: usize = 12;
    let known: Vec<&str> = known.into_iter().collect();
    if let Some(near) = nearest(wrong, known.iter().copied()) {
        return format!("did you mean `{near}`?");
    }
    if known.is_empty() {
        return none.to_owned();
    }
    let shown: Vec<String> = known.iter().take(MOST).map(|name| format!("`{name}`")).collect();
    let more = known.len().saturating_sub(MOST);
    let rest = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{are} {}{rest}", shown.join(", "))
}

/// Letters to insert, remove, replace or swap with their neighbour.
fn edit_distance(a: &str, b: &str) -> usize {
    let (a, b): (Vec<char>, Vec<char>) = (a.chars().collect(), b.chars().collect());
    let mut rows: Vec<Vec<usize>> = vec![(0..=b.len()).collect()];
    for i in 1..=a.len() {
        let mut row = vec![i];
        for j in 1..=b.len() {
            let replaced = rows[i - 1][j - 1] + usize::from(a[i - 1] != b[j - 1]);
            let mut least = replaced.min(rows[i - 1][j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1] {
                least = least.min(rows[i - 2][j - 2] + 1);
            }
            row.push(least);
        }
        rows.push(row);
    }
    rows[a.len()][b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_the_one_that_was_meant() {
        let keys = ["robot", "map", "start", "goal", "clearance_m", "sampling_time_s", "sampling", "yaw", "x_m", "eta"];
        for (wrong, meant) in [
            ("mpa", "map"),
            ("goals", "goal"),
            ("strat", "start"),
            ("clearance", "clearance_m"),
            ("yaw_deg", "yaw"),
            ("x", "x_m"),
            ("Robot", "robot"),
            ("sampling_time", "sampling_time_s"),
            ("samplig", "sampling"),
        ] {
            assert_eq!(nearest(wrong, keys), Some(meant), "{wrong}");
        }
        for wrong in ["", "a", "q", "colour", "résumé"] {
            assert_eq!(nearest(wrong, keys), None, "{wrong}");
        }
    }

    #[test]
    fn a_key_of_a_megabyte_is_compared_at_once() {
        assert_eq!(nearest(&"k".repeat(1 << 20), ["goal"]), None);
    }
}
