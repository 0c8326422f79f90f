//! Extreme points of a point cloud: quickhull in three dimensions.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::Vector3;

/// Points nearer to a face than this share of the cloud's size count as on it, finest first. Coarser ones are tried where rounding
/// on slivers breaks the surface; even the last is below a nanometre on a robot of 1 m.
const FLATNESS: [f64; 3] = [1e-13, 1e-11, 3e-10];

/// How far a point may stick out of the finished hull, as a share of the cloud's size.
const CONTAINMENT: f64 = 1e-9;

/// The points that span the convex hull of `points`, sorted by x, y, z, none twice.
///
/// Every point given lies in the hull of those returned, to within 1e-9 of the cloud's size: that is checked at the end, and where it does not
/// hold, or the cloud is flat or smaller than a tetrahedron, all (distinct) points are returned.
pub fn extreme_points(points: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut distinct: Vec<[f64; 3]> = points.iter().map(|p| p.map(|v| v + 0.0)).collect(); // + 0.0: no negative zeros
    distinct.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])).then(a[2].total_cmp(&b[2])));
    distinct.dedup();
    let cloud: Vec<Vector3<f64>> = distinct.iter().map(|p| Vector3::from(*p)).collect();
    let Some(faces) = FLATNESS.iter().find_map(|flatness| Quickhull::run(&cloud, *flatness)) else {
        return distinct;
    };
    let mut used = vec![false; cloud.len()];
    for corner in faces.iter().flat_map(|face| face.corners) {
        used[corner] = true;
    }
    let mut keep = used.into_iter();
    distinct.retain(|_| keep.next().expect("one flag a point"));
    distinct
}

/// The triangles of the hull of `points`, by index, counter-clockwise as seen from outside; `None` where the points have no volume
/// or rounding broke the surface.
pub fn triangles(points: &[[f64; 3]]) -> Option<Vec<[usize; 3]>> {
    let cloud: Vec<Vector3<f64>> = points.iter().map(|p| Vector3::from(*p)).collect();
    let faces = FLATNESS.iter().find_map(|flatness| Quickhull::run(&cloud, *flatness))?;
    Some(faces.iter().map(|face| face.corners).collect())
}

/// A triangle of the hull; seen from outside its corners run counter-clockwise.
struct Face {
    corners: [usize; 3],
    normal: Vector3<f64>,
    offset: f64,
    /// Points in front of it, not yet in the hull.
    outside: Vec<usize>,
}

impl Face {
    fn new(cloud: &[Vector3<f64>], corners: [usize; 3]) -> Option<Self> {
        let [a, b, c] = corners.map(|i| cloud[i]);
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0)?;
        Some(Self { corners, normal, offset: normal.dot(&a), outside: Vec::new() })
    }

    fn edges(&self) -> [(usize, usize); 3] {
        let [a, b, c] = self.corners;
        [(a, b), (b, c), (c, a)]
    }

    fn height(&self, p: &Vector3<f64>) -> f64 {
        self.normal.dot(p) - self.offset
    }
}

struct Quickhull<'a> {
    cloud: &'a [Vector3<f64>],
    tolerance: f64,
    /// `None`: replaced by later ones.
    faces: Vec<Option<Face>>,
    /// The face on whose rim a directed edge runs; its neighbour has the edge the other way round.
    edges: BTreeMap<(usize, usize), usize>,
}

impl<'a> Quickhull<'a> {
    /// The faces of the hull; `None` where the cloud has no volume or rounding broke the surface.
    fn run(cloud: &'a [Vector3<f64>], flatness: f64) -> Option<Vec<Face>> {
        let mut hull = Self { cloud, tolerance: 0.0, faces: Vec::new(), edges: BTreeMap::new() };
        let size = hull.start(flatness)?;
        // Oldest faces first: that takes in the far points before those near an edge. Each point becomes a corner at most once, so
        // the loop ends.
        let mut next = 0;
        while next < hull.faces.len() {
            if hull.faces[next].as_ref().is_some_and(|f| !f.outside.is_empty()) {
                hull.add_farthest(next)?;
            }
            next += 1;
        }
        let closed = hull.edges.keys().all(|(a, b)| hull.edges.contains_key(&(*b, *a)));
        let faces: Vec<Face> = hull.faces.into_iter().flatten().collect();
        let holds = |f: &Face| cloud.iter().all(|p| f.height(p) <= CONTAINMENT * size);
        (closed && hull.edges.len() == 3 * faces.len() && faces.iter().all(holds)).then_some(faces)
    }

    /// Adds a face; `None` where one of its edges is taken already, which rounding alone can bring about.
    fn add(&mut self, corners: [usize; 3]) -> Option<()> {
        let face = Face::new(self.cloud, corners)?;
        let index = self.faces.len();
        let free = face.edges().into_iter().all(|edge| self.edges.insert(edge, index).is_none());
        self.faces.push(Some(face));
        free.then_some(())
    }

    /// The first tetrahedron; returns the cloud's size.
    fn start(&mut self, flatness: f64) -> Option<f64> {
        let cloud = self.cloud;
        let farthest = |measure: &dyn Fn(&Vector3<f64>) -> f64| {
            (0..cloud.len()).map(|i| (measure(&cloud[i]), i)).max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))
        };
        let first = cloud.first()?;
        let (_, a) = farthest(&|p| (p - first).norm_squared())?;
        let (_, b) = farthest(&|p| (p - cloud[a]).norm_squared())?;
        let along = (cloud[b] - cloud[a]).try_normalize(0.0)?;
        let size = (cloud[b] - cloud[a]).norm();
        let (width, c) = farthest(&|p| (p - cloud[a]).cross(&along).norm())?;
        if width <= 1e-9 * size {
            return None;
        }
        let face = Face::new(cloud, [a, b, c])?;
        let (depth, d) = farthest(&|p| face.height(p).abs())?;
        if depth <= 1e-9 * size {
            return None;
        }
        self.tolerance = flatness * size;
        let [a, b, c] = if face.height(&cloud[d]) > 0.0 { [a, c, b] } else { [a, b, c] };
        for corners in [[a, b, c], [a, d, b], [b, d, c], [c, d, a]] {
            self.add(corners)?;
        }
        self.assign(0, (0..cloud.len()).collect());
        Some(size)
    }

    /// Gives each point to the first face from index `from` on that it is in front of; the others are inside.
    fn assign(&mut self, from: usize, points: Vec<usize>) {
        for p in points {
            let mut faces = self.faces[from..].iter_mut().flatten();
            if let Some(face) = faces.find(|f| f.height(&self.cloud[p]) > self.tolerance) {
                face.outside.push(p);
            }
        }
    }

    /// Takes the point farthest in front of a face into the hull: the faces that it sees give way to a cone from their rim.
    fn add_farthest(&mut self, face: usize) -> Option<()> {
        let seen_by = self.faces[face].as_ref()?;
        let farthest = seen_by.outside.iter().map(|p| (seen_by.height(&self.cloud[*p]), *p));
        let (_, apex) = farthest.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))?;
        let (mut seen, mut rim) = (vec![face], Vec::new());
        let mut known = BTreeSet::from([face]);
        let mut next = 0;
        while next < seen.len() {
            for (a, b) in self.faces[seen[next]].as_ref()?.edges() {
                let neighbour = *self.edges.get(&(b, a))?;
                if known.contains(&neighbour) {
                    continue;
                }
                if self.faces[neighbour].as_ref()?.height(&self.cloud[apex]) > self.tolerance {
                    known.insert(neighbour);
                    seen.push(neighbour);
                } else {
                    rim.push((a, b));
                }
            }
            next += 1;
        }
        let mut orphans = Vec::new();
        for face in seen.into_iter().filter_map(|index| self.faces[index].take()) {
            for edge in face.edges() {
                self.edges.remove(&edge);
            }
            orphans.extend(face.outside.into_iter().filter(|p| *p != apex));
        }
        let from = self.faces.len();
        for (a, b) in rim {
            self.add([a, b, apex])?;
        }
        self.assign(from, orphans);
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::real;
    use proptest::prelude::*;

    fn support(points: &[[f64; 3]], d: [f64; 3]) -> f64 {
        points.iter().map(|p| p[0] * d[0] + p[1] * d[1] + p[2] * d[2]).fold(f64::NEG_INFINITY, f64::max)
    }

    fn assert_same_support(points: &[[f64; 3]], hull: &[[f64; 3]], tolerance: f64) {
        for i in 0..200 {
            // A spiral over the sphere.
            let z = 1.0 - (2.0 * f64::from(i) + 1.0) / 200.0;
            let (sin, cos) = real::sin_cos(2.4 * f64::from(i));
            let d = [(1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z];
            assert!((support(points, d) - support(hull, d)).abs() <= tolerance, "direction {d:?}");
        }
    }

    fn lattice(n: usize, scale: [f64; 3]) -> Vec<[f64; 3]> {
        let at = |i: usize, s: f64| s * i as f64 / (n - 1) as f64;
        (0..n * n * n).map(|i| [at(i % n, scale[0]), at(i / n % n, scale[1]), at(i / n / n, scale[2])]).collect()
    }

    #[test]
    fn a_lattice_has_its_eight_corners() {
        let hull = extreme_points(&lattice(6, [0.1, 2.0, 0.7]));
        assert_eq!(hull, lattice(2, [0.1, 2.0, 0.7]).tap_sorted());
    }

    trait Sorted {
        fn tap_sorted(self) -> Self;
    }

    impl Sorted for Vec<[f64; 3]> {
        fn tap_sorted(mut self) -> Self {
            self.sort_by(|a, b| a.partial_cmp(b).unwrap());
            self
        }
    }

    #[test]
    fn a_turned_lattice_loses_its_inner_points_and_keeps_its_support() {
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, -1.1, 2.0);
        let points: Vec<[f64; 3]> =
            lattice(5, [1.0, 0.4, 0.2]).iter().map(|p| (turn * Vector3::from(*p)).into()).collect();
        let hull = extreme_points(&points);
        assert!(hull.len() <= 40, "{} of {} points", hull.len(), points.len());
        assert_same_support(&points, &hull, 1e-11);
    }

    #[test]
    fn coordinates_in_single_precision_keep_their_support() {
        let turn = nalgebra::Rotation3::from_euler_angles(0.3, -1.1, 2.0);
        let rounded = |p: Vector3<f64>| <[f64; 3]>::from(p).map(|v| f64::from(v as f32));
        let points: Vec<[f64; 3]> =
            lattice(7, [1.0, 0.4, 0.2]).iter().map(|p| rounded(turn * Vector3::from(*p))).collect();
        let hull = extreme_points(&points);
        assert!(hull.len() < points.len(), "{} of {}", hull.len(), points.len());
        assert_same_support(&points, &hull, 1e-9);
    }

    #[test]
    fn what_has_no_volume_keeps_its_points() {
        let line: Vec<[f64; 3]> = (0..5).map(|i| [f64::from(i), 2.0 * f64::from(i), 0.0]).collect();
        let flat = lattice(3, [1.0, 1.0, 0.0]);
        assert_eq!(extreme_points(&line), line);
        assert_eq!(extreme_points(&flat).len(), 9);
        assert_eq!(extreme_points(&[[1.0, -0.0, 0.0], [1.0, 0.0, 0.0]]), [[1.0, 0.0, 0.0]]);
        assert_eq!(extreme_points(&[]), Vec::<[f64; 3]>::new());
        assert_eq!(extreme_points(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]).len(), 3);
    }

    #[test]
    fn the_triangles_of_a_cube_close_around_its_volume() {
        let points = lattice(2, [2.0, 3.0, 5.0]);
        let triangles = triangles(&points).expect("a volume");
        assert_eq!(triangles.len(), 12);
        let volume = |[a, b, c]: [usize; 3]| {
            let [a, b, c] = [a, b, c].map(|i| Vector3::from(points[i]));
            a.dot(&b.cross(&c)) / 6.0
        };
        assert!((triangles.into_iter().map(volume).sum::<f64>() - 30.0).abs() < 1e-12);
        assert_eq!(super::triangles(&lattice(3, [1.0, 1.0, 0.0])), None);
    }

    #[test]
    fn points_on_a_sphere_are_all_kept() {
        let points: Vec<[f64; 3]> = (0..2000)
            .map(|i| {
                let z = 1.0 - (2.0 * f64::from(i) + 1.0) / 2000.0;
                let (sin, cos) = real::sin_cos(2.4 * f64::from(i));
                [(1.0 - z * z).sqrt() * cos, (1.0 - z * z).sqrt() * sin, z]
            })
            .collect();
        assert_eq!(extreme_points(&points).len(), 2000);
    }

    proptest! {
        #[test]
        fn the_hull_has_the_support_of_the_raw_points(
            points in prop::collection::vec([-1.0..1.0, -0.5..0.5, -0.1..0.1f64], 0..80),
            cells in 1u32..40,
        ) {
            // Half of the runs on a coarse grid: many coplanar, collinear and double points.
            let grid = f64::from(cells);
            let points: Vec<[f64; 3]> =
                points.iter().map(|p| if cells < 20 { p.map(|v: f64| (v * grid).round() / grid) } else { *p }).collect();
            let hull = extreme_points(&points);
            prop_assert!(hull.iter().all(|v| points.contains(v)));
            if !points.is_empty() {
                assert_same_support(&points, &hull, 1e-9);
            }
        }

        #[test]
        fn an_independent_hull_has_the_same_support(
            points in prop::collection::vec([-1.0..1.0, -1.0..1.0, -1.0..1.0f64], 8..60),
        ) {
            let cloud: Vec<_> = points.iter().map(|p| parry3d_f64::math::Vector::from_array(*p)).collect();
            if let Ok((peer, _)) = parry3d_f64::transformation::try_convex_hull(&cloud) {
                let peer: Vec<[f64; 3]> = peer.iter().map(|p| p.to_array()).collect();
                assert_same_support(&peer, &extreme_points(&points), 1e-9);
                prop_assert_eq!(peer.tap_sorted(), extreme_points(&points));
            }
        }
    }
}
