use std::collections::BTreeMap;

use nalgebra::{Isometry3, Unit, Vector3};
use serde_json::{Value, json};

use super::*;
use crate::certify::{Goal, Task, certify};
use crate::command::CommandRow;
use crate::diag::{Diagnostic, Diagnostics};
use crate::geom::Pose2;
use crate::math::real;
use crate::mission::{Sampling, Tolerance, Unknown};
use crate::report::schema::{InputFile, InputsPart, TrustPart};
use crate::report::{Metrics, PathErrorRow};
use crate::robot::{BaseLimits, Body, BodyMotion, Convex, IgnoreReason, IgnoredPair, MotionLimits, MovingJoint, Shape};

/// What a user may call things.
const HOSTILE: &str = "</script><script>alert('1')</script><!-- \"&amp;{{data}}\u{2028}";

/// A box with a blade on a joint, a drum on another, and a ball.
fn robot(joint: &str) -> RobotModel {
    let limits = MotionLimits { speed: Some(1.0), acceleration: Some(2.0), jerk: None };
    let at = |x: f64, z: f64| Isometry3::translation(x, 0.0, z);
    let moved = |link: &str, joint: usize, prismatic: bool| Body {
        link: link.into(),
        parent: joint,
        origin: at(0.1, 0.3),
        motion: Some(BodyMotion {
            joint,
            multiplier: 2.0,
            offset: 0.1,
            axis: Unit::new_normalize(Vector3::new(1.0, 0.0, 1.0)),
            prismatic,
        }),
    };
    let shape = |link: &str, body: usize, convex: Convex| Shape { link: link.into(), body, pose: at(0.0, 0.1), convex };
    let moving =
        |name: &str, prismatic: bool| MovingJoint { name: name.into(), prismatic, lower: -1.0, upper: 1.0, limits };
    RobotModel {
        name: "test".into(),
        wheel_radii: 0.1.into(),
        track_width: 0.4,
        root_link: "base".into(),
        base_from_root: Isometry3::identity(),
        joints: vec![moving(joint, false), moving("lift", true)],
        bodies: vec![
            Body { link: "base".into(), parent: 0, origin: Isometry3::identity(), motion: None },
            moved("blade", 0, false),
            moved("drum", 1, true),
        ],
        shapes: vec![
            shape("base", 0, Convex::Box { half: [0.2, 0.15, 0.1] }),
            shape(joint, 1, Convex::Box { half: [0.1, 0.02, 0.2] }),
            shape("drum", 2, Convex::Cylinder { radius: 0.1, half_length: 0.05 }),
            shape("drum", 2, Convex::Sphere { radius: 0.08 }),
        ],
        wheel: limits,
        base: BaseLimits {
            speed: 1.0,
            acceleration: 1.0,
            angular_speed: 1.0,
            angular_acceleration: 1.0,
            eta: 0.1,
            min_speed: 0.01,
        },
        // They lie in one another, as far as this page is concerned by design.
        ignore_pairs: [["base", joint], ["base", "drum"], [joint, "drum"]].map(by_design).to_vec(),
        tolerance: None,
        links: Vec::new(),
    }
}

fn by_design(links: [&str; 2]) -> IgnoredPair {
    IgnoredPair { links: links.map(str::to_owned), reason: IgnoreReason::Named }
}

/// Speeds up, turns, moves both joints, slows down.
fn table(robot: &RobotModel, rows: usize) -> CommandTable {
    let step = 0.1;
    let mut pose = Pose2::new(0.5, 1.0, 0.3);
    let mut joints = vec![0.0; robot.joints.len()];
    let wave = |k: usize| if k + 1 < rows { real::sin(std::f64::consts::PI * k as f64 / rows as f64) } else { 0.0 };
    let mut table = CommandTable {
        sampling_time: step,
        sampling: Sampling::Mean,
        wheel_radii: robot.wheel_radii,
        track_width: robot.track_width,
        joints: robot.joints.iter().map(|j| (j.name.clone(), j.prismatic)).collect(),
        rows: Vec::new(),
    };
    for k in 0..rows {
        let (left, right) = (0.3 * wave(k), 0.33 * wave(k));
        let rate = 0.4 * wave(k) * real::cos(k as f64 * 0.2);
        let velocities = vec![rate; joints.len()];
        table.rows.push(CommandRow {
            wheel_left: left / robot.wheel_radii.mean,
            wheel_right: right / robot.wheel_radii.mean,
            joint_positions: joints.clone(),
            joint_velocities: velocities,
            pose,
        });
        pose = pose.after_twist(0.5 * (left + right), (right - left) / robot.track_width, step);
        joints.iter_mut().for_each(|q| *q += rate * step);
    }
    table
}

/// A floor of 8 x 6 m with a wall and a bar overhead.
fn map() -> VoxelMap {
    let mut map = VoxelMap::new(0.1, [-2.0, -1.0, 0.0], [80, 60, 12], Unknown::Occupied);
    (0..60).for_each(|j| (0..8).for_each(|k| map.occupy([52, j, k])));
    (0..50).for_each(|i| map.occupy([i, 50, 11]));
    map
}

struct Case {
    name: String,
    report: Report,
    robot: RobotModel,
    map: Option<VoxelMap>,
    table: CommandTable,
    trust: Option<Trust>,
}

impl Case {
    fn new(name: &str, joint: &str, rows: usize, clearance: f64) -> Self {
        let (robot, map) = (robot(joint), map());
        let table = table(&robot, rows);
        let last = table.rows.last().expect("rows").pose;
        let task = Task {
            start: table.rows[0].pose,
            start_joints: table.rows[0].joint_positions.clone(),
            goal: Goal { x: last.x, y: last.y, within: 0.0, yaw: None, joints: vec![None; 2] },
            clearance,
            reverse: false,
        };
        let mut report = Report::new(InputsPart { mission: InputFile::new(name, b"x"), ..InputsPart::default() });
        report.robot = Some((&robot).into());
        report.map = Some((&map).into());
        report.commands = Some((&table).into());
        let metrics = Metrics { length_m: 2.0, time_s: 3.0, ..Metrics::default() };
        report.initial = Some(crate::report::schema::InitialPart { metrics });
        report.path_error = [0.05, 0.1]
            .map(|t| PathErrorRow {
                sampling_time_s: t,
                sampling: "mean".into(),
                lateral_max_m: 1e-3 * t,
                lateral_rms_m: 1e-4 * t,
                end_point_m: 0.0,
                end_heading_rad: 0.0,
                clearance_min_m: Some(0.1),
            })
            .to_vec();
        report.judge(&certify(&table, &robot, Some(&map), &task));
        let trust = crate::certify::trust(&table, &robot, Some(&map), &task, Tolerance::ASSUMED);
        report.trust = trust.as_ref().map(|trust| TrustPart::new(trust, false, true));
        Self { name: name.into(), report, robot, map: Some(map), table, trust }
    }

    fn inputs(&self) -> PageInputs<'_> {
        PageInputs {
            mission: &self.name,
            report: &self.report,
            robot: Some(&self.robot),
            map: self.map.as_ref(),
            commands: Some(&self.table),
            ends: [None, None],
            zones: &[],
            route: &[[0.0, 0.0], [1.0, 1.0]],
            trust: self.trust.as_ref(),
        }
    }

    fn page(&self) -> String {
        html(&self.inputs())
    }
}

/// The page's data, as a browser reads it: up to the first `</script`.
fn data(page: &str) -> Value {
    let rest = page.split("id=\"data\">").nth(1).expect("data");
    serde_json::from_str(rest.split("</script").next().expect("an end")).expect("JSON")
}

fn sums(list: &Value, scale: f64) -> Vec<f64> {
    let mut sum = 0.0;
    let values = list.as_array().expect("a list").iter().map(|v| v.as_f64().expect("a number"));
    values
        .map(|d| {
            sum += d;
            sum / scale
        })
        .collect()
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    let case = Case::new("m", "blade", 60, 0.05);
    assert_eq!(case.report.failure, None);
    assert_eq!(case.page(), case.page());
    assert_eq!(svg(&case.inputs()), svg(&case.inputs()));
}

#[test]
fn a_page_says_what_was_proven_and_what_was_not() {
    let page = Case::new("dock_7", "blade", 60, 0.05).page().to_lowercase();
    for expected in
        ["dock_7", "certified", "certificate", "clearance", "limit", "path error", "slip", "tracking", "initial"]
    {
        assert!(page.contains(expected), "{expected}");
    }
    // Clip paths name parts of their own drawing.
    let page = page.replace("url(#", "");
    for forbidden in ["http://", "https://", " src=", "@import", "url("] {
        assert!(!page.contains(forbidden), "a page asks for nothing: {forbidden}");
    }
}

#[test]
fn names_of_users_stay_text_wherever_they_are_put() {
    let mut case = Case::new(HOSTILE, HOSTILE, 40, 0.05);
    for failed in [false, true] {
        if failed {
            let numbers = Diagnostic::failure("search/no-way", HOSTILE)
                .number("link", HOSTILE)
                .number("posture", json!({ HOSTILE: 1.0 }));
            case.report.fail(&Diagnostics(vec![numbers]));
        }
        let page = case.page();
        let lower = page.to_lowercase();
        assert_eq!([lower.matches("<script").count(), lower.matches("</script").count()], [2, 2]);
        assert_eq!(lower.matches("<!--").count(), 0);
        assert!(!page.contains("<script>alert") && page.contains("&lt;/script&gt;"));
        assert_eq!(data(&page)["robot"]["joints"][0]["name"], HOSTILE);
        let body = page.split("<main>").nth(1).and_then(|p| p.split("</main>").next()).expect("a body");
        assert!(roxmltree::Document::parse(&format!("<main>{}</main>", xml(body))).is_ok(), "all tags are closed");
    }
    assert!(roxmltree::Document::parse(&svg(&case.inputs())).is_ok());
}

/// HTML as XML: elements without content closed, attributes without value given one.
fn xml(html: &str) -> String {
    let mut out = html.replace(" hidden>", ">");
    for tag in ["<input ", "<br>"] {
        let mut at = 0;
        while let Some(found) = out[at..].find(tag) {
            let end = at + found + out[at + found..].find('>').expect("an end");
            out.insert(end, '/');
            at = end;
        }
    }
    out
}

#[test]
fn the_data_are_the_rows_as_written() {
    let case = Case::new("m", "blade", 90, 0.05);
    let data = data(&case.page());
    let (rows, scale) = (&data["rows"], data["rows"]["scale"].as_f64().expect("a scale"));
    let states = crate::report::plot::motion::states(&case.table);
    let near = |found: &Value, value: &dyn Fn(usize) -> f64| {
        let found = sums(found, scale);
        assert_eq!(found.len(), 90);
        found
            .iter()
            .enumerate()
            .for_each(|(k, v)| assert!((v - value(k)).abs() <= 0.5001 / scale, "{k}: {v} {}", value(k)));
    };
    near(&rows["x"], &|k| states[k].0.x);
    near(&rows["y"], &|k| states[k].0.y);
    near(&rows["yaw"], &|k| states[k].0.yaw);
    near(&rows["left"], &|k| case.table.rim_speeds(k).0);
    near(&rows["right"], &|k| case.table.rim_speeds(k).1);
    (0..2).for_each(|j| near(&rows["joints"][j], &|k| states[k].1[j]));
    assert_eq!([&rows["step"], &rows["end"]], [&json!(0.1), &json!(case.table.duration())]);
    let closest = case.report.certificate.as_ref().and_then(|c| c.closest.as_ref()).expect("an obstacle");
    let least = data["clearance"]["values"].as_array().expect("values").iter().filter_map(Value::as_f64);
    let least = least.filter(|v| *v > -1e8).fold(f64::INFINITY, f64::min) * 1e-4;
    assert!(
        least >= closest.distance_m - 1e-4 - 1e-9,
        "measured at instants: {least}, least of all: {}",
        closest.distance_m
    );
}

#[test]
fn peaks_of_the_charts_are_those_of_the_certificate() {
    let case = Case::new("m", "blade", 70, 0.05);
    let found = actuators::all(&case.table, &case.robot);
    let peaks: Vec<f64> = found.iter().flat_map(|a| &a.courses).map(|c| c.peak[1].abs()).collect();
    let expected: Vec<f64> = case.report.limits.iter().filter_map(|l| l.peak).collect();
    assert_eq!(peaks.len(), expected.len());
    peaks.iter().zip(expected).for_each(|(a, b)| assert!((a - b).abs() < 1e-9, "{a} {b}"));
}

#[test]
fn forward_kinematics_have_all_they_need() {
    let robot = robot("blade");
    let data = serde_json::to_value(scene::Robot::of(&robot)).expect("plain");
    // The same chain of frames as the page's script makes, from the page's numbers.
    let pose = |v: &Value| {
        let n: Vec<f64> = v.as_array().expect("seven").iter().filter_map(Value::as_f64).collect();
        let turn = nalgebra::UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(n[6], n[3], n[4], n[5]));
        Isometry3::from_parts(nalgebra::Translation3::new(n[0], n[1], n[2]), turn)
    };
    let number = |v: &Value| v.as_f64().expect("a number");
    let q = [0.7, -0.4];
    let mut bodies: Vec<Isometry3<f64>> = Vec::new();
    for body in data["bodies"].as_array().expect("bodies") {
        let motion = &body["motion"];
        if motion.is_null() {
            bodies.push(pose(&body["origin"]));
            continue;
        }
        let value = number(&motion["multiplier"]) * q[number(&motion["joint"]) as usize] + number(&motion["offset"]);
        let axis = Vector3::new(number(&motion["axis"][0]), number(&motion["axis"][1]), number(&motion["axis"][2]));
        let moved = match motion["prismatic"] == true {
            true => Isometry3::translation(axis.x * value, axis.y * value, axis.z * value),
            false => Isometry3::rotation(axis * value),
        };
        bodies.push(bodies[number(&body["parent"]) as usize] * pose(&body["origin"]) * moved);
    }
    let shapes = data["shapes"].as_array().expect("shapes");
    for (shape, expected) in shapes.iter().zip(robot.shape_poses(&q)) {
        let found = bodies[number(&shape["body"]) as usize] * pose(&shape["pose"]);
        assert!((found.translation.vector - expected.translation.vector).norm() < 1e-6, "{found} {expected}");
        assert!(found.rotation.angle_to(&expected.rotation) < 1e-5);
    }
}

#[test]
fn a_failed_mission_shows_where_it_got_and_what_was_missing() {
    let mut case = Case::new("m", "blade", 40, 0.05);
    let fault = Diagnostic::failure("search/no-way", "no way to the goal; too tight")
        .number("closest_x_m", 1.25)
        .number("closest_y_m", -0.5)
        .number("closest_to_goal_m", 3.75)
        .number("narrowest_gap_m", 0.31)
        .number("narrowest_gap_x_m", 2.0)
        .number("narrowest_gap_y_m", 1.0)
        .number("least_gap_needed_m", 0.46)
        .number("tightest_x_m", 2.1)
        .number("tightest_y_m", 1.1)
        .number("tightest_yaw_rad", 0.5)
        .number("tightest_posture", json!({"blade": 0.5, "lift": 0.25}))
        .number("tightest_link", "drum")
        .number("missing_m", 0.0312)
        .number("something_else", 42);
    case.report = Report::new(InputsPart::default());
    case.report.fail(&Diagnostics(vec![fault]));
    let place = |x: f64| PoseSpec {
        x: Some(x),
        y: Some(1.0),
        joints: BTreeMap::from([("lift".into(), 0.75)]),
        ..Default::default()
    };
    let ends = [place(0.0), place(4.0)];
    let inputs = PageInputs { commands: None, ends: [Some(&ends[0]), Some(&ends[1])], ..case.inputs() };
    let page = html(&inputs);
    for said in [
        "failed",
        "no way to the goal; too tight",
        "(1.25, −0.50) m",
        "3.75 m",
        "0.31 m",
        "0.46 m",
        "3.2 cm",
        "drum",
        "something else",
        "42",
    ] {
        assert!(page.contains(said), "{said}");
    }
    assert!(!page.contains("id=\"time\""), "nothing moves");
    let data = data(&page);
    assert!(data["rows"].is_null() && data["map"].is_object());
    let kinds: Vec<&str> =
        data["places"].as_array().expect("places").iter().filter_map(|p| p["kind"].as_str()).collect();
    assert_eq!(kinds, ["start", "goal", "reached", "stuck"]);
    assert_eq!(data["places"][0]["joints"], json!([0.0, 0.75]), "what is open is drawn in its middle");
    assert_eq!(
        data["places"][3],
        json!({"name": "too tight", "kind": "stuck", "pose": [2.1, 1.1, 0.5], "joints": [0.5, 0.25], "link": "drum"})
    );
    assert_eq!(data["gap"], json!({"at": [2.0, 1.0], "width": 0.31, "needed": 0.46}));
    assert!(svg(&inputs).contains("0.31 m wide, 0.46 m needed"));
}

#[test]
fn every_end_of_a_run_has_a_page() {
    let case = Case::new("m", "blade", 40, 3.0);
    assert_eq!(case.report.failure.as_ref().map(|f| f.code.as_str()), Some("certify/clearance"));
    let mut early = Report::new(InputsPart::default());
    early.fail(&Diagnostics(vec![Diagnostic::failure("retime/too-slow", "cannot be timed")]));
    let all = case.inputs();
    for inputs in [
        all,
        PageInputs { map: None, ..all },
        PageInputs { commands: None, ..all },
        PageInputs { robot: None, map: None, commands: None, report: &early, ..all },
        PageInputs { commands: None, map: None, report: &early, ..all },
    ] {
        let page = html(&inputs);
        assert!(
            page.contains("failed")
                && page.contains(&html::escape(&inputs.report.failure.as_ref().expect("failed").reason))
        );
        assert!(data(&page).is_object());
        assert!(roxmltree::Document::parse(&svg(&inputs)).is_ok());
    }
}

#[test]
fn pages_of_long_missions_on_rough_maps_stay_below_a_megabyte_and_say_what_they_leave_out() {
    let mut case = Case::new("m", "blade", 40, 0.05);
    let mut map = VoxelMap::new(0.05, [0.0; 3], [400, 400, 20], Unknown::Free);
    let mut state = 1u64;
    for i in 0..400 {
        for j in 0..400 {
            for k in 0..20 {
                state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                if state >> 62 == 0 {
                    map.occupy([i, j, k]);
                }
            }
        }
    }
    case.map = Some(map);
    let fine = Vector3::new(0.31, 0.17, 0.23);
    let vertices: Vec<[f64; 3]> = (0..1000)
        .map(|i| {
            let (a, b) = (f64::from(i) * 2.399, f64::from(i) / 1000.0 * 2.0 - 1.0);
            [fine.x * real::cos(a) * (1.0 - b * b).sqrt(), fine.y * real::sin(a) * (1.0 - b * b).sqrt(), fine.z * b]
        })
        .collect();
    for joint in 0..10 {
        let mut new = case.robot.joints[0].clone();
        new.name = format!("joint {joint}");
        case.robot.joints.push(new);
        let link = format!("hull {joint}");
        case.robot.shapes.push(Shape {
            link,
            body: 0,
            pose: Isometry3::identity(),
            convex: Convex::Hull { vertices: vertices.clone() },
        });
    }
    case.table = table(&case.robot, 40_000);
    let page = case.page();
    assert!(page.len() < 1_000_000, "{} bytes", page.len());
    assert!(page.contains("rows one of every") && page.contains("The map is large"), "it says so");
    assert!(page.contains("more in the table alone"));
}

#[test]
fn the_tube_is_drawn_to_scale_and_its_width_against_the_way_driven() {
    let case = Case::new("m", "blade", 40, 0.05);
    let page = case.page();
    let trust = case.trust.as_ref().expect("commands that can be replayed");
    for (point, outline) in trust.tube.iter().map(|point| (point, trust::outline(point))) {
        let far = |p: &[f64; 2]| real::hypot(p[0] - point.place[0], p[1] - point.place[1]);
        let most = outline.iter().map(far).fold(0.0, f64::max);
        assert!(
            most <= point.width.distance + 1e-12 && most > 0.9 * point.width.distance,
            "{most} of {}",
            point.width.distance
        );
    }
    for said in ["id=\"trust\"", "where the base can be", "against the metres driven", "Nobody said how far", "assumed"]
    {
        assert!(page.contains(said), "{said}");
    }
    let mut report = case.report.clone();
    report.trust.as_mut().expect("there").in_force = true;
    assert!(!html(&PageInputs { report: &report, ..case.inputs() }).contains("Nobody said how far"));
    assert!(!html(&PageInputs { trust: None, ..case.inputs() }).contains("id=\"trust\""));
}

#[test]
fn figures_have_four_digits_and_proofs_round_to_the_safe_side() {
    let cases =
        [(12.3456, "12.35"), (0.000_123_456, "0.000123"), (-3.0, "−3"), (0.0, "0"), (1234.6, "1235"), (f64::NAN, "–")];
    for (value, text) in cases {
        assert_eq!(figure(value), text);
    }
    assert_eq!([at_least_mm(0.032_229_9), at_least_mm(0.05)], ["32.22 mm", "50 mm"]);
    assert_eq!([percent(0.992_01), percent(1.0), percent(0.5)], ["99.3 %", "100.0 %", "50.0 %"]);
    assert_eq!([mm(0.0), mm(2e-7), mm(2.811e-6), mm(0.05)], ["0 mm", "< 0.001 mm", "0.003 mm", "50 mm"]);
    assert_eq!([grouped(12), grouped(1234), grouped(1_234_567)], ["12", "1\u{202f}234", "1\u{202f}234\u{202f}567"]);
}

#[test]
fn a_goal_of_a_link_is_told_by_the_link_and_not_by_where_the_base_stands() {
    let mut case = Case::new("reach", "j", 4, 0.01);
    let certificate = case.report.certificate.as_mut().expect("judged");
    certificate.goal_within_m = Some(1.4);
    certificate.link = Some(crate::report::schema::LinkPart {
        name: "<hand>".into(),
        point_error_m: 0.0021,
        within_m: 0.01,
        angle_error_rad: Some(0.002),
    });
    let told = crate::report::summary::goal_text(certificate).expect("told").replace('\u{a0}', " ");
    assert_eq!(told, "missed by 2.1 mm and 0.1146° by link <hand>; allowed: 10 mm and 1°");
    let page = case.page().replace('\u{a0}', " ");
    let tile = "<dt>Off the goal</dt><dd>2.1 mm <small>of link &lt;hand&gt;, and 0.1146° of its turn</small></dd>";
    assert!(page.contains(tile) && !page.contains("the goal's middle"), "{page}");
    assert!(page.contains("at rest, &lt;hand&gt; within 2.1 mm and 0.1146° of its place; 10 mm and 1° are allowed"));
}
