//! Sinks from their addresses, and those that this program was built with.

use crate::command::CommandTable;
use crate::diag::{Diagnostic, Diagnostics};
use crate::play::address::Address;
use crate::play::sink::{Both, Sink};
use crate::play::sinks::can::{self, CanBus, CanSink};
use crate::play::sinks::cannelloni::Cannelloni;
use crate::play::sinks::stdout::{Lines, StreamSink};
use crate::play::sinks::udp::UdpSink;
use crate::play::{MonotonicClock, SinkError};
use crate::robot::RobotModel;

/// What only some sinks heed.
#[derive(Debug, clap::Args)]
pub(super) struct SinkArgs {
    /// Lines of `--to stdout`.
    #[arg(long, value_name = "FORMAT", default_value = "csv")]
    format: LineFormat,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum LineFormat {
    /// Columns as in commands.csv
    Csv,
    /// A JSON object a line
    Json,
}

/// What sinks may have to know of what is played.
pub(super) struct World<'a> {
    pub robot: &'a RobotModel,
    pub urdf: &'a str,
    pub table: &'a CommandTable,
}

/// Opens the sink, and the second one for the joints.
pub(super) fn open<'a>(
    to: &Address,
    joints: Option<&Address>,
    args: &SinkArgs,
    world: &World<'a>,
) -> Result<Box<dyn Sink + 'a>, Diagnostics> {
    let first = one(to, joints.is_some(), args, world)?;
    match joints {
        None => Ok(first),
        Some(second) => Ok(Box::new(Both(first, one(second, false, args, world)?))),
    }
}

fn one<'a>(
    address: &Address,
    joints_elsewhere: bool,
    args: &SinkArgs,
    world: &World<'a>,
) -> Result<Box<dyn Sink + 'a>, Diagnostics> {
    match address {
        Address::Stdout => {
            let lines = if args.format == LineFormat::Csv { Lines::Csv } else { Lines::Json };
            Ok(Box::new(StreamSink::new(std::io::stdout(), lines)))
        }
        Address::Udp { to } => Ok(Box::new(UdpSink::new(to).map_err(fault)?)),
        Address::CanOverUdp { to, local } => can_sink(|| Cannelloni::new(to, *local), joints_elsewhere, world),
        Address::Can { interface } => interface_sink(interface, joints_elsewhere, world),
        Address::Foxglove { .. } => Err(not_built("foxglove")),
        Address::Ros2 => Err(not_built("ros2")),
        Address::Zenoh { .. } => Err(not_built("zenoh")),
    }
}

fn interface_sink<'a>(interface: &str, _: bool, _: &World<'a>) -> Result<Box<dyn Sink + 'a>, Diagnostics> {
    let _ = interface;
    Err(not_built("can"))
}

fn can_sink<'a, B: CanBus + 'a>(
    bus: impl FnOnce() -> Result<B, SinkError>,
    joints_elsewhere: bool,
    world: &World<'a>,
) -> Result<Box<dyn Sink + 'a>, Diagnostics> {
    let limits = can::BaseLimits { speed: world.robot.wheel.speed };
    can::refuse(world.table, limits, joints_elsewhere).map_err(|refusal| {
        let hint = match &refusal {
            can::CanRefusal::Joints { .. } => "--joints SINK sends them elsewhere at the same time",
            can::CanRefusal::TooFast { .. } => "compile the mission for this robot's limits",
        };
        Diagnostics::from(Diagnostic::error("play/can", refusal).hint(hint))
    })?;
    Ok(Box::new(CanSink::new(bus().map_err(fault)?, MonotonicClock::new())))
}

fn fault(error: SinkError) -> Diagnostics {
    Diagnostic::error("play/not-ready", error).into()
}

fn not_built(feature: &str) -> Diagnostics {
    let message = format!("this trajc was built without the sink `{feature}`");
    let hint = format!("build it with: cargo install --path . --features {feature}");
    Diagnostic::error("play/not-built", message).hint(hint).into()
}
