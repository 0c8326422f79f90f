use std::f64::consts::{FRAC_PI_2, PI};

use proptest::prelude::*;

use super::*;
use crate::diag::shape::{Choice, Field, Shape};
use crate::diag::{render, yaml};

/// Every key, none at its default.
const FULL: &str = "\
robot: ../robots/scr_db/robot.yaml
map:
  file: ../maps/arch.npy
  resolution_m: 0.1
  height_m: [0.02, 1.0]
  unknown: free
  origin_m: [1, 2, 3]
  keep_out: [{polygon_m: [[0, 0], [1, 0], [1, 2]], height_m: [0.1, 0.5]}]
  boxes: [{min_m: [0, 1, 2], max_m: [3, 4, 5]}]
  speed_zones: [{polygon_m: [[0, 0], [2, 0], [2, 3]], speed_mps: 0.25}]
start: {x_m: 0.5, y_m: -0.5, yaw: 180deg, joints: {blade: 90deg, lift: 0.1}}
goal: {x_m: 9.0, y_m: 8.0, within_m: 0.3, yaw: 1.5, joints: {blade: 0}}
clearance_m: 0.1
sampling_time_s: 0.05
sampling: instant
time_law: eq5
reverse: true
parameterisation: arc_length
path_error: {sampling_times_s: [0.5, 0.1, 0.5]}
limits:
  wheel: {speed_mps: 1, acceleration_mps2: 2, jerk_mps3: 3}
  joints: {blade: {lower: 10deg, upper: 2.0, speed: 4, acceleration: 5, jerk: 6}}
  base: {speed_mps: 7, acceleration_mps2: 8, angular_speed_radps: 9, angular_acceleration_radps2: 10, eta: 0.5, min_speed_mps: 0.02}
tolerance: {wheel_radius: 1%, wheel_difference: 0.02, track: 3%, latency_s: 0.04, start_m: 0.05, start_rad: 6deg}
path: {bezier: [[[0, 0], [2, 0], [4, 2], [4, 4]], [[4, 4], [4, 5], [4, 6], [4, 7]]]}
";

/// Not together with a place of the base.
const LINK_GOAL: &str = "goal: {link: {name: tool0, position_m: [1, 2, 0.5], rpy: [0, 90deg, 1], within_m: 0.02}}\n";

/// Not together with a given path, which [`FULL`] has.
const VIA: &str =
    "via: [{x_m: 4.0, y_m: 4.5, within_m: 0.2, yaw: 90deg, joints: {blade: 1}, dwell_s: 2}, {x_m: 5.0, y_m: 6.0}]\n";

const LEAST: &str = "robot: r.urdf\nmap: {file: m.pcd}\nstart: {x_m: 1, y_m: 2, yaw: 0}\ngoal: {x_m: 3, y_m: 4}\n";

fn good(text: &str) -> Mission {
    parse("missions/arch_bridges.yaml", text).unwrap_or_else(|faults| panic!("{}", render(&faults, false)))
}

fn codes(text: &str) -> Vec<&'static str> {
    parse("a.yaml", text).expect_err(text).0.iter().map(|d| d.code).collect()
}

#[test]
fn what_is_left_out_takes_its_default() {
    let mission = good(LEAST);
    assert_eq!(mission.name, "arch_bridges");
    assert_eq!(mission.robot, PathBuf::from("r.urdf"));
    let map = mission.map.expect("map");
    assert_eq!((map.resolution, map.height, map.unknown, map.origin), (None, None, Unknown::Occupied, None));
    assert_eq!(mission.goal.expect("goal").yaw, None);
    assert_eq!((mission.clearance, mission.sampling_time), (0.05, 0.1));
    assert_eq!((mission.sampling, mission.time_law, mission.reverse), (Sampling::Tracked, TimeLaw::Auto, false));
    assert_eq!(mission.path_error_times, [0.01, 0.02, 0.05, 0.1, 0.2, 0.5]);
    assert_eq!(mission.parameterisation, Parameterisation::DEFAULT);
    assert_eq!(mission.limits, LimitsSpec::default());
    assert_eq!(mission.path, None);
}

#[test]
fn every_key_is_read() {
    let mission = good(FULL);
    let map = MapSpec {
        file: "../maps/arch.npy".into(),
        resolution: Some(0.1),
        height: Some([0.02, 1.0]),
        unknown: Unknown::Free,
        origin: Some([1.0, 2.0, 3.0]),
        keep_out: vec![KeepOut { polygon: vec![[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]], height: Some([0.1, 0.5]) }],
        boxes: vec![Aabb { min: [0.0, 1.0, 2.0], max: [3.0, 4.0, 5.0] }],
        speed_zones: vec![SpeedZone { polygon: vec![[0.0, 0.0], [2.0, 0.0], [2.0, 3.0]], speed: 0.25 }],
    };
    assert_eq!(mission.map, Some(map));
    let start = mission.start.expect("start");
    assert_eq!((start.x, start.y, start.yaw), (Some(0.5), Some(-0.5), Some(PI)));
    assert_eq!(start.joints, BTreeMap::from([("blade".into(), FRAC_PI_2), ("lift".into(), 0.1)]));
    let goal = mission.goal.expect("goal");
    assert_eq!((goal.within, goal.yaw, goal.joints["blade"]), (0.3, Some(1.5), 0.0));
    assert_eq!((mission.clearance, mission.sampling_time), (0.1, 0.05));
    assert_eq!((mission.sampling, mission.time_law, mission.reverse), (Sampling::Instant, TimeLaw::Eq5, true));
    assert_eq!(mission.parameterisation, Parameterisation::ArcLength);
    assert_eq!(mission.path_error_times, [0.1, 0.5]);
    let limits = mission.limits;
    assert_eq!([limits.wheel.speed, limits.wheel.acceleration, limits.wheel.jerk], [Some(1.0), Some(2.0), Some(3.0)]);
    let blade = limits.joints["blade"];
    assert_eq!([blade.lower, blade.upper], [Some(10f64.to_radians()), Some(2.0)]);
    assert_eq!([blade.speed, blade.acceleration, blade.jerk], [Some(4.0), Some(5.0), Some(6.0)]);
    let base = limits.base;
    assert_eq!([base.speed, base.acceleration, base.angular_speed], [Some(7.0), Some(8.0), Some(9.0)]);
    assert_eq!([base.angular_acceleration, base.eta, base.min_speed], [Some(10.0), Some(0.5), Some(0.02)]);
    let Some(PathSpec::Bezier(segments)) = mission.path else { panic!("no segments") };
    assert_eq!(segments[1], [[4.0, 4.0], [4.0, 5.0], [4.0, 6.0], [4.0, 7.0]]);
}

#[test]
fn stops_on_the_way_are_read_in_their_order() {
    let mission = good(&format!("{LEAST}{VIA}"));
    let [first, second] = &mission.via[..] else { panic!("{:?}", mission.via) };
    assert_eq!((first.place.x, first.place.y, first.place.yaw), (Some(4.0), Some(4.5), Some(FRAC_PI_2)));
    assert_eq!((first.place.within, first.place.joints["blade"], first.dwell), (0.2, 1.0, 2.0));
    assert_eq!((second.place.x, second.place.yaw, second.dwell), (Some(5.0), None, 0.0));
    assert_eq!((mission.spans.via.len(), mission.spans.joints[0].under.as_str()), (2, "via[0]"));
    assert_eq!(codes("robot: r\nvia: [{x_m: 1, y_m: 1}]\npath: {file: a.csv}\n"), ["mission/via-and-path"]);
}

#[test]
fn laws_of_the_distance_driven_get_curves_that_stand_nowhere_unless_told_otherwise() {
    let with = |lines: &str| good(&format!("{LEAST}{lines}")).parameterisation;
    for law in ["eq5", "fixed_point", "printed"] {
        assert_eq!(with(&format!("time_law: {law}\n")), Parameterisation::Flat);
        assert_eq!(with(&format!("time_law: {law}\nparameterisation: arc_length\n")), Parameterisation::ArcLength);
    }
    for law in ["auto", "minco"] {
        assert_eq!(with(&format!("time_law: {law}\n")), Parameterisation::DEFAULT);
        assert_eq!(with(&format!("time_law: {law}\nparameterisation: flat\n")), Parameterisation::Flat);
    }
}

#[test]
fn every_parameterisation_is_read_back_from_its_word() {
    for value in [Parameterisation::Flat, Parameterisation::ArcLength] {
        let word = value.key();
        assert_eq!(good(&format!("{LEAST}parameterisation: {word}\n")).parameterisation, value);
        assert_eq!(<Parameterisation as clap::ValueEnum>::from_str(word, false), Ok(value));
    }
}

#[test]
fn a_later_stage_can_point_at_what_it_refuses() {
    let mission = good(FULL);
    let text = |span: &Option<Span>| {
        let span = span.as_ref().expect("a span");
        span.source.text[span.range.clone()].to_string()
    };
    assert!(text(&mission.spans.start).starts_with("start: {") && text(&mission.spans.start).ends_with("}}"));
    assert!(text(&mission.spans.map).starts_with("map:\n  file:"));
    assert_eq!(text(&mission.spans.map_file), "../maps/arch.npy");
    assert_eq!(text(&mission.spans.map_resolution), "0.1");
    assert_eq!(text(&mission.spans.robot), "../robots/scr_db/robot.yaml");
    let joints: Vec<(&str, &str)> = mission.spans.joints.iter().map(|j| (j.name.as_str(), j.under.as_str())).collect();
    assert_eq!(joints, [("blade", "start"), ("lift", "start"), ("blade", "goal"), ("blade", "limits.joints")]);
    assert!(mission.spans.joints.iter().all(|j| text(&Some(j.at.clone())) == j.name));
}

#[test]
fn a_goal_is_a_place_of_the_base_or_of_a_link() {
    let goal = |text: &str| LEAST.replace("goal: {x_m: 3, y_m: 4}", &format!("goal: {{{text}}}"));
    let text = goal("link: {name: tool0, position_m: [1, 2, 0.5], rpy: [0, 90deg, 1]}, yaw: 0.5");
    let mission = good(&text);
    let place = mission.goal.expect("written");
    let rpy = Some([0.0, std::f64::consts::FRAC_PI_2, 1.0]);
    let link = LinkSpec { name: "tool0".into(), position: [1.0, 2.0, 0.5], rpy, within: 0.01 };
    assert_eq!((place.x, place.y, place.yaw, place.link), (Some(1.0), Some(2.0), Some(0.5), Some(link)));
    assert_eq!(&text[mission.spans.goal_link.expect("written").range], "tool0");
    for more in ["x_m: 1", "y_m: 1", "within_m: 0.1"] {
        assert_eq!(codes(&goal(&format!("link: {{name: a, position_m: [1, 2, 3]}}, {more}"))), ["mission/two-goals"]);
    }
    assert_eq!(codes(&goal("link: {name: a, position_m: [1, 2]}")).len(), 1);
    assert_eq!(codes(&goal("link: {position_m: [1, 2, 3]}")).len(), 1);
    let given = "robot: r\ngoal: {link: {name: a, position_m: [1, 2, 3]}}\npath: {file: b.csv}\n";
    assert_eq!(codes(given), ["mission/link-and-path"]);
}

#[test]
fn a_start_is_a_pose_or_a_file_that_ends_there() {
    let text = LEAST.replace("{x_m: 1, y_m: 2, yaw: 0}", "{file: ../out/b/commands.mcap}");
    let mission = good(&text);
    assert_eq!(mission.start_file, Some("../out/b/commands.mcap".into()));
    let span = mission.spans.start_file.expect("written");
    assert_eq!(&text[span.range], "../out/b/commands.mcap");
    for more in ["x_m: 1", "yaw: 90deg", "joints: {blade: 1}"] {
        assert_eq!(codes(&text.replace(".mcap}", &format!(".mcap, {more}}}"))), ["mission/two-starts"]);
    }
    assert_eq!(codes("robot: r\nstart: {file: a.csv}\npath: {file: b.csv}\n"), ["mission/start-and-path"]);
}

#[test]
fn a_heading_that_is_any_is_one_that_is_left_out() {
    let mission =
        good(&format!("{}via: [{{x_m: 1, y_m: 1, yaw: any}}]\n", LEAST.replace("y_m: 4}", "y_m: 4, yaw: any}")));
    assert_eq!((mission.goal.expect("goal").yaw, mission.via[0].place.yaw), (None, None));
    assert_eq!(codes(&LEAST.replace("yaw: 0}", "yaw: any}")), ["yaml/wrong-type"]);
}

#[test]
fn a_given_path_needs_no_map_and_no_poses() {
    let mission = good("robot: r.urdf\npath: {file: path.csv}\nstart: {joints: {blade: 1}}\n");
    assert_eq!(mission.path, Some(PathSpec::File("path.csv".into())));
    assert_eq!((mission.map, mission.start.expect("start").x), (None, None));
}

#[test]
fn segments_may_miss_each_other_by_a_micrometre_and_no_more() {
    let path =
        |x: f64| format!("robot: r\npath: {{bezier: [[[0,0],[1,0],[2,0],[3,0]], [[{x},0],[4,0],[5,0],[6,0]]]}}\n");
    good(&path(3.0 + 0.9e-6));
    assert_eq!(codes(&path(3.0 + 1.1e-6)), ["mission/path-gap"]);
}

#[test]
fn bounds_are_where_they_are_said_to_be() {
    let with = |line: &str| format!("{LEAST}{line}\n");
    for line in ["sampling_time_s: 10", "clearance_m: 0", "limits: {base: {eta: 1}}", "sampling_time_s: 1e-4"] {
        good(&with(line));
    }
    for line in ["sampling_time_s: 10.01", "clearance_m: -1e-9", "limits: {base: {eta: 0}}", "clearance_m: 1e7"] {
        assert_eq!(codes(&with(line)), ["yaml/out-of-range"], "{line}");
    }
}

#[test]
fn faults_come_in_the_order_of_the_text() {
    let text = "clearance_m: x\nrobot: 5\npath: {bezier: 1}\nreverse: maybe\n";
    let faults = parse("a.yaml", text).expect_err(text).0;
    let starts: Vec<usize> = faults.iter().filter_map(|d| Some(d.at.as_ref()?.range.start)).collect();
    assert_eq!(starts.len(), 4);
    assert!(starts.is_sorted(), "{starts:?}");
}

/// Every table of keys below this one, with its path in the YAML.
fn tables(path: Vec<&'static str>, table: &'static [Field], out: &mut Vec<(Vec<&'static str>, &'static [Field])>) {
    out.push((path.clone(), table));
    for field in table {
        let mut path = path.clone();
        path.push(field.key);
        match &field.shape {
            Shape::Table(inner) => tables(path, inner, out),
            Shape::Named(Shape::Table(inner)) => {
                path.push("any_name");
                tables(path, inner, out);
            }
            Shape::List { item: Shape::Table(inner), .. } => {
                path.push("an_item");
                tables(path, inner, out);
            }
            _ => {}
        }
    }
}

fn all_tables() -> Vec<(Vec<&'static str>, &'static [Field])> {
    let mut out = Vec::new();
    tables(Vec::new(), &fields::MISSION, &mut out);
    out
}

#[test]
fn the_schema_has_exactly_the_keys_that_the_parser_knows() {
    let schema = json_schema();
    for (path, table) in all_tables() {
        let object = path.iter().fold(&schema, |at, key| match *key {
            "any_name" => &at["additionalProperties"],
            "an_item" => &at["items"],
            key => &at["properties"][key],
        });
        assert_eq!(object["additionalProperties"], false, "{path:?}");
        let keys: Vec<&str> =
            object["properties"].as_object().expect("properties").keys().map(String::as_str).collect();
        assert_eq!(keys, table.iter().map(|f| f.key).collect::<Vec<_>>(), "{path:?}");
        for key in keys {
            assert!(object["properties"][key]["description"].is_string(), "{path:?} {key}");
        }
    }
}

#[test]
fn the_mission_with_every_key_has_every_key() {
    let load = |text: String| yaml::load(&Arc::new(Source { name: "a".into(), text })).expect("yaml");
    let (root, of_link) = (load(FULL.to_string() + VIA), load(LINK_GOAL.into()));
    for (path, table) in all_tables() {
        let whole = if path.starts_with(&["goal", "link"]) { &of_link } else { &root };
        let node = path.iter().try_fold(whole, |at, key| match *key {
            "any_name" => at.get("blade"),
            "an_item" => at.items().first(),
            key => at.get(key),
        });
        let node = node.unwrap_or_else(|| panic!("{path:?}"));
        for field in table.iter().filter(|f| !matches!(f.shape, Shape::Later(_))) {
            // Two ways to give a path, a start or a goal; this mission has the other one.
            let other = [("path", "file"), ("start", "file"), ("goal", "link")].map(|(table, key)| (vec![table], key));
            assert!(
                other.contains(&(path.clone(), field.key)) || node.get(field.key).is_some(),
                "{path:?} {}",
                field.key
            );
        }
    }
}

#[test]
fn every_example_in_the_documentation_of_a_key_is_good() {
    for (path, table) in all_tables() {
        for field in table.iter().filter(|f| !matches!(f.shape, Shape::Later(_))) {
            let mut text = format!("{{{}: {}}}", field.key, field.example);
            for key in path.iter().rev() {
                text = if *key == "an_item" { format!("[{text}]") } else { format!("{{{key}: {text}}}") };
            }
            let faults = parse("a.yaml", &text).err().map_or(Vec::new(), |f| f.0);
            let wrong: Vec<_> = faults
                .iter()
                .filter(|d| !d.code.ends_with("missing-key") && d.code != "mission/nothing-to-plan")
                .collect();
            assert!(wrong.is_empty(), "{text}: {wrong:?}");
        }
    }
}

#[test]
fn every_word_of_a_choice_stands_for_something() {
    let words = |field: &str| -> Vec<&str> {
        let field = fields::MISSION.iter().find(|f| f.key == field).expect("field");
        let Shape::Choice(choices) = &field.shape else { panic!("no choice") };
        choices.iter().map(|c: &Choice| c.word).collect()
    };
    assert_eq!(words("sampling"), fields::SAMPLING_LAWS.map(|(word, _)| word));
    assert_eq!(words("time_law"), fields::TIME_LAWS.map(|(word, _)| word));
}

#[test]
fn a_file_of_noise_is_refused_at_once() {
    let noise: String = (0..20_000).map(|i| format!("k{}: [{i}, x\u{e9}]\n", i % 15_000)).collect();
    let long_list = format!("{LEAST}path: {{bezier: [{}]}}\n", vec!["[0, 1]"; 20_000].join(", "));
    for text in [noise, long_list] {
        let faults = parse("a.yaml", &text).expect_err("noise");
        assert!((100..=300).contains(&faults.0.len()), "{}", faults.0.len());
    }
}

#[test]
fn a_mission_from_windows_is_the_same_mission() {
    let windows = format!("\u{feff}{}", FULL.replace('\n', "\r\n"));
    let (a, b) = (good(FULL), good(&windows));
    let limits = |limits: LimitsSpec| LimitsSpec { places: Vec::new(), ..limits };
    assert_eq!((a.map, a.start, a.goal, a.path), (b.map, b.start, b.goal, b.path));
    assert_eq!(limits(a.limits), limits(b.limits));
}

/// Deletes, repeats or replaces pieces of a good text.
fn mutated(text: &'static str) -> impl Strategy<Value = String> {
    let piece = prop_oneof![
        Just(String::new()),
        "[-0-9a-z:,.{}\\[\\] \n\"'&*é\t]{1,6}",
        Just(".nan".to_string()),
        Just("1e999".to_string()),
        Just("~".to_string()),
        Just("[[[]]]".to_string()),
    ];
    proptest::collection::vec((0..text.len(), 0usize..12, piece), 1..5).prop_map(move |edits| {
        let mut bytes = text.as_bytes().to_vec();
        for (at, length, piece) in edits {
            let at = at.min(bytes.len());
            let end = (at + length).min(bytes.len());
            bytes.splice(at..end, piece.bytes());
        }
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

proptest! {
    #[test]
    fn a_damaged_mission_is_read_or_refused_with_places_and_hints(text in mutated(FULL)) {
        match parse("a.yaml", &text) {
            Ok(mission) => {
                prop_assert!(mission.sampling_time.is_finite() && mission.clearance >= 0.0);
                prop_assert!(!mission.path_error_times.is_empty());
                prop_assert!(mission.path.is_some() || mission.start.is_some_and(|s| s.x.is_some() && s.yaw.is_some()));
            }
            Err(faults) => {
                prop_assert!(!faults.0.is_empty());
                prop_assert!(faults.0.iter().all(|d| d.at.is_some() && d.hint.is_some()), "{:?}", faults);
                prop_assert!(!render(&faults, true).is_empty());
            }
        }
    }

    #[test]
    fn any_text_is_refused_without_panic(text in "\\PC{0,80}") {
        if let Err(faults) = parse(&text, &text) {
            prop_assert!(!render(&faults, false).is_empty());
        }
    }

    #[test]
    fn numbers_and_degrees_are_read_exactly(x in -1e6..1e6f64, degrees in -1e4..1e4f64) {
        let text = format!("robot: r\npath: {{file: p.csv}}\nstart: {{x_m: {x:?}, yaw: {degrees:?}deg}}\n");
        let start = good(&text).start.expect("start");
        prop_assert_eq!((start.x, start.yaw), (Some(x), Some(degrees.to_radians())));
    }
}
