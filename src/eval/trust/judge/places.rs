//! The judge's bookkeeping of places: where the motion ends, where it stands, and where it is slow.

use super::figures::{angle, at_most};
use super::hunt::Hunt;
use super::motion::{Motion, State, held};
use super::{Truth, decided};
use crate::eval::trust::case::Case;

/// How far from a goal is at it, m.
const POINT: f64 = 1e-3;
/// The same of an angle, rad.
const ANGLE: f64 = 0.1 / 180.0 * std::f64::consts::PI;
/// Rounding in whole rows of a stand, s.
const ROWS: f64 = 1e-9;

/// Whether the motion ends at the goal.
pub(super) fn end(case: &Case, motion: &Motion<'_>, note: &mut impl FnMut(Truth)) {
    let last = &motion.states[motion.rows() - 1];
    let goal = &case.task.goal;
    let place = Place { x: goal.x, y: goal.y, within: goal.within, yaw: goal.yaw, joints: &goal.joints };
    for (what, figure, bound) in place.off(case, last) {
        note(at_most(what, figure, bound, 1e-11));
    }
}

/// A goal, or a via.
struct Place<'a> {
    x: f64,
    y: f64,
    within: f64,
    yaw: Option<f64>,
    joints: &'a [Option<f64>],
}

impl Place<'_> {
    /// How far off, and how far is allowed.
    fn off(&self, case: &Case, state: &State) -> Vec<(&'static str, f64, f64)> {
        let (dx, dy) = (state.x - self.x, state.y - self.y);
        let mut out = vec![("end point", (dx * dx + dy * dy).sqrt(), POINT.max(self.within))];
        if let Some(yaw) = self.yaw {
            out.push(("end heading", angle(state.yaw - yaw), ANGLE));
        }
        for ((joint, wanted), value) in case.robot.joints.iter().zip(self.joints).zip(&state.joints) {
            if let Some(wanted) = wanted {
                out.push(("end joint", (value - wanted).abs(), if joint.prismatic { POINT } else { ANGLE }));
            }
        }
        out
    }
}

/// Whether the robot stands at every via in order, each for its dwell.
pub(super) fn stands(case: &Case, motion: &Motion<'_>, note: &mut impl FnMut(Truth)) {
    let still = |row: usize| {
        let row = &case.table.rows[row];
        row.wheel_left == 0.0 && row.wheel_right == 0.0 && row.joint_velocities.iter().all(|rate| *rate == 0.0)
    };
    let (rows, step) = (motion.rows(), case.table.sampling_time);
    let mut from = 0;
    for via in &case.vias {
        let goal = &via.place;
        let place = Place { x: goal.x, y: goal.y, within: goal.within, yaw: goal.yaw, joints: &goal.joints };
        // Rows that must be held; where none must, one has to begin at rest.
        let needed = ((via.dwell - ROWS) / step).ceil().max(0.0) as usize;
        let doubtful = ((via.dwell - ROWS) / step - ((via.dwell - ROWS) / step).round()).abs() < 1e-10;
        let mut doubt = false;
        let found = (from..rows).find(|&row| {
            let begins = row + needed < rows && (row..row + needed.max(1)).all(still);
            let off = place.off(case, &motion.states[row]);
            doubt |= begins && off.iter().any(|(_, figure, bound)| (figure - bound).abs() < 1e-11);
            begins && off.iter().all(|(_, figure, bound)| figure <= bound)
        });
        if doubt || doubtful {
            note(Truth::Open("via".into()));
        }
        match found {
            Some(row) => from = row + needed.max(1),
            None => {
                note(Truth::Broken("does not stand at a via".into()));
                return;
            }
        }
    }
}

/// Whether the base is slow wherever a zone says so. The zones' polygons are convex here.
pub(super) fn zones(case: &Case, motion: &Motion<'_>, note: &mut impl FnMut(Truth)) {
    for zone in &case.zones {
        for row in 0..motion.rows() {
            let speed = held(&case.table, row)[0].abs();
            let fast = at_most("speed in a zone", speed, zone.speed * (1.0 + 1e-9), 1e-12);
            if matches!(fast, Truth::Holds { .. }) {
                continue;
            }
            let distance = |wanted| {
                let mut hunt = Hunt::new(wanted, 20_000);
                hunt.over_time(
                    motion.span(row),
                    speed,
                    vec![()],
                    |tau| motion.state(row, tau),
                    |state, (), _| {
                        let off = beyond(&zone.polygon, [state.x, state.y]);
                        [(off - 1e-12).max(0.0), off]
                    },
                );
                hunt.bracket()
            };
            // Where the speed itself is in doubt, so is what follows from it.
            note(match (decided(distance, 1e-9, "a zone's edge").0, fast) {
                (Truth::Broken(_), fast) => fast,
                (other, _) => other,
            });
        }
    }
}

/// Distance of a point from a convex polygon, zero within, m.
fn beyond(polygon: &[[f64; 2]], p: [f64; 2]) -> f64 {
    let (mut least, mut sides) = (f64::INFINITY, [false; 2]);
    for index in 0..polygon.len() {
        let (a, b) = (polygon[index], polygon[(index + 1) % polygon.len()]);
        let (ux, uy) = (b[0] - a[0], b[1] - a[1]);
        let (wx, wy) = (p[0] - a[0], p[1] - a[1]);
        sides[usize::from(ux * wy - uy * wx > 0.0)] = true;
        let share = ((wx * ux + wy * uy) / (ux * ux + uy * uy)).clamp(0.0, 1.0);
        let (ox, oy) = (wx - share * ux, wy - share * uy);
        least = least.min((ox * ox + oy * oy).sqrt());
    }
    if sides[0] && sides[1] { least } else { 0.0 }
}
