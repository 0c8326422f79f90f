//! `trajc check COMMANDS`.

use std::path::PathBuf;

use super::inputs::commands::{self, LoadedCommands, Origin, Places};
use super::terminal::Terminal;
use crate::certify::Certificate;
use crate::diag::Diagnostics;
use crate::report::schema::{CertificatePart, LimitPart, RobotPart, TrustPart};
use crate::report::summary;

/// Check a command file against its robot, map, limits and goal, without planning anything.
///
/// Proves of the commands as written what `compile` proves: clearance, limits of wheels and joints, and the end point. The file may
/// come from anywhere. A .mcap brings its mission, robot and URDF with it; its map is looked for where the mission says and beside
/// the file, and must be the one that the file was made on. A .csv names its mission.
///
/// Exit 0: everything holds. 1: it does not. 2: bad input or usage.
#[derive(Debug, clap::Args)]
pub struct CheckArgs {
    /// Command file to check (.csv or .mcap).
    commands: PathBuf,
    /// Mission that names the robot, the map, the limits and the goal [default: the one attached to a .mcap, or named by a .csv].
    #[arg(long, value_name = "MISSION.yaml")]
    mission: Option<PathBuf>,
    /// The map's file, where it is not where the mission says.
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
    /// Print the verdict as JSON.
    #[arg(long)]
    json: bool,
}

/// Checks.
///
/// # Errors
/// Bad input.
pub fn check(args: &CheckArgs, terminal: &mut Terminal) -> Result<u8, Diagnostics> {
    let places = Places { mission: args.mission.as_deref(), map: args.map.as_deref() };
    let loaded = commands::load(&args.commands, places)?;
    let certificate = loaded.certify()?;
    // Of what does not hold there is nothing to trust.
    let trust = if certificate.holds() { loaded.trust()? } else { None };
    let trust = trust.as_ref();
    let text = if args.json { json(&loaded, &certificate, trust) } else { readable(&loaded, &certificate, trust) };
    terminal.print(&text);
    Ok(u8::from(!certificate.holds()))
}

fn json(loaded: &LoadedCommands, certificate: &Certificate, trust: Option<&TrustPart>) -> String {
    let part: CertificatePart = certificate.into();
    let limits: Vec<LimitPart> = certificate.limits.iter().map(Into::into).collect();
    let refusals: Vec<&str> = certificate.refusals.iter().map(|r| r.message.as_str()).collect();
    let value = serde_json::json!({
        "holds": certificate.holds(), "certificate": part, "limits": limits, "refusals": refusals,
        "trust": trust, "inputs_changed": !loaded.as_made,
    });
    format!("{value:#}\n")
}

fn readable(loaded: &LoadedCommands, certificate: &Certificate, trust: Option<&TrustPart>) -> String {
    let verdict = if certificate.holds() { "all checks hold" } else { "CHECKS FAIL" };
    let mut out = format!("{}: {verdict}\n\n", loaded.file.path.display());
    summary::line(&mut out, "against", &against(loaded));
    let robot = RobotPart::from(&loaded.world.robot);
    let limits: Vec<LimitPart> = certificate.limits.iter().map(Into::into).collect();
    summary::proof(&mut out, &certificate.into(), &limits, Some(&robot));
    if let Some(trust) = trust {
        summary::line(&mut out, "trust", &summary::trust_text(trust));
    }
    for refusal in &certificate.refusals {
        summary::line(&mut out, "refused", &refusal.message);
    }
    if !loaded.as_made {
        let note = "the mission, robot or map are not the ones that the file was made from";
        summary::line(&mut out, "note", note);
    }
    out
}

/// What it was checked against.
fn against(loaded: &LoadedCommands) -> String {
    let mut out = match &loaded.origin {
        Origin::Attached => "the mission and robot that it brings".to_owned(),
        Origin::Mission(path) => path.display().to_string(),
    };
    if let Some(map) = &loaded.inputs.map {
        out += &format!(", map {}", map.name);
    }
    out
}
