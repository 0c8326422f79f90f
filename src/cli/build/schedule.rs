//! Who compiles what, and which missions share a map.
//!
//! Missions on one map are compiled one after the other, so that few maps are held at a time. The worker that comes first to a map
//! reads it and builds its distance field; meanwhile others take missions on other maps. When no mission is left that needs it, a map
//! is dropped.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

use blake3::Hash;

use crate::cli::inputs::{folder_of, tidy};
use crate::mission::{MapSpec, Mission};
use crate::pipeline::Place;

/// What decides which cells of a map are occupied.
pub type MapKey = String;

/// A mission to compile.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Job {
    /// Its place in the list of missions.
    pub index: usize,
    /// The map that it shares with others; `None`: with nobody.
    pub map: Option<MapKey>,
    /// The mission that must be done before, by its place in the list, and which of its files is read.
    pub after: Option<(usize, PathBuf)>,
}

/// A map as the first mission on it found it.
#[derive(Clone)]
pub struct Shared {
    /// Cells and distance field.
    pub place: Place,
    /// The map's file and the one beside it, as read.
    pub files: Vec<(PathBuf, Hash)>,
    /// Files that would have been read too, had they been there.
    pub absent: Vec<PathBuf>,
    /// The robot's height, where it decides what is an obstacle.
    pub height: Option<f64>,
}

/// The key of a mission's map, which lies at `path`. Where the mission gives no slab it is the robot's height that ends it.
pub fn map_key(mission: &Mission, path: &Path) -> Option<MapKey> {
    let spec = mission.map.as_ref()?;
    let robot = spec.ends_at_the_robot().then(|| {
        let folder = folder_of(Path::new(&mission.source.name));
        (tidy(&folder.join(&mission.robot)), &mission.limits)
    });
    // Zones say nothing of cells.
    let MapSpec { file: _, resolution, height, unknown, origin, keep_out, boxes, speed_zones: _ } = spec;
    Some(format!("{path:?} {resolution:?} {height:?} {unknown:?} {origin:?} {keep_out:?} {boxes:?} {robot:?}"))
}

enum Progress {
    /// Nobody has it.
    Absent,
    /// A worker is at it.
    Making,
    /// Made.
    Ready(Box<Shared>),
}

struct Entry {
    /// Missions that are not done and need it.
    remaining: usize,
    progress: Progress,
}

struct Inner {
    pending: Vec<Job>,
    maps: BTreeMap<MapKey, Entry>,
    /// Missions that are not done.
    open: BTreeSet<usize>,
    stopped: bool,
}

/// The missions that are to be compiled.
pub struct Schedule {
    inner: Mutex<Inner>,
    changed: Condvar,
}

impl Schedule {
    /// Missions in their order, those on one map together.
    pub fn new(jobs: Vec<Job>) -> Self {
        let mut maps: BTreeMap<MapKey, Entry> = BTreeMap::new();
        let mut first = BTreeMap::new();
        for job in &jobs {
            if let Some(map) = &job.map {
                maps.entry(map.clone()).or_insert(Entry { remaining: 0, progress: Progress::Absent }).remaining += 1;
                first.entry(map.clone()).or_insert(job.index);
            }
        }
        let open = jobs.iter().map(|job| job.index).collect();
        let mut pending = jobs;
        pending.sort_by_key(|job| (job.map.as_ref().map_or(job.index, |map| first[map]), job.index));
        Self { inner: Mutex::new(Inner { pending, maps, open, stopped: false }), changed: Condvar::new() }
    }

    fn inner(&self) -> MutexGuard<'_, Inner> {
        // Nothing here can panic half way.
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The next mission whose map nobody is making at the moment, and that begins where no mission ends that is not done; waits for one. `None`: there is none left, or no more is to begin.
    pub fn take(&self) -> Option<Job> {
        let mut inner = self.inner();
        loop {
            if inner.stopped || inner.pending.is_empty() {
                return None;
            }
            let Inner { pending, maps, open, .. } = &mut *inner;
            let making = |job: &Job| {
                let entry = job.map.as_ref().and_then(|map| maps.get(map));
                entry.is_some_and(|entry| matches!(entry.progress, Progress::Making))
            };
            let early = |job: &Job| job.after.as_ref().is_some_and(|(first, _)| open.contains(first));
            if let Some(at) = pending.iter().position(|job| !making(job) && !early(job)) {
                let job = pending.remove(at);
                if let Some(entry) = job.map.as_ref().and_then(|map| maps.get_mut(map))
                    && matches!(entry.progress, Progress::Absent)
                {
                    entry.progress = Progress::Making;
                }
                return Some(job);
            }
            inner = self.changed.wait(inner).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// A map that is there.
    pub fn ready(&self, map: &MapKey) -> Option<Shared> {
        match self.inner().maps.get(map).map(|entry| &entry.progress) {
            Some(Progress::Ready(shared)) => Some((**shared).clone()),
            _ => None,
        }
    }

    /// Whether a map will be asked for by other missions than the one at work.
    pub fn wanted(&self, map: &MapKey) -> bool {
        self.inner().maps.get(map).is_some_and(|entry| entry.remaining > 1)
    }

    /// A map for the others.
    pub fn offer(&self, map: &MapKey, shared: Shared) {
        if let Some(entry) = self.inner().maps.get_mut(map) {
            entry.progress = Progress::Ready(Box::new(shared));
        }
        self.changed.notify_all();
    }

    /// A mission is done with, however it ended. Drops its map where nobody else needs it; a map that its maker did not get to make
    /// is the next one's to make.
    pub fn done(&self, job: &Job) {
        let mut dropped = None;
        let mut inner = self.inner();
        inner.open.remove(&job.index);
        if let Some(map) = &job.map
            && let Some(entry) = inner.maps.get_mut(map)
        {
            entry.remaining -= 1;
            if matches!(entry.progress, Progress::Making) {
                entry.progress = Progress::Absent;
            }
            if entry.remaining == 0 {
                dropped = inner.maps.remove(map);
            }
        }
        drop(inner);
        self.changed.notify_all();
        // A large map takes a while to free: not while others wait.
        drop(dropped);
    }

    /// No more missions begin.
    pub fn stop(&self) {
        self.inner().stopped = true;
        self.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::map::VoxelMap;
    use crate::mission::Unknown;

    fn schedule(maps: &[Option<&str>]) -> Schedule {
        let job = |(index, map): (usize, &Option<&str>)| Job { index, map: map.map(str::to_owned), after: None };
        Schedule::new(maps.iter().enumerate().map(job).collect())
    }

    fn shared() -> Shared {
        let map = VoxelMap::new(0.1, [0.0; 3], [2, 2, 2], Unknown::Free);
        Shared { place: map.into(), files: Vec::new(), absent: Vec::new(), height: None }
    }

    fn taken(schedule: &Schedule) -> Option<usize> {
        schedule.take().map(|job| job.index)
    }

    #[test]
    fn missions_on_one_map_come_together_and_the_map_is_dropped_after_the_last() {
        let s = schedule(&[Some("a"), Some("b"), None, Some("a"), Some("b")]);
        let first = s.take().expect("a mission");
        assert_eq!(first.index, 0);
        assert!(s.wanted(&"a".into()) && s.ready(&"a".into()).is_none());
        s.offer(&"a".into(), shared());
        s.done(&first);
        let second = s.take().expect("a mission");
        assert_eq!(second.index, 3, "the same map before the others");
        let held = s.ready(&"a".into()).expect("made");
        s.done(&second);
        assert!(s.ready(&"a".into()).is_none(), "nobody else needs it");
        assert_eq!(held.place.dims, [2, 2, 2], "whoever holds it has it");
        assert_eq!([taken(&s), taken(&s)], [Some(1), Some(2)], "another worker does not wait for map b");
    }

    #[test]
    fn who_waits_for_a_map_gets_it_or_the_task_to_make_it() {
        for offered in [true, false] {
            let s = schedule(&[Some("a"), Some("a")]);
            let first = s.take().expect("a mission");
            std::thread::scope(|scope| {
                let other = scope.spawn(|| s.take().expect("the second mission"));
                if offered {
                    s.offer(&"a".into(), shared());
                } else {
                    s.done(&first);
                }
                assert_eq!(other.join().expect("no panic").index, 1);
            });
            assert_eq!(s.ready(&"a".into()).is_some(), offered);
        }
    }

    #[test]
    fn a_map_is_shared_only_with_missions_that_add_the_same_to_it() {
        let key = |added: &str| {
            let rest = "start: {x_m: 0, y_m: 0, yaw: 0}\ngoal: {x_m: 1, y_m: 1}\n";
            let text = format!("robot: r.urdf\nmap: {{file: m.pcd, height_m: [0, 1]{added}}}\n{rest}");
            map_key(&crate::mission::parse("a.yaml", &text).expect("good"), Path::new("m.pcd"))
        };
        let area = ", keep_out: [{polygon_m: [[2, 1], [3, 1], [3, 2]], height_m: [0, 1]}]";
        let keys = [
            key(""),
            key(area),
            key(", keep_out: [{polygon_m: [[2, 1], [3, 1], [3, 2]]}]"),
            key(", boxes: [{min_m: [2, 1, 0], max_m: [3, 2, 0.5]}]"),
        ];
        assert_eq!(key(area), keys[1]);
        for (i, one) in keys.iter().enumerate() {
            assert!(keys[..i].iter().all(|other| other != one), "{one:?}");
        }
    }

    #[test]
    fn who_starts_where_another_ends_waits_for_it() {
        let job = |index, after: Option<usize>| Job { index, map: None, after: after.map(|a| (a, PathBuf::from("f"))) };
        let s = Schedule::new(vec![job(0, None), job(1, Some(0)), job(2, Some(7)), job(3, Some(1))]);
        let first = s.take().expect("a mission");
        assert_eq!((first.index, taken(&s)), (0, Some(2)), "mission 7 is not of this build");
        std::thread::scope(|scope| {
            let other = scope.spawn(|| s.take().expect("the second mission"));
            s.done(&first);
            let second = other.join().expect("no panic");
            assert_eq!(second.index, 1);
            s.done(&second);
        });
        assert_eq!([taken(&s), taken(&s)], [Some(3), None]);
    }

    #[test]
    fn nothing_begins_after_a_stop() {
        let s = schedule(&[None, None]);
        assert_eq!(taken(&s), Some(0));
        s.stop();
        assert_eq!(taken(&s), None);
    }
}
