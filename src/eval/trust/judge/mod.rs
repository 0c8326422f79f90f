//! Who decides whether a case's motion keeps what the certificate promises: by brute force, and sharing no code with the proof.
//!
//! It has its own replay, its own kinematics, its own distance and its own bookkeeping of limits, ends, stands and zones; of the
//! stages it names only the types that hold the data. It is slow, and need not be anything else.

#![allow(clippy::disallowed_methods, reason = "nothing shared with the proof, so not its sines either")]

mod figures;
mod hunt;
mod motion;
mod places;
mod solid;

pub use hunt::Bracket;
use hunt::{Hunt, Wanted};
use motion::{Motion, State};

use super::TO_SPARE;
use super::case::Case;
use crate::map::VoxelMap;
use crate::mission::Unknown;

/// Most distances that are measured for a question.
const LOOKS: u64 = 60_000;
/// Bodies that are at most this far apart touch, m.
const TOUCH: f64 = 1e-9;

/// What is true of a case.
#[derive(Debug, Clone, PartialEq)]
pub enum Truth {
    /// Everything is kept; clearances by this much more than is asked for, at least, m.
    Holds {
        /// Not told apart beyond [`TO_SPARE`]; infinite where nothing is asked for.
        spare: f64,
    },
    /// Something is not: what.
    Broken(String),
    /// Not decided: what.
    Open(String),
}

/// What the judge has found.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// Whether the motion keeps what is asked.
    pub truth: Truth,
    /// The least distance from obstacles that was met, m; infinite: none was.
    pub met: f64,
}

/// A box of the map, or a side of its rectangle beyond which nothing was seen.
#[derive(Debug, Clone, Copy)]
enum Thing {
    Cube([usize; 3]),
    Side(usize, f64),
}

fn motion(case: &Case) -> Motion<'_> {
    let start = &case.task.start;
    let state = State { x: start.x, y: start.y, yaw: start.yaw, joints: case.task.start_joints.clone() };
    Motion::new(&case.robot, &case.table, state)
}

/// Corners of a cell's cube.
fn cube(map: &VoxelMap, cell: [usize; 3]) -> [[f64; 3]; 2] {
    [0, 1].map(|side| std::array::from_fn(|axis| map.origin[axis] + map.resolution * (cell[axis] + side) as f64))
}

fn things(map: &VoxelMap) -> Vec<Thing> {
    let [nx, ny, nz] = map.dims;
    let mut out = Vec::new();
    for i in 0..nx {
        for j in 0..ny {
            out.extend((0..nz).filter(|k| map.occupied([i, j, *k])).map(|k| Thing::Cube([i, j, k])));
        }
    }
    if map.outside == Unknown::Occupied {
        out.extend([Thing::Side(0, 1.0), Thing::Side(0, -1.0), Thing::Side(1, 1.0), Thing::Side(1, -1.0)]);
    }
    out
}

/// Distance of a placed solid from a thing; only a lower bound where that is above `enough`.
fn distance(map: &VoxelMap, placed: &solid::Placed<'_>, thing: Thing, enough: f64) -> solid::Bounds {
    match thing {
        Thing::Cube(cell) => {
            let [low, high] = cube(map, cell);
            let quick = placed.at_least(&low, &high);
            if quick > enough { [quick, f64::INFINITY] } else { placed.to_box(&low, &high) }
        }
        Thing::Side(axis, sign) => {
            let cells = if sign > 0.0 { map.dims[axis] } else { 0 };
            let at = sign * (map.origin[axis] + map.resolution * cells as f64);
            let room = at - placed.extent(axis, sign);
            [(room - 1e-12).max(0.0), room.max(0.0)]
        }
    }
}

/// The least distance of a case's robot from what its map says is there, over all instants: up to `width`, or whether it is at least as
/// much as asked.
fn clearance(case: &Case, map: &VoxelMap, wanted: Wanted) -> Bracket {
    let motion = motion(case);
    let all = things(map);
    let mut hunt = Hunt::new(wanted, LOOKS);
    // The nearest by balls first, so that what is far need not be measured.
    let shapes = case.robot.shapes.len();
    for row in 0..motion.rows() {
        for shape in 0..shapes {
            let placed = motion.place(shape, row, 0.0, false);
            let quick = |thing: &Thing| match thing {
                Thing::Cube(cell) => {
                    let [low, high] = cube(map, *cell);
                    placed.at_least(&low, &high)
                }
                Thing::Side(..) => distance(map, &placed, *thing, f64::INFINITY)[0],
            };
            if let Some(nearest) = all.iter().min_by(|a, b| quick(a).total_cmp(&quick(b))) {
                hunt.met(distance(map, &placed, *nearest, f64::INFINITY)[1]);
            }
        }
    }
    for row in 0..motion.rows() {
        for shape in 0..shapes {
            hunt.over_time(
                motion.span(row),
                motion.fastest(shape, row, false),
                all.clone(),
                |tau| motion.place(shape, row, tau, false),
                |placed, thing, enough| distance(map, placed, thing, enough),
            );
        }
    }
    hunt.bracket()
}

/// The least clearance of a case over all instants, up to `width` m where the judge's patience suffices; infinite without obstacles.
pub fn least_clearance(case: &Case, width: f64) -> Bracket {
    match &case.map {
        Some(map) => clearance(case, map, Wanted::Value(width)),
        None => Bracket { lower: f64::INFINITY, upper: f64::INFINITY },
    }
}

/// The least clearance when rows begin: what sampling sees, m.
pub fn clearance_at_rows(case: &Case) -> f64 {
    let (motion, Some(map)) = (motion(case), &case.map) else { return f64::INFINITY };
    let all = things(map);
    let mut least = f64::INFINITY;
    for row in 0..motion.rows() {
        for shape in 0..case.robot.shapes.len() {
            let placed = motion.place(shape, row, 0.0, false);
            all.iter().for_each(|thing| least = least.min(distance(map, &placed, *thing, least)[1]));
        }
    }
    least
}

/// Pairs of shapes that may not touch: of two links, on two bodies, and not among those that the robot ignores.
fn pairs(case: &Case) -> Vec<[usize; 2]> {
    let shapes = &case.robot.shapes;
    let mut out = Vec::new();
    for a in 0..shapes.len() {
        for b in a + 1..shapes.len() {
            let ignored = case.robot.ignore_pairs.iter().any(|pair| {
                let names = [shapes[a].link.as_str(), shapes[b].link.as_str()];
                let known = [pair.links[0].as_str(), pair.links[1].as_str()];
                names == known || names == [known[1], known[0]]
            });
            if !ignored && shapes[a].body != shapes[b].body && shapes[a].link != shapes[b].link {
                out.push([a, b]);
            }
        }
    }
    out
}

fn own(case: &Case, wanted: Wanted) -> Bracket {
    let motion = motion(case);
    let mut hunt = Hunt::new(wanted, LOOKS);
    for [a, b] in pairs(case) {
        for row in 0..motion.rows() {
            hunt.over_time(
                motion.span(row),
                motion.fastest(a, row, true) + motion.fastest(b, row, true),
                vec![()],
                |tau| [motion.place(a, row, tau, true), motion.place(b, row, tau, true)],
                |[a, b], (), _| a.to(b),
            );
        }
    }
    hunt.bracket()
}

/// The least distance of the robot's own links that may not touch, up to `width` m; infinite where all may.
pub fn least_between_links(case: &Case, width: f64) -> Bracket {
    own(case, Wanted::Value(width))
}

/// Judges a case.
pub fn judge(case: &Case) -> Finding {
    let mut met = f64::INFINITY;
    let (mut broken, mut open, mut spare) = (Vec::new(), Vec::new(), f64::INFINITY);
    let mut note = |truth: Truth| match truth {
        Truth::Holds { spare: more } => spare = spare.min(more),
        Truth::Broken(what) => broken.push(what),
        Truth::Open(what) => open.push(what),
    };
    let motion = motion(case);
    figures::table(case, &motion, &mut note);
    figures::limits(case, &mut note);
    places::end(case, &motion, &mut note);
    places::stands(case, &motion, &mut note);
    places::zones(case, &motion, &mut note);
    if !pairs(case).is_empty() {
        note(decided(|wanted| own(case, wanted), TOUCH, "own links").0);
    }
    if let Some(map) = &case.map {
        let required = case.task.clearance.max(TOUCH);
        let (truth, upper) = decided(|wanted| clearance(case, map, wanted), required, "clearance");
        met = upper;
        note(truth);
    }
    let truth = match (broken.first(), open.first()) {
        (Some(what), _) => Truth::Broken(what.clone()),
        (None, Some(what)) => Truth::Open(what.clone()),
        (None, None) => Truth::Holds { spare },
    };
    Finding { truth, met }
}

/// Whether a distance that is required is kept, if so whether with [`TO_SPARE`] besides, and the least distance met.
fn decided(hunt: impl Fn(Wanted) -> Bracket, required: f64, what: &str) -> (Truth, f64) {
    let Bracket { lower, upper } = hunt(Wanted::AtLeast(required));
    let truth = if upper < required {
        Truth::Broken(format!("{what}: {upper:.9} m of {required:.9} m"))
    } else if lower < required {
        Truth::Open(format!("{what}: between {lower:.9} and {upper:.9} m of {required:.9} m"))
    } else {
        let more = required + TO_SPARE;
        let ample = hunt(Wanted::AtLeast(more));
        let spare = if ample.lower >= more { TO_SPARE } else { lower - required };
        return (Truth::Holds { spare }, upper.min(ample.upper));
    };
    (truth, upper)
}

#[cfg(test)]
mod tests;
