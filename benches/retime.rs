//! Retiming and sampling of the papers' C-curve, and of a long path of thirty segments.

use criterion::{Criterion, criterion_group, criterion_main};
use trajc::command::{SampleOptions, sample};
use trajc::mission::{Sampling, TimeLaw};
use trajc::report::path_error::path_errors;
use trajc::retime::{RetimeOptions, retime};
use trajc::robot::{BaseLimits, MotionLimits, RobotModel};
use trajc::trajectory::given;

fn robot() -> RobotModel {
    RobotModel {
        name: "conv".into(),
        wheel_radii: 0.1.into(),
        track_width: 0.4,
        root_link: "base".into(),
        base_from_root: Default::default(),
        joints: Vec::new(),
        bodies: Vec::new(),
        shapes: Vec::new(),
        wheel: MotionLimits { speed: Some(0.5), acceleration: Some(0.2), jerk: Some(0.2) },
        base: BaseLimits {
            speed: 0.5,
            acceleration: 0.2,
            angular_speed: 2.5,
            angular_acceleration: 1.0,
            eta: 1.0,
            min_speed: 0.01,
        },
        ignore_pairs: Vec::new(),
        tolerance: None,
        links: Vec::new(),
    }
}

fn benches(c: &mut Criterion) {
    let robot = robot();
    let c_curve = vec![[[0.0, 0.0], [3.0, 0.0], [4.0, 1.0], [4.0, 4.0]]];
    // S-bends end to end, each with the same tangent and curvature at its ends.
    let long: Vec<[[f64; 2]; 4]> = (0..30)
        .map(|i| {
            let (x, y) = (2.0 * f64::from(i), 1.0 * f64::from(i));
            [[x, y], [x + 1.0, y], [x + 1.0, y + 1.0], [x + 2.0, y + 1.0]]
        })
        .collect();
    let options = RetimeOptions { law: TimeLaw::Auto, sampling_time: 0.1 };
    let sampling = SampleOptions { sampling_time: 0.1, sampling: Sampling::Mean };
    for law in [TimeLaw::Optimal, TimeLaw::Wheel, TimeLaw::Eq5] {
        let trajectory = given::from_bezier(&c_curve, &[]).expect("a smooth path");
        let options = RetimeOptions { law, sampling_time: 0.1 };
        c.bench_function(&format!("retime/c_curve/{law:?}"), |b| b.iter(|| retime(&trajectory, &robot, &options)));
    }
    for (name, path) in [("c_curve", &c_curve), ("thirty_bends", &long)] {
        let trajectory = given::from_bezier(path, &[]).expect("a smooth path");
        let profile = retime(&trajectory, &robot, &options).expect("auto times every path");
        c.bench_function(&format!("retime/{name}"), |b| b.iter(|| retime(&trajectory, &robot, &options)));
        c.bench_function(&format!("sample/{name}"), |b| b.iter(|| sample(&profile, &robot, &sampling)));
        c.bench_function(&format!("path_error/{name}"), |b| {
            b.iter(|| path_errors(&profile, &robot, &[0.1], &[Sampling::Mean], |_| None));
        });
    }
}

criterion_group!(all, benches);
criterion_main!(all);
