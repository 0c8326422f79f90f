//! The stage order holds: a file names only modules above its own, so no stage knows what is made of its product.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Top to bottom, as in `src/lib.rs`. A module may name itself and those before it.
const ORDER: [&str; 23] = [
    "memory",
    "math",
    "geom",
    "diag", // for everyone
    "mission",
    "robot",
    "map",
    "esdf",
    "trajectory",
    "search",
    "optimize",
    "retime",
    "command",
    "certify",
    "report",
    "emit",
    "play",
    "calibrate", // stages
    "pipeline",
    "inputs",
    "eval",
    "cli",
    "main",
];

/// All that the proof may rest on. Above all not `esdf`, `search`, `optimize`, `retime`: a bug there must not certify itself.
const CERTIFY_RESTS_ON: [&str; 8] = ["memory", "math", "geom", "diag", "mission", "robot", "map", "command"];

/// One source file: its module at the top, its depth below the crate's root, and its code without comments.
struct File {
    path: PathBuf,
    module: String,
    depth: usize,
    code: String,
}

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

fn files() -> Vec<File> {
    let mut found = Vec::new();
    let mut folders = vec![source()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("src is there") {
            let path = entry.expect("src can be listed").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                found.push(File::read(&path));
            }
        }
    }
    found.sort_by(|a, b| a.path.cmp(&b.path));
    assert!(found.len() > 50, "{} files", found.len());
    found
}

impl File {
    fn read(path: &Path) -> Self {
        let text = std::fs::read_to_string(path).expect("source is text");
        let inside = path.strip_prefix(source()).expect("below src").with_extension("");
        let parts: Vec<String> = inside.iter().map(|p| p.to_string_lossy().into_owned()).collect();
        let depth = parts.len() - usize::from(parts.last().is_some_and(|p| p == "mod"));
        Self { path: path.to_path_buf(), module: parts[0].clone(), depth, code: without_comments(&text) }
    }

    /// Whether the whole file is compiled for tests only.
    fn is_test(&self) -> bool {
        self.path.iter().any(|p| ["tests", "tests.rs"].contains(&p.to_string_lossy().as_ref()))
            || self.path.to_string_lossy().ends_with("_tests.rs")
    }

    /// The code before its unit tests, which come last in a file.
    fn without_unit_tests(&self) -> &str {
        let end = self.code.match_indices("#[cfg(test)]\n").find(|(at, _)| {
            let line = self.code[at + "#[cfg(test)]\n".len()..].lines().next();
            line.is_some_and(|line| line.ends_with('{'))
        });
        end.map_or(self.code.as_str(), |(at, _)| &self.code[..at])
    }

    /// The crate's modules that the file names: after `crate::`, in `crate::{…}`, or through `super::` up to the root.
    fn names(&self) -> BTreeSet<String> {
        let mut found = BTreeSet::new();
        for (at, _) in self.code.match_indices("crate::") {
            if !self.code[..at].ends_with(word) {
                found.extend(heads(&self.code[at + "crate::".len()..]));
            }
        }
        for (at, _) in self.code.match_indices("super::") {
            if self.code[..at].ends_with("super::") || self.code[..at].ends_with(word) {
                continue; // within a chain, or the end of a longer word
            }
            let mut rest = &self.code[at..];
            let mut ups = 0;
            while let Some(next) = rest.strip_prefix("super::") {
                (rest, ups) = (next, ups + 1);
            }
            if ups >= self.depth {
                found.extend(heads(rest));
            }
        }
        found.into_iter().filter(|name| ORDER.contains(&name.as_str())).collect()
    }
}

fn word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// The code without line comments (`//` in a text is cut too, which hides nothing that matters here).
fn without_comments(text: &str) -> String {
    text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

/// First names of the paths at the beginning of `rest`: one, or those of a `{…}` group.
fn heads(rest: &str) -> Vec<String> {
    let name = |text: &str| text.trim_start().chars().take_while(|c| word(*c)).collect::<String>();
    let Some(group) = rest.strip_prefix('{') else { return vec![name(rest)] };
    let (mut out, mut depth) = (vec![name(group)], 0);
    for (at, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => out.push(name(&group[at + 1..])),
            _ => {}
        }
    }
    out
}

fn rank(module: &str) -> usize {
    ORDER.iter().position(|m| *m == module).unwrap_or_else(|| panic!("`{module}` has no place in the order"))
}

#[test]
fn names_are_found_in_groups_and_through_supers() {
    let file = |depth: usize, code: &str| File {
        path: PathBuf::new(),
        module: "map".into(),
        depth,
        code: without_comments(code),
    };
    let names = |depth, code: &str| file(depth, code).names().into_iter().collect::<Vec<_>>();
    assert_eq!(names(1, "use crate::geom::Pose2; // crate::cli"), ["geom"]);
    assert_eq!(names(1, "use crate::{esdf::{self, Esdf}, robot, report::Report};"), ["esdf", "report", "robot"]);
    assert_eq!(names(1, "use super::search;"), ["search"]);
    assert_eq!(names(2, "use super::search; use super::super::retime::x;"), ["retime"]);
    assert_eq!(names(1, "use my_crate::esdf;"), [""; 0]);
}

#[test]
fn every_module_of_the_crate_has_its_place() {
    let lib = std::fs::read_to_string(source().join("lib.rs")).expect("lib.rs");
    let declared: BTreeSet<&str> =
        lib.lines().filter_map(|l| l.strip_prefix("pub mod ")?.strip_suffix(';')).chain(["main"]).collect();
    assert_eq!(declared, ORDER.into_iter().collect());
}

#[test]
fn imports_go_up_the_stage_list() {
    let mut wrong = Vec::new();
    for file in files().iter().filter(|f| f.module != "lib") {
        for name in file.names() {
            if rank(&name) > rank(&file.module) {
                wrong.push(format!("{} names `{name}`", file.path.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn the_proof_rests_on_nothing_that_planned() {
    for file in files().iter().filter(|f| f.module == "certify") {
        for name in file.names() {
            assert!(
                name == "certify" || CERTIFY_RESTS_ON.contains(&name.as_str()),
                "{} names `{name}`",
                file.path.display()
            );
        }
    }
}

#[test]
fn the_judge_of_the_certificate_shares_no_code_with_it() {
    let judge = source().join("eval/trust/judge");
    let judges: Vec<File> = files().into_iter().filter(|f| f.path.starts_with(&judge) && !f.is_test()).collect();
    assert!(judges.len() > 4, "{} files", judges.len());
    for file in &judges {
        // The types that hold a case's data; nothing that computes with them but a map's cells.
        let named: Vec<String> = file.names().into_iter().filter(|name| name != "eval").collect();
        let data = ["command", "map", "mission", "robot"];
        assert!(named.iter().all(|name| data.contains(&name.as_str())), "{} names {named:?}", file.path.display());
        for method in [
            "twist(",
            "rim_speeds(",
            "replay(",
            "after_twist(",
            "isometry(",
            "shape_poses(",
            "body_poses(",
            "self_pairs(",
            "allowed(",
            "support(",
            "bounding_radius(",
        ] {
            let calls = file.code.match_indices(method).any(|(at, _)| !file.code[..at].ends_with(word));
            assert!(!calls, "{} calls `{method}`", file.path.display());
        }
    }
}

#[test]
fn mathematics_knows_no_robot() {
    for file in files().iter().filter(|f| f.module == "math") {
        assert!(file.names().iter().all(|name| name == "math"), "{}: {:?}", file.path.display(), file.names());
    }
}

/// Fails where a module that is not listed uses one of these words.
fn only(modules: &[&str], words: &[&str]) {
    for file in files().iter().filter(|f| !modules.contains(&f.module.as_str()) && !f.is_test()) {
        let code = file.without_unit_tests();
        for what in words {
            let found = code.match_indices(what).find(|(at, _)| !code[..*at].ends_with(word));
            assert!(found.is_none(), "{} uses `{what}`", file.path.display());
        }
    }
}

#[test]
fn only_inputs_and_the_command_line_open_files() {
    only(&["inputs", "cli", "main", "lib"], &["std::fs", "fs::", "File::open"]);
}

#[test]
fn only_the_command_line_prints_or_looks_at_the_process() {
    only(&["cli", "main", "lib"], &["std::env", "std::process", "println!", "eprintln!", "dbg!"]);
}

#[test]
fn nothing_depends_on_a_hash_maps_order_or_on_chance() {
    for file in files().iter().filter(|f| !f.is_test()) {
        let code = file.without_unit_tests();
        for what in ["SystemTime", "thread_rng", "RandomState", "rand::"] {
            let stamps = what == "SystemTime" && file.path.ends_with("play/clock.rs");
            assert!(stamps || !code.contains(what), "{} uses `{what}`", file.path.display());
        }
        // Maps may be looked things up in, never gone through: none but these few, which were read for that.
        assert!(
            !code.contains("HashMap") && !code.contains("HashSet") || HASHED.iter().any(|f| file.path.ends_with(f)),
            "{} uses a hash map",
            file.path.display()
        );
    }
}

/// Files whose hash maps are only looked things up in.
const HASHED: [&str; 1] = ["search/astar.rs"]; // with a hasher of its own, keys that are packed states
