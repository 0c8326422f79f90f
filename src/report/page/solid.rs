//! The surface of a collision shape as triangles, for drawing.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use serde::Serialize;

use crate::math::real;
use crate::robot::{Convex, hull};

/// Sides of a drawn cylinder.
const SIDES: usize = 32;
/// Corners of a drawn ball.
const BALL: usize = 160;
/// A hull of more corners than its share of the robot's is drawn with those that lie farthest in that many directions: its share is at
/// least the first, at most the second.
const CORNERS: [usize; 2] = [40, 240];
/// Corners of a robot's hulls in all, about.
const ROBOT: usize = 4000;
/// Faces that meet at less than this angle have no line between them, degrees.
const CREASE: f64 = 22.0;
/// What has no volume is given this half thickness for the eye, m.
const THIN: f64 = 5e-4;

/// A convex surface about its shape's own centre.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct Solid {
    /// x, y, z of each corner in hundredths of a millimetre.
    pub(super) points: Vec<i32>,
    /// Three corners a triangle, counter-clockwise from outside.
    pub(super) triangles: Vec<usize>,
    /// Two corners an edge worth a line.
    pub(super) edges: Vec<usize>,
}

impl Solid {
    /// The surface of one of `shapes` shapes; round ones by corners on them.
    pub(super) fn of(convex: &Convex, shapes: usize) -> Self {
        let mut points = corners(convex, (ROBOT / shapes.max(1)).clamp(CORNERS[0], CORNERS[1]));
        let triangles = hull::triangles(&points).or_else(|| {
            let offset = |p: &[f64; 3]| {
                let p = *p;
                (0..3).flat_map(move |a| {
                    [-THIN, THIN].map(|d| std::array::from_fn(|i| p[i] + if i == a { d } else { 0.0 }))
                })
            };
            points = points.iter().flat_map(offset).collect();
            hull::triangles(&points)
        });
        let triangles = triangles.unwrap_or_default();
        let edges = if matches!(convex, Convex::Sphere { .. }) { Vec::new() } else { creases(&points, &triangles) };
        Self {
            points: points.iter().flatten().map(|v| (v * 1e5).round() as i32).collect(),
            triangles: triangles.into_iter().flatten().collect(),
            edges,
        }
    }
}

/// Points on the shape whose hull is drawn.
fn corners(convex: &Convex, most: usize) -> Vec<[f64; 3]> {
    match convex {
        Convex::Box { half } => {
            let sign = |bit: usize, k: usize| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
            (0..8).map(|k| std::array::from_fn(|a| half[a] * sign(a, k))).collect()
        }
        Convex::Cylinder { radius, half_length } => (0..2 * SIDES)
            .map(|k| {
                let (sin, cos) = real::sin_cos(std::f64::consts::TAU * (k / 2) as f64 / SIDES as f64);
                [radius * cos, radius * sin, if k % 2 == 0 { -half_length } else { *half_length }]
            })
            .collect(),
        Convex::Sphere { radius } => spiral(BALL).map(|d| [radius * d.x, radius * d.y, radius * d.z]).collect(),
        Convex::Hull { vertices } if vertices.len() <= most => vertices.clone(),
        Convex::Hull { .. } => {
            let mut found: Vec<[f64; 3]> = spiral(most).map(|d| convex.support(&d).into()).collect();
            found.sort_by(|a, b| a.partial_cmp(b).expect("shapes are finite"));
            found.dedup();
            found
        }
    }
}

/// Directions spread evenly over the sphere.
fn spiral(count: usize) -> impl Iterator<Item = Vector3<f64>> {
    (0..count).map(move |i| {
        let z = 1.0 - (2.0 * i as f64 + 1.0) / count as f64;
        // The golden angle.
        let (sin, cos) = real::sin_cos(2.399_963_229_728_653 * i as f64);
        let radius = (1.0 - z * z).sqrt();
        Vector3::new(radius * cos, radius * sin, z)
    })
}

/// Edges between faces that meet at an angle.
fn creases(points: &[[f64; 3]], triangles: &[[usize; 3]]) -> Vec<usize> {
    let mut normals: BTreeMap<(usize, usize), Vector3<f64>> = BTreeMap::new();
    for corners in triangles {
        let [a, b, c] = corners.map(|i| Vector3::from(points[i]));
        let Some(normal) = (b - a).cross(&(c - a)).try_normalize(0.0) else { continue };
        let [a, b, c] = *corners;
        normals.extend([((a, b), normal), ((b, c), normal), ((c, a), normal)]);
    }
    let least = real::cos(CREASE.to_radians());
    let turns = |(a, b): &(usize, usize), normal: &Vector3<f64>| {
        a < b && normals.get(&(*b, *a)).is_none_or(|other| normal.dot(other) < least)
    };
    normals.iter().filter(|(edge, normal)| turns(edge, normal)).flat_map(|((a, b), _)| [*a, *b]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(solid: &Solid) -> Vec<Vector3<f64>> {
        solid.points.chunks(3).map(|p| Vector3::new(p[0].into(), p[1].into(), p[2].into()) * 1e-5).collect()
    }

    /// How far the drawn surface stays behind the shape in any of many directions, m; negative: in front of it.
    fn behind(convex: &Convex) -> (f64, f64) {
        let drawn = points(&Solid::of(convex, 1));
        let short = |d: Vector3<f64>| {
            convex.support(&d).dot(&d) - drawn.iter().map(|p| p.dot(&d)).fold(f64::NEG_INFINITY, f64::max)
        };
        spiral(500).map(short).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)))
    }

    #[test]
    fn what_is_drawn_is_the_shape_itself_round_ones_to_a_few_hundredths_of_their_size() {
        let vertices = spiral(2000).map(|d| [d.x, 0.5 * d.y, 0.2 * d.z]).collect::<Vec<_>>();
        let few = vertices[..100].to_vec();
        let cases = [
            (Convex::Box { half: [0.2, 0.1, 0.3] }, 1e-5),
            (Convex::Cylinder { radius: 0.4, half_length: 0.1 }, 0.004),
            (Convex::Sphere { radius: 0.4 }, 0.015),
            (Convex::Hull { vertices: few }, 1e-5),
            (Convex::Hull { vertices }, 0.02),
            (Convex::Hull { vertices: vec![[-0.3, -0.2, 0.0], [0.3, -0.2, 0.0], [0.0, 0.3, 0.0]] }, 1e-5),
        ];
        for (k, (convex, most)) in cases.iter().enumerate() {
            let (least, greatest) = behind(convex);
            assert!(least >= -1e-5 - THIN && greatest <= *most, "shape {k}: {least} to {greatest}");
        }
    }

    #[test]
    fn surfaces_are_closed_and_look_outwards() {
        for convex in [
            Convex::Box { half: [0.2, 0.1, 0.3] },
            Convex::Cylinder { radius: 0.4, half_length: 0.1 },
            Convex::Sphere { radius: 0.4 },
            Convex::Hull { vertices: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] },
        ] {
            let solid = Solid::of(&convex, 1);
            let at = points(&solid);
            let edges = solid.triangles.chunks(3).flat_map(|t| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])]);
            let edges: std::collections::BTreeSet<_> = edges.collect();
            assert!(!edges.is_empty() && edges.iter().all(|(a, b)| edges.contains(&(*b, *a))), "{convex:?}");
            let middle = at.iter().sum::<Vector3<f64>>() / at.len() as f64;
            for t in solid.triangles.chunks(3) {
                let [a, b, c] = [t[0], t[1], t[2]].map(|i| at[i] - middle);
                assert!(a.dot(&b.cross(&c)) > -1e-12, "{convex:?}");
            }
        }
    }

    #[test]
    fn a_box_has_its_twelve_edges_and_a_cylinder_its_two_rims() {
        assert_eq!(Solid::of(&Convex::Box { half: [1.0, 2.0, 3.0] }, 1).edges.len(), 24);
        assert_eq!(Solid::of(&Convex::Cylinder { radius: 1.0, half_length: 1.0 }, 1).edges.len(), 2 * 2 * SIDES);
    }
}
