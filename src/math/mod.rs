//! Numeric tools that know no robot, map or configuration.

pub mod gjk;
pub mod poly;
