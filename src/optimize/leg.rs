//! One driven leg: from the first guess through the passes of L-BFGS to a curve in real time.

use super::contour::Contour;
use super::initial::guess;
use super::minco::{Minco, TERMS};
use super::objective::{Objective, Violation};
use super::options::OptimizeOptions;
use super::penalty::Limits;
use super::penalty::clearance::ClearancePenalty;
use super::penalty::field::DistanceField;
use super::sections::{DriveSection, Thresholds};
use super::time_map;
use crate::geom::unwrap_near;
use crate::math::lbfgs::{Lbfgs, Stop};
use crate::math::poly::{Piece, PiecewisePoly};
use crate::math::real;
use crate::robot::RobotModel;
use crate::search::{SearchMove, SearchPath};
use crate::trajectory::{DriveLeg, Ending};

/// Samples a piece by which a finished curve is judged, per sparse sample.
const JUDGE_DENSITY: usize = 4;
/// A limit overstepped by this share makes the whole motion crawl once it is slowed down to keep it.
const HOPELESS: f64 = 0.5;
/// A limit overstepped by this share after a pass is a corner that no curve gets round; cut at once.
const LOST: f64 = 0.6;
/// A curve that takes this many times the first guess's time (and 2 s for its ramps) is caught in a loop.
const DETOUR: f64 = 1.4;
/// The heading at a leg's end is fixed by its end state; a difference is whole turns.
const HEADING_TOLERANCE: f64 = 0.05;

/// What all legs of one robot share.
pub(crate) struct Context<'a, F> {
    pub robot: &'a RobotModel,
    pub field: &'a F,
    pub limits: Limits,
    pub clearance: ClearancePenalty,
    /// Which spins curves take in.
    pub thresholds: Thresholds,
    /// The options, and those of a second attempt: stiffer against what lets a curve slip into a loop.
    pub attempts: [OptimizeOptions; 2],
}

impl<'a, F: DistanceField> Context<'a, F> {
    /// Samples the robot's contour.
    pub fn new(robot: &'a RobotModel, field: &'a F, options: &'a OptimizeOptions) -> Self {
        let spacing = options.contour_spacing.unwrap_or_else(|| field.cell().clamp(0.03, 0.08));
        let contour = Contour::new(robot, spacing);
        let scale = options.clearance_scale;
        Self {
            robot,
            field,
            limits: Limits::new(robot, options.penalty_width),
            clearance: ClearancePenalty::new(contour, robot, options.clearance, scale, field.cell()),
            thresholds: Thresholds::of(options),
            attempts: [options.clone(), stiffer(options)],
        }
    }
}

/// A first pass that pays five times as much for the limits and looks between samples up to half the speed limit.
fn stiffer(options: &OptimizeOptions) -> OptimizeOptions {
    OptimizeOptions {
        motion_weight: 5.0 * options.motion_weight,
        dense_below: options.dense_below.max(0.5),
        ..options.clone()
    }
}

/// A leg and how it came about.
pub(crate) struct SolvedLeg {
    pub leg: DriveLeg,
    pub pieces: usize,
    pub iterations: usize,
    pub cost: f64,
    pub ending: Ending,
    /// Keeps its heading's branch, its clearance within the tolerance, and roughly its limits.
    pub sound: bool,
    pub violation: Violation,
    /// State of the path where the worst piece might be taken apart: a spin inside the section.
    pub cut: Option<usize>,
}

/// Optimises one section; where the first attempt is not sound and there is nothing to cut, a second one may be.
pub(crate) fn solve<F: DistanceField>(
    path: &SearchPath,
    section: &DriveSection,
    context: &Context<'_, F>,
) -> SolvedLeg {
    let [first, second] = &context.attempts;
    let solved = attempt(path, section, context, first);
    if solved.sound || solved.cut.is_some() {
        return solved;
    }
    let again = attempt(path, section, context, second);
    let iterations = solved.iterations + again.iterations;
    let better = if again.sound || again.violation.clearance < solved.violation.clearance { again } else { solved };
    SolvedLeg { iterations, ..better }
}

/// The spin nearest to the middle of a piece, by arc length.
fn spin_near(path: &SearchPath, section: &DriveSection, breaks: &[f64], piece: usize) -> Option<usize> {
    let middle = 0.5 * (breaks[piece] + breaks[piece + 1]);
    let mut arc = 0.0;
    let mut best: Option<(f64, usize)> = None;
    for i in section.first..section.last {
        let (from, to) = (path.states[i].pose, path.states[i + 1].pose);
        arc += from.distance(to);
        // Spins at the ends are no place to cut: nothing would be left on one side.
        let inside = arc > 1e-9 && arc < breaks[breaks.len() - 1] - 1e-9;
        if inside && path.moves[i] == SearchMove::Still && from.yaw != to.yaw {
            let off = (arc - middle).abs();
            if best.is_none_or(|(least, _)| off < least) {
                best = Some((off, i));
            }
        }
    }
    best.map(|(_, state)| state)
}

fn attempt<F: DistanceField>(
    path: &SearchPath,
    section: &DriveSection,
    context: &Context<'_, F>,
    options: &OptimizeOptions,
) -> SolvedLeg {
    let first = guess(path, section, &context.limits, options);
    let minco = Minco::new(first.pieces, &first.start, &first.end);
    let clearance = context.clearance.clone();
    let mut objective = Objective::new(context.robot, context.field, minco, section.reverse, clearance, options);
    let mut iteration = Lbfgs::new(objective.dimension(), options.lbfgs.clone());
    let mut x = first.variables.clone();
    let guessed: f64 = x[x.len() - first.pieces..].iter().map(|tau| time_map::duration(*tau).0).sum();
    let judged_at = options.samples_per_piece.max(1) * JUDGE_DENSITY;
    let (mut iterations, mut cost, mut ending) = (0, f64::NAN, Ending::Converged);
    let mut violation = Violation { motion: f64::INFINITY, clearance: f64::INFINITY, worst_piece: 0 };
    for _ in 0..options.passes.max(1) {
        let end = iteration.minimise(&mut x, |x, g| objective.evaluate(x, g));
        iterations += end.iterations;
        cost = end.cost;
        ending = match end.stop {
            Stop::Converged => Ending::Converged,
            Stop::IterationLimit => Ending::IterationLimit,
            Stop::LineSearchStalled => Ending::LineSearchStalled,
        };
        if !cost.is_finite() {
            cost = 0.0;
            ending = Ending::LineSearchStalled;
            break;
        }
        violation = objective.violation(&x, judged_at);
        let (fast, near) =
            (violation.motion > options.motion_tolerance, violation.clearance > options.pass_clearance_tolerance);
        let lost = violation.motion > LOST && spin_near(path, section, &first.breaks, violation.worst_piece).is_some();
        if (!fast && !near) || lost {
            break;
        }
        if fast {
            objective.weights.motion *= options.weight_growth;
            objective.weights.dense *= options.weight_growth;
        }
        if near {
            objective.weights.clearance *= options.weight_growth;
            objective.tighten(violation.clearance.min(options.clearance_tolerance));
        }
    }
    let (from, to) = (path.states[section.first].pose.yaw, path.states[section.last].pose.yaw);
    let leg_of = |curve: &Minco| DriveLeg { curve: real_time(curve), reverse: section.reverse, yaw_start: from };
    let keeps_heading =
        |leg: &DriveLeg| heading_at_end(leg, judged_at).is_some_and(|yaw| (yaw - to).abs() < HEADING_TOLERANCE);
    let judged = objective.violation(&x, judged_at);
    let mut leg = leg_of(objective.curve());
    let mut sound = violation.motion < HOPELESS && violation.clearance < options.clearance_tolerance;
    // A loop that turns nothing round still keeps every limit: it only takes long.
    sound &= leg.curve.duration() < DETOUR * guessed + 2.0;
    if ending == Ending::LineSearchStalled && !violation.motion.is_finite() {
        sound = false;
    } else {
        violation = judged;
    }
    if !keeps_heading(&leg) {
        // A loop or a cusp: the legs that follow would be turned round. On a straight the first guess has neither.
        sound = false;
        ending = Ending::LineSearchStalled;
        objective.violation(&first.variables, 1);
        leg = leg_of(objective.curve());
    }
    let cut = spin_near(path, section, &first.breaks, violation.worst_piece);
    SolvedLeg { pieces: leg.curve.pieces.len(), leg, iterations, cost, ending, sound, violation, cut }
}

/// Heading at the end of a leg, followed along the curve; `None` where it jumps (the curve stops and turns back).
pub(crate) fn heading_at_end(leg: &DriveLeg, per_piece: usize) -> Option<f64> {
    let side = if leg.reverse { -1.0 } else { 1.0 };
    let mut yaw = leg.yaw_start;
    for piece in &leg.curve.pieces {
        for k in 0..=per_piece {
            let t = piece.duration * k as f64 / per_piece as f64;
            let next =
                unwrap_near(real::atan2(side * piece.derivative(1, 1, t), side * piece.derivative(0, 1, t)), yaw);
            let turn = (next - yaw).abs();
            if turn.is_nan() || turn > 0.8 {
                return None;
            }
            yaw = next;
        }
    }
    Some(yaw)
}

/// The curve with coefficients in powers of seconds.
fn real_time(curve: &Minco) -> PiecewisePoly {
    let m = curve.dimensions();
    let pieces = curve
        .durations()
        .iter()
        .enumerate()
        .map(|(piece, &duration)| {
            let coefficients = (0..m)
                .map(|d| {
                    (0..TERMS)
                        .map(|k| curve.coefficients()[(piece * TERMS + k) * m + d] / real::powi(duration, k as i32))
                        .collect()
                })
                .collect();
            Piece { duration, coefficients }
        })
        .collect();
    PiecewisePoly { pieces }
}
