//! One mission of a build, from its file to its folder.

use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;
use std::time::Instant;

use super::find::Found;
use super::hashes::Hashes;
use super::schedule::{Job, MapKey, Schedule, Shared, map_key};
use super::state::{self, Ended, Making, State};
use crate::cli::inputs::{self, Disk};
use crate::cli::output;
use crate::cli::products::{ProductArgs, Products, publish};
use crate::diag::{Diagnostic, Diagnostics, Severity};
use crate::pipeline::{self, Inputs, World};
use crate::report::schema::{InputFile, InputsPart};

/// What all missions of a build have in common.
pub struct Site<'a> {
    /// What to write, and where.
    pub args: &'a ProductArgs,
    /// The folder in which the program was started.
    pub start: PathBuf,
    /// What beside its files decides what is written of a mission.
    pub making: Making,
    /// Of all files.
    pub hashes: Arc<Hashes>,
    /// Who shares a map with whom.
    pub schedule: Schedule,
}

/// How a mission ended that was compiled.
#[derive(Debug, Clone, PartialEq)]
pub struct Made {
    /// In short.
    pub ended: Ended,
    /// Why it failed, in full.
    pub diagnostics: Option<Diagnostics>,
}

/// A mission's robot and map, and the files that they were read from.
struct There {
    disk: Disk,
    inputs: Inputs,
    named: InputsPart,
    world: World,
    /// Stages and milliseconds.
    timings: Vec<(&'static str, f64)>,
}

impl Site<'_> {
    /// Compiles a mission and writes its folder.
    ///
    /// # Errors
    /// Bad input, or the folder cannot be written; older files of the mission are then removed.
    pub fn make(&self, job: &Job, mission: &Found) -> Result<Made, Diagnostics> {
        self.compile(job, mission).map_err(|mut faults| {
            self.discard(mission, &mut faults);
            faults
        })
    }

    /// Removes what is left of a mission, commands above all; adds to what is wrong with it that they cannot be removed.
    pub fn discard(&self, mission: &Found, faults: &mut Diagnostics) {
        if let Err(error) = output::discard(&self.args.out, &mission.name) {
            // It may be why nothing could be written, too.
            let more = Diagnostics::from(error).0.into_iter().filter(|d| !faults.0.contains(d));
            faults.0.extend(more.collect::<Vec<_>>());
        }
    }

    fn compile(&self, job: &Job, mission: &Found) -> Result<Made, Diagnostics> {
        if let Some((_, file)) = &job.after
            && !self.start.join(file).is_file()
        {
            let message =
                format!("it starts where `{}` ends, which another mission of this build has not made", file.display());
            let hint = "the message about that mission says why it has no commands";
            return Err(Diagnostic::failure("build/no-start", message)
                .file(mission.path.display().to_string())
                .hint(hint)
                .into());
        }
        let There { disk, inputs, named, world, timings } = self.world(job.map.as_ref(), mission)?;
        let outcome = pipeline::compile_on(&inputs, named, world, &self.args.options(), &mut |_| {});
        if let Some(faults) = outcome.diagnostics.as_ref().filter(|d| d.severity() == Severity::BadInput) {
            return Err(faults.clone());
        }
        let (path, name) = (&mission.path, &mission.name);
        let products = Products { args: self.args, path, name, inputs: &inputs, disk: &disk, outcome: &outcome };
        let mut files = products.files(&timings)?;
        let ended = Ended::from(&outcome.report);
        let state = State::new(path, &self.start, &self.making, &disk, &files, ended.clone());
        files.push((state::FILE, state.to_json().into_bytes()));
        publish(&self.args.out, name, &files, outcome.compiled.is_some())?;
        state.wrote(&self.args.out.join(name), &self.start, &self.hashes);
        Ok(Made { ended, diagnostics: outcome.diagnostics })
    }

    /// Reads a mission and all that it names; the map of this key only where no other mission has.
    fn world(&self, map: Option<&MapKey>, mission: &Found) -> Result<There, Diagnostics> {
        let hashes = self.hashes.clone();
        let disk = Disk::through(Rc::new(move |path: &Path| hashes.read(path)));
        let ms = |started: Instant| started.elapsed().as_secs_f64() * 1e3;
        let started = Instant::now();
        let shared = RefCell::new(None);
        let mut inputs = inputs::read_with(&mission.path, &disk, &|mission, path| {
            // The mission may have been edited since it was planned; then its map is its own.
            let key = map.filter(|key| map_key(mission, &path).as_ref() == Some(key));
            let ready = key.and_then(|key| self.schedule.ready(key));
            if let Some(Shared { files, absent, .. }) = &ready {
                files.iter().for_each(|(path, hash)| disk.know(path, *hash));
                absent.iter().for_each(|path| disk.miss(path));
            }
            let read = ready.is_none().then_some(path);
            *shared.borrow_mut() = ready;
            Ok(read)
        })?;
        // Of the map alone so far: meshes come with the robot.
        let absent = disk.absent();
        let mut timings = vec![("read_files", ms(started))];
        let started = Instant::now();
        let mut named = pipeline::inputs_part(&inputs);
        let mut world = pipeline::world(&mut inputs)?;
        timings.push(("read", ms(started)));
        if let Some(shared) = shared.into_inner() {
            let height = world.robot.top_over_all_postures();
            if shared.height.is_some_and(|made_for| made_for.to_bits() != height.to_bits()) {
                // The robot's file changed while its missions were compiled.
                return self.world(None, mission);
            }
            take_over(shared, &inputs, &mut named, &mut world);
        } else if let Some(key) = map.filter(|key| self.schedule.wanted(key)) {
            let started = Instant::now();
            self.hand_on(key, &inputs, &world, &disk, absent);
            timings.push(("shared_map", ms(started)));
        }
        // The points are cells by now; those of a large map are not carried along.
        inputs.map = None;
        Ok(There { disk, inputs, named, world, timings })
    }

    /// Builds the field of a map that others wait for, and lets them have both.
    fn hand_on(&self, key: &MapKey, inputs: &Inputs, world: &World, disk: &Disk, absent: Vec<PathBuf>) {
        let (mission, read) = (&inputs.mission, disk.files());
        let (Some(place), Some(file), Some(spec)) = (&world.map, &inputs.map, &mission.map) else { return };
        // Another one, where the mission has been edited since it was planned.
        if map_key(mission, Path::new(&file.name)).as_ref() != Some(key) {
            return;
        }
        if mission.path.is_none() && place.has_room().is_ok() {
            place.field(1);
        }
        let names = std::iter::once(&file.name).chain(file.beside.as_ref().map(|(name, _)| name));
        let files = names.filter_map(|name| read.iter().find(|(path, _)| path == Path::new(name)).cloned()).collect();
        let height = spec.ends_at_the_robot().then(|| world.robot.top_over_all_postures());
        self.schedule.offer(key, Shared { place: place.clone(), files, absent, height });
    }
}

/// Gives a mission the map that others are compiled on.
fn take_over(shared: Shared, inputs: &Inputs, named: &mut InputsPart, world: &mut World) {
    let hash = |(path, hash): &(PathBuf, blake3::Hash)| (path.display().to_string(), hash.to_hex().to_string());
    let mut files = shared.files.iter().map(hash);
    // As `inputs_part` would: the map as the mission spells it, the file beside it last.
    named.map = inputs.mission.map.as_ref().zip(files.next()).map(|(spec, (_, blake3))| {
        let path = spec.file.display().to_string();
        InputFile { path, blake3 }
    });
    named.other.extend(files.map(|(path, blake3)| InputFile { path, blake3 }));
    world.map = Some(shared.place);
}
