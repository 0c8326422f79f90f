//! No bytes make a reader panic, take memory that it was not allowed, or hang.
//!
//! Valid files of every kind are damaged (`fuzz_inputs/mutate.rs`), each reader reads them, and what it says is rendered.
//! `cargo test` tries a few hundred a reader; `TRAJC_FUZZ=N cargo test --release --test fuzz_inputs -- --nocapture` tries N of each and also
//! refuses a reader that takes more than a second. `TRAJC_FUZZ_SEED` begins elsewhere. What fails is kept in `target/tmp/fuzz_inputs`.

#[path = "fuzz_inputs/mutate.rs"]
mod mutate;
#[path = "fuzz_inputs/seeds.rs"]
mod seeds;

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

use trajc::diag::{self, Diagnostics};
use trajc::emit::{csv, mcap_read};
use trajc::map::{self, MapInputs};
use trajc::memory;
use trajc::mission::{self, LimitsSpec, MapSpec, Unknown};
use trajc::robot::{self, Files, RobotInputs, hull, mesh, spec};
use trajc::trajectory::given;

/// What readers may take for one thing; some hold two of them, or a list that is growing.
const CAP: u64 = 16 << 20;
const PEAK: u64 = 6 * CAP;
/// Longest input.
const LONGEST: usize = 64 << 10;
/// Inputs of each reader in `cargo test`.
const FEW: u64 = 300;
const SLOW: Duration = Duration::from_secs(1);

type Read = Box<dyn Fn(&[u8])>;

/// A reader, and valid files for it.
struct Reader {
    name: &'static str,
    seeds: Vec<Vec<u8>>,
    read: Read,
}

fn reader(name: &'static str, seeds: Vec<Vec<u8>>, read: impl Fn(&[u8]) + 'static) -> Reader {
    Reader { name, seeds, read: Box::new(read) }
}

fn rendered<T>(result: Result<T, Diagnostics>) -> Option<T> {
    result.map_err(|faults| assert!(!diag::render(&faults, false).is_empty())).ok()
}

fn read_map(name: &str, bytes: &[u8], beside: Option<(&str, &[u8])>) {
    let inputs = MapInputs { name, bytes, beside };
    let _ = rendered(map::beside(name, bytes));
    for (height, unknown, resolution) in
        [(None, Unknown::Occupied, None), (Some([-0.5, 1.5]), Unknown::Free, Some(0.1))]
    {
        let spec = MapSpec { height, unknown, resolution, ..any_map() };
        if let Some(map) = rendered(map::parse(&inputs, &spec, 0.4)) {
            assert!(map.dims.iter().all(|n| *n > 0));
            let _ = map.describe();
        }
    }
    if let Some(Some(survey)) = rendered(map::survey(&inputs)) {
        let _ = survey.describe();
    }
}

fn any_map() -> MapSpec {
    MapSpec {
        file: "a".into(),
        resolution: None,
        height: None,
        unknown: Unknown::Free,
        origin: None,
        keep_out: Vec::new(),
        boxes: Vec::new(),
    }
}

fn as_text(bytes: &[u8], read: impl FnOnce(&str)) {
    // What is no UTF-8 is refused where files are opened.
    read(&String::from_utf8_lossy(bytes));
}

/// Every mesh is this one.
struct Mesh(Vec<u8>);

impl Files for Mesh {
    fn read(&mut self, _: &Path) -> std::io::Result<Vec<u8>> {
        Ok(self.0.clone())
    }
}

fn read_robot(spec: &spec::RobotSpec, urdf: &str) {
    let mut files = Mesh(seeds::meshes().swap_remove(2));
    let overrides = LimitsSpec::default();
    let inputs = RobotInputs { spec, urdf: ("a.urdf", urdf), files: &mut files, overrides: &overrides };
    if let Some((robot, _)) = rendered(robot::parse_with_findings(inputs)) {
        assert!(robot.top_over_all_postures().is_finite());
        let _ = robot.describe();
    }
}

fn read_mesh(name: &str, bytes: &[u8]) {
    if let Ok(points) = mesh::vertices(name, bytes) {
        let corners = hull::extreme_points(&points);
        assert!(!corners.is_empty() && corners.len() <= points.len());
    }
}

fn readers() -> Vec<Reader> {
    let blades = seeds::robot(seeds::BLADES);
    let held = vec![0.0; blades.joints.len()];
    let images = seeds::images();
    let voxels = seeds::npy().swap_remove(0);
    let with_image = move |bytes: &[u8]| read_map("a.yaml", bytes, Some(("map.pgm", &images[0])));
    let sheet = seeds::sheets().swap_remove(1);
    let [binary, ascii, obj] = seeds::meshes().try_into().expect("three of them");
    vec![
        reader("pcd", seeds::pcd(), |b| read_map("a.pcd", b, None)),
        reader("ply", seeds::ply(), |b| read_map("a.ply", b, None)),
        reader("las", seeds::las(), |b| read_map("a.las", b, None)),
        reader("octomap", seeds::octomap(), |b| read_map("a.bt", b, None)),
        reader("npy", seeds::npy(), |b| {
            read_map("a.npy", b, Some(("a.json", br#"{"resolution": 0.1, "origin": [0, 0, 0]}"#)));
        }),
        reader("npy.json", seeds::npy_notes(), move |b| read_map("a.npy", &voxels, Some(("a.json", b)))),
        reader("points.csv", seeds::tables(), |b| read_map("a.csv", b, None)),
        reader("map_server.yaml", seeds::sheets(), with_image),
        reader("pgm", seeds::images(), move |b| read_map("a.yaml", &sheet, Some(("map.pgm", b)))),
        reader("stl", vec![binary, ascii], |b| read_mesh("a.stl", b)),
        reader("obj", vec![obj], |b| read_mesh("a.obj", b)),
        reader("urdf", seeds::urdfs(), |b| as_text(b, |text| read_robot(&spec::RobotSpec::default(), text))),
        reader("robot.yaml", seeds::robots(), |b| {
            as_text(b, |text| {
                if let Some(spec) = rendered(spec::parse("robot.yaml", text)) {
                    read_robot(&spec, seeds::BLADES);
                }
            });
        }),
        reader("mission.yaml", seeds::missions(), |b| {
            as_text(b, |text| {
                let _ = rendered(mission::parse("mission.yaml", text));
            });
        }),
        reader("path.csv", seeds::paths(), move |b| {
            as_text(b, |text| {
                if let Err(faults) = given::from_csv("path.csv", text, &blades, &held) {
                    assert!(!faults.is_empty());
                }
            });
        }),
        reader("commands.csv", seeds::commands(), |b| {
            as_text(b, |text| {
                let _ = rendered(csv::read_to_judge("commands.csv", text));
            });
        }),
        reader("commands.mcap", seeds::recordings(), |b| {
            let _ = rendered(mcap_read::read("commands.mcap", b));
        }),
        reader("scenes.json", seeds::scenes(), |b| {
            as_text(b, |text| {
                let _ = rendered(trajc::eval::read("scenes.json", text));
            });
        }),
    ]
}

thread_local! {
    static PANIC: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Why an input must not have been read so.
fn fault(reader: &Reader, bytes: &[u8], in_time: bool) -> Option<String> {
    let mut result = Ok(());
    let started = Instant::now();
    let asked = allocation_counter::measure(|| result = catch_unwind(AssertUnwindSafe(|| (reader.read)(bytes))));
    let taken = started.elapsed();
    if result.is_err() {
        return Some(PANIC.with_borrow(Clone::clone));
    }
    if asked.bytes_max > PEAK {
        return Some(format!("took {} MiB", asked.bytes_max >> 20));
    }
    if in_time && taken > SLOW {
        // Others may have kept the processor busy.
        let again = Instant::now();
        (reader.read)(bytes);
        if again.elapsed() > SLOW {
            return Some(format!("took {:.1} s", again.elapsed().as_secs_f64()));
        }
    }
    None
}

fn number(variable: &str) -> Option<u64> {
    std::env::var(variable).ok()?.parse().ok()
}

#[test]
fn no_bytes_make_a_reader_panic_hang_or_take_memory_it_may_not() {
    memory::set(CAP, memory::Source::Asked);
    std::panic::set_hook(Box::new(|info| PANIC.with_borrow_mut(|text| *text = info.to_string())));
    let (asked, seed) = (number("TRAJC_FUZZ"), number("TRAJC_FUZZ_SEED").unwrap_or(1));
    let only = std::env::var("TRAJC_FUZZ_READER").ok();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fuzz_inputs");
    let mut faults: Vec<String> = Vec::new();
    for reader in readers() {
        if only.as_ref().is_some_and(|only| only != reader.name) {
            continue;
        }
        for seed in &reader.seeds {
            if let Some(fault) = fault(&reader, seed, false) {
                faults.push(format!("{}, undamaged: {fault}", reader.name));
            }
        }
        let started = Instant::now();
        let mut chance = mutate::Chance(seed);
        let mut kept = Vec::new();
        for n in 0..asked.unwrap_or(FEW) {
            let [own, other] = [0; 2].map(|_| chance.below(reader.seeds.len()));
            let bytes = mutate::mutated(&reader.seeds[own], &reader.seeds[other], LONGEST, &mut chance);
            let Some(fault) = fault(&reader, &bytes, asked.is_some()) else { continue };
            // One of each kind.
            if kept.len() < 10 && !kept.contains(&fault) {
                let file = folder.join(format!("{}-{n}", reader.name));
                std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&file, &bytes)).expect("room");
                faults.push(format!("{}: {fault}; {}", reader.name, file.display()));
                kept.push(fault);
            }
        }
        if asked.is_some() {
            println!("{:16} {:>9} inputs, {:.1} s", reader.name, asked.unwrap_or(FEW), started.elapsed().as_secs_f64());
        }
    }
    let _ = std::panic::take_hook();
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
}
