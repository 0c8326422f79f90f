//! There are many mistakes, no two of them have one message, and hardly any two one wording.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;

use super::case::Message;
use super::sandbox::repository;

/// What is said, without paths and numbers.
fn said(Message { title, help, .. }: &Message) -> String {
    let told = format!("{title} {help}").replace(|c: char| c.is_ascii_digit(), "");
    told.split_whitespace().filter(|word| !word.contains('/')).collect::<Vec<_>>().join(" ")
}

/// The same without what is quoted.
fn wording(said: &str) -> String {
    said.split('`').step_by(2).collect()
}

#[test]
fn at_least_120_messages_differ_by_more_than_names_and_numbers() {
    let golden = repository().join("tests/messages/golden");
    let mut known: BTreeMap<String, String> = BTreeMap::new();
    let mut doubled = Vec::new();
    for area in fs::read_dir(golden).expect("golden files") {
        for file in fs::read_dir(area.expect("an area").path()).expect("an area") {
            let path = file.expect("a file").path();
            let text = fs::read_to_string(&path).expect("text");
            let (_, stderr) = text.split_once("\nexit ").and_then(|(_, rest)| rest.split_once('\n')).expect("a code");
            let name = path.display().to_string();
            if let Some(other) = known.insert(said(&Message::of(stderr)), name.clone()) {
                doubled.push(format!("{name} and {other}: {}", said(&Message::of(stderr))));
            }
        }
    }
    assert!(doubled.is_empty(), "these say the same:\n{}", doubled.join("\n"));
    let wordings: BTreeSet<String> = known.keys().map(|said| wording(said)).collect();
    assert!(wordings.len() >= 120, "{} messages in {} wordings", known.len(), wordings.len());
}
