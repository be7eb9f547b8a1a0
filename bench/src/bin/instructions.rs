//! Instructions per step of the four-tank's emitted controllers, counted by valgrind: a figure that does not depend on what else
//! runs on the machine.
//!
//!     cargo run --release -p bench --bin instructions            # counts, and compares with instructions.txt
//!     cargo run --release -p bench --bin instructions -- --keep  # writes what was counted to instructions.txt
//!
//! Without valgrind it says so and counts nothing.

use std::hint::black_box;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

use dpc_generated::four_tank::{left, right};

/// First argument of a process that is counted.
const RUN: &str = "--run";

/// Steps of the shorter run; the longer one has twice as many, and the difference is what these take.
const STEPS: usize = 2000;

/// More than this times what is committed is too much.
const TOLERANCE: f64 = 1.1;

/// What is counted: a step of both controllers at rest; the input of `left` where e is outside the tube, and far outside.
const SCENARIOS: [Scenario; 3] =
    [("rest", rest), ("upset", |steps| solve(steps, 6.0)), ("large-upset", |steps| solve(steps, 14.0))];

/// Its name, and what runs it for a number of steps.
type Scenario = (&'static str, fn(usize));

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if let [first, name, steps] = &arguments[..]
        && first == RUN
    {
        let scenario = SCENARIOS.iter().find(|(known, _)| known == name);
        scenario.zip(steps.parse().ok()).into_iter().for_each(|((_, run), steps)| run(steps));
        return ExitCode::SUCCESS;
    }
    let Some(counted) = SCENARIOS.iter().map(|(name, _)| per_step(name)).collect::<Option<Vec<f64>>>() else {
        println!("not counted: there is no valgrind");
        return ExitCode::SUCCESS;
    };
    if arguments.iter().any(|argument| argument == "--keep") {
        let lines: String =
            SCENARIOS.iter().zip(&counted).map(|((name, _), count)| format!("{name} {count:.0}\n")).collect();
        return if std::fs::write(file(), lines).is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE };
    }
    compare(&counted)
}

/// Prints both and says whether nothing has grown.
fn compare(counted: &[f64]) -> ExitCode {
    let known = std::fs::read_to_string(file()).unwrap_or_default();
    let mut grown = false;
    for ((name, _), count) in SCENARIOS.iter().zip(counted) {
        let line = known.lines().find_map(|line| line.strip_prefix(name)?.trim().parse::<f64>().ok());
        let before = line.unwrap_or(f64::NAN);
        println!("{name:<12}{count:>8.0} instructions per step, {before:.0} committed");
        grown |= before.is_nan() || *count > TOLERANCE * before;
    }
    if grown { ExitCode::FAILURE } else { ExitCode::SUCCESS }
}

fn file() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("instructions.txt")
}

fn per_step(name: &str) -> Option<f64> {
    let count = |steps: usize| -> Option<f64> {
        let program = std::env::current_exe().ok()?;
        let mut valgrind = Command::new("valgrind");
        valgrind.args(["--tool=callgrind", "--callgrind-out-file=/dev/null"]).arg(program);
        let output = valgrind.args([RUN, name, &steps.to_string()]).output().ok()?;
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        text.lines().find_map(|line| line.split_once("Collected : ")?.1.trim().parse().ok())
    };
    Some((count(2 * STEPS)? - count(STEPS)?) / STEPS as f64)
}

/// Both controllers, with each other's messages; half of it is a step of one.
fn rest(steps: usize) {
    let steady = left::SteadyState { x: [0.0; left::NX], u: [0.0; left::NU] };
    let started = left::start(&steady).ok().zip(right::start(&steady).ok());
    let Some(((mut left, mut from_left), (mut right, mut from_right))) = started else { return };
    let (mut to_left, mut to_right) = (left::Inbox::new(), right::Inbox::new());
    for _ in 0..steps.div_ceil(2) {
        let _ = black_box(to_left.accept(&left::FROM_RIGHT, &from_right));
        let _ = black_box(to_right.accept(&right::FROM_LEFT, &from_left));
        from_left = black_box(left.step(black_box(&[0.0, 0.0]), black_box(&[0.0]), &mut to_left)).message;
        from_right = black_box(right.step(black_box(&[0.0, 0.0]), black_box(&[0.0]), &mut to_right)).message;
    }
}

/// The input alone, which starts anew every time it is asked for.
fn solve(steps: usize, upset: f64) {
    let steady = left::SteadyState { x: [0.0; left::NX], u: [0.0; left::NU] };
    let Ok((mut controller, _)) = left::start(&steady) else { return };
    (0..steps).for_each(|_| {
        black_box(controller.input(black_box(&[upset, 0.0])));
    });
}
