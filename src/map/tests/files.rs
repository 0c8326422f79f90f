//! The maps that are shipped with the crate.

use super::*;

#[path = "../../../examples/generate_maps.rs"]
mod generate_maps;

fn shipped(name: &str) -> Vec<u8> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("maps").join(name);
    std::fs::read(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()))
}

#[test]
fn the_maps_are_what_the_generator_makes() {
    for (name, bytes) in generate_maps::all() {
        assert!(shipped(name) == bytes, "maps/{name} differs: run `cargo run --example generate_maps`");
    }
}

#[test]
fn the_arch_bridges_are_where_they_should_be() {
    let map = good("arch_bridges.pcd", &shipped("arch_bridges.pcd"), &spec([0.02, 1.0]));
    assert_eq!((map.origin, map.dims), ([0.0; 3], [200, 200, 20]));
    let free = |x: std::ops::Range<usize>, y: usize, z: std::ops::Range<usize>| {
        x.clone().all(|i| z.clone().all(|k| !map.occupied([i, y, k])))
    };
    for y in 54..66 {
        // 1.00 x 0.45 m, a lintel of 0.25 m on top, pillars of 0.20 m.
        assert!(free(68..88, y, 0..9) && !free(68..69, y, 9..10) && map.occupied([87, y, 13]));
        assert!((0..14).all(|k| map.occupied([67, y, k]) && map.occupied([88, y, k])));
    }
    for y in 116..128 {
        // 0.60 x 0.90 m, a lintel of 0.10 m on top.
        assert!(free(104..116, y, 0..18) && map.occupied([104, y, 18]) && map.occupied([115, y, 19]));
        assert!((0..20).all(|k| map.occupied([103, y, k]) && map.occupied([116, y, k])));
    }
    // No way around: from side to side, up to 0.70 m, nothing but the openings.
    for (y, opening) in [(60, 68..88), (122, 104..116)] {
        for i in (0..200).filter(|i| !opening.contains(i)) {
            assert!((0..14).all(|k| map.occupied([i, y, k])), "a gap at {i}, {y}");
        }
    }
}

#[test]
fn maps_of_others_are_read_with_the_cells_they_are_known_to_have() {
    let barn = good("barn_29.pcd", &shipped("barn_29.pcd"), &spec([0.05, 0.3]));
    assert_eq!((barn.resolution, barn.statistics.not_finite), (0.05, 0));
    let sheet = shipped("depot.yaml");
    let image = shipped("depot.pgm");
    let inputs = MapInputs { name: "depot.yaml", bytes: &sheet, beside: Some(("depot.pgm", &image)) };
    let depot = parse(&inputs, &spec([0.05, 0.3]), 1.0).expect("good");
    assert_eq!((depot.dims, depot.statistics.unknown), ([604, 307, 6], 0));
    let voxels = shipped("levine_voxels.npy");
    let json = shipped("levine_voxels.json");
    let inputs = MapInputs { name: "l.npy", bytes: &voxels, beside: Some(("l.json", &json)) };
    let levine = parse(&inputs, &spec([0.05, 0.3]), 1.0).expect("good");
    assert_eq!((levine.dims, levine.origin), ([152, 277, 2], [-2.3, -0.3, 0.1]));
    // Occupied cells as counted by an independent reader.
    assert_eq!([barn.occupied_count(), depot.occupied_count(), levine.occupied_count()], [7875, 6 * 5947, 6402]);
}
