//! What each actuator does over time, as held commands: speed, first and second differences, and where their peaks are.

use crate::command::CommandTable;
use crate::report::plot::{Chart, Join, Level, Small, thinned};
use crate::robot::{MotionLimits, RobotModel};

/// Joints with charts; of more, the table alone tells.
const MOST_JOINTS: usize = 6;
/// Points of a chart's line.
const POINTS: usize = 700;
/// px, as drawn; the page scales it.
const SIZE: [f64; 2] = [400.0, 200.0];

/// Of one actuator.
pub(super) struct Actuator {
    /// As in `report.json`: `wheel_left`, `wheel_right`, or the joint's name.
    pub(super) name: String,
    /// `m`: wheels at the rim, and sliding joints; else `rad`.
    pub(super) unit: &'static str,
    /// Speed, acceleration, jerk.
    pub(super) courses: [Course; 3],
    /// Position, of joints.
    position: Option<(Vec<f64>, [f64; 2])>,
}

/// One quantity over time.
pub(super) struct Course {
    /// When each row begins, s, and two rows of rest more.
    pub(super) points: Vec<[f64; 2]>,
    /// The value of largest magnitude.
    pub(super) peak: [f64; 2],
    limit: Option<f64>,
}

/// Names of the three quantities, as in `report.json`.
pub(super) const QUANTITIES: [&str; 3] = ["speed", "acceleration", "jerk"];
/// What follows a unit of position in theirs.
pub(super) const PER: [&str; 3] = ["/s", "/s²", "/s³"];

impl Course {
    fn new(step: f64, values: impl Iterator<Item = f64>, limit: Option<f64>) -> Self {
        let points: Vec<[f64; 2]> = values.enumerate().map(|(k, v)| [k as f64 * step, v]).collect();
        let larger = |best: [f64; 2], p: &[f64; 2]| if p[1].abs() > best[1].abs() { *p } else { best };
        let peak = points.iter().fold([0.0; 2], larger);
        Self { points, peak, limit }
    }
}

/// All actuators of a table: wheels, then joints.
pub(super) fn all(table: &CommandTable, robot: &RobotModel) -> Vec<Actuator> {
    let rims: Vec<_> = (0..table.rows.len()).map(|k| table.rim_speeds(k)).collect();
    let side = |name: &str, speeds: Vec<f64>| Actuator::new(name, "m", table.sampling_time, &speeds, robot.wheel);
    let mut out = vec![
        side("wheel_left", rims.iter().map(|r| r.0).collect()),
        side("wheel_right", rims.iter().map(|r| r.1).collect()),
    ];
    for (j, joint) in robot.joints.iter().enumerate() {
        let speeds: Vec<f64> = table.rows.iter().map(|row| row.joint_velocities[j]).collect();
        let unit = if joint.prismatic { "m" } else { "rad" };
        let mut actuator = Actuator::new(&joint.name, unit, table.sampling_time, &speeds, joint.limits);
        let values = table.rows.iter().map(|row| row.joint_positions[j]).collect();
        actuator.position = Some((values, [joint.lower, joint.upper]));
        out.push(actuator);
    }
    out
}

impl Actuator {
    fn new(name: &str, unit: &'static str, step: f64, speeds: &[f64], limits: MotionLimits) -> Self {
        // At rest before and after.
        let at = |k: usize, back: usize| if k >= back { speeds.get(k - back).copied().unwrap_or(0.0) } else { 0.0 };
        let rows = 0..speeds.len() + 2;
        let courses = [
            Course::new(step, rows.clone().map(|k| at(k, 0)), limits.speed),
            Course::new(step, rows.clone().map(|k| (at(k, 0) - at(k, 1)) / step), limits.acceleration),
            Course::new(step, rows.map(|k| (at(k, 0) - 2.0 * at(k, 1) + at(k, 2)) / (step * step)), limits.jerk),
        ];
        Self { name: name.to_owned(), unit, courses, position: None }
    }
}

/// The charts: base and joints, then speed, acceleration and jerk of the wheels and of each joint; and how many joints have none.
pub(super) fn charts(actuators: &[Actuator], table: &CommandTable) -> (String, usize) {
    let (wheels, joints) = actuators.split_at(2.min(actuators.len()));
    let drawn = |chart: &Chart, id: &str| {
        let [width, height] = SIZE;
        format!("<figure>{}</figure>\n", Small { width, height, id, over_time: true }.draw(chart))
    };
    let row = |title: &str, unit: &str, named: &[(&str, &Actuator)], id: &str| {
        let mut out = format!("<h3>{}</h3>\n<div class=\"charts\">\n", super::html::escape(title));
        for (q, quantity) in QUANTITIES.iter().enumerate() {
            let courses: Vec<(&str, &Course)> = named.iter().map(|(name, a)| (*name, &a.courses[q])).collect();
            out += &drawn(&chart(&capital(quantity), unit, q, &courses, table.duration()), &format!("{id}{q}"));
        }
        out + "</div>\n"
    };
    let shown = &joints[..joints.len().min(MOST_JOINTS)];
    let sides: Vec<(&str, &Actuator)> = ["left", "right"].into_iter().zip(wheels).collect();
    let mut out = row("Wheels, at the rim", "m", &sides, "wheel");
    for (j, joint) in shown.iter().enumerate() {
        out += &row(&format!("Joint {}", joint.name), joint.unit, &[("", joint)], &format!("joint{j}"));
    }
    out += if shown.is_empty() { "<h3>Base</h3>\n" } else { "<h3>Base and joint positions</h3>\n" };
    out += "<div class=\"charts\">\n";
    for (k, chart) in base(table).iter().enumerate() {
        out += &drawn(chart, &format!("base{k}"));
    }
    for (j, joint) in shown.iter().enumerate() {
        out += &joint
            .position
            .iter()
            .map(|own| drawn(&position(joint, own, table), &format!("position{j}")))
            .collect::<String>();
    }
    (out + "</div>\n", joints.len() - shown.len())
}

/// A joint's position over time, with the ends of its range.
fn position(joint: &Actuator, (values, ends): &(Vec<f64>, [f64; 2]), table: &CommandTable) -> Chart {
    let points: Vec<[f64; 2]> = values.iter().enumerate().map(|(k, v)| [table.time(k), *v]).collect();
    let chart =
        Chart::new(joint.name.as_str(), "time s", joint.unit).line("", thinned(&points, POINTS), Join::Straight);
    let named = ["lower end", "upper end"].into_iter().zip(ends).filter(|(_, v)| v.is_finite());
    Chart { levels: named.map(|(name, value)| Level { name: name.into(), value: *value }).collect(), ..chart }
}

/// Courses in one chart, with their peaks and their limit.
fn chart(title: &str, unit: &str, quantity: usize, named: &[(&str, &Course)], end: f64) -> Chart {
    let mut chart = Chart::new(title, "time s", format!("{unit}{}", PER[quantity]));
    for (k, (name, course)) in named.iter().enumerate() {
        let [time, value] = course.peak;
        let peak = format!("{} at {} s", super::figure(value), super::figure(time));
        let name = if name.is_empty() { format!("peak {peak}") } else { format!("{name} {peak}") };
        // The rest after the last row is not drawn, a peak in it is.
        let until = end.max(time);
        let points: Vec<[f64; 2]> = course.points.iter().copied().filter(|p| p[0] <= until + 1e-9).collect();
        chart = chart.line(name, thinned(&points, POINTS), Join::Held).mark([time, value], k);
    }
    if let Some(limit) = named.iter().find_map(|(_, c)| c.limit) {
        chart = chart.level("limit", limit);
        if named.iter().any(|(_, c)| c.points.iter().any(|p| p[1] < -0.02 * limit)) {
            chart = chart.level("limit", -limit);
        }
    }
    chart
}

/// Speed of the base, and how fast it turns.
fn base(table: &CommandTable) -> [Chart; 2] {
    let of = |title: &str, unit: &str, value: fn((f64, f64)) -> f64| {
        let points: Vec<[f64; 2]> = (0..table.rows.len()).map(|k| [table.time(k), value(table.twist(k))]).collect();
        Chart::new(title, "time s", unit).line("", thinned(&points, POINTS), Join::Held)
    };
    [of("Speed", "m/s", |(v, _)| v), of("Turn rate", "rad/s", |(_, omega)| omega)]
}

fn capital(word: &str) -> String {
    let mut chars = word.chars();
    chars.next().map_or(String::new(), |c| c.to_uppercase().chain(chars).collect())
}
