//! `dpc-codegen simulate system.toml --scenario s.toml`: the emitted controllers in closed loop.

use std::path::{Path, PathBuf};

use clap::Args;
use dpc_codegen::design::{Design, Request};
use dpc_codegen::diagnostic::{Diagnostics, Source};
use dpc_codegen::emit::{Emitted, module_name, write_all};
use dpc_codegen::simulate::{Findings, Format, History, Library, Report, Scenario, Shared, Start, is_planned, picture};
use dpc_codegen::spec::scenario::Scenario as Written;
use indicatif::{ProgressBar, ProgressStyle};

use super::failure::{Failure, say};

/// Run the emitted controllers in closed loop with the plant, and write what happened as tables and pictures
///
/// The controllers are compiled once and kept in a cache; another scenario for the same network does not compile again. Ends with exit
/// code 4 where a constraint was violated although every controller said that the guarantee holds, which would be a mistake in this
/// program; a violation after an upset or a lost message is none, and is listed.
#[derive(Args)]
pub struct Arguments {
    /// The network: model, constraints, weights (TOML)
    pub file: PathBuf,
    /// Set-points, disturbances, loads, messages, start (TOML) [default: set-points visit the ends of Y in turn]
    #[arg(long, value_name = "FILE")]
    pub scenario: Option<PathBuf>,
    /// Folder for tables and pictures [default: simulated/<name of the network>/<name of the scenario>]
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Tables to write, separated by commas: csv, json, npz
    #[arg(long, value_name = "FORMATS", value_delimiter = ',', default_value = "csv,json,npz")]
    pub format: Vec<Format>,
    /// Leave out the pictures
    #[arg(long)]
    pub no_plots: bool,
    /// Random numbers other than those of the scenario's seed
    #[arg(long, value_name = "NUMBER")]
    pub seed: Option<i64>,
    /// Where compiled controllers are kept
    #[arg(long, value_name = "FOLDER")]
    pub cache: Option<PathBuf>,
}

pub fn run(arguments: &Arguments) -> Result<(), Failure> {
    let (design, _, history) = performed(arguments, &Source::read(&arguments.file)?)?;
    let findings = Findings::new(&history, &design);
    let written = write(arguments, &history).map_err(Failure::System)?;
    say(&format!("{}\n{written}", Report { history: &history, findings: &findings }))?;
    match findings.broken.len() {
        0 => Ok(()),
        broken => Err(Failure::Broken(format!(
            "error: {broken} constraints were violated although the guarantee was said to hold; please report it"
        ))),
    }
}

/// The design, what was emitted of it, and what happened; nothing is written but to the cache.
pub fn performed(arguments: &Arguments, source: &Source) -> Result<(Design, Emitted, History), Failure> {
    let (design, scenario) = prepared(arguments, source)?;
    let emitted = Emitted::new(&design);
    let cache = arguments.cache.clone().unwrap_or_else(Library::default_folder);
    let library = built(&design, &emitted, &cache).map_err(Failure::System)?;
    let mut controllers = Shared::load(&library, &design).map_err(Failure::System)?;
    let history = simulated(&design, &scenario, &mut controllers).map_err(Failure::Input)?;
    Ok((design, emitted, history))
}

/// The design, with a start-up plan where the scenario asks for one, and the scenario drawn out for it.
fn prepared(arguments: &Arguments, source: &Source) -> Result<(Design, Scenario), Failure> {
    let in_network = |mistakes: Diagnostics| Failure::mistakes(source.clone(), mistakes);
    let Some(file) = &arguments.scenario else {
        let design = Design::new(source.clone()).map_err(in_network)?;
        let scenario = Scenario::visiting(&design).map_err(in_network)?;
        return Ok((design, scenario));
    };
    let text = Source::read(file)?;
    let in_scenario = |mistakes: Diagnostics| Failure::mistakes(text.clone(), mistakes);
    let mut given = Written::parse(&text).map_err(in_scenario)?;
    if let Some(seed) = arguments.seed {
        given.seed = Some(dpc_codegen::spec::At::new(seed, 0..0));
    }
    let request = Request { anywhere: is_planned(&given), ..Request::default() };
    let design = Design::requested(source.clone(), &request, &mut ()).map_err(in_network)?;
    let folder = file.parent().unwrap_or(Path::new(""));
    let scenario = Scenario::of(&given, &text, folder, &design).map_err(in_scenario)?;
    match &scenario.start {
        Start::Planned(start) if is_planned(&given) => {
            let plan = design.plan_from(start);
            let plan = plan.map_err(|refusal| in_scenario(refusal.diagnostic(&design.network, start).into()))?;
            Ok((Design { start: Some(plan), ..design }, scenario))
        }
        _ => Ok((design, scenario)),
    }
}

fn built(design: &Design, emitted: &Emitted, cache: &Path) -> Result<Library, String> {
    let library = Library::of(design, emitted, cache);
    if library.is_built() {
        return Ok(library);
    }
    // Drawn on a terminal only.
    let spinner = ProgressBar::new_spinner().with_message("compiling the controllers");
    spinner.enable_steady_tick(std::time::Duration::from_millis(100));
    let built = library.build();
    spinner.finish_and_clear();
    built.map(|()| library)
}

fn simulated(design: &Design, scenario: &Scenario, controllers: &mut Shared) -> Result<History, String> {
    let style = ProgressStyle::with_template("  simulating {bar:40} {pos} of {len} steps, {eta} left");
    let style = style.unwrap_or_else(|_| ProgressStyle::default_bar());
    let bar = ProgressBar::new(scenario.steps as u64).with_style(style);
    let history = dpc_codegen::simulate::run(design, scenario, controllers, &mut |step| bar.set_position(step as u64));
    bar.finish_and_clear();
    history
}

/// Writes everything or nothing; returns what to tell the user about it.
fn write(arguments: &Arguments, history: &History) -> Result<String, String> {
    let names = [&history.network, &history.scenario].map(|name| module_name(name));
    let default = || Path::new("simulated").join(&names[0]).join(&names[1]);
    let folder = arguments.out.clone().unwrap_or_else(default);
    let mut files: Vec<(PathBuf, Vec<u8>)> = Vec::new();
    for format in &arguments.format {
        let bytes = format.bytes(history).map_err(|error| format!("error: cannot write {}: {error}", format.name()))?;
        files.push((folder.join(format!("history.{}", format.name())), bytes));
    }
    for (i, track) in history.subsystems.iter().enumerate().filter(|_| !arguments.no_plots) {
        let svg = picture(history, i).map_err(|error| format!("error: cannot draw `{}`: {error}", track.name))?;
        files.push((folder.join(format!("{}.svg", track.name)), svg.into_bytes()));
    }
    let files: Vec<(PathBuf, &[u8])> = files.iter().map(|(path, bytes)| (path.clone(), &**bytes)).collect();
    write_all(&files).map_err(|error| format!("error: {error}"))?;
    Ok(format!("Written: {} files to {}\n", files.len(), folder.display()))
}
