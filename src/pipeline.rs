//! `compile()`: every stage, in order. Read this file first.

mod attempts;
mod check;
mod ends;
mod goals;
mod place;
mod plan;
mod refusal;
mod stops;
mod world;

pub use attempts::OPTIMISER_MARGINS;
pub use check::{check, path_error_of_commands, trust};
pub use place::Place;
pub use plan::SEARCH_MARGIN;
pub use world::world;

use std::time::Instant;

use crate::certify::{self, Certificate, Demands, LinkGoal, Task, Trust};
use crate::command::{self, CommandTable, SampleOptions};
use crate::diag::{Describe, Diagnostic, Diagnostics};
use crate::map::VoxelMap;
use crate::mission::{Mission, Parameterisation, TimeLaw};
use crate::report::schema::{InputFile, InputsPart, ProfilePart, TrajectoryPart};
use crate::report::{Report, metrics, path_error};
use crate::retime::{self, MotionProfile, RetimeOptions};
use crate::robot::{Files, RobotModel, spec::RobotSpec};
use crate::trajectory::{Trajectory, TrajectorySource};
use ends::{end_of, given_path, goal, link_goal, start_of};
use refusal::refused;

/// A text file that was read.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TextFile {
    /// Path as the user knows it.
    pub name: String,
    /// All of it.
    pub text: String,
}

/// A map file that was read, and the one beside it.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MapFile {
    /// Path as the user knows it.
    pub name: String,
    /// All of it.
    pub bytes: Vec<u8>,
    /// Path and bytes of map_server's image, or of `.npy`'s `.json`.
    pub beside: Option<(String, Vec<u8>)>,
}

/// A command file that was read, where whose motion ends another one starts.
#[derive(Debug, Clone, PartialEq)]
pub struct StartFile {
    /// Path as the user knows it.
    pub name: String,
    /// All of it.
    pub bytes: Vec<u8>,
    /// Its commands.
    pub table: CommandTable,
}

/// Everything a mission names, read. (`cli` reads; no stage opens a file but meshes through `files`.)
pub struct Inputs {
    /// Parsed.
    pub mission: Mission,
    /// Its text.
    pub mission_text: TextFile,
    /// robot.yaml, parsed; default where the mission names a bare URDF.
    pub robot_spec: RobotSpec,
    /// robot.yaml's text.
    pub robot_yaml: Option<TextFile>,
    /// The URDF.
    pub urdf: TextFile,
    /// The map.
    pub map: Option<MapFile>,
    /// `path: {file}`.
    pub path_csv: Option<TextFile>,
    /// `start: {file}`.
    pub start_file: Option<StartFile>,
    /// Reader for meshes.
    pub files: Box<dyn Files>,
}

/// What may differ from the mission.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CompileOptions {
    /// Instead of the mission's, s.
    pub sampling_time: Option<f64>,
    /// Instead of the mission's.
    pub parameterisation: Option<Parameterisation>,
    /// Dense sampling in the optimiser (\[SCR\] section IV-C). Default true.
    pub dense: bool,
    /// Turns that are better made on the spot stay so. False: every turn is part of a smooth curve, as in \[SCR\]. Default true.
    pub spins: bool,
    /// Also find the largest sampling time with which commands leave the path by no more than this, m. Default: no.
    pub max_error: Option<f64>,
    /// Say how far the commands can be trusted without feedback, by a tolerance that is assumed where none is given. Default true.
    pub trust: bool,
    /// Threads for the distance field of a large map; the result is the same with any number. Default 1.
    pub threads: usize,
}

impl Default for CompileOptions {
    fn default() -> Self {
        Self {
            sampling_time: None,
            parameterisation: None,
            dense: true,
            spins: true,
            max_error: None,
            trust: true,
            threads: 1,
        }
    }
}

/// How a run of a mission ended.
pub struct Outcome {
    /// Always there; says `failed` and why where there are no commands.
    pub report: Report,
    /// What the commands are and rest on; `None`: failed.
    pub compiled: Option<Compiled>,
    /// Why it failed, in full.
    pub diagnostics: Option<Diagnostics>,
    /// Stage and milliseconds, in order.
    pub timings: Vec<(&'static str, f64)>,
    /// What can be shown of the run, however it ended.
    pub traces: Traces,
}

/// What a run leaves behind beside its figures, for pictures: as far as it got.
#[derive(Default)]
pub struct Traces {
    /// Robot and map ([`compile`] only: of [`compile_in`] the caller has them).
    pub world: Option<World>,
    /// Places of the base on the search's path, m.
    pub route: Vec<[f64; 2]>,
    /// Commands that the certificate refused.
    pub refused: Option<CommandTable>,
    /// How far the commands, certified or refused, can be trusted; with the tube.
    pub trust: Option<Trust>,
}

/// A certified motion.
pub struct Compiled {
    /// The robot, with the mission's limits.
    pub robot: RobotModel,
    /// What the commands follow.
    pub trajectory: Trajectory,
    /// The commands.
    pub commands: CommandTable,
    /// The proof.
    pub certificate: Certificate,
    /// Where [`CompileOptions::max_error`] asks: the largest sampling time for each of the mission's samplings.
    pub within: Vec<path_error::Within>,
}

/// What a mission's text and files mean, before anything is planned.
pub struct World {
    /// The robot, with the mission's limits.
    pub robot: RobotModel,
    /// Where the obstacles are.
    pub map: Option<Place>,
}

/// Collects figures while the stages run.
struct Run<'a> {
    report: Report,
    timings: Vec<(&'static str, f64)>,
    traces: Traces,
    progress: &'a mut dyn FnMut(&'static str),
}

impl<'a> Run<'a> {
    fn new(inputs: InputsPart, progress: &'a mut dyn FnMut(&'static str)) -> Self {
        Self { report: Report::new(inputs), timings: Vec::new(), traces: Traces::default(), progress }
    }

    /// Runs one stage and notes its time.
    fn stage<T>(&mut self, name: &'static str, work: impl FnOnce() -> T) -> T {
        (self.progress)(name);
        let started = Instant::now();
        let out = work();
        let spent = started.elapsed().as_secs_f64() * 1e3;
        match self.timings.iter_mut().find(|(known, _)| *known == name) {
            Some((_, sum)) => *sum += spent,
            None => self.timings.push((name, spent)),
        }
        out
    }

    fn end(self, result: Result<Compiled, Diagnostics>) -> Outcome {
        let Run { mut report, timings, traces, .. } = self;
        match result {
            Ok(compiled) => Outcome { report, compiled: Some(compiled), diagnostics: None, timings, traces },
            Err(diagnostics) => {
                report.fail(&diagnostics);
                Outcome { report, compiled: None, diagnostics: Some(diagnostics), timings, traces }
            }
        }
    }
}

/// Compiles one mission. `progress` is told the name of each stage as it begins.
pub fn compile(inputs: &mut Inputs, options: &CompileOptions, progress: &mut dyn FnMut(&'static str)) -> Outcome {
    let mut run = Run::new(inputs_part(inputs), progress);
    let world = run.stage("read", || world(inputs));
    compile_there(run, inputs, world, options)
}

/// The same of a mission whose robot and map are there already, as [`world`] makes them; `named`: the files, for the report.
pub fn compile_on(
    inputs: &Inputs,
    named: InputsPart,
    world: World,
    options: &CompileOptions,
    progress: &mut dyn FnMut(&'static str),
) -> Outcome {
    compile_there(Run::new(named, progress), inputs, Ok(world), options)
}

fn compile_there(
    mut run: Run<'_>,
    inputs: &Inputs,
    world: Result<World, Diagnostics>,
    options: &CompileOptions,
) -> Outcome {
    let result = world.and_then(|world| {
        let trajectory = match &inputs.mission.path {
            Some(path) => given_path(&inputs.mission, path, inputs.path_csv.as_ref(), &world.robot).map(Some),
            None => Ok(None),
        };
        let result = trajectory.and_then(|trajectory| stages(&mut run, &inputs.mission, &world, trajectory, options));
        run.traces.world = Some(world);
        result
    });
    run.end(result)
}

/// Compiles a mission whose robot and map are there already: the map (or a given path) is the caller's, files that the mission
/// names are not looked at. For suites of many scenes.
pub fn compile_in(mission: &Mission, world: &World, options: &CompileOptions) -> Outcome {
    let mut nobody = |_| {};
    let mut run = Run::new(InputsPart::default(), &mut nobody);
    let result = stages(&mut run, mission, world, None, options);
    run.end(result)
}

fn stages(
    run: &mut Run<'_>,
    mission: &Mission,
    world: &World,
    given: Option<Trajectory>,
    options: &CompileOptions,
) -> Result<Compiled, Diagnostics> {
    let sampling_time = options.sampling_time.unwrap_or(mission.sampling_time);
    let World { robot, map } = world;
    run.report.robot = Some(robot.into());
    run.report.map = map.as_deref().map(Into::into);
    let link = link_goal(mission, robot);
    let finish = Finish { mission, robot, map: map.as_deref(), sampling_time, link };
    let made = match (given, map) {
        (Some(trajectory), _) => finish.certify(run, trajectory)?,
        (None, Some(map)) => plan::plan(run, &finish, map, options)?,
        (None, None) => {
            let message = "the mission has neither a map nor a path of its own";
            return Err(Diagnostic::error("mission/no-map", message).into());
        }
    };
    let Made { profile, commands, certificate, trajectory } = made;
    let own = match trajectory.source {
        TrajectorySource::Optimised => metrics::of_trajectory(&trajectory, robot),
        _ => metrics::of_commands(&commands),
    };
    run.report.trajectory = Some(TrajectoryPart::new(&trajectory, Some(own)));
    run.report.profile = Some(profile_part(&profile, &commands));
    run.report.commands = Some((&commands).into());
    run.report.judge(&certificate);
    // With a tolerance in force, certified commands can be trusted to their end, and a refusal says where they cannot.
    if options.trust && (certificate.holds() || robot.tolerance.is_some()) {
        let task = finish.task(&trajectory);
        let trust = run.stage("trust", || check::trust_in(world, &commands, &task));
        (run.traces.trust, run.report.trust) = trust.unzip();
    }
    if !certificate.holds() {
        run.traces.refused = Some(commands);
        // A given path is what is wrong with the mission then; otherwise no line is.
        let spans = &mission.spans;
        let path = spans.path_file.as_ref().or(spans.path.as_ref());
        return Err(refused(&certificate, trajectory.source).maybe_at(path).into());
    }
    if !mission.path_error_times.is_empty() {
        let rows = run.stage("path_error", || {
            let known = (&commands, certificate.clearance_proven);
            finish.path_errors(&profile, &trajectory, known)
        });
        run.report.path_error = rows?;
    }
    let within = match options.max_error {
        Some(bound) => run.stage("max_error", || finish.within(&profile, &trajectory, bound))?,
        None => Vec::new(),
    };
    Ok(Compiled { robot: robot.clone(), trajectory, commands, certificate, within })
}

/// A trajectory timed, sampled and judged.
struct Made {
    trajectory: Trajectory,
    profile: MotionProfile,
    commands: CommandTable,
    certificate: Certificate,
}

/// What comes after planning: time law, sampling, proof, path error.
struct Finish<'a> {
    mission: &'a Mission,
    robot: &'a RobotModel,
    map: Option<&'a VoxelMap>,
    sampling_time: f64,
    /// Where a link must be at the end.
    link: Option<LinkGoal>,
}

impl Finish<'_> {
    /// The judged motion; its certificate may refuse.
    fn certify(&self, run: &mut Run<'_>, trajectory: Trajectory) -> Result<Made, Diagnostics> {
        let task = self.task(&trajectory);
        self.certify_task(run, trajectory, &task)
    }

    /// The same of a task that is not the mission's.
    fn certify_task(&self, run: &mut Run<'_>, trajectory: Trajectory, task: &Task) -> Result<Made, Diagnostics> {
        let (profile, commands) = self.commands(run, &trajectory)?;
        // Of a mission with stops only the last stretch leads there, which the proof of the whole looks at.
        let link = self.link.as_ref().filter(|_| self.mission.via.is_empty());
        let demands = Demands { vias: &[], zones: self.mission.speed_zones(), link };
        let certificate =
            run.stage("certify", || certify::certify_through(&commands, self.robot, self.map, task, demands));
        Ok(Made { trajectory, profile, commands, certificate })
    }

    /// A trajectory timed and sampled.
    fn commands(
        &self,
        run: &mut Run<'_>,
        trajectory: &Trajectory,
    ) -> Result<(MotionProfile, CommandTable), Diagnostics> {
        let options = RetimeOptions { law: self.law(trajectory), sampling_time: self.sampling_time };
        let profile =
            run.stage("retime", || retime::retime_in(trajectory, self.robot, &options, self.mission.speed_zones()));
        let profile = profile.map_err(|error| error.diagnostic().maybe_at(self.mission.spans.time_law.as_ref()))?;
        let options = SampleOptions { sampling_time: self.sampling_time, sampling: self.mission.sampling };
        let commands = run.stage("command", || command::sample(&profile, self.robot, &options))?;
        Ok((profile, commands))
    }

    /// The mission's time law, where it can time this trajectory.
    fn law(&self, trajectory: &Trajectory) -> TimeLaw {
        match (self.mission.time_law, trajectory.source) {
            // The search's path has no timing of its own.
            (TimeLaw::Minco, TrajectorySource::Search) => TimeLaw::Auto,
            (law, _) => law,
        }
    }

    fn task(&self, trajectory: &Trajectory) -> Task {
        let (start, start_joints) = start_of(trajectory);
        let given_end = self.mission.path.as_ref().map(|_| end_of(trajectory));
        let goal = goal(self.mission, self.robot, given_end);
        Task { start, start_joints, goal, clearance: self.mission.clearance, reverse: self.mission.reverse }
    }

    /// `known`: a table whose clearance is proven already.
    fn path_errors(
        &self,
        profile: &MotionProfile,
        trajectory: &Trajectory,
        known: (&CommandTable, Option<f64>),
    ) -> Result<Vec<crate::report::PathErrorRow>, Diagnostics> {
        let task = self.task(trajectory);
        let clearance = |table: &CommandTable| if table == known.0 { known.1 } else { self.clearance(table, &task) };
        let (times, samplings) = (&self.mission.path_error_times, &self.mission.path_error_samplings);
        let rows = path_error::path_errors(profile, self.robot, times, samplings, clearance)?;
        Ok(rows.iter().map(Into::into).collect())
    }

    fn within(
        &self,
        profile: &MotionProfile,
        trajectory: &Trajectory,
        bound: f64,
    ) -> Result<Vec<path_error::Within>, Diagnostics> {
        let task = self.task(trajectory);
        let of = |sampling: &crate::mission::Sampling| {
            let clearance = |table: &CommandTable| self.clearance(table, &task);
            Ok(path_error::within(profile, self.robot, *sampling, bound, clearance)?)
        };
        self.mission.path_error_samplings.iter().map(of).collect()
    }

    fn clearance(&self, table: &CommandTable, task: &Task) -> Option<f64> {
        self.map.map(|map| certify::clearance_proven(table, self.robot, map, task))
    }
}

fn profile_part(profile: &MotionProfile, commands: &CommandTable) -> ProfilePart {
    ProfilePart {
        time_law: profile.law_name(),
        // As sampled: sampling may slow down a little more.
        time_s: commands.duration(),
        v_max_mps: Some(profile.v_max()),
        v_comp_mps: Some(profile.v_comp()),
    }
}

/// The files that a mission names, as its report lists them.
pub fn inputs_part(inputs: &Inputs) -> InputsPart {
    let mission = &inputs.mission;
    let file = |path: &str, bytes: &[u8]| InputFile::new(path, bytes);
    let robot = inputs.robot_yaml.as_ref().unwrap_or(&inputs.urdf);
    let mut other = Vec::new();
    if inputs.robot_yaml.is_some() {
        other.push(file(&inputs.urdf.name, inputs.urdf.text.as_bytes()));
    }
    other.extend(inputs.start_file.iter().map(|f| file(&f.name, &f.bytes)));
    other.extend(inputs.path_csv.iter().map(|f| file(&f.name, f.text.as_bytes())));
    let map = inputs.map.as_ref();
    other.extend(map.and_then(|m| m.beside.as_ref()).map(|(name, bytes)| file(name, bytes)));
    InputsPart {
        mission: file(&inputs.mission_text.name, inputs.mission_text.text.as_bytes()),
        robot: Some(file(&mission.robot.display().to_string(), robot.text.as_bytes())),
        map: mission.map.as_ref().zip(map).map(|(spec, m)| file(&spec.file.display().to_string(), &m.bytes)),
        other,
    }
}
