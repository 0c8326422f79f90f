//! Where results and diagnostics go: results to stdout, diagnostics and progress to stderr.

use std::io::{self, IsTerminal, Write};

use indicatif::ProgressBar;

use crate::diag::{Diagnostic, Diagnostics, render};

/// The user's terminal, or the pipe in its place.
pub struct Terminal {
    /// Diagnostics are coloured.
    colour: bool,
    /// Results are.
    pub colour_results: bool,
    /// Asked for no progress (`--quiet`).
    pub quiet: bool,
    /// Why a result is not all there.
    lost: Option<io::Error>,
}

impl Terminal {
    /// Colour only on a terminal, and never where `NO_COLOR` is set.
    pub fn new() -> Self {
        let wanted = std::env::var_os("NO_COLOR").is_none_or(|v| v.is_empty());
        Self {
            colour: wanted && std::io::stderr().is_terminal(),
            colour_results: wanted && std::io::stdout().is_terminal(),
            quiet: false,
            lost: None,
        }
    }

    /// A result. A reader that has gone away is no error of ours; that it cannot be written is told at the end ([`Terminal::lost`]).
    pub fn print(&mut self, text: &str) {
        let mut stdout = std::io::stdout().lock();
        match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
                self.lost.get_or_insert(error);
            }
            _ => {}
        }
    }

    /// What is wrong with a result that was not printed to its end: a full disk, where stdout is a file.
    pub fn lost(&mut self) -> Option<Diagnostics> {
        let error = self.lost.take()?;
        let fault = Diagnostic::error("output/stdout", format!("cannot write the result to stdout: {error}"));
        Some(fault.hint("what was printed is not all there: make room where it goes, or send it elsewhere").into())
    }

    /// A remark on how it goes, beside the result: to stderr, unless it is to be quiet.
    pub fn remark(&mut self, text: &str) {
        if !self.quiet {
            let _ = std::io::stderr().write_all(text.as_bytes());
        }
    }

    /// Diagnostics.
    pub fn complain(&mut self, diagnostics: &Diagnostics) {
        let _ = std::io::stderr().write_all(render(diagnostics, self.colour).as_bytes());
    }

    /// A line that names the stage at work; only on a terminal, gone when it is dropped.
    pub fn progress(&self, what: &str) -> Progress {
        if self.quiet || !std::io::stderr().is_terminal() {
            return Progress(None);
        }
        let bar = ProgressBar::new_spinner();
        bar.set_prefix(what.to_owned());
        let style = indicatif::ProgressStyle::with_template("{spinner} {prefix}: {msg} {elapsed}");
        bar.set_style(style.unwrap_or_else(|_| indicatif::ProgressStyle::default_spinner()));
        bar.enable_steady_tick(std::time::Duration::from_millis(100));
        Progress(Some(bar))
    }
}

impl Default for Terminal {
    fn default() -> Self {
        Self::new()
    }
}

/// A progress line.
pub struct Progress(Option<ProgressBar>);

impl Progress {
    /// Names the stage.
    pub fn stage(&self, name: &'static str) {
        if let Some(bar) = &self.0 {
            bar.set_message(name);
        }
    }

    /// Says how far it is.
    pub fn say(&self, text: impl FnOnce() -> String) {
        if let Some(bar) = &self.0 {
            bar.set_message(text());
        }
    }

    /// Does something that prints, the line out of its way.
    pub fn aside<T>(&self, work: impl FnOnce() -> T) -> T {
        match &self.0 {
            Some(bar) => bar.suspend(work),
            None => work(),
        }
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some(bar) = &self.0 {
            bar.finish_and_clear();
        }
    }
}
