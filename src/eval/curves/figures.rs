//! What came out, as JSON.

use serde_json::{Value, json};

use super::{Figures, Held, How, Judged, MISSED, Row};
use crate::report::names;
use crate::robot::RobotModel;

/// The document: `{"curves": [{id, optimum_s, …, "rows": […]}], "limits": {…}, …}`. A row has either its figures or `refused`, the reason.
pub fn document(judged: &[Judged], robot: &RobotModel, held: Held) -> String {
    let curves: Vec<Value> = judged.iter().map(|one| curve(one, robot)).collect();
    let wheel = &robot.wheel;
    let document = json!({
        "curves": curves,
        "limits": {"speed_mps": wheel.speed, "acceleration_mps2": wheel.acceleration, "jerk_mps3": wheel.jerk},
        "wheel_radius_m": robot.wheel_radii.mean,
        "track_width_m": robot.track_width,
        "sampling_time_s": held.sampling_time,
        "sampling": names::sampling(held.sampling),
        "missed_beyond_m": MISSED,
    });
    format!("{document:#}\n")
}

fn curve(judged: &Judged, robot: &RobotModel) -> Value {
    let curve = &judged.curve;
    let paper = curve.paper.map(|[without, with]| {
        json!({
            "without_eq5": {"figures": without, "end_point": "missed"},
            "with_eq5": {"figures": with, "end_point": "reached"},
        })
    });
    json!({
        "id": curve.id,
        "control_points_m": curve.segments,
        "length_m": curve.length,
        "least_radius_m": curve.least_radius,
        "optimum_s": curve.optimum,
        "toppra_s": curve.lower_bound,
        "paper": paper,
        "rows": judged.rows.iter().map(|r| row(r, curve.optimum, robot)).collect::<Vec<_>>(),
    })
}

fn row(row: &Row, optimum: f64, robot: &RobotModel) -> Value {
    let mut value = json!({"name": row.how.key(), "compiled": matches!(row.how, How::Compiled(_))});
    let figures = match &row.outcome {
        Err(reason) => json!({"refused": reason}),
        Ok(figures) => of_commands(figures, optimum, robot),
    };
    if let (Value::Object(value), Value::Object(figures)) = (&mut value, figures) {
        value.extend(figures);
    }
    value
}

fn of_commands(figures: &Figures, optimum: f64, robot: &RobotModel) -> Value {
    let [speed, acceleration, jerk] = figures.peaks;
    let miss = |miss: super::Miss| json!({"distance_m": miss.distance, "heading_rad": miss.angle, "missed": miss.distance > MISSED});
    json!({
        "law_taken": (!figures.taken.is_empty()).then_some(&figures.taken),
        "time_s": figures.time,
        "over_optimum_percent": 100.0 * (figures.time / optimum - 1.0),
        "rows_s": figures.table.duration(),
        "peaks": {"speed_mps": speed, "acceleration_mps2": acceleration, "jerk_mps3": jerk},
        "limits_hold": !figures.over(robot).contains(&true),
        "end_point": miss(figures.followed),
        "end_point_clipped": miss(figures.clipped),
    })
}
