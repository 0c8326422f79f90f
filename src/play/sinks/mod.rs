//! The receivers, one file each.

pub mod can;
pub mod cannelloni;
#[cfg(feature = "foxglove")]
pub mod foxglove;
#[cfg(feature = "ros2")]
pub mod ros2;
#[cfg(all(feature = "can", target_os = "linux"))]
pub mod socketcan;
pub mod stdout;
pub mod topics;
pub mod tracer;
pub mod udp;
#[cfg(feature = "zenoh")]
pub mod zenoh;
