//! JSON Schema (draft 2020-12) of a table of keys, for editors.

use serde_json::{Map, Value, json};

use super::shape::{Bounds, Field, LARGE, Shape};

/// What a number in degrees looks like.
const DEGREES: &str = r"^[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?deg$";

/// What a number in percent looks like.
const PERCENT: &str = r"^[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?%$";

/// The schema of a file with these keys. `extra` are further keywords for the root, such as `anyOf`.
pub fn document(title: &str, description: &str, table: &'static [Field], extra: &[(&str, Value)]) -> Value {
    let mut root = Map::new();
    root.insert("$schema".into(), json!("https://json-schema.org/draft/2020-12/schema"));
    root.insert("title".into(), json!(title));
    root.insert("description".into(), json!(description));
    root.extend(object(table));
    root.extend(extra.iter().map(|(key, value)| (key.to_string(), value.clone())));
    Value::Object(root)
}

fn object(table: &'static [Field]) -> Map<String, Value> {
    let mut properties = Map::new();
    for field in table {
        let mut schema = of(&field.shape);
        let mut doc = format!("{}. Example: {}", field.doc, field.example);
        if let Shape::Later(hint) = field.shape {
            doc = format!("Not available yet: {hint}");
        }
        schema.insert("description".into(), json!(doc));
        properties.insert(field.key.into(), Value::Object(schema));
    }
    let required: Vec<&str> = table.iter().filter(|f| f.required).map(|f| f.key).collect();
    let mut schema = Map::new();
    schema.insert("type".into(), json!("object"));
    schema.insert("properties".into(), Value::Object(properties));
    if !required.is_empty() {
        schema.insert("required".into(), json!(required));
    }
    schema.insert("additionalProperties".into(), json!(false));
    schema
}

fn of(shape: &'static Shape) -> Map<String, Value> {
    let schema = match shape {
        Shape::Text => json!({"type": "string", "minLength": 1}),
        Shape::Flag => json!({"type": "boolean"}),
        Shape::Number(bounds) => number(bounds),
        Shape::Angle(bounds) => json!({"anyOf": [number(bounds), {"type": "string", "pattern": DEGREES}]}),
        Shape::Share(bounds) => json!({"anyOf": [number(bounds), {"type": "string", "pattern": PERCENT}]}),
        Shape::AngleOr(bounds, word) => {
            json!({"anyOf": [number(bounds), {"type": "string", "pattern": DEGREES}, {"const": word}]})
        }
        Shape::Choice(choices) => {
            let words: Vec<&str> = choices.iter().filter(|c| c.later.is_none()).map(|c| c.word).collect();
            json!({"enum": words})
        }
        Shape::List { item, count, .. } => {
            let mut schema = json!({"type": "array", "items": of(item)});
            if count.0 > 0 {
                schema["minItems"] = json!(count.0);
            }
            if count.1 < usize::MAX {
                schema["maxItems"] = json!(count.1);
            }
            schema
        }
        Shape::TextOrList => {
            let text = of(&Shape::Text);
            json!({"anyOf": [text, {"type": "array", "items": text, "minItems": 1}]})
        }
        Shape::Table(table) => Value::Object(object(table)),
        Shape::Named(item) => json!({"type": "object", "additionalProperties": of(item)}),
        Shape::Later(_) => json!({"not": {}}),
    };
    match schema {
        Value::Object(map) => map,
        _ => Map::new(),
    }
}

fn number(bounds: &Bounds) -> Value {
    let mut schema = json!({"type": "number"});
    if bounds.least > -LARGE {
        schema[if bounds.open { "exclusiveMinimum" } else { "minimum" }] = json!(bounds.least);
    }
    if bounds.most < LARGE {
        schema["maximum"] = json!(bounds.most);
    }
    schema
}
