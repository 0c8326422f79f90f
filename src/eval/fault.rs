//! What can be wrong with a file of scenes, by the place in its tree.

use std::ops::Range;
use std::sync::Arc;

use super::json::shortened;
use super::place::places;
use super::scenes::SCHEMA;
use crate::diag::{Describe, Diagnostic, Diagnostics, Source, Span, nearest, suggestion};

/// No more faults than this are collected from one file.
pub(super) const MOST: usize = 100;

/// Why a text is no set of scenes. Every `path` is the place in the JSON tree, such as `scenes[3].start.yaw`.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ScenesError {
    /// Not JSON.
    #[error("not JSON: {fault}, found {found}")]
    Syntax {
        /// What the parser says.
        fault: String,
        /// What stands there.
        found: String,
        /// Byte.
        at: usize,
    },
    /// Another kind of file.
    #[error("`schema` is {found}, expected \"{SCHEMA}\"")]
    Schema {
        /// What it says.
        found: String,
    },
    /// A key that must be there.
    #[error("`{path}` is missing")]
    Missing {
        /// Place of the key.
        path: String,
        /// What to write.
        example: &'static str,
    },
    /// A key that no version of the format has.
    #[error("unknown key `{path}`")]
    UnknownKey {
        /// Place of the key.
        path: String,
        /// The key itself.
        key: String,
        /// Keys that may be there.
        known: &'static [&'static str],
    },
    /// A key given twice.
    #[error("`{path}` is given twice")]
    RepeatedKey {
        /// Place of the key.
        path: String,
    },
    /// A value of another kind.
    #[error("`{path}` must be {expected}, found {found}")]
    Kind {
        /// Place of the value.
        path: String,
        /// What it must be.
        expected: &'static str,
        /// What it is.
        found: String,
    },
    /// A value out of range.
    #[error("`{path}` must be {range}, found {found}")]
    Range {
        /// Place of the value.
        path: String,
        /// What it must be.
        range: String,
        /// What it is.
        found: String,
    },
    /// A box or the bounds are upside down.
    #[error("`{path}`: lower corner {low} is not below upper corner {high} along {axis}")]
    UpsideDown {
        /// Place of the box.
        path: String,
        /// x, y or z.
        axis: char,
        /// m.
        low: f64,
        /// m.
        high: f64,
    },
    /// An id that cannot be a folder's name.
    #[error("`{path}`: \"{}\" cannot be the name of a folder", shortened(id))]
    Id {
        /// Place of the id.
        path: String,
        /// As written.
        id: String,
    },
    /// Two scenes of one name.
    #[error("`{path}`: another scene is called \"{}\" too", shortened(id))]
    RepeatedId {
        /// Place of the second.
        path: String,
        /// As written.
        id: String,
    },
    /// A joint that the robot has not.
    #[error("`{path}`: robot `{robot}` moves no joint of that name")]
    UnknownJoint {
        /// Place of the joint.
        path: String,
        /// The robot.
        robot: String,
        /// Joints that it moves.
        known: Vec<String>,
    },
}

impl Describe for ScenesError {
    fn diagnostic(&self) -> Diagnostic {
        match self {
            Self::Syntax { .. } => Diagnostic::error("scenes/syntax", self).hint(
                "JSON has keys in quotes, a comma between two entries and none behind the last, and every bracket closed: was the \
                 file cut off?",
            ),
            Self::Schema { .. } => Diagnostic::error("scenes/schema", self)
                .hint(format!("scenes begin with {{\"schema\": \"{SCHEMA}\", …")),
            Self::Missing { example, .. } => {
                Diagnostic::error("scenes/missing-key", self).hint(format!("for example {example}"))
            }
            Self::UnknownKey { key, known, .. } => {
                let hint = match nearest(key, known.iter().copied()) {
                    Some(meant) => format!("did you mean `{meant}`?"),
                    None => format!("known here: {}", known.join(", ")),
                };
                Diagnostic::error("scenes/unknown-key", self).hint(hint)
            }
            Self::RepeatedKey { .. } => Diagnostic::error("scenes/repeated-key", self).hint("keep one of the two"),
            Self::Kind { path, .. } => Diagnostic::error("scenes/wrong-type", self).hint(like(path)),
            Self::Range { path, .. } => Diagnostic::error("scenes/out-of-range", self).hint(like(path)),
            Self::UpsideDown { .. } => Diagnostic::error("scenes/upside-down", self).hint("`min` before `max`"),
            Self::Id { .. } => Diagnostic::error("scenes/id", self).hint(
                "1 to 100 letters, digits, `-`, `_` and `.`, not beginning with `.`: commands are written to DIR/ID",
            ),
            Self::RepeatedId { .. } => Diagnostic::error("scenes/repeated-id", self).hint("give each scene its own id"),
            Self::UnknownJoint { path, known, .. } => {
                let none = "this robot has no moving joint; `--robot` chooses another";
                let name = path.rsplit('.').next().unwrap_or_default();
                let hint = suggestion(name, known.iter().map(String::as_str), "its moving joints are", none);
                Diagnostic::error("scenes/unknown-joint", self).hint(hint)
            }
        }
    }
}

/// An example for what has this path.
fn like(path: &str) -> String {
    let key = path.rsplit('.').next().unwrap_or_default();
    let key = key.split('[').next().unwrap_or_default();
    let example = match key {
        "bounds" => "\"bounds\": [[0, 0, 0], [10, 10, 1]], in metres: the lower corner, then the upper one",
        "resolution" => "\"resolution\": 0.05, the size of a cell in metres",
        "clearance_m" => "\"clearance_m\": 0.05, in metres",
        "limits" => "\"limits\": {\"base\": {\"eta\": 0.4}}",
        "reverse" => "\"reverse\": true",
        "seed" => "\"seed\": 1",
        "name" => "\"name\": \"mine\"",
        "id" => "\"id\": \"scene-7\"",
        "kind" => "\"kind\": \"hall\"",
        "boxes" => "\"boxes\": [{\"min\": [1, 1, 0], \"max\": [1.6, 1.6, 0.4]}]",
        "min" => "\"min\": [1, 1, 0], in metres",
        "max" => "\"max\": [1.6, 1.6, 0.4], in metres",
        "x" | "y" | "yaw" | "start" | "goal" => "{\"x\": 0.5, \"y\": 0.5, \"yaw\": 0.0}, in metres and radians",
        "joints" => "\"joints\": {\"lift\": 0.1}, in radians or metres",
        "scenes" => "\"scenes\": [{\"id\": \"a\", …}], at least one",
        _ => "a number within these bounds",
    };
    format!("for example {example}")
}

impl ScenesError {
    /// Where it is in the text.
    fn place(&self, text: &str) -> Range<usize> {
        let at = |path: &str| places(text, path, super::read::join);
        let value = |path: &str| at(path).into_iter().next().map(|place| place.value);
        let key = |path: &str| at(path).into_iter().next_back().map(|place| place.key.unwrap_or(place.value));
        let found = match self {
            Self::Syntax { at, .. } => Some(*at..*at + text[*at..].chars().next().map_or(0, char::len_utf8)),
            Self::Schema { .. } => value("schema"),
            // Of what is missing, the table that lacks it.
            Self::Missing { path, .. } => {
                let table = path.rsplit_once('.').map_or("", |(table, _)| table);
                value(table).map(|range| range.start..range.start + 1)
            }
            Self::UnknownKey { path, .. } | Self::RepeatedKey { path } | Self::UnknownJoint { path, .. } => key(path),
            Self::Kind { path, .. } if path == "the document" => value(""),
            Self::Kind { path, .. }
            | Self::Range { path, .. }
            | Self::UpsideDown { path, .. }
            | Self::Id { path, .. }
            | Self::RepeatedId { path, .. } => value(path),
        };
        found.unwrap_or(0..0)
    }
}

/// Faults of one file, for the user.
pub(super) fn diagnostics(file: &str, text: &str, faults: &[ScenesError]) -> Diagnostics {
    let source = Arc::new(Source { name: file.to_owned(), text: text.to_owned() });
    Diagnostics(faults.iter().map(|f| f.diagnostic().at(&Span::new(&source, f.place(text)))).collect())
}
