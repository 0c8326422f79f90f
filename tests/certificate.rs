//! The proof against obstacles pushed into its way: commands of real missions, one more occupied cell near the robot's path,
//! and the clearance by brute force (every millisecond, every shape, parry3d). It must never say yes where brute force finds
//! less than is asked for, and never no where there are 2 mm to spare.

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use parry3d_f64::math::{Pose, Rotation, Vector};
use parry3d_f64::query;
use parry3d_f64::shape::{Ball, ConvexPolyhedron, Cuboid, Cylinder, SharedShape};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use trajc::certify::{Certificate, Goal, RefusalKind, Task, certify};
use trajc::command::CommandTable;
use trajc::geom::{Aabb, Pose2};
use trajc::inputs;
use trajc::map::VoxelMap;
use trajc::math::real;
use trajc::pipeline::{self, CompileOptions};
use trajc::robot::{Convex, RobotModel};

/// Brute force looks this often, s.
const STEP: f64 = 1e-3;
/// What the proof may give away, m.
const TO_SPARE: f64 = 2e-3;

/// A mission compiled: what the proof sees.
struct Compiled {
    robot: RobotModel,
    map: VoxelMap,
    table: CommandTable,
    clearance: f64,
}

fn compiled(mission: &str) -> Compiled {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("missions/{mission}.yaml"));
    let (mut inputs, _) = inputs::read(&path).expect("shipped");
    let map = VoxelMap::clone(&pipeline::world(&mut inputs).expect("shipped").map.expect("has a map"));
    let outcome = pipeline::compile(&mut inputs, &CompileOptions::default(), &mut |_| {});
    let done = outcome.compiled.expect("certified");
    assert!(done.certificate.holds());
    Compiled { robot: done.robot, map, table: done.commands, clearance: inputs.mission.clearance }
}

/// Base pose and joint values at one instant.
type State = (Pose2, Vec<f64>);

/// The robot after `tau` seconds of row `row`'s held commands: an exact arc, joints at constant rates.
fn driven(table: &CommandTable, row: usize, (pose, joints): &State, tau: f64) -> State {
    let held = &table.rows[row];
    let [left, right] = [held.wheel_left, held.wheel_right].map(|w| w * table.wheel_radii.mean * tau);
    let (along, turn) = (0.5 * (left + right), (right - left) / table.track_width);
    let (x, y) = if turn.abs() < 1e-7 {
        (along * real::cos(pose.yaw + 0.5 * turn), along * real::sin(pose.yaw + 0.5 * turn))
    } else {
        let radius = along / turn;
        let end = pose.yaw + turn;
        (radius * (real::sin(end) - real::sin(pose.yaw)), radius * (real::cos(pose.yaw) - real::cos(end)))
    };
    let joints = joints.iter().zip(&held.joint_velocities).map(|(q, rate)| q + rate * tau).collect();
    (Pose2::new(pose.x + x, pose.y + y, pose.yaw + turn), joints)
}

/// A stretch of the commands, from rest as far as clearance is concerned, and the replay's states at its rows.
struct Stretch {
    table: CommandTable,
    states: Vec<State>,
}

fn stretch(table: &CommandTable, rows: std::ops::Range<usize>) -> Stretch {
    let first = &table.rows[0];
    let mut state = (first.pose, first.joint_positions.clone());
    for row in 0..rows.start {
        state = driven(table, row, &state, table.sampling_time);
    }
    let table = CommandTable { rows: table.rows[rows].to_vec(), ..table.clone() };
    let mut states = vec![state];
    for row in 0..table.rows.len() - 1 {
        states.push(driven(&table, row, states.last().expect("never empty"), table.sampling_time));
    }
    Stretch { table, states }
}

/// Poses of all shapes in the map.
fn shapes(robot: &RobotModel, (pose, joints): &State) -> Vec<Isometry3<f64>> {
    let base = Isometry3::from_parts(
        Vector3::new(pose.x, pose.y, 0.0).into(),
        UnitQuaternion::from_euler_angles(0.0, 0.0, pose.yaw),
    );
    robot.shape_poses(joints).iter().map(|shape| base * shape).collect()
}

fn in_parry(convex: &Convex) -> SharedShape {
    let vector = |v: &[f64; 3]| Vector::new(v[0], v[1], v[2]);
    match convex {
        Convex::Box { half } => SharedShape::new(Cuboid::new(vector(half))),
        Convex::Sphere { radius } => SharedShape::new(Ball::new(*radius)),
        Convex::Cylinder { radius, half_length } => {
            // parry's cylinders stand along y.
            let turn =
                Pose::from_parts(Vector::new(0.0, 0.0, 0.0), Rotation::from_rotation_x(std::f64::consts::FRAC_PI_2));
            let upright = SharedShape::new(Cylinder::new(*half_length, *radius));
            SharedShape::compound(vec![(turn, upright)])
        }
        Convex::Hull { vertices } => SharedShape::new(
            ConvexPolyhedron::from_convex_hull(&vertices.iter().map(vector).collect::<Vec<_>>()).expect("a hull"),
        ),
    }
}

fn posed(pose: &Isometry3<f64>) -> Pose {
    let (t, q) = (pose.translation.vector, pose.rotation);
    Pose::from_parts(Vector::new(t.x, t.y, t.z), Rotation::from_xyzw(q.i, q.j, q.k, q.w))
}

/// Least distance of the robot from a cube over the whole stretch, sampled; more than `enough` is not measured.
fn brute_force(robot: &RobotModel, stretch: &Stretch, cube: &Aabb, enough: f64) -> f64 {
    let solids: Vec<(SharedShape, f64)> =
        robot.shapes.iter().map(|s| (in_parry(&s.convex), s.convex.bounding_radius())).collect();
    let half: [f64; 3] = std::array::from_fn(|i| 0.5 * (cube.max[i] - cube.min[i]));
    let middle: [f64; 3] = std::array::from_fn(|i| 0.5 * (cube.max[i] + cube.min[i]));
    let block = Cuboid::new(Vector::new(half[0], half[1], half[2]));
    let block_at = posed(&Isometry3::translation(middle[0], middle[1], middle[2]));
    let mut least = enough;
    let steps = (stretch.table.sampling_time / STEP).round() as usize;
    // The last row only ends the one before: nothing is held after it.
    for (row, state) in stretch.states[..stretch.states.len() - 1].iter().enumerate() {
        for step in 0..=steps {
            let state = driven(&stretch.table, row, state, step as f64 * STEP);
            for (pose, (solid, radius)) in shapes(robot, &state).iter().zip(&solids) {
                let apart = cube.distance(&Point3::from(pose.translation.vector));
                if apart - radius >= least {
                    continue;
                }
                let distance = query::distance(&posed(pose), solid.as_ref(), &block_at, &block);
                least = least.min(distance.expect("parry measures all of these").distance);
            }
        }
    }
    least
}

/// The proof of a stretch; only its clearance matters.
fn proof(compiled: &Compiled, stretch: &Stretch, map: &VoxelMap, clearance: f64) -> Certificate {
    let (start, start_joints) = stretch.states[0].clone();
    let goal = Goal { x: start.x, y: start.y, within: 0.0, yaw: None, joints: vec![None; start_joints.len()] };
    certify(&stretch.table, &compiled.robot, Some(map), &Task { start, start_joints, goal, clearance, reverse: false })
}

fn refuses(certificate: &Certificate) -> bool {
    certificate.refusals.iter().any(|r| r.kind == RefusalKind::Clearance)
}

/// One occupied cell more: near a random shape at a random instant, on the side and as far as the numbers say.
fn near_cell(compiled: &Compiled, stretch: &Stretch, at: [f64; 2], towards: [f64; 3], far: f64) -> Option<[usize; 3]> {
    let row = ((at[0] * stretch.states.len() as f64) as usize).min(stretch.states.len() - 1);
    let poses = shapes(&compiled.robot, &stretch.states[row]);
    let index = ((at[1] * poses.len() as f64) as usize).min(poses.len() - 1);
    let direction = Vector3::from(towards).try_normalize(1e-3)?;
    let surface = poses[index] * Point3::from(compiled.robot.shapes[index].convex.support(&direction));
    let point = surface + poses[index] * direction * far;
    let map = &compiled.map;
    let cell: [f64; 3] = std::array::from_fn(|a| ((point[a] - map.origin[a]) / map.resolution).floor());
    // Above and below the map there are no cells: the nearest that is there.
    let height = cell[2].clamp(0.0, map.dims[2] as f64 - 1.0) as usize;
    let inside = |a: usize| (0.0..map.dims[a] as f64).contains(&cell[a]).then_some(cell[a] as usize);
    Some([inside(0)?, inside(1)?, height])
}

/// Counts of refused and accepted cases: a test that only sees one kind tests nothing.
fn judge(mission: &str, rows: usize, cases: u32) {
    let compiled = compiled(mission);
    let last = compiled.table.rows.len() - rows;
    let config = Config { cases, failure_persistence: None, max_shrink_iters: 20, ..Config::default() };
    let rng = TestRng::deterministic_rng(RngAlgorithm::ChaCha);
    let mut runner = TestRunner::new_with_rng(config, rng);
    let counts = std::cell::Cell::new((0, 0));
    let numbers = (0.0..1.0f64, [0.0..1.0f64, 0.0..1.0], [-1.0..1.0f64, -1.0..1.0, -1.0..1.0], -0.03..0.25f64);
    let outcome = runner.run(&numbers, |(from, at, towards, far)| {
        let start = (from * last as f64) as usize;
        let stretch = stretch(&compiled.table, start..start + rows);
        let Some(cell) = near_cell(&compiled, &stretch, at, towards, far) else { return Ok(()) };
        let mut map = compiled.map.clone();
        map.occupy(cell);
        let asked = compiled.clearance;
        let sampled = brute_force(&compiled.robot, &stretch, &map.cube(cell), asked + 0.05);
        let certificate = proof(&compiled, &stretch, &map, asked);
        let (mut no, mut yes) = counts.get();
        let proven = certificate.clearance_proven.expect("there is a map");
        if sampled < asked + 0.05 {
            prop_assert!(proven <= sampled + 1e-9, "proven {proven}, sampled {sampled}");
        }
        if sampled < asked {
            prop_assert!(refuses(&certificate), "sampled {sampled}, asked {asked}, proven {proven}");
            no += 1;
        } else if sampled >= asked + TO_SPARE {
            prop_assert!(!refuses(&certificate), "sampled {sampled}, asked {asked}: {:?}", certificate.refusals);
            yes += 1;
        }
        counts.set((no, yes));
        Ok(())
    });
    outcome.unwrap_or_else(|error| panic!("{mission}: {error}"));
    let (no, yes) = counts.get();
    assert!(no >= cases / 8 && yes >= cases / 8, "{mission}: {no} refused, {yes} accepted of {cases}");
}

#[test]
fn a_cell_pushed_into_the_way_of_a_box_is_never_certified() {
    judge("first", 20, 200);
}

#[test]
fn a_cell_pushed_into_the_way_of_a_robot_that_changes_shape_is_never_certified() {
    judge("arch_bridges", 10, 120);
}

#[test]
fn a_map_shifted_under_the_commands_is_judged_by_where_it_is() {
    let compiled = compiled("first");
    let whole = stretch(&compiled.table, 0..compiled.table.rows.len());
    for shift in [-0.2, -0.1, -0.03, -0.01, -0.003, 0.003, 0.01, 0.03, 0.1, 0.2] {
        let mut map = compiled.map.clone();
        map.origin[1] += shift;
        let enough = compiled.clearance + 0.05;
        let sampled = map
            .cells()
            .map(|c| brute_force(&compiled.robot, &whole, &map.cube(c), enough))
            .fold(f64::INFINITY, f64::min);
        let certificate = proof(&compiled, &whole, &map, compiled.clearance);
        if sampled < compiled.clearance {
            assert!(refuses(&certificate), "{shift}: {sampled}");
        } else if sampled >= compiled.clearance + TO_SPARE {
            assert!(!refuses(&certificate), "{shift}: {sampled} {:?}", certificate.refusals);
        }
    }
}
