//! The curves of \[CONV\] section 3 under every time law, and hairpins tighter than half the track.
//!
//! [`suite`] has the curves with what independent solvers say of them, [`judge`] times one under every law and measures the commands as
//! they are written, [`table`] and [`document`] say what came out. What \[CONV\] says of a robot that clips its wheels' speeds is
//! [`clip`]'s.

pub mod clip;
mod figures;
mod judge;
mod path;
mod picture;
mod table;

pub use figures::document;
pub use judge::{Figures, Held, How, Judged, Miss, Row, judge};
pub use path::{Curve, suite};
pub use picture::picture;
pub use table::table;

/// An end point that is missed by more is missed, m: what a certificate allows.
pub const MISSED: f64 = 1e-3;
