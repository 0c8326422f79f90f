//! Mistakes in a given path's file.

use super::case::{Case, MISSION, Why, case};

const WAY: &str = "missions/way.csv";

fn way(name: &'static str, rows: &'static str) -> Case {
    case(name).write(MISSION, "robot: ../robots/box_base/robot.yaml\npath: {file: way.csv}\n").write(WAY, rows)
}

pub fn cases() -> Vec<Case> {
    vec![
        case("missing").write(MISSION, "robot: ../robots/box_base/robot.yaml\npath: {file: wya.csv}\n").write(WAY, "x_m,y_m\n")
            .at(MISSION, "wya.csv").found("`missions/wya.csv`").expected("relative to").hint("did you mean `way.csv`?"),
        way("empty", "").in_file(WAY, Why::WholeFile).found("this one has 0").expected("two rows or more").hint("`x_m,y_m`"),
        way("column_unknown", "x_m,y\n0,0\n1,0\n").at(WAY, "x_m,|y").found("`y`").expected("`y_m`").hint("did you mean `y_m`?"),
        way("column_missing", "x_m\n0\n1\n").at(WAY, "x_m").found("x_m").expected("no column `y_m`").hint("the header is x_m, y_m"),
        way("column_twice", "x_m,y_m,x_m\n0,0,0\n1,0,0\n").at(WAY, "y_m,|x_m").found("`x_m`").expected("twice").hint("keep one"),
        way("joint_unknown", "x_m,y_m,joint.lift.pos_m\n0,0,0\n1,0,0\n").at(WAY, "joint.lift.pos_m").found("`joint.lift.pos_m`")
            .expected("known are x_m, y_m").hint("joint.NAME.pos_m"),
        way("word", "x_m,y_m\n0,0\n1,far\n").at(WAY, "far").found("`far`").expected("finite number").hint("metres"),
        way("ragged", "x_m,y_m\n0,0\n1,0,3\n").at(WAY, "1,0,3").found("3 cells").expected("the header has 2").hint("separated by commas"),
        way("far_away", "x_m,y_m\n0,0\n1,9e9\n").at(WAY, "9e9").found("9e9 m").expected("1000000 m").hint("metres are expected"),
        way("same_point", "x_m,y_m\n0,0\n1,0\n1,0\n").at(WAY, "1,0\n|1,0").found("the same point").expected("row before")
            .hint("leave one of the two rows out"),
        way("turns_back", "x_m,y_m\n0,0\n1,0\n2,0\n1,0\n0,0\n").at(WAY, "2,0").found("turns back").expected("no direction").hint("around a bend"),
        case("cusp").write(MISSION, "robot: ../robots/box_base/robot.yaml\npath: {bezier: [[[0, 0], [0, 0], [1, 0], [2, 0]]]}\n")
            .at(MISSION, "path").found("segment 1").expected("no direction").hint("control points apart"),
        case("start_contradicts")
            .write(MISSION, "robot: ../robots/box_base/robot.yaml\npath: {bezier: [[[0, 0], [2, 0], [4, 2], [4, 4]]]}\nstart: {x_m: 0.5, y_m: 0.0}\n")
            .at(MISSION, "start").found("`start` contradicts").expected("x 0.000000").hint("leave `start` out"),
        case("law_without_timing")
            .write(MISSION, "robot: ../robots/box_base/robot.yaml\npath: {bezier: [[[0, 0], [2, 0], [4, 2], [4, 4]]]}\ntime_law: minco\n")
            .at(MISSION, "minco").found("`minco`").expected("a given path has none").hint("auto, fixed_point or eq5"),
        case("printed_law_of_two").write(
                MISSION,
                "robot: ../robots/box_base/robot.yaml\npath: {bezier: [[[0, 0], [1, 0], [2, 0], [3, 0]], [[3, 0], [4, 0], [5, 0], [6, 0]]]}\ntime_law: printed\n",
            )
            .at(MISSION, "printed").found("`printed`").expected("one cubic Bezier segment").hint("use eq5"),
    ]
}
