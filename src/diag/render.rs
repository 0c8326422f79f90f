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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use proptest::prelude::*;

    use super::*;
    use crate::diag::Source;

    fn at(text: &str, range: std::ops::Range<usize>) -> String {
        let source = Arc::new(Source { name: "missions/a.yaml".into(), text: text.into() });
        // Not `Span::new`, which cuts the range: a renderer takes what it gets.
        let span = Span { source, range };
        render(&Diagnostic::error("a/b", "wrong").at(&span).hint("do it right").into(), false)
    }

    #[test]
    fn a_fault_shows_file_line_column_the_line_and_the_hint() {
        let want =
            "error[a/b]: wrong\n --> missions/a.yaml:2:4\n  |\n2 | b: zwei\n  |    ^^^^\n  |\n  = help: do it right\n";
        assert_eq!(at("a: 1\nb: zwei\nc: 3\n", 8..12), want);
        assert_eq!(at("a: 1\r\nb: zwei\r\nc: 3\r\n", 9..13), want);
    }

    #[test]
    fn columns_count_letters_and_leave_the_byte_order_mark_out() {
        assert!(at("\u{feff}é: x\n", 7..8).contains("a.yaml:1:4\n"));
    }

    #[test]
    fn a_span_over_several_lines_is_quoted_by_its_first() {
        let text = at("map:\n  file: x\ngoal: 1\n", 0..14);
        assert!(text.contains("1 | map:\n  | ^^^^\n") && !text.contains("file"), "{text}");
    }

    #[test]
    fn ends_of_texts_can_be_pointed_at() {
        for (text, at_byte, place) in [("", 0, ":1:1"), ("a", 1, ":1:2"), ("a\n", 2, ":2:1"), ("a\r\n", 1, ":1:2")] {
            let shown = at(text, at_byte..at_byte);
            assert!(shown.contains(&format!("a.yaml{place}\n")), "{text:?}: {shown}");
        }
        assert!(at("é", 1..usize::MAX).contains("^"));
        assert!(at("abc", usize::MAX..usize::MAX).contains(":1:4\n"));
    }

    #[test]
    fn a_line_of_a_megabyte_is_cut() {
        let long = "x".repeat(1 << 20);
        for range in [0..4, 500_000..500_004, 0..1 << 20] {
            let text = at(&long, range.clone());
            assert!(text.len() < 2_000, "{} bytes", text.len());
            assert!(text.contains(&format!(":1:{}\n", range.start + 1)));
        }
    }

    #[test]
    fn a_file_without_text_is_named() {
        let fault = Diagnostic::error("map/missing", "no such file").file("maps/a.pcd").hint("look again");
        let want = "error[map/missing]: no such file\n--> maps/a.pcd\n = help: look again\n";
        assert_eq!(render(&fault.into(), false), want);
    }

    #[test]
    fn a_fault_without_a_place_is_a_line_and_a_hint() {
        let fault = Diagnostic::failure("search/none", "the goal cannot be reached");
        assert_eq!(render(&fault.clone().into(), false), "error[search/none]: the goal cannot be reached\n");
        let want = "error[search/none]: the goal cannot be reached\n |\n = help: go elsewhere\n";
        assert_eq!(render(&fault.hint("go elsewhere").into(), false), want);
    }

    #[test]
    fn colour_is_there_only_when_asked_for_and_never_from_the_text() {
        let fault: Diagnostics =
            Diagnostic::error("a/b", "evil \u{1b}[31m").file("\u{1b}[2J").hint("\u{1b}]0;x").into();
        assert!(!render(&fault, false).contains('\u{1b}'));
        assert!(render(&fault, true).contains('\u{1b}'));
        assert!(!at("a: \u{1b}[31m\u{202e}\n", 3..8).contains(['\u{1b}', '\u{202e}']));
    }

    #[test]
    fn of_very_many_faults_the_first_are_shown_and_the_others_counted() {
        let many = Diagnostics(vec![Diagnostic::error("a/b", "wrong"); 1000]);
        let text = render(&many, false);
        assert_eq!(text.matches("error[a/b]").count(), MOST_SHOWN);
        assert!(text.ends_with("error: 960 more, not shown\n"), "{text}");
    }

    proptest! {
        #[test]
        fn no_text_and_no_range_panics(text in r"(\PC|[\r\n\t\x00-\x1f\x{feff}\x{200d}\x{301}漢😀é]){0,40}", a in 0usize..120, b in 0usize..120) {
            for colour in [false, true] {
                let source = Arc::new(Source { name: text.clone(), text: text.clone() });
                let fault = Diagnostic::error("a/b", &text).at(&Span { source, range: a..b }).hint(text.clone());
                prop_assert!(render(&fault.into(), colour).contains("a/b"));
            }
        }
    }
}
