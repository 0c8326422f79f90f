//! Faults while writing: a disk that is full, folders that may not be written to, a process that is killed, two of them at once, a
//! clock that is set back. Afterwards each mission's folder is whole or absent, and the next build makes what is missing alone.
//!
//! What a system does not let a test do is told with `SKIPPED`. `TRAJC_KILLS=500` kills that often.

#[path = "faults/batch.rs"]
mod batch;
#[path = "faults/clock.rs"]
mod clock;
#[cfg(target_os = "linux")]
#[path = "faults/every_step.rs"]
mod every_step;
#[cfg(target_os = "linux")]
#[path = "faults/forbidden.rs"]
mod forbidden;
#[cfg(target_os = "linux")]
#[path = "faults/full.rs"]
mod full;
#[cfg(target_os = "linux")]
#[path = "faults/killed.rs"]
mod killed;
#[allow(dead_code, reason = "what the tests of the command line need")]
#[path = "cli/sandbox.rs"]
mod sandbox;
#[path = "faults/together.rs"]
mod together;

/// Whether a system lets a test do this; says what is not tried where it does not.
#[cfg(target_os = "linux")]
fn possible(probe: &mut std::process::Command, what: &str) -> bool {
    let works = probe.output().is_ok_and(|output| output.status.success());
    if !works {
        eprintln!("SKIPPED: this system does not allow it: {what}");
    }
    works
}
