//! Files made to harm: what never ends, what is not there, what takes all memory, what lies elsewhere.

use super::sandbox::{Run, Sandbox};

const URDF: &str = "robots/box_base/box_base.urdf";

/// What the program says of a mission that was spoiled; never a panic, never more than bad input.
fn refused(options: &[&str], spoil: impl FnOnce(&Sandbox)) -> String {
    let sandbox = Sandbox::new();
    spoil(&sandbox);
    let args: Vec<&str> = ["compile", "missions/a.yaml"].into_iter().chain(options.iter().copied()).collect();
    let Run { code, stderr, .. } = sandbox.run(&args);
    assert_eq!(code, 2, "{stderr}");
    assert!(!stderr.contains("panicked"), "{stderr}");
    stderr
}

#[track_caller]
fn says(text: &str, parts: &[&str]) {
    // Messages are broken to the terminal's width.
    let flat = text.split_whitespace().collect::<Vec<_>>().join(" ");
    for part in parts {
        assert!(flat.contains(part), "no `{part}` in:\n{text}");
    }
}

#[cfg(unix)]
#[test]
fn pipes_devices_and_circular_links_are_not_read() {
    let pipe = |path: &'static str| {
        move |s: &Sandbox| {
            s.remove(path);
            let made = std::process::Command::new("mkfifo").arg(s.path(path)).status().expect("mkfifo");
            assert!(made.success());
        }
    };
    for path in ["maps/first.csv", URDF, "robots/box_base/robot.yaml", "missions/a.yaml"] {
        says(&refused(&[], pipe(path)), &["is a pipe or a device", "only files are read"]);
    }
    let link = |to: &'static str| {
        move |s: &Sandbox| {
            s.remove("maps/first.csv");
            std::os::unix::fs::symlink(to, s.path("maps/first.csv")).expect("a link");
        }
    };
    says(&refused(&[], link("/dev/zero")), &["is a pipe or a device"]);
    says(&refused(&[], link("first.csv")), &["cannot read", "maps/first.csv", "check where the link leads"]);
}

#[test]
fn meshes_outside_the_robots_folder_need_leave() {
    let mesh = |name: &'static str| {
        move |s: &Sandbox| {
            s.edit(URDF, "<box size=\"0.40 0.40 0.30\"/>", &format!("<mesh filename=\"{name}\"/>"));
            s.write("robots/secret.obj", "v 0 0 0\n");
        }
    };
    for name in ["../secret.obj", "/etc/secret.obj", "file:///etc/secret.obj", "package://a/../../secret.obj"] {
        says(&refused(&[], mesh(name)), &["is not under the robot's folder", "--allow-path DIR"]);
    }
    // With leave it is read, and found to be no solid or not there.
    let sandbox = Sandbox::new();
    mesh("../secret.obj")(&sandbox);
    let run = sandbox.run(&["compile", "missions/a.yaml", "--allow-path", "robots"]);
    assert!(!run.stderr.contains("robot's folder"), "{}", run.stderr);
    assert!(refused(&["--allow-path", "maps"], mesh("../secret.obj")).contains("robot's folder"));
}

#[test]
fn what_takes_too_much_memory_is_refused_before_it_is_taken() {
    let large = |s: &Sandbox| s.write("maps/first.csv", "x,y,z\n".to_owned() + &"0,0,0\n".repeat(400_000));
    let text = refused(&["--max-memory", "2MiB"], large);
    says(&text, &["maps/first.csv", "2.3 MiB of memory, more than --max-memory 2 MiB", "allow more with --max-memory"]);
    let wide = |s: &Sandbox| s.write("maps/first.csv", "x,y,z\n0,0,0.1\n400,400,0.1\n");
    says(&refused(&["--max-memory", "4MiB"], wide), &["the grid would have", "resolution_m:"]);
    // The grid fits, its distance field does not.
    let text = refused(&["--max-memory", "16MiB"], |s| {
        s.write("maps/first.csv", "x,y,z\n0,0,0.1\n50,50,0.1\n49.9,49.9,0.3\n");
    });
    says(&text, &["the distance field of the map's", "--max-memory 16 MiB"]);
    says(&refused(&["--max-memory", "lots"], |_| {}), &["a size of at least 1 MiB"]);
}

#[test]
fn bombs_and_deep_nests_are_refused() {
    let entity = |n: usize| format!("<!ENTITY e{n} \"{}\">", format!("&e{};", n - 1).repeat(10));
    let doctype: String = (1..10).map(entity).collect();
    let bomb = format!("<!DOCTYPE robot [<!ENTITY e0 \"ha\">{doctype}]><robot name=\"&e9;\"/>");
    refused(&[], |s| s.write(URDF, &bomb));
    refused(&[], |s| s.write(URDF, "<robot>".repeat(200_000)));
    refused(&[], |s| s.write("missions/a.yaml", "[".repeat(200_000)));
    refused(&[], |s| s.write("missions/a.yaml", "- ".repeat(200_000)));
    refused(&[], |s| s.write("robots/box_base/robot.yaml", "{a: ".repeat(200_000)));
    refused(&[], |s| {
        s.write("maps/a.yaml", "image: ".to_owned() + &"[".repeat(200_000));
        s.edit("missions/a.yaml", "first.csv", "a.yaml");
    });
    let sandbox = Sandbox::new();
    sandbox.write("a.json", "{\"a\":".repeat(200_000));
    let run = sandbox.run(&["eval", "--suite", "a.json", "--robot", "robots/box_base/robot.yaml"]);
    assert_eq!(run.code, 2, "{}", run.stderr);
    assert!(!run.stderr.contains("panicked"), "{}", run.stderr);
}

#[test]
fn byte_order_marks_and_carriage_returns_change_nothing() {
    let plain = Sandbox::new();
    let marked = Sandbox::new();
    for path in ["missions/a.yaml", "robots/box_base/robot.yaml", URDF, "maps/first.csv"] {
        let text = marked.text(path).replace('\n', "\r\n");
        marked.write(path, "\u{feff}".to_owned() + &text);
    }
    let commands = |s: &Sandbox| {
        let run = s.run(&["compile", "missions/a.yaml"]);
        assert_eq!(run.code, 0, "{}", run.stderr);
        let text = s.text("out/a/commands.csv");
        text.lines().filter(|line| !line.starts_with('#')).map(|line| line.to_owned() + "\n").collect::<String>()
    };
    assert_eq!(commands(&plain), commands(&marked));
}
