//! robot.yaml: what the URDF cannot say, as written. Read by [`parse`]; given its meaning by the rest of `robot`.

use std::path::PathBuf;
use std::sync::Arc;

use super::LARGEST_DIFFERENCE;
use crate::diag::shape::{Bounds, Field, Shape};
use crate::diag::yaml::{Entry, Node};
use crate::diag::{Diagnostic, Diagnostics, Source, Span, json_schema as schema, shape, yaml};
use crate::mission::{LimitsSpec, ToleranceSpec, limits, tolerance};

/// A value and where it is written.
#[derive(Debug, Clone, PartialEq)]
pub struct Written<T> {
    /// The value.
    pub value: T,
    /// Where; `None` where it does not come from a text.
    pub span: Option<Span>,
}

/// robot.yaml. Lengths in m, angles in rad; `None` or empty: not given.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RobotSpec {
    /// Default: the URDF's robot name.
    pub name: Option<String>,
    /// Relative to robot.yaml's folder.
    pub urdf: Option<Written<PathBuf>>,
    /// Joints of the left driving wheels, one or several.
    pub drive_left: Vec<Written<String>>,
    /// Joints of the right driving wheels.
    pub drive_right: Vec<Written<String>>,
    /// `drive.wheel_radius_m`: the mean.
    pub wheel_radius: Option<Written<f64>>,
    /// `drive.wheel_difference`: the share by which the right wheel is larger than the left one.
    pub wheel_difference: Option<f64>,
    /// `drive.track_width_m`.
    pub track_width: Option<Written<f64>>,
    /// `joints.moving`; `Some(empty)`: none moves.
    pub moving: Option<Vec<Written<String>>>,
    /// `joints.fixed`: name and value.
    pub fixed: Vec<(Written<String>, f64)>,
    /// `limits`.
    pub limits: LimitsSpec,
    /// `tolerance`.
    pub tolerance: Option<ToleranceSpec>,
    /// Where each joint under `limits.joints` is named.
    pub limit_joints: Vec<Written<String>>,
    /// `collision.ignore_links`.
    pub ignore_links: Vec<Written<String>>,
    /// `collision.ignore_pairs`; `Some(empty)`: only links and their parents.
    pub ignore_pairs: Option<Vec<[Written<String>; 2]>>,
}

const LINKS: Shape = Shape::List { item: &Shape::Text, count: (0, usize::MAX), form: "a list of link names" };
const PAIR: Shape = Shape::List { item: &Shape::Text, count: (2, 2), form: "a pair of link names" };

static ROBOT: [Field; 7] = [
    Field::optional("name", Shape::Text, "scr_db", "the robot's name; default: the URDF's"),
    Field::required("urdf", Shape::Text, "scr_db.urdf", "the URDF, relative to this file"),
    Field::optional(
        "drive",
        Shape::Table(&DRIVE),
        "{left: left_wheel_joint, right: right_wheel_joint}",
        "the driving wheels; default: the only two coaxial continuous joints with a horizontal axis",
    ),
    Field::optional(
        "joints",
        Shape::Table(&JOINTS),
        "{moving: [blade]}",
        "which joints move, and where the others are held",
    ),
    Field::optional(
        "limits",
        Shape::Table(&limits::FIELDS),
        "{wheel: {speed_mps: 0.5, acceleration_mps2: 0.5, jerk_mps3: 2.0}}",
        "limits that the URDF does not say, or tighter ones",
    ),
    Field::optional(
        "tolerance",
        Shape::Table(&tolerance::FIELDS),
        "{wheel_radius: 0.2%, wheel_difference: 0.1%, track: 1%}",
        "how far the real robot may be off: clearance is then proven for every such robot",
    ),
    Field::optional(
        "collision",
        Shape::Table(&COLLISION),
        "{ignore_links: [lidar]}",
        "what does not count as a collision",
    ),
];

static DRIVE: [Field; 5] = [
    Field::optional(
        "left",
        Shape::TextOrList,
        "left_wheel_joint",
        "joint of the left driving wheel, or a list of them",
    ),
    Field::optional(
        "right",
        Shape::TextOrList,
        "right_wheel_joint",
        "joint of the right driving wheel, or a list of them",
    ),
    Field::optional(
        "wheel_radius_m",
        Shape::Number(Bounds::positive("m")),
        "0.08",
        "metres; default: the wheel link's collision cylinder or sphere",
    ),
    Field::optional(
        "wheel_difference",
        Shape::Share(Bounds::between(-LARGEST_DIFFERENCE, LARGEST_DIFFERENCE, "")),
        "0.2%",
        "by how much the right wheel is larger than the left one, as a share of their mean, wheel_radius_m; default: 0",
    ),
    Field::optional(
        "track_width_m",
        Shape::Number(Bounds::positive("m")),
        "0.32",
        "distance between the driving wheels, metres; default: between the wheel joints' origins",
    ),
];

static JOINTS: [Field; 2] = [
    Field::optional(
        "moving",
        Shape::List { item: &Shape::Text, count: (0, usize::MAX), form: "a list of joint names" },
        "[blade]",
        "joints that the planner moves; default: all with a velocity limit that are no wheel, no mimic and not fixed",
    ),
    Field::optional(
        "fixed",
        Shape::Named(&Shape::Angle(Bounds::any("rad or m"))),
        "{arm_lift: 0.10}",
        "joints held at a value: radians, metres or degrees",
    ),
];

static COLLISION: [Field; 2] = [
    Field::optional("ignore_links", LINKS, "[lidar]", "links whose collision shapes do not count"),
    Field::optional(
        "ignore_pairs",
        Shape::List { item: &PAIR, count: (0, usize::MAX), form: "a list of pairs of link names" },
        "[[base_link, left_blade]]",
        "pairs of links that may touch each other",
    ),
];

/// Reads robot.yaml; `name` is its path as the user knows it.
///
/// # Errors
/// All faults found: syntax, unknown keys with the nearest known one, wrong types, numbers that are not finite or not > 0,
/// joints named twice.
pub fn parse(name: &str, text: &str) -> Result<RobotSpec, Diagnostics> {
    let source = Arc::new(Source { name: name.to_string(), text: text.to_string() });
    let root = yaml::load(&source)?;
    let mut faults = shape::check(&source, &root, &ROBOT, "a robot.yaml", "`urdf: NAME.urdf`");
    let reader = Reader { source: &source, root: &root };
    let spec = reader.spec();
    faults.extend(limits::check(&source, root.get("limits")));
    faults.extend(reader.drive_sides(&spec));
    let wheels = spec.drive_left.iter().chain(&spec.drive_right);
    faults.extend(reader.named_twice(wheels, "drive", "a wheel has one joint and one side"));
    let held = spec.moving.iter().flatten().chain(spec.fixed.iter().map(|(joint, _)| joint));
    faults.extend(reader.named_twice(held, "joints", "a joint either moves or is fixed, and is named once"));
    if faults.is_empty() {
        return Ok(spec);
    }
    faults.sort_by_key(|d| d.at.as_ref().map_or(0, |at| at.range.start));
    Err(Diagnostics(faults))
}

/// JSON Schema (draft 2020-12) of robot.yaml, from the table of keys that [`parse`] checks against.
pub fn json_schema() -> serde_json::Value {
    schema::document("trajc robot.yaml", "What a URDF cannot say about a robot.", &ROBOT, &[])
}

/// Takes values from the tree; what is not well formed is left out, since it is a fault already.
struct Reader<'a> {
    source: &'a Arc<Source>,
    root: &'a Node,
}

impl Reader<'_> {
    fn spec(&self) -> RobotSpec {
        let pairs = |node: &Node| node.items().iter().filter_map(|p| self.names(Some(p)).try_into().ok()).collect();
        RobotSpec {
            name: self.root.get("name").and_then(Node::text).map(str::to_string),
            urdf: self.root.get("urdf").and_then(|n| Some(self.written(PathBuf::from(n.text()?), n))),
            drive_left: self.names(self.get("drive", "left")),
            drive_right: self.names(self.get("drive", "right")),
            wheel_radius: self.number("drive", "wheel_radius_m"),
            wheel_difference: self.get("drive", "wheel_difference").and_then(Node::share),
            track_width: self.number("drive", "track_width_m"),
            moving: self.get("joints", "moving").map(|n| self.names(Some(n))),
            fixed: self.fixed(),
            limits: limits::read(self.source, self.root.get("limits")),
            tolerance: tolerance::read(self.root.get("tolerance")),
            limit_joints: limits::joint_names(self.source, self.root.get("limits"))
                .into_iter()
                .map(|(value, span)| Written { value, span: Some(span) })
                .collect(),
            ignore_links: self.names(self.get("collision", "ignore_links")),
            ignore_pairs: self.get("collision", "ignore_pairs").map(pairs),
        }
    }

    fn get(&self, table: &str, key: &str) -> Option<&Node> {
        self.root.get(table)?.get(key)
    }

    fn written<T>(&self, value: T, node: &Node) -> Written<T> {
        Written { value, span: Some(Span::new(self.source, node.range.clone())) }
    }

    fn number(&self, table: &str, key: &str) -> Option<Written<f64>> {
        let node = self.get(table, key)?;
        Some(self.written(node.number()?, node))
    }

    /// One name or a list of names.
    fn names(&self, node: Option<&Node>) -> Vec<Written<String>> {
        let Some(node) = node else { return Vec::new() };
        let items = if node.text().is_some() { std::slice::from_ref(node) } else { node.items() };
        items.iter().filter_map(|n| Some(self.written(n.text()?.to_string(), n))).collect()
    }

    fn fixed(&self) -> Vec<(Written<String>, f64)> {
        let fixed = self.get("joints", "fixed").map_or(&[][..], Node::entries);
        let key = |e: &Entry| Written { value: e.key.clone(), span: Some(Span::new(self.source, e.key_range.clone())) };
        fixed.iter().filter_map(|e| Some((key(e), e.value.angle()?))).collect()
    }

    /// A wheel on one side only.
    fn drive_sides(&self, spec: &RobotSpec) -> Option<Diagnostic> {
        let drive = self.root.entry("drive")?;
        let given = |key: &str| drive.value.entries().iter().any(|e| e.key == key);
        let (has, lacks) = match (given("left"), given("right")) {
            (true, false) => ("left", "right"),
            (false, true) => ("right", "left"),
            _ => return None,
        };
        let joint = spec.drive_left.iter().chain(&spec.drive_right).next();
        let message = format!("`drive` names a {has} wheel but no {lacks} one");
        let at = joint.and_then(|j| j.span.clone()).unwrap_or_else(|| Span::new(self.source, drive.key_range.clone()));
        let hint = format!("add `{lacks}: {lacks}_wheel_joint`, or remove both to have the wheels found");
        Some(Diagnostic::error("robot/one-sided-drive", message).at(&at).hint(hint))
    }

    fn named_twice<'b>(
        &self,
        names: impl Iterator<Item = &'b Written<String>>,
        table: &str,
        hint: &str,
    ) -> Vec<Diagnostic> {
        let mut seen: Vec<&Written<String>> = names.collect();
        seen.sort_by(|a, b| a.value.cmp(&b.value));
        let twice = seen.windows(2).filter(|pair| pair[0].value == pair[1].value);
        twice
            .map(|pair| {
                let message = format!("`{}` is named twice under `{table}`", pair[1].value);
                Diagnostic::error("robot/named-twice", message).maybe_at(pair[1].span.as_ref()).hint(hint)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diag::render;
    use proptest::prelude::*;

    const FULL: &str = "\
name: scr_db
urdf: scr_db.urdf
drive: {left: [front_left, rear_left], right: right_wheel_joint, wheel_radius_m: 0.08, track_width_m: 0.32}
joints:
  moving: [blade]
  fixed: {arm_lift: 0.10, arm_turn: 90deg}
limits:
  wheel: {speed_mps: 0.5}
  joints: {blade: {lower: 0deg, upper: 180deg, speed: 1.0, acceleration: 2.0, jerk: 10.0}}
  base: {eta: 0.1}
collision:
  ignore_links: [lidar]
  ignore_pairs: [[base_link, left_blade]]
";

    fn good(text: &str) -> RobotSpec {
        parse("robots/r/robot.yaml", text).unwrap_or_else(|faults| panic!("{}", render(&faults, false)))
    }

    #[test]
    fn every_key_is_read_with_its_place() {
        let spec = good(FULL);
        let names = |list: &[Written<String>]| list.iter().map(|w| w.value.clone()).collect::<Vec<_>>();
        assert_eq!(spec.name.as_deref(), Some("scr_db"));
        assert_eq!(spec.urdf.as_ref().map(|w| w.value.clone()), Some("scr_db.urdf".into()));
        assert_eq!(names(&spec.drive_left), ["front_left", "rear_left"]);
        assert_eq!(names(&spec.drive_right), ["right_wheel_joint"]);
        assert_eq!(spec.wheel_radius.as_ref().map(|w| w.value), Some(0.08));
        assert_eq!(spec.track_width.as_ref().map(|w| w.value), Some(0.32));
        assert_eq!(names(spec.moving.as_ref().expect("moving")), ["blade"]);
        let fixed: Vec<(&str, f64)> = spec.fixed.iter().map(|(w, value)| (w.value.as_str(), *value)).collect();
        assert_eq!(fixed, [("arm_lift", 0.1), ("arm_turn", std::f64::consts::FRAC_PI_2)]);
        assert_eq!(spec.limits.wheel.speed, Some(0.5));
        assert_eq!(spec.limits.joints["blade"].upper, Some(std::f64::consts::PI));
        assert_eq!(names(&spec.limit_joints), ["blade"]);
        assert_eq!(names(&spec.ignore_links), ["lidar"]);
        assert_eq!(names(&spec.ignore_pairs.as_ref().expect("ignore_pairs")[0]), ["base_link", "left_blade"]);
        for written in
            spec.drive_left.iter().chain(&spec.limit_joints).chain(spec.ignore_pairs.iter().flatten().flatten())
        {
            let span = written.span.as_ref().expect("a span");
            assert_eq!(span.source.text[span.range.clone()], written.value);
        }
    }

    #[test]
    fn only_the_urdf_must_be_given() {
        let spec = good("urdf: a.urdf\n");
        assert_eq!(spec, RobotSpec { urdf: spec.urdf.clone(), ..RobotSpec::default() });
        assert_eq!(good("urdf: a.urdf\njoints: {moving: []}\n").moving, Some(Vec::new()));
    }

    #[test]
    fn a_robot_yaml_is_not_a_mission() {
        let faults = parse("robot.yaml", "urdf: a.urdf\nstart: {x_m: 1}\nrobot: b\n").expect_err("foreign keys").0;
        assert_eq!(faults.iter().map(|d| d.code).collect::<Vec<_>>(), ["yaml/unknown-key"; 2]);
    }

    fn same_keys(table: &'static [Field], schema: &serde_json::Value) {
        let properties = schema["properties"].as_object().expect("properties");
        assert!(properties.keys().eq(table.iter().map(|f| f.key)));
        assert_eq!(schema["additionalProperties"], false);
        for field in table {
            match &field.shape {
                Shape::Table(inner) => same_keys(inner, &properties[field.key]),
                Shape::Named(Shape::Table(inner)) => same_keys(inner, &properties[field.key]["additionalProperties"]),
                _ => {}
            }
        }
    }

    #[test]
    fn the_schema_has_exactly_the_keys_that_the_parser_knows() {
        same_keys(&ROBOT, &json_schema());
        assert_eq!(json_schema()["required"], serde_json::json!(["urdf"]));
    }

    #[test]
    fn every_example_in_the_documentation_of_a_key_is_good() {
        for field in &ROBOT {
            good(&format!("{}{}: {}\n", if field.key == "urdf" { "" } else { "urdf: a\n" }, field.key, field.example));
        }
        for (table, fields) in [("drive", &DRIVE[2..]), ("joints", &JOINTS[..]), ("collision", &COLLISION[..])] {
            for field in fields {
                good(&format!("urdf: a\n{table}: {{{}: {}}}\n", field.key, field.example));
            }
        }
    }

    proptest! {
        #[test]
        fn damaged_and_arbitrary_texts_never_panic(
            edits in proptest::collection::vec((0..FULL.len(), 0usize..12, "[-0-9a-z:,.{}\\[\\] \n\"é]{0,6}"), 1..5),
            noise in "\\PC{0,60}",
        ) {
            let mut bytes = FULL.as_bytes().to_vec();
            for (at, length, piece) in edits {
                let at = at.min(bytes.len());
                bytes.splice(at..(at + length).min(bytes.len()), piece.bytes());
            }
            for text in [String::from_utf8_lossy(&bytes).into_owned(), noise] {
                if let Err(faults) = parse("robot.yaml", &text) {
                    prop_assert!(faults.0.iter().all(|d| d.at.is_some() && d.hint.is_some()), "{:?}", faults);
                    prop_assert!(!render(&faults, false).is_empty());
                }
            }
        }
    }
}
