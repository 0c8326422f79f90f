//! The judge's bookkeeping of numbers: the table in itself, and the limits of actuators.

use super::Truth;
use super::motion::{Motion, radius};
use crate::eval::trust::case::Case;

/// Limits hold up to this share more: rounding in digits as written.
const SHARE: f64 = 1e-9;

/// Whether a figure is at most its bound; within `doubt` of it nobody can tell.
pub(super) fn at_most(what: &str, figure: f64, bound: f64, doubt: f64) -> Truth {
    if figure > bound + doubt || figure.is_nan() {
        Truth::Broken(format!("{what}: {figure:.9e} of {bound:.9e}"))
    } else if figure > bound - doubt {
        Truth::Open(format!("{what}: {figure:.9e} of {bound:.9e}"))
    } else {
        Truth::Holds { spare: f64::INFINITY }
    }
}

/// An angle without its whole turns, as a magnitude.
pub(super) fn angle(value: f64) -> f64 {
    let turn = 2.0 * std::f64::consts::PI;
    (value - turn * (value / turn).round()).abs()
}

/// The table: starts at the start, joints where their speeds bring them, in their ranges, at rest at its end, not backwards.
pub(super) fn table(case: &Case, motion: &Motion<'_>, note: &mut impl FnMut(Truth)) {
    let (rows, start) = (&case.table.rows, &case.task.start);
    let first = &rows[0].pose;
    for (what, off) in [
        ("first x", (first.x - start.x).abs()),
        ("first y", (first.y - start.y).abs()),
        ("first yaw", angle(first.yaw - start.yaw)),
    ] {
        note(at_most(what, off, 1e-6, 1e-12));
    }
    for (row, state) in rows.iter().zip(&motion.states) {
        for (index, joint) in case.robot.joints.iter().enumerate() {
            let value = state.joints[index];
            note(at_most("position and speed", (row.joint_positions[index] - value).abs(), 1e-6, 1e-12));
            note(at_most("range", value - joint.upper, 1e-9, 1e-12));
            note(at_most("range", joint.lower - value, 1e-9, 1e-12));
        }
    }
    let last = &rows[rows.len() - 1];
    let moving = [last.wheel_left, last.wheel_right].iter().chain(&last.joint_velocities).any(|speed| *speed != 0.0);
    if moving {
        note(Truth::Broken("last row not at rest".into()));
    }
    if !case.task.reverse {
        for row in 0..rows.len() {
            note(at_most("backwards", -super::motion::held(&case.table, row)[0], 1e-6, 1e-14));
        }
    }
}

/// Speed, first and second difference of what every actuator holds, at rest before and after.
pub(super) fn limits(case: &Case, note: &mut impl FnMut(Truth)) {
    let (table, robot) = (&case.table, &case.robot);
    let wheel = |left: bool| {
        let speed = move |row: &crate::command::CommandRow| if left { row.wheel_left } else { row.wheel_right };
        table.rows.iter().map(|row| radius(table, left) * speed(row)).collect::<Vec<f64>>()
    };
    let mut actuators = vec![(robot.wheel, wheel(true)), (robot.wheel, wheel(false))];
    for (index, joint) in robot.joints.iter().enumerate() {
        actuators.push((joint.limits, table.rows.iter().map(|row| row.joint_velocities[index]).collect()));
    }
    for (limit, speeds) in actuators {
        let mut padded = vec![0.0, 0.0];
        padded.extend(speeds);
        padded.extend([0.0, 0.0]);
        let step = table.sampling_time;
        let largest = |figures: Vec<f64>| figures.into_iter().map(f64::abs).fold(0.0, f64::max);
        let speed = largest(padded.clone());
        let acceleration = largest(padded.windows(2).map(|w| (w[1] - w[0]) / step).collect());
        let jerk = largest(padded.windows(3).map(|w| (w[2] - w[1] - (w[1] - w[0])) / step / step).collect());
        for (what, figure, bound) in [
            ("speed", speed, limit.speed),
            ("acceleration", acceleration, limit.acceleration),
            ("jerk", jerk, limit.jerk),
        ] {
            if let Some(bound) = bound {
                note(at_most(what, figure, bound * (1.0 + SHARE), 1e-12 * bound));
            }
        }
    }
}
