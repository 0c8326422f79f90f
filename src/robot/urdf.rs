//! URDF text to urdf-rs' model, behind a check of everything urdf-rs lets pass.
//!
//! urdf-rs validates neither names nor the tree nor numbers, overflows its stack on deep XML and gives no places. So the text is
//! first read with roxmltree: depth, entities, names, references and numbers are judged there, with spans. urdf-rs then sees only
//! what this stage uses; visuals, inertias and foreign elements are blanked, since a fault in them does not matter here.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Quaternion, UnitQuaternion};
use roxmltree::{Attribute, Document, Node};

use crate::diag::{Diagnostic, Diagnostics, Source, Span, nearest, suggestion};

/// Deepest nesting of elements that is read; real URDFs have about 6.
const MAX_DEPTH: usize = 64;

/// What to do about a URDF that passes the checks here and is refused by urdf-rs.
const UNREADABLE: &str = "`check_urdf` of the package liburdfdom-tools may say more";

/// A checked URDF: names are unique, references resolve, numbers are finite.
pub(super) struct Urdf {
    /// The text, for quoting.
    pub source: Arc<Source>,
    /// What urdf-rs read.
    pub robot: urdf_rs::Robot,
    /// Place of each link, as in `robot.links`.
    pub link_spans: Vec<Span>,
    /// Place of each link's `<collision>` elements.
    pub collision_spans: Vec<Vec<Span>>,
    /// Place of each joint, as in `robot.joints`.
    pub joint_spans: Vec<Span>,
    /// Which joints have a `<limit>`.
    pub has_limit: Vec<bool>,
}

impl Urdf {
    /// A place for faults of the whole file: the name in `<robot>`.
    pub fn whole(&self) -> Span {
        let start = self.source.text.find("<robot").unwrap_or(0);
        Span::new(&self.source, start..start + "<robot".len())
    }
}

/// Reads and checks a URDF.
///
/// # Errors
/// All faults found; those that hide others (XML syntax, depth) alone.
pub(super) fn read(name: &str, text: &str) -> Result<Urdf, Diagnostics> {
    let source = Arc::new(Source { name: name.into(), text: text.into() });
    let document = Document::parse(text).map_err(|error| syntax_error(&source, &error))?;
    check_depth(&source, &document)?;
    if let Some(fault) = still_xacro(&source, &document) {
        return Err(fault.into());
    }

    let mut check = Check { source: &source, faults: Vec::new() };
    let root = document.root_element();
    if !root.has_tag_name("robot") {
        let message = format!("the root element is <{}>, not <robot>", root.tag_name().name());
        let hint = match root.tag_name().name() {
            "sdf" => "SDF is another format: convert it to a URDF",
            _ => "a URDF begins with <robot name=\"…\">: name the robot's URDF",
        };
        return Err(Diagnostic::error("robot/not-urdf", message).at(&check.start(root)).hint(hint).into());
    }
    let links: Vec<Node> = root.children().filter(|n| n.has_tag_name("link")).collect();
    let joints: Vec<Node> = root.children().filter(|n| n.has_tag_name("joint")).collect();
    if links.is_empty() {
        let hint = "it needs one at least: <link name=\"base_link\">";
        let fault = Diagnostic::error("robot/no-links", "the URDF has no <link>").at(&check.start(root)).hint(hint);
        return Err(fault.into());
    }
    let link_names = check.names(&links, "link");
    let joint_names = check.names(&joints, "joint");
    for link in &links {
        check.link(*link);
    }
    for joint in &joints {
        check.joint(*joint, &link_names, &joint_names);
    }
    if !check.faults.is_empty() {
        return Err(Diagnostics(check.faults));
    }

    let link_spans = links.iter().map(|n| check.name_span(*n)).collect();
    let joint_spans = joints.iter().map(|n| check.name_span(*n)).collect();
    let collision_spans = links
        .iter()
        .map(|n| n.children().filter(|c| c.has_tag_name("collision")).map(|c| check.start(c)).collect())
        .collect();
    let has_limit = joints.iter().map(|n| n.children().any(|c| c.has_tag_name("limit"))).collect();
    let robot = urdf_rs::read_from_string(&reduced(text, root)).map_err(|error| {
        let message = format!("not a URDF that can be read: {error}");
        Diagnostic::error("robot/unreadable-urdf", message).at(&check.start(root)).hint(UNREADABLE)
    })?;
    if robot.links.len() != links.len() || robot.joints.len() != joints.len() {
        let message = format!(
            "{} links and {} joints are written, {} and {} were read",
            links.len(),
            joints.len(),
            robot.links.len(),
            robot.joints.len()
        );
        return Err(Diagnostic::error("robot/unreadable-urdf", message).at(&check.start(root)).hint(UNREADABLE).into());
    }
    Ok(Urdf { source: source.clone(), robot, link_spans, collision_spans, joint_spans, has_limit })
}

fn syntax_error(source: &Arc<Source>, error: &roxmltree::Error) -> Diagnostic {
    let at = position(&source.text, error.pos().row as usize, error.pos().col as usize);
    let fault = |message: String, at: &Span, hint: String| Diagnostic::error("robot/xml", message).at(at).hint(hint);
    let there = character(source, at);
    if source.text.contains("xacro:") {
        return fault(format!("not valid XML: {error}"), &there, expand(&source.name));
    }
    match error {
        roxmltree::Error::DtdDetected => fault(
            "the URDF has a <!DOCTYPE>, which none needs".into(),
            &source.text.find("<!DOCTYPE").map_or(there, |at| Span::new(source, at..at + "<!DOCTYPE".len())),
            "a URDF needs no <!DOCTYPE> and no entities: remove them".into(),
        ),
        roxmltree::Error::NoRootNode => fault(
            "the URDF has no element, expected a <robot>".into(),
            &there,
            "a URDF begins with <robot name=\"…\"> and ends with </robot>".into(),
        ),
        roxmltree::Error::UnclosedRootNode => unclosed(source),
        roxmltree::Error::UnexpectedCloseTag(expected, actual, _) => fault(
            format!("not valid XML: found </{actual}>, expected </{expected}>"),
            &there,
            format!("close <{expected}> first, or remove the closing tag </{actual}>"),
        ),
        roxmltree::Error::DuplicatedAttribute(name, _) => fault(
            format!("not valid XML: the attribute '{name}' is there twice, expected once"),
            &there,
            format!("keep one `{name}=\"…\"`"),
        ),
        other => {
            // Its own words end in the place, which is shown.
            let words = other.to_string();
            let words = words.rsplit_once(" at ").map_or(words.as_str(), |(words, _)| words);
            let hint = "look at the tag there: values are in quotes, `name=\"value\"`, and every <tag> ends in /> or has its </tag>";
            fault(format!("not valid XML: {words}"), &there, hint.into())
        }
    }
}

/// A text that ends before its elements do: names the innermost one and points to its tag.
fn unclosed(source: &Arc<Source>) -> Diagnostic {
    let text = &source.text;
    let (mut open, mut at): (Vec<Range<usize>>, usize) = (Vec::new(), 0);
    while let Some(start) = text[at..].find('<').map(|i| at + i) {
        let rest = &text[start..];
        let ends = |with: &str| rest.find(with).map_or(text.len(), |i| start + i + with.len());
        at = match rest {
            _ if rest.starts_with("<!--") => ends("-->"),
            _ if rest.starts_with("<![CDATA[") => ends("]]>"),
            _ if rest.starts_with("<?") => ends("?>"),
            _ => ends(">"),
        };
        if rest.starts_with("</") {
            open.pop();
        } else if !rest.starts_with("<!") && !rest.starts_with("<?") && !text[..at].ends_with("/>") {
            let name =
                rest[1..].find(|c: char| c.is_whitespace() || c == '>' || c == '/').map_or(rest.len(), |i| i + 1);
            open.push(start..start + name);
        }
    }
    let tag = open.last().cloned().unwrap_or(0..0);
    let name = text[tag.clone()].trim_start_matches('<');
    let message = format!("not valid XML: the file ends within <{name}>, expected </{name}>");
    let hint = format!("add the closing tag </{name}>, or was the file cut off?");
    Diagnostic::error("robot/xml", message).at(&Span::new(source, tag)).hint(hint)
}

/// A fault where elements are left that xacro would have replaced.
fn still_xacro(source: &Arc<Source>, document: &Document) -> Option<Diagnostic> {
    let foreign = |n: &Node| n.tag_name().namespace().is_some_and(|name| name.contains("xacro"));
    let left: Vec<Node> = document.descendants().filter(|n| n.is_element() && foreign(n)).collect();
    let first = left.first()?;
    let message = format!(
        "this is a xacro file, not yet a URDF: {} elements are for xacro, the first is <xacro:{}>",
        left.len(),
        first.tag_name().name()
    );
    let at = Check { source, faults: Vec::new() }.start(*first);
    Some(Diagnostic::error("robot/xacro", message).at(&at).hint(expand(&source.name)))
}

/// The command that makes a URDF of a xacro file.
fn expand(name: &str) -> String {
    let stem = name.strip_suffix(".xacro").unwrap_or(name);
    let (stem, own) = stem.strip_suffix(".urdf").map_or((stem, false), |s| (s, stem == name));
    let out = if own { format!("{stem}.expanded.urdf") } else { format!("{stem}.urdf") };
    format!(
        "expand it first: `xacro {name} > {out}` (with ROS 2: `ros2 run xacro xacro …`; else `pip install xacro`), and name {out}"
    )
}

/// Byte offset of a row and column (both from 1, columns in characters).
fn position(text: &str, row: usize, column: usize) -> usize {
    let line_start: usize = text.split_inclusive('\n').take(row.saturating_sub(1)).map(str::len).sum();
    let rest = text.get(line_start..).unwrap_or("");
    line_start + rest.chars().take(column.saturating_sub(1)).map(char::len_utf8).sum::<usize>()
}

/// The character that begins at byte `at`.
fn character(source: &Arc<Source>, at: usize) -> Span {
    let length = source.text.get(at..).and_then(|rest| rest.chars().next()).map_or(0, char::len_utf8);
    Span::new(source, at..at + length)
}

fn check_depth(source: &Arc<Source>, document: &Document) -> Result<(), Diagnostics> {
    // Parents come before their children, so one pass is enough, however deep the text is.
    let mut depths: Vec<usize> = Vec::new();
    for node in document.descendants() {
        let depth = node.parent().and_then(|p| depths.get(p.id().get_usize())).map_or(0, |d| d + 1);
        if depth > MAX_DEPTH {
            let message = format!("elements are nested more than {MAX_DEPTH} deep, a URDF's are about 6");
            let at = character(source, node.range().start);
            let hint = "look for a closing tag that is missing further up";
            return Err(Diagnostic::error("robot/xml-depth", message).at(&at).hint(hint).into());
        }
        depths.resize(node.id().get_usize(), 0);
        depths.push(depth);
    }
    Ok(())
}

/// Collects faults with their places.
struct Check<'a> {
    source: &'a Arc<Source>,
    faults: Vec<Diagnostic>,
}

impl Check<'_> {
    fn fault(&mut self, code: &'static str, message: impl ToString, at: &Span, hint: impl Into<String>) {
        self.faults.push(Diagnostic::error(code, message).at(at).hint(hint));
    }

    /// The opening tag, up to its name.
    fn start(&self, node: Node) -> Span {
        let start = node.range().start;
        let tag = &self.source.text[start..];
        let length = tag.find(|c: char| c.is_whitespace() || c == '>' || c == '/').unwrap_or(tag.len());
        Span::new(self.source, start..start + length)
    }

    fn attribute_span(&self, attribute: &Attribute) -> Span {
        Span::new(self.source, attribute.range())
    }

    fn name_span(&self, node: Node) -> Span {
        node.attribute_node("name").map_or_else(|| self.start(node), |a| self.attribute_span(&a))
    }

    /// Unique names of the elements; doubled and missing ones are faults.
    fn names<'n>(&mut self, nodes: &[Node<'n, 'n>], kind: &str) -> BTreeMap<&'n str, Node<'n, 'n>> {
        let mut names = BTreeMap::new();
        for node in nodes {
            match node.attribute("name").filter(|name| !name.is_empty()) {
                None => {
                    let message = format!("a <{kind}> without a name, which every {kind} needs");
                    self.fault("robot/no-name", message, &self.start(*node), format!("write <{kind} name=\"…\">"));
                }
                Some(name) => {
                    if names.insert(name, *node).is_some() {
                        let message = format!("{kind} `{name}` is there twice");
                        let hint = format!("rename one of them, or remove it: every {kind} has its own name");
                        self.fault("robot/doubled-name", message, &self.name_span(*node), hint);
                    }
                }
            }
        }
        names
    }

    fn link(&mut self, link: Node) {
        for collision in link.children().filter(|n| n.has_tag_name("collision")) {
            self.origin(collision);
            let geometries: Vec<Node> = collision.children().filter(|n| n.has_tag_name("geometry")).collect();
            let shapes: Vec<Node> = geometries.iter().flat_map(|g| g.children().filter(Node::is_element)).collect();
            let ([_], [shape]) = (&geometries[..], &shapes[..]) else {
                let found = match (geometries.len(), shapes.len()) {
                    (0, _) => "no <geometry>".to_owned(),
                    (1, 0) => "no shape".to_owned(),
                    (1, n) => format!("{n} shapes"),
                    (n, _) => format!("{n} <geometry>"),
                };
                let message = format!("a <collision> needs one <geometry> with one shape in it, and has {found}");
                let hint = "for example <geometry><box size=\"0.4 0.4 0.3\"/></geometry>; for two shapes write two <collision>";
                self.fault("robot/geometry", message, &self.start(collision), hint);
                continue;
            };
            self.shape(*shape);
        }
    }

    fn shape(&mut self, shape: Node) {
        match shape.tag_name().name() {
            "box" => self.not_negative(shape, "size", 3),
            "sphere" => self.not_negative(shape, "radius", 1),
            "cylinder" => {
                self.not_negative(shape, "radius", 1);
                self.not_negative(shape, "length", 1);
            }
            "mesh" => {
                if shape.attribute("filename").is_none_or(|name| name.trim().is_empty()) {
                    let hint = "write <mesh filename=\"hull.stl\"/>, relative to the URDF or package://";
                    self.fault("robot/geometry", "a <mesh> without a filename", &self.start(shape), hint);
                }
                self.numbers(shape, "scale", 3, false);
            }
            other => {
                let message = format!("collision shape <{other}> is not supported");
                let fault = Diagnostic::error("robot/geometry", message).at(&self.start(shape));
                let hint = match nearest(other, ["box", "cylinder", "sphere", "mesh"]) {
                    Some(near) => format!("did you mean <{near}>? use box, cylinder, sphere or mesh"),
                    None => "use box, cylinder, sphere or mesh".to_owned(),
                };
                self.faults.push(fault.hint(hint));
            }
        }
    }

    fn joint(&mut self, joint: Node, links: &BTreeMap<&str, Node>, joints: &BTreeMap<&str, Node>) {
        let name = joint.attribute("name").unwrap_or_default();
        match joint.attribute_node("type") {
            None => {
                let hint = "add type=\"fixed\", \"revolute\", \"continuous\" or \"prismatic\"";
                self.fault("robot/joint-type", format!("joint `{name}` has no type"), &self.name_span(joint), hint);
            }
            Some(kind) if !matches!(kind.value(), "fixed" | "revolute" | "continuous" | "prismatic") => {
                let message = format!("joint `{name}`: type `{}` is not supported", kind.value());
                let fault = Diagnostic::error("robot/joint-type", message).at(&self.attribute_span(&kind));
                let types = "fixed, revolute, continuous or prismatic";
                let hint = match nearest(kind.value(), ["fixed", "revolute", "continuous", "prismatic"]) {
                    Some(near) => format!("did you mean `{near}`? types are {types}"),
                    None => format!("use {types}"),
                };
                self.faults.push(fault.hint(hint));
            }
            Some(_) => {}
        }
        for end in ["parent", "child"] {
            self.only_one(joint, end);
            self.reference(joint, end, "link", links, "link");
        }
        for part in ["axis", "limit", "mimic"] {
            self.only_one(joint, part);
        }
        self.origin(joint);
        // Axis and limits of a fixed joint mean nothing; exporters write zeros there.
        let kind = joint.attribute("type").unwrap_or_default();
        if let Some(axis) = joint.children().find(|n| n.has_tag_name("axis"))
            && let Some(xyz) = self.numbers(axis, "xyz", 3, true)
            && kind != "fixed"
            && xyz.iter().map(|v| v * v).sum::<f64>().sqrt() < 1e-9
        {
            let message = format!("joint `{name}` has an axis of zero length");
            self.fault("robot/axis", message, &self.start(axis), "write a direction, such as xyz=\"0 0 1\"");
        }
        if let Some(limit) = joint.children().find(|n| n.has_tag_name("limit")) {
            let bounds = ["lower", "upper"].map(|key| self.numbers(limit, key, 1, false));
            if let [Some(lower), Some(upper)] = &bounds
                && matches!(kind, "revolute" | "prismatic")
                && lower[0] > upper[0]
            {
                let message = format!("joint `{name}`: lower limit {} is above the upper one, {}", lower[0], upper[0]);
                self.fault("robot/joint-limits", message, &self.start(limit), "swap `lower` and `upper`");
            }
            if let Some(v) = self.numbers(limit, "velocity", 1, false).filter(|v| v[0] < 0.0) {
                let message = format!("joint `{name}` has a negative velocity limit, {}", v[0]);
                let hint = "write its greatest speed to either side, above 0: rad/s, or m/s of a prismatic joint";
                self.fault("robot/limit-not-positive", message, &self.start(limit), hint);
            }
        }
        if let Some(mimic) = joint.children().find(|n| n.has_tag_name("mimic")) {
            self.reference(joint, "mimic", "joint", joints, "joint");
            self.numbers(mimic, "multiplier", 1, false);
            self.numbers(mimic, "offset", 1, false);
        }
    }

    fn only_one(&mut self, node: Node, tag: &str) {
        if let Some(second) = node.children().filter(|n| n.has_tag_name(tag)).nth(1) {
            let name = node.attribute("name").unwrap_or_default();
            let message = format!("`{name}` has more than one <{tag}>");
            self.fault("robot/doubled-element", message, &self.start(second), "keep one of them");
        }
    }

    fn reference(&mut self, node: Node, tag: &str, key: &str, known: &BTreeMap<&str, Node>, kind: &str) {
        let name = node.attribute("name").unwrap_or_default();
        let element = node.children().find(|n| n.has_tag_name(tag));
        let Some(attribute) = element.and_then(|e| e.attribute_node(key)) else {
            let message = format!("joint `{name}` has no <{tag} {key}=…>");
            let hint = format!("add <{tag} {key}=\"…\"/> with the name of a {kind}");
            self.fault("robot/missing-element", message, &self.name_span(node), hint);
            return;
        };
        if !known.contains_key(attribute.value()) {
            let message = format!("joint `{name}`: no {kind} `{}` in this URDF", attribute.value());
            let hint = suggestion(
                attribute.value(),
                known.keys().copied(),
                &format!("its {kind}s are"),
                &format!("it has no {kind}"),
            );
            self.fault("robot/unknown-name", message, &self.attribute_span(&attribute), hint);
        }
    }

    fn origin(&mut self, node: Node) {
        self.only_one(node, "origin");
        if let Some(origin) = node.children().find(|n| n.has_tag_name("origin")) {
            self.numbers(origin, "xyz", 3, false);
            self.numbers(origin, "rpy", 3, false);
            self.numbers(origin, "quat_xyzw", 4, false);
        }
    }

    fn not_negative(&mut self, node: Node, key: &str, count: usize) {
        if self.numbers(node, key, count, true).is_some_and(|v| v.iter().any(|v| *v < 0.0)) {
            let written = node.attribute(key).unwrap_or_default();
            let message = format!("<{}>: {key}=\"{written}\" is negative", node.tag_name().name());
            self.fault("robot/geometry", message, &self.start(node), "sizes are metres, 0 or more");
        }
    }

    /// The attribute's numbers: exactly `count`, all finite and no larger than lengths and angles can be.
    fn numbers(&mut self, node: Node, key: &str, count: usize, required: bool) -> Option<Vec<f64>> {
        let Some(attribute) = node.attribute_node(key) else {
            if required {
                let message = format!("<{}> has no {key}", node.tag_name().name());
                self.fault("robot/missing-element", message, &self.start(node), format!("add {}", example(key)));
            }
            return None;
        };
        let numbers: Result<Vec<f64>, _> = attribute.value().split_whitespace().map(str::parse).collect();
        match numbers {
            Ok(v) if v.len() == count && v.iter().all(|v| v.is_finite() && v.abs() <= 1e9) => Some(v),
            _ => {
                let what = if count == 1 { "one finite number".into() } else { format!("{count} finite numbers") };
                let message = format!("{key}=\"{}\": expected {what}", attribute.value());
                let hint = if attribute.value().contains("${") {
                    format!("this looks like xacro; {}", expand(&self.source.name))
                } else if attribute.value().contains(',') {
                    format!("numbers are separated by blanks, not commas: {}", example(key))
                } else {
                    format!("for example {}", example(key))
                };
                self.fault("robot/not-a-number", message, &self.attribute_span(&attribute), hint);
                None
            }
        }
    }
}

/// A good attribute.
fn example(key: &str) -> String {
    let value = match key {
        "size" => "0.4 0.4 0.3",
        "xyz" => "0 0 1",
        "rpy" => "0 0 1.57",
        "quat_xyzw" => "0 0 0 1",
        "scale" => "0.001 0.001 0.001",
        "lower" => "-1.57",
        "upper" => "1.57",
        _ => "0.1",
    };
    format!("{key}=\"{value}\"")
}

/// The text with all that this stage does not use blanked, and `velocity="0"` (none) where a `<limit>` leaves it out: URDF asks
/// for it before version 1.2, but published files leave it out on joints that never move. Quaternions (since 1.1) become angles here, since
/// urdf-rs takes the system's arc sine, whose last digit is not the same everywhere.
fn reduced(text: &str, root: Node) -> String {
    let mut edits: Vec<(Range<usize>, Cow<str>)> = Vec::new();
    if text.starts_with('\u{feff}') {
        edits.push((0..'\u{feff}'.len_utf8(), "".into()));
    }
    let version = root.attribute("version").and_then(|v| {
        let (major, minor) = v.trim().split_once('.')?;
        Some((major.parse::<u32>().ok()?, minor.parse::<u32>().ok()?))
    });
    let old = version < Some((1, 2));
    for part in root.children().filter(Node::is_element) {
        let keep: &[&str] = match part.tag_name().name() {
            "link" => &["collision"],
            "joint" => &["origin", "parent", "child", "axis", "limit", "mimic"],
            _ => {
                edits.push((part.range(), "".into()));
                continue;
            }
        };
        for child in part.children().filter(Node::is_element) {
            let name = child.tag_name().name();
            if !keep.contains(&name) {
                edits.push((child.range(), "".into()));
            } else if name == "limit" {
                let at = child.range().start + "<limit".len();
                let plain = text[child.range()].starts_with("<limit");
                if old && plain && child.attribute("velocity").is_none() {
                    edits.push((at..at, " velocity=\"0\"".into()));
                }
                edits.extend(child.attribute_node("effort").map(|effort| (effort.range(), "".into())));
            } else if version >= Some((1, 1)) {
                let origins = child.descendants().filter(|n| n.has_tag_name("origin") && n.attribute("rpy").is_none());
                edits.extend(origins.filter_map(|n| n.attribute_node("quat_xyzw")).filter_map(|quaternion| {
                    let [roll, pitch, yaw] = angles(quaternion.value())?;
                    Some((quaternion.range(), format!("rpy=\"{roll} {pitch} {yaw}\"").into()))
                }));
            }
        }
    }
    let (mut out, mut from) = (String::with_capacity(text.len()), 0);
    for (range, replacement) in edits {
        out += &text[from..range.start];
        out += &replacement;
        from = range.end;
    }
    out + &text[from..]
}

/// Roll, pitch and yaw of a quaternion `x y z w` of any length; the identity's where it has none. `None`: not four numbers.
fn angles(text: &str) -> Option<[f64; 3]> {
    let numbers: Result<Vec<f64>, _> = text.split_whitespace().map(str::parse).collect();
    let [x, y, z, w] = <[f64; 4]>::try_from(numbers.ok()?).ok()?;
    let turn = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 0.0).unwrap_or_default();
    Some(turn.euler_angles().into())
}
