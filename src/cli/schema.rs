//! `trajc schema mission|robot|report|build`: JSON Schemas, for editors and validators.

use serde_json::Value;

use super::build;
use super::terminal::Terminal;
use crate::diag::Diagnostics;
use crate::{mission, report, robot};

/// Print the JSON Schema of a file format (draft 2020-12), for editors and validators.
#[derive(Debug, clap::Args)]
pub struct SchemaArgs {
    /// Which file.
    file: SchemaOf,
}

/// Which file's schema.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum SchemaOf {
    /// A mission file.
    Mission,
    /// A robot.yaml.
    Robot,
    /// report.json.
    Report,
    /// What `build --json` prints.
    Build,
}

/// Prints the schema.
///
/// # Errors
/// Never.
pub fn schema(args: &SchemaArgs, terminal: &mut Terminal) -> Result<u8, Diagnostics> {
    terminal.print(&text(args.file));
    Ok(0)
}

/// The schema, indented, with a line break at its end.
pub fn text(of: SchemaOf) -> String {
    match of {
        SchemaOf::Mission => pretty(&mission::json_schema()),
        SchemaOf::Robot => pretty(&robot::spec::json_schema()),
        SchemaOf::Report => report::json_schema(),
        SchemaOf::Build => build::json_schema(),
    }
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
        for of in [SchemaOf::Mission, SchemaOf::Robot, SchemaOf::Report, SchemaOf::Build] {
            let schema: Value = serde_json::from_str(&text(of)).expect("JSON");
            assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
        }
    }
}
