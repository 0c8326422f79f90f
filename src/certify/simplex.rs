//! The point of a simplex (one to four corners) that is nearest to the origin, and the corners that carry it.

use nalgebra::Vector3;

/// Up to four corners.
#[derive(Debug, Clone, Copy)]
pub(super) struct Simplex {
    corners: [Vector3<f64>; 4],
    count: usize,
}

impl Simplex {
    /// One corner.
    pub(super) fn new(corner: Vector3<f64>) -> Self {
        Self { corners: [corner; 4], count: 1 }
    }

    /// Adds a corner; the simplex must have fewer than four.
    pub(super) fn push(&mut self, corner: Vector3<f64>) {
        debug_assert!(self.count < 4, "a tetrahedron that does not hold the origin has been reduced to a face");
        self.corners[self.count] = corner;
        self.count += 1;
    }

    /// Whether `corner` is one of the corners, to the last bit.
    pub(super) fn has(&self, corner: &Vector3<f64>) -> bool {
        self.corners[..self.count].contains(corner)
    }

    /// The nearest point to the origin; keeps only the corners of the feature it lies on. `None`: the origin is inside.
    pub(super) fn reduce(&mut self) -> Option<Vector3<f64>> {
        let [a, b, c, d] = self.corners;
        let (point, feature) = match self.count {
            1 => (a, Feature::one(a)),
            2 => on_segment(a, b),
            3 => on_triangle(a, b, c),
            _ => on_tetrahedron(a, b, c, d)?,
        };
        self.corners[..3].copy_from_slice(&feature.corners);
        self.count = feature.count;
        Some(point)
    }
}

#[derive(Clone, Copy)]
struct Feature {
    corners: [Vector3<f64>; 3],
    count: usize,
}

impl Feature {
    fn one(a: Vector3<f64>) -> Self {
        Self { corners: [a; 3], count: 1 }
    }

    fn two(a: Vector3<f64>, b: Vector3<f64>) -> Self {
        Self { corners: [a, b, b], count: 2 }
    }
}

type Nearest = (Vector3<f64>, Feature);

fn on_segment(a: Vector3<f64>, b: Vector3<f64>) -> Nearest {
    let along = b - a;
    let (reach, length2) = (-a.dot(&along), along.norm_squared());
    if reach <= 0.0 {
        (a, Feature::one(a))
    } else if reach >= length2 {
        (b, Feature::one(b))
    } else {
        (a + along * (reach / length2), Feature::two(a, b))
    }
}

/// The nearest of the three edges, or the foot of the perpendicular where it falls inside. Not the shortest way, but a flat
/// triangle cannot mislead it: then the foot's weights are not all positive and an edge is taken.
fn on_triangle(a: Vector3<f64>, b: Vector3<f64>, c: Vector3<f64>) -> Nearest {
    let normal = (b - a).cross(&(c - a));
    let area2 = normal.norm_squared();
    // Weights of the foot: areas of the triangles that the origin's projection makes with the edges.
    let weights = [b.cross(&c).dot(&normal), c.cross(&a).dot(&normal), a.cross(&b).dot(&normal)];
    if area2 > 0.0 && weights.iter().all(|w| *w > 0.0) {
        let foot = normal * (a.dot(&normal) / area2);
        if foot.iter().all(|x| x.is_finite()) {
            return (foot, Feature { corners: [a, b, c], count: 3 });
        }
    }
    nearest([on_segment(a, b), on_segment(b, c), on_segment(c, a)])
}

fn on_tetrahedron(a: Vector3<f64>, b: Vector3<f64>, c: Vector3<f64>, d: Vector3<f64>) -> Option<Nearest> {
    let size = (b - a).norm() * (c - a).norm() * (d - a).norm();
    let volume = (b - a).cross(&(c - a)).dot(&(d - a));
    let faces = [(a, b, c, d), (a, b, d, c), (a, c, d, b), (b, c, d, a)];
    let flat = volume.abs() <= 1e-13 * size;
    // Beyond a face: on the other side of its plane than the fourth corner. A flat one has no inside to trust.
    let beyond = |(p, q, r, s): (Vector3<f64>, Vector3<f64>, Vector3<f64>, Vector3<f64>)| {
        let normal = (q - p).cross(&(r - p));
        flat || normal.dot(&(s - p)) * normal.dot(&-p) <= 0.0
    };
    let mut best: Option<Nearest> = None;
    for face in faces.into_iter().filter(|face| beyond(*face)) {
        let found = on_triangle(face.0, face.1, face.2);
        if best.is_none_or(|b| found.0.norm_squared() < b.0.norm_squared()) {
            best = Some(found);
        }
    }
    best
}

fn nearest(found: [Nearest; 3]) -> Nearest {
    let mut best = found[0];
    for candidate in &found[1..] {
        if candidate.0.norm_squared() < best.0.norm_squared() {
            best = *candidate;
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn what_is_within_a_tetrahedron_is_within_it_however_its_corners_are_named() {
        // Corner c + a lies in the plane of b - a and d - a; the origin is a quarter of a, a tenth of b, half of c and the rest of d.
        let corners = [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [-1.0, -0.2, -0.3], [1.0, 0.0, 1.0]].map(Vector3::from);
        for [i, j, k, l] in [[0, 1, 2, 3], [1, 0, 2, 3], [0, 2, 1, 3], [0, 3, 2, 1], [2, 1, 0, 3], [3, 1, 2, 0]] {
            assert!(on_tetrahedron(corners[i], corners[j], corners[k], corners[l]).is_none());
        }
    }

    fn point() -> impl Strategy<Value = Vector3<f64>> {
        [-1.0..1.0, -1.0..1.0, -1.0..1.0f64].prop_map(Vector3::from)
    }

    /// A tetrahedron around the origin.
    const AROUND: [[f64; 3]; 4] = [[1.0, 1.0, 1.0], [-1.0, -1.2, 1.0], [-1.0, 1.0, -0.8], [1.0, -1.0, -1.0]];

    #[test]
    fn the_origin_inside_is_found_however_small_or_large_the_simplex() {
        for scale in [1e-9, 1e-3, 1.0, 1e3, 1e6] {
            let mut simplex = Simplex::new(Vector3::from(AROUND[0]) * scale);
            AROUND[1..].iter().for_each(|c| simplex.push(Vector3::from(*c) * scale));
            assert_eq!(simplex.reduce(), None, "{scale}");
        }
    }

    #[test]
    fn a_simplex_has_the_corners_it_was_made_of_and_no_others() {
        let [a, b] = [AROUND[0], AROUND[1]].map(Vector3::from);
        let mut simplex = Simplex::new(a);
        assert!(simplex.has(&a) && !simplex.has(&b));
        simplex.push(b);
        assert!(simplex.has(&a) && simplex.has(&b) && !simplex.has(&(0.5 * (a + b))));
    }

    proptest! {
        #[test]
        fn a_corner_that_was_dropped_counts_no_more(corners in prop::collection::vec(point(), 5), count in 2..5usize) {
            // Beside the origin, so that something is dropped.
            let beside = |c: &Vector3<f64>| c + Vector3::new(1.1, 0.0, 0.0);
            let mut simplex = Simplex::new(beside(&corners[0]));
            corners[1..count].iter().for_each(|c| simplex.push(beside(c)));
            let _ = simplex.reduce();
            let kept = simplex.corners[..simplex.count].to_vec();
            prop_assume!(kept.len() < 4);
            let mut anew = Simplex::new(kept[0]);
            kept[1..].iter().for_each(|c| anew.push(*c));
            let next = corners[4] - Vector3::new(0.5, 0.0, 0.0);
            simplex.push(next);
            anew.push(next);
            prop_assert_eq!(simplex.reduce(), anew.reduce());
        }

        #[test]
        fn the_origin_beside_a_flat_tetrahedron_is_outside(
            axes in [point(), point()], places in prop::collection::vec([1.0..2.0, -1.0..1.0f64], 4), off in prop_oneof![Just(0.0), 0.0..1.0f64],
        ) {
            let (Some(x), Some(z)) = (axes[0].try_normalize(0.1), axes[0].cross(&axes[1]).try_normalize(0.05)) else { return Ok(()) };
            let y = z.cross(&x);
            // Four points of a plane, but for rounding, at least a metre off along x.
            let corners: Vec<_> = places.iter().map(|[along, across]| x * *along + y * *across + z * off).collect();
            let mut simplex = Simplex::new(corners[0]);
            corners[1..].iter().for_each(|c| simplex.push(*c));
            let nearest = simplex.reduce();
            prop_assert!(nearest.is_some_and(|p| p.norm() > 1.0 - 1e-9), "{nearest:?}");
        }

        #[test]
        fn the_nearest_point_separates_the_simplex_from_the_origin(corners in prop::collection::vec(point(), 1..5)) {
            let mut simplex = Simplex::new(corners[0]);
            corners[1..].iter().for_each(|c| simplex.push(*c));
            if let Some(nearest) = simplex.reduce() {
                // Optimality: no corner is nearer along the direction of the nearest point.
                for corner in &corners {
                    prop_assert!(nearest.dot(corner) >= nearest.norm_squared() - 1e-9);
                }
            } else {
                // Inside: every direction has a corner ahead.
                for direction in &corners {
                    prop_assert!(corners.iter().any(|c| c.dot(direction) > 0.0));
                    prop_assert!(corners.iter().any(|c| c.dot(direction) < 0.0));
                }
            }
        }
    }
}
