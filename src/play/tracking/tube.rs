//! How far from the planned path the robot may be.

use super::law::error;
use crate::geom::Pose2;
use crate::math::real;
use crate::play::motion::Motion;

/// Seconds of path behind the reference that a robot that lags may be at.
const BEHIND: f64 = 2.0;
/// Between the places on the path that are looked at, s.
const SPACING: f64 = 0.05;

/// Room at a time of the file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Room {
    /// As the motion counts it, s: of one that is slowed, in its own time.
    pub time: f64,
    /// Most that any point of the robot may be off, m.
    pub metres: f64,
    /// Most that the heading may be off, rad.
    pub radians: f64,
}

/// The room around a path over its time: linear between its knots, constant before and behind them.
///
/// A robot at a distance `d` from a planned pose, turned by `a` against it, has no point farther than `d + reach |a|` from where it is
/// planned. This must not exceed the room.
#[derive(Debug, Clone, PartialEq)]
pub struct Tube {
    knots: Vec<Room>,
    /// Greatest distance of a point of the robot from the base's vertical axis, m.
    reach: f64,
}

impl Tube {
    /// The same room everywhere.
    pub fn constant(metres: f64, radians: f64, reach: f64) -> Self {
        Self { knots: vec![Room { time: 0.0, metres, radians }], reach }
    }

    /// Room that changes along the path; `knots` are in order of time. `None`: there are none.
    pub fn new(knots: Vec<Room>, reach: f64) -> Option<Self> {
        (!knots.is_empty()).then_some(Self { knots, reach })
    }

    /// The room at a time.
    pub fn room(&self, time: f64) -> Room {
        let next = self.knots.partition_point(|knot| knot.time <= time);
        let (Some(before), Some(after)) = (next.checked_sub(1).map(|k| self.knots[k]), self.knots.get(next)) else {
            let nearest = if next == 0 { self.knots[0] } else { self.knots[next - 1] };
            return Room { time, ..nearest };
        };
        let share = (time - before.time) / (after.time - before.time);
        let between = |a: f64, b: f64| a + share * (b - a);
        Room { time, metres: between(before.metres, after.metres), radians: between(before.radians, after.radians) }
    }

    /// How far the robot is outside: the largest of metres over room and radians over room, 1 at the border. Of a robot that lags only
    /// what is off the path counts, not that it is late. `time` is that of the reference, as the motion counts it.
    pub fn filled(&self, motion: &Motion, time: f64, robot: Pose2) -> f64 {
        let places = (BEHIND / SPACING) as usize;
        (0..=places)
            .map(|k| time - k as f64 * SPACING)
            .take_while(|at| *at > -SPACING)
            .map(|at| {
                let at = at.max(0.0);
                let off = error(motion.pose(at / motion.table().sampling_time), robot);
                let room = self.room(at);
                let moved = real::hypot(off.along, off.across) + self.reach * off.heading.abs();
                (moved / room.metres).max(off.heading.abs() / room.radians)
            })
            .fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::play::fixtures::drive;

    #[test]
    fn room_is_linear_between_its_knots_and_constant_beyond() {
        let knots = vec![Room { time: 1.0, metres: 0.1, radians: 0.2 }, Room { time: 3.0, metres: 0.3, radians: 0.1 }];
        let tube = Tube::new(knots, 0.4).expect("knots");
        let at = |time| (tube.room(time).metres, tube.room(time).radians);
        assert_eq!((at(0.0), at(1.0), at(9.0)), ((0.1, 0.2), (0.1, 0.2), (0.3, 0.1)));
        let (metres, radians) = at(2.5);
        assert!((metres - 0.25).abs() < 1e-15 && (radians - 0.125).abs() < 1e-15);
        assert_eq!(Tube::new(Vec::new(), 0.4), None);
    }

    #[test]
    fn lag_is_no_departure_but_a_step_to_the_side_and_a_turn_are() {
        let motion = Motion::new(drive(900));
        let tube = Tube::constant(0.1, 0.5, 0.4);
        let (time, behind) = (4.0, motion.pose(350.0));
        assert!(tube.filled(&motion, time, behind) < 0.02, "half a second late");
        let place = motion.pose(400.0);
        let (sin, cos) = real::sin_cos(place.yaw);
        let aside = |d: f64| Pose2::new(place.x - d * sin, place.y + d * cos, place.yaw);
        assert!((tube.filled(&motion, time, aside(0.05)) - 0.5).abs() < 0.02);
        assert!(tube.filled(&motion, time, aside(0.12)) > 1.0);
        let turned = Pose2 { yaw: place.yaw + 0.2, ..place };
        assert!(tube.filled(&motion, time, turned) > 0.7, "0.4 m * 0.2 rad of 0.1 m");
    }
}
