//! `start: {file}`: the command file where whose motion ends a mission starts.

use std::path::Path;

use super::{Disk, folder_of, missing, tidy};
use crate::command::CommandTable;
use crate::diag::{Diagnostic, Diagnostics};
use crate::emit::csv::{self, CsvHeader};
use crate::emit::mcap_read;
use crate::mission::Mission;
use crate::pipeline::StartFile;

/// Reads it. `robot`: the robot file of the mission that starts there.
///
/// # Errors
/// It is missing, no command file, or was made for another robot file.
pub(super) fn read(path: &Path, robot: &Path, mission: &Mission, disk: &Disk) -> Result<StartFile, Diagnostics> {
    let named_by = mission.spans.start_file.as_ref();
    let name = path.display().to_string();
    let ending = |own: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(own));
    if ending("json") {
        let message = format!("`{name}` does not say which robot it is for: it cannot be started from");
        let hint = "name the commands.csv or commands.mcap of the same mission";
        return Err(Diagnostic::error("mission/start-file", message).maybe_at(named_by).hint(hint).into());
    }
    let bytes = disk.file(path, named_by).map_err(|Diagnostics(faults)| {
        let compile =
            "compile the mission first whose commands these are; `trajc build` does so by itself where it builds both";
        let hint = missing(path).1.map_or(compile.to_owned(), |near| format!("{near} else {compile}"));
        Diagnostics(faults.into_iter().map(|fault| fault.hint(hint.clone())).collect())
    })?;
    let (table, header): (CommandTable, CsvHeader) = if ending("mcap") {
        let file = mcap_read::read(&name, &bytes)?;
        (file.table, file.header)
    } else {
        let Ok(text) = std::str::from_utf8(&bytes) else {
            let message = format!("`{name}` is not UTF-8 text, so it is no commands.csv");
            let hint = "name a commands.csv or commands.mcap";
            return Err(Diagnostic::error("mission/start-file", message).maybe_at(named_by).hint(hint).into());
        };
        csv::read(&name, text)?
    };
    // Where the files that it was made from are still there, they tell more than dimensions do.
    let theirs = tidy(&folder_of(&tidy(&folder_of(path).join(&header.mission))).join(&header.robot));
    if disk.is_real() && is_another(&theirs, robot) {
        let message = format!("`{name}` was made for the robot `{}`, not for `{}`", theirs.display(), robot.display());
        let hint = "a motion goes on only with the same robot";
        return Err(Diagnostic::error("mission/start-robot", message).maybe_at(named_by).hint(hint).into());
    }
    Ok(StartFile { name, bytes, table })
}

/// Whether both are there, and different: neither one file nor copies of each other.
fn is_another(theirs: &Path, own: &Path) -> bool {
    let (Ok(a), Ok(b)) = (theirs.canonicalize(), own.canonicalize()) else { return false };
    a != b && std::fs::read(a).ok() != std::fs::read(b).ok()
}
