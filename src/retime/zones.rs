//! Speed limits by place.
//!
//! A zone's limit holds in its polygon. Outside it is continued by what the base can brake from, sqrt(v^2 + 2 a d) at the distance d, so
//! that it is continuous in the place, as a time law wants it. Along a leg it is one more row of rates: the speed as a share of what is
//! allowed where the base is then, with the limit 1.

use super::limits::RowLimits;
use super::timed_leg::TimedLeg;
use crate::geom::distance_to_area;
use crate::mission::SpeedZone;
use crate::robot::RobotModel;

/// Profiles are made for so much less than is allowed: sampling corrects speeds a little.
const SHARE: f64 = 0.995;
/// Zones are larger by this, m, and by what is driven in them while a command is held: that command is held before, and after, too.
const MARGIN: f64 = 5e-3;
/// Between the points at which the least time is made it may go beyond its rows by a little.
const PLANNED: f64 = 0.998;

/// The zones of a mission, for a robot and a sampling time.
#[derive(Debug, Clone, Copy)]
pub struct Zones<'a> {
    zones: &'a [SpeedZone],
    /// m/s^2.
    braking: f64,
    /// s.
    hold: f64,
}

impl<'a> Zones<'a> {
    /// `hold`: for how long a command is held, s.
    pub fn new(zones: &'a [SpeedZone], robot: &RobotModel, hold: f64) -> Self {
        Self { zones, braking: robot.wheel.planning()[1].min(robot.base.acceleration), hold }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.zones.is_empty()
    }

    /// What is allowed at a place, m/s; infinite without zones.
    pub fn speed_at(&self, place: [f64; 2]) -> f64 {
        let at = |zone: &SpeedZone| {
            let speed = SHARE * zone.speed;
            let beyond = distance_to_area(place, &zone.polygon) - MARGIN - speed * self.hold;
            (speed * speed + 2.0 * self.braking * beyond.max(0.0)).sqrt()
        };
        self.zones.iter().map(at).fold(f64::INFINITY, f64::min)
    }

    /// Appends the row to the rates at a time since the leg's start, before its slow-down, whose (left, right) begin at `first`.
    pub fn append(&self, leg: &TimedLeg, t: f64, first: usize, rates: &mut Vec<[f64; 3]>) {
        if !self.is_empty() {
            let speed = 0.5 * (rates[first][0] + rates[first + 1][0]).abs();
            let pose = leg.pose(t * leg.stretch);
            rates.push([speed / self.speed_at([pose.x, pose.y]), 0.0, 0.0]);
        }
    }

    /// The limit of that row.
    pub fn limit(&self, rows: &mut Vec<RowLimits>) {
        if !self.is_empty() {
            rows.push([Some(1.0), None, None]);
        }
    }

    /// The same for planning, less by a factor.
    pub fn planning(&self, tighter: f64, rows: &mut Vec<[f64; 3]>) {
        if !self.is_empty() {
            rows.push([PLANNED / tighter, f64::INFINITY, f64::INFINITY]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trajectory::fixtures;

    fn zone(low: f64, high: f64, speed: f64) -> SpeedZone {
        SpeedZone { polygon: vec![[low, -1.0], [high, -1.0], [high, 1.0], [low, 1.0]], speed }
    }

    #[test]
    fn what_is_allowed_is_continuous_in_the_place_and_is_the_zones_within_it() {
        let robot = fixtures::conv();
        let all = [zone(1.0, 2.0, 0.2), zone(1.5, 3.0, 0.1)];
        let zones = Zones::new(&all, &robot, 0.1);
        assert!((zones.speed_at([1.2, 0.0]) - SHARE * 0.2).abs() < 0.02);
        assert_eq!(zones.speed_at([1.7, 0.0]), SHARE * 0.1, "the slower one of two");
        let mut before = zones.speed_at([-2.0, 0.3]);
        for k in 1..=6000 {
            let now = zones.speed_at([-2.0 + 1e-3 * f64::from(k), 0.3]);
            // At most the slope where the braking begins: a / v a metre.
            assert!((now - before).abs() <= 1e-3 * zones.braking / (SHARE * 0.1) * 1.01, "{k}");
            before = now;
        }
        assert_eq!(Zones::new(&[], &robot, 0.1).speed_at([0.0; 2]), f64::INFINITY);
    }

    #[test]
    fn outside_a_zone_as_much_is_allowed_as_can_be_braked_from() {
        let robot = fixtures::conv();
        let (all, hold) = ([zone(1.0, 2.0, 0.2)], 0.1);
        let zones = Zones::new(&all, &robot, hold);
        for before in [0.05, 0.3, 1.5] {
            // Braking at 0.2 m/s^2 from there: as slow as the zone asks for a command's way and 5 mm before it.
            let (allowed, own) = (zones.speed_at([1.0 - before, 0.0]), 0.995 * 0.2);
            let way = (allowed * allowed - own * own) / (2.0 * 0.2);
            assert!((way + hold * own + 5e-3 - before).abs() < 1e-9, "{before}: {way}");
        }
    }

    #[test]
    fn rows_are_there_where_zones_are_and_allow_less_the_tighter_they_are_asked_for() {
        let robot = fixtures::conv();
        let all = [zone(1.0, 2.0, 0.2)];
        for (zones, expected) in [(&all[..0], vec![]), (&all[..], vec![PLANNED / 2.0])] {
            let zones = Zones::new(zones, &robot, 0.1);
            assert_eq!(zones.is_empty(), expected.is_empty());
            let (mut planned, mut limited) = (Vec::new(), Vec::new());
            zones.planning(2.0, &mut planned);
            zones.limit(&mut limited);
            assert_eq!(planned.iter().map(|row| row[0]).collect::<Vec<_>>(), expected);
            assert_eq!(limited.len(), expected.len());
        }
    }
}
