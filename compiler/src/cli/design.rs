//! `dpc-codegen system.toml`: designs the controllers and writes them.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::Args;
use dpc_codegen::clock::Clock;
use dpc_codegen::design::Design;
use dpc_codegen::diagnostic::{Diagnostics, Source};
use dpc_codegen::emit::{Emitted, package_folder, write_all};
use dpc_codegen::export::design_json;
use dpc_codegen::footprint::{Measured, Target, Workshop, without};
use dpc_codegen::network::Scalar;
use dpc_codegen::summary::Summary;
use dpc_codegen::tuning::{Effort, Progress, Watch, frozen};
use dpc_codegen::{build, c_library};
use indicatif::{ProgressBar, ProgressStyle};

#[derive(Args)]
pub struct Arguments {
    /// The network: model, constraints, weights (TOML)
    file: PathBuf,
    /// Folder for the controllers [default: generated/<name of the network>]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Also write the design (models, gains, sets) for other tools
    #[arg(long, value_name = "FILE")]
    design: Option<PathBuf>,
    /// How long to search for better gains: 0 not at all, 3 longest [default: `effort` in the file, else 0]
    #[arg(long, value_name = "LEVEL", value_parser = clap::value_parser!(u8).range(0..=i64::from(Effort::MOST)))]
    effort: Option<u8>,
    /// What the controllers compute in, f64 or f32, instead of `scalar` in FILE
    #[arg(long, value_name = "TYPE", conflicts_with = "start")]
    scalar: Option<Scalar>,
    /// Start from the states in this file (TOML: a table per subsystem, with x0) instead of those in FILE
    #[arg(long, value_name = "FILE")]
    start: Option<PathBuf>,
    /// Also write the gains to a file of their own, as lines to be pasted into the network's
    #[arg(long, value_name = "FILE")]
    gains_out: Option<PathBuf>,
    /// Build the controllers with cargo for a target, and write what they take into their headers: code, constants, memory, stack
    #[arg(long, value_name = "TARGET", num_args = 0..=1, require_equals = true, default_missing_value = "host")]
    measure: Vec<String>,
    /// Count the solver's iterations on that many problems per subsystem, certify small ones, and set the limits by it
    #[arg(long, value_name = "SAMPLES", num_args = 0..=1, require_equals = true, default_missing_value = "10000", value_parser = samples)]
    iterations: Option<usize>,
    /// What to write: controllers in Rust, or a package for C with headers and libraries
    #[arg(long, value_name = "LANGUAGE", default_value = "rust", value_parser = ["rust", "c"])]
    emit: String,
    /// What the libraries for C are built for, as rustc calls it; a processor may follow: thumbv7em-none-eabihf/cortex-m7
    #[arg(long, value_name = "TARGET", default_value = "host")]
    target: String,
    /// Print time and peak memory of every stage, one per line
    #[arg(long)]
    timings: bool,
}

pub fn run(arguments: &Arguments) -> Result<(), String> {
    arguments.check_targets()?;
    let mut watch = Progressing { clock: Clock::new(), bar: None };
    let source = build::read(&arguments.file)?;
    let design = designed(arguments, &source, &mut watch)?;
    let mut clock = watch.clock;
    let design = match arguments.iterations {
        Some(samples) => design.counted(samples),
        None => design,
    };
    if design.samples.is_some() {
        clock.ended("Iterations");
    }
    let mut emitted = Emitted::new(&design);
    clock.ended("Emitted");
    if !arguments.measure.is_empty() {
        measured(&arguments.measure, &design, &mut emitted)?;
        clock.ended("Measured");
    }
    let written = match arguments.emit.as_str() {
        "c" => write_c(arguments, &design, &emitted)?,
        _ => write(arguments, &design, &emitted)?,
    };
    clock.ended("Written");
    let timings = if arguments.timings { clock.table() } else { String::new() };
    print(&format!("{}\nTime: {clock}\n{timings}{written}", Summary::new(&design, &emitted)))
}

fn designed(arguments: &Arguments, source: &Source, watch: &mut Progressing) -> Result<Design, String> {
    let rendered = |source: &Source| {
        let source = source.clone();
        move |mistakes: Diagnostics| mistakes.render(&source, std::io::stderr().is_terminal())
    };
    let effort = arguments.effort.and_then(Effort::new);
    let Some(file) = &arguments.start else {
        let design = match arguments.scalar {
            Some(scalar) => Design::in_scalar(source.clone(), scalar, effort, watch),
            None => Design::watched(source.clone(), effort, watch),
        };
        return design.map_err(rendered(source));
    };
    let starts = build::read(file)?;
    let design = Design::anywhere(source.clone(), effort, watch).map_err(rendered(source))?;
    let design = design.started(&starts).map_err(rendered(&starts))?;
    watch.clock.ended("Start");
    Ok(design)
}

/// Notes what the controllers take on every target, in a folder that is gone afterwards.
fn measured(targets: &[String], design: &Design, emitted: &mut Emitted) -> Result<(), String> {
    let targets: Vec<Target> = targets.iter().map(|target| Target::new(target)).collect();
    in_workshop("measured", |workshop| Measured::new(design, emitted, &targets, workshop))?.note(emitted);
    Ok(())
}

/// Builds in a folder that is gone afterwards; `part` of cargo's own stays, where that is set.
fn in_workshop<T>(part: &str, work: impl FnOnce(&Workshop) -> Result<T, String>) -> Result<T, String> {
    let folder = std::env::temp_dir().join(format!("dpc-codegen-{}", std::process::id()));
    let mut workshop = Workshop::new(folder.clone());
    if let Some(out) = std::env::var_os("CARGO_TARGET_DIR") {
        workshop.out = PathBuf::from(out).join(part);
    }
    let done = work(&workshop);
    // What remains is in the system's folder for it.
    let _ = std::fs::remove_dir_all(&folder);
    done
}

/// Builds and writes everything or nothing; returns what to tell the user about it.
fn write_c(arguments: &Arguments, design: &Design, emitted: &Emitted) -> Result<String, String> {
    let default = || Path::new("generated").join(package_folder(&design.network) + "_c");
    let folder = arguments.out.clone().unwrap_or_else(default);
    let target = Target::new(&arguments.target);
    let written = in_workshop("c", |workshop| c_library::write(design, emitted, &folder, &target, workshop))?;
    let shown =
        written.iter().filter(|path| !path.starts_with(folder.join("src")) && !path.starts_with(folder.join("panic")));
    let besides = arguments.design.as_ref().map(|path| (path.clone(), design_json(design)));
    let besides: Vec<_> = besides.iter().map(|(path, text)| (path.clone(), text.as_str())).collect();
    write_all(&besides).map_err(|error| format!("error: {error}"))?;
    let shown: String = shown
        .chain(besides.iter().map(|(path, _)| path))
        .map(|path| format!("Written:   {}\n", path.display()))
        .collect();
    Ok(shown)
}

impl Arguments {
    /// Nothing that is read may be written, and no folder can be; better said before the design than after it.
    fn check_targets(&self) -> Result<(), String> {
        let inputs: Vec<_> = [Some(&self.file), self.start.as_ref()].into_iter().flatten().collect();
        let same = |one: &Path, other: &Path| match (one.canonicalize(), other.canonicalize()) {
            (Ok(one), Ok(other)) => one == other,
            _ => one == other,
        };
        for (option, target) in [("--design", &self.design), ("--gains-out", &self.gains_out)] {
            let Some(target) = target else { continue };
            let shown = target.display();
            if inputs.iter().any(|input| same(input, target)) {
                return Err(format!("error: {option} {shown} would overwrite an input; choose another file"));
            }
            if target.is_dir() {
                return Err(format!("error: {option} {shown} is a folder; name a file in it"));
            }
        }
        match (&self.design, &self.gains_out) {
            (Some(design), Some(gains)) if same(design, gains) => {
                Err(format!("error: --design and --gains-out both write {}", design.display()))
            }
            _ => Ok(()),
        }
    }
}

/// Writes everything or nothing; returns what to tell the user about it.
fn write(arguments: &Arguments, design: &Design, emitted: &Emitted) -> Result<String, String> {
    let default = || Path::new("generated").join(package_folder(&design.network));
    let folder = arguments.out.clone().unwrap_or_else(default);
    let json = arguments.design.as_ref().map(|path| (path.clone(), design_json(design)));
    let gains = arguments.gains_out.as_ref().map(|path| (path.clone(), frozen(&design.network, &design.gains)));
    let texts = kept(emitted, &folder);
    let mut files = texts.iter().map(|(path, text)| (path.clone(), text.as_str())).collect::<Vec<_>>();
    files.extend(json.iter().chain(&gains).map(|(path, text)| (path.clone(), text.as_str())));
    let changed = write_all(&files).map_err(|error| format!("error: {error}"))?;
    if files.len() > MOST_LISTED {
        let written = changed.iter().filter(|changed| **changed).count();
        let folder = folder.display();
        return Ok(format!("Written:   {written} of {} files, the controllers in {folder}\n", files.len()));
    }
    let word = |changed: bool| if changed { "Written:  " } else { "Unchanged:" };
    Ok(files
        .iter()
        .zip(changed)
        .map(|((path, _), changed)| format!("{} {}\n", word(changed), path.display()))
        .collect())
}

/// What is to be in each file: what is there, where that says the same and what it takes besides.
fn kept(emitted: &Emitted, folder: &Path) -> Vec<(PathBuf, String)> {
    let of = |(path, text): (PathBuf, &str)| {
        let there = std::fs::read_to_string(&path).ok().filter(|there| without(there) == text);
        (path, there.unwrap_or_else(|| text.to_owned()))
    };
    emitted.paths(folder).into_iter().map(of).collect()
}

/// How many samples a word stands for.
fn samples(word: &str) -> Result<usize, String> {
    let count = word.parse().ok().filter(|count| *count > 0);
    count.ok_or_else(|| "a whole number of at least 1 is expected, such as 10000".to_owned())
}

/// Files that are named one by one.
const MOST_LISTED: usize = 40;

/// A reader that stops early, such as `head`, is no mistake of ours.
pub fn print(text: &str) -> Result<(), String> {
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => Err(format!("error: cannot print: {error}")),
        _ => Ok(()),
    }
}

/// The clock, with a progress bar while a search for gains is under way.
struct Progressing {
    clock: Clock,
    bar: Option<ProgressBar>,
}

impl Watch for Progressing {
    fn stage(&mut self, name: &'static str) {
        self.bar.take().inspect(ProgressBar::finish_and_clear);
        self.clock.ended(name);
    }

    fn searched(&mut self, progress: Progress) {
        // Drawn on a terminal only.
        let bar = self.bar.get_or_insert_with(|| bar(progress.budget));
        bar.set_position(progress.compared as u64);
    }
}

fn bar(budget: usize) -> ProgressBar {
    let style = ProgressStyle::with_template("  comparing gains {bar:40} {pos} of {len}, {eta} left");
    ProgressBar::new(budget as u64).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
