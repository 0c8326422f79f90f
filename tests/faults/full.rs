//! No room: a disk that is full, files that may not be that large, a stdout that takes no more.

use std::collections::BTreeSet;
use std::fs::{self, File};
use std::process::{Command, Stdio};

use super::batch::{batch, build, check, folders, leftovers, set, trajc, write_missions};
use super::possible;
use super::sandbox::Sandbox;

/// Missions that a build has said it could not write, and that it has said of each why.
fn refused(stderr: &str, reason: &str, hint: &str) -> usize {
    let flat = stderr.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(!flat.contains("panicked"), "{stderr}");
    let faults = flat.matches("error[output/io]: cannot").count();
    assert_eq!(flat.matches(reason).count(), faults, "each says why:\n{stderr}");
    assert_eq!(flat.matches(hint).count(), faults, "and what to do:\n{stderr}");
    faults
}

/// A shell that runs the program with files of at most so many blocks of 512 bytes, told so by an error, not by a signal.
fn limited(sandbox: &Sandbox, blocks: u32, args: &[&str]) -> Command {
    let mut command = Command::new("sh");
    let script = format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$@\"");
    command.args(["-c", &script, "sh", env!("CARGO_BIN_EXE_trajc")]).args(args).current_dir(sandbox.path("."));
    command.env("COLUMNS", "400").stdin(Stdio::null());
    command
}

#[test]
fn files_that_get_too_large_leave_nothing_half_written_and_the_next_build_makes_them() {
    let sandbox = batch();
    build(&sandbox, 1);
    let whole = folders(&sandbox.path("out"));
    let mut sizes: Vec<usize> = whole["a"].values().map(Vec::len).collect();
    sizes.sort_unstable();
    // Each limit lets one more of the files through.
    let limits: BTreeSet<u32> = sizes.iter().map(|size| (*size / 512) as u32).filter(|blocks| *blocks > 0).collect();
    assert!(limits.len() > 4, "{sizes:?}");
    let output = limited(&sandbox, 1, &["--version"]).output().expect("a shell");
    if !output.status.success() {
        eprintln!("SKIPPED: no `ulimit -f` here: writing over a limit is not tried");
        return;
    }
    let mut refusals = 0;
    for blocks in limits {
        let output = limited(&sandbox, blocks, &["build", "-k", "--force", "-j", "2"]).output().expect("a shell");
        let stderr = String::from_utf8(output.stderr).expect("text");
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        let faults = refused(&stderr, "File too large", "files may not be that large here");
        assert!(stderr.contains("cannot write `out/a/"), "by its own name: {stderr}");
        let found = folders(&sandbox.path("out"));
        assert_eq!(found.len() + faults, whole.len(), "{blocks} blocks: {:?}\n{stderr}", found.keys());
        assert!(found.iter().all(|(name, files)| *files == whole[name]), "{blocks} blocks");
        assert_eq!(leftovers(&sandbox.path("out")), [""; 0]);
        refusals += faults;
    }
    assert!(refusals > 0);
    let absent: BTreeSet<String> =
        whole.keys().filter(|name| !sandbox.exists(&format!("out/{name}"))).cloned().collect();
    let done = build(&sandbox, 1);
    let made: BTreeSet<String> =
        ["certified", "failed"].iter().filter_map(|status| done.get(*status)).flatten().cloned().collect();
    assert_eq!(made, absent, "what is missing and nothing else");
    assert!(folders(&sandbox.path("out")) == whole);
}

/// In a name space of mounts of its own, as root or as one who may play root.
fn namespace() -> Option<Vec<&'static str>> {
    let ways = [&["unshare", "--mount"][..], &["unshare", "--map-root-user", "--mount"]];
    let works = |way: &&[&str]| {
        let mount = "mount -t tmpfs tmpfs /tmp";
        let output = Command::new(way[0]).args(&way[1..]).args(["sh", "-c", mount]).output();
        output.is_ok_and(|output| output.status.success())
    };
    ways.into_iter().find(works).map(<[&str]>::to_vec)
}

#[test]
fn a_full_disk_leaves_whole_folders_alone_and_the_next_build_with_room_makes_the_rest() {
    let Some(way) = namespace() else {
        eprintln!("SKIPPED: nobody may mount here: a full disk is not tried");
        return;
    };
    let sandbox = batch();
    build(&sandbox, 1);
    let mut wanted = Vec::new();
    for version in [1, 0] {
        write_missions(&sandbox, version, false);
        build(&sandbox, 1);
        wanted.push(folders(&sandbox.path("out")));
    }
    let (newer, older) = (&wanted[0], &wanted[1]);
    let bytes: usize = older.values().flatten().map(|(_, bytes)| bytes.len()).sum();
    // Room for half of it, then for all of the older set and nothing else; then no more names for files, of which each folder takes ten.
    let kib = |part: f64| format!("size={}k", (part * bytes as f64) as usize / 1024 + 40);
    let disks =
        [kib(0.0), kib(0.3), kib(0.6), kib(1.0), "nr_inodes=3".into(), "nr_inodes=17".into(), "nr_inodes=62".into()];
    let script = r#"
        build() { "$TRAJC" build -k -j 2 --json >"$1.json" 2>"$1.err" </dev/null; echo $? >"$1.code"; cp -a out "$1"; }
        mount -t tmpfs -o size=64m tmpfs out || exit 9
        OLD=$(cat full.old); if [ "$OLD" = yes ]; then cp -a older/. out/ || exit 8; fi
        mount -o "remount,$(cat full.disk)" out 2>remount.err || exit 7
        build full
        mount -o remount,size=64m,nr_inodes=0 out || exit 6
        build room
    "#;
    fs::rename(sandbox.path("out"), sandbox.path("older")).expect("rename");
    write_missions(&sandbox, 1, false);
    let mut refusals = 0;
    for (disk, old) in disks.iter().flat_map(|disk| [(disk, "no"), (disk, "yes")]) {
        fs::create_dir_all(sandbox.path("out")).expect("a folder");
        for folder in ["full", "room"] {
            let _ = fs::remove_dir_all(sandbox.path(folder));
        }
        sandbox.write("full.disk", disk);
        sandbox.write("full.old", old);
        let mut command = Command::new(way[0]);
        command.args(&way[1..]).args(["sh", "-c", script]).current_dir(sandbox.path("."));
        let output = command.env("TRAJC", env!("CARGO_BIN_EXE_trajc")).env("COLUMNS", "400").output().expect("unshare");
        match output.status.code() {
            Some(0) => {}
            // A file system may not become smaller than what is on it.
            Some(7 | 8) => continue,
            code => panic!("{disk}: {code:?} {}", String::from_utf8_lossy(&output.stderr)),
        }
        let stderr = sandbox.text("full.err");
        let faults = refused(&stderr, "No space left on device", "make room on that disk");
        refusals += faults;
        assert_eq!(sandbox.text("full.code").trim(), if faults > 0 { "2" } else { "1" }, "{disk}: {stderr}");
        let found = folders(&sandbox.path("full"));
        assert_eq!(found.len() + faults, newer.len(), "{disk}: {:?}\n{stderr}", found.keys());
        assert!(found.iter().all(|(name, files)| *files == newer[name]), "{disk}, older: {old}");
        assert_eq!(leftovers(&sandbox.path("full")), [""; 0], "{disk}");
        // With room.
        assert_eq!(sandbox.text("room.code").trim(), "1");
        let done = super::batch::statuses(&sandbox.text("room.json"));
        let kept: BTreeSet<String> =
            ["up_to_date", "failed_before"].iter().filter_map(|status| done.get(*status)).flatten().cloned().collect();
        assert_eq!(kept, found.keys().cloned().collect(), "{disk}: what was whole is not made again");
        assert!(folders(&sandbox.path("room")) == *newer, "{disk}");
        assert_eq!(leftovers(&sandbox.path("room")), [""; 0], "{disk}");
    }
    assert!(refusals > 0, "no disk was too small");
    fs::remove_dir_all(sandbox.path("out")).expect("a folder");
    fs::rename(sandbox.path("room"), sandbox.path("out")).expect("rename");
    assert_eq!(check(&sandbox, "out"), set(&["a", "b", "c", "d", "x"]));
}

#[test]
fn a_result_that_cannot_be_printed_is_an_error_and_a_reader_that_went_away_is_none() {
    if !possible(Command::new("sh").args(["-c", "! echo >/dev/full"]), "/dev/full: a full stdout is not tried") {
        return;
    }
    let sandbox = batch();
    sandbox.run(&["build", "missions/a.yaml"]).expect(0);
    for args in [&["check", "--json", "out/a/commands.csv"][..], &["build", "missions/a.yaml"], &["schema", "mission"]]
    {
        let full = File::options().write(true).open("/dev/full").expect("there");
        let output = trajc(&sandbox, args).stdout(full).output().expect("the program starts");
        let stderr = String::from_utf8(output.stderr).expect("text");
        assert_eq!(output.status.code(), Some(2), "{args:?}: {stderr}");
        assert!(stderr.contains("cannot write the result to stdout: No space left"), "{args:?}: {stderr}");
    }
    let script = "\"$0\" schema mission | true";
    let output = Command::new("sh").args(["-c", script, env!("CARGO_BIN_EXE_trajc")]).output().expect("a shell");
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
}

#[test]
fn a_file_of_the_users_is_as_it_was_where_a_new_one_does_not_fit() {
    let sandbox = batch();
    if !possible(&mut limited(&sandbox, 1, &["--version"]), "`ulimit -f`: replacing a file is not tried") {
        return;
    }
    sandbox.write("drawing.svg", "mine");
    let args = ["inspect", "missions/a.yaml", "--plot", "drawing.svg"];
    let output = limited(&sandbox, 1, &args).output().expect("a shell");
    let stderr = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(2), "{stderr}");
    assert_eq!(refused(&stderr, "cannot write `drawing.svg`: File too large", "files may not be that large"), 1);
    assert_eq!(sandbox.text("drawing.svg"), "mine");
    assert_eq!(sandbox.list("."), ["drawing.svg", "first.yaml", "maps", "missions", "robots"]);
    sandbox.run(&args).expect(0);
    assert!(sandbox.text("drawing.svg").ends_with("</svg>\n"));
}
