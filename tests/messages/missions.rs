//! Mistakes in a mission's text.

use super::case::{Case, MISSION, Why, case};

const START: &str = "start: {x_m: 0.6, y_m: 1.5, yaw: 0deg}";
const GOAL: &str = "goal: {x_m: 3.4, y_m: 1.5, yaw: 0deg}";
const ROBOT_LINE: &str = "robot: ../robots/box_base/robot.yaml\n";

/// The mission with a line more at its end.
fn added(name: &'static str, line: &'static str) -> Case {
    case(name).append(MISSION, line)
}

/// Key above a value that is a table of its own, in the place of another line.
fn instead(name: &'static str, from: &'static str, to: &'static str) -> Case {
    case(name).edit(MISSION, from, to)
}

pub fn cases() -> Vec<Case> {
    let mut all = syntax();
    all.extend(keys());
    all.extend(values());
    all.extend(areas());
    all.extend(tolerances());
    all.extend(contradictions());
    all
}

fn syntax() -> Vec<Case> {
    vec![
        case("empty")
            .write(MISSION, "")
            .at_the_top(MISSION)
            .nothing_found(Why::WholeFile)
            .expected("at least `robot`")
            .hint("`map`, `start` and `goal`"),
        case("not_key_value")
            .write(MISSION, "drive to the door\n")
            .at(MISSION, "drive")
            .found("the text `drive to the door`")
            .expected("`key: value` lines")
            .hint("a space after each colon"),
        instead("tab", "  resolution_m", "\tresolution_m")
            .at(MISSION, "\tresolution_m")
            .found("a tab")
            .expected("spaces")
            .hint("spaces"),
        instead("unclosed_quote", "robot: ..", "robot: \"..")
            .at(MISSION, "robot: |\"")
            .found("quote")
            .expected("end")
            .hint("quote"),
        instead("unclosed_bracket", START, "start: {x_m: 0.6, y_m: 1.5, yaw: 0deg")
            .at(MISSION, "goal|:")
            .found("`:`")
            .expected("`}`")
            .hint("brackets"),
        instead("no_space_after_colon", "clearance_m: 0.05", "clearance_m:0.05")
            .at(MISSION, "clearance_m:0.05")
            .found("`clearance_m:0.05`")
            .expected("`key: value`")
            .hint("a colon and a space"),
        instead("indented", "clearance_m: 0.05", " clearance_m: 0.05")
            .at(MISSION, " |clearance_m: 0.05")
            .found("indented")
            .expected("like the lines")
            .hint("spaces"),
        instead("unknown_alias", START, "start: *door")
            .at(MISSION, "*door")
            .found("`*door`")
            .expected("anchor")
            .hint("quotes"),
        instead("tag", "clearance_m: 0.05", "clearance_m: !metres 0.05")
            .at(MISSION, "!metres |0.05")
            .found("`!metres`")
            .nothing_expected()
            .hint("remove it"),
        added("two_documents", "---\nrobot: again\n")
            .at(MISSION, "robot: again")
            .found("more than one YAML document")
            .expected("one document")
            .hint("remove the `---` line"),
        added(
            "too_deep",
            "path: [[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[1]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]]\n",
        )
        .at(MISSION, "path: [[[[[[[[[[[[[[[[[[[[[[[[[[[[[[[|[[[[[[[[[[[1")
        .found("nested deeper")
        .expected("32 levels")
        .hint("brackets that are not closed"),
    ]
}

fn keys() -> Vec<Case> {
    vec![
        instead("key_near", "clearance_m", "clearence_m")
            .at(MISSION, "clearence_m")
            .found("`clearence_m`")
            .expected("`clearance_m`")
            .hint("did you mean `clearance_m`?"),
        added("key_no_guess", "colour: red\n")
            .at(MISSION, "colour")
            .found("`colour`")
            .expected("known keys are `robot`, `map`")
            .hint("`tolerance`"),
        added("key_of_another_table", "resolution_m: 0.05\n")
            .at(MISSION, "\n|resolution_m")
            .found("`resolution_m`")
            .expected("belongs under `map`")
            .hint("belongs under `map`"),
        added("key_given_already", "goals: {x_m: 1, y_m: 1}\n")
            .at(MISSION, "goals")
            .found("`goals`")
            .expected("`goal`")
            .hint("given already"),
        added("key_twice", "clearance_m: 0.1\n")
            .at(MISSION, "|clearance_m: 0.1")
            .found("`clearance_m` is given twice")
            .expected("keep one of the two")
            .hint("in line 9"),
        instead("key_missing_in_mission", ROBOT_LINE, "")
            .at(MISSION, "map:\n")
            .nothing_found(Why::Missing)
            .expected("needs `robot`")
            .hint("add `robot: "),
        instead("key_missing_in_table", "  file: ../maps/first.csv\n", "")
            .at(MISSION, "map:\n")
            .nothing_found(Why::Missing)
            .expected("`map` needs `file`")
            .hint("add `file: "),
        instead("no_goal", GOAL, "")
            .at(MISSION, "robot: ../")
            .nothing_found(Why::Missing)
            .expected("needs `goal`")
            .hint("add `goal: {"),
        instead("half_a_start", START, "start: {x_m: 0.6}")
            .at(MISSION, "start")
            .nothing_found(Why::Missing)
            .expected("needs `y_m` and `yaw`")
            .hint("`start: {x_m: 0.5, y_m: 0.5, yaw: 0deg}`"),
        instead("no_value", GOAL, "goal:")
            .at(MISSION, "goal:\n")
            .found("`goal` has no value")
            .expected("`goal: {x_m: 9.0")
            .hint("remove the key"),
        instead("decimal_comma", GOAL, "goal: {x_m: 3,4, y_m: 1.5}")
            .at(MISSION, "x_m: 3,|4,")
            .found("`4`")
            .expected("with a point")
            .hint("`x_m: 3.4`"),
        instead("no_space_in_braces", GOAL, "goal: {x_m:3.4, y_m: 1.5}")
            .at(MISSION, "{|x_m:3.4")
            .found("`x_m:3.4`")
            .expected("a space")
            .hint("`x_m: 3.4`"),
        added("number_key", "3: 4\n").at(MISSION, "\n|3: 4").found("`3`").expected("known keys").hint("`robot`"),
    ]
}

fn values() -> Vec<Case> {
    vec![
        instead("word_for_number", "clearance_m: 0.05", "clearance_m: small")
            .at(MISSION, "clearance_m: |small")
            .found("the text `small`")
            .expected("a number (m)")
            .hint("`clearance_m: 0.05`"),
        instead("unit_in_number", "clearance_m: 0.05", "clearance_m: 5cm")
            .at(MISSION, "5cm")
            .found("`5cm`")
            .expected("a number (m)")
            .hint("write metres: `0.05`"),
        instead("quoted_number", "clearance_m: 0.05", "clearance_m: \"0.05\"")
            .at(MISSION, "\"0.05\"")
            .found("the text `0.05`")
            .expected("a number")
            .hint("remove the quotes"),
        instead("percent", "clearance_m: 0.05", "clearance_m: 5%")
            .at(MISSION, "5%")
            .found("`5%`")
            .expected("a number (m)")
            .hint("no percent"),
        instead("nan", "x_m: 0.6", "x_m: .nan")
            .at(MISSION, ".nan")
            .found("`.nan`")
            .expected("a finite number")
            .hint("`x_m: 0.5`"),
        instead("infinite", "clearance_m: 0.05", "clearance_m: .inf")
            .at(MISSION, ".inf")
            .found("`.inf`")
            .expected("a finite number")
            .hint("certificate must prove"),
        instead("negative", "clearance_m: 0.05", "clearance_m: -0.05")
            .at(MISSION, "-0.05")
            .found("`-0.05`")
            .expected("at least 0 m")
            .hint("`clearance_m: 0.05`"),
        instead("zero", "resolution_m: 0.05", "resolution_m: 0")
            .at(MISSION, "resolution_m: |0\n")
            .found("`0`")
            .expected("greater than 0 m")
            .hint("cell size"),
        instead("too_long_a_time", "sampling_time_s: 0.1", "sampling_time_s: 100")
            .at(MISSION, "100")
            .found("`100`")
            .expected("between 0.0001 and 10 s")
            .hint("holds each command"),
        instead("millimetres", "x_m: 3.4", "x_m: 3400000")
            .at(MISSION, "3400000")
            .found("`3400000`")
            .expected("between -1000000 and 1000000 m")
            .hint("metres"),
        added("sampling_word", "sampling: traced\n")
            .at(MISSION, "traced")
            .found("`traced`")
            .expected("`tracked`, `mean` or `instant`")
            .hint("did you mean `tracked`?"),
        added("time_law_word", "time_law: quick\n")
            .at(MISSION, "quick")
            .found("`quick`")
            .expected("`optimal`")
            .hint("the fastest that keeps every limit"),
        added("yes", "reverse: yes\n")
            .at(MISSION, "yes")
            .found("`yes`")
            .expected("`true` or `false`")
            .hint("write `true`"),
        added("yes_of_a_number", "reverse: 1\n")
            .at(MISSION, "reverse: |1")
            .found("the number `1`")
            .expected("`true` or `false`")
            .hint("drive backwards"),
        instead("degree_sign", "1.5, yaw: 0deg}\ngoal", "1.5, yaw: 90°}\ngoal")
            .at(MISSION, "90°")
            .found("`90°`")
            .expected("degrees such as `90deg`")
            .hint("write `90deg`"),
        instead("pi", "1.5, yaw: 0deg}\ngoal", "1.5, yaw: pi/2}\ngoal")
            .at(MISSION, "pi/2")
            .found("`pi/2`")
            .expected("a number (rad)")
            .hint("nothing is computed"),
        instead("radians", "1.5, yaw: 0deg}\ngoal", "1.5, yaw: 1.57rad}\ngoal")
            .at(MISSION, "1.57rad")
            .found("`1.57rad`")
            .expected("a number (rad)")
            .hint("`1.57`"),
        added("degrees_of_a_rate", "limits: {base: {angular_speed_radps: 60deg}}\n")
            .at(MISSION, "60deg")
            .found("`60deg`")
            .expected("a number (rad/s)")
            .hint("`1.047198`"),
        instead("any_for_start", "1.5, yaw: 0deg}\ngoal", "1.5, yaw: any}\ngoal")
            .at(MISSION, "any")
            .found("`any`")
            .expected("a number (rad)")
            .hint("counter-clockwise"),
        instead("list_for_table", START, "start: [0.6, 1.5, 0]")
            .at(MISSION, "[0.6, 1.5, 0]")
            .found("a list of 3 values")
            .expected("`key: value` pairs (x_m, y_m, yaw")
            .hint("where the robot stands"),
        added("table_for_list", "via: {x_m: 2, y_m: 0.6}\n")
            .at(MISSION, "{x_m: 2,")
            .found("`key: value` pairs")
            .expected("a list of places")
            .hint("`via: [{x_m: 4.0, y_m: 4.0}]`"),
        instead("number_for_text", "../maps/first.csv", "7")
            .at(MISSION, "file: |7")
            .found("the number `7`")
            .expected("text")
            .hint("in quotes"),
        added("dwell", "via: [{x_m: 2, y_m: 0.6, dwell_s: -1}]\n")
            .at(MISSION, "-1")
            .found("`-1`")
            .expected("between 0 and 86400 s")
            .hint("how long to stand"),
        instead("within", GOAL, "goal: {x_m: 3.4, y_m: 1.5, within_m: 0}")
            .at(MISSION, "within_m: |0")
            .found("`0`")
            .expected("between 0.001 and 1000 m")
            .hint("anywhere so near"),
        added("eta", "limits: {base: {eta: 1.5}}\n")
            .at(MISSION, "eta: |1.5")
            .found("`1.5`")
            .expected("greater than 0 and at most 1")
            .hint("share of the wheels' speed"),
        added("jerk", "limits: {wheel: {jerk_mps3: -2}}\n")
            .at(MISSION, "-2}")
            .found("`-2`")
            .expected("greater than 0 m/s^3")
            .hint("greatest jerk of the rim"),
        added("no_sampling_times", "path_error: {sampling_times_s: []}\n")
            .at(MISSION, "[]")
            .found("no value")
            .expected("1 to 100 sampling times")
            .hint("`sampling_times_s: [0.01, 0.1]`"),
        added("two_numbers", "limits: {joints: {lift: {lower: 2, upper: 1}}}\n")
            .found("lower (2)")
            .at(MISSION, "lift: {lower: |2")
            .expected("below upper")
            .hint("swap"),
    ]
}

fn areas() -> Vec<Case> {
    let map = |name, line: &'static str| instead(name, "  resolution_m: 0.05\n", line);
    vec![
        map("height_crossed", "  resolution_m: 0.05\n  height_m: [1.0, 0.02]\n")
            .at(MISSION, "[1.0, 0.02]")
            .found("the floor (1 m)")
            .expected("below the ceiling (0.02 m)")
            .hint("`[0.02, 1.0]`"),
        map("height_of_one", "  height_m: [1.0]\n")
            .at(MISSION, "[1.0]")
            .found("1 value")
            .expected("2 numbers")
            .hint("`height_m: [0.02, 1.0]`"),
        map("unknown_word", "  unknown: ocupied\n")
            .at(MISSION, "ocupied")
            .found("`ocupied`")
            .expected("`occupied` or `free`")
            .hint("did you mean `occupied`?"),
        map("keep_out_two_corners", "  keep_out: [{polygon_m: [[0, 0], [1, 0]]}]\n")
            .at(MISSION, "[[0, 0], [1, 0]]")
            .found("2 values")
            .expected("3 to 1000 corners")
            .hint("`polygon_m: [["),
        map("keep_out_line", "  keep_out: [{polygon_m: [[0, 0], [1, 1], [2, 2]]}]\n")
            .at(MISSION, "{polygon_m")
            .found("no area")
            .expected("thinner than 1 mm")
            .hint("corners of an area in their order"),
        map("keep_out_height", "  keep_out: [{polygon_m: [[0, 0], [1, 0], [1, 1]], height_m: [1, 0]}]\n")
            .at(MISSION, "{polygon_m")
            .found("1 m is not")
            .expected("below 0 m")
            .hint("[from, to]"),
        map("keep_out_crossed", "  keep_out: [{polygon_m: [[0, 0], [1, 1], [1, 0], [0, 1]]}]\n")
            .at(MISSION, "polygon_m: |[[")
            .found("crosses itself")
            .expected("around the area")
            .hint("in their order"),
        map("zone_crossed", "  speed_zones: [{polygon_m: [[0, 0], [1, 1], [1, 0], [0, 1]], speed_mps: 0.3}]\n")
            .at(MISSION, "polygon_m: |[[")
            .found("crosses itself")
            .expected("around the area")
            .hint("two polygons"),
        map("zone_without_speed", "  speed_zones: [{polygon_m: [[0, 0], [1, 0], [1, 1]]}]\n")
            .at(MISSION, "{polygon_m")
            .nothing_found(Why::Missing)
            .expected("needs `speed_mps`")
            .hint("add `speed_mps: 0.3`"),
        map("zone_stands", "  speed_zones: [{polygon_m: [[0, 0], [1, 0], [1, 1]], speed_mps: 0}]\n")
            .at(MISSION, "speed_mps: |0")
            .found("`0`")
            .expected("between 0.001 and 1000 m/s")
            .hint("greatest speed while"),
        map("box_upside_down", "  boxes: [{min_m: [0, 0, 1], max_m: [1, 1, 0]}]\n")
            .at(MISSION, "{min_m")
            .found("from 1 to 0 m")
            .expected("least x, y and z")
            .hint("`max_m` the greatest"),
        map("corner_of_three", "  keep_out: [{polygon_m: [[0, 0], [1, 0, 3], [1, 1]]}]\n")
            .at(MISSION, "[1, 0, 3]")
            .found("3 values")
            .expected("a point [x, y]")
            .hint("`polygon_m"),
        map("origin_of_points", "  origin_m: [0, 0, 0]\n")
            .at(MISSION, "[0, 0, 0]")
            .found("`origin_m`")
            .expected("voxel grids (.npy, 3-D)")
            .hint("remove"),
    ]
}

fn tolerances() -> Vec<Case> {
    vec![
        added("tolerance_share", "tolerance: {track: 120%}\n")
            .at(MISSION, "120%")
            .found("`120%`")
            .expected("between 0 and")
            .hint("`track:"),
        added("tolerance_key", "tolerance: {trak: 1%}\n")
            .at(MISSION, "trak")
            .found("`trak`")
            .expected("`track`")
            .hint("did you mean `track`?"),
        added("tolerance_word", "tolerance: {track: little}\n")
            .at(MISSION, "little")
            .found("`little`")
            .expected("percent such as `0.2%`")
            .hint("`track: 1%`"),
    ]
}

fn contradictions() -> Vec<Case> {
    let own = |name, text: &'static str| case(name).write(MISSION, text);
    vec![
        own("nothing_to_plan", ROBOT_LINE).at(MISSION, "robot:").nothing_found(Why::Missing)
            .expected("either `map`, `start` and `goal`, or a given `path`").hint("`map: {file:"),
        own("two_paths", "robot: r.yaml\npath: {file: a.csv, bezier: [[[0, 0], [1, 0], [2, 0], [3, 0]]]}\n").at(MISSION, "path:")
            .found("both `bezier` and `file`").expected("one of the two").hint("keep one"),
        own("no_path", "robot: r.yaml\npath: {}\n").at(MISSION, "path:").found("neither").expected("`bezier` or `file`")
            .hint("`path: {file: path.csv}`"),
        own("path_of_three", "robot: r.yaml\npath: {bezier: [[[0, 0], [1, 0], [2, 0]]]}\n")
            .at(MISSION, "bezier: [|[[0").found("3 values").expected("4 control points").hint("`bezier: [[["),
        own("path_gap", "robot: r.yaml\npath:\n  bezier:\n    - [[0, 0], [1, 0], [2, 0], [3, 0]]\n    - [[3.1, 0], [4, 0], [5, 0], [6, 0]]\n")
            .at(MISSION, "[3.1, 0]").found("0.1 m away").expected("not [3, 0]").hint("repeats the last point"),
        own("path_point", "robot: r.yaml\npath: {bezier: [[[1, 1], [1, 1], [1, 1], [1, 1]]]}\n").at(MISSION, "bezier: [|[[1")
            .found("four equal points").expected("goes nowhere").hint("remove the segment"),
        own("via_and_path", "robot: r.yaml\nvia: [{x_m: 4.0, y_m: 4.0}]\npath: {file: a.csv}\n").at(MISSION, "via")
            .found("`via` and a given `path`").nothing_expected().hint("remove `via`"),
        instead("start_file_and_yaw", START, "start: {file: ../out/b/commands.csv, yaw: 0}").at(MISSION, "|yaw: 0}")
            .found("`start.yaw` and `start.file`").nothing_expected().hint("remove `yaw`, or `file`"),
        own("start_file_and_path", "robot: r.yaml\nstart: {file: c.csv}\npath: {file: a.csv}\n").at(MISSION, "start: {|file")
            .found("`start.file` and a given `path`").nothing_expected().hint("remove `start`"),
    ]
}
