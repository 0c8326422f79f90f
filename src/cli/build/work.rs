//! Workers over the missions of a build.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::mpsc;
use std::thread;
use std::time::Instant;

use super::make::Made;
use super::schedule::{Job, Schedule};
use crate::diag::{Diagnostic, Diagnostics};

/// As much as the main thread has on most systems; new threads have less.
const STACK: usize = 8 << 20;

/// What a worker tells while it works.
pub enum Event {
    /// It begins with this mission.
    Begun(usize),
    /// It is done with it.
    Done(Finished),
}

/// A mission that a worker is done with.
pub struct Finished {
    /// Its place in the list of missions.
    pub index: usize,
    /// What came of it; `Err`: bad input, or a fault of this program.
    pub result: Result<Made, Diagnostics>,
    /// Seconds.
    pub time: f64,
}

impl Finished {
    /// Whether there are commands.
    pub fn certified(&self) -> bool {
        self.result.as_ref().is_ok_and(|made| made.diagnostics.is_none())
    }
}

/// Compiles what is scheduled on so many threads; `tell` hears of it on the caller's own. Unless it is to keep going, no mission
/// begins after one has failed. A mission that panics is a failed one.
pub fn work(
    schedule: &Schedule,
    workers: usize,
    keep_going: bool,
    make: &(dyn Fn(&Job) -> Result<Made, Diagnostics> + Sync),
    tell: &mut dyn FnMut(Event),
) {
    let (sender, receiver) = mpsc::channel();
    thread::scope(|scope| {
        for _ in 0..workers.max(1) {
            let sender = sender.clone();
            let worker = move || {
                while let Some(job) = schedule.take() {
                    // Nobody listens any more: nobody is there to be told.
                    let _ = sender.send(Event::Begun(job.index));
                    let started = Instant::now();
                    let result = guarded(|| make(&job));
                    let done = Finished { index: job.index, result, time: started.elapsed().as_secs_f64() };
                    if !keep_going && !done.certified() {
                        schedule.stop();
                    }
                    schedule.done(&job);
                    let _ = sender.send(Event::Done(done));
                }
            };
            let named = thread::Builder::new().stack_size(STACK).name("worker".to_owned());
            // Where the system gives no more threads, those that are there do the work; the first must be.
            if named.spawn_scoped(scope, worker.clone()).is_err() {
                worker();
            }
        }
        drop(sender);
        receiver.into_iter().for_each(&mut *tell);
    });
}

/// The one place where a panic is caught: other missions know nothing of it.
fn guarded(make: impl FnOnce() -> Result<Made, Diagnostics>) -> Result<Made, Diagnostics> {
    catch_unwind(AssertUnwindSafe(make)).unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
        let message = format!("internal error: {}", text.unwrap_or("a panic without a message"));
        let hint = "this is a fault of trajc, not of your files: please report it with the mission and what it names";
        Err(Diagnostic::error("build/internal", message).hint(hint).into())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::build::state::Ended;
    use crate::report::Status;

    fn certified() -> Result<Made, Diagnostics> {
        let ended = Ended { status: Status::Certified, clearance_m: None, duration_s: None, failure: None };
        Ok(Made { ended, diagnostics: None })
    }

    fn run(
        workers: usize,
        keep_going: bool,
        make: &(dyn Fn(&Job) -> Result<Made, Diagnostics> + Sync),
    ) -> Vec<Finished> {
        let schedule = Schedule::new((0..8).map(|index| Job { index, map: None, after: None }).collect());
        let mut done = Vec::new();
        work(&schedule, workers, keep_going, make, &mut |event| {
            if let Event::Done(finished) = event {
                done.push(finished);
            }
        });
        done.sort_by_key(|finished| finished.index);
        done
    }

    #[test]
    fn every_mission_is_done_once_on_however_many_threads() {
        for workers in [0, 1, 3, 20] {
            let done = run(workers, false, &|_| certified());
            assert!(done.iter().map(|f| f.index).eq(0..8) && done.iter().all(Finished::certified), "{workers}");
        }
    }

    #[test]
    fn a_mission_that_panics_is_an_internal_error_and_disturbs_no_other() {
        let make = |job: &Job| if job.index == 3 { panic!("mission {} is cursed", job.index) } else { certified() };
        let done = run(2, true, &make);
        assert_eq!(done.len(), 8);
        let faults = done[3].result.as_ref().expect_err("it panics");
        assert_eq!(faults.0[0].message, "internal error: mission 3 is cursed");
        assert_eq!(done.iter().filter(|f| f.certified()).count(), 7);
    }

    #[test]
    fn after_a_failure_nothing_begins_unless_it_is_to_keep_going() {
        let make = |job: &Job| match job.index {
            2 => Err(Diagnostic::error("x/y", "bad").into()),
            _ => certified(),
        };
        assert!(run(1, false, &make).iter().map(|f| f.index).eq(0..3));
        assert_eq!(run(1, true, &make).len(), 8);
    }
}
