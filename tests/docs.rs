//! README and docs/*.md say what happens: every command in a ```` ```console ```` block is run, and must print what is shown.
//!
//! A document is a session in a folder of its own that has `robots/`, `maps/` and `missions/` as shipped. Commands begin with
//! `$ ` and go to a shell that finds `trajc`. What they print is compared line by line, trailing spaces apart; `…` in a line
//! stands for anything, alone on a line for any lines. Comments before a block tell what is done with it:
//!
//! - `<!-- file: missions/dock.yaml -->`: it is written to that file of the session.
//! - `<!-- exit: 1 -->`: its last command ends with that code, not with 0.
//! - `<!-- not run: needs a robot -->`, or ```` ```console,no_run ````: it is not run. Such blocks are counted and printed with
//!   their reasons.
//!
//! After an intended change run with `TRAJC_DOCS=update`: outputs without `…` are rewritten. Read what moved.

#[allow(dead_code, reason = "what the tests of the command line need")]
#[path = "cli/sandbox.rs"]
mod sandbox;

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use sandbox::{Sandbox, repository};

/// A fenced block.
#[derive(Debug)]
struct Block {
    /// Index of the line with its opening fence.
    line: usize,
    language: String,
    /// What the comments before it say: key and value.
    notes: Vec<(String, String)>,
    body: Vec<String>,
}

/// A command and what it is said to print.
struct Step {
    /// Index of its line in the document.
    line: usize,
    command: String,
    shown: Vec<String>,
}

impl Block {
    fn note(&self, key: &str) -> Option<&str> {
        self.notes.iter().find(|(k, _)| k == key).map(|(_, value)| value.as_str())
    }

    fn steps(&self) -> Vec<Step> {
        let mut steps: Vec<Step> = Vec::new();
        for (k, line) in self.body.iter().enumerate() {
            match (line.strip_prefix("$ "), steps.last_mut()) {
                (Some(command), _) => {
                    steps.push(Step { line: self.line + 1 + k, command: command.to_owned(), shown: Vec::new() });
                }
                (None, Some(step)) => step.shown.push(line.clone()),
                (None, None) => {}
            }
        }
        for step in &mut steps {
            while step.shown.last().is_some_and(|line| line.is_empty()) {
                step.shown.pop();
            }
        }
        steps
    }
}

fn documents() -> Vec<PathBuf> {
    let mut found = vec![repository().join("README.md")];
    let folder = fs::read_dir(repository().join("docs")).expect("docs is there");
    let mut docs: Vec<PathBuf> = folder.map(|entry| entry.expect("an entry").path()).collect();
    docs.retain(|path| path.extension().is_some_and(|e| e == "md"));
    docs.sort();
    found.extend(docs);
    found
}

fn blocks(text: &str) -> Vec<Block> {
    let mut out: Vec<Block> = Vec::new();
    let mut open: Option<Block> = None;
    let mut notes = Vec::new();
    for (line, text) in text.lines().enumerate() {
        match (&mut open, text.strip_prefix("```")) {
            (Some(_), Some("")) => out.extend(open.take()),
            (Some(block), _) => block.body.push(text.to_owned()),
            (None, Some(language)) => {
                let mut words = language.split([',', ' ']).map(str::trim);
                let language = words.next().unwrap_or_default().to_owned();
                let mut notes = std::mem::take(&mut notes);
                if words.any(|word| word == "no_run") {
                    notes.push(("not run".to_owned(), "no_run".to_owned()));
                }
                open = Some(Block { line, language, notes, body: Vec::new() });
            }
            (None, None) => match text.strip_prefix("<!-- ").and_then(|t| t.strip_suffix(" -->")?.split_once(": ")) {
                Some((key, value)) => notes.push((key.to_owned(), value.to_owned())),
                None => notes.clear(),
            },
        }
    }
    assert!(open.is_none(), "a block is not closed");
    out
}

/// Whether a line is as shown.
fn line_matches(shown: &str, printed: &str) -> bool {
    let mut parts = shown.split('…');
    let first = parts.next().unwrap_or_default();
    let Some(mut rest) = printed.strip_prefix(first) else { return false };
    let parts: Vec<&str> = parts.collect();
    let Some((last, middle)) = parts.split_last() else { return rest.is_empty() };
    for part in middle {
        let Some(at) = rest.find(part) else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.ends_with(last)
}

/// Whether the lines are as shown.
fn matches(shown: &[String], printed: &[&str]) -> bool {
    match shown.split_first() {
        None => printed.is_empty(),
        Some((line, rest)) if line.trim() == "…" => (0..=printed.len()).any(|skip| matches(rest, &printed[skip..])),
        Some((line, rest)) => {
            printed.split_first().is_some_and(|(p, others)| line_matches(line, p) && matches(rest, others))
        }
    }
}

/// Runs a line in a shell that finds the program by its name: exit code, and both streams as they came.
fn shell(sandbox: &Sandbox, line: &str) -> (i32, String) {
    let program = Path::new(env!("CARGO_BIN_EXE_trajc")).parent().expect("a folder").to_path_buf();
    let path = std::env::var_os("PATH").unwrap_or_default();
    let path = std::env::join_paths(std::iter::once(program).chain(std::env::split_paths(&path))).expect("a PATH");
    let mut command = Command::new("sh");
    command.args(["-c", &format!("exec 2>&1\n{line}")]).current_dir(sandbox.path("."));
    let output = command.env("PATH", path).env("COLUMNS", "100").env_remove("NO_COLOR").output();
    let output = output.expect("the shell starts");
    let here = sandbox.path("").display().to_string();
    let text = String::from_utf8(output.stdout).expect("prints text").replace(here.trim_end_matches('/'), "<here>");
    (output.status.code().expect("no signal"), text)
}

/// What a session found.
#[derive(Default)]
struct Told {
    run: usize,
    skipped: Vec<String>,
    wrong: Vec<String>,
    /// The document's lines with outputs as they are now.
    lines: Vec<String>,
}

/// Goes through a document.
fn session(path: &Path) -> Told {
    let name = path.strip_prefix(repository()).expect("in the repository").display().to_string();
    let document = fs::read_to_string(path).expect("a document");
    let mut told = Told { lines: document.lines().map(str::to_owned).collect(), ..Told::default() };
    let sandbox = Sandbox::empty();
    for folder in ["robots", "maps", "missions"] {
        sandbox.ship(folder);
    }
    let mut moved = Vec::new();
    for block in blocks(&document) {
        if let Some(file) = block.note("file") {
            sandbox.write(file, block.body.join("\n") + "\n");
        }
        if block.language != "console" {
            continue;
        }
        let steps = block.steps();
        assert!(!steps.is_empty(), "{name}:{}: no command begins with `$ `", block.line + 1);
        if let Some(reason) = block.note("not run") {
            told.skipped.extend(steps.iter().map(|step| format!("{name}: {} ({reason})", step.command)));
            continue;
        }
        let last: i32 = block.note("exit").map_or(0, |code| code.parse().expect("an exit code"));
        for (k, step) in steps.iter().enumerate() {
            let wanted = if k + 1 == steps.len() { last } else { 0 };
            let (code, text) = shell(&sandbox, &step.command.replace("cargo run --release -- ", "trajc "));
            told.run += 1;
            let printed: Vec<&str> = text.trim_end().lines().map(str::trim_end).collect();
            if code != wanted {
                let message = format!("exit {code}, must be {wanted}:\n{text}");
                told.wrong.push(format!("{name}:{}: `{}`: {message}", step.line + 1, step.command));
            } else if !matches(&step.shown, &printed) {
                let message = format!("shown:\n{}\n\nprinted:\n{}\n", step.shown.join("\n"), printed.join("\n"));
                told.wrong.push(format!("{name}:{}: `{}`\n{message}", step.line + 1, step.command));
                if !step.shown.iter().any(|line| line.contains('…')) {
                    moved.push((
                        step.line + 1,
                        step.shown.len(),
                        printed.iter().map(|l| (*l).to_owned()).collect::<Vec<_>>(),
                    ));
                }
            }
        }
    }
    for (at, count, lines) in moved.into_iter().rev() {
        told.lines.splice(at..at + count, lines);
    }
    told
}

#[test]
fn every_command_of_the_documents_prints_what_is_shown() {
    let mut told = Told::default();
    for path in documents() {
        let own = session(&path);
        if std::env::var_os("TRAJC_DOCS").is_some_and(|v| v == "update") && !own.wrong.is_empty() {
            fs::write(&path, own.lines.join("\n") + "\n").expect("the document can be written");
        }
        told.run += own.run;
        told.skipped.extend(own.skipped);
        told.wrong.extend(own.wrong);
    }
    println!("{} commands of README and docs run, {} not run:", told.run, told.skipped.len());
    told.skipped.iter().for_each(|skipped| println!("  {skipped}"));
    assert!(told.run >= 10, "{} commands", told.run);
    let wrong = told.wrong.join("\n");
    assert!(told.wrong.is_empty(), "{wrong}\nAfter an intended change: TRAJC_DOCS=update cargo test --test docs");
}

/// Texts between backticks, by line, outside of blocks.
fn spans(text: &str) -> Vec<Vec<String>> {
    let mut fenced = false;
    let lines = text.lines().filter(|line| {
        let fence = line.starts_with("```");
        fenced ^= fence;
        !fenced && !fence
    });
    lines.map(|line| line.split('`').skip(1).step_by(2).map(str::to_owned).collect()).collect()
}

/// The help of the subcommand that these words call, one level deep or two.
fn help(words: &[&str]) -> Option<String> {
    let is_name = |word: &&&str| word.starts_with(|c: char| c.is_ascii_lowercase()) && !word.contains(['/', '.']);
    let names: Vec<&str> = words.iter().take_while(is_name).take(2).copied().collect();
    let run = |names: &[&str]| Sandbox::empty().run(&[names, &["--help"]].concat());
    (1..=names.len()).rev().map(|n| run(&names[..n])).find(|run| run.code == 0).map(|run| run.stdout)
}

#[test]
fn commands_in_running_text_have_the_subcommands_and_options_that_there_are() {
    let mut seen = 0;
    for path in documents() {
        let text = fs::read_to_string(&path).expect("a document");
        for line in spans(&text) {
            // Options alone are those of the command before them on the line.
            let mut known: Option<String> = None;
            for span in line {
                let span = span.replace("cargo run --release -- ", "trajc ");
                let words: Vec<&str> = span.split_whitespace().collect();
                if words.len() > 1 && words[0] == "trajc" {
                    let found = help(&words[1..]);
                    assert!(found.is_some(), "{}: `{span}`: no such subcommand", path.display());
                    known = found;
                    seen += 1;
                }
                let Some(help) = &known else { continue };
                for option in words.iter().filter(|word| word.starts_with("--")) {
                    let option = option.split('=').next().unwrap_or_default();
                    assert!(help.contains(option), "{}: `{span}`: no {option}", path.display());
                }
            }
        }
    }
    assert!(seen >= 20, "{seen} commands");
}

/// All keys that a JSON Schema of ours knows, at every depth.
fn keys(schema: &serde_json::Value, into: &mut Vec<String>) {
    for (key, inner) in schema["properties"].as_object().into_iter().flatten() {
        into.push(key.clone());
        keys(inner, into);
    }
    // Tables whose keys are the user's own names.
    if schema["additionalProperties"].is_object() {
        keys(&schema["additionalProperties"], into);
    }
    // Lists of tables.
    if schema["items"].is_object() {
        keys(&schema["items"], into);
    }
}

#[test]
fn every_key_of_missions_and_robots_is_described_and_no_other() {
    for (which, document) in [("mission", "docs/mission.md"), ("robot", "docs/robot.md")] {
        let schema = Sandbox::empty().run(&["schema", which]).expect(0).stdout;
        let mut schema: serde_json::Value = serde_json::from_str(&schema).expect("JSON");
        if which == "mission" {
            // Those are the robot's, on its page.
            schema["properties"]["limits"] = serde_json::json!({});
            schema["properties"]["tolerance"] = serde_json::json!({});
        }
        let mut known = Vec::new();
        keys(&schema, &mut known);
        let text = fs::read_to_string(repository().join(document)).expect("a document");
        // The first cell of a table's row names keys; headers name them with a colon.
        let cells = text.lines().filter_map(|line| line.strip_prefix("| ")?.split(" |").next());
        let names = cells.flat_map(|cell| cell.split('`').skip(1).step_by(2).map(|name| name.trim_end_matches(':')));
        let described: Vec<&str> = names.collect();
        for key in &known {
            assert!(described.contains(&key.as_str()), "{document} does not describe `{key}`");
        }
        let is_key = |name: &&&str| name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
        for name in described.iter().filter(is_key) {
            assert!(known.iter().any(|key| key == name), "{document} describes `{name}`, which is no key");
        }
    }
}

/// All code, or golden messages, below a folder.
fn source(folder: &Path, into: &mut String) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            source(&path, into);
        } else if path.extension().is_some_and(|e| e == "rs" || e == "snap") {
            *into += &fs::read_to_string(path).expect("source");
        }
    }
}

#[test]
fn messages_in_the_tables_of_errors_are_those_of_the_program() {
    let mut code = String::new();
    ["src", "tests/golden"].iter().for_each(|folder| source(&repository().join(folder), &mut code));
    let mut seen = 0;
    for path in documents() {
        let text = fs::read_to_string(&path).expect("a document");
        let tables = text.lines().scan(false, |inside, line| {
            *inside = line.starts_with("| it says |") || *inside && line.starts_with('|');
            Some((*inside, line))
        });
        for cell in tables.filter_map(|(inside, line)| line.strip_prefix("| ")?.split(" |").next().filter(|_| inside)) {
            for part in cell.split('`').skip(1).step_by(2).flat_map(|message| message.split('…')) {
                assert!(code.contains(part.trim()), "{}: no message says `{part}`", path.display());
                seen += 1;
            }
        }
    }
    assert!(seen >= 10, "{seen} messages");
}

#[test]
fn an_ellipsis_stands_for_anything_and_nothing_else_does() {
    let shown = |text: &str| text.lines().map(str::to_owned).collect::<Vec<_>>();
    let same = |a: &str, b: &str| matches(&shown(a), &b.lines().collect::<Vec<_>>());
    assert!(same("a\n…\nd", "a\nb\nc\nd") && same("a\n…\nd", "a\nd") && same("x … z", "x 12 y z"));
    assert!(!same("a\n…\nd", "a\nb\nc") && !same("x … z", "x 12 y") && !same("a", "a\nb") && !same("a\nb", "a"));
    assert!(!same("a…a", "a"), "an end is not a beginning too");
}
