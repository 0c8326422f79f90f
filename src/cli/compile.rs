//! `trajc compile MISSION.yaml`.

use std::path::{Path, PathBuf};

use super::inputs;
use super::output;
use super::products::{ProductArgs, Products, publish};
use super::terminal::Terminal;
use crate::diag::{Diagnostic, Diagnostics, Severity};
use crate::pipeline::{self, CompileOptions};
use crate::report::summary;

/// Compile one mission into certified command files.
///
/// Writes commands.csv, commands.mcap, path_error.csv, report.json, report.html, commands.d and timings.json into DIR/<mission's
/// name>/ (--format chooses the command files), all or none, and prints a summary.
///
/// Exit 0: certified. 1: no trajectory or no certificate; report.json and report.html say why. 2: bad input or usage. After 1 and 2 no command file
/// of this mission is left, not even an older one.
#[derive(Debug, clap::Args)]
pub struct CompileArgs {
    /// The mission file. Its stem is the mission's name.
    #[arg(value_name = "MISSION.yaml")]
    mission: PathBuf,
    #[command(flatten)]
    products: ProductArgs,
    /// Print report.json on stdout instead of the summary.
    #[arg(long)]
    json: bool,
}

/// Compiles and writes.
///
/// # Errors
/// Bad input; older command files of the mission are removed.
pub fn compile(args: &CompileArgs, terminal: &mut Terminal) -> Result<u8, Diagnostics> {
    let name = mission_name(&args.mission)?;
    match run(args, &name, terminal) {
        Ok(code) => Ok(code),
        Err(mut diagnostics) => {
            if let Err(error) = output::discard(&args.products.out, &name) {
                // The reason why nothing could be written may be told already.
                let more = Diagnostics::from(error).0.into_iter().filter(|d| !diagnostics.0.contains(d));
                diagnostics.0.extend(more.collect::<Vec<_>>());
            }
            Err(diagnostics)
        }
    }
}

/// The mission's name: its file's stem.
pub(super) fn mission_name(path: &Path) -> Result<String, Diagnostics> {
    match path.file_stem().and_then(|s| s.to_str()) {
        Some(stem) if !stem.is_empty() => Ok(stem.to_owned()),
        _ => {
            let message = format!("`{}` has no file name to name the mission by", path.display());
            Err(Diagnostic::error("cli/mission-name", message).hint("name a file such as missions/dock.yaml").into())
        }
    }
}

fn run(args: &CompileArgs, name: &str, terminal: &mut Terminal) -> Result<u8, Diagnostics> {
    let started = std::time::Instant::now();
    let (mut inputs, disk) = inputs::read(&args.mission)?;
    let read = started.elapsed().as_secs_f64() * 1e3;
    let progress = terminal.progress(name);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let options = CompileOptions { threads, ..args.products.options() };
    let outcome = pipeline::compile(&mut inputs, &options, &mut |stage| progress.stage(stage));
    drop(progress);
    if let Some(diagnostics) = outcome.diagnostics.as_ref().filter(|d| d.severity() == Severity::BadInput) {
        return Err(diagnostics.clone());
    }
    let of =
        Products { args: &args.products, path: &args.mission, name, inputs: &inputs, disk: &disk, outcome: &outcome };
    let files = of.files(&[("read_files", read)])?;
    let written = publish(&args.products.out, name, &files, outcome.compiled.is_some())?;
    let text = if args.json {
        outcome.report.to_json()
    } else {
        let folder = args.products.out.join(name).display().to_string();
        summary::render(&summary::SummaryInputs {
            mission: name,
            report: &outcome.report,
            folder: &folder,
            files: &written,
            colour: terminal.colour_results,
        })
    };
    terminal.print(&text);
    if let Some(diagnostics) = &outcome.diagnostics {
        terminal.complain(diagnostics);
        return Ok(1);
    }
    Ok(0)
}
