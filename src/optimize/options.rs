//! What can be set, with defaults that suit rooms and robots of about half a metre.

use super::objective::Weights;
use super::steer::SteerOptions;
use crate::math::lbfgs::LbfgsOptions;
use crate::mission::{Parameterisation, SpeedZone};

/// How to optimise.
#[derive(Debug, Clone, PartialEq)]
pub struct OptimizeOptions {
    /// What the polynomials are of. Default [`Parameterisation::DEFAULT`].
    pub parameterisation: Parameterisation,
    /// How heading and arc length are optimised; the other options below are of the flat parameterisation.
    pub steer: SteerOptions,
    /// Clearance to aim at, m: what must be certified plus a margin for what sampling misses. Default 0.05.
    pub clearance: f64,
    /// A leg that ends with less than `clearance - clearance_tolerance` (m) at its contour points is cut, and the robot stops where
    /// it was worst. Default 0.02.
    pub clearance_tolerance: f64,
    /// Dense sampling on (\[SCR\] section IV-C). Default true.
    pub dense: bool,
    /// kappa: sparse samples a piece. Default 14.
    pub samples_per_piece: usize,
    /// kappa': dense samples a sparse interval; made even. Default 4.
    pub dense_samples: usize,
    /// v_la as a share of the speed limit: dense sampling below it. Default 0.35.
    pub dense_below: f64,
    /// Distance between contour points on edges, m. `None`: the cell of the distance field, within 3 and 8 cm.
    pub contour_spacing: Option<f64>,
    /// Weight of the energy against time, for limits of any size; larger is smoother and slower. At the default, 0.03, a
    /// straight of 4 m takes about 1.3 / v_max a metre, ramps from and to rest included.
    pub smoothness: f64,
    /// a_0 of the penalties, relative to each limit. Default 0.1.
    pub penalty_width: f64,
    /// Weight of the motion limits at the first pass, s. Default 40.
    pub motion_weight: f64,
    /// Weight of clearance at the first pass, s. Default 200.
    pub clearance_weight: f64,
    /// A violation of clearance counts in units of this, m. Default 0.05.
    pub clearance_scale: f64,
    /// Passes, each with weights `weight_growth` times the last where limits are still overstepped. Default 3.
    pub passes: usize,
    /// See `passes`. Default 4.
    pub weight_growth: f64,
    /// A limit may be overstepped by this share before another pass. Default 0.02.
    pub motion_tolerance: f64,
    /// Clearance may be missed by this, m, before another pass. Default 0.002.
    pub pass_clearance_tolerance: f64,
    /// Length of pieces on straights, m: one of degree 7 serves far. Default 1.6.
    pub piece_length: f64,
    /// Waypoints stand this far from a corner, m, or 0.4 of the neighbouring straight. Default 0.25.
    pub corner_distance: f64,
    /// A corner that could only be rounded at less than this share of the speed limit is a stop and a spin. Default 0.2.
    pub slowest_corner: f64,
    /// Spins larger than this in the interior are driven as spins, rad. Default 100 degrees.
    pub spin_threshold: f64,
    /// The same at start and goal, where the position is fixed. Default 45 degrees.
    pub end_spin_threshold: f64,
    /// Where the base is to be slow; of heading and arc length alone. Default: nowhere.
    pub zones: Vec<SpeedZone>,
    /// The iteration.
    pub lbfgs: LbfgsOptions,
}

impl OptimizeOptions {
    /// The defaults, but every turn becomes part of a smooth curve, however tight: \[SCR\]'s way, which can all but stop and turn on
    /// a radius of `v_min` by the turn rate allowed (section V-C). Slower to find than turns on the spot.
    pub fn without_spins() -> Self {
        let any = 2.0 * std::f64::consts::PI;
        Self { spin_threshold: any, end_spin_threshold: any, slowest_corner: 0.0, ..Self::default() }
    }
}

impl Default for OptimizeOptions {
    fn default() -> Self {
        Self {
            parameterisation: Parameterisation::DEFAULT,
            steer: SteerOptions::default(),
            clearance: 0.05,
            clearance_tolerance: 0.02,
            dense: true,
            samples_per_piece: 14,
            dense_samples: 4,
            dense_below: 0.35,
            contour_spacing: None,
            smoothness: 0.03,
            penalty_width: 0.1,
            motion_weight: 40.0,
            clearance_weight: 200.0,
            clearance_scale: 0.05,
            passes: 3,
            weight_growth: 4.0,
            motion_tolerance: 0.02,
            pass_clearance_tolerance: 0.002,
            piece_length: 1.6,
            corner_distance: 0.25,
            slowest_corner: 0.2,
            spin_threshold: 100f64.to_radians(),
            end_spin_threshold: 45f64.to_radians(),
            zones: Vec::new(),
            lbfgs: LbfgsOptions { memory: 20, decrease_tolerance: 5e-4, past: 8, ..LbfgsOptions::default() },
        }
    }
}

impl OptimizeOptions {
    /// Weights of the first pass.
    pub(crate) fn weights(&self) -> Weights {
        Weights { motion: self.motion_weight, clearance: self.clearance_weight, dense: self.motion_weight }
    }
}
