//! `trajc eval`.

mod curves;
mod trust;

use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use clap::{ValueEnum, builder::PossibleValue};
use indicatif::{ProgressBar, ProgressStyle};

use super::inputs::{self, Disk};
use super::output;
use super::terminal::Terminal;
use crate::diag::{Diagnostic, Diagnostics};
use crate::emit::csv::{self, CsvHeader};
use crate::eval::{self, Judged, SceneSet, Suite, figures, tables};
use crate::mission::{LimitsSpec, Parameterisation};
use crate::pipeline::{CompileOptions, Outcome, TextFile};
use crate::report::schema::{InputFile, InputsPart};
use crate::robot::{self, Files, RobotInputs, RobotModel, spec};

/// Compile many scenes and print the paper's tables beside what came out.
///
/// The scenes are those of a suite, drawn from a seed, or of a file (format trajc.scenes/1). They run one after the other on one
/// core. Success means certified. Exit 0: every scene was judged, failed ones too. 1: of trust, something was certified that must not
/// be. 2: bad input.
#[derive(Debug, clap::Args)]
#[command(group(clap::ArgGroup::new("what").required(true).args(["suite", "scenes"])))]
pub struct EvalArgs {
    /// Draw the scenes of this table of [SCR]; fig5 and fig6: the one scene of a figure; arm: rooms for a robot with an arm; curves: the
    /// paths of [CONV] section 3 and tighter ones under every time law; trust: cases made to be hard for the certificate, judged by
    /// brute force.
    #[arg(long)]
    suite: Option<Which>,
    /// Read the scenes from a file.
    #[arg(long, value_name = "FILE.json")]
    scenes: Option<PathBuf>,
    /// Robot: a folder, a robot.yaml or a .urdf [default: scr_db for table1, box_base for table2 and table3, arm7 for
    /// arm]. Any number of joints.
    #[arg(long, value_name = "PATH")]
    robot: Option<PathBuf>,
    /// Scenes for each number of boxes, or kind of room [default: the paper's 500, 200 or 120]; of a file: the first N [default: all];
    /// of trust: cases in all [default: 1400].
    #[arg(long, value_name = "N", value_parser = count)]
    count: Option<u32>,
    /// Seed of a suite [default: 1].
    #[arg(long, value_name = "SEED", conflicts_with = "scenes")]
    seed: Option<u64>,
    /// Of trust only this case, with all that was found.
    #[arg(long, value_name = "INDEX", conflicts_with_all = ["scenes", "count"])]
    scene: Option<u64>,
    /// Boxes a scene, for table3 [default: 10,20,35].
    #[arg(long, value_name = "N", value_delimiter = ',', conflicts_with = "scenes",
          value_parser = boxes)]
    boxes: Vec<u16>,
    /// What the optimiser's polynomials are of [default: as in a mission that does not say].
    #[arg(long, value_name = "WHAT")]
    parameterisation: Option<Parameterisation>,
    /// Also write the suite's scenes to a file.
    #[arg(long, value_name = "FILE.json", conflicts_with = "scenes")]
    write_scenes: Option<PathBuf>,
    /// Write DIR/ID/commands.csv and report.json of each certified scene; of curves DIR/ID/LAW.csv.
    #[arg(long, value_name = "DIR")]
    write_commands: Option<PathBuf>,
    /// Draw each scene as DIR/ID.svg: from above, obstacles, path and robot; below, joints and wheels over time [default: out for
    /// fig5 (fig5.svg, and fig5-spins.svg with turns on the spot) and fig6 (fig6.svg); nothing is drawn for others]. A curve: the path,
    /// where clipped wheels lead, and the wheels under every law.
    #[arg(long, value_name = "DIR")]
    plot: Option<PathBuf>,
    /// Print the milliseconds of each stage too.
    #[arg(long)]
    profile: bool,
    /// Print figures as JSON instead of tables.
    #[arg(long)]
    json: bool,
}

fn count(text: &str) -> Result<u32, String> {
    super::whole(text, 1, 10_000_000).map(|n| n as u32)
}

fn boxes(text: &str) -> Result<u16, String> {
    super::whole(text, 1, 60).map(|n| n as u16)
}

/// What `--suite` names.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Which {
    /// Suites of scenes.
    Scenes(Suite),
    /// Paths.
    Curves,
    /// Cases for the certificate.
    Trust,
}

impl ValueEnum for Which {
    fn value_variants<'a>() -> &'a [Self] {
        use Which::{Curves, Scenes, Trust};
        const ALL: [Which; 8] = {
            let [a, b, c, d, e, f] = Suite::ALL;
            [Scenes(a), Scenes(b), Scenes(c), Scenes(d), Scenes(e), Scenes(f), Curves, Trust]
        };
        &ALL
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        match self {
            Self::Scenes(suite) => suite.to_possible_value(),
            Self::Curves => Some(
                PossibleValue::new("curves").help("The curves of [CONV] section 3, and hairpins, under every time law"),
            ),
            Self::Trust => Some(
                PossibleValue::new("trust")
                    .help("The certificate against cases made to be hard for it, judged by brute force"),
            ),
        }
    }
}

impl EvalArgs {
    /// The suite of scenes that was asked for.
    fn scene_suite(&self) -> Option<Suite> {
        match self.suite {
            Some(Which::Scenes(suite)) => Some(suite),
            Some(Which::Curves | Which::Trust) | None => None,
        }
    }
}

/// Scenes that are held in memory at once, at most.
const MOST_SCENES: u32 = 5000;

/// Robots that suites run with where none is named: name, robot.yaml, URDF.
const SCR_DB: [&str; 3] =
    ["scr_db", include_str!("../../robots/scr_db/robot.yaml"), include_str!("../../robots/scr_db/scr_db.urdf")];
const BOX_BASE: [&str; 3] =
    ["box_base", include_str!("../../robots/box_base/robot.yaml"), include_str!("../../robots/box_base/box_base.urdf")];

const ARM7: [&str; 3] =
    ["arm7", include_str!("../../robots/arm7/robot.yaml"), include_str!("../../robots/arm7/arm7.urdf")];

/// Runs the scenes and prints.
///
/// # Errors
/// Bad input: scenes, robot, or a folder that cannot be written.
pub fn eval(args: &EvalArgs, terminal: &mut Terminal) -> Result<u8, Diagnostics> {
    if args.suite == Some(Which::Curves) {
        return curves::eval(args, terminal);
    }
    if args.suite == Some(Which::Trust) {
        return trust::eval(args, terminal);
    }
    if args.scene.is_some() {
        let fault = Diagnostic::error("eval/scene", "`--scene` is for the suite `trust`");
        return Err(fault.hint("leave `--scene` out, or add `--suite trust`").into());
    }
    if args.count.is_some_and(|count| count > MOST_SCENES) {
        let fault = Diagnostic::error("eval/count", format!("`--count` is above {MOST_SCENES}"));
        return Err(fault.hint("only `--suite trust` takes more").into());
    }
    let disk = Disk::default();
    let (mut set, text) = scenes(args, &disk)?;
    let suite = Suite::of(&set);
    let files = RobotText::read(args, suite, &set.file, &disk)?;
    if suite.is_some() {
        // A suite's limits of joints are those of the robot that it was made for.
        let own = files.model(&LimitsSpec::default(), &disk)?;
        set.limits.joints.retain(|name, _| own.joints.iter().any(|j| j.name == *name));
    }
    let loaded = Loaded::new(files, &set, &disk)?;
    set.fits(&loaded.robot, &text.text)?;
    if let Some(path) = &args.write_scenes {
        output::write_file(path, text.text.as_bytes())?;
    }
    let writer = args.write_commands.as_deref().map(|folder| Writer::new(folder, &set, &text, &loaded));
    let variants = suite.map_or(Vec::new(), Suite::variants);
    let bar = progress(terminal, (1 + variants.len()) * set.scenes.len());
    let plots = args.plot.clone().or_else(|| suite.filter(|s| s.is_figure()).map(|_| PathBuf::from("out")));
    if let Some(folder) = &plots {
        output::make_folder(folder)?;
    }
    let mut drawn = Vec::new();
    let mut run = |options: &CompileOptions, writer: Option<&Writer<'_>>| -> Result<Vec<Judged>, Diagnostics> {
        let judge = |scene| {
            let (judged, outcome) = eval::judge(&set, scene, &loaded.robot, options)?;
            if let Some((folder, name)) = plots.as_deref().zip(eval::picture_name(scene, suite, options)) {
                let path = folder.join(name);
                let picture = eval::picture(&set, scene, suite, &loaded.robot, &outcome)?;
                output::write_file(&path, picture.as_bytes())?;
                drawn.push(path);
            }
            if let Some(writer) = writer {
                writer.write(&judged, outcome)?;
            }
            bar.inc(1);
            Ok(judged)
        };
        set.scenes.iter().map(judge).collect()
    };
    let usual = CompileOptions { parameterisation: args.parameterisation, ..Default::default() };
    let judged = run(&usual, writer.as_ref())?;
    let variants = variants.iter().map(|options| run(options, None)).collect::<Result<Vec<_>, _>>()?;
    bar.finish_and_clear();
    if args.json {
        terminal.print(&figures::document(&set, suite, &judged, &variants));
        return Ok(0);
    }
    let mut out = tables::render(suite, &judged, &variants) + "\n" + &tables::render_totals(&judged);
    match &drawn[..] {
        [] => {}
        few if few.len() <= 4 => few.iter().for_each(|path| out += &format!("picture: {}\n", path.display())),
        many => out += &format!("pictures: {} in {}\n", many.len(), plots.unwrap_or_default().display()),
    }
    if args.profile {
        out += &format!("\n{}", tables::render_profile(&judged));
    }
    terminal.print(&out);
    Ok(0)
}

/// The set, and the text it was read from.
fn scenes(args: &EvalArgs, disk: &Disk) -> Result<(SceneSet, TextFile), Diagnostics> {
    let count = args.count.map(|n| n as usize);
    let text = match (&args.scenes, args.scene_suite()) {
        (Some(path), _) => {
            if std::fs::metadata(path).is_ok_and(|m| m.len() > eval::LONGEST as u64) {
                let message = format!("scenes of more than {} MiB", eval::LONGEST >> 20);
                let hint = "split the file: scenes do not depend on each other";
                return Err(Diagnostic::error("scenes/too-long", message)
                    .file(path.display().to_string())
                    .hint(hint)
                    .into());
            }
            disk.text(path, None)?
        }
        (None, suite) => {
            let suite = suite.unwrap_or(Suite::Table1);
            let name = match &args.write_scenes {
                Some(path) => path.display().to_string(),
                None => format!("{} --seed {}", suite.name(), args.seed.unwrap_or(1)),
            };
            TextFile { name, text: generate(args, suite, count.unwrap_or(eval::default_count(suite)), disk)? }
        }
    };
    let mut set = eval::read(&text.name, &text.text)?;
    if args.scenes.is_some() {
        set.scenes.truncate(count.unwrap_or(usize::MAX));
    }
    Ok((set, text))
}

fn generate(args: &EvalArgs, suite: Suite, count: usize, disk: &Disk) -> Result<String, Diagnostics> {
    if suite.is_figure() && (args.seed.is_some() || args.count.is_some()) {
        let message = format!("{} is one fixed scene: `--count` and `--seed` have no meaning", suite.name());
        return Err(Diagnostic::error("eval/fixed", message).hint("leave `--count` and `--seed` out").into());
    }
    if !args.boxes.is_empty() && suite != Suite::Table3 {
        let message = format!("`--boxes` is for table3; {} has its own number", suite.name());
        return Err(Diagnostic::error("eval/boxes", message).hint("leave `--boxes` out").into());
    }
    let seed = args.seed.unwrap_or(1);
    if suite == Suite::Arm {
        let robot = RobotText::read(args, Some(suite), "", disk)?.model(&LimitsSpec::default(), disk)?;
        return eval::arm::document(&robot, count, seed).map_err(|kind| {
            let message = format!(
                "found no room with {} where `{}` has free poses and a way between them",
                kind.name(),
                robot.name
            );
            Diagnostic::error("eval/arm", message)
                .hint("is the robot larger than a passage of 1 m? `trajc inspect` shows its size")
                .into()
        });
    }
    let mut boxes: Vec<usize> = args.boxes.iter().map(|n| usize::from(*n)).collect();
    boxes.sort_unstable();
    boxes.dedup();
    let boxes = if boxes.is_empty() { eval::default_boxes(suite) } else { &boxes };
    eval::document(suite, boxes, count, seed).map_err(|boxes| {
        let message = format!("found no room for {boxes} boxes and a way between them");
        Diagnostic::error("eval/boxes", message).hint("ask for fewer with `--boxes`").into()
    })
}

/// A robot's files.
struct RobotText {
    /// As the command header names it.
    name: String,
    files: inputs::RobotFiles,
}

impl RobotText {
    /// The robot that was asked for, else the suite's own. `file`: where the scenes are from, for messages.
    fn read(args: &EvalArgs, suite: Option<Suite>, file: &str, disk: &Disk) -> Result<Self, Diagnostics> {
        let (name, files) = match (&args.robot, suite) {
            (Some(path), _) => {
                let path = robot_file(path)?;
                (path.display().to_string(), inputs::read_robot_files(&path, disk, None)?)
            }
            (None, Some(Suite::Arm)) => built_in(&ARM7)?,
            (None, Some(suite)) if suite.has_blades() => built_in(&SCR_DB)?,
            (None, Some(_)) => built_in(&BOX_BASE)?,
            (None, None) => {
                let message = "these scenes belong to no suite by their `name`, so they need `--robot`";
                let hint = "for example `--robot robots/scr_db`";
                return Err(Diagnostic::error("eval/no-robot", message).file(file).hint(hint).into());
            }
        };
        Ok(Self { name, files })
    }

    /// The robot with these limits over its own.
    fn model(&self, overrides: &LimitsSpec, disk: &Disk) -> Result<RobotModel, Diagnostics> {
        let (spec, _, urdf) = &self.files;
        let mut files: Box<dyn Files> = Box::new(disk.clone());
        robot::parse(RobotInputs { spec, urdf: (&urdf.name, &urdf.text), files: files.as_mut(), overrides })
    }
}

/// The robot with the set's limits, and what it was read from.
struct Loaded {
    robot: RobotModel,
    /// As the command header names it.
    name: String,
    inputs: Vec<InputFile>,
}

impl Loaded {
    fn new(text: RobotText, set: &SceneSet, disk: &Disk) -> Result<Self, Diagnostics> {
        let robot = text.model(&set.limits, disk)?;
        let (_, yaml, urdf) = &text.files;
        let inputs = yaml.iter().chain([urdf]).map(|f| InputFile::new(f.name.clone(), f.text.as_bytes())).collect();
        Ok(Self { robot, name: text.name, inputs })
    }
}

/// A folder means its robot.yaml, or the one URDF in it.
fn robot_file(path: &Path) -> Result<PathBuf, Diagnostics> {
    if !path.is_dir() {
        return Ok(path.to_path_buf());
    }
    let yaml = path.join("robot.yaml");
    if yaml.is_file() {
        return Ok(yaml);
    }
    let urdf = |p: &PathBuf| p.extension().is_some_and(|e| e.eq_ignore_ascii_case("urdf"));
    let entries = std::fs::read_dir(path).into_iter().flatten().flatten();
    let found: Vec<PathBuf> = entries.map(|e| e.path()).filter(urdf).collect();
    match &found[..] {
        [one] => Ok(one.clone()),
        _ => {
            let message = format!("folder `{}` has no robot.yaml and {} .urdf files", path.display(), found.len());
            Err(Diagnostic::error("eval/robot-folder", message).hint("name the robot's file").into())
        }
    }
}

fn built_in([name, yaml, urdf]: &[&str; 3]) -> Result<(String, inputs::RobotFiles), Diagnostics> {
    let file = |name: String, text: &str| TextFile { name, text: text.to_owned() };
    let yaml = file(format!("robots/{name}/robot.yaml"), yaml);
    let parsed = spec::parse(&yaml.name, &yaml.text)?;
    let urdf = file(format!("robots/{name}/{name}.urdf"), urdf);
    Ok((yaml.name.clone(), (parsed, Some(yaml), urdf)))
}

/// A bar on a terminal; nothing elsewhere.
fn progress(terminal: &Terminal, scenes: usize) -> ProgressBar {
    if terminal.quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(scenes as u64);
    let style = ProgressStyle::with_template("{wide_bar} {pos}/{len} scenes, {eta} left");
    bar.set_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()));
    bar
}

/// Writes commands and reports of certified scenes, and removes older ones of those that failed.
struct Writer<'a> {
    folder: &'a Path,
    set: &'a SceneSet,
    robot: String,
    hash: String,
    inputs: InputsPart,
}

impl<'a> Writer<'a> {
    fn new(folder: &'a Path, set: &'a SceneSet, text: &TextFile, loaded: &Loaded) -> Self {
        let scenes = InputFile::new(text.name.clone(), text.text.as_bytes());
        let mut hasher = blake3::Hasher::new();
        for file in std::iter::once(&scenes).chain(&loaded.inputs) {
            hasher.update(file.blake3.as_bytes());
        }
        let (robot, other) = match loaded.inputs.split_first() {
            Some((first, rest)) => (Some(first.clone()), rest.to_vec()),
            None => (None, Vec::new()),
        };
        let inputs = InputsPart { mission: scenes, robot, map: None, other };
        Self { folder, set, robot: loaded.name.clone(), hash: hasher.finalize().to_hex().to_string(), inputs }
    }

    fn write(&self, judged: &Judged, mut outcome: Outcome) -> Result<(), Diagnostics> {
        let Some(compiled) = &outcome.compiled else {
            return Ok(output::discard(self.folder, &judged.id)?);
        };
        let mission = format!("{}#{}", self.set.file, judged.id);
        let header = CsvHeader {
            mission: mission.clone(),
            robot: self.robot.clone(),
            map: None,
            inputs_blake3: self.hash.clone(),
        };
        let commands = csv::write(&compiled.commands, &header);
        outcome.report.inputs = self.inputs.clone();
        outcome.report.inputs.mission.path = mission;
        let report = outcome.report.to_json();
        let files = [("commands.csv", commands.as_bytes()), ("report.json", report.as_bytes())];
        output::publish(self.folder, &judged.id, &files)?;
        Ok(())
    }
}
