//! One file per subcommand.

pub mod output;
