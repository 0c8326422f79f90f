//! Numeric tools that know no robot, map or configuration.

pub mod banded;
pub mod block_tridiagonal;
#[cfg(test)]
pub(crate) mod fd;
pub mod gjk;
pub mod halton;
pub mod lbfgs;
#[cfg(test)]
pub(crate) mod noise;
pub mod pentadiagonal;
pub mod poly;
pub mod quadrature;
pub mod real;
pub mod smooth;
pub mod spline;
