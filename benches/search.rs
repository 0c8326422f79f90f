//! Speed of `search` on eval's own scenes, the distance field there already: Table III with 10, 20 and 35 boxes (a box without
//! joints), Table I (SCR-DB, whose blades fit or not). Each figure is the time of 20 scenes. And what an absent way costs.

use std::hint::black_box;
use std::time::Duration;

use criterion::{Criterion, SamplingMode, criterion_group, criterion_main};
use trajc::esdf::{self, Esdf};
use trajc::eval::{self, Scene, SceneSet, Suite};
use trajc::geom::Pose2;
use trajc::map::VoxelMap;
use trajc::mission::PoseSpec;
use trajc::pipeline::SEARCH_MARGIN;
use trajc::robot::{self, NoFiles, RobotInputs, RobotModel, spec};
use trajc::search::{self, Query, SearchError, SearchOptions, SearchPath};

const SCENES: usize = 20;
const BOX_BASE: [&str; 2] =
    [include_str!("../robots/box_base/robot.yaml"), include_str!("../robots/box_base/box_base.urdf")];
const SCR_DB: [&str; 2] = [include_str!("../robots/scr_db/robot.yaml"), include_str!("../robots/scr_db/scr_db.urdf")];

/// Scenes with all that a search needs.
struct Bench {
    robot: RobotModel,
    options: SearchOptions,
    scenes: Vec<(VoxelMap, Esdf, Query)>,
}

impl Bench {
    fn new(suite: Suite, boxes: usize, [yaml, urdf]: [&str; 2]) -> Self {
        let text = eval::document(suite, &[boxes], SCENES, 7).expect("the rooms have space");
        let set = eval::read("scenes", &text).expect("just written");
        let spec = spec::parse("robot.yaml", yaml).expect("shipped");
        let inputs = RobotInputs { spec: &spec, urdf: ("urdf", urdf), files: &mut NoFiles, overrides: &set.limits };
        let robot = robot::parse(inputs).expect("shipped");
        let options = SearchOptions { clearance: set.clearance + SEARCH_MARGIN, reverse: set.reverse };
        let scenes = set.scenes.iter().map(|scene| Self::scene(&set, scene, &robot)).collect();
        Self { robot, options, scenes }
    }

    fn scene(set: &SceneSet, scene: &Scene, robot: &RobotModel) -> (VoxelMap, Esdf, Query) {
        let map = set.voxels(scene).expect("a small room");
        let field = esdf::build(&map);
        let pose = |p: &PoseSpec| {
            let number = |value: Option<f64>| value.expect("scenes say all of a pose");
            Pose2::new(number(p.x), number(p.y), number(p.yaw))
        };
        let joints = |p: &PoseSpec| robot.joints.iter().map(|j| p.joints.get(&j.name).copied()).collect();
        let (start, goal) = (pose(&scene.start), pose(&scene.goal));
        let [start_joints, goal_joints] = [joints(&scene.start), joints(&scene.goal)];
        (map, field, Query { start, start_joints, goal, goal_within: 0.0, goal_yaw: Some(goal.yaw), goal_joints })
    }

    fn search(&self, k: usize) -> Result<SearchPath, SearchError> {
        let (map, field, query) = &self.scenes[k];
        search::search(map, field, &self.robot, query, &self.options)
    }
}

fn benches(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("search");
    group.sampling_mode(SamplingMode::Flat).sample_size(10);
    group.warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    let suites = [
        ("table3, 10 boxes", Suite::Table3, 10, BOX_BASE),
        ("table3, 20 boxes", Suite::Table3, 20, BOX_BASE),
        ("table3, 35 boxes", Suite::Table3, 35, BOX_BASE),
        ("table1", Suite::Table1, 15, SCR_DB),
    ];
    for (name, suite, boxes, robot) in suites {
        let bench = Bench::new(suite, boxes, robot);
        let found = (0..SCENES).filter(|k| bench.search(*k).is_ok()).count();
        assert_eq!(found, SCENES, "{name}");
        group.bench_function(format!("{name}, {SCENES} scenes"), |b| {
            b.iter(|| (0..SCENES).filter(|k| bench.search(black_box(*k)).is_ok()).count());
        });
    }
    // A wall across the room between start and goal, for all but a slit of 0.3 m.
    let mut walled = Bench::new(Suite::Table3, 10, BOX_BASE);
    walled.scenes.truncate(1);
    let (map, field, query) = &mut walled.scenes[0];
    let middle = (0.5 * (query.start.x + query.goal.x) / map.resolution) as usize;
    for j in (0..map.dims[1]).filter(|j| !(30..36).contains(j)) {
        (0..map.dims[2]).for_each(|k| map.occupy([middle, j, k]));
    }
    *field = esdf::build(map);
    assert!(walled.search(0).is_err());
    group.bench_function("an absent way, with its explanation", |b| b.iter(|| walled.search(0).is_err()));
    group.finish();
}

criterion_group!(search, benches);
criterion_main!(search);
