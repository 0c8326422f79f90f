//! How far held commands leave the planned path, against the sampling time (\[CONV\] section 4).

use crate::command::{CommandError, CommandTable, SampleOptions, sample, sample_uncorrected};
use crate::geom::{Pose2, wrap_angle};
use crate::mission::Sampling;
use crate::retime::MotionProfile;
use crate::retime::course::Course;
use crate::robot::RobotModel;
use crate::trajectory::plane_curve::Place;

/// Distance between points of the replay that are measured, and between vertices of the reference, m.
const STEP: f64 = 1e-3;
/// Cells of the look-up grid at most, and their least size, m.
const GRID: (f64, f64) = (1e6, 5e-3);

/// A step along the path that changes no distance that anyone reads, m.
const NO_STEP: f64 = 1e-11;

/// One row of `path_error.csv`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathErrorRow {
    /// s.
    pub sampling_time: f64,
    /// How wheel speeds were sampled.
    pub sampling: Sampling,
    /// Largest distance of the replay from the planned path, between samples included, m.
    pub lateral_max: f64,
    /// Root mean square of it over the distance driven, m.
    pub lateral_rms: f64,
    /// Distance from the replay's end to the path's, m.
    pub end_point: f64,
    /// Absolute difference of the headings there, rad.
    pub end_heading: f64,
    /// Proven clearance of these commands, m, where there is a map and it was asked for. Set by the caller.
    pub clearance_min: Option<f64>,
}

/// The path error at each of `times`, sampled by the machinery that writes commands: rounded up, within limits, end point corrected
/// where that is needed. Where no correction closes the end, the row tells what the plain samples do.
///
/// `clearance` judges each table; return `None` where there is nothing to judge.
///
/// # Errors
/// A sampling time that is none, or too many rows.
pub fn path_errors(
    profile: &MotionProfile,
    robot: &RobotModel,
    times: &[f64],
    sampling: Sampling,
    mut clearance: impl FnMut(&CommandTable) -> Option<f64>,
) -> Result<Vec<PathErrorRow>, CommandError> {
    let reference = PathReference::new(profile);
    let rows = times.iter().map(|time| {
        let options = SampleOptions { sampling_time: *time, sampling };
        let table = match sample(profile, robot, &options) {
            Err(CommandError::EndPoint { .. } | CommandError::Limits { .. }) => {
                sample_uncorrected(profile, robot, &options)?
            }
            other => other?,
        };
        let clearance_min = clearance(&table);
        Ok(PathErrorRow { clearance_min, ..path_error_of_table(&table, profile.pose(0.0), &reference) })
    });
    rows.collect()
}

/// The path error of a table: its replay from `start` against the planned path.
pub fn path_error_of_table(table: &CommandTable, start: Pose2, reference: &PathReference) -> PathErrorRow {
    let poses = table.replay(start);
    let (mut largest, mut squares, mut driven) = (0.0f64, 0.0, 0.0);
    for (k, pose) in poses.iter().enumerate() {
        let (v, omega) = table.twist(k);
        let length = if k + 1 < poses.len() { v.abs() * table.sampling_time } else { 0.0 };
        let parts = (length / STEP).ceil().max(1.0);
        for part in 0..parts as usize {
            let at = pose.after_twist(v, omega, table.sampling_time * part as f64 / parts);
            let off = reference.distance([at.x, at.y]);
            largest = largest.max(off);
            squares += off * off * length / parts;
            driven += length / parts;
        }
    }
    let last = poses.last().copied().unwrap_or(start);
    PathErrorRow {
        sampling_time: table.sampling_time,
        sampling: table.sampling,
        lateral_max: largest,
        lateral_rms: if driven > 0.0 { (squares / driven).sqrt() } else { 0.0 },
        end_point: last.distance(reference.end),
        end_heading: wrap_angle(last.yaw - reference.end.yaw).abs(),
        clearance_min: None,
    }
}

/// The planned path as a set of positions, ready for look-up.
#[derive(Debug, Clone)]
pub struct PathReference {
    courses: Vec<Course>,
    vertices: Vec<Vertex>,
    origin: [f64; 2],
    cell: f64,
    size: [usize; 2],
    /// `starts[c] .. starts[c + 1]` are the entries of cell c in `members`.
    starts: Vec<u32>,
    members: Vec<u32>,
    end: Pose2,
}

#[derive(Debug, Clone, Copy)]
struct Vertex {
    point: [f64; 2],
    course: u32,
    /// On a curve where; on a straight course the share of it.
    place: Place,
}

impl PathReference {
    /// The path of a profile: all positions of its base.
    pub fn new(profile: &MotionProfile) -> Self {
        let courses: Vec<Course> = profile.legs().iter().map(|leg| leg.course.clone()).collect();
        let mut vertices = Vec::new();
        for (index, course) in courses.iter().enumerate() {
            let mut add = |point, place| vertices.push(Vertex { point, course: index as u32, place });
            match course {
                Course::Curved(curved) => {
                    let steps = (curved.curve.length() / STEP).ceil().max(1.0);
                    for i in 0..=steps as usize {
                        let place = curved.curve.place_at_arc(curved.curve.length() * i as f64 / steps);
                        add(curved.curve.point(place), place);
                    }
                }
                Course::Steered(steered) => {
                    // Every node is a vertex: corners and cusps lie between no two of them.
                    let nodes: Vec<Place> = steered.curve.nodes().collect();
                    let mut add_at = |place| {
                        let pose = steered.pose(place);
                        add([pose.x, pose.y], place);
                    };
                    for pair in nodes.windows(2) {
                        let [from, to] = [pair[0], pair[1]].map(|place| steered.curve.travelled(place));
                        let steps = ((to - from) / STEP).ceil().max(1.0);
                        add_at(pair[0]);
                        for i in 1..steps as usize {
                            add_at(steered.curve.place_at_travelled(from + (to - from) * i as f64 / steps));
                        }
                    }
                    add_at(steered.curve.end());
                }
                Course::Proportional(p) => {
                    let steps = (p.drive.abs() / STEP).ceil().max(1.0);
                    for i in 0..=steps as usize {
                        let share = i as f64 / steps;
                        let pose = p.pose(share);
                        add([pose.x, pose.y], Place { piece: 0, u: share });
                    }
                }
            }
        }
        Self::index(courses, vertices, profile.pose(profile.time()))
    }

    fn index(courses: Vec<Course>, vertices: Vec<Vertex>, end: Pose2) -> Self {
        let bound =
            |d: usize, pick: fn(f64, f64) -> f64, from: f64| vertices.iter().map(|v| v.point[d]).fold(from, pick);
        let low = [0, 1].map(|d| bound(d, f64::min, f64::INFINITY));
        let span = [0, 1].map(|d| bound(d, f64::max, f64::NEG_INFINITY) - low[d]);
        let cell = GRID.1.max((span[0] * span[1] / GRID.0).sqrt()).max(span[0].max(span[1]) / GRID.0);
        let size = span.map(|s| (s / cell) as usize + 1);
        let mut this = Self {
            courses,
            vertices,
            origin: low,
            cell,
            size,
            starts: vec![0; size[0] * size[1] + 1],
            members: Vec::new(),
            end,
        };
        // Counting sort of vertices by cell.
        let cells: Vec<usize> = this.vertices.iter().map(|v| this.flat(this.cell_of(v.point))).collect();
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

    /// Where the path ends.
    pub fn end(&self) -> Pose2 {
        self.end
    }

    /// Distance from a point to the path, m.
    pub fn distance(&self, point: [f64; 2]) -> f64 {
        let nearest = self.nearest_vertex(point);
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
                let jets = |u: f64| {
                    let place = curved.curve.place(u);
                    [0, 1].map(|d| {
                        let [value, first, second, _] = curved.curve.jet(d, place);
                        [value, first, second]
                    })
                };
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
                let (sin, cos) = p.pose.yaw.sin_cos();
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

    /// The vertex nearest to a point: rings of cells about it, until no nearer one can follow.
    fn nearest_vertex(&self, point: [f64; 2]) -> usize {
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
                        let distance = square(self.vertices[*member as usize].point, point);
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

/// Distance from a point to the part of a curve between two parameters, from a first guess between them: Newton's steps on the
/// foot's condition, halving the bracket where a step leaves it (at rest and near it the parameter is far from arc length).
/// `jets`: x and y with two derivatives by the parameter.
fn distance_to_curve(
    jets: impl Fn(f64) -> [[f64; 3]; 2],
    [mut low, mut u, mut high]: [f64; 3],
    point: [f64; 2],
) -> f64 {
    let mut best = f64::INFINITY;
    let mut seen = [false; 2];
    for _ in 0..40 {
        let [x, y] = jets(u);
        let offset = [x[0] - point[0], y[0] - point[1]];
        best = best.min(offset[0].hypot(offset[1]));
        let slope = offset[0] * x[1] + offset[1] * y[1];
        let bend = x[1] * x[1] + y[1] * y[1] + offset[0] * x[2] + offset[1] * y[2];
        if slope > 0.0 {
            (high, seen[1]) = (u, true);
        } else {
            (low, seen[0]) = (u, true);
        }
        let newton = u - slope / bend;
        // Beyond an end where nobody was yet, the foot may be that end.
        let next = match bend > 0.0 {
            true if newton > low && newton < high => newton,
            true if newton <= low && !seen[0] => low,
            true if newton >= high && !seen[1] => high,
            _ => 0.5 * (low + high),
        };
        let step = next - u;
        u = next;
        // What is left changes the distance by the square of the step, over the distance, and by no more than the step.
        let speed = x[1] * x[1] + y[1] * y[1];
        if step * step * speed <= (1e-9 * best * best).max(NO_STEP * NO_STEP) || step == 0.0 {
            break;
        }
    }
    best
}

fn square(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)
}

#[cfg(test)]
mod tests;
