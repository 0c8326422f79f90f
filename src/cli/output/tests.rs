use super::*;

const NEW: &[(&str, &[u8])] = &[("commands.csv", b"new"), ("report.json", b"{}")];

struct Scratch(tempfile::TempDir);

impl Scratch {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a scratch folder"))
    }

    fn out(&self) -> PathBuf {
        self.0.path().join("out")
    }

    fn put(&self, path: &str, text: &str) {
        let path = self.out().join(path);
        fs::create_dir_all(path.parent().expect("has one")).expect("scratch");
        fs::write(path, text).expect("scratch");
    }

    /// Names in a folder below `out`, sorted, hidden ones too.
    fn names(&self, path: &str) -> Vec<String> {
        let mut names: Vec<String> = fs::read_dir(self.out().join(path))
            .map(|list| list.map(|e| e.expect("scratch").file_name().into_string().expect("UTF-8")).collect())
            .unwrap_or_default();
        names.sort();
        names
    }

    fn text(&self, path: &str) -> String {
        fs::read_to_string(self.out().join(path)).expect("there")
    }
}

#[test]
fn a_first_result_appears_with_all_its_folders_and_nothing_beside() {
    let s = Scratch::new();
    let folder = publish(&s.out(), "a", NEW).expect("room");
    assert_eq!(folder, s.out().join("a"));
    assert_eq!((s.names(""), s.names("a")), (vec!["a".to_string()], vec!["commands.csv".into(), "report.json".into()]));
    assert_eq!(s.text("a/commands.csv"), "new");
}

#[test]
fn an_older_result_is_replaced_as_a_whole_and_foreign_files_stay() {
    let s = Scratch::new();
    s.put("a/commands.csv", "old");
    s.put("a/commands.mcap", "old");
    s.put("a/plots/p.png", "mine");
    s.put("a/notes.txt", "mine");
    s.put("b/commands.csv", "another mission");
    publish(&s.out(), "a", NEW).expect("room");
    assert_eq!(s.names("a"), ["commands.csv", "notes.txt", "plots", "report.json"]);
    assert_eq!((s.text("a/commands.csv"), s.text("a/plots/p.png")), ("new".into(), "mine".into()));
    assert_eq!((s.names(""), s.text("b/commands.csv")), (vec!["a".into(), "b".into()], "another mission".into()));
}

#[test]
fn a_failed_mission_leaves_its_report_alone() {
    let s = Scratch::new();
    for name in FILES {
        s.put(&format!("a/{name}"), "old");
    }
    publish_failure(&s.out(), "a", &[("report.json", b"{}")]).expect("room");
    assert_eq!(s.names("a"), ["report.json"]);
    assert_eq!(s.text("a/report.json"), "{}");
}

#[test]
fn older_commands_of_a_failed_mission_go_even_if_its_report_cannot_be_written() {
    let s = Scratch::new();
    s.put("a/commands.csv", "old");
    publish_failure(&s.out(), "a", &[("report.json", b"1"), ("report.json", b"2")]).expect_err("twice");
    assert_eq!(s.names(""), [""; 0]);
}

#[test]
fn a_mission_whose_name_would_leave_the_output_folder_is_refused() {
    let s = Scratch::new();
    s.put("commands.csv", "mine");
    for name in ["..", ".", "", "a/b", "/etc"] {
        let error = publish(&s.out().join("x"), name, NEW).expect_err("outside");
        assert!(matches!(error, OutputError::Name(_)), "{name}: {error}");
        discard(&s.out().join("x"), name).expect_err("outside");
    }
    assert_eq!(s.names(""), ["commands.csv"]);
}

#[test]
fn bad_input_takes_our_files_away_and_no_others() {
    let s = Scratch::new();
    for name in FILES {
        s.put(&format!("a/{name}"), "old");
        s.put(&format!("b/{name}"), "old");
    }
    s.put("b/notes.txt", "mine");
    discard(&s.out(), "a").expect("removable");
    discard(&s.out(), "b").expect("removable");
    discard(&s.out(), "never compiled").expect("nothing to do");
    assert_eq!((s.names(""), s.names("b")), (vec!["b".to_string()], vec!["notes.txt".to_string()]));
}

#[test]
fn an_empty_folder_made_by_a_batch_engine_is_used() {
    let s = Scratch::new();
    fs::create_dir_all(s.out().join("a")).expect("scratch");
    publish(&s.out(), "a", NEW).expect("room");
    assert_eq!((s.names("").len(), s.names("a").len()), (1, 2));
}

#[test]
fn a_file_in_the_place_of_a_folder_is_named_and_kept() {
    let s = Scratch::new();
    s.put("a", "mine");
    for result in [publish(&s.out(), "a", NEW).map(|_| ()), discard(&s.out(), "a")] {
        let error = result.expect_err("not a folder");
        assert!(error.to_string().contains("out/a` is not a folder"), "{error}");
        assert_eq!(error.diagnostic().code, "output/not-a-folder");
    }
    // The same one level up.
    let error = publish(&s.out().join("a"), "m", NEW).expect_err("not a folder");
    assert!(error.to_string().contains("out/a"), "{error}");
    assert_eq!(s.text("a"), "mine");
}

#[cfg(unix)]
#[test]
fn a_parent_that_may_not_be_written_is_named_and_the_old_result_stays() {
    use std::os::unix::fs::PermissionsExt;
    let s = Scratch::new();
    s.put("a/commands.csv", "old");
    fs::set_permissions(s.out(), fs::Permissions::from_mode(0o555)).expect("scratch");
    let result = publish(&s.out(), "a", NEW);
    // Whoever may do everything is not stopped by permissions.
    let stopped = File::create(s.out().join("probe")).is_err();
    fs::set_permissions(s.out(), fs::Permissions::from_mode(0o755)).expect("scratch");
    if stopped {
        let error = result.expect_err("read-only");
        assert!(error.to_string().contains("create a folder in") && error.to_string().contains("out"), "{error}");
        assert_eq!((s.names(""), s.text("a/commands.csv")), (vec!["a".to_string()], "old".to_string()));
    }
}

#[test]
fn a_file_that_cannot_be_written_leaves_the_old_result_and_nothing_beside() {
    let s = Scratch::new();
    s.put("a/commands.csv", "old");
    // The same name twice: the second cannot be created, whoever asks.
    let error = publish(&s.out(), "a", &[("commands.csv", b"1"), ("commands.csv", b"2")]).expect_err("twice");
    assert!(error.to_string().contains("cannot write") && error.to_string().contains("commands.csv"), "{error}");
    assert_eq!((s.names(""), s.names("a")), (vec!["a".to_string()], vec!["commands.csv".to_string()]));
    assert_eq!(s.text("a/commands.csv"), "old");
}

#[cfg(unix)]
#[test]
fn leftovers_of_killed_runs_are_cleared_but_not_those_of_running_ones() {
    let s = Scratch::new();
    s.put(".a.trajc-1.new/commands.csv", "half");
    s.put(".a.trajc-2.old/was/commands.csv", "old");
    s.put(".a.trajc-2.old/was/notes.txt", "mine");
    s.put(".a.trajc-3.new/commands.csv", "of a run that goes on");
    s.put(".b.trajc-4.new/commands.csv", "another mission's");
    s.put("a/commands.csv", "newer");
    let running = leftovers::lock(&s.out().join(".a.trajc-3.new")).expect("nobody else holds it");
    publish(&s.out(), "a", NEW).expect("room");
    assert_eq!(s.names(""), [".a.trajc-3.new", ".b.trajc-4.new", "a"]);
    assert_eq!(s.names("a"), ["commands.csv", "notes.txt", "report.json"], "what was foreign is saved");
    drop(running);
    publish(&s.out(), "a", NEW).expect("room");
    assert_eq!(s.names(""), [".b.trajc-4.new", "a"]);
}

#[cfg(unix)]
#[test]
fn a_run_killed_between_the_renames_loses_no_foreign_file() {
    let s = Scratch::new();
    s.put(".a.trajc-2.old/was/commands.csv", "old");
    s.put(".a.trajc-2.old/was/notes.txt", "mine");
    publish(&s.out(), "a", NEW).expect("room");
    assert_eq!((s.names(""), s.text("a/notes.txt")), (vec!["a".to_string()], "mine".to_string()));
    assert_eq!(s.text("a/commands.csv"), "new");
}

#[cfg(unix)]
#[test]
fn a_run_killed_while_it_removed_files_leaves_nothing_of_ours_and_all_that_is_not() {
    let s = Scratch::new();
    for (mission, killed) in [("a", "2"), ("b", "3")] {
        s.put(&format!(".{mission}.trajc-{killed}.gone/was/commands.mcap"), "old");
        s.put(&format!(".{mission}.trajc-{killed}.gone/was/notes.txt"), "mine");
    }
    s.put("b/commands.csv", "newer");
    s.put(".c.trajc-4.gone/was/report.html", "old");
    sweep(&s.out());
    assert_eq!((s.names(""), s.names("a")), (vec!["a".to_string(), "b".to_string()], vec!["notes.txt".to_string()]));
    assert_eq!(s.names("b"), ["commands.csv", "notes.txt"]);
}

#[cfg(unix)]
#[test]
fn runs_that_write_and_remove_the_same_folder_at_the_same_time_all_end_well() {
    let s = Scratch::new();
    s.put("a/notes.txt", "mine");
    let sets: Vec<String> = (0..3).map(|k| format!("set {k}")).collect();
    std::thread::scope(|scope| {
        for set in &sets {
            let out = s.out();
            scope.spawn(move || {
                for round in 0..30 {
                    let files = [("commands.csv", set.as_bytes()), ("report.json", set.as_bytes())];
                    publish(&out, "a", &files).unwrap_or_else(|error| panic!("{set}, {round}: {error}"));
                }
            });
        }
        let out = s.out();
        scope.spawn(move || (0..60).for_each(|_| sweep(&out)));
    });
    sweep(&s.out());
    assert_eq!(
        (s.names(""), s.names("a")),
        (vec!["a".into()], vec!["commands.csv".into(), "notes.txt".into(), "report.json".into()])
    );
    assert_eq!(s.text("a/commands.csv"), s.text("a/report.json"));
}

#[cfg(unix)]
#[test]
fn a_link_to_a_folder_elsewhere_stays_a_link() {
    let s = Scratch::new();
    let far = s.0.path().join("far");
    fs::create_dir_all(&far).expect("scratch");
    fs::write(far.join("commands.mcap"), "old").expect("scratch");
    fs::create_dir_all(s.out()).expect("scratch");
    std::os::unix::fs::symlink(&far, s.out().join("a")).expect("scratch");
    publish(&s.out(), "a", NEW).expect("room");
    assert!(fs::symlink_metadata(s.out().join("a")).expect("there").is_symlink());
    assert_eq!(s.names("a"), ["commands.csv", "report.json"]);
}

#[cfg(unix)]
#[test]
fn a_folder_in_which_someone_stands_is_replaced() {
    let s = Scratch::new();
    s.put("a/commands.csv", "old");
    // Another process, since the current folder belongs to all threads of this one.
    let mut shell = std::process::Command::new("sh")
        .args(["-c", "echo ready; read line"])
        .current_dir(s.out().join("a"))
        .stdin(std::process::Stdio::piped())
        .stderr(std::process::Stdio::null())
        .stdout(std::process::Stdio::piped())
        .spawn()
        .expect("a shell");
    let mut ready = [0; 6];
    io::Read::read_exact(shell.stdout.as_mut().expect("piped"), &mut ready).expect("ready");
    publish(&s.out(), "a", NEW).expect("room");
    drop(shell.stdin.take());
    shell.wait().expect("ends");
    assert_eq!((s.names(""), s.text("a/commands.csv")), (vec!["a".to_string()], "new".to_string()));
}

#[cfg(unix)]
#[test]
fn others_may_read_the_folder_as_the_umask_has_it() {
    use std::os::unix::fs::PermissionsExt;
    let s = Scratch::new();
    publish(&s.out(), "a", NEW).expect("room");
    let mode = |path: &Path| fs::metadata(path).expect("there").permissions().mode() & 0o777;
    assert_eq!(mode(&s.out().join("a")), mode(&s.out()), "not the 0700 of temporary folders");
}
