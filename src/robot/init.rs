//! A first robot.yaml from a URDF: what can be inferred, and what must be measured.

use nalgebra::Vector3;
use urdf_rs::JointType;

use super::findings::Facts;
use super::pairs::{self, SURVEYED};
use super::spec::{RobotSpec, Written};
use super::wheels::{Candidates, Wheels};
use super::{
    Assembled, Files, IgnoreReason, RobotInputs, RobotModel, assemble, drive, joints, shapes, tree, urdf, wheels,
};
use crate::diag::Diagnostics;
use crate::math::real;
use crate::mission::LimitsSpec;

/// How figures that must be measured are marked.
const UNKNOWN: &str = "cannot be known from the URDF: measure and fill in";
/// Width of the text, columns.
const WIDTH: usize = 118;
/// Pairs of links that can meet that are told of; the others are only counted.
const MOST_MEETINGS: usize = 12;

/// What [`init`] reads.
pub struct InitInputs<'a> {
    /// Path and text of the URDF.
    pub urdf: (&'a str, &'a str),
    /// The URDF's path as robot.yaml will name it.
    pub named: &'a str,
    /// Joints of the left driving wheels; empty: found.
    pub left: &'a [String],
    /// Joints of the right ones.
    pub right: &'a [String],
    /// Reader for meshes.
    pub files: &'a mut dyn Files,
}

/// Writes a commented robot.yaml, which [`super::spec::parse`] and [`super::parse`] read. It holds the driving wheels with radius and track,
/// the joints that can move with their limits, those that are held, pairs of links that need not be checked, and all that is
/// easily missed about the URDF. Figures that a URDF does not hold are marked as such, commented out or with a guess.
///
/// # Errors
/// A URDF that cannot be read, or wheels that are neither named nor found.
pub fn init(inputs: InitInputs<'_>) -> Result<String, Diagnostics> {
    let InitInputs { urdf: (name, text), named, left, right, files } = inputs;
    let urdf = urdf::read(name, text)?;
    let tree = tree::Tree::new(&urdf)?;
    let all = |names: &[String]| -> Vec<Written<String>> {
        names.iter().map(|value| Written { value: value.clone(), span: None }).collect()
    };
    let mut spec = RobotSpec { drive_left: all(left), drive_right: all(right), ..RobotSpec::default() };
    let wheels = match (left, right) {
        ([], []) => {
            let seen = Candidates::of(&urdf, &tree);
            seen.only_pair().or_else(|| seen.every_axle()).ok_or_else(|| Diagnostics::from(seen.not_found(&urdf)))?
        }
        _ => wheels::wheels(&spec, &urdf, &tree)?,
    };
    let names = |side: &[usize]| side.iter().map(|j| urdf.robot.joints[*j].name.clone()).collect::<Vec<_>>();
    spec.drive_left = all(&names(&wheels.left));
    spec.drive_right = all(&names(&wheels.right));

    let radius_known = wheels.all().any(|j| drive::round_radius(&urdf, &tree, j).is_some());
    let guess = if radius_known { None } else { Some(guessed_radius(&urdf, &tree, &wheels, name, files)) };
    spec.wheel_radius = guess.map(|value| Written { value, span: None });
    let roles = joints::roles(&spec, &urdf, &wheels)?;
    let drive = drive::drive(&spec, &urdf, &tree, &wheels, |joint| roles.at_zero(joint))?;
    let facts = Facts { urdf: &urdf, tree: &tree, wheels: &wheels, roles: &roles, drive: &drive };
    let track_of_shapes = facts.track_of_shapes();
    let suspensions = facts.suspensions();
    let can_move = |j: &usize| {
        let [lower, upper] = joints::range(&urdf, *j);
        upper > lower && !suspensions.contains(j)
    };
    let moving: Vec<usize> = roles.moving.iter().copied().filter(can_move).collect();
    spec.moving = Some(all(&names(&moving)));
    spec.track_width = track_of_shapes.map(|value| Written { value, span: None });
    spec.ignore_pairs = Some(Vec::new());

    let overrides = LimitsSpec::default();
    let made = assemble(RobotInputs { spec: &spec, urdf: (name, text), files, overrides: &overrides })?;
    let mut page = Page { text: String::new() };
    page.head(&made, named);
    page.drive(&made, guess);
    page.joints(&made);
    page.limits(&made);
    page.collision(&made.robot);
    Ok(page.text)
}

/// The radius of a wheel without cylinder or sphere, m: of its mesh about the joint's axis, else the axle's height.
fn guessed_radius(urdf: &urdf::Urdf, tree: &tree::Tree, wheels: &Wheels, name: &str, files: &mut dyn Files) -> f64 {
    let poses = tree.link_poses(urdf, |_| 0.0);
    let mut found = 0f64;
    for joint in wheels.all() {
        let (link, axis) = (tree.child[joint], tree::axis(&urdf.robot.joints[joint]));
        for (collision, at) in urdf.robot.links[link].collision.iter().zip(&urdf.collision_spans[link]) {
            let Ok((centre, convex)) = shapes::convex(&collision.geometry, (name, 0), files, at) else { continue };
            let pose = tree::pose(&collision.origin) * centre;
            for across in [Vector3::x(), Vector3::y(), Vector3::z()].iter().filter(|d| d.dot(&axis).abs() < 0.5) {
                let local = pose.rotation.inverse() * across;
                found = found.max(0.5 * (convex.support(&local) - convex.support(&-local)).dot(&local));
            }
        }
    }
    let height = poses[tree.child[wheels.left[0]]].translation.z;
    let known = |r: f64| (1e-3..10.0).contains(&r);
    [found, height].into_iter().find(|r| known(*r)).map_or(0.1, |r| (r * 1e4).round() / 1e4)
}

/// The text as it grows.
struct Page {
    text: String,
}

impl Page {
    fn line(&mut self, line: &str) {
        self.text += line;
        self.text.push('\n');
    }

    /// A comment, wrapped.
    fn comment(&mut self, indent: usize, words: &str) {
        let start = format!("{}#", " ".repeat(indent));
        let mut line = start.clone();
        for word in words.split_whitespace() {
            if line.chars().count() + 1 + word.chars().count() > WIDTH && line != start {
                self.line(&line);
                line.clone_from(&start);
            }
            line.push(' ');
            line += word;
        }
        self.line(&line);
    }

    fn head(&mut self, made: &Assembled, named: &str) {
        self.comment(
            0,
            "What the URDF cannot say about this robot. Metres, seconds, radians; all keys: `trajc schema robot`.",
        );
        self.comment(0, &format!("Begun by `trajc robot init`. Search for \"{UNKNOWN}\" and do so."));
        self.line(&format!("name: {}", yaml(&made.robot.name)));
        self.line(&format!("urdf: {}", yaml(named)));
        let findings = made.facts().findings();
        if !findings.is_empty() {
            self.line("");
            self.comment(0, "Seen in the URDF:");
        }
        for finding in findings {
            self.comment(0, &format!("- {finding}"));
        }
        self.line("");
    }

    fn drive(&mut self, made: &Assembled, guess: Option<f64>) {
        self.comment(
            0,
            "The base frame lies on the floor below the middle of the driving wheels; x forward, y from right to left.",
        );
        self.line("drive:");
        for (side, wheels) in [("left", &made.wheels.left), ("right", &made.wheels.right)] {
            let names: Vec<String> = wheels.iter().map(|j| yaml(&made.urdf.robot.joints[*j].name)).collect();
            let list = if let [one] = &names[..] { one.clone() } else { format!("[{}]", names.join(", ")) };
            self.line(&format!("  {side}: {list}"));
        }
        let source = match guess {
            None => "of the wheels' cylinders".into(),
            Some(_) => format!("a guess: the wheels have no cylinder. {UNKNOWN}"),
        };
        self.line(&format!("  wheel_radius_m: {}     # {source}", made.robot.wheel_radii.mean));
        let source = match made.facts().track_of_shapes() {
            Some(_) => "between the middles of the wheels' cylinders",
            None => "between the wheels' joints",
        };
        self.line(&format!(
            "  track_width_m: {}     # {source}; measure it: turns depend on it",
            rounded(made.robot.track_width)
        ));
        self.line("");
    }

    fn joints(&mut self, made: &Assembled) {
        let urdf = &made.urdf;
        self.line("joints:");
        if made.robot.joints.is_empty() {
            self.line("  moving: []     # nothing that could be moved: no velocity limit, or no range");
        } else {
            self.comment(2, "All that have a velocity limit and a range. Fewer are planned faster: hold what need not move under `fixed`.");
            self.line("  moving:");
        }
        for joint in &made.robot.joints {
            self.line(&format!("    - {}", yaml(&joint.name)));
        }
        let moves = |j: usize| made.roles.moving.contains(&j) || made.wheels.all().any(|w| w == j);
        let held = |j: &usize| {
            let joint = &urdf.robot.joints[*j];
            let slides = matches!(joint.joint_type, JointType::Revolute | JointType::Prismatic);
            slides && joint.mimic.is_none() && !moves(*j)
        };
        let held: Vec<usize> = (0..urdf.robot.joints.len()).filter(held).collect();
        if !held.is_empty() {
            self.line("  fixed:");
        }
        for joint in held {
            let value = pairs::at_rest(joints::range(urdf, joint));
            self.line(&format!("    {}: {}", yaml(&urdf.robot.joints[joint].name), value + 0.0));
        }
        self.line("");
    }

    fn limits(&mut self, made: &Assembled) {
        let about = format!(
            "Accelerations and jerks {UNKNOWN}. What is left out is not checked, and planned with speed / 1 s and acceleration / 0.25 s."
        );
        let speed = made.robot.wheel.speed;
        let wheel = if speed.is_some() { "" } else { "# " };
        self.line(if speed.is_some() || !made.robot.joints.is_empty() { "limits:" } else { "# limits:" });
        self.comment(2, &about);
        self.line(&format!("  {wheel}wheel:"));
        match speed {
            Some(speed) => self.line(&format!("    speed_mps: {}     # the URDF's, of the rim", rounded(speed))),
            None => self.line(&format!("  #   speed_mps: 0.5     # {UNKNOWN}")),
        }
        for (key, value) in [("acceleration_mps2", "0.5"), ("jerk_mps3", "2.0")] {
            self.line(&format!("  #   {key}: {value}     # {UNKNOWN}"));
        }
        if !made.robot.joints.is_empty() {
            self.line("  joints:");
        }
        for joint in &made.robot.joints {
            let mut parts = Vec::new();
            if joint.lower.is_finite() && joint.upper.is_finite() {
                parts.push(format!("lower: {}, upper: {}", joint.lower + 0.0, joint.upper + 0.0));
            }
            parts.extend(joint.limits.speed.map(|v| format!("speed: {v}")));
            let unit = if joint.prismatic { "m" } else { "rad" };
            self.line(&format!(
                "    {}: {{{}}}     # {unit}; add acceleration and jerk",
                yaml(&joint.name),
                parts.join(", ")
            ));
        }
    }

    fn collision(&mut self, robot: &RobotModel) {
        if robot.joints.is_empty() {
            return; // nothing moves against anything
        }
        self.line("");
        self.line("collision:");
        let about = "Links that move against each other are checked against each other, but never a link and its parent, nor these pairs:";
        self.comment(2, about);
        let design = pairs::by_design(robot);
        self.line(if design.is_empty() { "  ignore_pairs: []" } else { "  ignore_pairs:" });
        for pair in &design {
            let why = match pair.reason {
                IgnoreReason::Telescope => "in one telescope",
                _ => "touch in every posture",
            };
            self.line(&format!("    - [{}, {}]     # {why}", yaml(&pair.links[0]), yaml(&pair.links[1])));
        }
        let known = |links: &[String; 2]| design.iter().any(|pair| pair.links == *links);
        let others = pairs::meetings(robot).into_iter().filter(|m| !known(&m.links));
        let (at_rest, checked): (Vec<_>, Vec<_>) = others.partition(|m| m.at_rest);
        if !at_rest.is_empty() {
            let about = format!(
                "These touch with all joints at rest, and in so many of {SURVEYED} postures spread over all ranges. If their shapes are drawn \
                 too large, add them; if not, rest is no posture to be in:"
            );
            self.comment(2, &about);
        }
        for pair in &at_rest {
            self.line(&format!("  # - [{}, {}]     # {}", yaml(&pair.links[0]), yaml(&pair.links[1]), pair.count));
        }
        if !checked.is_empty() {
            self.comment(2, "These do not touch at rest, but can meet:");
        }
        for pair in checked.iter().take(MOST_MEETINGS) {
            self.line(&format!("  # - [{}, {}]     # {}", yaml(&pair.links[0]), yaml(&pair.links[1]), pair.count));
        }
        if checked.len() > MOST_MEETINGS {
            self.comment(2, &format!("and {} more", checked.len() - MOST_MEETINGS));
        }
    }
}

/// A name as YAML reads it back: plain where it can be.
fn yaml(name: &str) -> String {
    let begins = name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_' || c == '/') || name.starts_with("../");
    let plain = begins && name.chars().all(|c| c.is_ascii_alphanumeric() || "_-./".contains(c));
    let word =
        ["true", "false", "null", "yes", "no", "on", "off", "y", "n"].contains(&name.to_ascii_lowercase().as_str());
    if plain && !word { name.into() } else { serde_json::Value::from(name).to_string() }
}

/// A length or speed without the last digits of its computation.
fn rounded(value: f64) -> f64 {
    let scale = 1e9 / real::powf(10.0, real::log10(value.abs().max(1e-9)).ceil());
    (value * scale).round() / scale
}
