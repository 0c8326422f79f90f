//! The command line: one file per subcommand. Exit codes: 0 done and certified, 1 no trajectory or no certificate, 2 bad
//! input or usage.

pub mod build;
pub mod calibrate;
pub mod check;
pub mod compile;
pub mod completions;
pub mod eval;
pub mod inspect;
pub mod output;
pub mod path_error;
pub mod play;
mod plot;
mod products;
pub mod robot;
pub mod schema;
pub mod terminal;

use std::path::PathBuf;

use clap::{CommandFactory, Parser, Subcommand};

use crate::diag::{Diagnostics, Severity};
use crate::inputs;
use crate::memory;
use terminal::Terminal;

/// Offline trajectory compiler for differential-drive robots that change shape.
///
/// Reads a mission (a robot's URDF, a map, a start and a goal) and writes a file of wheel and joint commands with a certificate:
/// the commands as written are proven to keep clearance and all limits, and to end at the goal.
///
/// Results go to stdout, diagnostics to stderr. Exit codes: 0 done and certified, 1 no trajectory or no certificate, 2 bad input or
/// usage.
#[derive(Debug, Parser)]
#[command(name = "trajc", version, propagate_version = true, max_term_width = 100)]
struct Args {
    /// Show no progress; results and diagnostics are printed all the same.
    #[arg(long, short, global = true)]
    quiet: bool,
    /// Most memory that one input may take: a file, a map's grid, its distance field [default: half of the machine's].
    #[arg(long, global = true, value_name = "SIZE", value_parser = size)]
    max_memory: Option<u64>,
    /// Let robots name meshes under this folder too; else only those under their own. May be repeated.
    #[arg(long, global = true, value_name = "DIR")]
    allow_path: Vec<PathBuf>,
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Compile(compile::CompileArgs),
    Build(build::BuildArgs),
    Check(check::CheckArgs),
    PathError(path_error::PathErrorArgs),
    Play(play::PlayArgs),
    Calibrate(calibrate::CalibrateArgs),
    Inspect(inspect::InspectArgs),
    Robot(robot::RobotArgs),
    Eval(eval::EvalArgs),
    Schema(schema::SchemaArgs),
    /// Print a shell's completion script, such as for `source <(trajc completions bash)`.
    Completions {
        /// Which shell.
        shell: clap_complete::Shell,
    },
}

/// Runs the program with the process's arguments; its exit code.
pub fn main() -> u8 {
    let args = match Args::try_parse() {
        Ok(args) => args,
        Err(error) => {
            let _ = error.print();
            return u8::try_from(error.exit_code()).unwrap_or(2);
        }
    };
    match (args.max_memory, inputs::machine::memory()) {
        (Some(bytes), _) => memory::set(bytes, memory::Source::Asked),
        (None, Some(bytes)) => memory::set(bytes / 2, memory::Source::Machine),
        (None, None) => {}
    }
    inputs::allow(&args.allow_path);
    let mut terminal = Terminal::new();
    terminal.quiet = args.quiet;
    let result = match &args.command {
        Command::Compile(args) => compile::compile(args, &mut terminal),
        Command::Build(args) => build::build(args, &mut terminal),
        Command::Check(args) => check::check(args, &mut terminal),
        Command::PathError(args) => path_error::path_error(args, &mut terminal),
        Command::Play(args) => play::play(args, &mut terminal),
        Command::Calibrate(args) => calibrate::calibrate(args, &mut terminal),
        Command::Inspect(args) => inspect::inspect(args, &mut terminal),
        Command::Robot(args) => robot::robot(args, &mut terminal),
        Command::Eval(args) => eval::eval(args, &mut terminal),
        Command::Schema(args) => schema::schema(args, &mut terminal),
        Command::Completions { shell } => {
            terminal.print(&completions::text(*shell, &mut Args::command()));
            Ok(0)
        }
    };
    let mut code = *result.as_ref().unwrap_or(&0);
    for diagnostics in result.err().into_iter().chain(terminal.lost()) {
        terminal.complain(&diagnostics);
        code = code.max(exit_code(&diagnostics));
    }
    code
}

/// A whole number on the command line.
fn whole(text: &str, least: u64, most: u64) -> Result<u64, String> {
    let number = text.parse().ok().filter(|n| (least..=most).contains(n));
    number.ok_or_else(|| format!("expected a whole number from {least} to {most}, such as {}", least.max(2)))
}

fn size(text: &str) -> Result<u64, &'static str> {
    memory::parse(text).ok_or("expected a size of at least 1 MiB, such as 512MiB or 8GB")
}

fn exit_code(diagnostics: &Diagnostics) -> u8 {
    match diagnostics.severity() {
        Severity::NoTrajectory => 1,
        Severity::BadInput => 2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        Args::command().debug_assert();
    }
}
