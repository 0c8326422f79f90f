//! What a YAML file of ours may hold: one table of keys, from which both the checks here and the JSON Schema
//! ([`super::json_schema`]) follow, so that they cannot disagree.

use std::ops::Range;
use std::sync::Arc;

use super::words::{found, how_many, one_of, range_words, shorten, spelling, words, written};
use super::yaml::{Entry, Node, Value, degrees, percent};
use super::{Diagnostic, Source, Span, nearest};

/// A key of a table.
#[derive(Debug)]
pub struct Field {
    /// The key.
    pub key: &'static str,
    /// What it means, with unit and default; begins in lower case, no full stop.
    pub doc: &'static str,
    /// A good value, as YAML.
    pub example: &'static str,
    /// What the value must be.
    pub shape: Shape,
    /// Whether it must be there.
    pub required: bool,
}

impl Field {
    /// A key that may be left out.
    pub const fn optional(key: &'static str, shape: Shape, example: &'static str, doc: &'static str) -> Self {
        Self { key, doc, example, shape, required: false }
    }

    /// A key that must be there.
    pub const fn required(key: &'static str, shape: Shape, example: &'static str, doc: &'static str) -> Self {
        Self { key, doc, example, shape, required: true }
    }
}

/// What a value must be.
#[derive(Debug)]
pub enum Shape {
    /// Text that is not empty.
    Text,
    /// `true` or `false`.
    Flag,
    /// A finite number within bounds.
    Number(Bounds),
    /// The same, or degrees: `90deg`.
    Angle(Bounds),
    /// A finite number within bounds, or the same in percent: `0.2%`.
    Share(Bounds),
    /// The same, or a word that says that any will do.
    AngleOr(Bounds, &'static str),
    /// One of these words.
    Choice(&'static [Choice]),
    /// A list.
    List {
        /// What each item must be.
        item: &'static Shape,
        /// Fewest and most items.
        count: (usize, usize),
        /// How the list reads, such as `a point [x, y]`.
        form: &'static str,
    },
    /// One text, or a list of at least one.
    TextOrList,
    /// These keys and no others.
    Table(&'static [Field]),
    /// Any names, each with such a value.
    Named(&'static Shape),
    /// A key that a later version will read; what to do until then.
    Later(&'static str),
}

/// A word of a [`Shape::Choice`].
#[derive(Debug)]
pub struct Choice {
    /// The word.
    pub word: &'static str,
    /// `None`: available. Else what to do until a later version has it.
    pub later: Option<&'static str>,
}

impl Choice {
    /// A word that is understood.
    pub const fn now(word: &'static str) -> Self {
        Self { word, later: None }
    }

    /// A word that a later version will understand, and what to do until then.
    pub const fn later(word: &'static str, hint: &'static str) -> Self {
        Self { word, later: Some(hint) }
    }
}

/// Where a number must lie.
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    /// Least value.
    pub least: f64,
    /// Greatest value.
    pub most: f64,
    /// Whether `least` itself is refused.
    pub open: bool,
    /// Unit, for messages.
    pub unit: &'static str,
}

/// Beyond this a length, angle or rate is a mistake, and sums of squares would no longer be safe.
pub const LARGE: f64 = 1e6;

/// No more faults than this are collected from one file: a file of noise must not take minutes to refuse.
const MOST_FAULTS: usize = 200;

impl Bounds {
    /// Any number of a sensible size.
    pub const fn any(unit: &'static str) -> Self {
        Self { least: -LARGE, most: LARGE, open: false, unit }
    }

    /// Above zero.
    pub const fn positive(unit: &'static str) -> Self {
        Self { least: 0.0, most: LARGE, open: true, unit }
    }

    /// `least` to `most`, both allowed.
    pub const fn between(least: f64, most: f64, unit: &'static str) -> Self {
        Self { least, most, open: false, unit }
    }

    fn hold(&self, value: f64) -> bool {
        value <= self.most && if self.open { value > self.least } else { value >= self.least }
    }
}

/// Checks a tree against a table of keys and returns all faults. `what` names the file's kind (`a mission`), `outline` says
/// what it must hold at least.
pub fn check(source: &Arc<Source>, root: &Node, table: &'static [Field], what: &str, outline: &str) -> Vec<Diagnostic> {
    let mut checker = Checker { source, root: table, what, faults: Vec::new() };
    let start = root.range.start..root.range.start;
    match &root.value {
        Value::Map(_) => checker.table(root, table, "", &start),
        Value::Null => {
            let hint = format!("{what} needs at least {outline}");
            checker.fault("yaml/empty", "the file is empty".to_string(), &start, hint);
        }
        _ => {
            let message = format!("{what} must be `key: value` lines, found {}", found(root, source));
            checker.fault(
                "yaml/wrong-type",
                message,
                &root.range,
                "write a space after each colon: `key: value`".into(),
            );
        }
    }
    checker.faults
}

/// Whether a table has a key, or an unknown key that was meant to be it (which is a fault of its own).
pub fn nearly_has(node: &Node, table: &[Field], key: &str) -> bool {
    node.entries().iter().any(|e| {
        let known = table.iter().any(|f| f.key == e.key);
        let before_colon = e.key.split_once(':').map(|(before, _)| before);
        e.key == key || !known && (before_colon == Some(key) || nearest(&e.key, [key]).is_some())
    })
}

struct Checker<'a> {
    source: &'a Arc<Source>,
    root: &'static [Field],
    what: &'a str,
    faults: Vec<Diagnostic>,
}

impl Checker<'_> {
    fn fault(&mut self, code: &'static str, message: String, at: &Range<usize>, hint: String) {
        self.faults.push(Diagnostic::error(code, message).at(&Span::new(self.source, at.clone())).hint(hint));
    }

    fn full(&self) -> bool {
        self.faults.len() >= MOST_FAULTS
    }

    /// `at`: the key that the table is the value of.
    fn table(&mut self, node: &Node, table: &'static [Field], path: &str, at: &Range<usize>) {
        self.repeated(node, path);
        for entry in node.entries() {
            if self.full() {
                return;
            }
            match table.iter().find(|f| f.key == entry.key) {
                Some(field) => self.entry(entry, field, &field.shape, &join(path, &entry.key)),
                None => self.unknown(node, entry, table, path),
            }
        }
        for field in table.iter().filter(|f| f.required) {
            if !nearly_has(node, table, field.key) {
                let owner = if path.is_empty() { self.what.to_string() } else { format!("`{path}`") };
                let message = format!("{owner} needs `{}`, which is missing", field.key);
                let hint = format!("add `{}: {}` ({})", field.key, field.example, field.doc);
                self.fault("yaml/missing-key", message, at, hint);
            }
        }
    }

    fn entry(&mut self, entry: &Entry, field: &'static Field, shape: &'static Shape, path: &str) {
        if let Shape::Later(hint) = shape {
            let message = format!("`{path}` is not available yet");
            return self.fault("yaml/not-available", message, &entry.key_range, (*hint).to_string());
        }
        if entry.value.value == Value::Null {
            let hint = format!("write for example `{}: {}`, or remove the key", field.key, field.example);
            return self.fault("yaml/no-value", format!("`{path}` has no value"), &entry.key_range, hint);
        }
        self.value(&entry.value, field, shape, path, &entry.key_range);
    }

    fn value(&mut self, node: &Node, field: &'static Field, shape: &'static Shape, path: &str, key: &Range<usize>) {
        match shape {
            Shape::Text if node.text().is_some() => {}
            Shape::Flag if node.flag().is_some() => {}
            Shape::Number(bounds) => match node.value {
                Value::Number(number) => self.number(node, number, bounds, field, path),
                _ => self.wrong(node, field, shape, path),
            },
            Shape::AngleOr(_, word) if node.text() == Some(word) => {}
            Shape::Angle(bounds) | Shape::AngleOr(bounds, _) => match &node.value {
                Value::Number(number) => self.number(node, *number, bounds, field, path),
                Value::Text(text) if degrees(text).is_some() => {
                    let angle = degrees(text).map_or(f64::NAN, f64::to_radians);
                    self.number(node, angle, bounds, field, path);
                }
                _ => self.wrong(node, field, shape, path),
            },
            Shape::Share(bounds) => match &node.value {
                Value::Number(number) => self.number(node, *number, bounds, field, path),
                Value::Text(text) if percent(text).is_some() => {
                    self.number(node, percent(text).unwrap_or(f64::NAN), bounds, field, path);
                }
                _ => self.wrong(node, field, shape, path),
            },
            Shape::Choice(choices) => self.choice(node, choices, field, path),
            Shape::List { item, count, form } if matches!(node.value, Value::List(_)) => {
                let n = node.items().len();
                if n < count.0 || n > count.1 {
                    let message = format!("`{path}` must be {form}, found {}", how_many(n));
                    self.fault("yaml/wrong-count", message, &node.range, example(field));
                } else {
                    self.items(node, field, item, path);
                }
            }
            Shape::TextOrList if matches!(&node.value, Value::List(items) if !items.is_empty()) => {
                self.items(node, field, &Shape::Text, path);
            }
            Shape::TextOrList if node.text().is_some() => {}
            Shape::Table(table) if matches!(node.value, Value::Map(_)) => self.table(node, table, path, key),
            Shape::Named(item) if matches!(node.value, Value::Map(_)) => {
                self.repeated(node, path);
                for entry in node.entries() {
                    if self.full() {
                        return;
                    }
                    self.entry(entry, field, item, &join(path, &entry.key));
                }
            }
            _ => self.wrong(node, field, shape, path),
        }
    }

    fn items(&mut self, node: &Node, field: &'static Field, item: &'static Shape, path: &str) {
        for (i, child) in node.items().iter().enumerate() {
            if self.full() {
                return;
            }
            self.value(child, field, item, &format!("{path}[{i}]"), &child.range);
        }
    }

    fn number(&mut self, node: &Node, number: f64, bounds: &Bounds, field: &'static Field, path: &str) {
        let written = written(node, self.source);
        if !number.is_finite() {
            let message = format!("`{path}` must be a finite number, found `{written}`");
            self.fault("yaml/not-finite", message, &node.range, example(field));
        } else if !bounds.hold(number) {
            let message = format!("`{path}` must be {}, found `{written}`", range_words(bounds, number));
            self.fault("yaml/out-of-range", message, &node.range, example(field));
        }
    }

    fn choice(&mut self, node: &Node, choices: &'static [Choice], field: &'static Field, path: &str) {
        let written = written(node, self.source);
        match choices.iter().find(|c| Some(c.word) == node.text()) {
            Some(Choice { later: None, .. }) => {}
            Some(Choice { word, later: Some(hint) }) => {
                let message = format!("`{path}: {word}` is not available yet");
                self.fault("yaml/not-available", message, &node.range, (*hint).to_string());
            }
            None => {
                let words: Vec<&str> = choices.iter().filter(|c| c.later.is_none()).map(|c| c.word).collect();
                let message = format!("`{path}` must be {}, found {}", one_of(&words), found(node, self.source));
                let hint = match nearest(&written, words.iter().copied()) {
                    Some(word) => format!("did you mean `{word}`?"),
                    None => example(field),
                };
                self.fault("yaml/wrong-value", message, &node.range, hint);
            }
        }
    }

    fn wrong(&mut self, node: &Node, field: &'static Field, shape: &'static Shape, path: &str) {
        let message = format!("`{path}` must be {}, found {}", words(shape), found(node, self.source));
        let spelling = match (&node.value, shape) {
            (Value::Number(_) | Value::Flag(_), Shape::Text | Shape::TextOrList) => {
                Some(format!("put it in quotes: `\"{}\"`", written(node, self.source)))
            }
            _ => node.text().and_then(|text| spelling(text, shape)),
        };
        self.fault("yaml/wrong-type", message, &node.range, spelling.unwrap_or_else(|| example(field)));
    }

    fn repeated(&mut self, node: &Node, path: &str) {
        let entries = node.entries();
        let mut order: Vec<usize> = (0..entries.len()).collect();
        order.sort_by_key(|&i| (&entries[i].key, i));
        for pair in order.windows(2) {
            let (first, again) = (&entries[pair[0]], &entries[pair[1]]);
            if first.key == again.key && !self.full() {
                let line = self.source.text[..first.key_range.start].bytes().filter(|b| *b == b'\n').count() + 1;
                let message = format!("`{}` is given twice", join(path, &again.key));
                let hint = format!("it is given before in line {line}: keep one of the two");
                self.fault("yaml/repeated-key", message, &again.key_range, hint);
            }
        }
    }

    fn unknown(&mut self, node: &Node, entry: &Entry, table: &'static [Field], path: &str) {
        let place = if path.is_empty() { String::new() } else { format!(" in `{path}`") };
        let message = format!("unknown key `{}`{place}", shorten(&entry.key));
        self.fault("yaml/unknown-key", message, &entry.key_range, self.meant(node, entry, table));
    }

    /// What an unknown key was meant to be.
    fn meant(&self, node: &Node, entry: &Entry, table: &'static [Field]) -> String {
        let key = entry.key.as_str();
        if let Some((before, after)) = key.split_once(':')
            && table.iter().any(|f| f.key == before)
        {
            return format!("a space is missing after the colon: `{before}: {after}`");
        }
        let before = node.entries().windows(2).find(|pair| std::ptr::eq(&pair[1], entry)).map(|pair| &pair[0]);
        if let Some(before) = before
            && key.bytes().all(|b| b.is_ascii_digit())
            && matches!((&before.value.value, &entry.value.value), (Value::Number(_), Value::Null))
        {
            let whole = written(&before.value, self.source);
            return format!("decimals are written with a point: `{}: {whole}.{key}`", before.key);
        }
        let free = table.iter().map(|f| f.key).filter(|k| node.entries().iter().all(|e| e.key != *k));
        let near = nearest(key, free);
        let mut elsewhere = Vec::new();
        places(self.root, key, "", &mut elsewhere);
        let belongs =
            format!("`{key}` belongs under {}", one_of(&elsewhere.iter().map(String::as_str).collect::<Vec<_>>()));
        match (near, elsewhere.is_empty()) {
            (Some(near), true) => format!("did you mean `{near}`?"),
            (Some(near), false) => format!("did you mean `{near}`? ({belongs})"),
            (None, false) => belongs,
            (None, true) => {
                if let Some(given) = nearest(key, table.iter().map(|f| f.key)) {
                    return format!("did you mean `{given}`, which is given already?");
                }
                let keys: Vec<String> = table.iter().map(|f| format!("`{}`", f.key)).collect();
                format!("known keys are {}", keys.join(", "))
            }
        }
    }
}

/// The tables that know a key, as paths; not the root.
fn places(table: &'static [Field], key: &str, path: &str, out: &mut Vec<String>) {
    for field in table {
        let path = join(path, field.key);
        let (inner, path) = match &field.shape {
            Shape::Table(inner) => (*inner, path),
            Shape::Named(Shape::Table(inner)) => (*inner, join(&path, "NAME")),
            _ => continue,
        };
        if inner.iter().any(|f| f.key == key) {
            out.push(path.clone());
        }
        places(inner, key, &path, out);
    }
}

fn join(path: &str, key: &str) -> String {
    let key = shorten(key);
    if path.is_empty() { key } else { format!("{path}.{key}") }
}

fn example(field: &Field) -> String {
    format!("for example `{}: {}` ({})", field.key, field.example, field.doc)
}
