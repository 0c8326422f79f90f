//! `build.json`: what an output folder was made from and what is in it, so that the next build knows whether it still holds.
//!
//! It lies in the folder it tells of and is written with it. There is no time in it: the same input gives the same bytes.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::hashes::Hashes;
use crate::cli::output::{FILES, spelled};
use crate::cli::products::{DEPFILE, Product, ProductArgs, dependencies};
use crate::inputs::Disk;
use crate::report::{Report, Status};

/// The file's name.
pub const FILE: &str = "build.json";
/// The value of `schema`.
const SCHEMA: &str = "trajc.build-state/1";
/// The file of a folder whose bytes are never the same twice.
const TIMINGS: &str = "timings.json";

/// How a mission ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Ended {
    /// The verdict.
    pub status: Status,
    /// Proven clearance, m; absent without a map.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clearance_m: Option<f64>,
    /// How long the commands are, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub duration_s: Option<f64>,
    /// Why it failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub failure: Option<Reason>,
}

/// Why a mission failed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Reason {
    /// Stable identifier, such as `search/exhausted`.
    pub code: String,
    /// The first line of the reason.
    pub reason: String,
}

impl From<&Report> for Ended {
    fn from(report: &Report) -> Self {
        let certified = report.status == Status::Certified;
        let reason = |reason: &str| reason.lines().next().unwrap_or_default().to_owned();
        Self {
            status: report.status,
            clearance_m: report.certificate.as_ref().filter(|_| certified).and_then(|c| c.clearance_proven_m),
            duration_s: report.commands.as_ref().filter(|_| certified).map(|c| c.duration_s),
            failure: report.failure.as_ref().map(|f| Reason { code: f.code.clone(), reason: reason(&f.reason) }),
        }
    }
}

/// What beside its files decides what is written of a mission.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Making {
    /// Of the program.
    pub version: String,
    /// Of the program's own file; absent where that cannot be read.
    pub program_blake3: Option<String>,
    /// `--sampling-time`.
    pub sampling_time_s: Option<f64>,
    /// `--format`: files.
    pub formats: Vec<String>,
    /// `--report`.
    pub report: String,
}

impl Making {
    /// By this program, with these options.
    pub fn new(args: &ProductArgs, hashes: &Hashes) -> Self {
        let program = std::env::current_exe().ok().and_then(|path| hashes.hash(&path).ok());
        let mut formats: Vec<String> = args.format.iter().map(|format| format.file().to_owned()).collect();
        // As they are written; `commands.d` is about the first.
        formats.sort_by_key(|name| FILES.iter().position(|file| file == name));
        formats.dedup();
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            program_blake3: program.map(|hash| hash.to_hex().to_string()),
            sampling_time_s: args.sampling_time,
            formats,
            report: format!("{:?}", args.report).to_lowercase(),
        }
    }
}

/// A file that was read.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct Input {
    path: PathBuf,
    blake3: String,
}

/// The file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct State {
    schema: String,
    /// As build systems spell it; other files spell theirs likewise.
    mission: PathBuf,
    #[serde(flatten)]
    making: Making,
    /// Files that were read, in order.
    inputs: Vec<Input>,
    /// Files that would have been read, had they been there.
    absent: Vec<PathBuf>,
    /// What was written, with its hash where that is always the same. (That of `commands.d`, which names its own folder, follows from
    /// the rest.)
    outputs: BTreeMap<String, Option<String>>,
    /// How it ended.
    #[serde(flatten)]
    pub ended: Ended,
}

/// Why an output folder does not hold.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Stale {
    /// There is none, or `build` has not made it.
    New,
    /// Asked for with `--force`.
    Forced,
    /// The program is another one.
    Program,
    /// What was asked for to be written is.
    Options,
    /// Started in another folder: files are spelled in another way.
    Elsewhere,
    /// Another mission of this build writes this input anew.
    After(PathBuf),
    /// These inputs changed.
    Changed(Vec<PathBuf>),
    /// These inputs are gone.
    Gone(Vec<PathBuf>),
    /// These came up, and are read before others.
    Appeared(Vec<PathBuf>),
    /// These outputs are missing.
    Missing(Vec<PathBuf>),
    /// Somebody wrote to these outputs.
    Touched(Vec<PathBuf>),
}

impl std::fmt::Display for Stale {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let list = |what: &str, paths: &[PathBuf]| {
            let shown: Vec<String> = paths.iter().map(|path| path.display().to_string()).collect();
            format!("{what} {}", shown.join(", "))
        };
        f.write_str(&match self {
            Self::New => "never built".to_owned(),
            Self::Forced => "--force".to_owned(),
            Self::Program => "another trajc".to_owned(),
            Self::Options => "other options".to_owned(),
            Self::Elsewhere => "built from another folder".to_owned(),
            Self::After(path) => format!("{} is made first", path.display()),
            Self::Changed(paths) => list("changed", paths),
            Self::Gone(paths) => list("gone", paths),
            Self::Appeared(paths) => list("appeared", paths),
            Self::Missing(paths) => list("missing", paths),
            Self::Touched(paths) => list("written to", paths),
        })
    }
}

impl State {
    /// Of a mission that was compiled just now. `files`: what is written.
    pub fn new(mission: &Path, start: &Path, making: &Making, disk: &Disk, files: &[Product], ended: Ended) -> Self {
        let input =
            |(path, hash): &(PathBuf, blake3::Hash)| Input { path: spelled(path, start), blake3: hash.to_string() };
        let output = |(name, bytes): &Product| {
            let hash = (![TIMINGS, DEPFILE].contains(name)).then(|| blake3::hash(bytes).to_string());
            ((*name).to_owned(), hash)
        };
        Self {
            schema: SCHEMA.to_owned(),
            mission: mission.to_path_buf(),
            making: making.clone(),
            inputs: disk.files().iter().map(input).collect(),
            absent: disk.absent().iter().map(|path| spelled(path, start)).collect(),
            outputs: files.iter().map(output).collect(),
            ended,
        }
    }

    /// Files that were read, as build systems spell them.
    pub fn reads(&self) -> impl Iterator<Item = &Path> {
        self.inputs.iter().map(|input| input.path.as_path())
    }

    /// What an output folder says of itself.
    pub fn read(folder: &Path) -> Option<Self> {
        let state: Self = serde_json::from_slice(&fs::read(folder.join(FILE)).ok()?).ok()?;
        (state.schema == SCHEMA).then_some(state)
    }

    /// As it is written.
    pub fn to_json(&self) -> String {
        let mut text = serde_json::to_string_pretty(self).expect("names and numbers");
        text.push('\n');
        text
    }

    /// Notes the hashes of what was written, so that the next build need not read it.
    pub fn wrote(&self, folder: &Path, start: &Path, hashes: &Hashes) {
        for (name, hash) in &self.outputs {
            if let Some(hash) = self.expected(name, hash.as_deref(), folder, start) {
                hashes.wrote(&folder.join(name), hash);
            }
        }
    }

    /// The hash that an output must have.
    fn expected(&self, name: &str, hash: Option<&str>, folder: &Path, start: &Path) -> Option<blake3::Hash> {
        if name == DEPFILE {
            let read: Vec<PathBuf> = self.inputs.iter().map(|input| input.path.clone()).collect();
            let text = dependencies(folder, self.making.formats.first()?, &read, start);
            return Some(blake3::hash(text.as_bytes()));
        }
        blake3::Hash::from_hex(hash?).ok()
    }

    /// All reasons why the folder does not hold what would be made now; none: it does.
    pub fn stale(&self, mission: &Path, folder: &Path, start: &Path, making: &Making, hashes: &Hashes) -> Vec<Stale> {
        let mut why = Vec::new();
        let own = &self.making;
        if (&own.version, &own.program_blake3) != (&making.version, &making.program_blake3) {
            why.push(Stale::Program);
        }
        let options = |m: &Making| (m.sampling_time_s, m.formats.clone(), m.report.clone());
        if options(own) != options(making) {
            why.push(Stale::Options);
        }
        if self.mission != mission {
            why.push(Stale::Elsewhere);
            return why;
        }
        let (mut changed, mut gone) = (Vec::new(), Vec::new());
        for input in &self.inputs {
            match hashes.hash(&input.path) {
                Ok(hash) if *hash.to_hex() == *input.blake3 => {}
                Ok(_) => changed.push(input.path.clone()),
                Err(_) => gone.push(input.path.clone()),
            }
        }
        let appeared = self.absent.iter().filter(|path| path.is_file()).cloned().collect();
        let (mut missing, mut touched) = (Vec::new(), Vec::new());
        for (name, hash) in &self.outputs {
            let path = folder.join(name);
            match self.expected(name, hash.as_deref(), folder, start) {
                None if path.is_file() => {}
                None => missing.push(path),
                Some(own) => match hashes.hash(&path) {
                    Ok(hash) if hash == own => {}
                    Ok(_) => touched.push(path),
                    Err(_) => missing.push(path),
                },
            }
        }
        let some = |of: fn(Vec<PathBuf>) -> Stale, paths: Vec<PathBuf>| (!paths.is_empty()).then(|| of(paths));
        why.extend(some(Stale::Changed, changed));
        why.extend(some(Stale::Gone, gone));
        why.extend(some(Stale::Appeared, appeared));
        why.extend(some(Stale::Missing, missing));
        why.extend(some(Stale::Touched, touched));
        why
    }
}
