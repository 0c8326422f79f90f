//! Stage 11: what is reported about a compiled mission.

pub mod path_error;
