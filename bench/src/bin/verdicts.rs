//! Adversarial least-distance problems by the hundred thousand: what the runtime's solver says of them, against the truth.
//!
//!     cargo run --release -p bench --bin verdicts              # 100 000 problems
//!     cargo run --release -p bench --bin verdicts -- 1000000   # more

use std::process::ExitCode;

use dpc_tests::adversarial::{Kind, Verdicts, examine};

/// Problems per part: parts run side by side.
const PART: usize = 500;

fn main() -> ExitCode {
    let count = std::env::args().nth(1).and_then(|count| count.parse().ok()).unwrap_or(100_000);
    let parts = (count as usize).div_ceil(PART * Kind::ALL.len());
    let mut wrong = 0;
    for (number, kind) in Kind::ALL.into_iter().enumerate() {
        let verdicts = all(kind, number as u64, parts);
        println!("{:<17}{verdicts}", format!("{kind:?}"));
        verdicts.wrong.iter().take(3).for_each(|problem| eprintln!("{problem}"));
        // Who gives up, or is not asked, is not right.
        let asked = parts * PART;
        wrong += verdicts.wrong.len() + verdicts.undecided + verdicts.unknown + (asked - verdicts.problems);
    }
    if wrong == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn all(kind: Kind, number: u64, parts: usize) -> Verdicts {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let share = |thread: usize| {
        let mut sum = Verdicts::default();
        (thread..parts)
            .step_by(threads)
            .for_each(|part| sum.add(examine(kind, 1000 * (number + 1) + part as u64, PART)));
        sum
    };
    let mut sum = Verdicts::default();
    std::thread::scope(|scope| {
        let running: Vec<_> = (0..threads).map(|thread| scope.spawn(move || share(thread))).collect();
        running.into_iter().for_each(|thread| sum.add(thread.join().expect("no thread panics")));
    });
    sum
}
