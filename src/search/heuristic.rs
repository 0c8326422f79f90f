//! Cost to go in the plane: the least distance that the centre of a disc, which the robot holds inside in every posture, must
//! travel to where it is at the goal. Driving and spinning move the centre no farther than they cost, so it is a lower bound
//! but for the eight directions; where it says that a position is shut off, no motion of the robot gets there.

use super::lattice::Lattice;
use super::{Query, region};
use crate::esdf::{self, Esdf};
use crate::geom::Pose2;
use crate::map::VoxelMap;
use crate::math::real;
use crate::robot::{Convex, RobotModel};

/// A disc inside one of the robot's rigid shapes at every height of a range: an obstacle at such a height must keep off it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Core {
    /// Centre in the base frame, m.
    pub offset: [f64; 2],
    /// m.
    pub radius: f64,
    /// Heights, m.
    pub heights: [f64; 2],
}

impl Core {
    /// The largest such disc among upright boxes, upright cylinders and spheres; else a point of the first rigid shape.
    pub fn new(robot: &RobotModel) -> Self {
        let mut best: Option<Self> = None;
        for shape in robot.shapes.iter().filter(|s| s.body == 0) {
            let pose = robot.bodies[0].origin * shape.pose;
            let centre = pose.translation.vector;
            let up = pose.rotation * nalgebra::Vector3::z();
            let upright = up.z.abs() > 1.0 - 1e-9;
            let (radius, half_height) = match &shape.convex {
                Convex::Box { half } if upright => (half[0].min(half[1]), half[2]),
                Convex::Cylinder { radius, half_length } if upright => (*radius, *half_length),
                // At its widest; a sphere's own height range shrinks with the disc.
                Convex::Sphere { radius } => (0.9 * radius, 0.4 * radius),
                _ => (0.0, 0.0),
            };
            let core = Self {
                offset: [centre.x, centre.y],
                radius,
                heights: [centre.z - half_height, centre.z + half_height],
            };
            if best.is_none_or(|b| core.radius > b.radius) {
                best = Some(core);
            }
        }
        best.unwrap_or(Self { offset: [0.0; 2], radius: 0.0, heights: [0.1, 0.1] })
    }

    /// Clearance with the centre at a position, m: a guess from the field at one height. The ball there that is as wide as the
    /// disc does not rise above the robot's own shape, where its height allows.
    pub fn guessed_clearance(&self, esdf: &Esdf, [x, y]: [f64; 2]) -> f64 {
        let [low, high] = self.heights;
        let z = (high - self.radius).clamp(low, 0.5 * (low + high));
        esdf.distance([x, y, z]) - self.radius
    }

    /// Where the centre is in a pose.
    pub fn centre(&self, pose: Pose2) -> [f64; 2] {
        let (sin, cos) = real::sin_cos(pose.yaw);
        let [x, y] = self.offset;
        [pose.x + cos * x - sin * y, pose.y + sin * x + cos * y]
    }
}

/// Clearance of the core with its centre at each lattice position, m; exact at the map's nodes.
pub(super) fn core_clearance(lattice: &Lattice, map: &VoxelMap, core: &Core) -> Vec<f32> {
    let flat = esdf::build(&flattened(map, core.heights));
    let mut out = Vec::with_capacity(lattice.size[0] as usize * lattice.size[1] as usize);
    for i in 0..lattice.size[0] {
        for j in 0..lattice.size[1] {
            let [x, y] = lattice.position(i, j);
            out.push((flat.distance([x, y, 0.0]) - core.radius) as f32);
        }
    }
    out
}

/// One layer of cells: occupied where a cell of the column meets the heights.
fn flattened(map: &VoxelMap, heights: [f64; 2]) -> VoxelMap {
    let mut flat =
        VoxelMap::new(map.resolution, [map.origin[0], map.origin[1], 0.0], [map.dims[0], map.dims[1], 1], map.outside);
    let cell = |z: f64| (z - map.origin[2]) / map.resolution;
    // A cell that only touches the range from above or below is not beside the disc.
    let first = (cell(heights[0]) + 1e-6).floor().max(0.0) as usize;
    let end = ((cell(heights[1]) - 1e-6).ceil().max(0.0) as usize).min(map.dims[2]);
    for i in 0..map.dims[0] {
        for j in 0..map.dims[1] {
            let column = map.column(i, j);
            if (first..end).any(|k| column[k / 64] >> (k % 64) & 1 == 1) {
                flat.occupy([i, j, 0]);
            }
        }
    }
    flat
}

/// Distances to the goal in lattice steps.
pub(super) struct CostToGo {
    /// By lattice index, in tenths of a step; `u32::MAX`: shut off.
    tenths: Vec<u32>,
    step: f64,
    core: Core,
}

/// Steps to the eight neighbours, with their length in tenths.
pub(super) const NEIGHBOURS: [(i32, i32, u32); 8] =
    [(1, 0, 10), (0, 1, 10), (-1, 0, 10), (0, -1, 10), (1, 1, 14), (1, -1, 14), (-1, 1, 14), (-1, -1, 14)];

/// Least clearance of the core, as interpolated at a lattice position, with which its centre may pass within 0.71 steps.
pub(super) fn least_clearance(lattice: &Lattice, resolution: f64, clearance: f64) -> f32 {
    let on_nodes = (lattice.step / resolution + 1e-6).fract() < 2e-6;
    let slack = 0.71 * lattice.step + if on_nodes { 0.0 } else { 0.87 * resolution };
    (clearance - slack) as f32 - 1e-5
}

impl CostToGo {
    /// Distances of the core's centre from everywhere to where it is at the goal, through where it keeps `clearance`.
    pub fn new(lattice: &Lattice, core: (Core, &[f32]), resolution: f64, clearance: f64, query: &Query) -> Self {
        let (core, clearances) = core;
        let Query { goal, goal_yaw, .. } = *query;
        let least = least_clearance(lattice, resolution, clearance);
        let mut tenths = vec![u32::MAX; clearances.len()];
        // Dial's buckets: all steps are 10 or 14.
        let mut buckets: [Vec<(i32, i32)>; 16] = Default::default();
        // Lattice positions around the centre at the goal; around the whole circle of them where any heading will do.
        let turns = if goal_yaw.is_some() { 1 } else { 72 };
        // Of a region all where the core may be, if it is within the region: there the way ends.
        let reach = region::reach(query) / lattice.step;
        for k in 0..turns {
            let yaw = goal_yaw.unwrap_or(std::f64::consts::TAU * f64::from(k) / f64::from(turns));
            let centre = core.centre(Pose2 { yaw, ..goal });
            let at = lattice.coordinates(centre[0], centre[1]);
            let range = |d: usize| (at[d] - reach).floor() as i32..=(at[d] + reach).ceil() as i32;
            for (i, j) in range(0).flat_map(|i| range(1).map(move |j| (i, j))) {
                if !lattice.contains(i, j) || tenths[lattice.index(i, j)] == 0 {
                    continue;
                }
                let off = real::hypot(f64::from(i) - at[0], f64::from(j) - at[1]);
                if reach == 0.0 || off <= reach + 1.42 && clearances[lattice.index(i, j)] >= least {
                    tenths[lattice.index(i, j)] = 0;
                    buckets[0].push((i, j));
                }
            }
        }
        let mut distance = 0u32;
        let mut empty = 0;
        while empty < 16 {
            let Some((i, j)) = buckets[distance as usize % 16].pop() else {
                distance += 1;
                empty += 1;
                continue;
            };
            empty = 0;
            if tenths[lattice.index(i, j)] != distance {
                continue;
            }
            for (di, dj, cost) in NEIGHBOURS {
                let (i, j) = (i + di, j + dj);
                if !lattice.contains(i, j) {
                    continue;
                }
                let index = lattice.index(i, j);
                let next = distance + cost;
                if next < tenths[index] && clearances[index] >= least {
                    tenths[index] = next;
                    buckets[next as usize % 16].push((i, j));
                }
            }
        }
        Self { tenths, step: lattice.step, core }
    }

    /// m; `None`: shut off.
    pub fn at(&self, lattice: &Lattice, pose: Pose2) -> Option<f64> {
        let centre = self.core.centre(pose);
        let [i, j] = lattice.coordinates(centre[0], centre[1]).map(|v| v.round() as i32);
        if !lattice.contains(i, j) {
            return None;
        }
        let tenths = self.tenths[lattice.index(i, j)];
        (tenths != u32::MAX).then(|| f64::from(tenths) * 0.1 * self.step)
    }

    /// Whether the core could pass while the base drives straight: a quick look that only says no where nothing passes.
    pub fn line_of_sight(
        &self,
        lattice: &Lattice,
        clearances: &[f32],
        resolution: f64,
        clearance: f64,
        [from, to]: [Pose2; 2],
    ) -> bool {
        let [a, b] = [from, to].map(|pose| {
            let centre = self.core.centre(pose);
            lattice.coordinates(centre[0], centre[1])
        });
        let steps = real::hypot(a[0] - b[0], a[1] - b[1]).ceil().max(1.0);
        let least = least_clearance(lattice, resolution, clearance);
        (0..=steps as usize).all(|k| {
            let share = k as f64 / steps;
            let [i, j] = [0, 1].map(|d| (a[d] + share * (b[d] - a[d])).round() as i32);
            lattice.contains(i, j) && clearances[lattice.index(i, j)] >= least
        })
    }
}

/// The widest way in the plane: the largest radius that a ball at the core's height keeps all the way from start to goal,
/// and where it is narrowest. `None` where start or goal lie beyond the lattice.
pub(super) fn bottleneck(
    lattice: &Lattice,
    core: &[f32],
    radius: f64,
    start: [f64; 2],
    goal: [f64; 2],
) -> Option<(f64, [f64; 2])> {
    use std::collections::BinaryHeap;
    let cell = |p: [f64; 2]| {
        let at = lattice.coordinates(p[0], p[1]).map(|v| v.round() as i32);
        lattice.contains(at[0], at[1]).then_some((at[0], at[1]))
    };
    let (start, goal) = (cell(start)?, cell(goal)?);
    // Widths as whole micrometres, so that the heap has a total order.
    let width = |i: i32, j: i32| (f64::from(core[lattice.index(i, j)]) * 1e6) as i64;
    let mut best = vec![i64::MIN; core.len()];
    let mut narrowest = vec![(0, 0); core.len()];
    let mut heap = BinaryHeap::from([(width(start.0, start.1), start, start)]);
    while let Some((wide, at, place)) = heap.pop() {
        let index = lattice.index(at.0, at.1);
        if best[index] != i64::MIN {
            continue;
        }
        best[index] = wide;
        narrowest[index] = place;
        if at == goal {
            let [x, y] = lattice.position(place.0, place.1);
            return Some((wide as f64 * 1e-6 + radius, [x, y]));
        }
        for (di, dj, _) in NEIGHBOURS {
            let next = (at.0 + di, at.1 + dj);
            if lattice.contains(next.0, next.1) && best[lattice.index(next.0, next.1)] == i64::MIN {
                let own = width(next.0, next.1);
                heap.push(if own < wide { (own, next, next) } else { (wide, next, place) });
            }
        }
    }
    None
}
