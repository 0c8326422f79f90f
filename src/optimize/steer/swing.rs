//! How far joints move the robot's shapes.

use nalgebra::{Isometry3, Point3};

use super::layout::Layout;
use crate::optimize::contour::Contour;
use crate::robot::RobotModel;

/// Steps in which a way is measured.
const STEPS: usize = 4;

/// Measures ways in the base frame.
pub(super) struct Swing<'a> {
    robot: &'a RobotModel,
    /// Body, and centre of a ball that holds the shape, of those that joints move.
    shapes: Vec<(usize, Point3<f64>)>,
    poses: Vec<Isometry3<f64>>,
    joints: Vec<f64>,
}

impl<'a> Swing<'a> {
    pub fn new(robot: &'a RobotModel, contour: &Contour) -> Self {
        let moving = contour.shapes.iter().filter(|shape| shape.body != 0);
        let centre =
            |body: usize, shape: &[crate::optimize::contour::Patch]| shape.first().map(|whole| (body, whole.centre));
        let shapes = moving.filter_map(|shape| centre(shape.body, &shape.patches)).collect();
        Self { robot, shapes, poses: Vec::new(), joints: Vec::new() }
    }

    /// The longest way of a shape's centre while the joints go straight from a piece's first node to its last, m.
    pub fn of(&mut self, layout: Layout, piece: usize, x: &[f64]) -> f64 {
        let mut ways = vec![0.0; self.shapes.len()];
        let mut before: Vec<Point3<f64>> = Vec::new();
        for step in 0..=STEPS {
            let share = step as f64 / STEPS as f64;
            let value = |dimension: usize| {
                let [from, to] = [piece, piece + 1].map(|node| x[layout.state(node, dimension, 0)]);
                from + share * (to - from)
            };
            self.joints.clear();
            self.joints.extend((2..layout.dimensions).map(value));
            self.robot.body_poses(&self.joints, &mut self.poses);
            let now: Vec<_> = self.shapes.iter().map(|(body, centre)| self.poses[*body] * centre).collect();
            for ((way, from), to) in ways.iter_mut().zip(&before).zip(&now) {
                *way += (to - from).norm();
            }
            before = now;
        }
        ways.into_iter().fold(0.0, f64::max)
    }
}
