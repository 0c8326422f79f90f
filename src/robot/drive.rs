//! How large the driving wheels are, how far apart, and the base frame that they define.

use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};
use urdf_rs::Geometry;

use super::WheelRadii;
use super::spec::RobotSpec;
use super::tree::{self, Tree};
use super::urdf::Urdf;
use super::wheels::Wheels;
use crate::diag::{Diagnostic, Diagnostics};
use crate::math::real;

/// Angle below which axes count as parallel, rad: published angles are rounded (-1.57 for -pi/2).
pub(super) const PARALLEL: f64 = 0.01;
/// Largest difference of wheel radii, m.
const RADIUS_TOLERANCE: f64 = 1e-4;

/// What the wheels say about the robot.
pub(super) struct Drive {
    pub wheel_radii: WheelRadii,
    pub track_width: f64,
    pub base_from_root: Isometry3<f64>,
}

/// A wheel joint's axis and origin, in the root frame.
pub(super) struct Axle {
    pub origin: Vector3<f64>,
    pub axis: Vector3<f64>,
}

impl Axle {
    pub fn of(urdf: &Urdf, tree: &Tree, link_poses: &[Isometry3<f64>], joint: usize) -> Self {
        // The child's frame: a turn about the axis moves neither origin nor axis.
        let pose = link_poses[tree.child[joint]];
        Self {
            origin: pose.translation.vector,
            axis: pose.rotation * tree::axis(&urdf.robot.joints[joint]).into_inner(),
        }
    }

    pub fn horizontal(&self) -> bool {
        self.axis.z.abs() < PARALLEL
    }

    pub fn parallel(&self, other: &Vector3<f64>) -> bool {
        self.axis.cross(other).norm() < PARALLEL * other.norm()
    }
}

/// Wheel radius, track width and base frame; `value` holds every joint of the URDF at zero posture.
pub(super) fn drive(
    spec: &RobotSpec,
    urdf: &Urdf,
    tree: &Tree,
    wheels: &Wheels,
    value: impl Fn(usize) -> f64,
) -> Result<Drive, Diagnostics> {
    let poses = tree.link_poses(urdf, value);
    let joints = &urdf.robot.joints;
    let axle = |j: &usize| Axle::of(urdf, tree, &poses, *j);
    let (left, right): (Vec<Axle>, Vec<Axle>) =
        (wheels.left.iter().map(axle).collect(), wheels.right.iter().map(axle).collect());
    let mean = |side: &[Axle]| side.iter().map(|a| a.origin).sum::<Vector3<f64>>() / side.len() as f64;
    let across = mean(&left) - mean(&right);
    let at = &urdf.joint_spans[wheels.left[0]];
    let (mut faults, mut axes_good) = (Vec::new(), true);

    let first = &left[0];
    for (axle, j) in left.iter().chain(&right).zip(wheels.all()) {
        let name = &joints[j].name;
        let angle = real::asin(axle.axis.cross(&first.axis).norm().min(1.0));
        if !axle.horizontal() {
            let tilt = real::asin(axle.axis.z.abs().min(1.0)).to_degrees();
            let message = format!("axis of drive wheel `{name}` is not horizontal: tilted by {tilt:.2} degrees");
            let fault = Diagnostic::error("robot/wheel-not-horizontal", message).at(&urdf.joint_spans[j]);
            faults.push(
                fault.hint(
                    "correct its <axis> or <origin>: a wheel turns about a horizontal axis, such as xyz=\"0 1 0\"",
                ),
            );
            axes_good = false;
        } else if first.horizontal() && !axle.parallel(&first.axis) {
            let (other, degrees) = (&joints[wheels.left[0]].name, angle.to_degrees());
            let message = format!("axes of drive wheels `{other}` and `{name}` are not parallel: {degrees:.2} degrees");
            let fault = Diagnostic::error("robot/wheels-not-parallel", message).at(&urdf.joint_spans[j]);
            faults.push(fault.hint("correct the <axis> or <origin> of one of them: drive wheels turn about one line"));
            axes_good = false;
        }
    }
    let distance = across.norm();
    if distance < 1e-6 {
        let message = format!("the left and right drive wheels are at one place ({distance:.6} m apart)");
        let hint = "correct the <origin> of one of them in the URDF, or which joints robot.yaml names under `drive`";
        faults.push(Diagnostic::error("robot/zero-track", message).at(at).hint(hint));
    } else if axes_good && !first.parallel(&across) {
        let off = first.axis.cross(&across).norm();
        let message =
            format!("drive wheels are not coaxial: {distance:.4} m apart, the right {off:.4} m off the left's axis");
        let hint = "correct the <origin> of one of them in the URDF: drive wheels turn about one line";
        faults.push(Diagnostic::error("robot/wheels-not-coaxial", message).at(at).hint(hint));
    }
    let track_width = match &spec.track_width {
        Some(given) if !(given.value.is_finite() && given.value > 0.0) => {
            let message = format!("drive.track_width_m is {}, not above 0", given.value);
            let fault = Diagnostic::error("robot/zero-track", message).maybe_at(given.span.as_ref());
            faults.push(fault.hint("write the distance between the drive wheels, such as `track_width_m: 0.32`"));
            given.value
        }
        Some(given) => given.value,
        None => distance,
    };
    let radius = wheel_radius(spec, urdf, tree, wheels, &mut faults);
    let Some(radius) = radius.filter(|_| faults.is_empty()) else {
        return Err(Diagnostics(faults));
    };

    let y = Vector3::new(across.x, across.y, 0.0).normalize();
    let axes = Matrix3::from_columns(&[Vector3::new(y.y, -y.x, 0.0), y, Vector3::z()]);
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    let floor = (mean(&left) + mean(&right)) / 2.0 - Vector3::new(0.0, 0.0, radius);
    let root_from_base = Isometry3::from_parts(Translation3::from(floor), turn);
    debug_assert!((root_from_base * Point3::origin() - Point3::from(floor)).norm() < 1e-9);
    let wheel_radii = WheelRadii { mean: radius, difference: spec.wheel_difference.unwrap_or(0.0) };
    Ok(Drive { wheel_radii, track_width, base_from_root: root_from_base.inverse() })
}

/// The radius of a wheel's collision cylinder or sphere, m.
pub(super) fn round_radius(urdf: &Urdf, tree: &Tree, joint: usize) -> Option<f64> {
    urdf.robot.links[tree.child[joint]].collision.iter().find_map(|c| match c.geometry {
        Geometry::Cylinder { radius, .. } | Geometry::Sphere { radius } => Some(radius),
        _ => None,
    })
}

/// The mean radius given in robot.yaml, else that of the wheels' cylinders and spheres, which must agree.
fn wheel_radius(
    spec: &RobotSpec,
    urdf: &Urdf,
    tree: &Tree,
    wheels: &Wheels,
    faults: &mut Vec<Diagnostic>,
) -> Option<f64> {
    let known: Vec<(usize, f64)> = wheels.all().filter_map(|j| Some((j, round_radius(urdf, tree, j)?))).collect();
    for (j, radius) in known.iter().skip(1) {
        let (first, expected) = known[0];
        if (radius - expected).abs() > RADIUS_TOLERANCE {
            let name = |j: usize| &urdf.robot.joints[j].name;
            let message = format!(
                "drive wheels differ: radius {expected:.4} m (`{}`), {radius:.4} m (`{}`)",
                name(first),
                name(*j)
            );
            let hint = "give the mean as drive.wheel_radius_m in robot.yaml, and drive.wheel_difference if the real wheels differ too";
            faults.push(Diagnostic::error("robot/unequal-wheels", message).at(&urdf.joint_spans[*j]).hint(hint));
        }
    }
    match (&spec.wheel_radius, known.first()) {
        (Some(given), _) if given.value.is_finite() && given.value > 0.0 => Some(given.value),
        (Some(given), _) => {
            let message = format!("drive.wheel_radius_m is {}, not above 0", given.value);
            let fault = Diagnostic::error("robot/wheel-radius", message).maybe_at(given.span.as_ref());
            faults.push(fault.hint("write the wheels' radius, such as `wheel_radius_m: 0.08`"));
            None
        }
        (None, Some((_, radius))) if *radius > 0.0 => Some(*radius),
        (None, _) => {
            let joint = wheels.left[0];
            let link = &urdf.robot.links[tree.child[joint]].name;
            let message = format!("wheel radius unknown: link `{link}` has no collision cylinder or sphere");
            let fault = Diagnostic::error("robot/wheel-radius", message).at(&urdf.joint_spans[joint]);
            faults.push(fault.hint("give it in robot.yaml, such as `drive: {…, wheel_radius_m: 0.08}`"));
            None
        }
    }
}
