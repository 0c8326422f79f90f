//! Speed zones: how fast the base may be depends on where it is. Of motions planned by heading and arc length; positions as polynomials know
//! nothing of zones, the time law slows them down.

use crate::geom::nearest_in_area;
use crate::math::real;
use crate::mission::SpeedZone;

/// What is allowed where.
#[derive(Debug, Clone, PartialEq)]
pub struct ZonePenalty {
    zones: Vec<SpeedZone>,
    /// What the base brakes by, m/s^2.
    braking: f64,
}

impl ZonePenalty {
    /// `braking`: the base's acceleration limit, m/s^2.
    pub fn new(zones: &[SpeedZone], braking: f64) -> Self {
        Self { zones: zones.to_vec(), braking }
    }

    /// The square of the speed allowed at a place and its gradient, m^2/s^2, m/s^2: in a zone the zone's, at the distance d from it what the
    /// base can brake from, v^2 + 2 a d, so that it is continuous. `None`: there is no zone.
    pub fn square_at(&self, place: [f64; 2]) -> Option<(f64, [f64; 2])> {
        let at = |zone: &SpeedZone| {
            let foot = nearest_in_area(place, &zone.polygon);
            let off = [place[0] - foot[0], place[1] - foot[1]];
            let distance = real::hypot(off[0], off[1]);
            let slope = if distance > 0.0 { off.map(|o| 2.0 * self.braking * o / distance) } else { [0.0; 2] };
            (zone.speed * zone.speed + 2.0 * self.braking * distance, slope)
        };
        self.zones.iter().map(at).min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::fd::{numeric_gradient, relative_error};
    use proptest::prelude::*;

    fn penalty() -> ZonePenalty {
        let zone = |polygon: &[[f64; 2]], speed| SpeedZone { polygon: polygon.to_vec(), speed };
        let bent = zone(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.5, 0.2], [0.0, 1.0]], 0.2);
        ZonePenalty::new(&[bent, zone(&[[1.5, 0.0], [2.0, 0.0], [2.0, 0.5]], 0.1)], 0.4)
    }

    #[test]
    fn a_zones_speed_holds_within_it_and_braking_leads_to_it() {
        assert_eq!(penalty().square_at([0.1, 0.1]), Some((0.2 * 0.2, [0.0; 2])));
        let (square, slope) = penalty().square_at([-1.0, 0.5]).expect("zones");
        assert!((square - (0.04 + 0.8)).abs() < 1e-12 && (slope[0] + 0.8).abs() < 1e-12 && slope[1].abs() < 1e-12);
        assert_eq!(ZonePenalty::new(&[], 1.0).square_at([0.0; 2]), None);
    }

    proptest! {
        #[test]
        fn its_gradient_matches_finite_differences(x in -1.0..3.0f64, y in -1.0..2.0f64) {
            let penalty = penalty();
            let square = |z: &[f64]| penalty.square_at([z[0], z[1]]).expect("zones").0;
            // Not where two zones or two sides are equally near, nor at an edge: there are kinks.
            let slope = |dx: f64, dy: f64| penalty.square_at([x + dx, y + dy]).expect("zones").1;
            let kink = [(1e-3, 0.0), (-1e-3, 0.0), (0.0, 1e-3), (0.0, -1e-3)].iter().any(|(dx, dy)| {
                let (a, b) = (slope(*dx, *dy), slope(0.0, 0.0));
                real::hypot(a[0] - b[0], a[1] - b[1]) > 0.05
            });
            prop_assume!(!kink);
            let numeric = numeric_gradient(square, &[x, y], 1e-5);
            prop_assert!(relative_error(&slope(0.0, 0.0), &numeric, 1e-2) < 1e-5, "{numeric:?}");
        }
    }
}
