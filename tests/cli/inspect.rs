//! `inspect` says what it understood of every kind of file.

use super::sandbox::{Sandbox, golden};

#[test]
fn every_kind_of_file_can_be_inspected() {
    let sandbox = Sandbox::compiled();
    for file in ["maps/depot.yaml", "maps/depot.pgm", "maps/levine_voxels.npy", "maps/levine_voxels.json"] {
        sandbox.ship(file);
    }
    sandbox.ship("maps/barn_29.pcd");
    for (name, file) in [
        ("urdf", "robots/conv/conv.urdf"),
        ("robot", "robots/scr_db/robot.yaml"),
        ("mission", "missions/a.yaml"),
        ("csv_points", "maps/first.csv"),
        ("pcd", "maps/barn_29.pcd"),
        ("map_server", "maps/depot.yaml"),
        ("npy", "maps/levine_voxels.npy"),
        ("commands_csv", "out/a/commands.csv"),
        ("commands_mcap", "out/a/commands.mcap"),
    ] {
        let run = sandbox.run(&["inspect", file]).expect(0);
        assert_eq!(run.stderr, "", "{file}");
        if name.starts_with("commands") {
            // The motion's figures are the planner's; not golden.
            assert!(run.stdout.contains("rows") && run.stdout.contains("../../missions/a.yaml"), "{}", run.stdout);
        } else {
            golden(&format!("inspect_{name}"), &run.stdout);
        }
    }
}

#[test]
fn the_slab_of_a_map_is_two_numbers() {
    let sandbox = Sandbox::new();
    let run = sandbox.run(&["inspect", "--height", "0.1,0.2", "maps/first.csv"]).expect(0);
    assert!(run.stdout.contains("obstacles z 0.100 to 0.200 m"), "{}", run.stdout);
    sandbox.run(&["inspect", "--height", "-0.1,0.2", "maps/first.csv"]).expect(0);
    for wrong in [["--height", "1"], ["--height", "1,0"], ["--height", "nan,1"], ["--height", "0,1,2"]] {
        let run = sandbox.run(&["inspect", wrong[0], wrong[1], "maps/first.csv"]).expect(2);
        assert!(run.stderr.contains("is no slab"), "{}", run.stderr);
    }
    sandbox.run(&["inspect", "--resolution", "nan", "maps/first.csv"]).expect(2);
}

#[test]
fn what_is_no_such_file_is_said_to_be_none() {
    let sandbox = Sandbox::new();
    sandbox.write("odd.bin", [0u8, 159, 146, 150]);
    sandbox.write("empty.yaml", "");
    for (name, file) in
        [("missing", "maps/none.pcd"), ("ending", "odd.bin"), ("folder", "maps"), ("empty", "empty.yaml")]
    {
        let run = sandbox.run(&["inspect", file]).expect(2);
        assert_eq!(run.stdout, "");
        golden(&format!("inspect_{name}"), &run.stderr);
    }
}
