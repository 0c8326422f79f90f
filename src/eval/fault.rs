//! What can be wrong with a file of scenes, by the place in its tree.

use super::json::shortened;
use super::scenes::SCHEMA;
use crate::diag::{Describe, Diagnostic, Diagnostics, nearest};

/// No more faults than this are collected from one file.
pub(super) const MOST: usize = 100;

/// Why a text is no set of scenes. Every `path` is the place in the JSON tree, such as `scenes[3].start.yaw`.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ScenesError {
    /// Not JSON.
    #[error("not JSON: {0}")]
    Syntax(String),
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
            Self::Syntax(_) => {
                Diagnostic::error("scenes/syntax", self).hint("the format is JSON, not YAML or JSON lines")
            }
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
            Self::Kind { .. } => Diagnostic::error("scenes/wrong-type", self),
            Self::Range { .. } => Diagnostic::error("scenes/out-of-range", self),
            Self::UpsideDown { .. } => Diagnostic::error("scenes/upside-down", self).hint("`min` before `max`"),
            Self::Id { .. } => Diagnostic::error("scenes/id", self).hint(
                "1 to 100 letters, digits, `-`, `_` and `.`, not beginning with `.`: commands are written to DIR/ID",
            ),
            Self::RepeatedId { .. } => Diagnostic::error("scenes/repeated-id", self).hint("give each scene its own id"),
            Self::UnknownJoint { known, .. } => {
                let hint = match known.is_empty() {
                    true => "this robot has no moving joint; `--robot` chooses another".to_owned(),
                    false => format!("moving joints: {}", known.join(", ")),
                };
                Diagnostic::error("scenes/unknown-joint", self).hint(hint)
            }
        }
    }
}

/// Faults of one file, for the user.
pub(super) fn diagnostics(file: &str, faults: &[ScenesError]) -> Diagnostics {
    Diagnostics(faults.iter().map(|f| f.diagnostic().file(file)).collect())
}
