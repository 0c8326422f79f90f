//! Given paths: cubic Bezier segments, or the rows of a CSV file, as a [`Trajectory`].

mod error;
mod table;

use crate::geom::Pose2;
use crate::math::poly::{Piece, PiecewisePoly};
use crate::math::real;
use crate::math::spline::{SplineEnd, cubic_spline};
use crate::robot::RobotModel;

pub use error::GivenError;
use table::Table;

use super::plane_curve::{CurveError, PlaneCurve};
use super::{DriveLeg, Leg, StillLeg, Trajectory, TrajectorySource};

/// Segments that end and start farther apart do not join, m. Nearer ones are moved together.
pub const JOIN_TOLERANCE: f64 = 1e-6;
/// Tangents that differ by more ask for a spin on the spot, rad. (Over one row of commands the rest is a step of a wheel's
/// travel of a few nanometres.)
pub const TANGENT_TOLERANCE: f64 = 1e-8;
/// Curvatures that differ by more ask for a stop, 1/m: no finite wheel acceleration follows a jump. Room for control points
/// written to seven digits or more.
pub const CURVATURE_TOLERANCE: f64 = 1e-5;
/// Where |derivative| falls below this share of the segment's mean, the path has a cusp or a zero handle: no heading.
const LEAST_SPEED: f64 = 1e-6;

/// A path of cubic Bezier segments (four control points each, metres); joints are held at `joints`.
///
/// Where tangent and curvature are continuous (within [`TANGENT_TOLERANCE`], [`CURVATURE_TOLERANCE`]) segments are one leg. A jump
/// of curvature makes a stop, a jump of the tangent also a spin on the spot, by the shorter way.
///
/// # Errors
/// The first fault found: no segment, a gap, no length, a vanishing derivative, a number that is not finite.
pub fn from_bezier(segments: &[[[f64; 2]; 4]], joints: &[f64]) -> Result<Trajectory, GivenError> {
    let mut pieces: Vec<Piece> = Vec::with_capacity(segments.len());
    let mut end: Option<[f64; 2]> = None;
    for (i, points) in segments.iter().enumerate() {
        let (segment, mut points) = (i + 1, *points);
        if points.iter().flatten().any(|c| !c.is_finite()) {
            return Err(GivenError::NotFinite { segment });
        }
        if let Some(end) = end {
            let gap = real::hypot(points[0][0] - end[0], points[0][1] - end[1]);
            if gap > JOIN_TOLERANCE {
                return Err(GivenError::Gap { segment, gap });
            }
            points[0] = end;
        }
        end = Some(points[3]);
        if points.iter().all(|p| *p == points[0]) {
            return Err(GivenError::NoLength { segment });
        }
        let plane = [0, 1].map(|d| {
            let p = points.map(|point| point[d]);
            vec![p[0], 3.0 * (p[1] - p[0]), 3.0 * (p[2] - 2.0 * p[1] + p[0]), p[3] - 3.0 * (p[2] - p[1]) - p[0]]
        });
        let coefficients = plane.into_iter().chain(joints.iter().map(|value| vec![*value])).collect();
        pieces.push(Piece { duration: 1.0, coefficients });
    }
    if pieces.is_empty() {
        return Err(GivenError::NoSegments);
    }
    let legs = legs(pieces).map_err(|(i, parameter)| GivenError::Cusp { segment: i + 1, parameter })?;
    Ok(Trajectory { legs, source: TrajectorySource::Given, optimiser: None })
}

/// Legs of pieces that join in position; on failure the piece without a direction and the local parameter.
fn legs(pieces: Vec<Piece>) -> Result<Vec<Leg>, (usize, f64)> {
    let mut curves = Vec::with_capacity(pieces.len());
    for (i, piece) in pieces.iter().enumerate() {
        curves.push(directed(PiecewisePoly { pieces: vec![piece.clone()] }).map_err(|parameter| (i, parameter))?);
    }
    let mut out = Vec::new();
    let mut yaw_start = curves[0].start_heading();
    let mut yaw = yaw_start;
    let mut of_leg: Vec<Piece> = Vec::new();
    for (i, piece) in pieces.into_iter().enumerate() {
        let curve = &curves[i];
        of_leg.push(piece);
        yaw += curve.total_turn();
        let Some(next) = curves.get(i + 1) else { break };
        let jump = turn_between(curve.tangent(curve.end()), next.tangent(next.start()));
        let bend = next.curvature(next.start())[0] - curve.curvature(curve.end())[0];
        if jump.abs() <= TANGENT_TOLERANCE && bend.abs() <= CURVATURE_TOLERANCE {
            continue;
        }
        let curve_pieces = std::mem::take(&mut of_leg);
        out.push(Leg::Drive(DriveLeg { curve: PiecewisePoly { pieces: curve_pieces }, reverse: false, yaw_start }));
        if jump.abs() > TANGENT_TOLERANCE {
            let [x, y] = next.point(next.start());
            let dimensions = next.poly().pieces[0].coefficients.len();
            let joints: Vec<f64> = (2..dimensions).map(|d| next.jet(d, next.start())[0]).collect();
            out.push(Leg::Still(StillLeg {
                pose: Pose2::new(x, y, yaw),
                yaw_end: yaw + jump,
                joints_from: joints.clone(),
                joints_to: joints,
            }));
        }
        yaw += jump;
        yaw_start = yaw;
    }
    out.push(Leg::Drive(DriveLeg { curve: PiecewisePoly { pieces: of_leg }, reverse: false, yaw_start }));
    Ok(out)
}

/// The curve with its tables, or the parameter where it has no direction.
fn directed(poly: PiecewisePoly) -> Result<PlaneCurve, f64> {
    let duration = poly.duration();
    let curve = PlaneCurve::new(poly).map_err(|error| match error {
        CurveError::Vanishes { parameter } => parameter,
        CurveError::NotFinite { .. } | CurveError::Winds { .. } | CurveError::Empty => 0.0,
    })?;
    let least = LEAST_SPEED * curve.length() / duration;
    // The table is finest where the speed is least, so its nodes see every near-cusp.
    let slow = curve.nodes().find(|place| curve.rates(*place).speed[0] < least).map(|place| curve.parameter(place));
    slow.map_or(Ok(curve), Err)
}

fn turn_between(from: [f64; 2], to: [f64; 2]) -> f64 {
    real::atan2(from[0] * to[1] - from[1] * to[0], from[0] * to[0] + from[1] * to[1])
}

/// A path from CSV text: `x_m, y_m` and, for joints that move, `joint.<name>.pos_rad` (`_m` where prismatic). Lines that start
/// with `#` and empty ones are skipped; `name` is the file as the user knows it.
///
/// The curve is the C2 cubic spline over chord length, clamped to unit tangents along the first and last chord. Joints follow the
/// natural C2 cubic spline over the same parameter, which keeps a linear column linear; joints without a column are held at
/// `default_joints` (one per moving joint). One leg: tangent and curvature are continuous.
///
/// # Errors
/// All faults found, each with its line.
pub fn from_csv(
    name: &str,
    text: &str,
    robot: &RobotModel,
    default_joints: &[f64],
) -> Result<Trajectory, Vec<GivenError>> {
    debug_assert_eq!(default_joints.len(), robot.joints.len());
    let table = Table::read(name, text, robot)?;
    let mut knots = vec![0.0];
    for (i, pair) in table.rows.windows(2).enumerate() {
        knots.push(knots[i] + real::hypot(pair[1].point[0] - pair[0].point[0], pair[1].point[1] - pair[0].point[1]));
    }
    let last = table.rows.len() - 1;
    let chord = |i: usize, d: usize| (table.rows[i + 1].point[d] - table.rows[i].point[d]) / (knots[i + 1] - knots[i]);
    let mut dimensions: Vec<Vec<[f64; 4]>> = (0..2)
        .map(|d| {
            let values: Vec<f64> = table.rows.iter().map(|row| row.point[d]).collect();
            cubic_spline(&knots, &values, [SplineEnd::Slope(chord(0, d)), SplineEnd::Slope(chord(last - 1, d))])
        })
        .collect();
    for (joint, default) in default_joints.iter().enumerate() {
        let values: Vec<f64> = table.rows.iter().map(|row| row.joints[joint].unwrap_or(*default)).collect();
        dimensions.push(cubic_spline(&knots, &values, [SplineEnd::Natural; 2]));
    }
    let pieces: Vec<Piece> = (0..last)
        .map(|i| Piece {
            duration: knots[i + 1] - knots[i],
            coefficients: dimensions.iter().map(|d| d[i].to_vec()).collect(),
        })
        .collect();
    table.check_joint_ranges(&pieces, robot)?;
    let curve = directed(PiecewisePoly { pieces }).map_err(|parameter| {
        let row = &table.rows[knots.partition_point(|k| *k <= parameter).clamp(1, last) - 1];
        vec![GivenError::TurnsBack { line: row.line, at: row.at.clone() }]
    })?;
    let leg = DriveLeg { curve: curve.poly().clone(), reverse: false, yaw_start: curve.start_heading() };
    Ok(Trajectory { legs: vec![Leg::Drive(leg)], source: TrajectorySource::Given, optimiser: None })
}

#[cfg(test)]
mod tests;
