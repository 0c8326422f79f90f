//! The words of messages about values: what was asked for, what was found, how it must be spelled.

use super::Source;
use super::shape::{Bounds, LARGE, Shape};
use super::yaml::{Node, Value, plain_number};

/// What a shape asks for, in words.
pub(super) fn words(shape: &Shape) -> String {
    let unit = |b: &Bounds| if b.unit.is_empty() { String::new() } else { format!(" ({})", b.unit) };
    match shape {
        Shape::Text => "text".into(),
        Shape::Flag => "`true` or `false`".into(),
        Shape::Number(bounds) => format!("a number{}", unit(bounds)),
        Shape::Angle(bounds) => format!("a number{} or degrees such as `90deg`", unit(bounds)),
        Shape::Share(_) => "a share: a number, or percent such as `0.2%`".into(),
        Shape::AngleOr(bounds, word) => format!("a number{}, degrees such as `90deg`, or `{word}`", unit(bounds)),
        Shape::Choice(choices) => {
            one_of(&choices.iter().filter(|c| c.later.is_none()).map(|c| c.word).collect::<Vec<_>>())
        }
        Shape::List { form, .. } => (*form).into(),
        Shape::TextOrList => "text or a list of texts".into(),
        Shape::Table(table) => {
            format!("`key: value` pairs ({})", table.iter().map(|f| f.key).collect::<Vec<_>>().join(", "))
        }
        Shape::Named(_) => "`name: value` pairs".into(),
        Shape::Later(_) => "left out".into(),
    }
}

pub(super) fn range_words(bounds: &Bounds, value: f64) -> String {
    let unit = match bounds.unit {
        "" => String::new(),
        either if either.contains(' ') => format!(" ({either})"),
        unit => format!(" {unit}"),
    };
    let Bounds { least, most, .. } = bounds;
    match (bounds.open, *most >= LARGE && value <= *most) {
        (true, true) => format!("greater than {least}{unit}"),
        (true, false) => format!("greater than {least} and at most {most}{unit}"),
        (false, true) if *least > -LARGE => format!("at least {least}{unit}"),
        _ => format!("between {least} and {most}{unit}"),
    }
}

/// What was found, in words.
pub(super) fn found(node: &Node, source: &Source) -> String {
    match &node.value {
        Value::Null => "nothing".into(),
        Value::Flag(flag) => format!("`{flag}`"),
        Value::Number(_) => format!("the number `{}`", written(node, source)),
        Value::Text(text) if text.is_empty() => "empty text".into(),
        Value::Text(text) => format!("the text `{}`", shorten(text)),
        Value::List(items) => format!("a list of {}", how_many(items.len())),
        Value::Map(_) => "`key: value` pairs".into(),
    }
}

/// A value as its author wrote it.
pub(super) fn written(node: &Node, source: &Source) -> String {
    match &node.value {
        Value::Text(text) => shorten(text),
        _ => shorten(source.text.get(node.range.clone()).unwrap_or_default().trim()),
    }
}

/// At most 40 characters of a user's text, on one line.
pub(super) fn shorten(text: &str) -> String {
    let line = text.lines().next().unwrap_or_default();
    if line.chars().count() > 40 || line.len() < text.trim_end().len() {
        format!("{}…", line.chars().take(39).collect::<String>())
    } else {
        line.to_string()
    }
}

pub(super) fn one_of(words: &[&str]) -> String {
    match words {
        [] => "nothing".into(),
        [word] => format!("`{word}`"),
        [first @ .., last] => {
            format!("{} or `{last}`", first.iter().map(|w| format!("`{w}`")).collect::<Vec<_>>().join(", "))
        }
    }
}

pub(super) fn how_many(n: usize) -> String {
    match n {
        0 => "no value".into(),
        1 => "1 value".into(),
        n => format!("{n} values"),
    }
}

/// How text that was meant as a number or flag must be spelled.
pub(super) fn spelling(text: &str, shape: &Shape) -> Option<String> {
    let text = text.trim();
    let angle = match shape {
        Shape::Angle(_) | Shape::AngleOr(..) => true,
        Shape::Number(_) | Shape::Share(_) => false,
        Shape::Flag => {
            let meant = match text.to_ascii_lowercase().as_str() {
                "yes" | "on" | "y" | "true" | "1" => "true",
                "no" | "off" | "n" | "false" | "0" => "false",
                _ => return None,
            };
            return Some(format!("write `{meant}`"));
        }
        _ => return None,
    };
    if plain_number(text).is_some() {
        return Some(format!("remove the quotes: `{text}`"));
    }
    if let Some(number) = plain_number(&text.replacen(',', ".", 1)) {
        return Some(format!("decimals are written with a point: `{number}`"));
    }
    if angle && text.contains("pi") {
        return Some("nothing is computed here: write the number, or degrees such as `90deg`".into());
    }
    let digits = text.trim_end_matches(|c: char| !c.is_ascii_digit() && c != '.');
    let unit = text[digits.len()..].trim();
    let number = plain_number(digits)?;
    let metres = matches!(shape, Shape::Number(Bounds { unit: "m", .. }));
    Some(match unit {
        "deg" | "°" | "degrees" | "degree" | "Deg" | "DEG" if angle => format!("write `{digits}deg`, without a space"),
        "%" if matches!(shape, Shape::Share(_)) => format!("write `{digits}%`, without a space"),
        "deg" | "°" | "degrees" | "degree" => {
            format!("no degrees here; in radians it is `{:.6}`", number.to_radians())
        }
        "mm" if metres => format!("write metres: `{}`", number / 1e3),
        "cm" if metres => format!("write metres: `{}`", number / 1e2),
        "m" if metres => format!("metres are written without a unit: `{digits}`"),
        "%" => "no percent here: write the number alone, in the unit that the key says".into(),
        "rad" if angle => format!("radians are written without a unit: `{digits}`"),
        _ => "write the number alone, in the unit that the key says".into(),
    })
}
