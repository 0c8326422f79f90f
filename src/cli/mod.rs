//! One file per subcommand.

pub mod completions;
pub mod inputs;
pub mod output;
pub mod schema;
