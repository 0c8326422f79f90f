//! Which cell a point belongs to, and which rectangle was seen: against a voxeliser without any cleverness.

use std::collections::BTreeSet;

use super::writers::{Kind, pcd};
use super::*;
use proptest::prelude::*;

/// Occupied cells as integers on the map frame's own grid, and the seen rectangle in cells.
fn brute_force(points: &[[f64; 3]], resolution: f64, height: [f64; 2]) -> (BTreeSet<[i64; 3]>, [[i64; 2]; 2]) {
    let cell = |p: &[f64; 3]| p.map(|c| (c / resolution).floor() as i64);
    let finite: Vec<&[f64; 3]> = points.iter().filter(|p| p.iter().all(|c| c.is_finite())).collect();
    let range = |a: usize| {
        let cells = || finite.iter().map(|p| cell(p)[a]);
        [cells().min().expect("points"), cells().max().expect("points") + 1]
    };
    let occupied = finite.iter().filter(|p| (height[0]..=height[1]).contains(&p[2])).map(|p| cell(p)).collect();
    (occupied, [range(0), range(1)])
}

fn on_the_frames_grid(map: &VoxelMap) -> (BTreeSet<[i64; 3]>, [[i64; 2]; 2]) {
    let first = map.origin.map(|c| (c / map.resolution).round() as i64);
    let cells = map.cells().map(|cell| [0, 1, 2].map(|a| first[a] + cell[a] as i64)).collect();
    (cells, [0, 1].map(|a| [first[a], first[a] + map.dims[a] as i64]))
}

fn coordinate() -> impl Strategy<Value = f64> {
    // On, just below and just above borders of cells; anywhere; and nothing at all.
    prop_oneof![
        6 => (-60i32..60).prop_map(|k| f64::from(k) * 0.05),
        2 => (-60i32..60).prop_map(|k| (f64::from(k) * 0.05).next_up()),
        2 => (-60i32..60).prop_map(|k| (f64::from(k) * 0.05).next_down()),
        2 => (-60i32..60).prop_map(|k| f64::from(k as f32 * 0.05f32)),
        4 => -3.0..3.0f64,
        1 => prop::sample::select(vec![f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -0.0]),
    ]
}

proptest! {
    #[test]
    fn cells_are_those_of_a_brute_force_voxeliser(
        points in prop::collection::vec([coordinate(), coordinate(), coordinate()], 1..60),
        resolution in prop::sample::select(vec![0.05, 0.1, 0.03, 0.25, 1.0]),
        low in -2.0..1.0f64,
        thickness in 0.0..2.0f64,
    ) {
        let spec = MapSpec { resolution: Some(resolution), ..spec([low, low + thickness]) };
        let text: String = points.iter().map(|p| format!("{} {} {}\n", p[0], p[1], p[2])).collect();
        let not_finite = points.iter().filter(|p| !p.iter().all(|c| c.is_finite())).count();
        let result = parse(&inputs("a.xyz", text.as_bytes()), &spec, 1.0);
        if not_finite == points.len() {
            prop_assert_eq!(result.expect_err("no points").0[0].code, "map/no-points");
            return Ok(());
        }
        let map = result.expect("good points");
        prop_assert_eq!(on_the_frames_grid(&map), brute_force(&points, resolution, [low, low + thickness]));
        prop_assert_eq!(map.statistics.points, points.len());
        prop_assert_eq!(map.statistics.not_finite, not_finite);
        let within = points.iter().filter(|p| p.iter().all(|c| c.is_finite()) && (low..=low + thickness).contains(&p[2]));
        prop_assert_eq!(map.statistics.cut, points.len() - not_finite - within.count());
        // As tight as the cells in z, and not empty.
        let layers: BTreeSet<usize> = map.cells().map(|c| c[2]).collect();
        if let (Some(first), Some(last)) = (layers.first(), layers.last()) {
            prop_assert_eq!((*first, *last), (0, map.dims[2] - 1));
        } else {
            prop_assert_eq!(map.dims[2], 1);
        }
    }

    #[test]
    fn a_cell_is_the_floor_of_the_quotient(p in -1e6..1e6f64, resolution in 1e-3..10.0f64) {
        prop_assert_eq!(voxelize::cell(p, resolution), (p / resolution).floor() as i64);
    }
}

#[test]
fn a_point_on_a_border_belongs_to_the_upper_cell_below_zero_too() {
    for (p, expected) in
        [(0.0, 0), (-0.0, 0), (0.05, 1), (-0.05, -1), (-1e-300, -1), (0.15, 2), (-0.15, -3), (-0.025, -1)]
    {
        // 0.15 / 0.05 is 2.9999999999999996 in f64: the contract is the quotient's floor, not the number a person reads.
        assert_eq!(voxelize::cell(p, 0.05), expected, "{p}");
    }
}

#[test]
fn without_a_height_the_slab_is_from_the_floor_to_the_robots_top() {
    let text = "0 0 0.019\n0 0 0.02\n0 0 0.3\n1 1 0.5\n1 1 0.501\n";
    let spec = MapSpec { height: None, ..spec([0.0, 0.0]) };
    let map = parse(&inputs("a.xyz", text.as_bytes()), &spec, 0.5).expect("good");
    assert_eq!((map.statistics.cut, map.occupied_count()), (2, 3));
}

#[test]
fn a_map_with_nothing_in_the_slab_has_no_obstacles_but_its_rectangle() {
    let map = good("a.xyz", b"-1 -1 0\n1 1 0\n", &spec([0.02, 1.0]));
    assert_eq!((map.occupied_count(), map.dims, map.statistics.cut), (0, [41, 41, 1], 2));
    assert_eq!(map.outside, Unknown::Occupied);
}

#[test]
fn cells_iterates_over_what_was_occupied() {
    let mut map = VoxelMap::new(0.1, [0.0; 3], [3, 4, 130], Unknown::Free);
    let cells = [[0, 0, 0], [0, 3, 129], [1, 2, 63], [1, 2, 64], [2, 3, 5]];
    cells.iter().for_each(|c| map.occupy(*c));
    assert_eq!(map.cells().collect::<Vec<_>>(), cells);
    assert_eq!(map.occupied_count(), cells.len());
    map.occupy_column(2, 3);
    assert_eq!(map.occupied_count(), cells.len() - 1 + 130);
}

#[test]
fn points_far_away_and_grids_too_large_are_refused_with_what_would_do() {
    let far = bad("a.xyz", b"0 0 0.1\n4500000 0 0.1\n", &spec([0.0, 1.0]));
    assert_eq!(
        far,
        [("map/far-away", "coordinates reach 4500000 m along x: farther than 1000000 m from the origin".into())]
    );
    let large = parse(&inputs("a.xyz", b"0 0 0.1\n10000 10000 0.1\n"), &spec([0.0, 1.0]), 1.0).expect_err("too large");
    assert_eq!(large.0[0].code, "map/too-large");
    let hint = large.0[0].hint.clone().expect("a hint");
    let enough: f64 = hint.split_whitespace().nth(1).and_then(|w| w.parse().ok()).expect("a number in the hint");
    assert!((0.3..=0.7).contains(&enough), "{hint}");
    let spec = MapSpec { resolution: Some(1e-9), ..spec([0.0, 1.0]) };
    assert_eq!(bad("a.xyz", b"0 0 0.1\n", &spec)[0].0, "map/resolution");
}

#[test]
fn binary_points_are_not_copied() {
    let file = pcd(&cloud(), Kind::Little);
    let points = pcd::read("a.pcd", &file).expect("good");
    assert!(matches!(points, points::Points::Packed { bytes: std::borrow::Cow::Borrowed(_), .. }));
}
