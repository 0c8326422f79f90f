//! YAML as a tree of values with byte spans, so that a fault in a value is shown where it is written.
//!
//! `serde_saphyr` reads; this module only keeps the places and bounds depth, size and aliases. Keys may repeat here: the
//! reader of the tree ([`super::shape`]) reports that together with all other faults.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use serde::de::{self, Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use serde_saphyr::budget::BudgetBreach;
use serde_saphyr::options::{DuplicateKeyPolicy, NonFiniteFloatPolicy, Options};
use serde_saphyr::{Error, Location, MessageFormatter, Spanned, UserMessageFormatter};

use super::words::shorten;
use super::{Diagnostic, Diagnostics, Source, Span};

/// Deepest nesting of maps and lists. Our own files need six levels.
pub const MAX_DEPTH: usize = 32;
/// Most values in one file, repetitions by aliases included.
pub const MAX_NODES: usize = 1_000_000;

/// A value and where it is written.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// What it is.
    pub value: Value,
    /// Byte range in the text; of an alias: of what it stands for.
    pub range: Range<usize>,
}

/// What a YAML node is.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// `null`, `~` or nothing at all.
    Null,
    /// `true` or `false` (YAML 1.2: `yes` and `no` are text).
    Flag(bool),
    /// Any number, infinities and NaN included.
    Number(f64),
    /// Everything else that is one word or quoted.
    Text(String),
    /// `[a, b]` or `- a` lines.
    List(Vec<Node>),
    /// `key: value` pairs, in order, repeated keys included.
    Map(Vec<Entry>),
}

/// One `key: value` pair.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// The key as written.
    pub key: String,
    /// Where the key is.
    pub key_range: Range<usize>,
    /// Its value.
    pub value: Node,
}

impl Node {
    /// The pairs of a map; empty for everything else.
    pub fn entries(&self) -> &[Entry] {
        match &self.value {
            Value::Map(entries) => entries,
            _ => &[],
        }
    }

    /// The items of a list; empty for everything else.
    pub fn items(&self) -> &[Node] {
        match &self.value {
            Value::List(items) => items,
            _ => &[],
        }
    }

    /// The first pair with this key whose value is not null.
    pub fn entry(&self, key: &str) -> Option<&Entry> {
        self.entries().iter().find(|e| e.key == key && e.value.value != Value::Null)
    }

    /// The value of [`Node::entry`].
    pub fn get(&self, key: &str) -> Option<&Node> {
        self.entry(key).map(|e| &e.value)
    }

    /// Text that is not empty.
    pub fn text(&self) -> Option<&str> {
        match &self.value {
            Value::Text(text) if !text.is_empty() => Some(text),
            _ => None,
        }
    }

    /// A finite number.
    pub fn number(&self) -> Option<f64> {
        match self.value {
            Value::Number(number) if number.is_finite() => Some(number),
            _ => None,
        }
    }

    /// A finite number, or finite degrees (`90deg`) in radians.
    pub fn angle(&self) -> Option<f64> {
        match &self.value {
            Value::Text(text) => degrees(text).map(f64::to_radians).filter(|angle| angle.is_finite()),
            _ => self.number(),
        }
    }

    /// A finite number, or finite percent (`0.2%`) as the share that they are.
    pub fn share(&self) -> Option<f64> {
        match &self.value {
            Value::Text(text) => percent(text).filter(|share| share.is_finite()),
            _ => self.number(),
        }
    }

    /// `true` or `false`.
    pub fn flag(&self) -> Option<bool> {
        match self.value {
            Value::Flag(flag) => Some(flag),
            _ => None,
        }
    }
}

/// The number of `90deg`, in degrees.
pub(super) fn degrees(text: &str) -> Option<f64> {
    plain_number(text.strip_suffix("deg")?)
}

/// The share that a text such as `0.2%` says.
pub(super) fn percent(text: &str) -> Option<f64> {
    plain_number(text.strip_suffix('%')?).map(|percent| percent / 100.0)
}

/// A decimal number and nothing else. (`f64::from_str` alone would take `inf` and `nan`.)
pub(super) fn plain_number(text: &str) -> Option<f64> {
    let plain = text.bytes().all(|b| b.is_ascii_digit() || b"+-.eE".contains(&b));
    if plain { text.parse().ok() } else { None }
}

/// Reads a text as one YAML document.
///
/// # Errors
/// Not YAML, more than one document, or beyond [`MAX_DEPTH`] or [`MAX_NODES`]: the one fault at which the parser stops.
pub fn load(source: &Arc<Source>) -> Result<Node, Diagnostics> {
    let text = source.text.as_str();
    match serde_saphyr::from_str_with_options::<Spanned<Raw>>(text, options()) {
        Ok(root) => Ok(node(root, text)),
        Err(error) => Err(explain(&error, source).into()),
    }
}

fn options() -> Options {
    serde_saphyr::options! {
        budget: serde_saphyr::budget! {
            max_depth: MAX_DEPTH,
            max_nodes: MAX_NODES,
            max_events: 3 * MAX_NODES,
            max_aliases: 1_000,
            max_anchors: 1_000,
        },
        alias_limits: serde_saphyr::alias_limits! { max_total_replayed_events: 100_000 },
        duplicate_keys: DuplicateKeyPolicy::PassThrough,
        non_finite_float_policy: NonFiniteFloatPolicy::PassThrough,
        reject_unsupported_tags: true,
        strict_booleans: true,
        with_snippet: false,
    }
}

/// A value as serde hands it over; children still with serde_saphyr's places.
enum Raw {
    Null,
    Flag(bool),
    Number(f64),
    Text(String),
    List(Vec<Spanned<Raw>>),
    Map(Vec<(Spanned<Raw>, Spanned<Raw>)>),
}

impl<'de> Deserialize<'de> for Raw {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(RawVisitor)
    }
}

struct RawVisitor;

impl<'de> Visitor<'de> for RawVisitor {
    type Value = Raw;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("any YAML value")
    }

    fn visit_unit<E: de::Error>(self) -> Result<Raw, E> {
        Ok(Raw::Null)
    }

    fn visit_bool<E: de::Error>(self, value: bool) -> Result<Raw, E> {
        Ok(Raw::Flag(value))
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<Raw, E> {
        Ok(Raw::Number(value as f64))
    }

    fn visit_u64<E: de::Error>(self, value: u64) -> Result<Raw, E> {
        Ok(Raw::Number(value as f64))
    }

    fn visit_i128<E: de::Error>(self, value: i128) -> Result<Raw, E> {
        Ok(Raw::Number(value as f64))
    }

    fn visit_u128<E: de::Error>(self, value: u128) -> Result<Raw, E> {
        Ok(Raw::Number(value as f64))
    }

    fn visit_f64<E: de::Error>(self, value: f64) -> Result<Raw, E> {
        Ok(Raw::Number(value))
    }

    fn visit_str<E: de::Error>(self, value: &str) -> Result<Raw, E> {
        Ok(Raw::Text(value.to_string()))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Raw, A::Error> {
        let mut items = Vec::new();
        while let Some(item) = seq.next_element()? {
            items.push(item);
        }
        Ok(Raw::List(items))
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Raw, A::Error> {
        let mut entries = Vec::new();
        while let Some(entry) = map.next_entry()? {
            entries.push(entry);
        }
        Ok(Raw::Map(entries))
    }
}

fn node(raw: Spanned<Raw>, text: &str) -> Node {
    let mut range = bytes(&raw.defined, text);
    let value = match raw.value {
        Raw::Null => Value::Null,
        Raw::Flag(flag) => Value::Flag(flag),
        Raw::Number(number) => Value::Number(number),
        Raw::Text(text) => Value::Text(text),
        Raw::List(items) => Value::List(items.into_iter().map(|item| node(item, text)).collect()),
        Raw::Map(entries) => Value::Map(
            entries
                .into_iter()
                .map(|(key, value)| {
                    let key = node(key, text);
                    let name = match key.value {
                        Value::Text(name) => name,
                        _ => text.get(key.range.clone()).unwrap_or_default().to_string(),
                    };
                    Entry { key: name, key_range: key.range, value: node(value, text) }
                })
                .collect(),
        ),
    };
    // The parser's place of a list or map is its first character only: stretch it to the last child and the bracket.
    let end = match &value {
        Value::List(items) => items.iter().map(|i| i.range.end).max(),
        Value::Map(entries) => entries.iter().map(|e| e.value.range.end.max(e.key_range.end)).max(),
        _ => Some(range.end),
    };
    let open = text.as_bytes().get(range.start).copied();
    if matches!(value, Value::List(_) | Value::Map(_)) {
        range.end = end.unwrap_or(range.end).max(range.end);
        let rest = text.get(range.end..).unwrap_or_default();
        let space = rest.len() - rest.trim_start().len();
        let close = rest.as_bytes().get(space).copied();
        if matches!((open, close), (Some(b'['), Some(b']')) | (Some(b'{'), Some(b'}'))) {
            range.end += space + 1;
        }
    }
    Node { value, range }
}

/// The byte range of a place, within the text and at character boundaries.
fn bytes(place: &Location, text: &str) -> Range<usize> {
    let boundary = |at: u64| {
        let at = usize::try_from(at).unwrap_or(text.len()).min(text.len());
        (0..=at).rev().find(|&i| text.is_char_boundary(i)).unwrap_or(0)
    };
    let span = place.span();
    match (span.byte_offset(), span.byte_len()) {
        (Some(start), Some(len)) => boundary(start)..boundary(start.saturating_add(len)),
        _ => {
            let line = text.split_inclusive('\n').nth(place.line().saturating_sub(1) as usize);
            let start = line.map_or(text.len(), |line| {
                let column = place.column().saturating_sub(1) as usize;
                let within = line.char_indices().nth(column).map_or(line.len(), |(i, _)| i);
                line.as_ptr() as usize - text.as_ptr() as usize + within
            });
            start..start
        }
    }
}

/// What a parser error means to the person who wrote the file.
fn explain(error: &Error, source: &Arc<Source>) -> Diagnostic {
    let mut error = error.without_snippet();
    while let Error::AliasError { error: inner, .. } = error {
        error = inner.without_snippet();
    }
    let place = error.location().unwrap_or(Location::UNKNOWN);
    let range = match place.line() {
        0 => 0..0,
        _ => bytes(&place, &source.text),
    };
    let diagnostic = match error {
        Error::Budget { breach: BudgetBreach::Depth { .. }, .. } => {
            let message = format!("maps and lists are nested deeper than {MAX_DEPTH} levels");
            Diagnostic::error("yaml/too-deep", message).hint("no key needs that: look for brackets that are not closed")
        }
        Error::Budget { .. }
        | Error::AliasReplayLimitExceeded { .. }
        | Error::AliasExpansionLimitExceeded { .. }
        | Error::AliasReplayStackDepthExceeded { .. }
        | Error::AliasReplayCounterOverflow { .. } => {
            Diagnostic::error("yaml/too-large", "the file is too large, or its aliases (`*name`) repeat too much")
                .hint("write values out, and keep long paths in a CSV file (`path: {file: path.csv}`)")
        }
        Error::MultipleDocuments { .. } => {
            Diagnostic::error("yaml/several-documents", "the file holds more than one YAML document")
                .hint("one file is one document: remove the `---` line and what follows it")
        }
        Error::UnknownAnchor { .. } => {
            let rest = source.text.get(range.start..).unwrap_or_default();
            let alias = rest.split([' ', ',', ']', '}', '\n', '\r']).next().unwrap_or_default();
            let name = alias.trim_start_matches('*');
            Diagnostic::error("yaml/syntax", format!("the alias `*{name}` has no anchor `&{name}` before it"))
                .hint("put text that begins with `*` in quotes")
        }
        Error::UnsupportedTag { tag, .. } => {
            Diagnostic::error("yaml/syntax", format!("the tag `{tag}` has no meaning here"))
                .hint("remove it; put text that begins with `!` in quotes")
        }
        other => {
            return syntax(&UserMessageFormatter.format_message(other), source, range);
        }
    };
    diagnostic.at(&Span::new(source, range))
}

/// The first tab in the indentation of a line from here on.
fn tab_in_indentation(text: &str, from: usize) -> Option<usize> {
    let mut at = from;
    text[from..].split_inclusive('\n').find_map(|line| {
        let indentation = line.len() - line.trim_start_matches([' ', '\t']).len();
        let found = line[..indentation].find('\t').map(|tab| at + tab);
        at += line.len();
        found
    })
}

/// The last quote before this place in a line where it is not closed.
fn open_quote(text: &str, before: usize) -> Option<usize> {
    let mut end = text[before..].find('\n').map_or(text.len(), |i| before + i);
    loop {
        let start = text[..end].rfind('\n').map_or(0, |i| i + 1);
        let line = &text[start..end];
        let open = ['"', '\''].into_iter().find(|quote| line.matches(*quote).count() % 2 == 1);
        if let Some(at) = open.and_then(|quote| line.rfind(quote)) {
            return Some(start + at);
        }
        end = start.checked_sub(1)?;
    }
}

/// The parser's words for a syntax error, in those of who wrote the file.
fn syntax(words: &str, source: &Arc<Source>, range: Range<usize>) -> Diagnostic {
    let text = source.text.as_str();
    let line_at = |at: usize| {
        let start = text[..at].rfind('\n').map_or(0, |i| i + 1);
        (start, text[start..].lines().next().unwrap_or_default())
    };
    let (_, line) = line_at(range.start);
    let shown = shorten(line.trim());
    let character = text[range.start..].chars().next().map_or("the end of the file".into(), |c| format!("`{c}`"));
    let is = |part: &str| words.contains(part);
    // The parser may be ahead of, or behind, what it stumbles over.
    let tab = if is("tab") { tab_in_indentation(text, line_at(range.start).0) } else { None };
    let quote = if is("quote") { open_quote(text, range.start) } else { None };
    let (message, hint, range) = if let Some(at) = tab {
        (
            "found a tab in the indentation, expected spaces".into(),
            "indent with spaces: YAML allows no tabs there",
            at..at + 1,
        )
    } else if let Some(at) = quote {
        let hint = "close the quote in the line where it is opened";
        (
            format!("the quote in `{}` does not end, expected another one", shorten(line_at(at).1.trim())),
            hint,
            at..at + 1,
        )
    } else if is("simple key expected") || is("could not find expected ':'") {
        let hint = "a key is written `key: value`, with a colon and a space";
        (format!("`{shown}` is no `key: value` line"), hint, range)
    } else if is("mapping values") {
        let hint =
            "indent a key as far as the other keys of its table, with spaces; put text that has `: ` in it in quotes";
        (
            format!("no key can be where `{shown}` has its colon; expected keys of one table to be indented alike"),
            hint,
            range,
        )
    } else if is("did not find expected ',' or") {
        let close = if is("sequence") { "]" } else { "}" };
        let hint = "close the brackets that are opened in this line or before it, and put commas between entries";
        (format!("found {character}, expected `,` or `{close}`"), hint, range)
    } else if is("did not find expected key") {
        let hint = "indent a key as far as the other keys of its table, with spaces";
        (
            format!("`{shown}` is indented otherwise than the keys before it, expected like the lines beside it"),
            hint,
            range,
        )
    } else {
        let hint =
            "look at this line and the one before it: indentation (spaces, no tabs), brackets, quotes, `key: value`";
        (format!("{words}, found {character}"), hint, range)
    };
    Diagnostic::error("yaml/syntax", format!("not valid YAML: {message}")).at(&Span::new(source, range)).hint(hint)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn source(text: &str) -> Arc<Source> {
        Arc::new(Source { name: "t.yaml".into(), text: text.into() })
    }

    fn tree(text: &str) -> Node {
        load(&source(text)).expect(text)
    }

    fn code(text: &str) -> &'static str {
        load(&source(text)).expect_err(text).0[0].code
    }

    #[test]
    fn every_value_knows_where_it_is_written() {
        let text = "a: 1.5\nb: [1, {x: 'q', y: 90deg}, -2e-3 ]\nc:\n  d: ~\n";
        let root = tree(text);
        let at = |node: &Node| text[node.range.clone()].to_string();
        let b = root.get("b").expect("b");
        assert_eq!(at(b), "[1, {x: 'q', y: 90deg}, -2e-3 ]");
        assert_eq!(at(&b.items()[1]), "{x: 'q', y: 90deg}");
        assert_eq!(at(b.items()[1].get("x").expect("x")), "'q'");
        assert_eq!(b.items()[1].get("y").and_then(Node::angle), Some(90f64.to_radians()));
        assert_eq!(b.items()[2].number(), Some(-2e-3));
        let c = &root.entries()[2];
        assert_eq!((c.key.as_str(), &text[c.key_range.clone()]), ("c", "c"));
        assert_eq!(c.value.entries()[0].value.value, Value::Null);
    }

    #[test]
    fn places_count_bytes_in_texts_with_a_byte_order_mark_wide_letters_and_carriage_returns() {
        let text = "\u{feff}é: 1\r\nß: [ü, 2]\r\n";
        let root = tree(text);
        let second = &root.entries()[1];
        assert_eq!(&text[second.key_range.clone()], "ß");
        assert_eq!(&text[second.value.items()[1].range.clone()], "2");
    }

    #[test]
    fn an_alias_points_at_what_it_stands_for() {
        let text = "a: &here {x: 1}\nb: *here\nc: {<<: *here, y: 2}\n";
        let root = tree(text);
        assert_eq!(root.get("b"), root.get("a"));
        let c = root.get("c").expect("c");
        assert_eq!((c.get("x").and_then(Node::number), c.get("y").and_then(Node::number)), (Some(1.0), Some(2.0)));
    }

    #[test]
    fn yes_and_no_are_text_and_numbers_are_what_yaml_says() {
        let root = tree("[yes, true, 007, 0x10, '5', .inf, 1e400, 1., .5, 90deg]");
        let values: Vec<&Value> = root.items().iter().map(|n| &n.value).collect();
        let number = Value::Number;
        let text = |t: &str| Value::Text(t.into());
        let (inf, flag) = (f64::INFINITY, Value::Flag(true));
        let want = [
            text("yes"),
            flag,
            number(7.0),
            number(16.0),
            text("5"),
            number(inf),
            number(inf),
            number(1.0),
            number(0.5),
            text("90deg"),
        ];
        assert_eq!(values, want.iter().collect::<Vec<_>>());
    }

    #[test]
    fn degrees_are_a_plain_number_and_deg() {
        assert_eq!(degrees("-1.5e1deg"), Some(-15.0));
        for wrong in ["deg", "infdeg", "nandeg", "90 deg", "90", "90degs", "ninetydeg"] {
            assert_eq!(degrees(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn deep_nesting_and_alias_bombs_end_in_a_fault() {
        let nested = |n: usize| format!("{}{}", "[".repeat(n), "]".repeat(n));
        assert!(load(&source(&nested(MAX_DEPTH - 1))).is_ok());
        assert_eq!(code(&nested(MAX_DEPTH + 1)), "yaml/too-deep");
        // So deep that the parser itself gives up first.
        assert!(load(&source(&nested(100_000))).is_err());
        let block: String = (0..100).map(|i| format!("{}a:\n", " ".repeat(i))).collect();
        assert_eq!(code(&block), "yaml/too-deep");
        let mut bomb = "a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1]\n".to_string();
        for i in 1..20 {
            bomb += &format!("a{i}: &a{i} [{}]\n", vec![format!("*a{}", i - 1); 9].join(", "));
        }
        assert_eq!(code(&bomb), "yaml/too-large");
    }

    #[test]
    fn a_long_path_of_ten_thousand_segments_is_read() {
        let segment = "[[0.1, 0.2], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]]";
        let root = tree(&format!("[{}]", vec![segment; 10_000].join(",\n")));
        assert_eq!(root.items().len(), 10_000);
    }

    fn within(node: &Node, text: &str) {
        assert!(text.get(node.range.clone()).is_some(), "{:?} in {text:?}", node.range);
        node.items().iter().for_each(|n| within(n, text));
        for e in node.entries() {
            assert!(text.get(e.key_range.clone()).is_some(), "{:?} in {text:?}", e.key_range);
            within(&e.value, text);
        }
    }

    proptest! {
        #[test]
        fn no_text_panics_and_all_places_lie_within_it(text in r"([a-cé&*!|>'\x22\[\]{}:,#?~<% \t\r\n\x{feff}0-9.-]|: |\n  |\n- ){0,60}") {
            match load(&source(&text)) {
                Ok(root) => within(&root, &text),
                Err(faults) => prop_assert!(!crate::diag::render(&faults, false).is_empty()),
            }
        }

        #[test]
        fn numbers_are_read_to_the_last_digit(number in proptest::num::f64::NORMAL) {
            prop_assert_eq!(tree(&format!("[{number:?}]")).items()[0].number(), Some(number));
        }
    }
}
