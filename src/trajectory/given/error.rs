//! What can be wrong with a given path.

use crate::diag::{Describe, Diagnostic, Span};

/// Why a given path cannot be driven.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GivenError {
    /// `bezier:` is empty.
    #[error("the path has no segments")]
    NoSegments,
    /// A control point is NaN or infinite.
    #[error("segment {segment} has a control point that is not finite")]
    NotFinite {
        /// From 1.
        segment: usize,
    },
    /// The segments do not join.
    #[error("segment {segment} starts {gap:.6} m from the end of the one before")]
    Gap {
        /// From 1.
        segment: usize,
        /// m.
        gap: f64,
    },
    /// All four control points are one point.
    #[error("segment {segment} has no length")]
    NoLength {
        /// From 1.
        segment: usize,
    },
    /// The derivative vanishes: a cusp, or an end whose handle has no length.
    #[error(
        "segment {segment} has no direction at u = {parameter:.4}: its derivative vanishes there (a cusp, or a handle of no length)"
    )]
    Cusp {
        /// From 1.
        segment: usize,
        /// Bezier parameter, 0 to 1.
        parameter: f64,
    },
    /// A CSV file without rows enough.
    #[error("a path needs two rows or more, this one has {rows}")]
    TooFewRows {
        /// The file.
        name: String,
        /// Rows of numbers.
        rows: usize,
    },
    /// A CSV file without a column that it must have.
    #[error("no column `{column}`: the header has {found}")]
    MissingColumn {
        /// Its name.
        column: &'static str,
        /// The columns that are there.
        found: String,
        /// The header.
        at: Span,
    },
    /// A column that means nothing.
    #[error("unknown column `{column}`")]
    UnknownColumn {
        /// From 1.
        line: usize,
        /// As written.
        column: String,
        /// The nearest that would be known.
        meant: Option<String>,
        /// The header.
        at: Span,
    },
    /// A column twice.
    #[error("column `{column}` is there twice")]
    DoubleColumn {
        /// From 1.
        line: usize,
        /// As written.
        column: String,
        /// The header.
        at: Span,
    },
    /// Not CSV, such as bytes that are not UTF-8 or a row of another length.
    #[error("the row has {found} cells, the header has {expected}")]
    Ragged {
        /// From 1.
        line: usize,
        /// Cells in the row.
        found: usize,
        /// Cells in the header.
        expected: usize,
        /// The row.
        at: Span,
    },
    /// A cell that is no finite number.
    #[error("`{text}` in column `{column}` is not a finite number")]
    NotANumber {
        /// From 1.
        line: usize,
        /// The column.
        column: String,
        /// As written.
        text: String,
        /// The row.
        at: Span,
    },
    /// A coordinate that no robot drives to.
    #[error("`{column}` is {value:e} m: farther than {limit} m from the origin")]
    FarAway {
        /// From 1.
        line: usize,
        /// The column.
        column: String,
        /// m.
        value: f64,
        /// m.
        limit: f64,
        /// The row.
        at: Span,
    },
    /// Two rows at one point: the chord between them has no direction.
    #[error("the same point as in the row before")]
    RepeatedPoint {
        /// From 1.
        line: usize,
        /// The row.
        at: Span,
    },
    /// The spline through the rows has a cusp.
    #[error("the path turns back on itself at or after this row: its curve has no direction there")]
    TurnsBack {
        /// From 1.
        line: usize,
        /// The last row before the cusp, or at it.
        at: Span,
    },
    /// A joint's spline leaves the joint's range.
    #[error("`{joint}` reaches {value:.6} on the way to the next row, outside {lower:.6} … {upper:.6}")]
    JointRange {
        /// From 1.
        line: usize,
        /// The joint.
        joint: String,
        /// rad or m.
        value: f64,
        /// rad or m.
        lower: f64,
        /// rad or m.
        upper: f64,
        /// The row.
        at: Span,
    },
}

impl Describe for GivenError {
    fn diagnostic(&self) -> Diagnostic {
        match self {
            Self::NoSegments => Diagnostic::error("path/no-segments", self).hint("give at least one segment of four points"),
            Self::NotFinite { .. } => Diagnostic::error("path/not-finite", self).hint("write metres, map frame"),
            Self::Gap { .. } => Diagnostic::error("path/gap", self).hint("a segment starts at the last point of the one before"),
            Self::NoLength { .. } => Diagnostic::error("path/no-length", self).hint("remove the segment"),
            Self::Cusp { .. } => Diagnostic::error("path/cusp", self)
                .hint("move the control points apart, or split the segment there: between segments the robot spins on the spot"),
            Self::TooFewRows { name, .. } => Diagnostic::error("path/too-few-rows", self)
                .file(name.as_str())
                .hint("below a header `x_m,y_m` write one row a point, in metres"),
            Self::MissingColumn { at, .. } => Diagnostic::error("path/missing-column", self)
                .at(at)
                .hint("the header is x_m, y_m and, if joints move, joint.NAME.pos_rad or joint.NAME.pos_m"),
            Self::UnknownColumn { meant, at, .. } => {
                let diagnostic = Diagnostic::error("path/unknown-column", self).at(at);
                match meant {
                    Some(meant) => diagnostic.hint(format!("did you mean `{meant}`?")),
                    None => diagnostic.hint("known are x_m, y_m and, for joints that move, joint.NAME.pos_rad or joint.NAME.pos_m"),
                }
            }
            Self::DoubleColumn { at, .. } => {
                Diagnostic::error("path/double-column", self).at(at).hint("keep one of the two columns")
            }
            Self::Ragged { at, .. } => Diagnostic::error("path/ragged", self)
                .at(at)
                .hint("a row has one cell for each column, separated by commas; decimals are written with a point"),
            Self::NotANumber { column, at, .. } => Diagnostic::error("path/not-a-number", self)
                .at(at)
                .hint(if column.ends_with("rad") { "write a number in radians, such as 1.57" } else { "write a number in metres, such as 0.5" }),
            Self::FarAway { at, .. } => Diagnostic::error("path/far-away", self).at(at).hint("metres are expected"),
            Self::RepeatedPoint { at, .. } => {
                Diagnostic::error("path/repeated-point", self).at(at).hint("leave one of the two rows out")
            }
            Self::TurnsBack { at, .. } => Diagnostic::error("path/turns-back", self)
                .at(at)
                .hint("a smooth curve cannot reverse on the spot; lead it around a bend, or use Bezier segments"),
            Self::JointRange { at, .. } => Diagnostic::error("path/joint-range", self)
                .at(at)
                .hint("the column is joined by a smooth spline, which may overshoot: keep rows off the limit or space them closer"),
        }
    }
}
