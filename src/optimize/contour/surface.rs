//! Points on the surface of a shape.

use nalgebra::{Isometry3, Point3};

use super::ContourPoint;
use crate::math::real;
use crate::robot::Convex;

pub(super) fn surface_points(convex: &Convex, pose: &Isometry3<f64>, spacing: f64) -> Vec<ContourPoint> {
    let local = match convex {
        Convex::Sphere { radius } => {
            return vec![ContourPoint { radius: *radius, ..ContourPoint::plain(pose * Point3::origin()) }];
        }
        Convex::Box { half } => box_points(half, spacing),
        Convex::Cylinder { radius, half_length } => cylinder_points(*radius, *half_length, spacing),
        Convex::Hull { vertices } => hull_points(convex, vertices, spacing),
    };
    local.into_iter().map(|p| ContourPoint::plain(pose * Point3::from(p))).collect()
}

/// Number of equal steps no longer than `spacing` along `length`, at least one.
pub(super) fn steps(length: f64, spacing: f64) -> usize {
    (length / spacing - 1e-9).ceil().max(1.0) as usize
}

/// The rim at `spacing`, the inside at twice that.
pub(super) fn rectangle_points(half: [f64; 2], spacing: f64) -> Vec<[f64; 2]> {
    let n = half.map(|h| steps(2.0 * h, spacing));
    let mut points = Vec::new();
    for i in 0..=n[0] {
        for j in 0..=n[1] {
            let index = [i, j];
            let rim = (0..2).any(|a| index[a] == 0 || index[a] == n[a]);
            if rim || index.iter().all(|i| i.is_multiple_of(2)) {
                points.push([0, 1].map(|a| half[a] * (2.0 * index[a] as f64 / n[a] as f64 - 1.0)));
            }
        }
    }
    points
}

/// The same of a disc about the origin.
pub(super) fn disc_points(radius: f64, spacing: f64) -> Vec<[f64; 3]> {
    let rings = steps(radius, 2.0 * spacing);
    let mut points = vec![[0.0; 3]];
    for r in 1..=rings {
        let (radius, spacing) = (radius * r as f64 / rings as f64, if r == rings { spacing } else { 2.0 * spacing });
        points.extend(ring_points(radius, 0.0, spacing));
    }
    points
}

fn ring_points(radius: f64, z: f64, spacing: f64) -> impl Iterator<Item = [f64; 3]> {
    let n = steps(std::f64::consts::TAU * radius, spacing).max(8);
    (0..n).map(move |i| {
        let (s, c) = real::sin_cos(std::f64::consts::TAU * i as f64 / n as f64);
        [radius * c, radius * s, z]
    })
}

pub(super) fn box_points(half: &[f64; 3], spacing: f64) -> Vec<[f64; 3]> {
    let n = half.map(|h| steps(2.0 * h, spacing));
    let mut points = Vec::new();
    for i in 0..=n[0] {
        for j in 0..=n[1] {
            for k in 0..=n[2] {
                let index = [i, j, k];
                let extremes = (0..3).filter(|&a| index[a] == 0 || index[a] == n[a]).count();
                let coarse = (0..3).all(|a| index[a].is_multiple_of(2) || index[a] == n[a]);
                if extremes >= 2 || (extremes == 1 && coarse) {
                    points.push(std::array::from_fn(|a| half[a] * (2.0 * index[a] as f64 / n[a] as f64 - 1.0)));
                }
            }
        }
    }
    points
}

pub(super) fn cylinder_points(radius: f64, half_length: f64, spacing: f64) -> Vec<[f64; 3]> {
    let mut points = Vec::new();
    let mut ring = |radius: f64, z: f64, spacing: f64| points.extend(ring_points(radius, z, spacing));
    // The mantle's rings are as dense along the axis as around it: a cylinder has no edge there to be hit first.
    let levels = steps(2.0 * half_length, spacing);
    for level in 0..=levels {
        ring(radius, half_length * (2.0 * level as f64 / levels as f64 - 1.0), spacing);
    }
    let rings = steps(radius, 2.0 * spacing);
    for r in 1..rings {
        for z in [-half_length, half_length] {
            ring(radius * r as f64 / rings as f64, z, 2.0 * spacing);
        }
    }
    points.extend([[0.0, 0.0, -half_length], [0.0, 0.0, half_length]]);
    points
}

/// Directions spread evenly over the sphere.
pub(super) fn directions(count: usize) -> impl Iterator<Item = nalgebra::Vector3<f64>> {
    let golden = std::f64::consts::PI * (3.0 - 5f64.sqrt());
    (0..count).map(move |i| {
        let z = 1.0 - (2 * i + 1) as f64 / count as f64;
        let flat = (1.0 - z * z).sqrt();
        let (s, c) = real::sin_cos(golden * i as f64);
        nalgebra::Vector3::new(flat * c, flat * s, z)
    })
}

/// Vertices, and points between pairs of them that lie near the surface, thinned to one a cell of half the spacing.
pub(super) fn hull_points(convex: &Convex, vertices: &[[f64; 3]], spacing: f64) -> Vec<[f64; 3]> {
    let supports: Vec<_> = directions(256).map(|d| (d, convex.support(&d).dot(&d))).collect();
    let depth = |p: &[f64; 3]| {
        supports.iter().map(|(d, h)| h - d.x * p[0] - d.y * p[1] - d.z * p[2]).fold(f64::INFINITY, f64::min)
    };
    let mut points = vertices.to_vec();
    let mut taken = std::collections::BTreeSet::new();
    let cell = |p: &[f64; 3]| p.map(|v| (v / (0.5 * spacing)).round() as i64);
    taken.extend(vertices.iter().map(&cell));
    // Enough to bridge every edge of a plain hull; a finely meshed one has its vertices for that.
    let nearest = if vertices.len() <= 24 { vertices.len() } else { 12 };
    for (i, a) in vertices.iter().enumerate() {
        let apart = |b: &[f64; 3]| (0..3).map(|k| real::powi(a[k] - b[k], 2)).sum::<f64>();
        let mut others: Vec<_> = vertices.iter().enumerate().filter(|(j, _)| *j != i).map(|(_, b)| b).collect();
        others.sort_by(|b, c| apart(b).total_cmp(&apart(c)));
        for b in others.into_iter().take(nearest) {
            let n = steps(apart(b).sqrt(), spacing);
            for k in 1..n {
                let f = k as f64 / n as f64;
                let p: [f64; 3] = std::array::from_fn(|d| a[d] + f * (b[d] - a[d]));
                if !taken.contains(&cell(&p)) && depth(&p) < 0.5 * spacing {
                    taken.insert(cell(&p));
                    points.push(p);
                }
            }
        }
    }
    points
}
