//! `tolerance:` of a mission and of a robot.yaml: how far the real robot may be off the model. One table of keys for both.

use super::ToleranceSpec;
use crate::diag::shape::{Bounds, Field, Shape};
use crate::diag::yaml::Node;

/// How far a robot may be off its model. Every figure is a bound in both directions, but for `latency`, which is never negative. See
/// `docs/tolerance.md`.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tolerance {
    /// What both driving wheels' radii are off alike, as a share of the radius: `(right + left)/(2 r) - 1`.
    pub wheel_radius: f64,
    /// The right wheel's radius minus the left one's, as a share of the radius.
    pub wheel_difference: f64,
    /// Of the distance between the wheels, as a share of it.
    pub track: f64,
    /// Wheels and joints carry out the file late by this or less, s, each by a time of its own that does not change on the way.
    pub latency: f64,
    /// Distance of the base from the start, m.
    pub start_distance: f64,
    /// Of the heading at the start, rad.
    pub start_angle: f64,
}

impl Tolerance {
    /// What a report assumes where nobody says: a robot whose wheels were measured, not calibrated, put on a mark by hand.
    pub const ASSUMED: Self = Self {
        wheel_radius: 0.002,
        wheel_difference: 0.001,
        track: 0.01,
        latency: 0.02,
        start_distance: 0.01,
        start_angle: 0.01,
    };
}

impl ToleranceSpec {
    /// What holds where a mission says this and its robot.yaml that: the mission's keys win, keys that nobody gives are zero. `None`:
    /// neither has a `tolerance`.
    pub fn resolved(mission: Option<Self>, robot: Option<Self>) -> Option<Tolerance> {
        let (mission, robot) = match (mission, robot) {
            (None, None) => return None,
            (mission, robot) => (mission.unwrap_or_default(), robot.unwrap_or_default()),
        };
        let of = |key: fn(&Self) -> Option<f64>| key(&mission).or(key(&robot)).unwrap_or(0.0);
        Some(Tolerance {
            wheel_radius: of(|t| t.wheel_radius),
            wheel_difference: of(|t| t.wheel_difference),
            track: of(|t| t.track),
            latency: of(|t| t.latency),
            start_distance: of(|t| t.start_distance),
            start_angle: of(|t| t.start_angle),
        })
    }
}

const SHARE: Shape = Shape::Share(Bounds::between(0.0, 0.1, ""));

/// The keys of `tolerance:`.
pub(crate) static FIELDS: [Field; 6] = [
    Field::optional(
        "wheel_radius",
        SHARE,
        "0.2%",
        "what both driving wheels are larger or smaller alike, at most, as a share of the radius; default 0",
    ),
    Field::optional(
        "wheel_difference",
        SHARE,
        "0.1%",
        "difference of the right wheel's radius from the left one's, at most, as a share of the radius; default 0",
    ),
    Field::optional(
        "track",
        Shape::Share(Bounds::between(0.0, 0.5, "")),
        "1%",
        "what the track width is off, at most, as a share of it; default 0",
    ),
    Field::optional(
        "latency_s",
        Shape::Number(Bounds::between(0.0, 10.0, "s")),
        "0.02",
        "wheels and joints each carry out the file late by this or less, seconds; default 0",
    ),
    Field::optional(
        "start_m",
        Shape::Number(Bounds::between(0.0, 100.0, "m")),
        "0.01",
        "distance of the base from the start, at most, metres; default 0",
    ),
    Field::optional(
        "start_rad",
        Shape::Angle(Bounds::between(0.0, std::f64::consts::PI, "rad")),
        "0.01",
        "what the heading at the start is off, at most, radians or degrees; default 0",
    ),
];

/// `tolerance:`, as far as it is well formed.
pub(crate) fn read(tolerance: Option<&Node>) -> Option<ToleranceSpec> {
    let tolerance = tolerance?;
    let share = |key: &str| tolerance.get(key).and_then(Node::share);
    Some(ToleranceSpec {
        wheel_radius: share("wheel_radius"),
        wheel_difference: share("wheel_difference"),
        track: share("track"),
        latency: tolerance.get("latency_s").and_then(Node::number),
        start_distance: tolerance.get("start_m").and_then(Node::number),
        start_angle: tolerance.get("start_rad").and_then(Node::angle),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::render;

    fn mission(tolerance: &str) -> Result<Option<ToleranceSpec>, String> {
        let text = format!("robot: r.yaml\npath: {{file: p.csv}}\n{tolerance}");
        crate::mission::parse("m.yaml", &text).map(|m| m.tolerance).map_err(|faults| render(&faults, false))
    }

    #[test]
    fn shares_are_numbers_or_percent_and_absent_keys_are_left_to_the_robot() {
        let own = mission("tolerance: {wheel_radius: 0.2%, wheel_difference: 0.001, start_rad: 1deg}\n").expect("good");
        let own = own.expect("a tolerance");
        assert!((own.wheel_radius.expect("given") - 0.002).abs() < 1e-18);
        assert_eq!((own.wheel_difference, own.track), (Some(0.001), None));
        assert_eq!(own.start_angle, Some(1f64.to_radians()));
        let robot = ToleranceSpec { wheel_radius: Some(0.5), track: Some(0.03), ..ToleranceSpec::default() };
        let both = ToleranceSpec::resolved(Some(own), Some(robot)).expect("given");
        assert_eq!((both.wheel_radius, both.track, both.latency), (0.2 / 100.0, 0.03, 0.0));
        assert_eq!(ToleranceSpec::resolved(None, Some(robot)).map(|t| t.wheel_radius), Some(0.5));
        assert_eq!(ToleranceSpec::resolved(None, None), None);
        assert_eq!(mission("").expect("good"), None);
    }

    #[test]
    fn what_cannot_be_meant_is_refused_with_the_key() {
        for (wrong, word) in [
            ("tolerance: {wheel_radius: 20%}\n", "between 0 and 0.1"),
            ("tolerance: {track: -1%}\n", "between 0 and 0.5"),
            ("tolerance: {latency_s: 2%}\n", "latency_s"),
            ("tolerance: {wheel_radius: 0.2 %}\n", "without a space"),
            ("tolerance: {radius: 0.1%}\n", "wheel_radius"),
            ("tolerance: 1%\n", "wheel_difference"),
        ] {
            let said = mission(wrong).expect_err(wrong);
            assert!(said.contains(word), "{wrong}: {said}");
        }
    }
}
