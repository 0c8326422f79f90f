//! Stage 12: bytes of the output files. Nothing here opens a file.

pub mod cdr;
pub mod csv;
mod csv_read;
pub mod json;
pub mod mcap;
pub mod mcap_read;
pub(crate) mod ros;

/// The shortest text that reads back as the same number; zero has no sign. `value` must be finite.
pub fn number(value: f64) -> String {
    let magnitude = value.abs();
    if magnitude == 0.0 {
        "0".to_string()
    } else if (1e-4..1e16).contains(&magnitude) {
        format!("{value}")
    } else {
        format!("{value:e}")
    }
}

#[cfg(test)]
pub(crate) mod samples;
