//! Datagrams, signals, and lines on stdout.

use std::net::UdpSocket;
use std::time::Duration;

use serde_json::Value;

use super::*;

/// A receiver on a port of its own.
fn receiver() -> (UdpSocket, String) {
    let socket = UdpSocket::bind("127.0.0.1:0").expect("a port");
    socket.set_read_timeout(Some(Duration::from_secs(60))).expect("a timeout");
    let to = format!("udp://{}", socket.local_addr().expect("an address"));
    (socket, to)
}

fn next(socket: &UdpSocket) -> Value {
    let mut bytes = [0; 4096];
    let length = socket.recv(&mut bytes).expect("a datagram");
    serde_json::from_slice(&bytes[..length]).expect("an object")
}

/// Whether no wheel turns.
fn at_rest(command: &Value) -> bool {
    ["wheel_left_rad_s", "wheel_right_rad_s", "v_mps", "omega_rad_s"].iter().all(|key| command[key] == 0.0)
}

/// Rows of the command file as objects with the columns as keys.
fn rows(sandbox: &Sandbox) -> Vec<Value> {
    let text = sandbox.text("out/a/commands.csv");
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let columns: Vec<&str> = lines.next().expect("columns").split(',').collect();
    let value = |cell: &str| Value::from(cell.parse::<f64>().expect("a number"));
    lines.map(|line| columns.iter().map(|c| (*c).to_owned()).zip(line.split(',').map(value)).collect()).collect()
}

#[test]
fn each_row_is_a_datagram_with_the_files_own_columns() {
    let sandbox = compiled();
    let (socket, to) = receiver();
    let rows = rows(&sandbox);
    let from = rows.len() / 4;
    let start_at = rows[from]["time_s"].to_string();
    let child = start(&sandbox, &["play", "out/a/commands.csv", "--to", &to, "--start-at", &start_at, "--json"]);
    let mut heard = vec![next(&socket)];
    while !at_rest(&heard[heard.len() - 1]) {
        heard.push(next(&socket));
    }
    let (code, stdout, _) = end(child);
    assert_eq!(code, 0);
    for (sequence, command) in heard.iter().enumerate() {
        assert_eq!(command["seq"], sequence);
    }
    // It sets off from rest on rows of its own, then joins the file.
    let own: Vec<&Value> = heard.iter().filter(|c| rows.iter().any(|row| same(row, c))).collect();
    assert!(own.len() >= 3, "{heard:#?}");
    let report: Value = serde_json::from_str(&stdout).expect("JSON");
    assert_eq!((&report["ending"], &report["rows"]["sent"]), (&"complete".into(), &heard.len().into()));
    assert!(report["jitter_ms"]["p99"].as_f64() >= report["jitter_ms"]["p50"].as_f64());
}

/// All of a row's columns, but for `seq`.
fn same(row: &Value, command: &Value) -> bool {
    row.as_object().expect("a row").iter().all(|(key, value)| command[key] == *value)
}

#[test]
fn slower_is_the_same_path_at_lower_speed() {
    let sandbox = compiled();
    let (socket, to) = receiver();
    let rows = rows(&sandbox);
    let child = start(&sandbox, &["play", "out/a/commands.csv", "--to", &to, "--rate", "0.5"]);
    for row in rows.iter().take(3) {
        let command = next(&socket);
        assert_eq!(command["time_s"], row["time_s"]);
        assert_eq!(command["x_m"], row["x_m"]);
        let half = |key: &str| 0.5 * row[key].as_f64().expect("a number");
        assert!((command["wheel_left_rad_s"].as_f64().expect("a number") - half("wheel_left_rad_s")).abs() < 1e-12);
        assert!((command["v_mps"].as_f64().expect("a number") - half("v_mps")).abs() < 1e-12);
    }
    drop(socket);
    // Nobody listens any more: it stops by itself.
    let (code, _, stderr) = end(child);
    assert_eq!(code, 1, "{stderr}");
    assert!(stderr.contains("stopped on the planned path") && stderr.contains("nobody takes commands"), "{stderr}");
}

#[cfg(unix)]
#[test]
fn a_signal_ends_in_a_stop_on_the_path_within_the_files_own_steps() {
    for name in ["INT", "TERM"] {
        let sandbox = compiled();
        let (socket, to) = receiver();
        let child = start(&sandbox, &["play", "out/a/commands.csv", "--to", &to]);
        let mut heard = vec![next(&socket)];
        while heard.len() < 5 {
            heard.push(next(&socket));
        }
        signal(&child, name);
        while !at_rest(&heard[heard.len() - 1]) {
            heard.push(next(&socket));
        }
        let (code, _, stderr) = end(child);
        assert_eq!(code, 1);
        assert!(stderr.contains("stopped on the planned path") && stderr.contains("asked to stop"), "{stderr}");
        let rows = rows(&sandbox);
        assert!(heard.len() < rows.len() - 5, "{} of {}", heard.len(), rows.len());
        for key in ["wheel_left_rad_s", "wheel_right_rad_s"] {
            let speeds = |list: &[Value]| list.iter().map(|c| c[key].as_f64().expect("a number")).collect::<Vec<_>>();
            let largest = |speeds: &[f64]| speeds.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
            // 0.5 m/s^2 at a wheel of 0.08 m is what the robot allows in a row.
            assert!(largest(&speeds(&heard)) <= 0.5 * 0.4 / 0.08 + 1e-9);
        }
    }
}

#[cfg(unix)]
#[test]
fn a_second_signal_is_zero_at_once() {
    let sandbox = compiled();
    let (socket, to) = receiver();
    let child = start(&sandbox, &["play", "out/a/commands.csv", "--to", &to]);
    let mut heard: Vec<Value> = (0..6).map(|_| next(&socket)).collect();
    signal(&child, "INT");
    heard.push(next(&socket));
    signal(&child, "INT");
    while !at_rest(&heard[heard.len() - 1]) {
        heard.push(next(&socket));
    }
    let (code, _, stderr) = end(child);
    assert_eq!(code, 1);
    assert!(stderr.contains("zero at once: asked to stop"), "{stderr}");
    assert!(heard.len() <= 9, "{heard:#?}");
}

#[test]
fn lines_on_stdout_are_the_files_rows() {
    let sandbox = compiled();
    let rows = rows(&sandbox);
    let last = rows[rows.len() - 1]["time_s"].as_f64().expect("a number");
    let start_at = (last - 1.2).to_string();
    let run = sandbox.run(&["play", "out/a/commands.mcap", "--to", "stdout", "--start-at", &start_at]).expect(0);
    let lines: Vec<&str> = run.stdout.lines().collect();
    assert!(lines[0].starts_with("time_s,wheel_left_rad_s,wheel_right_rad_s,v_mps,omega_rad_s,"), "{}", lines[0]);
    let file = sandbox.text("out/a/commands.csv");
    assert_eq!(
        lines.last().copied().map(|l| l.split(',').take(5).collect::<Vec<_>>()),
        file.lines().last().map(|l| l.split(',').take(5).collect())
    );
    assert!(run.stderr.contains("played to the end") && run.stderr.contains("p99"), "{}", run.stderr);
    let run =
        sandbox.run(&["play", "out/a/commands.csv", "--to", "stdout", "--format", "json", "--start-at", &start_at]);
    let objects: Vec<Value> = run.expect(0).stdout.lines().map(|l| serde_json::from_str(l).expect("JSON")).collect();
    assert_eq!(objects[0]["seq"], 0);
    assert!(at_rest(&objects[objects.len() - 1]));
}
