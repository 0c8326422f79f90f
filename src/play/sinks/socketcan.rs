//! A CAN interface of Linux.

use ::socketcan::{CanFrame, CanSocket, EmbeddedFrame, Socket, StandardId};

use super::can::CanBus;
use super::tracer::Frame;
use crate::play::sink::SinkError;

/// An open interface, such as `can0`.
pub struct SocketCan {
    socket: CanSocket,
    interface: String,
}

impl SocketCan {
    /// Opens an interface, which must be up.
    ///
    /// # Errors
    /// No such interface, or no CAN in the system.
    pub fn new(interface: &str) -> Result<Self, SinkError> {
        let not_ready = |error: std::io::Error| {
            SinkError::NotReady(format!(
                "cannot open CAN interface `{interface}`: {error} (up? ip link set {interface} up type can bitrate 500000)"
            ))
        };
        let socket = CanSocket::open(interface).map_err(not_ready)?;
        socket.set_nonblocking(true).map_err(not_ready)?;
        Ok(Self { socket, interface: interface.to_owned() })
    }
}

impl CanBus for SocketCan {
    fn name(&self) -> String {
        self.interface.clone()
    }

    fn send(&mut self, frame: &Frame) -> std::io::Result<()> {
        let frame = StandardId::new(frame.id).and_then(|id| CanFrame::new(id, frame.bytes()));
        let frame = frame.ok_or_else(|| std::io::Error::other("no standard frame"))?;
        self.socket.write_frame(&frame)
    }

    fn receive(&mut self) -> std::io::Result<Vec<Frame>> {
        match self.socket.read_frame() {
            Ok(frame) => Ok(read(&frame).into_iter().collect()),
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => Ok(Vec::new()),
            Err(error) => Err(error),
        }
    }
}

/// A standard data frame as one of ours.
fn read(frame: &CanFrame) -> Option<Frame> {
    let CanFrame::Data(frame) = frame else { return None };
    let ::socketcan::Id::Standard(id) = frame.id() else { return None };
    let mut data = [0; 8];
    data.get_mut(..frame.data().len())?.copy_from_slice(frame.data());
    Some(Frame { id: id.as_raw(), data, length: frame.data().len() as u8 })
}

#[cfg(test)]
mod tests {
    use super::super::tracer::motion_frame;
    use super::*;

    #[test]
    fn frames_are_the_same_in_the_systems_own_type() {
        let ours = motion_frame([-3, 700]);
        let system = CanFrame::new(StandardId::new(ours.id).expect("11 bits"), ours.bytes()).expect("8 bytes");
        assert_eq!(read(&system), Some(ours));
        assert_eq!((system.raw_id(), system.data()), (0x111, ours.bytes()));
    }
}
