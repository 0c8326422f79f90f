//! `trajc play` as users run it: the real program, real sockets on the loopback, real signals. Receivers are here; no test asserts when
//! something arrives, since a busy machine may be late by any time.

#[path = "cli/sandbox.rs"]
#[allow(dead_code)]
mod sandbox;

#[path = "play/can.rs"]
mod can;
#[path = "play/refusals.rs"]
mod refusals;
#[path = "play/stops.rs"]
mod stops;
#[path = "play/udp.rs"]
mod udp;

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
