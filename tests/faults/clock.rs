//! A clock that is wrong: dates in years to come, and long ago.

use std::fs::{self, File};
use std::path::Path;
use std::time::{Duration, SystemTime};

use super::batch::{batch, build, folders, set};

/// Dates every file below a folder.
fn date(folder: &Path, time: SystemTime) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            date(&path, time);
        } else {
            File::options().write(true).open(&path).and_then(|file| file.set_modified(time)).expect("a date");
        }
    }
}

#[test]
fn neither_dates_to_come_nor_dates_long_ago_decide_what_is_built() {
    let sandbox = batch();
    build(&sandbox, 1);
    let before = folders(&sandbox.path("out"));
    let year = Duration::from_secs(365 * 24 * 3600);
    let (future, past) = (SystemTime::now() + 10 * year, SystemTime::UNIX_EPOCH + year);
    let ran = |sandbox, code| build(sandbox, code).get("certified").cloned().unwrap_or_default();
    // As if all had been made by a clock that was set back since, and by one that had not been set; with the builds' note and without.
    for (time, note) in [(future, true), (past, true), (future, false), (past, false)] {
        for folder in ["missions", "maps", "robots", "out"] {
            date(&sandbox.path(folder), time);
        }
        if !note {
            sandbox.remove("out/.trajc-build");
        }
        assert_eq!(ran(&sandbox, 1), set(&[]));
    }
    // Inputs older than outputs, and outputs than inputs.
    date(&sandbox.path("missions"), past);
    date(&sandbox.path("out"), future);
    assert_eq!(ran(&sandbox, 1), set(&[]));
    date(&sandbox.path("missions"), future);
    date(&sandbox.path("out"), past);
    assert_eq!(ran(&sandbox, 1), set(&[]));
    assert!(folders(&sandbox.path("out")) == before);
    // A change is one, whatever its date, and of the same length too: each of these texts is dated as the one before it.
    let text = sandbox.text("missions/a.yaml");
    for (k, time) in [future, past, future, past].into_iter().enumerate() {
        date(&sandbox.path("missions"), time);
        assert_eq!(ran(&sandbox, 1), set(&[]));
        sandbox.write("missions/a.yaml", text.replace("y_m: 1.00", &format!("y_m: 1.0{}", k + 1)));
        date(&sandbox.path("missions"), time);
        assert_eq!(ran(&sandbox, 1), set(&["a"]), "{k}");
    }
}
