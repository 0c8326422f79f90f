//! What was understood of a robot, for people.

use std::fmt::Write;

use super::{Convex, MotionLimits, RobotModel};

impl RobotModel {
    /// A readable summary: wheels, limits, joints, bodies, shapes, dimensions over the joints' range. Ends with a newline.
    pub fn describe(&self) -> String {
        let mut out = String::new();
        self.describe_into(&mut out).expect("writing to a String cannot fail");
        out
    }

    fn describe_into(&self, out: &mut String) -> std::fmt::Result {
        let rate = if self.joints.len() == 1 { "joint moves" } else { "joints move" };
        writeln!(out, "robot {}: {} {rate}", self.name, self.joints.len())?;
        write!(out, "wheel radius {:.4} m, ", self.wheel_radii.mean)?;
        if let Some(share) = self.wheel_radii.unlike() {
            write!(out, "the right wheel {:+.3} % larger, ", 100.0 * share)?;
        }
        writeln!(out, "track width {:.4} m", self.track_width)?;
        let ([x, y, z], (roll, pitch, yaw)) =
            (self.base_from_root.translation.vector.into(), self.base_from_root.rotation.euler_angles());
        let degrees = [roll, pitch, yaw].map(|a| a.to_degrees() + 0.0);
        writeln!(
            out,
            "root link `{}` in the base frame: ({x:.4}, {y:.4}, {z:.4}) m, roll pitch yaw ({:.2}, {:.2}, {:.2}) deg",
            self.root_link, degrees[0], degrees[1], degrees[2]
        )?;
        writeln!(out, "limits")?;
        writeln!(out, "  wheel rims   {}", motion(&self.wheel, "m"))?;
        let base = &self.base;
        writeln!(
            out,
            "  base         {:.4} m/s, {:.4} m/s2, {:.4} rad/s, {:.4} rad/s2, eta {:.3}, min speed {:.4} m/s",
            base.speed, base.acceleration, base.angular_speed, base.angular_acceleration, base.eta, base.min_speed
        )?;
        for joint in &self.joints {
            let unit = if joint.prismatic { "m" } else { "rad" };
            let range = if joint.lower.is_infinite() && joint.upper.is_infinite() {
                "endless".into()
            } else {
                format!("{:.4} to {:.4} {unit}", joint.lower, joint.upper)
            };
            writeln!(out, "  {:<12} {range}, {}", joint.name, motion(&joint.limits, unit))?;
        }
        writeln!(out, "bodies")?;
        for (index, body) in self.bodies.iter().enumerate() {
            let Some(moved) = &body.motion else {
                writeln!(out, "  {index}: {}: the base", body.link)?;
                continue;
            };
            let verb = if moved.prismatic { "slides" } else { "turns" };
            let joint = &self.joints[moved.joint].name;
            let (multiplier, offset) = (moved.multiplier, moved.offset);
            writeln!(out, "  {index}: {}: {verb} on {} by {multiplier} * {joint} + {offset}", body.link, body.parent)?;
        }
        writeln!(out, "collision shapes")?;
        for shape in &self.shapes {
            let what = match &shape.convex {
                Convex::Box { half: [x, y, z] } => format!("box {:.4} x {:.4} x {:.4} m", 2.0 * x, 2.0 * y, 2.0 * z),
                Convex::Cylinder { radius, half_length } => {
                    format!("cylinder, radius {radius:.4} m, length {:.4} m", 2.0 * half_length)
                }
                Convex::Sphere { radius } => format!("sphere, radius {radius:.4} m"),
                Convex::Hull { vertices } => {
                    let [x, y, z] = shape.convex.half_extents().map(|h| 2.0 * h);
                    format!("mesh, hull of {} points in {x:.4} x {y:.4} x {z:.4} m", vertices.len())
                }
            };
            writeln!(out, "  {} (body {}): {what}", shape.link, shape.body)?;
        }
        self.dimensions(out)?;
        writeln!(out, "top over all postures: at most {:.4} m", self.top_over_all_postures())
    }

    /// The table of dimensions; all joints at the same share of their range.
    fn dimensions(&self, out: &mut String) -> std::fmt::Result {
        writeln!(
            out,
            "{:<18}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}{:>9}",
            "joints (m)", "x from", "to", "y from", "to", "z from", "to", "radius"
        )?;
        let mut row = |label: &str, low: [f64; 3], high: [f64; 3], radius: f64| {
            write!(out, "{label:<18}")?;
            for axis in 0..3 {
                write!(out, "{:>9.3}{:>9.3}", low[axis] + 0.0, high[axis] + 0.0)?;
            }
            writeln!(out, "{radius:>9.3}")
        };
        if self.joints.is_empty() {
            let extents = self.extents(&[]);
            return row("all", extents.min, extents.max, self.radius(&[]));
        }
        for percent in [0.0, 25.0, 50.0, 75.0, 100.0] {
            let q = self.posture(percent / 100.0);
            let extents = self.extents(&q);
            row(&format!("{percent}% of the range"), extents.min, extents.max, self.radius(&q))?;
        }
        let (mut low, mut high, mut radius) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3], 0f64);
        for step in 0..=360 {
            let q = self.posture(f64::from(step) / 360.0);
            let extents = self.extents(&q);
            for axis in 0..3 {
                low[axis] = low[axis].min(extents.min[axis]);
                high[axis] = high[axis].max(extents.max[axis]);
            }
            radius = radius.max(self.radius(&q));
        }
        row("swept", low, high, radius)
    }

    /// Every joint at a share of its range (0 to 1); endless ones from -pi to pi.
    pub fn posture(&self, share: f64) -> Vec<f64> {
        let value = |joint: &super::MovingJoint| {
            let low = if joint.lower.is_finite() { joint.lower } else { -std::f64::consts::PI };
            let high = if joint.upper.is_finite() { joint.upper } else { std::f64::consts::PI };
            low + share * (high - low)
        };
        self.joints.iter().map(value).collect()
    }
}

fn motion(limits: &MotionLimits, unit: &str) -> String {
    let one = |value: Option<f64>, per: &str| match value {
        Some(value) => format!("{value:.4} {unit}/{per}"),
        None => format!("no limit ({unit}/{per})"),
    };
    format!("{}, {}, {}", one(limits.speed, "s"), one(limits.acceleration, "s2"), one(limits.jerk, "s3"))
}
