//! Outlines seen from above: of sets of cells, and of a robot in a posture.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::geom::Pose2;
use crate::math::real;
use crate::robot::RobotModel;

/// Directions in which a shape's outline is looked for.
const DIRECTIONS: usize = 64;

/// Outlines of the union of the cells for which `inside` holds, corners in cells: outer ones counter-clockwise, holes clockwise.
pub(super) fn of_cells(dims: [usize; 2], inside: impl Fn(usize, usize) -> bool) -> Vec<Vec<[usize; 2]>> {
    let filled = |i: Option<usize>, j: Option<usize>| match (i, j) {
        (Some(i), Some(j)) => i < dims[0] && j < dims[1] && inside(i, j),
        _ => false,
    };
    // Edges between inside and outside by where they begin; the inside is on their left.
    let mut edges: BTreeMap<[usize; 2], Vec<[usize; 2]>> = BTreeMap::new();
    for i in 0..dims[0] {
        for j in 0..dims[1] {
            if !inside(i, j) {
                continue;
            }
            let mut edge = |other: bool, from: [usize; 2], to: [usize; 2]| {
                if !other {
                    edges.entry(from).or_default().push(to);
                }
            };
            edge(filled(Some(i), j.checked_sub(1)), [i, j], [i + 1, j]);
            edge(filled(Some(i + 1), Some(j)), [i + 1, j], [i + 1, j + 1]);
            edge(filled(Some(i), Some(j + 1)), [i + 1, j + 1], [i, j + 1]);
            edge(filled(i.checked_sub(1), Some(j)), [i, j + 1], [i, j]);
        }
    }
    let mut loops = Vec::new();
    while let Some((&first, _)) = edges.first_key_value() {
        let mut corners: Vec<[usize; 2]> = Vec::new();
        let mut at = first;
        let straight = |a: [usize; 2], b: [usize; 2], c: [usize; 2]| (0..2).any(|k| a[k] == b[k] && b[k] == c[k]);
        // As many edges end at a corner as begin there, so the way on is missing only at the loop's own beginning.
        while let Some(next) = edges.get_mut(&at).and_then(Vec::pop) {
            if edges.get(&at).is_some_and(Vec::is_empty) {
                edges.remove(&at);
            }
            match corners[..] {
                [.., before, last] if straight(before, last, at) => *corners.last_mut().expect("two at least") = at,
                _ => corners.push(at),
            }
            at = next;
        }
        if let [.., before, last] = corners[..]
            && straight(before, last, first)
        {
            corners.pop();
        }
        loops.push(corners);
    }
    loops
}

/// A convex outline in the map frame, m, and whether the part is carried by the base itself, not by a moving joint.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Part {
    pub outline: Vec<[f64; 2]>,
    pub fixed: bool,
}

/// The robot's shapes at a pose with joint values `q`, seen from above.
pub(super) fn of_robot(robot: &RobotModel, pose: Pose2, q: &[f64]) -> Vec<Part> {
    let map_from_base = pose.isometry();
    let poses = robot.shape_poses(q);
    let part = |(shape, base_from_shape): (&crate::robot::Shape, &nalgebra::Isometry3<f64>)| {
        let map_from_shape = map_from_base * base_from_shape;
        let mut outline: Vec<[f64; 2]> = Vec::new();
        for k in 0..DIRECTIONS {
            // Half a step off the axes: a box's corners are found, not any point of its sides.
            let (sin, cos) = real::sin_cos(std::f64::consts::TAU * (k as f64 + 0.5) / DIRECTIONS as f64);
            let direction = map_from_shape.rotation.inverse() * Vector3::new(cos, sin, 0.0);
            let p = map_from_shape * nalgebra::Point3::from(shape.convex.support(&direction));
            if outline.last().is_none_or(|l| real::hypot(l[0] - p.x, l[1] - p.y) > 1e-6) {
                outline.push([p.x, p.y]);
            }
        }
        Part { outline, fixed: robot.bodies[shape.body].motion.is_none() }
    };
    let parts: Vec<Part> = robot.shapes.iter().zip(&poses).map(part).collect();
    // What lies within the outline of another part of the same kind adds nothing but ink: wheels below a base.
    let hidden = |k: usize| {
        let holds = |o: usize| parts[o].fixed == parts[k].fixed && within(&parts[k].outline, &parts[o].outline);
        (0..parts.len()).any(|o| o != k && holds(o) && !(o > k && within(&parts[o].outline, &parts[k].outline)))
    };
    (0..parts.len()).filter(|k| !hidden(*k)).map(|k| parts[k].clone()).collect()
}

/// Whether all points lie in a convex outline, counter-clockwise, or on its edge.
fn within(points: &[[f64; 2]], outline: &[[f64; 2]]) -> bool {
    let left = |a: &[f64; 2], b: &[f64; 2], p: &[f64; 2]| {
        (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) >= -1e-9
    };
    let edges = || outline.iter().zip(outline.iter().cycle().skip(1));
    points.iter().all(|p| edges().all(|(a, b)| left(a, b, p)))
}

/// Greatest height of the robot with joint values `q`, m.
pub fn top(robot: &RobotModel, q: &[f64]) -> f64 {
    let poses = robot.shape_poses(q);
    let height = |(shape, pose): (&crate::robot::Shape, &nalgebra::Isometry3<f64>)| {
        (pose * nalgebra::Point3::from(shape.convex.support(&(pose.rotation.inverse() * Vector3::z())))).z
    };
    robot.shapes.iter().zip(&poses).map(height).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twice the area inside, holes taken off.
    fn area(loops: &[Vec<[usize; 2]>]) -> i64 {
        let of = |l: &Vec<[usize; 2]>| -> i64 {
            let next = l.iter().cycle().skip(1);
            l.iter().zip(next).map(|(a, b)| a[0] as i64 * b[1] as i64 - b[0] as i64 * a[1] as i64).sum()
        };
        loops.iter().map(of).sum()
    }

    #[test]
    fn outlines_hold_exactly_the_cells_whatever_their_pattern() {
        // A ring with an island, cells that touch at corners, cells at the edge: all patterns of 4 x 4 bits from a fixed sequence.
        let mut state = 1u64;
        for _ in 0..500 {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let bits = state >> 39;
            let inside = |i: usize, j: usize| bits >> (5 * i + j) & 1 == 1;
            let loops = of_cells([5, 5], inside);
            let cells = (0..25).filter(|k| inside(k / 5, k % 5)).count() as i64;
            assert_eq!(area(&loops), 2 * cells, "{bits:b}");
        }
    }

    #[test]
    fn a_part_below_another_is_within_it_and_not_the_other_way_round() {
        let square = |half: f64| vec![[-half, -half], [half, -half], [half, half], [-half, half]];
        assert!(within(&square(1.0), &square(2.0)) && !within(&square(2.0), &square(1.0)));
    }

    #[test]
    fn a_block_is_four_corners_and_a_ring_two_outlines() {
        assert_eq!(
            of_cells([7, 7], |i, j| (2..5).contains(&i) && (1..4).contains(&j)),
            [[[2, 1], [5, 1], [5, 4], [2, 4]]]
        );
        assert_eq!(of_cells([3, 3], |i, j| [i, j] != [1, 1]).len(), 2);
        assert!(of_cells([3, 3], |_, _| false).is_empty());
    }
}
