//! Sinks from their addresses, and those that this program was built with.

use crate::command::CommandTable;
use crate::diag::{Diagnostic, Diagnostics};
use crate::play::address::Address;
use crate::play::sink::{Both, Sink};
use crate::play::sinks::can::{self, CanBus, CanSink};
use crate::play::sinks::cannelloni::Cannelloni;
use crate::play::sinks::stdout::{Lines, StreamSink};
use crate::play::sinks::topics::{self, Names, Topic, TopicSink, Transport};
use crate::play::sinks::udp::UdpSink;
use crate::play::{MonotonicClock, SinkError};
use crate::robot::RobotModel;

/// What only some sinks heed.
#[derive(Debug, clap::Args)]
pub(super) struct SinkArgs {
    /// Lines of `--to stdout`.
    #[arg(long, value_name = "FORMAT", default_value = "csv")]
    format: LineFormat,
    /// ros2, zenoh, foxglove: seconds to wait for somebody who listens; with --feedback, for the first pose.
    #[arg(long, value_name = "S", default_value = "10", value_parser = wait)]
    pub wait: f64,
    /// ros2, zenoh, foxglove: these topics alone, separated by commas, such as /cmd_vel.
    #[arg(long, value_name = "TOPIC", value_delimiter = ',')]
    topics: Vec<String>,
    /// ros2, zenoh, foxglove: another name for a topic, such as /cmd_vel:=/diff_drive_controller/cmd_vel.
    #[arg(long, value_name = "FROM:=TO", value_parser = renaming)]
    remap: Vec<(String, String)>,
    /// ros2, zenoh: the domain [default: ROS_DOMAIN_ID, else 0].
    #[arg(long, value_name = "ID", value_parser = clap::value_parser!(u16).range(0..=232))]
    domain: Option<u16>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum LineFormat {
    /// Columns as in commands.csv
    Csv,
    /// A JSON object a line
    Json,
}

fn wait(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|s| (0.0..=1e5).contains(s)).ok_or_else(|| "expected seconds, such as 10".to_owned())
}

fn renaming(text: &str) -> Result<(String, String), String> {
    let parts = text.split_once(":=").filter(|(from, to)| !from.is_empty() && !to.is_empty());
    let (from, to) = parts.ok_or_else(|| "expected FROM:=TO".to_owned())?;
    Ok((from.to_owned(), to.to_owned()))
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
        Address::Stdio => {
            let fault = Diagnostic::error("play/stdio", "stdio is no second sink: commands answer poses there");
            Err(fault.hint("--joints SINK goes with a sink in real time").into())
        }
        Address::Udp { to } => Ok(Box::new(UdpSink::new(to).map_err(fault)?)),
        Address::CanOverUdp { to, local } => on_a_bus(|| Cannelloni::new(to, *local), joints_elsewhere, world),
        Address::Can { interface } => on_an_interface(interface, joints_elsewhere, world),
        Address::Foxglove { .. } | Address::Ros2 | Address::Zenoh { .. } => on_topics(address, args, world),
    }
}

fn on_a_bus<'a, B: CanBus + 'a>(
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

#[cfg(all(feature = "can", target_os = "linux"))]
fn on_an_interface<'a>(name: &str, joints: bool, world: &World<'a>) -> Result<Box<dyn Sink + 'a>, Diagnostics> {
    on_a_bus(|| crate::play::sinks::socketcan::SocketCan::new(name), joints, world)
}

#[cfg(not(all(feature = "can", target_os = "linux")))]
fn on_an_interface<'a>(_: &str, _: bool, _: &World<'a>) -> Result<Box<dyn Sink + 'a>, Diagnostics> {
    Err(not_built("can"))
}

fn on_topics<'a>(address: &Address, args: &SinkArgs, world: &World<'a>) -> Result<Box<dyn Sink + 'a>, Diagnostics> {
    let names = Names { only: args.topics.clone(), remapped: args.remap.clone() };
    let found = topics::topics(world.table, &names).map_err(|message| Diagnostic::error("play/topics", message))?;
    let transport = transport(address, &found, domain(args)?, args.wait)?.map_err(fault)?;
    Ok(Box::new(TopicSink::new(transport, &found, world.robot, world.urdf, world.table)))
}

/// What carries the topics; the inner error: nobody there.
fn transport(
    address: &Address,
    topics: &[Topic],
    domain: u16,
    wait: f64,
) -> Result<Result<Box<dyn Transport>, SinkError>, Diagnostics> {
    // Unused where nothing that carries topics was built in.
    let _ = (topics, domain, wait);
    match address {
        #[cfg(feature = "foxglove")]
        Address::Foxglove { host, port } => {
            Ok(crate::play::sinks::foxglove::Foxglove::new(host, *port, topics, wait).map(|made| Box::new(made) as _))
        }
        #[cfg(feature = "ros2")]
        Address::Ros2 => Ok(crate::play::sinks::ros2::Ros2::new(domain, topics, wait).map(|made| Box::new(made) as _)),
        #[cfg(feature = "zenoh")]
        Address::Zenoh { endpoint } => {
            Ok(crate::play::sinks::zenoh::Zenoh::new(endpoint, domain, topics, wait).map(|made| Box::new(made) as _))
        }
        #[cfg(not(feature = "foxglove"))]
        Address::Foxglove { .. } => Err(not_built("foxglove")),
        #[cfg(not(feature = "ros2"))]
        Address::Ros2 => Err(not_built("ros2")),
        #[cfg(not(feature = "zenoh"))]
        Address::Zenoh { .. } => Err(not_built("zenoh")),
        Address::Stdout | Address::Stdio | Address::Udp { .. } | Address::Can { .. } | Address::CanOverUdp { .. } => {
            Err(Diagnostic::error("play/topics", "this sink has no topics").into())
        }
    }
}

/// The domain asked for, or that of ROS 2's own environment variable.
pub(super) fn domain(args: &SinkArgs) -> Result<u16, Diagnostics> {
    match (args.domain, std::env::var("ROS_DOMAIN_ID")) {
        (Some(domain), _) => Ok(domain),
        (None, Err(_)) => Ok(0),
        (None, Ok(text)) if text.is_empty() => Ok(0),
        (None, Ok(text)) => text.parse().ok().filter(|domain| *domain <= 232).ok_or_else(|| {
            Diagnostic::error("play/domain", format!("ROS_DOMAIN_ID is `{text}`, no number from 0 to 232")).into()
        }),
    }
}

pub(super) fn fault(error: SinkError) -> Diagnostics {
    Diagnostic::error("play/not-ready", error).into()
}

#[cfg(not(all(feature = "can", feature = "foxglove", feature = "ros2", feature = "zenoh", target_os = "linux")))]
pub(super) fn not_built(feature: &str) -> Diagnostics {
    let message = format!("this trajc was built without `{feature}`");
    let hint = format!("build it with: cargo install --path . --features {feature}");
    Diagnostic::error("play/not-built", message).hint(hint).into()
}
