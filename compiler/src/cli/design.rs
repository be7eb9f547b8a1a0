//! `dpc-codegen system.toml`: designs the controllers and writes them.

use std::path::{Path, PathBuf};

use clap::Args;
use dpc_codegen::c_library;
use dpc_codegen::design::{Design, Request};
use dpc_codegen::diagnostic::Source;
use dpc_codegen::emit::{Emitted, controllers, package_folder, packages, write_all};
use dpc_codegen::export::design_json;
use dpc_codegen::footprint::{Measured, Target, Workshop, without};
use dpc_codegen::network::Scalar;
use dpc_codegen::spec::Spec;
use dpc_codegen::summary::Summary;
use dpc_codegen::tuning::{Effort, frozen};
use serde_json::json;

use super::failure::{Failure, say};
use super::output::{Format, Output, print_json};
use super::progress::Progressing;

#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    question: Question,
    /// Folder for the controllers [default: generated/<name of the network>]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Write a complete crate per subsystem into FOLDER, with a manual; controllers alone are written where --out asks for them
    #[arg(long = "crate", value_name = "FOLDER")]
    packages: Option<PathBuf>,
    /// Also write the design (models, gains, sets) for other tools
    #[arg(long, value_name = "FILE")]
    design: Option<PathBuf>,
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
    #[command(flatten)]
    pub output: Output,
}

/// What is to be designed.
#[derive(Args)]
pub struct Question {
    /// The network: model, constraints, weights (TOML)
    // Optional only where a subcommand is called instead, which clap sees to.
    #[arg(required = true)]
    file: Option<PathBuf>,
    /// How long to search for better gains: 0 not at all, 3 longest [default: `effort` in the file, else 0]
    #[arg(long, value_name = "LEVEL", value_parser = clap::value_parser!(u8).range(0..=i64::from(Effort::MOST)))]
    effort: Option<u8>,
    /// What the controllers compute in, f64 or f32, instead of `scalar` in FILE
    #[arg(long, value_name = "TYPE")]
    scalar: Option<Scalar>,
    /// Start from the states in this file (TOML: a table per subsystem, with x0) instead of those in FILE
    #[arg(long, value_name = "FILE")]
    start: Option<PathBuf>,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    arguments.check_targets().map_err(Failure::Usage)?;
    let mut watch = Progressing::new(arguments.output.quiet);
    let design = designed(&arguments.question, &mut watch)?;
    let design = match arguments.iterations {
        Some(samples) => design.counted(samples),
        None => design,
    };
    if design.samples.is_some() {
        watch.clock.ended("Iterations");
    }
    let mut emitted = Emitted::new(&design);
    watch.clock.ended("Emitted");
    if !arguments.measure.is_empty() {
        measured(&arguments.measure, &design, &mut emitted).map_err(Failure::System)?;
        watch.clock.ended("Measured");
    }
    let written = match arguments.emit.as_str() {
        "c" => write_c(arguments, &design, &emitted),
        _ => write(arguments, &design, &emitted),
    };
    let written = written.map_err(Failure::System)?;
    watch.clock.ended("Written");
    watch.end();
    told(arguments, &watch, &Summary::new(&design, &emitted), &written)
}

fn told(
    arguments: &Arguments,
    watch: &Progressing,
    summary: &Summary<'_>,
    written: &[(PathBuf, bool)],
) -> Result<(), Failure> {
    let clock = &watch.clock;
    if arguments.output.format == Format::Json {
        let files =
            written.iter().map(|(path, changed)| json!({ "path": path.display().to_string(), "changed": changed }));
        let files: Vec<_> = files.collect();
        let stages = clock
            .stages
            .iter()
            .map(|stage| json!({ "stage": stage.name, "seconds": stage.time.as_secs_f64(), "peak_bytes": stage.peak }));
        let stages: Vec<_> = if arguments.timings { stages.collect() } else { Vec::new() };
        let done = json!({ "outcome": "done", "diagnostics": [], "summary": summary.to_json(), "files": files, "timings": stages });
        return print_json(&done).map_err(|error| Failure::System(format!("error: cannot print: {error}")));
    }
    let timings = if arguments.timings { clock.table() } else { String::new() };
    say(&format!("{summary}\nTime: {clock}\n{timings}{}", listed(written)))
}

/// The design that is asked for, with the plan for its start where one is given.
pub fn designed(question: &Question, watch: &mut Progressing) -> Result<Design, Failure> {
    let file = question.file.as_deref().unwrap_or_else(|| unreachable!("clap asks for FILE where there is no command"));
    let source = Source::read(file)?;
    let effort = question.effort.and_then(Effort::new);
    let request = Request { scalar: question.scalar, effort, anywhere: question.start.is_some() };
    let starts = question.start.as_deref().map(Source::read).transpose()?;
    let mistakes = |source: Source| move |mistakes| Failure::mistakes(source, mistakes);
    let design = Design::requested(source.clone(), &request, watch).map_err(mistakes(source))?;
    let Some(starts) = starts else { return Ok(design) };
    let design = design.started(&starts).map_err(mistakes(starts))?;
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

/// Builds and writes everything or nothing; returns the files that people look at.
fn write_c(arguments: &Arguments, design: &Design, emitted: &Emitted) -> Result<Vec<(PathBuf, bool)>, String> {
    let default = || Path::new("generated").join(package_folder(&design.network) + "_c");
    let folder = arguments.out.clone().unwrap_or_else(default);
    let target = Target::new(&arguments.target);
    let mut written = in_workshop("c", |workshop| c_library::write(design, emitted, &folder, &target, workshop))?;
    written.retain(|path| !["src", "panic"].iter().any(|part| path.starts_with(folder.join(part))));
    let besides = arguments.besides(design);
    let besides: Vec<_> = besides.iter().map(|(path, text)| (path.clone(), text.as_str())).collect();
    write_all(&besides).map_err(|error| format!("error: {error}"))?;
    written.extend(besides.into_iter().map(|(path, _)| path));
    Ok(written.into_iter().map(|path| (path, true)).collect())
}

impl Arguments {
    /// What else was asked for: paths and texts.
    fn besides(&self, design: &Design) -> Vec<(PathBuf, String)> {
        let json = self.design.as_ref().map(|path| (path.clone(), design_json(design)));
        let gains = self.gains_out.as_ref().map(|path| (path.clone(), frozen(&design.network, &design.gains)));
        json.into_iter().chain(gains).collect()
    }

    /// Nothing that is read may be written, and no folder can be; better said before the design than after it.
    fn check_targets(&self) -> Result<(), String> {
        let (c, target) = (self.emit == "c", self.target != "host");
        if c && self.packages.is_some() {
            return Err("error: --crate writes Rust, and --emit c writes C; ask for one after the other".to_owned());
        }
        if target && !c {
            return Err("error: --target is what libraries for C are built for; add --emit c".to_owned());
        }
        let imported = self
            .question
            .file
            .iter()
            .filter_map(|file| Source::read(file).ok())
            .flat_map(|source| Spec::files(&source))
            .collect::<Vec<_>>();
        let inputs: Vec<_> = [self.question.file.as_ref(), self.question.start.as_ref()]
            .into_iter()
            .flatten()
            .chain(&imported)
            .collect();
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

/// Writes everything or nothing; returns the files, and whether each changed.
fn write(arguments: &Arguments, design: &Design, emitted: &Emitted) -> Result<Vec<(PathBuf, bool)>, String> {
    let besides = arguments.besides(design);
    let mut texts = folder(arguments, design).map(|folder| kept(emitted.paths(&folder))).unwrap_or_default();
    texts.extend(arguments.packages.iter().flat_map(|folder| crates(design, emitted, folder)));
    let mut files = texts.iter().map(|(path, text)| (path.clone(), text.as_str())).collect::<Vec<_>>();
    files.extend(besides.iter().map(|(path, text)| (path.clone(), text.as_str())));
    let changed = write_all(&files).map_err(|error| format!("error: {error}"))?;
    Ok(files.into_iter().map(|(path, _)| path).zip(changed).collect())
}

/// Of the controllers alone.
fn folder(arguments: &Arguments, design: &Design) -> Option<PathBuf> {
    let default = || Path::new("generated").join(package_folder(&design.network));
    arguments.out.clone().or_else(|| arguments.packages.is_none().then(default))
}

/// One line per file, or one for very many.
fn listed(written: &[(PathBuf, bool)]) -> String {
    if written.len() > MOST_LISTED {
        let changed = written.iter().filter(|(_, changed)| *changed).count();
        let folder = written.first().and_then(|(path, _)| path.parent()).unwrap_or(Path::new("."));
        return format!("Written:   {changed} of {} files, the controllers in {}\n", written.len(), folder.display());
    }
    let word = |changed: bool| if changed { "Written:  " } else { "Unchanged:" };
    written.iter().map(|(path, changed)| format!("{} {}\n", word(*changed), path.display())).collect()
}

/// What is to be in each file: what is there, where that says the same and what it takes besides.
fn kept(files: Vec<(PathBuf, &str)>) -> Vec<(PathBuf, String)> {
    let of = |(path, text): (PathBuf, &str)| {
        let there = std::fs::read_to_string(&path).ok().filter(|there| without(there) == text);
        (path, there.unwrap_or_else(|| text.to_owned()))
    };
    files.into_iter().map(of).collect()
}

/// The crates of the nodes, whose manuals say what is kept of the controllers' files.
fn crates(design: &Design, emitted: &Emitted, folder: &Path) -> Vec<(PathBuf, String)> {
    let texts = emitted.files.iter().skip(1).map(|(_, text)| text.as_str());
    let kept = kept(controllers(design, folder).into_iter().zip(texts).collect());
    let mut noted = emitted.clone();
    noted.files.iter_mut().skip(1).zip(kept).for_each(|((_, text), (_, kept))| *text = kept);
    packages(design, &noted, folder)
}

/// How many samples a word stands for.
fn samples(word: &str) -> Result<usize, String> {
    let count = word.parse().ok().filter(|count| *count > 0);
    count.ok_or_else(|| "a whole number of at least 1 is expected, such as 10000".to_owned())
}

/// Files that are named one by one.
const MOST_LISTED: usize = 40;
