//! Trilinear interpolation of value and gradient, and what holds beyond the grid.

use super::Esdf;
use crate::mission::Unknown;

impl Esdf {
    /// Distance at a point by trilinear interpolation, m: positive outside, negative inside, to the obstacles' surface.
    /// At the nodes exact; between them within sqrt(3)/2 of a cell. Beyond the grid: sideways negative where unknown space
    /// is an obstacle, else (and above and below always) a lower bound of the distance.
    pub fn distance(&self, p: [f64; 3]) -> f64 {
        self.distance_gradient(p).0
    }

    /// Distance and its gradient, from the same eight corners. (`MATH` section 4; the gradient jumps at cell faces.)
    pub fn distance_gradient(&self, p: [f64; 3]) -> (f64, [f64; 3]) {
        let mut cell = [0usize; 3];
        let mut u = [0.0f64; 3];
        let mut beyond = [0.0f64; 3];
        for a in 0..3 {
            let last = (self.nodes[a] - 1) as f64;
            let at = (p[a] - self.origin[a]) / self.resolution;
            let inside = at.clamp(0.0, last);
            beyond[a] = (at - inside) * self.resolution;
            // A grid has one cell at least, so there are two nodes along each axis.
            cell[a] = (inside as usize).min(self.nodes[a] - 2);
            u[a] = inside - cell[a] as f64;
        }
        let (value, mut gradient) = self.interpolate(cell, u);
        if beyond == [0.0; 3] {
            return (value, gradient);
        }
        for a in 0..3 {
            if beyond[a] != 0.0 {
                gradient[a] = 0.0;
            }
        }
        let sideways = beyond[0].hypot(beyond[1]);
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
        let distance = value.hypot(away);
        for a in 0..3 {
            gradient[a] = (value * gradient[a] + beyond[a]) / distance;
        }
        (distance, gradient)
    }

    #[inline]
    fn interpolate(&self, cell: [usize; 3], u: [f64; 3]) -> (f64, [f64; 3]) {
        let row = self.nodes[2];
        let slab = self.nodes[1] * row;
        let at = cell[0] * slab + cell[1] * row + cell[2];
        let v = &self.values;
        let pair = |i: usize| (f64::from(v[i]), f64::from(v[i + 1]));
        let (v000, v001) = pair(at);
        let (v010, v011) = pair(at + row);
        let (v100, v101) = pair(at + slab);
        let (v110, v111) = pair(at + slab + row);
        let [ux, uy, uz] = u;
        let (z00, z01) = (v000 + uz * (v001 - v000), v010 + uz * (v011 - v010));
        let (z10, z11) = (v100 + uz * (v101 - v100), v110 + uz * (v111 - v110));
        let (y0, y1) = (z00 + uy * (z01 - z00), z10 + uy * (z11 - z10));
        let value = y0 + ux * (y1 - y0);
        let scale = 1.0 / self.resolution;
        let dx = (y1 - y0) * scale;
        let dy = ((1.0 - ux) * (z01 - z00) + ux * (z11 - z10)) * scale;
        let (low_y, high_y) = (1.0 - uy, uy);
        let dz = ((1.0 - ux) * (low_y * (v001 - v000) + high_y * (v011 - v010))
            + ux * (low_y * (v101 - v100) + high_y * (v111 - v110)))
            * scale;
        (value, [dx, dy, dz])
    }
}
