//! Seeded scenes like those of \[SCR\] section VI, as `trajc.scenes/1`.
//!
//! What the paper states: the sizes of room and boxes, how many boxes, "start-goal > 5 m" (Table III), "cubes and arch
//! bridges" of "two kinds". What it does not state is chosen as in the project's contract: cubes of 0.4, 0.6 or 0.8 m, 15 a
//! scene, with three low wide and three tall narrow arches, faces on the voxel grid, boxes that do not overlap, headings
//! uniform, room for a disc at start and goal, and a way as wide as the robot's narrowest disc.

use serde_json::{Value, json};

use super::Suite;
use super::fixed::{self, Fixed};
use super::rng::Rng;
use super::room::Room;
use crate::math::real;

/// Cell size, m; all faces lie on this grid.
pub(super) const CELL: f64 = 0.05;
/// Side of the room, cells.
pub(super) const SIDE: i32 = 200;
/// Kept free before and behind an arch, cells.
const APPROACH: i32 = 12;
/// Tries to place one obstacle, before the room is drawn anew.
const TRIES: usize = 1000;
/// Tries for start and goal, before the room is drawn anew.
const POSE_TRIES: usize = 50;
/// Rooms that may be drawn anew for one scene.
const ROOMS: usize = 2000;

/// A box with its corners in cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct CellBox {
    pub min: [i32; 3],
    pub max: [i32; 3],
}

impl CellBox {
    /// Whether two share area, seen from above. Touching faces do not.
    fn overlaps(&self, other: &Self) -> bool {
        (0..2).all(|a| self.min[a] < other.max[a] && other.min[a] < self.max[a])
    }
}

/// What a suite's scenes are like; lengths in metres where not cells.
struct Recipe {
    /// Cells.
    height: i32,
    arches: usize,
    /// Radius of the disc that is free at start and goal.
    free: f64,
    /// Radius of the disc that gets from start to goal.
    passage: f64,
    /// Boxes that begin at this height are passed under, cells.
    under: i32,
    /// Between start and goal, more than.
    distance: f64,
}

fn recipe(suite: Suite) -> Recipe {
    let flat = Recipe { height: 8, arches: 0, free: 0.35, passage: 0.20, under: 6, distance: 2.0 };
    match suite {
        Suite::Table1 => Recipe { height: 20, arches: 6, free: 0.38, under: 8, ..flat },
        // Figures are fixed scenes and ask for no recipe, nor do rooms for arms, which `arm` draws.
        Suite::Table2 | Suite::Fig5 | Suite::Fig6 | Suite::Arm => flat,
        Suite::Table3 => Recipe { distance: 5.0, ..flat },
    }
}

/// A kind of arch, in cells.
struct Arch {
    width: i32,
    height: i32,
    pillar: i32,
    lintel: i32,
    depth: i32,
}

/// Low and wide: fold down to pass. Tall and narrow: fold in.
const ARCHES: [Arch; 2] = [
    Arch { width: 20, height: 9, pillar: 4, lintel: 5, depth: 12 },
    Arch { width: 12, height: 18, pillar: 4, lintel: 2, depth: 12 },
];

/// Boxes a scene where the command line says nothing; Table III has three.
pub fn default_boxes(suite: Suite) -> &'static [usize] {
    match suite {
        Suite::Table1 => &[15],
        Suite::Table2 => &[20],
        Suite::Table3 => &[10, 20, 35],
        Suite::Fig5 | Suite::Fig6 | Suite::Arm => &[],
    }
}

/// Scenes a suite (and number of boxes, or kind of room) has in the paper.
pub fn default_count(suite: Suite) -> usize {
    match suite {
        Suite::Table1 => 500,
        Suite::Table2 | Suite::Table3 => 200,
        Suite::Fig5 | Suite::Fig6 => 1,
        Suite::Arm => 120,
    }
}

/// A suite of `count` scenes for each number of boxes, as a `trajc.scenes/1` document. Scene k depends on the seed, the
/// suite, the boxes and k alone. Figures are one fixed scene, whatever the other arguments. [`Suite::Arm`] has no scenes here: they need a
/// robot ([`super::arm::document`]).
///
/// # Errors
/// The number of boxes that left no room for a scene.
pub fn document(suite: Suite, boxes: &[usize], count: usize, seed: u64) -> Result<String, usize> {
    if let Some(fixed) = fixed::scene(suite) {
        return Ok(written(&head(suite, suite.name(), 0, fixed.room), &[figure(suite, &fixed).to_string()]));
    }
    let name = match boxes {
        [one] => format!("{}-{one}", suite.name()),
        _ => suite.name().to_owned(),
    };
    let mut lines = Vec::new();
    for boxes in boxes {
        for k in 0..count {
            let id = format!("{}-{boxes}-{seed}-{k:03}", suite.name());
            lines.push(scene(suite, *boxes, seed, k, &id).ok_or(*boxes)?.to_string());
        }
    }
    Ok(written(&head(suite, &name, seed, [SIDE, SIDE, recipe(suite).height]), &lines))
}

/// Everything but the scenes; `room` in cells.
fn head(suite: Suite, name: &str, seed: u64, room: [i32; 3]) -> Value {
    let mut limits = json!({
        "wheel": {"speed_mps": 1.0, "acceleration_mps2": 1.0, "jerk_mps3": 4.0},
        "base": {"speed_mps": 1.0, "acceleration_mps2": 1.0, "angular_acceleration_radps2": 2.5, "eta": 0.4},
    });
    if suite.has_blades() {
        limits["joints"] = json!({"blade": {"speed": 1.5, "acceleration": 3.0, "jerk": 15.0}});
    }
    json!({
        "schema": super::scenes::SCHEMA, "name": name, "seed": seed, "bounds": [[0.0, 0.0, 0.0], room.map(metres)],
        "resolution": CELL, "clearance_m": 0.02, "limits": limits,
    })
}

pub(super) fn written(head: &Value, scenes: &[String]) -> String {
    let head = head.to_string();
    let head = head.strip_suffix('}').expect("a JSON object ends in its brace");
    format!("{head},\"scenes\":[\n{}\n]}}\n", scenes.join(",\n"))
}

/// The one scene of a figure.
fn figure(suite: Suite, fixed: &Fixed) -> Value {
    let boxes: Vec<Value> =
        fixed.boxes.iter().map(|b| json!({"min": b.min.map(metres), "max": b.max.map(metres)})).collect();
    let pose = |[x, y, degrees]: [f64; 3]| json!({"x": x / 20.0, "y": y / 20.0, "yaw": degrees.to_radians()});
    let mut start = pose(fixed.start);
    if let Some(blade) = fixed.blade {
        start["joints"] = json!({"blade": blade});
    }
    json!({"id": suite.name(), "boxes": boxes, "start": start, "goal": pose(fixed.goal)})
}

/// Cells in metres, correctly rounded.
pub(super) fn metres(cells: i32) -> f64 {
    f64::from(cells) / 20.0
}

fn scene(suite: Suite, boxes: usize, seed: u64, k: usize, id: &str) -> Option<Value> {
    let recipe = recipe(suite);
    let mut rng = Rng::new(&[seed, suite as u64, boxes as u64, k as u64]);
    for _ in 0..ROOMS {
        let Some(placed) = obstacles(&mut rng, suite, &recipe, boxes) else { continue };
        let Some([start, goal]) = poses(&mut rng, &recipe, &placed) else { continue };
        let corner = |c: [i32; 3]| c.map(metres);
        let boxes: Vec<Value> = placed.iter().map(|b| json!({"min": corner(b.min), "max": corner(b.max)})).collect();
        let pose = |p: [f64; 3]| json!({"x": p[0], "y": p[1], "yaw": p[2]});
        return Some(json!({"id": id, "boxes": boxes, "start": pose(start), "goal": pose(goal)}));
    }
    None
}

/// Obstacles whose footprints (arches: with their approaches) do not overlap.
fn obstacles(rng: &mut Rng, suite: Suite, recipe: &Recipe, boxes: usize) -> Option<Vec<CellBox>> {
    let (mut placed, mut taken): (Vec<CellBox>, Vec<CellBox>) = (Vec::new(), Vec::new());
    for i in 0..recipe.arches + boxes {
        let (parts, keep_off) = (0..TRIES)
            .map(|_| if i < recipe.arches { arch(rng, &ARCHES[i % 2]) } else { single(rng, suite) })
            .find(|(_, keep_off)| !taken.iter().any(|t| t.overlaps(keep_off)))?;
        placed.extend(parts);
        taken.push(keep_off);
    }
    Some(placed)
}

fn single(rng: &mut Rng, suite: Suite) -> (Vec<CellBox>, CellBox) {
    let size = match suite {
        Suite::Table1 => [[8; 3], [12; 3], [16; 3]][rng.integer(0, 2) as usize],
        _ => [12, 12, 8],
    };
    let [x, y] = [size[0], size[1]].map(|s| rng.integer(0, SIDE - s));
    let placed = CellBox { min: [x, y, 0], max: [x + size[0], y + size[1], size[2]] };
    (vec![placed], placed)
}

/// Two pillars and a lintel at a random place, passed through along x or along y, and the area that others keep off.
fn arch(rng: &mut Rng, kind: &Arch) -> (Vec<CellBox>, CellBox) {
    let across = rng.integer(0, 1) as usize;
    let along = 1 - across;
    let total = kind.width + 2 * kind.pillar;
    let mut size = [0; 2];
    (size[across], size[along]) = (total, kind.depth);
    let corner = size.map(|s| rng.integer(APPROACH, SIDE - APPROACH - s));
    let top = kind.height + kind.lintel;
    let part = |from: i32, to: i32, bottom: i32| {
        let mut part = CellBox { min: [corner[0], corner[1], bottom], max: [corner[0], corner[1], top] };
        part.min[across] += from;
        part.max[across] += to;
        part.max[along] += kind.depth;
        part
    };
    let inner = kind.pillar + kind.width;
    let parts = vec![part(0, kind.pillar, 0), part(inner, total, 0), part(kind.pillar, inner, kind.height)];
    let mut keep_off = part(0, total, 0);
    keep_off.min[along] -= APPROACH;
    keep_off.max[along] += APPROACH;
    (parts, keep_off)
}

fn poses(rng: &mut Rng, recipe: &Recipe, boxes: &[CellBox]) -> Option<[[f64; 3]; 2]> {
    let side = f64::from(SIDE) * CELL;
    let (all, below) = (Room::new(boxes, recipe.height), Room::new(boxes, recipe.under));
    let rounded = |v: f64| (v * 1e4).round() / 1e4;
    (0..POSE_TRIES).find_map(|_| {
        let mut pose = || {
            let [x, y] = [0, 1].map(|_| rounded(rng.uniform(0.0, side)));
            [x, y, rounded(rng.uniform(-std::f64::consts::PI, std::f64::consts::PI))]
        };
        let (start, goal) = (pose(), pose());
        let [from, to] = [start, goal].map(|p| [p[0], p[1]]);
        let far = real::hypot(to[0] - from[0], to[1] - from[1]) > recipe.distance;
        let free = far && [from, to].iter().all(|p| all.clearance(*p) >= recipe.free);
        (free && below.connected(from, to, recipe.passage)).then_some([start, goal])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::eval::scenes::SceneSet;
    use crate::geom::Aabb;

    const SUITES: [Suite; 3] = [Suite::Table1, Suite::Table2, Suite::Table3];

    fn set(suite: Suite, boxes: &[usize], count: usize, seed: u64) -> SceneSet {
        let text = document(suite, boxes, count, seed).expect("room enough");
        crate::eval::read("suite.json", &text).unwrap_or_else(|e| panic!("{e:?}"))
    }

    fn gap(b: &Aabb, x: f64, y: f64) -> f64 {
        let axis = |a: usize, p: f64| (b.min[a] - p).max(p - b.max[a]).max(0.0);
        real::hypot(axis(0, x), axis(1, y))
    }

    #[test]
    fn the_same_arguments_give_the_same_bytes_and_scene_k_does_not_depend_on_the_count() {
        for suite in SUITES {
            let boxes = default_boxes(suite);
            assert_eq!(document(suite, boxes, 3, 5), document(suite, boxes, 3, 5));
            let (few, many) = (set(suite, boxes, 2, 5), set(suite, boxes, 4, 5));
            assert_eq!(few.scenes[..2], many.scenes[..2]);
            assert_ne!(few.scenes[0].boxes, few.scenes[1].boxes);
            assert_ne!(set(suite, boxes, 1, 6).scenes[0].boxes, few.scenes[0].boxes);
        }
    }

    #[test]
    fn start_and_goal_are_as_far_apart_and_as_free_as_stated() {
        for (suite, distance, free) in
            [(Suite::Table1, 2.0, 0.38), (Suite::Table2, 2.0, 0.35), (Suite::Table3, 5.0, 0.35)]
        {
            for scene in set(suite, default_boxes(suite), 8, 11).scenes {
                let ends = [&scene.start, &scene.goal].map(|p| (p.x.expect("given"), p.y.expect("given")));
                assert!(real::hypot(ends[0].0 - ends[1].0, ends[0].1 - ends[1].1) > distance, "{}", scene.id);
                for (x, y) in ends {
                    let wall = x.min(y).min(10.0 - x).min(10.0 - y);
                    assert!(scene.boxes.iter().map(|b| gap(b, x, y)).fold(wall, f64::min) >= free, "{}", scene.id);
                }
            }
        }
    }

    #[test]
    fn obstacles_have_the_stated_sizes_on_the_grid_within_the_room() {
        let size = |b: &Aabb| [0, 1, 2].map(|a| ((b.max[a] - b.min[a]) / CELL).round() as i32);
        for suite in SUITES {
            for scene in set(suite, &[15], 5, 3).scenes {
                let on_grid = |v: f64| (v / CELL - (v / CELL).round()).abs() < 1e-9;
                for b in &scene.boxes {
                    assert!(b.min.iter().chain(&b.max).all(|v| on_grid(*v) && (0.0..=10.0).contains(v)));
                }
                let (arches, boxes) = scene.boxes.split_at(if suite == Suite::Table1 { 18 } else { 0 });
                assert_eq!(boxes.len(), 15);
                for b in boxes {
                    let [w, d, h] = size(b);
                    let cube = suite == Suite::Table1 && w == d && d == h && [8, 12, 16].contains(&w);
                    assert!(cube || suite != Suite::Table1 && [w, d, h] == [12, 12, 8], "{w} {d} {h}");
                }
                for (i, arch) in arches.chunks(3).enumerate() {
                    let lintel = &arch[2];
                    let (opening, under) = if i % 2 == 0 { (20, 0.45) } else { (12, 0.90) };
                    let [w, d, _] = size(lintel);
                    assert!([w, d] == [opening, 12] || [w, d] == [12, opening], "{w} {d}");
                    assert!((lintel.min[2] - under).abs() < 1e-9);
                }
            }
        }
    }

    #[test]
    fn boxes_do_not_overlap_and_arches_keep_their_approaches() {
        let overlap = |a: &Aabb, b: &Aabb| (0..2).all(|i| a.min[i] < b.max[i] - 1e-9 && b.min[i] < a.max[i] - 1e-9);
        for scene in set(Suite::Table1, &[15], 6, 9).scenes {
            for (i, a) in scene.boxes.iter().enumerate() {
                assert!(scene.boxes[..i].iter().all(|b| !overlap(a, b)), "{}", scene.id);
            }
            for arch in scene.boxes[..18].chunks(3) {
                // Pillars stand apart along the axis that the robot crosses.
                let along = if arch[0].min[0] == arch[1].min[0] { 0 } else { 1 };
                let mut lane = arch[2];
                (lane.min[along], lane.max[along]) = (lane.min[along] - 0.6, lane.max[along] + 0.6);
                let others = scene.boxes.iter().filter(|b| !arch.contains(b));
                assert!(others.clone().all(|b| !overlap(&lane, b)), "{}", scene.id);
            }
        }
    }

    #[test]
    fn a_room_that_cannot_hold_so_many_boxes_is_refused() {
        assert_eq!(super::obstacles(&mut Rng::new(&[1]), Suite::Table2, &recipe(Suite::Table2), 400), None);
    }
}
