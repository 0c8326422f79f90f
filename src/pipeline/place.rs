//! A map and its distance field, as missions share them.

use std::ops::Deref;
use std::sync::{Arc, OnceLock};

use crate::esdf::{self, Esdf};
use crate::map::VoxelMap;

/// Cells from which on a map's distance field is worth more than one thread.
const LARGE_MAP: usize = 20_000_000;

/// A map with its distance field, which is made when it is first asked for. Clones are one and the same: missions that share a
/// map build the field once, on however many threads they are compiled.
#[derive(Clone)]
pub struct Place(Arc<(VoxelMap, OnceLock<Esdf>)>);

impl Place {
    /// Signed distance to the obstacles; the first caller builds it, of a large map in so many threads, others wait for it.
    pub fn field(&self, threads: usize) -> &Esdf {
        let (map, field) = &*self.0;
        let threads = if map.dims.iter().product::<usize>() < LARGE_MAP { 1 } else { threads };
        field.get_or_init(|| esdf::build_in_threads(map, threads))
    }
}

impl Deref for Place {
    type Target = VoxelMap;

    fn deref(&self) -> &VoxelMap {
        &self.0.0
    }
}

impl From<VoxelMap> for Place {
    fn from(map: VoxelMap) -> Self {
        Self(Arc::new((map, OnceLock::new())))
    }
}
