//! Where the unknown function has its knots, and what the rows do there.

use super::Problem;
use crate::math::real;

/// Least and most cells, jumps apart.
const CELLS: (f64, f64) = (80.0, 1000.0);
/// Samples of how long a stretch takes, in each stretch between two breaks.
const SAMPLES: usize = 4;
/// How near a break its one-sided limit is taken, as a share of the stretch.
const BESIDE: f64 = 1e-9;
/// Neighbouring cells differ in length by about this much at most, as a share of the length.
const GRADING: f64 = 0.5;
/// An acceleration and a jerk that change by less than this share of their limit across a break do not jump there.
const JUMP: [f64; 2] = [1e-6, 2e-2];
/// A cell is halved where a row's acceleration or jerk, at a constant rate, differs in the middle from the ends' mean by more than this
/// share of its limit.
const UNEVEN: f64 = 0.01;
/// Halvings at most.
const DEEPEST: usize = 4;
/// No cell between two jumps is shorter than this share of the usual: nearer breaks are left out unless they jump.
const CLOSE: f64 = 0.3;

/// The cells, and the rows at each cell's start, middle and end.
#[derive(Debug)]
pub(super) struct Grid {
    /// Reference times of the cells' ends, ascending; one more than cells.
    pub knots: Vec<f64>,
    /// For each point, cell after cell (start, middle, end), each row's three derivatives.
    pub rates: Vec<[f64; 3]>,
    /// For each knot, by how much each row's second derivative jumps; empty where none does.
    pub jumps: Vec<Vec<f64>>,
    /// For each knot, about how fast the reference may be: the least time for a unit of it, pointwise.
    pub slowness: Vec<f64>,
}

/// A stretch between two of the problem's breaks.
struct Stretch {
    from: f64,
    to: f64,
    /// Pointwise least time for a unit of reference time, at samples in equal parts of the stretch.
    slowness: [f64; SAMPLES],
    /// Jumps of the rows' second derivatives at its start, and whether the second or the third jump.
    jumps: Option<Vec<f64>>,
}

impl Grid {
    /// Cells of about equal duration, and knots where the rows jump. `coarse`: by how much longer than asked for they are, and by how much
    /// less even the rows may be in them.
    pub fn new(problem: &Problem<'_>, coarse: f64, rates: &mut impl FnMut(f64, &mut Vec<[f64; 3]>)) -> Option<Self> {
        let stretches = stretches(problem, rates)?;
        let least: f64 =
            stretches.iter().map(|s| (s.to - s.from) * s.slowness.iter().sum::<f64>() / SAMPLES as f64).sum();
        let cells = (least / problem.step).clamp(CELLS.0, CELLS.1) / coarse;
        let slowness = graded(&stretches, cells / least);
        // Least time up to each sample's end.
        let width = |i: usize| (stretches[i / SAMPLES].to - stretches[i / SAMPLES].from) / SAMPLES as f64;
        let mut least = vec![0.0];
        for i in 0..slowness.len() {
            least.push(least[i] + slowness[i] * width(i));
        }
        let total = *least.last()?;
        if !(total.is_finite() && total > 0.0) {
            return None;
        }
        let step = total / cells;
        // Knots: at jumps, and in equal parts between them.
        let mut fixed: Vec<usize> = vec![0];
        for (i, stretch) in stretches.iter().enumerate().skip(1) {
            if stretch.jumps.is_some() {
                fixed.push(i);
            }
        }
        fixed.push(stretches.len());
        let mut knots = Vec::with_capacity(cells as usize + fixed.len());
        let mut knot_jumps = Vec::with_capacity(cells as usize + fixed.len());
        let mut knot_slowness = Vec::with_capacity(cells as usize + fixed.len());
        let mut sample = 0;
        for pair in fixed.windows(2) {
            let (from, to) = (least[pair[0] * SAMPLES], least[pair[1] * SAMPLES]);
            let parts = ((to - from) / step + 1.0 - CLOSE).floor().max(1.0) as usize;
            for part in 0..parts {
                let target = from + (to - from) * part as f64 / parts as f64;
                while sample + 1 < slowness.len() && least[sample + 1] <= target {
                    sample += 1;
                }
                let stretch = &stretches[sample / SAMPLES];
                let start = stretch.from + (sample % SAMPLES) as f64 * width(sample);
                let knot = if part == 0 {
                    stretches[pair[0]].from
                } else {
                    start + (target - least[sample]) / slowness[sample]
                };
                if knots.last().is_none_or(|last| knot > *last) {
                    knots.push(knot);
                    knot_slowness.push(slowness[sample]);
                    let jumps = if part == 0 { stretches[pair[0]].jumps.clone() } else { None };
                    knot_jumps.push(jumps.unwrap_or_default());
                }
            }
        }
        let end = stretches[stretches.len() - 1].to;
        if knots.last().is_some_and(|last| *last >= end) {
            return None;
        }
        knots.push(end);
        knot_jumps.push(Vec::new());
        knot_slowness.push(*slowness.last()?);
        let even = Self { rates: Vec::new(), jumps: knot_jumps, slowness: knot_slowness, knots };
        let fine = even.halved(problem, UNEVEN * coarse * coarse, rates);
        fine.rates.iter().flatten().all(|rate| rate.is_finite()).then_some(fine)
    }

    /// With rates, and cells halved where a row is more uneven than `most`.
    fn halved(self, problem: &Problem<'_>, most: f64, rates: &mut impl FnMut(f64, &mut Vec<[f64; 3]>)) -> Self {
        let rows = problem.limits.len();
        let mut fine = Self { knots: Vec::new(), rates: Vec::new(), jumps: Vec::new(), slowness: Vec::new() };
        for (cell, jumps) in self.jumps.into_iter().enumerate() {
            let (from, slowness) = (self.knots[cell], self.slowness[cell]);
            fine.knots.push(from);
            fine.jumps.push(jumps);
            fine.slowness.push(slowness);
            let Some(to) = self.knots.get(cell + 1).copied() else { break };
            let least = 1.5 * (to - from) / f64::from(1u32 << DEEPEST);
            let mut start = from;
            let mut end = to;
            loop {
                let first = fine.rates.len();
                for share in [BESIDE, 0.5, 1.0 - BESIDE] {
                    rates(start + share * (end - start), &mut fine.rates);
                }
                let at = |point: usize, row: usize| fine.rates[first + point * rows + row];
                let uneven = (0..rows).any(|row| {
                    (1..3).any(|k| {
                        let off = at(1, row)[k] - 0.5 * (at(0, row)[k] + at(2, row)[k]);
                        off.abs() > most * problem.limits[row][k] * real::powi(slowness, k as i32 + 1)
                    })
                });
                if uneven && end - start > least {
                    fine.rates.truncate(first);
                    end = 0.5 * (start + end);
                    continue;
                }
                if end >= to {
                    break;
                }
                fine.knots.push(end);
                fine.jumps.push(Vec::new());
                fine.slowness.push(slowness);
                start = end;
                end = to;
            }
        }
        fine
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.knots.len() - 1
    }

    /// Number of unknowns: three have their say in each cell, two of them in the next one too.
    pub fn unknowns(&self) -> usize {
        self.cells() + 2
    }

    /// Where an unknown has its say: the ends, and the middle of every cell.
    pub fn place(&self, unknown: usize) -> f64 {
        match unknown {
            0 => self.knots[0],
            i if i > self.cells() => self.knots[self.cells()],
            i => 0.5 * (self.knots[i - 1] + self.knots[i]),
        }
    }

    /// The polynomial p0 + p1 s + p2 s^2 of a cell (s since its start) as three weights each of the unknowns `cell`, `cell + 1`,
    /// `cell + 2`: quadratic B-splines with the end knots tripled.
    pub fn basis(&self, cell: usize) -> [[f64; 3]; 3] {
        let length = |i: usize| self.knots[i + 1] - self.knots[i];
        let h = length(cell);
        let before = if cell > 0 { length(cell - 1) } else { 0.0 };
        let after = if cell + 1 < self.cells() { length(cell + 1) } else { 0.0 };
        let (left, right) = (2.0 / (before + h), 2.0 / (h + after));
        let half = 0.5 / h;
        [
            [0.5 * h * left, 0.5 * before * left, 0.0],
            [-left, left, 0.0],
            [half * left, -half * (left + right), half * right],
        ]
    }
}

/// The stretches between breaks, with the jumps across them.
fn stretches(problem: &Problem<'_>, rates: &mut impl FnMut(f64, &mut Vec<[f64; 3]>)) -> Option<Vec<Stretch>> {
    let end = problem.breaks.last()?;
    let mut stretches: Vec<Stretch> = Vec::new();
    let mut found = Vec::new();
    let mut before: Vec<[f64; 3]> = Vec::new();
    let mut beside = Vec::new();
    let mut from = problem.breaks[0];
    for to in &problem.breaks[1..] {
        let length = to - from;
        if length <= 1e-12 * end {
            continue;
        }
        let mut slowness = [0.0f64; SAMPLES];
        for (i, slowness) in slowness.iter_mut().enumerate() {
            found.clear();
            rates(from + (i as f64 + 0.5) / SAMPLES as f64 * length, &mut found);
            *slowness = pointwise(&found, problem.limits);
        }
        found.clear();
        rates(from + BESIDE * length, &mut found);
        beside.push((before.clone(), found.clone()));
        before.clear();
        rates(to - BESIDE * length, &mut before);
        stretches.push(Stretch { from, to: *to, slowness, jumps: None });
        from = *to;
    }
    for i in 1..stretches.len() {
        let slowness = stretches[i - 1].slowness[SAMPLES - 1].max(stretches[i].slowness[0]);
        let (before, after) = &beside[i];
        let jump = |k: usize, row: usize| (after[row][k] - before[row][k]).abs();
        let jumps = |k: usize, row: usize| {
            jump(k, row) > JUMP[k - 1] * problem.limits[row][k] * real::powi(slowness, k as i32 + 1)
        };
        let rows = problem.limits.len();
        if (0..rows).any(|row| jumps(1, row) || jumps(2, row)) {
            let second = (0..rows).map(|row| if jumps(1, row) { jump(1, row) } else { 0.0 });
            stretches[i].jumps = Some(second.collect());
        }
    }
    (!stretches.is_empty()).then_some(stretches)
}

/// The least time for a unit of reference time, were its rate constant: what speed, acceleration and jerk of every row ask for.
fn pointwise(rates: &[[f64; 3]], limits: &[[f64; 3]]) -> f64 {
    rates.iter().zip(limits).fold(0.0, |most: f64, (rates, limits)| {
        let [speed, acceleration, jerk] = [0, 1, 2].map(|k| rates[k].abs() / limits[k]);
        most.max(speed).max(acceleration.sqrt()).max(real::cbrt(jerk))
    })
}

/// The samples' slowness, raised so that neighbouring cells have similar lengths.
fn graded(stretches: &[Stretch], density: f64) -> Vec<f64> {
    let width: Vec<f64> = stretches.iter().map(|s| (s.to - s.from) / SAMPLES as f64).collect();
    let mut slowness: Vec<f64> = stretches.iter().flat_map(|s| s.slowness).collect();
    // A cell is 1 / (density slowness) long; that may change by GRADING per unit of length.
    let slope = GRADING * density;
    let mut pass = |order: &mut dyn Iterator<Item = usize>| {
        let mut length = f64::INFINITY;
        let mut last = 0;
        for i in order {
            length += slope * 0.5 * (width[last / SAMPLES] + width[i / SAMPLES]);
            length = length.min(1.0 / slowness[i]);
            slowness[i] = 1.0 / length;
            last = i;
        }
    };
    let count = SAMPLES * stretches.len();
    pass(&mut (0..count));
    pass(&mut (0..count).rev());
    slowness
}

#[cfg(test)]
mod tests;
