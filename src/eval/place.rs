//! Where in a JSON text the values of its tree are written.

use std::ops::Range;

/// Places of a key (of what is no list's item) and of its value.
pub(super) struct Place {
    /// With its quotation marks.
    pub key: Option<Range<usize>>,
    /// From its first to its last character.
    pub value: Range<usize>,
}

/// The places of all values whose path is this one, such as `scenes[3].start.yaw`, in order: more than one where keys repeat.
/// `join` makes the path of a key in a table. The text must be JSON.
pub(super) fn places(text: &str, path: &str, join: impl Fn(&str, &str) -> String) -> Vec<Place> {
    let mut scan = Scan { text, at: 0, wanted: path, join: &join, found: Vec::new() };
    scan.value("", None);
    scan.found
}

struct Scan<'a> {
    text: &'a str,
    at: usize,
    wanted: &'a str,
    join: &'a dyn Fn(&str, &str) -> String,
    found: Vec<Place>,
}

impl Scan<'_> {
    /// The next character that is no blank.
    fn peek(&mut self) -> Option<u8> {
        let rest = &self.text[self.at..];
        self.at += rest.len() - rest.trim_start_matches(['\u{feff}', ' ', '\t', '\r', '\n']).len();
        self.text.as_bytes().get(self.at).copied()
    }

    /// Goes past a text in quotation marks; what is between them, as written.
    fn string(&mut self) -> Range<usize> {
        let start = self.at;
        let bytes = self.text.as_bytes();
        self.at += 1;
        while let Some(byte) = bytes.get(self.at) {
            match byte {
                b'\\' => self.at += 2,
                b'"' => break,
                _ => self.at += 1,
            }
        }
        self.at = (self.at + 1).min(bytes.len());
        start..self.at
    }

    fn value(&mut self, path: &str, key: Option<Range<usize>>) {
        let first = self.peek();
        let start = self.at;
        // What does not lead to the path wanted needs no path of its own.
        let leads = self.wanted.starts_with(path);
        match first {
            Some(b'{') => self.items(b'}', |scan, _| {
                let key = scan.string();
                let name: String = serde_json::from_str(&scan.text[key.clone()]).unwrap_or_default();
                scan.peek();
                scan.at += 1; // the colon
                let path = if leads { (scan.join)(path, &name) } else { "\0".into() };
                scan.value(&path, Some(key));
            }),
            Some(b'[') => self.items(b']', |scan, i| {
                let path = if leads { format!("{path}[{i}]") } else { "\0".into() };
                scan.value(&path, None);
            }),
            Some(b'"') => {
                self.string();
            }
            _ => {
                let rest = &self.text[start..];
                self.at += rest.find([',', ']', '}', ' ', '\t', '\r', '\n']).unwrap_or(rest.len());
            }
        }
        if path == self.wanted {
            self.found.push(Place { key, value: start..self.at });
        }
    }

    /// Goes through what stands between commas, up to and with the bracket that closes it.
    fn items(&mut self, close: u8, mut item: impl FnMut(&mut Self, usize)) {
        self.at += 1;
        for i in 0.. {
            match self.peek() {
                None => return,
                Some(byte) if byte == close => {
                    self.at += 1;
                    return;
                }
                Some(b',') => self.at += 1,
                Some(_) => {}
            }
            if self.peek().is_some_and(|byte| byte != close) {
                let before = self.at;
                item(self, i);
                if self.at == before {
                    return; // no JSON
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_and_keys_are_found_by_their_paths() {
        let text = "\u{feff}{ \"a\" : [1, {\"b]\\\"\": \"x, }\", \"c\": [ ] , \"é\":-2e3}],\n\"a2\": null, \"d\": {}, \"d\": true}";
        let join = |path: &str, key: &str| if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
        let of = |path: &str| {
            let found = places(text, path, join);
            found.iter().map(|p| (p.key.clone().map_or("", |k| &text[k]), &text[p.value.clone()])).collect::<Vec<_>>()
        };
        assert_eq!(of("a[0]"), [("", "1")]);
        assert_eq!(of("a[1].b]\""), [("\"b]\\\"\"", "\"x, }\"")]);
        assert_eq!(of("a[1].c"), [("\"c\"", "[ ]")]);
        assert_eq!(of("a[1].é"), [("\"é\"", "-2e3")]);
        assert_eq!(of("a2"), [("\"a2\"", "null")]);
        assert_eq!(of("d"), [("\"d\"", "{}"), ("\"d\"", "true")]);
        assert!(of("e").is_empty() && of("a[2]").is_empty());
        assert_eq!(of("")[0].1, text.trim_start_matches('\u{feff}'));
    }
}
