//! Many missions in one build: neither memory nor open files grow with their number, and those that fail disturb no other.
//! `TRAJC_LOAD=2000` builds that many.

#[allow(dead_code, reason = "what the tests of the command line need")]
#[path = "cli/sandbox.rs"]
mod sandbox;

#[cfg(target_os = "linux")]
mod linux {
    use std::collections::BTreeMap;
    use std::fs::{self, File};
    use std::process::{Child, Command, Stdio};
    use std::time::Duration;

    use serde_json::Value;

    use super::sandbox::Sandbox;

    /// Missions where `TRAJC_LOAD` says nothing.
    const MISSIONS: usize = 60;
    /// Missions on one map.
    const ON_A_MAP: usize = 20;
    /// Files that two workers may have open, whatever the number of missions: each writes nine at once, beside what it reads and the
    /// build's own, 25 at most. What the tests' runner hands down comes on top.
    const OPEN_FILES: usize = 40;
    /// How often the build is watched anew where a busy machine left no time to look.
    const WATCHES: usize = 5;

    /// How a mission must end: of each twenty on a map one ends in the post, one is bad input, and one names a map that is not there.
    fn ends(index: usize) -> &'static str {
        if matches!(index % ON_A_MAP, 7 | 13 | 19) { "failed" } else { "certified" }
    }

    fn write(sandbox: &Sandbox, missions: usize) {
        let (text, map) = (sandbox.text("missions/a.yaml"), sandbox.text("maps/first.csv"));
        sandbox.remove("missions/a.yaml");
        for index in 0..missions {
            let (chart, kind) = (index / ON_A_MAP, index % ON_A_MAP);
            if kind == 0 {
                // Each its own, by a point in a corner.
                let corner = format!("0.01,0.01,{}\n", 0.05 + 1e-4 * chart as f64);
                sandbox.write(&format!("maps/m{chart}.csv"), map.trim_end().to_owned() + "\n" + &corner);
            }
            let goal =
                format!("goal: {{x_m: {}, y_m: {:.3}", if kind == 7 { "2.0" } else { "3.4" }, 1.5 + 0.02 * kind as f64);
            let text =
                text.replace("goal: {x_m: 3.4, y_m: 1.5", if kind == 7 { "goal: {x_m: 2.0, y_m: 1.5" } else { &goal });
            let text = text.replace("first.csv", &format!("m{chart}.csv"));
            let text = match kind {
                13 => text.replace("clearance_m", "clearence_m"),
                19 => text.replace(&format!("m{chart}.csv"), "nowhere.csv"),
                _ => text,
            };
            sandbox.write(&format!("missions/n{index:05}.yaml"), text);
        }
    }

    /// A process as it is now.
    #[derive(Debug, Clone, Copy)]
    struct Sample {
        /// Missions that have folders.
        done: usize,
        /// Most memory so far, KiB.
        peak: u64,
        /// Open files.
        files: usize,
    }

    fn sample(sandbox: &Sandbox, child: &Child) -> Option<Sample> {
        let files = fs::read_dir(format!("/proc/{}/fd", child.id())).ok()?.count();
        let status = fs::read_to_string(format!("/proc/{}/status", child.id())).ok()?;
        let peak =
            status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.split_whitespace().next()?.parse().ok())?;
        let names = fs::read_dir(sandbox.path("out")).into_iter().flatten().flatten();
        let done = names.filter(|entry| !entry.file_name().to_string_lossy().starts_with('.')).count();
        Some(Sample { done, peak, files })
    }

    /// Builds all missions from nothing, with no more open files than are allowed: one too many and a mission would fail.
    fn watch(sandbox: &Sandbox) -> Vec<Sample> {
        let _ = fs::remove_dir_all(sandbox.path("out"));
        let open = |name: &str| File::create(sandbox.path(name)).expect("scratch");
        let limit = OPEN_FILES + fs::read_dir("/proc/self/fd").map_or(0, Iterator::count);
        let mut child = Command::new("sh")
            .args(["-c", &format!("ulimit -n {limit} && exec \"$@\""), "sh", env!("CARGO_BIN_EXE_trajc")])
            .args(["build", "-k", "-j", "2", "--json"])
            .current_dir(sandbox.path("."))
            .env("COLUMNS", "100")
            .stdout(open("stdout"))
            .stderr(open("stderr"))
            .stdin(Stdio::null())
            .spawn()
            .expect("the program starts");
        let mut samples = Vec::new();
        let status = loop {
            samples.extend(sample(sandbox, &child));
            if let Some(status) = child.try_wait().expect("a child") {
                break status;
            }
            std::thread::sleep(Duration::from_millis(5));
        };
        assert_eq!(status.code(), Some(2), "{}", sandbox.text("stderr"));
        samples
    }

    #[test]
    fn neither_memory_nor_open_files_grow_with_the_number_of_missions_and_failures_disturb_nobody() {
        let missions = std::env::var("TRAJC_LOAD").map_or(MISSIONS, |text| text.parse().expect("TRAJC_LOAD: a number"));
        let sandbox = Sandbox::new();
        write(&sandbox, missions);
        // As at mission 100 of 2000; of fewer, once every kind has been seen.
        let early = if missions < 300 { ON_A_MAP } else { 100 };
        let watched = (0..WATCHES).find_map(|_| {
            let samples = watch(&sandbox);
            let first = samples.iter().copied().find(|sample| sample.done >= early)?;
            let last = *samples.last()?;
            eprintln!("{missions} missions: at {} {first:?}, at the end {last:?}", first.done);
            eprintln!("most open files: {:?}", samples.iter().map(|sample| sample.files).max());
            (first.done < 2 * early && last.done > missions * 3 / 4).then_some((first, last))
        });
        let (first, last) = watched.expect("a machine that leaves time to look");
        assert!(10 * last.peak <= 11 * first.peak, "memory grows: {first:?}, then {last:?}");

        let document: Value = serde_json::from_str(&sandbox.text("stdout")).expect("JSON");
        let rows = document["missions"].as_array().expect("missions");
        assert_eq!(rows.len(), missions);
        for (index, row) in rows.iter().enumerate() {
            assert_eq!(row["mission"], format!("n{index:05}"));
            assert_eq!(row["status"], ends(index), "{row:#}");
        }
        let failed = (0..missions).filter(|index| ends(*index) == "failed").count();
        assert_eq!(sandbox.text("stderr").matches(": FAILED\n").count(), failed);

        // Beside those that fail, and alone.
        let files = |folder: &str| -> BTreeMap<String, Vec<u8>> {
            let names = sandbox.list(folder).into_iter().filter(|name| name != "timings.json" && name != "build.json");
            names.map(|name| (name.clone(), sandbox.read(&format!("{folder}/{name}")))).collect()
        };
        for index in [0, 8, missions / 2 + 4, missions - 2].into_iter().filter(|index| ends(*index) == "certified") {
            let name = format!("n{index:05}");
            let beside = files(&format!("out/{name}"));
            sandbox.run(&["compile", &format!("missions/{name}.yaml")]).expect(0);
            assert!(files(&format!("out/{name}")) == beside, "{name} is not what it is alone");
        }
    }
}
