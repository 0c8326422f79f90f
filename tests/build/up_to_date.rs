//! What is up to date: the bytes decide, those of every file that has a say.

use std::fs;

use super::sandbox::Sandbox;
use super::{built, of_status, to_do};

/// Missions that name every kind of file: `a` points, `sheet` a map_server sheet and its image, `voxels` a grid and its
/// description, `bare` a grid without one, `meshes` a robot with meshes, `rows` a path in a file.
fn every_kind() -> Sandbox {
    let sandbox = Sandbox::new();
    for file in ["tb3_sandbox.yaml", "tb3_sandbox.pgm", "levine_voxels.npy", "levine_voxels.json"] {
        sandbox.ship(&format!("maps/{file}"));
    }
    for (shipped, name) in [("turtlebot3_burger", "sheet"), ("levine", "voxels")] {
        sandbox.ship(&format!("missions/{shipped}.yaml"));
        let (from, to) =
            (sandbox.path(&format!("missions/{shipped}.yaml")), sandbox.path(&format!("missions/{name}.yaml")));
        fs::rename(from, to).expect("rename");
    }
    fs::copy(sandbox.path("maps/levine_voxels.npy"), sandbox.path("maps/bare.npy")).expect("copy");
    let bare = "file: ../maps/bare.npy\n  resolution_m: 0.1\n  origin_m: [-2.3, -0.3, 0.0]";
    sandbox.write(
        "missions/bare.yaml",
        sandbox.text("missions/voxels.yaml").replace("file: ../maps/levine_voxels.npy", bare),
    );
    let path = "path: {bezier: [[[0, 0], [1, 0], [2, 0], [3, 0]]]}\n";
    sandbox.write(
        "missions/meshes.yaml",
        format!("robot: ../robots/stretch/robot.yaml\nstart: {{joints: {{joint_lift: 0.6}}}}\n{path}"),
    );
    sandbox.write("missions/rows.yaml", "robot: ../robots/conv/robot.yaml\npath: {file: rows.csv}\n");
    sandbox.write("missions/rows.csv", "x_m,y_m\n0,0\n1,0\n2,0.1\n3,0.3\n");
    sandbox
}

#[test]
fn a_change_of_any_input_is_seen_by_the_missions_that_name_it_and_by_no_other() {
    let sandbox = every_kind();
    let document = built(&sandbox, &["-k"], 0);
    assert_eq!(of_status(&document, "certified"), ["a", "bare", "meshes", "rows", "sheet", "voxels"], "{document:#}");
    assert_eq!(to_do(&sandbox), []);
    let mesh = "robots/stretch/meshes/base_link_collision.STL";
    let cases: &[(&str, &[&str])] = &[
        ("missions/a.yaml", &["a"]),
        ("robots/box_base/robot.yaml", &["a", "bare", "voxels"]),
        ("robots/box_base/box_base.urdf", &["a", "bare", "voxels"]),
        ("maps/first.csv", &["a"]),
        ("maps/tb3_sandbox.yaml", &["sheet"]),
        ("maps/tb3_sandbox.pgm", &["sheet"]),
        ("maps/levine_voxels.npy", &["voxels"]),
        ("maps/levine_voxels.json", &["voxels"]),
        ("missions/rows.csv", &["rows"]),
        (mesh, &["meshes"]),
    ];
    for (file, names) in cases {
        let bytes = sandbox.read(file);
        sandbox.write(file, [bytes.as_slice(), b" "].concat());
        let expected: Vec<_> = names.iter().map(|name| ((*name).to_owned(), format!("changed {file}"))).collect();
        assert_eq!(to_do(&sandbox), expected);
        sandbox.remove(file);
        let gone: Vec<_> = names.iter().map(|name| ((*name).to_owned(), format!("gone {file}"))).collect();
        if *file != "missions/a.yaml" {
            assert_eq!(to_do(&sandbox), gone);
        }
        // The same bytes at a later time: nothing to do.
        sandbox.write(file, bytes);
        assert_eq!(to_do(&sandbox), [], "{file}");
    }
    // A file that would have been read had it been there.
    sandbox.write("maps/bare.json", "{}");
    assert_eq!(to_do(&sandbox), [("bare".to_owned(), "appeared maps/bare.json".to_owned())]);
}

#[test]
fn same_size_and_same_date_do_not_hide_a_change() {
    let sandbox = Sandbox::new();
    built(&sandbox, &[], 0);
    let path = sandbox.path("missions/a.yaml");
    let before = fs::metadata(&path).and_then(|found| found.modified()).expect("a date");
    sandbox.edit("missions/a.yaml", "y_m: 1.5, yaw: 0deg}\nclear", "y_m: 1.6, yaw: 0deg}\nclear");
    fs::File::options().write(true).open(&path).and_then(|file| file.set_modified(before)).expect("a date");
    assert_eq!(to_do(&sandbox), [("a".to_owned(), "changed missions/a.yaml".to_owned())]);
}

#[test]
fn an_output_folder_counts_only_as_it_was_written() {
    let sandbox = Sandbox::new();
    built(&sandbox, &[], 0);
    for file in sandbox.list("out/a") {
        let path = format!("out/a/{file}");
        let bytes = sandbox.read(&path);
        sandbox.remove(&path);
        let why = if file == "build.json" { "never built".to_owned() } else { format!("missing {path}") };
        assert_eq!(to_do(&sandbox), [("a".to_owned(), why)]);
        sandbox.write(&path, [bytes.as_slice(), b" "].concat());
        // Times are never the same twice; what is said of all this may be indented as one likes.
        if !["timings.json", "build.json"].contains(&file.as_str()) {
            assert_eq!(to_do(&sandbox), [("a".to_owned(), format!("written to {path}"))]);
        }
        sandbox.write(&path, bytes);
        assert_eq!(to_do(&sandbox), [], "{file}");
    }
    sandbox.write("out/a/notes.txt", "mine");
    assert_eq!(to_do(&sandbox), []);
    // Without the cache everything is read, and is as it was.
    sandbox.remove("out/.trajc-build");
    assert_eq!(to_do(&sandbox), []);
    // `compile` leaves no account of what it did.
    sandbox.run(&["compile", "missions/a.yaml"]).expect(0);
    assert_eq!(to_do(&sandbox), [("a".to_owned(), "never built".to_owned())]);
}

#[test]
fn options_and_places_that_change_what_is_written_count_and_spellings_do_not() {
    let sandbox = Sandbox::new();
    built(&sandbox, &[], 0);
    let why = |folder: &str, args: &[&str]| {
        let run = sandbox.run_in(folder, &[&["build", "-n", "--json"], args].concat()).expect(0);
        let document: serde_json::Value = serde_json::from_str(&run.stdout).expect("JSON");
        document["missions"][0]["why"].to_string()
    };
    let absolute = sandbox.path("missions").display().to_string();
    for same in [
        &["missions"][..],
        &["./missions/"],
        &["missions/a.yaml", "missions"],
        &[&absolute],
        &["--format", "mcap,csv,csv"],
    ] {
        assert_eq!(why(".", same), "[]", "{same:?}");
    }
    for other in [&["--format", "csv"][..], &["--sampling-time", "0.05"], &["--report", "none"]] {
        assert_eq!(why(".", other), r#"["other options"]"#, "{other:?}");
    }
    assert_eq!(why(".", &["--force"]), r#"["--force"]"#);
    assert_eq!(why("missions", &[".", "--out", "../out"]), r#"["built from another folder"]"#);
    fs::rename(sandbox.path("out"), sandbox.path("results")).expect("rename");
    assert_eq!(why(".", &["--out", "results"]), r#"["written to results/a/commands.d"]"#, "it names out/a");
    fs::rename(sandbox.path("results"), sandbox.path("out")).expect("rename");
    assert_eq!(to_do(&sandbox), []);
}
