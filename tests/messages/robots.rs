//! Mistakes in a robot.yaml.

use super::case::{Case, ROBOT, Why, case};

const BLADES: &str = "robots/scr_db/robot.yaml";

fn added(name: &'static str, line: &'static str) -> Case {
    case(name).append(ROBOT, line)
}

fn drive(name: &'static str, from: &'static str, to: &'static str) -> Case {
    case(name).edit(ROBOT, from, to)
}

/// A mistake in the robot with a joint that moves.
fn blades(name: &'static str, from: &'static str, to: &'static str) -> Case {
    case(name).edit("missions/a.yaml", "box_base", "scr_db").edit(BLADES, from, to)
}

pub fn cases() -> Vec<Case> {
    let mut all = names();
    all.extend(values());
    all.extend(joints());
    all
}

fn names() -> Vec<Case> {
    vec![
        case("robot_empty")
            .write(ROBOT, "")
            .at_the_top(ROBOT)
            .nothing_found(Why::WholeFile)
            .expected("at least")
            .hint("`urdf: NAME.urdf`"),
        added("robot_key", "wheels: 2\n")
            .at(ROBOT, "wheels: 2")
            .found("`wheels`")
            .expected("known keys")
            .hint("`drive`"),
        drive("drive_key", "wheel_radius_m", "wheel_radius")
            .at(ROBOT, "wheel_radius:")
            .found("`wheel_radius`")
            .expected("`wheel_radius_m`")
            .hint("did you mean `wheel_radius_m`?"),
        drive("robot_urdf_key", "urdf: box_base.urdf", "")
            .at(ROBOT, "name: box_base")
            .nothing_found(Why::Missing)
            .expected("needs `urdf`")
            .hint("relative to this file"),
        drive("urdf_missing", "box_base.urdf", "box_bas.urdf")
            .at(ROBOT, "box_bas.urdf")
            .found("`robots/box_base/box_bas.urdf`")
            .expected("relative to the file")
            .hint("did you mean `box_base.urdf`?"),
        drive("urdf_is_a_folder", "box_base.urdf", "../box_base")
            .at(ROBOT, "../box_base")
            .found("is a folder")
            .expected("expected a file")
            .hint("`box_base.urdf`"),
        drive("one_wheel", "right: right_wheel_joint, ", "")
            .at(ROBOT, "left_wheel_joint")
            .found("a left wheel")
            .expected("right one")
            .hint("add `right: right_wheel_joint`"),
        drive("one_joint_twice", "right: right_wheel_joint", "right: left_wheel_joint")
            .at(ROBOT, "right: |left_wheel_joint")
            .found("`left_wheel_joint` is named twice")
            .expected("one side")
            .hint("one joint and one side"),
        drive("wheel_unknown_near", "left: left_wheel_joint", "left: left_wheel")
            .at(ROBOT, "left: |left_wheel,")
            .found("`left_wheel`")
            .expected("joint in robots/box_base/box_base.urdf")
            .hint("did you mean `left_wheel_joint`?"),
        drive("wheel_unknown_far", "left: left_wheel_joint", "left: axis_a")
            .at(ROBOT, "axis_a")
            .found("`axis_a`")
            .expected("`left_wheel_joint`, `right_wheel_joint`")
            .hint("its joints are"),
        added("link_unknown", "collision: {ignore_links: [base_lnik]}\n")
            .at(ROBOT, "base_lnik")
            .found("`base_lnik`")
            .expected("link in robots/box_base/box_base.urdf")
            .hint("did you mean `base_link`?"),
        added("pair_of_one", "collision: {ignore_pairs: [base_link]}\n")
            .at(ROBOT, "[|base_link]")
            .found("the text `base_link`")
            .expected("a pair of link names")
            .hint("`ignore_pairs: [[base_link, left_blade]]`"),
    ]
}

fn values() -> Vec<Case> {
    vec![
        drive("track_zero", "track_width_m: 0.32", "track_width_m: 0")
            .at(ROBOT, "track_width_m: |0}")
            .found("`0`")
            .expected("greater than 0 m")
            .hint("between the driving wheels"),
        drive("radius_in_millimetres", "wheel_radius_m: 0.08", "wheel_radius_m: 80mm")
            .at(ROBOT, "80mm")
            .found("`80mm`")
            .expected("a number (m)")
            .hint("`0.08`"),
        drive("radius_unknown", ", wheel_radius_m: 0.08", "")
            .at("robots/box_base/box_base.urdf", "joint |name=\"left_wheel_joint\"")
            .found("link `left_wheel` has no collision cylinder or sphere")
            .expected("radius")
            .hint("wheel_radius_m: 0.08}`"),
        added("limit_speed", "# limits\n")
            .edit(ROBOT, "speed_mps: 0.5", "speed_mps: fast")
            .at(ROBOT, "fast")
            .found("`fast`")
            .expected("a number (m/s)")
            .hint("greatest speed of the rim"),
    ]
}

fn joints() -> Vec<Case> {
    vec![
        blades("moving_unknown", "moving: [blade]", "moving: [blades]")
            .at(BLADES, "blades")
            .found("`blades`")
            .expected("joint in robots/scr_db/scr_db.urdf")
            .hint("did you mean `blade`?"),
        blades("moving_text", "moving: [blade]", "moving: blade")
            .at(BLADES, "moving: |blade")
            .found("the text `blade`")
            .expected("a list of joint names")
            .hint("`moving: [blade]`"),
        blades("moving_wheel", "moving: [blade]", "moving: [left_wheel_joint]")
            .at(BLADES, "[|left_wheel_joint]")
            .found("`left_wheel_joint` is a drive wheel")
            .expected("joints that can move")
            .hint("`blade`"),
        blades("moving_mimic", "moving: [blade]", "moving: [blade_right]")
            .at(BLADES, "blade_right")
            .found("mimic of `blade`")
            .expected("moves with it")
            .hint("`blade`"),
        blades("moving_number", "moving: [blade]", "moving: [1]")
            .at(BLADES, "[|1]")
            .found("the number `1`")
            .expected("text")
            .hint("`\"1\"`"),
        blades("moving_and_fixed", "moving: [blade]", "moving: [blade]\n  fixed: {blade: 0.1}")
            .at(BLADES, "fixed: {|blade")
            .found("`blade` is named twice")
            .expected("named once")
            .hint("either moves or is fixed"),
        blades("fixed_outside", "moving: [blade]", "fixed: {blade: 4}")
            .at(BLADES, "{|blade: 4")
            .found("at 4")
            .expected("0 to 3.141")
            .hint("degrees"),
        blades("fixed_list", "moving: [blade]", "fixed: [blade]")
            .at(BLADES, "fixed: |[")
            .found("a list of 1 value")
            .expected("`name: value` pairs")
            .hint("`fixed: {arm_lift: 0.10}`"),
        blades("fixed_wheel", "moving: [blade]", "fixed: {left_wheel_joint: 0}")
            .at(BLADES, "{|left_wheel_joint: 0")
            .found("`left_wheel_joint` is a drive wheel")
            .expected("joints")
            .hint("remove"),
        blades("limits_unknown", "    blade: {speed", "    blad: {speed")
            .at(BLADES, "blad: {speed")
            .found("`blad`")
            .expected("joint")
            .hint("did you mean `blade`?"),
        blades("limits_of_a_wheel", "    blade: {speed", "    left_wheel_joint: {speed")
            .at(BLADES, "|left_wheel_joint: {speed")
            .found("`left_wheel_joint` is a drive wheel")
            .expected("under `limits.wheel`")
            .hint("`limits: {wheel:"),
        blades("no_speed_of_a_joint", "speed: 1.0, ", "")
            .edit("robots/scr_db/scr_db.urdf", "effort=\"10\" velocity=\"1.0\"", "")
            .at("robots/scr_db/scr_db.urdf", "joint |name=\"blade\"")
            .found("`blade` has no velocity limit")
            .expected("rad/s")
            .hint("velocity=\""),
    ]
}
