use super::*;
use crate::emit::samples;
use crate::robot::{BaseLimits, MotionLimits};

pub const MISSION: &str = "robot: robot.yaml\nstart: {x_m: 0.5, y_m: -1.25}\n";
pub const REPORT: &str = "{\"schema\": \"trajc.report/1\", \"status\": \"certified\"}\n";
pub const URDF: &str = r#"<robot name="r"><link name="base_link"/><link name="blade_link"/>
  <joint name="blade" type="revolute"><parent link="base_link"/><child link="blade_link"/></joint>
  <joint name="lift" type="prismatic"><parent link="base_link"/><child link="blade_link"/></joint></robot>
"#;

pub fn robot(base_from_root: Isometry3<f64>) -> RobotModel {
    let none = MotionLimits { speed: None, acceleration: None, jerk: None };
    RobotModel {
        name: "r".into(),
        wheel_radii: 0.08.into(),
        track_width: 0.32,
        root_link: "base_link".into(),
        base_from_root,
        joints: Vec::new(),
        bodies: Vec::new(),
        shapes: Vec::new(),
        wheel: none,
        base: BaseLimits {
            speed: 0.5,
            acceleration: 0.5,
            angular_speed: 1.0,
            angular_acceleration: 1.0,
            eta: 1.0,
            min_speed: 0.01,
        },
        ignore_pairs: Vec::new(),
        tolerance: None,
        links: Vec::new(),
    }
}

pub fn file(table: &CommandTable, base_from_root: Isometry3<f64>, meshes: &[(String, Vec<u8>)]) -> Vec<u8> {
    let inputs = McapInputs {
        table,
        header: &samples::header(),
        robot: &robot(base_from_root),
        mission: MISSION,
        robot_yaml: Some("urdf: robot.urdf\n"),
        urdf: URDF,
        report: REPORT,
        path_csv: None,
        start_file: None,
        meshes,
    };
    write(&inputs).expect("a good table")
}

#[test]
fn the_same_inputs_give_the_same_bytes() {
    let table = samples::table(30, &[("blade", false), ("lift", true)]);
    let meshes = [("a.stl".to_string(), b"solid".to_vec())];
    let first = file(&table, Isometry3::identity(), &meshes);
    // Each file has its own hash tables, with their own order.
    for _ in 0..4 {
        assert_eq!(file(&table, Isometry3::identity(), &meshes), first);
    }
}

#[test]
fn the_base_has_a_frame_of_its_own_only_where_the_root_link_lies_elsewhere() {
    let raised = Isometry3::translation(0.0, 0.0, 0.08);
    let frames = |pose, urdf: &str| {
        let frames = Frames::new(&robot(pose), urdf);
        (frames.base, frames.root.map(|(name, _)| name))
    };
    assert_eq!(frames(Isometry3::identity(), URDF), ("base_link".into(), None));
    assert_eq!(frames(raised, URDF), ("base_footprint".into(), Some("base_link".into())));
    let taken = URDF.replace("blade_link", "base_footprint");
    assert_eq!(frames(raised, &taken), ("trajc_base".into(), Some("base_link".into())), "a link has one parent");
}

#[test]
fn times_that_stamps_cannot_hold_are_refused() {
    for sampling_time in [1e-10, 1e9] {
        let table = CommandTable { sampling_time, ..samples::table(4, &[]) };
        let robot = robot(Isometry3::identity());
        let inputs = McapInputs {
            table: &table,
            header: &samples::header(),
            robot: &robot,
            mission: MISSION,
            robot_yaml: None,
            urdf: URDF,
            report: REPORT,
            path_csv: None,
            start_file: None,
            meshes: &[],
        };
        let error = write(&inputs).expect_err("not in stamps");
        assert!(matches!(error, McapWriteError::Stamps { rows: 4, .. }), "{error}");
        assert_eq!(error.diagnostic().code, "emit/stamps");
    }
}

/// To be read by an independent checker; see the project's `check_mcap.py`.
#[test]
#[ignore = "writes files into the folder $TRAJC_SCRATCH"]
fn scratch_files_for_an_independent_checker() {
    let folder = std::path::PathBuf::from(std::env::var("TRAJC_SCRATCH").expect("a folder"));
    let raised = Isometry3::translation(0.03, 0.0, 0.08);
    let cases = [
        ("joints", samples::table(40, &[("blade", false), ("lift", true)]), Isometry3::identity()),
        ("bare", samples::table(40, &[]), Isometry3::identity()),
        ("raised", samples::table(3000, &[("blade", false)]), raised),
    ];
    for (name, table, pose) in cases {
        std::fs::create_dir_all(folder.join(name)).expect("scratch");
        let meshes = [("a/b.stl".to_string(), b"solid".to_vec())];
        std::fs::write(folder.join(name).join("commands.mcap"), file(&table, pose, &meshes)).expect("scratch");
        std::fs::write(folder.join(name).join("commands.csv"), csv::write(&table, &samples::header()))
            .expect("scratch");
    }
}
