//! Speed of every stage on `missions/arch_bridges.yaml` (10 x 10 x 1 m in cells of 5 cm, SCR-DB), each by itself and the whole
//! compile. The mission, its robot and its map are the shipped files, read once by the library's own readers.
//!
//! `cargo bench --bench pipeline`; about a minute. One thread throughout.

use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Duration;

use criterion::{Criterion, SamplingMode, criterion_group, criterion_main};
use trajc::certify::{self, Certificate, Goal, Task};
use trajc::command::{self, CommandTable, SampleOptions};
use trajc::esdf::{self, Esdf};
use trajc::geom::Pose2;
use trajc::inputs;
use trajc::map::VoxelMap;
use trajc::mission::{Mission, PoseSpec};
use trajc::optimize::{self, OptimizeOptions};
use trajc::pipeline::{self, CompileOptions, OPTIMISER_MARGINS, SEARCH_MARGIN, World};
use trajc::retime::{self, RetimeOptions};
use trajc::robot::RobotModel;
use trajc::search::{self, Query, SearchOptions, SearchPath};
use trajc::trajectory::Trajectory;

/// The mission and what its files hold.
struct Bench {
    mission: Mission,
    world: World,
}

impl Bench {
    fn read() -> Self {
        let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions/arch_bridges.yaml");
        let (mut inputs, _) = inputs::read(&path).expect("the mission is shipped");
        let world = pipeline::world(&mut inputs).expect("its robot and map are shipped");
        Self { mission: inputs.mission, world }
    }

    fn robot(&self) -> &RobotModel {
        &self.world.robot
    }

    fn map(&self) -> &VoxelMap {
        self.world.map.as_ref().expect("the mission has a map")
    }

    fn pose(&self, spec: &Option<PoseSpec>) -> (Pose2, Vec<Option<f64>>) {
        let spec = spec.as_ref().expect("the mission has a start and a goal");
        let number = |value: Option<f64>| value.expect("and both are complete");
        let joints = self.robot().joints.iter().map(|joint| spec.joints.get(&joint.name).copied()).collect();
        (Pose2::new(number(spec.x), number(spec.y), number(spec.yaw)), joints)
    }

    fn search(&self, field: &Esdf) -> SearchPath {
        let (start, start_joints) = self.pose(&self.mission.start);
        let (goal, goal_joints) = self.pose(&self.mission.goal);
        let query = Query { start, start_joints, goal, goal_within: 0.0, goal_yaw: Some(goal.yaw), goal_joints };
        let clearance = self.mission.clearance + SEARCH_MARGIN;
        let options = SearchOptions { clearance, reverse: self.mission.reverse };
        search::search(self.map(), field, self.robot(), &query, &options).expect("there is a way")
    }

    fn optimize(&self, path: &SearchPath, field: &Esdf, margin: f64) -> Trajectory {
        let options = OptimizeOptions { clearance: self.mission.clearance + margin, ..Default::default() };
        optimize::optimize(path, field, self.robot(), &options)
    }

    fn time(&self, trajectory: &Trajectory) -> CommandTable {
        let sampling_time = self.mission.sampling_time;
        let options = RetimeOptions { law: self.mission.time_law, sampling_time };
        let profile = retime::retime(trajectory, self.robot(), &options).expect("`auto` times every path");
        let options = SampleOptions { sampling_time, sampling: self.mission.sampling };
        command::sample(&profile, self.robot(), &options).expect("and it can be sampled")
    }

    fn certify(&self, table: &CommandTable, path: &SearchPath) -> Certificate {
        let first = &path.states[0];
        let (goal, joints) = self.pose(&self.mission.goal);
        let task = Task {
            start: first.pose,
            start_joints: first.joints.clone(),
            goal: Goal { x: goal.x, y: goal.y, within: 0.0, yaw: Some(goal.yaw), joints },
            clearance: self.mission.clearance,
            reverse: self.mission.reverse,
        };
        certify::certify(table, self.robot(), Some(self.map()), &task)
    }
}

fn stages(criterion: &mut Criterion) {
    let bench = Bench::read();
    let field = esdf::build(bench.map());
    let path = bench.search(&field);
    // The first try of the pipeline's that is certified is what later stages work on.
    let (margin, trajectory, table) = OPTIMISER_MARGINS
        .into_iter()
        .map(|margin| {
            let trajectory = bench.optimize(&path, &field, margin);
            let table = bench.time(&trajectory);
            (margin, trajectory, table)
        })
        .find(|(_, _, table)| bench.certify(table, &path).holds())
        .expect("one of the pipeline's tries is certified");
    println!("arch_bridges: optimiser's margin {margin} m, {} rows of commands", table.rows.len());

    let mut group = criterion.benchmark_group("arch_bridges");
    group.sampling_mode(SamplingMode::Flat).sample_size(10);
    group.warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(3));
    group.bench_function("esdf", |b| b.iter(|| esdf::build(black_box(bench.map()))));
    group.bench_function("search", |b| b.iter(|| bench.search(black_box(&field))));
    group.bench_function("optimise", |b| b.iter(|| bench.optimize(black_box(&path), &field, margin)));
    group.bench_function("retime and sample", |b| b.iter(|| bench.time(black_box(&trajectory))));
    group.bench_function("certify", |b| b.iter(|| bench.certify(black_box(&table), &path)));
    group.bench_function("whole compile", |b| {
        b.iter(|| pipeline::compile_in(black_box(&bench.mission), &bench.world, &CompileOptions::default()));
    });
    group.finish();
}

criterion_group!(benches, stages);
criterion_main!(benches);
