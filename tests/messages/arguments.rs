//! Mistakes on the command line.

use super::case::{Case, MISSION, Why, case};

fn run(name: &'static str, args: &[&'static str]) -> Case {
    case(name).run(args).in_arguments()
}

pub fn cases() -> Vec<Case> {
    vec![
        run("subcommand", &["compil", MISSION]).found("'compil'").expected("similar subcommands").hint("'compile'"),
        run("option", &["compile", MISSION, "--sampling-tim", "0.1"])
            .found("'--sampling-tim'")
            .expected("similar argument")
            .hint("'--sampling-time'"),
        run("no_mission", &["compile"])
            .found("not provided")
            .expected("<MISSION.yaml>")
            .hint("trajc compile <MISSION.yaml>"),
        run("two_missions", &["compile", MISSION, "missions/b.yaml"])
            .found("'missions/b.yaml'")
            .expected("<MISSION.yaml>")
            .hint("Usage: trajc compile"),
        run("sampling_unit", &["compile", MISSION, "--sampling-time", "0.1s"])
            .found("'0.1s'")
            .expected("seconds between 0.0001 and 10")
            .hint("0.1"),
        run("sampling_word", &["path-error", MISSION, "--sampling", "midpoint"])
            .found("'midpoint'")
            .expected("tracked, mean or instant")
            .hint("tracked"),
        run("format", &["compile", MISSION, "--format", "bag"])
            .found("'bag'")
            .expected("possible values")
            .hint("csv, mcap"),
        run("jobs", &["build", "--jobs", "0"]).found("'0'").expected("a whole number from 1 to 1024").hint("2"),
        run("memory", &["compile", MISSION, "--max-memory", "lots"])
            .found("'lots'")
            .expected("a size of at least 1 MiB")
            .hint("512MiB"),
        run("max_error", &["path-error", MISSION, "--max-error", "5cm"])
            .found("'5cm'")
            .expected("a length above zero")
            .hint("5mm"),
        run("schema", &["schema", "misson"])
            .found("'misson'")
            .expected("mission, robot, report, build")
            .hint("'mission'"),
        run("value_missing", &["compile", MISSION, "--sampling-time"])
            .found("'--sampling-time <S>'")
            .expected("a value is required")
            .hint("'--help'"),
        run("count", &["eval", "--suite", "table1", "--count", "ten"])
            .found("'ten'")
            .expected("a whole number from 1 to 10000000")
            .hint("2"),
        run("suite", &["eval", "--suite", "tabel1"]).found("'tabel1'").expected("possible values").hint("'table1'"),
        run("suite_and_scenes", &["eval", "--suite", "table1", "--scenes", "s.json"])
            .found("'--suite <SUITE>'")
            .expected("cannot be used with")
            .hint("Usage"),
        run("count_of_one", &["eval", "--suite", "fig5", "--count", "3"])
            .found("`--count`")
            .expected("one fixed scene")
            .hint("leave `--count`"),
        run("boxes_of_another", &["eval", "--suite", "table1", "--boxes", "3"])
            .found("`--boxes`")
            .expected("table3")
            .hint("leave `--boxes` out"),
        run("height", &["inspect", "maps/first.csv", "--height", "2,0.1"])
            .found("2,0.1")
            .expected("the lower first")
            .hint("--height 0.02,2"),
        run(
            "robot_init_exists",
            &["robot", "init", "robots/box_base/box_base.urdf", "--out", "robots/box_base/robot.yaml"],
        )
        .found("robots/box_base/robot.yaml")
        .expected("exists")
        .hint("--force"),
        run("build_nothing", &["build", "mission"])
            .found("`mission`")
            .expected("no such file or folder")
            .hint("did you mean `missions`?"),
        run("inspect_missing", &["inspect", "maps/first.cvs"])
            .in_file("maps/first.cvs", Why::WholeFile)
            .found("`maps/first.cvs`")
            .expected("no such file")
            .hint("did you mean `first.csv`?"),
        run("eval_robot_missing", &["eval", "--suite", "fig5", "--robot", "robots/box"])
            .in_file("robots/box", Why::WholeFile)
            .found("`robots/box`")
            .expected("no such file")
            .hint("did you mean `box_base`?"),
        run("out_below_a_file", &["compile", MISSION, "--out", "maps/first.csv/x"])
            .found("maps/first.csv")
            .expected("folder")
            .hint("--out DIR"),
        run("plot_nowhere", &["inspect", "maps/first.csv", "--plot", "none/a.svg"])
            .found("none/a.svg")
            .expected("folder")
            .hint("must exist"),
    ]
}
