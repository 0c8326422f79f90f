//! `trajc play COMMANDS --to SINK`.

mod feedback;
mod sinks;

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use super::terminal::Terminal;
use crate::command::CommandTable;
use crate::diag::{Diagnostic, Diagnostics};
use crate::inputs::commands::{self, LoadedCommands, Places};
use crate::play::address::Address;
use crate::play::pace::{self, Limits};
use crate::play::tracking::Phase;
use crate::play::{self, Ending, MonotonicClock, Motion, Outcome, Play, Reason, SinkError, motion, realtime};
use feedback::Following;

/// Signals that come this close to each other are one.
const ONE_REQUEST: Duration = Duration::from_millis(100);

/// Play a command file in real time to a robot or whoever listens.
///
/// Row k goes out at t0 + k times the sampling time, on the monotonic clock. Before anything is sent the file is proven again, as by
/// `check`. Ctrl-C, SIGTERM, a receiver that is gone or a row that is late by more than a sampling time lead to a stop along the
/// planned path, within the limits of wheels and joints; a second Ctrl-C to a zero command at once. How late rows were is printed at
/// the end.
///
/// With `--feedback` the robot is seen: a tracking law keeps it on the path within all limits, time is held back where it lags, and it
/// stops when it leaves the room around its path or poses stop coming. `--to stdio` does the same without a clock: a pose a line in, a
/// command a line out, so that a simulator can close the loop.
///
/// Exit 0: all rows played. 1: stopped before the end, or not certified. 2: bad input or usage, or nobody to play to; nothing was
/// sent.
#[derive(Debug, clap::Args)]
pub struct PlayArgs {
    /// Command file to play (.csv or .mcap).
    commands: PathBuf,
    /// Where to: stdout, stdio, udp://HOST:PORT, can:IFACE, can:udp://HOST:PORT[?local=PORT], ros2, zenoh[:ENDPOINT], foxglove[://HOST:PORT].
    #[arg(long, value_name = "SINK")]
    to: Address,
    /// A second sink, for the joints of a robot whose base is driven by CAN.
    #[arg(long, value_name = "SINK")]
    joints: Option<Address>,
    /// Mission to check against [default: the one that the file names].
    #[arg(long, value_name = "MISSION.yaml")]
    mission: Option<PathBuf>,
    /// The mission's map, where it lies elsewhere.
    #[arg(long, value_name = "FILE")]
    map: Option<PathBuf>,
    /// Plays slower: speeds and pace times R, the same path. Above 0, at most 1.
    #[arg(long, value_name = "R", default_value = "1", value_parser = rate)]
    rate: f64,
    /// Begins at this time of the file, in seconds: the robot stands at the planned pose, and sets off from rest within limits.
    #[arg(long, value_name = "S", value_parser = start)]
    start_at: Option<f64>,
    /// Plays a file that is not certified.
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    sinks: sinks::SinkArgs,
    #[command(flatten)]
    feedback: feedback::FeedbackArgs,
    /// Print how it went as JSON on stdout.
    #[arg(long)]
    json: bool,
}

fn rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if (0.001..=1.0).contains(&value) => Ok(value),
        Ok(value) if value > 1.0 => {
            Err("faster than planned would exceed the limits that were proven: compile again for a faster motion; expected at most 1, \
                 such as 0.5"
                .to_owned())
        }
        _ => Err("expected a number above 0 and at most 1, such as 0.5".to_owned()),
    }
}

fn start(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|v| (0.0..=1e6).contains(v)).ok_or_else(|| "expected seconds, such as 12.5".to_owned())
}

/// Plays.
///
/// # Errors
/// Bad input, nobody to play to, or a file that is not certified. Nothing was sent.
pub fn play(args: &PlayArgs, terminal: &mut Terminal) -> Result<u8, Diagnostics> {
    if args.json && matches!(args.to, Address::Stdout | Address::Stdio) {
        let fault = Diagnostic::error("play/stdout", "--json and this sink would both write to stdout");
        return Err(fault.hint("leave out --json: the report is on stderr").into());
    }
    let places = Places { mission: args.mission.as_deref(), map: args.map.as_deref() };
    let loaded = commands::load(&args.commands, places)?;
    let clearance = certified(args, &loaded, terminal)?;
    let LoadedCommands { file, inputs, world, .. } = loaded;
    let (robot, table) = (world.robot, file.table);
    let file_step = table.sampling_time;
    let motion = Motion::new(motion::slowed(table, args.rate));
    let limits = Limits::new(&robot, &motion);
    let (motion, first_row) = match args.start_at {
        None => (motion, 0),
        Some(time) => from_within(&motion, &limits, time, file_step)?,
    };
    let following = Following {
        args: &args.feedback,
        robot: &robot,
        motion: &motion,
        limits: &limits,
        reverse: inputs.mission.reverse,
        clearance,
    };
    if args.to == Address::Stdio {
        let phase = following.lines(&mut std::io::stdin().lock(), &mut std::io::stdout().lock())?;
        return Ok(u8::from(phase != Phase::Done));
    }
    let what = Play { motion: &motion, limits: &limits, first_row, file_step };
    let world = sinks::World { robot: &robot, urdf: &inputs.urdf.text, table: motion.table() };
    let mut sink = sinks::open(&args.to, args.joints.as_ref(), &args.sinks, &world)?;

    let requests = Arc::new(AtomicUsize::new(0));
    let counted = requests.clone();
    let mut last: Option<Instant> = None;
    ctrlc::set_handler(move || {
        // Wrappers such as `timeout` signal a process and its group: one request, twice.
        if last.is_none_or(|last| last.elapsed() > ONE_REQUEST) {
            counted.fetch_add(1, Ordering::SeqCst);
        }
        last = Some(Instant::now());
    })
    .map_err(|error| Diagnostic::error("play/signals", format!("signals cannot be handled: {error}")))?;
    let rows = motion.table().rows.len();
    terminal.remark(&format!(
        "playing {rows} rows in {:.1} s; Ctrl-C stops on the path, a second one at once\n",
        motion.table().duration()
    ));
    // Last: sinks have threads of their own, which are not to be as urgent.
    let urgent = realtime::ask_for();
    if let Some(source) = &args.feedback.feedback {
        let asked = || requests.load(Ordering::SeqCst);
        let poses = following.poses(source, &args.sinks)?;
        let followed = following.live(poses, args.sinks.wait, sink.as_mut(), &asked).map_err(not_begun)?;
        let done = followed.phase == Phase::Done && followed.cut.is_none();
        if args.json {
            terminal.print(&feedback::for_programs(&followed));
        } else {
            terminal.remark(&feedback::readable(&followed));
        }
        return Ok(u8::from(!done));
    }
    let mut clock = MonotonicClock::new();
    let outcome =
        play::play(&what, sink.as_mut(), &mut clock, &|| requests.load(Ordering::SeqCst)).map_err(not_begun)?;
    let text = if args.json { json(&outcome, rows, urgent) } else { readable(&outcome, rows, urgent) };
    if args.json {
        terminal.print(&text)
    } else {
        terminal.remark(&text)
    }
    Ok(u8::from(outcome.ending != Ending::Complete))
}

/// Refuses what is not certified, unless asked not to. The clearance that is proven, m.
fn certified(args: &PlayArgs, loaded: &LoadedCommands, terminal: &mut Terminal) -> Result<Option<f64>, Diagnostics> {
    if !loaded.as_made {
        terminal.remark("note: the mission, robot or map are not the ones that the file was made from\n");
    }
    let certificate = loaded.certify()?;
    let clearance = certificate.clearance_proven;
    let Some(first) = certificate.refusals.first() else { return Ok(clearance) };
    let more = certificate.refusals.len() - 1;
    let more = if more == 0 { String::new() } else { format!(" (and {more} more)") };
    let message = format!("`{}` is not certified: {}{more}", args.commands.display(), first.message);
    if args.force {
        terminal.remark(&format!("warning: {message}; played by --force\n"));
        return Ok(clearance);
    }
    let hint = "`trajc check` says all that is wrong; --force plays it nevertheless";
    Err(Diagnostic::failure("play/not-certified", message).hint(hint).into())
}

/// The motion from a time within, set off from rest, and the row of the file whose time its first row has.
fn from_within(motion: &Motion, limits: &Limits, time: f64, file_step: f64) -> Result<(Motion, i64), Diagnostics> {
    let table = motion.table();
    let rows = table.rows.len();
    let at = (time / file_step + 1e-9).floor() as usize;
    if at + 1 >= rows {
        let end = (rows.saturating_sub(1)) as f64 * file_step;
        let message = format!("--start-at {time} is behind the end of the motion at {end} s");
        return Err(Diagnostic::error("play/start", message).into());
    }
    let Some(begun) = pace::set_off(motion, at, limits) else {
        let near = (1..rows).flat_map(|d| [at.checked_sub(d), Some(at + d).filter(|k| k + 1 < rows)]).flatten();
        let near = near.take(400).find(|k| pace::set_off(motion, *k, limits).is_some());
        let hint = match near {
            Some(k) => format!("{} s is the nearest time at which it can", k as f64 * file_step),
            None => "begin where the robot is at rest".to_owned(),
        };
        let message =
            format!("no setting off from rest at {time} s keeps the limits: the motion is at its limits there");
        return Err(Diagnostic::error("play/start", message).hint(hint).into());
    };
    let ramp = begun.rows.len();
    let rows = begun.rows.into_iter().chain(table.rows[begun.joins..].iter().cloned()).collect();
    // Rows of the file have the file's own times.
    let first_row = begun.joins as i64 - ramp as i64;
    Ok((Motion::new(CommandTable { rows, ..table.clone() }), first_row))
}

fn not_begun(error: SinkError) -> Diagnostics {
    Diagnostic::error("play/not-ready", error).hint("nothing was sent").into()
}

fn reason(reason: &Reason) -> String {
    match reason {
        Reason::Asked => "asked to stop".to_owned(),
        Reason::Sink(error) => error.to_string(),
        Reason::Late(late) => format!("a row was {:.1} ms late, more than a sampling time", late * 1e3),
    }
}

fn scheduler(urgent: bool) -> &'static str {
    if urgent { "SCHED_FIFO" } else { "no real-time scheduling: not permitted" }
}

fn readable(outcome: &Outcome, rows: usize, urgent: bool) -> String {
    let took = outcome.stop_time.map_or(String::new(), |time| format!(" in {time:.2} s"));
    let ending = match &outcome.ending {
        Ending::Complete => "played to the end".to_owned(),
        Ending::Stopped(why) => format!("stopped on the planned path{took}: {}", reason(why)),
        Ending::Cut(why) => format!("zero at once: {}", reason(why)),
    };
    let jitter = outcome.jitter;
    format!(
        "{ending}\n  {} rows sent, {rows} planned\n  late by {:.3} ms (p50), {:.3} ms (p99), {:.3} ms (max); {} later than a sampling \
         time\n  {}\n",
        outcome.sent,
        jitter.p50 * 1e3,
        jitter.p99 * 1e3,
        jitter.max * 1e3,
        outcome.missed,
        scheduler(urgent)
    )
}

fn json(outcome: &Outcome, rows: usize, urgent: bool) -> String {
    let (ending, why) = match &outcome.ending {
        Ending::Complete => ("complete", None),
        Ending::Stopped(why) => ("stopped", Some(why)),
        Ending::Cut(why) => ("cut", Some(why)),
    };
    let ms = |seconds: f64| seconds * 1e3;
    let value = serde_json::json!({
        "ending": ending,
        "reason": why.map(reason),
        "rows": {"planned": rows, "sent": outcome.sent, "late": outcome.missed},
        "jitter_ms": {"p50": ms(outcome.jitter.p50), "p99": ms(outcome.jitter.p99), "max": ms(outcome.jitter.max)},
        "stop_s": outcome.stop_time,
        "real_time": urgent,
    });
    format!("{value:#}\n")
}
