//! Optimising one path, try after try, until a motion is certified.

use super::{CompileOptions, Finish, Made, Place, Run};
use crate::certify::{self, Demands, Task};
use crate::command::CommandTable;
use crate::diag::Diagnostics;
use crate::geom::Pose2;
use crate::mission::{Parameterisation, Tolerance};
use crate::optimize::slack::{Slack, Slackened, Slacks};
use crate::optimize::{self, OptimizeOptions};
use crate::robot::RobotModel;
use crate::search::SearchPath;
use crate::trajectory::Trajectory;

/// Clearance beyond what must be certified that the optimiser aims at, m, one try after the other.
pub const OPTIMISER_MARGINS: [f64; 3] = [0.01, 0.02, 0.04];
/// The same at first where the optimiser looks at a motion only now and then.
const FIRST_MARGIN: f64 = 0.013;

/// What a motion has missed of its clearance is asked for so many times over by the next tries: between its nodes the distance field
/// says up to a quarter of a cell too much.
const MISSED_TIMES: f64 = 1.5;
/// What counts of it at most, m.
const MISSED_MOST: f64 = 0.015;
/// Distance below which a motion runs through an obstacle rather than too near it, m.
const DEEP: f64 = -0.05;

/// A motion that is still too narrow for the tolerance is tried again while that gains so much, m, once in so many tries.
const GAINED: f64 = 1e-3;
const IDLE: usize = 3;

/// How many tries mostly succeed.
const SOON: usize = 3;

/// Which tries of the optimiser.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Tries {
    /// Those that mostly succeed.
    Soon,
    /// The others.
    Late,
    All,
}

/// How a try of the optimiser goes about it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Look {
    /// From the path.
    First,
    /// More closely, from the motion of the try before.
    Again,
    /// More closely, from the path.
    Closer,
}

impl Tries {
    /// Of a parameterisation that is asked for: what to optimise, with how much margin (m), and how.
    fn of(self, asked: Parameterisation) -> Vec<(Parameterisation, f64, Look)> {
        // Where one parameterisation fails at every margin, the other may not.
        let other = (asked == Parameterisation::ArcLength).then_some(Parameterisation::Flat);
        // A motion that misses its clearance by little is looked at more closely, then from the beginning, then asked for more.
        let of = |p: Parameterisation| match p {
            Parameterisation::Flat => OPTIMISER_MARGINS.map(|margin| (p, margin, Look::First)).to_vec(),
            Parameterisation::ArcLength => {
                let closer = OPTIMISER_MARGINS.map(|margin| (p, margin, Look::Closer));
                [(p, FIRST_MARGIN, Look::First), (p, FIRST_MARGIN, Look::Again)].into_iter().chain(closer).collect()
            }
        };
        let mut all: Vec<_> = [asked].into_iter().chain(other).flat_map(of).collect();
        let late = all.split_off(SOON.min(all.len()));
        match self {
            Self::Soon => all,
            Self::Late => late,
            Self::All => [all, late].concat(),
        }
    }
}

/// A motion that nothing but the tolerance refuses, and by how much it misses that, m.
pub(super) struct Nearest {
    short: f64,
    made: Box<Made>,
}

/// What a stretch has behind it: commands from the mission's start on.
pub(super) struct Since {
    /// Where they start.
    pub(super) start: (Pose2, Vec<f64>),
    /// They end at rest.
    pub(super) commands: CommandTable,
}

impl Since {
    /// These commands and a stretch's, as one, with the task of both.
    fn with(&self, stretch: &CommandTable, task: &Task) -> (CommandTable, Task) {
        let mut whole = self.commands.clone();
        whole.rows.pop();
        whole.rows.extend_from_slice(&stretch.rows);
        (whole, Task { start: self.start.0, start_joints: self.start.1.clone(), ..task.clone() })
    }
}

/// How far robots may be off along commands from row `first` on.
fn slacks(
    commands: &CommandTable,
    robot: &RobotModel,
    task: &Task,
    tolerance: Tolerance,
    first: usize,
) -> Option<Slacks> {
    let tube = certify::tube_along(commands, robot, task, tolerance);
    Slacks::along(tube.into_iter().skip(first).map(|point| Slack {
        place: point.place,
        drift: point.drift,
        turning: point.turning,
        anywhere: point.anywhere + point.late,
    }))
}

/// What paths are optimised for.
pub(super) struct Attempts<'a> {
    pub(super) finish: &'a Finish<'a>,
    pub(super) map: &'a Place,
    pub(super) compile: &'a CompileOptions,
    /// What a motion is certified to do.
    pub(super) task: &'a dyn Fn(&Trajectory) -> Task,
    pub(super) since: Option<&'a Since>,
}

impl Attempts<'_> {
    /// The motion along a path that is certified to do its task; if none is, the path's own, and why it is refused.
    pub(super) fn optimise(&self, run: &mut Run<'_>, path: &SearchPath) -> Result<Made, Diagnostics> {
        match self.run(run, path, Tries::All) {
            Ok(made) => Ok(made),
            Err(nearest) => self.as_searched(run, path, nearest),
        }
    }

    /// The path's own motion; where that is refused too, the one that was nearest to what the tolerance needs.
    pub(super) fn as_searched(
        &self,
        run: &mut Run<'_>,
        path: &SearchPath,
        nearest: Option<Nearest>,
    ) -> Result<Made, Diagnostics> {
        match (self.certify(run, path.trajectory()), nearest) {
            (Ok(last), Some(nearest)) if !last.certificate.holds() => Ok(*nearest.made),
            (last, _) => last,
        }
    }

    fn certify(&self, run: &mut Run<'_>, trajectory: Trajectory) -> Result<Made, Diagnostics> {
        let task = (self.task)(&trajectory);
        let Finish { mission, robot, map, .. } = self.finish;
        let mut made = self.finish.certify_task(run, trajectory, &task)?;
        if let Some(since) = self.since.filter(|_| robot.tolerance.is_some()) {
            let (whole, task) = since.with(&made.commands, &task);
            made.certificate = run.stage("certify", || {
                let demands = Demands { vias: &[], zones: mission.speed_zones(), link: None };
                certify::certify_through(&whole, robot, *map, &task, demands)
            });
        }
        Ok(made)
    }

    /// How far robots may be off along commands, by what they have behind them.
    pub(super) fn slacks(&self, commands: &CommandTable, task: &Task, tolerance: Tolerance) -> Option<Slacks> {
        let robot = self.finish.robot;
        match self.since {
            None => slacks(commands, robot, task, tolerance, 0),
            Some(since) => {
                let (whole, task) = since.with(commands, task);
                slacks(&whole, robot, &task, tolerance, whole.rows.len() - commands.rows.len())
            }
        }
    }

    /// The first motion along a path that is certified to do its task.
    ///
    /// # Errors
    /// The one that is nearest to what the tolerance needs, of those that nothing else refuses.
    pub(super) fn run(&self, run: &mut Run<'_>, path: &SearchPath, which: Tries) -> Result<Made, Option<Nearest>> {
        if path.length() == 0.0 {
            return Err(None);
        }
        let Self { finish, map, compile, task, .. } = self;
        let (mission, robot) = (finish.mission, finish.robot);
        let field = map.field(compile.threads);
        let mut refused: Option<Trajectory> = None;
        let (mut missed, mut deep) = (0.0f64, false);
        let mut nearest: Option<Nearest> = None;
        let mut idle = 0;
        let mut slack = robot.tolerance.and_then(|tolerance| {
            let trajectory = path.trajectory();
            let task = task(&trajectory);
            let (_, commands) = finish.commands(run, &trajectory).ok()?;
            self.slacks(&commands, &task, tolerance)
        });
        for (parameterisation, margin, look) in which.of(compile.parameterisation.unwrap_or(mission.parameterisation)) {
            // A motion on the wrong side of something stays there.
            if deep && look == Look::Again {
                continue;
            }
            let usual = if compile.spins { OptimizeOptions::default() } else { OptimizeOptions::without_spins() };
            let clearance = mission.clearance + margin;
            let mut options = OptimizeOptions { parameterisation, clearance, dense: compile.dense, ..usual };
            options.zones = mission.speed_zones().to_vec();
            if look != Look::First {
                options.steer = options.steer.closer();
                options.clearance += MISSED_TIMES * missed;
            }
            let before = refused.take().filter(|_| look == Look::Again);
            let trajectory = run.stage("optimize", || match &slack {
                None => make(path, field, robot, &options, before.as_ref()),
                Some(slacks) => make(path, &Slackened { field, slacks }, robot, &options, before.as_ref()),
            });
            refused = Some(trajectory.clone());
            // A trajectory that no law can time is one more reason to go on to the next try.
            let Ok(made) = self.certify(run, trajectory) else { continue };
            if made.certificate.holds() {
                return Ok(made);
            }
            if let Some(closest) = &made.certificate.closest {
                missed = missed.max((mission.clearance - closest.distance).clamp(0.0, MISSED_MOST));
                deep = closest.distance < DEEP;
            }
            if let Some(tolerance) = robot.tolerance {
                let inside = made.certificate.tolerance.as_ref().and_then(|inside| inside.closest.as_ref());
                let short = inside.map_or(0.0, |closest| mission.clearance - closest.distance);
                missed = missed.max(short.clamp(0.0, MISSED_MOST));
                slack = self.slacks(&made.commands, &task(&made.trajectory), tolerance);
                let least = nearest.as_ref().map_or(f64::INFINITY, |nearest| nearest.short);
                idle = if short < least - GAINED { 0 } else { idle + 1 };
                if made.only_the_tolerance_refuses() && short < least {
                    nearest = Some(Nearest { short, made: Box::new(made) });
                }
                if short > GAINED && idle >= IDLE {
                    break;
                }
            }
        }
        Err(nearest)
    }
}

/// A motion along a path, from the beginning or from one that was refused.
fn make<F: optimize::DistanceField>(
    path: &SearchPath,
    field: &F,
    robot: &RobotModel,
    options: &OptimizeOptions,
    refused: Option<&Trajectory>,
) -> Trajectory {
    match refused {
        Some(refused) => optimize::resume(path, field, robot, options, refused),
        None => optimize::optimize_in(path, field, robot, options),
    }
}
