//! What came out, as JSON: `{"scenes": […], "totals": {…}}`.

use serde::Serialize;
use serde_json::{Map, Value, json};

use super::statistics::{Summary, mean_metrics};
use super::tables::{self, ExcessRow, Row3};
use super::{AlphaExcess, ArmRow, Judged, SceneSet, Suite};
use crate::report::Metrics;

/// The metrics that a suite's table shows of a scene: Table I the optimised trajectory, Tables II and III the held
/// commands. Sets without a table: held commands. `None`: not certified.
pub fn metrics(suite: Option<Suite>, judged: &Judged) -> Option<Metrics> {
    let shown = if suite == Some(Suite::Table1) { judged.planned } else { judged.driven };
    shown.filter(|_| judged.certified)
}

/// The document. `variants`: the same scenes compiled as [`Suite::variants`] says.
pub fn document(set: &SceneSet, suite: Option<Suite>, judged: &[Judged], variants: &[Vec<Judged>]) -> String {
    let scenes: Vec<Value> = judged.iter().map(|j| scene(suite, j)).collect();
    format!("{:#}\n", json!({"scenes": scenes, "totals": totals(set, suite, judged, variants)}))
}

fn scene(suite: Option<Suite>, judged: &Judged) -> Value {
    let mut scene = json!({
        "id": judged.id,
        "kind": judged.kind,
        "status": if judged.certified { "certified" } else { "failed" },
        "search_ms": judged.ms("search"),
        "optimize_ms": judged.ms("optimize"),
        "retime_ms": judged.ms("retime"),
        "certify_ms": judged.ms("certify"),
        "metrics": metrics(suite, judged),
        "clearance_proven_m": judged.clearance_proven,
        "boxes": judged.boxes,
        "source": judged.source,
        "esdf_ms": judged.ms("esdf"),
        "expanded": judged.expanded,
        "iterations": judged.iterations,
        "ending": judged.ending,
        "drives": judged.legs.map(|l| l[0]),
        "spins": judged.legs.map(|l| l[1]),
        "initial": judged.initial,
        "planned": judged.planned,
        "driven": judged.driven,
        "bound_s": judged.bound.1,
        "turns": judged.turns,
        "lowest_m": judged.lowest,
    });
    if let (Some(failure), Value::Object(map)) = (&judged.failure, &mut scene) {
        map.insert("failure".into(), value(failure));
    }
    scene
}

/// Our own structs hold no maps with other keys than text.
fn value(of: &impl Serialize) -> Value {
    serde_json::to_value(of).expect("plain structs")
}

fn totals(set: &SceneSet, suite: Option<Suite>, judged: &[Judged], variants: &[Vec<Judged>]) -> Value {
    let certified = judged.iter().filter(|j| j.certified).count();
    let summary = |of: fn(&Judged) -> Option<f64>| value(&Summary::of(judged.iter().filter_map(of)));
    let shown = judged.iter().filter_map(|j| metrics(suite, j));
    let initial = judged.iter().filter(|j| j.certified).filter_map(|j| j.initial);
    let rows = tables::by_boxes(judged).into_iter().map(|(boxes, group)| {
        let owned: Vec<Judged> = group.into_iter().cloned().collect();
        let mut row = value(&Row3::of(&owned));
        row["boxes"] = json!(boxes);
        row
    });
    let profile: Map<String, Value> =
        tables::profile(judged).into_iter().map(|(stage, ms, _)| (stage.to_owned(), value(&ms))).collect();
    let mut totals = json!({
        "name": set.name,
        "count": judged.len(),
        "certified": certified,
        "failed": judged.len() - certified,
        "fallbacks": judged.iter().filter(|j| j.certified && j.fell_back()).count(),
        "success_percent": 100.0 * certified as f64 / judged.len().max(1) as f64,
        "search_optimize_ms": summary(Judged::computation_ms),
        "certify_ms": summary(|j| j.ms("certify")),
        "initial": value(&mean_metrics(initial)),
        "metrics": value(&mean_metrics(shown)),
        "by_boxes": rows.collect::<Vec<_>>(),
        "profile_ms": profile,
    });
    if let (Some(Suite::Table2), [sparse, dense]) = (suite, variants) {
        let excess = |judged: &[Judged], of: fn(&Judged) -> Option<AlphaExcess>| {
            let all: Vec<AlphaExcess> = judged.iter().filter(|j| j.certified).filter_map(of).collect();
            value(&ExcessRow::of(&all))
        };
        let rows = |judged: &[Judged]| {
            json!({
                "optimised": excess(judged, |j| j.alpha_planned),
                "commands": excess(judged, |j| j.alpha_driven),
                "computation_ms": Summary::of(judged.iter().filter_map(Judged::computation_ms)).mean,
            })
        };
        totals["alpha_excess_percent"] =
            json!({"arc_length": rows(judged), "flat_dense": rows(dense), "flat_sparse": rows(sparse)});
    }
    if suite == Some(Suite::Arm) {
        totals["by_kind"] = value(&ArmRow::by_kind(judged));
    }
    if let (Some(Suite::Fig5), [sparse, dense]) = (suite, variants) {
        let scenes = |judged: &[Judged]| judged.iter().map(|j| scene(suite, j)).collect::<Vec<_>>();
        totals["one_curve"] = json!({"sparse": scenes(sparse), "dense": scenes(dense)});
    }
    totals
}
