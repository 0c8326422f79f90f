//! URDF text to urdf-rs' model, behind a check of everything urdf-rs lets pass.
//!
//! urdf-rs validates neither names nor the tree nor numbers, overflows its stack on deep XML and gives no places. So the text is
//! first read with roxmltree: depth, entities, names, references and numbers are judged there, with spans. urdf-rs then sees only
//! what this stage uses; visuals, inertias and foreign elements are blanked, since a fault in them does not matter here.

mod check;
mod syntax;

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use nalgebra::{Quaternion, UnitQuaternion};
use roxmltree::{Document, Node};

use crate::diag::{Diagnostic, Diagnostics, Source, Span};
use check::Check;
use syntax::{check_depth, still_xacro, syntax_error};

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
