//! Robots that are not the model's, on shipped missions: replayed one by one, none is outside the tube, and where a tolerance is certified
//! none comes nearer to an obstacle than is proven of it.

use trajc::certify::{self, Task};
use trajc::command::{CommandRow, CommandTable};
use trajc::geom::Pose2;
use trajc::inputs;
use trajc::map::VoxelMap;
use trajc::math::real;
use trajc::mission::{Tolerance, ToleranceSpec};
use trajc::pipeline::{self, CompileOptions};
use trajc::robot::RobotModel;

struct Compiled {
    robot: RobotModel,
    map: VoxelMap,
    table: CommandTable,
    task: Task,
    /// Proven of every robot within the tolerance, m.
    proven: Option<f64>,
}

fn compiled(mission: &str) -> Compiled {
    compiled_within(mission, None).expect("certified")
}

/// With another tolerance; `None` where it is not certified.
fn compiled_within(mission: &str, tolerance: Option<ToleranceSpec>) -> Option<Compiled> {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("missions/{mission}.yaml"));
    let (mut inputs, _) = inputs::read(&path).expect("shipped");
    inputs.mission.path_error_times.clear();
    inputs.mission.tolerance = tolerance.or(inputs.mission.tolerance);
    let map = VoxelMap::clone(&pipeline::world(&mut inputs).expect("shipped").map.expect("has a map"));
    let outcome = pipeline::compile(&mut inputs, &CompileOptions::default(), &mut |_| {});
    let done = outcome.compiled?;
    let (first, last) = (&done.commands.rows[0], &done.commands.rows[done.commands.rows.len() - 1]);
    let goal = certify::Goal {
        x: last.pose.x,
        y: last.pose.y,
        within: 0.0,
        yaw: None,
        joints: vec![None; done.robot.joints.len()],
    };
    let task = Task {
        start: first.pose,
        start_joints: first.joint_positions.clone(),
        goal,
        clearance: inputs.mission.clearance,
        reverse: inputs.mission.reverse,
    };
    let proven = done.certificate.tolerance.as_ref().and_then(|inside| inside.clearance_proven);
    Some(Compiled { robot: done.robot, map, table: done.commands, task, proven })
}

/// A number from -1 to 1 by a generator with a fixed seed; some of them at the ends.
fn share(state: &mut u64) -> f64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    let value = (*state >> 33) as f64 / f64::from(1u32 << 31) * 2.0 - 1.0;
    (1.4 * value).clamp(-1.0, 1.0)
}

/// A robot within the tolerance: the commands with its own wheels, and where it starts. Shares: wheels alike, apart, track, start's distance,
/// its direction (times pi), heading.
fn another(table: &CommandTable, start: Pose2, tolerance: &Tolerance, shares: [f64; 6]) -> (CommandTable, Pose2) {
    let [alike, apart, track, far, direction, heading] = shares;
    let mut own = table.clone();
    own.track_width *= 1.0 + track * tolerance.track;
    let (mean, half) = (1.0 + alike * tolerance.wheel_radius, 0.5 * apart * tolerance.wheel_difference);
    for row in &mut own.rows {
        row.wheel_left *= mean - half;
        row.wheel_right *= mean + half;
    }
    let far = far.abs() * tolerance.start_distance;
    let (sin, cos) = real::sin_cos(std::f64::consts::PI * direction);
    let yaw = start.yaw + heading * tolerance.start_angle;
    (own, Pose2::new(start.x + far * cos, start.y + far * sin, yaw))
}

#[test]
fn no_robot_of_usual_accuracy_leaves_the_tube_and_the_farthest_comes_near_its_edge() {
    for mission in ["first", "arch_bridges", "barn_29", "depot", "levine", "site", "turtlebot3_burger"] {
        let Compiled { robot, table, task, .. } = compiled(mission);
        let tube = certify::tube_along(&table, &robot, &task, Tolerance::ASSUMED);
        let nominal = table.replay(task.start);
        let mut farthest = vec![(0.0f64, 0.0f64); nominal.len()];
        let mut random = 0.0f64;
        let mut state = 1;
        for index in 0..600 {
            let mut shares: [f64; 6] = std::array::from_fn(|_| share(&mut state));
            let corner = index < 256;
            if corner {
                let side = |bit: usize| if index >> bit & 1 == 1 { 1.0 } else { -1.0 };
                shares = [side(0), side(1), side(2), 1.0, f64::from((index >> 4) as u8) / 8.0, side(3)];
            }
            let (own, from) = another(&table, task.start, &Tolerance::ASSUMED, shares);
            for ((most, pose), model) in farthest.iter_mut().zip(own.replay(from)).zip(&nominal) {
                *most = (most.0.max(pose.distance(*model)), most.1.max((pose.yaw - model.yaw).abs()));
                if !corner {
                    random = random.max(pose.distance(*model));
                }
            }
        }
        let mut widest = 0.0f64;
        for (point, (distance, angle)) in tube.iter().zip(&farthest) {
            assert!(*distance <= point.width.distance && *angle <= point.width.angle + 1e-12, "{mission}");
            widest = widest.max(point.width.distance);
        }
        let corner = farthest.iter().map(|f| f.0).fold(0.0, f64::max);
        println!(
            "{mission}: tube {widest:.4} m, corners {corner:.4} m ({:.3}), random {random:.4} m ({:.3})",
            widest / corner,
            widest / random
        );
        assert!(widest <= 1.2 * random, "{mission}: {widest} m, but no robot farther off than {random} m");
    }
}

/// The same commands in rows a fifth as long, joints late by `joints` of them and wheels by `wheels`.
fn late(table: &CommandTable, joints: usize, wheels: usize) -> CommandTable {
    const PARTS: usize = 5;
    let fine = |k: usize| &table.rows[k / PARTS];
    let count = PARTS * table.rows.len();
    let still = vec![0.0; table.joints.len()];
    let rows = (0..count + joints.max(wheels)).map(|k| {
        let wheel = k
            .checked_sub(wheels)
            .filter(|k| *k < count)
            .map_or([0.0; 2], |k| [fine(k).wheel_left, fine(k).wheel_right]);
        CommandRow {
            wheel_left: wheel[0],
            wheel_right: wheel[1],
            joint_positions: still.clone(),
            joint_velocities: k
                .checked_sub(joints)
                .filter(|k| *k < count)
                .map_or(&still, |k| &fine(k).joint_velocities)
                .clone(),
            pose: Pose2::default(),
        }
    });
    CommandTable { sampling_time: table.sampling_time / PARTS as f64, rows: rows.collect(), ..table.clone() }
}

/// Clearance that is proven of every robot within the tolerance in force, and the least of two hundred random ones of them, m.
fn proven_and_nearest(Compiled { robot, map, table, task, proven }: &Compiled) -> (f64, f64) {
    let proven = proven.expect("a tolerance and a map");
    let tolerance = robot.tolerance.expect("in force");
    assert!(proven >= task.clearance);
    assert!((tolerance.latency - table.sampling_time / 5.0).abs() < 1e-12, "one of the rows that `late` makes");
    let mut least = f64::INFINITY;
    let mut state = 7;
    for index in 0..200 {
        let shares = std::array::from_fn(|_| share(&mut state));
        let (own, from) = another(table, task.start, &tolerance, shares);
        let own = late(&own, index % 2, index / 2 % 2);
        for instant in certify::distances(&own, robot, map, (from, &task.start_joints), 3, 0.3) {
            least = least.min(instant.distance);
        }
    }
    (proven, least)
}

#[test]
fn of_two_hundred_random_robots_within_a_certified_tolerance_none_comes_nearer_than_proven() {
    for mission in ["site_tolerance", "barn_29_tolerance"] {
        let (proven, least) = proven_and_nearest(&compiled(mission));
        println!("{mission}: proven {proven:.4} m, nearest {least:.4} m");
        assert!(least >= proven, "{mission}: {least} m, {proven} m proven");
    }
}

#[test]
#[ignore = "minutes: compiles each shipped mission several times; cargo test --release --test tolerance -- --ignored --nocapture"]
fn nor_on_any_shipped_mission_with_the_largest_part_of_the_usual_tolerance_that_it_is_certified_with() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("missions");
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .expect("shipped")
        .map(|entry| entry.expect("an entry").path())
        .filter(|path| std::fs::read_to_string(path).is_ok_and(|text| text.lines().any(|l| l.starts_with("map:"))))
        .map(|path| path.file_stem().expect("a name").to_string_lossy().into_owned())
        .collect();
    names.sort();
    let mut tried = 0;
    for mission in names {
        let usual = Tolerance::ASSUMED;
        let hold = compiled(&mission).table.sampling_time;
        let found = (0..8).find_map(|halved| {
            let part = real::powi(0.5, halved);
            let spec = ToleranceSpec {
                wheel_radius: Some(part * usual.wheel_radius),
                wheel_difference: Some(part * usual.wheel_difference),
                track: Some(part * usual.track),
                latency: Some(hold / 5.0),
                start_distance: Some(part * usual.start_distance),
                start_angle: Some(part * usual.start_angle),
            };
            compiled_within(&mission, Some(spec)).map(|done| (part, done))
        });
        let Some((part, done)) = found else {
            println!("{mission}: not certified with a hundredth of it");
            continue;
        };
        let (proven, least) = proven_and_nearest(&done);
        println!("{mission}: {part} of it; proven {proven:.4} m, nearest {least:.4} m");
        assert!(least >= proven, "{mission}: {least} m, {proven} m proven");
        tried += 1;
    }
    assert!(tried > 10);
}
