//! No bytes make a reader panic, take memory that it was not allowed, or hang.
//!
//! Valid files of every kind are damaged (`fuzz_inputs/mutate.rs`), each reader reads them, and what it says is rendered.
//! `cargo test` tries a few hundred a reader; `TRAJC_FUZZ=N cargo test --release --test fuzz_inputs -- --nocapture` tries N of each and also
//! refuses a reader that takes more than a second. `TRAJC_FUZZ_SEED` begins elsewhere. What fails is kept in `target/tmp/fuzz_inputs`.

#[path = "fuzz_inputs/mutate.rs"]
mod mutate;
#[path = "fuzz_inputs/readers.rs"]
mod readers;

use std::cell::RefCell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::LazyLock;
use std::time::{Duration, Instant};

use readers::{Reader, readers};
use trajc::memory;

/// What readers may take for one thing; some hold two of them, or a list that is growing.
const CAP: u64 = 16 << 20;
const PEAK: u64 = 6 * CAP;
/// Longest input.
const LONGEST: usize = 64 << 10;
/// Inputs of each reader in `cargo test`.
const FEW: u64 = 300;
const SLOW: Duration = Duration::from_secs(1);

thread_local! {
    static PANIC: RefCell<String> = const { RefCell::new(String::new()) };
}

/// Why an input must not have been read so.
fn fault(reader: &Reader, bytes: &[u8], in_time: bool) -> Option<String> {
    let mut result = Ok(());
    let started = now();
    let asked = allocation_counter::measure(|| result = catch_unwind(AssertUnwindSafe(|| (reader.read)(bytes))));
    let taken = now().saturating_sub(started);
    if result.is_err() {
        return Some(PANIC.with_borrow(Clone::clone));
    }
    if asked.bytes_max > PEAK {
        return Some(format!("took {} MiB", asked.bytes_max >> 20));
    }
    (in_time && taken > SLOW).then(|| format!("took {:.1} s", taken.as_secs_f64()))
}

/// Processor time of this thread, where the system tells: others may keep the processor busy. Else time.
fn now() -> Duration {
    static BEGUN: LazyLock<Instant> = LazyLock::new(Instant::now);
    let stat = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let spent = stat.and_then(|text| text.split(' ').next()?.parse().ok()).map(Duration::from_nanos);
    spent.unwrap_or_else(|| BEGUN.elapsed())
}

/// The undamaged files, a folder a reader, as cargo-fuzz wants them.
fn write_corpus(corpus: &Path) -> std::io::Result<()> {
    for reader in readers() {
        let folder = corpus.join(reader.name.replace('.', "_"));
        std::fs::create_dir_all(&folder)?;
        for (n, seed) in reader.seeds.iter().enumerate() {
            std::fs::write(folder.join(n.to_string()), seed)?;
        }
    }
    Ok(())
}

fn number(variable: &str) -> Option<u64> {
    std::env::var(variable).ok()?.parse().ok()
}

#[test]
fn no_bytes_make_a_reader_panic_hang_or_take_memory_it_may_not() {
    memory::set(CAP, memory::Source::Asked);
    std::panic::set_hook(Box::new(|info| PANIC.with_borrow_mut(|text| *text = info.to_string())));
    let (asked, seed) = (number("TRAJC_FUZZ"), number("TRAJC_FUZZ_SEED").unwrap_or(1));
    let only = std::env::var("TRAJC_FUZZ_READER").ok();
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fuzz_inputs");
    if let Some(corpus) = std::env::var_os("TRAJC_FUZZ_CORPUS") {
        write_corpus(Path::new(&corpus)).expect("room");
    }
    let mut faults: Vec<String> = Vec::new();
    for reader in readers() {
        if only.as_ref().is_some_and(|only| only != reader.name) {
            continue;
        }
        for seed in &reader.seeds {
            if let Some(fault) = fault(&reader, seed, false) {
                faults.push(format!("{}, undamaged: {fault}", reader.name));
            }
        }
        let started = Instant::now();
        let mut chance = mutate::Chance(seed);
        let mut kept = Vec::new();
        for n in 0..asked.unwrap_or(FEW) {
            let [own, other] = [0; 2].map(|_| chance.below(reader.seeds.len()));
            let bytes = mutate::mutated(&reader.seeds[own], &reader.seeds[other], LONGEST, &mut chance);
            let Some(fault) = fault(&reader, &bytes, asked.is_some()) else { continue };
            // One of each kind.
            if kept.len() < 10 && !kept.contains(&fault) {
                let file = folder.join(format!("{}-{n}", reader.name));
                std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(&file, &bytes)).expect("room");
                faults.push(format!("{}: {fault}; {}", reader.name, file.display()));
                kept.push(fault);
            }
        }
        if asked.is_some() {
            println!("{:16} {:>9} inputs, {:.1} s", reader.name, asked.unwrap_or(FEW), started.elapsed().as_secs_f64());
        }
    }
    let _ = std::panic::take_hook();
    assert!(faults.is_empty(), "{} faults:\n{}", faults.len(), faults.join("\n"));
}
