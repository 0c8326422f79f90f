//! `trajc schema mission|robot`: JSON Schemas of the files that people write, for editors.

use serde_json::Value;

use crate::{mission, robot};

/// Which file's schema. (The report's is the report stage's own.)
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum SchemaOf {
    /// A mission file.
    Mission,
    /// A robot.yaml.
    Robot,
}

/// The schema, indented, with a line break at its end.
pub fn text(of: SchemaOf) -> String {
    let schema = match of {
        SchemaOf::Mission => mission::json_schema(),
        SchemaOf::Robot => robot::spec::json_schema(),
    };
    pretty(&schema)
}

/// A JSON value, indented, with a line break at its end.
pub fn pretty(value: &Value) -> String {
    format!("{value:#}\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_schema_is_json_that_names_its_draft() {
        for of in [SchemaOf::Mission, SchemaOf::Robot] {
            let schema: Value = serde_json::from_str(&text(of)).expect("JSON");
            assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
        }
    }
}
