//! `trajc robot init FILE.urdf`: a first robot.yaml.

use std::path::{Path, PathBuf};

use clap::Subcommand;

use super::inputs::{Disk, folder_of};
use super::output::write_file;
use super::products::from_folder;
use super::terminal::Terminal;
use crate::diag::{Diagnostic, Diagnostics};
use crate::robot::{self, InitInputs};

/// Begin a robot.yaml from a URDF.
#[derive(Debug, clap::Args)]
pub struct RobotArgs {
    #[command(subcommand)]
    command: RobotCommand,
}

#[derive(Debug, Subcommand)]
enum RobotCommand {
    Init(InitArgs),
}

/// Write a commented robot.yaml with all that can be inferred from a URDF, and marks for what must be measured.
///
/// It finds the driving wheels with radius and track, joints with their limits, and pairs of links that touch by design; and it tells of
/// castors, wheels on springs, telescopes and other things that are easily missed.
#[derive(Debug, clap::Args)]
pub struct InitArgs {
    /// The URDF (expand xacro files first).
    urdf: PathBuf,
    /// File to write [default: print it].
    #[arg(long, value_name = "ROBOT.yaml")]
    out: Option<PathBuf>,
    /// Replace FILE if it exists.
    #[arg(long, requires = "out")]
    force: bool,
    /// Joints of the left driving wheels [default: found].
    #[arg(long, value_name = "JOINT,…", value_delimiter = ',', requires = "right")]
    left: Vec<String>,
    /// Joints of the right driving wheels.
    #[arg(long, value_name = "JOINT,…", value_delimiter = ',', requires = "left")]
    right: Vec<String>,
}

/// Runs `trajc robot …`.
///
/// # Errors
/// A URDF that cannot be read; wheels that are not found; a file that exists or cannot be written.
pub fn robot(args: &RobotArgs, terminal: &mut Terminal) -> Result<u8, Diagnostics> {
    let RobotCommand::Init(args) = &args.command;
    let mut disk = Disk::default();
    let urdf = disk.text(&args.urdf, None)?;
    let named = match &args.out {
        Some(out) => from_folder(&absolute(&folder_of(out))?, &absolute(&args.urdf)?),
        None => args.urdf.file_name().unwrap_or(args.urdf.as_os_str()).to_string_lossy().into_owned(),
    };
    let text = robot::init(InitInputs {
        urdf: (&urdf.name, &urdf.text),
        named: &named,
        left: &args.left,
        right: &args.right,
        files: &mut disk,
    })?;
    let Some(out) = &args.out else {
        terminal.print(&text);
        return Ok(0);
    };
    if out.exists() && !args.force {
        let message = format!("`{}` exists already", out.display());
        return Err(Diagnostic::error("output/exists", message)
            .hint("name another file, or add --force to replace it")
            .into());
    }
    write_file(out, text.as_bytes())?;
    terminal.print(&format!("{}: written. Fill in what it marks, then: trajc inspect {0}\n", out.display()));
    Ok(0)
}

fn absolute(path: &Path) -> Result<PathBuf, Diagnostics> {
    std::path::absolute(path).map_err(|error| {
        Diagnostic::error("output/io", format!("cannot tell where `{}` is: {error}", path.display())).into()
    })
}
