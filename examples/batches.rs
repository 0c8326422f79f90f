//! What `trajc build` saves: a build with nothing to do, two workers against one, a shared map, memory.
//!
//! `cargo build --release && cargo run --release --example batches [MISSIONS]`: runs the program beside it on missions that it makes
//! (or the one that `TRAJC` names) in a temporary folder (1000 by default; a tenth of them on a large map). Runs to be compared take turns; the least time of each counts.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use trajc::esdf;
use trajc::map::VoxelMap;
use trajc::mission::Unknown;

/// Cells along x and y of the large map, 5 cm each, and along z.
const LARGE: [usize; 3] = [2000, 2000, 8];
/// A post of 0.3 m on every crossing of a grid of 2 m.
const GRID: usize = 40;

struct Site {
    folder: tempfile::TempDir,
    program: PathBuf,
}

/// How long a run took, and the most memory that it held, MiB.
#[derive(Clone, Copy)]
struct Ran {
    time: f64,
    peak: f64,
}

impl Site {
    fn path(&self, path: &str) -> PathBuf {
        self.folder.path().join(path)
    }

    fn write(&self, path: &str, bytes: &[u8]) {
        let path = self.path(path);
        fs::create_dir_all(path.parent().expect("below the folder")).expect("folders");
        fs::write(path, bytes).expect("room");
    }

    fn run(&self, args: &[&str]) -> Ran {
        let started = Instant::now();
        let mut child = Command::new(&self.program)
            .args(args)
            .current_dir(self.folder.path())
            .stdout(Stdio::null())
            .spawn()
            .expect("build the program first: cargo build --release");
        // Where there is a /proc: the system's own high-water mark, which only grows.
        let status = format!("/proc/{}/status", child.id());
        let mut peak = 0.0f64;
        let code = loop {
            if let Some(code) = child.try_wait().expect("a child") {
                break code;
            }
            let text = fs::read_to_string(&status).unwrap_or_default();
            let mark =
                text.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.parse().ok());
            peak = mark.map_or(peak, |kb: f64| peak.max(kb / 1024.0));
            std::thread::sleep(Duration::from_millis(2));
        };
        assert!(code.success(), "{args:?}: {code}");
        Ran { time: started.elapsed().as_secs_f64(), peak }
    }

    /// Least times and greatest peaks of several kinds of runs that take turns.
    fn compare(&self, turns: usize, kinds: &[&dyn Fn() -> Ran]) -> Vec<Ran> {
        let mut best = vec![Ran { time: f64::INFINITY, peak: 0.0 }; kinds.len()];
        for _ in 0..turns {
            for (best, run) in best.iter_mut().zip(kinds) {
                let ran = run();
                *best = Ran { time: best.time.min(ran.time), peak: best.peak.max(ran.peak) };
            }
        }
        best
    }
}

/// A `.npy` file of voxels.
fn voxels(dims: [usize; 3], occupied: impl Fn(usize, usize) -> bool) -> Vec<u8> {
    let [nx, ny, nz] = dims;
    let mut header = format!("{{'descr': '|u1', 'fortran_order': False, 'shape': ({nx}, {ny}, {nz}), }}");
    header += &" ".repeat((64 - (11 + header.len()) % 64) % 64);
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend(u16::try_from(header.len()).expect("a short header").to_le_bytes());
    bytes.extend(header.as_bytes());
    for i in 0..nx {
        for j in 0..ny {
            bytes.extend(std::iter::repeat_n(u8::from(occupied(i, j)), nz));
        }
    }
    bytes
}

/// From between four posts to between the next four.
fn mission(map: &str, robot: &str, k: usize, across: usize) -> String {
    let [i, j] = [k % across, k / across % across].map(|c| 2.0 * c as f64 + 1.0);
    let (x, y, far) = (i + 2.0, j + 2.0, 0.01 * (k / (across * across)) as f64);
    format!(
        "robot: {robot}\nmap: {{file: {map}, resolution_m: 0.05, height_m: [0.02, 0.4]}}\n\
         start: {{x_m: {i}, y_m: {j}, yaw: 0}}\ngoal: {{x_m: {}, y_m: {y}, yaw: 90deg}}\n",
        x + far
    )
}

/// Would the distance field be read faster from a file than it is built? Unpacked, in the system's memory already: the best case.
fn field_on_disk(file: &Path, post: impl Fn(usize, usize) -> bool) {
    let mut map = VoxelMap::new(0.05, [0.0; 3], LARGE, Unknown::Occupied);
    for i in 0..LARGE[0] {
        for j in (0..LARGE[1]).filter(|j| post(i, *j)) {
            (0..LARGE[2]).for_each(|k| map.occupy([i, j, k]));
        }
    }
    let nodes: usize = LARGE.iter().map(|n| n + 1).product();
    fs::write(file, vec![1u8; 4 * nodes]).expect("room");
    let (mut build, mut read) = (f64::INFINITY, f64::INFINITY);
    for _ in 0..3 {
        let started = Instant::now();
        drop(std::hint::black_box(esdf::build(&map)));
        build = build.min(started.elapsed().as_secs_f64());
        let started = Instant::now();
        let bytes = fs::read(file).expect("just written");
        // What makes sure that it is the field that was written.
        std::hint::black_box(blake3::hash(&bytes));
        read = read.min(started.elapsed().as_secs_f64());
    }
    let (ms, size) = (1e3 * build, 4 * nodes / 1_000_000);
    println!(
        "distance field of the large map: {ms:.0} ms to build; {:.0} ms to read {size} MB of it and check them",
        1e3 * read
    );
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("folders");
    for entry in fs::read_dir(from).expect("shipped") {
        let entry = entry.expect("an entry");
        fs::copy(entry.path(), to.join(entry.file_name())).expect("room");
    }
}

fn main() {
    let many: usize = std::env::args().nth(1).map_or(1000, |text| text.parse().expect("a number of missions"));
    let few = many / 10;
    let own = std::env::current_exe().expect("this program");
    let beside = own.parent().and_then(Path::parent).expect("target/release").join("trajc");
    let program = std::env::var_os("TRAJC").map_or(beside, PathBuf::from);
    let site = Site { folder: tempfile::tempdir().expect("a temporary folder"), program };
    copy(&Path::new(env!("CARGO_MANIFEST_DIR")).join("robots/box_base"), &site.path("robots/box_base"));
    let robot = "../robots/box_base/robot.yaml";
    let post = |i: usize, j: usize| i % GRID < 6 && j % GRID < 6;
    let beside = br#"{"resolution": 0.05, "origin": [0, 0, 0]}"#;
    for (name, dims) in [("large", LARGE), ("small", [320, 320, 8])] {
        site.write(&format!("maps/{name}.npy"), &voxels(dims, post));
        site.write(&format!("maps/{name}.json"), beside);
    }
    for k in 0..few {
        site.write(&format!("on_large/l{k:04}.yaml"), mission("../maps/large.npy", robot, k, 40).as_bytes());
        site.write(&format!("few/f{k:04}.yaml"), mission("../maps/small.npy", robot, k, 6).as_bytes());
        site.write(&format!("own_maps/maps/o{k:04}.npy"), &voxels([320, 320, 8], post));
        site.write(&format!("own_maps/maps/o{k:04}.json"), beside);
        let own = mission(&format!("maps/o{k:04}.npy"), robot, k, 6);
        site.write(&format!("own_maps/o{k:04}.yaml"), own.as_bytes());
    }
    for k in 0..many {
        site.write(&format!("many/m{k:04}.yaml"), mission("../maps/small.npy", robot, k, 6).as_bytes());
    }
    println!("load: {}", fs::read_to_string("/proc/loadavg").unwrap_or_default().trim());
    field_on_disk(&site.path("field"), post);

    let build = |folder: &str, jobs: &str| site.run(&["build", folder, "-j", jobs, "--force"]);
    let two = site.compare(3, &[&|| build("few", "1"), &|| build("few", "2")]);
    println!(
        "{few} missions, -j 1: {:.2} s; -j 2: {:.2} s; ratio {:.2}",
        two[0].time,
        two[1].time,
        two[0].time / two[1].time
    );

    let singles = || {
        let runs: Vec<Ran> = (0..few).map(|k| site.run(&["compile", &format!("on_large/l{k:04}.yaml")])).collect();
        Ran { time: runs.iter().map(|r| r.time).sum(), peak: runs.iter().map(|r| r.peak).fold(0.0, f64::max) }
    };
    let shared = site.compare(1, &[&singles, &|| build("on_large", "1"), &|| build("on_large", "2")]);
    let [single, one, both] = [shared[0], shared[1], shared[2]];
    println!(
        "{few} missions on one map of {} million voxels: {:.2} s one by one; {:.2} s by build -j 1, ratio {:.1}; {:.2} s -j 2, ratio {:.1}",
        LARGE.iter().product::<usize>() / 1_000_000,
        single.time,
        one.time,
        single.time / one.time,
        both.time,
        single.time / both.time
    );
    println!("  memory: {:.0} MiB one by one, {:.0} MiB -j 1, {:.0} MiB -j 2", single.peak, one.peak, both.peak);

    let peaks = [build("few", "2"), build("own_maps", "2"), build("many", "2")].map(|ran| ran.peak);
    println!(
        "memory, -j 2: {few} missions {:.0} MiB, {few} on a map each {:.0} MiB, {many} missions {:.0} MiB",
        peaks[0], peaks[1], peaks[2]
    );
    let idle = site.compare(10, &[&|| site.run(&["build", "many"])]);
    println!("{many} missions, nothing to do: {:.0} ms, {:.0} MiB", 1e3 * idle[0].time, idle[0].peak);
    println!("load: {}", fs::read_to_string("/proc/loadavg").unwrap_or_default().trim());
}
