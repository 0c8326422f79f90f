//! What came out, as text: the papers' tables with their own rows beside ours, times, failures.

use std::collections::BTreeMap;

use super::statistics::{Summary, mean, mean_metrics};
use super::text_table::{TextTable, fixed};
use super::{AlphaExcess, Judged, Suite};
use super::{arm_table, figure_tables, paper};
use crate::report::Metrics;

/// More different numbers of boxes than this are one row of Table III.
const MOST_ROWS: usize = 6;

/// The table of a suite; without one, Table III's figures for all scenes. `variants`: the same scenes
/// compiled as [`Suite::variants`] says.
pub fn render(suite: Option<Suite>, judged: &[Judged], variants: &[Vec<Judged>]) -> String {
    match suite {
        Some(Suite::Table1) => table1(judged),
        Some(Suite::Table2) => table2(judged, variants),
        Some(Suite::Fig5) => figure_tables::fig5(judged, variants),
        Some(Suite::Fig6) => figure_tables::fig6(judged),
        Some(Suite::Arm) => arm_table::render(judged),
        Some(Suite::Table3) | None => table3(judged, suite.is_some()),
    }
}

pub(super) fn certified(judged: &[Judged]) -> impl Iterator<Item = &Judged> {
    judged.iter().filter(|j| j.certified)
}

/// Means of metrics, in Table I's order.
fn means(metrics: impl Iterator<Item = Metrics>) -> [f64; 6] {
    let m = mean_metrics(metrics);
    [
        m.mean_jerk_mps3,
        m.mean_acceleration_mps2,
        m.mean_angular_acceleration_rads2,
        m.length_m,
        m.time_s,
        m.mean_joint_jerk_rads3,
    ]
}

pub(super) fn computation(judged: &[Judged]) -> Summary {
    Summary::of(judged.iter().filter_map(Judged::computation_ms))
}

fn success(judged: &[Judged]) -> f64 {
    100.0 * certified(judged).count() as f64 / judged.len().max(1) as f64
}

fn table1(judged: &[Judged]) -> String {
    let head = ["", "M_j m/s³", "M_a m/s²", "M_α rad/s²", "length m", "time s", "M_mj rad/s³", "success %", "CT ms"];
    let mut table = TextTable::new(format!("Table I, {} scenes (CT: mean of search + optimise)", judged.len()), &head);
    let three = |values: [f64; 6]| values.map(|v| fixed(v, 3)).to_vec();
    let with = |values: [f64; 6], success: f64, ct: f64| {
        let mut cells = three(values);
        cells.extend([fixed(success, 1), fixed(ct, 1)]);
        cells
    };
    let change = |from: [f64; 6], to: [f64; 6]| {
        std::array::from_fn::<_, 6, _>(|i| 100.0 * (to[i] / from[i] - 1.0)).map(percent).to_vec()
    };
    let initial = means(certified(judged).filter_map(|j| j.initial));
    let planned = means(certified(judged).filter_map(|j| j.planned));
    let driven = means(certified(judged).filter_map(|j| j.driven));
    let (paper_success, paper_ct) = paper::TABLE1_SUCCESS;
    table.row("paper, initial", three(paper::TABLE1_INITIAL));
    table.row("paper, optimised", with(paper::TABLE1_OPTIMISED, paper_success, paper_ct));
    table.row("paper, change", change(paper::TABLE1_INITIAL, paper::TABLE1_OPTIMISED));
    table.row("ours, initial", three(initial));
    table.row("ours, optimised", with(planned, success(judged), computation(judged).mean));
    table.row("ours, change", change(initial, planned));
    table.row("ours, as commanded", three(driven));
    table.render()
}

fn percent(change: f64) -> String {
    if change.is_finite() { format!("{change:+.0} %") } else { "-".into() }
}

fn table2(judged: &[Judged], variants: &[Vec<Judged>]) -> String {
    let head = ["α over its limit, % of trajectories", "n", "> 1 %", "< 10 %", "< 25 %", "> 25 %", "PT %", "CT ms"];
    let title = format!("Table II, {} scenes (DS: dense sampling; CT: mean of search + optimise)", judged.len());
    let mut table = TextTable::new(title, &head);
    for (name, row) in [("paper, without DS", &paper::TABLE2_WITHOUT), ("paper, with DS", &paper::TABLE2_WITH)] {
        let mut cells = vec![fixed(paper::TABLE2_COUNT, 0), "-".into()];
        cells.extend(row.counts.map(|n| fixed(100.0 * n / paper::TABLE2_COUNT, 1)));
        cells.extend([fixed(row.time_above, 2), fixed(row.computation, 1)]);
        table.row(name, cells);
    }
    type Excess = fn(&Judged) -> Option<AlphaExcess>;
    let kinds: [(&str, Excess); 2] = [("optimised", |j| j.alpha_planned), ("as commanded", |j| j.alpha_driven)];
    for (name, of) in kinds {
        let rows = ["flat, without DS", "flat, with DS"].into_iter().zip(variants.iter().map(Vec::as_slice));
        for (how, judged) in rows.chain([("arc length", judged)]) {
            let all: Vec<AlphaExcess> = certified(judged).filter_map(of).collect();
            let row = ExcessRow::of(&all);
            let mut cells = vec![all.len().to_string()];
            cells.extend([row.above_1, row.below_10, row.below_25, row.above_25].map(|v| fixed(v, 1)));
            cells.extend([fixed(row.time_above, 2), fixed(computation(judged).mean, 1)]);
            table.row(format!("ours, {name}, {how}"), cells);
        }
    }
    table.render()
}

/// Shares of trajectories in %, by how much alpha exceeds its limit.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ExcessRow {
    /// By more than 1 %.
    pub above_1: f64,
    /// By less than 10 %, or not at all.
    pub below_10: f64,
    /// By less than 25 %, or not at all.
    pub below_25: f64,
    /// By 25 % or more.
    pub above_25: f64,
    /// Mean share of the time above the limit, %.
    pub time_above: f64,
}

impl ExcessRow {
    /// Of a list of trajectories.
    pub fn of(all: &[AlphaExcess]) -> Self {
        let share = |test: fn(f64) -> bool| mean(all.iter().map(|e| if test(e.peak) { 100.0 } else { 0.0 }));
        Self {
            above_1: share(|p| p > 1.01),
            below_10: share(|p| p < 1.10),
            below_25: share(|p| p < 1.25),
            above_25: share(|p| p >= 1.25),
            time_above: mean(all.iter().map(|e| 100.0 * e.share)),
        }
    }
}

/// Scenes by their number of boxes, ascending; all together (`None`) where there are too many numbers.
pub(super) fn by_boxes(judged: &[Judged]) -> Vec<(Option<usize>, Vec<&Judged>)> {
    let mut groups: BTreeMap<usize, Vec<&Judged>> = BTreeMap::new();
    judged.iter().for_each(|j| groups.entry(j.boxes).or_default().push(j));
    if groups.len() > MOST_ROWS {
        return vec![(None, judged.iter().collect())];
    }
    groups.into_iter().map(|(boxes, group)| (Some(boxes), group)).collect()
}

fn table3(judged: &[Judged], beside_paper: bool) -> String {
    let head =
        ["boxes, planner", "M_j m/s³", "M_α rad/s²", "CT ms", "length m", "time s", "s/m", "bound s/m", "success"];
    let title = if beside_paper { "Table III" } else { "Scenes" };
    let title = format!("{title}, {} scenes (CT: median of search + optimise; ours: as commanded)", judged.len());
    let mut table = TextTable::new(title, &head);
    for (boxes, group) in by_boxes(judged) {
        for row in paper::TABLE3.iter().filter(|r| beside_paper && Some(r.boxes) == boxes) {
            let range = |[low, high]: [f64; 2]| {
                if low == high { fixed(low, 3) } else { format!("{low:.2}-{high:.2}") }
            };
            let (length, time) = row.length_time.unwrap_or((f64::NAN, f64::NAN));
            let mut cells = vec![range(row.jerk), range(row.alpha), fixed(row.computation, 1)];
            cells.extend([fixed(length, 3), fixed(time, 3), fixed(row.pace, 3)]);
            table.row(format!("{} {}", row.boxes, row.planner), cells);
        }
        let owned: Vec<Judged> = group.into_iter().cloned().collect();
        let row = Row3::of(&owned);
        let name = boxes.map_or("all".to_owned(), |n| n.to_string());
        let mut cells = vec![fixed(row.mean_jerk_mps3, 3), fixed(row.mean_angular_acceleration_rads2, 3)];
        cells.extend([fixed(row.computation_ms, 1), fixed(row.length_m, 3), fixed(row.time_s, 3)]);
        cells.extend([fixed(row.pace_s_per_m, 3), fixed(row.bound_s_per_m, 3)]);
        cells.push(format!("{}/{}", row.certified, row.count));
        table.row(format!("{name} trajc"), cells);
    }
    table.render()
}

/// A row of Table III, of held commands.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Row3 {
    /// Scenes.
    pub count: usize,
    /// Of them certified.
    pub certified: usize,
    /// Mean over scenes.
    pub mean_jerk_mps3: f64,
    /// Mean over scenes.
    pub mean_angular_acceleration_rads2: f64,
    /// Median of search and optimisation.
    pub computation_ms: f64,
    /// Mean.
    pub length_m: f64,
    /// Mean.
    pub time_s: f64,
    /// Mean time over mean length.
    pub pace_s_per_m: f64,
    /// The same for the bound without obstacles and jerk limit, along the straight line.
    pub bound_s_per_m: f64,
}

impl Row3 {
    /// Of these scenes; motion of the certified ones.
    pub fn of(judged: &[Judged]) -> Self {
        let [jerk, _, alpha, length, time, _] = means(certified(judged).filter_map(|j| j.driven));
        let bound = |part: fn(&Judged) -> f64| certified(judged).map(part).sum::<f64>();
        Self {
            count: judged.len(),
            certified: certified(judged).count(),
            mean_jerk_mps3: jerk,
            mean_angular_acceleration_rads2: alpha,
            computation_ms: computation(judged).median,
            length_m: length,
            time_s: time,
            pace_s_per_m: time / length,
            bound_s_per_m: bound(|j| j.bound.1) / bound(|j| j.bound.0),
        }
    }
}

/// Counts, times, fall-backs and failures: what every suite ends with.
pub fn render_totals(judged: &[Judged]) -> String {
    let fallbacks: Vec<&str> = certified(judged).filter(|j| j.fell_back()).map(|j| j.id.as_str()).collect();
    let count = certified(judged).count();
    let mut text = format!(
        "{count} of {} certified ({} %), {} of them by the search's own path\n",
        judged.len(),
        fixed(success(judged), 1),
        fallbacks.len()
    );
    let ms = |name: &str, summary: Summary| {
        format!("{name}: median {} ms, 99th percentile {} ms\n", fixed(summary.median, 1), fixed(summary.p99, 1))
    };
    text += &ms("search + optimise", computation(judged));
    text += &ms("certify", Summary::of(judged.iter().filter_map(|j| j.ms("certify"))));
    if !fallbacks.is_empty() {
        text += &format!("by the search's own path: {}\n", fallbacks.join(", "));
    }
    for failed in judged.iter().filter(|j| !j.certified) {
        let (stage, reason) =
            failed.failure.as_ref().map_or(("", "no reason"), |f| (f.stage.as_str(), f.reason.as_str()));
        text += &format!("failed: {} ({stage}): {reason}\n", failed.id);
    }
    text
}

/// Milliseconds a scene by stage, in order of the stages.
pub fn render_profile(judged: &[Judged]) -> String {
    let mut table = TextTable::new("ms a scene by stage", &["", "mean", "median", "99th", "max", "scenes"]);
    for (stage, summary, count) in profile(judged) {
        let mut cells = [summary.mean, summary.median, summary.p99, summary.max].map(|v| fixed(v, 2)).to_vec();
        cells.push(count.to_string());
        table.row(stage, cells);
    }
    table.render()
}

/// Stages in the order in which they first ran, with their times and in how many scenes they ran.
pub(super) fn profile(judged: &[Judged]) -> Vec<(&'static str, Summary, usize)> {
    let mut stages: Vec<(&'static str, Vec<f64>)> = Vec::new();
    for (stage, ms) in judged.iter().flat_map(|j| &j.timings) {
        match stages.iter_mut().find(|(known, _)| known == stage) {
            Some((_, all)) => all.push(*ms),
            None => stages.push((stage, vec![*ms])),
        }
    }
    stages.into_iter().map(|(stage, all)| (stage, Summary::of(all.iter().copied()), all.len())).collect()
}

#[cfg(test)]
mod tests;
