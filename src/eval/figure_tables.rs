//! Fig. 5 and 6 in figures, beside what the paper says of them.

use super::text_table::{TextTable, fixed};
use super::{Judged, Turns, paper};

/// Fig. 5's scene; `variants`: every turn part of one smooth curve, without and with dense sampling.
pub(super) fn fig5(judged: &[Judged], variants: &[Vec<Judged>]) -> String {
    let head = [
        "",
        "least radius mm",
        "turns on the spot",
        "α peak %",
        "α above %",
        "clearance cm",
        "CT ms",
        "time s",
        "length m",
    ];
    let title = "Fig. 5, one dense room (DS: dense sampling; CT: search + optimise; one curve: no turn on the spot, as in the paper)";
    let mut table = TextTable::new(title, &head);
    table.row("paper", [fixed(1e3 * paper::FIG5_LEAST_RADIUS, 1)]);
    let least = judged.first().map_or(f64::NAN, |j| j.least_radius);
    table.row("limits allow a curve", [fixed(1e3 * least, 1)]);
    let names = ["ours, one curve, without DS", "ours, one curve, with DS", "ours, as usual"];
    for (name, judged) in names.into_iter().zip(variants.iter().map(Vec::as_slice).chain([judged])) {
        for j in judged {
            if !j.certified {
                table.row(name, ["failed".to_owned()]);
                continue;
            }
            let turns = j.turns;
            let alpha = |of: fn(super::AlphaExcess) -> f64| fixed(j.alpha_planned.map_or(f64::NAN, of), 1);
            let metres = |of: fn(&crate::report::Metrics) -> f64| j.driven.as_ref().map_or(f64::NAN, of);
            table.row(
                name,
                [
                    radius(turns),
                    turns.map_or("-".into(), |t| t.on_the_spot.to_string()),
                    alpha(|a| 100.0 * a.peak),
                    alpha(|a| 100.0 * a.share),
                    fixed(100.0 * j.clearance_proven.unwrap_or(f64::NAN), 1),
                    fixed(j.computation_ms().unwrap_or(f64::NAN), 1),
                    fixed(metres(|m| m.time_s), 1),
                    fixed(metres(|m| m.length_m), 2),
                ],
            );
        }
    }
    table.render()
        + "  least radius: while driving, over any turn of 10 degrees; α: of the optimised curves against its limit, clearance: proven\n"
}

fn radius(turns: Option<Turns>) -> String {
    fixed(turns.and_then(|t| t.least_driven_m).map_or(f64::NAN, |r| 1e3 * r), 1)
}

/// Fig. 6's scene: how far each joint goes, and every actuator's peaks against its limits.
pub(super) fn fig6(judged: &[Judged]) -> String {
    let mut text = String::new();
    for j in judged.iter().filter(|j| j.certified) {
        let head = ["as commanded", "from", "to", "speed", "limit", "acceleration", "limit", "jerk", "limit"];
        let title = "Fig. 6, two arch bridges (the paper gives a picture, no figures; m and rad)";
        let mut table = TextTable::new(title, &head);
        let mut actuators: Vec<&str> = j.limits.iter().map(|l| l.actuator.as_str()).collect();
        actuators.dedup();
        for actuator in actuators {
            let range = j.joint_ranges.iter().find(|(name, _)| name == actuator).map(|(_, range)| *range);
            let mut cells = range.map_or(["-".to_owned(), "-".to_owned()], |r| r.map(|v| fixed(v, 3))).to_vec();
            for quantity in ["speed", "acceleration", "jerk"] {
                let row = j.limits.iter().find(|l| l.actuator == actuator && l.quantity == quantity);
                let number = |v: Option<f64>| fixed(v.unwrap_or(f64::NAN), 3);
                cells.extend([number(row.and_then(|l| l.peak)), number(row.and_then(|l| l.limit))]);
            }
            table.row(actuator, cells);
        }
        text += &table.render();
        let metres = j.driven.unwrap_or_default();
        text += &format!(
            "  {:.2} m in {:.1} s, clearance proven {:.1} cm, search + optimise {:.1} ms\n",
            metres.length_m,
            metres.time_s,
            100.0 * j.clearance_proven.unwrap_or(0.0),
            j.computation_ms().unwrap_or(0.0)
        );
    }
    text
}
