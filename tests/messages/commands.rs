//! Mistakes in command files, seen by `check`, `play` and `inspect`.

use super::case::{Case, Why, case};
use super::sandbox::Sandbox;

const FILE: &str = "c.csv";

/// A small file of a robot that stands for two rows.
const GOOD: &str = "\
# format: trajc.commands/1
# mission: missions/a.yaml
# robot: robots/box_base/robot.yaml
# map: maps/first.csv
# sampling_time_s: 0.1
# sampling: tracked
# wheel_radius_m: 0.08
# track_width_m: 0.32
# inputs_blake3: 0000000000000000000000000000000000000000000000000000000000000000
time_s,wheel_left_rad_s,wheel_right_rad_s,v_mps,omega_rad_s,x_m,y_m,yaw_rad
0,0,0,0,0,0.6,1.5,0
0.1,0,0,0,0,0.6,1.5,0
";

fn commands(name: &'static str, from: &'static str, to: &'static str) -> Case {
    case(name).base(Sandbox::new).write(FILE, GOOD).edit(FILE, from, to).run(&["check", FILE])
}

pub fn cases() -> Vec<Case> {
    let mut all = heads();
    all.extend(rows());
    all.extend(others());
    all
}

fn heads() -> Vec<Case> {
    vec![
        case("empty").write(FILE, "").run(&["check", FILE]).at_the_top(FILE).found("it is empty").expected("command file")
            .hint("`trajc compile`"),
        commands("no_format", "# format: trajc.commands/1\n", "").at_the_top(FILE).nothing_found(Why::Missing)
            .expected("`# format: trajc.commands/1`").hint("`trajc compile`"),
        commands("format", "trajc.commands/1", "trajc.commands/2").at(FILE, "# format").found("`trajc.commands/2`")
            .expected("`trajc.commands/1`").hint("compile it again"),
        commands("head_key", "# mission:", "# mision:").at(FILE, "# mision").found("`mision`").expected("`mission`")
            .hint("did you mean `mission`?"),
        commands("head_line", "# sampling: tracked", "# sampling tracked").at(FILE, "# sampling tracked").found("`# sampling tracked`")
            .expected("`# key: value`").hint("a colon"),
        commands("head_twice", "# map: ", "# robot: ").at(FILE, "yaml\n|# robot: maps").found("`robot` is given twice").expected("twice")
            .hint("keep one"),
        commands("head_missing", "# wheel_radius_m: 0.08\n", "").at(FILE, "# format").nothing_found(Why::Missing)
            .expected("`# wheel_radius_m: …`").hint("add it"),
        commands("head_number", "# track_width_m: 0.32", "# track_width_m: wide").at(FILE, "# track_width_m").found("`wide`")
            .expected("a number above 0").hint("metres"),
        commands("head_word", "# sampling: tracked", "# sampling: traced").at(FILE, "# sampling: traced").found("`traced`")
            .expected("mean, instant, tracked").hint("did you mean `tracked`?"),
        commands("no_header", "\ntime_s,wheel_left_rad_s,wheel_right_rad_s,v_mps,omega_rad_s,x_m,y_m,yaw_rad\n0,0,0,0,0,0.6,1.5,0\n0.1,0,0,0,0,0.6,1.5,0", "")
            .at(FILE, "0000\n|").found("ends before").expected("column names").hint("time_s,wheel_left_rad_s"),
    ]
}

fn rows() -> Vec<Case> {
    vec![
        commands("column_near", "omega_rad_s", "omega")
            .at(FILE, "omega")
            .found("`omega`")
            .expected("`omega_rad_s`")
            .hint("did you mean `omega_rad_s`?"),
        commands("column_missing", "wheel_left_rad_s,", "")
            .at(FILE, "time_s,")
            .nothing_found(Why::Missing)
            .expected("`wheel_left_rad_s`")
            .hint("needed are time_s"),
        commands("column_twice", "v_mps,", "v_mps,v_mps,")
            .at(FILE, "v_mps,|v_mps")
            .found("`v_mps`")
            .expected("twice")
            .hint("remove one"),
        commands("joint_without_speed", "yaw_rad\n", "yaw_rad,joint.lift.pos_m\n")
            .at(FILE, "joint.lift.pos_m")
            .found("`joint.lift.pos_m`")
            .expected("`joint.lift.vel_mps`")
            .hint("position and speed"),
        commands("no_rows", "\n0,0,0,0,0,0.6,1.5,0\n0.1,0,0,0,0,0.6,1.5,0\n", "\n")
            .at(FILE, "yaw_rad\n|")
            .nothing_found(Why::Missing)
            .expected("the file has no row")
            .hint("cut off"),
        commands("short_row", "0.1,0,0,0,0,0.6,1.5,0", "0.1,0,0")
            .at(FILE, "0.1,0,0\n")
            .found("3 cells")
            .expected("the header 8")
            .hint("one cell for each column"),
        commands("word", "0.1,0,0,0,0,0.6", "0.1,fast,0,0,0,0.6")
            .at(FILE, "fast")
            .found("`fast`")
            .expected("finite number")
            .hint("wheel_left_rad_s"),
        commands("nan", "0.1,0,0,0,0,0.6", "0.1,0,NaN,0,0,0.6")
            .at(FILE, "NaN")
            .found("`NaN`")
            .expected("finite number")
            .hint("wheel_right_rad_s"),
        commands("time_back", "\n0.1,", "\n0,")
            .at(FILE, "0\n|0,0,0,0,0,0.6,1.5,0\n")
            .found("0 s")
            .expected("increase")
            .hint("sampling_time_s"),
        commands("time_off", "\n0.1,", "\n0.15,")
            .at(FILE, "\n|0.15,")
            .found("0.15")
            .expected("0.1")
            .hint("sampling_time_s"),
    ]
}

fn others() -> Vec<Case> {
    vec![
        commands("check_missing", "0.6", "0.6")
            .run(&["check", "d.csv"])
            .in_file("d.csv", Why::WholeFile)
            .found("`d.csv`")
            .expected("no such file")
            .hint("did you mean `c.csv`?"),
        commands("mission_gone", "missions/a.yaml", "missions/b.yaml")
            .at(FILE, "# mission")
            .found("`missions/b.yaml`")
            .expected("not there")
            .hint("--mission MISSION.yaml"),
        case("mcap_garbage")
            .write("c.mcap", "not mcap")
            .run(&["check", "c.mcap"])
            .in_file("c.mcap", Why::Binary)
            .found("no MCAP file")
            .expected("`\\x89MCAP0")
            .hint("trajc compile"),
        case("mcap_cut")
            .base(Sandbox::compiled)
            .halve("out/a/commands.mcap")
            .run(&["check", "out/a/commands.mcap"])
            .in_file("out/a/commands.mcap", Why::Binary)
            .found("cut short")
            .expected("does not end")
            .hint("copy or compile it again"),
        case("mcap_damaged")
            .base(Sandbox::compiled)
            .with(|s| {
                let mut bytes = s.read("out/a/commands.mcap");
                let middle = bytes.len() / 2;
                bytes[middle] ^= 0xff;
                s.write("out/a/commands.mcap", bytes);
            })
            .run(&["inspect", "out/a/commands.mcap"])
            .in_file("out/a/commands.mcap", Why::Binary)
            .found("damaged")
            .expected("corruption")
            .hint("copy or compile it again"),
        commands("inspect_column", "yaw_rad", "yaw")
            .run(&["inspect", FILE])
            .at(FILE, "yaw\n")
            .found("`yaw`")
            .expected("`yaw_rad`")
            .hint("did you mean `yaw_rad`?"),
        commands("play_sink", "0.6", "0.6")
            .run(&["play", FILE, "--to", "stdot"])
            .in_arguments()
            .found("'stdot'")
            .expected("stdout")
            .hint("stdout"),
        commands("play_rate", "0.6", "0.6")
            .run(&["play", FILE, "--to", "stdout", "--rate", "2"])
            .in_arguments()
            .found("'2'")
            .expected("at most 1")
            .hint("0.5"),
    ]
}
