//! Cost to go in the plane: the least distance to the goal of a ball about the base's axis that the robot holds inside, over
//! the lattice positions. A lower bound but for the eight directions; only guides, except where a position is shut off.

use super::lattice::Lattice;
use crate::esdf::Esdf;
use crate::robot::RobotModel;

/// Distances to the goal in lattice steps.
pub(super) struct CostToGo {
    /// By lattice index, in tenths of a step; `u32::MAX`: shut off.
    tenths: Vec<u32>,
    step: f64,
}

/// The largest ball about the base's axis inside one of the robot's rigid boxes, sampled: (height of the centre, radius) m.
pub(super) fn core_ball(robot: &RobotModel) -> (f64, f64) {
    use crate::robot::Convex;
    let mut best = (0.1, 0.0f64);
    for shape in robot.shapes.iter().filter(|s| s.body == 0) {
        if matches!(shape.convex, Convex::Hull { .. }) {
            continue;
        }
        let pose = robot.bodies[0].origin * shape.pose;
        let half = shape.convex.half_extents();
        for k in 1..40 {
            let z = 0.025 * f64::from(k);
            let local = pose.inverse_transform_point(&nalgebra::Point3::new(0.0, 0.0, z));
            let flat = local.x.hypot(local.y);
            let radius = match &shape.convex {
                Convex::Sphere { radius } => radius - local.coords.norm(),
                Convex::Cylinder { radius, half_length } => (radius - flat).min(half_length - local.z.abs()),
                _ => (0..3).map(|a| half[a] - local[a].abs()).fold(f64::INFINITY, f64::min),
            };
            if radius > best.1 {
                best = (z, radius);
            }
        }
    }
    best
}

/// Clearance that the core ball has at each lattice position, m.
pub(super) fn core_clearance(lattice: &Lattice, esdf: &Esdf, (height, radius): (f64, f64)) -> Vec<f32> {
    let mut out = Vec::with_capacity((lattice.size[0] * lattice.size[1]) as usize);
    for i in 0..lattice.size[0] {
        for j in 0..lattice.size[1] {
            let [x, y] = lattice.position(i, j);
            out.push((esdf.distance([x, y, height]) - radius) as f32);
        }
    }
    out
}

const NEIGHBOURS: [(i32, i32, u32); 8] =
    [(1, 0, 10), (0, 1, 10), (-1, 0, 10), (0, -1, 10), (1, 1, 14), (1, -1, 14), (-1, 1, 14), (-1, -1, 14)];

impl CostToGo {
    /// Distances from everywhere to `goal` (m) where the core keeps `clearance`.
    pub fn new(lattice: &Lattice, core: &[f32], resolution: f64, clearance: f64, goal: [f64; 2]) -> Self {
        // A drive passes within 0.71 steps of lattice positions, and interpolation is off by 0.87 cells between nodes.
        let on_nodes = (lattice.step / resolution).fract() < 1e-6;
        let slack = 0.71 * lattice.step + if on_nodes { 0.0 } else { 0.87 * resolution };
        let least = (clearance - slack) as f32;
        let mut tenths = vec![u32::MAX; core.len()];
        // Dial's buckets: all steps are 10 or 14.
        let mut buckets: [Vec<(i32, i32)>; 16] = Default::default();
        let at = lattice.coordinates(goal[0], goal[1]);
        for i in at[0].floor() as i32..=at[0].ceil() as i32 {
            for j in at[1].floor() as i32..=at[1].ceil() as i32 {
                if lattice.contains(i, j) {
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
                if next < tenths[index] && core[index] >= least {
                    tenths[index] = next;
                    buckets[next as usize % 16].push((i, j));
                }
            }
        }
        Self { tenths, step: lattice.step }
    }

    /// m; `None`: shut off.
    pub fn at(&self, lattice: &Lattice, i: i32, j: i32) -> Option<f64> {
        let tenths = self.tenths[lattice.index(i, j)];
        (tenths != u32::MAX).then(|| f64::from(tenths) * 0.1 * self.step)
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
