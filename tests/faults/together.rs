//! Two at once in one output folder.

use std::process::{Child, Stdio};

use super::batch::{batch, build, check, folders, leftovers, set, trajc, write_missions};
use super::sandbox::Sandbox;

fn start(sandbox: &Sandbox, args: &[&str]) -> Child {
    trajc(sandbox, args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program starts")
}

/// Exit code and what it complained of.
fn end(child: Child) -> (Option<i32>, String) {
    let output = child.wait_with_output().expect("a child");
    (output.status.code(), String::from_utf8(output.stderr).expect("text"))
}

#[test]
fn of_two_builds_one_does_the_work_and_the_other_says_that_it_is_at_it() {
    let sandbox = batch();
    build(&sandbox, 1);
    let wanted = [0, 1].map(|version| {
        write_missions(&sandbox, version, false);
        build(&sandbox, 1);
        folders(&sandbox.path("out"))
    });
    for round in 0..4 {
        write_missions(&sandbox, round % 2, false);
        let both = [(); 2].map(|()| start(&sandbox, &["build", "-k", "-j", "1"]));
        let ends = both.map(end);
        // `e` fails by design. Where the first had ended before the second began, both have built.
        assert!(ends.iter().any(|(code, _)| *code == Some(1)), "{ends:?}");
        for (code, stderr) in &ends {
            let locked = *code == Some(2) && stderr.contains("another build is at work in `out`");
            assert!(locked || *code == Some(1), "{code:?}: {stderr}");
        }
        assert!(folders(&sandbox.path("out")) == wanted[round as usize % 2], "round {round}");
        assert_eq!(leftovers(&sandbox.path("out")), [""; 0]);
    }
    assert_eq!(check(&sandbox, "out"), set(&["a", "b", "c", "d", "x"]));
}

#[test]
fn compilers_of_one_mission_and_a_build_at_once_all_end_well() {
    let sandbox = batch();
    for _ in 0..3 {
        let mut running: Vec<Child> = (0..3).map(|_| start(&sandbox, &["compile", "missions/a.yaml"])).collect();
        running.push(start(&sandbox, &["build", "-j", "1", "--force", "missions/a.yaml"]));
        for (code, stderr) in running.into_iter().map(end) {
            assert_eq!((code, stderr.as_str()), (Some(0), ""));
        }
        let names = sandbox.list("out/a");
        assert!(names.contains(&"commands.csv".to_owned()) && names.contains(&"commands.mcap".to_owned()), "{names:?}");
    }
    assert_eq!(check(&sandbox, "out"), set(&["a"]));
    build(&sandbox, 1);
    assert_eq!(leftovers(&sandbox.path("out")), [""; 0]);
}
