//! What a person reads after a mistake in a mission or a robot.yaml: one snapshot a mistake, in `tests/golden`.
//!
//! Each message says the file, the line, what was found, what was expected and what to do. After an intended change run
//! with `INSTA_UPDATE=always` and read every text that moved.

use trajc::diag::{Diagnostics, render};
use trajc::{mission, robot};

/// A good mission whose lines the mistakes replace.
const GOOD: &str = "\
robot: ../robots/scr_db/robot.yaml
map: {file: ../maps/arch.pcd, resolution_m: 0.05}
start: {x_m: 0.5, y_m: 0.5, yaw: 0deg}
goal: {x_m: 9.0, y_m: 8.0, yaw: 90deg}
";

/// The good mission with the line that begins like `line` replaced by it, or with `line` added.
fn with(line: &str) -> String {
    let key = line.split(':').next().unwrap_or(line);
    let begins = |l: &str| l.starts_with(&format!("{key}:"));
    let mut lines: Vec<&str> = GOOD.lines().map(|l| if begins(l) { line } else { l }).collect();
    if !GOOD.lines().any(begins) {
        lines.push(line);
    }
    lines.join("\n") + "\n"
}

/// The good mission without a key.
fn without(key: &str) -> String {
    GOOD.lines().filter(|l| !l.starts_with(key)).map(|l| format!("{l}\n")).collect()
}

fn golden(name: &str, diagnostics: &Diagnostics) {
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path("golden");
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.bind(|| insta::assert_snapshot!(format!("mission_{name}"), render(diagnostics, false)));
}

/// Every diagnostic has a place and a hint; the text is the golden one.
fn mission(name: &str, text: &str) {
    let faults = mission::parse("missions/a.yaml", text).expect_err(text);
    assert!(faults.0.iter().all(|d| d.at.is_some() && d.hint.is_some()), "{faults:?}");
    golden(name, &faults);
}

fn robot(name: &str, text: &str) {
    let faults = robot::spec::parse("robots/r/robot.yaml", text).expect_err(text);
    assert!(faults.0.iter().all(|d| d.at.is_some() && d.hint.is_some()), "{faults:?}");
    golden(&format!("robot_{name}"), &faults);
}

#[test]
fn the_good_mission_is_good() {
    mission::parse("a.yaml", GOOD).expect("good");
}

#[test]
fn text_that_is_not_yaml() {
    mission("empty", "");
    mission("only_comments", "# nothing here yet\n\n");
    mission("not_key_value", "just some words\n");
    mission("unclosed_bracket", &with("start: {x_m: 0.5, y_m: 0.5, yaw: 0deg"));
    mission("no_space_after_colon", &with("clearance_m:0.05\nreverse: true"));
    mission("wrong_indentation", "robot: r.yaml\n  map: {file: m.pcd}\n");
    mission("tab", "robot: r.yaml\nmap:\n\tfile: m.pcd\n");
    mission("two_documents", &format!("{GOOD}---\n{GOOD}"));
    mission("unknown_alias", &with("start: *here"));
    mission("tag", &with("clearance_m: !metres 5"));
    mission("too_deep", &with(&format!("path: {}{}", "[".repeat(40), "]".repeat(40))));
    let mut bomb = "a0: &a0 [1, 1, 1, 1, 1, 1, 1, 1, 1]\n".to_string();
    for i in 1..8 {
        let alias = vec![format!("*a{}", i - 1); 9].join(", ");
        bomb += &format!("a{i}: &a{i} [{alias}]\n");
    }
    mission("alias_bomb", &bomb);
}

#[test]
fn wrong_keys() {
    mission("unknown_key", &with("goals: {x_m: 9.0, y_m: 8.0}"));
    mission("unknown_key_no_guess", &with("colour: red"));
    mission("key_without_unit", &with("start: {x: 0.5, y: 0.5, yaw: 0}"));
    mission("key_of_another_table", &with("resolution_m: 0.05"));
    mission("key_near_and_elsewhere", &with("sampling_times_s: [0.1]"));
    mission("repeated_key", &format!("{GOOD}clearance_m: 0.05\ngoal: {{x_m: 1, y_m: 1}}\n"));
    mission("missing_robot", &without("robot"));
    mission("missing_goal", &without("goal"));
    mission("nothing_to_plan", "robot: r.yaml\n");
    mission("missing_position", &with("start: {x_m: 0.5}"));
    mission("missing_map_file", &with("map: {resolution_m: 0.05}"));
    mission("no_value", &with("goal:"));
    mission("no_space_in_braces", &with("goal: {x_m:9.0, y_m: 8.0}"));
    mission("decimal_comma", &with("goal: {x_m: 9,5, y_m: 8.0}"));
    mission("goal_radius", &with("goal: {x_m: 9.0, y_m: 8.0, radius_m: 0.3, yaw: 90deg}"));
    mission("start_file_and_joints", &with("start: {file: ../out/b/commands.csv, yaw: 0, joints: {blade: 0}}"));
    mission("start_file_and_path", "robot: r.yaml\nstart: {file: c.csv}\npath: {file: a.csv}\n");
    mission("start_file_number", &with("start: {file: 3}"));
    mission("via", &with("via: {x_m: 4.0, y_m: 4.0}"));
    mission("via_keys", &with("via: [{x_m: 4.0, dwell: 2}]"));
    mission("via_dwell", &with("via: [{x_m: 4.0, y_m: 4.0, dwell_s: -1}]"));
    mission("via_and_path", "robot: r.yaml\nvia: [{x_m: 4.0, y_m: 4.0}]\npath: {file: a.csv}\n");
    mission("unknown_limit", &with("limits: {wheel: {speed: 0.5}, joints: {blade: {sped: 1.0}}}"));
}

#[test]
fn wrong_values() {
    mission("text_for_number", &with("clearance_m: small"));
    mission("number_with_unit", &with("clearance_m: 5cm"));
    mission("quoted_number", &with("clearance_m: \"0.05\""));
    mission("comma_number", &with("clearance_m: 0,05"));
    mission("not_finite", &with("clearance_m: .nan"));
    mission("too_large_number", &with("start: {x_m: 1e400, y_m: 0.5, yaw: 0}"));
    mission("negative_clearance", &with("clearance_m: -0.05"));
    mission("parameterisation", &with("parameterisation: arc length"));
    mission("sampling_time", &with("sampling_time_s: 0"));
    mission("sampling_time_long", &with("sampling_time_s: 100"));
    mission("resolution", &with("map: {file: a.pcd, resolution_m: 0}"));
    mission("height_crossed", &with("map: {file: a.pcd, height_m: [1.0, 0.02]}"));
    mission("height_count", &with("map: {file: a.pcd, height_m: [1.0]}"));
    let map = |added: &str| with(&format!("map: {{file: a.pcd, {added}}}"));
    mission("keep_out_line", &map("keep_out: [{polygon_m: [[0, 0], [1, 1], [2, 2]]}]"));
    mission("keep_out_height", &map("keep_out: [{polygon_m: [[0, 0], [1, 0], [2, 2]], height_m: [1, 0]}]"));
    mission("keep_out_bare", &map("keep_out: [[[0, 0], [1, 0], [2, 2]]]"));
    mission("keep_out_two_corners", &map("keep_out: [{polygon_m: [[0, 0], [1, 0]]}]"));
    mission("box_upside_down", &map("boxes: [{min_m: [0, 0, 1], max_m: [1, 1, 0]}]"));
    mission("box_key", &map("boxes: [{min: [0, 0, 0], max_m: [1, 1, 1]}]"));
    mission("zone_line", &map("speed_zones: [{polygon_m: [[0, 0], [1, 1], [2, 2]], speed_mps: 0.3}]"));
    mission("zone_speed", &map("speed_zones: [{polygon_m: [[0, 0], [1, 0], [2, 2]], v_max_m_s: 0.3}]"));
    mission("zone_zero", &map("speed_zones: [{polygon_m: [[0, 0], [1, 0], [2, 2]], speed_mps: 0}]"));
    mission("unknown_word", &with("map: {file: a.pcd, unknown: ocupied}"));
    mission("sampling_word", &with("sampling: traced"));
    mission("time_law_word", &with("time_law: fastest"));
    mission("flag", &with("reverse: yes"));
    mission("list_for_table", &with("start: [0.5, 0.5, 0]"));
    mission("goal_within_zero", &with("goal: {x_m: 9.0, y_m: 8.0, within_m: 0}"));
    mission("goal_yaw_word", &with("goal: {x_m: 9.0, y_m: 8.0, yaw: free}"));
    mission("start_yaw_any", &with("start: {x_m: 9.0, y_m: 8.0, yaw: any}"));
    mission("angle_degree_sign", &with("start: {x_m: 0.5, y_m: 0.5, yaw: 90°}"));
    mission("angle_space", &with("start: {x_m: 0.5, y_m: 0.5, yaw: 90 deg}"));
    mission("angle_pi", &with("start: {x_m: 0.5, y_m: 0.5, yaw: pi/2}"));
    mission("degrees_for_rate", &with("limits: {joints: {blade: {speed: 60deg}}}"));
    mission("limit_zero", &with("limits: {wheel: {speed_mps: 0}}"));
    mission("eta", &with("limits: {base: {eta: 1.5}}"));
    mission("joint_limits_crossed", &with("limits: {joints: {blade: {lower: 90deg, upper: 0}}}"));
    mission("path_error_times", &with("path_error: {sampling_times_s: []}"));
}

#[test]
fn wrong_paths() {
    let path = |p: &str| format!("robot: r.yaml\npath: {p}\n");
    mission("path_empty", &path("{}"));
    mission("path_both", &path("{file: a.csv, bezier: [[[0, 0], [1, 0], [2, 0], [3, 0]]]}"));
    mission("path_third_component", &path("{bezier: [[[0, 0, 0], [1, 0], [2, 0], [3, 0]]]}"));
    mission("path_three_points", &path("{bezier: [[[0, 0], [1, 0], [2, 0]]]}"));
    mission("path_one_level_too_few", &path("{bezier: [[0, 0], [1, 0], [2, 0], [3, 0]]}"));
    mission(
        "path_gap",
        &path("\n  bezier:\n    - [[0, 0], [1, 0], [2, 0], [3, 0]]\n    - [[3.1, 0], [4, 0], [5, 0], [6, 0]]"),
    );
    mission("path_point", &path("{bezier: [[[1, 1], [1, 1], [1, 1], [1, 1]]]}"));
}

#[test]
fn several_mistakes_are_told_at_once() {
    mission("several", &format!("{}start: 5\nclearence_m: 0.05\nsampling_time_s: abc\n", without("start")));
}

#[test]
fn mistakes_in_a_robot_yaml() {
    robot("empty", "");
    robot("unknown_key", "urdf: a.urdf\ndrive: {left: l, right: r, wheel_radius: 0.08}\n");
    robot("missing_urdf", "name: a\n");
    robot("zero_track", "urdf: a.urdf\ndrive: {left: l, right: r, track_width_m: 0}\n");
    robot("one_sided_drive", "urdf: a.urdf\ndrive: {left: left_wheel_joint}\n");
    robot("wheel_twice", "urdf: a.urdf\ndrive: {left: wheel, right: wheel}\n");
    robot("moving_and_fixed", "urdf: a.urdf\njoints:\n  moving: [blade, lift]\n  fixed: {lift: 0.1}\n");
    robot("moving_text", "urdf: a.urdf\njoints: {moving: blade}\n");
    robot("fixed_list", "urdf: a.urdf\njoints: {fixed: [lift]}\n");
    robot("number_for_name", "urdf: a.urdf\njoints: {moving: [1]}\n");
    robot("pair", "urdf: a.urdf\ncollision: {ignore_pairs: [base_link, left_blade]}\n");
    robot("jerk", "urdf: a.urdf\nlimits: {wheel: {jerk_mps3: -2}}\n");
}
