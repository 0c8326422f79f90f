//! The receivers, one file each.

pub mod can;
pub mod cannelloni;
pub mod stdout;
pub mod tracer;
pub mod udp;
