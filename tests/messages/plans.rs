//! Missions that are well written and cannot be: of places in obstacles, joints out of range, chains that do not close.

use super::case::{Case, MISSION, Why, case};

const START: &str = "x_m: 0.6, y_m: 1.5, yaw: 0deg";
const GOAL: &str = "x_m: 3.4, y_m: 1.5, yaw: 0deg";

fn start(name: &'static str, to: &'static str) -> Case {
    case(name).edit(MISSION, START, to)
}

fn goal(name: &'static str, to: &'static str) -> Case {
    case(name).edit(MISSION, GOAL, to)
}

fn blades(name: &'static str, to: &'static str) -> Case {
    case(name).edit(MISSION, "box_base", "scr_db").edit(MISSION, START, to)
}

pub fn cases() -> Vec<Case> {
    vec![
        case("robot_missing").edit(MISSION, "box_base/robot", "bos_base/robot").at(MISSION, "../robots/bos_base")
            .found("`robots/bos_base/robot.yaml`").expected("no folder `robots/bos_base`").hint("did you mean `box_base`?"),
        start("start_outside", "x_m: -6, y_m: 1.5, yaw: 0deg").exit(1).at(MISSION, "start").found("(-6.000, 1.500)")
            .expected("x 0.000 to 4.000").hint("metres"),
        goal("goal_outside", "x_m: 34, y_m: 1.5, yaw: 0deg").exit(1).at(MISSION, "goal").found("the goal (34.000")
            .expected("x 0.000 to 4.000").hint("metres"),
        start("start_in_obstacle", "x_m: 1.95, y_m: 1.4, yaw: 0deg").exit(1).at(MISSION, "start").found("the start is in collision")
            .expected("25.0 cm are missing").hint("x_m: 1.95, y_m: 1.15"),
        start("start_too_close", "x_m: 1.67, y_m: 1.5, yaw: 0deg").exit(1).at(MISSION, "start").found("has 0.030 m")
            .expected("0.05 m are asked for").hint("nearest free pose"),
        goal("goal_in_obstacle", "x_m: 1.95, y_m: 1.5, yaw: 0deg").exit(1).at(MISSION, "goal").found("the goal is in collision")
            .expected("30.0 cm are missing").hint("x_m: 1.65"),
        goal("goal_at_the_edge", "x_m: 3.9, y_m: 1.5, yaw: 0deg").exit(1).at(MISSION, "goal").found("the map's edge")
            .expected("are missing").hint("x_m: 3.70"),
        case("via_in_obstacle").append(MISSION, "via: [{x_m: 2.0, y_m: 0.6}, {x_m: 1.95, y_m: 1.5}]\n").exit(1)
            .at(MISSION, "{x_m: 1.95").found("from `via[0]` to `via[1]`").expected("are missing").hint("nearest free pose"),
        case("walled_off").with(|s| {
                let wall: String = (0..60).map(|i| format!("2.025,{},0.1\n", 0.05 * f64::from(i) + 0.025)).collect();
                s.write("maps/first.csv", s.text("maps/first.csv") + &wall);
            })
            .exit(1).at(MISSION, "goal").found("closed off").expected("no way").hint("look at the map"),
        // A beam that the base passes under, and the arm does not.
        case("no_posture").edit(MISSION, "box_base", "arm4").edit(MISSION, START, "x_m: 0.6, y_m: 1.5, yaw: 0").with(|s| {
                let beam: String = (0..60).map(|i| format!("2.025,{},0.325\n", 0.05 * f64::from(i) + 0.025)).collect();
                s.write("maps/first.csv", "x_m,y_m,z_m\n0.025,0.025,0\n3.975,2.975,0.925\n".to_owned() + &beam);
            })
            .exit(1).at(MISSION, "goal").found("does not prove that there is none").expected("are missing").hint("free the goal's joints"),
        blades("joint_near", "x_m: 0.6, y_m: 1.5, yaw: 0, joints: {blad: 0.0}").at(MISSION, "blad:").found("`blad`")
            .expected("moving joint of `scr_db`").hint("did you mean `blade`?"),
        blades("joint_range", "x_m: 0.6, y_m: 1.5, yaw: 0, joints: {blade: 270deg}").at(MISSION, "|blade: 270deg").found("4.712")
            .expected("0 to 3.141").hint("`0deg` to `180deg`"),
        start("joint_of_a_rigid_robot", "x_m: 0.6, y_m: 1.5, yaw: 0, joints: {blade: 0}").at(MISSION, "{|blade").found("`blade`")
            .expected("moving joint of `box_base`").hint("no moving joint"),
        blades("joint_limits_unknown", "x_m: 0.6, y_m: 1.5, yaw: 0}\nlimits: {joints: {blad: {speed: 1}}").at(MISSION, "blad:")
            .found("`blad`").expected("joint").hint("did you mean `blade`?"),
        blades("joint_limits_loosened", "x_m: 0.6, y_m: 1.5, yaw: 0}\nlimits: {joints: {blade: {upper: 400deg}}").at(MISSION, "|blade: {upper")
            .found("6.98").expected("0 to 3.141").hint("within the URDF's range"),
        goal("link_near", "link: {name: box_link, position_m: [3.4, 1.5, 0.2]}").at(MISSION, "|box_link").found("`box_link`")
            .expected("no link of `box_base`").hint("did you mean `base_link`?"),
        goal("link_out_of_reach", "link: {name: base_link, position_m: [3.4, 1.5, 1.2]}").exit(1).at(MISSION, "goal")
            .found("`base_link` cannot come to (3.400, 1.500, 1.200)").expected("m off").hint("change `position_m`"),
        goal("link_in_obstacle", "link: {name: base_link, position_m: [1.95, 1.5, 0]}").exit(1).at(MISSION, "goal")
            .found("the goal is in collision").expected("the base at (1.950, 1.500)").hint("nearest free pose"),
        goal("link_and_place", "x_m: 3.4, link: {name: base_link, position_m: [3.4, 1.5, 0]}").at(MISSION, "x_m: 3.4")
            .found("`goal.x_m`").expected("exclude each other").hint("remove `x_m`, or `link`"),
        goal("link_without_place", "link: {name: base_link}").at(MISSION, "link: {").found("`position_m`").expected("is missing")
            .hint("position_m: [3.0, 2.0, 0.8]"),
        case("start_file_missing").edit(MISSION, START, "file: ../out/b/commands.csv").at(MISSION, "../out/b").found("`out/b/commands.csv`")
            .expected("no folder `out`").hint("compile"),
        case("too_many_rows").append(MISSION, "via: [{x_m: 2.0, y_m: 0.6, dwell_s: 86400}, {x_m: 2.0, y_m: 0.6, dwell_s: 86400}, {x_m: 2.0, y_m: 0.6, dwell_s: 86400}]\n")
            .exit(1).at(MISSION, "via: [|{x_m").found("the motion lasts 2592").expected("too many").hint("a shorter `dwell_s`"),
        case("start_chain_closes").with(|s| {
                for (one, other) in [("a", "b"), ("b", "a")] {
                    let text = s.text(MISSION).replace("start: {x_m: 0.6, y_m: 1.5, yaw: 0deg}", "start: {file: NEXT}");
                    s.write(&format!("missions/{one}.yaml"), text.replace("NEXT", &format!("../out/{other}/commands.csv")));
                    if one == "a" {
                        let back = s.text(MISSION).replace("../out/b/commands.csv", "NEXT");
                        s.write(MISSION, back.replace("file: NEXT", "x_m: 0.6, y_m: 1.5, yaw: 0deg"));
                    }
                }
                s.edit(MISSION, START, "file: ../out/b/commands.csv");
            })
            .run(&["build"]).at(MISSION, "../out/b/commands.csv").found("`missions/a.yaml` starts where `missions/b.yaml` ends")
            .expected("starts by itself").hint("`start: {x_m: 0.5"),
        case("no_mission").write("none/readme.txt", "").run(&["build", "none"]).in_arguments().found("`none`").expected("no mission")
            .hint("a mission is a .yaml"),
        case("same_name").with(|s| s.write("more/a.yaml", s.text(MISSION))).run(&["build", "missions", "more"]).in_arguments()
            .found("`missions/a.yaml` and `more/a.yaml`").expected("one name").hint("rename one"),
        case("out_is_a_file").write("out", "").in_arguments().found("out").expected("folder").hint("--out DIR").append(MISSION, "\n")
            .run(&["compile", MISSION]),
        case("no_mission_here").edit(MISSION, "a", "a").run(&["compile", "missions/b.yaml"]).in_file("missions/b.yaml", Why::WholeFile).found("`missions/b.yaml`")
            .expected("no such file").hint("did you mean `a.yaml`?"),
        case("mission_is_a_folder").run(&["compile", "missions"]).in_file("missions", Why::WholeFile).found("is a folder")
            .expected("expected a file").hint("a.yaml"),
    ]
}
