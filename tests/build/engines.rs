//! GNU make, Ninja and Snakemake with the files in `examples/`: they compile what changed, and think the same of it as `build`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

use super::sandbox::{Sandbox, repository};
use super::{built, mission, to_do};

/// An engine: its program and arguments.
struct Engine {
    program: PathBuf,
    args: Vec<String>,
}

/// Where a program is, if it is anywhere.
fn installed(name: &str, variable: &str) -> Option<PathBuf> {
    if let Some(path) = std::env::var_os(variable) {
        return Some(path.into());
    }
    let paths = std::env::var_os("PATH")?;
    let found = std::env::split_paths(&paths).map(|folder| folder.join(name)).find(|path| path.is_file());
    if found.is_none() {
        eprintln!("SKIPPED: no {name} is installed, and {variable} names none: examples/ is not tried with it");
    }
    found
}

impl Engine {
    fn new(program: PathBuf, args: &[&str]) -> Self {
        Self { program, args: args.iter().map(|arg| (*arg).to_owned()).collect() }
    }

    /// Runs it where the sandbox is; the missions that it compiled.
    fn run(&self, sandbox: &Sandbox) -> Vec<String> {
        let before = folders(sandbox);
        let own = Path::new(env!("CARGO_BIN_EXE_trajc")).parent().expect("a folder").to_path_buf();
        let paths = std::env::var_os("PATH").unwrap_or_default();
        let paths = std::env::join_paths(std::iter::once(own).chain(std::env::split_paths(&paths))).expect("folders");
        let output = Command::new(&self.program)
            .args(&self.args)
            .current_dir(sandbox.path("."))
            .env("PATH", paths)
            // Snakemake keeps a cache there.
            .env("XDG_CACHE_HOME", sandbox.path("cache"))
            .output()
            .expect("the engine starts");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        assert!(output.status.success(), "{}\n{}", text(&output.stdout), text(&output.stderr));
        let after = folders(sandbox);
        after.iter().filter(|(name, stamp)| before.get(*name) != Some(*stamp)).map(|(name, _)| name.clone()).collect()
    }
}

/// When the commands of each mission were written.
fn folders(sandbox: &Sandbox) -> BTreeMap<String, std::time::SystemTime> {
    let date = |name: &String| {
        let found = std::fs::metadata(sandbox.path(&format!("out/{name}/commands.csv"))).ok()?;
        Some((name.clone(), found.modified().ok()?))
    };
    sandbox.list("out").iter().filter_map(date).collect()
}

/// Three missions: `a` and `b` on one map, `sheet` on an image; with what `build` makes of them in a folder beside.
fn missions() -> Sandbox {
    let sandbox = Sandbox::new();
    mission(&sandbox, "b", 1.0);
    for file in ["maps/tb3_sandbox.yaml", "maps/tb3_sandbox.pgm", "missions/turtlebot3_burger.yaml", "examples"] {
        sandbox.ship(file);
    }
    let from = sandbox.path("missions/turtlebot3_burger.yaml");
    std::fs::rename(from, sandbox.path("missions/sheet.yaml")).expect("rename");
    // A name that must be escaped.
    std::fs::rename(sandbox.path("maps/tb3_sandbox.yaml"), sandbox.path("maps/tb3 #1.yaml")).expect("rename");
    sandbox.edit("missions/sheet.yaml", "file: ../maps/tb3_sandbox.yaml", "file: \"../maps/tb3 #1.yaml\"");
    sandbox
}

/// The engine compiles what changed, and that is what `build -n` says.
fn compiles_what_changed(engine: &Engine) {
    let sandbox = missions();
    assert_eq!(engine.run(&sandbox), ["a", "b", "sheet"], "the first time all");
    assert_eq!(engine.run(&sandbox), [""; 0], "then none");
    let elsewhere = ["-k", "--out", "built"];
    built(&sandbox, &elsewhere, 0);
    let cases: [(&str, &[&str]); 6] = [
        ("missions/b.yaml", &["b"]),
        ("robots/box_base/robot.yaml", &["a", "b"]),
        ("robots/box_base/box_base.urdf", &["a", "b"]),
        ("maps/first.csv", &["a", "b"]),
        ("maps/tb3 #1.yaml", &["sheet"]),
        ("maps/tb3_sandbox.pgm", &["sheet"]),
    ];
    for (file, names) in cases {
        // What all of these formats allow at their end.
        sandbox.write(file, [sandbox.read(file).as_slice(), b"\n"].concat());
        let run = sandbox.run(&["build", "-n", "--json", "--out", "built"]).expect(0);
        let document: serde_json::Value = serde_json::from_str(&run.stdout).expect("JSON");
        assert_eq!(super::of_status(&document, "to_compile"), names, "{file}");
        assert_eq!(engine.run(&sandbox), names, "{file}");
        built(&sandbox, &elsewhere, 0);
    }
    sandbox.remove("out/a/commands.csv");
    assert_eq!(engine.run(&sandbox), ["a"], "commands are missing");
    assert_eq!(to_do(&sandbox).len(), 3, "the engines' folders are not of `build`");
}

#[test]
fn make_compiles_what_changed() {
    let Some(make) = installed("make", "MAKE_PROGRAM") else { return };
    compiles_what_changed(&Engine::new(make, &["-f", "examples/make/Makefile", "-j2"]));
}

#[test]
fn ninja_compiles_what_changed() {
    let Some(ninja) = installed("ninja", "NINJA") else { return };
    let script = "sh examples/ninja/generate.sh > build.ninja && exec \"$0\" -j2";
    let shell = Engine::new("/bin/sh".into(), &["-c", script, &ninja.display().to_string()]);
    compiles_what_changed(&shell);
}

#[test]
fn snakemake_compiles_what_changed() {
    let Some(snakemake) = installed("snakemake", "SNAKEMAKE") else { return };
    let args = ["-s", "examples/snakemake/Snakefile", "--cores", "2", "-k", "--rerun-triggers", "mtime"];
    compiles_what_changed(&Engine::new(snakemake, &args));
}

#[test]
fn the_shipped_build_ninja_is_what_the_script_writes_of_its_missions() {
    let sandbox = Sandbox::empty();
    sandbox.ship("examples");
    let shipped = sandbox.text("examples/ninja/build.ninja");
    for line in shipped.lines().filter_map(|line| line.strip_prefix("  mission = ")) {
        assert!(repository().join(format!("missions/{line}.yaml")).is_file(), "{line}");
        sandbox.write(&format!("missions/{line}.yaml"), "");
    }
    let output =
        Command::new("sh").arg("examples/ninja/generate.sh").current_dir(sandbox.path(".")).output().expect("a shell");
    let generated = String::from_utf8(output.stdout).expect("text");
    let plain: String = shipped.lines().filter(|line| !line.starts_with('#')).map(|line| format!("{line}\n")).collect();
    assert_eq!(generated, plain);
}
