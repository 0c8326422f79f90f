//! Shipped missions with feedback: bases with wrong wheels, tracks and latencies, seen by noisy poses, end where the file ends. And
//! `trajc play --to stdio` and `--feedback udp://…` as users run them.

#[path = "cli/sandbox.rs"]
#[allow(dead_code)]
mod sandbox;
#[path = "feedback/simulated.rs"]
#[allow(dead_code)]
mod simulated;

use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Command, Stdio};

use sandbox::Sandbox;
use simulated::{Base, Fault, Noise, Prepared, closed, disturbances, open, prepare};
use trajc::play::tracking::{Options, Phase};

/// A shipped mission, compiled by the program.
fn compiled(name: &str) -> (Sandbox, Prepared) {
    let sandbox = Sandbox::new();
    let mission = Path::new(env!("CARGO_MANIFEST_DIR")).join("missions").join(name).with_extension("yaml");
    let out = sandbox.path("out");
    let run = Command::new(env!("CARGO_BIN_EXE_trajc"))
        .args(["compile", "--format", "csv", "--out"])
        .arg(&out)
        .arg(&mission)
        .output()
        .expect("the program runs");
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    let prepared = prepare(&out.join(name).join("commands.csv"));
    (sandbox, prepared)
}

fn ends_where_the_file_ends(name: &str) {
    let (_sandbox, prepared) = compiled(name);
    for (disturbance, fault) in disturbances() {
        for seed in [1, 2] {
            let run = closed(&prepared, fault, Options::default(), 0.05, seed);
            assert_eq!(run.phase, Phase::Done, "{name}, {disturbance}");
            let (metres, radians) = run.end;
            assert!(
                metres <= 0.010 && radians <= 1f64.to_radians(),
                "{name}, {disturbance}: {metres} m, {radians} rad"
            );
            assert!(run.filled < 1.0, "{name}, {disturbance}: the tube is left, {}", run.filled);
        }
    }
    // The test means something: without feedback the same robots miss by more.
    let worst = disturbances().iter().map(|(_, fault)| open(&prepared, *fault).end.0).fold(0.0, f64::max);
    assert!(worst > 0.02, "{worst}");
}

#[test]
fn around_a_post() {
    ends_where_the_file_ends("first");
}

#[test]
fn a_curve_at_the_limits_of_jerk_and_acceleration() {
    ends_where_the_file_ends("c_curve");
}

#[test]
fn between_columns_with_a_small_robot() {
    ends_where_the_file_ends("turtlebot3_burger");
}

#[test]
fn a_fast_base_over_thirty_metres() {
    ends_where_the_file_ends("tracer");
}

/// A base behind a running `trajc play --to stdio`: its answers, and how far from the end it is.
fn over_stdio(
    sandbox: &Sandbox,
    fault: Fault,
    spoil: impl Fn(usize, String) -> String,
) -> (Vec<serde_json::Value>, f64, i32) {
    let path = sandbox.path("out/a/commands.csv");
    let prepared = prepare(&path);
    let mut child = Command::new(env!("CARGO_BIN_EXE_trajc"))
        .args(["play", "out/a/commands.csv", "--to", "stdio"])
        .current_dir(sandbox.path("."))
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let (mut input, output) = (child.stdin.take().expect("piped"), child.stdout.take().expect("piped"));
    let (mut lines, mut base, mut noise) =
        (BufReader::new(output).lines(), Base::new(&prepared.motion, fault), Noise::new(1));
    let mut answers: Vec<serde_json::Value> = Vec::new();
    for k in 0..2000 {
        let time = 0.05 * k as f64;
        base.drive(time);
        let pose = base.measured(&mut noise);
        let line = serde_json::json!({"t": time, "x": pose.x, "y": pose.y, "yaw": pose.yaw}).to_string();
        if writeln!(input, "{}", spoil(k, line)).is_err() {
            break;
        }
        let answer: serde_json::Value =
            serde_json::from_str(&lines.next().expect("an answer").expect("text")).expect("JSON");
        let wheel = |side: &str| answer[format!("wheel_{side}_rad_s")].as_f64().expect("a number");
        base.command([wheel("left"), wheel("right")]);
        let over = ["done", "stopped"].contains(&answer["state"].as_str().expect("a state"));
        answers.push(answer);
        if over {
            break;
        }
    }
    drop(input);
    let last = prepared.motion.pose(1e9);
    (answers, base.pose.distance(last), child.wait().expect("it ends").code().expect("no signal"))
}

#[test]
fn a_simulator_closes_the_loop_over_stdio() {
    let sandbox = Sandbox::new();
    sandbox.run(&["compile", "missions/a.yaml"]).expect(0);
    let fault = Fault { radii: [0.01, 0.012], latency: 0.1, noise: 0.005, turn_noise: 0.0087, ..Fault::default() };
    let (answers, off, code) = over_stdio(&sandbox, fault, |_, line| line);
    assert_eq!((answers.last().expect("answers")["state"].as_str(), code), (Some("done"), 0));
    assert!(off < 0.010, "{off}");
    // The same poses, the same answers.
    assert_eq!(over_stdio(&sandbox, fault, |_, line| line).0, answers);
}

#[test]
fn over_stdio_bad_poses_are_refused_and_missing_ones_stop_the_robot() {
    let sandbox = Sandbox::new();
    sandbox.run(&["compile", "missions/a.yaml"]).expect(0);
    let spoil = |k: usize, line: String| match k {
        40 => r#"{"t": 2.0, "x": null, "y": 0, "yaw": 0}"#.to_owned(),
        41 => "NaN".to_owned(),
        _ => line,
    };
    let (answers, off, code) = over_stdio(&sandbox, Fault::default(), spoil);
    assert!(
        answers[40]["refused"].is_string() && answers[41]["refused"].is_string() && answers[42]["refused"].is_null()
    );
    assert_eq!(answers[41]["wheel_left_rad_s"], answers[39]["wheel_left_rad_s"], "the last command goes on");
    assert!(code == 0 && off < 0.010, "{off}");
    // From the hundredth on every pose is spoilt until a second has passed.
    let gap = |k: usize, line: String| if (100..120).contains(&k) { "{}".to_owned() } else { line };
    let (answers, _, code) = over_stdio(&sandbox, Fault::default(), gap);
    assert_eq!((answers.last().expect("answers")["state"].as_str(), code), (Some("stopped"), 1));
    assert!(answers.last().expect("answers")["reason"].as_str().is_some_and(|why| why.contains("no pose")));
}

#[test]
fn nobody_who_sends_poses_means_that_nothing_moves() {
    let sandbox = Sandbox::new();
    sandbox.run(&["compile", "missions/a.yaml"]).expect(0);
    let args = ["play", "out/a/commands.csv", "--to", "stdout", "--feedback", "udp://127.0.0.1:0", "--wait", "0.3"];
    let run = sandbox.run(&args).expect(2);
    assert!(run.stderr.contains("no pose has come"), "{}", run.stderr);
}
