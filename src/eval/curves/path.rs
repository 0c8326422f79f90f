//! The suite's paths, and what independent solvers found on them.

use serde::Deserialize;
use std::collections::BTreeMap;

/// Paths of \[CONV\] section 3, as numpy, casadi and toppra drove them.
const LAWS: &str = include_str!("../../../tests/vectors/time_laws.json");
/// Hairpins, likewise.
const TIGHT: &str = include_str!("../../../tests/vectors/tight_curves.json");

/// A path of the suite.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// As files are named: `c_curve`.
    pub id: &'static str,
    /// As people say.
    pub title: &'static str,
    /// Cubic Bezier segments, m.
    pub segments: Vec<[[f64; 2]; 4]>,
    /// m.
    pub length: f64,
    /// m.
    pub least_radius: f64,
    /// Least time under wheel speed, acceleration and jerk limits by an independent solver, s.
    pub optimum: f64,
    /// Least time without the jerk limit by toppra, s: no law can beat it.
    pub lower_bound: f64,
    /// Figures of \[CONV\] that show a robot without Eq. 5, which misses the end point, and one with it, which does not: all that
    /// the paper says of them. It prints no time, no peak and no distance.
    pub paper: Option<[&'static str; 2]>,
}

/// The paper's curves (its control points are not printed but for the ends: these have the ends), then the tight ones.
pub fn suite() -> Vec<Curve> {
    let [laws, tight] = [LAWS, TIGHT].map(|text| serde_json::from_str::<Solved>(text).expect("our own vectors").paths);
    let curve = |of: &BTreeMap<String, Path>, id: &'static str, title, paper| {
        let path = &of[id];
        let [optimum, lower_bound] = [&path.optimum, &path.toppra].map(|t| t.as_ref().map_or(f64::NAN, |t| t.time));
        Curve {
            id,
            title,
            segments: path.control_points.clone(),
            length: path.length,
            least_radius: 1.0 / path.max_curvature,
            optimum,
            lower_bound,
            paper,
        }
    };
    vec![
        curve(&laws, "c_curve", "C-curve", Some(["Fig. 2, 4", "Fig. 3, 5"])),
        curve(&laws, "s_curve", "S-curve", Some(["Fig. 7, 9", "Fig. 8, 10"])),
        curve(&laws, "arbitrary", "Arbitrary path", Some(["Fig. 12, 14", "Fig. 13, 15"])),
        curve(&tight, "hairpin_100mm", "Hairpin of a quarter of the track", None),
        curve(&tight, "hairpin_20mm", "Hairpin of a twentieth of the track", None),
    ]
}

#[derive(Deserialize)]
struct Solved {
    paths: BTreeMap<String, Path>,
}

#[derive(Deserialize)]
struct Path {
    control_points: Vec<[[f64; 2]; 4]>,
    length: f64,
    max_curvature: f64,
    toppra: Option<Time>,
    optimum: Option<Time>,
}

#[derive(Deserialize)]
struct Time {
    time: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mission::{self, PathSpec};

    #[test]
    fn the_papers_curves_are_those_of_the_shipped_missions() {
        let missions = [
            include_str!("../../../missions/c_curve.yaml"),
            include_str!("../../../missions/s_curve.yaml"),
            include_str!("../../../missions/arbitrary.yaml"),
        ];
        for (curve, text) in suite().iter().zip(missions) {
            let mission = mission::parse("mission.yaml", text).unwrap();
            assert_eq!(mission.path, Some(PathSpec::Bezier(curve.segments.clone())), "{}", curve.id);
        }
    }

    #[test]
    fn bounds_are_in_order_and_hairpins_tighter_than_half_the_track() {
        for curve in suite() {
            assert!(curve.lower_bound < curve.optimum, "{}", curve.id);
            assert_eq!(curve.least_radius < 0.2, curve.paper.is_none(), "{}", curve.id);
        }
    }
}
