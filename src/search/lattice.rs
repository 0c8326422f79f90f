//! The lattice: positions on the map's own nodes (5 cm apart, or a whole part or multiple of the map's cells), 72 headings.
//! Moves: a spin by one heading, and straight drives between lattice positions along the heading nearest to their direction.
//!
//! A drive leaves along the *exact* direction between the two positions, at most half a heading off: the base first spins
//! to it. So every move is exactly drivable and ends exactly on the lattice; there is no hybrid state to round.

use std::cell::OnceCell;
use std::f64::consts::TAU;

use crate::geom::{Pose2, wrap_angle};
use crate::map::VoxelMap;
use crate::math::real;

/// Headings in a full turn: 5 degrees.
pub(super) const HEADINGS: usize = 72;
/// Wanted distance of lattice positions, m.
const SPACING: f64 = 0.05;
/// Longest side of a drive, in lattice steps.
const LONGEST: i32 = 8;

/// A lattice position and heading.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct LatticeState {
    pub i: i32,
    pub j: i32,
    /// 0..HEADINGS.
    pub heading: i32,
}

/// A straight drive from any position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Drive {
    pub di: i32,
    pub dj: i32,
    /// m.
    pub length: f64,
    /// Exact direction, rad.
    pub direction: f64,
}

#[derive(Debug, Clone)]
pub(super) struct Lattice {
    pub origin: [f64; 2],
    pub step: f64,
    /// Positions along x and y.
    pub size: [i32; 2],
    /// Drives by heading index, once they are asked for.
    drives: OnceCell<Vec<Vec<Drive>>>,
}

pub(super) fn heading_angle(heading: i32) -> f64 {
    wrap_angle(f64::from(heading) * TAU / HEADINGS as f64)
}

pub(super) fn nearest_heading(angle: f64) -> i32 {
    (angle * HEADINGS as f64 / TAU).round().rem_euclid(HEADINGS as f64) as i32
}

impl Lattice {
    pub fn new(map: &VoxelMap) -> Self {
        let step = if map.resolution > SPACING * 1.001 {
            map.resolution / (map.resolution / SPACING - 1e-9).ceil()
        } else {
            map.resolution * (SPACING / map.resolution + 1e-9).floor()
        };
        let size = [0, 1].map(|a| (map.dims[a] as f64 * map.resolution / step + 1e-6).floor() as i32 + 1);
        Self { origin: [map.origin[0], map.origin[1]], step, size, drives: OnceCell::new() }
    }

    pub fn contains(&self, i: i32, j: i32) -> bool {
        (0..self.size[0]).contains(&i) && (0..self.size[1]).contains(&j)
    }

    pub fn position(&self, i: i32, j: i32) -> [f64; 2] {
        [self.origin[0] + self.step * f64::from(i), self.origin[1] + self.step * f64::from(j)]
    }

    pub fn pose(&self, state: LatticeState) -> Pose2 {
        let [x, y] = self.position(state.i, state.j);
        Pose2::new(x, y, heading_angle(state.heading))
    }

    pub fn drives(&self, heading: i32) -> &[Drive] {
        &self.drives.get_or_init(|| drives(self.step))[heading as usize]
    }

    /// Continuous lattice coordinates of a point.
    pub fn coordinates(&self, x: f64, y: f64) -> [f64; 2] {
        [(x - self.origin[0]) / self.step, (y - self.origin[1]) / self.step]
    }

    pub fn index(&self, i: i32, j: i32) -> usize {
        i as usize * self.size[1] as usize + j as usize
    }
}

/// For each heading the shortest drives whose direction is nearest to it: one on each side of it at most.
fn drives(step: f64) -> Vec<Vec<Drive>> {
    let mut all: Vec<Vec<Drive>> = vec![Vec::new(); HEADINGS];
    for di in -LONGEST..=LONGEST {
        for dj in -LONGEST..=LONGEST {
            if gcd(di.unsigned_abs(), dj.unsigned_abs()) != 1 {
                continue;
            }
            let direction = real::atan2(f64::from(dj), f64::from(di));
            let length = real::hypot(f64::from(di), f64::from(dj)) * step;
            all[nearest_heading(direction) as usize].push(Drive { di, dj, length, direction });
        }
    }
    for (heading, list) in all.iter_mut().enumerate() {
        list.sort_by(|a, b| a.length.total_cmp(&b.length).then(a.direction.total_cmp(&b.direction)));
        let side = |d: &Drive| wrap_angle(d.direction - heading_angle(heading as i32)) >= 0.0;
        let first = list[0];
        let second = list.iter().copied().find(|d| side(d) != side(&first) && d.length < 7.0 * step);
        list.truncate(1);
        if (wrap_angle(first.direction - heading_angle(heading as i32))).abs() > 1e-9 {
            list.extend(second);
        }
    }
    all
}

fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mission::Unknown;

    #[test]
    fn every_heading_has_a_drive_within_half_a_heading() {
        let lattice = Lattice::new(&VoxelMap::new(0.05, [0.0; 3], [10, 10, 1], Unknown::Free));
        for heading in 0..HEADINGS as i32 {
            let drives = lattice.drives(heading);
            assert!(!drives.is_empty() && drives.len() <= 2, "heading {heading}");
            for drive in drives {
                let off = wrap_angle(drive.direction - heading_angle(heading)).abs();
                assert!(off <= TAU / HEADINGS as f64 / 2.0 + 1e-12, "heading {heading}: {off}");
            }
        }
    }

    #[test]
    fn positions_lie_on_the_nodes_of_the_map_whatever_its_resolution() {
        for (resolution, expected) in [(0.05, 0.05), (0.1, 0.05), (0.08, 0.04), (0.02, 0.04), (0.3, 0.05), (0.01, 0.05)]
        {
            let lattice = Lattice::new(&VoxelMap::new(resolution, [0.0; 3], [20, 20, 1], Unknown::Free));
            assert!((lattice.step - expected).abs() < 1e-12, "{resolution}: {}", lattice.step);
            let end = lattice.position(lattice.size[0] - 1, 0)[0];
            assert!(end <= 20.0 * resolution + 1e-9 && end > 20.0 * resolution - lattice.step);
        }
    }

    #[test]
    fn a_heading_is_the_nearest_to_its_own_angle() {
        for heading in 0..HEADINGS as i32 {
            assert_eq!(nearest_heading(heading_angle(heading)), heading);
        }
    }
}
