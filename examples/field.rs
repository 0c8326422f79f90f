//! The distance field of a grid, as often as asked: the half of `examples/field_peer.py` that is ours.
//!
//! `field NX NY NZ RESOLUTION FILE`: the file holds a byte a voxel, z fastest, not 0 where occupied. Every line read from stdin is a
//! command, answered by a line:
//!
//! - `field THREADS`: builds the field; wall time, and processor time of the first thread, in s.
//! - `write FILE`: the last field's values at the nodes, f32, z fastest.

use std::io::BufRead;
use std::time::Instant;

use trajc::esdf::{self, Esdf};
use trajc::map::VoxelMap;
use trajc::mission::Unknown;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let dims = [1, 2, 3].map(|a: usize| args[a].parse().expect("a number of voxels"));
    let mut map = VoxelMap::new(args[4].parse().expect("a resolution"), [0.0; 3], dims, Unknown::Free);
    for (at, voxel) in std::fs::read(&args[5]).expect("the voxels").into_iter().enumerate() {
        if voxel != 0 {
            map.occupy([at / (dims[1] * dims[2]), at / dims[2] % dims[1], at % dims[2]]);
        }
    }
    let mut field: Option<Esdf> = None;
    for line in std::io::stdin().lock().lines() {
        let line = line.expect("text");
        let (command, value) = line.split_once(' ').expect("a command and its value");
        if command == "write" {
            let field = field.as_ref().expect("a field first");
            let mut bytes = Vec::new();
            for i in 0..=dims[0] {
                for j in 0..=dims[1] {
                    (0..=dims[2]).for_each(|k| bytes.extend((field.at_node([i, j, k]) as f32).to_le_bytes()));
                }
            }
            std::fs::write(value, bytes).expect("room");
            println!("written");
            continue;
        }
        // As a peer's result is given back before its next run.
        drop(field.take());
        let threads = value.parse().expect("a number of threads");
        let (started, before) = (Instant::now(), processor_time());
        let built = esdf::build_in_threads(&map, threads);
        println!("{} {}", started.elapsed().as_secs_f64(), processor_time() - before);
        field = Some(built);
    }
}

/// Of this thread, s; to a tick.
fn processor_time() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/schedstat").unwrap_or_default();
    stat.split(' ').next().and_then(|ns| ns.parse::<f64>().ok()).unwrap_or(f64::NAN) * 1e-9
}
