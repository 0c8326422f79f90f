//! The distance field: building it, beside the plain transform that the tests compare it with, and looking it up.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use trajc::esdf::{self, FAR};
use trajc::geom::Aabb;
use trajc::map::VoxelMap;
use trajc::mission::Unknown;
// The plain transform names its imports as inside the crate.
use trajc::{map, mission};

#[path = "../src/esdf/reference.rs"]
mod reference;

const CELL: f64 = 0.05;

/// Halls of 10 x 10 x 1 m side by side: two walls with an arch bridge each, and cubes, as in maps/arch_bridges.pcd.
fn arch_bridges(halls: u32) -> VoxelMap {
    let mut blocks = Vec::new();
    for (x, y, width, height, lintel) in [(64, 54, 20, 9, 5), (100, 116, 12, 18, 2)] {
        let (depth, wall, top, end) = ([y, y + 12], [y + 4, y + 8], height + lintel, x + width + 8);
        blocks.push([[x, x + 4], depth, [0, top]]);
        blocks.push([[end - 4, end], depth, [0, top]]);
        blocks.push([[x + 4, end - 4], depth, [height, top]]);
        blocks.push([[0, x], wall, [0, 14]]);
        blocks.push([[end, 200], wall, [0, 14]]);
    }
    let cubes = [(30, 18, 12), (62, 8, 16), (110, 22, 16), (150, 30, 12), (172, 6, 8), (14, 36, 8), (40, 84, 16)];
    let more = [(84, 82, 8), (134, 88, 16), (170, 74, 12), (134, 150, 16), (84, 152, 12)];
    blocks.extend(cubes.into_iter().chain(more).map(|(x, y, edge)| [[x, x + edge], [y, y + edge], [0, edge]]));
    let boxes: Vec<Aabb> = (0..halls * halls)
        .flat_map(|hall| {
            let shift = [200 * (hall / halls), 200 * (hall % halls), 0];
            blocks.iter().map(move |block| {
                let corner = |end: usize| [0, 1, 2].map(|a: usize| f64::from(block[a][end] + shift[a]) * CELL);
                Aabb { min: corner(0), max: corner(1) }
            })
        })
        .collect();
    let side = 10.0 * f64::from(halls);
    let bounds = Aabb { min: [0.0; 3], max: [side, side, 1.0] };
    VoxelMap::from_boxes(bounds, CELL, &boxes, Unknown::Occupied).expect("a legal scene")
}

/// A reproducible stream in 0..1.
fn stream() -> impl FnMut() -> f64 {
    let mut state = 88_172_645_463_325_252u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn random(part: f64) -> VoxelMap {
    let dims = [200, 200, 20];
    let mut map = VoxelMap::new(CELL, [0.0; 3], dims, Unknown::Occupied);
    let mut next = stream();
    for cell in 0..dims.iter().product() {
        if next() < part {
            map.occupy([cell / (dims[1] * dims[2]), cell / dims[2] % dims[1], cell % dims[2]]);
        }
    }
    map
}

fn build(criterion: &mut Criterion) {
    let maps = [
        ("arch bridges 200 x 200 x 20", arch_bridges(1)),
        ("2 % random 200 x 200 x 20", random(0.02)),
        ("50 % random 200 x 200 x 20", random(0.5)),
        ("empty 200 x 200 x 20", VoxelMap::new(CELL, [0.0; 3], [200, 200, 20], Unknown::Occupied)),
        ("arch bridges 1000 x 1000 x 20", arch_bridges(5)),
    ];
    for (name, map) in &maps {
        let mut group = criterion.benchmark_group(*name);
        group.sample_size(10);
        let nodes = map.dims.map(|d| d + 1);
        group.bench_function("plain", |b| b.iter(|| reference::signed_distance(black_box(map), nodes)));
        group.bench_function("build", |b| b.iter(|| esdf::build(black_box(map))));
        group.finish();
    }
}

/// 1e5 points around a wandering robot.
fn look_up(criterion: &mut Criterion) {
    let field = esdf::build(&arch_bridges(1));
    let mut next = stream();
    let high = [9.99, 9.99, 0.99];
    let mut centre = [5.0, 5.0, 0.5];
    let points: Vec<[f64; 3]> = (0..100_000)
        .map(|_| {
            centre = [0, 1, 2].map(|a: usize| (centre[a] + 0.1 * (next() - 0.5)).clamp(0.01, high[a]));
            [0, 1, 2].map(|a: usize| (centre[a] + 0.4 * (next() - 0.5)).clamp(0.0, high[a]))
        })
        .collect();
    let mut group = criterion.benchmark_group("1e5 look-ups");
    group.bench_function("distance", |b| b.iter(|| points.iter().map(|p| field.distance(black_box(*p))).sum::<f64>()));
    group.bench_function("distance and gradient", |b| {
        b.iter(|| {
            let sum = |(value, gradient): (f64, [f64; 3])| value + gradient[0] + gradient[1] + gradient[2];
            points.iter().map(|p| sum(field.distance_gradient(black_box(*p)))).sum::<f64>()
        });
    });
    group.finish();
}

criterion_group!(benches, look_up, build);
criterion_main!(benches);
