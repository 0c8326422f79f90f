//! `trajc.scenes/1`: strict JSON, every fault with its place in the tree.

use std::sync::Arc;

use super::fault::{self, ScenesError};
use super::json::{Json, shortened};
use super::place::places;
use super::scenes::{SCHEMA, Scene, SceneSet};
use crate::diag::shape::{Field, LARGE, Shape};
use crate::diag::{Describe, Diagnostic, Diagnostics, Source, Span, nearest, shape, yaml};
use crate::geom::Aabb;
use crate::map::VoxelMap;
use crate::mission::{LimitsSpec, PoseSpec, Unknown, limits};

/// Longest text that is read, bytes: some ten thousand scenes.
pub const LONGEST: usize = 16 << 20;
/// Most scenes of a file, and most boxes of a scene.
const MOST_SCENES: usize = 20_000;
const MOST_BOXES: usize = 20_000;
/// Clearance that is proven where the file says nothing, m; the same as a mission's.
const CLEARANCE: f64 = 0.05;

const TOP: &[&str] = &["schema", "name", "seed", "bounds", "resolution", "clearance_m", "limits", "reverse", "scenes"];
/// `passage_radius` is what a generator may note beside a scene: the widest disc that gets through.
const SCENE: &[&str] = &["id", "kind", "boxes", "start", "goal", "passage_radius"];
const BOX: &[&str] = &["min", "max"];
const POSE: &[&str] = &["x", "y", "yaw", "joints"];

/// `limits`, with the keys of a mission.
static LIMITS: [Field; 1] =
    [Field::optional("limits", Shape::Table(&limits::FIELDS), "{\"base\": {\"eta\": 0.4}}", "over the robot's")];

/// Reads a set of scenes. `file` is the file's path as the user knows it.
///
/// # Errors
/// All faults found (the first hundred), each with the place in the tree: syntax, another schema, unknown, repeated or missing
/// keys, values of the wrong type or out of range, boxes upside down, ids that are no folder's name or not distinct, a grid
/// that is too large.
pub fn read(file: &str, text: &str) -> Result<SceneSet, Diagnostics> {
    if text.len() > LONGEST {
        let fault = ScenesError::Range {
            path: file.into(),
            range: format!("at most {LONGEST} bytes"),
            found: format!("{} bytes", text.len()),
        };
        return Err(fault.diagnostic().file(file).hint("split the file: scenes do not depend on each other").into());
    }
    let fail = |fault: ScenesError| fault::diagnostics(file, text, &[fault]);
    let tree: Json = serde_json::from_str(text.trim_start_matches('\u{feff}')).map_err(|e| fail(syntax(text, &e)))?;
    let mut reader = Reader { faults: Vec::new(), others: Vec::new() };
    let set = reader.document(file, text, &tree);
    let mut all = fault::diagnostics(file, text, &reader.faults);
    all.0.extend(reader.others);
    let Some(set) = set.filter(|_| all.0.is_empty()) else { return Err(all) };
    if let Some((i, id)) = set.repeated_id() {
        return Err(fail(ScenesError::RepeatedId { path: format!("scenes[{i}].id"), id: id.into() }));
    }
    // Too large a grid is refused before the first scene, not in its midst.
    VoxelMap::from_boxes(set.bounds, set.resolution, &[], Unknown::Occupied).map_err(|mut diagnostics| {
        let hint = "choose a larger `resolution` or smaller `bounds`";
        let source = Arc::new(Source { name: file.into(), text: text.into() });
        let bounds = places(text, "bounds", join).into_iter().next().map_or(0..0, |place| place.value);
        let at = Span::new(&source, bounds);
        diagnostics.0.iter_mut().for_each(|d| (d.at, d.hint) = (Some(at.clone()), Some(hint.into())));
        diagnostics
    })?;
    Ok(set)
}

/// What the JSON parser says, without its line and column, which become a place.
fn syntax(text: &str, error: &serde_json::Error) -> ScenesError {
    let words = error.to_string();
    let mut fault = words.split(" at line ").next().unwrap_or_default().to_owned();
    let end = text.trim_end().len();
    if error.is_eof() {
        let (within, close) = match fault.rsplit(' ').next() {
            Some("object") => ("an object", "`,` or `}`"),
            Some("list") => ("a list", "`,` or `]`"),
            Some("string") => ("a text", "its closing quote"),
            _ => ("the document", "a value"),
        };
        fault = format!("{within} does not end, expected {close}");
        return ScenesError::Syntax { fault, found: "the end of the file".into(), at: end };
    }
    let line: usize = text.split_inclusive('\n').take(error.line().saturating_sub(1)).map(str::len).sum();
    let mut at = (line + error.column().saturating_sub(1)).min(end);
    while !text.is_char_boundary(at) {
        at -= 1;
    }
    let rest = text[at..].lines().next().unwrap_or_default().trim();
    ScenesError::Syntax { fault, found: format!("`{}`", shortened(rest)), at }
}

struct Reader {
    faults: Vec<ScenesError>,
    /// Of `limits`, which a mission's table checks.
    others: Vec<Diagnostic>,
}

/// Place of a key below another.
pub(super) fn join(path: &str, key: &str) -> String {
    if path.is_empty() { shortened(key) } else { format!("{path}.{}", shortened(key)) }
}

impl Reader {
    fn fault<T>(&mut self, fault: ScenesError) -> Option<T> {
        self.faults.push(fault);
        None
    }

    fn kind<T>(&mut self, path: &str, expected: &'static str, found: &Json) -> Option<T> {
        self.fault(ScenesError::Kind { path: path.into(), expected, found: found.kind() })
    }

    fn full(&self) -> bool {
        self.faults.len() >= fault::MOST
    }

    fn document(&mut self, file: &str, text: &str, tree: &Json) -> Option<SceneSet> {
        let top = self.object(tree, "", TOP)?;
        let schema = self.required(top, "", "schema", "\"schema\": \"trajc.scenes/1\"")?;
        if *schema != Json::Text(SCHEMA.into()) {
            return self.fault(ScenesError::Schema { found: schema.kind() });
        }
        let name = match get(top, "name") {
            None => Some(String::new()),
            Some(Json::Text(text)) => Some(text.clone()),
            Some(other) => self.kind("name", "text", other),
        };
        if let Some(seed) = get(top, "seed")
            && !matches!(seed, Json::Number(_) | Json::Null)
        {
            self.kind::<()>("seed", "a number", seed);
        }
        let bounds = self
            .required(top, "", "bounds", "\"bounds\": [[0, 0, 0], [10, 10, 1]]")
            .and_then(|value| self.bounds(value));
        let resolution = self
            .required(top, "", "resolution", "\"resolution\": 0.05")
            .and_then(|value| self.number(value, "resolution", 1e-4, 10.0));
        let clearance = match get(top, "clearance_m") {
            None => Some(CLEARANCE),
            Some(value) => self.number(value, "clearance_m", 0.0, LARGE),
        };
        let reverse = match get(top, "reverse") {
            None => Some(false),
            Some(Json::Flag(flag)) => Some(*flag),
            Some(other) => self.kind("reverse", "true or false", other),
        };
        let limits = get(top, "limits").map_or(Some(LimitsSpec::default()), |value| self.limits(file, text, value));
        let scenes = self.required(top, "", "scenes", "\"scenes\": [{\"id\": \"a\", …}]").and_then(|s| self.scenes(s));
        Some(SceneSet {
            file: file.into(),
            name: name?,
            bounds: bounds?,
            resolution: resolution?,
            clearance: clearance?,
            limits: limits?,
            reverse: reverse?,
            scenes: scenes?,
        })
    }

    /// The entries of an object; unknown and repeated keys are faults.
    fn object<'a>(
        &mut self,
        value: &'a Json,
        path: &str,
        known: &'static [&'static str],
    ) -> Option<&'a [(String, Json)]> {
        let Json::Map(entries) = value else {
            return self.kind(if path.is_empty() { "the document" } else { path }, "an object", value);
        };
        for (i, (key, _)) in entries.iter().enumerate() {
            if self.full() {
                break;
            }
            if !known.contains(&key.as_str()) {
                self.fault::<()>(ScenesError::UnknownKey { path: join(path, key), key: key.clone(), known });
            } else if entries[..i].iter().any(|(other, _)| other == key) {
                self.fault::<()>(ScenesError::RepeatedKey { path: join(path, key) });
            }
        }
        Some(entries)
    }

    fn required<'a>(
        &mut self,
        entries: &'a [(String, Json)],
        path: &str,
        key: &str,
        example: &'static str,
    ) -> Option<&'a Json> {
        let found = get(entries, key);
        // An unknown key that is near to it was told with that hint; once is enough.
        let told = || {
            let known = [TOP, SCENE, BOX, POSE].into_iter().find(|known| known.contains(&key)).unwrap_or(&[]);
            let strange = entries.iter().map(|(key, _)| key.as_str()).filter(|key| !known.contains(key));
            strange.into_iter().any(|strange| nearest(strange, known.iter().copied()) == Some(key))
        };
        if found.is_none() && !told() {
            return self.fault(ScenesError::Missing { path: join(path, key), example });
        }
        found
    }

    fn number(&mut self, value: &Json, path: &str, least: f64, most: f64) -> Option<f64> {
        match value {
            Json::Number(number) if (least..=most).contains(number) => Some(*number),
            Json::Number(number) => self.fault(ScenesError::Range {
                path: path.into(),
                range: format!("between {least} and {most}"),
                found: number.to_string(),
            }),
            other => self.kind(path, "a number", other),
        }
    }

    fn list<'a>(&mut self, value: &'a Json, path: &str, expected: &'static str) -> Option<&'a [Json]> {
        match value {
            Json::List(items) => Some(items),
            other => self.kind(path, expected, other),
        }
    }

    fn point(&mut self, value: &Json, path: &str) -> Option<[f64; 3]> {
        let items = self.list(value, path, "[x, y, z] in metres")?;
        let [x, y, z] = items else { return self.kind(path, "[x, y, z] in metres", value) };
        let mut axis = |value, i| self.number(value, &format!("{path}[{i}]"), -LARGE, LARGE);
        let (x, y, z) = (axis(x, 0), axis(y, 1), axis(z, 2));
        Some([x?, y?, z?])
    }

    /// A box whose extent must be positive in `bounds`, and not negative elsewhere.
    fn corners(&mut self, path: &str, min: [f64; 3], max: [f64; 3], flat: bool) -> Option<Aabb> {
        for (a, axis) in ['x', 'y', 'z'].into_iter().enumerate() {
            if min[a] > max[a] || min[a] == max[a] && !flat {
                return self.fault(ScenesError::UpsideDown { path: path.into(), axis, low: min[a], high: max[a] });
            }
        }
        Some(Aabb { min, max })
    }

    fn bounds(&mut self, value: &Json) -> Option<Aabb> {
        const FORM: &str = "[lower corner, upper corner]";
        let items = self.list(value, "bounds", FORM)?;
        let [low, high] = items else { return self.kind("bounds", FORM, value) };
        let (low, high) = (self.point(low, "bounds[0]"), self.point(high, "bounds[1]"));
        self.corners("bounds", low?, high?, false)
    }

    /// Checked by the table of a mission's limits, which knows keys, units and ranges.
    fn limits(&mut self, file: &str, text: &str, value: &Json) -> Option<LimitsSpec> {
        if !matches!(value, Json::Map(_)) {
            return self.kind("limits", "an object", value);
        }
        let source = Arc::new(Source { name: file.into(), text: only_limits(text) });
        let mut faults = match yaml::load(&source) {
            Err(diagnostics) => diagnostics.0,
            Ok(root) => {
                let mut faults = shape::check(&source, &root, &LIMITS, "a set of scenes", "`limits`");
                if faults.is_empty() {
                    faults = limits::check(&source, root.get("limits"));
                }
                if faults.is_empty() {
                    return Some(limits::read(&source, root.get("limits")));
                }
                faults
            }
        };
        // Same places, in the text as it is.
        let written = Arc::new(Source { name: file.into(), text: text.into() });
        for fault in &mut faults {
            fault.at = fault.at.as_ref().map(|at| Span::new(&written, at.range.clone()));
        }
        self.others.extend(faults);
        None
    }

    fn scenes(&mut self, value: &Json) -> Option<Vec<Scene>> {
        let items = self.list(value, "scenes", "a list of scenes")?;
        if !(1..=MOST_SCENES).contains(&items.len()) {
            let range = format!("a list of 1 to {MOST_SCENES} scenes");
            return self.fault(ScenesError::Range { path: "scenes".into(), range, found: items.len().to_string() });
        }
        let mut scenes = Vec::new();
        for (i, item) in items.iter().enumerate() {
            if self.full() {
                return None;
            }
            scenes.extend(self.scene(item, &format!("scenes[{i}]")));
        }
        // Faults make the set fail; a list that lacks scenes is never used.
        Some(scenes)
    }

    fn scene(&mut self, value: &Json, path: &str) -> Option<Scene> {
        let entries = self.object(value, path, SCENE)?;
        let id = self.required(entries, path, "id", "\"id\": \"table1-15-1-000\"").and_then(|v| self.id(v, path));
        let boxes = self
            .required(entries, path, "boxes", "\"boxes\": [{\"min\": [1, 1, 0], \"max\": [1.6, 1.6, 0.4]}]")
            .and_then(|v| self.boxes(v, &join(path, "boxes")));
        let mut pose = |key| {
            let example = "\"start\": {\"x\": 0.5, \"y\": 0.5, \"yaw\": 0.0}";
            self.required(entries, path, key, example).and_then(|v| self.pose(v, &join(path, key)))
        };
        let (start, goal) = (pose("start"), pose("goal"));
        if let Some(radius) = get(entries, "passage_radius") {
            self.number(radius, &join(path, "passage_radius"), 0.0, LARGE);
        }
        let kind = match get(entries, "kind") {
            None => Some(None),
            Some(Json::Text(kind)) => Some(Some(shortened(kind))),
            Some(other) => self.kind(&join(path, "kind"), "text", other),
        };
        Some(Scene { id: id?, kind: kind?, boxes: boxes?, start: start?, goal: goal? })
    }

    fn id(&mut self, value: &Json, path: &str) -> Option<String> {
        let path = join(path, "id");
        let Json::Text(id) = value else { return self.kind(&path, "text", value) };
        let plain = |c: char| c.is_alphanumeric() || matches!(c, '-' | '_' | '.');
        if (1..=100).contains(&id.len()) && id.chars().all(plain) && !id.starts_with('.') {
            return Some(id.clone());
        }
        self.fault(ScenesError::Id { path, id: id.clone() })
    }

    fn boxes(&mut self, value: &Json, path: &str) -> Option<Vec<Aabb>> {
        let items = self.list(value, path, "a list of boxes")?;
        if items.len() > MOST_BOXES {
            let range = format!("a list of at most {MOST_BOXES} boxes");
            return self.fault(ScenesError::Range { path: path.into(), range, found: items.len().to_string() });
        }
        let mut boxes = Vec::new();
        for (i, item) in items.iter().enumerate() {
            if self.full() {
                return None;
            }
            let path = format!("{path}[{i}]");
            let Some(entries) = self.object(item, &path, BOX) else { continue };
            let mut corner = |key, example| {
                self.required(entries, &path, key, example).and_then(|v| self.point(v, &join(&path, key)))
            };
            let corners = (corner("min", "\"min\": [1, 1, 0]"), corner("max", "\"max\": [1.6, 1.6, 0.4]"));
            if let (Some(min), Some(max)) = corners {
                boxes.extend(self.corners(&path, min, max, true));
            }
        }
        Some(boxes)
    }

    fn pose(&mut self, value: &Json, path: &str) -> Option<PoseSpec> {
        let entries = self.object(value, path, POSE)?;
        let mut part = |key| {
            let value = self.required(entries, path, key, "{\"x\": 0.5, \"y\": 0.5, \"yaw\": 0.0}")?;
            self.number(value, &join(path, key), -LARGE, LARGE)
        };
        let (x, y, yaw) = (part("x"), part("y"), part("yaw"));
        let mut pose = PoseSpec { x: Some(x?), y: Some(y?), yaw: Some(yaw?), ..PoseSpec::default() };
        match get(entries, "joints") {
            None => {}
            Some(Json::Map(joints)) => {
                let under = join(path, "joints");
                for (name, value) in joints {
                    let at = join(&under, name);
                    let value = self.number(value, &at, -LARGE, LARGE)?;
                    if pose.joints.insert(name.clone(), value).is_some() {
                        return self.fault(ScenesError::RepeatedKey { path: at });
                    }
                }
            }
            Some(other) => return self.kind(&join(path, "joints"), "an object of joint values", other),
        }
        Some(pose)
    }
}

/// The first value with this key.
/// The text with blanks for all but `{"limits": …}`, for the reader of YAML, which JSON is.
fn only_limits(text: &str) -> String {
    let Some(place) = places(text, "limits", join).into_iter().next() else { return String::new() };
    let from = place.key.map_or(place.value.start, |key| key.start);
    let (open, close) = (text.find('{').unwrap_or(0), text.rfind('}').unwrap_or(0));
    let kept = |at: usize, byte: u8| match byte {
        b'\n' => byte,
        b'\t' | b'\r' => b' ',
        _ if (from..place.value.end).contains(&at) || at == open || at == close => byte,
        _ => b' ',
    };
    let bytes = text.bytes().enumerate().map(|(at, byte)| kept(at, byte)).collect();
    String::from_utf8(bytes).unwrap_or_default()
}

fn get<'a>(entries: &'a [(String, Json)], key: &str) -> Option<&'a Json> {
    entries.iter().find(|(k, _)| k == key).map(|(_, value)| value)
}

#[cfg(test)]
mod tests;
