//! Tests of the whole stage: bytes in, cells out.

mod cells;
mod faults;
mod files;
mod formats;
mod images;
mod las;
mod octrees;
mod writers;

use super::*;

/// A mission's `map:` with nothing but a height.
fn spec(height: [f64; 2]) -> MapSpec {
    MapSpec {
        file: PathBuf::from("map"),
        resolution: None,
        height: Some(height),
        unknown: Unknown::Occupied,
        origin: None,
        keep_out: Vec::new(),
        boxes: Vec::new(),
        speed_zones: Vec::new(),
    }
}

fn inputs<'a>(name: &'a str, bytes: &'a [u8]) -> MapInputs<'a> {
    MapInputs { name, bytes, beside: None }
}

/// Reads a map that must be good.
fn good(name: &str, bytes: &[u8], spec: &MapSpec) -> VoxelMap {
    parse(&inputs(name, bytes), spec, 1.0).unwrap_or_else(|d| panic!("{name}: {d:?}"))
}

/// The codes and messages of a map that must be bad.
fn bad(name: &str, bytes: &[u8], spec: &MapSpec) -> Vec<(&'static str, String)> {
    let diagnostics = parse(&inputs(name, bytes), spec, 1.0).expect_err(name);
    assert!(!diagnostics.0.is_empty());
    for d in &diagnostics.0 {
        assert!(d.at.is_some() || d.file.as_deref() == Some(name), "no place: {d:?}");
        assert_eq!(d.severity, crate::diag::Severity::BadInput);
    }
    diagnostics.0.into_iter().map(|d| (d.code, d.message)).collect()
}

/// The only code.
fn code(name: &str, bytes: &[u8]) -> &'static str {
    let faults = bad(name, bytes, &spec([0.02, 1.0]));
    assert_eq!(faults.len(), 1, "{faults:?}");
    faults[0].0
}

/// Points that f32 holds exactly; floor, obstacles and what is cut.
fn cloud() -> Vec<[f64; 3]> {
    let mut points = vec![[-1.0, -2.0, 0.0], [1.5, 2.25, 0.0], [0.0, 0.0, 2.5]];
    points.extend((0..40u32).map(|k| {
        let k = f64::from(k);
        [(k * 0.25).rem_euclid(2.0) - 0.75, (k * 0.375).rem_euclid(3.0) - 1.5, k / 64.0]
    }));
    points
}
