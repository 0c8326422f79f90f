//! The text at the head of PCD and PLY files, with places for messages.

use std::ops::Range;
use std::sync::Arc;

use crate::diag::{Source, Span};

/// Headers are a few hundred bytes; what does not end here never will.
const LONGEST: usize = 1 << 20;

/// A header's text and its lines.
pub(super) struct Header {
    source: Arc<Source>,
    lines: Vec<Range<usize>>,
    /// Where the data begins in the file.
    pub(super) end: usize,
}

impl Header {
    /// Lines up to and with the first whose first word is `last`; `None` if there is none.
    pub(super) fn take(name: &str, bytes: &[u8], last: &str) -> Option<Self> {
        let head = &bytes[..bytes.len().min(LONGEST)];
        let mut lines = Vec::new();
        let mut start = 0;
        loop {
            let end = start + head.get(start..)?.iter().position(|b| *b == b'\n')?;
            lines.push(start..end);
            let is_last = super::points::words(&head[start..end]).next() == Some(last.as_bytes());
            start = end + 1;
            if is_last {
                break;
            }
        }
        // One byte a character, so that places in the text are places in the file.
        let text = head[..start].iter().map(|b| if b.is_ascii() { *b as char } else { '?' }).collect();
        Some(Self { source: Arc::new(Source { name: name.to_owned(), text }), lines, end: start })
    }

    /// The words of every line that has any, and the line's place.
    pub(super) fn lines(&self) -> impl Iterator<Item = (Vec<&str>, Span)> {
        self.lines.iter().filter_map(|range| {
            let line = &self.source.text[range.clone()];
            let words: Vec<&str> = line.split_ascii_whitespace().collect();
            let shown = range.start..range.start + line.trim_ascii_end().len();
            (!words.is_empty()).then(|| (words, Span::new(&self.source, shown)))
        })
    }
}
