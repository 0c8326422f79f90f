//! Robots with no joint to eight, from mission to command file and back: one code path, whatever their number.

use std::fmt::Write;

use serde_json::Value;
use trajc::certify::END_ANGLE_TOLERANCE;
use trajc::emit::csv::{self, CsvHeader};
use trajc::emit::{mcap, mcap_read};
use trajc::geom::Pose2;
use trajc::pipeline::{self, CompileOptions, Inputs, MapFile, TextFile};
use trajc::robot::{self, NoFiles};
use trajc::{diag, mission};

/// A box on wheels with a serial arm on it: `n` cylinders, 0.6 m in all, hinged about z and y in turn, upright at zero.
fn urdf(n: usize) -> String {
    let mut text = String::from(
        r#"<robot name="serial"><link name="base">
          <collision><origin xyz="0 0 0.15"/><geometry><box size="0.4 0.4 0.2"/></geometry></collision></link>
        <link name="left"/><link name="right"/>"#,
    );
    for (side, y) in [("left", 0.16), ("right", -0.16)] {
        write!(
            text,
            r#"<joint name="{side}_wheel" type="continuous"><parent link="base"/><child link="{side}"/>
              <origin xyz="0 {y} 0.08"/><axis xyz="0 1 0"/><limit effort="5" velocity="6.25"/></joint>"#
        )
        .expect("written");
    }
    let length = 0.6 / n.max(1) as f64;
    for k in 0..n {
        let (parent, at) = if k == 0 { ("base".to_owned(), 0.26) } else { (format!("link{}", k - 1), length) };
        let (axis, range) = if k % 2 == 0 { ("0 0 1", 2.0) } else { ("0 1 0", 1.0) };
        write!(
            text,
            r#"<link name="link{k}"><collision><origin xyz="0 0 {}"/>
                <geometry><cylinder radius="0.02" length="{length}"/></geometry></collision></link>
              <joint name="joint{k}" type="revolute"><parent link="{parent}"/><child link="link{k}"/>
                <origin xyz="0 0 {at}"/><axis xyz="{axis}"/>
                <limit effort="5" velocity="1.5" lower="-{range}" upper="{range}"/></joint>"#,
            0.5 * length
        )
        .expect("written");
    }
    text + "</robot>"
}

/// What the arm is asked to do: a little of everything.
fn bent(n: usize) -> Vec<f64> {
    (0..n).map(|k| [0.6, 0.4, -0.5, 0.3][k % 4]).collect()
}

/// A floor of 3 x 2 m with a post of 0.2 m, 1.2 m tall, between start and goal; the arm begins upright and ends bent.
fn inputs(n: usize) -> Inputs {
    let mut points = String::from("x_m,y_m,z_m\n");
    for i in 0..60 {
        for j in 0..40 {
            let [x, y] = [i, j].map(|cell| 0.05 * f64::from(cell) + 0.025);
            writeln!(points, "{x},{y},0").expect("written");
            if (1.4..1.6).contains(&x) && (0.7..0.9).contains(&y) {
                (0..24).for_each(|k| writeln!(points, "{x},{y},{}", 0.05 * f64::from(k) + 0.025).expect("written"));
            }
        }
    }
    let joints = |of: &[f64]| -> String {
        let all: Vec<String> = of.iter().enumerate().map(|(k, q)| format!("joint{k}: {q}")).collect();
        format!("{{{}}}", all.join(", "))
    };
    let text = format!(
        "robot: serial.yaml\nmap: {{file: floor.csv}}\nclearance_m: 0.03\n\
         start: {{x_m: 0.5, y_m: 1.0, yaw: 0deg, joints: {}}}\ngoal: {{x_m: 2.5, y_m: 1.0, joints: {}}}\n",
        joints(&vec![0.0; n]),
        joints(&bent(n))
    );
    let limits: Vec<String> = (0..n).map(|k| format!("joint{k}: {{acceleration: 3.0, jerk: 15.0}}")).collect();
    let yaml = format!(
        "urdf: serial.urdf\ndrive: {{wheel_radius_m: 0.08}}\ncollision: {{ignore_pairs: []}}\n\
         limits: {{wheel: {{acceleration_mps2: 0.5, jerk_mps3: 2.0}}, joints: {{{}}}}}\n",
        limits.join(", ")
    );
    let file = |name: &str, text: &str| TextFile { name: name.into(), text: text.into() };
    Inputs {
        mission: mission::parse("around.yaml", &text).expect("a mission"),
        mission_text: file("around.yaml", &text),
        robot_spec: robot::spec::parse("serial.yaml", &yaml).expect("a robot.yaml"),
        robot_yaml: Some(file("serial.yaml", &yaml)),
        urdf: file("serial.urdf", &urdf(n)),
        map: Some(MapFile { name: "floor.csv".into(), bytes: points.into_bytes(), beside: None }),
        path_csv: None,
        start_file: None,
        files: Box::new(NoFiles),
    }
}

/// The whole pipeline for `n` joints: certified, in the file as planned, and judged alike from the file alone.
fn goes_round_the_post_and_bends(n: usize) {
    let mut inputs = inputs(n);
    let outcome = pipeline::compile(&mut inputs, &CompileOptions::default(), &mut |_| {});
    let report = outcome.report.to_json();
    let compiled = match (outcome.compiled, outcome.diagnostics) {
        (Some(compiled), _) => compiled,
        (None, faults) => panic!("{n} joints: {}", diag::render(&faults.expect("a reason"), false)),
    };
    assert!(compiled.certificate.holds() && compiled.certificate.clearance_proven >= Some(0.03));
    // A link and the one it hangs on are no pair: of n links and the base, all others.
    let pairs = compiled.certificate.own_links.map_or(0, |own| own.pairs);
    assert_eq!(pairs, (n * (n + 1) / 2).saturating_sub(n), "{n} joints");

    let table = &compiled.commands;
    let (first, last) = (&table.rows[0], &table.rows[table.rows.len() - 1]);
    assert_eq!(table.joints.len(), n);
    assert!(first.joint_positions.iter().all(|q| q.abs() < 1e-9));
    let off = last.joint_positions.iter().zip(bent(n)).map(|(q, goal)| (q - goal).abs());
    assert!(off.fold(0.0, f64::max) <= END_ANGLE_TOLERANCE, "{n} joints: {:?}", last.joint_positions);

    let header = CsvHeader { mission: "around.yaml".into(), robot: "serial.yaml".into(), ..Default::default() };
    let text = csv::write(table, &header);
    let (read, _) = csv::read("commands.csv", &text).expect("ours");
    assert!(read == *table, "{n} joints: the file is not what was planned");
    let yaml = inputs.robot_yaml.as_ref().expect("there").text.clone();
    let bytes = mcap::write(&mcap::McapInputs {
        table,
        header: &header,
        robot: &compiled.robot,
        mission: &inputs.mission_text.text,
        robot_yaml: Some(&yaml),
        urdf: &inputs.urdf.text,
        report: &report,
        path_csv: None,
        start_file: None,
        meshes: &[],
    })
    .expect("finite");
    // Headings are quaternions there.
    let near = |a: Pose2, b: Pose2| a.distance(b) < 1e-12 && (a.yaw - b.yaw).abs() < 1e-12;
    let recorded = mcap_read::read("commands.mcap", &bytes).expect("ours").table;
    assert_eq!(recorded.rows.len(), table.rows.len());
    for (row, planned) in recorded.rows.iter().zip(&table.rows) {
        assert_eq!([row.wheel_left, row.wheel_right], [planned.wheel_left, planned.wheel_right]);
        assert_eq!(row.joint_positions, planned.joint_positions, "{n} joints");
        assert!(near(row.pose, planned.pose), "{n} joints: {row:?}");
    }
    let world = pipeline::world(&mut inputs).expect("as before");
    let again = pipeline::check(&inputs, &world, &read).expect("the robot's joints");
    assert_eq!(again, compiled.certificate);

    let report: Value = serde_json::from_str(&report).expect("JSON");
    assert_eq!(report["status"], "certified");
    let limits = report["limits"].as_array().expect("a list");
    assert_eq!(limits.len(), 3 * (2 + n), "two wheels and each joint: speed, acceleration, jerk");
    let kept = |l: &Value| l["peak"].as_f64() <= l["limit"].as_f64().map(|limit| limit * (1.0 + 1e-9));
    assert!(limits.iter().all(kept), "{limits:?}");
}

macro_rules! for_each_number_of_joints {
    ($($name:ident: $n:literal)*) => {$(
        #[test]
        fn $name() {
            goes_round_the_post_and_bends($n);
        }
    )*};
}

for_each_number_of_joints! {
    a_robot_without_joints_is_certified: 0
    a_robot_with_one_joint_is_certified: 1
    a_robot_with_two_joints_is_certified: 2
    a_robot_with_three_joints_is_certified: 3
    a_robot_with_four_joints_is_certified: 4
    a_robot_with_five_joints_is_certified: 5
    a_robot_with_six_joints_is_certified: 6
    a_robot_with_seven_joints_is_certified: 7
    a_robot_with_eight_joints_is_certified: 8
}
