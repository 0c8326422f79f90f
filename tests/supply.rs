//! What the crate is built from: figures of the README, and the oldest Rust that every crate below says it needs.

use std::collections::BTreeSet;
use std::process::Command;

use serde_json::Value;

/// What a program prints, run in the crate's folder.
fn run(program: &str, args: &[&str]) -> String {
    let output = Command::new(program).args(args).current_dir(env!("CARGO_MANIFEST_DIR")).output().expect(program);
    assert!(output.status.success(), "{program}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// The crates below this one that are built here with default features, along these kinds of dependencies.
fn below(kinds: &str) -> BTreeSet<String> {
    let tree = run(env!("CARGO"), &["tree", "--locked", "--offline", "--edges", kinds, "--prefix", "none"]);
    let crates = tree.lines().map(|line| line.trim_end_matches(" (*)").to_owned());
    crates.filter(|line| !line.is_empty() && !line.starts_with("trajc v")).collect()
}

/// (major, minor) of a version of Rust.
fn release(version: &str) -> (u32, u32) {
    let mut parts = version.split('.').map(|part| part.parse().expect("a number"));
    (parts.next().expect("a major version"), parts.next().unwrap_or(0))
}

#[test]
fn no_crate_needs_a_newer_rust_than_is_promised() {
    let version = run("rustc", &["-vV"]);
    let host = version.lines().find_map(|line| line.strip_prefix("host: ")).expect("rustc says what it builds for");
    let metadata = ["metadata", "--format-version=1", "--locked", "--offline", "--filter-platform", host];
    let metadata: Value = serde_json::from_str(&run(env!("CARGO"), &metadata)).expect("JSON");
    let promised = release(env!("CARGO_PKG_RUST_VERSION"));
    let packages = metadata["packages"].as_array().expect("packages");
    let told: Vec<_> =
        packages.iter().filter_map(|package| package["rust_version"].as_str().zip(package["name"].as_str())).collect();
    for (needed, name) in &told {
        assert!(release(needed) <= promised, "{name} needs Rust {needed}");
    }
    assert!(
        told.len() > packages.len() / 2,
        "only {} of {} crates say which Rust they need",
        told.len(),
        packages.len()
    );
}

#[test]
fn the_readme_counts_the_crates_that_are_built() {
    let (program, tests) = (below("normal,build").len(), below("normal,build,dev").len());
    let locked = include_str!("../Cargo.lock").lines().filter(|line| *line == "[[package]]").count() - 1;
    let said = format!("{program} crates, {tests} with its tests; {locked} with every feature and platform");
    assert!(include_str!("../README.md").contains(&said), "the README should say: {said}");
}
