//! Properties of whole runs: whatever small mission compiles, its file is reproducible, replays to the goal, and passes the
//! check of someone who has only the file.

use proptest::prelude::*;
use trajc::certify::{END_ANGLE_TOLERANCE, END_POINT_TOLERANCE};
use trajc::command::CommandTable;
use trajc::emit::csv::{self, CsvHeader};
use trajc::geom::{Pose2, wrap_angle};
use trajc::inputs;
use trajc::math::real;
use trajc::pipeline::{self, CompileOptions, Outcome};

/// A mission on the small shipped map.
fn mission(start: [f64; 3], goal: [f64; 3], step: f64) -> String {
    let root = env!("CARGO_MANIFEST_DIR");
    format!(
        "robot: {root}/robots/box_base/robot.yaml\nmap: {{file: {root}/maps/first.csv}}\n\
         start: {{x_m: {}, y_m: {}, yaw: {}}}\ngoal: {{x_m: {}, y_m: {}, yaw: {}}}\n\
         clearance_m: 0.02\nsampling_time_s: {step}\n",
        start[0], start[1], start[2], goal[0], goal[1], goal[2]
    )
}

fn compile(text: &str) -> Outcome {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("m.yaml");
    std::fs::write(&path, text).expect("write");
    let (mut inputs, _) = inputs::read(&path).expect("a good mission");
    pipeline::compile(&mut inputs, &CompileOptions::default(), &mut |_| {})
}

/// Where held wheel speeds lead: exact arcs, from the wheels alone.
fn replay(table: &CommandTable) -> Pose2 {
    let start = table.rows[0].pose;
    table.rows.iter().fold(start, |pose, row| {
        let [left, right] = [row.wheel_left, row.wheel_right].map(|w| w * table.wheel_radii.mean);
        pose.after_twist(0.5 * (left + right), (right - left) / table.track_width, table.sampling_time)
    })
}

fn pose() -> impl Strategy<Value = [f64; 3]> {
    [0.4..3.6f64, 0.4..2.6f64, -3.1..3.1f64]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_is_certified_is_reproducible_and_replays_to_the_goal(
        start in pose(), goal in pose(), step in prop_oneof![Just(0.02), Just(0.05), Just(0.1), Just(0.13)],
    ) {
        let text = mission(start, goal, step);
        let outcome = compile(&text);
        let again = compile(&text);
        prop_assert_eq!(outcome.compiled.is_some(), again.compiled.is_some());
        let Some(done) = outcome.compiled else {
            let diagnostics = outcome.diagnostics.expect("a reason");
            prop_assert!(diagnostics.0.iter().all(|d| d.hint.is_some()), "{diagnostics:?}");
            prop_assert!(diagnostics.0.iter().all(|d| d.code.starts_with("search/")), "{diagnostics:?}");
            return Ok(());
        };
        let header = CsvHeader::default();
        let file = csv::write(&done.commands, &header);
        prop_assert_eq!(&file, &csv::write(&again.compiled.expect("as before").commands, &header));
        let (table, _) = csv::read("c.csv", &file).expect("ours");
        prop_assert_eq!(&table, &done.commands);

        let end = replay(&table);
        prop_assert!(real::hypot(end.x - goal[0], end.y - goal[1]) <= END_POINT_TOLERANCE + 1e-9, "{end:?}");
        prop_assert!(wrap_angle(end.yaw - goal[2]).abs() <= END_ANGLE_TOLERANCE + 1e-9, "{end:?}");
        let last = table.rows.last().expect("rows");
        prop_assert!(last.wheel_left == 0.0 && last.wheel_right == 0.0);
        for row in &table.rows {
            for wheel in [row.wheel_left, row.wheel_right] {
                prop_assert!((wheel * table.wheel_radii.mean).abs() <= 0.5 * (1.0 + 1e-9));
            }
        }
    }
}
