//! Upright boxes and cylinders of the base: lines that cover them, balls inside them.

use nalgebra::{Isometry3, Point3};

use super::ContourPoint;
use super::surface::{disc_points, rectangle_points, steps};
use crate::robot::{Convex, RobotModel, Shape};

/// Cosine of an angle that counts as upright.
const UPRIGHT: f64 = 1.0 - 1e-9;

/// A box or cylinder of the base that stands upright.
pub(super) struct Upright {
    /// From its own axes to the map's, but for the base's pose.
    pose: Isometry3<f64>,
    /// From the base's body to the same.
    origin: Isometry3<f64>,
    plan: Plan,
    half_height: f64,
}

/// What an upright shape looks like from above.
enum Plan {
    /// Along two of its axes.
    Rectangle {
        axes: [usize; 2],
        half: [f64; 2],
    },
    Disc {
        radius: f64,
    },
}

impl Upright {
    pub(super) fn new(robot: &RobotModel, shape: &Shape) -> Option<Self> {
        let origin = robot.bodies[0].origin;
        let pose = origin * shape.pose;
        let axis = |k: usize| pose.rotation.to_rotation_matrix()[(2, k)].abs();
        let (plan, half_height) = match &shape.convex {
            Convex::Box { half } => {
                let up = (0..3).find(|k| axis(*k) > UPRIGHT)?;
                let axes = [(up + 1) % 3, (up + 2) % 3];
                (Plan::Rectangle { axes, half: axes.map(|a| half[a]) }, half[up])
            }
            Convex::Cylinder { radius, half_length } if axis(2) > UPRIGHT => {
                (Plan::Disc { radius: *radius }, *half_length)
            }
            _ => return None,
        };
        Some(Self { pose, origin, plan, half_height })
    }

    /// Upright lines that cover it.
    pub(super) fn lines(&self, spacing: f64) -> Vec<ContourPoint> {
        let feet: Vec<[f64; 3]> = match &self.plan {
            Plan::Rectangle { axes, half } => {
                rectangle_points(*half, spacing).into_iter().map(|at| on_axes(*axes, at)).collect()
            }
            Plan::Disc { radius } => disc_points(*radius, spacing),
        };
        let weight = 0.5 * (steps(2.0 * self.half_height, spacing) + 1) as f64;
        feet.into_iter().map(|foot| self.line(foot, 0.0, weight)).collect()
    }

    /// Balls inside it, slid up and down as far as they stay inside, so close that none of its inside is further from them than they
    /// reach; none where they would be smaller than what the rim sees.
    pub(super) fn inside(&self, spacing: f64) -> Vec<ContourPoint> {
        let least = match &self.plan {
            Plan::Rectangle { half, .. } => half[0].min(half[1]),
            Plan::Disc { radius } => *radius,
        };
        let radius = self.half_height.min(0.5 * least);
        if radius < spacing {
            return Vec::new();
        }
        let apart = INSIDE * radius;
        let feet: Vec<[f64; 3]> = match &self.plan {
            Plan::Rectangle { axes, half } => {
                let half = half.map(|h| h - radius);
                let n = half.map(|h| steps(2.0 * h, apart));
                let place = |index: [usize; 2]| [0, 1].map(|a| half[a] * (2.0 * index[a] as f64 / n[a] as f64 - 1.0));
                let all = (0..=n[0]).flat_map(|i| (0..=n[1]).map(move |j| [i, j]));
                all.map(|index| on_axes(*axes, place(index))).collect()
            }
            Plan::Disc { radius: whole } => disc_points(whole - radius, 0.5 * apart),
        };
        // As many points as the lines that they stand beside.
        let weight = 0.5 * (steps(2.0 * self.half_height, spacing) + 1) as f64;
        feet.into_iter().map(|foot| self.line(foot, radius, weight)).collect()
    }

    /// A line from bottom to top, but for a radius at both ends.
    fn line(&self, foot: [f64; 3], radius: f64, weight: f64) -> ContourPoint {
        let half = (self.half_height - radius).max(0.0);
        let at = self.pose * Point3::from(foot) - nalgebra::Vector3::z() * half;
        ContourPoint { at: self.origin.inverse_transform_point(&at), radius, rise: 2.0 * half, weight }
    }
}

/// Balls inside a shape are so many of their radii apart: a square of them leaves no hole.
const INSIDE: f64 = 1.4;

fn on_axes(axes: [usize; 2], at: [f64; 2]) -> [f64; 3] {
    let mut place = [0.0; 3];
    (place[axes[0]], place[axes[1]]) = (at[0], at[1]);
    place
}
