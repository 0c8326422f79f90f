//! Trilinear interpolation of value and gradient, and what holds beyond the grid.

use super::Esdf;
use crate::math::real;
use crate::mission::Unknown;

/// The cell that holds a point, and where in it; and how far outside the grid the point lies, m.
struct Place {
    /// Index of the cell's lower corner.
    at: usize,
    /// Within the cell, 0..=1.
    u: [f64; 3],
    beyond: [f64; 3],
}

/// Least distance at the ends of `steps` equal parts of an upright line of `rise` m from `foot` up, and its gradient by x and y.
pub fn least_of_points(
    foot: [f64; 3],
    rise: f64,
    steps: usize,
    distance_gradient: impl Fn([f64; 3]) -> (f64, [f64; 3]),
) -> (f64, [f64; 3]) {
    let mut least = (f64::INFINITY, [0.0; 3]);
    for k in 0..=steps {
        let z = foot[2] + rise * k as f64 / steps as f64;
        let (distance, [x, y, _]) = distance_gradient([foot[0], foot[1], z]);
        if distance < least.0 {
            least = (distance, [x, y, 0.0]);
        }
    }
    least
}

impl Esdf {
    /// Distance at a point by trilinear interpolation, m: positive outside, negative inside, to the obstacles' surface.
    /// At the nodes exact; between them within sqrt(3)/2 of a cell. Beyond the grid: sideways negative where unknown space
    /// is an obstacle, else (and above and below always) a lower bound of the distance.
    #[inline]
    pub fn distance(&self, p: [f64; 3]) -> f64 {
        match self.inside(p) {
            Some((at, u)) => self.value(at, u),
            None => self.distance_gradient(p).0,
        }
    }

    /// Distance and its gradient, from the same eight corners. (`MATH` section 4; the gradient jumps at cell faces.)
    #[inline]
    pub fn distance_gradient(&self, p: [f64; 3]) -> (f64, [f64; 3]) {
        match self.inside(p) {
            Some((at, u)) => (self.value(at, u), self.gradient(at, u)),
            None => self.beyond(p),
        }
    }

    /// Least value on an upright line of `rise` m from `foot` up, and its gradient by x and y: bilinear between the least of the four
    /// columns of nodes around it. No more than the least of [`Self::distance`] along the line, and 1-Lipschitz as that is.
    pub fn least_above(&self, foot: [f64; 3], rise: f64) -> (f64, [f64; 3]) {
        // What reaches below or above the grid is further from all obstacles than what is next to it.
        let z = (foot[2] - self.origin[2]) * self.inverse_resolution;
        let (low, high) = (z.max(0.0), (z + rise * self.inverse_resolution).min(self.last[2]));
        let Some((at, [ux, uy, _])) = self.inside([foot[0], foot[1], self.origin[2]]) else {
            return self.least_sampled(foot, rise);
        };
        if low > high {
            return self.least_sampled(foot, rise);
        }
        let most = self.nodes[2] - 2;
        let (first, last) = ((low as usize).min(most), (high as usize).min(most));
        let [a, b, c, d] = self.least_of_columns(at + first, low - first as f64, last - first, high - last as f64);
        let (y0, y1) = (a + uy * (b - a), c + uy * (d - c));
        let scale = self.inverse_resolution;
        let by_y = ((1.0 - ux) * (b - a) + ux * (d - c)) * scale;
        (y0 + ux * (y1 - y0), [(y1 - y0) * scale, by_y, 0.0])
    }

    /// Least values of the four columns of nodes over a cell, from `low` of it up to `high` of the one `rows` further up.
    #[inline]
    fn least_of_columns(&self, at: usize, low: f64, rows: usize, high: f64) -> [f64; 4] {
        let row = self.nodes[2];
        let slab = self.nodes[1] * row;
        let column = |first: usize| &self.values[at + first..at + first + rows + 2];
        let columns = [column(0), column(row), column(slab), column(slab + row)];
        let between = |column: &[f32], k: usize, u: f64| {
            let (under, over) = (f64::from(column[k]), f64::from(column[k + 1]));
            under + u * (over - under)
        };
        // Side by side: four chains of comparisons instead of one. No value is NaN.
        let mut least = [0.0f32; 4];
        for (least, column) in least.iter_mut().zip(&columns) {
            *least = between(column, 0, low).min(between(column, rows, high)) as f32;
        }
        for k in 1..=rows {
            for (least, column) in least.iter_mut().zip(&columns) {
                *least = if column[k] < *least { column[k] } else { *least };
            }
        }
        [f64::from(least[0]), f64::from(least[1]), f64::from(least[2]), f64::from(least[3])]
    }

    /// The same where the line leaves the grid: by points of the line a cell apart, both ends among them.
    #[cold]
    fn least_sampled(&self, foot: [f64; 3], rise: f64) -> (f64, [f64; 3]) {
        let steps = (rise * self.inverse_resolution).ceil().max(1.0);
        least_of_points(foot, rise, steps as usize, |p| self.distance_gradient(p))
    }

    /// Lower corner of the cell and place in it, for points in the grid but its upper faces.
    #[inline]
    fn inside(&self, p: [f64; 3]) -> Option<(usize, [f64; 3])> {
        let scale = self.inverse_resolution;
        let q = [(p[0] - self.origin[0]) * scale, (p[1] - self.origin[1]) * scale, (p[2] - self.origin[2]) * scale];
        let top = self.last;
        // NaN fails every comparison and takes the slow way.
        let inside = q[0] >= 0.0 && q[1] >= 0.0 && q[2] >= 0.0 && q[0] < top[0] && q[1] < top[1] && q[2] < top[2];
        if !inside {
            return None;
        }
        let cell = [q[0] as usize, q[1] as usize, q[2] as usize];
        let u = [q[0] - cell[0] as f64, q[1] - cell[1] as f64, q[2] - cell[2] as f64];
        Some(((cell[0] * self.nodes[1] + cell[1]) * self.nodes[2] + cell[2], u))
    }

    #[cold]
    fn place(&self, p: [f64; 3]) -> Place {
        let mut cell = [0usize; 3];
        let mut u = [0.0f64; 3];
        let mut beyond = [0.0f64; 3];
        for a in 0..3 {
            let at = (p[a] - self.origin[a]) * self.inverse_resolution;
            let inside = at.clamp(0.0, self.last[a]);
            beyond[a] = (at - inside) * self.resolution;
            // A grid has one cell at least, so there are two nodes along each axis.
            cell[a] = (inside as usize).min(self.nodes[a] - 2);
            u[a] = inside - cell[a] as f64;
        }
        Place { at: (cell[0] * self.nodes[1] + cell[1]) * self.nodes[2] + cell[2], u, beyond }
    }

    fn beyond(&self, p: [f64; 3]) -> (f64, [f64; 3]) {
        let Place { at, u, beyond } = self.place(p);
        let (value, mut gradient) = (self.value(at, u), self.gradient(at, u));
        if beyond == [0.0; 3] {
            return (value, gradient);
        }
        for a in 0..3 {
            if beyond[a] != 0.0 {
                gradient[a] = 0.0;
            }
        }
        let sideways = real::hypot(beyond[0], beyond[1]);
        if self.outside == Unknown::Occupied && sideways > 0.0 {
            return (-sideways, [-beyond[0] / sideways, -beyond[1] / sideways, 0.0]);
        }
        // All obstacles lie in the grid, a convex box: by the obtuse angle at the foot of p, |p - q|^2 >= |p - foot|^2 +
        // |foot - q|^2 for each obstacle point q.
        let away = (sideways * sideways + beyond[2] * beyond[2]).sqrt();
        if value <= 0.0 {
            for a in 0..3 {
                gradient[a] += beyond[a] / away;
            }
            return (value + away, gradient);
        }
        let distance = real::hypot(value, away);
        for a in 0..3 {
            gradient[a] = (value * gradient[a] + beyond[a]) / distance;
        }
        (distance, gradient)
    }

    /// The eight corners of a cell, z fastest.
    #[inline]
    fn corners(&self, at: usize) -> [f64; 8] {
        let row = self.nodes[2];
        let slab = self.nodes[1] * row;
        let v = &self.values[at..at + slab + row + 2];
        let [a, b, c, d] = [0, row, slab, slab + row];
        [v[a], v[a + 1], v[b], v[b + 1], v[c], v[c + 1], v[d], v[d + 1]].map(f64::from)
    }

    #[inline]
    fn value(&self, at: usize, [ux, uy, uz]: [f64; 3]) -> f64 {
        let v = self.corners(at);
        let (z00, z01) = (v[0] + uz * (v[1] - v[0]), v[2] + uz * (v[3] - v[2]));
        let (z10, z11) = (v[4] + uz * (v[5] - v[4]), v[6] + uz * (v[7] - v[6]));
        let (y0, y1) = (z00 + uy * (z01 - z00), z10 + uy * (z11 - z10));
        y0 + ux * (y1 - y0)
    }

    #[inline]
    fn gradient(&self, at: usize, [ux, uy, uz]: [f64; 3]) -> [f64; 3] {
        let v = self.corners(at);
        let (z00, z01) = (v[0] + uz * (v[1] - v[0]), v[2] + uz * (v[3] - v[2]));
        let (z10, z11) = (v[4] + uz * (v[5] - v[4]), v[6] + uz * (v[7] - v[6]));
        let (y0, y1) = (z00 + uy * (z01 - z00), z10 + uy * (z11 - z10));
        let scale = self.inverse_resolution;
        let dx = (y1 - y0) * scale;
        let dy = ((1.0 - ux) * (z01 - z00) + ux * (z11 - z10)) * scale;
        let (low_y, high_y) = (1.0 - uy, uy);
        let dz = ((1.0 - ux) * (low_y * (v[1] - v[0]) + high_y * (v[3] - v[2]))
            + ux * (low_y * (v[5] - v[4]) + high_y * (v[7] - v[6])))
            * scale;
        [dx, dy, dz]
    }
}
