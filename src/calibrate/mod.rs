//! Wheel radii and track width from a log of wheel angles and poses, with what remains uncertain.
//!
//! Poses are taken in pairs some time apart, each pose in one pair, so that errors of pairs do not depend on each other. Between the two
//! the wheels' angles are driven along exact arcs; what the measured motion differs from that, weighed by the poses' own noise, is made
//! least: Gauss-Newton on the three parameters, each pair weighed down by Huber's function where it is an outlier (Huber 1981,
//! section 7). The covariance is the sandwich of the weighed pairs (Huber 1967; White 1980): it needs no scale of the noise, and stays
//! right where that was guessed wrong.
//!
//! What is not seen: slip that all motions share is taken for a smaller wheel, which is right as long as the floor stays the same.

mod bag;
mod log;
mod rewrite;

use nalgebra::{Matrix3, Vector3};

use crate::geom::{Pose2, wrap_angle};
use crate::math::real;

pub use bag::{BagError, Topics, read_mcap};
pub use log::{Log, LogError, read_csv};
pub use rewrite::{RewriteError, rewrite};

/// Between the poses of a pair, s.
const APART: f64 = 3.0;
/// Huber's constant: whitened pairs longer than this count less. Of a chi of three degrees, 2.5 is exceeded by one in ten.
const HUBER: f64 = 2.5;
/// Most Gauss-Newton steps, and the relative step at which they end.
const STEPS: (usize, f64) = (50, 1e-12);
/// Fewest pairs.
const FEWEST: usize = 12;
/// What must have been driven: m by each wheel's rim, and rad turned.
const DRIVEN: (f64, f64) = (1.0, 3.0);
/// A relative standard deviation beyond this is no measurement.
const UNKNOWN: f64 = 0.05;

/// Radii of the left and the right wheel and the track width, m.
pub type Geometry = [f64; 3];

/// What poses of a log are worth: standard deviations of coordinates (m) and headings (rad). Only their ratio matters much.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseNoise {
    /// m.
    pub metres: f64,
    /// rad.
    pub radians: f64,
}

impl Default for PoseNoise {
    /// 5 mm and half a degree.
    fn default() -> Self {
        Self { metres: 0.005, radians: 0.5f64.to_radians() }
    }
}

/// A calibration.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Radii of the left and the right wheel and the track width, m.
    pub geometry: Geometry,
    /// Of the geometry, m^2.
    pub covariance: [[f64; 3]; 3],
    /// Pairs of poses used.
    pub pairs: usize,
    /// Pairs that were weighed down.
    pub outliers: usize,
    /// Root of the mean square of the pairs that were not: 1 where the poses' noise is as said.
    pub residual: f64,
}

/// What is left to tolerate after a calibration, as shares: three standard deviations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Remaining {
    /// Of the radius of both wheels.
    pub wheel_radius: f64,
    /// Of how much the right wheel is larger than the left one.
    pub wheel_difference: f64,
    /// Of the track.
    pub track: f64,
}

impl Fit {
    /// The mean radius, m.
    pub fn radius(&self) -> f64 {
        0.5 * (self.geometry[0] + self.geometry[1])
    }

    /// The share by which the right wheel is larger than the left one.
    pub fn difference(&self) -> f64 {
        (self.geometry[1] - self.geometry[0]) / self.radius()
    }

    /// The share to reckon with from here on: what was found, unless the log does not tell it from none. An error of it bends every straight line, and
    /// most robots' wheels are alike.
    pub fn larger_right(&self) -> f64 {
        let [_, deviation, _] = self.deviations();
        if self.difference().abs() > 3.0 * deviation { self.difference() } else { 0.0 }
    }

    /// Standard deviations of mean radius, difference (share) and track: m, 1, m.
    pub fn deviations(&self) -> [f64; 3] {
        let c = &self.covariance;
        let along = |w: [f64; 3]| {
            let sum: f64 = (0..3).flat_map(|i| (0..3).map(move |j| (i, j))).map(|(i, j)| w[i] * c[i][j] * w[j]).sum();
            sum.max(0.0).sqrt()
        };
        let each = 1.0 / self.radius();
        [along([0.5, 0.5, 0.0]), along([-each, each, 0.0]), along([0.0, 0.0, 1.0])]
    }

    /// What is left to tolerate.
    pub fn remaining(&self) -> Remaining {
        let [radius, difference, track] = self.deviations();
        Remaining {
            wheel_radius: 3.0 * radius / self.radius(),
            wheel_difference: 3.0 * difference + (self.difference() - self.larger_right()).abs(),
            track: 3.0 * track / self.geometry[2],
        }
    }
}

/// Why a log says nothing about the drive.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CalibrateError {
    /// Too short.
    #[error(
        "the log has {found} pairs of poses {APART} s apart with wheel angles around them, at least {FEWEST} are needed"
    )]
    Short {
        /// Pairs.
        found: usize,
    },
    /// The wheels hardly turn.
    #[error("the wheels roll {0:.2} m in this log: their radii do not show")]
    Still(f64),
    /// It hardly turns.
    #[error("the robot turns {0:.2} rad in this log: its track does not show")]
    Straight(f64),
    /// A parameter that the motions do not determine.
    #[error("{what} is not determined by this log: known to {share:.0} % only", share = 100.0 * share)]
    Undetermined {
        /// Which.
        what: &'static str,
        /// Its relative standard deviation.
        share: f64,
    },
    /// It does not come to an end, or far from where it began.
    #[error(
        "no radii and track explain this log: are wheel angles and poses of the same clock, in radians and metres?"
    )]
    Unexplained,
}

impl CalibrateError {
    /// What to do about it.
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Short { .. } => "log for half a minute or longer: poses and wheel angles on one clock",
            Self::Still(_) => "drive some metres straight ahead as well",
            Self::Straight(_) | Self::Undetermined { .. } => {
                "drive missions/calibrate.yaml, or straight ahead, spins to both sides and bends to both sides"
            }
            Self::Unexplained => "compare a row of the log with what the robot did",
        }
    }
}

/// A pair of poses, and what the wheels did in between.
struct Pair {
    /// Increments of the wheels' angles, in order.
    turns: Vec<[f64; 2]>,
    /// The second pose seen from the first.
    measured: Vector3<f64>,
    /// What whitens a difference from it.
    whiten: Matrix3<f64>,
}

/// The motion that increments of wheel angles make.
fn driven(turns: &[[f64; 2]], [left, right, track]: Geometry) -> Pose2 {
    turns.iter().fold(Pose2::default(), |pose, turn| {
        let [a, b] = [left * turn[0], right * turn[1]];
        pose.after_twist(0.5 * (a + b), (b - a) / track, 1.0)
    })
}

impl Pair {
    fn whitened(&self, geometry: Geometry) -> Vector3<f64> {
        let model = driven(&self.turns, geometry);
        let off = self.measured - Vector3::new(model.x, model.y, model.yaw);
        self.whiten * Vector3::new(off.x, off.y, wrap_angle(off.z))
    }

    /// Derivatives of the whitened difference by the geometry: central differences of a smooth function of three lengths.
    fn jacobian(&self, geometry: Geometry) -> Matrix3<f64> {
        let column = |k: usize| {
            let step = 1e-5 * geometry[k];
            let at = |sign: f64| {
                let mut moved = geometry;
                moved[k] += sign * step;
                self.whitened(moved)
            };
            (at(1.0) - at(-1.0)) / (2.0 * step)
        };
        Matrix3::from_columns(&[column(0), column(1), column(2)])
    }
}

/// Coordinates of a pose in the frame of another, m.
fn seen_from(frame: Pose2, pose: Pose2) -> [f64; 2] {
    let (sin, cos) = real::sin_cos(frame.yaw);
    let (dx, dy) = (pose.x - frame.x, pose.y - frame.y);
    [cos * dx + sin * dy, cos * dy - sin * dx]
}

/// Pairs each pose of a log with one about [`APART`] later; each is used once.
fn pairs(log: &Log, guess: Geometry, noise: PoseNoise) -> Vec<Pair> {
    let poses: Vec<_> = log.poses.iter().filter(|(time, _)| log.covers(*time)).collect();
    let mut used = vec![false; poses.len()];
    let mut out = Vec::new();
    let mut next = 0;
    for first in 0..poses.len() {
        if used[first] {
            continue;
        }
        next = next.max(first + 1);
        while next < poses.len() && (used[next] || poses[next].0 - poses[first].0 < APART) {
            next += 1;
        }
        let Some((until, second)) = poses.get(next) else { break };
        if until - poses[first].0 > 2.0 * APART {
            continue;
        }
        (used[first], used[next]) = (true, true);
        let (from, pose) = poses[first];
        let turns = log.turns(*from, *until);
        let off = seen_from(*pose, *second);
        // Turned to the nearest that the wheels make: a pair may turn by more than half a turn.
        let about = driven(&turns, guess).yaw;
        let measured = Vector3::new(off[0], off[1], about + wrap_angle(second.yaw - pose.yaw - about));
        // To first order: both positions, both headings; the first heading turns what is seen.
        let seen = Vector3::new(off[1], -off[0], -1.0);
        let (m2, r2) = (real::powi(noise.metres, 2), real::powi(noise.radians, 2));
        let mut spread = Matrix3::from_diagonal(&Vector3::new(2.0 * m2, 2.0 * m2, r2));
        spread += seen * seen.transpose() * r2;
        let Some(whiten) = spread.cholesky().and_then(|c| c.l().try_inverse()) else { continue };
        out.push(Pair { turns, measured, whiten });
    }
    out
}

/// Radii and track that explain a log best. `guess`: the file's.
///
/// # Errors
/// A log that is too short, or whose motions do not determine all three.
pub fn fit(log: &Log, guess: Geometry, noise: PoseNoise) -> Result<Fit, CalibrateError> {
    let pairs = pairs(log, guess, noise);
    if pairs.len() < FEWEST {
        return Err(CalibrateError::Short { found: pairs.len() });
    }
    let of = |figure: &dyn Fn(&[f64; 2]) -> f64| pairs.iter().flat_map(|p| &p.turns).map(figure).sum::<f64>();
    let rolled = of(&|turn| 0.5 * (guess[0] * turn[0] + guess[1] * turn[1]).abs());
    let turned = of(&|turn| ((guess[1] * turn[1] - guess[0] * turn[0]) / guess[2]).abs());
    if rolled.max(0.5 * turned * guess[2]) < DRIVEN.0 {
        return Err(CalibrateError::Still(rolled));
    }
    if turned < DRIVEN.1 {
        return Err(CalibrateError::Straight(turned));
    }
    let mut geometry = guess;
    for _ in 0..STEPS.0 {
        let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
        for pair in &pairs {
            let (off, jacobian) = (pair.whitened(geometry), pair.jacobian(geometry));
            let weight = weight(&off);
            normal += jacobian.transpose() * jacobian * weight;
            right -= jacobian.transpose() * off * weight;
        }
        let step = normal.cholesky().ok_or(CalibrateError::Unexplained)?.solve(&right);
        (0..3).for_each(|k| geometry[k] += step[k]);
        if (0..3).any(|k| !(0.5..2.0).contains(&(geometry[k] / guess[k]))) {
            return Err(CalibrateError::Unexplained);
        }
        if (0..3).all(|k| step[k].abs() < STEPS.1 * geometry[k]) {
            break;
        }
    }
    let fit = judged(&pairs, geometry).ok_or(CalibrateError::Unexplained)?;
    let [radius, difference, track] = fit.deviations();
    let shares = [("the wheels' radius", radius / fit.radius()), ("the wheels' difference", difference)];
    let track = ("the track", track / fit.geometry[2]);
    match shares.into_iter().chain([track]).find(|(_, share)| share.is_nan() || *share > UNKNOWN) {
        Some((what, share)) => Err(CalibrateError::Undetermined { what, share }),
        None => Ok(fit),
    }
}

/// Huber's weight of a pair.
fn weight(off: &Vector3<f64>) -> f64 {
    (HUBER / off.norm().max(1e-300)).min(1.0)
}

/// The fit at its parameters, with its covariance.
fn judged(pairs: &[Pair], geometry: Geometry) -> Option<Fit> {
    let (mut bread, mut filling, mut squares, mut outliers) = (Matrix3::zeros(), Matrix3::zeros(), 0.0, 0);
    for pair in pairs {
        let (off, jacobian) = (pair.whitened(geometry), pair.jacobian(geometry));
        let weight = weight(&off);
        bread += jacobian.transpose() * jacobian * weight;
        let pull = jacobian.transpose() * off * weight;
        filling += pull * pull.transpose();
        if weight < 1.0 {
            outliers += 1;
        } else {
            squares += off.norm_squared();
        }
    }
    let count = pairs.len() as f64;
    let inverse = bread.try_inverse()?;
    // Three parameters were fitted to so many pairs of three figures each.
    let covariance = inverse * filling * inverse * (3.0 * count / (3.0 * count - 3.0));
    let residual = (squares / (3.0 * (count - outliers as f64)).max(1.0)).sqrt();
    let rows = [0, 1, 2].map(|i| [0, 1, 2].map(|j| covariance[(i, j)]));
    Some(Fit { geometry, covariance: rows, pairs: pairs.len(), outliers, residual })
}

#[cfg(test)]
mod tests;
