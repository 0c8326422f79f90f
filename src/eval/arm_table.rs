//! The table of the suite `arm`: a row for each kind of room, beside TopAY's.

use std::collections::BTreeMap;

use super::Judged;
use super::paper::TOPAY;
use super::statistics::{Summary, mean};
use super::tables::{certified, computation};
use super::text_table::{TextTable, fixed};

/// What came out of one kind of room.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ArmRow {
    /// As `kind` of a scene.
    pub kind: String,
    /// Scenes.
    pub count: usize,
    /// Of them certified.
    pub certified: usize,
    /// The same, %.
    pub certified_percent: f64,
    /// Of them by the search's own path.
    pub fallbacks: usize,
    /// Search and optimisation, ms, of all scenes, failed ones too.
    pub search_optimize_ms: Summary,
    /// Mean over what was certified, as commanded, s.
    pub time_s: f64,
    /// The same, m.
    pub length_m: f64,
    /// The same of a time that no plan can beat, from start to goal without obstacles and arm, s.
    pub bound_s: f64,
    /// Of the certified ones, how many reach below the floor with a link that a joint moves: the floor is no obstacle of a scene.
    pub below_floor: usize,
    /// The lowest that such a link gets in any of them, m.
    pub lowest_m: Option<f64>,
    /// How many failed with each code, such as `search/exhausted`.
    pub failures: BTreeMap<String, usize>,
}

impl ArmRow {
    /// Of these scenes.
    fn of(kind: &str, judged: &[Judged]) -> Self {
        let driven = || certified(judged).filter_map(|j| j.driven);
        let count = certified(judged).count();
        let lowest = || certified(judged).filter_map(|j| j.lowest);
        let mut failures = BTreeMap::new();
        for failed in judged.iter().filter(|j| !j.certified) {
            let code = failed.failure.as_ref().map_or("unknown", |f| f.code.as_str());
            *failures.entry(code.to_owned()).or_default() += 1;
        }
        Self {
            kind: kind.to_owned(),
            count: judged.len(),
            certified: count,
            certified_percent: 100.0 * count as f64 / judged.len().max(1) as f64,
            fallbacks: certified(judged).filter(|j| j.fell_back()).count(),
            search_optimize_ms: computation(judged),
            time_s: mean(driven().map(|m| m.time_s)),
            length_m: mean(driven().map(|m| m.length_m)),
            bound_s: mean(certified(judged).map(|j| j.bound.1)),
            below_floor: lowest().filter(|low| *low < 0.0).count(),
            lowest_m: lowest().reduce(f64::min),
            failures,
        }
    }

    /// One for each kind, in order of the scenes; scenes without a kind are of the kind `all`.
    pub fn by_kind(judged: &[Judged]) -> Vec<Self> {
        let mut groups: Vec<(&str, Vec<Judged>)> = Vec::new();
        for scene in judged {
            let kind = scene.kind.as_deref().unwrap_or("all");
            match groups.iter_mut().find(|(known, _)| *known == kind) {
                Some((_, group)) => group.push(scene.clone()),
                None => groups.push((kind, vec![scene.clone()])),
            }
        }
        groups.iter().map(|(kind, group)| Self::of(kind, group)).collect()
    }
}

/// The table, and failures by their codes.
pub(super) fn render(judged: &[Judged]) -> String {
    let head = [
        "room, planner",
        "own test %",
        "collision-free %",
        "CT median ms",
        "CT p90 ms",
        "time s",
        "length m",
        "bound s",
    ];
    let title = format!(
        "Rooms for arms, {} scenes (CT: search + optimise, one thread; ours: of all scenes, failed ones too)",
        judged.len()
    );
    let mut table = TextTable::new(title, &head);
    let none = || fixed(f64::NAN, 0);
    let rows = ArmRow::by_kind(judged);
    for row in &rows {
        for paper in TOPAY.iter().filter(|paper| paper.kind == row.kind) {
            let [free, padded] = paper.free;
            let [median, p90] = paper.computation;
            let mut cells = vec![fixed(paper.claimed, 0), fixed(free, 0), fixed(median, 0), fixed(p90, 0)];
            cells.extend([fixed(paper.time, 1), none(), none()]);
            table.row(format!("{} TopAY, measured", row.kind), cells);
            table.row(format!("{} TopAY, obstacles padded by 3 cm", row.kind), [none(), fixed(padded, 0)]);
        }
        let ms = &row.search_optimize_ms;
        let mut cells = vec![none(), fixed(row.certified_percent, 1), fixed(ms.median, 0), fixed(ms.p90, 0)];
        cells.extend([fixed(row.time_s, 1), fixed(row.length_m, 2), fixed(row.bound_s, 1)]);
        table.row(format!("{} trajc, certified {}/{}", row.kind, row.certified, row.count), cells);
    }
    let mut text = table.render();
    text += "TopAY: 120 pairs a kind of its own benchmark and robot, measured by the project's owner; ours: rooms drawn after that benchmark,\n\
             with a way for the base alone that has half a cell's diagonal to spare, at the same limits.\n";
    for row in &rows {
        if let (1.., Some(lowest)) = (row.below_floor, row.lowest_m) {
            let reach = if row.below_floor == 1 { "reaches" } else { "reach" };
            text += &format!(
                "{}: {} of the certified {reach} below the floor, the lowest {:.2} m: it is no obstacle of a scene\n",
                row.kind, row.below_floor, -lowest
            );
        }
        for (code, count) in &row.failures {
            text += &format!("{}: {count} failed with {code}\n", row.kind);
        }
    }
    text
}
