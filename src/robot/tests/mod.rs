//! Tests of the whole stage, and what they share.

mod errors;
mod init;
mod kinematics;
mod pairs;
mod quirks;
mod reaches;
mod real_robots;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use super::spec::{self, RobotSpec, Written};
use super::{Files, RobotInputs, RobotModel, parse};
use crate::diag::{Diagnostic, Diagnostics};
use crate::mission::{ActuatorLimitsSpec, LimitsSpec};

/// Files in memory.
#[derive(Default)]
struct Memory(BTreeMap<PathBuf, Vec<u8>>);

impl Files for Memory {
    fn read(&mut self, path: &Path) -> std::io::Result<Vec<u8>> {
        self.0.get(path).cloned().ok_or_else(|| std::io::ErrorKind::NotFound.into())
    }

    fn may_leave(&self, path: &Path) -> bool {
        path.starts_with("/opt")
    }
}

fn written<T>(value: T) -> Written<T> {
    Written { value, span: None }
}

fn names(names: &[&str]) -> Vec<Written<String>> {
    names.iter().map(|name| written(name.to_string())).collect()
}

fn read_with(urdf: &str, spec: &RobotSpec, files: &mut dyn Files) -> Result<RobotModel, Diagnostics> {
    parse(RobotInputs { spec, urdf: ("a/b/r.urdf", urdf), files, overrides: &LimitsSpec::default() })
}

fn read(urdf: &str, spec: &RobotSpec) -> Result<RobotModel, Diagnostics> {
    read_with(urdf, spec, &mut Memory::default())
}

/// The only fault; panics where there is none or several.
fn fault(urdf: &str, spec: &RobotSpec) -> Diagnostic {
    let mut faults = read(urdf, spec).expect_err("a fault").0;
    assert_eq!(faults.len(), 1, "{faults:?}");
    faults.remove(0)
}

/// A robot with wheels of radius 0.1 m at y = ±0.2 m, and `more` links and joints.
fn with_wheels(more: &str) -> String {
    format!(
        r#"<?xml version="1.0"?>
<robot name="r">
  <link name="base"><collision><origin xyz="0 0 0.2"/><geometry><box size="0.4 0.3 0.2"/></geometry></collision></link>
  {}
  {}
  {more}
</robot>"#,
        wheel("left", "0 0.2 0.1", 0.1),
        wheel("right", "0 -0.2 0.1", 0.1)
    )
}

fn wheel(name: &str, xyz: &str, radius: f64) -> String {
    format!(
        r#"<link name="{name}_link"><collision><origin rpy="1.5707963267948966 0 0"/><geometry><cylinder radius="{radius}" length="0.03"/></geometry></collision></link>
  <joint name="{name}" type="continuous"><parent link="base"/><child link="{name}_link"/><origin xyz="{xyz}"/><axis xyz="0 1 0"/></joint>"#
    )
}

/// A link `child` with a small box, on a joint of its own; `more` goes into the joint.
fn limb(joint: &str, kind: &str, parent: &str, child: &str, more: &str) -> String {
    format!(
        r#"<link name="{child}"><collision><origin xyz="0.1 0 0"/><geometry><box size="0.2 0.02 0.02"/></geometry></collision></link>
  <joint name="{joint}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{more}</joint>"#
    )
}

const LIMIT: &str = r#"<limit lower="-1" upper="2" effort="1" velocity="0.5"/>"#;

/// The papers' robot, as robot.yaml describes it.
fn scr_db() -> RobotModel {
    let mut spec = RobotSpec {
        name: Some("scr_db".into()),
        drive_left: names(&["left_wheel_joint"]),
        drive_right: names(&["right_wheel_joint"]),
        wheel_radius: Some(written(0.08)),
        track_width: Some(written(0.32)),
        moving: Some(names(&["blade"])),
        ..RobotSpec::default()
    };
    let blade =
        ActuatorLimitsSpec { speed: Some(1.0), acceleration: Some(2.0), jerk: Some(10.0), ..Default::default() };
    spec.limits.joints.insert("blade".into(), blade);
    spec.limits.wheel =
        ActuatorLimitsSpec { speed: Some(0.5), acceleration: Some(0.5), jerk: Some(2.0), ..Default::default() };
    spec.limits.base.eta = Some(0.1);
    spec.limits.base.angular_acceleration = Some(1.5);
    read(include_str!("../../../robots/scr_db/scr_db.urdf"), &spec).unwrap()
}
