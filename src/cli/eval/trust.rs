//! `trajc eval --suite trust`.

use super::super::terminal::Terminal;
use super::{EvalArgs, progress};
use crate::diag::{Diagnostic, Diagnostics};
use crate::eval::trust::{self, Case};

/// Tries the cases and prints; 1 where something was certified that must not be.
///
/// # Errors
/// An option that means nothing here.
pub(super) fn eval(args: &EvalArgs, terminal: &mut Terminal) -> Result<u8, Diagnostics> {
    refuse_what_has_no_meaning(args)?;
    let seed = args.seed.unwrap_or(1);
    if let Some(index) = args.scene {
        return Ok(one(seed, index, terminal));
    }
    let count = args.count.map_or(trust::DEFAULT_COUNT, u64::from);
    let bar = progress(terminal, usize::try_from(count).unwrap_or(usize::MAX));
    let tally = trust::run(seed, 0, count, &Case::certify, &mut || bar.inc(1));
    bar.finish_and_clear();
    terminal.print(&if args.json { trust::document(&tally, seed) } else { trust::table(&tally, seed) });
    Ok(u8::from(tally.wrong_count() > 0))
}

/// One case, with all that was found.
fn one(seed: u64, index: u64, terminal: &mut Terminal) -> u8 {
    let tried = trust::attempt(seed, index, &Case::certify);
    let mut text = format!("seed {seed}, scene {index}: {}\n", tried.case.family.name());
    text += &format!("outcome: {:?}\ntrue: {:?}\n", tried.outcome, tried.finding);
    text += &format!("said: {:#?}\n", tried.certificate);
    text += &format!("robot: {:#?}\ntask: {:#?}\ntable: {:#?}\n", tried.case.robot, tried.case.task, tried.case.table);
    if let Some(map) = &tried.case.map {
        let cells: Vec<_> = map.cells().collect();
        text += &format!(
            "map: {} m from {:?}, {:?} cells, outside {:?}",
            map.resolution, map.origin, map.dims, map.outside
        );
        text += &format!(", occupied {cells:?}\n");
    }
    text += &format!("vias: {:?}\nzones: {:?}\n", tried.case.vias, tried.case.zones);
    terminal.print(&text);
    u8::from(tried.outcome.is_wrong())
}

fn refuse_what_has_no_meaning(args: &EvalArgs) -> Result<(), Diagnostics> {
    let given = [
        ("--robot", args.robot.is_some()),
        ("--boxes", !args.boxes.is_empty()),
        ("--parameterisation", args.parameterisation.is_some()),
        ("--write-scenes", args.write_scenes.is_some()),
        ("--write-commands", args.write_commands.is_some()),
        ("--plot", args.plot.is_some()),
        ("--profile", args.profile),
    ];
    let faults = given.iter().filter(|(_, given)| *given).map(|(option, _)| {
        let message = format!("trust draws its own robots and plans nothing: `{option}` has no meaning there");
        Diagnostic::error("eval/trust", message).hint(format!("leave `{option}` out"))
    });
    let faults = Diagnostics(faults.collect());
    if faults.0.is_empty() { Ok(()) } else { Err(faults) }
}
