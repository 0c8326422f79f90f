//! `trajc eval --suite curves`.

use std::path::Path;

use super::super::inputs::Disk;
use super::super::output;
use super::super::terminal::Terminal;
use super::{EvalArgs, built_in};
use crate::diag::{Diagnostic, Diagnostics};
use crate::emit::csv::{self, CsvHeader};
use crate::eval::curves::{self, Held, Judged};
use crate::mission;
use crate::robot::{self, RobotInputs, RobotModel};

/// The robot of \[CONV\] section 3.
const CONV: [&str; 3] =
    ["conv", include_str!("../../../robots/conv/robot.yaml"), include_str!("../../../robots/conv/conv.urdf")];
/// A mission on the first of the curves: how long commands are held, and how they are sampled where a mission does not say.
const MISSION: &str = include_str!("../../../missions/c_curve.yaml");

/// Drives the curves and prints.
///
/// # Errors
/// An option that means nothing here; a folder that cannot be written.
pub(super) fn eval(args: &EvalArgs, terminal: &mut Terminal) -> Result<u8, Diagnostics> {
    refuse_what_has_no_meaning(args)?;
    let (name, (spec, _, urdf)) = built_in(&CONV)?;
    let mission = mission::parse("missions/c_curve.yaml", MISSION)?;
    let mut files = Disk::default();
    let robot = robot::parse(RobotInputs {
        spec: &spec,
        urdf: (&urdf.name, &urdf.text),
        files: &mut files,
        overrides: &mission.limits,
    })?;
    let held = Held { sampling_time: mission.sampling_time, sampling: mission.sampling };
    let progress = terminal.progress("curves");
    let judge = |curve: &curves::Curve| {
        progress.stage(curve.title);
        curves::judge(curve, &robot, held)
    };
    let judged: Vec<Judged> = curves::suite().iter().map(judge).collect();
    drop(progress);
    if let Some(folder) = &args.write_commands {
        judged.iter().try_for_each(|one| write(folder, one, &name))?;
    }
    let pictures = args.plot.as_deref().map_or(Ok(Vec::new()), |folder| draw(folder, &judged, &robot))?;
    if args.json {
        terminal.print(&curves::document(&judged, &robot, held));
    } else {
        terminal.print(&(curves::table(&judged, &robot, held) + &pictures.concat()));
    }
    Ok(0)
}

fn refuse_what_has_no_meaning(args: &EvalArgs) -> Result<(), Diagnostics> {
    let given = [
        ("--robot", args.robot.is_some()),
        ("--count", args.count.is_some()),
        ("--seed", args.seed.is_some()),
        ("--scene", args.scene.is_some()),
        ("--boxes", !args.boxes.is_empty()),
        ("--parameterisation", args.parameterisation.is_some()),
        ("--write-scenes", args.write_scenes.is_some()),
        ("--profile", args.profile),
    ];
    let faults = given.iter().filter(|(_, given)| *given).map(|(option, _)| {
        let message = format!("curves are fixed paths of the robot of [CONV]: `{option}` has no meaning there");
        Diagnostic::error("eval/curves", message).hint(format!("leave `{option}` out"))
    });
    let faults = Diagnostics(faults.collect());
    if faults.0.is_empty() { Ok(()) } else { Err(faults) }
}

/// `DIR/ID/ROW.csv` of every row that has commands.
fn write(folder: &Path, judged: &Judged, robot: &str) -> Result<(), Diagnostics> {
    let folder = folder.join(judged.curve.id);
    output::make_folder(&folder)?;
    for row in &judged.rows {
        let path = folder.join(format!("{}.csv", row.how.key()));
        let Ok(figures) = &row.outcome else {
            // Left from an earlier run, it would pass for this one's.
            let _ = std::fs::remove_file(&path);
            continue;
        };
        let header = CsvHeader {
            mission: format!("curves#{}", judged.curve.id),
            robot: robot.to_owned(),
            ..CsvHeader::default()
        };
        output::write_file(&path, csv::write(&figures.table, &header).as_bytes())?;
    }
    Ok(())
}

/// `DIR/ID.svg`; a line of text for each.
fn draw(folder: &Path, judged: &[Judged], robot: &RobotModel) -> Result<Vec<String>, Diagnostics> {
    output::make_folder(folder)?;
    let draw = |one: &Judged| {
        let path = folder.join(format!("{}.svg", one.curve.id));
        output::write_file(&path, curves::picture(one, robot).as_bytes())?;
        Ok(format!("picture: {}\n", path.display()))
    };
    judged.iter().map(draw).collect()
}
