//! From the checked tree to a [`Mission`]: values, defaults, and faults between keys.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::fields::{GOAL, LINK_WITHIN, MISSION, PARAMETERISATIONS, PATH, SAMPLING_LAWS, START, TIME_LAWS};
use super::{
    LinkSpec, MapSpec, Mission, MissionSpans, NamedJoint, Parameterisation, PathSpec, PoseSpec, Sampling, TimeLaw,
    Unknown, ViaSpec, limits, solids, tolerance, zones,
};
use crate::diag::shape::Field;
use crate::diag::yaml::{Entry, Node};
use crate::diag::{Diagnostic, Diagnostics, Source, Span, shape, yaml};
use crate::math::real;

/// What a mission must hold at least, for the message about an empty one.
const OUTLINE: &str = "`robot`, and either `map`, `start` and `goal`, or a given `path`";
/// Consecutive Bezier segments join within this distance, metres.
const JOIN_TOLERANCE: f64 = 1e-6;

/// See [`super::parse`].
pub(super) fn parse(name: &str, text: &str) -> Result<Mission, Diagnostics> {
    let source = Arc::new(Source { name: name.to_string(), text: text.to_string() });
    let root = yaml::load(&source)?;
    let mut faults = shape::check(&source, &root, &MISSION, "a mission", OUTLINE);
    if !root.entries().is_empty() {
        faults.extend(Between { source: &source, root: &root }.check());
    }
    if !faults.is_empty() {
        faults.sort_by_key(|d| d.at.as_ref().map_or(0, |at| at.range.start));
        return Err(Diagnostics(faults));
    }
    let number = |key: &str, default: f64| root.get(key).and_then(Node::number).unwrap_or(default);
    let stem = Path::new(name).file_stem().map(|s| s.to_string_lossy().into_owned());
    let word = |key: &str| root.get(key).and_then(Node::text);
    let time_law = pick(&TIME_LAWS, word("time_law")).unwrap_or(TimeLaw::Auto);
    let sampling = pick(&SAMPLING_LAWS, word("sampling")).unwrap_or(Sampling::DEFAULT);
    Ok(Mission {
        name: stem.unwrap_or_else(|| "mission".into()),
        robot: path(root.get("robot")).unwrap_or_default(),
        map: root.get("map").map(map),
        start: root.get("start").map(pose),
        start_file: path(root.get("start").and_then(|start| start.get("file"))),
        goal: root.get("goal").map(pose),
        via: root.get("via").map_or(&[][..], Node::items).iter().map(via).collect(),
        path: root.get("path").and_then(given_path),
        clearance: number("clearance_m", 0.05),
        sampling_time: number("sampling_time_s", 0.1),
        sampling,
        time_law,
        reverse: root.get("reverse").and_then(Node::flag).unwrap_or(false),
        parameterisation: pick(&PARAMETERISATIONS, word("parameterisation"))
            .unwrap_or_else(|| Parameterisation::suiting(time_law)),
        path_error_times: path_error_times(&root),
        path_error_samplings: vec![sampling],
        limits: limits::read(&source, root.get("limits")),
        tolerance: tolerance::read(root.get("tolerance")),
        spans: spans(&source, &root),
        source,
    })
}

/// The value that a word stands for.
fn pick<T: Copy>(words: &[(&str, T)], word: Option<&str>) -> Option<T> {
    words.iter().find(|(w, _)| Some(*w) == word).map(|(_, value)| *value)
}

fn path(node: Option<&Node>) -> Option<PathBuf> {
    node?.text().map(PathBuf::from)
}

pub(super) fn numbers<const N: usize>(node: &Node) -> Option<[f64; N]> {
    let values: Option<Vec<f64>> = node.items().iter().map(Node::number).collect();
    values?.try_into().ok()
}

fn map(node: &Node) -> MapSpec {
    MapSpec {
        file: path(node.get("file")).unwrap_or_default(),
        resolution: node.get("resolution_m").and_then(Node::number),
        height: node.get("height_m").and_then(numbers),
        unknown: match node.get("unknown").and_then(Node::text) {
            Some("free") => Unknown::Free,
            _ => Unknown::Occupied,
        },
        origin: node.get("origin_m").and_then(numbers),
        keep_out: solids::keep_outs(node),
        boxes: solids::boxes(node),
        speed_zones: zones::zones(node),
    }
}

fn pose(node: &Node) -> PoseSpec {
    let joints = node.get("joints").map_or(&[][..], Node::entries);
    let link = node.get("link").and_then(link);
    let own = |key: &str, axis: usize| {
        node.get(key).and_then(Node::number).or(link.as_ref().map(|link: &LinkSpec| link.position[axis]))
    };
    PoseSpec {
        x: own("x_m", 0),
        y: own("y_m", 1),
        within: node.get("within_m").and_then(Node::number).unwrap_or(0.0),
        yaw: node.get("yaw").and_then(Node::angle),
        joints: joints.iter().filter_map(|e| Some((e.key.clone(), e.value.angle()?))).collect(),
        link,
    }
}

fn link(node: &Node) -> Option<LinkSpec> {
    let angles: Option<Vec<f64>> = node.get("rpy").and_then(|rpy| rpy.items().iter().map(Node::angle).collect());
    Some(LinkSpec {
        name: node.get("name")?.text()?.to_owned(),
        position: numbers(node.get("position_m")?)?,
        rpy: angles.and_then(|angles| angles.try_into().ok()),
        within: node.get("within_m").and_then(Node::number).unwrap_or(LINK_WITHIN),
    })
}

fn via(node: &Node) -> ViaSpec {
    ViaSpec { place: pose(node), dwell: node.get("dwell_s").and_then(Node::number).unwrap_or(0.0) }
}

fn given_path(node: &Node) -> Option<PathSpec> {
    match node.get("file") {
        Some(file) => path(Some(file)).map(PathSpec::File),
        None => node.get("bezier")?.items().iter().map(segment).collect::<Option<_>>().map(PathSpec::Bezier),
    }
}

fn segment(node: &Node) -> Option<[[f64; 2]; 4]> {
    let points: Option<Vec<[f64; 2]>> = node.items().iter().map(numbers).collect();
    points?.try_into().ok()
}

fn path_error_times(root: &Node) -> Vec<f64> {
    let given = root.get("path_error").and_then(|p| p.get("sampling_times_s"));
    let Some(given) = given else { return vec![0.01, 0.02, 0.05, 0.1, 0.2, 0.5] };
    let mut times: Vec<f64> = given.items().iter().filter_map(Node::number).collect();
    times.sort_by(f64::total_cmp);
    times.dedup();
    times
}

fn spans(source: &Arc<Source>, root: &Node) -> MissionSpans {
    let value = |table: &str, key: &str| Some(Span::new(source, root.get(table)?.get(key)?.range.clone()));
    let whole = |key: &str| root.entry(key).map(|e| Span::new(source, with_key(e)));
    let mut joints = Vec::new();
    let vias = root.get("via").map_or(&[][..], Node::items);
    let places = ["start", "goal"].map(|key| (key.to_owned(), root.get(key))).into_iter();
    for (under, place) in places.chain(vias.iter().enumerate().map(|(i, via)| (format!("via[{i}]"), Some(via)))) {
        let named = place.and_then(|p| p.get("joints")).map_or(&[][..], Node::entries);
        joints.extend(named.iter().map(|e| NamedJoint {
            name: e.key.clone(),
            under: under.clone(),
            at: Span::new(source, e.key_range.clone()),
        }));
    }
    let limited = limits::joint_names(source, root.get("limits"));
    joints.extend(limited.into_iter().map(|(name, at)| NamedJoint { name, under: "limits.joints".into(), at }));
    MissionSpans {
        robot: root.get("robot").map(|n| Span::new(source, n.range.clone())),
        map: whole("map"),
        map_file: value("map", "file"),
        map_resolution: value("map", "resolution_m"),
        map_height: value("map", "height_m"),
        map_origin: value("map", "origin_m"),
        start: whole("start"),
        start_file: value("start", "file"),
        goal: whole("goal"),
        goal_link: root
            .get("goal")
            .and_then(|goal| Some(Span::new(source, goal.get("link")?.get("name")?.range.clone()))),
        via: vias.iter().map(|via| Span::new(source, via.range.clone())).collect(),
        path: whole("path"),
        path_file: value("path", "file"),
        time_law: value_of(source, root, "time_law"),
        joints,
    }
}

fn value_of(source: &Arc<Source>, root: &Node, key: &str) -> Option<Span> {
    root.get(key).map(|n| Span::new(source, n.range.clone()))
}

/// A pair from its key to its value's end; the key alone where the value is an alias to elsewhere.
fn with_key(entry: &Entry) -> std::ops::Range<usize> {
    entry.key_range.start..entry.value.range.end.max(entry.key_range.end)
}

/// Faults that no single key shows.
struct Between<'a> {
    source: &'a Arc<Source>,
    root: &'a Node,
}

impl Between<'_> {
    fn check(&self) -> Vec<Diagnostic> {
        let mut faults = limits::check(self.source, self.root.get("limits"));
        if self.has(self.root, &MISSION, "path") {
            self.given_path(&mut faults);
        } else {
            self.search(&mut faults);
        }
        self.start_file(&mut faults);
        if let Some(map) = self.root.get("map") {
            faults.extend(solids::check(self.source, map));
            faults.extend(zones::check(self.source, map));
        }
        if let Some(height) = self.root.get("map").and_then(|m| m.get("height_m"))
            && let Some([low, high]) = numbers(height)
            && low >= high
        {
            let message = format!("`map.height_m`: the floor ({low} m) is not below the ceiling ({high} m)");
            faults
                .push(self.at("mission/height", message, height).hint("write [floor, ceiling], such as `[0.02, 1.0]`"));
        }
        faults
    }

    /// Whether a key is there, well formed or not.
    fn has(&self, node: &Node, table: &[Field], key: &str) -> bool {
        shape::nearly_has(node, table, key)
    }

    fn at(&self, code: &'static str, message: String, node: &Node) -> Diagnostic {
        Diagnostic::error(code, message).at(&Span::new(self.source, node.range.clone()))
    }

    /// Without a given path: map, start and goal, each with a position; a heading to start with.
    fn search(&self, faults: &mut Vec<Diagnostic>) {
        let top = Span::new(self.source, self.root.range.start..self.root.range.start);
        let missing: Vec<&str> =
            ["map", "start", "goal"].into_iter().filter(|k| !self.has(self.root, &MISSION, k)).collect();
        if missing.len() == 3 {
            let message = "a mission needs either `map`, `start` and `goal`, or a given `path`; it has none of them";
            let hint = "for example `map: {file: ../maps/arch_bridges.pcd}`, `start: {x_m: 0.5, y_m: 0.5, yaw: 0deg}`, \
                        `goal: {x_m: 9.0, y_m: 8.0}`";
            faults.push(Diagnostic::error("mission/nothing-to-plan", message).at(&top).hint(hint));
            return;
        }
        for key in missing {
            let example = MISSION.iter().find(|f| f.key == key).map_or("", |f| f.example);
            let message = format!("a mission without a given `path` needs `{key}`, which is missing");
            let hint = format!("add `{key}: {example}`");
            faults.push(Diagnostic::error("mission/missing-key", message).at(&top).hint(hint));
        }
        for (key, table, parts) in
            [("start", &START[..], &["x_m", "y_m", "yaw"][..]), ("goal", &GOAL[..], &["x_m", "y_m"])]
        {
            let Some(pose) = self.root.entry(key) else { continue };
            if key == "start" && self.has(&pose.value, table, "file") {
                continue;
            }
            if key == "goal" && self.has(&pose.value, table, "link") {
                self.link_goal(&pose.value, faults);
                continue;
            }
            // Not a map at all: already said.
            let empty = matches!(&pose.value.value, yaml::Value::Map(_));
            let missing: Vec<String> =
                parts.iter().filter(|p| empty && !self.has(&pose.value, table, p)).map(|p| format!("`{p}`")).collect();
            if !missing.is_empty() {
                let are = if missing.len() == 1 { "is" } else { "are" };
                let message = format!("`{key}` needs {}, which {are} missing", one_and_one(&missing));
                let hint = match key {
                    "start" => "where the robot stands is known: `start: {x_m: 0.5, y_m: 0.5, yaw: 0deg}`",
                    _ => "for example `goal: {x_m: 9.0, y_m: 8.0}`; its yaw may be left out",
                };
                let at = Span::new(self.source, pose.key_range.clone());
                faults.push(Diagnostic::error("mission/missing-key", message).at(&at).hint(hint));
            }
        }
    }

    /// The link's place is the goal: nothing else may say where the base stands.
    fn link_goal(&self, goal: &Node, faults: &mut Vec<Diagnostic>) {
        for key in ["x_m", "y_m", "within_m"] {
            let Some(entry) = goal.entry(key) else { continue };
            let at = Span::new(self.source, entry.key_range.clone());
            let message = format!(
                "`goal.{key}` and `goal.link` exclude each other: where the base stands follows from the link's place"
            );
            let hint = format!("remove `{key}`, or `link`; how far the link may be from its place is `link.within_m`");
            faults.push(Diagnostic::error("mission/two-goals", message).at(&at).hint(hint));
        }
    }

    /// A file says where it ends, with all joints: nothing else may.
    fn start_file(&self, faults: &mut Vec<Diagnostic>) {
        let Some(start) = self.root.get("start") else { return };
        let Some(file) = start.entry("file") else { return };
        if self.has(self.root, &MISSION, "path") {
            let at = Span::new(self.source, file.key_range.clone());
            let message = "`start.file` and a given `path` exclude each other: a given path begins where it does";
            let hint = "remove `start`, or plan the way with `map` and `goal`";
            faults.push(Diagnostic::error("mission/start-and-path", message).at(&at).hint(hint));
        }
        for key in ["x_m", "y_m", "yaw", "joints"] {
            let Some(entry) = start.entry(key) else { continue };
            let at = Span::new(self.source, entry.key_range.clone());
            let message =
                format!("`start.{key}` and `start.file` exclude each other: the file's last row says where all is");
            let hint = format!("remove `{key}`, or `file`");
            faults.push(Diagnostic::error("mission/two-starts", message).at(&at).hint(hint));
        }
    }

    fn given_path(&self, faults: &mut Vec<Diagnostic>) {
        if let Some(link) = self.root.get("goal").and_then(|goal| goal.entry("link")) {
            let at = Span::new(self.source, link.key_range.clone());
            let message = "`goal.link` and a given `path` exclude each other: a given path ends where it does";
            let hint = "remove `link`, or plan the way with `map` and `start`";
            faults.push(Diagnostic::error("mission/link-and-path", message).at(&at).hint(hint));
        }
        if let Some(via) = self.root.entry("via") {
            let at = Span::new(self.source, via.key_range.clone());
            let message = "`via` and a given `path` exclude each other: the path is driven as it is";
            let hint = "remove `via` and lead the path through its places, or remove `path`";
            faults.push(Diagnostic::error("mission/via-and-path", message).at(&at).hint(hint));
        }
        let Some(path) = self.root.entry("path") else { return };
        let yaml::Value::Map(_) = path.value.value else { return };
        let key = Span::new(self.source, path.key_range.clone());
        match (self.has(&path.value, &PATH, "bezier"), self.has(&path.value, &PATH, "file")) {
            (true, true) => faults.push(
                Diagnostic::error("mission/two-paths", "`path` has both `bezier` and `file`")
                    .at(&key)
                    .hint("keep one of the two"),
            ),
            (false, false) => faults.push(
                Diagnostic::error("mission/no-path", "`path` needs `bezier` or `file`, and has neither").at(&key).hint(
                    "for example `path: {bezier: [[[0, 0], [2, 0], [4, 2], [4, 4]]]}` or `path: {file: path.csv}`",
                ),
            ),
            _ => {}
        }
        let segments = path.value.get("bezier").map_or(&[][..], Node::items);
        let mut last_end: Option<[f64; 2]> = None;
        for (i, node) in segments.iter().enumerate() {
            let Some(points) = segment(node) else {
                last_end = None;
                continue;
            };
            if let Some(end) = last_end {
                let gap = real::hypot(points[0][0] - end[0], points[0][1] - end[1]);
                if gap > JOIN_TOLERANCE {
                    let message = format!(
                        "`path.bezier[{i}]` begins {} m away from where the segment before it ends: [{}, {}], not [{}, {}]",
                        rounded(gap),
                        points[0][0],
                        points[0][1],
                        end[0],
                        end[1],
                    );
                    let hint = "a segment's first point repeats the last point of the one before it";
                    faults.push(self.at("mission/path-gap", message, &node.items()[0]).hint(hint));
                }
            }
            if points.iter().all(|p| *p == points[0]) {
                let message = format!("`path.bezier[{i}]` has four equal points, so it goes nowhere");
                faults.push(self.at("mission/path-point", message, node).hint("remove the segment"));
            }
            last_end = Some(points[3]);
        }
    }
}

fn one_and_one(words: &[String]) -> String {
    match words {
        [first @ .., last] if !first.is_empty() => format!("{} and {last}", first.join(", ")),
        _ => words.concat(),
    }
}

/// Six significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}
