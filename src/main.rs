//! The `trajc` program; everything is in the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(trajc::cli::main())
}
