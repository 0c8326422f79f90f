//! The maps shipped with the crate.
