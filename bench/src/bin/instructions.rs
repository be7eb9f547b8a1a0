//! Instructions per step of emitted controllers, counted by valgrind: a figure that does not depend on what else runs on the
//! machine. What grows by more than a tenth ends with exit code 1; what has shrunk by as much is to be committed.
//!
//!     cargo run --release -p bench --bin instructions            # counts, and compares with instructions.txt
//!     cargo run --release -p bench --bin instructions -- --keep  # writes what was counted to instructions.txt
//!
//! Without valgrind it says so and counts nothing.

use std::hint::black_box;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

use dpc_generated::four_tank::{left, right};
use dpc_runtime::Control;

/// One of the power network's areas.
#[allow(unused, reason = "emitted code has more than is counted")]
mod area {
    include!(concat!(env!("OUT_DIR"), "/power_network/area_1.rs"));
}

/// A subsystem alone: 4 states, 2 inputs, 10 steps, so 24 unknowns.
#[allow(unused, reason = "emitted code has more than is counted")]
mod plant {
    include!(concat!(env!("OUT_DIR"), "/size_4_2_10/plant.rs"));
}

/// First argument of a process that is counted.
const RUN: &str = "--run";

/// Steps of the shorter run; the longer one has twice as many, and the difference is what these take.
const STEPS: usize = 2000;

/// More than this times what is committed is too much.
const TOLERANCE: f64 = 1.1;

/// The input alone, which starts anew every time it is asked for: at a state, or at the largest half, quarter, ... of it that is
/// admissible.
macro_rules! solve {
    (admissible $module:ident, $steps:expr, $x:expr) => {{
        let steady = $module::SteadyState { x: [0.0; $module::NX], u: [0.0; $module::NU] };
        let Ok((mut controller, _)) = $module::Controller::start(&$module::TABLES, &steady) else { return };
        let mut x = $x;
        while !controller.input(&x).control.is_admissible() {
            x = x.map(|x| 0.5 * x);
        }
        solve!($module, $steps, x)
    }};
    ($module:ident, $steps:expr, $x:expr) => {{
        let steady = $module::SteadyState { x: [0.0; $module::NX], u: [0.0; $module::NU] };
        let Ok((mut controller, _)) = $module::Controller::start(&$module::TABLES, &steady) else { return };
        assert!(controller.input(&$x).control != Control::AtReference, "nothing is solved");
        (0..$steps).for_each(|_| {
            black_box(controller.input(black_box(&$x)));
        });
    }};
}

/// What is counted: a step of both controllers of the four-tank at rest, and the input of `left` where e is outside the tube and
/// far outside; then the same of the other two.
const SCENARIOS: [Scenario; 8] = [
    ("rest", rest),
    ("upset", |steps| solve!(left, steps, [6.0, 0.0])),
    ("large-upset", |steps| solve!(left, steps, [14.0, 0.0])),
    ("area-rest", area_rest),
    ("area-upset", |steps| solve!(admissible area, steps, [0.1, 0.0, 0.0, 0.0])),
    ("plant-rest", plant_rest),
    ("plant-upset", |steps| solve!(admissible plant, steps, [1.0, 1.0, -1.0, 1.0])),
    ("plant-large-upset", |steps| solve!(admissible plant, steps, [8.0, 8.0, 0.0, 0.0])),
];

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
    let (mut grown, mut shrunk) = (false, false);
    for ((name, _), count) in SCENARIOS.iter().zip(counted) {
        let line =
            known.lines().find_map(|line| line.strip_prefix(name)?.strip_prefix(' ')?.trim().parse::<f64>().ok());
        let before = line.unwrap_or(f64::NAN);
        println!("{name:<18}{count:>8.0} instructions per step, {before:.0} committed");
        // A count that failed is none.
        grown |= before.is_nan() || count.is_nan() || *count > TOLERANCE * before;
        shrunk |= TOLERANCE * *count < before;
    }
    if shrunk {
        println!("less than what is committed: keep it with cargo run --release -p bench --bin instructions -- --keep");
    }
    if grown {
        println!("more than what is committed");
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
        if !output.status.success() {
            eprintln!("{text}");
            return Some(f64::NAN);
        }
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

fn area_rest(steps: usize) {
    let steady = area::SteadyState { x: [0.0; area::NX], u: [0.0; area::NU] };
    let Ok((mut controller, mut loads, _)) = area::start(&steady, &[0.0; area::ND]) else { return };
    let mut inbox = area::Inbox::new();
    (0..steps).for_each(|_| {
        let load = loads.admit(black_box(&[0.0; area::ND]));
        black_box(controller.step_under(black_box(&steady.x), black_box(&[0.0]), &load, &mut inbox));
    });
}

fn plant_rest(steps: usize) {
    let steady = plant::SteadyState { x: [0.0; plant::NX], u: [0.0; plant::NU] };
    let Ok((mut controller, _)) = plant::start(&steady) else { return };
    let mut inbox = plant::Inbox::new();
    (0..steps).for_each(|_| {
        black_box(controller.step(black_box(&steady.x), black_box(&[0.0; plant::NY]), &mut inbox));
    });
}
