//! CAN frames in UDP datagrams, as the program cannelloni has them (version 2): it carries them to a CAN interface elsewhere.
//!
//! Byte 0: version, 1: operation (0: data), 2: sequence number, 3 and 4: number of frames, big-endian. A frame: four bytes of identifier,
//! big-endian, its upper bits flags; one byte of length; data.

use std::net::UdpSocket;

use super::can::CanBus;
use super::tracer::Frame;
use super::udp;
use crate::play::sink::SinkError;

const VERSION: u8 = 2;
const DATA: u8 = 0;
/// Flags of an identifier: extended, remote, error.
const FLAGS: u32 = 0xe000_0000;
/// Flag of a length: CAN FD.
const FD: u8 = 0x80;

/// A bus at the other end of a tunnel.
#[derive(Debug)]
pub struct Cannelloni {
    socket: UdpSocket,
    to: String,
    sequence: u8,
}

impl Cannelloni {
    /// A tunnel to `HOST:PORT`; answers come in on the local port.
    ///
    /// # Errors
    /// No such host, the port is taken.
    pub fn new(to: &str, local: u16) -> Result<Self, SinkError> {
        let socket = udp::connect(to, local)?;
        let unblocked = socket.set_nonblocking(true);
        unblocked.map_err(|error| SinkError::NotReady(format!("udp://{to}: {error}")))?;
        Ok(Self { socket, to: to.to_owned(), sequence: 0 })
    }
}

impl CanBus for Cannelloni {
    fn name(&self) -> String {
        format!("udp://{}", self.to)
    }

    fn send(&mut self, frame: &Frame) -> std::io::Result<()> {
        let bytes = datagram(self.sequence, frame);
        self.sequence = self.sequence.wrapping_add(1);
        self.socket.send(&bytes).map(|_| ())
    }

    fn receive(&mut self) -> std::io::Result<Vec<Frame>> {
        let mut bytes = [0; 2048];
        match self.socket.recv(&mut bytes) {
            Ok(length) => Ok(frames(&bytes[..length])),
            Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => Ok(Vec::new()),
            Err(error) => Err(error),
        }
    }
}

/// A datagram with one frame.
pub fn datagram(sequence: u8, frame: &Frame) -> Vec<u8> {
    let mut bytes = vec![VERSION, DATA, sequence, 0, 1];
    bytes.extend(u32::from(frame.id).to_be_bytes());
    bytes.push(frame.length.min(8));
    bytes.extend(frame.bytes());
    bytes
}

/// The standard data frames of a datagram. What is of another kind is left out, what is cut short ends it.
pub fn frames(bytes: &[u8]) -> Vec<Frame> {
    let &[VERSION, DATA, _, high, low, ref rest @ ..] = bytes else { return Vec::new() };
    let mut rest = rest;
    let mut found = Vec::new();
    for _ in 0..u16::from_be_bytes([high, low]) {
        let &[a, b, c, d, length, ref behind @ ..] = rest else { break };
        let id = u32::from_be_bytes([a, b, c, d]);
        let behind = if length & FD == 0 { behind } else { behind.get(1..).unwrap_or_default() };
        let size = usize::from(length & !FD);
        let Some((data, others)) = behind.split_at_checked(size) else { break };
        rest = others;
        let standard = id & FLAGS == 0 && length & FD == 0 && size <= 8;
        if let (true, Ok(id)) = (standard, u16::try_from(id)) {
            let mut padded = [0; 8];
            padded[..size].copy_from_slice(data);
            found.push(Frame { id, data: padded, length });
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::super::tracer::{mode_frame, motion_frame};
    use super::*;

    #[test]
    fn a_datagram_is_cannellonis_byte_for_byte() {
        assert_eq!(datagram(7, &mode_frame()), [2, 0, 7, 0, 1, 0, 0, 0x04, 0x21, 1, 1]);
        let motion = datagram(255, &motion_frame([500, -2]));
        assert_eq!(motion, [2, 0, 255, 0, 1, 0, 0, 0x01, 0x11, 8, 0x01, 0xf4, 0xff, 0xfe, 0, 0, 0, 0]);
    }

    #[test]
    fn frames_are_read_and_other_kinds_left_out() {
        let mut bytes = vec![2, 0, 9, 0, 4];
        bytes.extend([0x80, 0, 0x02, 0x11, 1, 5]); // extended
        bytes.extend([0, 0, 0x02, 0x11, 0x82, 0, 1, 2]); // CAN FD, with its byte of flags
        bytes.extend([0, 0, 0x02, 0x11, 2, 3, 4]);
        bytes.extend([0, 0, 0x01, 0x23, 0]);
        let wanted = [
            Frame { id: 0x211, data: [3, 4, 0, 0, 0, 0, 0, 0], length: 2 },
            Frame { id: 0x123, data: [0; 8], length: 0 },
        ];
        assert_eq!(frames(&bytes), wanted);
    }

    #[test]
    fn no_datagram_makes_it_stumble() {
        let whole = datagram(0, &motion_frame([1, 2]));
        (0..whole.len()).for_each(|cut| assert_eq!(frames(&whole[..cut]), [], "{cut}"));
        assert_eq!(frames(&[2, 0, 0, 255, 255]), []);
        assert_eq!(frames(&[3, 0, 0, 0, 1, 0, 0, 1, 0x11, 0]), [], "another version");
        assert_eq!(frames(&[2, 0, 0, 0, 1, 0, 0, 1, 0x11, 9, 1, 2, 3, 4, 5, 6, 7, 8, 9]), [], "nine bytes");
    }
}
