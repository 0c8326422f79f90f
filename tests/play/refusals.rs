//! What is not played, and what is said of it. Nothing is sent then.

use super::*;

#[test]
fn what_is_not_certified_needs_force() {
    let sandbox = compiled();
    // The first row's wheels stand still in the file; a jump there breaks acceleration.
    let text = sandbox.text("out/a/commands.csv");
    let head = text.lines().position(|l| !l.starts_with('#')).expect("columns");
    let mut lines: Vec<String> = text.lines().map(str::to_owned).collect();
    let mut cells: Vec<String> = lines[head + 6].split(',').map(str::to_owned).collect();
    for column in [1, 2] {
        cells[column] = (cells[column].parse::<f64>().expect("a number") + 3.0).to_string();
    }
    cells[3] = (cells[3].parse::<f64>().expect("a number") + 0.24).to_string();
    lines[head + 6] = cells.join(",");
    sandbox.write("out/a/commands.csv", lines.join("\n") + "\n");
    let run = sandbox.run(&["play", "out/a/commands.csv", "--to", "stdout"]).expect(1);
    assert_eq!(run.stdout, "");
    assert!(run.stderr.contains("not certified") && run.stderr.contains("--force"), "{}", run.stderr);
    let times: Vec<f64> =
        lines[head + 1..].iter().map(|l| l.split(',').next().unwrap_or("0").parse().expect("time")).collect();
    let start_at = times[times.len() - 3].to_string();
    let run =
        sandbox.run(&["play", "out/a/commands.csv", "--to", "stdout", "--force", "--start-at", &start_at]).expect(0);
    assert!(run.stderr.contains("played by --force"), "{}", run.stderr);
}

#[test]
fn wrong_usage_is_told_with_what_would_be_right() {
    let sandbox = compiled();
    let run = |args: &[&str]| {
        let run = sandbox.run(&[&["play", "out/a/commands.csv"], args].concat());
        assert_eq!((run.code, run.stdout.as_str()), (2, ""), "{args:?}: {}", run.stderr);
        run.stderr
    };
    assert!(run(&["--to", "ros"]).contains("udp://HOST:PORT"));
    assert!(run(&["--to", "stdout", "--rate", "2"]).contains("faster than planned"));
    assert!(run(&["--to", "stdout", "--rate", "0"]).contains("above 0"));
    assert!(run(&["--to", "stdout", "--start-at", "1000"]).contains("behind the end"));
    assert!(run(&["--to", "stdout", "--json"]).contains("stderr"));
    assert!(run(&["--to", "udp://nowhere.invalid:99"]).contains("udp://nowhere.invalid:99"));
}

#[cfg(not(any(feature = "can", feature = "foxglove", feature = "ros2", feature = "zenoh")))]
#[test]
fn a_sink_that_was_not_built_in_names_the_command_that_does() {
    let sandbox = compiled();
    for (to, feature) in [("ros2", "ros2"), ("zenoh", "zenoh"), ("foxglove", "foxglove"), ("can:can0", "can")] {
        let run = sandbox.run(&["play", "out/a/commands.csv", "--to", to]).expect(2);
        assert!(run.stderr.contains(&format!("cargo install --path . --features {feature}")), "{}", run.stderr);
    }
}
