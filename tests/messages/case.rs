//! A mistake as data, and what its message must hold.

use super::sandbox::{Run, Sandbox};

/// The mission that most cases spoil.
pub const MISSION: &str = "missions/a.yaml";
pub const ROBOT: &str = "robots/box_base/robot.yaml";
pub const URDF: &str = "robots/box_base/box_base.urdf";
pub const MAP: &str = "maps/first.csv";

/// Why a message goes without something. No other reasons are accepted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Why {
    /// A binary file has no lines; its name must do.
    Binary,
    /// The file as a whole is wrong: it is empty, cut off, not there, of another kind.
    WholeFile,
    /// What is missing cannot be quoted.
    Missing,
}

/// Where the message must say the mistake is.
enum Place {
    Unsaid,
    /// In this file, where `|` stands in this piece of it (else where it begins). The piece is there once.
    Text(&'static str, &'static str),
    /// Where this file begins.
    Top(&'static str),
    /// In this file as a whole.
    File(&'static str),
    /// In the arguments.
    Argument,
}

/// A part of a message.
enum Part {
    Unsaid,
    Says(&'static str),
    Without,
}

/// How files are spoiled.
type Spoil = Box<dyn Fn(&Sandbox)>;

pub struct Case {
    pub name: &'static str,
    base: fn() -> Sandbox,
    spoil: Vec<Spoil>,
    args: Vec<&'static str>,
    code: i32,
    place: Place,
    found: Part,
    expected: Part,
    hint: Part,
}

/// A mistake in the small mission, seen by `compile`.
pub fn case(name: &'static str) -> Case {
    Case {
        name,
        base: Sandbox::new,
        spoil: Vec::new(),
        args: vec!["compile", MISSION],
        code: 2,
        place: Place::Unsaid,
        found: Part::Unsaid,
        expected: Part::Unsaid,
        hint: Part::Unsaid,
    }
}

impl Case {
    pub fn base(mut self, base: fn() -> Sandbox) -> Self {
        self.base = base;
        self
    }

    pub fn run(mut self, args: &[&'static str]) -> Self {
        self.args = args.to_vec();
        self
    }

    /// Ends with this code, not with 2.
    pub fn exit(mut self, code: i32) -> Self {
        self.code = code;
        self
    }

    pub fn with(mut self, spoil: impl Fn(&Sandbox) + 'static) -> Self {
        self.spoil.push(Box::new(spoil));
        self
    }

    pub fn edit(self, file: &'static str, from: &'static str, to: &'static str) -> Self {
        self.with(move |s| s.edit(file, from, to))
    }

    pub fn write(self, file: &'static str, bytes: impl AsRef<[u8]> + 'static) -> Self {
        self.with(move |s| s.write(file, &bytes))
    }

    pub fn append(self, file: &'static str, text: &'static str) -> Self {
        self.with(move |s| s.write(file, s.text(file) + text))
    }

    pub fn ship(self, path: &'static str) -> Self {
        self.with(move |s| s.ship(path))
    }

    /// Keeps the first half of a file.
    pub fn halve(self, file: &'static str) -> Self {
        self.with(move |s| {
            let bytes = s.read(file);
            s.write(file, &bytes[..bytes.len() / 2]);
        })
    }

    pub fn at(mut self, file: &'static str, piece: &'static str) -> Self {
        self.place = Place::Text(file, piece);
        self
    }

    /// Line 1, column 1: all of the text is wrong.
    pub fn at_the_top(mut self, file: &'static str) -> Self {
        self.place = Place::Top(file);
        self
    }

    pub fn in_file(mut self, file: &'static str, why: Why) -> Self {
        assert!(matches!(why, Why::Binary | Why::WholeFile), "{}: {why:?} has a line", self.name);
        self.place = Place::File(file);
        self
    }

    pub fn in_arguments(mut self) -> Self {
        self.place = Place::Argument;
        self
    }

    pub fn found(mut self, text: &'static str) -> Self {
        self.found = Part::Says(text);
        self
    }

    pub fn nothing_found(mut self, why: Why) -> Self {
        assert!(matches!(why, Why::Missing | Why::WholeFile), "{}: {why:?} can be quoted", self.name);
        self.found = Part::Without;
        self
    }

    pub fn expected(mut self, text: &'static str) -> Self {
        self.expected = Part::Says(text);
        self
    }

    /// Nothing else would have been right there: it must not be there at all.
    pub fn nothing_expected(mut self) -> Self {
        self.expected = Part::Without;
        self
    }

    pub fn hint(mut self, text: &'static str) -> Self {
        self.hint = Part::Says(text);
        self
    }

    /// Runs the program on the spoiled files; what it says.
    fn outcome(&self) -> Outcome {
        let sandbox = (self.base)();
        for spoil in &self.spoil {
            spoil(&sandbox);
        }
        let run = sandbox.run(&self.args);
        let place = match self.place {
            Place::Text(file, piece) => place(&sandbox, file, piece).map(Some),
            Place::Top(file) => Ok(Some(format!("{file}:1:1"))),
            Place::File(file) => Ok(Some(file.to_owned())),
            Place::Argument | Place::Unsaid => Ok(None),
        };
        Outcome { run, place }
    }

    fn faults(&self, Outcome { run, place }: &Outcome) -> Vec<String> {
        let mut faults = Vec::new();
        let mut demand = |holds: bool, what: String| {
            if !holds {
                faults.push(what);
            }
        };
        let message = Message::of(&run.stderr);
        demand(run.code == self.code, format!("exit code {}, not {}", run.code, self.code));
        demand(message.titles == 1, format!("{} errors are told, one was made", message.titles));
        match (&self.place, place) {
            (Place::Unsaid, _) => demand(false, "the case does not say where".into()),
            (Place::Argument, _) => {
                demand(message.places.is_empty(), "the mistake is in an argument, not a file".into())
            }
            (_, Err(fault)) => demand(false, fault.clone()),
            (_, Ok(Some(place))) => demand(message.places == [place.as_str()], format!("the place is {place}")),
            (_, Ok(None)) => {}
        }
        // What was found is told in words, not only by the quoted line.
        for (part, what, whole) in [
            (&self.found, "what was found", message.title.clone()),
            (&self.expected, "what was expected", format!("{} {}", message.title, message.help)),
            (&self.hint, "the hint", message.help.clone()),
        ] {
            match part {
                Part::Unsaid => demand(false, format!("the case does not say {what}")),
                Part::Says(text) => demand(!text.is_empty() && whole.contains(text), format!("{what}: no `{text}`")),
                Part::Without => {}
            }
        }
        for foreign in ["os error", "at line ", "panicked", "Some(", "/tmp/"] {
            demand(!message.title.contains(foreign), format!("`{foreign}` is no word for a reader"));
        }
        demand(!run.stderr.contains('\u{1b}'), "colour in a pipe".into());
        faults
    }
}

/// Runs every case, compares with its golden file, and fails with all that is missing in any.
pub fn judge(area: &str, cases: &[Case]) {
    let mut faults = Vec::new();
    let mut settings = insta::Settings::clone_current();
    settings.set_snapshot_path(format!("golden/{area}"));
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    for case in cases {
        let outcome = case.outcome();
        let found = case.faults(&outcome);
        if !found.is_empty() {
            faults.push(format!("{}: {}\n{}", case.name, found.join("; "), outcome.run.stderr));
        }
        let text = format!("$ trajc {}\nexit {}\n{}", case.args.join(" "), outcome.run.code, outcome.run.stderr);
        settings.bind(|| insta::assert_snapshot!(case.name, text));
    }
    assert!(faults.is_empty(), "{} of {} messages lack something:\n\n{}", faults.len(), cases.len(), faults.join("\n"));
}

struct Outcome {
    run: Run,
    place: Result<Option<String>, String>,
}

/// `file:line:column` of `|` in a piece of a file; columns count characters, a byte-order mark is none.
fn place(sandbox: &Sandbox, file: &str, piece: &str) -> Result<String, String> {
    let mark = piece.find('|').unwrap_or(0);
    let piece = piece.replacen('|', "", 1);
    let text = String::from_utf8_lossy(&sandbox.read(file)).into_owned();
    if text.matches(&piece).count() != 1 {
        return Err(format!("`{piece}` is {} times in {file}, not once", text.matches(&piece).count()));
    }
    let at = text.find(&piece).expect("counted") + mark;
    let line_start = text[..at].rfind('\n').map_or(0, |i| i + 1);
    let line = text[..at].matches('\n').count() + 1;
    let column = text[line_start..at].trim_start_matches('\u{feff}').chars().count() + 1;
    Ok(format!("{file}:{line}:{column}"))
}

/// A message in its parts.
pub struct Message {
    pub title: String,
    pub help: String,
    places: Vec<String>,
    titles: usize,
}

impl Message {
    /// Of what the program prints to stderr, ours or that of the argument parser.
    pub fn of(stderr: &str) -> Self {
        let mut message = Self { title: String::new(), help: String::new(), places: Vec::new(), titles: 0 };
        let mut helps = false;
        for line in stderr.lines() {
            let bare = line.trim_start();
            if let Some(title) = line.strip_prefix("error") {
                message.titles += 1;
                let (code, title) = title.split_once(": ").unwrap_or(("", title));
                message.title += title;
                // The argument parser puts the example there.
                if let Some((_, example)) = title.split_once(", such as ").filter(|_| code.is_empty()) {
                    message.help += example;
                }
            } else if let Some(place) = bare.strip_prefix("--> ") {
                message.places.push(place.to_owned());
            } else if let Some(help) = bare.strip_prefix("= help: ").or_else(|| bare.strip_prefix("tip: ")) {
                helps = true;
                message.help += help;
            } else if bare.starts_with("[possible values")
                || bare.starts_with("Usage: ")
                || bare.starts_with("For more information")
            {
                message.help += bare;
            } else if bare.starts_with(['<', '-']) && message.places.is_empty() {
                // Arguments that the parser misses.
                message.title += bare;
            } else if helps && !bare.contains('|') {
                message.help += bare;
            }
        }
        message
    }
}
