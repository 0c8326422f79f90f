//! Mistakes in logs for `calibrate`.

use super::case::{Case, Why, case};

const LOG: &str = "log.csv";
const HEAD: &str = "time_s,wheel_left_rad,wheel_right_rad,x_m,y_m,yaw_rad\n";
const ROBOT: &str = "robots/box_base/robot.yaml";

fn log(name: &'static str, rows: &'static str) -> Case {
    case(name).with(move |s| s.write(LOG, HEAD.to_owned() + rows)).run(&["calibrate", LOG, "--robot", ROBOT])
}

pub fn cases() -> Vec<Case> {
    vec![
        log("column_near", "")
            .edit(LOG, "wheel_left_rad,", "wheel_left,")
            .at(LOG, "wheel_left,")
            .found("time_s, wheel_left, wheel_right_rad")
            .expected("`wheel_left_rad`")
            .hint("did you mean"),
        log("column_missing", "")
            .edit(LOG, ",yaw_rad", "")
            .at(LOG, "time_s")
            .found("time_s, wheel_left_rad")
            .expected("`yaw_rad`")
            .hint("time_s,wheel_left_rad,wheel_right_rad,x_m,y_m,yaw_rad"),
        log("word", "0,1,one,0,0,0\n").at(LOG, "one").found("`one`").expected("finite number").hint("wheel_right_rad"),
        log("time", "0.1,1,1,0,0,0\n0.1,1,1,0,0,0\n")
            .at(LOG, "0,0,0\n|0.1")
            .found("0.1")
            .expected("increase")
            .hint("sort"),
        log("no_time", ",1,1,0,0,0\n").at(LOG, "\n|,1,1").found("no time").expected("`time_s`").hint("every row"),
        log("half_a_row", "0,1,,0,,0\n")
            .at(LOG, "0,1,,")
            .found("neither both wheel angles")
            .expected("nor x, y and yaw")
            .hint("wheel_right_rad"),
        log("ragged", "0,1,1,0,0,0\n0.1,1,1\n").at(LOG, "0.1,1,1").found("3 cells").expected("6").hint("empty"),
        log("short", "0,0,0,0,0,0\n0.1,1,1,0,0,0\n")
            .in_file(LOG, Why::WholeFile)
            .found("0 pairs")
            .expected("at least 12")
            .hint("half a minute"),
        log("of_a_urdf", "")
            .run(&["calibrate", LOG, "--robot", "robots/box_base/box_base.urdf"])
            .in_arguments()
            .found("is a URDF")
            .expected("robot.yaml")
            .hint("trajc robot init"),
        log("log_missing", "")
            .run(&["calibrate", "lgo.csv", "--robot", ROBOT])
            .in_file("lgo.csv", Why::WholeFile)
            .found("`lgo.csv`")
            .expected("no such file")
            .hint("did you mean `log.csv`?"),
        log("bag", "")
            .write("log.mcap", "x")
            .run(&["calibrate", "log.mcap", "--robot", ROBOT])
            .in_file("log.mcap", Why::Binary)
            .found("no MCAP file")
            .expected("MCAP0")
            .hint("ros2 bag"),
    ]
}
