//! Numeric tools that know no robot, map or configuration.

pub mod poly;
pub mod quadrature;
pub mod spline;
