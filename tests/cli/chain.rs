//! Missions that start where the motion of another one ends.

use super::sandbox::Sandbox;

/// `a` as shipped, and `b`, which goes on from there.
fn chain() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.edit(
        "missions/a.yaml",
        "goal: {x_m: 3.4, y_m: 1.5, yaw: 0deg}",
        "goal: {x_m: 3.4, y_m: 1.5, within_m: 0.2}",
    );
    let text = sandbox.text("missions/a.yaml");
    let start = "start: {x_m: 0.6, y_m: 1.5, yaw: 0deg}";
    assert!(text.contains(start));
    let text =
        text.replace(start, "start: {file: ../out/a/commands.csv}").replace("x_m: 3.4, y_m: 1.5", "x_m: 0.6, y_m: 0.6");
    sandbox.write("missions/b.yaml", text);
    sandbox
}

/// Cells of a row of commands by their columns.
fn row(sandbox: &Sandbox, file: &str, last: bool) -> Vec<(String, f64)> {
    let text = sandbox.text(file);
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header = lines.next().expect("a header");
    let row = if last { lines.next_back() } else { lines.next() }.expect("a row");
    let numbers = row.split(',').map(|cell| cell.parse().expect("a number"));
    header.split(',').map(str::to_owned).zip(numbers).collect()
}

#[test]
fn a_mission_goes_on_where_the_file_it_names_ends() {
    let sandbox = chain();
    let run = sandbox.run(&["compile", "missions/b.yaml"]).expect(2);
    assert!(run.stderr.contains("no such file: `out/a/commands.csv`"), "{}", run.stderr);
    assert!(run.stderr.contains(" --> missions/b.yaml:7:15\n"), "{}", run.stderr);
    sandbox.run(&["compile", "missions/a.yaml"]).expect(0);
    for file in ["commands.csv", "commands.mcap"] {
        sandbox.edit("missions/b.yaml", "../out/a/commands.csv", &format!("../out/a/{file}"));
        sandbox.run(&["compile", "missions/b.yaml"]).expect(0);
        for (end, begin) in
            row(&sandbox, "out/a/commands.csv", true).iter().zip(row(&sandbox, "out/b/commands.csv", false))
        {
            let stated = ["x_m", "y_m", "yaw_rad"].contains(&end.0.as_str());
            assert!(!stated || (end.1 - begin.1).abs() < 1e-5, "{end:?} {begin:?}");
        }
        assert!(sandbox.text("out/b/commands.d").contains(&format!(" out/a/{file}")));
        // It brings with it where it starts.
        for made in ["commands.csv", "commands.mcap"] {
            let run = sandbox.run(&["check", &format!("out/b/{made}")]).expect(0);
            assert!(run.stdout.contains("all checks hold"), "{}", run.stdout);
        }
        sandbox.edit("missions/b.yaml", &format!("../out/a/{file}"), "../out/a/commands.csv");
    }
    let run = sandbox.run(&["inspect", "missions/b.yaml"]).expect(0);
    assert!(run.stdout.contains("start from ../out/a/commands.csv"), "{}", run.stdout);
    sandbox.run(&["compile", "missions/a.yaml", "--format", "trajectory.json"]).expect(0);
    sandbox.edit("missions/b.yaml", "commands.csv", "trajectory.json");
    let run = sandbox.run(&["compile", "missions/b.yaml"]).expect(2);
    assert!(run.stderr.contains("does not say which robot it is for"), "{}", run.stderr);
}

#[test]
fn a_motion_goes_on_only_with_the_same_robot() {
    let sandbox = chain();
    sandbox.run(&["compile", "missions/a.yaml"]).expect(0);
    let refused = |why: &str| {
        let run = sandbox.run(&["compile", "missions/b.yaml"]).expect(2);
        assert!(run.stderr.contains(why) && run.stderr.contains(" --> missions/b.yaml:"), "{}", run.stderr);
    };
    sandbox.edit("missions/b.yaml", "robots/box_base/robot.yaml", "robots/conv/robot.yaml");
    refused("was made for the robot `robots/box_base/robot.yaml`, not for `robots/conv/robot.yaml`");
    // Alone, the file still knows the robot's joints and wheels.
    std::fs::create_dir(sandbox.path("elsewhere")).expect("a folder");
    std::fs::copy(sandbox.path("out/a/commands.csv"), sandbox.path("elsewhere/c.csv")).expect("copied");
    sandbox.edit("missions/b.yaml", "../out/a/commands.csv", "../elsewhere/c.csv");
    sandbox.edit("missions/b.yaml", "robots/conv/robot.yaml", "robots/scr_db/robot.yaml");
    refused("moves the joints [], the robot has [blade]");
    sandbox.edit("missions/b.yaml", "robots/scr_db/robot.yaml", "robots/box_base/robot.yaml");
    sandbox.run(&["compile", "missions/b.yaml"]).expect(0);
}
