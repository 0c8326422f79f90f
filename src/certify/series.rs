//! Distances at instants, for pictures: exact at each, and no proof of anything between them.

use super::clearance::{beyond, gap};
use super::distance::Posed;
use super::motion::Kinematics;
use super::obstacles::Obstacles;
use super::rollout::Rollout;
use crate::command::CommandTable;
use crate::geom::{Aabb, Pose2};
use crate::map::VoxelMap;
use crate::robot::RobotModel;

/// What is nearest at an instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Instant {
    /// s.
    pub time: f64,
    /// From the robot's surface to the nearest obstacle, m; not positive: how deep it is in one of those that it meets; infinite: farther
    /// than was looked.
    pub distance: f64,
}

/// The robot's distance from the map's obstacles (unseen space beyond the map included, where it counts) when every `every`-th row
/// begins, and when the last one does: the replay from `start` and `start_joints`. Distances beyond `reach` (m) are not looked for.
///
/// Empty for a table that has no rows or other joints than the robot.
pub fn distances(
    table: &CommandTable,
    robot: &RobotModel,
    map: &VoxelMap,
    (start, start_joints): (Pose2, &[f64]),
    every: usize,
    reach: f64,
) -> Vec<Instant> {
    let count = robot.joints.len();
    if start_joints.len() != count || table.rows.iter().any(|row| row.joint_velocities.len() != count) {
        return Vec::new();
    }
    let rollout = Rollout::new(table, start, start_joints);
    let last = rollout.rows().saturating_sub(1);
    let rows = (0..last).step_by(every.max(1)).chain((rollout.rows() > 0).then_some(last));
    let mut near = Near { kinematics: Kinematics::new(robot), obstacles: Obstacles::new(map), found: Vec::new() };
    let mut hint = None;
    rows.map(|row| {
        let shapes = near.shapes(&rollout, row);
        let (distance, nearest) = near.distance(&shapes, reach, hint);
        hint = nearest;
        let distance = if distance > reach { f64::INFINITY } else { distance };
        Instant { time: rollout.time(row, 0.0), distance }
    })
    .collect()
}

struct Near<'a> {
    kinematics: Kinematics<'a>,
    obstacles: Obstacles<'a>,
    found: Vec<Aabb>,
}

impl<'a> Near<'a> {
    /// All shapes when a row begins.
    fn shapes(&self, rollout: &Rollout<'_>, row: usize) -> Vec<Posed<'a>> {
        let mut bodies = Vec::new();
        self.kinematics.bodies(rollout.joints(row), rollout.held(row), &mut bodies);
        let pose = rollout.pose(row, 0.0);
        (0..self.kinematics.shape_count()).map(|s| self.kinematics.shape(s, &bodies, pose, 0.0).posed).collect()
    }

    /// The least distance that is not beyond `reach` (or any that is), and the box that it is from. `hint`: the box that was nearest an instant before, whose distance now says how
    /// far one must look.
    fn distance(&mut self, shapes: &[Posed<'_>], reach: f64, hint: Option<Aabb>) -> (f64, Option<Aabb>) {
        let bounds: Vec<Aabb> = shapes.iter().map(Posed::bounds).collect();
        let Some(all) = bounds.iter().copied().reduce(union) else { return (f64::INFINITY, None) };
        let sides = bounds.iter().flat_map(|b| self.obstacles.edges.iter().map(|edge| beyond(edge, b)));
        let mut least = (sides.fold(f64::INFINITY, f64::min), None);
        if let Some(nearest) = hint {
            shapes.iter().for_each(|shape| improve(&mut least, shape, &nearest));
        }
        self.found.clear();
        self.obstacles.near(&all.grown(least.0.min(reach).max(0.0)), &mut self.found);
        for (shape, bounds) in shapes.iter().zip(&bounds) {
            let mut order: Vec<(f64, &Aabb)> = self.found.iter().map(|b| (gap(bounds, b), b)).collect();
            order.retain(|(gap, _)| *gap <= least.0.min(reach));
            order.sort_by(|a, b| a.0.total_cmp(&b.0));
            for (gap, obstacle) in order {
                if least.0 <= 0.0 || gap > least.0 {
                    break;
                }
                improve(&mut least, shape, obstacle);
            }
        }
        least
    }
}

fn improve(least: &mut (f64, Option<Aabb>), shape: &Posed<'_>, obstacle: &Aabb) {
    let found = shape.separation(obstacle);
    let distance = if found.normal.is_some() { found.upper } else { 0.0 - shape.depth(obstacle) };
    if distance < least.0 {
        *least = (distance, Some(*obstacle));
    }
}

fn union(a: Aabb, b: Aabb) -> Aabb {
    Aabb { min: std::array::from_fn(|i| a.min[i].min(b.min[i])), max: std::array::from_fn(|i| a.max[i].max(b.max[i])) }
}

#[cfg(test)]
mod tests {
    use nalgebra::Isometry3;

    use super::*;
    use crate::certify::tests::robots::{bare_robot, commands, with_joint, with_shape};
    use crate::mission::Unknown;
    use crate::robot::Convex;

    #[test]
    fn distances_in_an_obstacle_are_how_deep_it_is() {
        let robot =
            with_shape(bare_robot(), 0, Isometry3::translation(0.0, 0.0, 0.2), Convex::Box { half: [0.2, 0.2, 0.1] });
        let mut map = VoxelMap::new(0.1, [-1.0, -1.0, 0.0], [20, 20, 5], Unknown::Free);
        (0..20).for_each(|j| (15..20).for_each(|i| (0..5).for_each(|k| map.occupy([i, j, k])))); // from x = 0.5
        let start = Pose2::new(0.25, 0.0, 0.0);
        let (table, _) = commands(&robot, start, &[], 0.1, &vec![(0.5, 0.0, vec![]); 3]);
        let found = distances(&table, &robot, &map, (start, &[]), 1, 1.0);
        // The front begins 5 cm before the wall and drives 5 cm a row.
        for (instant, expected) in found.iter().zip([0.05, 0.0, -0.05, -0.1]) {
            assert!((instant.distance - expected).abs() < 1e-7, "{found:?}");
        }
    }

    #[test]
    fn a_table_without_rows_or_with_other_joints_has_no_distances() {
        let robot = with_joint(bare_robot(), false);
        let map = VoxelMap::new(0.1, [0.0; 3], [4, 4, 4], Unknown::Free);
        let (table, _) = commands(&robot, Pose2::default(), &[0.3], 0.1, &[]);
        let count = |table: &CommandTable, joints: &[f64]| {
            distances(table, &robot, &map, (Pose2::default(), joints), 1, 1.0).len()
        };
        assert_eq!(count(&table, &[0.3]), 1);
        assert_eq!(count(&table, &[]), 0);
        let mut other = table.clone();
        other.rows[0].joint_velocities.push(0.0);
        assert_eq!(count(&other, &[0.3]), 0);
        other.rows.clear();
        assert_eq!(count(&other, &[0.3]), 0);
    }
}
