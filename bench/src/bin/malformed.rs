//! `cargo run --release -p bench --bin malformed -- 5000 7`: a long campaign of files that are nearly networks, 5000 from the seed
//! 7. A file that makes the compiler panic, takes more than ten seconds, or is refused without a place in it, is written to
//! `target/malformed/` and makes the command fail.
//!
//! With a program as the third argument, every tenth file goes through that too, as the command line does it: what it leaves on
//! the disk is checked.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use dpc_tests::mutations::{Mutant, Mutations, extremes};
use dpc_tests::networks;
use dpc_tests::refusal::{Outcome, Tally, outcome};

/// No file may take longer.
const LIMIT: Duration = Duration::from_secs(10);

fn main() -> ExitCode {
    let mut arguments = std::env::args().skip(1);
    let mut number = |default: u64| arguments.next().and_then(|word| word.parse().ok()).unwrap_or(default);
    let (count, seed) = (number(1000), number(1));
    let program = arguments.next().map(PathBuf::from);
    // Panics are counted, not printed.
    std::panic::set_hook(Box::new(|_| {}));
    let texts: Vec<String> = networks().into_iter().map(|source| source.text).collect();
    let mut mutants = extremes(&texts[0]);
    let mut mutations = Mutations::new(seed, texts);
    mutants.extend((0..count).map(|_| mutations.draw()));
    let (inside, outside) = campaign(mutants, program.as_deref());
    println!("in process: {inside}");
    if program.is_some() {
        println!("as a program: {outside}");
    }
    let failed: Vec<&String> = inside.failed.iter().chain(&outside.failed).collect();
    failed.iter().for_each(|why| println!("FAILED {why}"));
    if failed.is_empty() { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

fn campaign(mutants: Vec<Mutant>, program: Option<&Path>) -> (Tally, Tally) {
    let (mut inside, mut outside) = (Tally::default(), Tally::default());
    for (k, mutant) in mutants.into_iter().enumerate() {
        let what = format!("file {k} ({})", mutant.kind);
        let before = inside.failed.len() + outside.failed.len();
        let (outcome, time) = watched(mutant.clone());
        inside.took(&what, time);
        inside.add(what.clone(), outcome);
        if let Some(program) = program.filter(|_| k % 10 == 0) {
            let start = Instant::now();
            outside.add(what.clone(), run(program, &mutant));
            outside.took(&what, start.elapsed());
        }
        if inside.failed.len() + outside.failed.len() > before {
            keep(k, &mutant);
        }
    }
    (inside, outside)
}

/// In a thread of its own, which is left behind where it takes too long.
fn watched(mutant: Mutant) -> (Outcome, Duration) {
    let (send, receive) = mpsc::channel();
    let start = Instant::now();
    thread::spawn(move || send.send(outcome(&mutant)));
    let outcome = receive.recv_timeout(LIMIT);
    (outcome.unwrap_or_else(|_| Outcome::Failed("takes too long, or overflows".to_owned())), start.elapsed())
}

fn keep(k: usize, mutant: &Mutant) {
    let folder = Path::new("target/malformed");
    let kept = fs::create_dir_all(folder).and_then(|()| fs::write(folder.join(format!("{k}.toml")), &mutant.bytes));
    if let Err(error) = kept {
        println!("file {k} could not be kept: {error}");
    }
}

/// The command line on the file, beside an empty place for its output.
fn run(program: &Path, mutant: &Mutant) -> Outcome {
    let folder = std::env::temp_dir().join(format!("malformed-{}", std::process::id()));
    let outcome = fs::create_dir_all(&folder)
        .and_then(|()| fs::write(folder.join("system.toml"), &mutant.bytes))
        .and_then(|()| ended(program, &folder))
        .map(|code| judged(code, &folder));
    // What remains is in the system's folder for it.
    let _ = fs::remove_dir_all(&folder);
    outcome.unwrap_or_else(|error| Outcome::Failed(error.to_string()))
}

/// The exit code; `None` where it was killed, or took too long.
fn ended(program: &Path, folder: &Path) -> std::io::Result<Option<i32>> {
    let mut command = Command::new(program);
    command.args(["system.toml", "--out", "out", "--quiet"]).current_dir(folder);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn()?;
    let start = Instant::now();
    while start.elapsed() < LIMIT {
        if let Some(status) = child.try_wait()? {
            return Ok(status.code());
        }
        thread::sleep(Duration::from_millis(2));
    }
    child.kill()?;
    child.wait().map(|_| None)
}

fn judged(code: Option<i32>, folder: &Path) -> Outcome {
    let written = folder.join("out");
    match code {
        Some(0) if written.join("mod.rs").exists() => Outcome::Designed,
        Some(1) if !written.exists() => Outcome::Refused(Vec::new()),
        _ => Outcome::Failed(format!("ends with {code:?}; output is there: {}", written.exists())),
    }
}
