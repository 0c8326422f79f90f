//! Faults of elements and attributes, with their places.

use std::collections::BTreeMap;
use std::sync::Arc;

use roxmltree::{Attribute, Node};

use super::syntax::expand;
use crate::diag::{Diagnostic, Source, Span, nearest, suggestion};

/// Collects faults with their places.
pub(super) struct Check<'a> {
    pub source: &'a Arc<Source>,
    pub faults: Vec<Diagnostic>,
}

impl Check<'_> {
    pub fn fault(&mut self, code: &'static str, message: impl ToString, at: &Span, hint: impl Into<String>) {
        self.faults.push(Diagnostic::error(code, message).at(at).hint(hint));
    }

    /// The opening tag, up to its name.
    pub fn start(&self, node: Node) -> Span {
        let start = node.range().start;
        let tag = &self.source.text[start..];
        let length = tag.find(|c: char| c.is_whitespace() || c == '>' || c == '/').unwrap_or(tag.len());
        Span::new(self.source, start..start + length)
    }

    pub fn attribute_span(&self, attribute: &Attribute) -> Span {
        Span::new(self.source, attribute.range())
    }

    pub fn name_span(&self, node: Node) -> Span {
        node.attribute_node("name").map_or_else(|| self.start(node), |a| self.attribute_span(&a))
    }

    /// Unique names of the elements; doubled and missing ones are faults.
    pub fn names<'n>(&mut self, nodes: &[Node<'n, 'n>], kind: &str) -> BTreeMap<&'n str, Node<'n, 'n>> {
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

    pub fn link(&mut self, link: Node) {
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

    pub fn shape(&mut self, shape: Node) {
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

    pub fn joint(&mut self, joint: Node, links: &BTreeMap<&str, Node>, joints: &BTreeMap<&str, Node>) {
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

    pub fn only_one(&mut self, node: Node, tag: &str) {
        if let Some(second) = node.children().filter(|n| n.has_tag_name(tag)).nth(1) {
            let name = node.attribute("name").unwrap_or_default();
            let message = format!("`{name}` has more than one <{tag}>");
            self.fault("robot/doubled-element", message, &self.start(second), "keep one of them");
        }
    }

    pub fn reference(&mut self, node: Node, tag: &str, key: &str, known: &BTreeMap<&str, Node>, kind: &str) {
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

    pub fn origin(&mut self, node: Node) {
        self.only_one(node, "origin");
        if let Some(origin) = node.children().find(|n| n.has_tag_name("origin")) {
            self.numbers(origin, "xyz", 3, false);
            self.numbers(origin, "rpy", 3, false);
            self.numbers(origin, "quat_xyzw", 4, false);
        }
    }

    pub fn not_negative(&mut self, node: Node, key: &str, count: usize) {
        if self.numbers(node, key, count, true).is_some_and(|v| v.iter().any(|v| *v < 0.0)) {
            let written = node.attribute(key).unwrap_or_default();
            let message = format!("<{}>: {key}=\"{written}\" is negative", node.tag_name().name());
            self.fault("robot/geometry", message, &self.start(node), "sizes are metres, 0 or more");
        }
    }

    /// The attribute's numbers: exactly `count`, all finite and no larger than lengths and angles can be.
    pub fn numbers(&mut self, node: Node, key: &str, count: usize, required: bool) -> Option<Vec<f64>> {
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
