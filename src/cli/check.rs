//! `trajc check COMMANDS`.

use std::path::{Path, PathBuf};

use super::inputs::{self, Disk, folder_of, tidy};
use super::terminal::Terminal;
use crate::certify::{Certificate, END_ANGLE_TOLERANCE, END_POINT_TOLERANCE, Refusal, RefusalKind};
use crate::command::CommandTable;
use crate::diag::{Diagnostic, Diagnostics};
use crate::emit::csv::{self, CsvHeader};
use crate::emit::mcap_read;
use crate::pipeline::{self, Inputs};

/// Check a command file against its robot, map, limits and goal, without planning anything.
///
/// Proves of the commands as written what `compile` proves: clearance, limits of wheels and joints, and the end point. The file may
/// come from anywhere.
///
/// Exit 0: everything holds. 1: it does not. 2: bad input or usage.
#[derive(Debug, clap::Args)]
pub struct CheckArgs {
    /// Command file to check (.csv or .mcap).
    commands: PathBuf,
    /// Mission that names the robot, the map, the limits and the goal [default: the one that the file names].
    #[arg(long, value_name = "MISSION.yaml")]
    mission: Option<PathBuf>,
    /// Print the verdict as JSON.
    #[arg(long)]
    json: bool,
}

/// A command file that was read.
pub(super) struct CommandFile {
    pub table: CommandTable,
    pub header: CsvHeader,
    /// Where twists contradict the wheels.
    contradictions: Vec<Diagnostic>,
}

/// Reads a command file by its ending.
pub(super) fn read_commands(path: &Path) -> Result<CommandFile, Diagnostics> {
    let file = read_to_judge(path)?;
    if file.contradictions.is_empty() { Ok(file) } else { Err(Diagnostics(file.contradictions)) }
}

/// The same, with rows that contradict themselves: they are part of the verdict.
fn read_to_judge(path: &Path) -> Result<CommandFile, Diagnostics> {
    let disk = Disk::default();
    let name = path.display().to_string();
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("mcap")) {
        let bytes = disk.binary(path, None)?;
        let file = mcap_read::read(&name, &bytes)?;
        return Ok(CommandFile { table: file.table, header: file.header, contradictions: Vec::new() });
    }
    let text = disk.text(path, None)?;
    let (table, header, contradictions) = csv::read_to_judge(&name, &text.text)?;
    Ok(CommandFile { table, header, contradictions })
}

/// The mission of a command file: named on the command line, or by the file.
pub(super) fn mission_of(
    commands: &Path,
    header: &CsvHeader,
    asked: Option<&Path>,
) -> Result<(Inputs, Disk), Diagnostics> {
    match asked {
        Some(path) => inputs::read(path),
        None => {
            let path = tidy(&folder_of(commands).join(&header.mission));
            if !path.is_file() {
                let message =
                    format!("`{}` names the mission `{}`, which is not there", commands.display(), path.display());
                let fault = Diagnostic::error("check/mission-missing", message);
                return Err(fault.hint("say which one with --mission MISSION.yaml").into());
            }
            inputs::read(&path)
        }
    }
}

/// Checks.
///
/// # Errors
/// Bad input.
pub fn check(args: &CheckArgs, terminal: &mut Terminal) -> Result<u8, Diagnostics> {
    let file = read_to_judge(&args.commands)?;
    let (mut inputs, disk) = mission_of(&args.commands, &file.header, args.mission.as_deref())?;
    let mut certificate = pipeline::check(&mut inputs, &file.table)?;
    certificate.refusals.extend(file.contradictions.iter().map(contradiction));
    let changed = disk.hash() != file.header.inputs_blake3;
    let text = if args.json { json(&certificate, changed) } else { readable(args, &certificate, changed) };
    terminal.print(&text);
    Ok(u8::from(!certificate.holds()))
}

/// A row's own contradiction as a reason to refuse.
fn contradiction(fault: &Diagnostic) -> Refusal {
    let line = fault.at.as_ref().map(|at| at.source.text[..at.range.start].matches('\n').count() + 1);
    let message = line.map_or(fault.message.clone(), |line| format!("line {line}: {}", fault.message));
    Refusal { kind: RefusalKind::Table, message, time: None }
}

fn json(certificate: &Certificate, changed: bool) -> String {
    let part: crate::report::schema::CertificatePart = certificate.into();
    let limits: Vec<crate::report::schema::LimitPart> = certificate.limits.iter().map(Into::into).collect();
    let refusals: Vec<&str> = certificate.refusals.iter().map(|r| r.message.as_str()).collect();
    let value = serde_json::json!({
        "holds": certificate.holds(), "certificate": part, "limits": limits, "refusals": refusals,
        "inputs_changed": changed,
    });
    format!("{value:#}\n")
}

fn readable(args: &CheckArgs, certificate: &Certificate, changed: bool) -> String {
    let verdict = if certificate.holds() { "all checks hold" } else { "CHECKS FAIL" };
    let mut out = format!("{}: {verdict}\n", args.commands.display());
    let mm = |v: f64| format!("{:.3} mm", v * 1e3);
    if let (Some(proven), Some(required)) = (certificate.clearance_proven, certificate.clearance_required) {
        out += &format!("  clearance     {} proven, {} required\n", mm(proven), mm(required));
    }
    if let Some(own) = certificate.own_links {
        let verdict = if own.apart { "kept apart" } else { "not kept apart" };
        out += &format!("  own links     {} pairs {verdict}\n", own.pairs);
    }
    out += &format!("  end point     {} off, {} allowed\n", mm(certificate.end_point_error), mm(END_POINT_TOLERANCE));
    if let Some(heading) = certificate.end_heading_error {
        let degrees = |v: f64| format!("{:.4} deg", v.to_degrees());
        out += &format!("  end heading   {} off, {} allowed\n", degrees(heading), degrees(END_ANGLE_TOLERANCE));
    }
    for limit in &certificate.limits {
        let bound = limit.limit.map_or("no limit given".to_owned(), |l| format!("limit {l}"));
        out += &format!("  {:<24} peak {:.6}, {bound}\n", format!("{} {}", limit.actuator, limit.quantity), limit.peak);
    }
    for refusal in &certificate.refusals {
        out += &format!("  refused: {}\n", refusal.message);
    }
    if changed {
        out += "  note: the mission, robot or map are not the ones that the file was made from\n";
    }
    out
}
