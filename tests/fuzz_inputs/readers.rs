//! Every reader of input files, as a function of bytes that says nothing unless it panics.

#[path = "seeds.rs"]
mod seeds;

use std::path::Path;

use trajc::diag::{self, Diagnostics};
use trajc::emit::{csv, mcap_read};
use trajc::map::{self, MapInputs};
use trajc::mission::{self, LimitsSpec, MapSpec, Unknown};
use trajc::robot::{self, Files, RobotInputs, hull, mesh, spec};
use trajc::trajectory::given;

pub type Read = Box<dyn Fn(&[u8])>;

/// A reader, and valid files for it.
pub struct Reader {
    pub name: &'static str,
    pub seeds: Vec<Vec<u8>>,
    pub read: Read,
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
        speed_zones: Vec::new(),
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

/// All of them.
pub fn readers() -> Vec<Reader> {
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
