//! `trajc build [PATH…]`: many missions, of which only those are compiled whose inputs changed.

mod document;
mod find;
mod hashes;
mod make;
mod order;
mod schedule;
mod state;
mod work;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::inputs::{folder_of, tidy};
use super::output;
use super::products::ProductArgs;
use super::terminal::{Progress, Terminal};
use crate::diag::Diagnostics;
use crate::mission;
use crate::report::Status;
use document::{Document, Row, RowStatus};
use find::Found;
use hashes::Hashes;
use make::Site;
use order::Order;
use schedule::{Job, Schedule, map_key};
use state::{Ended, Making, Reason, Stale, State};
use work::{Event, Finished, work};

pub use document::json_schema;

/// Compile many missions, those alone whose inputs changed.
///
/// Of a folder, every .yaml and .yml below it is built that has `robot`, `start`, `goal` or `path` at its top; hidden files and links to
/// folders are passed over. Two missions of one name are an error.
///
/// A mission is up to date while the bytes of everything it names (mission, robot.yaml, URDF, meshes, map and the file beside it, path),
/// the program and the options are those that its folder was made from, and the folder's files are there as they were written: dates do not count.
/// A mission that failed is not compiled again until something changes, but counts as failed. Bad input is read again each time.
/// After a failure no mission begins that comes later, as with make; -k goes on. Missions on one map share it and its distance field.
///
/// Exit: that of the worst mission. 0: all certified. 1: no trajectory or no certificate. 2: bad input or usage.
#[derive(Debug, clap::Args)]
pub struct BuildArgs {
    /// Missions, and folders that hold missions.
    #[arg(value_name = "PATH", default_value = "missions")]
    paths: Vec<PathBuf>,
    /// Missions to compile at a time [default: one for each core].
    #[arg(long, short, value_name = "N", value_parser = at_a_time)]
    jobs: Option<u16>,
    /// Go on with other missions where one fails.
    #[arg(long, short)]
    keep_going: bool,
    /// Say what would be compiled, and why; write nothing.
    #[arg(long, short = 'n')]
    dry_run: bool,
    /// Compile everything, changed or not.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    products: ProductArgs,
    /// Print JSON on stdout instead of the table (`trajc schema build`).
    #[arg(long)]
    json: bool,
}

fn at_a_time(text: &str) -> Result<u16, String> {
    super::whole(text, 1, 1024).map(|n| n as u16)
}

/// What is known of a mission before anything is compiled.
enum Plan {
    /// Its folder holds; and what was read for it.
    Keep(Ended, Vec<PathBuf>),
    /// It is to be compiled.
    Make(Vec<Stale>),
}

/// Builds.
///
/// # Errors
/// A path that is not there, no missions, two of one name; another build in the same folder. What is wrong with a mission is told, and
/// counts in the exit code.
pub fn build(args: &BuildArgs, terminal: &mut Terminal) -> Result<u8, Diagnostics> {
    let start = std::env::current_dir().unwrap_or_else(|_| PathBuf::from("."));
    let out = &args.products.out;
    let mut missions = find::find(&args.paths, &start, out)?;
    let _lock = if args.dry_run {
        None
    } else {
        output::make_folder(out)?;
        let lock = output::lock_all(out)?;
        output::sweep(out);
        hashes::sweep(out);
        lock
    };
    let hashes = Arc::new(Hashes::load(&start, out));
    let making = Making::new(&args.products, &hashes);
    let mut plans: Vec<Plan> = missions.iter().map(|mission| plan(args, mission, &start, &making, &hashes)).collect();
    let reads: Vec<Vec<PathBuf>> = missions.iter().zip(&plans).map(|(m, plan)| reads(m, plan, &start)).collect();
    let order = order::order(&missions, &reads, &out_folders(&missions, out, &start))?;
    (missions, plans) = (order.sorted(missions), order.sorted(plans));
    for (index, before) in order.after.iter().enumerate() {
        if let Some((first, file)) = before
            && matches!((&plans[*first], &plans[index]), (Plan::Make(_), Plan::Keep(..)))
        {
            plans[index] = Plan::Make(vec![Stale::After(file.clone())]);
        }
    }
    let mut rows: Vec<Row> = missions.iter().zip(&plans).map(|(mission, plan)| row(out, mission, plan)).collect();
    let jobs = jobs(args, &mut rows, &order);
    if !args.dry_run {
        for job in &jobs {
            rows[job.index].status = RowStatus::NotTried;
        }
        let total = jobs.len();
        let with_map = |job: Job| Job { map: shared_map(&missions[job.index]), ..job };
        let jobs = jobs.into_iter().map(with_map).collect();
        let schedule = Schedule::new(jobs);
        let site = Site { args: &args.products, start, making, hashes: hashes.clone(), schedule };
        compile(args, &site, total, &missions, &mut rows, terminal);
        hashes.save();
    }
    let code = rows.iter().map(|row| row.exit_code).max().unwrap_or_default();
    let document = Document::new(out.clone(), args.dry_run, code, rows);
    terminal.print(&if args.json { document.to_json() } else { document.to_text(args.keep_going) });
    Ok(code)
}

/// Whether a mission's folder holds.
fn plan(args: &BuildArgs, mission: &Found, start: &Path, making: &Making, hashes: &Hashes) -> Plan {
    let folder = args.products.out.join(&mission.name);
    if args.force {
        return Plan::Make(vec![Stale::Forced]);
    }
    let Some(state) = State::read(&folder) else { return Plan::Make(vec![Stale::New]) };
    let why = state.stale(&mission.path, &folder, start, making, hashes);
    if why.is_empty() {
        Plan::Keep(state.ended.clone(), state.reads().map(Path::to_path_buf).collect())
    } else {
        Plan::Make(why)
    }
}

fn row(out: &Path, mission: &Found, plan: &Plan) -> Row {
    let mut row = Row {
        mission: mission.name.clone(),
        path: mission.path.clone(),
        folder: out.join(&mission.name),
        status: RowStatus::ToCompile,
        exit_code: 0,
        why: Vec::new(),
        time_s: None,
        clearance_m: None,
        duration_s: None,
        failure: None,
    };
    match plan {
        Plan::Make(why) => row.why = why.iter().map(Stale::to_string).collect(),
        Plan::Keep(ended, _) if ended.status == Status::Certified => row.end(RowStatus::UpToDate, ended.clone()),
        Plan::Keep(ended, _) => {
            row.end(RowStatus::FailedBefore, ended.clone());
            // Bad input is not remembered.
            row.exit_code = 1;
        }
    }
    row
}

/// What is to be compiled. A failure that is known already ends the list as a new one does.
fn jobs(args: &BuildArgs, rows: &mut [Row], order: &Order) -> Vec<Job> {
    let mut jobs = Vec::new();
    let mut stopped = false;
    for (index, row) in rows.iter_mut().enumerate() {
        match row.status {
            RowStatus::FailedBefore => stopped |= !args.keep_going,
            RowStatus::ToCompile if stopped => row.status = RowStatus::NotTried,
            RowStatus::ToCompile => {
                jobs.push(Job { index, map: None, after: order.after[index].clone() });
            }
            _ => {}
        }
    }
    jobs
}

/// What a mission reads of others' making: as it did; where it is to be compiled, as it says.
fn reads(mission: &Found, plan: &Plan, start: &Path) -> Vec<PathBuf> {
    if let Plan::Keep(_, reads) = plan {
        return reads.clone();
    }
    let name = mission.path.display().to_string();
    let parsed = std::fs::read_to_string(&mission.path).ok().and_then(|text| mission::parse(&name, &text).ok());
    let file = parsed.and_then(|parsed| parsed.start_file);
    file.iter().map(|file| output::spelled(&tidy(&folder_of(&mission.path).join(file)), start)).collect()
}

/// The folder of each mission's output, as build systems spell it.
fn out_folders(missions: &[Found], out: &Path, start: &Path) -> Vec<PathBuf> {
    missions.iter().map(|mission| output::spelled(&tidy(&out.join(&mission.name)), start)).collect()
}

/// The key of the map that a mission may share with others.
fn shared_map(mission: &Found) -> Option<schedule::MapKey> {
    let name = mission.path.display().to_string();
    let mission = mission::parse(&name, &std::fs::read_to_string(&mission.path).ok()?).ok()?;
    let map = mission.map.as_ref()?;
    map_key(&mission, &tidy(&folder_of(Path::new(&name)).join(&map.file)))
}

/// Compiles what is scheduled, and notes in the rows what came of it.
fn compile(
    args: &BuildArgs,
    site: &Site<'_>,
    total: usize,
    missions: &[Found],
    rows: &mut [Row],
    terminal: &mut Terminal,
) {
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    let workers = args.jobs.map_or_else(cores, usize::from).min(total);
    let progress = terminal.progress("build");
    let (mut at_work, mut done, mut failed) = (BTreeSet::new(), 0, 0);
    let make = |job: &Job| site.make(job, &missions[job.index]);
    work(&site.schedule, workers, args.keep_going, &make, &mut |event| {
        match event {
            Event::Begun(index) => {
                at_work.insert(index);
            }
            Event::Done(finished) => {
                at_work.remove(&finished.index);
                done += 1;
                failed += usize::from(!finished.certified());
                finish(site, &missions[finished.index], &mut rows[finished.index], &finished, &progress, terminal);
            }
        }
        progress.say(|| {
            let names: Vec<&str> = at_work.iter().map(|index| missions[*index].name.as_str()).collect();
            let failed = if failed > 0 { format!(", {failed} failed") } else { String::new() };
            format!("{done} of {total}{failed}; {}", names.join(", "))
        });
    });
}

/// Notes how a mission ended, and tells why it failed.
fn finish(
    site: &Site<'_>,
    mission: &Found,
    row: &mut Row,
    finished: &Finished,
    progress: &Progress,
    terminal: &mut Terminal,
) {
    row.time_s = Some((finished.time * 1e3).round() / 1e3);
    let faults = match &finished.result {
        Ok(made) => {
            let status = if finished.certified() { RowStatus::Certified } else { RowStatus::Failed };
            row.end(status, made.ended.clone());
            made.diagnostics.clone()
        }
        Err(faults) => {
            let mut faults = faults.clone();
            // Also where it panicked.
            site.discard(mission, &mut faults);
            row.status = RowStatus::Failed;
            row.failure = faults.0.first().map(|first| Reason {
                code: first.code.to_owned(),
                reason: first.message.lines().next().unwrap_or_default().to_owned(),
            });
            Some(faults)
        }
    };
    if let Some(faults) = faults {
        row.exit_code = super::exit_code(&faults);
        progress.aside(|| {
            terminal.remark(&format!("{}: FAILED\n", mission.path.display()));
            terminal.complain(&faults);
        });
    }
}
