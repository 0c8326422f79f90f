//! A map and its distance field, as missions share them.

use std::ops::Deref;
use std::sync::{Arc, OnceLock};

use crate::diag::{Diagnostic, Diagnostics};
use crate::esdf::{self, Esdf};
use crate::map::VoxelMap;
use crate::memory;

/// Cells from which on a map's distance field is worth more than one thread.
const LARGE_MAP: usize = 20_000_000;

/// A map with its distance field, which is made when it is first asked for. Clones are one and the same: missions that share a
/// map build the field once, on however many threads they are compiled.
#[derive(Clone)]
pub struct Place(Arc<(VoxelMap, OnceLock<Esdf>)>);

impl Place {
    /// Asks for the memory that the field takes.
    ///
    /// # Errors
    /// It and the map would take more than may be used: `map/too-large`.
    pub fn has_room(&self) -> Result<(), Diagnostics> {
        let map = &self.0.0;
        let cells = map.dims.iter().map(|n| *n as u128).product::<u128>();
        let nodes = map.dims.iter().map(|n| *n as u128 + 1).product::<u128>();
        memory::fits(nodes * size_of::<f32>() as u128 + cells / 8).map_err(|fault| {
            let [x, y, z] = map.dims;
            let message = format!("the distance field of the map's {x} x {y} x {z} cells would take {fault}");
            let hint = format!(
                "larger cells (resolution_m) take less, and so does a map cut to what is driven on; or {}",
                memory::HINT
            );
            Diagnostic::error("map/too-large", message).hint(hint).into()
        })
    }

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
