//! Stage 4: signed distance to the obstacles' *surface* (the cubes of the occupied cells), on the lattice of cell corners.

use crate::map::VoxelMap;

/// Signed Euclidean distance at the corners of the map's cells.
pub struct Esdf {
    pub(crate) resolution: f64,
    pub(crate) origin: [f64; 3],
    pub(crate) nodes: [usize; 3],
    pub(crate) values: Vec<f32>,
}

/// Builds the field.
pub fn build(map: &VoxelMap) -> Esdf {
    let _ = map;
    todo!()
}

impl Esdf {
    /// Distance at a point by trilinear interpolation, m: positive outside, negative inside, to the obstacles' surface.
    /// At the nodes exact; between them within sqrt(3)/2 of a cell.
    pub fn distance(&self, p: [f64; 3]) -> f64 {
        let _ = (p, self.resolution, self.origin, self.nodes, &self.values);
        todo!()
    }

    /// Distance and its gradient, from the same eight corners.
    pub fn distance_gradient(&self, p: [f64; 3]) -> (f64, [f64; 3]) {
        let _ = p;
        todo!()
    }
}
