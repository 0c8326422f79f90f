//! One JSON object a datagram: `seq`, and the columns of `commands.csv`.

use std::net::{SocketAddr, ToSocketAddrs, UdpSocket};

use super::stdout::json;
use crate::command::CommandTable;
use crate::play::sink::{Command, Sink, SinkError};

/// Sends each command when it is due.
#[derive(Debug)]
pub struct UdpSink {
    socket: UdpSocket,
    to: String,
    columns: Vec<String>,
}

impl UdpSink {
    /// A sink that sends to `HOST:PORT`.
    ///
    /// # Errors
    /// No such host; no socket to be had.
    pub fn new(to: &str) -> Result<Self, SinkError> {
        let socket = connect(to, 0)?;
        Ok(Self { socket, to: to.to_owned(), columns: Vec::new() })
    }
}

/// A socket from a local port (0: any) to `HOST:PORT`, which it alone hears.
pub(super) fn connect(to: &str, local: u16) -> Result<UdpSocket, SinkError> {
    let not_ready = |error: std::io::Error| SinkError::NotReady(format!("cannot send to udp://{to}: {error}"));
    let address = to.to_socket_addrs().map_err(not_ready)?.next();
    let address = address.ok_or_else(|| SinkError::NotReady(format!("udp://{to} has no address")))?;
    let any: SocketAddr = match address {
        SocketAddr::V4(_) => ([0, 0, 0, 0], local).into(),
        SocketAddr::V6(_) => ([0u16; 8], local).into(),
    };
    let socket = UdpSocket::bind(any)
        .map_err(|error| SinkError::NotReady(format!("cannot listen on UDP port {local}: {error}")))?;
    socket.connect(address).map_err(not_ready)?;
    Ok(socket)
}

impl Sink for UdpSink {
    fn announce(&mut self, plan: &CommandTable) -> Result<(), SinkError> {
        self.columns = crate::emit::csv::columns(plan);
        Ok(())
    }

    fn send(&mut self, command: &Command<'_>, _at: f64) -> Result<(), SinkError> {
        let sent = self.socket.send(json(&self.columns, command).as_bytes());
        // The system tells of a host that refused the datagram before: nobody listens there.
        sent.map(|_| ())
            .map_err(|error| SinkError::Lost(format!("nobody takes commands at udp://{}: {error}", self.to)))
    }
}
