//! `trajc play` as users run it: the real program, real sockets on the loopback, real signals. Receivers are here; no test asserts when
//! something arrives, since a busy machine may be late by any time.

#[path = "cli/sandbox.rs"]
#[allow(dead_code)]
mod sandbox;

#[path = "play/can.rs"]
mod can;
#[cfg(feature = "foxglove")]
#[path = "play/foxglove.rs"]
mod foxglove_client;
#[path = "play/refusals.rs"]
mod refusals;
#[cfg(feature = "ros2")]
#[path = "play/ros2.rs"]
mod ros2_node;
#[path = "play/stops.rs"]
mod stops;
#[path = "play/udp.rs"]
mod udp;

#[cfg(feature = "zenoh")]
#[path = "play/zenoh.rs"]
mod zenoh_router;

use std::process::{Child, Command, Stdio};

use sandbox::Sandbox;

/// `missions/first.yaml`, whose rows are held for so long that no machine is late by one.
fn compiled() -> Sandbox {
    let sandbox = Sandbox::new();
    sandbox.run(&["compile", "missions/a.yaml", "--sampling-time", "0.4"]).expect(0);
    sandbox
}

/// Starts the program in a sandbox.
fn start(sandbox: &Sandbox, args: &[&str]) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_trajc"));
    command.args(args).current_dir(sandbox.path(".")).stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().expect("the program starts")
}

/// Exit code, stdout and stderr.
fn end(child: Child) -> (i32, String, String) {
    let output = child.wait_with_output().expect("it ends");
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).expect("text");
    (output.status.code().expect("no signal"), text(output.stdout), text(output.stderr))
}

/// Sends a signal by its name.
#[cfg(unix)]
fn signal(child: &Child, name: &str) {
    let kill = Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status();
    assert!(kill.is_ok_and(|status| status.success()), "kill -{name}");
}

/// Speed and turn rate of each row of the command file, one after the other where they differ: rows held for long are sent again.
#[cfg(any(feature = "foxglove", feature = "ros2", feature = "zenoh"))]
fn twists(sandbox: &Sandbox) -> Vec<[f64; 2]> {
    let text = sandbox.text("out/a/commands.csv");
    let rows = text.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit()));
    let cell = |line: &str, column: usize| line.split(',').nth(column).and_then(|c| c.parse().ok()).expect("a number");
    let mut twists: Vec<[f64; 2]> = rows.map(|line| [cell(line, 3), cell(line, 4)]).collect();
    twists.dedup();
    twists
}

/// Speed and turn rate of a TwistStamped in CDR.
#[cfg(any(feature = "foxglove", feature = "zenoh"))]
fn twist(cdr: &[u8]) -> [f64; 2] {
    let mut r = trajc::emit::cdr::Reader::new(cdr).expect("CDR");
    assert_eq!([r.i32().map(i64::from), r.u32().map(i64::from)], [Ok(0), Ok(0)], "stamp 0: now");
    r.string().expect("a frame");
    let values: Vec<f64> = (0..6).map(|_| r.f64().expect("a number")).collect();
    r.finish().expect("no more");
    assert_eq!(values[1..5], [0.0; 4]);
    [values[0], values[5]]
}
