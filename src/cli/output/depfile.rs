//! `commands.d`: what the commands depend on, for make, ninja and Snakemake.

use std::path::{Component, Path, PathBuf};

/// The text of `commands.d`: one rule `target: inputs…` on one line, then an empty rule for each input, so that one that was
/// deleted does not stop make. `target` and `inputs` are relative to the folder in which the program was started (see
/// [`spelled`]); of inputs given twice the first counts. A path with a line break cannot be written and is left out.
pub fn depfile<P: AsRef<Path>>(target: &Path, inputs: &[P]) -> String {
    let mut escaped: Vec<String> = Vec::new();
    for input in inputs {
        let text = escape(input.as_ref());
        if !text.contains(['\n', '\r']) && !escaped.contains(&text) {
            escaped.push(text);
        }
    }
    let mut out = format!("{}:", escape(target));
    for input in &escaped {
        out += &format!(" {input}");
    }
    out.push('\n');
    for input in &escaped {
        out += &format!("{input}:\n");
    }
    out
}

/// A path as engines spell it: relative to `start` (absolute; the folder in which the program was started) where it lies
/// within, and without `.` or `..` inside. `missions/../robots/r.yaml` becomes `robots/r.yaml`, unless `missions` is a link
/// and that is another file; then the path stays.
pub fn spelled(path: &Path, start: &Path) -> PathBuf {
    let plain = without_detours(path);
    let within = plain.strip_prefix(start).map(Path::to_path_buf).unwrap_or(plain);
    let same = match (path.canonicalize(), start.join(&within).canonicalize()) {
        (Ok(before), Ok(after)) => before == after,
        // What is not there yet (the target) cannot be asked.
        _ => true,
    };
    if same { within } else { path.to_path_buf() }
}

fn without_detours(path: &Path) -> PathBuf {
    let mut parts: Vec<Component<'_>> = Vec::new();
    for part in path.components() {
        match (part, parts.last()) {
            (Component::CurDir, _) | (Component::ParentDir, Some(Component::RootDir)) => {}
            (Component::ParentDir, Some(Component::Normal(_))) => {
                parts.pop();
            }
            _ => parts.push(part),
        }
    }
    if parts.is_empty() { PathBuf::from(".") } else { parts.iter().collect() }
}

/// Spaces, `#` and `:` behind a backslash (backslashes before the first two doubled), `$` doubled: what make and ninja read.
fn escape(path: &Path) -> String {
    let mut out = String::new();
    let mut backslashes = 0;
    for c in path.to_string_lossy().chars() {
        match c {
            ' ' | '\t' | '#' => {
                out.extend(std::iter::repeat_n('\\', backslashes + 1));
                out.push(c);
            }
            ':' => out += "\\:",
            '$' => out += "$$",
            _ => out.push(c),
        }
        backslashes = if c == '\\' { backslashes + 1 } else { 0 };
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inputs_lie_on_one_line_and_have_an_empty_rule_each() {
        let inputs = ["missions/a.yaml", "robots/scr db/r#1.yaml", "maps/$m.pcd", "a:b.stl", "missions/a.yaml", "x\ny"];
        let text = depfile(Path::new("out/a/commands.csv"), &inputs);
        insta::assert_snapshot!(text, @r"
        out/a/commands.csv: missions/a.yaml robots/scr\ db/r\#1.yaml maps/$$m.pcd a\:b.stl
        missions/a.yaml:
        robots/scr\ db/r\#1.yaml:
        maps/$$m.pcd:
        a\:b.stl:
        ");
        assert_eq!(escape(Path::new("a\\ b")), "a\\\\\\ b");
    }

    #[test]
    fn paths_are_spelled_from_the_start_without_detours() {
        let start = Path::new("/home/here");
        for (path, wanted) in [
            ("missions/../robots/r.yaml", "robots/r.yaml"),
            ("./out//a/commands.csv", "out/a/commands.csv"),
            ("/home/here/maps/m.pcd", "maps/m.pcd"),
            ("/home/there/../here/maps/m.pcd", "maps/m.pcd"),
            ("../maps/./m.pcd", "../maps/m.pcd"),
            ("a/../../maps/m.pcd", "../maps/m.pcd"),
            ("/../m.pcd", "/m.pcd"),
            ("a/..", "."),
        ] {
            assert_eq!(spelled(Path::new(path), start), Path::new(wanted), "{path}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn a_detour_through_a_link_stays_where_it_leads_elsewhere() {
        let folder = tempfile::tempdir().expect("a scratch folder");
        let at = |path: &str| folder.path().join(path);
        std::fs::create_dir_all(at("far/missions")).expect("scratch");
        std::fs::write(at("far/r.yaml"), "far").expect("scratch");
        std::fs::write(at("r.yaml"), "near").expect("scratch");
        std::os::unix::fs::symlink(at("far/missions"), at("missions")).expect("scratch");
        let path = at("missions/../r.yaml");
        assert_eq!(spelled(&path, folder.path()), path);
        assert_eq!(spelled(&at("far/../r.yaml"), folder.path()), Path::new("r.yaml"));
    }
}
