//! The most memory that one input may take: a file, what is unpacked from it, a map's grid, its distance field.
//!
//! Readers ask before they allocate. One limit for the process, as memory is; what fits within it never changes any output. The
//! command line sets it (`--max-memory`, else half of the machine's memory); a program that uses this crate may.

use std::sync::atomic::{AtomicU8, AtomicU64, Ordering};

/// The limit where nobody has set one and the machine's memory is not known, bytes.
pub const UNKNOWN: u64 = 4 << 30;

static CAP: AtomicU64 = AtomicU64::new(UNKNOWN);
static SOURCE: AtomicU8 = AtomicU8::new(Source::Unknown as u8);

/// Where the limit comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub enum Source {
    /// Nobody knows how much memory there is.
    Unknown = 0,
    /// Half of what there is.
    Machine = 1,
    /// The user said so.
    Asked = 2,
}

/// Sets the limit, bytes.
pub fn set(bytes: u64, source: Source) {
    CAP.store(bytes, Ordering::Relaxed);
    SOURCE.store(source as u8, Ordering::Relaxed);
}

/// The limit, bytes.
pub fn cap() -> u64 {
    CAP.load(Ordering::Relaxed)
}

/// Something would take more than the limit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{} of memory, more than {}", shown(*.needs), limit())]
pub struct TooMuch {
    /// Bytes that it would take.
    pub needs: u128,
}

/// What to do about it.
pub const HINT: &str = "allow more with --max-memory, such as --max-memory 16GiB, if the machine has it";

/// Asks for so many bytes.
///
/// # Errors
/// They are more than the limit.
pub fn fits(needs: u128) -> Result<(), TooMuch> {
    if needs <= u128::from(cap()) { Ok(()) } else { Err(TooMuch { needs }) }
}

/// The limit in words.
fn limit() -> String {
    let cap = shown(cap().into());
    match SOURCE.load(Ordering::Relaxed) {
        1 => format!("half of this machine's, {cap}"),
        2 => format!("--max-memory {cap}"),
        _ => format!("{cap}, the limit where it is not known how much there is"),
    }
}

/// A number of bytes to three digits.
pub fn shown(bytes: u128) -> String {
    let mut value = bytes as f64;
    for unit in ["bytes", "KiB", "MiB", "GiB", "TiB"] {
        if value < 1024.0 {
            let digits = if unit == "bytes" || value >= 100.0 { 0 } else { 1 };
            let text = format!("{value:.digits$}");
            return format!("{} {unit}", text.strip_suffix(".0").unwrap_or(&text));
        }
        value /= 1024.0;
    }
    format!("{value:.0} PiB")
}

/// Bytes of `512MiB`, `8GB`, `2.5G` or plain `1000000`; `None`: not that.
pub fn parse(text: &str) -> Option<u64> {
    let digits = text.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(text.len());
    let (number, unit) = text.split_at(digits);
    let number: f64 = number.parse().ok()?;
    let (thousand, unit) = match unit.trim().to_ascii_lowercase() {
        unit if unit.ends_with("ib") => (1024.0, unit.trim_end_matches("ib").to_owned()),
        unit if unit.ends_with('b') => (1000.0, unit.trim_end_matches('b').to_owned()),
        // As dd and systemd mean it.
        unit => (1024.0, unit),
    };
    let power = ["", "k", "m", "g", "t"].iter().position(|known| *known == unit)?;
    let bytes = (0..power).fold(number, |bytes, _| bytes * thousand);
    // Less than a mebibyte holds no mission.
    (1_048_576.0..1e18).contains(&bytes).then_some(bytes as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_and_shown() {
        for (text, bytes) in [
            ("8GiB", 8 << 30),
            ("8G", 8 << 30),
            ("1.5 MiB", 3 << 19),
            ("2GB", 2_000_000_000),
            ("3000000", 3_000_000),
            ("3000000B", 3_000_000),
        ] {
            assert_eq!(parse(text), Some(bytes), "{text}");
        }
        for text in ["", "G", "-1G", "1e9", "1X", "0", "10k", "1.2.3M", "nan", "99999999T", "infG"] {
            assert_eq!(parse(text), None, "{text}");
        }
        for (bytes, text) in [(0, "0 bytes"), (1 << 20, "1 MiB"), (11_811_160_064, "11 GiB"), (1_600, "1.6 KiB")] {
            assert_eq!(shown(bytes), text);
        }
    }

    #[test]
    fn what_is_above_the_limit_is_refused() {
        assert_eq!(fits(cap().into()), Ok(()));
        let fault = fits(u128::from(cap()) + 1).expect_err("too much").to_string();
        assert!(fault.contains("more than"), "{fault}");
    }
}
