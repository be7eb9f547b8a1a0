//! `dpc-codegen system.toml`: designs the controllers of a network and writes them as Rust.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Parser;
use dpc_codegen::build;
use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::Source;
use dpc_codegen::emit::{Emitted, package_folder, write_all};
use dpc_codegen::export::design_json;
use dpc_codegen::summary::Summary;

/// Designs one predictive controller per subsystem of the network in FILE and writes them as Rust.
///
/// Prints margins, sets, sizes and what was written. Where FILE has mistakes, prints them, writes nothing, and ends
/// with exit code 1.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// The network: model, constraints, weights (TOML)
    file: PathBuf,
    /// Folder for the controllers [default: generated/<name of the network>]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Also write the design (models, gains, sets) for other tools
    #[arg(long, value_name = "FILE")]
    design: Option<PathBuf>,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{}", message.trim_end());
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let mut clock = Clock::new();
    let source = build::read(&arguments.file)?;
    let design = designed(&source, &mut clock)?;
    let emitted = Emitted::new(&design);
    clock.stage("Emitted");
    let written = write(arguments, &design, &emitted)?;
    print(&format!("{}\nTime: {clock}\n{written}", Summary::new(&design, &emitted)))
}

fn designed(source: &Source, clock: &mut Clock) -> Result<Design, String> {
    let design = Design::observed(source.clone(), |stage| clock.stage(stage));
    design.map_err(|mistakes| mistakes.render(source, std::io::stderr().is_terminal()))
}

/// Writes everything or nothing; returns what to tell the user about it.
fn write(arguments: &Arguments, design: &Design, emitted: &Emitted) -> Result<String, String> {
    let default = || Path::new("generated").join(package_folder(&design.network));
    let folder = arguments.out.clone().unwrap_or_else(default);
    let json = arguments.design.as_ref().map(|path| (path.clone(), design_json(design)));
    let mut files = emitted.paths(&folder);
    files.extend(json.iter().map(|(path, text)| (path.clone(), text.as_str())));
    let changed = write_all(&files).map_err(|error| format!("error: {error}"))?;
    let word = |changed: bool| if changed { "Written:  " } else { "Unchanged:" };
    Ok(files
        .iter()
        .zip(changed)
        .map(|((path, _), changed)| format!("{} {}\n", word(changed), path.display()))
        .collect())
}

/// A reader that stops early, such as `head`, is no mistake of ours.
fn print(text: &str) -> Result<(), String> {
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(format!("error: cannot print: {error}")),
        _ => Ok(()),
    }
}

/// What each stage took.
struct Clock {
    last: Instant,
    stages: Vec<(&'static str, Duration)>,
}

impl Clock {
    fn new() -> Self {
        Self { last: Instant::now(), stages: Vec::new() }
    }

    /// Everything since the last call was `name`.
    fn stage(&mut self, name: &'static str) {
        let now = Instant::now();
        self.stages.push((name, now - self.last));
        self.last = now;
    }
}

impl std::fmt::Display for Clock {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let milliseconds = |time: Duration| time.as_secs_f64() * 1e3;
        let total: Duration = self.stages.iter().map(|(_, time)| *time).sum();
        write!(f, "{:.1} ms, of which\n ", milliseconds(total))?;
        for (k, (name, time)) in self.stages.iter().enumerate() {
            write!(f, "{} {name} {:.1}", if k == 0 { "" } else { "," }, milliseconds(*time))?;
        }
        Ok(())
    }
}
