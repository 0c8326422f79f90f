//! Ways of the joints while the base stands: what lies between two postures.

use std::cell::{Cell, OnceCell};

use nalgebra::{Isometry3, Vector3};

use super::super::joint_space::between;
use super::super::obstacles;
use super::super::placed::{Base, Placed, Posed};
use super::{Collider, Near, Sweep, TOO_HIGH};
use crate::geom::Pose2;

/// Between two looks at a robot that changes its posture nothing moves farther than this, m.
const LOOK: f64 = 0.02;
/// ... but there are no more looks than these.
const MOST_LOOKS: f64 = 500.0;

/// Looks at a way on which a shape moves so far, m.
fn looks(farthest: f64) -> usize {
    (farthest / LOOK).ceil().clamp(1.0, MOST_LOOKS) as usize
}

impl<const W: usize> Collider<'_, W> {
    /// Tells whether the straight way from one posture to another keeps the clearance of the moving shapes, the base standing: looked at
    /// so closely that no shape moves farther than [`LOOK`] unseen. The first posture is not looked at.
    pub fn clears(&self, pose: Pose2) -> impl Fn(&[f64], &[f64]) -> bool + '_ {
        // Other postures may reach farther than those that were sampled.
        const FARTHER: f64 = 0.5;
        let base: Base = pose.into();
        let near = OnceCell::new();
        let collected = move || {
            let mut region = self.region([pose.x, pose.y], [pose.x, pose.y], self.reach + self.clearance + FARTHER);
            (region.min[2], region.max[2]) = (region.min[2] - FARTHER, region.max[2] + FARTHER);
            let mut boxes = Vec::new();
            obstacles::collect(self.map, &region, &mut boxes);
            Near { boxes, hint: Cell::new(Vector3::x()) }
        };
        // By the distance field alone.
        let far = move |placed: &Placed, own: &Posed, moved: f64| {
            let field = self.esdf.distance(base.map(&own.centre)) - TOO_HIGH * self.map.resolution;
            field - placed.radius >= self.clearance + moved
        };
        move |a, b| {
            let after = self.robot.shape_poses(b);
            let travels = self.travels(&self.robot.shape_poses(a), &after);
            let at_risk = |(placed, moved): &(&Placed, f64)| !far(placed, &Posed::new(&after[placed.shape]), *moved);
            let at_risk: Vec<(&Placed, f64)> = self.moving.iter().zip(travels).filter(at_risk).collect();
            let farthest = at_risk.iter().map(|(_, moved)| *moved).fold(0.0, f64::max);
            let looks = looks(farthest);
            at_risk.is_empty()
                || (1..=looks).rev().all(|k| {
                    let poses = self.robot.shape_poses(&between(a, b, k as f64 / looks as f64));
                    at_risk.iter().all(|(placed, _)| {
                        let own = Posed::new(&poses[placed.shape]);
                        let end = own.under(&base);
                        let sweep = Sweep { ends: [end, end], bulge: 0.0 };
                        let gap = || self.exact_gap(placed, &sweep, near.get_or_init(collected), self.clearance);
                        far(placed, &own, 0.0) || gap().lower >= self.clearance
                    })
                })
        }
    }

    /// The same, and no links may touch.
    pub fn passes(&self, pose: Pose2) -> impl Fn(&[f64], &[f64]) -> bool + '_ {
        let clears = self.clears(pose);
        let pairs = self.robot.self_pairs();
        let apart = move |joints: &[f64]| pairs.is_empty() || self.robot.touching(&pairs, joints).is_none();
        move |a, b| {
            let [before, after] = [a, b].map(|joints| self.robot.shape_poses(joints));
            let farthest = self.travels(&before, &after).into_iter().fold(0.0, f64::max);
            let looks = looks(farthest);
            clears(a, b) && (1..=looks).rev().all(|k| apart(&between(a, b, k as f64 / looks as f64)))
        }
    }

    /// About how far any point of each moving shape moves from one place to another, m.
    fn travels(&self, from: &[Isometry3<f64>], to: &[Isometry3<f64>]) -> Vec<f64> {
        let of = |placed: &Placed| {
            let (from, to) = (&from[placed.shape], &to[placed.shape]);
            (from.translation.vector - to.translation.vector).norm()
                + placed.radius * from.rotation.angle_to(&to.rotation)
        };
        self.moving.iter().map(of).collect()
    }
}
