//! SIGKILL at any instant.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::os::unix::fs::MetadataExt;
use std::process::Stdio;
use std::time::{Duration, Instant};

use super::batch::{Files, batch, build, check, files, folders, leftovers, set, trajc, write_missions};
use super::sandbox::Sandbox;

/// Kills where `TRAJC_KILLS` says nothing.
const KILLS: u32 = 20;

/// Splitmix64: times are the same on every run, instants are not.
struct Random(u64);

impl Random {
    fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) % end
    }
}

/// What tells that a folder's files are the very same files.
fn identity(sandbox: &Sandbox, name: &str) -> Vec<(String, u64, i64, i64)> {
    let folder = format!("out/{name}");
    let of = |file: String| {
        let found = fs::metadata(sandbox.path(&format!("{folder}/{file}"))).expect("a file");
        (file, found.ino(), found.mtime(), found.mtime_nsec())
    };
    sandbox.list(&folder).into_iter().map(of).collect()
}

/// What was found.
#[derive(Debug, Default)]
struct Figures {
    kills: u32,
    /// The process had ended before.
    too_late: u32,
    /// Folders of missions found whole: as they are now to be, or of the version before.
    current: usize,
    older: usize,
    absent: usize,
    /// Absent, but waiting to be put back.
    set_aside: usize,
    /// Temporary folders and files found.
    leftovers: usize,
}

/// What a batch must become: the files of each folder, for a version of the missions.
fn reference(sandbox: &Sandbox, version: u32, broken: bool) -> BTreeMap<String, Files> {
    write_missions(sandbox, version, broken);
    build(sandbox, if broken { 2 } else { 1 });
    let proven = check(sandbox, "out");
    assert_eq!(proven, set(if broken { &["a", "b", "c", "d"] } else { &["a", "b", "c", "d", "x"] }));
    folders(&sandbox.path("out"))
}

#[test]
fn killed_at_any_instant_each_mission_is_whole_or_absent_and_the_next_build_makes_what_is_missing() {
    let rounds = std::env::var("TRAJC_KILLS").map_or(KILLS, |text| text.parse().expect("TRAJC_KILLS: a number"));
    let sandbox = batch();
    // Bad input in version 1: what is there of it is removed.
    let started = Instant::now();
    let versions = [reference(&sandbox, 0, false), reference(&sandbox, 1, true)];
    let mut lasts = started.elapsed().as_micros() as u64 / 3;
    let mut random = Random(9);
    let mut version = 1;
    let mut figures = Figures::default();
    for round in 0.. {
        if figures.kills == rounds {
            break;
        }
        // A first build, all anew, all changed, some missing.
        let mut args = vec!["build", "-k", "-j", "2"];
        match random.below(4) {
            0 => fs::remove_dir_all(sandbox.path("out")).expect("a folder"),
            1 => args.push("--force"),
            2 => {
                version = 1 - version;
                write_missions(&sandbox, version, version == 1);
            }
            _ => {
                for name in ["a", "c", "e"] {
                    fs::remove_dir_all(sandbox.path(&format!("out/{name}"))).expect("a folder");
                }
            }
        }
        let mut running =
            trajc(&sandbox, &args).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("the program starts");
        std::thread::sleep(Duration::from_micros(random.below(lasts)));
        if running.try_wait().expect("a child").is_none() {
            figures.kills += 1;
        } else {
            figures.too_late += 1;
            lasts = lasts * 9 / 10;
        }
        running.kill().expect("a child");
        running.wait().expect("a child");

        let (now, before) = (&versions[version as usize], &versions[1 - version as usize]);
        let found = folders(&sandbox.path("out"));
        let mut kept = BTreeSet::new();
        for (name, files) in &found {
            let current = now.get(name) == Some(files);
            assert!(current || before.get(name) == Some(files), "round {round}: {name} has {:?}", files.keys());
            if current {
                kept.insert(name.clone());
                figures.current += 1;
            } else {
                figures.older += 1;
            }
        }
        // What was moved aside a moment before is put back.
        let left = leftovers(&sandbox.path("out"));
        figures.leftovers += left.len();
        for aside in left.iter().filter(|name| name.ends_with(".old")) {
            let name = aside[1..].split(".trajc-").next().expect("a name");
            let was = sandbox.path(&format!("out/{aside}/was"));
            if !found.contains_key(name) && was.is_dir() {
                figures.set_aside += 1;
                if now.get(name) == Some(&files(&was)) {
                    kept.insert(name.to_owned());
                }
            }
        }
        figures.absent += now.keys().filter(|name| !found.contains_key(*name)).count();
        let untouched: Vec<_> =
            kept.iter().filter(|name| found.contains_key(*name)).map(|name| (name, identity(&sandbox, name))).collect();

        let done = build(&sandbox, if version == 1 { 2 } else { 1 });
        let all = |wanted: &[&str]| wanted.iter().filter_map(|status| done.get(*status)).flatten().cloned().collect();
        let up_to_date: BTreeSet<String> = all(&["up_to_date", "failed_before"]);
        assert_eq!(up_to_date, kept, "round {round}: {args:?}, {found:?}", found = found.keys());
        assert_eq!(folders(&sandbox.path("out")), *now, "round {round}: the same bytes as if nothing had been");
        for (name, identity_before) in untouched {
            assert_eq!(identity(&sandbox, name), identity_before, "round {round}: {name} was not to be touched");
        }
        assert_eq!(leftovers(&sandbox.path("out")), [""; 0], "round {round}");
        if round % 10 == 0 {
            check(&sandbox, "out");
        }
    }
    eprintln!("{figures:?}");
}
