//! How time and memory of a design grow with the network.
//!
//!     cargo run --release -p bench                    # 10, 100 and 1000 subsystems, a minute or two
//!     cargo run --release -p bench -- 10 30 100       # other sizes
//!     cargo run --release -p bench -- tanks chain     # another network: rooms, tanks or masses, grid or chain
//!     cargo run --release -p bench -- equal           # all subsystems equal: they share work
//!
//! Every size runs in a process of its own, so that the peak memory is that of its design. What is timed is what
//! `dpc-codegen` does with a file, but for writing to disk.

use std::process::{Command, ExitCode};

use dpc_codegen::clock::{Clock, peak_memory};
use dpc_codegen::design::Design;
use dpc_codegen::emit::Emitted;
use dpc_codegen::export::design_json;
use dpc_tests::large_network::{LargeNetwork, Plant, Shape};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let result = match arguments.split_first() {
        Some((first, rest)) if first == ONE => one(rest),
        _ => all(&arguments),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

/// First argument of a process that measures one size.
const ONE: &str = "--one";

/// Seconds by stage, and mebibytes.
struct Measured {
    count: f64,
    stages: Vec<(String, f64)>,
    peak: Option<f64>,
}

fn all(arguments: &[String]) -> Result<(), String> {
    let (sizes, words): (Vec<&String>, Vec<&String>) = arguments.iter().partition(|a| a.parse::<usize>().is_ok());
    network(&words, 10)?;
    let default: Vec<String> = ["10", "100", "1000"].map(str::to_owned).into();
    let sizes = if sizes.is_empty() { default.iter().collect() } else { sizes };
    let measured: Vec<Measured> = sizes.into_iter().map(|size| measured(size, &words)).collect::<Result<_, _>>()?;
    print!("{}", table(&measured));
    Ok(())
}

fn measured(size: &str, words: &[&String]) -> Result<Measured, String> {
    let program = std::env::current_exe().map_err(|error| error.to_string())?;
    let output = Command::new(program).arg(ONE).arg(size).args(words).output().map_err(|error| error.to_string())?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    if !output.status.success() {
        return Err(format!("{size} subsystems: {}", String::from_utf8_lossy(&output.stderr)));
    }
    let pairs = text.lines().filter_map(|line| line.split_once(' '));
    let mut stages: Vec<(String, f64)> =
        pairs.filter_map(|(name, value)| Some((name.to_owned(), value.parse().ok()?))).collect();
    let peak = stages.iter().position(|(name, _)| name == PEAK).map(|k| stages.remove(k).1);
    Ok(Measured { count: size.parse().unwrap_or(f64::NAN), stages, peak })
}

const PEAK: &str = "peak";

/// Designs one network and prints `stage seconds` lines, and the peak in MiB.
fn one(arguments: &[String]) -> Result<(), String> {
    let count = arguments.first().and_then(|size| size.parse().ok()).ok_or("a size is missing")?;
    let source = network(&arguments[1..].iter().collect::<Vec<_>>(), count)?.source();
    let mut clock = Clock::new();
    let design =
        Design::watched(source.clone(), None, &mut clock).map_err(|mistakes| mistakes.render(&source, false))?;
    let emitted = Emitted::new(&design);
    clock.ended("Emitted");
    let json = design_json(&design);
    clock.ended("Exported");
    clock.stages.iter().for_each(|stage| println!("{} {:.6}", stage.name, stage.time.as_secs_f64()));
    println!("all {:.6}", clock.total().as_secs_f64());
    if let Some(peak) = peak_memory() {
        println!("{PEAK} {:.3}", peak as f64 / f64::from(1 << 20));
    }
    let text: usize = emitted.files.iter().map(|(_, text)| text.len()).sum();
    eprintln!("{} files, {text} bytes, and {} of design.json", emitted.files.len(), json.len());
    Ok(())
}

fn network(words: &[&String], count: usize) -> Result<LargeNetwork, String> {
    let width = (count as f64).sqrt().ceil() as usize;
    let mut network = LargeNetwork { plant: Plant::Rooms, shape: Shape::Grid(width), count, kinds: count };
    for word in words {
        match word.as_str() {
            "rooms" => network.plant = Plant::Rooms,
            "tanks" => network.plant = Plant::Tanks,
            "masses" => network.plant = Plant::Masses,
            "grid" => network.shape = Shape::Grid(width),
            "chain" => network.shape = Shape::Chain,
            "equal" => network.kinds = 1,
            other => return Err(format!("`{other}` is none of rooms, tanks, masses, grid, chain, equal, or a size")),
        }
    }
    Ok(network)
}

/// One row per stage: seconds by size, and the exponent of the growth between the last two sizes and over all.
fn table(measured: &[Measured]) -> String {
    let Some(last) = measured.last() else { return String::new() };
    let sizes: String = measured.iter().map(|m| format!("{:>12}", m.count)).collect();
    let mut text = format!("{:<18}{sizes}{:>12}{:>12}\n", "subsystems", "exponent", "last step");
    for (k, (name, _)) in last.stages.iter().enumerate() {
        let values: Vec<f64> = measured.iter().map(|m| m.stages.get(k).map_or(f64::NAN, |stage| stage.1)).collect();
        text += &row(&format!("{name}, s"), measured, &values);
    }
    let peaks: Option<Vec<f64>> = measured.iter().map(|m| m.peak).collect();
    text + &peaks.map(|peaks| row("peak memory, MiB", measured, &peaks)).unwrap_or_default()
}

fn row(name: &str, measured: &[Measured], values: &[f64]) -> String {
    let cells: String = values.iter().map(|value| format!("{value:>12.3}")).collect();
    let points: Vec<(f64, f64)> = measured.iter().zip(values).map(|(m, value)| (m.count.ln(), value.ln())).collect();
    let slope = |points: &[(f64, f64)]| match (points.first(), points.last()) {
        (Some(first), Some(last)) if points.len() > 1 => format!("{:>12.2}", (last.1 - first.1) / (last.0 - first.0)),
        _ => format!("{:>12}", "-"),
    };
    format!("{name:<18}{cells}{}{}\n", slope(&points), slope(&points[points.len().saturating_sub(2)..]))
}
