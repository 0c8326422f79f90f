//! Open and closed loop of compiled files on a simulated base with wrong wheels, wrong track, latency and noisy poses: the figures of
//! docs/playback.md.
//!
//! `cargo run --release --example closed_loop out/*/commands.csv`

#[path = "../tests/feedback/simulated.rs"]
#[allow(dead_code)]
mod simulated;

use simulated::{closed, disturbances, open, prepare};
use trajc::play::tracking::Options;

/// Runs of each disturbance.
const SEEDS: u64 = 5;

fn main() {
    println!("end error in mm and degrees, most across the path in mm: open | closed, the worst of {SEEDS} runs");
    for path in std::env::args().skip(1) {
        let prepared = prepare(path.as_ref());
        println!("{path}");
        for (name, fault) in disturbances() {
            let free = open(&prepared, fault);
            let runs: Vec<_> =
                (0..SEEDS).map(|seed| closed(&prepared, fault, Options::default(), 0.05, seed)).collect();
            let worst = |of: &dyn Fn(&simulated::Run) -> f64| runs.iter().map(of).fold(0.0, f64::max);
            println!(
                "  {name:<28} {:7.1} {:6.2} {:7.1} | {:5.1} {:5.2} {:6.1}  tube {:4.2}  {:5.1} s for {:5.1} s  {:?}",
                free.end.0 * 1e3,
                free.end.1.to_degrees(),
                free.most.0 * 1e3,
                worst(&|r| r.end.0) * 1e3,
                worst(&|r| r.end.1).to_degrees(),
                worst(&|r| r.most.0) * 1e3,
                worst(&|r| r.filled),
                worst(&|r| r.time),
                prepared.motion.table().duration(),
                runs.iter()
                    .map(|r| r.phase)
                    .find(|p| *p != trajc::play::tracking::Phase::Done)
                    .unwrap_or(runs[0].phase),
            );
        }
    }
}
