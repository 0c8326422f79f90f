//! How cost grows: `cargo run --release --example growth` prints time and peak memory of map, distance field and search, for
//! maps of 10 to 100 m side at 5 cm (20 cm high), ten times the obstacles, and 0 to 4 joints.
//!
//! Peak memory is the process' high-water mark above what it held before the stage, as Linux tells in /proc (elsewhere: -).

use std::time::Instant;

use trajc::esdf;
use trajc::geom::{Aabb, Pose2};
use trajc::map::VoxelMap;
use trajc::math::real;
use trajc::mission::Unknown;
use trajc::robot::{self, NoFiles, RobotInputs, RobotModel, spec};
use trajc::search::{self, Query, SearchOptions};

const ROBOT: &str = "
name: armed
urdf: armed.urdf
drive: {left: left, right: right, wheel_radius_m: 0.08, track_width_m: 0.32}
limits:
  wheel: {speed_mps: 1.0, acceleration_mps2: 1.0, jerk_mps3: 4.0}
  base: {angular_acceleration_radps2: 2.5, eta: 0.4}
";

/// A box of 0.4 x 0.4 x 0.15 m with so many arms on it, each of which turns over its side.
fn robot(arms: usize) -> RobotModel {
    let mut urdf = String::from(
        r#"<robot name="armed"><link name="base"><collision><origin xyz="0 0 0.075"/><geometry><box size="0.4 0.4 0.15"/>
        </geometry></collision></link>"#,
    );
    for (name, y) in [("left", 0.16), ("right", -0.16)] {
        urdf += &format!(
            r#"<link name="{name}_link"/><joint name="{name}" type="continuous"><parent link="base"/><child link="{name}_link"/>
            <origin xyz="0 {y} 0.08"/><axis xyz="0 1 0"/><limit effort="5" velocity="12.5"/></joint>"#
        );
    }
    for k in 0..arms {
        let x = 0.15 - 0.1 * k as f64;
        urdf += &format!(
            r#"<link name="arm{k}"><collision><origin xyz="0 0 0.1"/><geometry><box size="0.05 0.02 0.2"/></geometry></collision>
            </link><joint name="joint{k}" type="revolute"><parent link="base"/><child link="arm{k}"/><origin xyz="{x} 0.15 0.16"/>
            <axis xyz="1 0 0"/><limit lower="-1.5" upper="1.5" effort="5" velocity="1.5"/></joint>"#
        );
    }
    urdf += "</robot>";
    let limits =
        (0..arms).map(|k| format!("joint{k}: {{acceleration: 3.0, jerk: 15.0}}")).collect::<Vec<_>>().join(", ");
    let yaml = ROBOT.to_owned() + &format!("  joints: {{{limits}}}\n");
    let spec = spec::parse("robot.yaml", &yaml).expect("a robot.yaml");
    let overrides = Default::default();
    robot::parse(RobotInputs { spec: &spec, urdf: ("armed.urdf", &urdf), files: &mut NoFiles, overrides: &overrides })
        .expect("a robot")
}

/// Boxes of 0.3 to 0.8 m by a fixed generator, so many a square metre, away from the diagonal's ends.
fn boxes(side: f64, density: f64) -> Vec<Aabb> {
    let mut state = 7u64;
    let mut draw = |low: f64, high: f64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * (state >> 11) as f64 / (1u64 << 53) as f64
    };
    let scale = (0.2 / density.max(0.2)).sqrt();
    let mut out = Vec::new();
    for _ in 0..(density * side * side) as usize {
        let (x, y) = (draw(0.0, side), draw(0.0, side));
        let (a, b) = (scale * draw(0.3, 0.8), scale * draw(0.3, 0.8));
        let near = |end: f64| real::hypot(x + a / 2.0 - end, y + b / 2.0 - end) < 1.5;
        if !near(1.0) && !near(side - 1.0) {
            out.push(Aabb { min: [x, y, 0.0], max: [(x + a).min(side), (y + b).min(side), 0.2] });
        }
    }
    out
}

/// Held now and at most since the last reset, KiB.
fn memory() -> Option<[f64; 2]> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let of =
        |key: &str| status.lines().find_map(|l| l.strip_prefix(key)?.trim().strip_suffix("kB")?.trim().parse().ok());
    Some([of("VmRSS:")?, of("VmHWM:")?])
}

/// Runs a stage; its product, ms, and peak MiB above what was held.
fn measured<T>(work: impl FnOnce() -> T) -> (T, f64, String) {
    // 5: forget the high-water mark.
    let reset = std::fs::write("/proc/self/clear_refs", "5").is_ok();
    let before = memory().filter(|_| reset);
    let started = Instant::now();
    let made = work();
    let spent = started.elapsed().as_secs_f64() * 1e3;
    let peak = before
        .zip(memory())
        .map_or("-".to_owned(), |([held, _], [_, peak])| format!("{:.1}", (peak - held).max(0.0) / 1024.0));
    (made, spent, peak)
}

fn row(side: f64, density: f64, arms: usize) {
    let robot = robot(arms);
    let bounds = Aabb { min: [0.0; 3], max: [side, side, 0.2] };
    let boxes = boxes(side, density);
    let (map, map_ms, map_peak) =
        measured(|| VoxelMap::from_boxes(bounds, 0.05, &boxes, Unknown::Occupied).expect("the grid is not too large"));
    let (field, field_ms, field_peak) = measured(|| esdf::build(&map));
    let query = Query {
        start: Pose2::new(1.0, 1.0, 0.0),
        start_joints: vec![None; arms],
        goal: Pose2::new(side - 1.0, side - 1.0, 0.0),
        goal_within: 0.0,
        goal_yaw: None,
        goal_joints: vec![None; arms],
    };
    let options = SearchOptions { clearance: 0.03, reverse: false };
    let (found, search_ms, search_peak) = measured(|| search::search(&map, &field, &robot, &query, &options));
    let voxels = map.dims.iter().product::<usize>() as f64;
    let end = match &found {
        Ok(path) if path.expanded == 0 => format!("{:.0} m", path.length()),
        Ok(path) => format!("{:.0} m, {} states", path.length(), path.expanded),
        Err(error) => error.to_string().chars().take(40).collect(),
    };
    println!(
        "| {side} | {density} | {arms} | {:.2} | {map_ms:.1} / {map_peak} | {field_ms:.1} / {field_peak} | {search_ms:.1} / {search_peak} | {end} |",
        voxels * 1e-6
    );
}

/// Each row has a process of its own: what one has held would hide what the next one needs.
fn main() {
    let asked: Vec<f64> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    if let [side, density, arms] = asked[..] {
        return row(side, density, arms as usize);
    }
    println!("| side m | boxes/m² | joints | million voxels | map ms / MiB | field ms / MiB | search ms / MiB | way |");
    println!("|---|---|---|---|---|---|---|---|");
    let sides = [10, 20, 40, 70, 100].map(|side| [f64::from(side), 0.2, 1.0]);
    let densities = [0.2, 0.6, 2.0].map(|density| [20.0, density, 1.0]);
    let arms = [0, 1, 2, 3, 4].map(|arms| [20.0, 0.2, f64::from(arms)]);
    let own = std::env::current_exe().expect("this program's own path");
    for case in sides.iter().chain(&densities).chain(&arms) {
        let ended = std::process::Command::new(&own).args(case.map(|v| v.to_string())).status();
        assert!(ended.expect("it can be started").success());
    }
}
