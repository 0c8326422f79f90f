//! Formats diagnostics as text in rustc's manner.

use std::borrow::Cow;

use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet, normalize_untrusted_str};

use super::{Diagnostic, Diagnostics, Span};

/// More faults than this are only counted: the first ones explain the others.
const MOST_SHOWN: usize = 40;
/// Bytes of a line quoted at most on each side of the caret; the renderer cuts further, to the width of a terminal.
const MOST_QUOTED: usize = 4096;

/// The text of all diagnostics, one after the other, with colour if asked for. Ends with a line break.
pub fn render(diagnostics: &Diagnostics, colour: bool) -> String {
    let renderer = if colour { Renderer::styled() } else { Renderer::plain() };
    let shown = diagnostics.0.iter().take(MOST_SHOWN);
    let mut texts: Vec<String> = shown.map(|d| renderer.render(&[group(d)])).collect();
    let more = diagnostics.0.len().saturating_sub(MOST_SHOWN);
    if more > 0 {
        texts
            .push(renderer.render(&[Group::with_title(Level::ERROR.primary_title(format!("{more} more, not shown")))]));
    }
    let mut text = texts.join("\n\n");
    text.push('\n');
    text
}

fn group(d: &Diagnostic) -> Group<'_> {
    // Messages quote what users wrote: no control characters from there to the terminal.
    let title = Level::ERROR.primary_title(normalize_untrusted_str(&d.message)).id(d.code);
    let mut group = Group::with_title(title);
    match (&d.at, &d.file) {
        (Some(span), _) => group = group.element(quote(span)),
        (None, Some(file)) => group = group.element(Origin::path(normalize_untrusted_str(file))),
        (None, None) => {}
    }
    if let Some(hint) = &d.hint {
        group = group.element(Level::HELP.message(normalize_untrusted_str(hint)));
    }
    group
}

/// The line a span begins in, with the part of the span that lies in it. One line says where; a span of a whole block says
/// no more.
fn quote(span: &Span) -> Snippet<'_, annotate_snippets::Annotation<'_>> {
    let text = span.source.text.as_str();
    let start = boundary_before(text, span.range.start);
    let line_start = text[..start].rfind('\n').map_or(0, |i| i + 1);
    let line_end = text[start..].find('\n').map_or(text.len(), |i| start + i);
    let line = text[line_start..line_end].trim_end_matches('\r');
    let bom = if line_start == 0 && line.starts_with('\u{feff}') { '\u{feff}'.len_utf8() } else { 0 };

    let line = &line[bom..];
    let from = start.saturating_sub(line_start + bom).min(line.len());
    let until = boundary_before(text, span.range.end).saturating_sub(line_start + bom).clamp(from, line.len());
    let until = from + line[from..until].trim_end().len();
    let quoted = &line[..boundary_before(line, until.saturating_add(MOST_QUOTED).min(line.len()))];

    let number = text[..line_start].bytes().filter(|b| *b == b'\n').count() + 1;
    Snippet::source(Cow::Borrowed(quoted))
        .line_start(number)
        .path(normalize_untrusted_str(&span.source.name))
        .annotation(AnnotationKind::Primary.span(from..until))
}

/// The nearest character boundary at or before a byte position.
fn boundary_before(text: &str, at: usize) -> usize {
    (0..=at.min(text.len())).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0)
}
