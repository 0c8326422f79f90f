//! Every format reads what its writer wrote: the same points, the same map.

use super::writers::{Kind, npy, pcd, ply};
use super::*;

/// The map of the points themselves.
fn expected(spec: &MapSpec) -> VoxelMap {
    let slab = spec.height.map(|[low, high]| Slab { low, high }).expect("given");
    voxelize::points(&points::Points::List(cloud()), 0.05, slab, spec.unknown).expect("good points")
}

#[test]
fn all_kinds_of_pcd_make_the_same_map() {
    let spec = spec([0.02, 1.0]);
    for kind in [Kind::Ascii, Kind::Little, Kind::Compressed] {
        assert_eq!(good("a.pcd", &pcd(&cloud(), kind), &spec), expected(&spec), "{kind:?}");
    }
}

#[test]
fn organised_pcd_and_old_names_are_read() {
    let text = "VERSION .5\nCOLUMNS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 2\nHEIGHT 2\nDATA ascii\n\
                0 0 0\n1 0 nan\r\nNaN nan NAN\n1 1 0.5\n";
    let map = good("a.PCD", text.as_bytes(), &spec([0.02, 1.0]));
    assert_eq!((map.statistics.points, map.statistics.not_finite, map.statistics.cut), (4, 2, 1));
    assert_eq!(map.cells().collect::<Vec<_>>(), [[20, 20, 0]]);
}

#[test]
fn integer_coordinates_are_metres() {
    let mut bytes = b"FIELDS x y z\nSIZE 1 2 8\nTYPE I U I\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA binary\n".to_vec();
    bytes.push((-3i8) as u8);
    bytes.extend(500u16.to_le_bytes());
    bytes.extend(1i64.to_le_bytes());
    let map = good("a.pcd", &bytes, &spec([0.0, 2.0]));
    assert_eq!((map.origin, map.dims), ([-3.0, 500.0, 1.0], [1, 1, 1]));
}

#[test]
fn all_kinds_of_ply_make_the_same_map() {
    let spec = spec([0.02, 1.0]);
    for (kind, lists) in [Kind::Ascii, Kind::Little, Kind::Big].into_iter().flat_map(|k| [(k, false), (k, true)]) {
        assert_eq!(good("a.ply", &ply(&cloud(), kind, lists), &spec), expected(&spec), "{kind:?} {lists}");
    }
}

#[test]
fn tables_are_read_whatever_separates_them() {
    let spec = spec([0.02, 1.0]);
    let row = |p: &[f64; 3], s: &str| format!("{}{s}{}{s}{}\n", p[0], p[1], p[2]);
    let table = |head: &str, s: &str| head.to_owned() + &cloud().iter().map(|p| row(p, s)).collect::<String>();
    for (name, text) in [
        ("a.xyz", table("# a scan\n// of a room\n\n", " ")),
        ("a.txt", table("", "\t ")),
        ("a.csv", table("\u{feff}x,y,z\r\n", ", ")),
        ("a.csv", table("x_m;y_m;z_m\n", ";")),
        ("a.csv", table("\"X\",\"Y\",\"Z\"\n", ",")),
    ] {
        assert_eq!(good(name, text.as_bytes(), &spec), expected(&spec), "{text:.30}");
    }
    let reordered: String = cloud().iter().map(|p| format!("9,{},{},{},red\n", p[2], p[0], p[1])).collect();
    let text = format!("intensity,Z_m,x_m,y_m,colour\n{reordered}");
    assert_eq!(good("a.csv", text.as_bytes(), &spec), expected(&spec));
}

#[test]
fn tables_of_points_in_npy_are_read_in_both_orders() {
    let spec = spec([0.02, 1.0]);
    let points = cloud();
    let n = points.len() as u64;
    let rows: Vec<f64> = points.iter().flatten().copied().collect();
    let columns: Vec<f64> = (0..3).flat_map(|a| points.iter().map(move |p| p[a])).collect();
    let bytes = |values: &[f64]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let narrow = |values: &[f64]| values.iter().flat_map(|v| (*v as f32).to_be_bytes()).collect::<Vec<u8>>();
    for file in [
        npy("<f8", false, &[n, 3], &bytes(&rows)),
        npy("<f8", true, &[n, 3], &bytes(&columns)),
        npy(">f4", false, &[n, 3], &narrow(&rows)),
        npy(">f4", true, &[n, 3], &narrow(&columns)),
    ] {
        assert_eq!(good("a.npy", &file, &spec), expected(&spec));
    }
}

/// `tests/vectors/numpy_cloud.py` wrote the file.
#[test]
fn npy_of_numpy_itself_is_read() {
    let spec = spec([0.02, 1.0]);
    let file = include_bytes!("../../../tests/vectors/numpy_cloud.npy");
    assert_eq!(good("a.npy", file, &spec), expected(&spec));
}

fn occupied(i: usize, j: usize, k: usize) -> bool {
    (i * 7 + j * 3 + k * 5).is_multiple_of(4)
}

/// A 3 x 4 x 5 grid, some voxels of it occupied, in both orders and as different types.
fn voxel_files() -> Vec<Vec<u8>> {
    let all = || (0..3).flat_map(move |i| (0..4).flat_map(move |j| (0..5).map(move |k| (i, j, k))));
    let c: Vec<u8> = all().map(|(i, j, k)| u8::from(occupied(i, j, k))).collect();
    let mut f = vec![0; 60];
    all().for_each(|(i, j, k)| f[i + 3 * j + 12 * k] = u8::from(occupied(i, j, k)));
    let wide = c.iter().flat_map(|v| (-256 * i32::from(*v)).to_be_bytes()).collect::<Vec<u8>>();
    vec![npy("|b1", false, &[3, 4, 5], &c), npy("|u1", true, &[3, 4, 5], &f), npy(">i4", false, &[3, 4, 5], &wide)]
}

#[test]
fn voxels_keep_whole_cubes_whose_centre_is_in_the_slab() {
    for file in voxel_files() {
        // Centres at 0.5, 1.5, ... above the origin -1: layers 1, 2 and 3 are kept.
        let beside = br#"{"resolution": 1, "origin": [-10, 20.5, -1], "axes": "a note"}"#;
        let inputs = MapInputs { name: "v.npy", bytes: &file, beside: Some(("v.json", beside)) };
        let map = parse(&inputs, &spec([0.5, 2.5]), 9.0).expect("good");
        assert_eq!((map.dims, map.origin, map.resolution), ([3, 4, 3], [-10.0, 20.5, 0.0], 1.0));
        let mut cut = 0;
        for (i, j, k) in (0..3).flat_map(|i| (0..4).flat_map(move |j| (0..5).map(move |k| (i, j, k)))) {
            match k {
                1..=3 => assert_eq!(map.occupied([i, j, k - 1]), occupied(i, j, k)),
                _ => cut += usize::from(occupied(i, j, k)),
            }
        }
        assert_eq!(map.statistics.cut, cut);
    }
}

#[test]
fn the_missions_origin_wins_and_its_resolution_must_agree() {
    let file = voxel_files().remove(0);
    let beside: &[u8] = br#"{"resolution": 0.1, "origin": [1, 2, 3]}"#;
    let with = |beside, resolution, origin| {
        let spec = MapSpec { resolution, origin, ..spec([-100.0, 100.0]) };
        let inputs = MapInputs { name: "v.npy", bytes: &file, beside };
        parse(&inputs, &spec, 1.0).map(|map| (map.resolution, map.origin)).map_err(|d| d.0[0].code)
    };
    let both = Some(("v.json", beside));
    assert_eq!(with(both, None, None), Ok((0.1, [1.0, 2.0, 3.0])));
    assert_eq!(with(both, Some(0.1), Some([0.0; 3])), Ok((0.1, [0.0; 3])));
    assert_eq!(with(both, Some(0.2), None), Err("map/resolution-differs"));
    assert_eq!(with(None, Some(0.2), None), Ok((0.2, [0.0; 3])));
    assert_eq!(with(None, None, None), Err("map/resolution"));
    assert_eq!(with(Some(("v.json", b"{\"resolution\": \"big\"}")), None, None), Err("map/description"));
    assert_eq!(with(Some(("v.json", b"[[[[[")), None, None), Err("map/description"));
    assert_eq!(with(Some(("v.json", b"{\"resolution\": 0}")), None, None), Err("map/resolution"));
}

#[test]
fn the_file_beside_is_named_from_the_maps_folder() {
    let voxels = voxel_files().remove(0);
    assert_eq!(beside("maps/v.npy", &voxels), Ok(Some((PathBuf::from("maps/v.json"), None))));
    assert_eq!(beside("maps/p.npy", &npy("<f8", false, &[0, 3], &[])), Ok(None));
    assert_eq!(beside("maps/p.pcd", b""), Ok(None));
    let sheet = b"image: pictures/a.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n";
    let (image, named) = beside("maps/a.yaml", sheet).expect("good").expect("an image");
    let named = named.expect("a place");
    assert_eq!(image, PathBuf::from("maps/pictures/a.pgm"));
    assert!(named.source.text[named.range].starts_with("pictures/a.pgm"));
    assert!(beside("maps/a.yaml", b"image: [\n").is_err());
}
