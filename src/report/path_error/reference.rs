//! The planned path, ready for the question how far a point is from it.

use std::cell::OnceCell;

use crate::geom::Pose2;
use crate::math::real;
use crate::retime::MotionProfile;
use crate::retime::course::Course;
use crate::trajectory::plane_curve::{Place, PlaneCurve};

use super::foot::distance_to_curve;

/// Distance between vertices, m; where the path bends, less: about this turn, rad, but no less than that, m.
const STEP: f64 = 4e-3;
const TURN: f64 = 0.02;
const LEAST_STEP: f64 = 1e-5;
/// Cells of the look-up grid at most, and their least size, m.
const GRID: (f64, f64) = (1e5, 2e-2);
/// How much of the distance may be of the fourth order, m: what is left out then is below 1e-10.
const FOURTH_ORDER: f64 = 2e-10;
/// A point this near to where it is looked for first is looked for nowhere else, m.
const NEAR: f64 = 0.5e-3;

/// The planned path as a set of positions, ready for look-up.
#[derive(Debug)]
pub struct PathReference {
    courses: Vec<Course>,
    vertices: Vec<Vertex>,
    /// The vertices by where they are; made when a point far from where it is looked for first comes.
    cells: OnceCell<Cells>,
    end: Pose2,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Vertex {
    pub(super) point: [f64; 2],
    course: u32,
    /// On a curve where; on a straight course the share of it.
    place: Place,
    /// Distance driven up to it, m.
    travelled: f64,
    /// A corner, a cusp or an end of a leg: there, or beside it, the path does not go on smoothly.
    corner: bool,
    /// Where that is near enough: direction of travel, curvature and its change with the distance.
    about: Option<About>,
}

/// A path about one of its points.
#[derive(Debug, Clone, Copy)]
struct About {
    direction: [f64; 2],
    curvature: f64,
    /// First and second derivative of the curvature by the distance.
    change: [f64; 2],
}

impl PathReference {
    /// The path of a profile: all positions of its base.
    pub fn new(profile: &MotionProfile) -> Self {
        let courses: Vec<Course> = profile.legs().iter().map(|leg| leg.course.clone()).collect();
        let mut vertices = Vec::new();
        let mut travelled = 0.0;
        for (index, course) in courses.iter().enumerate() {
            // Position with its derivatives by a parameter that goes forward, and the distance driven on this course.
            let mut add = |[x, y]: [[f64; 3]; 2], place, along: f64| {
                let speed = real::hypot(x[1], y[1]);
                let about = About {
                    direction: [x[1] / speed, y[1] / speed],
                    curvature: (x[1] * y[2] - y[1] * x[2]) / (speed * speed * speed),
                    change: [0.0; 2],
                };
                let about = (about.curvature.is_finite() && about.direction[0].is_finite()).then_some(about);
                let (point, travelled) = ([x[0], y[0]], travelled + along);
                vertices.push(Vertex { point, course: index as u32, place, travelled, corner: false, about });
            };
            match course {
                Course::Curved(curved) => {
                    let curve = &curved.curve;
                    let steps = (curve.length() / STEP).ceil().max(1.0);
                    for i in 0..=steps as usize {
                        let along = curve.length() * i as f64 / steps;
                        let place = curve.place_at_arc(along);
                        add(plane_jets(curve, place), place, along);
                    }
                    travelled += curve.length();
                }
                Course::Steered(steered) => {
                    // Every node is a vertex: corners and cusps lie between no two of them.
                    let curve = &steered.curve;
                    let nodes: Vec<Place> = curve.nodes().collect();
                    let mut add_at = |place| add(curve.point_jet(place), place, curve.travelled(place));
                    for pair in nodes.windows(2) {
                        let [from, to] = [pair[0], pair[1]].map(|place| curve.parameter(place));
                        let fastest = pair.iter().map(|p| curve.jet(1, *p)[1].abs()).fold(0.0, f64::max);
                        let length = curve.travelled(pair[1]) - curve.travelled(pair[0]);
                        let turn = (curve.jet(0, pair[1])[0] - curve.jet(0, pair[0])[0]).abs();
                        let steps =
                            (fastest * (to - from) / STEP).max((turn / TURN).min(length / LEAST_STEP)).ceil().max(1.0);
                        add_at(pair[0]);
                        for i in 1..steps as usize {
                            add_at(curve.place(from + (to - from) * i as f64 / steps));
                        }
                    }
                    add_at(curve.end());
                    travelled += curve.length();
                }
                Course::Proportional(p) => {
                    let steps = (p.drive.abs() / STEP).ceil().max(1.0);
                    for i in 0..=steps as usize {
                        let share = i as f64 / steps;
                        let pose = p.pose(share);
                        let (sin, cos) = real::sin_cos(pose.yaw);
                        let jets = [[pose.x, p.drive * cos, 0.0], [pose.y, p.drive * sin, 0.0]];
                        add(jets, Place { piece: 0, u: share }, p.drive.abs() * share);
                    }
                    travelled += p.drive.abs();
                }
            }
        }
        smooth_out(&mut vertices);
        Self { courses, vertices, cells: OnceCell::new(), end: profile.pose(profile.time()) }
    }

    /// Where the path ends.
    pub fn end(&self) -> Pose2 {
        self.end
    }

    /// Distance from a point to the path, m.
    pub fn distance(&self, point: [f64; 2]) -> f64 {
        let cells = self.cells.get_or_init(|| Cells::new(&self.vertices));
        let off = |k: usize| square(self.vertices[k].point, point);
        let nearest = cells.nearest(&self.vertices, point);
        let mut least = self.distance_about(nearest, point);
        // Another stretch of the path may pass nearer between two of its vertices.
        let reach = off(nearest).sqrt() + STEP;
        cells.within(point, reach, |k| {
            let own = off(k);
            let before = k.checked_sub(1).is_none_or(|j| off(j) > own);
            if own <= reach * reach && before && self.vertices.get(k + 1).is_none_or(|v| square(v.point, point) >= own)
            {
                least = least.min(self.distance_about(k, point));
            }
        });
        least
    }

    /// Distance from a point to the path, m, for points in order of the distance driven, of which `cursor` remembers the last: first
    /// looked for near there, and elsewhere only where the path is not as near as `NEAR`.
    pub fn distance_along(&self, point: [f64; 2], travelled: f64, cursor: &mut usize) -> f64 {
        let last = self.vertices.len() - 1;
        while *cursor < last && self.vertices[*cursor + 1].travelled <= travelled {
            *cursor += 1;
        }
        let off = |k: usize| square(self.vertices[k].point, point);
        let (mut nearest, mut least) = (*cursor, off(*cursor));
        while nearest < last && off(nearest + 1) <= least {
            nearest += 1;
            least = off(nearest);
        }
        while nearest > 0 && off(nearest - 1) < least {
            nearest -= 1;
            least = off(nearest);
        }
        let vertex = &self.vertices[nearest];
        let near = match vertex.about {
            // What is beside may be another stretch of the path.
            _ if vertex.corner => f64::INFINITY,
            Some(about) => {
                let offset = [point[0] - vertex.point[0], point[1] - vertex.point[1]];
                let [cos, sin] = about.direction;
                let along = offset[0] * cos + offset[1] * sin;
                let [first, second] = about.change;
                let rise = along * along * (0.5 * about.curvature + along * (first / 6.0 + along * second / 24.0));
                (offset[1] * cos - offset[0] * sin - rise).abs()
            }
            None => self.distance_about(nearest, point),
        };
        if near <= NEAR { near } else { self.distance(point) }
    }

    /// Distance to the path about its nearest vertex.
    fn distance_about(&self, nearest: usize, point: [f64; 2]) -> f64 {
        let place = self.vertices[nearest].point;
        // Where legs join, several vertices share a place, and the foot lies on the leg of any of them.
        let shared = |k: &usize| square(self.vertices[*k].point, place) < 1e-18;
        let before = (0..nearest).rev().take_while(shared);
        let after = (nearest + 1..self.vertices.len()).take_while(shared);
        std::iter::once(nearest)
            .chain(before)
            .chain(after)
            .map(|k| self.distance_near(k, point))
            .fold(f64::INFINITY, f64::min)
    }

    /// Distance to the path about one vertex: to its curve, not to the chord.
    fn distance_near(&self, nearest: usize, point: [f64; 2]) -> f64 {
        let vertex = self.vertices[nearest];
        let near = square(vertex.point, point).sqrt();
        match &self.courses[vertex.course as usize] {
            Course::Curved(curved) => {
                let bracket = self.bracket(nearest, |place| curved.curve.parameter(place));
                let jets = |u: f64| plane_jets(&curved.curve, curved.curve.place(u));
                near.min(distance_to_curve(jets, bracket, point))
            }
            Course::Steered(steered) => {
                let [low, own, high] = self.bracket(nearest, |place| steered.curve.parameter(place));
                let curve = &steered.curve;
                if steered.turns_or_stands([low, own, high]) {
                    // The vertex may be a corner: each side is a curve of its own.
                    let jets = |u: f64| curve.point_jet(curve.place(u));
                    let side = |from: f64, to: f64| distance_to_curve(jets, [from, 0.5 * (from + to), to], point);
                    return near.min(side(low, own)).min(side(own, high));
                }
                let jets = |u: f64| curve.point_jet_from(vertex.place, vertex.point, curve.place(u));
                near.min(distance_to_curve(jets, [low, own, high], point))
            }
            Course::Proportional(p) if p.drive != 0.0 => {
                let (sin, cos) = real::sin_cos(p.pose.yaw);
                let offset = [point[0] - p.pose.x, point[1] - p.pose.y];
                let along = offset[0] * cos + offset[1] * sin;
                let inside = along * p.drive.signum() >= 0.0 && along.abs() <= p.drive.abs();
                if inside { (offset[1] * cos - offset[0] * sin).abs() } else { near }
            }
            Course::Proportional(_) => near,
        }
    }

    /// Parameters of the vertices before, at and after one, as far as they are on its course.
    fn bracket(&self, vertex: usize, parameter: impl Fn(Place) -> f64) -> [f64; 3] {
        let course = self.vertices[vertex].course;
        let of = |k: usize| self.vertices.get(k).filter(|v| v.course == course).map(|v| parameter(v.place));
        let own = parameter(self.vertices[vertex].place);
        [vertex.checked_sub(1).and_then(of).unwrap_or(own), own, of(vertex + 1).unwrap_or(own)]
    }
}

/// Notes how curvature changes; where the path turns, jumps or ends beside a vertex, it is not smooth about it.
fn smooth_out(vertices: &mut [Vertex]) {
    let smooth = |a: &Vertex, b: &Vertex| {
        let (Some(from), Some(to)) = (a.about, b.about) else { return None };
        let length = b.travelled - a.travelled;
        let turned = from.direction[0] * to.direction[0] + from.direction[1] * to.direction[1];
        let bent = from.curvature.abs().max(to.curvature.abs()) * length;
        let joined = a.course == b.course && turned > 1.0 - 2.0 * TURN * TURN && bent <= 2.0 * TURN;
        (joined && length > 0.0).then(|| (to.curvature - from.curvature) / length)
    };
    let changes: Vec<Option<f64>> = vertices.windows(2).map(|pair| smooth(&pair[0], &pair[1])).collect();
    let lengths: Vec<f64> = vertices.windows(2).map(|pair| pair[1].travelled - pair[0].travelled).collect();
    for (k, vertex) in vertices.iter_mut().enumerate() {
        let before = k.checked_sub(1).and_then(|k| Some((changes[k]?, lengths[k])));
        let after = changes.get(k).copied().flatten().map(|change| (change, lengths[k]));
        vertex.corner = before.is_none() || after.is_none();
        vertex.about = before.zip(after).zip(vertex.about).and_then(|(((before, back), (after, ahead)), about)| {
            let second = (after - before) / (0.5 * (back + ahead));
            let change = [before + (after - before) * back / (back + ahead), second];
            // The fourth order halfway to the next vertex, as a measure of what is left out beyond it.
            let fourth = second.abs() * real::powi(back.max(ahead), 4) / 384.0;
            (fourth <= FOURTH_ORDER).then_some(About { change, ..about })
        });
    }
}

/// x and y with two derivatives by the parameter.
fn plane_jets(curve: &PlaneCurve, place: Place) -> [[f64; 3]; 2] {
    [0, 1].map(|d| {
        let [value, first, second, _] = curve.jet(d, place);
        [value, first, second]
    })
}

/// Vertices by the cell of a grid that they are in.
#[derive(Debug)]
struct Cells {
    origin: [f64; 2],
    cell: f64,
    size: [usize; 2],
    /// `starts[c] .. starts[c + 1]` are the entries of cell c in `members`.
    starts: Vec<u32>,
    members: Vec<u32>,
}

impl Cells {
    fn new(vertices: &[Vertex]) -> Self {
        let bound =
            |d: usize, pick: fn(f64, f64) -> f64, from: f64| vertices.iter().map(|v| v.point[d]).fold(from, pick);
        let low = [0, 1].map(|d| bound(d, f64::min, f64::INFINITY));
        let span = [0, 1].map(|d| bound(d, f64::max, f64::NEG_INFINITY) - low[d]);
        let cell = GRID.1.max((span[0] * span[1] / GRID.0).sqrt()).max(span[0].max(span[1]) / GRID.0);
        let size = span.map(|s| (s / cell) as usize + 1);
        let mut this = Self { origin: low, cell, size, starts: vec![0; size[0] * size[1] + 1], members: Vec::new() };
        // Counting sort of vertices by cell.
        let cells: Vec<usize> = vertices.iter().map(|v| this.flat(this.cell_of(v.point))).collect();
        cells.iter().for_each(|c| this.starts[c + 1] += 1);
        (1..this.starts.len()).for_each(|c| this.starts[c] += this.starts[c - 1]);
        let mut next = this.starts.clone();
        this.members = vec![0; cells.len()];
        for (vertex, c) in cells.into_iter().enumerate() {
            this.members[next[c] as usize] = vertex as u32;
            next[c] += 1;
        }
        this
    }

    fn cell_of(&self, point: [f64; 2]) -> [usize; 2] {
        [0, 1].map(|d| (((point[d] - self.origin[d]) / self.cell).max(0.0) as usize).min(self.size[d] - 1))
    }

    fn flat(&self, [i, j]: [usize; 2]) -> usize {
        i * self.size[1] + j
    }

    /// Visits all vertices within a distance of a point, and some others.
    fn within(&self, point: [f64; 2], reach: f64, mut visit: impl FnMut(usize)) {
        let [low, high] = [-reach, reach].map(|side| self.cell_of([point[0] + side, point[1] + side]));
        for i in low[0]..=high[0] {
            let cells = self.flat([i, low[1]])..=self.flat([i, high[1]]);
            let members = self.starts[*cells.start()] as usize..self.starts[*cells.end() + 1] as usize;
            self.members[members].iter().for_each(|member| visit(*member as usize));
        }
    }

    /// The vertex nearest to a point: rings of cells about it, until no nearer one can follow.
    fn nearest(&self, vertices: &[Vertex], point: [f64; 2]) -> usize {
        let centre = self.cell_of(point);
        // From outside the grid, every ring is at least this far away.
        let mut best = (f64::INFINITY, 0);
        for ring in 0..self.size[0].max(self.size[1]) {
            let reach = (ring as f64 - 1.0).max(0.0) * self.cell;
            if best.0 <= reach * reach {
                break;
            }
            let range = |d: usize| centre[d].saturating_sub(ring)..=(centre[d] + ring).min(self.size[d] - 1);
            for i in range(0) {
                let on_side = i.abs_diff(centre[0]) == ring;
                let mut look = |j: usize| {
                    let c = self.flat([i, j]);
                    for member in &self.members[self.starts[c] as usize..self.starts[c + 1] as usize] {
                        let distance = square(vertices[*member as usize].point, point);
                        if distance < best.0 {
                            best = (distance, *member as usize);
                        }
                    }
                };
                if on_side {
                    range(1).for_each(&mut look);
                } else {
                    [centre[1].checked_sub(ring), centre[1].checked_add(ring).filter(|j| *j < self.size[1])]
                        .into_iter()
                        .flatten()
                        .for_each(&mut look);
                }
            }
        }
        best.1
    }
}

pub(super) fn square(a: [f64; 2], b: [f64; 2]) -> f64 {
    real::powi(a[0] - b[0], 2) + real::powi(a[1] - b[1], 2)
}
