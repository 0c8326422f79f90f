//! Frames of AgileX's protocol v2 that a TRACER base takes and sends (ugv_sdk, `protocol_v2`; TRACER user manual 1.2, section 3.3).
//! Standard identifiers, big-endian, two's complement.

/// What a PC sends to be obeyed: control mode.
pub const MODE: u16 = 0x421;
/// Motion command.
pub const MOTION: u16 = 0x111;
/// System state, from the base.
pub const STATE: u16 = 0x211;
/// The mode in which the base obeys CAN.
pub const BY_CAN: u8 = 1;
/// Seconds between motion commands. The base brakes by itself when it hears none for half a second.
pub const FRAME_TIME: f64 = 0.02;
/// m/s and rad/s of one unit.
pub const UNIT: f64 = 1e-3;

/// A CAN frame with a standard identifier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    /// 11 bits.
    pub id: u16,
    /// The first `length` count.
    pub data: [u8; 8],
    /// 0 to 8.
    pub length: u8,
}

impl Frame {
    /// The bytes that count.
    pub fn bytes(&self) -> &[u8] {
        &self.data[..usize::from(self.length.min(8))]
    }
}

/// Asks the base to obey CAN. One byte, as in the manual; the base takes eight as well.
pub fn mode_frame() -> Frame {
    Frame { id: MODE, data: [BY_CAN, 0, 0, 0, 0, 0, 0, 0], length: 1 }
}

/// A motion command in units of 1 mm/s and 1 mrad/s.
pub fn motion_frame([speed, turn_rate]: [i16; 2]) -> Frame {
    let [a, b] = speed.to_be_bytes();
    let [c, d] = turn_rate.to_be_bytes();
    Frame { id: MOTION, data: [a, b, c, d, 0, 0, 0, 0], length: 8 }
}

/// What the base says of itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct State {
    /// 0: normal, 1: emergency stop, 2: fault.
    pub vehicle: u8,
    /// 0: remote control, 1: CAN, 2: serial.
    pub mode: u8,
    /// Bit 0: battery too low, 1: battery warning, 2: remote control lost.
    pub faults: u8,
}

impl State {
    /// The state in a frame, if it is one.
    pub fn of(frame: &Frame) -> Option<Self> {
        match (frame.id, frame.bytes()) {
            (STATE, &[vehicle, mode, _, _, faults, ..]) => Some(Self { vehicle, mode, faults }),
            _ => None,
        }
    }

    /// What is wrong, in words; `None`: nothing.
    pub fn trouble(&self) -> Option<String> {
        let words = match self.vehicle {
            0 => return None,
            1 => "its emergency stop is pressed".to_owned(),
            2 => "it reports a fault".to_owned(),
            other => format!("it is in state {other}"),
        };
        let faults = [(1, "battery too low"), (2, "battery nearly empty"), (4, "remote control lost")];
        let named: Vec<&str> = faults.iter().filter(|(bit, _)| self.faults & bit != 0).map(|(_, name)| *name).collect();
        Some(if named.is_empty() { words } else { format!("{words} ({})", named.join(", ")) })
    }
}

/// Turns held commands into frames of whole units without losing anything: what rounding takes from one frame is put into the next.
/// The integral of what was sent stays within half a unit times [`FRAME_TIME`] of what was commanded.
#[derive(Debug, Clone, Copy, Default)]
pub struct Diffuser {
    /// Held now: m/s, rad/s.
    held: [f64; 2],
    /// Sent last, in units.
    sent: [i16; 2],
    /// Up to which time the debt is known, s.
    known: f64,
    /// What the robot was commanded to travel but was not sent: m, rad.
    debt: [f64; 2],
}

impl Diffuser {
    /// From `at` on this is held.
    pub fn hold(&mut self, at: f64, held: [f64; 2]) {
        self.advance(at);
        self.held = held;
    }

    fn advance(&mut self, to: f64) {
        let time = (to - self.known).max(0.0);
        for axis in 0..2 {
            self.debt[axis] += time * (self.held[axis] - f64::from(self.sent[axis]) * UNIT);
        }
        self.known = self.known.max(to);
    }

    /// The frame to send at `at`, for [`FRAME_TIME`]: the mean of what is held in that time, `next` being held from its time on, and the
    /// debt. A command of zero is sent as zero.
    pub fn frame(&mut self, at: f64, next: Option<(f64, [f64; 2])>) -> [i16; 2] {
        self.advance(at);
        for axis in 0..2 {
            // More than a unit is no rounding but a frame that came late: making up for it would be a jump.
            self.debt[axis] = self.debt[axis].clamp(-UNIT * FRAME_TIME, UNIT * FRAME_TIME);
            let share = next.map_or(0.0, |(from, _)| ((at + FRAME_TIME - from) / FRAME_TIME).clamp(0.0, 1.0));
            let then = next.map_or(0.0, |(_, held)| held[axis]);
            let mean = (1.0 - share) * self.held[axis] + share * then;
            let units = (mean + self.debt[axis] / FRAME_TIME) / UNIT;
            self.sent[axis] = if mean == 0.0 { 0 } else { units.round().clamp(-32767.0, 32767.0) as i16 };
        }
        self.sent
    }
}

#[cfg(test)]
mod tests;
